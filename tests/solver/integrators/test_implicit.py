"""The implicit integrator against located events and against exact decay."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.systems import block_records, block_scene, build, march, rod_records, rod_scene

ROUND_OFF = 1e-11
ORDER = 0.2
"""How far an observed order may be from 2."""
FAR = {"shape": "plane", "point": [1.0, 0, 0], "normal": [-1, 0, 0]}
NEARBY = np.linspace(1.0, 1.4, 12)
"""Contact opens and closes between steps, and where makes the error of one step size random: the root mean
square over so many is taken."""
LAYER = {"surface_stiffness": 1e13}
CASES = {
    "block": (block_records(12), block_scene(**LAYER), 1.6e-6),
    "block without layer": (block_records(12), block_scene(), 4.8e-7),
    "rod": (rod_records(12), rod_scene(**LAYER), 6.4e-7),
}
"""Records, scene, and largest step."""
SHOCK = {"ratio": 0.05, "frequency": 5000.0}


def run_with(system: System, integrator: str, step: float | None = None) -> Trajectory:
    """Run a system with another integrator and step."""
    settings = system.scene.model_dump()
    settings["run"] |= {"integrator": integrator, "step": step, "frames": 10, "checks": False}
    return simulate(replace(system, scene=Scene.model_validate(settings)))


def value(run: Trajectory, name: str) -> float:
    return run.quantities[f"wall.{name}"]["value"]


@pytest.mark.parametrize("name", CASES)
def test_converges_to_the_answer_of_events_with_order_two(name: str, tmp_path: Path) -> None:
    records, scene, largest = CASES[name]
    system = build(tmp_path, records, scene)
    exact = run_with(system, "event")
    steps, runs = largest * 2.0 ** -np.arange(0, 3.5, 0.7), []
    errors, drifts = [], []
    for step in steps:
        runs = [run_with(system, "small", step * factor / NEARBY[-1]) for factor in NEARBY]
        errors.append(np.sqrt(np.mean([(value(run, "impulse") / value(exact, "impulse") - 1) ** 2 for run in runs])))
        drifts.append(np.sqrt(np.mean([run.energy_drift**2 for run in runs])))
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=ORDER)
    assert errors[-1] < 3e-6
    assert drifts[0] < 2e-4  # Round-off where one point touches, or a layer takes what opens and closes.
    assert drifts[-1] < 1e-5
    assert value(runs[0], "restitution") == pytest.approx(value(exact, "restitution"), abs=1e-5)
    # Contact begins and ends with a step.
    assert value(runs[0], "duration") == pytest.approx(value(exact, "duration"), abs=1.5 * steps[-1])


@pytest.mark.parametrize("settings", [{}, {"surface_stiffness": 1e14}, {"method": "penalty", **LAYER}])
@pytest.mark.parametrize("damping", [None, SHOCK])
def test_balances_of_a_coupled_impact(tmp_path: Path, settings: dict[str, Any], damping: dict[str, float]) -> None:
    scene = block_scene(**settings)
    scene["body"]["part"]["damping"] = damping
    run = run_with(build(tmp_path, block_records(12), scene), "small", 2e-7)
    assert value(run, "impulse") > 1.0
    # A damped point meets the wall with a jump of its force, which the layer alone makes smooth.
    assert run.energy_drift < (1e-3 if damping is None or settings else 5e-3)
    assert run.momentum_residual < ROUND_OFF
    assert (run.energies[-1, 3] > 0.01 * run.energies[0].sum()) == (damping is not None)
    assert np.diff(run.energies[:, 3]).min() > -1e-13
    impulse = np.linalg.norm(run.contacts["wall"].force.sum(axis=0) * (run.times[1] - run.times[0]))
    assert impulse == pytest.approx(value(run, "impulse"), rel=1e-12)
    assert run.contacts["wall"].multipliers.min() > -1e-6 * run.contacts["wall"].multipliers.max()


@pytest.mark.parametrize("settings", [{}, {"surface_stiffness": 1e13}])
@pytest.mark.parametrize("damping", [None, SHOCK])
def test_gaps_close_where_the_motion_ends(tmp_path: Path, settings: dict[str, Any], damping: Any) -> None:
    """Told from the state itself: a wrong matrix would leave gaps of order dt², which no order of convergence shows."""
    scene = block_scene(**settings)
    scene["body"]["part"]["damping"] = damping
    system = build(tmp_path, block_records(12), scene)
    touching = 0
    for steps in range(15, 60, 5):
        run = march(system, 1e-6, steps).run
        force = run.points.multipliers
        gaps = system.gap + system.rows @ run.modes.q + run.points.residual_displacement + system.layer * force
        closed = force > 0
        touching += int(closed.sum())
        assert force.min() >= 0.0
        np.testing.assert_allclose(gaps[closed], 0.0, atol=ROUND_OFF * np.abs(system.gap).max())
        assert gaps.min() >= -ROUND_OFF * np.abs(system.gap).max()
    assert touching > 20


def test_a_given_step_is_obeyed_however_large(tmp_path: Path) -> None:
    system = build(tmp_path, block_records(5), block_scene())
    large = 30 / system.critical_frequency()
    run = run_with(system, "small", large)
    assert run.counts["substeps"] == 1
    # Whole frames end with the run: the step is that much shorter, and no shorter.
    assert 0.9 * large < run.counts["step"] <= large
    assert run_with(system, "small", 10 * large).counts["substeps"] == 8


def test_step_by_itself(tmp_path: Path) -> None:
    for name, damping, factor in (("alone", None, 0.4), ("damped", SHOCK, 4.0)):
        scene = block_scene(duration=4e-3)
        scene["body"]["part"]["damping"] = damping
        scene["run"] |= {"integrator": "small", "frames": 4, "checks": False}
        run = simulate(build(tmp_path / name, block_records(5), scene))
        assert 0.9 * factor < run.counts["step"] * run.counts["critical_frequency"] <= factor * (1 + 1e-12)
    assert run.times[-1] == pytest.approx(scene["run"]["duration"], rel=1e-12)


def test_a_mode_decays_as_its_damping_says(tmp_path: Path) -> None:
    scene = block_scene(duration=2e-3, against=FAR)
    scene["body"]["part"] = {"damping": {"ratio": 0.1, "frequency": 5000.0}}
    system = build(tmp_path, block_records(4), scene)
    mode = 6  # the first elastic one
    beta, omega = 0.1 / (np.pi * 5000.0), np.sqrt(system.stiffness[mode])
    run = run_with(replace(system, velocity=np.eye(14)[mode]), "small", 7e-6)
    t, turn = run.frame_times, omega * np.sqrt(1 - (0.5 * beta * omega) ** 2)
    decay = np.exp(-0.5 * beta * omega**2 * t)
    assert decay[-1] < 0.6
    np.testing.assert_allclose(run.frames[:, mode], decay * np.sin(turn * t) / turn, atol=ROUND_OFF / turn)
    np.testing.assert_allclose(np.delete(run.frames, mode, axis=1), 0.0)
    # Nothing is exchanged by contact, so that the balance is held against the energy at the start, ½.
    np.testing.assert_allclose(run.energies.sum(axis=1), 0.5, rtol=ROUND_OFF)
    assert run.energies[-1, 3] == pytest.approx(0.5, abs=0.5 * decay[-1] ** 2 + 1e-3)


def test_residual_flexibility_is_a_kelvin_voigt_element(tmp_path: Path) -> None:
    """A mass with one point and no modes: m ẍ = −λ, λ R = x + β ẋ until the force ends."""
    records, scene = block_records(1, mode_count=0), block_scene(duration=3e-4)
    scene["body"]["part"] = {"velocity": [1.0, 0, 0], "freedom": ["x"], "damping": {"ratio": 0.2, "frequency": 8000.0}}
    system = build(tmp_path, records, scene)
    R, beta, mass = system.residual[0][0], 0.2 / (np.pi * 8000.0), 2.0

    def force(y: np.ndarray) -> float:
        return (y[0] + beta * y[1]) / R

    def ends(_: float, y: np.ndarray) -> float:
        return force(y)

    ends.terminal, ends.direction = True, -1  # type: ignore[attr-defined]
    exact = solve_ivp(lambda _, y: [y[1], -force(y) / mass], (0, 1e-3), [0.0, 1.0], events=ends, rtol=1e-10, atol=1e-14)
    restitution = -exact.y[1, -1]
    assert 0.2 < restitution < 0.95
    run = run_with(system, "small", 1e-7)
    # The force starts with a jump somewhere in a step: order one.
    assert value(run, "restitution") == pytest.approx(restitution, rel=5e-3)
    # What is left in the element after the force ends is lost in its own time.
    assert run.energies[-1, 3] == pytest.approx(0.5 * mass * (1 - restitution**2), rel=1e-2)
    assert run.energy_drift < 5e-3
