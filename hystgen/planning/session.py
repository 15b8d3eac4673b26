"""A planned session as it is played in one go, and a recording of it, cut into its records."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import PlanError
from hystgen.records import Record

FILE = "session.json"

OFF = 0.05
"""Share of the drives' span by which a record may begin and end beside the lowest drive: gain and noise of a monitor.
A recording that is out of step with its session begins and ends anywhere."""


@dataclass(frozen=True)
class Part:
    """A record of the session: the samples played from `first` on."""

    name: str
    first: int
    samples: int
    held_out: bool


@dataclass(frozen=True)
class Session:
    """What is played: `samples` at `rate`, Hz, with `records` in it.

    `history`: drives visited before the first record and at the end of each, the highest and the lowest of all; `rest`:
    s between them; `rise`: s from the first sample to the first crossing of the middle between both, by which a
    recording is aligned; `dac`: the converter, as its fields, if there are codes.
    """

    rate: float
    samples: int
    history: tuple[float, float]
    rest: float
    rise: float
    records: tuple[Part, ...]
    dac: Mapping[str, Any] | None = None

    def to_json(self) -> str:
        """`session.json`."""
        return json.dumps({"hystgen": 1, **asdict(self)}, indent=2, allow_nan=False) + "\n"

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Session:
        """The session of a file that `--plan` wrote. Raises PlanError, OSError."""
        wrong = f"{os.fspath(path)}: no session; give the {FILE} that hystgen diagnose --plan --rate wrote"
        try:
            content = json.loads(Path(path).read_text(encoding="utf-8"))
            version = content.pop("hystgen")
            parts = tuple(Part(**part) for part in content.pop("records"))
            top, bottom = content.pop("history")
            found = cls(history=(top, bottom), records=parts, **content)
            inside = all(part.first >= 0 and part.first + part.samples <= found.samples for part in parts)
            right = version == 1 and inside and found.rate > 0.0 and top > bottom
            right = right and bool(np.isfinite([found.rate, found.rest, found.rise, top, bottom]).all())
        except (ValueError, TypeError, KeyError, AttributeError):
            right = False
        if not right:
            raise PlanError([wrong])
        return found

    def cut(self, recording: Record) -> tuple[list[Record], list[Record]]:
        """The records to fit and those held out of a recording of the whole session.

        The recording has its own clock, sample rate and start; it is aligned where the drive first rises through the
        middle, which is before the first record. Raises PlanError where it does not fit the session.
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
                        f"{recording.name}: ends {recording.t[-1] - start:.6g} s after the start of the session, and "
                        f"{part.name} at {last - start:.6g} s; record the session to its end"
                    ]
                )
            record = recording.section(int(a), int(b), part.name)
            off = [abs(v - bottom) for v in (record.v[0], record.v[-1])]
            if max(off) > OFF * (top - bottom):
                raise PlanError(
                    [
                        f"{recording.name}: the drive is {record.v[0]:.6g} and {record.v[-1]:.6g} where {part.name} "
                        f"begins and ends at {bottom:.6g}; is it a recording of this session, at this rate?"
                    ]
                )
            (held if part.held_out else to_fit).append(record)
        return to_fit, held

    def _start(self, name: str, t: NDArray[np.float64], v: NDArray[np.float64]) -> float:
        """When the session began, on the recording's clock. Raises PlanError."""
        top, bottom = self.history
        span, middle = top - bottom, 0.5 * (top + bottom)
        low, high = (float(np.quantile(v, share)) for share in (0.001, 0.999)) if len(v) else (0.0, 0.0)
        if abs(low - bottom) > OFF * span or abs(high - top) > OFF * span:
            raise PlanError(
                [
                    f"{name}: the drive goes from {low:.6g} to {high:.6g}, that of the session from {bottom:.6g} to "
                    f"{top:.6g}; give the drive in the units of the model"
                ]
            )
        rising = crossing(t, v, middle)
        if rising is None:
            raise PlanError([f"{name}: the drive never rises; is it a recording of this session?"])
        return rising - self.rise


def crossing(t: NDArray[np.float64], v: NDArray[np.float64], middle: float) -> float | None:
    """When a drive first rises through `middle`, s; None where it does not."""
    rising = np.flatnonzero((v[:-1] < middle) & (v[1:] >= middle))
    if not len(rising):
        return None
    k = int(rising[0])
    share = (middle - v[k]) / (v[k + 1] - v[k])
    return float(t[k] + share * (t[k + 1] - t[k]))
