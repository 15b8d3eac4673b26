"""Machine proof that emitted fixed-point C cannot fault: Frama-C's Eva over every sequence of calls with every code.

Eva covers everything a program can do with sets of values; a fault without an alarm cannot happen in any run. No alarm
means: no signed overflow, no conversion to a narrower signed type that changes the value, no invalid shift, no access
outside an object, no read of an uninitialized value; there is no division. Conversions to unsigned types are meant to
truncate, differences in them to wrap where a curve measures its argument from the start of a piece. Right shifts of
negative numbers are implementation-defined: the emitted C refuses to compile where they do not keep the sign.

For the engine `loop`, the only assumption is that init comes first. For `corners`, the facts about the list of corners
that `granted` lists are assumed too; runs check them, and instances are static there, which C sets to zero.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from granted import STATES, granted, granted_states
from mains import c_main
from modelfiles import BRANCHES, CREEP, FILES, chain, head

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.compensator.chain import tables as chain_tables
from hystgen.emission import module
from hystgen.emission.calls import emitted_files
from hystgen.emission.options import Options
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification import compilers, signals

pytestmark = pytest.mark.thorough

THRESHOLDS = np.linspace(0.0, 9.0, 65)
WEIGHTS = np.concatenate([[0.7], 0.0375 * np.exp(-THRESHOLDS[1:] / 5)])
MANY = head("many", -10, 10) + f"\n  pi: {{thresholds: {THRESHOLDS.tolist()}, weights: {WEIGHTS.tolist()}}}\n"

FEWER = f"{{thresholds: {THRESHOLDS[::4].tolist()}, weights: {WEIGHTS[::4].tolist()}}}"
SIXTEEN = head("sixteen", -10, 10) + f"\n  pi: {FEWER}\n"

# Models of the proof: plays alone, start lists with an offset, dead zones, tanh, two branches, cascades; up to 64 plays
LOOP = [
    ("plain", "q31"),
    ("plain", "q15"),
    ("listed", "q31"),
    ("listed", "q15"),
    ("bent", "q31"),
    ("curved", "q15"),
    ("two_branches", "q31"),
    ("two_branches", "q15"),
    ("mixed", "q31"),
    ("behind", "q15"),
    ("away", "q31"),
    ("density", "q15"),
    ("many", "q31"),
    ("many", "q15"),
]
CORNERS = [
    ("plain", "q31"),
    ("plain", "q15"),
    ("listed", "q15"),
    ("bent", "q31"),
    ("two_branches", "q15"),
    ("mixed", "q31"),
    ("sixteen", "q31"),
]
PROVED = [(*module, "loop") for module in LOOP] + [(*module, "corners") for module in CORNERS]

# int, long and pointers of a 64-bit machine, and of a 32-bit core without long multiplication, which has its own code
MACHINES = {
    "64 bits": ["-machdep", "gcc_x86_64", "-cpp-extra-args=-Dvolatile="],
    "32 bits": ["-machdep", "gcc_x86_32", "-cpp-extra-args=-Dvolatile= -D__ARM_ARCH_6M__"],
}
# volatile only keeps compilers from calling memset; Eva would treat everything written through it as unknown

DRIVER = """
#include "{name}.h"
/*@ assigns \\result \\from \\nothing; */
extern unsigned int any_call(void);
/*@ assigns \\result \\from \\nothing; */
extern {name}_real_t any_code(void);
/*@ assigns \\result \\from \\nothing; */
extern int64_t any_travel(void);
int main(void)
{{
    {storage} {name}_forward_t forward; /* auto: nothing written yet */
    {storage} {name}_inverse_t inverse;
    {name}_forward_init(&forward);
    {name}_inverse_init(&inverse);
    for (;;) {{
        switch (any_call()) {{
        case 0: {name}_forward_init(&forward); break;
        case 1: {name}_forward_reset(&forward, any_code()); break;
        case 2: (void){name}_forward_step(&forward, any_code()); break;
        case 3: (void){name}_forward_status(&forward); break;
        case 4: {name}_inverse_init(&inverse); break;
        case 5: {name}_inverse_reset(&inverse, any_code()); break;
        case 6: (void){name}_inverse_step(&inverse, any_code()); break;
        case 7: {name}_inverse_commit(&inverse, any_code()); break;
        case 8: (void){name}_inverse_status(&inverse); break;
        default: return 0;
        }}
    }}
}}
"""


EFFECTS = {
    "crept": (CREEP,),
    "gained": ("name: thermal, gain_per_degree: -0.002, offset_per_degree: 0.01",),
    "limited": ("name: saturation, level: 12",),
    "stopped": ("name: saturation, shape: stops, lower: -5, upper: 4, give: 0.2",),
    "slewed": ("name: slew_limit, rate: 500, falling_rate: 300",),
    "delayed": ("name: delay, time: 2.6e-3",),
    "lagged": ("name: lag, time_constant: 0.01",),
    "braked": ("name: lag, time_constant: 0.01", "name: slew_limit, rate: 500, falling_rate: 300"),
    "steady": ("name: lag, time_constant: 0.01", "name: slew_limit, rate: 500, falling_rate: 300"),
    "calmed": ("name: lag, time_constant: 0.01",),
    "prompt": ("name: lag, time_constant: 4.0e-4",),
    "rung": ("name: resonance, frequency: 40, damping: 0.05",),
    "drifted": ("name: drift, shape: curved, rate: 0.05, change: 0.01",),
    "aged": ("name: ageing, loss: 0.02, travel: 50",),
    "heated": ("name: thermal, source: self_heating, time_constant: 0.5, heating: 0.05, gain_per_degree: -0.02",),
    "rubbed": ("name: thermal, source: hysteresis, time_constant: 0.5, heating: 0.02, reach: 3, gain_per_degree: 0.1",),
    "viscous": ("name: rate_dependence, shape: relaxation, time_constant: 5.0e-3",),
    "dilated": ("name: rate_dependence, betas: [1.0e-4, 1.0e-4, 1.0e-4, 2.0e-4, 2.0e-4, 2.0e-4]",),
    "dashpot": ("name: rate_dependence, shape: relaxation, time_constant: 5.0e-3, exponent: 2.5",),
    "bumpy": ("name: noncongruent, shape: centre, amplitude: -0.3, centre: -1, width: 1.5",),
    "uneven": ("name: noncongruent, coefficients: [[0.05, -0.01], [0.02], [0.01], [0.05], [0.05], [0.05]]",),
}
"""Models with effects, covering every block and every kind of plays. Runs of `test_fixed_chain` check the facts that
`granted_states` lists; instances are static there."""

FRONTS = {"steady": BRANCHES}

QUIET = "emit: {compensation: {quiet: true}}\n"

COMPENSATED = {"drifted": "drift", "heated": "self_heating", "rubbed": "self_heating"}
"""Effects that are compensated on request although nothing measures them."""

CODE, ANY = "any_code", {"set_travel": "any_travel"}
"""Arguments of calls; all but one take codes."""

CALL = "        case {}: {}; break;\n"


def chain_driver(one: Model, arithmetic: str) -> str:
    """A driver that makes every call of both operators of a model with effects, in any order with any codes."""
    name = one.name
    calls = module.of(one, Options("both", arithmetic, "loop", "self-contained")).compensator.calls
    cases = [
        (op, f"{name}_{op}_{call}(&{op}{f', {ANY.get(call, CODE)}()' * given})")
        for op in ("forward", "inverse")
        for call, given in (
            ("init", 0), ("reset", 1), ("step", 1), ("status", 0), *([("commit", 1)] if op == "inverse" else []),
            *((each, {"expected": 0, "travel": 0, "correct": 2}.get(each, 1)) for each in calls[op]),
        )
    ]  # fmt: skip
    text = "".join(CALL.format(i, f"(void){call}") for i, (_, call) in enumerate(cases))
    head, _, behind = DRIVER.format(name=name, storage="static").partition("        case 0")
    return head + text + behind[behind.index("        default") :]


def frama_c() -> str:
    found = shutil.which("frama-c")
    if found is None:
        assert not os.environ.get("CI"), "Frama-C is missing (Debian: frama-c-base)"
        pytest.skip("Frama-C is not installed (Debian: frama-c-base)")
    return found


def model(name: str) -> Model:
    chains = {
        own: chain(own, *effects, front=FRONTS.get(own, ""), compensate=COMPENSATED.get(own, ""))
        for own, effects in EFFECTS.items()
    }
    chains["calmed"] += QUIET
    return Model(parse_parameters({**FILES, **chains, "many": MANY, "sixteen": SIXTEEN}[name], f"{name}.yaml"))


def write(folder: Path, name: str, arithmetic: str, engine: str) -> Path:
    """Emit the module with its driver; return its C file."""
    one = model(name)
    hystgen.emit(one, folder, operator="both", arithmetic=arithmetic, engine=engine)
    source = folder / f"{name}.c"
    if engine == "corners":
        source.write_text(granted(source.read_text(), one, arithmetic))
    if name in EFFECTS:
        how = one.parameters.emit.compensation
        compiled = chain_tables.build(one.chain, arithmetic, float(one.parameters.sample_time or 0.0), how)
        source.write_text(granted_states(source.read_text(), compiled, name))
        (folder / "driver.c").write_text(chain_driver(one, arithmetic))
        return source
    storage = "static" if engine == "corners" else "auto"
    (folder / "driver.c").write_text(DRIVER.format(name=name, storage=storage))
    return source


def alarms(source: Path, machine: str, first: bool = False) -> list[str]:
    """Alarms of Eva on the module with its driver, which lies beside it; `first`: the first one ends the analysis."""
    name, text = source.stem, source.read_text()
    plays = int(re.search(r"_N_PLAYS (\d+)", source.with_suffix(".h").read_text())[1])  # type: ignore[index]
    apart = {  # states kept apart per function, so that plays and coefficients are not merged
        "loop_rest": 2 * plays + 20, "loop_start": 2 * plays + 20, "loop_solve": 2 * plays + 20,
        **dict.fromkeys(("relaxing_follow", "moved_follow", "relax", "moved_rest"), 2 * plays + 20),
        "start": 300, "find": 1000, "curve": 300, "delay_rest": 30,
        "preview_put": 30, "creep_rest": 100, "creep_absorb": 100, "creep_next": 100, "ageing_gain": 1000,
        "yield": 1000,
    }  # fmt: skip
    visits = [f"{name}_{what}:{states}" for what, states in apart.items() if f"{name}_{what}(" in text]
    # half words are joined, curves measure arguments, and the corner engine measures ways: all of them wrap
    wraps = machine == "32 bits" or f"{name}_curve(" in text or f"{name}_find(" in text
    done = subprocess.run(
        [
            frama_c(), *MACHINES[machine], "-warn-signed-downcast", *(["-warn-unsigned-overflow"] if not wraps else []),
            "-eva", "-eva-precision", "0", "-eva-no-print", "-eva-domains", "symbolic-locations",
            "-eva-widening-delay", str(12 if f"{name}_loop_rest(" in text else plays + 6),  # one for each corner
            "-eva-auto-loop-unroll", str(plays + 2), "-eva-plevel", "400",
            "-eva-slevel-function", ",".join(visits), *(["-eva-stop-at-nth-alarm", "1"] if first else []),
            source.with_name("driver.c"), source,
        ],
        capture_output=True, text=True, timeout=900, check=False,
    )  # fmt: skip
    found = re.findall(r"^\[eva:alarm\] (.*(?:\n  .*)*)", done.stdout, flags=re.MULTILINE)
    if first:
        return found
    assert done.returncode == 0, done.stdout + done.stderr
    # all of the module was analysed: some limits never act, since no code comes near them
    functions = re.search(r"(\d+) functions analyzed \(out of (\d+)\)", done.stdout)
    reached = re.search(r"(\d+) statements reached \(out of (\d+)\)", done.stdout)
    assert functions, done.stdout
    assert reached, done.stdout
    # every code is a number, so a model with effects never takes its calls and branches for other values
    idle = 2 if name in EFFECTS else 0
    assert int(functions[2]) - idle <= int(functions[1]), done.stdout
    # where Eva finds by itself that a fact holds, two of its statements are never reached
    known = 2 * len(re.findall(r"^ +(?:GRANTED|WITHIN)\(", text, flags=re.MULTILINE)) if name in EFFECTS else 0
    assert int(reached[1]) > (0.92 if name in EFFECTS else 0.96) * (int(reached[2]) - known), done.stdout
    assert f"  {len(found)} alarms generated" in done.stdout or len(found) == 1, done.stdout
    return found


@pytest.mark.slow(one_in=5)
@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize(("name", "arithmetic", "engine"), PROVED)
def test_no_sequence_of_calls_can_fault(name: str, arithmetic: str, engine: str, machine: str, tmp_path: Path) -> None:
    assert alarms(write(tmp_path, name, arithmetic, engine), machine) == []


@pytest.mark.slow(one_in=8)
@pytest.mark.parametrize("arithmetic", ["q31", "q15"])
@pytest.mark.parametrize("name", EFFECTS)
def test_no_sequence_of_calls_can_fault_a_model_with_an_effect(name: str, arithmetic: str, tmp_path: Path) -> None:
    assert alarms(write(tmp_path, name, arithmetic, "loop"), "64 bits") == []


CLAMP, UNCLAMPED = r"(_clamp_drive\(\w+ v\)\s*\{\s*)[^}]*", r"\1return (two_branches_real_t)v;\n"

# Faults put into the emitted two_branches in q31, and the alarm each must raise: in table entries, limits, a loop, a
# start, and a search that goes too far
FAULTS = [
    ("loop", ".c", r"(#define TWO_BRANCHES_FRACTION )\d+u", r"\g<1>40u", "signed overflow"),
    ("loop", ".c", r"(_shift\[8\] = \{\s*1, )\d+", r"\g<1>0", "shift"),
    ("loop", ".c", r"(_front_ascending_scale\[\d+\] = \{\s*)\d+", r"\g<1>32", "shift"),
    ("loop", ".c", CLAMP, UNCLAMPED, "signed downcast"),
    ("loop", ".c", r"if \(code > TWO_BRANCHES_CODE_MAX\) \{[^}]*\}", "", "downcast"),
    ("loop", ".c", r"(k = 1; k <= t->n)(; \+\+k)", r"\1 + 1u\2", "out of bounds"),
    ("loop", ".c", r"(self->has_pending = false;)\s*self->repeated = false;", r"\1", "uninitialized"),
    ("corners", ".c", CLAMP, UNCLAMPED, "signed downcast"),
    ("corners", ".c", r"(#define TWO_BRANCHES_HIGH_STEP \(\(int64_t\)1 << )\d+", r"\g<1>37", "signed overflow"),
    ("corners", ".c", r"(middle = \(low \+ left\)) / 2;", r"\1 / 2 + 1u;", "out of bounds"),
]


@pytest.mark.parametrize(("engine", "file", "pattern", "replacement", "alarm"), FAULTS)
def test_faults_raise_alarms(
    engine: str, file: str, pattern: str, replacement: str, alarm: str, tmp_path: Path
) -> None:
    source = write(tmp_path, "two_branches", "q31", engine)
    text, places = re.subn(pattern, replacement, source.with_suffix(file).read_text(), flags=re.DOTALL)
    assert places == 1
    source.with_suffix(file).write_text(text)
    assert any(alarm in found for found in alarms(source, "32 bits", first=True))


# Faults put into blocks of effects in q31, and the alarm each must raise
EFFECT_FAULTS = [
    ("crept", r"\(settled - state\[i\]\.next\) >> t->drop", "settled - state[i].next", "signed downcast"),
    ("crept", r"(crept_creep_1 = \{[^;]*, )\d+(, \d+, 3\s)", r"\g<1>25\2", "signed overflow"),
    ("aged", r"\(travel - piece->begin\) >> piece->drop", "travel - piece->begin", "signed downcast"),
    ("drifted", r"(\(t->slope \+ self->gained\)) \* ahead", r"\1 * self->part", "signed overflow"),
    ("heated", r"amount, t->coarse", "amount, 0", "signed downcast"),
    ("rubbed", r"(\(\w+_sum_t\)odd) \* way", r"\1 * way * way", "signed overflow"),
    ("viscous", r"(sum \+= t->weight\[i\] \* z);", r"\1 * r;", "signed overflow"),
    ("braked", r"\(\w+_sum_t\)(\(middle \+ margin\) \* \(middle)", r"\1", "signed overflow"),
    ("dashpot", r"\(k = 4; k > 0; --k\)( \{\s*y = piece)", r"(k = 5; k > 0; --k)\1", "out of bounds"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "pattern", "replacement", "alarm"), EFFECT_FAULTS)
def test_faults_of_effects_raise_alarms(name: str, pattern: str, replacement: str, alarm: str, tmp_path: Path) -> None:
    source = write(tmp_path, name, "q31", "loop")
    text, places = re.subn(pattern, replacement, source.read_text())
    assert places == 1
    source.write_text(text)
    assert any(alarm in found for found in alarms(source, "64 bits", first=True))


def test_every_fact_about_effects_has_its_place() -> None:
    text = "".join(
        emitted_files(model(name), operator="both", arithmetic="q31", engine="loop")[f"{name}.c"] for name in EFFECTS
    )
    for pattern, _ in STATES:
        assert re.search(pattern.replace("NAME", r"\w+?"), text), pattern


NOT_GRANTED = """\
#include <stdio.h>
#include <stdlib.h>
void not_granted(int line);
void not_granted(int line)
{
    fprintf(stderr, "not so: line %d", line);
    exit(1);
}
"""


def run(folder: Path, one: Model, arithmetic: str, sums: int = 1) -> str:
    """Messages of the module with the checks of `granted` over the verification records of both operators; empty if all
    hold."""
    gcc = compilers.find("gcc")
    if gcc is None:
        assert not os.environ.get("CI"), "gcc is missing"
        pytest.skip("gcc is not installed")
    name = one.parameters.name
    hystgen.emit(one, folder, operator="both", arithmetic=arithmetic, engine="corners")
    source = folder / f"{name}.c"
    source.write_text(granted(source.read_text(), one, arithmetic, sums))
    (folder / "main.c").write_text(NOT_GRANTED + c_main(name))
    gcc.run(["-std=c99", "-O1", "-I", folder, folder / "main.c", source, "-o", folder / "run"])
    numbers, real = one.tables(arithmetic, "corners"), ARITHMETICS[arithmetic].number
    said = ""
    for op in ("forward", "inverse"):
        for record, call, x in signals.suite(numbers, real, op == "inverse", 20_000):
            calls = np.rec.fromarrays([call, x.astype(real)], dtype=[("call", "u1"), ("x", real)])
            done = subprocess.run([folder / "run", op], input=calls.tobytes(), capture_output=True, check=False)
            said += f"{op}, {record}: {done.returncode} {done.stderr.decode()}\n" if done.returncode else ""
    return said


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize("arithmetic", ["q31", "q15"])
@pytest.mark.parametrize("name", [*(name for name in FILES if name != "linear"), "sixteen", "many"])
def test_what_the_proof_of_corners_takes_for_granted_holds(name: str, arithmetic: str, tmp_path: Path) -> None:
    assert run(tmp_path, model(name), arithmetic) == ""


def test_what_is_granted_is_looked_at(tmp_path: Path) -> None:
    assert "not so" in run(tmp_path, model("plain"), "q31", sums=16)
