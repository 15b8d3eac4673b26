"""Fits of hypotheses to records: weights and all other parameters together, on the free-run error of whole records.

The output is linear in the weights unless an output map bends it, so each step solves for the weights and for the
changes in all other parameters at once (`identification.joint`). The linear system at the fit gives their intervals.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import acceptance
from hystgen.diagnosis.search.hypothesis import RANK, Actuator, NotFiniteError, Structure, Sums, Turns
from hystgen.effects.base import Candidate, Effect
from hystgen.identification import joint, pi, reduction, stage_content, start
from hystgen.identification.joint import DIFFERENCE, LocalFit
from hystgen.identification.pi import root_mean_square
from hystgen.identification.quality import SEED, TAILS, correlation_time
from hystgen.identification.reduction import Reduced
from hystgen.plays import operators

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

POLISHED = 1e-5
"""A search ends after a step that lowers the error by less than this fraction, far below any difference that
matters."""

COARSE = 1e-3
"""[fraction of the error] The same limit for a search that only ranks shapes or shows whether to continue: far below
`BETTER`. For any value from 1e-4 to 1e-2, eight cases of `benchmarks.second_plants` (seeds 29000 on) yield the same
effect names, and errors within 0.5 %."""

CROSSINGS = 2
"""[changes of side] A start component that moves from one limit past the other is then measured from the other; after
the second change it stays there, so that the search for components at a limit ends. With 1, fits to 3 of 600 pairs of
records with two nearly equal time constants ended up to 8e-4 above the smallest error; with 2, 4 and 8, none more than
1e-6 (`test_start_transients::test_nearly_equal_responses`, seeds 0 to 599)."""

RESTARTS = 4
"""[searches] Maximum number of searches for start memories with the same effects. Another search follows only if the
last one lowered the error by `BETTER`, so this number only bounds the time."""


class _Block:
    """A record's part of the system linearised about a shape and weights: plays and measured output, then derivatives.

    The factors of the free components are within the limits of `Actuator.largest`, each a fraction `most` of the sum of
    the weights. A component that would exceed its limit is written as `side most (sum p - slack)` with `slack >= 0`, so
    that the limit follows the weights in the same linear system. The reflections of the reduction are kept, so that the
    derivatives can be reduced separately later. `like`: the actuator whose components are free, if not `here`.
    """

    def __init__(self, here: Actuator, item: Item, p: Array, like: Actuator | None = None) -> None:
        self._here, self._item, self._p = here, item, p
        self._level = np.zeros(1)
        self._offset = None
        rows, constant = here.columns(item)
        h = operators.weighted_sum(p, rows) + constant
        measured = item.y[item.compared]
        if here.bends:
            self._level, moved, begun = here.level(h, item, p)
            self._offset = here.compared(moved, item)
            bent = here.mapped(h, self._level, item.run)
            step = item.step(h)
            slope = (here.mapped(h + step, self._level, item.run) - bent) / step
            moves = np.ptp(here.compared(rows, item), axis=1)
            rows = here.compared(rows * slope, item)
            rows[moves <= pi.STILL * moves[0]] = 0.0  # offsets: the derivative of the free one differs by rounding
            h = here.compared(bent, item)
            target = measured - h + p @ rows + begun
        else:
            target = measured - constant
        added = here.added(item.run)[item.compared]
        self._sum = h + added
        self.samples = len(h)
        free = (like or here).nuisances(item, self._offset)
        self._free = len(free)
        most = (like or here).largest(item, np.ones(1))
        self._limited = np.isfinite(most)
        self._most = np.where(self._limited, most, 0.0)
        self._factors, self._side = np.zeros(len(free)), np.zeros(len(free))
        self._crossed = np.zeros(len(free), dtype=np.intp)
        self.held = self.slack = np.zeros(len(free), dtype=bool)
        table = np.empty((len(free) + len(rows) + 1, len(h))).T
        table[:, : len(free)] = free.T
        table[:, len(free) : -1] = rows.T
        table[:, -1] = target - added
        self._reduced = [reduction.reflected(part) for part in self._cut(table)]
        self._whole = _stacked([part.triangle for part in self._reduced])

    def _cut(self, table: Array) -> list[Array]:
        """Chunks of a few thousand samples, which stay in the cache while they are reduced."""
        if len(table) <= reduction.CHUNK:
            return [table]
        return [table[k : k + reduction.CHUNK] for k in range(0, len(table), reduction.CHUNK)]

    def system(self, varied: Sequence[Actuator] = ()) -> Array:
        """The triangle of plays, measured output and derivatives, without the free components of the record."""
        if not varied:
            return self._behind(self._whole, self.held)
        table = np.empty((len(varied), self.samples)).T
        sums: Sums = {}
        starting = self._here.starting(self._item)
        others = [other.starting(self._item) != starting for other in varied]
        begun = self._begun(self._here) if any(others) else 0.0
        for j, other in enumerate(varied):
            table[:, j] = (self._of(other, sums) - self._sum) / DIFFERENCE
            if others[j]:
                table[:, j] += (self._begun(other) - begun) / DIFFERENCE
        parts = zip(self._reduced, self._cut(table), strict=True)
        return self._behind(_stacked([part.extended(columns) for part, columns in parts]), self.held)

    def _of(self, other: Actuator, sums: Sums) -> Array:
        """The prediction with other parameters, and the same weights and offset."""
        rows, constant = other.columns(self._item, self._p, sums)
        moved = rows[0] + constant
        if other.bends:
            moved = other.compared(other.mapped(moved, self._level, self._item.run), self._item)
        return np.asarray(moved + other.added(self._item.run)[self._item.compared])

    def _begun(self, other: Actuator) -> Array:
        """The response to the start state with other parameters; a factor at its limit follows the limit."""
        free = other.nuisances(self._item, self._offset)
        if len(free) != self._free:  # a different spectrum may have a different number of states
            return self._begun(self._here)
        held, factors = self.held, self._factors
        if held.any():
            factors = factors.copy()
            factors[held] = self._side[held] * other.largest(self._item, self._p)[held]
        return np.asarray(factors[1:] @ free[1:])

    def opened(self) -> Array:
        """The triangle of plays, slacks and measured output: a component beyond its limit is free up to that limit."""
        slack = np.flatnonzero(self.slack)
        columns = self._whole[:, slack] * -(self._side * self._most)[slack]
        at = self._free + len(self._p)
        whole = np.concatenate([self._whole[:, :at], columns, self._whole[:, at:]], axis=1)
        return self._behind(whole, self._side != 0.0)

    def limit(self, p: Array, slacks: Array) -> bool:
        """Accept the weights and slacks that solve `opened`. Returns whether a component is then beyond its limits."""
        if self._free == 1:  # an offset, which has no limit
            return False
        total, first = float(np.sum(p)), self._whole[: self._free]
        slack = np.zeros(self._free)
        slack[self.slack] = slacks
        self.held = (self._side != 0.0) & (slack == 0.0)
        self._factors = self._side * self._most * (total - slack)
        free = np.flatnonzero(self._side == 0.0)
        rest = first[:, -1] - first[:, self._free : -1] @ p - first[:, : self._free] @ self._factors
        self._factors[free] = np.linalg.lstsq(first[:, free], rest, rcond=RANK)[0]
        beyond = self._limited & (self._side == 0.0) & (np.abs(self._factors) > self._most * total)
        opposite = slack > 2.0 * total
        self._side = np.where(beyond, np.sign(self._factors), np.where(opposite, -self._side, self._side))
        self._crossed = self._crossed + opposite
        self.slack = (self.slack | beyond) & (self._crossed < CROSSINGS)
        return bool(np.any(beyond | opposite))

    def _behind(self, whole: Array, limited: Bools) -> Array:
        """The triangle without the free components; those at a limit follow the weights and are added to the plays."""
        n = self._free
        if limited.any():
            carried = whole[:, :n][:, limited] @ (self._side * self._most)[limited]
            plays = whole[:, n : n + len(self._p)] + carried[:, None]
            rest = whole[:, n + len(self._p) :]
            whole = reduction.triangle(np.concatenate([whole[:, :n][:, ~limited], plays, rest], axis=1))
            n -= int(np.count_nonzero(limited))
        return whole[n:, n:]


def _stacked(triangles: Sequence[Array]) -> Array:
    return triangles[0] if len(triangles) == 1 else reduction.triangle(*triangles)


def _solved(blocks: Sequence[_Block], plays: int) -> tuple[Array, Array]:
    """The system of all records and its best weights, with the free components of each record within their limits.

    A component found beyond a limit is given a slack from it, solved for with the weights (nnls), until none is beyond
    its limit. The iteration terminates, since a component keeps its slack until it has changed sides `CROSSINGS` times.
    """
    whole = reduction.triangle(*(block.system() for block in blocks))
    solution = pi.non_negative(whole, np.arange(plays))
    while np.isfinite(whole).all():
        ends = plays + np.cumsum([0, *(int(np.count_nonzero(block.slack)) for block in blocks)])
        slacks = [solution[ends[k] : ends[k + 1]] for k in range(len(blocks))]
        beyond = [block.limit(solution[:plays], slack) for block, slack in zip(blocks, slacks, strict=True)]
        if not any(beyond):
            break
        solution = _open(blocks, plays)
    if any(block.held.any() for block in blocks):
        whole = reduction.triangle(*(block.system() for block in blocks))
    return whole, solution[:plays]


def _open(blocks: Sequence[_Block], plays: int) -> Array:
    """The best weights, followed by the slacks of each record in turn."""
    opened = [block.opened() for block in blocks]
    last, parts = plays + sum(each.shape[1] - plays - 1 for each in opened), []
    at = plays
    for each in opened:
        slacks = each.shape[1] - plays - 1
        part = np.zeros((len(each), last + 1))
        part[:, [*range(plays), *range(at, at + slacks), last]] = each
        parts.append(part)
        at += slacks
    return pi.non_negative(reduction.triangle(*parts), np.arange(last))


def linear(structure: Structure, items: Sequence[Item], shape: Array, p: Array) -> LocalFit:
    """The best weights of a shape, and the system linearised about the shape and about weights `p` close to them."""
    n1 = len(structure.thresholds)
    here = structure.actuator(shape)
    try:
        blocks = [_Block(here, item, p) for item in items if item.known.any()]
    except NotFiniteError:
        return LocalFit(shape, p, math.inf, p, 1, lambda: Reduced(structure.thresholds, np.empty((0, 0)), (), ()))
    samples = sum(block.samples for block in blocks)

    def derived() -> Reduced:
        varied = structure.varied(shape, here)
        whole = reduction.triangle(*(block.system(varied) for block in blocks))
        measured_last = [*range(n1), *range(n1 + 1, whole.shape[1]), n1]
        return Reduced(structure.thresholds, whole[:, measured_last], (), (samples,))

    whole, best = _solved(blocks, n1)
    if not np.isfinite(whole).all():  # the parameters are far from reasonable values
        return LocalFit(shape, p, math.inf, p, samples, derived)
    rms = root_mean_square(pi.residual(whole, np.arange(n1), best), samples)
    return LocalFit(shape, p, rms, best, samples, derived)


@dataclass(frozen=True)
class Fitted:
    """A structure with its parameters and weights, and the rms error of the fit."""

    structure: Structure
    shape: Array
    weights: Array
    rms: float

    @property
    def actuator(self) -> Actuator:
        """The actuator of the shape."""
        return self.structure.actuator(self.shape)

    @property
    def reach(self) -> float:
        """The largest threshold, input units."""
        return float(self.structure.thresholds[-1])

    @property
    def bare(self) -> bool:
        """Whether there is neither a front nor an effect."""
        return not self.structure.parts and not self.actuator.stages

    def errors(self, items: Sequence[Item], like: Fitted | None = None) -> list[Array]:
        """Error signals over records; `like`: with the free components of another model."""
        actuator = self.actuator
        other = None if like is None else (like.actuator, like.weights)
        return [actuator.error(item, self.weights, other) for item in items]


def part_at_an_end(fitted: Fitted, k: int) -> bool:
    """Whether a parameter of a part is at an end of its usual range or beyond it."""
    return bool(ends_of(fitted.structure.parts[k].ordinary, fitted.structure.pieces(fitted.shape)[1][k]))


def ends_of(candidate: Candidate, numbers: Array) -> list[tuple[int, bool]]:
    """Indices of the parameters at or beyond an end of a candidate's range, and whether that is the upper end.

    A lower end of 0 does not count, since one of several parts may be absent.
    """
    low, high = (numbers <= candidate.low) & (candidate.low != 0.0), numbers >= candidate.high
    return [(j, bool(high[j])) for j in np.flatnonzero(low | high).tolist()]


@dataclass(frozen=True, eq=False)
class Search:
    """The state of a search for the parameters of a structure, from which it can continue."""

    structure: Structure
    items: Sequence[Item]
    now: LocalFit
    damping: float = joint.DAMPING

    def further(self, steps: int = joint.MOST_STEPS, little: float = POLISHED) -> Search:
        """The search after at most `steps` more steps, or after one that lowers the error by less than `little`."""
        now, damping = joint.search(
            lambda shape, p: linear(self.structure, self.items, shape, p),
            self.structure,
            self.now,
            steps,
            little,
            self.damping,
        )
        return replace(self, now=now, damping=damping)

    def found(self, otherwise: Array) -> Fitted:
        """The fit; `otherwise`: its weights if the weights cannot be solved for with these parameters."""
        best = self.now.best if math.isfinite(self.now.rms) else otherwise
        return Fitted(self.structure, self.now.shape, best, self.now.rms)


def begun(structure: Structure, items: Sequence[Item], start: Array, p: Array) -> Search:
    """A search at its start; `p`: weights close to the best ones."""
    return Search(structure, items, linear(structure, items, np.clip(start, *structure.bounds), p))


def fit(structure: Structure, items: Sequence[Item], start: Array, p: Array) -> Fitted:
    """The fit at the end of a search from a start; `p`: weights close to the best ones."""
    return begun(structure, items, start, p).further().found(p)


def on_equal_terms(fitted: Fitted, other: Fitted, items: Sequence[Item]) -> Fitted:
    """A fit whose weights are solved for again, with the free start states of another fit."""
    here, like = fitted.actuator, other.actuator
    blocks = [_Block(here, item, fitted.weights, like) for item in items if item.known.any()]
    whole, best = _solved(blocks, len(fitted.weights))
    return replace(fitted, weights=best) if np.isfinite(whole).all() else fitted


# Start memories in the presence of effects -------------------------------------------------------------------


def restarted(fitted: Fitted, items: Sequence[Item], quick: Sequence[Item]) -> Fitted:
    """The fit with start memories found in the presence of its effects, for records with a memory but no history.

    A memory found without the effects includes part of their response. Here, the plays with their known weights only
    have to explain the output minus that response (`start.of_model`). The parameters are then refitted to `quick`, and
    both steps are repeated until the error no longer falls by `BETTER`.
    """
    if not any(map(restarts, items)):
        return fitted
    for _ in range(RESTARTS):
        found = dict(fitted.structure.starts)
        for item in items:
            if item.turns is not None and restarts(item):
                found[item.turns] = _turns(fitted, item) or found.get(item.turns, item.turns)
        structure = replace(fitted.structure, starts=tuple(found.items()))
        if structure.starts == fitted.structure.starts:
            break
        search = begun(structure, quick, fitted.shape, fitted.weights)
        if not search.now.rms < fitted.rms:  # the new memories do not help
            break
        search = search.further(little=COARSE)
        if not search.now.rms < (1.0 - acceptance.BETTER) * fitted.rms:
            break
        fitted = search.further().found(fitted.weights)
    return fitted


def restarts(item: Item) -> bool:
    """Whether a record's start memory was found without a history, and may change with the effects."""
    return item.history is None and item.turns is not None


def _turns(fitted: Fitted, item: Item) -> Turns | None:
    """Drive values that bring virgin plays to the start memory that fits an item best; None if none is found."""
    actuator, r, p = fitted.actuator, fitted.structure.thresholds, fitted.weights
    seen = actuator.course(item, actuator.error(item, p))
    alone = replace(seen, y=seen.y + reduction.prediction(seen.v, seen.history, r, p), history=None)
    (found,) = start.of_model([alone], (), r, p, 1.0)
    return None if found.start is None else start.in_front(found.start.turns, actuator.stages)


def invertible(fitted: Fitted, items: Sequence[Item], floor: float) -> tuple[Fitted, pi.Weights]:
    """A hypothesis and its weights, with p_0 raised to `floor` times the sum of the weights if the records allow it.

    As in `identify` (`pi.fit_weights`); all other parameters are unchanged.
    """
    p, here = fitted.weights, fitted.actuator
    kept = pi.Weights(p, fitted.rms)
    if len(p) < 2 or p[0] >= floor * float(np.sum(p)):
        return fitted, kept
    blocks = [_Block(here, item, p) for item in items if item.known.any()]
    whole, _ = _solved(blocks, len(p))
    samples = sum(block.samples for block in blocks)
    system = Reduced(fitted.structure.thresholds, whole, (), (samples,))
    made = pi.fit_weights(system, np.arange(len(p)), floor)
    if made.free_p0 is None:
        return fitted, kept
    return replace(fitted, weights=made.p, rms=made.rms), replace(made, free_p0=float(p[0]))


# 95 % intervals for the parameters, from the system linearised at the fit ------------------------------------


DRAWS = 400
"""Random shapes per interval; the interval's ends then scatter by 0.13 standard deviations."""

HALVINGS = 20
"""Bisections between the fitted shape and an inadmissible one, down to a millionth of an interval's width."""

WEAKEST = 1e-9
"""Singular values below this fraction of the largest are raised to it, since their directions are undetermined."""

Numbers = Mapping[str, object]


@dataclass(frozen=True)
class Sure:
    """Ends of every parameter's interval, keyed as in the entries, for the front's stage and for each part."""

    front: dict[str, object]
    parts: tuple[dict[str, object], ...]

    def of(self, fitted: Fitted, name: str, later: int) -> dict[str, object]:
        """The intervals of an effect; `later`: number of effects with its name found after it."""
        k = place(fitted, name, later)
        return self.front if k is None else self.parts[k]


def place(fitted: Fitted, name: str, later: int) -> int | None:
    """The part of an effect, None for a front; `later`: number of effects with its name found after it."""
    parts = [k for k, part in enumerate(fitted.structure.parts) if part.name == name]
    return parts[-1 - later] if later < len(parts) else None


def intervals(fitted: Fitted, items: Sequence[Item]) -> Sure:
    """95 % intervals of the parameters of the effects and of the front.

    The covariance is `s^2 tau (J^T J)^-1` (Seber and Wild, Nonlinear Regression, 1989, section 2.1), with J the
    Jacobian of the free-run error with respect to weights and parameters together, zero weights kept at zero; `tau`,
    the correlation time of the residuals in samples, converts their number to an effective one. The intervals come from
    shapes drawn with this covariance and kept within the bounds.
    """
    shape, p = fitted.shape, fitted.weights
    front = len(fitted.structure.front.straight)
    if not len(shape):
        return Sure({}, tuple({} for _ in fitted.structure.parts))
    system = linear(fitted.structure, items, shape, p).system.whole
    n1 = len(p)
    active = np.flatnonzero(np.append(p > 0.0, np.ones(len(shape), dtype=bool)))
    _, singular, right = np.linalg.svd(system[:, active], full_matrices=False)
    inverse = 1.0 / np.maximum(singular, WEAKEST * singular[0])
    # only the parameters' part of the covariance is needed; its triangular root with a positive diagonal is unique,
    # unlike singular vectors, whose signs and order depend on the library and would change the draws
    root = np.asarray(np.linalg.qr((right.T * inverse)[np.count_nonzero(active < n1) :].T, mode="r"))
    root = root * np.where(np.diag(root) < 0.0, -1.0, 1.0)[:, None]
    errors = fitted.errors(items)
    inside = [e[np.isfinite(e)] for e in errors]
    inside = [e for e in inside if len(e)]
    samples = sum(map(len, inside))
    tau = sum(correlation_time(e) * len(e) for e in inside) / max(samples, 1)
    sigma = fitted.rms * float(np.sqrt(tau * samples / max(samples - len(active), 1)))
    drawn = np.random.default_rng(SEED).standard_normal((DRAWS, len(root))) @ root
    low, high = fitted.structure.bounds
    shapes = [_admissible(fitted, one) for one in np.clip(shape + sigma * drawn, low, high)]
    of_front: dict[str, object] = {}
    if front:
        made = [stage(fitted, one) for one in shapes]
        of_front = _spread(made, stage(fitted, shape))
    found: list[dict[str, object]] = []
    for k, part in enumerate(fitted.structure.parts):
        if not len(part.candidate.start):
            found.append({})
            continue
        numbers = [fitted.structure.pieces(one)[1][k] for one in shapes]
        made = [entry(part.candidate.build(each)) for each in numbers]
        found.append(_spread(made, entry(part.candidate.build(fitted.structure.pieces(shape)[1][k]))))
    return Sure(of_front, tuple(found))


def _admissible(fitted: Fitted, drawn: Array) -> Array:
    """The last admissible shape on the line from the fitted one to a drawn one."""
    limits, found = fitted.structure, fitted.shape
    least = np.minimum(limits.slack(found), 0.0)
    if np.all(limits.slack(drawn) >= least):
        return drawn
    inside, outside = 0.0, 1.0
    for _ in range(HALVINGS):
        share = 0.5 * (inside + outside)
        if np.all(limits.slack(found + share * (drawn - found)) >= least):
            inside = share
        else:
            outside = share
    return np.asarray(found + inside * (drawn - found))


def stage(fitted: Fitted, shape: Array) -> dict[str, object]:
    """The last stage of the front as in a parameter file; empty without a front."""
    stages = fitted.structure.front.stages(fitted.structure.pieces(shape)[0])
    return dict(stage_content(stages[-1])) if stages else {}


def entry(effect: Effect) -> dict[str, object]:
    """The keys of an effect as in a parameter file, without the name."""
    return {key: value for key, value in effect.model_dump(exclude_defaults=True).items() if key != "name"}


def _spread(made: Sequence[Numbers], at: Numbers) -> dict[str, object]:
    """`[low, high]` for each key that varies; for a list or a mapping, the same for its entries."""
    found = {key: _interval([each.get(key) for each in made], value) for key, value in at.items()}
    return {key: sure for key, sure in found.items() if sure}


def _interval(values: Sequence[Any], at: Any) -> object:
    if isinstance(at, bool | str) or any(value is None for value in values):
        return None
    if isinstance(at, Mapping):
        return _spread(values, at)
    if isinstance(at, list | tuple):
        if any(len(value) != len(at) for value in values):
            return None
        found = [_interval([value[k] for value in values], one) for k, one in enumerate(at)]
        return [sure or [one, one] for sure, one in zip(found, at, strict=True)] if any(found) else None
    low, high = np.quantile(np.array(values, dtype=np.float64), TAILS)
    return [float(low), float(high)] if low < high else None
