"""The search for the input of plays that an effect moves or bends: its answers against exact sums, and its tries."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from modelfiles import head

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import jit
from hystgen.compensator import reference
from hystgen.compensator.chain import moving, moving_fixed, moving_float
from hystgen.effects.plays import DASHPOT, DILATED, FASTEST, NEWTON_TRIES, PLAIN, POLYNOMIAL, SECANTS, STRAIGHT
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays import fixed, slots

FARTHEST = 2**31 - 1
RATE_BITS = 40
"""Of a sum that rises by 2^9 or more a step."""


def rising(rng: np.random.Generator, kinks: int) -> Callable[[int], int]:
    """A sum over integer inputs that rises linearly in each of several pieces and may jump between them."""
    at = sorted(rng.integers(-FARTHEST, FARTHEST, kinks).tolist())
    slopes = [round(1000.0 * x) for x in np.exp(rng.uniform(0.0, 7.0, kinks + 1)).tolist()]
    jumps = [round(x) for x in (rng.random(kinks) < 0.2) * rng.uniform(0, 2**40, kinks)]

    def total(w: int) -> int:
        found = slopes[0] * w
        for knot, jump, before, after in zip(at, jumps, slopes, slopes[1:], strict=False):
            if w > knot:
                found += jump + (after - before) * (w - knot)
        return found

    return total


def found_in(
    total: Callable[[int], int], begin: int, slope: int, h: int, near: int = 0, smooth: bool = False
) -> tuple[int, int]:
    """The answer of a search in fixed point, and its number of tries; `smooth`: with the slopes that it then takes."""
    tries = [0]

    def sum_at(_: Any, state: Any, w: int) -> int:
        tries[0] += state is s
        s.elements.found[0] = w
        return total(w)

    def slope_at(_: Any, __: Any, w: int) -> int:
        assert smooth
        return total(w + 1) - total(w)

    def straight(_: Any, __: Any, w: int, to: int) -> bool:
        return total(to) - total(w) == (to - w) * (total(w + 1) - total(w))

    kind = {"moves": PLAIN, "bends": STRAIGHT, "elements": SimpleNamespace(element=smooth * [None])}
    t = SimpleNamespace(moving=SimpleNamespace(farthest=FARTHEST, near=near, rate_bits=RATE_BITS, **kind))
    t.moving.elements.straight = 1000
    rate = [min(max(2**RATE_BITS // slope, 1), FASTEST)]
    s = SimpleNamespace(plays=SimpleNamespace(play=[begin]), search=SimpleNamespace(rate=rate))
    s.elements = SimpleNamespace(steep=[-1], found=[begin], departs=[0])
    with jit.plain():
        answer = moving_fixed.search(sum_at, None, straight, slope_at)(t, s, h)
    return int(answer), tries[0]


@pytest.mark.parametrize("seed", range(4))
def test_a_search_in_fixed_point_ends_at_the_nearer_neighbour(seed: int) -> None:
    rng = np.random.default_rng(seed)
    most = 0
    for _ in range(150):
        total = rising(rng, int(rng.integers(0, 12)))
        inside = total(int(rng.integers(-FARTHEST, FARTHEST))) + int(rng.integers(-(2**20), 2**20))
        h = inside if rng.random() < 0.9 else total(FARTHEST) + int(rng.integers(1, 2**40))
        answer, tries = found_in(total, int(rng.integers(-FARTHEST, FARTHEST)), int(rng.integers(1, 10**6)), h)
        low, high = -FARTHEST - 1, FARTHEST + 1
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if total(middle) < h else (low, middle)
        if high > FARTHEST:
            assert answer == high
        elif low < -FARTHEST:
            assert answer == (high if total(high) == h else low)
        else:
            assert answer in (low, high)
            assert abs(total(answer) - h) == min(h - total(low), total(high) - h)
        most = max(most, tries)
    assert most <= 1 + SECANTS + 32


@pytest.mark.parametrize("seed", range(4))
def test_a_search_along_exact_slopes_ends_within_a_step(seed: int) -> None:
    """Near the solution it ends with a step along the slope; over several kinks it takes few tries."""
    rng = np.random.default_rng(seed)
    most = 0
    for _ in range(150):
        at = sorted(rng.integers(-FARTHEST, FARTHEST, int(rng.integers(0, 6))).tolist())
        slopes = [int(x) for x in rng.integers(10**4, 10**6, len(at) + 1)]

        def total(w: int, at: list[int] = at, slopes: list[int] = slopes) -> int:
            bends = zip(at, slopes, slopes[1:], strict=False)
            return slopes[0] * w + sum((after - before) * max(w - knot, 0) for knot, before, after in bends)

        target = int(rng.integers(-FARTHEST, FARTHEST))
        h = total(target) + int(rng.integers(-(10**4) // 2, 10**4 // 2))
        answer, tries = found_in(total, int(rng.integers(-FARTHEST, FARTHEST)), 10**5, h, smooth=True)
        assert abs(answer - target) <= 1
        most = max(most, tries)
    assert most <= 1 + SECANTS


def test_slopes_of_no_use_cost_a_search_all_its_tries() -> None:
    """The sum jumps between two flat parts: secants advance slowly, and bisection ends at the jump."""
    counts = []
    for jump in (12345, -(2**30), 2**31 - 5):
        answer, tries = found_in(lambda w, jump=jump: w + 2**50 * (w > jump), -(2**31) + 1, 2**40, 2**49)
        assert answer in (jump, jump + 1)
        counts.append(tries)
    assert 34 <= max(counts) <= 1 + SECANTS + 32


def test_a_sum_that_is_near_ends_a_search_in_fixed_point() -> None:
    """A sum within half the least slope is closer than at either neighbour, so the search ends at once."""
    answer, tries = found_in(lambda w: 1000 * w, 0, 1000, 1000 * 77 + 499, 500)
    assert (answer, tries) == (77, 2)
    answer, tries = found_in(lambda w: 1000 * w, 0, 1000, 1000 * 77 + 499, 498)
    assert (answer, tries) == (77, 3)


def test_quotients_are_exact_to_a_part_in_2_28() -> None:
    rng = np.random.default_rng(1)
    for _ in range(3000):
        x, y = (int(2.0 ** rng.uniform(0.0, 61.9)) for _ in range(2))
        bits = int(rng.integers(0, 63))
        exact = Fraction(x, y) * 2**bits
        found = int(fixed.quotient.py_func(x, y, bits))
        if exact < 2**60:
            assert abs(found - exact) <= Fraction(1, 2) + Fraction(1, 2**20) + exact / 2**28
        else:
            assert found >= 2**59
    assert fixed.quotient.py_func(0, 5, 3) == 0


# ---------------------------------------------------------------- plays by rate or bent, in floating point

PI = "\n  pi: {thresholds: [0, 1, 1.5, 2.5, 4, 5], weights: [0.5, 0.3, 0.2, 0.1, 0.3, 0.2]}\n"
KINDS = {
    # betas in no order, so that plays start in no order either
    "dilated": "name: rate_dependence, betas: [3.0e-4, 0, 1.0e-4, 4.0e-4, 2.0e-4]",
    "dashpot": "name: rate_dependence, shape: relaxation, time_constant: 2.0e-3, exponent: 2",
    "soft dashpot": "name: rate_dependence, shape: relaxation, time_constant: 2.0e-3, exponent: 0.6",
    "polynomials": "name: noncongruent, coefficients: [[0.1, -0.02], [0.05], [-0.1], [0.02, 0.01, 0.005], [0.03]]",
}


def of_kind(kind: str) -> Model:
    effect = f"  effects: [{{{KINDS[kind]}}}]\n"
    return Model(parse_parameters(f"{head('m')}{PI}{effect}sample_time: 1.0e-3\n", "m.yaml"))


class Exact:
    """The compensator's plays, each computed in fractions from its state and constants."""

    def __init__(self, t: Any, s: Any) -> None:
        self.r, self.p, self.first, self.play, self.lost = (
            [Fraction(float(x)) for x in row]
            for row in (t.plays.threshold, t.plays.weight, t.moving.first, s.plays.play, s.lost)
        )
        self.yields, self.curve = ([list(map(Fraction, row)) for row in rows.astype(float).tolist()]
                                   for rows in (t.moving.yields, t.moving.curve))  # fmt: skip
        number = t.moving.number
        self.number = {name: Fraction(float(number[name][0])) for name in number.dtype.names}
        self.moves, self.bends = t.moving.moves, t.moving.bends

    def reached(self, i: int, w: Fraction) -> Fraction:
        x, q, r = self.play[0], self.play[i], self.r[i]
        if self.moves == DASHPOT:
            ahead = x + self.number["standing_share"] * (w - x) - q
            if abs(ahead) <= r:
                return q
            begin, *c = [row for row in self.yields if row[0] <= abs(ahead) - r][-1]
            gained = sum(each * (abs(ahead) - r - begin) ** k for k, each in enumerate(c))
            return q + self.lost[i] + (gained if ahead > 0 else -gained)
        wide = r + self.first[i] * abs(w - x) if self.moves == DILATED else r
        return max(w - wide, min(q, w + wide))

    def bent(self, i: int, z: Fraction) -> Fraction:
        if self.bends != POLYNOMIAL:
            return z
        xi = z * self.number["inverse_scale"]
        return z + self.number["scale"] * sum(c * xi ** (k + 2) for k, c in enumerate(self.curve[i]))

    def total(self, w: Fraction) -> Fraction:
        plays = range(1, len(self.r))
        return self.p[0] * w + sum(self.p[i] * self.bent(i, self.reached(i, w)) for i in plays)

    def kinks(self) -> list[Fraction]:
        """Inputs at which a play starts or stops moving with the input, in either direction."""
        x, found = self.play[0], [self.play[0]]
        seen = self.number["standing_share"] if self.moves == DASHPOT else 1
        for r, first, q in list(zip(self.r, self.first, self.play, strict=True))[1:]:
            wider = first if self.moves == DILATED else 0
            for side in (1, -1):  # which end of the play's band is at q
                for way in (1, -1):  # direction of the input
                    slope = seen * way - side * wider  # of that end, per unit of the move
                    move = (q - x + side * r) / slope if slope else Fraction(-1)
                    if move > 0:
                        found.append(x + way * move)
        return sorted(found)

    def solved(self, h: Fraction, ends: tuple[Fraction, Fraction]) -> Fraction:
        """The input with the sum h, interpolated between the kinks around it."""
        at = [ends[0], *(k for k in self.kinks() if ends[0] < k < ends[1]), ends[1]]
        totals = [self.total(k) for k in at]
        assert all(a < b for a, b in pairwise(totals))
        k = next(k for k in range(1, len(at)) if totals[k] >= h)
        return at[k - 1] + (h - totals[k - 1]) * (at[k] - at[k - 1]) / (totals[k] - totals[k - 1])


@pytest.mark.parametrize("arithmetic", ["float32", "float64"])
@pytest.mark.parametrize("kind", KINDS)
def test_plays_are_solved_for_right_up_to_their_kinks(
    kind: str, arithmetic: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sums that are reached where a play starts, and one unit in the last place to either side, from wherever drives
    have left the plays. Newton's method gets there without halving."""
    counts, most = [0], 0
    reciprocal = moving_float.inverse.py_func

    def counted(t: Any, slope: Any) -> Any:
        counts[0] += 1
        return reciprocal(t, slope)

    monkeypatch.setattr(moving_float, "inverse", counted)
    monkeypatch.setattr(jit.Jit, "interpreted", property(lambda one: one.py_func))
    real, one = ARITHMETICS[arithmetic].number.type, of_kind(kind)
    t = one.tables(arithmetic, "loop")
    code, s = reference.operations(t, True), reference.new_state(t, True)
    number, rng = t.moving.number, np.random.default_rng(5)
    ends = Fraction(float(number.least_input[0])), Fraction(float(number.largest_input[0]))
    unit = float(np.finfo(real).eps) / 2
    effects = one.parameters.model.effects
    least = moving.slopes(one.cascade, effects, 1.0e-3)[0]
    rounding = moving.sum_rounding(one.cascade, effects, unit)
    with jit.plain():
        code.init(t, s)
        call, status = np.array([slots.OP_STEP], np.uint8), np.zeros(1, np.uint8)
        for k in range(12):
            u = np.array([rng.uniform(-8.0, 8.0) * rng.choice([1.0, 0.1])], real)
            code.run(t, s, call, u, np.zeros(1, real), status)
            if k < 2:
                continue  # plays are at rest, or about to be moved for the first time
            exact = Exact(t, s)
            for kink in (each for each in exact.kinks() if ends[0] < each < ends[1]):
                at = real(float(exact.total(kink)))
                for h in (np.nextafter(at, real(-np.inf)), at, np.nextafter(at, real(np.inf))):
                    counts[0] = 0
                    answer = Fraction(float(moving_float.PLAYS[3](t, s, h)))
                    most = max(most, counts[0])
                    left = abs(exact.total(answer) - Fraction(float(h)))
                    assert left <= Fraction(rounding + moving.residual(one.cascade, effects, unit))
                    if kind == "dilated":
                        error = abs(answer - exact.solved(Fraction(float(h)), ends))
                        assert error <= left / Fraction(least)
                        assert error <= Fraction(16 * unit * 12), (k, float(error))
    assert most <= NEWTON_TRIES


# ---------------------------------------------------------------- plays in fixed point, by their definition

FIXED_PI = "\n  pi: {thresholds: [0, 0.5, 1, 1.5, 2.5, 3.5], weights: [0.5, 0.3, 0.2, 0.1, 0.3, 0.2]}\n"
FIXED = {
    "dilated": KINDS["dilated"],
    "polynomials": "name: noncongruent, coefficients: [[0.05, -0.01], [0.02], [0.01], [0.05], [0.05, 0.02]]",
    "centre": "name: noncongruent, shape: centre, amplitude: 0.4, centre: 1, width: 0.8",
    "both": "name: rate_dependence, betas: [1.0e-4, 0, 1.0e-4, 2.0e-4, 0]}, "
    "{name: noncongruent, shape: centre, amplitude: 0.3, centre: -1, width: 2",
}


def halved(x: Fraction) -> int:
    """The nearest whole number, the larger one of two."""
    return math.floor(x + Fraction(1, 2))


def away(x: Fraction) -> int:
    """The nearest whole number, that farther from 0 of two."""
    return halved(x) if x > 0 else -halved(-x)


class Whole:
    """Plays in whole numbers, from the tables alone: what each contributes with their input anywhere."""

    def __init__(self, t: Any, s: Any) -> None:
        self.t, self.play = t, [int(x) for x in s.plays.play]
        self.r, self.p = ([int(x) for x in row] for row in (t.plays.threshold, t.plays.weight))

    def places(self, w: int) -> list[int]:
        """Where the plays are once their input has moved to w."""
        found = [w]
        for r, (mantissa, shift), q in list(zip(self.r, self.t.moving.first.tolist(), self.play, strict=True))[1:]:
            wide = r + halved(Fraction(abs(w - self.play[0]) * mantissa, 2**shift))
            found.append(max(w - wide, min(q, w + wide)))
        return found

    def bent(self, i: int, z: int) -> int:
        """What play i contributes at z."""
        bump = self.t.moving.bump
        if not len(bump.pieces):
            return z
        k = int(self.t.moving.bump_of[i])
        x = max(int(bump.domain[k, 0]), min(z, int(bump.domain[k, 1])))
        begins = bump.knot.tolist()[int(bump.first[k]) : int(bump.first[k] + bump.pieces[k])]
        j = max(j for j, begin in enumerate(begins) if begin <= x)
        row, value = int(bump.first[k]) + j, Fraction(0)
        for c in reversed(bump.coefficient[row].tolist()):
            value = Fraction(c + halved(value * (x - begins[j]) * Fraction(2) ** (int(bump.scale[row]) - 31)))
        return z + away(value * 2 ** int(bump.scaled[k, 1]) / 2**self.t.moving.bump_bits)

    def total(self, w: int) -> int:
        places = self.places(w)
        return self.p[0] * w + sum(self.p[i] * self.bent(i, places[i]) for i in range(1, len(self.p)))


@pytest.mark.parametrize("arithmetic", ["q31", "q15"])
@pytest.mark.parametrize("effect", FIXED)
def test_inputs_in_fixed_point_are_the_nearest_of_all(effect: str, arithmetic: str) -> None:
    """No input near the answer, nor at any of 60 places all over the range, has a sum nearer to that asked for; and
    the sum of plays that have followed an input is that of their contributions, wherever drives have left them."""
    text = f"{head('m')}{FIXED_PI}  effects: [{{{FIXED[effect]}}}]\nsample_time: 1.0e-3\n"
    t = Model(parse_parameters(text, "m.yaml")).tables(arithmetic, "loop")
    code, s = reference.operations(t, True), reference.new_state(t, True)
    drop, far, rng = int(t.number.level_drop[0]), int(t.moving.farthest), np.random.default_rng(7)
    _, follow, _, find = moving_fixed.PLAYS
    turns = 0
    with jit.plain():
        code.init(t, s)
        s.own.moving[0] = 1
        at = 0.0
        for k in range(48):
            at = float(rng.uniform(-0.3, 0.3)) if k % 6 == 0 else at + float(rng.normal(0.0, 0.1 if k % 4 else 1e-5))
            exact = Whole(t, s)
            h = halved(Fraction(at) * int(t.number.largest_level[0]))
            w = int(find(t, s, h))
            left = abs(exact.total(w) - (h << drop))
            near = [*range(w - 4, w + 5), *(w + side * 2**b for b in range(3, 20, 2) for side in (1, -1))]
            anywhere = [x for x in (*near, *rng.integers(-far, far, 60).tolist()) if abs(x) <= far]
            assert all(abs(exact.total(x) - (h << drop)) >= left or left <= int(t.moving.near) for x in anywhere)
            applied = min(max(w, -far // 3), far // 3) if k % 5 else int(rng.integers(-far // 3, far // 3))
            level, total, places = int(follow(t, s, applied)), exact.total(applied), exact.places(applied)
            assert level == away(Fraction(total, 2**drop))
            assert [int(x) for x in s.plays.play] == places
            turns += places[1:] != exact.play[1:]
    assert turns > 12
