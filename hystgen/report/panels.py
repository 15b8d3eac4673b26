"""Panels that show small differences: the deviation from a straight line by speed, the worst stretch, the spectrum."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import drawing
from hystgen.basics.drawing import label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import PathCollection

Array = NDArray[np.float64]

FASTEST = 0.98
"""[quantile] Faster samples have the last colour, so that a few steps do not leave one colour for all else."""

STRETCHES = 25
"""[of a record] The worst stretch is one of this many: long enough to show the course of the error, short enough that
the motion within does not hide it."""

LEAST = 32
"""[samples] Minimum length of that stretch."""

MAINS, HARMONICS = (50.0, 60.0), 3
"""Frequencies in Hz of the mains, and the number of multiples of each that are marked."""

APART = 2.0
"""[bins] Lines closer than this merge in a spectrum with a Hann window: 50 and 60 Hz are marked if they are at least
this far apart."""

RAISED = 2.5
"""[times] A peak this far above the median of its surroundings is named: white noise has none in 2,000 tries, a line of
0.45 standard deviations of the noise one in all of 50, in 2,048 samples. Set by: tests/test_panels.py."""


def straight_line(x: Array, y: Array) -> tuple[float, float]:
    """Offset and slope of the straight line through y over x by least squares, over samples where both are known."""
    known = np.isfinite(x) & np.isfinite(y)
    if np.count_nonzero(known) < 2 or np.ptp(x[known]) == 0.0:
        return (float(np.mean(y[known])) if known.any() else 0.0), 0.0
    x, y = x[known], y[known]
    middle = float(np.mean(x))
    slope = float(np.dot(x - middle, y) / np.dot(x - middle, x - middle))
    return float(np.mean(y)) - slope * middle, slope


def line_of(x: Array, y: Array) -> Array:
    """That line (N,) at every x."""
    offset, slope = straight_line(x, y)
    return np.asarray(offset + slope * x)


def by_speed(axes: Axes, x: Array, y: Array, speed: Array, fastest: float, name: str | None) -> PathCollection:
    """Samples as points coloured by their speed, from 0 to `fastest`; returns what a colour bar needs."""
    known = np.flatnonzero(np.isfinite(y) & np.isfinite(x) & np.isfinite(speed))
    chosen = known[drawing.sampled(len(known))]
    order = chosen[np.argsort(speed[chosen], kind="stable")]
    return axes.scatter(
        x[order], y[order], c=speed[order], cmap="viridis_r", vmin=0.0, vmax=fastest, s=9.0, linewidths=0,
        rasterized=True, label=name,
    )


def fastest(speeds: Iterable[Array]) -> float:
    """The speed with the last colour."""
    known = np.concatenate([speed[np.isfinite(speed)] for speed in speeds])
    return (float(np.quantile(known, FASTEST)) if len(known) else 0.0) or 1.0


def over_drive(axes: Axes, drive: Array, values: Array, parts: Sequence[tuple[int, int]], name: str) -> None:
    """A thin line over the drive, part by part, broken where values are missing."""
    for k, (start, stop) in enumerate(parts):
        axes.plot(
            drive[start:stop], values[start:stop], color=drawing.MODEL, linewidth=0.9, label=None if k else name,
            rasterized=stop - start > drawing.MOST_POINTS,
        )


def worst_stretch(error: Array) -> tuple[int, int]:
    """The samples [first, last) with the largest rms error of any stretch of that length."""
    length = min(max(LEAST, len(error) // STRETCHES), len(error))
    known = np.isfinite(error)
    squares = np.concatenate([[0.0], np.cumsum(np.where(known, error, 0.0) ** 2)])
    first = int(np.argmax(squares[length:] - squares[:-length]))
    return first, first + length


def stretch_panel(
    axes: Axes, t: Array, drive: Array, lines: Sequence[tuple[str, Array, drawing.Style]], error: Array,
    unit: str | None, pad: float = 8.0,
) -> tuple[int, int]:
    """The worst stretch of `error` with as much before and after it, as deviation from the straight line through the
    first of `lines` over the drive; returns the samples of the stretch. `pad`: points between panel and title."""
    first, last = worst_stretch(error)
    half = (last - first) // 2
    here = slice(max(first - half, 0), min(last + half, len(t)))
    bent = line_of(drive, lines[0][1])
    axes.axvspan(t[first], t[last - 1], color=drawing.GAP, alpha=0.15, linewidth=0)
    for name, values, style in lines:
        chosen = here.start + drawing.kept(0, here.stop - here.start, values[here])
        axes.plot(t[chosen], (values - bent)[chosen], label=name, **style)
    # samples that were not compared may lie far away
    near = np.concatenate([(values - bent)[here][np.isfinite(error[here])] for _, values, _ in lines])
    near = near[np.isfinite(near)]
    if len(near):
        margin = 0.08 * float(np.ptp(near)) or 1.0
        axes.set_ylim(float(near.min()) - margin, float(near.max()) + margin)
    axes.set(ylabel=label("displ. \N{MINUS SIGN} line", unit))
    axes.set_xlim(t[here.start], t[here.stop - 1])
    known = error[first:last][np.isfinite(error[first:last])]
    rms = float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
    axes.set_title(f"Worst stretch: error {rms:.3g}{f' {unit}' if unit else ''} rms", fontsize=9.5, pad=pad)
    return first, last


def runs(t: Array, *values: Array) -> Iterator[slice]:
    """Stretches in which every value is known and the samples are evenly spaced."""
    known = np.all(np.isfinite(np.stack(values)), axis=0)
    step = float(np.median(np.diff(t)))
    joined = known[1:] & known[:-1] & (np.abs(np.diff(t) - step) < 0.5 * step)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], joined, [False])).astype(np.int8)))
    for first, last in edges.reshape(-1, 2):
        yield slice(int(first), int(last) + 1)


def density(t: Array, error: Array) -> tuple[Array, Array] | None:
    """Frequencies and spectral density (1/sqrt(Hz)) of an error, by Welch's method, averaged over the stretches without
    missing samples, which are not joined; None if none has 64 samples."""
    from scipy.signal import welch

    found = sorted(runs(t, error), key=lambda each: each.start - each.stop)
    longest = found[0].stop - found[0].start if found else 0
    if longest < 64:
        return None
    length = longest // 4  # seven windows that half overlap, so that noise has no peaks
    parts = [error[each] for each in found if each.stop - each.start >= length]
    rate = 1.0 / float(np.median(np.diff(t)))
    spectra = [welch(part, rate, nperseg=length) for part in parts]
    total = np.average([power for _, power in spectra], axis=0, weights=[len(part) for part in parts])
    return np.asarray(spectra[0][0][1:]), np.asarray(np.sqrt(total[1:]))


def mains(hertz: Array) -> list[float]:
    """Frequencies of the mains and their multiples that a spectrum resolves; empty if it cannot tell them apart."""
    if abs(MAINS[1] - MAINS[0]) < APART * float(hertz[0]):
        return []
    last = float(hertz[-1]) - APART * float(hertz[0])  # the end of the spectrum is not judged
    return sorted({k * each for each in MAINS for k in range(1, HARMONICS + 1) if k * each < last})


def raised(hertz: Array, values: Array, line: float) -> bool:
    """Whether the spectrum has a peak at `line`: within two bins, above the median of thirty bins around."""
    at = int(np.argmin(np.abs(hertz - line)))
    around = values[max(at - 15, 0) : at + 16]
    return float(np.max(values[max(at - 2, 0) : at + 3])) > RAISED * float(np.median(around))


def mark_mains(axes: Axes, hertz: Array, values: Array, known: Sequence[float] = ()) -> None:
    """Mark the mains in a spectrum with two logarithmic axes: faint lines, and the frequency at a peak and at the
    fundamentals; `known`: frequencies that are already marked."""
    resolved = float(hertz[0])
    for line in mains(hertz):
        if any(abs(line - other) < APART * resolved for other in known):
            continue
        peak = raised(hertz, values, line)
        colour = drawing.FAULT if peak else drawing.IGNORED
        axes.axvline(line, color=colour, linewidth=1.0 if peak else 0.6, linestyle=":", zorder=0)
        if peak or line in MAINS:
            axes.annotate(
                f"{line:g} Hz" if peak else f"{line:g}", (line, 0.02), xycoords=("data", "axes fraction"),
                xytext=(-2, 0), textcoords="offset points", fontsize=8, color=colour, rotation=90, ha="right",
                va="bottom", fontweight="bold" if peak else "normal",
            )


def mains_words(hertz: Array, values: Array, known: Sequence[float] = ()) -> str:
    """A sentence on the mains, for a caption; `known`: as for `mark_mains`."""
    marked = mains(hertz)
    if not marked:
        apart = "the record is too short, or sampled too slowly, to tell the mains (50 or 60 Hz) from other frequencies"
        return f"No mains are marked: {apart}."
    others = [line for line in marked if not any(abs(line - other) < APART * float(hertz[0]) for other in known)]
    peaks = [f"{line:g}" for line in others if raised(hertz, values, line)]
    named = f"{' and '.join(f'{line:.4g}' for line in known)} Hz, found in the records, is named; " if known else ""
    no_peak = f"no {'other ' if known else ''}peak stands out there"
    said = named + (f"a peak stands out at {' and '.join(peaks)} Hz" if peaks else no_peak)
    return f"Dotted: the mains, 50 and 60 Hz, and their multiples up to {marked[-1]:g} Hz; {said}."


def response(
    pairs: Iterable[tuple[Array, Array, Array, Array]]
) -> tuple[Array, NDArray[np.complex128], NDArray[np.complex128]] | None:
    """Frequencies, and responses from the input to the measured and to the modelled output, NaN where the measured
    output does not follow the input.

    `pairs`: for each record t, input, measured and modelled output (N,). The estimate is the cross spectrum over the
    input's spectrum, with Welch's method. None without an even stretch of 256 samples.
    """
    from scipy.signal import csd, welch

    records = list(pairs)
    step = min(float(np.median(np.diff(t))) for t, *_ in records)
    parts = [
        tuple(each[run] for each in signals) for t, *signals in records
        if float(np.median(np.diff(t))) < 1.01 * step
        for run in runs(t, *signals)
    ]
    longest = max((len(part[0]) for part in parts), default=0)
    if longest < 256:
        return None
    length = min(longest, max(256, longest // 8))
    parts = [part for part in parts if len(part[0]) >= length]
    weights = [float(len(part[0])) for part in parts]
    how = {"fs": 1.0 / step, "nperseg": length}
    hertz = np.asarray(welch(parts[0][0], **how)[0][1:])

    def mean(spectra: Sequence[Array]) -> Array:
        return np.asarray(np.average([each[1:] for each in spectra], axis=0, weights=weights))

    own = mean([welch(u, **how)[1] for u, _, _ in parts])
    output = mean([welch(y, **how)[1] for _, y, _ in parts])
    measured, modelled = (mean([csd(part[0], part[k], **how)[1] for part in parts]) for k in (1, 2))
    follows = np.abs(measured) ** 2 >= FOLLOWS * own * output
    gone = np.full(len(hertz), np.nan + 0j)
    return hertz, np.where(follows, measured / own, gone), np.where(follows, modelled / own, gone)


FOLLOWS = 0.8
"""[coherence] Fraction of the output's power that follows the input, below which a response is not drawn: at 0.8, eight
windows give a gain within 13 % (1 sd: `sqrt((1 - c)/(2 n c))` for coherence c and n windows)."""


def even_in_log(t: Array, count: int) -> list[slice]:
    """Groups of samples, evenly spaced in the logarithm of an increasing time t > 0 (N,); none is empty."""
    edges = np.unique(np.searchsorted(t, np.geomspace(t[0], t[-1], count + 1)))
    return [slice(int(a), int(b)) for a, b in itertools.pairwise([*edges[:-1], len(t)])]
