"""What lies on either side of the numbers in `acceptance`: a table of cases just below each number and just above.

The tests of the table stand at the end.
"""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import test_selection
import thresholds
from made_up import HELD, NOISE, RECORDS, STRUCTURE, Hypothesis, Made, World, first_of, result, sweep
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import wilcoxon
from thresholds import ROWS, decides

from hystgen.diagnosis import Diagnosis
from hystgen.diagnosis.data import disturbances, preparing, signals
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.data.items import needed as needed_samples
from hystgen.diagnosis.data.preparing import Prepared, prepare
from hystgen.diagnosis.data.signals import noise_floor
from hystgen.diagnosis.findings import content
from hystgen.diagnosis.findings.kinds import Line, Ripple, Saturated
from hystgen.diagnosis.search import acceptance, fits, harm, hypothesis, screening, selection
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.hypothesis import Actuator, Structure
from hystgen.diagnosis.search.screening import Option
from hystgen.effects.base import Run
from hystgen.effects.creep.model import ExponentialCreep
from hystgen.effects.resonance.model import Resonance
from hystgen.front.dead_zone.model import DeadZone
from hystgen.identification.joint import Ends, Kept
from hystgen.identification.quality import correlation_time
from hystgen.identification.reduction import Course, settled
from hystgen.records import Record

pytestmark = pytest.mark.thorough

Array = NDArray[np.float64]


@decides("NOISE", "FAR_ABOVE_NOISE", "STRUCTURE_SHARE", {
    (1.2, 0.2): True, (1.3, 0.2): False, (1.9, 0.1): True, (2.1, 0.1): False, (1.9, 0.16): False,
})  # fmt: skip
def noise(error: float, share: float) -> Any:
    """Above the floor, structured or not."""
    return acceptance.is_noise(error, 1.0, share)


@decides("P_SURE", "P_REPEATED", {
    (0.0015, 0.5): False, (0.0007, 0.5): True, (0.07, 1e-6): False, (0.04, 1e-6): True, (0.04, 0.0015): False,
})  # fmt: skip
def chance(held_out: float, fitted: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The p-value of held-out RECORDS, or a larger one beside a small one of the fitted records."""
    better = Made("better", 1, (0.6, 0.6))
    best = screening.Tried(SimpleNamespace(name="better"), better, ("better",), 0.5, better.errors(HELD))  # type: ignore[arg-type]
    monkeypatch.setattr(selection, "difference", lambda _, after: held_out if after is best.errors else fitted)
    return selection.merit_of(Made("now", 1, (1.0, 1.0)), best, RECORDS) is not None  # type: ignore[arg-type]


@decides("P_DIFFERENT", {0.015: True, 0.007: False})
def effects_are_alike(p_value: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """However far apart their errors are."""
    monkeypatch.setattr(selection, "difference", lambda *_: p_value)
    one, other = (SimpleNamespace(held_out=held_out, errors=[]) for held_out in (1.0, 1.2))
    return selection.alike(other, one, 0.1)  # type: ignore[arg-type]


@decides("FAR_LESS", {0.6: False, 0.4: True})
def what_chance_does_not_explain(left: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """It does not halve an error to which nothing was fitted, even if few blocks show it."""
    better = Made("better", 1, (left, left))
    best = screening.Tried(SimpleNamespace(name="better"), better, ("better",), left, better.errors(HELD))  # type: ignore[arg-type]
    values = iter((0.1, 1e-6))
    monkeypatch.setattr(selection, "difference", lambda *_: next(values))
    return selection.merit_of(Made("now", 1, (1.0, 1.0)), best, RECORDS) is not None


@decides("FLAT_END", {
    (0.004, 0.001): selection.Refusal("end", 0.004, acceptance.FLAT_END), (0.008, 0.001): None, (0.001, 0.008): None,
})  # fmt: skip
def a_limit_at_the_very_end_of_the_drive(low: float, high: float) -> Any:
    """What is refused of flat ends of these shares of the range, which take 40 % of the error away."""
    limit = Made("saturation", 1, (0.6, 0.6))
    limit.shape, limit.structure.front = np.array([low, high, -3.0]), Ends((0.0, 100.0))
    option: Any = SimpleNamespace(name="saturation", front=True)
    best = screening.Tried(option, limit, ("saturation",), 0.6, limit.errors(HELD))  # type: ignore[arg-type]
    found = selection.judged(Made("now", 1, (1.0, 1.0)), best, RECORDS)  # type: ignore[arg-type]
    return None if isinstance(found, selection.Merit) else found


@decides("SEEN_IN_BOTH", {(0.98, False): False, (0.95, False): True, (0.98, True): False, (0.95, True): True})
def an_effect_has_to_show_in_both(little: float, of_fitted: bool) -> Any:
    """In fitted and in held-out records: it removes 0.2 or 0.33 of what it leaves of one, and much of the other."""
    better = Made("better", 1, (little, 0.5) if of_fitted else (0.5, little))
    best = screening.Tried(
        SimpleNamespace(name="better"), better, ("better",), better.left[1], better.errors(HELD)  # type: ignore[arg-type]
    )
    return selection.merit_of(Made("now", 1, (1.0, 1.0)), best, RECORDS) is not None  # type: ignore[arg-type]


@decides("MOSTLY_EXPLAINED", {
    (0.1, 0.1): True, (0.5, 0.1): True, (0.1, 0.5): True, (0.65, 0.1): False, (0.1, 0.65): False,
})  # fmt: skip
def names_explain_most(fitted: float, held: float) -> Any:
    """Far above the noise they leave this of the errors: 0.25 or 0.42 of the variance."""
    now, none = Made("now", 1, (fitted, held)), Made("none", 1, (1.0, 1.0))
    return selection.borne_out(now, none, RECORDS) is None


@decides("LEAST_EXPLAINED", {(2.5, 4.2): True, (2.9, 3.7): False})
def names_near_the_noise_explain_half(left: float, gap: float) -> Any:
    """As multiples of the noise: 0.32 or 0.58 of the variance above it."""
    now, none = Made("now", 1, (left * NOISE, left * NOISE)), Made("none", 1, (gap * NOISE, gap * NOISE))
    return selection.borne_out(now, none, RECORDS) is None


def test_names_explain_most_without_the_free_start_states() -> None:
    """On equal terms there was little to explain."""
    now, none = Made("now", 1, (0.3, 0.3)), Made("none", 1, (1.0, 1.0), on_equal_terms=(0.33, 0.33))
    assert selection.borne_out(now, none, RECORDS) is not None  # type: ignore[arg-type]


@decides("MUCH_LEFT", "FEW_COMPARED", {
    (2.0, 100): "Missing: lag", (4.0, 100): "An error of 0.08 um rms is not explained, 4 times the noise",
    (2.0, 20): "Only 20 of 100 samples were compared", (2.0, 40): "Missing: lag",
})  # fmt: skip
def what_a_verdict_says_first(times: float, compared: int) -> Any:
    said = replace(result("effects_found", ["lag"], times * 0.02, []), compared=(compared, 100))
    diagnosis: Any = Diagnosis(said, None, (), ())  # type: ignore[arg-type]
    return diagnosis.sentence().split(". ")[0].removesuffix(".")


@decides("BLOCK_MEMORIES", "BLOCKS", {1: True, 30: True})
def blocks_are_longer_than_errors_remember(memory: int) -> Any:
    """Against the test on blocks cut here: two correlation times long, or a twentieth of the record."""
    random = np.random.default_rng(3)
    before = np.sqrt(1.0 + np.repeat(random.uniform(0.0, 1.0, 600 // memory), memory) + random.uniform(0.0, 0.1, 600))
    after = np.sqrt(1.3 + random.uniform(0.0, 0.1, 600))
    gain = before**2 - after**2
    size = min(round(2.0 * correlation_time(gain)), 600 // 20)
    blocks = [np.mean(gain[k : k + size]) for k in range(0, 600 - size + 1, size)]
    assert size == (2 if memory == 1 else 30)
    expected = wilcoxon(blocks, alternative="greater").pvalue
    return selection.difference([before], [after]) == pytest.approx(float(expected), rel=1e-9, abs=0.0)


@decides("FAR_LESS", "EQUAL", {1.006: "lag", 1.015: "delay"})
def equal_effects_come_in_the_order_of_the_catalogue(more: float) -> Any:
    """Over all records one leaves 0.3 or 0.9 % more."""
    return first_of(Made("delay", 1, (1.0, 1.0)), Made("lag", 1, (more, 1.0)))


@decides("ALIKE", {(True, 1.2): "lag", (True, 1.3): "creep", (False, 1.2): "creep"})
def an_unlikely_amount_comes_behind_fewer_numbers_that_are_alike(most: bool, more: float) -> Any:
    """Of held-out records the other leaves 20 or 30 % more."""
    return first_of(Made("creep", 3, (1.0, 1.0), most=most), Made("lag", 1, (1.0, more)))


@pytest.mark.parametrize("name", ["lag", "delay", "resonance"])
def test_what_an_amplifier_does_comes_before_plays_that_are_late(name: str) -> None:
    """Unlike in the catalogue, if both are equal."""
    assert first_of(Made("rate_dependence", 1, (1.0, 1.0)), Made(name, 1, (1.004, 1.0))) == name
    assert first_of(Made("rate_dependence", 1, (1.0, 1.0)), Made("slew_limit", 1, (1.004, 1.0))) == "rate_dependence"


# Forward selection -------------------------------------------------------------------------------------------


def without_fits(monkeypatch: pytest.MonkeyPatch, now: Hypothesis) -> Any:
    """A hypothesis where every fit ends."""

    def without(now: Hypothesis, name: str, _: Any) -> Hypothesis:
        return Hypothesis(now.world, now.names - {name})

    monkeypatch.setattr(selection, "without_effect", without)
    monkeypatch.setattr(selection, "_without_refit", without)
    monkeypatch.setattr(selection.fits, "begun", lambda *_: SimpleNamespace(found=lambda _: now))
    monkeypatch.setattr(selection.fits, "fit", lambda *_: now)
    return now


@decides("MOST_EFFECTS", "FURTHER_REMOVES", gives=list("abcde"))
def no_more_than_five_effects(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Six letters that help in their order, each as much as a further effect has to."""
    every = [frozenset(each) for n in range(7) for each in itertools.combinations("abcdef", n)]
    prefix = {each: next((k for k, name in enumerate("abcdef") if name not in each), 6) for each in every}
    world = World({each: 0.68 ** prefix[each] for each in every}, "abcdef")
    now = without_fits(monkeypatch, Hypothesis(world, frozenset()))
    monkeypatch.setattr(selection, "_finished", lambda now, found, _: (now, found, None))
    return [each.name for each in selection.select(world.records, now).found]


@decides("NEEDLESS", {0.2: "b", 0.4: "ab"})
def a_needless_effect_is_dropped(without: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Of times the noise that its loss adds."""
    shares = {"ab": 0.02, "b": float(np.sqrt(0.02**2 + 2.0 * (without * NOISE) ** 2)), "a": 0.5}
    world = World({frozenset(names): share for names, share in shares.items()}, "ab")
    # noise that differs between the hypotheses would hide this difference
    world.colour = lambda *_: np.zeros(2000)  # type: ignore[method-assign]
    now = without_fits(monkeypatch, Hypothesis(world, frozenset("ab")))
    found = [selection.Found(name, name, 1.0, 0.5, 0.0, ()) for name in "ab"]
    _, left, _ = selection._without_needless(now, found, world.records)
    return "".join(each.name for each in left)


@decides("MOST_RIVALS", {"d": ["d", "x"], "e": []})
def three_rivals_are_tried(good: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Five are alike; what comes next helps beside one of them alone."""
    left = {name: 0.5 + 0.001 * k for k, name in enumerate("abcde")}
    shares = {**left, "x": 1.0, good + "x": 0.02}
    world = World({frozenset(names): share for names, share in shares.items()}, "abcdex")
    world.left |= {frozenset(a + b): left[a] for a, b in itertools.permutations("abcde", 2)}
    now = without_fits(monkeypatch, Hypothesis(world, frozenset()))
    latest = selection._step(now, world.gap(now), world.records)
    assert latest is not None
    step = selection._Step(latest.best.fitted, latest.tried, latest.best, None)
    pair = selection._with_rival(latest, step, world.gap(now), world.records)
    return [] if pair is None else [each.best.name for each in pair]


@decides("MOST_EXCHANGES", gives=4)
def exchanges_end(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Where another one always seems better."""
    world = World({}, "ab")
    now = without_fits(monkeypatch, Hypothesis(world, frozenset("ab")))
    seen: list[str] = []

    def step(*_: Any) -> Any:
        seen.append("asked")
        return selection._Step(now, [], world.tried(now, "c"), selection.Merit(1.0, 1.0, 0.1, 0.0))

    monkeypatch.setattr(selection, "_step", step)
    monkeypatch.setattr(selection, "_gives_way", lambda *_: True)
    monkeypatch.setattr(selection, "_found", lambda *_: selection.Found(f"n{len(seen)}", "", 1.0, 0.5, 0.0, ()))
    monkeypatch.setattr(selection, "_without_needless", lambda now, found, _: (now, found, {}))
    monkeypatch.setattr(selection, "in_place", lambda _, found, *__: list(found))
    found = [selection.Found(name, name, 1.0, 0.5, 0.0, ()) for name in "ab"]
    selection._exchanged(now, found, {}, {"a", "b"}, world.records)
    return len(seen)


class Path:
    """A search whose error is known after every step; steps that fail leave it where it was."""

    def __init__(self, errors: Sequence[float], at: int = 0, log: list[tuple[int, float]] | None = None) -> None:
        self.errors, self.at, self.log = errors, at, [] if log is None else log
        self.now = SimpleNamespace(rms=errors[min(at, len(errors) - 1)])

    def further(self, steps: int, little: float) -> Path:
        self.log.append((steps, little))
        found = Path(self.errors, self.at + steps, self.log)
        if found.now.rms == self.now.rms:
            found.now = self.now
        return found

    def found(self, _: Any) -> float:
        return float(self.now.rms)


def screened(monkeypatch: pytest.MonkeyPatch, *paths: Path) -> float:
    """The error at the end of a screening that begins at several starts, the error without the effect being 1."""
    waiting = list(paths)
    monkeypatch.setattr(fits, "begun", lambda *_: waiting.pop(0))
    option: Any = SimpleNamespace(front=True, starts=range(len(paths)), grown=None, name="lag", alone=None)
    rough: Any = SimpleNamespace(errors=lambda _: [np.ones(10)], weights=None)
    searches = screening._Searches(None, rough, [], SimpleNamespace(thin=None))  # type: ignore[arg-type]
    return searches._screen(option, screening._Trial(0, 0))  # type: ignore[return-value]


# Screening ---------------------------------------------------------------------------------------------------


@decides("FIRST_STEPS", "SCREENING_STEPS", "FALLING", "LONGER", {0.75: (5, 10), 0.85: (2, 4)})
def a_search_that_falls_goes_on(factor: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Calls and steps: four times two steps behind the first two, or two in all."""
    path = Path([0.5 * factor ** (k / 2.0) for k in range(40)])
    screened(monkeypatch, path)
    return len(path.log), sum(steps for steps, _ in path.log)


def test_a_search_whose_steps_fail_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each failure damps the next step more: far from straight, a cubic sensor takes its fifth or sixth."""
    assert screened(monkeypatch, Path([0.5] * 5 + [0.1] * 10)) == 0.1


@decides("FALLING", "LONGER", {0.75: [5] * 4, 0.85: [5]})
def a_joint_search_that_falls_goes_on(factor: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Creep of three states falls slowly, and far below where five steps end."""
    path = Path([factor ** (k / 5.0) for k in range(40)])
    monkeypatch.setattr(fits, "begun", lambda *_: path)
    task = screening._Trial(screening._JOIN, 0, np.zeros(0), np.zeros(0), 5)
    searches = screening._Searches(None, None, [], SimpleNamespace(quick=None))  # type: ignore[arg-type]
    searches._join(SimpleNamespace(structure=None), task)  # type: ignore[arg-type]
    return [steps for steps, _ in path.log]


@decides("TOO_FAR", {4.5: True, 5.5: False})
def a_start_far_off_is_left(start: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The best end is on its way."""
    far, near = Path([0.1 * start, 0.01]), Path([0.1])
    return screened(monkeypatch, near, far) == 0.01


@decides("IDLE", {0.015: False, 0.007: True})
def a_start_that_does_nothing_waits(change: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Another one is worse than none at first; the idle one counts where it changes the error."""
    idle, busy = Path([1.0 - change, 1.0 - change, 1.0 - change]), Path([1.5, 1.45, 1.4, 0.3])
    return screened(monkeypatch, idle, busy) == 0.3


@decides("PROMISING", "JOINT_STEPS", {(1.9, 3.0): (5, 5), (3.0, 1.9): (5, 5), (2.1, 2.1): (5, 0)})
def what_promises_nothing_is_not_searched_jointly(left: float, fitted: float) -> Any:
    """Steps of the best shape and of one that leaves so many times as much."""
    steps = _followed([(1.0, 1.0), (left, fitted)], [1.0, 1.0])
    return steps[0][0], steps[1][0]


@decides("HOPEFUL", {1.2: True, 1.4: False})
def what_is_behind_after_a_few_steps_is_not_polished(left: float) -> Any:
    return len(_followed([(1.0, 1.0), (1.0, 1.0)], [1.0, left])[1]) == 2


@decides("SHAPES_OF_ONE", {"lag": 2, "other": 3})
def no_more_than_two_shapes_of_an_effect(name: str) -> Any:
    def one(name: str, held_out: float) -> Any:
        option = SimpleNamespace(name=name, label=str(held_out))
        return SimpleNamespace(option=option, residual=held_out, fitted=SimpleNamespace(rms=held_out))

    tried = [one("lag", 0.1), one("lag", 0.2), one(name, 0.3)]
    return len(screening._kept(tried, []))


@decides("KEPT", "ALSO_KEPT", "TWIN", {0.015: True, 0.025: False})
def a_twin_follows(apart: float) -> Any:
    def one(name: str, error: float) -> Any:
        option = SimpleNamespace(name=name, label=name)
        return SimpleNamespace(option=option, residual=error, fitted=SimpleNamespace(rms=error), numbers=1)

    tried = [one(name, 1.0) for name in "abcdefg"] + [one("twin", 1.0 + apart)]
    names = [each.option.name for each in screening._kept(tried, tried)]
    return "twin" in names


def _followed(screen: Sequence[tuple[float, float]], joint: Sequence[float]) -> dict[int, list[int]]:
    """Steps that each option gets; `screen`: its held-out and fitted error, `joint`: its held-out error after that."""
    steps: dict[int, list[int]] = {k: [] for k in range(len(screen))}

    class Pool:
        def each(self, tasks: Sequence[Any], *_: Any) -> Any:
            for task in tasks:
                steps[task.k].append(task.steps)
                yield task, screening._Numbers(np.zeros(0), np.zeros(0), 2.0, joint[task.k], ())

    option: Any = SimpleNamespace(
        joined=lambda *_: np.zeros(0), structure=SimpleNamespace(start=()), alone=SimpleNamespace(start=()), starts=()
    )
    kept_ones: Any = [
        SimpleNamespace(k=k, residual=left, fitted=SimpleNamespace(rms=fitted, shape=None))
        for k, (left, fitted) in enumerate(screen)
    ]
    pairs = [screening._Pair(option, option) for _ in screen]
    now: Any = SimpleNamespace(rms=1.0, weights=None)
    records: Any = SimpleNamespace(tick=None, held=[], to_fit=[])
    searches = screening._Searches(now, now, pairs, records)
    screening._followed_up(searches, kept_ones, Pool())  # type: ignore[arg-type]
    return steps


def sine(samples: int, seed: int = 0) -> Item:
    t = np.arange(samples) * 1e-3
    v = 50.0 - 50.0 * np.cos(2.0 * np.pi * t)
    y = 0.1 * v + np.random.default_rng(seed).normal(0.0, 0.01, samples)
    return Item(f"r{seed}", Run(t, v), y, (0.0,), 10.0)


@decides("SCREENED", "SEARCHED", gives=True)
def samples_of_a_search() -> Any:
    """Every n-th of 30000 is compared: no more than a number, and more than half of it."""
    items = [sine(30_000, seed) for seed in range(2)]
    refitted = Fitted(Structure(np.array([0.0, 10.0]), Kept()), np.empty(0), np.array([0.1, 0.0]), 0.01)
    records = screening.Records.of(items[:1], items[1:], refitted, 0.01)
    thin, thin_held, quick = (
        np.count_nonzero(each[0].known) for each in (records.thin, records.thin_held, records.quick)
    )
    return 3_000 < thin <= 6_000 and 3_000 < thin_held <= 6_000 and 6_000 < quick <= 12_000


@decides("RINGING_STARTS", gives=pytest.approx([290.0, 230.0, 170.0], abs=0.5))
def frequencies_from_which_a_resonance_is_sought(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Three of five at which the error rings."""
    items = [ramp(4000, name=f"r{k}") for k in range(2)]
    rings = sum(tone(50.0 + 60.0 * k, 4000, 1.0 + 0.05 * k) for k in range(5))
    items = [replace(item, y=item.y + rings + 0.1 * hiss(4000)) for item in items]
    refitted = Fitted(Structure(np.array([0.0, 10.0]), Kept()), np.empty(0), np.array([0.1, 0.0]), 1.0)
    records = screening.Records.of(items[:1], items[1:], refitted, 0.1)
    seen: list[Any] = []
    monkeypatch.setattr(screening, "options", lambda _, known, *__: seen.append(known) or [])  # type: ignore[func-returns-value]
    assert records.extensions(refitted) == []
    return seen[0].ringing


@decides("PLAYS", gives=True)
def plays_of_a_fit() -> Any:
    """Fine enough that their steps leave less than the noise, and no finer."""
    records = [Record(f"r{k}", sine(4000, k).run.t, sine(4000, k).run.v, sine(4000, k).y) for k in range(2)]
    return 25 <= len(prepare(records[:1], records[1:], (0.0,), 0.0).thresholds) <= 40


def test_a_start_is_wiped_by_what_the_plays_see() -> None:
    """Steps lead to the ends of the range, where the stage arrives six samples late: until then the output shows what
    was before the record."""
    v = np.repeat([40.0, 100.0, 0.0, 70.0, 30.0], 40)
    seen = np.full(len(v), 40.0)
    for k in range(1, len(v)):
        seen[k] = seen[k - 1] + np.clip(v[k] - seen[k - 1], -16.0, 16.0)

    def output(before: float) -> Array:
        state, y = before, []
        for x in seen.tolist():
            state = min(max(state, x - 45.0), x + 45.0)
            y.append(x + 0.5 * state)
        return np.array(y)

    records = [Record(name, np.arange(len(v)) * 1e-3 + k, v, output(40.0)) for k, name in enumerate("ab")]
    (item,) = prepare(records[:1], records[1:], None, 0.0).to_fit
    apart, arrived = np.flatnonzero(output(-5.0) != output(85.0)), np.flatnonzero(seen <= 0.0)[0]
    assert (apart[-1], arrived) == (84, 86)  # the step is at 80
    assert np.flatnonzero(np.isfinite(item.y))[0] == arrived


# Held-out records --------------------------------------------------------------------------------------------


@decides("COMPARED_SAMPLES", {(24, None): True, (16, None): False, (24, ()): True, (16, ()): False})
def enough_to_compare(samples: int, memory: Any) -> Any:
    """Behind a known memory or one that can be found: the drive moves the plays up and down again."""
    v = np.resize([0.0, 50.0, 100.0, 50.0], samples)
    return preparing.enough([Course("made", v, v, memory, 0, samples)])


@decides("SET_ASIDE", gives=True)
def the_end_of_a_record() -> Any:
    """A little less than a third of it."""
    (beginning,), (end,) = preparing.parted([sine(1000)])
    assert np.count_nonzero(beginning.known) + np.count_nonzero(end.known) == 1000
    return 200 < np.count_nonzero(end.known) < 334


@decides("FAST_RECORD", {0.7: [1, 4], 0.35: [2, 5]})
def a_fast_record(rate: float) -> Any:
    """Beside the fastest one, the first; every third one is held out, or others if one of two fast ones is then."""
    v = np.linspace(0.0, 100.0, 101)
    rates = [1.0, rate, 0.1, 0.1, 0.1, 0.1]
    given = [Record(f"r{k}", np.arange(101) / rate, v, v) for k, rate in enumerate(rates)]
    return preparing.set_aside(given)


# Effects of a given model ------------------------------------------------------------------------------------




FOUR_CREEPS = ExponentialCreep(name="creep", time_constants=(0.1, 1.0, 10.0, 100.0), weights=(0.02,) * 4)


@decides("NOMINAL_RANGE", gives=True)
def numbers_move_by_up_to_a_factor() -> Any:
    low, high = np.exp(hypothesis._near(FOUR_CREEPS).low), np.exp(hypothesis._near(FOUR_CREEPS).high)
    return bool(np.all((low > 0.2) & (low < 0.5)) and np.all((high > 2.0) & (high < 5.0)))


@decides("SINGLE_FACTORS", {4: 8, 5: 2})
def long_lists_have_one_factor(number: int) -> Any:
    effect = ExponentialCreep(
        name="creep", time_constants=tuple(10.0**k for k in range(number)), weights=(0.02,) * number
    )
    return len(hypothesis._near(effect).start)


@decides("TOUCHING", {0.7e-6: True, 1.5e-6: False})
def a_front_at_its_limit_is_refitted(excess: float) -> Any:
    family, shape = hypothesis.front_of([DeadZone((-1.0, 0.0, 1.0), (0.5, 1.0, 0.5))], (-2.0, 2.0))

    class Tight(type(family)):  # type: ignore[misc]
        def slack(self, _: Array) -> Array:
            return np.array([-excess])

    return hypothesis._inside(Tight(family.drive, family.breaks), shape)


def bent(*slopes: tuple[float, float]) -> Any:
    """A curve of straight pieces: the share of the range of each, and its slope."""
    ends = np.concatenate([[0.0], np.cumsum([100.0 * share for share, _ in slopes])])
    values = np.concatenate([[0.0], np.cumsum([100.0 * share * slope for share, slope in slopes])])
    return lambda v: np.interp(v, ends, values)


def curved(odd: float, even: float) -> Any:
    """A smooth curve with an odd and an even bend."""
    return lambda v: v - 50.0 * odd * (v / 50.0 - 1.0) ** 3 + 50.0 * even * (v / 50.0 - 1.0) ** 2


BOTH_NAMES = "saturation", "asymmetry"


@decides("LIMITER_STRAIGHT", "LIMITER_NEAR", "LIMITER_SLOPE", "ODD_FRONT", {
    bent((0.65, 1.0), (0.35, 0.3)): BOTH_NAMES[:1],
    bent((0.27, 0.9), (0.46, 1.0), (0.27, 0.3)): BOTH_NAMES[1:],  # not straight over most of the range
    # 0.07 is more than a tenth of the slopes' range
    bent((0.25, 1.0), (0.25, 1.07), (0.25, 1.0), (0.25, 0.5)): BOTH_NAMES[1:],
    bent((0.2, 0.97), (0.55, 1.0), (0.25, 0.5)): BOTH_NAMES[:1],
    bent((0.8, 1.0), (0.2, 0.5)): BOTH_NAMES[:1],
    bent((0.8, 1.0), (0.2, 0.7)): BOTH_NAMES,
    curved(0.2, 0.0617): BOTH_NAMES[:1],  # the odd bend has 2.7 times the power of the even one
    curved(0.2, 0.0828): BOTH_NAMES[1:],  # 1.5 times
})  # fmt: skip
def what_a_front_is_called(curve: Any) -> Any:
    front: Any = SimpleNamespace(stages=lambda _: [SimpleNamespace(forward=curve)])
    return screening.front_names(front, np.empty(0), (0.0, 100.0))


@decides("START_SPAN", gives=True)
def what_limits_the_start_of_an_effect() -> Any:
    """Its start state comes from a drive of at most twice the range."""
    effect = ExponentialCreep(name="creep", time_constants=(1.0,), weights=(0.1,))
    item = sine(2000)
    item = Item("r", item.run, item.y, None, 10.0)
    actuator = Actuator(np.array([0.0]), (), (effect,))
    responses = actuator.largest(item, np.array([0.1]))[1:]
    return np.allclose(responses, 2.0 * 0.1 * item.run.drive_range * effect.largest(item.run))


def test_a_start_without_a_limit_has_none_beside_plays_that_weigh_nothing() -> None:
    ringing = Resonance(name="resonance", frequency=5.0, damping=0.02)
    item = sine(2000)
    item = Item("r", item.run, item.y, None, 10.0)
    assert np.all(Actuator(np.array([0.0]), (), (ringing,)).largest(item, np.array([0.0])) == np.inf)


# Thinning and the noise floor --------------------------------------------------------------------------------


def needed(v: Array, y: Array, noise: float, column: Array | None = None) -> NDArray[np.bool_]:
    """Samples that are needed of a record that a model predicts exactly."""
    run = Run(np.arange(len(v)) * 1e-3, v, {} if column is None else {"temperature": column})
    return needed_samples([Item("r", run, y, None, 10.0)], [np.zeros(len(v))], noise)[0]


STRAIGHT = np.linspace(0.0, 100.0, 65)
"""A drive."""


@decides("THIN_STEPS", "THIN_STRAIGHT", {0.25: False, 0.35: True})
def a_bump_of_the_prediction(height: float) -> Any:
    """Of times the noise, over a straight drive."""
    bump = np.interp(np.arange(65), [8, 16, 24], [0.0, height * 0.01, 0.0])
    return needed(STRAIGHT, 0.1 * STRAIGHT + bump, 0.01)[16]


@decides("THIN_TURNING", {11.0: True, 16.5: False})
def a_small_turn_of_the_drive(noise: float) -> Any:
    """0.4 in the output, which is 0.036 or 0.024 times the noise."""
    v = STRAIGHT.copy()
    v[16] += 4.0
    return needed(v, 0.1 * v, noise)[16]


@decides("THIN_COLUMN", {0.007: False, 0.014: True})
def a_column_that_jitters(rms: float) -> Any:
    """Of its range, in every other sample."""
    column = STRAIGHT / 100.0
    column[1::2] += np.sqrt(2.0) * rms
    return np.count_nonzero(needed(STRAIGHT, 0.1 * STRAIGHT, 0.01, column)) > 60


@decides("THIN_RESIDUAL", {1.3: False, 2.0: True})
def what_is_not_predicted(rms: float) -> Any:
    """Of times the noise, about a line."""
    left = np.zeros(65)
    left[1::2] = np.sqrt(2.0) * rms * 0.01
    item = Item("r", Run(np.arange(65) * 1e-3, STRAIGHT), 0.1 * STRAIGHT + left, None, 10.0)
    (mask,) = needed_samples([item], [left], 0.01)
    return np.count_nonzero(mask) > 60


@decides("THIN_STEPS", gives=32)
def the_longest_stretch() -> Any:
    """No sample is needed over 32 of a straight drive."""
    v = np.linspace(0.0, 100.0, 513)
    return np.diff(np.flatnonzero(needed(v, 0.1 * v, 0.01))).max()


def steps(lengths: Sequence[int], sigmas: Sequence[float], seed: int = 0) -> Item:
    """Holds at two levels in turn, with white noise of their own."""
    random = np.random.default_rng(seed)
    v = np.repeat(np.resize([0.0, 100.0], len(lengths)), lengths).astype(np.float64)
    y = 0.1 * v + np.concatenate([random.normal(0.0, s, n) for n, s in zip(lengths, sigmas, strict=True)])
    return Item("steps", Run(np.arange(len(v)) * 1e-3, v), y, None, 10.0)


def coloured(b: float, a: float, samples: int) -> Item:
    """A hold with an oscillation that white noise keeps alive."""
    e = np.random.default_rng(2).normal(0.0, 0.01, samples)
    item = steps([30, samples], [0.0, 0.0])
    return replace(item, y=item.y + np.concatenate([np.zeros(30), lfilter([1.0], [1.0, -a, b], e)]))


# The noise floor ---------------------------------------------------------------------------------------------


@decides("HOLD_SAMPLES", {50: True, 30: False})
def length_of_a_hold(samples: int) -> Any:
    return noise_floor([steps([samples] * 20, [0.01] * 20)]).holds is not None


@decides("HOLD_SAMPLES", "HOLD_DRIVE", "HOLD_SETTLING", {0.015: True, 0.03: False})
def jitter_of_the_drive(jitter: float) -> Any:
    """Steps of a hold, of a range of 100."""
    item = steps([60] * 20, [0.01] * 20)
    v = item.run.v + jitter * (np.arange(len(item.run.v)) % 2) + 1e-6 * np.arange(len(item.run.v)) % 1e-5
    return noise_floor([replace(item, run=Run(item.run.t, v))]).holds is not None


@decides("COARSE_DRIVE", {0.09: True, 0.11: False})
def a_coarse_drive(code: float) -> Any:
    """Between two codes, of a range of 100."""
    item = steps([60] * 20, [0.01] * 20)
    v = code * (np.round(item.run.v / code) + np.arange(len(item.run.v)) % 2)
    return noise_floor([replace(item, run=Run(item.run.t, v))]).holds is not None


@decides("HOLD_SETTLING", gives=pytest.approx(0.01, rel=0.2))
def settling_is_no_noise() -> Any:
    item = steps([80] * 20, [0.01] * 20)
    y = item.y + np.where(np.arange(len(item.y)) % 80 < 28, 1.0, 0.0) * np.sin(np.arange(len(item.y)))
    return noise_floor([replace(item, y=y)]).holds


@decides("QUIET_HOLDS", {6: pytest.approx(0.01, rel=0.2), 4: pytest.approx(0.1, rel=0.2)})
def quiet_holds_count(quiet: int) -> Any:
    """Of twenty, a little more or less than a quarter."""
    return noise_floor([steps([400] * 20, [0.01] * quiet + [0.1] * (20 - quiet))]).holds


@decides("HOLD_WEIGHT", {30: pytest.approx(0.01, rel=0.4), 12: pytest.approx(0.1, rel=0.4)})
def a_long_hold_counts_as_fifty(quiet: int) -> Any:
    return noise_floor([steps([41] * quiet + [8000], [0.01] * quiet + [0.1])]).holds


@decides("RING_DECAY", "RING_UNPREDICTED", {
    (0.49, 2.0 * 0.7 * np.cos(0.32), 4000): False,  # decays by 0.7 per sample
    (0.95**2, 2.0 * 0.95 * np.cos(0.32), 4000): True,
    (0.846, 0.0, 20_000): True,  # 0.28 of the variance is not predicted
    (0.825, 0.0, 20_000): False,  # 0.32
})  # fmt: skip
def a_hold_that_rings(b: float, a: float, samples: int) -> Any:
    return noise_floor([coloured(b, a, samples)]).holds is None


@decides("PERIOD_REPEATS", {0.1: True, 0.2: False})
def periods_of_a_jittering_drive(jitter: float) -> Any:
    """1.4e-3 or 2.8e-3 of the range, rms between periods."""
    random = np.random.default_rng(5)
    turns = np.concatenate([[0.0, 100.0], random.uniform(0.0, 100.0, 18)])
    item = sine(5000)
    v = np.tile(np.interp(np.arange(1000), np.arange(21) * 50, [*turns, 0.0]), 5) + random.normal(0.0, jitter, 5000)
    return noise_floor([replace(item, run=Run(item.run.t, v))]).periods is not None


@decides("LEAST_NOISE", gives=(pytest.approx(1e-4, rel=0.01), "resolution"))
def records_without_noise() -> Any:
    """A simulation; no sensor resolves more of its range of 10."""
    item = sine(5000)
    floor = noise_floor([replace(item, y=0.1 * item.run.v)])
    return floor.rms, floor.ruled


def test_two_equal_periods_show_the_noise() -> None:
    """Of a drive so fast that differences from sample to sample are none of the noise."""
    random = np.random.default_rng(3)
    v = np.tile(100.0 * random.normal(size=1000), 2)
    item = replace(sine(2000), run=Run(np.arange(2000) * 1e-3, v), y=0.1 * v + random.normal(0.0, 0.02, 2000))
    floor = noise_floor([item])
    assert (floor.rms, floor.ruled) == (pytest.approx(0.02, rel=0.15), "periods")


@decides("HELD_SHARE", dict.fromkeys(
    itertools.product((1, 2, 5), ("held", "straight")), pytest.approx(0.005, rel=0.35)
))  # fmt: skip
def samples_between(kept: int, between: str) -> Any:
    """That were not measured: one in so many was. A sine that turns fast is no noise."""
    t = np.arange(6000)
    y = np.sin(2.0 * np.pi * t / (40.0 * kept)) + np.random.default_rng(4).normal(0.0, 0.005, 6000)
    y = np.repeat(y[::kept], kept) if between == "held" else np.interp(t, t[::kept], y[::kept])
    return noise_floor([replace(sine(6000), y=y)]).differences


def test_a_coarse_converter() -> None:
    """Noise below its step: the floor is the rounding."""
    item = sine(5000)
    floor = noise_floor([replace(item, y=np.round(item.y / 0.5) * 0.5)])
    assert floor.rms == pytest.approx(0.5 / np.sqrt(12.0), rel=0.3)


# Edges -------------------------------------------------------------------------------------------------------


@decides("EDGE", {5.0: [20, 21, 40, 41, 60, 61], 2.0: [20, 21, 40, 41]})
def a_jump(jump: float) -> Any:
    """Of a range of 100."""
    return np.flatnonzero(signals.unresolved_edges(np.repeat([0.0, 100.0, 50.0, 50.0 + jump], 20))).tolist()


@decides("EDGE_SAMPLES", {1: [20, 21], 2: [20, 21, 22], 3: []})
def an_edge_that_is_resolved(samples: int) -> Any:
    v = np.concatenate([np.zeros(20), np.linspace(0.0, 100.0, samples + 1)[1:], np.full(20, 100.0)])
    return np.flatnonzero(signals.unresolved_edges(v)).tolist()


@decides("EDGE_STANDS", {5: True, 3: False})
def a_drive_that_does_not_stand(stands: int) -> Any:
    """Between jumps it would have to."""
    return bool(signals.unresolved_edges(np.tile(np.repeat([0.0, 100.0], stands), 8)).any())


def test_fast_triangles_have_no_edges() -> None:
    assert not signals.unresolved_edges(np.tile([0.0, 50.0, 100.0, 50.0], 20)).any()


# Whole records -----------------------------------------------------------------------------------------------


def smooth(seed: int, samples: int = 2000) -> Array:
    """A random drive of unit variance and zero mean without noise."""
    decay = float(np.exp(-1.0 / 20.0))
    x = lfilter([1.0], [1.0, -2.0 * decay, decay**2], np.random.default_rng(seed).normal(size=samples + 200))[200:]
    return np.asarray((x - np.mean(x)) / np.std(x))


def late(record: Record) -> Array:
    """What a model with a small lag predicts."""
    return np.asarray(lfilter([0.5], [1.0, -0.5], record.v, zi=[0.5 * record.v[0]])[0])


def record(name: str, v: Array, y: Array) -> Record:
    return Record(name, np.arange(len(v)) * 1e-3, v, y)


def straight(record: Record) -> Array:
    """What a model without a loop predicts."""
    return np.asarray(0.1 * record.v)


def good(width: float = 100.0) -> list[Record]:
    return [record(f"good{k}", width * smooth(k), 0.1 * width * smooth(k)) for k in range(3)]


def kinds_of(records: Sequence[Record], predict: preparing.Predict = straight) -> list[tuple[str, str]]:
    return [(each.kind, str(each.entry()["record"])) for each in preparing.checked(records, predict)[1]]


@decides("SCALE_OF_ALL", {2.5: [], 3.5: [("scale", "all")]})
def other_units_of_all(factor: float) -> Any:
    return kinds_of([replace(each, y=factor * np.asarray(each.y)) for each in good()])


@decides("SCALE_OF_ONE", "WIDE_DRIVE", {40.0: [("scale", "odd")], 20.0: []})
def a_narrow_record_shows_no_scale(width: float) -> Any:
    v = np.clip(smooth(0), -1.0, 1.0)
    wide = [record(f"wide{k}", 100.0 * v, 10.0 * v) for k in range(3)]
    return kinds_of([*wide, record("odd", width * v, 0.2 * width * v)])


@decides("OTHER_UNIT", {25.0: [], 35.0: [("scale", "odd")]})
def a_drive_in_another_unit_is_no_measure(times: float) -> Any:
    """Beside it the other drives would all be narrow."""
    v = np.clip(smooth(0), -1.0, 1.0)
    given = [record("a", v, 0.1 * v), record("b", v, 0.1 * v), record("odd", v, 0.2 * v)]
    return kinds_of([*given, record("wide", times * v, 0.1 * times * v)])


@decides("DEAD_SENSOR", "SCALE_OF_ONE", {0.07: [("scale", "dead")], 0.14: []})
def a_dead_sensor(share: float) -> Any:
    return kinds_of([*good(), record("dead", 100.0 * smooth(7), share * 10.0 * smooth(8))])


@decides("FOLLOWS", "SCALE_OF_ONE", {0.85: [], 0.95: [("scale", "loose")]})
def an_output_that_hardly_follows_shows_no_scale(correlation: float) -> Any:
    v, other = smooth(7), _orthogonal(smooth(8), smooth(7))
    y = 2.0 * 10.0 * (v + np.sqrt(1.0 / correlation**2 - 1.0) * other)
    return kinds_of([*good(), record("loose", 100.0 * v, y)])


@decides("FOREIGN_CORRELATION", "OWN_CORRELATION", {
    (0.97, 0.0): True, (0.93, 0.0): False, (1.0, 0.45): True, (1.0, 0.55): False,
})  # fmt: skip
def the_output_of_another_record(foreign: float, own: float) -> Any:
    """Correlations with the other's prediction and with its own."""
    other = smooth(0)
    rest = _orthogonal(smooth(8), other)
    v = own * other + np.sqrt(1.0 - own**2) * rest
    y = foreign * other + np.sqrt(1.0 - foreign**2) * _orthogonal(_orthogonal(smooth(9), rest), other)
    found = kinds_of([*good(), record("foreign", 100.0 * v, 10.0 * y)])
    return ("exchanged_records", "foreign") in found


@decides("FOLLOWS", "LOOP_AREA", {0.4: True, 0.2: False})
def an_output_follows_its_drive(area: float) -> Any:
    """Exchanged columns, of a loop of this area against the expected one."""
    v = smooth(3)
    y = v + area * (late(record("", v, v)) - v)
    return ("swapped_channels", "r") in kinds_of([record("r", y, v)], late)


@decides("LOOP_SIGMAS", {7.5: True, 3.5: False})
def a_loop_counts_against_noise(sigmas: float) -> Any:
    """Exchanged columns, with noise that makes an area of its own."""
    v = smooth(3, 4000)
    y = late(record("", v, v))
    area = 0.5 * abs(float(np.sum(v[:-1] * y[1:] - v[1:] * y[:-1])))
    noise = area / sigmas / (0.5 * float(np.sqrt(np.sum((v[2:] - v[:-2]) ** 2))))
    y = y + np.random.default_rng(1).normal(0.0, noise, len(y))
    return preparing._against(record("r", v, y), late(record("", v, v))).sense > 0.0


@decides("OFF_LINE", "ON_LINE", {(0.05, 8.0): True, (0.05, 4.5): False, (0.15, 12.0): True, (0.25, 12.0): False})
def a_few_samples_far_off_do_not_count(share: float, scatters: float) -> Any:
    random = np.random.default_rng(4)
    x = random.uniform(-1.0, 1.0, 4000)
    y = x + random.normal(0.0, 0.05, 4000)
    without = preparing._line(x, y)[1]
    y[: int(4000 * share)] = x[: int(4000 * share)] + 0.05 * scatters
    return preparing._line(x, y)[1] == pytest.approx(without, abs=1e-3)


@decides("RAIL_PASSED", {0.007: "saturated", 0.014: "held_samples"})
def a_converter_ends_at_its_end(share: float) -> Any:
    """Another record goes beyond it by a share of the range."""
    items = [Item(name, Run(np.arange(3.0), np.arange(3.0)), np.array([0.0, 1.0, top]), None, 10.0)
             for name, top in (("a", 10.0 * (1.0 - share)), ("b", 10.0))]  # fmt: skip
    (each,) = preparing.not_at_the_end([Saturated("a", None, "largest", 10.0 * (1.0 - share), 5)], items)
    return each.kind


@decides("HISTORY_COSTS", {0.14: False, 0.16: True})
def a_history_that_costs_the_rest(rest: float) -> Any:
    v = np.interp(np.arange(400), [0, 50, 150, 400], [50.0, 100.0, 0.0, 50.0])
    item = Item("r", Run(np.arange(400) * 1e-3, v), v, (0.0,), 100.0)

    def model(start: float, rest: float) -> Any:
        error = np.where(np.arange(400) < settled(v, 10.0), start, rest) * np.resize([1.0, -1.0], 400)
        return SimpleNamespace(reach=10.0, errors=lambda _: [error])

    return preparing.bends([item], model(0.1, rest), model(1.0, 0.1)) is not None


def _orthogonal(x: Array, to: Array) -> Array:
    """A signal without what it has of another, of unit variance again."""
    rest = x - float(x @ to) / float(to @ to) * to
    rest = rest - np.mean(rest)
    return np.asarray(rest / np.std(rest))


# Lines -------------------------------------------------------------------------------------------------------


def tone(frequency: float, samples: int, size: float = 1.0, step: float = 1e-3) -> Array:
    return np.asarray(size * np.sin(2.0 * np.pi * frequency * step * np.arange(samples) + 0.3))


def hiss(samples: int, seed: int = 0) -> Array:
    """White noise of unit variance."""
    return np.random.default_rng(seed).normal(size=samples)


def driven(v: Array, step: float = 1e-3, name: str = "r") -> Item:
    return Item(name, Run(np.arange(len(v)) * step, v), 0.1 * v, None, 10.0)


def ramp(samples: int, step: float = 1e-3, name: str = "r") -> Item:
    """A record whose drive has no lines."""
    return driven(np.linspace(0.0, 100.0, samples), step, name)


def of_share(share: float) -> float:
    """Amplitude of a tone with this share of the variance of it and noise."""
    return float(np.sqrt(2.0 * share / (1.0 - share)))


def heard(item: Item, error: Array) -> list[float]:
    return sorted(frequency for _, frequency in signals.peaks(item, error))


# Spectra -----------------------------------------------------------------------------------------------------


@decides("LINE_SHARE", {0.055: True, 0.024: False})
def share_of_a_line(share: float) -> Any:
    return bool(heard(ramp(20_000), tone(130.0, 20_000, of_share(share)) + hiss(20_000)))


@decides("LINE_HEIGHT", {45.0: True, 20.0: False})
def height_of_a_line(height: float) -> Any:
    """Over its surroundings, in a short record."""
    noise, line = hiss(600), tone(125.0, 600)
    window = np.hanning(600)
    power = np.abs(np.fft.rfft(noise * window)) ** 2
    around = np.median(np.concatenate([power[35:72], power[79:115]]))
    with_line = np.abs(np.fft.rfft(line * window))[75]
    phase = np.angle(np.fft.rfft(noise * window)[75]) - np.angle(np.fft.rfft(line * window)[75])
    size = (np.sqrt(height * around) - np.sqrt(power[75])) / with_line
    error = noise + size * np.sin(2.0 * np.pi * 0.125 * np.arange(600) + 0.3 + phase)
    return heard(ramp(600), error) == [pytest.approx(125.0)]


@decides("DRIVE_LINE_SHARE", {1.5e-6: False, 0.7e-6: True})
def a_line_of_the_drive(share: float) -> Any:
    """However small, beside one and a half slow swings."""
    slow = 50.0 * np.cos(2.0 * np.pi * 0.375 * np.arange(4000) * 1e-3)
    v = slow + tone(125.0, 4000, float(np.sqrt(share)) * 50.0)
    return bool(heard(driven(v), tone(125.0, 4000) + hiss(4000)))


@decides("PEAK_HEIGHT", {14.0: False, 7.0: True})
def height_of_a_line_of_the_drive(height: float) -> Any:
    noise, window = hiss(2000, 1), np.hanning(2000)
    spectrum = np.fft.rfft(noise * window)
    around = np.median(np.abs(np.concatenate([spectrum[210:247], spectrum[254:290]])) ** 2)
    line = np.fft.rfft(tone(125.0, 2000) * window)[250]
    phase = np.angle(spectrum[250]) - np.angle(line)
    size = (np.sqrt(height * around) - np.abs(spectrum[250])) / np.abs(line)
    v = noise + size * np.sin(2.0 * np.pi * 0.125 * np.arange(2000) + 0.3 + phase)
    return bool(heard(driven(v), tone(125.0, 2000) + hiss(2000)))


@decides("CARRIER_SHARE", "HARMONICS", "SAME_BINS", {
    (0.7, 3.0): False, (0.35, 3.0): True, (0.7, 8.0): False, (0.7, 12.0): True, (0.7, 3.025): False,
    (0.7, 3.05): True,
})  # fmt: skip
def harmonics_of_a_carrier(carried: float, harmonic: float) -> Any:
    """A share of the drive's power in 40 swings; a fortieth of the harmonic is one bin."""
    rest = smooth(5, 4000)
    v = tone(10.0, 4000, float(np.sqrt(2.0 * carried))) + np.sqrt(1.0 - carried) * rest
    found = heard(driven(v), tone(10.0 * harmonic, 4000) + 0.3 * hiss(4000))
    return pytest.approx(10.0 * harmonic) in found


@decides("LINE_PERIODS", {10: True, 6: False})
def periods_of_a_line(periods: int) -> Any:
    return bool(heard(driven(hiss(4000, 9)), tone(periods / 4.0, 4000) + 0.3 * hiss(4000)))


@decides("SPECTRUM_SAMPLES", {300: True, 200: False})
def samples_of_a_spectrum(samples: int) -> Any:
    return bool(heard(ramp(samples), tone(250.0, samples) + 0.1 * hiss(samples)))


@decides("SURROUNDINGS", {(44, 80): True, (16, 40): False})
def surroundings_of_a_line(first: int, last: int) -> Any:
    """Strong noise in these bins on either side."""
    random = np.random.default_rng(6)
    spectrum = random.normal(size=2001) + 1j * random.normal(size=2001)
    for k in range(first, last):
        spectrum[[500 - k, 500 + k]] *= 30.0
    spectrum[500] = 120.0
    return pytest.approx(125.0) in heard(ramp(4000), np.fft.irfft(spectrum, 4000))


@decides("CRESTS", gives=5)
def the_highest_bins() -> Any:
    """Of seven equal tones five are looked at."""
    return len(heard(ramp(4000), sum(tone(50.0 + 40.0 * k, 4000) for k in range(7)) + 0.1 * hiss(4000)))


@decides("SAME_RINGING", {0.013: 1, 0.03: 2})
def ringing_at_nearly_the_same_frequency(apart: float) -> Any:
    errors = [tone(f, 20_000) + 0.3 * hiss(20_000) for f in (100.0, 100.0 * (1.0 + apart))]
    found = signals.ringing([ramp(20_000), ramp(20_000)], errors, 5)
    return len([f for f in found if 99.0 < f < 104.0])


@decides("LINE_SAMPLES", {80: True, 50: False})
def a_short_drive_does_not_repeat(samples: int) -> Any:
    v = np.cos(2.0 * np.pi * np.arange(samples) / 20.0)
    return signals.repetition(v) == 20


@decides("DRIVE_REPEATS", {0.7: True, 1.4: False})
def a_noisy_drive_repeats(noise: float) -> Any:
    """Of a range of 100, rms between periods."""
    v = np.tile(np.interp(np.arange(500), [0, 100, 250, 400, 500], [0.0, 100.0, 20.0, 70.0, 0.0]), 6)
    return signals.repetition(v + noise / np.sqrt(2.0) * hiss(3000)) is not None


@decides("DRIVE_AWAY", {0.05: True, 0.015: False})
def a_drive_that_mostly_rests(duty: float) -> Any:
    """It differs from itself by the root of twice that, rms."""
    v = np.tile(np.where(np.arange(400) < 400 * duty, 1.0, 0.0), 6)
    return signals.repetition(v) is not None


@decides("RULING_SHARE", {0.4: True, 0.2: False})
def a_line_rules(share: float) -> Any:
    error = tone(130.0, 4000, of_share(share)) + hiss(4000)
    return bool(disturbances.ruling([ramp(4000)], [error])[0])


@decides("RULING_SHARE", {0.4: True, 0.2: False})
def a_line_in_a_few_records(share: float) -> Any:
    """In one of ten, unless it rules that one."""
    items = [ramp(2000, name=f"r{k}") for k in range(10)]
    errors = [hiss(2000, k) + (tone(130.0, 2000, of_share(share)) if k == 0 else 0.0) for k in range(10)]
    return bool(disturbances.lines(items, errors)[0])


@decides("SEEN_IN", {5: True, 3: False})
def a_line_in_many_records(having: int) -> Any:
    items = [ramp(2000, name=f"r{k}") for k in range(10)]
    errors = [hiss(2000, k) + (tone(130.0, 2000, of_share(0.15)) if k < having else 0.0) for k in range(10)]
    return bool(disturbances.lines(items, errors)[0])


@decides("COMMON_SHARE", {7: True, 5: False})
def steady_in_most_records(steady: int) -> Any:
    """In the others it is gone after half the time."""
    items = [ramp(2000, name=f"r{k}") for k in range(10)]
    fading = np.where(np.arange(2000) < 1000, 1.0, 0.0)
    errors = [3.0 * tone(130.0, 2000) * (1.0 if k < steady else fading) + hiss(2000, k) for k in range(10)]
    return disturbances.steady(items, errors) is not None


@decides("STEADY_SHARE", {0.46: True, 0.38: False})
def a_line_that_fades(size: float) -> Any:
    """To this share of its amplitude: what one half predicts of the other is 0.58 or 0.39 of what that has."""
    error = tone(130.0, 4000) * np.where(np.arange(4000) < 2000, 1.0, size) + 0.05 * hiss(4000)
    return disturbances.steady([ramp(4000)], [error]) is not None


@decides("MOST_LINES", gives=4)
def four_lines() -> Any:
    error = sum(tone(50.0 + 40.0 * k, 4000) for k in range(6)) + 0.1 * hiss(4000)
    return len(disturbances.lines([ramp(4000)], [error])[0])


@decides("AMPLITUDE_SAMPLES", {1080.0: pytest.approx(1.5, rel=0.1), 945.0: pytest.approx(1.0, rel=0.1)})
def two_samples_a_period_do_not_show_an_amplitude(rate: float) -> Any:
    """A line of 450 Hz, twice as large in the record with the other sampling rate."""
    items = [ramp(4000, 1.0 / 2000.0, "a"), ramp(4000, 1.0 / rate, "b")]
    errors = [tone(450.0, 4000, 1.0, 1.0 / 2000.0), tone(450.0, 4000, 2.0, 1.0 / rate)]
    (line, *_), _ = disturbances.lines(items, [e + 0.1 * hiss(4000, k) for k, e in enumerate(errors)])
    return line.amplitude


@decides("MAINS_TOLERANCE", {50.08: 50.0, 50.15: None, 149.8: "3 x 50 Hz", 59.97: 60.0})
def mains(frequency: float) -> Any:
    return disturbances._mains(frequency, 1e-3)


@decides("SAME_LINE", {103.0: True, 108.0: False})
def the_rest_of_a_line(frequency: float) -> Any:
    line = Line(100.0, 1.0, 0.5, ("r",))
    return disturbances.is_known(replace(line, frequency=frequency), [line])


def test_a_ripple_is_no_line() -> None:
    line = Line(100.0, 1.0, 0.5, ("r",))
    assert not disturbances.is_known(line, [Ripple(100.0, 1.0, 0.5, ("r",), False)])


# Ripples and stick-slip --------------------------------------------------------------------------------------


def rippled(places: Array, pitch: float, seed: int, grain: float = 0.0) -> tuple[Item, Array]:
    """A record that moves over these places, with a ripple of unit amplitude and some noise; and its error."""
    error = np.sin(2.0 * np.pi * places / pitch) + 0.1 * hiss(len(places), seed)
    y = places + error
    if grain:
        y = grain * np.round(y / grain)
        error = y - places
    return Item(f"r{seed}", Run(np.arange(len(places)) * 1e-3, places), y, None, 10.0), error


def there_and_back(low: float, high: float, samples: int) -> Array:
    """A pass up and one down, with these samples each."""
    return np.concatenate([np.linspace(low, high, samples), np.linspace(high, low, samples)[1:]])


def pitches(made: Sequence[tuple[Item, Array]]) -> list[float]:
    found = disturbances.in_position([item for item, _ in made], [error for _, error in made])
    return [] if found is None else [found.finding.place]


@decides("RIPPLE_RESOLVED", {0.2: True, 0.35: False})
def samples_a_pitch(step: float) -> Any:
    made = [rippled(there_and_back(0.0, 40.0, round(40.0 / step)), 1.0, k) for k in range(3)]
    return pitches(made) == [pytest.approx(1.0, rel=0.01)]


@decides("PASS_SAMPLES", {42: True, 26: False})
def samples_of_a_pass(samples: int) -> Any:
    made = [rippled(there_and_back(1.3 * k, 1.3 * k + 4.5, samples), 1.0, k) for k in range(12)]
    return pitches(made) == [pytest.approx(1.0, rel=0.01)]


@decides("COMMON_SHARE", "PASS_SAMPLES", "PASS_PITCHES", {4.0: True, 2.4: False})
def pitches_of_a_pass(length: float) -> Any:
    made = [rippled(there_and_back(1.3 * k, 1.3 * k + length, 60), 1.0, k) for k in range(12)]
    return pitches(made) == [pytest.approx(1.0, rel=0.01)]


@decides("POSITION_BINS", {400: True, 700: False})
def the_finest_pitch(number: int) -> Any:
    """Pitches in the range."""
    made = [rippled(there_and_back(0.0, float(number), 6000), 1.0, k) for k in range(2)]
    return pitches(made) == [pytest.approx(1.0, rel=0.01)]


@decides("COMMON_SHARE", "PITCHES", {2: True, 3: False})
def pitches_that_are_examined(others: int) -> Any:
    """Stronger ones go before it, which are there on the way up alone."""
    made = []
    for k in range(3):
        item, error = rippled(there_and_back(0.0, 40.0, 2000), 1.0, k)
        up = np.arange(len(error)) < 2000
        more = sum(2.5 * np.sin(2.0 * np.pi * (item.y - error) / pitch) for pitch in (1.3, 1.7, 2.2)[:others]) * up
        made.append((replace(item, y=item.y + more), error + more))
    return pitches(made) == [pytest.approx(1.0, rel=0.01)]


@decides("CONVERTER_STEP", {0.014: True, 0.03: False})
def a_pitch_of_the_converter(beside: float) -> Any:
    made = [rippled(there_and_back(0.0, 40.0, 2000), 1.0, k, 1.0 + beside) for k in range(3)]
    found = disturbances.in_position([item for item, _ in made], [error for _, error in made])
    assert found is not None
    assert found.finding.place == pytest.approx(1.0, rel=0.005)
    return found.finding.entry()["converter_step"]


SLIP = 0.0, 2.2
"""What a stretch that stands, and one that leaps, moves of what it should."""


def slipping(ratios: Sequence[float], moves: float = 1.0, jump: float = 9.0, noise: float = 1.0) -> bool:
    """Whether stick-slip is seen where stretches of seven samples move by these shares of the prediction.

    A stretch that moves more than predicted does so in one jump, and falls behind again a little where that is more.
    """
    e = [0.0]
    for ratio in ratios:
        change = 7.0 * moves * (ratio - 1.0)
        rest = (change - jump) / 6.0 if ratio > 1.0 else change / 7.0
        e += list(e[-1] + np.cumsum([jump if ratio > 1.0 else rest, *([rest] * 6)]))
    return slips(np.full(len(e) - 1, moves), np.diff(e), noise)


def slips(moves: Array, change: Array, noise: float) -> bool:
    """Whether stick-slip is seen where the prediction moves so from sample to sample, and the error changes so."""
    predicted, error = (np.concatenate([[0.0], np.cumsum(x)]) for x in (moves, change))
    item = Item("r", Run(np.arange(len(error)) * 1e-3, predicted), predicted + error, None, 10.0)
    return bool(disturbances.stick_slip([item], [error], noise))


def pattern(pairs: int, stretches: int, stands: float = 0.0, leaps: float = 2.2) -> list[float]:
    """Pairs of standing and leaping, spread evenly among stretches that follow."""
    found = [1.0] * stretches
    for k in range(pairs):
        at = k * stretches // pairs
        found[at : at + 2] = [stands, leaps]
    return found


# Stick-slip --------------------------------------------------------------------------------------------------


@decides("SLIP_RESOLVED", "SLIP_STRETCH", "SLIP_OFF", "SLIP_STANDS", {20: True, 11: False})
def how_much_stands(pairs: int) -> Any:
    return slipping(pattern(pairs, 100))


@decides("SLIP_LEAPS", {7: True, 3: False})
def how_much_leaps(leaping: int) -> Any:
    """Of a hundred stretches; the others that stand make up for it slowly."""
    ratios = pattern(20, 100, -0.2, 1.5)
    for k in [k for k, ratio in enumerate(ratios) if ratio == 1.5][:leaping]:
        ratios[k] = 2.2
    return slipping(ratios)


@decides("SLIP_OFF", {0.7: True, 0.5: False})
def how_far_off_a_stretch_is(off: float) -> Any:
    return slipping(pattern(20, 100, 1.0 - off, 1.0 + off))


@decides("SLIP_RESOLVED", {8.5: True, 5.5: False})
def how_large_a_jump_is(jump: float) -> Any:
    """Of times the noise."""
    return slipping(pattern(20, 100, 0.0, 1.9), jump=jump)


@decides("SLIP_JUMPS", {(7, 40): True, (4, 26): False})
def how_many_jumps(pairs: int, stretches: int) -> Any:
    return slipping(pattern(pairs, stretches))


@decides("SLIP_STRETCH", gives=False)
def stretches_that_hardly_move_do_not_count() -> Any:
    """They are 2.8 times the noise, of which nothing can be said; the others are as predicted."""
    moves = np.repeat([1.0, 0.4], [7 * 70, 7 * 60])
    slow = np.tile([*[-0.4] * 7, 9.0, *[-6.2 / 6.0] * 6], 30)
    return slips(moves, np.concatenate([np.zeros(7 * 70), slow]), 1.0)


@decides("SLIP_MOVING", {0.35: True, 0.18: False})
def samples_that_hardly_move_do_not_count(slow: float) -> Any:
    """Against a quarter of the fast ones, of which there are too few."""
    fast = np.arange(160) % 7 < 2
    change = np.zeros(160)
    change[~fast] = np.resize([*[-slow] * 4, 4.0 * slow], np.count_nonzero(~fast))
    return slips(np.where(fast, 1.0, slow), change, 0.02)


@decides("SLIP_ALONE", {0.22: True, 0.35: False})
def a_fast_output_does_not_jump(beside: float) -> Any:
    """Jumps 4.5 or 2.9 times as large as the moves around them, which are as large where an output is smooth."""
    row = np.array([1.0, beside, -beside, beside, -beside, beside, -beside, beside, 1.0 - beside])
    y = np.cumsum(np.tile(row, 60))
    predicted = np.linspace(0.0, float(y[-1]), len(y))
    item = Item("r", Run(np.arange(len(y)) * 1e-3, predicted), y, None, 10.0)
    return bool(disturbances.stick_slip([item], [y - predicted], 0.02))


@decides("SLIP_CONTINUES", {1: True, 2: True, 3: False})
def what_goes_on(length: int) -> Any:
    """Stretches that stand, and those that leap, in a row."""
    row = [0.0] * length + [2.0] * length + [1.0] * 4
    return slipping(row * (100 // len(row)))


# Drives and descriptions -------------------------------------------------------------------------------------


@decides("REVERSAL", {1.4: 0, 3.0: 2})
def a_small_turn(turn: float) -> Any:
    v = np.interp(np.arange(300), [0, 100, 130, 299], [0.0, 50.0, 50.0 - turn, 100.0])
    return len(signals.reversals(v))


@decides("LOOP_ENDS", {93.0: True, 86.0: False})
def ends_of_loops(top: float) -> Any:
    return signals.one_loop([sweep(0, 100, 0, 100, 0), sweep(0, top, 0, top, 0)])


@decides("LOOP_SPEEDS", {1.35: True, 1.8: False})
def speeds_of_loops(slower: float) -> Any:
    return signals.one_speed([sweep(0, 100, 0, 100, 0), sweep(0, 100, 0, 100, 0, seconds=slower)])


@decides("LOOP_STANDS", {50: True, 160: False})
def a_loop_that_stands_is_none(hold: int) -> Any:
    """Samples beside 200 of each move."""
    move = np.linspace(0.0, 100.0, 200)
    v = np.concatenate([move, np.full(hold, 100.0), move[::-1], np.zeros(hold)] * 3)
    return signals.one_loop([driven(v)])


def scattered(samples: int, seed: int = 0) -> Item:
    """A drive that goes everywhere in every block of samples."""
    return driven(np.random.default_rng(seed).uniform(0.0, 100.0, samples))


# Descriptions ------------------------------------------------------------------------------------------------


@decides("VARIABLE_SHARE", {0.14: True, 0.07: False})
def a_variable_that_matters(share: float) -> Any:
    item = scattered(20_000)
    error = of_share(share) * np.sin(2.0 * np.pi * item.run.v / 100.0) + hiss(20_000, 1)
    return "drive" in content.shares([item], [error])[1]


@decides("VARIABLE_BINS", gives=True)
def bins_of_a_variable() -> Any:
    """Eight waves over the range, of which 24 bins see two thirds."""
    item = scattered(20_000)
    shares = content.shares([item], [np.sin(2.0 * np.pi * 8.0 * item.run.v / 100.0)])[1]
    return 0.6 < shares["drive"] < 0.8


@decides("VARIABLE_BINS", "FOLD_BLOCKS", gives=True)
def folds() -> Any:
    """A drift is seen in half of the blocks of time alone: a bin is two thirds of one."""
    return 0.25 < content.shares([scattered(9600)], [np.linspace(-1.0, 1.0, 9600)])[1]["session time"] < 0.45


@decides("DESCRIBED_SAMPLES", {300: True, 150: False})
def samples_of_a_description(samples: int) -> Any:
    item = scattered(samples)
    return content.shares([item], [item.run.v - 50.0])[0] > 0.0


@decides("MEMORY_WINS", {0.6: "memory", 0.45: "drive"})
def memory_in_place_of_one_variable(free: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(content, "shares", lambda *_: (0.4, {"drive": 0.4}))
    monkeypatch.setattr(content, "together", lambda *_: (free, 0.7))
    return content.described([scattered(500)], [hiss(500)], 1.0, ()).main_variable


@decides("RATE_FREE_SHARE", {0.8: True, 0.6: False})
def rate_free(free: float) -> Any:
    return content._rate_free(free, 1.0)


@decides("REPEATABLE_SHARE", {0.6: True, 0.4: False})
def repeatable(share: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(content, "repeatable", lambda *_: share)
    return content.described([scattered(500)], [hiss(500)], 1.0, ()).repeatable


@decides("PARITY_BINS", "PARITY_SAMPLES", "PARITY_SHARE", {
    (0.09, 1, 40_000): True, (0.035, 1, 40_000): False,  # of the variance
    (0.1, 8, 40_000): True, (0.1, 12, 40_000): False,  # twenty bins see 0.57 or 0.25 of these
    (0.9, 1, 640): True, (0.9, 1, 300): False,  # 16 or 7 a bin
})  # fmt: skip
def parity(share: float, waves: int, samples: int) -> Any:
    item = scattered(samples)
    error = of_share(share) * np.cos(2.0 * np.pi * waves * item.run.v / 100.0) + hiss(samples, 1)
    return content.even_share([item], [error]) is not None


# Stretches ---------------------------------------------------------------------------------------------------


@decides("STRETCH_ABOVE_NOISE", "FAST_QUANTILE", {1.6: True, 1.4: False})
def above_the_noise(times: float) -> Any:
    error = np.where(np.arange(2400) < 300, times, 1.0) * np.resize([1.0, -1.0], 2400)
    return bool(content.worst([ramp(2400)], [error], 1.0))


@decides("RANGE_END", "RANGE_END_SHARE", gives={
    ("range_end", (0.0, 0.199)), ("moving", (0.2, 2.199)), ("range_end", (2.2, 2.399)),
})  # fmt: skip
def ends_of_the_range() -> Any:
    """Windows of 4 % of the range: the third one is two fifths within a tenth of it."""
    return {(each.kind, each.interval) for each in content.worst([ramp(2400)], [np.ones(2400)], 0.1)}


@decides("FAST_QUANTILE", gives=[(1.8, 1.999)])
def fast() -> Any:
    """A third of the record is twice as fast as most of it, a twelfth ten times."""
    rates = np.repeat([1.0, 2.0, 1.0, 10.0, 1.0], [700, 800, 300, 200, 400])
    item = driven(np.cumsum(np.resize(np.repeat([1.0, -1.0], 25), 2400) * rates))
    return [each.interval for each in content.worst([item], [np.ones(2400)], 0.1) if each.kind == "fast"]


@decides("MAIN_SHARE", {0.6: "The records are", 0.4: "Something is missing"})
def what_the_sentence_is_about(share: float) -> Any:
    line = Line(frequency=50.0, amplitude=0.1, share=share, records=("r",))
    found = result("unexplained", (), 0.5, [line, STRUCTURE])
    return " ".join(Diagnosis(found, None, (), ()).sentence().split()[:3]).rstrip(":,;")  # type: ignore[arg-type]


@decides("HELD_OUT_ALONE", gives=("b",))
def held_out_records_that_are_alone() -> Any:
    """With 2.5 or 3.5 times the error of a fitted one."""
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


def starts(label: str) -> list[Array]:
    return [np.asarray(start) for start in front(label).starts]


def slopes(label: str, start: Array) -> Array:
    """Of the front at 200 drives, over their mean."""
    w = np.linspace(0.0, 100.0, 201)
    for stage in front(label).structure.front.stages(start):
        w = stage.forward(w)
    return np.asarray(np.diff(w) / np.mean(np.diff(w)))


@decides("LIMITERS", dict.fromkeys((0.02, 0.03, 0.05, 0.08, 0.12, 0.15), True))
def a_limiter_is_near_a_start(depth: float) -> Any:
    """Within a factor of two, from a fiftieth of the range to three."""
    return any(abs(np.log2(depth / start[0])) < 1.0 for start in starts("front with flatter ends"))


@decides("BREAKS", "FINER_BREAKS", {
    ("front of dead zones", 0.25): True, ("front of more dead zones", 0.125): True,
})  # fmt: skip
def breaks_divide_the_range(label: str, wide: float) -> Any:
    breaks = np.array([0.0, *front(label).structure.front.breaks, 100.0])  # type: ignore[attr-defined]
    return bool(0.5 * wide < np.max(np.diff(np.unique(breaks))) / 100.0 <= wide)


@decides("TANH_BEND", "TANH_SIDE", gives=True)
def envelopes_bend_either_way() -> Any:
    """Over the whole range, the slope at one end some times that at the other."""
    label = "front of one tanh"
    bends = [float(np.log(each[-1] / each[0])) for each in (slopes(label, start) for start in starts(label))]
    assert min(bends) == pytest.approx(-max(bends))
    return 0.5 < max(bends) < 0.8


@decides("KEPT", "ALSO_KEPT", gives=["e0", "e1", "e2", "e3", "e4", "e11", "e10"])
def shapes_that_are_followed() -> Any:
    """Five by held-out error, and two more by fitted error."""

    def one(k: int) -> Any:
        option = SimpleNamespace(name=f"e{k}", label=f"e{k}")
        return SimpleNamespace(option=option, residual=1.0 + k, fitted=SimpleNamespace(rms=20.0 - k))

    return [each.option.name for each in screening._kept([one(k) for k in range(12)], [])]


@decides("SPECTRUM_PARTS", "SURROUNDINGS_OF_PARTS", {(14, 24): True, (6, 12): False})
def surroundings_of_ringing_that_fades(first: int, last: int) -> Any:
    """Strong noise in these bins of the spectrum of a part, on either side of a peak as wide as a bin."""
    random = np.random.default_rng(6)
    spectrum = random.normal(size=2049) + 1j * random.normal(size=2049)
    for k in range(8 * first, 8 * last):
        spectrum[[1024 - k, 1024 + k]] *= 30.0
    spectrum[1020:1028] *= 40.0
    found = signals._fading(ramp(4096), np.fft.irfft(spectrum, 4096))
    return any(abs(frequency - 250.0) < 3.0 for _, frequency in found)


# Inverses that do more than recordings bear out --------------------------------------------------------------


@staticmethod
def judged(monkeypatch: pytest.MonkeyPatch, moves: float, wilder: float) -> bool:
    gain, noise = 0.5, 0.1
    found = harm.Wild(moves, moves, gain, wilder)
    monkeypatch.setattr(harm, "_over", lambda *_: found)
    model: Any = None
    return harm.wild(model, model, [model], gain, noise) is not None


@decides("WILDER", {2.2: True, 1.8: False})
def a_drive_that_is_rougher(wilder: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    return judged(monkeypatch, 50.0, wilder)


@decides("BEYOND_GAIN", {3.3: True, 2.7: False})
def an_output_that_moves_further(times: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    return judged(monkeypatch, times * 0.5, 50.0)


# Numbers that tests of whole selections notice ---------------------------------------------------------------

for test, *numbers in (
    (test_selection.test_a_small_share_of_edges_is_a_name_by_the_fitted_records, "NAME_SHARE"),
    (test_selection.test_nearly_all_that_is_left_is_worth_a_name, "NEARLY_ALL"),
    (test_selection.test_what_is_left_is_enough_where_all_but_the_noise_of_it_is, "FIRST_REMOVES", "FURTHER_REMOVES"),
    (test_selection.test_all_records_decide_between_equal_numbers, "BETTER"),
    (test_selection.test_what_is_free_in_a_record_is_no_merit, "BETTER"),
    (test_selection.test_of_one_loop_alone_what_explains_most_is_named, "MOST_OF_GAP"),
    (test_selection.test_one_loop_leaves_open_what_fitted_records_explain_unless_others_bear_it_out, "MOST_OF_GAP"),
    (test_selection.test_a_number_at_an_end_of_its_range_explains_nine_tenths, "END_LEAVES"),
    (test_selection.test_a_wider_range_where_a_number_is_at_its_end, "WIDER"),
    (test_selection.test_how_often_a_range_is_widened, "WIDENINGS"),
):
    thresholds.also(test, *numbers)


# The table ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("row", "given", "expected"),
    [pytest.param(row, given, expected, id=f"{row.name}-{number}")
     for row in ROWS for number, (given, expected) in enumerate(row.cases)],
)  # fmt: skip
def test_a_case_on_one_side(row: thresholds.Row, given: tuple[Any, ...], expected: Any) -> None:
    assert row.answer(given) == expected


@pytest.mark.parametrize("factor", [2.0, 0.5])
@pytest.mark.parametrize("number", thresholds.names())
def test_a_number_that_changes_is_noticed(number: str, factor: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Doubled or halved: a row that it decides then answers otherwise."""
    monkeypatch.setattr(acceptance, number, thresholds.changed(getattr(acceptance, number), factor))
    assert not all(row.holds() for row in thresholds.rows(number))


def test_every_number_has_a_unit_a_reason_and_a_run() -> None:
    texts = thresholds.documented()
    assert set(texts) == set(thresholds.names())
    for name, text in texts.items():
        assert text.startswith("["), name
        assert any(words in text for words in ("Set by:", "Changed by:", "Derived")), name


def test_a_text_names_rows_of_its_numbers() -> None:
    """Numbers that stand together have one text."""
    for together, text in thresholds.texts():
        rows = {row.name for number in together for row in thresholds.rows(number)}
        assert set(re.findall(r"(?:acceptance|selection)::(\w+)", text)) <= rows, text


def test_every_number_is_read_somewhere() -> None:
    sources = "".join(path.read_text() for path in (thresholds.ROOT / "hystgen").rglob("*.py"))
    unread = [name for name in thresholds.names() if f"acceptance.{name}" not in sources]
    assert set(unread) <= thresholds.read_inside()


def test_the_page_lists_the_rows_of_every_number() -> None:
    if os.environ.get("HYSTGEN_UPDATE_GOLDEN"):
        thresholds.TABLE.write_text(thresholds.table(), encoding="utf-8")
    assert thresholds.TABLE.read_text(encoding="utf-8") == thresholds.table(), "HYSTGEN_UPDATE_GOLDEN=1 renews it"
