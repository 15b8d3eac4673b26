"""Notes on how files were read."""

from __future__ import annotations

from collections.abc import Sequence

from hystgen.basics.problems import duration
from hystgen.records.record import Record

SLOW = 1.0
"""[s] A time without a unit whose steps are at least this is more often in ms, or counts samples: a record of an
actuator has hundreds of samples for each of its loops, which would then take minutes."""


def time_without_unit(records: Sequence[Record], given: float | None) -> str:
    """A sentence about times without a unit that would be slow in seconds; empty if there are none. `given`: a sample
    time that the user gives."""
    unnamed = [each for each in records if len(each) > 1 and each.timed and "t" not in each.units]
    slow = [each for each in unnamed if each.sample_time >= SLOW]
    if not slow or given is not None:
        return ""
    first = slow[0]
    names = ", ".join(each.name for each in slow[:3]) + (f" and {len(slow) - 3} more" if len(slow) > 3 else "")
    return (
        f"{names}: t has no unit and was read in seconds, with a step of {duration(first.sample_time)} and "
        f"{float(first.t[-1] - first.t[0]):.4g} s in all; if it is in ms, write the unit after its name, in the file "
        'or with --columns "t=t [ms]"; if it counts samples, give --sample-time'
    )
