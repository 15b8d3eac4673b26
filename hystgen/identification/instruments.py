"""Records without the faults of instruments that a fit would take for the actuator."""

from __future__ import annotations

from collections.abc import Sequence

from hystgen.identification import clocks, lasting
from hystgen.records import Record


def put_right(records: Sequence[Record], clock_skew: float | str | None = None) -> list[Record]:
    """The records with lasting steps of y bridged and clock skews reported, as a note of each record says.

    `clock_skew`: growth of the delay of y after v that is taken out, in ppm of time, or `auto` for that of each record.
    """
    asked = clocks.checked(clock_skew)
    return [clocks.told(lasting.bridged(record), asked) for record in records]
