"""Shared libraries and co-simulation units: what they are, what they export, and that their bits are the reference's.

Formats are read here from their descriptions, pyelftools reads ELF; FMPy, which shares no code with the package, loads
and validates the units.
"""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import struct
import subprocess
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import cffi
import fmpy
import numpy as np
import pytest
import unicorn
import wasmtime
from elftools.elf.elffile import ELFFile
from elftools.elf.relocation import RelocationSection
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from modelfiles import CHAINS, FILES
from numpy.typing import NDArray
from unicorn import arm64_const as arm64
from unicorn import x86_const as x86

import hystgen
from hystgen.arithmetic import ARITHMETICS, FIXED
from hystgen.cli import common
from hystgen.distribution import quantities
from hystgen.distribution.fmu import fmu
from hystgen.distribution.libraries import Library, build
from hystgen.distribution.platforms import PLATFORMS
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification import compilers

HOST = "x86_64-linux"  # where CI runs
LINKED = {"__dso_handle", "_mh_dylib_header"}
"""Symbols of its own that zig's linker exports from every dylib; no option leaves them out."""

SAMPLED = "sample_time: 1.0e-3\n"

Run = Callable[..., tuple[int, str, str]]


def model(name: str, more: str = "") -> Model:
    text = {**FILES, **CHAINS}[name]
    return Model(parse_parameters(text + more, f"{name}.yaml"))


def signal(one: Model, operator: str, count: int = 2000) -> NDArray[np.float64]:
    """A walk that turns often, leaves the range at both ends and repeats samples."""
    random = np.random.default_rng(count)
    low, high = one.cascade.input_range
    walk = np.cumsum(random.normal(0.0, 0.1 * (high - low), count))
    period = 2.4 * (high - low)
    drive = low - 0.1 * (high - low) + np.abs(walk % period - period / 2.0)
    drive[random.random(count) < 0.1] = drive[0]
    return drive if operator == "forward" else np.asarray(one.simulate(np.clip(drive, low, high))) + 0.05


def expected(one: Model, operator: str, arithmetic: str, x: NDArray[Any]) -> NDArray[Any]:
    """Answers of the bit-exact reference."""
    whole = one if operator == "forward" else one.inverse()
    return np.asarray(whole.simulate(x, arithmetic=arithmetic))


# Libraries


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Library]:
    """A model with two branches, whose C has both operators, built for every platform."""
    folder = tmp_path_factory.mktemp("libraries")
    return folder, build(model("two_branches"), folder, operator="both")


@dataclass(frozen=True)
class DLL:
    """A DLL for x86-64: its sections as address and content, the addresses of the functions that it exports, and of the
    pointers that move with it."""

    sections: dict[int, bytes]
    exports: dict[str, int]
    moved: list[int]


def read_dll(data: bytes) -> DLL:
    """A DLL from its headers, its export table and its table of base relocations."""

    def word(place: int) -> int:
        return int.from_bytes(data[place : place + 4], "little")

    start = word(0x3C)
    assert data[start : start + 6] == b"PE\0\0\x64\x86"
    count, optional = struct.unpack_from("<H12xH", data, start + 6)
    sections = {}
    for k in range(count):
        size, address, stored, raw = struct.unpack_from("<4I", data, start + 24 + optional + 40 * k + 8)
        sections[address] = data[raw : raw + stored].ljust(size, b"\0")

    def at(address: int, size: int) -> bytes:
        begin = max(each for each in sections if each <= address)
        return sections[begin][address - begin : address - begin + size]

    tables = start + 24 + 112
    names_count, functions, names, ordinals = struct.unpack("<4I", at(word(tables) + 24, 16))
    exports = {}
    for k in range(names_count):
        name = at(int.from_bytes(at(names + 4 * k, 4), "little"), 64).split(b"\0", 1)[0].decode()
        ordinal = int.from_bytes(at(ordinals + 2 * k, 2), "little")
        exports[name] = int.from_bytes(at(functions + 4 * ordinal, 4), "little")
    moved, place, end = [], word(tables + 40), word(tables + 40) + word(tables + 44)
    while place < end:
        page, size = struct.unpack("<2I", at(place, 8))
        entries = struct.unpack(f"<{(size - 8) // 2}H", at(place + 8, size - 8))
        moved += [page + (each & 0xFFF) for each in entries if each >> 12 == 10]
        place += size
    return DLL(sections, exports, moved)


def names_of_pe(data: bytes) -> set[str]:
    """Exported names of a DLL."""
    return set(read_dll(data).exports)


def commands_of_macho(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Load commands of a Mach-O file."""
    place = 32
    for _ in range(struct.unpack_from("<I", data, 16)[0]):
        command, size = struct.unpack_from("<II", data, place)
        yield command, data[place : place + size]
        place += size


def names_of_macho(data: bytes) -> tuple[set[str], set[str]]:
    """Names that a dylib exports, from the trie that its loader reads, and those of the libraries that it needs."""
    exported, needed = set(), set()
    for command, text in commands_of_macho(data):
        if command in (0x8000_0022, 0x8000_0033):  # LC_DYLD_INFO_ONLY, LC_DYLD_EXPORTS_TRIE
            start, size = struct.unpack_from("<II", text, 40 if command == 0x8000_0022 else 8)
            exported |= {each.removeprefix("_") for each in names_of_trie(data[start : start + size])}
        elif command == 0xC:  # LC_LOAD_DYLIB
            needed.add(text[24:].rstrip(b"\0").decode())
    return exported, needed


def names_of_trie(trie: bytes, place: int = 0, before: str = "") -> Iterator[str]:
    """Names in a trie of exports, whose nodes have a size, exported data if that is not 0, and labelled branches."""
    assert trie[place] < 128, "sizes fit one byte here"
    if trie[place]:
        yield before
    place += trie[place] + 1
    branches, place = trie[place], place + 1
    for _ in range(branches):
        end = trie.index(b"\0", place)
        label, place, to, shift = trie[place:end].decode(), end + 1, 0, 0
        while True:
            to |= (trie[place] & 0x7F) << shift
            shift, place = shift + 7, place + 1
            if trie[place - 1] < 128:
                break
        yield from names_of_trie(trie, to, before + label)


def names_of_elf(path: Path) -> tuple[str, set[str], set[str]]:
    """Machine of a shared object, the names that it exports and those that it expects from others."""
    with path.open("rb") as file:
        elf = ELFFile(file)
        symbols = [each for each in elf.get_section_by_name(".dynsym").iter_symbols() if each.name]
        needed = [tag for tag in elf.get_section_by_name(".dynamic").iter_tags() if tag.entry.d_tag == "DT_NEEDED"]
        assert not needed
        outside = {each.name for each in symbols if each["st_shndx"] == "SHN_UNDEF"}
        return elf["e_machine"], {each.name for each in symbols} - outside, outside


def names_said(library: Library) -> set[str]:
    return {re.findall(r"(\w+)\(", each)[0] for each in library.exports}


def test_the_files_are_those_of_the_contract(built: tuple[Path, Library]) -> None:
    folder, library = built
    endings = {"linux": "so", "windows": "dll", "macos": "dylib", "wasm32": "wasm"}
    wanted = {
        folder / target / f"two_branches.{ending}"
        for target in PLATFORMS
        for ending in ("h", endings[target.rpartition("-")[2]])
    }
    assert set(library.paths) == wanted == {path for path in folder.rglob("*") if path.is_file()}
    emitted = hystgen.emit(model("two_branches"), folder / "emitted", operator="both")[0]
    assert {path.read_bytes() for path in library.paths if path.suffix == ".h"} == {emitted.read_bytes()}
    shutil.rmtree(folder / "emitted")


def test_libraries_export_the_header_and_the_sizes_alone(built: tuple[Path, Library]) -> None:
    folder, library = built
    header = re.sub(r"/\*.*?\*/", "", (folder / HOST / "two_branches.h").read_text(), flags=re.DOTALL)
    public = set(re.findall(r"\b(two_branches_\w+)\(", header))
    assert {"two_branches_inverse_commit", "two_branches_forward_step"} <= public
    public |= {"two_branches_forward_size", "two_branches_inverse_size"}
    assert names_said(library) == public
    assert names_of_elf(folder / HOST / "two_branches.so") == ("EM_X86_64", public, set())
    assert names_of_elf(folder / "aarch64-linux" / "two_branches.so") == ("EM_AARCH64", public, set())
    assert names_of_pe((folder / "x86_64-windows" / "two_branches.dll").read_bytes()) == public
    for target, processor in (("x86_64-macos", 0x0100_0007), ("aarch64-macos", 0x0100_000C)):
        dylib = (folder / target / "two_branches.dylib").read_bytes()
        assert struct.unpack_from("<II", dylib) == (0xFEED_FACF, processor)
        assert struct.unpack_from("<I", dylib, 12)[0] == 6  # MH_DYLIB
        assert names_of_macho(dylib) == (public | LINKED, {"/usr/lib/libSystem.B.dylib"})
    wasm = wasmtime.Module(wasmtime.Engine(), (folder / "wasm32" / "two_branches.wasm").read_bytes())
    assert {each.name for each in wasm.exports} == public | {"memory", "__heap_base"}
    assert not list(wasm.imports)


def test_no_library_holds_a_path(built: tuple[Path, Library]) -> None:
    for path in built[1].paths:
        data = path.read_bytes()
        for place in (b"/tmp", b"hystgen-", str(Path.home()).encode()):
            assert place not in data, path


def stepped(library: Path, name: str, operator: str, real: str, x: NDArray[Any]) -> NDArray[Any]:
    """Answers of a library of this machine, through cffi and nothing but exported functions."""
    ffi = cffi.FFI()
    ffi.cdef(
        f"size_t {name}_{operator}_size(void); void {name}_{operator}_init(void *);"
        f"{real} {name}_{operator}_step(void *, {real});"
    )
    loaded = ffi.dlopen(str(library))
    axis = ffi.new("long long[]", getattr(loaded, f"{name}_{operator}_size")() // 8 + 1)
    getattr(loaded, f"{name}_{operator}_init")(axis)
    step = getattr(loaded, f"{name}_{operator}_step")
    return np.array([step(axis, each) for each in x.tolist()], dtype=x.dtype)


@pytest.mark.parametrize("operator", ["inverse", "forward"])
def test_the_library_of_this_machine_has_the_bits_of_the_reference(
    operator: str, built: tuple[Path, Library]
) -> None:
    one = model("two_branches")
    x = signal(one, operator).astype(np.float32)
    found = stepped(built[0] / HOST / "two_branches.so", "two_branches", operator, "float", x)
    assert found.tobytes() == expected(one, operator, "float32", x).astype(np.float32).tobytes()
    assert len(set(found.tolist())) > 200


@pytest.mark.parametrize("operator", ["inverse", "forward"])
def test_webassembly_has_the_bits_of_the_reference(operator: str, built: tuple[Path, Library]) -> None:
    one = model("two_branches")
    store = wasmtime.Store()
    module = wasmtime.Module(store.engine, (built[0] / "wasm32" / "two_branches.wasm").read_bytes())
    exported: Any = wasmtime.Instance(store, module, []).exports(store)
    own = f"two_branches_{operator}"
    axis = (exported["__heap_base"].value(store) + 15) // 16 * 16
    size = exported[f"{own}_size"](store)
    pages = -(-(axis + size) // 65536) - exported["memory"].size(store)
    if pages > 0:
        exported["memory"].grow(store, pages)
    exported[f"{own}_init"](store, axis)
    x = signal(one, operator).astype(np.float32)
    found = np.array([exported[f"{own}_step"](store, axis, each) for each in x.tolist()], dtype=np.float32)
    assert found.tobytes() == expected(one, operator, "float32", x).astype(np.float32).tobytes()


@pytest.mark.parametrize("operator", ["inverse", "forward"])
def test_linux_on_arm_has_the_bits_of_the_reference(operator: str, built: tuple[Path, Library]) -> None:
    """The library in an emulated core, whose fused multiply-adds nothing may use: its segments, with the addresses that
    a loader would fill in."""
    core, base = unicorn.Uc(unicorn.UC_ARCH_ARM64, unicorn.UC_MODE_ARM), 0x10_0000
    core.reg_write(arm64.UC_ARM64_REG_CPACR_EL1, 3 << 20)  # floating point on
    core.mem_map(base, 0x10_0000)
    with (built[0] / "aarch64-linux" / "two_branches.so").open("rb") as file:
        elf = ELFFile(file)
        for segment in elf.iter_segments("PT_LOAD"):
            core.mem_write(base + segment["p_vaddr"], segment.data())
        symbols = elf.get_section_by_name(".dynsym")
        for section in elf.iter_sections():
            for each in section.iter_relocations() if isinstance(section, RelocationSection) else ():
                symbol = symbols.get_symbol(each["r_info_sym"])["st_value"]
                assert each["r_info_type"] in (1025, 1026, 1027)  # GLOB_DAT, JUMP_SLOT, RELATIVE
                core.mem_write(base + each["r_offset"], struct.pack("<Q", base + symbol + each["r_addend"]))
        place = {each.name: base + each["st_value"] for each in symbols.iter_symbols()}
    axis, stack, back = base + 0x8_0000, base + 0xF_0000, base + 0xF_8000

    def call(name: str) -> None:
        core.reg_write(arm64.UC_ARM64_REG_X0, axis)
        core.reg_write(arm64.UC_ARM64_REG_SP, stack)
        core.reg_write(arm64.UC_ARM64_REG_LR, back)
        core.emu_start(place[f"two_branches_{operator}_{name}"], back)

    def step(x: float) -> float:
        core.reg_write(arm64.UC_ARM64_REG_S0, struct.unpack("<I", struct.pack("<f", x))[0])
        call("step")
        return float(struct.unpack("<f", struct.pack("<I", core.reg_read(arm64.UC_ARM64_REG_S0)))[0])

    call("init")
    one = model("two_branches")
    x = signal(one, operator, 1000).astype(np.float32)
    found = np.array([step(each) for each in x.tolist()], dtype=np.float32)
    assert found.tobytes() == expected(one, operator, "float32", x).astype(np.float32).tobytes()


@pytest.mark.parametrize("operator", ["inverse", "forward"])
def test_windows_has_the_bits_of_the_reference(operator: str, built: tuple[Path, Library]) -> None:
    """The DLL in an emulated core, called as Windows calls; nothing but the DLL is there."""
    core, base = unicorn.Uc(unicorn.UC_ARCH_X86, unicorn.UC_MODE_64), 0x10_0000
    core.mem_map(base, 0x10_0000)
    data = (built[0] / "x86_64-windows" / "two_branches.dll").read_bytes()
    dll = read_dll(data)
    for address, content in dll.sections.items():
        core.mem_write(base + address, content)
    preferred = struct.unpack_from("<Q", data, struct.unpack_from("<I", data, 0x3C)[0] + 24 + 24)[0]
    for address in dll.moved:
        (pointer,) = struct.unpack("<Q", core.mem_read(base + address, 8))
        core.mem_write(base + address, struct.pack("<Q", pointer - preferred + base))
    axis, stack, back = base + 0x8_0000, base + 0xF_0000, base + 0xF_8000

    def call(name: str) -> None:
        core.reg_write(x86.UC_X86_REG_RCX, axis)
        core.reg_write(x86.UC_X86_REG_RSP, stack - 8)
        core.mem_write(stack - 8, struct.pack("<Q", back))
        core.emu_start(base + dll.exports[f"two_branches_{operator}_{name}"], back)

    def step(x: float) -> float:
        core.reg_write(x86.UC_X86_REG_XMM1, struct.unpack("<I", struct.pack("<f", x))[0])
        call("step")
        return float(struct.unpack("<f", struct.pack("<I", core.reg_read(x86.UC_X86_REG_XMM0) & 0xFFFF_FFFF))[0])

    call("init")
    one = model("two_branches")
    x = signal(one, operator, 1000).astype(np.float32)
    found = np.array([step(each) for each in x.tolist()], dtype=np.float32)
    assert found.tobytes() == expected(one, operator, "float32", x).astype(np.float32).tobytes()


@pytest.mark.parametrize(("name", "arithmetic"), [("bent", "q15"), ("curved", "q31"), ("mixed", "float64")])
def test_options_of_emit_apply(name: str, arithmetic: str, tmp_path: Path) -> None:
    one, kind = model(name), ARITHMETICS[arithmetic]
    library = build(one, tmp_path, [HOST], operator="inverse", arithmetic=arithmetic)
    assert not any("forward" in each for each in library.exports)
    x = signal(one, "inverse")
    if arithmetic in FIXED:
        lsb = header_number(library.paths[1].read_text(), f"{name.upper()}_OUTPUT_LSB")
        x = np.clip(np.rint(x / lsb), np.iinfo(kind.number).min, np.iinfo(kind.number).max)
    x = x.astype(kind.number)
    found = stepped(library.paths[0], name, "inverse", kind.c_type, x)
    assert found.tobytes() == expected(one, "inverse", arithmetic, x).astype(kind.number).tobytes()


def header_number(header: str, macro: str) -> float:
    return float(re.findall(rf"#define {macro} (\S+)", header)[0])


@pytest.mark.thorough(each_time=True)
def test_the_same_model_gives_the_same_bytes_in_any_folder(
    built: tuple[Path, Library], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """zig's cache is a new one, so that it cannot answer with what it compiled before."""
    (tmp_path / "work").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "work"))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("ZIG_LOCAL_CACHE_DIR", str(tmp_path / "cache"))
    build(model("two_branches"), tmp_path / "again", [HOST, "x86_64-windows"], operator="both")
    for target in (HOST, "x86_64-windows"):
        for path in (tmp_path / "again" / target).iterdir():
            assert path.read_bytes() == (built[0] / target / path.name).read_bytes(), path


def test_the_command_says_what_it_wrote_and_what_that_exports(run: Run, tmp_path: Path) -> None:
    (tmp_path / "plain.yaml").write_text(FILES["plain"])
    target = f"wasm32,{HOST}"
    code, out, err = run("build", tmp_path / "plain.yaml", "--target", target, "-o", tmp_path / "made")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    files = [f"wasm32/plain.{end}" for end in ("wasm", "h")] + [f"{HOST}/plain.{end}" for end in ("so", "h")]
    assert lines[:4] == [str(tmp_path / "made" / each) for each in files]
    assert "    plain_real_t plain_inverse_step(plain_inverse_t *self, plain_real_t u)" in lines
    assert "    size_t plain_inverse_size(void)" in lines
    assert "__heap_base" in lines[-1]


@pytest.mark.parametrize("words", [
    ("build", "--target", f"{HOST},sparc-solaris"), ("build", "--target", f"{HOST}, wasm64"), ("build", "--target", ""),
    ("build", "--target", "sparc-solaris", "--target", HOST),
])
def test_an_unknown_target_is_one_message(words: tuple[str, ...], run: Run, tmp_path: Path) -> None:
    (tmp_path / "plain.yaml").write_text(FILES["plain"])
    code, out, err = run(*words, tmp_path / "plain.yaml", "-o", tmp_path / "made")
    wrong = "sparc-solaris" if "sparc" in str(words) else words[-1].rpartition(",")[2].strip()
    hint = "; did you mean wasm32?" if wrong == "wasm64" else ""
    assert (code, out, err) == (2, "", f"error: target '{wrong}' is not one of {', '.join(PLATFORMS)}{hint}")
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("words", [("build", "-o", "made"), ("fmu", "-o", "made.fmu", "--operator", "inverse")])
def test_without_zig_the_message_says_how_to_install_it(
    words: tuple[str, ...], run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plain.yaml").write_text(FILES["plain"] + SAMPLED)
    monkeypatch.setattr(compilers, "find", lambda _: None)
    code, out, err = run(words[0], "plain.yaml", *words[1:])
    assert (code, out) == (2, "")
    assert re.fullmatch(r"error: zig is not installed; install it with: .*\[zig\]\S*", err)
    assert {path.name for path in tmp_path.iterdir()} == {"plain.yaml"}


@pytest.mark.parametrize("words", [("build", "-o", "made"), ("fmu", "-o", "made.fmu", "--operator", "inverse")])
def test_a_zig_without_the_target_writes_nothing(
    words: tuple[str, ...], run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An old zig knows fewer targets; here it builds the first two and refuses the third."""
    zig = compilers.find("zig")
    assert zig is not None
    monkeypatch.chdir(tmp_path)
    Path("plain.yaml").write_text(FILES["plain"] + SAMPLED)
    fake = tmp_path / "zig"
    fake.write_text(f"#!/bin/sh\ncase \"$*\" in *aarch64-linux*) echo 'unknown target' >&2; exit 1;; esac\n"
                    f"exec {' '.join(zig.command)} \"$@\"\n")  # fmt: skip
    fake.chmod(0o755)
    monkeypatch.setattr(compilers, "find", lambda _: compilers.Compiler("zig", (str(fake),)))
    code, out, err = run(words[0], "plain.yaml", *words[1:])
    assert (code, out) == (2, "")
    assert err == "error: zig failed:\nunknown target"
    assert {path.name for path in tmp_path.iterdir()} == {"plain.yaml", "zig"}


def test_a_model_without_an_inverse_builds_none(run: Run, tmp_path: Path) -> None:
    (tmp_path / "flat.yaml").write_text(
        "hystgen: 1\nname: flat\ninput_range: [0, 1]\nmodel: {pi: {thresholds: [0, 1], weights: [0, 1]}}\n"
    )
    code, _, err = run("build", tmp_path / "flat.yaml", "-o", tmp_path / "made")
    assert code == 1
    assert "no inverse" in err
    assert not (tmp_path / "made").exists()


# Co-simulation units


@pytest.fixture(scope="session")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Paths of units, each made once."""
    folder = tmp_path_factory.mktemp("units")

    def made(name: str, fmi: int, operator: str, arithmetic: str) -> Path:
        path = folder / f"{name}-{fmi}-{operator}-{arithmetic}.fmu"
        if not path.exists():
            one = model(name, "" if name in CHAINS else SAMPLED)
            fmu(one, path, fmi, operator=operator, arithmetic=arithmetic)
        return path

    return made


NAMES = {"inverse": ("u", "v"), "forward": ("v", "y")}


def simulated(path: Path, operator: str, x: NDArray[np.float64], more: dict[str, float] | None = None) -> Any:
    """Answers of a unit in FMPy's own loop, one per sample of `x`."""
    given, answer = NAMES[operator]
    times = np.arange(len(x)) * 1.0e-3
    table = np.array(list(zip(times, x, strict=True)), dtype=[("time", float), (given, float)])
    found = fmpy.simulate_fmu(
        str(path), input=table, output=[answer, "status"], output_interval=1.0e-3, stop_time=len(x) * 1.0e-3,
        start_values=more or {},
    )
    assert len(found) == len(x) + 1
    return found


CASES = [
    ("two_branches", 2, "inverse", "float64"), ("two_branches", 3, "forward", "float64"),
    ("listed", 3, "inverse", "float32"), ("listed", 2, "forward", "float32"),
    ("curved", 2, "inverse", "q31"), ("creeping", 3, "inverse", "float64"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "fmi", "operator", "arithmetic"), CASES)
def test_units_are_valid_and_have_the_bits_of_the_reference(
    name: str, fmi: int, operator: str, arithmetic: str, unit: Callable[..., Path]
) -> None:
    path = unit(name, fmi, operator, arithmetic)
    assert validate_fmu(str(path)) == []
    one = model(name, "" if name in CHAINS else SAMPLED)
    x = signal(one, operator, 400)
    kind = ARITHMETICS[arithmetic]
    codes, lsb = x.astype(kind.number), 1.0
    if arithmetic in FIXED:
        header = hystgen.emission.calls.emitted_files(one, operator=operator, arithmetic=arithmetic)[f"{name}.h"]
        sides = ("OUTPUT", "DRIVE") if operator == "inverse" else ("DRIVE", "OUTPUT")
        step, lsb = (header_number(header, f"{name.upper()}_{each}_LSB") for each in sides)
        codes = np.clip(np.rint(x / step), -(2**31) + 1, 2**31 - 1).astype(kind.number)
    wanted = expected(one, operator, arithmetic, codes).astype(np.float64) * lsb
    found = simulated(path, operator, x)
    assert found[NAMES[operator][1]][1:].tobytes() == wanted.tobytes()
    assert found[NAMES[operator][1]][0] == wanted[0], "the output before the first step belongs to the first input"
    assert {0} < set(found["status"].tolist()) <= {0, 1, 2, 3}, "the range was left, and not always"


def described(path: Path) -> dict[str, Any]:
    return {each.name: each for each in fmpy.read_model_description(str(path)).modelVariables}


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_description_has_units_and_the_numbers_of_the_file(fmi: int, tmp_path: Path) -> None:
    one = model("listed", SAMPLED)
    path = fmu(one, tmp_path / "listed.fmu", fmi, operator="inverse")
    variables, whole = described(path), fmpy.read_model_description(str(path))
    assert (variables["u"].causality, variables["u"].unit) == ("input", "um")
    assert (variables["v"].causality, variables["v"].unit) == ("output", "V")
    pi = one.parameters.model.pi
    for k, (threshold, weight) in enumerate(zip(pi.thresholds, pi.weights, strict=True)):
        assert float(variables[f"pi.thresholds[{k}]"].start) == threshold
        assert float(variables[f"pi.weights[{k}]"].start) == weight
        assert (variables[f"pi.thresholds[{k}]"].unit, variables[f"pi.weights[{k}]"].unit) == ("V", "um/V")
    assert float(variables["output_offset"].start) == 1.5
    assert float(whole.defaultExperiment.stepSize) == 1.0e-3
    bases = {each.name: each.baseUnit for each in whole.unitDefinitions}
    volt, micrometre, gain = bases["V"], bases["um"], bases["um/V"]
    assert (volt.kg, volt.m, volt.s, volt.A, volt.factor) == (1, 2, -3, -1, 1.0)
    assert (micrometre.m, micrometre.factor) == (1, 1e-6)
    assert (gain.kg, gain.m, gain.s, gain.A, gain.factor) == (-1, -1, 3, 1, 1e-6)


def test_parameters_of_effects_have_the_units_of_their_keys(unit: Callable[..., Path]) -> None:
    variables = described(unit("creeping", 3, "inverse", "float64"))
    assert variables["effects[0].time_constants[2]"].unit == "s"
    assert float(variables["effects[0].time_constants[2]"].start) == 300.0
    assert float(variables["effects[0].weights[1]"].start) == 0.03


@pytest.mark.parametrize(("unit_text", "exponents", "factor"), [
    ("nm", {"m": 1}, Fraction(1, 10**9)), ("kV", {"kg": 1, "m": 2, "s": -3, "A": -1}, Fraction(1000)),
    ("mrad", {"rad": 1}, Fraction(1, 1000)), ("mN", {"kg": 1, "m": 1, "s": -2}, Fraction(1, 1000)),
    ("1/K", {"K": -1}, Fraction(1)), ("K s/V^2", {"K": 1, "kg": -2, "m": -4, "s": 7, "A": 2}, Fraction(1)),
    ("%", {}, Fraction(1, 100)),
])  # fmt: skip
def test_units_in_base_units(unit_text: str, exponents: dict[str, int], factor: Fraction) -> None:
    found = quantities.si(unit_text)
    assert found is not None
    assert (found.exponents, found.factor) == (exponents, factor)


@pytest.mark.parametrize("text", ["counts", "furlong", "um/", "/V", "V^x", ""])
def test_unknown_units_have_no_base_units(text: str) -> None:
    assert quantities.si(text) is None


def test_a_temperature_is_counted_from_zero_kelvin() -> None:
    found = quantities.si("degC")
    assert found is not None
    assert (found.exponents, found.offset) == ({"K": 1}, Fraction("273.15"))


@pytest.mark.parametrize("name", ["fmu", "Input"])
def test_a_model_may_be_called_like_the_parts_of_a_binary(name: str, tmp_path: Path) -> None:
    one = Model(parse_parameters(FILES["plain"].replace("name: plain", f"name: {name}") + SAMPLED, "plain.yaml"))
    path = fmu(one, tmp_path / "named.fmu", 2 + len(name) % 2, operator="forward", arithmetic="float64")
    assert validate_fmu(str(path)) == []
    x = signal(one, "forward", 20)
    wanted = expected(one, "forward", "float64", x)
    assert simulated(path, "forward", x)["y"][1:].tolist() == wanted.tolist()
    library = build(one, tmp_path, [HOST], operator="forward", arithmetic="float64").paths[0]
    assert stepped(library, name, "forward", "double", x).tolist() == wanted.tolist()


@pytest.mark.thorough(each_time=True)
def test_many_plays_fit_every_stack(tmp_path: Path) -> None:
    """An instance of 4096 plays takes 66 kB; Windows cannot link functions with more than a page of locals here."""
    text = FILES["density"].replace("n: 40", "n: 4096") + SAMPLED
    path = fmu(Model(parse_parameters(text, "density.yaml")), tmp_path / "large.fmu", operator="forward")
    assert len(described(path)) > 8192
    assert len(simulated(path, "forward", np.linspace(0.0, 10.0, 5))) == 6


def test_units_with_odd_texts_are_valid(tmp_path: Path) -> None:
    """Whatever stands in the file must not break the XML."""
    text = FILES["plain"].replace("input: V, output: um", "input: '<\"counts\"&>', output: '\u00b5m'") + SAMPLED
    path = fmu(
        Model(parse_parameters(text + "description: 'a <b> & \"c\"'\n", "plain.yaml")), tmp_path / "odd.fmu",
        operator="forward",
    )
    assert validate_fmu(str(path)) == []
    assert described(path)["v"].unit == '<"counts"&>'
    assert fmpy.read_model_description(str(path)).description == 'a <b> & "c"'


PLACES = {
    2: {"linux64": "so", "win64": "dll", "aarch64-linux": "so", "darwin64": "dylib"},
    3: {
        "x86_64-linux": "so", "x86_64-windows": "dll", "aarch64-linux": "so", "x86_64-darwin": "dylib",
        "aarch64-darwin": "dylib",
    },
}  # fmt: skip


def functions(version: int) -> set[str]:
    """Functions that a co-simulation unit has to export, from the declarations of the standard's own header: in FMI 3.0
    all of them, in FMI 2.0 all but those of model exchange."""
    header = (Path(fmpy.__file__).parent / "c-code" / f"fmi{version}Functions.h").read_text()
    if version == 2:
        common_to_both, _, others = header.rpartition("Functions for FMI2 for Model Exchange")
        header = common_to_both + others.partition("Functions for FMI2 for Co-Simulation")[2]
    found = set(re.findall(rf"^\s*FMI{version}_Export \w+\s+(fmi{version}\w+);", header, re.MULTILINE))
    assert len(found) > 30
    return found


@pytest.mark.parametrize("fmi", [2, 3])
def test_units_hold_all_platforms_and_export_the_interface_alone(
    fmi: int, unit: Callable[..., Path], tmp_path: Path
) -> None:
    name, _, operator, arithmetic = next(case for case in CASES if case[1] == fmi)
    with zipfile.ZipFile(unit(name, fmi, operator, arithmetic)) as whole:
        whole.extractall(tmp_path)
        assert {each.date_time for each in whole.infolist()} == {(1980, 1, 1, 0, 0, 0)}
    files = {path.relative_to(tmp_path).as_posix(): path for path in tmp_path.rglob("*") if path.is_file()}
    binaries = {f"binaries/{place}/{name}.{ending}" for place, ending in PLACES[fmi].items()}
    assert files.keys() == {"modelDescription.xml", *binaries}
    public = functions(fmi)
    for place, machine in (("linux64" if fmi == 2 else "x86_64-linux", "EM_X86_64"), ("aarch64-linux", "EM_AARCH64")):
        assert names_of_elf(files[f"binaries/{place}/{name}.so"]) == (machine, public, {"calloc", "free"})
    assert names_of_pe(files[f"binaries/{'win64' if fmi == 2 else 'x86_64-windows'}/{name}.dll"].read_bytes()) == public
    dylibs = [files[each].read_bytes() for each in sorted(files) if each.endswith(".dylib")]
    if fmi == 2:
        (both,) = dylibs
        assert struct.unpack_from(">II", both) == (0xCAFE_BABE, 2)
        parts = [struct.unpack_from(">IIIII", both, 8 + 20 * k) for k in range(2)]
        assert all(place % 2**power == 0 for _, _, place, _, power in parts)
        dylibs = [both[place : place + size] for _, _, place, size, _ in parts]
        assert [each[0] for each in parts] == [struct.unpack_from("<I", each, 4)[0] for each in dylibs]
    assert len({struct.unpack_from("<I", each, 4) for each in dylibs}) == 2
    for each in dylibs:
        assert names_of_macho(each)[0] == public | LINKED


def test_a_unit_has_the_same_bytes_again(unit: Callable[..., Path], tmp_path: Path) -> None:
    name, fmi, operator, arithmetic = CASES[2]
    again = fmu(model(name, SAMPLED), tmp_path / "again.fmu", fmi, operator=operator, arithmetic=arithmetic)
    assert again.read_bytes() == unit(name, fmi, operator, arithmetic).read_bytes()


@pytest.fixture
def instance(unit: Callable[..., Path], tmp_path: Path) -> Iterator[Callable[[int, str], Any]]:
    """Instances of the inverse of `listed` or `two_branches`, not yet initialized; freed afterwards."""
    made: list[Any] = []

    def instantiate(fmi: int, label: str, **how: Any) -> Any:
        name, _, operator, arithmetic = CASES[0 if fmi == 2 else 2]
        path = unit(name, fmi, operator, arithmetic)
        folder = tmp_path / f"unpacked-{fmi}"
        if not folder.exists():
            fmpy.extract(str(path), str(folder))
        about = fmpy.read_model_description(str(path))
        kind = FMU2Slave if fmi == 2 else FMU3Slave
        token = about.guid if fmi == 2 else about.instantiationToken
        one = kind(guid=token, unzipDirectory=str(folder), modelIdentifier=name, instanceName=label)
        one.instantiate(**how)
        made.append(one)
        return one

    yield instantiate
    for each in made:
        each.freeInstance()


def initialized(one: Any, fmi: int) -> Any:
    if fmi == 2:
        one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.exitInitializationMode()
    return one


def get(one: Any, fmi: int) -> float:
    return float((one.getReal if fmi == 2 else one.getFloat64)([2])[0])


def step(one: Any, fmi: int, k: int, x: float, seconds: float = 1.0e-3) -> float:
    (one.setReal if fmi == 2 else one.setFloat64)([1], [x])
    one.doStep(currentCommunicationPoint=k * 1.0e-3, communicationStepSize=seconds)
    return get(one, fmi)


def case(fmi: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """References for `instance`, and the reference's drives."""
    name, _, operator, arithmetic = CASES[0 if fmi == 2 else 2]
    one = model(name, SAMPLED)
    x = signal(one, operator, 60)
    return x, expected(one, operator, arithmetic, x.astype(ARITHMETICS[arithmetic].number)).astype(np.float64)


@pytest.mark.parametrize("fmi", [2, 3])
def test_instances_are_independent(fmi: int, instance: Callable[..., Any]) -> None:
    """One runs a few samples behind the other, the third backwards."""
    x, wanted = case(fmi)
    first, second, third = (initialized(instance(fmi, label), fmi) for label in ("a", "b", "c"))
    found: dict[str, list[float]] = {"first": [], "second": []}
    for k in range(len(x)):
        found["first"].append(step(first, fmi, k, x[k]))
        step(third, fmi, k, x[-1 - k])
        if k >= 7:
            found["second"].append(step(second, fmi, k - 7, x[k - 7]))
    assert found == {"first": wanted.tolist(), "second": wanted[:-7].tolist()}


@pytest.mark.parametrize("fmi", [2, 3])
def test_reset_and_states_go_back(fmi: int, instance: Callable[..., Any]) -> None:
    x, wanted = case(fmi)
    one = initialized(instance(fmi, "a"), fmi)
    for k in range(20):
        step(one, fmi, k, x[k])
    saved = one.getFMUState() if fmi == 3 else one.getFMUstate()
    as_bytes = one.serializeFMUState(saved) if fmi == 3 else one.serializeFMUstate(saved)
    assert [step(one, fmi, k, x[k]) for k in range(20, 40)] == wanted[20:40].tolist()
    (one.setFMUState if fmi == 3 else one.setFMUstate)(saved)
    assert [step(one, fmi, k, x[k]) for k in range(20, 40)] == wanted[20:40].tolist()
    (one.freeFMUState if fmi == 3 else one.freeFMUstate)(saved)

    other = initialized(instance(fmi, "b"), fmi)
    read = other.deserializeFMUState(as_bytes) if fmi == 3 else other.deSerializeFMUstate(as_bytes)
    (other.setFMUState if fmi == 3 else other.setFMUstate)(read)
    (other.freeFMUState if fmi == 3 else other.freeFMUstate)(read)
    assert [step(other, fmi, k, x[k]) for k in range(20, 40)] == wanted[20:40].tolist()

    one.reset()
    initialized(one, fmi)
    assert [step(one, fmi, k, x[k]) for k in range(20)] == wanted[:20].tolist()


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("seconds", [2.0e-3, 5.0e-4, 0.0, -1.0e-3, 1.001e-3, float("nan")])
def test_another_step_size_is_an_error_and_moves_nothing(
    fmi: int, seconds: float, instance: Callable[..., Any]
) -> None:
    x, wanted = case(fmi)
    one = initialized(instance(fmi, "a"), fmi)
    step(one, fmi, 0, x[0])
    with pytest.raises(Exception, match="DoStep failed"):
        step(one, fmi, 1, x[1], seconds)
    assert get(one, fmi) == wanted[0]
    assert step(one, fmi, 1, x[1], 1.0e-3 * (1.0 + 1.0e-9)) == wanted[1], "as a difference of two times rounds"


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("x", [1.0e300, -1.0e300, 1.0e30])
def test_values_beyond_the_range_are_clamped_and_flagged(fmi: int, x: float, instance: Callable[..., Any]) -> None:
    one = initialized(instance(fmi, "a"), fmi)
    low, high = model(CASES[0 if fmi == 2 else 2][0]).cascade.input_range
    assert step(one, fmi, 0, x) == pytest.approx(high if x > 0 else low, rel=1e-2)
    assert (one.getInteger if fmi == 2 else one.getInt32)([3])[0] & 1
    before = get(one, fmi)
    assert step(one, fmi, 1, float("nan")) == before
    assert (one.getInteger if fmi == 2 else one.getInt32)([3])[0] == 4


@pytest.mark.parametrize("fmi", [2, 3])
def test_calls_out_of_order_and_unknown_variables_are_errors(fmi: int, instance: Callable[..., Any]) -> None:
    one = instance(fmi, "a")
    with pytest.raises(Exception, match="DoStep failed"):
        step(one, fmi, 0, 1.0)
    read, write = (one.getReal, one.setReal) if fmi == 2 else (one.getFloat64, one.setFloat64)
    for wrong in (2, 16, 99999):
        with pytest.raises(Exception, match="failed"):
            write([wrong], [1.0])
    for wrong in (15, 99999):
        with pytest.raises(Exception, match="failed"):
            read([wrong])
    with pytest.raises(Exception, match="failed"):
        one.exitInitializationMode()


def test_a_unit_says_through_the_logger_which_step_it_wants(unit: Callable[..., Path]) -> None:
    name, fmi, operator, arithmetic = CASES[2]
    said: list[str] = []
    with pytest.raises(Exception, match="DoStep failed"):
        fmpy.simulate_fmu(
            str(unit(name, fmi, operator, arithmetic)), output_interval=2.0e-3, stop_time=0.1,
            logger=lambda *words: said.append(words[-1].decode()),
        )
    assert said == [f"doStep: the step of {name} is its sample time, 0.001 s; set the communication step size to it"]


def test_a_temperature_is_an_input_where_an_effect_takes_one(tmp_path: Path) -> None:
    """A unit at another temperature has the bits of the C library at that temperature."""
    one = model("warm")
    path = fmu(one, tmp_path / "warm.fmu", 2, operator="forward", arithmetic="float64")
    assert validate_fmu(str(path)) == []
    variables = described(path)
    assert (variables["temperature"].causality, variables["temperature"].unit) == ("input", "degC")
    library = build(one, tmp_path, [HOST], operator="forward", arithmetic="float64").paths[0]
    loaded = ctypes.CDLL(str(library))
    loaded.warm_forward_step.restype = ctypes.c_double
    axis = ctypes.create_string_buffer(loaded.warm_forward_size() + 8)
    loaded.warm_forward_init(axis)
    x = signal(one, "forward", 100)
    plain = [loaded.warm_forward_step(axis, ctypes.c_double(each)) for each in x]
    assert simulated(path, "forward", x)["y"][1:].tolist() == plain
    loaded.warm_forward_init(axis)
    loaded.warm_forward_set_temperature(axis, ctypes.c_double(33.5))
    warm = [loaded.warm_forward_step(axis, ctypes.c_double(each)) for each in x]
    assert warm != plain
    assert simulated(path, "forward", x, {"temperature": 33.5})["y"][1:].tolist() == warm


@pytest.mark.parametrize(("text", "words", "message"), [
    (FILES["plain"], ["--operator", "inverse"],
     "plain.yaml:1:1: error: sample_time: missing, and a co-simulation unit needs it as its step size; add "
     "`sample_time: SECONDS`, in s"),
    ("recorded_at: 5.0e-3\n" + FILES["plain"], ["--operator", "inverse"],
     "plain.yaml:1:1: error: sample_time: missing, and a co-simulation unit needs it as its step size; add "
     "`sample_time: 0.005` (recorded at 5 ms), in s"),
    (FILES["plain"] + SAMPLED, ["--operator", "inverse", "-o", "plain"],
     "error: output plain does not end in .fmu, by which importers know a unit; write plain.fmu"),
    (FILES["plain"] + SAMPLED, ["--operator", "both"],
     "error: a co-simulation unit has one operator; give --operator inverse or --operator forward"),
])  # fmt: skip
def test_what_a_unit_cannot_be_is_one_message(
    text: str, words: list[str], message: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plain.yaml").write_text(text)
    assert run("fmu", "plain.yaml", "-o", "plain.fmu", *words) == (2, "", message)
    assert {path.name for path in tmp_path.iterdir()} == {"plain.yaml"}


def test_the_command_writes_the_unit(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plain.yaml").write_text(FILES["plain"] + SAMPLED)
    assert run("fmu", "plain.yaml", "-o", "plain.fmu", "--fmi", "3") == (0, "plain.fmu\n", "")
    assert validate_fmu("plain.fmu") == []
    code, _, err = run("fmu", "plain.yaml", "-o", "plain.yaml")
    assert code == 2
    assert "would be overwritten" in err
    code, _, err = run("fmu", "plain.yaml", "-o", "nowhere/plain.fmu")
    assert code == 2
    assert "nowhere does not exist" in err
    assert run("fmu", "plain.yaml", "-o", "x.fmu", "--fmi", "1")[0] == 2


# MATLAB and Octave


def test_the_gateway_for_octave_has_the_bits_of_the_reference(run: Run, tmp_path: Path) -> None:
    """examples/mex: its script compares two instances with each other; its drives are compared here."""
    if shutil.which("mkoctfile") is None:  # CI does not install it: two minutes for one example, run by hand instead
        pytest.skip("Debian's octave-dev is not installed; examples/mex/README.md says what was run by hand")
    folder = tmp_path / "mex"
    shutil.copytree(Path(__file__).parents[1] / "examples" / "mex", folder)
    assert run("emit", folder / "stage_x.yaml", "-o", folder)[0] == 0
    flags = {**os.environ, "CFLAGS": "-O2 -Wall -Wextra -Werror"}
    done = subprocess.run(
        ["octave", "--no-gui", "--quiet", "run_stage_x.m"], cwd=folder, env=flags, capture_output=True, text=True,
        check=True,
    )
    assert "0 drives differ" in done.stdout
    assert "status after a reference out of range: 1" in done.stdout
    u, v = np.fromfile(folder / "drives.bin").reshape(2, -1)
    wanted = hystgen.load(folder / "stage_x.yaml").inverse().simulate(u, arithmetic="float64")
    assert v.tobytes() == np.asarray(wanted).tobytes()


def test_the_message_of_a_failed_compiler_has_exit_code_2() -> None:
    def fails() -> None:
        raise compilers.CompileError("zig failed:\nno space left")

    with pytest.raises(common.Failed) as found:
        common.compiled("plain.yaml", fails)
    assert (found.value.exit_code, found.value.message) == (2, "error: zig failed:\nno space left")
