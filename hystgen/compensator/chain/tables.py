"""The constants of the operators of a model with effects, in one arithmetic."""

from __future__ import annotations

import functools
from collections.abc import Iterator

from hystgen.arithmetic import ARITHMETICS
from hystgen.chain.chain import Chain
from hystgen.compensator.chain import fixed_tables, float_tables, moving
from hystgen.compensator.chain.layout import Compiled
from hystgen.compensator.chain.parts import PARTS, Parts
from hystgen.effects.base import USER, Effect
from hystgen.effects.part import Setting
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

    None of its effects is among the `refusals`. Results are cached, since checking a model, writing its C and running
    its reference each need the same tables. Raises FormatError if a number does not fit the arithmetic.
    """
    if ARITHMETICS[arithmetic].fixed:
        return fixed_tables.build(chain, arithmetic, seconds, how, lsb, engine)
    return float_tables.build(chain, arithmetic, seconds, how, engine, lsb[0])


def refusals(
    chain: Chain, operator: str, seconds: float, arithmetic: str, how: Compensation = STANDARD
) -> Iterator[tuple[Effect, str]]:
    """The effects that the C of an operator cannot include in an arithmetic, each with its reason."""
    effects, parts = chain.effects, Parts.of(chain.effects)
    behind = max((i for i, effect in enumerate(effects, 1) if effect.slews), default=0)
    setting = operator, seconds, chain.cascade.input_range, ARITHMETICS[arithmetic].fixed
    for effect in effects:
        for part in (each for each in PARTS if each.takes(effect)):
            if part.unmeasured and part.unmeasured.key not in how.compensate:
                yield effect, part.unmeasured.emitted
            else:
                at = Setting(parts.blocks[part.name], effects[:behind], *setting)
                yield from ((effect, reason) for reason in part.problems(effect, at))
        if effect.name.startswith(USER) and not effect.block:
            yield effect, "an effect of your own, which has no compensator"
    if operator != "inverse":
        yield from moving.beyond_forward(chain.cascade, parts.plays, seconds)
    yield from moving.problems(chain.cascade, parts.plays, seconds)
