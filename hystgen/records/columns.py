"""Which column of a file is which of ours: t, v, y, u."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from hystgen.problems import printable
from hystgen.records.units import split_unit

LISTED = 20
"""Columns or bad cells named one by one before the rest is only counted."""

STANDARD = ("t", "v", "y")

ALIASES = {
    "t": ("t", "time", "times", "zeit", "timestamp"),
    "v": ("v", "voltage", "volt", "drive", "input", "u", "command"),
    "y": ("y", "displacement", "position", "pos", "output", "measured", "sensor", "disp"),
    "u": ("u", "reference", "ref", "setpoint", "target"),
}


@dataclass(frozen=True)
class Column:
    """A column that a file offers.

    `name`: how it is addressed, `session1/drive [V]`; `own`: the last part, `drive [V]`; `label`: that without a unit,
    `drive`; `unit`: empty when the file gives none; `length`: samples, 0 where they are not counted before reading;
    `read`: its numbers, an array of one dimension that nobody else holds.
    """

    name: str
    own: str
    label: str
    unit: str = ""
    length: int = 0
    read: Callable[[], NDArray[Any]] | None = None

    @property
    def folder(self) -> str:
        """What stands before the last part: the group or struct it is in, empty at the top."""
        return self.name.removesuffix(self.own)


def column(
    name: str, folder: str = "", unit: str = "", length: int = 0, read: Callable[[], NDArray[Any]] | None = None
) -> Column:
    """A column called `name` in `folder` (with its separator); a `unit` the file has beside the name wins over that
    in the name."""
    label, own_unit = split_unit(name)
    return Column(folder + name, name, label, unit or own_unit, length, read)


def parse_columns(text: str) -> dict[str, str]:
    """Mapping of our names to a file's: `t=Time,v=U,y=Pos`. Raises ValueError with what is wrong with it."""
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
    """Finds the columns that are asked for; `problems` says what is wrong with the others."""

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

    def find(self, need: Sequence[str], timed: bool) -> dict[str, Column]:
        """Our names to columns. `need`: ours that must be there; `timed`: the file need not have a time."""
        found: dict[str, Column] = {}
        wanted = dict.fromkeys([*need, *STANDARD, *self.mapping])
        for ours in wanted:
            required = ours in self.mapping or (not timed if ours == "t" else ours in need)
            chosen = self._one(ours, required)
            if chosen is not None:
                found[ours] = chosen
        named = [found[ours] for ours in self.mapping if ours in found]
        for twice in dict.fromkeys(c.name for c in named if named.count(c) > 1):
            self.problems.append(f'column "{printable(twice)}" is given two names; name it once')
        return found

    def _one(self, ours: str, required: bool) -> Column | None:
        theirs = self.mapping.get(ours, ours)
        # A path in an HDF5 file may be given from its root, as other tools print it
        exact = [c for c in self.columns if c.name in (theirs, theirs.removeprefix("/"))]
        if len(exact) > 1:
            self.problems.append(f'{len(exact)} columns are called "{printable(theirs)}"; give them different names')
            return None
        for matches in (
            exact,
            [c for c in self.columns if c.own == theirs],
            [c for c in self.columns if c.label == theirs],
        ):
            if len(matches) == 1:
                return matches[0]
            if matches:
                if required:
                    self.problems.append(
                        f'{len(matches)} columns may be meant by "{printable(theirs)}": {_listed(matches)}; name one '
                        f'with --columns "{ours}={printable(matches[0].name)}"'
                    )
                return None
        if required:
            self._missing(ours, theirs)
        return None

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
        self.problems.append(f'there is no column "{printable(theirs)}" among {_listed(self.columns)}; {advice}')

    def _advice(self, ours: str) -> str:
        """Which column may be meant, by its name without units, else how to name one."""
        words = [
            (c.name, c.own.casefold().replace("[", " ").replace("(", " ").replace("_", " ").split())
            for c in self.columns
        ]
        for alias in ALIASES.get(ours, (ours,)):
            for name, parts in words:
                if parts and parts[0] == alias and self.mapping.get(ours) != name:
                    return f'did you mean --columns "{ours}={printable(name)}"?'
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
