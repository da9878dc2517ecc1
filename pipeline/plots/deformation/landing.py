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
from gudgeon.pipeline.plots.deformation.obstacle import planes_of
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
        still, origin = body.nodes + position, body.rigid(self.origin)
        drawn = still + origin + self.scale * (body.rigid(frame) - origin)
        drawn = drawn + scale * body.elastic(frame)
        for plane in self.planes.get(body.name, ()):
            height = self.scale * _gap(plane, still + body.total(frame))
            drawn = drawn + (height - plane.gap(drawn).min()) * plane.direction(drawn)
        return drawn


def landing(
    drawing: Drawing, bodies: Sequence[tuple[BodyMotion, np.ndarray]], frames: np.ndarray, origin: int
) -> Landing | None:
    """Return how the rigid motion of bodies is drawn, with the position of each [m]; None where one meets more than
    whole planes."""
    contacts = [contact["against"] for contact in drawing.scene.get("contact", {}).values()]
    if any(against["shape"] != "plane" or against.get("edges") for against in contacts):
        return None
    planes, scales = planes_of(drawing, acting=True), []
    for body, position in bodies:
        travel = [float(np.linalg.norm(body.rigid(frame) - body.rigid(origin), axis=1).max()) for frame in frames]
        for plane in planes.get(body.name, ()):
            travel += [_gap(plane, body.nodes + position + body.total(frame)) for frame in frames]
        if body.size > 0:
            scales.append(style.nice_scale(style.SHOWN * body.size, max(travel)))
    return Landing(planes, origin, min(scales))


def _gap(plane: Plane, points: np.ndarray) -> float:
    """Return the smallest gap of points to a plane [m]; of points behind it, as a compressed layer has them, zero."""
    return max(float(plane.gap(points).min()), 0.0)
