"""Contacts whose forces neither statics nor inertia determines: rigid points at more places than their bodies move."""

import numpy as np
from scipy import linalg

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.system.system import System

CLOSED = 1e-9
"""Gap below which a rigid point touches, over the extent of all points."""
DEPENDENT = 1e-9
"""Singular value of the closed rows, over the largest, below which forces along them balance each other."""
PART = 1e-6
"""Part of a contact in forces that balance each other below which it is round-off."""


def undetermined_notes(system: System, trajectory: Trajectory) -> list[str]:
    """Return a sentence if rigid contacts touch at once whose resultants are not determined, with their names.

    Forces λ with Wᵀ λ = 0, W the rows of the closed points over all coordinates, do not move anything: any multiple of
    them may be added, as long as all points press. The sum of all forces and moments is determined.
    """
    rigid = np.flatnonzero(system.rigid_contact)
    if system.scene.capabilities.turns or len(rigid) < 2 or not len(trajectory.frames):
        return []
    points = np.concatenate([contact.points for contact in system.contacts])
    closed_gap = CLOSED * float(np.ptp(points, axis=0).max())
    W, gaps = system.rows[rigid], system.gap[rigid]
    states = system.of_records(trajectory.frames)
    multipliers = np.hstack([trajectory.contacts[c.name].multipliers for c in system.contacts])[:, rigid]
    closed = (gaps + states @ W.T <= closed_gap) | (multipliers > 0)
    loose = set[str]()
    for pattern in np.unique(closed[(multipliers > 0).any(axis=1)], axis=0):
        null_space = linalg.null_space(W[pattern].T, rcond=DEPENDENT)
        if null_space.size:
            loose |= _sharing(system, rigid[pattern], null_space)
    if not loose:
        return []
    names = [contact.name for contact in system.contacts if contact.name in loose]
    return [
        f"contact.{', contact.'.join(names)}: their rigid points touch at once, at more places than their bodies move:"
        f" statics does not determine how the {len(names)} contacts share their force, and what is given for each is"
        " one of many; their sum is right. Give them flexibility: surface_stiffness, or elastic bodies"
    ]


def _sharing(system: System, rows: np.ndarray, null_space: np.ndarray) -> set[str]:
    """Return the contacts whose resultant changes by forces that move nothing, (n, k) at some rows (n,)."""
    names, contact_of = set[str](), system.contact_of[rows]
    for i, contact in enumerate(system.contacts):
        of_contact = contact_of == i
        resultants = system.directions[rows[of_contact]].T @ null_space[of_contact]
        if np.abs(resultants).max(initial=0.0) > PART:
            names.add(contact.name)
    return names
