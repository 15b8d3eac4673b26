"""A model brought up to date with sessions in service, as far as these show its parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import percent
from hystgen.diagnosis.data.items import Item, rms
from hystgen.diagnosis.search import fits
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.hypothesis import NotFiniteError, Part, Structure, near
from hystgen.identification import pi, quality
from hystgen.identification.joint import Kept
from hystgen.identification.pi import IdentificationError
from hystgen.identification.quality import correlation_time
from hystgen.model import Model
from hystgen.parameters.files import dump_parameters, make_parameters
from hystgen.parameters.schema import Parameters
from hystgen.service.sessions import ServiceSession

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

PRIOR = 1.0
"""[of its own size] Standard deviation of each weight before the sessions are seen: service at most halves or doubles
it. Parameters of effects vary by as much, as a logarithm."""

STEPS = 6
"""Number of linearised steps at most. Weights take one, since the motion is linear in them, and a second that follows
the noise; a parameter of an effect that halves or doubles takes up to five."""

ENOUGH = 1e-3
"""[standard deviations] Steps end when no parameter moves by more."""

SURE = 0.01
"""[probability] Each weight of its own is fitted only if noise would mimic its gain over a common factor less often."""

MOST_OF = 0.5
"""[fraction of the model's motion] A common factor of all weights is fitted only if the sessions move over more: the
weights that they do not show would otherwise be most of what it changes."""


@dataclass(frozen=True)
class RefinedNumber:
    """A parameter: its old and new value and the 95 % interval of the new one; `shown`: whether the sessions say more
    about it than that it is roughly as before."""

    name: str
    old: float
    new: float
    interval: tuple[float, float]
    shown: bool

    @property
    def moved(self) -> bool:
        """Whether the interval excludes the old value."""
        return self.shown and not self.interval[0] <= self.old <= self.interval[1]


@dataclass(frozen=True, repr=False)
class Refined:
    """A model brought up to date: its `parameters`, every number that was free, and the rms residual of the sessions,
    in output units, with the old and with the new model."""

    parameters: Parameters
    numbers: tuple[RefinedNumber, ...]
    before: float
    after: float
    remarks: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<Refined {self.parameters.name}: {sum(each.moved for each in self.numbers)} parameters moved>"

    @property
    def model(self) -> Model:
        """The new model."""
        return Model(self.parameters)

    def sentence(self) -> str:
        """What moved, in a sentence."""
        u = f" {self.parameters.units.output}".rstrip()
        moved = [each.name for each in self.numbers if each.moved]
        return f"Moved: {', '.join(moved)}. The rms residual of the sessions goes from {self.before:.3g}{u} to " \
            f"{self.after:.3g}{u}."

    def rows(self) -> list[tuple[str, ...]]:
        """A table: a header, then old value, new value and interval of every parameter."""
        found: list[tuple[str, ...]] = [("parameter", "old", "new", "95 % from", "to", "")]
        for each in self.numbers:
            said = "moved" if each.moved else "as before" if each.shown else "not shown, kept"
            low, high = (f"{x:.5g}" for x in each.interval) if each.shown else ("", "")
            found.append((each.name, f"{each.old:.5g}", f"{each.new:.5g}", low, high, said))
        return found

    def table(self) -> str:
        """The table that the command prints."""
        rows = self.rows()
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows]
        return "\n".join([*lines, *self.remarks, self.sentence()])

    def text(self) -> str:
        """The parameter file."""
        said = [f"Refined by hystgen from sessions in service. {self.sentence()}", *self.remarks]
        return dump_parameters(self.parameters, header="\n".join(said))


@dataclass(frozen=True)
class _Fit:
    """A solution: parameters (weights, then shape), their standard deviations, the sum of the squared errors that are
    left, and the standard deviation of white noise with the same effect."""

    values: Array
    sure: Array
    squares: float
    noise: float


@dataclass(frozen=True)
class _Problem:
    """The model's structure, its parameters as they were, and the sessions."""

    structure: Structure
    items: Sequence[Item]
    old: Array
    prior: Array

    @property
    def plays(self) -> int:
        """Number of weights."""
        return len(self.structure.thresholds)

    def fitted(self, values: Array) -> Fitted:
        """The model with these parameters."""
        return Fitted(self.structure, values[self.plays :], values[: self.plays], 0.0)

    def system(self, values: Array) -> Array:
        """Rows whose squares are the errors of the sessions linearised about these parameters; the last column is
        the measured output, so the parameters themselves are the unknowns."""
        n = self.plays
        local = fits.linear(self.structure, self.items, values[n:], values[:n])
        if not math.isfinite(local.rms):
            raise IdentificationError("the model gives no finite output on these sessions")
        whole = np.array(local.system.whole)
        whole[:, -1] += whole[:, n:-1] @ values[n:]
        return whole

    def noise(self, values: Array) -> float:
        """Standard deviation of the errors if they were white with the same effect: `rms sqrt(tau)`."""
        errors = self.fitted(values).errors(self.items)
        known = [e[np.isfinite(e)] for e in errors]
        number = sum(map(len, known))
        tau = sum(correlation_time(e) * len(e) for e in known) / number
        return max(rms(errors) * math.sqrt(tau), 1e-300)

    def solve(self, free: Bools, common: bool = False) -> _Fit:
        """The parameters that fit the sessions best, with the prior; those not `free` stay. `common`: one factor for
        all weights in place of every weight. Raises IdentificationError."""
        from scipy.optimize import lsq_linear

        n, at = self.plays, self.old.copy()
        directions = np.eye(len(at))[:, free]
        if common:
            directions = np.where(np.arange(len(at)) < n, self.old, 0.0)[:, None]
        width = self.prior[free] if not common else np.array([PRIOR])
        low, high = self.structure.bounds
        low, high = np.concatenate([np.zeros(n), low]), np.concatenate([np.full(n, np.inf), high])
        ends = low[free] - self.old[free], high[free] - self.old[free]
        if common:
            ends = -np.ones(1), np.full(1, np.inf)
        for _ in range(STEPS):
            whole, noise = self.system(at), self.noise(at)
            table = np.concatenate([whole[:, :-1] @ directions / noise, np.diag(1.0 / width)])
            target = np.concatenate([(whole[:, -1] - whole[:, :-1] @ self.old) / noise, np.zeros(len(width))])
            found = lsq_linear(table, target, (np.minimum(ends[0], 0.0), np.maximum(ends[1], 1e-12)), method="bvls").x
            new = self.old + directions @ found
            covariance = np.linalg.inv(table.T @ table)
            spread = np.sqrt(np.einsum("ij,jk,ik->i", directions, covariance, directions))
            step = float(np.max(np.abs(new - at) / np.maximum(spread, 1e-300), where=spread > 0.0, initial=0.0))
            at = new
            if step < ENOUGH:
                break
        squares = sum(float(np.nansum(e**2)) for e in self.fitted(at).errors(self.items))
        return _Fit(at, spread, squares, noise)


def refine(model: Model, sessions: Sequence[ServiceSession]) -> Refined:
    """The model with the parameters that the sessions show; the others stay.

    Weights and parameters of effects are fitted about their old values, with these as a prior: a parameter is shown if
    the sessions say more about it than the prior does, with the correlation of the residual counted. One factor for all
    weights is preferred to every weight of its own. The offset stays, since every session has its own zero. Raises
    IdentificationError if nothing is shown, or nothing moved.
    """
    cascade = model.cascade
    structure = Structure(
        np.array(cascade.pi.thresholds), Kept(cascade.stages),
        tuple(Part(effect.name, near(effect), firm=True) for effect in model.effects),
    )
    old = np.concatenate([cascade.pi.weights, structure.start])
    plays = len(structure.thresholds)
    prior = np.concatenate([PRIOR * old[:plays], np.full(len(old) - plays, PRIOR * math.log(2.0))])
    problem = _Problem(structure, [each.item for each in sessions], old, prior)
    try:
        return _refined(model, problem, sessions)
    except NotFiniteError:
        raise IdentificationError("the model gives no finite output on these sessions") from None


def _refined(model: Model, problem: _Problem, sessions: Sequence[ServiceSession]) -> Refined:
    old, plays = problem.old, problem.plays
    able = problem.prior > 0.0
    whole = problem.solve(able)
    shown = able & (whole.sure < math.sqrt(0.5) * problem.prior)
    moves = max(float(np.ptp(each.expected[each.known])) for each in sessions)
    full = model.simulate(np.array([*model.cascade.input_range, model.cascade.input_range[0]]))
    wide = moves > MOST_OF * float(np.ptp(np.asarray(full)))
    if not wide and not shown.any():
        raise IdentificationError(_refusal(model, sessions, "show no parameter of the model"))
    each_fit = problem.solve(shown) if shown.any() else None
    factor = problem.solve(np.zeros(len(old), dtype=bool), common=True) if wide else None
    if factor is not None and (each_fit is None or not _better(each_fit, factor, int(np.count_nonzero(shown)) - 1)):
        chosen, numbers = factor, [_common(old, factor, plays)]
    else:
        assert each_fit is not None
        chosen, numbers = each_fit, _singly(problem, each_fit, shown, able)
    if not any(each.moved for each in numbers):
        what = "show no parameter that moved beyond its interval"
        raise IdentificationError(f"these sessions {what}; keep the model" if wide else _refusal(model, sessions, what))
    parameters = _parameters(model, problem, chosen)
    before, after = (rms(problem.fitted(x).errors(problem.items)) for x in (old, chosen.values))
    if after > before:
        raise IdentificationError("a refit leaves more of the sessions than the model as it is; keep the model")
    return Refined(parameters, tuple(numbers), before, after, tuple(_unshown(problem, shown, able, chosen is factor)))


def _refusal(model: Model, sessions: Sequence[ServiceSession], what: str) -> str:
    low, high = model.cascade.input_range
    span = max(float(np.ptp(each.item.run.v[each.known])) for each in sessions)
    return (
        f"these sessions {what}: their drives move over {percent(span / (high - low), of='the input range')} at most; "
        "record a session with moves over the whole range"
    )


def _better(one: _Fit, other: _Fit, more: int) -> bool:
    """Whether a fit with `more` further parameters leaves less than noise explains (likelihood ratio)."""
    from scipy.stats import chi2

    return more > 0 and bool(chi2.sf((other.squares - one.squares) / one.noise**2, more) < SURE)


def _common(old: Array, found: _Fit, plays: int) -> RefinedNumber:
    """The common factor of all weights, as a number of its own."""
    k = int(np.argmax(old[:plays]))
    factor, sure = float(found.values[k] / old[k]), float(found.sure[k] / old[k])
    return RefinedNumber("gain (all weights)", 1.0, factor, (factor - 1.96 * sure, factor + 1.96 * sure), True)


def _singly(problem: _Problem, found: _Fit, shown: Bools, able: Bools) -> list[RefinedNumber]:
    numbers = []
    for k in range(problem.plays):
        if able[k]:
            value, sure = float(found.values[k]), float(found.sure[k])
            ends = max(value - 1.96 * sure, 0.0), value + 1.96 * sure
            name = f"weight at r = {problem.structure.thresholds[k]:.4g}"
            numbers.append(RefinedNumber(name, float(problem.old[k]), value, ends, bool(shown[k])))
    at = problem.plays
    for part in problem.structure.parts:
        for j in range(len(part.candidate.start)):
            value, sure = float(found.values[at]), float(found.sure[at])
            ends = math.exp(value - 1.96 * sure), math.exp(value + 1.96 * sure)
            numbers.append(RefinedNumber(f"{part.name}, factor {j + 1}", 1.0, math.exp(value), ends, bool(shown[at])))
            at += 1
    return numbers


def _unshown(problem: _Problem, shown: Bools, able: Bools, common: bool) -> list[str]:
    """What the sessions do not show, and which session would."""
    hidden = [float(r) for r, a, b in zip(problem.structure.thresholds, able, shown, strict=False) if a and not b]
    if not hidden or common:
        return []
    return [
        f"The weights of {len(hidden)} plays stay as they were, since these sessions do not show each of them; moves "
        f"of various sizes up to {2.0 * max(hidden):.3g} in the drive would."
    ]


def _parameters(model: Model, problem: _Problem, found: _Fit) -> Parameters:
    given, shape = model.parameters, found.values[problem.plays :]
    content = given.model_dump()
    weights = [pi.rounded(float(x), pi.WEIGHT_DIGITS) for x in found.values[: problem.plays]]
    content["model"]["pi"] = {
        **{k: v for k, v in content["model"]["pi"].items() if k not in ("density", "thresholds", "weights")},
        "thresholds": problem.structure.thresholds.tolist(), "weights": weights,
    }
    content["model"]["effects"] = [{"name": e.name, **fits.entry(e)} for e in problem.structure.effects(shape)]
    errors = problem.fitted(found.values).errors(problem.items)
    step = float(np.median(np.diff(problem.items[0].run.t))) if all(item.timed for item in problem.items) else None
    stated = quality.residual(errors, step)
    content["residual"] = None if stated is None else stated.model_dump()
    return make_parameters(content, user_effects=[type(e) for e in model.effects if ":" in e.name])
