"""From a model with effects to the numbers that its operators work with, in one arithmetic."""

from __future__ import annotations

from collections.abc import Iterator

from hystgen.arithmetic import ARITHMETICS
from hystgen.chain.chain import Chain
from hystgen.compensator.chain import fixed_tables, float_tables, moving
from hystgen.compensator.chain.layout import Compiled, Parts
from hystgen.effects.ageing import compensator as ageing
from hystgen.effects.ageing.model import SHAPES as AGEING
from hystgen.effects.base import USER, Effect
from hystgen.parameters.schema import Compensation

STANDARD = Compensation()


def build(
    chain: Chain,
    arithmetic: str,
    seconds: float,
    how: Compensation = STANDARD,
    lsb: tuple[float | None, float | None] = (None, None),
) -> Compiled:
    """The model in an arithmetic at steps of `seconds`; `lsb` as in `hystgen.compensator.tables.build`.

    None of its effects is among the `refusals`. Raises FormatError when a
    number does not fit the arithmetic.
    """
    if ARITHMETICS[arithmetic].fixed:
        return fixed_tables.build(chain, arithmetic, seconds, how, lsb)
    return float_tables.build(chain, arithmetic, seconds, how)


def refusals(chain: Chain, operator: str, seconds: float, arithmetic: str) -> Iterator[tuple[Effect, str]]:
    """The effects that an operator cannot have in the C in an arithmetic, each with its reason."""
    low, high = chain.cascade.input_range
    parts = Parts.of(chain.effects)
    for effect in chain.effects:
        if operator != "inverse" and effect.name in ("delay", "resonance"):
            yield effect, "only the inverse has it; emit the inverse alone"
        elif effect.name == "drift":
            yield effect, "a clock that runs alone, and nothing says when it began; set_offset takes it from outside"
        elif effect.name == "thermal" and not effect.columns:
            yield effect, "the drive's own heat, open loop: its temperature drifts with the room's; measure it"
        elif effect.name.startswith(USER):
            yield effect, "an effect of your own, which has no compensator"
        elif effect in parts.ageing[1:]:
            yield effect, "one gain follows the travel, and there is another one"
        elif isinstance(effect, AGEING):
            yield from ((effect, reason) for reason in ageing.problems(effect, high - low))
    if operator != "inverse":
        yield from moving.beyond_forward(chain.cascade, parts.plays, seconds)
    without = list(moving.problems(chain.cascade, parts.plays))
    yield from without
    if ARITHMETICS[arithmetic].fixed and not without:
        yield from moving.beyond_fixed(chain.cascade, parts.plays, seconds)
