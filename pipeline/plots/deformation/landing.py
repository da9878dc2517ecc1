"""Bodies that meet planes alone, as `impact.mp4` shows them: rigid motion and deformation each magnified for itself.

A body bounces over far more than it deforms. Its drawn points are shifted along the normal of each plane that presses
on it until the lowest of them is as high above the plane as its own gap, magnified like the rigid motion: bodies that
touch are drawn touching.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.solver.obstacles.plane import Plane


@dataclass(frozen=True)
class Landing:
    """Rigid motion beside planes."""

    planes: dict[str, list[Plane]]
    """Those that press on a body, by its name."""
    origin: int
    """Frame in which bodies are where they are."""
    scale: float
    """Factor of rigid motion and gaps."""

    def places(self, body: BodyMotion, position: np.ndarray, frame: int, scale: float) -> np.ndarray:
        """Return where the points of a body are drawn at a frame [m], (p, 3), its deformation magnified by `scale`."""
        rest = body.nodes + position
        drawn = rest + body.rigid(self.origin) + self.scale * (body.rigid(frame) - body.rigid(self.origin))
        drawn = drawn + scale * body.elastic(frame)
        for plane in self.planes.get(body.name, ()):
            height = self.scale * _gap(plane, rest + body.total(frame))
            drawn = drawn + (height - plane.gap(drawn).min()) * plane.direction(drawn)
        return drawn


def landing(
    drawing: Drawing, bodies: Sequence[tuple[BodyMotion, np.ndarray]], frames: np.ndarray, origin: int
) -> Landing | None:
    """Return how the rigid motion of bodies is drawn, with the position of each [m]; None where one meets more than
    whole planes."""
    planes: dict[str, list[Plane]] = {}
    for name, contact in drawing.scene.get("contact", {}).items():
        if contact["against"]["shape"] != "plane" or contact["against"].get("edges"):
            return None
        if drawing.trajectory.contacts[name].force.any():
            planes.setdefault(contact["body"], []).append(Plane.model_validate(contact["against"]))
    scales = []
    for body, position in bodies:
        way = max(float(np.linalg.norm(body.rigid(frame) - body.rigid(origin), axis=1).max()) for frame in frames)
        touched = planes.get(body.name, ())
        way = max([way, *(_gap(one, body.nodes + position + body.total(frame)) for one in touched for frame in frames)])
        if body.size > 0:
            scales.append(style.nice_scale(style.SHOWN * body.size, way))
    return Landing(planes, origin, min(scales))


def _gap(plane: Plane, points: np.ndarray) -> float:
    """Return the smallest gap of points to a plane [m]; of points behind it, as a compressed layer has them, zero."""
    return max(float(plane.gap(points).min()), 0.0)
