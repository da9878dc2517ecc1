"""Ritz vectors of loads that change: one factorisation, as many solves as vectors, the same as a fresh extraction."""

from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.modes import flexibility
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.reduction.methods.ritz_vectors import RitzVectors
from gudgeon.pipeline.scenes.material import Material

STEEL = Material(E=2.1e11, nu=0.3, rho=7850.0)
COUNT = 8
PLACES = 5


@pytest.fixture(scope="module", params=[("left",), ()], ids=["cantilever", "free"])
def model(request: pytest.FixtureRequest) -> FEModel:
    mesh = Box(kind="box", lx=0.2, ly=0.02, lz=0.03).build(0.015)
    return build_model(mesh, STEEL, request.param)


@pytest.fixture(scope="module")
def loads(model: FEModel) -> list[np.ndarray]:
    """A unit force down at nodes of the top face, from the clamp to the tip."""
    top = np.unique(model.mesh.surfaces["top"].facets)
    line = top[np.argsort(model.nodes[top, 0])]
    at = line[np.linspace(0.3 * len(line), len(line) - 1, PLACES).astype(int)]
    return [-model.rows(np.array([node]), np.array([[0.0, 0.0, 1.0]])).T.toarray() for node in at]


@pytest.fixture
def factorised(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """Sizes of what is factorised while a test runs."""
    sizes, whole = [], flexibility.factorise

    def counted(matrix: Any, *how: Any, **more: Any) -> Any:
        sizes.append(matrix.shape)
        return whole(matrix, *how, **more)

    monkeypatch.setattr(flexibility, "factorise", counted)
    return sizes


def test_other_places_cost_back_substitutions_only(
    model: FEModel, loads: list[np.ndarray], factorised: list[tuple[int, int]]
) -> None:
    source = RitzVectors(model)
    for number, load in enumerate(loads, 1):
        source.generate(load, COUNT)
        assert source.solved == number * COUNT
    assert len(factorised) == 1


def test_regenerated_is_a_fresh_extraction(model: FEModel, loads: list[np.ndarray]) -> None:
    source = RitzVectors(model)
    for load in loads:
        found, fresh = source.generate(load, COUNT), RitzVectors(model).generate(load, COUNT)
        np.testing.assert_allclose(found.angular_frequencies, fresh.angular_frequencies, rtol=1e-12)
        scale = np.abs(fresh.Phi).max(axis=0)
        np.testing.assert_allclose(found.Phi / scale, fresh.Phi / scale, atol=1e-12)


def test_vectors_are_orthonormal_and_exact_in_statics(model: FEModel, loads: list[np.ndarray]) -> None:
    source = RitzVectors(model)
    for load in loads:
        modes = source.generate(load, COUNT)
        basis = np.column_stack([model.rigid_modes, modes.Phi])
        np.testing.assert_allclose(basis.T @ (model.M @ basis), np.eye(basis.shape[1]), atol=1e-10)
        ratio = modes.Phi.T @ (model.K @ modes.Phi) / np.outer(modes.angular_frequencies, modes.angular_frequencies)
        np.testing.assert_allclose(ratio, np.eye(COUNT), atol=1e-9)
        exact = source.flexibility.solve(load)
        answer = modes.Phi @ ((modes.Phi.T @ load) / modes.angular_frequencies[:, None] ** 2)
        np.testing.assert_allclose(answer, exact, atol=1e-9 * np.abs(exact).max())


def test_beside_kept_normal_modes(model: FEModel, loads: list[np.ndarray]) -> None:
    """Wu & Mani's combination: the normal modes stay, the load's static answer comes in, one solve a vector."""
    normal, source = normal_modes(model, COUNT - 2), RitzVectors(model)
    modes = source.generate(loads[0], COUNT, normal)
    assert source.solved == 2
    span = modes.Phi.T @ (model.M @ normal.Phi)
    np.testing.assert_allclose(span.T @ span, np.eye(COUNT - 2), atol=1e-10)
    assert np.all(modes.angular_frequencies[: COUNT - 2] <= normal.angular_frequencies * (1 + 1e-9))
    exact = source.flexibility.solve(loads[0])
    answer = modes.Phi @ ((modes.Phi.T @ loads[0]) / modes.angular_frequencies[:, None] ** 2)
    np.testing.assert_allclose(answer, exact, atol=1e-9 * np.abs(exact).max())
    alone = normal.Phi @ ((normal.Phi.T @ loads[0]) / normal.angular_frequencies[:, None] ** 2)
    assert np.abs(alone - exact).max() > 1e-4 * np.abs(exact).max()


def test_vectors_of_another_place_miss_the_statics(model: FEModel, loads: list[np.ndarray]) -> None:
    """Why they are made again."""
    source = RitzVectors(model)
    stale = source.generate(loads[0], COUNT)
    exact = float((loads[-1].T @ source.flexibility.solve(loads[-1])).item())
    answer = float((((stale.Phi.T @ loads[-1])[:, 0] / stale.angular_frequencies) ** 2).sum())
    assert 1 - answer / exact > 1e-4


@pytest.mark.parametrize(
    ("change", "count", "message"),
    [
        (lambda load: load[:-1], COUNT, r"loads: shape \(\d+, 1\) given; expected finite nodal forces \(\d+, k\)"),
        (lambda load: load[:, 0], COUNT, r"loads: shape \(\d+,\) given"),
        (lambda load: np.nan * load, COUNT, "expected finite nodal forces"),
        (lambda load: load, 0, "count: 0 given; expected more than the 0 kept normal modes"),
        (lambda load: 0 * load, COUNT, r"count: 8 given, loads and kept normal modes have 0 independent vectors"),
    ],
)
def test_what_has_no_vectors_is_refused(
    model: FEModel, loads: list[np.ndarray], change: Any, count: int, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        RitzVectors(model).generate(change(loads[0]), count)
