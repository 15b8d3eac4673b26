"""Static checks of the C: cppcheck with its MISRA C:2012 addon, clang-tidy, gcc -fanalyzer, clang-format.

    python tests/static_checks.py

Emits the modules of MODULES. Fails on every finding of a rule or check that `deviations.yaml` does not list with a
reason, and on every listed deviation that no module shows any more. gcc must find nothing at all. The source files of
`c_runtime/` and of effects are checked too: by clang-tidy and gcc in the units of `units.ANALYSED`, of which every
other one runs without HYSTGEN_WHOLE=1, and by clang-format.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import units
from modelfiles import CHAINS, CODED, FILES, LED

import hystgen
from hystgen.emission import manifest
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification.compilers import C_WARNINGS

TOOLS = ("cppcheck", "clang-tidy", "gcc", "clang-format")


MODULES = (  # every kind of model, operator, arithmetic, engine and layout
    ("plain", "inverse", "float32", "corners", "self-contained"),
    ("below", "inverse", "float32", "corners", "self-contained"),
    ("plain", "both", "q31", "corners", "shared-runtime"),
    ("plain", "inverse", "q15", "loop", "self-contained"),
    ("listed", "both", "float32", "corners", "single-header"),
    ("listed", "both", "q15", "corners", "self-contained"),
    ("bent", "both", "float64", "loop", "self-contained"),
    ("bent", "inverse", "q31", "corners", "self-contained"),
    ("curved", "both", "float32", "loop", "shared-runtime"),
    ("curved", "inverse", "float64", "corners", "self-contained"),
    ("two_branches", "both", "float32", "corners", "self-contained"),
    ("two_branches", "both", "float64", "corners", "shared-runtime"),
    ("mixed", "both", "q31", "loop", "single-header"),
    ("mixed", "forward", "float32", "corners", "single-header"),
    ("linear", "both", "float32", "corners", "self-contained"),
    ("linear", "both", "q15", "corners", "shared-runtime"),
    ("everything", "inverse", "float32", "loop", "self-contained"),
    ("viscous", "both", "float64", "loop", "shared-runtime"),
    ("everything", "inverse", "q31", "loop", "self-contained"),
    ("relaxing", "both", "q15", "loop", "shared-runtime"),
    ("worn", "both", "q15", "loop", "single-header"),
    ("everything", "inverse", "float32", "corners", "self-contained"),
    ("led", "both", "q31", "corners", "shared-runtime"),
    ("coded", "inverse", "float32", "corners", "single-header"),
    ("coded", "both", "q15", "loop", "self-contained"),
)

# cppcheck reads no system headers: these are the values of <float.h> on every target, and the core with the most code
# to check. `unix32` is a target with int and long of 32 bits
CPPCHECK = [
    "--enable=all", "--inconclusive", "--check-level=exhaustive", "--addon=misra", "--std=c99", "--platform=unix32",
    "--quiet", "--suppress=missingIncludeSystem", "--template={file}:{line}: [{id}] {message}",
    "-DFLT_RADIX=2", "-DFLT_MANT_DIG=24", "-DDBL_MANT_DIG=53", "-DFLT_EVAL_METHOD=0", "-DFLT_MAX=3.40282347e+38F",
    "-DDBL_MAX=1.7976931348623157e+308", "-D__ARM_ARCH_6M__=1",
]  # fmt: skip
CLANG_TIDY = [
    "--quiet",
    "--checks=-*,bugprone-*,cert-*,clang-analyzer-*,misc-*,performance-*,portability-*,readability-non-const-parameter,"
    "readability-inconsistent-declaration-parameter-name,readability-misleading-indentation,readability-redundant-*",
]
GCC = ["-std=c99", "-O2", "-fanalyzer", *C_WARNINGS, "-c", "-o", os.devnull]


@dataclass(frozen=True)
class Finding:
    """A tool's message about a line; `rule` is its name in `deviations.yaml`, None if no deviation is allowed."""

    tool: str
    rule: str | None
    text: str


def emit(folder: Path, name: str, operator: str, arithmetic: str, engine: str, layout: str) -> list[Path]:
    """Emit a module into `folder` and return the C files to compile."""
    model = Model(parse_parameters({**FILES, **CHAINS, **LED, **CODED}[name], f"{name}.yaml"))
    hystgen.emit(model, folder, operator=operator, arithmetic=arithmetic, engine=engine, layout=layout)
    if layout == "single-header":
        (folder / f"{name}.c").write_text(f'#define {name.upper()}_IMPLEMENTATION\n#include "{name}.h"\n')
    return sorted(folder.glob("*.c"))


def find(tool: str) -> str | None:
    """Path of a tool: next to this Python, where its wheel puts it, or on PATH; None if not found."""
    return shutil.which(tool, path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))


def _run(command: Sequence[str | Path]) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)


def cppcheck(tool: str, sources: Sequence[Path]) -> Iterator[Finding]:
    """Check all files of a module at once, since some rules concern the whole program."""
    done = _run([tool, *CPPCHECK, *sources])
    if done.returncode:
        yield Finding("cppcheck", None, done.stdout + done.stderr)
    for line in done.stderr.splitlines():
        found = re.search(r": \[(?:misra-c2012-(?P<misra>[\d.]+)|(?P<check>\w+))\] ", line)
        if found and found["misra"]:
            yield Finding("misra", found["misra"], line)
        elif found and found["check"] == "checkersReport" and "critical errors" not in line:
            continue
        else:
            yield Finding("cppcheck", found["check"] if found else None, line)


def clang_tidy(tool: str, sources: Sequence[Path], more: Sequence[str] = ()) -> Iterator[Finding]:
    """Check each file separately."""
    done = _run([tool, *CLANG_TIDY, *sources, "--", "-std=c99", "-ffreestanding", *more])
    said = [re.search(r" (warning|error): .* \[([\w.,-]+)\]$", line) for line in done.stdout.splitlines()]
    for found in filter(None, said):
        for check in found[2].split(","):
            yield Finding("clang-tidy", check if found[1] == "warning" else None, found.string)
    if done.returncode and not any(said):
        yield Finding("clang-tidy", None, done.stdout + done.stderr)


def gcc(tool: str, sources: Sequence[Path], more: Sequence[str] = ()) -> Iterator[Finding]:
    """Compile each file with the analyser; warnings are errors."""
    for source in sources:
        done = _run([tool, *GCC, *more, source])
        if done.returncode:
            yield Finding("gcc", None, done.stderr)


EXTENSION = re.compile(
    r"# *pragma (?!STDC )(\w+ \w+)|_Pragma\(\"(?!STDC )(\w+ \w+)|"
    r"__(attribute)__ *\(\((\w+)|\b(__builtin_\w+|(?:__)?asm(?:__)?)\b"
)


def extensions(sources: Sequence[Path]) -> Iterator[Finding]:
    """Language extensions in these files and their headers (MISRA rule 1.2, which none of these tools checks)."""
    files = {each for source in sources for each in (source, *source.parent.glob("*.h"))}
    for file in sorted(files):
        for number, line in enumerate(file.read_text(encoding="ascii").splitlines(), 1):
            for found in EXTENSION.finditer(line):
                yield Finding("extension", " ".join(filter(None, found.groups())), f"{file}:{number}: {line.strip()}")


def clang_format(tool: str, sources: Sequence[Path]) -> Iterator[Finding]:
    """Find files that are not formatted as the `.clang-format` beside them says."""
    done = _run([tool, "--dry-run", "--Werror", *sources])
    if done.returncode:
        yield Finding("clang-format", None, done.stderr)


LEFT_TO_EMISSION = ("bugprone-suspicious-include", "misc-use-internal-linkage", "misc-unused-parameters")
"""Checks that hold only for the text of an emitted module, not for a unit of source files."""


def standing(tools: Mapping[str, str], folder: Path, unit: tuple[str, str, str]) -> Iterator[Finding]:
    """Check a unit of source files of the run time, including code that emission would leave out of a model."""
    source = units.write(folder, *unit)
    more = [*units.INCLUDES, *units.FLAGS, *units.DEFINES[unit[1]]]
    yield from gcc(tools["gcc"], [source], more)
    for finding in clang_tidy(tools["clang-tidy"], [source], more):
        # a unit exists to include source files; functions of the interface are called from other files; emission
        # removes parameters that a model does not use
        if finding.rule not in LEFT_TO_EMISSION:
            yield finding


RUN = {"cppcheck": cppcheck, "clang-tidy": clang_tidy, "gcc": gcc}
"""Tools that check an emitted module."""


def problems(findings: Sequence[Finding], listed: Mapping[str, Mapping[str, str]], complete: bool = True) -> list[str]:
    """Findings that are not listed deviations, one per rule; in a complete run also deviations without a finding."""
    first: dict[tuple[str, str], list[str]] = {}
    for f in findings:
        if f.rule is None or f.rule not in listed.get(f.tool, {}):
            first.setdefault((f.tool, f.rule or f.text), []).append(f.text)
    said = []
    for (tool, _), texts in first.items():
        more = f"\n    and {len(texts) - 1} more" if len(texts) > 1 else ""
        said.append(f"{tool}: {texts[0].strip()}{more}")
    seen = {(f.tool, f.rule) for f in findings}
    if complete:
        for tool, rules in listed.items():
            said += [f"{tool}: {rule} is listed as a deviation and no longer found" for rule in rules
                     if (tool, rule) not in seen]  # fmt: skip
    return said


def deviations() -> dict[str, dict[str, str]]:
    """Listed deviations: for each tool, the reason for each rule."""
    listed = manifest.deviations()
    assert all(len(reason.split()) > 5 for rules in listed.values() for reason in rules.values())
    return listed


def main() -> int:
    """Run all checks. Returns the exit code, 0 if there are no problems."""
    tools = {name: path for name in TOOLS if (path := find(name))}
    missing = [name for name in TOOLS if name not in tools]
    if missing:
        print(f"static checks: {', '.join(missing)} not installed", file=sys.stderr)
        if os.environ.get("CI") or missing != ["gcc"]:
            return 1
    with tempfile.TemporaryDirectory(prefix="hystgen-static-") as name, ThreadPoolExecutor(os.cpu_count()) as pool:
        emitted = [emit(Path(name) / "-".join(module), *module) for module in MODULES]
        jobs = [pool.submit(lambda t, s: list(RUN[t](tools[t], s)), tool, files) for files in emitted for tool in RUN]
        jobs += [pool.submit(lambda s: list(extensions(s)), files) for files in emitted]
        analysed = units.ANALYSED[:: 1 if os.environ.get("HYSTGEN_WHOLE") else 2]
        jobs += [pool.submit(lambda u: list(standing(tools, Path(name), u)), unit) for unit in analysed]
        jobs.append(pool.submit(lambda: list(clang_format(tools["clang-format"], units.standing()))))
        findings = [finding for job in jobs for finding in job.result()]
    said = problems(findings, deviations())
    print("\n".join(said) or f"static checks: {', '.join(tools)} find nothing in {len(MODULES)} modules but deviations")
    return 1 if said else 0


if __name__ == "__main__":
    sys.exit(main())
