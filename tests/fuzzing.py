"""Fuzzing of the emitted C with libFuzzer, and replay of the inputs it kept against the bit-exact reference."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from modelfiles import CHAINS, FILES, LED, NOTCHED

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.emission import module
from hystgen.emission.chain import settings as settings_of
from hystgen.emission.options import Options
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays import slots
from hystgen.verification import comparison, compilers

CALLS = {
    "step": slots.OP_STEP,
    "init": slots.OP_INIT,
    "reset": slots.OP_RESET,
    "commit": slots.OP_COMMIT,
}
SETTINGS = ("push", "settle", "set_offset", "set_temperature", "set_gain", "set_influence")
"""Calls of models with effects that are fuzzed with arbitrary arguments."""

SANITIZERS = "address,undefined,float-cast-overflow"
FLAGS = ["-std=c99", "-g", "-O1", f"-fsanitize=fuzzer,{SANITIZERS}", "-fno-sanitize-recover=all"]
LONGEST = 2048
SEEDS = 16


class FuzzError(AssertionError):
    """A crash, a sanitizer report, or an answer that differs from the reference's."""


@dataclass(frozen=True)
class Target:
    """A fuzzer of both operators of a model; in fixed point it runs both engines, whose answers must agree."""

    model: Model
    arithmetic: str
    engine: str
    binary: Path

    @cached_property
    def numbers(self) -> Any:
        """Tables that the reference computes with."""
        return self.model.tables(self.arithmetic, self.engine)

    def run(self, corpus: Path, seconds: float) -> str:
        """Fuzz, keeping inputs with new coverage in `corpus`. Returns libFuzzer's statistics. Raises FuzzError."""
        artifacts = corpus.parent / "found"
        shutil.rmtree(artifacts, ignore_errors=True)
        artifacts.mkdir()
        options = [
            f"-max_total_time={seconds}", f"-max_len={LONGEST}", "-len_control=0", "-use_value_profile=1",
            "-timeout=10", "-seed=1", "-print_final_stats=1", "-verbosity=0", f"-artifact_prefix={artifacts}{os.sep}",
        ]  # fmt: skip
        done = self._called(*options, corpus)
        if done.returncode:
            told = [done.stderr]
            for path in sorted(artifacts.iterdir()):
                for calls in self._logged(path)[1]:
                    try:
                        self._compare(path.name, calls)
                    except FuzzError as difference:
                        told.append(str(difference))
            raise FuzzError("\n".join(told))
        return done.stderr

    def replay(self, corpus: Path) -> int:
        """Compare each input of `corpus` with the reference. Returns the number of calls. Raises FuzzError."""
        files = sorted(corpus.iterdir())
        done, inputs = self._logged(*files)
        if done.returncode:
            raise FuzzError(done.stderr)
        return sum(self._compare(file.name, text) for file, text in zip(files, inputs, strict=True))

    def _called(self, *arguments: str | Path, **environment: str) -> subprocess.CompletedProcess[str]:
        # libFuzzer counts peak memory, which a child inherits from its parent: a shell has little, pytest much
        return subprocess.run(
            ["sh", "-c", '"$@"; exit $?', "sh", self.binary, *arguments],
            capture_output=True, text=True, errors="replace", check=False, env={**os.environ, **environment},
        )  # fmt: skip

    def _logged(self, *inputs: Path) -> tuple[subprocess.CompletedProcess[str], list[str]]:
        """Logged calls of each input, up to a crash if there is one; an empty list if it crashed before the first."""
        log = inputs[0].parent.parent / "calls.txt"
        log.write_text("")
        done = self._called(*inputs, HYSTGEN_FUZZ_LOG=str(log))
        # libFuzzer runs an empty input before several inputs
        return done, log.read_text().split("input ")[1:][-len(inputs) :]

    def _compare(self, name: str, calls: str) -> int:
        """Compare one input. Raises FuzzError for the first answer or status that differs from the reference's."""
        operator, *lines = calls.splitlines()
        inverse = operator == "1"
        rows = [[int(number) for number in line.split()] for line in lines]
        table = np.array([row + [-1] * (4 - len(row)) for row in rows], dtype=object).reshape(-1, 4)
        call = table[:, 0].astype(np.uint8)
        real = ARITHMETICS[self.arithmetic].number
        x, answer = (table[:, i].astype(f"u{real.itemsize}").view(real) for i in (1, 2))
        with np.errstate(invalid="ignore"):  # converting a signalling NaN warns
            expected = comparison.expected_record(self.numbers, real, inverse, (name, call, x))
        bits = f"u{real.itemsize}"
        wrong = answer.view(bits) != expected.answer.view(bits)
        gathered = 0
        for i, read in enumerate(table[:, 3]):
            if call[i] in (slots.OP_INIT, slots.OP_RESET):
                gathered = 0
            gathered |= int(expected.status[i])
            if read >= 0:
                wrong[i] |= read != gathered
                gathered = 0
        if wrong.any():
            i = int(np.argmax(wrong))
            raise FuzzError(
                f"{self.model.name}, {self.arithmetic}, {self.engine}, {'inverse' if inverse else 'forward'}, input "
                f"{name}: call {i} ({call[i]} of {x[i]!r}) gave {answer[i]!r}, status {table[i, 3]}; the reference "
                f"{expected.answer[i]!r}, its bits {expected.status[i]}"
            )
        return len(call)


def build(
    folder: Path,
    name: str,
    arithmetic: str,
    engine: str,
    change: Callable[[str], str] = lambda text: text,
) -> Target:
    """Emit a model, apply `change` to its C, and build its fuzzer. In fixed point both engines are built; for models
    with effects only if `engine` is corners, since some have only loop."""
    clang = compilers.find("clang")
    assert clang, "clang is not installed"
    real = ARITHMETICS[arithmetic].number
    fixed = real.kind == "i"
    effects = {**CHAINS, **LED, **NOTCHED}
    chain = name in effects
    text = {**FILES, **effects}[name]
    text += "emit: {compensation: {noise_gain: 1.0e+9}}\n" * (chain and "emit:" not in text)
    model = Model(parse_parameters(text, f"{name}.yaml"))
    hystgen.emit(model, folder, operator="both", arithmetic=arithmetic, engine=engine)
    source = folder / f"{name}.c"
    source.write_text(change(source.read_text()))
    sources = [source]
    twin = f"{name}_twin" if fixed and (not chain or engine == "corners") else ""
    if twin:
        other = Model(parse_parameters(text.replace(f"name: {name}\n", f"name: {twin}\n"), f"{twin}.yaml"))
        hystgen.emit(
            other, folder, operator="both", arithmetic=arithmetic, engine="loop" if engine == "corners" else "corners"
        )
        sources.append(folder / f"{twin}.c")
    template = jinja2.Template(
        (Path(__file__).parent / "fuzz_harness.c.j2").read_text(), undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    limits = np.iinfo(real) if fixed else np.iinfo(np.int32)
    harness = folder / "fuzz_harness.c"
    harness.write_text(
        template.render(
            name=name, NAME=name.upper(), twin=twin, chain=chain, settings=settings(model, arithmetic, engine),
            fixed=fixed, size=real.itemsize, calls=CALLS,
            FLT="FLT" if arithmetic == "float32" else "DBL", least=f"({limits.min + 1} - 1)", most=limits.max,
        )
    )  # fmt: skip
    binary = folder / "fuzz"
    clang.run([*FLAGS, *sources, harness, "-o", binary])
    return Target(model, arithmetic, engine, binary)


def settings(model: Model, arithmetic: str, engine: str) -> dict[str, list[tuple[int, str, str]]]:
    """Codes and names of each operator's settings, and the arguments before the number."""
    one = module.of(model, Options("both", arithmetic, engine, "self-contained")).compensator
    return {
        op: list(settings_of(set(SETTINGS).intersection(one.calls.get(op, ())), len(one.columns)))
        for op in ("forward", "inverse")
    }


def seed(corpus: Path) -> None:
    """Fill a new corpus with random call sequences, two of each length."""
    corpus.mkdir()
    rng = np.random.default_rng(4)
    for number in range(SEEDS):
        data = rng.integers(0, 256, 2 ** (3 + number // 2), dtype=np.uint8)
        data[0] = number % 2
        (corpus / f"seed-{number}").write_bytes(data.tobytes())
