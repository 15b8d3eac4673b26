"""Models as co-simulation units of FMI 2.0 and 3.0 (https://fmi-standard.org) for Simulink and other programs."""

from __future__ import annotations

import hashlib
import io
import os
import struct
import uuid
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from hystgen.arithmetic import ARITHMETICS, FIXED
from hystgen.basics import arguments, writing
from hystgen.basics.problems import FormatError
from hystgen.basics.progress import Progress
from hystgen.distribution import description
from hystgen.distribution.description import Description, Signal
from hystgen.distribution.libraries import LAYOUT, SUPPORT, exports, linked
from hystgen.distribution.platforms import PLATFORMS, Platform
from hystgen.emission.calls import emitted_files
from hystgen.emission.runtime import template
from hystgen.model import Model, ModelSource, as_model

VERSIONS = (2, 3)
"""Major versions of FMI."""

_DATE = (1980, 1, 1, 0, 0, 0)
"""Date of all files in a unit, the earliest that a zip archive can hold: the same input gives the same bytes."""

_FILE_MODE = 0o644 << 16

_MAGIC = 0xCAFEBABE
"""First bytes of a universal library for macOS."""

_ALIGNMENT = 14
"""Power of two at which each library in it starts: the pages of macOS on Arm."""


@arguments.checked
def fmu(
    source: ModelSource,
    output: str | os.PathLike[str],
    fmi: int = 2,
    operator: str | None = None,
    arithmetic: str | None = None,
    engine: str | None = None,
    optimize: str | None = None,
    allow_partial: bool = False,
    progress: bool = False,
) -> Path:
    """Write a model as a co-simulation unit, a file NAME.fmu, and return its path.

    `fmi`: 2 or 3; `operator`: inverse or forward; `progress`: whether to show a bar on a terminal; the other options
    are those of `emit`. Variables: `u` and `v` for the inverse, `v` and `y` for the forward operator, in physical units
    also in fixed point; `status`; `temperature`, if an effect takes it; and the numbers of the parameter file. The step
    size is the file's `sample_time`. Raises what `emit` raises, FormatError without a sample time, ValueError for both
    operators, and CompileError if zig is missing or fails; nothing is written then.
    """
    path = Path(arguments.path("output", output))
    arguments.whole("fmi", fmi, "major versions", 0)
    arguments.choice("fmi", str(fmi), [str(each) for each in VERSIONS])
    if path.suffix != ".fmu":
        raise ValueError(f"output {path} does not end in .fmu, by which importers know a unit; write {path.name}.fmu")
    model = as_model(source)
    if not model.parameters.sample_time:
        words = f"missing, and a co-simulation unit needs it as its step size; add {model.sample_time_advice}, in s"
        raise FormatError((("sample_time",), words))
    operator, arithmetic = operator or model.parameters.emit.operator, arithmetic or model.parameters.emit.arithmetic
    if operator == "both":
        raise ValueError("a co-simulation unit has one operator; give --operator inverse or --operator forward")
    texts = emitted_files(
        model, operator=operator, arithmetic=arithmetic, engine=engine, optimize=optimize, allow_partial=allow_partial,
        layout=LAYOUT,
    )
    writing.check_writable(path)
    one = _described(model, fmi, operator, texts[f"{model.name}.h"])
    sources = {
        f"{model.name}.h": texts[f"{model.name}.h"], f"{model.name}.c": texts[f"{model.name}.c"],
        "co-simulation.c": _code(one, operator, arithmetic),
        SUPPORT: template("library.c.j2", name=model.name, operators=()),
    }
    files: dict[str, bytes] = {"modelDescription.xml": description.xml(one).encode()}
    platforms = [each for each in PLATFORMS.values() if each.fmi3]
    built: dict[str, list[bytes]] = {}
    with writing.temporary() as work, Progress(len(platforms), progress, "compiling") as bar:
        for each in platforms:
            flags = ("-fvisibility=hidden", "-Wno-unused-parameter", "-Wno-missing-prototypes")
            binary = linked(each, work / each.name, sources, model.name, flags)
            built.setdefault(_place(each, fmi, model.name), []).append(binary)
            bar.tick(1)
    files |= {place: each[0] if len(each) == 1 else universal(each) for place, each in built.items()}
    writing.write_atomically(path, archive(files))
    return path


def _place(platform: Platform, fmi: int, name: str) -> str:
    """Path of a platform's binary in a unit."""
    return f"binaries/{platform.fmi2 if fmi == 2 else platform.fmi3}/{name}.{platform.ending}"


def _described(model: Model, fmi: int, operator: str, header: str) -> Description:
    whole = model.parameters
    low, high = whole.input_range
    drive = Signal("v", whole.units.input, "drive", min(max(0.0, low), high))
    displacement = Signal("y", whole.units.output, "displacement")
    reference = Signal("u", whole.units.output, "reference of the displacement")
    given, answer = (drive, displacement) if operator == "forward" else (reference, drive)
    warm = None
    if any(f"{model.name}_{operator}_set_temperature(" in each for each in exports(model.name, header)):
        warmed = (effect for effect in whole.model.effects if effect.columns)
        degrees = [each for effect in warmed if (each := getattr(effect, "reference", None)) is not None]
        warm = Signal("temperature", "degC", "temperature of the actuator; until it is set, that of the references",
                      float(degrees[0]) if degrees else 0.0)
    token = _token(fmi, header)
    about = whole.description or f"{operator} operator of {model.name}"
    assert whole.sample_time is not None
    return Description(
        model, fmi, token, whole.sample_time, given, answer, warm, description.parameters(model), about
    )


def _token(fmi: int, header: str) -> str:
    """A UUID from the header, which has the hash of the parameters and the options."""
    found = str(uuid.UUID(bytes=hashlib.sha256(f"FMI {fmi}\n{header}".encode()).digest()[:16], version=5))
    return f"{{{found}}}"


def _code(one: Description, operator: str, arithmetic: str) -> str:
    """The C of a unit's interface."""
    name, kind = one.model.name, ARITHMETICS[arithmetic]
    sides = ("DRIVE", "OUTPUT") if operator == "forward" else ("OUTPUT", "DRIVE")
    return template(
        f"fmi{one.fmi}.c.j2", name=name, NAME=name.upper(), op=operator, fmi=one.fmi, token=one.token,
        temperature=one.temperature, parameters_from=description.PARAMETERS,
        temperature_start=repr(one.temperature.start) if one.temperature else "", input_start=repr(one.given.start),
        values=[repr(each.value) for each in one.parameters], sample_time=repr(one.sample_time),
        wrong_step=f"doStep: the step of {name} is its sample time, {one.sample_time:g} s; set the communication step "
        "size to it",
        wrong_token=f"instantiate: the identifier is not that of {name}; unpack the unit again",
        fixed=arithmetic in FIXED, single=kind.c_type == "float", largest=2 ** (8 * kind.bytes - 1) - 1,
        input_side=sides[0], output_side=sides[1],
    )


def universal(libraries: Sequence[bytes]) -> bytes:
    """Mach-O libraries for different processors as one file, which starts with a table of processor, offset and
    size."""
    start = 1 << _ALIGNMENT
    table, body = struct.pack(">II", _MAGIC, len(libraries)), b""
    for each in libraries:
        processor, variant = struct.unpack_from("<II", each, 4)
        table += struct.pack(">IIIII", processor, variant, start + len(body), len(each), _ALIGNMENT)
        body += each + bytes(-len(each) % (1 << _ALIGNMENT))
    return table.ljust(start, b"\0") + body


def archive(files: Mapping[str, bytes]) -> bytes:
    """A zip archive of these files, uncompressed: compressed bytes depend on the version of zlib."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_STORED) as whole:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, _DATE)
            entry.create_system, entry.external_attr = 3, _FILE_MODE  # as on Linux, wherever it is written
            whole.writestr(entry, content)
    return held.getvalue()
