"""Compilation of the functions of the time loop.

A function is compiled in three layers: itself, a wrapper for the interpreter and a wrapper for C. The wrappers unpack
every array of every tuple argument and take longest, so only functions that the interpreter calls have the former, and
none has the latter. Arrays are copied by `copy`: `a[:] = b` compiles the text of an error message, seconds of it.
"""

from numba import njit

FAST = {"reassoc", "contract"}
"""Sums may be reordered for vector units; NaN and infinity keep their meaning."""


entry = njit(cache=True, fastmath=FAST, no_cfunc_wrapper=True)  # type: ignore[call-overload]
"""For functions that the interpreter calls."""


inner = njit(cache=True, fastmath=FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[call-overload]
"""For functions that only compiled ones call."""


embedded = njit(cache=True, fastmath=FAST, inline="always")  # type: ignore[call-overload]
"""For a function of many tuples that is called once: it becomes part of its caller, without passing them."""


ordered = njit(  # type: ignore[call-overload]
    cache=True, fastmath=FAST | {"nnan", "nsz"}, no_cpython_wrapper=True, no_cfunc_wrapper=True
)
"""For the largest of many values, vectorised only if NaN may be ignored; the energy balance detects NaN."""


@inner
def copy(source, target):  # type: ignore[no-untyped-def]
    """Copy a vector into another of the same length."""
    for i in range(len(source)):
        target[i] = source[i]
