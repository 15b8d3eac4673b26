"""Numbers of a parameter file, as pydantic types."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

MAX_PLAYS = 4096
MAX_NUMBER = 1e30


def _float(value: float) -> float:
    return float(value) + 0.0  # a plain float, and 0.0 for -0.0: equal models have equal canonical texts


Number = Annotated[float, Field(ge=-MAX_NUMBER, le=MAX_NUMBER, allow_inf_nan=False), AfterValidator(_float)]
Positive = Annotated[float, Field(gt=0, le=MAX_NUMBER, allow_inf_nan=False), AfterValidator(_float)]
NotNegative = Annotated[float, Field(ge=0, le=MAX_NUMBER, allow_inf_nan=False), AfterValidator(_float)]
