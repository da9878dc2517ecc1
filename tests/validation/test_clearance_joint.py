"""Reference case H1: a slider-crank with clearance, as the scene stands (dimensions of Flores et al.; DOP853 at 1e-12).

Its later contacts depend on the earlier ones so much that errors grow tenfold with each: all 14 reliable ones are
compared as the scene stands, twelve at the integrator's default accuracy, all 28 of a turn at a finer one.
"""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gudgeon.solver.results import contact_events
from tests.scenes import scene_path
from tests.validation.solved import solve

FILE = json.loads(scene_path("clearance-joint/H1_slider_crank_clearance.json").read_text())
EXPECTED = FILE["expected"]
RELIABLE, ALL = EXPECTED["contacts_reliable"], EXPECTED["contacts_in_first_revolution"]
"""14 contacts of 28: errors grow tenfold with each of the later ones."""


@pytest.mark.parametrize(
    ("accuracy", "count", "bound"),
    [(None, RELIABLE, 1e-5), (1e-8, 12, 1e-3), (1e-10, 10, 1e-8), (1e-10, RELIABLE, 1e-6), (1e-10, ALL, 5e-5)],
)
def test_contacts(
    accuracy: float | None, count: int, bound: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each contact's begin, end and speeds; its largest force, which is read between steps, to 2e-3."""
    monkeypatch.setattr(contact_events, "SHOWN", ALL)
    found = solve("clearance-joint", tmp_path, {} if accuracy is None else {"run.accuracy": accuracy})
    if accuracy != 1e-8:
        assert found["pin.impacts"] == ALL
    for number, contact in enumerate(EXPECTED["contacts"][:count], 1):
        for name, key in (
            ("start", "t_start"), ("end", "t_end"),
            ("approach_speed", "approach_velocity"), ("separation_speed", "separation_velocity"),
        ):  # fmt: skip
            assert found[f"pin.impact{number}.{name}"] == pytest.approx(contact[key], rel=bound), (number, name)
        assert found[f"pin.impact{number}.force_peak_raw"] == pytest.approx(contact["Fmax"], rel=2e-3)
    assert found["pin.force_peak_raw"] == pytest.approx(EXPECTED["first_contact_Fmax"]["value"], rel=1e-3)
    peak = EXPECTED["slider_acc_peak_first_contact"]["value"]
    guide = 0.14 * peak  # The journal alone accelerates the slider.
    assert found["pin.force_peak_raw"] == pytest.approx(guide, rel=0.01)
    assert found.report.energy_drift is not None
    assert found.report.energy_drift < 1e-6


def test_turned_in_space(tmp_path: Path) -> None:
    """The first contact of the same mechanism about another axis."""
    first = EXPECTED["contacts"][0]
    text = scene_path("clearance-joint/scene.toml").read_text()
    turned = tmp_path / "turned.toml"
    lines = []
    for line in text.splitlines():
        key = line.split(" = ")[0]
        if key in ("position", "velocity", "angular_velocity", "at", "axis"):
            x, y, z = json.loads(line.split(" = ")[1])
            line = f"{key} = {json.dumps([z, x, y])}"
        lines.append(line)
    turned.write_text("\n".join(lines) + "\n")
    shutil.copy(scene_path("clearance-joint/H1_slider_crank_clearance.json"), tmp_path)
    found = solve(str(turned), tmp_path, {"run.duration": 3e-4})
    for name, key in (("start", "t_start"), ("end", "t_end"), ("approach_speed", "approach_velocity")):
        assert found[f"pin.impact1.{name}"] == pytest.approx(first[key], rel=1e-8)


@pytest.mark.validation
def test_a_journal_tilts_in_a_spatial_mechanism(tmp_path: Path) -> None:
    """The slider follows that of an ideal cylindrical joint within the clearance; the journal tilts until both ends
    touch on opposite sides, 2 c/l and what they are indented; its pin rises along its leaning axis."""
    found = solve("clearance-joint/spatial.toml", tmp_path, {})
    gap, length, lean, crank, rod = 0.2e-3, 0.02, np.radians(5), 0.05, 0.12
    axis = np.array([0.0, np.sin(lean), np.cos(lean)])
    moved = {name: np.array(found.history.motion[name]) for name in ("rod", "slider")}
    angle = 2000 / 60 * 2 * np.pi * np.asarray(found.history.times)
    turned = crank * np.array([np.cos(angle), np.sin(angle), 0 * angle]).T
    across = turned - np.outer(turned @ axis, axis)
    ideal = across[:, 0] + np.sqrt(rod**2 - across[:, 1] ** 2 - across[:, 2] ** 2) - (crank + rod)
    assert np.abs(moved["slider"][:, 0] - ideal).max() < 1.3 * gap
    tilt = np.linalg.norm(np.cross(Rotation.from_rotvec(moved["rod"][:, 3:6]).apply(axis), axis), axis=1)
    assert 2 * gap / length < tilt.max() < 1.1 * 2 * gap / length
    rises = 0.5 * (turned @ axis) * axis[2]
    assert np.abs(moved["rod"][:, 2] - rises).max() < gap + 0.5 * rod * tilt.max()
    assert np.abs(rises).max() > 2e-3
    assert found.report.energy_drift is not None
    assert found.report.energy_drift < 1e-6
    assert found.report.momentum_residual is not None
    assert found.report.momentum_residual < 1e-8
