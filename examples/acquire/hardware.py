"""Your hardware: fill in these two functions with calls to your DAQ device, and describe its converters.

Here they drive the simulated bench of stage.py. Both channels have to share one clock: start the recording before the
output, or let the output trigger the recording.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from stage import BITS, HIGH, LOW, MONITOR, SENSOR, Bench

Array = NDArray[np.float64]

DAC = {"dac_bits": BITS, "dac_range": (LOW, HIGH), "dac_coding": "twos-complement"}
"""The DAC; its range, including the amplifier: the drive at the lowest code, and one code above the highest."""

BENCH = Bench()
PLAYED: list[NDArray[np.int64]] = []


def write_drive(codes: NDArray[np.int64]) -> None:
    """Load codes into the output buffer of the DAC; they are played when reading begins."""
    PLAYED.append(codes)


def read_position(rate: float) -> tuple[Array, Array]:
    """Play the loaded codes at this rate, Hz, and meanwhile read drive (V) and displacement (um), (N,) each.

    The drive is the amplifier's monitor, read at the same time as the position. Without a monitor, return the drive
    that the codes give; the half sample by which a holding converter is late then shows as a delay.
    """
    monitor, sensor = BENCH.run(PLAYED.pop(), rate)
    return MONITOR * monitor, SENSOR * sensor
