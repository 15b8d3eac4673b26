"""Write the demonstration recordings next to this file: stage_recording.csv and stage_holdout.csv.

These are SIMULATED, not measured. The plant is a Preisach relay plane: a continuum of two-position relays that switch
up at drive alpha and down at drive beta, with a density that is bell-shaped in the relay's centre and falls off with
its half width, plus a reversible part that stiffens slightly towards the ends. A Prandtl-Ishlinskii model would need a
density that does not depend on the centre, and a linear reversible part, so it can only approximate this plant; nothing
here comes from hystgen. The sensor adds noise of 6 nm rms, and both drive and sensor pass through 16-bit converters.
The noise comes from a fixed seed, so the files have the same bytes wherever they are made.

Usage: python examples/make_recording.py [FOLDER]
"""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RATE = 2000.0  # samples per second
DRIVE_FULL = 100.0  # V, full scale of the 16-bit drive converter
SENSOR_FULL = 25.0  # um, full scale of the 16-bit sensor
NOISE = 0.006  # um rms
CODES = 65535

CENTRE, CENTRE_SPREAD = 55.0, 35.0  # V, relay centres: mean and standard deviation
HALF_WIDTH = 25.0  # V, over which the density of relays falls by a factor of e as their half width grows
IRREVERSIBLE = 8.0  # um, all relays from down to up
REVERSIBLE = 11.0  # um at full drive
STIFFENING = 0.03  # share of the reversible part

GRID = 400  # cells of the relay plane along each axis


def everett_table() -> Array:
    """E[a, b]: share of the relays with beta >= b and alpha <= a, on a grid over the drive range."""
    edge = (np.arange(GRID) + 0.5) * DRIVE_FULL / GRID
    alpha, beta = edge[:, None], edge[None, :]
    centre, half = (alpha + beta) / 2.0, (alpha - beta) / 2.0
    density = np.exp(-0.5 * ((centre - CENTRE) / CENTRE_SPREAD) ** 2 - np.abs(half) / HALF_WIDTH)
    density = np.where(half > 0.0, density, np.where(half == 0.0, 0.5 * density, 0.0))
    table = np.zeros((GRID + 1, GRID + 1))
    # Summed up to alpha, and from the top of the drive range down to beta
    table[1:, :GRID] = np.cumsum(np.cumsum(density, axis=0)[:, ::-1], axis=1)[:, ::-1]
    return np.asarray(table / table[GRID, 0])


class Relays:
    """Relay plane started with every relay down; remembers the drive extrema that still matter."""

    def __init__(self) -> None:
        self.table = everett_table()
        self.extrema: list[tuple[float, float]] = []  # (maximum, the minimum after it) pairs, both decreasing
        self.floor = 0.0  # latest minimum, where the present rise began
        self.last = 0.0
        self.rising = True

    def everett(self, a: float, b: float) -> float:
        """Interpolated table value."""
        x, y = a * GRID / DRIVE_FULL, b * GRID / DRIVE_FULL
        i, j = min(int(x), GRID - 1), min(int(y), GRID - 1)
        f, g = x - i, y - j
        t = self.table
        low = (1.0 - g) * t[i, j] + g * t[i, j + 1]
        high = (1.0 - g) * t[i + 1, j] + g * t[i + 1, j + 1]
        return float((1.0 - f) * low + f * high)

    def step(self, v: float) -> float:
        """Share of relays that are up after the drive went to v."""
        if v > self.last:
            self.rising = True
        elif v < self.last and self.rising:
            self.rising = False
            self.extrema.append((self.last, self.last))
        self.last = v
        if self.rising:
            while self.extrema and self.extrema[-1][0] <= v:
                self.extrema.pop()
            bottom = self.extrema[-1][1] if self.extrema else self.floor
            return self.settled() + self.everett(v, bottom)
        top, _ = self.extrema.pop()
        while self.extrema and self.extrema[-1][1] >= v:
            top, _ = self.extrema.pop()
        self.extrema.append((top, v))
        return self.settled()

    def settled(self) -> float:
        """Contribution of the remembered loops."""
        total = 0.0
        bottom = self.floor
        for top, low in self.extrema:
            total += self.everett(top, bottom) - self.everett(top, low)
            bottom = low
        return total


def bell_noise(seed: int, count: int) -> Array:
    """Nearly normal noise of unit variance: twelve words per sample from a raw generator whose stream numpy promises
    not to change."""
    words = np.random.PCG64(seed).random_raw(12 * count).reshape(count, 12)
    return np.asarray(((words >> np.uint64(11)).astype(np.float64) * 2.0**-53).sum(axis=1) - 6.0)


def measure(drive: list[float], seed: int) -> list[tuple[float, float, float]]:
    """Time, drive as read from the converter, and sensor reading."""
    relays = Relays()
    noise = NOISE * bell_noise(seed, len(drive))
    rows = []
    for k, wanted in enumerate(drive):
        v = round(wanted / DRIVE_FULL * CODES) * DRIVE_FULL / CODES
        x = v / DRIVE_FULL
        reversible = REVERSIBLE * (x + STIFFENING * x * (1.0 - x) * (1.0 - 2.0 * x))
        y = 1.5 + reversible + IRREVERSIBLE * relays.step(v) + noise[k]
        rows.append((k / RATE, v, round(y / SENSOR_FULL * CODES) * SENSOR_FULL / CODES))
    return rows


def ramps(corners: list[float], samples: list[int]) -> Iterator[float]:
    """Straight lines from corner to corner, each with the given number of samples."""
    for (start, stop), count in zip(itertools.pairwise(corners), samples, strict=True):
        for k in range(count):
            yield start + (stop - start) * k / count


def fit_drive() -> list[float]:
    """Triangles over the full range, smaller ones at three heights, nested loops, then fading sines."""
    corners = [0, 100, 0, 100, 20, 80, 35, 65, 45, 55, 10, 40, 15, 35, 5, 95, 60, 90, 65, 85, 70, 100, 0]
    moves = [abs(b - a) for a, b in itertools.pairwise(corners)]
    samples = [round(6.0 * move * (0.6 if move >= 80 else 1.0)) for move in moves]
    drive = list(ramps([float(c) for c in corners], samples))
    for k in range(1000):
        fade = 1.0 - k / 1000.0
        drive.append(50.0 - 50.0 * math.cos(2.0 * math.pi * k / 200.0) * fade - 50.0 * (1.0 - fade) * 0.5)
    return drive


def holdout_drive() -> list[float]:
    """Three sines with no common period, rising from rest."""
    drive = []
    for k in range(3000):
        t = k / RATE
        swell = min(1.0, t / 0.2)
        s = math.sin(2.0 * math.pi * 2.3 * t) + 0.6 * math.sin(2.0 * math.pi * 5.9 * t) + 0.3 * math.sin(
            2.0 * math.pi * 13.1 * t
        )
        drive.append(swell * (50.0 + 25.0 * s))
    return drive


def write(path: Path, rows: list[tuple[float, float, float]]) -> None:
    """CSV with six decimals, far finer than the converters' codes."""
    lines = ["t,v,y", *(f"{t:.4f},{v:.6f},{y:.6f}" for t, v, y in rows)]
    path.write_bytes(("\n".join(lines) + "\n").encode("ascii"))


def main(folder: Path) -> None:
    """Write both files into the folder."""
    write(folder / "stage_recording.csv", measure(fit_drive(), seed=20240117))
    write(folder / "stage_holdout.csv", measure(holdout_drive(), seed=20240118))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent)
