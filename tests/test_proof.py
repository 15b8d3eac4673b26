"""Machine proof that emitted fixed-point C cannot fault: Frama-C's Eva over every sequence of calls with every code.

Eva covers all that a program can do with sets of values; what it finds no alarm in cannot happen in any run. Nothing is
assumed of the calls but that init comes first. No alarm means: no signed overflow, no conversion to a narrower signed
type that changes the value, no invalid shift, no access outside an object, no read of what was never written; there is
no division. Conversions to unsigned types are meant to cut off, differences in them to wrap where a curve measures its
argument from the start of a piece. Right shifts of negative numbers are the compiler's to define: the emitted C refuses
to compile where they do not keep the sign.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from modelfiles import FILES, head

import hystgen
from hystgen.api import Model
from hystgen.params import parse_parameters

THRESHOLDS = np.linspace(0.0, 9.0, 65)
WEIGHTS = np.concatenate([[0.7], 0.0375 * np.exp(-THRESHOLDS[1:] / 5)])
MANY = head("many", -10, 10) + f"\n  pi: {{thresholds: {THRESHOLDS.tolist()}, weights: {WEIGHTS.tolist()}}}\n"

# What is proved: plays alone, start lists with an offset, dead zones, tanh, two branches, cascades; up to 64 plays
PROVED = [
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

# int, long and pointers as on 64 bits, and as on a core of 32 without a long multiplication, which takes its own path
MACHINES = {
    "64 bits": ["-machdep", "gcc_x86_64", "-cpp-extra-args=-Dvolatile="],
    "32 bits": ["-machdep", "gcc_x86_32", "-cpp-extra-args=-Dvolatile= -D__ARM_ARCH_6M__"],
}
# volatile keeps compilers from calling memset and has no other meaning here; Eva would take all that is written through
# it for unknown

DRIVER = """
#include "{name}.h"
/*@ assigns \\result \\from \\nothing; */
extern unsigned int any_call(void);
/*@ assigns \\result \\from \\nothing; */
extern {name}_real_t any_code(void);
int main(void)
{{
    {name}_forward_t forward; /* nothing written yet */
    {name}_inverse_t inverse;
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


def frama_c() -> str:
    found = shutil.which("frama-c")
    if found is None:
        assert not os.environ.get("CI"), "Frama-C is missing (Debian: frama-c-base)"
        pytest.skip("Frama-C is not installed (Debian: frama-c-base)")
    return found


def model(name: str) -> Model:
    return Model(parse_parameters({**FILES, "many": MANY}[name], f"{name}.yaml"))


def write(folder: Path, name: str, arithmetic: str) -> Path:
    """Emits the module with its driver; returns its C file."""
    hystgen.emit(model(name), folder, operator="both", arithmetic=arithmetic, engine="loop")
    (folder / "driver.c").write_text(DRIVER.format(name=name))
    return folder / f"{name}.c"


def alarms(source: Path, machine: str) -> list[str]:
    """What Eva cannot exclude, from the module with its driver beside it."""
    name, text = source.stem, source.read_text()
    plays = int(re.search(r"_N_PLAYS (\d+)", source.with_suffix(".h").read_text())[1])  # type: ignore[index]
    visits = [f"{name}_loop_{what}" for what in ("rest", "start", "solve") if f"{name}_loop_{what}(" in text]
    wraps = machine == "32 bits" or f"{name}_curve(" in text  # half words are put together, curves measure arguments
    done = subprocess.run(
        [
            frama_c(), *MACHINES[machine], "-eva", "-eva-precision", "2", "-eva-no-print", "-eva-widening-delay", "12",
            "-warn-signed-downcast", *(["-warn-unsigned-overflow"] if not wraps else []),
            # play by play, not all in one
            "-eva-auto-loop-unroll", str(plays + 2),
            "-eva-slevel-function", ",".join(f"{function}:{2 * plays + 20}" for function in visits),
            source.with_name("driver.c"), source,
        ],
        capture_output=True, text=True, timeout=900, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    # all of the module was looked at: some limits never act, since no code comes near them
    functions = re.search(r"(\d+) functions analyzed \(out of (\d+)\)", done.stdout)
    reached = re.search(r"(\d+) statements reached \(out of (\d+)\)", done.stdout)
    assert functions, done.stdout
    assert reached, done.stdout
    assert functions[1] == functions[2], done.stdout
    assert int(reached[1]) > 0.96 * int(reached[2]), done.stdout
    found = re.findall(r"^\[eva:alarm\] (.*(?:\n  .*)*)", done.stdout, flags=re.MULTILINE)
    assert f"  {len(found)} alarms generated" in done.stdout or len(found) == 1, done.stdout
    return found


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize(("name", "arithmetic"), PROVED)
def test_no_sequence_of_calls_can_fault(name: str, arithmetic: str, machine: str, tmp_path: Path) -> None:
    assert alarms(write(tmp_path, name, arithmetic), machine) == []


# Faults put into the emitted two_branches, and the alarm that has to follow: table entries, limits, a loop, a start
FAULTS = [
    (r"(_weight\[7\] = \{)[^}]*", r"\g<1>" + ", ".join(["2147483647"] * 7), "signed overflow"),
    (r"(_shift\[8\] = \{\s*1, )\d+", r"\g<1>0", "shift"),
    (r"(_front_ascending_scale\[\d+\] = \{\s*)\d+", r"\g<1>32", "shift"),
    (r"(_clamp_drive\(\w+ v\)\s*\{\s*return )[^;]*", r"\1(two_branches_real_t)v", "signed downcast"),
    (r"return \(two_branches_real_t\)\(code > [^;]*", r"return (two_branches_real_t)code", "signed downcast"),
    (r"(k = 1; k <= t->n)(; \+\+k)", r"\1 + 1u\2", "out of bounds"),
    (r"(self->has_pending = false;)\s*self->repeat = false;", r"\1", "uninitialized"),
]


@pytest.mark.parametrize(("pattern", "replacement", "alarm"), FAULTS)
def test_faults_raise_alarms(pattern: str, replacement: str, alarm: str, tmp_path: Path) -> None:
    source = write(tmp_path, "two_branches", "q31")
    text, places = re.subn(pattern, replacement, source.read_text())
    assert places == 1
    source.write_text(text)
    assert any(alarm in found for found in alarms(source, "32 bits"))
