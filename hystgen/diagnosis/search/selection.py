"""Grey-box forward selection of effects that remove the gap on records not used in the fit.

Held-out errors decide, and fitted ones must confirm. The thresholds, and the reasons for them, are in `acceptance`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen import effects
from hystgen.cascade import Cascade
from hystgen.diagnosis.data.items import Item, everything, rms, thinned
from hystgen.diagnosis.data.preparing import Prepared
from hystgen.diagnosis.search import acceptance, fits, hypothesis, ranges, shared
from hystgen.diagnosis.search.acceptance import apart, is_noise
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.hypothesis import Structure
from hystgen.diagnosis.search.ranges import End, WiderRange
from hystgen.diagnosis.search.screening import Option, Records, Tried, free_numbers
from hystgen.effects.base import Effect
from hystgen.identification import joint
from hystgen.identification.joint import Ends, Kept
from hystgen.identification.pi import Weights
from hystgen.identification.quality import correlation_time

Array = NDArray[np.float64]

EXTENDED, REFITTED, GIVEN, IDENTIFIED = "extended", "refitted", "given", "identified"
"""Models that may be written: with the effects, the nominal one refitted or as given, the one from `identify`."""


# Merit of an effect, and the choice among several similar ones -----------------------------------------------


@dataclass(frozen=True)
class Merit:
    """Merit of an effect: the rms that it removes from held-out and from fitted records, and its significance."""

    removed: float
    fitted: float
    remaining: float
    """fraction of the held-out rms that remains"""
    p_value: float
    at_rest: bool = False
    """whether it explains what moves while the drive stands still"""

    def worth(self, gap: float, records: Records) -> bool:
        """Whether it removes enough of the gap, or of the error before it, to deserve a name."""
        of_gap = acceptance.NAME_SHARE
        return (
            self.at_rest
            or self.removed >= of_gap * gap
            or self.fitted >= of_gap * records.gap
            or self.remaining <= acceptance.NEARLY_ALL
        )


@dataclass(frozen=True)
class Refusal:
    """Why an effect that was tried is not named: a value, and the limit that it missed.

    `why`: `one_loop` [remaining fraction of the gap], `little` [rms removed], `chance` [p on held-out records],
    `unsure` [p on fitted records], `small` [fraction of the gap], `most` [remaining rms], `above` [remaining rms on
    records of one loop], `given` and `identified` [remaining rms], `few` [fraction of samples], `end` [fraction of the
    drive range], `grows` [s], `shared` [fraction of the removed power], `range` [remaining fraction of the gap],
    `forgets` [remaining rms with hysteresis other than a play sum], `wild` [rms change that the inverse causes in the
    plain model's output], `other`: another shape was chosen.
    """

    why: str
    value: float = math.nan
    limit: float = math.nan


def merit_of(now: Fitted, best: Tried, records: Records, least: float | None = None) -> Merit | None:
    """Merit of a tried effect, or None if `judged` refuses it."""
    found = judged(now, best, records, least)
    return found if isinstance(found, Merit) else None


def judged(now: Fitted, best: Tried, records: Records, least: float | None = None) -> Merit | Refusal:
    """Merit of a tried effect, or why it has none.

    An effect has no merit if chance explains the difference, if it removes too little to stand out from the noise, if
    it hardly shows in the held-out or in the fitted records, if records of only one loop do not support a name, if it
    is a limit that acts only at the very end of the drive range, or if it does not level off within the records.
    However few events show an effect, chance does not halve an error to which nothing was fitted. However much other
    causes leave, an effect has merit if it alone explains what moves while the drive stands still.

    `least`: the rms to be removed, as a multiple of the remaining error or the noise; by default the threshold for a
    first or a further effect.
    """
    if not _supported(now, best, records):
        gap = apart(records.residual(now), records.noise)
        left = apart(best.held_out, records.noise)
        return Refusal("one_loop", left / gap if gap > 0.0 else math.inf, acceptance.MOST_OF_GAP)
    front = best.fitted.structure.front
    if isinstance(front, Ends) and best.option.front:
        width = front.widest(best.fitted.shape)
        if width < acceptance.FLAT_END:
            return Refusal("end", width, acceptance.FLAT_END)
    if slow := _only_grows(best.fitted):
        return slow
    held, fitted = _removed(now, best, records)
    needed = _least(now) if least is None else least
    at_rest = _explains_rest(held, fitted, records)
    if not (at_rest or _enough(held, fitted, needed, records.noise)):
        short = held if held.removed < acceptance.SEEN_IN_BOTH * max(records.noise, held.left) else fitted
        return Refusal("little", short.removed, needed * max(records.noise, short.left))
    if _beside_rates(now, best) and not all(
        takes_most(each.left, rms(each.without), records.noise) for each in (held, fitted)
    ):
        return Refusal("most", held.left, rms(held.without))
    if column := shared.column_of(best.fitted):
        for removed, items in ((held, records.held), (fitted, records.to_fit)):
            before, after = shared.apart(items, column, (removed.without, removed.errors))
            power = rms(removed.without) ** 2 - rms(removed.errors) ** 2
            own = max(rms(before) ** 2 - rms(after) ** 2, 0.0) / max(power, 1e-300)
            if own < acceptance.OWN_SHARE or difference(before, after) > acceptance.P_SURE:
                return Refusal("shared", own, acceptance.OWN_SHARE)
    p_value = difference(held.without, held.errors)
    if not at_rest and (by_chance := _by_chance(held, fitted)):
        return by_chance
    return Merit(held.removed, fitted.removed, held.left / rms(held.without), p_value, at_rest)


def _by_chance(held: _Removed, fitted: _Removed) -> Refusal | None:
    """The refusal of an effect whose gain may be due to chance.

    A gain that held-out records do not make certain must be certain on fitted ones. Chance does not halve an error to
    which nothing was fitted.
    """
    p_value = difference(held.without, held.errors)
    if p_value > acceptance.P_REPEATED and held.left > acceptance.FAR_LESS * rms(held.without):
        return Refusal("chance", p_value, acceptance.P_REPEATED)
    if p_value > acceptance.P_SURE:
        of_fitted = difference(fitted.without, fitted.errors)
        if of_fitted > acceptance.P_SURE:
            return Refusal("unsure", of_fitted, acceptance.P_SURE)
    return None


def chance(now: Fitted, best: Tried, records: Records) -> float:
    """p-value of the gain of a tried effect on held-out records, on equal terms."""
    held, _ = _removed(now, best, records)
    return difference(held.without, held.errors)


def _beside_rates(now: Fitted, best: Tried) -> bool:
    """Whether an effect is an element next to plays that depend on the rate.

    Friction has more rate laws than the catalogue: the residual of one law fitted with another changes loops, as an
    element does. Next to a rate dependence, an element has merit only if it removes most of the error.
    """
    return best.option.name == effects.PARALLEL and any(
        type(effect).moves_plays() for effect in now.structure.effects(now.shape)
    )


@dataclass(frozen=True)
class _Removed:
    """Errors of some records without an effect and with it, on equal terms."""

    without: list[Array]
    errors: list[Array]

    @property
    def left(self) -> float:
        return rms(self.errors)

    @property
    def removed(self) -> float:
        return apart(rms(self.without), self.left)


def _removed(now: Fitted, best: Tried, records: Records) -> tuple[_Removed, _Removed]:
    """Errors with and without an effect, for held-out and for fitted records.

    Equal terms are the free start states of the effect on both sides, or on neither side if the effect does as well
    from rest. With a single hold per record, free start states follow any creep without it.
    """
    groups = records.held, records.to_fit
    terms, free = records.terms(now, best.fitted), (best.errors, best.fitted.errors(records.to_fit))
    if len(terms) > 1:
        from_rest = [best.fitted.errors(items, now) for items in groups]
        if all(no_worse(rms(a), rms(b), records.noise) for a, b in zip(from_rest, free, strict=True)):
            held, to_fit = (_Removed(now.errors(items), e) for items, e in zip(groups, from_rest, strict=True))
            return held, to_fit
    held, to_fit = (_Removed(_without_merit(terms, best, items), e) for items, e in zip(groups, free, strict=True))
    return held, to_fit


def _explains_rest(held: _Removed, fitted: _Removed, records: Records) -> bool:
    """Whether an effect explains most of what moves while the drive stands still, and not by chance.

    Rate-independent hysteresis of any kind keeps its output while the drive keeps its value, so that within a hold the
    error of a model with the wrong hysteresis is constant. That error still enters the effect: however right the
    effect, a fraction of what moves remains, which may be far above the noise of a clean record.
    """
    moving = []
    for group, removed in enumerate((held, fitted)):
        without, errors = (records.at_rest(each, group) for each in (removed.without, removed.errors))
        part, noise = _Removed(without, errors), records.noise
        if not errors or part.removed < acceptance.FIRST_REMOVES * noise:
            return False
        if not (is_noise(part.left, noise) or takes_most(part.left, rms(without), noise)):
            return False
        moving.append(part)
    return _by_chance(*moving) is None


def _enough(held: _Removed, fitted: _Removed, needed: float, noise: float) -> bool:
    """Whether an effect removes enough from held-out or from fitted records, and shows in both.

    However much of the fitted error it explains, an effect may be small in records like the held-out ones.
    """
    shares = [each.removed / max(noise, each.left) for each in (held, fitted)]
    return max(shares) >= needed and min(shares) >= acceptance.SEEN_IN_BOTH


def removes(now: Fitted, best: Tried, records: Records, least: float | None = None) -> bool:
    """Whether an effect removes enough on equal terms, chance aside; `least`: as in `merit_of`."""
    return _enough(*_removed(now, best, records), _least(now) if least is None else least, records.noise)


def _least(now: Fitted) -> float:
    return acceptance.FIRST_REMOVES if now.bare else acceptance.FURTHER_REMOVES


def leaves_enough(now: Fitted, records: Records) -> bool:
    """Whether an effect that removed all of the held-out or of the fitted error except noise could be named, or all
    that moves while the drive stands still."""
    most = max(records.residual(now), rms(now.errors(records.to_fit)))
    if most > acceptance.above_noise(_least(now)) * records.noise:
        return True
    at_rest = [records.at_rest(now.errors(items), k) for k, items in enumerate((records.held, records.to_fit))]
    least = acceptance.above_noise(acceptance.FIRST_REMOVES) * records.noise
    return all(len(each) > 0 and rms(each) > least for each in at_rest)


def _without_merit(terms: Sequence[Fitted], best: Tried, items: Sequence[Item]) -> list[Array]:
    """Errors of a hypothesis given the free start states and offset of an effect, which do not count as its merit.

    The hypothesis's own free start states are used instead if the error is then smaller. `terms`: from `Records.terms`.
    """
    now = terms[0]
    return min(now.errors(items), *(each.errors(items, best.fitted) for each in terms), key=rms)


def _only_grows(fitted: Fitted) -> Refusal | None:
    """The refusal of a last effect that does not level off within the records."""
    if not fitted.structure.parts or (levels_off := fitted.structure.parts[-1].candidate.levels_off) is None:
        return None
    place, most = levels_off
    slow = float(fitted.structure.pieces(fitted.shape)[1][-1][place])
    return Refusal("grows", 10.0**slow, 10.0**most) if slow > most else None


def simplest_first(tried: Sequence[Tried], records: Records) -> list[Tried]:
    """All candidates tried: first the best and those about as good, ordered by number of parameters.

    A candidate is about as good in two cases. First, its held-out error with the same free start states is no larger,
    however much better the best one fits (two shapes of one effect each have their own free states, which are part of
    the effect). Second, its held-out error is within a few per cent, and its fitted error is equal, larger by chance
    or, if a parameter of the best is at an end of its range, larger by less than an effect is worth. If an amount of
    the best is the largest tried, all candidates that are `alike` are about as good, since so much creep can also
    follow a lag. With equal numbers of parameters, the error over all records decides; if these errors are nearly
    equal, the held-out error decides, and then `place`, which puts a lag, which every amplifier has, before a delay. A
    small lead on held-out records, whose error may belong mostly to a third effect, does not make a candidate the best
    if its fitted error is far larger than another's.
    """
    if not tried:
        return []
    best, held, to_fit = tried[0], records.held, records.to_fit
    about_as_good = [each for each in tried if each.held_out <= (1.0 + acceptance.ALIKE) * best.held_out]
    closest = min(about_as_good, key=lambda each: each.fitted.rms)
    of_best = rms(best.fitted.errors(to_fit, closest.fitted))
    if rms(closest.fitted.errors(to_fit)) <= acceptance.FAR_LESS * of_best:
        best = closest
    within = acceptance.ALIKE if _at_most(best.fitted) else acceptance.BETTER
    enough, fitted = (1.0 + within) * best.held_out, best.fitted.errors(to_fit)
    less = rms(fitted)

    def as_good(errors: list[Array], more: float) -> bool:
        return (
            more <= (1.0 + acceptance.EQUAL) * less
            or difference(errors, fitted) > acceptance.P_SURE
            or (_at_an_end(best.fitted) and no_worse(more, less, records.noise))
        )

    near, others = [(best.numbers(held), _everywhere(best, best, records), best.held_out, best)], []
    for each in tried:
        if each is best:
            continue
        like = None if each.name == best.name else best.fitted
        residual = rms(each.fitted.errors(held, like))
        if residual > enough:
            others.append(each)
            continue
        errors = each.fitted.errors(to_fit, like)
        more = rms(errors)
        if less > acceptance.FAR_LESS * more and (residual <= best.held_out or as_good(errors, more)):
            near.append((each.numbers(held), _everywhere(each, best, records), residual, each))
        else:
            others.append(each)
    equal = 1.0 + acceptance.EQUAL
    least = {n: min(everywhere for number, everywhere, *_ in near if number == n) for n, *_ in near}
    held_out = {
        n: min(residual for number, everywhere, residual, _ in near if number == n and everywhere <= equal * least[n])
        for n in least
    }

    def order(one: tuple[int, float, float, Tried]) -> tuple[int, float, float, tuple[int, float]]:
        n, everywhere, residual, each = one
        return n, max(everywhere, equal * least[n]), max(residual, equal * held_out[n]), place(each.name)

    return [*(each for *_, each in sorted(near, key=order)), *others]


def place(name: str) -> tuple[int, float]:
    """Order among equally good effects, the first of which is named: effects with a rank, then a bent front, since an
    asymmetric actuator comes before a nonlinear sensor, then the rest of the catalogue, then the user's own."""
    if name not in effects.CATALOGUE:
        return (1 if name == effects.BEND else 3), 0
    rank = effects.shapes(name)[0].rank
    return (0, rank) if rank < math.inf else (2, effects.CATALOGUE.index(name))


def _at_an_end(fitted: Fitted) -> bool:
    """Whether any parameter is at an end of its range."""
    low, high = fitted.structure.bounds
    return bool(np.any((fitted.shape <= low) | (fitted.shape >= high)))


def _at_most(fitted: Fitted) -> bool:
    """Whether an amount of the last effect is the largest one tried."""
    if not fitted.structure.parts:
        return False
    last, numbers = fitted.structure.parts[-1].candidate, fitted.structure.pieces(fitted.shape)[1][-1]
    return any(numbers[k] >= last.high[k] for k in last.amounts)


def _everywhere(each: Tried, best: Tried, records: Records) -> float:
    """rms error over all records, with the free start states of the best candidate."""
    return rms(each.fitted.errors([*records.to_fit, *records.held], best.fitted))


def alike(other: Tried, best: Tried, noise: float) -> bool:
    """Whether the records cannot decide which of two effects is present.

    They can decide if the advantage of one over the other is large enough to deserve a name and not due to chance.
    """
    if no_worse(other.held_out, best.held_out, noise):
        return True
    near = other.held_out <= (1.0 + acceptance.ALIKE) * best.held_out
    return near and difference(other.errors, best.errors) > acceptance.P_DIFFERENT


def rivals(best: Tried, tried: Sequence[Tried], records: Records) -> list[Tried]:
    """Effects with other names that held-out records cannot separate from the accepted one, the best one first."""
    return [each for each in tried if each.name != best.name and alike(each, best, records.noise)]


def _other_shapes(best: Tried, tried: Sequence[Tried], records: Records) -> list[Tried]:
    """Other shapes of the accepted effect that are as good on held-out records, the best one first."""
    return [
        each
        for each in tried
        if each.name == best.name and each is not best and alike(each, best, records.noise)
    ]


def left_open(now: Fitted, best: Tried, tried: Sequence[Tried], records: Records) -> list[str]:
    """Names of the effects that fitted records cannot separate from the accepted one either."""
    least = best.fitted.rms
    others = [each for each in rivals(best, tried, records) if no_worse(each.fitted.rms, least, records.noise)]
    if records.one_loop:
        others += [each for each in tried if each.name != best.name and _explains_most(now, each, records)]
        if not is_noise(best.held_out, records.noise):  # not confirmed by held-out records
            others += [
                each
                for each in tried
                if each.name != best.name and takes_most(each.fitted.rms, now.rms, records.noise)
            ]
    return list(dict.fromkeys(each.name for each in others))


def _explains_most(now: Fitted, tried: Tried, records: Records) -> bool:
    """Whether an effect removes most of the held-out error above the noise."""
    return takes_most(tried.held_out, records.residual(now), records.noise)


def takes_most(residual: float, gap: float, noise: float) -> bool:
    """Whether a residual is a small enough part of a gap, both without the noise."""
    return apart(residual, noise) <= acceptance.MOST_OF_GAP * apart(gap, noise)


def bear_two(records: Records) -> bool:
    """Whether records can support a second name, or one in addition to an effect that the model already has."""
    return not (records.one_loop and records.one_speed)


@dataclass(frozen=True)
class Explained:
    """rms errors of some records without the effects and with them, on equal terms; noise counts as explained."""

    before: float
    after: float
    noise: float

    @property
    def left(self) -> float:
        """Remaining fraction of the gap above the noise; infinite if there was no gap."""
        left, gap = apart(self.after, self.noise), apart(self.before, self.noise)
        return left / gap if gap > 0.0 else 0.0 if left == 0.0 else math.inf


def explained(now: Fitted, none: Fitted, records: Records) -> tuple[Explained, Explained]:
    """The parts of the held-out and of the fitted error that effects explain; `none`: the model without the effects,
    compared with the same free start states and offsets."""
    held, to_fit = (
        Explained(rms(none.errors(group, now)), rms(now.errors(group)), records.noise)
        for group in (records.held, records.to_fit)
    )
    return held, to_fit


def borne_out(now: Fitted, none: Fitted, records: Records) -> Refusal | None:
    """Why the effects found are withdrawn, or None: together they must explain most of the gap.

    The criterion applies to held-out and to fitted records. Many effects can remove part of a disturbance; the
    remaining error distinguishes a disturbance from a real effect. Records of one loop support no name if more than
    noise remains, and too few compared samples support none at all. If much remains, no parameter of an effect may be
    at an end of its range unless nine tenths are explained: an effect that strong, slow or fast can follow part of any
    error, but not nine tenths of it.
    """
    if records.compared < acceptance.FEW_COMPARED:
        return Refusal("few", records.compared, acceptance.FEW_COMPARED)
    held, to_fit = explained(now, none, records)
    if records.one_loop and held.after > acceptance.FAR_ABOVE_NOISE * records.noise:
        return Refusal("above", held.after, acceptance.FAR_ABOVE_NOISE * records.noise)
    at_an_end = any(fits.part_at_an_end(now, k) for k, part in enumerate(now.structure.parts) if not part.known)
    for each in (held, to_fit):
        far = each.after > acceptance.MUCH_LEFT * records.noise
        if far and at_an_end and each.left > acceptance.END_LEAVES:
            return Refusal("range", each.left, acceptance.END_LEAVES)
        most = acceptance.MOSTLY_EXPLAINED if far else acceptance.LEAST_EXPLAINED
        if not is_noise(each.after, records.noise) and each.left**2 > most:
            return Refusal("most", each.after, each.before)
    return None


def _supported(now: Fitted, best: Tried, records: Records) -> bool:
    """Whether the records support a name even if they contain only one loop."""
    return not records.one_loop or ((now.bare or bear_two(records)) and _explains_most(now, best, records))


def no_worse(residual: float, least: float, noise: float) -> bool:
    """Whether an error exceeds the smallest by so little that the difference would not count as an effect."""
    return apart(residual, least) < acceptance.FIRST_REMOVES * max(noise, least)


def difference(before: Sequence[Array], after: Sequence[Array]) -> float:
    """One-sided p-value for a fall in squared errors, over blocks longer than their correlation time.

    Wilcoxon's signed-rank test is used because an effect may show in only a few events, which dominate a mean.
    """
    from scipy.stats import wilcoxon

    gains = []
    for a, b in zip(before, after, strict=True):
        known = np.isfinite(a) & np.isfinite(b)
        gain = a[known] ** 2 - b[known] ** 2
        if len(gain) < 4:
            continue
        memory = round(acceptance.BLOCK_MEMORIES * correlation_time(gain))
        size = int(min(max(1, memory), max(1, len(gain) // acceptance.BLOCKS)))
        edges = np.arange(0, len(gain) - size + 1, size)
        gains.append(np.add.reduceat(gain[: edges[-1] + size], edges) / size)
    blocks = np.concatenate(gains) if gains else np.empty(0)
    if len(blocks) < 6 or not np.any(blocks):
        return 1.0
    return float(wilcoxon(blocks, alternative="greater").pvalue)


# The search, round by round ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Found:
    """An accepted effect, and the held-out rms with and without it.

    `known`: whether the user named it; `refused`: then, why the search would not have named it, or None.
    """

    name: str
    label: str
    before: float
    after: float
    p_value: float
    rivals: tuple[str, ...]
    known: bool = False
    refused: Refusal | None = None


@dataclass(frozen=True)
class Ranked:
    """An effect that was tried in a round, and why it was refused; None for the accepted one."""

    tried: Tried
    refused: Refusal | None


@dataclass(frozen=True)
class Withdrawal:
    """Effects that were accepted at first but not in the end (`borne_out`), and the part that they explained."""

    names: tuple[str, ...]
    refused: Refusal
    held: Explained
    to_fit: Explained
    ends: tuple[End, ...]


@dataclass(frozen=True)
class Outcome:
    """The refitted nominal model, the model to be written, its effects, and the ranking of each round.

    `ends`: parameters at an end of their ranges; `written`: which model is written: `extended` by effects, `refitted`,
    `given`, or `identified` independently of the nominal one.
    """

    refitted: Fitted
    fitted: Fitted
    found: tuple[Found, ...]
    rankings: tuple[tuple[Ranked, ...], ...]
    withdrawn: Withdrawal | None = None
    ends: tuple[End, ...] = ()
    written: str = REFITTED

    @property
    def bends(self) -> bool:
        """Whether one of the effects is a front."""
        return any(each.name in effects.FRONTS for each in self.found)

    @property
    def not_separable(self) -> tuple[tuple[str, str], ...]:
        """Pairs of an effect found and an effect that cannot be told apart from it."""
        return tuple((each.name, rival) for each in self.found for rival in each.rivals)


def as_given(cascade: Cascade, given: Sequence[Effect]) -> Fitted:
    """The nominal model unchanged; its rms error is not known."""
    structure, weights = hypothesis.as_given(cascade, given)
    return Fitted(structure, np.empty(0), weights, math.nan)


def refit(base: Structure, to_fit: Sequence[Item], start: Array, nominal: Array | None = None) -> Fitted:
    """The nominal structure with its weights, front and effect parameters refitted.

    The fit begins at the shape `start` and linear weights; if an output map bends the output, also at the `nominal`
    weights, since samples beyond a limit hide the error in the weights.
    """
    quick = _quick(to_fit)
    starts = [_first_weights(base, quick, start)]
    if nominal is not None and base.actuator(start).bends:
        starts.append(nominal)
    found = [fits.fit(base, quick, start, p) for p in starts]
    return min(found, key=lambda each: rms(each.errors(quick)))


def no_worse_than(other: Fitted, outcome: Outcome, records: Records, written: str = GIVEN) -> Outcome:
    """The outcome, or another model if that predicts held-out records better.

    The model as given replaces a refit that predicts worse; if effects were named, it must be better by `BETTER`. The
    model that `identify` finds independently must be better by `EQUAL`.
    """
    least, left = records.residual(other), records.residual(outcome.fitted)
    named = acceptance.BETTER if outcome.found else 0.0
    if not least < (1.0 - (acceptance.EQUAL if written == IDENTIFIED else named)) * left:
        return outcome
    if not outcome.found:
        return replace(outcome, fitted=other, written=written)
    why = Refusal(written, left, least)
    return Outcome(outcome.refitted, other, (), refused(outcome.rankings, why), written=written)


def refused(rankings: Sequence[Sequence[Ranked]], why: Refusal) -> tuple[tuple[Ranked, ...], ...]:
    """The rankings, with accepted effects now refused for this reason."""
    return tuple(tuple(replace(each, refused=each.refused or why) for each in tried) for tried in rankings)


def better(one: Fitted, other: Fitted, items: Sequence[Item]) -> bool:
    """Whether one fit predicts records better than another by a margin that counts."""
    return rms(one.errors(items)) < (1.0 - acceptance.BETTER) * rms(other.errors(items))


def again(fitted: Fitted, ready: Prepared) -> Fitted:
    """A hypothesis refitted to other records."""
    return fits.fit(fitted.structure, _quick(ready.to_fit), fitted.shape, fitted.weights)


def invertible(outcome: Outcome, records: Records, floor: float) -> tuple[Outcome, Weights]:
    """The outcome with the errors of the model whose p_0 is raised to the floor of `identify`, and that model's
    weights."""
    fitted, made = fits.invertible(outcome.fitted, records.full, floor)
    if fitted is outcome.fitted:
        return outcome, made
    found = outcome.found
    if not found:
        refitted = fitted if outcome.written == REFITTED else outcome.refitted
        return replace(outcome, refitted=refitted, fitted=fitted), made
    last = replace(found[-1], after=records.residual(fitted))
    return replace(outcome, fitted=fitted, found=(*found[:-1], last)), made


def _quick(to_fit: Sequence[Item]) -> Sequence[Item]:
    return thinned([to_fit], joint.COMPARED, everything([to_fit]))[0]


def select(records: Records, refitted: Fitted, until: Callable[[Fitted], bool] = lambda _: False) -> Outcome:
    """Add effects to the refitted model as long as one qualifies and `until` has not accepted the model."""
    now = fits.begun(refitted.structure, records.quick, refitted.shape, refitted.weights).found(refitted.weights)
    none = now
    found: list[Found] = []
    rankings: list[tuple[Ranked, ...]] = []
    gap = records.residual(now)
    latest: _Step | None = None
    rounds = acceptance.MOST_EFFECTS if bear_two(records) else 1
    for _ in range(rounds):
        if not leaves_enough(now, records):
            break
        step = _step(now, gap, records)
        if latest is not None and step is not None and not _explained(step, records):
            pair = _with_rival(latest, step, gap, records)
            if pair is not None:
                other, step = pair
                found[-1] = replace(_found(other, records), before=found[-1].before)
        if step is not None and step.merit is None and not found and rounds > 1:
            both = _together(step, gap, records)
            if both is not None:
                rankings.append(_ranked(step, gap, records))
                first, step = both
                found.append(first)
        if step is not None:
            rankings.append(_ranked(step, gap, records))
        if step is None or step.merit is None:
            break
        accepted = _found(step, records)
        found.append(replace(accepted, before=found[-1].after) if found else accepted)
        now, latest = step.best.fitted, step
        names = {each.tried.option.name for tried in rankings for each in tried}
        now, found = _exchanged(*_without_needless(now, found, records), names, records)
        if len(found) > 1 and now is step.best.fitted and not is_noise(records.residual(now), records.noise):
            now, found = _both_exchanged(step, now, found, records)
        wider, _ = _widened(now, records)
        if wider is not now:
            now, found[-1] = wider, replace(found[-1], after=records.residual(wider))
        if now is not step.best.fitted:
            latest = None
        if until(now):
            return Outcome(refitted, now, tuple(found), tuple(rankings), written=EXTENDED)
    if not found:
        return Outcome(refitted, now, (), tuple(rankings))
    now, found, failed = _finished(now, found, records)
    ends = ranges.ends(now, failed, is_noise(records.residual(now), records.noise))
    why = borne_out(now, none, records)
    if why is None:
        return Outcome(refitted, now, tuple(found), tuple(rankings), ends=ends, written=EXTENDED)
    of_them = tuple(dict.fromkeys(each.name for each in found))
    withdrawn = Withdrawal(of_them, why, *explained(now, none, records), ends)
    return Outcome(refitted, none, (), refused(rankings, why), withdrawn)


def _finished(now: Fitted, found: list[Found], records: Records) -> tuple[Fitted, list[Found], WiderRange | None]:
    """The effects fitted to all samples, without those that become needless in that fit.

    Also returns the errors if wider ranges were tried and failed, or None.
    """
    now = fits.fit(now.structure, records.full, now.shape, now.weights)
    kept, rest, _ = _without_needless(now, found, records)
    if kept is not now:
        now = fits.fit(kept.structure, records.full, kept.shape, kept.weights)
    wider, failed = _widened(now, records)
    if wider is not now:
        now = fits.fit(wider.structure, records.full, wider.shape, wider.weights)
    return now, [*rest[:-1], replace(rest[-1], after=records.residual(now))], failed


def _widened(now: Fitted, records: Records) -> tuple[Fitted, WiderRange | None]:
    """The hypothesis with wider ranges for parameters at an end of theirs, as long as held-out errors fall.

    Also returns the errors if the widest range tried failed, or None. If only noise remains, none is tried.
    """
    for _ in range(acceptance.WIDENINGS):
        if is_noise(records.residual(now), records.noise):
            break
        further = ranges.wider(now, records)
        if further is None:
            break
        if not better(further, now, records.held):
            return now, WiderRange(records.residual(further), records.residual(now))
        now = further
    return now, None


def _ranked(step: _Step, gap: float, records: Records) -> tuple[Ranked, ...]:
    """All options tried in a step, the best first, with the objection to each."""

    def refused(tried: Tried) -> Refusal | None:
        if step.merit is not None and tried is step.best:
            return None
        found = judged(step.now, tried, records)
        if isinstance(found, Refusal):
            return found
        if not found.worth(gap, records):
            return Refusal("small", found.removed / gap, acceptance.NAME_SHARE)
        return Refusal("other")

    return tuple(Ranked(each, refused(each)) for each in step.tried)


@dataclass(frozen=True)
class _Step:
    """A hypothesis, the extensions tried, the best of them, and its merit if it is accepted."""

    now: Fitted
    tried: list[Tried]
    best: Tried
    merit: Merit | None


def _step(
    now: Fitted, gap: float, records: Records, worth: Callable[[Option], bool] | None = None,
    start: Fitted | None = None, least: float | None = None,
) -> _Step | None:
    """The best extension of a hypothesis and the extensions that were tried; None if there is no extension to try.

    `start`: the same hypothesis with other parameters, from which extensions are searched for; `least`: as in
    `merit_of`. If the best extension owes its small error only to free start states and has no merit on equal terms,
    the next one is judged. If a skipped one explains far more, but at too few samples to be certain, none is named.
    """
    tried = records.extensions(start or now, worth)
    if not tried:
        return None
    unsure = math.inf
    for best in simplest_first(tried, records):
        merit = merit_of(now, best, records, least)
        if merit is not None and merit.worth(gap, records):
            if best.held_out > (1.0 + acceptance.ALIKE) * unsure:
                break
            return _Step(now, tried, best, merit)
        if merit is None and removes(now, best, records, least):
            unsure = min(unsure, best.held_out)
    return _Step(now, tried, tried[0], None)


def _explained(step: _Step, records: Records) -> bool:
    """Whether only noise remains; no other first effect can then do better, and `_exchanged` finds equal ones."""
    return step.merit is not None and is_noise(step.best.held_out, records.noise)


def _with_rival(latest: _Step, step: _Step, gap: float, records: Records) -> tuple[_Step, _Step] | None:
    """The latest step with a rival instead of its best effect, and the step that follows from it; None to keep the
    best.

    The next step shows which of several similar effects is present: the accepted one is wrong if no further effect
    qualifies after it but one does after a rival, if more error then remains, or if the same error takes more
    parameters. If the next effect is itself a rival, `_exchanged` examines which other effects fit in addition.

    If no further effect qualifies, the accepted effect may be the right one with a wrong shape: a simpler shape, about
    as good, absorbs part of the next effect, which then makes held-out errors worse. `_exchanged` finds the right shape
    only once the next effect is included.
    """
    alike = rivals(latest.best, latest.tried, records)
    if step.merit is None:  # next to the same error, the same effects fail
        alike = [each for each in alike if not _same(each.fitted, latest.best.fitted, records)]
    if step.merit is None and any(_hidden(step.now, each, records) for each in step.tried):
        alike += _other_shapes(latest.best, latest.tried, records)
    others = {each.name: each for each in reversed(alike)}  # the best one of each name
    follow = sorted(others.values(), key=lambda each: each.held_out)[: acceptance.MOST_RIVALS]
    if step.merit is not None:
        follow = [each for each in follow if each.name != step.best.name]
    names = {each.name for each in step.tried}

    def pairs() -> Iterator[tuple[_Step, _Step]]:
        for first in simplest_first(follow, records):
            merit = merit_of(latest.now, first, records)
            then = _step(first.fitted, gap, records, lambda option: option.name in names) if merit is not None else None
            if then is not None and then.merit is not None:
                yield replace(latest, best=first, merit=merit), then

    if step.merit is None:
        enough = (1.0 - acceptance.BETTER) * records.residual(step.now)
        found = next((pair for pair in pairs() if pair[1].best.held_out <= enough), None)
        return found or _beside_another(latest, step, gap, records)
    every = [*pairs(), (latest, step)]
    enough = (1.0 + acceptance.BETTER) * min(then.best.held_out for _, then in every)
    good = [pair for pair in every if pair[1].best.held_out <= enough]
    chosen = min(good, key=lambda pair: (pair[1].best.numbers(records.held), pair[1].best.held_out))
    return None if chosen[1] is step else chosen


def _same(one: Fitted, other: Fitted, records: Records) -> bool:
    """Whether the errors of two hypotheses differ by so little that no further effect could tell one from the other."""
    for items in (records.held, records.to_fit):
        apart = [a - b for a, b in zip(one.errors(items), other.errors(items), strict=True)]
        if rms(apart) > acceptance.NEEDLESS * records.noise:
            return False
    return True


def _beside_another(latest: _Step, failed: _Step, gap: float, records: Records) -> tuple[_Step, _Step] | None:
    """A step to another effect that the accepted one hides, and the step from there to the accepted one, or None.

    An effect with many parameters also follows other effects, as a fast state of creep follows relaxing plays. Little
    remains for the other effect to explain, although the first follows it only roughly. The two are tried in the
    opposite order if so much error remains with the accepted one that a verdict would begin with it.
    """
    left = records.residual(failed.now)
    if left <= acceptance.MUCH_LEFT * records.noise:
        return None
    name = latest.best.option.name
    others = {each.name: each for each in reversed(latest.tried) if each.name != latest.best.name}
    found = []
    for first in sorted(others.values(), key=lambda each: each.held_out)[: acceptance.MOST_RIVALS]:
        merit = merit_of(latest.now, first, records)
        then = None if merit is None else _step(first.fitted, gap, records, lambda option: option.name == name)
        if then is None or then.merit is None or merit_of(failed.now, then.best, records) is None:
            continue
        if then.best.held_out <= (1.0 - acceptance.BETTER) * left:
            found.append((replace(latest, best=first, merit=merit), then))
    return min(found, key=lambda pair: pair[1].best.held_out, default=None)


def _hidden(now: Fitted, tried: Tried, records: Records) -> bool:
    """Whether an effect removes enough from fitted records, whatever it removes from held-out ones."""
    _, fitted = _removed(now, tried, records)
    return fitted.removed >= _least(now) * max(records.noise, fitted.left)


def _together(failed: _Step, gap: float, records: Records) -> tuple[Found, _Step] | None:
    """Two effects that hide each other: neither qualifies alone, but each does next to the other.

    Returns the first, and the step from it to both. The search begins with the effect that explains most on held-out
    records, and with each effect that is certain on fitted records. Without the second effect, the first may even raise
    the error; it is then credited with none of the gap.
    """
    one_of_each = {each.name: each for each in reversed(failed.tried)}  # the best one of each name
    fitted = failed.now.errors(records.to_fit)
    seconds = []
    for first in one_of_each.values():
        if (
            first is not failed.tried[0]
            and difference(fitted, first.fitted.errors(records.to_fit)) > acceptance.P_SURE
        ):
            continue
        second = _step(first.fitted, gap, records, least=acceptance.FIRST_REMOVES)
        if second is not None and second.merit is not None and second.best.name != first.name:
            seconds.append((first, second))
    for first, second in sorted(seconds, key=lambda pair: pair[1].best.held_out):
        alone = without_effect(second.best.fitted, first.name, records)
        back = None if alone is None else _step(alone, gap, records, least=acceptance.FIRST_REMOVES)
        if alone is None or back is None or back.merit is None or back.best.name == second.best.name:
            continue
        merit = merit_of(failed.now, back.best, records)
        if merit is not None and merit.worth(gap, records):
            return replace(_found(second, records), before=gap, after=min(records.residual(alone), gap)), back
    return None


def _found(step: _Step, records: Records) -> Found:
    best, merit = step.best, step.merit
    assert merit is not None
    rivals = tuple(dict.fromkeys([*best.names[1:], *left_open(step.now, best, step.tried, records)]))
    return Found(best.name, best.option.label, records.residual(step.now), best.held_out, merit.p_value, rivals)


def _first_weights(base: Structure, to_fit: Sequence[Item], start: Array) -> Array:
    """Weights from linear fits without, then with effects, as a sensor's curve misleads a fit far from its range."""
    alone, front = replace(base, parts=()), base.pieces(start)[0]
    near = fits.begun(alone, to_fit, front, np.ones(len(base.thresholds))).now.best
    return fits.begun(base, to_fit, start, near).now.best


def _without_needless(
    now: Fitted, found: list[Found], records: Records
) -> tuple[Fitted, list[Found], dict[str, Fitted]]:
    """Drop earlier effects that later ones have made needless.

    Returns the model, the remaining effects, and for each earlier effect the model without it.
    """
    less: dict[str, Fitted] = {}
    for k in range(len(found) - 1):
        fitted = without_effect(now, found[k].name, records)
        if fitted is None:
            continue
        with_it, without = records.residual(now), records.residual(fitted)
        if apart(without, with_it) < acceptance.NEEDLESS * records.noise:
            return _without_needless(fitted, _rest(found, k, without), records)
        less[found[k].name] = fitted
    return now, found, less


def _exchanged(
    now: Fitted, found: list[Found], less: dict[str, Fitted], names: Collection[str], records: Records
) -> tuple[Fitted, list[Found]]:
    """Replace earlier effects with other effects or shapes that do better together with the later ones.

    The first of two effects was chosen while the second was missing, and may have absorbed part of it; the second was
    then chosen next to a wrong first one. Rivals, too, are judged with all other effects present. `less`: the models
    without one effect, where known; `names`: effects to be searched for again, each the best of some round.
    """
    latest = found[-1].name
    for _ in range(acceptance.MOST_EXCHANGES):
        for k, old in enumerate(found):
            fitted = None if old.name == latest else less.get(old.name) or without_effect(now, old.name, records)
            if fitted is None:
                continue
            start = without_refit(now, old.name, records)  # a refit could move the others' parameters far
            among = {*names, *_look_alikes(old.name)}
            step = _step(
                fitted, 0.0, records, lambda option, among=among: option.name in among, start,  # type: ignore[misc]
                acceptance.FIRST_REMOVES,
            )
            if step is None or step.merit is None:
                continue
            better = _that_replaces(now, old.name, step, records)
            if better is None:
                # otherwise the search did not find the effect again
                if step.best.held_out <= (1.0 + acceptance.ALIKE) * records.residual(now):
                    other = _found(step, records)
                    alike = dict.fromkeys([other.name, *other.rivals])
                    found[k] = replace(old, rivals=tuple(name for name in alike if name != old.name))
                continue
            step, other = better, _found(better, records)
            best = step.best.fitted
            chain = in_place(best, [*found[:k], other, *found[k + 1 :]], found[0].before, records)
            now, found, less = _without_needless(best, chain or [*_rest(found, k, other.before), other], records)
            latest = other.name
            break
        else:
            break
    return now, found


def _look_alikes(name: str) -> list[str]:
    """Effects that make the output lag, if this is one of them; each is tried in place of the others.

    The right one may show only once the other effects are known: next to an element of the wrong shape, or without an
    element, a lag may never be among the best of a round.
    """
    lagging = [each for each in effects.CATALOGUE if effects.shapes(each)[0].rank < math.inf]
    return lagging if name in lagging else []


def _that_replaces(now: Fitted, name: str, step: _Step, records: Records) -> _Step | None:
    """The step with the effect that replaces the named one, or None: its best, or an equal one with fewer parameters.

    The best of a step is chosen by differences of a few per cent, which records with errors near the noise do not
    support. A shape of the effect itself is preferred to another effect with as many parameters and no smaller error.
    """
    every = [*records.to_fit, *records.held]
    fitted, found = now, None
    for each in (step.best, *(other for other in simplest_first(step.tried, records) if other is not step.best)):
        numbers = each.numbers(records.held)
        if each is not step.best:
            own = (one for one in step.tried if one.name == name and one.numbers(records.held) <= numbers)
            least = min((rms(one.fitted.errors(every)) for one in own), default=math.inf)
            if numbers >= free_numbers(fitted, records.held) or rms(each.fitted.errors(every)) > least:
                continue
        if not _gives_way(fitted, name, each, records):
            continue
        merit = step.merit if each is step.best else merit_of(step.now, each, records, acceptance.FIRST_REMOVES)
        if merit is not None:
            fitted, name, found = each.fitted, each.name, replace(step, best=each, merit=merit)
    return found


def _gives_way(now: Fitted, name: str, best: Tried, records: Records) -> bool:
    """Whether an effect gives way to a better one: one with a smaller error, one with fewer parameters and no larger
    error on equal terms, or an equal one with an earlier `place`.

    If the other has no more parameters and held-out errors hardly differ, the error over all records decides; between
    two effects with equally many parameters, the order of `simplest_first` decides. Of two effects that the records do
    not separate, the one with fewer parameters stands, since more parameters can follow another effect; of two shapes
    of one effect, whose name is not in question, the one with the smaller error stands.
    """
    if _worse_at_rest(now, best, records):
        return False
    held, residual = records.held, records.residual(now)
    fewer = free_numbers(now, held) - best.numbers(held)
    if fewer != 0 and name != best.name:
        errors = [(rms(now.errors(group)), rms(best.fitted.errors(group))) for group in (held, records.to_fit)]
        if all(no_worse(b, a, records.noise) if fewer > 0 else no_worse(a, b, records.noise) for a, b in errors):
            return fewer > 0
    if best.held_out <= (1.0 - acceptance.BETTER) * residual:
        return True
    every, near = [*records.to_fit, *held], best.held_out <= (1.0 + acceptance.BETTER) * residual
    if near and fewer == 0 and name != best.name:
        both = (rms(best.fitted.errors(every)), rms(now.errors(every))), (best.held_out, residual)
        smaller = [after < before for after, before in both if abs(after - before) > acceptance.EQUAL * before]
        return smaller[0] if smaller else place(best.name) < place(name)
    if near and fewer >= 0 and better(best.fitted, now, every):
        return True
    return fewer > 0 and rms(best.fitted.errors(held, now)) <= residual


def _worse_at_rest(now: Fitted, other: Tried, records: Records) -> bool:
    """Whether another hypothesis leaves more of what moves while the drive stands still."""
    for k, items in enumerate((records.held, records.to_fit)):
        ours, theirs = (records.at_rest(each.errors(items), k) for each in (now, other.fitted))
        if ours and not no_worse(rms(theirs), rms(ours), records.noise):
            return True
    return False


def _both_exchanged(step: _Step, now: Fitted, found: list[Found], records: Records) -> tuple[Fitted, list[Found]]:
    """The effects with the latest replaced by a rival and the shape of an earlier one by another, if that is better.

    The earlier shape was chosen while the latest effect was missing, and the latest effect next to that shape. Each
    keeps the other in place, so exchanging only one of them does not find the right pair.
    """
    others = {each.name: each for each in reversed(rivals(step.best, step.tried, records))}
    follow = sorted(others.values(), key=lambda each: each.held_out)[: acceptance.MOST_RIVALS]
    every = [*records.to_fit, *records.held]
    for first in follow:
        merit = merit_of(step.now, first, records)
        for k, old in enumerate(found[:-1]):
            if merit is None or old.name == first.name:
                continue
            fitted = without_effect(first.fitted, old.name, records)
            if fitted is None:
                continue
            then = _step(fitted, 0.0, records, lambda option, name=old.name: option.name == name)  # type: ignore[misc]
            if then is None or then.merit is None or then.best.name != old.name:
                continue
            best = then.best.fitted
            if not (better(best, now, every) and then.best.held_out <= records.residual(now)):
                continue
            names = tuple(dict.fromkeys(each for each in (found[-1].name, *found[-1].rivals) if each != first.name))
            latest = Found(first.name, first.option.label, 0.0, 0.0, merit.p_value, names)
            earlier = replace(old, label=then.best.option.label)
            chain = in_place(best, [*found[:k], earlier, *found[k + 1 : -1], latest], found[0].before, records)
            if chain:
                return best, chain
    return now, found


def in_place(now: Fitted, found: Sequence[Found], gap: float, records: Records) -> list[Found]:
    """The effects with the errors before and after each; empty if one of them does not lower the error."""
    residuals = [records.residual(now)]
    for each in reversed(found[1:]):
        smaller = without_effect(now, each.name, records)
        if smaller is None:
            return []
        now = smaller
        residuals.append(records.residual(now))
    residuals = [gap, *reversed(residuals)]
    if any(after >= before for before, after in itertools.pairwise(residuals)):
        return []
    return [
        replace(each, before=before, after=after)
        for each, (before, after) in zip(found, itertools.pairwise(residuals), strict=True)
    ]


def _rest(found: Sequence[Found], k: int, without: float) -> list[Found]:
    """The effects without the k-th; the errors before and after each are still those of models in the sequence."""
    later = [replace(found[k + 1], before=found[k].before), *found[k + 2 :]] if k + 1 < len(found) else []
    rest = [*found[:k], *later]
    rest[-1] = replace(rest[-1], after=without)
    return rest


def without_effect(now: Fitted, name: str, records: Records) -> Fitted | None:
    """The hypothesis without one effect, refitted."""
    smaller = _less(now, name)
    if smaller is None:
        return None
    return records.restarted(fits.fit(smaller[0], records.quick, smaller[1], now.weights))


def without_refit(now: Fitted, name: str, records: Records) -> Fitted | None:
    """The hypothesis without one effect, with the others' parameters unchanged."""
    smaller = _less(now, name)
    if smaller is None:
        return None
    return fits.begun(smaller[0], records.quick, smaller[1], now.weights).found(now.weights)


def _less(now: Fitted, name: str) -> tuple[Structure, Array] | None:
    """The structure without one effect, and the start of its search."""
    front_shape, numbers = now.structure.pieces(now.shape)
    parts = [(part, x) for part, x in zip(now.structure.parts, numbers, strict=True) if part.name != name]
    if len(parts) < len(now.structure.parts):
        kept = tuple(part for part, _ in parts)
        return replace(now.structure, parts=kept), np.concatenate([front_shape, *(x for _, x in parts)])
    if name in effects.FRONTS and len(front_shape):
        return replace(now.structure, front=Kept()), np.concatenate([np.empty(0), *numbers])
    return None
