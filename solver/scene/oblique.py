"""Interfaces that are pressed at a slant: whose obstacle does not face them along an axis of their body.

Faces of parts lie across their axes as a rule, and contact acts along their normals. A body that is turned before a
plane, a bore or another body is pressed along another direction, within which it may be much softer: the rows of such
interfaces are those along the obstacle's direction, for which modes have tangential rows.
"""

import numpy as np

from gudgeon.solver.obstacles import Plane
from gudgeon.solver.obstacles.bore import Bore
from gudgeon.solver.scene.contact import MasterSurface, OtherBody
from gudgeon.solver.scene.scene import Scene

STRAIGHT = 1e-6
"""Largest component across an axis of a direction that lies along it."""


def oblique(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Return the interfaces of contact points of each body that may be pressed at a slant; none where bodies turn."""
    slanting: dict[str, list[str]] = {body: [] for body in scene.body}
    for contact in scene.contact.values() if not scene.capabilities.turns else ():
        against, Q = contact.against, _axes(scene, contact.body)
        if isinstance(against, OtherBody | MasterSurface):
            if not _straight(_axes(scene, against.body).T @ Q):
                slanting[contact.body].append(contact.interface)
                if isinstance(against, OtherBody):
                    slanting[against.body].append(against.interface)
        elif isinstance(against, Plane | Bore):
            along = np.asarray(against.normal if isinstance(against, Plane) else against.axis, float)
            if not _straight(Q.T @ along[:, None] / np.linalg.norm(along)):
                slanting[contact.body].append(contact.interface)
    electrodes = {electrode.interface for electrode in scene.electrodes().values()}
    return {body: tuple(f for f in dict.fromkeys(names) if f not in electrodes) for body, names in slanting.items()}


def _axes(scene: Scene, body: str) -> np.ndarray:
    """Return the axes of a body's component in the scene, in columns, (3, 3)."""
    orientation = scene.body[body].orientation
    return np.eye(3) if orientation is None else orientation.matrix()


def _straight(columns: np.ndarray) -> bool:
    """Return whether unit vectors, in columns, (3, k), lie along coordinate axes."""
    return bool((np.sort(np.abs(columns), axis=0)[:-1] < STRAIGHT).all())
