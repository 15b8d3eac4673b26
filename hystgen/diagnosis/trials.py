"""Every shape of every effect beside a hypothesis: told apart on thinned records, the hopeful ones fitted jointly."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import parallel
from hystgen.basics.problems import EffectsError
from hystgen.diagnosis import drives, periodic
from hystgen.diagnosis import structure as fits
from hystgen.diagnosis.options import Option, about, front_names, options
from hystgen.diagnosis.structure import Fitted, Item, Search, Structure
from hystgen.diagnosis.thinning import everything, needed, thinned
from hystgen.effects import recursions
from hystgen.effects.base import USER, About, Effect
from hystgen.identification import joint

Array = NDArray[np.float64]

SCREENED, SEARCHED = 6_000, 12_000
"""Most samples compared, to fit and held out, while the many shapes are told apart; and to fit in other searches."""

FIRST_STEPS, SCREENING_STEPS = 2, 2
"""Steps of a search from each start, and then from the best one, while the shapes are told apart."""

TOO_FAR = 5.0
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

TWIN = 0.02
"""An effect that is not among them follows where what it leaves, fitted and held out, is within this share of theirs.

Which of two like a lag and a delay is cut off would be chance, and what cannot be told apart has to be said.
"""

RINGING = 3
"""Frequencies at which the error rings, from which a search for a resonance starts too."""

HELPS = 0.05
"""A shape has to lower the error by this share while they are told apart, or those that contain it are not tried.

And these have to lower the error that it leaves by as much again.
"""

LARGE = 5_000
"""Samples to fit from which on the options are tried in several processes; of fewer there is little to share."""


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
        return free_numbers(self.fitted, held)


def free_numbers(fitted: Fitted, held: Sequence[Item]) -> int:
    """How many numbers a hypothesis has, with what it leaves free in a record."""
    return len(fitted.shape) + max(len(fitted.actuator.nuisances(item)) for item in held)


@dataclass(frozen=True)
class Records:
    """What a search is over, and what it is like: the records, thinned for searches, and further to tell shapes apart.

    `full`: those to fit, with as many samples compared as any search compares.
    """

    to_fit: Sequence[Item]
    held: Sequence[Item]
    full: Sequence[Item]
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
    one_loop: bool
    """whether all of them pass the same loop"""
    one_speed: bool
    """whether those to fit pass their loops in the same time"""

    @classmethod
    def of(
        cls,
        to_fit: Sequence[Item],
        held: Sequence[Item],
        refitted: Fitted,
        noise: float,
        user: Sequence[type[Effect]] = (),
        tick: Callable[[], None] = lambda: None,
    ) -> Records:
        """Records thinned by what the refitted model leaves of them; a user's own effect sees all samples."""
        groups, structure = (to_fit, held), refitted.structure
        masks = everything(groups)
        if not user and not any(part.name.startswith(USER) for part in structure.parts):
            masks = [needed(group, refitted.errors(group), noise) for group in groups]
        full, quick = (thinned(groups, number, masks)[0] for number in (joint.COMPARED, SEARCHED))
        thin, thin_held = thinned(groups, SCREENED, masks)
        gap = fits.rms(refitted.errors(to_fit))
        known = about(to_fit, structure.thresholds)
        return cls(
            to_fit, held, full, quick, thin, thin_held, known, user, noise, gap, tick, _jobs(to_fit),
            drives.one_loop([*to_fit, *held]), drives.one_speed(to_fit),
        )  # fmt: skip

    def extensions(self, now: Fitted, worth: Callable[[Option], bool] | None = None) -> list[Tried]:
        """One effect more, the best shapes of all, the best one first; `worth`: of the options that are worth it."""
        known = replace(self.known, ringing=periodic.ringing(self.to_fit, now.errors(self.to_fit), RINGING))
        rough = _rough(now, self.thin)
        roughly = replace(known, thresholds=tuple(rough.structure.thresholds.tolist()))
        both = zip(options(now, known, self.user), options(rough, roughly, self.user), strict=True)
        found = [_Pair(*each) for each in both if worth is None or worth(each[0])]
        searches = _Searches(now, rough, found, self)
        with parallel.Crew(searches, self.jobs) as crew:
            return _followed_up(searches, _screened(searches, crew), crew)

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


class _Pair(NamedTuple):
    """An option, and the same with fewer thresholds to tell shapes apart."""

    option: Option
    rough: Option


@dataclass(frozen=True, eq=False)
class _Screened:
    """An option, counted by its number, after the first steps, and its held-out rms."""

    k: int
    option: Option
    fitted: Fitted
    left: float


_SCREEN, _JOIN, _POLISH = range(3)
"""What is done with an option: a few steps alone, a few of the whole hypothesis, and the search to its end."""


class _Task(NamedTuple):
    what: int
    k: int
    """number of the option"""
    shape: Array | None = None
    """where the search begins; for a shape that contains a simpler one what was found for that"""
    weights: Array | None = None
    steps: int = 0


class _Numbers(NamedTuple):
    """What a search finds, and its rms error on records that took no part: no more than can be sent by a process.

    What builds an effect of numbers cannot.
    """

    shape: Array
    weights: Array
    rms: float
    left: float


@dataclass(frozen=True)
class _Searches:
    """The searches of one round, for every option beside a hypothesis; `rough`: that with fewer thresholds."""

    now: Fitted
    rough: Fitted
    found: Sequence[_Pair]
    records: Records

    def __call__(self, task: _Task) -> _Numbers:
        """What one search finds."""
        pair, records = self.found[task.k], self.records
        if task.what == _SCREEN:
            fitted, held = self._screen(pair.rough, task.shape), records.thin_held
        else:
            fitted, held = self._join(pair.option, task), records.held
        left = fits.rms(fitted.errors(held)) if math.isfinite(fitted.rms) else math.inf
        return _Numbers(fitted.shape, fitted.weights, fitted.rms, left)

    def _screen(self, option: Option, simpler: Array | None) -> Fitted:
        """A few steps from each start on thinned records, and a few more from the best of them."""
        now, thin = self.rough, self.records.thin
        without = fits.rms(now.errors(thin))

        def acting(searches: Sequence[Search]) -> Sequence[Search]:
            return [each for each in searches if abs(each.now.rms - without) > IDLE * without] or searches

        def enough_of_it(start: Array) -> Array:
            if option.front or not option.alone.parts[-1].candidate.amounts:
                return start
            *others, last = option.alone.parts
            amounts = replace(last, candidate=last.candidate.at(start))
            structure = replace(option.alone, parts=(*others, amounts))
            return fits.begun(structure, thin, start, now.weights).further(1, COARSE).now.shape

        starts = list(option.starts)
        if option.grown is not None and simpler is not None:
            starts.append(option.grown(simpler))
        begun = [fits.begun(option.alone, thin, enough_of_it(start), now.weights) for start in starts]
        if option.name.startswith(USER) and not any(math.isfinite(each.now.rms) for each in begun):
            raise EffectsError(f"the effect {option.name} gives no finite output wherever a search for it begins")
        near = TOO_FAR * min(each.now.rms for each in acting(begun))
        searches = [each.further(FIRST_STEPS, COARSE) for each in begun if each.now.rms <= near]
        best = min(acting(searches), key=lambda each: each.now.rms)
        search = best.further(SCREENING_STEPS, COARSE)
        for _ in range(LONGER - 1):
            if search.now.rms >= FALLING * best.now.rms:
                break
            best, search = search, search.further(SCREENING_STEPS, COARSE)
        return min(search, *searches, key=lambda each: each.now.rms).found(now.weights)

    def _join(self, option: Option, task: _Task) -> Fitted:
        """The whole hypothesis fitted from a start, by so many steps."""
        assert task.shape is not None
        assert task.weights is not None
        search = fits.begun(option.structure, self.records.quick, task.shape, task.weights)
        little = COARSE if task.what == _JOIN else fits.POLISHED
        return (search.further(task.steps, little) if task.steps else search).found(task.weights)


_Crew = parallel.Crew[_Task, _Numbers]


def _screened(searches: _Searches, crew: _Crew) -> list[_Screened]:
    """The options after a few steps on thinned records: the best shapes on what was fitted, and on what was not.

    What was found before keeps its numbers; it is fitted jointly with those that are followed up. A shape that contains
    a simpler one is tried where that takes something away, and goes on where it takes more.
    """
    records, found = searches.records, [pair.rough for pair in searches.found]
    without = [fits.rms(searches.rough.errors(items)) for items in (records.thin, records.thin_held)]

    def helps(each: _Screened, rms: float, left: float) -> bool:
        return each.fitted.rms < (1.0 - HELPS) * rms or each.left < (1.0 - HELPS) * left

    def screened(k: int, numbers: _Numbers) -> _Screened:
        return _Screened(k, found[k], Fitted(found[k].alone, *numbers[:3]), numbers.left)

    def containing(option: Option) -> list[int]:
        return [k for k, other in enumerate(found) if other.beyond == option.label]

    def cost(k: int) -> int:
        return sum(_cost(found[j].alone, found[j]) for j in (k, *containing(found[k])))

    def further(task: _Task, numbers: _Numbers) -> list[_Task]:
        if found[task.k].beyond or not helps(screened(task.k, numbers), *without):
            return []
        return [_Task(_SCREEN, k, numbers.shape) for k in containing(found[task.k])]

    first = sorted((k for k, option in enumerate(found) if not option.beyond), key=cost, reverse=True)
    done = {task.k: numbers for task, numbers in crew.each([_Task(_SCREEN, k) for k in first], records.tick, further)}
    every = [screened(k, done[k]) for k in sorted(done)]
    tried = [each for each in every if not each.option.beyond]
    simpler = {each.option.label: each for each in tried if helps(each, *without)}
    for each in every:
        less = simpler.get(each.option.beyond)
        if less is not None and helps(each, less.fitted.rms, less.left):
            tried.append(each)
    tried = [each for each in tried if math.isfinite(each.left)]
    kept = _kept(tried, [each for each in tried if helps(each, *without)])
    contained = [simpler[each.option.beyond] for each in kept if each.option.beyond]
    return list(dict.fromkeys([*kept, *contained]))  # whether more numbers are worth it shows when all fit


def _cost(structure: Structure, option: Option) -> int:
    """What a search costs, about: the longest go first, so that no process is left alone with one."""
    return len(structure.start) * (1 + len(option.starts))


def _kept(tried: Sequence[_Screened], helpful: Sequence[_Screened]) -> list[_Screened]:
    """The best on held-out records, others that fit best, and of the helpful ones their twins."""
    kept: list[_Screened] = []
    by_held_out, by_fit = sorted(tried, key=lambda one: one.left), sorted(tried, key=lambda one: one.fitted.rms)
    for order, most in ((by_held_out, KEPT), (by_fit, KEPT + ALSO)):
        for each in order:
            if len(kept) == most:
                break
            if sum(other.option.name == each.option.name for other in kept) < SHAPES and each not in kept:
                kept.append(each)
    twins: dict[str, _Screened] = {}
    for each in sorted(helpful, key=lambda one: one.left):
        if all(other.option.name != each.option.name for other in kept) and any(_twins(each, k) for k in kept):
            twins.setdefault(each.option.name, each)
    return [*kept, *twins.values()]


def _twins(one: _Screened, other: _Screened) -> bool:
    """Whether two leave as good as the same, fitted and held out."""
    both = (one.fitted.rms, other.fitted.rms), (one.left, other.left)
    return all(abs(a - b) <= TWIN * b for a, b in both)


def _followed_up(searches: _Searches, kept: Sequence[_Screened], crew: _Crew) -> list[Tried]:
    """The options fitted to everything and run over the held-out records, the best one first."""
    now, records = searches.now, searches.records
    found = {each.k: searches.found[each.k].option for each in kept}
    by_held_out = PROMISING * min((each.left for each in kept), default=0.0)
    by_fit = PROMISING * min((each.fitted.rms for each in kept), default=0.0)

    def join(each: _Screened) -> _Task:
        promising = each.left <= by_held_out or each.fitted.rms <= by_fit
        shape = found[each.k].joined(now, each.fitted.shape)
        return _Task(_JOIN, each.k, shape, now.weights, JOINT_STEPS if promising else 0)

    def all_of(tasks: Sequence[_Task]) -> dict[int, _Numbers]:
        order = sorted(tasks, key=lambda task: _cost(found[task.k].structure, found[task.k]), reverse=True)
        return {task.k: numbers for task, numbers in crew.each(order, records.tick)}

    done = all_of([join(each) for each in kept])
    hopeful = HOPEFUL * min((numbers.left for numbers in done.values()), default=0.0)
    going_on = {k: numbers for k, numbers in done.items() if not numbers.left > hopeful}
    done |= all_of([_Task(_POLISH, k, *numbers[:2], joint.MOST_STEPS) for k, numbers in going_on.items()])
    tried = []
    for k, option in found.items():
        fitted = Fitted(option.structure, *done[k][:3])
        if fitted.rms >= now.rms:
            continue
        errors = fitted.errors(records.held)
        names: tuple[str, ...] = (option.name,)
        if option.front:
            shape, _ = fitted.structure.pieces(fitted.shape)
            names = front_names(fitted.structure.front, shape, records.known.drive)
        tried.append(Tried(option, fitted, names, fits.rms(errors), errors))
    return sorted(tried, key=lambda each: each.held_out)
