"""Hints to install an extra: the command installs from where hystgen came from."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import re
import shlex
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

import hystgen
from hystgen.basics import extras

ROOT = Path(hystgen.__file__).resolve().parents[1]


def words(extra: str) -> list[str]:
    """The arguments of `pip install` in the hint, which begins with this Python's own pip."""
    command = shlex.split(extras.install(extra))
    start = command.index("install")
    assert command[:start] in (["pip"], [sys.executable, "-m", "pip"])
    return command[start + 1 :]


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.mark.parametrize("extra", sorted(PROJECT["optional-dependencies"]))
def test_from_a_checkout_the_checkout_is_installed(extra: str) -> None:
    """The hint does not name a package on an index, where hystgen may be missing or another project."""
    option, place = words(extra)
    folder, _, named = place.rstrip("]").partition("[")
    project = tomllib.loads((Path(folder) / "pyproject.toml").read_text())["project"]
    assert (option, project["name"]) == ("-e", "hystgen")
    assert named in project["optional-dependencies"]


@pytest.mark.parametrize(("url", "expected"), [
    (None, ["hystgen[plot]"]),
    ({"url": "file:///home/me/my%20wheels/hystgen-0.1.0.whl", "archive_info": {}},
     ["/home/me/my wheels/hystgen-0.1.0.whl[plot]"]),
    ({"url": "https://example.org/h.git", "vcs_info": {"vcs": "git", "commit_id": "abc"}},
     ["hystgen[plot] @ git+https://example.org/h.git@abc"]),
])  # fmt: skip
def test_else_from_where_it_was_installed(
    url: dict[str, object] | None, expected: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The origin is what pip notes in direct_url.json (PEP 610)."""
    text = None if url is None else json.dumps(url)
    monkeypatch.setattr(extras, "__file__", str(tmp_path / "site-packages" / "hystgen" / "basics" / "extras.py"))
    monkeypatch.setattr(importlib.metadata, "distribution", lambda _: SimpleNamespace(read_text=lambda _: text))
    assert words("plot") == expected


def test_pip_is_that_of_the_python_that_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pip = tmp_path / "pip"
    pip.write_text("")
    pip.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert extras.install("plot").startswith(f"{shlex.quote(sys.executable)} -m pip install ")
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    assert extras.install("plot").startswith("pip install ")


def required(requirements: list[str]) -> set[str]:
    """Names of the required distributions, including those of this package's extras."""
    found = set()
    for text in requirements:
        name, named = re.match(r"([\w.-]+)(?:\[([\w,-]+)\])?", text).groups()
        if name == PROJECT["name"]:
            for extra in named.split(","):
                found |= required(PROJECT["optional-dependencies"][extra])
        else:
            found.add(name)
    return found


def test_the_packages_of_the_extra_fit_are_those_that_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    assert required(["hystgen[fit]"]) == set(extras.FIT)
    assert not set(extras.FIT) & required(PROJECT["dependencies"])
    extras.require_fit("this")
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "joblib" else find(name))
    with pytest.raises(extras.MissingExtraError) as caught:
        extras.require_fit("this")
    assert str(caught.value) == f"this needs joblib; install the extra with: {extras.install('fit')}"
    assert set(extras.PLOT) == required(["hystgen[plot]"])
    extras_missing = (*extras.PLOT, "joblib")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name in extras_missing else find(name))
    with pytest.raises(extras.MissingExtraError) as caught:
        extras.require_fit("this", plot=True)
    both = extras.install("fit,plot")
    assert str(caught.value) == f"this needs joblib, matplotlib; install the extras with: {both}"


def test_all_is_every_extra_for_users() -> None:
    for extra in PROJECT["optional-dependencies"]:
        if extra not in ("dev", "docs"):
            assert required([f"hystgen[{extra}]"]) <= required(["hystgen[all]"]), extra


def test_no_hint_is_written_by_hand() -> None:
    """Every message takes its hint from `extras`."""
    texts = {path: path.read_text(encoding="utf-8") for path in (ROOT / "hystgen").rglob("*.py")}
    assert [path.name for path, text in texts.items() if "pip install" in text] == ["extras.py"]
