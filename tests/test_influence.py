"""Gain and offset that follow a logged column, in the model, in the C, and in a diagnosis.

The oracle of the model is written out sample by sample: a lag by its matrix exponential, plays by their definition.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

import hystgen
from benchmarks import influences
from hystgen.basics.problems import ParameterError
from hystgen.closed_loop import CompiledC
from hystgen.emission.calls import emitted_files
from hystgen.emission.compensator import influence_macros
from hystgen.parameters.files import parse_parameters
from hystgen.plays import slots

Array = NDArray[np.float64]

T = 1.0e-3
TEXT = """
hystgen: 1
name: pushed
sample_time: 1.0e-3
input_range: [0, 10]
model:
  pi: {thresholds: [0, 0.5, 1, 2], weights: [0.7, 0.2, 0.1, 0.05]}
  effects:
    - {name: influence, column: load, offset: 0.05, gain: -0.01, reference: 2, time_constant: 0.02, range: [-10, 20]}
    - {name: thermal, gain_per_degree: 0.002, offset_per_degree: 0.01, reference: 21}
    - {name: influence, column: v_y, offset: 0.03, curve: [0.001, -0.0002],
       plays: {thresholds: [0.5, 2], weights: [0.04, 0.02]}}
"""
FLOATS, FIXED = ("float32", "float64"), ("q15", "q31")


def model(text: str = TEXT) -> hystgen.Model:
    return hystgen.Model(parse_parameters(text, "pushed.yaml"))


def session(n: int = 1500) -> tuple[Array, Array, dict[str, Array]]:
    t = T * np.arange(n)
    extra = {
        "load": 2.0 + 4.0 * np.sin(17.0 * t), "temperature": 21.0 + 3.0 * np.sin(2.0 * t),
        "v_y": 5.0 + 5.0 * np.sin(13.3 * t),
    }
    return t, 5.0 + 3.0 * np.sin(9.0 * t) + 0.8 * np.sin(41.0 * t), extra


def play(x: Array, r: float) -> Array:
    state, out = 0.0, np.empty(len(x))
    for k, value in enumerate(x):
        state = min(max(state, value - r), value + r)
        out[k] = state
    return out


def expected(t: Array, v: Array, extra: dict[str, Array]) -> Array:
    """What the file's effects make of the output of its plays."""
    y = np.asarray(model(TEXT[: TEXT.index("  effects")]).simulate(v))
    load = extra["load"]
    late = load[0] + signal.lsim(([1.0], [0.02, 1.0]), load - load[0], t)[1] - 2.0
    warm, other = extra["temperature"] - 21.0, extra["v_y"]
    y = (1.0 - 0.01 * late) * y + 0.05 * late
    y = (1.0 + 0.002 * warm) * y + 0.01 * warm
    curve = 0.03 * other + 0.001 * other**2 - 0.0002 * other**3
    return np.asarray(y + curve + 0.04 * play(other, 0.5) + 0.02 * play(other, 2.0))


def test_the_model_is_what_its_keys_say() -> None:
    t, v, extra = session()
    np.testing.assert_allclose(model().simulate(v, extra=extra), expected(t, v, extra), atol=1e-11)


def test_the_inverse_is_exact() -> None:
    """In double precision and in the order of the C, from the first sample on."""
    t, v, extra = session()
    y, inverse = expected(t, v, extra), model().inverse()
    np.testing.assert_allclose(inverse.simulate(y, extra=extra), v, atol=1e-11)
    np.testing.assert_allclose(inverse.simulate(y, extra=extra, arithmetic="float64"), v, atol=1e-11)


@pytest.mark.parametrize("arithmetic", [*FLOATS, *FIXED])
def test_errors_are_within_their_bounds(arithmetic: str) -> None:
    """Drives and columns are rounded to what the arithmetic can take before both are computed."""
    _, v, extra = session()
    one = model()
    compiled = one.compiled(arithmetic)
    units = {"temperature": 1.0, **{column: unit for column, _, unit in compiled.columns}}
    units["temperature"] = float(compiled.tables.columns.unit[1])
    if arithmetic in FLOATS:
        real = np.float32 if arithmetic == "float32" else np.float64
        v, extra = v.astype(real).astype(float), {name: x.astype(real).astype(float) for name, x in extra.items()}
        from hystgen.compensator.chain.bounds import chain_bounds

        bounds = chain_bounds(compiled, arithmetic)
        y = np.asarray(one.simulate(v, extra=extra))
        found = np.asarray(one.simulate(v, extra=extra, arithmetic=arithmetic), dtype=float)
        assert np.max(np.abs(found - y)) <= bounds.forward
        u = y.astype(real).astype(float)
        back = np.asarray(one.inverse().simulate(u, extra=extra, arithmetic=arithmetic), dtype=float)
        assert np.max(np.abs(back - one.inverse().simulate(u, extra=extra))) <= bounds.inverse
        return
    codes = compiled.codes
    assert codes is not None
    drive, output = float(codes.drive_lsb), float(codes.output_lsb)
    extra = {name: np.rint(x * units[name]) / units[name] for name, x in extra.items()}
    given = np.rint(v / drive)
    y = np.asarray(one.simulate(given * drive, extra=extra))
    found = np.asarray(one.simulate(given, extra=extra, arithmetic=arithmetic), dtype=float)
    assert np.max(np.abs(found * output - y)) <= codes.forward_error * output
    u = np.rint(y / output)
    back = np.asarray(one.inverse().simulate(u, extra=extra, arithmetic=arithmetic), dtype=float)
    wanted = np.asarray(one.inverse().simulate(u * output, extra=extra))
    assert np.max(np.abs(back * drive - wanted)) <= codes.inverse_error * drive


@pytest.mark.parametrize("arithmetic", ["float32", "q15"])
def test_the_compiled_c_has_the_bits_of_the_reference(arithmetic: str) -> None:
    """With sequences of `set_influence` mixed into all other calls."""
    found = hystgen.verify(model(), operator="both", arithmetic=arithmetic, compiler=("gcc",), length=3000)
    assert found.ok, found


def test_the_calls_in_c() -> None:
    header = emitted_files(model(), operator="inverse")["pushed.h"]
    assert "#define PUSHED_INFLUENCE_LOAD 0u" in header
    assert "#define PUSHED_INFLUENCE_V_Y 1u" in header
    assert "limited to -10 .. 20" in header
    assert "void pushed_inverse_set_influence(pushed_inverse_t *self, unsigned int i, pushed_real_t value);" in header
    coded = emitted_files(model(), operator="inverse", arithmetic="q15")["pushed.h"]
    assert "PUSHED_INFLUENCE_LOAD_LSB" in coded
    one = TEXT[: TEXT.index("    - {name: influence, column: v_y")].replace(", time_constant: 0.02", "")
    plain = emitted_files(model(one))
    assert "course" not in plain["pushed.c"]  # nothing is emitted for a lag, a curve or plays without one


def test_columns_in_macros_have_their_own_names() -> None:
    assert influence_macros(["v x", "v_x", "µ", "load"]) == ["V_X", "V_X_2", "_", "LOAD"]


def test_status_tells_what_was_limited_or_held() -> None:
    one = model()
    calls = [
        (slots.OP_INFLUENCE, 5.0, 0), (slots.OP_INFLUENCE, 21.0, slots.LIMITED_SETTING),
        (slots.OP_INFLUENCE, np.nan, slots.HELD), (slots.OP_INFLUENCE + 1, -np.inf, slots.HELD),
        (slots.OP_INFLUENCE + 1, 1.0, 0),
    ]
    from hystgen.compensator import reference

    op = np.array([each[0] for each in calls], dtype=np.uint8)
    x = np.array([each[1] for each in calls], dtype=np.float32)
    _, status = reference.answers(one.compiled("float32").tables, True, op, x, compiled=False)
    assert status.tolist() == [each[2] for each in calls]


def test_a_compiled_axis_follows_its_columns() -> None:
    """The instance is told by name, and refuses a name that the model does not follow."""
    t, v, extra = session(300)
    extra["temperature"][:] = 21.0  # the closed loop does not set it
    axis, found = CompiledC(model(), "forward"), []
    for k, x in enumerate(v):
        for name in ("load", "v_y"):
            axis.set_influence(name, float(extra[name][k]))
        found.append(axis.step(float(x)))
    np.testing.assert_allclose(found, expected(t, v, extra), atol=1e-4)
    with pytest.raises(ValueError, match="follows no column 'humidity'; it follows load, v_y"):
        axis.set_influence("humidity", 1.0)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("column: load, plays: {thresholds: [1, 1], weights: [1, 2]}", "must rise strictly"),
        ("column: load, plays: {thresholds: [1, 2], weights: [1]}", "1 value for 2 in thresholds"),
        ("column: load, reference: 3, range: [0, 2]", "must contain the reference"),
        ("offset: 1", "column: is missing"),
    ],
)
def test_a_bad_entry_is_refused(entry: str, message: str) -> None:
    text = TEXT[: TEXT.index("    - {name: influence")] + f"    - {{name: influence, {entry}}}\n"
    with pytest.raises(ParameterError, match=message) as caught:
        parse_parameters(text, "f.yaml")
    assert str(caught.value).startswith("f.yaml:9:")


def test_the_schema_knows_the_keys() -> None:
    from hystgen.parameters.schema import schema

    made: Any = schema()
    properties = made["$defs"]["Influence"]["properties"]
    assert {"column", "offset", "gain", "reference", "time_constant", "curve", "plays", "range"} <= properties.keys()


@pytest.fixture(scope="module")
def told() -> dict[str, dict[str, Any]]:
    """One blind session with a column that acts, and one with a column that shares a drift."""
    return {kind: influences.run(kind, seed) for kind, seed in (("offset", 1), ("drift", 0))}


@pytest.mark.thorough
def test_a_column_that_acts_is_named_and_no_other(told: dict[str, dict[str, Any]]) -> None:
    assert told["offset"]["columns"] == ["load"]
    before, after = told["offset"]["gap"]
    assert after < 1.2 * told["offset"]["noise"] < 0.3 * before
    assert told["drift"]["columns"] == []


@pytest.mark.thorough
def test_two_axes_that_push_each_other(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Any) -> None:
    """The coupling is named on both axes, and the compiled C with it tracks at least three times better."""
    root = Path(__file__).resolve().parents[1] / "examples" / "xy_stage"
    monkeypatch.syspath_prepend(str(root))
    monkeypatch.setattr(sys, "argv", ["xy_stage", "-o", str(tmp_path)])
    import runpy

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        runpy.run_path(str(root / "__main__.py"), run_name="__main__")
    said = capsys.readouterr().out
    assert said.count("the residual follows column") == 2
    rows = [line.split()[-2:] for line in said.splitlines() if line.startswith(("plays", "with"))]
    before, after = (np.array(row, dtype=float) for row in rows)
    assert np.all(after < before / 3.0), said
    assert (tmp_path / "tracking.png").read_bytes().startswith(b"\x89PNG")
