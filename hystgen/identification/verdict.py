"""What the figures of a fit say about its model, and what to do next."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hystgen.identification import faults, pi, quality
from hystgen.identification.pi import FreeRunErrors, IdentificationError
from hystgen.identification.reduction import Course
from hystgen.records.columns import parse_columns

Array = NDArray[np.float64]

ABOVE_NOISE = 1.25
"""[times the noise] A residual above this stands clear of the noise; the same limit as in a diagnosis, where it is set
by: blind none."""

COLOURED, SHORT = 2.0, 4.0
"""[times the noise] Limit for a residual whose correlation is shorter than this many [samples]: noise behind a filter,
or between samples, exceeds what neighbouring samples show; the same limit as in a diagnosis."""

HALF = 0.5
"""[fraction of the variance of the output] A model that explains less leaves more than it explains."""

Kind = Literal["good", "missing", "untold", "wrong"]

Direction = Literal["", "falls", "clockwise"]
"""How the output or its loops run against the model."""

WRONG_WAY = {
    "falls": "y falls when v rises, which the model cannot follow",
    "clockwise": "the loops run clockwise, which the model cannot follow: the columns may be exchanged",
}

NO_OPTIONS: Mapping[str, str] = MappingProxyType({})

MOST_NAMED = 3
"""More records than this are not named in a command."""


class UselessError(IdentificationError):
    """A model that is of no use, raised with `strict`; `str()` says why."""


@dataclass(frozen=True)
class Verdict:
    """What the figures say: `kind`, and `why` as a sentence without a full stop.

    `good`: only noise remains; `missing`: the residual stands clear of the noise; `untold`: these records cannot tell;
    `wrong`: columns or records are wrong. `useless`: the model is of no use.
    """

    kind: Kind
    why: str
    useless: bool = False
    direction: Direction = ""

    def next_step(
        self, parameter_file: str, records: Sequence[str], held: Sequence[str] = (), operator: str = "",
        options: Mapping[str, str] = NO_OPTIONS,
    ) -> tuple[str, str]:
        """The next step, and its command; `records`, `held`: the files given, `operator`: an option of `emit`,
        `options`: how the records were read and compared, to be given again."""
        data = " ".join(map(shlex.quote, records)) if len(records) <= MOST_NAMED else "RECORDS"
        data += "".join(f" --holdout {shlex.quote(each)}" for each in (held if len(held) <= MOST_NAMED else ["OTHERS"]))
        file, again = shlex.quote(parameter_file), typed(options)
        if self.direction:
            columns = parse_columns(options["--columns"]) if "--columns" in options else {}
            said, changed = _turned(self.direction, columns)
            again = typed({**options, "--columns": ",".join(f"{ours}={theirs}" for ours, theirs in changed.items())})
            return f"{said}, and fit again", f"hystgen identify {data}{again} -o {file}"
        return {
            "good": ("write the C", f"hystgen emit {file} -o firmware/{operator}"),
            "missing": ("find out what the model is missing", f"hystgen diagnose {file} {data}{again} -o diagnosis/"),
            "untold": ("take another record, with drives that show it", f"hystgen diagnose --plan {file} -o plan/"),
            "wrong": (
                "look at the record, check the columns, and fit again",
                f"hystgen identify {data}{again} -o {file} --report report/",
            ),
        }[self.kind]


def typed(options: Mapping[str, str]) -> str:
    """Options as they are typed in a shell, each after a space."""
    return "".join(f" {option} {shlex.quote(value)}" for option, value in options.items())


def _turned(direction: Direction, columns: Mapping[str, str]) -> tuple[str, dict[str, str]]:
    """What to do about a direction that no model follows, and the columns that do it instead of those given."""
    v, y = columns.get("v", "v"), columns.get("y", "y")
    if direction == "clockwise":
        return "exchange the columns", {**columns, "v": y, "y": v}
    return "change the sign of y", {**columns, "y": y.removeprefix("-") if y.startswith("-") else f"-{y}"}


def verdict(
    own: Sequence[FreeRunErrors], held: Sequence[FreeRunErrors], direction: Direction, unit: str
) -> Verdict:
    """The verdict on a model with errors `own` on the records it was fitted to and `held` on those held out, if any.

    `direction`: how the output or its loops run against the model, if they do; `unit`: of the output.
    """
    judged = held or own
    left, noise = _rms([each.error for each in judged]), _noise(judged)
    u, of = f" {unit}" if unit else "", "held-out samples" if held else "the records"
    times = max(quality.correlation_time(e[np.isfinite(e)]) for e in (each.error for each in judged))
    little = faults.LITTLE * max(each.course.output_range for each in judged)
    least = max((COLOURED if times < SHORT else ABOVE_NOISE) * noise, little)
    line, share = _line(own, judged), max(_explained(own), _explained(judged))
    off = f"on {of} the model is off by {left:.3g}{u} rms"
    if direction:
        return Verdict("wrong", WRONG_WAY[direction], True, direction)
    if share < HALF:
        return Verdict("wrong", f"the model explains only {100.0 * share:.0f} % of the variance of the output", True)
    if left > least:
        # the end of a record alone may hardly move; a record that is held out as a whole is a fair judge
        whole = {each.course.name for each in judged}.isdisjoint(each.course.name for each in own)
        alone = whole or _rms([each.error for each in own]) > pi.CLEARLY * _line(own, own)
        if left > pi.CLEARLY * line and alone:
            hardly = "hardly more" if line > left else "no more"
            return Verdict("missing", f"{off} and a straight line by {line:.3g}{u}, {hardly}", True)
        above = f"{left / noise:.2g} times" if left <= 100.0 * noise else "far above"
        return Verdict("missing", f"{off}, {above} the noise")
    if not held:
        return Verdict("untold", "nothing was held out, so the error on other records is unknown")
    if line <= least and noise > little:
        plain = f"a straight line is off by {line:.3g}{u} rms, which is only noise"
        return Verdict("untold", f"{plain}: no hysteresis is visible")
    return Verdict("good", f"{off}, which is noise")


def _explained(errors: Sequence[FreeRunErrors]) -> float:
    """The fraction of the outputs' variance that the model explains."""
    spread = _rms([each.course.y[each.course.compared] for each in errors])
    return max(1.0 - (_rms([each.error for each in errors]) / spread) ** 2, 0.0) if spread > 0.0 else 0.0


def _rms(parts: Sequence[Array]) -> float:
    """rms of all known samples, each part without its mean."""
    known = [x[np.isfinite(x)] for x in parts]
    about = np.concatenate([x - np.mean(x) for x in known if len(x)] or [np.zeros(1)])
    return float(np.sqrt(np.mean(about**2)))


def _noise(judged: Sequence[FreeRunErrors]) -> float:
    """rms of the white noise in the errors, or in the outputs if less, but no less than the outputs' resolution."""
    found = []
    for signals in ([each.error for each in judged], [each.course.y[each.course.compared] for each in judged]):
        known = [x[np.isfinite(x)] for x in signals]
        squares = [(faults.white_noise(x) ** 2, len(x)) for x in known if len(x) > 3]
        found.append(math.sqrt(sum(s * n for s, n in squares) / max(sum(n for _, n in squares), 1)))
    grains = [_grain(each.course) for each in judged]
    return max(min(found), min(grains, default=0.0) / math.sqrt(12.0))


def _grain(item: Course) -> float:
    """Smallest step between compared outputs."""
    step = np.abs(np.diff(item.y[item.compared]))
    return float(np.min(step[step > 0.0], initial=np.inf)) if np.any(step > 0.0) else 0.0


def _line(own: Sequence[FreeRunErrors], judged: Sequence[FreeRunErrors]) -> float:
    """rms error of the straight line through the fitted records, with a free offset per record."""
    pairs = [(each.course.v[at], each.course.y[at]) for each in own if len(at := each.course.compared)]
    v, y = (np.concatenate([x - np.mean(x) for x in some]) for some in zip(*pairs, strict=True))
    slope = float(v @ y) / float(v @ v) if np.any(v) else 0.0
    return _rms([(each.course.y - slope * each.course.v)[each.course.compared] for each in judged])
