"""The implicit loop over ports: springs beside contact, and contact by its closed points or by sweeps."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.integrators.outcome import PIVOTS
from gudgeon.solver.integrators.small import integrator
from gudgeon.solver.integrators.small.integrator import Small
from tests.solver.port_systems import chain, pair
from tests.solver.systems import March, build, march, rigid_records

MASS, STIFFNESS, SPEED, TIME = 1.0, 1e4, 1.0, 0.02
"""Of a mass on a spring: [kg], [N/m], [m/s], two radians of its motion [s]."""
DT, STEPS = 1e-6, 60
SWEEPS = 3
"""Entry of the counts."""


def on_spring(folder: Path, steps: int) -> March:
    foot = {"foot": ([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])}
    spring = {"kind": "spring", "body": "part", "direction": [0, 0, 1], "stiffness": STIFFNESS}
    floor = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
    scene: dict[str, Any] = {
        "body": {"part": {"position": [0, 0, 1.0], "velocity": [0, 0, SPEED]}},
        "contact": {
            "floor": {"body": "part", "interface": "foot", "against": floor, "method": "impact", "restitution": 0.5}
        },
        "force": {"spring": spring},
        "run": {"duration": TIME},
    }
    return march(build(folder, rigid_records(MASS, foot), scene), TIME / steps, steps, Small)


def test_a_mass_on_a_spring_moves_to_second_order_and_keeps_its_energy(tmp_path: Path) -> None:
    omega = np.sqrt(STIFFNESS / MASS)
    exact, counts, errors = SPEED / omega * np.sin(omega * TIME), np.array([20, 40, 80, 160]), []
    for number, steps in enumerate(counts):
        found = on_spring(tmp_path / str(number), int(steps))
        errors.append(abs(found.run.outcome().q[2] / np.sqrt(MASS) - exact))
        energies = found.energies[:, 0] + found.energies[:, 1]
        np.testing.assert_allclose(energies, energies[0], rtol=1e-13)  # Exactly but for round-off of 160 steps.
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert abs(order - 2) < 0.2


@pytest.mark.parametrize("name", ["blocks", "damped blocks", "chain"])
def test_closed_points_and_sweeps_find_the_same_forces(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Points of two curved blocks, and of bars in a row, open and close; sweeps end at 1e-11 of the largest force."""
    if name == "chain":
        system = chain(tmp_path, 5, 8)
    else:
        system = pair(tmp_path, 9, 5, bulge=0.01, damping=0.01 if name == "damped blocks" else 0.0)
    closed = march(system, DT, STEPS, Small)
    constants = integrator.constants_of
    monkeypatch.setattr(integrator, "constants_of", lambda *given: constants(*given)._replace(plain=False))
    swept = march(system, DT, STEPS, Small)
    pivots, sweeps = closed.run.outcome().counts[PIVOTS], swept.run.outcome().counts[SWEEPS]
    assert pivots >= 4
    assert sweeps > STEPS
    assert closed.run.outcome().counts[SWEEPS] == 0
    for one, other in ((closed.forces, swept.forces), (closed.energies, swept.energies)):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-9 * np.abs(other).max())
