"""Times of day in the cells of a text table: ISO 8601, `5.3.2024 14:21:05.5`, `14:21:05`, `2:21:05 PM`."""

from __future__ import annotations

import re
from copy import copy
from datetime import date

_TIME = re.compile(
    r"""(?:(?P<date>\d{4}([-/.])\d{1,2}\2\d{1,2}|\d{1,2}([-/.])\d{1,2}\3\d{4})(?:\s*,?\s+|[Tt]))?
    (?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2})(?:[.,:](?P<fraction>\d+))?
    \s*(?P<half>[AaPp]\.?[Mm]\.?)?
    \s*(?P<zone>[Zz]|UTC|GMT|[+-]\d{2}(?::?\d{2})?)?""",
    re.VERBOSE,
)

DAY = 86400

NANO = 10**9

LATE = 0.5
"""Fraction of a day by which a clock without a date has to go back to have passed midnight."""


def is_time(cell: str) -> bool:
    """Whether a cell is a time of day, with a date or without."""
    return _TIME.fullmatch(cell.strip()) is not None


class Clock:
    """Reads the times of one column, in file order, as seconds from the first one.

    `problem`: why the times cannot be trusted, empty where they can.
    """

    def __init__(self) -> None:
        self._first: int | None = None
        self._latest = 0
        self._midnights = 0
        self._dates: frozenset[str] = frozenset()
        self.problem = ""

    def copy(self) -> Clock:
        """A clock that goes on from here, for an attempt that may be given up."""
        return copy(self)

    def seconds(self, cell: str) -> float:
        """Seconds from the column's first time. Raises ValueError for a cell that is no time."""
        match = _TIME.fullmatch(cell.strip())
        if match is None:
            raise ValueError("no time of day")
        hour, minute, second = int(match["hour"]), int(match["minute"]), int(match["second"])
        if match["half"]:
            if not 1 <= hour <= 12:
                raise ValueError("no hour of a twelve-hour clock")
            hour = hour % 12 + 12 * (match["half"][0] in "pP")
        if hour > 23 or minute > 59 or second > 60:
            raise ValueError("no time of day")
        fraction = int((match["fraction"] or "")[:9].ljust(9, "0"))
        time = ((hour * 60 + minute) * 60 + second - _offset(match["zone"])) * NANO + fraction
        if match["date"]:
            time += self._day(match["date"]) * DAY * NANO
        else:
            time += self._midnights * DAY * NANO
            if self._first is not None and time < self._latest - LATE * DAY * NANO:
                self._midnights += 1
                time += DAY * NANO
        self._latest = time
        if self._first is None:
            self._first = time
        # The difference is whole, so that the only rounding is that of the quotient
        return (time - self._first) / NANO

    def _day(self, text: str) -> int:
        """Number of a date. Which of its numbers is the month matters only where dates change."""
        one, two, three = (int(part) for part in re.split("[-/.]", text))
        if one > 31:
            return date(one, two, three).toordinal()
        if "." in text or one > 12:
            return date(three, two, one).toordinal()
        if two <= 12 and one != two:
            self._dates |= {text}
        if len(self._dates) > 1:
            self.problem = (
                f'the date "{text}" may begin with the day or with the month, and dates change; export ISO dates such '
                "as 2024-03-05, or seconds"
            )
        return date(three, one, two).toordinal()


def _offset(zone: str | None) -> int:
    """Seconds by which a clock is ahead of UTC."""
    if not zone or zone[0] not in "+-":
        return 0
    digits = zone[1:].replace(":", "").ljust(4, "0")
    return (-60 if zone[0] == "-" else 60) * (60 * int(digits[:2]) + int(digits[2:]))
