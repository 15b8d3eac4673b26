"""What was seen but not named, in words: one sentence for each entry of `unexplained`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hystgen.basics.words import counted
from hystgen.diagnosis import description

REPAIRED = ("saturated", "drop_outs", "held_samples", "isolated_samples", "swapped_channels", "history")
"""Kinds that are left out of the comparison or put right: what remains of the records is as good as any."""

ACTUATOR = "structure"
"""The kind that may be of the actuator."""

ONE_LOOP = (
    "all records pass one loop, which tells little more than of one effect: add smaller loops inside it, other speeds "
    "and holds"
)
"""What to do about records that are that poor."""

INTERPOLATION = "the sensor's interpolation error looks like this"


def sentence(each: Mapping[str, Any], unit: str | None) -> str:
    """An entry as a sentence without its full stop; `unit` of the displacement."""
    u = f" {unit}" if unit else ""
    record = each.get("record")
    kind = each["kind"]
    if kind == "structure":
        times = f", {each['above_floor']:.3g} times the noise" if each.get("above_floor") else ""
        return f"an error of {each['rms']:.3g}{u} rms is left{times}; it {description.words(dict(each))}"
    if kind == "line":
        mains = each.get("mains")
        what = "" if mains is None else f" (mains hum{'' if isinstance(mains, float) else f', {mains}'})"
        return (
            f"a line at {each['frequency']:.4g} Hz{what}, amplitude {each['amplitude']:.3g}{u}, in "
            f"{_several(each['records'])}: {100.0 * each['share']:.0f} % of the error's variance there"
            + _taken_out(each)
        )
    if kind == "ripple":
        return (
            f"a ripple over the position with a pitch of {each['pitch']:.4g}{u}, amplitude {each['amplitude']:.3g}{u}, "
            f"in {_several(each['records'])}: {100.0 * each['share']:.0f} % of the error's variance; "
            + ("its pitch is the step of the converter" if each["converter_step"] else INTERPOLATION)
            + _taken_out(each)
        )
    if kind == "stick_slip":
        return (
            f"{record}: stick-slip, {counted(each['count'], 'jump')} of about {each['size']:.3g}{u} after standing "
            f"still, the first at {each['first']:.6g} s"
        )
    if kind == "scale":
        if record == "all":
            return (
                f"the output of all records is {each['factor']:.4g} times what the believed model predicts: other "
                "units, or another sensitivity"
            )
        return (
            f"{record}: left out, its output is {each['factor']:.4g} times what the other records let expect: other "
            "units of drive or output, another gain of the sensor, or a dead one"
        )
    if kind == "swapped_channels":
        return f"{record}: drive and displacement are exchanged (the model fits them the other way round); put right"
    if kind == "history":
        return (
            f"the {counted(each['samples'], 'sample')} at the start, whose output depends on the history, are off by "
            f"{each['start']:.3g}{u} rms, all others by {each['rest']:.3g}{u}: the actuator came from elsewhere, and "
            "the history is left out"
        )
    if kind == "exchanged_records":
        return f"{record}: left out, its output belongs to the drive of {each['with']}"
    return f"{record}: {_samples(each, u)}"


def _samples(each: Mapping[str, Any], u: str) -> str:
    kind, count = each["kind"], each["count"]
    at = f", the first at {each['first']:.6g} s" if "first" in each else ""
    if kind == "saturated":
        return f"{counted(count, 'sample')} at the converter's end, {each['level']:.6g}{u}, not compared{at}"
    if kind == "drop_outs":
        level = f" to {each['level']:.6g}{u}" if "level" in each else ""
        return f"{counted(count, 'drop-out')}{level}, {counted(each['samples'], 'sample')} not compared{at}"
    if kind == "held_samples":
        held = counted(each["samples"], "sample")
        return f"the output stands still {counted(count, 'time')} while the drive moves, {held} not compared{at}"
    done = "bridged" if each["channel"] == "v" else "not compared"
    return f"{counted(count, 'isolated sample')} of {each['channel']} far from the neighbours, {done}{at}"


FAULTS = {
    "swapped_channels": ("record", " with exchanged columns"),
    "saturated": ("sample", " at the converter's end"),
    "drop_outs": ("drop-out", ""),
    "held_samples": ("stretch", " of held samples"),
    "isolated_samples": ("isolated sample", ""),
    "history": ("history", " that the starts contradict"),
}
"""What is counted of each kind, and what goes with it."""


def _taken_out(each: Mapping[str, Any]) -> str:
    return "; taken out of the records before effects were sought" if each.get("repaired") else ""


def faults(entries: Sequence[Mapping[str, Any]]) -> str:
    """The kinds of what was put right or left out, with their counts, in a few words."""
    said = []
    for kind, (what, extra) in FAULTS.items():
        found = [each for each in entries if each["kind"] == kind]
        if not found:
            continue
        number = sum(each.get("count", 1) for each in found)
        several = "stretches" if what == "stretch" and number != 1 else None
        said.append(f"{f'{number} {several}' if several else counted(number, what)}{extra}")
    return ", ".join(said)


def advice(each: Mapping[str, Any]) -> list[str]:
    """Which experiment tells more of what is left."""
    if each["kind"] != "structure":
        return []
    said = []
    if alone := each["held_out_alone"]:  # never fitted, so that what they alone show cannot be found
        said.append(f"fit {_several(alone)} too and hold out others: what is left shows in held-out records alone")
    if each["rate_free"] is None:
        said.append("record the same loops at two rates a decade apart: that tells whether what is left is rate-free")
    if each["repeatable"] is None:
        said.append("repeat a record ten times: that tells what of the rest comes back and what is noise")
    return said


def _several(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= 3 else f"{len(names)} records ({names[0]}, {names[1]}, ..)"
