"""Damping ratios of a body that motions or bushings hold are those of its modes as it is held."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.linear.modes import assembled_modes
from gudgeon.solver.linear.state import linearised
from gudgeon.solver.simulate import simulate
from tests.solver.system.test_drives import solid
from tests.solver.systems import LENGTH, SPEED, build
from tests.validation.test_driven_bodies import held_rod

RATIO = 0.02
X = [1.0, 0.0, 0.0]
RUN: dict[str, Any] = {"duration": 0.1, "samples": 100, "frames": 10, "checks": False, "step": 1e-5}
DAMPINGS: dict[str, dict[str, Any]] = {
    "a ratio": {"ratio": RATIO},
    "a table": {"values": [[1.0, RATIO], [1e6, RATIO]]},
    "ratios": {"ratios": [RATIO] * 40},
}


def rod(damping: dict[str, Any], hold: dict[str, Any], **run: Any) -> dict[str, Any]:
    probe = {"tip": {"kind": "displacement", "body": "part", "interface": "tip"}}
    return {"body": {"part": {"freedom": ["x"], "damping": damping}}, "probe": probe, "run": RUN | run} | hold


def base(expression: str) -> dict[str, Any]:
    return {
        "motion": {
            "b": {"kind": "translation", "body": "part", "interface": "base", "direction": X, "expression": expression}
        }
    }


def spring(stiffness: float) -> dict[str, Any]:
    return {
        "force": {"k": {"kind": "spring", "body": "part", "interface": "base", "direction": X, "stiffness": stiffness}}
    }


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("hold", [base("0"), spring(1e13)], ids=["motion", "stiff spring"])
def test_ratios_are_those_of_the_held_modes(damping: str, hold: dict[str, Any], tmp_path: Path) -> None:
    modes = assembled_modes(linearised(build(tmp_path, held_rod(40), rod(DAMPINGS[damping], hold))))
    assert modes.frequencies[:10] == pytest.approx((np.arange(10) + 0.5) * SPEED / (2 * LENGTH), rel=1e-3)
    assert modes.damping[:10] == pytest.approx(np.full(10, RATIO), rel=0.01)


def test_a_tie_is_held_with_all_its_motions(tmp_path: Path) -> None:
    """The residual flexibility, which is much of a body of four modes, has damping of its own at high frequencies."""
    foot = {"kind": "translation", "body": "part", "interface": "foot", "direction": X, "held": True, "expression": "0"}
    scene = {"body": {"part": {"damping": {"ratio": RATIO}}}, "motion": {"foot": foot}, "run": RUN}
    modes = assembled_modes(linearised(build(tmp_path, solid(), scene)))
    top = solid()[0].angular_frequencies.max() / (2 * np.pi)
    low = modes.frequencies < 0.5 * top
    assert low.sum() > 2
    assert modes.damping[0] == pytest.approx(RATIO, rel=0.01)
    assert modes.damping[low] == pytest.approx(np.full(low.sum(), RATIO), rel=0.15)


def test_soft_mounts_leave_the_ratios_of_the_free_body(tmp_path: Path) -> None:
    """The body on its mount is not damped by its strain, and its elastic modes are those of the free one."""
    system = build(tmp_path, held_rod(40), rod({"ratio": RATIO}, spring(1e3)))
    modes = assembled_modes(linearised(system))
    assert modes.damping[0] < 1e-4
    assert modes.damping[1:9] == pytest.approx(np.full(8, RATIO), rel=0.01)
    assert set(system.scene.force) == {"k"}


def test_a_run_decays_with_the_ratio_and_rigid_motion_does_not(tmp_path: Path) -> None:
    """The tip of a rod whose base has moved on decays with the ratio of its lowest mode about the base's place."""
    scene = rod({"ratio": RATIO}, base("1e-5*(1 - exp(-(t/2e-4)**2))"), duration=0.03, samples=6000)
    found = simulate(build(tmp_path, held_rod(20), scene))
    period, t = 4 * LENGTH / SPEED, found.times
    swing = found.probes["tip"].values[:, 0] - 1e-5
    late = t > 12 * period  # Of the next mode, which decays three times as fast, 1 % of the first is left.
    omega = 2 * np.pi / period * np.sqrt(1 - RATIO**2)
    decay = np.exp(-RATIO * 2 * np.pi / period * t[late])
    waves = np.column_stack([decay * np.cos(omega * t[late]), decay * np.sin(omega * t[late])])
    rest = swing[late] - waves @ np.linalg.lstsq(waves, swing[late])[0]
    assert np.linalg.norm(rest) < 0.03 * np.linalg.norm(swing[late])
    assert found.energy_drift < 1e-6
