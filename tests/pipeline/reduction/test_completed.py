"""What `completed` adds to shapes and says of them, against solutions and quotients of full matrices."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from scipy import sparse

from gudgeon.modaldb.records.modes import SHAPE_ERRORS
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.reduction.methods import REDUCTIONS, ContactRows
from gudgeon.pipeline.reduction.methods.reduction import _definite, completed, ritz_modes
from gudgeon.pipeline.scenes.modes import ModesSettings
from tests.contracts.test_reductions import block, plane
from tests.pipeline.reduction.test_reductions import bar, settings

SOLVED = 1e-8
"""Relative error of solutions with a factor of these meshes: round-off times their condition number."""


def with_smooth(model: FEModel, rows: ContactRows) -> tuple[FEModel, ContactRows]:
    """Ask for the responses of two smooth pressures that are not among the kept ones."""
    smooth = np.random.default_rng(1).standard_normal((rows.B.shape[0], 2))
    return model, replace(rows, smooth=smooth)


@pytest.mark.parametrize("reduction", ["macneal", "rubin", "ritz", "attachment", "craig-bampton", "rubin-macneal"])
@pytest.mark.parametrize("part", ["free", "held"])
def test_responses_are_static_displacements(reduction: str, part: str) -> None:
    model, rows = with_smooth(*(block() if part == "free" else plane("left")))
    reduced = REDUCTIONS[reduction](model, rows, settings(reduction, normal_count=4, substructures=1))
    assert rows.smooth is not None
    exact = Flexibility(model).solve(rows.B.T @ rows.smooth)
    assert reduced.responses is not None
    np.testing.assert_allclose(reduced.responses, exact, rtol=0, atol=SOLVED * np.abs(exact).max())


@pytest.mark.parametrize("reduction", ["rubin-macneal", "normal+static"])
def test_loads_and_ties_have_their_static_answer_in_the_shapes(reduction: str) -> None:
    """Of their rows alone; what contact rows lack is in R, or dropped."""
    model, rows = block()
    loads = np.arange(rows.B.shape[0]) % 3 == 1
    rows = replace(rows, pressures=np.empty((len(loads), 0)), loads=loads)
    reduced = REDUCTIONS[reduction](model, rows, settings(reduction, normal_count=3))
    exact = rows.B @ Flexibility(model).solve(rows.B.T.toarray())
    at_rows = rows.B @ reduced.Phi / reduced.angular_frequencies
    lacking = exact - at_rows @ at_rows.T
    size = np.abs(exact).max()
    np.testing.assert_allclose(lacking[loads], 0.0, rtol=0, atol=SOLVED * size)
    assert np.abs(lacking[~loads][:, ~loads]).max() > 1e-3 * size
    assert reduced.Phi.shape[1] == 3 + loads.sum()
    assert (reduced.residual_flexibility is None) == (reduction == "normal+static")


@pytest.mark.parametrize("reduction", ["rubin", "attachment"])
def test_one_shape_for_each_row_is_limited(reduction: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model, rows = block()
    module = import_module("gudgeon.pipeline.reduction.methods.macneal")
    monkeypatch.setattr(module, "LARGEST_BOUNDARY", rows.B.shape[0] - 1)
    message = rf"modes\.reduction: '{reduction}' given, .* {rows.B.shape[0]} rows of the interfaces, allowed: "
    with pytest.raises(InputError, match=message):
        REDUCTIONS[reduction](model, rows, settings(reduction))
    monkeypatch.setattr(module, "LARGEST_BOUNDARY", rows.B.shape[0])
    assert REDUCTIONS[reduction](model, rows, settings(reduction)).Phi.shape[1] > 0


def test_attachment_modes_are_as_many_as_asked_for() -> None:
    model, rows = block()
    rows = replace(rows, pressures=np.empty((rows.B.shape[0], 0)))
    whole = REDUCTIONS["attachment"](model, rows, settings("attachment", normal_count=0))
    few = REDUCTIONS["attachment"](model, rows, settings("attachment", normal_count=3))
    assert few.normal_count == few.Phi.shape[1] == 3
    np.testing.assert_allclose(few.angular_frequencies, whole.angular_frequencies[:3], rtol=1e-9)
    more = whole.normal_count + 1
    with pytest.raises(InputError, match=rf"modes\.normal_count: {more} given, the .* have {more - 1} independent"):
        REDUCTIONS["attachment"](model, rows, settings("attachment", normal_count=more))


@pytest.mark.parametrize("reduction", ["attachment", "row-craig-bampton"])
def test_a_default_count_is_at_most_what_rows_have(reduction: str) -> None:
    model, rows = block()
    rows = replace(rows, pressures=np.empty((rows.B.shape[0], 0)))
    fixed = {"fixed_count": 1} if reduction == "row-craig-bampton" else {}
    whole = REDUCTIONS[reduction](model, rows, settings(reduction, normal_count=0, **fixed))
    default = REDUCTIONS[reduction](model, rows, ModesSettings.model_validate({"reduction": reduction, **fixed}))
    assert default.normal_count == min(30, whole.normal_count)


def test_shapes_that_are_not_orthogonal_are_refused() -> None:
    model, rows = bar("left")
    modes = normal_modes(model, 4)
    assert completed(model, rows, modes).normal_count == 4
    with pytest.raises(StageError, match=r"modes: orthogonality of static shapes 0\.02, allowed: "):
        completed(model, rows, replace(modes, Phi=modes.Phi * [1.0, 1.01, 1.0, 1.0]))


def test_ritz_vectors_of_very_different_frequencies_are_orthogonal() -> None:
    model, _ = bar()
    basis = np.random.default_rng(2).standard_normal((model.K.shape[0], 12)) * np.logspace(0, -7, 12)
    basis[:, 6:] += np.sin(np.linspace(0.0, 3.0, model.K.shape[0]))[:, None]
    Phi = ritz_modes(model, basis).Phi
    assert Phi.shape[1] > 6
    np.testing.assert_allclose(Phi.T @ (model.M @ Phi), np.eye(Phi.shape[1]), rtol=0, atol=1e-13)
    np.testing.assert_allclose(model.rigid_modes.T @ (model.M @ Phi), 0.0, rtol=0, atol=1e-11)


def test_errors_of_shapes_are_those_of_an_inverse_iteration() -> None:
    model, rows = bar("left")
    reduced = REDUCTIONS["ritz"](model, rows, settings("ritz", normal_count=5, ritz_count=7))
    iterated = Flexibility(model).solve(model.M @ reduced.Phi)
    K, M = (np.einsum("dk,dk->k", iterated, matrix @ iterated) for matrix in (model.K, model.M))
    expected = 1 - np.sqrt(K / M) / reduced.angular_frequencies
    assert expected.max() > 1e-3
    np.testing.assert_allclose(reduced.quality[SHAPE_ERRORS], expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("reduction", ["macneal", "ritz"])
def test_the_static_displacement_under_weight_is_kept(reduction: str) -> None:
    """One shape more, unless the modes have it already."""
    model, rows = bar("left")
    weight = model.M @ np.ones((model.K.shape[0], 1))
    weight[model.held] = 0.0
    reduced = REDUCTIONS[reduction](model, replace(rows, weights=weight), settings(reduction))
    exact = Flexibility(model).solve(weight)
    ours = (reduced.Phi / reduced.angular_frequencies**2) @ (reduced.Phi.T @ weight)
    np.testing.assert_allclose(ours, exact, rtol=0, atol=1e-7 * np.abs(exact).max())
    assert reduced.Phi.shape[1] == 3
    of_a_mode = model.M @ normal_modes(model, 1).Phi
    assert REDUCTIONS["macneal"](model, replace(rows, weights=of_a_mode), settings("macneal")).Phi.shape[1] == 2


def test_pressures_that_the_modes_have_already_get_no_shape() -> None:
    model, rows = bar("left")
    rows = replace(rows, pressures=np.eye(1))
    assert completed(model, rows, normal_modes(model, 3)).Phi.shape[1] == 4
    ritz = ritz_modes(model, Flexibility(model).solve(rows.B.T.toarray()))
    reduced = completed(model, rows, ritz)
    assert (reduced.Phi.shape[1], reduced.quality["static_dropped"]) == (1, 1)


def test_flexibility_below_zero_is_round_off_or_refused() -> None:
    root = np.random.default_rng(3).standard_normal((4, 3))
    R, scale = root @ root.T, np.array([1.0, 2.0, 0.5, 1.0])
    sound = R - 1e-11 * np.eye(4)
    definite, lowest_eigenvalue = _definite(sound, scale, 1e-9)
    assert -1e-9 < lowest_eigenvalue < 0
    assert np.linalg.eigvalsh(definite)[0] >= -1e-15
    np.testing.assert_allclose(definite, sound, rtol=0, atol=1e-10)
    with pytest.raises(StageError, match="least scaled eigenvalue of residual flexibility -"):
        _definite(R - 1e-3 * np.eye(4), scale, 1e-9)
    nothing = sparse.csr_matrix((4, 4)).toarray()
    assert _definite(nothing, scale, 1e-9)[1] == 0.0
