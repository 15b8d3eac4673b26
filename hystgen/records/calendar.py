"""Times without a unit that count days: serial days of spreadsheets, and MATLAB's datenums."""

from __future__ import annotations

import re
from datetime import date, timedelta

import numpy as np

from hystgen.records.record import Array

COUNTS = {"Excel's days": (date(1899, 12, 30), (25569.0, 73050.0)), "MATLAB's days": (None, (719529.0, 767010.0))}
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
    """What is counted if a time (N,) without a unit counts days, in words; empty if it does not; `DOUBTFUL`.

    `name`: the column's, which may say that it is a date.
    """
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
