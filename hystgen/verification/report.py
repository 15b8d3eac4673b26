"""The results of a verification: a table for people, JSON for programs, JUnit XML for CI."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from xml.etree.ElementTree import Element

from hystgen.basics import display, junit
from hystgen.basics.problems import counted
from hystgen.basics.version import __version__
from hystgen.verification.compilers import MissingError


@dataclass(frozen=True)
class Row:
    """One operator in one build: the number of samples compared, the result and, on emulated cores, its cost.

    Instructions are counted from the entry of `step` to its return, over the samples compared. `flash` is the bytes of
    code and constants of the emitted module, `library` the bytes of library code linked to it (soft float, and anything
    else the image called), `ram` the size of an instance, `stack` the bytes that the deepest call used below the
    caller's frame, as measured. On an AVR, where constants are in RAM, `ram` includes them as well as an instance of
    each operator. `note`: a remark on the figures. `missing`: nothing was compared because a tool cannot be used here.
    `seconds`: time since the row before, which includes building what the row is the first to need.
    """

    target: str
    compiler: str
    build: str
    operator: str
    samples: int = 0
    different: int = 0
    max_ulp: float | None = 0.0  # None: an output is not a finite number
    first: str = ""
    mean_instructions: float | None = None
    max_instructions: int | None = None
    flash: int | None = None
    library: int | None = None
    ram: int | None = None
    stack: int | None = None
    note: str = ""
    error: str = ""
    missing: bool = False
    seconds: float = 0.0

    @property
    def ok(self) -> bool:
        """Whether all bits are equal."""
        return not self.error and not self.different

    @property
    def figures(self) -> dict[str, float]:
        """The cost on an emulated core, by name."""
        keys = ("mean_instructions", "max_instructions", "flash", "library", "ram", "stack")
        found = {key: getattr(self, key) for key in keys if self.flash is not None}
        return {key: value for key, value in found.items() if value is not None}

    @property
    def _most(self) -> str:
        return "some not finite" if self.max_ulp is None else f"up to {self.max_ulp:.3g} ulp"

    @property
    def verdict(self) -> str:
        """The result in the words of the table."""
        if self.error:
            return self.error.splitlines()[0]
        if self.ok:
            return "bits equal" if self.samples else "passed"
        return f"{self.different} differ, {self._most}; first: {self.first}"


def failed(row: Row, error: object) -> Row:
    """The row of a build that could not be built or run."""
    return replace(row, error=str(error), missing=isinstance(error, MissingError))


def selftest(row: Row, name: str, result: int) -> Row:
    """The row of a self-test, from its result."""
    return failed(row, f"{name}_selftest() returned {result}") if result else row


def _number(value: int | None) -> str:
    return "-" if value is None else str(value)


_ALWAYS: list[tuple[str, Callable[[Row], str]]] = [
    ("target", lambda row: row.target),
    ("compiler", lambda row: row.compiler),
    ("build", lambda row: row.build),
    ("operator", lambda row: row.operator),
    ("samples", lambda row: _number(row.samples or None)),
]
_WHERE_MEASURED: list[tuple[str, Callable[[Row], str]]] = [
    ("instr. mean", lambda row: "-" if row.mean_instructions is None else f"{row.mean_instructions:.1f}"),
    ("max", lambda row: _number(row.max_instructions)),
    ("flash", lambda row: _number(row.flash)),
    ("library", lambda row: _number(row.library)),
    ("RAM", lambda row: _number(row.ram)),
    ("stack", lambda row: _number(row.stack)),
]
_RIGHT = {"samples", *(name for name, _ in _WHERE_MEASURED)}


@dataclass(frozen=True, repr=False)
class Report:
    """All rows of a model's verification; `file`: its parameter file, if known; `sha256`: of its parameters, as in the
    banner of the C, and of each file that `emit` would write, by name."""

    name: str
    arithmetic: str
    engine: str
    layout: str
    rows: list[Row] = field(default_factory=list)
    file: str = ""
    sha256: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        wrong = sum(not row.ok for row in self.rows)
        found = f"{wrong} of {counted(len(self.rows), 'build')} wrong" if wrong else (
            f"bits equal in {counted(len(self.rows), 'build')}"
        )
        return f"<Report {self.name}: {self.arithmetic}, {self.engine}, {self.layout}; {found}>"

    def _repr_html_(self) -> str:
        return display.block(repr(self), self._below(), rows=self._cells())

    @property
    def ok(self) -> bool:
        """Whether everything requested was built, run and equal."""
        return bool(self.rows) and all(row.ok for row in self.rows)

    @property
    def wrong(self) -> bool:
        """Whether the C is at fault: bits differ, or installed tools cannot build or run it."""
        return not self.rows or any(not row.ok and not row.missing for row in self.rows)

    def table(self) -> str:
        """A table for people; columns without a figure in any row are left out."""
        texts = []
        for words in zip(*self._cells(), strict=True):
            width = max(map(len, words))
            texts.append([word.rjust(width) if words[0] in _RIGHT else word.ljust(width) for word in words])
        lines = ["  ".join(line).rstrip() for line in zip(*texts, strict=True)]
        return "\n".join(lines) + self._below()

    def _cells(self) -> list[tuple[str, ...]]:
        """The header and the rows of the table."""
        measured = [(name, cell) for name, cell in _WHERE_MEASURED if any(cell(row) != "-" for row in self.rows)]
        columns = [*_ALWAYS, *measured, ("result", lambda row: row.verdict)]
        return [tuple(name for name, _ in columns), *(tuple(cell(row) for _, cell in columns) for row in self.rows)]

    def _below(self) -> str:
        """Notes and details below the table."""
        notes = [f"\n\n{row.target}: {row.note}" for row in self.rows if row.note]
        details = [f"\n\n{r.target} {r.compiler} {r.build}: {r.error}" for r in self.rows if "\n" in r.error]
        return "".join(notes + details)

    def content(self) -> dict[str, object]:
        """The report as plain data for JSON."""
        file = {"file": self.file} if self.file else {}
        about = {"name": self.name, "arithmetic": self.arithmetic, "engine": self.engine, "layout": self.layout}
        rows = [{**asdict(row), "ok": row.ok} for row in self.rows]
        for row in rows:
            del row["seconds"]  # the same input gives the same bytes
        return {**file, **about, "version": __version__, "sha256": dict(self.sha256), "ok": self.ok, "rows": rows}

    def to_json(self) -> str:
        """The report for programs."""
        return _json(self.content())

    def suite(self, title: str = "") -> Element:
        """A JUnit test suite with one test case per row: a failure if the C is at fault, an error if a tool is
        missing; `title`: used in place of the model's name."""
        title = title or self.name
        cases = [
            junit.Case(
                f"{row.target} {row.compiler} {row.build} {row.operator}", row.seconds,
                "" if row.ok else row.verdict, row.error, row.missing, row.figures if row.ok else {},
            )
            for row in self.rows
        ]
        about = {f"sha256 {name}": digest for name, digest in self.sha256.items()}
        how = f"{self.arithmetic}.{self.engine}.{self.layout}"
        return junit.suite(f"hystgen verify {title}", f"{title}.{how}", cases, about)

    def to_junit(self) -> str:
        """The report as JUnit XML."""
        return junit.document("hystgen verify", [self.suite()])


@dataclass(frozen=True)
class Reports:
    """The reports of several models as one; a single report keeps its own form."""

    reports: Sequence[Report]

    @property
    def ok(self) -> bool:
        """Whether everything requested was built, run and equal."""
        return bool(self.reports) and all(report.ok for report in self.reports)

    @property
    def wrong(self) -> bool:
        """Whether the C of a model is at fault: bits differ, or installed tools cannot build or run it."""
        return not self.reports or any(report.wrong for report in self.reports)

    @property
    def titles(self) -> list[str]:
        """A title per report: the model's name, its file if models share a name, a number if files do too."""
        names = Counter(report.name for report in self.reports)
        found = [report.name if names[report.name] == 1 else report.file or report.name for report in self.reports]
        again = Counter(found)
        return [title if again[title] == 1 else f"{title} {number}" for number, title in enumerate(found, 1)]

    def table(self) -> str:
        """A table per model, below its title."""
        if len(self.reports) == 1:
            return self.reports[0].table()
        return "\n\n".join(
            f"{report.file or title}: {report.name}, {report.arithmetic}, {report.engine}, {report.layout}\n"
            f"{report.table()}"
            for title, report in zip(self.titles, self.reports, strict=True)
        )

    def summary(self) -> str:
        """A line on all models together."""
        titled = list(zip(self.titles, self.reports, strict=True))
        equal = sum(report.ok for report in self.reports)
        wrong = [title for title, report in titled if report.wrong]
        unrun = [title for title, report in titled if not report.ok and not report.wrong]
        said = [f"bits equal in {equal} of {counted(len(self.reports), 'model')}"]
        said += [f"wrong in {', '.join(wrong)}"] if wrong else []
        return "; ".join([*said, *([f"could not run all of {', '.join(unrun)}"] if unrun else [])])

    def to_json(self) -> str:
        """The reports for programs; several are listed under `reports`."""
        if len(self.reports) == 1:
            return self.reports[0].to_json()
        return _json({"ok": self.ok, "reports": [report.content() for report in self.reports]})

    def to_junit(self) -> str:
        """The reports as JUnit XML, one suite per model."""
        suites = [report.suite(title) for title, report in zip(self.titles, self.reports, strict=True)]
        return junit.document("hystgen verify", suites)


def _json(content: dict[str, object]) -> str:
    return json.dumps({"hystgen": 1, **content}, indent=2) + "\n"

