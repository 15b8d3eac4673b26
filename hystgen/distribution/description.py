"""The variables of a co-simulation unit, and its modelDescription.xml for FMI 2.0 and 3.0.

The standard is at https://fmi-standard.org; the attributes are those of its sections on the model description.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from pydantic import BaseModel

from hystgen.basics.version import __version__
from hystgen.distribution.quantities import si
from hystgen.model import Model

INPUT = 1
OUTPUT = 2
STATUS = 3
TEMPERATURE = 4
PARAMETERS = 16
"""Value references, as in `templates/fmu.c.j2`: 0 is the time, and the parameters begin at the last one."""

SAMPLES = 1000
"""Number of samples in the default experiment of a unit; the length is arbitrary."""

_BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""Base units in FMI's order."""


@dataclass(frozen=True)
class Parameter:
    """A number of the parameter file: its path there, its value and its unit, empty if it has none."""

    name: str
    value: float
    unit: str
    description: str = ""


@dataclass(frozen=True)
class Signal:
    """The input or the output of a unit."""

    name: str
    unit: str
    description: str
    start: float = 0.0


@dataclass(frozen=True)
class Description:
    """The content of a unit's modelDescription.xml."""

    model: Model
    fmi: int
    token: str
    sample_time: float
    given: Signal
    answer: Signal
    temperature: Signal | None
    parameters: Sequence[Parameter]
    about: str

    @property
    def units(self) -> list[str]:
        """Units of all variables, sorted."""
        warm = {self.temperature.unit} if self.temperature else set[str]()
        found = {self.given.unit, self.answer.unit, *warm, *(each.unit for each in self.parameters)}
        return sorted({"s"} | found - {""})


def parameters(model: Model) -> list[Parameter]:
    """The numbers of a model in the order of the parameter file's format."""
    whole = model.parameters
    drive, output = whole.units.input, whole.units.output
    found = [Parameter("sample_time", whole.sample_time or 0.0, "s", "time between two steps")]
    for k, end in enumerate(whole.input_range):
        found.append(Parameter(f"input_range[{k}]", end, drive, "the drive stays in this range"))
    direct = not whole.model.memoryless
    gain = f"{output}/{drive}" if direct and drive and output else ""
    pi = whole.model.pi
    for k, threshold in enumerate(pi.thresholds):
        found.append(Parameter(f"pi.thresholds[{k}]", threshold, drive if direct else "", f"threshold r_{k} of a play"))
    for k, weight in enumerate(pi.weights):
        found.append(Parameter(f"pi.weights[{k}]", weight, gain, f"weight p_{k} of a play"))
    for k, stage in enumerate(whole.model.memoryless):
        found += _numbers(f"memoryless[{k}]", stage, drive, output)
    found.append(Parameter("output_offset", whole.model.output_offset, output, "added to the output of the model"))
    for k, effect in enumerate(whole.model.effects):
        found += _numbers(f"effects[{k}]", effect, drive, output)
    return found


def _numbers(path: str, part: BaseModel, drive: str, output: str) -> Iterator[Parameter]:
    """All numbers of a part of the parameter file, with the units that its schema states after the last comma."""
    for key, field in type(part).model_fields.items():
        about = " ".join((field.description or "").split())
        yield from _values(f"{path}.{key}", getattr(part, key), _stated(about, drive, output), about, drive, output)


def _values(path: str, value: object, unit: str, about: str, drive: str, output: str) -> Iterator[Parameter]:
    if isinstance(value, BaseModel):
        yield from _numbers(path, value, drive, output)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield Parameter(path, float(value), unit, about)
    elif isinstance(value, tuple | list):
        for k, each in enumerate(value):
            yield from _values(f"{path}[{k}]", each, unit, about, drive, output)


def _stated(about: str, drive: str, output: str) -> str:
    """The unit at the end of a field's description, with the model's own units; empty if there is none."""
    text = about.rpartition(", ")[2]
    for words, own in (("input units", drive), ("output units", output), ("input", drive), ("output", output)):
        if re.search(rf"\b{words}\b", text):
            if not own:
                return ""
            text = re.sub(rf"\b{words}\b", own, text)
    return text if si(text) is not None or text in (drive, output) else ""


def xml(one: Description) -> str:
    """The text of modelDescription.xml."""
    two = one.fmi == 2
    root = ElementTree.Element("fmiModelDescription", {
        "fmiVersion": f"{one.fmi}.0", "modelName": one.model.name,
        ("guid" if two else "instantiationToken"): one.token, "description": one.about, "version": "1",
        "license": "0BSD", "generationTool": f"hystgen {__version__}", "variableNamingConvention": "structured",
        **({"numberOfEventIndicators": "0"} if two else {}),
    })
    step = _number(one.sample_time)
    state = "state" if two else "State"
    ElementTree.SubElement(root, "CoSimulation", {
        "modelIdentifier": one.model.name, f"canGetAndSetFMU{state}": "true", f"canSerializeFMU{state}": "true",
        "canHandleVariableCommunicationStepSize": "false",
        **({"canNotUseMemoryManagementFunctions": "true"} if two else {"fixedInternalStepSize": step}),
    })
    _define_units(root, one.units)
    stop = _number(SAMPLES * one.sample_time)
    ElementTree.SubElement(root, "DefaultExperiment", {"startTime": "0", "stopTime": stop, "stepSize": step})
    variables = ElementTree.SubElement(root, "ModelVariables")
    if not two:
        about = {"causality": "independent", "variability": "continuous", "unit": "s"}
        ElementTree.SubElement(variables, "Float64", {"name": "time", "valueReference": "0", **about})
    real, whole = ("Real", "Integer") if two else ("Float64", "Int32")

    def add(kind: str, name: str, reference: int, about: str, causality: str, variability: str, **more: str) -> None:
        facts = {
            "name": name, "valueReference": str(reference), "description": about, "causality": causality,
            "variability": variability,
        }
        initial = {} if causality == "input" else {"initial": more.pop("initial")}
        more = {key: value for key, value in more.items() if value}
        if two:
            variable = ElementTree.SubElement(variables, "ScalarVariable", {**facts, **initial})
            ElementTree.SubElement(variable, kind, more)
        else:
            ElementTree.SubElement(variables, kind, {**facts, **initial, **more})

    given, answer = one.given, one.answer
    add(real, given.name, INPUT, given.description, "input", "continuous", unit=given.unit, start=_number(given.start))
    add(real, answer.name, OUTPUT, answer.description, "output", "continuous", initial="calculated", unit=answer.unit)
    add(whole, "status", STATUS, "status bits of the last step, 0 for none", "output", "discrete", initial="exact",
        start="0")
    if warm := one.temperature:
        add(real, warm.name, TEMPERATURE, warm.description, "input", "continuous", unit=warm.unit,
            start=_number(warm.start))
    for k, each in enumerate(one.parameters):
        add(real, each.name, PARAMETERS + k, each.description, "local", "constant", initial="exact", unit=each.unit,
            start=_number(each.value))
    structure = ElementTree.SubElement(root, "ModelStructure")
    if two:
        outputs = ElementTree.SubElement(structure, "Outputs")
        ElementTree.SubElement(outputs, "Unknown", {"index": "2"})
        ElementTree.SubElement(outputs, "Unknown", {"index": "3"})
        initially = ElementTree.SubElement(structure, "InitialUnknowns")
        ElementTree.SubElement(initially, "Unknown", {"index": "2"})
    else:
        ElementTree.SubElement(structure, "Output", {"valueReference": str(OUTPUT)})
        ElementTree.SubElement(structure, "Output", {"valueReference": str(STATUS)})
        ElementTree.SubElement(structure, "InitialUnknown", {"valueReference": str(OUTPUT)})
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _number(value: float) -> str:
    return repr(float(value))


def _define_units(root: ElementTree.Element, units: Sequence[str]) -> None:
    """Units with their base units, where these are known."""
    definitions = ElementTree.SubElement(root, "UnitDefinitions")
    for name in units:
        unit = ElementTree.SubElement(definitions, "Unit", {"name": name})
        known = si(name)
        if known is None:
            continue
        facts = {base: str(known.exponents[base]) for base in _BASE if base in known.exponents}
        if known.factor != 1:
            facts["factor"] = _number(float(known.factor))
        if known.offset:
            facts["offset"] = _number(float(known.offset))
        ElementTree.SubElement(unit, "BaseUnit", facts)
