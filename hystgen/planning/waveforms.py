"""The records of a plan: the purpose and the waveform of each.

Drives are computed in integer steps of a decimal grid and with only the four basic operations, so that the files have
the same bytes on every machine.
"""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from operator import attrgetter

from hystgen import effects
from hystgen.planning.grid import MOVE, SLOW_SAMPLES, Grid, Tempo

EDGE = 4
"""[samples] Shortest move; three samples lie between its ends."""

ROUND = 3
"""[samples] Length of the average that rounds every drive: sharper corners could fall between two samples."""


class Waveform:
    """A drive built up in `codes`, sample by sample, from the lowest drive; positions are fractions of the range.

    `pace`: samples of a quick full-scale move.
    """

    def __init__(self, grid: Grid, step: int, pace: int) -> None:
        self._grid, self._step, self.pace = grid, step, pace
        self.codes = [grid.low]

    @property
    def place(self) -> float:
        """Current position of the drive."""
        return (self.codes[-1] - self._grid.low) / (self._grid.high - self._grid.low)

    def go(self, place: float, pace: float = 0.0) -> None:
        """A straight move at `pace` samples per full-scale move, in `EDGE` samples or more, within the rate limit.

        Then the drive rests, so that two samples remain at the turning point even once corners are rounded: the turning
        point is then sampled even if the output is delayed by a fraction of a sample.
        """
        begin, end = self.codes[-1], self._code(place)
        size = abs(end - begin)
        samples = max(EDGE, math.ceil(pace * abs(place - self.place)), -(-size // max(self._step - 1, 1)))
        for k in range(1, samples + 1):
            self.codes.append(begin + (2 * (end - begin) * k + samples) // (2 * samples))
        self.hold(ROUND)

    def hold(self, samples: int) -> None:
        """Hold the drive for a number of samples."""
        self.codes += [self.codes[-1]] * samples

    def wave(self, values: Sequence[float]) -> None:
        """A wave about the middle, as large as the range and the rate limit allow, after a move to its start."""
        steepest = max(abs(b - a) for a, b in itertools.pairwise(values))
        size = 0.5 * (self._grid.high - self._grid.low - 2) / max(map(abs, values))
        size = min(size, (self._step - 1) / steepest)
        middle = (self._grid.low + self._grid.high) // 2
        codes = [middle + round(size * value) for value in values]
        self.go((codes[0] - self._grid.low) / (self._grid.high - self._grid.low), self.pace)
        self.codes += codes[1:]

    def rounded(self) -> list[int]:
        """The drive with rounded corners."""
        half = ROUND // 2
        padded = [self.codes[0]] * half + self.codes + [self.codes[-1]] * half
        return [(2 * sum(padded[k : k + ROUND]) + ROUND) // (2 * ROUND) for k in range(len(self.codes))]

    def _code(self, place: float) -> int:
        return self._grid.low + round(place * (self._grid.high - self._grid.low))


def sine(turns: float) -> float:
    """sin(2 pi turns) to 1e-13, equal everywhere; the last bit of the C library's sine depends on the machine."""
    x = turns - math.floor(turns + 0.5)
    if abs(x) > 0.25:
        x = math.copysign(0.5, x) - x
    x *= 2.0 * math.pi
    total = term = x
    for k in range(1, 10):
        term *= -x * x / ((2 * k) * (2 * k + 1))
        total += term
    return total


def _ends(drive: Waveform, pace: float) -> None:
    """Moves to the top and the bottom: the history of the next record."""
    drive.go(1.0, pace)
    drive.go(0.0, pace)
    drive.hold(EDGE)


def _triangles(drive: Waveform) -> None:
    for slower, cycles in ((1, 4), (2, 2), (4, 1)):
        for _ in range(cycles):
            drive.go(1.0, slower * drive.pace)
            drive.go(0.0, slower * drive.pace)
    _nested(drive, 2 * drive.pace)


def _nested(drive: Waveform, pace: float) -> None:
    for k in range(6):
        drive.go(1.0 - 0.08 * k, pace)
        drive.go(0.08 * (k + 1), pace)


def _slow(drive: Waveform) -> None:
    for k in range(5):
        drive.go(1.0 - 0.1 * k, 75)
        drive.go(0.1 * k, 75)


def _minor(drive: Waveform, pace: float, size: float = 0.25) -> None:
    drive.go(1.0, pace)
    drive.go(0.0, pace)
    for bias in (0.02, 0.5 - 0.5 * size, 0.98 - size):
        drive.go(bias + size, pace)
        for _ in range(2):
            drive.go(bias, pace)
            drive.go(bias + size, pace)
    drive.go(1.0, pace)
    for bias in (0.98 - size, 0.5 - 0.5 * size, 0.02):
        drive.go(bias, pace)
        drive.go(bias + size, pace)
        drive.go(bias, pace)


def _fast_minor(drive: Waveform) -> None:
    _minor(drive, 3 * drive.pace)
    _minor(drive, drive.pace)
    for bias in (0.15, 0.5, 0.85):
        drive.go(bias, drive.pace)
        for _ in range(4):
            drive.go(bias + 0.1, drive.pace)
            drive.go(bias - 0.1, drive.pace)


def _steps(drive: Waveform, hold: int, levels: Sequence[float]) -> None:
    drive.hold(hold // 3)
    for level in levels:
        drive.go(level)
        drive.hold(hold)


def _sweep(drive: Waveform, samples: int = 1100) -> None:
    """Frequency rises as time squared to an eighth of the sampling rate; amplitude falls to keep to the rate limit."""
    first, last = 1.0 / (16.0 * drive.pace), 1.0 / 8.0
    turns, values = 0.0, []
    for k in range(samples):
        x = k / samples
        frequency = first + (last - first) * x * x
        values.append(min(1.0, 1.0 / (6.0 * drive.pace * frequency)) * -sine(turns + 0.25))
        turns += frequency
    drive.wave(values)


def _multisine(drive: Waveform, period: int = 240, periods: int = 4) -> None:
    """Odd harmonics with random phases, over whole periods."""
    phases = random.Random(1)
    lines = [(line, phases.random()) for line in range(1, 24, 2)]
    one = [sum(sine(line * k / period + phase) / line for line, phase in lines) for k in range(period)]
    drive.wave([*(one * periods), one[0]])


def _cycles(drive: Waveform) -> None:
    for _ in range(28):
        drive.go(1.0, MOVE)
        drive.go(0.0, MOVE)


def _settling(drive: Waveform) -> None:
    _nested(drive, drive.pace)
    _steps(drive, 50, (1.0, 0.3, 0.7, 0.0))


def _staircase(drive: Waveform) -> None:
    drive.hold(2 * drive.pace)
    for level, slower in (
        (0.35, 0), (0.8, 2), (0.55, 0), (1.0, 0), (0.0, 0), (0.9, 0), (0.45, 4), (0.65, 0), (0.2, 0)
    ):
        drive.go(level, slower * drive.pace)
        drive.hold(70)


def _reversals(drive: Waveform, seed: int, turns: int, slowest: float) -> None:
    """Random turning points at random speeds, with an occasional hold; both ends come first."""
    chance = random.Random(seed)
    drive.go(1.0, slowest * drive.pace)
    drive.go(0.0, slowest * drive.pace)
    for _ in range(turns):
        drive.go(0.02 + 0.96 * chance.random(), (1.0 + (slowest - 1.0) * chance.random()) * drive.pace)
        if chance.random() < 0.2:
            drive.hold(2 * drive.pace)


@dataclass(frozen=True)
class RecordKind:
    """A record: file name, purpose, waveform and time between samples."""

    name: str
    purpose: str
    draw: Callable[[Waveform], None]
    every: Callable[[Tempo], int]
    held_out: bool = False

    @property
    def shows(self) -> tuple[str, ...]:
        """Names of the effects that the record shows, the clearest first."""
        shown_by = {name: effects.shapes(name)[0].shown_by for name in effects.CATALOGUE}
        shown_by[effects.BEND] = BEND_SHOWN_BY
        places = {name: records[self.name] for name, records in shown_by.items() if self.name in records}
        return tuple(sorted(places, key=places.__getitem__))


BEND_SHOWN_BY = {"slow": 1, "multisine": 1, "slow_minor": 2, "slow_reversals": 2}
"""Records that show a bent front, in the form of `Effect.shown_by`."""


_fast: Callable[[Tempo], int] = attrgetter("fast")
_middle: Callable[[Tempo], int] = attrgetter("middle")


def _lasting(share: float, samples: int = SLOW_SAMPLES) -> Callable[[Tempo], int]:
    return lambda tempo: tempo.every_of(share, samples)


FULL_STEPS = (1.0, 0.0, 0.5, 1.0, 0.25, 0.75, 0.0)
LONG_HOLDS = (1.0, 0.0, 0.5, 1.0, 0.5, 0.0)

RECORDS = (
    RecordKind(
        "slow", "One slow full loop, then nested ones: the hysteresis itself, and its bends at every amplitude.",
        _slow, _lasting(1.0),
    ),
    RecordKind(
        "fast_triangles", "The same loops at the rate limit and two and four times slower: how they widen with rate.",
        _triangles, _fast,
    ),
    RecordKind(
        "fast_steps", "Full-scale and smaller steps with resolved edges: a tail is a lag, a shift a delay, a straight "
        "slope a slew limit, ringing a resonance.",
        partial(_steps, hold=130, levels=FULL_STEPS), _fast,
    ),
    RecordKind(
        "holds", "Long holds after moves both ways: creep follows the last move, drift does not.",
        partial(_steps, hold=100, levels=LONG_HOLDS), _lasting(4.0, 700),
    ),
    RecordKind(
        "staircase", "Steps of other sizes and speeds, to judge the findings of the fast records.",
        _staircase, _fast, True,
    ),
    RecordKind(
        "slow_minor", "Equal small loops at three biases, reached from both sides: whether they are congruent.",
        partial(_minor, pace=60), _lasting(1.0),
    ),
    RecordKind(
        "fast_minor", "Small loops at high rate with many reversals: a lag opens the smallest ones, plays do not.",
        _fast_minor, _fast,
    ),
    RecordKind(
        "slow_reversals", "Random turning points with pauses, to judge the findings of the slow records.",
        partial(_reversals, seed=2, turns=14, slowest=3.0), _lasting(1.25, 600), True,
    ),
    RecordKind(
        "sweep", "A sine sweep up to an eighth of the sampling rate: the peak of a resonance, the phase of a lag.",
        _sweep, _fast,
    ),
    RecordKind(
        "cycles", "Many equal full loops: they accumulate travel and heat, so later ones differ from earlier ones.",
        _cycles, _lasting(1.0, 720),
    ),
    RecordKind(
        "settling", "Nested loops and short holds at a medium pace, while the stage cools: creep and rate in between.",
        _settling, _middle,
    ),
    RecordKind(
        "fast_reversals", "Random turning points at random speeds near the limit, to judge the fast findings.",
        partial(_reversals, seed=3, turns=40, slowest=4.0), _fast, True,
    ),
    RecordKind(
        "multisine", "Equal periods of an odd multisine, random phases: model-free noise, even-order nonlinearity.",
        _multisine, _fast,
    ),
    RecordKind(
        "reversals", "Random turning points at a medium pace, to judge findings between slow and fast.",
        partial(_reversals, seed=5, turns=25, slowest=3.0), _middle, True,
    ),
    RecordKind(
        "slow_again", "The first record again: changes during the session that neither rate nor amplitude explains.",
        _slow, _lasting(1.0),
    ),
)
"""The records of a session, in order."""


def written(record: RecordKind, grid: Grid, tempo: Tempo, every: int) -> list[int]:
    """The codes of a record, which ends with moves to the top and the bottom: the history of the next."""
    pace = tempo.move if every == tempo.fast else 2 * MOVE
    drive = Waveform(grid, grid.rate(tempo.max_rate, tempo.seconds(every)), pace)
    drive.hold(EDGE)
    record.draw(drive)
    _ends(drive, pace)
    return drive.rounded()


def lead_in(grid: Grid, tempo: Tempo, every: int) -> list[int]:
    """Moves to the top and the bottom, the history of the first record, slow enough for any stage."""
    drive = Waveform(grid, grid.rate(tempo.max_rate, tempo.seconds(every)), 2 * MOVE)
    drive.hold(EDGE)
    _ends(drive, 2 * MOVE)
    return drive.rounded()
