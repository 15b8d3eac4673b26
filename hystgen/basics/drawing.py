"""The common basis of all figures: colours, labels, thinned lines, and files with reproducible bytes.

matplotlib is imported only when a figure is drawn; its settings and the user's stay unchanged.
"""

from __future__ import annotations

import io
import logging
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments, extras
from hystgen.basics.writing import write_atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

MEASURED, MODEL, RESIDUAL, OTHER = "#1f5a99", "#c2410c", "#3f7d3a", "#5b4a91"
IGNORED, GAP, FAULT, QUIET = "#8a929c", "#e0a526", "#b01030", "#6b7280"

Style = dict[str, Any]

LINES: dict[str, Style] = {
    "measured": {"color": MEASURED, "linewidth": 2.2, "alpha": 0.45},
    "model": {"color": MODEL, "linewidth": 0.9, "alpha": 1.0},
}
"""The model is a thin line drawn over a broad one for the measurement, so both stay visible."""

STYLE = {
    "svg.hashsalt": "hystgen",
    "text.parse_math": False,  # names of records may contain dollars
    "axes.grid": True,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#4b5563",
    "axes.titlesize": 11,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelsize": 10,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "agg.path.chunksize": 20000,
    "savefig.dpi": 110,
}

BLOCKS = 1000
"""Number of blocks into which a line is divided for thinning; the extremes of each block are kept."""

MOST_POINTS = 4000
"""Longer lines that cannot be thinned become pixels in an SVG; also the maximum number of points in a scatter plot."""

KINDS = (".png", ".svg")


class PlotError(ValueError):
    """A plot that cannot be drawn or saved."""


def check_path(path: str | os.PathLike[str]) -> None:
    """Raise PlotError for a file type that cannot hold a plot."""
    target = Path(path)
    if target.suffix.lower() not in KINDS:
        raise PlotError(f"{target}: a plot is a .png or .svg file")
    if not target.parent.is_dir():
        raise PlotError(f"{target}: the folder does not exist")
    require()


def picture(draw: Callable[[], Figure], path: str | os.PathLike[str] | None = None) -> Figure:
    """The figure that `draw` makes, in the common style; also saved to `path`, if given, all or nothing.

    Raises PlotError.
    """
    if path is not None:
        check_path(arguments.path("path", path))
    with styled():
        drawn = draw()
        if path is not None:
            write_atomically(path, content(drawn, Path(path).suffix.lower()[1:]))
    return drawn


def require() -> None:
    """Raise PlotError if matplotlib is not installed."""
    try:
        with _quiet():
            _import()
    except ImportError:
        raise PlotError(f"plots need matplotlib; install it with: {extras.install('plot')}") from None


def _import() -> None:
    """Import matplotlib. Raises ImportError.

    MPLBACKEND, set by a notebook, may name a backend that this environment lacks; the import would then fail. Figures
    written to files need no backend, so the named one, if it exists, is selected afterwards, for the user's figures.
    """
    backend = None if "matplotlib" in sys.modules else os.environ.pop("MPLBACKEND", None)
    try:
        import matplotlib
    finally:
        if backend is not None:
            os.environ["MPLBACKEND"] = backend
    if backend:
        with suppress(ValueError):
            matplotlib.rcParams["backend"] = backend


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence matplotlib's message about moving its caches when the home folder is read-only."""
    logger = logging.getLogger("matplotlib")
    before = logger.level
    if before == logging.NOTSET:
        logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(before)


@contextmanager
def styled() -> Iterator[None]:
    """Context for drawing and saving in the common style, whatever matplotlib's settings. Raises PlotError."""
    require()
    with _quiet():
        from matplotlib import figure, style  # noqa: F401  # so that forks of this process need not import them
        from matplotlib.backends import backend_svg  # noqa: F401

        with style.context(["default", STYLE]):
            yield


def figure(width: float, height: float) -> Figure:
    """An empty figure; width and height in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def content(drawn: Figure, kind: str) -> bytes:
    """The bytes of a PNG or SVG (`kind`) of a figure, without date or version."""
    engine = drawn.get_layout_engine()
    if engine is not None:  # savefig would draw everything a second time for the layout
        engine.execute(drawn)
        drawn.set_layout_engine(None)
        # the solver's last bits vary from run to run, and names of clip paths in an SVG depend on them
        for axes in drawn.axes:
            x, y, width, height = (round(float(place), 7) for place in axes.get_position(original=True).bounds)
            axes.set_position((x, y, width, height))
    out = io.BytesIO()
    metadata = {"Software": None} if kind == "png" else dict.fromkeys(("Date", "Creator", "Format", "Type"))
    drawn.savefig(out, format=kind, metadata=metadata)
    return out.getvalue()


def label(what: str, unit: str | None) -> str:
    """An axis label such as `drive (V)`, without parentheses if there is no unit."""
    return f"{what} ({unit})" if unit else what


def noise_lines(axes: Axes, noise: float | None) -> None:
    """Draw lines one standard deviation of the noise above and below zero, or nothing if the noise is unknown."""
    if noise is None:
        return
    for side, name in ((noise, "noise, \N{PLUS-MINUS SIGN} 1 sd"), (-noise, None)):
        axes.axhline(side, color=FAULT, linewidth=1.0, linestyle="--", label=name)


def decades(axes: Axes, which: str, limits: tuple[float, float] | None = None) -> None:
    """Make an axis logarithmic, with few plain numbers; `limits`: its ends, by default those of the drawn data."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axes.set(**{f"{which}scale": "log"})
    if limits is not None:
        axes.set(**{f"{which}lim": limits})
    axis = axes.xaxis if which == "x" else axes.yaxis
    low, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    subs = (1.0, 2.0, 5.0) if high < 200.0 * low else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs, numticks=8))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def legend_above(axes: Axes, columns: int = 3) -> None:
    """Place the legend above the plot area, where it hides nothing."""
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, borderaxespad=0.1, handlelength=1.4,
        columnspacing=1.2,
    )


def kept(start: int, stop: int, *signals: Array, blocks: int = BLOCKS) -> NDArray[np.intp]:
    """Indices from start to stop that suffice to draw the same lines: each block's extremes of every signal."""
    count = stop - start
    if count <= 4 * blocks:
        return np.arange(start, stop)
    edges = np.linspace(0, count, blocks + 1).astype(int)
    found = [np.array([0, count - 1])]
    for signal in signals:
        part = signal[start:stop]
        for sign in (1.0, -1.0):
            # a block of NaNs keeps its first sample
            values = np.where(np.isnan(part), -np.inf, sign * part)
            peak = np.maximum.reduceat(values, edges[:-1])
            at_peak = np.flatnonzero(values == np.repeat(peak, np.diff(edges)))
            found.append(at_peak[np.searchsorted(at_peak, edges[:-1])])
    return np.asarray(start + np.unique(np.concatenate(found)))


def sampled(count: int) -> NDArray[np.intp]:
    """Indices of a fair sample of many points, spread evenly but not periodically, to avoid beats with the signal."""
    if count <= MOST_POINTS:
        return np.arange(count)
    golden = (np.sqrt(5.0) - 1.0) / 2.0
    return np.asarray(np.unique((np.arange(MOST_POINTS) * golden % 1.0 * count).astype(np.intp)))
