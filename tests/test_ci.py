"""The files for CI systems on docs/howto/ci.md, and the hooks for pre-commit: valid, and run in a scratch repository.

Only what installs hystgen, or needs a network otherwise, is replaced; the actions of GitHub are left out.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from modelfiles import FILES
from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "howto" / "ci.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
HOOKS = ROOT / ".pre-commit-hooks.yaml"
BIN = Path(sys.executable).parent

GITHUB, GITLAB, HOOKED = ".github/workflows/model.yml", ".gitlab-ci.yml", ".pre-commit-config.yaml"


def saved(name: str) -> str:
    """The file that the page says to save under this name."""
    found = re.search(rf"[Ss]ave this as `{re.escape(name)}`[^`]*\n\n```yaml\n((?:.*\n)*?)```", PAGE)
    assert found, name
    return found[1]


def parsed(text: str) -> Any:
    return YAML(typ="safe", pure=True).load(text)


def call(
    *command: object, folder: Path, code: int | None = 0, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run a command with this environment's programs first in PATH."""
    path = os.pathsep.join([str(BIN), os.environ["PATH"]])
    known = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1"}
    done = subprocess.run(
        [*map(str, command)], cwd=folder, env={**os.environ, **known, "PATH": path, **environment},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert code is None or done.returncode == code, done.stdout + done.stderr
    return done


def commit(folder: Path, tag: str = "") -> None:
    """Make a folder a repository, with everything in it committed."""
    who = ("-c", "user.name=a", "-c", "user.email=a@example.com", "-c", "init.defaultBranch=main")
    for words in (("init", "-q"), ("add", "-A"), ("commit", "-qm", "all"), *((("tag", tag),) if tag else ())):
        call("git", *who, *words, folder=folder)


def write(folder: Path, name: str, text: str) -> Path:
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text)
    return folder / name


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A firmware repository: two models, their C as their `emit.output` says, and the files of the page."""
    folder = tmp_path / "firmware project"
    for name in ("plain", "linear"):
        write(folder, f"models/{name}.yaml", f"{FILES[name]}emit: {{output: ../firmware}}\n")
    for name in (GITHUB, GITLAB, HOOKED):
        write(folder, name, saved(name))
    write(folder, ".gitignore", ".numba_cache\n.pip_cache\n*.xml\n")
    call("hystgen", "emit", "models/plain.yaml", "models/linear.yaml", folder=folder)
    assert len(list((folder / "firmware").iterdir())) == 8
    commit(folder)
    return folder


def github() -> tuple[list[str], dict[str, str], list[str]]:
    """The commands of the workflow, its variables, and the files it uploads."""
    (job,) = parsed(saved(GITHUB))["jobs"].values()
    (upload,) = (step["with"]["path"] for step in job["steps"] if "upload-artifact" in step.get("uses", ""))
    return [step["run"] for step in job["steps"] if "run" in step], job["env"], [upload]


def gitlab() -> tuple[list[str], dict[str, str], list[str]]:
    """The commands of the job, its variables, and its reports."""
    (job,) = parsed(saved(GITLAB)).values()
    return job["script"], job["variables"], job["artifacts"]["reports"]["junit"]


SYSTEMS = {"github": github, "gitlab": gitlab}
OWN = re.compile(r"\$\{\{ github\.workspace \}\}|\$CI_PROJECT_DIR")


def is_install(command: str) -> bool:
    """Whether a command installs this version of hystgen, and nothing else, with extras that exist."""
    words = shlex.split(command)
    if words[:2] != ["pip", "install"]:
        return False
    (wanted,) = words[2:]
    found = re.fullmatch(r"hystgen\[([\w,]+)\]==(.+)", wanted)
    assert found, wanted
    assert set(found[1].split(",")) <= PROJECT["optional-dependencies"].keys()
    assert found[2] == PROJECT["version"]
    return True


def run(system: str, repository: Path) -> list[subprocess.CompletedProcess[str]]:
    """Run the commands of a system until one fails, as the system does, without the one that installs."""
    commands, variables, _ = SYSTEMS[system]()
    environment = {key: OWN.sub(str(repository), value) for key, value in variables.items()}
    assert not any("$" in value for value in environment.values())
    done = []
    for command in commands:
        if is_install(command):
            continue
        done.append(call("bash", "-eo", "pipefail", "-c", command, folder=repository, code=None, **environment))
        if done[-1].returncode:
            break
    assert len(done) > 0
    return done


def uploaded(system: str, repository: Path) -> dict[str, ElementTree.Element]:
    """The reports that a system uploads."""
    paths = [path for form in SYSTEMS[system]()[2] for path in sorted(repository.glob(form))]
    return {path.name: ElementTree.parse(path).getroot() for path in paths}


@pytest.mark.thorough(each_time=True)
def test_both_systems_pass_and_keep_what_was_compiled(repository: Path) -> None:
    """The second one finds all compiled functions of the first one in the folder that both keep."""
    for path in (repository / "models" / "plain.yaml", *(repository / "firmware").glob("plain*")):  # one will do
        path.unlink()
    commit(repository)
    kept = {}
    for system in SYSTEMS:
        done = run(system, repository)
        said = ["up to date: 4 files of 1 model\n", ""]
        assert [(each.returncode, each.stdout, each.stderr) for each in done] == [(0, "", words) for words in said]
        reports = uploaded(system, repository)
        assert reports.keys() == {"emit.xml", "verify.xml"}
        assert all(int(root.get("tests", 0)) >= 2 for root in reports.values())
        assert all((root.get("failures"), root.get("errors")) == ("0", "0") for root in reports.values())
        cache = repository / ".numba_cache"
        kept[system] = {path.name: path.stat().st_mtime_ns for path in cache.rglob("*.nbc")}
        for name in reports:
            (repository / name).unlink()
    assert kept["github"]
    assert kept["gitlab"] == kept["github"]
    assert call("git", "status", "--porcelain", folder=repository).stdout == ""


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_system_stops_at_c_that_is_edited_and_still_has_a_report(system: str, repository: Path) -> None:
    with (repository / "firmware" / "plain.c").open("a") as file:
        file.write("int edited;\n")
    (done,) = run(system, repository)
    assert done.returncode == 1
    assert "firmware/plain.c was edited by hand" in done.stderr
    assert uploaded(system, repository)["emit.xml"].get("failures") == "1"


def test_the_page_keeps_the_folder_that_numba_uses() -> None:
    """What the systems keep between runs is where the variable points, and its key has the version."""
    (job,) = parsed(saved(GITHUB))["jobs"].values()
    (cache,) = (step["with"] for step in job["steps"] if step.get("uses", "").startswith("actions/cache@"))
    assert job["env"]["NUMBA_CACHE_DIR"] == f"${{{{ github.workspace }}}}/{cache['path']}"
    assert cache["key"].endswith(f"hystgen-{PROJECT['version']}")
    (job,) = parsed(saved(GITLAB)).values()
    kept = [f"$CI_PROJECT_DIR/{path}" for path in job["cache"]["paths"]]
    assert kept == [job["variables"]["NUMBA_CACHE_DIR"], job["variables"]["PIP_CACHE_DIR"]]
    assert job["cache"]["key"] == f"hystgen-{PROJECT['version']}"


@pytest.mark.parametrize(("name", "schema"), [(GITHUB, "vendor.github-workflows"), (GITLAB, "vendor.gitlab-ci")])
def test_the_files_are_valid_for_their_systems(name: str, schema: str, tmp_path: Path) -> None:
    def check(text: str, code: int) -> None:
        path = write(tmp_path, name, text)
        call("check-jsonschema", "--builtin-schema", schema, path, folder=tmp_path, code=code)

    check(saved(name), 0)
    check(saved(name).replace("timeout", "time_out"), 1)


def test_the_workflow_on_the_page_lints_clean(tmp_path: Path) -> None:
    """By the rules of this project's own: actions pinned by commit, no credentials kept, least permissions."""
    options = ("--offline", "--no-config", "--persona", "pedantic")
    path = write(tmp_path, GITHUB, saved(GITHUB))
    call("zizmor", *options, path, folder=tmp_path)
    path.write_text(re.sub(r"@[0-9a-f]{40} # (v\S+)", r"@\1", saved(GITHUB)))
    done = call("zizmor", *options, path, folder=tmp_path, code=None)
    assert done.returncode != 0
    assert "unpinned-uses" in done.stdout


# pre-commit ----------------------------------------------------------------------------------------------


@pytest.fixture
def hooked(repository: Path, tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run the hooks of the page, from a repository with the manifest of this one and the tag that the page names.

    The hooks run the installed program; otherwise pre-commit would install hystgen from that repository.
    """
    if shutil.which("git") is None:
        (pytest.fail if os.environ.get("CI") else pytest.skip)("git is not installed")
    origin = tmp_path / "origin"
    write(origin, HOOKS.name, HOOKS.read_text())
    config = parsed(saved(HOOKED))
    (source,) = config["repos"]
    assert source["rev"] == f"v{PROJECT['version']}"
    commit(origin, source["rev"])
    source["repo"] = str(origin)

    def hook(code: int, name: str = "") -> subprocess.CompletedProcess[str]:
        for each in source["hooks"]:
            each.update({"id": name or each["id"], "language": "system"})
        with (repository / HOOKED).open("w") as file:
            YAML(typ="safe", pure=True).dump(config, file)
        call("git", "add", "-A", folder=repository)
        home = str(tmp_path / "pre-commit")
        return call("pre-commit", "run", folder=repository, code=code, PRE_COMMIT_HOME=home)

    return hook


def test_the_manifest_and_the_configuration_are_valid(tmp_path: Path) -> None:
    call("pre-commit", "validate-manifest", HOOKS, folder=tmp_path)
    call("pre-commit", "validate-config", write(tmp_path, HOOKED, saved(HOOKED)), folder=tmp_path)
    wrong = write(tmp_path, "hooks.yaml", HOOKS.read_text().replace("language: python", "language: cobol"))
    call("pre-commit", "validate-manifest", wrong, folder=tmp_path, code=1)


@pytest.mark.thorough(each_time=True)
def test_a_commit_stops_at_c_that_is_out_of_date(
    repository: Path, hooked: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    write(repository, "notes.txt", "nothing that the hook looks at\n")
    call("git", "add", "-A", folder=repository)
    model = repository / "models" / "plain.yaml"
    hooked(0)
    model.write_text(model.read_text().replace("output_offset", "# output_offset").replace("0.72", "0.73"))
    said = hooked(1).stdout
    assert "firmware/plain.c was generated from other parameters" in said
    assert "hystgen emit models/plain.yaml" in said
    assert "Failed" in hooked(1, "hystgen-emit").stdout, "files were changed by the hook"
    assert "Passed" in hooked(0, "hystgen-emit").stdout
    assert "Passed" in hooked(0, "hystgen-check").stdout
    model.unlink()
    assert "firmware/plain.c belongs to model plain" in hooked(1).stdout, "a model that is gone"
