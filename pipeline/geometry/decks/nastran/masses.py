"""Masses of bulk data of Nastran: CONM1 and CONM2, times WTMASS."""

from collections.abc import Mapping, Sequence

import numpy as np

from gudgeon.pipeline.geometry.decks.model import PointMass
from gudgeon.pipeline.geometry.decks.nastran.bulk import Card
from gudgeon.pipeline.geometry.decks.nastran.grids import Grids

TRIANGLE = [(i, j) for i in range(6) for j in range(i + 1)]
"""Entries of a CONM1, row by row."""
SAME = 1e-6
"""Relative difference of entries of a mass matrix that is none."""


def mass_factor(by_name: Mapping[str, Sequence[Card]]) -> float:
    """Return the factor on all masses of a deck, of PARAM WTMASS."""
    scales = [card.real(1) for card in by_name.get("PARAM", []) if card.text(0).upper() == "WTMASS"]
    return scales[-1] if scales else 1.0


def read_masses(by_name: Mapping[str, Sequence[Card]], grids: Grids) -> list[PointMass]:
    """Return the point masses of a deck; not among them are those whose directions differ.

    Raises:
        InputError: a field is wrong, or a system is not there.
    """
    factor = mass_factor(by_name)
    masses = [_conm2(card, grids, factor) for card in by_name.get("CONM2", [])]
    matrices = [_conm1(card, grids, factor) for card in by_name.get("CONM1", [])]
    return masses + [mass for mass in matrices if mass is not None]


def _conm2(card: Card, grids: Grids, factor: float) -> PointMass:
    """Return a mass with offset and inertia, both in the directions of a system at the grid point."""
    node, system = card.integer(1), card.integer(2, 0)
    offset = np.array([card.real(k) for k in (4, 5, 6)])
    xx, xy, yy, xz, yz, zz = (card.real(k) for k in (8, 9, 10, 11, 12, 13))
    inertia = np.array([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]])
    position = grids.position(node, card.source)
    if system < 0:  # Its centre is given in the basic system.
        offset = offset - position
    elif offset.any() or inertia.any():
        axes = grids.axes_at(system, position, card.source)
        offset, inertia = axes @ offset, axes @ inertia @ axes.T
    return _mass(card, node, factor * card.real(3), offset, factor * inertia)


def _conm1(card: Card, grids: Grids, factor: float) -> PointMass | None:
    """Return the mass of a matrix of six by six; None of one that differs by direction."""
    node = card.integer(1)
    M = np.zeros((6, 6))
    for k, (i, j) in enumerate(TRIANGLE):
        M[i, j] = M[j, i] = card.real(3 + k)
    axes = grids.axes_at(card.integer(2, 0), grids.position(node, card.source), card.source)
    mass, first_moment = M[0, 0], M[3:, :3]
    uneven = np.abs(M[:3, :3] - mass * np.eye(3)).max(initial=0.0)
    skew = np.abs(first_moment + first_moment.T).max()
    if max(uneven, skew) > SAME * np.abs(M).max(initial=0.0) or (not mass and first_moment.any()):
        return None
    offset = np.array([first_moment[2, 1], first_moment[0, 2], first_moment[1, 0]]) / (mass or 1.0)
    arm = (offset @ offset) * np.eye(3) - np.outer(offset, offset)
    inertia = axes @ (M[3:, 3:] - mass * arm) @ axes.T
    inertia[np.abs(inertia) < SAME * np.abs(M[3:, 3:]).max(initial=0.0)] = 0.0
    return _mass(card, node, factor * mass, axes @ offset, factor * inertia)


def _mass(card: Card, node: int, mass: float, offset: np.ndarray, inertia: np.ndarray) -> PointMass:
    x, y, z = offset.tolist()
    return PointMass(node, mass, card.name, card.source, (x, y, z), tuple(inertia.ravel().tolist()))
