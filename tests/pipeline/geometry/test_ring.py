"""Plane rings: places of nodes on true circles, area, and what is refused."""

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.shapes.ring import Ring


def ring(**changes: object) -> Ring:
    return Ring.model_validate(
        {"kind": "ring", "inner_radius": 0.01, "outer_radius": 0.02, "thickness": 0.02} | changes
    )


@pytest.mark.parametrize(("size", "around"), [(1e-3, 63), (0.35e-3, 180), (0.05, 12)])
def test_nodes_lie_on_both_circles(size: float, around: int) -> None:
    mesh = ring().build(size)
    radii = np.linalg.norm(mesh.nodes[:, :2], axis=1)
    for name, radius in (("inner", 0.01), ("outer", 0.02)):
        facets = mesh.surfaces[name].facets
        assert len(facets) == around
        np.testing.assert_allclose(radii[np.unique(facets)], radius, rtol=1e-12)
    assert np.unique(mesh.cells).size == len(mesh.nodes)


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e4])
def test_its_area_converges_to_that_of_the_ring(scale: float) -> None:
    """Edges are curved: half the size leaves less than a tenth of the error."""
    one = ring(inner_radius=0.01 * scale, outer_radius=0.02 * scale)
    errors = []
    for size in (2e-3, 1e-3):
        mesh = one.build(size * scale)
        errors.append(abs(area(mesh.nodes, mesh.cells) / (np.pi * 3e-4 * scale**2) - 1))
    assert errors[0] < 1e-4
    assert errors[1] < errors[0] / 10


def area(nodes: np.ndarray, cells: np.ndarray) -> float:
    """Return the area of triangles of six nodes by a rule of degree 2, exact for their Jacobians."""
    total = 0.0
    for x, y in ((1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3)):
        z = 1 - x - y
        by_x = np.array([1 - 4 * z, 4 * x - 1, 0.0, 4 * (z - x), 4 * y, -4 * y])
        by_y = np.array([1 - 4 * z, 0.0, 4 * y - 1, -4 * x, 4 * x, 4 * (z - y)])
        a, b = (np.einsum("k,fkd->fd", one, nodes[cells][:, :, :2]) for one in (by_x, by_y))
        total += float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()) / 6
    return total


def test_what_is_no_ring_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"outer_radius: 0\.01 m is not above inner_radius"):
        ring(outer_radius=0.01)
    with pytest.raises(InputError, match=r"mesh\.size"):
        ring().build(1e-8)
