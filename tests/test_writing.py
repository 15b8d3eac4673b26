"""Files are written completely or not at all, and leftovers of interrupted writes are removed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hystgen.basics import writing


@pytest.fixture(autouse=True)
def _fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start each test as in a process that has not swept any folder yet."""
    monkeypatch.setattr(writing, "_swept", set())


def holder(around: Path) -> subprocess.Popen[str]:
    """Another process that holds a staging folder in `around`; it is returned once the folder exists."""
    code = (
        "import sys, time; from pathlib import Path; from hystgen.basics import writing\n"
        "with writing.staging(Path(sys.argv[1])) as folder:\n"
        "    (folder / 'half').write_text('x'); print(folder, flush=True); time.sleep(60)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code, str(around)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert Path(process.stdout.readline().strip()).is_dir()
    return process


def left(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.name.startswith(writing.PREFIX))


def test_a_killed_process_leaves_a_folder_until_the_next_comes(tmp_path: Path) -> None:
    process = holder(tmp_path)
    process.kill()
    process.wait()
    assert len(left(tmp_path)) == 1
    writing.write_atomically(tmp_path / "a.txt", "a")
    assert os.listdir(tmp_path) == ["a.txt"]


def test_the_folder_of_a_process_that_lives_stays(tmp_path: Path) -> None:
    process = holder(tmp_path)
    try:
        before = left(tmp_path)
        writing.write_atomically(tmp_path / "a.txt", "a")
        with writing.staging(tmp_path) as own:
            writing._swept.clear()
            writing.sweep(tmp_path)  # from this process too
            assert own.is_dir()
        assert left(tmp_path) == before
    finally:
        process.kill()
        process.wait()


def test_a_folder_goes_though_a_copy_of_the_process_lives(tmp_path: Path) -> None:
    """Workers of a pool are forks, which inherit the lock."""
    reading, finish = os.pipe()
    with writing.staging(tmp_path) as folder:
        child = os.fork()
        if child == 0:
            os.close(finish)
            os.read(reading, 1)
            os._exit(0)
        os.close(reading)
    assert not folder.exists()
    os.close(finish)
    os.waitpid(child, 0)


def test_what_others_named_alike_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / ".hystgen-notes").mkdir()
    (tmp_path / ".hystgen-notes" / "todo.txt").write_text("mine")
    (tmp_path / ".hystgen-file").write_text("mine")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / ".hystgen-link").symlink_to("elsewhere")
    writing.write_atomically(tmp_path / "a.txt", "a")
    assert sorted(os.listdir(tmp_path)) == [".hystgen-file", ".hystgen-link", ".hystgen-notes", "a.txt", "elsewhere"]
    assert (tmp_path / ".hystgen-notes" / "todo.txt").read_text() == "mine"


def test_many_processes_at_once_in_one_folder(tmp_path: Path) -> None:
    """Processes make folders and sweep stale ones, and two are killed; none loses a folder that it holds."""
    code = (
        "import sys; from pathlib import Path; from hystgen.basics import writing\n"
        "for k in range(200):\n"
        "    writing._swept.clear()\n"
        "    writing.write_atomically(Path(sys.argv[1]) / f'{sys.argv[2]}.txt', str(k))\n"
    )
    runs = [subprocess.Popen([sys.executable, "-c", code, str(tmp_path), str(k)]) for k in range(6)]
    deadline = time.monotonic() + 30.0
    while len(list(tmp_path.glob("[45].txt"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.01)
    for process in runs[4:]:
        process.kill()
    assert [process.wait(timeout=60) for process in runs] == [0, 0, 0, 0, -signal.SIGKILL, -signal.SIGKILL]
    writing.sweep(tmp_path)
    assert sorted(os.listdir(tmp_path)) == [f"{k}.txt" for k in range(6)]
    assert [(tmp_path / f"{k}.txt").read_text() for k in range(4)] == ["199"] * 4


def test_a_file_system_without_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import errno
    import fcntl

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOLCK, "no locks")

    (tmp_path / ".hystgen-old" / "files").mkdir(parents=True)
    monkeypatch.setattr(fcntl, "flock", refuse)
    writing.write_atomically(tmp_path / "a.txt", "a")
    # It may be in use, which cannot be known without locks
    assert sorted(os.listdir(tmp_path)) == [".hystgen-old", "a.txt"]


def test_files_get_the_usual_rights(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        writing.write_atomically(tmp_path / "a.txt", "µ")
        writing.write_files(tmp_path / "new", {"b.txt": "b"})
    finally:
        os.umask(before)
    modes = [(tmp_path / name).stat().st_mode & 0o777 for name in ("a.txt", "new", "new/b.txt")]
    assert modes == [0o640, 0o750, 0o640]
    assert (tmp_path / "a.txt").read_bytes() == b"\xc2\xb5"


def test_a_link_leads_where_it_points_whether_or_not_there_is_anything(tmp_path: Path) -> None:
    (tmp_path / "file").symlink_to("there.txt")
    writing.write_atomically(tmp_path / "file", "a")
    (tmp_path / "folder").symlink_to("a/b/c")
    written = writing.write_files(tmp_path / "folder", {"x.c": "x"})
    assert written == [tmp_path / "folder" / "x.c"]
    assert (tmp_path / "there.txt").read_text() == "a"
    assert (tmp_path / "a" / "b" / "c" / "x.c").read_text() == "x"
    assert (tmp_path / "file").is_symlink()
    assert (tmp_path / "folder").is_symlink()


def test_a_link_that_leads_nowhere_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lost").symlink_to("nowhere/x.txt")
    Path("loop").symlink_to("loop")
    with pytest.raises(FileNotFoundError) as caught:
        writing.write_atomically("lost", "a")
    assert caught.value.filename == "lost"
    assert caught.value.strerror == f"the folder {tmp_path}/nowhere does not exist; create it, or choose another output"
    for write in (lambda: writing.write_atomically("loop", "a"), lambda: writing.write_files(Path("loop"), {"a": "a"})):
        with pytest.raises(OSError, match="leads back to itself; choose another output") as refused:
            write()
        assert refused.value.filename == "loop"
    with pytest.raises(OSError, match="leads back to itself"):  # before there is anything to write, too
        writing.check_files(Path("loop"), ["a"])
    Path("file").touch()
    Path("through").symlink_to("file/folder")
    with pytest.raises(NotADirectoryError):
        writing.check_files(Path("through"), ["a"])
    Path("file").unlink()
    Path("through").unlink()
    assert sorted(os.listdir()) == ["loop", "lost"]


def test_a_failure_names_what_was_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    for write in (
        lambda: writing.write_atomically(tmp_path / "a", "a"), lambda: writing.write_files(tmp_path / "a", {"b": "b"})
    ):  # fmt: skip
        with pytest.raises(OSError, match="No space left on device") as caught:
            write()
        assert caught.value.filename == str(tmp_path / "a")
    assert os.listdir(tmp_path) == []


def test_no_folder_for_temporary_files(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> str:
        raise FileNotFoundError(2, "No usable temporary directory found in ['/tmp']")

    monkeypatch.setattr(writing.tempfile, "gettempdir", none)
    with pytest.raises(FileNotFoundError, match="set TMPDIR to one"), writing.temporary():
        pass
