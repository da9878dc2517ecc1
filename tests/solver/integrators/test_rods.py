"""A piston on a slider-crank: its motion is known, and the forces that hold it follow from Newton's law."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.points import HeldPoint
from gudgeon.solver.system.system import System
from tests.solver.systems import (
    CROWN,
    PIN,
    SPACING,
    March,
    build,
    build_all,
    driven_pair_records,
    driven_pair_scene,
    march,
    piston_records,
    piston_scene,
)

MASS, PRESSURE = 0.5, 3e6
ROUND_OFF = 1e-12
LENGTH_ERROR = 1e-9
STEP = 1e-6
SHOCK = {"ratio": 0.02, "frequency": 5000.0}


def piston(folder: Path, scene: dict[str, Any], mode_count: int = 0) -> System:
    return build(folder, piston_records(mode_count), scene)


def on_rails(folder: Path) -> tuple[System, HeldPoint]:
    """Return a rigid piston that moves along alone, touching nothing."""
    scene = piston_scene()
    scene["body"]["part"]["freedom"] = ["z"]
    system = piston(folder, scene | {"contact": {}})
    return system, system.driving.joints[0]


def travel(system: System, done: March) -> tuple[np.ndarray, np.ndarray]:
    """Return height of the pin and its rate, (n,)."""
    unit = system.bodies["part"].twists[0, 2]
    return done.snapshots[:, 0] * unit + system.driving.joints[0].anchor[1], done.snapshots[:, 1] * unit


def axial_force(held: HeldPoint, times: np.ndarray) -> np.ndarray:
    """Return what the rod must give along: m a + p A."""
    return MASS * held.joint.piston_pin(times, held.anchor[0])[:, 2] + PRESSURE * CROWN


def test_axial_motion_is_that_of_the_crank(tmp_path: Path) -> None:
    system, held = on_rails(tmp_path)
    steps, errors = np.array([3.2e-5, 1.6e-5, 8e-6, 4e-6]), []
    for step in steps:
        done = march(system, step, round(20e-3 / step))  # a whole turn
        height, rate = travel(system, done)
        exact = held.joint.piston_pin(done.times, held.anchor[0])
        errors.append([np.abs(done.snapshots[:, 2]).max(), np.abs(height - exact[:, 0]).max()])
        errors[-1].append(np.abs(rate - exact[:, 1]).max())
    assert max(errors[-1][:2]) < LENGTH_ERROR
    # g + ½ dt ġ = 0 leaves a length error of one order more than the rates have.
    orders = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    np.testing.assert_allclose(orders, [3.0, 3.0, 2.0], atol=0.2)


def test_rod_carries_inertia_and_gas(tmp_path: Path) -> None:
    system, held = on_rails(tmp_path)
    steps, errors = np.array([3.2e-5, 1.6e-5, 8e-6, 4e-6]), []
    for step in steps:
        done = march(system, step, round(20e-3 / step))
        np.testing.assert_array_equal(done.loads[:, 2], PRESSURE)
        middle = done.times - 0.5 * step
        along = axial_force(held, middle)
        across = along * held.joint.tangent(middle, held.anchor[0])
        error = done.loads[:, :2] - np.column_stack([across, along])
        errors.append(np.abs(error[5:]).max() / np.abs(along).max())  # the first steps take the rod's force up
    assert errors[-1] < 1e-6
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("clearance", [0.0, 1e-6])
def test_combustion_pushes_the_piston_to_its_thrust_side(tmp_path: Path, clearance: float) -> None:
    """After the dead centre the crank pin is at -x, the rod leans and pushes the pin to +x; the right wall answers."""
    system = piston(tmp_path, piston_scene(clearance=clearance, step=STEP, samples=5000))
    run, held = simulate(system), system.driving.joints[0]
    late = run.times > 1e-3
    middle = run.times[late] - 0.5 * STEP
    assert (held.joint.crank_pin(middle)[:, 0] > 0.01).all()  # lateral is -x
    expected = axial_force(held, middle) * np.abs(held.joint.tangent(middle, held.anchor[0]))
    rod = run.joints["rod"].force[late]
    assert (rod[:, 0] > 0).all()
    assert rod[:, 0].mean() == pytest.approx(expected.mean(), rel=1e-2)
    walls = run.contacts["right"].force[late, 0] + run.contacts["left"].force[late, 0]
    assert -walls.mean() == pytest.approx(expected.mean(), rel=1e-2)
    assert run.contacts["right"].force[:, 0].max() <= 0.0
    assert run.contacts["left"].force[:, 0].min() >= 0.0
    assert run.motion["part"][late, 0].mean() > 0.0


@pytest.mark.parametrize("clearance", [0.0, 2e-5])
def test_balances_of_a_guided_piston(tmp_path: Path, clearance: float) -> None:
    steps = (4e-6, 2e-6, STEP, STEP / 2)
    scenes = [piston_scene(clearance=clearance, step=step, samples=10_000) for step in steps]
    systems = [piston(tmp_path / str(number), scene) for number, scene in enumerate(scenes)]
    runs = [simulate(system) for system in systems]
    for run in runs:
        assert run.momentum_residual < ROUND_OFF
    lengths = [np.abs(run.joints["rod"].violation).max() for run in runs]
    assert max(lengths) < LENGTH_ERROR
    # Only a rod that answers what contact does within the step stays below a tenth of what it would miss.
    assert lengths[2] < 1e-12
    assert np.polyfit(np.log(steps), np.log(lengths), 1)[0] == pytest.approx(3.0, abs=0.2)
    assert max(run.energy_drift for run in runs) < 1e-8
    system, run = systems[-1], runs[-1]
    start = 0.5 * system.velocity @ system.velocity
    gained, work = run.energies[-1, :4].sum() - start, work_of_loads(system, run.motion["part"], run)
    assert abs(gained) > 1.0
    assert gained == pytest.approx(work, rel=1e-4)
    assert run.energies[-1, 4] == pytest.approx(work, rel=1e-9)


def work_of_loads(system: System, motion: np.ndarray, run: Any) -> float:
    """Return the work of gas and rod from forces and rigid motion alone [J]; a sample is a step."""
    start = system.bodies["part"].centre_motion(system.position)
    moved = np.diff(np.vstack([start, motion[:, :6]]), axis=0)
    arm = np.array([PIN, 0.0, -0.005])
    pin = moved[:, :3] + np.cross(moved[:, 3:], arm)
    rod = np.einsum("ni,ni->", run.joints["rod"].force, pin)
    return float(rod - PRESSURE * CROWN * moved[:, 2].sum())


def test_pin_stays_on_the_circle_around_the_crank_pin(tmp_path: Path) -> None:
    """Told from the rigid motion alone, with a piston that shifts and tilts."""
    system = piston(tmp_path, piston_scene(clearance=2e-5, step=STEP, samples=5000))
    run, held = simulate(system), system.driving.joints[0]
    motion, arm = run.motion["part"], np.array([PIN, 0.0, -0.005])
    assert np.ptp(motion[:, 0]) > 1e-5
    assert np.ptp(motion[:, 4]) > 1e-4
    pin = arm + motion[:, :3] + np.cross(motion[:, 3:6], arm)
    crank = held.joint.crank_pin(run.times)
    length = np.hypot(-pin[:, 0] - crank[:, 0], pin[:, 2] - crank[:, 1])
    np.testing.assert_allclose(length, held.joint.rod_length, rtol=0, atol=LENGTH_ERROR)
    np.testing.assert_allclose(run.joints["rod"].angle, np.radians(20.0) + 100 * np.pi * run.times, rtol=1e-12)


@pytest.mark.parametrize("damping", [None, SHOCK])
def test_balances_of_an_elastic_piston(tmp_path: Path, damping: dict[str, float] | None) -> None:
    """R couples pin, crown and guides."""
    scene = piston_scene(clearance=1e-4, step=STEP)
    scene["body"]["part"]["damping"] = damping
    run = simulate(piston(tmp_path, scene, mode_count=6))
    assert run.counts["contact_steps"] > 1000
    assert run.energy_drift < 5e-3
    assert run.momentum_residual < ROUND_OFF
    if damping is not None:
        assert np.diff(run.energies[:, 3]).min() > -1e-12


@pytest.mark.parametrize(("mode_count", "damping"), [(0, None), (6, SHOCK)])
def test_balances_of_a_piston_that_slides_over_a_plate(
    tmp_path: Path, mode_count: int, damping: dict[str, float] | None
) -> None:
    runs = []
    for number, step in enumerate((4e-6, 2e-6, STEP, STEP / 2)):
        scene = driven_pair_scene(clearance=2e-5, step=step)
        for body in scene["body"].values():
            body["damping"] = damping
        runs.append(simulate(build_all(tmp_path / str(number), driven_pair_records(mode_count), scene)))
        assert runs[-1].counts["functions"] > 0
        assert runs[-1].momentum_residual < ROUND_OFF
    run, drifts = runs[-1], [run.energy_drift for run in runs]
    assert np.ptp(run.motion["part"][:, 2]) > 5 * SPACING
    # By Newton's law, 4.05 kN without the slaps of the first millisecond.
    assert -run.contacts["right"].force[run.times > 1e-3, 0].mean() == pytest.approx(4.05e3, rel=0.02)
    assert (np.diff(drifts) < 0).all()
    assert drifts[-1] < 2e-4
    if mode_count == 0:
        assert np.abs(run.joints["rod"].violation).max() < LENGTH_ERROR


def test_an_elastic_piston_starts_at_the_length_of_its_rod(tmp_path: Path) -> None:
    system = piston(tmp_path, piston_scene(clearance=1e-4), mode_count=6)
    driving = system.driving
    (held,) = driving.joints
    place = held.anchor + (driving.rows @ system.position + driving.residual @ system.loads)[:2]
    length = np.hypot(*(place - driving.crank(np.zeros(1))[0, 0, :2]))
    assert length == pytest.approx(held.joint.rod_length, abs=LENGTH_ERROR)
    done = march(system, STEP, 3)
    np.testing.assert_allclose(done.loads[:, 1], axial_force(held, done.times), rtol=1e-2)


def test_an_elastic_piston_keeps_its_energy_at_any_step(tmp_path: Path) -> None:
    drifts = []
    for number, step in enumerate((2e-6, STEP, STEP / 2, STEP / 4)):
        scene = piston_scene(clearance=2e-5, step=step)
        drifts.append(simulate(piston(tmp_path / str(number), scene, mode_count=6)).energy_drift)
    assert max(drifts) < 1e-9
