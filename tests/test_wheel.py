"""The published files: the source archive, and the wheel, which is also installed in an environment of its own."""

from __future__ import annotations

import ast
import email
import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
from modelfiles import FILES

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.emission.calls import emitted_files
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification import compilers

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

# Without variables that would let the tools find other packages
OUTSIDE = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")}
OUTSIDE["PYTHONNOUSERSITE"] = "1"


def run(*command: object, folder: Path, code: int = 0) -> subprocess.CompletedProcess[str]:
    """Run a program in `folder` and check that it exits with `code`."""
    done = subprocess.run(
        list(map(str, command)), cwd=folder, env=OUTSIDE, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, f"{command}\n{done.stdout}\n{done.stderr}"
    assert "Traceback" not in done.stderr
    return done


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Source archive and the wheel built from it in isolation, so what pyproject.toml asks for has to suffice."""
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--outdir", folder, ROOT, folder=folder)
    return folder


@pytest.fixture(scope="module")
def wheel(dist: Path) -> Path:
    """The wheel."""
    (made,) = dist.glob("*.whl")
    return made


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The interpreter of a clean environment with the wheel and what it depends on."""
    folder = tmp_path_factory.mktemp("clean")
    venv.create(folder / "env", symlinks=os.name != "nt")
    found = folder / "env" / ("Scripts" if os.name == "nt" else "bin") / "python"
    run(sys.executable, "-m", "pip", "--python", found, "install", "--quiet", "--no-compile", wheel, folder=folder)
    place = run(found, "-c", "import hystgen; print(hystgen.__file__)", folder=folder).stdout.strip()
    assert Path(place).is_relative_to(folder), "the installed package, not the checkout"
    return found


def tree(folder: Path) -> dict[str, bytes]:
    """Files below a folder by their path in it."""
    return {
        p.relative_to(folder).as_posix(): p.read_bytes()
        for p in sorted(folder.rglob("*"))
        if p.is_file() and "__pycache__" not in p.parts
    }


def test_wheel_holds_the_package_its_templates_and_its_c_and_nothing_else(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        packed = {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}
    about = f"hystgen-{PROJECT['version']}.dist-info/"
    expected = {f"hystgen/{name}": content for name, content in tree(ROOT / "hystgen").items()}
    for data in ("templates", "c_runtime"):
        files = tree(ROOT / data)
        assert files
        expected |= {f"hystgen/_data/{data}/{name}": content for name, content in files.items()}
    found = {name: content for name, content in packed.items() if not name.startswith(about)}
    assert sorted(found) == sorted(expected)
    assert [name for name in found if found[name] != expected[name]] == []
    assert "test" not in {part for name in packed for part in name.split("/")[:-1]}
    assert about + "licenses/LICENSE" in packed
    meta = email.message_from_bytes(packed[about + "METADATA"])
    assert (meta["Name"], meta["Version"]) == ("hystgen", PROJECT["version"])
    assert meta["License-Expression"] == "MIT"


def test_the_source_archive_holds_the_project_and_nothing_that_was_made(dist: Path) -> None:
    (made,) = dist.glob("*.tar.gz")
    top = f"hystgen-{PROJECT['version']}/"
    with tarfile.open(made) as archive:
        found = {member.name.removeprefix(top): member for member in archive.getmembers() if member.isfile()}
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    tracked = {name for name in listed.split("\0") if name and (ROOT / name).is_file()}
    assert found.keys() - tracked <= {"PKG-INFO"}
    assert tracked - found.keys() == set()
    assert all(member.mode & 0o111 == (ROOT / name).stat().st_mode & 0o111
               for name, member in found.items() if name != "PKG-INFO")  # fmt: skip


def test_the_index_would_take_both(dist: Path, wheel: Path) -> None:
    files = sorted(map(str, dist.iterdir()))
    assert len(files) == 2
    done = run(sys.executable, "-m", "twine", "check", "--strict", *files, folder=dist)
    assert done.stdout.count("PASSED") == 2
    assert run(Path(sys.executable).with_name("check-wheel-contents"), wheel, folder=dist).stdout.endswith("OK\n")


@pytest.mark.slow(one_in=2)
@pytest.mark.thorough(but_one_in=4)
@pytest.mark.parametrize(("name", "options"), [
    ("plain", []),
    ("listed", ["--operator", "forward", "--arithmetic", "float64", "--engine", "loop"]),
    ("two_branches", ["--operator", "both", "--arithmetic", "float64", "--layout", "single-header"]),
    ("mixed", ["--operator", "both", "--layout", "shared-runtime"]),
])  # fmt: skip
def test_installed_emit_gives_the_bytes_of_the_checkout_and_they_compile(
    name: str, options: list[str], python: Path, tmp_path: Path
) -> None:
    (tmp_path / f"{name}.yaml").write_text(FILES[name])
    program = python.with_name("hystgen")
    done = run(program, "emit", f"{name}.yaml", "-o", "firmware", *options, folder=tmp_path)
    words = iter(options)
    values = {option.removeprefix("--"): next(words) for option in words}
    expected = emitted_files(Model(parse_parameters(FILES[name])), **values)
    written = tree(tmp_path / "firmware")
    assert {file: content.decode("ascii") for file, content in written.items()} == expected
    assert done.stdout.splitlines() == [str(Path("firmware") / file) for file in expected]
    run(program, "emit", f"{name}.yaml", "-o", "firmware", *options, "--check", folder=tmp_path)

    found = compilers.available()
    if not found:
        return
    firmware = tmp_path / "firmware"
    (firmware / "main.c").write_text(f'#include "{name}_selftest.h"\nint main(void) {{ return {name}_selftest(); }}\n')
    if "single-header" in options:
        (firmware / "all.c").write_text(f'#define {name.upper()}_IMPLEMENTATION\n#include "{name}.h"\n')
    selftest = tmp_path / "selftest"
    found[0].run([*compilers.STRICT, *compilers.C_WARNINGS, "-o", selftest, *sorted(firmware.glob("*.c"))])
    run(selftest, folder=tmp_path)


def test_installed_program_says_its_version_and_schema(python: Path, tmp_path: Path) -> None:
    program = python.with_name("hystgen")
    assert run(program, "--version", folder=tmp_path).stdout.split() == ["hystgen,", "version", PROJECT["version"]]
    assert hystgen.__version__ == PROJECT["version"]
    assert json.loads(run(program, "schema", folder=tmp_path).stdout) == hystgen.schema()


def imported() -> set[str]:
    """Top-level names of everything that the package imports anywhere, at the top of a module or late."""
    names = set()
    for file in (ROOT / "hystgen").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
                names.add(node.module.split(".")[0])
    return names


def test_declared_dependencies_suffice_for_every_module(python: Path, tmp_path: Path) -> None:
    code = (
        "import importlib, pkgutil, sys, hystgen\n"
        "names = [m.name for m in pkgutil.walk_packages(hystgen.__path__, 'hystgen.')]\n"
        "names.remove('hystgen.basics.packed')  # extends numba, and is imported only where that is\n"
        "for name in names: importlib.import_module(name)\n"
        "for name in hystgen.__all__: getattr(hystgen, name)\n"
        "print(len(names), *(name for name in sys.argv[1:] if not importlib.util.find_spec(name)))"
    )
    names = imported()
    assert {"numpy", "click", "mpmath", "numba"} <= names
    count, *missing = run(python, "-c", code, *sorted(names), folder=tmp_path).stdout.split()
    assert int(count) > 20
    extras = {key: value for key, value in PROJECT["optional-dependencies"].items() if key != "dev"}
    optional = {re.split(r"[^\w-]", word)[0] for words in extras.values() for word in words}
    optional |= {"elftools"} if "pyelftools" in optional else set()  # a distribution and its package differ in name
    assert set(missing) <= optional


@pytest.mark.thorough
def test_without_extras_models_are_emitted_verified_shown_and_run(python: Path, tmp_path: Path) -> None:
    """The other tests of this environment emit and show; the bit-exact reference computes without numba."""
    (tmp_path / "mixed.yaml").write_text(FILES["mixed"])
    program = python.with_name("hystgen")
    for arithmetic in ("float32", "q15"):
        (tmp_path / "drive.csv").write_text("t,v\n0,0\n1,1\n2,-1\n")
        run(program, "simulate", "mixed.yaml", "drive.csv", "-o", f"{arithmetic}.csv", "--arithmetic", arithmetic,
            folder=tmp_path)  # fmt: skip
    code = (
        "import hystgen, importlib.util, sys; assert not importlib.util.find_spec('numba');"
        "report = hystgen.verify('mixed.yaml', arithmetic=sys.argv[1], operator='both', length=500);"
        "print(report.table());"
        "sys.exit(not report.ok)"
    )
    if compilers.available():
        for arithmetic in ARITHMETICS:
            assert "bits equal" in run(python, "-c", code, arithmetic, folder=tmp_path).stdout


@pytest.mark.parametrize("command", [
    ["identify", "plain.csv", "-o", "made.yaml"],
    ["identify", "--batch", "plain.csv", "-o", "made"],
    ["diagnose", "plain.yaml", "plain.csv", "-o", "made"],
    ["track", "plain.yaml", "plain.csv"],
    ["compare", "plain.yaml", "--holdout", "plain.csv"],
])  # fmt: skip
def test_what_needs_an_extra_names_it_and_leaves_nothing(command: list[str], python: Path, tmp_path: Path) -> None:
    (tmp_path / "plain.yaml").write_text(FILES["plain"])
    (tmp_path / "plain.csv").write_text("t,v,y\n" + "".join(f"{k},{k % 5},{k % 5}\n" for k in range(200)))
    before = tree(tmp_path)
    done = run(python.with_name("hystgen"), *command, folder=tmp_path, code=2)
    hint = r"install the extras? with: .*\[fit(,plot)?\]\S*\n"
    assert re.fullmatch(rf"error: \w+ needs scipy, numba, .*; {hint}", done.stderr)
    assert tree(tmp_path) == before


def test_plots_are_an_extra_and_its_absence_is_reported(python: Path, tmp_path: Path) -> None:
    (tmp_path / "plain.yaml").write_text(FILES["plain"])
    program = python.with_name("hystgen")
    assert "slope ratio" in run(program, "show", "plain.yaml", folder=tmp_path).stdout
    done = run(program, "show", "plain.yaml", "--plot", "plain.png", folder=tmp_path, code=2)
    assert "[plot]'" in done.stderr
    assert not (tmp_path / "plain.png").exists()
