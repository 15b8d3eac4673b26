"""Elastoplastic elements, solved as one-dimensional plasticity: the mechanics of play and stop (7)-(17).

A spring of modulus E and a rigid-plastic slider of yield stress r, in parallel or in series. A step is a return
mapping: a trial stress with the slider at rest, kept if the slider can bear it, else returned to the yield stress.
No operator is involved, so the elements test the operators independently.

A slider obeys `stress in r sign(rate)`, set-valued at rest, where `rate` is that of its own strain; the note prints the
rate of the total strain in (16).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.arguments import finite, finite_samples

Array = NDArray[np.float64]


class Parallel(NamedTuple):
    """Response of the parallel element, arrays (N,); the stresses add up to the applied stress (7)."""

    strain: Array
    elastic_stress: Array
    plastic_stress: Array


class Series(NamedTuple):
    """Response of the series element, arrays (N,); the strains add up to the applied strain (13)."""

    stress: Array
    elastic_strain: Array
    plastic_strain: Array


def _check(modulus: float, yield_stress: float) -> None:
    if not (modulus > 0.0 and math.isfinite(modulus)):
        raise ValueError("a modulus must be positive")
    if not (yield_stress >= 0.0 and math.isfinite(yield_stress)):
        raise ValueError("a yield stress must not be negative")


def parallel(stress: ArrayLike, modulus: float, yield_stress: float, strain: float = 0.0) -> Parallel:
    """Spring and slider in parallel under a given stress (7)-(11); `strain`: their common strain before the first
    sample.

    `stress`: N samples in the unit of `yield_stress`, which is the unit of `modulus` times `strain`. The strain is
    `play_r[stress] / E` (12), with the play started at `E strain`. Raises ValueError for a modulus that is not
    positive, a negative yield stress, and samples or a start that are not finite.
    """
    _check(modulus, yield_stress)
    finite(strain=strain)
    applied = finite_samples(stress)
    strains, plastic = np.empty_like(applied), np.empty_like(applied)
    for k, sigma in enumerate(applied.tolist()):
        borne = sigma - modulus * strain
        excess = abs(borne) - yield_stress
        if excess > 0.0:
            strain += math.copysign(excess / modulus, borne)
            borne = math.copysign(yield_stress, borne)
        strains[k], plastic[k] = strain, borne
    return Parallel(strains, modulus * strains, plastic)


def series(strain: ArrayLike, modulus: float, yield_stress: float, plastic_strain: float = 0.0) -> Series:
    """Spring and slider in series under a given strain (13)-(16); `plastic_strain`: of the slider, before sample 0.

    `strain`: N samples in the unit of `plastic_strain`; that times the unit of `modulus` is the unit of `yield_stress`.
    The stress is `stop_r[E strain]` (17), the stop started at `E plastic_strain`. Raises ValueError as `parallel` does.
    """
    _check(modulus, yield_stress)
    finite(plastic_strain=plastic_strain)
    applied = finite_samples(strain)
    stresses, plastic = np.empty_like(applied), np.empty_like(applied)
    for k, epsilon in enumerate(applied.tolist()):
        trial = modulus * (epsilon - plastic_strain)
        excess = abs(trial) - yield_stress
        if excess > 0.0:
            plastic_strain += math.copysign(excess / modulus, trial)
            trial = math.copysign(yield_stress, trial)
        stresses[k], plastic[k] = trial, plastic_strain
    return Series(stresses, applied - plastic, plastic)
