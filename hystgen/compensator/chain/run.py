"""Run the bit-exact reference of a model with effects over a whole record."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.compensator import reference
from hystgen.compensator.chain.layout import Compiled
from hystgen.effects.base import Run
from hystgen.plays import slots


def answers(compiled: Compiled, record: Run, inverse: bool) -> NDArray[Any]:
    """Answers (N,) for the drives or references in `record.v`; see `with_status`."""
    return with_status(compiled, record, inverse)[0]


def with_status(compiled: Compiled, record: Run, inverse: bool) -> tuple[NDArray[Any], NDArray[np.uint8]]:
    """Answers (N,) for the drives or references in `record.v`, and their status bits; for a preview the last sample
    is repeated.

    Bits about a sample itself (limited, held) come with the sample, bits about a drive with the drive. Fixed point
    takes and gives codes, except columns, which are in their units. Raises ValueError for numbers that are not codes.
    """
    t = compiled.tables
    x = reference.samples(t, record.v)
    ahead = compiled.ahead if inverse else 0
    later = np.append(x[ahead:], np.full(min(ahead, len(x)), x[-1:])) if ahead else x
    calls = [np.full(min(ahead, len(x)), slots.OP_PUSH, dtype=np.uint8)]
    given = [x[:ahead]]
    columns = t.columns
    followers = compiled.parts.blocks["gain"]
    if followers:
        entry = np.where(columns.entry < 0, slots.OP_TEMPERATURE, slots.OP_INFLUENCE + columns.entry)
        calls.append(np.tile(np.append(entry, slots.OP_STEP).astype(np.uint8), len(x)))
        values = [
            reference.nearest(t, unit * record.extra[column])
            for unit, effect in zip(columns.unit.tolist(), followers, strict=True) for column in effect.read
        ]
        given.append(np.column_stack([*values, later]).ravel())
    else:
        calls.append(np.full(len(x), slots.OP_STEP, dtype=np.uint8))
        given.append(later)
    op = np.concatenate(calls)
    found, status = reference.answers(t, inverse, op, np.concatenate(given))
    step = op == slots.OP_STEP
    own = slots.INPUT_CLAMPED | slots.HELD
    taken = status[step | (op == slots.OP_PUSH)][: len(x)]
    return np.asarray(found[step]), np.asarray((taken & own) | (status[step] & ~np.uint8(own)))
