"""Modes of a design from stored ones: frequencies, flexibility and estimates against modes of the moved mesh."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import DESIGN, ModalRecord
from gudgeon.pipeline.design_change import ways
from gudgeon.pipeline.design_change.compliance import largest_change
from gudgeon.pipeline.design_change.family import Family, flexibility_of
from gudgeon.pipeline.design_change.morph import Movement, moved_mesh
from gudgeon.pipeline.design_change.projection import Target
from gudgeon.pipeline.design_change.ways.certificate import probes
from gudgeon.pipeline.design_change.ways.inverse import stationary
from gudgeon.pipeline.reduction.acting import assembled, stacked
from gudgeon.pipeline.reduction.couplings import weights_along
from gudgeon.pipeline.reduction.methods import ContactRows
from gudgeon.pipeline.reduction.methods.carried import carried_macneal, target_of
from gudgeon.pipeline.reduction.methods.macneal import macneal
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.mesh import build_mesh
from tests.pipeline.design_change.test_estimate import LINER

WALL = 0.006
PART = Component.model_validate(LINER | {"modes": {"normal_count": 8, "static_count": 4}})
STORED = Component.model_validate(LINER | {"modes": {"normal_count": 10, "static_count": 4}})
REQUESTED: dict[str, Any] = {"rubbed": ["thrust"], "pulled": [(0.0, 0.0, 1.0)]}
"""Friction on its bore, and gravity along it."""
STATED = (0.8, 1.25)
"""Stated over true errors."""
CONVERGING = 0.5
"""Stated over true error of frequencies by a factor of the body's own, whose step leaves a share of the error that
tends to the fourth power of the frequency over the next one beyond the block."""
ROUND_OFF = 1e-11
"""True errors below it are not compared."""


@cache
def mesh_of(share: float) -> MeshRecord:
    """Return the liner with a wall that is thicker by a share."""
    mesh = build_mesh(PART, Path(), "part")
    return moved_mesh(mesh, Movement("outer", share * WALL, "here")) if share else mesh


@cache
def record(share: float) -> ModalRecord:
    return reduce_component(mesh_of(share), "", STORED, "part", **REQUESTED)


def body(share: float, component: Component = PART) -> tuple[Target, ContactRows]:
    _, acting, (model, _, spread) = assembled(mesh_of(share), component, "part", REQUESTED["rubbed"])
    rows = replace(stacked(acting, spread), weights=weights_along(model, REQUESTED["pulled"]))
    return target_of(model, rows, component.modes.normal_count), rows


@cache
def family(shares: Sequence[float]) -> Family:
    assert PART.material is not None
    targets = [body(share, STORED)[0] for share in shares]
    return Family(targets, [record(share) for share in shares], PART.material)


def flexibility(share: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies and flexibility of the moved mesh's own modes."""
    target, rows = body(share)
    exact = macneal(target.model, rows, PART.modes)
    at_rows = (rows.B @ exact.Phi) / exact.angular_frequencies
    assert exact.residual_flexibility is not None
    return exact.angular_frequencies[: target.count], exact.residual_flexibility + at_rows @ at_rows.T


def test_the_flexibility_of_a_record_is_that_of_all_its_rows() -> None:
    """Those across the normal, of friction, among them."""
    target, rows = body(0.0, STORED)
    C = rows.B @ family((0.0,)).factor.solve(rows.B.T.toarray())
    size = np.sqrt(np.outer(C.diagonal(), C.diagonal()))
    assert np.abs((flexibility_of(record(0.0)) - C) / size).max() < 1e-8
    assert len(C) == 3 * len(record(0.0).interfaces["thrust"].nodes)
    assert target.count == 10


@pytest.mark.parametrize(("shares", "frequency", "row"), [((0.0, -0.1, 0.1), 1e-6, 5e-4), ((-0.1, 0.1), 1e-2, 2e-2)])
def test_stored_designs_span_those_between_them(shares: tuple[float, ...], frequency: float, row: float) -> None:
    target, _ = body(0.04)
    answer = ways.projected(ways.Search(target, family(shares)))
    projection, C = answer.reduced, answer.flexibility
    exact, truth = flexibility(0.04)
    error = np.sqrt(projection.values[: target.count]) / exact - 1
    assert error.min() > -1e-9  # Ritz values are upper bounds.
    assert error.max() < frequency
    assert np.abs(C.diagonal() / truth.diagonal() - 1).max() < row
    R = C - projection.rows @ projection.rows.T
    size = np.sqrt(np.outer(C.diagonal(), C.diagonal()))
    assert np.linalg.eigvalsh(R / size)[0] > -1e-9


def test_a_stored_design_gives_itself() -> None:
    target, _ = body(0.1)
    answer = ways.projected(ways.Search(target, family((0.0, -0.1, 0.1))))
    projection, C = answer.reduced, answer.flexibility
    exact, truth = flexibility(0.1)
    np.testing.assert_allclose(np.sqrt(projection.values[: target.count]), exact, rtol=1e-9)
    np.testing.assert_allclose(C, truth, atol=1e-7 * truth.diagonal().max())


@pytest.mark.parametrize("share", [0.01, 0.05])
def test_stated_errors_are_true_ones(share: float) -> None:
    """Of modes that are kept, of a projection from one design, of the step's result after it, and of a new factor."""
    search = ways.Search(body(share)[0], family((0.0,)), {"thrust": (0, 4)}, 1.0)
    target = search.target
    exact, truth = flexibility(share)
    for name, way in ways.WAYS.items():
        answer = way.answer(search)
        assert answer is not None
        errors = ways.certified(search, answer)
        assert ways.complete(search)
        C, values = answer.flexibility, answer.reduced.values
        error = np.sqrt(values[: target.count]) / exact - 1
        noted = np.abs(error) > max(0.2 * np.abs(error).max(), ROUND_OFF)
        ratios = (errors.frequencies / error)[noted]
        compliance, after = (target.loads.T @ matrix @ target.loads for matrix in (C, truth))
        change = largest_change(after - compliance, compliance)
        random = probes(C)
        rough = np.abs(
            np.einsum("ck,cd,dk->k", random, truth, random) / np.einsum("ck,cd,dk->k", random, C, random) - 1
        )
        if name == "factor":
            np.testing.assert_allclose(C, truth, atol=1e-9 * truth.diagonal().max())
        else:
            ratios = np.array([*ratios, errors.rows / rough.max()])
        low = CONVERGING if name == "factor" else STATED[0]
        assert ((low < ratios) & (ratios < STATED[1])).all(), name
        if abs(change) > 1e-9:
            assert STATED[0] < errors.compliances["thrust"] / change < STATED[1]


def test_each_way_is_taken_where_it_is_the_cheapest() -> None:
    stored, columns = family((0.0,)), {"thrust": (0, 4)}
    given = [(1e-5, 1e-3), (0.03, 0.03), (0.03, 2e-3), (0.03, 1e-3), (0.1, 1e-12)]
    met = [ways.carried(body(share)[0], stored, columns, tolerance) for share, tolerance in given]
    assert [taken and taken.name for taken in met] == ["reuse", "project", "inverse", "factor", None]


def test_an_answer_that_misses_a_mode_is_not_taken() -> None:
    """Its Ritz values are exact, and so is each stated error: only the inertia count tells."""
    search = ways.Search(body(0.0)[0], family((0.0,)), {"thrust": (0, 4)}, 1.0)
    ways.certified(search, ways.projected(search))
    assert ways.complete(search)
    assert search.step is not None
    search.step = replace(search.step, values=np.delete(search.step.values, 4))
    assert not ways.complete(search)


def test_the_reduction_is_that_of_new_modes() -> None:
    """Its static shapes and R included: they give the same static compliance under the same pressures."""
    target, rows = body(0.04)
    stored = (0.0, -0.1, 0.1)
    method = carried_macneal(family(stored), record(0.0), ["a", "b", "c"], 1e-2)
    answer, exact = (reduction(target.model, rows, PART.modes) for reduction in (method, macneal))
    assert answer.quality[DESIGN]["way"] == "project"
    assert answer.quality[DESIGN]["designs"] == ["a", "b", "c"]
    assert (answer.normal_count, answer.Phi.shape) == (exact.normal_count, exact.Phi.shape)
    error = np.abs(answer.angular_frequencies / exact.angular_frequencies - 1)
    assert error[: answer.normal_count].max() < 1e-5
    assert error.max() < 1e-4  # Of static shapes, which stand for many modes.
    assert answer.responses is not None
    assert exact.responses is not None
    # The energy of this error is its square.
    np.testing.assert_allclose(answer.responses, exact.responses, atol=1e-4 * np.abs(exact.responses).max())


@pytest.mark.parametrize(("share", "tolerance", "way"), [(1e-4, 5e-3, "reuse"), (0.03, 1e-3, "factor")])
def test_the_reduction_by_kept_modes_and_by_a_new_factor(share: float, tolerance: float, way: str) -> None:
    target, rows = body(share)
    method = carried_macneal(family((0.0,)), record(0.0), ["a"], tolerance)
    answer, exact = (reduction(target.model, rows, PART.modes) for reduction in (method, macneal))
    assert answer.quality[DESIGN]["way"] == way
    assert answer.Phi.shape == exact.Phi.shape
    flexibilities = []
    for reduced in (answer, exact):
        at_rows = (rows.B @ reduced.Phi) / reduced.angular_frequencies
        assert reduced.residual_flexibility is not None
        assert np.linalg.eigvalsh(reduced.residual_flexibility)[0] > -1e-9 * np.abs(reduced.residual_flexibility).max()
        flexibilities.append(reduced.residual_flexibility + at_rows @ at_rows.T)
    C, truth = (flexibility.diagonal() for flexibility in flexibilities)
    count = answer.normal_count
    assert np.abs(C / truth - 1).max() < (1e-8 if way == "factor" else tolerance)
    assert np.abs(answer.angular_frequencies / exact.angular_frequencies - 1)[:count].max() < tolerance


def test_rows_that_the_stored_designs_lack_need_new_modes() -> None:
    target, rows = body(0.04)
    method = carried_macneal(family((0.0,)), record(0.0), ["a"], 1.0)
    fewer = replace(rows, tangential_spans={"thrust": [0, 1]})
    assert method(target.model, fewer, PART.modes).quality[DESIGN]["way"] == "recompute"


def test_a_compliance_beyond_the_tolerance_takes_no_way(monkeypatch: pytest.MonkeyPatch) -> None:
    errors = ways.Errors(np.array([1e-9]), {"face": 0.5}, 0.0)
    monkeypatch.setattr(ways, "certified", lambda search, answer: errors)
    monkeypatch.setattr(ways, "complete", lambda search: True)
    given: Any = None
    monkeypatch.setattr(ways, "WAYS", {"project": ways.Way(lambda search: given or ways.Answer(given, np.eye(1)))})
    assert ways.carried(given, given, {}, 1e-3) is None


def test_the_compliance_of_near_responses_is_of_second_order() -> None:
    random = np.random.default_rng(0)
    A, F, E = (random.standard_normal(shape) for shape in ((6, 6), (6, 2), (6, 2)))
    K = A @ A.T + 6 * np.eye(6)
    exact = np.linalg.solve(K, F)
    Y = exact + 1e-4 * E
    assert np.abs(stationary(F, Y, F - K @ Y) - F.T @ exact).max() < 1e-6
