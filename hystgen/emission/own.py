"""The C of a user's own effect: its file, checked and split into pieces like the run time.

The file is the user's code and stays unchanged, except that its names get the model's name as a prefix. It may contain
what the catalogue's blocks contain: two types, one for the numbers and one for the memory, named as in Python, and four
functions, plus static functions that these call. Written with `hystgen_product`, it serves every arithmetic. Its C is
not checked for errors: `hystgen verify` shows whether it compiles, and whether its bits are right.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

from hystgen.basics.problems import EffectsError, printable
from hystgen.effects import own
from hystgen.effects.base import Effect
from hystgen.effects.kinds import VERBS, BlockKind
from hystgen.emission.runtime import Field, Piece
from hystgen.emission.text import WIDTH

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables

MOST_BYTES = 1 << 16
"""Maximum size of the C file of a user's effect; the largest block in the package has 6 kB."""

INCLUDE = '#include "hystgen_runtime.h"'
"""The only preprocessor line allowed in a file, which then compiles by itself."""

CALLED = frozenset(["if", "for", "while", "switch", "return", "sizeof"])
"""Words before a parenthesis that are not calls."""

REFUSED = {
    "float": "hystgen_signal_t", "double": "hystgen_signal_t", "extern": "nothing", "volatile": "nothing",
    "asm": "C", "union": "struct", "goto": "a loop", "register": "nothing", "auto": "a type",
}
"""Words that a file may not contain, and their replacements."""

GIVEN = frozenset(["hystgen_signal_t", "hystgen_number_t", "hystgen_product"])
"""Run-time names that a file may use."""


def pieces(t: ChainTables) -> tuple[list[Piece], list[Piece]]:
    """Types and functions of a model's user-defined blocks. Raises the same errors as `of_effect`."""
    effects = dict.fromkeys(getattr(t, "own_effects", ()))
    found = [of_effect(effect) for effect in effects]
    types, functions = ([each for pair in found for each in pair[way]] for way in (0, 1))
    twice = [name for name, count in Counter(each.name for each in (*types, *functions)).items() if count > 1]
    if twice:
        raise EffectsError(f"two effects of your own have the name {twice[0]} in C; rename one")
    return types, functions


def of_effect(effect: type[Effect]) -> tuple[list[Piece], list[Piece]]:
    """Types and functions of the C file of an effect.

    Raises EffectsError with one line per problem: `FILE:LINE: what is wrong; what to do`.
    """
    file, kind = own.source(effect), own.kind(effect)
    try:
        data = file.read_bytes()
    except OSError as error:
        raise EffectsError(
            f"{file}: cannot be read ({error.strerror or error}); put the C of the effect there"
        ) from None
    if len(data) > MOST_BYTES:
        raise EffectsError(f"{file}: has {len(data)} bytes, more than {MOST_BYTES}; keep only the block")
    text = data.decode("utf-8", "replace").replace("\r\n", "\n")
    problems = list(_of_lines(text))
    found: list[Piece] = []
    if not problems:
        found = list(_split(text, problems))
        problems += _of_pieces(text, found, kind)
    if problems:
        raise EffectsError("\n".join(f"{file}:{line}: {what}" for line, what in sorted(set(problems))))
    return [each for each in found if "typedef" in each.text], [each for each in found if "typedef" not in each.text]


_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)


def _code(text: str) -> str:
    """The text with its comments blanked, line by line.

    A compiler sees the same comments only because `_of_lines` refuses everything that is replaced before comments are
    read (trigraphs and lines joined by a backslash) and everything inside which a comment cannot begin: strings,
    characters, and comments with //.
    """
    return _COMMENT.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)


EVERYWHERE = (
    (r"[^ -~]", "{0!r} is not printable ASCII; write another character"),
    (r"\\", "a backslash, which joins two lines even inside a comment; leave it out"),
    (r"\?\?", "two question marks, which begin a trigraph; write one"),
)
"""Forbidden in every line, comments included."""

IN_CODE = (
    (r"<:|:>|<%|%>|%:", "{0}, a digraph; write the character that it stands for"),
    (r"#", f"a preprocessor line; only {INCLUDE} is allowed, at the top of the file"),
    (r"//", "a comment with //; write /* */"),
    (r"[\"']", "a string or a character; a block needs none"),
    (r"[$@`]", "{0} is not a character of C; leave it out"),
    (r"= *\{", "a list of values; put them in the table"),
    (r"[/%]", "a division; put the reciprocal in the table"),
    (r"(?<!\w)(?:\d+\.|\.\d|\d+[eE])", "a number with a fraction; put it in the table, rounded as in Python"),
)
"""Forbidden outside comments; only the first match in a line is reported."""


def _of_lines(text: str) -> Iterator[tuple[int, str]]:
    """Problems of single lines."""
    code = _code(text)
    opened = code.find("/*")
    if opened >= 0:
        yield text.count("\n", 0, opened) + 1, "a comment that does not end"
        return
    begun = False
    for number, (whole, line) in enumerate(zip(text.split("\n"), code.split("\n"), strict=True), 1):
        for form, what in EVERYWHERE:
            if found := re.search(form, whole):
                yield number, what.format(printable(found[0]))
        if len(whole) > WIDTH:
            yield number, f"{len(whole)} columns, more than {WIDTH}; break the line"
        if line.strip() == "" or (line.strip() == INCLUDE and not begun):
            continue
        begun = True
        for form, what in IN_CODE:
            if found := re.search(form, line):
                yield number, what.format(found[0])
                break
        for word in re.findall(r"[A-Za-z_]\w*", line):
            if word in REFUSED:
                yield number, f"{word}; write {REFUSED[word]}"
            elif word.startswith("_"):
                yield number, f"{word}, a name reserved for the compiler; choose another"


_TYPE = re.compile(r"typedef struct \{([^{}]*)\} (hystgen_\w+);")
_FUNCTION = re.compile(r"static [\w *]*?\b(hystgen_\w+)\(([^(){}]*)\) \{")
_MEMBER = re.compile(r"(?:hystgen_)?(unsigned int|\w+(?: \*)?) ?(\w+)(?:\[(\w+)\])?;")
_NAME = re.compile(r"\b(?:hystgen|HYSTGEN)_\w+")


def _split(text: str, problems: list[tuple[int, str]]) -> Iterator[Piece]:
    """The types and functions of a file, each with the comment right above it; anything else is a problem."""
    code = _code(text).replace(INCLUDE, " " * len(INCLUDE))
    end = 0
    while start := re.search(r"\S", code[end:]):
        begin, behind = end + start.start(), end
        end = _end(code, begin)
        whole = " ".join(code[begin:end].split())
        found = _TYPE.fullmatch(whole) or _FUNCTION.match(whole)
        if not found:
            line = text.count("\n", 0, begin) + 1
            what = f"{printable(whole)!r} is not part of a type or a static function; a block has only these"
            problems.append((line, what))
            continue
        name = found[2] if whole.startswith("typedef") else found[1]
        comment = text[_above(text, behind, begin) : begin]
        members = tuple(Field(kind, member, "", size) for kind, member, size in _MEMBER.findall(found[1]))
        yield Piece(name, f"{comment}{text[begin:end]}\n", frozenset(_NAME.findall(whole)) - {name}, members)


def _above(text: str, behind: int, begin: int) -> int:
    """Start of the comments above a piece with no empty line in between; the piece's own start if there are none."""
    for comment in reversed(list(_COMMENT.finditer(text, behind, begin))):
        if text[comment.end() : begin].strip() or "\n\n" in text[comment.end() : begin]:
            break
        begin = comment.start()
    return begin


def _end(code: str, begin: int) -> int:
    """End of a type or function: the brace that closes a function, else a semicolon."""
    depth = 0
    for at in range(begin, len(code)):
        depth += {"{": 1, "}": -1}.get(code[at], 0)
        closed = code[at] == "}" and depth == 0 and not code.startswith("typedef", begin)
        if depth < 0 or closed or (code[at] == ";" and depth == 0):
            return at + 1
    return len(code)


def _of_pieces(text: str, found: list[Piece], kind: BlockKind) -> Iterator[tuple[int, str]]:
    """Problems with a block's types and functions: missing, wrong or superfluous ones."""
    own_name, wanted = f"hystgen_{kind.name}", dict(_declared(kind))
    names = [piece.name for piece in found]
    functions = {piece.name for piece in found if "typedef" not in piece.text}
    for name, declared in wanted.items():
        if name not in names:
            yield 1, f"has no {name}; write {declared}"
    at = 0
    for piece in found:
        at = text.index(piece.text.rstrip("\n"), at)
        code = _code(piece.text)
        line = text.count("\n", 0, at + len(code) - len(code.lstrip())) + 1
        whole = " ".join(code.split())
        head = whole if whole.startswith("typedef") else whole.partition(" {")[0]
        if names.count(piece.name) > 1:
            yield line, f"{piece.name} is defined {names.count(piece.name)} times; keep one"
        elif piece.name in wanted and _bare(head) != _bare(wanted[piece.name]):
            yield line, f"{piece.name} is declared differently; write {wanted[piece.name]}"
        elif not piece.name.startswith(f"{own_name}_") or (piece.name not in wanted and piece.name not in functions):
            yield line, f"{piece.name} is neither one of the block's types nor a function {own_name}_..; leave it out"
        for place, called in _calls(code):
            if called not in CALLED and called not in functions and not _NAME.fullmatch(called):
                line = text.count("\n", 0, at + place) + 1
                yield line, f"{called} is called but not defined in the file; a block calls only its own functions"
        for number, each in enumerate(code.split("\n")):
            place = text.count("\n", 0, at) + 1 + number
            for used in set(_NAME.findall(each)) - functions - wanted.keys() - GIVEN:
                yield place, f"{used} is not in the file; a block uses names in it and {', '.join(sorted(GIVEN))}"
            for number in re.findall(r"(?<!&)\bt->(\w+)", each):
                yield place, f"t->{number} by itself; write hystgen_product(&t->{number}, ..)"


BRANCHING = frozenset(["if", "for", "while", "switch"])
"""Words whose parentheses may be followed by an expression in parentheses."""

CAST = re.compile(r"\b(?:const|unsigned|int|bool|void|size_t|(?:u?int(?:8|16|32|64)|hystgen_\w+)_t)\b|\*\s*$")
"""Words of the type in a cast."""


def _calls(code: str) -> Iterator[tuple[int, str]]:
    """Positions and names of calls: a word in front of a parenthesis, or an expression in parentheses."""
    for found in re.finditer(r"(\w+)\s*\(", code):
        yield found.start(), found[1]
    for found in re.finditer(r"\)\s*\(", code):
        begin, depth = found.start(), 1
        while depth and begin:
            begin -= 1
            depth += {")": 1, "(": -1}.get(code[begin], 0)
        called = code[begin + 1 : found.start()]
        word = re.search(r"(\w+)\s*$", code[:begin])
        if word and word[1] not in CALLED:
            yield begin, f"the result of {word[1]}"
        elif not (word and word[1] in BRANCHING) and CAST.sub("", called).strip():
            yield begin, " ".join(called.split())


def _bare(declared: str) -> str:
    """A declaration without spaces and without `const` on its memory, since neither matters."""
    return re.sub(r"\s+", "", re.sub(r"const (hystgen_\w+ \*self)", r"\1", declared))


def _declared(kind: BlockKind) -> Iterator[tuple[str, str]]:
    """Names of a block's types and functions, and their declarations."""
    name = f"hystgen_{kind.name}"
    for own_type, struct in ((f"{name}_table_t", kind.table), (f"{name}_t", kind.state)):
        members = " ".join(f"hystgen_{word} {each};" for each, (word, *_) in struct.members().items())
        yield own_type, f"typedef struct {{ {members} }} {own_type};"
    for verb in VERBS:
        memory = "" if verb == "resting" else f"{name}_t *self, "
        x = "x" if verb in ("rest", "absorb") else "y"
        arguments = f"const {name}_table_t *t, {memory}hystgen_signal_t {x}"
        yield f"{name}_{verb}", f"static hystgen_signal_t {name}_{verb}({arguments})"


