"""The block method against Lanczos and dense algebra, and its proof that no mode is missed."""

import numpy as np
import pytest
from scipy import linalg

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import hold
from gudgeon.pipeline.geometry.shapes.plane import Rectangle
from gudgeon.pipeline.geometry.shapes.skirt import Skirt
from gudgeon.pipeline.interfaces.tie import made_rigid, tie_of
from gudgeon.pipeline.modes import block_method as blocks
from gudgeon.pipeline.modes.block_method import block_pairs
from gudgeon.pipeline.modes.coarse import linear_elements
from gudgeon.pipeline.modes.davidson import Subspace, davidson
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
    """The method takes small models, and the factors of SuperLU where there is no MKL."""
    monkeypatch.setattr(blocks, "LEAST_DOFS", 0)
    monkeypatch.setattr(blocks, "available_backend", lambda: "pardiso")


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


@pytest.mark.parametrize("limit", [0.0, 1e9])
def test_the_factors_precision_decides_no_result(model: FEModel, monkeypatch: pytest.MonkeyPatch, limit: float) -> None:
    """Single precision whatever the body, and never."""
    monkeypatch.setattr(blocks, "SINGLE_LIMIT", limit)
    assert_same(model)


def test_a_slender_body_takes_double_precision(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = []
    whole = blocks.factorise
    monkeypatch.setattr(
        blocks, "factorise", lambda A, **options: taken.append(options.get("single")) or whole(A, **options)
    )
    slender = block((0.005, 0.005, 0.5), (1, 1, 60))
    assert_same(slender, 8)
    assert taken
    assert not taken[-1]


def test_a_restart_loses_nothing(model: FEModel, monkeypatch: pytest.MonkeyPatch) -> None:
    restarts = []
    whole = Subspace.restart
    monkeypatch.setattr(Subspace, "restart", lambda self, Y: restarts.append(Y.shape[1]) or whole(self, Y))
    monkeypatch.setattr(blocks, "CAPACITY", (4, 4))
    assert_same(model)
    assert restarts


def test_linear_elements_have_the_rigid_motions_and_higher_frequencies() -> None:
    """Straight edges: a rigid motion is linear, and the linear space a part of the quadratic one."""
    straight = block((0.05, 0.04, 0.06), (3, 3, 4))
    problem = Problem.of(straight)
    coarse = linear_elements(straight, problem, np.arange(straight.K.shape[0]))
    np.testing.assert_allclose(coarse.P @ coarse.problem.rigid, problem.rigid, atol=1e-10 * np.abs(problem.rigid).max())
    fine, linear = (linalg.eigvalsh(p.K.toarray(), p.M.toarray())[6:18] for p in (problem, coarse.problem))
    assert np.all(linear > fine)


def test_the_count_stands_in_a_gap_above_the_wanted_ones(model: FEModel) -> None:
    found = pairs(model)
    assert found.proven is not None
    sigma, below = found.proven
    assert found.values[COUNT - 1] < sigma
    assert below == (lanczos_pairs(model, Problem.of(model), COUNT + 8).values < sigma).sum()


def test_a_missed_mode_is_found(model: FEModel, monkeypatch: pytest.MonkeyPatch) -> None:
    def forgetful(*args: object, **options: object) -> tuple[Pairs, bool]:
        found, converged = davidson(*args, **options)  # type: ignore[arg-type]
        kept = np.delete(np.arange(len(found.values)), 4)
        return Pairs(found.values[kept], found.vectors[:, kept]), converged

    monkeypatch.setattr(blocks, "davidson", forgetful)
    with pytest.raises(StageError, match=r"inertia count finds \+1"):
        normal_modes(model, COUNT)


def test_where_blocks_do_not_converge_lanczos_does(model: FEModel, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = normal_modes(model, COUNT).angular_frequencies
    monkeypatch.setattr(blocks, "MOST_STEPS", 1)
    assert block_pairs(model, Problem.of(model), COUNT) is None
    np.testing.assert_allclose(normal_modes(model, COUNT).angular_frequencies, expected, rtol=1e-11)
