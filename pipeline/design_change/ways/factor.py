"""The way `factor`: one block step with a factor of the body's own, which gives the flexibility of its rows exactly."""

import numpy as np

from gudgeon.pipeline.design_change.projection import Projection
from gudgeon.pipeline.design_change.ways.answer import Answer, Search
from gudgeon.pipeline.modes.flexibility import Flexibility


def refactored(search: Search) -> Answer | None:
    """Return a body in the basis of what the last step found, what its residuals displace, and its static responses."""
    target, step = search.target, search.step
    if step is None:
        return None
    model, flexibility = target.model, Flexibility(target.model, target.B)

    def displaced(forces: np.ndarray) -> np.ndarray:
        displacements = np.zeros(forces.shape)
        displacements[model.free] = flexibility.displaced(forces[model.free])
        return target.elastic(displacements)

    residuals = model.K @ step.vectors - (model.M @ step.vectors) * step.values
    loads = target.B.T @ np.column_stack([target.pressures, target.loads])
    added = displaced(target.balanced(np.column_stack([residuals, loads, target.weights])))
    projection = Projection(target, np.column_stack([step.vectors, added]))
    return Answer(projection, flexibility.of_rows(target.B), step.direction, displaced)
