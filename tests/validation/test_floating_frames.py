"""Reference cases M5 to M7: bodies that deform while they turn, at default settings.

Rotating cantilever (Wright et al. 1982; Hodges & Rutkowski 1981), slider-crank with an elastic rod (Jonker 1989),
spin-up of a cantilever (Simo & Vu-Quoc 1986). Values in M*.json beside the scenes, computed without this product.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from tests.scenes import reference, scene_path
from tests.validation.crank_rod import deflections
from tests.validation.rotating_beam import frequencies
from tests.validation.solved import solve

ROTATING = reference("rotating-beam/M5_rotating_beam.json")
SPIN_UP = reference("spin-up/M7_spin_up.json")
CRANK = json.loads(scene_path("elastic-slider-crank/M6_slider_crank_rod.json").read_text())["histories"]
TURN = 100
"""Samples of one turn of the crank."""


@pytest.mark.validation
@pytest.mark.parametrize(("plane", "axis"), [("out_of_plane", "z"), ("in_plane", "y")])
def test_rotating_cantilever(plane: str, axis: str, tmp_path: Path) -> None:
    """M5: frequencies of small vibrations about the steady rotation."""
    for row in ROTATING["table"]:
        found = frequencies(tmp_path, row["gamma"], axis)
        np.testing.assert_allclose(found, row[plane], rtol=1e-3)


def test_without_geometric_stiffness_rotation_softens(tmp_path: Path) -> None:
    """λ² = λ₀² − γ² in the plane of rotation, as M5 says of a linear floating frame."""
    found = frequencies(tmp_path, 2.0, "y", geometric=False)
    assert found[0] == pytest.approx(np.sqrt(ROTATING["lambda_at_rest"][0] ** 2 - 4.0), rel=1e-3)


def slider_crank(folder: Path, samples: int, **changes: Any) -> np.ndarray:
    """Return the deflection of the rod's middle from its chord over its length at the first samples, (samples,)."""
    duration = 4 * 2 * np.pi / 150 * samples / 400
    keys = {"run.duration": duration, "run.samples": samples, "run.frames": 2}
    return deflection(solve("elastic-slider-crank", folder, keys | changes).history)


def deflection(found: Trajectory) -> np.ndarray:
    """Return the distance of the rod's middle from the chord between its pins over its length, (s,)."""
    places = {name: found.probes[name].values + np.array([x, 0.0, 0.0]) for name, x in (("big", 0.15), ("small", 0.45))}
    middle = found.probes["middle"].values + np.array([0.3, 0.0, 0.0]) - places["big"]
    chord = places["small"] - places["big"]
    chord /= np.linalg.norm(chord, axis=1)[:, None]
    return (chord[:, 0] * middle[:, 2] - chord[:, 2] * middle[:, 0]) / 0.3


def apart(found: np.ndarray, row: str) -> float:
    """Return the root mean square difference to a row of M6 over the row's maximum in the same time."""
    wanted = np.array(CRANK[row])[1 : len(found) + 1]
    return float(np.sqrt(np.mean((found - wanted) ** 2)) / np.abs(wanted).max())


@pytest.mark.validation
def test_linear_floating_frame_of_a_slider_crank(tmp_path: Path) -> None:
    """M6: the linear row over its four turns; its frame keeps no stretch of the rod, which ours does, 5e-4 by the
    reference's own check."""
    found = slider_crank(tmp_path, 4 * TURN, **{"body.rod.geometric_stiffness": False})
    assert len(found) == len(CRANK["linear"]) - 1
    assert apart(found[:TURN], "linear") < 5e-4
    assert apart(found, "linear") < 1e-3


@pytest.mark.validation
def test_geometric_stiffness_of_a_slider_crank(tmp_path: Path) -> None:
    """M6: with the second order of displacements the motion is that of the nonlinear beam, far within 3 %."""
    found = slider_crank(tmp_path, 2 * TURN)
    assert apart(found, "nonlinear") < 5e-3
    # The geometric row has the force of the rigid motion and no shortening; over two turns it is 3 % from nonlinear.
    assert apart(found, "geometric") < 4e-2


@pytest.mark.parametrize(("row", "stiffened"), [("linear", False), ("geometric", True)])
def test_what_the_rows_of_a_slider_crank_leave_out(row: str, stiffened: bool) -> None:
    """M6: both rows are those of bending beside a chord that neither stretches nor shortens, to 1e-4.

    By this the geometric one differs by 3.3 % from the nonlinear beam, and as much from the product.
    """
    times = np.arange(1, 2 * TURN + 1) * 4 * 2 * np.pi / 150 / 400
    assert apart(deflections(times, stiffened=stiffened), row) < 1e-4
    two_turns = np.array(CRANK["nonlinear"])[1 : 2 * TURN + 1]
    assert 0.032 < apart(two_turns, "geometric") < 0.034


@pytest.mark.validation
def test_spin_up(tmp_path: Path) -> None:
    """M7: largest lag of the tip, its shortening there, and the stretch at full speed."""
    found = solve("spin-up", tmp_path, {"run.frames": 2}).history
    angle = found.joints["axle"].angle
    place = found.probes["tip"].values + np.array([10.0, 0.0, 0.0])
    stretch = np.cos(angle) * place[:, 0] + np.sin(angle) * place[:, 2] - 10.0
    lag = np.cos(angle) * place[:, 2] - np.sin(angle) * place[:, 0]
    most = int(lag.argmin())
    assert lag[most] == pytest.approx(SPIN_UP["largest_lag_of_tip"]["value"], rel=1e-2)
    assert stretch[most] == pytest.approx(SPIN_UP["shortening_at_largest_lag"]["value"], rel=3e-2)
    steady = stretch[found.times >= 16.0].mean()
    assert steady == pytest.approx(SPIN_UP["steady_tip_stretch"]["value"], rel=1e-2)
