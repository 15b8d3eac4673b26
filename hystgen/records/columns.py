"""Columns of a file: names, units, sample rates, and the choice of those to use."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from datetime import date, timedelta

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.names import MAX_UNIT
from hystgen.basics.problems import printable
from hystgen.records.record import Array, Record

# Units: notation in headers, units of time, and units agreed on by several records ---------------------------


SECONDS = ("s", "sec", "secs", "second", "seconds")

DAYS = ("d", "day", "days")

TIMES: dict[str, tuple[float, float]] = {
    **dict.fromkeys(SECONDS, (1.0, 1.0)),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), (1.0, 1e3)),
    **dict.fromkeys(("us", "usec", "microsecond", "microseconds"), (1.0, 1e6)),
    **dict.fromkeys(("ns", "nsec", "nanosecond", "nanoseconds"), (1.0, 1e9)),
    **dict.fromkeys(("min", "mins", "minute", "minutes"), (60.0, 1.0)),
    **dict.fromkeys(("h", "hr", "hour", "hours"), (3600.0, 1.0)),
    **dict.fromkeys(DAYS, (86400.0, 1.0)),
}
"""Factor and divisor to get seconds: x/1000 is the double nearest to the intended time; 0.001*x may not be."""

NEVER_THE_START = 1e4
"""[days] Day counts as large as this are dates: no record lasts 27 years."""

_ONE = (
    r"(?:(?:[fpnumkMG]|d[am]?|c)?(?:s|V|A|m|rad|N|Hz|F|C|K|Pa|g|W|J|T|bar|Ohm|strain)"
    r"|(?i:(?:pico|nano|micro|milli|kilo)?(?:met(?:er|re)s?|volts?|amperes?|seconds?|radians?|newtons?)"
    r"|microns?|sec|msec|usec|counts?|lsb)|min|h|%|deg|deg ?C|°|°C|°F|arcsec|a\.u\.)"
)
_UNIT = re.compile(rf"{_ONE}(?:\^?-?\d)?(?:\s?[*/·]\s?{_ONE}(?:\^?-?\d)?)*")

_LENGTH = re.compile(r"(?:[pnumc]?m|(?i:(?:pico|nano|micro|milli|centi)?met(?:er|re)s?|microns?))")

# After an underscore, only an unmistakable unit counts as one: v_in, y_min and v_m are names
_AFTER_UNDERSCORE = re.compile(
    r"[mun]?s|sec|seconds|[muk]?V|volts|[mu]A|k?Hz|[munp]m|microns|deg|[mu]rad|degC|[mk]N|counts"
)
_TIME_NAMES = ("t", "time")


def split_unit(header: str) -> tuple[str, str]:
    """Name and unit of a header: `pos [um]`, `pos (um)`, `U / V`, `time_ms`; the unit may be empty."""
    text = header.strip()
    match = re.fullmatch(r"(.*?\S)\s*\[\s*([^\[\]]*?)\s*\]", text)
    # In square brackets, anything is a unit except a number, which is a channel number
    if match and not match[2].isdecimal() and len(match[2]) <= MAX_UNIT and match[2].isprintable():
        return match[1], "" if match[2] == "-" else match[2]
    match = re.fullmatch(r"(.*?\S)\s*\(\s*([^()]*?)\s*\)", text) or re.fullmatch(r"(.*?[^\s/])\s*/\s*(\S+)", text)
    if match and len(match[2]) <= MAX_UNIT and _UNIT.fullmatch(plain(match[2])):
        return match[1], match[2]
    name, _, unit = text.rpartition("_")
    known = _AFTER_UNDERSCORE.fullmatch(plain(unit)) or (name.casefold() in _TIME_NAMES and plain(unit) in TIMES)
    return (name, unit) if name and known else (text, "")


def unit_alone(text: str) -> str | None:
    """The unit in a cell below a header, `s` or `[um]`, possibly empty; None for a cell that is not a unit."""
    inside = re.fullmatch(r"\[\s*([^\[\]]*?)\s*\]|\(\s*([^()]*?)\s*\)", text.strip())
    unit = text.strip() if inside is None else inside[1] or inside[2] or ""
    if unit in ("", "-") or (inside is not None and inside[1] and not unit.isdecimal()):
        return "" if unit == "-" else unit
    return unit if _UNIT.fullmatch(plain(unit)) or plain(unit).casefold() in TIMES else None


def is_time_unit(unit: str) -> bool:
    """Whether a unit is a unit of time, which may count from a date: `seconds since 2024-03-05`."""
    return _of_time(unit) in TIMES


def _of_time(unit: str) -> str:
    return plain(unit).partition(" since ")[0].casefold()


def headers(names: Iterable[str], units: Mapping[str, str]) -> list[str]:
    """Column names with their units, `v [V]`, wherever that reads back as the same name and unit."""
    made = []
    for name in names:
        unit = units.get(name, "")
        header = f"{name} [{unit}]"
        made.append(header if unit and split_unit(header) == (name, unit) else name)
    return made


def to_seconds(t: Array, unit: str) -> tuple[Array, str]:
    """Times in seconds, and a note for the user, empty if they were in seconds already."""
    scale = TIMES.get(_of_time(unit))
    if scale is None:
        return t, f'the unit "{printable(unit)}" of t is not a known unit of time; t was read as seconds'
    factor, divisor = scale
    if factor == divisor:
        return t, ""
    dated = _of_time(unit) in DAYS and len(t) > 0 and np.nanmin(t) > NEVER_THE_START
    # Counted from the first day, since the seconds of all days before it would round away the fraction of a day
    seconds = (t - np.nanmin(t) if dated else t) / divisor
    seconds *= factor
    more = " from the first" if dated else ""
    return seconds, f"t is in {printable(unit)}; it was converted to seconds{more}"


def agreed_units(records: Iterable[Record], given: Mapping[str, str] | None = None) -> tuple[dict[str, str], list[str]]:
    """Units `input` and `output` of a model made from `records`, and a sentence for each unusual one.

    `given` takes precedence over the records, and the first record with a unit over later ones. Each quantity is in a
    single unit, as `in_units` leaves it.
    """
    units = {}
    strange = []
    everything = list(records)
    for key, column in (("input", "v"), ("output", "y")):
        unit = (given or {}).get(key, "")
        for record in everything:
            own = record.units.get(column, "")
            if len(own) > MAX_UNIT or not own.isprintable():
                strange.append(
                    f'the unit "{printable(own)}" of {column} in {record.name} is ignored: a unit has at most '
                    f"{MAX_UNIT} characters on one line"
                )
            elif not unit:
                unit = own
        if unit:
            units[key] = unit
    drive, displacement = units.get("input", ""), units.get("output", "")
    if _LENGTH.fullmatch(plain(drive)) and displacement and not _LENGTH.fullmatch(plain(displacement)):
        strange.append(
            f"the drive is in {printable(drive)} and the displacement in {printable(displacement)}, which suggests "
            "that they are exchanged; check the columns and the units: the drive comes first"
        )
    return units, strange


def plain(unit: str) -> str:
    """A unit with the letter u in place of either of Unicode's two micro signs."""
    return unit.strip().replace("\u00b5", "u").replace("\u03bc", "u")


# Sample rates and times: in lines above a table, as scalars, as attributes -----------------------------------


RATES = {
    "mHz": 1e-3, "Hz": 1.0, "kHz": 1e3, "KHz": 1e3, "MHz": 1e6, "GHz": 1e9, "hz": 1.0, "1/s": 1.0, "samples/s": 1.0,
    "S/s": 1.0, "kS/s": 1e3, "MS/s": 1e6, "GS/s": 1e9, "Sa/s": 1.0, "kSa/s": 1e3, "MSa/s": 1e6, "GSa/s": 1e9,
    "sps": 1.0, "SPS": 1.0, "ksps": 1e3, "kSPS": 1e3, "MSPS": 1e6,
}
"""Units of sample rates in Hz; m and M differ, so case matters."""

_RATE = r"(?i:sampl(?:e|ing)[ _-]?(?:rate|freq(?:uency)?)|f_?s(?:ample)?|srate|abtast(?:rate|frequenz))"
_STEP = (
    r"(?i:sampl(?:e|ing)[ _-]?(?:interval|period)|sample[ _-]?time|d_?t|delta[ _-]?t|time[ _-]?(?:step|increment)"
    r"|wf_increment|t_?sample|abtast(?:zeit|intervall|periode))|T_?s"
)
_NUMBER = r"[+-]?\d+(?:[.,]\d+)*(?:[eE][+-]?\d+)?"
_LINE = re.compile(
    rf"(?<![A-Za-z0-9_])(?:(?P<rate>{_RATE})|(?P<step>{_STEP}))(?P<suffix>_[A-Za-z]+)?(?:\s*[\[(](?P<unit>[^\])]*)[\])])?"
    rf"\s*(?:[:=;,\t]\s*)*(?P<number>{_NUMBER})(?:\s*[;,\t]?\s*[\[(]?(?P<after>[A-Za-zµμ/1]+)(?P<entry>\s*[=:])?)?"
)


@dataclass(frozen=True)
class Step:
    """The time between two samples in `seconds`, and how the file states it (`said`).

    `of`: the column that the step belongs to, or the group or struct including its separator; empty for the whole file;
    `start`: time of the first sample, if the file gives a start time per column.
    """

    seconds: float
    said: str
    of: str = ""
    start: str = ""

    def belongs(self, names: Iterable[str]) -> bool:
        """Whether the sample time applies to any of these columns."""
        group = self.of[-1:] in ("", ".", "/")
        return not self.of or any(name.startswith(self.of) if group else name == self.of for name in names)


def from_lines(lines: Iterable[tuple[int, str]], decimal: str) -> list[Step]:
    """The sample times and rates found in numbered lines of text."""
    found = []
    for number, line in lines:
        for match in _LINE.finditer(line.replace('"', "")):
            text = match["number"]
            if "," in text and (decimal != "," or text.count(",") > 1 or "." in text):
                continue
            # A word with a value of its own is not a unit but the next entry in the line
            after = "" if match["entry"] else match["after"]
            unit = match["unit"] or (match["suffix"] or "").lstrip("_") or after or ""
            step = _step(bool(match["rate"]), float(text.replace(",", ".")), unit, f"line {number}")
            if step is not None:
                found.append(step)
    return found


def is_named(name: str) -> bool:
    """Whether a name, with or without a unit, means a sample rate or a sample time."""
    key, _ = split_unit(name)
    return re.fullmatch(f"{_RATE}|{_STEP}", key) is not None


def from_number(name: str, value: float, of: str = "", unit: str = "") -> Step | None:
    """The sample rate given by a number next to the columns, identified by its name; `of` as in `Step`."""
    key, own_unit = split_unit(name)
    rate = re.fullmatch(_RATE, key) is not None
    if not rate and re.fullmatch(_STEP, key) is None:
        return None
    step = _step(rate, value, unit or own_unit, f"{of} {name}".strip() if of[-1:] not in "./" else f"{of}{name}")
    return None if step is None else replace(step, of=of)


def _step(rate: bool, value: float, unit: str, where: str) -> Step | None:
    """Seconds per sample, from a rate or an interval; None if its value or unit is unusable."""
    if not 0.0 < value < float("inf"):
        return None
    text = plain(unit)
    if rate:
        if text and text not in RATES:
            return None
        said = f"sample rate {value:g} {text or 'Hz'}"
        seconds = 1.0 / (value * RATES.get(text, 1.0))
    else:
        if text and text.casefold() not in TIMES:
            return None
        factor, divisor = TIMES.get(text.casefold(), (1.0, 1.0))
        said = f"sample time {value:g} {text or 's'}"
        seconds = value / divisor * factor
    return Step(seconds, f"{said} ({printable(where)}{'' if text else ', without a unit'})")


# Times without a unit that count days: serial days of spreadsheets, and MATLAB's datenums --------------------


DAYS_OF_1970 = 25569.0
"""[days] Excel's number of the first day of 1970."""

COUNTS = {"Excel's days": (date(1899, 12, 30), (DAYS_OF_1970, 73050.0)), "MATLAB's days": (None, (719529.0, 767010.0))}
"""Day 0 of each count (None: of year 0), and its numbers [days] of the first day of 1970 and of the last of 2099."""

QUICKEST = 1e-6
"""[s] In seconds, a record with steps this small would be sampled at 1 MHz and begin 7 hours after zero: they are days.
Set by: tests/test_readers.py TestDays."""

SLOWEST = 10.0 / 86400.0
"""[days] In days, a record with steps this large would be sampled every 10 s: it counts seconds. In between, only the
user knows. Set by: tests/test_readers.py TestDays."""

DOUBTFUL = "?"
"""The answer if the numbers may be seconds as well as days."""

_DATED = re.compile(r"(?i)date|datum|fecha|serial|excel|(?:^|[^a-z])days?(?:[^a-z]|$)")


def counted_days(t: Array, name: str) -> str:
    """The kind of day count of a time (N,) without a unit, in words; empty if it counts no days; or `DOUBTFUL`.

    `name`: the column's, which may say that it is a date.
    """
    if not len(t) or not t[int(np.argmax(np.isfinite(t)))] >= DAYS_OF_1970:
        return ""
    known = t[np.isfinite(t)]
    steps = np.diff(known)
    steps = steps[steps > 0.0]
    if not len(steps):
        return ""
    for what, (zero, (first, last)) in COUNTS.items():
        if not first <= known.min() <= known.max() <= last:
            continue
        step = float(np.median(steps))
        if step > QUICKEST and not _DATED.search(name):
            return "" if step >= SLOWEST else DOUBTFUL
        number = int(known[0])
        day = zero + timedelta(number) if zero else date.fromordinal(number - 366)
        return f"{what}, of which {number} is {day.isoformat()}"
    return ""


# Assignment of a file's columns to ours: t, v, y, u ----------------------------------------------------------


LISTED = 20
"""Number of columns or bad cells that are listed individually; the others are only counted."""

STANDARD = ("t", "v", "y")

MEANINGS = {
    "t": frozenset(("t", "time", "times", "timestamp", "zeit", "temps", "tiempo")),
    "v": frozenset(
        ("v", "u", "hv", "voltage", "volt", "volts", "drive", "input", "spannung", "voltaje", "antrieb", "ansteuerung")
    ),
    "y": frozenset(
        ("y", "displacement", "disp", "position", "pos", "output", "deflection", "elongation", "stroke", "weg",
         "auslenkung", "déplacement", "deplacement", "desplazamiento")
    ),
}
"""Words in column names that suggest one of our columns if no column has our name for it."""

DECIDE = {
    "y": frozenset(("measured", "sensor", "actual", "istwert", "messwert")),
    "u": frozenset(("target", "reference", "ref", "setpoint", "desired", "commanded", "command", "soll", "sollwert")),
}
"""Words that decide which column is meant, whatever other words are in the name."""

OTHERWISE = frozenset(
    ("error", "err", "deviation", "std", "sigma", "noise", "velocity", "speed", "rate", "limit", "min", "max", "status",
     "state", "offset", "gain", "scale", "constant", "range")
)
"""Words in column names for things other than the quantity itself."""

COUNTING = frozenset(("index", "scan", "sample", "chunk", "no", "nr", "number", "row", "point", "count", "segment"))
"""Words in the names of columns that count rows."""

_WORDS = re.compile(r"[^\W\d_]+")

_HUMP = re.compile(r"(?<=[a-zß-ÿ])(?=[A-ZÀ-Þ])")


@dataclass(eq=False)
class Column:
    """A column of the file; its name need not be unique.

    `own`: the last part of its name, `drive [V]`; `folder`: everything before that, the group or struct that holds the
    column with its separator, empty at the top level; `unit`: the one that the file stores separately, else the one in
    the name, empty if the file gives none; `length`: samples, 0 if unknown before reading; `read`: returns the numbers
    as a one-dimensional array that the caller owns; `also`: another name of the column in the file; `name`: the full
    name, `session1/drive [V]`; `label`: the last part without its unit, `drive`.
    """

    own: str
    folder: str = ""
    unit: str = ""
    length: int = 0
    read: Callable[[], NDArray[np.generic]] | None = None
    also: str = ""
    name: str = field(init=False)
    label: str = field(init=False)

    def __post_init__(self) -> None:
        self.label, unit = split_unit(self.own)
        self.name, self.unit = self.folder + self.own, self.unit or unit


def meaning(c: Column) -> str:
    """Which of our columns the words in a name indicate; empty if they indicate none, or more than one."""
    words = _words(c)
    if words & OTHERWISE:
        return ""
    timed = is_time_unit(c.unit)
    found = {ours for ours, known in DECIDE.items() if words & known}
    found = found or {ours for ours, known in MEANINGS.items() if words & known}
    # A column with a unit is a time if and only if the unit is a unit of time
    if c.unit and timed != ("t" in found):
        return ""
    return found.pop() if len(found) == 1 else ""


def _words(c: Column) -> set[str]:
    """The words in a column's name, in lower case."""
    # In "Control Voltage of OutputChan1", only the words before "of" name the quantity
    quantity = re.split(r"\s(?:of|von|de)\s", c.label, maxsplit=1)[0]
    words = [word for part in _WORDS.findall(quantity) for word in _HUMP.split(part)]
    # A capital T is a temperature more often than a time
    return {word.casefold() for word in words if word != "T" or is_time_unit(c.unit)}


def parse_columns(text: str) -> dict[str, str]:
    """Mapping of our names to a file's: `t=Time,v=U,y=Pos`, or columns by number, starting at 1: `1,2,3` for t, v, y
    and `1,2` for v, y, which become `#1` and so on. Raises ValueError with the problem."""
    numbers = [part.strip() for part in text.split(",")]
    if all(part.isdecimal() for part in numbers):
        if len(numbers) not in (2, 3):
            raise ValueError(
                f"{len(numbers)} column numbers are given; give 3 for time, drive and measured, 2 for drive and "
                "measured, or write t=#1,v=#3"
            )
        if len(set(numbers)) < len(numbers) or any(int(number) == 0 for number in numbers):
            raise ValueError(f'"{printable(text)}" does not name columns; write different numbers, starting at 1')
        return dict(zip(STANDARD[-len(numbers) :], (f"#{int(number)}" for number in numbers), strict=True))
    mapping: dict[str, str] = {}
    for part in text.split(","):
        ours, equals, theirs = (piece.strip() for piece in part.partition("="))
        if not equals or not ours or not theirs:
            raise ValueError(f'"{printable(part.strip())}" is not NAME=COLUMN; write t=Time,v=U,y=Pos')
        if not ours.isidentifier():
            raise ValueError(f'"{printable(ours)}" is not a column name; the names on the left are t, v, y, u, ...')
        if ours in mapping:
            raise ValueError(f"{ours} is given twice; name one column for it")
        if theirs in mapping.values():
            raise ValueError(f'column "{printable(theirs)}" is given two names; name it once')
        mapping[ours] = theirs
    return mapping


@dataclass
class Finder:
    """Finds the requested columns; `problems` lists the reasons why the others were not found.

    `understood`: columns found by the meaning of their names, keyed by our names; `stated`: the file's sample rates
    for the columns found, if it has no time; `steps`: those of them that are needed, since the user gives none.
    """

    columns: Sequence[Column]
    mapping: Mapping[str, str]
    ignored: Sequence[str] = ()
    outside: Sequence[str] = ()
    problems: list[str] = field(default_factory=list)
    understood: dict[str, Column] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)
    stated: list[Step] = field(default_factory=list)
    _unnamed: list[str] = field(default_factory=list)
    _several: dict[str, list[Column]] = field(default_factory=dict)
    _asked: set[str] = field(default_factory=set)
    _signals: int = 0

    def find(
        self, need: Sequence[str], timed: bool, steps: Sequence[Step] = (), points: bool = False, channel: bool = False
    ) -> dict[str, Column]:
        """The columns found, keyed by our names.

        `need`: names that must be present; `timed`: the user gives the sample time, so the file need not have a time;
        `steps`: sample rates in the file, used only if it has no time; `points`: the file need not have a time either
        if every column is already taken; `channel`: it need not have one at all.
        """
        found: dict[str, Column] = {}
        self._signals = len(need)
        wanted = dict.fromkeys([*need, *STANDARD, *self.mapping])
        # The time comes last, since there may be one beside each group of columns
        late = [ours for ours in wanted if ours == "t" and "t" not in self.mapping]
        for group in ([ours for ours in wanted if ours not in late], late):
            missing = []
            for ours in group:
                required = ours in self.mapping or (not timed if ours == "t" else ours in need)
                chosen = self._one(ours, required, self._folders(found, need))
                if chosen is not None:
                    found[ours] = chosen
                elif required and ours not in self._asked:
                    missing.append(ours)
            # Names come first; meaning only decides among the remaining columns
            for ours in missing:
                theirs, unit = split_unit(self.mapping[ours]) if ours in self.mapping else (ours, "")
                # v=y takes a column called Position too, t=t [ms] one called Time
                chosen = self._meant(theirs, found, self._folders(found, need)) if theirs in (ours, *STANDARD) else None
                if chosen is not None and (not unit or not chosen.unit):
                    chosen.unit = chosen.unit or unit
                    found[ours] = self.understood[ours] = chosen
                    continue
                if ours == "t" and "t" not in self.mapping and "t" not in self._asked:
                    self.steps = self._stated(steps, found)
                    if channel or (points and len(found) == len(self.columns)):
                        continue
                if ours not in self._asked and ours not in self._several and not (ours == "t" and self.steps):
                    self._missing(ours, self.mapping.get(ours, ours))
        if "t" not in found:
            self.stated = self._stated(steps, found)
        self._name_together(found)
        self._apart({ours: c for ours, c in found.items() if ours in self.mapping}, found, need)
        return found

    def _folders(self, found: Mapping[str, Column], need: Sequence[str]) -> set[str]:
        """The groups of the needed columns."""
        return {c.folder for ours, c in found.items() if ours in need}

    def _stated(self, steps: Sequence[Step], found: Mapping[str, Column]) -> list[Step]:
        names = [c.name for c in found.values() or self.columns]
        return [step for step in steps if step.belongs(names)]

    def _apart(self, named: Mapping[str, Column], found: Mapping[str, Column], need: Sequence[str]) -> None:
        """Report columns in the file that serve as two needed columns."""
        for ours, c in found.items():
            if ours in named or ours not in (*need, "t"):
                continue
            for other in (other for other, theirs in named.items() if theirs is c):
                self.problems.append(
                    f'column "{printable(c.name)}" is {ours} already and cannot be {other} too; name another column '
                    f'with --columns "{other}=COLUMN"'
                )
        columns = list(named.values())
        for twice in dict.fromkeys(c.name for c in columns if columns.count(c) > 1):
            self.problems.append(f'column "{printable(twice)}" is given two names; name it once')

    def _meant(self, ours: str, found: Mapping[str, Column], folders: Set[str] = frozenset()) -> Column | None:
        """The only column whose name means `ours`; else, for a time, the first or only column with a unit of time, and
        for a reference a position if the only other column is time, since a file with a drive is a recording."""
        taken = {c.name for c in found.values()}
        free = [c for c in self.columns if c.name and c.name not in taken]
        meant = [c for c in free if meaning(c) == ours]
        if not meant and ours == "u":
            alone = [c for c in self.columns if not (is_time_unit(c.unit) or meaning(c) == "t" or _words(c) & COUNTING)]
            meant = [c for c in alone if len(alone) == 1 and c in free and meaning(c) == "y"]
        if not meant and ours == "t":
            meant = [c for c in free if is_time_unit(c.unit)]
            meant = [c for c in self.columns[:1] if c in meant] or meant
        if len(meant) > 1 and ours == "t" and len(folders) == 1:
            meant = [c for c in meant if c.folder in folders] or meant
        if len(meant) > 1:
            self._several[ours] = meant
        return meant[0] if len(meant) == 1 else None

    def _name_together(self, found: Mapping[str, Column]) -> None:
        """Report all columns that are unidentified or have several candidates as one problem."""
        if not self._unnamed:
            for ours, meant in self._several.items():
                self._ask(ours, ours, meant)
            return
        unnamed = [ours for ours in (*STANDARD, *self._unnamed) if ours in (*self._unnamed, *self._several)]
        unnamed = list(dict.fromkeys(unnamed))
        wanted = ",".join(f"{ours}=COLUMN" for ours in unnamed)
        channels = [c for c in self.columns if not is_time_unit(c.unit) and meaning(c) != "t"]
        if len(channels) == 1 < self._signals and not self.outside:
            self.problems.append(
                f"has one channel, {_listed(channels)}; name the files of the drive and the measured signal with "
                "--join DRIVE MEASURED"
            )
            return
        *others, last = (f'"{ours}"' for ours in unnamed)
        there = f"are no columns {', '.join(others)} and {last}" if others else f"is no column {last}"
        self.problems.append(
            f"there {there} among {_listed(self.columns)}; name {'them' if others else 'it'} with --columns "
            f'"{wanted}"{self._example(unnamed, found)}'
        )

    def _example(self, unnamed: Sequence[str], found: Mapping[str, Column]) -> str:
        """An example that assigns the remaining columns in file order, if there are only as many as are needed.

        Columns without a name count only if those with one do not suffice.
        """
        taken = set(found.values())
        for nameless in (False, True):
            free = [c for c in self.columns if (c.name or nameless) and c not in taken and not _words(c) & COUNTING]
            times = [c for c in free if is_time_unit(c.unit) or meaning(c) == "t"]
            others = iter([c for c in free if c not in times])
            answers = {ours: next(iter(times) if ours == "t" else others, None) for ours in unnamed}
            left = next(others, None)
            if None not in answers.values() and (left is None or unnamed == ["u"]):  # of several axes, the first
                said = ",".join(f"{ours}={self._address(c)}" for ours, c in answers.items() if c)
                return f', for example --columns "{said}"'
        return ""

    def _address(self, c: Column) -> str:
        """How to refer to a column in `--columns`: its name, or its number if it has none, or one that is ambiguous or
        has a comma."""
        alone = c.name and sum(each.name == c.name for each in self.columns) == 1
        typed = alone and not set(",=\"'`$\\") & set(c.name) and c.name == printable(c.name) == c.name.strip()
        return c.name if typed else f"#{self.columns.index(c) + 1}"

    def _one(self, ours: str, required: bool, folders: Set[str] = frozenset()) -> Column | None:
        theirs = self.mapping.get(ours, ours)
        # A path in an HDF5 file may start at the root, as other tools print it
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
            if len(matches) > 1 and ours == "t" and len(folders) == 1:  # the time beside the other columns
                matches = [c for c in matches if c.folder in folders] or matches
            if len(matches) == 1:
                return matches[0]
            if matches:
                if required:
                    self._ask(ours, theirs, matches)
                return None
        return self._with_unit(theirs) if ours in self.mapping else None

    def _with_unit(self, theirs: str) -> Column | None:
        """The only column of this name without a unit, if the user gives its unit: `t=Time [d]`."""
        name, unit = split_unit(theirs)
        bare = [c for c in self.columns if unit and not c.unit and name in (c.name, c.own, c.label)]
        if not bare and unit and name[:1] == "#" and name[1:].isdecimal():
            bare = [c for c in self.columns[: int(name[1:])][-1:] if not c.unit]
        if len(bare) == 1:
            bare[0].unit = unit
            return bare[0]
        return None

    def _ask(self, ours: str, theirs: str, matches: Sequence[Column]) -> None:
        self._asked.add(ours)
        self.problems.append(
            f'{len(matches)} columns may be meant by "{printable(theirs)}": {_listed(matches)}; name one with '
            f'--columns "{ours}={self._address(matches[0])}"'
        )

    def _missing(self, ours: str, theirs: str) -> None:
        if theirs in self.ignored:
            self.problems.append(
                f'"{printable(theirs)}" is not a column of numbers; export a vector of numbers, or name another column '
                f'with --columns "{ours}=COLUMN"'
            )
            return
        wanted = theirs.removeprefix("/")
        for name in self.outside:
            if wanted != name and not name.endswith(("/" + wanted, "." + wanted)) and not wanted.startswith(name + "/"):
                continue
            self.problems.append(
                f'"{printable(name)}" is stored outside this file, and no other file is opened; copy its numbers into '
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
        """Advice: the likely column, judged by its name without a unit, or else how to name one."""
        known = MEANINGS.get(ours, frozenset()) | DECIDE.get(ours, frozenset()) | {ours}
        for c in self.columns:
            if _words(c) & known and self.mapping.get(ours) != c.name:
                return f'did you mean --columns "{ours}={self._address(c)}"?'
        wanted = self.mapping.get(ours, ours).casefold()
        close = difflib.get_close_matches(wanted, [c.name.casefold() for c in self.columns], 1)
        for c in self.columns:
            if close and c.name.casefold() == close[0]:
                return f'did you mean --columns "{ours}={self._address(c)}"?'
        return f'name it with --columns "{ours}=COLUMN"'


def further_names(others: Sequence[Column], taken: Sequence[str]) -> dict[str, Column]:
    """The other columns, each under its shortest unique name; columns without such a name are omitted."""
    names: dict[str, Column] = {}
    times = [Counter(getattr(c, part) for c in others) for part in ("label", "own", "name")]
    for c in others:
        for name, alike in zip((c.label, c.own, c.name), times, strict=True):
            if alike[name] == 1 and name and name not in taken and name not in names:
                names[name] = c
                break
    return names


def _shown(c: Column, number: int) -> str:
    """A name as messages list it, with the number that selects a column whose name cannot be typed."""
    return (printable(c.name) + (f" (#{number})" if not c.name.isprintable() else "")) or '""'


def _listed(columns: Sequence[Column]) -> str:
    names = [_shown(c, k) for k, c in enumerate(columns[:LISTED], 1)]
    more = len(columns) - LISTED
    return (", ".join(names) + (f" and {more} more" if more > 0 else "")) or "none"
