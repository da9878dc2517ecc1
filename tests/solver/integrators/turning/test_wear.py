"""Wear of joints with clearance: Archard's law, worn shapes of bearings and journals, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.special import erf

from gudgeon.modaldb.records.trajectory import WEAR, Trajectory
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from tests.solver.integrators.turning.scenes import MASS, hinge, solved, system_of

GAP, RADIUS, STIFFNESS = 1e-3, 0.02, 1e6
HERTZ = {"kind": "hertz", "stiffness": STIFFNESS, "exponent": 1.5}
BELOW = [0.0, -9.81, 0.0]
WEARS = {"coefficient": 1e-3, "hardness": 2e9, "length": 0.01}
DAMPED = {"kind": "linear", "stiffness": STIFFNESS, "damping": 2 * np.sqrt(STIFFNESS * MASS)}


def knee(wear: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    joint = hinge("clearance", clearance=GAP, radius=RADIUS, law=HERTZ, against_at=[0, 0, 0])
    return joint | ({} if wear is None else {"wear": WEARS | wear}) | more


def value(found: Trajectory, name: str) -> float:
    return found.quantities[f"knee.{name}"]["value"]


def waves(count: int, *terms: tuple[int, float, float], mean: float = 5e-5) -> list[list[float]]:
    """Return one section's depths: a mean and waves of number, size [m] and phase."""
    angles = 2 * np.pi / count * np.arange(count)
    return [(mean + sum([size * np.cos(n * angles - phase) for n, size, phase in terms], 0 * angles)).tolist()]


def thrown(wear: dict[str, Any] | None, folder: Path, **more: Any) -> Trajectory:
    """Return the run of a journal thrown about in a bearing; nothing acts from outside."""
    bodies = {
        "part": {"velocity": [0.4, 0.3, 0.02], "angular_velocity": [0.05, -0.03, 20.0]},
        "mate": {"velocity": [-0.1, 0.0, 0.0], "angular_velocity": [0.02, 0.01, -3.0]},
    }
    run = {"duration": 0.05, "accuracy": 1e-10}
    return solved(folder, bodies, {"knee": knee(wear, against="mate", **more)}, run=run)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Trajectory:
    """The run of a journal thrown about in a bearing that does not wear."""
    return thrown(None, tmp_path_factory.mktemp("bare"))


def swung(folder: Path, wear: dict[str, Any], load: float, swing: float, cycles: int) -> Trajectory:
    """Return the run of a bearing that oscillates about its journal under a constant load, as reference H2."""
    bodies = {"part": {"position": [0.0, -GAP - load / STIFFNESS, 0.0]}, "ring": {}}
    joints = {
        "axle": hinge("revolute", "ring"),
        "way": hinge("translational", axis=[0, 1, 0], against_at=[0, 0, 0]),
        "drive": {"kind": "driven", "joint": "axle", "expression": f"{swing}*(1-cos({20 * np.pi!r}*t))"},
        "knee": knee(wear, against="ring", law=DAMPED),
    }
    pressed = {"load": {"kind": "force", "body": "part", "at": [0, 0, 0], "direction": [0, -1, 0],
                        "expression": str(load)}}  # fmt: skip
    return solved(folder, bodies, joints, force=pressed, run={"duration": 0.1 * cycles})


def test_the_worn_volume_is_archards(tmp_path: Path) -> None:
    """H2: V = k/H 4 F r θ for each cycle; k/H ∫ F |v| dt to round-off, of both sides, wherever it lies."""
    load, swing, cycles = 150.0, 0.35, 3
    found = swung(tmp_path, {"journal_coefficient": 5e-4}, load, swing, cycles)
    slide = value(found, "load_distance")
    assert slide == pytest.approx(4 * load * (RADIUS + GAP + load / STIFFNESS) * swing * cycles, rel=1e-6)
    assert value(found, "wear_volume") == pytest.approx(1e-3 / 2e9 * slide, rel=1e-13)
    assert value(found, "journal_wear_volume") == pytest.approx(5e-4 / 2e9 * slide, rel=1e-13)
    assert value(found, "wear_indentation") == pytest.approx(load / STIFFNESS, rel=1e-6)
    cells = found.counts[WEAR]["knee"]
    assert np.sum(cells["impulse"]) == pytest.approx(load * 0.1 * cycles, rel=1e-8)
    # The load stands still on the journal, below, and the ring swings under it by 2θ the other way.
    assert value(found, "journal_wear_angle") == pytest.approx(1.5 * np.pi, abs=0.01)
    angles, ring = np.arange(360) * 2 * np.pi / 360, np.array(cells["load_distance"][0])
    assert (angles @ ring) / ring.sum() == pytest.approx(1.5 * np.pi - swing, abs=1e-3)
    # What a constant load passes evenly, under a pressure of standard deviation √(0.4 δ/e).
    deep = load / STIFFNESS
    width = np.sqrt(0.4 * deep / (GAP + deep))
    centre = ring.sum() * (angles[1] / (2 * swing)) * erf(swing / (width * np.sqrt(2)))
    assert ring[round((1.5 * np.pi - swing) / angles[1])] == pytest.approx(
        centre, rel=1e-2
    )  # A pressure of larger tails.


def test_wear_counts_from_a_time_on(tmp_path: Path) -> None:
    whole = swung(tmp_path, {}, 150.0, 0.35, 2)
    half = swung(tmp_path, {"after": 0.1}, 150.0, 0.35, 2)
    assert value(half, "wear_volume") == pytest.approx(0.5 * value(whole, "wear_volume"), rel=1e-6)
    assert value(half, "load_distance") == value(whole, "load_distance")


def test_wear_of_zero_changes_nothing(bare: Trajectory, tmp_path: Path) -> None:
    """Nor does wear that a run only adds up: bit for bit."""
    for change in ({"coefficient": 0.0}, {}, {"bearing_depth": [[0.0] * 8]}):
        found = thrown(change, tmp_path)
        for body in ("part", "mate"):
            np.testing.assert_array_equal(found.motion[body], bare.motion[body])
        np.testing.assert_array_equal(found.energies, bare.energies)


def test_an_even_wear_widens_the_clearance(tmp_path: Path) -> None:
    wider = thrown(None, tmp_path, clearance=GAP + 2e-4)
    for key in ("bearing_depth", "journal_depth"):
        found = thrown({key: waves(8, mean=2e-4)}, tmp_path)
        np.testing.assert_allclose(found.motion["part"], wider.motion["part"], rtol=1e-6, atol=1e-9, err_msg=key)


BUMPY = {
    "bearing_depth": waves(24, (2, 4e-5, 0.3), (5, 8e-6, 1.0)),
    "journal_depth": waves(36, (3, 2e-5, 0.7)),
}


@pytest.mark.parametrize("key", [["bearing_depth"], ["journal_depth"], ["bearing_depth", "journal_depth"]])
def test_worn_shapes_keep_momentum_and_energy(key: list[str], bare: Trajectory, tmp_path: Path) -> None:
    """The force of a worn shape has a potential, and its moment turns the journal."""
    found = thrown({one: BUMPY[one] for one in key}, tmp_path)
    assert value(found, "impacts") >= 3
    assert found.momentum_residual < 1e-12
    balance = found.energies @ [1, 1, 1, 1, -1]
    np.testing.assert_allclose(balance, balance[0], rtol=1e-7)  # Tilted by a few degrees.
    assert abs(found.motion["part"][-1] - bare.motion["part"][-1]).max() > 1e-3


@pytest.mark.parametrize(
    "more", [{"friction": {"coefficient": 0.2, "speed": 0.01}}, {"friction": {"coefficient": 0.2}}, {"length": 0.05}]
)
def test_worn_shapes_with_friction_and_of_long_journals(more: dict[str, Any], tmp_path: Path) -> None:
    wear = {key: one * (2 if "length" in more else 1) for key, one in BUMPY.items()}
    found = thrown(wear, tmp_path, **more)
    assert found.momentum_residual < 1e-12
    balance = found.energies @ [1, 1, 1, 1, -1]
    np.testing.assert_allclose(balance, balance[0], rtol=1e-7)
    cells = found.counts[WEAR]["knee"]
    for key in ("load_distance", "journal_load_distance"):
        assert np.sum(cells[key]) == pytest.approx(value(found, "load_distance"), rel=1e-12)


def test_a_journal_rests_in_its_groove(tmp_path: Path) -> None:
    """Pressed down within a bearing of depth h(θ) it sinks to c + h + m g/K, and to the bottom of a groove beside."""
    wear = {"bearing_depth": waves(360, (2, 3e-5, 2 * np.radians(-80.0))), "indentation": 1e-5, "cells": 720}
    body = {"part": {"position": [0.0, -GAP, 0.0]}}
    joint = knee(wear, law=DAMPED)
    side = {
        "hold": {"kind": "spring", "body": "part", "at": [0, 0, 0], "against_at": [2.0, -GAP, 0.0], "damping": 90.0}
    }
    run = {"duration": 1.0, "gravity": BELOW}
    found = solved(tmp_path, body, {"knee": joint}, run=run, force=side)
    x, y = found.motion["part"][-1, :2] - [0.0, GAP]
    angle = np.arctan2(y, x)
    # At rest the normal is vertical: (m g) across = K δ h'/..., of first order sin(θ + 90°) (c + δ + h) = h'.
    fine = np.linspace(np.radians(-100), np.radians(-60), 400001)
    h = 5e-5 + 3e-5 * np.cos(2 * fine - 2 * np.radians(-80.0))
    lowest = fine[np.argmin(np.sin(fine) * (GAP + h + MASS * 9.81 / STIFFNESS))]
    assert angle == pytest.approx(lowest, abs=2e-3)
    assert np.hypot(x, y) == pytest.approx(GAP + MASS * 9.81 / STIFFNESS + h[np.argmin(np.abs(fine - angle))], rel=1e-3)


def test_both_ends_of_a_tilted_journal_wear(tmp_path: Path) -> None:
    """A long journal under a moment rubs the bearing at opposite sides of its ends."""
    body = {"part": {"angular_velocity": [0.0, 0.0, 30.0]}}
    torque = {"tip": {"kind": "torque", "body": "part", "direction": [0, 1, 0], "expression": "3.0"}}
    pins = {"knee": knee({}, law=DAMPED, length=0.2), "way": hinge("spherical", against_at=[0, 0, 0])}
    found = solved(tmp_path, body, pins, force=torque, run={"duration": 0.5})
    ends = np.array(found.counts[WEAR]["knee"]["load_distance"])
    assert ends.shape == (2, 360)
    assert ends.sum() == pytest.approx(value(found, "load_distance"), rel=1e-13)
    assert ends.min() >= 0.0
    assert np.abs(ends[0].argmax() - ends[1].argmax()) == pytest.approx(180, abs=3)


def test_wear_ends_at_the_wall(tmp_path: Path) -> None:
    bodies, joints = {"part": {"angular_velocity": [0.0, 0.0, 50.0]}}, {"knee": knee({"thickness": 2e-8}, law=DAMPED)}
    found = simulate(system_of(tmp_path, bodies, joints, run={"duration": 0.2, "gravity": BELOW, "frames": 40}))
    assert found.result == "WORN_THROUGH"
    assert 0 < found.times[-1] < 0.2


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"hardness": 0.0}, "greater than 0"),
    ({"coefficient": -1e-3}, "greater than or equal to 0"),
    ({"cells": 10}, "greater than or equal to 36"),
    ({"length": 0.0}, "greater than 0"),
    ({"length": None}, "the joint has no length"),
    ({"bearing_depth": [[1e-5] * 4]}, "4 depths given"),
    ({"bearing_depth": [[1e-5] * 8, [1e-5] * 8]}, "2 lists given; the joint has 1"),
    ({"bearing_depth": [[3e-3] * 8]}, "up to 0.1 of the radius"),
    ({"journal_depth": [[-1e-6] * 8]}, "greater than or equal to 0"),
    ({"journal_depth": [[1e-4] * 8], "thickness": 5e-5}, "deeper than the wall"),
    ({"thickness": 0.0}, "greater than 0"),
]


@pytest.mark.parametrize(("change", "text"), REFUSED)
def test_what_cannot_be_is_refused(change: dict[str, Any], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        Scene.model_validate({"body": {"part": {}}, "joint": {"knee": knee(change)}, "run": {"duration": 1.0}})
