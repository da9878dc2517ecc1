"""The way `project`: the displacements of stored designs as the basis of another."""

from gudgeon.pipeline.design_change.ways.answer import Answer, Search


def projected(search: Search) -> Answer:
    """Return a body in the basis of a family.

    Displacements outside the basis have the flexibility that they have in the stored designs.
    """
    projection = search.projection
    return Answer(projection, projection.flexibility + search.family.remainder(projection))
