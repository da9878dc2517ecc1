"""Static equilibrium at the start in electrostatic fields: a clamped electrode, pull-in, a plate pressed on a wall."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.forces.fields.electrostatic import VACUUM
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.simulate import simulate
from gudgeon.solver.simulation import Steps
from gudgeon.solver.system.system import System
from tests.solver.integrators.test_electrodes import GAP, LENGTH, POINTS, WIDTH, beam, truth_of_pull_in
from tests.solver.ports.test_rest import MU, WEIGHT, forces_of, sloped
from tests.solver.systems import build_all

AREA = WIDTH * LENGTH / POINTS


def electrode(folder: Path, volts: float, **run: Any) -> System:
    pull = {"kind": "electrostatic-pressure", "body": "beam", "interface": "face", "point": [0.0, 0.0, -GAP],
            "normal": [0.0, 0.0, 1.0], "potential": volts}  # fmt: skip
    run = {"duration": 1e-6, "samples": 20, "frames": 5, "integrator": "small", "checks": False} | run
    return build_all(folder, {"beam": beam()}, {"body": {"beam": {}}, "force": {"pull": pull}, "run": run})


def test_an_electrode_starts_and_stays_in_equilibrium_with_its_field(tmp_path: Path) -> None:
    """Modal stiffness times coordinates is the field's force at the deformed gaps, up to the fold of the branch."""
    limit = truth_of_pull_in()
    sags = []
    for share in (0.5, 0.99):
        notes = list[str]()
        system = at_rest(electrode(tmp_path / f"{share}", share * limit), notes)
        assert not notes
        rows = system.driving.rows  # Outward, which is down.
        pressure = 0.5 * VACUUM * AREA * (share * limit) ** 2 / (GAP - rows @ system.position) ** 2
        np.testing.assert_allclose(system.stiffness * system.position, rows.T @ pressure, rtol=0, atol=1e-9 * rows.max()
                                   * pressure.sum())  # fmt: skip
        np.testing.assert_allclose(system.loads, pressure, rtol=1e-8)
        sags.append(float((rows @ system.position).max()) / GAP)
    assert 0.03 < sags[0] < 0.1
    assert 0.3 < sags[1] < 0.4  # The BVP's fold is at 0.4 of the gap.
    steps = Steps(electrode(tmp_path / "run", 0.9 * limit))
    for _ in range(20):
        steps.step()
    assert steps.energies["kinetic"] < 1e-12 * abs(steps.energies["strain"])


def test_above_pull_in_a_note_names_the_largest_voltage(tmp_path: Path) -> None:
    limit, notes = truth_of_pull_in(), list[str]()
    system = electrode(tmp_path, 1.2 * limit)
    assert at_rest(system, notes) is system
    (note,) = notes
    found = re.match(r"force\.pull: no stable static equilibrium exists from ([\d.]+) of the potential on", note)
    assert found is not None
    assert float(found[1]) * 1.2 == pytest.approx(1.0, rel=5e-3)
    assert note in simulate(system).counts["friction_notes"]


def test_undeformed_bodies_start_without_the_field(tmp_path: Path) -> None:
    system = at_rest(electrode(tmp_path, 5.0, start="undeformed"))
    assert not system.position.any()
    assert not system.loads.any()


@pytest.mark.parametrize("pull", [0.0, 3.0])
def test_weight_field_and_friction_start_together(pull: float, tmp_path: Path) -> None:
    """A rigid block on a layer: what presses it is its weight and the field at the gap that the layer leaves."""
    area, gap = 1e-2, 1e-4
    volts = np.sqrt(2 * pull * gap**2 / (VACUUM * area))
    plates = {"kind": "parallel-plates", "body": "part", "area": area, "gap": gap, "potential": float(volts),
              "direction": [-1, 0, 0]}  # fmt: skip
    system = sloped(tmp_path, 0.8, {"surface_stiffness": 1e6}, rigid=True, force={"field": plates})
    notes = list[str]()
    resting = at_rest(system, notes)
    assert not notes
    normal, across = forces_of(resting)
    sunk = (resting.driving.rows @ resting.position)[0]
    assert sunk > 1e-3 * gap
    assert normal.sum() == pytest.approx(2 * WEIGHT + pull / (1 - sunk / gap) ** 2, rel=1e-8)
    assert np.linalg.norm(across.sum(axis=0)) == pytest.approx(0.8 * MU * 2 * WEIGHT, rel=1e-8)
