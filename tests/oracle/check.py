"""Emit and compile models, have the oracle follow them, and collect what it found."""

from __future__ import annotations

import ctypes
import functools
import itertools
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

import hystgen
from hystgen.basics.problems import FormatError, NotInvertibleError
from tests.oracle import models

HERE = Path(__file__).parent
COMBINATIONS = tuple(itertools.product(("float32", "float64", "q31", "q15"), ("corners", "loop")))
KINDS = {"float32": 0, "float64": 1, "q31": 2, "q15": 2}
MOST_TRIES = 50
BATCH = 24
CALLS = 1500


class _Probe(ctypes.Structure):
    _fields_ = ()


class _Stage(ctypes.Structure):
    _fields_ = (
        ("count", ctypes.c_int),
        ("threshold", ctypes.POINTER(ctypes.c_double)),
        ("weight", ctypes.POINTER(ctypes.c_double)),
        ("a", ctypes.c_double * 8),
    )


class _Model(ctypes.Structure):
    _fields_ = (
        ("n", ctypes.c_int),
        ("threshold", ctypes.POINTER(ctypes.c_double)),
        ("weight", ctypes.POINTER(ctypes.c_double)),
        ("listed", ctypes.c_int),
        ("start", ctypes.POINTER(ctypes.c_double)),
        ("stages", ctypes.c_int),
        ("stage", ctypes.POINTER(_Stage)),
        ("offset", ctypes.c_double),
        ("low", ctypes.c_double),
        ("high", ctypes.c_double),
    )


class Call(ctypes.Structure):
    """One call of a run: 0 init, 1 reset, 2 step, 3 commit."""

    _fields_ = (("call", ctypes.c_int), ("x", ctypes.c_double), ("answer", ctypes.c_double))


class Result(ctypes.Structure):
    """What a run of one operator has found, as in `oracle.h`."""

    _fields_ = (
        ("samples", ctypes.c_long),
        ("over_forward", ctypes.c_long),
        ("over_single", ctypes.c_long),
        ("over_own", ctypes.c_long),
        ("wrong", ctypes.c_long),
        ("worst_forward", ctypes.c_double),
        ("worst_single", ctypes.c_double),
        ("worst_own", ctypes.c_double),
        ("worst_same_branch", ctypes.c_double),
        ("over_same_branch", ctypes.c_long),
        ("first", ctypes.c_long),
        ("message", ctypes.c_char * 400),
    )

    @property
    def faults(self) -> int:
        """Number of answers beyond a bound and of everything else that was wrong."""
        return self.over_forward + self.over_single + self.over_own + self.over_same_branch + self.wrong

    @property
    def worst(self) -> float:
        """Largest ratio of an error to its bound."""
        return max(self.worst_forward, self.worst_single, self.worst_own, self.worst_same_branch)


@dataclass(frozen=True)
class Case:
    """A parameter file that the package accepts, and what to emit from it."""

    name: str
    yaml: str
    arithmetic: str
    engine: str
    seed: int
    inverse: bool = True


@dataclass(frozen=True)
class Finding:
    """Result of the oracle for one operator of a case."""

    case: Case
    operator: str
    result: Result


@functools.cache
def _oracle() -> ctypes.CDLL:
    folder = tempfile.mkdtemp(prefix="hystgen-oracle-")
    library = Path(folder) / "oracle.so"
    compiled_library([HERE / "oracle.c"], library, "-O2", "-Wall", "-Wextra", "-Werror")
    loaded = ctypes.CDLL(str(library))
    shutil.rmtree(folder)
    for function in (loaded.oracle_forward, loaded.oracle_inverse):
        function.argtypes = [
            ctypes.POINTER(_Model), ctypes.POINTER(_Probe), ctypes.c_uint64, ctypes.c_long, ctypes.c_double,
            ctypes.POINTER(Call), ctypes.POINTER(Result),
        ]  # fmt: skip
        function.restype = None
    return loaded


def compiled_library(sources: list[Path], library: Path, *flags: str) -> Path:
    """Compile a library against the headers of the oracle."""
    quad = [] if platform.machine() in ("aarch64", "arm64") else ["-lquadmath"]  # long double has 113 bits on ARM
    command = ["gcc", "-std=gnu11", "-shared", "-fPIC", *flags, f"-I{HERE}", "-o", library, *sources, *quad, "-lm"]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"gcc failed:\n{done.stderr}")
    return library


def doubles(values: Iterable[Any]) -> Any:
    """An array of C doubles."""
    listed = [float(x) for x in values]
    return (ctypes.c_double * max(len(listed), 1))(*listed)


def model_of(yaml: str) -> _Model:
    """The numbers of a parameter file, read without the package."""
    data = YAML(typ="safe", pure=True).load(yaml)
    part = data["model"]
    pi = part["pi"]
    start = pi.get("initial_state", 0.0)
    stages = part.get("memoryless", [])
    stages = stages if isinstance(stages, list) else [stages]
    made = (_Stage * max(len(stages), 1))()
    for place, stage in zip(made, stages, strict=False):
        if stage["kind"] == "dead_zone":
            place.count = len(stage["thresholds"])
            place.threshold, place.weight = doubles(stage["thresholds"]), doubles(stage["weights"])
        else:
            up, down = stage["ascending"], stage.get("descending", stage["ascending"])
            place.a = (ctypes.c_double * 8)(*(float(b[k]) for b in (up, down) for k in ("a0", "a1", "a2", "a3")))
    listed = isinstance(start, list)
    low, high = data["input_range"]
    return _Model(
        len(pi["thresholds"]) - 1, doubles(pi["thresholds"]), doubles(pi["weights"]), int(listed),
        doubles(start if listed else [start]), len(stages), made, float(part.get("output_offset", 0.0)),
        float(low), float(high),
    )  # fmt: skip


def _shim(case: Case) -> str:
    """C that gives the oracle an emitted module's macros and functions, all in double."""
    name, macro = case.name, case.name.upper()
    fixed = KINDS[case.arithmetic] == 2
    ending = "_LSB" if fixed else ""
    lsbs = f"{macro}_DRIVE_LSB, {macro}_OUTPUT_LSB" if fixed else "1, 1"
    lines = [f'#include "{name}.c"', '#include "oracle.h"']
    inverse = case.inverse
    for op in ("forward", "inverse") if inverse else ("forward",):
        t = f"{name}_{op}_t"
        lines += [
            f"static void p_{name}_{op}_init(void *self) {{ {name}_{op}_init(({t} *)self); }}",
            f"static void p_{name}_{op}_reset(void *self, double x) "
            f"{{ {name}_{op}_reset(({t} *)self, ({name}_real_t)x); }}",
            f"static double p_{name}_{op}_step(void *self, double x) "
            f"{{ return (double){name}_{op}_step(({t} *)self, ({name}_real_t)x); }}",
            f"static unsigned p_{name}_{op}_status(void *self) {{ return {name}_{op}_status(({t} *)self); }}",
        ]
    if inverse:
        lines.append(
            f"static void p_{name}_commit(void *self, double x) "
            f"{{ {name}_inverse_commit(({name}_inverse_t *)self, ({name}_real_t)x); }}"
        )
    bounds = [f"{macro}_FORWARD_MAX_ERROR{ending}"]
    calls = [f"p_{name}_forward_{part}" for part in ("init", "reset", "step", "status")]
    sizes = [f"sizeof({name}_forward_t)"]
    if inverse:
        bounds += [f"{macro}_INVERSE_MAX_ERROR{ending}"]
        calls += [f"p_{name}_inverse_{part}" for part in ("init", "reset", "step")]
        calls += [f"p_{name}_commit", f"p_{name}_inverse_status"]
        sizes += [f"sizeof({name}_inverse_t)"]
    lines += [
        f"#ifdef {macro}_INVERSE_ROUNDING_ERROR{ending}",
        f"#define ROUNDING_{macro} {macro}_INVERSE_ROUNDING_ERROR{ending}",
        "#else",
        f"#define ROUNDING_{macro} {bounds[1] if inverse else 0}",
        "#endif",
        f"const oracle_probe_t {name}_probe = {{{KINDS[case.arithmetic]}, {macro}_DRIVE_MIN, {macro}_DRIVE_MAX, "
        f"{macro}_OUTPUT_MIN, {macro}_OUTPUT_MAX, {lsbs}, {bounds[0]}, {bounds[1] if inverse else 0}, "
        f"ROUNDING_{macro}, {sizes[0]}, {sizes[1] if inverse else 0}, "
        f"{', '.join(calls)}{'' if inverse else ', 0, 0, 0, 0, 0'}}};",
    ]
    return "\n".join(lines) + "\n"


def emit(case: Case, folder: Path) -> Case | None:
    """Write the C of a case. Returns what was emitted, None if its numbers do not fit the arithmetic."""
    path = folder / f"{case.name}.yaml"
    path.write_text(case.yaml)
    try:
        model = hystgen.load(path)
        try:
            hystgen.emit(model, folder, operator="both", arithmetic=case.arithmetic, engine=case.engine)
        except NotInvertibleError:
            hystgen.emit(model, folder, operator="forward", arithmetic=case.arithmetic, engine=case.engine)
            return Case(**{**vars(case), "inverse": False})
    except FormatError:
        return None
    return case


def follow(cases: list[Case], folder: Path, calls: int = CALLS, shrink: float = 1.0) -> Iterator[Finding]:
    """Compile emitted cases into one library and run the oracle on each; `shrink` scales every stated bound."""
    source, library = folder / "batch.c", folder / "batch.so"
    source.write_text("".join(map(_shim, cases)))
    compiled_library([source], library, "-O0", f"-I{folder}")  # -O0, since compiling takes most of the time
    loaded = ctypes.CDLL(str(library))
    oracle = _oracle()
    for case in cases:
        model, probe = model_of(case.yaml), _Probe.in_dll(loaded, f"{case.name}_probe")
        for op in ("forward", "inverse") if case.inverse else ("forward",):
            result = Result()
            run = oracle.oracle_forward if op == "forward" else oracle.oracle_inverse
            run(model, probe, case.seed, calls, shrink, None, result)
            yield Finding(case, op, result)


def follow_file(
    path: Path, arithmetic: str, engine: str, folder: Path, seeds: int, calls: int
) -> tuple[list[Finding], bool]:
    """Findings of a parameter file, run with several seeds, and whether it is refused."""
    text = path.read_text()
    name = YAML(typ="safe", pure=True).load(text)["name"]
    case = emit(Case(name, text, arithmetic, engine, 0), folder)
    if case is None:
        return [], True
    found: list[Finding] = []
    for seed in range(seeds):
        found += follow([Case(**{**vars(case), "seed": seed})], folder, calls)
    return found, False


def trace(case: Case, operator: str, calls: int) -> list[Call]:
    """Repeat a run and return its first `calls` calls."""
    with tempfile.TemporaryDirectory(prefix="hystgen-oracle-") as name:
        folder = Path(name)
        emit(case, folder)
        (folder / "one.c").write_text(_shim(case))
        compiled_library([folder / "one.c"], folder / "one.so", "-O0", f"-I{folder}")
        loaded = ctypes.CDLL(str(folder / "one.so"))
        log = (Call * calls)()
        oracle = _oracle()
        run = oracle.oracle_forward if operator == "forward" else oracle.oracle_inverse
        probe = _Probe.in_dll(loaded, f"{case.name}_probe")
        run(model_of(case.yaml), probe, case.seed, calls, 1.0, log, Result())
    return list(log)


@dataclass
class Tally:
    """Counts of one arithmetic and engine."""

    models: int = 0
    refused: int = 0
    inverses: int = 0
    samples: int = 0
    faulty: int = 0
    forward: float = 0.0
    single: float = 0.0
    own: float = 0.0
    same_branch: float = 0.0
    over: int = 0
    wrong: int = 0

    def add(self, finding: Finding) -> None:
        """Count a finding."""
        r = finding.result
        self.inverses += finding.operator == "inverse"
        self.samples += r.samples
        self.over += r.faults - r.wrong
        self.wrong += r.wrong
        self.forward = max(self.forward, r.worst_forward)
        self.single = max(self.single, r.worst_single)
        self.own = max(self.own, r.worst_own)
        self.same_branch = max(self.same_branch, r.worst_same_branch)


class EmitError(Exception):
    """Emission gave neither C nor a refusal; `finding` says what it raised."""

    def __init__(self, case: Case, error: Exception) -> None:
        super().__init__(str(error))
        said = f"emit raised {type(error).__name__}: {error}"
        self.finding = Finding(case, "emit", Result(wrong=1, message=said.encode()[:399]))


def drawn(seed: int, arithmetic: str, engine: str, folder: Path, tally: Tally) -> Case:
    """The first model of a seed that the package accepts, emitted into `folder`. Raises EmitError."""
    for attempt in range(MOST_TRIES):
        rng = np.random.default_rng([seed, attempt])
        name = f"m{seed}"
        case = Case(name, models.text(models.parameters(rng, arithmetic, name)), arithmetic, engine, seed)
        try:
            made = emit(case, folder)
        except Exception as error:
            raise EmitError(case, error) from error
        if made is not None:
            return made
        tally.refused += 1
    raise AssertionError(f"{MOST_TRIES} models of seed {seed} were refused in {arithmetic}")


def run(
    count: int, first: int = 0, combinations: tuple[tuple[str, str], ...] = COMBINATIONS, calls: int = CALLS,
    shrink: float = 1.0,
) -> tuple[dict[tuple[str, str], Tally], list[Finding]]:  # fmt: skip
    """Check models of seeds `first` .. `first + count - 1`, the combinations in turn. Returns counts and faults."""
    tallies = {combination: Tally() for combination in combinations}
    faults: list[Finding] = []
    for start in range(first, first + count, BATCH):
        with tempfile.TemporaryDirectory(prefix="hystgen-oracle-", ignore_cleanup_errors=True) as name:
            cases = []
            for seed in range(start, min(start + BATCH, first + count)):
                combination = combinations[seed % len(combinations)]
                tallies[combination].models += 1
                try:
                    cases.append(drawn(seed, *combination, Path(name), tallies[combination]))
                except EmitError as error:
                    faults.append(error.finding)
            for finding in follow(cases, Path(name), calls, shrink):
                tally = tallies[finding.case.arithmetic, finding.case.engine]
                tally.add(finding)
                if finding.result.faults:
                    faults.append(finding)
    for finding in {finding.case.seed: finding for finding in faults}.values():
        tallies[finding.case.arithmetic, finding.case.engine].faulty += 1
    return tallies, faults


def table(tallies: dict[tuple[str, str], Tally]) -> str:
    """Counts as text."""
    head = (
        f"{'arithmetic':<10} {'engine':<8} {'models':>6} {'refused':>7} {'inverses':>8} {'samples':>8} "
        f"{'faulty':>6} {'over':>7} {'wrong':>6}  worst error over bound: forward, memory as sent, own, same branch"
    )
    lines = [head]
    for (arithmetic, engine), t in tallies.items():
        lines.append(
            f"{arithmetic:<10} {engine:<8} {t.models:>6} {t.refused:>7} {t.inverses:>8} {t.samples:>8} {t.faulty:>6} "
            f"{t.over:>7} {t.wrong:>6}  {t.forward:.4g}, {t.single:.4g}, {t.own:.4g}, {t.same_branch:.4g}"
        )
    return "\n".join(lines)


def keep(faults: list[Finding], folder: Path) -> list[str]:
    """Write the model and the calls of every fault into `folder`. Returns a sentence for each."""
    folder.mkdir(parents=True, exist_ok=True)
    sentences = []
    for finding in faults:
        case, r = finding.case, finding.result
        stem = f"{case.name}_{case.arithmetic}_{case.engine}_{finding.operator}"
        (folder / f"{stem}.yaml").write_text(case.yaml)
        calls = [] if finding.operator == "emit" else trace(case, finding.operator, r.first + 1)
        words = ("init", "reset", "step", "commit")
        lines = [f"{words[call.call]},{call.x!r},{call.answer!r}" for call in calls]
        (folder / f"{stem}.csv").write_text("\n".join(["call,argument,answer", *lines]) + "\n")
        again = f"--arithmetic {case.arithmetic} --engine {case.engine} --first {case.seed} --models 1"
        sentences.append(
            f"{stem}: {r.faults} of {r.samples} calls, first {r.first}: {r.message.decode()} "
            f"(python -m tests.oracle {again})"
        )
    return sentences
