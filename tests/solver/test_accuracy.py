"""The step that a run finds for itself: impulses and windowed forces of the default are those of much finer steps."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver import accuracy
from gudgeon.solver.integrators.steps import plan_run
from gudgeon.solver.result import Result
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.systems import block_records, block_scene, build, rod_records, rod_scene

STEPPING = ["explicit", "implicit", "discrete-gradient"]


def rod(folder: Path, **run: Any) -> System:
    scene = rod_scene()
    scene["run"] |= run
    return build(folder, rod_records(30), scene)


def windowed_peak(system: System, found: Trajectory) -> float:
    interval = found.times[0]
    width = round(system.resolution / interval)
    sums = np.cumsum(np.concatenate([[0.0], np.linalg.norm(found.contacts["wall"].force[:, :], axis=1)]))
    return float((sums[width:] - sums[:-width]).max() / width)


@pytest.fixture(scope="module")
def converged(tmp_path_factory: pytest.TempPathFactory) -> tuple[float, float]:
    """Impulse and windowed peak of a rod at a wall at 1 ns, where both have converged to 1e-5."""
    system = rod(tmp_path_factory.mktemp("fine"), integrator="explicit", step=1e-9, samples=40_000)
    found = simulate(system)
    return found.quantities["wall.impulse"]["value"], windowed_peak(system, found)


@pytest.mark.parametrize("integrator", STEPPING)
def test_the_default_step_has_converged(tmp_path: Path, converged: tuple[float, float], integrator: str) -> None:
    system = rod(tmp_path, integrator=integrator, samples=40_000)
    found = simulate(system)
    assert found.result == Result.FINISHED.name
    assert found.quantities["wall.impulse"]["value"] == pytest.approx(converged[0], rel=1e-3)
    assert windowed_peak(system, found) == pytest.approx(converged[1], rel=5e-3)
    assert max(found.estimates.values()) <= accuracy.ACCURACY
    assert set(found.estimates) == {"step.impulse", "step.force"}


@pytest.mark.parametrize("run", [{"samples": 50}, {"frames": 7}, {"duration": 2.4e-3}, {"duration": 4.5e-4}])
def test_impulse_does_not_depend_on_duration_samples_or_frames(
    tmp_path: Path, converged: tuple[float, float], run: dict[str, Any]
) -> None:
    found = simulate(rod(tmp_path, integrator="implicit", **run))
    assert found.quantities["wall.impulse"]["value"] == pytest.approx(converged[0], rel=1e-3)


def test_gravity_changes_the_integrator_but_not_the_answer(tmp_path: Path) -> None:
    forces = []
    for name, gravity in (("without", 0.0), ("with", -1e-6)):
        scene = block_scene()
        scene["run"] |= {"gravity": [gravity, 0.0, 0.0]}
        found = simulate(build(tmp_path / name, block_records(5), scene))
        forces.append(found.quantities["wall.impulse"]["value"])
    assert forces[0] == pytest.approx(forces[1], rel=1e-3)


def test_a_smaller_accuracy_takes_a_smaller_step(tmp_path: Path) -> None:
    runs = [simulate(rod(tmp_path / str(n), integrator="explicit", accuracy=x)) for n, x in enumerate((1e-2, 1e-5))]
    assert runs[1].counts["step"] < 0.2 * runs[0].counts["step"]
    assert max(runs[1].estimates.values()) <= 1e-5


@pytest.mark.parametrize("run", [{"step": 1e-8}, {"checks": False}])
def test_a_given_step_and_a_run_without_checks_are_taken_once(tmp_path: Path, run: dict[str, Any]) -> None:
    found = simulate(rod(tmp_path, integrator="explicit", **run))
    assert not found.estimates


def test_motion_that_does_not_converge_is_a_failure_with_its_estimate(tmp_path: Path) -> None:
    system, rng = rod(tmp_path, integrator="explicit"), np.random.default_rng(0)
    good = simulate(replace(system, scene=system.scene.model_copy(update={"run": run_of(system, step=1e-8)})))

    def irregular(plan: Any) -> Trajectory:
        return replace(good, impacts={"wall": good.impacts["wall"] * rng.uniform(0.5, 1.5)})

    found = accuracy.controlled(system, plan_run(system), irregular)
    assert found.result == Result.INACCURATE.name
    assert found.estimates["step.impulse"] > 0.01


def test_an_energy_error_above_five_percent_is_a_failure(tmp_path: Path) -> None:
    scene = block_scene()
    scene["run"] |= {"integrator": "implicit", "step": 1.6e-5}
    found = simulate(build(tmp_path, block_records(5), scene))
    assert found.energy_drift > 0.05
    assert found.result == Result.ENERGY.name


def run_of(system: System, **settings: Any) -> Any:
    return system.scene.run.model_copy(update=settings)
