"""Solids of each type of cell and of several: patch tests, volumes, and frequencies of beams."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.elements.solid import mass_properties
from gudgeon.pipeline.geometry.cells import HEXAHEDRON8, HEXAHEDRON20, SOLIDS, Cell, cell_blocks, outer_facets
from gudgeon.pipeline.modes.estimate import discretisation_errors
from gudgeon.pipeline.scenes.material import Material
from tests.pipeline.solids import FAMILIES, box

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
KINDS: dict[str, list[Cell]] = {cell.name: [cell] for cell in SOLIDS.values()} | FAMILIES
SIZES = (0.03, 0.02, 0.025)
ROUND_OFF = 1e-13
each_kind = pytest.mark.parametrize("kind", KINDS)


def bent(x: np.ndarray) -> np.ndarray:
    """Curve all edges by up to a tenth of their length."""
    waves = [x @ np.array(w) for w in ((0, 40, 20), (35, 0, 30), (33, 25, 0))]
    return x + 2e-3 * np.column_stack([np.sin(waves[0]), np.cos(waves[1]), np.sin(waves[2])])


def formulated(mesh: MeshRecord, name: str) -> MeshRecord:
    """Return a mesh all of whose cells have a formulation."""
    return replace(mesh, formulations={name: np.arange(len(mesh.cells))})


def patch_residual(mesh: MeshRecord) -> tuple[float, float]:
    """Return the forces on inner nodes under a constant strain, over the largest ones, and the error of the energy."""
    model = build_model(mesh, STEEL)
    H = np.array([[1.0, 0.4, -0.2], [0.3, -0.7, 0.5], [0.6, 0.1, 0.8]])
    loads = (model.K @ (mesh.nodes @ H.T).ravel()).reshape(-1, 3)
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), outer_facets(mesh))
    assert len(inner)
    strain, (lam, mu) = (H + H.T) / 2, STEEL.lame
    stress = lam * np.trace(strain) * np.eye(3) + 2 * mu * strain
    energy = model.properties.mass / STEEL.rho * (stress * strain).sum()
    residual = np.abs(loads[inner]).max() / np.abs(loads).max()
    return float(residual), abs((mesh.nodes @ H.T * loads).sum() / energy - 1)


@each_kind
def test_a_constant_strain_passes_curved_elements(kind: str) -> None:
    residual, energy = patch_residual(box(KINDS[kind], (3, 2, 2), SIZES, bent))
    assert residual < ROUND_OFF
    assert energy < ROUND_OFF


def test_a_constant_strain_passes_incompatible_modes() -> None:
    residual, energy = patch_residual(formulated(box([HEXAHEDRON8], (3, 2, 2), SIZES, bent), "incompatible"))
    assert residual < ROUND_OFF
    assert energy < ROUND_OFF


def test_reduced_integration_passes_straight_elements() -> None:
    def skew(x: np.ndarray) -> np.ndarray:
        return x @ np.array([[1.0, 0.3, 0.1], [0.0, 1.2, 0.2], [0.1, 0.0, 0.9]])

    residual, energy = patch_residual(formulated(box([HEXAHEDRON20], (3, 2, 2), SIZES, skew), "reduced"))
    assert residual < ROUND_OFF
    assert energy < ROUND_OFF


@each_kind
def test_volume_and_centre_are_exact(kind: str) -> None:
    """Of a box that is sheared and stretched."""
    A = np.array([[1.0, 0.3, 0.1], [0.0, 1.2, 0.2], [0.1, 0.0, 0.9]])
    mesh = box(KINDS[kind], (2, 2, 1), SIZES, lambda x: x @ A.T)
    properties = mass_properties(mesh, STEEL.rho)
    assert properties.mass == pytest.approx(STEEL.rho * np.prod(SIZES) * np.linalg.det(A), rel=ROUND_OFF)
    np.testing.assert_allclose(properties.centre, A @ np.array(SIZES) / 2, rtol=ROUND_OFF)


def test_cells_of_several_types_share_their_faces() -> None:
    for family in FAMILIES.values():
        mesh = box(family, (3, 2, 2), SIZES)
        assert {block.cell for block in cell_blocks(mesh)} == set(family)
        assert sum(len(s.facets) for s in mesh.surfaces.values()) == len(outer_facets(mesh))


def lowest(mesh: MeshRecord) -> float:
    """Return the lowest elastic frequency of a free body [Hz]."""
    model = build_model(mesh, STEEL)
    values = eigsh(model.K, k=7, M=model.M, sigma=-1e6, which="LM", return_eigenvectors=False)
    return float(np.sqrt(np.sort(values)[6]) / (2 * np.pi))


LENGTH, HEIGHT = 0.2, 0.01
FINE_BLOCK = 79630.4
"""Lowest angular frequency of a steel block of 100 × 40 × 30 mm [rad/s], of 16 × 7 × 5 hexahedra of 27 nodes."""
QUADRATIC = [name for name, family in KINDS.items() if family[0].quadratic]
BEAM = (12, 2, 2)


@pytest.fixture(scope="module")
def beam_frequency() -> float:
    """Of a free beam of hexahedra of 27 nodes, twice as fine as those of the tests."""
    return lowest(box(FAMILIES["full"][1:2], (24, 2, 2), (LENGTH, HEIGHT, HEIGHT)))


def test_the_beam_is_that_of_timoshenko(beam_frequency: float) -> None:
    """Free and slender: Euler-Bernoulli's (4.730/l)² √(EI/ρA) less shear and rotary inertia, 1.0 % here."""
    euler = 4.73004**2 / LENGTH**2 * np.sqrt(STEEL.E * HEIGHT**2 / 12 / STEEL.rho) / (2 * np.pi)
    assert 0.985 < beam_frequency / euler < 0.995


@pytest.mark.parametrize("kind", QUADRATIC)
def test_quadratic_elements_bend(kind: str, beam_frequency: float) -> None:
    assert lowest(box(KINDS[kind], BEAM, (LENGTH, HEIGHT, HEIGHT))) == pytest.approx(beam_frequency, rel=3e-3)


def test_incompatible_modes_bend_and_plain_hexahedra_lock(beam_frequency: float) -> None:
    mesh = box([HEXAHEDRON8], (24, 2, 2), (LENGTH, HEIGHT, HEIGHT))
    assert lowest(mesh) > 1.1 * beam_frequency
    assert lowest(formulated(mesh, "incompatible")) == pytest.approx(beam_frequency, rel=5e-3)


@pytest.mark.parametrize(("kind", "formulation"), [(name, "") for name in QUADRATIC] + [("hexahedron20", "reduced")])
def test_errors_of_frequencies_are_estimated(kind: str, formulation: str) -> None:
    """Of the lowest mode of a block, against one of hexahedra of 27 nodes more than twice as fine."""
    sizes, exact = (0.1, 0.04, 0.03), FINE_BLOCK
    mesh = box(KINDS[kind], (5, 3, 3), sizes)
    mesh = formulated(mesh, formulation) if formulation else mesh
    model = build_model(mesh, STEEL)
    values, vectors = eigsh(model.K, k=7, M=model.M, sigma=-1e6, which="LM")
    omega, Phi = np.sqrt(values.max()), vectors[:, [values.argmax()]]
    estimate = discretisation_errors(model, STEEL, None, np.array([omega]), Phi)
    assert estimate is not None
    assert 0.75 < estimate[0] / (omega / exact - 1) < 1.25


def test_an_inverted_cell_is_named_by_its_number() -> None:
    mesh = box(FAMILIES["linear"], (3, 2, 2), SIZES)
    block = cell_blocks(mesh)[-1]
    cells = mesh.cells.copy()
    cells[block.rows[1], [0, 4]] = cells[block.rows[1], [4, 0]]
    with pytest.raises(InputError, match=f"element {block.rows[1]} is inverted"):
        build_model(replace(mesh, cells=cells), STEEL)
