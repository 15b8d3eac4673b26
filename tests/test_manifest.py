"""The manifest against its schema, the files it describes, the header, and tampering."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import pytest
from click.testing import CliRunner
from modelfiles import CHAINS, FILES

from hystgen.cli import main

CODED = FILES["plain"] + (
    "emit: {converter: {reference: {bits: 12, range: [-9, 9], coding: twos-complement}, "
    "drive: {bits: 12, range: [-5, 5], coding: offset-binary}}}\n"
)
ROOT = Path(__file__).parent.parent
MODELS = {"plain": FILES["plain"], "coded": CODED, "everything": CHAINS["everything"]}


def run(*words: object) -> Any:
    return CliRunner().invoke(main, [str(word) for word in words])


def written(folder: Path, name: str, *options: str) -> Any:
    parameters = folder / "params.yaml"
    parameters.write_text(MODELS[name])
    result = run("emit", parameters, "-o", folder, "--manifest", "--operator", "both", *options)
    assert result.exit_code == 0, result.output
    (path,) = folder.glob("*_manifest.json")
    return json.loads(path.read_text())


@pytest.mark.parametrize("arithmetic", ["float32", "q15"])
@pytest.mark.parametrize("name", MODELS)
def test_a_manifest_says_what_files_and_headers_say(name: str, arithmetic: str, tmp_path: Path) -> None:
    found = written(tmp_path, name, "--arithmetic", arithmetic)
    schema = json.loads(run("schema", "--manifest").output)
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(found, schema)
    listed = {each["name"]: (each["bytes"], each["sha256"]) for each in found["files"]}
    assert listed == {
        path.name: (len(path.read_bytes()), hashlib.sha256(path.read_bytes()).hexdigest())
        for path in tmp_path.glob("*.[ch]")
    }
    header = next(path for path in tmp_path.glob("*.h") if "selftest" not in path.name).read_text()
    macros = dict(re.findall(r"#define [A-Z]+_(\w+_ERROR(?:_LSB)?) (\S+)", header))
    assert {each["macro"]: each["value"] for each in found["bounds"]} == {
        macro: pytest.approx(float(value.rstrip("f")), rel=1e-7) for macro, value in macros.items()
    }
    for each in found["bounds"]:
        assert (each["kind"] == "measured") == ("MEASURED" in each["macro"]) == (each["samples"] is not None)
    figures = {(each["what"], each["operator"], each["core"]): each["value"] for each in found["figures"]}
    banner = " ".join(re.sub(r"^ \*", "", line) for line in header.splitlines())
    banner = " ".join(banner.split())
    for operator in ("forward", "inverse"):
        assert f"{operator} instance {figures['ram', operator, '']} bytes of RAM" in banner
        small, stack = (figures[what, operator, "cortex-m0plus"] for what in ("instructions", "stack"))
        dearest = f"about {small} instructions and {stack} bytes of stack on a Cortex-M0+"
        assert f"{operator} step, costliest: {dearest}" in banner
    assert f"constant tables {figures['tables', '', '']} bytes" in banner
    for each in found["figures"]:
        assert bool(each["basis"]) == (each["kind"] == "measured")
    assert found["command"].endswith(" --manifest")
    assert f"ziglang>={found['measured_with']['zig']}," in (ROOT / "pyproject.toml").read_text()
    assert "hystgen_manifest" in schema["required"]
    assert found["licence"] == "0BSD"
    assert len(found["misra"]) > 10
    assert found["effects"] == re.findall(r"name: (\w+)", MODELS[name])[1:]


def test_a_manifest_is_checked_and_listed_like_the_c(tmp_path: Path) -> None:
    written(tmp_path, "plain")
    command = ("emit", tmp_path / "params.yaml", "-o", tmp_path, "--operator", "both", "--manifest")
    assert run(*command, "--check").exit_code == 0
    assert str(tmp_path / "plain_manifest.json") in run(*command, "--list-outputs").output
    path = tmp_path / "plain_manifest.json"
    path.write_text(path.read_text().replace('"licence": "0BSD"', '"licence": "MIT"'))
    result = run(*command, "--check")
    assert result.exit_code == 1
    assert "plain_manifest.json was edited by hand" in result.output
    result = run(*command[:-1], "--check")
    assert "plain_manifest.json belongs to model plain but is not written with these options (add --manifest)" in (
        result.output
    )
    path.unlink()
    result = run(*command, "--check")
    assert result.exit_code == 1
    assert "plain_manifest.json is missing" in result.output
    assert "--manifest" in result.output
