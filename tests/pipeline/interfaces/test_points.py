"""Contact points stand on the true surface, never on a facet's chord."""

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.solid import mass_properties
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.cylinder import Cylinder
from gudgeon.pipeline.geometry.shapes.liner import Liner
from gudgeon.pipeline.interfaces.points import contact_points, shape_errors, surface_coordinates
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.solver.obstacles import Bore

RADIUS = 0.04296
LINER = Liner(kind="liner", bore_radius=0.05, wall=0.02, length=0.08, flange_height=0.02, flange_width=0.01)


def test_concentric_skirt_has_a_uniform_gap(skirt_mesh: MeshRecord) -> None:
    """Uniform to 0.1 µm on 12 mm edges, whose chords sag by 400 µm."""
    points = contact_points(skirt_mesh, Interface(surface="skirt"), "here").points
    gap = Bore(shape="bore", radius=0.043).gap(points)
    assert np.abs(gap - 40e-6).max() < 0.1e-6
    corners = skirt_mesh.nodes[np.unique(skirt_mesh.surfaces["skirt"].facets[:, :3])]
    chords = (corners[:-1] + corners[1:]) / 2
    assert np.abs(Bore(shape="bore", radius=0.043).gap(chords) - 40e-6).max() > 10e-6


def test_nodes_of_the_mesh_itself_stand_on_the_cylinder(skirt_mesh: MeshRecord) -> None:
    nodes = skirt_mesh.nodes[np.unique(skirt_mesh.surfaces["skirt"].facets)]
    assert np.abs(np.hypot(nodes[:, 0], nodes[:, 1]) - RADIUS).max() < 1e-9


def test_areas_and_normals(skirt_mesh: MeshRecord) -> None:
    points = contact_points(skirt_mesh, Interface(surface="skirt"), "here")
    assert points.areas.sum() == pytest.approx(2 * np.pi * RADIUS * 0.06, rel=1e-3)
    radial = points.points[:, :2] / RADIUS
    np.testing.assert_allclose(points.normals[:, :2], radial, atol=1e-9)
    inner = contact_points(skirt_mesh, Interface(surface="inner"), "here")
    assert np.einsum("ci,ci->c", inner.normals[:, :2], inner.points[:, :2]).max() < 0


def test_sector_and_height(skirt_mesh: MeshRecord) -> None:
    whole = contact_points(skirt_mesh, Interface(surface="skirt"), "here")
    part = contact_points(skirt_mesh, Interface(surface="skirt", sector_deg=(135, 225), height=(0.01, 0.03)), "here")
    angle = np.degrees(np.arctan2(part.points[:, 1], part.points[:, 0]))
    assert 0 < len(part.nodes) < len(whole.nodes)
    assert np.abs(angle).min() >= 135
    assert part.points[:, 2].min() >= 0.01
    assert part.points[:, 2].max() <= 0.03


def test_surface_coordinates_do_not_tear_at_the_half_turn(skirt_mesh: MeshRecord) -> None:
    part = contact_points(skirt_mesh, Interface(surface="skirt", sector_deg=(135, 225)), "here")
    pair = surface_coordinates(part.points, skirt_mesh.surfaces["skirt"].shape)
    assert pair.min() == -1
    assert pair.max() == 1
    ends = part.points[[pair[:, 0].argmin(), pair[:, 0].argmax()]]
    assert ends[0, 1] * ends[1, 1] < 0


def test_a_bar_has_one_point_at_each_end() -> None:
    mesh = Bar(kind="bar", length=2.0, area=1e-4).build(0.5)
    left = contact_points(mesh, Interface(surface="left"), "here")
    np.testing.assert_array_equal(left.points, [[0, 0, 0]])
    np.testing.assert_array_equal(left.normals, [[-1, 0, 0]])
    np.testing.assert_array_equal(left.areas, [1e-4])


def test_missing_and_empty_surfaces_are_named(skirt_mesh: MeshRecord) -> None:
    with pytest.raises(InputError, match=r"here\.surface: the mesh has no surface 'outside', it has crown"):
        contact_points(skirt_mesh, Interface(surface="outside"), "here")
    with pytest.raises(InputError, match="no contact point"):
        contact_points(skirt_mesh, Interface(surface="skirt", height=(1.0, 2.0)), "here")
    with pytest.raises(InputError, match="need a cylinder"):
        contact_points(skirt_mesh, Interface(surface="crown", sector_deg=(0, 10)), "here")


@pytest.mark.parametrize(
    ("shape", "size", "volume"),
    [
        (Cylinder(kind="cylinder", radius=0.01, length=0.05), 0.02, np.pi * 0.01**2 * 0.05),
        (Cylinder(kind="cylinder", radius=0.01, length=0.05), 0.01, np.pi * 0.01**2 * 0.05),
        (LINER, 0.03, np.pi * ((0.07**2 - 0.05**2) * 0.08 + (0.08**2 - 0.07**2) * 0.02)),
    ],
)
def test_the_error_of_the_volume_is_that_of_the_facets(shape: Cylinder | Liner, size: float, volume: float) -> None:
    """Convex and hollow faces; the mesh's own volume tells the error of what is known exactly."""
    mesh = shape.build(size)
    exact = mass_properties(mesh, 1.0).mass / volume - 1
    assert abs(exact) > 1e-6
    assert shape_errors(mesh).volume == pytest.approx(exact, rel=0.05)


def test_the_error_of_the_inertia_is_that_of_the_facets() -> None:
    """A coarse cylinder lacks twice as much of its inertia about the axis as of its mass."""
    R, length = 0.01, 0.05
    mesh = Cylinder(kind="cylinder", radius=R, length=length).build(0.02)
    moments = np.sort(np.linalg.eigvalsh(mass_properties(mesh, 1.0).inertia))
    mass = np.pi * R**2 * length
    exact = np.sort([mass * R**2 / 2, *[mass * (R**2 / 4 + length**2 / 12)] * 2])
    relative = np.abs(1 - exact / moments).max()
    assert relative > 1.5 * abs(shape_errors(mesh).volume)
    assert shape_errors(mesh).inertia == pytest.approx(relative, rel=0.05)
