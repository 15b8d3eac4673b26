"""Settings that a fit keeps from the parameter file that it replaces: everything that records do not determine."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hystgen.records.units import conversion

if TYPE_CHECKING:
    from hystgen.identification.fit import Fit

KEPT_KEYS = ("description", "sample_time", "emit")

MEASURED = {"drive_lsb": "input", "output_lsb": "output", "compensation.max_rate": "input",
            "health.band": "output"}
"""Keys of `emit` with numbers in units of the drive or the displacement, or in those units per second."""


@dataclass(frozen=True)
class Settings:
    """Settings of an older parameter file.

    `values`: the file's values for `KEPT_KEYS`; `name` and `units`: used if the user gives none, and records are
    converted to these units; `effects`: names of the file's effects, which are dropped along with its weights;
    `problem`: the reason why the file could not be read.
    """

    file: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)
    name: str | None = None
    units: Mapping[str, str] | None = None
    effects: tuple[str, ...] = ()
    problem: str = ""

    def on(self, fit: Fit) -> Fit:
        """The fit with these settings in its parameters."""
        from hystgen.parameters.files import make_parameters

        data = {**fit.parameters.model_dump(), **self.values}
        data["units"] = {**data["units"], **self._units(fit)}
        if "emit" in self.values:
            data["emit"], _ = self._emit(fit)
        return replace(fit, parameters=make_parameters(data))

    def sentences(self, fit: Fit) -> list[str]:
        """Sentences about settings kept and dropped; `fit`: the fit without these settings."""
        said = []
        if self.problem:
            said.append(f"{self.file}: nothing kept from the old file, which is not a parameter file: {self.problem}")
        names = [key for key in KEPT_KEYS if key in self.values]
        if self._kept(fit):
            names.insert(0, "units")
        if self.name == fit.parameters.name:
            names.insert(0, "name")
        if names:
            said.append(f"{self.file}: {', '.join(names)} kept from the existing file")
        _, lost = self._emit(fit)
        if lost:
            keys = ", ".join(f"emit.{key}" for key in lost)
            said.append(f"{self.file}: {keys} left out, since they are in units other than the model's")
        if self.effects:
            said.append(
                f"{self.file}: the effects of the existing file ({', '.join(self.effects)}) are left out, since "
                "they were fitted with its weights; find them again with hystgen diagnose"
            )
        return said

    def _emit(self, fit: Fit) -> tuple[dict[str, Any], list[str]]:
        """The file's `emit` in the units of the fit, and the keys that cannot be converted to these units."""
        emit, lost = dict(self.values.get("emit") or {}), []
        for path, key in MEASURED.items():
            *above, last = path.split(".")
            holder = emit
            for name in above:
                if name in holder:
                    holder[name] = dict(holder[name])
                holder = holder.get(name, {})
            before, now = (self.units or {}).get(key, ""), getattr(fit.parameters.units, key)
            if holder.get(last) is None or not before or not now:
                continue
            how = conversion(before, now)
            if how is None:
                lost.append(path)
                del holder[last]
            elif not how.same:
                holder[last] = float(f"{float(how.times) * float(holder[last]):.12g}")  # without rounding noise
        return emit, lost

    def _units(self, fit: Fit) -> dict[str, str]:
        """The file's units for quantities to which the fit gives none."""
        units = fit.parameters.units.model_dump()
        return {key: unit for key, unit in (self.units or {}).items() if unit and not units[key]}

    def _kept(self, fit: Fit) -> bool:
        """Whether the fit ends up with the units of the file."""
        units = {**fit.parameters.units.model_dump(), **self._units(fit)}
        return bool(self.units) and all(units[key] == unit for key, unit in (self.units or {}).items())


def of(path: str | os.PathLike[str]) -> Settings:
    """The settings of the file at `path`; no settings if the file is missing or empty."""
    from hystgen.basics.problems import ParameterError
    from hystgen.parameters.files import make_parameters, parameter_data

    file = os.fspath(path)
    if not Path(path).is_file() or not Path(path).stat().st_size:
        return Settings()
    try:
        data = parameter_data(path)
        known = {key: data[key] for key in (*KEPT_KEYS, "name", "units") if data.get(key) is not None}
        pi = {"thresholds": (0,), "weights": (1,)}
        make_parameters({"hystgen": 1, "name": "x", "input_range": (0, 1), "model": {"pi": pi}, **known}, file)
    except ParameterError as error:
        return Settings(file, problem=error.problems[0].named)
    model = data.get("model")
    effects = model.get("effects") if isinstance(model, Mapping) else ()
    names = tuple(str(each["name"]) for each in effects or () if isinstance(each, Mapping) and "name" in each)
    values = {key: known[key] for key in KEPT_KEYS if key in known}
    return Settings(file, values, known.get("name"), known.get("units"), names)
