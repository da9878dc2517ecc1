"""The full FE of a body that a rod drives or that damping slows: laws that rigid and modal answers give."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.nodal.problem import NodalBody, NodalContact, NodalLoad, NodalProblem, NodalRod
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.nodal.start import static_start
from tests.pipeline.blocks import block, free_body, on_plane, plane_twists

RADIUS, LENGTH, RATE = 0.04, 0.14, 400.0
"""Crank radius and rod [m], crank speed [rad/s]."""
GAS = 8e3
"""Load on the crown [N]."""
PLANE = np.array([[1.0, 0, 0], [0, 0, 1.0]])


def crank(times: np.ndarray) -> np.ndarray:
    sine, cosine = RADIUS * np.sin(RATE * times), RADIUS * np.cos(RATE * times)
    return np.column_stack([sine, cosine, RATE * cosine, -RATE * sine])


def piston(model: FEModel, gas: Callable[[np.ndarray], np.ndarray], *, rigid: bool, guided: bool) -> NodalProblem:
    """Return a block on a rod at the upper dead centre, loaded from above, between two stiff walls if it is guided.

    The rod holds its centre of mass and does not deform it if it is to be rigid, else the node in the middle.
    """
    size = model.K.shape[0]
    top = on_plane(model, 2, 0.04)
    middle = np.flatnonzero(np.linalg.norm(model.nodes - [0, 0, 0.02], axis=1) < 1e-9)
    if rigid:
        rows = [np.tile(axis, len(model.nodes)) @ model.M / model.properties.mass for axis in PLANE]
    else:
        rows = [model.rows(middle, axis[None]).toarray()[0] for axis in PLANE]
    down = np.asarray(model.rows(top, np.tile([0, 0, -1.0], (len(top), 1))).sum(axis=0)).ravel() / len(top)
    load = NodalLoad(down[None], lambda times: gas(times)[:, None])
    contacts = {}
    for name, side in (("thrust", 1.0), ("anti-thrust", -1.0)) if guided else ():
        nodes = on_plane(model, 0, 0.02 * side)
        inward = np.tile([-side, 0, 0], (len(nodes), 1))
        contacts[name] = NodalContact(
            sparse.csr_matrix(model.rows(nodes, inward)), np.zeros(len(nodes)), np.full(len(nodes), 1e9), inward
        )
    rod = NodalRod("rod", np.array(rows), np.array([0.0, RADIUS + LENGTH]), LENGTH, crank, PLANE)
    slave = free_body("piston", model, np.zeros(size), twists=plane_twists(model), loads=(load,))
    return NodalProblem(slave, contacts, 2e-3, rod=rod)


@pytest.fixture(scope="module")
def stiff() -> FEModel:
    return block((0.04, 0.04, 0.04), (2, 2, 2), E=1e14)


@pytest.fixture(scope="module")
def soft() -> FEModel:
    return block((0.04, 0.04, 0.04), (2, 2, 2))


def constant(times: np.ndarray) -> np.ndarray:
    return np.full(len(times), GAS)


def length_errors(run: NodalRecord, offset: float = 0.0) -> np.ndarray:
    """Return the errors of the rod's length [m] after each step.

    Args:
        offset: Initial error of the centre's height [m].
    """
    place = run.motion["piston"][:, [0, 2]] + [0.0, RADIUS + LENGTH + offset]
    return np.linalg.norm(place - crank(run.times)[:, :2], axis=1) - LENGTH


def test_side_force_is_the_axial_force_times_the_tangent_of_the_rod(stiff: FEModel) -> None:
    run = simulate_nodal(static_start(piston(stiff, constant, rigid=True, guided=True), 4e-6), 4e-6)
    middle = run.times - run.step / 2
    angle = RATE * middle
    across = RADIUS * np.sin(angle)
    height = np.sqrt(LENGTH**2 - across**2)
    swing = RADIUS * RATE * np.cos(angle)
    curve = (-(swing**2) + across * RATE**2 * across - (across * swing / height) ** 2) / height
    acceleration = -RADIUS * RATE**2 * np.cos(angle) + curve
    expected = (GAS + stiff.properties.mass * acceleration) * across / height
    assert np.abs(expected).max() > 1000
    np.testing.assert_allclose(run.force[:, 0], expected, atol=5e-3 * np.abs(expected).max())
    np.testing.assert_allclose(run.forces["rod"][:, 0], -expected, atol=5e-3 * np.abs(expected).max())
    assert np.abs(run.motion["piston"][:, 0]).max() < 1e-5
    assert run.energy_drift < 1e-6
    assert set(run.forces) == {"thrust", "anti-thrust", "rod"}


def test_length_is_held_to_second_order(stiff: FEModel) -> None:
    problem = piston(stiff, constant, rigid=True, guided=False)
    steps = np.array([3.2e-5, 1.6e-5, 8e-6, 4e-6])
    errors = [np.abs(length_errors(simulate_nodal(problem, step))).max() for step in steps]
    assert errors[0] < 1e-8
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] > 1.8


def test_a_violated_length_is_brought_back_in_two_steps(stiff: FEModel) -> None:
    problem = piston(stiff, constant, rigid=True, guided=False)
    off = np.tile([0.0, 0, 1e-6], len(stiff.nodes))
    problem = replace(problem, slave=replace(problem.slave, displacement=off), duration=8e-5)
    run = simulate_nodal(problem, 4e-6)
    errors = length_errors(run, 1e-6)
    assert abs(errors[0]) < 0.6e-6
    assert np.abs(errors[1:]).max() < 1e-11


def test_static_start_does_not_ring(soft: FEModel) -> None:
    problem = replace(piston(soft, constant, rigid=False, guided=False), duration=2e-4)
    swings = []
    for start in (problem, static_start(problem, 1e-6)):
        strain = simulate_nodal(start, 1e-6).energies[:, 1]
        swings.append(np.ptp(strain) / strain.mean())
    assert swings[1] < 0.05
    assert swings[0] > 10 * swings[1]


def test_static_start_finds_the_velocity_that_the_rod_asks_for(soft: FEModel) -> None:
    """Started at rest in the middle of the stroke, 14 m/s are missing; strain neither jumps nor rings."""
    problem = replace(piston(soft, constant, rigid=False, guided=False), duration=1e-4)
    assert problem.rod is not None
    later = crank(np.array([2e-3]))[0]
    height = later[1] + np.sqrt(LENGTH**2 - later[0] ** 2)
    rod = replace(problem.rod, point=np.array([0.0, height]), crank=lambda times: crank(times + 2e-3))
    run = simulate_nodal(static_start(replace(problem, rod=rod), 1e-6), 1e-6)
    expected = later[3] - later[0] * later[2] / np.sqrt(LENGTH**2 - later[0] ** 2)
    assert run.motion["piston"][0, 8] == pytest.approx(expected, rel=1e-2)
    assert np.ptp(run.energies[:, 1]) < 0.01 * run.energies[:, 1].mean()


def test_driven_motion_is_of_second_order(soft: FEModel) -> None:
    def rise(times: np.ndarray) -> np.ndarray:
        return GAS * np.sin(np.pi * times / 4e-4) ** 2

    problem = replace(static_start(piston(soft, rise, rigid=False, guided=False), 1e-6), duration=2e-4)
    steps = np.array([8e-6, 4e-6, 2e-6, 1e-6])
    runs = [simulate_nodal(problem, step) for step in (*steps, 1.25e-7)]
    ends = [np.append(run.motion["piston"][-1, [0, 2, 4]] / RADIUS, 1e3 * run.energies[-1, 1]) for run in runs]
    errors = [float(np.linalg.norm(end - ends[-1])) for end in ends[:-1]]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2, abs=0.2)


def test_damping_takes_a_mode_down_as_it_should(soft: FEModel) -> None:
    values, shapes = eigh(soft.K.toarray(), soft.M.toarray(), subset_by_index=[6, 6])
    omega = float(np.sqrt(values[0]))
    beta = 0.04 / omega
    free = free_body("block", soft, 1e-3 * shapes[:, 0], damping=beta)
    run = simulate_nodal(NodalProblem(free, {}, 20 / omega), 0.02 / omega)
    energy = run.energies.sum(axis=1)
    expected = energy[0] * np.exp(-beta * omega**2 * (run.times - run.times[0]))
    # The energy of a damped mode swings about its mean decay by the damping ratio.
    np.testing.assert_allclose(energy, expected, rtol=1.2 * beta * omega)
    periods = np.exp(-beta * omega**2 / 2 * 6 * np.pi / omega)
    at = round(6 * np.pi / 0.02)
    assert np.sqrt(energy[at] / energy[0]) == pytest.approx(periods, rel=2e-3)


def test_suppressed_motions_stay_away(soft: FEModel) -> None:
    """A push off the centre turns the body, but not about the axes that are not free."""
    row = np.eye(soft.K.shape[0])[1] + np.eye(soft.K.shape[0])[0]
    push = NodalLoad(row[None], lambda times: np.full((len(times), 1), 1e2))
    body: NodalBody = free_body("block", soft, np.zeros(soft.K.shape[0]), twists=plane_twists(soft), loads=(push,))
    motion = simulate_nodal(NodalProblem(body, {}, 1e-4), 1e-6).motion["block"]
    assert np.abs(motion[-1, [1, 3, 5]]).max() == 0
    acceleration = 1e2 / soft.properties.mass
    assert motion[-1, 6] == pytest.approx(acceleration * 1e-4, rel=1e-9)
    assert body.suppressed is not None
    shares = soft.rigid_modes.T @ (soft.M @ np.column_stack([body.rigid, body.suppressed]))
    np.testing.assert_allclose(shares @ shares.T, np.eye(6), atol=1e-10)
