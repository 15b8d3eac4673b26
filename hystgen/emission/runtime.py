"""The hand-written C of `c_runtime/`, as text to be carried by emitted files.

A file is a sequence of top-level pieces (functions, tables, types, constants). Only the pieces that a model needs are
carried. Names that a run time defines, which models may share, have its prefix; all others have the model's name.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from hystgen.arithmetic import ARITHMETICS, Arithmetic
from hystgen.compensator.chain.blocks import KINDS
from hystgen.emission import folding

VERSION = 2  # of the interface between emitted models and a shared run time

FLOAT_KERNELS = (
    "tanh_{bits}.c",
    "atanh_{bits}.c",
    "envelope_forward.c",
    "envelope_inverse.c",
    "dead_zone_forward.c",
    "dead_zone_inverse.c",
    "corners_float.c",
    "loop_absorb.c",
    "loop_solve.c",
)
CHAIN_TYPES = ("hystgen_chain_tables.h", "hystgen_chain_state.h")
CHAIN_BLOCKS = (
    *(kind.file for kind in KINDS), "delay.c", "delay_float.c", "preview.c", "preview_float.c", "entered_float.c",
    "quiet.c", "product_float.c", "lag_steady.c",
)  # fmt: skip
FIXED_CHAIN_TYPES = ("hystgen_chain_fixed_tables.h", "hystgen_chain_fixed_state.h")
FIXED_CHAIN_BLOCKS = (
    "times.c", "creep_fixed.c", "lag_fixed.c", "lag_exact_fixed.c", "braked_fixed.c", "gain_fixed.c", "ageing_fixed.c",
    "friction_fixed.c", "heat_fixed.c", "mode_fixed.c", "clock_fixed.c", "delay.c", "delay_fixed.c", "preview.c",
    "preview_fixed.c", "entered_fixed.c", "quiet.c", "bend.c", "stops.c", "product_fixed.c",
    "lag_steady_fixed.c",
)  # fmt: skip
"""Files that models with effects carry themselves, even with a shared run time."""

SIGNALS = {
    "hystgen_signal_t": "hystgen_sum_t", "hystgen_fine_t": "hystgen_play_t", "hystgen_travel_t": "hystgen_sum_t",
}  # fmt: skip
"""Types between the blocks of a model with effects in fixed point; elsewhere they are those of codes, but in engine
loop without effects signals are as wide as sums of the plays."""

FINE = {
    "HYSTGEN_FINE_MIN": "HYSTGEN_DRIVE_MIN", "HYSTGEN_FINE_MAX": "HYSTGEN_DRIVE_MAX",
    "hystgen_clamp_fine": "hystgen_clamp_drive",
}  # fmt: skip
"""Names of numbers finer than a drive code in such a model, and what they stand for elsewhere."""

NUMBER = "hystgen_number_t"
"""What a block of the user's own multiplies with, in floating point a number like any other."""

FIXED_KERNELS = (
    "over_slope.c",
    "corners_fixed.c",
    "loop_absorb.c",
    "loop_solve_fixed.c",
    "curve.c",
)


@dataclass(frozen=True)
class Family:
    """An arithmetic in C: its files of the run time and its types; `chain`: in a model with effects, `loop`: in one
    without, in engine loop."""

    arithmetic: Arithmetic
    chain: bool = False
    loop: bool = False

    @property
    def bits(self) -> str:
        """The arithmetic in names of the run time."""
        return self.arithmetic.short

    @property
    def real(self) -> str:
        """The type of inputs and answers."""
        return self.arithmetic.c_type

    @property
    def fixed(self) -> bool:
        """Whether it is fixed point."""
        return self.arithmetic.fixed

    @property
    def constants(self) -> dict[str, str]:
        """What `hystgen_runtime.h` defines and emitted code names directly."""
        if self.fixed:
            low = self.arithmetic.low_bits
            return {"HYSTGEN_LOW_BITS": str(low), "hystgen_low_t": f"uint{low}_t"}
        return {"HYSTGEN_REAL_MAX": f"{self.arithmetic.float_h}_MAX"}

    @property
    def types(self) -> dict[str, str]:
        """Types of the run time beside `real_t`."""
        return {"play_t": "int32_t", "reach_t": self.arithmetic.reach, "sum_t": "int64_t"} if self.fixed else {}

    @property
    def signals(self) -> dict[str, str]:
        """Names in code that models with and without effects share, and their meaning here."""
        if self.chain and self.fixed:
            return SIGNALS
        sums = {"hystgen_signal_t": "hystgen_sum_t"} if self.loop and self.fixed else {}
        return dict.fromkeys((*SIGNALS, NUMBER), "hystgen_real_t") | FINE | sums

    @property
    def chain_types(self) -> tuple[str, ...]:
        """The headers with the types of effects."""
        return FIXED_CHAIN_TYPES if self.fixed else CHAIN_TYPES

    @property
    def includes(self) -> tuple[str, ...]:
        """Headers of the language that code needs."""
        return (*(() if self.fixed else ("float",)), "stdbool", "stddef", "stdint")

    @property
    def tables(self) -> tuple[str, ...]:
        """The headers of the run time that have the types of its tables."""
        if self.fixed:
            return ("hystgen_corners_fixed_tables.h", "hystgen_tables_fixed.h")
        return ("hystgen_corners_tables.h", "hystgen_tables_float.h")

    @property
    def states(self) -> tuple[str, ...]:
        """The headers of the run time that have the types of its memory."""
        if self.fixed:
            return ("hystgen_corners_fixed_state.h", f"hystgen_corner_{self.bits}.h")
        return ("hystgen_corners_state.h",)

    @property
    def kernel_files(self) -> tuple[str, ...]:
        """The files with its kernels, callees before callers."""
        return tuple(file.format(bits=self.bits) for file in (FIXED_KERNELS if self.fixed else FLOAT_KERNELS))

    @property
    def kernels(self) -> tuple[str, ...]:
        """The headers of the run time that have the prototypes of its kernels."""
        return (f"hystgen_kernels_{'fixed' if self.fixed else 'float'}.h", "hystgen_kernels_loop.h")

    @property
    def build(self) -> tuple[str, ...]:
        """The headers that check how code is built."""
        return ("build_fixed.h",) if self.fixed else ("build_float.h", f"binary{self.bits[1:]}.h")

    def soft(self, kernels: str) -> tuple[str, ...]:
        """The header with what the corner engine asks of floating point, where it is among these kernels."""
        return (f"soft_float{self.bits[1:]}.h",) if "_SOFT_FLOAT" in kernels else ()

    @property
    def opening(self) -> tuple[str, ...]:
        """Headers before all code of a file; in a single header between `opening_apart` and `closing`."""
        double = ("constants_double.h",) if self.real == "double" else ()
        return () if self.fixed else ("rounding_begin.h", *double)

    @property
    def opening_apart(self) -> tuple[str, ...]:
        """Headers before those if the user's own code follows."""
        return () if self.fixed else ("rounding_push.h",)

    @property
    def closing(self) -> tuple[str, ...]:
        """Headers after all code of a single header, so that its user's code is compiled as before."""
        return () if self.fixed else ("rounding_end.h",)


FAMILIES = {name: Family(arithmetic) for name, arithmetic in ARITHMETICS.items()}


@dataclass(frozen=True)
class Variant:
    """The kind of a model, which decides on the files of the run time that its operators are made of.

    `fronts`: it has a memoryless part, `branches`: one of two branches; `finer`: inputs of the plays have bits below a
    drive code, or with effects what arrives there has bits below them; `saturates`: output codes are limited;
    `start_list`: each play starts at its own value; `chain`: it has effects, `slew`: one of them keeps the drive within
    a rate, `braked`: and a lag behind that from overshooting, `quiet`: the drive stands still at rest, `turning`:
    a lag arrives at two branches, `waits`: it does
    not act at once, `ages`: one is a gain that follows the travel, `moves` and `bends`: how plays move and are bent
    where that is not as in engine loop.
    """

    engine: str
    fixed: bool
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
    waits: bool = False
    ages: bool = False
    moves: str = ""
    bends: str = ""

    @property
    def apart(self) -> tuple[str, ...]:
        """How functions begin that the compiler keeps apart here, as `render_operators` has it."""
        corners = self.engine == "corners"
        found = ["HYSTGEN_APART ", "HYSTGEN_APART_IN_FIXED " if self.fixed else "HYSTGEN_APART_IN_FLOAT "]
        found += ["HYSTGEN_APART_IN_CHAIN ", *["HYSTGEN_APART_IN_FIXED_CHAIN "] * self.fixed] * self.chain
        found += ["HYSTGEN_APART_IN_FLOAT_CORNERS "] * (corners and not self.fixed)
        return (*found, *["HYSTGEN_APART_BUT_IN_FLOAT_LOOP "] * (corners or self.fixed))

    def state(self, operator: str) -> str:
        """The header with the type of an instance in engine corners without effects."""
        return f"hystgen_{operator}{'_front' * self.fronts}{'_fixed' * self.fixed}_state.h"

    def sources(self) -> tuple[str, ...]:
        """The files with the functions of both operators."""
        files = ["clamp.c"]
        if self.fixed and self.chain:
            files.append("clamp_fine.c")
        elif self.fixed:
            files.append("code_saturating.c" if self.saturates else "code.c")
        if self.fronts:
            if self.fixed:
                files.append("front_two_curves.c" if self.branches else "front_curve.c")
            turn = f"chain_turn{'_late' * self.turning}.c"
            two = (turn, "chain_two_branches.c") if self.chain else ("inverse_two_branches.c",)
            files += two if self.branches else ("inverse_one_branch.c",)
        elif self.fixed or self.chain or self.engine == "loop":
            files.append("front_finer.c" if self.finer and not self.chain else "front_none.c")
        own = self._chain() if self.chain or self.engine == "loop" else self._corners()
        return (*files, *own, "status.c")

    @property
    def _start(self) -> str:
        """The file with the start memory of engine loop."""
        return "loop_start_list.c" if self.start_list else "loop_start.c"

    def _chain(self) -> tuple[str, ...]:
        """The files of a chain, apart from its blocks: of a model with effects, or of engine loop."""
        front = "branches" if self.branches else "front" if self.fronts else "plain"
        kind, loops = "fixed" if self.fixed else "float", self.engine == "loop"
        slew = (f"slew_{kind}.c", "chain_slew.c", *(() if self.braked else ("chain_unbraked.c",)))
        slew = slew if self.slew else ("chain_free.c",) if self.chain else ("chain_alone.c",)
        braked = f"chain_braked{'_quiet' * self.quiet}{'_steady' * self.turning}.c"
        brake = ("chain_brake.c", braked) if self.braked else ()
        delay, more = "chain_delay.c" if self.waits else "chain_prompt.c", ("chain_ageing.c",) if self.ages else ()
        solve = "chain_solve.c" if self.fixed or not self.chain else "chain_solve_float.c"
        if not self.moves:
            plays: tuple[str, ...] = (solve, "chain_plays.c") if loops else (f"chain_corners_{kind}.c",)
        elif not self.bends:
            plays = ("stretch.c", f"relaxing_{kind}.c", solve, "chain_relaxing.c")
        else:
            before = {"relaxing": ("stretch.c",), "dashpot": (f"yield_{kind}.c",)}.get(self.moves, ())
            kept = () if self.moves == "dashpot" else ("moved_kept.c",)
            bent = "bent_fixed.c" if self.fixed and self.bends != "none" else f"bent_{self.bends}.c"
            known = "bent_itself.c" if self.bends == "none" else "bent_known.c"
            apart = self.fixed and self.bends != "none" and self.moves in ("relaxing", "dilated")
            reached = "reached_apart.c" if apart else "reached.c"
            value = "value_apart.c" if self.bends == "centre" and not self.fixed else "value.c"
            moved = (*before, bent, f"moved_{self.moves}.c", reached, "moved_rest.c", *kept, known, value)
            plays = (*moved, "chain_moving.c", f"search_{kind}.c")
        finer = "chain_whole.c"
        if self.finer and self.chain:
            finer = "chain_finer.c" if loops else "chain_corners_finer.c"
        plays = (*plays, finer) if loops else (finer, *plays)
        settings = ("chain_settings.c",) if self.chain else ()
        chain = ("chain.c", "chain_loop.c" if loops else "chain_corners.c", "chain_calls.c", *settings)
        start = (self._start,) if loops else ()
        drive = ("loop_branches_drive.c",) if self.branches and not self.chain else ()
        entered = () if self.fixed or self.chain else ("entered_float.c",)
        fixed = ("limits_fixed.c", "chain_fixed.c" if self.chain else "chain_codes.c")
        codes = fixed if self.fixed else ("chain_float.c",)
        return (
            *start, f"loop_{front}.c", *drive, delay, *slew, *entered, *codes, *brake, *plays, *chain, *more,
        )  # fmt: skip

    def _corners(self) -> tuple[str, ...]:
        kind = "_front" * self.fronts + "_fixed" * self.fixed
        usual = ("inverse_finer.c" if self.finer else "inverse_whole.c",) if kind == "_fixed" else ()
        return (f"forward{kind}.c", *usual, f"inverse{kind}.c")


def data_folder(name: str) -> Path:
    """`templates` or `c_runtime`: inside the installed package, or at the top of the checkout."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "_data" / name
    return installed if installed.is_dir() else package.parent / name


@dataclass(frozen=True)
class Piece:
    """A top-level piece of C with the comment above it."""

    name: str
    text: str
    uses: frozenset[str]

    @property
    def code(self) -> str:
        """Its text without comments."""
        return _COMMENT.sub("", self.text)


_COMMENT = re.compile(r"/\*.*?\*/", flags=re.DOTALL)
_NAME = re.compile(r"\b(?:hystgen|HYSTGEN)_\w+")


def split_pieces(source: str) -> list[Piece]:
    """The top-level pieces of a file, and of lines of the preprocessor the constants."""
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
        code = re.sub(r"/\*.*?\*/", "", code)
        if "/*" in code:
            code, comment = code.partition("/*")[0], True
        constant = not depth and bool(re.match(r"#define \w+ .", line))
        if not depth and not constant and line.startswith("#"):
            lines = []
            continue
        if not depth and not inside and not line.strip():  # a comment above it is about the file
            lines = []
            continue
        lines.append(line)
        depth += code.count("{") - code.count("}")
        if constant or (not depth and re.search(r"[};]\s*$", code)):
            pieces.append(_piece("\n".join(lines) + "\n"))
            lines = []
    return pieces


def _defined_name(text: str) -> str:
    code = _COMMENT.sub("", text)
    typedef = re.search(r"}\s*(hystgen_\w+);\s*$", code)
    if typedef and "typedef" in code:
        return typedef.group(1)
    declared = re.search(r"#define (HYSTGEN_\w+)|(hystgen_\w+)\s*[\[(]", code)
    assert declared, f"no name in: {text}"
    return declared.group(1) or declared.group(2)


@functools.cache
def _read(name: str) -> str:
    return (data_folder("c_runtime") / name).read_text(encoding="utf-8")


def _pieces(files: Iterable[str]) -> list[Piece]:
    return [piece for file in files for piece in split_pieces(_read(file))]


def kernel_pieces(family: Family) -> list[Piece]:
    """Every piece of every kernel file of an arithmetic, callees before callers."""
    return _pieces(family.kernel_files)


def carried(family: Family, pieces: Iterable[Piece]) -> list[Piece]:
    """The pieces of kernel files that `pieces` need although a shared run time keeps them to itself."""
    shared = {piece.name for piece in _pieces(family.kernels)}
    own = [piece for piece in kernel_pieces(family) if piece.name not in shared]
    return needed(own, sorted(used(pieces)))


def table_pieces(family: Family) -> list[Piece]:
    """The types of an arithmetic's tables."""
    return _pieces(family.tables)


def memory_pieces(family: Family) -> list[Piece]:
    """The types that instances and tables of an arithmetic are made of."""
    return _pieces(family.states)


def operator_pieces(
    variant: Variant,
    family: Family,
    operators: Iterable[str],
    glue: str,
    calls: Mapping[str, Iterable[str]] = MappingProxyType({}),
    own: Sequence[Piece] = (),
) -> list[Piece]:
    """The functions of a model's operators, with those that `glue` defines for it, without what does nothing; `calls`
    as for `api`; `own`: of blocks that are the user's own, which stay as they are."""
    blocks = (FIXED_CHAIN_BLOCKS if variant.fixed else CHAIN_BLOCKS) if variant.chain else ()
    roots = [piece.name for op in operators for piece in _calls(op, calls.get(op, ()))]
    pieces = needed([*_pieces(blocks), *own, *split_pieces(glue), *_pieces(variant.sources())], roots)
    parsed = [(piece, None if piece in own else folding.parsed(piece.text)) for piece in pieces]
    kernels = [found for piece in (*kernel_pieces(family), *own) if (found := folding.parsed(piece.text))]

    def put(functions: Mapping[str, folding.Function]) -> list[Piece]:
        made = [
            piece if each is None or each == functions.get(piece.name) else _piece(functions[piece.name].text())
            for piece, each in parsed if each is None or piece.name in functions
        ]  # fmt: skip
        return needed(made, roots)

    functions = folding.folded(
        [each for _, each in parsed if each], kernels, lambda functions: {each.name for each in put(functions)},
        family.fixed, variant.apart, family.signals,
    )  # fmt: skip
    return put(functions)


def fields(pieces: Iterable[Piece], operator: str) -> frozenset[str]:
    """The fields of an operator's instance that these functions name."""
    return folding.fields([found for piece in pieces if (found := folding.parsed(piece.text))], operator)


def _piece(text: str) -> Piece:
    own = _defined_name(text)
    return Piece(own, text, frozenset(_NAME.findall(_COMMENT.sub("", text))) - {own})


def chain_types(own: Iterable[Piece], glue: str, family: Family) -> list[Piece]:
    """The types of blocks, those of the user's own last, and then of instances of models with effects."""
    return [*_pieces(family.chain_types), *own, *split_pieces(glue)]


def _calls(operator: str, more: Iterable[str]) -> list[Piece]:
    """Prototypes of an operator: those of every model, and those of models with effects that are named."""
    chain = {f"hystgen_{operator}_{each}" for each in more}
    beside = [piece for piece in _pieces([f"hystgen_chain_{operator}_api.h"]) if piece.name in chain]
    return [*_pieces([f"hystgen_{operator}_api.h"]), *beside]


def state_pieces(variant: Variant, operators: Iterable[str], functions: Sequence[Piece]) -> list[Piece]:
    """The types of instances, with the fields that these functions name."""
    made = []
    for op in operators:
        named = fields(functions, op)
        for piece in _pieces([variant.state(op)]):
            lines = piece.text.split("\n")
            member = re.compile(r"^    [\w ]+?(\w+)(?:\[.*\])?;")
            kept = [line for line in lines if not (found := member.match(line)) or found[1] in named]
            made.append(_piece("\n".join(kept)))
    return made


def needed(pieces: Iterable[Piece], roots: Iterable[str]) -> list[Piece]:
    """The pieces that `roots` need, in their order; names in `roots` that no piece has are defined elsewhere."""
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
    """Their text, with an empty line between them unless a constant shares the comment of the one before."""
    text = ""
    for piece in pieces:
        shared = piece.text.startswith("#define") and text.rpartition("\n\n")[2].count("#define")
        text += ("\n" if text and not shared else "") + piece.text
    return text


def render(pieces: Iterable[Piece], prefix: str, family: Family, static: bool) -> str:
    """Kernels as C text under `prefix`; `static` for files that carry them as their own."""
    text = _joined(pieces)
    text = text.replace("HYSTGEN_FIXED_KERNEL ", "HYSTGEN_KERNEL " if family.fixed else "HYSTGEN_API ")
    text = text.replace("HYSTGEN_API ", "static " if static else "")
    text = text.replace("HYSTGEN_KERNEL ", "HYSTGEN_APART " if static else "")
    return _named(text, prefix, family, prefix)


def render_carried(pieces: Sequence[Piece], name: str, prefix: str, family: Family) -> str:
    """Pieces of kernel files that the model `name` carries beside the shared run time `prefix`, under its own name."""
    text = _joined(pieces)
    return _named(text, prefix, family, name, frozenset(piece.name for piece in pieces))


def render_operators(
    pieces: Iterable[Piece], name: str, corners: int, prefix: str, family: Family, carried: Sequence[Piece] = ()
) -> str:
    """Operators, or the types of their instances, as C text of the model `name` with the run time `prefix`.

    `corners`: how many the corner engine takes, 0 for engine loop; `carried`: as in `render_carried`.
    """
    text = _joined(pieces)
    apart = corners > 0 and not family.fixed
    text = text.replace("HYSTGEN_APART_IN_FLOAT_CORNERS ", "HYSTGEN_APART " if apart else "static ")
    chained = "HYSTGEN_APART " if family.fixed and family.chain else "static inline "
    text = text.replace("HYSTGEN_APART_IN_FIXED_CHAIN ", chained)
    text = text.replace("HYSTGEN_APART_IN_CHAIN ", "HYSTGEN_APART " if family.chain else "static ")
    text = text if family.chain else text.replace("HYSTGEN_ALONE ", "")
    text = text.replace("HYSTGEN_APART_IN_FIXED ", "HYSTGEN_APART " if family.fixed else "static inline ")
    text = text.replace("HYSTGEN_APART_IN_FLOAT ", "static " if family.fixed else "HYSTGEN_APART ")
    loop = corners == 0 and not family.fixed
    text = text.replace("HYSTGEN_APART_BUT_IN_FLOAT_LOOP ", "static " if loop else "HYSTGEN_APART ")
    known = frozenset(piece.name for piece in carried)
    return _named(text.replace("HYSTGEN_CORNERS", str(corners)), prefix, family, name, known)


def api(
    operators: Iterable[str],
    name: str,
    prefix: str,
    family: Family,
    calls: Mapping[str, Iterable[str]],
    documented: Callable[[Sequence[Piece]], Iterable[Piece]],
) -> str:
    """Prototypes of a model's functions; `calls`: by operator, the functions it has in addition; `documented`: puts
    above each what there is to know of it."""
    every = [piece for op in operators for piece in documented(_calls(op, calls.get(op, ())))]
    return _named("\n".join(piece.text for piece in every), prefix, family, name)


def verbatim(files: Iterable[str], owner: str, family: Family, name: str) -> str:
    """Whole files, as they stand, of the module `name`; `owner` is named in messages."""
    text = "\n".join(map(_read, files)).replace('"hystgen: ', f'"{owner}: ')
    return _named(text, name, family, name)


@functools.cache
def _own(family: Family) -> frozenset[str]:
    """The names that a run time defines."""
    pieces = [*kernel_pieces(family), *_pieces((*family.tables, *family.states))]
    enums = [piece.code for piece in pieces if "typedef enum" in piece.code]
    listed = [name for code in enums for name in re.findall(r"HYSTGEN_\w+", code)]
    return frozenset([*(piece.name for piece in pieces), *listed, *(f"hystgen_{kind}" for kind in family.types)])


def _named(
    text: str, prefix: str, family: Family, name: str, carried: frozenset[str] = frozenset()
) -> str:
    """The text with the names of a model and of its run time; `carried`: those that the model has in its place."""
    for shared, here in family.signals.items():
        cast = f"({shared})"
        if here == "hystgen_real_t" and not (family.loop and family.fixed):
            text = text.replace(cast, "")
        text = re.sub(rf"\b{shared}\b", here, text)
    if not family.fixed:  # one type for everything
        text = re.sub(r"\(hystgen_(play|reach|sum)_t\)", "", text)
        text = re.sub(r"hystgen_(play|reach|sum)_t", "hystgen_real_t", text)
    for constant, value in family.constants.items():
        text = text.replace(constant, value)
    own = _own(family) - carried

    def renamed(found: re.Match[str]) -> str:
        before = prefix if found[0] in own else name
        upper = found[0].startswith("HYSTGEN")
        return (before.upper() if upper else before) + found[0][len("hystgen") :]

    return _NAME.sub(renamed, text)


def types(pieces: Iterable[Piece], prefix: str, family: Family) -> str:
    """Type definitions."""
    return _named(_joined(pieces), prefix, family, prefix)


def all_types(files: Iterable[str], prefix: str, family: Family) -> str:
    """Every type definition of headers of the run time."""
    return types(_pieces(files), prefix, family)


def prototypes(prefix: str, family: Family) -> str:
    """Prototypes of all kernels."""
    return _named("".join(piece.text for piece in _pieces(family.kernels)), prefix, family, prefix)
