"""Entries of `unexplained`: a type for each kind of observation that no named effect explains, with its sentence."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import ClassVar

from hystgen.basics.problems import counted

INTERPOLATION = "the sensor's interpolation error looks like this"


@dataclass(frozen=True)
class Finding(ABC):
    """An entry of `unexplained`.

    `kind`: the finding's name in `diagnosis.json`; `optional`: keys omitted from that file if they are None or False.
    """

    kind: ClassVar[str]
    optional: ClassVar[frozenset[str]] = frozenset()

    def entry(self) -> dict[str, object]:
        """The entry as it appears in `diagnosis.json`."""
        entry: dict[str, object] = {"kind": self.kind}
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name not in self.optional or (value is not None and value is not False):
                entry[each.metadata.get("key", each.name)] = value
        return entry

    @abstractmethod
    def sentence(self, unit: str | None) -> str:
        """The entry as a sentence without a full stop; `unit`: the unit of the displacement."""

    def advice(self) -> list[str]:
        """Experiments that would reveal more about the finding, one sentence each."""
        return []


@dataclass(frozen=True)
class Fault(Finding):
    """A fault in part of a recording, left out of the comparison or corrected; the rest of the record is sound.

    `noun`: the noun counted in its sentence; `qualifier`: the words after the noun.
    """

    noun: ClassVar[str]
    qualifier: ClassVar[str] = ""

    @property
    def times(self) -> int:
        """How often the fault occurred: its `count`, or 1."""
        return int(getattr(self, "count", 1))


# Whole records -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SwappedChannels(Fault):
    """A record whose drive and displacement columns were swapped and have been put right."""

    kind, noun, qualifier = "swapped_channels", "record", " with swapped columns"
    record: str
    repaired: bool = True

    def sentence(self, unit: str | None) -> str:
        return (
            f"{self.record}: drive and displacement were swapped (the model fits them the other way round); put right"
        )


@dataclass(frozen=True)
class ExchangedRecords(Finding):
    """A record that was left out because it has the output of another record."""

    kind = "exchanged_records"
    record: str
    other: str = field(metadata={"key": "with"})

    def sentence(self, unit: str | None) -> str:
        return f"{self.record}: left out: its output belongs to the drive of {self.other}"


@dataclass(frozen=True)
class Scale(Finding):
    """An output that is `factor` times the expected one, in one record or in `all`."""

    kind = "scale"
    record: str
    factor: float

    def sentence(self, unit: str | None) -> str:
        if self.record == "all":
            return (
                f"the output of all records is {self.factor:.4g} times what the nominal model predicts: other units, "
                "or another sensitivity"
            )
        return (
            f"{self.record}: left out: its output is {self.factor:.4g} times what the other records suggest: other "
            "units of drive or output, another sensor gain, or a dead sensor"
        )


@dataclass(frozen=True)
class OtherHistory(Fault):
    """A given history that the starts of the records contradict, with the rms errors at the starts and elsewhere."""

    kind, noun, qualifier = "history", "history", " that the starts contradict"
    record: str
    samples: int
    start: float
    rest: float

    def sentence(self, unit: str | None) -> str:
        u = _unit(unit)
        return (
            f"the output of the first {counted(self.samples, 'sample')}, which depends on the history, is off by "
            f"{self.start:.3g}{u} rms, that of all others by {self.rest:.3g}{u}: the actuator came from elsewhere, "
            "and the history is ignored"
        )


# Single samples ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Saturated(Fault):
    """Samples at a limit of the converter; `first`: time of the first such sample, s; `end`: `largest` or `least`."""

    kind, noun, qualifier = "saturated", "sample", " at the converter's limit"
    optional = frozenset(("first", "end", "level"))
    record: str
    first: float | None
    end: str | None
    level: float | None
    count: int

    def sentence(self, unit: str | None) -> str:
        samples = f"{counted(self.count, 'sample')} at the converter's limit, {self.level:.6g}{_unit(unit)}"
        return f"{self.record}: {samples}, not compared{_first(self.first)}"


@dataclass(frozen=True)
class DropOuts(Fault):
    """Stretches in which the output was lost; `level`: value of the lost output, if constant."""

    kind, noun = "drop_outs", "drop-out"
    optional = frozenset(("level",))
    record: str
    first: float
    level: float | None
    count: int
    samples: int

    def sentence(self, unit: str | None) -> str:
        level = "" if self.level is None else f" to {self.level:.6g}{_unit(unit)}"
        return f"{self.record}: {counted(self.count, 'drop-out')}{level}, {_not_compared(self.samples, self.first)}"


@dataclass(frozen=True)
class HeldSamples(Fault):
    """Stretches in which the output repeats a value while the drive moves."""

    kind, noun, qualifier = "held_samples", "stretch", " of held samples"
    optional = frozenset(("first",))
    record: str
    first: float | None
    count: int
    samples: int

    def sentence(self, unit: str | None) -> str:
        stands = f"the output stands still {counted(self.count, 'time')} while the drive moves"
        return f"{self.record}: {stands}, {_not_compared(self.samples, self.first)}"


@dataclass(frozen=True)
class IsolatedSamples(Fault):
    """Single samples of a channel, `v` or `y`, far from their neighbours."""

    kind, noun = "isolated_samples", "isolated sample"
    record: str
    channel: str
    first: float
    count: int

    def sentence(self, unit: str | None) -> str:
        done = "bridged" if self.channel == "v" else "not compared"
        number = counted(self.count, "isolated sample")
        return f"{self.record}: {number} of {self.channel} far from their neighbours, {done}{_first(self.first)}"


# Disturbances ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Line(Finding):
    """A spectral line at a frequency, Hz; `share`: its fraction of the error variance in the `records` that show it."""

    kind = "line"
    optional = frozenset(("mains", "repaired"))
    frequency: float
    amplitude: float
    share: float
    records: tuple[str, ...]
    mains: float | str | None = None
    repaired: bool = False

    @property
    def place(self) -> float:
        """The line's position on the frequency axis, Hz."""
        return self.frequency

    def sentence(self, unit: str | None) -> str:
        mains = self.mains
        hum = "" if mains is None else f" (mains hum{'' if isinstance(mains, float) else f', {mains}'})"
        return (
            f"a line at {self.frequency:.4g} Hz{hum}, amplitude {self.amplitude:.3g}{_unit(unit)}, in "
            f"{several(self.records)}: {100.0 * self.share:.0f} % of the error's variance there"
            + _taken_out(self.repaired)
        )


@dataclass(frozen=True)
class Ripple(Finding):
    """A periodic error over position; `pitch`: output units."""

    kind = "ripple"
    optional = frozenset(("repaired",))
    pitch: float
    amplitude: float
    share: float
    records: tuple[str, ...]
    repaired: bool = False

    @property
    def place(self) -> float:
        """The ripple's position on the axis of pitches, output units."""
        return self.pitch

    def sentence(self, unit: str | None) -> str:
        u = _unit(unit)
        return (
            f"a ripple over the position with a pitch of {self.pitch:.4g}{u}, amplitude {self.amplitude:.3g}{u}, in "
            f"{several(self.records)}: {100.0 * self.share:.0f} % of the error's variance; {INTERPOLATION}"
            + _taken_out(self.repaired)
        )


Periodic = Line | Ripple


@dataclass(frozen=True)
class StickSlip(Finding):
    """Jumps of the output after a standstill: their number, the time of the first jump (s) and their median size."""

    kind = "stick_slip"
    record: str
    count: int
    first: float
    size: float

    def sentence(self, unit: str | None) -> str:
        jumps = f"{counted(self.count, 'jump')} of about {self.size:.3g}{_unit(unit)}"
        return f"{self.record}: stick-slip, {jumps} after standing still, the first at {self.first:.6g} s"


# The hysteresis itself ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class NotAPlaySum(Finding):
    """Hysteresis that forgets continuously as the drive travels, not only where minor loops close.

    `before`: held-out rms error with plays and named effects; `after`: the same with an added element that forgets over
    `way`, a fraction of the drive range; `open`: gap left by a minor loop over a tenth of the range, as a fraction of
    its height; `in_place_of`: effects that would explain as much, or less; `shows_speed`: whether the drive covers
    equal distances in different times.
    """

    kind = "not_a_play_sum"
    before: float
    after: float
    way: float
    open: float
    in_place_of: tuple[str, ...]
    shows_speed: bool

    def sentence(self, unit: str | None) -> str:
        named = " and ".join(self.in_place_of)
        instead = (
            "" if not named else f"; {named} would explain less of it" if self.shows_speed else
            f"; {named} would explain about as much, but the drive always covers equal distances in equal times"
        )
        return (
            f"the hysteresis is not a play sum: minor loops stay open, by {100.0 * self.open:.0f} % of their height if "
            f"they span a tenth of the drive range, and depend on the earlier drive. A part that forgets over "
            f"{100.0 * self.way:.2g} % of the range reduces the held-out rms error from {self.before:.4g} to "
            f"{self.after:.4g}{_unit(unit)}{instead}"
        )

    def advice(self) -> list[str]:
        """Where to read about the residual error on such a stage, and how to identify speed-dependent effects."""
        page = "docs/plants.md shows the residual error of a play sum on a stage with such hysteresis"
        if self.shows_speed:
            return [page]
        return [page, "record the same path at two speeds: a lag, creep and rate dependence then differ from it"]


@dataclass(frozen=True)
class WildInverse(Finding):
    """Effects that were found but are not written, since their inverse does more than the recordings support.

    `moves`: rms change that the inverse with the effects causes in the plain model's output, over recorded outputs;
    `other`: the same with the two models exchanged; `gain`: held-out rms that the effects explain; `wilder`: second
    differences of the drive with the effects, divided by those of the plain inverse's drive.
    """

    kind = "wild_inverse"
    names: tuple[str, ...]
    moves: float
    other: float
    gain: float
    wilder: float

    def sentence(self, unit: str | None) -> str:
        u = _unit(unit)
        return (
            f"{' and '.join(self.names)} would explain {self.gain:.3g}{u} rms of held-out records but is not written: "
            f"over the recorded outputs the inverse with it moves the output of the plain model by {self.moves:.3g}{u} "
            f"rms, with a drive {self.wilder:.2g} times as rough as the plain inverse's"
        )


# The remaining error -----------------------------------------------------------------------------------------

VARIABLE_NAMES = {
    "drive": "the drive", "rate": "the drive rate", "displacement": "the displacement", "memory": "the memory",
    "loop centre": "the loop's centre", "session time": "the session time",
    "time in the record": "the time in the record", "travel": "the distance travelled",
}


@dataclass(frozen=True)
class Structured(Finding):
    """An error above the noise that no effect removes.

    `share_by_variable`: fractions of its variance that smooth functions of one variable explain on samples not used to
    fit them; `main_variable`: the variable with the largest fraction, None if none matters; `rate_free`, `repeatable`:
    None if the records cannot tell; `even_share`: even part, about the middle of the range, of its dependence on drive
    and direction; `held_out_alone`: held-out records that show the error although no fitted record does.
    """

    kind = "structure"
    rms: float
    above_floor: float | None
    main_variable: str | None
    share_by_variable: Mapping[str, float]
    rate_free: bool | None
    repeatable: bool | None
    repeatable_share: float | None
    even_share: float | None
    held_out_alone: tuple[str, ...]

    def sentence(self, unit: str | None) -> str:
        times = f", {times_noise(self.above_floor)}" if self.above_floor else ""
        return f"an error of {self.rms:.3g}{_unit(unit)} rms remains{times}; it {self.words()}"

    def words(self) -> str:
        """What the error depends on, as a predicate."""
        parts = []
        if self.main_variable:
            share = 100.0 * self.share_by_variable[self.main_variable]
            parts.append(f"depends mostly on {VARIABLE_NAMES[self.main_variable]} ({share:.0f} % of its variance)")
        else:
            parts.append("depends on none of drive, rate, displacement, memory, loop centre, time and travel alone")
        if self.rate_free is not None:
            parts.append("does not depend on the rate" if self.rate_free else "depends on the rate")
        if self.repeatable is not None:
            returns = "recurs when the drive repeats itself"
            parts.append(returns if self.repeatable else "does not recur with the drive")
        if self.even_share is not None:
            odd = EVEN[0] > self.even_share
            parity = "even" if self.even_share > EVEN[1] else "odd" if odd else "neither even nor odd"
            parts.append(f"is {parity} about the middle of the drive")
        return ", ".join(parts[:-1]) + " and " + parts[-1] if len(parts) > 1 else parts[0]

    def advice(self) -> list[str]:
        advice = []
        if self.held_out_alone:  # these are never fitted, so an effect that shows only in them cannot be found
            alone = several(self.held_out_alone)
            advice.append(f"fit {alone} too and hold out others: the remaining error shows only in held-out records")
        if self.rate_free is None:
            advice.append(
                "record the same loops at two rates a decade apart: that shows whether the remaining error is rate-free"
            )
        if self.repeatable is None:
            advice.append("repeat a record ten times: that separates the part that recurs from noise")
        return advice


EVEN = 0.3, 0.7
"""Even fractions below which an error is called odd, and above which it is called even."""


# Words -------------------------------------------------------------------------------------------------------

FAULTS = (SwappedChannels, Saturated, DropOuts, HeldSamples, IsolatedSamples, OtherHistory)
"""The order in which faults are listed."""


def faults(findings: Sequence[Finding]) -> str:
    """The kinds of faults with their counts, in a few words; empty if there are none."""
    parts = []
    for fault in FAULTS:
        found = [each for each in findings if isinstance(each, fault)]
        if not found:
            continue
        number = sum(each.times for each in found)
        plural = "stretches" if fault.noun == "stretch" and number != 1 else None
        parts.append(f"{f'{number} {plural}' if plural else counted(number, fault.noun)}{fault.qualifier}")
    return ", ".join(parts)


def several(names: Sequence[str]) -> str:
    """Names of records, shortened if there are more than three."""
    return ", ".join(names) if len(names) <= 3 else f"{len(names)} records ({names[0]}, {names[1]}, ..)"


MANY = 100.0
"""[times the noise] Larger ratios are not printed as numbers: they would need three digits, more than the estimated
noise supports. Only the wording depends on this number. Changed by:
report::test_ratios_to_the_noise_have_two_digits."""


def times_noise(ratio: float) -> str:
    """An error as a multiple of the noise, as text."""
    return f"{float(f'{ratio:.2g}'):g} times the noise" if ratio <= MANY else f"more than {MANY:g} times the noise"


def _unit(unit: str | None) -> str:
    return f" {unit}" if unit else ""


def _first(first: float | None) -> str:
    return "" if first is None else f", the first at {first:.6g} s"


def _not_compared(samples: int, first: float | None) -> str:
    return f"{counted(samples, 'sample')} not compared{_first(first)}"


def _taken_out(repaired: bool) -> str:
    return "; removed from the records before the search for effects" if repaired else ""
