"""Removes code without effect from the C of a model.

The run time is written for every model: it calls a hook where some model has a slew limit, a preview or a front. In a
model without them the hook returns its argument, which leaves parameters that nothing uses, conditions that cannot hold
and fields that nothing reads. All of these are removed, so that a reviewer reads only what the model does. No operation
on numbers changes.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_HEAD = re.compile(r"(?P<before>(?:[\w*]+\s+\**)+?)(?P<name>hystgen_\w+)\((?P<parameters>[^(){};]*)\)\s*\{\n")
_OWN = ("static ", "HYSTGEN_APART_IN_FLOAT ", "HYSTGEN_APART_IN_FIXED ", "HYSTGEN_APART_BUT_IN_FLOAT_LOOP ",
        "HYSTGEN_APART_IN_FLOAT_CORNERS ", "HYSTGEN_APART_IN_FIXED_CHAIN ", "HYSTGEN_APART_IN_CHAIN ",
        "HYSTGEN_APART_IN_FIXED_BLOCK ", "HYSTGEN_APART ")
"""First words of functions that only the model itself calls."""
_DELIMITED = (re.compile(r"(?:[(,?:]|(?<![=!<>])=|\breturn)\s*$"), re.compile(r"\s*[),;:]"))
"""Text before and after a whole argument, initializer or answer."""
_MARK = re.compile(r"^ *\(void\)(\w+);(?: */\*[^\n]*?\*/)?\n", re.MULTILINE)
"""A statement that marks a parameter as unused."""


@dataclass(frozen=True)
class Function:
    """A function: the text before its name, its parameters as declared, and its body."""

    above: str
    before: str
    name: str
    parameters: tuple[str, ...]
    body: str

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its parameters."""
        return tuple(re.findall(r"\w+", each)[-1] for each in self.parameters if each != "void")

    @property
    def types(self) -> tuple[str, ...]:
        """The types of its parameters."""
        return tuple(each[: each.rindex(name)].strip() for each, name in zip(self.parameters, self.names, strict=False))

    @property
    def answer(self) -> str:
        """The type that it returns."""
        return re.sub(r"\b(static|inline|HYSTGEN_\w+)\b", "", self.before).strip()

    @property
    def own(self) -> bool:
        """Whether only the model itself calls it."""
        return self.before.startswith(_OWN)

    @property
    def operator(self) -> str:
        """The operator whose instance `self` is, or empty."""
        found = re.search(r"hystgen_(forward|inverse)_t \*self\b", ", ".join(self.parameters))
        return found[1] if found else ""

    @property
    def statements(self) -> str:
        """The body on one line, without marks of unused parameters."""
        return " ".join(_COMMENT.sub("", _MARK.sub("", self.body)).split())

    @property
    def code(self) -> str:
        """Its parameters and its body."""
        return f"{', '.join(self.parameters)}\n{self.body}"

    def text(self) -> str:
        """Its C."""
        return f"{self.above}{self.before}{self.name}({', '.join(self.parameters)}) {{\n{self.body}}}\n"


def parsed(text: str) -> Function | None:
    """The function in a piece, or None if the piece is something else."""
    start = _COMMENT.match(text)
    above = text[: start.end() + 1] if start else ""
    found = _HEAD.match(text[len(above) :])
    if not found:
        return None
    parameters = " ".join(found["parameters"].split())
    body = text[len(above) + found.end() : text.rindex("}")]
    return Function(above, re.sub(r"\s+", " ", found["before"]), found["name"], tuple(parameters.split(", ")), body)


Member: TypeAlias = tuple[str, str]
"""A structure's name without prefix, and one of its members; the first is empty if the structure is not known."""

_DECLARED = re.compile(r"\bhystgen_(\w+)\s+(?:\*\s*(?:const\s+)?)?(\w+)")
_FIRST = re.compile(r"(?<![\w.>])[A-Za-z_]\w*(?=\[|->|\.)")
_STEP = re.compile(r"(?:->|\.)(\w+)|\[(?:[^\[\]]|\[[^\[\]]*\])*\]")
_PATH = r"\w+(?:(?:->|\.)\w+|\[[^\]]*\])*(?:->|\.)\w+(?:\[[^\]]*\])?"
_STORE = re.compile(rf"^ *(?P<path>{_PATH}) [-+*|&^]?= (?P<value>[^;]*);(?: */\*[^\n]*?\*/)?\n", re.MULTILINE)
PLAIN = re.compile(r"[\w.>[\]-]+").fullmatch
"""Tells whether a value is a number, a name or a member."""


class Store(NamedTuple):
    """A statement that only sets a member; `reads`: the members in its value."""

    text: str
    target: Member
    value: str
    reads: frozenset[Member]


class Members:
    """The members of structures; `types`: the type of each member, by structures' names without prefix; `whole`:
    structures from which nothing is left out; `objects`: structures of objects that functions name."""

    def __init__(
        self, types: Mapping[str, Mapping[str, str]], whole: Collection[str], objects: Mapping[str, str]
    ) -> None:
        self.types, self.whole, self._objects = types, whole, objects
        self._found: dict[str, tuple[frozenset[Member], list[Store]]] = {}

    def _paths(self, code: str, known: Mapping[str, str]) -> Iterator[list[Member]]:
        """The members along each expression that leads to one."""
        for found in _FIRST.finditer(code):
            kind, at, path = known.get(found[0], ""), found.end(), list[Member]()
            while step := _STEP.match(code, at):
                at = step.end()
                if name := step[1]:
                    path.append((kind, name))
                    kind = self.types.get(kind, {}).get(name, "").replace("const ", "").rstrip(" (*")
                    kind = kind.removeprefix("hystgen_")
            yield path

    def _uses(self, code: str) -> tuple[frozenset[Member], list[Store]]:
        """The members in a function's code outside stores, and its stores."""
        if code not in self._found:
            known = {**self._objects, **{name: kind for kind, name in _DECLARED.findall(code)}}
            stores, rest = [], code
            for found in _STORE.finditer(code):
                path, *beside = self._paths(found["path"], known)
                kind, name = path[-1]
                if "*" in self.types.get(kind, {}).get(name, "") and found["path"].endswith("]"):
                    continue  # to what the member points to
                reads = {each for other in (path[:-1], *beside, *self._paths(found["value"], known)) for each in other}
                stores.append(Store(found[0], path[-1], found["value"], frozenset(reads)))
                rest = rest.replace(found[0], "", 1)
            self._found[code] = frozenset(each for path in self._paths(rest, known) for each in path), stores
        return self._found[code]

    def stores(self, code: str) -> list[Store]:
        """The stores of a function."""
        return self._uses(code)[1]

    def read(self, codes: Iterable[str], looks: Callable[[str], object]) -> set[Member]:
        """The members whose values functions use, other than to store members that nothing reads; `looks`: whether a
        value may be left out."""
        found: set[Member] = set()
        stores = list[Store]()
        for code in codes:
            rest, stored = self._uses(code)
            found |= rest
            stores += stored
        found |= {each for store in stores if not looks(store.value) for each in (store.target, *store.reads)}
        while more := {each for store in stores if self.used(store.target, found) for each in store.reads} - found:
            found |= more
        return found

    def named(self, codes: Iterable[str]) -> set[Member]:
        """The members that functions name, whether they read them or not."""
        found = set[Member]()
        for code in codes:
            rest, stored = self._uses(code)
            found |= rest.union(*({each.target} | each.reads for each in stored))
        return found

    def used(self, member: Member, among: Collection[Member]) -> bool:
        """Whether a member is among these, or may be, or stays anyhow."""
        kind, name = member
        return kind not in self.types or kind in self.whole or member in among or ("", name) in among

    def without_stores(self, text: str, read: Collection[Member]) -> str:
        """A function's text without stores of plain values to members that are not read."""
        for store in self.stores(text):
            if PLAIN(store.value) and not self.used(store.target, read):
                text = text.replace(store.text, "", 1)
        return text


def folded(
    functions: Iterable[Function], kernels: Iterable[Function],
    wanted: Callable[[dict[str, Function]], Collection[str]], apart: Sequence[str], members: Members,
    meaning: Callable[[str], str] = str,
) -> dict[str, Function]:
    """The functions of a model without code that does nothing; `wanted`: names of those still called; other arguments
    as for `_Folding`."""
    comments: list[str] = []

    def mask(found: re.Match[str]) -> str:
        comments.append(found[0])
        return f"/*{len(comments) - 1}*/"

    masked = [
        replace(each, above=_COMMENT.sub(mask, each.above), body=_COMMENT.sub(mask, each.body)) for each in functions
    ]
    folding = _Folding(masked, list(kernels), comments, apart, members, meaning)
    while folding.once():
        kept = wanted(folding.functions)
        folding.functions = {name: each for name, each in folding.functions.items() if name in kept}

    def unmask(text: str) -> str:
        return re.sub(r"/\*(\d+)\*/", lambda found: comments[int(found[1])], text)

    return {
        name: replace(each, above=unmask(each.above), body=unmask(each.body))
        for name, each in folding.functions.items()
    }


class _Folding:
    """The functions of a model's operators. `kernels`: other functions that they call, which stay unchanged;
    `comments`: texts of the comments, for which numbers stand; `apart`: first words of functions that are not inlined
    here, to save stack; `members`: of structures that no kernel uses; `meaning`: of a type name, since several can
    denote the same type here."""

    def __init__(
        self, functions: Sequence[Function], kernels: Sequence[Function], comments: list[str],
        apart: Sequence[str], members: Members, meaning: Callable[[str], str],
    ) -> None:
        self.functions = {each.name: each for each in functions}
        self._known = {each.name: each for each in kernels}
        self._comments, self._apart, self._members, self._meaning = comments, tuple(apart), members, meaning

    def once(self) -> bool:
        """Do one round. Returns whether anything changed."""
        before = dict(self.functions)
        self._unused_parameters()
        # the shortest first: a call can go through a function that returns its argument, a sum perhaps not
        for name in sorted(self.functions, key=lambda each: len(self.functions[each].statements)):
            self._fold(self.functions[name])
        self._decided()
        self._unread_members()
        if self.functions == before:
            self._splice()
        return self.functions != before

    def _splice(self) -> None:
        """Put the statements of functions with one call in its place, once nothing else is left to do."""
        for name, function in list(self.functions.items()):
            if function.own and not function.before.startswith(self._apart) and len(list(self._given(name))) == 1:
                self._calls(name, functools.partial(self._spliced, self.functions[name]))

    def _change(self, name: str, body: str) -> None:
        self.functions[name] = replace(self.functions[name], body=body)

    def _naming(self, name: str) -> list[tuple[str, Function]]:
        """The functions in which a function's name, or a longer one that ends like it, stands before a parenthesis.
        Finding this text takes a tenth of the time of finding a call."""
        call = f"{name}("
        return [each for each in self.functions.items() if call in each[1].body]

    def _calls(self, name: str, changed: Callable[[Function, int, int, list[str]], str | None]) -> None:
        """Change every call of a function; `changed` takes the caller, the call's start and end in its body, and the
        arguments, and returns the new body."""
        call = re.compile(rf"\b{name}\(")
        for caller, function in self._naming(name):
            body, at = function.body, 0
            while found := call.search(body, at):
                end, arguments = _arguments(body, found.end())
                new = changed(replace(function, body=body), found.start(), end, arguments)
                at = found.end()
                if new is not None:
                    body, at = new, found.start()
            if body != function.body:
                self._change(caller, body)

    def _looks(self, expression: str) -> bool:
        """Whether an expression only reads, calling nothing that could change its arguments."""
        called = [self.functions.get(each) or self._known.get(each) for each in re.findall(r"(\w+)\(", expression)]
        given = [kind for each in called if each for kind in each.parameters]
        return None not in called and all("*" not in kind or kind.startswith("const ") for kind in given)

    def _unused_parameters(self) -> None:
        for name in list(self.functions):
            function = self.functions[name]
            if function.parameters == ("void",):
                continue
            used = _MARK.sub("", function.body)
            kept = [bool(re.search(rf"(?<![.>])\b{each}\b", used)) for each in function.names]
            for place, keep in enumerate(kept):
                kept[place] = keep or not all(self._looks(arguments[place]) for arguments in self._given(name))
            if not function.own or all(kept):
                continue
            gone = [each for each, keep in zip(function.names, kept, strict=True) if not keep]
            parameters = _where(function.parameters, kept) or ("void",)
            self.functions[name] = replace(function, parameters=parameters, body=_unmarked(function.body, gone))

            def without(
                caller: Function, start: int, end: int, arguments: list[str], name: str = name,
                kept: Sequence[bool] = kept,
            ) -> str | None:
                if len(arguments) != len(kept):  # already changed
                    return None
                return f"{caller.body[:start]}{name}({', '.join(_where(arguments, kept))}){caller.body[end:]}"

            self._calls(name, without)

    def _given(self, name: str) -> Iterator[list[str]]:
        """The arguments of every call of a function."""
        for _, function in self._naming(name):
            for found in re.finditer(rf"\b{name}\(", function.body):
                yield _arguments(function.body, found.end())[1]

    def _fold(self, function: Function) -> None:
        """Replace the calls of a function with its body, if that is empty or a single simple statement."""
        does = function.statements
        if function.own and does == "":
            self._calls(function.name, functools.partial(self._spliced, function))
            return
        answered = does.removeprefix("return ").removesuffix(";")
        apart = function.before.startswith(self._apart) and answered not in function.names  # an argument takes no stack
        if not function.own or apart:
            return
        places = sum(1 for _ in self._given(function.name))
        if ";" not in answered and does != answered and (places == 1 or _forwards(answered)):
            self._calls(function.name, functools.partial(self._put, function, answered))

    def _put(
        self, function: Function, expression: str, caller: Function, start: int, stop: int, arguments: list[str]
    ) -> str | None:
        """The caller's body with a function's only expression in place of a call, if no conversion is lost and nothing
        is computed twice or in another order."""
        body = caller.body
        ordered = _forwards(expression) or all(re.fullmatch(r"&[\w>.-]+|\w+", each) for each in arguments)
        if not ordered and not (self._looks(expression) and all(map(self._looks, arguments))):
            return None
        wanted, own = self._wanted(caller, start, stop), self._kind(function, expression) or function.answer
        sums = not all(map(_single, arguments if expression in function.names else [expression]))
        if wanted and sums and not self._same(wanted, own):
            return None  # a sum, unlike a call, is not to be widened (MISRA C:2012, 10.6)
        if not self._same(wanted, function.answer) and not self._answers(function, expression):
            return None
        for name, kind, argument in zip(function.names, function.types, arguments, strict=True):
            uses = list(re.finditer(rf"(?<![.>\w]){name}\b", expression))
            if not _PLAIN.fullmatch(argument) and len(uses) > 1:
                return None
            if "*" not in kind and expression != name and not self._same(self._kind(caller, argument), kind):
                types = [self._taken(expression, each.start(), each.end()) for each in uses]
                if not all(each and self._same(each, kind) for each in types):
                    return None
        given = dict(zip(function.names, arguments, strict=True))
        if any(argument.startswith("&") and f"{name}[" in expression for name, argument in given.items()):
            return None
        put = _substituted(expression, given)
        if (found := re.fullmatch(r"\((\w+)\)(\w+)", put)) and self._same(self._kind(caller, found[2]), found[1]):
            put = found[2]
        if body[:start].endswith("(!") and body[stop] == ")" and put.count(" == ") == 1 and _LOOSER.search(put) is None:
            start, put = start - 1, put.replace(" == ", " != ")
        whole = _single(put) or _delimited(body, start, stop)
        return body[:start] + (put if whole else f"({put})") + body[stop:]

    def _answers(self, function: Function, expression: str) -> bool:
        """Whether an expression surely has the type that a function returns."""
        if found := re.match(r"\((\w+)\)(?=[\w(])", expression):
            return _single(expression[found.end() :]) and self._same(found[1], function.answer)
        compared = function.answer == "bool" and re.search(r" (?:[=!<>]=|[<>]) ", expression)
        stored = _PLAIN.fullmatch(expression) and expression not in function.names
        same = _single(expression) and self._same(self._kind(function, expression), function.answer)
        return bool(compared or stored) or same

    def _wanted(self, caller: Function, start: int, stop: int) -> str:
        """The type of the constant, answer or parameter that a call's result becomes, or empty."""
        before = caller.body[caller.body.rfind(";", 0, start) + 1 : start]
        found = re.search(r"(?:const (\w+) \w+ =|\breturn)\s+(?:[^;{}?]*\?[^;{}:]*(?::\s)?\s*)?$", before)
        if found and re.match(r"\s*[;:]", caller.body[stop:]):
            return found[1] or caller.answer
        return self._taken(caller.body, start, stop)

    def _kind(self, caller: Function, argument: str) -> str:
        """The type of an argument as far as it is known, or empty."""
        if found := re.match(r"(\w+)\(", argument):
            other = self.functions.get(found[1]) or self._known.get(found[1])
            return other.answer if other and _single(argument) else ""
        kinds = _declared(caller)
        of = {kinds.get(each, "") for each in re.findall(r"[A-Za-z]\w*", argument)}
        sums = re.fullmatch(r"[\w +*-]+", argument) is not None and not any(self._same(each, "int16_t") for each in of)
        return of.pop() if len(of) == 1 and (sums or argument in of) else kinds.get(argument, "")

    def _taken(self, text: str, start: int, end: int) -> str:
        """The type of the parameter whose whole argument a part of a text is, or empty."""
        place = depth = 0
        for at in range(start - 1, -1, -1):
            depth += {")": 1, "(": -1}.get(text[at], 0)
            place += text[at] == "," and depth == 0
            if depth < 0:
                name = re.search(r"\w*$", text[:at])
                other = name and (self.functions.get(name[0]) or self._known.get(name[0]))
                known = other and place < len(other.types) and _delimited(text, start, end)
                return other.types[place] if other and known else ""
        return ""

    def _spliced(
        self, function: Function, caller: Function, start: int, stop: int, arguments: list[str]
    ) -> str | None:
        """The caller's body with the statements of a function in place of its only call, if that is a statement."""
        body = caller.body
        begin, end = body.rfind("\n", 0, start) + 1, body.find("\n", stop) + 1
        indent, before = re.match(r"( *)(.*)", body[begin:start]).groups()  # type: ignore[union-attr]
        if before not in ("", "(void)", "return ") or body[stop:end].strip() != ";":
            return None
        answers = before == "return " and self._same(function.answer, caller.answer)
        if not answers and (before == "return " or re.search(r"\breturn\b", function.body)):
            return None
        words = set(re.findall(r"\w+", body)) | set(caller.names)
        inside, declared = _unmarked(function.body, function.names), ""
        if words & {each[1] for each in _LOCAL.finditer(inside)}:
            return None
        given: dict[str, str] = {}
        for name, kind, argument in zip(function.names, function.types, arguments, strict=True):
            set_here = re.search(rf"(?<![.>\w*]){name} [-+*|&^]?= ", inside)
            same = re.fullmatch(r"\w+", argument) and self._same(_declared(caller).get(argument, ""), kind)
            if not re.search(rf"\b{name}\b", inside) and self._looks(argument):
                continue
            entry = argument.startswith("&") and f"{name}[" in inside
            if not set_here and ((same or ("*" in kind and _PLAIN.fullmatch(argument))) and not entry):
                given[name] = argument
            elif name in words or declared:
                return None
            else:
                declared = f"    {'' if set_here or '*' in kind else 'const '}{kind} {name} = {argument};\n"
        inside = _substituted(inside, given)
        said = " ".join(self._comments[int(found[0])].split()) if (found := re.search(r"\d+", function.above)) else ""
        kept = all(name == argument or name not in re.findall(r"\w+", said) for name, argument in given.items())
        whole = declared + inside
        if inside and said and kept:
            self._comments.append(said)
            whole = f"    /*{len(self._comments) - 1}*/\n{whole}"
        return body[:begin] + re.sub(r"^(?=.)", indent[4:], whole, flags=re.MULTILINE) + body[end:]

    def _same(self, one: str, other: str) -> bool:
        """Whether two names denote the same type."""
        def plain(kind: str) -> str:
            kind = " ".join(re.sub(r"\b(const|inline)\b", "", kind).split()).replace(" *", "*")
            return re.sub(r"\w+", lambda name: self._meaning(name[0]), kind)

        return plain(one) == plain(other)

    def _decided(self) -> None:
        """Resolve conditions that always or never hold, and copies of constants."""
        for name, function in list(self.functions.items()):
            body = function.body
            if function.own:
                body = _unmarked(body, set(_MARK.findall(body)) - set(function.names))
            body = self._copies(function, body)
            answered = _ANSWERED.search(body)
            if answered and self._same(answered[1], function.answer):
                body = f"{body[: answered.start()]}    return {answered[3]};\n"
            for found in _FLAG.finditer(body):
                uses = len(re.findall(rf"(?<![.>\w]){found[1]}\b", body)) - 1
                if uses == body.count(f"if ({found[1]}) {{"):  # never set
                    body = body.replace(found[0], "").replace(f"if ({found[1]}) {{", "if (false) {")
            for local in _UNUSED.finditer(body):
                sets = re.compile(rf"^ *{local[1]} \|?= ([^;]*);\n", re.MULTILINE)
                named = re.findall(rf"(?<![.>\w]){local[1]}\b", sets.sub("", body))
                if len(named) == 1 and all(map(self._looks, [local[2] or "", *sets.findall(body)])):
                    body = sets.sub("", body).replace(local[0], "")
            body = re.sub(r"\b(\w+) < \1 \|\| \1 > \1", "false", body)
            body = body.replace("!true", "false").replace("!false", "true")
            body = _without_branches(body)
            if body != function.body:
                self._change(name, body)

    def _copies(self, function: Function, body: str) -> str:
        """The body without constants that only repeat another constant or a parameter."""
        types = _declared(replace(function, body=body))
        for found in re.finditer(r"^ *const (\w+) (\w+) =\s+(\w+);\n", body, re.MULTILINE):
            kind, copy, of = found.groups()
            declared = re.sub(rf"^ *const \w+ {of} =\s", "", body, flags=re.MULTILINE)
            if of not in types or re.search(rf"(?<![.>\w]){of} [-+*|&^]?= |&{of}\b", declared):
                continue
            rest = body.replace(found[0], "", 1)
            uses = re.finditer(rf"(?<![.>\w]){copy}\b", rest)
            whole = all(_delimited(rest, each.start(), each.end()) for each in uses)
            if self._same(kind, types[of]) or whole:
                return re.sub(rf"(?<![.>\w]){copy}\b", of, rest)
        return body

    def _unread_members(self) -> None:
        """Remove members that are never read, and flags of an instance that are only ever set to false."""
        read = self._members.read([each.code for each in self.functions.values()], self._looks)
        values: dict[Member, set[str]] = {}
        for function in self.functions.values():
            for store in self._members.stores(function.code):
                values.setdefault(store.target, set()).add(store.value)
        mine = [each for each in self.functions.values() if each.operator]
        addressed, asked = (
            {(f"{each.operator}_t", field) for each in mine for field in re.findall(form, each.body)}
            for form in (r"&self->(\w+)", _ASKED)
        )
        false = {each for each in asked if values.get(each, set()) <= {"false"}} - addressed
        for name, function in list(self.functions.items()):
            body = function.body
            for store in self._members.stores(function.code):
                idle = store.target in false or not self._members.used(store.target, read)
                if idle and self._looks(store.value):
                    body = body.replace(store.text, "", 1)
            for field in (field for kind, field in false if kind == f"{function.operator}_t"):
                body = re.sub(rf"^ *[\w>-]+ \|= self->{field} \? \w+ : 0u;\n", "", body, flags=re.MULTILINE)
                body = body.replace(f"if (self->{field})", "if (false)")
            if body != function.body:
                self._change(name, body)


def _declared(function: Function) -> dict[str, str]:
    """The types of a function's parameters and of local variables with a first value."""
    local = re.finditer(r"^ *(?:const )?(\w+) (\w+) =", function.body, re.MULTILINE)
    return dict(zip(function.names, function.types, strict=True)) | {each[2]: each[1] for each in local}


_ASKED = r"(?:\bif \(|\|= )self->(\w+)(?:\)| \? \w+ : 0u;)"
"""A field that is a condition by itself."""


def _unmarked(body: str, gone: Collection[str]) -> str:
    """The body without marks for these parameters."""
    return _MARK.sub(lambda found: "" if found[1] in gone else found[0], body)


def _where(values: Sequence[str], kept: Sequence[bool]) -> tuple[str, ...]:
    return tuple(value for value, keep in zip(values, kept, strict=False) if keep)


def _arguments(text: str, start: int) -> tuple[int, list[str]]:
    """The end of a call whose arguments begin at `start`, and the arguments."""
    depth, found, begin = 0, [], start
    for at in range(start, len(text)):
        character = text[at]
        if character in ",)" and depth == 0:
            found.append(" ".join(text[begin:at].split()))
            begin = at + 1
            if character == ")":
                return at + 1, [each for each in found if each]
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(character, 0)
    raise AssertionError(f"a call that does not end: {text[start:]}")


def _delimited(body: str, start: int, end: int) -> bool:
    """Whether part of a body is a whole argument, initializer, answer or choice."""
    before, behind = _DELIMITED
    return bool(before.search(body[:start])) and bool(behind.match(body[end:]))


def _single(expression: str) -> bool:
    """Whether an expression is a name, a member, an entry or a call, which needs no parentheses anywhere."""
    if re.fullmatch(r"[\w.>\[\]-]+", expression):
        return True
    called = re.match(r"\w+\(", expression)
    return called is not None and _arguments(expression, called.end())[0] == len(expression)


def _substituted(text: str, given: Mapping[str, str]) -> str:
    """A text with arguments in place of parameters."""

    def instead(found: re.Match[str]) -> str:
        content, name, member = found.groups()
        if (argument := given.get(name)) is None:
            return found[0]
        if argument.startswith("&") and (content or member):
            return argument[1:] + ("." if member else "")
        whole = _single(argument) or found[0] == text or _delimited(text, found.start(), found.end())
        return (content or "") + (argument if whole else f"({argument})") + (member or "")

    return re.sub(r"(\*)?(?<![.>\w])([A-Za-z]\w*)\b(->)?", instead, text)


def _forwards(expression: str) -> bool:
    """Whether an expression is plain, or a call of another function with plain arguments; both may be converted."""
    found = re.match(r"(?:\(\w+\))?\w+\(", expression)
    if not found:
        return _PLAIN.fullmatch(re.sub(r"^\(\w+\)", "", expression)) is not None
    end, arguments = _arguments(expression, found.end())
    return end == len(expression) and all(_PLAIN.fullmatch(each) for each in arguments)


_PLAIN = re.compile(r"&?\w+(?:(?:->|\.)\w+)*")
"""An expression that can be written twice: a name, a number, a member, or its address."""
_LOOSER = re.compile(r" (?:&&|\|\||\?|[|^&]) ")
"""Operators that bind less tightly than a comparison."""
_LOCAL = re.compile(r"^ *(?:(?:const|static|volatile|unsigned) )*\w+ \**(\w+)(?:\[[^\]]*\])?(?: =\s|;)", re.MULTILINE)
"""The declaration of a local variable."""


_FLAG = re.compile(r"^ *bool (\w+)(?: = false)?;(?: */\*[^\n]*?\*/)?\n", re.MULTILINE)
"""A local flag that is initially false or unset."""
_UNUSED = re.compile(
    r"^ *(?!return )(?:const )?(?:unsigned )?\w+ \*?(\w+)(?: =\s([^;]*))?;(?: */\*[^\n]*?\*/)?\n", re.MULTILINE
)
"""A local variable with its first value, if it has one."""
_ANSWERED = re.compile(r"^    const (\w+) (\w+) =\s+([^;{]*);\n    return \2;\n\Z", re.MULTILINE)
"""A constant that is then returned; the initializer of a struct does not count, since it is not an expression."""
_IF = re.compile(r"^( *)(\} else )?if \(([^{};]*)\) \{\n", re.MULTILINE)


def _without_branches(body: str) -> str:
    """The body without branches that never run or are empty, and with the contents of those that always run."""
    for found in _IF.finditer(body):
        indent, chained, condition = found.groups()
        close = body.index(f"\n{indent}}}", found.end() - 1) + 1
        inside, rest = body[found.end() : close], body[close + len(indent) :]
        alone, otherwise = rest.startswith("}\n"), re.match(r"\} else (?=if )", rest)
        before, behind = body[: found.start()], rest[2:]
        if condition == "false" and alone:
            return _without_branches(before + (f"{indent}}}\n" if chained else "") + behind)
        if condition == "false" and otherwise:
            return _without_branches(before + indent + (chained or "") + rest[otherwise.end() :])
        if condition == "true" and alone and not chained:
            return _without_branches(before + re.sub("^    ", "", inside, flags=re.MULTILINE) + behind)
        if alone and not inside.strip() and re.fullmatch(_LOOKS, condition):
            return _without_branches(before + (f"{indent}}}\n" if chained else "") + behind)
        if alone and not inside.strip() and not chained and re.match(r"\w+\(", condition) and _single(condition):
            return _without_branches(f"{before}{indent}(void){condition};\n{behind}")
    return _choices(body)


_LOOKS = r"[^()]+|!?hystgen_finite\(\w+\)"
"""A condition that changes nothing."""


def _choices(body: str) -> str:
    """The body without choices between equal values."""
    return re.sub(r"[\w>-]+ \? ([^?:;]+?)\s+: \1(?=[;,)])", r"\1", body)
