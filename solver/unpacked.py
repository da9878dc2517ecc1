"""Tuples of arrays that machine code finds unpacked.

A call from the interpreter unpacks every array of its tuples, 30 ns each: a loop's take longer than a step. They do not
change from call to call, so they are unpacked once, into memory that calls read.
"""

from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core import config, types
from numba.extending import NativeValue, intrinsic, models, register_model, unbox

from gudgeon.solver.compiled import entry

WORD = 8
"""Bytes of a number; what is kept begins at a multiple of it."""


class UnpackedType(types.Type):
    """numba's type of `Unpacked`.

    Args:
        held: Type of the tuple.
    """

    def __init__(self, held: types.Type) -> None:
        self.held = held
        super().__init__(name=f"Unpacked({held})")


@register_model(UnpackedType)
class _Address(models.PrimitiveModel):
    """A function takes the address of what is unpacked."""

    def __init__(self, manager: Any, own: UnpackedType) -> None:
        super().__init__(manager, own, ir.IntType(8 * WORD))


@unbox(UnpackedType)
def _address(_: UnpackedType, value: Any, c: Any) -> NativeValue:
    """Read the address of an object."""
    number = c.pyapi.object_getattr_string(value, "address")
    found = c.pyapi.long_as_longlong(number)
    c.pyapi.decref(number)
    return NativeValue(found)


def _pointer(context: Any, builder: Any, held: types.Type, address: Any) -> Any:
    return builder.inttoptr(address, context.get_data_type(held).as_pointer())


@intrinsic
def _read(_: Any, kept: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.unpack_value(builder, kept.held, _pointer(context, builder, kept.held, arguments[0]))

    return kept.held(kept), code


@intrinsic
def _write(_: Any, arrays: Any, address: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        context.pack_value(builder, arrays, arguments[0], _pointer(context, builder, arrays, arguments[1]))
        return context.get_dummy_value()

    return types.void(arrays, address), code


@intrinsic
def _bytes(_: Any, arrays: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.get_constant(types.int64, context.get_abi_sizeof(context.get_data_type(arrays)))

    return types.int64(arrays), code


@entry
def _unpack(arrays, memory, address):  # type: ignore[no-untyped-def]
    """Unpack arrays where an address tells, if the memory there has room, and return the bytes that they take."""
    size = _bytes(arrays)
    if size <= WORD * len(memory):
        _write(arrays, address)
    return size


class Unpacked:
    """Arrays as machine code has them; a compiled function takes them by `unpacked`, and changes them in place.

    Args:
        arrays: A tuple of arrays, of such tuples and of numbers.
    """

    def __init__(self, arrays: Any) -> None:
        self.arrays = arrays
        """What is unpacked, which lives as long as this."""
        if config.DISABLE_JIT:  # type: ignore[attr-defined]
            return
        self._numba_type_ = UnpackedType(numba.typeof(arrays))
        empty = np.zeros(0)
        self._memory = np.zeros(-(-_unpack(arrays, empty, 0) // WORD))
        self.address = self._memory.ctypes.data
        _unpack(arrays, self._memory, self.address)


if config.DISABLE_JIT:  # type: ignore[attr-defined]

    def unpacked(kept: Unpacked) -> Any:
        """Return the arrays of a compiled function's argument."""
        return kept.arrays

else:
    unpacked = _read
