"""The codes of a session as a C header, for firmware that plays them."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np

from hystgen.basics.version import __version__
from hystgen.emission import module, text
from hystgen.parameters.files import Parameters, parameters_sha256
from hystgen.planning.converter import Codes, Dac
from hystgen.planning.session import PlayedSession


def file(parameters: Parameters) -> str:
    """Name of the header for a model's session."""
    return f"{parameters.name}_session.h"


def nodes(stretches: Sequence[tuple[int, int]]) -> Codes:
    """Indices of the samples between which the drive is straight, from pairs of a number of steps and their length."""
    return np.cumsum([0, *(every for steps, every in stretches for _ in range(steps))], dtype=np.int64)


def header(
    parameters: Parameters,
    session: PlayedSession,
    dac: Dac,
    codes: Codes,
    stretches: Sequence[tuple[int, int]],
    words: str,
) -> str:
    """`NAME_session.h`: the codes between which the drive is straight, and how many samples lie between them.

    `codes`: of all samples; `stretches`: pairs of a number of steps and the samples per step; `words`: options of the
    plan.
    """
    name, unit = parameters.name, parameters.units.input
    kind = f"{'' if dac.zero else 'u'}int{8 * dac.bytes}_t"
    values = SimpleNamespace(
        NAME=name.upper(), rate=repr(session.rate), samples=session.samples, stretches=len(stretches),
        sha256=parameters_sha256(parameters), version=__version__,
        command=f"hystgen diagnose --plan {name}.yaml {words} -o plan/",
        lengths=text.constant(
            f"{name}_session_stretch_t {name}_session_stretches[{len(stretches)}]",
            [f"    {{ {steps}u, {every}u }}," for steps, every in stretches],
        ),
        codes=text.table(kind, f"{name}_session_codes", codes[nodes(stretches)].tolist()),
    )
    top, bottom = session.history
    details = [dac.sentence(f" {unit}" if unit else "", top - bottom)]
    banner = module.banner_of(values, file(parameters), f"drives of a diagnosis of {name}", details)
    return module.render("session.h.j2", values, name=name, banner=banner)
