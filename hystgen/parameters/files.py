"""Parameter files: read and check (every problem at once), write, and identify by a hash.

`load_parameters`, `parse_parameters` and `make_parameters` are the ways to get checked `Parameters`; `dump_parameters`
can write anything they return, and reading it again gives the same value.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

from hystgen.basics.problems import ParameterError, Path, Problem, path_text
from hystgen.parameters.checks import check
from hystgen.parameters.schema import Compensation, Health, ModelParameters, PIParameters
from hystgen.parameters.schema import Parameters as Parameters
from hystgen.parameters.yaml import MAX_BYTES, read, resolve

if TYPE_CHECKING:
    from hystgen.effects import Effect

_WIDTH = 100


def load_parameters(path: str | os.PathLike[str], user_effects: Sequence[type[Effect]] = ()) -> Parameters:
    """The checked parameters in a YAML file (UTF-8, at most 1 MiB); `user_effects`: from `load_user_effects`.

    Raises ParameterError with every problem and its position, also if the file cannot be read.
    """
    file = os.fspath(path)
    return parse_parameters(_text(file), file, user_effects)


def parameter_data(path: str | os.PathLike[str]) -> Mapping[str, Any]:
    """The plain data of a parameter file, checked only as YAML, not for its values. Raises ParameterError."""
    file = os.fspath(path)
    document = read(_text(file).removeprefix("\ufeff"))
    if not document.complete:
        raise ParameterError(file, document.problems)
    data: Mapping[str, Any] = document.data
    return data


def located(path: str | os.PathLike[str], problems: Iterable[tuple[Path, str]]) -> ParameterError:
    """Problems found later in the values of a file that was already read, with their positions in it."""
    file = os.fspath(path)
    try:
        document = read(_text(file).removeprefix("\ufeff"))
    except ParameterError:  # the file has been removed since
        return ParameterError(file, [Problem(path_text(place), message) for place, message in problems])
    found = [Problem(path_text(at), message, *(document.position(at) if at else ())) for at, message in problems]
    return ParameterError(file, found)


def _text(file: str) -> str:
    """The text of a parameter file. Raises ParameterError."""
    try:
        with open(file, "rb") as stream:
            content = stream.read(MAX_BYTES + 1)
            size = os.fstat(stream.fileno()).st_size  # 0 for a pipe or device
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        wrong = Problem("", f"cannot be read ({reason}); give the path of a parameter file")
        raise ParameterError(file, [wrong]) from None
    if len(content) > MAX_BYTES:
        raise _too_large(size if size > MAX_BYTES else None, file)
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        before = content[: error.start].decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        message = f"byte 0x{content[error.start]:02X} is not UTF-8; save the file as UTF-8"
        raise ParameterError(file, [Problem("", message, line, column)]) from None


def parse_parameters(text: str, file: str = "<string>", user_effects: Sequence[type[Effect]] = ()) -> Parameters:
    """The checked parameters in a YAML text; `file` names it in messages. Raises ParameterError."""
    size = len(text.encode("utf-8", "surrogatepass"))
    if size > MAX_BYTES:
        raise _too_large(size, file)
    document = read(text.removeprefix("\ufeff"))
    if not document.complete:
        raise ParameterError(file, document.problems)
    parameters, problems = check(document.data, document, _by_name(user_effects))
    if parameters is None:
        raise ParameterError(file, document.problems + problems)
    return parameters


def make_parameters(
    data: Mapping[str, object], file: str = "<data>", user_effects: Sequence[type[Effect]] = ()
) -> Parameters:
    """The checked parameters from plain data in the form of the file (lists or tuples; None means left out).

    An entry of `effects` may also be an `Effect`. Raises ParameterError; its problems have no positions, and `file`
    names the data in messages.
    """
    parameters, problems = check(_plain(data), user=_by_name(user_effects))
    if parameters is None:
        raise ParameterError(file, problems)
    return parameters


def _by_name(user_effects: Sequence[type[Effect]]) -> dict[str, tuple[type[Effect], ...]]:
    """The user's effects by their names; several classes with one name are its shapes."""
    found: dict[str, tuple[type[Effect], ...]] = {}
    for effect in user_effects:
        name = effect.model_fields["name"].annotation.__args__[0]  # type: ignore[union-attr]
        found[name] = (*found.get(name, ()), effect)
    return found


def _too_large(size: int | None, file: str) -> ParameterError:
    has = f"more than {MAX_BYTES} bytes" if size is None else f"{size} bytes, more than {MAX_BYTES}"
    return ParameterError(file, [Problem("", f"the file has {has} (1 MiB); keep one model per file")])


def _plain(value: object) -> Any:
    """The data with lists as tuples, NumPy values as Python's, and keys without a value dropped."""
    if hasattr(value, "model_dump"):
        value = value.model_dump()
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items() if entry is not None}
    if hasattr(value, "tolist"):
        value = value.tolist()
    return tuple(_plain(entry) for entry in value) if isinstance(value, list | tuple) else value


def _data(parameters: Parameters) -> dict[str, Any]:
    """The parameters in the file's form and order, with every default filled in except those of `Effect.later`."""
    data = parameters.model_dump()
    pi = data["model"]["pi"]
    for key in ("thresholds", "weights") if pi["density"] else ("density",):
        del pi[key]
    for effect, entry in zip(parameters.model.effects, data["model"]["effects"], strict=True):
        for key in effect.later:
            if entry[key] == type(effect).model_fields[key].default:
                del entry[key]
    return data


def canonical_json(parameters: Parameters) -> str:
    """The canonical text of these parameters: JSON with sorted keys, defaults filled in, shortest round-trip numbers.

    A density appears as given, not as the plays made from it. `emit.output` is left out, since the C does not depend on
    its folder, and `recorded_at`, which changes nothing. Keys added later (`emit.optimize`, `emit.compensation`,
    `emit.converter`, `emit.health`, `emit.degauss`, `residual`, `not_separable` and some in effects) appear only if
    they differ from the default, so that files without them keep their hash.
    """
    data = _data(parameters)
    del data["emit"]["output"]
    if parameters.emit.optimize == "auto":
        del data["emit"]["optimize"]
    if parameters.emit.compensation == Compensation():
        del data["emit"]["compensation"]
    elif not parameters.emit.compensation.compensate:
        del data["emit"]["compensation"]["compensate"]
    if parameters.emit.converter is None:
        data["emit"].pop("converter", None)
    if parameters.emit.health == Health():
        del data["emit"]["health"]
    if parameters.residual is None:
        data.pop("residual", None)
    if parameters.emit.degauss is None:
        data["emit"].pop("degauss", None)
    if not parameters.not_separable:
        del data["not_separable"]
    del data["recorded_at"]
    return json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)


def parameters_sha256(parameters: Parameters) -> str:
    """SHA-256 of the canonical text, in hexadecimal."""
    return hashlib.sha256(canonical_json(parameters).encode("ascii")).hexdigest()


# Writing -------------------------------------------------------------------------------------------------


def dump_parameters(parameters: Parameters, comments: Mapping[str, str] | None = None, header: str = "") -> str:
    """A YAML text that reads back to exactly these parameters; defaults are left out.

    `comments` maps dotted paths of keys (`model.pi.weights`) to a comment that is set above the key, which is then
    written even at its default; `header` is set above everything. Both may span several lines. Raises ValueError for a
    comment on a key that is not in the file's block form.
    """
    notes = dict(comments or {})
    lines = _comment(header, "")
    lines += _block(_data(parameters), _defaults(), "", notes, "")
    if notes:
        raise ValueError(f"no such keys to comment: {', '.join(notes)}")
    return "\n".join(lines) + "\n"


@cache
def _defaults() -> dict[str, object]:
    """Keys, with the values at which they are left out."""
    pi = PIParameters(weights=(1.0,))
    data = Parameters(hystgen=1, name="x", input_range=(0.0, 1.0), model=ModelParameters(pi=pi)).model_dump()
    for key in ("hystgen", "name", "input_range"):
        del data[key]
    del data["model"]["pi"]["weights"]
    return data


_FLOW = ("units", "ascending", "descending", "table")


def _block(
    data: Mapping[str, Any], defaults: Mapping[str, Any], indent: str, notes: dict[str, str], above: str
) -> Iterator[str]:
    """Lines of a mapping in block form."""
    for key, value in data.items():
        path = f"{above}.{key}" if above else key
        wanted = any(note == path or note.startswith(path + ".") for note in notes)
        note = notes.pop(path, "")
        if value is None or (not wanted and key in defaults and value == defaults[key]):
            continue
        yield from _comment(note, indent)
        if key in ("memoryless", "effects") and value:
            yield f"{indent}{key}:"
            for part in value:
                if part.get("descending") == part.get("ascending", ()):
                    part = {name: entry for name, entry in part.items() if name != "descending"}
                lines = [line for name, entry in part.items() for line in _entry(name, entry, indent + "    ")]
                yield f"{indent}  - {lines[0].lstrip()}"
                yield from lines[1:]
        elif isinstance(value, dict) and key not in _FLOW:
            lines = list(_block(value, defaults.get(key) or {}, indent + "  ", notes, path))
            yield f"{indent}{key}:" if lines else f"{indent}{key}: {{}}"
            yield from lines
        else:
            yield from _entry(key, value, indent)


def _entry(key: str, value: object, indent: str) -> Iterator[str]:
    """Lines of one key with its value in flow form, wrapped between the numbers of a list."""
    flow = _flow(value)
    line = f"{indent}{key}:"
    for word in flow.split(" ") if isinstance(value, tuple) or key == "table" else [flow]:
        if len(line) + 1 + len(word) > _WIDTH and line.strip() != f"{key}:":
            yield line
            line = indent + "   "
        line += " " + word
    yield line


def _flow(value: object) -> str:
    """A value in flow form."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, tuple):
        return "[" + ", ".join(_flow(entry) for entry in value) + "]"
    if isinstance(value, float):
        return float.__repr__(value)
    return _quoted(value) if isinstance(value, str) else str(value)


def _quoted(text: str) -> str:
    """A text as a YAML scalar: plain if that is safe everywhere, otherwise in double quotes."""
    plain = re.fullmatch(r"[A-Za-z][A-Za-z0-9_/%^.]*(?:[ -][A-Za-z0-9_/%^.()]+)*", text) and resolve(text) == text
    return text if plain else json.dumps(text, ensure_ascii=False)


def _comment(text: str, indent: str) -> list[str]:
    """Comment lines; characters that YAML does not allow become `?`."""
    lines = ["".join(c if c.isprintable() else "?" for c in line.expandtabs()) for line in text.splitlines()]
    return [f"{indent}# {line}".rstrip() for line in lines]
