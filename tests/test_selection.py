"""What the search accepts, shown with made-up hypotheses whose errors are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_up import HELD, NOISE, RECORDS, TO_FIT, Hypothesis, Made, World, first_of
from numpy.typing import NDArray
from recordings import brute_output

from hystgen.diagnosis import run
from hystgen.diagnosis.data import signals
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.findings.result import AtEnd
from hystgen.diagnosis.search import fits, ranges, screening, selection
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.hypothesis import Part, Structure
from hystgen.effects import CATALOGUE
from hystgen.effects.base import About, Effect, Run
from hystgen.effects.creep.model import ExponentialCreep
from hystgen.effects.rate_dependence.model import RelaxingPlays
from hystgen.effects.resonance.model import PartMode
from hystgen.effects.thermal.model import HysteresisHeating, LoggedThermal, SelfHeating
from hystgen.identification.joint import Kept

Array = NDArray[np.float64]


def together(world: World, monkeypatch: pytest.MonkeyPatch, alone: dict[str, float] | None = None) -> list[str]:
    """Names of the two effects found; `alone`: the error an effect leaves if refitted alone from the fit of both."""

    def without(now: Hypothesis, name: str, _: Any) -> Hypothesis:
        (rest,) = now.names - {name}
        return Hypothesis(world, frozenset(rest), (alone or {}).get(rest))

    monkeypatch.setattr(selection, "without_effect", without)
    records = world.records
    now: Any = Hypothesis(world, frozenset())
    failed = selection._step(now, world.gap(now), records)
    assert failed is not None
    assert failed.merit is None
    both = selection._together(failed, world.gap(now), records)
    if both is None:
        return []
    first, step = both
    assert first.before == world.gap(now)
    assert first.after <= first.before
    return sorted([first.name, step.best.name])


BOTH = {frozenset("a"): 0.95, frozenset("ab"): 0.02}


def test_effects_that_hide_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither effect alone earns a name, both together leave only noise; a third one hardly changes anything."""
    assert together(World({**BOTH, frozenset("c"): 0.9}, "abc"), monkeypatch) == ["a", "b"]


def test_neither_of_two_is_a_further_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Next to the other, each removes 0.8 times what both leave: enough for a first name, not for a further one."""
    both = {frozenset("a"): 0.95, frozenset("ab"): 0.74}
    assert together(World(both, "ab"), monkeypatch) == ["a", "b"]
    world = World(both, "ab")
    now: Any = Hypothesis(world, frozenset("a"))
    step = selection._step(now, world.gap(now), world.records)
    assert step is not None
    assert step.merit is None


@pytest.mark.parametrize(("bare", "enough"), [(True, 1.166), (False, 1.414)])
@pytest.mark.parametrize("left", [1.0, 1.1, 1.3, 1.5])
@pytest.mark.parametrize("of_fitted", [False, True])
def test_what_is_left_is_enough_where_all_but_the_noise_of_it_is(
    bare: bool, enough: float, left: float, of_fitted: bool
) -> None:
    """A first effect must remove 0.6 times what it leaves, a further one as much; neither leaves less than noise."""
    held, fitted = (NOISE, left * NOISE) if of_fitted else (left * NOISE, NOISE)
    now: Any = SimpleNamespace(bare=bare, errors=lambda _: [np.full(4, fitted)])
    records: Any = SimpleNamespace(noise=NOISE, residual=lambda _: held, to_fit=[], held=[], at_rest=lambda *_: [])
    assert selection.leaves_enough(now, records) is (left > enough)


def test_an_effect_that_needs_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Started from the fit of both, one effect does as well alone: the search had merely not found that fit."""
    assert together(World(BOTH, "ab"), monkeypatch, {"a": 0.021, "b": 0.021}) == []


@pytest.mark.parametrize("one_speed", [False, True])
@pytest.mark.parametrize("one_loop", [False, True])
@pytest.mark.parametrize("second", [0.4, 0.6])
def test_one_loop_alone_supports_one_name_and_not_alone_where_another_explains_most(
    one_loop: bool, one_speed: bool, second: float
) -> None:
    """`b` alone leaves a share `second` of the gap, `a` and `b` together hardly anything; `c` does nothing."""
    shares = {"a": 0.2, "b": second, "c": 1.0, "ab": 0.02, "ac": 0.2}
    world = World({frozenset(names): share for names, share in shares.items()}, "abc")
    world.one_loop, world.one_speed = one_loop, one_speed
    now: Any = Hypothesis(world, frozenset())
    step = selection._step(now, world.gap(now), world.records)
    assert step is not None
    found = selection._found(step, world.records)
    assert (found.name, found.rivals) == ("a", ("b",) if one_loop and second == 0.4 else ())
    further = selection._step(step.best.fitted, world.gap(now), world.records)
    assert further is not None
    assert (further.merit is None) is (one_loop and one_speed)


@pytest.mark.parametrize(("from_rest", "named"), [(0.3, True), (0.6, False)])
def test_an_effect_that_needs_no_free_start_state_is_compared_without_it(from_rest: float, named: bool) -> None:
    """Free start states alone leave as little as the effect with them, as in records with a single hold."""
    now: Any = Made("now", 1, (1.0, 1.0), on_equal_terms=(0.3, 0.3))
    creep: Any = Made("creep", 2, (0.3, 0.3), on_equal_terms=(from_rest, from_rest))
    best = screening.Tried(SimpleNamespace(name="creep", front=False), creep, ("creep",), 0.3, creep.errors(HELD))  # type: ignore[arg-type]
    records: Any = SimpleNamespace(**{**vars(RECORDS), "terms": lambda one, _: [one, one]})
    assert (selection.merit_of(now, best, records) is not None) is named


HOLDS = slice(0, 400)
"""The samples of each made-up record in which the drive stands still."""


class InHolds(Made):
    """An option that leaves an error of 1 but in the holds, where it leaves `held_out` or `fitted` times the noise."""

    def __init__(self, name: str, held_out: float, fitted: float) -> None:
        super().__init__(name, 1, (1.0, 1.0))
        self.in_holds = fitted, held_out

    def errors(self, items: Sequence[int], like: Any = None) -> list[Array]:
        found = super().errors(items, like)
        for item, error in zip(items, found, strict=True):
            error[HOLDS] *= self.in_holds[item in HELD] * NOISE
        return found


def at_rest(errors: list[Array], _: int) -> list[Array]:
    return [error[HOLDS] for error in errors]


WITH_HOLDS: Any = SimpleNamespace(**vars(RECORDS), **{"gap": 1.0, "residual": lambda _: 1.0})
WITH_HOLDS.at_rest = at_rest


@pytest.mark.parametrize(
    ("before", "held_out", "fitted", "named"),
    [
        (3.0, 1.0, 1.0, True),
        (3.0, 1.5, 1.5, True),  # more than noise, but most of what moves is explained
        (2.0, 1.6, 1.0, False),  # neither
        (20.0, 9.0, 9.0, True),  # far above the noise of a clean record
        (5.0, 3.0, 1.0, False),  # less than most
        (5.0, 1.0, 3.0, False),
        (1.1, 1.0, 1.0, False),  # hardly anything moves
    ],
)
def test_what_moves_while_the_drive_stands_still(before: float, held_out: float, fitted: float, named: bool) -> None:
    """The error of the hysteresis, 50 times the noise, hides the effect everywhere else."""
    now, better = InHolds("now", before, before), InHolds("better", held_out, fitted)
    best = screening.Tried(SimpleNamespace(name="better"), better, ("better",), 1.0, better.errors(HELD))  # type: ignore[arg-type]
    merit = selection.merit_of(now, best, WITH_HOLDS)  # type: ignore[arg-type]
    assert (merit is not None) is named
    if merit is not None:
        assert merit.worth(1.0, WITH_HOLDS)
    assert selection.merit_of(now, best, RECORDS) is None, "without holds there is nothing to tell it by"  # type: ignore[arg-type]


@pytest.mark.parametrize(("left", "more"), [(1.1, False), (1.3, True)])
def test_what_moves_in_holds_is_reason_enough_to_go_on(left: float, more: bool) -> None:
    """Elsewhere, only noise is left."""
    now: Any = SimpleNamespace(bare=False, errors=lambda items: [np.full(400, left * NOISE) for _ in items])
    records: Any = SimpleNamespace(noise=NOISE, residual=lambda _: NOISE, to_fit=TO_FIT, held=HELD, at_rest=at_rest)
    assert selection.leaves_enough(now, records) is more


@pytest.mark.parametrize(("left", "way"), [(1.1, True), (2.0, False)])
def test_an_effect_does_not_give_way_to_one_that_leaves_more_in_holds(left: float, way: bool) -> None:
    """The other one has fewer parameters and leaves as much everywhere else."""
    now, other = InHolds("now", 1.0, 1.0), InHolds("other", left, left)
    now.actuator = SimpleNamespace(nuisances=lambda _: np.ones((3, 1)))
    best = screening.Tried(SimpleNamespace(name="other"), other, ("other",), 1.0, other.errors(HELD))  # type: ignore[arg-type]
    assert selection._gives_way(now, "one", best, WITH_HOLDS) is way  # type: ignore[arg-type]


def test_holds_of_records() -> None:
    """Of a staircase, the last three fifths of each level, less their mean; ramps belong to no hold."""
    levels = np.repeat([0.0, 1.0, 0.4], 100)
    v = np.concatenate([levels, np.linspace(0.4, 1.0, 100)])
    item = Item("record", Run(0.01 * np.arange(400.0), v, {}), np.zeros(400), None, 1.0)
    found = signals.settled(item)
    assert [(hold.start, hold.stop) for hold in found] == [(40, 100), (140, 200), (240, 301)]


@pytest.mark.parametrize(("held_out", "open_"), [(0.02, []), (0.3, ["b"])])
def test_one_loop_leaves_open_what_fitted_records_explain_unless_others_bear_it_out(
    held_out: float, open_: list[str]
) -> None:
    """`a` and `b` leave hardly anything in the fitted records, but `b` fails on held-out ones."""
    now = Made("", 0, (1.0, 1.0))
    records: Any = SimpleNamespace(noise=NOISE, one_loop=True, residual=lambda each: each.left[1])
    tried: list[Any] = [
        SimpleNamespace(name=name, fitted=SimpleNamespace(rms=0.02), held_out=left, errors=[np.full(100, left)])
        for name, left in (("a", held_out), ("b", 0.8))
    ]
    assert selection.left_open(now, tried[0], tried, records) == open_  # type: ignore[arg-type]


@pytest.mark.parametrize(("left", "named"), [(0.45, True), (0.55, False)])
@pytest.mark.parametrize("one_loop", [False, True])
def test_of_one_loop_alone_what_explains_most_is_named(one_loop: bool, left: float, named: bool) -> None:
    world = World({frozenset("a"): left}, "a")
    world.one_loop = one_loop
    now: Any = Hypothesis(world, frozenset())
    step = selection._step(now, world.gap(now), world.records)
    assert step is not None
    assert (step.merit is not None) is (named or not one_loop)


@pytest.mark.parametrize("one_loop", [False, True])
@pytest.mark.parametrize(("share", "named"), [(0.03, True), (0.1, False)])
def test_of_one_loop_a_name_leaves_a_few_times_the_noise_at_most(
    one_loop: bool, share: float, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A share of the gap remains in addition to the noise: 1.5 or 3.7 times the noise in all."""
    world = World({frozenset("a"): share}, "a")
    world.one_loop = one_loop

    now: Any = Hypothesis(world, frozenset())
    monkeypatch.setattr(selection.fits, "begun", lambda *_: SimpleNamespace(found=lambda _: now))
    monkeypatch.setattr(selection.fits, "fit", lambda *_: Hypothesis(world, frozenset("a")))
    outcome = selection.select(world.records, now)
    assert [each.name for each in outcome.found] == (["a"] if named or not one_loop else [])
    assert world.gap(outcome.fitted) == world.gap(Hypothesis(world, frozenset("a" if outcome.found else "")))
    assert len(outcome.rankings) == 1


@pytest.mark.parametrize("left", [0.0, 1.0])
@pytest.mark.parametrize("memory", [0.0, 0.9, 0.99])
def test_chance_makes_no_pair(left: float, memory: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every hypothesis leaves the same error, be it noise of any colour or a disturbance that none explains."""
    names = "abcdef"
    same = {frozenset(a + b): left for a in names for b in names} | {frozenset(): left}
    assert together(World(same, names, memory), monkeypatch) == []


def test_the_second_is_sought_anew_beside_the_right_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """`c` was the best second effect next to the wrong `w`; next to `a`, which replaces `w`, the best is `b`."""
    left = {"w": 0.5, "c": 0.6, "a": 0.7, "b": 0.8, "cw": 0.2, "bw": 0.4, "ac": 0.1, "ab": 0.02}
    world = World({frozenset(names): share for names, share in left.items()}, "abcw")

    def without(now: Hypothesis, name: str, _: Any) -> Hypothesis:
        return Hypothesis(world, now.names - {name})

    monkeypatch.setattr(selection, "without_effect", without)
    monkeypatch.setattr(selection, "without_refit", without)
    now: Any = Hypothesis(world, frozenset("wc"))
    gap = world.gap(Hypothesis(world, frozenset()))
    found = [
        selection.Found("w", "w", gap, left["w"], 0.0, ()),
        selection.Found("c", "c", left["w"], left["cw"], 0.0, ("a", "b")),
    ]
    best: Any
    best, unchanged = selection._exchanged(now, [*found], {}, {"b", "c", "w"}, world.records)
    assert best is now  # without `a`, nothing better is found
    assert [each.name for each in unchanged] == ["w", "c"]
    best, found = selection._exchanged(now, found, {}, {"a", "b", "c", "w"}, world.records)
    assert best.names == frozenset("ab")
    assert sorted(each.name for each in found) == ["a", "b"]
    assert found[0].before == gap
    assert found[-1].after == world.gap(best)
    assert not any(each.rivals for each in found)  # next to the other effect nothing comes near


@pytest.mark.parametrize("second", [0.1, 1.0])
def test_a_rival_that_is_the_next_effect_is_not_followed_up(second: float) -> None:
    """`a`, `b` and `c` are equally good; after `a` follows `b`, and after `c` follows `d`, which leaves least.

    If nothing follows `a`, both rivals are followed up.
    """
    left = {"a": 0.5, "b": 0.505, "c": 0.51, "d": 0.9, "ab": second, "bc": 0.5, "cd": 0.03}
    world = World({frozenset(names): share for names, share in left.items()}, "abcd")
    now: Any = Hypothesis(world, frozenset())
    latest = selection._step(now, world.gap(now), world.records)
    assert latest is not None
    step = selection._step(latest.best.fitted, world.gap(now), world.records)
    assert step is not None
    assert (latest.best.name, step.merit is not None) == ("a", second < 1.0)
    extended, extensions = [], world.extensions

    def seen(now: Hypothesis, *more: Any) -> list[Any]:
        extended.append("".join(now.names))
        return extensions(now, *more)

    world.extensions = seen  # type: ignore[method-assign]
    pair = selection._with_rival(latest, step, world.gap(now), world.records)
    assert pair is not None
    assert [each.best.name for each in pair] == ["c", "d"]
    assert sorted(extended) == (["c"] if second < 1.0 else ["b", "c"])


@pytest.mark.parametrize(("apart", "followed"), [(0.2, []), (0.4, ["b", "c"])])
def test_a_rival_that_leaves_the_same_errors_is_not_followed_up(apart: float, followed: list[str]) -> None:
    """After `a` nothing follows, and after `b` follows `c`: that is believed only if the errors of `a` and `b` differ;
    `apart`: by how many times the noise."""
    left = {"a": 0.5, "b": 0.5 + apart * NOISE * np.sqrt(2.0), "ac": 0.5, "bc": 0.02}
    world = World({frozenset(names): share for names, share in left.items()}, "abc")
    world.colour = lambda *_: np.zeros(2000)  # type: ignore[method-assign]
    world.left |= {frozenset("ab"): 0.5}
    now: Any = Hypothesis(world, frozenset())
    latest = selection._step(now, world.gap(now), world.records)
    assert latest is not None
    assert latest.best.name == "a"
    tried = [world.tried(latest.best.fitted, name) for name in "bc"]  # type: ignore[arg-type]
    step = selection._Step(latest.best.fitted, tried, latest.best, None)
    pair = selection._with_rival(latest, step, world.gap(now), world.records)
    assert [each.best.name for each in pair or ()] == followed


@pytest.mark.parametrize(("name", "more"), [
    ("rate_dependence", {"creep", "resonance", "lag", "delay"}), ("sensor_nonlinearity", set()),
])  # fmt: skip
def test_what_lags_is_sought_in_the_place_of_what_lags(
    name: str, more: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever was among the best of a round: next to an element of the wrong shape, a lag may not have been."""
    asked: list[Any] = []

    def step(*given: Any) -> None:
        asked.append(given[3])

    for other in ("without_effect", "without_refit"):
        monkeypatch.setattr(selection, other, lambda *_: SimpleNamespace())
    monkeypatch.setattr(selection, "_step", step)
    found = [selection.Found(each, "", 1.0, 1.0, 0.0, ()) for each in (name, "bouc_wen")]
    selection._exchanged(SimpleNamespace(), found, {}, {name, "bouc_wen"}, RECORDS)  # type: ignore[arg-type]
    (worth,) = asked
    assert {each for each in CATALOGUE if worth(SimpleNamespace(name=each))} == {name, "bouc_wen", *more}


class Apart(Hypothesis):
    """A hypothesis that leaves different shares in fitted and held-out records."""

    def __init__(self, world: World, names: frozenset[str], fitted: float, held_out: float) -> None:
        super().__init__(world, names, fitted)
        self.held_out = Hypothesis(world, names, held_out)

    def errors(self, items: list[int], _: Any = None) -> list[Array]:
        fitted = super().errors(items)
        return [
            b if item in self.world.held else a
            for item, a, b in zip(items, fitted, self.held_out.errors(items), strict=True)
        ]


def extended(world: World, now: Hypothesis, label: str, name: str, left: tuple[float, float]) -> screening.Tried:
    """`now` extended by an effect in some shape, which leaves these shares in fitted and held-out records."""
    made: Any = Apart(world, now.names | {label}, *left)
    option: Any = SimpleNamespace(label=label, name=name)
    errors = made.errors(list(world.held))
    return screening.Tried(option, made, (name,), world.rms(errors), errors)


@pytest.mark.parametrize(("left", "others"), [(0.3, ["r", "c"]), (0.07, [])])
def test_what_the_accepted_effect_hides(left: float, others: list[str]) -> None:
    """After `c`, nothing is left for `r`, whose part it has taken, but after `r`, `c` takes only its own part. This is
    tried if `c` leaves more than three times the noise."""
    world = World({}, "")
    ways = {"": [("c", left), ("r", 0.6)], "c": [("r", 0.95 * left)], "r": [("c", 0.02)]}

    def extensions(now: Hypothesis, worth: Any = None) -> list[screening.Tried]:
        found = [extended(world, now, name, name, (share, share)) for name, share in ways["".join(now.names)]]
        return [each for each in found if worth is None or worth(each.option)]

    world.extensions = extensions  # type: ignore[assignment, method-assign]
    now: Any = Hypothesis(world, frozenset())
    latest = selection._step(now, world.gap(now), world.records)
    assert latest is not None
    step = selection._step(latest.best.fitted, world.gap(now), world.records)
    assert step is not None
    assert (latest.best.name, step.merit) == ("c", None)
    pair = selection._with_rival(latest, step, world.gap(now), world.records)
    assert [each.best.name for each in pair or ()] == others


@pytest.mark.parametrize(("fitted", "shapes"), [(0.05, ["a", "t"]), (0.45, [])])
def test_another_shape_of_the_first_beside_a_second_that_spoils_it(fitted: float, shapes: list[str]) -> None:
    """The simple shape `s` of `a` is as good alone, but with it `t` explains fitted records and spoils held-out ones.
    The other shape is tried only if `t` explains the fitted records."""
    world = World({}, "")
    ways = {
        "": [("s", "a", 0.5, 0.5), ("a", "a", 0.49, 0.5)],
        "s": [("t", "t", fitted, 0.6)], "a": [("t", "t", 0.03, 0.03)],
    }  # fmt: skip

    def extensions(now: Hypothesis, worth: Any = None) -> list[screening.Tried]:
        found = [extended(world, now, label, name, (a, b)) for label, name, a, b in ways["".join(now.names)]]
        return [each for each in found if worth is None or worth(each.option)]

    world.extensions = extensions  # type: ignore[assignment, method-assign]
    now: Any = Hypothesis(world, frozenset())
    simple, rich = extensions(now)
    latest = selection._Step(now, [simple, rich], simple, selection.Merit(0.5, 0.5, 0.5, 0.0))
    step = selection._step(simple.fitted, world.gap(now), world.records)
    assert step is not None
    assert step.merit is None
    pair = selection._with_rival(latest, step, world.gap(now), world.records)
    assert [each.best.option.label for each in pair or ()] == shapes


def made(name: str, free: int, left: tuple[float, float]) -> screening.Tried:
    one: Any = Made(name, free, left)
    return screening.Tried(SimpleNamespace(name=name), one, (name,), left[1], one.errors(HELD))  # type: ignore[arg-type]


OF_MADE: Any = SimpleNamespace(
    to_fit=TO_FIT, held=HELD, noise=NOISE, at_rest=lambda *_: [],
    residual=lambda each: float(np.sqrt(np.mean(np.square(each.errors(HELD))))),
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "free", "left", "way"),
    [
        ("other", 1, (1.1, 1.1), True),  # fewer numbers, and records do not separate the two
        ("other", 1, (1.1, 1.3), False),
        ("other", 1, (1.3, 1.1), False),
        ("other", 5, (0.9, 0.9), False),  # more numbers: the records have to separate it
        ("other", 5, (0.7, 0.7), True),
        ("other", 3, (0.98, 0.98), True),  # as many numbers: the smaller error over all records
        ("other", 3, (0.998, 0.998), False),
        ("other", 3, (1.02, 0.97), True),  # equal over all records: the smaller held-out error
        ("other", 3, (0.98, 1.02), False),
        ("other", 3, (0.9, 1.06), False),  # held-out records separate the two
        ("one", 5, (0.9, 0.9), True),  # another shape of the same effect
        ("one", 3, (0.98, 0.98), False),
        ("one", 1, (1.1, 1.1), False),
    ],
)
def test_what_an_effect_gives_way_to(name: str, free: int, left: tuple[float, float], way: bool) -> None:
    now = made("one", 3, (1.0, 1.0))
    assert selection._gives_way(now.fitted, "one", made(name, free, left), OF_MADE) is way


def test_of_those_that_it_gives_way_to_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    """The best shape of the effect itself has more numbers than another effect that is as good."""
    monkeypatch.setattr(selection, "merit_of", lambda *_: selection.Merit(1.0, 1.0, 0.5, 0.0))
    shape, other = made("one", 4, (0.8, 0.8)), made("other", 3, (0.82, 0.82))
    step = selection._Step(None, [shape, other], shape, selection.Merit(1.0, 1.0, 0.5, 0.0))  # type: ignore[arg-type]
    found = selection._that_replaces(made("one", 3, (1.0, 1.0)).fitted, "one", step, OF_MADE)
    assert found is not None
    assert found.best is other
    simple = made("one", 3, (0.81, 0.81))  # another shape of the effect, with as few numbers, that leaves less
    step = selection._Step(None, [shape, simple, other], shape, step.merit)  # type: ignore[arg-type]
    found = selection._that_replaces(made("one", 3, (1.0, 1.0)).fitted, "one", step, OF_MADE)
    assert found is not None
    assert found.best.name == "one"
    equal = made("equal", 4, (0.7, 0.7))  # a smaller error with no fewer numbers would have been the best of the step
    step = selection._Step(None, [shape, equal], shape, step.merit)  # type: ignore[arg-type]
    found = selection._that_replaces(made("one", 3, (1.0, 1.0)).fitted, "one", step, OF_MADE)
    assert found is not None
    assert found.best is shape
    step = selection._Step(None, [shape], shape, step.merit)  # type: ignore[arg-type]
    assert selection._that_replaces(shape.fitted, "one", step, OF_MADE) is None


@pytest.mark.parametrize(
    ("held_out", "fitted", "first"), [(0.99, 1.2, "simple"), (1.03, 1.2, "rich"), (1.03, 1.0, "simple")]
)
def test_what_is_free_in_a_record_is_no_merit(held_out: float, fitted: float, first: str) -> None:
    """Given what the richer effect leaves free in a record, the simpler one explains held-out records as well."""

    rich = Made("rich", 5, (1.0, 1.0), (1.0, 1.0))
    simple = Made("simple", 1, (2.0, 2.0), (fitted, held_out))
    assert first_of(rich, simple) == first


@pytest.mark.parametrize(("fitted", "first"), [(1.04, "simple"), (2.0, "rich")])
def test_a_number_at_its_end_is_none_of_its_own(fitted: float, first: str) -> None:
    """An example is a resonance at its highest frequency, which looks like a delay: the simpler effect is named."""
    rich, simple = Made("rich", 5, (1.0, 1.0)), Made("simple", 1, (fitted, 1.03))
    assert first_of(rich, simple) == "rich"
    rich.shape = rich.structure.bounds[1]
    assert first_of(rich, simple) == first


@pytest.mark.parametrize(
    ("held_out", "fitted", "first"), [(1.02, 0.95, "other"), (1.02, 1.0, "best"), (1.08, 0.9, "best")]
)
def test_all_records_decide_between_equal_numbers(held_out: float, fitted: float, first: str) -> None:
    """Held-out records alone decide only if they tell the two effects apart."""
    assert first_of(Made("best", 1, (1.0, 1.0)), Made("other", 1, (fitted, held_out))) == first


@pytest.mark.parametrize(("fitted", "first"), [(1.004, "simple"), (1.006, "rich")])
def test_errors_that_hardly_differ_are_equal_however_certain_the_difference_is(fitted: float, first: str) -> None:
    """The simpler effect leaves slightly more in every block, so chance does not explain the difference."""
    assert first_of(Made("rich", 2, (1.0, 1.0)), Made("simple", 1, (fitted, 1.03))) == first


@pytest.mark.parametrize("others", ["saturation", "sensor_nonlinearity", "noncongruent", "thermal"])
def test_of_equal_curves_that_of_the_actuator_comes_first(others: str) -> None:
    assert first_of(Made(others, 1, (1.0, 1.0)), Made("asymmetry", 1, (1.003, 1.003))) == "asymmetry"
    assert first_of(Made(others, 1, (1.0, 1.0)), Made("asymmetry", 1, (0.99, 1.015))) == others, "held-out ones differ"


@pytest.mark.parametrize(
    ("held_out", "fitted", "first"), [(1.15, 0.4, "other"), (1.15, 0.6, "best"), (1.4, 0.4, "best")]
)
def test_a_small_lead_on_held_out_records_is_not_enough(held_out: float, fitted: float, first: str) -> None:
    """An effect not found yet rules held-out records; the other candidate fits far better what it hardly touches."""
    assert first_of(Made("best", 1, (1.0, 1.0)), Made("other", 5, (fitted, held_out))) == first


@pytest.mark.parametrize(
    ("left", "fitted", "follows"), [(0.304, 0.502, True), (0.304, 0.55, False), (0.33, 0.502, False)]
)
def test_a_twin_of_what_is_followed_up_is_not_cut_off(left: float, fitted: float, follows: bool) -> None:
    """Five candidates precede the twin on held-out records, one of which leaves as much as it does."""

    def screened(name: str, left: float, fitted: float = 0.6) -> Any:
        option = SimpleNamespace(name=name, label=name)
        return SimpleNamespace(option=option, residual=left, fitted=SimpleNamespace(rms=fitted), numbers=1)

    others = [screened(name, 0.1 + 0.02 * k) for k, name in enumerate("abcd")]
    delay, lag = screened("delay", 0.303, 0.5), screened("lag", left, fitted)
    best_fits = [screened(name, 0.9, 0.4) for name in "ef"]
    tried = [*others, lag, delay, *best_fits]
    assert [each.option.name for each in screening._kept(tried, tried)] == [*"abcd", "delay", *"ef"] + ["lag"] * follows
    assert lag not in screening._kept(tried, others)


@pytest.mark.parametrize(
    ("numbers", "left", "follows"), [(1, 0.101, True), (1, 0.104, False), (2, 0.101, False), (3, 0.101, False)]
)
def test_a_simpler_shape_that_is_as_good_is_not_cut_off(numbers: int, left: float, follows: bool) -> None:
    """Two richer shapes of the front leave slightly smaller errors in the thinned records."""

    def screened(label: str, numbers: int, left: float) -> Any:
        option = SimpleNamespace(name="asymmetry", label=label)
        return SimpleNamespace(option=option, residual=left, fitted=SimpleNamespace(rms=left), numbers=numbers)

    tried = [screened("both ways", 2, 0.1), screened("dead zones", 8, 0.1), screened("one way", numbers, left)]
    labels = [each.option.label for each in screening._kept(tried, tried)]
    assert labels == ["both ways", "dead zones"] + ["one way"] * follows


def test_what_fitted_records_tell_apart_is_not_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of three effects that held-out records do not tell apart, one leaves far more in the fitted records."""

    def made(name: str, fitted: float) -> Any:
        return SimpleNamespace(name=name, fitted=SimpleNamespace(rms=fitted))

    monkeypatch.setattr(selection, "rivals", lambda *_: [made("b", 1.1), made("c", 1.3)])
    now, records = made("", 2.0), SimpleNamespace(noise=NOISE, one_loop=False)
    assert selection.left_open(now, made("a", 1.0), [], records) == ["b"]  # type: ignore[arg-type]


def test_what_a_shape_leaves_free_is_part_of_the_effect() -> None:
    """For another effect it would be no merit; the simpler shape of the same effect leaves twice as much without it."""
    rich, simple = Made("rich", 9, (1.0, 1.0)), Made("simple", 2, (2.0, 2.0), (1.0, 1.0))
    assert first_of(rich, simple) == "simple"
    assert first_of(rich, simple, "creep") == "rich"


def test_a_small_share_of_edges_is_a_name_by_the_fitted_records() -> None:
    """Held-out records are ruled by another effect at their edges, of which fitted records have hardly any."""
    records: Any = SimpleNamespace(gap=1.0)
    assert selection.Merit(0.08, 0.0, 0.9, 1e-9).worth(1.0, records)
    assert selection.Merit(0.06, 0.5, 0.9, 1e-9).worth(1.0, records)
    assert not selection.Merit(0.06, 0.06, 0.9, 1e-9).worth(1.0, records)


def test_nearly_all_that_is_left_is_worth_a_name() -> None:
    """An example is an effect of a few per cent of a resonance that is some hundred times the noise."""
    records: Any = SimpleNamespace(gap=1.0)
    assert selection.Merit(0.06, 0.06, 0.15, 1e-9).worth(1.0, records)
    assert not selection.Merit(0.06, 0.06, 0.4, 1e-9).worth(1.0, records)


@pytest.mark.parametrize(("left", "first", "further"), [(0.6, True, True), (0.8, True, False), (0.9, False, False)])
def test_a_further_effect_removes_more_than_it_leaves(left: float, first: bool, further: bool) -> None:
    """From an error of 1 it removes 0.8, 0.6 and 0.44, which are 1.33, 0.75 and 0.48 times what it leaves."""
    better = Made("better", 1, (left, left))
    best = screening.Tried(SimpleNamespace(name="better"), better, ("better",), left, better.errors(HELD))  # type: ignore[arg-type]
    for bare, accepted in ((True, first), (False, further)):
        now: Any = Made("now", 1, (1.0, 1.0))
        now.bare = bare
        assert (selection.merit_of(now, best, RECORDS) is not None) is accepted


@pytest.mark.parametrize("beside", [None, "rate_dependence", "creep"])
@pytest.mark.parametrize(("name", "left"), [("bouc_wen", (0.4, 0.4)), ("bouc_wen", (0.6, 0.4)), ("drift", (0.6, 0.4))])
def test_next_to_plays_that_depend_on_the_rate_an_element_takes_most(
    name: str, left: tuple[float, float], beside: str | None
) -> None:
    """`left`: of fitted and of held-out errors of 1; an element that leaves over half of either may be what a rate
    dependence of another law leaves."""
    others: dict[str, Effect] = {
        "rate_dependence": RelaxingPlays(name="rate_dependence", shape="relaxation", time_constant=0.1),
        "creep": ExponentialCreep(name="creep", time_constants=(1.0,), weights=(0.1,)),
    }
    now: Any = Made("now", 1, (1.0, 1.0))
    now.structure.effects = lambda _: [others[beside]] if beside else []
    merit = selection.merit_of(now, made(name, 1, left), RECORDS, 0.6)
    assert (merit is None) is (name == "bouc_wen" and beside == "rate_dependence" and max(left) > 0.5)


@pytest.mark.parametrize(("fitted", "accepted"), [(0.9, True), (0.999, False)])
def test_what_only_others_show_is_no_merit(fitted: float, accepted: bool) -> None:
    """The numbers of the effect come from fitted records, in which it makes no difference."""
    now, better = Made("now", 1, (1.0, 1.0)), Made("better", 1, (fitted, 0.5))
    option: Any = SimpleNamespace(name="better")
    best = screening.Tried(option, better, ("better",), 0.5, better.errors(HELD))  # type: ignore[arg-type]
    assert (selection.merit_of(now, best, RECORDS) is not None) is accepted  # type: ignore[arg-type]


@pytest.mark.parametrize(("own", "accepted"), [(1.0, True), (0.5, False)])
def test_what_is_less_free_in_a_record_is_no_merit(own: float, accepted: bool) -> None:
    """The hypothesis leaves more with the effect's small start states than with its own; the effect must beat both."""
    now, better = Made("now", 5, (own, own), (1.0, 1.0)), Made("better", 5, (0.6, 0.6))
    option: Any = SimpleNamespace(name="better")
    best = screening.Tried(option, better, ("better",), 0.6, better.errors(HELD))  # type: ignore[arg-type]
    assert (selection.merit_of(now, best, RECORDS) is not None) is accepted  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("left", "names", "given"),
    [(0.59, [], False), (0.61, [], True), (0.59, ["lag"], False), (0.61, ["lag"], False), (0.65, ["lag"], True)],
)
def test_the_model_as_given_is_the_answer_where_it_does_better(left: float, names: list[str], given: bool) -> None:
    """The given model leaves 0.6 in held-out records; named effects are dropped if they do worse by a twentieth."""
    first, found = Made("given", 1, (1.0, 0.6)), Made("found", 1, (0.5, left))
    records: Any = SimpleNamespace(held=HELD, residual=lambda each: each.left[1])
    effects: Any = tuple(SimpleNamespace(name=name) for name in names)
    answer = selection.no_worse_than(first, selection.Outcome(found, found, effects, ()), records)  # type: ignore[arg-type]
    assert (answer.fitted is first) is given
    assert [each.name for each in answer.found] == ([] if given else names)


@pytest.mark.parametrize(("left", "names", "taken"), [(0.601, [], False), (0.605, [], True), (0.605, ["lag"], True)])
def test_what_identify_finds_is_the_answer_where_it_does_better(left: float, names: list[str], taken: bool) -> None:
    """The model of `identify` leaves 0.6 in held-out records; it wins, over names too, if the errors are not equal."""
    other, found = Made("identified", 1, (1.0, 0.6)), Made("found", 1, (0.5, left))
    records: Any = SimpleNamespace(held=HELD, residual=lambda each: each.left[1])
    effects: Any = tuple(SimpleNamespace(name=name) for name in names)
    before: Any = selection.Outcome(found, found, effects, ())  # type: ignore[arg-type]
    answer = selection.no_worse_than(other, before, records, selection.IDENTIFIED)  # type: ignore[arg-type]
    assert (answer.fitted is other) is taken
    assert answer.refitted is found
    assert answer.written == ("identified" if taken else before.written)
    assert answer.found == (() if taken else effects)


# Numbers at an end of their range ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fitted", "held", "most", "stand"),
    [
        (9.0, 9.0, True, True),
        (12.0, 9.0, True, False),
        (9.0, 12.0, True, False),
        (12.0, 12.0, False, True),
        (2.7, 2.7, True, True),
    ],
)
def test_a_number_at_an_end_of_its_range_explains_nine_tenths(
    fitted: float, held: float, most: bool, stand: bool
) -> None:
    """Errors are multiples of the noise, of a hundred times the noise: far above it, yet nearly all is explained."""
    now, none = Made("now", 1, (fitted * NOISE, held * NOISE), most=most), Made("none", 1, (100 * NOISE, 100 * NOISE))
    refused = selection.borne_out(now, none, RECORDS)  # type: ignore[arg-type]
    assert (refused is None) is stand
    if refused is not None:
        larger = max(fitted, held)
        assert refused.why == "range"
        assert refused.value == pytest.approx(np.sqrt((larger**2 - 1.0) / (100.0**2 - 1.0)), rel=0.05)


@pytest.mark.parametrize(("within", "named"), [(0.5, True), (-0.5, False)])
def test_an_effect_that_does_not_level_off_within_the_records_is_not_named(within: float, named: bool) -> None:
    """A time constant of 1 s removes 90 % of the error in records of 3 s and in records of 0.3 s."""
    grown = Made("thermal", 1, (0.1, 0.1), levels_off=(0, within))
    best = screening.Tried(
        SimpleNamespace(name="thermal"), grown, ("thermal",), 0.1, grown.errors(RECORDS.held)  # type: ignore[arg-type]
    )
    found = selection.judged(Made("now", 1, (1.0, 1.0)), best, RECORDS)  # type: ignore[arg-type]
    assert isinstance(found, selection.Merit) is named
    if not named:
        assert found == selection.Refusal("grows", 1.0, 10.0**within)


def test_own_heat_has_to_level_off_within_the_session() -> None:
    """A logged temperature need not, since a record shows it whatever it does."""
    records, _ = of_warm(0.1)
    for shape in (SelfHeating, HysteresisHeating):
        for candidate in shape.candidates(records.known):
            place, most = candidate.levels_off or (0, 0.0)
            made = candidate.build(np.where(np.arange(len(candidate.start)) == place, most, candidate.start))
            assert made.time_constant == pytest.approx(records.known.session)  # type: ignore[attr-defined]
    assert all(each.levels_off is None for each in LoggedThermal.candidates(records.known))


def warm(gain: float, seed: int) -> Item:
    """Plays in a room of 20 +- 0.5 degrees, whose gain follows the logged temperature."""
    random = np.random.default_rng(seed)
    t = np.arange(600) * 0.1
    v = 50.0 - 50.0 * np.cos(0.9 * t + seed) * np.exp(-0.01 * t)
    temperature = 20.0 + 0.5 * np.sin(0.13 * t + seed)
    y = brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0) * (1.0 + gain * (temperature - 20.0))
    return Item(f"r{seed}", Run(t, v, {"temperature": temperature}), y + random.normal(0.0, 0.02, len(t)), (), 150.0)


def of_warm(gain: float) -> tuple[screening.Records, Fitted]:
    """Two records to fit and one held out, and a fit with the effect, whose gain is its only number."""
    to_fit, held = [warm(gain, 0), warm(gain, 1)], [warm(gain, 2)]
    structure = Structure(np.array([0.0, 10.0]), Kept())
    plain = fits.fit(structure, to_fit, np.empty(0), np.array([1.0, 0.5]))
    records = screening.Records.of(to_fit, held, plain, 0.02)
    candidate = LoggedThermal.candidates(records.known)[0]
    extended = replace(structure, parts=(Part("thermal", candidate),))
    return records, fits.fit(extended, to_fit, candidate.start, plain.weights)


def test_a_wider_range_where_a_number_is_at_its_end() -> None:
    """0.4 a degree lies beyond 0.2 and within the first wider range, which reaches 0.6; 0.1 is inside the usual one."""
    records, now = of_warm(0.4)
    assert now.actuator.effects[0].gain_per_degree == pytest.approx(0.2)  # type: ignore[attr-defined]
    wider = ranges.wider(now, records)
    assert wider is not None
    assert (wider.structure.bounds[0][0], wider.structure.bounds[1][0]) == (-20.0, 60.0)
    found, failed = selection._widened(now, records)
    assert failed is None
    assert found.actuator.effects[0].gain_per_degree == pytest.approx(0.4, rel=0.01)  # type: ignore[attr-defined]
    assert records.residual(found) < 1.1 * records.noise < records.residual(now)
    (end,) = ranges.ends(found, failed, False)
    at = end.found
    assert (at.key, at.end, at.usual, at.why) == ("gain_per_degree", "largest", pytest.approx(0.2), "beyond")
    assert fits.part_at_an_end(found, 0)  # having been found makes it no less unlikely
    records, now = of_warm(0.1)
    assert ranges.wider(now, records) is None
    assert ranges.ends(now, None, True) == ()


def test_a_wider_range_without_a_gain_on_held_out_records_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the records to fit are better with it; the report says what it leaves."""
    records, now = of_warm(0.4)
    held = [warm(0.2, 2)]
    records = replace(records, held=held)
    found, failed = selection._widened(now, records)
    assert found is now
    (end,) = ranges.ends(found, failed, False)
    assert (end.found.why, end.found.reached) == ("no less", pytest.approx(0.6))
    assert failed is not None
    assert (end.found.leaves, end.found.kept) == failed
    assert failed.kept == records.residual(now)
    assert failed.leaves > 0.95 * failed.kept
    monkeypatch.setattr(selection, "is_noise", lambda *_: True)
    assert selection._widened(now, records) == (now, None)


@pytest.mark.parametrize("better", [1, 2, 5])
def test_how_often_a_range_is_widened(better: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of the first `better` wider ranges halves the error; three are tried at most."""
    tried = []

    def wider(now: Made, _: Any) -> Made:
        tried.append(now)
        share = 0.5 if len(tried) <= better else 1.0
        return Made("wider", 1, (1.0, share * now.left[1]))

    monkeypatch.setattr(ranges, "wider", wider)
    records: Any = SimpleNamespace(held=HELD, noise=NOISE, residual=lambda each: each.left[1])
    found, failed = selection._widened(Made("now", 1, (1.0, 1.0)), records)  # type: ignore[arg-type]
    assert len(tried) == min(better + 1, 3)
    assert found.left[1] == 0.5 ** min(better, 3)  # type: ignore[attr-defined]
    assert failed == (None if better >= 3 else 2 * (found.left[1],))  # type: ignore[attr-defined]


ABOUT = About((0.0, 100.0), 10.0, 1e-3, 1.0, 1.0, 1e4, 1e3, (0.0, 10.0, 20.0), frozenset())


@pytest.mark.parametrize(
    ("kind", "shape", "at", "key", "farthest"),
    [
        (RelaxingPlays, 1, 1, "exponent", 10.0),  # the largest that the schema allows
        (ExponentialCreep, 0, 1, "weights", None),
        (PartMode, 0, 2, "share", 1.0),
    ],
)
def test_a_wider_range_ends_where_the_schema_does(
    kind: type[Effect], shape: int, at: int, key: str, farthest: float | None
) -> None:
    """The effect at the wider end can be written; a sixteenth of the way farther, it could not."""
    candidate = kind.candidates(ABOUT)[shape]
    numbers = candidate.start.copy()
    numbers[at] = candidate.high[at]
    part = Part("made", candidate)
    wide = ranges.widened(part, numbers, ABOUT.thresholds)
    assert wide.ordinary is candidate
    assert ranges.widened(replace(part, firm=True), numbers, ABOUT.thresholds).candidate is candidate
    way = candidate.high[at] - candidate.low[at]
    assert candidate.high[at] < wide.candidate.high[at] <= candidate.high[at] + way
    changed = np.flatnonzero(wide.candidate.high != candidate.high)
    assert changed.tolist() == [at]
    numbers[at] = wide.candidate.high[at]
    made = candidate.build(numbers)
    type(made).model_validate(made.model_dump())
    if farthest is not None:
        assert getattr(made, key) <= farthest
        numbers[at] += way / 16.0
        with pytest.raises(ValueError, match=key):
            kind.model_validate(candidate.build(numbers).model_dump())
    numbers[at] = candidate.high[at]
    assert ranges._number(candidate.build, numbers, at, True, numbers[at])[0] == key


@pytest.mark.parametrize(
    ("bare", "names", "left", "without"),
    [
        (0.97, ["lag"], 0.1, False),  # held-out records hardly prefer no front
        (0.9, ["lag"], 0.4, True),
        (0.9, ["lag", "asymmetry"], 0.4, False),  # a front is found again, which does worse in the end
        (0.9, ["lag", "asymmetry"], 0.2, True),
        (0.9, [], 0.4, False),
    ],
)
def test_a_front_that_misleads_held_out_records_is_left_out(
    bare: float, names: list[str], left: float, without: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the front, the refit leaves 1 and the final fit 0.3; `left` is what the final fit without it leaves."""
    ready: Any = SimpleNamespace(held=HELD)
    refits = {"front": Made("front", 1, (0.3, 1.0)), "none": Made("none", 1, (1.0, bare))}
    ends = {"front": Made("front", 1, (0.2, 0.3)), "none": Made("none", 1, (0.2, left))}

    def thorough(_: Any, __: Any, refit: Any) -> Any:
        made = refit(ready).name
        found = tuple(SimpleNamespace(name=name) for name in (names if made == "none" else ["creep"]))
        outcome: Any = selection.Outcome(refits[made], ends[made], found, ())  # type: ignore[arg-type]
        return run._Done(None, None, None, outcome)  # type: ignore[arg-type]

    begun = ready, lambda _: refits["front"], lambda _: refits["none"]
    monkeypatch.setattr(run._Case, "_begun", lambda *_: begun)
    monkeypatch.setattr(run._Case, "_thorough", thorough)
    task: Any = object.__new__(run._Case)
    done = task._searched(None)
    assert done.found.fitted is ends["none" if without else "front"]
    assert done.notes == ((run.NO_FRONT,) if without else ())


def test_a_parameter_that_only_the_search_has_is_said_to_be_one() -> None:
    """An example is the steepness of a piece of a sensor's curve, of which the parameter file has only the values."""
    end = AtEnd("", 3.0, ranges.LARGEST, 3.0, None, None, None, "limit")
    assert end.sentence("sensor_nonlinearity", "um").startswith("a parameter of the search of sensor_nonlinearity is 3")
