"""Springs compiled: rows, stiffness and damping of a scene's springs."""

from dataclasses import dataclass

import numpy as np

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.scene import Scene


@dataclass(frozen=True)
class Springs:
    """Springs between bodies and to the ground, b of them."""

    rows: np.ndarray
    """Elongation per coordinate, (b, m)."""
    stiffness: np.ndarray
    """[N/m], (b,)"""
    damping: np.ndarray
    """[N s/m], (b,)"""
    stretch: np.ndarray
    """Elongation at q = 0 [m], (b,)."""


def compile_springs(scene: Scene, bodies: dict[str, FlexibleBody], offsets: dict[str, int], size: int) -> Springs:
    """Build the springs.

    Raises:
        SceneError: a spring on an elastic body, or one that cannot stretch.
    """
    springs = scene.springs()
    rows = np.zeros((len(springs), size))
    for number, (name, spring) in enumerate(springs.items()):
        line = np.asarray(spring.direction, float)
        line /= np.linalg.norm(line)
        place = np.asarray(scene.body[spring.body].position) + spring.at
        for owner, sign in ((spring.body, 1.0), (spring.against, -1.0)):
            if owner is None:
                continue
            body = bodies[owner]
            if len(body.modal.angular_frequencies):
                raise SceneError(f"force.{name}: body '{owner}' is elastic; a spring acts on a rigid body")
            point = place - np.asarray(scene.body[owner].position)
            part = sign * body.rigid_rows(point[None], line[None])[0]
            rows[number, offsets[owner] : offsets[owner] + len(part)] += part
        if not np.any(rows[number]):
            raise SceneError(f"force.{name}.direction: the body cannot move along it")
    values = [(spring.stiffness, spring.damping, spring.stretch) for spring in springs.values()]
    stiffness, damping, stretch = np.array(values).reshape(-1, 3).T
    return Springs(rows, stiffness, damping, stretch)
