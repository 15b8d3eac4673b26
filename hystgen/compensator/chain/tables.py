"""The numbers that the operators of a model with effects work with, in one arithmetic."""

from __future__ import annotations

import functools
from collections.abc import Iterator

from hystgen.arithmetic import ARITHMETICS
from hystgen.chain.chain import Chain
from hystgen.compensator.chain import fixed_tables, float_tables, moving, own
from hystgen.compensator.chain.layout import Compiled
from hystgen.compensator.chain.parts import Parts
from hystgen.effects.ageing import compensator as ageing
from hystgen.effects.ageing.model import SHAPES as AGEING
from hystgen.effects.base import USER, Effect, Place
from hystgen.effects.delay import compensator as delay
from hystgen.effects.thermal import compensator as thermal
from hystgen.effects.thermal.model import OwnHeat
from hystgen.parameters.schema import Compensation

STANDARD = Compensation()


@functools.lru_cache(maxsize=32)
def build(
    chain: Chain,
    arithmetic: str,
    seconds: float,
    how: Compensation = STANDARD,
    lsb: tuple[float | None, float | None] = (None, None),
    engine: str = "loop",
) -> Compiled:
    """The model in an arithmetic at steps of `seconds`; `lsb` as in `hystgen.compensator.tables.build`; `engine`:
    'corners' or 'loop', for plays that no effect moves or bends.

    None of its effects is among the `refusals`. The result is shared by all who ask for the same: checking a model,
    writing its C and running its reference each ask. Raises FormatError if a number does not fit the arithmetic.
    """
    if ARITHMETICS[arithmetic].fixed:
        return fixed_tables.build(chain, arithmetic, seconds, how, lsb, engine)
    return float_tables.build(chain, arithmetic, seconds, how, engine, lsb[0])


def _behind_slew(chain: Chain) -> int:
    """Number of effects up to and including the slew limit, 0 without one."""
    return max((i for i, effect in enumerate(chain.effects) if effect.name == "slew_limit"), default=-1) + 1


def refusals(
    chain: Chain, operator: str, seconds: float, arithmetic: str, how: Compensation = STANDARD
) -> Iterator[tuple[Effect, str]]:
    """The effects that the C of an operator cannot include in an arithmetic, each with its reason."""
    low, high = chain.cascade.input_range
    parts = Parts.of(chain.effects)
    for effect in chain.effects:
        if operator != "inverse" and effect.name == "delay" and parts.delay > delay.MOST_SAMPLES * seconds:
            yield effect, (
                f"{parts.delay / seconds:.6g} samples, and the forward operator keeps {delay.MOST_SAMPLES} at most; "
                "emit the inverse alone"
            )
        elif effect.name == "drift" and "drift" not in how.compensate:
            yield effect, (
                "a clock that runs alone, and nothing says when it began; set_offset takes it from outside, and "
                "emit.compensation.compensate: [drift] lets the module count from there"
            )
        elif isinstance(effect, OwnHeat) and "self_heating" not in how.compensate:
            yield effect, (
                "the drive's own heat, open loop: its temperature drifts with the room's; measure it, or have it "
                "followed by emit.compensation.compensate: [self_heating]"
            )
        elif isinstance(effect, OwnHeat):
            yield from ((effect, reason) for reason in thermal.heat_problems(effect, (low, high), seconds))
        elif effect.block:
            yield from ((effect, reason) for reason in own.problems(effect, seconds, ARITHMETICS[arithmetic].fixed))
            if effect.place is Place.DRIVE and effect in chain.effects[: _behind_slew(chain)]:
                yield effect, "in front of the slew limit; give it an order: ClassVar[int] above that of slew_limit, 1"
        elif effect.name.startswith(USER):
            yield effect, "an effect of your own, which has no compensator"
        elif effect in parts.blocks["ageing"][1:]:
            yield effect, "one gain follows the travel, and there is another one"
        elif isinstance(effect, AGEING):
            yield from ((effect, reason) for reason in ageing.problems(effect, high - low))
    if operator != "inverse":
        yield from moving.beyond_forward(chain.cascade, parts.plays, seconds)
    yield from moving.problems(chain.cascade, parts.plays, seconds)
