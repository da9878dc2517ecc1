"""Panels of conductors: edges and corners found, areas kept, strips graded, coarse panels made of fine ones."""

import numpy as np
import pytest

from gudgeon.pipeline.applications.electrostatics.conductors import skin_of
from gudgeon.pipeline.applications.electrostatics.edges import features
from gudgeon.pipeline.applications.electrostatics.panels import Grading, Skin, joined, panels_of
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.geometry.shapes.cylinder import Cylinder
from gudgeon.pipeline.geometry.shapes.plane import Rectangle
from gudgeon.pipeline.geometry.shapes.sphere import Sphere


@pytest.fixture(scope="module")
def box() -> Skin:
    return skin_of(Box(kind="box", lx=1.0, ly=1.0, lz=1.0).build(0.6), (), "conductor.box")


def test_a_box_has_twelve_edges_and_eight_corners(box: Skin) -> None:
    found = features(box.nodes, box.facets)
    ends = box.nodes[box.facets[:, :3]]
    lengths = np.linalg.norm(ends - np.roll(ends, -1, axis=1), axis=2)
    assert lengths[found.sides].sum() / 2 == pytest.approx(12.0)
    assert len(np.unique(box.facets[:, :3][found.at_corner])) == 8
    assert found.open_sides == 0


def test_a_sphere_has_no_edge() -> None:
    skin = skin_of(Sphere(kind="sphere", radius=1.0).build(0.8), (), "conductor.ball")
    found = features(skin.nodes, skin.facets)
    assert not found.sides.any()
    assert found.open_sides == 0


def test_the_rim_of_a_disc_is_an_edge_without_corner() -> None:
    skin = skin_of(Cylinder(kind="cylinder", radius=1.0, length=1.0).build(0.8), ("top",), "conductor.disc")
    found = features(skin.nodes, skin.facets)
    assert found.open_sides == found.sides.sum() > 5
    assert not found.at_corner.any()
    assert found.on_edge.any()


@pytest.mark.parametrize("strips", [1, 2, 5])
def test_strips_keep_the_area_and_grow_from_the_edge(box: Skin, strips: int) -> None:
    grading = Grading(strips, 4.0, 3)
    panels = panels_of(box, grading)
    group = panels.group()
    assert group.areas.sum() == pytest.approx(6.0)
    # Of each panel, the distance of its centre from the nearest edge: the narrowest is that of the first strip.
    away = np.sort(np.abs(np.abs(group.centres - [0, 0, 0.5]) - 0.5), axis=1)[:, 1]
    assert away.min() < (1 / (2 * strips)) ** 4 * 0.6
    assert np.all(np.bincount(panels.coarse) == 4)
    assert np.all(np.diff(panels.coarse) >= 0)
    assert np.all(np.diff(panels.panel) >= 0)


def test_coarse_panels_are_those_of_half_the_strips(box: Skin) -> None:
    """A coarse strip ends where a strip ends: (k/m)^β = (2k/2m)^β."""
    fine, half = panels_of(box, Grading(4, 3.0, 2)), panels_of(box, Grading(2, 3.0, 2))
    coarse = np.sort(np.bincount(fine.coarse, fine.group().areas))
    merged = half.group().areas.reshape(-1, 2).sum(axis=1)  # Its halves along the edge.
    assert np.isin(np.round(coarse, 9), np.round(merged, 9)).sum() > 0.6 * len(coarse)


def test_panels_of_a_known_sphere_lie_about_it() -> None:
    """The mean distance of each facet from the sphere is far below the rise of the sphere over it."""
    mesh = Sphere(kind="sphere", radius=1.0).build(0.6)
    panels = panels_of(skin_of(mesh, (), "conductor.ball"), Grading())
    middles = 0.5 * (panels.facets + np.roll(panels.facets, -1, axis=1))
    mean = np.linalg.norm(middles, axis=2).mean(axis=1) - 1
    rise = np.linalg.norm(panels.facets, axis=2).max() - np.linalg.norm(panels.facets.mean(axis=1), axis=1).min()
    assert 1e-3 < rise < 1e-2
    assert abs(mean).max() < 0.02 * rise
    assert panels.deviation.max() < 1e-3


def test_an_unknown_surface_has_a_deviation() -> None:
    mesh = Sphere(kind="sphere", radius=1.0).build(0.6)
    skin = skin_of(mesh, (), "conductor.ball")
    known = panels_of(skin, Grading())
    unknown = panels_of(Skin(skin.nodes, skin.facets), Grading())
    assert unknown.deviation.mean() > 1.5 * known.deviation.mean() > 0


def test_groups_are_joined_in_order(box: Skin) -> None:
    one = panels_of(box, Grading(1))
    both = joined([one, panels_of(box, Grading(1), 1)])
    assert len(both) == 2 * len(one)
    assert both.panel[len(one.facets)] == len(one)
    assert both.coarse[len(one)] == one.coarse[-1] + 1
    assert both.conductor.tolist() == [0] * len(one) + [1] * len(one)


def test_a_plane_part_is_a_sheet() -> None:
    mesh = Rectangle(kind="rectangle", lx=2.0, ly=1.0, thickness=1e-3).build(0.5)
    skin = skin_of(mesh, (), "conductor.sheet")
    assert features(skin.nodes, skin.facets).open_sides > 0
    assert panels_of(skin, Grading(1)).group().areas.sum() == pytest.approx(2.0)


def test_a_line_has_no_surface() -> None:
    mesh = Bar(kind="bar", length=1.0, area=1e-4).build(0.1)
    with pytest.raises(InputError, match=r"conductor.wire.geometry: a mesh of cells 'line3' has no surface"):
        skin_of(mesh, (), "conductor.wire")
    with pytest.raises(InputError, match=r"conductor.box.surfaces: the mesh has no surface 'lid', it has"):
        skin_of(Box(kind="box", lx=1.0, ly=1.0, lz=1.0).build(0.9), ("lid",), "conductor.box")
