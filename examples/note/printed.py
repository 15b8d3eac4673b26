"""The note's examples with the printed numbers, and the helpers shared by the modules that draw its figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import hystgen
from hystgen import PI, Cascade, DeadZone, TanhEnvelope
from hystgen.basics import drawing

Array = NDArray[np.float64]

STAGE_1 = hystgen.load(Path(__file__).with_name("example_1.yaml"))
EXAMPLE_1 = STAGE_1.cascade.pi
ESTIMATE_2 = PI(
    [0, 0.4678, 0.9178, 1.3678, 1.8178, 2.2678, 2.7178], [0.7536, 0.6192, 0.4835, 0.3637, 0.2464, 0.1410, 0.0184]
)
R_4 = 0.45 * np.arange(7)
PI_4 = PI(R_4.tolist(), (0.65 * np.exp(-7.75e-4 * R_4)).tolist())
RHO_4 = [0.4, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.25, 2.5, 2.75, 3]
ETA_4 = [-1.128, -1.116, -0.793, -0.598, -0.413, -0.271, -0.172, -0.106, -0.066, -0.041, -0.025]
DEAD_ZONE_4 = DeadZone([*(-r for r in RHO_4[::-1]), 0, *RHO_4], [*ETA_4[::-1], 4.765, *ETA_4])
ENVELOPE_6 = TanhEnvelope((6.0, 0.4, 0.0, 0.0))
EXAMPLE_4 = Cascade(PI_4, (DEAD_ZONE_4,), 0.0, (-5.0, 5.0))
EXAMPLE_6 = Cascade(PI_4, (ENVELOPE_6,), 0.0, (-5.0, 5.0))

TIME = np.linspace(0.0, 2.0, 2001)
"""Seconds; two periods of 1 Hz."""
ROUNDING = 2.0**-53
"""Maximum error of one rounding, as a share of its result."""
INPUT, OUTPUT = "input units", "output units"
DRIVE, ANSWER, REFERENCE = f"input $v$ ({INPUT})", f"output $y$ ({OUTPUT})", f"reference $u$ ({OUTPUT})"
FIRST, SECOND, THIRD, DIM = drawing.MEASURED, drawing.MODEL, drawing.RESIDUAL, drawing.IGNORED


class MismatchError(AssertionError):
    """A computed number differs from the expected one."""


def sine(amplitude: float, frequency: float = 1.0) -> Array:
    """`amplitude sin(2 pi f t)` at the times of all figures."""
    return np.asarray(amplitude * np.sin(2.0 * np.pi * frequency * TIME))


def check(what: str, values: ArrayLike, printed: str, off: ArrayLike = 0.0) -> None:
    """Raise MismatchError unless every value rounds to the printed number (decimal text, separated by spaces).

    `off`: further difference allowed where the note computed with more digits than it prints.
    """
    found, texts = np.atleast_1d(np.asarray(values, dtype=np.float64)), printed.split()
    allowed = np.broadcast_to(np.asarray(off, dtype=np.float64), found.shape)
    if len(found) != len(texts):
        raise MismatchError(f"{what}: {len(found)} values, but {len(texts)} are printed")
    for k, (value, text, more) in enumerate(zip(found.tolist(), texts, allowed.tolist(), strict=True)):
        half = 0.5 * 10.0 ** -len(text.partition(".")[2])
        # the printed number and the difference are rounded, too
        if not abs(value - float(text)) <= half + 2.0 * ROUNDING * abs(float(text)) + more:
            raise MismatchError(f"{what}, entry {k}: computed {value:.6g}, printed {text}")


def close(what: str, values: ArrayLike, expected: ArrayLike, tolerance: float) -> None:
    """Raise MismatchError unless the values are the expected ones to the (absolute) tolerance."""
    worst = float(np.max(np.abs(np.asarray(values) - np.asarray(expected))))
    if not worst <= tolerance:
        raise MismatchError(f"{what}: off by {worst:.3g}, more than {tolerance:.3g}")


def coarse(x: ArrayLike) -> Array:
    """The nearest multiples of 2^-20, whose sums and differences are exact."""
    return np.asarray(np.round(np.asarray(x) * 2.0**20) / 2.0**20)


def rounded(count: float, size: ArrayLike) -> float:
    """Maximum error of `count` roundings of numbers up to `size`."""
    return float(count * 2.0**-53 * np.max(np.abs(size)))


def summed(pi: PI, v: ArrayLike) -> float:
    """Maximum difference between two sums of plays due to rounding: each term has a difference, a product and a sum."""
    return rounded(2 * 3 * (pi.n + 1), pi.slopes[-1] * np.max(np.abs(v)))


def inverted(pi: PI, u: ArrayLike) -> float:
    """Maximum error of the inverse of a play sum due to rounding: each term has a difference, a product and a sum, and
    so do its weight and threshold."""
    return rounded(6 * (pi.n + 1), np.sum(np.abs(pi.inverse().weights)) * np.max(np.abs(u)))


def cancelled(model: PI | Cascade, u: ArrayLike, v: ArrayLike) -> float:
    """How far rounding may take the composition of a model and its inverse from the identity, for the reference u and
    the drive v.

    No output changes by more than the last slope times the error of the plays' input; a front and its inverse add
    roundings of the input, times the largest slope, and of the output.
    """
    pi, front = (model, 0.0) if isinstance(model, PI) else (model.pi, rounded(8, model.front(v)))
    if isinstance(model, Cascade):
        front += rounded(8, model.front_slopes[1] * np.asarray(v))
    last = pi.slopes[-1]
    return last * (inverted(pi, u) + front) + rounded(3 * (pi.n + 1), last * np.max(np.abs(u)))


def spread(function: Callable[[Array], ArrayLike], numbers: Sequence[float], half: ArrayLike) -> Array:
    """How far the results of `function` may change, to first order, if each number changes by up to `half`."""
    x = np.asarray(numbers, dtype=np.float64)
    middle = np.asarray(function(x))
    moved = np.broadcast_to(np.asarray(half, dtype=np.float64), x.shape)
    return np.asarray(sum(np.abs(np.asarray(function(x + step)) - middle) for step in np.diag(moved)))


def panels(count: int, columns: int = 2) -> tuple[Any, list[Any]]:
    """A figure with `count` plot areas, lettered as in the note, `columns` in a row."""
    rows = -(-count // columns)
    drawn = drawing.figure(5.2 * columns, 3.7 * rows)
    areas = [drawn.add_subplot(rows, columns, k + 1) for k in range(count)]
    return drawn, areas


def describe(axes: Any, letter: str, title: str, x: str, y: str, legend: bool = False) -> None:
    """Set a title with the panel's letter, axis labels with units, and the legend where it hides nothing."""
    axes.set(title=f"({letter}) {title}", xlabel=x, ylabel=y)
    if legend:
        axes.margins(y=0.12)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=4, handlelength=1.6, columnspacing=1.4)


def save(folder: Path, name: str, drawn: Any) -> None:
    """Write the figure as SVG."""
    (folder / f"{name}.svg").write_bytes(drawing.content(drawn, "svg"))
