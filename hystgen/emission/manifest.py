"""`NAME_manifest.json`: what a safety file says about the emitted C of a model: origin, options, hashes of the files,
bounds, figures, and deviations from MISRA C. The same bytes on every machine."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from hystgen.basics.version import __version__
from hystgen.compensator import engines
from hystgen.emission import interface, runtime
from hystgen.emission.module import Module
from hystgen.emission.options import OPTIONS, seal

SCHEMA_ID = "urn:hystgen:manifest:1"
"""Name of the manifest's JSON Schema, a URN since it identifies the schema rather than its location."""

_HASH = Field(pattern="^[0-9a-f]{64}$", description="SHA-256, in hexadecimal")


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


SIMILAR = "for a model with the same parts and the same number of plays, interpolated between measured ones"
SIMILAR_CODE = "for a model with the same parts and 10 plays"
MEASURED_WITH = {"zig": "0.17", "arm-none-eabi-gcc": "12.2"}
"""Compilers, at -O2, behind `hystgen/compensator/*_costs.csv` and `*_sizes.csv`; the larger figure counts."""


class File(_Entry):
    """An emitted file."""

    name: str
    bytes: int
    sha256: str = _HASH


class Bound(_Entry):
    """An error against the model in double precision: a bound, or the largest error that a search found."""

    macro: str = Field(description="its name in the header")
    value: float
    unit: str = Field(description="unit of the drive or the output; codes in fixed point")
    kind: Literal["proved", "measured"]
    samples: int | None = Field(default=None, description="number of samples in which a measured one was searched for")
    condition: str = Field(default="", description="when a bound holds; empty for always")


class Figure(_Entry):
    """Bytes or instructions: `proved` from the declarations in the C, or `measured` on emulated cores with similar
    models; `hystgen verify --targets` measures the model itself."""

    what: Literal["flash", "tables", "ram", "instructions", "stack"]
    value: int
    unit: Literal["bytes", "instructions"]
    kind: Literal["proved", "measured"]
    operator: str = Field(default="", description="empty for all operators together")
    core: str = Field(default="", description="empty for every 32-bit core")
    basis: str = Field(default="", description="the models that were measured; empty for a proved figure")


class AllowedDeviation(_Entry):
    """A rule from which emitted C may depart, and why that is right there."""

    rule: str
    reason: str


class Manifest(_Entry):
    """What a safety file says about the emitted C of a model."""

    about: tuple[str, ...] = Field(description="origin and hash of this file, as in the banner of every emitted file")
    hystgen_manifest: Literal[1] = Field(description="format version")
    model: str = Field(description="prefix of every symbol")
    description: str
    generator: str = Field(description="version of hystgen")
    command: str = Field(description="writes the C and this file again")
    options: Mapping[str, str]
    parameters_sha256: str = _HASH
    effects: tuple[str, ...] = Field(description="effects in the C, in the order of the parameter file")
    not_compensated: tuple[str, ...] = Field(description="a sentence for each effect that the C leaves out")
    files: tuple[File, ...] = Field(description="files of the C, of which packages for build tools hold copies")
    sample_time: float | None = Field(description="s between steps; null without effects")
    drive_range: tuple[float, float] = Field(description="drives that a step can return or take, in units of the drive")
    output_range: tuple[float, float] = Field(description="references or outputs, in units of the output")
    units: Mapping[str, str]
    bounds: tuple[Bound, ...]
    doubts: tuple[str, ...] = Field(description="why the inverse may be of little use, one sentence each")
    operations: Mapping[str, str] = Field(description="most operations of a step by operator; proved")
    figures: tuple[Figure, ...]
    measured_with: Mapping[str, str] = Field(description="compilers of the measured figures, at -O2, with versions")
    licence: str = Field(description="SPDX identifier of the emitted files")
    misra: tuple[AllowedDeviation, ...] = Field(description="deviations from MISRA C:2012")


def schema() -> dict[str, object]:
    """JSON Schema (2020-12) of a manifest."""
    made = Manifest.model_json_schema(mode="serialization")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": SCHEMA_ID, **made}


@functools.cache
def deviations() -> dict[str, dict[str, str]]:
    """For each checking tool, the rules from which emitted C may depart, each with the reason."""
    from ruamel.yaml import YAML

    path = runtime.data_folder("hystgen") / "emission" / "deviations.yaml"
    listed = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
    return {
        tool: {str(rule): " ".join(reason.split()) for rule, reason in rules.items()} for tool, rules in listed.items()
    }


def file(module: Module, files: Mapping[str, str]) -> dict[str, str]:
    """The manifest's name and text for a module with these emitted files."""
    one = module.compensator
    parameters, units = one.model.parameters, one.units
    command = f"{interface.command(parameters, one.options)} --manifest"
    ends, lsb = one.numbers.tables.limits, [float(each) for each in one.numbers.lsb] or [1.0, 1.0]
    made = Manifest(
        about=(
            f"Generated by hystgen {__version__}; edits are lost when it is generated again with", command,
            f"Parameters: sha256 {module.sha256}",
            "The generated code belongs to whoever generated it: 0BSD, no conditions, no warranty.",
        ),
        hystgen_manifest=1,
        model=one.names.name,
        description=parameters.description,
        generator=__version__,
        command=command,
        options={key: str(getattr(one.options, key)) for key in OPTIONS if getattr(one.options, key) != "constant"},
        parameters_sha256=module.sha256,
        effects=tuple(effect.name for effect in parameters.model.effects),
        not_compensated=one.options.left_out,
        files=tuple(
            File(name=name, bytes=len(text), sha256=hashlib.sha256(text.encode("ascii")).hexdigest())
            for name, text in files.items()
        ),
        sample_time=parameters.sample_time,
        drive_range=(lsb[0] * float(ends.drive.low[0]), lsb[0] * float(ends.drive.high[0])),
        output_range=(lsb[1] * float(ends.output.low[0]), lsb[1] * float(ends.output.high[0])),
        units={"input": units.drive, "output": units.output},
        bounds=tuple(
            Bound(
                macro=each.macro, value=float(each.value), unit=one.form.unit(each.unit, each.side).strip(),
                samples=each.samples, kind="proved" if each.samples is None else "measured",
                condition=each.condition,
            )
            for each in interface.errors(one)
        ),
        doubts=tuple(module.doubts),
        operations=dict(module.cost.worst_case),
        figures=tuple(_figures(module)),
        measured_with=MEASURED_WITH,
        licence="0BSD",
        misra=tuple(AllowedDeviation(rule=rule, reason=reason) for rule, reason in deviations()["misra"].items()),
    )
    return {f"{one.names.name}_manifest.json": seal(json.dumps(made.model_dump(mode="json"), indent=4) + "\n")}


def _figures(module: Module) -> list[Figure]:
    """Memory from the declarations; code, instructions and stack from models that were measured."""
    cost = module.cost
    found = [Figure(what="tables", value=cost.memory.tables, unit="bytes", kind="proved")]
    found += [
        Figure(what="ram", value=size, unit="bytes", kind="proved", operator=op) for op, size in cost.memory.instances
    ]
    for core in engines.CORES:
        found.append(
            Figure(what="flash", value=cost.code[core], unit="bytes", kind="measured", core=core, basis=SIMILAR_CODE)
        )
        for op, cores in cost.dearest.items():
            dearest = cores[core]
            figures: Sequence[tuple[Literal["instructions", "stack"], int, Literal["instructions", "bytes"]]] = (
                ("instructions", dearest.instructions, "instructions"), ("stack", dearest.stack, "bytes"),
            )
            found += [
                Figure(what=what, value=value, unit=unit, kind="measured", operator=op, core=core, basis=SIMILAR)
                for what, value, unit in figures
            ]
    return found
