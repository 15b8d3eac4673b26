"""Learning from the recorded tracking of a repeated reference: a better model, or a corrected reference.

Iterative learning in the reference: u_(j+1) = u_j + L e_j with e_j = wanted - measured, behind a compensator that is
left as it is (Bristow, Tharayil, Alleyne, IEEE Control Systems Magazine 26(3), 2006; van Meer et al. 2025 learn the
remainder of a piezo stepper in the same way). The plant P from reference to displacement is about 1 there, so L is a
gain and an advance, a Wiener factor that keeps noise out, and a zero-phase low-pass.
"""

from __future__ import annotations

import csv
import io
import itertools
import json
import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from hystgen.basics import arguments, parallel
from hystgen.basics.problems import counted
from hystgen.diagnosis.search import selection
from hystgen.identification.pi import IdentificationError
from hystgen.model import Model, ModelSource, as_model
from hystgen.records import Record, RecordError, Source, in_units, read_record, read_records, several, write_atomically
from hystgen.service import refining, sessions

Array = NDArray[np.float64]

REFERENCE = "u"
"""The column of the reference that the compensator was given."""

GAMMA = 0.7
"""[fraction of the error] Largest |1 - L P|, uncertainty included, in the band that is known: five passes then leave
0.7^5 = 17 % at worst. Half of it is for P's distance from its estimate, half for the interpolation between bands."""

SURE = 2.0
"""[standard deviations] Uncertainty of P that is counted: 95 %."""

BANDS = 3
"""[per octave] Bands in which P and the noise are estimated."""

SAME = 1e-5
"""[fraction of the reference's range] Two references that differ by less are the same. They are commanded numbers, so
only their digits in a file are rounded; a correction is larger. Derived: a 16-bit converter's step is 1.5e-5."""

STEP = 1e-3
"""[fraction] Sample times that differ by less are the same."""

TRIED = 0.5
"""[fraction] Above the frequency up to which P is known, L goes on with half of the gain. The error does not rise there
while P is within a factor of 2 and 60 degrees of its value below, |1 - 0.5 * 2 exp(j 60 deg)| = 1, and the next pass
shows whether it did."""

LEAST_TRIED, MOST_TRIED, BEYOND = 2.0 ** (1 / 3), 3.2, 2.1
"""[times the last known frequency, the same, times the lowest] L is tried up to the next odd harmonic of a triangle, or
the next band, unless a mode may double P before: one that explains how far P is from gain and delay at the last known
frequency, by d, does so at sqrt((1 + d) / (2 d)) times this frequency. Bands further apart than three times, the first
two harmonics of a triangle, are not interpolated."""

SMOOTHED = 15
"""[lines] The noise of a line is the mean over this many, known to 1/sqrt(15) = 26 % with two repetitions."""

ABOVE = 3.0
"""[times the noise's power] Lines of the error below this are not learned: 5 % of those of noise alone are above."""

STRONG = 1e-6
"""[fraction of the power] Lines below this say nothing about gain and delay, and an improvement below this is none."""

SCHEMA_ID = "urn:hystgen:refine:1"


class _Written(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PassEntry(_Written):
    """Repetitions of one reference: rms of wanted minus measured, of their mean and of a single one, and rms of what
    differs from repetition to repetition; output units."""

    records: tuple[str, ...]
    rms: float = Field(description="rms of the mean error over the repetitions")
    noise: float = Field(description="rms by which a repetition differs from their mean")
    floor: float = Field(description="rms of the mean error that noise alone would leave")


class ModelEntry(_Written):
    """The refit of the model: rms error of a repetition that took no part in it."""

    accepted: bool
    before: float | None = None
    after: float | None = None
    why: str


class CorrectionEntry(_Written):
    """The learning filter L, and why it converges."""

    gamma: float = Field(description="largest |1 - L P| in the band, 95 % uncertainty of P included")
    band: float = Field(description="Hz up to which the records show P")
    explored: float = Field(description="Hz up to which L tries half, while P is within a factor 2 and 60 degrees")
    gain: float = Field(description="of P")
    delay: float = Field(description="s; of P")
    expected: float = Field(description="rms error to expect of the next pass, output units")
    above: float = Field(description="rms of the last pass's error above `band`, output units")
    change: float = Field(description="rms by which the correction moves the reference, output units")


class Learning(_Written):
    """What `hystgen refine --json` writes."""

    hystgen: Literal[1] = 1
    verdict: Literal["model_improved", "reference_corrected", "at_noise_floor", "not_convergent"]
    unit: str
    passes: tuple[PassEntry, ...]
    model: ModelEntry
    correction: CorrectionEntry | None
    stop: bool = Field(description="whether a further pass would be of no use")
    advice: tuple[str, ...]


def schema() -> dict[str, object]:
    """JSON Schema (2020-12) of the report."""
    made = Learning.model_json_schema(mode="serialization")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": SCHEMA_ID, **made}


@dataclass(frozen=True)
class Pass:
    """R repetitions of one reference of N samples: `given` (N,) to the compensator, `measured` (R, N)."""

    names: tuple[str, ...]
    given: Array
    measured: Array

    @property
    def mean(self) -> Array:
        """Mean motion (N,)."""
        return np.asarray(self.measured.mean(axis=0))

    @property
    def variance(self) -> Array:
        """Variance of the lines of the mean's spectrum, each from `SMOOTHED` lines around it."""
        r = len(self.measured)
        lines = np.sum(np.abs([_lines(each - self.mean) for each in self.measured]) ** 2, axis=0) / (r - 1) / r
        around = np.ones(min(SMOOTHED, len(lines)))
        known = np.ones(len(lines))
        known[0] = 0.0  # the mean is taken out
        return np.asarray(np.convolve(lines, around, "same") / np.convolve(known, around, "same"))

    @property
    def noise(self) -> float:
        """rms by which a repetition differs from the expected mean, output units."""
        r = len(self.measured)
        return float(np.sqrt(np.mean((self.measured - self.mean) ** 2) * r / (r - 1)))

    @property
    def floor(self) -> float:
        """rms of the mean that noise alone makes."""
        return self.noise / math.sqrt(len(self.measured))


@dataclass(frozen=True, repr=False)
class Learned:
    """What the passes teach. `refined`: the better model, None if none is; `reference`: the corrected reference (N,),
    None where learning stops; `t`: its times in s; `error`: wanted minus mean motion
    of the last pass (N,), about its mean."""

    report: Learning
    t: Array = field(compare=False)
    error: Array = field(compare=False)
    refined: refining.Refined | None = field(default=None, compare=False)
    reference: Array | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        return f"<Learned: {self.report.verdict}, rms {self.report.passes[-1].rms:.3g} {self.report.unit}>".rstrip()

    def to_json(self) -> str:
        """The report as JSON."""
        return json.dumps(self.report.model_dump(mode="json"), indent=2) + "\n"

    def table(self) -> str:
        """A line for each pass, then sentences on the model, the correction and what to do next."""
        u = f" {self.report.unit}".rstrip()
        lines = [
            f"pass {k}: rms error {each.rms:.4g}{u} over {counted(len(each.records), 'repetition')}; noise alone would "
            f"leave {each.floor:.3g}{u}"
            for k, each in enumerate(self.report.passes, 1)
        ]
        lines.append(f"model: {self.report.model.why}")
        if (c := self.report.correction) is not None:
            lines.append(
                f"correction: up to {c.band:.4g} Hz |1 - L P| <= {c.gamma:.2f} < 1, so the error there falls by at "
                f"least this factor a pass until the noise; above lies {c.above:.3g}{u} of it, and up to "
                f"{c.explored:.4g} Hz half is tried; expected rms error of the next pass {c.expected:.3g}{u}"
            )
        return "\n".join([*lines, *self.report.advice])

    def correction_text(self) -> str:
        """The corrected reference as CSV, columns t and u. Raises ValueError where learning stops."""
        if self.reference is None:
            raise ValueError("there is no correction to write: " + " ".join(self.report.advice))
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        rows.writerow(["t", REFERENCE])
        rows.writerows((f"{t:.10g}", f"{u:.10g}") for t, u in zip(self.t, self.reference, strict=True))
        return text.getvalue()

    def write_correction(self, path: str | os.PathLike[str]) -> None:
        """Write the corrected reference completely or not at all. Raises ValueError, OSError."""
        write_atomically(path, self.correction_text())


@arguments.checked
def refine(
    parameters: ModelSource,
    records: Source | Iterable[Source],
    *,
    reference: Source | None = None,
    columns: dict[str, str] | None = None,
    sample_time: float | None = None,
    delimiter: str | None = None,
    history: Sequence[float] | None = None,
    rest: float = 0.0,
    refit: bool = True,
    progress: bool = False,
) -> Learned:
    """Learn from the recorded tracking of a repeated reference.

    `records`: one for each repetition, in the order in which they were made, with the reference `u` that the
    compensator was given, the drive `v` and the measured displacement `y`. `reference`: a record whose column `u` is
    the wanted motion, if the references given were corrected ones; by default the reference that all records share.
    At least two repetitions of the last reference are needed, since their difference is the noise. The model is
    refitted to all repetitions but the last, and taken only if it predicts that one better: then there is no corrected
    reference, since it would be one for another compensator. `refit=False` leaves the model alone. `history`, `rest`:
    as for `diagnose`. Raises RecordError, ParameterError, ValueError, TypeError.
    """
    model = as_model(parameters)
    given = several(records)
    read = read_records(given, columns, sample_time, delimiter, progress=progress, points=True)
    read = in_units(read, model.parameters.units, sources=given)
    own = None
    if reference is not None:
        own = reference if isinstance(reference, Record) else read_record(
            reference, columns=columns, sample_time=sample_time, delimiter=delimiter, need=(REFERENCE,)
        )
    wanted = checked(read, own)
    passes = grouped(read, float(np.ptp(wanted)))
    t = np.asarray(read[0].t - read[0].t[0])
    refined, entry = None, ModelEntry(accepted=False, why="kept as it is, as asked")
    if refit:
        refined, entry = _refitted(model, read, passes[-1].noise, history, rest)
    return learned(t, wanted, passes, refined, entry, model.parameters.units.output)


def checked(read: Sequence[Record], own: Record | None) -> Array:
    """The wanted motion (N,). Raises RecordError with every problem."""
    wrong = []
    first = read[0]
    step = first.sample_time
    for each in read:
        if each.y is None:
            wrong.append(f"{each.name}: error: column y, the measured displacement, is missing; record it")
        if REFERENCE not in each.extra:
            wrong.append(
                f"{each.name}: error: column {REFERENCE}, the reference that the compensator was given, is missing; "
                f"record it, or name it with --columns {REFERENCE}=NAME"
            )
        if not each.timed:
            wrong.append(f"{each.name}: error: has no times; add a column t, or give --sample-time")
        if len(each) != len(first):
            wrong.append(
                f"{each.name}: error: has {len(each)} samples and {first.name} has {len(first)}; repetitions have to "
                "begin and end at the same places, so cut them alike"
            )
        elif abs(each.sample_time / step - 1.0) > STEP:
            wrong.append(f"{each.name}: error: is sampled every {each.sample_time:g} s, not {step:g} s; resample it")
    if wrong:
        raise RecordError(wrong)
    span = float(np.ptp(first.extra[REFERENCE]))
    if not span > 0.0:
        raise RecordError([f"{first.name}: error: the reference does not move; give a scan"])
    if own is not None:
        wanted = np.asarray(own.extra.get(REFERENCE, own.v), dtype=np.float64)
        if len(wanted) != len(first):
            raise RecordError([
                f"{own.name}: error: the wanted reference has {len(wanted)} samples, the records {len(first)}; give "
                "the one that was corrected, at the same sample time"
            ])
        return wanted
    far = [each for each in read if np.max(np.abs(each.extra[REFERENCE] - first.extra[REFERENCE])) > SAME * span]
    if far:
        raise RecordError([
            f"{each.name}: error: its reference is another one than that of {first.name}; give the wanted one with "
            "--reference if these are corrections of it, otherwise refine each reference by itself" for each in far
        ])
    return np.asarray(first.extra[REFERENCE], dtype=np.float64)


def grouped(read: Sequence[Record], span: float) -> list[Pass]:
    """Consecutive records with one reference. Raises RecordError unless the last one was repeated."""
    groups: list[list[Record]] = []
    for each in read:
        if groups and np.max(np.abs(each.extra[REFERENCE] - groups[-1][0].extra[REFERENCE])) <= SAME * span:
            groups[-1].append(each)
        else:
            groups.append([each])
    if len(groups[-1]) < 2:
        raise RecordError([
            f"{groups[-1][0].name}: error: its reference was recorded once, so noise and error cannot be told apart; "
            "record the same reference at least twice"
        ])
    return [
        Pass(
            tuple(each.name for each in group), np.asarray(group[0].extra[REFERENCE], dtype=np.float64),
            np.array([each.y for each in group], dtype=np.float64),
        )
        for group in groups if len(group) > 1
    ]


def _refitted(
    model: Model, read: Sequence[Record], noise: float, history: Sequence[float] | None, rest: float
) -> tuple[refining.Refined | None, ModelEntry]:
    """The model refitted to all repetitions but the last, if it predicts that one better by more than the power of the
    `noise` of a repetition."""
    before = None if history is None else tuple(map(float, history))
    with parallel.one_thread():
        old = selection.as_given(model.cascade, model.effects)
        try:
            every, _ = sessions.compared(read, old, before, rest, 0.0)
            if len(every) < 2:
                raise IdentificationError("only one repetition can be compared with the model")
            held = every[-1]
            new = refining.refine(model, every[:-1])
            fitted = selection.as_given(new.model.cascade, new.model.effects)
            (judged,), _ = sessions.compared([held.record], fitted, before, rest, 0.0)
        except (IdentificationError, RecordError) as refused:
            return None, ModelEntry(accepted=False, why=f"kept as it is: {refused}")
    u = f" {model.parameters.units.output}".rstrip()
    better = held.rms**2 - judged.rms**2 > SURE * noise**2
    said = f"held-out rms error {held.rms:.3g}{u} as given, {judged.rms:.3g}{u} refitted"
    worse = f"kept as it is: a refit does not predict a held-out repetition better ({said})"
    why = f"improved: {said}" if better else worse
    return new if better else None, ModelEntry(accepted=better, before=held.rms, after=judged.rms, why=why)


@dataclass(frozen=True)
class Filter:
    """L on the frequencies (K,) of a record: `response`, complex, times `wiener` from 0 to 1, which keeps noise out;
    and P, interpolated between the bands in which it is known: `plant`, with standard deviation `sure`, both (K,).
    `given`, `error`: lines of the reference and its error from which to go on, those of the best pass in each band;
    `band`: Hz up to which P is known, `explored`: Hz up to which L tries less."""

    frequency: Array
    response: NDArray[np.complex128]
    wiener: Array
    plant: NDArray[np.complex128]
    sure: Array
    given: NDArray[np.complex128]
    error: NDArray[np.complex128]
    band: float
    explored: float
    gain: float
    delay: float

    @property
    def gamma(self) -> float:
        """Largest |1 - L P| in the band, with the uncertainty.

        The Wiener factor w is left out: |1 - w L P| <= 1 - w + w |1 - L P| lies between the value without it and 1."""
        size = np.abs(1.0 - self.response * self.plant) + SURE * self.sure * np.abs(self.response)
        return float(size[(self.frequency > 0.0) & (self.frequency <= self.band)].max(initial=0.0))


def learning_filter(step: float, passes: Sequence[Pass], wanted: Array) -> Filter | None:
    """The filter for the next pass; None if P is not known at any frequency.

    P is estimated in bands of a third of an octave by least squares over the lines in each, P = sum Y conj(U) /
    sum |U|^2, with the part of Y that U does not explain and the noise between repetitions as uncertainty. A band is
    known where this agrees with the gain and delay of the whole, P0, well enough, or where an earlier pass has changed
    the reference and the error fell. There L = 1/P, with P0 for P in the latter case; above, up to the next harmonic,
    L = TRIED/P0, and the next pass shows whether the error falls. L ends below a band in which it has risen.
    """
    last, frequency = passes[-1], np.fft.rfftfreq(len(wanted), step)
    u, y, variance = _lines(last.given), _lines(last.mean), last.variance
    edges = frequency[1] * 2.0 ** (np.arange(0, BANDS * math.log2(len(frequency)) + 1) / BANDS)
    places = np.digitize(frequency, edges)
    bands = [np.flatnonzero(places == k) for k in np.unique(places[1:])]
    weight = np.abs(u) ** 2
    weight[weight < STRONG * weight.max()] = 0.0
    phase = np.angle(np.where(weight > 0.0, y / np.where(weight > 0.0, u, 1.0), 1.0))
    delay = -float(np.sum(weight * frequency * phase) / np.sum(weight * frequency**2)) / (2.0 * np.pi)
    gain = float(np.sum(np.abs(y) * np.sqrt(weight)) / np.sum(weight))
    simple = gain * np.exp(-2j * np.pi * frequency * delay)
    powers = [np.abs(_lines(wanted - each.mean)) ** 2 for each in passes]
    changes = [np.abs(_lines(after.given - before.given)) ** 2 for before, after in itertools.pairwise(passes)]
    given, error = np.array(u), np.array(_lines(wanted - last.mean))
    chance = SURE * float(variance.sum())  # of the whole error: less is not worth a judgement
    known: list[tuple[int, complex, float]] = []
    risen = False
    for here in bands:
        sums = [float(each[here].sum()) for each in powers]
        best = min(range(len(passes)), key=sums.__getitem__)
        if sums[-1] > sums[best] + chance:  # this band was better before
            given[here] = _lines(passes[best].given)[here]
            error[here] = _lines(wanted - passes[best].mean)[here]
        learned = [k for k, each in enumerate(changes) if each[here].sum() > STRONG * sums[k]]
        centre = here[np.argmax(weight[here])] if weight[here].any() else here[len(here) // 2]
        found = _ratio(u[here], y[here], variance[here]) if weight[here].any() else None
        if found and abs(found[0] / simple[centre] - 1.0) + SURE * found[1] / gain >= 0.5 * GAMMA:
            found = None
        if found is None and learned and sums[learned[-1] + 1] > sums[learned[-1]] + chance:
            risen = True  # a mode, or what hysteresis makes of lower lines
        elif found is None and learned and known:
            found = complex(simple[centre]), 0.5 * GAMMA / SURE * gain
        if risen:
            break
        if found and (not known or frequency[centre] <= MOST_TRIED * frequency[known[-1][0]]):
            known.append((int(centre), *found))
    if not known:
        return None
    at, inside = [k for k, *_ in known], np.arange(len(frequency))
    # interpolated relative to gain and delay, whose phase turns between the bands
    relative = np.array([p / simple[k] for k, p, _ in known])
    plant = np.interp(inside, at, relative) * simple
    sure = np.interp(inside, at, [each for *_, each in known])
    band = float(frequency[at[-1]])
    off = abs(relative[-1] - 1.0) + SURE * float(sure[-1]) / gain
    spaced = max(1.0 + BEYOND * float(frequency[at[0]]) / band, LEAST_TRIED)
    further = 1.0 if risen else min(math.sqrt((1.0 + off) / (2.0 * off)), spaced)
    share = np.where(frequency <= band, 1.0, np.where(frequency <= further * band, TRIED, 0.0))
    response = np.where(inside > 0, share / plant, 0.0)
    wiener = np.maximum(0.0, 1.0 - ABOVE * variance / np.maximum(np.abs(error) ** 2, 1e-300))
    explored = min(further * band, float(frequency[-1]))
    lines = np.asarray(frequency, dtype=np.float64)
    return Filter(lines, response, wiener, plant, sure, given, error, band, explored, gain, delay)


def _ratio(x: NDArray[np.complex128], y: NDArray[np.complex128], chance: Array) -> tuple[complex, float] | None:
    """P from lines of a band, and its standard deviation; `chance`: variance of y from noise. None without power."""
    power = np.abs(x) ** 2
    whole = float(power.sum())
    if not whole > 0.0:
        return None
    p = complex(np.sum(y * np.conj(x)) / whole)
    lines = whole**2 / float(np.sum(power**2))  # as many of equal power
    rest = float(np.sum(np.abs(y - p * x) ** 2)) / max(lines - 1.0, 1.0) if lines > 1.5 else 0.0
    return p, math.sqrt(max(rest, float(np.mean(chance))) / whole)


def _lines(x: Array) -> NDArray[np.complex128]:
    """The spectrum of a signal without its mean."""
    return np.fft.rfft(x - x.mean())


def learned(
    t: Array, wanted: Array, passes: Sequence[Pass], refined: refining.Refined | None, entry: ModelEntry, unit: str
) -> Learned:
    """The judgement of passes: whether to go on, and with which reference."""
    u = f" {unit}".rstrip()
    errors = [_centred(wanted - each.mean) for each in passes]
    entries = tuple(
        PassEntry(records=each.names, rms=_rms(error), noise=each.noise, floor=each.floor)
        for each, error in zip(passes, errors, strict=True)
    )
    last, advice = passes[-1], list[str]()
    found = learning_filter(float(t[1] - t[0]), passes, wanted)
    correction = reference = None
    verdict: Literal["model_improved", "reference_corrected", "at_noise_floor", "not_convergent"]
    if found is None:
        verdict = "not_convergent"
        advice.append(
            f"No correction: at no frequency do the records show the motion's answer to the reference to {GAMMA:.0%}. "
            "Record more repetitions, or a pass with a larger or faster reference"
        )
    else:
        steps = found.wiener * found.response
        to = np.fft.irfft(found.given + steps * found.error, len(wanted)) + float(last.given.mean())
        move = to - last.given
        left = np.fft.irfft((1.0 - steps * found.plant) * found.error, len(wanted))
        gamma = found.gamma
        expected = math.hypot(_rms(left), last.floor) if _rms(move) > 0.0 else _rms(errors[-1])
        correction = CorrectionEntry(
            gamma=gamma, band=found.band, explored=found.explored, gain=found.gain, delay=found.delay,
            expected=min(expected, _rms(errors[-1])), change=_rms(move),
            above=_rms(np.fft.irfft(np.fft.rfft(errors[-1]) * (found.frequency > found.band), len(wanted))),
        )
        smaller = _rms(errors[-1]) ** 2 - _rms(left) ** 2
        if gamma >= 1.0:
            verdict = "not_convergent"
            advice.append(
                f"No correction: |1 - L P| may reach {gamma:.2f}, so passes could diverge. Record more repetitions"
            )
        elif smaller <= SURE * last.floor**2 / math.sqrt(len(wanted) / 2.0) + STRONG * _rms(errors[-1]) ** 2:
            verdict = "at_noise_floor"
            advice.append(
                f"Stop: in the band up to {found.band:.4g} Hz, which can be learned, only noise is left of "
                f"{_rms(errors[-1]):.3g}{u} rms; keep this reference. More repetitions a pass would lower the noise"
            )
        else:
            verdict, reference = "reference_corrected", to
            advice.append(
                "Next: give the compensator the corrected reference, record "
                f"{counted(len(last.measured), 'repetition')}, and refine again with all records and --reference"
            )
    if len(errors) > 1 and _rms(errors[-1]) > _rms(errors[-2]) + SURE * math.hypot(last.floor, passes[-2].floor):
        advice.append("The last pass is worse than the one before it by more than noise: has the stage changed?")
    if refined is not None:
        verdict, reference = "model_improved", None
        advice = ["Next: emit the compensator with the improved model, record again, and refine what is then left"]
    report = Learning(
        verdict=verdict, unit=unit, passes=entries, model=entry, correction=correction,
        stop=reference is None and refined is None,
        advice=tuple(advice),
    )
    return Learned(report, t, errors[-1], refined, reference)


def _centred(x: Array) -> Array:
    return np.asarray(x - x.mean())


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))
