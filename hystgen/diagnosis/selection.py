"""Grey-box forward selection: which effects remove the gap on records that took no part in the fit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen import effects, parallel
from hystgen.diagnosis import periodic
from hystgen.diagnosis import structure as fits
from hystgen.diagnosis.options import Option, about, front_names, options
from hystgen.diagnosis.structure import Fitted, Item, Search, Structure
from hystgen.diagnosis.thinning import Mask, needed, thinned
from hystgen.effects import recursions
from hystgen.effects.base import About, Effect
from hystgen.identification import joint
from hystgen.identification.fronts import Kept
from hystgen.identification.uncertainty import correlation_time

Array = NDArray[np.float64]

SCREENED, SEARCHED = 6_000, 12_000
"""Most samples compared, to fit and held out, while the many shapes are told apart; and to fit in other searches."""

FIRST_STEPS, SCREENING_STEPS = 2, 2
"""Steps of a search from each start, and then from the best one, while the shapes are told apart."""

AWAY = 5.0
"""A start with so many times the error of the best one is too far away to search from.

The best end has been reached from starts with up to 3.5 times the error of another on tuning cases: a limit of the
output does nothing where it lies beyond all that was measured.
"""

IDLE = 0.01
"""Where the error is that without the effect within this share, the effect does nothing yet, and others go first.

Behind a large effect that is found, every start of the next may be worse than none before its first steps.
"""

COARSE = 1e-3
"""Until it is known which shapes are hopeful, a search ends when a step lowers the error by less than this share."""

FALLING, LONGER = 0.8, 4
"""The error of a search that goes on falls below this share within SCREENING_STEPS; and at most so many times those.

The minimum of a light damping is so narrow that the first steps do not reach it.
"""

KEPT, ALSO = 5, 2
"""Shapes that are followed up after the screening: the best on held-out records, and others that fit best."""

PROMISING = 2.0
"""A shape that leaves so many times what the best one leaves, fitted and held out, is not searched jointly."""

JOINT_STEPS, HOPEFUL = 5, 1.3
"""Steps of a joint search after which those further behind the best on held-out records go on no more."""

SHAPES = 2
"""Of one effect no more than so many."""

RINGING = 3
"""Frequencies at which the error rings, from which a search for a resonance starts too."""

ROUNDS, RIVALS = 5, 3
"""Effects that are added at most, and how many others of about the same use are tried in place of the latest."""

SHARE = 0.07
"""What an effect removes has an rms of at least this share of the refitted gap, of the records that judge or of those
that were fitted, or it gets no name: the one may be ruled by edges that the other hardly has.

What a right name in a wrong shape leaves to a second one, and no better shape takes, is up to 5 % on tuning cases.
"""

HELPS = 0.05
"""A shape has to lower the error by this share while they are told apart, or those that contain it are not tried.

And these have to lower the error that it leaves by as much again.
"""

NEARLY_ALL = 0.25
"""Or it leaves at most so much of the error before it: beside a far larger effect that share may be out of reach."""

ABOVE_NOISE = 0.6
"""The part that it removes has an rms of at least so many times what is left, or the noise if that is more."""

SURE, REPEATED = 1e-3, 0.05
"""Largest p-value of the difference in held-out error; or of that where the fitted records show it with the first."""

SEEN = 0.25
"""And so many times what is left, or the noise, from fitted records: what it does to others alone may be another's."""

UNSURE, DIFFERENT = 0.25, 0.01
"""Effects cannot be told apart within this share of the held-out rms, unless chance explains the difference with a
lower probability than that."""

SIMPLER = 0.05
"""A shape with fewer numbers is taken for one whose held-out rms is better by less than this share."""

FAR_LESS = 0.5
"""An error over fitted records is far less than another from this share of it on."""

EQUAL = 0.005
"""Errors that differ by less than this share are equal."""

EXCHANGE = 0.05
"""Least share by which another effect has to lower the held-out rms to take the place of one accepted earlier."""

EXCHANGES = 4
"""At most so many times one effect takes the place of another."""

LARGE = 20_000
"""Samples to fit from which on the options are tried in several processes; of fewer it takes a few seconds at most."""

AT_FLOOR = math.sqrt(1.0 + ABOVE_NOISE**2)
"""A held-out error within this factor of the noise leaves nothing that would be enough for a name."""


@dataclass(frozen=True)
class Found:
    """An effect that was accepted, and the held-out rms before and after it."""

    name: str
    label: str
    before: float
    after: float
    p_value: float
    rivals: tuple[str, ...]


@dataclass(frozen=True)
class Tried:
    """An option followed up: what it gives on held-out records."""

    option: Option
    fitted: Fitted
    names: tuple[str, ...]
    """the name, and others that the same numbers would bear as well"""
    held_out: float
    errors: list[Array]

    @property
    def name(self) -> str:
        """What it is called."""
        return self.names[0]

    def numbers(self, held: Sequence[Item]) -> int:
        """How many numbers it takes, with what it leaves free in a record.

        Free responses to a start state alone may explain a drift.
        """
        return _numbers(self.fitted, held)


def _numbers(fitted: Fitted, held: Sequence[Item]) -> int:
    return len(fitted.shape) + max(len(fitted.actuator.nuisances(item)) for item in held)


@dataclass(frozen=True, eq=False)
class _Screened:
    """An option after the first steps, and its held-out rms."""

    option: Option
    fitted: Fitted
    left: float


@dataclass(frozen=True)
class Outcome:
    """The believed model refitted, what was found, the model after it, and the ranking of each round."""

    refitted: Fitted
    fitted: Fitted
    found: tuple[Found, ...]
    rankings: tuple[tuple[Tried, ...], ...]


@dataclass(frozen=True)
class _Records:
    """What the search is over, and what it is like: the records, those to fit thinned for searches, and all of them
    thinned further to tell shapes apart."""

    to_fit: Sequence[Item]
    held: Sequence[Item]
    quick: Sequence[Item]
    thin: Sequence[Item]
    thin_held: Sequence[Item]
    known: About
    user: Sequence[type[Effect]]
    noise: float
    gap: float
    """what the refitted model leaves of the records to fit"""
    tick: Callable[[], None]
    jobs: int

    def extensions(self, now: Fitted, worth: Callable[[Option], bool] | None = None) -> list[Tried]:
        """One effect more, the best shapes of all, the best one first; `worth`: of the options that are worth it."""
        known = replace(self.known, ringing=periodic.ringing(self.to_fit, now.errors(self.to_fit), RINGING))
        rough = _rough(now, self.thin)
        roughly = replace(known, thresholds=tuple(rough.structure.thresholds.tolist()))
        both = zip(options(now, known, self.user), options(rough, roughly, self.user), strict=True)
        found = [(option, alike) for option, alike in both if worth is None or worth(option)]
        wanted = {alike.label: option for option, alike in found}
        kept = _screened(rough, self, [alike for _, alike in found])
        return _followed_up(now, [replace(each, option=wanted[each.option.label]) for each in kept], self)

    def left(self, fitted: Fitted) -> float:
        """rms error on held-out records."""
        return fits.rms(fitted.errors(self.held))


def _rough(now: Fitted, thin: Sequence[Item]) -> Fitted:
    """The hypothesis with every other threshold, the least and the largest among them: enough to tell shapes apart."""
    all_of_them = now.structure.thresholds
    places = np.unique([0, *range(len(all_of_them) - 1, -1, -2)])
    p = np.zeros(len(places))
    np.add.at(p, np.searchsorted(places, np.arange(len(all_of_them))), now.weights)  # behind a map near ones are needed
    structure = replace(now.structure, thresholds=np.ascontiguousarray(all_of_them[places]))
    return fits.begun(structure, thin, now.shape, p).found(p)


def _jobs(to_fit: Sequence[Item]) -> int:
    """Processes that are worth it; what each would compile or read from a cache is there before they begin."""
    if sum(len(item.run.t) for item in to_fit) < LARGE:
        return 1
    jobs = parallel.cores()
    if jobs > 1:
        recursions.load()
    return jobs


def refit(base: Structure, to_fit: Sequence[Item], start: Array) -> Fitted:
    """The believed structure with its weights and the shape of its front, sought from `start`, fitted anew."""
    (quick,) = thinned([to_fit], joint.COMPARED, _all_of([to_fit]))
    return fits.fit(base, quick, start, _first_weights(base, quick, start))


def _all_of(groups: Sequence[Sequence[Item]]) -> list[list[Mask]]:
    return [[np.ones(len(item.run.t), dtype=bool) for item in group] for group in groups]


def select(
    to_fit: Sequence[Item],
    held: Sequence[Item],
    refitted: Fitted,
    noise: float,
    user: Sequence[type[Effect]] = (),
    tick: Callable[[], None] = lambda: None,
) -> Outcome:
    """Add effects to the refitted model as long as one qualifies."""
    groups = to_fit, held
    masks = _all_of(groups)
    if not user and not any(part.name.startswith("user:") for part in refitted.structure.parts):
        masks = [needed(group, refitted.errors(group), noise) for group in groups]
    quick, _ = thinned(groups, SEARCHED, masks)
    now = fits.begun(refitted.structure, quick, refitted.shape, refitted.weights).found(refitted.weights)
    thin, thin_held = thinned(groups, SCREENED, masks)
    records = _Records(
        to_fit,
        held,
        quick,
        thin,
        thin_held,
        about(to_fit, refitted.structure.thresholds),
        user,
        noise,
        fits.rms(refitted.errors(to_fit)),
        tick,
        _jobs(to_fit),
    )
    found: list[Found] = []
    rankings: list[tuple[Tried, ...]] = []
    gap = records.left(now)
    latest: _Step | None = None
    for _ in range(ROUNDS):
        if records.left(now) <= AT_FLOOR * noise:
            break
        step = _step(now, gap, records)
        if latest is not None and step is not None:
            pair = _with_rival(latest, step, gap, records)
            if pair is not None:
                other, step = pair
                found[-1] = replace(_found(other, records), before=found[-1].before)
        if step is not None and step.merit is None and not found:
            both = _together(step, gap, records)
            if both is not None:
                rankings.append(tuple(step.tried))
                first, step = both
                found.append(first)
        if step is not None:
            rankings.append(tuple(step.tried))
        if step is None or step.merit is None:
            break
        accepted = _found(step, records)
        found.append(replace(accepted, before=found[-1].after) if found else accepted)
        now, latest = step.best.fitted, step
        now, found = _without_needless(now, found, records)
        now, found = _exchanged(now, found, {each.option.name for tried in rankings for each in tried}, records)
        if now is not step.best.fitted:
            latest = None
    if found:
        most, _ = thinned(groups, joint.COMPARED, masks)
        now = fits.fit(now.structure, most, now.shape, now.weights)
        found[-1] = replace(found[-1], after=records.left(now))
    return Outcome(refitted, now, tuple(found), tuple(rankings))


@dataclass(frozen=True)
class _Merit:
    """What an effect is good for: the rms of what it removes of held-out records and of fitted ones, and how sure the
    difference is."""

    removed: float
    fitted: float
    left: float
    """share of the held-out rms that it leaves"""
    p_value: float

    def worth(self, gap: float, records: _Records) -> bool:
        """Whether it is a share of the gap, or of what was left of it, that deserves a name."""
        return self.removed >= SHARE * gap or self.fitted >= SHARE * records.gap or self.left <= NEARLY_ALL


@dataclass(frozen=True)
class _Step:
    """A hypothesis, what was tried to extend it, the one of those that is taken, and what it is good for if it is."""

    now: Fitted
    tried: list[Tried]
    best: Tried
    merit: _Merit | None


def _merit(now: Fitted, best: Tried, records: _Records) -> _Merit | None:
    """None where chance explains the difference, or what is removed is too little to be told from the noise, or all but
    nothing of it is in the records that its numbers are from."""
    errors = _without_merit(now, best, records.held)
    equal = fits.rms(errors)
    removed = _apart(equal, best.held_out)
    if removed < ABOVE_NOISE * max(records.noise, best.held_out):
        return None
    p_value = difference(errors, best.errors)
    if p_value > REPEATED:
        return None
    without, fitted = _without_merit(now, best, records.to_fit), best.fitted.errors(records.to_fit)
    sure = p_value <= SURE or difference(without, fitted) <= SURE
    explained, unexplained = _apart(fits.rms(without), fits.rms(fitted)), fits.rms(fitted)
    if not sure or explained < SEEN * max(records.noise, unexplained):
        return None
    return _Merit(removed, explained, best.held_out / equal, p_value)


def _without_merit(now: Fitted, best: Tried, items: Sequence[Item]) -> list[Array]:
    """Errors of a hypothesis with what an effect leaves free in a record, which must not count as its merit.

    Or with what it leaves free itself, if that is more: less is no merit either.
    """
    return min(now.errors(items, best.fitted), now.errors(items), key=fits.rms)


def _step(
    now: Fitted,
    gap: float,
    records: _Records,
    worth: Callable[[Option], bool] | None = None,
    start: Fitted | None = None,
) -> _Step | None:
    """The best extension of a hypothesis and those it was chosen from; None where there is none to try.

    `start`: the same hypothesis with other numbers, from which extensions are sought. What explains most may owe it to
    what it leaves free in a record, and be good for nothing on equal terms; then it is the next one's turn.
    """
    tried = records.extensions(start or now, worth)
    if not tried:
        return None
    for best in _simplest_first(tried, records):
        merit = _merit(now, best, records)
        if merit is not None and merit.worth(gap, records):
            return _Step(now, tried, best, merit)
    return _Step(now, tried, tried[0], None)


def _with_rival(latest: _Step, step: _Step, gap: float, records: _Records) -> tuple[_Step, _Step] | None:
    """The latest step with another of those that cannot be told from its best, and the step that this makes possible.

    Which one of several it was shows beside the next effect: where nothing more qualifies behind the one that was
    taken, or less, or no more by more numbers, it was the wrong one.
    """
    others = {each.name: each for each in reversed(_rivals(latest, records))}  # of each name the best one
    left = sorted(others.values(), key=lambda each: each.held_out)[:RIVALS]
    names = {each.name for each in step.tried}
    pairs = []
    for first in _simplest_first(left, records):
        merit = _merit(latest.now, first, records)
        then = _step(first.fitted, gap, records, lambda option: option.name in names) if merit is not None else None
        if then is not None and then.merit is not None:
            pairs.append((replace(latest, best=first, merit=merit), then))
    if step.merit is None:
        enough = (1.0 - EXCHANGE) * records.left(step.now)
        return next((pair for pair in pairs if pair[1].best.held_out <= enough), None)
    every = [*pairs, (latest, step)]
    enough = (1.0 + SIMPLER) * min(then.best.held_out for _, then in every)
    good = [pair for pair in every if pair[1].best.held_out <= enough]
    chosen = min(good, key=lambda pair: (pair[1].best.numbers(records.held), pair[1].best.held_out))
    return None if chosen[1] is step else chosen


def _together(failed: _Step, gap: float, records: _Records) -> tuple[Found, _Step] | None:
    """Two effects of which none qualifies alone, since the other one hides it, but each beside the other.

    The one, and the step from it to both. The search begins with what explains most on held-out records, and with each
    effect that fitted ones leave no doubt of. What hides the one may leave less of the gap without it: then its share
    is nothing, and that of the other all.
    """
    one_of_each = {each.name: each for each in reversed(failed.tried)}  # of each name the best one
    fitted = failed.now.errors(records.to_fit)
    seconds = []
    for first in one_of_each.values():
        if first is not failed.tried[0] and difference(fitted, first.fitted.errors(records.to_fit)) > SURE:
            continue
        second = _step(first.fitted, gap, records)
        if second is not None and second.merit is not None and second.best.name != first.name:
            seconds.append((first, second))
    for first, second in sorted(seconds, key=lambda pair: pair[1].best.held_out):
        alone = _without(second.best.fitted, first.name, records)
        back = None if alone is None else _step(alone, gap, records)
        if alone is None or back is None or back.merit is None or back.best.name == second.best.name:
            continue
        merit = _merit(failed.now, back.best, records)
        if merit is not None and merit.worth(gap, records):
            return replace(_found(second, records), before=gap, after=min(records.left(alone), gap)), back
    return None


def _rivals(step: _Step, records: _Records) -> list[Tried]:
    """Effects of other names that cannot be told from the one that is taken, the best one first."""
    best = step.best
    return [each for each in step.tried if each.name != best.name and _alike(each, best, records.noise)]


def _found(step: _Step, records: _Records) -> Found:
    best, merit = step.best, step.merit
    assert merit is not None
    rivals = tuple(dict.fromkeys([*best.names[1:], *(each.name for each in _rivals(step, records))]))
    return Found(best.name, best.option.label, records.left(step.now), best.held_out, merit.p_value, rivals)


def _first_weights(base: Structure, to_fit: Sequence[Item], start: Array) -> Array:
    return fits.begun(base, to_fit, start, np.ones(len(base.thresholds))).now.best


def _alike(other: Tried, best: Tried, noise: float) -> bool:
    """Whether the records leave open which of two effects it is.

    What one explains more than the other has to be as much as makes an effect worth a name, and no chance.
    """
    if _no_worse(other.held_out, best.held_out, noise):
        return True
    return other.held_out <= (1.0 + UNSURE) * best.held_out and difference(other.errors, best.errors) > DIFFERENT


def _apart(more: float, less: float) -> float:
    """rms of what one error has that another has not."""
    return math.sqrt(max(more**2 - less**2, 0.0))


def _no_worse(left: float, least: float, noise: float) -> bool:
    """Whether an error is so little above the least that the rest would be no effect."""
    return _apart(left, least) < ABOVE_NOISE * max(noise, least)


def _screened(now: Fitted, records: _Records, found: Sequence[Option]) -> list[_Screened]:
    """The options after a few steps on thinned records: the best shapes on what was fitted, and on what was not.

    What was found before keeps its numbers; it is fitted jointly with those that are followed up. A shape that contains
    a simpler one is tried where that takes something away, and goes on where it takes more.
    """
    without = fits.rms(now.errors(records.thin)), fits.rms(now.errors(records.thin_held))
    simpler: dict[str, _Screened] = {}

    def acting(searches: Sequence[Search]) -> Sequence[Search]:
        return [each for each in searches if abs(each.now.rms - without[0]) > IDLE * without[0]] or searches

    def begin(option: Option) -> Fitted:
        starts = list(option.starts)
        if option.grown is not None:
            starts.append(option.grown(simpler[option.beyond].fitted.shape))
        begun = [fits.begun(option.alone, records.thin, start, now.weights) for start in starts]
        near = AWAY * min(each.now.rms for each in acting(begun))
        searches = [each.further(FIRST_STEPS, COARSE) for each in begun if each.now.rms <= near]
        best = min(acting(searches), key=lambda each: each.now.rms)
        search = best.further(SCREENING_STEPS, COARSE)
        for _ in range(LONGER - 1):
            if search.now.rms >= FALLING * best.now.rms:
                break
            best, search = search, search.further(SCREENING_STEPS, COARSE)
        return min(search, *searches, key=lambda each: each.now.rms).found(now.weights)

    def begun(some: Sequence[Option]) -> list[_Screened]:
        return _each(some, [option.alone for option in some], lambda k: begin(some[k]), records.thin_held, records)

    def helps(each: _Screened, rms: float, left: float) -> bool:
        return each.fitted.rms < (1.0 - HELPS) * rms or each.left < (1.0 - HELPS) * left

    tried = begun([option for option in found if not option.beyond])
    simpler = {each.option.label: each for each in tried if helps(each, *without)}
    for each in begun([option for option in found if option.beyond in simpler]):
        less = simpler[each.option.beyond]
        if helps(each, less.fitted.rms, less.left):
            tried.append(each)
    tried = [each for each in tried if math.isfinite(each.left)]
    kept: list[_Screened] = []
    by_held_out, by_fit = sorted(tried, key=lambda one: one.left), sorted(tried, key=lambda one: one.fitted.rms)
    for order, most in ((by_held_out, KEPT), (by_fit, KEPT + ALSO)):
        for each in order:
            if len(kept) == most:
                break
            if sum(other.option.name == each.option.name for other in kept) < SHAPES and each not in kept:
                kept.append(each)
    contained = [simpler[each.option.beyond] for each in kept if each.option.beyond]
    kept += [each for each in contained if each not in kept]  # whether more numbers are worth it shows when all fit
    return kept


def _each(
    found: Sequence[Option],
    structures: Sequence[Structure],
    search: Callable[[int], Fitted],
    held: Sequence[Item],
    records: _Records,
) -> list[_Screened]:
    """What a search finds for each option, counted by its number, and its rms error on some records.

    In several processes, from which only numbers come: what builds an effect of them cannot be sent.
    """

    def numbers(k: int) -> tuple[Array, Array, float, float]:
        fitted = search(k)
        left = fits.rms(fitted.errors(held)) if math.isfinite(fitted.rms) else math.inf
        return fitted.shape, fitted.weights, fitted.rms, left

    done = parallel.each(numbers, range(len(found)), records.jobs, records.tick)
    return [
        _Screened(option, Fitted(structure, shape, p, rms), left)
        for option, structure, (shape, p, rms, left) in zip(found, structures, done, strict=True)
    ]


def _followed_up(now: Fitted, kept: Sequence[_Screened], records: _Records) -> list[Tried]:
    """The options fitted to everything and run over the held-out records, the best one first."""
    whole = [each.option.structure for each in kept]
    by_held_out = PROMISING * min((each.left for each in kept), default=0.0)
    by_fit = PROMISING * min((each.fitted.rms for each in kept), default=0.0)

    def begin(k: int) -> Fitted:
        option, screened = kept[k].option, kept[k].fitted
        structure, shape, p = option.structure, option.joined(now, screened.shape), now.weights
        search = fits.begun(structure, records.quick, shape, p)
        promising = kept[k].left <= by_held_out or screened.rms <= by_fit
        return (search.further(JOINT_STEPS, COARSE) if promising else search).found(p)

    def go_on(k: int) -> Fitted:
        fitted = begun[k].fitted
        if begun[k].left > hopeful:
            return fitted
        return fits.fit(fitted.structure, records.quick, fitted.shape, fitted.weights)

    followed = [each.option for each in kept]
    begun = _each(followed, whole, begin, records.held, records)
    hopeful = HOPEFUL * min((each.left for each in begun), default=0.0)
    tried = []
    for each in _each(followed, whole, go_on, records.held, records):
        option, fitted = each.option, each.fitted
        if fitted.rms >= now.rms:
            continue
        errors = fitted.errors(records.held)
        names: tuple[str, ...] = (option.name,)
        if option.front:
            shape, _ = fitted.structure.pieces(fitted.shape)
            names = front_names(fitted.structure.front, shape, records.known.drive)
        tried.append(Tried(option, fitted, names, fits.rms(errors), errors))
    return sorted(tried, key=lambda each: each.held_out)


def _simplest_first(tried: Sequence[Tried], records: _Records) -> list[Tried]:
    """All, the best and those about as good before the others, and of these the ones of fewer numbers first.

    About as good: where all leave the same free in every record, held-out records find them no worse, whatever more the
    best explains of those it was fitted to; or they find them alike within a few per cent, and fitted ones no worse, or
    by chance, or by less than an effect is where the best has come to the end of what one of its numbers may be.
    Between equal numbers of numbers all records decide, or the catalogue's order where they find hardly any difference:
    a lag, which every amplifier has, before a delay. What leaves far more of the fitted records than another is not
    the best for a small lead on held-out ones, which may hold little more than what yet another effect leaves there.
    """
    if not tried:
        return []
    best, held, to_fit = tried[0], records.held, records.to_fit
    about_as_good = [each for each in tried if each.held_out <= (1.0 + UNSURE) * best.held_out]
    closest = min(about_as_good, key=lambda each: each.fitted.rms)
    if fits.rms(closest.fitted.errors(to_fit)) <= FAR_LESS * fits.rms(best.fitted.errors(to_fit, closest.fitted)):
        best = closest
    enough, fitted = (1.0 + SIMPLER) * best.held_out, best.fitted.errors(to_fit)
    less = fits.rms(fitted)

    def no_worse(errors: list[Array], more: float) -> bool:
        return (
            more <= less
            or difference(errors, fitted) > SURE
            or (_at_an_end(best.fitted) and _no_worse(more, less, records.noise))
        )

    near, others = [(best.numbers(held), _everywhere(best, best, records), best)], []
    for each in tried:
        if each is best:
            continue
        left, errors = fits.rms(each.fitted.errors(held, best.fitted)), each.fitted.errors(to_fit, best.fitted)
        more = fits.rms(errors)
        if less > FAR_LESS * more and (left <= best.held_out or (left <= enough and no_worse(errors, more))):
            near.append((each.numbers(held), _everywhere(each, best, records), each))
        else:
            others.append(each)
    least = {n: min(everywhere for number, everywhere, _ in near if number == n) for n, *_ in near}

    def order(one: tuple[int, float, Tried]) -> tuple[int, float, int]:
        number, everywhere, each = one
        return number, max(everywhere, (1.0 + EQUAL) * least[number]), _place(each.name)

    return [*(each for *_, each in sorted(near, key=order)), *others]


def _place(name: str) -> int:
    """Place in the catalogue, user's own effects behind it."""
    return effects.CATALOGUE.index(name) if name in effects.CATALOGUE else len(effects.CATALOGUE)


def _at_an_end(fitted: Fitted) -> bool:
    """Whether a number is the least or the most that it may be."""
    low, high = fitted.structure.bounds
    return bool(np.any((fitted.shape <= low) | (fitted.shape >= high)))


def _everywhere(each: Tried, best: Tried, records: _Records) -> float:
    """rms error over all records, with what the best leaves free in them."""
    return fits.rms(each.fitted.errors([*records.to_fit, *records.held], best.fitted))


def _without_needless(now: Fitted, found: list[Found], records: _Records) -> tuple[Fitted, list[Found]]:
    """Drop effects accepted earlier that those accepted later have made needless."""
    for k in range(len(found) - 1):
        fitted = _without(now, found[k].name, records)
        if fitted is None:
            continue
        with_it, without = records.left(now), records.left(fitted)
        if math.sqrt(max(without**2 - with_it**2, 0.0)) < 0.5 * ABOVE_NOISE * records.noise:
            return _without_needless(fitted, _rest(found, k, without), records)
    return now, found


def _exchanged(
    now: Fitted, found: list[Found], names: Collection[str], records: _Records
) -> tuple[Fitted, list[Found]]:
    """Put another effect or shape in the place of one accepted earlier, where those accepted later make it the better.

    The first of two has been chosen while the second was missing, and may have taken part of its place; and the second
    beside a wrong first one. Which names are alike shows beside all the others too. `names`: effects that were
    followed up so far, since one that was among the best beside none of the others is not worth another search.
    """
    latest, left = found[-1].name, EXCHANGES
    while left:
        left -= 1
        for k, old in enumerate(found):
            fitted = None if old.name == latest else _without(now, old.name, records)
            start = _left_as_it_is(now, old.name, records)  # the others' numbers without any may be far from all others
            step = None if fitted is None else _step(fitted, 0.0, records, lambda option: option.name in names, start)
            if step is None or step.merit is None:
                continue
            other = _found(step, records)
            if not _gives_way(now, old.name, step.best, records):
                if step.best.held_out <= (1.0 + UNSURE) * records.left(now):  # else it was not found again
                    alike = dict.fromkeys([other.name, *other.rivals])
                    found[k] = replace(old, rivals=tuple(name for name in alike if name != old.name))
                continue
            best = step.best.fitted
            chain = _in_place(best, [*found[:k], other, *found[k + 1 :]], found[0].before, records)
            now, found = _without_needless(best, chain or [*_rest(found, k, other.before), other], records)
            latest = other.name
            break
        else:
            break
    return now, found


def _gives_way(now: Fitted, name: str, best: Tried, records: _Records) -> bool:
    """Whether a hypothesis leaves so much more than another one, or no less on equal terms with more numbers.

    Or as much with as many, where the catalogue has the other effect before that of this name.
    """
    held, left, fewer = records.held, records.left(now), _numbers(now, records.held) - best.numbers(records.held)
    if best.held_out <= (1.0 - EXCHANGE) * left:
        return True
    if fewer == 0:
        return best.held_out <= (1.0 + EQUAL) * left and _place(best.name) < _place(name)
    return fewer > 0 and fits.rms(best.fitted.errors(held, now)) <= left


def _in_place(now: Fitted, found: Sequence[Found], gap: float, records: _Records) -> list[Found]:
    """What was found, with the errors of the models before and after each; empty where one makes it no smaller."""
    lefts = [records.left(now)]
    for each in reversed(found[1:]):
        smaller = _without(now, each.name, records)
        if smaller is None:
            return []
        now = smaller
        lefts.append(records.left(now))
    lefts = [gap, *reversed(lefts)]
    if any(after >= before for before, after in itertools.pairwise(lefts)):
        return []
    return [
        replace(each, before=before, after=after)
        for each, (before, after) in zip(found, itertools.pairwise(lefts), strict=True)
    ]


def _rest(found: Sequence[Found], k: int, without: float) -> list[Found]:
    """What was found but the k-th; each step of the gap is between two models that there are."""
    later = [replace(found[k + 1], before=found[k].before), *found[k + 2 :]] if k + 1 < len(found) else []
    rest = [*found[:k], *later]
    rest[-1] = replace(rest[-1], after=without)
    return rest


def _without(now: Fitted, name: str, records: _Records) -> Fitted | None:
    """The hypothesis less one effect, fitted anew."""
    smaller = _less(now, name)
    return None if smaller is None else fits.fit(smaller[0], records.quick, smaller[1], now.weights)


def _left_as_it_is(now: Fitted, name: str, records: _Records) -> Fitted | None:
    """The hypothesis less one effect, the others' numbers unchanged."""
    smaller = _less(now, name)
    if smaller is None:
        return None
    return fits.begun(smaller[0], records.quick, smaller[1], now.weights).found(now.weights)


def _less(now: Fitted, name: str) -> tuple[Structure, Array] | None:
    """The structure without one effect, and where its search starts."""
    front_shape, numbers = now.structure.pieces(now.shape)
    parts = [(part, x) for part, x in zip(now.structure.parts, numbers, strict=True) if part.name != name]
    if len(parts) < len(now.structure.parts):
        kept = tuple(part for part, _ in parts)
        return replace(now.structure, parts=kept), np.concatenate([front_shape, *(x for _, x in parts)])
    if name in ("asymmetry", "saturation") and len(front_shape):
        return replace(now.structure, front=Kept()), np.concatenate([np.empty(0), *numbers])
    return None


def difference(before: Sequence[Array], after: Sequence[Array]) -> float:
    """One-sided p-value of smaller squared errors after than before, over blocks longer than the errors remember.

    Wilcoxon's signed-rank test: what an effect explains may sit in a few events, so that the mean alone is no measure.
    """
    from scipy.stats import wilcoxon

    gains = []
    for a, b in zip(before, after, strict=True):
        known = np.isfinite(a) & np.isfinite(b)
        gain = a[known] ** 2 - b[known] ** 2
        if len(gain) < 4:
            continue
        size = int(min(max(1, round(2.0 * correlation_time(gain))), max(1, len(gain) // 20)))
        edges = np.arange(0, len(gain) - size + 1, size)
        gains.append(np.add.reduceat(gain[: edges[-1] + size], edges) / size)
    blocks = np.concatenate(gains) if gains else np.empty(0)
    if len(blocks) < 6 or not np.any(blocks):
        return 1.0
    return float(wilcoxon(blocks, alternative="greater").pvalue)
