"""The result of a search put together: what is left of the error, what was found, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data import disturbances, preparing
from hystgen.diagnosis.data.items import Item, rms
from hystgen.diagnosis.data.preparing import Prepared
from hystgen.diagnosis.data.signals import NoiseFloor
from hystgen.diagnosis.findings import intervals, residual, stretches
from hystgen.diagnosis.findings.kinds import Fault, Finding, Line, Ripple, Structure
from hystgen.diagnosis.findings.result import Contender, Errors, Gap, Inverse, NamedEffect, Result, rounded
from hystgen.diagnosis.search import acceptance
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.selection import Found, Outcome

Array = NDArray[np.float64]

ONE_LOOP = (
    "all records pass one loop, which tells little more than of one effect: add smaller loops inside it, other speeds "
    "and holds"
)
"""Advice about records of one loop alone."""

ADVICE: dict[frozenset[str], str] = {
    frozenset(("creep", "drift")): "record holds of a minute after moves both ways: creep follows the last move",
    frozenset(("lag", "delay")): "record full steps with three samples or more to the edge: a lag has a tail",
    frozenset(("lag", "resonance")): "record steps or a sweep: a resonance rings and has a peak",
    frozenset(("lag", "rate_dependence")): "record small loops at high rate with reversals: a lag opens them",
    frozenset(("asymmetry", "sensor_nonlinearity")): "record wide and nested loops: a sensor's curve is a line over y",
}
"""The experiment that separates two effects."""


def result_of(
    unit: str | None,
    ready: Prepared,
    noise: NoiseFloor,
    found: Outcome,
    as_given: Errors,
    odd: Sequence[Finding],
    one_loop: bool,
    inverse: Inverse,
) -> Result:
    """The whole result.

    `as_given`: errors of the nominal model before it was refitted; `odd`: findings about whole records; `one_loop`:
    whether all records pass the same one.
    """
    before = [found.refitted.errors(group) for group in (ready.to_fit, ready.held)]
    after = [found.fitted.errors(group) for group in (ready.to_fit, ready.held)]
    gap = Gap(as_given, *(Errors(*map(rms, each)) for each in (before, after)))
    left = _unexplained(ready, after, noise.rms, max(gap.after.fit, noise.rms), odd)
    everything = [*ready.to_fit, *ready.held]
    rivals = tuple((each.name, rival) for each in found.found for rival in each.rivals)
    structured = any(isinstance(each, Structure) for each in left)
    result = Result(
        verdict="effects_found" if found.found else "unexplained" if left else "nothing_missing",
        noise_floor=noise.rms,
        output_range=max(float(np.ptp(item.y[item.known])) for item in everything if item.known.any()),
        unit=unit,
        gap=gap,
        effects=_effects(found, ready.to_fit, gap.refitted.holdout),
        unexplained=(*left, *(each for each in odd if each not in left), *ready.repaired),
        where=stretches.worst(everything, [*before[0], *before[1]], noise.rms),
        not_separable=rivals,
        advice=(
            *(ADVICE.get(frozenset(pair), _advice(*pair)) for pair in rivals),
            *([ONE_LOOP] if (rivals or structured) and one_loop else []),
            *(more for each in left for more in each.advice()),
        ),
        ranking=tuple(
            tuple(Contender(t.name, t.option.label, t.fitted.rms, t.held_out) for t in each) for each in found.rankings
        ),
        inverse=inverse,
    )
    return rounded(result)


def _unexplained(
    ready: Prepared, after: Sequence[list[Array]], noise: float, usual: float, odd: Sequence[Finding]
) -> list[Finding]:
    """What the model leaves that is neither noise nor a fault of the recording; `usual`: error of a fitted record."""
    everything, errors = [*ready.to_fit, *ready.held], [*after[0], *after[1]]
    lines, errors = disturbances.lines(everything, errors)
    known = [each for each in odd if isinstance(each, Line | Ripple)]
    new = [line for line in lines if not disturbances.is_known(line, known)]
    # a ripple hides jumps as noise does, where the position is not predicted well enough to take it out
    jumping = max([noise, *(each.amplitude for each in (*known, *new) if isinstance(each, Ripple))])
    sticking = preparing.merged(disturbances.stick_slip(everything, errors, jumping))
    left = [each for each in odd if not isinstance(each, Fault)] + new + sticking
    held = errors[len(ready.to_fit) :]
    share, _ = residual.shares(ready.held, held)
    share = max(share, *residual.together(everything, errors))
    if not acceptance.is_noise(rms(held), noise, share):
        alone = tuple(
            item.name for item, e in zip(ready.held, after[1], strict=True)
            if rms([e]) > acceptance.HELD_OUT_ALONE * usual
        )  # fmt: skip
        left.append(residual.described(everything, errors, noise, alone))
    return left


def _effects(found: Outcome, to_fit: Sequence[Item], refitted: float) -> tuple[NamedEffect, ...]:
    if not found.found:
        return ()
    sure = intervals.intervals(found.fitted, to_fit)
    effects = []
    for k, each in enumerate(found.found):
        later = sum(other.name == each.name for other in found.found[k + 1 :])
        effects.append(
            NamedEffect(
                each.name,
                _parameters_of(found.fitted, each.name, later),
                sure.of(found.fitted, each.name, later),
                (each.before - each.after) / refitted if refitted else 0.0,
                each.before,
                each.after,
                each.p_value,
                _evidence(each),
            )
        )
    return tuple(effects)


def _advice(one: str, other: str) -> str:
    return f"{one} and {other} cannot be told apart by these records; hystgen diagnose --plan writes drives that can"


def _evidence(each: Found) -> str:
    gain = 100.0 * (1.0 - each.after / each.before) if each.before else 0.0
    return f"{each.label}: held-out rms {each.before:.4g} to {each.after:.4g} ({gain:.0f} % less)"


def _parameters_of(fitted: Fitted, name: str, later: int) -> dict[str, Any]:
    """The entry's keys without the name; for a front its stage. `later`: how many of that name were found after it."""
    k = intervals.place(fitted, name, later)
    if k is None:
        return intervals.stage(fitted, fitted.shape)
    return intervals.entry(fitted.structure.effects(fitted.shape)[k])
