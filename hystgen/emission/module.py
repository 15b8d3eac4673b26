"""Turns a model into the text of its C files: the compensator in an arithmetic, the module, its files."""

from __future__ import annotations

import dataclasses
import importlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

from hystgen.chain.static import StaticModel
from hystgen.emission import chain, cost, interface, runtime, selftest
from hystgen.emission.compensator import ConstantTable, EmittedModel, Form, Glue, Macro, Names, Numbers, Writer
from hystgen.emission.cost import Cost, Data
from hystgen.emission.folding import PLAIN, Members
from hystgen.emission.options import Options, seal
from hystgen.emission.runtime import template
from hystgen.emission.text import define, fit, operand
from hystgen.parameters.files import parameters_sha256
from hystgen.plays import slots

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import Compiled
    from hystgen.emission.block import UnitParameters
    from hystgen.emission.snapshot import InstanceState
    from hystgen.model import Model

WHAT = {"both": "forward and inverse operator", "forward": "forward operator", "inverse": "inverse operator"}


def compensator(model: Model, options: Options) -> EmittedModel:
    """The compensator of a model. Raises FormatError."""
    compiled = model.compiled(options.arithmetic, options.engine) if model.effects else None
    whole = runtime.FAMILIES[options.arithmetic]
    loop = options.engine == "loop"
    family = dataclasses.replace(whole, chain=compiled is not None, loop=compiled is None and loop)
    form: Form = importlib.import_module(f"hystgen.emission.{family.form}").FORM
    names = Names(model.name, f"hystgen_{family.bits}" if options.layout == "shared-runtime" else model.name)
    writer = Writer(model.name, names.rt)
    glue: Glue | None = None
    if compiled:
        behind = form.behind(compiled.tables, writer)
        blocks = chain.ChainBlocks.of(compiled.tables, options.operators)
        effects = chain.effects(compiled.tables, blocks, form, writer.own)
        numbers = form.chained(model, compiled, effects, behind, options, writer)
    else:
        numbers = form.numbers(model, options, writer)
    variant = _variant(options, family, model.cascade, numbers, compiled)
    conversion = model.conversion(options.arithmetic, options.engine) if options.inverse else None
    if conversion:
        variant = dataclasses.replace(variant, coded=True)
        macros = ((name, operand(value), "") for name, value in conversion.macros)
        numbers = dataclasses.replace(numbers, macros=(*numbers.macros, *macros))
    watch = model.watch(options.arithmetic, options.engine, bool(options.left_out)) if options.health else None
    if watch:
        variant = dataclasses.replace(variant, watched=True)
        macros = ((name, operand(value), "") for name, value in watch.macros)
        numbers = dataclasses.replace(numbers, macros=(*numbers.macros, *macros))
    erasing = None
    if model.parameters.emit.degauss is not None:
        from hystgen.emission import degauss

        erasing = degauss.of(model, options.arithmetic)
        variant = dataclasses.replace(variant, erases=True)
        numbers = degauss.with_sequence(numbers, erasing, writer)
    if options.tables == "runtime" and options.inverse and loop and not variant.elements:
        variant = dataclasses.replace(variant, exchanges=True)
    if compiled:
        glue = chain.glue(variant, blocks, form, behind, model.cascade.pi.n)
    elif loop:
        glue = chain.glue(variant, chain.ChainBlocks.none(options.operators), form, (), model.cascade.pi.n)
    return EmittedModel(
        model, options, names, family, variant, form, numbers, compiled, glue, conversion, watch, erasing
    )


def _variant(
    options: Options, family: runtime.Family, cascade: StaticModel, numbers: Numbers, compiled: Compiled | None
) -> runtime.Variant:
    plain = runtime.Variant(
        options.engine, family, numbers.fronts, cascade.branches_differ, numbers.finer, numbers.saturates,
        numbers.start_list,
    )
    if compiled is None:
        return plain
    t = compiled.tables
    moves, bends = chain.plays(t)
    return dataclasses.replace(
        plain, chain=True, slew=bool(t.slew), braked=bool(t.braked), quiet=bool(t.quiet), turning=bool(t.turning),
        waiting=t.of("wait").samples, taps=len(t.tap), calls=frozenset(t.calls), moves=moves, bends=bends,
        elements=len(t.moving.elements.element), tilted=len(t.moving.elements.tilt) > 0,
        late_column=bool(t.columns.course.lags.any()),
    )


@dataclass(frozen=True)
class Code:
    """The C text of a model: types of its tables and of its instances (`states`), functions (`kernels`, `operators`),
    the macros and tables that these use (`plays`: with an entry for each play; `beside`: the others), and `data`: all
    that these keep in memory."""

    types: str
    states: str
    kernels: str
    operators: str
    macros: tuple[str, ...]
    plays: tuple[ConstantTable, ...]
    beside: tuple[ConstantTable, ...]
    data: Data
    parameters: UnitParameters | None = None
    snapshots: tuple[InstanceState, ...] = ()

    @property
    def tables(self) -> str:
        """Tables and macros."""
        return template("tables.c.j2", arrays=[each.text for each in (*self.plays, *self.beside)], code=self)


def front(one: EmittedModel) -> str:
    """A model's functions under the run time's names: those that call its stages and those that call its blocks."""
    stages = one.numbers.stages
    whole = template("front.c.j2", stages=stages, branches=one.variant.branches) if stages else ""
    return f"{whole}\n{one.glue.functions}" if one.glue else whole


def parameters(model: Model, options: Options, sha256: str, room: Mapping[str, int]) -> UnitParameters:
    """The parameters of a model in a module that loads them; `room`: entries of tables in that module whose lengths
    follow from numbers. Raises FormatError."""
    found = composed(compensator(model, options), sha256, room).parameters
    assert found is not None
    return found


def composed(one: EmittedModel, sha256: str = "", room: Mapping[str, int] = MappingProxyType({})) -> Code:
    """The C of a compensator; `sha256` and `room`: as for `parameters`.

    Raises EffectsError if the C of a user's own effect is refused.
    """
    family, names, operators, numbers = one.family, one.names, one.options.operators, one.numbers
    shared = one.options.layout == "shared-runtime"
    blocks: list[runtime.Piece] = []
    given, given_functions = list[runtime.Piece](), list[runtime.Piece]()
    if one.compiled:
        from hystgen.emission import declarations, own

        given, given_functions = own.pieces(one.compiled.tables)
        blocks = list(declarations.pieces(family.kind))
    instances = [*one.glue.states.values()] if one.glue else runtime.state_pieces(one.variant, family, operators)
    roots = [f"hystgen_{op}_t" for op in operators]
    if one.erasing:
        from hystgen.emission import degauss

        instances, roots = [*instances, degauss.instance()], [*roots, *degauss.ROOTS]
    memory, of_tables = runtime.memory_pieces(family), runtime.table_pieces(family)
    pieces = runtime.operator_pieces(
        one.variant, operators, front(one), one.calls, given_functions, [*blocks, *instances]
    )
    kernels = runtime.needed(runtime.kernel_pieces(family, one.kernel_facts), sorted(runtime.used(pieces)))
    whole = [*given, *([*memory, *of_tables] if shared else runtime.needed(memory, runtime.used(of_tables)))]
    written = {each.name: each for each in (*numbers.plays, *numbers.beside)}
    members = runtime.members_of(
        [*memory, *of_tables, *blocks, *given, *instances, *pieces], whole,
        {name: each.kind for own, each in written.items() for name in (own, f"hystgen{own.removeprefix(names.name)}")},
    )
    read = members.read([each.code for each in (*pieces, *kernels)], PLAIN)
    pieces = runtime.without_unread(pieces, members, read)
    kernels = runtime.without_unread(kernels, members, read)
    named = members.named([each.code for each in (*pieces, *kernels)])
    memory, of_tables, own_types, pieces = (
        runtime.with_named(each, members, named) for each in (memory, of_tables, [*blocks, *given, *instances], pieces)
    )
    used = _tables(written, names.name, members, [each.code for each in (*pieces, *kernels)])
    numbered, number_names = dict[str, tuple[Macro, str]](), set[str]()
    if one.options.tables == "runtime":
        from hystgen.emission import block, snapshot

        own_numbers = snapshot.numbers(one)
        found = block.number_macros([*interface.limits(one), *numbers.macros, *own_numbers], family.kind == "fixed")
        number_names = set(found)
        guards = runtime.guards(one.variant)
        aliases = {name: other for name, other in family.signals.items() if name in runtime.FINE}
        named_tables = [f"hystgen{own.removeprefix(names.name)}" for own in used]
        pieces = block.threaded(pieces, found, named_tables, aliases, guards)
        own_types = [
            runtime.with_members(each, [block.INSTANCE, *each.members])
            if each.name in [f"hystgen_{op}_t" for op in operators] else each for each in own_types
        ]
        text = " ".join(each.code for each in pieces)
        stated = {name for name, *_ in (*interface.limits(one), *own_numbers)}
        numbered = {
            name: each for name, each in found.items()
            if name in stated or re.search(rf"->{block.member(name)}\b", text)
        }
    called = sorted(runtime.used(pieces))
    kernels = runtime.needed([*of_tables, *kernels], called)
    carried = runtime.carried(family, pieces) if shared else []
    text = runtime.render_operators(pieces, names.name, one.corners, names.rt, family, carried)
    plays, beside = (
        [used[each.name] for each in every if each.name in used] for every in (numbers.plays, numbers.beside)
    )
    contents = [each for table in (*plays, *beside) for each in table.contents]
    states = runtime.needed(own_types, roots)
    kinds = [f"hystgen_{kind}" for kind, _ in contents]
    tables = [piece for piece in runtime.needed(own_types, [*called, *kinds]) if piece not in states]
    watch = runtime.watch_pieces(one.variant)
    made = None
    states_of: tuple[InstanceState, ...] = ()
    if one.options.tables == "runtime":
        from hystgen.emission import block

        types = [*memory, *of_tables, *own_types]
        made = block.parameters(
            one, numbered, [*used.values()][::-1], types, [*pieces, *kernels], sha256, room
        )
        kernels = [each for each in kernels if each not in of_tables]
        tables = [*([] if shared else [*memory * bool(one.corners), *of_tables]), *tables]
        states_of = tuple(snapshot.instances(one, [*memory, *own_types]))
    shown = runtime.render_operators([*states, *watch], names.name, one.corners, names.rt, family)
    if one.corners and not shared and not made:
        shown = f"{runtime.all_types(memory, names.rt, family)}\n{shown}"
    return Code(
        types=runtime.render_operators(tables, names.name, 0, names.rt, family),
        states=shown,
        kernels=runtime.render_carried(carried, names.name, names.rt, family) if shared
        else runtime.render(kernels, names.rt, family, static=True),
        operators=text,
        macros=tuple(
            define(f"{names.NAME}_{name}", value, comment)
            for name, value, comment in numbers.macros if name not in number_names and f"{names.NAME}_{name}" in text
        ),
        plays=tuple(plays),
        beside=tuple(beside),
        parameters=made,
        snapshots=states_of,
        data=Data(
            family, [*memory, *of_tables, *tables, *states, *watch], plays,
            [*contents, *(each for piece in (*kernels, *pieces, *tables) for each in piece.contents)],
        ),
    )


def _tables(
    every: Mapping[str, ConstantTable], name: str, members: Members, codes: Sequence[str]
) -> dict[str, ConstantTable]:
    """The tables that functions use, directly or through another table, with only the members that these name."""
    named, words = members.named(codes), set(re.findall(r"\w+", " ".join(codes)))
    found = {}
    for own, table in reversed([*every.items()]):  # a table comes before those that name it
        if {own, f"hystgen{own.removeprefix(name)}"} & words:
            found[own] = table.keeping(members.types.get(table.kind, {}), named, members.whole)
            words.update(re.findall(r"\w+", found[own].text))
            named |= members.named([found[own].text])
    return found


def implementation(one: EmittedModel, code: Code) -> str:
    """The operators with the parts of the run time that they need, except what a shared run time contains."""
    family, name, single = one.family, one.names.name, one.options.layout == "single-header"
    opening, apart, closing = (
        runtime.verbatim(files, name, family, name)
        for files in (
            (*(family.opening_apart if single else ()), *family.opening),
            ("arithmetic/storage.h", *family.soft(code.kernels)),
            family.closing if single else (),
        )
    )
    texts: tuple[str, ...] = (code.kernels, code.types, code.tables, code.operators)
    if code.parameters:
        from hystgen.emission import block, snapshot

        own = block.loader(code.parameters), snapshot.functions(code.snapshots)
        read = runtime.render_operators(
            runtime.block_pieces(family, own, name), name, 0, one.names.rt, family
        )
        texts = (code.kernels, "\n".join(code.macros), code.operators, read, *own)
    return "\n".join((interface.overview("\n".join(texts)), opening, apart, *texts, closing))


@dataclass(frozen=True)
class Module:
    """The contents of a model's files.

    `sha256`: hash of the parameters; `reading`: how the inverse of a model with effects reads the reference, one
    sentence per option; `doubts`: why the inverse may be of little use, in sentences.
    """

    compensator: EmittedModel
    code: Code
    cost: Cost
    sha256: str
    reading: Sequence[str]
    doubts: Sequence[str]

    @property
    def parameters(self) -> UnitParameters | None:
        """The parameters that it loads, if they are not constants."""
        return self.code.parameters


def of(model: Model, options: Options, sha256: str = "") -> Module:
    """The module of a model; `sha256`: hash of the parameters in the file, by default the hash of the model's.

    Raises FormatError.
    """
    one = compensator(model, options)
    sha256 = sha256 or parameters_sha256(model.parameters)
    made = composed(one, sha256)
    dynamic: list[str] = []
    if one.compiled and options.inverse:
        from hystgen.emission import doubts

        dynamic = doubts.found(model.parameters, one.compiled)
    return Module(
        one, made, cost.estimate(model.cascade, options, one.numbers.tables, made.data),
        sha256, [*interface.reading(one), *interface.watched(one)],
        [*dynamic, *interface.unbounded(one), *interface.misread(one)],
    )


def files(module: Module) -> dict[str, str]:
    """File names and their ASCII text."""
    one, made = module.compensator, module.code
    name, options, family = one.names.name, one.options, one.family
    command = interface.command(one.model.parameters, options)
    whole = implementation(one, made)
    stated, reasons, bytes_ = interface.limits(one), tuple[str, ...](), list[str]()
    if made.parameters:
        from hystgen.emission import block

        numbered = block.number_macros(stated, family.kind == "fixed")
        stated, reasons = [each for each in stated if each[0] not in numbered], block.REASONS
        bytes_ = block.words(made.parameters)
    single, source = options.layout == "single-header", f"{name}.c"
    shared = options.layout == "shared-runtime"

    def top(file: str, what: str, details: Sequence[str] = ()) -> str:
        return interface.banner(file, what, command, module.sha256, details)

    details = interface.details(one, [*module.reading, *module.doubts], module.cost)
    found = {
        f"{name}.h": template(
            "module.h.j2", module=module, one=one, header=interface, single_header=single, shared=shared,
            limits=stated, reasons=reasons,
            banner=top(f"{name}.h", f"{WHAT[options.operator]} of {name}", details),
            build=runtime.verbatim(family.build, name, family, name),
            api=runtime.api(interface.documented(one, module.cost), name, one.names.rt, family),
            implementation=whole if single else "",
        )
    }
    if not single:
        found[source] = template(
            "module.c.j2", one=one, shared=shared, banner=top(source, f"see {name}.h"), implementation=whole
        )
    if shared:
        found |= runtime_files(options.arithmetic)
    operators = selftest.operators(one)
    codes, windows = selftest.codes(one), selftest.windows(one)
    samples = sum(len(each.samples) for each in operators)
    costs = interface.selftest_cost(options, module.cost, samples, len(codes), len(windows))
    for ending, about, more in (
        (".h", f"checks {name} on the target", costs),
        (".c", "recorded samples and their exact answers", []),
    ):
        file = f"{name}_selftest{ending}"
        text = template(
            f"selftest{ending}.j2", operators=operators, codes=codes, windows=windows, unread=slots.OP_UNREAD,
            watch=one.watch, block=bytes_, unloaded=" -1 if the block of the unit in it does not load." * bool(bytes_),
        )
        text = text.replace("hystgen", name).replace("HYSTGEN", one.names.NAME)  # samples contain neither
        found[file] = f"{top(file, about, more)}\n{text}"
    return {file: seal(_tidy(fit(text))) for file, text in found.items()}


def _tidy(text: str) -> str:
    """The text without trailing blanks or runs of blank lines, and with one newline at the end."""
    lines: list[str] = []
    for line in text.splitlines():
        stripped = line.rstrip()
        if stripped or (lines and lines[-1]):
            lines.append(stripped)
    while lines and not lines[-1]:
        lines.pop()
    return "\n".join(lines) + "\n"


def runtime_files(arithmetic: str) -> dict[str, str]:
    """The run time that all models of one arithmetic share; the same bytes for every model."""
    family = runtime.FAMILIES[arithmetic]
    prefix, file = f"hystgen_{family.bits}", family.shared_file
    origin = interface.runtime_origin(arithmetic)

    def top(name: str, what: str) -> str:
        return interface.banner(name, what, *origin)

    def whole(*names: str) -> str:
        return runtime.verbatim(names, file, family, prefix)

    kernels = runtime.render(runtime.kernel_pieces(family), prefix, family, static=False)
    opening, apart = whole(*family.opening), whole("arithmetic/storage.h", *family.soft(kernels))
    return {
        f"{file}.h": template(
            "runtime.h.j2", family=family, rt=prefix, RT=prefix.upper(),
            banner=top(f"{file}.h", f"kernels shared by all {arithmetic} models"), build=whole(*family.build),
            types=runtime.all_types([*runtime.memory_pieces(family), *runtime.table_pieces(family)], prefix, family),
            prototypes=runtime.prototypes(prefix, family),
        ),
        f"{file}.c": template(
            "runtime.c.j2", file=file, banner=top(f"{file}.c", f"see {file}.h"),
            implementation="\n".join([interface.overview(kernels), opening, apart, kernels]),
        ),
    }
