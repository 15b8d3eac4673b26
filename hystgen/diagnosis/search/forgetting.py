"""Whether the hysteresis departs from a play sum: minor loops stay open and depend on the past, at any speed.

A play sum forgets a minor loop when it closes, and nothing else. Friction, Bouc-Wen and Duhem plants forget gradually
as the drive travels. If the search has not named elements in parallel with the plays, one such element may still show
that the hysteresis is of this kind: it is fitted beside the effects found, judged by the rules for names, and only
reported. At a single speed, travel and time are equivalent, so the search does not try elements: this one can then
replace creep, a lag or a rate dependence, and vice versa.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data import signals
from hystgen.diagnosis.data.items import rms
from hystgen.diagnosis.findings.kinds import NotAPlaySum
from hystgen.diagnosis.search import acceptance, fits, ranges, selection
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.hypothesis import Part, Structure
from hystgen.diagnosis.search.screening import Option, Records, Tried
from hystgen.diagnosis.search.selection import Outcome, Refusal
from hystgen.effects import PARALLEL, shapes
from hystgen.effects.base import Candidate, Effect
from hystgen.plays import operators

Array = NDArray[np.float64]

BALANCE = 0.9
"""Balance from which a search starts, between 1 (Dahl's element) and 0.5 (one that unloads in a straight line)."""

LOOP = 0.1
"""[fraction of the drive range] Width of the minor loop that is reported to stay open, as in `docs/plants.md`."""

STEPS = 12
"""[steps] Maximum number in the search from the best width; six usually settle three parameters and the weights."""


def forgets(outcome: Outcome, records: Records) -> NotAPlaySum | None:
    """The element, if the records support it in addition to the effects found or instead of them; else None.

    The element first replaces all effects of the `outcome`, then only those that depend on time; then it is tried in
    addition to all. Effects that explain more than the element are kept. Where the difference may be chance, they are
    kept if the drive covers equal distances in different times, since effects of time and of travel then differ.
    """
    none, now = outcome.refitted, outcome.fitted
    if records.one_loop or not selection.leaves_enough(none, records) or now.actuator.joining:
        return None
    shown = signals.shows_speed([*records.to_fit, *records.held])
    names = tuple(dict.fromkeys(each.name for each in outcome.found))
    for base, replaced in _bases(outcome, records):
        alone = _element(base, records)
        if _borne_out(base, alone, records) and (not names or _replaces(alone, now, records, shown)):
            return _found(base, alone, replaced, shown, records)
    if not names or not selection.leaves_enough(now, records):
        return None
    beside = _element(now, records)
    return _found(now, beside, (), shown, records) if _borne_out(now, beside, records) else None


def _bases(outcome: Outcome, records: Records) -> Iterator[tuple[Fitted, tuple[str, ...]]]:
    """The models to which the element is added, with the effects that it would replace.

    First the refitted model; then the model with only the effects found that do not depend on time or, if none were
    found, with the best such effect tried: a Duhem plant's forgetting shows only once its bent middle line is modelled.
    """
    now = outcome.fitted
    names = tuple(dict.fromkeys(each.name for each in outcome.found))
    yield outcome.refitted, names
    timed = tuple(name for name in names if name in _timed(now))
    if timed and len(timed) < len(names):
        yield _without(now, timed, records), timed
    elif not names and outcome.rankings:
        tried = [each.tried for each in outcome.rankings[0] if each.tried.name not in _timed(each.tried.fitted)]
        best = min(tried, key=lambda each: each.held_out, default=None)
        if best is not None:
            yield best.fitted, ()


def _timed(fitted: Fitted) -> frozenset[str]:
    """Names of the effects of a model that depend on the times of samples."""
    return frozenset(effect.name for effect in fitted.structure.effects(fitted.shape) if type(effect).timed)


def _without(now: Fitted, names: Sequence[str], records: Records) -> Fitted:
    """A model without some of its effects, refitted."""
    for name in names:
        now = selection.without_effect(now, name, records) or now
    return now


def withheld(outcome: Outcome, found: NotAPlaySum | None, records: Records) -> Outcome:
    """The outcome without the effects that the element replaces."""
    if found is None or not found.in_place_of:
        return outcome
    ranked = selection.refused(outcome.rankings, Refusal("forgets", found.after))
    rest = [each for each in outcome.found if each.name not in found.in_place_of]
    smaller = _without(outcome.fitted, found.in_place_of, records) if rest else outcome.refitted
    chain = selection.in_place(smaller, rest, outcome.found[0].before, records) if rest else []
    if not chain:
        return Outcome(outcome.refitted, outcome.refitted, (), ranked)
    ends = ranges.ends(smaller, None, acceptance.is_noise(records.residual(smaller), records.noise))
    return Outcome(outcome.refitted, smaller, tuple(chain), ranked, ends=ends, written=selection.EXTENDED)


def _element(now: Fitted, records: Records) -> Tried:
    """The hypothesis with the element, started at the best of several widths and fitted well enough for ranking."""
    kind, simpler = shapes(PARALLEL)[:2]
    dahl = simpler.candidates(replace(records.known, speeds=True))[0]

    def build(x: Array) -> Effect:
        found = dahl.build(x[:2]).model_dump(exclude={"shape"})
        return kind.model_validate({**found, "balance": float(x[2])})

    starts = [np.append(start, BALANCE) for start in (dahl.start, *dahl.others)]
    low, high = np.append(dahl.low, 0.5 + 1e-6), np.append(dahl.high, 1.0)
    high[0] = 0.0  # with a positive weight the output would lead
    candidate = Candidate("an element that forgets", low, high, starts[0], build, None, tuple(starts[1:]), amounts=(0,))

    def structure(part: Candidate) -> Structure:
        return replace(now.structure, parts=(*now.structure.parts, Part(PARALLEL, part)))

    def amount(start: Array) -> fits.Search:
        shape = np.concatenate([now.shape, start])
        return fits.begun(structure(candidate.at(start)), records.quick, shape, now.weights).further(1, fits.COARSE)

    begun = min(map(amount, starts), key=lambda each: each.now.rms)
    whole = structure(candidate)
    fitted = fits.begun(whole, records.quick, begun.now.shape, begun.now.best).further(STEPS).found(now.weights)
    errors = fitted.errors(records.held)
    option = Option(candidate.label, PARALLEL, whole, whole, tuple(starts))
    return Tried(option, fitted, (PARALLEL,), rms(errors), errors)


def _borne_out(now: Fitted, tried: Tried, records: Records) -> bool:
    """Whether the element deserves a name, and removes most of the gap."""
    merit = selection.merit_of(now, tried, records)
    if merit is None or not merit.worth(records.gap, records):
        return False
    both = ((rms(tried.fitted.errors(items)), rms(now.errors(items))) for items in (records.held, records.to_fit))
    return all(selection.takes_most(left, gap, records.noise) for left, gap in both)


def _replaces(alone: Tried, named: Fitted, records: Records, shown: bool) -> bool:
    """Whether the element replaces the named effects."""
    both = [(alone.fitted.errors(items), named.errors(items)) for items in (records.held, records.to_fit)]
    if all(rms(mine) <= (1.0 - acceptance.BETTER) * rms(theirs) for mine, theirs in both) and any(
        selection.difference(theirs, mine) <= acceptance.P_SURE for mine, theirs in both
    ):
        return True
    if shown or not all(selection.no_worse(rms(mine), rms(theirs), records.noise) for mine, theirs in both):
        return False
    mine, theirs = ([error for pair in both for error in pair[k]] for k in (0, 1))
    return selection.difference(mine, theirs) > acceptance.P_DIFFERENT


def _found(now: Fitted, tried: Tried, names: tuple[str, ...], shown: bool, records: Records) -> NotAPlaySum:
    element = tried.fitted.structure.effects(tried.fitted.shape)[-1]
    low, high = records.known.drive
    width, gap = element.model_dump()["widths"][0] / (high - low), _open(tried.fitted, element, low, high)
    return NotAPlaySum(records.residual(now), tried.held_out, width, gap, names, shown)


def _open(fitted: Fitted, element: Effect, low: float, high: float) -> float:
    """Gap left by a minor loop in the middle of the drive range, as a fraction of its height; 0 with plays alone."""
    begin = 0.5 * (low + high)
    end = begin + LOOP * (high - low)
    v = np.array([low, high, low, end, begin, end])
    r = fitted.structure.thresholds
    y = fitted.weights @ operators.plays(v, r, np.full(len(r), low)) + element.parallel(v)
    return abs(float((y[5] - y[3]) / (y[3] - y[4])))
