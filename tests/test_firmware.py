"""The firmware of `examples/firmware`, built for three cores and run under qemu; a fault in it fails."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parent.parent / "examples" / "firmware"


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy, so that nothing is built inside the checkout; the models' C is emitted once for all tests."""
    folder = tmp_path_factory.mktemp("firmware") / "firmware"
    return Path(shutil.copytree(EXAMPLE, folder, ignore=shutil.ignore_patterns("build", "__pycache__")))


def make(folder: Path, *targets: str) -> subprocess.CompletedProcess[str]:
    tools = [f"HYSTGEN={sys.executable} -m hystgen", f"ZIG={sys.executable} -m ziglang"]
    command = ["make", "-s", "-C", folder, *tools, *targets]
    return subprocess.run(  # qemu puts semihosting's text on stderr
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, timeout=300
    )


@pytest.mark.thorough(each_time=True)
def test_the_image_tracks_on_every_core(firmware: Path) -> None:
    done = make(firmware)
    assert done.returncode == 0, done.stdout
    rows = re.findall(r"^(linear|plain|plays).*? (\d+) +(\d+)$", done.stdout, re.M)
    assert [name for name, *_ in rows] == ["linear", "plain", "plays"] * 3
    for core in range(3):
        linear, _, whole = ([int(nm) for nm in row[1:]] for row in rows[3 * core : 3 * core + 3])
        assert 300 < linear[0] < 500
        assert whole[0] < 0.2 * linear[0]
    assert rows[:3] == rows[3:6] == rows[6:]  # float32, q15 and q31, to a nanometre


@pytest.mark.thorough(each_time=True)
def test_another_core_by_the_line_of_the_page(firmware: Path) -> None:
    """The command of the page, in the copied folder."""
    page = (EXAMPLE.parent.parent / "docs" / "howto" / "firmware.md").read_text()
    (line,) = re.findall(r"^make -C examples/firmware (m4f .*)$", page, re.MULTILINE)
    done = make(firmware, *shlex.split(line))
    assert done.returncode == 0, done.stdout
    assert "float32 with -mcpu=cortex-m7" in done.stdout


@pytest.mark.thorough(each_time=True)
@pytest.mark.parametrize(("old", "new", "said"), [
    ("dac(drive));", "dac(drive * 9 / 10));", "do not help as they should"),
    ("    ++sample;\n", "    for (volatile int i = 0; i < 30000; ++i) {\n    }\n    ++sample;\n", "longer than its"),
])
def test_a_fault_fails(old: str, new: str, said: str, firmware: Path) -> None:
    main = firmware / "main.c"
    text = main.read_text()
    assert text.count(old) == 1
    main.write_text(text.replace(old, new))
    done = make(firmware, "m4f")
    main.write_text(text)
    assert done.returncode != 0
    assert said in done.stdout
