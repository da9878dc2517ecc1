"""Runs of small systems: balances, steps, failures."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import GaugeModes
from gudgeon.solver.accuracy import ACCURACY
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.contact.blocks import full
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.integrators.choice import choose
from gudgeon.solver.integrators.steps import plan_steps
from gudgeon.solver.result import Result
from gudgeon.solver.scene.run import Run
from gudgeon.solver.simulate import simulate
from tests.solver.systems import LENGTH, MASS, SPEED, block_records, block_scene, build, rod_records, rod_scene

LINEAR = {"method": "penalty", "law": {"kind": "linear", "stiffness": 1e9}}
ROUND_OFF = 1e-11
SPLITTING = 0.2**2 / 8
"""Energy error of the split step on an oscillator at ω_c with dt = 0.2/ω_c, the worst that a system can show."""


def test_a_body_that_touches_nothing_flies_on(tmp_path: Path) -> None:
    scene = block_scene()
    scene["body"]["part"]["velocity"] = [-1.0, 0.2, 0.0]
    scene["body"]["part"]["angular_velocity"] = [0.0, 0.0, 0.0]
    run = simulate(build(tmp_path, block_records(6), scene))
    assert run.counts["contact_steps"] == 0
    assert run.quantities["wall.impulse"]["value"] == 0.0
    np.testing.assert_allclose(run.velocities[-1][:3], np.sqrt(MASS) * np.array([-1.0, 0.2, 0.0]), rtol=1e-13)


@pytest.mark.parametrize("contact", [{}, {"surface_stiffness": 1e14}, {"method": "penalty", "surface_stiffness": 1e13}])
def test_balances_of_a_coupled_impact(tmp_path: Path, contact: dict[str, Any]) -> None:
    run = simulate(build(tmp_path, block_records(12), block_scene(**contact)))
    assert run.result == Result.FINISHED.name
    assert run.quantities["wall.impulse"]["value"] > 1.0
    assert run.energy_drift < SPLITTING
    assert run.momentum_residual < ROUND_OFF
    forces = run.contacts["wall"].force
    interval = run.times[1] - run.times[0]
    impulse = np.linalg.norm(forces.sum(axis=0) * interval)
    assert impulse == pytest.approx(run.quantities["wall.impulse"]["value"], rel=1e-12)
    assert run.contacts["wall"].multipliers.min() > -1e-6 * np.abs(forces).max()  # no adhesion


def test_restitution_of_the_exact_rod(tmp_path: Path) -> None:
    run = simulate(build(tmp_path, rod_records(100), rod_scene()))
    assert run.quantities["wall.restitution"]["value"] == pytest.approx(1.0, abs=2 * ACCURACY)  # Of the impulse.
    assert run.quantities["wall.duration"]["value"] == pytest.approx(2 * LENGTH / SPEED, rel=2e-3)


def test_dashpot_is_the_impedance_of_the_bar(tmp_path: Path) -> None:
    system = build(tmp_path, rod_records(200), rod_scene(dashpot="wave-guide"))
    assert system.dashpot[0] == pytest.approx(MASS / LENGTH * SPEED, rel=0.01)


def test_dashpot_loses_energy_and_says_how_much(tmp_path: Path) -> None:
    run = simulate(build(tmp_path, rod_records(50), rod_scene(dashpot="wave-guide")))
    assert 0 < run.energies[-1, 3] < 0.05 * run.energies[0].sum()
    assert np.diff(run.energies[:, 3]).min() > -1e-15
    assert run.energy_drift < 2e-3


def test_step_is_automatic_obeyed_or_divided() -> None:
    critical, run, factor, largest = 1e6, Run(duration=1e-3), 0.2, 0.2
    automatic = plan_steps(run, factor, critical, largest)
    assert automatic.dt <= 0.2 / critical * (1 + 1e-12)
    assert automatic.substeps == 1
    assert automatic.steps * automatic.dt == pytest.approx(1e-3, rel=1e-12)
    obeyed = plan_steps(run.model_copy(update={"step": 1e-7}), factor, critical, largest)
    assert (obeyed.dt, obeyed.substeps) == (1e-7, 1)
    divided = plan_steps(run.model_copy(update={"step": 1e-6}), factor, critical, largest)
    assert divided.substeps == 5
    assert divided.dt == pytest.approx(2e-7)
    assert divided.steps * divided.dt == pytest.approx(1e-3, rel=1e-12)
    odd = plan_steps(run.model_copy(update={"step": 3.3e-8}), factor, critical, largest)
    assert 3e-8 < odd.dt <= 3.3e-8
    assert odd.steps * odd.dt == pytest.approx(1e-3, rel=1e-12)


def test_the_implicit_integrator_divides_a_step_that_steps_over_impacts(tmp_path: Path) -> None:
    scene = rod_scene()
    scene["run"] |= {"integrator": "small"}
    system = build(tmp_path / "own", rod_records(8), scene)
    largest = INTEGRATORS["small"].largest / system.critical_frequency()
    for parts in (1, 7):
        scene["run"]["step"] = 0.999 * parts * largest
        found = simulate(build(tmp_path / str(parts), rod_records(8), scene))
        assert found.counts["substeps"] == parts
        # As much shorter as whole frames need to end with the run.
        assert 0.5 * largest < found.counts["step"] <= 0.999 * largest * (1 + 1e-12)
        assert found.times[-1] == pytest.approx(system.scene.run.duration, rel=1e-12)


def test_dependent_contact_rows_are_refused_with_a_reason(tmp_path: Path) -> None:
    system = replace(build(tmp_path, block_records(4), block_scene()), residual=full(1e-9 * np.ones((4, 4))))
    with pytest.raises(SolverError, match="contact forces are not unique"):
        simulate(system)


def test_progress_may_stop_a_run(tmp_path: Path) -> None:
    def stop(share: float) -> None:
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(build(tmp_path, rod_records(10), rod_scene()), stop)


@pytest.mark.parametrize(
    ("scene", "text"),
    [
        (rod_scene(interface="top"), "contact.wall.interface"),
        (block_scene(dashpot="wave-guide"), "contact.wall.dashpot"),
        (rod_scene(against={"shape": "plane", "point": [1, 0, 0], "normal": [0, 1, 0]}), "does not face"),
        (rod_scene(against={"shape": "plane", "point": [0.9, 0, 0], "normal": [-1, 0, 0]}), "start inside"),
    ],
)
def test_scene_that_does_not_fit_is_refused(tmp_path: Path, scene: dict[str, object], text: str) -> None:
    interface = scene["contact"]["wall"]["interface"]  # type: ignore[index]
    records = block_records(3) if interface == "face" else rod_records(5)
    with pytest.raises(SceneError, match=text):
        build(tmp_path, records, scene)


def test_reduction_without_residual_needs_springs(tmp_path: Path) -> None:
    modal, morph = rod_records(5)
    with pytest.raises(SceneError, match=r"contact\.wall\.method"):
        build(tmp_path, (replace(modal, residual_flexibility=None, reduction="normal+static"), morph), rod_scene())


@pytest.mark.parametrize(("contact", "count", "name"), [({}, 20, "small"), ({}, 4, "event"), (LINEAR, 20, "event")])
def test_auto_takes_located_events_of_a_few_points_over_flexibility(
    tmp_path: Path, contact: dict[str, Any], count: int, name: str
) -> None:
    """With a gauge and gravity, which the fastest loops lack; a law keeps its events."""
    modal, morph = block_records(count)
    values, quasi = np.ones((6, 8)), np.zeros((6, count))
    modal = replace(modal, gauges={"strain": GaugeModes(values, quasi, "Pa")})
    scene = block_scene(**contact)
    scene["body"]["part"]["gauges"] = ["strain"]
    scene["run"]["gravity"] = [0.0, 0.0, -9.81]
    assert choose(build(tmp_path, (modal, morph), scene))[0] == name
