"""YAML 1.2 text to plain Python data, with the position of every key and value.

Only what a parameter file needs: one document of mappings with text keys, lists and plain scalars (core
schema). Aliases, anchors, merge keys, tags and duplicate keys are refused. The data is built from the parser's events
without recursion, and reading stops at the first event that exceeds a limit, so that no text of the permitted size can
exhaust time or memory.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, StreamMark
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)
from ruamel.yaml.reader import ReaderError

from hystgen.basics.problems import Path, Problem, path_text, printable

MAX_BYTES = 1 << 20
MAX_DEPTH = 16
MAX_VALUES = 100_000
"""Limits on a file: anything other than a parameter file is refused at once. A file with 4096 plays has 8200 values."""

_CONSTANTS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True), **dict.fromkeys(("false", "False", "FALSE"), False),
    **{f"{sign}.{word}": float(f"{sign}inf") for sign in ("", "+", "-") for word in ("inf", "Inf", "INF")},
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}
_INT = re.compile(r"[-+]?[0-9]+\Z")
_OCTAL = re.compile(r"0o[0-7]+\Z")
_HEX = re.compile(r"0x[0-9a-fA-F]+\Z")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?\Z")
_DIRECTIVE = re.compile(r"\ufeff?(?:[ \t]*(?:#[^\r\n]*)?(?:\r\n|\r|\n))*(?P<line>%[^\r\n]*)")
_LONGEST_INT = 400
"""[digits] A decimal integer with this many is beyond double precision, whatever the digits are."""

Position = tuple[int, int]


@dataclass
class Document:
    """The result of reading: the data (None if nothing is usable), its positions, and the problems.

    Lists arrive as tuples. `values` and `keys` map a path to the 1-based (line, column) of the value and of the key
    before it. `poisoned` holds the paths whose value was refused here and is None in `data`. `complete`: whether `data`
    is a mapping, read to the end of the file.
    """

    data: Any = None
    values: dict[Path, Position] = field(default_factory=dict)
    keys: dict[Path, Position] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    poisoned: set[Path] = field(default_factory=set)
    complete: bool = False

    def position(self, path: Path, at_key: bool = False) -> Position:
        """Position of the value (or key) at `path` or, if that is missing, of what should contain it."""
        places = self.keys if at_key else self.values
        held = next(path[:n] for n in range(len(path), -1, -1) if path[:n] in places or n == 0)
        return places.get(held) or self.values[held]

    def refuse(self, path: Path, position: Position, message: str) -> None:
        self.problems.append(Problem(path_text(path), message, *position))


class _LimitError(Exception):
    """Raised to leave the rest of the file unread."""


@dataclass
class _OpenNode:
    """A mapping or list still being read."""

    path: Path
    live: bool
    """False inside an entry that will be dropped and whose positions are therefore not recorded."""
    entries: dict[str, object] | list[object]
    is_key: bool = False
    key: str | Literal[False] | None = None
    """Key of the value that comes next; False if that is scanned for problems and then dropped."""


def resolve(text: str) -> str | int | float | bool | None:
    """Value of a plain scalar under the YAML 1.2 core schema."""
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if _OCTAL.match(text):
        return int(text[2:], 8)
    if _HEX.match(text):
        return int(text[2:], 16)
    if _INT.match(text) and len(text) <= _LONGEST_INT:
        return int(text)
    if _FLOAT.match(text):
        return float(text)
    return text


def read(text: str) -> Document:
    """Read one YAML document; problems are listed in the result's `problems`, and nothing is raised."""
    document = Document()
    directive = _DIRECTIVE.match(text)
    if directive and directive["line"].split() != ["%YAML", "1.2"]:
        position = _position(text, directive.start("line"))
        document.refuse((), position, "directives are not accepted; remove the line that starts with %")
        return document
    builder = _TreeBuilder(document)
    events = YAML(typ="safe", pure=True).parse(text)
    try:
        while (event := _next(events, text, builder)) is not None:
            builder.take(event, _start(event.start_mark))
    except _LimitError:
        pass
    data = document.data
    if data is None and not document.problems:
        document.refuse((), (1, 1), "the file is empty; write the parameters into it")
    elif data is not None and not isinstance(data, dict):
        document.refuse((), document.values[()], "the top level must be a mapping; start with `hystgen: 1`")
    document.complete = isinstance(data, dict)
    return document


def _next(events: Iterator[Event], text: str, builder: _TreeBuilder) -> Event | None:
    """The parser's next event, None at the end; a text that is not YAML is refused."""
    try:
        return next(events, None)
    except ReaderError as error:
        code = error.character if isinstance(error.character, int) else ord(error.character)
        position, message = _position(text, error.position), f"character U+{code:04X} is not allowed; remove it"
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        position = builder.position if mark is None else _start(mark)
        context = f" ({_clean(error.context)})" if error.context else ""
        message = f"not valid YAML: {_clean(error.problem or 'cannot be read')}{context}; correct the text there"
    except Exception:
        # The parser also raises errors of other kinds, such as OverflowError for the escape "\UFFFFFFFF".
        position, message = builder.position, "not valid YAML soon after this position; correct the text there"
    builder.document.refuse((), position, message)
    builder.document.data = None
    raise _LimitError


_WORDS = (
    ("'<stream end>'", "the end of the file"),
    ("'<document end>'", "the end mark '...'"),
    ("'<document start>'", "the start mark '---'"),
    ("unexpected end of stream", "the end of the file"),
    ("<block end>", "the end of it"),
    ("character '\\t'", "a tab"),
    ("the node content", "a value"),
    ("flow node", "value"),
    ("block node", "value"),
    ("a node", "a value"),
    ("flow sequence", "list in brackets"),
    ("flow mapping", "mapping in braces"),
    ("block collection", "list"),
    ("block mapping", "mapping"),
    ("quoted scalar", "quoted text"),
    ("simple key", "key"),
    ("the next token", "what comes next"),
    ("start any token", "start anything"),
)


def _clean(said: str) -> str:
    """The parser's message in our own words."""
    said = " ".join(said.split())
    for theirs, ours in _WORDS:
        said = said.replace(theirs, ours)
    return said if len(said) <= 120 else printable(said)


def _start(mark: StreamMark) -> Position:
    return mark.line + 1, mark.column + 1


def _position(text: str, index: int) -> Position:
    before = text[:index].replace("\r\n", "\n").replace("\r", "\n")
    return before.count("\n") + 1, len(before) - before.rfind("\n")


def _value(event: ScalarEvent) -> str | int | float | bool | None:
    """Value of a scalar: plain scalars are resolved, quoted and block scalars are text."""
    return resolve(event.value) if event.style is None else str(event.value)


class _TreeBuilder:
    def __init__(self, document: Document) -> None:
        self.document = document
        self.position: Position = (1, 1)
        self.levels: list[_OpenNode] = []
        self.count = 0
        self.documents = 0

    def take(self, event: Event, position: Position) -> None:
        """Take the parser's next event; raise _LimitError to leave the rest unread."""
        self.position = position
        if isinstance(event, DocumentStartEvent):
            self.documents += 1
            if self.documents > 1:
                self.document.refuse((), position, "a second document starts here; keep one model per file")
                raise _LimitError
        elif isinstance(event, MappingEndEvent | SequenceEndEvent):
            level = self.levels.pop()
            if not level.is_key:
                self._put(level.entries if isinstance(level.entries, dict) else tuple(level.entries), level.path)
        elif isinstance(event, AliasEvent | ScalarEvent | MappingStartEvent | SequenceStartEvent):
            self._node(event, position)

    def _node(self, event: Event, position: Position) -> None:
        document = self.document
        self.count += 1
        if self.count > MAX_VALUES:
            document.refuse((), position, f"more than {MAX_VALUES} keys and values; keep one model per file")
            raise _LimitError
        level = self.levels[-1] if self.levels else None
        live = level is None or (level.live and level.key is not False)
        is_key = level is not None and isinstance(level.entries, dict) and level.key is None
        path = self._path(level)
        accepted = self._plain(event, path, position)
        if live and not is_key:
            document.values[path] = position
            if not accepted:
                document.poisoned.add(path)
        if is_key:
            assert level is not None
            level.key = False
        if isinstance(event, MappingStartEvent | SequenceStartEvent):
            if is_key:
                document.refuse(path, position, "a key must be text, not a list or mapping; correct the key")
            if len(self.levels) == MAX_DEPTH:
                document.refuse((), position, f"nested more than {MAX_DEPTH} deep; remove the extra nesting")
                raise _LimitError
            entries: dict[str, object] | list[object] = {} if isinstance(event, MappingStartEvent) else []
            self.levels.append(_OpenNode(path, live and not is_key, entries, is_key))
        elif not is_key:
            self._put(_value(event) if accepted and isinstance(event, ScalarEvent) else None, path)
        elif isinstance(event, ScalarEvent):
            self._key(event, position, path)

    def _plain(self, event: Any, path: Path, position: Position) -> bool:
        """Refuse aliases, anchors and tags; returns False if the value itself is lost with them."""
        if isinstance(event, AliasEvent):
            self.document.refuse(path, position, "aliases (*) are not accepted; write the value itself")
            return False
        if event.anchor is not None:
            self.document.refuse(path, position, "anchors (&) are not accepted; remove the anchor")
        if event.tag is not None:
            self.document.refuse(path, position, "tags (!) are not accepted; remove the tag")
        return event.tag is None

    @staticmethod
    def _path(level: _OpenNode | None) -> Path:
        if level is None:
            return ()
        if isinstance(level.entries, list):
            return (*level.path, len(level.entries))
        return (*level.path, level.key) if isinstance(level.key, str) else level.path

    def _key(self, event: ScalarEvent, position: Position, path: Path) -> None:
        level = self.levels[-1]
        key = _value(event)
        if not isinstance(key, str):
            name = printable(event.value) or "nothing"
            self.document.refuse(path, position, f"a key must be text, not {name}; correct the key")
        elif key == "<<" and event.style is None:
            self.document.refuse(path, position, "merge keys (<<) are not accepted; write the keys out")
        elif key in level.entries:
            where = f" (first in line {self.document.keys[*path, key][0]})" if level.live else ""
            self.document.refuse((*path, key), position, f"this key is given twice{where}; keep one of them")
        else:
            level.key = key
            if level.live:
                self.document.keys[*path, key] = position

    def _put(self, value: object, path: Path) -> None:
        """Add a finished value to the open mapping or list, or to the document."""
        level = self.levels[-1] if self.levels else None
        if path in self.document.poisoned:
            value = None
        if level is None:
            self.document.data = value
        elif isinstance(level.entries, list):
            level.entries.append(value)
        else:
            if isinstance(level.key, str):
                level.entries[level.key] = value
            level.key = None
