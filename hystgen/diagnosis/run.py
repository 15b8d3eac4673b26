"""A diagnosis from records to result: check the records, refit, clean, search, and extend the parameter file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments, parallel
from hystgen.diagnosis.data import disturbances, preparing
from hystgen.diagnosis.data.disturbances import Cleaned
from hystgen.diagnosis.data.items import Item, rms
from hystgen.diagnosis.data.preparing import Prepared
from hystgen.diagnosis.data.signals import NoiseFloor, noise_floor
from hystgen.diagnosis.findings.content import result_of
from hystgen.diagnosis.findings.kinds import NotAPlaySum, OtherHistory, WildInverse
from hystgen.diagnosis.findings.result import WRITTEN, Diagnosis, FitErrors, Inverse, Signals
from hystgen.diagnosis.search import acceptance, fits, forgetting, harm, hypothesis, selection
from hystgen.diagnosis.search import known as known_effects
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.hypothesis import Structure
from hystgen.diagnosis.search.known import Known
from hystgen.diagnosis.search.screening import Records
from hystgen.diagnosis.search.selection import Outcome, Refusal
from hystgen.effects import CATALOGUE, FRONTS
from hystgen.effects.base import Effect, Place
from hystgen.identification import P0_FLOOR, STEP_DIGITS, auto, instruments, quality, stage_content
from hystgen.identification.fit import visited
from hystgen.identification.joint import Kept
from hystgen.identification.pi import DIGITS, FALLS, IdentificationError, Weights, rounded, written
from hystgen.identification.prepared import about_skip, samples_in
from hystgen.records import Record, Source, agreed_units, in_units, read_records, several

if TYPE_CHECKING:
    from hystgen.cascade import Cascade
    from hystgen.model import ModelSource
    from hystgen.parameters.schema import Parameters

Array = NDArray[np.float64]
History = tuple[float, ...] | None
Refit = Callable[[Prepared], Fitted]

STEPS = 120
"""Approximate number of fits in a diagnosis, for the progress bar."""


@arguments.checked
def diagnose(
    parameters: ModelSource,
    records: Source | Iterable[Source],
    *,
    holdout: Source | Iterable[Source] = (),
    history: Sequence[float] | None = None,
    rest: float = 0.0,
    skip: float = 0.0,
    effects: Sequence[type[Effect]] = (),
    known: Sequence[str] = (),
    columns: dict[str, str] | None = None,
    sample_time: float | None = None,
    delimiter: str | None = None,
    clock_skew: float | str | None = None,
    progress: bool = False,
) -> Diagnosis:
    """Find the effects that a nominal model is missing.

    `parameters`: a `Model`, a parameter file, or a result of `identify`; `records`: measured records to fit, each as
    for `identify` and converted to the model's units; `holdout`: records with other waveforms, by which models are
    judged; if none are given, or too few of their samples can be compared, every third record or the end of each is
    held out. `history`: drive values visited before every record, ignored if the starts of the records contradict it;
    `rest`: pause after the history in seconds. `skip`: seconds at the start of every record that are not compared,
    although their drive still moves the plays. `effects`: further effects to try; `known`: names of effects known to be
    there, which are fitted before the search and written whatever the records say, each with the judgement that the
    search would have passed on it. `clock_skew`: as for `identify`.

    The nominal model is refitted first. Effects are then added one at a time: each shape is fitted jointly with the
    weights so as to minimise the free-run error, and accepted if it removes a substantial part of the held-out error
    and the gain is not due to chance. Raises RecordError, IdentificationError, ValueError.

    >>> import numpy as np, hystgen
    >>> t = np.linspace(0.0, 4.0, 4000)
    >>> v = 5.0 * np.sin(12.0 * t) * np.exp(-0.3 * t)
    >>> model = hystgen.load("examples/note/example_1.yaml")
    >>> y = model.simulate(v) + 0.01 * np.random.default_rng(1).standard_normal(len(t))
    >>> hystgen.diagnose(model, {"t": t, "v": v, "y": y})
    <Diagnosis example_1: nothing_missing>
    """
    from hystgen.basics.progress import Progress
    from hystgen.model import as_model

    model = as_model(parameters)
    fitted, others = several(records), several(holdout)
    if not fitted:
        raise ValueError("there is no record to fit")
    arguments.number("rest", rest, "seconds", 0.0)
    arguments.number("skip", skip, "seconds", 0.0)
    if not all(isinstance(effect, type) and issubclass(effect, Effect) for effect in effects):
        raise TypeError("effects must be classes, as hystgen.effects.load_user_effects returns them")
    named = arguments.words("known", known, CATALOGUE[0])
    there = [*(effect.name for effect in model.effects), *(FRONTS[:1] if model.cascade.stages else ())]
    known_effects.check(named, effects, there)
    read = read_records([*fitted, *others], columns, sample_time, delimiter, progress=progress, points=True)
    read = in_units(read, model.parameters.units, sources=[*fitted, *others])
    read = instruments.put_right(read, clock_skew)
    nominal = _with_units(model.parameters, read)
    given, unit = nominal.model.effects, nominal.units.output
    before = None if history is None else visited(history)
    with parallel.one_thread(), Progress(STEPS, progress, "diagnosing") as bar:
        first = selection.as_given(model.cascade, given)
        predict = partial(hypothesis.predicted, actuator=first.actuator, weights=first.weights, history=before)
        usable, odd = preparing.checked(read, predict)
        to_fit, to_hold = (
            [record for record in group if record is not None]
            for group in (usable[: len(fitted)], usable[len(fitted) :])
        )
        task = _Case(
            model.cascade, given, to_fit or read[: len(fitted)], to_hold, rest, skip, effects, named,
            lambda: bar.tick(1),
        )
        done, wrong = task.with_history(before, unit)
        ready, by_itself = done.cleaned.clean, list[str]()
        write = partial(_extended, nominal, model.cascade, ready=ready, user=effects)
        found = done.found if named else selection.no_worse_than(first, done.found, done.records)
        found, wild = _harmless(found, done, write)
        if named:
            found = known_effects.complete(found, done.records)
        else:
            found, by_itself = _no_worse_than_identified(found, done.records, unit)
        found, made = selection.invertible(found, done.records, P0_FLOOR)
        if done.known is not None:
            found = known_effects.judged(found, done.known, done.records, _refused(found, done, write))
        extended = _with_residual(write(found), found, ready)
        result = result_of(
            unit,
            ready,
            done.noise,
            found,
            FitErrors(*(rms(first.errors(group)) for group in (ready.to_fit, ready.held))),
            [*filter(None, [done.forgets]), *wild, *odd, *filter(None, [wrong]), *done.cleaned.lines],
            done.records.one_loop,
            _inverse(extended, made),
        )
    notes = [f"{record.name}: {note}" for record in read for note in record.notes]
    notes += arguments.outside("history", before or (), model.cascade.input_range, "the model's input_range")
    notes += [text for each in read for text in about_skip(each, samples_in(each, skip))]
    notes += [*quality.repeated(read[: len(fitted)], read[len(fitted) :]), *ready.notes]
    notes += [*done.cleaned.notes(unit), *done.notes, *by_itself]
    return Diagnosis(result, extended, tuple(notes), _signals(ready, found))


def _with_units(parameters: Parameters, records: Sequence[Record]) -> Parameters:
    """The parameters, with missing units taken from the records, and their sample time."""
    units, _ = agreed_units(records, parameters.units.model_dump())
    step = next((rounded(record.sample_time, STEP_DIGITS) for record in records if record.timed), None)
    return parameters.model_copy(update={"units": parameters.units.model_copy(update=units), "recorded_at": step})


NO_FRONT = "the memoryless part of the model was left out: held-out records are predicted better without it"


@dataclass(frozen=True)
class _Done:
    """A finished search, with its records and notes about it; `known`: the effects that the user named, if any."""

    cleaned: Cleaned
    noise: NoiseFloor
    records: Records
    found: Outcome
    forgets: NotAPlaySum | None = None
    notes: tuple[str, ...] = ()
    known: Known | None = None

    def noting(self, note: str) -> _Done:
        """A copy with one more note."""
        return replace(self, notes=(*self.notes, note))


@dataclass(frozen=True)
class _Case:
    """The records and the nominal model of a diagnosis, for searches with and without a history."""

    cascade: Cascade
    given: Sequence[Effect]
    to_fit: Sequence[Record]
    held: Sequence[Record]
    rest: float
    skip: float
    user: Sequence[type[Effect]]
    named: Sequence[str]
    tick: Callable[[], None]

    def with_history(self, history: History, unit: str | None) -> tuple[_Done, OtherHistory | None]:
        """The search with the history or, if the records contradict it, a search without it, and the finding."""
        done = None
        wrong = self._foreign(history)
        if wrong is None:
            done = self._searched(history)
            wrong = preparing.contradicted(done.cleaned.clean.to_fit, done.found.fitted)
        if wrong is not None or done is None:
            try:
                done = self._searched(None)
            except IdentificationError as error:
                assert wrong is not None
                raise IdentificationError(f"{wrong.sentence(unit)}, and without it {error}") from None
        return done, wrong

    def _begun(self, history: History) -> tuple[Prepared, Refit, Refit | None]:
        """The prepared records, a function that refits the nominal model to them and, if the model has a front, a
        function that refits it without the front."""
        ready = preparing.prepare(self.to_fit, self.held, history, self.rest, self.skip)
        base, start = hypothesis.structure_of(self.cascade, self.given, ready)
        weights = hypothesis.nominal_weights(self.cascade, base)
        bare = hypothesis.without_front(base, start) if self.cascade.stages else None
        return (
            ready,
            lambda ready: selection.refit(base, ready.to_fit, start, weights),
            None if bare is None else lambda ready: selection.refit(bare[0], ready.to_fit, bare[1]),
        )

    def _foreign(self, history: History) -> OtherHistory | None:
        """A finding if the model fits the history only at the expense of the other samples, else None."""
        if history is None:
            return None
        ready, refit, _ = self._begun(history)
        try:
            others, refit_others, _ = self._begun(None)
        except IdentificationError:  # all compared samples depend on the history
            return None
        return preparing.bends(ready.to_fit, refit(ready), refit_others(others))

    def _searched(self, history: History) -> _Done:
        """The search from the nominal model, or from that model without its front if the front misleads the search.

        A front fitted to one loop may have absorbed an effect. If held-out records are predicted better without the
        front, the search without it is used if it finds effects but no new front; otherwise the better search.
        """
        ready, refit, bare = self._begun(history)
        if bare is not None and selection.better(bare(ready), refit(ready), ready.held):
            without = self._thorough(ready, bare)
            if without.found.found and not without.found.bends:
                return without.noting(NO_FRONT)
            done = self._thorough(ready, refit)
            better = selection.better(without.found.fitted, done.found.fitted, ready.held)
            return without.noting(NO_FRONT) if better else done
        return self._thorough(ready, refit)

    def _thorough(self, ready: Prepared, refit: Refit) -> _Done:
        """The search, repeated if nothing could be named although much error remains.

        The repeat also holds out the end of each fitted record, which may show effects that held-out records do not.
        """
        done = self._search(ready, refit)
        left = rms(done.found.fitted.errors(done.records.to_fit))
        if done.found.found or done.forgets is not None or acceptance.is_noise(left, done.noise.rms):
            return done
        more = preparing.with_ends(ready)
        again = None if more is None else self._search(more, refit)
        return done if again is None or not again.found.found else again

    def _search(self, ready: Prepared, refit: Refit) -> _Done:
        refitted = refit(ready)
        cleaned = disturbances.taken_out(Cleaned(ready, ready), refitted, refit)
        if cleaned.lines:
            refitted = refit(cleaned.clean)
        noise, records, known = self._records(cleaned.clean, refitted)
        found = selection.select(records, known.fitted, cleaned.left_by)
        if found.found and cleaned.left_by(found.fitted):  # a line that shows only once the effects are fitted
            cleaned = disturbances.taken_out(cleaned, found.fitted, partial(selection.again, found.fitted))
            refitted = refit(cleaned.clean)
            noise, records, known = self._records(cleaned.clean, refitted)
            found = selection.select(records, known.fitted)
        forgets = forgetting.forgets(found, records)
        found = forgetting.withheld(found, forgets, records)
        return _Done(cleaned, noise, records, found, forgets, known=known if self.named else None)

    def _records(self, clean: Prepared, refitted: Fitted) -> tuple[NoiseFloor, Records, Known]:
        """The noise, the records as a search takes them, and the refitted model with the effects that the user named,
        from which the search goes on."""
        noise = noise_floor([*clean.to_fit, *clean.held])
        records = Records.of(clean.to_fit, clean.held, refitted, noise.rms, self.user, self.tick)
        known = known_effects.added(refitted, self.named, records)
        return noise, replace(records, gap=rms(known.fitted.errors(records.to_fit))), known


def _no_worse_than_identified(found: Outcome, records: Records, unit: str | None) -> tuple[Outcome, list[str]]:
    """The outcome or, if better, the model that `identify` chooses on the same samples, with a note about the change.

    `identify` is not tried if only noise remains: on all records or, if effects are named, on the held-out ones.
    """
    left, of_fitted = records.residual(found.fitted), rms(found.fitted.errors(records.to_fit))
    if acceptance.is_noise(left if found.found else max(left, of_fitted), records.noise):
        return found, []
    courses = [[item.course for item in group if item.known.any()] for group in (records.to_fit, records.held)]
    try:
        identified = auto(*courses)
    except IdentificationError:  # too few samples remain after starts with unknown memory
        return found, []
    r, p = identified.solution.thresholds, identified.solution.weights
    other = Fitted(Structure(r, Kept(identified.stages)), np.empty(0), p, np.nan)
    best = selection.no_worse_than(other, found, records, selection.IDENTIFIED)
    if best is found:
        return found, []
    u = f" {unit}" if unit else ""
    return best, [
        f"{WRITTEN[selection.IDENTIFIED]} is written: its held-out rms error is {records.residual(other):.4g}{u}, "
        f"below the {left:.4g}{u} of {WRITTEN[found.written]}"
    ]


def _harmless(
    found: Outcome, done: _Done, written: Callable[[Outcome], Parameters]
) -> tuple[Outcome, list[WildInverse]]:
    """The outcome, without effects whose inverse does more than the records support, and the finding about them."""
    if not found.found:
        return found, []
    plain = Outcome(found.refitted, found.refitted, (), found.rankings)
    wild, why = _wild(found, plain, done, written)
    if wild is None:
        return found, []
    names = tuple(dict.fromkeys(each.name for each in found.found))
    return replace(plain, rankings=selection.refused(found.rankings, why)), [WildInverse(names, **vars(wild))]


def _wild(
    found: Outcome, plain: Outcome, done: _Done, written: Callable[[Outcome], Parameters]
) -> tuple[harm.Wild | None, Refusal]:
    """What the inverse of an outcome with effects does beyond what the records support, and the refusal for that."""
    from hystgen.model import Model

    records = done.records
    with_effects, without = (selection.invertible(each, records, P0_FLOOR)[0] for each in (found, plain))
    gain = acceptance.apart(records.residual(without.fitted), records.residual(with_effects.fitted))
    extended, shorter = (Model(written(each)) for each in (with_effects, without))
    wild = harm.wild(extended, shorter, records.held, gain, done.noise.rms)
    moves = 0.0 if wild is None else wild.moves
    return wild, Refusal("wild", moves, acceptance.BEYOND_GAIN * max(gain, done.noise.rms))


def _refused(found: Outcome, done: _Done, written: Callable[[Outcome], Parameters]) -> Refusal | None:
    """The refusal of known effects because of their inverse, or None."""
    assert done.known is not None
    plain = Outcome(done.known.plain, done.known.plain, (), ())
    wild, why = _wild(found, plain, done, written)
    return None if wild is None else why


def _inverse(extended: Parameters, made: Weights) -> Inverse:
    """Whether the static part of the written model has an inverse, and warnings about it for the user."""
    from hystgen.model import cascade_of

    problems = cascade_of(extended).inverse_problems()
    warnings = quality.about_inverse(np.array(extended.model.pi.weights), made)
    if problems and extended.model.pi.weights[0] > 0.0:
        warnings = [*warnings, f"the model has no inverse: {'; '.join(problems)}"]
    return Inverse(not problems, tuple(warnings))


def _signals(ready: Prepared, found: Outcome) -> tuple[Signals, ...]:
    made = []
    for held_out, group in ((False, ready.to_fit), (True, ready.held)):
        for item, before, after in zip(group, found.refitted.errors(group), found.fitted.errors(group), strict=True):
            made.append(Signals(item.name, held_out, item.run.t, item.run.v, item.y, before, after))
    return tuple(made)


def _with_residual(parameters: Parameters, found: Outcome, ready: Prepared) -> Parameters:
    """The parameters with the error that the model leaves on held-out records."""
    timed = all(item.timed for item in ready.held)
    step = min(float(np.median(np.diff(item.run.t))) for item in ready.held) if timed else None
    return parameters.model_copy(update={"residual": quality.residual(found.fitted.errors(ready.held), step)})


def _extended(
    parameters: Parameters, cascade: Cascade, found: Outcome, ready: Prepared, user: Sequence[type[Effect]]
) -> Parameters:
    """The parameter file with the model refitted and the effects added; `cascade`: the nominal model.

    Raises IdentificationError if all weights are zero.
    """
    from hystgen.parameters.files import make_parameters

    fitted = found.fitted
    p = written(fitted.weights)
    if not np.any(p > 0.0):
        raise IdentificationError(FALLS)
    r = fitted.structure.thresholds
    kept = (p > 0.0) | (r == 0.0)
    actuator = fitted.actuator
    if actuator.at(Place.PLAYS):  # an effect on the plays may refer to the largest threshold
        kept[-1] = True
    fewer = tuple(r[kept].tolist())
    if any(True for effect in actuator.effects for _ in effect.problems(fewer)):  # it has one parameter per play
        kept[:] = True
    offset = rounded(_offset(fitted, ready.to_fit[0]), DIGITS)
    plays: dict[str, object] = {"thresholds": r[kept].tolist(), "weights": p[kept].tolist()}
    start = cascade.pi.start
    if np.any(start) and not cascade.stages and not actuator.stages:  # without a front the plays see the drive itself
        plays["initial_state"] = np.interp(r[kept], cascade.pi.thresholds, start).tolist()
    content = {
        **parameters.model_dump(),
        "not_separable": found.not_separable,
        "input_range": list(parameters.input_range),
        "model": {
            "pi": plays,
            "memoryless": [stage_content(stage) for stage in actuator.stages],
            "output_offset": offset,
            "effects": [{"name": effect.name, **fits.entry(effect)} for effect in actuator.effects],
        },
    }
    return make_parameters(content, user_effects=user)


def _offset(fitted: Fitted, item: Item) -> float:
    """The offset in front of a sensor that fits the record best, which starts at rest as a simulation does."""
    rows, constant = fitted.actuator.columns(item, fitted.weights)
    return float(fitted.actuator.level(rows[0] + constant, item, fitted.weights, at_rest=True)[0][0])
