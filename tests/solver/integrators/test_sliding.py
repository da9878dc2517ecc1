"""Pairs that slide over a traction space: balances, translation, renewal of the matrix, the end of the space."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.traction import cubic_weights
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.contact.blocks import full
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.systems import SPACING, block_records, build_all, march, pair_scene, plate_records

STEP = 1e-6
"""About a tenth of the shortest period [s]."""
DRIFT = 1e-3
ROUND_OFF = 1e-12
DAMPED = {"ratio": 0.01, "frequency": 5000.0}


def pair(folder: Path, scene: dict[str, Any], **plate: Any) -> System:
    return build_all(folder, {"part": block_records(20), "plate": plate_records(**plate)}, scene)


def impulse(run: Trajectory) -> float:
    return run.quantities["slide.impulse"]["value"]


def test_balances_at_ten_metres_per_second(tmp_path: Path) -> None:
    """The drag of the deformed plate is part of them: without it the drift would not fall with the step."""
    drifts = []
    for number, step in enumerate((4e-6, 2e-6, STEP, STEP / 2, STEP / 4)):
        run = simulate(pair(tmp_path / str(number), pair_scene(step=step)))
        assert run.quantities["slide.impulse"]["value"] > 0.4
        assert run.momentum_residual < ROUND_OFF
        drifts.append(run.energy_drift)
    assert drifts[2] < DRIFT
    assert (np.diff(drifts) < 0).all()
    assert drifts[-1] < drifts[0] / 8


def test_balances_with_damping(tmp_path: Path) -> None:
    scene = pair_scene(step=STEP / 4)
    for body in scene["body"].values():
        body["damping"] = DAMPED
    run = simulate(pair(tmp_path, scene))
    assert run.energy_drift < DRIFT
    assert run.momentum_residual < ROUND_OFF
    assert np.diff(run.energies[:, 3]).min() > -1e-15
    # The block falls on the plate with 2.5 mJ and is pressed on it.
    assert 5e-4 < run.energies[-1, 3] < 2.5e-3


@pytest.mark.parametrize("damping", [None, DAMPED])
def test_at_rest_it_is_a_pair_with_fixed_weights(tmp_path: Path, damping: dict[str, float] | None) -> None:
    scene = pair_scene(0.0, duration=2e-3, step=STEP)
    scene["body"]["part"]["freedom"] = ["x", "rz", "ry"]
    for body in scene["body"].values():
        body["damping"] = damping
    system = pair(tmp_path, scene)
    slides, stands = simulate(system), simulate(frozen(system))
    assert slides.counts["functions"] > 0
    assert stands.counts["functions"] == 0
    force, expected = (run.contacts["slide"].force for run in (slides, stands))
    np.testing.assert_allclose(force, expected, rtol=0, atol=ROUND_OFF * np.abs(expected).max())
    np.testing.assert_allclose(slides.velocities, stands.velocities, rtol=0, atol=ROUND_OFF)
    if damping is None:
        np.testing.assert_allclose(slides.energies, stands.energies, rtol=0, atol=ROUND_OFF)


@pytest.mark.parametrize("over_ports", [False, True])
@pytest.mark.parametrize("speed", [1e-18, 1e-22])
def test_drag_of_a_way_of_round_off_is_that_of_the_slope(
    tmp_path: Path, over_ports: bool, speed: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The drag is a quotient of two changes in a step, both round-off where hardly anything slides."""
    if over_ports:
        monkeypatch.setattr(Scene, "general", property(lambda self: True))
    slow, quick = (
        simulate(pair(tmp_path / name, pair_scene(along, duration=2e-4, step=STEP, checks=False)))
        for name, along in (("slow", speed), ("quick", 1e-6))
    )
    gained = [run.quantities["part.velocity_y"]["value"] for run in (slow, quick)]
    assert gained[0] - speed == pytest.approx(gained[1] - 1e-6, rel=0.02)
    assert impulse(slow) == pytest.approx(impulse(quick), rel=1e-9)
    assert slow.energy_drift < DRIFT
    assert slow.momentum_residual < ROUND_OFF


def frozen(system: System) -> System:
    """Replace the traction space by the displacements that its functions have at the points at the start."""
    (contact,) = system.contacts
    over, F, m = contact.master, len(system.functions), len(system.velocity)
    assert over is not None
    where = (over.height - over.chart[0]) / over.chart[1]
    first, weights = np.floor(where).astype(int), np.zeros((len(system.gap), F))
    for i, along in enumerate(cubic_weights(where - first)):
        for b in range(4):
            f = (first[i] + b) * over.counts[0] + over.place[i]
            weights[i, f : f + 4] = along[b] * over.across[i]
    return replace(
        system,
        rows=full(system.rows.dense() + weights @ system.functions),
        residual=full(system.residual.dense() + weights @ system.function_residual @ weights.T),
        functions=full(np.zeros((0, m))), function_residual=full(np.zeros((0, 0))),
        contacts=[replace(contact, master=None, functions=slice(0, 0))],
    )  # fmt: skip


def test_answer_does_not_depend_on_when_the_matrix_is_renewed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    system, found = pair(tmp_path, pair_scene(step=STEP)), []
    for refresh in (0.02, 0.5):
        monkeypatch.setattr("gudgeon.solver.integrators.implicit.integrator.REFRESH", refresh)
        found.append(impulse(simulate(system)))
    assert found[1] == pytest.approx(found[0], rel=1e-6)


@pytest.mark.parametrize("refresh", [0.05, 0.2, 0.5])
def test_matrix_is_renewed_as_often_as_the_way_asks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refresh: float
) -> None:
    monkeypatch.setattr("gudgeon.solver.integrators.implicit.integrator.REFRESH", refresh)
    done = march(pair(tmp_path, pair_scene(step=STEP)), STEP, 4000)
    way = done.run.masters.sigma[0, 0]
    assert way == pytest.approx(10.0 * 4e-3, rel=1e-3)
    assert done.run.outcome().counts[3] == pytest.approx(way / (refresh * SPACING), abs=2)


def test_at_rest_one_matrix_is_enough(tmp_path: Path) -> None:
    done = march(pair(tmp_path, pair_scene(0.0)), STEP, 2000)
    assert done.run.outcome().counts[3] == 1


def test_force_is_the_same_wherever_the_block_lands(tmp_path: Path) -> None:
    """A rigid plate whose R depends on distances alone: what is left is the ripple of the splines."""
    peaks, impulses = [], []
    for number, offset in enumerate(np.linspace(0.0, SPACING, 7)):
        scene = pair_scene(0.0, press=0.0, duration=3e-4, step=STEP)
        scene["body"]["part"] |= {"freedom": ["x"], "position": [-0.05 - 1e-6, offset, 0.003]}
        run = simulate(pair(tmp_path / str(number), scene, mode_count=0, nugget=0.0))
        peaks.append(run.quantities["slide.force_peak"]["value"])
        impulses.append(impulse(run))
    for found, ripple in ((peaks, 1e-3), (impulses, 5e-4)):
        assert found[-1] == pytest.approx(found[0], rel=1e-9)  # a whole knot further
        assert 1e-6 < np.ptp(found) / np.mean(found) < ripple


def test_block_slides_off_the_end(tmp_path: Path) -> None:
    """The space ends at y = 0.01 m, the last point of the block passes there after less than 5 ms."""
    scene = pair_scene(duration=6e-3, step=STEP, samples=6000)
    run = simulate(pair(tmp_path, scene, length=0.16))
    force, contact = -run.contacts["slide"].force[:, 0], run.contacts["slide"]
    last = (0.01 - contact.points[:, 1].min()) / 10.0
    assert run.result == "FINISHED"
    assert force.max() > 1000.0
    assert force.min() >= 0.0
    assert 0.8 * last < run.times[np.flatnonzero(force)[-1]] < last + STEP
    # A point that has passed the end carries nothing, while others still do.
    gone = contact.points[:, 1] + 10.0 * run.frame_times[:, None] > 0.01 + 10.0 * 2 * STEP
    assert np.all(contact.multipliers[gone] == 0.0)
    assert np.any(contact.multipliers[gone.any(axis=1)] > 0.0)
    # Nothing pushes any more: gravity alone accelerates the block.
    late = run.times > last + STEP
    speed = run.motion["part"][late, 6]
    np.testing.assert_allclose(np.diff(speed) / (run.times[1] - run.times[0]), 50.0, rtol=1e-6)


def test_points_beside_the_space_carry_nothing(tmp_path: Path) -> None:
    scene = pair_scene(step=STEP, duration=1e-3)
    scene["body"]["part"]["position"] = [-0.05 - 1e-6, 0.0, 0.05]
    contact = simulate(pair(tmp_path, scene)).contacts["slide"]
    beside = contact.points[:, 2] + 0.05 > 0.06
    assert 0 < beside.sum() < 20
    assert np.all(contact.multipliers[:, beside] == 0.0)
    assert contact.multipliers[:, ~beside].max() > 0.0


def total_momentum(system: System, velocity: np.ndarray) -> np.ndarray:
    """Return the linear momentum of all bodies [N s], (3,)."""
    total = np.zeros(3)
    for name, body in system.bodies.items():
        first = system.offsets[name]
        total += body.morph.mass * body.centre_motion(velocity[first : first + body.rigid_count])[:3]
    return total


@pytest.mark.parametrize("gap", [1e-6, 0.0])
def test_momentum_passes_from_body_to_body(tmp_path: Path, gap: float) -> None:
    scene = pair_scene(press=0.0, step=STEP, duration=3e-3)
    scene["body"]["part"] = {"velocity": [0.05, 10.0, 0], "position": [-0.05 - gap, 0, 0]}
    system = pair(tmp_path, scene, free=True)
    run = simulate(system)
    passed = run.motion["plate"][-1, 6] * 3.0
    assert passed > 0.02
    assert passed == pytest.approx(impulse(run), rel=1e-9)
    change = total_momentum(system, run.velocities[-1]) - total_momentum(system, system.velocity)
    assert np.abs(change).max() < ROUND_OFF
    assert run.momentum_residual < ROUND_OFF
    assert run.energy_drift < 2 * DRIFT
