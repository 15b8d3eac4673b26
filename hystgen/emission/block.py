"""Parameters that a module reads at run time: the structure that holds them in C, and the block that carries them.

All numbers of a model become members of one structure. Functions that use a number, or that call one that does, get a
pointer to it: those of an operator from their instance, the others as an argument. Array lengths and the code itself
stay compiled in; they are the layout, of which module and block each state the hash.
"""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import math
import re
import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from hystgen.emission import folding
from hystgen.emission.compensator import Columns, ConstantTable, EmittedModel, Macro
from hystgen.emission.runtime import Field, Piece, piece_of, split_pieces, template
from hystgen.emission.text import literal

MAGIC, VERSION = b"HYSB", 1
HEAD = struct.Struct("<4sHHI8s8s28s")
"""Magic, version of the format, 0, size of the block, layout, parameters, name. Then come the numbers and a CRC-32."""
REASONS = ("magic", "version", "layout", "size", "crc", "numbers")
"""Why a block is refused, in the order of the codes, which begin at 1."""

FORMATS = re.compile(r"(?:\w+_)?(?:BITS|DROP|LIFT|FRACTION|FINE|BELOW|HALVES|TURNS)|(?:\w+_)?PIECES|YIELDS")
"""Macros with small counts that follow from a unit's numbers; all others of this form are part of the layout."""
COUNTED = re.compile(r"(?:\w+_)?PIECES|YIELDS")
"""Those of them that count the pieces of a curve, for more of which there is room."""
STRUCTURE = re.compile(r"(?:\w+_)?(?:CODE_MIN|CODE_MAX|N_PLAYS|PREVIEW|LEAD|FASTEST|START_STEP|SAMPLE_TIME)")
"""Other macros that are part of the layout."""
KINDS = {
    "DRIVE_MIN": "real_t", "DRIVE_MAX": "real_t", "OUTPUT_MIN": "real_t", "OUTPUT_MAX": "real_t",
    "FINE_MIN": "play_t", "FINE_MAX": "play_t", "START": "play_t", "LARGEST_INPUT": "play_t",
    "BUMP_END": "play_t",
    "FORWARD_INIT_DRIVE": "real_t", "FORWARD_RESET_DRIVE": "real_t",
    "SLEW_RISING": "play_t", "SLEW_FALLING": "play_t", "SLEW_RISING_REST": "play_t", "SLEW_FALLING_REST": "play_t",
    "INVERSE_INIT_DRIVE": "real_t", "INVERSE_RESET_DRIVE": "real_t",
}
"""Types of numbers in fixed point that are narrower than 64 bits."""

STORED = {
    "float": "f", "double": "d", "int64_t": "q", "int32_t": "i", "int16_t": "h", "uint32_t": "I", "uint16_t": "H",
    "uint8_t": "B", "bool": "B", "uint_least16_t": "H", "uint_least8_t": "B", "unsigned int": "B",
}
"""How a number of each type is stored in a block."""
REAL = ("float", "double")


@dataclass(frozen=True)
class Leaf:
    """Numbers of one type among the members: a member, or one in an array of structures. `place`: the expression for
    one of them, with an index for each of `sizes`; `described`: whether they only describe the unit, as real numbers do
    in fixed point."""

    place: str
    kind: str
    sizes: tuple[int, ...]
    values: tuple[float | int, ...]
    described: bool = False

    @property
    def name(self) -> str:
        """Its name without indices."""
        return re.sub(r"\[\w\]", "", self.place)

    @property
    def stored(self) -> bytes:
        """Its numbers in a block."""
        return struct.pack(f"<{len(self.values)}{STORED[self.kind]}", *self.values)


@dataclass(frozen=True)
class UnitParameters:
    """The parameters of a module: the type in C (`declared`), its numbers, its pointers into itself (place and target),
    and `layout`: what has to agree between a module and a block, as text."""

    declared: str
    leaves: tuple[Leaf, ...]
    pointers: tuple[tuple[str, str], ...]
    layout: str
    name: str
    sha256: str = ""

    @cached_property
    def hash(self) -> bytes:
        """Identifies the layout."""
        return hashlib.sha256(self.layout.encode()).digest()[:8]

    @property
    def real(self) -> str:
        """The type of real numbers that are not just descriptions."""
        return next((leaf.kind for leaf in self.leaves if leaf.kind in REAL and not leaf.described), "")

    @property
    def groups(self) -> list[list[Leaf]]:
        """The numbers in the order of a block: real ones, then whole ones."""
        return [[leaf for leaf in self.leaves if (leaf.kind in REAL) == real] for real in (True, False)]

    @property
    def size(self) -> int:
        """Bytes of a block."""
        return HEAD.size + sum(len(leaf.stored) for leaf in self.leaves) + 4

    def placed(self) -> Iterator[tuple[Leaf, int]]:
        """Each leaf and where its first number is among those of a block."""
        at = 0
        for leaf in itertools.chain.from_iterable(self.groups):
            yield leaf, at
            at += len(leaf.stored)

    def block(self) -> bytes:
        """The block with these numbers."""
        numbers = b"".join(leaf.stored for group in self.groups for leaf in group)
        name = self.name.encode("ascii")[:28]
        head = HEAD.pack(MAGIC, VERSION, 0, self.size, self.hash, bytes.fromhex(self.sha256[:16]), name)
        return sealed(head + numbers)


def sealed(block: bytes) -> bytes:
    """A block with its CRC-32 at the end."""
    return block + struct.pack("<I", zlib.crc32(block))


def member(macro: str) -> str:
    """The member that stands for a macro."""
    name = macro.lower()
    return f"{name}_count" if name in ("yields", "pieces") else {"near": "near_by"}.get(name, name)


def words(made: UnitParameters | None) -> list[str]:
    """The bytes of a unit's block in C; none for constant tables."""
    return [f"0x{byte:02x}u" for byte in made.block()] if made else []


def number_macros(macros: Iterable[Macro], fixed: bool) -> dict[str, tuple[Macro, str]]:
    """The macros that are numbers of a unit, with their types, by name."""
    found = {}
    for macro in macros:
        name, value, _ = macro
        counted = value.endswith("u") or name.endswith("_BITS")
        if STRUCTURE.fullmatch(name) or (counted and not FORMATS.fullmatch(name)):
            continue
        if counted:
            kind = "uint16_t" if COUNTED.fullmatch(name) else "unsigned int"
        elif value in ("true", "false"):
            kind = "bool"
        elif not fixed:
            kind = "real_t"
        elif "." in value or "e" in value:
            kind = "double"
        else:
            kind = KINDS.get(name, "int64_t")
        found[name] = macro, kind
    return found


def threaded(
    pieces: Iterable[Piece], macros: Iterable[str], tables: Iterable[str], aliases: Mapping[str, str],
    guards: str,
) -> list[Piece]:
    """The pieces with a pointer to the parameters in place of these macros and tables; `aliases`: names that stand for
    others here; `guards`: functions that keep answers within their range."""
    read = {f"HYSTGEN_{name}": f"p->{member(name)}" for name in macros}
    known = split_pieces(guards)
    answers = {
        "hystgen_forward_step": "hystgen_answer", "hystgen_inverse_step": "hystgen_within_drives",
        "hystgen_forward_arrive": "hystgen_within_inputs", "hystgen_inverse_arrive": "hystgen_within_inputs",
    }
    pieces = list(pieces)
    if "hystgen_inverse_step" not in [piece.name for piece in pieces]:  # only a solution has a range of inputs
        del answers["hystgen_forward_arrive"]
    kept = {step: guard for step, guard in answers.items() if guard in [each.name for each in known]}
    pieces = [_guarded(piece, kept) for piece in pieces]
    called = {name for piece in pieces for name in piece.uses}
    pieces = [*(each for each in known if each.name in called), *pieces]
    read |= {name: f"p->{name.removeprefix('hystgen_')}" for name in tables}
    pieces = [
        piece_of(re.sub(r"\b\w+\b", lambda found: aliases.get(found[0], found[0]), piece.text))
        if piece.uses & aliases.keys() else piece for piece in pieces
    ]
    pieces = [
        piece_of(piece.text.replace("hystgen_inverse_carry(&other)", "hystgen_inverse_carry(&other, next)"))
        if piece.name == "hystgen_inverse_exchange" else piece for piece in pieces
    ]
    using = {piece.name for piece in pieces if piece.uses & read.keys()}
    while more := {piece.name for piece in pieces if piece.uses & using} - using:
        using |= more
    functions = {piece.name: folding.parsed(piece.text) for piece in pieces}
    given = {
        name for name in using
        if (each := functions[name]) and not each.operator
    }

    def changed(piece: Piece) -> Piece:
        function = functions[piece.name]
        starts = re.fullmatch(r"hystgen_(forward|inverse)_init", piece.name)
        if piece.name not in using and not starts:
            return piece

        def through(text: str) -> str:
            for name in given & piece.uses:
                text = re.sub(rf"\b({name})\((\)?)", lambda found: f"{found[1]}(p" + (found[2] or ", "), text)
            return re.sub(r"\b(?:hystgen|HYSTGEN)_\w+", lambda found: read.get(found[0], found[0]), text)

        if function is None:
            return piece_of(through(piece.text))
        body, parameters = through(function.body), function.parameters
        pointer = "const hystgen_parameters_t *p"
        if starts:
            parameters, body = (*parameters, pointer), f"{CLEARED}    self->parameters = p;\n{body}"
        elif function.operator and re.search(r"\bp\b", body):
            body = f"    const hystgen_parameters_t *const p = self->parameters;\n{body}"
            if piece.name == "hystgen_inverse_carry":
                parameters, body = (*parameters, f"{pointer[:-1]}next"), f"    self->parameters = next;\n{body}"
        elif not function.operator:
            parameters = (pointer, *(each for each in parameters if each != "void"))
        return piece_of(dataclasses.replace(function, parameters=parameters, body=body).text())

    return [changed(piece) for piece in pieces]


def _guarded(piece: Piece, guarding: Mapping[str, str]) -> Piece:
    """A step whose answers are finite and, for drives, within their range, whatever the numbers."""
    function = folding.parsed(piece.text)
    guard = guarding.get(piece.name)
    if function is None or guard is None:
        return piece
    body = re.sub(r"^( *)return ([^;]+);", rf"\1return {guard}(\2);", function.body, flags=re.MULTILINE)
    return piece_of(dataclasses.replace(function, body=body).text())


CLEARED = """\
    volatile unsigned char *byte = (volatile unsigned char *)self; /* else a compiler may call memset */
    size_t left = sizeof *self;
    while (left > 0) { /* a snapshot contains members that no step has set yet */
        --left;
        byte[left] = 0;
    }
"""
"""Beginning of an init."""

INSTANCE = Field("const hystgen_parameters_t *", "parameters", "the caller's")
"""The member of an instance that leads to its parameters."""

_TABLE = re.compile(
    r"^static const (?:(\w+) (\w+)((?:\[\d+\])*)|struct \{.*?\} (\w+)) = (.*);$", re.MULTILINE | re.DOTALL
)
_TOKEN = re.compile(r"/\*.*?\*/|[{},]|[^{},\s](?:[^{},]*[^{},\s])?", re.DOTALL)


def _parsed(text: str) -> list:  # type: ignore[type-arg]
    """An initializer as nested lists of words."""
    stack: list[list] = [[]]  # type: ignore[type-arg]
    for word in _TOKEN.findall(re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)):
        if word == "{":
            stack.append([])
        elif word == "}":
            stack[-2].append(stack.pop())
        elif word != ",":
            stack[-1].append(word)
    return stack[0][0]  # type: ignore[no-any-return]


def read(word: str) -> int:
    """The whole number that a literal denotes, as `hystgen.emission.text.literal` writes it."""
    first, *rest = word.strip().replace("(", "").replace(")", "").split(" - ")
    return int(first.rstrip("uL")) - sum(int(each.rstrip("uL")) for each in rest)


def value(word: str, kind: str) -> float | int:
    """The number of a type that a literal denotes."""
    word = re.sub(r"^\((.*)\)$", r"\1", word.strip())
    if kind == "float":
        return float(np.float32(word.rstrip("f")))
    return float(word) if kind == "double" else read(word)


class _Types:
    """The types of a module's tables and the values of its constants."""

    def __init__(self, one: EmittedModel, pieces: Iterable[Piece]) -> None:
        self.one = one
        self.pieces = {piece.name.removeprefix("hystgen_"): piece for piece in pieces}
        enums = (re.findall(r"HYSTGEN_(\w+) = (\d+)", piece.code) for piece in self.pieces.values())
        self.values = {name: int(value) for found in enums for name, value in found} | {"true": 1, "false": 0}

    def bare(self, kind: str) -> str:
        """A type's name without prefix."""
        return kind.removeprefix(f"{self.one.names.rt}_").removeprefix(f"{self.one.names.name}_")

    def members(self, kind: str) -> tuple[Field, ...]:
        """The members of a structure; none for a plain type."""
        piece = self.pieces.get(kind)
        return piece.members if piece else ()

    def value(self, word: str, kind: str) -> float | int:
        """The number that a word of C denotes."""
        word = re.sub(r"^\((.*)\)$", r"\1", word)
        if word in self.values:
            return self.values[word]
        for prefix in (self.one.names.RT, self.one.names.NAME):
            if word.removeprefix(f"{prefix}_") in self.values:
                return self.values[word.removeprefix(f"{prefix}_")]
        return value(word, kind)


def _leaves(
    types: _Types, kind: str, place: str, sizes: tuple[int, ...], words: Sequence[object]
) -> Iterator[tuple[str, str, tuple[int, ...], list[object]]]:
    """The numbers in one value for each of `words`: place, type, sizes and words."""
    if fields := types.members(kind):
        for at, field in enumerate(fields):
            lengths = () if "*" in field.kind else tuple(map(int, re.findall(r"\d+", field.length)))
            own, inner = [word[at] for word in words], f"{place}.{field.name}"  # type: ignore[index]
            for _ in lengths:
                inner += f"[{'ijk'[inner.count('[')]}]"
                own = [each for word in own for each in word]
            kind = f"{field.kind})[{field.length}]" if field.kind.endswith("(*") else field.kind
            yield from _leaves(types, kind, inner, sizes + lengths, own)
    else:
        meant = kind if "*" in kind else types.one.family.meaning(kind)
        yield place, meant, sizes, list(words)


CURVES = re.compile(r"(\w+)_(knot|scale|coefficient)|yields|(?:\w+_)?piece")
"""Tables with an entry for each piece of a curve, whose number follows from a unit's numbers."""


def capacity(pieces: int, wanted: int) -> int:
    """How many pieces of a curve there is room for: as many as `wanted`, or a power of two from 64 on."""
    return wanted if wanted >= pieces else max(64, 1 << (pieces - 1).bit_length())


def parameters(
    one: EmittedModel, macros: Mapping[str, tuple[Macro, str]], tables: Sequence[ConstantTable],
    pieces: Iterable[Piece], code: Sequence[Piece], sha256: str, wanted: Mapping[str, int] = MappingProxyType({}),
) -> UnitParameters:
    """The parameters of a module with these numbers and tables; `pieces`: types; `code`: functions."""
    types, name, fixed = _Types(one, pieces), one.names.name, one.family.kind == "fixed"
    lines, leaves, pointers = [], list[Leaf](), list[tuple[str, str]]()
    curves = (CURVES.fullmatch(table.name.removeprefix(f"{name}_")) for table in tables)
    counts = {
        found[1]: table.contents[0][1]
        for found, table in zip(curves, tables, strict=True) if found and found[2] == "knot"
    }
    for own, ((_, value, comment), kind) in macros.items():
        meant = one.family.meaning(kind)
        shown = f"{name}_real_t" if kind == "real_t" else meant
        lines.append(f"    {shown} {member(own)};" + (f" /* {comment} */" if comment else ""))
        leaves.append(Leaf(member(own), meant, (), (types.value(value, meant),), fixed and meant in REAL))
    for table in tables:
        found = _TABLE.search(table.text)
        assert found, table.text
        place = table.name.removeprefix(f"{name}_")
        words = _parsed(found[5])
        if isinstance(table, Columns):
            kind = one.family.meaning(types.bare(table.typed))
            inside = " ".join(f"{table.typed} {own}[{len(values)}];" for own, values in table.columns)
            lines.append(f"    struct {{ {inside} }} {place};")
            for (own, values), column in zip(table.columns, words, strict=True):
                numbers = tuple(types.value(word, kind) for word in column)
                leaves.append(Leaf(f"{place}.{own}[i]", kind, (len(values),), numbers, fixed and kind in REAL))
            continue
        lengths = tuple(map(int, re.findall(r"\d+", found[3])))
        if curve := CURVES.fullmatch(place):
            pieces_ = counts.get(curve[1], lengths[0])
            entries = lengths[0] // pieces_
            room = capacity(pieces_, wanted.get(place, 0) // entries)
            lengths = (room * entries, *lengths[1:])
            words += words[-entries:] * (room - pieces_)
        lines.append(f"    {found[1]} {place}{''.join(f'[{length}]' for length in lengths)};")
        flat = [words]
        for index, _ in zip("ijk", lengths, strict=False):
            place += f"[{index}]"
            flat = [each for word in flat for each in word]
        for where, meant, sizes, written in _leaves(types, types.bare(found[1]), place, lengths, flat):
            if "*" in meant:
                pointers += _targets(where, meant, written, name)
            else:
                numbers = tuple(types.value(str(word), meant) for word in written)
                leaves.append(Leaf(where, meant, sizes, numbers, fixed and meant in REAL))
    lines.append("    uint32_t crc; /* of the block */")
    body = "\n".join(lines)
    declared = (
        f"/* The numbers of a unit, set by {name}_load. It points into itself: load it again rather than copy it. */\n"
        f"typedef struct {{\n{body}\n}} {name}_parameters_t;\n"
    )
    members = [f"{leaf.kind} {leaf.place} {leaf.sizes}" for leaf in leaves]
    said = [" ".join(piece.code.split()) for piece in code]
    layout = "\n".join([*members, *map(str, pointers), *said])
    return UnitParameters(declared, tuple(leaves), tuple(pointers), layout, name, sha256)


def _targets(where: str, kind: str, words: Sequence[object], name: str) -> Iterator[tuple[str, str]]:
    """Each pointer of an array and where it points to."""
    cast = f"({kind.replace('hystgen', name)})" if "(*)" in kind else ""
    for index, word in enumerate(words):
        target = "NULL" if word == "NULL" else f"{cast}to->{str(word).removeprefix(f'{name}_')}"
        yield where.replace("[i]", f"[{index}]"), target


WIDEST = {"int64_t": 2**63 - 1, "int32_t": 2**31 - 1, "int16_t": 2**15 - 1}
SHIFTS, SHORT_SHIFT, SLOPE_SHIFTS, SCALES = (21, 82), 64, (1, 29), (0, 31)
"""Shifts that `hystgen_times`, `hystgen_short_times`, `hystgen_divide_by_slope` and `hystgen_curve` take."""
LARGEST_REST = (1 << 30) - 1
"""Largest rounding remainder of a ramp (c_runtime, HYSTGEN_REST_BITS)."""
RISING = frozenset(["way", "reach", "threshold", "knot", "break_x", "break_y", "begin"])
"""Members over which an algorithm searches, or which it passes one after the other."""
WIDER = {True: 16.0, False: 1.25}
"""Factor by which a unit's number may differ from the largest one of its kind in the unit that the module was emitted
from, in floating point and in codes. In codes this is one bit, which sums of products have to spare."""
COMPARED = re.compile(r"(?:.*\.)?(?:hold|last|begin)")
"""Members in codes with which a step only compares, so that they may be twice as large: they follow from several of a
unit's numbers. Of 12 units of `worn` whose numbers differ by 5 %, the factor 1.25 left out 7."""
STATES = re.compile(r"state_\w+")
"""Limits of states, which contain a format: a power of two that grows by one where a unit's number passes another."""
FORMAT = ("lift", "drop", "bits")
"""[bits] Formats of a fixed-point block, which may be one bit finer or coarser than those of the module's own unit."""
SCALED = re.compile(r"\w+_term\.late\.mantissa")
"""Factors that contain such a format, and so may be twice as large."""


class NumberLimits(NamedTuple):
    """Limits of `length` numbers; `rises`: 1 if they must not fall; `TOGETHER` if all of them may be as large as `sum`;
    else more for that many coefficients of each of several polynomials: the limits are those of the first of them, and
    the others may together be as large as `sum`."""

    least: float | int
    most: float | int
    length: int
    rises: int
    sum: int = 0


ABOVE = 255
"""`rises` of the upper end of a range, which comes right after the lower one."""
TOGETHER = 254
"""`rises` of numbers whose sum has a limit."""


def exact(x: float | int) -> NumberLimits:
    """Only this number."""
    return NumberLimits(x, x, 1, 0)


def rows(made: UnitParameters) -> Iterator[tuple[Leaf, list[NumberLimits]]]:
    """The limits of the numbers of every leaf, for units like this one."""
    typical = {
        kind: max((abs(x) for leaf in made.leaves if leaf.kind == kind for x in leaf.values if not never(x, kind)),
                  default=0)
        for kind in STORED
    }
    places = {leaf.name: leaf for leaf in made.leaves}
    targets = [(re.sub(r"\[\w*\]", "", place), target.rpartition("->")[2]) for place, target in made.pointers]
    for leaf in made.leaves:
        if leaf.described:
            continue
        size = _size_of_zero(leaf, places) or typical[leaf.kind]
        found = [NumberLimits(*own, count, 0) for own, count in _runs(leaf, size, places, targets)]
        member = re.split(r"[._]", leaf.name)[-1]
        if member == "step":
            found = [exact(x) for x in leaf.values]
        if member == "max":
            found = [found[0]._replace(rises=ABOVE)]
        if member == "weight" and leaf.kind in WIDEST and len(found) == 1:
            largest_sum = int(WIDER[False] * sum(map(abs, leaf.values)))
            found = [found[0]._replace(rises=TOGETHER, sum=largest_sum)]
        if member in RISING and len(leaf.sizes) == 1:
            found = [row._replace(rises=1) for row in found]
        if member == "slope" and leaf.kind == "uint32_t":  # the last one belongs to no play
            found = [found[0]._replace(length=found[0].length - 1, rises=1), exact(leaf.values[-1])]
        if member == "coefficient":
            knots = places[f"{leaf.name.removesuffix('coefficient')}knot"].sizes[0]
            each = leaf.sizes[0] // knots
            largest = max(*map(abs, leaf.values[::each]), max(_beyond_first(leaf.values, each)))
            found = [row._replace(rises=each, sum=min(int(WIDER[False] * largest), 2**31 - 1)) for row in found]
        elif len(leaf.sizes) == 2 and leaf.kind in WIDEST and len(found) == 1:
            each = leaf.sizes[1]
            largest = max(_beyond_first(leaf.values, each))
            low, high = _box(leaf.values[::each], leaf.kind, size, WIDER[False])
            found = [NumberLimits(low, high, len(leaf.values), each, max(1, int(largest * WIDER[False])))]
        yield leaf, found


def _size_of_zero(leaf: Leaf, places: Mapping[str, Leaf]) -> int:
    """How large a whole number may be that is 0 in the module's own unit: plays as large as their range, and signals of
    a chain as its largest level; 0 if any size will do."""
    if leaf.name in ("start", "state_least", "state_most"):
        ends = (places.get(f"model_tables.{end}") for end in ("least", "most"))
        return max((abs(int(x)) for end in ends if end for x in end.values), default=0)
    level = places.get("largest_level")
    return int(level.values[0]) if level and leaf.kind == "int64_t" else 0


def never(x: float | int, kind: str) -> bool:
    """Whether a number stands for one that is never reached."""
    return abs(x) >= {"float": 1e38, "double": 1e300, "uint32_t": 2**32 - 1}.get(kind, 2**62)


def _runs(
    leaf: Leaf, typical: float | int, places: Mapping[str, Leaf],
    targets: Sequence[tuple[str, str]],
) -> Iterator[tuple[tuple[float | int, float | int], int]]:
    """Limits of the numbers of a leaf, and how many of them in a row have these."""
    box: tuple[float | int, float | int]
    kind, usual = leaf.kind, [x for x in leaf.values if not never(x, leaf.kind)]
    member = leaf.name.rpartition(".")[2]
    if member == "mantissa":
        box = -WIDEST[kind], WIDEST[kind]
    elif member.endswith("reciprocal") and leaf.kind not in REAL:
        box = int(min(usual) > 0), 2**32 - 1
    elif member.endswith("_rest") and kind == "int32_t":
        box = -LARGEST_REST, LARGEST_REST
    elif kind in (*REAL, *WIDEST) or (kind == "uint32_t" and usual):
        compared = kind in WIDEST and (COMPARED.fullmatch(leaf.name) or STATES.fullmatch(leaf.name))
        box = _box(usual, kind, typical, 2.0 * WIDER[False] if compared else WIDER[kind in REAL])
    elif kind == "bool":
        box = 0, 1
    else:
        box = _small(leaf, member, places, targets)
    for off, run in itertools.groupby(leaf.values, lambda x: never(x, kind)):
        values = list(run)
        if off:
            yield from (((x, x), 1) for x in values)
        else:
            yield box, len(values)


def _box(
    values: Sequence[float | int], kind: str, typical: float | int, wider: float
) -> tuple[float | int, float | int]:
    """Limits around numbers: of their sign, and at most a factor larger."""
    real = kind in REAL
    least, most = min(values, default=0), max(values, default=0)
    largest = wider * (max(-least, most) or typical)
    low, high = -largest, largest
    if least > 0:
        low = least / wider if real else max(1, int(least / wider))
    elif least == 0 and most > 0:
        low = 0
    elif most < 0:
        high = most / wider if real else min(-1, int(most / wider))
    if real:
        return low, high
    end = WIDEST.get(kind, 2**32 - 1)
    return max(int(low), -end), min(int(high), end)


def _small(
    leaf: Leaf, member: str, places: Mapping[str, Leaf], targets: Sequence[tuple[str, str]]
) -> tuple[int, int]:
    """Limits of counts, indices and bits."""
    least, most = int(min(leaf.values)), int(max(leaf.values))
    around = leaf.name.rpartition(".")[0]
    if member in ("top", "risen"):
        segments = max(len(each.values) for name, each in places.items() if name.endswith("segment.way"))
        return int(member == "top"), segments - 1 if member == "top" else segments - 2
    if member == "rose":
        return least, most
    if COUNTED.fullmatch(leaf.name.upper().removesuffix("_COUNT")):
        first = leaf.name.removesuffix("_pieces").removesuffix("s_count").removesuffix("_count")
        curve = next(each for name, each in places.items() if re.match(rf"{first}(_knot|s?\.|s?$)", name))
        return 1, curve.sizes[0]
    led = (each for place, each in targets if place.rpartition(".")[0] == around and CURVES.fullmatch(each))
    if member in ("n", "pieces") and (table := next(led, "")):
        return 1, next(each for name, each in places.items() if re.match(rf"{table}(\.|$)", name)).sizes[0]
    if leaf.kind in ("uint_least16_t", "uint16_t") or member == "degree":
        return least, most
    if member == "shift":
        low, high = SHIFTS if f"{around}.mantissa" in places else SLOPE_SHIFTS
        return min(low, least), high if most > SHORT_SHIFT else min(high, SHORT_SHIFT)
    if member in FORMAT:
        return max(least - 1, 0), most + 1
    return SCALES if member.endswith("scale") else (least, most)


class FactorPlace(NamedTuple):
    """Limit of `length` factors, as a mantissa from 2^30 on and a shift, and of the sum of their sizes, at this shift;
    `mantissa` and `shift`: where the first ones are among the numbers of a block."""

    mantissa: int
    shift: int
    length: int
    most: int
    most_shift: int
    sum: int


def factors(made: UnitParameters) -> Iterator[FactorPlace]:
    """The limits of all factors in fixed point, which have a mantissa and a shift."""
    places = {leaf.name: (at, leaf) for leaf, at in made.placed()}
    for name, (begin, leaf) in places.items():
        if name.endswith(".mantissa"):
            shifts_at, shifts = places[f"{name.removesuffix('mantissa')}shift"]
            sizes = [Fraction(abs(int(m)), 1 << int(s)) for m, s in zip(leaf.values, shifts.values, strict=True)]
            wider = Fraction(WIDER[False]) * (2 if SCALED.fullmatch(name) else 1)
            largest = max(sizes) * wider or Fraction(1, 1 << SHIFTS[0])
            shift = 0
            while largest * (1 << shift) < 1 << 30:
                shift += 1
            most, every = (int(x * (1 << shift)) for x in (largest, max(largest, sum(sizes) * wider)))
            yield FactorPlace(begin, shifts_at, len(leaf.values), min(most, 2**31 - 1), shift, every)


def _beyond_first(values: Sequence[float | int], each: int) -> Iterator[float | int]:
    """The sums of the magnitudes of all coefficients but the first of polynomials with so many."""
    return (sum(map(abs, values[i + 1 : i + each])) for i in range(0, len(values), each))


def fits(leaf: Leaf, found: Sequence[NumberLimits], values: Sequence[float | int]) -> bool:
    """Whether numbers are within the limits of a leaf."""
    at = 0
    for row in found:
        own = values[at : at + row.length]
        at += row.length
        if outside(row, own):
            return False
    return leaf.kind not in REAL or all(map(math.isfinite, values))


def outside(row: NumberLimits, own: Sequence[float | int]) -> str:
    """What is wrong with the numbers of a row; empty if nothing is."""
    each = 1 if row.rises in (ABOVE, TOGETHER) else max(row.rises, 1)
    for x in own[::each]:
        if not row.least <= x <= row.most:
            return f"{x:.6g}, from {row.least:.6g} to {row.most:.6g}"
    if row.rises == 1 and any(b < a for a, b in itertools.pairwise(own)):
        return "numbers that have to rise and do not"
    together = sum(map(abs, own)) if row.rises == TOGETHER else max(_beyond_first(own, each)) if each > 1 else 0
    return f"together {together:.6g}, at most {row.sum:.6g}" if together > row.sum else ""


def factors_outside(row: FactorPlace, numbers: bytes) -> str:
    """What is wrong with the factors of a row in the numbers of a block; empty if nothing is."""
    mantissas = struct.unpack_from(f"<{row.length}i", numbers, row.mantissa)
    shifts = numbers[row.shift : row.shift + row.length]
    sizes = [Fraction(abs(m), 1 << s) for m, s in zip(mantissas, shifts, strict=True)]
    for found, most in ((max(sizes), row.most), (sum(sizes), row.sum)):
        if found > Fraction(most, 1 << row.most_shift):
            return f"{float(found):.6g}, at most {most / 2**row.most_shift:.6g}"
    return ""


def _size(leaf: Leaf) -> int:
    """Bytes of each of its numbers, negative if they have a sign."""
    size = struct.calcsize(f"<{STORED[leaf.kind]}")
    return -size if leaf.kind in WIDEST else size


def loader(made: UnitParameters) -> str:
    """The C that loads a block."""
    real, whole = made.groups
    found = {leaf.place: own for leaf, own in rows(made)}
    placed = [list(map(str, each)) for each in factors(made)]
    described = sum(len(each.values) for each in real if each.described)
    tables = [("factor", placed, "{}, at"), *(
        (kind, [
            [literal(exact(row.least)), literal(exact(row.most)), f"{row.length}u", f"{row.rises}u"]
            for leaf in real if leaf.kind == kind and not leaf.described for row in found[leaf.place]
        ], "{}, &at")
        for kind, exact in (("float", np.float32), ("double", float))
    ), ("whole", [
        [*(literal(int(x)) for x in row[:2]), f"{row.length}u", str(_size(leaf)), f"{row.rises}u", literal(row.sum)]
        for leaf in whole for row in found[leaf.place]
    ], "{}, &at")]
    ranges = [(kind, f"{kind}_range", each) for kind, each, _ in tables if each]
    checks = [
        f"{made.name}_{kind}s_fit({form.format(f'{made.name}_{kind}_range, {len(each)}u')})"
        for kind, each, form in tables if each
    ]
    if described:  # the real numbers of a block in fixed point, which come before the whole ones
        checks.insert(-1, f"{made.name}_described({described}u, &at)")
    fill = []
    for each in (*real, *whole):
        read = f"{made.name}_{each.kind}(&at)"
        if each.kind not in REAL:
            read = f"{made.name}_whole(&at, {_size(each)})"
            if each.kind != "int64_t":
                read = f"{read} != 0" if each.kind == "bool" else f"({each.kind}){read}"
        lines = [f"to->{each.place} = {read};"]
        for index, size in reversed([*zip("ijk", each.sizes, strict=False)]):
            lines = [f"for ({index} = 0; {index} < {size}u; ++{index}) {{", *(f"    {line}" for line in lines), "}"]
        fill += lines
    return template(
        "parameters.c.j2", name=made.name, NAME=made.name.upper(), ranges=ranges, checks=checks, fill=fill,
        pointers=made.pointers, hash=[f"0x{byte:02x}u" for byte in made.hash], version=VERSION, size=made.size,
        head=HEAD.size, deepest=max(len(each.sizes) for each in made.leaves),
    )
