"""The report on an identification: one page, with its figures as separate files."""

from __future__ import annotations

import functools
import hashlib
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ParamSpec

import numpy as np

from hystgen import identification
from hystgen.basics import arguments, drawing, writing
from hystgen.basics.problems import capital, counted, percent
from hystgen.basics.version import __version__
from hystgen.front.dead_zone.model import DeadZone
from hystgen.identification import MODEL_PARSIMONY
from hystgen.identification.fit import HELD_OUT, Fit
from hystgen.identification.quality import WORD_COLUMNS, ErrorRow, cells
from hystgen.model import Model, cascade_of
from hystgen.parameters.files import parameters_sha256
from hystgen.records import Record, Source, in_units, read_records, several
from hystgen.report import fit_figures, panels, plots, properties
from hystgen.report.fit_figures import Shown
from hystgen.report.html import Details, HtmlTable, Listing, Picture, Section, Text, page
from hystgen.report.viewer import Viewed, Viewer

PAGE = "report.html"

P = ParamSpec("P")


def _with_pictures(find: Callable[P, Fit]) -> Callable[P, Fit]:
    @functools.wraps(find)
    def found(*given: P.args, **named: P.kwargs) -> Fit:
        return replace(find(*given, **named), draw=lambda fit: plots.fit_figure(fit, fit.records))

    return found


identify = _with_pictures(identification.identify)
"""`hystgen.identify`: the fit, with a picture to draw."""


def names() -> list[str]:
    """Names of the files in a report."""
    return [PAGE, *(f"{name}.{kind}" for name in fit_figures.FIGURES for kind in ("svg", "png"))]


def check_folder(folder: str | os.PathLike[str]) -> None:
    """Raise PlotError without matplotlib, NotADirectoryError if `folder` is a file."""
    drawing.require()
    target = Path(folder)
    for place in (target, *target.parents):
        if place.exists():
            if not place.is_dir():
                raise NotADirectoryError(f"{place} is a file; give a folder for the report")
            return


def report_fit(
    fit: Fit,
    records: Source | Iterable[Source],
    folder: str | os.PathLike[str],
    holdout: Source | Iterable[Source] = (),
) -> Path:
    """Write the report of a fit: `report.html`, which is self-contained, and its pictures. Returns the page's path.

    `records`, `holdout`: as given to `identify`, in the same order; records read with options such as `columns` must be
    given as `Record`s. Needs matplotlib (extra `plot`). Other files in the folder are left alone. Raises ValueError for
    other records, RecordError, OSError.
    """
    if not isinstance(fit, Fit):
        raise TypeError(f"fit must be a result of hystgen.identify, not {arguments.kind(fit)}")
    sources = [*several(records), *several(holdout)]
    read = in_units(read_records(sources), fit.parameters.units, sources=sources)
    same = [record.name for record in read] == [record.name for record in fit.records]
    return write(fit, fit.records if same else read, folder)  # those of the fit are put right


def write(
    fit: Fit, records: Sequence[Record], folder: str | os.PathLike[str], parameter_file: str | None = None
) -> Path:
    """Write report.html and every picture as SVG and PNG into a folder, either all files or none. Returns the page's
    path.

    `records`: the fitted records, then the held-out ones. `parameter_file`: name used in the command for the next step.
    Raises PlotError without matplotlib, ValueError for records other than those of the fit, OSError.
    """
    check_folder(folder)
    shown = fit_figures.of_fit(fit, records)
    made: dict[str, str | bytes] = {}
    figures = {}
    with drawing.styled():
        for name, draw in fit_figures.FIGURES.items():
            wide = draw(fit, shown, True)
            svg = drawing.content(wide, "svg")
            made |= {f"{name}.svg": svg, f"{name}.png": drawing.content(wide, "png")}
            figures[name] = Picture(
                name, svg, drawing.content(draw(fit, shown, False), "svg"), CAPTIONS[name](fit, shown),
                ALTERNATIVES[name](fit, shown),
            )
    text = page(
        f"{fit.parameters.name}: identification report",
        _verdict(fit, parameter_file or f"{fit.parameters.name}.yaml"),
        _sections(fit, shown, figures),
    )
    return writing.write_files(Path(folder), {PAGE: text.encode("utf-8"), **made})[0]


# Text ----------------------------------------------------------------------------------------------


def _kind(fit: Fit) -> str:
    """A phrase for the kind of model."""
    plays = fit.parameters.model.pi.thresholds
    cascade = cascade_of(fit.parameters)
    count = counted(len(plays) - 1, "play")
    if not cascade.stages:
        return f"A Prandtl-Ishlinskii model with {count}"
    (stage,) = cascade.stages
    if isinstance(stage, DeadZone):
        bends = counted(sum(r != 0.0 for r in stage.thresholds), "bend")
        return f"A generalized Prandtl-Ishlinskii model with {count} behind a dead-zone front with {bends}"
    branches = "two branches" if stage.branches_differ else "one branch"
    return f"A generalized Prandtl-Ishlinskii model with {count} behind a tanh front with {branches}"


def held_out_row(fit: Fit) -> ErrorRow | None:
    """The row with the held-out error; None if nothing was held out."""
    return next((row for row in fit.rows if row.part == "held out"), None)


def _of_range(row: ErrorRow) -> str:
    return percent(row.rms_percent / 100.0, of="the output range")


def _verdict(fit: Fit, parameter_file: str) -> list[Text]:
    row, unit = held_out_row(fit), f" {fit.unit}" if fit.unit else ""
    if row is None:
        own = fit.rows[-1]
        error = (
            f" follows the records it was fitted to within {own.rms:.3g}{unit} rms ({_of_range(own)}); nothing was "
            "held out, so its error on other records is unknown"
        )
    else:
        which = (
            " predicts records it has not seen"
            if row.model == "written"
            else f"; fitted to the first {100 * (1 - HELD_OUT):g} % of the records, such a model predicts the rest"
        )
        error = f"{which} to {row.rms:.3g}{unit} rms, {_of_range(row)}"
        if fit.intervals.held_out is not None:
            low, high = fit.intervals.held_out
            whole = row.output_range or np.inf
            error += (
                f" (95 % interval {low:.3g} to {high:.3g}{unit}, {percent(low / whole)} to "
                f"{percent(high / whole)})"
            )
    problems = cascade_of(fit.parameters).inverse_problems()
    said = [f"{_kind(fit)}{error}; {'it has no inverse' if problems else 'it is invertible'}."]
    if problems:
        said.append("Why there is no inverse: " + "; ".join(problems) + ". It can be used forward.")
    operator = " --operator forward" if problems else ""
    said += [f"Note that {text}." for text in properties.warnings(Model(fit.parameters))]
    if fit.warnings:
        said.append(f"There {'is' if len(fit.warnings) == 1 else 'are'} {counted(len(fit.warnings), 'warning')} below.")
    to_fit, held = ([each.name for each in fit.used if each.held_out is out] for out in (False, True))
    step, command = fit.verdict.next_step(parameter_file, to_fit, held, operator)
    why = "" if fit.verdict.kind == "good" else f"{capital(fit.verdict.why)}. "
    return [*(Text(text) for text in said), Text(f"{why}Your next step: {step}.", command)]


def _sections(fit: Fit, shown: Sequence[Shown], figures: dict[str, Picture]) -> list[Section]:
    yaml, model = Details("Parameter file", fit.text()), Model(fit.parameters)
    return [
        Section("How good it is", _table(fit)),
        Section("Loops", [figures["loop"]]),
        Section("Over time", [figures["time"]]),
        Section("Zoom and read values", _zoom(fit, shown)),
        Section("The residual, and what it depends on", [figures["residual"], figures["spectrum"]]),
        Section("Initial loading curve", [figures["loading"]]),
        Section("Thresholds and weights", [figures["weights"]]),
        Section("What was done to the data", _data(shown)),
        Section("Warnings", [Listing(fit.warnings) if fit.warnings else Text("None.")]),
        Section("Drive range", _range(fit, shown)),
        Section("What the C costs", [Text(properties.cost(model) or "It does not fit the arithmetic.")]),
        Section("Parameters", [yaml]),
        Section("Provenance", _provenance(fit, shown)),
    ]


def _zoom(fit: Fit, shown: Sequence[Shown]) -> list[Viewer]:
    units = fit.parameters.units
    viewed = [
        Viewed(
            each.record.name, fit_figures.role(each), each.time, each.drive, each.measured,
            {"model": np.where(each.used.compared, each.model, np.nan)},
        )
        for each in sorted(shown, key=lambda each: not each.used.held_out)
    ]
    return [Viewer(viewed, (units.input, units.output), fit_figures.noise_of(fit_figures.judged(shown)))]


def _table(fit: Fit) -> list[Text | HtmlTable | Listing]:
    row = held_out_row(fit)
    marked = next((k for k, each in enumerate(fit.rows) if each is row), len(fit.rows) - 1)
    blocks: list[Text | HtmlTable | Listing] = [HtmlTable(cells(fit.rows, fit.unit), WORD_COLUMNS, marked)]
    candidates = [each for each in fit.rows if each.part == "candidate"]
    if candidates and row is not None:
        best = min(each.rms for each in candidates)
        chosen = next(each for each in candidates if each.rms == row.rms)
        blocks.append(
            Text(
                f"{chosen.model} was chosen: it is the simplest candidate whose held-out "
                f"error is within {100 * (MODEL_PARSIMONY - 1):.3g} % of the smallest, {best:.4g}"
                f"{f' {fit.unit}' if fit.unit else ''}."
            )
        )
    return [*blocks, Listing(fit.remarks)]


def _data(shown: Sequence[Shown]) -> list[Text | HtmlTable | Listing]:
    head = (
        "record", "part", "samples", "compared", "start, as asked", "start, memory unknown", "outliers of y",
        "faulty stretches of y", "v bridged", "gaps", "left out between gaps",
    )
    rows = [
        (
            each.used.name,
            fit_figures.role(each),
            *(
                str(number)
                for number in (
                    each.used.samples,
                    np.count_nonzero(each.used.compared),
                    *(len(found) for found in _masks(each)),
                )
            ),
        )
        for each in shown
    ]
    notes = [f"{each.used.name}: {note}" for each in shown for note in each.record.notes]
    blocks: list[Text | HtmlTable | Listing] = [
        HtmlTable([head, *rows], (0, 1)),
        Text(
            "Three kinds of samples are not compared: those at the start, before the drive has wiped an unknown "
            "memory; outliers of y, which are isolated samples far from their neighbours; and faulty stretches, which "
            "are drop-outs, samples held while the drive moves, and a converter at its limit. Isolated samples of v "
            "without a response in y are bridged by a straight line. A record is cut at gaps, after which the memory "
            "is unknown again; every part has a free offset."
        ),
    ]
    return [*blocks, Text("When the records were read:"), Listing(notes)] if notes else blocks


def _masks(each: Shown) -> tuple[Sequence[int], ...]:
    """The samples in a record that the table counts, in the table's order."""
    used = each.used
    outputs = used.skipped, used.ignored, used.outliers, used.stretches
    return tuple(found.tolist() for found in (*outputs, used.bridged, used.gaps, used.left_out))


def _range(fit: Fit, shown: Sequence[Shown]) -> list[Text | HtmlTable]:
    low, high = fit.parameters.input_range
    unit = f" {fit.parameters.units.input}" if fit.parameters.units.input else ""
    rows, beyond = [], 0
    for each in shown:
        drive = each.drive
        outside = int(np.count_nonzero((drive < low) | (drive > high)))
        far = max(low - float(drive.min()), float(drive.max()) - high, 0.0)
        beyond += outside
        rows.append(
            (
                each.used.name, fit_figures.role(each), f"{drive.min():.6g}", f"{drive.max():.6g}", str(outside),
                f"{far:.4g}" if outside else "0", percent(far / (high - low)),
            )
        )
    said = (
        f"The model was fitted on drives from {low:.6g} to {high:.6g}{unit}, and the emitted code keeps its drive "
        "inside this range. "
    )
    said += (
        f"{counted(beyond, 'sample')} of the records below lie outside, where the model is a guess."
        if beyond
        else "No record leaves this range."
    )
    head = (
        "record", "part", f"least{unit and f' [{unit.strip()}]'}", f"largest{unit and f' [{unit.strip()}]'}",
        "samples outside", f"farthest outside{unit and f' [{unit.strip()}]'}", "of the range",
    )
    return [Text(said), HtmlTable([head, *rows], (0, 1))]


def _provenance(fit: Fit, shown: Sequence[Shown]) -> list[Text | HtmlTable]:
    rows = [
        (
            each.used.name, fit_figures.role(each), str(each.used.samples), f"{each.record.sample_time:.4g}",
            f"{each.time[-1]:.4g}", _fingerprint(each.record),
        )
        for each in shown
    ]
    head = ("record", "part", "samples", "sample time [s]", "duration [s]", "SHA-256 of t, v, y")
    made = (
        f"Made by hystgen {__version__}. SHA-256 of the parameters: {parameters_sha256(fit.parameters)[:16]}. The same "
        "records and options give the same page, byte for byte."
    )
    return [Text(made), HtmlTable([head, *rows], (0, 1, 5))]


def _fingerprint(record: Record) -> str:
    """Digest of the values as read, independent of the file format."""
    digest = hashlib.sha256()
    for values in (record.t, record.v, record.y):
        assert values is not None
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()[:16]


# Captions and alternative texts -------------------------------------------------------------------


def _several(shown: Sequence[Shown]) -> str:
    """A sentence for the caption if not all records are drawn."""
    drawn = fit_figures.drawn_ones(shown)
    return " Of several records, the one with the largest error is drawn." if len(drawn) < len(shown) else ""


def _errors(shown: Sequence[Shown], fit: Fit) -> str:
    unit = f" {fit.unit}" if fit.unit else ""
    return ", ".join(
        f"{each.used.name} ({fit_figures.role(each)}) {each.rms:.3g}{unit} rms"
        for each in fit_figures.drawn_ones(shown)
    )


def _loop_caption(fit: Fit, shown: Sequence[Shown]) -> str:
    return (
        "Measured loops and the model's, from a free run over the measured drive with a free offset: "
        f"{_errors(shown, fit)}. Beside each loop, the deviation of the same samples and of the model from the "
        "straight line through the measured ones, which enlarges the difference; colours: how fast the drive moves. "
        f"Only compared samples are drawn.{_several(shown)}"
    )


def _loop_alt(fit: Fit, shown: Sequence[Shown]) -> str:
    errors = _errors(shown, fit)
    return f"Displacement over drive, measured and model, and their deviation from the straight line: {errors}"


def _time_caption(_fit: Fit, shown: Sequence[Shown]) -> str:
    said = []
    drawn: list[str] = []
    for each in fit_figures.drawn_ones(shown):
        skipped, ignored, outliers, stretches, bridged, gaps, left_out = map(len, _masks(each))
        counts = [
            counted(skipped + ignored, "sample") + " ignored at the start",
            counted(outliers, "outlier"),
            counted(bridged, "bridged drive sample"),
            counted(gaps, "gap"),
        ]
        counts += [counted(stretches, "sample") + " in faulty stretches"] if stretches else []
        counts += [counted(left_out, "sample") + " left out between gaps"] if left_out else []
        drawn += ["grey: not compared"] if skipped + ignored + stretches + left_out else []
        drawn += ["yellow: gaps"] if gaps else []
        drawn += ["crosses: outliers"] if outliers else []
        drawn += ["triangles: bridged drive samples"] if bridged else []
        said.append(f"{each.used.name}: {', '.join(counts)}")
    return (
        "Measured and model over time; below, measured minus model where samples were compared, then the stretch "
        "with the largest error, shaded, with as much before and after it, as deviation from the record's straight line"
        f"{''.join(f'; {each}' for each in dict.fromkeys(drawn))}. {'; '.join(said)}.{_several(shown)}"
    )


def _time_alt(fit: Fit, shown: Sequence[Shown]) -> str:
    return f"Displacement over time, measured and model, residual and worst stretch: {_errors(shown, fit)}"


def _residual_caption(fit: Fit, shown: Sequence[Shown]) -> str:
    judged = fit_figures.judged(shown)
    noise = fit_figures.noise_of(judged)
    unit = f" {fit.unit}" if fit.unit else ""
    said = ", ".join(f"{each.used.name} ({fit_figures.role(each)})" for each in judged)
    level = (
        f"The noise, estimated from differences of neighbouring samples, is about {noise:.2g}{unit} (1 sd): a mean "
        "outside that band is structure that the model misses."
        if noise is not None
        else "The noise cannot be estimated from these samples: it is not white, or far below the model error."
    )
    compared = sum(int(np.count_nonzero(each.used.compared)) for each in judged)
    some = f" ({drawing.MOST_POINTS} of {compared} are drawn)" if compared > drawing.MOST_POINTS else ""
    return (
        f"The residual of {said}: samples{some}, their mean and scatter in {fit_figures.BINS} bins. If the mean stays "
        f"at zero, the residual does not depend on the quantity on that axis. {level} The axis of the drive rate shows "
        f"{100 * (1 - fit_figures.TAIL):.3g} % of the samples if a few lie far outside."
    )


def _residual_alt(fit: Fit, shown: Sequence[Shown]) -> str:
    unit = f" {fit.unit}" if fit.unit else ""
    peak = max(float(np.nanmax(np.abs(each.residual))) for each in fit_figures.judged(shown))
    return f"Residual against drive, drive rate, time and displacement; the largest is {peak:.3g}{unit}"


def _spectrum_caption(_fit: Fit, shown: Sequence[Shown]) -> str:
    each = fit_figures.drawn_ones(shown)[-1]
    found = panels.density(each.time, each.residual)
    if found is None:
        return "No spectrum: no 64 samples in a row were compared."
    white = " Dashed: the noise, if it is white." if each.noise is not None else ""
    return f"Spectral density of the residual.{white} {panels.mains_words(*found)}"


def _spectrum_alt(_fit: Fit, shown: Sequence[Shown]) -> str:
    each = fit_figures.drawn_ones(shown)[-1]
    found = panels.density(each.time, each.residual)
    said = f"Spectral density of the residual of {each.record.name} over frequency"
    return said if found is None else f"{said}. {panels.mains_words(*found)}"


def _loading_caption(fit: Fit, _shown: Sequence[Shown]) -> str:
    said = (
        "Output of the model on the first rise of a virgin actuator, with the 95 % band of the bootstrap, and that "
        "band by itself. Loops inside the drive range use the curve up to the dotted line; only the first rise of a "
        "virgin actuator goes further."
    )
    cascade = cascade_of(fit.parameters)
    if cascade.stages:
        said += (
            " The horizontal axis is the input of the plays, that is, the drive behind the front. Below: the front and "
            "the straight line with slope one, and the difference between the two"
        )
        said += ", while the drive rises and while it falls." if cascade.branches_differ else "."
    return said


def _loading_alt(fit: Fit, _shown: Sequence[Shown]) -> str:
    curve = cascade_of(fit.parameters)
    top = max(abs(end) for end in curve.play_range)
    unit = f" {fit.unit}" if fit.unit else ""
    rises = f"Initial loading curve with its 95 % band, rising to {float(curve.pi.loading_curve(top)):.4g}{unit}"
    return rises + ("; the front and its deviation from a straight line" if curve.stages else "")


def _weights_caption(fit: Fit, _shown: Sequence[Shown]) -> str:
    return (
        "Weights against their thresholds; lines: 95 % intervals. p_0 is the part without hysteresis, on a scale "
        "of its own. Neighbouring plays can replace each other: a wide interval of one weight does not make the "
        "loading curve uncertain."
        + (" Thresholds are in the output of the front." if fit.parameters.model.memoryless else "")
    )


def _weights_alt(fit: Fit, _shown: Sequence[Shown]) -> str:
    part = fit.parameters.model.pi
    said = f"Weights as bars with intervals: p_0 is {part.weights[0]:.3g}"
    if len(part.weights) > 1:
        k = int(np.argmax(part.weights[1:])) + 1
        said += (
            f", {counted(len(part.weights) - 1, 'play')} up to a threshold of {part.thresholds[-1]:.3g}, the largest "
            f"weight {part.weights[k]:.3g} at {part.thresholds[k]:.3g}"
        )
    return said


CAPTIONS = {
    "loop": _loop_caption, "time": _time_caption, "residual": _residual_caption, "spectrum": _spectrum_caption,
    "loading": _loading_caption, "weights": _weights_caption,
}
ALTERNATIVES = {
    "loop": _loop_alt, "time": _time_alt, "residual": _residual_alt, "spectrum": _spectrum_alt, "loading": _loading_alt,
    "weights": _weights_alt,
}
