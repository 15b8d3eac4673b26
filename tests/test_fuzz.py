"""Random calls with random bits: no undefined behaviour, answers in range, and the bits of the reference."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import fuzzing
import numpy as np
import pytest
from fuzzing import FuzzError
from modelfiles import FILES

from hystgen.verification import compilers

pytestmark = pytest.mark.thorough

SECONDS = float(os.environ.get("HYSTGEN_FUZZ_SECONDS", "6"))
"""Duration of the fuzzing of one module; `make fuzz` takes longer."""

needs_clang = pytest.mark.skipif(
    not os.environ.get("CI") and compilers.find("clang") is None, reason="libFuzzer comes with clang"
)


def fuzz(folder: Path, seconds: float, *module: str, change: Callable[[str], str] | None = None) -> int:
    """Build, fuzz, replay; returns the number of calls that were compared with the reference."""
    target = fuzzing.build(folder, *module, **({"change": change} if change else {}))
    corpus = folder / "corpus"
    fuzzing.seed(corpus)
    figures = target.run(corpus, seconds)
    compared = target.replay(corpus)
    runs = re.search(r"number_of_executed_units: (\d+)", figures)
    inputs = len(list(corpus.iterdir()))
    print(f"\n{' '.join(module)}: {runs and runs[1]} runs, {inputs} inputs, {compared} calls compared")
    return compared


@needs_clang
@pytest.mark.slow(one_in=4)
@pytest.mark.parametrize(
    ("name", "arithmetic", "engine"),
    [
        ("plain", "float32", "corners"),
        ("outside", "float32", "corners"),
        ("below", "float64", "corners"),
        ("bent", "float32", "corners"),
        ("two_branches", "float32", "corners"),
        ("mixed", "float64", "loop"),
        ("listed", "q31", "corners"),
        ("two_branches", "q31", "corners"),
        ("curved", "q15", "loop"),
        ("listed", "q15", "corners"),
    ],
)
def test_fuzzing_finds_nothing(name: str, arithmetic: str, engine: str, tmp_path: Path) -> None:
    assert fuzz(tmp_path, SECONDS, name, arithmetic, engine) > 1000


@needs_clang
@pytest.mark.slow(one_in=8)
@pytest.mark.parametrize(
    ("name", "arithmetic", "engine"),
    [("creeping", "q31", "corners"), ("lagging", "q15", "corners"), ("quick", "q31", "corners"),
     ("warm", "q15", "corners"), ("worn", "q31", "corners"), ("late", "q15", "corners"), ("relaxing", "q31", "loop"),
     ("wider", "q15", "loop"), ("drifting", "q31", "loop"), ("drifting_late", "q15", "corners"),
     ("everything", "q15", "corners"), ("led", "q31", "corners"), ("creeping", "float32", "corners"),
     ("notched", "q15", "corners")],
)  # fmt: skip
def test_fuzzing_finds_nothing_in_models_with_effects(
    name: str, arithmetic: str, engine: str, tmp_path: Path
) -> None:
    """Calls include settings; answers are compared with the reference and, in fixed point, with the other engine."""
    assert fuzz(tmp_path, min(SECONDS, 4.0), name, arithmetic, engine) > 300


def changed_entry(text: str) -> str:
    """Change one threshold by one unit in the last place."""
    start = text.index("plain_forward_segment[")
    number = re.compile(r"0\.9f").search(text, start)
    assert number
    other = np.nextafter(np.float32(0.9), np.float32(1))
    return text[: number.start()] + f"{other!s}f" + text[number.end() :]


def loose_clamp(text: str) -> str:
    """Accept a committed drive slightly beyond the range."""
    found = re.sub(r"least > PLAIN_DRIVE_MAX\s*\?", "least > 1.001f * PLAIN_DRIVE_MAX ?", text)
    assert found != text
    return found


def beyond_the_range(text: str) -> str:
    """Return a drive 1 % above the one that was solved and clamped."""
    found = re.sub(r"(plain_inverse_search\(self, u\);\n    return )", r"\1 1.01f * ", text)
    assert found != text
    return found


def out_of_bounds(text: str) -> str:
    """Write corners past the end of the list."""
    slot = "&corner[m->here.depth"
    found = text.replace(f"{slot}]", f"{slot} + PLAIN_N_PLAYS + 1u]")
    assert found != text
    return found


@pytest.mark.slow(one_in=2)
@needs_clang
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (changed_entry, "the reference"),
        (loose_clamp, "the reference"),
        (beyond_the_range, "the drive is out of range"),
        (out_of_bounds, "runtime error: index|AddressSanitizer"),
    ],
)
def test_a_defect_is_found(change: Callable[[str], str], said: str, tmp_path: Path) -> None:
    with pytest.raises(FuzzError, match=said):
        fuzz(tmp_path, 5, "plain", "float32", "corners", change=change)


def test_a_crash_before_the_first_call_is_reported(tmp_path: Path) -> None:
    """The program writes an artifact but no call; the artifact replaces what an earlier run found."""
    binary = tmp_path / "fuzz"
    artifact = "for each; do case $each in -artifact_prefix=*) : > ${each#*=}crash;; esac; done"
    binary.write_text(f"#!/bin/sh\n{artifact}\necho crashed >&2\nexit 1\n")
    binary.chmod(0o755)
    earlier = tmp_path / "found" / "earlier"
    earlier.parent.mkdir()
    earlier.touch()
    target = fuzzing.Target(fuzzing.Model(fuzzing.parse_parameters(FILES["plain"])), "float32", "corners", binary)
    with pytest.raises(FuzzError, match=r"\Acrashed\n\Z"):
        target.run(tmp_path / "corpus", 1)
    assert [path.name for path in earlier.parent.iterdir()] == ["crash"]


@needs_clang
def test_engines_that_differ_are_found(tmp_path: Path) -> None:
    """In q31, a threshold that is off by half a code is enough."""

    def change(text: str) -> str:
        table = text.index("plain_model_segment[")
        way = re.compile(r"(?<=LL, )\d+").search(text, table)
        assert way
        return text[: way.start()] + str(int(way[0]) + 1) + text[way.end() :]

    with pytest.raises(FuzzError, match="the engines give different answers"):
        fuzz(tmp_path, 5, "plain", "q31", "corners", change=change)
