"""The estimated error of the basis against the true one, that of a run with many more modes."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import BASIS_REASON, ONE_COORDINATE, Trajectory
from gudgeon.solver import simulate as solver
from gudgeon.solver.checks import basis as basis_check
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.integrators.curves import windowed
from gudgeon.solver.result import Result
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.systems import block_records, block_scene, build, build_all, rigid_records, rod_records, rod_scene

MANY = 400
"""Modes whose error is small beside that of 10 to 40."""
FINE = {"checks": False, "step": 5e-9}
LAYER = {"surface_stiffness": 2.5e9}
"""Compliance of 4e-10 m/N, area 1 m²; R of a rod with 10 modes is 3.9e-10 m/N, with 40 modes 1e-10 m/N."""
STIFF = {"surface_stiffness": 2.5e13}
LEAST, MOST = 1 / 2, 10.0
"""Of an estimate over a true error that is above 1 %."""


def striker_scene(ratio: float, run: dict[str, Any] | None = None, **contact: Any) -> dict[str, Any]:
    """A rigid mass, over that of the rod, strikes the rod's end at x = LENGTH at 1 m/s; their distance is 1 nm."""
    against = {"shape": "body", "body": "part", "interface": "tip"}
    return {
        "body": {"part": {}, "mass": {"position": [1.0 + 1e-9, 0, 0], "velocity": [-1.0, 0, 0]}},
        "contact": {"pair": {"body": "mass", "interface": "face", "against": against} | contact},
        # Errors of the basis are told from those of steps down to 1 %.
        "run": {"duration": {0.1: 6e-4, 1.0: 8e-4, 10.0: 3e-3}[ratio], "accuracy": 3e-4} | (run or {}),
    }


def struck(folder: Path, ratio: float, count: int, run: dict[str, Any] | None = None, **contact: Any) -> System:
    mass = rigid_records(2.0 * ratio, {"face": ([0.0, 0, 0], [-1.0, 0, 0])}, axes=(0,))
    return build_all(folder, {"part": rod_records(count), "mass": mass}, striker_scene(ratio, run, **contact))


@pytest.fixture(scope="module")
def exact_runs(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Trajectory]:
    """Runs with many modes, each once: what they find depends on no method of contact."""

    @cache
    def run(ratio: float, **layer: float) -> Trajectory:
        return simulate(struck(tmp_path_factory.mktemp("exact"), ratio, MANY, FINE, **layer))

    return run


def windowed_peak(found: Trajectory, window: float) -> float:
    sums = np.cumsum(found.contacts["pair"].force, axis=0) * found.times[0]
    return windowed(np.concatenate([[0.0], found.times]), np.concatenate([np.zeros((1, 3)), sums]), window)[0]


def true_errors(found: Trajectory, exact: Trajectory, window: float) -> dict[str, float]:
    impulses, speeds = (
        [one.quantities[f"pair.{name}"]["value"] for one in (found, exact)] for name in ("impulse", "rebound_velocity")
    )
    peaks = [windowed_peak(one, window) for one in (found, exact)]
    return {
        "basis.impulse": abs(impulses[0] / impulses[1] - 1),
        "basis.force": abs(peaks[0] / peaks[1] - 1),
        "basis.rebound": abs(speeds[0] - speeds[1]),
    }


@pytest.mark.parametrize("ratio", [0.1, 1.0, 10.0])
@pytest.mark.parametrize(
    "contact",
    [
        {"method": "constraint"},
        {},
        {"dashpot": "wave-guide"},
        {"method": "penalty"} | STIFF,
        {"method": "penalty"} | LAYER,
        LAYER,
    ],
    ids=["constraint", "residual", "dashpot", "stiff", "penalty", "layer"],
)
@pytest.mark.parametrize("count", [10, 40])
def test_the_estimate_is_close_to_the_true_error(
    tmp_path: Path, exact_runs: Callable[..., Trajectory], ratio: float, contact: dict[str, Any], count: int
) -> None:
    layer = {key: contact[key] for key in LAYER if key in contact}
    system = struck(tmp_path / "kept", ratio, count, **contact)
    found = simulate(system)
    assert found.result == Result.FINISHED.name
    window = found.quantities["pair.force_window"]["value"]
    errors = true_errors(found, exact_runs(ratio, **layer), window)
    assert set(found.estimates) >= set(errors)
    for name, error in errors.items():
        estimate = found.estimates[name]
        assert error < 0.01 or LEAST * error < estimate < MOST * error, (name, estimate, error)


def test_the_estimate_is_that_of_the_window_of_the_run(tmp_path: Path, exact_runs: Callable[..., Trajectory]) -> None:
    """Over four periods of the highest frequency, less of the ringing at a wave front is left."""
    exact = exact_runs(1.0)
    system, found = struck(tmp_path / "kept", 1.0, 40), {}
    for periods in (1, 4):
        window = periods * system.resolution
        run = system.scene.run.model_copy(update={"window": window})
        found[periods] = simulate(replace(system, scene=system.scene.model_copy(update={"run": run})))
        error = true_errors(found[periods], exact, window)["basis.force"]
        assert error < 0.01 or LEAST * error < found[periods].estimates["basis.force"] < MOST * error
    assert found[4].estimates["basis.force"] < 0.5 * found[1].estimates["basis.force"]


def test_the_runs_with_fewer_modes_and_with_one_more_take_the_same_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps, march = [], solver._march

    def counted(system: System, *rest: Any) -> Trajectory:
        found = march(system, *rest)
        steps.append((len(system.velocity), found.counts["step"]))
        return found

    monkeypatch.setattr(solver, "_march", counted)
    found = simulate(build(tmp_path, rod_records(12), rod_scene(checks=True)))
    assert steps[-4:] == [(count, found.counts["step"]) for count in (13, 7, 4, 14)]
    assert "basis.impulse" in found.estimates


def test_the_window_is_at_most_the_duration(tmp_path: Path) -> None:
    """Modes of a period that is longer than the run do not ask for more steps than it has."""
    scene = rod_scene(checks=True)
    scene["run"] |= {"duration": 1e-6}
    system = build(tmp_path, rod_records(2), scene)
    assert system.resolution > system.separation == 1e-6


def test_a_run_without_checks_is_taken_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs, march = [], solver._march
    monkeypatch.setattr(solver, "_march", lambda *all_of_it: runs.append(all_of_it) or march(*all_of_it))
    scene = rod_scene(checks=True)
    scene["run"] |= {"checks": False, "window": 1e-5}
    assert not simulate(build(tmp_path, rod_records(12), scene)).estimates
    assert len(runs) == 1
    del scene["run"]["window"]  # The window is a tenth of the impact, which a first run finds.
    assert not simulate(build(tmp_path / "found", rod_records(12), scene)).estimates
    assert len(runs) == 3


def test_nothing_is_estimated_where_nothing_touches(tmp_path: Path) -> None:
    scene = rod_scene(checks=True)
    scene["body"]["part"]["velocity"] = [-1.0, 0.0, 0.0]
    assert not any(name.startswith("basis") for name in simulate(build(tmp_path, rod_records(12), scene)).estimates)


def test_a_failure_of_the_run_with_fewer_modes_is_an_error_of_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    march = solver._march

    def fails(system: System, *rest: Any) -> Trajectory:
        found = march(system, *rest)
        return found if len(system.velocity) == 13 else replace(found, result=Result.CHATTER.name)

    monkeypatch.setattr(solver, "_march", fails)
    found = simulate(build(tmp_path, rod_records(12), rod_scene(checks=True)))
    assert found.result == Result.FINISHED.name
    assert found.estimates["basis.impulse"] == found.estimates["basis.force"] == 1.0


@pytest.mark.parametrize("name", ["nested", "run"])
def test_a_run_with_fewer_modes_that_cannot_start_is_an_error_of_one_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    march = solver._march

    def refused(system: System, *rest: Any) -> Any:
        if name == "run" and len(system.velocity) == 13:
            return march(system, *rest)
        raise {"nested": SceneError, "run": SolverError}[name]("contact.wall: no start")

    monkeypatch.setattr(*((basis_check, "nested") if name == "nested" else (solver, "_march")), refused)
    found = simulate(build(tmp_path, rod_records(12), rod_scene(checks=True)))
    assert found.result == Result.FINISHED.name
    assert found.estimates["basis.impulse"] == found.estimates["basis.force"] == 1.0
    assert found.counts[BASIS_REASON] == "contact.wall: no start"


@pytest.mark.parametrize("count", [1, 2])
def test_a_body_with_one_elastic_coordinate_has_an_error_of_one_with_its_reason(tmp_path: Path, count: int) -> None:
    found = simulate(build(tmp_path, rod_records(count), rod_scene(checks=True)))
    assert found.result == Result.FINISHED.name
    assert found.counts.get(BASIS_REASON) == (ONE_COORDINATE if count == 1 else None)
    assert (found.estimates["basis.impulse"] == found.estimates["basis.force"] == 1.0) == (count == 1)


def test_bodies_without_elastic_coordinates_have_no_error_of_the_basis(tmp_path: Path) -> None:
    mass = rigid_records(2.0, {"face": ([0.0, 0, 0], [-1.0, 0, 0])}, axes=(0,))
    part = rigid_records(2.0, {"tip": ([1.0, 0, 0], [1.0, 0, 0])}, axes=(0,))
    found = simulate(
        build_all(tmp_path, {"part": part, "mass": mass}, striker_scene(1.0, method="impact", restitution=0.5))
    )
    assert found.contacts["pair"].force.any()
    assert not any(name.startswith("basis") for name in found.estimates)
    assert BASIS_REASON not in found.counts


def test_resting_and_multipoint_contacts_have_an_estimate(tmp_path: Path) -> None:
    scene = block_scene(checks=True)
    scene["run"] |= {"gravity": [9.81, 0.0, 0.0]}
    found = simulate(build(tmp_path, block_records(5), scene))
    assert 0 < found.estimates["basis.impulse"] < 1
    assert "basis.rebound" not in found.estimates


def test_a_force_that_presses_at_rest_and_does_not_change_has_no_error_of_the_basis(tmp_path: Path) -> None:
    """Whatever the modes, it is the weight: impacts alone are shorter than modes resolve."""
    scene = block_scene(checks=True, duration=1e-5)
    scene["body"]["part"] = {}
    scene["contact"]["wall"]["against"]["point"] = [0.05, 0.0, 0.0]
    scene["run"] |= {"gravity": [9.81, 0.0, 0.0]}
    found = simulate(build(tmp_path, block_records(5), scene))
    assert max(found.estimates[f"basis.{name}"] for name in ("impulse", "force")) < 1e-6


def test_the_resolution_is_that_of_the_body_with_the_lowest_cut_off(tmp_path: Path) -> None:
    """The other body's shorter periods do not make forces converge that this one cannot carry."""
    fast, slow = rod_records(20), rod_records(20)
    slow = (replace(slow[0], angular_frequencies=0.01 * slow[0].angular_frequencies), slow[1])
    facing = replace(fast[0].interfaces["tip"], normals=np.array([[-1.0, 0, 0]]))
    fast = (replace(fast[0], interfaces={"tip": facing}), fast[1])
    scene = {
        "body": {"slow": {}, "fast": {"position": [0.0, 0, 0]}, "aside": {"component": "slow"}},
        "contact": {
            "pair": {
                "body": "slow",
                "interface": "tip",
                "against": {"shape": "body", "body": "fast", "interface": "tip"},
            }
        },
        "run": {"duration": 1e-3},
    }
    system = build_all(tmp_path, {"slow": slow, "fast": fast}, scene)
    assert system.resolution == pytest.approx(2 * np.pi / slow[0].angular_frequencies.max())
    assert system.shortest_period == pytest.approx(2 * np.pi / fast[0].angular_frequencies.max())


def test_an_impact_that_no_kept_mode_takes_part_in_is_not_called_accurate(tmp_path: Path) -> None:
    """The kept modes stand for bending ones, which an axial impact does not excite: both bases lack all its waves."""
    modal, morph = rod_records(40)
    tip, omega = modal.interfaces["tip"], modal.angular_frequencies
    lacking = np.array(modal.residual_flexibility) + float((tip.rows**2 / omega**2).sum())
    few = replace(
        modal, normal_count=4, angular_frequencies=0.1 * omega[:4], residual_flexibility=lacking,
        interfaces={"tip": replace(tip, rows=np.zeros((1, 4)))},
    )  # fmt: skip
    mass = rigid_records(2.0, {"face": ([0.0, 0, 0], [-1.0, 0, 0])}, axes=(0,))
    exact, found = (
        simulate(build_all(tmp_path / name, {"part": (record, morph), "mass": mass}, striker_scene(1.0)))
        for name, record in (("exact", modal), ("kept", few))
    )
    impulses = [one.quantities["pair.impulse"]["value"] for one in (exact, found)]
    error = abs(impulses[1] / impulses[0] - 1)
    assert error > 0.1
    assert LEAST * error < found.estimates["basis.impulse"] < MOST * error
    assert exact.estimates["basis.impulse"] < 0.01
