"""What the points of a curved or tilted surface lack of a contact patch, at the moment of its largest force.

A patch of radius a over points h apart is known to half a spacing at its rim. The stiffness of the contact is
proportional to a (Hertz), so that its error is h/2a, and that of the force of an impact, proportional to the root of
the stiffness, is half of that. A flat face that presses as a whole has no such rim; one that is tilted presses with a
strip along its edge, whose half width is a: with one row of points, a surface layer has the area of that row alone.
"""

from collections.abc import Iterator

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.system.system import System

FLAT = 1e-6
"""Deviation of points from a plane, over their size, up to which they are those of a plane part."""
ROUNDED = 5e-5
"""Deviation of the gaps from those of a flat face, over its size, up to which it is flat: that of places of six digits,
as mesh files have them, on a face of a tenth of its part."""
FAR = 10.0
"""Gap over the size of the face beyond the least one of points that meet nothing, such as beside a smaller face."""
STRIP = 0.25
"""Share of the gaps of a tilted face up to which its points are those of a strip along its edge."""
PRESSED = 1e-3
"""Least force of a point that acts, over the largest one."""
SINGLE = 0.56
"""Radius of the patch of one point over the spacing: that of a circle of the same area."""


def patch_errors(system: System, trajectory: Trajectory) -> dict[str, tuple[int, float]]:
    """Return the number of points of each contact's patch on a curved surface, and the error of its force by them.

    So it does for a flat face of an elastic body that is tilted. Contacts by a law, of faces that press as a whole, of
    a single point, on a traction space, or that press on the rim of a part of their surface alone have none.
    """
    return {
        contact.name: (len(points), 0.25 / _radius(contact, points))
        for contact, points in _patches(system, trajectory)
        if _is_curved(contact, system.gap[contact.rows]) or _is_strip(system, contact, points)
    }


def _patches(system: System, trajectory: Trajectory) -> Iterator[tuple[ContactRows, np.ndarray]]:
    """Yield the contacts by points and the numbers of those that act at the moment of the largest force, (k,)."""
    for contact in system.contacts:
        forces = trajectory.contacts[contact.name].peak_multipliers
        if forces is None or len(contact.points) < 4 or contact.master is not None:
            continue
        forces = np.nan_to_num(forces)
        if system.scene.contact[contact.name].law is not None or not len(forces):
            continue
        hardest = forces[forces.sum(axis=1).argmax()]
        acting = np.flatnonzero(hardest > PRESSED * hardest.max(initial=0.0))
        if len(acting) and not contact.edge[acting].all():
            yield contact, acting


def _is_curved(contact: ContactRows, gaps: np.ndarray) -> bool:
    """Return whether gaps (c,) are not those of a flat face, or its points do not lie in one."""
    facing = _near(contact, gaps)
    if not facing.any():
        return False
    centred = contact.points[facing] - contact.points[facing].mean(axis=0)
    linear = np.column_stack([np.ones(len(centred)), centred])
    residual = gaps[facing] - linear @ np.linalg.lstsq(linear, gaps[facing], rcond=None)[0]
    # A sphere's gap to a plane is linear in its own points: they leave the plane through them.
    extents = np.linalg.svd(centred, compute_uv=False) / np.sqrt(len(centred))
    out = extents[1 if _is_line(contact) else -1]
    return max(float(np.abs(residual).max()), float(out)) > ROUNDED * float(np.ptp(centred, axis=0).max())


def _near(contact: ContactRows, gaps: np.ndarray) -> np.ndarray:
    """Return which points meet the obstacle, those beside a smaller face left out, (c,)."""
    finite = np.isfinite(gaps)
    minimum = gaps[finite].min(initial=np.inf)
    return finite & (gaps <= minimum + FAR * float(np.ptp(contact.points, axis=0).max()))


def _is_strip(system: System, contact: ContactRows, acting: np.ndarray) -> bool:
    """Return whether the points that act are those of least gap on a tilted face of an elastic body."""
    gaps = system.gap[contact.rows]
    face_gaps = gaps[_near(contact, gaps)]
    if not len(face_gaps):
        return False
    size, span = float(np.ptp(contact.points, axis=0).max()), float(np.ptp(face_gaps))
    if span <= ROUNDED * size or float(gaps[acting].max() - face_gaps.min()) > STRIP * span:
        return False
    sides = [side.body for side in (contact, contact.other) if side is not None]
    return any((system.stiffness[system.bodies[body].elastic] > 0).any() for body in sides)


def _is_line(contact: ContactRows) -> bool:
    """Return whether the points are those of a plane part: in one plane, with the direction of the force."""
    centred = contact.points - contact.points.mean(axis=0)
    _, extents, axes = np.linalg.svd(centred, full_matrices=False)
    return bool(extents[-1] <= FLAT * extents[0] and abs(float(axes[-1] @ contact.directions.mean(axis=0))) < FLAT)


def _radius(contact: ContactRows, acting: np.ndarray) -> float:
    """Return the least half width of a patch, over the spacing of its points."""
    from scipy.spatial import cKDTree  # Late: it takes longer to load than a small run.

    spacing = float(np.median(cKDTree(contact.points).query(contact.points[acting], k=2)[0][:, 1]))
    across = contact.points[acting] - contact.points[acting].mean(axis=0)
    normal = contact.directions[acting].mean(axis=0)
    across -= np.outer(across @ normal, normal) / float(normal @ normal)
    widths = 2 * np.linalg.svd(across, compute_uv=False) / np.sqrt(len(acting))
    width = widths[0] if _is_line(contact) or len(widths) < 2 else widths[1]
    return max(float(width) / spacing, SINGLE)
