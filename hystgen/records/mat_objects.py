"""Objects in MATLAB files: tables, timetables and the like, whose contents only MATLAB itself can read.

They are stored in an undocumented form. The message says what to type in MATLAB.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hystgen.basics.problems import printable
from hystgen.records.reading import Reading

_SAVE = 'save("{file}", "-struct", "s")'

TYPE: Mapping[str, str] = {
    "table": f's = table2struct({{name}}, "ToScalar", true); {_SAVE}',
    "timetable": "T = timetable2table({name}); T.(1) = seconds(T.(1) - T.(1)(1)); "
    f's = table2struct(T, "ToScalar", true); {_SAVE}',
    "timeseries": f"s.t = {{name}}.Time; s.y = squeeze({{name}}.Data); {_SAVE}",
    "datetime": f"s.t = seconds({{name}} - {{name}}(1)); {_SAVE}",
    "duration": f"s.t = seconds({{name}}); {_SAVE}",
}
"""MATLAB commands that save an object of a class as vectors; others can be added to the first result."""

OTHERWISE = 's.v = ..; s.y = ..; save("{file}", "-struct", "s")'


def advice(reading: Reading, objects: Mapping[str, str]) -> str:
    """The sentence about the objects in a file, by name with their classes."""
    first = min(objects, key=lambda name: [*TYPE, objects[name]].index(objects[name]))
    typed = TYPE.get(objects[first], OTHERWISE).format(name=first, file=f"{Path(reading.file).stem}_columns.mat")
    of = ", ".join(f"{printable(name)} ({kind})" for name, kind in objects.items())
    return (
        f"keeps its signals in MATLAB objects, which only MATLAB can read: {of}; in MATLAB, type: {typed} and give "
        f"{Path(reading.file).stem}_columns.mat"
    )
