"""Limited slew rate of the amplifier."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from hystgen.basics.jit import jit
from hystgen.basics.quantities import Positive
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run

BELOW = (0.3, 0.5, 0.7, 1.0, 1.6, 2.2)
"""[decades] Starts below the fastest recorded rate: a limit that never or always acts gives the search no gradient."""

BESIDE = 10.0
"""[times] A step of the drive is at least this many times faster than the adjacent changes, which are about equal in a
smooth drive. Steps between levels at rest exceed it by far, limited only by the converter's noise. Changed by:
test_effects::test_sudden_edges_leave_other_drives_alone. A bend smaller than the limit's travel per sample divided by
this counts as straight: with 2, `friction damper, exchanged` of docs/recordings.csv has the limit as a rival, from 10
to 50 it does not, and steps of `benchmarks.second_plants` (single 23015) are the same."""

MIDDLE = 0.5
"""[samples] Position of a step between two samples of a drive recorded as averages over each sample. Derived: one
average ends and the next begins halfway between the two sample times."""

LEAST = 3.0
"""[decades] From the fastest recorded rate down to the lowest rate tried: a step from sample to sample is more than a
hundred times faster than any other change."""


@jit
def limit(u: Array, up: Array, down: Array, out: Array, off: Array) -> None:
    """Follow `u`, linear between samples, by at most `up_k` upwards and `down_k` downwards per step.

    If the output catches up within a step, it follows `u` for the rest of the step, as far as the limits allow. `off`:
    mean distance from `u` over each step.
    """
    x = u[0]
    out[0] = x
    for k in range(len(u) - 1):
        change = u[k + 1] - u[k]
        ahead = u[k] - x
        closing = up[k] - change if ahead > 0.0 else down[k] + change
        if ahead != 0.0 and not closing > abs(ahead):
            x = x + up[k] if ahead > 0.0 else x - down[k]
            off[k] = 0.5 * (x - u[k + 1] - ahead)
        elif -down[k] <= change <= up[k]:
            part = abs(ahead) / closing if ahead != 0.0 else 0.0
            x = u[k + 1]
            off[k] = -0.5 * part * ahead
        else:
            part = abs(ahead) / closing if ahead != 0.0 else 0.0
            x = u[k] + part * change + (1.0 - part) * (up[k] if change > 0.0 else -down[k])
            off[k] = 0.5 * ((1.0 - part) * (x - u[k + 1]) - part * ahead)
        out[k + 1] = x


@jit
def sudden(t: Array, u: Array, edge: float, times: Array, drive: Array, given: NDArray[np.intp]) -> int:
    """Write the drive with sudden edges into `times` and `drive`, and the position of each sample; returns its length.

    An edge is a change within one sample or two, `BESIDE` times as fast as its neighbours. With `edge` 1/2 it happens
    at the mean time of the change: halfway between two samples or, if an averaging converter shows a sample in between,
    before the end of that sample by the fraction of the step that the sample shows. Any other `edge` shifts it by as
    much as between two samples. A linear filter distinguishes it from a linear edge only by second differences.
    """
    times[0], drive[0], given[0] = t[0], u[0], 0
    n, k, last = 1, 0, len(u) - 1
    while k < last:
        before = abs(u[k] - u[k - 1]) / (t[k] - t[k - 1]) if k > 0 else 0.0
        width = 0
        for ends in (k + 1, k + 2):
            if width == 0 and ends <= last and (u[k + 1] - u[k]) * (u[ends] - u[k + 1]) >= 0.0:
                after = abs(u[ends + 1] - u[ends]) / (t[ends + 1] - t[ends]) if ends < last else 0.0
                if abs(u[ends] - u[k]) > BESIDE * max(before, after) * (t[ends] - t[k]):
                    width = ends - k
        if width == 0:
            k += 1
            times[n], drive[n], given[k] = t[k], u[k], n
            n += 1
            continue
        ends = k + width
        first, second = u[k + 1] - u[k], u[ends] - u[k + 1]
        late = 0.5 * (first * (t[k] + t[k + 1]) + second * (t[k + 1] + t[ends])) / (first + second)
        late = min(max(late + (edge - MIDDLE) * (t[k + 1] - t[k]), t[k]), t[ends])
        behind = width == 2 and late < t[k + 1]
        if width == 2 and not behind:
            times[n], drive[n], given[k + 1] = t[k + 1], u[k], n
            n += 1
        times[n], times[n + 1], drive[n], drive[n + 1] = late, late, u[k], u[ends]
        n += 2
        if behind:
            times[n], drive[n], given[k + 1] = t[k + 1], u[ends], n
            n += 1
        times[n], drive[n], given[ends] = t[ends], u[ends], n
        n += 1
        k = ends
    return n


class _SlewLimit(Effect):
    name: Literal["slew_limit"] = Field(description="name of the effect")
    rate: Positive = Field(description="S, input units per s", examples=[5.0e3])
    falling_rate: Positive = Field(
        default=cast("float", None), description="limit of a falling drive, input units per s; by default the same"
    )

    place: ClassVar[Place] = Place.DRIVE
    shown_by: ClassVar[Mapping[str, int]] = {"fast_steps": 3, "staircase": 3, "fast_triangles": 4, "fast_reversals": 4}
    order: ClassVar[int] = 1
    slews: ClassVar[bool] = True
    compensated: ClassVar[Compensated] = "none"
    compensation: ClassVar[str] = "the drive is kept within it, so the memory matches the actuator's"

    @model_validator(mode="after")
    def _same_rate(self) -> Self:
        if self.falling_rate is None:
            object.__setattr__(self, "falling_rate", self.rate)
        return self

    def time_scale(self, drive_range: float) -> float:
        """The duration of a move over the drive's range."""
        return drive_range / min(self.rate, self.falling_rate)

    def limited(self, u: Array, steps: Array) -> tuple[Array, Array]:
        """The drive limited to the rates, and its mean distance from `u` over each of the steps [s]."""
        out, off = np.empty_like(u), np.empty(len(steps))
        limit(u, self.rate * steps, self.falling_rate * steps, out, off)
        return out, off

    @classmethod
    def _candidate(cls, label: str, n: int, about: About, anywhere: bool = False, **more: Any) -> Candidate:
        """One rate, or one per direction, up to the fastest recorded one; `anywhere`: also the position of edges."""
        fastest = np.log10(max(about.fastest, 1e-12))
        shape = cls.model_fields["shape"].annotation.__args__[0]  # type: ignore[union-attr]

        def build(x: Array) -> Effect:
            numbers = {"rate": 10.0 ** float(x[0]), "falling_rate": 10.0 ** float(x[n - 1])}
            if anywhere:
                numbers["edge"] = min(float(x[n]), 1.0)  # a numerical derivative goes slightly beyond
            return cls(name="slew_limit", shape=shape, **numbers)  # type: ignore[call-arg]

        def beside(rates: Array, edge: float) -> Array:
            return np.append(rates, edge) if anywhere else rates

        none = np.full(n, fastest)
        start, *others = (beside(none - below, MIDDLE) for below in BELOW)
        low, high = beside(none - LEAST, 0.0), beside(none, 1.0)
        return Candidate(label, low, high, start, build, beside(none, MIDDLE), tuple(others), **more)


STRAIGHT, SUDDEN = "slew limit", "slew limit, sudden steps"


class SlewLimit(_SlewLimit):
    """Slew limit `-S_falling <= a' <= S` of the drive: `a` follows `v` as fast as the limit allows.

    Exact if `v` is linear between samples.
    """

    shape: Literal["straight"] = Field(default="straight", description="the drive is linear between samples")

    later: ClassVar[tuple[str, ...]] = ("shape",)

    def drive(self, a: Array, run: Run) -> Array:
        """The limited drive."""
        return self.limited(a, run.steps)[0]

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """One rate, then one for each direction."""
        return [
            cls._candidate(STRAIGHT, 1, about),
            cls._candidate(
                f"{STRAIGHT}, rising and falling", 2, about, beyond=STRAIGHT, grown=lambda x: np.repeat(x, 2)
            ),
        ]


class SuddenSlewLimit(_SlewLimit):
    """The same limit behind a drive whose steps take no time (`sudden`) and which is linear between samples otherwise.

    A generator steps where the record shows a change within a sample or two. If this change is taken as linear, the
    limited edge begins up to a sample early, and the whole edge is early by as much. When the drive steps within that
    time depends on how it was recorded: halfway if samples are averages, at the later sample if a command was recorded
    when the converter took it, at the earlier sample if the converter already had it by then. In a record of averages,
    the signal behind the limit is an average too.
    """

    shape: Literal["sudden"] = Field(description="steps of the drive within one or two samples take no time")
    edge: float = Field(
        default=MIDDLE, ge=0.0, le=1.0,
        description="when such a step happens: 0 at the earlier of two samples, 1 at the later one",
    )

    later: ClassVar[tuple[str, ...]] = ("shape", "edge")

    def drive(self, a: Array, run: Run) -> Array:
        """The limited drive."""
        times, drive, given = np.empty(3 * len(a)), np.empty(3 * len(a)), np.empty(len(a), dtype=np.intp)
        n = sudden(run.t, a, self.edge, times, drive, given)
        times, drive = times[:n], drive[:n]
        then = self.limited(drive, np.diff(times))[0][given]
        return self._averaged(a, then, run.t, times, drive) if self.edge == MIDDLE and n > len(a) else then

    def _averaged(self, a: Array, then: Array, t: Array, times: Array, drive: Array) -> Array:
        """Mean of the limited drive over each sample, which extends halfway to its neighbours; `then`: value at the
        sample.

        Where the drive steps or is linear, a sample `a` is its mean, and the mean distance is added. Where it bends,
        `a` is not its mean, and the bend would exceed the limit: `then` is used instead.
        """
        ends = 0.5 * (t[:-1] + t[1:])
        at = np.searchsorted(times, ends)
        share = (ends - times[at - 1]) / (times[at] - times[at - 1])
        drive = np.insert(drive, at, drive[at - 1] + share * (drive[at] - drive[at - 1]))
        steps = np.diff(np.insert(times, at, ends))
        summed = np.concatenate([[0.0], np.cumsum(self.limited(drive, steps)[1] * steps)])
        first = np.concatenate([[0], at + np.arange(len(at)), [len(steps)]])
        last = np.diff(np.concatenate([t[:1], ends, t[-1:]]))
        jumps = np.add.reduceat((steps == 0.0) & (np.diff(drive) != 0.0), first[:-1]) > 0
        bent = np.abs(drive[first[:-1]] - 2.0 * a + drive[first[1:]])
        stands = bent <= min(self.rate, self.falling_rate) * last / BESIDE
        return np.where(jumps | stands, a + np.diff(summed[first]) / last, then)

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Tried if a limit helps: one rate, one for each direction, and both with the position of the steps free."""
        both = "rising and falling"
        return [
            cls._candidate(SUDDEN, 1, about, beyond=STRAIGHT, grown=lambda x: x),
            cls._candidate(f"{SUDDEN}, {both}", 2, about, beyond=STRAIGHT, grown=lambda x: np.repeat(x, 2)),
            cls._candidate(
                f"{SUDDEN} anywhere", 1, about, True, beyond=STRAIGHT, grown=lambda x: np.append(x, MIDDLE)
            ),
            cls._candidate(
                f"{SUDDEN} anywhere, {both}", 2, about, True, beyond=STRAIGHT,
                grown=lambda x: np.append(np.repeat(x, 2), MIDDLE),
            ),
        ]


SHAPES = (SlewLimit, SuddenSlewLimit)


def load() -> None:
    """Compile the recursions, or load them from the cache, by running them on two samples."""
    two, one = np.arange(2.0), np.ones(1)
    limit(two, one, one, np.empty(2), np.empty(1))
    sudden(two, two, MIDDLE, np.empty(6), np.empty(6), np.empty(2, dtype=np.intp))
