"""Finding what a model is missing: where it disagrees with measured records, the name of the effect, and the model
with it added.

>>> found = hystgen.diagnose("stage.yaml", ["slow.csv", "steps.csv"], holdout=["other.csv"])
>>> found.verdict
>>> found.write("diagnosis/")
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments, threads
from hystgen.diagnosis import believed, channels, disturbances, floor, intervals, selection, starts, structure, told
from hystgen.diagnosis.content import content_of
from hystgen.diagnosis.disturbances import Cleaned
from hystgen.diagnosis.floor import Floor
from hystgen.diagnosis.selection import Outcome
from hystgen.diagnosis.structure import Fitted, Item
from hystgen.diagnosis.trials import Records
from hystgen.effects.base import Place
from hystgen.identification import P0_FLOOR, remarks, stage_content
from hystgen.identification.fit import visited
from hystgen.identification.pi import DIGITS, DUST, FALLS, IdentificationError
from hystgen.identification.thresholds import rounded
from hystgen.identification.weights import Weights
from hystgen.records import Source, read_records, several

if TYPE_CHECKING:
    from hystgen.chain.static import StaticModel
    from hystgen.effects.base import Effect
    from hystgen.parameters.files import Parameters

Array = NDArray[np.float64]

MAINLY = 0.5
"""Share of the error's variance from which on the sentence of the verdict is about that alone."""


@dataclass(frozen=True)
class Signals:
    """A record with the errors of the refitted model and of the one with the effects; NaN where not compared."""

    name: str
    held_out: bool
    t: Array
    v: Array
    y: Array
    before: Array
    after: Array


@dataclass(frozen=True)
class Diagnosis:
    """What was found: `content` as `diagnosis.json` has it, `parameters` with the effects added.

    `notes`: what was done to the records, one sentence each; `signals`: the records with their errors.
    """

    content: dict[str, Any]
    parameters: Parameters
    notes: tuple[str, ...]
    signals: tuple[Signals, ...] = field(compare=False)

    FILES: ClassVar[tuple[str, ...]] = ("diagnosis.json", "report.html", "params.yaml")

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know about the inverse of the model that is written, one or two sentences each."""
        return tuple(self.content.get("inverse", {}).get("warnings", ()))

    @property
    def verdict(self) -> str:
        """`nothing_missing`, `effects_found` or `unexplained`."""
        return str(self.content["verdict"])

    def sentence(self) -> str:
        """The verdict in a sentence."""
        gap, unit = self.content["gap"], self.content["unit"]
        before, after = (f"{gap[key]['holdout']:.4g}{' ' if unit else ''}{unit or ''}" for key in ("refitted", "after"))
        seen = self.content["unexplained"]
        wrong = told.faults(seen)
        but = f" The data have faults: {wrong}." if wrong else ""
        if self.verdict == "effects_found":
            names = ", ".join(self._name(effect["name"]) for effect in self.content["effects"])
            more, floor = "", self.content["noise_floor"]
            if floor and any(each["kind"] == "structure" for each in seen):
                more = f", {gap['after']['holdout'] / floor:.2g} times the noise and with structure"
            return f"Missing: {names}. The held-out rms error falls from {before} to {after}{more}.{but}"
        if self.verdict == "nothing_missing":
            noise = f"the refitted model leaves {after} rms on held-out records, which is noise"
            return f"Nothing is missing: {noise}.{but}"
        missing = (
            f"Something is missing that the catalogue does not hold or the records cannot show: {after} rms is left"
        )
        disturbing = [each for each in seen if each["kind"] not in (*told.REPAIRED, told.ACTUATOR)]
        if not disturbing:
            return f"{missing}.{but}"
        first = told.sentence(disturbing[0], unit)
        more = f", and {len(disturbing) - 1} more below" if len(disturbing) > 1 else ""
        mainly = max(each.get("share", 1.0) for each in disturbing) >= MAINLY
        if mainly or all(each["kind"] != told.ACTUATOR for each in seen):
            return f"The records are disturbed, and no effect is named: {first}{more}.{but}"
        return f"{missing}. The records are disturbed too: {first}{more}.{but}"

    def not_emitted(self) -> str:
        """Why there is no C for the model with the effects yet; empty where `emit` takes it."""
        from hystgen.basics.problems import UnsupportedEffectsError
        from hystgen.emission.calls import emit_options
        from hystgen.model import Model

        try:
            emit_options(Model(self.parameters))
        except UnsupportedEffectsError as error:
            return str(error)
        return ""

    def _name(self, name: str) -> str:
        """An effect with those that it cannot be told from."""
        others = [other for one, other in self.content["not_separable"] if one == name]
        return f"{name} (or {' or '.join(others)})" if others else name

    def to_json(self) -> str:
        """`diagnosis.json`."""
        return json.dumps(self.content, indent=2, allow_nan=False) + "\n"

    def write(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write `diagnosis.json`, `report.html` and `params.yaml` into a folder, all or nothing; the paths.

        Raises PlotError without matplotlib.
        """
        from hystgen.emission import files
        from hystgen.parameters.files import dump_parameters
        from hystgen.report import diagnosis as report

        said = [f"Diagnosed by hystgen. {self.sentence()}", *(f"Warning: {text}" for text in self.warnings)]
        text = dump_parameters(self.parameters, header="\n".join(said))
        made = zip(self.FILES, (self.to_json(), report.html(self, text), text), strict=True)
        return files.write(Path(folder), {name: content.encode("utf-8") for name, content in made})


@arguments.checked
def diagnose(
    source: Any,
    records: Source | Iterable[Source],
    *,
    holdout: Source | Iterable[Source] = (),
    history: Sequence[float] | None = None,
    rest: float = 0.0,
    effects: Sequence[type[Effect]] = (),
    columns: dict[str, str] | None = None,
    sample_time: float | None = None,
    delimiter: str | None = None,
    progress: bool = False,
) -> Diagnosis:
    """Find what a believed model is missing.

    `source`: a `Model` or a parameter file; `records`: measured, to be fitted; `holdout`: records with other
    waveforms that judge; without them, or where too little of them can be compared, every third record, or the end of
    one, is set aside. `history`: drive values visited before every record, which is left out where the starts of the
    records contradict it; `rest`: seconds of pause after them. `effects`: further effects that take part.

    The believed model is refitted first. Then one effect after the other is added, each shape fitted jointly with the
    weights on the free-run error, and accepted when it removes a worthwhile part of the held-out error that chance does
    not explain. Raises RecordError, IdentificationError, ValueError.
    """
    from hystgen.basics.progress import Progress
    from hystgen.effects import Effect
    from hystgen.model import as_model

    model = as_model(source)
    given = model.parameters.model.effects
    fitted, others = several(records), several(holdout)
    if not fitted:
        raise ValueError("there is no record to fit")
    arguments.number("rest", rest, "seconds", 0.0)
    if not all(isinstance(effect, type) and issubclass(effect, Effect) for effect in effects):
        raise TypeError("effects are classes, of files as hystgen.effects.load_user_effects returns them")
    read = read_records([*fitted, *others], columns, sample_time, delimiter, progress=progress)
    before = None if history is None else visited(history)
    with threads.alone(), Progress(STEPS, progress, "diagnosing") as bar:
        first = believed.as_given(model.cascade, given)
        usable, odd = channels.checked(read, *first, before)
        to_fit, to_hold = (
            [record for record in group if record is not None]
            for group in (usable[: len(fitted)], usable[len(fitted) :])
        )

        def begun(history: tuple[float, ...] | None) -> tuple[believed.Prepared, Callable[[believed.Prepared], Fitted]]:
            ready = believed.prepare(to_fit or read[: len(fitted)], to_hold, history, rest)
            base, start = believed.structure_of(model.cascade, given, ready)
            weights = believed.believed_weights(model.cascade, base)
            return ready, lambda ready: selection.refit(base, ready.to_fit, start, weights)

        def foreign(history: tuple[float, ...] | None) -> dict[str, Any] | None:
            """What is said of a history to which the model can be bent, and should not."""
            if history is None:
                return None
            ready, refit = begun(history)
            try:
                others, refit_others = begun(None)
            except IdentificationError:  # nothing is left that does not depend on it
                return None
            return starts.bends(ready.to_fit, refit(ready), refit_others(others))

        def searched(history: tuple[float, ...] | None) -> tuple[Cleaned, Floor, Records, Outcome]:
            ready, refit = begun(history)

            def prepared(clean: believed.Prepared, refitted: Fitted) -> tuple[Floor, Records]:
                noise = floor.noise_floor([*clean.to_fit, *clean.held])
                return noise, Records.of(clean.to_fit, clean.held, refitted, noise.rms, effects, lambda: bar.tick(1))

            refitted = refit(ready)
            cleaned = disturbances.taken_out(disturbances.none_in(ready), refitted, refit)
            if cleaned.told:
                refitted = refit(cleaned.clean)
            noise, records = prepared(cleaned.clean, refitted)
            found = selection.select(records, refitted, cleaned.left_by)
            if found.found and cleaned.left_by(found.fitted):  # beside what is found it shows as it is
                cleaned = disturbances.taken_out(cleaned, found.fitted, partial(selection.again, found.fitted))
                refitted = refit(cleaned.clean)
                noise, records = prepared(cleaned.clean, refitted)
                found = selection.select(records, refitted)
            return cleaned, noise, records, found

        wrong = foreign(before)
        if wrong is None:
            cleaned, noise, compared, found = searched(before)
            wrong = starts.contradicted(cleaned.clean.to_fit, found.fitted)
        if wrong is not None:
            odd.append(wrong)
            try:
                cleaned, noise, compared, found = searched(None)
            except IdentificationError as error:
                said = told.sentence(wrong, model.parameters.units.output)
                raise IdentificationError(f"{said}, and without it {error}") from None
        found, made = selection.invertible(found, compared, P0_FLOOR)
        ready, odd = cleaned.clean, [*odd, *cleaned.told]
        as_given = [
            structure.rms([first[0].error(item, first[1]) for item in group]) for group in (ready.to_fit, ready.held)
        ]
        content = content_of(model.parameters, ready, noise, found, as_given, odd, compared.one_loop)
    notes = [f"{record.name}: {note}" for record in read for note in record.notes]
    notes += [*remarks.repeated(read[: len(fitted)], read[len(fitted) :]), *ready.notes]
    notes += cleaned.notes(model.parameters.units.output)
    extended = _extended(model.parameters, model.cascade, found.fitted, ready, effects)
    content["inverse"] = _about_inverse(extended, made)
    return Diagnosis(content, extended, tuple(notes), _signals(ready, found))


def _about_inverse(extended: Parameters, made: Weights) -> dict[str, Any]:
    """Whether the static part of the model that is written has an inverse, and what the user should know about it."""
    from hystgen.model import cascade_of

    problems = cascade_of(extended).inverse_problems()
    said = remarks.about_inverse(np.array(extended.model.pi.weights), made)
    if problems and extended.model.pi.weights[0] > 0.0:
        said = [*said, f"the model has no inverse: {'; '.join(problems)}"]
    return {"exists": not problems, "warnings": said}


def _signals(ready: believed.Prepared, found: Outcome) -> tuple[Signals, ...]:
    made = []
    for held_out, group in ((False, ready.to_fit), (True, ready.held)):
        for item, before, after in zip(group, found.refitted.errors(group), found.fitted.errors(group), strict=True):
            made.append(Signals(item.name, held_out, item.run.t, item.run.v, item.y, before, after))
    return tuple(made)


STEPS = 120
"""About so many fits are made, for the progress bar."""


def _extended(
    parameters: Parameters,
    cascade: StaticModel,
    fitted: Fitted,
    ready: believed.Prepared,
    user: Sequence[type[Effect]],
) -> Parameters:
    """The parameter file with the model refitted and the effects added; `cascade`: the believed model.

    Raises IdentificationError where nothing is left of it.
    """
    from hystgen.parameters.files import make_parameters

    p = np.array([rounded(float(x), DIGITS) for x in fitted.weights])
    p[p < DUST * float(np.sum(p))] = 0.0
    if not np.any(p > 0.0):
        raise IdentificationError(FALLS)
    r = fitted.structure.thresholds
    kept = (p > 0.0) | (r == 0.0)
    actuator = fitted.actuator
    if actuator.at(Place.PLAYS):  # what acts on plays may be measured in the largest threshold
        kept[-1] = True
    fewer = tuple(r[kept].tolist())
    if any(True for effect in actuator.effects for _ in effect.problems(fewer)):  # numbers of its own for every play
        kept[:] = True
    offset = rounded(_offset(fitted, ready.to_fit[0]), DIGITS)
    plays: dict[str, Any] = {"thresholds": r[kept].tolist(), "weights": p[kept].tolist()}
    believed_start = cascade.pi.start
    if np.any(believed_start) and not cascade.stages and not actuator.stages:  # in front of plays they see the drive
        plays["initial_state"] = np.interp(r[kept], cascade.pi.thresholds, believed_start).tolist()
    content = {
        **parameters.model_dump(),
        "input_range": list(parameters.input_range),
        "model": {
            "pi": plays,
            "memoryless": [stage_content(stage) for stage in actuator.stages],
            "output_offset": offset,
            "effects": [{"name": effect.name, **intervals.entry(effect)} for effect in actuator.effects],
        },
    }
    return make_parameters(content, user_effects=user)


def _offset(fitted: Fitted, item: Item) -> float:
    actuator = fitted.actuator
    rows, constant = actuator.columns(item, fitted.weights)
    predicted = actuator.compared(rows[0] + constant, item) + actuator.added(item)
    return float(np.mean(item.y[item.compared] - predicted))


__all__ = ["Diagnosis", "IdentificationError", "diagnose"]
