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
    first: tuple[float, str] | None = None
    for contact in system.contacts:
        if (over := contact.master) is None:
            continue
        position, before = system.position.copy(), over.weights(system.slid(contact, system.position))[2]
        for time, snapshot in zip(times, snapshots, strict=True):
            position[system.rigid] = snapshot[: len(system.rigid)]
            beside = over.weights(system.slid(contact, position))[2] & ~before
            if beside.any() and (first is None or time < first[0]):
                place = own_vectors(system.scene.body[contact.body], contact.points)[int(np.flatnonzero(beside)[0])]
                at = ", ".join(f"{x:.4g}" for x in place)
                first = (
                    float(time),
                    f"the point of '{contact.interface}' at ({at}) m of {contact.body} left"
                    f" '{over.interface}' of {over.body} at {time:.4g} s (contact.{contact.name})",
                )
                break
    return "" if first is None else first[1]
