"""Compiled springs: rows, stiffness and damping."""

from dataclasses import dataclass

import numpy as np

from gudgeon.solver.bodies.placing import turned_vectors
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.vectors import unit


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


def compile_springs(scene: Scene, bodies: dict[str, FlexibleBody], size: int) -> Springs:
    """Build the springs of a scene.

    Raises:
        SceneError: a spring acts on an elastic body, or no motion changes its length.
    """
    springs = scene.springs()
    rows = np.zeros((len(springs), size))
    for number, (name, spring) in enumerate(springs.items()):
        line = unit(spring.direction)
        own = scene.body[spring.body]
        place = np.asarray(own.position) + turned_vectors(own, spring.at)
        for owner, sign in ((spring.body, 1.0), (spring.against, -1.0)):
            if owner is None:
                continue
            body = bodies[owner]
            if len(body.modal.angular_frequencies):
                raise SceneError(f"force.{name}: body '{owner}' is elastic; a spring acts on a rigid body")
            point = place - np.asarray(scene.body[owner].position)
            rows[number, body.rigid] += sign * body.rigid_rows(point[None], line[None])[0]
        if not np.any(rows[number]):
            raise SceneError(f"force.{name}.direction: the body cannot move along it")
    values = [(spring.stiffness, spring.damping, spring.stretch) for spring in springs.values()]
    stiffness, damping, stretch = np.array(values).reshape(-1, 3).T
    return Springs(rows, stiffness, damping, stretch)
