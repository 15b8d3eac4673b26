"""Preisach: a plane of relays, given by its Everett surface, evaluated through the staircase of remembered extrema."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.arguments import Array, finite, finite_numbers, finite_samples
from hystgen.basics.jit import jit

Places = NDArray[np.int64]
Everett = Callable[[Array, Array], Array]


@jit
def _staircase(v: Array, stack: Places, corner: Places) -> None:
    """The corner at which each sample's move began, as an index into v, negative for a fall.

    The stack holds a minimum, maximum, minimum, ...; v[0] is the lowest possible input, the minimum below all others,
    and no fall begins there.
    """
    depth = 1
    stack[0] = 0
    corner[0] = 0
    for k in range(1, len(v)):
        x = v[k]
        if x > v[k - 1]:
            if depth % 2 == 0:
                stack[depth] = k - 1
                depth += 1
            while depth >= 3 and x >= v[stack[depth - 2]]:
                depth -= 2
        elif x < v[k - 1]:
            if depth % 2 == 1:
                stack[depth] = k - 1
                depth += 1
            while depth >= 4 and x <= v[stack[depth - 2]]:
                depth -= 2
            if depth == 2 and x <= v[0]:
                depth = 1
        corner[k] = stack[depth - 1] if depth % 2 == 1 else -stack[depth - 1]


@jit
def _add_up(corner: Places, change: Array, out: Array) -> None:
    for k in range(1, len(out)):
        out[k] = out[abs(corner[k])] + change[k]


@dataclass(frozen=True)
class EverettTable:
    """Everett surface between grid points: `values[i][j]` is E at alpha = `edges[i]`, beta = `edges[j]`, j <= i.

    `edges`: increasing inputs, at least two; `values`: square, in output units, 0 on the diagonal; values above the
    diagonal are ignored. Bilinear in a cell, linear in the half cells on the diagonal. Raises ValueError for other
    tables, and for points that are not between the edges.
    """

    edges: Sequence[float]
    values: Sequence[Sequence[float]]

    def __post_init__(self) -> None:
        edges = finite_numbers(self.edges, "edges")
        if len(edges) < 2 or any(b <= a for a, b in itertools.pairwise(edges)):
            raise ValueError("edges must be strictly increasing, and at least two")
        given = list(self.values) if np.iterable(self.values) else []
        if len(given) != len(edges):
            raise ValueError(f"{len(edges)} edges but {len(given)} rows")
        if any(np.shape(row) != (len(edges),) for row in given):
            raise ValueError(f"every row has {len(edges)} values")
        below = [finite_numbers(row[: i + 1], "values up to the diagonal") for i, row in enumerate(given)]
        if any(row[-1] != 0.0 for row in below):
            raise ValueError("an Everett table is 0 on the diagonal, where alpha = beta")
        rows = tuple((*row, *[0.0] * (len(edges) - len(row))) for row in below)
        object.__setattr__(self, "edges", edges)
        object.__setattr__(self, "values", rows)

    @classmethod
    def of_density(cls, edges: Sequence[float], density: Everett) -> EverettTable:
        """Table for a density `density(alpha, beta)` of relays, constant in each cell; half a cell on the diagonal."""
        ends = np.asarray(edges, dtype=np.float64)
        middle, size = (ends[1:] + ends[:-1]) / 2.0, np.diff(ends)
        alpha, beta = np.meshgrid(middle, middle, indexing="ij")
        mass = np.tril(density(alpha, beta) * np.outer(size, size))
        mass[np.diag_indices_from(mass)] /= 2.0
        table = np.zeros((len(ends), len(ends)))
        # up to alpha, and from the top down to beta
        table[1:, :-1] = np.cumsum(np.cumsum(mass, axis=0)[:, ::-1], axis=1)[:, ::-1]
        return cls(ends.tolist(), np.tril(table).tolist())

    def __call__(self, alpha: Array, beta: Array) -> Array:
        """E at arrays of points within the edges, alpha >= beta."""
        edges, table = np.array(self.edges), np.array(self.values)
        if not np.all((edges[0] <= beta) & (beta <= alpha) & (alpha <= edges[-1])):
            span = f"{edges[0]:g} to {edges[-1]:g}"
            raise ValueError(f"an Everett table from {span} has no values outside, nor for alpha < beta")
        last = len(edges) - 2
        i = np.clip(np.searchsorted(edges, alpha, side="right") - 1, 0, last)
        j = np.clip(np.searchsorted(edges, beta, side="right") - 1, 0, last)
        f = (alpha - edges[i]) / (edges[i + 1] - edges[i])
        g = (beta - edges[j]) / (edges[j + 1] - edges[j])
        low = (1.0 - g) * table[i, j] + g * table[i, j + 1]
        high = (1.0 - g) * table[i + 1, j] + g * table[i + 1, j + 1]
        return np.asarray(np.where(i == j, (f - g) * table[i + 1, j], (1.0 - f) * low + f * high))


@dataclass(frozen=True)
class Preisach:
    """Sum of relays that switch up at alpha and down at beta <= alpha, computed exactly from the remembered extrema.

    `everett(alpha, beta)`: change in the output when the input rises from beta to alpha, 0 for alpha = beta, increasing
    in alpha and decreasing in beta, a function of two arrays; in output units. `low`, `high`: range of the relays,
    outside which an input changes nothing; `offset`: output with all relays down, as they are before the input visits
    `history`. A rise from the remembered minimum m gives `y = y_m + E(v, m)`, a fall from a maximum M
    `y = y_M - E(M, v)`; an input that passes an extremum wipes it out. Raises ValueError for wrong arguments or a
    surface that is not an Everett surface on 33 x 33 points. Sources: D. H. Everett, A general approach to hysteresis,
    part 4, Trans. Faraday Soc. 51, 1955; I. D. Mayergoyz, Mathematical Models of Hysteresis, Springer, 1991.
    """

    everett: Everett
    low: float
    high: float
    offset: float = 0.0
    history: Sequence[float] = ()

    def __post_init__(self) -> None:
        finite(low=self.low, high=self.high, offset=self.offset)
        if not self.low < self.high:
            raise ValueError(f"low = {self.low} has to be below high = {self.high}")
        object.__setattr__(self, "history", finite_numbers(self.history, "history") if len(self.history) else ())
        places = np.linspace(self.low, self.high, 33)
        alpha, beta = np.meshgrid(places, places, indexing="ij")
        inside = alpha >= beta
        surface = np.zeros_like(alpha)
        surface[inside] = self.everett(alpha[inside], beta[inside])
        slack = 1e-9 * float(np.max(np.abs(surface), initial=0.0))
        if not np.all(np.isfinite(surface)) or np.any(np.abs(np.diag(surface)) > slack):
            raise ValueError("an Everett surface is finite, and 0 for alpha = beta")
        along = np.diff(surface, axis=0)[:, :-1][inside[:-1, :-1]], -np.diff(surface, axis=1)[1:][inside[1:, 1:]]
        if any(np.any(part < -slack) for part in along):
            raise ValueError("an Everett surface increases in alpha and decreases in beta")

    def simulate(self, v: ArrayLike) -> Array:
        """Output (N,) at the inputs `v` (N,); does not depend on time."""
        samples = finite_samples(v)
        before = [self.low, *self.history]
        path = np.clip(np.concatenate([before, samples]), self.low, self.high)
        corner, change, out = np.empty(len(path), dtype=np.int64), np.zeros(len(path)), np.empty(len(path))
        _staircase(path, np.empty(len(path) + 1, dtype=np.int64), corner)
        begun = path[np.abs(corner)]
        sign = np.where(corner >= 0, 1.0, -1.0)
        change = sign * self.everett(np.maximum(path, begun), np.minimum(path, begun))
        out[0] = self.offset
        _add_up(corner, change, out)
        return out[len(before) :]
