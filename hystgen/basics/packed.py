"""Named tuples of tables and memory, passed to compiled functions by address.

Numba passes a named tuple by value, field by field, and an array as seven numbers. With the hundred arrays of a model
with effects, compiling the calls would take longer than compiling what the functions compute. A `Packed` has three
words for each field: a number, an array's address, length and stride, or the address of another tuple's words.
Functions for numba's interface have no annotations, since its objects have none.
"""

from __future__ import annotations

import functools
import hashlib
import operator
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core.typing.templates import AttributeTemplate

BaseTuple: Any = types.BaseTuple
WORD = ir.IntType(64)


class PackedType(types.Type):
    """The type of a named tuple by its fields."""

    def __init__(self, *fields: tuple[str, types.Type]) -> None:
        super().__init__("Packed_" + hashlib.sha256(repr(fields).encode()).hexdigest()[:16])
        self.fields = {name: (place, kind) for place, (name, kind) in enumerate(fields)}

    def attribute(self, name: str) -> types.Type:
        """The type of a field."""
        return self.fields[name][1]


class ColumnType(types.Type):
    """The type of an array of numbers, of rows of numbers or of structures."""

    def __init__(self, dtype: np.dtype[Any]) -> None:
        super().__init__("Column_" + hashlib.sha256(repr(dtype).encode()).hexdigest()[:16])
        self.dtype = dtype
        self.number = None if dtype.names else numba.from_dtype(dtype.base)

    def attribute(self, name: str) -> types.Type:
        """The type of a member of the structures, or of `dtype` or `shape` of the array."""
        if not self.number:
            return ColumnType(self.dtype[name])
        return types.DType(self.number) if name == "dtype" else types.UniTuple(types.int64, 2)


class Callee(types.Dispatcher):
    """The type of a function that another one calls: numba would compile it again for each literal argument."""

    def get_call_type(self, context, args, kws):
        """The signature of a call."""
        return super().get_call_type(context, tuple(map(types.unliteral, args)), kws)


class Packed:
    """A named tuple, or a tuple in one, for a compiled function."""

    def __init__(self, given: tuple[object, ...]) -> None:
        self.kept = given, [Packed(each) if isinstance(each, tuple) else each for each in given]
        fields = [_field(each) for each in self.kept[1]]
        self.words = np.array([words for _, *words in fields], np.int64)
        self.address = self.words.ctypes.data
        self._numba_type_ = _tuple_type(getattr(given, "_fields", None), *(kind for kind, *_ in fields))


def _field(value: Any) -> tuple[types.Type, int, int, int]:
    """The type and the words of a field."""
    if isinstance(value, Packed):
        return value._numba_type_, value.address, 0, 0
    if isinstance(value, np.ndarray):
        assert value.ndim == 1 or value.flags.c_contiguous, "rows follow one another"
        stride = value.strides[0] if value.ndim == 1 else value.shape[1] * value.itemsize
        return _column_type(value.dtype), value.__array_interface__["data"][0], len(value), stride
    return types.int64, operator.index(value), 0, 0


_column_type = functools.cache(ColumnType)


@functools.cache
def _tuple_type(names: tuple[str, ...] | None, *kinds: types.Type) -> types.Type:
    return types.Tuple(kinds) if names is None else PackedType(*zip(names, kinds, strict=True))


@extending.register_model(ColumnType)
class _Column(extending.models.StructModel):
    def __init__(self, manager: object, kind: ColumnType) -> None:
        super().__init__(manager, kind, [("data", types.voidptr), ("length", types.int64), ("stride", types.int64)])


extending.register_model(PackedType)(extending.models.OpaqueModel)
extending.register_model(Callee)(extending.models.OpaqueModel)


@extending.unbox(PackedType)
def _unbox(_, packed, c):
    address = c.pyapi.object_getattr_string(packed, "address")
    block = c.builder.inttoptr(c.pyapi.long_as_longlong(address), c.context.get_value_type(types.voidptr))
    c.pyapi.decref(address)
    return extending.NativeValue(block)


class _Attributes(AttributeTemplate):
    def generic_resolve(self, kind, name):  # type: ignore[override]
        return kind.attribute(name)


for each in (PackedType, ColumnType):
    extending.infer_getattr(type("Attributes", (_Attributes,), {"key": each}))


@extending.lower_getattr_generic(PackedType)
def _load_field(context, builder, kind, block, name):
    return _load(context, builder, block, *kind.fields[name])


def _load(context, builder, block, place, kind):
    """The value of a type in the words of a field."""
    start = builder.gep(block, [WORD(24 * place)])
    if not isinstance(kind, BaseTuple):
        return builder.load(builder.bitcast(start, context.get_value_type(kind).as_pointer()))
    inner = builder.load(builder.bitcast(start, block.type.as_pointer()))
    return context.make_tuple(builder, kind, [_load(context, builder, inner, *each) for each in enumerate(kind)])


@extending.lower_getattr_generic(ColumnType)
def _load_attribute(context, builder, kind, column, name):
    data, length, stride = (builder.extract_value(column, k) for k in range(3))
    if name == "dtype":
        return context.get_dummy_value()
    if name == "shape":
        rows = kind.dtype.shape  # of a member that is itself an array
        width = WORD(rows[0]) if rows else builder.sdiv(stride, WORD(kind.dtype.itemsize))
        return context.make_tuple(builder, kind.attribute(name), [length, width])
    return builder.insert_value(column, builder.gep(data, [WORD(kind.dtype.fields[name][1])]), 0)


def _address(context, builder, kinds, given):
    """The address of a number by its index, or by those of its row and in it."""
    column, at = kinds[:2]
    data, _, stride = (builder.extract_value(given[0], k) for k in range(3))
    indices = [(given[1], at)]
    if isinstance(at, BaseTuple):
        indices = [(builder.extract_value(given[1], k), kind) for k, kind in enumerate(at)]
    for (index, kind), step in zip(indices, (stride, WORD(column.dtype.base.itemsize)), strict=False):
        data = builder.gep(data, [builder.mul(context.cast(builder, index, kind, types.int64), step)])
    return builder.bitcast(data, context.get_data_type(column.number).as_pointer())


@extending.lower_builtin(len, ColumnType)
def _length(_, builder, __, given):
    return builder.extract_value(given[0], 1)


@extending.lower_builtin(operator.getitem, ColumnType, types.Type)
def _item(context, builder, signature, given):
    """A number, or a part from a first up to a last index, both given and within the array."""
    column, at = signature.args
    if not isinstance(at, types.SliceType):
        return context.unpack_value(builder, column.number, _address(context, builder, signature.args, given))
    part = context.make_helper(builder, at, given[1])
    data = _address(context, builder, (column, types.int64), (given[0], part.start))
    changed = builder.insert_value(given[0], builder.bitcast(data, builder.extract_value(given[0], 0).type), 0)
    return builder.insert_value(changed, builder.sub(part.stop, part.start), 1)


@extending.lower_builtin(operator.setitem, ColumnType, types.Type, types.Type)
def _set_item(context, builder, signature, given):
    column, _, kind = signature.args
    number = context.cast(builder, given[2], kind, column.number)
    context.pack_value(builder, column.number, number, _address(context, builder, signature.args, given))


def _item_type(of, at):
    return (of if isinstance(at, types.SliceType) else of.number) if isinstance(of, ColumnType) else None


extending.type_callable(len)(lambda _: lambda x: types.int64 if isinstance(x, ColumnType) else None)
extending.type_callable(operator.getitem)(lambda _: _item_type)
extending.type_callable(operator.setitem)(lambda _: lambda x, _, __: types.none if isinstance(x, ColumnType) else None)
