"""The Python calls behind the command line: load, simulate, identify, emit, verify."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen import arguments, engines, tables
from hystgen.models import PI, Cascade, DeadZone, NotInvertibleError, Stage, TanhEnvelope
from hystgen.params import Parameters, load_parameters
from hystgen.problems import EffectsError, UnsupportedEffectsError

if TYPE_CHECKING:
    from hystgen.effects import Chain, Effect, Run
    from hystgen.emission import stale
    from hystgen.emission.module import Options
    from hystgen.fixed import FixedTables
    from hystgen.identification.fit import Fit
    from hystgen.records import Source
    from hystgen.reference import Tables
    from hystgen.simulation import Session


Sources: TypeAlias = "Model | str | os.PathLike[str] | Iterable[Model | str | os.PathLike[str]]"


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


@dataclass(frozen=True)
class Model:
    """A model as its parameter file gives it: `parameters`, and the mathematics in `cascade`."""

    parameters: Parameters

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
        from hystgen.effects.chain import Chain

        return Chain(self.cascade, self.effects)

    def need_static(self, what: str) -> None:
        """Raise UnsupportedEffectsError if the model has effects: `what` (`the inverse`) does not cover them yet."""
        if self.effects:
            names = ", ".join(dict.fromkeys(effect.name for effect in self.effects))
            raise UnsupportedEffectsError(
                f"{what} of a model with effects ({names}) is not supported yet; remove model.effects, or simulate "
                "the model forward in double precision"
            )

    def engine(
        self,
        engine: str | None = None,
        operator: str | None = None,
        arithmetic: str | None = None,
        optimize: str | None = None,
    ) -> str:
        """'corners' or 'loop': what is given, or else the parameter file's, with `auto` decided for `optimize`."""
        emit = self.parameters.emit
        about = (operator or emit.operator, arithmetic or emit.arithmetic)
        return engines.choose(engine or emit.engine, optimize or emit.optimize, self.cascade, *about)

    def tables(self, arithmetic: str, engine: str) -> Tables | FixedTables:
        """The numbers of the emitted model in one arithmetic, with the parameter file's LSBs in fixed point."""
        return tables.build(self.cascade, arithmetic, engine, lsb=self._lsb)

    @property
    def _lsb(self) -> tuple[float | None, float | None]:
        return self.parameters.emit.drive_lsb, self.parameters.emit.output_lsb

    def session(
        self, operator: str = "forward", arithmetic: str | None = None, engine: str | None = None, clamp: bool = False
    ) -> Session:
        """An instance of an operator that keeps its memory from record to record."""
        from hystgen.simulation import Session

        self.need_static("a sample-by-sample operator" if arithmetic is None else "the bit reference")
        if arithmetic is not None:
            check_arithmetic(arithmetic)
            chosen = self.engine(engine, arithmetic=arithmetic)
            return Session(self.cascade, operator, arithmetic, chosen, clamp, self._lsb)
        return Session(self.cascade, operator, clamp=clamp)

    def simulate(
        self,
        v: ArrayLike,
        arithmetic: str | None = None,
        clamp: bool = False,
        engine: str | None = None,
        *,
        t: ArrayLike | None = None,
        extra: Mapping[str, ArrayLike] | None = None,
    ) -> NDArray[Any]:
        """Output (N,) for the drive samples `v` (N,) from the start memory.

        Without `arithmetic` in double precision, unlimited unless `clamp`. With 'float32', 'float64', 'q31' or 'q15'
        the bit reference of the emitted C, which limits the drive to `input_range`; fixed point takes and gives codes.

        Only effects see time: `t` (N,) in seconds, rising, or the parameter file's `sample_time`; and `extra`, further
        columns (N,) such as `temperature`. Everything starts at rest at the first sample. Raises EffectsError for what
        they need and do not get, UnsupportedEffectsError for effects in an `arithmetic`.
        """
        if not self.effects:
            return self.session("forward", arithmetic, engine, clamp).run(v)[0]
        if arithmetic is not None:
            self.need_static("the bit reference")
        return self.chain.simulate([self.run(v, t, extra, clamp)])[0]

    def run(
        self,
        v: ArrayLike,
        t: ArrayLike | None = None,
        extra: Mapping[str, ArrayLike] | None = None,
        clamp: bool = False,
        rest: float = 0.0,
    ) -> Run:
        """A record as `chain.simulate` takes it; arguments as for `simulate`, `rest` in seconds before it."""
        from hystgen.effects import Run

        drive = np.array(arguments.signal("v", v), dtype=np.float64)
        low, high = self.cascade.input_range
        period = self.parameters.sample_time or 1.0
        if t is None and self.parameters.sample_time is None and any(effect.timed for effect in self.effects):
            names = ", ".join(dict.fromkeys(effect.name for effect in self.effects if effect.timed))
            raise EffectsError(f"the effects ({names}) need time; give t, or sample_time in the parameter file")
        times = np.array(np.arange(len(drive)) * period if t is None else arguments.signal("t", t), dtype=np.float64)
        if not isinstance(extra or {}, Mapping):
            raise TypeError(f"extra is a mapping of names to arrays, not {arguments.kind(extra)}")
        columns = {
            name: np.array(arguments.signal(name, values), dtype=np.float64) for name, values in (extra or {}).items()
        }
        for name, values in (("v", drive), ("t", times), *columns.items()):
            if values.ndim != 1 or len(values) != len(drive) or not np.all(np.isfinite(values)):
                raise EffectsError(f"{name} has to be {len(drive)} finite numbers, one a sample of v")
        if np.any(np.diff(times) <= 0.0):
            raise EffectsError("t has to rise from sample to sample")
        return Run(times, np.clip(drive, low, high) if clamp else drive, columns, rest)

    def inverse(self) -> InverseModel:
        """The compensator. Raises NotInvertibleError with the reasons and ranges, UnsupportedEffectsError."""
        self.need_static("the inverse")
        self.cascade.inverse()
        return InverseModel(self)


@dataclass(frozen=True)
class InverseModel:
    """The compensator of a model: reference in, drive out."""

    forward: Model

    def simulate(
        self, u: ArrayLike, arithmetic: str | None = None, clamp: bool = False, engine: str | None = None
    ) -> NDArray[Any]:
        """Drive (N,) for the reference samples `u` (N,); arguments as for `Model.simulate`."""
        return self.forward.session("inverse", arithmetic, engine, clamp).run(u)[0]

    def inverse(self) -> Model:
        """The model that this compensates."""
        return self.forward


def load(path: str | os.PathLike[str], effects: Sequence[str | os.PathLike[str] | type[Effect]] = ()) -> Model:
    """The model of a parameter file; `effects`: files, or classes, of effects of the user's own that it names.

    Raises ParameterError with every problem in the file, EffectsError for a file of effects that cannot be used; warns
    of a start memory that had to be projected.
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
    from hystgen.effects.user import load_user_effects

    if isinstance(sources, str | os.PathLike) or not isinstance(sources, Iterable):
        raise TypeError(f"effects is a list of files or classes, not {arguments.kind(sources)}; give ['my_effect.py']")
    found: list[type[Effect]] = []
    for source in sources:
        found += [source] if isinstance(source, type) else load_user_effects(arguments.path("effects", source))
    return found


def check_arithmetic(arithmetic: str) -> None:
    """Raise FormatError for an arithmetic that there is not."""
    if arithmetic not in tables.ARITHMETICS:
        raise tables.FormatError(f"arithmetic {arithmetic!r} is none of {', '.join(tables.ARITHMETICS)}")


def as_model(source: Model | str | os.PathLike[str]) -> Model:
    """The model, or that of a parameter file. Raises ParameterError, and TypeError for what is neither."""
    if not isinstance(source, Model | str | os.PathLike):
        raise TypeError(f"give a model, as hystgen.load returns it, or a parameter file, not {arguments.kind(source)}")
    return source if isinstance(source, Model) else load(source)


def _models(source: Sources) -> list[Model]:
    """The models of one source or several."""
    if isinstance(source, list | tuple | Iterator):
        return [as_model(each) for each in source]
    return [as_model(source)]  # type: ignore[arg-type]


def emit_options(
    model: Model,
    operator: str | None = None,
    arithmetic: str | None = None,
    engine: str | None = None,
    layout: str = "self-contained",
    optimize: str | None = None,
) -> Options:
    """What is to be emitted: the arguments given, else the parameter file's `emit` section."""
    from hystgen.emission import module

    model.need_static("C")
    defaults = model.parameters.emit
    operator, arithmetic = operator or defaults.operator, arithmetic or defaults.arithmetic
    check_arithmetic(arithmetic)
    arguments.choice("operator", operator, module.OPERATORS)
    arguments.choice("engine", engine or "auto", ("auto", *engines.ENGINES))
    arguments.choice("optimize", optimize or "auto", engines.OPTIMIZE)
    arguments.choice("layout", layout, module.LAYOUTS)
    return module.Options(operator, arithmetic, model.engine(engine, operator, arithmetic, optimize), layout)


def emitted_files(source: Sources, **options: str | None) -> dict[str, str]:
    """Names and text of the C files of a model, or of several; options as for `emit`. Nothing is written.

    Raises what `emit` raises, and ValueError where two models make files of one name.
    """
    from hystgen.emission import module

    arguments.known_options("emit", emit_options, options)
    models = _models(source)
    check_names(models)
    made: dict[str, str] = {}
    for model in models:
        made |= module.files(model.parameters, model.cascade, emit_options(model, **options))  # type: ignore[arg-type]
    return made


def check_names(models: Sequence[Model]) -> None:
    """Raise ValueError where two models make files of one name."""
    names = [model.name.lower() for model in models]  # as some file systems and all macros see them
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"two models are called {twice[0]}, their files would overwrite each other; rename one")


def emit(source: Sources, output: str | os.PathLike[str] = ".", **options: str | None) -> list[Path]:
    """Write the C files of a model (or parameter file), or of several, into folder `output` and return their paths.

    Options: `operator` inverse, forward or both; `arithmetic` float32, float64, q31 or q15; `engine` auto, corners or
    loop; `optimize` auto, speed or size, for what `engine` auto chooses; `layout` self-contained, shared-runtime or
    single-header. What is not given comes from the parameter file.
    Files that are there with the same bytes are left as they are. Raises ParameterError, NotInvertibleError,
    FormatError and UnsupportedEffectsError; then nothing is written.
    """
    from hystgen.emission import files

    return files.write(Path(arguments.path("output", output)), emitted_files(source, **options))


def differences(source: Sources, output: str | os.PathLike[str] = ".", **options: str | None) -> list[str]:
    """What in folder `output` is missing or other than what `emit` would write, one sentence a file.

    The sentence names what differs: options, parameters, version of hystgen, edits by hand, line ends.
    """
    return [each.sentence() for each in stale_files(source, output, **options)]


def stale_files(
    source: Sources, output: str | os.PathLike[str] = ".", **options: str | None
) -> list[stale.Difference]:
    """The differences behind the sentences of `differences`."""
    from hystgen.emission import stale

    return stale.find(Path(arguments.path("output", output)), emitted_files(source, **options))


def verify(source: Model | str | os.PathLike[str], **options: Any) -> Any:
    """Compile a model's C, run it and compare it with the bit reference; see `hystgen.verification.verify_model`."""
    from hystgen import verification

    arguments.known_options("verify", verification.verify_model, options)
    return verification.verify_model(as_model(source), **options)


def diagnose(source: Model | str | os.PathLike[str], records: Any, **options: Any) -> Any:
    """Find what a nominal model is missing, with a report to write; see `hystgen.diagnosis.diagnose`."""
    from hystgen import diagnosis
    from hystgen.report import diagnosis as report

    arguments.known_options("diagnose", diagnosis.diagnose, options)
    return replace(diagnosis.diagnose(source, records, **options), page=report.html)


def plan(source: Model | str | os.PathLike[str], **options: Any) -> Any:
    """Drive records to measure for a diagnosis; see `hystgen.diagnosis.plan.plan`."""
    from hystgen.diagnosis import plan as drives

    arguments.known_options("plan", drives.plan, options)
    return drives.plan(source, **options)


def identify(records: Any, **options: Any) -> Any:
    """Fit a model to measured records; see `hystgen.identification.identify`."""
    from hystgen import identification

    arguments.known_options("identify", identification.identify, options)
    return identification.identify(records, **options)


def identify_batch(sources: Any, output: str | os.PathLike[str], **options: Any) -> Any:
    """Fit and emit many units in parallel; see `hystgen.identification.fleet.identify_batch`."""
    from hystgen.identification import fleet

    return fleet.identify_batch(sources, arguments.path("output", output), **options)


def report_fit(
    fit: Fit,
    records: Source | Iterable[Source],
    folder: str | os.PathLike[str],
    holdout: Source | Iterable[Source] = (),
) -> Path:
    """Write the report of a fit: `report.html`, which needs nothing else, and its pictures; the path of the page.

    `records`, `holdout`: as `identify` was given them, in the same order; what it read with options such as `columns`
    has to come as `Record`s. Needs matplotlib, of the extra `plot`. Other files in the folder stay. Raises ValueError
    for other records, RecordError, OSError.
    """
    from hystgen.identification import Fit
    from hystgen.records import read_records, several
    from hystgen.report import identification

    if not isinstance(fit, Fit):
        raise TypeError(f"fit is what hystgen.identify returns, not {arguments.kind(fit)}")
    return identification.write(fit, read_records([*several(records), *several(holdout)]), folder)


__all__ = [
    "InverseModel",
    "Model",
    "NotInvertibleError",
    "differences",
    "emit",
    "emit_options",
    "emitted_files",
    "identify",
    "identify_batch",
    "load",
    "plan",
    "report_fit",
    "verify",
]
