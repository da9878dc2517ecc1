"""The sector of a bladed disk: faces that match, volumes that are known, and what does not fit."""

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.applications.wheel.cyclic.sector import cyclic_sector
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry.shapes.bladed_sector import BladedSector
from gudgeon.pipeline.geometry.symmetry import CyclicSymmetry
from gudgeon.pipeline.scenes.material import Material

STEEL = Material(E=2.1e11, nu=0.3, rho=7800.0)
SIZE = 0.03
VOLUME = 1e-4
"""Relative error of curved tet10 of this size on circles of 0.18 m."""


def sector(**changes: Any) -> BladedSector:
    return BladedSector.model_validate({"kind": "bladed-sector", "sectors": 12} | changes)


@pytest.fixture(scope="module")
def mesh() -> MeshRecord:
    return sector().build(SIZE)


def disk_volume(one: BladedSector) -> float:
    """Of hub, web and rim: rings of rectangular section."""
    inner = one.rim_radius - one.rim_height
    rings = [(one.bore_radius, one.hub_radius, one.hub_width), (one.hub_radius, inner, one.web),
             (inner, one.rim_radius, one.rim_width)]  # fmt: skip
    return sum(np.pi * (b**2 - a**2) * width for a, b, width in rings) / one.sectors


def blade_volume(one: BladedSector) -> float:
    """Of a plate from the rim's cylinder up to the tip's plane."""
    beta = np.radians(one.stagger_deg)
    u, weight = np.polynomial.legendre.leggauss(40)
    t, c = np.meshgrid(one.blade_thickness / 2 * u, one.chord / 2 * u, indexing="ij")
    y = t * np.cos(beta) - c * np.sin(beta)
    heights = one.tip_radius - np.sqrt(one.rim_radius**2 - y**2)
    return float(weight @ heights @ weight) * one.blade_thickness * one.chord / 4


def test_faces_match_node_for_node(mesh: MeshRecord) -> None:
    tied = cyclic_sector(build_model(mesh, STEEL), CyclicSymmetry(sectors=12))
    low, high = (np.unique(mesh.surfaces[name].facets) for name in ("low", "high"))
    assert len(low) == len(high) > 50
    R = tied.symmetry.rotation
    images = mesh.nodes[low] @ R.T
    distance = np.linalg.norm(images[:, None] - mesh.nodes[high], axis=2).min(axis=1)
    assert distance.max() < 1e-12  # Round-off of coordinates below 0.3 m, some thousand times over.


def test_volumes(mesh: MeshRecord) -> None:
    one = sector()
    mass = build_model(mesh, STEEL).properties.mass
    np.testing.assert_allclose(mass, STEEL.rho * (disk_volume(one) + blade_volume(one)), rtol=VOLUME)


def test_blade_ends_at_the_rim(mesh: MeshRecord) -> None:
    """Cells are the disk's or the blade's, none is both; the rim is only what of it is free."""
    one = sector()
    radii = np.linalg.norm(mesh.nodes[:, :2], axis=1)
    corners = radii[mesh.cells[:, :4]]
    blade = corners.mean(axis=1) > one.blade_radius
    assert corners[blade].min() > one.rim_radius * (1 - 1e-9)
    assert corners[~blade].max() < one.rim_radius * (1 + 1e-9)
    cells = replace_cells(mesh, blade)
    np.testing.assert_allclose(build_model(cells, STEEL).properties.mass, STEEL.rho * blade_volume(one), rtol=VOLUME)
    rim = mesh.surfaces["rim"].facets[:, :3]
    faces = mesh.cells[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3)
    owners = {tuple(sorted(face)): 0 for face in rim}
    for face in faces:
        if (key := tuple(sorted(face))) in owners:
            owners[key] += 1
    assert set(owners.values()) == {1}


def replace_cells(mesh: MeshRecord, chosen: np.ndarray) -> MeshRecord:
    nodes, numbers = np.unique(mesh.cells[chosen], return_inverse=True)
    return MeshRecord(mesh.nodes[nodes], numbers.reshape(-1, 10), "tetra10", {})


def test_sides_of_the_blade(mesh: MeshRecord) -> None:
    one = sector()
    shapes = one.surface_shapes()
    normal = np.array(shapes["pressure_side"]["normal"])
    np.testing.assert_allclose(normal, -np.array(shapes["suction_side"]["normal"]))
    gap = [(mesh.nodes[np.unique(mesh.surfaces[name].facets)] @ normal) for name in ("pressure_side", "suction_side")]
    np.testing.assert_allclose(gap[0], one.blade_thickness / 2, atol=1e-9)
    np.testing.assert_allclose(gap[1], -one.blade_thickness / 2, atol=1e-9)
    np.testing.assert_allclose(mesh.nodes[np.unique(mesh.surfaces["tip"].facets)][:, 0], one.tip_radius, atol=1e-9)


def test_too_coarse_a_mesh_is_refused_with_its_faces_untouched() -> None:
    """Mending elements that are inside out would move nodes of one face and not of the other."""
    with pytest.raises(InputError, match=r"mesh\.size: 0\.03 m is too coarse for the curved faces, 2 elements turn"):
        sector(sectors=8).build(SIZE)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bore_radius": 0.07}, r"bore_radius is 0\.07 m, it must be below hub_radius = 0\.065 m"),
        ({"hub_radius": 0.165}, r"hub_radius is 0\.165 m, it must be below rim_radius - rim_height = 0\.162 m"),
        ({"web": 0.05}, r"web is 0\.05 m, it must be below hub_width = 0\.05 m"),
        ({"tip_radius": 0.18}, r"rim_radius is 0\.18 m, it must be below tip_radius = 0\.18 m"),
        ({"chord": 0.06}, r"the blade's extent along the axis is 0\.05259\d* m, it must be below rim_width = 0\.045 m"),
        ({"sectors": 60, "stagger_deg": 80}, r"the blade's extent across the axis is 0\.045358\d m, it must be below"),
        ({"sectors": 2}, "greater than or equal to 3"),
        ({"web": -0.01}, "greater than 0"),
        ({"bore": 0.03}, "Extra inputs are not permitted"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        sector(**changes)
