"""Frozen dataclasses that are quick to define, for what every command imports.

`dataclasses.dataclass(frozen=True)` writes six methods for each class and compiles them, which takes 4.2 million
instructions; 0.7 million are left here (callgrind, 100 classes of five fields, Python 3.11), and `hystgen emit` of a
plain model defines 50 classes. Type checkers see the standard decorator. An instance takes longer to make: a class of
which a command makes many thousands is better off with the standard one.
"""

from __future__ import annotations

import inspect
from dataclasses import MISSING, FrozenInstanceError, fields
from dataclasses import dataclass as standard
from typing import TYPE_CHECKING, NoReturn
from typing import Any as Instance  # of a class that the decorator made, or the class


def _init(self: Instance, *given: object, **named: object) -> None:
    passed = {**dict(zip(self.__match_args__, given, strict=False)), **named}
    values = {**self._defaults, **passed}
    if len(passed) < len(given) + len(named) or values.keys() != self._names:
        inspect.signature(type(self)).bind(*given, **named)  # says what is wrong
    self.__dict__.update(values)
    if hasattr(self, "__post_init__"):
        self.__post_init__()


def _signature(of: Instance) -> inspect.Signature:
    return inspect.Signature([
        inspect.Parameter(
            each.name, inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=each.type,
            default=inspect.Parameter.empty if each.default is MISSING else each.default,
        )
        for each in fields(of) if each.init
    ])


def _compared(self: Instance) -> tuple[object, ...]:
    return tuple(getattr(self, each.name) for each in fields(self) if each.compare)


def _refuse(_: object, name: str, *__: object) -> NoReturn:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _repr(self: Instance) -> str:
    shown = ", ".join(f"{each.name}={getattr(self, each.name)!r}" for each in fields(self) if each.repr)
    return f"{type(self).__qualname__}({shown})"


_METHODS = {
    "__init__": _init, "__repr__": _repr, "__setattr__": _refuse, "__delattr__": _refuse,
    "__hash__": lambda self: hash(_compared(self)),
    "__eq__": lambda self, other: _compared(self) == _compared(other) if type(other) is type(self) else NotImplemented,
    "__signature__": type("Signature", (), {"__get__": lambda _, __, of: _signature(of)})(),
}


def _frozen(*, frozen: bool) -> Instance:
    assert frozen

    def made(cls: Instance) -> Instance:
        for name, method in _METHODS.items():
            if name not in vars(cls):
                setattr(cls, name, method)
        found = fields(standard(init=False, repr=False, eq=False)(cls))
        cls._names = frozenset(cls.__match_args__)
        cls._defaults = {each.name: each.default for each in found if each.default is not MISSING}
        return cls

    return made


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:
    dataclass = _frozen
