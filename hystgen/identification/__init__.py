"""Fitting models to measured records.

>>> fit = hystgen.identify("stage_recording.csv", holdout=["stage_holdout.csv"])
>>> print(fit.table())
>>> fit.write("stage.yaml")
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments, names, parallel
from hystgen.basics.problems import counted
from hystgen.basics.progress import Progress
from hystgen.effects import PARALLEL
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.stage import Stage
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.identification import clocks, elements, gpi, instruments, pi, prepared, quality, reduction, verdict
from hystgen.identification.fit import HELD_OUT, Fit, Used, used_of, visited
from hystgen.identification.gpi import FittedModel
from hystgen.identification.pi import IdentificationError, rounded
from hystgen.identification.quality import ErrorRow
from hystgen.identification.reduction import Course
from hystgen.identification.verdict import UselessError
from hystgen.plays import play_sum
from hystgen.records import SHORTEST, Record, Source, agreed_units, in_units, read_records, several

if TYPE_CHECKING:
    from hystgen.parameters.schema import Parameters

MODELS = (*gpi.KINDS, "auto")
"""Values of the option `model`, fixed by the contract."""

P0_FLOOR = 0.05
"""Fraction of the sum of weights below which p_0 is raised if the data allow it."""

NEAR_ZERO = 0.01
"""[fraction of the drive range] Largest distance from 0 of a loading curve's start, and largest fall within the
curve."""

PASSES = 60.0
"""Approximate number of passes through all samples in the search for a front, for the progress bar."""

MOST_PLAYS = 1000
"""Maximum number of plays; the memory used by a fit grows with the square of their number, its time with the cube."""

MOST_BREAKS = 64
"""Maximum number of breaks in a dead-zone sum, eight times as many as are tried by default."""

BEYOND = 0.1
"""Largest excursion by which a held-out part of a record may leave the fitted drive range, as a fraction of that range;
farther out, every model is a guess."""

STEP_DIGITS = 6
"""Digits of the records' sample time in the parameter file: decimal times differ beyond these."""

MODEL_PARSIMONY = 1.03
"""`auto` takes the simplest model whose held-out error is within this factor of the best."""

HALVED = 0.5
"""[fraction of the held-out error above the noise] `auto` takes elements in parallel with the plays only if they leave
at most this of the best other model's error. Effects that are no such hysteresis leave more, of the whole error 0.78
and more with several loops, 0.36 (ageing) with a single one. Set by: every eighth case of `make blind FIRST=97000`."""


@arguments.checked
def identify(
    records: Source | Iterable[Source],
    *,
    model: str = "pi",
    thresholds: int | Sequence[float] | None = None,
    breaks: int | Sequence[float] | None = None,
    holdout: Source | Iterable[Source] = (),
    history: Sequence[float] | None = None,
    rest: float = 0.0,
    name: str = "stage",
    units: Mapping[str, str] | None = None,
    skip: float = 0.0,
    loading_curve: bool = False,
    p0_floor: float = P0_FLOOR,
    columns: Mapping[str, str] | None = None,
    sample_time: float | None = None,
    delimiter: str | None = None,
    clock_skew: float | str | None = None,
    strict: bool = False,
    progress: bool = False,
) -> Fit:
    """Fit a model to measured records.

    - `records`: one or more records, each a path, a data frame or a dict of named columns, a tuple of arrays (t, v, y)
      of shape (N,), an array (N, 3), or a `Record`; all but the last are read with `columns`, `sample_time` (s),
      `delimiter`. Each record gets a free offset.
    - `model`: `pi`; `gpi-deadzone` and `gpi-tanh`, which have a memoryless part in front; or `auto`, the simplest of
      them whose held-out error is within 3 % of the best.
    - `thresholds`: the number of plays without r_0, or a list of thresholds (with a memoryless part, in terms of its
      output; that part preserves the length of the drive range and the position of 0); by default both number and
      thresholds are chosen by blocked validation on the records.
    - `breaks`: the number of points at which a dead-zone sum may bend, or the drives there; by default chosen likewise.
    - `holdout`: records that affect only the choice of the model by `auto` and of one or two branches for `gpi-tanh`.
      Without them, a trial model is fitted without the last quarter of each record, which gives the held-out figures;
      the model written is then fitted to everything.
    - `history`: drive values visited before every record, starting from the virgin state. Without it, the start of each
      record is ignored until the drive has wiped the relevant memory; if less than half of the record remains, its
      start memory is estimated together with the weights.
    - `rest`: pause after the history in seconds; it changes nothing, since a PI model does not depend on time.
    - `name`: C identifier of the model.
    - `units`: `input` and `output`, by default those of the first record that gives any; columns in other units of the
      same quantity are converted, but `history`, `thresholds` and `breaks` are not.
    - `skip`: seconds at the start of every record that are not compared, although their drive moves the plays.
    - `loading_curve`: the records are initial loading curves, with the drive rising from 0 in a virgin actuator, and no
      part of them is held out: `p_0 = phi'(0)`, `p(r) = phi''(r)` (22).
    - `p0_floor`: see `pi.fit_weights`; 0 leaves p_0 as fitted.
    - `clock_skew`: growth of the delay of y after v, in ppm of time, to remove from every record, if drive and sensor
      were sampled with separate clocks; `auto`: that of each record, if it is significant. By default it is only
      reported.
    - `strict`: raise UselessError if the figures say that the model is of no use (`Fit.verdict`).
    - `progress`: show a progress bar on a terminal's stderr if the fit takes more than a second.

    The start memory in the parameter file is the memory after `history`. Without a history it is 0, as in a virgin
    actuator, since no record shows the actuator's state when the firmware starts. Raises RecordError for unusable
    files, IdentificationError for records to which no model can be fitted, ValueError and TypeError for wrong
    arguments.

    >>> import numpy as np, hystgen
    >>> t = np.linspace(0.0, 2.0, 2001)
    >>> v = 50.0 - 50.0 * np.cos(2.0 * np.pi * t)
    >>> y = hystgen.PI([0.0, 10.0], [0.12, 0.03]).simulate(v)
    >>> fit = hystgen.identify({"t": t, "v": v, "y": y}, thresholds=[0, 10], name="stage_x")
    >>> fit.model
    <Model stage_x: 1 play, 0 to 100, invertible>
    >>> [round(weight, 3) for weight in fit.parameters.model.pi.weights]
    [0.12, 0.03]
    """
    wrong = names.name_problem(name)
    if wrong:
        raise ValueError(f"the name {wrong}")
    how, before = check_options(model, thresholds, breaks, history, rest, skip, p0_floor, loading_curve, units)
    to_fit, to_hold = several(records), several(holdout)
    read = read_records([*to_fit, *to_hold], columns, sample_time, delimiter, progress=progress, points=True)
    read = in_units(read, named=("units", units), sources=[*to_fit, *to_hold])
    read = instruments.put_right(read, clock_skew)
    fit_records, held_records = read[: len(to_fit)], read[len(to_fit) :]
    if not fit_records:
        raise ValueError("there is no record to fit")
    reported = [f"{record.name}: {note}" for record in (*fit_records, *held_records) for note in record.notes]
    reported += quality.repeated(fit_records, held_records)
    units, strange = agreed_units(read, units)
    reported += strange
    for record in fit_records if loading_curve else ():
        _check_loading_curve(record)
    courses, notes = prepared.courses(fit_records, before, skip)
    held, more = prepared.courses(held_records, before, skip)
    reported += notes + more
    kinds = gpi.KINDS if model == "auto" else (model,)
    passes = (1.0 if model == "pi" else PASSES * len(kinds)) * (1.0 if held else 2.0 - HELD_OUT)
    samples = sum(len(item.v) for item in courses)
    with parallel.one_thread(), Progress(passes * samples, progress, "fitting") as bar:
        how = replace(how, tick=bar.tick)
        prepared.mask_outliers(courses, held, how.wanted, p0_floor)
        steps = [float(np.median(np.diff(record.t))) for record in fit_records]
        if model == "auto" and elements.shown(courses, steps):
            kinds = (*kinds, PARALLEL)
        if held:
            tried = [each for _, each in _each(kinds, lambda kind: _best(courses, held, kind, how))]
            done = tried[_choose(tried)]
            rows = [each.as_candidate() for each in tried] if len(tried) > 1 else []
            fitted, compared, held_errors = done.fitted, done.compared, done.errors
        else:
            trial = _trial([] if loading_curve else courses, kinds, how)
            try:
                fitted, compared = gpi.solve(courses, trial.kind, how)
            except IdentificationError:
                if trial.kind != PARALLEL:
                    raise
                trial = _trial(courses, kinds[:-1], how)
                fitted, compared = gpi.solve(courses, trial.kind, how)
            rows, held_errors = trial.rows, trial.errors
            if trial.reason:
                reported.append(trial.reason)
    masks = used_of(fit_records, compared, False)
    if held:
        masks += used_of(held_records, done.held, True)
    reported += [text for each in masks for text in each.sentences()]
    errors = [_compare(item, fitted) for item in compared]
    own = ErrorRow.of("fit" if held or not rows else "all", "written", errors)
    rows.append(own)
    drive = _drive(compared)
    if held:
        rows.append(done.held_out)
        reported += [text for item in held if (text := quality.outside(item.name, item.v, drive))]
    reported += [
        f"{item.name}: only {counted(item.used, 'sample is', 'samples are')} left once its start memory is known; it "
        "carries little weight"
        for item in compared
        if item.used < SHORTEST
    ]
    seen = [record.v for record in (*fit_records, *held_records)]
    ends = min(float(v.min()) for v in seen), max(float(v.max()) for v in seen)
    reported += arguments.outside("history", before or (), ends, "the drive of all records")
    if not loading_curve:  # every sample of a loading curve depends on the start
        largest = float(fitted.solution.thresholds[-1])
        reported += [text for each in errors if (text := quality.about_start(each, largest))]
    reported += quality.about_model(fitted, how.wanted, compared, own)
    with parallel.one_thread():
        sure = quality.intervals(fitted, compared, errors, held_errors)
    offset = rounded(errors[0].offset, pi.DIGITS)
    step = next((rounded(record.sample_time, STEP_DIGITS) for record in fit_records if record.timed), None)
    parameters = _parameters(name, units, step, drive, fitted, offset, compared[0])
    judged = [each.error for each in held_errors or errors]
    parameters = parameters.model_copy(update={"residual": quality.residual(judged, step)})
    said = verdict.verdict(errors, held_errors, quality.direction(fitted), (units or {}).get("output", ""))
    if strict and said.useless:
        raise UselessError(f"{fit_records[0].name}: the model is of no use: {said.why}")
    return Fit(parameters, tuple(rows), tuple(reported), sure, masks, said, before, tuple(read))


def check_options(
    model: str = "pi",
    thresholds: int | Sequence[float] | None = None,
    breaks: int | Sequence[float] | None = None,
    history: Sequence[float] | None = None,
    rest: float = 0.0,
    skip: float = 0.0,
    p0_floor: float = P0_FLOOR,
    loading_curve: bool = False,
    units: Mapping[str, str] | None = None,
    clock_skew: float | str | None = None,
    **_: object,
) -> tuple[gpi.How, tuple[float, ...] | None]:
    """The request for a fit, and the history, from options of `identify`. Raises ValueError and TypeError."""
    arguments.choice("model", model, MODELS)
    p0_floor = arguments.real("p0_floor", p0_floor, "fraction of the sum of weights")
    how = gpi.How(_checked_thresholds(thresholds), _checked_breaks(breaks, model), p0_floor)
    before = None if history is None else visited(history)
    if loading_curve:
        if before:
            raise ValueError("history and loading_curve exclude each other: an initial loading curve has no history")
        before = ()
    arguments.number("rest", rest, "seconds", 0.0)
    arguments.number("skip", skip, "seconds", 0.0)
    clocks.checked(clock_skew)
    if units is not None:
        arguments.texts("units", units, ("input", "output"), "{'input': 'V', 'output': 'um'}")
    if not 0.0 <= p0_floor < 1.0:
        raise ValueError(f"p0_floor must be a fraction of the sum of weights, from 0 to below 1, not {p0_floor}")
    return how, before


@dataclass(frozen=True)
class _Tried:
    """A model of one kind, the courses it was fitted to, the held-out courses, and the errors on these."""

    fitted: FittedModel
    compared: list[Course]
    held: list[Course]
    errors: list[pi.FreeRunErrors]
    held_out: ErrorRow

    def as_candidate(self) -> ErrorRow:
        """The held-out row labelled with the kind, for the table of `auto`."""
        return replace(self.held_out, part="candidate", model=self.fitted.front.name)


def auto(courses: Sequence[Course], held: Sequence[Course]) -> FittedModel:
    """The model of any kind that `identify` chooses on held-out courses. Raises IdentificationError."""
    tried = [_best(courses, held, kind, gpi.How(None, None, P0_FLOOR)) for kind in gpi.KINDS]
    return tried[_choose(tried)].fitted


def _best(courses: Sequence[Course], held: Sequence[Course], kind: str, how: gpi.How) -> _Tried:
    """Fit one kind to courses and compare it with held-out courses, which decide between fits of `gpi.to_judge`."""
    found = gpi.to_judge(courses, kind, how)
    tried = [_compared(fitted, compared, fitted.begun(held)) for fitted, compared in found]
    return tried[_choose(tried)]


def _try(courses: Sequence[Course], ends: Sequence[Course], kind: str, how: gpi.How) -> _Tried:
    """Fit one kind to the first parts of records and compare it with their remainders."""
    fitted, compared = gpi.solve(courses, kind, how)
    begun = [replace(other, start=item.start) for item, other in zip(compared, ends, strict=True)]
    return _compared(fitted, compared, begun)


LONGER = "hold out a longer record"

SWEPT = (
    "the others depend on moves before the record: begin it with a sweep over the drive's range, or give --history"
)
"""Advice for a held-out record with too few samples, and for one of which too few can be compared."""


def _compared(fitted: FittedModel, compared: list[Course], begun: Sequence[Course]) -> _Tried:
    """A fit with its errors on held-out courses."""
    largest = float(fitted.solution.thresholds[-1])
    settled = [replace(item, first=fitted.inner(item).resettled(largest).first) for item in begun]
    for item in settled:
        if item.used < SHORTEST:
            raise IdentificationError(
                f"{item.name} is held out, but only {item.used} of its {len(item.v)} samples can be compared, and at "
                f"least {SHORTEST} are needed; {LONGER if len(item.v) < 2 * SHORTEST else SWEPT}"
            )
    errors = [_compare(item, fitted) for item in settled]
    return _Tried(fitted, compared, settled, errors, ErrorRow.of("held out", "written", errors))


def _choose(tried: Sequence[_Tried]) -> int:
    """Index of the first, and so the simplest, model whose held-out error is close to the smallest.

    Samples far outside the fitted drive range, where every model is a guess, count only if there are no others.
    """
    found = [_rms_inside(each) for each in tried]
    plain = [each.fitted.parallel is None for each in tried]
    if any(plain) and not all(plain):
        noise = quality.noise_of([each.course for each in tried[plain.index(True)].errors])
        best = min(rms for rms, alone in zip(found, plain, strict=True) if alone)
        above = best > verdict.ABOVE_NOISE * noise
        most = math.hypot(HALVED * best, math.sqrt(1.0 - HALVED**2) * noise) if above else 0.0
        found = [rms if alone or rms <= most else math.inf for rms, alone in zip(found, plain, strict=True)]
    enough = MODEL_PARSIMONY * min(found)
    return next(k for k, rms in enumerate(found) if rms <= enough)


def _rms_inside(tried: _Tried) -> float:
    """Held-out rms error over samples whose drive is within `BEYOND` of the fitted range; over all if few are
    inside."""
    low, high = _drive(tried.compared)
    low, high = low - BEYOND * (high - low), high + BEYOND * (high - low)
    if all(low <= np.min(each.course.v) and np.max(each.course.v) <= high for each in tried.errors):
        return tried.held_out.rms
    squares = []
    for each in tried.errors:
        drive = each.course.v[each.course.first : each.course.last]
        inside = each.error[np.isfinite(each.error) & (drive >= low) & (drive <= high)]
        if len(inside) >= SHORTEST:
            squares.append((inside - np.mean(inside)) ** 2)
    return float(np.sqrt(np.mean(np.concatenate(squares)))) if squares else tried.held_out.rms


def _drive(courses: Sequence[Course]) -> tuple[float, float]:
    """Smallest and largest drive of all courses."""
    ranges = [item.drive_range for item in courses]
    return min(low for low, _ in ranges), max(high for _, high in ranges)


def _compare(item: Course, fitted: FittedModel) -> pi.FreeRunErrors:
    found = pi.compare(fitted.inner(item), fitted.solution.thresholds, fitted.solution.weights)
    return replace(found, course=replace(found.course, y=item.y))


def _check_loading_curve(record: Record) -> None:
    """Raise IdentificationError unless the drive starts near 0 and keeps rising."""
    v = np.asarray(record.v)
    top = float(np.max(v))
    if not (top > 0.0 and abs(float(v[0])) <= NEAR_ZERO * top and np.all(np.diff(v) >= -NEAR_ZERO * top)):
        raise IdentificationError(
            f"{record.name} is not an initial loading curve: the drive has to rise all the way from 0; give the part "
            "of the record up to the first turn, or leave out loading_curve"
        )


def _checked_thresholds(wanted: int | Sequence[float] | None) -> int | tuple[float, ...] | None:
    """None, a number of plays, or a list of thresholds that begins with 0. Raises ValueError."""
    if wanted is None:
        return None
    if isinstance(wanted, int | np.integer) and not isinstance(wanted, bool):
        if not 0 <= wanted <= MOST_PLAYS:
            raise ValueError(f"thresholds must be a number of plays from 0 to {MOST_PLAYS}, not {wanted}")
        return int(wanted)
    if isinstance(wanted, str | float | bool):
        raise ValueError("thresholds must be a whole number of plays or a list of thresholds")
    places = arguments.numbers("thresholds", wanted, "[0, 1.5, 3]")
    if not places or places[0] != 0.0:
        places = (0.0, *places)
    if any(b <= a for a, b in itertools.pairwise(places)):
        raise ValueError("thresholds must be finite, not negative, and strictly increasing")
    return places


def _checked_breaks(breaks: int | Sequence[float] | None, model: str) -> int | tuple[float, ...] | None:
    """None, a number of breaks, or their positions. Raises ValueError."""
    if breaks is None:
        return None
    if model not in ("gpi-deadzone", "auto"):
        raise ValueError(
            f"only a dead-zone sum has breaks, and model {model} has none; give model gpi-deadzone or auto"
        )
    if isinstance(breaks, int | np.integer) and not isinstance(breaks, bool):
        if not 1 <= breaks <= MOST_BREAKS:
            raise ValueError(f"breaks must be a number from 1 to {MOST_BREAKS}, not {breaks}")
        return int(breaks)
    if isinstance(breaks, str | float | bool):
        raise ValueError("breaks must be a whole number or a list of drive values")
    places = tuple(x for x in arguments.numbers("breaks", breaks, "[-20, 20]") if x != 0.0)
    if not places or not all(map(math.isfinite, places)) or any(b <= a for a, b in itertools.pairwise(places)):
        raise ValueError("breaks must be finite, strictly increasing drive values, with at least one besides 0")
    return places


def _each(kinds: Sequence[str], fit: Callable[[str], _Tried]) -> list[tuple[str, _Tried]]:
    """The fits of each kind; elements are left out if they explain so much that the plays have no slope left."""
    found = []
    for kind in kinds:
        try:
            found.append((kind, fit(kind)))
        except IdentificationError:
            if kind != PARALLEL:
                raise
    return found


class _Chosen(NamedTuple):
    """Rows of models fitted to the first part of each record and compared with the remainder, the kind selected, its
    errors, and the reason if there are no rows."""

    rows: list[ErrorRow]
    kind: str
    errors: list[pi.FreeRunErrors]
    reason: str


def _trial(courses: Sequence[Course], kinds: Sequence[str], how: gpi.How) -> _Chosen:
    """The trial of the kinds; without courses, of the only kind."""
    if not courses:
        if len(kinds) > 1:
            raise ValueError("model auto needs something held out: give holdout records besides the loading curve")
        return _Chosen([], kinds[0], [], "")
    short = "too short, or its first part covers too little of the drive's range, to hold out its end; give --holdout"
    instead = "" if len(kinds) == 1 else f". With nothing held out auto cannot choose: {kinds[0]} was fitted"
    fronts, ends = [], []
    for item in courses:
        front, end = _parted(item)
        if front.used < SHORTEST or np.ptp(item.v[front.first : front.last]) == 0.0:
            return _Chosen([], kinds[0], [], f"{item.name}: {short}{instead}")
        fronts.append(front)
        ends.append(end)
    try:
        found = _each(kinds, lambda kind: _try(fronts, ends, kind, how))
    except IdentificationError as failure:
        return _Chosen([], kinds[0], [], f"nothing was held out: {failure}{instead}")
    tried = [each for _, each in found]
    chosen = _choose(tried)
    best = tried[chosen]
    own = ErrorRow.of("fit", "trial", [_compare(item, best.fitted) for item in best.compared])
    rows = [each.as_candidate() for each in tried] if len(tried) > 1 else []
    rows += [own, replace(best.held_out, model="trial")]
    # if the amplitude fades, the end alone has a smaller range; percentages of both parts refer to the whole
    whole = max(item.output_range for item in courses)
    return _Chosen([replace(row, output_range=whole) for row in rows], found[chosen][0], best.errors, "")


def _parted(item: Course) -> tuple[Course, Course]:
    """The part of a record to fit, and the part to hold out.

    The part held out is the record's end, unless the drive there goes far beyond its earlier range, for example with
    growing amplitudes; then it is the last part of the same length that stays within the range of the rest.
    """
    number = round(len(item.v) * HELD_OUT)
    last = len(item.v)
    beyond = {}
    for stop in range(last, max(number, item.begin), -number) if number else ():
        inside = item.v[stop - number : stop]
        rest = np.concatenate([item.v[item.begin : stop - number], item.v[stop:]])
        if len(rest) and np.ptp(rest) > 0.0:
            over = max(float(np.max(inside) - np.max(rest)), float(np.min(rest) - np.min(inside)))
            beyond[stop] = over / float(np.ptp(rest))
    stop = next((k for k, over in beyond.items() if over <= BEYOND), last)
    if stop == last:
        split = round(len(item.v) * (1.0 - HELD_OUT))
        return replace(item, last=split).resettled(math.inf), replace(item, begin=max(split, item.begin))
    y = item.y.copy()
    y[stop - number : stop] = np.nan
    return replace(item, y=y), replace(item, begin=max(stop - number, item.begin), last=stop)


def _parameters(
    name: str,
    units: Mapping[str, str] | None,
    step: float | None,
    drive: tuple[float, float],
    fitted: FittedModel,
    offset: float,
    first: Course,
) -> Parameters:
    from hystgen.parameters.files import make_parameters

    r, p = fitted.solution.thresholds, fitted.solution.weights
    content: dict[str, object] = {"hystgen": 1, "name": name}
    if units:
        content["units"] = dict(units)
    if step is not None:
        content["recorded_at"] = step
    content["input_range"] = list(drive)
    described: dict[str, object] = {
        "pi": {
            "thresholds": r.tolist(),
            "weights": p.tolist(),
            "initial_state": _start(r, fitted.inner(first).history),
        },
        "output_offset": offset,
    }
    stages = [stage_content(stage) for stage in fitted.stages]
    if stages:
        described["memoryless"] = stages[0] if len(stages) == 1 else stages
    if fitted.parallel is not None:
        described["effects"] = [fitted.parallel.model_dump(exclude_defaults=True)]
    content["model"] = described
    return make_parameters(content)


def stage_content(stage: Stage) -> dict[str, object]:
    """A stage of the model as written in the parameter file."""
    if isinstance(stage, DeadZone):
        return {"kind": "dead_zone", "thresholds": list(stage.thresholds), "weights": list(stage.weights)}
    assert isinstance(stage, TanhEnvelope)
    content: dict[str, object] = {"kind": "tanh"}
    for name, branch in (("ascending", stage.ascending), ("descending", stage.branch(False))):
        if name == "ascending" or stage.branches_differ:
            content[name] = dict(zip(("a0", "a1", "a2", "a3"), branch, strict=True))
    return content


def _start(r: NDArray[np.float64], history: tuple[float, ...] | None) -> float | list[float]:
    """The start memory to write: after the history, or virgin; a single number if all plays agree."""
    if history is None or len(r) < 2:
        return 0.0
    states, _ = play_sum.project(reduction.start_states(np.zeros(1), history, r).tolist(), r.tolist())
    return states[0] if len(set(states)) == 1 else list(states)


def identifier_from(text: str) -> str:
    """A C identifier made from any text, such as a file's stem, or `stage` if no usable character remains."""
    words = re.sub(r"[^0-9A-Za-z]+", "_", text).strip("_")
    if not words:
        return "stage"
    if words[0].isdigit():
        words = f"stage_{words}"
    words = words[:40].rstrip("_")
    return f"stage_{words}" if names.name_problem(words) else words


__all__ = [
    "MODELS",
    "MODEL_PARSIMONY",
    "ErrorRow",
    "Fit",
    "IdentificationError",
    "Used",
    "UselessError",
    "check_options",
    "identifier_from",
    "identify",
    "stage_content",
]
