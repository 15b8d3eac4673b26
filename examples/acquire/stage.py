"""A stage on the bench, with its converters. SIMULATED: nothing here comes from hystgen.

A DAC and an amplifier drive the stage; sliders that stick behind springs until they slip take up part of the drive; two
springs with dampers keep moving afterwards. An ADC reads the amplifier's monitor and a position sensor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Array = NDArray[np.float64]

BITS, LOW, HIGH = 16, -150.0, 150.0  # of the DAC: +-10 V, times an amplifier gain of 15; two's complement
YIELDS = (3.0, 8.0, 14.0, 21.0, 30.0)  # V, where each slider slips
STIFFNESS = (0.016, 0.012, 0.01, 0.008, 0.006)  # um/V each
GAIN = 0.16  # um/V, with all sliders slipping
DAMPERS = ((0.3, 0.03), (6.0, 0.03))  # s, and share of the motion that comes late
NOISE = 0.004  # um rms
MONITOR, SENSOR = 0.005, 0.0005  # V and um per code of the ADC


class Bench:
    """The stage and its converters; `run` plays codes at a rate and reads both channels at the end of every sample."""

    def __init__(self) -> None:
        self.noise = np.random.default_rng(5)

    def run(self, codes: NDArray[np.int64], rate: float) -> tuple[Array, Array]:
        """Readings of monitor and sensor, in ADC counts."""
        half = 2 ** (BITS - 1)
        drive = LOW + (np.clip(codes, -half, half - 1) + half) * (HIGH - LOW) / 2**BITS
        move = np.diff(drive, prepend=0.0).tolist()
        taken = np.zeros(len(codes))
        for most, stiffness in zip(YIELDS, STIFFNESS, strict=True):
            stretch, course = 0.0, []
            for step in move:
                stretch = min(max(stretch + step, -most), most)
                course.append(stretch)
            taken += stiffness * np.array(course)
        motion = GAIN * drive - taken
        late = np.zeros(len(codes))
        for seconds, share in DAMPERS:
            left = np.exp(-1.0 / (rate * seconds))
            late += share * lfilter([1.0 - left], [1.0, -left], motion)
        position = 2.0 + motion + late + NOISE * self.noise.normal(size=len(codes))
        return np.rint(drive / MONITOR), np.rint(position / SENSOR)
