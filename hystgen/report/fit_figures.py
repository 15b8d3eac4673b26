"""The figures of a fit, each laid out for a wide page and for a phone, with the same content."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import drawing
from hystgen.basics.drawing import label
from hystgen.identification import faults
from hystgen.model import cascade_of
from hystgen.report import panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import PathCollection
    from matplotlib.figure import Figure

    from hystgen.identification import Fit, Used
    from hystgen.parameters.schema import Units
    from hystgen.records import Record

Array = NDArray[np.float64]

BINS, FEWEST = 40, 5
"""Number of bins for the residual's mean, and minimum number of samples for a bin to be drawn."""

TAIL, FAR = 0.002, 3.0
"""[quantiles, times] An axis ends at these quantiles if the extremes are this many times farther out."""

AGREE = 1.2
"""Two estimates of the noise that differ by at most this factor agree."""


@dataclass(frozen=True)
class Shown:
    """A record, its compared samples, and the model's output (N,) along it."""

    record: Record
    used: Used
    model: Array

    @cached_property
    def time(self) -> Array:
        """Seconds from the record's first sample."""
        return np.asarray(self.record.t - self.record.t[0])

    @cached_property
    def drive(self) -> Array:
        """The drive, with faulty samples bridged."""
        wrong = np.zeros(len(self.record), dtype=bool)
        wrong[self.used.bridged] = True
        return faults.bridged(self.record.v, wrong)

    @cached_property
    def measured(self) -> Array:
        """The measured output; NaN for faulty samples."""
        assert self.record.y is not None
        y = np.array(self.record.y)
        y[self.used.outliers] = np.nan
        y[self.used.stretches] = np.nan
        return y

    @cached_property
    def residual(self) -> Array:
        """Measured minus model; NaN where not compared."""
        return np.where(self.used.compared, self.measured - self.model, np.nan)

    @property
    def rms(self) -> float:
        """rms of the residual."""
        return float(np.sqrt(np.nanmean(self.residual**2)))

    @cached_property
    def rate(self) -> Array:
        """Drive rate over stretches in which the drive typically moves by half a percent of its range."""
        steps = float(np.mean(np.abs(np.diff(self.drive))))
        reach = int(np.clip(round(0.0025 * float(np.ptp(self.drive)) / steps), 1, max(1, len(self.drive) // 50)))
        rate = np.full(len(self.drive), np.nan)
        for start, stop in self.used.parts:
            middle = np.arange(start, stop)
            before, after = np.maximum(middle - reach, start), np.minimum(middle + reach, stop - 1)
            rate[start:stop] = (self.drive[after] - self.drive[before]) / (self.time[after] - self.time[before])
        return rate

    @property
    def noise(self) -> float | None:
        """Standard deviation of white noise in y; None if the residual is not white on the scale of samples.

        Second differences remove the smooth part of a residual and leave the noise times the square root of 6 (Gasser,
        Sroka and Jennen-Steinmetz, Biometrika 73, 1986, 625-633). The estimates from adjacent samples and from every
        other sample agree only if the noise is white and the rest of the residual is smooth.
        """
        found = []
        for lag in (1, 2):
            parts = [self.residual[a:b] for a, b in self.used.parts]
            second = np.concatenate([e[2 * lag :] - 2.0 * e[lag:-lag] + e[: -2 * lag] for e in parts])
            # the median ignores the few kinks at reversals, which are not noise
            found.append(1.4826 * float(np.nanmedian(np.abs(second))) / np.sqrt(6.0))
        if not 0.0 < max(found) <= AGREE * min(found):
            return None
        return float(found[0])


def of_fit(fit: Fit, records: Sequence[Record]) -> list[Shown]:
    """The records of a fit as drawn, held-out records last, as in `fit.used`."""
    if len(records) != len(fit.used):
        raise ValueError(f"the fit compared {len(fit.used)} records, including the held-out ones, not {len(records)}")
    return [Shown(record, used, fit.along(record, used)) for record, used in zip(records, fit.used, strict=True)]


def drawn_ones(shown: Sequence[Shown]) -> list[Shown]:
    """The fitted record and the held-out record with the largest error."""
    groups = [[each for each in shown if each.used.held_out == held] for held in (False, True)]
    return [max(group, key=lambda each: each.rms) for group in groups if group]


def role(each: Shown) -> str:
    """`fit` or `held out`."""
    return "held out" if each.used.held_out else "fit"


# Panels: one pair of axes each ---------------------------------------------------------------


def loop_panel(axes: Axes, each: Shown, units: Units) -> None:
    """Measured loop and model over the compared samples."""
    for k, (start, stop) in enumerate(each.used.parts):
        here = slice(start, stop)
        known = each.used.compared[here]
        for values, name in ((each.measured, "measured"), (each.model, "model")):
            axes.plot(
                each.drive[here], np.where(known, values[here], np.nan), **drawing.LINES[name],
                label=None if k else name, rasterized=stop - start > drawing.MOST_POINTS,
            )
    axes.set(xlabel=label("drive", units.input), ylabel=label("displacement", units.output))
    axes.set_title(f"{each.record.name} ({role(each)})", pad=20)
    drawing.legend_above(axes)


def deviation_panel(axes: Axes, each: Shown, units: Units, top: float) -> PathCollection:
    """Deviation of measurement, coloured by speed up to `top`, and model from the straight line through the measured
    loop, over the drive; returns what a colour bar needs."""
    measured = np.where(each.used.compared, each.measured, np.nan)
    line = panels.line_of(each.drive, measured)
    points = panels.by_speed(axes, each.drive, measured - line, np.abs(each.rate), top, "measured, by speed")
    model = np.where(each.used.compared, each.model - line, np.nan)
    panels.over_drive(axes, each.drive, model, each.used.parts, "model")
    axes.set(xlabel=label("drive", units.input), ylabel=label("displacement \N{MINUS SIGN} line", units.output))
    axes.set_title("Deviation from the straight line", pad=20)
    drawing.legend_above(axes)
    return points


def _shade(axes: Axes, each: Shown, named: bool) -> None:
    """Samples that were not compared: the start of each part, samples left out, gaps."""
    t = each.time
    step = each.record.sample_time
    masked = np.zeros(each.used.samples + 2, dtype=np.int8)
    for found in (each.used.skipped, each.used.ignored, each.used.stretches, each.used.left_out):
        masked[found + 1] = 1
    starts, ends = np.flatnonzero(np.diff(masked) == 1), np.flatnonzero(np.diff(masked) == -1)
    for k, (a, b) in enumerate(zip(starts, ends, strict=True)):
        axes.axvspan(
            t[a], t[b - 1] + step, color=drawing.IGNORED, alpha=0.25, linewidth=0,
            label="ignored" if named and not k else None,
        )
    for k, g in enumerate(each.used.gaps):
        axes.axvspan(
            t[g - 1], t[g], color=drawing.GAP, alpha=0.3, linewidth=0,
            label="gap" if named and not k else None,
        )


def overlay_panel(axes: Axes, each: Shown, units: Units) -> None:
    """Measured and model over time; samples that were not compared are shaded or marked."""
    _shade(axes, each, True)
    good = each.measured[np.isfinite(each.measured)]
    low, high = float(good.min()), float(good.max())
    margin = 0.06 * (high - low)
    for values, name in ((each.measured, "measured"), (each.model, "model")):
        for k, (start, stop) in enumerate(each.used.parts):
            chosen = drawing.kept(start, stop, values)
            axes.plot(each.time[chosen], values[chosen], **drawing.LINES[name], label=None if k else name)
    axes.set_ylim(low - margin, high + margin)
    t = each.time
    if len(each.used.outliers):
        assert each.record.y is not None
        # outliers beyond the axis are drawn at its edge
        places = np.clip(each.record.y[each.used.outliers], low - 0.7 * margin, high + 0.7 * margin)
        axes.plot(t[each.used.outliers], places, "x", color=drawing.FAULT, markersize=5, label="outlier")
    if len(each.used.bridged):
        places = np.full(len(each.used.bridged), low - 0.7 * margin)
        axes.plot(t[each.used.bridged], places, "^", color=drawing.OTHER, markersize=4, label="drive bridged")
    axes.set(ylabel=label("displacement", units.output))
    axes.set_title(f"{each.record.name} ({role(each)})", pad=20 if len(axes.get_legend_handles_labels()[1]) < 4 else 34)
    drawing.legend_above(axes, 3)


def residual_panel(axes: Axes, each: Shown, units: Units, colour: str = drawing.RESIDUAL) -> None:
    """The residual over time."""
    for k, (start, stop) in enumerate(each.used.parts):
        chosen = drawing.kept(start, stop, each.residual)
        axes.plot(
            each.time[chosen], each.residual[chosen], color=colour, linewidth=0.8,
            label=None if k else f"{each.record.name} ({role(each)})",
        )
    axes.axhline(0.0, color=drawing.QUIET, linewidth=0.6)
    axes.set(xlabel="time (s)", ylabel=label("residual", units.output))


def _against_panel(axes: Axes, x: Array, residual: Array, noise: float | None) -> None:
    """Residuals as points, their mean and scatter in bins of x."""
    known = np.isfinite(residual) & np.isfinite(x)
    x, residual = x[known], residual[known]
    chosen = drawing.sampled(len(x))
    axes.plot(x[chosen], residual[chosen], ".", color=drawing.RESIDUAL, alpha=0.5, markersize=3.0,
              markeredgewidth=0, rasterized=True, label="samples")
    low, high = _limits(x)
    middle, mean, spread = binned(x, residual, low, high)
    axes.fill_between(
        middle, mean - spread, mean + spread, color=drawing.RESIDUAL, alpha=0.25, linewidth=0,
        label="mean \N{PLUS-MINUS SIGN} 1 sd in bins",
    )
    axes.plot(middle, mean, color="#14532d", linewidth=1.6, label="mean in bins", marker="o", markersize=2.2)
    axes.axhline(0.0, color=drawing.QUIET, linewidth=0.6)
    drawing.noise_lines(axes, noise)
    margin = 0.02 * (high - low)
    axes.set_xlim(low - margin, high + margin)


def binned(x: Array, values: Array, low: float, high: float) -> tuple[Array, Array, Array]:
    """Middle (BINS,), mean and standard deviation of the values in even bins of x; NaN in bins with too few values."""
    edges = np.linspace(low, high, BINS + 1)
    inside = (x >= low) & (x <= high)
    place = np.clip(np.searchsorted(edges, x[inside], side="right") - 1, 0, BINS - 1)
    count = np.bincount(place, minlength=BINS)
    enough = count >= FEWEST
    mean, spread = np.full(BINS, np.nan), np.full(BINS, np.nan)
    mean[enough] = np.bincount(place, values[inside], BINS)[enough] / count[enough]
    squares = np.bincount(place, (values[inside] - mean[place]) ** 2, BINS)
    spread[enough] = np.sqrt(squares[enough] / count[enough])
    return (edges[1:] + edges[:-1]) / 2.0, mean, spread


def _limits(x: Array) -> tuple[float, float]:
    """Ends of an axis: the extremes, or quantiles if a few values are far out."""
    low, high = float(x.min()), float(x.max())
    inner_low, inner_high = (float(q) for q in np.quantile(x, (TAIL, 1.0 - TAIL)))
    return (inner_low, inner_high) if high - low > FAR * (inner_high - inner_low) > 0.0 else (low, high)


def weight_panel(axes: Axes, fit: Fit, units: Units, places: Sequence[int]) -> None:
    """Some of the weights as bars labelled with their thresholds, with intervals."""
    part = fit.parameters.model.pi
    at = np.arange(len(places))
    axes.bar(at, [part.weights[k] for k in places], width=0.7, color=drawing.OTHER, alpha=0.75)
    sure = np.array(fit.intervals.weights)[list(places)]
    axes.vlines(at, sure[:, 0], sure[:, 1], color="#1b1f24", linewidth=1.1)
    for ends in sure.T:
        axes.plot(at, ends, "_", color="#1b1f24", markersize=6)
    every = -(-len(places) // 24)
    axes.set_xticks(
        at[::every], [f"{part.thresholds[k]:.3g}" for k in places[::every]], rotation=45 if len(places) > 6 else 0
    )
    axes.grid(axis="x", visible=False)
    axes.set_xlim(-0.7, len(places) - 0.3)
    axes.set_ylim(bottom=0.0)
    per_drive = f"{units.output}/{units.input}" if units.input and units.output else ""
    axes.set(ylabel=label("weight", per_drive))


# Figures ---------------------------------------------------------------------------------------------------


def loop(fit: Fit, shown: Sequence[Shown], wide: bool) -> Figure:
    """Measured and modelled loops for a fitted record and a held-out record, and beside them the same loops with the
    straight line removed, coloured by speed."""
    pair, units = drawn_ones(shown), fit.parameters.units
    rows, columns = (len(pair), 2) if wide else (2 * len(pair), 1)
    figure = drawing.figure(9.6, 4.2 * rows) if wide else drawing.figure(4.4, 3.9 * rows)
    axes = figure.subplots(rows, columns, squeeze=False)
    top = panels.fastest(np.abs(each.rate) for each in pair)
    for left, right, each in zip(axes.flat[::2], axes.flat[1::2], pair, strict=True):
        loop_panel(left, each, units)
        points = deviation_panel(right, each, units, top)
        figure.colorbar(points, ax=right, label=label("speed", per_second(units)), pad=0.02, aspect=30)
    return figure


def time(fit: Fit, shown: Sequence[Shown], wide: bool) -> Figure:
    """Measured and model over time, the residual, and the worst stretch enlarged, for a fitted record and a held-out
    record."""
    pair, units = drawn_ones(shown), fit.parameters.units
    figure = drawing.figure(9.6 if wide else 4.4, 6.4 * len(pair))
    grid = figure.subplots(3 * len(pair), 1, height_ratios=(2, 1, 1.7) * len(pair))
    for above, below, worst, each in zip(grid[::3], grid[1::3], grid[2::3], pair, strict=True):
        above.sharex(below)
        above.tick_params(labelbottom=False)
        overlay_panel(above, each, units)
        _shade(below, each, False)
        residual_panel(below, each, units)
        drawing.noise_lines(below, each.noise)
        below.set_xlim(each.time[0], each.time[-1])
        lines = [(name, values, drawing.LINES[name]) for name, values in (("measured", each.measured),
                                                                          ("model", each.model))]
        first, last = panels.stretch_panel(worst, each.time, each.drive, lines, each.residual, units.output,
                                          8.0 if wide else 20.0)
        worst.set(xlabel="time (s)")
        drawing.legend_above(worst)
        below.axvspan(each.time[first], each.time[last - 1], color=drawing.GAP, alpha=0.15, linewidth=0)
        for ax in (above, below, worst):
            ax.yaxis.set_label_coords(-0.06 if wide else -0.15, 0.5)
    return figure


def residual(fit: Fit, shown: Sequence[Shown], wide: bool) -> Figure:
    """Residual against drive, rate, time and displacement; of the held-out records if there are any."""
    chosen, units = judged(shown), fit.parameters.units
    noise = noise_of(chosen)
    left = np.concatenate([each.residual for each in chosen])
    figure = drawing.figure(9.6, 6.4) if wide else drawing.figure(4.4, 11.0)
    axes = figure.subplots(2, 2, sharey=True) if wide else figure.subplots(4, 1)
    against: list[tuple[Callable[[Shown], Array], str]] = [
        (lambda each: each.drive, label("drive", units.input)),
        (lambda each: each.rate, label("drive rate", per_second(units))),
        (lambda each: each.time, "time (s)"),
        (lambda each: each.measured, label("displacement", units.output)),
    ]
    for k, (ax, (values, name)) in enumerate(zip(axes.flat, against, strict=True)):
        _against_panel(ax, np.concatenate([values(each) for each in chosen]), left, noise)
        ax.set(xlabel=name)
        if not wide or k % 2 == 0:
            ax.set(ylabel=label("residual", units.output))
    known = left[np.isfinite(left)]
    peak = float(np.max(np.abs(known))) if len(known) else 1.0
    for ax in axes.flat:
        ax.set_ylim(-1.08 * peak, 1.08 * peak)
    handles, names = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper right", ncols=4 if wide else 2, markerscale=2)
    return figure


def spectrum(fit: Fit, shown: Sequence[Shown], wide: bool) -> Figure:
    """Spectral density of the residual of the drawn record that judges the model, with the mains."""
    each, unit = drawn_ones(shown)[-1], fit.parameters.units.output
    figure = drawing.figure(9.6 if wide else 4.4, 3.8)
    axes = figure.subplots()
    found = panels.density(each.time, each.residual)
    if found is None:
        axes.text(0.5, 0.5, "fewer than 64 samples in a row", transform=axes.transAxes, ha="center",
                  color=drawing.QUIET)
        return figure
    hertz, values = found
    drawing.decades(axes, "x", (float(hertz[0]), float(hertz[-1])))
    axes.plot(hertz, values, color=drawing.RESIDUAL, linewidth=0.9, label="residual")
    if each.noise is not None:
        floor = each.noise * np.sqrt(2.0 * each.record.sample_time)
        axes.axhline(floor, color=drawing.FAULT, linestyle="--", linewidth=1.0, label="noise")
    drawing.decades(axes, "y")
    panels.mark_mains(axes, hertz, values)
    per_root = f"{unit}/\N{SQUARE ROOT}Hz" if unit else None
    axes.set(xlabel="frequency (Hz)", ylabel=label("residual density", per_root))
    axes.set_title(f"{each.record.name} ({role(each)})", pad=20)
    drawing.legend_above(axes)
    return figure


def per_second(units: Units) -> str:
    """The unit of the drive's rate."""
    return f"{units.input}/s" if units.input else "1/s"


def judged(shown: Sequence[Shown]) -> list[Shown]:
    """The held-out records, or all records if none was held out."""
    return [each for each in shown if each.used.held_out] or list(shown)


def noise_of(shown: Sequence[Shown]) -> float | None:
    """The largest noise in the records; None if it is unknown for any record."""
    found = [each.noise for each in shown]
    known = [sigma for sigma in found if sigma is not None]
    return max(known) if known and len(known) == len(found) else None


def loading(fit: Fit, _shown: Sequence[Shown], wide: bool) -> Figure:
    """Initial loading curve with its band; with a front, also the front and its distance from a straight line."""
    units, cascade = fit.parameters.units, cascade_of(fit.parameters)
    bent = bool(cascade.stages)
    if wide:
        figure = drawing.figure(9.6, 7.0 if bent else 3.8)
        axes = figure.subplots(2, 2) if bent else figure.subplots(1, 2, squeeze=False)
    else:
        figure = drawing.figure(4.4, 3.1 * (4 if bent else 2))
        axes = figure.subplots(4 if bent else 2, 1, squeeze=False)
    curve, band, *front = axes.flat
    r = np.asarray(cascade.pi.thresholds)
    x = np.linspace(0.0, max(abs(end) for end in cascade.play_range), 400)
    middle = cascade.pi.loading_curve(x)
    low, high = fit.intervals.loading_curve(r, x)
    inner = label("input of the plays" if bent else "drive", units.input)
    curve.fill_between(x, low, high, color=drawing.MODEL, alpha=0.3, linewidth=0, label="95 % band")
    curve.plot(x, middle, color=drawing.MODEL, linewidth=1.4, label="loading curve")
    inside = r[r <= x[-1]]
    curve.plot(inside, cascade.pi.loading_curve(inside), "o", color=drawing.MODEL, markersize=3.2, label="thresholds")
    low_end, high_end = cascade.play_range
    for ax in (curve, band):
        ax.axvline((high_end - low_end) / 2.0, color=drawing.QUIET, linewidth=0.9, linestyle=":")
    curve.set(xlabel=inner, ylabel=label("displacement", units.output))
    curve.set_title("Initial loading curve", pad=20)
    drawing.legend_above(curve)
    band.fill_between(x, low - middle, high - middle, color=drawing.MODEL, alpha=0.3, linewidth=0)
    band.axhline(0.0, color=drawing.MODEL, linewidth=1.2)
    band.set(xlabel=inner, ylabel=label("band - curve", units.output))
    band.set_title("Its 95 % band, enlarged", pad=20)
    if bent:
        v = np.linspace(*cascade.input_range, 600)
        branches = [(True, drawing.MEASURED, "drive rising" if cascade.branches_differ else "front")]
        if cascade.branches_differ:
            branches.append((False, drawing.RESIDUAL, "drive falling"))
        for ax, straight, title in ((front[0], 0.0, "Front"), (front[1], 1.0, "Its deviation from the line")):
            for up, colour, name in branches:
                ax.plot(v, cascade.front(v, up) - straight * v, color=colour, linewidth=1.4, label=name)
            ax.plot(v, (1.0 - straight) * v, color=drawing.QUIET, linewidth=0.9, linestyle="--", label="straight line")
            ax.set(xlabel=label("drive", units.input), ylabel=label("front" if not straight else "front - line",
                                                                    units.input))
            ax.set_title(title, pad=20)
        drawing.legend_above(front[0])
    return figure


def weights(fit: Fit, _shown: Sequence[Shown], wide: bool) -> Figure:
    """The weights against their thresholds, with p_0 on an axis of its own."""
    units = fit.parameters.units
    n = len(fit.parameters.model.pi.thresholds) - 1
    figure = drawing.figure(9.6 if wide else 4.4, 3.6)
    if not n:
        weight_panel(figure.subplots(), fit, units, [0])
        return figure
    first, others = figure.subplots(1, 2, width_ratios=(1, 8 if wide else 4))
    weight_panel(first, fit, units, [0])
    weight_panel(others, fit, units, range(1, n + 1))
    first.set_title("p\N{SUBSCRIPT ZERO}")
    others.set_title("plays")
    others.set(xlabel=label("threshold", units.input), ylabel="")
    return figure


FIGURES: dict[str, Callable[[Fit, Sequence[Shown], bool], Figure]] = {
    "loop": loop, "time": time, "residual": residual, "spectrum": spectrum, "loading": loading, "weights": weights,
}
"""All figures, by file name."""
