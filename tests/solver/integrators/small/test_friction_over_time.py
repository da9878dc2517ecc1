"""Friction of an elastic part over many steps: energy while points open, close and slip again and again; no creep."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver import core
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.simulation import Steps
from gudgeon.solver.system.system import System
from tests.solver.systems import block_records, build, with_tangential_rows

MU = 0.3
WALL = {"shape": "plane", "point": [0.05, 0, 0], "normal": [-1, 0, 0]}
SOFT = 1e-6
"""Stiffness of a part whose rest of 1000 s takes few steps, over that of one of metal."""


def part(
    folder: Path, points: int, body: dict[str, Any], run: dict[str, Any], *, stiffness: float = 1.0, belt: float = 0.0
) -> System:
    """Return an elastic block that lies against a wall with friction, which moves aside at a speed `belt` [m/s]."""
    modal, morph = block_records(points)
    modal = with_tangential_rows(modal, "face")
    assert modal.residual_flexibility is not None
    modal = replace(
        modal, angular_frequencies=modal.angular_frequencies * np.sqrt(stiffness),
        residual_flexibility=modal.residual_flexibility / stiffness,
    )  # fmt: skip
    wall = WALL | {"velocity": [0.0, belt, 0.5 * belt]}
    contact = {"body": "part", "interface": "face", "against": wall, "friction": {"static": MU}}
    scene = {"body": {"part": body}, "contact": {"wall": contact}, "run": {"integrator": "small"} | run}
    return build(folder, (modal, morph), scene)


def total(steps: Steps) -> float:
    """Return the energy without the work of forces [J]."""
    return sum(steps.energies.values()) - 2 * steps.energies["work"]


def test_a_pressed_part_that_chatters_keeps_the_balance_of_energy(tmp_path: Path) -> None:
    """2 kN press it on a moving wall while it rocks: its points open and close all the time."""
    body = {"velocity": [0.1, 0.0, 0.0], "angular_velocity": [0.0, 2.0, -1.0]}
    steps = Steps(part(tmp_path, 30, body, {"duration": 4e-3, "gravity": [1000.0, 0.0, 0.0]}, belt=2.0))
    start, closed, changes, errors = total(steps), np.zeros(30, bool), [], []
    while steps.time < 4e-3:
        steps.step()
        now = steps.contact("wall").force > 0
        changes.append(int((now != closed).sum()))
        closed = now
        errors.append(abs(total(steps) - start))
    # It does not settle.
    assert min(sum(quarter) for quarter in np.array_split(changes, 4)) > 60
    assert steps.energies["dissipated"] > start
    assert max(errors) < 1e-3 * start


def test_a_point_that_closes_at_the_end_of_a_step_sticks_where_it_is_then(tmp_path: Path) -> None:
    """A gap of exactly zero there is closed: its tangents have moved through the whole step."""
    arrays = Small(part(tmp_path, 1, {}, {"duration": 1e-3}), 1e-6).arrays
    state = arrays.state
    state.displacement[1], state.gap[:], state.last[:] = [1e-3, 0.0, 0.0], [0.0, 3e-4, -4e-4], 0.0
    state.anchor[:] = state.displacement[1]
    core.Small(arrays, arrays, arrays).touch(0)
    assert state.anchor[1:].tolist() == [3e-4, -4e-4]
    assert state.gap[1:].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_soft_part_below_the_angle_of_friction_does_not_creep(share: float, tmp_path: Path) -> None:
    """Points share the load by their flexibility, some slip before damping brings it to rest; it stays for 1000 s."""
    # So soft that its weight would topple it.
    body = {"damping": {"ratio": 0.2, "frequency": 10.0}, "geometric_stiffness": False}
    pull = share * MU * 9.81 * np.array([np.cos(0.7), np.sin(0.7)])
    run = {"duration": 1700.0, "gravity": [9.81, *pull.tolist()], "start": "undeformed"}
    steps = Steps(part(tmp_path, 3, body, run, stiffness=SOFT))
    steps.step(until=700.0)
    early, pressed = steps.body("part"), steps.contact("wall").force.sum()
    assert pressed == pytest.approx(2.0 * 9.81, rel=1e-6)
    steps.step(until=1700.0)
    late, size = steps.body("part"), np.abs(early.displacement).max()
    assert np.abs(late.displacement - early.displacement).max() < 1e-9 * size
    assert np.abs(late.velocity).max() < 1e-9 * size
