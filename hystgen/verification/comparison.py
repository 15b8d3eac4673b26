"""Verification records with the output of the bit-exact reference, and the comparison of compiled output with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.compensator import converter, reference
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.converter import CodeConversion
from hystgen.compensator.health import Watch
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.plays.slots import Bytes
from hystgen.verification import signals


@dataclass(frozen=True)
class Expected:
    """A record and the reference's output for it."""

    name: str
    call: Bytes
    x: NDArray[np.number]
    answer: NDArray[np.number]
    status: Bytes


@dataclass(frozen=True)
class Mismatch:
    """Number of samples compared, number that differ, largest difference (None: infinite), and first to differ."""

    samples: int
    different: int
    max_ulp: float | None
    first: str


def expected_record(
    numbers: Tables | FixedTables | ChainTables, real: np.dtype[np.number], inverse: bool, calls: signals.Calls,
    following: int = 0,
) -> Expected:
    """A record of calls, with values of type `real`, and the output of the bit-exact reference; `following`: number of
    calls in the records after it."""
    name, op, values = calls
    x = values.astype(real).astype(numbers.threshold.dtype)
    answer, status = reference.answers(numbers, inverse, op, x, following=following)
    return Expected(name, op, x.astype(real), answer.astype(real), status)


def expected_records(
    numbers: Tables | FixedTables | ChainTables, real: np.dtype[np.number], inverse: bool, length: int
) -> list[Expected]:
    """The verification records of an operator with the output of the bit-exact reference."""
    suite = list(signals.suite(numbers, real, inverse, length))
    following = sum(len(op) for _, op, _ in suite)
    found = []
    for calls in suite:
        following -= len(calls[1])
        found.append(expected_record(numbers, real, inverse, calls, following))
    return found


@dataclass(frozen=True)
class ExpectedCodes:
    """Codes of converters, and the reference's results for them by name: conversions, codes sent, status bits."""

    codes: NDArray[np.int32]
    results: Mapping[str, NDArray[np.number]]


def expected_codes(
    numbers: Tables | FixedTables | ChainTables, real: np.dtype[np.number], conversion: CodeConversion, length: int
) -> ExpectedCodes:
    """Codes for both converters, some beyond their ends, with the results of the bit-exact reference."""
    codes = signals.codes(conversion, length)
    drives = conversion.drive_from_code(codes)
    sent, status = converter.steps(numbers, conversion, codes)
    found = {
        "reference_from_code": conversion.reference_from_code(codes).astype(real),
        "drive_from_code": drives.astype(real), "code_from_drive": conversion.code_from_drive(drives),
        "step_code": sent, "status": status,
    }
    return ExpectedCodes(codes.astype(np.int32), found)


@dataclass(frozen=True)
class ExpectedHealth:
    """Displacements for a watch over the model's error, and the reference's results for them by name."""

    expected: NDArray[np.number]
    measured: NDArray[np.number]
    results: Mapping[str, NDArray[np.number]]


def expected_health(real: np.dtype[np.number], watch: Watch, lsb: float, length: int) -> ExpectedHealth:
    """Displacements with errors around the band and far beyond it, with the results of the bit-exact reference; `lsb`:
    output units per number."""
    expected, measured = signals.displacements(real, watch.band, lsb, length)
    own = (real, real) if real.kind == "f" else (np.dtype("int32"), np.dtype("int64"))
    names, kinds = ("status", "mean", "mean_square"), (np.dtype("uint32"), *own)
    answers = watch.update(expected, measured)
    results = {name: each.astype(kind) for name, kind, each in zip(names, kinds, answers, strict=True)}
    return ExpectedHealth(expected, measured, results)


def compare_health(
    run: Callable[..., Sequence[NDArray[np.number]]], expected: ExpectedHealth
) -> Mismatch:
    """Compare the compiled results of a watch over the model's error, bit for bit; `run`: takes expected and measured
    displacements and the types of the results."""
    kinds = [each.dtype for each in expected.results.values()]
    return _compare_results(run(expected.expected, expected.measured, kinds), expected.results)


def compare_codes(
    run: Callable[[NDArray[np.int32]], Sequence[NDArray[np.number]]], expected: ExpectedCodes
) -> Mismatch:
    """Compare the compiled results for codes, bit for bit."""
    return _compare_results(run(expected.codes), expected.results)


def _compare_results(
    results: Sequence[NDArray[np.number]], expected: Mapping[str, NDArray[np.number]]
) -> Mismatch:
    """Compare compiled results, one per name and sample, bit for bit."""
    different = 0
    first, worst = "", 0.0
    for found, (name, wanted) in zip(results, expected.items(), strict=True):
        wanted = wanted.astype(found.dtype)
        bits = np.dtype(f"u{found.itemsize}")
        wrong = found.view(bits) != wanted.view(bits)
        different += int(wrong.sum())
        if wrong.any():
            first = first or f"sample {int(np.argmax(wrong))} of {name}"
            worst = max(worst, _ulps(found[wrong], wanted[wrong]))
    return Mismatch(len(results[0]), different, worst if np.isfinite(worst) else None, first)


def _ulps(a: NDArray[np.number], b: NDArray[np.number]) -> float:
    """Largest distance in units in the last place of `b`, or in codes."""
    if a.dtype.kind == "i":
        return float(np.max(np.abs(a.astype(np.int64) - b.astype(np.int64)), initial=0))
    with np.errstate(all="ignore"):
        distance = np.abs(a.astype(np.longdouble) - b.astype(np.longdouble)) / np.spacing(np.abs(b))
    return float(np.max(np.where(np.isfinite(distance), distance, np.inf), initial=0.0))


def compare(
    run: Callable[[Bytes, NDArray[np.number]], tuple[NDArray[np.number], Bytes]], records: Sequence[Expected]
) -> Mismatch:
    """Run every record through `run` (calls and arguments to outputs and status) and compare it bit for bit."""
    samples = different = 0
    first = ""
    worst = 0.0
    for record in records:
        answer, status = run(record.call, record.x)
        bits = np.dtype(f"u{answer.itemsize}")
        wrong = (answer.view(bits) != record.answer.view(bits)) | (status != record.status)
        samples += len(answer)
        different += int(wrong.sum())
        if wrong.any():
            first = first or f"sample {int(np.argmax(wrong))} of {record.name}"
            worst = max(worst, _ulps(answer[wrong], record.answer[wrong]))
    return Mismatch(samples, different, worst if np.isfinite(worst) else None, first)
