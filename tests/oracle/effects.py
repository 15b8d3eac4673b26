"""Models with effects, which the oracle follows in long runs: rests, slow ramps, steps, commits and held samples."""

from __future__ import annotations

import ctypes
import functools
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML

import hystgen
from hystgen.basics.problems import FormatError, UnsupportedEffectsError
from tests.oracle.check import HERE, KINDS, compiled_library, doubles

SAMPLES = 20_000
"""Calls of a run in `make check`; `python -m tests.oracle` takes a million."""

STEP, HELD, COMMIT, SETTLE, TEMPERATURE, PUSH = range(6)
AGES = {"logarithmic": 1, "exponential": 2}
SATURATES = {"tanh": 1, "hard": 2}


class _Probe(ctypes.Structure):
    _fields_ = ()


class _Model(ctypes.Structure):
    _fields_ = (
        ("n", ctypes.c_int), ("threshold", ctypes.POINTER(ctypes.c_double)),
        ("weight", ctypes.POINTER(ctypes.c_double)),
        *((name, ctypes.c_double) for name in ("start", "low", "high", "offset", "seconds", "rising", "falling")),
        ("creeps", ctypes.c_int), ("time_constant", ctypes.POINTER(ctypes.c_double)),
        ("share", ctypes.POINTER(ctypes.c_double)),
        ("ages", ctypes.c_int),
        *((name, ctypes.c_double) for name in ("loss", "travel", "gain_per_degree", "offset_per_degree", "reference")),
        ("saturates", ctypes.c_int),
        *((name, ctypes.c_double) for name in ("level", "centre", "drift", "delay", "lag")),
        ("elements", ctypes.c_int), ("part", ctypes.POINTER(ctypes.c_double)),
        ("width", ctypes.POINTER(ctypes.c_double)),
        *((name, ctypes.c_double) for name in ("exponent", "balance")),
        ("tilt", ctypes.POINTER(ctypes.c_double)),
    )  # fmt: skip


class Call(ctypes.Structure):
    """One call, as in `effects.h`."""

    _fields_ = (("call", ctypes.c_int), ("x", ctypes.c_double))


class Result(ctypes.Structure):
    """What a run of one operator has found, as in `effects.h`."""

    _fields_ = (
        *((name, ctypes.c_long) for name in ("samples", "limited", "faults")),
        *((name, ctypes.c_double) for name in ("worst_forward", "worst_seen", "worst_own", "worst_ahead")),
        ("first", ctypes.c_long), ("message", ctypes.c_char * 400),
    )  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A model with effects, and the arithmetic to emit it in."""

    name: str
    data: dict[str, Any]
    arithmetic: str

    @property
    def effects(self) -> dict[str, dict[str, Any]]:
        """The effects by name."""
        return {each["name"]: each for each in self.data["model"]["effects"]}

    @property
    def ahead(self) -> int:
        """Number of samples by which references are ahead of the motion."""
        late = self.effects.get("delay", {}).get("time", 0.0) / self.data["sample_time"]
        return int(np.ceil(late))


@dataclass
class Tally:
    """Counts of one arithmetic."""

    models: int = 0
    refused: int = 0
    samples: int = 0
    limited: int = 0
    faulty: int = 0
    worst: dict[str, float] = field(default_factory=lambda: dict.fromkeys(("forward", "seen", "own", "ahead"), 0.0))
    sentences: list[str] = field(default_factory=list)
    effects: dict[str, int] = field(default_factory=dict)

    def add(self, case: Case, operator: str, result: Result) -> None:
        """Count a run."""
        self.samples += result.samples
        self.limited += result.limited
        self.faulty += result.faults > 0
        for name in self.worst:
            self.worst[name] = max(self.worst[name], getattr(result, f"worst_{name}"))
        if result.faults:
            said = result.message.decode()
            self.sentences.append(
                f"{case.name}_{case.arithmetic}, {operator}: {result.faults} faults in {result.samples} samples, first "
                f"at call {result.first}: {said}\n{text(case.data)}"
            )


@functools.cache
def _oracle() -> ctypes.CDLL:
    folder = tempfile.mkdtemp(prefix="hystgen-oracle-")
    loaded = ctypes.CDLL(str(compiled_library([HERE / "effects.c"], Path(folder) / "effects.so", "-O2", "-Wall")))
    shutil.rmtree(folder)
    for function in (loaded.effects_forward, loaded.effects_inverse):
        function.argtypes = [
            ctypes.POINTER(_Model), ctypes.POINTER(_Probe), ctypes.POINTER(Call), ctypes.c_long, ctypes.c_double,
            ctypes.POINTER(Result),
        ]  # fmt: skip
        function.restype = None
    return loaded


def model_of(case: Case) -> _Model:
    """The numbers of a case."""
    pi, effects = case.data["model"]["pi"], case.effects
    low, high = case.data["input_range"]
    slew, creep, ageing = effects.get("slew_limit", {}), effects.get("creep", {}), effects.get("ageing", {})
    thermal, saturation = effects.get("thermal", {}), effects.get("saturation", {})
    elements = effects.get("bouc_wen", {})
    return _Model(
        len(pi["thresholds"]) - 1, doubles(pi["thresholds"]), doubles(pi["weights"]),
        pi.get("initial_state", 0.0), low, high,
        case.data["model"].get("output_offset", 0.0), case.data["sample_time"], slew.get("rate", 0.0),
        slew.get("falling_rate", slew.get("rate", 0.0)),
        len(creep.get("time_constants", ())), doubles(creep.get("time_constants", ())),
        doubles(creep.get("weights", ())),
        AGES[ageing.get("shape", "logarithmic")] if ageing else 0, ageing.get("loss", 0.0), ageing.get("travel", 1.0),
        thermal.get("gain_per_degree", 0.0), thermal.get("offset_per_degree", 0.0), thermal.get("reference", 0.0),
        SATURATES[saturation.get("shape", "tanh")] if saturation else 0, saturation.get("level", 1.0),
        saturation.get("centre", 0.0), effects.get("drift", {}).get("rate", 0.0),
        effects.get("delay", {}).get("time", 0.0), effects.get("lag", {}).get("time_constant", 0.0),
        len(elements.get("weights", ())), doubles(elements.get("weights", ())), doubles(elements.get("widths", ())),
        elements.get("exponent", 1.0), elements.get("balance", 1.0),
        doubles(elements["tilts"]) if "tilts" in elements else None,
    )  # fmt: skip


def drawn(seed: int, arithmetic: str) -> Case:
    """A model of plays and random effects: most occur in half of the models, a limited rate in three of four, elements
    in two of five."""
    rng = np.random.default_rng([seed, 53])
    seconds = float(10.0 ** rng.uniform(-5.0, -2.0))
    low, span = float(rng.choice([0.0, -50.0, -3.0])), float(10.0 ** rng.uniform(0.0, 2.0))
    n = int(rng.integers(0, 6))
    thresholds = [0.0, *np.sort(rng.uniform(0.01, 0.5, n) * span).tolist()]
    weights = [float(rng.uniform(0.05, 1.0)), *(float(x) for x in rng.uniform(0.0, 0.3, n))]
    effects: list[dict[str, Any]] = []
    size = sum(weights) * (max(abs(low), abs(low + span)))
    if rng.random() < 0.75:  # crossing the range takes from 100 to millions of samples
        rate = span / seconds / 10.0 ** rng.uniform(2.0, 6.5)
        effects.append({"name": "slew_limit", "rate": float(rate)})
        if rng.random() < 0.5:
            effects[-1]["falling_rate"] = float(rate * 10.0 ** rng.uniform(-1.0, 0.3))
    chances = rng.random(7) < 0.5
    if chances[0]:
        k = int(rng.integers(1, 4))
        taus = [float(x) for x in seconds * 10.0 ** np.sort(rng.uniform(1.0, 6.0, k))]
        effects.append({"name": "creep", "time_constants": taus, "weights": [float(x) for x in rng.uniform(0, 0.1, k)]})
    if chances[1]:
        kind = str(rng.choice(["logarithmic", "exponential"]))
        travel = float(span * 10.0 ** rng.uniform(1.0, 3.0))
        effects.append({"name": "ageing", "shape": kind, "loss": float(rng.uniform(0, 0.05)), "travel": travel})
    if chances[2]:
        warm = {"gain_per_degree": float(rng.uniform(-2e-3, 2e-3)), "offset_per_degree": float(1e-3 * size)}
        effects.append({"name": "thermal", **warm, "reference": 20.0})
    if chances[3]:
        effects.append({"name": "saturation", "level": float(size * rng.uniform(1.6, 5.0))})
    if chances[4]:
        effects.append({"name": "drift", "rate": float(size * rng.uniform(-1, 1) * 1e-7 / seconds)})
    if chances[5]:
        effects.append({"name": "delay", "time": float(seconds * rng.uniform(0.2, 8.0))})
    elif chances[6] and effects[:1] and effects[0]["name"] != "slew_limit":
        effects.append({"name": "lag", "time_constant": float(seconds * 10.0 ** rng.uniform(0.0, 1.5))})
    if not effects:
        effects.append({"name": "drift", "rate": float(size * 1e-7 / seconds)})
    data = {
        "hystgen": 1, "name": f"m{seed}", "sample_time": seconds, "input_range": [low, low + span],
        "model": {"pi": {"thresholds": thresholds, "weights": weights, "initial_state": low}, "effects": effects},
    }  # fmt: skip
    if rng.random() < 0.5:
        data["model"]["output_offset"] = float(size * rng.uniform(-0.3, 0.3))
    data["emit"] = {"compensation": {"compensate": ["drift"]}}
    if rng.random() < 0.4:
        k, balance = int(rng.integers(1, 4)), float(rng.uniform(0.5, 2.0))
        room = weights[0] / (k * 2.0 * balance)  # right after a turn, an element's slope is up to 2 b times its weight
        parts = [float(x) for x in room * rng.uniform(-0.8, 1.6, k)]
        widths = [float(x) for x in span * 10.0 ** rng.uniform(-1.3, 0.0, k)]
        keys = {"weights": parts, "widths": widths, "exponent": float(rng.choice([1.0, 2.0])), "balance": balance}
        if rng.random() < 0.5:  # with tilted drives, whose slope right after a turn is up to 2
            middle, share = low + 0.5 * span, rng.uniform(-0.9, 0.9, k)
            leans = share / np.maximum(0.5 * span + np.array(widths), abs(middle))  # about the middle of the range
            parts = (np.array(parts) * balance * (1.0 - leans * middle) / (1.0 + np.abs(share))).tolist()
            tilts = (leans / (1.0 - leans * middle)).tolist()
            keys = {"shape": "duhem", "weights": parts, "widths": widths, "tilts": tilts}
        effects.append({"name": "bouc_wen", **keys})
    return Case(f"m{seed}", data, arithmetic)


def text(data: dict[str, Any]) -> str:
    """The parameter file; JSON is YAML if its numbers have a point."""
    return "\n".join(f"{key}: {_flow(value)}" for key, value in data.items()) + "\n"


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    written = repr(value) if isinstance(value, float) else str(value)
    return written.replace("e", ".0e") if isinstance(value, float) and "." not in written else written


def read(path: Path, arithmetic: str) -> Case:
    """A case of a parameter file, read without the package."""
    data = YAML(typ="safe", pure=True).load(path.read_text())
    return Case(data["name"], data, arithmetic)


def emit(case: Case, folder: Path) -> bool:
    """Write the C of a case. Returns False if its numbers do not fit or its noise gain is above the default limit."""
    path = folder / f"{case.name}.yaml"
    path.write_text(text(case.data))
    try:
        hystgen.emit(hystgen.load(path), folder, operator="both", arithmetic=case.arithmetic, engine="auto")
    except (FormatError, UnsupportedEffectsError):
        return False
    return True


def _shim(case: Case) -> str:
    """C that gives the oracle an emitted module's macros and functions, all in double."""
    name, macro, fixed = case.name, case.name.upper(), KINDS[case.arithmetic] == 2
    ending = "_LSB" if fixed else ""
    lines = [f'#include "{name}.c"', '#include "effects.h"']
    lacking = ("temperature" * ("thermal" not in case.effects), "push" * (not case.ahead))

    def wrapped(op: str, call: str, result: str, *arguments: str) -> str:
        """Name of a function that passes a call on, or 0 if the module lacks the call."""
        if call in lacking:
            return "0"
        t, own = f"{name}_{op}_t", f"p_{name}_{op}_{call}"
        named = "set_temperature" if call == "temperature" else call
        given = "".join(f", {each}" for each in arguments)
        passed = ", ".join([f"({t} *)self", *(f"({name}_real_t)x" for _ in arguments)])
        back = "" if result == "void" else f"return ({result})"
        lines.append(f"static {result} {own}(void *self{given}) {{ {back}{name}_{op}_{named}({passed}); }}")
        return own

    x = "double x"
    forward = [wrapped("forward", "init", "void"), wrapped("forward", "step", "double", x),
               wrapped("forward", "temperature", "void", x)]  # fmt: skip
    inverse = [wrapped("inverse", "init", "void"), wrapped("inverse", "step", "double", x),
               *(wrapped("inverse", call, "void", x) for call in ("push", "commit", "settle", "temperature")),
               wrapped("inverse", "status", "unsigned")]  # fmt: skip
    bounds = [f"{macro}_FORWARD_MAX_ERROR{ending}", f"BOUND_{macro}"]
    numbers = [
        str(KINDS[case.arithmetic]), f"{macro}_DRIVE_MIN", f"{macro}_DRIVE_MAX", f"{macro}_OUTPUT_MIN",
        f"{macro}_OUTPUT_MAX", *([f"{macro}_DRIVE_LSB", f"{macro}_OUTPUT_LSB"] if fixed else ["1", "1"]),
        f"{macro}_MAX_RATE", *bounds, f"ROUNDING_{macro}", f"sizeof({name}_forward_t)",
        f"sizeof({name}_inverse_t)", *forward, *inverse,
    ]  # fmt: skip
    lines += [
        f"#ifdef {macro}_INVERSE_ROUNDING_ERROR{ending}",
        f"#define ROUNDING_{macro} {macro}_INVERSE_ROUNDING_ERROR{ending}",
        f"#elif defined {macro}_INVERSE_MAX_ERROR{ending}",
        f"#define ROUNDING_{macro} {macro}_INVERSE_MAX_ERROR{ending}",
        "#else",  # a bound above ten times the measured error is not stated, so this one is stricter
        f"#define ROUNDING_{macro} (10.0 * {macro}_INVERSE_MEASURED_ERROR{ending})",
        "#endif",
        f"#ifdef {macro}_INVERSE_MAX_ERROR{ending}",
        f"#define BOUND_{macro} {macro}_INVERSE_MAX_ERROR{ending}",
        "#else",
        f"#define BOUND_{macro} ((double){macro}_DRIVE_MAX - {macro}_DRIVE_MIN)",
        "#endif",
        f"const effects_probe_t {name}_probe = {{{', '.join(numbers)}}};",
    ]
    return "\n".join(lines) + "\n"


def calls(case: Case, seed: int, samples: int, inverse: bool) -> NDArray[Any]:
    """Calls of an operator within the range of its argument: rests, slow ramps, ramps faster than the drive may be,
    steps and a sine, with commits, held samples, temperatures and settled drives among them."""
    rng = np.random.default_rng([seed, samples])
    low, high = case.data["input_range"]
    ends = (low, high)
    if inverse:
        ends = _reachable(case)
    pieces: list[NDArray[np.float64]] = []
    at, left = float(rng.uniform(*ends)), samples
    while left > 0:
        length = min(int(samples * 10.0 ** rng.uniform(-2.5, -0.6)) + 1, left)
        to, kind = float(rng.uniform(*ends)), int(rng.integers(4))
        if kind == 0:
            piece = np.full(length, to if "slew_limit" in case.effects else at)
        elif kind == 1:
            piece = at + (to - at) * np.arange(1, length + 1) / max(length, 400)
        elif kind == 2:
            piece = np.full(length, at)
        else:
            piece = at + 0.5 * (to - at) * (1.0 - np.cos(np.arange(length) * 2.0 * np.pi / max(length / 3, 2000.0)))
        pieces.append(piece)
        at, left = float(piece[-1]), left - length
    x = np.concatenate(pieces)
    pushed = case.ahead if inverse else 0
    marks = set(rng.integers(1, samples, max(samples // 4000, 4)).tolist())
    named = "slew_limit" in case.effects
    rows = np.zeros(pushed + len(x) + 2 * len(marks), dtype=Call)
    rows[:pushed] = (PUSH, x[0])
    k = pushed
    begin = 0
    for mark in [*sorted(marks), len(x)]:
        count = mark - begin
        rows["call"][k : k + count] = STEP
        rows["x"][k : k + count] = x[begin:mark]
        k, begin = k + count, mark
        if mark == len(x):
            break
        turn = int(rng.integers(4))
        if inverse and turn == 0 and named:
            rows[k] = (COMMIT, float(rng.uniform(low, high)))
            k += 1
        if inverse and turn < 2 and KINDS[case.arithmetic] != 2:
            rows[k] = (HELD, 0.0)
            k += 1
        if inverse and turn == 2 and named:
            rows[k] = (SETTLE, float(rng.uniform(low, high)))
            k += 1
        if turn == 3 and "thermal" in case.effects and KINDS[case.arithmetic] != 2:
            rows[k] = (TEMPERATURE, float(np.float32(rng.uniform(0.0, 40.0))))
            k += 1
    return rows[:k]


def _reachable(case: Case) -> tuple[float, float]:
    """The inner nine tenths of the displacements that the plays reach at rest; the module limits others."""
    pi, (low, high) = case.data["model"]["pi"], case.data["input_range"]
    effects = case.effects
    rest = 1.0 + sum(effects.get("creep", {}).get("weights", ()))
    offset = case.data["model"].get("output_offset", 0.0)
    level = effects.get("saturation", {}).get("level", 0.0)

    def output(w: float) -> float:
        pairs = zip(pi["thresholds"], pi["weights"], strict=True)
        y = rest * sum(p * (w if r == 0.0 else min(max(low, w - r), w + r)) for r, p in pairs)
        return offset + (level * float(np.tanh(y / level)) if level else y)

    elements = effects.get("bouc_wen", {})
    parts = zip(elements.get("weights", ()), elements.get("widths", ()), strict=True)
    beside = rest * sum(abs(weight) * width for weight, width in parts)
    bottom, top = output(low) + beside, output(high) - beside
    return (bottom + 0.05 * (top - bottom), top - 0.05 * (top - bottom)) if bottom < top else (top, bottom)


def follow(cases: list[Case], folder: Path, seed: int, samples: int, shrink: float = 1.0) -> Iterator[
    tuple[Case, str, Result]
]:  # fmt: skip
    """Compile emitted cases into one library and run the oracle on both operators of each."""
    source = folder / "batch.c"
    source.write_text("".join(map(_shim, cases)))
    loaded = ctypes.CDLL(str(compiled_library([source], folder / "batch.so", "-O1", f"-I{folder}")))
    oracle = _oracle()
    for case in cases:
        model, probe = model_of(case), _Probe.in_dll(loaded, f"{case.name}_probe")
        for operator in ("forward", "inverse"):
            rows = calls(case, seed, samples, operator == "inverse")
            result = Result()
            run = oracle.effects_forward if operator == "forward" else oracle.effects_inverse
            run(model, probe, rows.ctypes.data_as(ctypes.POINTER(Call)), len(rows), shrink, result)
            yield case, operator, result


def run(
    count: int, first: int, arithmetics: tuple[str, ...] = tuple(KINDS), samples: int = SAMPLES
) -> dict[str, Tally]:
    """Follow models of seeds `first` .. `first + count - 1` in each arithmetic."""
    tallies = {arithmetic: Tally() for arithmetic in arithmetics}
    for arithmetic, tally in tallies.items():
        with tempfile.TemporaryDirectory(prefix="hystgen-oracle-", ignore_cleanup_errors=True) as name:
            folder = Path(name)
            cases = [case for seed in range(first, first + count) if emit(case := drawn(seed, arithmetic), folder)]
            tally.models, tally.refused = len(cases), count - len(cases)
            for case in cases:
                for effect in case.effects:
                    tally.effects[effect] = tally.effects.get(effect, 0) + 1
            for case, operator, result in follow(cases, folder, first, samples) if cases else ():
                tally.add(case, operator, result)
    return tallies


def table(tallies: dict[str, Tally]) -> str:
    """Counts as text."""
    lines = [
        f"{'arithmetic':<10} {'models':>6} {'refused':>7} {'samples':>9} {'limited':>9} {'faulty':>6}  worst "
        "error over bound: forward, memory as sent, own, ahead of the amplifier"
    ]
    for arithmetic, t in tallies.items():
        worst = ", ".join(f"{t.worst[name]:.4g}" for name in ("forward", "seen", "own", "ahead"))
        lines.append(
            f"{arithmetic:<10} {t.models:>6} {t.refused:>7} {t.samples:>9} {t.limited:>9} {t.faulty:>6}  {worst}"
        )
    total: dict[str, int] = {}
    for t in tallies.values():
        for effect, number in t.effects.items():
            total[effect] = total.get(effect, 0) + number
    return "\n".join([*lines, "models with " + ", ".join(f"{name} {total[name]}" for name in sorted(total))])
