"""Compiled functions that the interpreter calls again and again, with arguments of the same types."""

from collections.abc import Hashable
from typing import Any

import numpy as np

from gudgeon.solver.compiled import machine_code

OWN_DATA = 0x4
"""Flag of an array that numba's types do not tell."""
_FOUND: dict[Hashable, Any] = {}
"""Machine code by function and `structure` of its arguments."""


def structure(value: Any) -> Hashable:
    """Return what numba's type of an argument follows from, in a tenth of the time that the type takes to be made."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.ndim, value.flags.num & ~OWN_DATA
    if isinstance(value, tuple):
        return (type(value), *map(structure, value))
    return getattr(value, "_numba_type_", type(value))


class Prepared:
    """A compiled function that is called with arguments of the same types always: its machine code, once found.

    Other runs of the process find it by the structure of their arguments.
    """

    def __init__(self, function: Any) -> None:
        self._function, self._code = function, None

    def __call__(self, *arguments: Any) -> Any:
        if self._code is None:
            key = self._function, structure(arguments)
            if key not in _FOUND:
                _FOUND[key] = machine_code(self._function, *arguments)
            self._code = _FOUND[key]
        return self._code(*arguments)
