"""Metadata, changelog and citation of a release, and the workflow that publishes it."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

import hystgen

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def tool(name: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a program of the environment in which the tests run."""
    command = [str(Path(sys.executable).with_name(name)), *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def yaml(path: str) -> Any:
    return YAML(typ="safe", pure=True).load((ROOT / path).read_text())


def test_metadata_are_valid(tmp_path: Path) -> None:
    assert tool("validate-pyproject", "pyproject.toml").returncode == 0
    wrong = tmp_path / "pyproject.toml"
    wrong.write_text((ROOT / "pyproject.toml").read_text().replace("Language :: Python :: 3.11", "Language :: Adder"))
    assert tool("validate-pyproject", wrong).returncode != 0


def test_one_version_everywhere() -> None:
    version = PROJECT["version"]
    assert hystgen.__version__ == version
    assert yaml("CITATION.cff")["version"] == version
    sections = re.findall(r"^## \[(.+?)\](?: - \d{4}-\d\d-\d\d)?$", (ROOT / "CHANGELOG.md").read_text(), re.M)
    assert sections[0] == "Unreleased"
    if version not in sections:  # not released yet
        assert f"this will be {version}." in (ROOT / "CHANGELOG.md").read_text()


def test_the_citation_agrees_with_the_metadata() -> None:
    cited = yaml("CITATION.cff")
    assert (cited["title"], cited["license"]) == (PROJECT["name"], PROJECT["license"])
    assert PROJECT["description"].startswith(cited["abstract"].split(":")[0])
    holder = re.search(r"^Copyright \(c\) \d+ (.+)$", (ROOT / "LICENSE").read_text(), re.M)
    assert holder
    assert [author["name"] for author in cited["authors"]] == [holder[1]]


def test_the_workflow_lints_clean(tmp_path: Path) -> None:
    """Checked offline, with the strictest rules: actions pinned by commit, no credentials kept, least permissions."""
    options = ("--offline", "--no-config", "--persona", "pedantic")
    done = tool("zizmor", *options, ".github/workflows")
    assert done.returncode == 0, done.stdout
    workflow = (ROOT / ".github/workflows/publish.yml").read_text()
    loose = tmp_path / "publish.yml"
    loose.write_text(re.sub(r"@[0-9a-f]{40} # (v\S+)", r"@\1", workflow))
    done = tool("zizmor", *options, loose)
    assert done.returncode != 0
    assert "unpinned-uses" in done.stdout


def test_only_the_job_that_publishes_may_ask_for_a_token_and_it_runs_no_code_of_the_project() -> None:
    jobs = yaml(".github/workflows/publish.yml")["jobs"]
    assert [name for name, job in jobs.items() if "id-token" in job["permissions"]] == ["publish"]
    assert [step["uses"].split("@")[0] for step in jobs["publish"]["steps"]] == [
        "actions/download-artifact", "pypa/gh-action-pypi-publish",
    ]  # fmt: skip
