"""What the site takes from the program itself: keys of the parameter file, effects, status bits, cores, the C header.

Each table has a directive, so no page can differ from what the program does.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.errors import ConfigError
from sphinx.util.docutils import SphinxDirective

import hystgen
from hystgen import effects
from hystgen.arithmetic import ARITHMETICS
from hystgen.emission import manifest
from hystgen.emission.calls import emitted_files
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification import targets

PLAYS = """
hystgen: 1
name: stage_x
units: {input: V, output: um}
sample_time: 5.0e-5
input_range: [0, 100]
emit: {operator: both}
model: {pi: {thresholds: [0, 5, 15, 30], weights: [0.12, 0.03, 0.02, 0.01]}
"""

MODELS = {
    "stage_x": PLAYS + "}",
    "stage_y": PLAYS.replace("stage_x", "stage_y").replace("both", "inverse")
    + """, effects: [
    {name: lag, time_constant: 2.0e-4}, {name: delay, time: 1.0e-4}, {name: slew_limit, rate: 2.0e+4},
    {name: creep, time_constants: [0.1, 1.0], weights: [0.02, 0.01]},
    {name: ageing, shape: logarithmic, loss: 0.01, travel: 1.0e+4},
    {name: thermal, source: logged, gain_per_degree: 0.001, offset_per_degree: 0.01, reference: 20},
    {name: influence, column: load, offset: 0.01, reference: 5}]}
""",
}
"""Parameter files of the headers shown: one with plays alone, and one whose effects need every call."""

ENVELOPE = PLAYS + ", memoryless: {kind: tanh, ascending: {a0: 60, a1: 0.01, a2: 0, a3: 0}}}"


def emitted(parameters: str, **options: str) -> dict[str, str]:
    """Names and text of the C files of a parameter file."""
    return emitted_files(Model(parse_parameters(parameters, "page.yaml")), **options)


# Tables --------------------------------------------------------------------------------------------


def cell(text: object) -> str:
    """Text in a table of Markdown."""
    return str(text).replace("|", "\\|").replace("\n", " ")


def code(text: object) -> str:
    """Text as code in a table; an empty cell stays empty."""
    return f"`{cell(text)}`" if text not in ("", None) else ""


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of Markdown; cells are Markdown already."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def kind(node: dict[str, Any], names: dict[str, str]) -> str:
    """A value of the JSON Schema in words; `names`: of definitions that have a section of their own."""
    if "$ref" in node:
        name = node["$ref"].rpartition("/")[2]
        return f"[{names[name]}](#{names[name]})" if name in names else "mapping"
    if "const" in node:
        return code(node["const"])
    if "enum" in node:
        return ", ".join(map(code, node["enum"]))
    if "anyOf" in node:
        return " or ".join(dict.fromkeys(kind(each, names) for each in node["anyOf"]))
    if node.get("type") == "array":
        if "prefixItems" in node:
            return f"list of {len(node['prefixItems'])}: {kind(node['prefixItems'][0], names)}"
        return f"list: {kind(node['items'], names)}"
    words = {"string": "text", "integer": "whole number", "object": "mapping"}
    word = words.get(node.get("type", ""), node.get("type", "any value"))
    return word + limits(node)


def limits(node: dict[str, Any]) -> str:
    """The range of a number; limits that every number has are left out."""
    low, above, high = (node.get(key) for key in ("minimum", "exclusiveMinimum", "maximum"))
    found = []
    if above is not None:
        found.append(f"above {above:g}")
    elif low is not None and low > -1e30:
        found.append(f"from {low:g}")
    if high is not None and high < 1e30:
        found.append(f"up to {high:g}")
    return f" {' '.join(found)}" if found else ""


def keys(node: dict[str, Any], names: dict[str, str], without: Sequence[str] = ()) -> str:
    """The keys of a mapping of the schema."""
    rows = []
    for key, value in node.get("properties", {}).items():
        if key in without:
            continue
        default = "required" if key in node.get("required", ()) else code(value.get("default", ""))
        rows.append([code(key), kind(value, names), default, cell(value.get("description", ""))])
    return table(["key", "value", "default", "meaning"], rows) if rows else "No keys.\n"


# Directives ----------------------------------------------------------------------------------------


class Generated(SphinxDirective):
    """A directive that is replaced by Markdown."""

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes("\n".join(self.lines()), allow_section_headings=True)

    def lines(self) -> Iterator[str]:
        raise NotImplementedError


class ParameterKeys(Generated):
    """Every key of the parameter file, with a section for each mapping."""

    sections: ClassVar = {
        "Units": "units", "ModelParameters": "model", "PIParameters": "pi", "DensityParameters": "density",
        "DensityTable": "table", "DeadZoneParameters": "dead_zone", "TanhParameters": "tanh",
        "TanhBranch": "branch", "EmitDefaults": "emit", "Compensation": "compensation",
        "Converters": "converter", "Converter": "reference and drive", "Health": "health", "Degaussing": "degauss",
        "Residual": "residual",
    }  # fmt: skip

    def lines(self) -> Iterator[str]:
        schema = hystgen.schema()
        yield "## Top level\n\n" + keys(schema, self.sections)
        for name, title in self.sections.items():
            node = schema["$defs"][name]
            yield f"## {title}\n\n{node.get('description', '')}\n\n{keys(node, self.sections)}"
        unlisted = schema["$defs"].keys() - self.sections.keys()
        shapes = {shape.__name__ for each in effects.CATALOGUE for shape in effects.shapes(each)}
        if missing := unlisted - shapes:
            raise ConfigError(f"the parameter file has mappings without a section: {', '.join(sorted(missing))}")


class ManifestKeys(Generated):
    """Every key of a manifest, with a section for each mapping."""

    def lines(self) -> Iterator[str]:
        schema = manifest.schema()
        names = {"File": "files", "Bound": "bounds", "Figure": "figures", "AllowedDeviation": "misra"}
        yield "## Keys\n\n" + keys(schema, names)
        for name, title in names.items():
            node = schema["$defs"][name]
            yield f"## {title}\n\n{' '.join(node['description'].split())}\n\n{keys(node, names)}"


class EffectKeys(Generated):
    """Every effect of the catalogue with the keys of each shape, and how a compensator removes it."""

    def lines(self) -> Iterator[str]:
        definitions = hystgen.schema()["$defs"]
        for name in effects.CATALOGUE:
            yield f"## {name}\n"
            for shape in effects.shapes(name):
                own = definitions[shape.__name__]["properties"].get(shape.selector, {})
                word = f"`{shape.selector}: {own['const']}`: " if "const" in own else ""
                yield f"{word}{' '.join((shape.__doc__ or '').split())}\n"
                yield keys(definitions[shape.__name__], {}, ("name", shape.selector))
                how, word = cell(shape.compensation), shape.compensated
                yield f"Compensation: {how if how.startswith(word) else f'{word}; {how}'.rstrip('; ')}.\n"


class StatusBits(Generated):
    """The bits of the status functions, as headers of models with an envelope and with effects define them."""

    def lines(self) -> Iterator[str]:
        found: dict[str, tuple[str, set[str]]] = {}
        for header in (emitted(ENVELOPE)["stage_x.h"], emitted(MODELS["stage_y"])["stage_y.h"]):
            for name, bit, words in re.findall(r"^#define STAGE_\w_STATUS_(\w+) (\d+)u\s+/\* (.*) \*/$", header, re.M):
                found.setdefault(name, (bit, set()))[1].add(words)
        rows = [[code(f"NAME_STATUS_{name}"), bit, "; or ".join(sorted(words))] for name, (bit, words) in found.items()]
        yield table(["macro", "bit", "set when"], rows)


class Cores(Generated):
    """The targets of `hystgen verify`, and how each is built."""

    def lines(self) -> Iterator[str]:
        rows = [
            [
                code(each.name), "yes" if each.fpu else "no", code(" ".join(each.zig)),
                code(" ".join((each.gcc, *each.gcc_flags))), code(each.machine.name if each.machine else ""),
            ]
            for each in targets.TARGETS
        ]  # fmt: skip
        board = targets.AVR
        rows.append([code(board.name), "no", "", code(" ".join((board.gcc, *board.gcc_flags))), code(board.simulator)])
        yield table(["target", "FPU", "zig", "gcc", "whole firmware on"], rows)


class Arithmetics(Generated):
    """The arithmetics, with the type of a number."""

    def lines(self) -> Iterator[str]:
        for name in ARITHMETICS:
            header = emitted(MODELS["stage_x"], arithmetic=name)["stage_x.h"]
            (real,) = re.findall(r"^typedef (\w+) stage_x_real_t;$", header, re.M)
            yield f"- `{name}`: `NAME_real_t` is `{real}`"


# The header that Doxygen reads ---------------------------------------------------------------------


def for_doxygen(header: str) -> str:
    """What a header declares, with its comments marked for Doxygen, except those above a group of macros."""
    declared = header[header.index('extern "C" {') + len('extern "C" {') :]
    marked = re.sub(r"^( *)/\* (?!.*\*/\n#define)", r"\1/** ", declared, flags=re.MULTILINE)
    marked = re.sub(r"(?<=\S)( +)/\* ", r"\1/**< ", marked)
    return re.sub(r"^#(?:ifdef|endif|ifndef).*\n|^}$\n", "", marked, flags=re.MULTILINE)


def doxygen(app: Sphinx, config: Config) -> None:
    """Emit the headers that the reference shows, and have Doxygen read them."""
    program = shutil.which("doxygen")
    if program is None:
        raise ConfigError("the reference of the emitted C needs doxygen; install it with: apt-get install doxygen")
    folder = Path(app.doctreedir) / "emitted"
    folder.mkdir(parents=True, exist_ok=True)
    for name, parameters in MODELS.items():
        (folder / f"{name}.h").write_text(for_doxygen(emitted(parameters)[f"{name}.h"]), encoding="ascii")
    options = {
        "INPUT": " ".join(f'"{folder / name}.h"' for name in MODELS), "OUTPUT_DIRECTORY": f'"{folder}"',
        "GENERATE_XML": "YES", "GENERATE_HTML": "NO", "GENERATE_LATEX": "NO", "OPTIMIZE_OUTPUT_FOR_C": "YES",
        "EXTRACT_ALL": "YES", "QUIET": "YES", "WARN_AS_ERROR": "YES",
    }  # fmt: skip
    text = "".join(f"{key} = {value}\n" for key, value in options.items())
    done = subprocess.run([program, "-"], input=text, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ConfigError(f"doxygen failed:\n{done.stderr}")
    config.breathe_projects = {"emitted": str(folder / "xml")}


def escaped(_app: Sphinx, _context: object, lines: list[str]) -> None:
    """Help of the command line as reStructuredText, in which a bare star would begin markup."""
    lines[:] = [line.replace("*", "\\*") for line in lines]


DIRECTIVES: dict[str, type[Directive]] = {
    "parameter-keys": ParameterKeys, "manifest-keys": ManifestKeys, "effect-keys": EffectKeys,
    "status-bits": StatusBits, "cores": Cores, "arithmetics": Arithmetics,
}  # fmt: skip


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    for name, directive in DIRECTIVES.items():
        app.add_directive(name, directive)
    app.connect("config-inited", doxygen)
    for part in ("description", "options"):
        app.connect(f"sphinx-click-process-{part}", escaped)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
