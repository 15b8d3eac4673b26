"""Remarks on samples that were limited, held or out of range."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics import arguments
from hystgen.basics.problems import SampleWarning
from hystgen.compensator.reference import Session
from hystgen.plays import slots

ROUNDED = 1e-9
"""[fraction of the range] A reference or drive beyond its range by at most this much is not counted, since rounding
explains it: a 29-bit converter has larger steps, and in double precision a model undoes its inverse to within 1e-12.
Set by: tests/test_clamped_inverse.py."""


def forward(v: NDArray[np.float64], ends: tuple[float, float], limited: bool, held: int = 0) -> list[str]:
    """Remarks on drives (N,) of a forward model: how many were outside its range, and how many samples were held."""
    with np.errstate(invalid="ignore"):
        outside = int(np.count_nonzero(np.isfinite(v) & ((v < ends[0]) | (v > ends[1]))))
    how = "limited to it" if limited else "extrapolated, not limited"
    lie = "lies" if outside == 1 else "lie"
    beyond = f"{outside} of {len(v)} samples {lie} outside input_range {ends[0]:g} to {ends[1]:g}, {how}"
    return [*([beyond] if outside else []), *_held(held, len(v))]


def inverse(samples: int, references: int, drives: int, held: int = 0) -> list[str]:
    """Remarks on an inverse: numbers of references limited or held, and of drives limited for other references."""
    said = []
    if references:
        lie, were = ("lies", "was") if references == 1 else ("lie", "were")
        said.append(f"{references} of {samples} references {lie} outside the output range and {were} limited")
    if drives:
        said.append(f"{drives} of {samples} drives {'was' if drives == 1 else 'were'} limited to input_range")
    return [*said, *_held(held, samples)]


def compensated(references: NDArray[np.bool_], drives: NDArray[np.bool_], held: int = 0) -> list[str]:
    """Remarks on the inverse in double precision of a model with effects.

    `references` (N,): those outside the output range; `drives` (N,): limited ones.
    """
    return inverse(len(drives), int(np.count_nonzero(references)), int(np.count_nonzero(drives & ~references)), held)


def _held(number: int, samples: int) -> list[str]:
    are, them = ("is", "it") if number == 1 else ("are", "them")
    said = f"{number} of {samples} samples {are} not finite; the answer before {them} was held"
    return [said] if number else []


def counted(status: slots.Bytes, bit: int) -> int:
    """The number of samples with a status bit."""
    return int(np.count_nonzero(status & bit))


def run(session: Session, x: ArrayLike, moved: Session | None = None) -> tuple[NDArray[np.float64], list[str]]:
    """Answers (N,) of a session, and remarks on the samples.

    `moved`: for an inverse in double precision, a forward session with the same memory, to count the references that
    the drives miss by more than rounding. The bit-exact reference counts by the status bits of the C.
    """
    answers, status = session.run(x)
    signal = arguments.signal("x", x)
    held = counted(status, slots.HELD)
    if not session.inverse:
        limited = counted(status, slots.INPUT_CLAMPED) > 0
        return answers, forward(signal, session.drive_range, limited, held)
    references, drives = status & slots.INPUT_CLAMPED != 0, status & slots.OUTPUT_CLAMPED != 0
    if moved is not None:
        low, high = (float(end) for end in session.tables.limits.output[0])
        with np.errstate(invalid="ignore"):
            missed = np.abs(signal - moved.run(answers)[0]) > ROUNDED * (high - low)
        references, drives = references & missed, drives & missed
    drives &= ~references  # count each sample once
    return answers, inverse(len(signal), int(np.count_nonzero(references)), int(np.count_nonzero(drives)), held)


def tell(said: Iterable[str], depth: int = 2) -> None:
    """Issue each remark as a warning; `depth`: calls between here and the user's code."""
    for text in said:
        warnings.warn(text, SampleWarning, stacklevel=depth + 1)
