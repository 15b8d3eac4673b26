"""Columns in other units than the model: converted where the quantity is the same, refused where it is not."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

import hystgen
from hystgen import tracking
from hystgen.model import Model
from hystgen.parameters.files import load_parameters, parse_parameters
from hystgen.records import Record, RecordError, in_units, read_record
from hystgen.records.units import conversion
from hystgen.simulation import simulate_records

Array = NDArray[np.float64]
Run = Callable[..., tuple[int, str, str]]
R, P = np.array([0.0, 5.0, 20.0]), np.array([120.0, 20.0, 30.0])
TEXT = """hystgen: 1
name: stage
units: {input: V, output: nm}
input_range: [0, 100]
model:
  pi: {thresholds: [0, 5, 20], weights: [120, 20, 30]}
"""
T = np.arange(600) * 0.01
V = 50.0 - 50.0 * np.cos(2.0 * np.pi * T) * np.linspace(1.0, 0.4, len(T))


def plays(v: Array) -> Array:
    """Displacement in nm at drives in V, sample by sample."""
    s, y = np.zeros(len(R)), []
    for x in v:
        s = np.maximum(x - R, np.minimum(x + R, s))
        y.append(float(P @ s))
    return np.array(y)


Y = plays(V)


def write(path: Path, columns: Mapping[str, Array]) -> Path:
    """A file in the format of its suffix, with these names of columns."""
    if path.suffix == ".npz":
        np.savez(path, **columns)  # type: ignore[arg-type]
    elif path.suffix == ".mat":
        from scipy.io import savemat

        savemat(path, {name.replace(" [", "_").rstrip("]"): x for name, x in columns.items()})
    elif path.suffix == ".parquet":
        pq.write_table(pa.table({name: pa.array(x) for name, x in columns.items()}), path)
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            for name, x in columns.items():
                label, _, unit = name.rstrip("]").partition(" [")
                file[label] = x
                file[label].attrs["units"] = unit
    else:
        rows = "\n".join(",".join(map(repr, map(float, row))) for row in zip(*columns.values(), strict=True))
        path.write_text(f"{','.join(columns)}\n{rows}\n")
    return path


def model(folder: Path, text: str = TEXT) -> Path:
    path = folder / "stage.yaml"
    path.write_text(text)
    return path


def table(text: str) -> dict[str, Array]:
    header, *rows = csv.reader(io.StringIO(text))
    return dict(zip(header, np.array(rows, dtype=float).T, strict=True))


@pytest.mark.parametrize(
    ("unit", "to", "number", "becomes"),
    [
        ("um", "nm", 9.0, 9000.0), ("\u00b5m", "nm", 9.0, 9000.0), ("\u03bcm", "mm", 9.0, 0.009),
        ("micron", "m", 2.0, 2e-6), ("Microns", "um", 2.0, 2.0), ("micrometers", "nm", 2.0, 2000.0),
        ("\u00c5", "nm", 5.0, 0.5), ("mm", "cm", 5.0, 0.5), ("mV", "V", 1500.0, 1.5), ("Volt", "mV", 1.5, 1500.0),
        ("kV", "V", 0.1, 100.0), ("[V]", "(mV)", 1.0, 1000.0), ("millivolts", "V", 5.0, 0.005),
        ("mrad", "urad", 3.0, 3000.0), ("deg", "rad", 180.0, math.pi), ("rad", "\u00b0", math.pi, 180.0),
        ("arcsec", "deg", 1800.0, 0.5), ("N", "mN", 0.2, 200.0), ("kN", "N", 0.2, 200.0), ("ms", "s", 20.0, 0.02),
        ("min", "s", 2.0, 120.0), ("mA", "A", 20.0, 0.02), ("T", "mT", 1.5, 1500.0), ("Gauss", "mT", 10.0, 1.0),
        ("kOe", "Oe", 0.5, 500.0), ("Oe", "kA/m", 1.0, 0.25 / math.pi), ("bar", "kPa", 1.0, 100.0),
        ("raw", "Raw", 3.0, 3.0), ("um/V", "um/V", 3.0, 3.0), ("mv", "mV", 3.0, 3.0),
    ],
)  # fmt: skip
def test_units_of_one_quantity(unit: str, to: str, number: float, becomes: float) -> None:
    how = conversion(unit, to)
    assert how is not None
    assert how(np.array([number]))[0] == pytest.approx(becomes, rel=1e-15)


@pytest.mark.parametrize(
    ("unit", "to"),
    [("V", "um"), ("nm", "rad"), ("um/V", "nm/V"), ("counts", "um"), ("raw", "codes"), ("mT", "mV"), ("s", "m")],
)
def test_units_that_nothing_connects(unit: str, to: str) -> None:
    assert conversion(unit, to) is None
    assert conversion(to, unit) is None


@pytest.mark.parametrize(
    ("unit", "degrees"), [("K", 293.15), ("\u00b0F", 68.0), ("F", 68.0), ("C", 20.0), ("degC", 20.0)]
)
def test_temperatures_in_degrees_celsius(unit: str, degrees: float) -> None:
    record = Record("a.csv", T, V, extra={"temperature": np.full(len(T), degrees)}, units={"temperature": unit})
    (found,) = in_units([record], need=("v",))
    np.testing.assert_allclose(found.extra["temperature"], 20.0, rtol=1e-13)
    assert found.units["temperature"] == "degC"
    assert bool(found.notes) == (unit in ("K", "\u00b0F", "F"))


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".mat", ".h5", ".parquet"])
def test_simulate_converts_whatever_the_file(suffix: str, tmp_path: Path, run: Run) -> None:
    params = model(tmp_path)
    drive = write(tmp_path / f"drive{suffix}", {"t [s]": T, "v [mV]": V * 1e3})
    code, out, err = run("simulate", params, drive)
    assert code == 0, err
    found = table(out)
    assert list(found) == ["t [s]", "v [mV]", "y [nm]"], "the file's column stays as it is"
    np.testing.assert_allclose(found["y [nm]"], Y, rtol=1e-12, atol=1e-9)
    assert f"warning: drive{suffix}: column v [mV] was converted to V: 1 mV is 0.001 V" in err
    assert "input_range" not in err
    wanted = write(tmp_path / f"wanted{suffix}", {"t [s]": T, "u [um]": Y * 1e-3})
    code, out, err = run("simulate", params, wanted, "--operator", "inverse")
    assert code == 0, err
    np.testing.assert_allclose(table(out)["v [V]"], V, atol=1e-9)
    assert "column u [um] was converted to nm: 1 um is 1000 nm" in err


@pytest.mark.parametrize(
    ("unit", "why"),
    [
        ("V", "column u is in V and the model's output in nm, which are different quantities; choose another column"),
        ("raw", 'and "raw" is not a known unit; convert the column and write the same unit, or none, after its name'),
    ],
)
def test_what_is_another_quantity_is_refused(unit: str, why: str, tmp_path: Path, run: Run) -> None:
    params, target = model(tmp_path), tmp_path / "out.csv"
    wanted = write(tmp_path / "wanted.csv", {"t": T, f"u [{unit}]": Y})
    code, out, err = run("simulate", params, wanted, "--operator", "inverse", "-o", target)
    assert (code, out, target.exists()) == (2, "", False)
    assert err.startswith(f"{wanted}: error: column u is in {unit} and ")
    assert why in err
    assert len(err.splitlines()) == 1
    measured = write(tmp_path / "measured.csv", {"t": T, "v [V]": V, f"y [{unit}]": Y})
    for command in (
        ("track", params, measured),
        ("diagnose", params, measured, "-o", tmp_path / "found"),
        ("identify", measured, "--units", "V,nm", "-o", tmp_path / "new.yaml", "--thresholds", 2),
        ("identify", measured, "-o", params, "--thresholds", 2),
    ):
        before = params.read_bytes()
        code, out, err = run(*command)
        if command[1] == measured and "--units" in command and unit == "raw":
            assert code == 0, "who names the units says what an unknown one is"
            assert "column y [raw] was taken as nm, the unit of the output of --units" in err
            continue
        assert (code, out) == (2, ""), err
        assert err.startswith(f"{measured}: error: column y is in {unit} and "), err
        assert params.read_bytes() == before


def test_other_columns_may_have_any_unit(tmp_path: Path, run: Run) -> None:
    drive = write(tmp_path / "drive.csv", {"t": T, "v [V]": V, "y [V]": Y, "load [raw]": Y})
    code, out, err = run("simulate", model(tmp_path), drive)
    assert code == 0, err
    assert list(table(out)) == ["t", "v [V]", "load [raw]", "y_measured [V]", "y [nm]"]
    assert "warning" not in err


def test_a_model_without_units_takes_those_of_the_record(tmp_path: Path, run: Run) -> None:
    params = model(tmp_path, TEXT.replace("units: {input: V, output: nm}\n", ""))
    (tmp_path / "out").mkdir()
    one = write(tmp_path / "one.csv", {"t": T, "u [nm]": Y})
    two = write(tmp_path / "two.csv", {"t": T, "u [um]": Y * 1e-3})
    code, _, err = run("simulate", params, one, two, "--operator", "inverse", "-o", tmp_path / "out")
    assert code == 0, err
    assert "one.csv: the model's output has no unit; it was assumed to be in nm, as column u is" in err
    assert "two.csv: column u [um] was converted to nm" in err
    for name in ("one", "two"):
        np.testing.assert_allclose(table((tmp_path / "out" / f"{name}.csv").read_text())["v"][40:], V[40:], atol=1e-9)


def test_columns_without_units_are_in_those_of_the_model(tmp_path: Path, run: Run) -> None:
    code, out, err = run("simulate", model(tmp_path), write(tmp_path / "drive.csv", {"t": T, "v": V}))
    assert (code, "warning" in err) == (0, False)
    assert list(table(out)) == ["t", "v", "y"]


def test_track_and_python_convert_as_well(tmp_path: Path, run: Run) -> None:
    params = model(tmp_path)
    plain = write(tmp_path / "plain.csv", {"t": T, "v": V, "y": Y})
    other = write(tmp_path / "plainer.csv", {"t": T, "v [mV]": V * 1e3, "y [um]": Y * 1e-3})
    tables = []
    for path in (plain, other):
        code, out, err = run("track", params, path)
        assert code == 0, err
        tables.append([line.split()[-2:] for line in out.splitlines()[1:]])
    assert tables[0] == tables[1]
    assert "column y [um] was converted to nm" in err
    one = Model(parse_parameters(TEXT))
    record = read_record(other)
    ((y, said),) = simulate_records(one, [record])
    np.testing.assert_allclose(y, Y, atol=1e-9)
    assert said == ["plainer.csv: column v [mV] was converted to V: 1 mV is 0.001 V"]
    assert tracking.track(one, [record]).notes[1] == "plainer.csv: column y [um] was converted to nm: 1 um is 1000 nm"
    assert record.units["v"] == "mV", "the record that was given is not changed"
    with pytest.raises(RecordError, match=r"^foo: error: column v is in N and the model's drive in V"):
        simulate_records(one, [Record("foo", T, V, units={"v": "N"})])


def test_identify_converts_to_one_unit_and_keeps_that_of_the_file_it_replaces(tmp_path: Path, run: Run) -> None:
    um = write(tmp_path / "um.csv", {"t": T, "v [V]": V, "y [um]": Y * 1e-3})
    nm = write(tmp_path / "nm.csv", {"t": T, "v [mV]": V * 1e3, "y [nm]": Y})
    target = tmp_path / "new.yaml"

    def fitted(*words: object) -> tuple[Any, str]:
        code, _, err = run("identify", *words, "-o", target, "--thresholds", 3, "--history", 0)
        assert code == 0, err
        return load_parameters(target), err

    first, said = fitted(um, "--holdout", nm)
    assert first.units.model_dump() == {"input": "V", "output": "um"}
    assert "nm.csv: column y [nm] was converted to um: 1 nm is 0.001 um" in said
    again, said = fitted(nm)
    assert again.units == first.units, "those of the file that is there"
    assert f"{target}: name, units kept from the existing file" in said
    assert again.input_range == pytest.approx((float(np.min(V)), float(np.max(V))))
    assert again.model.pi.weights == pytest.approx(first.model.pi.weights, rel=1e-6)
    text = "".join(line for line in target.read_text().splitlines(True) if not line.startswith(("emit", "sample_time")))
    target.write_text(
        text + "sample_time: 1.0e-3\nemit: {drive_lsb: 0.005, output_lsb: 0.0006, compensation: {max_rate: 500}}\n"
    )
    named, said = fitted(nm, "--units", "mV,nm")
    assert named.units.model_dump() == {"input": "mV", "output": "nm"}
    assert (named.emit.drive_lsb, named.emit.output_lsb, named.emit.compensation.max_rate) == (5.0, 0.6, 500000.0)
    target.unlink()
    alone, _ = fitted(nm)
    assert alone.units.model_dump() == {"input": "mV", "output": "nm"}
    assert alone.model.pi.weights == pytest.approx(named.model.pi.weights, rel=1e-6)
    with pytest.raises(RecordError, match=r"um.csv: error: column y is in um and the output of units in rad"):
        hystgen.identify(um, units={"output": "rad"})


def test_python_fits_predict_in_their_own_units() -> None:
    fit = hystgen.identify({"t": T, "v [V]": V, "y [nm]": Y}, thresholds=[0, 5, 20], history=[0.0])
    assert fit.model.cascade.pi.weights == pytest.approx(tuple(P), rel=1e-6)
    predicted = fit.predict({"t": T, "v [mV]": V * 1e3, "y [um]": Y * 1e-3})
    np.testing.assert_allclose(predicted, Y, atol=1e-6 * float(np.max(Y)))


def test_a_fleet_is_fitted_in_the_units_asked_for(tmp_path: Path) -> None:
    (tmp_path / "units").mkdir()
    write(tmp_path / "units" / "a.csv", {"t": T, "v [V]": V, "y [um]": Y * 1e-3})
    write(tmp_path / "units" / "b.csv", {"t": T, "v [mV]": V * 1e3, "y [nm]": Y})
    write(tmp_path / "units" / "c.csv", {"t": T, "v [V]": V, "y [N]": Y})
    how: dict[str, Any] = {"jobs": 1, "thresholds": 2, "emit": False, "units": {"input": "V", "output": "nm"}}
    fleet = hystgen.identify_batch(tmp_path / "units", tmp_path / "out", **how)
    a, b = (load_parameters(tmp_path / "out" / f"{name}.yaml") for name in "ab")
    assert a.units.model_dump() == b.units.model_dump() == {"input": "V", "output": "nm"}
    assert a.model.pi.weights == pytest.approx(b.model.pi.weights, rel=1e-6)
    (failed,) = fleet.failed
    assert failed.message.endswith(
        "c.csv: error: column y is in N and the output of units in nm, which are different quantities; choose "
        "another column, or correct the unit after its name"
    )
    assert all(unit.kept for unit in hystgen.identify_batch(tmp_path / "units", tmp_path / "out", **how).units[:2])


def test_diagnose_converts_and_gives_a_model_without_units_those_of_the_records(tmp_path: Path) -> None:
    noise = np.random.default_rng(3).normal(0.0, 20.0, len(T))
    bare = model(tmp_path, TEXT.replace("units: {input: V, output: nm}\n", ""))
    fitted = write(tmp_path / "a.csv", {"t": T, "v [V]": V, "y [nm]": Y + noise})
    held = write(tmp_path / "b.csv", {"t": T, "v [mV]": V * 1e3, "y [um]": (Y - noise) * 1e-3})
    found = hystgen.diagnose(bare, fitted, holdout=held, history=[0.0])
    assert found.verdict == "nothing_missing"
    assert found.result.gap.as_given.holdout == pytest.approx(20.0, rel=0.2), "nm, as the fitted record has"
    assert found.result.unit == "nm"
    assert found.parameters.units.model_dump() == {"input": "V", "output": "nm"}
    assert "a.csv: the model's output has no unit; it was assumed to be in nm, as column y is" in found.notes
    assert "b.csv: column y [um] was converted to nm: 1 um is 1000 nm" in found.notes


def test_a_recorded_session_is_cut_in_the_models_units(tmp_path: Path, run: Run) -> None:
    """The recording in mV fits the session once converted, and is refused before any search as it ends too early."""
    (tmp_path / "session.json").write_text(
        '{"hystgen": 1, "rate": 100.0, "samples": 20000, "history": [100.0, 0.0], "rest": 0.0, "rise": 0.25, '
        '"dac": null, "records": [{"name": "a.csv", "first": 0, "samples": 9999, "held_out": false}]}'
    )
    recording = write(tmp_path / "rec.csv", {"t": T, "v [mV]": V * 1e3, "y [nm]": Y})
    command = ("diagnose", model(tmp_path), recording, "--session", tmp_path / "session.json", "-o", tmp_path / "out")
    code, _, err = run(*command)
    assert code == 2
    assert "record the session to its end" in err, err


@pytest.mark.parametrize("operator", ["forward", "inverse"])
def test_fixed_point_takes_and_answers_codes(operator: str, tmp_path: Path, run: Run) -> None:
    """Whole volts would pass for codes; a code has no unit, so the answer's header has none."""
    params = model(tmp_path)
    signal, units, answer, lsb = {
        "forward": ("v", ("V", "mV"), "y", "DRIVE"), "inverse": ("u", ("nm", "um"), "v", "OUTPUT"),
    }[operator]
    words = ("--operator", operator, "--arithmetic", "q15")
    for own in units:
        physical = write(tmp_path / "physical.csv", {"t [s]": T, f"{signal} [{own}]": np.round(V)})
        code, out, err = run("simulate", params, physical, *words)
        assert (code, out) == (2, "")
        assert err.startswith(f"{physical}: error: column {signal} is in {own}, but q15 takes codes; ")
        assert f"divide it by STAGE_{lsb}_LSB of the emitted header" in err
    codes = np.round(V * 32767 / 100.0)
    for own in ("", " [counts]"):
        taken = write(tmp_path / "codes.csv", {"t [s]": T, f"{signal}{own}": codes, "temperature [K]": T + 300.0})
        code, out, err = run("simulate", params, taken, *words)
        assert code == 0, err
        assert list(table(out)) == ["t [s]", f"{signal}{own}", "temperature [K]", answer]
    if operator == "forward":  # by default 100 V and the output at 100 V are 32767 codes; one code per rounding
        lsb_of_output = float(P @ (100.0 - R)) / 32767.0
        np.testing.assert_allclose(table(out)["y"] * lsb_of_output, Y, atol=(1 + len(R)) * lsb_of_output)
