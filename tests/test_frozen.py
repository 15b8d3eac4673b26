"""Frozen dataclasses with shared methods, against those of the standard library."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from typing import Any, ClassVar

import pytest

from hystgen.basics import frozen

LEFT_OUT = dataclasses.field(default=2, repr=False, compare=False)


def classes(decorator: Callable[..., Any]) -> tuple[Any, Any]:
    """A class, and one that inherits from it, as a decorator makes them."""

    @decorator(frozen=True)
    class Point:
        """A point."""

        kind: ClassVar[str] = "plane"
        x: float
        y: float = 1.0
        hidden: int = LEFT_OUT
        size: float = dataclasses.field(init=False)

        def __post_init__(self) -> None:
            object.__setattr__(self, "size", abs(self.x) + abs(self.y))

    @decorator(frozen=True)
    class Named(Point):
        """A point with a name."""

        name: str = "p"

        def __repr__(self) -> str:
            return f"<{self.name}>"

    return Point, Named


OURS, STANDARD = classes(frozen._frozen), classes(dataclasses.dataclass)


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize(("given", "named"), [((1.0,), {}), ((1.0, 2.0), {"hidden": 5}), ((), {"x": 3.0, "y": 4.0})])
def test_instances_are_as_of_the_standard_library(which: int, given: tuple[float, ...], named: dict[str, Any]) -> None:
    ours, standard = (found[which](*given, **named) for found in (OURS, STANDARD))
    assert vars(ours) == vars(standard)
    assert repr(ours) == repr(standard)
    assert hash(ours) == hash(standard)
    assert inspect.signature(OURS[which]).parameters == inspect.signature(STANDARD[which]).parameters
    for change in ({"x": 7.0}, {"y": -1.0, "hidden": 0}):
        assert vars(dataclasses.replace(ours, **change)) == vars(dataclasses.replace(standard, **change))
    assert copy.copy(ours) == ours == OURS[which](*given, **{**named, "hidden": 9})
    assert ours != dataclasses.replace(ours, x=8.0)
    assert ours != standard
    with pytest.raises(dataclasses.FrozenInstanceError, match="field 'x'"):
        ours.x = 0.0
    with pytest.raises(dataclasses.FrozenInstanceError, match="field 'x'"):
        del ours.x


@pytest.mark.parametrize(
    ("given", "named"),
    [((), {}), ((1.0, 2.0, 3, 4.0, 5.0), {}), ((1.0,), {"x": 2.0}), ((1.0,), {"size": 2.0}), ((1.0,), {"z": 2})],
)
def test_wrong_arguments_are_refused(given: tuple[Any, ...], named: dict[str, Any]) -> None:
    for made, _ in (OURS, STANDARD):
        with pytest.raises(TypeError, match=r"argument"):
            made(*given, **named)


def test_instances_can_be_sent_to_other_processes() -> None:
    from hystgen.cascade import PI

    made = PI((0.0, 1.0), (0.5, 0.25))
    assert pickle.loads(pickle.dumps(made)) == made
