"""Free responses to an unknown start state, with limited factors, in the fit of a hypothesis."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import brute_output, wander
from scipy.optimize import nnls

from hystgen.basics import jit
from hystgen.diagnosis.data.items import Item, rms
from hystgen.diagnosis.search import fits
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.hypothesis import Part, Structure, kept
from hystgen.effects.base import Candidate, Run
from hystgen.effects.creep.model import ExponentialCreep
from hystgen.effects.sensor_nonlinearity.model import SensorPolynomial
from hystgen.identification.joint import Kept

Array = NDArray[np.float64]

THRESHOLDS = np.array([0.0, 10.0, 25.0])
"""[V] of plays that move in a drive of 100 V"""

TAUS, SHARES = (0.1, 0.7), (0.03, 0.02)
"""[s] and [of the play sum], of creep: records of 2 s show both time constants; the shares are usual for stages."""

NOISE = 0.2
"""[output units] of the records, a fifth of a per cent of their range: a missed limit costs far more."""

SPAN = 2.0
"""[times the drive range] Span from which the start state may come, as in `START_SPAN`."""


def _creep(x: Array) -> ExponentialCreep:
    return ExponentialCreep(name="creep", time_constants=tuple(10.0 ** x[:2]), weights=tuple(x[2:]))


CREEP = Part(
    "creep",
    Candidate(
        "two states", np.array([-3.0, -3.0, 0.0, 0.0]), np.array([2.0, 2.0, 1.0, 1.0]),
        np.array([*np.log10(TAUS), *SHARES]), _creep, np.array([*np.log10(TAUS), 0.0, 0.0]), amounts=(2, 3),
    ),
)  # fmt: skip
STRUCTURE = Structure(THRESHOLDS, Kept(), (CREEP,))


def items(strength: float, seed: int) -> list[Item]:
    """Two records that begin with a response `strength` times the largest that creep allows, of either sign."""
    found = []
    rng = np.random.default_rng(seed)
    for k, sign in enumerate((1.0, -1.0)):
        v = wander(seed + 10 * k)[:400]
        run = Run(np.arange(len(v)) * 5e-3, v, {})
        h = _played(v, run.t, np.array([1.0, 0.5, 0.3]), _creep(CREEP.candidate.start))
        start = sign * strength * SPAN * np.ptp(v) * 1.8 * SHARES[k] * np.exp(-run.t / TAUS[k])
        found.append(Item(f"r{k}", run, h + start + rng.normal(0.0, NOISE, len(v)), None, 100.0, turns=(0.0,)))
    return found


def dense(records: list[Item], effect: ExponentialCreep, present: bool = True) -> tuple[Array, Array]:
    """Weights and errors of the same problem by another formulation; `present`: the effect itself, not its start alone.

    `|f_i| <= k_i sum p` with `p >= 0` is a cone, whose edges have one play and every `f_i` at one of its limits: the
    solution is a non-negative sum of them, and of offsets of both signs.
    """
    n1, taus = len(THRESHOLDS), np.array(effect.time_constants)
    blocks, responses, limits = [], [], []
    for item in records:
        alone = [np.eye(n1)[j] for j in range(n1)]
        shown = effect if present else effect.model_copy(update={"weights": (0.0,) * len(taus)})
        blocks.append(np.stack([_played(item.run.v, item.run.t, p, shown) for p in alone], axis=1))
        responses.append(np.exp(-item.run.t[:, None] / taus))
        limits.append(SPAN * np.ptp(item.run.v) * np.array(effect.weights))
    ends = np.cumsum([0, *(len(item.y) for item in records)])
    plays, offsets = np.concatenate(blocks), np.zeros((ends[-1], len(records)))
    start = np.zeros((ends[-1], len(records) * len(taus)))
    for k, response in enumerate(responses):
        offsets[ends[k] : ends[k + 1], k] = 1.0
        start[ends[k] : ends[k + 1], k * len(taus) : (k + 1) * len(taus)] = response * limits[k]
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=start.shape[1])))
    edges = np.concatenate([plays[:, [j]] + start @ corners.T for j in range(n1)], axis=1)
    table = np.concatenate([edges, offsets, -offsets], axis=1)
    y = np.concatenate([item.y for item in records])
    solution, _ = nnls(table, y, maxiter=100 * table.shape[1])
    return solution[: n1 * len(corners)].reshape(n1, -1).sum(axis=1), y - table @ solution


def _played(v: Array, t: Array, p: Array, effect: ExponentialCreep) -> Array:
    """The output of plays and creep, step by step: `x` follows a drive that is straight between two samples."""
    h = brute_output(v, tuple(THRESHOLDS), tuple(p), 0.0)
    y, dt = h.copy(), np.diff(t)
    for tau, weight in zip(effect.time_constants, effect.weights, strict=True):
        x = h[0]
        for k, step in enumerate(dt):
            a, slope = np.exp(-step / tau), (h[k + 1] - h[k]) / step
            x = h[k + 1] - slope * tau + (x - h[k] + slope * tau) * a
            y[k + 1] += weight * x
        y[0] += weight * h[0]
    return np.asarray(y)


@pytest.mark.parametrize(("strength", "beyond"), [(0.5, False), (2.0, True), (5.0, True)])
def test_weights_beside_limited_start_responses_are_the_best(strength: float, beyond: bool) -> None:
    """The error of the fit, and the error by which hypotheses are judged, are those of another formulation."""
    shape = CREEP.candidate.start
    with jit.plain():
        records = items(strength, 3)
        found = fits.linear(STRUCTURE, records, shape, np.array([1.0, 0.5, 0.3]))
        p, e = dense(records, _creep(shape))
        judged = Fitted(STRUCTURE, shape, found.best, found.rms).errors(records)
    best = float(np.sqrt(np.mean(e**2)))
    assert (best > 1.25 * NOISE) == beyond  # what no start can explain remains
    assert found.rms == pytest.approx(best, rel=1e-6)
    assert rms(judged) == pytest.approx(best, rel=1e-6)
    assert found.best == pytest.approx(p, abs=1e-4)


@pytest.mark.parametrize("seed", [9, 268, 274, 1, 2])
def test_nearly_equal_responses(seed: int) -> None:
    """Nearly equal responses have large factors of opposite signs, which go from side to side for the first seeds."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-1.5, 0.5) + np.array([0.0, rng.uniform(0.02, 0.3)])
    shape = np.array([*places, *10.0 ** rng.uniform(-3.0, -1.0, 2)])
    with jit.plain():
        records = [
            replace(item, y=item.y + rng.normal(0.0, 3.0) * np.exp(-item.run.t / 10.0 ** rng.uniform(-2.0, 1.0)))
            for item in items(rng.uniform(0.0, 6.0), seed)
        ]
        found = fits.linear(STRUCTURE, records, shape, np.array([1.0, 0.5, 0.3]))
        _, e = dense(records, _creep(shape))
    assert found.rms == pytest.approx(np.sqrt(np.mean(e**2)), rel=1e-6)


@pytest.mark.parametrize("strength", [0.5, 5.0])
def test_weights_that_suit_the_start_of_another_model(strength: float) -> None:
    """Plays without creep, given the start responses that creep leaves free, reach the least possible error."""
    shape = CREEP.candidate.start
    with jit.plain():
        records = items(strength, 5)
        creeping = Fitted(STRUCTURE, shape, fits.linear(STRUCTURE, records, shape, np.array([1.0, 0.5, 0.3])).best, 0.0)
        alone = fits.fit(replace(STRUCTURE, parts=()), records, np.empty(0), np.array([1.0, 0.5, 0.3]))
        found = fits.on_equal_terms(alone, creeping, records)
        _, e = dense(records, _creep(shape), present=False)
        blocks = [fits._Block(alone.actuator, item, alone.weights, creeping.actuator) for item in records]
        whole, best = fits._solved(blocks, 3)
    residual = whole[:, -1] - whole[:, :-1] @ best
    assert found.weights == pytest.approx(best)
    assert residual @ residual == pytest.approx(e @ e, rel=1e-6)
    before, after = (rms(each.errors(records, creeping)) for each in (alone, found))
    assert after < before


def test_derivatives_follow_the_limits() -> None:
    """The gradient of the least error, at the best weights and factors, agrees with differences of whole fits."""
    shape = CREEP.candidate.start
    with jit.plain():
        records = items(5.0, 4)
        best = fits.linear(STRUCTURE, records, shape, np.array([1.0, 0.5, 0.3])).best
        here = fits.linear(STRUCTURE, records, shape, best)
        system = here.system.whole
        errors = system[:, -1] - system[:, : len(best)] @ here.best
        gradient = -2.0 * errors @ system[:, len(best) : -1]
        for j, slope in enumerate(gradient):
            step = np.zeros(4)
            step[j] = 1e-4
            more, less = (fits.linear(STRUCTURE, records, shape + way * step, best) for way in (1.0, -1.0))
            expected = (more.rms**2 - less.rms**2) * here.samples / 2e-4
            assert slope == pytest.approx(expected, rel=0.01)


def test_a_start_behind_a_sensor_has_the_same_limits() -> None:
    """A sensor bends the response too, with an offset that is found; this must not double what the limits allow."""
    bent = kept(SensorPolynomial(name="sensor_nonlinearity", coefficients=(0.1,), scale=150.0))
    straight = kept(SensorPolynomial(name="sensor_nonlinearity", coefficients=(1e-9,), scale=150.0))
    with jit.plain():
        records = items(5.0, 5)
        shape, p = CREEP.candidate.start, np.array([1.0, 0.5, 0.3])
        without = fits.linear(STRUCTURE, records, shape, p)
        same = fits.linear(replace(STRUCTURE, parts=(CREEP, straight)), records, shape, without.best)
        assert same.rms == pytest.approx(without.rms, rel=1e-6)
        for record in records:
            ys = [replace(STRUCTURE, parts=(CREEP, *more)).actuator(shape) for more in ((), (straight,))]
            assert rms([ys[1].error(record, p)]) == pytest.approx(rms([ys[0].error(record, p)]), rel=1e-6)
        structure = replace(STRUCTURE, parts=(CREEP, bent))
        curved = [replace(item, y=structure.actuator(shape).mapped(item.y, np.zeros(1), item.run)) for item in records]
        found = fits.linear(structure, curved, shape, without.best)
        judged = Fitted(structure, shape, found.best, found.rms).errors(curved)
    assert found.rms == pytest.approx(rms(judged), rel=0.01)
