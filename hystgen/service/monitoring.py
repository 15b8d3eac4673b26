"""`hystgen.monitor`: whether a unit in service has moved away from its model, since when, by what, and whether it
matters."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from hystgen.basics import arguments, display, drawing, parallel
from hystgen.basics.problems import RecordError, counted
from hystgen.diagnosis.findings.result import plain
from hystgen.diagnosis.run import diagnose
from hystgen.diagnosis.search import selection
from hystgen.effects.base import Effect
from hystgen.identification.fit import visited
from hystgen.identification.pi import IdentificationError
from hystgen.model import Model, ModelSource, as_model
from hystgen.records import Record, Source, in_units, read_records, several
from hystgen.service import change, refining, sessions
from hystgen.service.change import FEWEST, Change
from hystgen.service.sessions import ServiceSession

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hystgen.diagnosis.findings.result import Diagnosis
    from hystgen.service.refining import Refined

SCHEMA_ID = "urn:hystgen:monitor:1"
"""Name of the JSON Schema of `monitor.json`, a URN since it identifies the schema rather than its location."""

FALSE_ALARMS = 0.01
"""[probability] Default chance that a healthy set of sessions raises an alarm."""

MORE_MATTERS = 0.1
"""[fraction] A tracking error that grew by less than this is called unchanged: it hardly shows beside the differences
between references."""


REFITTED = 0.8
"""[fraction of the residual] Other weights that leave less than this explain a part of the change: the third of its
power that then goes is far more than free weights take from noise."""


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ChangeEntry(_Frozen):
    """A possible change of the unit along one direction."""

    direction: Literal["gain", "loop", "curve", "rate", "slow", "shape"]
    since: str = Field(description="first session that shows it")
    size: float = Field(description="relative; in s for rate; for shape the logarithm of a factor")
    interval: tuple[float, float] = Field(description="95 % interval of size")
    p_value: float = Field(description="chance of one so clear in a healthy set, over all directions and sessions")
    against: Literal["earlier sessions", "identification"]
    refused: str = Field(description="why it is no evidence; empty if it is")


class SessionEntry(_Frozen):
    """A session as it was compared."""

    name: str
    samples: int = Field(description="number compared")
    rms: float = Field(description="rms of measured minus expected, without offset and drift, output units")
    structured: float = Field(description="rms of the part of it that follows the motion, output units")
    gain: float | None = Field(description="relative distance of the motion's size from the model's")
    tracking: float | None = Field(description="rms of measured minus reference about its mean; null if unknown")


class EffectEntry(_Frozen):
    """An effect that the diagnosis names in the sessions after the change, and not in those before."""

    name: str
    parameters: Mapping[str, object]
    share_of_gap: float
    p_value: float


class MonitorReport(_Frozen):
    """The content of `monitor.json`."""

    hystgen: Literal[1] = 1
    verdict: Literal["healthy", "changed", "untold"]
    alarm: bool
    since: str | None = Field(description="first session after the change; null without an alarm")
    p_value: float = Field(description="smallest of all changes; an alarm if it is at most false_alarms")
    false_alarms: float = Field(description="chance of an alarm in a healthy set of sessions")
    unit: str
    rms_now: float = Field(description="rms residual since the change, or of the last session, output units")
    rms_then: float | None = Field(description="the same before, or of identification; null if neither is known")
    tracking_now: float | None = Field(description="rms tracking error since the change, or of the last session")
    tracking_then: float | None
    effects: tuple[EffectEntry, ...]
    cause: str = Field(description="what the diagnosis says about the sessions since the change; empty if not asked")
    changes: tuple[ChangeEntry, ...]
    sessions: tuple[SessionEntry, ...] = Field(description="in order of time")
    order: str = Field(description="where that order comes from")
    advice: tuple[str, ...] = Field(description="which session would tell what these cannot")
    notes: tuple[str, ...]
    sentence: str


def schema() -> dict[str, object]:
    """JSON Schema (2020-12) of `monitor.json`."""
    made = MonitorReport.model_json_schema(mode="serialization")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": SCHEMA_ID, **made}


@dataclass(frozen=True, repr=False)
class Monitoring:
    """The judgement on a unit in service.

    `sessions`: in order of time; `changes`: possible changes, the clearest first; `residual`: largest rms residual that
    identification may have left, None if the parameter file does not state it; `effects`, `cause`: from the diagnosis;
    `page`: makes `report.html`; `draw`: draws the sessions.
    """

    model: Model
    sessions: tuple[ServiceSession, ...]
    changes: tuple[Change, ...]
    false_alarms: float
    residual: float | None
    order: str
    notes: tuple[str, ...] = ()
    effects: tuple[EffectEntry, ...] = ()
    cause: str = ""
    page: Callable[[Monitoring], str] | None = field(default=None, compare=False)
    draw: Callable[[Monitoring], Figure] | None = field(default=None, compare=False)

    FILES = ("monitor.json", "report.html")

    def __repr__(self) -> str:
        return f"<Monitoring of {counted(len(self.sessions), 'session')}: {self.verdict}>"

    def _repr_html_(self) -> str:
        return display.block(repr(self), self.sentence(), None if self.draw is None else partial(self.draw, self))

    @property
    def clearest(self) -> Change | None:
        """The change with the largest effect among those that are evidence, else the clearest."""
        return next((each for each in self.changes if not each.refused), None)

    @property
    def p_value(self) -> float:
        """Chance of a change so clear in a healthy set of sessions."""
        return min((each.p_value for each in self.changes if not each.refused), default=1.0)

    @property
    def alarm(self) -> bool:
        """Whether the unit has moved away from its model."""
        return self.p_value <= self.false_alarms

    @property
    def verdict(self) -> Literal["healthy", "changed", "untold"]:
        """`changed`, `healthy`, or `untold` where the sessions cannot tell."""
        if self.alarm:
            return "changed"
        return "untold" if any(each.p_value <= self.false_alarms for each in self.changes) else "healthy"

    @property
    def first(self) -> int:
        """Index of the first session after the change; of the last session without one."""
        return self.clearest.first if self.alarm and self.clearest else len(self.sessions) - 1

    @property
    def since(self) -> str | None:
        """Name of the first session after the change, None without an alarm."""
        return self.sessions[self.first].name if self.alarm else None

    @property
    def now(self) -> tuple[ServiceSession, ...]:
        """The sessions since the change; the last one without a change."""
        return self.sessions[self.first :]

    @property
    def rms_now(self) -> float:
        """rms residual since the change, or of the last session, output units."""
        return _pooled([each.rms for each in self.now])

    @property
    def rms_then(self) -> float | None:
        """rms residual before, or of identification; None if neither is known."""
        return _pooled([each.rms for each in self.sessions[: self.first]]) if self.first else self.residual

    @property
    def tracking_now(self) -> float | None:
        """rms tracking error since the change, or of the last session; None without a reference."""
        return _tracking(self.now)

    @property
    def tracking_then(self) -> float | None:
        """rms tracking error before; None without a reference or earlier sessions."""
        return _tracking(self.sessions[: self.first])

    def band(self, direction: str) -> tuple[float, float]:
        """Centre and half width of the band in which a healthy session lies along a direction, relative to the model,
        for a session of median size; against identification the centre is 0."""
        found = [each.seen[direction] for each in self.sessions if direction in each.seen]
        best = self.clearest
        if best is not None and best.against == "identification" and self.residual is not None:
            size = float(np.median([each.size for each in found]))
            return 0.0, self.residual / size
        then = found[: self.first] or found
        sizes, part, sure = (np.array([getattr(each, k) for each in then]) for k in ("size", "part", "sure"))
        centre = float(sizes @ part / (sizes @ sizes))
        scatter = math.sqrt(max(float(np.mean((part - centre * sizes) ** 2)), float(np.mean(sure**2))))
        return centre, NormalDist().inv_cdf(1.0 - 0.5 * self.false_alarms) * scatter / float(np.median(sizes))

    def sentence(self) -> str:
        """The judgement in a few sentences."""
        number, best = counted(len(self.sessions), "session"), self.clearest
        if self.verdict == "untold":
            why = next(each.refused for each in self.changes if each.refused and each.p_value <= self.false_alarms)
            return f"These sessions cannot tell whether the unit changed: {why}."
        if not self.alarm or best is None:
            of = "session follows" if len(self.sessions) == 1 else "sessions follow"
            count = "The" if len(self.sessions) == 1 else f"All {len(self.sessions)}"
            return f"{count} {of} the model as before: p = {self.p_value:.2g}. {self._worth()}".strip()
        since = f"since {self.since}" if self.first else f"in {'all of ' if len(self.sessions) > 1 else ''}{number}"
        said = f"The unit has moved away from its model {since}, p = {self.p_value:.1g}: {best.sentence()}."
        return " ".join(filter(None, [said, self.cause, self._worth()]))

    def _worth(self) -> str:
        now, then = self.tracking_now, self.tracking_then
        u = f" {self.model.parameters.units.output}".rstrip()
        if now is None:
            return ""
        if then is None:
            return f"The tracking error is {now:.3g}{u} rms."
        compared = f"{now:.3g}{u} rms, {then:.3g}{u} before"
        if now > (1.0 + MORE_MATTERS) * then:
            return f"The tracking error is {compared}."
        return f"The tracking error has not grown: {compared}."

    def advice(self) -> tuple[str, ...]:
        """Which session would tell what these cannot."""
        found = []
        if self.verdict == "untold":
            first = next(each.first for each in self.changes if each.refused)
            found.append(
                f"record a session with the reference of {self.sessions[first - 1].name}: it tells a change of the "
                "unit from a change of its use"
            )
        if self.residual is None and self.first == len(self.sessions) - 1 and not self.alarm:
            found.append(
                "identify again with this version, so that the parameter file states its residual; a single session "
                "can then be judged too"
            )
        if self.tracking_now is None:
            found.append(f"record the reference as column {sessions.REFERENCE}, for the tracking error")
        return tuple(found)

    def report(self) -> MonitorReport:
        """The content of `monitor.json`."""
        return MonitorReport(
            verdict=self.verdict, alarm=self.alarm, since=self.since, p_value=self.p_value,
            false_alarms=self.false_alarms, unit=self.model.parameters.units.output, rms_now=self.rms_now,
            rms_then=self.rms_then, tracking_now=self.tracking_now, tracking_then=self.tracking_then,
            effects=self.effects, cause=self.cause,
            changes=tuple(
                ChangeEntry.model_validate({
                    "direction": each.direction, "since": self.sessions[each.first].name, "size": each.size,
                    "interval": each.interval, "p_value": each.p_value, "against": each.against,
                    "refused": each.refused,
                })
                for each in self.changes
            ),
            sessions=tuple(
                SessionEntry(
                    name=each.name, samples=len(each.known), rms=each.rms, structured=each.structured,
                    gain=each.gain, tracking=each.tracking,
                )
                for each in self.sessions
            ),
            order=self.order, advice=self.advice(), notes=self.notes, sentence=self.sentence(),
        )

    def to_json(self) -> str:
        """`monitor.json`."""
        return json.dumps(self.report().model_dump(mode="json"), indent=2, allow_nan=False) + "\n"

    def refine(self) -> Refined:
        """The model brought up to date with the sessions since the change, or with all of them without one.

        Raises IdentificationError if the sessions show no parameter.
        """
        return refining.refine(self.model, self.now if self.alarm else self.sessions)

    def write(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write `monitor.json` and `report.html` into a folder, both or neither; returns the paths. Raises PlotError
        without matplotlib."""
        from hystgen.basics import writing

        assert self.page is not None, "hystgen.monitor sets it"
        made = self.to_json().encode("utf-8"), self.page(self).encode("utf-8")
        return writing.write_files(Path(folder), dict(zip(self.FILES, made, strict=True)))

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """The sessions over time; also saved to `path`, a .png or .svg file, if given. Raises PlotError, OSError."""
        assert self.draw is not None, "hystgen.monitor sets it"
        return drawing.picture(partial(self.draw, self), path)


def _pooled(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _tracking(group: Sequence[ServiceSession]) -> float | None:
    found = [each.tracking for each in group if each.tracking is not None]
    return _pooled(found) if found else None


@arguments.checked
def monitor(
    parameters: ModelSource,
    records: Source | Iterable[Source],
    *,
    false_alarms: float = FALSE_ALARMS,
    causes: bool = True,
    history: Sequence[float] | None = None,
    rest: float = 0.0,
    skip: float = 0.0,
    effects: Sequence[type[Effect]] = (),
    columns: dict[str, str] | None = None,
    sample_time: float | None = None,
    delimiter: str | None = None,
    progress: bool = False,
) -> Monitoring:
    """Whether a unit in service has moved away from its model, since when, by what, and whether it matters.

    `parameters`: a `Model`, a parameter file, or a result with a model; `records`: one record a session, of drive `v`,
    measured displacement `y` and, for the tracking error, the reference `u` in output units. They are put in the order
    of a column `recorded_at` (s), else of dates in their names, else of their times, else as given. `false_alarms`:
    probability of an alarm in a healthy set of sessions. `causes`: run the diagnosis on the sessions since a change, to
    name what changed. `history`, `rest`, `skip`: as for `diagnose`; `effects`: further effects for the diagnosis to
    try.

    A single session is compared with the residual that the parameter file states (`residual`). Raises RecordError,
    ParameterError, EffectsError, ValueError, TypeError.
    """
    model = as_model(parameters)
    given = several(records)
    if not given:
        raise ValueError("there is no session to judge")
    if not 0.0 < false_alarms < 1.0:
        raise ValueError(f"false_alarms must be a probability between 0 and 1, not {false_alarms:g}; 0.01, for example")
    arguments.number("rest", rest, "seconds", 0.0)
    arguments.number("skip", skip, "seconds", 0.0)
    read = read_records(given, columns, sample_time, delimiter, progress=progress, points=True)
    read = in_units(read, model.parameters.units, sources=given)
    ordered, order = sessions.in_order(read, given)
    model.chain.require_columns([model.run(each.v, each.t, each.extra) for each in ordered])
    before = None if history is None else visited(history)
    fitted = selection.as_given(model.cascade, model.effects)
    with parallel.one_thread():
        found, notes = sessions.compared(ordered, fitted, before, rest, skip)
    residual = change.largest_residual(model.parameters.residual, false_alarms)
    if residual is None and len(found) < FEWEST:
        raise RecordError([
            f"{found[-1].name}: error: {counted(len(found), 'session')} cannot show a change, because the parameter "
            f"file does not state the residual of its identification; give at least {FEWEST} sessions, or identify "
            "again, which writes `residual`"
        ])
    notes = [*(f"{record.name}: {note}" for record in read for note in record.notes), *notes]
    made = Monitoring(
        model, tuple(found), tuple(change.find(found, residual, false_alarms)), false_alarms, residual, order,
        tuple(dict.fromkeys(notes)),
    )
    if not (causes and made.alarm):
        return made
    named, cause = _cause(made, history, rest, skip, effects)
    return Monitoring(**{**vars(made), "effects": named, "cause": cause})


def _cause(
    found: Monitoring, history: Sequence[float] | None, rest: float, skip: float, effects: Sequence[type[Effect]]
) -> tuple[tuple[EffectEntry, ...], str]:
    """Effects that the diagnosis names since the change, and what it says.

    The model is first brought up to date with the sessions before the change, effects included, so that what it lacked
    from the beginning is not taken for the change.
    """

    def diagnosed(model: Model, group: Sequence[ServiceSession]) -> Diagnosis | None:
        try:
            records: list[Record] = [each.record for each in group]
            return diagnose(model, records, history=history, rest=rest, skip=skip, effects=effects)
        except (IdentificationError, RecordError):
            return None

    then = diagnosed(found.model, found.sessions[: found.first]) if found.first else None
    known = found.model if then is None else then.model
    now = diagnosed(known, found.now)
    if now is None:
        return (), "The sessions since then are too short for a diagnosis."
    named = [each for each in now.result.effects if each.unsupported is None]
    entries = tuple(
        EffectEntry(
            name=each.name, parameters=plain(each.parameters), share_of_gap=each.share_of_gap, p_value=each.p_value
        )
        for each in named
    )
    gap, u = now.result.gap, f" {now.result.unit}" if now.result.unit else ""
    given, refitted, after = (f"{x.holdout:.3g}{u}" for x in (gap.as_given, gap.refitted, gap.after))
    less = "" if then is None else " that the sessions before give"
    weights = gap.refitted.holdout < REFITTED * gap.as_given.holdout
    by = f"with other weights the model{less} is off by {refitted} rms, not {given}"
    if named:
        names = " and ".join(each.name for each in named)
        return entries, f"The diagnosis names {names}: {by if weights else f'from {refitted} rms'}, with it {after}."
    if weights:
        return (), f"The diagnosis names no effect, but the weights have changed: {by}."
    return (), f"The diagnosis names no effect: {now.sentence()}"
