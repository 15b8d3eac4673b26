"""The tutorial note: its figures and printed numbers, the page that maps it to the code, and its misprints."""

from __future__ import annotations

import ast
import importlib
import re
import subprocess
import sys
from decimal import Decimal
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_models import DEAD_ZONE_4, ETA, EXAMPLE_1, PI_4, R4, RHO

from hystgen.cascade import PI, Cascade
from hystgen.compensator.bounds import error_bounds
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.plays import elastoplastic, operators

ROOT = Path(__file__).resolve().parents[1]
GALLERY = ROOT / "examples" / "note"
PAGE = ROOT / "docs" / "note.md"
U = 2.0**-53  # largest error of one rounding, as a share of its result


def rows(title: str, columns: int) -> list[list[str]]:
    """Cells of the table under a heading of the page."""
    part = PAGE.read_text(encoding="utf-8").split(f"\n## {title}\n")[1].split("\n## ")[0]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in part.splitlines() if line[:1] == "|"]
    assert {len(row) for row in cells} == {columns}
    return cells[2:]


def names_in(file: str) -> set[str]:
    """Tests of a file: functions, and methods as Class::method."""
    found = set()
    for node in ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef):
            found.add(node.name)
        elif isinstance(node, ast.ClassDef):
            found |= {f"{node.name}::{method.name}" for method in node.body if isinstance(method, ast.FunctionDef)}
    return found


class TestPage:
    def test_every_equation_has_a_row(self) -> None:
        named = set()
        for row in rows("Equations", 5):
            for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", row[0]):
                named |= set(range(int(first), int(last or first) + 1))
        assert sorted({*range(1, 59)} - named) == []

    def test_functions_exist(self) -> None:
        for row in rows("Equations", 5):
            names = re.findall(r"`([^`]+)`", row[2])
            assert names, row
            for name in names:
                found: Any = importlib.import_module("hystgen")
                for part in name.split("."):
                    if not hasattr(found, part):
                        importlib.import_module(f"{found.__name__}.{part}")
                    found = getattr(found, part)
                assert callable(found) or isinstance(found, property | cached_property), name

    def test_tests_exist(self) -> None:
        for row in rows("Equations", 5) + rows("Misprints and gaps", 5):
            assert "::" in row[3] + row[4], f"no test: {row}"
        named = re.findall(r"`(test_\w+\.py)::([\w:]+)`", PAGE.read_text(encoding="utf-8"))
        assert [name for name in named if name[1] not in names_in(name[0])] == []

    def test_the_site_and_the_readme_lead_to_it(self) -> None:
        assert "(docs/note.md)" in (ROOT / "README.md").read_text(encoding="utf-8")
        for page in ("explanation/memory.md", "howto/closed-loop.md"):
            assert "(../note.md)" in (ROOT / "docs" / page).read_text(encoding="utf-8")


def draw(gallery: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(gallery), "-o", str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The gallery, drawn by the command of the page."""
    folder = tmp_path_factory.mktemp("note")
    done = draw(GALLERY, folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.thorough
class TestGallery:
    def test_figures_are_those_of_the_page(self, folder: Path) -> None:
        named = set(re.findall(r"`(figure_\d\d|density)`", PAGE.read_text(encoding="utf-8")))
        assert {path.stem for path in folder.glob("*.svg")} == named
        wanted = {f"figure_{i:02}" for i in (5, 6, *range(8, 15), 16, *range(21, 26))}
        assert wanted <= named

    def test_figures_have_content(self, folder: Path) -> None:
        for path in folder.iterdir():
            text = path.read_text(encoding="utf-8")
            assert text.count("<path") > 20, path.name
            assert not re.search(r"[^a-z]nan[^a-z]", text), path.name

    def test_a_number_that_is_not_the_printed_one_is_named(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.syspath_prepend(str(GALLERY))
        printed = importlib.import_module("printed")
        printed.check("z_i", [0.32449, 0.918], "0.324 0.918")
        printed.check("half", [0.2925, 1.5], "0.293 1")
        with pytest.raises(AssertionError, match=r"z_i, entry 1: computed 0\.9186, printed 0\.918"):
            printed.check("z_i", [0.324, 0.9186], "0.324 0.918")
        printed.check("z_i", [0.324, 0.9186], "0.324 0.918", [0.0, 0.0002])
        with pytest.raises(AssertionError, match="2 values, but 1 are printed"):
            printed.check("z_i", [0.324, 0.9186], "0.324")
        with pytest.raises(AssertionError, match="computed nan"):
            printed.check("z_i", [np.nan], "0.324")
        with pytest.raises(AssertionError, match="off by nan"):
            printed.close("y", [1.0, np.nan], [1.0, 1.0], 1.0)

    def test_a_failure_is_the_exit_code(self, tmp_path: Path) -> None:
        copy = tmp_path / "note"
        copy.mkdir()
        for name in ("__main__.py", "printed.py", "example_1.yaml", "operators.py"):
            text = (GALLERY / name).read_text(encoding="utf-8")
            (copy / name).write_text(text.replace("2.0 - gap, 0.0", "2.1 - gap, 0.0"), encoding="utf-8")
        done = draw(copy, tmp_path / "out")
        assert done.returncode == 1
        assert done.stderr == "operators.py: mass B stays behind by the gap: off by 0.1, more than 0\n"


@given(
    st.lists(st.tuples(st.floats(0.05, 1), st.floats(0.1, 3)), max_size=5),
    st.lists(st.tuples(st.floats(0.05, 1), st.floats(0.1, 3)), max_size=5),
    st.floats(0.1, 3),
    st.lists(st.floats(-6, 6), min_size=1, max_size=20),
)
def test_the_inverse_dead_zone_sum_undoes_the_sum(
    left: list[tuple[float, float]], right: list[tuple[float, float]], slope: float, v: list[float]
) -> None:
    """Equations (53)-(56) on each side of zero, with dead zones summed as in (41), (42), (50) and (51)."""
    rho, eta = [0.0], [slope]
    for sign, side in ((-1.0, left), (1.0, right)):
        place, last = 0.0, slope
        for gap, following in side:
            place, change, last = place + sign * gap, following - last, following
            where = 0 if sign < 0 else len(rho)
            rho.insert(where, place)
            eta.insert(where, change)
    zone = DeadZone(rho, eta)
    inverse = zone.inverse_map()

    def summed(of: DeadZone, x: np.ndarray) -> np.ndarray:
        total = np.zeros_like(x)
        for threshold, weight in zip(of.thresholds, of.weights, strict=True):
            beyond = np.maximum(x - threshold, 0) if threshold > 0 else np.minimum(x - threshold, 0)
            total += weight * (beyond if threshold else x)
        return total

    drives = np.array(v)
    w = summed(zone, drives)
    # sums with one term per dead zone, each of a few roundings: errors of the sum, which the inverse scales by at most
    # its slopes, of tau, which are such sums too, and of the inverse
    there = np.abs(zone.weights) @ (np.max(np.abs(drives)) + np.abs(zone.thresholds))
    back = np.abs(inverse.weights) @ (np.max(np.abs(w)) + np.abs(inverse.thresholds))
    small = (len(rho) + 8) * U * (2 * there * np.abs(inverse.weights).sum() + back)
    np.testing.assert_allclose(summed(inverse, w), drives, rtol=0, atol=small)
    np.testing.assert_allclose(zone.inverse(w), drives, rtol=0, atol=small)


def off(found: object, expected: object) -> float:
    return float(np.max(np.abs(np.asarray(found) - np.asarray(expected))))


class TestMisprints:
    """Printed formulas, computed as they are printed, give the numbers that docs/note.md states."""

    T = np.linspace(0, 2, 2001)
    v = np.round((1 + 3 * np.sin(2 * np.pi * T)) * 2**20) / 2**20  # so that sums are not rounded

    @pytest.fixture
    def errata(self, request: pytest.FixtureRequest) -> str:
        """The rows of the page that name the test."""
        named = f"::{request.node.name}`"
        return "\n".join(" | ".join(row) for row in rows("Misprints and gaps", 5) if named in row[4])

    def test_stop_4(self, errata: str) -> None:
        play = operators.play(self.v, 1.0, 0.375)
        printed = [np.clip(self.v[0] - 0.375, -1, 1)]
        for x in self.v[1:]:
            printed.append(np.clip(x - self.v[0] + printed[-1], -1, 1))
        assert "M0 = 0.375, play and stop add up to v as (26) demands only with the right one" in errata
        assert f"the printed one is off by up to {off(printed + play, self.v):.2g} |" in errata
        assert (operators.stop(self.v, 1.0, 0.375) + play).tolist() == self.v.tolist()

    def test_stop_5(self, errata: str) -> None:
        play, stop = operators.play(self.v, 1.0, 0.375)[0], operators.stop(self.v, 1.0, 0.375)[0]
        wrong = np.clip(self.v[0] + 0.375, -1, 1) + play - self.v[0]
        assert f"the printed one is off by M0 = {wrong} at t = 0 |" in errata
        assert stop + play == self.v[0]

    def test_series_element_16(self, errata: str) -> None:
        strain, modulus, r = np.array([0.125, 0.25, 0.5]), 1.0, 1.0
        printed = r * np.sign(np.diff(strain, prepend=0.0))
        right = elastoplastic.series(strain, modulus, r)
        assert f"at a strain of {strain[0]}, with E = r = {r:g}, the printed one puts the stress" in errata
        assert f"at the yield stress {printed[0]:g}, where (17) has {right.stress[0]}" in errata
        given = -printed[0] * (strain - printed / modulus)[0]
        assert f"its slider gives an energy of {given} instead of taking any |" in errata
        assert right.stress.tolist() == (modulus * strain).tolist()
        assert operators.stop(modulus * strain, r).tolist() == (modulus * strain).tolist()

    def test_width_32(self, errata: str) -> None:
        p, r = np.array(EXAMPLE_1.weights), np.array(EXAMPLE_1.thresholds)
        printed = 2 * p[1:] @ r[1:] / p[1:].sum()
        assert f"Example 1: the printed formula gives {printed:.3f}, the right one {EXAMPLE_1.width:.3f}," in errata

    def test_total_variation(self, errata: str) -> None:
        v = np.array([0.0, *[1.0, -1.0] * 10])
        variation = np.abs(np.diff(v)).sum()
        assert variation > 7 * 2 * EXAMPLE_1.thresholds[-1]
        assert f"ten swings of +-1 have a total variation of {variation:g}, seven times what is required" in errata
        high, low = (PI(EXAMPLE_1.thresholds, EXAMPLE_1.weights, start).simulate(v)[-1] for start in (1.0, -1.0))
        rounding = error_bounds(Cascade(EXAMPLE_1, (), 0.0, (-1.0, 1.0)), "float64", "corners").forward
        assert high - low == pytest.approx(0.9, rel=0, abs=rounding)
        assert "starts of 1 and -1 still give outputs that are 0.9 apart |" in errata

    def test_start_of_the_inverse(self, errata: str) -> None:
        model, u = PI(EXAMPLE_1.thresholds, EXAMPLE_1.weights, 1.0), 10 * np.sin(2 * np.pi * self.T)
        right = model.inverse()
        errors = []
        for start in (right.start, 0.0, 1.0):
            v = PI(right.thresholds, right.weights, start).simulate(u)
            error = model.simulate(v) - u
            errors.append(np.max(np.abs(error)))
            assert np.max(np.abs(error[1000:])) < 1e-13, "wiped"
        assert errors[0] < 1e-14
        assert "with that start the composition is exact to 1e-14," in errata
        assert f"with 0 it is off by {errors[1]:.3f}, with M0 itself by {errors[2]:.3f}, until" in errata

    def test_example_4_sign(self, errata: str) -> None:
        printed = PI(R4, [0.65 * float(np.exp(7.75e-4 * r)) for r in R4]).inverse()
        right = PI_4.inverse()
        z = [inverse.thresholds[6] for inverse in (printed, right)]
        assert f"z_6 is {z[0]:.3f} with the printed sign and {z[1]:.3f} with the other, and 6.139 is printed" in errata
        assert f"likewise q_1, {printed.weights[1]:.4f} and {right.weights[1]:.4f} |" in errata
        assert f"z_5 = 4.386 | {right.thresholds[5]:.3f} | {right.thresholds[5]:.5f} from the printed numbers" in errata

    def test_example_4_mu(self, errata: str) -> None:
        inverse = DEAD_ZONE_4.inverse_map()
        assert inverse.weights[-1] == inverse.weights[0]
        assert f"mu_j up to 10.226 | {inverse.weights[-1]:.3f} |" in errata
        assert abs(10.226 / inverse.weights[-1] - 1) < 0.12
        eta = np.array([4.765, *ETA])
        assert f"the slope at the end is only {sum(Decimal(str(x)) for x in eta)}:" in errata
        moved = []
        for step in 0.5e-3 * np.eye(12):
            other = DeadZone([0, *RHO], (eta + step).tolist()).inverse_map()
            moved.append([other.weights[-1] / inverse.weights[-1], other.thresholds[-1] / inverse.thresholds[-1]])
        most = 100 * np.abs(np.array(moved) - 1).sum(axis=0)
        assert f"moves mu_11 by up to {most[0]:.1f} %, tau by {most[1]:.1f} % |" in errata

    def test_condition_43(self, errata: str) -> None:
        printed = sum(Decimal(str(x)) for x in DEAD_ZONE_4.weights[:11])
        assert f"the printed sum is {printed}, and the inverse exists |" in errata
        assert DEAD_ZONE_4.inverse_problems(-5, 5) == []
        w = DEAD_ZONE_4.forward(np.linspace(-5, 5, 1001))
        assert np.all(np.diff(w) > 0)

    def test_plateau_45_57(self, errata: str) -> None:
        a0, a1, gap = 2.0, 0.5, 0.3
        u = np.array([0.0, 0.5, 1.0, 1.0, 1.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.4])
        v = [np.arctanh(x / a0) / a1 if up else np.arctanh((x - gap) / a0) / a1 for x, up in
             zip(u, np.diff(u, prepend=-1.0) > 0, strict=True)]  # fmt: skip
        h = [a0 * np.tanh(a1 * x) + (0.0 if up else gap) for x, up in
             zip(v, np.diff(v, prepend=-9.0) >= 0, strict=True)]  # fmt: skip
        error = np.abs(h - u)
        small = 20 * U * a0  # 6 operations and two functions of a few roundings, of numbers up to a0
        assert error.max() == pytest.approx(gap, rel=0, abs=small)
        assert np.flatnonzero(error > small).tolist() == [4, 5, 8, 9, 10]
        rising, falling = (("first", "second", "third")[np.argmax(error[begin:] > small)] for begin in (2, 7))
        assert f"branches {gap} apart, the composition is off by {gap} from the {rising} sample of a rising" in errata
        assert f"or the {falling} of a falling one; with the right rule, only by rounding |" in errata
        envelope = TanhEnvelope((a0, a1, 0.0, 0.0), (a0, a1, 0.0, gap))
        model = Cascade(PI([0.0], [1.0]), (envelope,), 0.0, (-2.0, 2.0))
        assert off(model.simulate(model.inverse().simulate(u)), u) <= small
