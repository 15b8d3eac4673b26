"""What header and banner say about the effects of a model, and its numbers; imported for a model with effects alone."""

from __future__ import annotations

import shlex
from typing import Any

import numpy as np

from hystgen.chain.chain import Chain
from hystgen.chain.static import StaticModel
from hystgen.compensator.chain import tables
from hystgen.compensator.chain.bounds import kept_branch
from hystgen.compensator.chain.fixed_tables import TEMPERATURE_BITS
from hystgen.compensator.chain.layout import DITHER, DRIVE_BITS, LEAST_LATE, SHARE_BITS, Compiled
from hystgen.effects import own
from hystgen.effects.base import USER
from hystgen.emission.options import Options
from hystgen.emission.text import comment_text, literal
from hystgen.parameters.files import Parameters
from hystgen.parameters.schema import Units

PERIODS = (50, 200)
"""[samples] Periods for which the header states what is lost of a sine: a fast one, as long as the fastest sweep for
which bounds are stated, and a slow one."""


def compiled(parameters: Parameters, cascade: StaticModel, options: Options) -> Compiled:
    """The numbers of a model with effects."""
    assert parameters.sample_time is not None, "emit_options asks for it"
    how = parameters.emit.compensation
    lsb = (parameters.emit.drive_lsb, parameters.emit.output_lsb)
    whole = Chain(cascade, parameters.model.effects)
    return tables.build(whole, options.arithmetic, parameters.sample_time, how, lsb, options.engine)


def sources(parameters: Parameters) -> str:
    """The options that name the files of effects of the user's own."""
    found = (own.origin(type(effect)) for effect in parameters.model.effects if effect.name.startswith(USER))
    return "".join(f" --effects {shlex.quote(each)}" for each in dict.fromkeys(found))


def times(compiled: Compiled, kind: type[np.floating[Any]]) -> list[tuple[str, str, str]]:
    """Macros about time."""
    ahead = "samples that the argument of step is ahead of the motion"
    if compiled.late > LEAST_LATE:
        ahead += f", which is {compiled.late:.4g} late"
    return [
        ("PREVIEW", str(compiled.ahead), ahead),
        ("NOISE_GAIN", literal(kind(compiled.noise_gain)), "largest gain from reference to drive over that at rest"),
        ("MAX_RATE", literal(kind(compiled.max_rate)), "fastest drive, a second, for which the errors below hold"),
        *_settings(compiled),
    ]


def reading(compiled: Compiled, units: Units, drive: str) -> list[str]:
    """How the inverse reads its reference, one sentence for each option; `drive`: the unit of a drive behind a number.
    """
    return [*_filters(compiled), *_branches(compiled, units), *_quiet(compiled, drive)]


def _filters(compiled: Compiled) -> list[str]:
    """What holds the noise gain, what keeps modes from ringing, and what both cost."""
    found = []
    if (one := compiled.smoothing) is not None:
        often = {1: "once", 2: "twice"}.get(one.times, f"{one.times} times")
        losses = " and ".join(f"{100.0 * one.loss(period):.2g} % with {period} samples a period" for period in PERIODS)
        late = f", and the motion is {one.late:.3g} samples later" if one.late > LEAST_LATE else ""
        found.append(
            f"Noise: references are averaged {often} over {one.width:.4g} samples, so that the noise gain is "
            f"{compiled.noise_gain:.4g} instead of {one.without:.4g}; a sine loses {losses}{late}"
        )
    if (kept := compiled.shaped) is not None:
        missed = 100.0 * kept.missed(PERIODS[-1])
        found.append(
            f"Resonance: after a step of the reference the stage does not ring ({kept.by}). Not for tracking: it makes "
            f"the motion {kept.late:.3g} samples late, and a sine with {PERIODS[-1]} samples a period is missed by "
            f"{missed:.2g} % of its size"
        )
    return found


def _branches(compiled: Compiled, units: Units) -> list[str]:
    """What a drive that comes to rest in front of two branches leaves."""
    if not compiled.tables.turning:
        return []
    most = f"{kept_branch(compiled):.3g} {comment_text(units.output)}".rstrip()
    return [
        "Branches: the drive turns to the other branch only if staying on its own would miss more than a turn does at "
        f"first; that leaves at most {most} of a reference at rest"
    ]


def _settings(compiled: Compiled) -> list[tuple[str, str, str]]:
    """In fixed point, the size of a code that sets a temperature or a gain."""
    if not compiled.tables.fixed:
        return []
    bits = int(31 - compiled.tables.number[SHARE_BITS])
    kept = TEMPERATURE_BITS[bits]
    degree = ("TEMPERATURE_LSB", repr(2.0**-kept), "degC a code of set_temperature")
    gain = ("GAIN_LSB", repr(2.0 ** (2 - bits)), "a code of set_gain; travels are in drive codes")
    t = compiled.tables
    return [*([degree] if "set_temperature" in t.calls else []), *([gain] if "set_gain" in t.calls else [])]


def _quiet(compiled: Compiled, drive: str) -> list[str]:
    """When and how far a drive is kept at rest."""
    t = compiled.tables
    if not t.quiet:
        return []
    kept, unit = float(t.number[DITHER]), drive
    if t.fixed:
        kept, unit = kept / 2.0 ** int(t.number[DRIVE_BITS]), " drive codes"
    return [
        f"Quiet: after {t.quiet} equal references the drive stands still as long as it is within {kept:.4g}{unit} of "
        "the drive that is needed at rest; the input of the plays is then within twice that of the one sought"
    ]
