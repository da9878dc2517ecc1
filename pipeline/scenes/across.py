"""Loads along which a part does not move by its kind: across the plane of plane parts, across the axis of bars.

Such a part has no deflection there, and no joint or support bears the load: without a refusal it would be dropped.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.plane import PlanePart
from gudgeon.solver.forces.external import ExternalForce
from gudgeon.solver.forces.given import GivenForce, GivenWrench

if TYPE_CHECKING:
    from gudgeon.pipeline.scenes.component import Component
    from gudgeon.solver.scene.scene import Scene

NEGLIGIBLE = 1e-6
"""Share of a load that may lie across: directions are given with some six digits."""


def dropped_loads(scene: "Scene", components: dict[str, "Component"]) -> list[str]:
    """List the loads of which a part of a plane or a line bears only a share, one line each."""
    lines = []
    for name, settings in scene.body.items():
        component = components.get(owner := scene.component_of(name))
        if component is None or component.modes.reduction == "rigid" or (able := _motions(component)) is None:
            continue
        Q = np.eye(3) if settings.orientation is None else settings.orientation.matrix()
        for key, force, moment in _loads(scene, name):
            for vector, axes in ((force, able[0]), (moment, able[1])):
                in_body = Q.T @ vector
                across = in_body - axes.T @ (axes @ in_body)
                size, lost = float(np.linalg.norm(vector)), float(np.linalg.norm(across))
                if lost > NEGLIGIBLE * size:
                    lines.append(
                        f"{key}: {vector.tolist()} given, of which {lost / size:.3g} acts where"
                        f" body '{name}' does not move: {able[2]}; {_remedy(owner, component)}"
                    )
                    break
    return lines


def _motions(component: "Component") -> tuple[np.ndarray, np.ndarray, str] | None:
    """Return unit vectors of the displacements and the rotations of a part, (k, 3) each, and this in words."""
    geometry, axes = component.geometry, np.eye(3)
    if isinstance(geometry, Bar):
        return axes[:1], np.empty((0, 3)), "a bar moves along its axis alone"
    if isinstance(geometry, Beam) and geometry.motion == "plane":
        turn = np.cross(axes[2], geometry.axis)[None]
        return (
            axes[2:],
            turn,
            "a beam of motion 'plane' moves along z of its component alone, and turns across its axis",
        )
    if isinstance(geometry, PlanePart):
        return axes[:2], axes[2:], "a plane part moves in x and y of its component, and turns about z"
    return None


def _loads(scene: "Scene", body: str) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield the key of each load on a body with force and moment in the axes of the scene, (3,) each."""
    yield "run.gravity", np.asarray(scene.run.gravity, float), np.zeros(3)
    for name, force in scene.force.items():
        if getattr(force, "body", None) != body:
            continue
        if isinstance(force, GivenForce | ExternalForce) and force.direction is not None:
            yield f"force.{name}.direction", np.asarray(force.direction, float), np.zeros(3)
        elif isinstance(force, GivenWrench):
            yield f"force.{name}", np.asarray(force.force, float), np.asarray(force.moment, float)


def _remedy(owner: str, component: "Component") -> str:
    """Return what a part needs so that it moves in space."""
    if isinstance(component.geometry, Beam):
        return f"set component.{owner}.geometry.motion = 'space'"
    return f"turn the load, or make component '{owner}' a solid or a beam of motion 'space'"
