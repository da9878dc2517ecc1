"""How functions of the time loop are compiled.

A function is compiled in three layers: itself, a wrapper for the interpreter and a wrapper for C. The wrappers unpack
every array of every tuple argument and take longest, so only functions that the interpreter calls have the former, and
none has the latter. Arrays are copied by `copy`: `a[:] = b` compiles the text of an error message, seconds of it.
A variable that begins as a literal number and is an argument within a loop compiles the function called twice, for the
literal and for its type: it is kept in an array, or comes from a range.
A function that counts references does so for every array of its tuples, 1 µs for all of a loop's: no function of the
loops counts any, and so none makes an array but those that are `allocating`; work arrays stand in the tuples.
A call from the interpreter unpacks every array of its tuples, 30 ns each: a loop's take longer than a step, and a
function of all of them hands 10 kB over. They do not change from call to call: `Unpacked` unpacks them once, and
functions that are given its address read them.
`kernel_cache` says where machine code is kept. A process that finds all of it there loads no compiler: what numba knows
of Python's and numpy's functions is needed to compile alone, and takes a fifth of a second.
"""

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import config, types
from numba.core.caching import FunctionCache, UserProvidedCacheLocator
from numba.core.runtime.nrt import rtsys
from numba.extending import NativeValue, intrinsic, models, register_model, unbox

from gudgeon.solver.kernel_cache import cache_folder, file_digest

FAST = {"reassoc", "contract"}
"""Sums may be reordered for vector units; NaN and infinity keep their meaning."""


class _MachineCode(FunctionCache):
    """numba's cache of a function, which is read without what is needed to compile; a compilation loads that itself."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for a signature; None where it is not kept, or where what is kept cannot be read.

        What cannot be read is a damaged file, or a list that names types of a module which this process has not, as
        those of tests: it is begun anew.
        """
        rtsys.initialize(target_context)
        try:
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)
        except (pickle.UnpicklingError, ImportError, AttributeError, EOFError, ValueError, IndexError):
            self.flush()
            return None


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles a function and keeps its machine code; options as `numba.njit` takes them."""

    def decorate(function: Callable[..., Any]) -> Any:
        folder, before = cache_folder(), (config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES)  # type: ignore[attr-defined]
        config.CACHE_DIR = str(folder or before[0])  # type: ignore[attr-defined]
        config.CACHE_LOCATOR_CLASSES = f"{__name__}.{SourcesLocator.__name__}"  # type: ignore[attr-defined]
        try:
            found: Any = numba.njit(**options)(function)  # type: ignore[call-overload]
            if folder is not None:
                found._cache = _MachineCode(function)
            return found
        finally:
            config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before  # type: ignore[attr-defined]

    return decorate


class SourcesLocator(UserProvidedCacheLocator):
    """Where numba keeps the machine code of a function: in a folder named by the digest of all that it depends on."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        self._cache_path = str(Path(config.CACHE_DIR) / file_digest(py_file))  # type: ignore[attr-defined]


entry = compiled(fastmath=FAST, no_cfunc_wrapper=True, _nrt=False)
"""For functions that the interpreter calls."""
allocating = compiled(fastmath=FAST, no_cfunc_wrapper=True)
"""For functions that the interpreter calls and that make arrays."""
inner = compiled(fastmath=FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)
"""For functions that only compiled ones call."""
embedded = compiled(fastmath=FAST, inline="always", _nrt=False)
"""For a function of many tuples that is called once: it becomes part of its caller, which need not hand them over."""
ordered = compiled(fastmath=FAST | {"nnan", "nsz"}, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)
"""For the largest of many values, which vector units find only where NaN need not be told; balances tell it."""


def machine_code(function: Any, *arguments: Any) -> Callable[..., Any]:
    """Return the machine code of a compiled function for arguments of these types alone.

    To look at the types of all arrays of a loop's tuples takes longer than a step. Nothing checks the types of a call.
    Where numba is told not to compile, it is the function itself.
    """
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return function
    types = tuple(numba.typeof(one) for one in arguments)
    function.compile(types)
    return function.get_overload(types)


@inner
def copy(source, target):  # type: ignore[no-untyped-def]
    """Copy a vector into another of the same length."""
    for i in range(len(source)):
        target[i] = source[i]


@inner
def larger(known, other):  # type: ignore[no-untyped-def]
    """Return the larger of two numbers, NaN if either is: `max` may lose it."""
    return other if other > known or other != other else known


WORD = 8
"""Bytes of a number; what is kept begins at a multiple of it."""


class UnpackedType(types.Type):
    """numba's type of `Unpacked`.

    Args:
        held: Type of the tuple.
    """

    def __init__(self, held: types.Type) -> None:
        self.held, self.bitwidth = held, 8 * WORD
        super().__init__(name=f"Unpacked({held})")


# A function takes the address of what is unpacked.
register_model(UnpackedType)(models.IntegerModel)


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
    size = _bytes(arrays)  # type: ignore[call-arg]
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
    unpacked = _read  # type: ignore[assignment]
