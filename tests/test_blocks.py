"""Modules that load their parameters: bits, blocks, reasons to refuse one, and damaged blocks."""

from __future__ import annotations

import functools
import json
import os
import shutil
import struct
import subprocess
import zlib
from collections.abc import Callable
from pathlib import Path

import jinja2
import numpy as np
import pytest
from click.testing import CliRunner
from modelfiles import CHAINS, CODED, FILES, INVERSE_ALONE, PLAYS, chain
from test_proof import MACHINES, frama_c

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.cli import main
from hystgen.emission import block, module
from hystgen.emission.calls import emit_options, emitted_files
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification import host, sources
from hystgen.verification.comparison import expected_records

EVERY = {**FILES, **CHAINS, **CODED}
SOME = [("plain", "float32"), ("bent", "q31"), ("creeping", "q15"), ("coded", "float64")]
OTHER = PLAYS.replace("0.72, 0.6, 0.48", "0.69, 0.63, 0.46").replace("0.9, 1.35", "0.91, 1.33")


def model(name: str, other: bool = False) -> Model:
    """A model, or another unit of the same kind."""
    text = EVERY[name]
    return Model(parse_parameters(text.replace(PLAYS, OTHER) if other else text, f"{name}.yaml"))


def made(one: Model, arithmetic: str, operator: str = "both", **options: str) -> module.Module:
    return module.of(one, emit_options(one, operator, arithmetic, tables="runtime", **options))  # type: ignore[arg-type]


def parameters(one: Model, arithmetic: str, operator: str = "both", **options: str) -> block.UnitParameters:
    found = made(one, arithmetic, operator, **options).parameters
    assert found is not None
    return found


def compiler(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        (pytest.fail if os.environ.get("CI") else pytest.skip)(f"{name} is missing")
    return found


def differing(name: str, arithmetic: str, folder: Path, length: int, layout: str = "self-contained") -> dict[str, int]:
    """How many answers of another unit, loaded into the module of the first, differ from its reference's."""
    operator = "inverse" if name in INVERSE_ALONE else "both"
    one, unit = model(name), model(name, other=True)
    options = emit_options(one, operator, arithmetic, layout=layout, tables="runtime")
    whole = module.of(one, options)
    own = parameters(unit, arithmetic, operator, layout=layout)
    assert whole.parameters
    assert own.hash == whole.parameters.hash
    assert own.block() != whole.parameters.block()
    written = sources.write(folder, one, options)
    compensator, number = whole.compensator, ARITHMETICS[arithmetic]
    written.harness.write_text(
        sources.harness(
            one.name, options.operators, compensator.calls, number, compensator.variant.coded,
            len(compensator.columns), block=block.words(own),
        )
    )
    numbers = unit.tables(arithmetic, options.engine, operator)
    records = functools.cache(lambda op: expected_records(numbers, number.number, op == "inverse", length))
    rows = host.rows(written, records, number.number, ("gcc",), folder, lambda _: None, None)
    strict = [row for row in rows if row.build == "strict"]
    assert not any(row.error for row in strict), strict
    return {row.operator: row.different for row in strict}


@pytest.mark.parametrize(("name", "arithmetic"), SOME[:2])
def test_another_unit_through_the_same_module(name: str, arithmetic: str, tmp_path: Path) -> None:
    assert differing(name, arithmetic, tmp_path, 300) == {"forward": 0, "inverse": 0}


@pytest.mark.slow
@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("name", [name for name in EVERY if PLAYS in EVERY[name]])
def test_bits_of_another_unit(name: str, arithmetic: str, tmp_path: Path) -> None:
    assert not any(differing(name, arithmetic, tmp_path, 2000).values())


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["shared-runtime", "single-header"])
def test_layouts(layout: str, tmp_path: Path) -> None:
    assert not any(differing("plain", "q31", tmp_path, 300, layout).values())


def test_verify_runs_the_self_test_and_compares() -> None:
    report = hystgen.verify(
        model("plain"), arithmetic="float32", operator="inverse", tables="runtime", compiler=["gcc"], length=300
    )
    assert report.ok


def test_blocks_are_small_and_the_same_each_time() -> None:
    own = parameters(model("plain"), "float32")
    numbers = sum(len(leaf.stored) for leaf in own.leaves)
    assert own.block() == parameters(model("plain"), "float32").block()
    assert len(own.block()) <= numbers + 64
    assert struct.pack("<f", 0.72) in own.block()  # little-endian, the first weight


def test_constant_tables_stay_as_they_are() -> None:
    one = model("plain")
    assert emitted_files(one, arithmetic="q15") == emitted_files(one, arithmetic="q15", tables="constant")
    assert "--tables" not in emitted_files(one, arithmetic="q15")["plain.h"]


REASON = """
#include "plain.h"
#include <stdio.h>
#include <string.h>
static unsigned char bytes[4096];
static plain_parameters_t to, before;
int main(void) {
    const size_t size = fread(bytes + 1, 1, 4000, stdin); /* at an odd address */
    int reason;
    memset(&to, 0x5a, sizeof to);
    before = to;
    reason = plain_load(&to, bytes + 1, size);
    printf("%d %d", reason, memcmp(&to, &before, sizeof to) == 0);
    return 0;
}
"""


@pytest.fixture(scope="module")
def load(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes]:
    """A program that loads the block from its input, and prints the reason and whether the target is unchanged."""
    folder = tmp_path_factory.mktemp("load")
    own = made(model("plain"), "float32", "inverse")
    for name, text in module.files(own).items():
        (folder / name).write_text(text)
    (folder / "main.c").write_text(REASON)
    program = folder / "load"
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-fsanitize=address,undefined"]
    subprocess.run([compiler("gcc"), *flags, "main.c", "plain.c", "-o", program], cwd=folder, check=True)
    assert own.parameters
    return program, own.parameters.block()


def number(at: int, *values: float) -> Callable[[bytes], bytes]:
    """Replaces numbers of the inverse's block, in floats from its first one on, and repairs the CRC."""

    def changed(whole: bytes) -> bytes:
        begin = block.HEAD.size + 4 * at
        data = whole[:begin] + struct.pack(f"<{len(values)}f", *values) + whole[begin + 4 * len(values) :]
        return data[:-4] + struct.pack("<I", zlib.crc32(data[:-4]))

    return changed


DAMAGES: dict[str, tuple[Callable[[bytes], bytes], int]] = {
    "whole": (lambda b: b, 0),
    "empty": (lambda _: b"", 1),
    "magic": (lambda b: b"X" + b[1:], 1),
    "version": (lambda b: b[:4] + b"\2" + b[5:], 2),
    "layout": (lambda b: b[:12] + bytes([b[12] ^ 1]) + b[13:], 3),
    "short": (lambda b: b[:-1], 4),
    "long": (lambda b: b + b"\0", 4),
    "crc": (lambda b: b[:-1] + bytes([b[-1] ^ 1]), 5),
    "bit": (lambda b: b[:70] + bytes([b[70] ^ 16]) + b[71:], 5),
    "not a number": (number(0, float("nan")), 6),
    "infinite": (number(1, float("inf")), 6),
    "ends exchanged": (number(0, 4.0, -4.0), 6),
    "not monotone": (number(7, 0.0, 3.0, 1.8), 6),
    "out of range": (number(1, 4e30), 6),
}


@pytest.mark.parametrize("what", DAMAGES)
def test_reasons(what: str, load: tuple[Path, bytes]) -> None:
    program, whole = load
    change, reason = DAMAGES[what]
    found = subprocess.run([program], input=change(whole), capture_output=True, check=True).stdout
    assert found.decode() == f"{reason} {int(reason > 0)}"


def test_every_truncation_and_flipped_bit_is_refused(load: tuple[Path, bytes]) -> None:
    program, whole = load
    draw = np.random.default_rng(1)
    for bit in draw.choice(8 * len(whole), 40, replace=False):
        data = bytearray(whole)
        data[bit // 8] ^= 1 << bit % 8
        assert subprocess.run([program], input=bytes(data), capture_output=True, check=True).stdout[:1] in b"12345"
    for size in draw.choice(len(whole), 10, replace=False):
        assert subprocess.run([program], input=whole[:size], capture_output=True, check=True).stdout[:1] in b"1234"


def fuzzed(name: str, arithmetic: str, folder: Path, blocks: int, seed: int = 1) -> int:
    """How many of so many damaged blocks with a repaired CRC load; steps with these are within their ranges."""
    own = made(model(name), arithmetic)
    assert own.parameters
    one, calls, operators = own.parameters, own.compensator.calls, own.compensator.options.operators
    for file, text in module.files(own).items():
        (folder / file).write_text(text)
    settings = ("push", "settle", "set_offset", "set_temperature", "set_gain")
    template = jinja2.Template(
        (Path(__file__).parent / "block_fuzz.c.j2").read_text(), trim_blocks=True, lstrip_blocks=True
    )
    (folder / "fuzz.c").write_text(
        template.render(
            name=name, block=block.words(one), real=one.real, fixed=not one.real, head=block.HEAD.size,
            described=sum(len(each.stored) for each in one.groups[0] if each.described), operators=operators,
            ends={"inverse": "output", "forward": "drive"},
            settings={op: [each for each in settings if each in calls.get(op, ())] for op in operators},
        )
    )
    flags = ["-std=c99", "-O1", "-w", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
    subprocess.run([compiler("clang"), *flags, "fuzz.c", "-o", "fuzz"], cwd=folder, check=True)
    done = subprocess.run([folder / "fuzz", str(blocks), str(seed)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return int(done.stdout)


FUZZED = [
    ("plain", "float32"), ("plain", "q31"), ("plain", "q15"), ("plain", "float64"), ("listed", "float32"),
    ("listed", "q31"), ("creeping", "q31"), ("creeping", "float32"), ("warm", "q15"), ("bent", "float32"),
    ("quick", "float32"), ("linear", "q31"), ("creeping", "q15"), ("logarithmic", "q15"), ("lagging", "q15"),
    ("quick", "q15"), ("worn", "q31"), ("worn", "q15"),
]
"""Modules whose blocks are damaged."""


@pytest.mark.parametrize(("name", "arithmetic"), FUZZED[:2])
def test_damaged_blocks(name: str, arithmetic: str, tmp_path: Path) -> None:
    assert fuzzed(name, arithmetic, tmp_path, 10_000) > 1000


@pytest.mark.slow
@pytest.mark.parametrize(("name", "arithmetic"), FUZZED)
def test_ten_million_damaged_blocks(name: str, arithmetic: str, tmp_path: Path) -> None:
    blocks = -(-10_000_000 // len(FUZZED))
    assert fuzzed(name, arithmetic, tmp_path, blocks, seed=7) > blocks // 20


EVA = """
#include "{name}.c"
/*@ assigns \\result \\from \\nothing; */
extern unsigned char any_byte(void);
/*@ assigns \\result \\from \\nothing; */
extern size_t any_size(void);
int main(void) {{
    static unsigned char block[{NAME}_BLOCK_SIZE];
    static {name}_parameters_t to;
    const size_t size = any_size();
    unsigned int i;
    for (i = 0; i < sizeof block; ++i) {{
        block[i] = any_byte();
    }}
    return {name}_load(&to, block, size <= sizeof block ? size : sizeof block);
}}
"""


@pytest.mark.thorough(each_time=True)
@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize(("name", "arithmetic"), [("plain", "q31"), ("creeping", "q15"), ("plain", "float32")])
def test_no_block_can_fault_the_loader(name: str, arithmetic: str, machine: str, tmp_path: Path) -> None:
    for file, text in module.files(made(model(name), arithmetic)).items():
        (tmp_path / file).write_text(text)
    (tmp_path / "main.c").write_text(EVA.format(name=name, NAME=name.upper()))
    text = (tmp_path / f"{name}.c").read_text()
    looping = ("fits", "floats_fit", "wholes_fit", "factors_fit", "described", "fill", "bytes")
    functions = [f"{name}_{what}" for what in looping]
    visits = ",".join(f"{function}:5000" for function in functions if f"{function}(" in text)
    done = subprocess.run(
        [frama_c(), *MACHINES[machine], "-warn-signed-downcast", "-warn-special-float", "none", "-eva",
         "-eva-precision", "0", "-eva-no-print", "-eva-slevel-function", visits, "-eva-domains",
         "symbolic-locations", tmp_path / "main.c"],
        capture_output=True, text=True, timeout=500, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "  0 alarms generated" in done.stdout, done.stdout


def test_command_line(tmp_path: Path) -> None:
    plain = EVERY["plain"]
    for name, text in (("a", plain), ("b", plain.replace(PLAYS, OTHER)), ("c", EVERY["two_branches"])):
        (tmp_path / f"{name}.yaml").write_text(text)
    run = CliRunner()

    def said(*words: object, code: int = 0) -> str:
        done = run.invoke(main, [*map(str, words)], catch_exceptions=False)
        assert done.exit_code == code, done.output
        return done.output

    said("emit", tmp_path / "a.yaml", "-o", tmp_path, "--tables", "runtime", "--arithmetic", "float32", "-q")
    said("emit", tmp_path / "a.yaml", "-o", tmp_path, "--tables", "runtime", "--arithmetic", "float32", "--check")
    header, unit = tmp_path / "plain.h", tmp_path / "b.bin"
    said("blob", tmp_path / "b.yaml", "-o", unit, "--module", header)
    assert unit.read_bytes() == hystgen.blob(str(tmp_path / "b.yaml"), arithmetic="float32")
    shown = json.loads(said("blob", "--show", unit, tmp_path / "b.yaml", "--module", header, "--json"))
    assert (shown["name"], shown["damage"], shown["numbers"]["drive_max"]) == ("plain", "", [4.0])
    said("blob", tmp_path / "a.yaml", tmp_path / "b.yaml", "-o", tmp_path / "fleet", "--module", header)
    assert sorted(path.name for path in (tmp_path / "fleet").iterdir()) == ["a.bin", "b.bin"]
    far = chain("far", "name: creep, time_constants: [0.1], weights: [0.02]")
    for name, text in (("d", far), ("e", far.replace("[0.02]", "[0.021]")), ("f", far.replace("[0.02]", "[0.04]"))):
        (tmp_path / f"{name}.yaml").write_text(text)
    said("emit", tmp_path / "d.yaml", "-o", tmp_path, "--tables", "runtime", "--arithmetic", "q31", "-q")
    said("blob", tmp_path / "e.yaml", "-o", unit, "--module", tmp_path / "far.h")
    told = said("blob", tmp_path / "f.yaml", "-o", tmp_path / "f.bin", "--module", tmp_path / "far.h", code=2)
    assert "takes no such numbers: creep_1_term." in told
    assert not (tmp_path / "f.bin").exists()
    unit.write_bytes(hystgen.blob(str(tmp_path / "b.yaml"), arithmetic="float32"))
    assert "is only here" in said("blob", tmp_path / "c.yaml", "-o", unit, "--module", header, code=2)
    unit.write_bytes(unit.read_bytes()[:-1])
    assert "size: " in said("blob", "--show", unit, code=1)
    assert "give PARAMS and -o" in said("blob", tmp_path / "a.yaml", code=2)
