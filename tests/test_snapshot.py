"""Snapshots: a restored instance goes on with the same bits, and a damaged one is refused or harmless."""

from __future__ import annotations

import subprocess
import warnings
from pathlib import Path

import jinja2
import pytest
from modelfiles import CALM, CHAINS, FILES, INVERSE_ALONE

from hystgen.arithmetic import ARITHMETICS
from hystgen.emission import block, module
from hystgen.emission.calls import emit_options
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters

EVERY = {**FILES, **CHAINS, "calm": CALM}
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")


@pytest.mark.slow(one_in=7)
@pytest.mark.parametrize(("name", "arithmetic", "engine"), [
    ("plain", "float32", "corners"), ("plain", "float64", "loop"), ("plain", "q15", "corners"),
    ("two_branches", "q31", "corners"), ("two_branches", "float32", "corners"), ("listed", "q15", "loop"),
    ("bent", "float64", "corners"), ("creeping", "q15", "corners"), ("creeping", "float32", "corners"),
    ("lagging", "q31", "corners"), ("aged", "q15", "loop"), ("viscous", "q15", "loop"), ("late", "q31", "loop"),
    ("everything", "float32", "corners"), ("dashpot", "q31", "loop"), ("forgetful", "q15", "loop"),
])
def test_a_restored_instance_goes_on_and_damage_is_harmless(
    name: str, arithmetic: str, engine: str, tmp_path: Path
) -> None:
    """Every reason, every cut length, and damage behind a repaired CRC, with sanitizers."""
    one = parse_parameters(EVERY[name])
    how = one.emit.compensation.model_copy(update={"noise_gain": 1e9})
    model = Model(one.model_copy(update={"emit": one.emit.model_copy(update={"compensation": how})}))
    operator = "inverse" if name in INVERSE_ALONE else "both"
    with warnings.catch_warnings(action="ignore"):
        options = emit_options(model, operator, arithmetic, engine, tables="runtime")
        made = module.of(model, options)
    for file, text in module.files(made).items():
        (tmp_path / file).write_text(text)
    fixed = ARITHMETICS[arithmetic].fixed
    source = jinja2.Template((Path(__file__).parent / "snapshots.c.j2").read_text()).render(
        name=name, NAME=name.upper(), operators=options.operators, fixed=fixed, chain=bool(model.effects), rounds=12,
        damages=40, largest=int(ARITHMETICS[arithmetic].code_max) if fixed else 0,  # type: ignore[attr-defined]
        block=block.words(made.parameters),
    )
    (tmp_path / "check.c").write_text(source)
    files = [tmp_path / f"{name}.c", tmp_path / "check.c", "-o", tmp_path / "check", "-lm"]
    subprocess.run(["gcc", "-O1", "-g", "-ffp-contract=off", *SANITIZED, *files], check=True)
    done = subprocess.run([tmp_path / "check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr[:2000]
    accepted, refused = (int(done.stdout.split()[k]) for k in (1, 3))
    assert accepted > 50
    assert refused > 50
