"""The page of a plan: the drives to record, their purpose and order, and the command to run afterwards."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, ParamSpec

from hystgen.basics import drawing, writing
from hystgen.basics.drawing import label
from hystgen.basics.problems import counted
from hystgen.basics.version import __version__
from hystgen.planning import header
from hystgen.planning import plan as planning
from hystgen.planning.plan import CODES, MEASURED, RECORDING, WHOLE, lasting
from hystgen.planning.session import FILE as SESSION
from hystgen.planning.waveforms import EDGE
from hystgen.report.html import HtmlTable, Listing, Picture, Section, Text, page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

P = ParamSpec("P")

WIDE, NARROW = (9.0, 5), (4.2, 3)
"""Width in inches, and number of panels side by side."""

FIT, JUDGE = drawing.MEASURED, drawing.MODEL


@dataclass(frozen=True)
class Plan(planning.PlannedDrives):
    """Drive records of one session, in the order in which they are recorded; fields as in `hystgen.planning.plan`."""

    def write(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write the CSV files and `plan.html`, which explains them, into a folder, either all files or none; returns
        the paths.

        Raises PlotError without matplotlib, OSError.
        """
        made = {**self.tables(), "plan.html": html(self, folder)}
        return writing.write_files(Path(folder), {name: made[name].encode("utf-8") for name in self.names})


def _with_page(make: Callable[P, planning.PlannedDrives]) -> Callable[P, Plan]:
    @functools.wraps(make)
    def made(*given: P.args, **options: P.kwargs) -> Plan:
        plain = make(*given, **options)
        return Plan(**{each.name: getattr(plain, each.name) for each in fields(plain)})

    return made


plan = _with_page(planning.plan)
"""`hystgen.plan`: the drives, with the page that explains them."""


def html(plan: Plan, folder: str | os.PathLike[str]) -> str:
    """The page for drives in `folder`. Raises PlotError without matplotlib."""
    with drawing.styled():
        wide, narrow = (drawing.content(_drives(plan, *size), "svg") for size in (WIDE, NARROW))
    figure = Picture("drives", wide, narrow, CAPTION, ALTERNATIVE)
    home = os.fspath(folder).rstrip("/\\")
    lead = [
        Text(f"Drives that separate all effects. {plan.sentence()}"),
        Text(f"When {_measured(plan, home)}, run:", plan.command(folder)),
    ]
    purposes = [f"{drive.name}: {drive.purpose} Distinguishes: {', '.join(drive.shows)}." for drive in plan.drives]
    sections = [
        Section("What to do", [Listing(_steps(plan, home))]),
        Section("The drives", [figure, _times(plan)]),
        Section("Purpose of each drive", [Listing(purposes)]),
        Section("Limits", [Listing([*_kept(plan), *_limits(plan)])]),
        Section("Provenance", [Text(f"hystgen {__version__}; the same parameter file gives the same drives.")]),
    ]
    return page(f"{plan.parameters.name}: drives for a diagnosis", lead, sections)


def _unit(plan: Plan) -> str:
    return f" {plan.parameters.units.input}" if plan.parameters.units.input else ""


def _rate(plan: Plan, rate: float) -> str:
    return f"{rate:.4g}{_unit(plan) or ' 1'}/s"


def _measured(plan: Plan, home: str) -> str:
    if plan.session is not None:
        return f"the recording of the session is {home}/{RECORDING}"
    return f"the measured records are in {home}/{MEASURED}"


def _steps(plan: Plan, home: str) -> list[str]:
    unit = _unit(plan)
    top, bottom = (f"{value:g}{unit}" for value in plan.history)
    if plan.session is not None:
        return _played(plan, home, top, bottom)
    return [
        f"Before the first record go to {top}, then to {bottom}. Every record ends with the same two moves, so "
        f"--history={','.join(map(repr, plan.history))} holds for all.",
        f"Record them in the order of their numbers. Rest {plan.rest:g} s at {bottom} before each, or longer.",
        "t is one session clock for all records: keep its true readings, rests included. They show drift, heat and "
        "ageing.",
        f"Store each record as {home}/{MEASURED}/ and its name, with columns t, v and the displacement y; log "
        "temperature (degC) as a further column if there is a thermometer.",
        "Let v be the drive as measured at the time of y. A generator that holds each value until the next is half a "
        "sample late, and a commanded v would show that as a delay.",
    ]


def _played(plan: Plan, home: str, top: str, bottom: str) -> list[str]:
    """Instructions for a session at one rate."""
    session, samples = plan.session, plan.session.samples if plan.session else 0
    assert session is not None
    said = [
        f"Go to {bottom} slowly, then play {WHOLE} at {session.rate:g} Hz to its end: {samples} samples in "
        f"{lasting(plan.duration)}. It goes to {top} and {bottom} first, which is the history of the first record, and "
        f"rests {plan.rest:g} s before each.",
        f"Record drive and displacement throughout into one file, {home}/{RECORDING}, with columns t, v and y, at "
        "this rate or another. It may start before the drive; the first rise aligns the two.",
        f"{SESSION} says at which sample each record begins and which are held out; diagnose cuts the recording there.",
        "Let v be the drive as measured at the time of y. A converter that holds each value until the next is half a "
        "sample late, and a commanded v would show that as a delay.",
    ]
    if plan.dac is not None:
        size, corners = samples * plan.dac.bytes, header.nodes(plan.stretches)
        said.insert(
            1,
            f"{CODES} has the same drive as one code per line: {samples} codes, {size / 1e6:.3g} MB of memory at "
            f"{counted(plan.dac.bytes, 'byte')} each. The files of the single records have their codes in the column "
            f"code. For firmware, {header.file(plan.parameters)} has the {len(corners)} codes between which the drive "
            f"is linear, {len(corners) * plan.dac.bytes / 1e3:.3g} kB.",
        )
    return said


def _times(plan: Plan) -> HtmlTable:
    rows = [["record", "role", "starts at", "lasts", "samples", "one every", "fastest"]]
    for drive in plan.drives:
        rows.append(
            [
                drive.name,
                "held out" if drive.held_out else "fit",
                f"{drive.t[0]:.1f} s",
                lasting(float(drive.t[-1] - drive.t[0])),
                str(len(drive.t)),
                f"{drive.sample_time:.4g} s",
                _rate(plan, drive.fastest),
            ]
        )
    return HtmlTable(rows, (0, 1))


def _kept(plan: Plan) -> list[str]:
    unit = _unit(plan)
    top, bottom = (f"{value:g}{unit}" for value in plan.history)
    steps = "" if plan.dac is None else ", except for steps of one code"
    kept = f"No record goes below {bottom} or above {top}, and none changes faster than "
    resolution = [] if plan.dac is None else [plan.dac.sentence(unit, plan.history[0] - plan.history[1])]
    return [*plan.defaults, f"{kept}{_rate(plan, plan.max_rate)}{steps}.", *resolution]


def _limits(plan: Plan) -> list[str]:
    fast, fastest = min(drive.corner_time for drive in plan.drives), max(drive.fastest for drive in plan.drives)
    said = [
        f"Cannot be seen: a slew limit above {_rate(plan, fastest)}, since no record is faster.",
        f"Cannot be seen: a resonance above {1.0 / (EDGE * fast):.3g} Hz, and lags and delays far below {fast:.3g} s, "
        "since no record is sampled more often.",
        f"Not separable from drift: creep with time constants far above {lasting(plan.duration)}, the whole session.",
    ]
    if fast > 1.5 * plan.sample_time:
        said.append(
            f"Fast records are sampled every {fast:.3g} s, not every {plan.sample_time:g} s, because of the time it "
            "takes to cross the range at this rate limit. A higher --max-rate shows more in less time."
        )
    return said


def _drives(plan: Plan, width: float, columns: int) -> Figure:
    rows = -(-len(plan.drives) // columns)
    drawn = drawing.figure(width, 1.55 * rows + 0.3)
    grid = drawn.subplots(rows, columns, sharey=True, squeeze=False)
    for axes, drive in zip(grid.flat, plan.drives, strict=False):
        chosen = drawing.kept(0, len(drive.t), drive.v)
        seconds = drive.t[chosen] - drive.t[0]
        scale, unit = (1e3, "ms") if seconds[-1] < 1.0 else (1.0, "s")
        axes.plot(scale * seconds, drive.v[chosen], color=JUDGE if drive.held_out else FIT, linewidth=0.8)
        number, _, name = drive.name.removesuffix(".csv").partition("_")
        axes.set_title(f"{number} {name.replace('_', ' ')}", fontsize=8.5)
        axes.set_xlabel(f"time ({unit})", fontsize=8, labelpad=1)
        axes.tick_params(labelsize=7.5)
    for axes in list(grid.flat)[len(plan.drives) :]:
        axes.set_axis_off()
    drawn.supylabel(label("drive", plan.parameters.units.input), fontsize=9)
    return drawn


CAPTION = "All drives in recording order, each on its own time axis; blue: to fit, orange: held out, to judge."

ALTERNATIVE = "A panel for every record: its drive over time, with the names of the records as titles."
