"""The impacts that the time loops locate are those of the history of forces; the capacity of the log is not silent."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import BEGINS, CLOSING, OPENING, Trajectory
from gudgeon.solver import core
from gudgeon.solver.errors import SolverError
from gudgeon.solver.integrators import impact_log as module
from gudgeon.solver.integrators.event.impacts import ContactImpacts
from gudgeon.solver.integrators.impact_log import ImpactLog, Located, impact_log
from gudgeon.solver.result import Result
from gudgeon.solver.results.contact_events import impacts_in
from gudgeon.solver.simulate import simulate
from tests.solver.systems import block_records, block_scene, build, rod_records, rod_scene

STEP = 0.01
ROUND_OFF = 1e-12


def feed(log: ImpactLog, forces: np.ndarray, first: int) -> None:
    for number, resultants in enumerate(forces):
        log.force[:] = resultants
        core.log_step(log, first + number)


def histories(seed: int, contacts: int = 3, steps: int = 4000) -> np.ndarray:
    """Return forces of impacts and pauses of all lengths, (steps, contacts, 3)."""
    rng = np.random.default_rng(seed)
    forces = rng.standard_normal((steps, contacts, 3))
    forces[:, :, 0] += 2.0
    for k in range(contacts):
        at = 0
        while at < steps:
            lasts, pauses = rng.geometric(0.05, 2)
            forces[at + lasts : at + lasts + pauses, k] = 0.0
            at += lasts + pauses
    return forces


def logged(forces: np.ndarray, window: float, pieces: int = 7) -> list[np.ndarray]:
    log = impact_log([0] * forces.shape[1], STEP, window, np.full(forces.shape[1], window))
    located, first = Located(log), 0
    for part in np.array_split(forces, pieces):
        feed(log, part, first)
        assert located.take()
        first += len(part)
    return located.impacts()


@pytest.mark.parametrize("window", [0.0, 0.4 * STEP, STEP, 7 * STEP, 23.37 * STEP, 1000 * STEP, 5000 * STEP])
def test_steps_and_histories_agree(window: float) -> None:
    for seed in range(5):
        forces = histories(seed)
        for k, found in enumerate(logged(forces, window)):
            expected = impacts_in(STEP * np.arange(len(forces) + 1), forces[:, k], window, window)
            # Begin and end are located by gaps, of which there are none here.
            columns = [2, 3, 4, 7, 8]
            np.testing.assert_allclose(found[:, columns], expected[:, columns], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("window", [0.0, 0.7 * STEP, 4 * STEP, 9.3 * STEP])
@pytest.mark.parametrize("struck", [3, 11, 24])
def test_an_impulse_without_duration_is_that_of_a_force_over_its_step(window: float, struck: int) -> None:
    """Impulse and windowed force have it; the largest force of a step has not."""
    forces = np.zeros((60, 1, 3))
    forces[:30] = np.random.default_rng(struck).uniform(0.5, 2.0, (30, 1, 3))
    impulse, peak = np.array([0.05, -0.2, 0.1]), np.linalg.norm(forces[:, 0], axis=1).max()
    log = impact_log([0], STEP, window, np.full(1, window))
    located = Located(log)
    feed(log, forces[:struck], 0)
    for array in (log.sudden, log.jump):
        array[0] += impulse
    feed(log, forces[struck:], struck)
    assert located.take()
    (found,) = located.impacts()[0]
    forces[struck] += impulse / STEP
    (expected,) = logged(forces, window)[0]
    assert found[2] == pytest.approx(expected[2], rel=1e-12)
    assert found[3] == pytest.approx(peak, rel=1e-12)
    if window:
        np.testing.assert_allclose(found[7:9], expected[7:9], rtol=1e-9)


@pytest.mark.parametrize("window", [0.0, 7.3 * STEP])
def test_exact_courses_of_constant_forces_are_those_of_steps(window: float) -> None:
    forces = histories(3)[:, :1]
    tracker, (expected,) = ContactImpacts(window, window), logged(forces, window)
    for number, force in enumerate(forces[:, 0]):
        edges = STEP * np.array([number, number + 1])
        if not force.any():
            continue
        if not number or not forces[number - 1].any():
            tracker.touches(0, float(edges[0]), 1.0)
        tracker.presses(edges, STEP * np.array([np.zeros(3), force]), np.array([force, force]))
        tracker.note_peak(float(np.linalg.norm(force)), float(edges.mean()))
        if number + 1 == len(forces) or not forces[number + 1].any():
            tracker.leaves(0, float(edges[1]), 0.5)
            tracker.parts(0)
    found = tracker.impacts(STEP * len(forces))
    np.testing.assert_allclose(found[:, 2:5], expected[:, 2:5], rtol=1e-9, atol=1e-9)
    # Between the ends and middles of steps a windowed force may be larger, as its parabola is.
    more = found[:, 7] / expected[:, 7] - 1
    assert (more > -1e-9).all()
    assert (more < (0.5 * STEP / window) ** 2 if window else np.abs(more) < 1e-9).all()
    np.testing.assert_allclose(found[:, 8], expected[:, 8], rtol=1e-9, atol=0.5 * STEP if window else 1e-9)


def solved(folder: Path, samples: int, **run: Any) -> Trajectory:
    scene = block_scene(4e-4, surface_stiffness=1e14)
    scene["run"] |= {"samples": samples, "frames": 10} | run
    return simulate(build(folder, block_records(20), scene))


def test_quantities_do_not_depend_on_samples(tmp_path: Path) -> None:
    given = {"integrator": "small", "step": 2e-8}
    coarse, fine = (solved(tmp_path / str(n), n, **given) for n in (50, 4000))
    assert coarse.counts["steps"] == fine.counts["steps"]
    same(coarse, fine)
    assert {"wall.force_peak", "wall.force_window", "wall.force_peak_raw", "wall.impact1.approach_speed"} <= set(
        fine.quantities
    )


def test_quantities_of_a_rod_do_not_depend_on_samples(tmp_path: Path) -> None:
    law = {"method": "penalty", "law": {"kind": "linear", "stiffness": 2e8}}
    runs = []
    for samples in (50, 4000):
        scene = rod_scene(6e-4, **law)
        scene["run"] |= {"samples": samples, "frames": 10, "integrator": "event"}
        runs.append(simulate(build(tmp_path / str(samples), rod_records(8), scene)))
    same(*runs, rtol=1e-5)


def same(one: Trajectory, other: Trajectory, rtol: float = 1e-12) -> None:
    assert one.quantities.keys() == other.quantities.keys()
    sampled = tuple(f"pressure_{what}" for what in ("peak", "time", "patch", "x", "y", "z"))  # Of samples.
    sampled += ("centre_x", "centre_y", "centre_z", "contact_area")
    for name, entry_ in other.quantities.items():
        if not name.endswith(sampled):
            assert one.quantities[name]["value"] == pytest.approx(entry_["value"], rel=rtol, abs=1e-12), name


def test_every_integrator_gives_the_same_quantities(tmp_path: Path) -> None:
    law, found = {"method": "penalty", "law": {"kind": "linear", "stiffness": 2e8}}, {}
    for name in ("event", "small"):
        scene = rod_scene(6e-4, **(law if name == "event" else {}))
        if name == "small":
            scene["contact"]["wall"] |= {"method": "penalty", "surface_stiffness": 2e8 / 1e-4}
        scene["run"] |= {"integrator": name, "frames": 10}
        found[name] = simulate(build(tmp_path / name, rod_records(8), scene)).quantities
    exact = found.pop("event")
    for name, quantities in found.items():
        assert {key for key in quantities if "pressure" not in key} == set(exact), name
        for key in ("impulse", "force_peak", "force_peak_raw", "duration", "impact1.separation_speed", "restitution"):
            value = exact[f"wall.{key}"]["value"]
            assert quantities[f"wall.{key}"]["value"] == pytest.approx(value, rel=5e-3), (name, key)


@pytest.mark.parametrize("integrator", ["event", "small"])
def test_impacts_begin_within_a_step_where_the_flight_ends(tmp_path: Path, integrator: str) -> None:
    gap, speed, step = 1.03742e-5, 0.7, 1e-7
    law = {"method": "penalty", "law": {"kind": "linear", "stiffness": 2e8}}
    if integrator == "small":
        law = {"method": "penalty", "surface_stiffness": 2e8 / 1e-4}
    scene = rod_scene(5e-5, **law)
    scene["body"]["part"] |= {"position": [-gap, 0.0, 0.0], "velocity": [speed, 0.0, 0.0]}
    scene["run"] |= {"integrator": integrator, "frames": 10} | ({} if integrator == "event" else {"step": step})
    (impact,) = simulate(build(tmp_path, rod_records(8), scene)).impacts["wall"]
    # The flight is exact; the gap is taken as linear over the step in which the force begins.
    assert impact[BEGINS] == pytest.approx(gap / speed, rel=0, abs=1e-2 * step)
    assert impact[CLOSING] == pytest.approx(speed, rel=1e-2)
    assert np.isnan(impact[OPENING])


def test_default_windows_of_all_loops_follow_the_impact(tmp_path: Path) -> None:
    """A rod of two modes, whose periods are longer than a tenth of the impact: 2 L/c."""
    for name in ("event", "small"):
        scene = rod_scene(6e-4)
        scene["run"] |= {"integrator": name, "frames": 10}
        system = build(tmp_path / name, rod_records(2), scene)
        found = simulate(system)
        window, impact = found.quantities["wall.force_window"]["value"], found.impacts["wall"][0]
        assert window == pytest.approx(0.1 * (impact[1] - impact[0]), rel=0.05), name  # Of twice the step.
        assert window < 0.5 * system.separation
        scene["run"]["window"] = window
        given = simulate(build(tmp_path / f"{name}-given", rod_records(2), scene)).quantities
        peak = found.quantities["wall.force_peak"]["value"]
        assert peak == pytest.approx(given["wall.force_peak"]["value"], rel=1e-6), name
        resolved = found.quantities["wall.force_resolved"]
        assert resolved["value"] < 0.8 * peak
        scene["run"]["window"] = found.quantities["wall.resolved_window"]["value"]
        given = simulate(build(tmp_path / f"{name}-wide", rod_records(2), scene)).quantities
        assert resolved["value"] == pytest.approx(given["wall.force_peak"]["value"], rel=2e-3), name


def test_windowed_force_is_that_of_the_history(tmp_path: Path) -> None:
    found = solved(tmp_path, 40_000, integrator="small", step=1e-8)
    times, force = np.concatenate([[0.0], found.times]), found.contacts["wall"].force
    window = found.quantities["wall.force_window"]["value"]
    expected = impacts_in(times, force, window, window)
    np.testing.assert_allclose(found.impacts["wall"][:, [2, 3, 4, 7]], expected[:, [2, 3, 4, 7]], rtol=1e-9)
    np.testing.assert_allclose(found.impacts["wall"][:, :2], expected[:, :2], atol=found.times[0])


def struck_twice(folder: Path, **run: Any) -> Trajectory:
    """Let a block of three points turn so fast that a second point strikes 70 µs after the first has parted."""
    scene = block_scene(6e-4)
    scene["body"]["part"]["angular_velocity"] = [0.0, 30.0, 20.0]
    scene["run"] |= {"integrator": "small", "step": 2e-8, "frames": 2, "samples": 10} | run
    return simulate(build(folder, block_records(3, seed=2), scene))


def test_a_longer_window_merges_impacts(tmp_path: Path) -> None:
    separate = struck_twice(tmp_path / "short", window=1e-6)
    together = struck_twice(tmp_path / "long", window=3e-4)
    assert separate.quantities["wall.impacts"]["value"] == 2
    assert together.quantities["wall.impacts"]["value"] == 1
    assert together.quantities["wall.force_window"]["value"] == 3e-4
    first, second = separate.impacts["wall"][:, 2]
    assert together.impacts["wall"][0, 2] == pytest.approx(first + second, rel=1e-9)  # Of one direction.
    mean = together.quantities["wall.impulse"]["value"] / 3e-4
    assert 0.5 * mean < together.quantities["wall.force_peak"]["value"] <= mean * (1 + ROUND_OFF)


def test_a_full_log_ends_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CAPACITY", 1)
    assert struck_twice(tmp_path, window=1e-6).result == Result.IMPACTS.name


def test_steps_too_short_for_the_window_are_one_clear_line() -> None:
    with pytest.raises(SolverError, match=r"^steps of 1e-30 s: the window of peak forces, 1e-05 s, has more"):
        impact_log([0], 1e-30, 1e-5, np.full(1, 1e-5))
    assert len(impact_log([0], 1e-8, 1e-5, np.full(1, 1e-5)).ring[0]) == 2003
