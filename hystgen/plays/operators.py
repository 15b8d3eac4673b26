"""The operators of the Prandtl-Ishlinskii literature, sample by sample, as defined there.

Identification builds its regressors from these definitions, and every faster version is tested against them. Signals
are one-dimensional arrays `v_0, v_1, ...`; equation numbers refer to the tutorial note named in `docs/note.md`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.arguments import samples
from hystgen.basics.jit import jit

Array = NDArray[np.float64]


@jit
def followed(state: float, x: float, r: float) -> float:
    """State of a play of threshold r after its input has moved to `x`."""
    low = x - r
    high = x + r
    if state > high:
        state = high
    if state < low:
        state = low
    return state


@jit
def _play_into(v: Array, r: float, state: float, out: Array) -> float:
    for k in range(len(v)):
        state = followed(state, v[k], r)
        out[k] = state
    return state


@jit
def _plays_into(v: Array, r: Array, states: Array, out: Array) -> None:
    # Four at a time: a single play's recursion would stall on its previous sample
    fours = len(r) // 4 * 4
    for i in range(0, fours, 4):
        r0, r1, r2, r3 = r[i], r[i + 1], r[i + 2], r[i + 3]
        s0, s1, s2, s3 = states[i], states[i + 1], states[i + 2], states[i + 3]
        for k in range(len(v)):
            s0, s1 = followed(s0, v[k], r0), followed(s1, v[k], r1)
            s2, s3 = followed(s2, v[k], r2), followed(s3, v[k], r3)
            out[i, k], out[i + 1, k], out[i + 2, k], out[i + 3, k] = s0, s1, s2, s3
    for i in range(fours, len(r)):
        _play_into(v, r[i], states[i], out[i])


@jit
def _play_sum_into(v: Array, r: Array, states: Array, p: Array, out: Array) -> None:
    for k in range(len(v)):
        out[k] = 0.0
    fours = len(r) // 4 * 4
    for i in range(0, fours, 4):
        r0, r1, r2, r3 = r[i], r[i + 1], r[i + 2], r[i + 3]
        s0, s1, s2, s3 = states[i], states[i + 1], states[i + 2], states[i + 3]
        p0, p1, p2, p3 = p[i], p[i + 1], p[i + 2], p[i + 3]
        for k in range(len(v)):
            s0, s1 = followed(s0, v[k], r0), followed(s1, v[k], r1)
            s2, s3 = followed(s2, v[k], r2), followed(s3, v[k], r3)
            out[k] = out[k] + p0 * s0 + p1 * s1 + p2 * s2 + p3 * s3
    for i in range(fours, len(r)):
        state = states[i]
        for k in range(len(v)):
            state = followed(state, v[k], r[i])
            out[k] += p[i] * state


@jit
def _weighted_into(p: Array, rows: Array, out: Array) -> None:
    for k in range(len(out)):
        out[k] = 0.0
    for i in range(len(p)):
        if p[i] != 0.0:
            for k in range(len(out)):
                out[k] += p[i] * rows[i, k]


@jit
def _stop_into(v: Array, r: float, previous: float, state: float, out: Array) -> None:
    for k in range(len(v)):
        state = state + (v[k] - previous)  # a repeated sample adds nothing
        previous = v[k]
        if state > r:
            state = r
        if state < -r:
            state = -r
        out[k] = state


def play(v: ArrayLike, threshold: float, start: float = 0.0) -> Array:
    """Play operator: `s_k = max(v_k - r, min(v_k + r, s_(k-1)))`, starting at `start` (1)(2).

    `v`: N samples; returns N samples in the same unit. Raises ValueError for a negative threshold.
    """
    if threshold < 0:
        raise ValueError("a play threshold must not be negative")
    signal = samples(v)
    out = np.empty_like(signal)
    _play_into(signal, float(threshold), float(start), out)
    return out


def plays(v: ArrayLike, thresholds: ArrayLike, start: ArrayLike = 0.0) -> Array:
    """All plays of a model (1)(2): row i is the play of `thresholds[i]` starting at `start[i]`; shape (n+1, N).

    `v`: N samples; `thresholds`: n+1 numbers; `start`: n+1 numbers, or one for all; all of them and the result in the
    unit of the samples. Raises ValueError for a negative threshold and for other shapes.
    """
    signal = samples(v)
    r = np.asarray(thresholds, dtype=np.float64, order="C")
    if r.ndim != 1 or (r < 0.0).any():
        raise ValueError("play thresholds must be a list of nonnegative numbers")
    states = np.full(r.shape, start, dtype=np.float64)
    out = np.empty((len(r), len(signal)))
    _plays_into(signal, r, states, out)
    return out


def play_sum(v: Array, thresholds: Array, start: Array, weights: Array) -> Array:
    """`weights @ plays(v, thresholds, start)`, skipping plays of weight 0."""
    signal = samples(v)
    out = np.empty_like(signal)
    some = np.flatnonzero(weights)
    _play_sum_into(signal, thresholds[some], start[some], weights[some], out)
    return out


def weighted_sum(weights: Array, rows: Array) -> Array:
    """`weights @ rows` (N,), added row by row, skipping rows of weight 0; for plays it equals `play_sum`."""
    out = np.empty(rows.shape[1])
    _weighted_into(weights, rows, out)
    return out


def stop(v: ArrayLike, threshold: float, start: float = 0.0) -> Array:
    """Stop operator: `e_k = clip(e_(k-1) + v_k - v_(k-1), -r, r)`, `e_0 = clip(v_0 - start, -r, r)` (4)(5), corrected.

    Together with the play of the same threshold and start it adds up to the input (26).
    """
    if threshold < 0:
        raise ValueError("a stop threshold must not be negative")
    signal = samples(v)
    out = np.empty_like(signal)
    _stop_into(signal, float(threshold), float(start), 0.0, out)
    return out


def dead_zone(v: ArrayLike, threshold: float) -> NDArray[np.float64]:
    """Dead-zone operator (42): the part of `v` beyond the threshold, on the threshold's own side of zero."""
    x = np.asarray(v, dtype=np.float64)
    if threshold > 0:
        return np.maximum(x - threshold, 0.0)
    if threshold < 0:
        return np.minimum(x - threshold, 0.0)
    return x.copy()
