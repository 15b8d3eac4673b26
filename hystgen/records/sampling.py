"""Sample rates and times that a file gives beside its columns: in lines above a table, as scalars, as attributes."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from hystgen.basics.problems import printable
from hystgen.records.units import TIMES, split_unit

RATES = {
    "mHz": 1e-3, "Hz": 1.0, "kHz": 1e3, "KHz": 1e3, "MHz": 1e6, "GHz": 1e9, "hz": 1.0, "1/s": 1.0, "samples/s": 1.0,
    "S/s": 1.0, "kS/s": 1e3, "MS/s": 1e6, "GS/s": 1e9, "Sa/s": 1.0, "kSa/s": 1e3, "MSa/s": 1e6, "GSa/s": 1e9,
    "sps": 1.0, "SPS": 1.0, "ksps": 1e3, "kSPS": 1e3, "MSPS": 1e6,
}  # fmt: skip
"""Units of sample rates in Hz; m and M differ, so letters count."""

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
    """`seconds` between two samples, and how the file gives them.

    `of`: the column, or with its separator the group or struct, to which they belong; empty for all of the file;
    `start`: when the first sample was, where the file gives that for each column.
    """

    seconds: float
    said: str
    of: str = ""
    start: str = ""

    def belongs(self, names: Iterable[str]) -> bool:
        """Whether they are those of any of the columns."""
        group = not self.of or self.of[-1] in "./"
        return any(name.startswith(self.of) if group else name == self.of for name in names)


def from_lines(lines: Iterable[tuple[int, str]], decimal: str) -> list[Step]:
    """What numbered lines of text say of the sample rate."""
    found = []
    for number, line in lines:
        for match in _LINE.finditer(line.replace('"', "")):
            text = match["number"]
            if "," in text and (decimal != "," or text.count(",") > 1 or "." in text):
                continue
            # What has a value of its own is no unit but the next entry of the line
            after = "" if match["entry"] else match["after"]
            unit = match["unit"] or (match["suffix"] or "").lstrip("_") or after or ""
            step = _step(bool(match["rate"]), float(text.replace(",", ".")), unit, f"line {number}")
            if step is not None:
                found.append(step)
    return found


def is_named(name: str) -> bool:
    """Whether a name, with a unit or without, is one of a sample rate or a sample time."""
    key, _ = split_unit(name)
    return re.fullmatch(f"{_RATE}|{_STEP}", key) is not None


def from_number(name: str, value: float, of: str = "", unit: str = "") -> Step | None:
    """What a number beside the columns says of their sample rate, by its name; `of` as in `Step`."""
    key, own_unit = split_unit(name)
    rate = re.fullmatch(_RATE, key) is not None
    if not rate and re.fullmatch(_STEP, key) is None:
        return None
    step = _step(rate, value, unit or own_unit, f"{of} {name}".strip() if of[-1:] not in "./" else f"{of}{name}")
    return None if step is None else replace(step, of=of)


def _step(rate: bool, value: float, unit: str, where: str) -> Step | None:
    """Seconds a sample of a rate or an interval; a unit that is none of it gives nothing."""
    if not 0.0 < value < float("inf"):
        return None
    plain = unit.strip().replace("\u00b5", "u").replace("\u03bc", "u")
    if rate:
        if plain and plain not in RATES:
            return None
        said = f"sample rate {value:g} {plain or 'Hz'}"
        seconds = 1.0 / (value * RATES.get(plain, 1.0))
    else:
        if plain and plain.casefold() not in TIMES:
            return None
        factor, divisor = TIMES.get(plain.casefold(), (1.0, 1.0))
        said = f"sample time {value:g} {plain or 's'}"
        seconds = value / divisor * factor
    return Step(seconds, f"{said} ({printable(where)}{'' if plain else ', which gives no unit'})")
