"""Closed loops: a plant with hysteresis at its input, a compensator and a controller, at the firmware's sample rate.

    reference --(+)--> controller --> compensator --> hysteresis --> plant --+--> output
                -^                                                           |
                 +-----------------------------------------------------------+

At sample k, at t_k = k T, in this order: the sensor reads the output y_k before anything moves; the controller turns
the error r_k - y_k into u_k; the compensator turns u_k into the drive v_k; the actuator turns v_k into the displacement
h_k without delay; v_k, and with it h_k, is held until t_(k+1). So y_k depends on drives up to v_(k-1), and there is no
algebraic loop even if the plant has direct feedthrough. To model a controller or compensator that takes a whole sample
to compute, include a factor 1/z in the controller.

Nothing is integrated numerically: hysteresis is rate-independent, so a held drive gives a held h, and a zero-order hold
is exact for a linear plant with a held input. A finer step would not change the values at the samples.

>>> import math
>>> from hystgen import PI
>>> from hystgen.closed_loop import Loop, PIController
>>> actuator = PI([0, 0.45, 0.9], [0.72, 0.6, 0.48])
>>> loop = Loop(([1e6], [1, 1e3, 1e6]), PIController(0.185, 185.0), 5e-5, actuator, actuator.inverse())
>>> response = loop.run(lambda t: 4 * math.sin(2 * math.pi * t), duration=2.0)
>>> round(response.max_error(start=1.0), 3)
0.136
"""

from __future__ import annotations

import math
import numbers
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.arithmetic import FIXED
from hystgen.basics import extras
from hystgen.basics.arguments import finite
from hystgen.cascade import PI, Cascade, InverseCascade
from hystgen.compensator import fixed_tables
from hystgen.compensator.reference import Session
from hystgen.emission.calls import emit_options
from hystgen.emission.options import Options
from hystgen.model import InverseModel, Model, as_model

if TYPE_CHECKING:
    from hystgen.verification.instance import CompiledInstance

Array = NDArray[np.float64]


@runtime_checkable
class LoopPart(Protocol):
    """A part of the loop that has a memory.

    A controller (error in, demand out), compensator (demand in, drive out) or actuator (drive in, displacement out).
    """

    def reset(self) -> None:
        """Return to the start state; called before every run."""

    def step(self, x: float, /) -> float:
        """The output for the next input sample."""


@dataclass(frozen=True)
class PIController:
    """Proportional-integral controller `u_k = kp e_k + ki T (e_0 + ... + e_k)`, with T the loop's sample time.

    `kp` in controller output per error unit, `ki` in the same per second. Neither the output nor the integral is
    limited. Raises ValueError for non-finite gains.
    """

    kp: float
    ki: float

    def __post_init__(self) -> None:
        finite(kp=self.kp, ki=self.ki)


@dataclass(frozen=True, eq=False)
class Response:
    """The response of a loop: arrays (N,), one entry per sample.

    `t` in s; `reference`, `output` and `error` (reference minus output) in units of the plant's output; `control`:
    output of the controller; `drive`: output of the compensator; `displacement`: output of the hysteresis, which is the
    plant's input. A loop that diverges ends in infinities and NaN.
    """

    t: Array
    reference: Array
    output: Array
    error: Array
    control: Array
    drive: Array
    displacement: Array

    def max_error(self, start: float = 0.0) -> float:
        """Largest `|error|` at the samples from `start` (s) on. Raises ValueError if there are none."""
        return float(np.max(np.abs(self._error_from(start))))

    def rms_error(self, start: float = 0.0) -> float:
        """Root mean square error of the samples from `start` (s) on. Raises ValueError if there are none."""
        return float(np.sqrt(np.mean(self._error_from(start) ** 2)))

    def _error_from(self, start: float) -> Array:
        # a start that is meant to fall on a sample must include it despite rounding
        kept = self.error[self.t >= start - 1e-9 * abs(start)]
        if not len(kept):
            raise ValueError(f"the response ends at {self.t[-1]:g} s, before {start:g} s")
        return kept


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed loop, sampled every `sample_time` seconds.

    `plant`: a continuous system of scipy.signal or its arguments (num, den), (zeros, poles, gain) or (A, B, C, D), with
    one input and one output, initially at rest; or a discrete system with dt = sample_time. Controller, hysteresis and
    compensator are each one of

    - None: passes its input on (not for the controller);
    - a number: a gain;
    - a model (`Model`, `Cascade`, `PI`), in double precision and unlimited, or the `inverse()` of a `Model` or
      `Cascade`, which keeps the drive inside its `input_range`;
    - a `PIController`, or a discrete system of scipy.signal with dt = sample_time;
    - a `LoopPart`, such as `BitReference` and `CompiledC`, or any object with `step` and `reset`;
    - a function of one number, without memory.

    Raises ValueError for an unusable plant, gain or sample time and for the same block in two places, TypeError for a
    part that is none of these, UnsupportedEffectsError for a model with effects; linear effects belong in the plant.
    """

    plant: object
    controller: object
    sample_time: float
    hysteresis: object = None
    compensator: object = None

    def __post_init__(self) -> None:
        extras.require_fit("a closed loop")
        given = self.sample_time
        if not (isinstance(given, numbers.Real) and math.isfinite(given) and given > 0.0):
            raise ValueError(f"the sample time {self.sample_time!r} is not positive; give seconds per sample")
        if self.controller is None:
            raise TypeError("a loop needs a controller")
        _ = self.sampled_plant
        if len(set(map(id, self._blocks))) < len(self._blocks):
            raise ValueError("the same block, with one memory, is used in two places; give each place its own block")

    @cached_property
    def sampled_plant(self) -> tuple[Array, Array, Array, float]:
        """A (n, n), B (n,), C (n,) and D of the plant with its input held: `x_(k+1) = A x_k + B h_k`."""
        return _sampled(self.plant, self.sample_time, "the plant")

    @cached_property
    def _blocks(self) -> tuple[LoopPart, LoopPart, LoopPart]:
        return (
            _block(self.controller, self.sample_time, "the controller"),
            _block(1.0 if self.compensator is None else self.compensator, self.sample_time, "the compensator"),
            _block(1.0 if self.hysteresis is None else self.hysteresis, self.sample_time, "the hysteresis"),
        )

    def run(self, reference: ArrayLike | Callable[[float], float], duration: float | None = None) -> Response:
        """The response from rest to `reference`: N samples at t_k, or a function of time in s with a `duration` in s.

        Every run starts with the plant at 0 and all memories at their start values. Raises ValueError for a reference
        that is not a signal, or for an impossible duration.
        """
        r = self._reference(reference, duration)
        controller, compensator, hysteresis = self._blocks
        for block in self._blocks:
            block.reset()
        a, b, c, d = self.sampled_plant
        x, h = np.zeros(len(b)), 0.0
        signals = np.empty((4, len(r)))
        # a loop may diverge; that is a result too
        with np.errstate(over="ignore", invalid="ignore"):
            for k, wanted in enumerate(r.tolist()):
                y = float(c @ x) + d * h
                u = controller.step(wanted - y)
                v = compensator.step(u)
                h = hysteresis.step(v)
                x = a @ x + b * h
                signals[:, k] = y, u, v, h
            t = np.asarray(np.arange(len(r)) * self.sample_time, dtype=np.float64)
            return Response(t, r, signals[0], r - signals[0], *signals[1:])

    def _reference(self, reference: ArrayLike | Callable[[float], float], duration: float | None) -> Array:
        if callable(reference):
            if duration is None or not (math.isfinite(duration) and duration >= self.sample_time):
                raise ValueError("a reference given as a function needs a duration in s of at least one sample")
            count = round(duration / self.sample_time)
            reference = [reference(k * self.sample_time) for k in range(count)]
        elif duration is not None:
            raise ValueError("a reference given as samples has its own duration")
        try:
            r = np.array([] if np.iscomplexobj(reference) else reference, dtype=np.float64)
        except (TypeError, ValueError):
            r = np.empty(0)
        if r.ndim != 1 or not len(r) or not np.all(np.isfinite(r)):
            raise ValueError("a reference must have at least one sample, and all samples must be finite")
        return r


def _sampled(system: Any, sample_time: float, what: str) -> tuple[Array, Array, Array, float]:
    """State space of a continuous system with held input, or of a discrete one."""
    from scipy import linalg, signal

    if not isinstance(system, signal.lti | signal.dlti):
        try:
            system = signal.lti(*system)
        except (TypeError, ValueError):
            raise ValueError(
                f"{what} is not a system of scipy.signal; give one, or (num, den), (zeros, poles, gain), (A, B, C, D)"
            ) from None
    try:
        space = system.to_ss()
    except ValueError as error:
        raise ValueError(f"{what} is not proper: it has more zeros than poles ({error})") from None
    matrices = [np.asarray(m) for m in (space.A, space.B, space.C, space.D)]
    if any(np.any(m.imag) for m in matrices):
        raise ValueError(f"{what} has complex coefficients; complex poles and zeros must come in conjugate pairs")
    a, b, c, d = (np.array(m.real, dtype=np.float64) for m in matrices)
    if d.shape != (1, 1):
        raise ValueError(f"{what} has {d.shape[1]} inputs and {d.shape[0]} outputs; a loop needs one of each")
    if not all(np.all(np.isfinite(m)) for m in (a, b, c, d)):
        raise ValueError(f"{what} has non-finite coefficients")
    if space.dt is None:
        # the entries of a companion matrix differ by orders of magnitude, so up to half the digits are lost
        a, (scale, _) = linalg.matrix_balance(a, permute=False, separate=True)
        a, b, c, d, _ = signal.cont2discrete((a, b / scale[:, None], c * scale, d), sample_time, "zoh")
    elif space.dt is True:
        raise ValueError(f"{what} has no sample time; give its dt")
    elif not math.isclose(float(space.dt), sample_time, rel_tol=1e-9):
        raise ValueError(f"{what} has a sample time of {space.dt} s, but the loop has {sample_time:g} s")
    return a, b[:, 0], c[0], float(d[0, 0])


def _block(part: object, sample_time: float, what: str) -> LoopPart:
    from scipy import signal

    if isinstance(part, PIController):
        return _PI(part, sample_time)
    if isinstance(part, signal.dlti):
        return _Discrete(*_sampled(part, sample_time, what))
    if isinstance(part, PI):
        part = Cascade(part)
    if isinstance(part, Cascade):
        return _Operator(Session(part))
    if isinstance(part, InverseCascade):
        return _Operator(Session(part.forward, "inverse", clamp=True))
    if isinstance(part, Model):
        return _Operator(part.session())
    if isinstance(part, InverseModel):
        return _Operator(part.forward.session("inverse", clamp=True))
    if isinstance(part, numbers.Real):
        gain = float(part)
        finite(**{what: gain})
        return _Function(lambda x: gain * x)
    if isinstance(part, signal.lti):
        discrete = f"to_discrete({sample_time:g})"
        raise TypeError(f"{what} is a continuous system; give a discrete one, for example the result of its {discrete}")
    if isinstance(part, LoopPart) and not isinstance(part, type):
        return part
    if callable(part) and not isinstance(part, type):
        return _Function(part)
    raise TypeError(f"{what} cannot be a part of a loop: {part!r}")


class _Function:
    """A function without memory."""

    def __init__(self, function: Callable[[float], float]) -> None:
        self._function = function

    def reset(self) -> None:
        """There is nothing to forget."""

    def step(self, x: float, /) -> float:
        return float(self._function(x))


class _PI:
    def __init__(self, gains: PIController, sample_time: float) -> None:
        self._kp, self._gain = gains.kp, gains.ki * sample_time
        self.reset()

    def reset(self) -> None:
        self._integral = 0.0

    def step(self, x: float, /) -> float:
        self._integral += self._gain * x
        return self._kp * x + self._integral


class _Discrete:
    """A linear discrete system whose state is initially 0."""

    def __init__(self, a: Array, b: Array, c: Array, d: float) -> None:
        self._a, self._b, self._c, self._d = a, b, c, d
        self.reset()

    def reset(self) -> None:
        self._x = np.zeros(len(self._b))

    def step(self, x: float, /) -> float:
        answer = float(self._c @ self._x) + self._d * x
        self._x = self._a @ self._x + self._b * x
        return answer


class _Operator:
    """A model or its inverse, run from its start memory in the number format of its session."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def reset(self) -> None:
        self._session.init()

    def step(self, x: float, /) -> float:
        answer: float = self._session.run([x])[0].item()
        return answer


class _InUnits:
    """An operator between two converters: physical units in and out, numbers of its arithmetic inside.

    A fixed-point operator gets the nearest code, ties away from zero, limited to the type; a NaN repeats the last code.
    """

    def __init__(self, operator: _Operator | CompiledInstance, model: Model, options: Options) -> None:
        self._operator = operator
        self._lsb: tuple[float, float] | None = None
        chosen = FIXED.get(options.arithmetic)
        if chosen:
            drive, output = model.units_per_code(options.arithmetic, options.engine)
            self._lsb = (output, drive) if options.operator == "inverse" else (drive, output)
            self._most = chosen.code_max
        self._code = 0

    def reset(self) -> None:
        """Return to the start memory of the parameter file."""
        self._code = 0
        self._operator.reset()

    def step(self, x: float, /) -> float:
        """One sample."""
        if self._lsb is None:
            return float(self._operator.step(x))
        if not math.isnan(x):
            code = min(max(x / self._lsb[0], -self._most - 1.0), float(self._most))
            self._code = fixed_tables.nearest(code)
        return float(self._operator.step(self._code) * self._lsb[1])


def _one_operator(model: Model, operator: str, arithmetic: str | None, engine: str | None) -> Options:
    if operator not in ("inverse", "forward"):
        raise ValueError(f"operator {operator!r} is neither inverse nor forward")
    return emit_options(model, operator, arithmetic, engine)


class BitReference(_InUnits):
    """A model's `inverse` or `forward` operator in physical units, computed in Python bit for bit as in the emitted C.

    `source`: a model or a parameter file; `arithmetic` and `engine` default to the parameter file's. Raises
    ParameterError, NotInvertibleError, FormatError, ValueError and UnsupportedEffectsError.
    """

    def __init__(
        self,
        source: Model | str | os.PathLike[str],
        operator: str = "inverse",
        arithmetic: str | None = None,
        engine: str | None = None,
    ) -> None:
        model = as_model(source)
        options = _one_operator(model, operator, arithmetic, engine)
        super().__init__(_Operator(model.session(operator, options.arithmetic, options.engine)), model, options)


class CompiledC(_InUnits):
    """The emitted C of a model's `inverse` or `forward` operator, compiled for this machine; in physical units.

    `source`: a model or a parameter file; `arithmetic` and `engine` default to the parameter file's, `compiler` (gcc,
    clang or zig) to the first that is installed. Raises CompileError, ParameterError, NotInvertibleError, FormatError,
    ValueError and UnsupportedEffectsError.
    """

    def __init__(
        self,
        source: Model | str | os.PathLike[str],
        operator: str = "inverse",
        arithmetic: str | None = None,
        engine: str | None = None,
        compiler: str | None = None,
    ) -> None:
        from hystgen.verification.instance import CompiledInstance

        model = as_model(source)
        options = _one_operator(model, operator, arithmetic, engine)
        instance = CompiledInstance(model, options, compiler)
        super().__init__(instance, model, options)
        self._instance = instance
        self._columns: dict[str, list[tuple[int, float]]] = {}
        if model.effects:
            for column, entry, unit in model.compiled(options.arithmetic, options.engine).columns:
                self._columns.setdefault(column, []).append((entry, unit))
        self._whole = options.arithmetic in FIXED

    def set_influence(self, column: str, value: float) -> None:
        """Set a logged column that the model follows, in its own unit, from the next sample on. Raises ValueError for
        a column that the model does not follow."""
        if column not in self._columns:
            known = ", ".join(self._columns) or "none"
            raise ValueError(f"the model follows no column {column!r}; it follows {known}")
        for entry, unit in self._columns[column]:
            given = value * unit
            if self._whole and math.isfinite(given):
                given = fixed_tables.nearest(min(max(given, -self._most - 1.0), float(self._most)))
            self._instance.set_influence(entry, given)
