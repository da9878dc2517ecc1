"""Scales and directions in pictures: the unrolled contact, the coordinate axes, the obstacle, times of forces."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pyvista")

from matplotlib.figure import Figure
from matplotlib.text import Annotation
from matplotlib.tri import Triangulation

from gudgeon.modaldb.records.mesh import Surface
from gudgeon.pipeline.plots.base import view
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.force_axes import force_axes, middles
from gudgeon.pipeline.plots.contact.maps import chart, on_an_edge, raster
from gudgeon.pipeline.plots.contact.pressure import colours, panels_of
from gudgeon.pipeline.plots.deformation.obstacle import touching
from gudgeon.pipeline.plots.deformation.solid import strongest_moment
from tests.pipeline.plots.runs import solved
from tests.pipeline.small import block_on_floor

X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def drawing(tmp_path_factory: pytest.TempPathFactory) -> Drawing:
    """The run of a block that falls on a floor."""
    folder = tmp_path_factory.mktemp("block")
    return solved(folder, "block", block_on_floor()).drawing(folder)


def test_lengths_along_both_axes_of_the_pressure_have_one_scale() -> None:
    """A patch of a cylinder, 60 mm around by 20 mm along: its map is three times as wide as high on the page."""
    radius = 0.05
    angle, height = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 0.06 / radius, 7), np.linspace(0, 0.02, 5)))
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    shape = {"kind": "cylinder", "axis": [0.0, 0.0, 1.0], "origin": [0.0, 0.0, 0.0], "radius": radius}
    plane = chart(points, Surface(np.zeros((0, 6), int), shape))
    assert plane is not None
    figure, (axes,) = panels_of("", [(raster(plane, 100), np.ones(len(points)), "")])
    figure.canvas.draw()
    box = axes.get_window_extent()
    assert box.width / box.height == pytest.approx(3.0, rel=0.01)


def test_a_hole_of_a_plane_surface_has_no_pressure() -> None:
    """A square of 6 by 6 cells with a hole of 2 by 2; contact points are the middles of edges."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(7.0), np.arange(7.0)))
    corners, facets = np.column_stack([x, y, np.full(49, 0.3)]), []
    for i in range(6):
        for j in range(6):
            if not (2 <= i < 4 and 2 <= j < 4):
                a = 7 * j + i
                facets += [(a, a + 1, a + 8), (a, a + 8, a + 7)]
    sides = np.array([sorted(pair) for f in facets for pair in ((f[0], f[1]), (f[1], f[2]), (f[2], f[0]))])
    edges, number = np.unique(sides, axis=0, return_inverse=True)
    points = corners[edges].mean(axis=1)
    quadratic = np.column_stack([facets, 49 + number.reshape(-1, 3)])
    plane = chart(points, Surface(quadratic), np.concatenate([corners, points]))
    assert plane is not None
    drawn = Triangulation(plane.metric[:, 0], plane.metric[:, 1])
    holes = plane.in_holes(drawn.triangles)
    middles = points[drawn.triangles].mean(axis=1)
    inside = (np.abs(middles[:, :2] - 3.0) < 1.0 - 1e-9).all(axis=1)
    assert inside.any()
    np.testing.assert_array_equal(holes, inside)
    curved = chart(points + np.column_stack([0 * points[:, :2], 0.1 * points[:, 0] ** 2]), Surface(quadratic), corners)
    assert curved is not None
    assert not curved.in_holes(drawn.triangles).any()


def test_the_largest_pressure_is_not_black() -> None:
    red, green, blue, _ = colours()(1.0)
    assert 0.3 * red + 0.6 * green + 0.1 * blue > 0.1
    assert blue > 0.3


def test_the_triad_shows_the_directions_of_the_camera() -> None:
    """Seen along -y, x points to the right, z upwards, and y away."""
    figure = Figure()
    view.draw_triad(figure, view.View(np.array([0.0, -1.0, 0.0]), Z))
    arrows = [text for text in figure.axes[0].texts if isinstance(text, Annotation)]
    ends = {tuple(np.round(arrow.xy, 12) + 0.0) for arrow in arrows}
    assert ends == {(1.0, 0.0), (0.0, 0.0), (0.0, 1.0)}
    assert {text.get_text() for text in figure.axes[0].texts} == {"", "x", "y", "z"}


@pytest.mark.parametrize("outward", [-Z, Z, X, np.array([0.6, 0.0, -0.8])])
def test_z_is_drawn_upwards(outward: np.ndarray) -> None:
    np.testing.assert_allclose(view.axis_of(None, outward), Z, atol=1e-12)


def test_the_floor_goes_through_the_point_of_contact_and_beyond_the_body(drawing: Drawing) -> None:
    moment = strongest_moment(drawing, drawing.body("block"), 1000)
    shift = np.array([0.0, 0.0, 0.002])
    wall = touching(drawing, moment.contact, moment.body.nodes, moment.middle, shift, 1000)
    assert wall is not None
    corners = np.asarray(wall.points)
    np.testing.assert_allclose(corners[:, 2], moment.middle[2] + 0.002, atol=1e-8)
    assert (corners.min(axis=0)[:2] < moment.body.nodes.min(axis=0)[:2]).all()
    assert (corners.max(axis=0)[:2] > moment.body.nodes.max(axis=0)[:2]).all()


def test_mean_forces_stand_at_the_middles_of_their_samples(drawing: Drawing) -> None:
    times = drawing.trajectory.times
    figure = Figure()
    axes = figure.add_axes((0.1, 0.1, 0.8, 0.8))
    force_axes(axes, drawing.trajectory, "floor", times)
    drawn = np.asarray(axes.lines[0].get_xdata(), float)
    np.testing.assert_allclose(drawn, times - 0.5 * times[0], rtol=1e-9)
    np.testing.assert_allclose(middles(np.array([2.0, 4.0, 6.0])), [1.0, 3.0, 5.0])


def test_an_obstacle_that_is_a_body_is_not_drawn(drawing: Drawing, monkeypatch: pytest.MonkeyPatch) -> None:
    moment = strongest_moment(drawing, drawing.body("block"), 1000)
    monkeypatch.setitem(drawing.scene["contact"]["floor"], "against", {"shape": "body", "body": "block"})
    assert touching(drawing, moment.contact, moment.body.nodes, moment.middle, 0 * Z, 1000) is None


def test_a_curved_edge_of_a_plane_part_is_told_from_a_surface() -> None:
    """Points on a line have no map of pressure, curved as it may be."""
    angle = np.linspace(-0.3, 0.3, 7)
    arc = np.column_stack([np.sin(angle), np.cos(angle), np.zeros(7)])
    assert on_an_edge(0.05 * arc, arc)
    face = np.column_stack([arc[:, 0], angle**3, np.full(7, 0.02)])
    assert not on_an_edge(face, np.tile([0.0, 0.0, 1.0], (7, 1)))
