"""Traction spaces on patches: height, rigid motions, surfaces that end anywhere, refusals."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.traction import chart_coordinates, height_grid, heights
from gudgeon.modaldb.records.types import Json
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.interfaces.traction_space import traction_space
from gudgeon.pipeline.scenes.interface import Interface

BEND = 4.0
"""Curvature of the top along x [1/m]; along y half of it, the other way."""


def covered(chart: Json, points: np.ndarray) -> np.ndarray:
    """Return which points (p, 3) are over cells with surface."""
    grid = height_grid(chart)
    at = np.floor((chart_coordinates(chart, points) - grid.start) / grid.spacing).astype(int)
    return np.asarray(chart["cover"]).reshape(grid.counts - 3)[at[:, 0], at[:, 1]] == 1


def raised(points: np.ndarray) -> np.ndarray:
    return 0.5 * BEND * points[:, 0] ** 2 - 0.25 * BEND * points[:, 1] ** 2


@pytest.fixture(scope="module")
def saddle() -> MeshRecord:
    """A box whose top is a saddle, on which all nodes are, and of whose true shape nothing is known."""
    mesh = Box(kind="box", lx=0.06, ly=0.05, lz=0.02).build(0.011)
    nodes = mesh.nodes.copy()
    nodes[:, 2] += raised(nodes)
    return replace(mesh, nodes=nodes, surfaces=mesh.surfaces | {"top": replace(mesh.surfaces["top"], shape={})})


def top(**given: Any) -> Interface:
    return Interface.model_validate(
        {"surface": "top", "kind": "traction", "spacing": 0.012, "along": [1, 1, 0]} | given
    )


def test_a_patch_has_the_height_of_its_nodes(saddle: MeshRecord) -> None:
    space = traction_space(saddle, top(), "here")
    chart = space.chart
    assert chart["kind"] == "patch"
    assert space.off < 1e-7
    inner = saddle.nodes[np.unique(saddle.surfaces["top"].facets)] * [0.7, 0.7, 1.0]
    inner[:, 2] = raised(inner) + 0.02
    found = heights(chart, chart_coordinates(chart, inner))
    np.testing.assert_allclose(found, (inner - chart["origin"]) @ chart["normal"], atol=2e-7)
    assert covered(chart, inner).all()


def test_rows_follow_rigid_motions_as_resultants_do(saddle: MeshRecord) -> None:
    space = traction_space(saddle, top(), "here")
    motion = np.array([0.3, -0.2, 1.0, 2.0, -1.0, 0.5])
    moved = motion[:3] + np.cross(motion[3:], saddle.nodes)
    np.testing.assert_allclose(space.weights @ moved.ravel(), space.resultant @ motion, rtol=1e-10, atol=1e-12)
    sizes = np.linalg.norm(space.resultant[:, :3], axis=1)
    # Normals differ below one function, which makes it less; one that the end cuts is continued to its centre.
    np.testing.assert_allclose(sizes, 1.0, rtol=0, atol=0.03)


def test_a_surface_may_end_anywhere(saddle: MeshRecord) -> None:
    """Facets of three quarters: functions beside it are counted, and move as those continue that have surface."""
    facets = saddle.surfaces["top"].facets
    x, y = saddle.nodes[facets][:, :3, :2].mean(axis=1).T
    near = (x < 0.0) | (y < 0.0)
    part = replace(saddle.surfaces["top"], facets=facets[near])
    mesh = replace(saddle, surfaces=saddle.surfaces | {"top": part})
    space = traction_space(mesh, top(spacing=0.005, along=[1, 0, 0]), "here")
    assert space.dropped > 0
    assert np.isfinite(space.weights.data).all()
    assert np.linalg.matrix_rank(space.weights.toarray(), tol=1e-9) == space.size - space.dropped
    places = np.array([[-0.01, -0.01, 0.02], [0.02, 0.017, 0.02]])
    np.testing.assert_array_equal(covered(space.chart, places), [True, False])


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"along": None}, r"here\.along: is missing; a traction space on a plane or a patch"),
        ({"along": [0, 0, 1]}, r"here\.along: \[0\.0, 0\.0, 1\.0\] given, it must be a direction on the surface"),
        ({"sector_deg": [0, 60]}, r"here\.sector_deg: is for cylinders, 'top' is a patch"),
        ({"surface": "skin"}, r"here: 'skin' turns by 1[78]\d degrees from its mean plane, at most 78"),
    ],
)
def test_what_is_no_patch(saddle: MeshRecord, given: dict[str, Any], words: str) -> None:
    whole = np.concatenate([one.facets for one in saddle.surfaces.values()])
    mesh = replace(saddle, surfaces=saddle.surfaces | {"skin": replace(saddle.surfaces["top"], facets=whole[:-3])})
    with pytest.raises(InputError, match=words):
        traction_space(mesh, top(**given), "here")
