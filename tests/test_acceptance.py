"""A table of cases just below and just above each number in `acceptance`.

A row with a short function takes a line or two; others are decorated functions. Tests of the table stand at the end.
"""

from __future__ import annotations

import ast
import inspect
import itertools
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import test_selection
import thresholds
from made_items import driven, hiss, of_share, ramp, sine, smooth, tone
from made_up import HELD, NOISE, RECORDS, STRUCTURE, Hypothesis, Made, World, first_of, result, sweep
from numpy.typing import NDArray
from recordings import record
from scipy.signal import lfilter
from scipy.stats import wilcoxon
from thresholds import ROWS, also, decides, row

from hystgen.diagnosis import Diagnosis
from hystgen.diagnosis.data import disturbances, preparing, signals
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.data.items import needed as needed_samples
from hystgen.diagnosis.data.preparing import Prepared, prepare
from hystgen.diagnosis.data.signals import noise_floor
from hystgen.diagnosis.findings import content
from hystgen.diagnosis.findings.kinds import Line, Ripple, Saturated
from hystgen.diagnosis.findings.result import Result
from hystgen.diagnosis.search import acceptance, fits, harm, hypothesis, screening, selection, shared
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.hypothesis import Actuator, Structure
from hystgen.diagnosis.search.screening import Option
from hystgen.effects.base import Effect, Run
from hystgen.effects.creep.model import ExponentialCreep
from hystgen.effects.resonance.model import Resonance
from hystgen.front.dead_zone.model import DeadZone
from hystgen.identification.joint import Ends, Kept
from hystgen.identification.quality import correlation_time
from hystgen.identification.reduction import Course, settled
from hystgen.records import Record

pytestmark = pytest.mark.thorough

Array = NDArray[np.float64]

# fmt: off

# What is worth a name ----------------------------------------------------------------------------------------

UNNAMED: Any = Made("now", 1, (1.0, 1.0))


def trial(*left: float, name: str = "better", **shape: Any) -> Any:
    """An effect that leaves these shares of the error of fitted and of held-out records."""
    made = Made(name, 1, (left[0], left[-1]))
    vars(made).update(shape)
    return screening.Tried(SimpleNamespace(name=name, front=True), made, (name,), left[-1], made.errors(HELD))  # type: ignore[arg-type]


def has_merit(left: float, held_out: float, fitted: float, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether an effect that leaves the share `left` of both errors has merit at these p-values."""
    best = trial(left)
    monkeypatch.setattr(selection, "difference", lambda _, after: held_out if after is best.errors else fitted)
    return selection.merit_of(UNNAMED, best, RECORDS) is not None


def explain_most(now: tuple[float, float], none: float = 1.0, on_equal_terms: float | None = None) -> bool:
    """Whether names explain most of the error.

    `now`, `none`: errors with and without them; `on_equal_terms`: without them, but with the same free terms."""
    other = none if on_equal_terms is None else on_equal_terms
    given: Any = Made("now", 1, now), Made("none", 1, (none, none), (other, other))
    return selection.borne_out(*given, RECORDS) is None


row("noise", "NOISE FAR_ABOVE_NOISE STRUCTURE_SHARE",  # by error / noise floor, and by the structured share
    {(1.2, 0.2): True, (1.3, 0.2): False, (1.9, 0.1): True, (2.1, 0.1): False, (1.9, 0.16): False},
    lambda error, share: acceptance.is_noise(error, 1.0, share))
row("chance", "P_SURE P_REPEATED",  # p-value held out; a higher one will do if the fitted records are sure
    {(0.0015, 0.5): False, (0.0007, 0.5): True, (0.07, 1e-6): False, (0.04, 1e-6): True, (0.04, 0.0015): False},
    lambda held_out, fitted, monkeypatch: has_merit(0.6, held_out, fitted, monkeypatch))
row("what_chance_does_not_explain", "FAR_LESS",  # halving the error counts even if few blocks show it
    {0.6: False, 0.4: True}, lambda left, monkeypatch: has_merit(left, 0.1, 1e-6, monkeypatch))
row("an_effect_has_to_show_in_both", "SEEN_IN_BOTH",  # one group loses 0.2 or 0.33 of its remaining error
    {(0.98, 0.5): False, (0.95, 0.5): True, (0.5, 0.98): False, (0.5, 0.95): True},
    lambda *left: selection.merit_of(UNNAMED, trial(*left), RECORDS) is not None)
row("names_explain_most", "MOSTLY_EXPLAINED",  # far above the noise: 0.25 or 0.42 of the variance is left
    {(0.1, 0.1): True, (0.5, 0.1): True, (0.1, 0.5): True, (0.65, 0.1): False, (0.1, 0.65): False},
    lambda *left: explain_most(left))
row("names_explain_most_without_the_free_start_states", "",  # free start states left little to explain
    {0.33: False, 1.0: True}, lambda other: explain_most((0.3, 0.3), on_equal_terms=other))
row("names_near_the_noise_explain_half", "LEAST_EXPLAINED",  # in multiples of it: leaves 0.32 or 0.58 of the variance
    {(2.5, 4.2): True, (2.9, 3.7): False},
    lambda left, gap: explain_most((left * NOISE, left * NOISE), gap * NOISE))
row("equal_effects_come_in_the_order_of_the_catalogue", "FAR_LESS EQUAL",  # one leaves 0.3 or 0.9 % more in all
    {1.006: "lag", 1.015: "delay"}, lambda more: first_of(Made("delay", 1, (1.0, 1.0)), Made("lag", 1, (more, 1.0))))
row("what_an_amplifier_does_comes_before_plays_that_are_late", "",  # against the catalogue's order, if both are equal
    {"lag": "lag", "delay": "delay", "resonance": "resonance", "slew_limit": "rate_dependence"},
    lambda name: first_of(Made("rate_dependence", 1, (1.0, 1.0)), Made(name, 1, (1.004, 1.0))))
row("an_unlikely_amount_comes_behind_fewer_numbers_that_are_alike", "ALIKE",  # 20 or 30 % more error held out
    {(True, 1.2): "lag", (True, 1.3): "creep", (False, 1.2): "creep"},
    lambda most, more: first_of(Made("creep", 3, (1.0, 1.0), most=most), Made("lag", 1, (1.0, more))))


@decides("P_DIFFERENT", {0.015: True, 0.007: False})
def effects_are_alike(p_value: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Effects are alike by the p-value alone, however different their errors are."""
    monkeypatch.setattr(selection, "difference", lambda *_: p_value)
    return selection.alike(trial(1.2), trial(1.0), 0.1)


@decides("FLAT_END", {
    (0.004, 0.001): selection.Refusal("end", 0.004, acceptance.FLAT_END), (0.008, 0.001): None, (0.001, 0.008): None,
})
def a_limit_at_the_very_end_of_the_drive(low: float, high: float) -> Any:
    """A saturation that removes 40 % of the error is refused if its flat end is only a tiny share of the range."""
    best = trial(0.6, name="saturation", shape=np.array([low, high, -3.0]))
    best.fitted.structure.front = Ends((0.0, 100.0))
    found = selection.judged(UNNAMED, best, RECORDS)
    return None if isinstance(found, selection.Merit) else found


@decides("BLOCK_MEMORIES BLOCKS", {1: True, 30: True})
def blocks_are_longer_than_errors_remember(memory: int) -> Any:
    """The p-value equals that of blocks cut here: two correlation times long, at most a twentieth of the record."""
    random = np.random.default_rng(3)
    before = np.sqrt(1.0 + np.repeat(random.uniform(0.0, 1.0, 600 // memory), memory) + random.uniform(0.0, 0.1, 600))
    after = np.sqrt(1.3 + random.uniform(0.0, 0.1, 600))
    gain = before**2 - after**2
    size = min(round(2.0 * correlation_time(gain)), 600 // 20)
    blocks = [np.mean(gain[k : k + size]) for k in range(0, 600 - size + 1, size)]
    assert size == (2 if memory == 1 else 30)
    expected = wilcoxon(blocks, alternative="greater").pvalue
    return selection.difference([before], [after]) == pytest.approx(float(expected), rel=1e-9, abs=0.0)


# Forward selection -------------------------------------------------------------------------------------------


def found(name: str) -> Any:
    return selection.Found(name, name, 1.0, 0.5, 0.0, ())


def without_fits(monkeypatch: pytest.MonkeyPatch, now: Hypothesis) -> Any:
    """Replace every fit by one that ends at this hypothesis."""
    for each in ("without_effect", "without_refit"):
        monkeypatch.setattr(selection, each, lambda now, name, _: Hypothesis(now.world, now.names - {name}))
    monkeypatch.setattr(selection.fits, "begun", lambda *_: SimpleNamespace(found=lambda _: now))
    monkeypatch.setattr(selection.fits, "fit", lambda *_: now)
    return now


@decides("MOST_EFFECTS FURTHER_REMOVES", {(): list("abcde")})
def no_more_than_five_effects(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Six effects help in alphabetical order, each as much as a further effect must; only five are found."""
    every = [frozenset(each) for n in range(7) for each in itertools.combinations("abcdef", n)]
    prefix = {each: next((k for k, name in enumerate("abcdef") if name not in each), 6) for each in every}
    world = World({each: 0.68 ** prefix[each] for each in every}, "abcdef")
    now = without_fits(monkeypatch, Hypothesis(world, frozenset()))
    monkeypatch.setattr(selection, "_finished", lambda now, found, _: (now, found, None))
    return [each.name for each in selection.select(world.records, now).found]


@decides("NEEDLESS", {0.2: "b", 0.4: "ab"})
def a_needless_effect_is_dropped(without: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """`without`: error that losing the effect adds, in multiples of the noise."""
    shares = {"ab": 0.02, "b": float(np.sqrt(0.02**2 + 2.0 * (without * NOISE) ** 2)), "a": 0.5}
    world = World({frozenset(names): share for names, share in shares.items()}, "ab")
    # noise that differs between the hypotheses would hide this difference
    world.colour = lambda *_: np.zeros(2000)  # type: ignore[method-assign]
    now = without_fits(monkeypatch, Hypothesis(world, frozenset("ab")))
    _, left, _ = selection._without_needless(now, [found(name) for name in "ab"], world.records)
    return "".join(each.name for each in left)


@decides("MOST_RIVALS", {"d": ["d", "x"], "e": []})
def three_rivals_are_tried(good: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Five effects are alike, and the next one helps only beside one of them: the fourth is tried, not the fifth."""
    left = {name: 0.5 + 0.001 * k for k, name in enumerate("abcde")}
    world = World({frozenset(each): share for each, share in {**left, "x": 1.0, good + "x": 0.02}.items()}, "abcdex")
    world.left |= {frozenset(a + b): left[a] for a, b in itertools.permutations("abcde", 2)}
    now = without_fits(monkeypatch, Hypothesis(world, frozenset()))
    latest = selection._step(now, world.gap(now), world.records)
    assert latest is not None
    step = selection._Step(latest.best.fitted, latest.tried, latest.best, None)
    return [each.best.name for each in selection._with_rival(latest, step, world.gap(now), world.records) or ()]


@decides("MOST_EXCHANGES", {(): 4})
def exchanges_end(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Exchanges stop although another effect always seems better."""
    world = World({}, "ab")
    now = without_fits(monkeypatch, Hypothesis(world, frozenset("ab")))
    asked: list[Any] = []

    def step(*_: Any) -> Any:
        asked.append(selection._Step(now, [], world.tried(now, "c"), selection.Merit(1.0, 1.0, 0.1, 0.0)))
        return asked[-1]

    for name, function in {
        "_step": step, "_gives_way": lambda *_: True, "_found": lambda *_: found(f"n{len(asked)}"),
        "_without_needless": lambda now, found, _: (now, found, {}), "in_place": lambda _, found, *__: list(found),
    }.items():
        monkeypatch.setattr(selection, name, function)
    selection._exchanged(now, [found(name) for name in "ab"], {}, {"a", "b"}, world.records)
    return len(asked)


# Screening ---------------------------------------------------------------------------------------------------


class Path:
    """A search with given errors after every step; a step without a change of error fails. `log`: steps per call."""

    def __init__(self, errors: Sequence[float], at: int = 0, log: list[int] | None = None) -> None:
        self.errors, self.at, self.log = errors, at, [] if log is None else log
        self.now = SimpleNamespace(rms=errors[min(at, len(errors) - 1)])

    def further(self, steps: int, _: float) -> Path:
        self.log.append(steps)
        found = Path(self.errors, self.at + steps, self.log)
        if found.now.rms == self.now.rms:
            found.now = self.now
        return found

    def found(self, _: Any) -> float:
        return float(self.now.rms)


def screened(monkeypatch: pytest.MonkeyPatch, *paths: Path) -> float:
    """Final error of a screening from several starts, relative to the error without the effect."""
    waiting = list(paths)
    monkeypatch.setattr(fits, "begun", lambda *_: waiting.pop(0))
    option: Any = SimpleNamespace(front=True, starts=range(len(paths)), grown=None, name="lag", alone=None)
    rough: Any = SimpleNamespace(errors=lambda _: [np.ones(10)], weights=None)
    searches = screening._Searches(None, rough, [], SimpleNamespace(thin=None))  # type: ignore[arg-type]
    return searches._screen(option, screening._Trial(0, 0))  # type: ignore[return-value]


def shape(name: str, held_out: float, fitted: float | None = None) -> Any:
    """One shape of an effect, with the errors it leaves."""
    option = SimpleNamespace(name=name, label=f"{name} {held_out}")
    rms = held_out if fitted is None else fitted
    return SimpleNamespace(option=option, residual=held_out, fitted=SimpleNamespace(rms=rms, shape=None), numbers=1)


def kept(tried: Sequence[Any], refitted: Sequence[Any] = ()) -> list[str]:
    return [each.option.name for each in screening._kept(list(tried), list(refitted))]


def followed(screen: Sequence[tuple[float, float]], joint: Sequence[float]) -> list[list[int]]:
    """Steps of each option. `screen`: its held-out and fitted errors; `joint`: its held-out error after joint steps."""
    steps: list[list[int]] = [[] for _ in screen]

    class Pool:
        def each(self, tasks: Sequence[Any], *_: Any) -> Any:
            for task in tasks:
                steps[task.k].append(task.steps)
                yield task, screening._Numbers(np.zeros(0), np.zeros(0), 2.0, joint[task.k], ())

    nothing = SimpleNamespace(start=())
    option: Any = SimpleNamespace(joined=lambda *_: np.zeros(0), structure=nothing, alone=nothing, starts=())
    tried: Any = [SimpleNamespace(k=k, **vars(shape("lag", *left))) for k, left in enumerate(screen)]
    now: Any = SimpleNamespace(rms=1.0, weights=None)
    records: Any = SimpleNamespace(tick=None, held=[], to_fit=[])
    searches = screening._Searches(now, now, [screening._Pair(option, option) for _ in screen], records)
    screening._followed_up(searches, tried, Pool())  # type: ignore[arg-type]
    return steps


row("a_search_whose_steps_fail_goes_on", "",  # each failure damps more; a cubic sensor succeeds at its fifth or sixth
    {(): 0.1}, lambda monkeypatch: screened(monkeypatch, Path([0.5] * 5 + [0.1] * 10)))
row("a_start_far_off_is_left", "TOO_FAR",  # the best end is reached from there
    {4.5: 0.01, 5.5: 0.1}, lambda far, monkeypatch: screened(monkeypatch, Path([0.1]), Path([0.1 * far, 0.01])))
row("a_start_that_does_nothing_waits", "IDLE",  # by the change of error; the other start begins worse than no effect
    {0.015: False, 0.007: True},
    lambda change, monkeypatch: screened(monkeypatch, Path([1.0 - change] * 3), Path([1.5, 1.45, 1.4, 0.3])) == 0.3)
row("what_promises_nothing_is_not_searched_jointly", "PROMISING JOINT_STEPS",  # by its error / the best one's
    {(1.9, 3.0): [5, 5], (3.0, 1.9): [5, 5], (2.1, 2.1): [5, 0]},
    lambda *left: [each[0] for each in followed([(1.0, 1.0), left], [1.0, 1.0])])
row("what_is_behind_after_a_few_steps_is_not_polished", "HOPEFUL",
    {1.2: 2, 1.4: 1}, lambda left: len(followed([(1.0, 1.0), (1.0, 1.0)], [1.0, left])[1]))
row("no_more_than_two_shapes_of_an_effect", "SHAPES_OF_ONE",
    {"lag": 2, "other": 3}, lambda name: len(kept([shape("lag", 0.1), shape("lag", 0.2), shape(name, 0.3)])))
row("shapes_that_are_followed", "KEPT ALSO_KEPT",  # five by held-out error and two more by fitted error
    {(): ["e0", "e1", "e2", "e3", "e4", "e11", "e10"]},
    lambda: kept([shape(f"e{k}", 1.0 + k, 20.0 - k) for k in range(12)]))


@decides("KEPT ALSO_KEPT TWIN", {0.015: True, 0.025: False})
def a_twin_follows(apart: float) -> Any:
    tried = [shape(name, 1.0) for name in "abcdefg"] + [shape("twin", 1.0 + apart)]
    return "twin" in kept(tried, tried)


@decides("FIRST_STEPS SCREENING_STEPS FALLING LONGER", {0.75: [2, 2, 2, 2, 2], 0.85: [2, 2]})
def a_search_that_falls_goes_on(factor: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A search that falls fast makes four more calls of two steps after the first, a slower one only one more."""
    path = Path([0.5 * factor ** (k / 2.0) for k in range(40)])
    screened(monkeypatch, path)
    return path.log


@decides("FALLING LONGER", {0.75: [5] * 4, 0.85: [5]})
def a_joint_search_that_falls_goes_on(factor: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A falling search gets more calls of five steps: creep of three states falls slowly, but far."""
    path = Path([factor ** (k / 5.0) for k in range(40)])
    monkeypatch.setattr(fits, "begun", lambda *_: path)
    task = screening._Trial(screening._JOIN, 0, np.zeros(0), np.zeros(0), 5)
    searches = screening._Searches(None, None, [], SimpleNamespace(quick=None))  # type: ignore[arg-type]
    searches._join(SimpleNamespace(structure=None), task)  # type: ignore[arg-type]
    return path.log


REFITTED = Fitted(Structure(np.array([0.0, 10.0]), Kept()), np.empty(0), np.array([0.1, 0.0]), 1.0)


@decides("SCREENED SEARCHED", {(): True})
def samples_of_a_search() -> Any:
    """Every n-th of 30000 samples is compared: at most the given number, and more than half of it."""
    records = screening.Records.of([sine(30_000)], [sine(30_000, 1)], REFITTED, 0.01)
    groups = records.thin, records.thin_held, records.quick
    thin, thin_held, quick = (np.count_nonzero(each[0].known) for each in groups)
    return 3_000 < thin <= 6_000 and 3_000 < thin_held <= 6_000 and 6_000 < quick <= 12_000


@decides("RINGING_STARTS", {(): pytest.approx([290.0, 230.0, 170.0], abs=0.5)})
def frequencies_from_which_a_resonance_is_sought(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The error rings at five frequencies; searches start at the three strongest."""
    rings = sum(tone(50.0 + 60.0 * k, 4000, 1.0 + 0.05 * k) for k in range(5))
    one, other = (replace(item, y=item.y + rings + 0.1 * hiss(4000)) for item in (ramp(4000), ramp(4000, name="other")))
    records = screening.Records.of([one], [other], REFITTED, 0.1)
    seen: list[Any] = []
    monkeypatch.setattr(screening, "options", lambda _, known, *__: seen.append(known) or [])  # type: ignore[func-returns-value]
    assert records.extensions(REFITTED) == []
    return seen[0].ringing


@decides("PLAYS", {(): True})
def plays_of_a_fit() -> Any:
    """Plays are just fine enough that their steps are below the noise."""
    one, other = (record(item.run.v, item.y, item.name) for item in (sine(4000), sine(4000, 1)))
    return 25 <= len(prepare([one], [other], (0.0,), 0.0).thresholds) <= 40


# What a column shares with time, mains and drive --------------------------------------------------------------


def of_its_own(own: float, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether a column is named of which this share of the removed power belongs to it alone."""
    best = trial(0.3)
    monkeypatch.setattr(shared, "column_of", lambda _: "load")

    def apart(_: Any, __: str, errors: Sequence[Sequence[Array]]) -> list[list[Array]]:
        return [[(own * (1.0 - 0.3**2)) ** 0.5 * e for e in errors[0]], [0.0 * e for e in errors[1]]]

    monkeypatch.setattr(shared, "apart", apart)
    return selection.merit_of(UNNAMED, best, RECORDS) is not None


def explained(error: Array, item: Item) -> bool:
    """Whether time and drive alone explain an error."""
    return bool(np.abs(shared._without(error, shared._shared(item, ()))).max() < 1e-6)


def late(share: float) -> bool:
    """Whether the drive through a lag of this share of the record is explained."""
    item = sine(2000)
    step = 1.0 / (share * (len(item.run.t) - 1))
    held = np.exp(-step)
    early, now = (1.0 - held) / step - held, 1.0 - (1.0 - held) / step  # the drive is straight between samples
    v = item.run.v - item.run.v[0]
    moved = np.append(0.0, early * v[:-1] + now * v[1:])
    return explained(lfilter([1.0], [1.0, -held], moved), item)


row("what_a_column_explains_alone", "OWN_SHARE", {0.1: True, 0.06: False}, of_its_own)
row("a_drift_is_shared_by_any_column", "SHARED_DEGREE", {5: True, 8: False}, lambda degree: explained(
    np.polynomial.legendre.Legendre.basis(degree)(np.linspace(-1.0, 1.0, 2000)), sine(2000)))
row("a_late_drive_is_shared_by_any_column", "SHARED_LAGS", {0.02: True, 0.05: False}, late)


# Held-out records and effects of a given model ---------------------------------------------------------------


def creeps(*times: float, weight: float = 0.02) -> ExponentialCreep:
    return ExponentialCreep(name="creep", time_constants=times, weights=(weight,) * len(times))


def near(effect: Effect) -> Any:
    return hypothesis.near(effect)


def largest(effect: Effect, weight: float) -> Any:
    """Largest responses to a start state, beside plays of this weight, divided by the drive's range."""
    item = sine(2000, history=None)
    return Actuator(np.array([0.0]), (), (effect,)).largest(item, np.array([weight]))[1:] / item.run.drive_range


SLOW = creeps(1.0, weight=0.1)
RINGING = Resonance(name="resonance", frequency=5.0, damping=0.02)

row("enough_to_compare", "COMPARED_SAMPLES",  # after a known start memory, or one that moves up and down reveal
    {(24, None): True, (16, None): False, (24, ()): True, (16, ()): False}, lambda samples, memory: preparing.enough(
        [Course("made", *[np.resize([0.0, 50.0, 100.0, 50.0], samples)] * 2, memory, 0, samples)]))
row("numbers_move_by_up_to_a_factor", "NOMINAL_RANGE",
    {("low", 0.2, 0.5): True, ("high", 2.0, 5.0): True}, lambda end, least, most: all(
        least < factor < most for factor in np.exp(getattr(near(creeps(0.1, 1.0, 10.0, 100.0)), end))))
row("long_lists_have_one_factor", "SINGLE_FACTORS",
    {4: 8, 5: 2}, lambda number: len(near(creeps(*(10.0**k for k in range(number)))).start))
row("what_limits_the_start_of_an_effect", "START_SPAN",  # left by a drive of at most twice the range
    {(): True}, lambda: np.allclose(largest(SLOW, 0.1), 2.0 * 0.1 * SLOW.largest(sine(2000).run)))
row("a_start_without_a_limit_has_none_beside_plays_that_weigh_nothing", "",
    {(): True}, lambda: bool(np.all(largest(RINGING, 0.0) == np.inf)))


@decides("SET_ASIDE", {(): True})
def the_end_of_a_record() -> Any:
    """A little less than a third of a record is set aside."""
    (beginning,), (end,) = preparing.parted([sine(1000)])
    assert np.count_nonzero(beginning.known) + np.count_nonzero(end.known) == 1000
    return 200 < np.count_nonzero(end.known) < 334


@decides("FAST_RECORD", {0.7: [1, 4], 0.35: [2, 5]})
def a_fast_record(rate: float) -> Any:
    """Every third record is set aside, shifted if needed so that one of two fast records is fitted and one held out."""
    v, rates = np.linspace(0.0, 100.0, 101), [1.0, rate, 0.1, 0.1, 0.1, 0.1]
    return preparing.set_aside([Record(f"r{k}", np.arange(101) / rate, v, v) for k, rate in enumerate(rates)])


@decides("TOUCHING", {0.7e-6: True, 1.5e-6: False})
def a_front_at_its_limit_is_refitted(excess: float) -> Any:
    family, shape = hypothesis.front_of([DeadZone((-1.0, 0.0, 1.0), (0.5, 1.0, 0.5))], (-2.0, 2.0))
    tight = type("Tight", (type(family),), {"slack": lambda *_: np.array([-excess])})
    return hypothesis._inside(tight(family.drive, family.breaks), shape)


def bent(*slopes: tuple[float, float]) -> Callable[[Array], Array]:
    """A piecewise linear curve; each piece is given by its share of the range and its slope."""
    ends = np.concatenate([[0.0], np.cumsum([100.0 * share for share, _ in slopes])])
    values = np.concatenate([[0.0], np.cumsum([100.0 * share * slope for share, slope in slopes])])
    return lambda v: np.interp(v, ends, values)


def curved(odd: float, even: float) -> Callable[[Array], Array]:
    """A smooth curve with an odd and an even bend."""
    return lambda v: v - 50.0 * odd * (v / 50.0 - 1.0) ** 3 + 50.0 * even * (v / 50.0 - 1.0) ** 2


BOTH_NAMES = "saturation", "asymmetry"


@decides("LIMITER_STRAIGHT LIMITER_NEAR LIMITER_SLOPE ODD_FRONT", {
    bent((0.65, 1.0), (0.35, 0.3)): BOTH_NAMES[:1],
    bent((0.27, 0.9), (0.46, 1.0), (0.27, 0.3)): BOTH_NAMES[1:],  # straight over less than half of the range
    bent((0.25, 1.0), (0.25, 1.07), (0.25, 1.0), (0.25, 0.5)): BOTH_NAMES[1:],  # differ by over a tenth of their range
    bent((0.2, 0.97), (0.55, 1.0), (0.25, 0.5)): BOTH_NAMES[:1],
    bent((0.8, 1.0), (0.2, 0.5)): BOTH_NAMES[:1],
    bent((0.8, 1.0), (0.2, 0.7)): BOTH_NAMES,
    curved(0.2, 0.0617): BOTH_NAMES[:1],  # the odd bend has 2.7 times the even one's power
    curved(0.2, 0.0828): BOTH_NAMES[1:],  # 1.5 times
})
def what_a_front_is_called(curve: Any) -> Any:
    front: Any = SimpleNamespace(stages=lambda _: [SimpleNamespace(forward=curve)])
    return screening.front_names(front, np.empty(0), (0.0, 100.0))


# Thinning ----------------------------------------------------------------------------------------------------

STRAIGHT = np.linspace(0.0, 100.0, 65)
"""A straight drive."""

ODD = np.sqrt(2.0) * (np.arange(65) % 2)
"""An error in every other sample, with an rms of 1."""


def needed(v: Array, y: Array, noise: float = 0.01, column: Array | None = None, error: Any = 0.0) -> NDArray[np.bool_]:
    """Mask of the samples of a record that thinning keeps, given the error of its prediction."""
    run = Run(np.arange(len(v)) * 1e-3, v, {} if column is None else {"temperature": column})
    return needed_samples([Item("r", run, y, None, 10.0)], [error + np.zeros(len(v))], noise)[0]


def turning(v: Array, noise: float) -> Any:
    return needed(v, 0.1 * v, noise)


row("a_bump_of_the_prediction", "THIN_STEPS THIN_STRAIGHT",  # in multiples of the noise, on a straight drive
    {0.25: False, 0.35: True}, lambda height: needed(
        STRAIGHT, 0.1 * STRAIGHT + np.interp(np.arange(65), [8, 16, 24], [0.0, height * 0.01, 0.0]))[16])
row("a_small_turn_of_the_drive", "THIN_TURNING",  # the turn of 0.4 in the output is 0.036 or 0.024 times the noise
    {11.0: True, 16.5: False}, lambda noise: turning(STRAIGHT + 4.0 * (np.arange(65) == 16), noise)[16])
row("a_column_that_jitters", "THIN_COLUMN",  # by rms / its range
    {0.007: False, 0.014: True}, lambda rms: np.count_nonzero(
        needed(STRAIGHT, 0.1 * STRAIGHT, column=STRAIGHT / 100.0 + rms * ODD)) > 60)
row("what_is_not_predicted", "THIN_RESIDUAL",  # about a line, in multiples of the noise
    {1.3: False, 2.0: True}, lambda rms: np.count_nonzero(
        needed(STRAIGHT, 0.1 * STRAIGHT + 0.01 * rms * ODD, error=0.01 * rms * ODD)) > 60)
row("the_longest_stretch", "THIN_STEPS",  # on a straight drive one sample in 32 is kept
    {(): 32}, lambda: np.diff(np.flatnonzero(turning(np.linspace(0.0, 100.0, 513), 0.01))).max())


# The noise floor ---------------------------------------------------------------------------------------------


def steps(lengths: Sequence[int], sigmas: Sequence[float]) -> Item:
    """Holds at two alternating levels, each with white noise of its own rms."""
    random = np.random.default_rng(0)
    v = np.repeat(np.resize([0.0, 100.0], len(lengths)), lengths).astype(np.float64)
    y = 0.1 * v + np.concatenate([random.normal(0.0, s, n) for n, s in zip(lengths, sigmas, strict=True)])
    return Item("steps", Run(np.arange(len(v)) * 1e-3, v), y, None, 10.0)


def holds(item: Item, more: Any = 0.0) -> float | None:
    return noise_floor([replace(item, y=item.y + more)]).holds


def redriven(item: Item, v: Array) -> Item:
    return replace(item, run=Run(item.run.t, v))


SIXTY, EIGHTY = steps([60] * 20, [0.01] * 20), steps([80] * 20, [0.01] * 20)
N = np.arange(20 * 60)

row("length_of_a_hold", "HOLD_SAMPLES",
    {50: True, 30: False}, lambda samples: holds(steps([samples] * 20, [0.01] * 20)) is not None)
row("jitter_of_the_drive", "HOLD_SAMPLES HOLD_DRIVE HOLD_SETTLING",  # steps within a hold, on a range of 100
    {0.015: True, 0.03: False},
    lambda jitter: holds(redriven(SIXTY, SIXTY.run.v + jitter * (N % 2) + 1e-6 * N % 1e-5)) is not None)
row("a_coarse_drive", "COARSE_DRIVE",  # it toggles between two codes, on a range of 100
    {0.09: True, 0.11: False},
    lambda code: holds(redriven(SIXTY, code * (np.round(SIXTY.run.v / code) + N % 2))) is not None)
row("settling_is_no_noise", "HOLD_SETTLING",
    {(): pytest.approx(0.01, rel=0.2)},
    lambda: holds(EIGHTY, np.where(np.arange(1600) % 80 < 28, 1.0, 0.0) * np.sin(np.arange(1600))))
row("quiet_holds_count", "QUIET_HOLDS",  # a little more or less than a quarter of twenty holds
    {6: pytest.approx(0.01, rel=0.2), 4: pytest.approx(0.1, rel=0.2)},
    lambda quiet: holds(steps([400] * 20, [0.01] * quiet + [0.1] * (20 - quiet))))
row("a_long_hold_counts_as_fifty", "HOLD_WEIGHT",
    {30: pytest.approx(0.01, rel=0.4), 12: pytest.approx(0.1, rel=0.4)},
    lambda quiet: holds(steps([41] * quiet + [8000], [0.01] * quiet + [0.1])))
row("records_without_noise", "LEAST_NOISE",  # a simulation gets the noise of the finest sensor; range 10
    {"rms": pytest.approx(1e-4, rel=0.01), "ruled": "resolution"},
    lambda what: getattr(noise_floor([replace(sine(5000), y=0.1 * sine(5000).run.v)]), what))
row("a_coarse_converter", "",  # the noise is below its step, so rounding sets the floor
    {0.5: pytest.approx(0.5 / np.sqrt(12.0), rel=0.3)},
    lambda step: noise_floor([replace(sine(5000), y=step * np.round(sine(5000).y / step))]).rms)


@decides("RING_DECAY RING_UNPREDICTED", {
    (0.49, 2.0 * 0.7 * np.cos(0.32), 4000): False,  # decays by 0.7 per sample
    (0.95**2, 2.0 * 0.95 * np.cos(0.32), 4000): True,
    (0.846, 0.0, 20_000): True,  # 0.28 of the variance is not predicted
    (0.825, 0.0, 20_000): False,  # 0.32
})
def a_hold_that_rings(b: float, a: float, samples: int) -> Any:
    """A hold is left out if an oscillation that white noise sustains is predictable enough."""
    ringing = lfilter([1.0], [1.0, -a, b], np.random.default_rng(2).normal(0.0, 0.01, samples))
    return holds(steps([30, samples], [0.0, 0.0]), np.concatenate([np.zeros(30), ringing])) is None


@decides("PERIOD_REPEATS", {0.1: True, 0.2: False})
def periods_of_a_jittering_drive(jitter: float) -> Any:
    """Periods differ by 1.4e-3 or 2.8e-3 of the range, rms."""
    random = np.random.default_rng(5)
    turns = np.concatenate([[0.0, 100.0], random.uniform(0.0, 100.0, 18)])
    v = np.tile(np.interp(np.arange(1000), np.arange(21) * 50, [*turns, 0.0]), 5) + random.normal(0.0, jitter, 5000)
    return noise_floor([redriven(sine(5000), v)]).periods is not None


@decides("", {(): (pytest.approx(0.02, rel=0.15), "periods")})
def two_equal_periods_show_the_noise() -> Any:
    """Two equal periods show the noise although differences between samples do not: the drive is too fast."""
    random = np.random.default_rng(3)
    item = redriven(sine(2000), np.tile(100.0 * random.normal(size=1000), 2))
    floor = noise_floor([replace(item, y=0.1 * item.run.v + random.normal(0.0, 0.02, 2000))])
    return floor.rms, floor.ruled


@decides("HELD_SHARE", dict.fromkeys(itertools.product((1, 2, 5), ("held", "straight")), pytest.approx(5e-3, rel=0.35)))
def samples_between(kept: int, between: str) -> Any:
    """Only one sample in `kept` was measured; the noise is found whether the others are held or interpolated, and a
    fast sine is not taken for noise."""
    t = np.arange(6000)
    y = np.sin(2.0 * np.pi * t / (40.0 * kept)) + np.random.default_rng(4).normal(0.0, 0.005, 6000)
    y = np.repeat(y[::kept], kept) if between == "held" else np.interp(t, t[::kept], y[::kept])
    return noise_floor([replace(sine(6000), y=y)]).differences


# Edges and drives --------------------------------------------------------------------------------------------


def edges(v: Any) -> list[int]:
    return np.flatnonzero(signals.unresolved_edges(np.asarray(v, dtype=np.float64))).tolist()  # type: ignore[no-any-return]


row("a_jump", "EDGE",  # on a range of 100
    {5.0: [20, 21, 40, 41, 60, 61], 2.0: [20, 21, 40, 41]},
    lambda jump: edges(np.repeat([0.0, 100.0, 50.0, 50.0 + jump], 20)))
row("an_edge_that_is_resolved", "EDGE_SAMPLES", {1: [20, 21], 2: [20, 21, 22], 3: []},
    lambda samples: edges([0.0] * 20 + np.linspace(0.0, 100.0, samples + 1)[1:].tolist() + [100.0] * 20))
row("a_drive_that_does_not_stand", "EDGE_STANDS",  # edges need a drive that stands between jumps
    {5: True, 3: False}, lambda stands: edges(np.tile(np.repeat([0.0, 100.0], stands), 8)) != [])
row("fast_triangles_have_no_edges", "", {(): []}, lambda: edges([0.0, 50.0, 100.0, 50.0] * 20))
row("a_small_turn", "REVERSAL", {1.4: 0, 3.0: 2}, lambda turn: len(signals.reversals(
    np.interp(np.arange(300), [0, 100, 130, 299], [0.0, 50.0, 50.0 - turn, 100.0]))))
row("ends_of_loops", "LOOP_ENDS", {93.0: True, 86.0: False},
    lambda top: signals.one_loop([sweep(0, 100, 0, 100, 0), sweep(0, top, 0, top, 0)]))
row("speeds_of_loops", "LOOP_SPEEDS", {1.35: True, 1.8: False},
    lambda slower: signals.one_speed([sweep(0, 100, 0, 100, 0), sweep(0, 100, 0, 100, 0, seconds=slower)]))
row("a_loop_that_stands_is_none", "LOOP_STANDS",  # samples of each hold; a move takes 200
    {50: True, 160: False}, lambda hold: signals.one_loop([driven(np.tile(
        np.interp(np.arange(400 + 2 * hold), [0, 199, 200 + hold, 399 + hold], [0.0, 100.0, 100.0, 0.0]), 3))]))
row("a_short_drive_does_not_repeat", "LINE_SAMPLES",
    {80: 20, 50: None}, lambda samples: signals.repetition(np.cos(2.0 * np.pi * np.arange(samples) / 20.0)))
row("a_noisy_drive_repeats", "DRIVE_REPEATS",  # rms difference between periods, on a range of 100
    {0.7: True, 1.4: False}, lambda noise: signals.repetition(noise / np.sqrt(2.0) * hiss(3000) + np.tile(
        np.interp(np.arange(500), [0, 100, 250, 400, 500], [0.0, 100.0, 20.0, 70.0, 0.0]), 6)) is not None)
row("a_drive_that_mostly_rests", "DRIVE_AWAY",  # a shifted copy differs by sqrt(2 duty), rms
    {0.05: True, 0.015: False},
    lambda duty: signals.repetition(np.tile(np.where(np.arange(400) < 400 * duty, 1.0, 0.0), 6)) is not None)


# Whole records -----------------------------------------------------------------------------------------------


def without(x: Array, *others: Array) -> Array:
    """A signal with its projections on others removed one by one, scaled back to unit variance."""
    for to in others:
        x = x - float(x @ to) / float(to @ to) * to
        x = (x - np.mean(x)) / np.std(x)
    return x


def late(record: Record) -> Array:
    """The prediction of a model with a small lag."""
    return np.asarray(lfilter([0.5], [1.0, -0.5], record.v, zi=[0.5 * record.v[0]])[0])


def straight(record: Record) -> Array:
    """The prediction of a model without a loop."""
    return np.asarray(0.1 * record.v)


def kinds_of(*records: Record, predict: preparing.Predict = straight) -> list[tuple[str, str]]:
    return [(each.kind, str(each.entry()["record"])) for each in preparing.checked(records, predict)[1]]


def good(y: float = 10.0) -> list[Record]:
    return [record(100.0 * smooth(k), y * smooth(k), f"good{k}") for k in range(3)]


CLIPPED = np.clip(smooth(0), -1.0, 1.0)

row("other_units_of_all", "SCALE_OF_ALL",
    {2.5: [], 3.5: [("scale", "all")]}, lambda factor: kinds_of(*good(10.0 * factor)))
row("a_narrow_record_shows_no_scale", "SCALE_OF_ONE WIDE_DRIVE",
    {40.0: [("scale", "odd")], 20.0: []}, lambda width: kinds_of(
        *[record(100.0 * CLIPPED, 10.0 * CLIPPED, each) for each in "abc"],
        record(width * CLIPPED, 0.2 * width * CLIPPED, "odd")))
row("a_drive_in_another_unit_is_no_measure", "OTHER_UNIT",  # it would make all other drives look narrow
    {25.0: [], 35.0: [("scale", "odd")]}, lambda times: kinds_of(
        record(CLIPPED, 0.1 * CLIPPED, "a"), record(CLIPPED, 0.1 * CLIPPED, "b"), record(CLIPPED, 0.2 * CLIPPED, "odd"),
        record(times * CLIPPED, 0.1 * times * CLIPPED, "wide")))
row("a_dead_sensor", "DEAD_SENSOR SCALE_OF_ONE", {0.07: [("scale", "dead")], 0.14: []},
    lambda share: kinds_of(*good(), record(100.0 * smooth(7), share * 10.0 * smooth(8), "dead")))
row("an_output_that_hardly_follows_shows_no_scale", "FOLLOWS SCALE_OF_ONE",
    {0.85: [], 0.95: [("scale", "loose")]}, lambda correlation: kinds_of(*good(), record(
        100.0 * smooth(7),
        20.0 * (smooth(7) + np.sqrt(1.0 / correlation**2 - 1.0) * without(smooth(8), smooth(7))), "loose")))
row("an_output_follows_its_drive", "FOLLOWS LOOP_AREA",  # exchanged columns, by loop area / expected one
    {0.4: True, 0.2: False}, lambda area: ("swapped_channels", "r") in kinds_of(record(
        smooth(3) + area * (late(record(smooth(3), smooth(3))) - smooth(3)), smooth(3), "r"), predict=late))


@decides("FOREIGN_CORRELATION OWN_CORRELATION", {
    (0.97, 0.0): True, (0.93, 0.0): False, (1.0, 0.45): True, (1.0, 0.55): False,
})
def the_output_of_another_record(foreign: float, own: float) -> Any:
    """A record is exchanged if its output follows another record's prediction and not its own."""
    rest = without(smooth(8), other := smooth(0))
    v = own * other + np.sqrt(1.0 - own**2) * rest
    y = foreign * other + np.sqrt(1.0 - foreign**2) * without(smooth(9), rest, other)
    return ("exchanged_records", "foreign") in kinds_of(*good(), record(100.0 * v, 10.0 * y, "foreign"))


@decides("LOOP_SIGMAS", {7.5: True, 3.5: False})
def a_loop_counts_against_noise(sigmas: float) -> Any:
    """A loop shows which column is the drive only if its area is large against the area that noise makes."""
    v = smooth(3, 4000)
    y = expected = late(record(v, v))
    area = 0.5 * abs(float(np.sum(v[:-1] * y[1:] - v[1:] * y[:-1])))
    noise = area / sigmas / (0.5 * float(np.sqrt(np.sum((v[2:] - v[:-2]) ** 2))))
    y = y + np.random.default_rng(1).normal(0.0, noise, len(y))
    return preparing._against(record(v, y), expected).sense > 0.0


@decides("OFF_LINE ON_LINE", {(0.05, 8.0): True, (0.05, 4.5): False, (0.15, 12.0): True, (0.25, 12.0): False})
def a_few_samples_far_off_do_not_count(share: float, scatters: float) -> Any:
    random = np.random.default_rng(4)
    x = random.uniform(-1.0, 1.0, 4000)
    y = x + random.normal(0.0, 0.05, 4000)
    off = np.where(np.arange(4000) < int(4000 * share), x + 0.05 * scatters, y)
    return preparing._line(x, off)[1] == pytest.approx(preparing._line(x, y)[1], abs=1e-3)


@decides("RAIL_PASSED", {0.007: "saturated", 0.014: "held_samples"})
def a_converter_ends_at_its_end(share: float) -> Any:
    """A value is not the converter's end if another record exceeds it by too large a share of the range."""
    end = 10.0 * (1.0 - share)
    tops = {"a": end, "b": 10.0}
    items = [replace(driven(np.arange(3.0), name=name), y=np.array([0.0, 1.0, top])) for name, top in tops.items()]
    (each,) = preparing.not_at_the_end([Saturated("a", None, "largest", end, 5)], items)
    return each.kind


@decides("HISTORY_COSTS", {0.14: False, 0.16: True})
def a_history_that_costs_the_rest(rest: float) -> Any:
    v = np.interp(np.arange(400), [0, 50, 150, 400], [50.0, 100.0, 0.0, 50.0])
    item = Item("r", Run(np.arange(400) * 1e-3, v), v, (0.0,), 100.0)

    def model(start: float, rest: float) -> Any:
        error = np.where(np.arange(400) < settled(v, 10.0), start, rest) * np.resize([1.0, -1.0], 400)
        return SimpleNamespace(reach=10.0, errors=lambda _: [error])

    return preparing.bends([item], model(0.1, rest), model(1.0, 0.1)) is not None


# Spectra -----------------------------------------------------------------------------------------------------


def heard(item: Item, error: Any) -> list[float]:
    return sorted(frequency for _, frequency in signals.peaks(item, error))


def raised(noise: Array, height: float) -> Array:
    """Noise and a tone of 125 Hz whose bin has `height` times the median power around it."""
    n, k = len(noise), len(noise) // 8
    spectrum, line = (np.fft.rfft(x * np.hanning(n)) for x in (noise, tone(125.0, n)))
    around = np.median(np.abs(np.concatenate([spectrum[k - 40 : k - 3], spectrum[k + 4 : k + 40]])) ** 2)
    size = (np.sqrt(height * around) - np.abs(spectrum[k])) / np.abs(line[k])
    phase = 0.3 + np.angle(spectrum[k]) - np.angle(line[k])
    return np.asarray(noise + size * np.sin(2.0 * np.pi * 0.125 * np.arange(n) + phase))


def between(bins: int, middle: int, first: int, last: int) -> NDArray[np.complex128]:
    """A noise spectrum that is 30 times stronger in bins `first` to `last` on either side of the middle."""
    parts = np.random.default_rng(6).normal(size=(2, bins))
    spectrum = np.asarray(parts[0] + 1j * parts[1])
    for k in range(first, last):
        spectrum[[middle - k, middle + k]] *= 30.0
    return spectrum


row("share_of_a_line", "LINE_SHARE", {0.055: [pytest.approx(130.0)], 0.024: []},
    lambda share: heard(ramp(20_000), tone(130.0, 20_000, of_share(share)) + hiss(20_000)))
row("height_of_a_line", "LINE_HEIGHT",  # relative to its surroundings, in a short record
    {45.0: [pytest.approx(125.0)], 20.0: []}, lambda height: heard(ramp(600), raised(hiss(600), height)))
row("a_line_of_the_drive", "DRIVE_LINE_SHARE",  # a small share counts: the rest is one and a half slow swings
    {1.5e-6: False, 0.7e-6: True}, lambda share: bool(heard(driven(
        50.0 * np.cos(2.0 * np.pi * 0.375 * np.arange(4000) * 1e-3) + tone(125.0, 4000, float(np.sqrt(share)) * 50.0)),
        tone(125.0, 4000) + hiss(4000))))
row("height_of_a_line_of_the_drive", "PEAK_HEIGHT", {14.0: False, 7.0: True},
    lambda height: bool(heard(driven(raised(hiss(2000, 1), height)), tone(125.0, 2000) + hiss(2000))))
row("harmonics_of_a_carrier", "CARRIER_SHARE HARMONICS SAME_BINS",  # of 40 periods, by its share of the drive's power
    {(0.7, 3.0): False, (0.35, 3.0): True, (0.7, 8.0): False, (0.7, 12.0): True,
     (0.7, 3.025): False, (0.7, 3.05): True},  # 0.025 is one bin
    lambda share, harmonic: pytest.approx(10.0 * harmonic) in heard(
        driven(tone(10.0, 4000, float(np.sqrt(2.0 * share))) + np.sqrt(1.0 - share) * smooth(5, 4000)),
        tone(10.0 * harmonic, 4000) + 0.3 * hiss(4000)))
row("periods_of_a_line", "LINE_PERIODS", {10: True, 6: False},
    lambda periods: bool(heard(driven(hiss(4000, 9)), tone(periods / 4.0, 4000) + 0.3 * hiss(4000))))
row("samples_of_a_spectrum", "SPECTRUM_SAMPLES", {300: True, 200: False},
    lambda samples: bool(heard(ramp(samples), tone(250.0, samples) + 0.1 * hiss(samples))))
row("the_highest_bins", "CRESTS",  # of n equal tones
    {7: 5}, lambda n: len(heard(ramp(4000), sum(tone(50.0 + 40.0 * k, 4000) for k in range(n)) + 0.1 * hiss(4000))))


@decides("SURROUNDINGS", {(44, 80): True, (16, 40): False})
def surroundings_of_a_line(first: int, last: int) -> Any:
    spectrum = between(2001, 500, first, last)
    spectrum[500] = 120.0
    return pytest.approx(125.0) in heard(ramp(4000), np.fft.irfft(spectrum, 4000))


@decides("SPECTRUM_PARTS SURROUNDINGS_OF_PARTS", {(14, 24): True, (6, 12): False})
def surroundings_of_ringing_that_fades(first: int, last: int) -> Any:
    """Surroundings in bins of a part's spectrum; the peak is as wide as one such bin."""
    spectrum = between(2049, 1024, 8 * first, 8 * last)
    spectrum[1020:1028] *= 40.0
    found = signals._fading(ramp(4096), np.fft.irfft(spectrum, 4096))
    return any(abs(frequency - 250.0) < 3.0 for _, frequency in found)


@decides("SAME_RINGING", {0.013: 1, 0.03: 2})
def ringing_at_nearly_the_same_frequency(apart: float) -> Any:
    errors = [tone(f, 20_000) + 0.3 * hiss(20_000) for f in (100.0, 100.0 * (1.0 + apart))]
    found = signals.ringing([ramp(20_000), ramp(20_000)], errors, 5)
    return len([f for f in found if 99.0 < f < 104.0])


# Lines -------------------------------------------------------------------------------------------------------

TEN = [ramp(2000, name=f"r{k}") for k in range(10)]
FADING = np.where(np.arange(2000) < 1000, 1.0, 0.0)
LINE = Line(100.0, 1.0, 0.5, ("r",))


def in_ten(size: Callable[[int], Any]) -> list[Array]:
    """Errors of ten records with a line of 130 Hz, of amplitude `size(k)` in record k."""
    return [hiss(2000, k) + tone(130.0, 2000, size(k)) for k in range(10)]


row("a_line_rules", "RULING_SHARE", {0.4: True, 0.2: False}, lambda share: bool(
    disturbances.ruling([ramp(4000)], [tone(130.0, 4000, of_share(share)) + hiss(4000)])[0]))
row("a_line_in_a_few_records", "RULING_SHARE",  # in one of ten; told if it dominates that one
    {0.4: True, 0.2: False},
    lambda share: bool(disturbances.lines(TEN, in_ten(lambda k: of_share(share) * (k == 0)))[0]))
row("a_line_in_many_records", "SEEN_IN", {5: True, 3: False},
    lambda having: bool(disturbances.lines(TEN, in_ten(lambda k: of_share(0.15) * (k < having)))[0]))
row("steady_in_most_records", "COMMON_SHARE",  # in the others it stops at half time
    {7: True, 5: False},
    lambda many: disturbances.steady(TEN, in_ten(lambda k: 3.0 if k < many else 3.0 * FADING)) is not None)
row("a_line_that_fades", "STEADY_SHARE",  # by its second amplitude; one half predicts 0.58 or 0.39 of the other
    {0.46: True, 0.38: False}, lambda size: disturbances.steady([ramp(4000)], [
        tone(130.0, 4000, np.where(np.arange(4000) < 2000, 1.0, size)) + 0.05 * hiss(4000)]) is not None)
row("four_lines", "MOST_LINES", {6: 4}, lambda n: len(disturbances.lines(
    [ramp(4000)], [sum(tone(50.0 + 40.0 * k, 4000) for k in range(n)) + 0.1 * hiss(4000)])[0]))
row("mains", "MAINS_TOLERANCE", {50.08: 50.0, 50.15: None, 149.8: "3 x 50 Hz", 59.97: 60.0},
    lambda frequency: disturbances._mains(frequency, 1e-3))
row("the_rest_of_a_line", "SAME_LINE", {103.0: True, 108.0: False},
    lambda frequency: disturbances.is_known(replace(LINE, frequency=frequency), [LINE]))
row("a_ripple_is_no_line", "", {100.0: False},
    lambda pitch: disturbances.is_known(LINE, [Ripple(pitch, 1.0, 0.5, ("r",), False)]))


@decides("AMPLITUDE_SAMPLES", {1080.0: pytest.approx(1.5, rel=0.1), 945.0: pytest.approx(1.0, rel=0.1)})
def two_samples_a_period_do_not_show_an_amplitude(rate: float) -> Any:
    """A line of 450 Hz is twice as large in the second record; its amplitude there counts only if the rate is high
    enough."""
    items = [ramp(4000, 1.0 / 2000.0, "a"), ramp(4000, 1.0 / rate, "b")]
    errors = [tone(450.0, 4000, 1.0, 1.0 / 2000.0), tone(450.0, 4000, 2.0, 1.0 / rate)]
    (line, *_), _ = disturbances.lines(items, [e + 0.1 * hiss(4000, k) for k, e in enumerate(errors)])
    return line.amplitude


# Ripples -----------------------------------------------------------------------------------------------------


def rippled(low: float, high: float, samples: int, seed: int, grain: float = 0.0) -> tuple[Item, Array]:
    """A pass up and one down with a ripple of unit amplitude and pitch and some noise, together with its error."""
    places = np.concatenate([np.linspace(low, high, samples), np.linspace(high, low, samples)[1:]])
    error = np.sin(2.0 * np.pi * places) + 0.1 * hiss(len(places), seed)
    if grain:
        error = grain * np.round((places + error) / grain) - places
    return replace(driven(places, name=f"r{seed}"), y=places + error), error


def pitches(made: Sequence[tuple[Item, Array]]) -> list[float]:
    found = disturbances.in_position([item for item, _ in made], [error for _, error in made])
    return [] if found is None else [found.finding.place]


def short(length: float, samples: int) -> list[tuple[Item, Array]]:
    """Twelve short rippled records, each 1.3 pitches further on."""
    return [rippled(1.3 * k, 1.3 * k + length, samples, k) for k in range(12)]


UNIT = [pytest.approx(1.0, rel=0.01)]

row("samples_a_pitch", "RIPPLE_RESOLVED", {0.2: UNIT, 0.35: []},
    lambda step: pitches([rippled(0.0, 40.0, round(40.0 / step), k) for k in range(3)]))
row("samples_of_a_pass", "PASS_SAMPLES", {42: UNIT, 26: []}, lambda samples: pitches(short(4.5, samples)))
row("pitches_of_a_pass", "COMMON_SHARE PASS_SAMPLES PASS_PITCHES", {4.0: UNIT, 2.4: []},
    lambda length: pitches(short(length, 60)))
row("the_finest_pitch", "POSITION_BINS",  # by the number of pitches in the range
    {400: True, 700: False}, lambda n: pitches([rippled(0.0, float(n), 6000, k) for k in range(2)]) == UNIT)


@decides("COMMON_SHARE PITCHES", {2: True, 3: False})
def pitches_that_are_examined(others: int) -> Any:
    """The ripple is found behind two stronger pitches that occur only on the way up, but not behind three."""
    made = []
    for item, error in (rippled(0.0, 40.0, 2000, k) for k in range(3)):
        more = sum(2.5 * np.sin(2.0 * np.pi * item.run.v / pitch) for pitch in (1.3, 1.7, 2.2)[:others])
        more = more * (np.arange(len(error)) < 2000)
        made.append((replace(item, y=item.y + more), error + more))
    return pitches(made) == UNIT


@decides("CONVERTER_STEP", {0.014: True, 0.03: False})
def a_pitch_of_the_converter(beside: float) -> Any:
    made = [rippled(0.0, 40.0, 2000, k, 1.0 + beside) for k in range(3)]
    found = disturbances.in_position([item for item, _ in made], [error for _, error in made])
    assert found is None or found.finding.place == pytest.approx(1.0, rel=0.005)
    return found is None


# Stick-slip --------------------------------------------------------------------------------------------------


def slips(moves: Any, change: Any, noise: float) -> bool:
    """Whether stick-slip is found, given the moves of the prediction and the changes of the error per sample."""
    predicted, error = (np.concatenate([[0.0], np.cumsum(x)]) for x in (moves, change))
    return bool(disturbances.stick_slip([replace(driven(predicted), y=predicted + error)], [error], noise))


def slipping(ratios: Sequence[float], jump: float = 9.0) -> bool:
    """Whether stick-slip is found if stretches of seven samples move by these multiples of the prediction.

    A stretch that moves more than predicted does so in one jump; if the jump is too large, the stretch falls back.
    """
    change = [7.0 * (ratio - 1.0) for ratio in ratios]
    rows = [[jump, *[(each - jump) / 6.0] * 6] if each > 0.0 else [each / 7.0] * 7 for each in change]
    return slips(np.ones(7 * len(ratios)), np.concatenate(rows), 1.0)


def pattern(pairs: int, stretches: int, stands: float = 0.0, leaps: float = 2.2) -> list[float]:
    """Pairs of a standing and a leaping stretch, spread evenly among stretches that follow the prediction."""
    found = [1.0] * stretches
    for k in range(pairs):
        at = k * stretches // pairs
        found[at : at + 2] = [stands, leaps]
    return found


row("how_much_stands", "SLIP_RESOLVED SLIP_STRETCH SLIP_OFF SLIP_STANDS",
    {20: True, 11: False}, lambda pairs: slipping(pattern(pairs, 100)))
row("how_far_off_a_stretch_is", "SLIP_OFF",
    {0.7: True, 0.5: False}, lambda off: slipping(pattern(20, 100, 1.0 - off, 1.0 + off)))
row("how_large_a_jump_is", "SLIP_RESOLVED",  # in multiples of the noise
    {8.5: True, 5.5: False}, lambda jump: slipping(pattern(20, 100, 0.0, 1.9), jump))
row("how_many_jumps", "SLIP_JUMPS",
    {(7, 40): True, (4, 26): False}, lambda pairs, stretches: slipping(pattern(pairs, stretches)))
row("what_goes_on", "SLIP_CONTINUES",  # n standing stretches in a row, then n leaping ones
    {1: True, 2: True, 3: False},
    lambda n: slipping(([0.0] * n + [2.0] * n + [1.0] * 4) * (100 // (2 * n + 4))))
row("stretches_that_hardly_move_do_not_count", "SLIP_STRETCH",  # 2.8 times the noise; the others follow
    {(): False}, lambda: slips(np.repeat([1.0, 0.4], [490, 420]), np.concatenate(
        [np.zeros(490), np.tile([*[-0.4] * 7, 9.0, *[-6.2 / 6.0] * 6], 30)]), 1.0))


@decides("SLIP_LEAPS", {7: True, 3: False})
def how_much_leaps(leaping: int) -> Any:
    """Number of leaping stretches in a hundred; after the others that stand, the output catches up slowly."""
    ratios = np.array(pattern(20, 100, -0.2, 1.5))
    ratios[np.flatnonzero(ratios == 1.5)[:leaping]] = 2.2
    return slipping(ratios.tolist())


@decides("SLIP_MOVING", {0.35: True, 0.18: False})
def samples_that_hardly_move_do_not_count(slow: float) -> Any:
    """Samples slower than a quarter of the fast ones do not count, and the fast ones alone are too few."""
    fast = np.arange(160) % 7 < 2
    change = np.zeros(160)
    change[~fast] = np.resize([*[-slow] * 4, 4.0 * slow], np.count_nonzero(~fast))
    return slips(np.where(fast, 1.0, slow), change, 0.02)


@decides("SLIP_ALONE", {0.22: True, 0.35: False})
def a_fast_output_does_not_jump(beside: float) -> Any:
    """Jumps are 4.5 or 2.9 times as large as the moves around them; in a smooth output both are alike."""
    row = [1.0, *[beside, -beside] * 3, beside, 1.0 - beside]
    y = np.cumsum(np.tile(row, 60))
    moves = np.diff(np.linspace(0.0, float(y[-1]), len(y)))
    return slips(moves, np.diff(y) - moves, 0.02)


# Descriptions ------------------------------------------------------------------------------------------------


def scattered(samples: int) -> Item:
    """A record whose drive covers the whole range in every block of samples."""
    return driven(np.random.default_rng(0).uniform(0.0, 100.0, samples))


def shares(error: Callable[[Array], Array], samples: int = 20_000) -> tuple[float, dict[str, float]]:
    """`content.shares` of an error that is a function of the drive as a share of its range."""
    item = scattered(samples)
    return content.shares([item], [error(item.run.v / 100.0)])


def parity(share: float, waves: int, samples: int) -> bool:
    """Whether an even part is found in an error of which it has this share of the variance."""
    item = scattered(samples)
    error = of_share(share) * np.cos(2.0 * np.pi * waves * item.run.v / 100.0) + hiss(samples, 1)
    return content.even_share([item], [error]) is not None


def described(monkeypatch: pytest.MonkeyPatch, **known: Any) -> Any:
    """Description of an error for which these functions of `content` give known answers."""
    for name, answer in known.items():
        monkeypatch.setattr(content, name, lambda *_, answer=answer: answer)
    return content.described([scattered(500)], [hiss(500)], 1.0, ())


def said(found: Result) -> str:
    return Diagnosis(found, None, (), ()).sentence()  # type: ignore[arg-type]


row("a_variable_that_matters", "VARIABLE_SHARE", {0.14: True, 0.07: False},
    lambda share: "drive" in shares(lambda x: of_share(share) * np.sin(2.0 * np.pi * x) + hiss(20_000, 1))[1])
row("bins_of_a_variable", "VARIABLE_BINS",  # 24 bins see two thirds of eight waves over the range
    {8.0: pytest.approx(0.7, abs=0.1)}, lambda waves: shares(lambda x: np.sin(2.0 * np.pi * waves * x))[1]["drive"])
row("folds", "VARIABLE_BINS FOLD_BLOCKS",  # a drift is explained in half the blocks of time: a bin is 2/3 of a block
    {9600: pytest.approx(0.35, abs=0.1)},
    lambda samples: shares(lambda x: np.linspace(-1.0, 1.0, len(x)), samples)[1]["session time"])
row("samples_of_a_description", "DESCRIBED_SAMPLES",
    {300: True, 150: False}, lambda samples: shares(lambda x: x - 0.5, samples)[0] > 0.0)
row("memory_in_place_of_one_variable", "MEMORY_WINS", {0.6: "memory", 0.45: "drive"}, lambda free, monkeypatch:
    described(monkeypatch, shares=(0.4, {"drive": 0.4}), together=(free, 0.7)).main_variable)
row("rate_free", "RATE_FREE_SHARE", {0.8: True, 0.6: False}, lambda free: content._rate_free(free, 1.0))
row("repeatable", "REPEATABLE_SHARE",
    {0.6: True, 0.4: False}, lambda share, monkeypatch: described(monkeypatch, repeatable=share).repeatable)
row("parity", "PARITY_BINS PARITY_SAMPLES PARITY_SHARE", {
    (0.09, 1, 40_000): True, (0.035, 1, 40_000): False,  # of the variance
    (0.1, 8, 40_000): True, (0.1, 12, 40_000): False,  # twenty bins see 0.57 or 0.25 of it
    (0.9, 1, 640): True, (0.9, 1, 300): False,  # 16 or 7 samples a bin
}, parity)
row("above_the_noise", "STRETCH_ABOVE_NOISE FAST_QUANTILE",  # error of an eighth of the record / noise
    {1.6: True, 1.4: False}, lambda times: bool(content.worst(
        [ramp(2400)], [np.where(np.arange(2400) < 300, times, 1.0) * np.resize([1.0, -1.0], 2400)], 1.0)))
row("ends_of_the_range", "RANGE_END RANGE_END_SHARE",  # 4 % windows: two fifths of the third lie in the first tenth
    {(): {("range_end", (0.0, 0.199)), ("moving", (0.2, 2.199)), ("range_end", (2.2, 2.399))}},
    lambda: {(each.kind, each.interval) for each in content.worst([ramp(2400)], [np.ones(2400)], 0.1)})
row("what_a_verdict_says_first", "MUCH_LEFT FEW_COMPARED", {  # by error / noise, and by samples compared of 100
    (2.0, 100): "Missing: lag", (4.0, 100): "An error of 0.08 um rms is not explained, 4 times the noise",
    (2.0, 20): "Only 20 of 100 samples were compared", (2.0, 40): "Missing: lag",
}, lambda times, compared: said(replace(
    result("effects_found", ["lag"], times * 0.02, []), compared=(compared, 100))).split(". ")[0].removesuffix("."))
row("what_the_sentence_is_about", "MAIN_SHARE", {0.6: "The records are", 0.4: "Something is missing"},
    lambda share: " ".join(said(result("unexplained", (), 0.5, [
        Line(frequency=50.0, amplitude=0.1, share=share, records=("r",)), STRUCTURE])).split()[:3]).rstrip(":,;"))


@decides("FAST_QUANTILE", {(): [(1.8, 1.999)]})
def fast() -> Any:
    """A third of the record is twice as fast as most of it, a twelfth is ten times as fast: only that is `fast`."""
    rates = np.repeat([1.0, 2.0, 1.0, 10.0, 1.0], [700, 800, 300, 200, 400])
    item = driven(np.cumsum(np.resize(np.repeat([1.0, -1.0], 25), 2400) * rates))
    return [each.interval for each in content.worst([item], [np.ones(2400)], 0.1) if each.kind == "fast"]


@decides("HELD_OUT_ALONE", {(): ("b",)})
def held_out_records_that_are_alone() -> Any:
    """Held-out records have 2.5 or 3.5 times the error of a fitted one; only the latter is told."""
    items = [ramp(2000, name=name) for name in ("fit", "a", "b")]
    errors = [size * hiss(2000, k) for k, size in enumerate((1.0, 2.5, 3.5))]
    ready = Prepared(items[:1], items[1:], [], [], (0.0, 100.0), np.zeros(1))
    (left,) = content._unexplained(ready, [errors[:1], errors[1:]], 0.5, 1.0, [])
    return left.entry()["held_out_alone"]


# Starts of searches ------------------------------------------------------------------------------------------


def front(label: str) -> Option:
    bare = Structure(np.array([0.0]), Kept())
    (found,) = [each for each in screening._fronts(bare, bare, (0.0, 100.0)) if each.label == label]
    return found


def slopes(label: str, start: Any) -> Array:
    """Slopes of the front at 200 drives, divided by their mean."""
    w = np.linspace(0.0, 100.0, 201)
    for stage in front(label).structure.front.stages(np.asarray(start)):
        w = stage.forward(w)
    return np.asarray(np.diff(w) / np.mean(np.diff(w)))


row("a_limiter_is_near_a_start", "LIMITERS",  # within a factor of two, for 0.02 to 0.15 of the range
    dict.fromkeys((0.02, 0.03, 0.05, 0.08, 0.12, 0.15), True),
    lambda depth: any(abs(np.log2(depth / start[0])) < 1.0 for start in front("front with flatter ends").starts))


@decides("BREAKS FINER_BREAKS", {("front of dead zones", 0.25): True, ("front of more dead zones", 0.125): True})
def breaks_divide_the_range(label: str, wide: float) -> Any:
    breaks = np.array([0.0, *front(label).structure.front.breaks, 100.0])  # type: ignore[attr-defined]
    return bool(0.5 * wide < np.max(np.diff(np.unique(breaks))) / 100.0 <= wide)


@decides("TANH_BEND TANH_SIDE", {(): True})
def envelopes_bend_either_way() -> Any:
    """Starts bend up and down alike: the slope at one end is 1.6 to 2.2 times that at the other."""
    label = "front of one tanh"
    bends = [float(np.log(each[-1] / each[0])) for each in (slopes(label, start) for start in front(label).starts)]
    assert min(bends) == pytest.approx(-max(bends))
    return 0.5 < max(bends) < 0.8


# Inverses that do more than recordings bear out --------------------------------------------------------------


def wild(moves: float, wilder: float, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether an inverse is wild, with a gain of 0.5 and noise of 0.1."""
    monkeypatch.setattr(harm, "_drives", lambda *_: SimpleNamespace(wilder=wilder))
    monkeypatch.setattr(harm, "_over", lambda *_: harm.Wild(moves, moves, 0.5, wilder))
    model: Any = None
    return harm.wild(model, model, [model], 0.5, 0.1) is not None


row("a_drive_that_is_rougher", "WILDER", {2.2: True, 1.8: False},
    lambda wilder, monkeypatch: wild(50.0, wilder, monkeypatch))
row("an_output_that_moves_further", "BEYOND_GAIN", {3.3: True, 2.7: False},
    lambda times, monkeypatch: wild(times * 0.5, 50.0, monkeypatch))


# Numbers that tests of whole selections notice ---------------------------------------------------------------

also(test_selection.test_a_small_share_of_edges_is_a_name_by_the_fitted_records, "NAME_SHARE")
also(test_selection.test_a_rival_that_leaves_the_same_errors_is_not_followed_up, "NEEDLESS")
also(test_selection.test_next_to_plays_that_depend_on_the_rate_an_element_takes_most, "MOST_OF_GAP")
also(test_selection.test_nearly_all_that_is_left_is_worth_a_name, "NEARLY_ALL")
also(test_selection.test_what_is_left_is_enough_where_all_but_the_noise_of_it_is, "FIRST_REMOVES FURTHER_REMOVES")
also(test_selection.test_all_records_decide_between_equal_numbers, "BETTER")
also(test_selection.test_what_is_free_in_a_record_is_no_merit, "BETTER")
also(test_selection.test_of_one_loop_alone_what_explains_most_is_named, "MOST_OF_GAP")
also(test_selection.test_one_loop_leaves_open_what_fitted_records_explain_unless_others_bear_it_out, "MOST_OF_GAP")
also(test_selection.test_a_number_at_an_end_of_its_range_explains_nine_tenths, "END_LEAVES")
also(test_selection.test_a_wider_range_where_a_number_is_at_its_end, "WIDER")
also(test_selection.test_how_often_a_range_is_widened, "WIDENINGS")

# fmt: on

# Tests of the table ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("one", "given", "expected"),
    [pytest.param(each, *case, id=f"{each.name}-{k}") for each in ROWS for k, case in enumerate(each.cases)],
)
def test_a_case_on_one_side(one: thresholds.Row, given: tuple[Any, ...], expected: Any) -> None:
    assert one.answer(given) == expected


@pytest.mark.parametrize("factor", [2.0, 0.5])
@pytest.mark.parametrize("number", thresholds.names())
def test_a_number_that_changes_is_noticed(number: str, factor: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """If a number is doubled or halved, a row that it decides gives another answer."""
    monkeypatch.setattr(acceptance, number, thresholds.changed(getattr(acceptance, number), factor))
    assert not all(each.holds() for each in thresholds.rows(number))


def test_every_number_has_a_unit_a_reason_and_a_run() -> None:
    texts = {name: text for together, text in thresholds.texts() for name in together}
    assert set(texts) == set(thresholds.names())
    for name, text in texts.items():
        assert text.startswith("["), name
        assert any(words in text for words in ("Set by:", "Changed by:", "Derived")), name


def test_a_text_names_rows_of_its_numbers() -> None:
    """Tests named in the text of a number decide it; numbers that stand together share a text."""
    for together, text in thresholds.texts():
        names = {each.name for number in together for each in thresholds.rows(number)}
        assert set(re.findall(r"(?:acceptance|selection)::(\w+)", text)) <= names, text


def test_every_number_is_read_somewhere() -> None:
    """Every number is read by another module or by a function of `acceptance`."""
    sources = "".join(path.read_text() for path in (thresholds.ROOT / "hystgen").rglob("*.py"))
    own = ast.parse(inspect.getsource(acceptance)).body
    inside = {getattr(node, "id", "") for each in own if isinstance(each, ast.FunctionDef) for node in ast.walk(each)}
    assert [name for name in thresholds.names() if f"acceptance.{name}" not in sources and name not in inside] == []


def test_the_page_lists_the_rows_of_every_number() -> None:
    if os.environ.get("HYSTGEN_UPDATE_GOLDEN"):
        thresholds.TABLE.write_text(thresholds.table(), encoding="utf-8")
    assert thresholds.TABLE.read_text(encoding="utf-8") == thresholds.table(), "HYSTGEN_UPDATE_GOLDEN=1 renews it"
