"""The bytes of arrays that an object holds."""

from dataclasses import fields, is_dataclass

import numpy as np
from scipy import sparse


def held_bytes(found: object, seen: set[int]) -> int:
    """Return the bytes of all arrays that an object leads to, each once."""
    if id(found) in seen:
        return 0
    seen.add(id(found))
    if isinstance(found, np.ndarray):
        return held_bytes(found.base, seen) if isinstance(found.base, np.ndarray) else found.nbytes
    if sparse.issparse(found):
        return sum(held_bytes(part, seen) for part in vars(found).values())
    if is_dataclass(found):
        return sum(held_bytes(getattr(found, entry.name), seen) for entry in fields(found))
    if isinstance(found, dict):
        return sum(held_bytes(part, seen) for part in found.values())
    return sum(held_bytes(part, seen) for part in found) if isinstance(found, list | tuple) else 0
