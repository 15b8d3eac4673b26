"""The hand-written C of `c_runtime/` and of the folders of effects, as text for emitted files.

A file is a sequence of top-level pieces (functions, tables, types, constants). Emitted files contain only the pieces
that a model needs. Where a file has several forms of a piece, `#ifdef` on a fact of the model (`FACTS`) selects one, as
in a compiler. Names defined by a run time, which models may share, get its prefix; all others get the model's name.
"""

from __future__ import annotations

import functools
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import jinja2

from hystgen.arithmetic import FIXED, FLOATING, Arithmetic
from hystgen.emission import folding
from hystgen.emission.folding import Member, Members

FACTS = re.compile(r"HYSTGEN_(FIXED|CHAIN|FORWARD|INVERSE|REAL_IS_DOUBLE|REAL_IS_SHORT|HAS_\w+)")
"""Macros that state facts about a model. Conditions on them are decided at emission; others stay in the C."""

OPERATORS = ("forward", "inverse")
"""Files with `hystgen_operator_..` functions serve both operators: they are emitted once for each, under its name."""

FLOAT_KERNELS = (
    "front/tanh_{bits}.c",
    "front/atanh_{bits}.c",
    "front/envelope.c",
    "front/dead_zones.c",
    "plays/corners_float.c",
    "plays/loop_absorb.c",
    "plays/loop_solve.c",
)
CHAIN_TYPES = "compensator/chain/types.h"
"""The types of effects, for an editor; emission writes them from their declarations."""
CORNER_STATE = "compensator/corners/state.h"
"""The types of both instances in engine corners without effects."""
HELPERS = ("arithmetic/factors.c", "effects/gains.c")
"""Functions that several effects call, in every arithmetic."""
SIGNALS = {
    "hystgen_signal_t": "hystgen_sum_t", "hystgen_narrow_t": "int32_t", "hystgen_fine_t": "hystgen_play_t",
    "hystgen_travel_t": "hystgen_sum_t",
}
"""Types of signals between blocks in fixed point with effects. Elsewhere they are the types of codes, but in engine
loop without effects signals are as wide as sums of the plays."""

FINE = {
    "HYSTGEN_FINE_MIN": "HYSTGEN_DRIVE_MIN", "HYSTGEN_FINE_MAX": "HYSTGEN_DRIVE_MAX",
    "hystgen_clamp_fine": "hystgen_clamp_drive",
}
"""Names of numbers finer than a drive code in a model with effects, and their meaning elsewhere."""

SUMS = ("play_t", "reach_t", "sum_t")
"""Types of plays; in floating point every number has the same type."""

FACTORS = ("hystgen_number_t", "hystgen_factor_t")
"""The types of factors in a user's own block and in the catalogue's; in floating point ordinary numbers."""

FIXED_KERNELS = (
    "arithmetic/division.c",
    "plays/corners_fixed.c",
    "plays/loop_absorb.c",
    "plays/loop_solve_fixed.c",
    "front/curve.c",
)


APART = "HYSTGEN_APART "

CODED = (
    "hystgen_reference_from_code", "hystgen_drive_from_code", "hystgen_code_from_drive", "hystgen_inverse_step_code",
)
"""Calls of an inverse with converters."""

WATCHING = ("hystgen_health_init", "hystgen_health_update")
"""Calls of a watch over the model's error."""
ERASING = ("hystgen_degauss_init", "hystgen_degauss_step", "hystgen_degauss_done")
"""Calls of the sequence that erases the memory."""

CONSTANT = ("degauss_done",)
"""Calls without an instance that need no number of the model."""

EXCHANGING = ("hystgen_inverse_exchange",)
"""Calls of an inverse that can take other parameters."""

DRIVEN = frozenset([*CODED, *WATCHING, *ERASING, *EXCHANGING])
"""Calls of `compensator/api.h` that only some models have."""


@dataclass(frozen=True)
class Family(ABC):
    """An arithmetic in C: its run-time files and its types; `chain`: in a model with effects; `loop`: in a model
    without effects in engine loop.

    `kind`: the kind of arithmetic in file names; `form`: the module of emission that writes it; `ending`: suffix of
    file names, empty in floating point; files: `helpers` with functions that several effects call, `curves` for a
    memoryless part whose stages are not called one by one, `codes` for codes; `moves_apart`: moves of plays for which
    moving and bending take less stack in separate functions; `ordered`: moves for which a sum assumes that plays behind
    the first stationary one are stationary too; `opening`: headers before all code of a file; in a single header they
    stand between `opening_apart` and `closing`, so that they do not affect the code that includes it.
    """

    arithmetic: Arithmetic
    chain: bool = False
    loop: bool = False

    kind: ClassVar[str]
    form: ClassVar[str]
    ending: ClassVar[str]
    moves_apart: ClassVar[tuple[str, ...]]
    ordered: ClassVar[tuple[str, ...]] = ()
    curves: ClassVar[tuple[str, ...]]
    codes: ClassVar[tuple[str, ...]]
    helpers: ClassVar[tuple[str, ...]] = HELPERS
    opening: ClassVar[tuple[str, ...]] = ()
    opening_apart: ClassVar[tuple[str, ...]] = ()
    closing: ClassVar[tuple[str, ...]] = ()
    kernels: ClassVar[tuple[str, ...]] = ("kernels.h",)
    """Headers of the run time with the prototypes of its kernels."""
    build: ClassVar[tuple[str, ...]] = ("arithmetic/build.h",)
    """Headers that check how code is built."""
    shared_version: ClassVar[int] = 3
    """Version of the interface between emitted models and a shared run time."""

    @property
    def bits(self) -> str:
        """The arithmetic in names of the run time."""
        return self.arithmetic.short

    @property
    def shared_file(self) -> str:
        """The file name of a shared run time, without its ending."""
        return f"hystgen_runtime_{self.bits}"

    @property
    def real(self) -> str:
        """The type of inputs and answers."""
        return self.arithmetic.c_type

    @property
    def facts(self) -> frozenset[str]:
        """Facts about every model in this arithmetic."""
        return frozenset([*self.arithmetic.facts, *["HYSTGEN_CHAIN"] * self.chain])

    @property
    def types(self) -> Mapping[str, str]:
        """Types of the run time other than `real_t`."""
        return self.arithmetic.types

    @property
    def signals(self) -> dict[str, str]:
        """Names in code that models with and without effects share, and what they stand for here."""
        return dict.fromkeys((*SIGNALS, *FACTORS), "hystgen_real_t") | FINE

    @property
    def casts(self) -> bool:
        """Whether conversions to the type of inputs and answers are kept."""
        return False

    def storage(self, corners: bool) -> dict[str, str]:
        """What replaces the storage-class words before functions in this arithmetic, with engine corners or loop."""
        fixed = self.kind == "fixed"
        apart = {
            "IN_FLOAT_CORNERS": corners and not fixed, "BUT_IN_FLOAT_LOOP": corners or fixed, "IN_FLOAT": not fixed,
            "IN_FIXED": fixed, "IN_FIXED_BLOCK": fixed, "IN_FIXED_CHAIN": fixed and self.chain, "IN_CHAIN": self.chain,
        }
        otherwise = {"IN_FIXED": "static inline ", "IN_FIXED_CHAIN": "static inline "}
        words = {at: APART if holds else otherwise.get(at, "static ") for at, holds in apart.items()}
        found = {f"HYSTGEN_APART_{at} ": word for at, word in words.items()}
        return found | {"HYSTGEN_FIXED_KERNEL ": "HYSTGEN_KERNEL " if fixed else "HYSTGEN_API "}

    def corners(self, plays: int) -> int:
        """Number of corners that the corner engine keeps for this many plays."""
        return max(plays, 1)

    def meaning(self, kind: str) -> str:
        """The type that a name denotes here, without prefix."""
        own = self.signals.get(f"hystgen_{kind}", kind).removeprefix("hystgen_")
        return self.types.get(own, self.real if own in (*SUMS, "real_t") else own)

    @property
    def tables(self) -> tuple[str, ...]:
        """The run-time headers with the types of its tables."""
        return (f"plays/tables_{self.kind}.h",)

    @property
    def states(self) -> tuple[str, ...]:
        """The run-time headers with the types of its memory."""
        return (f"plays/state_{self.kind}.h",)

    @property
    def chain_blocks(self) -> tuple[str, ...]:
        """The files of blocks, which models with effects contain themselves, even with a shared run time; callees
        before callers."""
        from hystgen.effects import sources

        blocks, drives = sources.files("blocks"), sources.files("drives")
        return (*self.helpers, *blocks, "compensator/chain/drive_signal.c", *drives, "arithmetic/product.c")

    @property
    @abstractmethod
    def kernel_files(self) -> tuple[str, ...]:
        """The files of its kernels, callees before callers."""

    def soft(self, kernels: str) -> tuple[str, ...]:
        """The header with the corner engine's floating-point requirements, if these kernels use it."""
        return ("arithmetic/soft_float.h",) if "_SOFT_FLOAT" in kernels else ()


class FloatFamily(Family):
    """Floating point: one type for every number."""

    kind, form, ending = "float", "floating", ""
    moves_apart, ordered = ("relaxing", "dilated", "dashpot"), ("play", "dashpot")
    curves, codes = (), ()
    opening = ("arithmetic/rounding_begin.h",)
    opening_apart = ("arithmetic/rounding_push.h",)
    closing = ("arithmetic/rounding_end.h",)

    @property
    def kernel_files(self) -> tuple[str, ...]:
        return tuple(file.format(bits=self.bits) for file in FLOAT_KERNELS)

    def corners(self, plays: int) -> int:
        return plays + 1


class FixedFamily(Family):
    """Fixed point."""

    kind, form, ending, moves_apart = "fixed", "fixed", "_fixed", ()
    helpers = (*HELPERS, "effects/maps.c")
    curves, codes, kernel_files = ("front/front.c",), ("compensator/code.c",), FIXED_KERNELS

    @property
    def signals(self) -> dict[str, str]:
        if self.chain:
            return SIGNALS
        return super().signals | ({"hystgen_signal_t": "hystgen_sum_t"} if self.loop else {})

    @property
    def casts(self) -> bool:
        return self.loop


FAMILIES: dict[str, Family] = {
    **{name: FloatFamily(each) for name, each in FLOATING.items()},
    **{name: FixedFamily(each) for name, each in FIXED.items()},
}


@dataclass(frozen=True)
class Variant:
    """Properties of a model that determine which run-time files make up its operators.

    `fronts`: it has a memoryless part; `branches`: with two branches; `finer`: inputs of the plays, or with effects the
    signals in front of them, are finer than codes; `saturates`: output codes are limited; `start_list`: each play
    starts at its own value; `chain`: it has effects; `slew`: the drive's rate is limited; `braked`: a lag behind the
    limit is kept from overshooting; `quiet`: the drive stands still at rest; `turning`: a lag leads to two branches;
    `waiting`: number of delayed drives; `taps`: number of references that are summed; `calls`: those that its blocks
    add to the interface; `moves`, `bends`: how plays move and how they are bent, if not as ordinary plays;
    `elements`: number of elements in parallel with them; `tilted`: their drive is; `late_column`: a column acts
    through a lag; `coded`: the inverse takes and returns codes of converters; `watched`: the C watches the model's
    error; `erases`: it has a sequence of drives that erases the memory; `exchanges`: the inverse can take other
    parameters.
    """

    engine: str
    family: Family
    fronts: bool
    branches: bool
    finer: bool = False
    saturates: bool = False
    start_list: bool = False
    chain: bool = False
    slew: bool = False
    braked: bool = False
    quiet: bool = False
    turning: bool = False
    waiting: int = 0
    taps: int = 0
    calls: frozenset[str] = frozenset()
    moves: str = ""
    bends: str = ""
    elements: int = 0
    tilted: bool = False
    late_column: bool = False
    coded: bool = False
    watched: bool = False
    erases: bool = False
    exchanges: bool = False

    @property
    def apart(self) -> tuple[str, ...]:
        """First words of functions that are not inlined here."""
        storage = self.family.storage(self.engine == "corners")
        return (APART, *(word for word, here in storage.items() if here == APART))

    @property
    def facts(self) -> frozenset[str]:
        """Facts about the model, besides those of its arithmetic."""
        found = {
            "CORNERS": self.engine == "corners", "START_LIST": self.start_list,
            "FRONT": self.fronts, "TWO_BRANCHES": self.branches,
            "FINE_PLAYS": self.finer and not self.chain, "FINE_SIGNAL": self.finer and self.chain,
            "LIMITED_CODES": self.saturates, "SLEW_LIMIT": self.slew, "BRAKED_LAG": self.braked,
            "QUIET_DRIVE": self.quiet, "STEADY_LAG": self.turning, "DELAY": self.waiting, "PREVIEW": self.taps,
            "RELAXING_PLAYS": self.moves == "relaxing", "DILATED_PLAYS": self.moves == "dilated",
            "DASHPOT_PLAYS": self.moves == "dashpot", "PLAIN_PLAYS": self.moves == "play", "MOVED_PLAYS": self.moves,
            "BENT_PLAYS": self.bent, "BUMP": self.bends == "centre", "ELEMENTS": self.elements,
            "TILT": self.tilted, "LATE_COLUMN": self.late_column,
            "MOVES_APART": self.bent and self.moves in self.family.moves_apart,
            "ORDERED_PLAYS": self.moves in self.family.ordered,
            "SMOOTH_SUM": self.smooth,
        }
        return frozenset(f"HYSTGEN_HAS_{fact}" for fact, holds in found.items() if holds)

    @property
    def bent(self) -> bool:
        """Whether plays are bent."""
        return self.bends not in ("", "none")

    @property
    def smooth(self) -> bool:
        """Whether plays that are not bent are summed up with elements in parallel."""
        return self.elements > 0 and self.moves == "play" and not self.bent

    def sources(self) -> tuple[str, ...]:
        """The files with the functions of both operators, callees before callers."""
        files = ["compensator/clamp.c"]
        files += self.family.codes
        files += self.family.curves if self.fronts else ("front/front.c",)
        own = self._chain() if self.chain or self.engine == "loop" else self._corners()
        held = {
            "exchange": self.exchanges, "converter": self.coded, "health": self.watched, "degauss": self.erases
        }
        more = tuple(f"compensator/{name}.c" for name, there in held.items() if there)
        return (*files, "compensator/drive.c", *own, "compensator/status.c", *more)

    def _chain(self) -> tuple[str, ...]:
        """The files of a chain except its blocks: for a model with effects, or for engine loop."""
        from hystgen.effects.sources import files  # imported late, since a plain model has no effects

        chain = "compensator/chain/"
        loops, solve, refined = self.engine == "loop", f"{chain}plays_solve.c", f"{chain}refined_input.c"
        if not loops:
            plays: tuple[str, ...] = (refined, f"{chain}corners_{self.family.kind}.c")
        elif not self.moves:
            plays = (solve, f"{chain}plays.c", refined)
        elif not self.bends:
            plays = (solve, *files(f"{self.moves} alone"), refined)
        else:
            tried = (f"{chain}attempt.h",) * (self.family.kind == "float")
            moved = (*tried, *files("bends"), *files(self.moves), *files("elements") * bool(self.elements))
            plays = (*moved, f"{chain}moving_plays.c", f"{chain}moving_search.c", refined)
        brake = files("brake") if self.braked else ()
        entered = () if self.chain else (f"{chain}drive_signal.c",)
        signals = (*files("limits"), *entered, f"{chain}signals.c", *brake)
        start = (*("compensator/loop_start.c",) * loops, f"{chain}chain_start.c")
        settings = (f"{chain}settings.c",) if self.chain else ()
        travel = files("calls") if "travel" in self.calls else ()
        calls = (f"{chain}chain.c", *start, f"{chain}chain_calls.c", *settings, *travel)
        return (*signals, *plays, *calls)

    def _corners(self) -> tuple[str, ...]:
        corners, kind = "compensator/corners/", "_front" * self.fronts + self.family.ending
        return (f"{corners}forward.c", f"{corners}inverse{kind}.c", f"{corners}start.c")


@functools.cache
def data_folder(name: str) -> Path:
    """`templates`, `c_runtime` or `hystgen`: inside the installed package, or at the top of the checkout."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "_data" / name
    return installed if installed.is_dir() else package.parent / name


@functools.cache
def environment() -> jinja2.Environment:
    """The settings for all templates."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(data_folder("templates")),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
        auto_reload=False,
    )


def template(template: str, /, **values: object) -> str:
    """The text of a template filled in with these values."""
    return environment().get_template(template).render(values)


LANGUAGE = {
    "bool": 1, "float": 4, "double": 8, "int64_t": 8, "int32_t": 4, "int16_t": 2, "uint32_t": 4, "uint16_t": 2,
    "uint8_t": 1, "uint_least16_t": 2, "uint_least8_t": 1, "unsigned int": 0,
}
"""Bytes of standard types, which are also their alignments; 0 if they depend on the target."""


@dataclass(frozen=True)
class Field:
    """A member of a structure. Its type is one of the run time's, without prefix, a standard one or a pointer; an array
    has a `length` as written in C; `bits`: the width of a bit field; `written`: its line, if it stands in a file."""

    kind: str
    name: str
    comment: str = ""
    length: str = ""
    bits: int = 0
    written: str = ""

    def text(self) -> str:
        """Its declaration in C."""
        if self.written:
            return self.written
        kind = self.kind if "*" in self.kind else f"{self.kind} " if self.kind in LANGUAGE else f"hystgen_{self.kind} "
        size = f"[{self.length}]" if self.length else ""
        return f"{kind}{self.name}{size};" + (f" /* {self.comment} */" if self.comment else "")


@dataclass(frozen=True)
class Piece:
    """A top-level piece of C with the comment above it; `members`: if it is a structure."""

    name: str
    text: str
    uses: frozenset[str]
    members: tuple[Field, ...] = ()

    @functools.cached_property
    def code(self) -> str:
        """Its text without comments."""
        return _COMMENT.sub("", self.text)

    @property
    def contents(self) -> tuple[tuple[str, int], ...]:
        """Type and number of the values that it defines, if it is a constant."""
        found = _CONSTANT.search(self.code)
        return ((found[1], math.prod(map(int, re.findall(r"\d+", found[2])))),) if found else ()


_MEMBER = re.compile(
    r"^ *((?:const )?(?:hystgen_)?(?:unsigned int|\w+)(?: \(?\*)?) ?(\w+)\)?(?:\[([^\]]+)\])?(?: : (\d+))?;"
    r"(?: */\*.*?\*/)?\n",
    re.MULTILINE | re.DOTALL,
)
_CONSTANT = re.compile(r"^static const (?:hystgen_)?(\w+) \w+((?:\[\d+\])*) = ", re.MULTILINE)
_COMMENT = re.compile(r"/\*.*?\*/", flags=re.DOTALL)
_NAME = re.compile(r"\b(?:hystgen|HYSTGEN)_\w+")


def split_pieces(source: str) -> list[Piece]:
    """The top-level pieces of a file; the only preprocessor lines among them are constants."""
    pieces = []
    lines: list[str] = []
    depth = 0
    comment = False
    for line in source.splitlines():
        inside, comment = comment, False
        code = line
        if inside:
            _, comment_ends, code = line.partition("*/")
            comment = not comment_ends
        if "/*" in code:
            code = _COMMENT.sub("", code)
            code, opened, _ = code.partition("/*")
            comment = comment or bool(opened)
        constant = not depth and line.startswith("#define") and bool(re.match(r"#define \w+ .", line))
        if not depth and not constant and line.startswith("#"):
            lines = []
            continue
        if not depth and not inside and not line.strip():  # a comment before an empty line belongs to the file
            lines = []
            continue
        lines.append(line)
        depth += code.count("{") - code.count("}")
        if constant or (not depth and code.rstrip().endswith(("}", ";"))):
            pieces.append(piece_of("\n".join(lines) + "\n"))
            lines = []
    return pieces


def _defined_name(code: str) -> str:
    if "typedef" in code and (typedef := re.search(r"}\s*(hystgen_\w+);\s*$", code)):
        return typedef.group(1)
    declared = re.search(r"#define (HYSTGEN_\w+)|(hystgen_\w+)\s*[\[(]", code)
    assert declared, f"no name in: {code}"
    return declared.group(1) or declared.group(2)


@functools.cache
def _read(name: str) -> str:
    """A file of `c_runtime/`, or of the folder of an effect."""
    return (data_folder("hystgen" if name.startswith("effects/") else "c_runtime") / name).read_text(encoding="utf-8")


_CONDITION = re.compile(r"#\s*(ifdef|ifndef|if|elif|else|endif)\b(.*)")


def chosen(source: str, facts: Collection[str]) -> str:
    """The text of a file with its conditions on facts resolved; other conditions stay in it."""
    kept = []
    opened: list[tuple[bool, bool, bool]] = []  # condition on facts; a section was selected; this one is
    for line in source.splitlines(keepends=True):
        found = _CONDITION.match(line)
        if not found:
            if all(takes for *_, takes in opened):
                kept.append(line)
            continue
        word, names = found[1], _NAME.findall(found[2])
        if word.startswith("if"):
            on_facts = bool(names) and all(map(FACTS.fullmatch, names))
            holds = not on_facts or _holds(word, found[2], facts)
            opened.append((on_facts, holds, holds))
        elif opened[-1][0] and word != "endif":
            _, before, _ = opened[-1]
            holds = not before and (word == "else" or _holds(word, found[2], facts))
            opened[-1] = (True, before or holds, holds)
            continue
        on_facts = opened[-1][0]
        if word == "endif":
            opened.pop()
        if not on_facts and all(takes for *_, takes in opened):
            kept.append(line)
    return "".join(kept)


def _holds(word: str, condition: str, facts: Collection[str]) -> bool:
    """Whether a condition holds: on one name, or on several as in `defined(A) && !defined(B)`."""
    if word in ("ifdef", "ifndef"):
        return (condition.strip() in facts) == (word == "ifdef")
    terms = [re.fullmatch(r"(!?)defined\((\w+)\)", term.strip()) for term in condition.split("&&")]
    assert all(terms), f"not a condition on facts: {condition}"
    return all((term[2] in facts) == (not term[1]) for term in terms if term)


def forms(source: str, facts: Collection[str]) -> list[str]:
    """The text of a file with its conditions on facts resolved, once for each operator if it serves both. The argument
    `operator_x` is then named as in that operator's step."""
    moved = APART if "HYSTGEN_HAS_MOVES_APART" in facts else "static inline "
    source = source.replace("HYSTGEN_APART_IF_MOVED ", moved)
    if "hystgen_operator_" not in source:
        return [chosen(source, facts)]
    return [
        chosen(source, {*facts, f"HYSTGEN_{op.upper()}"})
        .replace("hystgen_operator_", f"hystgen_{op}_").replace("HYSTGEN_OPERATOR_", f"HYSTGEN_{op.upper()}_")
        .replace("operator_x", given)
        for op, given in zip(OPERATORS, ("v", "u"), strict=True)
    ]


@functools.cache
def _pieces_of(file: str, facts: frozenset[str]) -> list[Piece]:
    return [piece for text in forms(_read(file), facts) for piece in split_pieces(text)]


def _pieces(files: Iterable[str], facts: Collection[str]) -> list[Piece]:
    return [piece for file in files for piece in _pieces_of(file, frozenset(facts))]


def kernel_pieces(family: Family, facts: frozenset[str] = frozenset()) -> list[Piece]:
    """Every piece of every kernel file of an arithmetic, callees before callers; `facts`: of the model."""
    return _pieces(family.kernel_files, family.facts | facts)


def guards(variant: Variant) -> str:
    """Functions that keep the answers of a module with parameters from outside within their range."""
    return chosen(_read("compensator/within.c"), variant.family.facts | variant.facts)


def block_pieces(family: Family, texts: Iterable[str], name: str) -> list[Piece]:
    """The functions for blocks and snapshots that the texts of the module `name` use."""
    words = {word for text in texts for word in re.findall(rf"\b{name}_(\w+)", text)}
    return needed(_pieces(["compensator/block.c"], family.facts), sorted(f"hystgen_{word}" for word in words))


def carried(family: Family, pieces: Iterable[Piece]) -> list[Piece]:
    """The kernel pieces that `pieces` need but a shared run time keeps private."""
    shared = {piece.name for piece in _pieces(family.kernels, family.facts)}
    own = [piece for piece in kernel_pieces(family) if piece.name not in shared]
    return needed(own, sorted(used(pieces)))


def table_pieces(family: Family) -> list[Piece]:
    """The types of an arithmetic's tables."""
    return _pieces(family.tables, family.facts)


def memory_pieces(family: Family) -> list[Piece]:
    """The types of which an arithmetic's instances and tables consist."""
    return _pieces(family.states, family.facts)


def operator_pieces(
    variant: Variant, operators: Iterable[str], glue: str, calls: Mapping[str, Iterable[str]], own: Sequence[Piece],
    types: Iterable[Piece],
) -> list[Piece]:
    """The functions of a model's operators, including those in `glue`, without code that does nothing; `calls`: as for
    `api`; `own`: functions of a user's own blocks, which stay unchanged; `types`: those that no kernel uses."""
    family = variant.family
    blocks = family.chain_blocks if variant.chain else ()
    roots = [piece.name for piece in prototypes_of(variant, operators, calls)]
    facts = family.facts | variant.facts
    every = [*_pieces(blocks, facts), *own, *split_pieces(chosen(glue, facts)), *_pieces(variant.sources(), facts)]
    pieces = needed(every, roots)
    parsed = [(piece, None if piece in own else folding.parsed(piece.text)) for piece in pieces]
    kernels = [found for piece in (*kernel_pieces(family), *own) if (found := folding.parsed(piece.text))]

    def put(functions: Mapping[str, folding.Function]) -> list[Piece]:
        made = [
            piece if each is None or each == functions.get(piece.name) else piece_of(functions[piece.name].text())
            for piece, each in parsed if each is None or piece.name in functions
        ]
        return needed(made, roots)

    functions = folding.folded(
        [each for _, each in parsed if each], kernels, lambda functions: {each.name for each in put(functions)},
        variant.apart, members_of([*types, *pieces]), lambda kind: family.meaning(kind.removeprefix("hystgen_")),
    )
    return put(functions)


def declared_type(name: str, comment: str, fields: Iterable[Field]) -> Piece:
    """A structure in C."""
    members = tuple(fields)
    body = "\n".join(f"    {each.text()}" for each in members)
    return replace(piece_of(f"{comment}\ntypedef struct {{\n{body}\n}} hystgen_{name};\n"), members=members)


def piece_of(text: str) -> Piece:
    """The piece with this text."""
    code = _COMMENT.sub("", text)
    own = _defined_name(code)
    found = _MEMBER.finditer(text[text.index("{\n") + 2 :]) if "typedef struct" in code else ()
    members = (
        Field(each[1].rstrip().removeprefix("hystgen_"), each[2], "", each[3] or "", int(each[4] or 0), each[0].strip())
        for each in found
    )
    return Piece(own, text, frozenset(_NAME.findall(code)) - {own}, tuple(members))


def own_calls(variant: Variant) -> tuple[str, ...]:
    """The calls of `DRIVEN` that a model has."""
    return (
        *CODED * variant.coded, *WATCHING * variant.watched, *ERASING * variant.erases, *EXCHANGING * variant.exchanges
    )


def prototypes_of(variant: Variant, operators: Iterable[str], calls: Mapping[str, Iterable[str]]) -> list[Piece]:
    """Prototypes of a model's functions for users; `calls`: additional ones by operator."""
    every = {piece.name: piece for piece in _pieces(["compensator/api.h"], ())}
    more = [every[name] for name in own_calls(variant)]
    return [*(piece for op in operators for piece in _calls(op, calls.get(op, ()))), *more]


def _calls(operator: str, more: Iterable[str]) -> list[Piece]:
    """Prototypes of an operator: those of every model, and those named in `more` of models with effects."""
    prefix = f"hystgen_{operator}_"
    every = _pieces(["compensator/api.h"], ())
    usual = [piece for piece in every if piece.name.startswith(prefix) and piece.name not in DRIVEN]
    chain = {prefix + each for each in more}
    return [*usual, *(piece for piece in _pieces(["compensator/chain/api.h"], ()) if piece.name in chain)]


def state_pieces(variant: Variant, family: Family, operators: Iterable[str]) -> list[Piece]:
    """The types of instances."""
    every = _pieces([CORNER_STATE], family.facts | variant.facts)
    return needed(every, [f"hystgen_{op}_t" for op in operators])


def watch_pieces(variant: Variant) -> list[Piece]:
    """The type of a watch over the model's error, all of whose members are for users."""
    return _pieces(["compensator/health.h"], variant.family.facts) if variant.watched else []


def with_members(piece: Piece, kept: Iterable[Field]) -> Piece:
    """A structure with only these members."""
    comment = piece.text[: piece.text.index("typedef struct")].rstrip()
    return declared_type(_own_name(piece), comment, kept)


def members_of(
    types: Iterable[Piece], whole: Iterable[Piece] = (), objects: Mapping[str, str] | None = None
) -> Members:
    """The members of the structures among these pieces; `whole`: those that keep all; `objects`: as in `Members`."""
    found = {_own_name(each): {field.name: field.kind for field in each.members} for each in types if each.members}
    return Members(found, frozenset(map(_own_name, whole)), objects or {})


def _own_name(piece: Piece) -> str:
    return piece.name.removeprefix("hystgen_")


def without_unread(pieces: Iterable[Piece], members: Members, read: Collection[Member]) -> list[Piece]:
    """Functions without stores of plain values to members that are not read."""
    return [
        piece_of(text) if (text := members.without_stores(each.text, read)) != each.text else each for each in pieces
    ]


def with_named(pieces: Iterable[Piece], members: Members, named: Collection[Member]) -> list[Piece]:
    """The pieces, structures with only the members that functions name; none without a member."""
    made = []
    for each in pieces:
        own = _own_name(each)
        kept = [field for field in each.members if own in members.whole or members.used((own, field.name), named)]
        if kept or not each.members:
            made.append(each if len(kept) == len(each.members) else with_members(each, kept))
    return made


def needed(pieces: Iterable[Piece], roots: Iterable[str]) -> list[Piece]:
    """The pieces that `roots` need, in order; names in `roots` without a piece are defined elsewhere."""
    by_name = {piece.name: piece for piece in pieces}
    wanted: set[str] = set()
    queue = [name for name in roots if name in by_name]
    while queue:
        name = queue.pop()
        if name not in wanted:
            wanted.add(name)
            queue.extend(by_name[name].uses & by_name.keys())
    return [piece for name, piece in by_name.items() if name in wanted]


def used(pieces: Iterable[Piece]) -> set[str]:
    """All names that the pieces use."""
    return {name for piece in pieces for name in piece.uses}


def _joined(pieces: Iterable[Piece]) -> str:
    """The text of pieces, separated by empty lines unless a constant shares the comment of the previous one."""
    text = ""
    for piece in pieces:
        shared = piece.text.startswith("#define") and text.rpartition("\n\n")[2].count("#define")
        text += ("\n" if text and not shared else "") + piece.text
    return text


def render(pieces: Iterable[Piece], prefix: str, family: Family, static: bool) -> str:
    """Kernels as C text under `prefix`; `static` for files that contain them as their own."""
    text = _joined(pieces)
    text = _stored(text, family, corners=False)
    text = text.replace("HYSTGEN_API ", "static " if static else "")
    text = text.replace("HYSTGEN_KERNEL ", "HYSTGEN_APART " if static else "")
    return _named(text, prefix, family, prefix)


def _stored(text: str, family: Family, corners: bool) -> str:
    """The text with storage-class words replaced for this arithmetic."""
    for word, here in family.storage(corners).items():
        text = text.replace(word, here)
    return text


def render_carried(pieces: Sequence[Piece], name: str, prefix: str, family: Family) -> str:
    """Pieces of kernel files that model `name` contains besides the shared run time `prefix`, under its own name."""
    text = _joined(pieces)
    return _named(text, prefix, family, name, frozenset(piece.name for piece in pieces))


def render_operators(
    pieces: Iterable[Piece], name: str, corners: int, prefix: str, family: Family, carried: Sequence[Piece] = ()
) -> str:
    """Operators, or the types of their instances, as C text of the model `name` with the run time `prefix`.

    `corners`: number of corners that the corner engine keeps, 0 for engine loop; `carried`: as in `render_carried`.
    """
    text = _stored(_joined(pieces), family, corners > 0)
    text = text if family.chain else text.replace("HYSTGEN_ALONE ", "")
    known = frozenset(piece.name for piece in carried)
    return _named(text.replace("HYSTGEN_CORNERS", str(corners)), prefix, family, name, known)


def api(documented: Iterable[Piece], name: str, prefix: str, family: Family) -> str:
    """Prototypes of a model's functions below their documentation."""
    return _named("\n".join(piece.text for piece in documented), prefix, family, name)


def verbatim(files: Iterable[str], owner: str, family: Family, name: str) -> str:
    """Whole files without their first paragraph, for the module `name`; their messages name `owner`."""
    whole = [chosen(_read(file).partition("\n\n")[2], family.facts) for file in files]
    text = "\n".join(whole).replace('"hystgen: ', f'"{owner}: ')
    return _named(text, name, family, name)


@functools.cache
def _own(family: Family) -> frozenset[str]:
    """The names that a run time defines."""
    pieces = [*kernel_pieces(family), *_pieces((*family.tables, *family.states), family.facts)]
    enums = [piece.code for piece in pieces if "typedef enum" in piece.code]
    listed = [name for code in enums for name in re.findall(r"HYSTGEN_\w+", code)]
    return frozenset([*(piece.name for piece in pieces), *listed, *(f"hystgen_{kind}" for kind in family.types)])


def _named(
    text: str, prefix: str, family: Family, name: str, carried: frozenset[str] = frozenset()
) -> str:
    """The text with the names of a model and of its run time; `carried`: run-time names that the model itself
    defines."""
    signals = family.signals
    for shared, here in signals.items():
        if here == "hystgen_real_t" and not family.casts:
            text = text.replace(f"({shared})", "")
    text = _NAME.sub(lambda found: signals.get(found[0], found[0]), text)
    for kind in SUMS:
        if kind not in family.types:
            text = text.replace(f"(hystgen_{kind})", "").replace(f"hystgen_{kind}", "hystgen_real_t")
    for constant, value in family.arithmetic.constants.items():
        text = text.replace(constant, value)
    own = _own(family) - carried

    def renamed(found: re.Match[str]) -> str:
        before = prefix if found[0] in own else name
        upper = found[0].startswith("HYSTGEN")
        return (before.upper() if upper else before) + found[0][len("hystgen") :]

    return _NAME.sub(renamed, text)


def all_types(pieces: Iterable[Piece], prefix: str, family: Family) -> str:
    """These type definitions of the run time."""
    return _named(_joined(pieces), prefix, family, prefix)


def prototypes(prefix: str, family: Family) -> str:
    """Prototypes of all kernels."""
    return _named("".join(piece.text for piece in _pieces(family.kernels, family.facts)), prefix, family, prefix)
