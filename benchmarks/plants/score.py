"""Count how often the diagnosis was right, according to labels that it has not seen.

A name counts as right if it is the effect's, or if the label calls it indistinguishable on the given records and the
diagnosis reports it as not separable from the effect's own. Reporting two names as not separable does not excuse the
wrong one if the label says that they are separable.
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from .case import OPEN
from .effects import catalogue

EDGES = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0, float("inf"))
"""Bins of the ratio of unabsorbed rms to noise."""

NOTHING, UNEXPLAINED, ALIKE, MISSING = "nothing", "unexplained", "alike", "no result"


@dataclass(frozen=True)
class Outcome:
    """One case, with its label, what was diagnosed (None without a result), and how the run went."""

    label: dict[str, Any]
    found: dict[str, Any] | None
    run: dict[str, Any]

    @property
    def true(self) -> list[str]:
        return [effect["name"] for effect in self.label["effects"]]

    @property
    def names(self) -> list[str]:
        return [effect["name"] for effect in self.found["effects"]] if self.found else []

    @property
    def groups(self) -> list[set[str]]:
        return [set(group) for group in self.found.get("not_separable", [])] if self.found else []

    def accepts(self, effect: dict[str, Any], name: str) -> bool:
        """Whether `name` is a correct answer for an effect of the label."""
        if name == effect["name"]:
            return True
        alike = {effect["name"], *effect["indistinguishable"]}
        return name in alike and any({name, effect["name"]} <= group <= alike for group in self.groups)

    def left_open(self, effect: dict[str, Any]) -> bool:
        """Whether nothing was named, but the effect was correctly reported as not separable from other names."""
        alike = {effect["name"], *effect["indistinguishable"]}
        return not self.names and any(effect["name"] in group <= alike and len(group) > 1 for group in self.groups)

    @property
    def first_right(self) -> bool:
        """Whether the first name belongs to an effect of the plant."""
        if self.found is None:
            return False
        return any(
            self.left_open(effect) or bool(self.names and self.accepts(effect, self.names[0]))
            for effect in self.label["effects"]
        )

    @property
    def all_named(self) -> bool:
        return self.found is not None and all(
            self.left_open(effect) or any(self.accepts(effect, name) for name in self.names)
            for effect in self.label["effects"]
        )

    @property
    def exact(self) -> bool:
        """Whether every effect of the plant was named, and nothing else."""
        return self.all_named and len(self.names) <= len(self.true) and not self.wrong

    @property
    def wrong(self) -> list[str]:
        """Names that are correct for no effect of the plant."""
        return [name for name in self.names if not any(self.accepts(e, name) for e in self.label["effects"])]

    @property
    def confident_wrong(self) -> list[str]:
        """Wrong names, except those that were reported as not separable from a right one."""
        return [
            name for name in self.wrong if not any(name in group and group & set(self.true) for group in self.groups)
        ]

    @property
    def overcautious(self) -> bool:
        """Whether an effect was reported as not separable from a name although these records separate the two."""
        return any(
            e["name"] in group and not group <= {e["name"], *e["indistinguishable"]}
            for e in self.label["effects"]
            for group in self.groups
        )

    @property
    def refused(self) -> bool:
        """Whether a record was refused as bad input and named; exit code 2 alone could mean a wrong command line."""
        said = re.search(r"\.csv\b.*: error: |error: .*\.csv: ", self.run.get("stderr", ""))
        return self.run.get("exit") == 2 and said is not None

    @property
    def flagged(self) -> bool:
        if self.found is None:
            return self.refused
        return self.found["verdict"] == "unexplained" or bool(self.found.get("unexplained"))

    @property
    def residual(self) -> float | None:
        """Held-out rms after the named effects, in units of the noise."""
        if self.found is None:
            return None
        return float(self.found["gap"]["after"]["holdout"]) / float(self.label["noise"]["holdout"])

    @property
    def row(self) -> str:
        if self.label["foreign"]:
            return str(self.label["foreign"]["name"])
        return "+".join(self.true) or "none"

    @property
    def column(self) -> str:
        if self.found is None:
            return "refused" if self.refused else MISSING
        if any(self.left_open(effect) for effect in self.label["effects"]):
            return ALIKE
        if not self.names:
            return UNEXPLAINED if self.found["verdict"] == "unexplained" else NOTHING
        if self.names[0] not in self.true and self.first_right:
            return ALIKE
        return self.names[0]


@dataclass(frozen=True)
class Figure:
    """A measured figure against its limit."""

    what: str
    value: float
    limit: float
    cases: int
    at_least: bool

    @property
    def kept(self) -> bool:
        return self.value >= self.limit if self.at_least else self.value <= self.limit


def load(cases: Path, labels: Path, results: Path) -> list[Outcome]:
    """Every case that has a folder in `cases`; one without a result counts as failed."""
    outcomes = []
    for home in sorted(path for path in cases.iterdir() if path.is_dir()):
        found = results / home.name / "diagnosis.json"
        run = results / home.name / "run.json"
        outcomes.append(
            Outcome(
                json.loads((labels / f"{home.name}.json").read_text()),
                json.loads(found.read_text()) if found.is_file() else None,
                json.loads(run.read_text()) if run.is_file() else {},
            )
        )
    return outcomes


def figures(outcomes: Sequence[Outcome]) -> list[Figure]:
    """Every figure that has cases, against the project's limits."""
    found: list[Figure] = []

    def share(what: str, some: Sequence[Outcome], right: Callable[[Outcome], bool], limit: float) -> None:
        if some:
            found.append(Figure(what, sum(map(right, some)) / len(some), limit, len(some), True))

    def count(what: str, some: Sequence[Outcome], bad: Callable[[Outcome], bool]) -> None:
        if some:
            found.append(Figure(what, float(sum(map(bad, some))), 0.0, len(some), False))

    singles = _of(outcomes, "single", visible=True)
    pairs = _of(outcomes, "pair", visible=True)
    free = _of(outcomes, "none")
    foreign = _of(outcomes, "foreign")
    poor = _of(outcomes, "poor")
    opened = _of(outcomes, "open", visible=True)
    others = [x for x in outcomes if x.label["kind"] != "open"]
    share("single: right name first", singles, lambda x: x.first_right, 0.97)
    share("single: exact set", singles, lambda x: x.exact, 0.92)
    share("pair: both names", pairs, lambda x: x.all_named, 0.80)
    share("open loops: right name first", opened, lambda x: x.first_right, 0.95)
    count("open loops: named in other cases", others if opened else [], lambda x: OPEN in x.confident_wrong)
    count("effect-free: cases with a name", free, lambda x: bool(x.names))
    count("foreign: cases with a name", foreign, lambda x: bool(x.names))
    share("foreign: flagged", foreign, lambda x: x.flagged, 0.98)
    count("poor excitation: confident wrong name", poor, lambda x: bool(x.confident_wrong))
    everything = [*singles, *pairs, *opened, *free, *poor, *foreign]
    count("cases without a result", everything, lambda x: x.found is None and not x.refused)
    left = [x.residual for x in [*singles, *pairs, *opened, *free] if x.residual is not None]
    if left:
        found.append(Figure("held-out residual over noise, median", float(np.median(left)), 1.15, len(left), False))
        found.append(Figure("held-out residual over noise, 90 %", float(np.quantile(left, 0.9)), 2.0, len(left), False))
    return found


def asides(outcomes: Sequence[Outcome]) -> dict[str, float]:
    """Fractions without a limit, which show whether limits are met only by naming nothing or leaving all open."""
    singles = _of(outcomes, "single", visible=True)
    pairs = _of(outcomes, "pair", visible=True)
    poor = _of(outcomes, "poor")
    foreign = _of(outcomes, "foreign")
    asked: list[tuple[str, Sequence[Outcome], Callable[[Outcome], bool]]] = [
        ("single: left open though separable", singles, lambda x: x.overcautious),
        ("single: nothing named", singles, lambda x: not x.names),
        ("pair: exact set", pairs, lambda x: x.exact),
        ("single: not visible, not counted", _of(outcomes, "single"), lambda x: not x.label["visible"]),
        ("pair: not visible, not counted", _of(outcomes, "pair"), lambda x: not x.label["visible"]),
        ("poor excitation: right name first", poor, lambda x: x.first_right),
        ("poor excitation: nothing named", poor, lambda x: not x.names),
        ("foreign: refused as bad input", foreign, lambda x: x.refused),
    ]
    return {what: sum(map(true, some)) / len(some) for what, some, true in asked if some}


def curve(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Naming rate of single effects with rich excitation, against the ratio of unabsorbed rms to noise."""
    some = [*_of(outcomes, "single"), *_of(outcomes, "snr")]
    rows = []
    for low, high in pairwise(EDGES):
        bin_ = [x for x in some if low <= x.label["effects"][0]["ratio"] < high]
        if bin_:
            rows.append(
                {
                    "from": low,
                    "to": None if high == float("inf") else high,
                    "cases": len(bin_),
                    "right": sum(x.first_right for x in bin_) / len(bin_),
                    "wrong": sum(bool(x.wrong) for x in bin_) / len(bin_),
                    "silent": sum(not x.names and not x.first_right for x in bin_) / len(bin_),
                }
            )
    return rows


def confusion(outcomes: Sequence[Outcome]) -> dict[str, Counter[str]]:
    """How often each truth (row) was answered by each first name (column); pairs and poor cases are left out."""
    table: dict[str, Counter[str]] = {}
    chosen = [each for kind in ("single", "open") for each in _of(outcomes, kind, visible=True)]
    chosen += [*_of(outcomes, "none"), *_of(outcomes, "foreign")]
    for outcome in chosen:
        table.setdefault(outcome.row, Counter())[outcome.column] += 1
    return table


def main(cases: Path, labels: Path, results: Path, report: Path | None = None) -> int:
    outcomes = load(cases, labels, results)
    if not outcomes:
        print(f"no case in {cases}", file=sys.stderr)
        return 2
    judged = figures(outcomes)
    print(text(outcomes, judged))
    if report:
        data = {
            "cases": len(outcomes),
            "blocks": sorted({x.label["block"] for x in outcomes}),
            "figures": [{**asdict(x), "kept": x.kept} for x in judged],
            "asides": asides(outcomes),
            "confusion": {row: dict(counts) for row, counts in confusion(outcomes).items()},
            "curve": curve(outcomes),
            "seconds": _seconds(outcomes),
            "failures": [_case_text(x) for x in outcomes if _failed(x)],
        }
        report.write_text(json.dumps(data, indent=1) + "\n")
    return 0 if all(x.kept for x in judged) else 1


def text(outcomes: Sequence[Outcome], judged: Sequence[Figure]) -> str:
    """The whole report."""
    seeds = {block: [x.label["seed"] for x in outcomes if x.label["block"] == block] for block in ("tune", "report")}
    lines = [
        f"{len(part)} cases of the {block} block, seeds {min(part)} to {max(part)}"
        for block, part in seeds.items()
        if part
    ]
    lines += ["", *_matrix(confusion(outcomes)), ""]
    for x in judged:
        shown = f"{x.value:8.3f}" if x.at_least or x.value != int(x.value) or x.limit else f"{x.value:8.0f}"
        sign = ">=" if x.at_least else "<="
        lines.append(f"{'ok    ' if x.kept else 'MISSED'} {x.what:40s}{shown}  {sign} {x.limit:g}  ({x.cases} cases)")
    lines += [f"       {what:40s}{value:8.3f}" for what, value in asides(outcomes).items()]
    rows = curve(outcomes)
    if rows:
        lines += ["", "unabsorbed rms over noise   cases   right   wrong  silent"]
        for row in rows:
            top = f"{row['to']:g}" if row["to"] else "more"
            shares = "".join(f"{row[key]:8.2f}" for key in ("right", "wrong", "silent"))
            lines.append(f"{row['from']:12g} to {top:10s}{row['cases']:8d}{shares}")
    times = _seconds(outcomes)
    if times:
        lines += ["", "seconds a case: median {median:.1f}, 90 % {most:.1f}, longest {longest:.1f}".format(**times)]
    failed = [_case_text(x) for x in outcomes if _failed(x)]
    if failed:
        lines += ["", "failures:", *(f"  {line}" for line in failed)]
    return "\n".join(lines)


def _of(outcomes: Sequence[Outcome], kind: str, visible: bool = False) -> list[Outcome]:
    return [x for x in outcomes if x.label["kind"] == kind and (x.label["visible"] or not visible)]


def _failed(x: Outcome) -> bool:
    kind = x.label["kind"]
    if kind in ("single", "pair", "open"):
        return bool(x.label["visible"]) and not x.exact
    if kind == "foreign":
        return bool(x.names) or not x.flagged
    return bool(x.confident_wrong) if kind == "poor" else kind == "none" and bool(x.names)


def _case_text(x: Outcome) -> str:
    ratios = ", ".join(f"{e['name']}/{e['form']} at {e['ratio']:.1f}" for e in x.label["effects"]) or x.row
    answer = ", ".join(x.names) or x.column
    alike = "; alike " + ", ".join("/".join(sorted(group)) for group in x.groups) if x.groups else ""
    left = "" if x.residual is None else f", left {x.residual:.2f} noise"
    which = f"{x.label['case']} {x.label['kind']} {x.label['seed']} ({x.label['bench']})"
    return f"{which}: {ratios} -> {answer}{alike}{left}"


def _matrix(table: dict[str, Counter[str]]) -> list[str]:
    """Rows: truth. Columns: first name, as letters explained in a legend, which keeps lines short."""
    names = sorted(catalogue())
    seen = {column for counts in table.values() for column in counts}
    columns = [x for x in (*names, ALIKE, UNEXPLAINED, NOTHING, "refused", MISSING) if x in seen]
    columns += sorted(seen - set(columns))
    if not columns:
        return []
    lines = ["first name of the diagnosis (columns) for each truth (rows); pairs and poor excitation are not in it"]
    lines.append(" " * 22 + "".join(f"{x[:6]:>7s}" for x in columns))
    for row in sorted(table, key=lambda x: (x not in names, x)):
        lines.append(f"{row:22s}" + "".join(f"{table[row][x] or '.':>7}" for x in columns))
    return lines


def _seconds(outcomes: Sequence[Outcome]) -> dict[str, float]:
    times = [x.run["seconds"] for x in outcomes if "seconds" in x.run]
    if not times:
        return {}
    return {"median": float(np.median(times)), "most": float(np.quantile(times, 0.9)), "longest": float(max(times))}
