"""A model as `hystgen.load` returns it: its parameters and the chain that they describe."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.arithmetic import ARITHMETICS, FIXED
from hystgen.basics import arguments, display, drawing
from hystgen.basics.problems import EffectsError, FormatError, UnsupportedEffectsError, counted, duration
from hystgen.cascade import PI, Cascade
from hystgen.compensator import engines, remarks, tables
from hystgen.compensator.reference import Session
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.stage import Stage
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.parameters.files import load_parameters
from hystgen.parameters.schema import Parameters
from hystgen.plays import slots

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hystgen.chain.chain import Chain
    from hystgen.chain.settling import Settling
    from hystgen.compensator.chain.layout import ChainTables, Compiled
    from hystgen.compensator.chained import Compensator
    from hystgen.compensator.converter import CodeConversion
    from hystgen.compensator.health import Watch
    from hystgen.compensator.layout import FixedTables, Tables
    from hystgen.effects import Effect, Run
    from hystgen.records.frames import Given
    from hystgen.records.memory import Frame


MOST_A_CODE = 0.01
"""[fraction of the drive's range] Largest move of the drive per code of the reference in fixed point; anything more is
noise."""

MOST_GAIN = 100.0
"""[times the gain at rest] Largest noise gain of an inverse unless the user allows more: white noise of 1e-4 of the
reference's range then becomes 0.6 to 1.5 % of the drive's range, about MOST_A_CODE, with a lag of 25 samples. Set by:
benchmarks/chosen_numbers.py noisy."""

SETTLED = 0.01
"""[fraction of the final step] Default error within which the output counts as settled after a step."""


def cascade_of(parameters: Parameters) -> Cascade:
    """The mathematical model that a parameter file describes."""
    part = parameters.model
    stages: list[Stage] = []
    for stage in part.memoryless:
        if stage.kind == "dead_zone":
            stages.append(DeadZone(stage.thresholds, stage.weights))
        else:
            up, down = stage.ascending, stage.descending or stage.ascending
            stages.append(
                TanhEnvelope((up.a0, up.a1, up.a2, up.a3), (down.a0, down.a1, down.a2, down.a3))
            )
    pi = PI(part.pi.thresholds, part.pi.weights, part.pi.initial_state)
    return Cascade(pi, tuple(stages), part.output_offset, parameters.input_range)


Signal: TypeAlias = "ArrayLike | Frame | Mapping[str, ArrayLike]"
"""Samples (N,), a series, or a data frame or mapping with a column of samples."""

Answers: TypeAlias = tuple[NDArray[Any], list[str]]
"""Output samples (N,) of an operator, in the type of its arithmetic, and remarks about them."""


@dataclass(frozen=True)
class Model:
    """A model as given by its parameter file: `parameters`, and the mathematics in `cascade`."""

    parameters: Parameters

    def __repr__(self) -> str:
        low, high = self.cascade.input_range
        unit = f" {self.parameters.units.input}" if self.parameters.units.input else ""
        effects = ", ".join(dict.fromkeys(effect.name for effect in self.effects))
        facts = [
            counted(self.cascade.pi.n, "play") + (" behind a front" if self.cascade.stages else ""),
            f"{low:g} to {high:g}{unit}",
            *([f"effects {effects}"] if effects else []),
            "no inverse" if self.cascade.inverse_problems() else "invertible",
        ]
        return f"<Model {self.name}: {', '.join(facts)}>"

    def _repr_html_(self) -> str:
        return display.block(repr(self), draw=self._figure)

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """A picture of loops, the initial loading curve and, if it exists, the inverse with its accuracy.

        Returns a matplotlib Figure, which a notebook displays; it is also saved to `path`, a .png or .svg file, if
        given. Effects are not drawn. Needs matplotlib, from the extra `plot`. Raises PlotError, OSError.
        """
        return drawing.picture(self._figure, path)

    def _figure(self) -> Figure:
        from hystgen import portrait

        shown = not self.cascade.inverse_problems() and not self.effects
        inverse = (lambda u: self.inverse().answers(u)[0]) if shown else None
        return portrait.figure(self.name, self.cascade, self.parameters.units, inverse, bool(self.effects))

    @cached_property
    def cascade(self) -> Cascade:
        """Stages, play sum, offset and input range."""
        return cascade_of(self.parameters)

    @property
    def name(self) -> str:
        """C identifier that prefixes every emitted symbol."""
        return self.parameters.name

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects beyond the static model, as in the parameter file."""
        return self.parameters.model.effects

    @cached_property
    def chain(self) -> Chain:
        """The static model with its effects."""
        from hystgen.chain.chain import Chain

        return Chain(self.cascade, self.effects)

    def need_static(self, what: str) -> None:
        """Raise UnsupportedEffectsError if the model has effects, which `what` ("the inverse") does not cover yet."""
        if self.effects:
            names = ", ".join(dict.fromkeys(effect.name for effect in self.effects))
            raise UnsupportedEffectsError(
                f"{what} of a model with effects ({names}) is not supported yet; remove model.effects, or simulate "
                "the model and its inverse in double precision"
            )

    @property
    def sample_time_advice(self) -> str:
        """The line to add to a parameter file without a sample time: that of the records behind the model, if known."""
        step = self.parameters.recorded_at
        return "`sample_time: SECONDS`" if step is None else f"`sample_time: {step:.4g}` (recorded at {duration(step)})"

    def need_compensated(self, arithmetic: str, operator: str) -> None:
        """Raise an error with all reasons if an operator in `arithmetic` cannot include all of the model's effects.

        Raises UnsupportedEffectsError, EffectsError without a sample time, NotInvertibleError as `inverse` does.
        """
        if not self.effects:
            return
        names = ", ".join(dict.fromkeys(effect.name for effect in self.effects))
        if self.parameters.sample_time is None:
            raise EffectsError(
                f"C for a model with effects ({names}) needs sample_time in the parameter file; add "
                f"{self.sample_time_advice}, the time in s between two calls of step"
            )
        if refused := self.refusals(operator, arithmetic):
            raise UnsupportedEffectsError(
                "not in the C: " + "; ".join(f"{effect.name}: {reason}" for effect, reason in refused)
                + "; remove it from model.effects, or leave it out with --allow-partial"
            )
        if operator != "forward":
            self.inverse()
            self._check_noise_gain(arithmetic)
            if self.parameters.emit.compensation.quiet and self.cascade.branches_differ:
                raise UnsupportedEffectsError(
                    "emit.compensation.quiet: with effects, a drive in front of a memoryless part with two branches "
                    "cannot be held near its target; give both branches the same parameters, or leave out quiet: "
                    "with one lag the drive comes to rest anyway"
                )

    def _check_noise_gain(self, arithmetic: str) -> None:
        """Raise UnsupportedEffectsError if the inverse amplifies the noise of the reference more than is allowed."""
        from hystgen.compensator.chain import layout, noise
        from hystgen.compensator.chain.parts import Parts

        how, seconds = self.parameters.emit.compensation, self.parameters.sample_time
        assert seconds is not None
        responses = layout.gain(self.cascade, Parts.of(self.effects), seconds, how)
        gain = noise.largest(responses)
        if how.noise_gain is not None:
            noise.check(gain, how.noise_gain)
            return
        advice = (
            "limit it by averaging the reference with emit.compensation.noise_gain: 10, or allow it with "
            f"noise_gain: {math.ceil(gain)}"
        )
        if arithmetic in FIXED:
            low, high = (int(end) for end in self.compiled(arithmetic).tables.limits.output[0])
            if gain > MOST_A_CODE * (high - low):
                raise UnsupportedEffectsError(
                    f"with a noise gain of {gain:.4g}, a step of one of the reference's {high - low} codes in "
                    f"{arithmetic} moves the drive by {100.0 * gain / (high - low):.2g} % of its range; use "
                    f"{ARITHMETICS[arithmetic].finer}, or {advice}"
                )
        if gain > MOST_GAIN:
            drive, hertz = noise.loudest(responses)
            units = self.parameters.units
            raise UnsupportedEffectsError(
                f"the noise gain is {gain:.4g}, above {MOST_GAIN:g}: reference noise of 1 "
                f"{units.output or 'output unit'} rms at {hertz:.4g} Hz would move the drive by {drive:.4g} "
                f"{units.input or 'input units'} rms; {advice}"
            )

    def refusals(self, operator: str, arithmetic: str) -> list[tuple[Effect, str]]:
        """The effects that an emitted operator cannot include, each with the reason; empty without a sample time."""
        if not self.effects or self.parameters.sample_time is None:
            return []
        from hystgen.compensator.chain import tables as chain_tables

        how = self.parameters.emit.compensation
        return list(chain_tables.refusals(self.chain, operator, self.parameters.sample_time, arithmetic, how))

    def without(self, effects: Sequence[Effect]) -> Model:
        """The model with these effects left out."""
        part = self.parameters.model
        kept = tuple(effect for effect in part.effects if effect not in effects)
        return Model(self.parameters.model_copy(update={"model": part.model_copy(update={"effects": kept})}))

    def engine(
        self, engine: str | None = None, operator: str | None = None, arithmetic: str | None = None,
        optimize: str | None = None, loads: bool = False,
    ) -> str:
        """'corners' or 'loop': the given engine, else the parameter file's; `auto` picks the better for `optimize`.
        `loads`: whether the C loads its parameters at run time."""
        emit = self.parameters.emit
        if self.effects:
            own = [
                effect.name
                for effect in self.effects
                if effect.moves_plays() or effect.bends_plays() or effect.joins_plays()
            ]
            if own and (engine or emit.engine) == "corners":
                raise UnsupportedEffectsError(
                    f"the corner engine derives plays from the turning points of the drive, but {' and '.join(own)} "
                    "moves, bends or joins them in its own way; give --engine loop, or auto"
                )
            if own:
                return "loop"
        about = (operator or emit.operator, arithmetic or emit.arithmetic)
        return engines.choose(
            engine or emit.engine, optimize or emit.optimize, self.cascade, *about, bool(self.effects), loads
        )

    def tables(
        self, arithmetic: str, engine: str, operator: str | None = None
    ) -> Tables | FixedTables | ChainTables:
        """The tables of an emitted operator (by default the parameter file's) in the number format of `arithmetic`."""
        if self.effects:
            self.need_compensated(arithmetic, operator or self.parameters.emit.operator)
            return self.compiled(arithmetic, engine).tables
        return tables.build(self.cascade, arithmetic, engine, lsb=self._lsb)

    def compiled(self, arithmetic: str, engine: str = "loop") -> Compiled:
        """The numbers of a model with effects in an arithmetic. Raises FormatError."""
        from hystgen.compensator.chain import tables as chain_tables

        seconds = self.parameters.sample_time
        assert seconds is not None, "need_compensated asks for it"
        emit, (drive, output) = self.parameters.emit, self._lsb
        if drive is None and emit.converter and emit.compensation.quiet:
            from hystgen.compensator import fixed_tables
            from hystgen.compensator.converter import CodeLine

            step = abs(CodeLine.of(emit.converter.drive).step)  # a drive that stands still has to do so there
            if arithmetic not in FIXED or step >= fixed_tables.lsbs(self.cascade, arithmetic)[0]:
                drive = float(step)
        return chain_tables.build(self.chain, arithmetic, seconds, emit.compensation, (drive, output), engine)

    def units_per_code(self, arithmetic: str, engine: str = "loop") -> tuple[float, float]:
        """Drive and output units per code in a fixed-point arithmetic. Raises FormatError."""
        drive, output = self._exact_lsb(arithmetic, engine)
        return float(drive), float(output)

    def _exact_lsb(self, arithmetic: str, engine: str) -> tuple[Fraction, Fraction]:
        from hystgen.compensator import fixed_tables

        codes = self.compiled(arithmetic, engine).codes if self.effects else None
        if codes is not None:
            return codes.drive_lsb, codes.output_lsb
        return fixed_tables.lsbs(self.cascade, arithmetic, *self._lsb)

    def conversion(self, arithmetic: str, engine: str = "loop") -> CodeConversion | None:
        """Conversions between the codes of `emit.converter` and the emitted C's numbers; None without converters.

        Raises FormatError if the arithmetic is too coarse for them, or the drive's converter for a slew limit.
        """
        from hystgen.compensator import converter

        both, seconds = self.parameters.emit.converter, self.parameters.sample_time
        if both is None:
            return None
        if self.effects and seconds:
            self._check_slew(float(abs(converter.CodeLine.of(both.drive).step)), seconds)
        lsb = self._exact_lsb(arithmetic, engine) if arithmetic in FIXED else None
        return converter.of(both, ARITHMETICS[arithmetic], lsb)

    def watch(self, arithmetic: str, engine: str = "loop", changed: bool = False) -> Watch:
        """The watch over the model's error in an arithmetic; `changed`: the C leaves out effects. Raises FormatError.
        """
        from hystgen.compensator import health

        band = health.Band.of(self.parameters, changed)
        if arithmetic not in FIXED:
            return health.FloatWatch(band, ARITHMETICS[arithmetic])
        return health.FixedWatch(band, float(self._exact_lsb(arithmetic, engine)[1]), FIXED[arithmetic].code_bits)

    def _check_slew(self, step: float, seconds: float) -> None:
        """Raise FormatError if a slew limit is less than one `step` of the drive's converter per sample: each sample
        begins at the drive that the converter produced, so the drive would stand still."""
        from hystgen.compensator.chain.layout import rates
        from hystgen.compensator.chain.parts import Parts

        least = min(map(float, rates(Parts.of(self.effects), seconds)), default=step)
        if least < step:
            unit = self.parameters.units.input or "input units"
            words = (
                f"a step of this converter is {step:.3g} {unit}, and the slew limit allows {least:.3g} {unit} in "
                f"{seconds:.3g} s, so the drive would stand still; give more bits, or a longer sample_time"
            )
            raise FormatError((("emit", "converter", "drive", "bits"), words))

    @property
    def _lsb(self) -> tuple[float | None, float | None]:
        return self.parameters.emit.drive_lsb, self.parameters.emit.output_lsb

    def session(
        self, operator: str = "forward", arithmetic: str | None = None, engine: str | None = None, clamp: bool = False
    ) -> Session:
        """An instance of an operator that keeps its memory from record to record."""
        self.need_static("a sample-by-sample operator" if arithmetic is None else "the bit-exact reference")
        if arithmetic is not None:
            check_arithmetic(arithmetic)
            chosen = self.engine(engine, arithmetic=arithmetic)
            return Session(self.cascade, operator, arithmetic, chosen, clamp, self._lsb)
        return Session(self.cascade, operator, clamp=clamp)

    def simulate(
        self, v: Signal, arithmetic: str | None = None, clamp: bool = False, engine: str | None = None, *,
        t: ArrayLike | None = None, extra: Mapping[str, ArrayLike] | None = None,
    ) -> NDArray[Any]:
        """Output (N,) for the drive samples `v` (N,) from the start memory.

        `v` may be a series of pandas, polars or xarray, and the output is then one with the same index; or a data frame
        or mapping with the column `v` and, for effects, `t` and others, found and converted as in a record.

        Without `arithmetic` the model is computed in double precision, and the drive is limited only with `clamp`. With
        'float32', 'float64', 'q31' or 'q15' the result is the bit-exact reference for the emitted C, which limits the
        drive to `input_range`; fixed point takes and returns codes.

        Only effects use time and `extra`. The time is `t` (N,) in seconds, increasing, or else follows from the
        parameter file's `sample_time`; `extra`: further columns (N,) such as `temperature`. The model starts at rest at
        the first sample. Raises EffectsError if effects lack something they need, UnsupportedEffectsError for effects
        that `arithmetic` does not support.

        Warns (`SampleWarning`) with the number of drives outside `input_range` and of non-finite ones, for which the
        last drive is held.
        """
        given = self.given("v", v, arithmetic, t, extra)
        y, said = self.answers(given.samples, arithmetic, clamp, engine, t=given.t, extra=given.extra)
        given.tell()
        remarks.tell(said)
        return given.answer(y)

    def given(
        self, column: str, source: Signal, arithmetic: str | None, t: ArrayLike | None,
        extra: Mapping[str, ArrayLike] | None,
    ) -> Given:
        """The signal `column`, "v" or "u", of a call of `simulate`, from an array, a series or a frame."""
        from hystgen.records import frames

        units = None if arithmetic in FIXED else self.parameters.units
        return frames.given(column, "y" if column == "v" else "v", source, t, extra, units)

    def answers(
        self, v: ArrayLike, arithmetic: str | None = None, clamp: bool = False, engine: str | None = None, *,
        t: ArrayLike | None = None, extra: Mapping[str, ArrayLike] | None = None,
    ) -> Answers:
        """The result of `simulate`, and its warnings as sentences."""
        if not self.effects:
            session = self.session("forward", arithmetic, engine, clamp)
            return remarks.run(session, v)
        if arithmetic is not None:
            return self._reference(v, arithmetic, engine, t, extra, inverse=False)
        drives, held = _held("v", v, self._drive_at_start())
        run = self.run(drives, t, extra, clamp)
        said = remarks.forward(drives, self.cascade.input_range, clamp, int(np.count_nonzero(held)))
        return self.chain.simulate([run])[0], said

    def inverse_codes(
        self, codes: ArrayLike, arithmetic: str | None = None, engine: str | None = None
    ) -> NDArray[np.int64]:
        """Codes (N,) of drives for codes (N,) of references, as NAME_inverse_step_code of the emitted C gives them.

        Each step commits the drive that its code produces. Without `arithmetic` or `engine`, those of the parameter
        file. Raises ValueError without `emit.converter` in the parameter file and for codes that are not whole numbers,
        and what `emit` raises.
        """
        from hystgen.compensator import converter

        given = arguments.signal("codes", codes)
        if not np.all(given == np.rint(given)):
            raise ValueError("codes must be whole numbers")
        chosen = arithmetic or self.parameters.emit.arithmetic
        check_arithmetic(chosen)
        picked = self.engine(engine, "inverse", chosen)
        conversion = self.conversion(chosen, picked)
        if conversion is None:
            raise ValueError("the parameter file has no emit.converter; add the converters of references and drives")
        return converter.steps(self.tables(chosen, picked, "inverse"), conversion, given)[0]

    def _drive_at_start(self) -> float:
        """The drive that belongs to the start memory, used for leading samples that are not finite."""
        cascade = self.cascade
        return float(cascade.front_inverse(cascade.pi.start[0])) if cascade.start_is_defined else 0.0

    def _reference(
        self, x: ArrayLike, arithmetic: str, engine: str | None, t: ArrayLike | None,
        extra: Mapping[str, ArrayLike] | None, inverse: bool,
    ) -> Answers:
        """Output (N,) of the bit-exact reference for a model with effects, and remarks; see `simulate`."""
        from hystgen.compensator.chain import run
        from hystgen.compensator.chained import EVEN

        check_arithmetic(arithmetic)
        self.need_compensated(arithmetic, "inverse" if inverse else "forward")
        seconds = self.parameters.sample_time
        assert seconds is not None
        samples = arguments.signal("u" if inverse else "v", x)
        record = replace(self.run(_held("x", samples, 0.0)[0], t, extra), v=samples)
        if np.max(np.abs(record.steps - seconds), initial=0.0) > EVEN * seconds:
            raise EffectsError(
                f"the bit-exact reference takes a sample every sample_time = {seconds:g} s; resample the record, or "
                "simulate in double precision, which takes any sample times"
            )
        began = float(record.t[0])
        for effect in self.effects:
            if effect.from_start and abs(began) > EVEN * seconds:
                raise EffectsError(
                    f"{effect.name} is counted from the first sample, but t begins at {began:g} s; give t from 0 on"
                )
        compiled = self.compiled(arithmetic, self.engine(engine, arithmetic=arithmetic))
        found, status = run.with_status(compiled, record, inverse)
        clamped, limited, held = (
            remarks.counted(status, bit) for bit in (slots.INPUT_CLAMPED, slots.OUTPUT_CLAMPED, slots.HELD)
        )
        if inverse:
            return found, remarks.inverse(len(samples), clamped, limited, held)
        ends = compiled.tables.limits.drive[0]
        return found, remarks.forward(samples, (float(ends[0]), float(ends[1])), True, held)

    def run(
        self, v: ArrayLike, t: ArrayLike | None = None, extra: Mapping[str, ArrayLike] | None = None,
        clamp: bool = False, rest: float = 0.0,
    ) -> Run:
        """The record that `chain.simulate` takes; arguments as for `simulate`, and a pause of `rest` s before it."""
        from hystgen.effects import Run

        drive = np.array(arguments.signal("v", v), dtype=np.float64)
        low, high = self.cascade.input_range
        period = self.parameters.sample_time or 1.0
        if t is None and self.parameters.sample_time is None and any(effect.needs_time for effect in self.effects):
            names = ", ".join(dict.fromkeys(effect.name for effect in self.effects if effect.needs_time))
            raise EffectsError(f"the effects ({names}) need time; give t, or sample_time in the parameter file")
        times = np.array(np.arange(len(drive)) * period if t is None else arguments.signal("t", t), dtype=np.float64)
        if not isinstance(extra or {}, Mapping):
            raise TypeError(f"extra must be a mapping of names to arrays, not {arguments.kind(extra)}")
        columns = {
            name: np.array(arguments.signal(name, values), dtype=np.float64) for name, values in (extra or {}).items()
        }
        for name, values in (("v", drive), ("t", times), *columns.items()):
            if values.ndim != 1 or len(values) != len(drive) or not np.all(np.isfinite(values)):
                raise EffectsError(f"{name} must have {len(drive)} finite numbers, one per sample of v")
        if np.any(np.diff(times) <= 0.0):
            raise EffectsError("t must increase from each sample to the next")
        found = Run(times, np.clip(drive, low, high) if clamp else drive, columns, rest)
        self.chain.require_columns([found])
        return found

    def settling(self, within: float = SETTLED) -> Settling:
        """Settling times of the output after full-range steps of the drive, up and down.

        `within`: the error, as a fraction of the final step of the output. Found by simulating the steps with all
        effects, up to an hour; drift and effects that follow a logged column are left out. Raises EffectsError if one
        of the user's own effects fails on such a step.
        """
        from hystgen.chain.settling import settling

        within = arguments.number("within", within, "fraction of the final step")
        if not 0.0 < within < 1.0:
            raise ValueError(f"within must be a fraction between 0 and 1, not {within:g}; give 0.01 for 1 %")
        return settling(self.chain, within)

    def inverse(self) -> InverseModel:
        """The compensator. Raises NotInvertibleError with the reasons and ranges, or UnsupportedEffectsError."""
        if self.effects:
            self.compensator  # noqa: B018  raises
        else:
            self.cascade.inverse()
        return InverseModel(self)

    def limited(self, reference: Run, asked: NDArray[np.bool_] | None = None) -> tuple[Run, NDArray[np.bool_]]:
        """The references limited to the output range with all effects at rest, as in the C, and a mask (N,) of those
        that lay outside; `asked` (N,): which samples are references."""
        from hystgen.compensator.chain import layout

        record = float(np.median(reference.steps)) if len(reference.steps) else 1.0
        seconds = self.parameters.sample_time or record
        low, high = layout.output_range(self.cascade, self.compensator.parts, seconds)
        asked = np.ones(len(reference.v), dtype=bool) if asked is None else asked
        rounded = remarks.ROUNDED * (high - low)
        outside = asked & ((reference.v < low - rounded) | (reference.v > high + rounded))
        return replace(reference, v=np.where(asked, np.clip(reference.v, low, high), reference.v)), outside

    @cached_property
    def compensator(self) -> Compensator:
        """The inverse in double precision of a model with effects; raises the same errors as `inverse`."""
        from hystgen.compensator.chained import Compensator

        return Compensator(self.chain, self.parameters.emit.compensation)


@dataclass(frozen=True)
class InverseModel:
    """The compensator of a model: reference in, drive out."""

    forward: Model

    def __repr__(self) -> str:
        return f"<InverseModel of {self.forward!r}>"

    def simulate(
        self, u: Signal, arithmetic: str | None = None, clamp: bool = True, engine: str | None = None, *,
        t: ArrayLike | None = None, extra: Mapping[str, ArrayLike] | None = None,
    ) -> NDArray[Any]:
        """Drive (N,) for the reference samples `u` (N,); arguments, and series and frames, as for `Model.simulate`.

        As in the C, references are limited to the output range and drives to `input_range`, and the memory follows the
        limited drive, so the inverse is exact again at the next reachable reference; `clamp=False` gives the unlimited
        inverse, in double precision. A non-finite sample holds the drive. Warns (`SampleWarning`) with the numbers of
        limited and of held samples.

        With effects the whole reference is known in advance: delays and modes look ahead in it, and the model is at
        rest at the first sample. The settings of `emit.compensation` in the parameter file apply, counted in samples of
        the record; `quiet` changes nothing in double precision, which has no codes to dither between. The error in a
        mode is a sixth of the fourth difference of its reference, and the error in a lag is a quarter of the second
        difference of the drive behind it; everything else is exact.
        """
        given = self.forward.given("u", u, arithmetic, t, extra)
        v, said = self.answers(given.samples, arithmetic, clamp, engine, t=given.t, extra=given.extra)
        given.tell()
        remarks.tell(said)
        return given.answer(v)

    def answers(
        self, u: ArrayLike, arithmetic: str | None = None, clamp: bool = True, engine: str | None = None, *,
        t: ArrayLike | None = None, extra: Mapping[str, ArrayLike] | None = None,
    ) -> Answers:
        """The result of `simulate`, and its warnings as sentences."""
        model = self.forward
        if not model.effects:
            session = model.session("inverse", arithmetic, engine, clamp)
            return remarks.run(session, u, model.session() if arithmetic is None else None)
        if arithmetic is not None:
            return model._reference(u, arithmetic, engine, t, extra, inverse=True)
        low, high = model.cascade.input_range
        references, held = _held("u", u, None)
        ends = (low, high) if clamp else (-math.inf, math.inf)
        run, outside = model.run(references, t, extra), np.zeros(len(references), dtype=bool)
        if clamp:
            run, outside = model.limited(run)
        v, beyond = model.compensator.answers(run, ends, held=held)
        limited = beyond > remarks.ROUNDED * (high - low)
        return v, remarks.compensated(outside & ~held, limited, int(np.count_nonzero(held)))

    def inverse(self) -> Model:
        """The model that this inverse compensates."""
        return self.forward


def _held(name: str, x: ArrayLike, first: float | None) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The samples `x` (N,), with non-finite ones replaced by the last finite one, and a mask of those replaced.

    Samples before the first finite one become `first` or, if that is None, the first finite one. `name`: the name of
    `x` in messages.
    """
    samples = np.array(arguments.signal(name, x), dtype=np.float64)
    wrong = ~np.isfinite(samples)
    if np.any(wrong):
        last = np.maximum.accumulate(np.where(wrong, -1, np.arange(len(samples))))
        finite = samples[~wrong]
        begin = first if first is not None else float(finite[0]) if len(finite) else 0.0
        samples = np.where(last < 0, begin, samples[np.maximum(last, 0)])
    return samples, wrong


def load(path: str | os.PathLike[str], effects: Sequence[str | os.PathLike[str] | type[Effect]] = ()) -> Model:
    """The model of a parameter file; `effects`: the user's own effects that the file names, as files or classes.

    Raises ParameterError with every problem in the file, EffectsError for an unusable effects file; warns if the start
    memory had to be projected.
    """
    path = arguments.path("the parameter file", path)
    model = Model(load_parameters(path, _own_effects(effects)))
    if model.cascade.pi.projected:
        warnings.warn(
            f"{os.fspath(path)}: model.pi.initial_state cannot have come from any input; moved to the nearest "
            "admissible memory (entry 1 kept)",
            stacklevel=2,
        )
    return model


def _own_effects(sources: Sequence[str | os.PathLike[str] | type[Effect]]) -> list[type[Effect]]:
    if isinstance(sources, str | os.PathLike) or not isinstance(sources, Iterable):
        raise TypeError(f"effects must be a list of files or classes, not {arguments.kind(sources)}; give ['own.py']")
    found: list[type[Effect]] = []
    for source in sources:
        from hystgen.effects.user import load_user_effects  # only if needed, as `emit` has to start fast

        found += [source] if isinstance(source, type) else load_user_effects(arguments.path("effects", source))
    return found


def check_arithmetic(arithmetic: str) -> None:
    """Raise FormatError for an unknown arithmetic."""
    if arithmetic not in ARITHMETICS:
        raise FormatError(f"arithmetic {arithmetic!r} is not one of {', '.join(ARITHMETICS)}")


class HasModel(Protocol):
    """An object that has a model, such as a fit or a diagnosis."""

    @property
    def model(self) -> Model:
        """The model."""


ModelSource: TypeAlias = "Model | HasModel | str | os.PathLike[str]"
"""A model, an object that has one, or the path of a parameter file."""


def as_model(source: ModelSource) -> Model:
    """The given model, or that of a parameter file or of an object with a model, such as a fit.

    Raises ParameterError, and TypeError for anything else.
    """
    if isinstance(source, str | os.PathLike):
        return load(source)
    model = source if isinstance(source, Model) else getattr(source, "model", None)
    if not isinstance(model, Model):
        raise TypeError(
            f"give a model, as returned by hystgen.load, or a parameter file, not {arguments.kind(source)}"
        )
    return model
