"""The contribution of an effect that is left out of the C."""

from __future__ import annotations

import numpy as np

from hystgen.basics.problems import EffectsError
from hystgen.compensator.chain.layout import SAMPLES_A_SWEEP
from hystgen.effects.base import Effect
from hystgen.model import Model

SWEEPS = 8
"""[sweeps] Number of sweeps over the whole range for which an effect is measured. For effects that settle, the result
is within 2 % of that for 64 sweeps (lag, resonance; 16 % for a slew limit); creep and ageing never settle. Set by:
benchmarks/chosen_numbers.py sweeps."""


def sentence(model: Model, effect: Effect, reason: str) -> str:
    """The effect, why it is left out, and the rms difference it makes over full sweeps at the fastest rate."""
    low, high = model.cascade.input_range
    n = SWEEPS * SAMPLES_A_SWEEP + 1
    v = low + (high - low) * np.abs((np.arange(n) / SAMPLES_A_SWEEP) % 2.0 - 1.0)
    unit = model.parameters.units.output
    try:
        missing = model.simulate(v) - model.without([effect]).simulate(v)
    except EffectsError:  # depends on a column that only a record has
        return f"{effect.name} ({reason}); its contribution depends on a record's columns"
    rms = float(np.sqrt(np.mean(missing**2)))
    worth = f"{rms:.3g}{f' {unit}' if unit.isascii() and unit else ''} rms"
    return f"{effect.name} ({reason}); contributes {worth} over sweeps of {SAMPLES_A_SWEEP} samples"
