"""Points of one body that press on the surface of another, both of which turn, or on the ground: arrays.

The surface is a height over a plane of its body, h = H(s, t), or that plane. In its frame a point is at (s, t, h), and
its gap is

    g = c (h − H) − N·e + Σ_j C_ij λ_j,   c = 1/√(1 + |∇H|²),

to second order its distance; e are the outward displacements of the functions of the traction space and N their values
at (s, t). The force on the point is λ ∇g, on the other body its opposite at the same place, on the modes of both
λ ∂g/∂q, so that momenta and energy are kept whatever the shapes; the slope of N·e is in it. C is the layer, R of the
points, N R Nᵀ of the functions, and where points and functions are on one body what R couples of them,
Nᵢ·Rⱼ + Nⱼ·Rᵢ; points that press have g = 0, which is linear in their forces. A body meets itself in the same way: the
surface and the points then turn together.

Planes and bores of the ground are surfaces without functions, whose gap is h, or the radius less the distance from the
axis, whatever side of the body faces them. R then acts along m = Qᵀ ∇g in the axes of the body, and not along the
normals of points: C_ij = mᵢᵀ R_ij mⱼ changes as the body turns. With u_i = Σ R_ij mⱼ λⱼ, how the point moves by it, the
energy ½ λᵀ C λ makes the force λ (∇g + ∇∇g Q u) and, beside its moment about the centre, Q u × λ ∇g: those on the
point where it is.
"""

from typing import NamedTuple

import numpy as np


class Surfaces(NamedTuple):
    """Pairs of an interface of points and a surface. Shapes: S pairs, P points, F functions, E elastic coordinates."""

    owner: np.ndarray
    """Bodies of points and surface, the latter −1 where it is of the ground, (S, 2)."""
    points: np.ndarray
    """First and last + 1 point, (S, 2)."""
    functions: np.ndarray
    """First and last + 1 function, (S, 2)."""
    arm: np.ndarray
    """Points from the centre of their undeformed body, along its axes [m], (P, 3)."""
    rows: np.ndarray
    """Their displacement per elastic coordinate, (P, 3, E)."""
    normal: np.ndarray
    """Their outward normals along its axes, (P, 3)."""
    layer: np.ndarray
    """[m/N], (P,)."""
    residual: np.ndarray
    """R of the points along the axes of their body [m/N], (P, P, 3, 3)."""
    by_law: np.ndarray
    """Whether the points of a pair press by a law, not by flexibilities, (S,)."""
    origin: np.ndarray
    """Of the plane, from the centre of its body; of the ground from the origin of the scene [m], (S, 3)."""
    axes: np.ndarray
    """Across, along and the outward normal as rows, in its body, (S, 3, 3); of a bore the last one is its axis."""
    radius: np.ndarray
    """Of a bore of the ground; 0 of all else [m], (S,)."""
    low: np.ndarray
    """Least coordinates of the height [m], (S, 2)."""
    step: np.ndarray
    """Between its knots [m], (S, 2)."""
    cells: np.ndarray
    """How many across and along, then where its heights and its cover begin, (S, 4)."""
    heights: np.ndarray
    """[m]"""
    cover: np.ndarray
    """Whether a cell has surface."""
    start: np.ndarray
    """Least coordinates of the traction space [m], (S, 2)."""
    spacing: np.ndarray
    """[m], (S, 2)"""
    counts: np.ndarray
    """Functions across and along, (S, 2)."""
    outward: np.ndarray
    """Outward displacement of functions per elastic coordinate, (F, E)."""
    compliance: np.ndarray
    """R of the functions [m/N], (F, F)."""
    mixed: np.ndarray
    """Displacement of points along the axes of their body by outward forces on functions of the same [m/N], (P, 3, F);
    (0, 3, F) where no body has both."""
    balls: np.ndarray
    """Centre in the body and radius of the points, then of the surface [m], (S, 2, 4)."""
    deep: np.ndarray
    """Depth below which a point is on the other side of the body [m], (S,)."""


SURFACES = {
    "owner": (0, 2), "points": (0, 2), "functions": (0, 2), "arm": (0, 3), "rows": (0, 3, 0), "normal": (0, 3),
    "layer": (0,), "residual": (0, 0, 3, 3), "by_law": (0,), "origin": (0, 3), "axes": (0, 3, 3), "radius": (0,),
    "low": (0, 2), "step": (0, 2), "cells": (0, 4), "heights": (0,), "cover": (0,), "start": (0, 2), "spacing": (0, 2),
    "counts": (0, 2), "outward": (0, 0), "compliance": (0, 0), "mixed": (0, 3, 0), "balls": (0, 2, 4), "deep": (0,),
}  # fmt: skip
WHOLE = ("owner", "points", "functions", "by_law", "cells", "cover", "counts")
"""Arrays of whole numbers."""


def no_surfaces(elastic: int) -> Surfaces:
    """Return arrays without pairs.

    Args:
        elastic: E.
    """
    shapes = SURFACES | {"rows": (0, 3, elastic), "outward": (0, elastic)}
    return Surfaces(**{name: np.zeros(shape, np.int64 if name in WHOLE else float) for name, shape in shapes.items()})
