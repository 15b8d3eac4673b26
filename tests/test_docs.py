"""The documentation: every command and code block runs, every link has a target, every page fits a phone.

Each page is a test: its blocks run from top to bottom in a folder with the examples, a recording, a held-out recording
and the model `stage_x` identified from them. The language of a fence means:

- `sh`: commands that succeed
- `console`: commands after `$`, with their exact output; `...` stands for any text
- `python`: code in one namespace per page; a comment after a print gives its output
- `c`: code that compiles against the emitted `stage_x`
- `yaml`, `text`: the file that the sentence before it names; `yaml` is all or part of a parameter file that loads, or
  a hidden file, for a CI system, which tests/test_ci.py runs
"""

from __future__ import annotations

import ast
import contextlib
import doctest
import glob
import html
import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import platformio_native
import pytest
from ruamel.yaml import YAML

import hystgen
from hystgen import verification
from hystgen.basics import jit
from hystgen.cli import main

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
README = ROOT / "README.md"
PAGES = {path.relative_to(ROOT).as_posix(): path for path in [README, *sorted(DOCS.rglob("*.md"))]}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

CALLS = 2000
"""Calls per record of `verify` here instead of the default 100000, which other tests run."""

BARE = {"docs/tutorials/two-minutes.md", "docs/tutorials/first-recording.md"}
"""Pages that create the model themselves."""

STEP = 5.0e-4
"""[s] Sample time of the shipped recordings."""

TARGET_CALLS = 100
"""Calls per record on emulated cores, if the page gives no number."""

SHORTER = {"python examples/compensate_plants.py -o docs": " --plant 'Dahl friction in a positioner'"}
"""Commands that take minutes, and the option that limits each to part of its work here."""

ELSEWHERE = {
    "python examples/raster.py -o story/": "test_examples.py::test_a_raster_through_the_compiled_c",
    "python examples/acquire -o acquired/": "test_session.py::test_from_a_plan_to_a_diagnosis_in_one_run",
    "hystgen diagnose stage_x.yaml plan/recording.csv --session plan/session.json -o diagnosis/":
        "test_session.py::test_the_command_of_the_plan_cuts_the_recording",
    "conan profile detect --exist-ok": "test_integrations.py::test_conan_creates_packages_and_runs_their_tests",
    "conan create firmware/stage_x": "test_integrations.py::test_conan_creates_packages_and_runs_their_tests",
    "arduino-cli compile --fqbn arduino:avr:mega ~/Arduino/libraries/stage_x/examples/stage_x_selftest":
        "test_integrations.py::test_arduino_builds_the_example_which_runs_on_an_avr",
    "west build -b nucleo_f446re -- -DZEPHYR_EXTRA_MODULES=$PWD/firmware/stage_x":
        "test_integrations.py::test_zephyr_module_is_valid_and_builds",
    "idf.py build": "test_integrations.py::test_espidf_component_is_valid_and_builds",
}  # fmt: skip
"""Commands that take too long here, or whose tool cannot be installed, and the tests of what they do."""


# Blocks --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Block:
    """A fenced block; `words` is the paragraph before it."""

    language: str
    text: str
    words: str
    line: int

    @property
    def saved_as(self) -> str | None:
        """File name under which the sentence before the block asks to save it, or None."""
        found = re.search(r"[Ss]ave\s+(?:this|that|it)\s+as\s+`([^`]+)`[^`]*$", self.words)
        return found[1] if found else None


def blocks(text: str) -> list[Block]:
    """The fenced blocks of a page, without directives."""
    found = []
    for match in re.finditer(r"^```(\{?[\w-]*\}?).*\n((?:.*\n)*?)```$", text, re.MULTILINE):
        if not match[1].startswith("{"):
            words = text[: match.start()].rstrip().rpartition("\n\n")[2]
            found.append(Block(match[1], match[2], words, text.count("\n", 0, match.start()) + 1))
    return found


def commands(text: str) -> list[str]:
    """The commands of a block, with continued lines joined."""
    return [line for line in re.sub(r"\\\n\s*", " ", text).splitlines() if line.strip()]


@dataclass
class Page:
    """A page being run: its folder, the names that its Python code has defined, and the last exit code."""

    folder: Path
    names: dict[str, Any]
    code: int = 0

    def run(self, block: Block) -> None:
        """Run or check one block."""
        if block.saved_as:
            (self.folder / block.saved_as).parent.mkdir(parents=True, exist_ok=True)
            (self.folder / block.saved_as).write_text(block.text)
        getattr(self, block.language)(block)

    def text(self, block: Block) -> None:
        """Check that a text is saved as a file."""
        assert block.saved_as, "a block of text that is not a file"

    def yaml(self, block: Block) -> None:
        """Load a parameter file, or the model with a part of a file merged into it."""
        part = YAML(typ="safe", pure=True).load(block.text)
        if part is None or (block.saved_as or "").startswith("."):  # comments for an editor; a CI system's file
            return
        whole = part
        if "hystgen" not in part:
            whole = merged(YAML(typ="safe", pure=True).load((self.folder / "stage_x.yaml").read_text()), part)
        with (self.folder / "page.yaml").open("w") as file:
            YAML(typ="safe", pure=True).dump(whole, file)
        hystgen.load(self.folder / "page.yaml")

    def c(self, block: Block) -> None:
        """Compile a C file next to the emitted module."""
        (self.folder / "page.c").write_text(block.text)
        flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I", "firmware", "-c", "-o", os.devnull]
        subprocess.run(["cc", *flags, "page.c"], cwd=self.folder, check=True)

    def python(self, block: Block) -> None:
        """Run code and compare its output with the comments after its prints."""
        ast.parse(block.text)
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(block.text, "page", "exec"), self.names)
        assert out.getvalue().splitlines() == re.findall(r"^ *print\(.*\)  # (.*)$", block.text, re.MULTILINE)

    def sh(self, block: Block) -> None:
        """Run commands that must succeed."""
        for command in commands(block.text):
            printed = self.command(command)
            assert self.code == 0, f"{command}\n{printed}"

    def console(self, block: Block) -> None:
        """Run commands and compare what they print."""
        for part in re.split(r"^\$ ", re.sub(r"\\\n\s*", " ", block.text), flags=re.MULTILINE)[1:]:
            command, _, shown = part.partition("\n")
            printed = str(self.code) + "\n" if command == "echo $?" else self.command(command)
            form = "".join(
                r"(?:.*\n)*" if line == "...\n" else re.escape(line).replace(r"\.\.\.", ".*")
                for line in shown.splitlines(keepends=True)
            )
            assert re.fullmatch(form, printed), f"$ {command}\n{printed}"

    def command(self, command: str) -> str:
        """Run one command. Returns what it prints on both streams, in order."""
        words = shlex.split(re.sub(r"\s+# .*", "", command))
        if " ".join(words) in ELSEWHERE:
            self.code = 0
            return ""
        command += SHORTER.get(" ".join(words), "")
        if words[0] == "hystgen":
            return self.own(command)
        if words[:2] == ["pip", "install"]:
            self.code = int(not installs(words[2:]))
            return ""
        if words[0] == "make":
            done = subprocess.run(["make", "-n", *words[1:]], cwd=ROOT, capture_output=True, check=False)
            self.code = done.returncode
            return ""
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        run = partial(subprocess.run, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        done = run(["bash", "-c", command], cwd=self.folder, env={**os.environ, "PATH": path})
        self.code = done.returncode
        return str(done.stdout)

    def own(self, command: str) -> str:
        """Run the command line in this process; unquoted patterns are expanded as in a shell."""
        arguments = []
        for word in shlex.split(re.sub(r"\s+# .*", "", command), posix=False)[1:]:
            (plain,) = shlex.split(word)
            arguments += (sorted(glob.glob(word)) if word == plain else []) or [plain]
        to = arguments.index(">") if ">" in arguments else len(arguments)
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out), pytest.raises(SystemExit) as stopped:
            main(arguments[:to], prog_name="hystgen")
        self.code = int(stopped.value.code or 0)
        printed = "".join(
            line for line in out.getvalue().splitlines(keepends=True) if line.rstrip() not in (jit.ONCE, jit.EVERY_TIME)
        )
        if to < len(arguments):
            (self.folder / arguments[to + 1]).write_text(printed)
        return printed


def merged(whole: Any, part: Any) -> Any:
    """A mapping with the entries of another merged into it."""
    if not (isinstance(whole, dict) and isinstance(part, dict)):
        return part
    return {**whole, **{key: merged(whole.get(key), value) for key, value in part.items()}}


def installs(requirements: list[str]) -> bool:
    """Whether every requirement is this project, with no extras but its own."""
    for requirement in (word for word in requirements if word != "-e"):
        found = re.fullmatch(r"(?:\.|hystgen)(?:\[([\w,]+)\])?", requirement)
        if found is None or not set((found[1] or "all").split(",")) <= PROJECT["optional-dependencies"].keys():
            return False
    return True


def bounded(verify: Any, *given: Any, target_length: int | None = None, **options: Any) -> Any:
    """Verify with records so short that compiling the reference would take longer than running it in Python."""
    with jit.plain():
        return verify(*given, length=CALLS, target_length=target_length or TARGET_CALLS, **options)


def add_droop(folder: Path) -> None:
    """Give the model a sample time, and add a recording with `user:droop`, computed from its equation alone."""
    known = folder / "stage_x.yaml"
    known.write_text(f"sample_time: {STEP}\n{known.read_text()}")
    static = hystgen.load(known)
    rng = np.random.default_rng(1)
    t = np.arange(3000) * STEP
    v = np.interp(t, np.arange(0, 1.6, 0.05), rng.uniform(0, 100, 32))
    h = static.simulate(v)
    leaked, y = 0.06 * h[0], []
    for each in h:
        leaked += (1 - np.exp(-STEP / 0.3)) * (0.06 * each - leaked)
        y.append(each - leaked + 0.002 * rng.standard_normal())
    np.savetxt(folder / "records.csv", np.column_stack([t, v, y]), delimiter=",", header="t,v,y", comments="")


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that every page starts from."""
    folder = tmp_path_factory.mktemp("pages")
    shutil.copytree(ROOT / "examples", folder / "examples", ignore=shutil.ignore_patterns("__pycache__", "out"))
    (folder / "diagnosis").mkdir()
    shutil.copy(ROOT / "examples" / "stage_recording.csv", folder / "sweep.csv")
    shutil.copy(ROOT / "examples" / "stage_holdout.csv", folder / "other.csv")
    units = {"input": "V", "output": "um"}
    fit = hystgen.identify(folder / "sweep.csv", holdout=[folder / "other.csv"], name="stage_x", units=units)
    fit.write(folder / "stage_x.yaml")
    hystgen.emit(fit, folder / "firmware")
    creep = "  effects: [{name: creep, time_constants: [0.1], weights: [0.02]}]\n"
    (folder / "diagnosis" / "params.yaml").write_text(f"sample_time: {STEP}\n{fit.text()}{creep}")
    return folder


LONG = {
    "docs/effects.md", "docs/tutorials/name-what-is-missing.md", "docs/howto/diagnose.md", "docs/howto/python.md",
    "docs/plants.md",
}  # fmt: skip
"""Pages that take as long as three others; `make test` runs similar ones instead."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.thorough(each_time=True) if name in LONG else ())
        for name, path in PAGES.items()
        if blocks(path.read_text(encoding="utf-8"))
    ],
)
def test_every_block_of_a_page_runs(name: str, start: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "page"
    shutil.copytree(start, folder)
    if name in BARE:
        (folder / "stage_x.yaml").unlink()
    if name == "docs/effects.md":
        add_droop(folder)
    if name == "docs/howto/integrations.md":
        for variable, value in platformio_native.settings(tmp_path / "platformio").items():
            monkeypatch.setenv(variable, value)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(verification, "verify", partial(bounded, verification.verify))
    page = Page(folder, {})
    for block in blocks(PAGES[name].read_text(encoding="utf-8")):
        try:
            page.run(block)
        except (AssertionError, Exception) as error:
            raise AssertionError(f"{name}:{block.line}: {error}") from error
    if name == "docs/plants.md":
        measured = (DOCS / "plants.csv").read_text(encoding="utf-8").splitlines()
        again = (folder / "docs" / "plants.csv").read_text(encoding="utf-8").splitlines()
        assert len(again) > 1
        assert set(again) <= set(measured)


def test_what_is_shortened_or_runs_elsewhere_is_on_a_page() -> None:
    shown = {command for path in PAGES.values() for block in blocks(path.read_text(encoding="utf-8"))
             if block.language == "sh" for command in commands(block.text)}  # fmt: skip
    assert {*SHORTER, *ELSEWHERE} <= shown
    for test in ELSEWHERE.values():
        file, _, function = test.partition("::")
        assert f"def {function}(" in (ROOT / "tests" / file).read_text(encoding="utf-8"), test


@pytest.mark.parametrize("name", ["identify", "diagnose", "verify"])
def test_examples_in_docstrings_run(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (example,) = doctest.DocTestFinder(recurse=False).find(getattr(hystgen, name), name)
    result = doctest.DocTestRunner().run(example)
    assert (result.failed, result.attempted > 3) == (0, True)


def test_a_wrong_block_is_noticed(start: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(start, tmp_path / "page")
    monkeypatch.chdir(tmp_path / "page")
    page = Page(tmp_path / "page", {})
    for language, text in (
        ("sh", "hystgen show nothing.yaml\n"), ("sh", "false\n"), ("sh", "pip install '.[everything]'\n"),
        ("sh", "make nothing\n"), ("console", "$ hystgen show stage_x.yaml\nstage_y: 10 plays\n...\n"),
        ("console", "$ hystgen show stage_x.yaml\n...\n$ echo $?\n1\n"), ("python", "print(1)  # 2\n"),
        ("python", "print(1)\n"), ("yaml", "emit: {arithmetic: float16}\n"), ("text", "words\n"),
        ("c", "#include \"stage_x.h\"\nint f(void) { return stage_x_step(); }\n"),
    ):  # fmt: skip
        with pytest.raises((AssertionError, ValueError, subprocess.CalledProcessError)):
            page.run(Block(language, text, "", 1))


# The site ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages as HTML, built without a warning."""
    if shutil.which("doxygen") is None:
        if os.environ.get("CI"):
            pytest.fail("CI installs doxygen, but it is not there")
        pytest.skip("there is no doxygen")
    folder = tmp_path_factory.mktemp("site")
    command = ["-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", DOCS, folder / "html"]
    offline = {**os.environ, "http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9"}
    done = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=False, env=offline)
    assert done.returncode == 0, done.stderr
    return folder / "html"


def broken(*pages: Path) -> list[str]:
    """Links from pages, or all pages in a folder, to a missing file or anchor; external links are not followed."""
    lychee = Path(sys.executable).parent / "lychee"
    command = [lychee, "--offline", "--no-progress", "--include-fragments=anchor-only", "--format", "json", *pages]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    found = json.loads(done.stdout)
    assert found["total"] > 0, done.stderr
    return sorted(f"{Path(page).name}: {link['url']}" for page, links in found["error_map"].items() for link in links)


@pytest.mark.thorough(each_time=True)
def test_links_of_the_site_lead_somewhere(site: Path) -> None:
    assert broken(site) == []
    pages = {path.relative_to(DOCS).with_suffix(".html").as_posix() for path in DOCS.rglob("*.md")}
    assert {path.relative_to(site).as_posix() for path in site.rglob("*.html")} >= pages


def test_links_of_the_pages_lead_somewhere_without_the_site() -> None:
    """Links also work if the pages are read in the repository."""
    assert broken(*ROOT.glob("*.md"), *DOCS.rglob("*.md")) == []


def test_a_broken_link_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text('<p id="here"><a href="b.html#gone">b</a><a href="c.html">c</a><a href="#here">')
    (tmp_path / "b.html").write_text('<img src="https://elsewhere/x.png">')
    (tmp_path / "d.md").write_text("# Here\n\n[a](#here) [b](#there) [c](e.md)\n")
    places = [f"a.html: {tmp_path.as_uri()}/{name}" for name in ("b.html#gone", "c.html")]
    places += [f"d.md: {tmp_path.as_uri()}/{name}" for name in ("d.md#there", "e.md")]
    assert broken(tmp_path) == places


@pytest.mark.thorough(each_time=True)
def test_no_page_loads_anything_from_elsewhere(site: Path) -> None:
    for path in site.rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        loaded = re.findall(r"<(?:script|img|iframe)\b[^>]*\ssrc=\"([^\"]*)|<link\b[^>]*\shref=\"([^\"]*)", text)
        assert [link for pair in loaded for link in pair if re.match("(?:https?:)?//", link)] == [], path.name


@pytest.mark.thorough(each_time=True)
def test_the_references_are_of_the_program(site: Path) -> None:
    """Each generated page contains some of the program's names."""
    for page, words in {
        "command-line": ("--allow-partial", "--target-length", "hystgen schema"),
        "parameter-file": ("input_range", "drive_lsb", "noise_gain", "initial_state"),
        "effects": ("rate_dependence", "time_constants", "per_decade", "gain_per_degree"),
        "c-api": ("stage_x_inverse_commit", "STAGE_X_PARAMS_SHA256", "stage_y_inverse_set_temperature",
                  "One sample: reference u in, drive out"),
        "python-api": ("identify_batch", "sample_time", "max_error"),
        "status-bits": ("NAME_STATUS_SLEW_LIMITED", "NAME_STATUS_HELD"),
        "targets": ("cortex-m33", "atmega1284p", "int16_t"),
    }.items():  # fmt: skip
        text = re.sub(r"<[^>]*>", "", (site / "reference" / f"{page}.html").read_text(encoding="utf-8"))
        assert [word for word in words if word not in text] == [], page


@pytest.mark.thorough(each_time=True)
@pytest.mark.parametrize("width", [390, 1280])
def test_pages_fit_a_phone_and_a_desk(width: int, site: Path, chromium: str, tmp_path: Path) -> None:
    """In a browser, no page is wider than its window, every picture is drawn, and the console shows no error."""
    pages = sorted(path.relative_to(DOCS).with_suffix(".html").as_posix() for path in DOCS.rglob("*.md"))
    (tmp_path / "frames.html").write_text(
        f"""<!DOCTYPE html><body><pre></pre><script>
const pages = {json.dumps([(site / page).as_uri() for page in pages])}, found = {{}};
async function look(page) {{
  const frame = document.createElement("iframe");
  frame.style = "width: {width}px; height: 800px; border: 0";
  frame.src = page;
  document.body.append(frame);
  await new Promise(done => frame.onload = done);
  const inner = frame.contentDocument, root = inner.documentElement;
  found[page] = [root.scrollWidth, [...inner.images].filter(i => i.complete && !i.naturalWidth).length];
  frame.remove();
}}
(async () => {{
  for (const page of pages) await look(page);
  document.querySelector("pre").textContent = JSON.stringify(found);
}})();
</script></body>"""
    )
    command = [
        chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
        "--allow-file-access-from-files", f"--user-data-dir={tmp_path / 'profile'}", "--enable-logging=stderr",
        "--virtual-time-budget=60000", "--dump-dom", (tmp_path / "frames.html").as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=240)
    (shown,) = re.findall(r"<pre>(\{.*?\})</pre>", done.stdout)
    found = json.loads(html.unescape(shown))
    assert len(found) == len(pages)
    assert {page: seen for page, seen in found.items() if seen[0] > width or seen[1]} == {}
    assert [line for line in done.stderr.splitlines() if "CONSOLE" in line and "Error" in line] == []


# README --------------------------------------------------------------------------------------------


def test_the_readme_is_short() -> None:
    text = README.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 90
    assert [block.language for block in blocks(text)] == ["sh", "sh", "c"]


def test_every_page_is_in_the_table_of_contents() -> None:
    listed = set(re.findall(r"^[\w/-]+$", (DOCS / "index.md").read_text(encoding="utf-8"), re.MULTILINE))
    pages = {path.relative_to(DOCS).with_suffix("").as_posix() for path in DOCS.rglob("*.md")} - {"index"}
    assert pages <= listed
