"""Packages of `emit --integration`: each is built, or validated, with the tool that it is for."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import platformio_native
import pytest
from ruamel.yaml import YAML

import hystgen
from hystgen.emission.options import INTEGRATIONS, LAYOUTS, read_banner

STAGE = """\
hystgen: 1
name: stage_x
units: {input: V, output: um}
input_range: [0, 100]
model:
  pi: {thresholds: [0, 5, 15], weights: [0.72, 0.3, 0.1]}
"""
NAMES = "stage_x", "stage_y"
FILES = {
    "cmake": {"CMakeLists.txt", "cmake/NAMEConfig.cmake", "test/main.c"},
    "meson": {"meson.build", "test/main.c"},
    "conan": {
        "CMakeLists.txt", "cmake/NAMEConfig.cmake", "test/main.c", "conanfile.py", "test_package/conanfile.py",
        "test_package/CMakeLists.txt",
    },
    "platformio": {"library.json"},
    "arduino": {"library.properties", "examples/NAME_selftest/NAME_selftest.ino"},
    "zephyr": {"zephyr/module.yml", "zephyr/CMakeLists.txt", "zephyr/Kconfig"},
    "espidf": {"CMakeLists.txt", "cmake/NAMEConfig.cmake", "test/main.c", "idf_component.yml"},
}  # fmt: skip
U = (3.0, 30.0, 55.0, 20.0, 41.5, 0.0, 60.0)
"""[um] A reference with reversals, inside the reachable range."""

MAIN = """\
#include <stdio.h>
#include <stage_x.h>
#include <stage_x_selftest.h>
#include <stage_y.h>
#include <stage_y_selftest.h>

int main(void) {
    static const stage_x_real_t u[] = {SAMPLES};
    static stage_x_inverse_t x;
    static stage_y_inverse_t y;
    unsigned i;
    stage_x_inverse_init(&x);
    stage_y_inverse_init(&y);
    for (i = 0; i < sizeof u / sizeof u[0]; ++i) {
        printf("%.9g %.9g\\n", (double)stage_x_inverse_step(&x, u[i]), (double)stage_y_inverse_step(&y, u[i]));
    }
    return stage_x_selftest() + stage_y_selftest();
}
""".replace("SAMPLES", ", ".join(f"{u}f" for u in U))
"""A user's program with both models."""


def parameters(name: str) -> str:
    """The parameter file of a model; stage_y has other weights."""
    return STAGE.replace("stage_x", name).replace("0.72", "0.72" if name == "stage_x" else "0.6")


def drives() -> np.ndarray[Any, Any]:
    """The drives (N, 2) of both models by bisection on the sum of plays, which shares no code with the package."""
    columns = []
    for first in (0.72, 0.6):
        plays, column = [0.0] * 3, []
        for u in U:
            low, high = 0.0, 100.0
            for _ in range(60):
                v = (low + high) / 2
                moved = [min(max(s, v - r), v + r) for s, r in zip(plays, (0, 5, 15), strict=True)]
                low, high = (v, high) if first * moved[0] + 0.3 * moved[1] + 0.1 * moved[2] < u else (low, v)
            plays = moved
            column.append(v)
        columns.append(column)
    return np.array(columns).T


def check_output(printed: str) -> None:
    """Check the drives that `MAIN` printed."""
    rows = [line.split() for line in printed.splitlines() if re.fullmatch(r"[-\d.e]+ [-\d.e]+", line)]
    # single precision: 8 units in the last place of 100 V
    np.testing.assert_allclose(np.array(rows, float), drives(), rtol=0, atol=8 * np.spacing(np.float32(100)))


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two parameter files."""
    folder = tmp_path_factory.mktemp("models")
    for name in NAMES:
        (folder / f"{name}.yaml").write_text(parameters(name))
    return [folder / f"{name}.yaml" for name in NAMES]


@pytest.fixture(scope="module", params=LAYOUTS)
def emitted(request: pytest.FixtureRequest, models: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the packages of both models for all tools, in each layout."""
    folder = tmp_path_factory.mktemp("packages")
    hystgen.emit(models, folder, layout=request.param, integration=INTEGRATIONS)
    return folder


shared = pytest.mark.parametrize("emitted", ["shared-runtime"], indirect=True)
"""The layout with most packages, alone."""
two_layouts = pytest.mark.parametrize("emitted", ["shared-runtime", "single-header"], indirect=True)
"""The layouts whose sources are not those of the model alone."""


def packages(folder: Path) -> list[Path]:
    """The packages in a folder, those that others need first."""
    return sorted(path for path in folder.iterdir() if path.is_dir())


def tool(name: str) -> str:
    """The path of a program, of this environment or of the system. Without it the test is skipped, or fails in CI."""
    found = shutil.which(name, path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    if found is None:
        if os.environ.get("CI"):
            pytest.fail(f"CI installs {name}, but it is not there")
        pytest.skip(f"there is no {name}")
    return found


def done(command: Sequence[object], folder: Path, code: int = 0, **variables: object) -> str:
    """Run a program of this environment. Returns what it prints on both streams, and checks its exit code."""
    environment = {**os.environ, **{name: str(value) for name, value in variables.items()}}
    environment["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    words = [tool(str(command[0])), *map(str, command[1:])]
    run = subprocess.run(
        words, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    assert run.returncode == code, f"{' '.join(words)}\n{run.stdout}"
    return run.stdout


def fault(source: Path) -> None:
    """Change one expected answer of a self-test by hand."""
    text = source.read_text()
    number = re.search(r"\{'s', [\d.]+f, ([\d.]+)f,", text)
    assert number
    source.write_text(text[: number.start(1)] + "1.25" + text[number.end(1) :])


# What is written -------------------------------------------------------------------------------------------


def test_files_are_ascii_with_banner_and_do_not_depend_on_the_other_tools(
    emitted: Path, models: list[Path], tmp_path: Path
) -> None:
    layout = next(word for word in LAYOUTS if f"--layout {word}" in (emitted / "stage_x.h").read_text())
    whole = {path.relative_to(emitted).as_posix(): path.read_bytes() for path in emitted.rglob("*") if path.is_file()}
    for path, data in whole.items():
        text = data.decode("ascii")
        assert "\r" not in text
        assert text.endswith("\n")
        assert not text.endswith("\n\n")
        banner = read_banner(text)
        assert banner is not None, path
        assert not banner.edited, path
        assert banner.model == ("" if "hystgen_runtime" in path else path[:7])
    plain = {path: data for path, data in whole.items() if "/" not in path}
    assert plain == {path.name: path.read_bytes() for path in hystgen.emit(models, tmp_path / "plain", layout=layout)}
    for name, files in FILES.items():
        folder = tmp_path / name
        hystgen.emit(models, folder, layout=layout, integration=[name])
        made = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        assert made.items() <= whole.items()
        for model in NAMES:
            wanted = {file.replace("NAME", model) for file in files}
            own = {path.removeprefix(f"{model}/") for path in made if path.startswith(f"{model}/")}
            assert {path for path in own if not path.startswith("src/")} == wanted
            assert {f"src/{path}" for path in plain if path.startswith(model)} <= own
            for path in own & {f"src/{file}" for file in plain}:
                assert made[f"{model}/{path}"] == plain[path.removeprefix("src/")]


@pytest.mark.parametrize("words", ["cmake,mesom", "", "cmake,,meson", "CMake", "cmake meson"])
def test_an_unknown_tool_gets_one_message_and_nothing_is_written(
    words: str, models: list[Path], run: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    code, out, said = run("emit", *models, "-o", tmp_path / "fw", "--integration", words)
    assert (code, out, len(said.splitlines())) == (2, "", 1), said
    close = {"cmake,mesom": "meson", "CMake": "cmake", "cmake meson": "cmake or meson"}.get(words)
    hint = f"; did you mean {close}?" if close else ""
    assert said.endswith(f"is not one of {', '.join(INTEGRATIONS)}{hint}")
    assert not (tmp_path / "fw").exists()
    with pytest.raises(ValueError, match=r"integration 'mesom' is not one of cmake, meson, "):
        hystgen.emit(models, tmp_path / "fw", integration=("cmake", "mesom"))
    with pytest.raises(TypeError, match=r"integration must be a list of names, not 'cmake'; give \['cmake'\]"):
        hystgen.emit(models, tmp_path / "fw", integration="cmake")
    assert not (tmp_path / "fw").exists()


@pytest.mark.parametrize(
    ("name", "tools"), [("test", "meson"), ("Install", "meson"), ("m", "cmake"), ("x", "cmake,conan")]
)
def test_names_that_tools_use_themselves_are_refused(
    name: str, tools: str, run: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    path = tmp_path / "one.yaml"
    path.write_text(STAGE.replace("stage_x", name))
    code, _, said = run("emit", path, "-o", tmp_path / "fw", "--integration", tools)
    assert (code, len(said.splitlines())) == (2, 1)
    assert f"no --integration for a model called {name}: " in said
    assert not (tmp_path / "fw").exists()
    assert run("emit", path, "-o", tmp_path / "fw")[0] == 0


def test_a_name_of_one_letter_is_refused_only_by_a_tool_that_refuses_it(
    run: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    path = tmp_path / "one.yaml"
    path.write_text(STAGE.replace("stage_x", "x"))
    tools = ",".join(tool for tool in INTEGRATIONS if tool != "conan")
    code, _, said = run("emit", path, "-o", tmp_path / "fw", "--integration", tools)
    assert code == 0, said


def test_files_of_another_origin_are_not_replaced(
    models: list[Path], run: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    command = ("emit", *models, "-o", tmp_path / "fw", "--integration", "cmake")
    (tmp_path / "fw" / "stage_y").mkdir(parents=True)
    (tmp_path / "fw" / "stage_y" / "CMakeLists.txt").write_text("project(mine)\n")
    code, _, said = run(*command)
    assert (code, len(said.splitlines())) == (2, 1)
    assert "stage_y/CMakeLists.txt: exists, and hystgen did not write it" in said
    assert [path.name for path in (tmp_path / "fw").rglob("*")] == ["stage_y", "CMakeLists.txt"]
    shutil.rmtree(tmp_path / "fw" / "stage_y")
    (tmp_path / "fw" / "stage_y").write_text("a program\n")
    code, _, said = run(*command)
    assert (code, len(said.splitlines())) == (2, 1)
    assert "fw/stage_y: Not a directory" in said
    assert [path.name for path in (tmp_path / "fw").rglob("*")] == ["stage_y"]


@shared
def test_list_outputs_check_and_orphans_cover_packages(
    emitted: Path, models: list[Path], run: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    folder = tmp_path / "fw"
    shutil.copytree(emitted, folder)
    tools = ("--layout", "shared-runtime", "--integration", ",".join(INTEGRATIONS))
    everything = sorted(str(path) for path in folder.rglob("*") if path.is_file())
    assert sorted(run("emit", *models, "-o", folder, *tools, "--list-outputs")[1].splitlines()) == everything
    assert run("emit", *models, "-o", folder, *tools, "--check")[0] == 0
    inside = {path: path.read_bytes() for path in map(Path, everything) if path.parent != folder}
    for change, words in (
        (lambda good: good.replace(b"hystgen", b"hystGen"),
         "has no complete hystgen banner: something else wrote it, or the banner was edited"),
        (lambda good: good + b"\n", "was edited by hand"),
        (lambda good: good.replace(b"\n", b"\r\n"), "has line endings other than LF"),
        (None, "is missing"),
    ):
        for path, good in inside.items():
            path.unlink() if change is None else path.write_bytes(change(good))
        found = hystgen.differences(models, folder, layout="shared-runtime", integration=INTEGRATIONS)
        assert sorted(found) == sorted(f"{path} {words}" for path in inside)
        for path, good in inside.items():
            path.write_bytes(good)
    # Other parameters: every file of that model, in the C and in the package
    changed = tmp_path / "stage_x.yaml"
    changed.write_text(parameters("stage_x").replace("0.3", "0.31"))
    code, _, said = run("emit", changed, models[1], "-o", folder, *tools, "--check")
    errors = [line for line in said.splitlines() if line.startswith("error: ")]
    assert code == 1
    assert errors == [
        f"error: {path} was generated from other parameters"
        for path in re.findall(r"error: (\S+)", said) if "stage_x" in path.removeprefix(str(folder))
    ]
    assert len(errors) == sum("stage_x" in path.removeprefix(str(folder)) for path in everything)
    (advice,) = (line for line in said.splitlines() if not line.startswith("error: "))
    assert advice == f"to write them again: hystgen emit {changed} -o {folder} {' '.join(tools)}"
    # A model that is gone, and a tool that is no longer asked for
    code, _, said = run("emit", models[0], "-o", folder, *tools, "--check")
    gone = [path for path in everything if "stage_y" in path.removeprefix(str(folder))]
    assert code == 1
    assert sorted(re.findall(r"error: (\S+) belongs to model stage_y, which is not in any", said)) == gone
    fewer = (*tools[:-1], "cmake")
    code, _, said = run("emit", *models, "-o", folder, *fewer, "--check")
    assert code == 1
    left = f"error: {folder}/stage_x/meson.build belongs to model stage_x but is not written with these options"
    assert f"{left} (add --integration meson)\n" in said
    assert f"{folder}/stage_x/CMakeLists.txt" not in said
    (deletes,) = re.findall(r"^to delete what no model writes: rm (.*)$", said, re.MULTILINE)
    for path in deletes.split():
        Path(path).unlink()
    assert run("emit", *models, "-o", folder, *fewer, "--check")[0] == 0


def test_advice_for_packages_made_with_other_options(
    models: list[Path], run: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    """Every command that `--check` names does what it says."""
    where = ("-o", tmp_path, "--integration", "cmake,platformio")
    run("emit", models[0], *where, "--operator", "both")
    code, _, said = run("emit", models[0], *where, "--check")
    assert code == 1
    assert "was generated with --operator both, not with --operator inverse" in said
    own, asked = (re.search(rf"{words}: hystgen (emit .*)", said) for words in ("they are up to date", "replace them"))
    assert own
    assert asked
    assert run(*own[1].split())[0] == 0
    assert run(*asked[1].split())[0] == 0
    assert run("emit", models[0], *where, "--check")[0] == 0


def test_nothing_of_it_is_imported_unless_asked(models: list[Path]) -> None:
    code = f"import sys, hystgen.emission.calls as c; c.emitted_files({str(models[0])!r}); print(*sys.modules)"
    assert "hystgen.emission.integration" not in done([sys.executable, "-c", code], models[0].parent).split()


# CMake -----------------------------------------------------------------------------------------------------

USER_CMAKE = """\
cmake_minimum_required(VERSION 3.16)
project(firmware LANGUAGES C)
%s
add_executable(firmware main.c)
target_link_libraries(firmware PRIVATE stage_x::stage_x stage_y::stage_y)
"""
CMAKE = ("cmake", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release")


def user_of_cmake(folder: Path, lines: str, *options: object) -> None:
    """Build and run a user's project."""
    folder.mkdir()
    (folder / "main.c").write_text(MAIN)
    (folder / "CMakeLists.txt").write_text(USER_CMAKE % lines)
    done([*CMAKE, "-S", ".", "-B", "build", *options], folder)
    done(["cmake", "--build", "build"], folder)
    check_output(done([folder / "build" / "firmware"], folder))


def test_cmake_builds_tests_installs_and_is_found(emitted: Path, tmp_path: Path) -> None:
    """By itself, as a folder of the user's project, and installed."""
    user_of_cmake(tmp_path / "inside", "\n".join(f'add_subdirectory("{emitted}/{name}" {name})' for name in NAMES))
    prefix = tmp_path / "a prefix"
    for package in packages(emitted):
        build = tmp_path / package.name
        done([*CMAKE, "-S", package, "-B", build, f"-DCMAKE_INSTALL_PREFIX={prefix}"], tmp_path)
        done(["cmake", "--build", build], tmp_path)
        if package.name in NAMES:
            done(["ctest", "--test-dir", build, "--no-tests=error"], tmp_path)
        done(["cmake", "--install", build], tmp_path)
    found = "\n".join(f"find_package({name} 0.1 CONFIG REQUIRED)" for name in NAMES)
    user_of_cmake(tmp_path / "installed", found, f"-DCMAKE_PREFIX_PATH={prefix}")


@pytest.mark.thorough(each_time=True)
@shared
def test_ctest_fails_with_a_fault_in_the_package(emitted: Path, tmp_path: Path) -> None:
    shutil.copytree(emitted, tmp_path / "fw")
    fault(tmp_path / "fw" / "stage_x" / "src" / "stage_x_selftest.c")
    done([*CMAKE, "-S", "fw/stage_x", "-B", "build"], tmp_path)
    done(["cmake", "--build", "build"], tmp_path)
    assert "stage_x_selftest (Failed)" in done(["ctest", "--test-dir", "build"], tmp_path, code=8)


# Meson -----------------------------------------------------------------------------------------------------


@two_layouts
def test_meson_builds_tests_and_installs(emitted: Path, tmp_path: Path) -> None:
    """As subprojects, which are emitted to the folder `subprojects`; installed, by pkg-config."""
    user = tmp_path / "user"
    shutil.copytree(emitted, user / "subprojects")
    (user / "main.c").write_text(MAIN)
    (user / "meson.build").write_text(
        "project('firmware', 'c')\n"
        "found = [dependency('stage_x'), dependency('stage_y', fallback: ['stage_y', 'stage_y_dep'])]\n"
        "executable('firmware', 'main.c', dependencies: found)\n"
    )
    prefix = tmp_path / "prefix"
    done(["meson", "setup", "build", f"--prefix={prefix}", "--libdir=lib"], user)
    done(["meson", "compile", "-C", "build"], user)
    tested = done(["meson", "test", "-C", "build"], user)
    assert re.search(r"^O[Kk]: +2", tested, re.MULTILINE), tested
    check_output(done([user / "build" / "firmware"], user))
    done(["meson", "install", "-C", "build"], user)
    path = prefix / "lib" / "pkgconfig"
    flags = done(["pkg-config", "--cflags", "--libs", *NAMES], tmp_path, PKG_CONFIG_PATH=path).split()
    done(["gcc", user / "main.c", *flags, "-o", "firmware"], tmp_path)
    check_output(done([tmp_path / "firmware"], tmp_path))


# Conan -----------------------------------------------------------------------------------------------------


@pytest.mark.thorough(each_time=True)
@shared
def test_conan_creates_packages_and_runs_their_tests(emitted: Path, tmp_path: Path) -> None:
    home = {"CONAN_HOME": tmp_path / "home"}
    shutil.copytree(emitted, tmp_path / "fw")
    done(["conan", "profile", "detect", "--exist-ok"], tmp_path, **home)
    for name in ("hystgen_runtime_f32", "stage_x"):
        said = done(["conan", "create", f"fw/{name}", "-nr"], tmp_path, **home)
        assert ("Running test()" in said) == (name == "stage_x"), said
    fault(tmp_path / "fw" / "stage_x" / "src" / "stage_x_selftest.c")
    assert "stage_x_selftest" in done(["conan", "create", "fw/stage_x", "-nr"], tmp_path, code=1, **home)


# PlatformIO ------------------------------------------------------------------------------------------------

@pytest.fixture
def platformio(tmp_path: Path) -> dict[str, str]:
    """Settings with which PlatformIO downloads nothing."""
    tool("pio")
    return platformio_native.settings(tmp_path / "core")


@shared
def test_platformio_finds_the_library_and_builds(
    emitted: Path, tmp_path: Path, platformio: dict[str, str]
) -> None:
    """A project for `native` whose folder `lib` is the output folder."""
    user = tmp_path / "user"
    shutil.copytree(emitted, user / "lib")
    (user / "src").mkdir()
    (user / "src" / "main.c").write_text(MAIN)
    (user / "platformio.ini").write_text("[env:native]\nplatform = native\n")
    said = done(["pio", "run", "-e", "native"], user, **platformio)
    assert "Found 3 compatible libraries" in said
    for name in NAMES:
        assert re.search(rf"-- {name} @ 0\.1\.0", said), said
    check_output(done([user / ".pio" / "build" / "native" / "program"], user))


@shared
def test_platformio_manifest_follows_its_schema(emitted: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tool("pio")
    from platformio.package.exception import ManifestValidationError
    from platformio.package.manifest.parser import ManifestParserFactory
    from platformio.package.manifest.schema import ManifestSchema

    licences = {"licenses": [{"licenseId": "0BSD"}]}  # PlatformIO would download the list
    monkeypatch.setattr(ManifestSchema, "load_spdx_licenses", staticmethod(lambda: licences))
    for package in packages(emitted):
        manifest = ManifestParserFactory.new_from_file(str(package / "library.json")).as_dict()
        assert ManifestSchema().load_manifest(manifest)["name"] == package.name
        with pytest.raises(ManifestValidationError):
            ManifestSchema().load_manifest({**manifest, "version": "first"})


# Arduino ---------------------------------------------------------------------------------------------------

HARDWARE = Path("/usr/share/arduino/hardware")


@shared
def test_arduino_builds_the_example_which_runs_on_an_avr(emitted: Path, tmp_path: Path) -> None:
    """The example of the library on an emulated board, as a user starts it."""
    example = emitted / "stage_x" / "examples" / "stage_x_selftest"
    # Debian's core for AVR does not compile with Debian's compiler, whose <float.h> hides DECIMAL_DIG in C++
    builder, simulator = tool("arduino-builder"), tool("simavr")
    (tmp_path / "build").mkdir()
    said = done([
        builder, "-compile", "-hardware", "/usr/share/arduino-builder", "-hardware", HARDWARE, "-tools", HARDWARE,
        "-libraries", emitted, "-fqbn", "arduino:avr:mega:cpu=atmega2560", "-build-path", tmp_path / "build",
        "-warnings", "all", "-verbose", "-prefs", "compiler.cpp.extra_flags=-DDECIMAL_DIG=9",
        example / "stage_x_selftest.ino",
    ], tmp_path)  # fmt: skip
    for name in ("stage_x", "hystgen_runtime_f32"):
        assert re.search(rf"Using library {name} at version 0\.1\.0", said), said
    with simulated(simulator, tmp_path / "build" / "stage_x_selftest.ino.elf") as lines:
        assert re.search(r"stage_x_selftest: 0\b", next(line for line in lines if "stage_x_selftest:" in line))
    warnings = [line for line in said.splitlines() if "warning:" in line]
    assert not [line for line in warnings if str(emitted) in line]


@contextlib.contextmanager
def simulated(simulator: str, program: Path) -> Iterator[Iterator[str]]:
    """What a program prints on the serial port of an emulated ATmega2560, for at most a minute."""
    words = ["stdbuf", "-oL", simulator, "-m", "atmega2560", "-f", "16000000", str(program)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout
        end = threading.Timer(60, process.kill)
        end.start()
        try:
            yield iter(process.stdout)
        finally:
            end.cancel()
            process.kill()


# Zephyr and ESP-IDF, which are in no registry ---------------------------------------------------------------

STAND_IN = """\
cmake_minimum_required(VERSION 3.20)
project(firmware LANGUAGES C)
add_library(zephyr_interface INTERFACE)
macro(zephyr_library_named name)
    set(ZEPHYR_CURRENT_LIBRARY ${name})
    add_library(${name} STATIC "")
    target_link_libraries(${name} PUBLIC zephyr_interface)
endmacro()
function(zephyr_library_sources)
    target_sources(${ZEPHYR_CURRENT_LIBRARY} PRIVATE ${ARGN})
endfunction()
function(zephyr_library_sources_ifdef switch)
    if(${switch})
        zephyr_library_sources(${ARGN})
    endif()
endfunction()
function(zephyr_include_directories)
    target_include_directories(zephyr_interface INTERFACE ${ARGN})
endfunction()
function(idf_component_register)
    cmake_parse_arguments(IDF "" "" "SRCS;INCLUDE_DIRS;REQUIRES" ${ARGN})
    get_filename_component(name ${CMAKE_CURRENT_SOURCE_DIR} NAME)
    add_library(${name} STATIC ${IDF_SRCS})
    target_include_directories(${name} PUBLIC ${IDF_INCLUDE_DIRS})
    target_link_libraries(${name} PUBLIC ${IDF_REQUIRES})
endfunction()
%s
add_executable(firmware main.c)
target_link_libraries(firmware PRIVATE stage_x stage_y %s)
"""
"""Those functions of Zephyr and of ESP-IDF that a package calls, as their documentation describes them."""


def user_of_stand_in(folder: Path, added: Sequence[Path], needed: Sequence[str], *options: str) -> None:
    folder.mkdir()
    (folder / "main.c").write_text(MAIN)
    lines = "\n".join(f'add_subdirectory("{path}" build_{i})' for i, path in enumerate(added))
    (folder / "CMakeLists.txt").write_text(STAND_IN % (lines, " ".join(needed)))
    done([*CMAKE, "-S", ".", "-B", "build", *options], folder)
    done(["cmake", "--build", "build"], folder)
    check_output(done([folder / "build" / "firmware"], folder))


def settings(kconfig: Path, **values: str) -> dict[str, str]:
    """The values of a package's switches, as kconfiglib resolves them."""
    import kconfiglib

    config = kconfiglib.Kconfig(str(kconfig), warn_to_stderr=False)
    for name, value in values.items():
        assert config.syms[name].set_value(value)
    assert not config.warnings
    return {name: symbol.str_value for name, symbol in config.syms.items() if name.startswith("HYSTGEN_")}


MODULE = """\
type: map
mapping:
  name: {required: true, type: str}
  build:
    required: true
    type: map
    mapping:
      cmake: {type: str}
      kconfig: {type: str}
      depends: {type: seq, sequence: [{type: str}]}
"""
"""Schema of zephyr/module.yml, from Zephyr's documentation of modules."""


@pytest.mark.thorough(each_time=True)
@two_layouts
def test_zephyr_module_is_valid_and_builds(emitted: Path, tmp_path: Path) -> None:
    tool("pykwalify")
    (tmp_path / "schema.yaml").write_text(MODULE)
    root = tmp_path / "Kconfig"
    root.write_text("".join(f'source "{package}/zephyr/Kconfig"\n' for package in packages(emitted)))
    for package in packages(emitted):
        done(["pykwalify", "-d", package / "zephyr" / "module.yml", "-s", "schema.yaml"], tmp_path)
        module = YAML(typ="safe").load((package / "zephyr" / "module.yml").read_text())
        assert module["name"] == package.name
        assert (package / module["build"]["cmake"] / "CMakeLists.txt").is_file()
        assert (package / module["build"]["kconfig"]).is_file()
        for needed in module["build"].get("depends", []):
            assert (emitted / needed / "zephyr" / "module.yml").is_file()
    (tmp_path / "bad.yml").write_text("name: stage_x\nbuild: {cmake: zephyr, kconf: zephyr/Kconfig}\n")
    done(["pykwalify", "-d", "bad.yml", "-s", "schema.yaml"], tmp_path, code=1)
    assert set(settings(root).values()) == {"n"}
    wanted = {f"HYSTGEN_{name.upper()}{end}": "y" for name in NAMES for end in ("", "_SELFTEST")}
    chosen = settings(root, **wanted)
    assert chosen == dict.fromkeys(chosen, "y"), "selecting a model selects its run time"
    added = [package / "zephyr" for package in packages(emitted)]
    others = [package.name for package in packages(emitted) if package.name not in NAMES]
    user_of_stand_in(tmp_path / "user", added, others, *(f"-DCONFIG_{name}={value}" for name, value in chosen.items()))


def test_a_bad_kconfig_is_refused(tmp_path: Path) -> None:
    """What the test of the module sees."""
    (tmp_path / "Kconfig").write_text("config HYSTGEN_A\n\tbool\n\tselekt HYSTGEN_B\n")
    with pytest.raises(Exception, match="selekt"):
        settings(tmp_path / "Kconfig")


@pytest.mark.thorough(each_time=True)
@shared
def test_espidf_component_is_valid_and_builds(emitted: Path, tmp_path: Path) -> None:
    shutil.copytree(emitted, tmp_path / "components")
    done(["compote", "manifest", "lint", "components"], tmp_path, IDF_TOOLS_PATH=tmp_path)
    names = [package.name for package in packages(emitted)]
    user_of_stand_in(tmp_path / "user", packages(tmp_path / "components"), [], "-DESP_PLATFORM=1")
    for name in names:
        done(["compote", "component", "pack", "--name", name, "--project-dir", tmp_path / "components" / name,
              "--dest-dir", tmp_path / "packed"], tmp_path, IDF_TOOLS_PATH=tmp_path)  # fmt: skip
        assert (tmp_path / "packed" / f"{name}_0.1.0.tgz").is_file()
    (tmp_path / "components" / "stage_x" / "idf_component.yml").write_text('version: "first"\n')
    done(["compote", "manifest", "lint", "components"], tmp_path, code=1, IDF_TOOLS_PATH=tmp_path)


def test_an_option_of_several_words_may_be_given_again(
    models: list[Path], run: Callable[..., tuple[int, str, str]]
) -> None:
    """Of a repeated option, the command line would otherwise silently use only the last."""
    again = ("--integration", "cmake", "--integration", " meson, zephyr")
    once = run("emit", models[0], "--list-outputs", "--integration", "cmake,meson,zephyr")
    assert run("emit", models[0], "--list-outputs", *again) == once
    assert {"meson.build", "CMakeLists.txt"} <= {Path(line).name for line in once[1].splitlines()}
