"""The implicit integrator over ports: its table, friction in the plane, rest, joints and dashpots."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.integrators.outcome import Samples
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.ports.members import contact_ports, ports_of
from gudgeon.solver.simulate import simulate
from tests.solver.features import HALF, PIN, pairs, store_of, system_of
from tests.solver.systems import build, rigid_records

FRICTION = {"static": 0.3, "kinetic": 0.2}
DOWN = (0.0, 0.0, -9.81)
FLOOR = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}


def block(
    folder: Path, *, points: Any = (0.0, 0.0, 0.0), gravity: Any = (0.0, 0.0, -9.81), **settings: Any
) -> Trajectory:
    """Run a rigid block that stands on a floor and does not turn."""
    contact = {"body": "part", "interface": "foot", "against": FLOOR, "method": "constraint", "friction": FRICTION}
    run = {"integrator": "small", "gravity": list(gravity), "samples": 20, "frames": 4, "checks": False}
    scene = {
        "body": {"part": {"velocity": settings.pop("velocity", [0.0, 0.0, 0.0])}},
        "contact": {"floor": contact | settings.pop("contact", {})},
        "run": run | settings,
    }
    return simulate(build(folder, rigid_records(1.0, {"foot": (points, (0.0, 0.0, -1.0))}), scene))


@pytest.mark.parametrize("names", pairs()[::7], ids="+".join)
def test_the_table_has_what_the_system_has(names: tuple[str, str], tmp_path: Path) -> None:
    system = system_of(store_of(tmp_path), names)
    ports = ports_of(system)
    normals = np.concatenate([contact_ports(ports, contact) for contact in system.contacts])
    np.testing.assert_allclose(ports.rows[normals], system.rows.dense(), atol=1e-12)
    np.testing.assert_allclose(ports.offset[normals], system.gap, atol=1e-15)
    residual = ports.residual.dense()
    scale = np.abs(residual).max() + 1e-300
    np.testing.assert_allclose(residual[np.ix_(normals, normals)], system.residual.dense(), rtol=0, atol=1e-12 * scale)
    driven = system.driving
    held = [*(f"joint.{one.name}" for one in driven.joints), *(f"force.{one.name}" for one in driven.given)]
    held += [f"motion.{one.name}" for one in driven.drives]
    loaded = np.concatenate([np.empty(0, int), *(np.r_[ports.of(name)] for name in held)]).astype(int)
    np.testing.assert_allclose(ports.rows[loaded], system.driving.rows, atol=1e-12)
    here = np.ix_(loaded, loaded)
    np.testing.assert_allclose(residual[here], system.driving.residual, rtol=0, atol=1e-12 * scale)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 45.0, 77.0, 200.0])
def test_a_thrown_block_slides_straight_at_any_angle(degrees: float, tmp_path: Path) -> None:
    """It loses μ g t of its velocity, in its direction."""
    speed, duration, across = 1.0, 0.1, np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    found = block(tmp_path, velocity=(speed * across).tolist(), duration=duration, step=1e-3)
    wanted = (speed - FRICTION["kinetic"] * 9.81 * duration) * across
    np.testing.assert_allclose(found.velocities[-1, :3], wanted, rtol=0, atol=1e-12)
    assert found.energy_drift < 1e-12


@pytest.mark.parametrize("degrees", [0.0, 33.0])
def test_a_block_on_an_incline_does_not_creep(degrees: float, tmp_path: Path) -> None:
    """Rigid contact below the angle of friction for 1000 s."""
    pull = 0.28 * 9.81 * np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    found = block(tmp_path, gravity=(*pull[:2], -9.81), duration=1000.0, step=0.02)
    assert np.abs(found.frames[-1]).max() < 1e-12


@pytest.mark.parametrize("degrees", [0.0, 33.0])
def test_a_block_beyond_the_angle_of_friction_slides(degrees: float, tmp_path: Path) -> None:
    across = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    pull, duration = 0.32 * 9.81, 0.1
    found = block(tmp_path, gravity=(*(pull * across)[:2], -9.81), duration=duration, step=1e-3)
    wanted = (pull - FRICTION["kinetic"] * 9.81) * duration * across
    np.testing.assert_allclose(found.velocities[-1, :3], wanted, rtol=1e-9, atol=1e-12)


def marched(names: tuple[str, ...], folder: Path, **run: Any) -> tuple[Small, list[np.ndarray], list[np.ndarray]]:
    """Take 100 steps; returns the integrator, and after each step the joint's force and the direction of its rod."""
    system = system_of(store_of(folder), names, **run)
    integrator, forces, rods = Small(system, 2e-6), [], []
    r, driven = len(system.rigid), system.driving
    here = integrator.ports.of("joint.crank")
    for step in range(100):
        samples = Samples(
            np.zeros((1, len(system.contacts), 3)), np.zeros((1, 5)), np.zeros((1, len(driven.rows))),
            np.zeros((1, 2 * r + 1)), np.zeros((1, len(system.gauge_rows))),
        )  # fmt: skip
        assert integrator.advance(step, 1, samples)
        forces.append(integrator.arrays.state.unknown[here].copy())
        rods.append(integrator.arrays.state.rod[0, :2].copy())
    return integrator, forces, rods


@pytest.mark.parametrize("other", ["gauges", "spring"])
def test_the_force_of_a_rod_acts_along_it(other: str, tmp_path: Path) -> None:
    """Also where the rod turns, at a joint with and without residual flexibility."""
    _, forces, rods = marched(("joint", other), tmp_path)
    for force, rod in zip(forces, rods, strict=True):
        assert abs(force[0] * rod[1] - force[1] * rod[0]) <= 1e-9 * np.linalg.norm(force)


@pytest.mark.parametrize("names", [("joint", "gauges"), ("joint", "spring")], ids="+".join)
def test_a_joint_starts_with_a_rod_of_constant_length(names: tuple[str, ...], tmp_path: Path) -> None:
    """The body moves sideways at the start, and turns: its velocity along is that of a rod of constant length."""
    system = system_of(store_of(tmp_path), names)
    joint = system.driving.joints[0].joint
    pin, crank = system.driving.rows[:2] @ system.velocity, joint.crank_pin(np.zeros(1))[0]
    assert pin[0] > 0.1
    reach = np.array([PIN[0] - crank[0], system.driving.joints[0].anchor[1] - crank[1]])
    assert reach @ (pin - crank[2:]) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("step", [1e-5, 5e-6, 1e-6])
@pytest.mark.parametrize("names", [("wave-guide", "gauges"), ("damping", "gauges")], ids="+".join)
def test_damped_flexibility_loses_what_its_dashpot_takes(names: tuple[str, ...], step: float, tmp_path: Path) -> None:
    """Its force jumps when contact closes; the balance holds at any step, also of dt·ω_c = 0.6."""
    found = simulate(system_of(store_of(tmp_path), names, step=step))
    assert found.result == "FINISHED"
    assert found.energy_drift < 1e-7
    assert found.energies[-1, 3] > 0.0


def test_a_rigid_impact_has_an_impulse_and_no_force(tmp_path: Path) -> None:
    """Its impulse over a step is no peak force, which would grow without end as the step falls."""
    found = simulate(system_of(store_of(tmp_path), ("impact", "automatic-step")))
    assert found.result == "FINISHED"
    assert found.quantities.get("wall-a-0.force_peak_raw", {"value": 0.0})["value"] < 1e-9
    assert found.quantities["wall-a-0.impulse"]["value"] > 0.1


def test_units_do_not_matter(tmp_path: Path) -> None:
    """A block thrown askew, in metres and in units of a thousandth, with friction."""
    one = block(tmp_path / "one", velocity=[0.4, 0.3, 0.0], duration=0.1, step=1e-3)
    factor = 1e-3
    other = block(
        tmp_path / "other", velocity=[0.4 * factor, 0.3 * factor, 0.0], gravity=(0, 0, -9.81 * factor), duration=0.1,
        step=1e-3,
    )  # fmt: skip
    np.testing.assert_allclose(other.velocities[-1], factor * one.velocities[-1], rtol=1e-9, atol=1e-15)


def test_corners_share_the_load_of_friction(tmp_path: Path) -> None:
    """Four points of a block that cannot turn: the sum of their friction is μ times its weight."""
    corners = [[x, y, 0.0] for x in (-HALF, HALF) for y in (-HALF, HALF)]
    found = block(tmp_path, points=corners, velocity=[0.3, 0.4, 0.0], duration=0.1, step=1e-3)
    np.testing.assert_allclose(found.velocities[-1, :3], (0.5 - 0.2 * 0.981) * np.array([0.6, 0.8, 0.0]), atol=1e-9)


@pytest.mark.parametrize("gap", [1e-20, 3e-7, 2e-6])
def test_a_block_that_lands_stays(gap: float, tmp_path: Path) -> None:
    """It closes within a step, by round-off or in fact, and then lies on the floor and neither hovers nor sinks."""
    found = block(tmp_path, points=(0.0, 0.0, gap), velocity=[0.4, 0.3, 0.0], duration=0.1, step=1e-3)
    assert found.frames[-1, 2] == pytest.approx(-gap, abs=1e-12)
    assert found.velocities[-1, 2] == pytest.approx(0.0, abs=1e-12)
    assert found.energy_drift < 1e-9
