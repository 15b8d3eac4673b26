"""Emitted C contains nothing that it does not need, as seen by a C parser that shares no code with the emission."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from modelfiles import CHAINS, CREEP, FILES, chain
from pycparser import c_ast, c_parser

import hystgen
from hystgen.emission import runtime
from hystgen.emission.calls import emitted_files
from hystgen.emission.folding import Members, folded, parsed
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters

HEADERS = {
    "stdbool.h": "typedef int bool;\nenum { false, true };\n",
    "stddef.h": "#define NULL ((void *)0)\ntypedef unsigned long size_t;\n",
    "float.h": "#define FLT_MANT_DIG 24\n#define DBL_MANT_DIG 53\n#define FLT_MAX 1e38f\n#define DBL_MAX 1e308\n"
    "#define FLT_EVAL_METHOD 0\n",
    "stdint.h": "".join(
        f"typedef {word} {sign}int{size}_t;\ntypedef {word} {sign}int_least{size}_t;\n"
        for sign in ("", "u")
        for size, kind in ((8, "char"), (16, "short"), (32, "int"), (64, "long"))
        for word in [f"{'un' * bool(sign)}signed {kind}"]
    ),
}  # fmt: skip
"""Standard headers, reduced to declarations that the parser understands."""

THREE = chain(
    "three", "name: lag, time_constant: 0.004", "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3", CREEP
)
"""A lag, relaxation and creep."""

MODELS = {**FILES, **CHAINS, "three": THREE}
KINDS = (
    ("plain", "both", "float32", "loop"), ("plain", "both", "q31", "loop"), ("plain", "both", "q15", "corners"),
    ("plain", "both", "float32", "corners"),
    ("bent", "both", "float32", "corners"), ("bent", "both", "float32", "loop"), ("curved", "both", "q31", "corners"),
    ("two_branches", "both", "float32", "loop"), ("two_branches", "both", "float32", "corners"),
    ("two_branches", "both", "q31", "loop"), ("three", "inverse", "float32", "loop"),
    ("three", "both", "q31", "loop"), ("quick", "both", "float32", "loop"), ("late", "both", "float32", "loop"),
    ("warm", "both", "q31", "loop"), ("heated", "inverse", "q15", "loop"), ("drifting", "inverse", "float32", "loop"),
    ("lagging", "both", "float32", "corners"), ("dashpot", "both", "float32", "loop"),
    ("everything", "both", "q31", "loop"), ("quick", "inverse", "q31", "loop"), ("bumpy", "inverse", "q31", "loop"),
    ("viscous", "both", "q31", "loop"), ("dashpot", "both", "q31", "loop"), ("wider", "both", "float32", "loop"),
    ("forgetful", "both", "q31", "loop"), ("mixed", "forward", "float32", "loop"),
    ("two_branches", "forward", "float32", "corners"), ("plain", "forward", "q15", "corners"),
    ("curved", "forward", "q31", "loop"), ("lagging", "forward", "q31", "corners"),
    ("everything", "forward", "q31", "loop"), ("quick", "forward", "float32", "loop"),
    ("warm", "forward", "float32", "loop"), ("heated", "forward", "q31", "loop"), ("three", "forward", "q31", "loop"),
    ("gliding", "forward", "float32", "loop"), ("dashpot", "forward", "float32", "loop"),
    ("sloping", "both", "float32", "loop"),
)  # fmt: skip


def tree(folder: Path, name: str, operator: str, arithmetic: str, engine: str) -> c_ast.FileAST:
    """The parsed C of a module."""
    model = Model(parse_parameters(MODELS[name], f"{name}.yaml"))
    hystgen.emit(model, folder, operator=operator, arithmetic=arithmetic, engine=engine)
    for file, text in HEADERS.items():
        (folder / file).write_text(text)
    command = ["-E", "-P", "-nostdinc", f"-I{folder}", "-D__attribute__(x)=", "-U__GNUC__", folder / f"{name}.c"]
    done = subprocess.run(["gcc", *map(str, command)], capture_output=True, text=True, check=True)
    text = re.sub(r"^#pragma.*$", "", done.stdout, flags=re.MULTILINE)
    return c_parser.CParser().parse(text.replace("inline", ""))


def below(node: c_ast.Node) -> Iterator[c_ast.Node]:
    yield node
    for _, child in node.children():
        yield from below(child)


def statements(function: c_ast.FuncDef) -> list[c_ast.Node]:
    """Statements of a function, without those that only mark a parameter as used."""
    items = function.body.block_items or []
    return [each for each in items if not (isinstance(each, c_ast.Cast) and isinstance(each.expr, c_ast.ID))]


def types(node: c_ast.Node) -> set[str]:
    """Types named in a declaration."""
    return {word for each in below(node) if isinstance(each, c_ast.IdentifierType) for word in each.names}


Fields = dict[str, c_ast.Node]
"""Types of the fields of a structure, or of the names in a function."""


class Structures:
    """The structures of a module, and what its functions read of them."""

    def __init__(self, module: c_ast.FileAST) -> None:
        self.named = {each.name: each.type for each in module.ext if isinstance(each, c_ast.Typedef)}
        self.globals: Fields = {each.name: each.type for each in module.ext if isinstance(each, c_ast.Decl)}
        self.tables = [each.init for each in module.ext if isinstance(each, c_ast.Decl) and each.init]
        self.functions = [each for each in module.ext if isinstance(each, c_ast.FuncDef)]
        self.globals |= {each.decl.name: each.decl.type for each in self.functions}
        self.locals: Fields = {}

    def every(self) -> dict[str, Fields]:
        """The fields of each structure, by the name of its type or of the only object of that type."""
        alone = {name: kind for name, kind in self.globals.items() if isinstance(kind, c_ast.TypeDecl)}
        own = {name: kind for name, kind in alone.items() if isinstance(kind.type, c_ast.Struct)}
        return {name: found for name, kind in {**self.named, **own}.items() if (found := self._fields(kind))}

    def read(self) -> set[tuple[str, str]]:
        """The structures and fields whose values functions use, other than to store the field itself anew."""
        found = set(self._reads(c_ast.ExprList(self.tables)))
        for function in self.functions:
            declared = [each for each in below(function) if isinstance(each, c_ast.Decl)]
            self.locals = {each.name: each.type for each in declared}
            found |= set(self._reads(function.body))
        return found

    def _plain(self, kind: c_ast.Node) -> c_ast.Node:
        """A type behind the names that denote it."""
        while isinstance(kind, c_ast.TypeDecl):
            kind = kind.type
            if isinstance(kind, c_ast.IdentifierType) and kind.names[0] in self.named:
                kind = self.named[kind.names[0]]
        return kind

    def _fields(self, kind: c_ast.Node) -> Fields:
        kind = self._plain(kind)
        whole = isinstance(kind, c_ast.Struct) and kind.decls
        return {each.name: each.type for each in kind.decls} if whole else {}

    def _kind(self, node: c_ast.Node) -> c_ast.Node:
        """The type of an expression that leads to a structure."""
        if isinstance(node, c_ast.ID):
            return self._plain(self.locals.get(node.name) or self.globals[node.name])
        if isinstance(node, c_ast.StructRef):
            owner, field = self._owner(node)
            return self._plain(self.every()[owner][field])
        if isinstance(node, c_ast.UnaryOp) and node.op == "&":
            return c_ast.PtrDecl([], c_ast.TypeDecl(None, [], None, self._kind(node.expr)))
        if isinstance(node, c_ast.BinaryOp):
            return self._kind(node.left)
        assert isinstance(node, c_ast.ArrayRef) or (isinstance(node, c_ast.UnaryOp) and node.op == "*")
        return self._plain(self._kind(node.name if isinstance(node, c_ast.ArrayRef) else node.expr).type)

    def _owner(self, node: c_ast.StructRef) -> tuple[str, str]:
        """The structure and the field that an expression takes of it."""
        kind = self._kind(node.name)
        fields = self._fields(kind.type if node.type == "->" else kind)
        (owner,) = [name for name, each in self.every().items() if each == fields]
        return owner, node.field.name

    def _reads(self, node: c_ast.Node) -> Iterator[tuple[str, str]]:
        if isinstance(node, c_ast.Assignment):
            own = {self._owner(node.lvalue)} if isinstance(node.lvalue, c_ast.StructRef) else set()
            yield from (each for each in self._reads(node.rvalue) if each not in own)
            yield from self._stored(node.lvalue)
            return
        if isinstance(node, c_ast.StructRef):
            yield self._owner(node)
            node = node.name  # the name of a field is no variable
            yield from self._reads(node)
            return
        for _, child in node.children():
            yield from self._reads(child)

    def _stored(self, node: c_ast.Node) -> Iterator[tuple[str, str]]:
        """What is read where an expression is stored to."""
        if isinstance(node, c_ast.ArrayRef):
            yield from self._reads(node.subscript)
            array = isinstance(self._kind(node.name), c_ast.ArrayDecl)
            yield from (self._stored if array else self._reads)(node.name)
        elif isinstance(node, c_ast.StructRef):
            yield from (self._reads if node.type == "->" else self._stored)(node.name)
        elif not isinstance(node, c_ast.ID):
            yield from self._reads(node)


needs_gcc = pytest.mark.skipif(
    not os.environ.get("CI") and shutil.which("gcc") is None, reason="gcc is not installed"
)


@pytest.mark.slow(one_in=3)
@needs_gcc
@pytest.mark.parametrize(("name", "operator", "arithmetic", "engine"), KINDS, ids=map("-".join, KINDS))
def test_nothing_is_there_for_other_models(
    name: str, operator: str, arithmetic: str, engine: str, tmp_path: Path
) -> None:
    module = tree(tmp_path, name, operator, arithmetic, engine)
    functions = [each for each in module.ext if isinstance(each, c_ast.FuncDef)]
    own = [each for each in functions if "static" in each.decl.storage]
    for function in own:
        does, called = statements(function), function.decl.name
        assert does, f"{called} does nothing"
        alone = does[0] if len(does) == 1 and isinstance(does[0], c_ast.Return) else None
        assert alone is None or not isinstance(alone.expr, c_ast.ID), f"{called} returns its argument"
        assert alone is None or not isinstance(alone.expr, c_ast.Constant), f"{called} is a constant"
        given = [each.name for each in (function.decl.type.args.params if function.decl.type.args else ()) if each.name]
        used = {each.name for each in below(function.body) if isinstance(each, c_ast.ID)}
        for parameter in given:
            assert parameter in used, f"{called} does not use {parameter}"
    texts = [(tmp_path / f"{name}{suffix}").read_text() for suffix in (".c", ".h")]
    code = re.sub(r"/\*.*?\*/", "", "".join(texts), flags=re.DOTALL)
    for comment, function in re.findall(r"^/\*((?:(?!\*/).)*)\*/\n([^/#\n][^;]*?\)\s*\{.*?^\})", texts[0], re.M | re.S):
        for word in re.findall(r"`(\w+)`", comment):
            member = re.search(rf"(?:->|\.|\*|\w )\b{word}\b[;\[,]", code)
            assert member or re.search(rf"\b{word}\b", function), f"a comment has {word}, but its function has not"
    for function in functions:
        for each in below(function.body):
            if isinstance(each, c_ast.If):
                assert not isinstance(each.cond, c_ast.Constant | c_ast.ID) or each.cond.name not in ("true", "false")
                assert each.iftrue.block_items, f"{function.decl.name} asks for nothing"
            if isinstance(each, c_ast.Cast) and "void" in types(each.to_type):
                wanted = c_ast.ID | c_ast.FuncCall | c_ast.Constant  # (void)0 stands for a macro
                assert isinstance(each.expr, wanted), f"{function.decl.name} has an idle statement"
    for function in functions:
        for each in below(function.body):
            if isinstance(each, c_ast.TernaryOp):
                within = [part for part in below(each) if isinstance(part, c_ast.TernaryOp)]
                assert len(within) == 1, f"{function.decl.name} has one choice in another"
            if isinstance(each, c_ast.ArrayRef) and isinstance(each.subscript, c_ast.UnaryOp | c_ast.StructRef):
                field = each.subscript.field.name if isinstance(each.subscript, c_ast.StructRef) else ""
                wrong = field == "rising" or getattr(each.subscript, "op", "") == "!"
                assert not wrong, f"{function.decl.name} indexes by a bool"
    structures = Structures(module)
    every = {(owner, field) for owner, fields in structures.every().items() for field in fields}
    unread = every - structures.read()
    assert not unread, f"never read: {sorted(unread)}"


@needs_gcc
@pytest.mark.parametrize("arithmetic", ["float32", "q31"])
def test_a_lag_relaxation_and_creep_take_fifty_functions_at_most(arithmetic: str, tmp_path: Path) -> None:
    module = tree(tmp_path, "three", "inverse", arithmetic, "loop")
    assert sum(isinstance(each, c_ast.FuncDef) for each in module.ext) <= 50


@pytest.mark.parametrize("arithmetic", ["float32", "q31"])
@pytest.mark.parametrize("name", ["everything", "plain"])
def test_the_header_says_of_every_call_what_there_is_to_know(name: str, arithmetic: str) -> None:
    text = MODELS[name] + "sample_time: 1.0e-3\n" * (name == "plain")
    model = Model(parse_parameters(text, f"{name}.yaml"))
    header = emitted_files(model, operator="both" if name == "plain" else "inverse", arithmetic=arithmetic)[f"{name}.h"]
    calls = re.findall(rf"^[\w ]+ {name}_(?:forward|inverse)_(\w+)\(([^;]*)\);$", header, re.MULTILINE)
    above = re.findall(r"/\*\*\n(.*?) \*/\n[\w ]+?(\w+)\(([^;]*)\);", header, re.DOTALL)
    assert len(above) == len(calls) >= 9
    for words, call, given in above:
        names = [re.findall(r"\w+", each)[-1] for each in given.split(",")]
        assert re.findall(r"@param (\w+)", words) == names, call
        assert [words.count(mark) for mark in ("@pre ", "@note Status bits: ", "@note Cost: ")] == [1, 1, 1], call
        unit = {"u": "um", "v": "V", "applied": "V", "d": "um"}
        for each in names:
            said = " ".join(words.partition(f"@param {each}")[2].partition("@")[0].split())
            assert each not in unit or re.search(rf"\b{unit[each]}\b", said), (call, each)
            assert ("NaN" in said) == (each != "self" and arithmetic == "float32"), (call, each)
    assert re.search(rf"^#define {name.upper()}_SAMPLE_TIME 0\.001f?\b", header, re.MULTILINE)
    number = re.search(rf"^#define {name.upper()}_HYSTGEN_VERSION_NUMBER (\d+)\b", header, re.MULTILINE)
    major, minor, patch = map(int, re.findall(r"\d+", hystgen.__version__)[:3])
    assert number
    assert int(number[1]) == 10000 * major + 100 * minor + patch


@pytest.mark.parametrize(
    ("name", "engine", "words"),
    [("plain", "corners", "play move corner block way reach segment pass"), ("plain", "loop", "play pending")],
)
def test_a_source_explains_its_words(name: str, engine: str, words: str) -> None:
    source = emitted_files(Model(parse_parameters(MODELS[name], "plain.yaml")), engine=engine)["plain.c"]
    top = source.partition("/* Words of this file")[2].partition("*/")[0]
    assert re.findall(r"^   (\w+): ", top, re.MULTILINE) == words.split()


def fold(*texts: str, fixed: bool = True) -> str:
    functions = [found for text in texts if (found := parsed(text))]
    assert len(functions) == len(texts)
    meaning = runtime.FAMILIES["q15" if fixed else "float32"].meaning
    kept = folded(
        functions, [], lambda made: called(made, functions[-1].name), ["HYSTGEN_APART "],
        Members({"inverse_t": dict.fromkeys(("last", "next", "moving"), "int")}, (), {}),
        lambda kind: meaning(kind.removeprefix("hystgen_")),
    )
    return " ".join(" ".join(each.text() for each in kept.values()).split())


def called(functions: dict[str, object], root: str) -> set[str]:
    found, queue = set(), [root]
    while queue:
        name = queue.pop()
        if name in functions and name not in found:
            found.add(name)
            queue += re.findall(r"hystgen_\w+(?=\()", functions[name].body)  # type: ignore[attr-defined]
    return found


HEAD = "int hystgen_f(hystgen_inverse_t *self, int x) {\n"
ITSELF = "static int hystgen_g(int v) {\n    return v;\n}\n"
DOUBLE = "static int hystgen_g(int v) {\n    return v + v;\n}\n"
CALLS = "static int hystgen_g(int v) {\n    return hystgen_h(v, 2 * v);\n}\n"
MOVED = "static int hystgen_g(int *play) {\n    play[0] = 1;\n    return 1;\n}\n"
TRUE = "static bool hystgen_g(int v) {\n    (void)v;\n    return true;\n}\n"


@pytest.mark.parametrize(
    ("hook", "lines", "wanted"),
    [
        (ITSELF, ["return 2 * hystgen_g(x + 1);"], "return 2 * (x + 1);"),
        (ITSELF, ["return hystgen_g(x + 1);"], "return x + 1;"),
        (ITSELF.replace("int hyst", "int64_t hyst"), ["return hystgen_g(x) * x;"], None),
        (CALLS.replace("static", "HYSTGEN_APART"), ["return hystgen_g(x + 1);"], None),  # apart to save stack
        ("static void hystgen_g(int v) {\n}\n", ["if (self->moving) {", "    hystgen_g(x);", "}", "return x;"],
         "{ return x; }"),
        (TRUE, ["if (!hystgen_g(x)) {", "    return 1;", "}", "return x;"], "{ return x; }"),
        (TRUE, ["if (x > 0) {", "    x = 1;", "} else if (!hystgen_g(x)) {", "    x = 2;", "}", "return x;"],
         "{ if (x > 0) { x = 1; } return x; }"),
        (DOUBLE.replace("int v", "int v, bool *limited"),
         ["bool limited = false;", "const int y = hystgen_g(x, &limited);", "if (limited) {", "    self->status = 1;",
          "}", "return y;"], "{ return x + x; }"),
        (ITSELF, ["const int y = hystgen_g(x);", "if (y < x || y > x) {", "    self->status |= 1u;", "}", "return y;"],
         "{ return x; }"),
        (DOUBLE, ["self->last = x;", "return hystgen_g(x);"], "{ return x + x; }"),
        (DOUBLE, ["return hystgen_g(x) + hystgen_g(x);"], None),  # two calls: a name says more
        (DOUBLE, ["return hystgen_g(x + 1);"], "{ const int v = x + 1; return v + v; }"),  # computed once
        (DOUBLE.replace("(int v", "(int64_t v"), ["return hystgen_g(x);"],
         "{ const int64_t v = x; return v + v; }"),  # the sum of wider numbers
        (DOUBLE, ["const int64_t y = hystgen_g(x);", "return y > 9 ? 9 : x;"], None),  # a sum would be widened
        (DOUBLE.replace("v + v", "v + 0.5"), ["return 2 * hystgen_g(x);"], None),  # of another type
        ("static bool hystgen_g(int v) {\n    return v == 1;\n}\n", ["if (!hystgen_g(x)) {", "    return 1;", "}",
         "return x;"], "{ if (x != 1) { return 1; } return x; }"),
        ("static void hystgen_g(hystgen_inverse_t *self, int v) {\n    self->last += v;\n    self->next += v;\n}\n",
         ["hystgen_g(self, x + 1);", "return self->last + self->next;"],
         "{ const int v = x + 1; self->last += v; self->next += v; return self->last + self->next; }"),
        ("static int hystgen_g(int w, bool *low) {\n    *low = w < 0;\n    return *low ? 0 : w;\n}\n",
         ["bool under = false;", "return hystgen_g(x, &under);"],
         "{ bool under = false; under = x < 0; return under ? 0 : x; }"),
        ("static int hystgen_g(int w) {\n    const int y = w + w;\n    return y > 1 ? y : 1;\n}\n",
         ["const int y = x + 1;", "return hystgen_g(y);"], None),  # two constants of one name
        (DOUBLE, ["self->last = self->last + x;", "return self->last;"], None),
        (DOUBLE, ["self->last = hystgen_h(self, x);", "return hystgen_g(x);"],
         "{ self->last = hystgen_h(self, x); return x + x; }"),
        (DOUBLE, ["const int y = hystgen_g(x);", "return x;"], "{ return x; }"),
        (ITSELF, ["unsigned int bits = 0;", "if (x > 9) {", "    bits |= 4;", "}", "return x;"], "{ return x; }"),
        (MOVED, ["const int y = hystgen_g(play);", "return play[0];"], None),  # the call moves a play
    ],
)  # fmt: skip
def test_what_is_folded(hook: str, lines: list[str], wanted: str | None) -> None:
    body = "".join(f"    {line}\n" for line in lines)
    head = HEAD if "self" in body else HEAD.replace("hystgen_inverse_t *self, ", "int *play, " * ("play" in body))
    before, after = " ".join((head + body + "}").split()), fold(hook, f"{head}{body}}}\n")
    assert (wanted or before) in after
