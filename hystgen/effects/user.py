"""A user's own effects, from Python files in the form of those of the catalogue."""

from __future__ import annotations

import hashlib
import importlib.machinery
import importlib.util
import os
import sys
import traceback
from pathlib import Path
from typing import NoReturn

from hystgen.basics.problems import EffectsError
from hystgen.effects import own
from hystgen.effects.base import USER, Effect, Place


class _AsItStands(importlib.machinery.SourceFileLoader):
    """Loads a file as it is now: Python's bytecode cache identifies a version of a file only by its size and time in
    seconds, and would return the old version after an edit that changes neither."""

    def path_stats(self, path: str) -> NoReturn:
        raise OSError("not to be cached")


METHODS = {
    Place.DRIVE: ("drive",),
    Place.PLAYS: ("plays", "bent", "parallel"),
    Place.LINEAR: ("filtered",),
    Place.GAIN: ("gain", "offset"),
    Place.OUTPUT: ("mapped",),
    Place.ADDED: ("added",),
}
"""Methods by place, at least one of which a class has to define."""


def load_user_effects(path: str | os.PathLike[str]) -> tuple[type[Effect], ...]:
    """The effect classes that a Python file, or the `model.py` of a folder, defines; it is run, so it must be trusted.

    Each is a subclass of `hystgen.effects.Effect` with `name: Literal["user:..."]`, a `place` and a method of that
    place; several classes of one name are its shapes, the first being the default. Raises EffectsError with one message
    if the file cannot be run or has no usable effect.
    """
    file = Path(path)
    file = file / "model.py" if file.is_dir() else file
    # A separate name for every file and content, since pickling and numba find functions by module name
    try:
        mark = hashlib.sha256(str(file.resolve()).encode() + file.read_bytes()).hexdigest()[:12]
    except OSError as error:
        raise EffectsError(
            f"{file}: cannot be read ({error.strerror or error}); give a folder with model.py, or a Python file"
        ) from None
    name = f"hystgen_user_effects_{mark}"
    if name not in sys.modules:
        spec = importlib.util.spec_from_loader(name, _AsItStands(name, str(file)))
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except (Exception, SystemExit) as error:
            del sys.modules[name]
            raise EffectsError(f"{file}{_line(error, file)}: {type(error).__name__}: {error}") from None
    found = [
        value
        for value in vars(sys.modules[name]).values()
        if isinstance(value, type) and issubclass(value, Effect) and value.__module__ == name
        and not value.__name__.startswith("_")
    ]
    if not found:
        raise EffectsError(f"{file}: defines no effect; write a class of hystgen.effects.Effect")
    for effect in found:
        if problem := _problem(effect):
            raise EffectsError(f"{file}: class {effect.__name__} {problem}")
    return tuple(found)


def _line(error: BaseException, file: Path) -> str:
    """`:LINE` of the file at which running it failed; empty if it failed elsewhere."""
    if isinstance(error, SyntaxError):
        return f":{error.lineno}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    return f":{lines[-1]}" if lines else ""


def _problem(effect: type[Effect]) -> str:
    """Why a class cannot be used; empty if it can."""
    words: tuple[object, ...] = getattr(effect.model_fields["name"].annotation, "__args__", ())
    if len(words) != 1 or not str(words[0]).startswith(USER) or words[0] == USER:
        return 'needs a name of its own; write name: Literal["user:my_effect"]'
    if not isinstance(getattr(effect, "place", None), Place):
        return "needs a place; write place: ClassVar[Place] = Place.OUTPUT, or another of hystgen.effects.Place"
    methods = METHODS[effect.place]
    if not any(getattr(effect, method) is not getattr(Effect, method) for method in methods):
        return f"has place {effect.place.value}, so it has to define {' or '.join(methods)}"
    return own.problem(effect)
