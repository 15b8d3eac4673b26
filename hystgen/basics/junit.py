"""JUnit XML, the form in which CI systems show results."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from hystgen.basics.version import __version__


@dataclass(frozen=True)
class Case:
    """A test case: the time it took in s and, if it did not pass, `problem` in a line and in full.

    `error`: the case could not be run, as opposed to a failure.
    """

    name: str
    seconds: float = 0.0
    problem: str = ""
    text: str = ""
    error: bool = False
    properties: Mapping[str, object] = field(default_factory=dict)


def suite(name: str, classname: str, cases: Sequence[Case], properties: Mapping[str, object]) -> ElementTree.Element:
    """A test suite with its cases and, in front of them, the version of hystgen and its other properties."""
    made = ElementTree.Element(
        "testsuite", name=name, tests=str(len(cases)),
        failures=str(sum(bool(case.problem) and not case.error for case in cases)),
        errors=str(sum(case.error for case in cases)), time=_time(sum(case.seconds for case in cases)),
    )
    _add_properties(made, {"hystgen": __version__, **properties})
    for case in cases:
        one = ElementTree.SubElement(made, "testcase", classname=classname, name=case.name, time=_time(case.seconds))
        if case.properties:
            _add_properties(one, case.properties)
        if case.problem:
            outcome = "error" if case.error else "failure"
            ElementTree.SubElement(one, outcome, message=case.problem).text = case.text or case.problem
    return made


def document(name: str, suites: Sequence[ElementTree.Element]) -> str:
    """The file: a single suite by itself, or several in one element with their totals."""
    if len(suites) == 1:
        return _xml(suites[0])
    root = ElementTree.Element("testsuites", name=name)
    root.extend(suites)
    for key in ("tests", "failures", "errors"):
        root.set(key, str(sum(int(each.attrib[key]) for each in suites)))
    root.set("time", _time(sum(float(each.attrib["time"]) for each in suites)))
    return _xml(root)


def _add_properties(to: ElementTree.Element, properties: Mapping[str, object]) -> None:
    listed = ElementTree.SubElement(to, "properties")
    for key, value in properties.items():
        ElementTree.SubElement(listed, "property", name=key, value=str(value))


def _time(seconds: float) -> str:
    return f"{seconds:.3f}"


def _xml(root: ElementTree.Element) -> str:
    return ElementTree.tostring(root, encoding="unicode") + "\n"
