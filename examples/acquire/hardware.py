"""Your hardware: fill in these two functions with the calls of your DAQ device, and say what its converters are.

Here they drive the simulated bench of stage.py. Both channels have to be clocked by the same clock: start recording,
then the output, or let the output trigger it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from stage import BITS, HIGH, LOW, MONITOR, SENSOR, Bench

Array = NDArray[np.float64]

DAC = {"dac_bits": BITS, "dac_range": (LOW, HIGH), "dac_coding": "twos-complement"}
"""Of the drive, amplifier included: the drive at the lowest code, and one code above the highest."""

BENCH = Bench()
PLAYED: list[NDArray[np.int64]] = []


def write_drive(codes: NDArray[np.int64]) -> None:
    """Load codes into the output buffer of the DAC; they are played when reading begins."""
    PLAYED.append(codes)


def read_position(rate: float) -> tuple[Array, Array]:
    """Play what is loaded at this rate, Hz, and read along: drive (V) and displacement (um), (N,) each.

    The drive is the amplifier's monitor, read at the same time as the position. Without a monitor return what the codes
    give; half a sample, by which a converter that holds its values is late, then shows as a delay.
    """
    monitor, sensor = BENCH.run(PLAYED.pop(), rate)
    return MONITOR * monitor, SENSOR * sensor
