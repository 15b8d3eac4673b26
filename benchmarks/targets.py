"""Instructions per sample on microcontroller cores, counted by emulation.

    python benchmarks/targets.py [--n 16,128] [--targets cortex-m4f] [--compilers zig,gcc] [-o FOLDER] [--check]
    python benchmarks/targets.py --parts FOLDER/targets.csv ... [-o FOLDER] [--check]

Emitted code of both engines and operators is compared with the textbook loop (`textbook/textbook.c`: formula (35) as
ternaries with the same care for NaN, range and status), built by the same compiler with the same flags (-std=c99 -O2)
and run on the same signal, a decaying multisine over the range. For the corner engine a worst case is constructed as
well: corner lists of every shape, including the deepest, then a sample that gives the next one more work (`ways`), then
jumps to all positions; neighbours of the most expensive of these; and the same with a NaN, an infinity or a `commit`
before the jump (`interrupted`). A NaN or infinity right after a commit, which repeats the answer before the commit, is
counted separately. So is a drive range that begins at 0, where the plays rest, as with most piezo drives: references
may then need a drive below the range, and some fixed sequences in which rounding decides that are run as well. All
answers counted are compared with the bit-exact reference.

Writes `targets.csv` and `targets.svg`. With `--check` the exit code is 1 if a goal is missed. A run over all plays,
cores and arithmetics takes hours: `--parts` joins the tables of shorter runs.
"""

from __future__ import annotations

import argparse
import csv
import functools
import itertools
import math
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import ARITHMETICS
from hystgen.compensator import fixed_tables, float_tables
from hystgen.compensator.reference import Session
from hystgen.emission.calls import emit_options
from hystgen.emission.text import operand, table
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays import slots
from hystgen.verification import comparison, compilers, cross, emulator, sources, targets

HERE = Path(__file__).resolve().parent
PLAYS = (4, 8, 16, 32, 64, 128, 256)
SAMPLES = 4000
SEARCHED = 200_000  # samples per round of the search for the worst case
# Trials of at least this many samples are searched separately. `trials` makes 600 of them from random turns; with 4 and
# 16 plays no other trial has more than 18 samples, with 128 plays there are corner lists on either side
LONG = 100
# [trials] Number of the most expensive trials whose neighbours the next round tries. For the inverse of 8 plays in
# float32 on a Cortex-M4F, 10, 30 and 90 all find 293 instructions, in 53, 64 and 173 s (`Bench._worst_trials`), so 30
# is three times the number needed and takes little more time
KEPT = 30
RANGE = 10.0  # half of the drive range
MEANS = {"fine": lambda: multisine(20000), "coarse": lambda: multisine(2000), "walk": lambda: walk(5000)}
"""Further signals for the corner engine's mean: a multisine in finer and coarser steps, and a random walk."""
BEHIND = "no number behind a commit"
FROM_0 = "worst case, range from 0"
# References for a range from 0, each after a reset to 0. They come within a few units in the last place of a move that
# ends at the lower limit, so rounding decides; earlier code solved such moves twice. They are the most expensive of
# many random sequences, and no corner list of the search leads to them
TIES = (
    "18.7375355 5.10948849 10.1918678 2.848948 10.0517645 4.80538797 7.58872414 commit 0.270970821 nan 3.26073146",
    "0.011223905 22.659855 5.7992496 1.043483 8.7496727 4.1068497 3.5384128 4.7950592 3.5384142",
    "0 26.1248283 3.68277431",
    "0 11.1450024 2.08836651 2.16130733",
    "0 28.8489723 3.55617619",
)
# C types of numbers and of sums in the textbook loop
TYPES = {
    "float32": ("float", "float"),
    "float64": ("double", "double"),
    "q31": ("int32_t", "int64_t"),
    "q15": ("int16_t", "int32_t"),
}
Reals = NDArray[np.float64]


@dataclass(frozen=True)
class Figures:
    """One build, with instructions per sample (mean and max over a signal) and bytes."""

    target: str
    compiler: str
    arithmetic: str
    operator: str
    engine: str
    n: int
    signal: str
    samples: int
    mean: float
    max: int
    flash: int
    library: int
    ram: int
    stack: int


KINDS = {name: {"str": str, "int": int, "float": float}[str(kind)] for name, kind in Figures.__annotations__.items()}


@dataclass(frozen=True)
class Case:
    """What identifies a build."""

    target: targets.Target
    compiler: str
    n: int
    operator: str
    arithmetic: str
    middle: float = 0.0  # of the range of the drive

    @property
    def in_software(self) -> bool:
        """Whether floating point is computed by function calls, whose cost depends on the numbers."""
        return self.arithmetic in REALS and not (self.target.fpu and self.arithmetic == "float32")

    @property
    def model(self) -> Model:
        """The model that is built."""
        return model(self.n, self.middle)


@functools.cache
def model(n: int, middle: float = 0.0) -> Model:
    """A model with n thresholds up to nine tenths of RANGE and falling weights, like identified ones."""
    thresholds = np.linspace(0.0, 0.9 * RANGE, n + 1)
    weights = np.concatenate([[0.7], 2.4 / n * np.exp(-thresholds[1:] / 5)])
    text = (
        f"hystgen: 1\nname: bench\ninput_range: [{middle - RANGE}, {middle + RANGE}]\nmodel:\n  pi:\n"
        f"    thresholds: {thresholds.tolist()}\n    weights: {weights.tolist()}\n"
    )
    return Model(parse_parameters(text, "bench.yaml"))


def multisine(samples: int, stride: int = 1) -> Reals:
    """Decaying multisine as a fraction of RANGE, every `stride`-th of `samples`.

    The mean cost of a corner list depends on how finely the drive is sampled, since samples in which another play
    begins to follow are the expensive ones: with 4000 samples the middle line has 160 per period.
    """
    t = np.arange(0, samples, stride) / samples
    lines = ((9, 0.6, 0.0), (25, 0.3, 1.0), (41, 0.1, 2.0))
    x = np.exp(-3 * t) * sum(a * np.sin(2 * np.pi * f * t + phase) for f, a, phase in lines)
    return np.asarray(x / np.max(np.abs(x)))


def walk(samples: int) -> Reals:
    """Random walk as a fraction of RANGE: the sine of a sum of normally distributed steps of 0.02 (seed 0).

    Over the range of -10 to 10 a step is about 0.2, and every other one turns. `verify` runs a walk of the same kind.
    """
    return np.asarray(np.sin(np.cumsum(np.random.default_rng(0).normal(0.0, 0.02, samples))))


def together(records: Sequence[Reals]) -> tuple[Any, Reals]:
    """Operations and arguments that run drive records one after another, each from a reset."""
    x = np.concatenate([np.append(record[0], record) for record in records])
    call = np.full(len(x), slots.OP_STEP, dtype=np.uint8)
    call[np.cumsum([0, *(len(record) + 1 for record in records[:-1])])] = slots.OP_RESET
    return call, x


def from_drive(case: Case, drive: Reals, call: Any = None) -> Reals:
    """Inputs of the operator that give the plays the input `drive`, measured from the middle of the range.

    In a range from 0, references of the inverse continue beyond its ends with the slope of the first weight.
    """
    drive = case.middle + drive
    if case.operator == "forward":
        return drive
    cascade = case.model.cascade
    session = Session(cascade, "forward")
    x = session.run(drive)[0] if call is None else session.operate(call, drive)[0]
    return np.asarray(x + cascade.pi.weights[0] * (drive - np.clip(drive, *cascade.input_range)) * bool(case.middle))


def blocks(n: int) -> Iterator[list[int]]:
    """Sizes of the blocks in a corner list, the one with the largest thresholds first: equal blocks of 1, 2, 4 .. n
    plays, and a large block among single plays, since a search bisects the blocks first and then the plays in a
    block."""
    size = 1
    while size <= n:
        yield [size] * (n // size)
        size *= 2
    for large in sorted({n // 4, n // 2, 3 * n // 4} - {0, 1}):
        for above in sorted({0, (n - large) // 2, n - large}):
            yield [1] * above + [large] + [1] * (n - large - above)


def corner_lists(n: int) -> Iterator[Reals]:
    """Drives that leave a corner list: swings that move every play, or rest, then turning points of a shrinking
    oscillation, each of which leaves a block behind; and the same drives upside down. No jump can wipe out the whole
    list left by full swings, but one can after shorter swings or from rest."""
    r = np.asarray(model(n).cascade.pi.thresholds)
    for sizes in blocks(n):
        turns = n - np.cumsum(sizes[:-1])
        swing = np.array([r[k] + r[k + 1] for k in turns])  # moves play k but not the next one
        swing[1::2] *= -1
        lists = [np.concatenate([[RANGE, -RANGE], np.cumsum(swing) - RANGE])]
        if len(turns):
            halved = swing.copy()
            halved[0] /= 2  # a play follows after its threshold from rest, after twice its threshold from a turn
            lists.append(np.append(0.0, np.cumsum(halved)))
        short = np.array([1.8 * r[k] + 0.2 * r[k + 1] for k in turns])
        short = short[short < 1.5 * RANGE]
        short[1::2] *= -1
        lists.append(np.concatenate([[RANGE, -RANGE / 2], np.cumsum(short) - RANGE / 2]))
        for points in lists:
            yield points
            yield -points


def activations(case: Case, points: Reals) -> Reals:
    """Drives beyond which a move from the last of `points` moves another play, by formula (35); ascending."""
    r = np.asarray(model(case.n).cascade.pi.thresholds)[1:]
    plays = np.full(case.n, -case.middle)
    for x in np.clip(points, -RANGE, RANGE):
        plays = np.maximum(x - r, np.minimum(x + r, plays))
    return np.unique(np.concatenate([plays - r, plays + r]).round(9))


def thinned(x: Reals, most: int) -> Reals:
    """At most `most` of the values, both ends included."""
    return x[np.linspace(0, len(x) - 1, min(most, len(x))).round().astype(int)]


def landings(case: Case, points: Reals, most: int = 129) -> Reals:
    """Drives to which moves from the last of `points` move different plays; the outermost lie beyond the range."""
    ends = RANGE * np.array([-1.01, 1.01, *([-1.1, -1.5] if case.middle else [])])
    between = np.unique(np.concatenate([ends[:2], np.clip(activations(case, points), -RANGE, RANGE)]))
    return np.concatenate([ends, thinned((between[1:] + between[:-1]) / 2, most - len(ends))])


def trials(case: Case) -> Iterator[Reals]:
    """Every corner list followed by a jump; the search for the jump's end is the work of one sample."""
    # first, uneven blocks, which no rule makes, from random turning points: small among large, few or many
    rng = np.random.default_rng(11)
    for size in [*rng.integers(4, 12, 2000), *[LONG] * 600]:
        turns = rng.uniform(-RANGE, RANGE, size) * rng.choice([1.0, 0.5, 0.1], size)
        if size < LONG:
            yield np.concatenate([[RANGE, -RANGE], turns])  # after full swings
        yield turns  # and without full swings
    for points in corner_lists(case.n):
        for jump in landings(case, points, 2000 // case.n + 20):
            yield np.append(points, jump)


def ways(case: Case, points: Reals, hair: float) -> Iterator[Reals]:
    """Further steps from `points` after which the next sample has more work before its own search.

    A sample is fast if the previous one ended where its search had led. That fails if the previous one went back to the
    corner it came from, with no play following in between; if it asked for less than a `hair`, the finest step of the
    drive, so that rounding left the answer in place or moved it back; if it met a limit; and if rounding carried the
    answer onto or across an activation point, at once or when the same reference came again.
    """
    at, on = points[-1], 1.0 if len(points) < 2 else np.sign(points[-1] - points[-2])
    first = model(case.n).cascade.pi.thresholds[1]
    yield np.array([at - on * first])
    yield np.array([at - on * first, at - on * first / 2])
    for part in (0.5, 1.0, 1.5):
        yield np.array([at + part * hair])
        yield np.array([at - part * hair])
    yield np.array([1.01 * RANGE])
    yield np.array([-1.01 * RANGE])
    for a in thinned(activations(case, points), 8):
        for times in (1, 2):
            yield np.full(times, a - np.sign(a - at) * hair / 4)


def longer(case: Case, trial: Reals, hair: float) -> Iterator[Reals]:
    """A trial with one of the `ways` before its jump, for several ends of the jump."""
    for way in ways(case, trial[:-1], hair):
        points = np.concatenate([trial[:-1], way])
        for jump in landings(case, points, 9):
            yield np.append(points, jump)


def neighbours(case: Case, trial: Reals, hair: float) -> Iterator[Reals]:
    """Variants of a trial: its last points alone, which may be all that matters; slightly different numbers, on which
    the cost of software floating point depends; another of its last points; and the `longer` trials."""
    for length in (4, 8, 16, 32, 64):
        if length < len(trial):
            yield trial[-length:]
    rng = np.random.default_rng(13)
    for size in np.geomspace(1.0, 1e-4, 90) * model(case.n).cascade.pi.thresholds[1]:
        yield trial + rng.uniform(-size, size, len(trial))
    for place in range(-1, -min(5, len(trial)), -1):
        for jump in landings(case, trial[:place], 65):
            other = trial.copy()
            other[place] = jump
            yield other
    yield from longer(case, trial, hair)


def alternating(found: Sequence[Iterable[Reals]]) -> Iterator[Reals]:
    """The first item of each, then the second of each, and so on."""
    return (x for row in itertools.zip_longest(*found) for x in row if x is not None)


def within(most: int, found: Iterable[Reals]) -> list[Reals]:
    """The first trials, with at most `most` samples in total."""
    kept = []
    for trial in found:
        most -= len(trial) + 1
        if most < 0:
            break
        kept.append(trial)
    return kept


REALS = ("float32", "float64")


@functools.cache
def lsbs(case: Case) -> tuple[float, float]:
    """Drive and output per code; 1 in floating point."""
    if case.arithmetic in REALS:
        return 1.0, 1.0
    form = fixed_tables.build(case.model.cascade, case.arithmetic, "corners", None, None)[1]
    return float(form.drive_lsb), float(form.output_lsb)


def given(case: Case, drive: Reals, coarser: int = 1, call: Any = None) -> Any:
    """Inputs of the operator, in its arithmetic, that give plays the input `drive`; codes are `coarser` times the
    finest."""
    x = from_drive(case, drive, call)
    real = ARITHMETICS[case.arithmetic].number
    if real.kind != "i":
        return x.astype(real)
    codes = np.rint(x / lsbs(case)[case.operator == "inverse"] / coarser)
    return np.clip(codes, np.iinfo(real).min, np.iinfo(real).max).astype(real)


def interrupted(case: Case, found: Sequence[Reals]) -> tuple[Any, Any, list[int]]:
    """Operations, arguments in the operator's arithmetic, and the end of each trial, for trials interrupted before
    their jump.

    Interruptions are a NaN or infinity; a commit of the drive before the jump, with or without a step elsewhere ahead
    of it; and both: a step to the end of the jump, the commit, a NaN that repeats the answer before the commit, and a
    step on from there.
    """
    odd = [np.nan, np.inf, -np.inf] if ARITHMETICS[case.arithmetic].number.kind == "f" else []
    paths: list[Reals] = []  # drives at the plays, from which the references of the inverse follow
    for trial in found:
        paths += [trial, np.append(trial[:-2], trial[-1])]
        paths += [np.append(trial, on) for on in (trial[-2], -trial[-1])]
    call, drive = together(paths)
    asked = iter(np.split(given(case, drive, call=call), np.cumsum([len(path) + 1 for path in paths[:-1]])))
    step, commit = slots.OP_STEP, slots.OP_COMMIT
    operations: list[int] = []
    arguments: list[Any] = []
    ends = []

    def add(head: Any, *tail: tuple[int, Any]) -> None:
        operations.extend([slots.OP_RESET, *[step] * (len(head) - 1), *(op for op, _ in tail)])
        arguments.extend([*head, *(x for _, x in tail)])

    for trial in found:
        jump, aside, *on = itertools.islice(asked, 4)
        for x in odd:
            add(jump[:-1], (step, x), (step, jump[-1]))
        if case.operator == "inverse" and len(trial) > 2:
            applied = (case.middle + trial[-2]) / lsbs(case)[0]
            add(jump[:-2], (step, aside[-1]), (commit, applied), (step, jump[-1]))
            add(jump[:-2], (commit, applied), (step, jump[-1]))
            for x, (*_, last) in itertools.product(odd, on):
                add(jump[:-2], (step, aside[-1]), (commit, applied), (step, x), (step, last))
        ends.append(len(operations))
    real = ARITHMETICS[case.arithmetic].number
    x = np.array(arguments)
    if real.kind == "i":
        x = np.clip(np.rint(x), np.iinfo(real).min, np.iinfo(real).max)
    return np.array(operations, dtype=np.uint8), x.astype(real), ends


def ties() -> tuple[Any, Any]:
    """Operations and arguments of TIES."""
    operations: list[int] = []
    arguments: list[float] = []
    for trial in TIES:
        words = trial.replace("commit ", "commit=").split()
        operations += [slots.OP_RESET, *(slots.OP_COMMIT if "=" in w else slots.OP_STEP for w in words)]
        arguments += [0.0, *(float(w.rpartition("=")[2]) for w in words)]
    return np.array(operations, dtype=np.uint8), np.array(arguments, dtype=np.float32)


def behind_commit(call: Any, x: Any) -> Any:
    """Whether each operation is a step to a NaN or infinity right after a commit."""
    return (call == slots.OP_STEP) & ~np.isfinite(x) & (np.roll(call, 1) == slots.OP_COMMIT)


def plain(case: Case, found: Sequence[Reals]) -> tuple[Any, Any, list[int]]:
    """Operations, arguments and the end of each trial, for uninterrupted trials."""
    call, drive = together(found)
    return call, given(case, drive, call=call), list(np.cumsum([len(trial) + 1 for trial in found]))


Form = Callable[[Case, Sequence[Reals]], tuple[Any, Any, list[int]]]
"""Function that returns operations, arguments and the end of each trial, given the trials."""


class Bench:
    """Builds, runs and counts in its own folder; remembers the worst trials found."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._number = itertools.count()
        self._emitted: dict[tuple[int, str, str, float], sources.Sources] = {}
        self._images: dict[tuple[Case, str], emulator.Image] = {}
        self._worst: dict[Case, list[Reals]] = {}
        self._worst_odd: dict[tuple[Case, bool], list[Reals]] = {}

    def image(self, case: Case, engine: str) -> emulator.Image:
        """A strict build of emitted code with both operators, built once, or of the textbook loop with one."""
        if engine == "textbook":
            return self._build(case, self._textbook(case))
        about = replace(case, operator="both"), engine
        if about not in self._images:
            self._images[about] = self._build(case, self._module(case, engine))
        return self._images[about]

    def _build(self, case: Case, files: sources.Sources) -> emulator.Image:
        compiler = cross.find(case.target, case.compiler)
        place = self._folder / f"build-{next(self._number)}"
        entry = f"hystgen_harness_{files.operators[0]}"
        return emulator.Image.load(compiler.image(files, place, compilers.STRICT, cross.MemoryMap(), entry))

    def _module(self, case: Case, engine: str) -> sources.Sources:
        about = (case.n, engine, case.arithmetic, case.middle)
        if about not in self._emitted:
            options = emit_options(case.model, "both", case.arithmetic, engine)
            folder = self._folder / f"{engine}-{case.arithmetic}-{case.n}-{case.middle:g}"
            self._emitted[about] = sources.write(folder, case.model, options)
        return self._emitted[about]

    def _textbook(self, case: Case) -> sources.Sources:
        """The loop with its tables; in fixed point, codes are twice as coarse, so that the sum of two fits."""
        folder = self._folder / f"textbook-{next(self._number)}"
        folder.mkdir()
        cascade = case.model.cascade
        forward = case.operator == "forward"
        pi = cascade.pi if forward else cascade.pi.inverse()
        real, total = TYPES[case.arithmetic]
        ends = (cascade.input_range, cascade.output_range)
        sizes = f"#define TEXTBOOK_REAL {real}\n#define TEXTBOOK_SUM {total}\n#define TEXTBOOK_N_PLAYS {case.n}\n"
        if case.arithmetic in ("q31", "q15"):
            drive, output = (2 * lsb for lsb in lsbs(case))
            into, out = (drive, output) if forward else (output, drive)
            # bits of the sum without its sign, minus those of a number and those of the steepest gain
            gain = sum(abs(p) for p in pi.weights) * into / out
            fraction = (62 if case.arithmetic == "q31" else 30) - (30 if case.arithmetic == "q31" else 14)
            fraction -= max(0, math.ceil(math.log2(gain))) + 1
            weights = [round(p * into / out * 2**fraction) for p in pi.weights]
            thresholds = [round(r / into) for r in pi.thresholds]
            limits = [[int(end / lsb) for end in pair] for pair, lsb in zip(ends, (drive, output), strict=True)]
            sizes += f"#define TEXTBOOK_FRACTION {fraction}\n"
            kind = "int32_t"
        else:
            dtype = np.dtype(case.arithmetic).type
            weights, thresholds = ([dtype(x) for x in numbers] for numbers in (pi.weights, pi.thresholds))
            limits = [list(float_tables.inward(*pair, dtype)) for pair in ends]
            sizes += f"#define TEXTBOOK_REAL_MAX {'FLT' if dtype is np.float32 else 'DBL'}_MAX\n"
            kind = "textbook_real_t"
        names = ("INPUT_MIN", "INPUT_MAX", "OUTPUT_MIN", "OUTPUT_MAX")
        values = itertools.chain(*(limits if forward else limits[::-1]))
        text = "".join(f"#define TEXTBOOK_{name} {operand(end)}\n" for name, end in zip(names, values, strict=True))
        text += table(kind, "textbook_weight", weights) + table("textbook_real_t", "textbook_threshold", thresholds)
        (folder / "textbook_tables.h").write_text(text)
        (folder / "textbook_sizes.h").write_text(sizes)
        (folder / "hystgen_harness.c").write_text(sources.harness("textbook", ("forward",)))
        for file in ("textbook.h", "textbook.c"):
            (folder / file).write_text((HERE / "textbook" / file).read_text())
        return sources.Sources("textbook", ("forward",), (folder / "textbook.c",), folder / "hystgen_harness.c")

    def textbook(self, case: Case, drive: Reals) -> Figures:
        """The textbook loop over a drive, the multisine; its answers are compared with the double model."""
        image = self.image(case, "textbook")
        core = emulator.Core(case.target, image)
        x = given(case, drive, 2)
        answer, _ = core.run("textbook", "forward", np.full(len(x), slots.OP_STEP, dtype=np.uint8), x)
        cascade = case.model.cascade
        forward = case.operator == "forward"
        into, out = (2 * lsb for lsb in (lsbs(case) if forward else lsbs(case)[::-1]))
        if case.arithmetic in REALS:
            into = out = 1.0
        exact = (cascade if forward else cascade.inverse()).simulate(x * into, clamp=True)
        assert np.max(np.abs(answer * out - exact)) < (1e-3 if case.arithmetic != "q15" else 1e-2) * RANGE
        return figures_of(case, "textbook", "multisine", core, image)

    def engine(self, case: Case, engine: str, drive: Reals) -> Figures:
        """Emitted code over a drive, the multisine."""
        image = self.image(case, engine)
        x = given(case, drive)
        return figures_of(case, engine, "multisine", self.run(case, image, engine, x), image)

    def worst(self, case: Case) -> list[Figures]:
        """The corner engine over the worst trials; separately, if there are any, a NaN or infinity right after a
        commit, and calls of `commit`."""
        image = self.image(case, "corners")
        stack = 0
        steps, returns, calls = [], [], []
        best = self._worst_trials(case)
        forms: list[tuple[Form, bool]] = [(plain, False)]
        odd, inverse = ARITHMETICS[case.arithmetic].number.kind == "f", case.operator == "inverse"
        if odd or inverse:
            forms.append((interrupted, False))
        if odd and inverse:
            forms.append((interrupted, True))
        if inverse and case.arithmetic == "float32" and case.middle == RANGE:
            calls.append(ties())
        for form, behind in forms:
            if form is interrupted:
                best = self._worst_interrupted(case, behind)
            calls.append(form(case, best)[:2])
        for call, x in calls:
            core = self.run(case, image, "corners", x, call)
            returning = behind_commit(call, x)[call == slots.OP_STEP]
            steps.append(core.counts[~returning])
            returns.append(core.counts[returning])
            stack = max(stack, core.stack)
        found = [figures_of(case, "corners", "worst case", core, image, np.concatenate(steps), stack)]
        if sum(map(len, returns)):
            found.append(figures_of(case, "corners", BEHIND, core, image, np.concatenate(returns), stack))
        if inverse:
            core = self.run(case, image, "corners", x, call, "commit")
            found.append(figures_of(case, "corners", "commit", core, image, stack=stack))
        return found

    def run(
        self,
        case: Case,
        image: emulator.Image,
        engine: str,
        x: Any,
        call: Any = None,
        counted: str = "step",
    ) -> emulator.Core:
        """A core after the steps `x`, or the operations `call`, with answers already compared with the reference."""
        numbers = case.model.tables(case.arithmetic, engine)
        calls = ("signal", np.full(len(x), slots.OP_STEP, dtype=np.uint8) if call is None else call, x)
        real = ARITHMETICS[case.arithmetic].number
        record = comparison.expected_record(numbers, real, case.operator == "inverse", calls)
        core = emulator.Core(case.target, image)
        run = functools.partial(core.run, "bench", case.operator, counted=counted)
        outcome = comparison.compare(run, [record])
        assert not outcome.different, f"{case}, {engine}: {outcome}"
        return core

    def _worst_trials(self, case: Case) -> list[Reals]:
        """The trials with the most expensive samples on a Cortex-M4F or, for cores without FPU, on a Cortex-M0+; other
        cores differ little. Constructed trials come first, then neighbours of the most expensive."""
        case = self._searched(case)
        if case not in self._worst:
            real = ARITHMETICS[case.arithmetic].number
            hair = lsbs(case)[0] if real.kind == "i" else RANGE * float(np.finfo(real).eps)
            most, rounds = self._most(case), 6
            if case.arithmetic == "float64":  # slow to run, and takes the same paths
                classes, rounds = [self._worst_trials(replace(case, arithmetic="float32"))], 1
            else:
                found = within(SEARCHED // (1 + (most < SEARCHED)), trials(case))
                classes = [[x for x in found if (len(x) < LONG) == short] for short in (True, False)]
            self._worst[case] = []
            for found in classes:  # separately, as the most expensive long trials would crowd out short ones
                if rounds > 1:
                    _, found = self._dearest(case, found, 20)
                    found += within(most, alternating([longer(case, trial, hair) for trial in found]))
                self._worst[case] += self._better(case, found, rounds, most, hair, plain)
        return self._worst[case]

    def _worst_interrupted(self, case: Case, behind: bool) -> list[Reals]:
        """Like `_worst_trials`, but for interrupted trials and the worst uninterrupted ones; `behind`: ranked by a NaN
        or infinity right after a commit, otherwise by all other samples."""
        case = self._searched(case)
        if (case, behind) not in self._worst_odd:
            real = ARITHMETICS[case.arithmetic].number
            hair = lsbs(case)[0] if real.kind == "i" else RANGE * float(np.finfo(real).eps)
            most = self._most(case) // 8  # each trial has several forms
            best = list(self._worst_trials(case))
            if case.arithmetic == "float64":
                best += self._worst_interrupted(replace(case, arithmetic="float32"), behind)
            else:
                every = max(1, sum(len(trial) for trial in trials(case)) // most)
                best += within(most, itertools.islice(trials(case), None, None, every))
            rounds = 1 if case.arithmetic == "float64" else 3
            self._worst_odd[case, behind] = self._better(case, best, rounds, most, hair, interrupted, behind)
        return self._worst_odd[case, behind]

    @staticmethod
    def _searched(case: Case) -> Case:
        return replace(case, target=targets.find("cortex-m4f" if case.target.fpu else "cortex-m0plus"))

    @staticmethod
    def _most(case: Case) -> int:
        """Samples per round of the search: fewer if floating point is computed in software."""
        return SEARCHED // (2 if case.in_software else 1)

    def _better(
        self, case: Case, best: list[Reals], rounds: int, most: int, hair: float, form: Form, behind: bool = False
    ) -> list[Reals]:
        """The most expensive of the trials and their neighbours, searched while neighbours are more expensive."""
        before, (dear, best) = 0, self._dearest(case, best, KEPT, form, behind)
        for _ in range(rounds):
            if dear == before:
                break
            before, near = dear, alternating([neighbours(case, trial, hair) for trial in best])
            dear, best = self._dearest(case, [*best, *within(most, near)], KEPT, form, behind)
        return best

    def _dearest(
        self, case: Case, found: list[Reals], number: int, form: Form = plain, behind: bool = False
    ) -> tuple[int, list[Reals]]:
        """Instructions of the most expensive sample, and the `number` most expensive trials, the worst first; of trials
        that jump from the same points, only one is kept."""
        call, x, ends = form(case, found)
        counts = np.zeros(len(call))
        counts[call == slots.OP_STEP] = self.run(case, self.image(case, "corners"), "corners", x, call).counts
        counts[behind_commit(call, x) != behind] = 0
        dear = [int(part.max()) for part in np.split(counts, ends[:-1])]
        kept: dict[bytes, Reals] = {}
        for i in np.lexsort(([len(trial) for trial in found], -np.array(dear))):  # shorter ones first among equals
            kept.setdefault(found[i][:-1].tobytes(), found[i])
        return max(dear), list(kept.values())[:number]


def figures_of(
    case: Case,
    engine: str,
    signal: str,
    core: emulator.Core,
    image: emulator.Image,
    counts: Any = None,
    stack: int | None = None,
) -> Figures:
    """A row of figures; `counts` and `stack` are those of the core unless given."""
    counts = core.counts if counts is None else counts
    return Figures(
        target=case.target.name,
        compiler=case.compiler,
        arithmetic=case.arithmetic,
        operator=case.operator,
        engine=engine,
        n=case.n,
        signal=signal,
        samples=len(counts),
        mean=round(float(counts.mean()), 1),
        max=int(counts.max()),
        flash=image.sections[".module"],
        library=image.sections.get(".library", 0),
        ram=core.call(f"hystgen_harness_{'forward' if engine == 'textbook' else case.operator}_size"),
        stack=core.stack if stack is None else stack,
    )


def measure(
    plays: Sequence[int],
    chosen: Sequence[targets.Target],
    names: Sequence[str],
    arithmetics: Sequence[str],
    samples: int,
) -> list[Figures]:
    """Figures for all combinations; compilers that are not installed are skipped with a message."""
    found: list[Figures] = []
    with tempfile.TemporaryDirectory(prefix="hystgen-bench-") as folder:
        bench = Bench(Path(folder))
        for target, compiler in itertools.product(chosen, names):
            try:
                cross.find(target, compiler)
            except compilers.MissingError as error:
                print(f"left out: {error}", file=sys.stderr)
                continue
            for n, arithmetic in itertools.product(plays, arithmetics):
                began = time.monotonic()
                # The loop visits every play in every sample: fewer samples give the same figure sooner
                all_of_it = RANGE * multisine(samples)
                some = all_of_it if target.fpu else RANGE * multisine(samples, stride=max(1, min(n, samples // 100)))
                for operator in ("forward", "inverse"):
                    case = Case(target, compiler, n, operator, arithmetic)
                    found.append(bench.textbook(case, some))
                    found.append(bench.engine(case, "loop", some))
                    found.append(bench.engine(case, "corners", all_of_it))
                    if operator == "inverse":
                        for signal, made in MEANS.items():
                            found.append(replace(bench.engine(case, "corners", RANGE * made()), signal=signal))
                    found += bench.worst(case)
                    if operator == "inverse" and arithmetic == "float32" and target.fpu:
                        from_0 = bench.worst(replace(case, middle=RANGE))[0]
                        found.append(replace(from_0, signal=FROM_0))
                seconds = time.monotonic() - began
                print(f"{target.name} {compiler} {arithmetic} n = {n}: {seconds:.1f} s", file=sys.stderr)
    return found


def read(paths: Iterable[Path]) -> list[Figures]:
    """The figures in written tables, in the order of a run that measures all of them."""
    found = []
    for path in paths:
        with path.open(newline="", encoding="ascii") as file:
            for row in csv.DictReader(file):
                found.append(Figures(**{name: KINDS[name](text) for name, text in row.items()}))
    place = {name: i for i, name in enumerate((*targets.NAMES, *cross.NAMES, *TYPES))}
    return sorted(found, key=lambda f: (place[f.target], place[f.compiler], f.n, place[f.arithmetic]))


def key(f: Figures) -> tuple[Any, ...]:
    """What identifies a row of the table."""
    return f.target, f.compiler, f.arithmetic, f.operator, f.n


def table_text(figures: Iterable[Figures]) -> str:
    """A row for each operator and n: mean / max over the multisine, and the worst cases, including those for a NaN
    after a commit, a range from 0 and a commit."""
    rows: dict[tuple[Any, ...], dict[str, Figures]] = {}
    for f in figures:
        rows.setdefault(key(f), {})[f.engine if f.signal == "multisine" else f.signal] = f
    head = ("target", "compiler", "arithmetic", "operator", "n", "textbook", "loop", "corners", "worst", "NaN",
            "from 0", "commit", "flash", "library", "RAM", "stack", "textbook/corners")  # fmt: skip
    lines = [head]
    for about, row in rows.items():
        text, corners = row["textbook"], row["corners"]
        lines.append(
            (
                *map(str, about),
                f"{text.mean:.0f} / {text.max}",
                f"{row['loop'].mean:.0f} / {row['loop'].max}",
                f"{corners.mean:.1f} / {corners.max}",
                str(row["worst case"].max),
                *(str(row[what].max) if what in row else "" for what in (BEHIND, FROM_0, "commit")),
                str(corners.flash),
                str(corners.library),
                str(corners.ram),
                str(max(corners.stack, row["worst case"].stack)),
                f"{text.mean / corners.mean:.1f}",
            )
        )
    columns = []
    for i, words in enumerate(zip(*lines, strict=True)):
        width = max(map(len, words))
        columns.append([word.ljust(width) if i < 4 else word.rjust(width) for word in words])
    return "\n".join("  ".join(words) for words in zip(*columns, strict=True))


GOALS: dict[int, dict[str, float]] = {
    16: {"fine": 28, "coarse": 42, "walk": 112, "worst case": 340, FROM_0: 440, BEHIND: 440, "commit": 440},
    128: {"fine": 32, "coarse": 51, "walk": 136, "worst case": 400, FROM_0: 425, BEHIND: 500, "commit": 500},
}
"""Instructions of a float32 inverse on a Cortex-M4F, by number of plays: means over the signals in MEANS, and the most
expensive samples of the others. In a range from 0, moves end at a limit."""


def goals(figures: Iterable[Figures]) -> list[tuple[str, float, float]]:
    """Goals for the inverse, each with its description, the figure and the largest value allowed."""
    found = {(f.target, f.compiler, f.engine, f.n, f.signal, f.arithmetic): f for f in figures
             if f.operator == "inverse"}  # fmt: skip

    def get(
        target: str, engine: str, n: int, signal: str = "multisine", arithmetic: str = "float32"
    ) -> Figures | None:
        return found.get((target, compiler, engine, n, signal, arithmetic))

    wanted = []
    for compiler in cross.NAMES:
        for n, most in GOALS.items():
            for signal, limit in most.items():
                f = get("cortex-m4f", "corners", n, signal)
                if f:
                    figure = f.mean if signal in MEANS else f.max
                    wanted.append((f"cortex-m4f {compiler} n = {n}: {signal}", figure, limit))
        for arithmetic, limit in (("float32", 480), ("q31", 200)):
            if f := get("cortex-m0plus", "corners", 16, "fine", arithmetic):
                wanted.append((f"cortex-m0plus {compiler} {arithmetic} n = 16: fine", f.mean, limit))
    return wanted


def plot(figures: Sequence[Figures], path: Path) -> None:
    """Instructions of zig's q31 inverse against n, a panel for each core: textbook loop, both engines, worst case."""
    import matplotlib as mpl

    mpl.use("Agg")
    mpl.rcParams["svg.hashsalt"] = "hystgen"  # so that equal figures give equal files
    import matplotlib.pyplot as plt

    names, plays = list(dict.fromkeys(f.target for f in figures)), sorted({f.n for f in figures})
    high, wide = -(-len(names) // 3), min(3, len(names))
    panels, axes = plt.subplots(high, wide, figsize=(1 + 3.3 * wide, 3.6 * high), squeeze=False, layout="constrained")
    lines = (
        ("float32", "textbook", "multisine", "mean", "textbook loop", "0.45", "-"),
        ("float32", "loop", "multisine", "mean", "engine loop", "tab:orange", "-"),
        ("float32", "corners", "worst case", "max", "engine corners, worst sample", "tab:blue", "--"),
        ("float32", "corners", "multisine", "mean", "engine corners, mean", "tab:blue", "-"),
        ("q31", "textbook", "multisine", "mean", "textbook loop, q31", "0.45", ":"),
        ("q31", "corners", "multisine", "mean", "engine corners, mean, q31", "tab:green", "-"),
    )
    for ax, name in zip(axes.flat, names, strict=False):
        for arithmetic, engine, signal, what, label, colour, style in lines:
            points = [
                (f.n, getattr(f, what)) for f in figures
                if (f.target, f.compiler, f.operator, f.engine, f.signal, f.arithmetic)
                == (name, "zig", "inverse", engine, signal, arithmetic)
            ]  # fmt: skip
            if points:
                ax.loglog(*zip(*points, strict=True), style, color=colour, marker="o", markersize=3, label=label)
        ax.set_title(name)
        ax.set_xticks(plays, [str(n) for n in plays], minor=False)
        ax.minorticks_off()
        ax.set_xlabel("plays n")
        ax.grid(alpha=0.3)
    for row in axes:
        row[0].set_ylabel("instructions per sample")
    for ax in list(axes.flat)[len(names) :]:
        ax.set_visible(False)
    panels.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    panels.suptitle("Inverse in float32, and where said in q31; zig -O2, decaying multisine")
    panels.savefig(path, metadata={"Date": None})
    plt.close(panels)


def main() -> int:
    """Measure, write, print; with --check, the exit code says whether the goals are met."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--n", default=",".join(map(str, PLAYS)), help="plays, comma separated")
    cores = ",".join(core.name for core in targets.TARGETS)
    parser.add_argument("--targets", default=cores, help="cores, comma separated")
    parser.add_argument("--compilers", default=",".join(cross.NAMES), help="zig, gcc")
    parser.add_argument("--arithmetics", default="float32,float64,q31,q15", help="comma separated")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="of the multisine")
    parser.add_argument("--parts", type=Path, nargs="+", help="measure nothing, but put these tables together")
    parser.add_argument("-o", "--output", type=Path, help="folder for targets.csv and targets.svg")
    parser.add_argument("--check", action="store_true", help="exit 1 where a goal is missed")
    wanted = parser.parse_args()
    figures = read(wanted.parts) if wanted.parts else measure(
        [int(n) for n in wanted.n.split(",")],
        [targets.find(name) for name in wanted.targets.split(",")],
        wanted.compilers.split(","),
        wanted.arithmetics.split(","),
        wanted.samples,
    )
    print(table_text(figures))
    missed = False
    for words, figure, most in goals(figures):
        missed = missed or figure > most
        print(f"{words}: {figure:.0f}, at most {most:.0f}: {'met' if figure <= most else 'MISSED'}")
    if wanted.output:
        wanted.output.mkdir(parents=True, exist_ok=True)
        with (wanted.output / "targets.csv").open("w", newline="", encoding="ascii") as file:
            writer = csv.DictWriter(file, [field.name for field in fields(Figures)])
            writer.writeheader()
            writer.writerows(asdict(f) for f in figures)
        plot(figures, wanted.output / "targets.svg")
    return int(wanted.check and missed)


if __name__ == "__main__":
    sys.exit(main())
