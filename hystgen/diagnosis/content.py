"""What was found as `diagnosis.json` has it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hystgen.diagnosis import (
    bad_samples,
    description,
    disturbances,
    intervals,
    periodic,
    stick_slip,
    structure,
    told,
    where,
)
from hystgen.diagnosis.believed import Prepared
from hystgen.diagnosis.decisions import FAR_ABOVE
from hystgen.diagnosis.floor import Floor
from hystgen.diagnosis.selection import Found, Outcome
from hystgen.diagnosis.structure import Array, Fitted

if TYPE_CHECKING:
    from hystgen.parameters.files import Parameters

STRUCTURE = 0.15
"""Share of the residual's variance that goes with a variable on unseen samples, beyond which it is no noise."""

ABOVE_FLOOR = 1.25
"""A residual this much larger than the noise, and with structure, is unexplained; one that is far above it anyway."""

ELSEWHERE = 3.0
"""What is left shows in a held-out record alone where that leaves so many times what the fitted ones do."""


def content_of(
    parameters: Parameters,
    ready: Prepared,
    noise: Floor,
    found: Outcome,
    as_given: Sequence[float],
    odd: list[dict[str, Any]],
    one_loop: bool,
) -> dict[str, Any]:
    """All that `diagnosis.json` says.

    `as_given`: rms errors of the model as it was believed, on fitted and held-out records; `odd`: what was found about
    whole records; `one_loop`: whether all of them pass the same one.
    """
    before = [found.refitted.errors(group) for group in (ready.to_fit, ready.held)]
    after = [found.fitted.errors(group) for group in (ready.to_fit, ready.held)]
    refitted, last = ([structure.rms(errors) for errors in each] for each in (before, after))
    everything, errors = [*ready.to_fit, *ready.held], [*after[0], *after[1]]
    lines, errors = periodic.lines(everything, errors)
    known = [each for each in odd if each["kind"] in ("line", "ripple")]
    periodic_ones = [line for line in lines if not disturbances.is_told(line, known)]
    # where the position is not predicted as well as a ripple asks for, what is left of that jumps
    jumping = max([noise.rms, *(each["amplitude"] for each in (*known, *periodic_ones) if each["kind"] == "ripple")])
    sticking = bad_samples.merged(stick_slip.stick_slip(everything, errors, jumping))
    left = [each for each in odd if each["kind"] not in told.REPAIRED] + periodic_ones + sticking
    share, _ = description.structure(ready.held, errors[len(ready.to_fit) :])
    share = max(share, *description.together(everything, errors))
    rest = structure.rms(errors[len(ready.to_fit) :])
    ratio = rest / noise.rms if noise.rms else float("inf")
    if ratio > FAR_ABOVE or (share > STRUCTURE and ratio > ABOVE_FLOOR):
        alone = _alone(ready, after[1], max(last[0], noise.rms))
        left.append({**description.described(everything, errors, noise.rms), "held_out_alone": alone})
    verdict = "effects_found" if found.found else "unexplained" if left else "nothing_missing"
    effects = []
    sure = intervals.intervals(found.fitted, ready.to_fit) if found.found else intervals.Sure({}, ())
    for k, each in enumerate(found.found):
        later = sum(other.name == each.name for other in found.found[k + 1 :])
        effects.append(
            {
                "name": each.name,
                "parameters": _parameters_of(found.fitted, each.name, later),
                "intervals": sure.of(found.fitted, each.name, later),
                "share_of_gap": (each.before - each.after) / refitted[1] if refitted[1] else 0.0,
                "holdout_before": each.before,
                "holdout_after": each.after,
                "p_value": each.p_value,
                "evidence": _evidence(each),
            }
        )
    open_ended = any(each["kind"] == "structure" for each in left)
    rivals = [[each.name, rival] for each in found.found for rival in each.rivals]
    units = parameters.units
    whole = {
        "hystgen": 1,
        "verdict": verdict,
        "noise_floor": noise.rms,
        "output_range": max(float(np.ptp(item.y[item.known])) for item in everything if item.known.any()),
        "unit": units.output,
        "gap": {
            "as_given": {"fit": as_given[0], "holdout": as_given[1]},
            "refitted": {"fit": refitted[0], "holdout": refitted[1]},
            "after": {"fit": last[0], "holdout": last[1]},
        },
        "effects": effects,
        "unexplained": [*left, *(each for each in odd if each not in left), *ready.repaired],
        "where": where.places([*ready.to_fit, *ready.held], [*before[0], *before[1]], noise.rms),
        "not_separable": rivals,
        "advice": [
            *(ADVICE.get(frozenset(pair), _advice(*pair)) for pair in rivals),
            *([told.ONE_LOOP] if (rivals or open_ended) and one_loop else []),
            *(more for each in left for more in told.advice(each)),
        ],
        "ranking": [
            [{"name": t.name, "shape": t.option.label, "fit": t.fitted.rms, "holdout": t.held_out} for t in each]
            for each in found.rankings
        ],
    }
    return _plain(whole)  # type: ignore[no-any-return]


ADVICE: dict[frozenset[str], str] = {
    frozenset(("creep", "drift")): "record holds of a minute after moves both ways: creep follows the last move",
    frozenset(("lag", "delay")): "record full steps with three samples or more to the edge: a lag has a tail",
    frozenset(("lag", "resonance")): "record steps or a sweep: a resonance rings and has a peak",
    frozenset(("lag", "rate_dependence")): "record small loops at high rate with reversals: a lag opens them",
    frozenset(("asymmetry", "sensor_nonlinearity")): "record wide and nested loops: a sensor's curve is a line over y",
}
"""Which experiment tells two effects apart."""


def _advice(one: str, other: str) -> str:
    return f"{one} and {other} cannot be told apart by these records; hystgen diagnose --plan writes drives that can"


def _alone(ready: Prepared, errors: Sequence[Array], fitted: float) -> list[str]:
    """Held-out records with an error that the fitted ones do not have."""
    return [item.name for item, e in zip(ready.held, errors, strict=True) if structure.rms([e]) > ELSEWHERE * fitted]


def _evidence(each: Found) -> str:
    gain = 100.0 * (1.0 - each.after / each.before) if each.before else 0.0
    return f"{each.label}: held-out rms {each.before:.4g} to {each.after:.4g} ({gain:.0f} % less)"


def _parameters_of(fitted: Fitted, name: str, later: int) -> dict[str, Any]:
    """The entry's keys without the name, `later` of that name having been found after it; for a front its stage."""
    k = intervals.place(fitted, name, later)
    if k is None:
        return intervals.stage(fitted, fitted.shape)
    return intervals.entry(fitted.structure.effects(fitted.shape)[k])


def _plain(value: Any) -> Any:
    """Numbers as JSON has them: eight digits, so that the same input gives the same text."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return float(f"{value:.8g}") if np.isfinite(value) else None
    return value
