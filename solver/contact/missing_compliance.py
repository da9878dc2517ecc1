"""Refuses compliant contact where it has no compliance: of rigid bodies, at held points, or without R."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import sparse

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.shares import shared
from gudgeon.solver.errors import SceneError
from gudgeon.solver.methods import METHODS, RIGID_NEEDS
from gudgeon.solver.scene.scene import Scene

ROUND_OFF = 1e-8
"""Share of R in the total flexibility of a point below which R is round-off."""
HELD = 1e-12
"""Flexibility of a point over the largest one of its interface below which a support holds it."""


class Side(NamedTuple):
    """The c points of a contact on one of its bodies."""

    body: FlexibleBody
    interface: str
    share: sparse.csr_matrix
    """Of the record's points in each, (c, k)."""
    placed: np.ndarray
    """Points of the contact in the scene [m], (c, 3)."""

    def flexibility(self) -> np.ndarray:
        """Return the static flexibility of each point by elastic coordinates and R [m/N], (c,)."""
        rows = shared(self.share, self.body.modal.interfaces[self.interface].rows)
        residual = self.body.residual(self.interface, self.interface)
        whole = np.asarray(self.share.multiply(shared(self.share, residual)).sum(axis=1)).ravel()
        if len(self.body.modal.angular_frequencies):
            whole += (rows**2 / self.body.modal.angular_frequencies**2).sum(axis=1)
        return whole


def check_compliance(
    scene: Scene, name: str, sides: Sequence[Side], master: FlexibleBody | None, residual: np.ndarray, layer: np.ndarray
) -> None:
    """Raise a SceneError for a contact whose method needs compliance at a point that has none.

    Args:
        sides: The bodies with points, that of the contact first.
        master: The other body of the contact, if any.
        residual: R of each point, of both bodies [m/N], (c,).
        layer: Compliance of the surface at each point [m/N], (c,).
    """
    contact = scene.contact[name]
    if METHODS[contact.method].rigid or contact.smooth_law:
        return
    bodies = [sides[0].body, *([] if master is None else [master])]
    flexibilities = [side.flexibility() for side in sides]
    missing = np.flatnonzero((residual <= ROUND_OFF * sum(flexibilities)) & (layer <= 0))
    if not len(missing):
        return
    if all(body.modal.reduction == "rigid" for body in bodies):
        raise SceneError(f"contact.{name}.surface_stiffness: is missing; {RIGID_NEEDS}")
    for side, flexibility in zip(sides, flexibilities, strict=True):
        fixed = missing[flexibility[missing] <= HELD * flexibility.max()]
        if side.body.modal.reduction != "rigid" and len(fixed):
            raise SceneError(_held(scene, name, side, fixed))
    whole = len(missing) == len(residual)
    places = "" if whole else _points(scene, sides[0], missing)
    where = "all interface motion" if whole else f"all motion of {places}, as on the edge of a tie"
    way = "keep fewer shapes, use method 'constraint', or" if whole else "leave them out of the interface, or"
    raise SceneError(
        f"contact.{name}.method: '{contact.method}' needs residual flexibility, but the retained shapes already contain"
        f" {where} (R = 0); {way} set contact.{name}.surface_stiffness"
    )


def _held(scene: Scene, name: str, side: Side, fixed: np.ndarray) -> str:
    """Return the complaint about points that supports hold; `fixed` are their numbers."""
    return (
        f"contact.{name}: {_points(scene, side, fixed)}, cannot move because"
        f" component.{scene.component_of(side.body.name)}.supports hold them; method '{scene.contact[name].method}'"
        " needs points that can move: leave the supported edge out of the interface by its height, sector_deg or"
        f" another surface, or set contact.{name}.surface_stiffness"
    )


def _points(scene: Scene, side: Side, chosen: np.ndarray) -> str:
    """Return how many points of an interface there are by their numbers, and where the first is."""
    coordinates = ", ".join(f"{0.0 if abs(x) < 1e-12 else x:.4g}" for x in side.placed[chosen[0]])
    count = "1 point" if len(chosen) == 1 else f"{len(chosen)} points"
    interface = f"component.{scene.component_of(side.body.name)}.interface.{side.interface}"
    return f"{count} of {interface}, the first near ({coordinates}) m"
