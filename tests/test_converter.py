"""Converter codes: the C against exact fractions and against the same calls made one by one, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import cffi
import numpy as np
import pytest

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.problems import FormatError, ParameterError
from hystgen.model import Model
from hystgen.parameters.files import canonical_json, parse_parameters
from hystgen.verification import compilers

ARITHMETIC = ("float32", "float64", "q31", "q15")
CODINGS = ("offset-binary", "twos-complement")
EFFECTS = """
  effects:
    - {name: creep, time_constants: [0.1, 1.0], weights: [0.02, 0.01]}
    - {name: lag, time_constant: 1.0e-3}"""
TEXT = """\
hystgen: 1
name: m
units: {{input: V, output: um}}
sample_time: 5.0e-5
input_range: [0.0, 100.0]
model:
  pi:
    thresholds: [0, 5, 10, 20]
    weights: [0.1, 0.02, 0.01, 0.005]{effects}
emit:
  converter:
    reference: {{bits: {bits}, range: {reference}, coding: {coding}}}
    drive: {{bits: {bits}, range: {drive}, coding: {other}}}
"""
ISR = """
#include "m.h"
void composed(const int32_t *code, int32_t *sent, unsigned *status, size_t count);
void composed(const int32_t *code, int32_t *sent, unsigned *status, size_t count) {
    m_inverse_t self;
    size_t i;
    m_inverse_init(&self);
    for (i = 0; i < count; ++i) {
        const m_real_t v = m_inverse_step(&self, m_reference_from_code(code[i]));
        double made;
        sent[i] = m_code_from_drive(v);
        made = (double)m_drive_from_code(sent[i]);
        made = made < (double)M_DRIVE_MIN ? (double)M_DRIVE_MIN : made;
        made = made > (double)M_DRIVE_MAX ? (double)M_DRIVE_MAX : made;
        m_inverse_commit(&self, (m_real_t)made);
        status[i] = m_inverse_status(&self);
    }
}
void coded(const int32_t *code, int32_t *sent, unsigned *status, size_t count);
void coded(const int32_t *code, int32_t *sent, unsigned *status, size_t count) {
    m_inverse_t self;
    size_t i;
    m_inverse_init(&self);
    for (i = 0; i < count; ++i) {
        sent[i] = m_inverse_step_code(&self, code[i]);
        status[i] = m_inverse_status(&self);
    }
}
"""


def parameters(
    bits: int = 16, reference: str = "[0, 20]", drive: str = "[-10, 110]", coding: str = CODINGS[0],
    other: str = CODINGS[0], effects: str = "",
) -> str:
    return TEXT.format(bits=bits, reference=reference, drive=drive, coding=coding, other=other, effects=effects)


def model(**changes: Any) -> Model:
    return Model(parse_parameters(parameters(**changes)))


class Compiled:
    """The emitted C in a library."""

    def __init__(self, one: Model, arithmetic: str, folder: Path) -> None:
        hystgen.emit(one, folder, arithmetic=arithmetic)
        (folder / "isr.c").write_text(ISR)
        compiler = compilers.available()[0]
        compiler.shared_library([folder / "m.c", folder / "isr.c"], folder / "m.so", compilers.STRICT)
        self.ffi = cffi.FFI()
        self.real = ARITHMETICS[arithmetic].c_type
        self.ffi.cdef(
            f"{self.real} m_reference_from_code(int32_t); {self.real} m_drive_from_code(int32_t);"
            f"int32_t m_code_from_drive({self.real});"
            "void composed(void *, void *, void *, size_t); void coded(void *, void *, void *, size_t);"
        )
        self.lib = self.ffi.dlopen(str(folder / "m.so"))

    def steps(self, which: str, codes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        given, sent = codes.astype(np.int32), np.zeros(len(codes), np.int32)
        status = np.zeros(len(codes), np.uint32)
        places = [self.ffi.cast("void *", each.ctypes.data) for each in (given, sent, status)]
        getattr(self.lib, which)(*places, len(codes))
        return sent, status


def exact(bits: int, ends: tuple[int, int], coding: str) -> Callable[[int], Fraction]:
    """The quantity of a code, written from the converter's data sheet: the n-th of 2^bits equally spaced levels."""
    def quantity(code: int) -> Fraction:
        nth = code if coding == "offset-binary" else code + 2 ** (bits - 1)
        nth = min(max(nth, 0), 2**bits - 1)
        return ends[0] + Fraction(nth, 2**bits - 1) * (ends[1] - ends[0])
    return quantity


def codes_of(bits: int, coding: str) -> list[int]:
    """Every code of a narrow converter, the ends of a wide one; and codes beyond."""
    least = -(2 ** (bits - 1)) if coding == "twos-complement" else 0
    most = least + 2**bits - 1
    if bits <= 12:
        return list(range(least - 3, most + 4))
    middle = (least + most) // 2
    return [*range(least - 3, least + 300), *range(middle - 100, middle + 100), *range(most - 300, most + 4),
            -(2**31), 2**31 - 1]


@pytest.mark.parametrize("arithmetic", ARITHMETIC)
@pytest.mark.parametrize(("bits", "coding", "other"), [
    (12, *CODINGS), (16, *reversed(CODINGS)), (18, *CODINGS), (20, *reversed(CODINGS)),
])
def test_every_conversion_is_within_its_stated_error_and_bit_equal(
    bits: int, coding: str, other: str, arithmetic: str, tmp_path: Path
) -> None:
    one = model(bits=bits, coding=coding, other=other)
    c, conversion = Compiled(one, arithmetic, tmp_path).lib, one.conversion(arithmetic)
    assert conversion is not None
    fixed = ARITHMETICS[arithmetic].fixed
    drive_lsb, output_lsb = map(Fraction, one.units_per_code(arithmetic)) if fixed else (Fraction(1), Fraction(1))
    reference, drive = exact(bits, (0, 20), coding), exact(bits, (-10, 110), other)
    least, most = conversion.drive.least, conversion.drive.most
    step = Fraction(120, 2**bits - 1)
    largest = 32767 if arithmetic == "q15" else 2**31 - 1
    for code in sorted({*codes_of(bits, coding), *codes_of(bits, other)}):
        u, v = c.m_reference_from_code(code), c.m_drive_from_code(code)
        assert u == conversion.reference_from_code(np.array([code]))[0]
        assert v == conversion.drive_from_code(np.array([code]))[0]
        for got, wanted, error in (
            (u, reference(code) / output_lsb, conversion.reference_error),
            (v, drive(code) / drive_lsb, conversion.drive_error),
        ):
            limited = min(max(wanted, Fraction(-largest)), Fraction(largest)) if fixed else wanted
            assert abs(Fraction(got) - limited) <= Fraction(error)
        back = c.m_code_from_drive(v)
        assert back == conversion.code_from_drive(np.array([v]))[0]
        assert least <= back <= most
        inside = min(max(Fraction(v) * drive_lsb, drive(least)), drive(most))
        assert abs(drive(back) - inside) <= step * Fraction(conversion.code_error)
        if not fixed:
            assert back == min(max(code, least), most)


@pytest.mark.parametrize("arithmetic", ARITHMETIC)
def test_drives_are_rounded_to_the_nearest_code_and_saturate(arithmetic: str, tmp_path: Path) -> None:
    one = model(bits=12)
    c, number = Compiled(one, arithmetic, tmp_path).lib, ARITHMETICS[arithmetic].number
    rng, step, lsb = np.random.default_rng(1), Fraction(120, 4095), Fraction(1)
    drives = rng.uniform(-12, 112, 2000).astype(number)
    if number.kind == "i":
        lsb, most = Fraction(one.units_per_code(arithmetic)[0]), np.iinfo(number).max
        drives = rng.integers(-most - 1, most, 2000, number, endpoint=True)
    for drive in drives.tolist():
        nth = (Fraction(drive) * lsb + 10) / step
        code = c.m_code_from_drive(drive)
        assert 0 <= code <= 4095
        assert abs(code - min(max(nth, 0), 4095)) <= Fraction(501, 1000)
    if number.kind == "f":
        assert [c.m_code_from_drive(x) for x in (np.inf, -np.inf, np.nan, 1e30)] == [4095, 0, 0, 4095]


@pytest.mark.parametrize("arithmetic", ARITHMETIC)
@pytest.mark.parametrize("effects", ["", EFFECTS])
def test_a_step_from_code_to_code_commits_the_drive_that_its_code_makes(
    effects: str, arithmetic: str, tmp_path: Path
) -> None:
    inverting = "[110, -10]"
    one = model(bits=12, coding=CODINGS[1], other=CODINGS[1], drive=inverting, effects=effects)
    c = Compiled(one, arithmetic, tmp_path)
    rng = np.random.default_rng(2)
    codes = np.concatenate([np.rint(1400 * np.sin(np.arange(700) / 40)), rng.integers(-2100, 2100, 300)]).astype(int)
    sent, status = c.steps("coded", codes)
    wanted, bits = c.steps("composed", codes)
    assert np.array_equal(sent, wanted)
    assert np.array_equal(status, bits)
    assert np.array_equal(sent, one.inverse_codes(codes, arithmetic))
    assert len(set(sent)) > 300


def test_a_committed_drive_at_the_end_of_the_range_sets_no_status_bit(tmp_path: Path) -> None:
    c = Compiled(model(bits=8), "float32", tmp_path)
    _, status = c.steps("coded", np.full(5, 150))  # within the range of references, at a drive of 100 V or less
    assert not status.any()


@pytest.mark.parametrize(("changes", "words"), [
    ({"drive": "[-10, 90]"}, "reaches -10.0 .. 90.0, but input_range is 0.0 .. 100.0"),
    ({"drive": "[5, 5]"}, "both ends are the same"),
    ({"drive": "[-60000, 20000]", "bits": 8}, "fewer than two codes lie in input_range, 0.0 .. 100.0"),
    ({"bits": 1}, "bits"),
    ({"bits": 25}, "bits"),
    ({"coding": "gray"}, "coding"),
    ({"reference": "[0]"}, "range"),
])
def test_converters_that_cannot_be_are_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words.replace(".", r"\.").replace("[", r"\[")) as caught:
        model(**changes)
    assert all(problem.line is not None for problem in caught.value.problems)


def test_an_arithmetic_that_cannot_tell_codes_apart_is_refused() -> None:
    one = model(bits=24)
    with pytest.raises(FormatError, match=r"float32 cannot tell neighbouring codes apart.*float64"):
        one.conversion("float32")
    assert one.conversion("float64")
    assert one.conversion("q31")


def test_a_slew_limit_below_one_code_is_refused() -> None:
    limit = "\n  effects:\n    - {name: slew_limit, rate: 30.0}"  # 1.5 mV in a sample; a code of 16 bits is 1.83 mV
    with pytest.raises(FormatError, match=r"a step of this converter is 0\.00183 V, and the slew limit allows 0\.0015"):
        model(effects=limit).conversion("float32")
    assert model(bits=18, effects=limit).conversion("float32") is not None


def test_a_converter_that_misses_a_part_of_the_references_is_told(tmp_path: Path) -> None:
    hystgen.emit(model(reference="[0, 5]"), tmp_path)
    header = " ".join((tmp_path / "m.h").read_text().replace(" * ", " ").split())
    assert "codes of references reach 0 .. 5 um, and the model's range is 0 .. 1" in header


def test_a_reference_in_another_unit_is_told_and_one_without_a_usable_code_refused(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"98\.7 % of the reference's codes, 0 \.\. 1000 um, lie beyond"):
        hystgen.emit(model(reference="[0, 1000]"), tmp_path)
    assert "98.7 %" in (tmp_path / "m.h").read_text()
    with pytest.raises(FormatError, match=r"is 30 \.\. 40 um, all beyond the model's own, 0 \.\. 1"):
        hystgen.emit(model(reference="[30, 40]"), tmp_path / "none")
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("arithmetic", ["float32", "q31", "q15"])
def test_a_quiet_drive_stands_still_at_the_steps_of_a_coarse_converter(arithmetic: str) -> None:
    """Creep moves it on, one way; with the band of a finer code it would go to and fro on half of the samples."""
    text = parameters(bits=12, effects=EFFECTS).replace("emit:\n", "emit:\n  compensation: {quiet: true}\n")
    codes = np.concatenate([np.linspace(500, 1500, 500), np.full(2500, 1500)]).astype(int)
    sent = Model(parse_parameters(text)).inverse_codes(codes, arithmetic)
    moves = np.diff(sent[700:])
    assert len(set(np.sign(moves[moves != 0]))) <= 1, "reversals at rest"
    assert np.count_nonzero(moves) <= 25  # the creep left over, code by code


def test_files_without_converters_keep_their_hash() -> None:
    text = parameters()
    assert "converter" in canonical_json(parse_parameters(text))
    assert "converter" not in canonical_json(parse_parameters(text.partition("emit:")[0]))
