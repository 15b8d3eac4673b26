"""Whether the inverse of a model with effects does more than the recordings support.

Each inverse gets the recorded outputs as its reference. The drive of the inverse with effects goes into the plain
model, and the plain inverse's drive into the model with effects: if one model were the stage, this would be the error
left by the other model's compensator. A correct effect changes the output by about as much as it explains.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import EffectsError, NotInvertibleError
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import acceptance
from hystgen.diagnosis.search.acceptance import apart
from hystgen.model import Model

Array = NDArray[np.float64]

SAMPLES = 6_000
"""Maximum number of samples used from the start of a record, as many as the screening of effects compares."""

SMOOTHED = 5
"""[samples] A recorded output is averaged over this many, twice, to make a reference; residual noise is subtracted."""

SEED = 1
"""Seed of the noise passed through the inverses, fixed so that the same records give the same answer."""


@dataclass(frozen=True)
class Wild:
    """An inverse that does more than the recordings support.

    `moves`: rms difference between the reference and the plain model's output for its drive; `other`: the same with the
    two models exchanged; `gain`: held-out rms that the effects explain, all in output units; `wilder`: its drive's rms
    second difference, divided by that of the plain inverse's drive.
    """

    moves: float
    other: float
    gain: float
    wilder: float


def wild(extended: Model, plain: Model, held: Sequence[Item], gain: float, noise: float) -> Wild | None:
    """How far the inverse's changes exceed the effects' `gain` in the worst held-out record; None if they stay within
    it.

    The output's response to the reference's noise, passed through both inverses, is subtracted.
    """
    drives = [each for item in held if (each := _drives(extended, plain, item)) is not None]
    if all(each.wilder <= acceptance.WILDER for each in drives):
        return None
    found = [one for each in drives if (one := _over(extended, plain, each, gain, noise)) is not None]
    worst = max(found, key=lambda each: each.moves, default=None)
    if worst is None or worst.wilder <= acceptance.WILDER:
        return None
    return worst if worst.moves > acceptance.BEYOND_GAIN * max(gain, noise) else None


@dataclass(frozen=True)
class _Drives:
    """The drives of both inverses for a reference made of one record; `at`: its compared samples."""

    t: Array
    extra: dict[str, Array]
    at: NDArray[np.intp]
    reference: Array
    ours: Array
    theirs: Array

    @property
    def wilder(self) -> float:
        """rms second difference of the drive with effects, divided by that of the plain inverse's drive."""
        ours, theirs = (float(np.sqrt(np.mean(np.diff(v, 2) ** 2))) for v in (self.ours, self.theirs))
        return ours / theirs if theirs > 0.0 else math.inf


def _drives(extended: Model, plain: Model, item: Item) -> _Drives | None:
    """Both inverses over one record; None if one fails or too few samples are compared."""
    end = min(len(item.run.t), SAMPLES)
    compared = np.arange(len(item.run.t))[item.compared]
    at = compared[compared < end]
    if len(at) < acceptance.COMPARED_SAMPLES:
        return None
    t, extra = item.run.t[:end], {name: column[:end] for name, column in item.run.extra.items()}
    known = np.flatnonzero(item.known)
    y = np.interp(np.arange(end), known, item.y[known])
    try:
        level = float(np.mean((_moved(extended, item.run.v[:end], t, extra) - y)[at]))
        reference = _smooth(y) + level
        return _Drives(t, extra, at, reference, *(_drive(each, reference, t, extra) for each in (extended, plain)))
    except (EffectsError, NotInvertibleError):
        return None


def _over(extended: Model, plain: Model, drives: _Drives, gain: float, noise: float) -> Wild | None:
    """Comparison of the two inverses over one record; None if an inverse fails on the noise."""
    t, extra, reference = drives.t, drives.extra, drives.reference
    shaken = reference + _smooth(noise * np.random.default_rng(SEED).standard_normal(len(t)))
    try:
        noisy = _drive(extended, shaken, t, extra)
        behind, behind_noisy = (_moved(plain, v, t, extra) for v in (drives.ours, noisy))
        other = _moved(extended, drives.theirs, t, extra)
    except (EffectsError, NotInvertibleError):
        return None
    moves = apart(_rms(behind, reference, drives.at), _rms(behind_noisy, behind, drives.at))
    return Wild(moves, _rms(other, reference, drives.at), gain, drives.wilder)


def _moved(model: Model, v: Array, t: Array, extra: dict[str, Array]) -> Array:
    """The output for a drive, even out of range."""
    return model.chain.simulate([model.run(v, t, extra)])[0]


def _drive(model: Model, u: Array, t: Array, extra: dict[str, Array]) -> Array:
    """The drive for a reference, not limited to its range."""
    return model.compensator.drives(model.run(u, t, extra), (-math.inf, math.inf))


def _smooth(y: Array) -> Array:
    """Moving average over a few samples, applied twice, so that second differences contain little noise."""
    n = SMOOTHED
    kernel = np.ones(n) / n
    for _ in range(2):
        y = np.convolve(np.pad(y, n // 2, mode="edge"), kernel, mode="valid")
    return y


def _rms(one: Array, other: Array, at: NDArray[np.intp]) -> float:
    """rms difference at samples, with a free offset."""
    return float(np.std((one - other)[at]))
