"""Normal modes and static correction against dense algebra on the same matrices."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg, sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.section import Rectangle
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.skirt import Skirt
from gudgeon.pipeline.interfaces.points import contact_points
from gudgeon.pipeline.linalg import BACKENDS, available_backend
from gudgeon.pipeline.modes import flexibility, lanczos, static
from gudgeon.pipeline.modes.normal import NormalModes, normal_modes
from gudgeon.pipeline.modes.problem import Problem
from gudgeon.pipeline.modes.static import pressure_fields, residual_shapes, static_shapes
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material
from tests.pipeline.blocks import MKL_HAS_A_WHEEL

COUNT = 12


@pytest.fixture(scope="module")
def tiny_mesh() -> MeshRecord:
    return Skirt(kind="skirt", outer_radius=0.043, wall=0.012, height=0.04, crown=0.012).build(0.02)


@pytest.fixture(scope="module")
def tiny(tiny_mesh: MeshRecord) -> FEModel:
    return build_model(tiny_mesh, Material(E=72e9, nu=0.33, rho=2700.0))


@pytest.fixture(scope="module")
def dense(tiny: FEModel) -> tuple[np.ndarray, np.ndarray]:
    return linalg.eigh(tiny.K.toarray(), tiny.M.toarray())


@pytest.fixture(scope="module")
def modes(tiny: FEModel) -> NormalModes:
    return normal_modes(tiny, COUNT)


def test_frequencies_equal_dense_ones(modes: NormalModes, dense: tuple[np.ndarray, np.ndarray]) -> None:
    np.testing.assert_allclose(modes.angular_frequencies**2, dense[0][6 : 6 + COUNT], rtol=1e-9)


def test_subspaces_equal_dense_ones(tiny: FEModel, modes: NormalModes, dense: tuple[np.ndarray, np.ndarray]) -> None:
    """Double frequencies: subspaces are compared, not vectors."""
    overlap = dense[1][:, 6 : 6 + COUNT].T @ (tiny.M @ modes.Phi)
    np.testing.assert_allclose(linalg.svdvals(overlap), 1.0, atol=1e-8)


def test_quality_is_recorded(modes: NormalModes) -> None:
    assert modes.quality["modes_missed"] == 0
    assert modes.quality["residual"] < 1e-8
    assert modes.quality["orthogonality"] < 1e-10


def test_a_missed_mode_is_found(tiny: FEModel, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = lanczos.eigsh

    def forgetful(*args: object, **options: object) -> tuple[np.ndarray, np.ndarray]:
        values, vectors = whole(*args, **options)
        order = np.delete(np.argsort(values), 4)
        return values[order], vectors[:, order]

    monkeypatch.setattr(lanczos, "eigsh", forgetful)
    with pytest.raises(StageError, match="inertia count finds"):
        normal_modes(tiny, COUNT)


def test_rigid_and_elastic_modes_that_mix_are_refused(tiny: FEModel) -> None:
    """One dof almost without mass lifts the round-off floor eps·max(K_ii/M_ii) above the first frequency."""
    M = tiny.M.copy()
    M.setdiag(np.where(np.arange(M.shape[0]) == 0, M.diagonal() * 1e-13, M.diagonal()))
    with pytest.raises(StageError, match="cannot be separated"):
        normal_modes(replace(tiny, M=M), COUNT)


def test_too_many_modes_are_refused(tiny: FEModel) -> None:
    with pytest.raises(StageError, match="normal modes requested"):
        normal_modes(tiny, tiny.K.shape[0])


@pytest.mark.parametrize("backend", sorted(BACKENDS))
def test_backends_solve_and_count_alike(tiny: FEModel, dense: tuple[np.ndarray, np.ndarray], backend: str) -> None:
    if backend == "pardiso" and not MKL_HAS_A_WHEEL:
        pytest.skip("MKL has no wheel for this processor")
    sigma = 0.5 * (dense[0][10] + dense[0][11])
    matrix = (tiny.K - sigma * tiny.M).tocsr()
    matrix.sort_indices()
    factor = BACKENDS[backend](matrix)
    assert factor.negative_pivots() == 11
    loads = np.random.default_rng(0).standard_normal((matrix.shape[0], 12))
    for block in (loads, loads[:, 0], loads[:, :1]):
        answer = factor.solve(block)
        assert answer.shape == block.shape
        np.testing.assert_allclose(matrix @ answer, block, atol=1e-7)
    for shift, below in ((0.5 * (dense[0][8] + dense[0][9]), 9), (sigma, 11)):
        # After a solve of one load, and after none.
        again = (tiny.K - shift * tiny.M).tocsr()
        again.sort_indices()
        factor.refactorise(again)
        assert factor.negative_pivots() == below
    np.testing.assert_allclose(matrix @ factor.solve(loads), loads, atol=1e-7)
    factor.refactorise(sparse.diags_array(np.arange(1.0, matrix.shape[0] + 1)).tocsr())
    np.testing.assert_allclose(factor.solve(np.ones(matrix.shape[0])) * np.arange(1, matrix.shape[0] + 1), 1.0)
    factor.free()


def test_single_precision_solves_to_seven_digits(tiny: FEModel) -> None:
    matrix = (tiny.K + 1e10 * tiny.M).tocsr()
    matrix.sort_indices()
    factor = BACKENDS[available_backend()](matrix, False, True)
    loads = np.random.default_rng(0).standard_normal((matrix.shape[0], 12))
    answer = factor.solve(loads)
    assert answer.dtype == factor.precision
    exact = sparse.linalg.spsolve(matrix.tocsc(), loads)
    assert np.abs(answer - exact).max() <= 1e-2 * np.abs(exact).max()
    factor.free()


@pytest.fixture(scope="module")
def B(tiny_mesh: MeshRecord, tiny: FEModel) -> sparse.csr_matrix:
    points = contact_points(tiny_mesh, Interface(surface="skirt", sector_deg=(-60, 60)), "here")
    return tiny.rows(points.nodes, points.normals)


def test_residual_flexibility_is_what_the_missing_modes_give(
    tiny: FEModel, modes: NormalModes, dense: tuple[np.ndarray, np.ndarray], B: sparse.csr_matrix
) -> None:
    missing = B @ dense[1][:, 6 + COUNT :]
    R = residual_shapes(tiny, B, modes, np.empty((B.shape[0], 0))).flexibility
    np.testing.assert_allclose(R, (missing / dense[0][6 + COUNT :]) @ missing.T, atol=1e-9 * np.abs(R).max())


def test_residual_fields_are_what_the_missing_modes_give(
    tiny: FEModel, modes: NormalModes, dense: tuple[np.ndarray, np.ndarray], B: sparse.csr_matrix
) -> None:
    pressures = np.random.default_rng(1).standard_normal((B.shape[0], 3))
    missing = dense[1][:, 6 + COUNT :]
    expected = (missing / dense[0][6 + COUNT :]) @ (missing.T @ (B.T @ pressures))
    fields = residual_shapes(tiny, B, modes, pressures).fields
    np.testing.assert_allclose(fields, expected, atol=1e-9 * np.abs(expected).max())


def test_asymmetry_is_seen_in_rows_of_small_units(
    tiny: FEModel, modes: NormalModes, B: sparse.csr_matrix, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pressure's row is 1e12 times smaller than a point's; an error there must not hide behind the points."""
    scaled = sparse.csr_matrix(sparse.diags(np.where(np.arange(B.shape[0]) < 2, 1e-12, 1.0)) @ B)
    none = np.empty((B.shape[0], 0))
    residual_shapes(tiny, scaled, modes, none)
    whole = flexibility.factorise

    class Skewed:
        def __init__(self, matrix: sparse.csr_matrix, definite: bool = False) -> None:
            self.factor = whole(matrix, definite)
            self.skew = np.linspace(1.0, 1.001, matrix.shape[0])[:, None]

        def solve(self, loads: np.ndarray) -> np.ndarray:
            return self.skew * self.factor.solve(loads)

        def free(self) -> None:
            self.factor.free()

    monkeypatch.setattr(flexibility, "factorise", Skewed)
    monkeypatch.setattr(flexibility, "condense", lambda *_: None)
    with pytest.raises(StageError, match="unbalanced"):
        residual_shapes(tiny, sparse.csr_matrix(scaled[:2]), modes, np.empty((2, 0)))
    monkeypatch.setattr(flexibility, "SOLVED", np.inf)
    with pytest.raises(StageError, match="asymmetric"):
        residual_shapes(tiny, sparse.csr_matrix(scaled[:2]), modes, np.empty((2, 0)))


@pytest.mark.parametrize(("stiff", "refused"), [(True, False), (False, True)])
def test_an_unbalanced_load_is_refused_where_it_displaces(
    tiny: FEModel, dense: tuple[np.ndarray, np.ndarray], monkeypatch: pytest.MonkeyPatch, stiff: bool, refused: bool
) -> None:
    """A tenth of the load is left by an error along the stiffest mode, which is none of the displacement, or along the
    softest, which is a tenth of it."""
    whole = flexibility.Flexibility(tiny)
    K = tiny.K[whole.dofs][:, whole.dofs].toarray()
    values, vectors = np.linalg.eigh(K)
    load, mode = vectors[:, :1], -1 if stiff else 0
    off = 0.1 * vectors[:, mode] / values[mode]
    solve, calls = whole.factor.solve, []

    def wrong(loads: np.ndarray) -> np.ndarray:
        answer = solve(loads)
        if not calls:
            answer[whole._places] += off[:, None]
        calls.append(loads)
        return answer

    monkeypatch.setattr(whole.factor, "solve", wrong)
    monkeypatch.setattr(flexibility, "SOLVED", 1e-2)
    if refused:
        with pytest.raises(StageError, match="unbalanced"):
            whole.grounded(load)
    else:
        np.testing.assert_allclose(whole.grounded(load)[:, 0], load[:, 0] / values[0], atol=1e-2 / values[0])


@pytest.mark.skipif(not MKL_HAS_A_WHEEL, reason="MKL has no wheel for this processor")
def test_eliminated_rows_have_the_residual_of_solves(
    tiny: FEModel, modes: NormalModes, B: sparse.csr_matrix, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rows of other units, one that does not move, and fields; the row by row solution is the truth."""
    size = np.where(np.arange(B.shape[0]) < 2, 1e-12, 1e3)
    size[4] = 0.0
    rows = sparse.csr_matrix(sparse.diags(size) @ B)
    pressures = np.random.default_rng(1).standard_normal((B.shape[0], 3))
    solves = []
    whole = flexibility.Flexibility.grounded
    monkeypatch.setattr(
        flexibility.Flexibility, "grounded", lambda self, F: solves.append(F.shape[1]) or whole(self, F)
    )
    ours = residual_shapes(tiny, rows, modes, pressures)
    assert solves == [6 + COUNT, 3 + 1]
    monkeypatch.setattr(static, "CANCELLED", 0.0)
    expected = residual_shapes(tiny, rows, modes, pressures)
    # No stricter limit is met by two orders of summation: eps times the grounded flexibility over the residual one.
    size = np.outer(expected.scale, expected.scale)
    np.testing.assert_allclose(ours.flexibility / size, expected.flexibility / size, rtol=0, atol=1e-13)
    np.testing.assert_allclose(ours.fields, expected.fields, rtol=0, atol=1e-12 * np.abs(expected.fields).max())


@pytest.mark.skipif(not MKL_HAS_A_WHEEL, reason="MKL has no wheel for this processor")
def test_one_wrong_row_of_an_elimination_is_seen(
    tiny: FEModel, modes: NormalModes, B: sparse.csr_matrix, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = flexibility.condense

    def skewed(matrix: sparse.csr_matrix, rows: sparse.csr_matrix) -> object:
        found = whole(matrix, rows)
        assert found is not None
        found.flexibility[3, 5] *= 1 + 1e-5
        found.flexibility[5, 3] *= 1 + 1e-5
        return found

    monkeypatch.setattr(flexibility, "condense", skewed)
    with pytest.raises(StageError, match="differs from a static solution"):
        residual_shapes(tiny, B, modes, np.empty((B.shape[0], 0)))


@pytest.mark.parametrize("count", [1, 4, 9, 10_000])
def test_static_shapes_are_orthonormal_and_leave_the_rest_to_R(
    tiny: FEModel, modes: NormalModes, B: sparse.csr_matrix, count: int
) -> None:
    areas = np.ones(B.shape[0])
    spread = np.linspace(-1, 1, len(areas))
    fields = pressure_fields(np.column_stack([spread, np.sin(9 * spread)]), areas, count)
    residual = residual_shapes(tiny, B, modes, fields)
    shapes = static_shapes(tiny, B, residual)
    basis = np.column_stack([modes.Phi, shapes.Phi])
    np.testing.assert_allclose(basis.T @ (tiny.M @ basis), np.eye(basis.shape[1]), atol=1e-9)
    stiffness = basis.T @ (tiny.K @ basis)
    omega2 = np.concatenate([modes.angular_frequencies, shapes.angular_frequencies]) ** 2
    np.testing.assert_allclose(stiffness / np.sqrt(np.outer(omega2, omega2)), np.eye(len(omega2)), atol=1e-8)
    at_points = B @ shapes.Phi
    whole = shapes.residual_flexibility + (at_points / shapes.angular_frequencies**2) @ at_points.T
    np.testing.assert_allclose(whole, residual.flexibility, atol=1e-9 * np.abs(whole).max())
    assert linalg.eigvalsh(shapes.residual_flexibility)[0] > -1e-9 * np.abs(whole).max()


def test_dependent_static_shapes_are_dropped_and_counted(
    tiny: FEModel, modes: NormalModes, B: sparse.csr_matrix
) -> None:
    fields = np.eye(B.shape[0])[:, [0, 1, 1]]
    shapes = static_shapes(tiny, B, residual_shapes(tiny, B, modes, fields))
    assert shapes.Phi.shape[1] == fields.shape[1] - 1


def test_ritz_frequencies_are_never_below_the_full_models(
    dense: tuple[np.ndarray, np.ndarray], tiny: FEModel, modes: NormalModes, B: sparse.csr_matrix
) -> None:
    fields = np.eye(B.shape[0])[:, :10]
    shapes = static_shapes(tiny, B, residual_shapes(tiny, B, modes, fields))
    full = np.sqrt(dense[0][6 + COUNT : 6 + COUNT + len(shapes.angular_frequencies)])
    assert np.all(shapes.angular_frequencies >= full * (1 - 1e-9))


def test_many_modes_of_a_fine_free_bar_have_no_rigid_motion() -> None:
    """320 modes of 1000 elements: exact frequencies n π c / L, and orthogonality far below its tolerance."""
    bar = Bar(kind="bar", length=1.0, area=3e-4)
    steel = Material(E=210e9, nu=0.3, rho=7850.0)
    found = normal_modes(build_model(bar.build(1e-3), steel, geometry=bar), 320)
    assert found.quality["orthogonality"] < 1e-12
    exact = np.arange(1, 321) * np.pi * np.sqrt(210e9 / 7850)
    # A quadratic element of length h is too stiff by (ωh/c)⁴/1440.
    np.testing.assert_allclose(found.angular_frequencies, exact, rtol=1.01 * (320 * np.pi * 1e-3) ** 4 / 1440)


def test_many_modes_of_a_fine_beam_are_as_exact_as_the_first() -> None:
    """240 modes of 400 elements: eigenvalues spread by 4e9, more than one shift can carry."""
    section = Rectangle(kind="rectangle", width=0.01, height=0.01)
    beam = Beam(kind="beam", theory="euler-bernoulli", length=1.0, section=section)
    found = normal_modes(build_model(beam.build(2.5e-3), Material(E=210e9, nu=0.3, rho=7850.0), geometry=beam), 240)
    assert found.quality["orthogonality"] < 1e-12
    # Free ends: cosh(β) cos(β) = 1, β close to (n + 1/2) π; a Hermite element of length h is too stiff by (βh)⁴/720.
    number = np.arange(1, 241)
    beta = (number + 0.5) * np.pi
    beta[0] = 4.730040744862704
    exact = beta**2 * np.sqrt(210e9 * (1e-8 / 12) / (7850 * 1e-4))
    np.testing.assert_allclose(found.angular_frequencies, exact, rtol=1e-6 + (beta[-1] * 2.5e-3) ** 4 / 1440)


def test_a_refusal_names_the_quantity_that_failed(tiny: FEModel) -> None:
    problem = Problem.of(tiny)
    values, small = np.array([1e12, 2e12]), np.array([1e-12, 1e-11])
    problem.refuse_inexact(values, small, 1e-11)
    with pytest.raises(StageError, match=r"^modes: residual 0\.1 of mode 2, allowed: [^;]*$"):
        problem.refuse_inexact(values, np.array([1e-12, 0.1]), 1e-11)
    with pytest.raises(StageError, match=r"^modes: orthogonality 3e-10, allowed: 1e-10$"):
        problem.refuse_inexact(values, small, 3e-10)


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
def test_modes_of_slender_beams_in_space_are_as_exact_as_round_off(theory: str) -> None:
    """The uncertainty of eigenvalues is round-off of the largest one, of which max(K_ii/M_ii) may be a twentieth."""
    section = Rectangle(kind="rectangle", width=1e-3, height=1e-3)
    beam = Beam(kind="beam", theory=theory, length=1.0, section=section, motion="space")
    problem = Problem.of(build_model(beam.build(0.01), Material(E=210e9, nu=0.3, rho=7850.0), geometry=beam))
    exact = linalg.eigvalsh(problem.K.toarray(), problem.M.toarray())
    assert problem.largest == pytest.approx(exact[-1], rel=0.1)
    assert problem.highest < 0.7 * exact[-1]
    value, unit = np.array([exact[6]]), np.finfo(float).eps * exact[-1] / exact[6]
    assert unit > 1e-9
    problem.refuse_inexact(value, np.array([8 * unit]), 1e-12)
    with pytest.raises(StageError, match="residual"):
        problem.refuse_inexact(value, np.array([20 * unit]), 1e-12)
