"""Stiffness of weight and preload in small motion against closed forms: rigid pendulums, and a bead in a bore."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.linear.load_stiffness import with_load_stiffness
from gudgeon.solver.linear.modes import assembled_modes
from gudgeon.solver.linear.state import linearised
from gudgeon.solver.simulate import simulate
from tests.solver.systems import build, rigid_records

MASS, ARM, GRAVITY, SPIN = 2.0, 0.5, 9.81, 0.02
INERTIA = 0.02
POINTS = {"foot": ([0.0, 0.0, -ARM], [0.0, 0.0, -1.0])}
STIFF = [1e8, 1e8, 1e8]


def pendulum(side: float, **force: Any) -> dict[str, Any]:
    """A body on a stiff bushing above (side 1) or below (side −1) its centre, which swings about it."""
    return {
        "body": {"p": {"component": "part", "velocity": [-side * ARM * SPIN, 0, 0], "angular_velocity": [0, SPIN, 0]}},
        "force": {"b": {"kind": "bushing", "body": "p", "at": [0, 0, side * ARM], "stiffness": STIFF} | force},
        "probe": {"c": {"kind": "displacement", "body": "p", "direction": [1, 0, 0]}},
        "run": {"duration": 0.5, "gravity": [0, 0, -GRAVITY], "checks": False},
    }


def records() -> tuple[Any, Any]:
    return rigid_records(MASS, POINTS, inertia=(INERTIA,) * 3)


def frequencies(folder: Path, scene: dict[str, Any]) -> np.ndarray:
    return assembled_modes(linearised(with_load_stiffness(build(folder, records(), scene)))).frequencies


@pytest.mark.parametrize(("side", "turns"), [(1.0, 0.0), (-1.0, 20.0), (1.0, 5.0)])
def test_weight_is_a_stiffness_of_a_pendulum(side: float, turns: float, tmp_path: Path) -> None:
    """ω² = (k ± m g l)/(J + m l²): a pendulum hangs or stands, with or without a spring against its turn."""
    scene = pendulum(side, rotational_stiffness=[turns] * 3)
    omega = np.sqrt((turns + side * MASS * GRAVITY * ARM) / (INERTIA + MASS * ARM**2))
    found = frequencies(tmp_path, scene)
    assert np.abs(found - omega / (2 * np.pi)).min() < 1e-5 * omega
    x = simulate(build(tmp_path, records(), scene)).probes["c"].values[-1, 0]
    assert x == pytest.approx(-side * ARM * SPIN / omega * np.sin(0.5 * omega), rel=1e-3)


def test_a_load_through_the_centre_is_one_too(tmp_path: Path) -> None:
    """A force in place of the weight, and the key that leaves it out."""
    scene = pendulum(1.0)
    scene["run"]["gravity"] = [0, 0, 0]
    scene["force"]["w"] = {
        "kind": "force",
        "body": "p",
        "at": [0, 0, 0],
        "direction": [0, 0, -1],
        "expression": "19.62",
    }
    omega = np.sqrt(MASS * GRAVITY * ARM / (INERTIA + MASS * ARM**2))
    assert np.abs(frequencies(tmp_path, scene) - omega / (2 * np.pi)).min() < 1e-5 * omega
    scene["body"]["p"]["geometric_stiffness"] = False
    assert (frequencies(tmp_path, scene)[:3] < 1e-3).all()


def test_a_buckled_start_names_the_load_factor(tmp_path: Path) -> None:
    scene = pendulum(-1.0, rotational_stiffness=[8.0] * 3)
    factor = 8.0 / (MASS * GRAVITY * ARM)
    with pytest.raises(SceneError, match=rf"body.p: it buckles .*load factor {factor:.3g}") as raised:
        simulate(build(tmp_path, records(), scene))
    assert "body.p.geometric_stiffness" in str(raised.value)


@pytest.mark.parametrize("velocity", [0.0, 1e-4])
def test_a_bead_in_a_bore_swings(velocity: float, tmp_path: Path) -> None:
    """ω² = g/R, from the normal that turns; it rests on the layer while it slides."""
    radius = 0.02
    points = {"a": ([0.0, 0.0, -0.01], [0.0, 0.0, -1.0])}
    scene = {
        "body": {"p": {"component": "part", "position": [0, 0, -0.01], "freedom": ["x", "z"],
                       "velocity": [velocity, 0, 0]}},
        "contact": {"f": {"body": "p", "interface": "a", "surface_stiffness": 1e7,
                          "against": {"shape": "bore", "radius": radius, "axis": [0, 1, 0]}}},
        "probe": {"d": {"kind": "displacement", "body": "p"}},
        "run": {"duration": 0.2, "gravity": [0, 0, -GRAVITY], "checks": False},
    }  # fmt: skip
    system = build(tmp_path, rigid_records(1.0, points), scene)
    omega = np.sqrt(GRAVITY / radius)
    modes = assembled_modes(linearised(with_load_stiffness(system))).frequencies
    assert modes[0] == pytest.approx(omega / (2 * np.pi), rel=1e-4)
    run = simulate(system)
    x, z = run.probes["d"].values[:, 0], run.probes["d"].values[:, 2]
    np.testing.assert_allclose(x, velocity / omega * np.sin(omega * run.times), atol=1e-3 * velocity / omega + 1e-15)
    np.testing.assert_allclose(z, -GRAVITY / 1e7, rtol=1e-6)
