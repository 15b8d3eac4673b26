"""The static checks find planted defects and look at every kind of module."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import static_checks
from modelfiles import CHAINS, CODED, FILES, LED
from static_checks import MODULES, Finding, problems

from hystgen.arithmetic import ARITHMETICS
from hystgen.compensator.engines import ENGINES
from hystgen.emission.options import LAYOUTS

pytestmark = pytest.mark.thorough

# A defect of each kind in C that compiles without warnings
DEFECTS = {
    "cppcheck": ("arrayIndexOutOfBounds", "int f(void)", "int a[2] = {1, 2};\n    return a[2];"),
    "misra": ("15.1", "int f(int x)", "if (x > 0) {\n        goto out;\n    }\nout:\n    return x;"),
    "clang-tidy": ("bugprone-integer-division", "double f(int x)", "return 0.5 + (x / 2);"),
    "gcc": (None, "int f(const int *p)", "return p ? 0 : *p;"),
}


@pytest.mark.parametrize("tool", DEFECTS)
def test_a_defect_is_found(tool: str, tmp_path: Path) -> None:
    command = {"misra": "cppcheck"}.get(tool, tool)
    path = static_checks.find(command)
    if path is None:
        assert not os.environ.get("CI"), f"{command} is not installed"
        pytest.skip(f"{command} is not installed")
    rule, head, body = DEFECTS[tool]
    source = tmp_path / "defect.c"
    source.write_text(f"{head};\n{head}\n{{\n    {body}\n}}\n")
    found = list(static_checks.RUN[command](path, [source]))
    assert (tool, rule) in {(finding.tool, finding.rule) for finding in found}
    assert any("defect.c" in line for line in problems(found, static_checks.deviations(), complete=False))


def test_an_extension_is_found(tmp_path: Path) -> None:
    source = tmp_path / "defect.c"
    source.write_text('#pragma STDC FP_CONTRACT OFF\n#pragma GCC optimize("O3")\n#include "defect.h"\n')
    (tmp_path / "defect.h").write_text("static int f(void) __attribute__((pure));\n#define A __builtin_trap()\n")
    found = list(static_checks.extensions([source]))
    rules = [finding.rule for finding in found]
    assert rules == ["GCC optimize", "attribute pure", "__builtin_trap"]
    said = problems(found, static_checks.deviations(), complete=False)
    assert [line.partition(": ")[2].partition(":")[0] for line in said] == [str(tmp_path / "defect.h")] * 2


def test_what_cannot_be_analysed_is_a_problem(tmp_path: Path) -> None:
    path = static_checks.find("cppcheck")
    if path is None:
        assert not os.environ.get("CI"), "cppcheck is not installed"
        pytest.skip("cppcheck is not installed")
    source = tmp_path / "refused.c"
    source.write_text('#error "not on this target"\n')
    found = list(static_checks.cppcheck(path, [source]))
    assert problems(found, static_checks.deviations(), complete=False)


def test_deviations_are_neither_missing_nor_left_over() -> None:
    listed = {"misra": {"15.5": "a reason"}, "cppcheck": {}}
    known, other = Finding("misra", "15.5", "a.c:1"), Finding("misra", "15.1", "a.c:2")
    assert problems([known], listed) == []
    assert problems([known, other, other], listed) == ["misra: a.c:2\n    and 1 more"]
    assert problems([known, Finding("cppcheck", None, "failed")], listed) == ["cppcheck: failed"]
    (left_over,) = problems([], listed)
    assert "15.5" in left_over
    assert problems([], listed, complete=False) == []


def test_every_kind_of_module_is_looked_at() -> None:
    names, operators, arithmetics, engines, layouts = (set(column) for column in zip(*MODULES, strict=True))
    assert names >= {"plain", "listed", "bent", "curved", "two_branches", "mixed", "linear", "coded"}
    assert names <= {*FILES, *CHAINS, *LED, *CODED}
    assert operators == {"inverse", "forward", "both"}
    assert (arithmetics, engines, layouts) == (set(ARITHMETICS), set(ENGINES), set(LAYOUTS))
