"""Cases on disk: files for the workflow in one folder, the labels in another."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import refit, rivals
from .case import REPORT, SHOWN, VISIBLE, Case, make
from .plant import Plant
from .session import Given


def generate(task: tuple[str, int, int, bool, str, Sequence[Given]]) -> str:
    """Make and write the case of (kind, seed, samples per record, with rivals, folder, drives); returns its name."""
    kind, seed, samples, with_rivals, folder, given = task
    return write(make(kind, seed, samples, given), Path(folder), with_rivals).name


def write(case: Case, folder: Path, with_rivals: bool = True) -> Path:
    """Write `cases/NAME/` with records, params.yaml and session.json, and `labels/NAME.json`. Returns `cases/NAME/`."""
    home = folder / "cases" / case.name
    home.mkdir(parents=True, exist_ok=True)
    names = []
    for number, columns in enumerate(case.measured, 1):
        names.append(f"r{number:02d}.csv")
        rows = zip(*(x.tolist() for x in columns.values()), strict=True)
        digits = ",".join("%.12g" for _ in columns)
        text = "\n".join([",".join(columns), *(digits % row for row in rows)])
        (home / names[-1]).write_text(text + "\n", newline="\n")
    held_out = [record.held_out for record in case.session.records]
    spec = {
        "fit": [name for name, out in zip(names, held_out, strict=True) if not out],
        "holdout": [name for name, out in zip(names, held_out, strict=True) if out],
        "history": list(case.session.history) if case.session.history else None,
        "rest": case.session.rest,
    }
    (home / "session.json").write_text(json.dumps(spec, indent=1) + "\n")
    (home / "params.yaml").write_text(parameters(case))
    labels = folder / "labels"
    labels.mkdir(exist_ok=True)
    (labels / f"{case.name}.json").write_text(json.dumps(label(case, with_rivals), indent=1) + "\n")
    return home


def parameters(case: Case) -> str:
    """The nominal model in the package's parameter format."""
    stand, model = case.session.bench, case.nominal
    return "\n".join(
        [
            "hystgen: 1",
            "name: stage",
            "units: {input: V, output: um}",
            f"input_range: [{stand.low!r}, {stand.high!r}]",
            "model:",
            "  pi:",
            f"    thresholds: [{', '.join(map(repr, model.thresholds))}]",
            f"    weights: [{', '.join(map(repr, model.weights))}]",
            f"  output_offset: {model.offset!r}",
            "",
        ]
    )


def label(case: Case, with_rivals: bool = True) -> dict[str, Any]:
    """The truth about a case. Lengths of displacement are in output units.

    `ratio`: unabsorbed rms over noise rms; `ratio_holdout`, `ratio_fit`: the same for the held-out records, and for the
    others after a refit to only these.
    """
    noise = case.noise()
    effects = []
    for item in case.present:
        against = compared(case, Plant(case.plant.hysteresis, (item.effect,))) if with_rivals else {}
        effects.append(
            {
                "name": item.effect.name,
                "form": item.effect.form,
                "strength": item.effect.strength,
                "values": dict(item.effect.values),
                "unabsorbed": item.unabsorbed,
                "ratio": item.unabsorbed / noise,
                "ratio_holdout": item.held_out / case.noise(True),
                "ratio_fit": item.to_fit / case.noise(False),
                "rivals": {name: _digits(x) for name, x in sorted(against.items(), key=lambda pair: pair[1])},
                "indistinguishable": sorted(
                    name for name, x in against.items() if x <= rivals.ALIKE and name != item.effect.name
                ),
            }
        )
    stage = case.session
    return {
        "case": case.name,
        "kind": case.kind,
        "seed": case.seed,
        "block": "report" if case.seed >= REPORT else "tune",
        "effects": effects,
        "foreign": {"name": case.fault[0], **case.fault[1]} if case.fault else None,
        "noise": {
            "rms": noise,
            "fit": case.noise(False),
            "holdout": case.noise(True),
            "colour": case.converters.colour,
            "output_bits": case.converters.output_bits,
            "drive_bits": case.converters.drive_bits,
        },
        "unabsorbed": case.unabsorbed,
        "ratio": case.unabsorbed / noise,
        "visible": bool(effects) and all(map(_visible, effects)),
        "remainder": case.remainder / noise,
        "excitation": "rich" if case.rich else "poor",
        "history": "known" if stage.history else "unknown",
        "session_time": case.session_time,
        "bench": stage.bench.kind,
        "hysteresis": case.plant.hysteresis.kind,
        "waveforms": [record.waveform for record in stage.records],
        "output_range": stage.bench.span_out,
        "samples": sum(record.samples for record in stage.records),
    }


def _visible(effect: dict[str, Any]) -> bool:
    """Whether an effect of a label is strong enough, also outside the held-out records."""
    return bool(effect["ratio"] >= VISIBLE and effect["ratio_fit"] >= SHOWN * VISIBLE)


def compared(case: Case, plant: Plant) -> dict[str, float]:
    """Held-out rms of each name's simple form on a plant with the case's noise, relative to that of the true form."""
    stage = case.session
    fine = plant.respond(stage)
    noise = np.concatenate(case.added)
    y = np.concatenate([stage.sampled(fine, record) for record in stage.records]) + noise
    course = refit.track(stage)
    logged = [columns["temperature"] for columns in case.measured if "temperature" in columns]
    clock = course.t if case.session_time else _own_times(course)
    data = rivals.Data(
        course,
        clock,
        y,
        stage.bench.low,
        stage.bench.high,
        max(record.rate for record in stage.records),
        np.concatenate(logged) if logged else None,
    )
    return rivals.compared(data, np.concatenate(case.twin) + noise)


def _own_times(course: refit.Track) -> np.ndarray[Any, Any]:
    """Time that restarts with every record; its values between records do not matter."""
    first = {number: course.t[np.argmax(course.record == number)] for number in np.unique(course.record).tolist()}
    return course.t - np.array([first[number] for number in course.record.tolist()])


def _digits(x: float) -> float:
    return float(f"{x:.4g}")
