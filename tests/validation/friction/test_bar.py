"""An elastic bar on a frictional ground (N3): pushed suddenly, slowly and in cycles.

Exact but for 40 to 80 modes, and for the inertia of slow loads: a push that takes 2 ms is ten passages of its wave.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.kinds import simulation
from gudgeon.solver.simulation import Steps
from tests.validation.friction.records import HERE, reference

REFERENCE = reference("N3_frictional_bar")
SUDDEN, SLOW, CYCLE = (REFERENCE["expected"][name] for name in ("sudden_push", "slow_push", "cycle"))
GIVEN = REFERENCE["parameters"]
EA, PUSH = GIVEN["E"] * GIVEN["section"], GIVEN["force"]
RISE = 2e-3
"""Duration of a slow push [s]."""


def near(found: float, exact: dict[str, Any]) -> None:
    assert found == pytest.approx(exact["value"], rel=exact["suggested_rel_tol"])


def begun(folder: Path, **sets: Any) -> Steps:
    changed = {key.replace("__", "."): value for key, value in sets.items()}
    return simulation(HERE / "bar.toml", set=changed, db=folder / "db", out=folder / "out")


def profile(steps: Steps) -> tuple[np.ndarray, np.ndarray]:
    """Return places from the pushed end [m], ascending, and the displacement there along x [m]."""
    x = steps.system.bodies["bar"].morph.points["foot"][:, 0]
    order = np.argsort(x)
    return x[order] - x.min(), steps.port("contact.ground").displacement[1::3][order]


def slip_length(x: np.ndarray, moved: np.ndarray) -> float:
    """Return where the parabola of a displacement ends [m]."""
    inside = moved > 0.02 * moved[0]
    return float(np.polyfit(np.sqrt(moved[inside]), x[inside], 1)[1])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bar")


def test_a_sudden_push_slides_twice_as_far_and_stops_at_once(folder: Path) -> None:
    steps, times, end = begun(folder), [], []
    while steps.time < 2e-4:
        steps.step()
        times.append(steps.time)
        end.append(float(profile(steps)[1][0]))
    x, moved = profile(steps)
    near(slip_length(x, moved), SUDDEN["slip_length"])
    near(end[-1], SUDDEN["end_displacement"])
    near(steps.energies["dissipated"], SUDDEN["dissipated"])
    at = np.array(times)
    early = (at > 5e-6) & (at < 1e-4)
    near(float(np.polyfit(at[early], np.array(end)[early], 2)[1]), SUDDEN["end_velocity_at_start"])
    # The parabola of the end's displacement over time stops at its summit.
    square = np.polyfit(at[early], np.array(end)[early], 2)
    near(float(-square[1] / (2 * square[0])), SUDDEN["stop_time"])
    assert np.ptp(np.array(end)[at > 1.6e-4]) < 1e-3 * end[-1]
    left = -EA * float(np.interp(x[-1] * 0.375, x, np.gradient(moved, x)))
    near(left, SUDDEN["force_left_at_half_slip_length"])
    balance = steps._state.extreme[1] / steps.energies["work"]
    assert balance < 1e-12, "the energy balance closes to round-off"


def test_slow_pushes_and_cycles_lose_what_their_slip_takes(folder: Path) -> None:
    """Up to F, back to zero, to −F, and up to F again, each with a smooth start and end."""
    f, T = PUSH / 2, RISE
    rise = f"{f}*(1 - cos(pi*min(t, {T})/{T}))"
    back = f"step(t - {T})*{f}*(cos(pi*(min(t, {2 * T}) - {T})/{T}) - 1)"
    down = f"step(t - {2 * T})*{f}*(cos(pi*(min(t, {3 * T}) - {2 * T})/{T}) - 1)"
    again = f"step(t - {3 * T})*{2 * f}*(1 - cos(pi*(min(t, {5 * T}) - {3 * T})/{2 * T}))"
    steps = begun(
        folder, component__bar__mesh__size=0.02, component__bar__modes__normal_count=40, force__push__values="unset",
        force__push__expression=" + ".join((rise, back, down, again)), run__duration=5 * T, run__step=1.1e-6,
    )  # fmt: skip
    steps.step(until=T)
    x, pushed = profile(steps)
    near(slip_length(x, pushed), SLOW["slip_length"])
    near(pushed[0], SLOW["end_displacement"])
    near(first := steps.energies["dissipated"], SLOW["dissipated"])
    steps.step(until=2 * T)
    x, moved = profile(steps)
    near(moved[0], CYCLE["end_displacement_after_unloading_to_zero"])
    near(slip_length(x, pushed - moved), CYCLE["slip_length_on_unloading"])
    steps.step(until=5 * T)
    near(steps.energies["dissipated"] - first, CYCLE["energy_lost_per_full_cycle"])
