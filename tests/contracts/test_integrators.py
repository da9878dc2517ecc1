"""Every integrator: its declared order, its balances, its promised drift, and the answer of exact motion."""

import math
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.integrators.steps import plan_run
from gudgeon.solver.scene.run import Run
from gudgeon.solver.simulate import simulate, start
from tests.solver.systems import build, rod_records

METHODS: dict[str, dict[str, Any]] = {
    "small": {"method": "residual"},
    "event": {"method": "residual"},
}
CLOSED, WHOLE = 1.6e-4, 6e-4
"""Of a rod of 400 µs of contact: closed from the start to the end, and until it has parted [s]."""
STEPS = {"small": 320}
"""Steps in the time in which the rod is closed: their error is in its asymptotic range, and that of eight times as many
above round-off; each number divides the time into whole steps."""
FINER = (1, 2, 4, 8)
"""What these numbers are multiplied by."""


def scene(name: str, method: dict[str, Any], **run: Any) -> dict[str, Any]:
    plane = {"shape": "plane", "point": [1, 0, 0], "normal": [-1, 0, 0]}
    return {
        "body": {"part": {"velocity": [1.0, 0, 0]}},
        "contact": {"wall": {"body": "part", "interface": "tip", "against": plane} | method},
        "run": {"duration": CLOSED, "integrator": name, "samples": 10, "frames": 2} | run,
    }


def solved(folder: Path, name: str, method: dict[str, Any], **run: Any) -> Trajectory:
    return simulate(build(folder, rod_records(8), scene(name, method, **run)))


def undivided(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Obey steps that are too large for a law or many points; they are not for one linear contact."""
    monkeypatch.setattr(INTEGRATORS[name], "largest", math.inf)


def apart(found: Trajectory, exact: Trajectory) -> float:
    """Return the relative error of the last velocities."""
    return float(np.abs(found.velocities[-1] - exact.velocities[-1]).max() / np.abs(exact.velocities[-1]).max())


def test_every_member_has_a_case() -> None:
    assert set(INTEGRATORS) == set(get_args(Run.model_fields["integrator"].annotation)) - {"auto"}
    # Without contact: its own tests are in tests/solver/integrators/turning.
    assert set(METHODS) == set(INTEGRATORS) - {"turning"}
    assert set(STEPS) == {name for name in METHODS if math.isfinite(INTEGRATORS[name].order)}


@pytest.mark.parametrize("name", sorted(METHODS))
def test_runs_have_the_capabilities_of_their_name(name: str, tmp_path: Path) -> None:
    system = build(tmp_path, rod_records(2), scene(name, METHODS[name]))
    assert isinstance(start(system, plan_run(system)), Small if name == "small" else INTEGRATORS[name])


@pytest.mark.parametrize("name", sorted(STEPS))
def test_the_error_falls_as_declared(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    undivided(name, monkeypatch)
    exact = solved(tmp_path / "exact", "event", METHODS[name])
    counts = [round(STEPS[name] * factor) for factor in FINER]
    errors = [apart(solved(tmp_path / str(count), name, METHODS[name], step=CLOSED / count), exact) for count in counts]
    assert min(errors) > 1e-11  # Round-off is below 1e-13.
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(INTEGRATORS[name].order, abs=0.2)


def test_the_windowed_force_of_rigid_contact_has_its_jumps(tmp_path: Path) -> None:
    """The first is half of the impulse within the window; over a step of dt it is spread, dt/4W of the force."""
    rigid = {"method": "constraint"}
    exact = solved(tmp_path / "event", "event", rigid, window=5e-6)
    key = "wall.force_peak"
    assert exact.quantities["wall.force_window"]["value"] == 5e-6
    for step in (1e-7, 2.5e-8):
        found = solved(tmp_path / f"{step}", "small", rigid, window=5e-6, step=step)
        assert found.quantities["wall.impulse"]["value"] == pytest.approx(
            exact.quantities["wall.impulse"]["value"], rel=1e-3
        )
        assert found.quantities[key]["value"] == pytest.approx(exact.quantities[key]["value"], rel=step / 2e-5)


@pytest.mark.parametrize("name", sorted(METHODS))
def test_balances_close(name: str, tmp_path: Path) -> None:
    found = solved(tmp_path, name, METHODS[name])
    assert found.result == "FINISHED"
    assert found.momentum_residual < 1e-12
    # Closed from the start to the end, contact is linear: implicit rules and exact motion keep a quadratic energy.
    assert found.energy_drift < 1e-11
    assert found.times[-1] >= CLOSED * (1 - 1e-12)
    interval = found.times[1] - found.times[0]
    impulse = found.quantities["wall.impulse"]["value"]
    assert -interval * found.contacts["wall"].force[:, 0].sum() == pytest.approx(impulse, rel=1e-12)


@pytest.mark.parametrize("name", sorted(METHODS))
def test_the_state_at_the_largest_force_is_kept(name: str, tmp_path: Path) -> None:
    """Beside four frames, the state at the end of the sample of the largest force: that of a run with all as frames."""
    given = {"duration": WHOLE, "samples": 40} | ({} if INTEGRATORS[name].own_steps else {"step": WHOLE / 800})
    every = solved(tmp_path / "every", name, METHODS[name], frames=40, **given)
    few = solved(tmp_path / "few", name, METHODS[name], frames=4, **given)
    assert len(every.times) == len(few.times) == len(every.frames)
    force = few.contacts["wall"].force
    highest = int(np.linalg.norm(force, axis=1).argmax())
    assert (highest + 1) % 10  # No frame ends there.
    assert few.peaks == {"wall": 0}
    np.testing.assert_allclose(few.peak_times, few.times[[highest]], rtol=1e-14)
    largest = np.abs(every.frames).max()
    np.testing.assert_allclose(few.peak_frames, every.frames[[highest]], rtol=0, atol=1e-12 * largest)
    np.testing.assert_allclose(few.peak_velocities, every.velocities[[highest]], rtol=0, atol=1e-11)
    pressed = every.contacts["wall"].multipliers[[highest]]
    np.testing.assert_allclose(few.contacts["wall"].peak_multipliers, pressed, rtol=1e-9)


@pytest.mark.parametrize("name", sorted(METHODS))
def test_no_state_is_kept_of_a_contact_that_stayed_open(name: str, tmp_path: Path) -> None:
    away = scene(name, METHODS[name])
    away["body"]["part"]["velocity"] = [-1.0, 0, 0]
    found = simulate(build(tmp_path / "away", rod_records(8), away))
    assert found.peak_times is not None
    assert found.peaks == {}
    assert len(found.peak_times) == 0


@pytest.mark.parametrize("name", sorted(METHODS))
def test_the_drift_of_a_whole_impact_is_as_promised(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    undivided(name, monkeypatch)
    found = solved(tmp_path, name, METHODS[name], duration=WHOLE)
    assert found.quantities["wall.rebound_velocity"]["value"] > 0.9
    assert found.energy_drift < INTEGRATORS[name].promised_drift
