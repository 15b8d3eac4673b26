"""Error bounds, limits and status bits of the compiled C, checked with an exact model that shares no code with it."""

from __future__ import annotations

import os
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from modelfiles import FILES

import hystgen
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from tests.oracle import check, effects, models

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore:.*initial_state cannot have come:UserWarning"),
]

MODELS = int(os.environ.get("HYSTGEN_ORACLE_MODELS", "300"))
"""Random models in each run; `make check-bounds` takes more."""

KEPT = Path("build/oracle")
EACH = pytest.mark.parametrize(("arithmetic", "engine"), check.COMBINATIONS)


@EACH
def test_random_models_keep_their_bounds(arithmetic: str, engine: str) -> None:
    count = -(-MODELS // len(check.COMBINATIONS))
    first = 10_000 * check.COMBINATIONS.index((arithmetic, engine))
    tallies, faults = check.run(count, first, ((arithmetic, engine),))
    tally = tallies[arithmetic, engine]
    assert not faults, "\n".join(check.keep(faults, KEPT))
    assert tally.models == count
    assert tally.refused <= 0.4 * count
    assert tally.inverses >= 0.8 * count
    assert tally.samples == check.CALLS * (tally.models + tally.inverses)


@EACH
def test_a_bound_that_is_too_small_is_noticed(arithmetic: str, engine: str, tmp_path: Path) -> None:
    case = check.emit(check.Case("plain", FILES["plain"], arithmetic, engine, 1), tmp_path)
    assert case
    found = list(check.follow([case], tmp_path))
    worst = min(finding.result.worst for finding in found)
    assert 0 < worst <= 1
    assert not any(finding.result.faults for finding in check.follow([case], tmp_path, shrink=1.001))
    for finding in check.follow([case], tmp_path, shrink=0.999 * worst):
        assert finding.result.faults > 0
        assert "times the bound" in finding.result.message.decode()


# Faults: the operator that shows each, a pattern in the emitted C, and its replacement
CHANGES = {
    "a pending drive is forgotten": ("inverse", r"if \(self->has_pending\)", "if (false)"),
    "a commit is not limited": ("inverse", r"above_clamp_drive\(applied\)", "applied"),
    "a commit does not count": ("inverse", r"(_inverse_commit\(above_inverse_t \*self[^{;]*\{)", r"\1 return;"),
    "a limited drive has no bit": ("inverse", r"\|= ABOVE_STATUS_OUTPUT_CLAMPED", "|= 0u"),
    "a limited reference has no bit": ("inverse", r"= ABOVE_STATUS_INPUT_CLAMPED;", "= 0u;"),
    "a limited input has no bit": ("forward", r"\|= ABOVE_STATUS_INPUT_CLAMPED", "|= 0u"),
    "a limit lies elsewhere": ("forward", r"\? ABOVE_DRIVE_MIN\b", "? (above_real_t)(ABOVE_DRIVE_MAX / 2)"),
    "an output lies elsewhere": ("forward", r"return (answer|\(above_real_t\)code);", r"return \1 + 2;"),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("arithmetic", ["float32", "q15"])
def test_a_fault_in_the_c_is_noticed(change: str, arithmetic: str, tmp_path: Path) -> None:
    operator, old, new = CHANGES[change]
    case = check.emit(check.Case("above", FILES["above"], arithmetic, "loop", 1), tmp_path)
    assert case
    path = tmp_path / "above.c"
    text, count = re.subn(old, new, path.read_text())
    assert count
    path.write_text(text)
    found = {finding.operator: finding.result for finding in check.follow([case], tmp_path)}
    assert found[operator].faults > 0


@pytest.mark.parametrize("limit", ["DRIVE_MIN", "DRIVE_MAX", "OUTPUT_MIN", "OUTPUT_MAX"])
@pytest.mark.parametrize("by", [-1, 1])
def test_a_limit_that_is_a_code_off_is_noticed(limit: str, by: int, tmp_path: Path) -> None:
    case = check.emit(check.Case("above", FILES["above"], "q15", "corners", 1), tmp_path)
    assert case
    path = tmp_path / "above.h"
    text, count = re.subn(rf"(#define ABOVE_{limit}) (\S+)", rf"\1 (\2 + {by})", path.read_text())
    assert count == 1
    path.write_text(text)
    assert all(limit in finding.result.message.decode() for finding in check.follow([case], tmp_path))


# Models at which stated bounds or status bits were once wrong
ONCE_WRONG = {
    # rounding at the end of a flat piece continued along the steep piece after it
    "flat_first": """
hystgen: 1
name: flat_first
input_range: [-1, 6]
model:
  pi: {thresholds: [0, 0.4, 1.2, 2.5], weights: [0.0002, 2, 0.7, 30]}
""",
    # after a reset, plays are at 0, outside the hull of range and start memory; outputs exceed every code
    "reset_afar": """
hystgen: 1
name: reset_afar
input_range: [20, 22]
model:
  pi: {thresholds: [0, 12, 300], weights: [0.5, 1, 2], initial_state: 60}
  output_offset: -210
""",
    # the start memory belongs to a drive above or below the range or between codes, which sets the first branch
    "above_the_range": """
hystgen: 1
name: above_the_range
input_range: [-1.2, 1.2]
model:
  pi: {thresholds: [0, 0.2, 0.5], weights: [1, 0.8, 0.4], initial_state: 0.9}
  memoryless:
    kind: tanh
    ascending: {a0: 4, a1: 0.1, a2: -0.05, a3: 0}
    descending: {a0: 4, a1: 0.1, a2: 0, a3: 0.1}
""",
    "below_the_range": """
hystgen: 1
name: below_the_range
input_range: [-1.2, 1.2]
model:
  pi: {thresholds: [0, 0.2, 0.5], weights: [1, 0.8, 0.4], initial_state: -0.95}
  memoryless:
    kind: tanh
    ascending: {a0: 4, a1: 0.1, a2: -0.05, a3: 0}
    descending: {a0: 4, a1: 0.1, a2: 0, a3: 0.1}
""",
    "between_codes": """
hystgen: 1
name: between_codes
input_range: [-1.2, 1.2]
model:
  pi: {thresholds: [0, 0.2, 0.5], weights: [1, 0.8, 0.4], initial_state: 0.0125}
  memoryless:
    kind: tanh
    ascending: {a0: 4, a1: 0.1, a2: -0.05, a3: 0}
    descending: {a0: 4, a1: 0.1, a2: 0, a3: 0.1}
""",
    # plays lie far from a range that is narrow compared with their thresholds, so rounded weights count for more
    "narrow_range": """
hystgen: 1
name: narrow_range
input_range: [0, 0.0003]
model:
  pi: {thresholds: [0, 0.15], weights: [1, 4.0e-5], initial_state: [0, -0.1499]}
""",
    # plays that never move, each with its own start: thresholds cut to fit the format left them no room
    "never_moved": """
hystgen: 1
name: never_moved
input_range: [0, 1]
model:
  pi: {thresholds: [0, 0.25, 2, 3, 10], weights: [1, 0.5, 0.3, 0.2, 0.1], initial_state: [0, 0.1, -0.9, 0.05, 0.9]}
""",
    "all_never_moved": """
hystgen: 1
name: all_never_moved
input_range: [0.2, 1]
model:
  pi: {thresholds: [0, 2, 3, 10], weights: [1, 0.3, 0, 0.1], initial_state: [0, -0.4, 0.3, -0.2]}
  memoryless: {kind: tanh, ascending: {a0: 2, a1: 0.8, a2: -0.1, a3: 0.1}}
""",
}


@pytest.mark.slow(one_in=2)
@EACH
@pytest.mark.parametrize("name", ONCE_WRONG)
def test_models_that_were_once_wrong(name: str, arithmetic: str, engine: str, tmp_path: Path) -> None:
    path = tmp_path / f"{name}.yaml"
    path.write_text(ONCE_WRONG[name])
    found, refused = check.follow_file(path, arithmetic, engine, tmp_path, seeds=4, calls=check.CALLS)
    refusals = {("reset_afar", "q31"), ("flat_first", "q15"), ("narrow_range", "q31"), ("never_moved", "q31")}
    assert refused == ((name, arithmetic) in refusals)
    assert not [finding.result.message.decode() for finding in found if finding.result.faults]


@pytest.mark.parametrize("name", ["never_moved", "all_never_moved"])
@pytest.mark.parametrize("engine", ["corners", "loop"])
def test_plays_that_never_move_cost_no_accuracy(name: str, engine: str, tmp_path: Path) -> None:
    case = check.emit(check.Case(name, ONCE_WRONG[name], "q15", engine, 1), tmp_path)
    assert case
    stated = re.search(r"_FORWARD_MAX_ERROR_LSB (\S+)", (tmp_path / f"{name}.h").read_text())
    assert stated
    assert float(stated[1]) < 2.0
    assert not any(finding.result.faults for finding in check.follow([case], tmp_path))


@pytest.mark.parametrize(
    ("name", "arithmetic"), [("flat_first", "float32"), ("reset_afar", "q15"), ("above_the_range", "q15")]
)
@pytest.mark.parametrize("engine", ["corners", "loop"])
def test_bits_of_models_that_were_once_wrong(name: str, arithmetic: str, engine: str) -> None:
    model = Model(parse_parameters(ONCE_WRONG[name], f"{name}.yaml"))
    report = hystgen.verify(model, arithmetic=arithmetic, operator="both", engine=engine, length=20_000)
    assert report.ok, report.table()


EFFECTS = 6
"""Models with effects per arithmetic in each run; `make check-bounds` takes more, and longer ones."""


@pytest.mark.parametrize("arithmetic", check.KINDS)
def test_models_with_effects_keep_their_bounds_and_rates(arithmetic: str) -> None:
    tally = effects.run(EFFECTS, 0, (arithmetic,))[arithmetic]
    assert not tally.sentences, "\n".join(tally.sentences)
    assert tally.models + tally.refused == EFFECTS
    assert tally.refused <= 0.4 * EFFECTS
    assert tally.limited > 0.1 * tally.samples
    assert min(tally.worst.values()) > 0.0


SLOW = """
hystgen: 1
name: m
sample_time: 1.0e-5
input_range: [0.0, 100.0]
model:
  pi: {thresholds: [0, 5, 10, 20], weights: [0.1, 0.02, 0.01, 0.005]}
  effects: [{name: slew_limit, rate: 0.1}]
"""

# Faults of a drive at a limited rate: a pattern in the emitted C and its replacement, with a number from FASTER that
# makes the step a five-hundredth too large. In fixed point every code is a number, so no sample is held.
AT_A_RATE = {
    "its rounding adds up": (r"other \? 0 : self->reached\.rest", "0"),
    "it is too fast": (r"(#define M_SLEW_RISING_REST) (\S+)", r"\1 (\2 + {})"),
    "a held sample leaves it": (r"m_inverse_ramp\(self, .*, last\);", "self->reached.drive = last;"),
}
FASTER = {"float32": "2.0e-9f", "q31": "80000"}


@pytest.mark.parametrize("arithmetic", FASTER)
def test_a_drive_that_leaves_its_rate_is_noticed(arithmetic: str, tmp_path: Path) -> None:
    (tmp_path / "slow.yaml").write_text(SLOW)
    case = effects.read(tmp_path / "slow.yaml", arithmetic)
    for change in ("", *(each for each in AT_A_RATE if "held" not in each or arithmetic == "float32")):
        folder = tmp_path / (change or "right").replace(" ", "_")  # each path is loaded only once
        folder.mkdir()
        assert effects.emit(case, folder)
        if change:
            old, new = AT_A_RATE[change]
            text, count = re.subn(old, new.format(FASTER[arithmetic]), (folder / "m.c").read_text())
            assert count
            (folder / "m.c").write_text(text)
        found = {operator: result for _, operator, result in effects.follow([case], folder, 1, 200_000)}
        assert (found["inverse"].faults == 0) == (not change), change
        assert found["forward"].faults == 0 or change == "it is too fast"


def test_models_are_of_every_kind() -> None:
    kinds: Counter[str] = Counter()
    for seed in range(400):
        arithmetic = check.COMBINATIONS[seed % len(check.COMBINATIONS)][0]
        data = models.parameters(np.random.default_rng([seed, 0]), arithmetic, "m")
        pi, (low, high) = data["model"]["pi"], data["input_range"]
        stages = data["model"].get("memoryless", [])
        stages = stages if isinstance(stages, list) else [stages]
        weights = [p for p in pi["weights"] if p]
        kinds["twelve decades"] += max(weights) / min(weights) > 1e10
        kinds["a weight of 0"] += 0.0 in pi["weights"][1:]
        kinds["small p0"] += 0 < pi["weights"][0] < 1e-5 * sum(weights)
        kinds["close thresholds"] += bool(
            np.any(np.diff(pi["thresholds"]) < 1e-6 * np.max(pi["thresholds"], initial=0))
        )
        kinds["wide thresholds"] += not stages and pi["thresholds"][-1] > high - low
        kinds["many plays"] += len(pi["weights"]) > 60
        kinds["plays that never move, listed"] += (
            isinstance(pi.get("initial_state"), list) and not stages and pi["thresholds"][-1] > high - low
        )
        kinds["no play"] += len(pi["weights"]) == 1
        kinds["start list"] += isinstance(pi.get("initial_state"), list)
        start = pi.get("initial_state", low)
        kinds["start outside"] += not stages and isinstance(start, float) and not low <= start <= high
        kinds["0 outside"] += not low <= 0 <= high
        kinds["40 breaks"] += any(len(stage.get("thresholds", ())) >= 40 for stage in stages)
        kinds["two branches"] += any("descending" in stage for stage in stages)
        kinds["two stages"] += len(stages) > 1
        kinds["offset"] += "output_offset" in data["model"]
        kinds["a given LSB"] += "emit" in data
        kinds["small unit"] += high - low < 1e-6
        kinds["large unit"] += high - low > 1e6
    assert min(kinds.values()) >= 4, kinds


def test_numbers_are_read_without_the_package() -> None:
    model = check.model_of(FILES["mixed"])
    assert (model.n, model.listed, model.stages, model.low, model.high) == (6, 0, 2, -2.0, 2.0)
    assert model.threshold[:3] == [0.0, 0.45, 0.9]
    assert model.stage[0].count == 4
    assert list(model.stage[1].a) == [6.0, 0.1, 0.1, 0.2, 6.0, 0.1, 0.1, 0.5]
    names = (check.HERE / "oracle.c").read_text()
    assert set(re.findall(r'#include "(.*)"', names)) == {"oracle.h"}
    alone = (check.HERE / "effects.c").read_text()
    assert set(re.findall(r'#include "(.*)"', alone)) == {"effects.h"}
