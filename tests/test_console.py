"""The command line in real surroundings: full disks, pipes, code pages, signals, read-only machines."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hystgen import model
from hystgen.basics import jit

STAGE = """hystgen: 1
name: stage
units: {input: V, output: µm}
input_range: [-1.5, 1.5]
model: {pi: {thresholds: [0, 0.2, 0.4], weights: [0.7, 0.2, 0.1]}}
"""
FULL = "error: standard output cannot be written: No space left on device; free some space or write elsewhere\n"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test works in a folder with a model and a record, whose unit contains a character few code pages have."""
    monkeypatch.chdir(tmp_path)
    Path("stage.yaml").write_text(STAGE, encoding="utf-8")
    t = np.arange(600) * 1e-3
    v = np.sin(100.0 * t) * np.linspace(0.3, 1.0, len(t))
    y = model.load("stage.yaml").simulate(v) + 1e-3 * np.cos(7.0 * np.arange(len(t)))
    rows = [f"{a!r},{b!r},{c!r}" for a, b, c in zip(t.tolist(), v.tolist(), y.tolist(), strict=True)]
    Path("record.csv").write_text("\n".join(["t,v [V],y [µm]", *rows, ""]), encoding="utf-8")


def process(*words: str, env: dict[str, str] | None = None, **how: Any) -> subprocess.CompletedProcess[bytes]:
    how = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **how}
    return subprocess.run(
        [sys.executable, "-m", "hystgen", *words], check=False, env={**os.environ, **(env or {})}, **how
    )


def said(done: subprocess.CompletedProcess[bytes]) -> str:
    """Standard error of a process without the messages on compiling that a first run prints."""
    return "".join(re.findall(r"(?m)^(?!compiling).*\n", done.stderr.decode()))


COMMANDS = (
    ("--help",),
    ("show", "--help"),
    ("--version",),
    ("schema",),
    ("show", "stage.yaml"),
    ("show", "stage.yaml", "--plot", "a.svg"),
    ("simulate", "stage.yaml", "record.csv"),
    ("emit", "stage.yaml", "-o", "firmware"),
    ("emit", "stage.yaml", "--list-outputs"),
    ("identify", "record.csv", "-o", "new.yaml"),
)


@pytest.mark.slow(one_in=3)
@pytest.mark.thorough(but_one_in=4)
@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_full_disk_behind_standard_output_is_one_message(words: Sequence[str], unbuffered: str) -> None:
    with open("/dev/full", "wb") as full:
        done = process(*words, stdout=full, env={"PYTHONUNBUFFERED": unbuffered})
    assert (done.returncode, said(done)) == (2, FULL)


@pytest.mark.thorough(but_one_in=3)
@pytest.mark.parametrize("words", [("show", "stage.yaml"), ("schema",), ("simulate", "stage.yaml", "record.csv")])
def test_a_reader_that_leaves_is_no_word(words: Sequence[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = process(*words, stdout=writing)
    os.close(writing)
    assert (done.returncode, said(done)) == (1, "")


@pytest.mark.thorough(but_one_in=3)
@pytest.mark.parametrize(
    ("words", "code"),
    [(("show", "none.yaml"), 2), (("show",), 2), (("identify", "record.csv", "-o", "new.yaml"), 0)],
)
def test_talk_that_cannot_be_written_changes_no_result(words: Sequence[str], code: int) -> None:
    with open("/dev/full", "wb") as full:
        done = process(*words, stderr=full)
    assert done.returncode == code
    assert Path("new.yaml").exists() == (code == 0)


PAGES = ("cp932", "koi8-r", "cp437", "cp1252", "ascii", "utf-8")  # two each without µ, with µ, and written as UTF-8


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("page", PAGES)
@pytest.mark.thorough
def test_any_code_page_takes_every_result(page: str) -> None:
    plain = process("show", "stage.yaml", env={"PYTHONIOENCODING": "utf-8"}).stdout.decode()
    assert "µm" in plain
    shown = process("show", "stage.yaml", env={"PYTHONIOENCODING": page})
    assert (shown.returncode, said(shown)) == (0, "")
    # click writes UTF-8 if a terminal claims to be ASCII
    expected = plain.encode("utf-8" if page == "ascii" else page, "backslashreplace")
    assert shown.stdout == expected
    done = process("identify", "record.csv", "-o", "new.yaml", "--plot", "fit.svg", env={"PYTHONIOENCODING": page})
    assert (done.returncode, said(done)) == (0, "")
    assert 'output: "µm"' in Path("new.yaml").read_text(encoding="utf-8")
    assert Path("fit.svg").exists()


@pytest.mark.thorough(but_one_in=5)
@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("page", PAGES)
def test_data_on_standard_output_are_utf_8_in_any_code_page(page: str) -> None:
    process("simulate", "stage.yaml", "record.csv", "-o", "out.csv")
    done = process("simulate", "stage.yaml", "record.csv", env={"PYTHONIOENCODING": page})
    assert done.returncode == 0
    assert done.stdout == Path("out.csv").read_bytes()


@pytest.mark.thorough
def test_files_are_utf_8_in_any_locale(tmp_path: Path) -> None:
    """Files opened without an encoding would use the locale's; Python is told to warn of that."""
    strict = {"PYTHONWARNDEFAULTENCODING": "1", "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    code = (
        "import sys, warnings\n"
        "warnings.filterwarnings('error', category=EncodingWarning, module=r'hystgen')\n"
        "from hystgen.cli import main\n"
        "main(sys.argv[1:])\n"
    )
    for words in (
        ("identify", "record.csv", "-o", "new.yaml", "--report", "report"),
        ("emit", "new.yaml", "-o", "firmware"),
        ("verify", "new.yaml", "--compiler", "gcc", "--json", "report.json"),
        ("diagnose", "--plan", "stage.yaml", "-o", "plan"),
    ):
        done = subprocess.run([sys.executable, "-c", code, *words], env={**os.environ, **strict}, capture_output=True)
        assert done.returncode == 0, done.stderr.decode()
    assert "µm" in Path("new.yaml").read_text(encoding="utf-8")
    assert "µm" in (tmp_path / "report" / "report.html").read_text(encoding="utf-8")


# Signals ---------------------------------------------------------------------------------------------------


def litter(*folders: Path) -> list[Path]:
    return [path for folder in folders for path in folder.rglob("*")]


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize(
    ("words", "sign"),
    [
        (("verify", "stage.yaml", "--compiler", "gcc"), "*.c"),
        (("identify", "--batch", "units", "-o", "params", "--jobs", "1"), "*.csv"),
        (("identify", "--batch", "units", "-o", "params", "--jobs", "2"), "*.csv"),
    ],
    ids=["verify", "alone", "workers"],
)
@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
@pytest.mark.thorough
def test_a_process_that_is_ended_leaves_nothing(words: Sequence[str], sign: str, sent: signal.Signals) -> None:
    """SIGTERM and SIGHUP clean up at once; after kill -9 only the next run can."""
    Path("units").mkdir()
    for k in range(12):
        Path(f"units/u{k}.csv").write_bytes(Path("record.csv").read_bytes())
    temporary = Path("temporary").absolute()
    temporary.mkdir()
    env = {**os.environ, "TMPDIR": str(temporary)}
    started = subprocess.Popen(
        [sys.executable, "-m", "hystgen", *words], env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    while started.poll() is None and not any(temporary.rglob(sign)):
        time.sleep(0.005)
    started.send_signal(sent)
    started.communicate(timeout=60)
    if sent != signal.SIGKILL:
        assert started.returncode == 128 + sent
    else:
        assert started.returncode == -signal.SIGKILL
        assert litter(temporary)
        deadline = time.monotonic() + 30.0
        while workers(temporary) and time.monotonic() < deadline:  # workers end when their parent is gone
            time.sleep(0.1)
        assert subprocess.run(
            [sys.executable, "-m", "hystgen", "verify", "stage.yaml", "--compiler", "gcc"], env=env, capture_output=True
        ).returncode == 0  # fmt: skip
        process(*words, env={"TMPDIR": str(temporary)})
    assert litter(temporary) == []
    assert not [path for path in Path(".").rglob(".hystgen-*") if path.exists()]


def workers(temporary: Path) -> list[str]:
    """Processes whose folder for temporary files is this one."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/environ"):
        try:
            if f"TMPDIR={temporary}".encode() in entry.read_bytes():
                found.append(entry.parent.name)
        except OSError:
            continue
    return found


def test_what_is_ignored_stays_ignored() -> None:
    """Under nohup a command outlives its terminal."""
    started = subprocess.Popen(
        [sys.executable, "-m", "hystgen", "show", "stage.yaml"], stdout=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
    )  # fmt: skip
    while started.poll() is None:
        started.send_signal(signal.SIGHUP)
        time.sleep(0.01)
    assert started.returncode == 0


def test_handlers_are_put_back(run: Any) -> None:
    before = [signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGHUP)]
    assert run("show", "stage.yaml")[0] == 0
    assert [signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGHUP)] == before


# Read-only machines and what they inherit ------------------------------------------------------------------


def doubled(x: float) -> float:
    """A function to compile."""
    return x + x


def compiled_once() -> tuple[float, list[str]]:
    """Result of `doubled`, compiled or loaded as in a fresh process, and the messages about that."""
    words: list[str] = []
    jit._listen()
    jit.announce = words.append
    try:
        return jit.jit(doubled)(1.5), words
    finally:
        jit.announce = None


def test_no_cache_of_compiled_code_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in some containers, neither the installation nor the home folder is writable."""
    from numba.core import caching

    def refused(_: object) -> None:
        raise OSError(30, "Read-only file system")

    for each in (caching.UserProvidedCacheLocator, caching.InTreeCacheLocator, caching.UserWideCacheLocator):
        monkeypatch.setattr(each, "ensure_cache_path", refused)
    for _ in range(2):
        assert compiled_once() == (3.0, [jit.EVERY_TIME])


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.7])
def test_files_of_the_cache_that_are_cut_off_are_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, share: float
) -> None:
    import numba

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    assert compiled_once() == (3.0, [jit.ONCE])
    assert compiled_once() == (3.0, [])
    for path in (tmp_path / "cache").rglob(f"*.{ending}"):
        os.truncate(path, int(share * path.stat().st_size))
    assert compiled_once() == (3.0, [jit.ONCE])
    assert compiled_once() == (3.0, []), "it was repaired"


def test_a_full_disk_means_no_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import numba
    from numba.core import caching

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(caching.IndexDataCacheFile, "_open_for_write", full)
    assert compiled_once()[0] == 3.0


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("backend", ["module://matplotlib_inline.backend_inline", "nonsense", "TkAgg", ""])
@pytest.mark.thorough
def test_a_backend_from_a_notebook_is_no_matter(backend: str) -> None:
    process("show", "stage.yaml", "--plot", "plain.png")
    done = process("show", "stage.yaml", "--plot", "a.png", env={"MPLBACKEND": backend})
    assert (done.returncode, said(done)) == (0, "")
    assert Path("a.png").read_bytes() == Path("plain.png").read_bytes()


def test_the_users_own_plots_keep_their_backend() -> None:
    """A notebook may call hystgen before it imports matplotlib itself."""
    code = (
        "import os\nfrom hystgen.basics import drawing\ndrawing.require()\nimport matplotlib\n"
        "print(matplotlib.get_backend(), os.environ['MPLBACKEND'])"
    )
    env = {**os.environ, "MPLBACKEND": "svg"}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["svg", "svg"]


def test_a_home_folder_that_cannot_be_written_to_makes_no_noise() -> None:
    env = {"HOME": "/dev/null/home", "XDG_CACHE_HOME": "/dev/null/cache", "XDG_CONFIG_HOME": "/dev/null/config"}
    done = process("show", "stage.yaml", "--plot", "a.png", env=env)
    assert (done.returncode, done.stderr) == (0, b"")
    assert Path("a.png").exists()


@pytest.mark.slow(one_in=2)
@pytest.mark.thorough
@pytest.mark.parametrize("home", ["/dev/null/home", "/proc/none"])
def test_zig_builds_without_a_home_folder(home: str) -> None:
    """zig would wait for ever for a home folder that cannot be created under /proc."""
    env = {"HOME": home, "XDG_CACHE_HOME": f"{home}/cache"}
    done = process("verify", "stage.yaml", "--compiler", "zig", env=env)
    assert done.returncode == 0, done.stdout.decode()
