"""The C of an effect of the user's own: its file, checked, as pieces of the run time.

The file is the user's own code and is carried as it stands, with the model's name in front of its own. What it may hold
is what blocks of `c_runtime/` hold: two types of real numbers, named as in Python, and four functions, with further
static functions that they call. It is no language checker: what compiles, and to which bits, `hystgen verify` tells.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from hystgen.basics.problems import EffectsError, printable
from hystgen.compensator.chain.tables import ChainTables, OwnChainTables
from hystgen.effects import own
from hystgen.effects.base import Effect
from hystgen.effects.kinds import VERBS, Kind
from hystgen.emission.layout import WIDTH
from hystgen.emission.runtime import Piece, split_pieces

MOST_BYTES = 1 << 16

INCLUDE = '#include "hystgen_runtime.h"'
"""The one line of the preprocessor that a file has, so that it compiles as it stands."""

CALLED = frozenset(["if", "for", "while", "switch", "return", "sizeof"])
"""Words before a parenthesis that call nothing."""

REFUSED = {
    "float": "hystgen_real_t", "double": "hystgen_real_t", "extern": "nothing", "volatile": "nothing",
    "asm": "C", "union": "struct", "goto": "a loop", "register": "nothing", "auto": "a type",
}  # fmt: skip
"""Words that a file does not have, and what to write in their place."""


def pieces(t: ChainTables) -> tuple[list[Piece], list[Piece]]:
    """Types and functions of the blocks of a model that are the user's own; raises as `of_effect`."""
    found = [of_effect(effect) for effect in t.own_effects] if isinstance(t, OwnChainTables) else []
    return [each for types, _ in found for each in types], [each for _, functions in found for each in functions]


def of_effect(effect: type[Effect]) -> tuple[list[Piece], list[Piece]]:
    """Types and functions of the C file of an effect. Raises EffectsError, a line a problem: `FILE:LINE: what; do`."""
    file, kind = own.source(effect), own.kind(effect)
    assert effect.block is not None
    if wrong := own.faults(effect.block):
        raise EffectsError("\n".join(wrong))
    try:
        data = file.read_bytes()
    except OSError as error:
        raise EffectsError(f"{file}: cannot be read: {error.strerror or error}") from None
    if len(data) > MOST_BYTES:
        raise EffectsError(f"{file}: has {len(data)} bytes, more than {MOST_BYTES}; give the block alone")
    text = data.decode("utf-8", "replace").replace("\r\n", "\n")
    problems = list(_of_lines(text))
    if not problems:
        found = split_pieces(text)
        problems = list(_of_pieces(text, found, kind))
    if problems:
        raise EffectsError("\n".join(f"{file}:{line}: {what}" for line, what in sorted(set(problems))))
    return [each for each in found if "typedef" in each.text], [each for each in found if "typedef" not in each.text]


def _code(text: str) -> str:
    """The text with its comments blank, line by line."""
    return re.sub(r"/\*.*?\*/", lambda found: re.sub(r"[^\n]", " ", found[0]), text, flags=re.DOTALL)


def _of_lines(text: str) -> Iterator[tuple[int, str]]:
    """What no line may have."""
    code = _code(text)
    opened = code.find("/*")
    if opened >= 0:
        yield text.count("\n", 0, opened) + 1, "a comment that does not end"
        return
    for number, (whole, line) in enumerate(zip(text.split("\n"), code.split("\n"), strict=True), 1):
        if strange := re.search(r"[^ -~]", whole):
            yield number, f"{printable(strange[0])!r} is no printable ASCII; write another character"
        if len(whole) > WIDTH:
            yield number, f"{len(whole)} columns, more than {WIDTH}; break the line"
        if "?" "?" in whole:
            yield number, "two question marks, which begin a trigraph; write one"
        if line.strip() in ("", INCLUDE):
            continue
        for form, what in (
            (r"#", f"a line of the preprocessor; only {INCLUDE} is one"),
            (r"//", "a comment with //; write /* */"),
            (r"[\"'\\]", "a text or a continued line; a block has none"),
            (r"[/%]", "a division; put the reciprocal in the table"),
            (r"(?<!\w)(\d+\.|\.\d|\d+[eE])", "a number with a fraction; put it in the table, rounded as Python has it"),
        ):
            if re.search(form, line):
                yield number, what
                break
        for word in re.findall(r"[A-Za-z_]\w*", line):
            if word in REFUSED:
                yield number, f"{word}; write {REFUSED[word]}"
            elif word.startswith("_"):
                yield number, f"{word}, a name of the compiler's; choose another one"


def _of_pieces(text: str, found: list[Piece], kind: Kind) -> Iterator[tuple[int, str]]:
    """What a block has besides its types and functions, and what it lacks."""
    own_name = f"hystgen_{kind.name}"
    wanted = dict(_declared(kind))
    names = [piece.name for piece in found]
    functions = {name for name in names if name.startswith(f"{own_name}_")}
    for name, declared in wanted.items():
        if name not in names:
            yield 1, f"has no {name}; write {declared}"
    rest = _code(text).replace(INCLUDE, " " * len(INCLUDE))
    at = 0
    for piece in found:
        at = text.index(piece.text.rstrip("\n"), at)
        line = text.count("\n", 0, at + len(piece.text) - len(piece.text.lstrip())) + 1
        line += _code(piece.text)[: len(_code(piece.text)) - len(_code(piece.text).lstrip())].count("\n")
        rest = rest[:at] + re.sub(r"[^\n]", " ", piece.text) + rest[at + len(piece.text) :]
        at += len(piece.text)
        code = " ".join(_code(piece.text).split())
        head = code.partition("{")[0].strip() if "typedef" not in code else code
        if names.count(piece.name) > 1:
            yield line, f"{piece.name} a second time"
        elif piece.name in wanted:
            if _bare(head) != _bare(wanted[piece.name]):
                yield line, f"{piece.name} is declared otherwise; write {wanted[piece.name]}"
        elif not (piece.name in functions and re.match(r"static [\w ]*\(", head.replace("*", " "))):
            yield line, f"{piece.name} is no static function {own_name}_..; a block has its types and such functions"
        for used in piece.uses - functions - wanted.keys() - {"hystgen_real_t"}:
            yield line, f"{piece.name} uses {used}, which it does not define; a block has what stands in its file"
        for called in re.findall(r"(\w+) ?\(", _code(piece.text).partition("{")[2]):
            if called not in CALLED and called not in functions:
                yield line, f"{piece.name} calls {called}, which is not in the file; a block calls its own functions"
    if left := re.search(r"\S.*", rest):
        line = rest.count("\n", 0, left.start()) + 1
        yield line, f"{printable(left[0].strip())!r} belongs to no type and no function; a block has nothing else"


def _bare(declared: str) -> str:
    """A declaration without what makes no difference: spaces, and a memory that is only read."""
    return re.sub(r"\s+", "", re.sub(r"const (hystgen_\w+ \*self)", r"\1", declared))


def _declared(kind: Kind) -> Iterator[tuple[str, str]]:
    """Names of types and functions of a block, and how they are declared."""
    name = f"hystgen_{kind.name}"
    for own_type, members in ((f"{name}_table_t", kind.table), (f"{name}_t", kind.state)):
        yield own_type, f"typedef struct {{ {' '.join(f'hystgen_real_t {each};' for each in members)} }} {own_type};"
    for verb in VERBS:
        memory = "" if verb == "resting" else f"{name}_t *self, "
        x = "x" if verb in ("rest", "absorb") else "y"
        arguments = f"const {name}_table_t *t, {memory}hystgen_real_t {x}"
        yield f"{name}_{verb}", f"static hystgen_real_t {name}_{verb}({arguments})"


