"""The step that a run finds for itself: impulses and windowed forces of the default are those of much finer steps."""

import itertools
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
from tests.solver.systems import (
    block_records,
    block_scene,
    build,
    rigid_records,
    rod_records,
    rod_scene,
)


def rod(folder: Path, **run: Any) -> System:
    scene = rod_scene(checks=True)
    scene["run"] |= run
    return build(folder, rod_records(30), scene)


def controlled(system: System, run: Any) -> tuple[Trajectory, Any]:
    plan = plan_run(system)
    return accuracy.controlled(system, run(plan), plan, run)


def windowed_peak(system: System, found: Trajectory) -> float:
    interval = found.times[0]
    width = round(system.resolution / interval)
    sums = np.cumsum(np.concatenate([[0.0], np.linalg.norm(found.contacts["wall"].force[:, :], axis=1)]))
    return float((sums[width:] - sums[:-width]).max() / width)


@pytest.fixture(scope="module")
def converged(tmp_path_factory: pytest.TempPathFactory) -> tuple[float, float]:
    """Impulse and windowed peak of a rod at a wall at 1 ns, where both have converged to 1e-5."""
    system = rod(tmp_path_factory.mktemp("fine"), integrator="small", step=1e-9, samples=40_000)
    found = simulate(system)
    return found.quantities["wall.impulse"]["value"], windowed_peak(system, found)


def test_the_default_step_has_converged(tmp_path: Path, converged: tuple[float, float]) -> None:
    system = rod(tmp_path, integrator="small", samples=40_000)
    found = simulate(system)
    assert found.result == Result.FINISHED.name
    assert found.quantities["wall.impulse"]["value"] == pytest.approx(converged[0], rel=1e-3)
    assert windowed_peak(system, found) == pytest.approx(converged[1], rel=5e-3)
    errors = {name: error for name, error in found.estimates.items() if name.startswith("step.")}
    assert max(errors.values()) <= accuracy.ACCURACY
    assert set(errors) >= {"step.impulse", "step.force", "step.rebound"}


@pytest.mark.parametrize("run", [{"samples": 50}, {"frames": 7}, {"duration": 2.4e-3}, {"duration": 4.5e-4}])
def test_impulse_does_not_depend_on_duration_samples_or_frames(
    tmp_path: Path, converged: tuple[float, float], run: dict[str, Any]
) -> None:
    found = simulate(rod(tmp_path, integrator="small", **run))
    assert found.quantities["wall.impulse"]["value"] == pytest.approx(converged[0], rel=1e-3)


def test_gravity_changes_the_integrator_but_not_the_answer(tmp_path: Path) -> None:
    forces = []
    for name, gravity in (("without", 0.0), ("with", -1e-6)):
        scene = block_scene(checks=True)
        scene["run"] |= {"gravity": [gravity, 0.0, 0.0]}
        found = simulate(build(tmp_path / name, block_records(5), scene))
        forces.append(found.quantities["wall.impulse"]["value"])
    assert forces[0] == pytest.approx(forces[1], rel=1e-3)


def test_a_smaller_accuracy_takes_a_smaller_step(tmp_path: Path) -> None:
    runs = [simulate(rod(tmp_path / str(n), integrator="small", accuracy=x)) for n, x in enumerate((1e-2, 1e-5))]
    assert runs[1].counts["step"] < 0.2 * runs[0].counts["step"]
    # What is read beside impulse and force has its error stated, not limited.
    assert max(runs[1].estimates.get(f"step.{name}", 0.0) for name in accuracy.Difference._fields) <= 1e-5


@pytest.mark.parametrize("run", [{"checks": False}, {"checks": False, "step": 1e-8}])
def test_a_run_without_checks_is_taken_once(tmp_path: Path, run: dict[str, Any]) -> None:
    found = simulate(rod(tmp_path, integrator="small", **run))
    assert not any(name.startswith("step.") for name in found.estimates)


def test_a_given_step_is_kept_and_its_error_estimated(tmp_path: Path, struck: Trajectory) -> None:
    """Also where the energy balance is exact at any step, so that nothing else shows the error."""
    for step in (4e-6, 1e-6, 2.5e-7):
        found = simulate(rod(tmp_path / str(step), integrator="small", step=step))
        assert found.counts["step"] <= step * (1 + 1e-9)
        errors = [
            abs(found.quantities[key]["value"] / struck.quantities[key]["value"] - 1)
            for key in ("wall.impulse", "wall.force_peak")
        ]
        # One of the two may be small by chance.
        assert max(found.estimates["step.impulse"], found.estimates["step.force"]) > 0.3 * max(errors) - 2e-4
    assert max(errors) < 1e-2


@pytest.mark.parametrize("step", [5e-3, 7e-3, 1.3e-2])
def test_a_given_step_without_contact_has_its_error_estimated(step: float, tmp_path: Path) -> None:
    """A mass on a spring: its energy is kept at any step, and nothing else shows that it comes late.

    With twice the longest of these steps, frames are at other times.
    """
    mass, stiffness = 0.5, 200.0
    scene = {
        "body": {"part": {"velocity": [0.3, 0, 0]}},
        "force": {"s": {"kind": "spring", "body": "part", "direction": [1, 0, 0], "stiffness": stiffness}},
        "run": {"duration": 1.0, "samples": 100, "frames": 50, "integrator": "small", "step": step},
    }
    points = {"face": ([0.1, 0.0, 0.0], [1.0, 0.0, 0.0])}
    found = simulate(build(tmp_path, rigid_records(mass, points, (1e-3, 1e-3, 1e-3)), scene))
    frames = np.abs(found.frames).max(axis=0)
    path = found.frames[:, int(frames.argmax())] / frames.max()
    exact = np.sin(np.sqrt(stiffness / mass) * found.frame_times)
    error = np.abs(path * np.sign(path @ exact) - exact).max()
    assert error > 0.01
    assert error < found.estimates["step.motion"] < 5 * error


def test_motion_that_does_not_converge_is_a_failure_with_its_estimate(tmp_path: Path) -> None:
    system, rng = rod(tmp_path, integrator="small"), np.random.default_rng(0)
    good = simulate(replace(system, scene=system.scene.model_copy(update={"run": run_of(system, step=1e-8)})))

    def irregular(plan: Any) -> Trajectory:
        return replace(good, impacts={"wall": good.impacts["wall"] * rng.uniform(0.5, 1.5)})

    found, _ = controlled(system, irregular)
    assert found.result == Result.INACCURATE.name
    assert found.estimates["step.impulse"] > 0.01


@pytest.mark.parametrize(("asked", "spread", "result"), [
    (None, 0.02, "FINISHED"), (None, 0.5, "INACCURATE"), (1e-3, 0.02, "INACCURATE"),
])  # fmt: skip
def test_errors_above_the_default_accuracy_are_stated_up_to_a_tenth(
    tmp_path: Path, asked: float | None, spread: float, result: str
) -> None:
    """As those of the tenth revolution of an engine; an accuracy that is asked for is met or refused."""
    settings = {} if asked is None else {"accuracy": asked}
    system, factors = rod(tmp_path, integrator="small", **settings), itertools.cycle([1 - spread, 1 + spread])
    good = simulate(replace(system, scene=system.scene.model_copy(update={"run": run_of(system, step=1e-8)})))

    def irregular(plan: Any) -> Trajectory:
        return replace(good, impacts={"wall": good.impacts["wall"] * next(factors)})

    settled, _ = controlled(system, irregular)
    assert settled.result == result
    assert settled.estimates["step.impulse"] > accuracy.ACCURACY
    (note,) = accuracy.unsettled_notes(system, settled) or [""]
    assert note.startswith("run.accuracy: the errors of the step stay above its default") == (asked is None)


def test_energy_that_restitution_creates_with_friction_is_the_reason(tmp_path: Path) -> None:
    """Kane's paradox: a sliding body strikes with its centre behind the point; without rebound none is created."""
    points = {"a": ((0.3, 0, -0.4), (0, 0, -1))}
    contact = {"body": "part", "interface": "a", "method": "impact", "restitution": 0.9, "friction": {"static": 1.0},
               "against": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}}  # fmt: skip
    scene: dict[str, Any] = {
        "body": {"part": {"position": [0, 0, 0.41], "velocity": [-1.0, 0, -1.0], "freedom": ["x", "z", "ry"]}},
        "contact": {"a": contact},
        "run": {"duration": 2e-2, "integrator": "small"},
    }
    records = rigid_records(1.0, points, (0.083, 0.083, 0.083))
    outcome = simulate(build(tmp_path / "large", records, scene))
    assert outcome.result == "RESTITUTION"
    assert outcome.counts["reason"].startswith("contact.a: impacts with Newton's restitution and Coulomb's friction")
    contact["restitution"] = 0.0
    assert simulate(build(tmp_path / "small", records, scene)).result == "FINISHED"


def test_differences_that_do_not_decrease_end_the_search_for_a_step_after_seven_halvings(tmp_path: Path) -> None:
    """Impulses that change by half at each step, as in a chaotic train of impacts."""
    system, counts = rod(tmp_path, integrator="small"), list[int]()
    good = simulate(replace(system, scene=system.scene.model_copy(update={"run": run_of(system, step=1e-8)})))

    def chaotic(plan: Any) -> Trajectory:
        counts.append(plan.schedule.steps)
        return replace(good, impacts={"wall": good.impacts["wall"] * (1.5 if len(counts) % 2 else 1.0)})

    found, _ = controlled(system, chaotic)
    assert found.result == Result.INACCURATE.name
    assert counts[-1] <= counts[0] * 2**accuracy.PATIENCE


def test_a_first_difference_that_is_small_by_chance_does_not_end_the_search(tmp_path: Path) -> None:
    """Steps in which all of a train of impacts is one have the same impulse; finer ones part it, and then converge."""
    system, counts = rod(tmp_path, integrator="small"), list[int]()
    good = simulate(replace(system, scene=system.scene.model_copy(update={"run": run_of(system, step=1e-8)})))
    off = {0: 0.0, 1: 0.002} | {halvings: 0.012 * 2.0 ** (3 - halvings) for halvings in range(2, 13)}

    def parting(plan: Any) -> Trajectory:
        counts.append(plan.schedule.steps)
        halvings = round(np.log2(counts[-1] / counts[0]))
        return replace(good, impacts={"wall": good.impacts["wall"] * (1 + off[halvings])})

    found, _ = controlled(system, parting)
    assert found.result == Result.FINISHED.name
    assert found.estimates["step.impulse"] <= accuracy.ACCURACY


@pytest.mark.parametrize("size", [0.003, 0.05])
def test_errors_that_halve_with_the_step_are_estimated_as_they_are(size: float, tmp_path: Path) -> None:
    """Whether the last step is a half of the one before or less: the estimate is 1 to 2 times the error."""
    system, steps = rod(tmp_path, integrator="small"), list[int]()
    good = simulate(replace(system, scene=system.scene.model_copy(update={"run": run_of(system, step=1e-8)})))

    def converging(plan: Any) -> Trajectory:
        steps.append(plan.schedule.steps)
        return replace(good, impacts={"wall": good.impacts["wall"] * (1 + size * steps[0] / steps[-1])})

    found, _ = controlled(system, converging)
    assert found.result == Result.FINISHED.name
    error = size * steps[0] / steps[-1]
    assert 0.99 * error <= found.estimates["step.impulse"] <= 2 * error


def test_a_step_is_halved_until_its_energy_error_is_small_too(tmp_path: Path) -> None:
    system, steps = rod(tmp_path, integrator="small"), list[int]()
    good = simulate(replace(system, scene=system.scene.model_copy(update={"run": run_of(system, step=1e-8)})))

    def drifting(plan: Any) -> Trajectory:
        steps.append(plan.schedule.steps)
        return replace(good, energy_drift=0.04 * steps[0] / steps[-1])

    found, _ = controlled(system, drifting)
    assert found.result == Result.FINISHED.name
    assert found.energy_drift <= accuracy.ACCURACY < 0.04


def test_an_energy_error_above_five_percent_is_a_failure(tmp_path: Path) -> None:
    """A block strikes a wall, a plane that it cannot leave, with a given step that is too long for its contact."""
    scene = block_scene(checks=True)
    scene["run"] |= {"integrator": "small", "step": 2e-5}
    found = simulate(build(tmp_path, block_records(4), scene))
    assert found.energy_drift > 0.05
    assert found.result == Result.ENERGY.name


def run_of(system: System, **settings: Any) -> Any:
    return system.scene.run.model_copy(update=settings)


@pytest.fixture(scope="module")
def struck(tmp_path_factory: pytest.TempPathFactory) -> Trajectory:
    return simulate(rod(tmp_path_factory.mktemp("struck"), integrator="event"))


def of_impacts(struck: Trajectory, *impacts: tuple[float, float, float, float]) -> Trajectory:
    """Return a run with other impacts: begin, end [s], impulse [N s] and windowed force [N] of each."""
    rows = np.full((len(impacts), 9), np.nan)
    for row, given in zip(rows, impacts, strict=True):
        row[[0, 1, 2, 7]] = given
    return replace(struck, impacts={"wall": rows})


def test_runs_are_compared_impact_by_impact(struck: Trajectory) -> None:
    fine = of_impacts(struck, (1.0, 2.0, 10.0, 50.0), (5.0, 6.0, 4.0, 80.0))
    coarse = of_impacts(struck, (1.1, 2.1, 10.5, 51.0), (5.1, 6.2, 3.0, 76.0))
    found = accuracy.difference(coarse, fine, 0.5)
    assert found.impulse == pytest.approx(0.1, rel=1e-12)  # 1 N s of 10, not 0.5 N s of all.
    assert found.force == pytest.approx(0.05, rel=1e-12)
    assert accuracy.difference(fine, fine, 0.5) == accuracy.Difference(0.0, 0.0, 0.0)


def test_an_impact_that_one_run_lacks_counts_in_full(struck: Trajectory) -> None:
    fine = of_impacts(struck, (1.0, 2.0, 10.0, 50.0), (5.0, 6.0, 4.0, 50.0))
    coarse = of_impacts(struck, (1.0, 2.0, 10.0, 50.0))
    assert accuracy.difference(coarse, fine, 0.5).impulse == pytest.approx(0.4, rel=1e-12)
    assert accuracy.difference(fine, coarse, 0.5).impulse == pytest.approx(0.4, rel=1e-12)
    assert accuracy.difference(of_impacts(struck), coarse, 0.5) == accuracy.Difference(1.0, 1.0, 0.0)
    assert accuracy.difference(coarse, of_impacts(struck), 0.5) == accuracy.Difference(1.0, 1.0, 0.0)


def test_one_impact_is_compared_with_the_two_that_it_falls_into(struck: Trajectory) -> None:
    one = of_impacts(struck, (1.0, 3.0, 10.0, 50.0))
    two = of_impacts(struck, (1.0, 1.7, 6.0, 50.0), (2.3, 3.0, 4.0, 40.0))
    assert accuracy.difference(two, one, 0.5) == accuracy.Difference(0.0, 0.0, 0.0)


def test_the_grouping_of_a_train_of_impacts_does_not_count(struck: Trajectory) -> None:
    """The trains carry equal impulses, one in three impacts, the other in two."""
    three = of_impacts(struck, (1.0, 1.1, 8.0, 50.0), (2.2, 2.3, 3.0, 50.0), (2.9, 3.0, 2.0, 50.0))
    two = of_impacts(struck, (1.0, 2.25, 11.0, 50.0), (2.95, 3.05, 2.0, 50.0))
    assert accuracy.difference(three, two, 0.5).impulse == 0.0
    lost = of_impacts(struck, (1.0, 1.1, 8.0, 50.0), (2.2, 2.3, 3.0, 50.0))
    assert accuracy.difference(lost, two, 0.5).impulse == pytest.approx(2 / 11, rel=1e-12)


def test_times_within_half_a_window_do_not_count(struck: Trajectory) -> None:
    """Also where impacts are shorter than their shift."""
    fine = of_impacts(struck, (1.0, 1.0 + 1e-9, 10.0, 50.0), (5.0, 5.0 + 1e-9, 4.0, 50.0))
    for shift, apart in ((1e-8, 0.0), (-1e-8, 0.0), (0.24, 0.0), (0.26, 0.4)):
        coarse = of_impacts(struck, (1.0, 1.0 + 1e-9, 10.0, 50.0), (5.0 + shift, 5.0 + shift + 1e-9, 4.0, 50.0))
        assert accuracy.difference(coarse, fine, 0.5).impulse == pytest.approx(apart, abs=1e-12)


def test_impulses_that_are_wrong_and_compensate_each_other_count(struck: Trajectory) -> None:
    fine = of_impacts(struck, (1.0, 2.0, 10.0, 50.0), (5.0, 6.0, 4.0, 50.0), (8.0, 9.0, 2.0, 50.0))
    coarse = of_impacts(struck, (1.0, 2.0, 9.98, 50.0), (5.0, 6.0, 4.05, 50.0), (8.0, 9.0, 1.97, 50.0))
    assert accuracy.difference(coarse, fine, 0.5).impulse == pytest.approx(5e-3, rel=1e-9)
