"""When and where sliding points leave the surface of another body."""

import numpy as np

from gudgeon.solver.bodies.placing import own_vectors
from gudgeon.solver.system.system import System


def left_text(system: System, times: np.ndarray, snapshots: np.ndarray) -> str:
    """Return a sentence that says which point left which surface first; empty where none did.

    Args:
        times: Ends of the samples [s], (s,).
        snapshots: Rigid coordinates at these times first, (s, n).
    """
    earliest: tuple[float, str] | None = None
    for contact in system.contacts:
        if (surface := contact.master) is None:
            continue
        position, before = system.position.copy(), surface.weights(system.slid(contact, system.position))[2]
        for time, snapshot in zip(times, snapshots, strict=True):
            position[system.rigid] = snapshot[: len(system.rigid)]
            beside = surface.weights(system.slid(contact, position))[2] & ~before
            if beside.any() and (earliest is None or time < earliest[0]):
                point = own_vectors(system.scene.body[contact.body], contact.points)[int(np.flatnonzero(beside)[0])]
                coordinates = ", ".join(f"{x:.4g}" for x in point)
                earliest = (
                    float(time),
                    f"the point of '{contact.interface}' at ({coordinates}) m of {contact.body} left"
                    f" '{surface.interface}' of {surface.body} at {time:.4g} s (contact.{contact.name})",
                )
                break
    return "" if earliest is None else earliest[1]
