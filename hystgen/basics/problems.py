"""Problems in an input file: what is wrong, where, and what to do."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

Path = tuple[str | int, ...]
"""Path of a value in the file: keys and list indices from the top level down."""

SHOWN = 60
"""[characters] Maximum length at which a message quotes a user's text."""


@dataclass(frozen=True)
class Problem:
    """A problem in a file.

    `path` is dotted (`model.pi.weights[2]`, empty for the file as a whole); `message` says what is wrong and, after a
    semicolon, what to do; `line` and `column` count from 1, and are None for a problem without a position.
    """

    path: str
    message: str
    line: int | None = None
    column: int | None = None

    @property
    def named(self) -> str:
        """`PATH: MESSAGE`."""
        return f"{self.path}{': ' if self.path else ''}{self.message}"

    def text(self, file: str) -> str:
        """The line printed for this problem: `FILE:LINE:COL: error: PATH: MESSAGE`."""
        place = file if self.line is None else f"{file}:{self.line}:{self.column}"
        return f"{place}: error: {self.named}"


class ParameterError(ValueError):
    """A parameter file was refused; the error lists every problem found in it.

    `problems` is sorted by position; `file` is the name as the user gave it; `str()` gives one line per problem.
    """

    def __init__(self, file: str, problems: Iterable[Problem]) -> None:
        self.file = file
        self.problems = sorted(problems, key=lambda p: (p.line or 0, p.column or 0))
        super().__init__("\n".join(problem.text(file) for problem in self.problems))


def nearest(word: str, known: Sequence[str]) -> str:
    """`did you mean ..?` with the closest known word, or several equally close ones; empty if none is close."""
    near = difflib.get_close_matches(word.lower(), known, len(known), 0.6) if len(word) <= 60 and known else []
    shares = [difflib.SequenceMatcher(None, each, word.lower()).ratio() for each in near]
    closest = [each for each, share in zip(near, shares, strict=True) if share == shares[0]]
    return f"did you mean {' or '.join(sorted(closest))}?" if closest else ""


def printable(text: str) -> str:
    """A user's text as messages quote it: cut to `SHOWN` characters, with unprintable ones then escaped."""
    if len(text) > SHOWN:
        text = text[: SHOWN - 3] + "..."
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def shown(value: object) -> str:
    """A value as messages name it: numbers as they are, text in quotes, lists and mappings by kind."""
    if isinstance(value, str):
        return f'the text "{printable(value)}"'
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and abs(value) >= 10**17:
        value = float(value) if abs(value) < 1 << 1023 else float("inf" if value > 0 else "-inf")
    if isinstance(value, int | float):
        return int.__repr__(value) if isinstance(value, int) else float.__repr__(value)
    if isinstance(value, tuple | list):
        return "a list"
    return "a mapping" if isinstance(value, dict) else printable(type(value).__name__)


def path_text(path: Path) -> str:
    """A path as messages name it: `model.pi.weights[2]`; keys that are not plain words are quoted."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
            continue
        plain = part.isascii() and part.replace("_", "a").replace("-", "a").isalnum() and len(part) <= SHOWN
        text += ("." if text else "") + (part if plain else f'"{printable(part)}"')
    return text


class RecordError(ValueError):
    """A data file was refused; the error lists every problem found in it.

    `problems` has one line per problem, `FILE:LINE:COL: error: what; what to do` (`FILE: error: ...` if there is no
    line); `str()` joins them.
    """

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems = list(problems)
        super().__init__("\n".join(self.problems))


class PlanError(ValueError):
    """A plan cannot be made, for the reasons in `problems`; `str()` gives one line per problem."""

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems = list(problems)
        super().__init__("\n".join(f"error: {problem}" for problem in self.problems))


class EffectsError(ValueError):
    """An effect cannot be used at all, or not with these records."""


class UnsupportedEffectsError(EffectsError):
    """A request is not yet supported for a model with effects; the message names the effects."""


class NotInvertibleError(ValueError):
    """The requested inverse of a well-formed model does not exist; `reasons` has one line per reason."""

    def __init__(self, reasons: Sequence[str]) -> None:
        super().__init__("the model has no inverse: " + "; ".join(reasons))
        self.reasons = list(reasons)


class FormatError(ValueError):
    """The parameters of a model do not fit the arithmetic, or another use of its C.

    `problems`: pairs of a path in the parameter file, or `()`, and what is wrong there; `str()` gives one line each.
    """

    def __init__(self, *problems: str | tuple[Path, str]) -> None:
        self.problems = [((), problem) if isinstance(problem, str) else problem for problem in problems]
        super().__init__("\n".join(Problem(path_text(path), message).named for path, message in self.problems))


class SampleWarning(UserWarning):
    """A model limited, held or extrapolated samples; `str()` says which of these, and how many."""


def counted(number: int, one: str, several: str = "") -> str:
    """`1 sample`, `2 samples`; `several`: the plural, if it is not `one` with an s."""
    return f"{number} {one if number == 1 else several or f'{one}s'}"


def capital(text: str) -> str:
    """The text with its first letter in upper case."""
    return text[:1].upper() + text[1:]


def duration(time: float) -> str:
    """A time with the prefix that suits it, as in `5 ms`."""
    size, unit = next(((x, u) for x, u in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")) if time >= x), (1e-9, "ns"))
    return f"{time / size:.4g} {unit}"


FACTOR = 10.0
"""[times] Ratios from this value on are worded as factors: "32 times" is easier to read than "3200 %", which has more
than the three digits shown. Only wording depends on it. Changed by:
report::test_shares_of_ten_times_and_more_are_factors."""


def percent(share: float, digits: str = ".3g", of: str = "") -> str:
    """`12 % of the range`, or `32 times the range`; without `of`, only `12 %` or `32 times`."""
    if abs(share) >= FACTOR:
        return f"{share:.3g} times{f' {of}' if of else ''}"
    return f"{100.0 * share:{digits}} %{f' of {of}' if of else ''}"
