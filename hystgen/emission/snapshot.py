"""The state of an instance as bytes: member by member, from the declaration of its type in C.

A restored instance goes on with the same bits. What a step uses without a check is checked on the way in: every number
has limits, corners are a stack of blocks of plays, and a line of outputs that a usual step would follow unchecked is
left out, so that the next step searches for it.
"""

from __future__ import annotations

import hashlib
import re
import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hystgen.compensator.layout import FixedTables, Tables
from hystgen.emission.block import REAL
from hystgen.emission.runtime import Piece, template
from hystgen.emission.text import operand

if TYPE_CHECKING:
    from hystgen.emission.compensator import EmittedModel, Macro

MAGIC, VERSION = b"HYSS", 1
HEAD = 20
"""[bytes] Magic, version, layout, size and CRC of the parameters."""
TAIL = 4
"""[bytes] The CRC at the end."""

WIDTHS = {
    "int64_t": -8, "int32_t": -4, "int16_t": -2, "uint32_t": 4, "uint16_t": 2, "uint8_t": 1, "bool": 1,
    "uint_least16_t": 2, "uint_least8_t": 1, "unsigned int": 2,
}
"""[bytes] How whole numbers are stored, negative for signed ones."""

DRIVES = ("pending", "applied", "drive", "undo_drive", "returned")
"""Members that are drives of an instance, within their range."""

LARGER = 2.0**40
"""[times the largest number of a model] Limit of a state in floating point: no product of two such states overflows in
single precision for numbers of a model up to 1e6, and 1e14 moves over the range fit a count of travel."""


def numbers(one: EmittedModel) -> list[Macro]:
    """Limits of a state that depend on the unit."""
    if not one.family.arithmetic.fixed:
        return [("STATE_MOST", operand(_largest(one)), "limit of any state")]
    return [(f"STATE_{name}", operand(value), "") for name, value in _limits(one).items()]


def _largest(one: EmittedModel) -> np.floating:
    """Limit of any state in floating point."""
    t, real = one.numbers.tables, one.family.arithmetic.real
    plays: Any = t if isinstance(t, Tables) else t.plays  # type: ignore[union-attr]
    sizes = [1.0, *(abs(float(x)) for end in (t.limits.drive[0], t.limits.output[0]) for x in end)]
    sizes += [float(np.max(np.abs(np.asarray(each)[np.isfinite(each)]))) for each in (plays.threshold, plays.start)]
    return real(min(LARGER * max(sizes), float(np.finfo(real).max)))


def _limits(one: EmittedModel) -> dict[str, int]:
    """Limits of states in fixed point, by which their formats were chosen: those of plays and their sums, and with
    effects those of signals and of the blocks' states. The reasons are with the blocks' formats."""
    t = one.numbers.tables
    plays: Any = t if isinstance(t, FixedTables) else t.plays  # type: ignore[union-attr]
    least, most = (int(end) for end in plays.limits.play[0])
    starts = [0, *(int(each) for each in plays.start)]
    found = {"LEAST": min(least, *starts), "MOST": max(most, *starts)}
    if isinstance(t, FixedTables):
        return {**found, "SUM": 1 << 61}
    from hystgen.effects.gains import ONE

    assert one.compiled is not None
    assert one.compiled.codes is not None

    def room(dropped: Any, bits: int) -> int:
        return int(2 ** (bits + int(np.max(dropped, initial=0))))

    chained: Any = t
    number, codes = chained.number, one.compiled.codes
    code = int(chained.limits.code_max[0])
    drive = (code + 1) << (int(number.arriving_bits[0]) + int(number.drive_bits[0]))
    led = room(chained.of("lag").led.drop, 50)
    found |= {
        "SUM": (int(number.largest_level[0]) + 1) << int(number.level_drop[0]), "SIGNAL": int(codes.largest),
        "DRIVE": drive, "CREEP": room(chained.of("creep").block.drop, 50), "LAG": led, "ASKED": led // 3,
        "MOVED": 2 * drive + 2, "MODE": room(chained.of("mode").drop, 48), "RISE": 1 << 60,
        "INVERSE": 2 * ONE + 2, "RUBBED": code * room(chained.of("heat").friction.bits, 0), "GAIN": ONE // 4,
        "INPUT": max(int(chained.moving.farthest), abs(found["LEAST"]), abs(found["MOST"])) + 2, "REST": 2**29,
    }
    return {**found, "SLOPE": 1 << 45}


OF_BLOCKS = (
    (r"creep_\d+_state\.next", "CREEP"), (r"creep_\d+\.\w+", "SIGNAL"),
    (r"braked_\d+\.(lag\.asked|earlier)", "ASKED"), (r"(lag|braked|lag_exact)_\d+\..*", "LAG"),
    (r"mode_\d+\.(off|rate)", "MODE"), (r"mode_\d+\..*", "SIGNAL"), (r"heat_\d+\.high", "RISE"),
    (r"\w+\.(inverse|gain)", "INVERSE"), (r"ageing_\d+\.high", "SUM"), (r"slope|steep", "SLOPE"),
    (r"\w+_state\.at", "RUBBED"), (r"heat_\d+\.offset", "SIGNAL"), (r"reached\.rest", "REST"),
    (r"reached\.drive", "SUM"), (r"steady\..*", "MOVED"), (r"quiet\.arrived|drive", "DRIVE"),
    (r"search\.(input|prior|low|top)|near|found|turned", "INPUT"),
    (r"bent|staying|search\..*|joined|asked|(here|undo|kink)\.output", "SUM"),
    (r"level|output|offset|line|quiet\.reference", "SIGNAL"),
)
"""Limits of members in fixed point with effects, by their places."""


@dataclass(frozen=True)
class StateEntry:
    """Numbers of one type in a state: `place`: the expression for one of them, with an index for each of `sizes`;
    `type`: as declared, without prefix; `kind`: its meaning; `bits`: of a bit field, or 0."""

    place: str
    type: str
    kind: str
    sizes: tuple[int, ...]
    bits: int

    @property
    def own(self) -> str:
        """The member's own name."""
        return re.sub(r"\[\w\]", "", self.place).rpartition(".")[2]

    @property
    def width(self) -> int:
        """Bytes of one, negative if signed."""
        if self.kind in REAL:
            return 4 if self.kind == "float" else 8
        return -(-self.bits // 8) if self.bits else WIDTHS[self.kind]

    @property
    def bytes(self) -> int:
        """Bytes of all."""
        return abs(self.width) * int(np.prod(self.sizes, dtype=int))

    def looped(self, lines: Iterable[str]) -> list[str]:
        """The lines for each of them."""
        made = list(lines)
        for index, size in reversed([*zip("ijk", self.sizes, strict=False)]):
            head = f"for ({index} = 0; {index} < {size}u; ++{index}) {{"
            made = [head, *(f"    {line}" for line in made), "}"]
        return made

    def put(self, name: str) -> list[str]:
        """The lines that append it."""
        value = f"self->{self.place}"
        if self.kind in REAL:
            return self.looped([f"{name}_append_{self.kind}(&at, {value});"])
        value = f"{value} ? 1u : 0u" if self.kind == "bool" else value
        cast = "(uint64_t)" if self.width < 0 else ""
        return self.looped([f"{name}_append(&at, {cast}{value}, {abs(self.width)}u);"])

    def get(self, name: str, limits: tuple[str, str] | None) -> list[str]:
        """The lines that read it and check its limits."""
        place = f"to->{self.place}"
        if self.kind in REAL:
            read = f"{name}_{self.kind}(&at)"
        else:
            read = f"{name}_whole(&at, {self.width})"
            if self.kind == "bool":
                read = f"{read} != 0"
            elif self.bits:
                read = f"(unsigned int){read} & {hex((1 << self.bits) - 1)}u"
            elif self.kind != "int64_t":
                read = f"({self.kind}){read}"
        lines = [f"{place} = {read};"]
        if limits:
            least, most = limits
            low = f"{place} >= {least} && " if least else ""
            lines.append(f"fits = fits && {low}{place} <= {most};")
        return self.looped(lines)


def entries(
    types: Mapping[str, Piece], kind: str, place: str, sizes: tuple[int, ...], lengths: Mapping[str, int], meaning: Any
) -> Iterator[StateEntry]:
    """The numbers in a structure of this type."""
    for field in types[kind].members:
        if "*" in field.kind:
            continue
        inside, whole = f"{place}.{field.name}".removeprefix("."), sizes
        for word in [field.length] * bool(field.length):
            inside += f"[{'ijk'[inside.count('[')]}]"
            whole = (*whole, _length(word, lengths))
        if field.kind in types and types[field.kind].members:
            yield from entries(types, field.kind, inside, whole, lengths, meaning)
        else:
            yield StateEntry(inside, field.kind, meaning(field.kind), whole, field.bits)


def _length(word: str, lengths: Mapping[str, int]) -> int:
    """The length of an array as written in C."""
    return sum(int(lengths.get(each.strip(), each.strip())) for each in word.split("+"))


@dataclass(frozen=True)
class CornerStack:
    """The stack of corners: `least` to `most` of them, the first with plays below `top`, each other with fewer."""

    least: int
    most: int
    top: int


@dataclass(frozen=True)
class InstanceState:
    """The state of an operator."""

    one: EmittedModel
    op: str
    entries: tuple[StateEntry, ...]

    @property
    def name(self) -> str:
        """The model's."""
        return self.one.names.name

    @property
    def size(self) -> int:
        """Bytes of a snapshot."""
        return HEAD + sum(each.bytes for each in self.entries) + TAIL

    @cached_property
    def head(self) -> list[str]:
        """The first 12 bytes: magic, version, and the hash of the layout."""
        said = [f"{each.place} {each.kind} {each.sizes} {each.bits}" for each in self.entries]
        layout = hashlib.sha256("\n".join([self.op, *said]).encode()).digest()[:6]
        return [f"0x{byte:02x}u" for byte in MAGIC + struct.pack("<H", VERSION) + layout]

    @property
    def names(self) -> frozenset[str]:
        """Places without indices."""
        return frozenset(re.sub(r"\[\w\]", "", each.place) for each in self.entries)

    @property
    def deepest(self) -> int:
        """Most indices of a place."""
        return max(len(each.sizes) for each in self.entries)

    @property
    def put(self) -> list[str]:
        """The lines that append the state."""
        return [line for each in self.entries for line in each.put(self.name)]

    @property
    def get(self) -> list[str]:
        """The lines that read the state."""
        return [line for each in self.entries for line in each.get(self.name, self.limits(each))]

    @property
    def corners(self) -> CornerStack | None:
        """The stack of corners, if there is one."""
        if "corner.top" not in self.names:
            return None
        n = self.one.model.cascade.pi.n
        if self.one.family.arithmetic.fixed:
            return CornerStack(0, n, n + 1)
        return CornerStack(1, n + 1, n + 2)

    def limits(self, each: StateEntry) -> tuple[str, str] | None:
        """Least and most of a number, as expressions."""
        n, fixed = self.one.model.cascade.pi.n, self.one.family.arithmetic.fixed
        own, inverse = each.own, self.op == "inverse"
        if each.kind == "bool":
            return None
        counts = {
            "oldest": self.one.variant.waiting - 1, "released": n, "k": n, "top": n + 1, "rose": 2, "bits": 127,
            "status": 127, "scale": 63,
        }
        if own in counts and each.kind not in ("int32_t", "int64_t"):
            return "", f"{counts[own]}u"
        if each.type == "real_t" and "." not in each.place and (own in DRIVES or (inverse and own == "answer")):
            return "p->drive_min", "p->drive_max"
        if each.kind in REAL and own in ("pass", "next", "cap", "behind"):  # the largest number: never
            most = "FLT_MAX" if each.kind == "float" else "DBL_MAX"
            return f"-{most}", most
        if each.kind in REAL:
            return "-p->state_most", "p->state_most"
        if own == "next" and each.kind == "int64_t":
            return "-((int64_t)1 << 62)", "((int64_t)1 << 62)"  # HYSTGEN_FAR
        if own == "input" and each.kind == "int64_t":
            return "-((int64_t)1 << 33)", "((int64_t)1 << 33)"
        if own == "play" and fixed and self.one.variant.moves == "dashpot":
            return None  # remainders of every bit follow the plays
        if fixed and self.one.variant.chain:
            place = re.sub(r"\[\w\]", "", each.place)
            for form, name in OF_BLOCKS:
                if re.fullmatch(form, place):
                    if place.startswith("ageing") and own == "high":
                        return "0", "p->state_sum"
                    if name == "INVERSE":
                        return "p->state_gain", "p->state_inverse"
                    return f"-p->state_{name.lower()}", f"p->state_{name.lower()}"
        if each.type == "play_t" or each.place.endswith(("here.input", "undo.input", "corner[i].input")):
            return "p->state_least", "p->state_most"
        if own == "high" and each.place.startswith("corner"):
            bits = self.one.family.arithmetic.low_bits  # type: ignore[attr-defined]
            return f"-(p->state_sum >> {bits}u) - 1", f"(p->state_sum >> {bits}u) + 1"
        if each.kind == "int64_t":
            return "-p->state_sum", "p->state_sum"
        return None

    @property
    def resume(self) -> list[str]:
        """The lines that leave out what the next call computes again."""
        names, inverse, lines = self.names, self.op == "inverse", list[str]()
        chain = self.one.variant.chain
        place = "plays.here" if "plays.here.k" in names else "here"

        def copied() -> list[str]:
            return [
                f"self->undo.{each} = self->{place}.{each};"
                for each in ("input", "output", "k", "depth", "rising") if f"undo.{each}" in names
            ]

        if "sought" in names and "undo.k" in names:
            lines += ["if (!self->sought) {", *(f"    {each}" for each in copied()), "}"]
        if "before" in names and "plays.begin" in names and inverse and not chain:
            lines += [
                "if (self->before < self->plays.here.input || self->before > self->plays.here.input) {",
                *(f"    {each}" for each in copied()),
                "    self->undo.input = self->before;",
                "    self->undo.output = self->plays.start + (self->before - self->plays.begin) * self->plays.gain;",
                "    self->before = self->plays.here.input;",
                "}",
                *(f"self->plays.{each} = self->plays.here.input;" for each in ("next", "cap", "behind")
                  if f"plays.{each}" in names),
            ]
        if "usual" in names:
            curve = "self->parameters->model_curve.segment[self->here.k].slope"
            lines += [
                "if (self->usual) {",
                *(f"    {each}" for each in copied()),
                "    self->undo.input = self->before;",
                f"    self->undo.output -= ((int64_t)self->here.input - self->before) * (int64_t){curve};",
                "    self->usual = false;",
                "}",
                "self->next = -2147483647 - 1;",
            ]
        if "kink.k" in names:
            members = ("output", "input", "k", "depth")
            cleared = [f"self->kink.{each} = 0;" for each in members if f"kink.{each}" in names]
            if chain and "sought" in names:
                lines += ["if (!self->sought) {", *(f"    {each}" for each in cleared), "}"]
            elif not chain:
                lines += cleared
        if "plays.cap" in names:  # up to there, a step would follow the block of a corner unchecked
            lines.append("self->plays.cap = self->plays.next;")
        if "plays.sign" in names:
            lines.append(f"self->plays.sign = ({self.name}_real_t)(self->plays.here.rising ? 1 : -1);")
        return lines

    @property
    def holds(self) -> list[str]:
        """Conditions on a state."""
        found = [  # the Newton steps for a reciprocal converge from here
            f"(int64_t)self->{each.place} * self->{each.place.replace('gain', 'inverse')} >= ((int64_t)1 << 57) && "
            f"(int64_t)self->{each.place} * self->{each.place.replace('gain', 'inverse')} <= ((int64_t)3 << 57)"
            for each in self.entries
            if each.own == "gain" and self.one.family.arithmetic.fixed and "." in each.place
            and each.place.replace("gain", "inverse") in self.names
        ]
        if not self.corners:
            return found
        found += [
            f"{self.name}_{self.op}_holds(self, self->{place}.k, self->{place}.depth)"
            for place in ("plays.here", "here", "undo", "kink") if f"{place}.k" in self.names
        ]
        if "before" in self.names and "plays.begin" in self.names and not self.one.variant.chain:
            found += [
                f"self->{place} >= self->parameters->drive_min && self->{place} <= self->parameters->drive_max"
                for place in ("plays.here.output", "undo.output")
            ]
        return found


def instances(one: EmittedModel, types: Iterable[Piece]) -> list[InstanceState]:
    """The states of a model's operators; `types`: the final ones."""
    known = {piece.name.removeprefix("hystgen_"): piece for piece in types}
    lengths = {"HYSTGEN_N_PLAYS": one.model.cascade.pi.n, "HYSTGEN_CORNERS": one.corners}
    return [
        InstanceState(one, op, tuple(entries(known, f"{op}_t", "", (), lengths, one.family.meaning)))
        for op in one.options.operators
    ]


def functions(found: Sequence[InstanceState]) -> str:
    """The C that writes and reads states."""
    name = found[0].name
    return template("snapshot.c.j2", name=name, NAME=name.upper(), instances=found)
