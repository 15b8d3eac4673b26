"""The result of a diagnosis: as types, as `diagnosis.json`, in sentences, and as files in a folder."""

from __future__ import annotations

import json
import math
import os
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments, display, drawing
from hystgen.basics.problems import capital
from hystgen.diagnosis.findings import kinds
from hystgen.diagnosis.findings.kinds import Fault, Finding, NotAPlaySum, Structured
from hystgen.diagnosis.search import acceptance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hystgen.model import Model
    from hystgen.parameters.schema import Parameters

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FitErrors:
    """rms errors over fitted and held-out records, output units."""

    fit: float
    holdout: float


@dataclass(frozen=True)
class Gap:
    """Errors of the model as given, of the same model refitted, and of the model with the effects."""

    as_given: FitErrors
    refitted: FitErrors
    after: FitErrors


NO_WIDER = {
    "limit": "a wider range changes nothing",
    "firm": "its range is not widened",
    "noise": "only noise remains",
}
"""Reasons why no wider range was tried, as text."""


@dataclass(frozen=True)
class AtEnd:
    """An effect's parameter that is at or beyond an end of its range.

    `key`, `value`: as in the parameter file; `end`: `least` or `largest`; `usual`: value at that end of the usual
    range; `reached`: value at that end of the widest range that was tried and failed, or None; `leaves`, `kept`:
    held-out rms errors with that range and with the one kept, or None; `why`: `beyond`, the error is smaller beyond the
    usual range; `no less`, a wider range does not reduce the error enough; `limit`, no wider range is possible; `firm`,
    ranges of the nominal model and of your own effects are not widened; `noise`, the error is down to noise, so no
    wider range was tried.
    """

    key: str
    value: float
    end: str
    usual: float
    reached: float | None
    leaves: float | None
    kept: float | None
    why: str

    def sentence(self, name: str, unit: str | None) -> str:
        """The parameter and why it is there, as a sentence without a full stop."""
        what = f"{self.key.replace('_', ' ') or 'a parameter of the search'} of {name}"
        if self.why == "beyond":
            return f"{what} is {self.value:.4g}, beyond its usual range, which ends at {self.usual:.4g} and fits worse"
        said = f"{what} is {self.value:.4g}, the {self.end} value tried"
        if self.why == "no less" and self.leaves is not None and self.kept is not None and self.reached is not None:
            left, kept = (f"{error:.4g}{' ' if unit else ''}{unit or ''}" for error in (self.leaves, self.kept))
            gain = 100.0 * (1.0 - self.leaves / self.kept)
            less = "no less" if gain <= 0.0 else f"only {gain:.2g} % less"
            return f"{said}: a range up to {self.reached:.4g} leaves {left} rms on held-out records, {less} than {kept}"
        return f"{said}: {NO_WIDER[self.why]}"


@dataclass(frozen=True)
class Withdrawn:
    """Effects that were accepted one by one but withdrawn in the end: the error with them, and the reason.

    `before`, `after`: rms errors without and with the effects, on equal terms, output units; `left`: fractions of the
    gap above the noise that remain, None if there is no gap.
    """

    names: tuple[str, ...]
    before: FitErrors
    after: FitErrors
    left: tuple[float | None, float | None]
    ends: tuple[tuple[str, AtEnd], ...]
    why: str


WRITTEN = {
    "extended": "the model with the effects",
    "refitted": "the refitted model",
    "given": "the model as given",
    "identified": "the model of `identify --model auto`",
}
"""Descriptions of the model in `params.yaml`."""


EXPLAINED_IN = "docs/plants.md explains it"
"""Where hysteresis that is not a play sum is described."""


@dataclass(frozen=True)
class NamedEffect:
    """An effect that was found: `parameters` as in a parameter file, with 95 % `intervals`.

    `share_of_gap`: the held-out error that the effect removes, as a fraction of the refitted model's error; errors in
    output units; `at_an_end`: whether a parameter is at an end of its range or two parts of the effect coincide, so
    that its shape is not certain; `ends`: the parameters at an end; `known`: whether the user named it; `unsupported`:
    why the records alone would not have named it, None if they do.
    """

    name: str
    parameters: Mapping[str, object]
    intervals: Mapping[str, object]
    share_of_gap: float
    holdout_before: float
    holdout_after: float
    p_value: float
    evidence: str
    at_an_end: bool = False
    ends: tuple[AtEnd, ...] = ()
    known: bool = False
    unsupported: str | None = None


@dataclass(frozen=True)
class Stretch:
    """A part of a record in which the refitted model has a large error: start and end (s), and the rms error there."""

    record: str
    kind: str
    interval: tuple[float, float]
    rms: float


@dataclass(frozen=True)
class Contender:
    """A fully fitted shape of an effect, with its rms errors; `refused`: why the effect is not named, or None."""

    name: str
    shape: str
    fit: float
    holdout: float
    refused: str | None = None


@dataclass(frozen=True)
class Inverse:
    """Whether the static part of the written model has an inverse, and warnings about it."""

    exists: bool
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Result:
    """Everything in `diagnosis.json`, under the names of its keys; numbers have eight digits.

    `noise_from`: the source of the noise floor, `holds`, `periods`, `differences` or `resolution`; `compared`: number
    of samples compared, and number recorded; `withdrawn`: effects withdrawn in the end, or None; `written`: the model
    in `params.yaml`, which is `extended` by the effects, `refitted`, `given` or `identified`.
    """

    verdict: str
    noise_floor: float
    output_range: float
    unit: str | None
    gap: Gap
    effects: tuple[NamedEffect, ...]
    unexplained: tuple[Finding, ...]
    where: tuple[Stretch, ...]
    not_separable: tuple[tuple[str, str], ...]
    advice: tuple[str, ...]
    ranking: tuple[tuple[Contender, ...], ...]
    inverse: Inverse
    noise_from: str = "differences"
    compared: tuple[int, int] = (0, 0)
    withdrawn: Withdrawn | None = None
    written: str = "refitted"


@dataclass(frozen=True)
class Signals:
    """A record with the errors of the refitted model and of the model with the effects; NaN where not compared."""

    name: str
    held_out: bool
    t: Array
    v: Array
    y: Array
    before: Array
    after: Array


@dataclass(frozen=True, repr=False)
class Diagnosis:
    """A finished diagnosis: its `result`, and `parameters` with the effects added.

    `notes`: changes to the records, one sentence each; `signals`: the records with their errors; `page`: makes
    `report.html` from this diagnosis and the text of the parameter file, None for no report; `figures`: functions that
    draw the figures of the page, by name.
    """

    result: Result
    parameters: Parameters
    notes: tuple[str, ...]
    signals: tuple[Signals, ...] = field(compare=False)
    page: Callable[[Diagnosis, str], str] | None = field(default=None, compare=False, repr=False)

    figures: Mapping[str, Callable[[Diagnosis], Figure]] = field(default_factory=dict, compare=False)

    FILES: ClassVar[tuple[str, ...]] = ("diagnosis.json", "report.html", "params.yaml")

    def __repr__(self) -> str:
        effects = ", ".join(effect.name for effect in self.result.effects if effect.unsupported is None)
        return f"<Diagnosis {self.parameters.name}: {self.verdict}{': ' if effects else ''}{effects}>"

    def _repr_html_(self) -> str:
        first = next(iter(self.figures.values()), None)
        draw = None if first is None else partial(first, self)
        return display.block(repr(self), self.sentence(), draw, self.rows())

    def rows(self) -> list[tuple[str, ...]]:
        """A table of the effects: a header, then the held-out error with each; empty without effects."""
        unit = f" [{self.result.unit}]" if self.result.unit else ""
        head = ("effect", f"held-out rms before{unit}", f"after{unit}", "share of the gap", "p", "supported")
        found = []
        for each in self.result.effects:
            errors = f"{each.holdout_before:.4g}", f"{each.holdout_after:.4g}", f"{round(100.0 * each.share_of_gap)} %"
            supported = "yes" if each.unsupported is None else "no"
            found.append((each.name, *errors, f"{each.p_value:.1g}", supported))
        return [head, *found] if found else []

    @property
    def model(self) -> Model:
        """The model with the effects that were found, to simulate, invert and emit."""
        from hystgen.model import Model

        return Model(self.parameters)

    def plot(self, which: str = "gap", path: str | os.PathLike[str] | None = None) -> Figure:
        """A figure from the report; the default shows how each effect reduces the held-out error.

        `which`: gap, overlay, deviation, records, time, against, frequency, and bode or stops if an effect shows there.
        Returns a matplotlib Figure, which a notebook displays; with `path`, it is also written to that .png or .svg
        file. Raises ValueError, PlotError, OSError.
        """
        arguments.choice("which", which, tuple(self.figures))
        return drawing.picture(partial(self.figures[which], self), path)

    @cached_property
    def content(self) -> dict[str, object]:
        """The result as in `diagnosis.json`."""
        content: dict[str, object] = plain(self.result)
        return {"hystgen": 1, **content}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Advice about the inverse of the written model, one or two sentences each."""
        return self.result.inverse.warnings

    @property
    def verdict(self) -> str:
        """`nothing_missing`, `effects_found` or `unexplained`."""
        return self.result.verdict

    def sentence(self) -> str:
        """The verdict in a few sentences; hysteresis of another kind, and the verdict's limits, come first."""
        parts = [f"{capital(each.sentence(self.result.unit))} ({EXPLAINED_IN})" for each in self._of_another_kind()]
        parts += [*self._limits(), *self._known(), self._finding()]
        if any(effect.at_an_end for effect in self.result.effects):
            parts.append(f"The shape is not certain: {'; '.join(self.uncertain())}")
        wrong = kinds.faults(self.result.unexplained)
        if wrong:
            parts.append(f"The data have faults: {wrong}")
        return " ".join(f"{part}." for part in parts)

    def next_step(
        self, file: str = "params.yaml", records: str = "", held: str = ""
    ) -> tuple[str, str]:
        """The next step, and its command; `file`: the model's, `records`: all records, `held`: those to judge by, with
        the options that read them, all as typed; by default the names of the records."""
        every = " ".join(dict.fromkeys(shlex.quote(each.name) for each in self.signals))
        records, held = records or every, held or self.judged_by()
        if self._of_another_kind() and not self.result.effects:
            fit = f"hystgen identify {records} --model auto -o auto.yaml"
            return "fit elements whose minor loops stay open, which auto tries", fit
        if self._limits() or (self.verdict == "unexplained" and not self.result.effects):
            return "record drives in which every effect shows", f"hystgen diagnose --plan {file} -o plan/"
        if self.not_emitted():
            return "see the tracking error with the model", f"hystgen track {file} {held} -o tracking/"
        return "write the compensator as C", f"hystgen emit {file} -o firmware/"

    def judged_by(self) -> str:
        """The names of the held-out records, or of all if none was held out as a whole, as typed."""
        return " ".join(dict.fromkeys(shlex.quote(e.name) for e in self.signals if e.held_out)) or "RECORDS"

    def uncertain(self) -> list[str]:
        """Parameters at an end of their range, and effects with two parts that coincide."""
        said = []
        for effect in self.result.effects:
            said += [each.sentence(effect.name, self.result.unit) for each in effect.ends]
            if effect.at_an_end and not effect.ends:
                said.append(f"two time constants of {effect.name} are practically equal")
        return list(dict.fromkeys(said))

    def _of_another_kind(self) -> list[NotAPlaySum]:
        return [each for each in self.result.unexplained if isinstance(each, NotAPlaySum)]

    def _limits(self) -> list[str]:
        """Warnings that precede any effect name, about how few samples were compared or how much error remains."""
        result = self.result
        compared, recorded = result.compared
        said = []
        if compared < acceptance.FEW_COMPARED * recorded:
            said.append(f"Only {compared} of {recorded} samples were compared")
        left = result.gap.after.holdout
        if self.verdict == "effects_found" and left > acceptance.MUCH_LEFT * result.noise_floor:
            said.append(f"An error of {self._rms(left)} rms is not explained, {self._times(left)}")
        return said

    def _known(self) -> list[str]:
        """The judgement on each effect that the user named."""
        said = []
        for each in self.result.effects:
            if not each.known:
                continue
            gain = f"from {self._rms(each.holdout_before)} to {self._rms(each.holdout_after)}"
            if each.unsupported is None:
                gain += f", p = {each.p_value:.1g}"
                said.append(f"You named {each.name}, and the records support it: held-out rms error {gain}")
            else:
                why = f"{self.not_supported(each)} (when it was added, held-out rms error {gain})"
                said.append(f"You named {each.name}, so it is written, but {why}")
        return said

    def not_supported(self, effect: NamedEffect) -> str:
        """Why the records do not support an effect that the user named; it is judged with all others in place."""
        beside = "beside the other effects, " if len(self.result.effects) > 1 else ""
        return f"the records do not support it: {beside}{effect.unsupported}"

    @property
    def _harmful(self) -> str:
        """The effects that the user named and that raise the held-out error; empty if none does."""
        raise_it = 1.0 + acceptance.BETTER
        found = [each for each in self.result.effects if each.unsupported is not None]
        return " and ".join(each.name for each in found if each.holdout_after > raise_it * each.holdout_before)

    def _finding(self) -> str:
        """The verdict itself."""
        result = self.result
        gap, unit, seen = result.gap, result.unit, result.unexplained
        before, after = self._rms(gap.refitted.holdout), self._rms(gap.after.holdout)
        structured = any(isinstance(each, Structured) for each in seen)
        if self.verdict == "effects_found":
            names = ", ".join(self._named(each) for each in result.effects if each.unsupported is None)
            more = f", {self._times(gap.after.holdout)} and with structure" if structured else ""
            if gap.after.holdout > acceptance.MUCH_LEFT * result.noise_floor:
                by = f"{100.0 * (1.0 - gap.after.holdout / gap.refitted.holdout):.0f} %"
                return f"Missing, in part: {names}. The held-out rms error falls by {by}, from {before} to {after}"
            return f"Missing: {names}. The held-out rms error falls from {before} to {after}{more}"
        if self.verdict == "nothing_missing":
            whose, more = WRITTEN[result.written], " else" if result.effects else ""
            return f"Nothing{more} is missing: the held-out rms error of {whose} is {after}, which is noise"
        where, left = "", gap.after.holdout
        if acceptance.is_noise(left, result.noise_floor):  # the held-out records do not show it
            where, left = " on the fitted records", gap.after.fit
        missing = f"{self._missing()}: {self._rms(left)} rms remains{where}{self._nearest()}"
        disturbing = [each for each in seen if not isinstance(each, Fault | Structured | NotAPlaySum)]
        if not disturbing:
            return missing
        first = disturbing[0].sentence(unit)
        more = f", and {len(disturbing) - 1} more below" if len(disturbing) > 1 else ""
        share = max(getattr(each, "share", 1.0) for each in disturbing)
        if share >= acceptance.MAIN_SHARE or not structured:
            return f"The records are disturbed, and no effect is named: {first}{more}"
        return f"{missing}. The records are disturbed too: {first}{more}"

    def _missing(self) -> str:
        """The beginning of a verdict that names no effect."""
        if self._of_another_kind():
            return "No effect is named"
        if self._harmful:
            return f"Part of the error may come from {self._harmful}, which you named"
        if self._closest() is None:
            return "Something is missing that the catalogue does not contain or the records cannot show"
        return "Something is missing, and no effect is named"

    def _nearest(self) -> str:
        """The candidate with the smallest error, and why it is not named; empty if no candidate removes any error."""
        closest = self._closest()
        if closest is None or self._of_another_kind():
            return ""
        if self.result.withdrawn is not None and not self._limits():
            return f". {self._withdrawn(self.result.withdrawn)}"
        return f". The closest is {closest.name}, with a residual of {self._rms(closest.holdout)}; {closest.refused}"

    def _withdrawn(self, found: Withdrawn) -> str:
        """The residual error with the withdrawn effects, and why they were withdrawn."""
        named = " and ".join(found.names)
        left = [
            f"{self._rms(after)} of {self._rms(before)} rms on {records} records"
            + ("" if share is None else f" ({100.0 * share:.0f} % of the part above the noise)")
            for records, before, after, share in (
                ("held-out", found.before.holdout, found.after.holdout, found.left[0]),
                ("fitted", found.before.fit, found.after.fit, found.left[1]),
            )
        ]
        ends = "".join(f"; {each.sentence(name, self.result.unit)}" for name, each in found.ends)
        return f"{named[0].upper()}{named[1:]} would leave {' and '.join(left)}: {found.why}{ends}"

    def _closest(self) -> Contender | None:
        searched = self.result.ranking[sum(each.known for each in self.result.effects) :]
        first, gap = searched[0] if searched else (), self.result.gap
        enough = (1.0 - acceptance.BETTER) * min(gap.refitted.holdout, gap.after.holdout)
        return min((each for each in first if each.holdout <= enough), key=lambda each: each.holdout, default=None)

    def _rms(self, error: float) -> str:
        unit = self.result.unit
        return f"{error:.4g}{' ' if unit else ''}{unit or ''}"

    def _times(self, error: float) -> str:
        return kinds.times_noise(error / self.result.noise_floor)

    def not_emitted(self) -> str:
        """Why the model with the effects cannot be emitted yet; empty if it can be."""
        from hystgen.basics.problems import EffectsError, NotInvertibleError
        from hystgen.emission.calls import emit_options
        from hystgen.model import Model

        try:
            emit_options(Model(self.parameters))
        except (EffectsError, NotInvertibleError) as error:
            return str(error)
        return ""

    def _named(self, effect: NamedEffect) -> str:
        """An effect in a verdict: its name, and the column that the residual follows if it follows one."""
        column = effect.parameters.get("column")
        return self._name(effect.name) + (f" (the residual follows column {column})" if column else "")

    def _name(self, name: str) -> str:
        """An effect's name, with the names of effects that cannot be separated from it."""
        others = [other for one, other in self.result.not_separable if one == name]
        return f"{name} (or {' or '.join(others)})" if others else name

    def to_json(self) -> str:
        """`diagnosis.json`."""
        return json.dumps(self.content, indent=2, allow_nan=False) + "\n"

    def write(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write `diagnosis.json`, `report.html` and `params.yaml` into a folder, either all files or none; returns the
        paths.

        Raises PlotError without matplotlib.
        """
        from hystgen.basics import writing
        from hystgen.parameters.files import dump_parameters

        said = [f"Diagnosed by hystgen. {self.sentence()}", *(f"Warning: {text}" for text in self.warnings)]
        text = dump_parameters(self.parameters, header="\n".join(said))
        pages = [] if self.page is None else [self.page(self, text)]
        names = self.FILES if pages else (self.FILES[0], self.FILES[2])
        made = zip(names, (self.to_json(), *pages, text), strict=True)
        return writing.write_files(Path(folder), {name: content.encode("utf-8") for name, content in made})


def plain(value: object) -> Any:
    """The value for JSON: mappings, lists, text and finite numbers; None for other numbers."""
    if isinstance(value, Finding):
        return plain(value.entry())
    if is_dataclass(value) and not isinstance(value, type):
        return {each.name: plain(getattr(value, each.name)) for each in fields(value)}
    if isinstance(value, Mapping):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
