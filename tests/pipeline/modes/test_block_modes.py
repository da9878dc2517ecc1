"""The block method against Lanczos and dense algebra, and its proof that no mode is missed."""

import numpy as np
import pytest
from scipy import linalg, sparse

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import hold
from gudgeon.pipeline.geometry.shapes.plane import Rectangle
from gudgeon.pipeline.geometry.shapes.skirt import Skirt
from gudgeon.pipeline.interfaces.tie import made_rigid, tie_of
from gudgeon.pipeline.modes import block_lanczos
from gudgeon.pipeline.modes import block_method as blocks
from gudgeon.pipeline.modes.block_lanczos import Basis
from gudgeon.pipeline.modes.block_method import block_pairs
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.lanczos import lanczos_pairs
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.modes.problem import Pairs, Problem
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.supports import Support
from tests.pipeline.blocks import block

COUNT = 20


@pytest.fixture(autouse=True)
def always(monkeypatch: pytest.MonkeyPatch) -> None:
    """The method takes small models."""
    monkeypatch.setattr(blocks, "LEAST_DOFS", 0)


@pytest.fixture(scope="module")
def model() -> FEModel:
    """Curved tets."""
    mesh = Skirt(kind="skirt", outer_radius=0.043, wall=0.006, height=0.06, crown=0.008).build(0.008)
    return build_model(mesh, Material(E=72e9, nu=0.33, rho=2700.0))


def pairs(model: FEModel, count: int = COUNT) -> Pairs:
    found = block_pairs(model, Problem.of(model), count)
    assert found is not None
    return found


def assert_same(model: FEModel, count: int = COUNT) -> None:
    problem = Problem.of(model)
    ours, oracle = pairs(model, count), lanczos_pairs(model, problem, count)
    # What neither method can tell: 1e-8 of the slender body's first eigenvalue.
    floor = 4 * np.finfo(float).eps * problem.highest
    assert np.all(np.abs(ours.values[:count] - oracle.values[:count]) <= 1e-11 * oracle.values[:count] + floor)
    overlap = ours.vectors[:, :count].T @ (problem.M @ oracle.vectors[:, :count])
    np.testing.assert_allclose(linalg.svdvals(overlap), 1.0, atol=1e-9)


def test_a_free_body_has_the_pairs_of_lanczos(model: FEModel) -> None:
    assert_same(model)


def test_a_held_body_has_the_pairs_of_lanczos(model: FEModel) -> None:
    held = hold(model, [Support(surface="crown")], "here")
    assert not held.rigid_modes.shape[1]
    assert_same(held)


def test_a_body_held_in_one_direction_has_the_pairs_of_lanczos(model: FEModel) -> None:
    """Its rows are no full blocks, and rigid motions are left."""
    held = hold(model, [Support(surface="crown", hold=["z"])], "here")
    assert held.rigid_modes.shape[1] == 3
    assert_same(held)


def test_a_plane_part_has_the_pairs_of_lanczos() -> None:
    geometry = Rectangle(kind="rectangle", lx=0.1, ly=0.05, thickness=0.004, state="plane-stress")
    plane = build_model(geometry.build(0.002), Material(E=210e9, nu=0.3, rho=7850.0), geometry=geometry)
    assert_same(plane)
    assert_same(hold(plane, [Support(surface="left")], "here"))


def test_a_tied_body_has_the_pairs_of_lanczos(model: FEModel) -> None:
    """The dofs of its crown follow six of them: linear elements are a start, no more."""
    tie = tie_of(model.mesh, Interface(surface="crown", kind="tie", tie="rbe2"), "here")
    assert_same(made_rigid(model, {"crown": tie}, "here")[0])


@pytest.mark.parametrize(("floor", "single"), [(0.0, True), (1e-3, False)])
def test_the_counts_precision_follows_the_gap(
    model: FEModel, monkeypatch: pytest.MonkeyPatch, floor: float, single: bool
) -> None:
    """Of round-off that no gap is wider than, the count is in double precision; both find all."""
    taken, whole = [], blocks.factorise
    monkeypatch.setattr(blocks, "SINGLE_FLOOR", floor)
    monkeypatch.setattr(
        blocks, "factorise", lambda A, **options: taken.append(options.get("single")) or whole(A, **options)
    )
    assert normal_modes(model, COUNT).quality["inertia_found"] == COUNT
    assert taken == [single]


def test_a_slender_body_has_the_pairs_of_lanczos() -> None:
    assert_same(block((0.005, 0.005, 0.5), (1, 1, 60)), 8)


def test_a_restart_loses_nothing(model: FEModel, monkeypatch: pytest.MonkeyPatch) -> None:
    restarts = []
    whole = Basis.restart
    monkeypatch.setattr(Basis, "restart", lambda self, theta, Y: restarts.append(len(theta)) or whole(self, theta, Y))
    monkeypatch.setattr(block_lanczos, "capacity", lambda count: 2 * count + 24)
    assert_same(model)
    assert restarts


def test_pairs_of_a_shared_factor_are_the_same(model: FEModel) -> None:
    """The factor of static columns, with rows of B behind it."""
    rows = model.rows(np.arange(40), np.tile([0.0, 0.0, 1.0], (40, 1)))
    own = Flexibility(model, rows)
    shared = block_pairs(model, Problem.of(model), COUNT, own)
    assert shared is not None
    np.testing.assert_allclose(shared.values[:COUNT], pairs(model).values[:COUNT], rtol=1e-11)
    own.free()


def test_the_basis_stays_orthonormal_where_columns_are_dependent() -> None:
    problem = Problem.of(block((0.05, 0.04, 0.06), (3, 3, 4)))
    columns, other = (np.random.default_rng(seed).standard_normal((problem.K.shape[0], 6)) for seed in range(2))
    basis = Basis(problem, 40)
    basis.add(basis.beside(columns)[0])
    nearly = columns @ np.random.default_rng(1).standard_normal((6, 3)) + 1e-4 * other[:, :3]
    Q, beta = basis.beside(nearly)
    assert Q.shape[1] == 3
    inside = basis.V @ (basis.V.T @ (problem.M @ nearly))
    np.testing.assert_allclose(Q @ beta, nearly - inside, atol=1e-9 * np.abs(nearly).max())
    basis.add(Q)
    assert basis.beside(columns[:, :2])[0].shape[1] == 0
    np.testing.assert_allclose(basis.V.T @ (problem.M @ basis.V), np.eye(9), atol=1e-12)


def test_a_space_that_the_inverse_does_not_leave_ends_the_method() -> None:
    """Fewer independent columns than a basis has: the pairs are those of the whole space."""
    K, M = (sparse.csr_matrix(np.diag(one)) for one in (np.arange(1.0, 61.0), np.ones(60)))
    problem = Problem(K, M, np.empty((60, 0)))
    found = block_lanczos.block_lanczos(problem, lambda F: F / np.arange(1.0, 61.0)[:, None], 0.0, 50)
    assert found is not None
    np.testing.assert_allclose(found.values[:50], np.arange(1.0, 51.0), rtol=1e-12)


def test_the_count_stands_in_a_gap_above_the_wanted_ones(model: FEModel) -> None:
    found = pairs(model)
    assert found.proven is not None
    sigma, below = found.proven
    assert found.values[COUNT - 1] < sigma
    assert below == (lanczos_pairs(model, Problem.of(model), COUNT + 8).values < sigma).sum()


def test_a_missed_mode_is_found(model: FEModel, monkeypatch: pytest.MonkeyPatch) -> None:
    def forgetful(*args: object) -> Pairs:
        found = block_lanczos.block_lanczos(*args)  # type: ignore[arg-type]
        assert found is not None
        kept = np.delete(np.arange(len(found.values)), 4)
        return Pairs(found.values[kept], found.vectors[:, np.delete(np.arange(COUNT + 1), 4)])

    def more(problem: Problem, inverse: object, shift: float, count: int) -> Pairs:
        return forgetful(problem, inverse, shift, count + 1)

    monkeypatch.setattr(blocks, "block_lanczos", more)
    with pytest.raises(StageError, match=r"inertia count finds \+1"):
        normal_modes(model, COUNT)


def test_where_blocks_do_not_converge_lanczos_does(model: FEModel, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = normal_modes(model, COUNT).angular_frequencies
    monkeypatch.setattr(block_lanczos, "capacity", lambda count: 2 * count + 24)
    monkeypatch.setattr(block_lanczos, "MOST_RESTARTS", 0)
    assert block_pairs(model, Problem.of(model), COUNT) is None
    np.testing.assert_allclose(normal_modes(model, COUNT).angular_frequencies, expected, rtol=1e-11)
