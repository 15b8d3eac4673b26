"""Units of columns: how headers write them, which ones are times, and what several records agree on."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from hystgen.basics.problems import printable
from hystgen.records.record import Array, Record

MAX_UNIT = 40
"""Longest text in a header that is taken for a unit; longer ones do not fit a parameter file either."""

SECONDS = ("s", "sec", "secs", "second", "seconds")

TIMES: dict[str, tuple[float, float]] = {
    **dict.fromkeys(SECONDS, (1.0, 1.0)),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), (1.0, 1e3)),
    **dict.fromkeys(("us", "usec", "microsecond", "microseconds"), (1.0, 1e6)),
    **dict.fromkeys(("ns", "nsec", "nanosecond", "nanoseconds"), (1.0, 1e9)),
    **dict.fromkeys(("min", "mins", "minute", "minutes"), (60.0, 1.0)),
    **dict.fromkeys(("h", "hr", "hour", "hours"), (3600.0, 1.0)),
}
"""Factor and divisor to seconds: x/1000 is the double nearest to the time meant, 0.001*x need not be."""

_ONE = (
    r"(?:(?:[fpnumkMG]|d[am]?|c)?(?:s|V|A|m|rad|N|Hz|F|C|K|Pa|g|W|J|T|bar|Ohm|strain)"
    r"|(?i:(?:pico|nano|micro|milli|kilo)?(?:met(?:er|re)s?|volts?|amperes?|seconds?|radians?|newtons?)"
    r"|microns?|sec|msec|usec|counts?|lsb)|min|h|%|deg|deg ?C|°|°C|°F|arcsec|a\.u\.)"
)
_UNIT = re.compile(rf"{_ONE}(?:\^?-?\d)?(?:\s?[*/·]\s?{_ONE}(?:\^?-?\d)?)*")

# After an underscore a word is a unit only when it is hardly anything else: v_in, y_min and v_m are names
_AFTER_UNDERSCORE = re.compile(
    r"[mun]?s|sec|seconds|[muk]?V|volts|[mu]A|k?Hz|[munp]m|microns|deg|[mu]rad|degC|[mk]N|counts"
)
_TIME_NAMES = ("t", "time")


def split_unit(header: str) -> tuple[str, str]:
    """Name and unit of a header: `pos [um]`, `pos (um)`, `U / V`, `time_ms`; the unit is empty where there is none."""
    text = header.strip()
    match = re.fullmatch(r"(.*?\S)\s*\[\s*([^\[\]]*?)\s*\]", text)
    # In square brackets anything is a unit but a number, which counts channels
    if match and not match[2].isdecimal() and len(match[2]) <= MAX_UNIT and match[2].isprintable():
        return match[1], "" if match[2] == "-" else match[2]
    match = re.fullmatch(r"(.*?\S)\s*\(\s*([^()]*?)\s*\)", text) or re.fullmatch(r"(.*?[^\s/])\s*/\s*(\S+)", text)
    if match and len(match[2]) <= MAX_UNIT and _UNIT.fullmatch(_plain(match[2])):
        return match[1], match[2]
    name, _, unit = text.rpartition("_")
    known = _AFTER_UNDERSCORE.fullmatch(_plain(unit)) or (name.casefold() in _TIME_NAMES and _plain(unit) in TIMES)
    return (name, unit) if name and known else (text, "")


def unit_alone(text: str) -> str | None:
    """The unit that a cell below a header holds, `s` or `[um]`, empty for none; None for a cell that is no unit."""
    inside = re.fullmatch(r"\[\s*([^\[\]]*?)\s*\]|\(\s*([^()]*?)\s*\)", text.strip())
    unit = text.strip() if inside is None else inside[1] or inside[2] or ""
    if unit in ("", "-") or (inside is not None and inside[1] and not unit.isdecimal()):
        return "" if unit == "-" else unit
    return unit if _UNIT.fullmatch(_plain(unit)) or _plain(unit).casefold() in TIMES else None


def is_time_unit(unit: str) -> bool:
    """Whether a unit is one of time."""
    return _plain(unit).casefold() in TIMES


def headers(names: Iterable[str], units: Mapping[str, str]) -> list[str]:
    """Names of columns with their units, `v [V]`, wherever that is read back as the same name and unit."""
    made = []
    for name in names:
        unit = units.get(name, "")
        header = f"{name} [{unit}]"
        made.append(header if unit and split_unit(header) == (name, unit) else name)
    return made


def to_seconds(t: Array, unit: str) -> tuple[Array, str]:
    """Times in seconds, and what the user should know about it, empty when they were seconds already."""
    scale = TIMES.get(_plain(unit).partition(" since ")[0].casefold())
    if scale is None:
        return t, f'the unit "{printable(unit)}" of t is no known unit of time; its numbers were taken as seconds'
    factor, divisor = scale
    if factor == divisor:
        return t, ""
    seconds = t / divisor
    seconds *= factor
    return seconds, f"t is in {printable(unit)}; it was converted to seconds"


def agreed_units(records: Iterable[Record], given: Mapping[str, str] | None = None) -> tuple[dict[str, str], list[str]]:
    """Units `input` and `output` of a model made from `records`, and a sentence for each disagreement.

    `given` wins over the records, the first record that has a unit over later ones. No number is converted.
    """
    units = {}
    conflicts = []
    everything = list(records)
    for key, column in (("input", "v"), ("output", "y")):
        unit = (given or {}).get(key, "")
        source = "given"
        for record in everything:
            own = record.units.get(column, "")
            if len(own) > MAX_UNIT or not own.isprintable():
                conflicts.append(
                    f'the unit "{printable(own)}" of {column} in {record.name} is not taken over: a unit has up to '
                    f"{MAX_UNIT} characters on one line"
                )
            elif own and not unit:
                unit, source = own, f"in {record.name}"
            elif own and _plain(own) != _plain(unit):
                conflicts.append(
                    f'the unit of {column} is "{printable(unit)}" {source} and "{printable(own)}" in {record.name}; '
                    "no number was converted, check that they agree"
                )
        if unit:
            units[key] = unit
    return units, conflicts


def _plain(unit: str) -> str:
    """A unit with the letter u for either of Unicode's two micro signs."""
    return unit.strip().replace("\u00b5", "u").replace("\u03bc", "u")
