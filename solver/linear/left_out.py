"""Sentences on stiffness of loads that a scene lacks: of unknown stress, and with cranks and moving forces."""

import numpy as np

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.system.system import System

LENGTH = np.sqrt(12.0)
"""Length of a bar over its radius of gyration."""
UNKNOWN = 0.01
"""Estimated share of the lowest stiffness of a body from which on stress that is not known is said."""

SAMPLES = 33
"""Times at which loads are read."""


def left_out_note(system: System, body: FlexibleBody, force: float, loads: str) -> str | None:
    """Return a sentence where a force [N] may soften or stiffen a body by a share of its lowest stiffness: that of the
    force over Euler's of a bar of the body's mass, size and lowest frequency.

    Args:
        loads: What it is the force of, in words.
    """
    omega = body.modal.angular_frequencies
    if not len(omega) or not system.scene.body[body.name].geometric_stiffness:
        return None
    relative_change = force * np.pi**2 / (LENGTH * body.gyration * body.morph.mass * float(omega.min()) ** 2)
    if relative_change < UNKNOWN:
        return None
    return (
        f"body.{body.name}.geometric_stiffness: the stress of {loads}, up to {force:.3g} N, may change its lowest"
        f" stiffness by up to {relative_change:.1%}, which is not included"
    )


def travelling_notes(system: System) -> list[str]:
    """Return a sentence for each body that loads, weight or moving forces may soften or stiffen in a scene with a
    slider-crank or a moving force, whose loads have no stiffness."""
    scene, driving = system.scene, system.driving
    if scene.capabilities.turns or not (scene.cranks() or scene.moving()):
        return []
    notes, times = [], np.linspace(0.0, scene.run.duration, SAMPLES)
    amounts = driving.loads(times, 0.0)
    for name, body in system.bodies.items():
        forces = [body.morph.mass * float(np.linalg.norm(scene.run.gravity))]
        forces += [abs(force.force) for force in scene.moving().values() if force.body == name]
        for load, rows in driving.given_rows():
            if load.body == name and not load.travels:
                forces.append(float(np.linalg.norm(amounts[:, rows] @ load.resultant[:, :3], axis=1).max()))
        loads = "weight, loads and moving forces in a scene with a slider-crank or a moving force"
        if (note := left_out_note(system, body, max(forces), loads)) is not None:
            notes.append(note)
    return notes
