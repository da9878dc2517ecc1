"""Reference cases M1 to M4: rigid mechanisms, at default settings.

Andrews' squeezer (Hairer & Wanner, Solving ODE II, VII.7; Test Set for IVP Solvers), the N-four-bar and Bricard's
mechanism (IFToMM multibody benchmark A02, A04), the heavy top (Brüls & Cardona 2010, closed forms of Lagrange's top).
Values in M*.json beside the scenes, computed without this product.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from tests.scenes import reference, scene_path
from tests.validation.solved import solve

SQUEEZER = reference("squeezer/M1_squeezer.json")
FOUR_BAR = reference("four-bar/M2_n_four_bar.json")
BRICARD = reference("bricard/M3_bricard.json")
TOP = reference("top/M4_heavy_top.json")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path


@pytest.mark.parametrize(("accuracy", "bound"), [(None, 1e-8), (1e-5, 1e-5), (1e-11, 1e-11)])
def test_squeezer(accuracy: float | None, bound: float, folder: Path) -> None:
    """M1: 50 rows of joints in space hold 41 motions."""
    changes = {"run.samples": 400} | ({} if accuracy is None else {"run.accuracy": accuracy})
    found = solve("squeezer", folder, changes).history
    assert found.joints["o"].angle[-1] == pytest.approx(SQUEEZER["crank_angle_end"]["value"], abs=bound)
    assert found.motion["k1"][-1, 11] == pytest.approx(SQUEEZER["crank_speed_end"]["value"], rel=bound)
    angles = {"k3": "gamma", "k5": "delta", "k7": "epsilon"}
    start = json.loads(scene_path("squeezer/M1_squeezer.json").read_text())["parameters"]["initial_angles"]
    for body, name in angles.items():
        turned = SQUEEZER["angles_end"][name] - start[name]
        assert found.motion[body][-1, 5] == pytest.approx(turned, abs=bound)
    assert (found.counts["rows"], found.counts["rank"]) == (50, 41)
    assert found.energy_drift < 0.1 * bound
    assert max(joint.violation.max() for joint in found.joints.values()) < 0.1 * bound


def test_four_bar_passes_its_singular_positions(folder: Path) -> None:
    """M2: a full turn takes 1.9425 s; twice in it all links lie in one line, and the motion must stay one of all."""
    turn = FOUR_BAR["time_of_a_full_turn"]["value"]
    found = solve("four-bar", folder, {"run.duration": turn, "run.samples": 100, "run.frames": 2}).history
    speed = 1.0  # Of a rocker at the end of a turn, as at the start [rad/s].
    assert found.joints["ground0"].angle[-1] == pytest.approx(-2 * np.pi, abs=1e-8 * turn * speed)
    for name in ("ground1", "ground2"):
        np.testing.assert_allclose(found.joints[name].angle, found.joints["ground0"].angle, atol=1e-8)


@pytest.mark.parametrize("samples", [10, 37, 40, 400])
def test_four_bar_over_ten_seconds(samples: int, folder: Path) -> None:
    """Ten passages through singular positions, at other places within steps; the whole path where samples meet it."""
    found = solve("four-bar", folder, {"run.samples": samples, "run.frames": 10}).history
    place = found.probes["b0"].values[-1] + np.array([0.0, 1.0, 0.0])
    assert place[0] == pytest.approx(FOUR_BAR["B0_end"]["x"]["value"], abs=1e-7)
    assert place[1] == pytest.approx(FOUR_BAR["B0_end"]["y"]["value"], abs=1e-7)
    if samples % 40 == 0:
        histories = json.loads(scene_path("four-bar/M2_n_four_bar.json").read_text())["histories"]
        each = samples // 40
        np.testing.assert_allclose(found.times[each - 1 :: each], histories["t"][1:], rtol=1e-12)
        path = np.array([histories["x"], histories["y"]]).T[1:]
        own = found.probes["b0"].values[each - 1 :: each, :2] + np.array([0.0, 1.0])
        np.testing.assert_allclose(own, path, rtol=0, atol=1e-8)
    assert found.energy_drift < 1e-9


def test_bricard(folder: Path) -> None:
    """M3: 30 rows of rank 29."""
    found = solve("bricard", folder, {"run.samples": 100, "run.frames": 100}).history
    assert found.counts["rows"] == BRICARD["constraint_rows"]
    assert found.counts["rank"] == BRICARD["constraint_rank"]
    assert "30 rows of rank 29" in found.counts["linkage_notes"]
    histories = json.loads(scene_path("bricard/M3_bricard.json").read_text())["histories"]
    path = np.array([histories[f"P3{axis}"] for axis in "xyz"]).T[1:]
    np.testing.assert_allclose(found.probes["p3"].values + np.array([1.0, -1.0, 1.0]), path, rtol=0, atol=1e-8)
    assert found.energy_drift < 1e-9


def test_top(folder: Path) -> None:
    """M4: the place after 2 s, and energy and vertical angular momentum."""
    found = solve("top", folder, {"run.samples": 40, "run.frames": 2}).history
    table = {round(row["t"], 6): row["position"] for row in TOP["table"]}
    places = found.probes["centre"].values + np.array([0.0, 1.0, 0.0])
    for time, place in zip(found.times, places, strict=True):
        if round(time, 6) in table:
            np.testing.assert_allclose(place, table[round(time, 6)], rtol=0, atol=1e-9)
    assert found.energies[-1] @ [1, 1, 1, 1, -1] == pytest.approx(TOP["energy"]["value"], rel=1e-9)


def _periods(found: Trajectory, each: int) -> np.ndarray:
    """Return by how much heights differ after a period of so many samples, as times [s]."""
    height, rate = found.motion["top"][:, 2], found.motion["top"][:, 8]
    steep = np.abs(rate[:-each]) > 0.5 * np.abs(rate).max()
    return np.abs((height[each:] - height[:-each])[steep] / rate[:-each][steep])


def test_top_nutates_without_drift(folder: Path) -> None:
    """M4 over 134 nutations, 100 s and 2390 turns: the period stays that of the elliptic integral."""
    period, each, count = TOP["nutation_period"]["value"], 8, 134
    changes = {"run.duration": count * period, "run.samples": each * count, "run.frames": 2}
    found = solve("top", folder, changes).history
    assert _periods(found, each).max() < 1e-8 * period
    whole = found.energies @ [1, 1, 1, 1, -1]
    np.testing.assert_allclose(whole, TOP["energy"]["value"], rtol=1e-9)
    # The last nutation as the first: the phase has drifted by less than 1e-8 of all.
    first, last = found.motion["top"][:each, 2], found.motion["top"][-each:, 2]
    np.testing.assert_allclose(last, first, rtol=0, atol=1e-6)
