"""The obstacle of a contact as a surface to draw beside a solid body."""

import numpy as np
import pyvista as pv

from gudgeon.pipeline.plots.base import view
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.base.surface import Skin, make_skin
from gudgeon.solver.obstacles import Plane

WALL = "#dfe5ea"
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
    if surface is None or obstacle is None or body.mesh.cell_type != "tetra10":
        return None
    wall = make_skin(body.nodes, surface.facets, triangles, {})
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
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    tangents = np.stack([first / np.linalg.norm(first), np.cross(normal, first) / np.linalg.norm(first)])
    margin = MARGIN * float(np.linalg.norm(np.ptp(nodes, axis=0)))
    low, high = (nodes @ tangents.T).min(axis=0) - margin, (nodes @ tangents.T).max(axis=0) + margin
    corners = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
    return pv.PolyData(corners @ tangents + ((point + shift) @ normal) * normal, faces=[4, 0, 1, 2, 3])
