"""Blocks of parameters for modules that load them: making, checking and describing them."""

from __future__ import annotations

import os
import re
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hystgen.basics import arguments, writing
from hystgen.basics.problems import FormatError
from hystgen.emission import block, module
from hystgen.emission.block import HEAD, MAGIC, VERSION, UnitParameters
from hystgen.emission.calls import emit_options, emitted_model
from hystgen.emission.options import read_banner
from hystgen.model import Model, ModelSource, as_model
from hystgen.parameters.files import parameters_sha256

TAKEN = ("operator", "arithmetic", "engine")
"""Options of the module that a block has to share; a header states them."""


def parameters(model: Model, header: str | os.PathLike[str] | None = None, **options: Any) -> UnitParameters:
    """The parameters of a unit; `header`: that of the module that is to load them, whose options are used.

    Raises what `emit` raises, ValueError if `header` is not that of a module that loads parameters, and FormatError if
    the unit does not fit the module.
    """
    text = ""
    if header is not None:
        text = Path(header).read_text(encoding="utf-8", errors="replace")
        banner = read_banner(text.replace("\r\n", "\n"))
        if banner is None or banner.options.get("tables") != "runtime":
            raise ValueError(
                f"{os.fspath(header)}: is not the header of a module that loads its parameters; emit it with "
                "--tables runtime"
            )
        options = {key: banner.options[key] for key in TAKEN} | {key: each for key, each in options.items() if each}
    chosen = emit_options(model, **options, tables="runtime")
    own = emitted_model(model, chosen)
    made = module.parameters(own, chosen, parameters_sha256(model.parameters), _room(text))
    if text and f'_LAYOUT "{made.hash.hex()}"' not in text:
        raise FormatError((("model",), _misfit(made, text, os.fspath(header or ""))))
    if header is not None and (outside := _outside(made, text, Path(header).with_suffix(".c"))):
        raise FormatError((("model",), f"{os.fspath(header)} takes no such numbers: {outside}; emit the module from a "
                           "unit in the middle of the fleet, and make all blocks again"))
    return made


def _outside(made: UnitParameters, text: str, source: Path) -> str:
    """The first number that a module would refuse, and its limits; empty if there is none."""
    if source.is_file():
        text += source.read_text(encoding="utf-8", errors="replace")
    for real, group in zip((True, False), made.groups, strict=True):
        numbers = [(leaf.name, x) for leaf in group for x in leaf.values]
        kind = made.real if real else "whole"
        at = 0
        for words in _rows(text, kind):
            least, most = (block.value(word, kind) for word in words[:2])
            count, rises = int(block.read(words[2])), int(block.read(words[3 if real else 4]))
            row = block.NumberLimits(least, most, count, rises, 0 if real else int(block.read(words[5])))
            if wrong := block.outside(row, [x for _, x in numbers[at : at + count]]):
                return f"{numbers[at][0]} = {wrong}"
            at += count
    places = {at: leaf.name for leaf, at in made.placed()}
    for words in _rows(text, "factor"):
        factors = block.FactorPlace(*map(block.read, words))
        if wrong := block.factors_outside(factors, made.block()[block.HEAD.size :]):
            return f"{places[factors.mantissa].removesuffix('.mantissa')} = {wrong}"
    return ""


def _rows(text: str, kind: str) -> list[list[str]]:
    """The words of each row of limits of a kind in a module."""
    found = re.search(rf"\w+_{kind}_range\[\d+\] = \{{(.*?)\n\}};", text, re.DOTALL)
    return [row.split(",") for row in re.findall(r"\{([^{}]*)\}", found[1])] if found else []


def _room(text: str) -> dict[str, int]:
    """How many entries the tables of a module have whose lengths follow from numbers."""
    found = re.search(r"typedef struct \{\n((?:(?!typedef).)*)\n\} \w+_parameters_t;", text, re.DOTALL)
    shape = _shape(found[1]) if found else {}
    return {name: int(lengths[1:].split("]")[0]) for name, lengths in shape.items() if lengths}


def _misfit(made: UnitParameters, text: str, header: str) -> str:
    """Why a unit does not fit a module."""
    found = re.search(r"typedef struct \{\n((?:(?!typedef).)*)\n\} \w+_parameters_t;", text, re.DOTALL)
    there, here = _shape(found[1] if found else ""), _shape(made.declared.partition("{\n")[2])
    other = [
        f"{name} is only {'here' if name in here else 'in the module'}" if (name in here) != (name in there)
        else f"{name} has {here[name] or 'one number'} here, {there[name] or 'one number'} there"
        for name in dict.fromkeys((*here, *there)) if here.get(name) != there.get(name)
    ]
    what = "; ".join(other[:5]) or "the code differs: another version of hystgen, or another order of effects"
    return (
        f"does not have the layout of {header} ({what}); give the unit the same structure, or emit the module again "
        "from the unit that needs most, and make all blocks again"
    )


def _shape(members: str) -> dict[str, str]:
    """The lengths of the members of a structure by name."""
    bare = re.sub(r"/\*.*?\*/", "", members, flags=re.DOTALL)
    return dict(re.findall(r"(\w+)((?:\[\d+\])*);", bare))


@arguments.checked
def blob(
    source: ModelSource, output: str | os.PathLike[str] | None = None, header: str | os.PathLike[str] | None = None,
    operator: str | None = None, arithmetic: str | None = None, engine: str | None = None,
    optimize: str | None = None, allow_partial: bool = False,
) -> bytes:
    """The block that carries a unit's parameters to a module emitted with `tables="runtime"`; written to `output`.

    `source`: a model, a parameter file, or a result of `identify` or `diagnose`; `header`: NAME.h of the module, whose
    options are used, and whose layout is compared; the other options are those with which the module was emitted. The
    same parameters give the same bytes. Raises what `emit` raises, ValueError if `header` is not that of such a module,
    FormatError if the unit does not fit it, and OSError.
    """
    made = parameters(
        as_model(source), header, operator=operator, arithmetic=arithmetic, engine=engine, optimize=optimize,
        allow_partial=allow_partial,
    ).block()
    if output is not None:
        writing.write_atomically(output, made)
    return made


@arguments.checked
def show_blob(
    data: bytes, source: ModelSource | None = None, header: str | os.PathLike[str] | None = None,
    operator: str | None = None, arithmetic: str | None = None, engine: str | None = None,
    optimize: str | None = None, allow_partial: bool = False,
) -> dict[str, Any]:
    """What a block contains: `version`, `layout`, `name`, `parameters` (first 8 bytes of their SHA-256), `size`, and
    `damage`, empty if there is none. With `source`, the parameters of any unit for the same module, and the options of
    that module, also `numbers`, by name."""
    found: dict[str, Any] = {"damage": "", "size": len(data)}
    if len(data) < HEAD.size + 4 or data[:4] != MAGIC:
        return found | {"damage": "magic: not a block of parameters, or only the beginning of one"}
    _, version, _, size, layout, parameters_, name = HEAD.unpack(data[: HEAD.size])
    found |= {
        "version": version, "layout": layout.hex(), "parameters": parameters_.hex(),
        "name": name.rstrip(b"\0").decode("ascii", "replace"),
    }
    if version != VERSION:
        return found | {"damage": f"version: {version}, and this hystgen reads {VERSION}"}
    if size != len(data):
        return found | {"damage": f"size: {len(data)} bytes, and the block says {size}"}
    if zlib.crc32(data[:-4]) != struct.unpack("<I", data[-4:])[0]:
        return found | {"damage": "crc: the bytes have changed since the block was made"}
    if source is None:
        return found
    wanted = parameters(
        as_model(source), header, operator=operator, arithmetic=arithmetic, engine=engine, optimize=optimize,
        allow_partial=allow_partial,
    )
    if layout != wanted.hash:
        return found | {"damage": f"layout: not that of {wanted.name} with these options, {wanted.hash.hex()}"}
    numbers = dict(_numbers(wanted, data[HEAD.size : -4]))
    wrong = [leaf.name for leaf, rows in block.rows(wanted) if not block.fits(leaf, rows, numbers[leaf.name])]
    return found | {"numbers": numbers, "damage": f"numbers: {', '.join(wrong)} out of range" if wrong else ""}


def _numbers(wanted: UnitParameters, data: bytes) -> Mapping[str, list[float | int]]:
    found, at = {}, 0
    for leaf in (leaf for group in wanted.groups for leaf in group):
        form = f"<{len(leaf.values)}{block.STORED[leaf.kind]}"
        found[leaf.name] = [*struct.unpack_from(form, data, at)]
        at += struct.calcsize(form)
    return found

