"""How functions of the time loop are compiled."""

from numba import njit

FAST = {"reassoc", "contract"}
"""Sums may be reordered for vector units; NaN and infinity keep their meaning."""


inner = njit(cache=True, fastmath=FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[call-overload]
"""For functions that only compiled ones call: no wrapper for the interpreter, which takes longest to compile."""


ordered = njit(  # type: ignore[call-overload]
    cache=True, fastmath=FAST | {"nnan", "nsz"}, no_cpython_wrapper=True, no_cfunc_wrapper=True
)
"""For the largest of many values, which vector units find only where NaN need not be told; balances tell it."""
