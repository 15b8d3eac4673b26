"""A planned session, played without a break, and its recording, which is cut into records."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import ParameterError, PlanError, Problem, path_text, shown
from hystgen.basics.problems import Path as Place
from hystgen.parameters.yaml import MAX_BYTES, read
from hystgen.planning.converter import CODINGS, Dac, wrong_bits, wrong_range
from hystgen.records import Record

FILE = "session.json"

OFF = 0.05
"""[fraction of the drives' span] Distance from the lowest drive within which a record must start and end, which allows
for a monitor's gain and noise. In a recording that is out of step with its session, records start and end anywhere."""


@dataclass(frozen=True)
class PlayedRecord:
    """A record of the session: `samples` samples played from sample `first` on."""

    name: str
    first: int
    samples: int
    held_out: bool


@dataclass(frozen=True)
class Session:
    """The signal played: `samples` at `rate`, Hz, containing `records`.

    `history`: drives visited before the first record and at the end of each, namely the highest and the lowest of all;
    `rest`: pause between records, s; `rise`: time in s from the first sample to the first rise through the middle
    between these two, used to align a recording; `dac`: the fields of the converter, if there are codes.
    """

    rate: float
    samples: int
    history: tuple[float, float]
    rest: float
    rise: float
    records: tuple[PlayedRecord, ...]
    dac: Mapping[str, object] | None = None

    def to_json(self) -> str:
        """`session.json`."""
        return json.dumps({"hystgen": 1, **asdict(self)}, indent=2, allow_nan=False) + "\n"

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Session:
        """Read the session from a file written by `--plan`. Raises ParameterError with every problem in it, OSError."""
        file = os.fspath(path)
        with open(file, "rb") as stream:
            content = stream.read(MAX_BYTES + 1)
        if len(content) > MAX_BYTES:
            raise ParameterError(file, [Problem("", f"has more than {MAX_BYTES} bytes; {GIVE}")])
        try:
            text = content.decode("utf-8")
        except UnicodeDecodeError:
            raise ParameterError(file, [Problem("", f"is not UTF-8; {GIVE}")]) from None
        document = read(text)  # JSON is YAML; our reader does not recurse, and it records positions
        problems = list(document.problems)
        if document.complete:
            problems += [
                Problem(path_text(place), what, *document.position(place, at_key=at_key))
                for place, what, at_key in _problems(document.data)
                if place not in document.poisoned
            ]
        if problems:
            raise ParameterError(file, problems)
        parts = tuple(PlayedRecord(**part) for part in document.data["records"])
        given = {key: value for key, value in document.data.items() if key != "hystgen"}
        return cls(**{**given, "records": parts})

    def cut(self, recording: Record) -> tuple[list[Record], list[Record]]:
        """The records to fit and the held-out records, cut from a recording of the whole session.

        The recording has its own clock, sample rate and start; it is aligned where the drive first rises through the
        middle, which is before the first record. Raises PlanError if it does not fit the session.
        """
        top, bottom = self.history
        start = self._start(recording.name, recording.t, recording.v)
        half = 0.5 * recording.sample_time
        to_fit: list[Record] = []
        held: list[Record] = []
        for part in self.records:
            first = start + part.first / self.rate
            last = first + (part.samples - 1) / self.rate
            a, b = np.searchsorted(recording.t, [first - half, last + half])
            if recording.t[-1] < last - half or b - a < 2:
                raise PlanError(
                    [
                        f"{recording.name}: ends {recording.t[-1] - start:.6g} s after the start of the session, but "
                        f"{part.name} ends at {last - start:.6g} s; record the session to its end"
                    ]
                )
            record = recording.section(int(a), int(b), part.name)
            off = [abs(v - bottom) for v in (record.v[0], record.v[-1])]
            if max(off) > OFF * (top - bottom):
                raise PlanError(
                    [
                        f"{recording.name}: the drive is {record.v[0]:.6g} and {record.v[-1]:.6g} at the ends of "
                        f"{part.name}, not {bottom:.6g}; is it a recording of this session, at this rate?"
                    ]
                )
            (held if part.held_out else to_fit).append(record)
        return to_fit, held

    def _start(self, name: str, t: NDArray[np.float64], v: NDArray[np.float64]) -> float:
        """Start of the session on the recording's clock. Raises PlanError."""
        top, bottom = self.history
        span, middle = top - bottom, 0.5 * (top + bottom)
        low, high = (float(np.quantile(v, share)) for share in (0.001, 0.999)) if len(v) else (0.0, 0.0)
        if abs(low - bottom) > OFF * span or abs(high - top) > OFF * span:
            raise PlanError(
                [
                    f"{name}: the drive goes from {low:.6g} to {high:.6g}, but in the session from {bottom:.6g} to "
                    f"{top:.6g}; give the drive in the units of the model"
                ]
            )
        rising = crossing(t, v, middle)
        if rising is None:
            raise PlanError([f"{name}: the drive never rises; is it a recording of this session?"])
        return rising - self.rise


GIVE = f"give the {FILE} that hystgen diagnose --plan --rate wrote"


def _number(low: float, strict: bool = False) -> Callable[[object], str]:
    """A function that returns the problem with a value, empty if it is a finite number >= `low` (> if `strict`)."""
    wanted = f"a number {'above' if strict else 'of at least'} {low:g}"

    def wrong(value: object) -> str:
        right = isinstance(value, int | float) and not isinstance(value, bool) and -HUGE < value < HUGE and (
            value > low or (value == low and not strict)
        )
        return "" if right else f"{wanted}, not {shown(value)}"

    return wrong


def _whole(low: int) -> Callable[[object], str]:
    def wrong(value: object) -> str:
        right = isinstance(value, int) and not isinstance(value, bool) and low <= value < HUGE
        return "" if right else f"a whole number, at least {low}, not {shown(value)}"

    return wrong


def _history(value: object) -> str:
    pair = isinstance(value, tuple) and len(value) == 2 and not any(map(_number(-HUGE), value)) and value[0] > value[1]
    return "" if pair else "the highest and the lowest drive, [highest, lowest]"


HUGE = 1e30
"""Numbers in a session must stay below this, like those in a parameter file."""

FIELDS: Mapping[str, Callable[[object], str]] = {
    "hystgen": lambda value: "" if value == 1 and isinstance(value, int) else f"1, not {shown(value)}",
    "rate": _number(0.0, strict=True),
    "samples": _whole(2),
    "history": _history,
    "rest": _number(0.0),
    "rise": _number(0.0),
    "records": lambda value: "" if isinstance(value, tuple) and value else f"a list of records, not {shown(value)}",
    "dac": lambda value: "" if value is None or isinstance(value, dict) else f"a mapping or null, not {shown(value)}",
}
"""Keys of the file, each with a function that returns the problem with a value."""

PART_FIELDS: Mapping[str, Callable[[object], str]] = {
    "name": lambda value: "" if isinstance(value, str) and value else f"text, not {shown(value)}",
    "first": _whole(0),
    "samples": _whole(2),
    "held_out": lambda value: "" if isinstance(value, bool) else f"true or false, not {shown(value)}",
}

DAC_FIELDS: Mapping[str, Callable[[object], str]] = {
    "bits": _whole(1),
    "low": _number(-HUGE),
    "high": _number(-HUGE),
    "coding": lambda value: "" if value in CODINGS else f"{' or '.join(CODINGS)}, not {shown(value)}",
}

Wrong = tuple[Place, str, bool]
"""Position and text of a problem, and whether it concerns the key rather than the value."""


def _of_fields(
    place: Place, content: Mapping[str, object], fields: Mapping[str, Callable[[object], str]]
) -> Iterator[Wrong]:
    """Problems with keys of a mapping that are unknown, missing, or have a wrong value."""
    for key in content.keys() - fields.keys():
        yield (*place, key), f"this key is unknown; {GIVE}", True
    for key, check in fields.items():
        if key not in content:
            yield (*place, key), f"is missing; {GIVE}", False
        elif wrong := check(content[key]):
            yield (*place, key), f"has to be {wrong}; {GIVE}", False


def _problems(content: Mapping[str, Any]) -> Iterator[Wrong]:
    """All problems in the content of a file."""
    found = list(_of_fields((), content, FIELDS))
    yield from found
    wrong = {place for place, _, _ in found}
    if isinstance(content.get("dac"), dict):
        own = list(_of_fields(("dac",), content["dac"], DAC_FIELDS))
        yield from own
        if not own:
            dac = Dac(**content["dac"])
            for what in (*wrong_bits(dac.bits), *wrong_range(dac.low, dac.high)):
                yield ("dac",), f"{what}; {GIVE}", False
    end, names = 0, set()
    for k, part in enumerate(() if ("records",) in wrong or "records" not in content else content["records"]):
        place: Place = ("records", k)
        if not isinstance(part, dict):
            yield place, f"has to be a record, not {shown(part)}; {GIVE}", False
            continue
        own = list(_of_fields(place, part, PART_FIELDS))
        yield from own
        if own:
            continue
        if part["name"] in names:
            yield (*place, "name"), f"{shown(part['name'])} is the name of an earlier record; {GIVE}", False
        if part["first"] < end:
            yield (*place, "first"), f"begins within the previous record, which ends at sample {end}; {GIVE}", False
        names.add(part["name"])
        end = part["first"] + part["samples"]
        if ("samples",) not in wrong and "samples" in content and end > content["samples"]:
            yield (*place, "samples"), f"ends at sample {end}, but the session at {content['samples']}; {GIVE}", False


def crossing(t: NDArray[np.float64], v: NDArray[np.float64], middle: float) -> float | None:
    """When a drive first rises through `middle`, s; None if it does not."""
    rising = np.flatnonzero((v[:-1] < middle) & (v[1:] >= middle))
    if not len(rising):
        return None
    k = int(rising[0])
    share = (middle - v[k]) / (v[k + 1] - v[k])
    return float(t[k] + share * (t[k + 1] - t[k]))
