"""What the header says of every call: what it does, when it may be made, its units, status bits and cost."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from types import SimpleNamespace

from hystgen.emission.runtime import Piece
from hystgen.emission.text import WIDTH

_FIRST = "after init; at any time"
ORDER = {
    "init": "before every other call; at any time again",
    "reset": _FIRST,
    "step": "after init; once every sample time, from one context",
    "commit": "after a step and before the next one, any number of times; before the first step it is a first drive",
    "status": _FIRST,
    "push": "after init and before the first step",
    "settle": _FIRST,
    "set_offset": _FIRST,
    "set_temperature": _FIRST,
    "set_gain": _FIRST,
    "travel": _FIRST,
    "set_travel": "after init and before the first step, or at any time",
    "expected": "after a step, a commit or settle",
    "correct": "after a step, when the sensor's value belongs to the drive that was applied before it",
}
"""When a call may be made."""

_FEW = "a few operations, less than a step"
COSTS = {
    "init": "once through the plays",
    "reset": "that of init and of a step",
    "commit": "a few comparisons: the next step takes the drive over",
    "status": "one load and one store",
    "push": "less than a step",
    "settle": "at most that of two steps",
    "set_offset": _FEW,
    "set_temperature": _FEW,
    "set_gain": _FEW,
    "travel": "one load",
    "set_travel": _FEW,
    "expected": _FEW,
    "correct": _FEW,
}
"""What a call takes; that of a step is counted for each model."""

_ENTERED = ("INPUT_CLAMPED", "HELD")
_SET = ("LIMITED_SETTING", "HELD")
BITS = {
    "step": (*_ENTERED, "OUTPUT_CLAMPED", "DOMAIN", "SLEW_LIMITED"),
    "commit": _ENTERED,
    "push": (*_ENTERED, "DOMAIN"),
    "settle": _ENTERED,
    "set_offset": _SET,
    "set_temperature": _SET,
    "set_gain": _SET,
    "set_travel": _SET,
    "correct": _SET,
}
"""Status bits that a call may set, in a model that has them."""

_PROTOTYPE = re.compile(r"(?P<answer>[\w ]+?) hystgen_(?P<op>forward|inverse)_(?P<call>\w+)\((?P<given>[^)]*)\);")


def documented(pieces: Sequence[Piece], values: SimpleNamespace) -> Iterator[Piece]:
    """Prototypes of the interface, each below what there is to know of it; `values`: of the model."""
    for piece in pieces:
        found = _PROTOTYPE.search(" ".join(piece.code.split()))
        assert found, piece.text
        words = " ".join(re.sub(r"^ *\* ?", " ", line) for line in _brief(piece.text).splitlines())
        call, op = found["call"], found["op"]
        names = [re.findall(r"\w+", each)[-1] for each in found["given"].split(", ")]
        lines = [("", " ".join(words.split())), ("", "")]
        meaning = {"x": "u" if op == "inverse" else "v"}
        lines += [(f"@param {name}", _parameter(meaning.get(name, name), call, values)) for name in names]
        if found["answer"] != "void":
            lines.append(("@return", _answer(call, op, values)))
        lines += [
            ("@pre", ORDER[call]),
            ("@note", f"Status bits: {_bits(call, op, values)}"),
            ("@note", f"Cost: {_cost(call, op, values)}"),
        ]
        above = "\n".join(["/**", *(line for mark, text in lines for line in _line(mark, text)), " */"])
        yield Piece(piece.name, f"{above}\n{piece.code.lstrip()}\n", piece.uses)


def _brief(text: str) -> str:
    return text.partition("/*")[2].partition("*/")[0]


def _line(mark: str, text: str) -> list[str]:
    whole = f"{mark} {text}".strip()
    return textwrap.wrap(
        whole, WIDTH, initial_indent=" * ", subsequent_indent=" *     " if mark else " * ", break_on_hyphens=False
    ) or [" *"]  # fmt: skip


def _unit(what: str, values: SimpleNamespace) -> str:
    """A quantity with its unit: of the drive or the output, as a code in fixed point."""
    side = "drive" if what == "drive" else "output"
    words = {"drive": "drive", "output": "displacement", "reference": "reference"}[what]
    unit: str = getattr(values.units, side)
    if values.fixed:
        return f"{words}, in codes of {values.NAME}_{side.upper()}_LSB{unit.replace(',', '')}"
    return words + unit


def _parameter(name: str, call: str, values: SimpleNamespace) -> str:
    held = "" if values.fixed else f"; NaN and infinite: {'held' if call in ('step', 'reset') else 'ignored'}"
    kept = f"; limited to {values.NAME}_OUTPUT_MIN .. MAX" if name == "u" else ""
    fixed: Mapping[str, str] = {
        "temperature": f"temperature, in codes of {values.NAME}_TEMPERATURE_LSB",
        "gain": f"gain over that of the parameter file, in codes of {values.NAME}_GAIN_LSB",
        "share": "0 to the largest code, which stands for 1",
    }
    floating = {
        "temperature": "temperature, degC",
        "gain": "gain over that of the parameter file",
        "share": "0 to 1",
    }
    if name in floating:
        return (fixed if values.fixed else floating)[name] + held
    what = {
        "self": "the instance",
        "v": _unit("drive", values) + f"; limited to {values.NAME}_DRIVE_MIN .. MAX",
        "u": _unit("reference", values) + kept,
        "applied": _unit("drive", values) + f"; limited to {values.NAME}_DRIVE_MIN .. MAX",
        "d": _unit("output", values),
        "measured": _unit("output", values),
        "travel": "sum of the drive's ways, in the unit of a drive",
    }[name]
    return what + held * (name != "self")


def _answer(call: str, op: str, values: SimpleNamespace) -> str:
    if call == "status":
        return f"{values.NAME}_STATUS_* bits, 0 for none"
    if call == "travel":
        return "sum of the drive's ways, in the unit of a drive"
    return _unit("drive" if op == "inverse" and call == "step" else "output", values)


def _bits(call: str, op: str, values: SimpleNamespace) -> str:
    if call == "reset":
        return "cleared, then those of the step"
    if call == "status":
        return "all of them are cleared"
    there = {
        "HELD": not values.fixed,
        "OUTPUT_CLAMPED": op == "inverse" or values.saturates,
        "DOMAIN": op == "inverse" and values.envelopes,
        "SLEW_LIMITED": values.variant.slew,
    }
    found = [f"{values.NAME}_STATUS_{bit}" for bit in BITS.get(call, ()) if there.get(bit, True)]
    return ", ".join(found) or "none"


def _cost(call: str, op: str, values: SimpleNamespace) -> str:
    if call == "step":
        return f"at most {dict(values.cost.worst_case)[op]}"
    if call == "commit" and values.engine == "corners" and not values.variant.chain:
        return "at most that of a step"
    return COSTS[call]
