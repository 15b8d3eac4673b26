"""Extend a hypothesis by one effect: rank all shapes of the catalogue quickly, then fit the best of them jointly."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hystgen import effects
from hystgen.basics import parallel
from hystgen.basics.problems import EffectsError
from hystgen.diagnosis.data import signals
from hystgen.diagnosis.data.items import Item, compared, everything, needed, rms, thinned
from hystgen.diagnosis.search import acceptance, fits
from hystgen.diagnosis.search.fits import Fitted, Search
from hystgen.diagnosis.search.hypothesis import Part, Starts, Structure
from hystgen.effects import BEND, LIMIT
from hystgen.effects.base import USER, About, Effect
from hystgen.identification import joint
from hystgen.identification.joint import BentFront, DeadZones, Ends, Front, Tanh, even_breaks

Array = NDArray[np.float64]


# Every shape of every effect of the catalogue, and fronts ----------------------------------------------------


SLOPE_PLACES = 201
"""Number of drive values at which the slope of a front is evaluated."""


@dataclass(frozen=True)
class Option:
    """One way to extend a hypothesis. `front`: whether it adds a front, which gets its name only after the fit.

    `structure`: with all parameters free; `alone`: with only the extension's parameters free, from `starts`. `beyond`:
    label of the simpler option that this option contains and follows; `grown`: a start from that option's parameters.
    """

    label: str
    name: str
    structure: Structure
    alone: Structure
    starts: tuple[Array, ...]
    front: bool = False
    beyond: str = ""
    grown: Callable[[Array], Array] | None = None

    def joined(self, now: Fitted, numbers: Array) -> Array:
        """The shape of the whole hypothesis with these parameters for the extension and the others unchanged."""
        front_shape, _ = now.structure.pieces(now.shape)
        if self.front:
            return np.concatenate([numbers, now.shape[len(front_shape) :]])
        return np.concatenate([now.shape, numbers])


def about(items: Sequence[Item], thresholds: Array) -> About:
    """Ranges, rates and times of the records, from which effects choose their candidates."""
    low = min(float(item.run.v.min()) for item in items)
    high = max(float(item.run.v.max()) for item in items)
    finest = min(float(np.median(np.diff(item.run.t))) for item in items)
    rates = [float(np.max(np.abs(np.diff(item.run.v) / np.diff(item.run.t)))) for item in items]
    columns = set(items[0].run.extra)
    for item in items:
        columns &= set(item.run.extra)
    outputs = [item.y[item.known] for item in items if item.known.any()]
    begin, end = min(float(item.run.t[0]) for item in items), max(float(item.run.t[-1]) for item in items)
    return About(
        (low, high),
        max(item.output_range for item in items),
        finest,
        max(float(np.ptp(item.run.t)) for item in items),
        end - begin,
        max(rates),
        float(sum(np.sum(np.abs(np.diff(item.run.v))) for item in items)),
        tuple(float(r) for r in thresholds),
        frozenset(columns),
        {name: _ends([item.run.extra[name] for item in items]) for name in columns},
        timed=all(item.timed for item in items),
        output=(min(float(y.min()) for y in outputs), max(float(y.max()) for y in outputs)) if outputs else (0.0, 0.0),
        speeds=signals.shows_speed(items),
    )


def _ends(signals_of: Sequence[Array]) -> tuple[float, float]:
    """Smallest and largest value of a column; equal ends if it has no finite values."""
    finite = np.concatenate([each[np.isfinite(each)] for each in signals_of])
    return (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)


def name_of(kind: type[Effect]) -> str:
    """The name of a user's own effect."""
    return str(kind.model_fields["name"].annotation.__args__[0])  # type: ignore[union-attr]


def options(now: Fitted, known: About, user: Sequence[type[Effect]] = ()) -> list[Option]:
    """Every extension of a hypothesis by one effect."""
    structure, held = now.structure, now.structure.held(now.shape)
    there = [part.name for part in structure.parts]
    moved = any(effect.moves_plays() for effect in structure.effects(now.shape))
    found = []
    if not held.front.stages(np.empty(0)):
        found += _fronts(structure, held, known.drive)
    kinds = [(name, kind) for name in effects.CATALOGUE for kind in effects.shapes(name)]
    kinds += [(name_of(kind), kind) for kind in user]
    for name, kind in kinds:
        if (name in there and not kind.repeatable) or not known.columns.issuperset(kind.columns):
            continue
        if (moved and kind.moves_plays()) or (kind.timed and not known.timed):
            continue
        for candidate in kind.candidates(known):
            part = Part(name, candidate, firm=name.startswith(USER))
            pair = replace(structure, parts=(*structure.parts, part)), replace(held, parts=(*held.parts, part))
            starts = (candidate.start, *candidate.others)
            found.append(Option(candidate.label, name, *pair, starts, False, candidate.beyond, candidate.grown))
    return found


def _fronts(structure: Structure, held: Structure, drive: tuple[float, float]) -> list[Option]:
    """The memoryless parts that can be added in front."""

    def one(label: str, front: Front, starts: Sequence[Array], beyond: str = "") -> Option:
        pair = replace(structure, front=front), replace(held, front=front)
        return Option(label, BEND, *pair, tuple(starts), True, beyond)

    one_way, both_ways = BentFront(drive, 1), BentFront(drive, 2)
    dead_zones, finer = (DeadZones(drive, even_breaks(drive, n)) for n in (acceptance.BREAKS, acceptance.FINER_BREAKS))
    tanh = Tanh(drive)
    sides = (-acceptance.TANH_SIDE, acceptance.TANH_SIDE)
    bent = [np.array([acceptance.TANH_BEND, side]) for side in sides]  # bent one way over the whole range
    # outside the drive range, neither a limit nor a small change to it has any effect, so start inside
    limiters = [np.array([share, share, -2.0]) for share in acceptance.LIMITERS]
    return [
        one("front that bends one way", one_way, [one_way.straight]),
        one("front that bends both ways", both_ways, [both_ways.straight]),
        one("front of dead zones", dead_zones, [dead_zones.straight]),
        one("front of more dead zones", finer, [finer.straight], "front of dead zones"),
        one("front of one tanh", tanh, [tanh.straight, *bent]),
        one("front with flatter ends", Ends(drive), limiters),
    ]


def front_names(front: Front, shape: Array, drive: tuple[float, float]) -> tuple[str, ...]:
    """`LIMIT` for a front that is linear between flatter ends, or bends in the same way at both ends; else `BEND`.

    Returns both names if only one end is slightly flatter: a soft limit at that end and a bent actuator give the same
    front.
    """
    v = np.linspace(*drive, SLOPE_PLACES)
    w = v
    for stage in front.stages(shape):
        w = stage.forward(w)
    slopes = np.diff(w) / np.diff(v)
    middle, near = float(np.median(slopes)), acceptance.LIMITER_NEAR * float(np.ptp(slopes))
    flatter, other = sorted(float(end.mean()) for end in (slopes[: SLOPE_PLACES // 16], slopes[-SLOPE_PLACES // 16 :]))
    straight = float(np.mean(np.abs(slopes - middle) <= near)) >= acceptance.LIMITER_STRAIGHT
    if straight and other <= middle + near and flatter < middle - near:
        sure = flatter < acceptance.LIMITER_SLOPE * middle or other < middle - near
        return (LIMIT,) if sure else (LIMIT, BEND)
    bent = w - np.polyval(np.polyfit(v, w, 1), v)
    odd, even = 0.5 * (bent - bent[::-1]), 0.5 * (bent + bent[::-1])
    ends = 0.5 * (slopes[: SLOPE_PLACES // 8].mean() + slopes[-SLOPE_PLACES // 8 :].mean())
    odd_wins = np.sum(odd**2) > acceptance.ODD_FRONT * np.sum(even**2)
    flat_ends = ends < slopes[SLOPE_PLACES // 3 : -SLOPE_PLACES // 3].mean()
    return (LIMIT,) if odd_wins and flat_ends else (BEND,)


# Screening of the options ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Tried:
    """A fully fitted option, with its held-out errors."""

    option: Option
    fitted: Fitted
    names: tuple[str, ...]
    """its name, and other names that the same front may have"""
    held_out: float
    errors: list[Array]

    @property
    def name(self) -> str:
        """The first of the option's names."""
        return self.names[0]

    def numbers(self, held: Sequence[Item]) -> int:
        """Number of free parameters, including a record's free components: a start response may explain a drift."""
        return free_numbers(self.fitted, held)


def free_numbers(fitted: Fitted, held: Sequence[Item]) -> int:
    """Number of free parameters of a hypothesis, including the free components of one record."""
    return len(fitted.shape) + max(len(fitted.actuator.nuisances(item)) for item in held)


@dataclass(frozen=True)
class Records:
    """The records of a search: in full, thinned for searches, and thinned further for the screening.

    `full`: fitted records with as many samples as any fit compares; `quick`: with as many as a search compares; `thin`,
    `thin_held`: with as many as the screening compares.
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
    """rms error of the refitted model over the fitted records"""
    tick: Callable[[], None]
    jobs: int
    one_loop: bool
    """whether all records follow the same loop"""
    one_speed: bool
    """whether the fitted records follow their loops in the same time"""
    compared: float
    """fraction of the recorded samples that are compared"""
    holds: tuple[list[list[slice]], list[list[slice]]]
    """the settled samples of each hold, of held-out and of fitted records"""

    @classmethod
    def of(
        cls, to_fit: Sequence[Item], held: Sequence[Item], refitted: Fitted, noise: float,
        user: Sequence[type[Effect]] = (), tick: Callable[[], None] = lambda: None,
    ) -> Records:
        """Records thinned by the errors of the refitted model; for a user's own effect, every sample is kept."""
        groups, structure = (to_fit, held), refitted.structure
        masks = everything(groups)
        if not user and not any(part.name.startswith(USER) for part in structure.parts):
            masks = [needed(group, refitted.errors(group), noise) for group in groups]
        full, quick = (thinned(groups, number, masks)[0] for number in (joint.COMPARED, acceptance.SEARCHED))
        thin, thin_held = thinned(groups, acceptance.SCREENED, masks)
        gap = rms(refitted.errors(to_fit))
        known = about(to_fit, structure.thresholds)
        taking_part, recorded = compared([*to_fit, *held])
        return cls(
            to_fit, held, full, quick, thin, thin_held, known, user, noise, gap, tick, _jobs(),
            signals.one_loop([*to_fit, *held]), signals.one_speed(to_fit), taking_part / recorded,
            (list(map(signals.settled, held)), list(map(signals.settled, to_fit))),
        )

    def at_rest(self, errors: Sequence[Array], group: int) -> list[Array]:
        """The errors in each settled hold less their mean; `group`: 0 for held-out records, 1 for fitted ones."""
        parts = [error[hold] for error, holds in zip(errors, self.holds[group], strict=True) for hold in holds]
        return [part - np.nanmean(part) for part in parts if np.isfinite(part).any()]

    def terms(self, now: Fitted, other: Fitted) -> list[Fitted]:
        """A hypothesis, and a copy whose weights are refitted with the free start states of another one.

        Free start states of an effect that is slow compared with the records follow any slow error. Without them, the
        weights alone would have to follow that error; they would do worse, and the effect would get the credit.
        """
        if all(len(other.actuator.nuisances(item)) == 1 for item in self.quick):
            return [now]
        return [now, fits.on_equal_terms(now, other, self.quick)]

    def extensions(
        self, now: Fitted, worth: Callable[[Option], bool] | None = None, whatever: bool = False
    ) -> list[Tried]:
        """The hypothesis with one more effect, best shapes first; `worth`: selects the options to try; `whatever`: also
        those that do not lower the error of the fit."""
        rings = signals.ringing(self.to_fit, now.errors(self.to_fit), acceptance.RINGING_STARTS)
        known = replace(self.known, ringing=rings)
        rough = _rough(now, self.thin)
        roughly = replace(known, thresholds=tuple(rough.structure.thresholds.tolist()))
        both = zip(options(now, known, self.user), options(rough, roughly, self.user), strict=True)
        found = [_Pair(*each) for each in both if worth is None or worth(each[0])]
        searches = _Searches(now, rough, found, self)
        with parallel.Pool(searches, self.jobs) as pool:
            return _followed_up(searches, _screened(searches, pool), pool, whatever)

    def restarted(self, fitted: Fitted) -> Fitted:
        """The fit with start memories found in the presence of its effects (`fits.restarted`)."""
        return fits.restarted(fitted, [*self.to_fit, *self.held], self.quick)

    def residual(self, fitted: Fitted) -> float:
        """rms error on held-out records."""
        return rms(fitted.errors(self.held))


def _rough(now: Fitted, thin: Sequence[Item]) -> Fitted:
    """The hypothesis with every other threshold, including the smallest and the largest: enough to rank shapes."""
    all_of_them = now.structure.thresholds
    places = np.unique([0, *range(len(all_of_them) - 1, -1, -2)])
    p = np.zeros(len(places))
    np.add.at(p, np.searchsorted(places, np.arange(len(all_of_them))), now.weights)  # an output map needs good weights
    structure = replace(now.structure, thresholds=np.ascontiguousarray(all_of_them[places]))
    return fits.begun(structure, thin, now.shape, p).found(p)


def _jobs() -> int:
    """Number of processes; loads the compiled functions of effects, so that they are not loaded after each fork."""
    jobs = parallel.cores()
    if jobs > 1:
        effects.load_compiled()
    return jobs


class _Pair(NamedTuple):
    """An option, and the same option with the reduced thresholds of the screening."""

    option: Option
    rough: Option


@dataclass(frozen=True, eq=False)
class _Screened:
    """An option, its index, its fit after the first steps, and its held-out rms."""

    k: int
    option: Option
    fitted: Fitted
    residual: float

    @property
    def numbers(self) -> int:
        """Number of the option's parameters."""
        return len(self.option.alone.start)


_SCREEN, _JOIN, _POLISH, _RESTART = range(4)
"""Stages of a search: first steps for the option alone, then for the whole hypothesis, last steps, start memories."""


class _Trial(NamedTuple):
    what: int
    k: int
    """index of the option"""
    shape: Array | None = None
    """start of the search; for a shape that contains a simpler one, the parameters of the simpler one"""
    weights: Array | None = None
    """weights close to the weights at the start"""
    steps: int = 0
    rms: float = math.nan
    """error at the start, if it is known"""


class _Numbers(NamedTuple):
    """Parameters found by a search, held-out rms, start memories; unlike candidates, these can be pickled."""

    shape: Array
    weights: Array
    rms: float
    residual: float
    starts: Starts

    def of(self, structure: Structure) -> Fitted:
        """The fit of a structure with these parameters."""
        return Fitted(replace(structure, starts=self.starts), *self[:3])


@dataclass(frozen=True)
class _Searches:
    """The searches of one round, for every option added to a hypothesis; `rough`: the same with fewer thresholds."""

    now: Fitted
    rough: Fitted
    found: Sequence[_Pair]
    records: Records

    def __call__(self, task: _Trial) -> _Numbers:
        """The parameters that one search finds."""
        pair, records = self.found[task.k], self.records
        if task.what == _SCREEN:
            fitted, held = self._screen(pair.rough, task), records.thin_held
        elif task.what == _RESTART:
            fitted, held = self._restarted(pair.option, task), records.held
        else:
            fitted, held = self._join(pair.option, task), records.held
        residual = rms(fitted.errors(held)) if math.isfinite(fitted.rms) else math.inf
        return _Numbers(fitted.shape, fitted.weights, fitted.rms, residual, fitted.structure.starts)

    def _screen(self, option: Option, task: _Trial) -> Fitted:
        """A few steps from each start on thinned records, and a few more from the best of them."""
        now, thin = self.rough, self.records.thin
        without = rms(now.errors(thin))

        def acting(searches: Sequence[Search]) -> Sequence[Search]:
            return [each for each in searches if abs(each.now.rms - without) > acceptance.IDLE * without] or searches

        def enough_of_it(start: Array) -> Array:
            if option.front or not option.alone.parts[-1].candidate.amounts:
                return start
            *others, last = option.alone.parts
            amounts = replace(last, candidate=last.candidate.at(start))
            structure = replace(option.alone, parts=(*others, amounts))
            return fits.begun(structure, thin, start, now.weights).further(1, fits.COARSE).now.shape

        begun = [fits.begun(option.alone, thin, enough_of_it(start), now.weights) for start in option.starts]
        if option.grown is not None and task.shape is not None and task.weights is not None:
            begun.append(fits.begun(option.alone, thin, option.grown(task.shape), task.weights))
        if option.name.startswith(USER) and not any(math.isfinite(each.now.rms) for each in begun):
            raise EffectsError(f"the effect {option.name} gives no finite output at any start of its search")
        near = acceptance.TOO_FAR * min(each.now.rms for each in acting(begun))
        searches = [each.further(acceptance.FIRST_STEPS, fits.COARSE) for each in begun if each.now.rms <= near]
        best = min(acting(searches), key=lambda each: each.now.rms)
        search = _while_falling(best, acceptance.SCREENING_STEPS)
        return min(search, *searches, key=lambda each: each.now.rms).found(now.weights)

    def _join(self, option: Option, task: _Trial) -> Fitted:
        """The whole hypothesis, fitted from a task's start with its number of steps."""
        assert task.shape is not None
        assert task.weights is not None
        search = fits.begun(option.structure, self.records.quick, task.shape, task.weights)
        if task.what == _POLISH:
            search = search.further(task.steps)
        elif task.steps:
            search = _while_falling(search, task.steps)
        return search.found(task.weights)

    def _restarted(self, option: Option, task: _Trial) -> Fitted:
        """The fit of a task with start memories found in the presence of its effects."""
        assert task.shape is not None
        assert task.weights is not None
        return self.records.restarted(Fitted(option.structure, task.shape, task.weights, task.rms))


def _while_falling(search: Search, steps: int) -> Search:
    """The search after `steps` steps, and after as many again for as long as they lower the error enough (`FALLING`).

    Failed steps do not end the search: each increases the damping of the next, until a step is short enough to lower
    the error. Ending at a failed step once meant judging a strongly cubic sensor by its start.
    """
    for _ in range(acceptance.LONGER):
        before, search = search.now, search.further(steps, fits.COARSE)
        if search.now is not before and search.now.rms >= acceptance.FALLING * before.rms:
            break
    return search


_Pool = parallel.Pool[_Trial, _Numbers]


def _screened(searches: _Searches, pool: _Pool) -> list[_Screened]:
    """The options after a few steps on thinned records: the best on fitted and on held-out records.

    Effects found earlier keep their parameters here; they are fitted jointly with the options that are followed up. A
    shape that contains a simpler one is tried if the simpler one helps, and kept if it helps more.
    """
    records, found = searches.records, [pair.rough for pair in searches.found]
    without = [rms(searches.rough.errors(items)) for items in (records.thin, records.thin_held)]

    def helps(each: _Screened, fit: float, held_out: float) -> bool:
        share = 1.0 - acceptance.BETTER
        return each.fitted.rms < share * fit or each.residual < share * held_out

    def screened(k: int, numbers: _Numbers) -> _Screened:
        return _Screened(k, found[k], numbers.of(found[k].alone), numbers.residual)

    def containing(option: Option) -> list[int]:
        return [k for k, other in enumerate(found) if other.beyond == option.label]

    def cost(k: int) -> int:
        return sum(_cost(found[j].alone, found[j]) for j in (k, *containing(found[k])))

    def further(task: _Trial, numbers: _Numbers) -> list[_Trial]:
        if found[task.k].beyond or not helps(screened(task.k, numbers), *without):
            return []
        return [_Trial(_SCREEN, k, numbers.shape, numbers.weights) for k in containing(found[task.k])]

    first = sorted((k for k, option in enumerate(found) if not option.beyond), key=cost, reverse=True)
    done = {task.k: numbers for task, numbers in pool.each([_Trial(_SCREEN, k) for k in first], records.tick, further)}
    every = [screened(k, done[k]) for k in sorted(done)]
    tried = [each for each in every if not each.option.beyond]
    simpler = {each.option.label: each for each in tried if helps(each, *without)}
    for each in every:
        less = simpler.get(each.option.beyond)
        if less is not None and helps(each, less.fitted.rms, less.residual):
            tried.append(each)
    tried = [each for each in tried if math.isfinite(each.residual)]
    kept = _kept(tried, [each for each in tried if helps(each, *without)])
    contained = [simpler[each.option.beyond] for each in kept if each.option.beyond]
    labels = {each.option.label for each in kept}
    richer = [each for each in tried if each.option.beyond in labels]
    return list(dict.fromkeys([*kept, *contained, *richer]))  # the joint fit shows whether more parameters help


def _cost(structure: Structure, option: Option) -> int:
    """Rough cost of a search; the longest search starts first, so that the pool does not wait for it at the end."""
    return len(structure.start) * (1 + len(option.starts))


def _kept(tried: Sequence[_Screened], helpful: Sequence[_Screened]) -> list[_Screened]:
    """The best options on held-out records, the best of the others on fitted records, and helpful twins of both.

    If its effect is already kept, a twin must have fewer parameters than the kept shapes; the simplest is taken.
    """
    kept: list[_Screened] = []
    by_held_out, by_fit = sorted(tried, key=lambda one: one.residual), sorted(tried, key=lambda one: one.fitted.rms)
    for order, most in ((by_held_out, acceptance.KEPT), (by_fit, acceptance.KEPT + acceptance.ALSO_KEPT)):
        for each in order:
            if len(kept) == most:
                break
            of_one = sum(other.option.name == each.option.name for other in kept)
            if of_one < acceptance.SHAPES_OF_ONE and each not in kept:
                kept.append(each)
    twins: dict[str, _Screened] = {}
    for each in sorted(helpful, key=lambda one: (one.numbers, one.residual)):
        own = [other.numbers for other in kept if other.option.name == each.option.name]
        if each.numbers < min(own, default=math.inf) and any(_twins(each, other) for other in kept):
            twins.setdefault(each.option.name, each)
    return [*kept, *twins.values()]


def _twins(one: _Screened, other: _Screened) -> bool:
    """Whether two options have nearly the same errors on fitted and on held-out records."""
    both = (one.fitted.rms, other.fitted.rms), (one.residual, other.residual)
    return all(abs(a - b) <= acceptance.TWIN * b for a, b in both)


def _followed_up(
    searches: _Searches, kept: Sequence[_Screened], pool: _Pool, whatever: bool = False
) -> list[Tried]:
    """The options fitted jointly and judged on held-out records, the best one first; `whatever`: as in `extensions`."""
    now, records = searches.now, searches.records
    found = {each.k: searches.found[each.k].option for each in kept}
    by_held_out = acceptance.PROMISING * min((each.residual for each in kept), default=0.0)
    by_fit = acceptance.PROMISING * min((each.fitted.rms for each in kept), default=0.0)

    def join(each: _Screened) -> _Trial:
        promising = each.residual <= by_held_out or each.fitted.rms <= by_fit
        shape = found[each.k].joined(now, each.fitted.shape)
        return _Trial(_JOIN, each.k, shape, now.weights, acceptance.JOINT_STEPS if promising else 0)

    starting_anew = any(map(fits.restarts, (*records.to_fit, *records.held)))

    def anew(k: int, numbers: _Numbers) -> list[_Trial]:
        return [_Trial(_RESTART, k, *numbers[:2], rms=numbers.rms)] if starting_anew else []

    def then(task: _Trial, numbers: _Numbers) -> list[_Trial]:
        return anew(task.k, numbers) if task.what == _POLISH else []

    def all_of(tasks: Sequence[_Trial]) -> dict[int, _Numbers]:
        order = sorted(tasks, key=lambda task: _cost(found[task.k].structure, found[task.k]), reverse=True)
        return {task.k: numbers for task, numbers in pool.each(order, records.tick, then)}  # the last result of each

    done = all_of([join(each) for each in kept])
    hopeful = acceptance.HOPEFUL * min((numbers.residual for numbers in done.values()), default=0.0)
    going_on, others = [], []
    for k, numbers in done.items():
        if numbers.residual > hopeful:
            others += anew(k, numbers)  # with the old start memories, the right shape can have twice the error
        else:
            going_on.append(_Trial(_POLISH, k, *numbers[:2], joint.MOST_STEPS))
    done |= all_of([*going_on, *others])
    tried = []
    for k, option in found.items():
        if done[k].rms >= now.rms and not whatever:
            continue
        fitted = done[k].of(option.structure)
        errors = fitted.errors(records.held)
        names: tuple[str, ...] = (option.name,)
        if option.front:
            shape, _ = fitted.structure.pieces(fitted.shape)
            names = front_names(fitted.structure.front, shape, records.known.drive)
        tried.append(Tried(option, fitted, names, rms(errors), errors))
    return sorted(tried, key=lambda each: each.held_out)
