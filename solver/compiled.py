"""How functions of the time loop are compiled.

A function is compiled in three layers: itself, a wrapper for the interpreter and a wrapper for C. The wrappers unpack
every array of every tuple argument and take longest, so only functions that the interpreter calls have the former, and
none has the latter. Arrays are copied by `copy`: `a[:] = b` compiles the text of an error message, seconds of it.
A variable that begins as a literal number and is an argument within a loop compiles the function called twice, for the
literal and for its type: it is kept in an array, or comes from a range.
A function that counts references does so for every array of its tuples, 1 µs for all of a loop's: no function of the
loops counts any, and so none makes an array but those that are `allocating`; work arrays stand in the tuples.
`kernel_cache` says where machine code is kept. A process that finds all of it there loads no compiler: what numba knows
of Python's and numpy's functions is needed to compile alone, and takes a fifth of a second.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import FunctionCache, UserProvidedCacheLocator
from numba.core.runtime.nrt import rtsys

from gudgeon.solver.kernel_cache import cache_folder, file_digest

FAST = {"reassoc", "contract"}
"""Sums may be reordered for vector units; NaN and infinity keep their meaning."""


class _MachineCode(FunctionCache):
    """numba's cache of a function, which is read without what is needed to compile; a compilation loads that itself."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for a signature; None where it is not kept."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


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
