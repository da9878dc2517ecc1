"""Reference case H1: a slider-crank with clearance, at default settings (dimensions of Flores et al.; DOP853 at 1e-12).

Its later contacts depend on the earlier ones so much that errors grow tenfold with each; those before the first contact
that lasts are compared, then sums over a turn.
"""

import json
from pathlib import Path

import pytest

from tests.validation.scenes import DATA, solve

FILE = json.loads((DATA / "clearance-joint/H1_slider_crank_clearance.json").read_text())
EXPECTED = FILE["expected"]
RELIABLE = 10
"""Contacts that are quantities; all of them are reliable ones of the reference."""


@pytest.mark.parametrize(("accuracy", "bound"), [(None, 1e-3), (1e-10, 1e-8)])
def test_contacts(accuracy: float | None, bound: float, tmp_path: Path) -> None:
    """Each contact's begin, end and speeds; its largest force, which is read between steps, to 2e-3."""
    found = solve("clearance-joint", tmp_path, {} if accuracy is None else {"run.accuracy": accuracy})
    assert EXPECTED["contacts_reliable"] >= RELIABLE
    for number, contact in enumerate(EXPECTED["contacts"][:RELIABLE], 1):
        for name, key in (
            ("start", "t_start"), ("end", "t_end"),
            ("closing", "approach_velocity"), ("opening", "separation_velocity"),
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
    text = (DATA / "clearance-joint/scene.toml").read_text()
    turned = tmp_path / "turned.toml"
    lines = []
    for line in text.splitlines():
        key = line.split(" = ")[0]
        if key in ("position", "velocity", "angular_velocity", "at", "axis"):
            x, y, z = json.loads(line.split(" = ")[1])
            line = f"{key} = {json.dumps([z, x, y])}"
        lines.append(line)
    turned.write_text("\n".join(lines) + "\n")
    found = solve(str(turned), tmp_path, {"run.duration": 3e-4})
    for name, key in (("start", "t_start"), ("end", "t_end"), ("closing", "approach_velocity")):
        assert found[f"pin.impact1.{name}"] == pytest.approx(first[key], rel=1e-8)
