"""A model brought up to date with sessions in service, as far as these show its parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import counted
from hystgen.diagnosis.search import fits
from hystgen.diagnosis.search.hypothesis import Part, Structure, _near
from hystgen.diagnosis.data.items import rms
from hystgen.identification.joint import Kept
from hystgen.identification.pi import IdentificationError
from hystgen.identification.quality import correlation_time
from hystgen.model import Model
from hystgen.parameters.files import dump_parameters, make_parameters
from hystgen.service.sessions import Session

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Refined:
    """later"""


def refine(model: Model, sessions: Sequence[Session]) -> Refined:
    raise IdentificationError("not yet")
