"""A session's codes as a C header, for firmware that outputs them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hystgen.emission import interface, runtime, text
from hystgen.parameters.files import parameters_sha256
from hystgen.parameters.schema import Parameters
from hystgen.planning.converter import Codes, Dac
from hystgen.planning.session import Session


def file(parameters: Parameters) -> str:
    """Name of the header for a model's session."""
    return f"{parameters.name}_session.h"


def nodes(stretches: Sequence[tuple[int, int]]) -> Codes:
    """Indices of samples between which the drive is straight, from pairs of step count and step length."""
    return np.cumsum([0, *(every for steps, every in stretches for _ in range(steps))], dtype=np.int64)


def header(
    parameters: Parameters,
    session: Session,
    dac: Dac,
    codes: Codes,
    stretches: Sequence[tuple[int, int]],
    words: str,
) -> str:
    """The text of `NAME_session.h`, with the codes between which the drive is straight and the samples between them.

    `codes`: the codes of all samples; `stretches`: pairs of a number of steps and the samples per step; `words`:
    command line options of the plan.
    """
    name, unit = parameters.name, parameters.units.input
    kind = f"{'' if dac.zero else 'u'}int{8 * dac.bytes}_t"
    top, bottom = session.history
    return runtime.template(
        "session.h.j2", name=name, NAME=name.upper(), rate=repr(session.rate), samples=session.samples,
        stretches=len(stretches),
        banner=interface.banner(
            file(parameters), f"drives of a diagnosis of {name}",
            f"hystgen diagnose --plan {name}.yaml {words} -o plan/", parameters_sha256(parameters),
            [dac.sentence(f" {unit}" if unit else "", top - bottom)],
        ),
        lengths=text.constant(
            f"{name}_session_stretch_t {name}_session_stretches[{len(stretches)}]",
            [f"    {{ {steps}u, {every}u }}," for steps, every in stretches],
        ),
        codes=text.table(kind, f"{name}_session_codes", codes[nodes(stretches)].tolist()),
    )
