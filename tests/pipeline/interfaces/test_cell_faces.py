"""Surfaces of solids of every type of cell: contact points, tractions, ties, strain, gauges, skin, quality."""

from dataclasses import replace

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry.cells import (
    HEXAHEDRON8,
    SOLIDS,
    Cell,
    cell_blocks,
    flat_triangles,
    mirrored,
    outer_facets,
)
from gudgeon.pipeline.geometry.surfaces import plane
from gudgeon.pipeline.interfaces.points import contact_points, surface_weights
from gudgeon.pipeline.interfaces.strain_gauges import refuse_far
from gudgeon.pipeline.interfaces.stress_recovery import PAIRS, hooke, interpolation, strain_rows
from gudgeon.pipeline.interfaces.tie import tie_of
from gudgeon.pipeline.interfaces.traction_space import traction_space
from gudgeon.pipeline.modes.bounds import lumped_share
from gudgeon.pipeline.plots.base.surface import make_skin
from gudgeon.pipeline.report.budget.mesh_edges import mean_edge
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.stages.parts import element_quality
from tests.pipeline.solids import FAMILIES, box

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
KINDS: dict[str, list[Cell]] = {cell.name: [cell] for cell in SOLIDS.values()} | FAMILIES
SIZES = (0.03, 0.02, 0.025)
AREA = SIZES[0] * SIZES[1]
CENTRE = np.array([SIZES[0] / 2, SIZES[1] / 2, SIZES[2]])
ROUND_OFF = 1e-13


@pytest.fixture(scope="module", params=KINDS)
def mesh(request: pytest.FixtureRequest) -> MeshRecord:
    """A box of each type, its top known as a plane."""
    record = box(KINDS[request.param], (3, 2, 2), SIZES)
    top = replace(record.surfaces["top"], shape=plane((0, 0, 1), (0, 0, SIZES[2])))
    return replace(record, surfaces=record.surfaces | {"top": top})


def test_contact_points_stand_for_positive_areas_and_keep_linear_fields(mesh: MeshRecord) -> None:
    points = contact_points(mesh, Interface(surface="top"), "key")
    assert points.areas.min() > 0
    assert points.areas.sum() == pytest.approx(AREA, rel=ROUND_OFF)
    np.testing.assert_allclose(points.areas @ points.points / AREA, CENTRE, rtol=ROUND_OFF)
    np.testing.assert_allclose(points.normals, np.tile([0.0, 0.0, 1.0], (len(points.nodes), 1)), atol=1e-12)


def test_weights_of_nodes_are_those_of_a_uniform_pressure(mesh: MeshRecord) -> None:
    nodes, areas, vectors = surface_weights(mesh, mesh.surfaces["top"])
    np.testing.assert_allclose(areas @ mesh.nodes[nodes] / AREA, CENTRE, rtol=ROUND_OFF)
    np.testing.assert_allclose(vectors.sum(axis=0), [0.0, 0.0, AREA], atol=ROUND_OFF * AREA)


def test_the_skin_encloses_the_volume(mesh: MeshRecord) -> None:
    volume = np.prod(SIZES)
    flat = mesh.nodes[flat_triangles(outer_facets(mesh))]
    assert np.linalg.det(flat).sum() / 6 == pytest.approx(volume, rel=1e-12)
    skin = make_skin(mesh.nodes, cell_blocks(mesh), 1000, {}).surface
    drawn = np.asarray(skin.points, float)[skin.regular_faces]
    assert np.linalg.det(drawn).sum() / 6 == pytest.approx(volume, rel=1e-5)  # VTK has single precision.


def test_a_traction_space_covers_the_surface(mesh: MeshRecord) -> None:
    interface = Interface(surface="top", kind="traction", along=(1.0, 0.0, 0.0), spacing=(0.01, 0.01))
    space = traction_space(mesh, interface, "key")
    assert space.areas.sum() == pytest.approx(AREA, rel=1e-12)
    moved = space.weights @ np.tile([0.0, 0.0, 1.0], len(mesh.nodes))
    np.testing.assert_allclose(moved, 1.0, rtol=1e-10)


def test_a_tie_follows_rigid_motions(mesh: MeshRecord) -> None:
    tie = tie_of(mesh, Interface(surface="top", kind="tie", tie="rbe3"), "key")
    motion = np.array([1.0, -2.0, 0.5, 30.0, 10.0, -20.0])
    moved = motion[:3] + np.cross(motion[3:], mesh.nodes[tie.nodes] - tie.point)
    np.testing.assert_allclose(np.einsum("jki,ki->j", tie.weights, moved), motion, rtol=1e-11)


def test_a_constant_strain_is_recovered(mesh: MeshRecord) -> None:
    H = np.array([[1.0, 0.4, -0.2], [0.3, -0.7, 0.5], [0.6, 0.1, 0.8]])
    strain = (strain_rows(mesh, np.arange(len(mesh.nodes))) @ (mesh.nodes @ H.T).ravel()).reshape(-1, 6)
    expected = [(H[i, j] + H[j, i]) / 2 for i, j in PAIRS]
    np.testing.assert_allclose(strain, np.tile(expected, (len(strain), 1)), atol=1e-12)


def test_places_are_found_in_their_cells(mesh: MeshRecord) -> None:
    for fractions in ((0.4, 0.55, 0.53), (0.01, 0.02, 0.03), (0.99, 0.9, 0.97)):
        point = np.array(fractions) * SIZES
        nodes, N = interpolation(mesh, point, "key")
        np.testing.assert_allclose(N @ mesh.nodes[nodes], point, atol=1e-15)
    with pytest.raises(InputError, match="outside the part"):
        interpolation(mesh, np.array([0.01, 0.01, 1.1 * SIZES[2]]), "key")
    with pytest.raises(InputError, match=r"0\.01 m off the part; its nearest point is \[0\.007, 0\.006, 0\.025\]"):
        refuse_far(mesh, np.array([0.007, 0.006, 0.035]), "key")


def test_the_mass_is_bounded_by_its_diagonal(mesh: MeshRecord) -> None:
    M = build_model(mesh, STEEL).M[::3, ::3].toarray()
    scale = 1 / np.sqrt(M.diagonal())
    least = np.linalg.eigvalsh(scale[:, None] * M * scale)[0]
    assert 0 < lumped_share(mesh) <= least * (1 + 1e-9)


@pytest.mark.parametrize("name", [cell.name for cell in SOLIDS.values()])
def test_quality_is_that_of_the_shape(name: str) -> None:
    """Cubes are regular; cut into pieces or stretched they are not. Edges are those between corners."""
    cell = SOLIDS[next(nodes for nodes, cell in SOLIDS.items() if cell.name == name)]
    mesh = box([cell], (1, 1, 1), (1.0, 1.0, 1.0))
    quality = element_quality(mesh)
    assert (quality["least"] == pytest.approx(1.0)) == (cell.shape is HEXAHEDRON8.shape)
    assert element_quality(replace(mesh, nodes=mesh.nodes * [1.0, 1.0, 5.0]))["least"] < 0.7 * quality["least"]
    assert mean_edge(mesh) * (1 + 1e-12) >= 1.0 or cell.shape.corners == 5


@pytest.mark.parametrize("cell", SOLIDS.values(), ids=lambda cell: cell.name)
def test_mirror_images_are_numbered_rightly(cell: Cell) -> None:
    mesh = box([cell], (2, 2, 2), SIZES)
    image = replace(mesh, nodes=mesh.nodes * [-1.0, 1.0, 1.0])
    with pytest.raises(InputError, match=r"element \d+ is inverted"):
        build_model(image, STEEL)
    model = build_model(replace(image, cells=image.cells[:, mirrored(cell)]), STEEL)
    np.testing.assert_allclose(model.K.diagonal(), build_model(mesh, STEEL).K.diagonal(), rtol=1e-10)


def test_incompatible_modes_have_the_stress_of_bending() -> None:
    """σ_xx = E κ y alone, as far as linear strains are recovered: inside exactly, on the surface by extrapolation."""
    mesh = box([HEXAHEDRON8], (4, 2, 1), (0.04, 0.02, 0.01))
    mesh = replace(mesh, formulations={"incompatible": np.arange(len(mesh.cells))})
    x, y, z = mesh.nodes.T
    x, y, nu = x - 0.02, y - 0.01, STEEL.nu
    u = np.column_stack([x * y, -(x**2) / 2 - nu * (y**2 - (z - 0.005) ** 2) / 2, -nu * y * (z - 0.005)])
    nodes = np.arange(len(mesh.nodes))
    stress = (strain_rows(mesh, nodes, STEEL) @ u.ravel()).reshape(-1, 6) @ hooke(STEEL).T
    np.testing.assert_allclose(stress[:, 0], STEEL.E * y, atol=1e-9 * STEEL.E * 0.01)
    np.testing.assert_allclose(stress[:, 1:], 0.0, atol=1e-9 * STEEL.E * 0.01)
