"""The obstacle of a contact as a surface to draw beside a solid body."""

import numpy as np
import pyvista as pv

from gudgeon.pipeline.geometry.cells import FACETS, blocks_of, cell_of
from gudgeon.pipeline.plots.base import view
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.base.surface import Skin, make_skin
from gudgeon.solver.obstacles import Plane
from gudgeon.solver.vectors import unit

WALL = "#dfe5ea"
FACE = "#9fb0bd"
"""Of faces that are drawn as they are, seen through."""
MARGIN = 0.12
"""How far a plane is drawn beyond a body, of the diagonal of the body."""


def opposite(drawing: Drawing, contact: str, triangles: int, gaps: float) -> Skin | None:
    """Return the obstacle opposite the contact surface of a solid, in the scene, gaps g times s: x − (s g ∇g)(x) [m].

    None where the other side is a body's points, or the interface has no surface.

    Args:
        triangles: Target number of flat triangles.
        gaps: s; 1 for the obstacle where it is.
    """
    body, obstacle = drawing.body(drawing.trajectory.contacts[contact].body), view.obstacle_at(drawing, contact)
    surface = body.surface(drawing.trajectory.contacts[contact].interface)
    if surface is None or obstacle is None or not cell_of(body.mesh).solid:
        return None
    wall = make_skin(body.nodes, blocks_of(surface.facets, FACETS), triangles, {})
    placed = wall.points + drawing.position(body.name)
    wall.move(placed - gaps * obstacle.gap(placed)[:, None] * obstacle.direction(placed))
    return wall


def touching(
    drawing: Drawing, contact: str, nodes: np.ndarray, point: np.ndarray, shift: np.ndarray, triangles: int
) -> pv.PolyData | None:
    """Return a fixed obstacle where it touches the drawn body, in the body's coordinates; None if there is none.

    A plane goes through the point of contact and reaches beyond the body; of another shape the part opposite the
    contact surface is drawn.

    Args:
        nodes: Of the body [m], (n, 3).
        point: Of the contact force on the undeformed body [m], (3,).
        shift: Drawn displacement there along the obstacle's normal [m], (3,).
    """
    if drawing.scene["contact"][contact]["against"]["shape"] in ("body", "surface"):
        return None
    obstacle, position = view.obstacle_at(drawing, contact), drawing.position(drawing.trajectory.contacts[contact].body)
    if not isinstance(obstacle, Plane):
        wall = opposite(drawing, contact, triangles, 1.0)
        if wall is not None:
            wall.move(wall.points - position + shift)
        return None if wall is None else wall.surface
    normal = obstacle.direction(point[None])[0]
    tangents = _tangents(normal)
    margin = MARGIN * float(np.linalg.norm(np.ptp(nodes, axis=0)))
    low, high = (nodes @ tangents.T).min(axis=0) - margin, (nodes @ tangents.T).max(axis=0) + margin
    corners = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
    return pv.PolyData(corners @ tangents + ((point + shift) @ normal) * normal, faces=[4, 0, 1, 2, 3])


def planes_of(drawing: Drawing, acting: bool = False) -> dict[str, list[Plane]]:
    """Return the planes that contacts of a scene meet, by body; with `acting` only those that ever press."""
    planes: dict[str, list[Plane]] = {}
    for name, contact in drawing.scene.get("contact", {}).items():
        if contact["against"]["shape"] == "plane" and (not acting or drawing.trajectory.contacts[name].force.any()):
            planes.setdefault(contact["body"], []).append(Plane.model_validate(contact["against"]))
    return planes


def faces(planes: list[Plane], seen: np.ndarray) -> list[pv.PolyData]:
    """Return planes as polygons around points, (n, 3), of which they are no farther than their extent; faces of solids
    end at their edges."""
    polygons = []
    middle, radius = 0.5 * (seen.min(axis=0) + seen.max(axis=0)), 0.5 * float(np.ptp(seen, axis=0).max())
    for plane in planes:
        tangents, normal = _tangents(plane.normal), unit(plane.normal)
        centre = middle - float(plane.gap(middle[None])[0]) * normal
        corners = [centre + radius * np.array(pair) @ tangents for pair in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        for edge in plane.edges:
            corners = _clipped(corners, np.asarray(edge.point), unit(edge.normal))
        if len(corners) > 2 and float(np.linalg.norm(np.mean(corners, axis=0) - middle)) < 2 * radius:
            polygons.append(pv.PolyData(np.array(corners), faces=[len(corners), *range(len(corners))]))
    return polygons


def _tangents(vector: tuple[float, ...] | np.ndarray) -> np.ndarray:
    """Return two directions across a vector and each other, (2, 3)."""
    normal = unit(vector)
    across = unit(np.cross(normal, np.eye(3)[np.abs(normal).argmin()]))
    return np.stack([across, np.cross(normal, across)])


def _clipped(corners: list[np.ndarray], point: np.ndarray, normal: np.ndarray) -> list[np.ndarray]:
    """Return the part of a convex polygon behind a plane (Sutherland and Hodgman)."""
    clipped = []
    for start, stop in zip(corners, corners[1:] + corners[:1], strict=True):
        a, b = float((start - point) @ normal), float((stop - point) @ normal)
        if a <= 0:
            clipped.append(start)
        if a * b < 0:
            clipped.append(start + a / (a - b) * (stop - start))
    return clipped
