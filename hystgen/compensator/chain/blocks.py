"""The blocks on both sides of the plays with their constants, in the order of the chain."""

from __future__ import annotations

import itertools

from hystgen.compensator.chain import own
from hystgen.compensator.chain.layout import ChainTables, OwnChainTables
from hystgen.effects.ageing import compensator as ageing
from hystgen.effects.ageing import fixed as ageing_fixed
from hystgen.effects.creep import compensator as creep
from hystgen.effects.creep import fixed as creep_fixed
from hystgen.effects.drift import compensator as drift
from hystgen.effects.drift import fixed as drift_fixed
from hystgen.effects.kinds import Constants
from hystgen.effects.lag import compensator as lag
from hystgen.effects.lag import fixed as lag_fixed
from hystgen.effects.resonance import compensator as resonance
from hystgen.effects.resonance import fixed as resonance_fixed
from hystgen.effects.thermal import compensator as thermal
from hystgen.effects.thermal import fixed as thermal_fixed

KINDS = (
    creep.KIND, lag.KIND, lag.EXACT_KIND, lag.BRAKED_KIND, ageing.KIND, thermal.HEAT_KIND, thermal.KIND, resonance.KIND,
    drift.KIND, thermal.FRICTION_KIND,
)  # fmt: skip
"""The kinds of blocks in the catalogue, each with its C in the folder of its effect."""


def sides(t: ChainTables, operator: str) -> tuple[list[Constants], list[Constants]]:
    """The blocks of an operator in front of the plays, starting at the drive, and those behind them."""
    modes = (resonance_fixed if t.fixed else resonance).constants(t.mode) if operator == "forward" else ()
    given = own.constants(t.own, t.own_effects) if isinstance(t, OwnChainTables) else []
    ahead, behind = given[: t.own.ahead], given[t.own.ahead :]
    if t.fixed:
        heats = thermal_fixed.heat_constants(t.heat)
        gains = [*ageing_fixed.constants(t.ageing), *heats, *thermal_fixed.constants(t.gain)]
        creeps, lags = creep_fixed.constants(t.creep), lag_fixed.constants(t.lag, bool(t.braked))
    else:
        gains = [*ageing.constants(t.ageing), *thermal.heat_constants(t.heat), *thermal.constants(t.gain)]
        creeps, lags = creep.constants(t.creep), lag.constants(t.lag, bool(t.braked))
    return [*lags, *ahead], [*creeps, *behind, *gains, *modes]


def every(t: ChainTables, operator: str) -> list[Constants]:
    """The blocks of both sides, what rubs, and the clock of a drift."""
    return [*itertools.chain(*sides(t, operator)), *(each for each in rubbing(t) if each), *clocks(t)]


def rubbing(t: ChainTables) -> list[Constants | None]:
    """The plays whose friction warms, of each block of own heat; None where the drive's square does."""
    return list((thermal_fixed if t.fixed else thermal).friction_constants(t.heat))


def clocks(t: ChainTables) -> list[Constants]:
    """The clock of a drift, if there is one."""
    return drift_fixed.constants(t.clock) if t.fixed else drift.constants(t.clock)
