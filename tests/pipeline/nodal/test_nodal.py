"""The full FE of a free body against something rigid: exact energy, one factorisation, convergence."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from threadpoolctl import ThreadpoolController, threadpool_info

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.interfaces.points import contact_points
from gudgeon.pipeline.nodal import body
from gudgeon.pipeline.nodal.problem import NodalContact, NodalProblem
from gudgeon.pipeline.nodal.sliding.contact import discrete_gradient
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.scenes.interface import Interface
from tests.pipeline.blocks import free_body

ENERGY = 1e-9
"""Newton stops at 1e-13 of the gap; summed over a run the energy error stays below this share of what is exchanged."""


@pytest.fixture(scope="module")
def problem(skirt_mesh: MeshRecord, skirt_model: FEModel) -> NodalProblem:
    points = contact_points(skirt_mesh, Interface(surface="skirt", sector_deg=(-45, 45)), "here")
    velocity = np.zeros((len(skirt_mesh.nodes), 3))
    velocity[:, 0] = 0.2
    impact = NodalContact(
        sparse.csr_matrix(-skirt_model.rows(points.nodes, points.normals)),
        np.full(len(points.nodes), 2e-6),
        1e14 * points.areas,
        -points.normals,
    )
    return NodalProblem(free_body("skirt", skirt_model, velocity.ravel()), {"bore": impact}, 4e-4)


@pytest.mark.parametrize("step", [8e-6, 2e-6])
def test_contact_gains_no_energy_at_any_step(problem: NodalProblem, step: float) -> None:
    run = simulate_nodal(problem, step)
    assert np.abs(run.force).max() > 100
    assert run.energy_drift < ENERGY


def test_impulse_is_the_change_of_momentum(problem: NodalProblem, skirt_model: FEModel) -> None:
    run = simulate_nodal(replace(problem, duration=6e-4), 4e-6)
    impulse = run.step * run.force.sum(axis=0)
    momentum = skirt_model.properties.mass * 0.2
    assert run.energies[-1, 2] == 0.0  # it has left
    assert -impulse[0] > momentum
    assert -impulse[0] < 2 * momentum
    assert np.abs(impulse[1:]).max() < 0.02 * np.abs(impulse[0])
    change = skirt_model.properties.mass * (run.motion["skirt"][-1, 6:9] - [0.2, 0, 0])
    np.testing.assert_allclose(change, impulse, atol=1e-9 * momentum)


def test_impulse_converges_in_the_step(problem: NodalProblem) -> None:
    impulses = [simulate_nodal(problem, step).force[:, 0].sum() * step for step in (8e-6, 4e-6, 2e-6, 1e-6)]
    errors = np.abs(np.array(impulses[:-1]) / impulses[-1] - 1)
    assert errors[-1] < 2e-3
    assert errors[-1] < errors[0]


def test_one_factorisation(problem: NodalProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    whole = body.factorise
    monkeypatch.setattr(body, "factorise", lambda *matrix, **known: made.append(1) or whole(*matrix, **known))
    simulate_nodal(replace(problem, duration=4e-5), 2e-6)
    assert len(made) == 1


def test_discrete_gradient_gives_the_energy_difference() -> None:
    rng = np.random.default_rng(0)
    old, new, stiffness = rng.standard_normal(200), rng.standard_normal(200), np.full(200, 3.0)
    new[:50] = old[:50] * (1 + 1e-9)
    force, slope = discrete_gradient(stiffness, old, new)
    energy = 1.5 * (np.minimum(new, 0) ** 2 - np.minimum(old, 0) ** 2)
    np.testing.assert_allclose(-force * (new - old), energy, atol=1e-12)
    assert force.min() >= 0
    h = 1e-6
    forward, backward = (discrete_gradient(stiffness, old, new + shift)[0] for shift in (h, -h))
    smooth = (np.abs(new - old) > 1e-2) & (np.abs(new) > 1e-3)
    np.testing.assert_allclose(slope[smooth], ((forward - backward) / 2 / h)[smooth], atol=1e-5)
    assert slope.max() <= 0


def test_small_products_take_one_thread_and_give_the_others_back(problem: NodalProblem) -> None:
    def threads() -> list[int]:
        return [pool["num_threads"] for pool in threadpool_info() if pool["internal_api"] == "openblas"]

    before, during = threads(), []
    with ThreadpoolController().select(internal_api="openblas").limit(limits=2):
        two = threads()
        simulate_nodal(replace(problem, duration=4e-6), 2e-6, lambda _: during.append(threads()))
        assert threads() == two
    assert threads() == before
    assert during[0] == [1] * len(before)
    blas = np.show_config(mode="dicts")["Build Dependencies"]["blas"]["name"]
    assert before or "openblas" not in blas
