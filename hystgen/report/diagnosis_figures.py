"""The figures of a diagnosis: the gap after each step, its location, and what it depends on, each with the noise."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import drawing
from hystgen.basics.drawing import label
from hystgen.basics.problems import FACTOR, percent
from hystgen.diagnosis.data.signals import still
from hystgen.diagnosis.findings.content import loop_centre
from hystgen.diagnosis.findings.kinds import Line
from hystgen.diagnosis.search import acceptance
from hystgen.report import panels
from hystgen.report.fit_figures import binned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hystgen.diagnosis import Diagnosis, Signals
    from hystgen.effects.base import Effect

Array = NDArray[np.float64]

BEFORE, AFTER, FLOOR = "#8a929c", drawing.RESIDUAL, drawing.FAULT

WIDE, NARROW = 9.0, 4.2

SHOWN = 2
"""Number of held-out records drawn over time."""

FAR = 25.0
"""Ratio of the largest to the smallest value above which an axis is logarithmic."""

HOLD = 16
"""Minimum number of samples at rest for errors to be drawn over the time since the drive stopped."""

WINDOWS = 12
"""Number of stretches that a record is split into; the rms of each is drawn over the session."""


def steps(found: Diagnosis) -> list[tuple[str, float]]:
    """The stages of the waterfall, with the held-out rms of each."""
    result = found.result
    stages = [("as given", result.gap.as_given.holdout), ("refitted", result.gap.refitted.holdout)]
    return stages + [(f"+ {effect.name}", effect.holdout_after) for effect in result.effects]


def gap(found: Diagnosis, width: float) -> Figure:
    """The reduction in the held-out error at each step, down to the noise."""
    stages, noise = steps(found), found.result.noise_floor
    names = [*(name for name, _ in stages), "noise"]
    values = [*(value for _, value in stages), noise]
    drawn = drawing.figure(width, 1.0 + 0.44 * len(names))
    axes = drawn.subplots()
    positive = [value for value in values if value > 0.0]
    far = bool(positive) and max(positive) > FAR * min(positive)
    least = 0.4 * min(positive) if far else 0.0
    top = max(positive, default=1.0)
    for place, (value, before) in enumerate(zip(values, [values[0], *values[:-1]], strict=True)):
        colour = FLOOR if place == len(values) - 1 else (BEFORE, drawing.MODEL)[place] if place < 2 else AFTER
        removed = 0 < place < len(values) - 1 and before > value
        if far:  # bars begin at zero, which a logarithmic axis does not have
            axes.plot(value, place, "o", color=colour, markersize=9)
            if removed:
                axes.hlines(place, value, before, color=BEFORE, linestyle=":", linewidth=1.4)
        else:
            axes.barh(place, value, height=0.6, color=colour)
            if removed:
                axes.barh(place, before - value, left=value, height=0.6, facecolor="none", edgecolor=BEFORE,
                          linestyle=":", linewidth=1.0)
        said = f"{value:.3g}"
        if 0 < place < len(values) - 1 and before > 0.0:
            change = value / before - 1.0
            many = change >= FACTOR
            changed = f"{percent(change + 1.0)}" if many else f"{100.0 * change:+.0f} %"
            said += f"  ({changed})" if abs(change) >= 0.005 else "  (no change)"
        end = max(value, before if 0 < place < len(values) - 1 else 0.0)
        aside = (8.0 if far else 4.0, 0.0)
        axes.annotate(said, (end, place), aside, textcoords="offset points", va="center", fontsize=9)
    axes.axvline(noise, color=FLOOR, linestyle="--", linewidth=1.2)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    room = 1.4 if width == WIDE else 2.0
    if far:
        drawing.decades(axes, "x")
        axes.set_xlim(least, top * (top / least) ** (0.22 if width == WIDE else 0.6))
    else:
        axes.set_xlim(0.0, room * top)
    axes.set(xlabel=label("rms error, held out", found.result.unit))
    axes.grid(axis="y", visible=False)
    return drawn


def worst(found: Diagnosis) -> list[Signals]:
    """The held-out records with the largest error in the refitted model, the worst first."""
    held = [each for each in found.signals if each.held_out and np.isfinite(each.before).any()]
    return sorted(held, key=lambda each: -_rms(each.before))[:SHOWN]


def overlay(found: Diagnosis, width: float) -> Figure:
    """Measured and predicted motion over time, and the error before and after."""
    shown, unit = worst(found), found.result.unit
    named = bool(found.result.effects)
    drawn = drawing.figure(width, 6.9 * len(shown))
    grid = drawn.subplots(3 * len(shown), 1, height_ratios=(3, 2, 3) * len(shown))
    for top, bottom, stretch, each in zip(grid[::3], grid[1::3], grid[2::3], shown, strict=True):
        top.sharex(bottom)
        top.tick_params(labelbottom=False)
        chosen = drawing.kept(0, len(each.t), each.y, each.before, each.after)
        t = each.t[chosen] - each.t[0]
        top.plot(t, each.y[chosen], label="measured", **drawing.LINES["measured"])
        what = "with the effects" if named else "refitted model"
        if named:
            top.plot(t, (each.y - each.before)[chosen], color=BEFORE, linewidth=0.9, label="refitted")
        top.plot(t, (each.y - each.after)[chosen], label=what, **drawing.LINES["model"])
        top.set(ylabel=label("displacement", unit))
        top.set_title(each.name, pad=8 if width == WIDE else 34)
        drawing.legend_above(top, 3 if width == WIDE else 2)
        if named:
            bottom.plot(t, each.before[chosen], color=BEFORE, linewidth=0.8, label="refitted")
        bottom.plot(t, each.after[chosen], color=AFTER, linewidth=0.8, label=what)
        drawing.noise_lines(bottom, found.result.noise_floor)
        bottom.set(xlabel="time in the record (s)", ylabel=label("error", unit))
        drawing.legend_above(bottom, 3 if width == WIDE else 2)
        lines = [("measured", each.y, drawing.LINES["measured"])]
        lines += [("refitted", each.y - each.before, {"color": BEFORE, "linewidth": 0.9})] if named else []
        lines.append((what, each.y - each.after, drawing.LINES["model"]))
        t = each.t - each.t[0]
        error, pad = each.before if named else each.after, 8.0 if width == WIDE else 34.0
        first, last = panels.stretch_panel(stretch, t, each.v, lines, error, unit, pad)
        stretch.set(xlabel="time in the record (s)")
        drawing.legend_above(stretch, 3 if width == WIDE else 2)
        bottom.axvspan(t[first], t[last - 1], color=drawing.GAP, alpha=0.15, linewidth=0)
    drawn.align_ylabels(grid)
    return drawn


def deviation(found: Diagnosis, width: float) -> Figure:
    """Measured, by speed, and predicted against the drive, with the straight line removed, and the error below: before
    and after side by side on one scale."""
    each, units, unit = worst(found)[0], found.parameters.units, found.result.unit
    sides = _sides(found)
    wide = width == WIDE or len(sides) == 1
    drawn = drawing.figure(width, 6.6 if wide else 12.4)
    shape = (2, len(sides)) if wide else (2 * len(sides), 1)
    grid = drawn.subplots(*shape, sharex=True, squeeze=False)
    tops = grid[0] if wide else grid[: len(sides), 0]
    bottoms = grid[1] if wide else grid[len(sides) :, 0]
    measured = np.where(np.isfinite(each.before), each.y, np.nan)
    line = panels.line_of(each.v, measured)
    speed = np.abs(np.gradient(each.v, each.t))
    fast = panels.fastest([speed])
    whole = [(0, len(each.t))]
    for top, bottom, (key, _, what) in zip(tops, bottoms, sides, strict=True):
        error = getattr(each, key)
        points = panels.by_speed(top, each.v, measured - line, speed, fast, "measured, by speed")
        panels.over_drive(top, each.v, each.y - error - line, whole, what)
        drawing.legend_above(top, 2)
        panels.by_speed(bottom, each.v, error, speed, fast, None)
        drawing.noise_lines(bottom, found.result.noise_floor)
        drawing.legend_above(bottom)
        bottom.set(xlabel=label("drive", units.input))
    for group, name in ((tops, "displacement \N{MINUS SIGN} line"), (bottoms, "error")):
        low, high = min(ax.get_ylim()[0] for ax in group), max(ax.get_ylim()[1] for ax in group)
        for k, ax in enumerate(group):
            ax.set_ylim(low, high)
            if not wide or k == 0:
                ax.set(ylabel=label(name, unit))
    rate = label("speed", f"{units.input}/s" if units.input else "1/s")
    if wide:
        drawn.colorbar(points, ax=grid[:, -1], label=rate, pad=0.02, aspect=50)
    else:
        drawn.colorbar(points, ax=grid[:, 0], label=rate, location="bottom", pad=0.01, aspect=40)
    return drawn


def bode(found: Diagnosis, width: float) -> Figure:
    """Gain and phase from the refitted model's motion to the measured one and to that with the effects, the response of
    the effects by themselves, and their corners."""
    shown = [each for each in found.signals if np.isfinite(each.before).any()]
    given = panels.response((each.t, each.y - each.before, each.y, each.y - each.after) for each in shown)
    drawn = drawing.figure(width, 5.4)
    above, below = drawn.subplots(2, 1, sharex=True)
    parts = _dynamic(found)
    last = 0.5 / min(float(np.median(np.diff(each.t))) for each in shown)
    corners = [each.corner for each in parts if each.corner is not None]
    first = float(given[0][0]) if given is not None else 1e-3 * last
    first = min([first, *(0.1 * corner for corner, _ in corners)])
    hertz = np.geomspace(first, last, 2000)
    responses = [each.response(hertz) for each in parts]
    own = np.prod([one for one in responses if one is not None], axis=0)
    drawing.decades(above, "x", (first, last))
    curves = [] if given is None else [
        (given[0], given[1], {**drawing.LINES["measured"], "marker": ".", "markersize": 4}, "measured"),
        (given[0], given[2], drawing.LINES["model"], "with the effects"),
    ]
    alone = f"{parts[0].name if len(parts) == 1 else 'these effects'} alone"
    curves.append((hertz, own, {"color": drawing.RESIDUAL, "linewidth": 1.0, "linestyle": "--"}, alone))
    for f, h, style, name in curves:
        if np.isfinite(h).any():
            above.plot(f, np.abs(h), label=name, **style)
            below.plot(f, _phase(h), **style)
    drawing.decades(above, "y")
    for axes in (above, below):
        for corner, word in corners:
            axes.axvline(corner, color=drawing.FAULT, linewidth=1.0, linestyle=":")
            if axes is above and first <= corner <= last:
                axes.annotate(f"{word}, {corner:.4g} Hz", (corner, 0.03), xycoords=("data", "axes fraction"),
                              xytext=(3, 0), textcoords="offset points", fontsize=8.5, color=drawing.FAULT)
    above.set(ylabel="gain")
    below.set(xlabel="frequency (Hz)", ylabel="phase (degrees)")
    below.locator_params(axis="y", steps=[1, 1.8, 4.5, 9, 10])
    drawing.legend_above(above, 3 if width == WIDE else 2)
    drawn.align_ylabels()
    return drawn


def _phase(h: NDArray[np.complex128]) -> Array:
    """The phase in degrees, continuous over the frequencies at which it is known."""
    found, known = np.full(len(h), np.nan), np.isfinite(h)
    found[known] = np.degrees(np.unwrap(np.angle(h[known])))
    return found


def _dynamic(found: Diagnosis) -> list[Effect]:
    """Effects that were named and have a frequency response."""
    return [each for each in _named(found) if each.response(np.ones(1)) is not None]


def _named(found: Diagnosis) -> list[Effect]:
    """Effects of the model that were named; those of the model as given are in the refitted one too."""
    names = {effect.name for effect in found.result.effects}
    return [each for each in found.parameters.model.effects if each.name in names]


def stops(found: Diagnosis, width: float) -> Figure:
    """Motion after the drive has stopped, on a logarithmic time axis: measured, with and without the effects."""
    holds, unit = _holds(found), found.result.unit
    wide = width == WIDE
    drawn = drawing.figure(width, 3.6 if wide else 3.0 * len(holds))
    grid = np.ravel(drawn.subplots(*((1, len(holds)) if wide else (len(holds), 1)), sharey=True, squeeze=False))
    for k, (axes, (each, first, last)) in enumerate(zip(grid, holds, strict=True)):
        t = each.t[first + 1 : last] - each.t[first]
        groups = panels.even_in_log(t, PER_HOLD)
        middle = np.array([np.sqrt(t[part][0] * t[part][-1]) for part in groups])
        styles: list[tuple[str, Array, drawing.Style]] = [
            ("measured", each.y, {**drawing.LINES["measured"], "marker": ".", "markersize": 6}),
            ("refitted, without the effect", each.y - each.before, {"color": BEFORE, "linewidth": 1.2}),
            ("with the effect", each.y - each.after, drawing.LINES["model"]),
        ]
        for name, values, style in styles:
            means = np.array([_mean(values[first + 1 : last][part]) for part in groups])
            begun = _mean(means[: max(1, len(means) // 8)])
            axes.plot(middle, means - begun, label=name, **style)
        drawing.decades(axes, "x", (middle[0], middle[-1]))
        axes.set(xlabel="time since the drive stopped (s)")
        axes.set_title(f"{each.name}, {each.t[first] - each.t[0]:.4g} s", fontsize=9.5)
        if not wide or not k:
            axes.set(ylabel=label("motion", unit))
    handles, names = grid[0].get_legend_handles_labels()
    drawn.legend(handles, names, loc="outside upper right", ncols=3 if wide else 1)
    return drawn


PER_HOLD = 40
"""Maximum number of points of a curve after a stop."""

HOLDS = 3
"""Maximum number of holds that are drawn."""


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.mean(known)) if len(known) else float("nan")


def _holds(found: Diagnosis) -> list[tuple[Signals, int, int]]:
    """The longest holds that were compared throughout, held-out ones first."""
    holds = [
        (each, first, last)
        for each in found.signals
        for first, last in still(each.v, max(HOLD, len(each.t) // 200))
        if first and np.isfinite(each.before[first:last]).all()
    ]
    return sorted(holds, key=lambda hold: (not hold[0].held_out, hold[0].t[hold[1]] - hold[0].t[hold[2] - 1]))[:HOLDS]


def applies(found: Diagnosis, name: str) -> bool:
    """Whether there is something to draw in a figure."""
    if name == "bode":
        return bool(_dynamic(found))
    if name == "stops":
        return any(each.creeps for each in _named(found)) and bool(_holds(found))
    return True


def records(found: Diagnosis, width: float) -> Figure:
    """rms error of every record before and after."""
    shown = [each for each in found.signals if np.isfinite(each.before).any()]
    drawn = drawing.figure(width, 1.3 + 0.34 * len(shown))
    axes = drawn.subplots()
    places = np.arange(len(shown), dtype=np.float64)
    values = {key: [_rms(getattr(each, key)) for each in shown] for key in ("before", "after")}
    for key, colour, what in _sides(found):
        axes.plot(values[key], places, "o", color=colour, markersize=6, label=what)
    axes.axvline(found.result.noise_floor, color=FLOOR, linestyle="--", linewidth=1.0, label="noise")
    axes.set_yticks(places, [f"{each.name}{' (held out)' if each.held_out else ''}" for each in shown])
    axes.set_ylim(len(shown) - 0.5, -0.5)  # half a slot beyond the first and the last record
    _range(axes, [*values["before"], *values["after"], found.result.noise_floor], "x")
    axes.set(xlabel=label("rms error", found.result.unit))
    drawing.legend_above(axes, 3)
    return drawn


def against(found: Diagnosis, width: float) -> Figure:
    """Mean and scatter of the error of all records against the variables that it may depend on."""
    shown = [each for each in found.signals if np.isfinite(each.before).any()]
    units, unit = found.parameters.units, found.result.unit
    wide = width == WIDE
    drawn = drawing.figure(width, 7.4 if wide else 14.0)
    grid = np.ravel(drawn.subplots(3, 2, sharey=True) if wide else drawn.subplots(6, 1, sharey=True))
    variables: list[tuple[str, Callable[[Signals], Array], bool]] = [
        (label("drive", units.input), lambda each: each.v, False),
        (label("drive rate", f"{units.input}/s" if units.input else "1/s"),
         lambda each: np.asarray(np.gradient(each.v, each.t)), False),
        (label("displacement", unit), lambda each: each.y, False),
        (label("loop centre", units.input), lambda each: loop_centre(each.v), False),
        ("session time (s)", lambda each: each.t, False),
        ("time since the drive stopped (s)", _since_stop, True),
    ]
    for axes, (name, of, log) in zip(grid, variables, strict=True):
        x = np.concatenate([of(each) for each in shown])
        for key, colour, what in _sides(found):
            e = np.concatenate([getattr(each, key) * (_direction(each) if log else 1.0) for each in shown])
            _binned(axes, x, e, colour, f"{what}, mean \N{PLUS-MINUS SIGN} 1 sd", log)
        drawing.noise_lines(axes, found.result.noise_floor)
        axes.set(xlabel=name)
        if not log:
            axes.locator_params(axis="x", nbins=7 if wide else 5)
    for axes in grid[:: 2 if wide else 1]:
        axes.set(ylabel=label("error", unit))
    drawn_lines = {name: line for axes in grid for line, name in zip(*axes.get_legend_handles_labels(), strict=True)}
    drawn.legend(drawn_lines.values(), drawn_lines, loc="outside upper right", ncols=3 if wide else 1)
    return drawn


def _binned(axes: Axes, x: Array, e: Array, colour: str, what: str, log: bool) -> None:
    known = np.isfinite(e) & np.isfinite(x)
    if np.count_nonzero(known) < 64 or np.ptp(x[known]) == 0.0:
        axes.text(0.5, 0.5, "not in these records", transform=axes.transAxes, ha="center", color=drawing.QUIET)
        return
    place = np.log10(x[known]) if log else x[known]
    low, high = (float(q) for q in np.quantile(place, (0.005, 0.995)))
    middle, mean, spread = binned(place, e[known], low, high if high > low else low + 1.0)
    middle = 10.0**middle if log else middle
    # both end at bins with too few samples; dots keep single bins visible
    axes.fill_between(middle, mean - spread, mean + spread, color=colour, alpha=0.25, linewidth=0)
    axes.plot(middle, mean, color=colour, linewidth=1.5, marker=".", markersize=3.0, label=what)
    if log:
        drawing.decades(axes, "x")


def _since_stop(each: Signals) -> Array:
    """Seconds since the drive came to rest; NaN while it moves."""
    found = np.full(len(each.t), np.nan)
    for first, last in still(each.v, max(HOLD, len(each.t) // 200)):
        found[first + 1 : last] = each.t[first + 1 : last] - each.t[first]
    return found


def _direction(each: Signals) -> Array:
    """1 if the last move of the drive was upwards, -1 if it was downwards."""
    found = np.sign(np.diff(each.v, prepend=each.v[0]))
    tolerance = acceptance.HOLD_DRIVE * float(np.ptp(each.v))
    moved = np.flatnonzero(np.abs(np.diff(each.v, prepend=each.v[0])) > tolerance)
    if not len(moved):
        return np.ones(len(found))
    last = np.searchsorted(moved, np.arange(len(found)), side="right") - 1
    return np.asarray(found[moved[np.maximum(last, 0)]])


def time(found: Diagnosis, width: float) -> Figure:
    """rms error in stretches of the records over the session."""
    shown = sorted((s for s in found.signals if np.isfinite(s.before).any()), key=lambda each: float(each.t[0]))
    one_clock = all(a.t[-1] <= b.t[0] for a, b in itertools.pairwise(shown))
    drawn = drawing.figure(width, 3.4)
    axes = drawn.subplots()
    start, values = 0.0, []
    for number, each in enumerate(shown):
        t = each.t if one_clock else each.t - each.t[0] + start
        start = float(t[-1]) + 0.02 * float(np.ptp(t))
        edges = np.linspace(0, len(t), WINDOWS + 1).astype(int)
        for key, colour, what in _sides(found):
            e = getattr(each, key)
            parts = [(0.5 * (t[a] + t[b - 1]), _rms(e[a:b])) for a, b in itertools.pairwise(edges) if b > a]
            values += [rms for _, rms in parts if np.isfinite(rms)]
            axes.plot(*zip(*parts, strict=True), "-o", color=colour, markersize=2.5, linewidth=1.1,
                      label=None if number else what)
    noise = found.result.noise_floor
    axes.axhline(noise, color=FLOOR, linestyle="--", linewidth=1.0, label="noise")
    _range(axes, values, "y")
    clock = "session time (s)" if one_clock else "time, one record after another (s)"
    axes.set(xlabel=clock, ylabel=label("rms error", found.result.unit))
    drawing.legend_above(axes, 3)
    return drawn


def frequency(found: Diagnosis, width: float) -> Figure:
    """Spectral density of the error of the worst held-out record."""
    each, unit = worst(found)[0], found.result.unit
    step = float(np.median(np.diff(each.t)))
    drawn = drawing.figure(width, 3.8)
    axes = drawn.subplots()
    spectra = [(panels.density(each.t, getattr(each, key)), colour, what) for key, colour, what in _sides(found)]
    for spectrum, colour, what in spectra:
        if spectrum is not None:
            axes.plot(*spectrum, color=colour, linewidth=1.0, label=what)
    floor = found.result.noise_floor * np.sqrt(2.0 * step)
    axes.axhline(floor, color=FLOOR, linestyle="--", linewidth=1.0, label="noise, if white")
    lines = _lines(found, 0.5 / step)
    for line in lines:
        axes.axvline(line, color=drawing.OTHER, linestyle=":", linewidth=1.0)
        axes.annotate(f"{line:.4g} Hz", (line, 1.0), xycoords=("data", "axes fraction"),
                      xytext=(3, -10), textcoords="offset points", fontsize=8, color=drawing.OTHER)
    last = spectra[-1][0]
    drawing.decades(axes, "x", None if last is None else (float(last[0][0]), float(last[0][-1])))
    drawing.decades(axes, "y")
    if last is not None:
        panels.mark_mains(axes, *last, lines)
    axes.set(xlabel="frequency (Hz)", ylabel=label("error density", f"{unit}/\N{SQUARE ROOT}Hz" if unit else None))
    axes.set_title(each.name, pad=8 if width == WIDE else 34)
    drawing.legend_above(axes, 3 if width == WIDE else 2)
    return drawn


def _sides(found: Diagnosis) -> list[tuple[str, str, str]]:
    """The errors to draw: key, colour and name; the errors before are included only if there are effects."""
    before = [("before", BEFORE, "refitted")] if found.result.effects else []
    return [*before, ("after", AFTER, "with the effects" if found.result.effects else "refitted model")]


def _range(axes: Axes, values: Sequence[float], which: str) -> None:
    """An axis from zero, or a logarithmic one if the values are far apart."""
    positive = [value for value in values if value > 0.0]
    if positive and max(positive) > FAR * min(positive):
        drawing.decades(axes, which)
    elif which == "x":
        axes.set_xlim(left=0.0)
    else:
        axes.set_ylim(bottom=0.0)


def _rms(e: Array) -> float:
    known = e[np.isfinite(e)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


FIGURES = {
    "gap": gap, "overlay": overlay, "deviation": deviation, "records": records, "time": time, "against": against,
    "frequency": frequency, "bode": bode, "stops": stops,
}


def caption(found: Diagnosis, name: str) -> str:
    """The caption of a figure: what is drawn in it, and no more."""
    named = bool(found.result.effects)
    return {
        "gap": "rms error on the held-out records: of the model as given, refitted"
        + (", and with one effect after another; dotted: the part that each step removes" if named else "")
        + ". The dashed line is the noise, measured without a model.",
        "overlay": "The held-out records on which the refitted model does worst. Below each: measured minus predicted, "
        "then the stretch with the largest error, shaded, as deviation from the straight line through the record.",
        "deviation": "The held-out record on which the refitted model does worst: over the drive, its deviation from "
        "the straight line through it, and below, the error"
        + (", before and after on one scale" if named else "")
        + ". Colours: how fast the drive moves. Where the colours separate, the error depends on speed.",
        "records": "rms error of every record, against the noise.",
        "time": "rms error in stretches of the records over the session.",
        "against": "Mean and scatter of the error on all records against possible causes. Wherever the mean leaves "
        "the dashed band of the noise, or the scatter widens, the error is not noise; lines end where samples are too "
        "few. Loop centre: midpoint of the last two reversals of the drive. While the drive rests, samples count as "
        "moving in the last direction.",
        "frequency": "Spectral density of the error on the held-out record on which the refitted model does worst. "
        + _mains(found),
        "bode": "Gain and phase from the motion of the refitted model to the measured motion and to that of the model "
        f"with the effects, where at least {100 * panels.FOLLOWS:.0f} % of the motion's power follows; dashed: the "
        "effects by themselves. The refitted model lacks these effects, so the measured curve shows them.",
        "stops": "Motion after the drive has stopped, on a logarithmic time axis, in the longest holds: measured, "
        "and with and without the effect.",
    }[name]


def _mains(found: Diagnosis) -> str:
    each = worst(found)[0]
    spectrum = panels.density(each.t, each.after)
    return "" if spectrum is None else panels.mains_words(*spectrum, _lines(found, float(spectrum[0][-1])))


def _lines(found: Diagnosis, last: float) -> list[float]:
    """Frequencies of the lines that were found, up to `last` Hz."""
    lines = {each.frequency for each in found.result.unexplained if isinstance(each, Line)}
    return sorted(line for line in lines if line < last)


ALTERNATIVES = {
    "gap": "The held-out error after each step, down to the noise.",
    "overlay": "Measured and predicted displacement over time, the error, and the worst stretch enlarged.",
    "deviation": "Deviation of measured and predicted displacement from a straight line over the drive, coloured by "
    "speed, and the error below.",
    "records": "Points for the rms error of every record, with the noise as a line.",
    "time": "rms error over the session, with the noise as a line.",
    "against": "Six panels of binned errors against drive, rate, displacement, loop centre, session time and time "
    "since the drive stopped, with the noise.",
    "frequency": "Spectral density of the error, with that of white noise and the mains marked.",
    "bode": "Gain and phase over frequency, measured, with the effects, and of the effects alone, with their corners.",
    "stops": "Motion after stops of the drive on a logarithmic time axis, measured, and with and without the effect.",
}
