"""Static equilibrium at the start of blocks that rest on an elastic traction space with friction."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.ports.members import contact_ports, ports_of, start_unknowns, with_surfaces
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.simulation import Steps
from gudgeon.solver.system.system import System
from tests.solver.ports.test_rest import NO_FORCES
from tests.solver.system.test_equilibrium import held
from tests.solver.systems import (
    block_records,
    build_all,
    march,
    pair_scene,
    plate_records,
    with_tangential_rows,
    with_tractions_across,
)

MU, PULL = 0.3, 50.0
APART = 0.01
"""Of two blocks, which do not touch each other [m]."""
MASS = 2.0


def rests(folder: Path, slope: float, *, blocks: int = 1, **part: Any) -> System:
    """Blocks on an elastic plate, gravity turned from its normal by a share of the angle of friction."""
    modal, morph = block_records(12)
    plate, design = plate_records(begin=-0.05, length=0.1 + APART * (blocks - 1))
    records = {"part": (with_tangential_rows(modal, "face"), morph),
               "plate": (with_tractions_across(plate, "top"), design)}  # fmt: skip
    scene = pair_scene(0.0, gravity=[PULL, slope * MU * PULL, 0.0], integrator="small", checks=False)
    scene["contact"]["slide"] |= {"friction": {"static": MU}, "surface_stiffness": 1e12}
    scene["body"]["part"] = {"position": [-0.05, 0.0, 0.0]} | part
    for number in range(1, blocks):
        scene["body"][f"part{number}"] = {"component": "part", "position": [-0.05, APART * number, 0.0]}
        scene["contact"][f"slide{number}"] = scene["contact"]["slide"] | {"body": f"part{number}"}
    return build_all(folder, records, scene)


def state(system: System) -> tuple[np.ndarray, float]:
    """Return the measures of all ports with the surfaces at their place [m], and the largest unbalanced share."""
    ports = with_surfaces(system, ports_of(system), system.position)
    forces = start_unknowns(system, ports)
    acting = ports.rows.T @ forces
    rest = system.stiffness * system.position - system.driving.gravity - acting
    measures = ports.offset + ports.rows @ system.position + ports.residual @ forces
    return measures, float(np.abs(rest).max() / np.abs(acting).max())


@pytest.mark.parametrize(("slope", "blocks"), [(0.0, 1), (0.6, 1), (0.6, 2)])
def test_blocks_on_an_elastic_surface_start_and_stay_at_rest(slope: float, blocks: int, tmp_path: Path) -> None:
    system, notes = rests(tmp_path, slope, blocks=blocks), list[str]()
    resting = at_rest(system, notes)
    assert not notes
    measures, unbalanced = state(resting)
    assert unbalanced < 1e-9
    ports = ports_of(resting)
    for contact in resting.contacts:
        own = contact.rows
        pressed, rubbed = resting.start_forces[own], resting.start_friction[own]
        assert pressed.sum() == pytest.approx(MASS * PULL, rel=1e-9)
        assert rubbed.sum(axis=0)[0] == pytest.approx(-slope * MU * MASS * PULL, rel=1e-9, abs=1e-7)
        assert (np.linalg.norm(rubbed, axis=1) <= MU * pressed * (1 + 1e-9)).all()
        gaps = measures[contact_ports(ports, contact)] + resting.layer[own] * pressed
        assert np.abs(gaps[pressed > 0]).max() < 1e-6 * np.abs(resting.position).max()
        assert gaps.min() > -1e-6 * np.abs(measures).max()
    steps = Steps(system)
    stored = steps.energies["strain"] + steps.energies["contact"]
    for _ in range(5):
        steps.step()
    assert steps.energies["kinetic"] < 1e-9 * stored


def test_beyond_the_angle_of_friction_a_note_says_that_it_starts_as_placed(tmp_path: Path) -> None:
    system, notes = rests(tmp_path, 1.2), list[str]()
    assert at_rest(system, notes) is system
    assert notes == [f"part and plate: {NO_FORCES}; the run starts as placed"]


def test_a_block_in_motion_starts_as_placed(tmp_path: Path) -> None:
    system = rests(tmp_path, 0.0, velocity=[0.0, 1.0, 0.0])
    assert at_rest(system) is system


@pytest.mark.parametrize("friction", [MU, None])
def test_a_held_body_that_its_loads_press_into_a_surface_starts_and_stays_at_rest(
    friction: float | None, tmp_path: Path
) -> None:
    modal, morph = held(6)
    plate, design = plate_records(begin=-0.05, length=0.1)
    records = {"part": (with_tangential_rows(modal, "face"), morph),
               "plate": (with_tractions_across(plate, "top"), design)}  # fmt: skip
    scene = pair_scene(0.0, gravity=[200.0, 20.0, 0.0], integrator="small", checks=False, duration=1e-4)
    scene["contact"]["slide"] |= {"surface_stiffness": 1e12} | ({"friction": {"static": friction}} if friction else {})
    scene["body"]["part"] = {"position": [-0.05, 0.0, 0.0]}
    system = build_all(tmp_path, records, scene)
    assert system.overlaps.any()
    resting = at_rest(system)
    assert resting.start_forces.any()
    assert not resting.overlaps.any()
    found = march(resting, 1e-6, 20, Small)
    assert found.energies[:, 0].max() < 1e-9 * (found.energies[0, 1] + found.energies[0, 2])
    pressed = resting.start_forces @ resting.directions
    np.testing.assert_allclose(found.forces[:, 0, 0], pressed[0], rtol=1e-9)
