"""Turns plain data into checked parameters; reports every problem at once, in one plain sentence with its position.

The structure is checked first (pydantic's findings, reworded), then how values fit together, in every part with a sound
structure.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, get_args

from pydantic import BaseModel, ValidationError

from hystgen import effects
from hystgen.basics.names import name_problem
from hystgen.basics.problems import Path, Problem, nearest, path_text, printable, shown
from hystgen.basics.quantities import MAX_NUMBER
from hystgen.parameters import schema
from hystgen.parameters.yaml import Document

if TYPE_CHECKING:
    from hystgen.effects import Effect
    from hystgen.plays.density import Discretisation, Formula

Shapes = tuple["type[Effect]", ...]
"""Classes that share a name."""

_FRONT = effects.CATALOGUE.index(effects.LIMIT)

EFFECT_NAMES = (*effects.CATALOGUE[:_FRONT], effects.BEND, *effects.CATALOGUE[_FRONT:])
"""Names of effects: the folders of the catalogue, and asymmetry, which is a memoryless stage of the model."""

_PARTS: dict[str, type[BaseModel]] = {
    "units": schema.Units,
    "model": schema.ModelParameters,
    "pi": schema.PIParameters,
    "density": schema.DensityParameters,
    "table": schema.DensityTable,
    "ascending": schema.TanhBranch,
    "descending": schema.TanhBranch,
    "emit": schema.EmitDefaults,
    "compensation": schema.Compensation,
    "converter": schema.Converters,
    "reference": schema.Converter,
    "drive": schema.Converter,
    "health": schema.Health,
    "residual": schema.Residual,
    "degauss": schema.Degaussing,
}

_PLACES: dict[str, type[BaseModel]] = {
    "at the top level": schema.Parameters,
    "in model": schema.ModelParameters,
    "in model.pi": schema.PIParameters,
    "in emit": schema.EmitDefaults,
    "in emit.compensation": schema.Compensation,
    "in emit.health": schema.Health,
}
"""The place where a misplaced key belongs, in words, with that place's keys."""

# Examples of how a key is written, for messages about missing keys.
_WRITTEN = {
    "hystgen": "hystgen: 1",
    "name": "name: stage_x",
    "input_range": "input_range: [0.0, 100.0]",
    "model": "model: {pi: {thresholds: [0, 0.5], weights: [0.7, 0.6]}}",
    "pi": "pi: {thresholds: [0, 0.5], weights: [0.7, 0.6]}",
    "thresholds": "thresholds: [0, 0.5, 1.0]",
    "weights": "weights: [0.7, 0.6, 0.5]",
    "kind": "kind: dead_zone` or `kind: tanh",
    "ascending": "ascending: {a0: 6.0, a1: 0.4, a2: 0.0, a3: 0.0}",
    "r": "r: [0, 5, 10]",
    "p": "p: [0.8, 0.2, 0.1]",
    "p0": "p0: 0.7",
    "r_max": "r_max: 10",
    "reference": "reference: {bits: 16, range: [0, 20], coding: offset-binary}",
    "drive": "drive: {bits: 16, range: [-10, 110], coding: offset-binary}",
    "bits": "bits: 16",
    "range": "range: [-10, 110]",
    "coding": "coding: offset-binary` or `coding: twos-complement",
}


def check(
    data: Mapping[str, object], document: Document | None = None, user: Mapping[str, Shapes] | None = None
) -> tuple[schema.Parameters | None, list[Problem]]:
    """Parameters made from `data` (lists as tuples), or None, and every problem.

    `document`: positions, and values already refused while reading, which are not checked again. `user`: classes of the
    user's own effects by name.
    """
    checker = _Checker(data, document, user or {})
    parameters = checker.structure()
    checker.fit()
    if parameters is None or checker.problems or (document and document.problems):
        return None, checker.problems
    found = checker.discretisation
    if found is not None:
        pi = parameters.model.pi.model_copy(update={"thresholds": found.thresholds, "weights": found.weights})
        pi._density_errors = found.error, found.output_error
        parameters = parameters.model_copy(update={"model": parameters.model.model_copy(update={"pi": pi})})
    if checker.effects:
        model = parameters.model.model_copy(update={"effects": tuple(checker.effects)})
        parameters = parameters.model_copy(update={"model": model})
    return parameters, []


class _Checker:
    def __init__(self, data: Mapping[str, object], document: Document | None, user: Mapping[str, Shapes]) -> None:
        self.data = data
        self.document = document
        self.user = user
        self.problems: list[Problem] = []
        self.discretisation: Discretisation | None = None
        self.effects: list[Effect] = []
        self._mover: tuple[str, str] | None = None
        self._classes: dict[Path, type[Effect]] = {}
        self._seen: dict[str, str] = {}
        self._bad: set[Path] = set()
        self._above_bad: set[Path] = set()
        for path in document.poisoned if document else ():
            self._mark(path)

    # Bookkeeping ------------------------------------------------------------------------------------------

    def add(self, path: Path, message: str, at_key: bool = False) -> None:
        """Record a problem with the value (or key) at `path` or, if that is missing, with what should contain it."""
        line, column = self.document.position(path, at_key) if self.document else (None, None)
        self.problems.append(Problem(path_text(path), message, line, column))

    def _mark(self, path: Path) -> None:
        """Remember that the structure at `path` is not sound."""
        self._bad.add(path)
        self._above_bad.update(path[:n] for n in range(len(path)))

    def sound(self, path: Path) -> bool:
        """Whether the structure is sound at `path`, below it and in everything that contains it."""
        return path not in self._above_bad and not self.judged(path)

    def judged(self, path: Path) -> bool:
        """Whether the structure at `path`, or that of anything containing it, is known to be unsound."""
        return any(path[:n] in self._bad for n in range(len(path) + 1))

    def at(self, path: Path) -> Any:
        """Value in the data; None if it is missing."""
        value: object = self.data
        for part in path:
            if isinstance(part, int):
                value = value[part] if isinstance(value, tuple) and part < len(value) else None
            else:
                value = value.get(part) if isinstance(value, Mapping) else None
        return value

    def get(self, *path: str | int) -> Any:
        """Value in the data if its structure is sound, else None."""
        return self.at(path) if self.sound(path) else None

    # Structure --------------------------------------------------------------------------------------------

    def structure(self) -> schema.Parameters | None:
        """The parameters; or None, with pydantic's findings added to the problems."""
        parameters = None
        try:
            parameters = schema.Parameters.model_validate(self.data)
        except ValidationError as error:
            self._found(error, self._path)
        self._empty_values()
        return parameters

    def _found(self, error: ValidationError, path_of: Callable[[Sequence[str | int]], Path]) -> None:
        for found in error.errors(include_url=False):
            path = path_of(found["loc"])
            if not self.judged(path):
                self._structural(path, found["type"], found.get("ctx", {}), found["msg"])

    def _path(self, location: Sequence[str | int]) -> Path:
        """Pydantic's location as a path in the data: without union members, and without 0 for a single stage."""
        path: list[str | int] = []
        value: object = self.data
        for part in location:
            if isinstance(part, int):
                if isinstance(value, Mapping):
                    continue
                value = value[part] if isinstance(value, tuple) and part < len(value) else None
            elif part in schema.MEMBERS:
                continue
            else:
                value = value.get(part) if isinstance(value, Mapping) else None
            path.append(part)
        return tuple(path)

    def _structural(self, path: Path, kind: str, context: Mapping[str, Any], said: str) -> None:
        value = self.at(path)
        key = _last_key(path)
        if kind.startswith("union_tag") and isinstance(value, Mapping):  # a stage of unknown kind
            path, value, key = (*path, "kind"), value.get("kind"), "kind"
            kind = "literal_error" if "kind" in self.at(path[:-1]) else "missing"
            if self.judged(path):
                return
        if kind == "too_short" and len(value) >= context.get("min_length", 0):
            return  # too few sound values, but each unsound one has been reported
        self._mark(path)
        effect = self._classes.get(path[:3])
        hint = f" ({effect.hint})" if effect and effect.hint else ""
        if kind == "missing" and not isinstance(path[-1], int):
            self.add(path, f"is missing; add `{self._written(effect, key)}`{hint}")
        elif kind == "missing":
            self.add(path[:-1], _TWO_NAMES if path[0] == "not_separable" else _TWO_NUMBERS)
        elif kind == "extra_forbidden":
            known = self._keys(path[:-1])
            place = next((place for place, part in _PLACES.items() if key in part.model_fields), None)
            advice = f"it belongs {place}" if place else nearest(key, known)
            self.add(path, f"unknown key; {advice or 'valid here: ' + ', '.join(known)}{hint}", at_key=True)
        elif value is None:
            self.add(path, _NO_VALUE, at_key=isinstance(path[-1], str))
        elif path[0] == "not_separable" and kind == "too_long":
            self.add(path, _TWO_NAMES)
        elif isinstance(path[-1], int) and not kind.startswith("union_tag"):
            self.add(path, _reworded(kind, "", value, context, said))
        else:
            self.add(path, _reworded(kind, key, value, context, said))

    @staticmethod
    def _written(effect: type[Effect] | None, key: str) -> str:
        """An example of how a missing key is written."""
        if effect is None:
            return _WRITTEN.get(key, f"{key}: 0.0")
        examples = effect.model_fields[key].examples
        return f"{key}: {examples[0] if examples else 0.0}"

    def _keys(self, path: Path) -> list[str]:
        """The keys of the mapping at `path`."""
        if effect := self._classes.get(path):
            return list(effect.model_fields)
        key = _last_key(path)
        part = _PARTS.get(key, schema.Parameters)
        if key == "memoryless":
            part = schema.TanhParameters if self.at((*path, "kind")) == "tanh" else schema.DeadZoneParameters
        return list(part.model_fields)

    def _empty_values(self) -> None:
        """Report keys without a value, which pydantic accepts if None is the default."""
        todo: list[tuple[Path, object]] = [((), self.data)]
        while todo:
            path, value = todo.pop()
            if value is None and not self.judged(path):
                self._mark(path)
                self.add(path, _NO_VALUE, at_key=isinstance(path[-1], str))
            elif isinstance(value, Mapping):
                todo += [((*path, key), entry) for key, entry in value.items()]
            elif isinstance(value, tuple):
                todo += [((*path, i), entry) for i, entry in enumerate(value) if not isinstance(entry, float)]

    # How values fit together ------------------------------------------------------------------------------

    def fit(self) -> None:
        """Check what pydantic does not, in the parts whose structure is sound."""
        name = self.get("name")
        if name is not None and (problem := name_problem(name)):
            self.add(("name",), problem)
        self._text(("description",), lines=True)
        for path in (("units", "input"), ("units", "output"), ("emit", "output")):
            self._text(path, lines=False)
        ends = self.get("input_range")
        if ends is not None and not ends[0] < ends[1]:
            self.add(("input_range",), f"{shown(ends[0])} is not below {shown(ends[1])}; write [lowest, highest]")
        for side in ("reference", "drive"):
            self._converter(("emit", "converter", side), ends if side == "drive" else None)
        window = self.get("emit", "health", "window")
        if window is not None and window & (window - 1):
            near = 1 << (window.bit_length() - 1)
            self.add(("emit", "health", "window"), f"must be a power of 2, not {window}; give {near} or {2 * near}")
        end = self.get("emit", "degauss", "end")
        if ends is not None and end is not None and not ends[0] <= end <= ends[1]:
            self.add(("emit", "degauss", "end"), f"{shown(end)} is outside input_range; give a drive inside it")
        if isinstance(self.at(("model", "pi")), Mapping):
            self._pi(("model", "pi"))
        stages = self.at(("model", "memoryless"))
        if isinstance(stages, tuple):
            for i in range(len(stages)):
                self._memoryless(("model", "memoryless", i))
        elif isinstance(stages, Mapping):
            self._memoryless(("model", "memoryless"))
        if isinstance(listed := self.at(("model", "effects")), tuple):
            for i, effect in enumerate(listed[: schema.MAX_EFFECTS]):
                self._effect(("model", "effects", i), effect)

    def _converter(self, path: Path, needed: tuple[float, float] | None) -> None:
        """A converter, whose codes reach every quantity in the range `needed`."""
        ends = self.get(*path, "range")
        if ends is None:
            return
        low, high = float(min(ends)), float(max(ends))
        if low == high:
            self.add((*path, "range"), "both ends are the same; write the quantities at the lowest and highest code")
        elif needed is not None and not (low <= needed[0] and needed[1] <= high):
            self.add(
                (*path, "range"),
                f"reaches {shown(low)} .. {shown(high)}, but input_range is {shown(needed[0])} .. {shown(needed[1])}; "
                "correct the range, or narrow input_range to what the converter reaches",
            )
        elif needed is not None and (bits := self.get(*path, "bits")) is not None:
            step = (high - low) / (2**bits - 1)
            if math.floor((needed[1] - low) / step) <= math.ceil((needed[0] - low) / step):
                self.add(
                    (*path, "range"),
                    f"makes steps of {step:.4g}, so fewer than two codes lie in input_range, {shown(needed[0])} .. "
                    f"{shown(needed[1])}; correct the range, which is in input units, or give more bits",
                )

    def _text(self, path: Path, lines: bool) -> None:
        text = self.get(*path) or ""
        odd = next((c for c in text if not (c.isprintable() or (c == "\n" and lines))), None)
        if odd == "\n":
            self.add(path, "must be a single line; remove the line break")
        elif odd is not None:
            self.add(path, f"contains the unprintable character U+{ord(odd):04X}; remove it")

    def _pi(self, path: Path) -> None:
        pi = self.at(path)
        listed = [key for key in ("thresholds", "weights") if key in pi]
        if "density" in pi:
            if listed:
                what = " and ".join(listed)
                self.add((*path, "density"), f"is given as well as {what}; remove one or the other", at_key=True)
            else:
                self._density((*path, "density"))
            return
        if not listed:
            self.add(path, "needs thresholds and weights, or a density; add them")
            return
        for key in ("thresholds", "weights"):
            if key not in pi:
                self.add((*path, key), f"is missing; add `{_WRITTEN[key]}`")
        thresholds, weights = self.get(*path, "thresholds"), self.get(*path, "weights")
        if thresholds:
            if thresholds[0] != 0:
                self.add((*path, "thresholds", 0), f"must be 0, not {shown(thresholds[0])}; start with r_0 = 0")
            self._rising((*path, "thresholds"), thresholds)
            self._state(path, len(thresholds))
        if weights:
            self._same_length(path, "weights", "thresholds")
            if not any(weights):
                self.add((*path, "weights"), "are all 0; at least one must be positive")

    def _state(self, path: Path, count: int) -> None:
        state = self.get(*path, "initial_state")
        if isinstance(state, tuple) and len(state) != count:
            what = f"has {_entries(len(state))} for {count} thresholds (r_0 included)"
            self.add((*path, "initial_state"), f"{what}; write one number, or one per threshold")

    def _same_length(self, path: Path, key: str, reference: str) -> None:
        first, second = self.at((*path, key)), self.get(*path, reference)
        if second is not None and len(first) != len(second):
            what = f"has {_entries(len(first))} for {len(second)} in {reference}"
            self.add((*path, key), f"{what}; give as many as {reference}")

    def _rising(self, path: Path, values: Sequence[float]) -> None:
        for i, (low, high) in enumerate(itertools.pairwise(values), 1):
            if not low < high:
                what = f"{shown(high)} is not above the {shown(low)} before it"
                self.add((*path, i), f"{what}; sort the list and remove repeated values")

    def _density(self, path: Path) -> None:
        given = self.at(path)
        if not isinstance(given, Mapping):
            return
        before = len(self.problems)
        source = [key for key in ("formula", "table") if key in given]
        size = [key for key in ("n", "tolerance") if key in given]
        for one, other, chosen in (("formula", "table", source), ("n", "tolerance", size)):
            if len(chosen) != 1:
                what = f"has both {one} and {other}" if chosen else f"needs {one} or {other}"
                self.add(path, f"{what}; give one of the two")
        if source == ["formula"] and "r_max" not in given:
            self.add((*path, "r_max"), f"is missing; add `{_WRITTEN['r_max']}`")
        if source == ["table"] and "r_max" in given:
            self.add((*path, "r_max"), "is not used with a table, which ends at its last r; remove it", at_key=True)
        table = (*path, "table")
        if r := self.get(*table, "r"):
            self._rising((*table, "r"), r)
        if self.get(*table, "p"):
            self._same_length(table, "p", "r")
        formula = self._formula((*path, "formula"))
        if len(self.problems) > before:
            return
        from hystgen.plays import density as densities  # imports mpmath

        try:
            if formula and (r_max := self.get(*path, "r_max")):
                density = densities.from_formula(formula, r_max)
            elif points := self.get(*table):
                density = densities.from_table(**points)
            else:
                return
            if not self.sound(path):
                return
            if size == ["n"]:
                found = density.discretise(given["p0"], given["n"])
            else:
                found = density.discretise_to(given["p0"], given["tolerance"])
        except densities.DensityError as error:
            self.add((*path, error.part), str(error))
            return
        if not any(found.weights):
            self.add(path, "is 0 everywhere, and so is p0; at least one must be positive")
        elif max(found.weights) > MAX_NUMBER:
            what = f"makes weights up to {max(found.weights):.3g}, more than {MAX_NUMBER:g}"
            self.add(path, f"{what}; choose other units")
        self._state(path[:-1], len(found.thresholds))
        self.discretisation = found

    def _formula(self, path: Path) -> Formula | None:
        text = self.get(*path)
        if text is None:
            return None
        from hystgen.plays import density as densities

        try:
            return densities.parse_formula(text)
        except densities.DensityError as error:
            self.add(path, str(error))
            return None

    def _memoryless(self, path: Path) -> None:
        kind = self.get(*path, "kind")
        if kind == "dead_zone":
            thresholds, weights = self.get(*path, "thresholds"), self.get(*path, "weights")
            if thresholds:
                self._rising((*path, "thresholds"), thresholds)
                if 0 not in thresholds:
                    self.add((*path, "thresholds"), "do not contain 0; add 0 and the weight of the linear part")
            if weights:
                self._same_length(path, "weights", "thresholds")
        elif kind == "tanh":
            for branch in ((*path, "ascending"), (*path, "descending")):
                self._branch(branch)

    def _branch(self, path: Path) -> None:
        a0, a1 = self.get(*path, "a0"), self.get(*path, "a1")
        for key, value in (("a0", a0), ("a1", a1)):
            if value == 0:
                self.add((*path, key), "must not be 0, or the branch is constant; give a0 and a1 of the same sign")
        if a0 and a1 and (a0 > 0) != (a1 > 0):
            what = f"a0 = {shown(a0)} and a1 = {shown(a1)} make a falling branch"
            self.add(path, f"{what}; give both the same sign")
        elif a0 and a1 and not 1e-150 < abs(a0 * a1) < 1e150:
            self.add(path, f"a0 a1, the branch's steepest slope, is {shown(a0 * a1)}; keep to 1e-150 .. 1e150")

    def _effect(self, path: Path, effect: object) -> None:
        name = (*path, "name")
        given = self.at(name)
        if self.judged(path) or self.judged(name):
            return
        if not isinstance(effect, Mapping):
            self.add(path, f"must be an effect with its name, not {shown(effect)}; write {{name: ..}}")
        elif "name" not in effect:
            self.add(name, "is missing; add the name of an effect")
        elif not isinstance(given, str):
            self.add(name, f"must name an effect, not {shown(given)}; known effects: {', '.join(EFFECT_NAMES)}")
        elif given == effects.BEND:
            self.add(name, f"{effects.BEND} is not written here; make it a stage of model.memoryless")
        elif given in EFFECT_NAMES or given in self.user:
            shapes = self.user[given] if given in self.user else effects.shapes(given)
            first = self._seen.setdefault(given, path_text(path))
            if first != path_text(path) and not shapes[0].repeatable:
                self.add(name, f"{printable(given)} is given twice (first in {first}); keep one of them")
            self._shaped(path, effect, shapes)
        elif given.startswith("user:"):
            there = f", only {', '.join(map(printable, self.user))}" if self.user else ""
            self.add(name, f"{printable(given)} is not defined in any given file{there}; give its file (--effects)")
        else:
            names = (*EFFECT_NAMES, *self.user)
            advice = nearest(given, names) or f"known effects: {', '.join(names)}"
            self.add(name, f"unknown effect {printable(given)}; {advice}")

    def _shaped(self, path: Path, effect: Mapping[str, object], shapes: Shapes) -> None:
        """Check an effect with a known name: its shape, its own checks, and whether another also moves the plays."""
        chosen, selector = shapes[0], shapes[0].selector
        if selector in effect and selector in chosen.model_fields:
            if self.judged((*path, selector)):
                return
            known = {each: shape for shape in shapes for each in get_args(shape.model_fields[selector].annotation)}
            given = effect[selector]
            if not isinstance(given, str) or given not in known:
                self.add((*path, selector), _choice(given, tuple(known)))
                return
            chosen = known[given]
        self._classes[path] = chosen
        made: Effect | None = None
        before = len(self.problems)
        try:
            made = chosen.model_validate(effect)
        except ValidationError as error:
            self._found(error, lambda location: (*path, *location))
        if made is None or len(self.problems) > before or not self.sound(path):
            return
        if chosen.moves_plays():
            first = self._mover = self._mover or (made.name, path_text(path))
            if first != (made.name, path_text(path)):
                said = f"sets how the plays move, and so does {printable(first[0])} (in {first[1]}); keep one of them"
                self.add((*path, "name"), f"{printable(made.name)} {said}")
        for keys, message in made.problems(self._thresholds()):
            self.add((*path, *keys), message)
        self.effects.append(made)

    def _thresholds(self) -> tuple[float, ...] | None:
        """The model's thresholds, or None if they are not sound."""
        if self.discretisation is not None:
            return tuple(self.discretisation.thresholds)
        found = self.get("model", "pi", "thresholds")
        return tuple(found) if found else None


_TWO_NUMBERS = "must be two numbers; write [lowest, highest]"
_TWO_NAMES = "must be two names; write [asymmetry, sensor_nonlinearity]"
_NO_VALUE = "has no value; write one, or remove it"


_KINDS = "write a mapping with kind: dead_zone or kind: tanh"


def _last_key(path: Path) -> str:
    return next((part for part in reversed(path) if isinstance(part, str)), "")


def _entries(count: int) -> str:
    return "1 value" if count == 1 else f"{count} values"


def _choice(value: object, known: Sequence[object]) -> str:
    """Message for an unknown value."""
    listed = ", ".join(str(choice) for choice in known[:-1]) + (" or " if len(known) > 1 else "") + str(known[-1])
    words = [choice for choice in known if isinstance(choice, str)]
    near = nearest(value, words) if isinstance(value, str) and words else ""
    return f"must be {listed}, not {shown(value)}; {near or 'choose one of them'}"


_TYPES = (
    ("float_", "must be a number", "write it like 0.45"),
    ("int_", "must be a whole number", "write it like 12"),
    ("bool_", "must be true or false", "write one of them, without quotes"),
    ("string_type", "must be text", "put it in quotes"),
    ("tuple_type", "must be a list", "write [ ] around the values"),
    (("model_", "dict_type"), "must be a mapping", "write `key: value` pairs in it"),
)
"""Prefixes of pydantic's findings about a wrong type, with the message and advice to give instead."""

_BOUNDS = {
    "greater_than": ("gt", "must be above"),
    "greater_than_equal": ("ge", "must be at least"),
    "less_than": ("lt", "must be below"),
    "less_than_equal": ("le", "must be at most"),
}
"""Pydantic's findings about a number out of bounds: the key of the bound in its context, and the words to use."""


def _reworded(kind: str, key: str, value: Any, context: Mapping[str, Any], said: str) -> str:
    """A pydantic finding in our own words."""
    wrong, advice = next((said for start, *said in _TYPES if kind.startswith(start)), ("", ""))
    if key == "initial_state" and isinstance(value, Mapping | str):
        wrong, advice = "must be a number or a list of numbers", "write it like 0.0"
    if kind.startswith("union_tag"):
        wrong, advice = "must be a stage", _KINDS
    if key == "memoryless" and kind == "tuple_type":
        wrong, advice = "must be a stage or a list of stages", _KINDS
    if kind == "finite_number" or (kind == "float_type" and type(value) is int):
        return f"must be a finite number, not {shown(value)}; write one of at most {MAX_NUMBER:g} in magnitude"
    if key in ("input_range", "range") and kind in ("too_long", "tuple_type"):
        return _TWO_NUMBERS
    if wrong:
        return f"{wrong}, not {shown(value)}; {advice}"
    if kind == "literal_error" and key == "hystgen":
        return f"must be 1, not {shown(value)}; this version reads format 1 only"
    if kind == "literal_error" and not key:  # in a list
        return _choice(value, re.findall(r"'([^']*)'", context["expected"]))
    if kind == "literal_error":
        parts = (schema.EmitDefaults, schema.Compensation, schema.Converter)
        fields = {name: field for part in parts for name, field in part.model_fields.items()}
        return _choice(value, get_args(fields[key].annotation) if key != "kind" else schema.STAGE_KINDS)
    if kind in _BOUNDS:
        limit, what = _BOUNDS[kind]
        return f"{what} {context[limit]:g}, not {shown(value)}; correct the number"
    if kind == "too_short":
        return f"has {_entries(len(value))}, at least {context.get('min_length')} needed; add to the list"
    if kind == "too_long":
        return f"has {_entries(len(value))}, more than {context.get('max_length')}; shorten the list"
    if kind == "string_too_long":
        return f"has {len(value)} characters, more than {context.get('max_length')}; shorten it"
    return f"{said[:1].lower()}{said[1:]}; correct the value"
