"""The way `project`: the displacements of stored designs as the basis of another."""

import numpy as np

from gudgeon.pipeline.design_change.family import Family
from gudgeon.pipeline.design_change.projection import Projection, Target


def projected(target: Target, family: Family) -> tuple[Projection, np.ndarray]:
    """Return a body in the basis of a family, and its flexibility [m/N], (c, c).

    Displacements outside the basis have the flexibility that they have in the stored designs.
    """
    projection = Projection(target, family.basis)
    return projection, projection.flexibility + family.remainder(projection)
