"""Which column of a file is which of ours: t, v, y, u."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from hystgen.basics.problems import printable
from hystgen.records.sampling import Step
from hystgen.records.units import is_time_unit, split_unit

LISTED = 20
"""Columns or bad cells named one by one before the rest is only counted."""

STANDARD = ("t", "v", "y")

MEANINGS = {
    "t": frozenset(("t", "time", "times", "timestamp", "zeit", "temps", "tiempo")),
    "v": frozenset(
        ("v", "u", "voltage", "volt", "volts", "drive", "input", "spannung", "voltaje", "antrieb", "ansteuerung")
    ),
    "y": frozenset(
        ("y", "displacement", "disp", "position", "pos", "output", "deflection", "elongation", "stroke", "weg",
         "auslenkung", "déplacement", "deplacement", "desplazamiento")
    ),
}  # fmt: skip
"""Words, one of which the name of a column has that may be meant where it is not called as we call it."""

DECIDE = {
    "y": frozenset(("measured", "sensor", "actual", "istwert", "messwert")),
    "u": frozenset(("target", "reference", "ref", "setpoint", "desired", "commanded", "command", "soll", "sollwert")),
}
"""Words that say which column is meant, whatever other words stand beside them."""

OTHERWISE = frozenset(
    ("error", "err", "deviation", "std", "sigma", "noise", "velocity", "speed", "rate", "limit", "min", "max", "status",
     "state", "offset", "gain", "scale", "constant", "range")
)  # fmt: skip
"""Words of names that belong to something else than the quantity itself."""

_WORDS = re.compile(r"[^\W\d_]+")

_HUMP = re.compile(r"(?<=[a-zß-ÿ])(?=[A-ZÀ-Þ])")


@dataclass(frozen=True)
class Column:
    """A column that a file offers.

    `name`: how it is addressed, `session1/drive [V]`; `own`: the last part, `drive [V]`; `label`: that without a unit,
    `drive`; `unit`: empty when the file gives none; `length`: samples, 0 where they are not counted before reading;
    `read`: its numbers, an array of one dimension that nobody else holds; `also`: another name that the file gives it.
    """

    name: str
    own: str
    label: str
    unit: str = ""
    length: int = 0
    read: Callable[[], NDArray[Any]] | None = None
    also: str = ""

    @property
    def folder(self) -> str:
        """What stands before the last part: the group or struct it is in, empty at the top."""
        return self.name.removesuffix(self.own)


def column(
    name: str,
    folder: str = "",
    unit: str = "",
    length: int = 0,
    read: Callable[[], NDArray[Any]] | None = None,
    also: str = "",
) -> Column:
    """A column called `name` in `folder` (with its separator); a `unit` the file has beside the name wins over that
    in the name."""
    label, own_unit = split_unit(name)
    return Column(folder + name, name, label, unit or own_unit, length, read, also)


def meaning(c: Column) -> str:
    """Which of our columns the words of a name mean; empty where they mean none, or more than one."""
    plain = _words(c)
    if plain & OTHERWISE:
        return ""
    timed = is_time_unit(c.unit)
    found = {ours for ours, known in DECIDE.items() if plain & known}
    found = found or {ours for ours, known in MEANINGS.items() if plain & known}
    # What has a unit is a time if and only if it is one of time
    if c.unit and timed != ("t" in found):
        return ""
    return found.pop() if len(found) == 1 else ""


def _words(c: Column) -> set[str]:
    """Words of a column's name, in lower case."""
    # "Control Voltage of OutputChan1": what it is, not what it belongs to
    quantity = re.split(r"\s(?:of|von|de)\s", c.label, maxsplit=1)[0]
    words = [word for part in _WORDS.findall(quantity) for word in _HUMP.split(part)]
    # A capital T is a temperature more often than a time
    return {word.casefold() for word in words if word != "T" or is_time_unit(c.unit)}


def parse_columns(text: str) -> dict[str, str]:
    """Mapping of our names to a file's: `t=Time,v=U,y=Pos`, or columns by their numbers from 1 on, `1,2,3` for t, v, y
    and `1,2` for v, y, which become `#1` and so on. Raises ValueError with what is wrong with it."""
    numbers = [part.strip() for part in text.split(",")]
    if all(part.isdecimal() for part in numbers):
        if len(numbers) not in (2, 3):
            raise ValueError(
                f"{len(numbers)} numbers of columns are given; 3 are time, drive and measured, 2 drive and measured, "
                "others are written t=#1,v=#3"
            )
        if len(set(numbers)) < len(numbers) or any(int(number) == 0 for number in numbers):
            raise ValueError(f'"{printable(text)}" names no columns; each has a number of its own, from 1 on')
        return dict(zip(STANDARD[-len(numbers) :], (f"#{int(number)}" for number in numbers), strict=True))
    mapping: dict[str, str] = {}
    for part in text.split(","):
        ours, equals, theirs = (piece.strip() for piece in part.partition("="))
        if not equals or not ours or not theirs:
            raise ValueError(f'"{printable(part.strip())}" is no NAME=COLUMN; write t=Time,v=U,y=Pos')
        if not ours.isidentifier():
            raise ValueError(f'"{printable(ours)}" is no column name; the names on the left are t, v, y, u, ...')
        if ours in mapping:
            raise ValueError(f"{ours} is given twice; name one column for it")
        if theirs in mapping.values():
            raise ValueError(f'column "{printable(theirs)}" is given two names; name it once')
        mapping[ours] = theirs
    return mapping


class Finder:
    """Finds the columns that are asked for; `problems` says what is wrong with the others.

    `understood`: those found by what their names mean, by our names; `steps`: what the file says of the sample rate of
    the columns found, where it has no time.
    """

    def __init__(
        self,
        columns: Sequence[Column],
        mapping: Mapping[str, str],
        ignored: Sequence[str] = (),
        outside: Sequence[str] = (),
    ) -> None:
        self.columns = columns
        self.mapping = mapping
        self.ignored = ignored
        self.outside = outside
        self.problems: list[str] = []
        self.understood: dict[str, Column] = {}
        self.steps: list[Step] = []
        self._unnamed: list[str] = []
        self._asked: set[str] = set()

    def find(self, need: Sequence[str], timed: bool, steps: Sequence[Step] = ()) -> dict[str, Column]:
        """Our names to columns.

        `need`: ours that must be there; `timed`: the user gives the sample time, so that the file need not have a time;
        `steps`: what the file says of it, which counts only where it has no time.
        """
        found: dict[str, Column] = {}
        wanted = dict.fromkeys([*need, *STANDARD, *self.mapping])
        missing = []
        for ours in wanted:
            required = ours in self.mapping or (not timed if ours == "t" else ours in need)
            chosen = self._one(ours, required)
            if chosen is not None:
                found[ours] = chosen
            elif required and ours not in self._asked:
                missing.append(ours)
        # By their meaning only what is left: a name always comes first
        for ours in missing:
            chosen = None if ours in self.mapping else self._meant(ours, found)
            if chosen is not None:
                found[ours] = self.understood[ours] = chosen
                continue
            if ours == "t" and "t" not in self.mapping and "t" not in self._asked:
                self.steps = [step for step in steps if step.belongs(c.name for c in found.values())]
            if ours not in self._asked and not (ours == "t" and self.steps):
                self._missing(ours, self.mapping.get(ours, ours))
        self._name_together()
        named = [found[ours] for ours in self.mapping if ours in found]
        for twice in dict.fromkeys(c.name for c in named if named.count(c) > 1):
            self.problems.append(f'column "{printable(twice)}" is given two names; name it once')
        return found

    def _meant(self, ours: str, found: Mapping[str, Column]) -> Column | None:
        """The only column whose name means ours; a time is the first column with a unit of time, too."""
        taken = {c.name for c in found.values()}
        free = [c for c in self.columns if c.name and c.name not in taken]
        meant = [c for c in free if meaning(c) == ours]
        if not meant and ours == "t":
            meant = [c for c in self.columns[:1] if c in free and is_time_unit(c.unit)]
        if len(meant) > 1:
            self._ask(ours, ours, meant)
        return meant[0] if len(meant) == 1 else None

    def _name_together(self) -> None:
        """One question for all columns of which nothing is known."""
        if len(self._unnamed) > 1:
            *others, last = (f'"{ours}"' for ours in self._unnamed)
            self.problems.append(
                f"there are no columns {', '.join(others)} and {last} among {_listed(self.columns)}; name them with "
                f'--columns "{",".join(f"{ours}=COLUMN" for ours in self._unnamed)}"'
            )
        elif self._unnamed:
            (ours,) = self._unnamed
            self.problems.append(
                f'there is no column "{ours}" among {_listed(self.columns)}; name it with --columns "{ours}=COLUMN"'
            )

    def _one(self, ours: str, required: bool) -> Column | None:
        theirs = self.mapping.get(ours, ours)
        # A path in an HDF5 file may be given from its root, as other tools print it
        exact = [c for c in self.columns if c.name in (theirs, theirs.removeprefix("/"))]
        if not exact and theirs[:1] == "#" and theirs[1:].isdecimal():
            place = int(theirs[1:])
            exact = list(self.columns[place - 1 : place]) if place else []
        if len(exact) > 1:
            self._asked.add(ours)
            self.problems.append(f'{len(exact)} columns are called "{printable(theirs)}"; give them different names')
            return None
        for matches in (
            exact,
            [c for c in self.columns if c.own == theirs],
            [c for c in self.columns if c.label == theirs],
            [c for c in self.columns if c.also == theirs],
        ):
            if len(matches) == 1:
                return matches[0]
            if matches:
                if required:
                    self._ask(ours, theirs, matches)
                return None
        return None

    def _ask(self, ours: str, theirs: str, matches: Sequence[Column]) -> None:
        self._asked.add(ours)
        self.problems.append(
            f'{len(matches)} columns may be meant by "{printable(theirs)}": {_listed(matches)}; name one with '
            f'--columns "{ours}={printable(matches[0].name)}"'
        )

    def _missing(self, ours: str, theirs: str) -> None:
        if theirs in self.ignored:
            self.problems.append(
                f'"{printable(theirs)}" is no column of numbers; export a vector of numbers, or name another column '
                f'with --columns "{ours}=COLUMN"'
            )
            return
        wanted = theirs.removeprefix("/")
        for name in self.outside:
            if wanted != name and not name.endswith(("/" + wanted, "." + wanted)) and not wanted.startswith(name + "/"):
                continue
            self.problems.append(
                f'"{printable(name)}" is kept outside this file, and no other file is opened; copy its numbers into '
                f'this one, or name another column with --columns "{ours}=COLUMN"'
            )
            return
        advice = self._advice(ours)
        if ours == "t" and "t" not in self.mapping:
            advice = "give --sample-time" + (f", or {advice}" if "did you mean" in advice else "")
        elif ours not in self.mapping and "did you mean" not in advice:
            self._unnamed.append(ours)
            return
        self.problems.append(f'there is no column "{printable(theirs)}" among {_listed(self.columns)}; {advice}')

    def _advice(self, ours: str) -> str:
        """Which column may be meant, by its name without units, else how to name one."""
        known = MEANINGS.get(ours, frozenset()) | DECIDE.get(ours, frozenset()) | {ours}
        for c in self.columns:
            if _words(c) & known and self.mapping.get(ours) != c.name:
                return f'did you mean --columns "{ours}={printable(c.name)}"?'
        wanted = self.mapping.get(ours, ours).casefold()
        close = difflib.get_close_matches(wanted, [c.name.casefold() for c in self.columns], 1)
        for c in self.columns:
            if close and c.name.casefold() == close[0]:
                return f'did you mean --columns "{ours}={printable(c.name)}"?'
        return f'name it with --columns "{ours}=COLUMN"'


def further_names(others: Sequence[Column], taken: Sequence[str]) -> dict[str, Column]:
    """Columns beyond the chosen ones under the shortest name that is theirs alone; those without one are left out."""
    names: dict[str, Column] = {}
    times = [Counter(getattr(c, part) for c in others) for part in ("label", "own", "name")]
    for c in others:
        for name, alike in zip((c.label, c.own, c.name), times, strict=True):
            if alike[name] == 1 and name and name not in taken and name not in names:
                names[name] = c
                break
    return names


def _listed(columns: Sequence[Column]) -> str:
    names = [printable(c.name) or '""' for c in columns[:LISTED]]
    more = len(columns) - LISTED
    return (", ".join(names) + (f" and {more} more" if more > 0 else "")) or "none"
