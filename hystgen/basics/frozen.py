"""Frozen dataclasses that are quick to define, for what every command imports.

`dataclasses.dataclass(frozen=True)` writes six methods for each class and compiles them, which takes 4.2 million
instructions; 0.7 million are left here (callgrind, 100 classes of five fields, Python 3.11), and `hystgen emit` of a
plain model defines 50 classes. Type checkers see the standard decorator. An instance takes longer to make; classes of
which a command makes more than some thousands are better off with the standard one.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError, fields
from dataclasses import dataclass as standard
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, TypeVar

T = TypeVar("T")


class _Known(NamedTuple):
    """What the methods of a class know about it."""

    fields: tuple[Field[Any], ...]
    given: tuple[str, ...]
    every: frozenset[str]
    defaults: dict[str, object]
    compared: tuple[str, ...]


def _init(self: Any, *given: object, **named: object) -> None:
    known: _Known = self._known
    values = {**known.defaults, **dict(zip(known.given, given, strict=False)), **named}
    if len(given) > len(known.given) or values.keys() != known.every or not named.keys().isdisjoint(
        known.given[: len(given)]
    ):
        inspect.signature(type(self)).bind(*given, **named)  # says what is wrong
    self.__dict__.update(values)
    if hasattr(self, "__post_init__"):
        self.__post_init__()


def _repr(self: Any) -> str:
    shown = ", ".join(f"{each.name}={getattr(self, each.name)!r}" for each in self._known.fields if each.repr)
    return f"{type(self).__qualname__}({shown})"


def _compared(self: Any) -> tuple[object, ...]:
    return tuple(getattr(self, name) for name in self._known.compared)


def _eq(self: Any, other: object) -> bool:
    return _compared(self) == _compared(other) if other.__class__ is self.__class__ else NotImplemented


def _hash(self: Any) -> int:
    return hash(_compared(self))


def _refuse(_: object, name: str, *__: object) -> NoReturn:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


class _Signature:
    """The signature of a class, made when somebody asks for it."""

    def __get__(self, _: object, of: Any) -> inspect.Signature:
        return inspect.Signature([
            inspect.Parameter(
                each.name, inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=each.type,
                default=inspect.Parameter.empty if each.default is MISSING else each.default,
            )
            for each in of._known.fields if each.init
        ])  # fmt: skip


_METHODS = {
    "__init__": _init, "__repr__": _repr, "__eq__": _eq, "__hash__": _hash,
    "__setattr__": _refuse, "__delattr__": _refuse, "__signature__": _Signature(),
}


def _frozen(*, frozen: bool) -> Callable[[type[T]], type[T]]:
    assert frozen

    def made(cls: Any) -> Any:
        own = {name: method for name, method in _METHODS.items() if name not in vars(cls)}
        found = fields(standard(init=False, repr=False, eq=False)(cls))
        given = tuple(each.name for each in found if each.init)
        defaults = {each.name: each.default for each in found if each.default is not MISSING}
        own["_known"] = _Known(
            found, given, frozenset(given), defaults, tuple(each.name for each in found if each.compare)
        )
        for name, method in own.items():
            setattr(cls, name, method)
        return cls

    return made


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:
    dataclass = _frozen
