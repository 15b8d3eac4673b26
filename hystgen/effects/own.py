"""The compensator of a user's own effect: a linear block in Python, and the C file with the same functions.

    def rest(t, s, x): ...      settle at the input x; returns the output
    def resting(t, y): ...      the input of the settled output y
    def solve(t, s, y): ...     the input that gives the output y at this sample
    def absorb(t, s, x): ...    the input is x at this sample; returns the output

The functions index two arrays: `t`, the block's parameters, and `s`, its memory. They run unchanged in double
precision, and compiled as the bit-exact reference of the C in each arithmetic, so they use only +, - and
`product(t[..], ..)`: a literal would not have the precision of the C.
"""

from __future__ import annotations

import ast
import functools
import inspect
import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hystgen.basics.names import KEYWORDS
from hystgen.basics.problems import EffectsError
from hystgen.basics.structures import Number, Signal, declared
from hystgen.effects.base import USER, Array, Block, Effect, Place
from hystgen.effects.kinds import BlockKind, OwnBlock, product

ARGUMENTS = {"rest": 3, "resting": 2, "solve": 3, "absorb": 3}
"""Number of arguments of each function."""

NAME = re.compile(r"user:([a-z][a-z0-9_]{0,30})")
"""Names of effects from which the C name of a block can be made."""

WORD = re.compile(r"[a-z][a-z0-9_]{0,30}")
"""Names of a block's parameters and states, which are also their names in C."""


@functools.cache
def kind(effect: type[Effect]) -> BlockKind:
    """The kind of an effect's block."""
    assert effect.block is not None
    table, state = effect.block.table, effect.block.state
    called = _name(effect)
    shape = str(effect.model_fields["shape"].annotation.__args__[0]) if not called.startswith(USER) else ""  # type: ignore[union-attr]
    name = f"{called}_{shape}" if shape else f"user_{called.partition(':')[2]}"
    return BlockKind(name, declared(f"{name}_table", table, Number), declared(name, state, Signal))


def source(effect: type[Effect]) -> Path:
    """The C file of an effect that has a block."""
    assert effect.block is not None
    return Path(_file(effect)).parent / effect.block.source


def _file(effect: type[Effect]) -> str:
    """The Python file of an effect; `model.py` if it is unknown."""
    return str(getattr(sys.modules.get(effect.__module__), "__file__", None) or "model.py")


def origin(effect: type[Effect]) -> str:
    """The argument of `--effects` for an effect: the last component of the folder's or file's path."""
    file = Path(_file(effect))
    return file.parent.name if file.name == "model.py" else file.name


def numbers(effect: Effect, seconds: float) -> Array:
    """The parameters of an effect's block at steps of `seconds`. Raises EffectsError if they are wrong."""
    assert effect.block is not None
    try:
        found = np.asarray(effect.numbers(seconds), dtype=np.float64)
    except Exception as error:
        raise _failed(effect, "numbers", error) from error
    wanted = len(effect.block.table)
    if found.shape != (wanted,) or not np.isfinite(found).all():
        raise EffectsError(
            f"the effect {effect.name} answered {found.tolist()} in numbers; {wanted} finite numbers were expected, "
            f"{', '.join(effect.block.table)}"
        )
    return found


def _failed(effect: Effect, function: str, error: Exception) -> EffectsError:
    return EffectsError(f"the effect {effect.name} failed in {function}: {type(error).__name__}: {error}")


class Instance(Block):
    """The block of a user's own effect in double precision; it caches the parameters per step length."""

    def __init__(self, effect: Effect) -> None:
        assert effect.block is not None
        self.effect, self.block = effect, effect.block
        self.state = np.zeros(len(effect.block.state))
        self._numbers = functools.lru_cache(maxsize=64)(functools.partial(numbers, effect))
        self.advance(1.0)  # at rest the length of a step does not matter

    def advance(self, seconds: float, later: float | None = None) -> None:
        """Set the parameters for this step."""
        self.table = self._numbers(seconds)

    def call(self, verb: str, x: float) -> float:
        """The result of a verb for x."""
        memory = () if verb == "resting" else (self.state,)
        try:
            return float(getattr(self.block, verb)(self.table, *memory, x))
        except Exception as error:
            raise _failed(self.effect, verb, error) from error


# ---------------------------------------------------------------- faults of a block


def _name(effect: type[Effect]) -> str:
    return str(effect.model_fields["name"].annotation.__args__[0])  # type: ignore[union-attr]


def problem(effect: type[Effect]) -> str:
    """Why the block of a class cannot be used; empty if it can."""
    block = effect.block
    if block is None:
        return ""
    if not isinstance(block, OwnBlock):
        return f"has block {type(block).__name__}; write block: ClassVar[OwnBlock] = OwnBlock(..)"
    if _name(effect).startswith(USER) and not NAME.fullmatch(_name(effect)):
        return f"has a block, and {_name(effect)} cannot name it in C; write user: and lower-case letters, digits and _"
    if effect.place is not Place.DRIVE and (effect.place, effect.order) != (Place.LINEAR, 0):
        return "has a block, which needs place Place.DRIVE, or Place.LINEAR with order 0"
    words = [*block.table, *block.state]
    wrong = [word for word in words if not WORD.fullmatch(word) or word in KEYWORDS]
    twice = [word for names in (block.table, block.state) for word in names if names.count(word) > 1]
    if wrong or twice or not block.table or not block.state:
        return f"has {(wrong + twice + ['no'])[0]!r} among the names of its table and state; give each once, as C names"
    if not re.fullmatch(r"[A-Za-z0-9_]+\.c", str(block.source)):
        return f"has {block.source!r} as its C file; give the name of a file next to the Python file"
    return ""


@functools.cache
def check(effect: type[Effect]) -> None:
    """Raise EffectsError, a line `FILE:LINE: what; do` per fault, if a block cannot be the reference of its C."""
    assert effect.block is not None
    if wrong := problem(effect):
        raise EffectsError(f"the effect {_name(effect)} {wrong}")
    if faults := [fault for verb, function in effect.block.verbs() for fault in _of_function(verb, function)]:
        raise EffectsError("\n".join(faults))


ALLOWED = (
    ast.FunctionDef, ast.arguments, ast.arg, ast.Assign, ast.Return, ast.Expr, ast.BinOp, ast.UnaryOp, ast.USub,
    ast.Name, ast.Load, ast.Store, ast.Subscript, ast.For, ast.Call, ast.Constant,
)
"""Names and operations that the functions may use."""


def _of_function(verb: str, function: Any) -> Iterator[str]:
    try:
        lines, first = inspect.getsourcelines(function)
        file = inspect.getsourcefile(function)
        tree = ast.parse(textwrap.dedent("".join(lines))).body[0]
    except (OSError, TypeError, SyntaxError):
        yield f"{verb} has no readable source; write it as a function in the file"
        return
    if not isinstance(tree, ast.FunctionDef) or len(tree.args.args) != ARGUMENTS[verb]:
        yield f"{file}:{first}: {verb} has to be a function of {ARGUMENTS[verb]} arguments"
        return
    tree.decorator_list, tree.returns = [], None
    for each in tree.args.args:
        each.annotation = None
    if isinstance(tree.body[0], ast.Expr) and isinstance(tree.body[0].value, ast.Constant):
        tree.body = tree.body[1:]  # the docstring
    inner = [node.slice for node in ast.walk(tree) if isinstance(node, ast.Subscript)]
    inner += [node.iter for node in ast.walk(tree) if isinstance(node, ast.For)]
    places = {id(part) for node in inner for part in ast.walk(node)}
    known = inspect.getclosurevars(function).globals
    for node in ast.walk(tree):
        place = f"{file}:{first + getattr(node, 'lineno', 1) - 1}"
        if id(node) in places and isinstance(node, ast.Name | ast.Constant | ast.BinOp | ast.Add | ast.Sub | ast.Load):
            continue
        called = known.get(_called(node), _called(node))
        named = isinstance(node, ast.Name) and isinstance(known.get(node.id), int | float)
        if isinstance(node, ast.Constant) or named:
            what = ast.unparse(node)
            yield f"{place}: the number {what} in {verb} does not have the precision of the C; put it in the table"
        elif called is product:
            if not _of_table(node, tree.args.args[0].arg):
                yield f"{place}: {verb} has {ast.unparse(node)}; give a table entry first, product(t[..], ..)"
        elif isinstance(node, ast.operator):
            continue  # the message about its operation includes it
        elif (
            not isinstance(node, ALLOWED)
            or (isinstance(node, ast.BinOp) and not isinstance(node.op, ast.Add | ast.Sub))
            or (isinstance(node, ast.Call) and called != "range")
        ):
            yield (
                f"{place}: {verb} has {ast.unparse(node) or type(node).__name__}; write it with +, -, "
                "product(t[..], ..) and `for .. in range(..)`"
            )


def _called(node: ast.AST) -> str:
    """The name of the function that is called; empty if the call has none."""
    return node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""


def _of_table(call: Any, t: str) -> bool:
    """Whether the first of two factors is an entry of the table `t`."""
    first = call.args[0] if len(call.args) == 2 and not call.keywords else None
    return isinstance(first, ast.Subscript) and isinstance(first.value, ast.Name) and first.value.id == t
