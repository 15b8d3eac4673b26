"""Why the emitted inverse of a model with effects may be of little use, as worded in its banner and on stderr."""

from __future__ import annotations

import math

from hystgen.compensator.chain import noise, own
from hystgen.compensator.chain.layout import Compiled
from hystgen.effects.base import Effect
from hystgen.emission.text import comment_text
from hystgen.parameters.files import Parameters

NOISY = 4.0
"""[times the gain at rest] Noise gain above which a doubt is reported: the drive then has two more bits of noise than
the reference. The inverse of a lag of one sample has 3.97. Set by: benchmarks/chosen_numbers.py noisy."""

FAST = 50.0
"""[time constants of the slowest effect] A sample time this long or longer is taken for a mistake: the effect then
shifts the drive by a 50th of a sample, 4e-4 of the range in the fastest sweep with a stated bound (SAMPLES_A_SWEEP).
Set by: benchmarks/chosen_numbers.py fast."""


def found(parameters: Parameters, compiled: Compiled) -> list[str]:
    """One sentence for each doubt."""
    return [*_noise(parameters, compiled), *_too_fast(parameters, compiled)]


def _noise(parameters: Parameters, compiled: Compiled) -> list[str]:
    """A doubt about noise in the reference that reaches the drive."""
    if compiled.noise_gain <= NOISY:
        return []
    drive, hertz = noise.loudest(compiled.gain)
    into, out = comment_text(parameters.units.input), comment_text(parameters.units.output)
    if compiled.codes is None:
        shown = f"there, 1 {out or 'output unit'} rms of it moves the drive by {drive:.3g} {into or 'input units'} rms"
    else:
        least = float(compiled.codes.drive_lsb) / drive
        shown = f"there, {least:.3g} {out or 'output units'} rms of it moves the drive by one code rms"
    asked = parameters.emit.compensation.noise_gain
    advice = "" if asked else "; emit.compensation.noise_gain limits it by averaging the reference"
    return [
        f"Noise in the reference is amplified up to {compiled.noise_gain:.3g} times as much as slow motion, most at "
        f"{hertz:.4g} Hz: {shown}{advice}"
    ]


def _too_fast(parameters: Parameters, compiled: Compiled) -> list[str]:
    """A doubt about effects that have died out long before the next sample."""
    seconds = compiled.seconds
    scale, name = max((_time_scale(effect, compiled), effect.name) for effect in parameters.model.effects)
    if not 0.0 < scale <= seconds / FAST:
        return []
    return [
        f"Effects die out within a sample: the slowest, {name}, takes {scale:.3g} s, and sample_time is "
        f"{seconds:.3g} s, so the inverse hardly differs from one without effects; sample_time is in seconds, "
        f"{1e-6 * seconds:.3g} for {seconds:.3g} us"
    ]


def _time_scale(effect: Effect, compiled: Compiled) -> float:
    """`Effect.time_scale`, or for a user's own effect the time scale of its slowest state."""
    low, high = compiled.static.input_range
    scale = effect.time_scale(high - low)
    if scale or effect.block is None:
        return scale
    radius = own.linear(effect, compiled.seconds).forward.radius
    if not 0.0 < radius < 1.0:
        return math.inf if radius else 0.0
    return -compiled.seconds / math.log(radius)
