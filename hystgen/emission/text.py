"""C text: exact literals, tables, comments, and lines of at most WIDTH characters, however long the model's name is.

Statements are broken by one rule that looks only at their code. Line breaks in the source file do not count: they suit
the prefix `hystgen_`, which another name replaces. clang-format formats the files of `c_runtime/` and of effects but
not emitted ones: its line breaks depend on its version, and the same parameters have to give the same bytes anywhere.
"""

from __future__ import annotations

import itertools
import re
import textwrap
import unicodedata
from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np

WIDTH = 100

Number: TypeAlias = "float | np.integer | np.floating"
"""A number in a table."""

_ASSIGNED = re.compile(r"(?<= =) |(?<=return) ")
_WAYS = [
    re.compile(form)
    for form in (
        r"(?<=,) ",
        r" (?=[?:] )",
        r"(?<= (?:\|\||&&)) ",
        r"(?<= (?:==|!=|<=|>=)) |(?<=[\w)\]] [<>]) ",
        r"(?<=[\w)\]] [|^]) |(?<= (?:<<|>>)) ",
        r"(?<=[\w)\]] [-+]) ",
        r"(?<=[\w)\]] [*/]) ",
        _ASSIGNED.pattern,
        r"(?<=\w\()|(?<=_t\))(?=[\w(-])|(?<=\w) (?=[\w*])",
    )
]
"""Positions at which a line can be broken, best first: after commas, before ? and :, after operators, loosest first."""
_CHOICE = ("? ", ": ")
"""Beginnings of lines whose continuation is indented further."""
_GOOD = 7
"""The first `_GOOD` ways are preferred to the rest; among equals, the position in the fewest parentheses wins."""


def literal(x: Number) -> str:
    """The shortest C literal for exactly this float32, float64 or whole number.

    Whole numbers keep their value in every dialect: without a suffix, C90 and C++98 treat one beyond `long` as
    unsigned; and no dialect has a literal for the smallest number of a type.
    """
    if isinstance(x, np.integer | int):
        return _whole(int(x))
    if not np.isfinite(x):
        raise ValueError("only finite numbers have a literal")
    return f"{np.float32(x)!s}f" if isinstance(x, np.float32) else repr(float(x))


def _whole(x: int) -> str:
    if x in (-(1 << 31), -(1 << 63)):
        return f"({_whole(x + 1)} - 1)"
    return f"{x}LL" if abs(x) >= 1 << 31 else str(x)


def operand(x: Number) -> str:
    """A literal that can stand in an expression."""
    text = literal(x)
    return f"({text})" if text.startswith("-") else text


def _wrapped(values: Sequence[Number], suffix: str, indent: str) -> list[str]:
    """Lines of literals."""
    lines = [indent]
    for i, value in enumerate(values):
        item = " " + (f"{value}{suffix}" if suffix else literal(value)) + ("," if i + 1 < len(values) else "")
        if len(lines[-1]) + len(item) > WIDTH:
            lines.append(indent)
        lines[-1] += item
    return lines


def constant(declared: str, lines: Sequence[str]) -> str:
    """A constant with these lines between its braces, on one line if it fits."""
    whole = f"static const {declared} = {{{lines[0].strip()}}};"
    if len(lines) == 1 and len(whole) <= WIDTH:
        return whole + "\n"
    return braces(declared, lines)


def braces(declared: str, lines: Sequence[str]) -> str:
    """A constant with these lines between its braces."""
    return "\n".join([f"static const {declared} = {{", *lines, "};"]) + "\n"


def table(kind: str, name: str, values: Sequence[Number]) -> str:
    """A constant array of literals."""
    lines = _wrapped(values, "u" if kind == "uint32_t" else "", "   ")
    return constant(f"{kind} {name}[{len(values)}]", lines)


def structure(kind: str, name: str, columns: Sequence[tuple[str, Sequence[Number]]]) -> str:
    """Constant arrays of literals in one structure, so compilers reach all of them from one address."""
    members = [f"    {kind} {own}[{len(values)}];" for own, values in columns]
    lines = []
    for i, (own, values) in enumerate(columns):
        end = "    }" + ("," if i + 1 < len(columns) else "")
        lines += [f"    {{ /* {own} */", *_wrapped(values, "", "       "), end]
    return "\n".join(["static const struct {", *members, f"}} {name} = {{", *lines, "};"]) + "\n"


# Accented letters lose their accents (only Latin-1 and Extended-A, which are the same in every version of Python).
_ASCII = {code: unicodedata.normalize("NFD", chr(code))[0] for code in range(0xC0, 0x180)} | {
    ord(sign): plain
    for sign, plain in (
        ("\N{MICRO SIGN}", "u"),
        ("\N{GREEK SMALL LETTER MU}", "u"),
        ("\N{DEGREE SIGN}", "deg"),
        ("\N{OHM SIGN}", "Ohm"),
        ("\N{GREEK CAPITAL LETTER OMEGA}", "Ohm"),
        ("\N{PLUS-MINUS SIGN}", "+/-"),
        ("\N{MULTIPLICATION SIGN}", "x"),
        ("\N{MIDDLE DOT}", "."),
        ("\N{SUPERSCRIPT ONE}", "^1"),
        ("\N{SUPERSCRIPT TWO}", "^2"),
        ("\N{SUPERSCRIPT THREE}", "^3"),
        ("\N{SUPERSCRIPT MINUS}", "^-"),
        ("\N{EN DASH}", "-"),
        ("\N{EM DASH}", "-"),
        ("\N{MINUS SIGN}", "-"),
        ("\N{LEFT SINGLE QUOTATION MARK}", "'"),
        ("\N{RIGHT SINGLE QUOTATION MARK}", "'"),
        ("\N{LEFT DOUBLE QUOTATION MARK}", '"'),
        ("\N{RIGHT DOUBLE QUOTATION MARK}", '"'),
        ("\N{HORIZONTAL ELLIPSIS}", "..."),
        ("\N{LATIN SMALL LETTER SHARP S}", "ss"),
        ("\N{LATIN SMALL LETTER AE}", "ae"),
        ("\N{LATIN CAPITAL LETTER AE}", "AE"),
        ("\N{LATIN SMALL LETTER O WITH STROKE}", "o"),
        ("\N{LATIN CAPITAL LETTER O WITH STROKE}", "O"),
        ("\N{LATIN SMALL LETTER L WITH STROKE}", "l"),
        ("\N{LATIN CAPITAL LETTER L WITH STROKE}", "L"),
    )
}


def comment_text(text: str) -> str:
    """Any text as one line of printable ASCII that is harmless inside a C comment of either kind.

    Common letters and signs beyond ASCII are spelt out, others become `?`; white space becomes single blanks. The
    result never opens or closes a comment, forms a trigraph or continues a line, and neither starts nor ends with a
    blank.
    """
    text = re.sub(r"[^ -~]", "?", " ".join(text.translate(_ASCII).split())).replace("\\", "/")
    text = re.sub(r"\*(?=/)", "* ", text)
    text = re.sub(r"/(?=\*)", "/ ", text)
    return re.sub(r"\?(?=\?)", "? ", text)


def fit(text: str) -> str:
    """The text of a C file with every statement on as few lines as it needs."""
    return "".join(f"{line}\n" for line in _in_columns(list(_fitted(text.splitlines()))))


_BEHIND = re.compile(r"(\s*\S.*?)\s+(/\* .* \*/)$")


def _in_columns(lines: list[str]) -> Iterator[str]:
    """Align comments behind consecutive lines in one column."""
    behind = (line.endswith("*/") and _BEHIND.fullmatch(line) for line in lines)  # most lines have no comment
    for commented, group in itertools.groupby(behind, bool):
        found = list(group)
        here, lines = lines[: len(found)], lines[len(found) :]
        column = max(len(each[1]) for each in found if each) if commented else 0
        aligned = [f"{each[1]:{column}} {each[2]}" for each in found if each]
        yield from aligned if commented and max(map(len, aligned)) <= WIDTH else here


def define(name: str, value: str, comment: str = "") -> str:
    """A macro with a comment after it."""
    return f"#define {name} {value}" + (f" /* {comment} */" if comment else "")


def _fitted(lines: list[str]) -> Iterator[str]:
    at = 0
    while at < len(lines):
        line = lines[at]
        indent = line[: len(line) - len(line.lstrip())]
        if line.startswith("#"):
            end = at
            while lines[end].endswith("\\"):
                end += 1
            yield from _directive(line) if end == at else lines[at : end + 1]
            at = end + 1
        elif line.lstrip().startswith("/*"):
            end = next(i for i in range(at, len(lines)) if "*/" in lines[i])
            yield from _comment(lines[at : end + 1])
            at = end + 1
        elif line.endswith(("= {", "enum {")):  # a table, or an enum with one name per line
            end = next(i for i in range(at, len(lines)) if re.search(r"\};$|^\} \w+;$", lines[i]))
            for row in lines[at : end + 1]:
                yield from _broken(row, row[: len(row) - len(row.lstrip())])
            at = end + 1
        else:
            end = at
            while not _ends(lines, end):
                end += 1
            yield from _statement(lines[at : end + 1], indent)
            at = end + 1


def _ends(lines: list[str], at: int) -> bool:
    """Whether a statement, or the head of a block, ends on this line."""
    code, commented, _ = lines[at].partition("/*")
    code = code.rstrip() if commented else code
    following = lines[at + 1].strip() if at + 1 < len(lines) else "{"
    return not code.strip() or code.endswith((";", "{", "}")) or following in ("{", "")


def _statement(lines: list[str], indent: str) -> Iterator[str]:
    """A statement on as few lines as it needs; a comment behind it that does not fit moves above it."""
    head, commented, _ = lines[-1].partition(" /*")
    last = head.rstrip() if commented else head
    code = " ".join([*(line.strip() for line in lines[:-1]), last.strip()]).replace("( ", "(").replace("[ ", "[")
    comment = lines[-1][len(last) :] if code else ""
    if "  " in code:
        code = re.sub(r" {2,}", " ", code)
    if len(indent + code + comment) <= WIDTH:
        yield indent + code + comment
    elif comment and code.endswith("{"):
        yield from _broken(code, indent)
        yield from _comment([f"{indent}    {comment.strip()}"])
    else:
        if comment:
            yield from _comment([indent + comment.strip()])
        yield from _broken(code, indent)


def _broken(code: str, indent: str) -> Iterator[str]:
    """Code on lines of at most WIDTH, each broken at its best place."""
    inside = indent + " " * (8 if code.endswith("{") else 4)  # a block's body is indented by 4
    text, hang = indent + code.strip(), inside
    while len(text) > WIDTH:
        start = len(text) - len(text.lstrip())
        depth = list(itertools.accumulate(text, lambda d, c: d + (c in "([{") - (c in ")]}"), initial=0))
        places = [
            (way >= _GOOD, depth[found.start()], way, -found.end())
            for way, form in enumerate(_WAYS) for found in form.finditer(text, start + 1, WIDTH + 1)
        ]
        assert places, text
        other, depths, _, place = min(places)
        assigned = _ASSIGNED.search(text, start + 1, WIDTH + 1)
        if assigned and not other and depths == 0 and len(inside) + len(text) - assigned.end() <= WIDTH:
            place = -assigned.end()  # a sum or a choice stays together
        line, rest = text[:-place].rstrip(), text[-place:].lstrip()
        yield line
        hang = inside + "    " if line.lstrip().startswith(_CHOICE) else hang
        text = (inside if rest.startswith(_CHOICE) else hang) + rest
    yield text


def _comment(lines: list[str]) -> Iterator[str]:
    """A comment on lines of at most WIDTH; the excess from a line goes on lines of its own."""
    indent = " " * (len(lines[0]) - len(lines[0].lstrip()))
    starred = any(line.startswith(indent + " *") for line in lines[1:])
    more = indent + (" * " if starred else "   ")
    for line in lines:
        if len(line) <= WIDTH:
            yield line
            continue
        body = line[len(indent) :]
        mark = re.match(r"/\* | \* {1,}|\s+|", body)
        assert mark
        hang = more if body.startswith("/*") else indent + mark[0]
        words = body[mark.end() :].replace(" */", "\0*/")  # the end of a comment stays behind its last word
        for part in textwrap.wrap(
            words, WIDTH, initial_indent=indent + mark[0], subsequent_indent=hang, break_long_words=False,
            break_on_hyphens=False,
        ):
            yield part.replace("\0", " ")


def _directive(line: str) -> Iterator[str]:
    """A preprocessor line; if it is too long, a comment after it moves above it, and a message is continued."""
    macro = re.match(r"^(#define .*?) (/\* .* \*/)$", line)
    if len(line) <= WIDTH:
        yield line
    elif macro:
        yield from _comment([macro[2]])
        yield macro[1]
    elif line.startswith("#error"):
        words = textwrap.wrap(line.partition(" ")[2].strip('"'), WIDTH - len('#error " " \\'), break_long_words=False)
        inside = [*(f'"{part} "' for part in words[:-1]), f'"{words[-1]}"']
        yield from _continued([f"#error {inside[0]}", *(f"       {part}" for part in inside[1:])])
    else:
        yield from _continued(textwrap.wrap(line, WIDTH - len(" \\"), subsequent_indent=" " * 4))


def _continued(lines: list[str]) -> Iterator[str]:
    """Lines that the preprocessor joins into one."""
    yield from (f"{line} \\" for line in lines[:-1])
    yield lines[-1]
