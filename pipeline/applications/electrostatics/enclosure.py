"""Which conductors lie within solid ones that they do not touch."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from gudgeon.pipeline.applications.electrostatics.panels import Panels

POINTS = 8
"""Points of a conductor that are tried: parts of it may be apart."""
WITHIN = 0.5
"""Share of all directions in which the surface of a solid is seen from a point within: 1, but for gaps of facets."""


def seen(points: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Return the share of all directions in which facets are seen from points, negative from their front, (p,).

    The solid angle of a triangle by van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983).

    Args:
        points: (p, 3).
        facets: Corners, ordered as seen from outside, (f, 3, 3).
    """
    fractions = []
    for point in points:
        a, b, c = np.moveaxis(facets - point, 1, 0)
        x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        below = x * y * z + (a * b).sum(1) * z + (b * c).sum(1) * x + (c * a).sum(1) * y
        fractions.append(np.arctan2((a * np.cross(b, c)).sum(1), below).sum() / (2 * np.pi))
    return np.array(fractions)


def enclosed(
    panels: Mapping[str, Panels], filled: Collection[str], pairs: Sequence[tuple[str, str]]
) -> tuple[str, str] | None:
    """Return the first solid of some pairs with the conductor within it, None where there is none.

    Args:
        filled: Conductors that are solids; one may be within a closed sheet.
        pairs: Names of what may be outside, and within.
    """
    for outer, inner in pairs:
        if outer not in filled:
            continue
        around, middles = panels[outer].facets.reshape(-1, 3), panels[inner].facets.mean(axis=1)
        points = middles[np.unique(np.linspace(0, len(middles) - 1, POINTS).astype(int))]
        in_box = ((points > around.min(axis=0)) & (points < around.max(axis=0))).all(axis=1)
        if (seen(points[in_box], panels[outer].facets) > WITHIN).any():
            return outer, inner
    return None
