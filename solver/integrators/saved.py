"""The arrays of a loop of the core that a run goes on from."""

from collections.abc import Mapping

import numpy as np

ENDED = "ended"
"""Of the log of impacts: what it holds was taken after every frame."""


def live_arrays(value: object, name: str) -> dict[str, np.ndarray]:
    """Return the arrays of a named tuple, and of those within it, that may be written, by their names."""
    if isinstance(value, np.ndarray):
        return {name: value} if value.flags.writeable and value.size else {}
    members: dict[str, object] = getattr(value, "_asdict", dict)()
    return {
        path: array
        for key, member in members.items()
        if key != ENDED
        for path, array in live_arrays(member, f"{name}.{key}").items()
    }


def set_arrays(live: Mapping[str, np.ndarray], stored: Mapping[str, np.ndarray]) -> None:
    """Write what is stored into the arrays of a loop, which sees them in place."""
    for name, array in live.items():
        array[...] = stored[name]
