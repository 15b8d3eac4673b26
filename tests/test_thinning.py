"""Thinned records: a model's output at the samples kept is what it is with all samples."""

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from hystgen.chain import chain
from hystgen.diagnosis.data.items import Item, thinned
from hystgen.diagnosis.data.items import needed as needed_samples
from hystgen.diagnosis.search import acceptance
from hystgen.effects.base import Effect, Run
from hystgen.effects.delay.model import Delay
from hystgen.effects.lag.model import Lag
from hystgen.effects.slew_limit.model import SlewLimit
from hystgen.plays import operators

pytestmark = pytest.mark.thorough

Array = NDArray[np.float64]

DT = 1e-3
NOISE = 1e-3
THRESHOLDS = np.array([0.0, 0.4, 1.1, 2.3])
WEIGHTS = np.array([0.5, 0.2, 0.2, 0.1])


def drives() -> dict[str, Array]:
    """Drives of 8000 samples over about -5 to 5: slow, with holds and edges, fast, with small turns inside."""
    t = np.arange(8000) * DT
    staircase = np.repeat([0.0, 3.0, -2.0, 5.0, -5.0, 1.0, 4.0, 0.0], 1000)
    return {
        "sine": 5.0 * np.sin(2 * np.pi * 0.4 * t) * np.exp(-0.1 * t),
        "staircase": staircase + 0.0 * t,
        "chirp": 4.0 * np.sin(2 * np.pi * (0.2 + 1.5 * t) * t),
        "small turns": 4.0 * np.sin(2 * np.pi * 0.3 * t) + 0.02 * np.sin(2 * np.pi * 61.0 * t),
        "triangle": 5.0 * (2.0 / np.pi) * np.arcsin(np.sin(2 * np.pi * 0.7 * t)),
    }


def plays(w: Array) -> Array:
    """Output of the plays, from rest at the first sample."""
    return WEIGHTS @ operators.plays(w, THRESHOLDS, np.full(len(THRESHOLDS), w[0]))


def item(v: Array, left: Array, name: str = "made") -> Item:
    """A record in which a model of plays alone leaves the error `left`."""
    run = Run(np.arange(len(v)) * DT, v)
    return Item(name, run, plays(v) + left, (float(v[0]),), float(np.ptp(v)))


def needed(v: Array, left: Array) -> NDArray[np.intp]:
    """Indices of the samples that are needed."""
    (mask,) = needed_samples([item(v, left)], [left], NOISE)
    return np.flatnonzero(mask)


def white(number: int) -> Array:
    """White noise of standard deviation `NOISE`."""
    return np.random.default_rng(3).normal(0.0, NOISE, number)


@pytest.mark.parametrize("name", drives())
def test_plays_at_the_needed_samples_are_those_of_all_samples(name: str) -> None:
    """A skipped turn changes the drive that plays see by at most this amount, and each play by no more (its map is
    Lipschitz)."""
    v = drives()[name]
    at = needed(v, white(len(v)))
    assert len(at) < (1.0 if name in ("chirp", "small turns") else 0.2) * len(v)
    as_drive = np.ptp(v) / np.ptp(plays(v))
    missed = acceptance.THIN_TURNING * NOISE * as_drive
    assert np.max(np.abs(plays(v[at]) - plays(v)[at])) <= np.sum(WEIGHTS) * missed


@pytest.mark.parametrize("name", drives())
@pytest.mark.parametrize(
    "effect",
    [
        Lag(name="lag", time_constant=2e-3),
        Lag(name="lag", time_constant=0.05),
        Delay(name="delay", time=0.0137),
        SlewLimit(name="slew_limit", rate=40.0),
    ],
    ids=lambda effect: f"{effect.name}",
)
def test_what_acts_on_the_drive_sees_the_drive_that_all_samples_are(name: str, effect: Effect) -> None:
    """None of these effects magnifies a difference of the drive, and plays magnify it by their weights at most; between
    the samples kept, the drive is straight to within the allowed error."""
    v = drives()[name]
    whole = Run(np.arange(len(v)) * DT, v)
    left = plays(np.asarray(effect.drive(v, whole))) - plays(v) + white(len(v))
    at = needed(v, left)
    some = whole.picked(at)
    as_drive = np.ptp(v) / np.ptp(plays(v))
    error = np.abs(np.asarray(effect.drive(some.v, some)) - np.asarray(effect.drive(v, whole))[at])
    assert np.max(error) <= (acceptance.THIN_STRAIGHT + acceptance.THIN_TURNING) * NOISE * as_drive * (1.0 + 1e-9)


@pytest.mark.parametrize("name", drives())
def test_a_filter_behind_the_plays_does_too(name: str) -> None:
    """As far as plays are straight, the filter's response to the rest is no larger than the rest."""
    v = drives()[name]
    whole = Run(np.arange(len(v)) * DT, v)
    follow = Lag(name="lag", time_constant=0.02)
    left = np.asarray(follow.drive(plays(v), whole)) - plays(v) + white(len(v))
    at = needed(v, left)
    some = whole.picked(at)
    error = np.abs(np.asarray(follow.drive(plays(v)[at], some)) - np.asarray(follow.drive(plays(v), whole))[at])
    most = acceptance.THIN_STRAIGHT + np.sum(WEIGHTS) * acceptance.THIN_TURNING
    assert np.max(error) <= most * NOISE * (1.0 + 1e-9)


def test_what_rings_is_seen_in_what_is_left_alone() -> None:
    """After each edge something rings, which neither the drive nor the plays show."""
    v = drives()["staircase"]
    since, at = np.arange(len(v)) % 1000, np.arange(len(v))
    left = 0.1 * np.exp(-since / 100.0) * np.sin(2 * np.pi * since / 11.0) + white(len(v))
    without, places = needed(v, white(len(v))), needed(v, left)
    assert len(without) < 0.1 * len(v) < 0.2 * len(v) < len(places) < 0.6 * len(v)

    def missed(few: NDArray[np.intp]) -> float:
        return float(np.sqrt(np.mean((left - np.interp(at, few, left[few])) ** 2)))

    assert missed(places) <= acceptance.THIN_RESIDUAL * NOISE < 10 * NOISE < missed(without)


def test_a_column_that_changes_is_kept() -> None:
    """A temperature that is switched while nothing else moves."""
    v, left = np.zeros(4000), np.zeros(4000)
    v[:10] = 1.0
    column = np.zeros(4000)
    column[2001:] = 3.0
    made = item(v, left)
    made = Item("made", Run(made.run.t, v, {"temperature": column}), made.y, (0.0,), 1.0)
    (mask,) = needed_samples([made], [left], NOISE)
    assert mask[2000]
    assert mask[2001]
    assert np.count_nonzero(mask) < 400


class TestThinned:
    """Records thinned in groups, in a session and alone."""

    USED = ("sine", "staircase", "triangle")

    def groups(self) -> tuple[list[list[Item]], list[list[NDArray[np.bool_]]]]:
        """Two records to fit and a held-out one between them, of one session, and masks of the samples needed."""
        made = [item(v, white(len(v)), name) for name, v in drives().items() if name in self.USED]
        starts = (0.0, 20.0, 40.0)
        runs = [Run(each.run.t + start, each.run.v) for each, start in zip(made, starts, strict=True)]
        session = chain.join(runs)
        items = [
            Item(each.name, run, each.y, each.history, each.output_range, session.run, part)
            for each, run, part in zip(made, runs, session.parts, strict=True)
        ]
        errors = [each.y - plays(each.run.v) for each in items]
        masks = needed_samples(items, errors, NOISE)
        return [[items[0], items[2]], [items[1]]], [[masks[0], masks[2]], [masks[1]]]

    def test_every_so_many_th_is_compared(self) -> None:
        groups, masks = self.groups()
        for group, few in zip(groups, thinned(groups, 1000, masks), strict=True):
            step = -(-sum(len(each.y) for each in group) // 1000)
            for each, less in zip(group, few, strict=True):
                assert np.array_equal(less.y[less.known], each.y[::step])
                assert np.array_equal(less.run.t[less.known], each.run.t[::step])
                assert len(less.run.t) < 0.5 * len(each.run.t)

    def test_records_lie_in_the_session_where_they_did(self) -> None:
        groups, masks = self.groups()
        few = thinned(groups, 1000, masks)
        sessions = {id(less.session) for group in few for less in group}
        assert len(sessions) == 1
        for less in (less for group in few for less in group):
            assert less.session is not None
            assert np.array_equal(less.session.t[less.part], less.run.t)
            assert np.array_equal(less.session.v[less.part], less.run.v)

    def test_two_parts_of_one_run_stay_so(self) -> None:
        v = drives()["sine"]
        whole = item(v, white(len(v)))
        front, end = whole.y.copy(), whole.y.copy()
        front[5600:], end[:5600] = np.nan, np.nan
        groups = [[Item("a", whole.run, y, whole.history, 10.0)] for y in (front, end)]
        masks = [needed_samples(group, [group[0].y - plays(v)], NOISE) for group in groups]
        (first,), (second,) = thinned(groups, 500, masks)
        assert first.run is second.run
        assert np.array_equal(first.y[first.known], front[np.isfinite(front)][::12])
        assert np.count_nonzero(second.known) <= 500

    def test_few_samples_stay_as_they_are(self) -> None:
        groups, masks = self.groups()
        assert thinned(groups, 100_000, masks) == groups

    def test_what_adds_up_does_over_all_samples(self) -> None:
        """Ways and heats are exact even where noise of the drive is skipped."""
        rng = np.random.default_rng(8)
        v = drives()["sine"] + rng.normal(0.0, 1e-5, 8000)
        whole = Run(np.arange(8000) * DT, v)
        at = needed(v, white(8000))
        some = whole.picked(at)
        assert len(at) < 0.5 * len(v)
        assert np.array_equal(some.travelled, np.concatenate([[0.0], np.cumsum(np.abs(np.diff(v)))])[at])
        heats = 0.5 * np.abs(np.diff(0.5 * v * np.abs(v)))
        expected = [math.fsum(heats[a:b]) for a, b in itertools.pairwise(at)]
        assert some.heat * some.steps == pytest.approx(expected, rel=1e-12)
