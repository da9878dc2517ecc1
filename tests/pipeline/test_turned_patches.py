"""Patches that turn: a run ends where a corner of the face is below what it meets by more than the contact gives."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.kinds import run

BLOCK = """
[component.p]
geometry = { kind = "box", lx = 0.06, ly = 0.04, lz = 0.02 }
mesh.size = 0.02
material = { E = 210e9, nu = 0.3, rho = 7850 }
interface.foot = { surface = "bottom", kind = "patch" }
interface.top = { surface = "top", kind = "patch" }
modes.normal_count = 6
"""
FALLS = (
    BLOCK
    + """
[body.p]
position = [0, 0, 1e-3]
orientation = { axis = [0, 1, 0], angle = TILT }
velocity = [0, 0, -0.5]

[run]
duration = 4e-3
window = 1e-5
checks = false
"""
)
GROUND = """
[contact.f]
body = "p"
interface = "foot"
surface_stiffness = 1e11
against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] }
"""
ANVIL = """
[component.a]
geometry = { kind = "box", lx = 0.08, ly = 0.08, lz = 0.02 }
mesh.size = 0.03
material = { E = 210e9, nu = 0.3, rho = 7850 }
interface.top = { surface = "top", kind = "patch" }
modes.normal_count = 6

[body.a]
position = [0, 0, -0.02]

[contact.f]
body = "NEAR"
interface = "NEARFACE"
surface_stiffness = 1e11
against = { shape = "body", body = "FAR", interface = "FARFACE" }
"""


def swapped(body: str, face: str, partner: str, partner_face: str) -> str:
    text = ANVIL.replace("NEARFACE", face).replace("FARFACE", partner_face)
    return text.replace("NEAR", body).replace("FAR", partner)


CONTACTS = {
    "ground": GROUND, "on a body": swapped("p", "foot", "a", "top"), "below a body": swapped("a", "top", "p", "foot"),
}  # fmt: skip


def solved(folder: Path, scene: str, **settings: Any) -> tuple[str, str]:
    """Return the result of a run and its reason with its notes."""
    (folder / "scene.toml").write_text(scene)
    report = run(folder / "scene.toml", until="solve", set=settings, db=folder / "db", out=folder / "out")
    return str(report.result), f"{report.reason} {' '.join(report.notes)}"


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("tilt", [1.0, -1.0])
def test_a_tilted_face_ends_the_run_as_its_edge_goes_below(contact: str, tilt: float, tmp_path: Path) -> None:
    """The edge touches at (1 mm − 30 mm sin 1°)/(0.5 m/s) = 0.953 ms; its middle at 2 ms."""
    result, reason = solved(tmp_path, (FALLS + CONTACTS[contact]).replace("TILT", str(tilt)))
    assert result == "FACE_TURNED"
    assert reason.startswith("contact.f: a corner of the face of 'foot' is ")
    assert 'set component.p.interface.foot.kind to "points"' in reason
    time = float(reason.split(" at ")[1].split(" s")[0])
    assert 0.95e-3 < time < 1.05e-3


def test_so_it_does_in_a_mechanism(tmp_path: Path) -> None:
    scene = (FALLS + GROUND).replace("TILT", "1.0")
    assert solved(tmp_path, scene, **{"run.integrator": "turning"})[0] == "FACE_TURNED"


def test_a_slight_tilt_is_noted_and_none_is_not(tmp_path: Path) -> None:
    """The block sinks in by v √(m/k A) = 0.5 m/s √(0.377 kg/(1e11 N/m³ · 2.4e-3 m²)) = 20 µm, and 0.02° are 10 µm."""
    scene = FALLS + GROUND
    result, text = solved(tmp_path, scene.replace("TILT", "0.02"))
    assert result == "FINISHED"
    assert "contact.f: the face of 'foot' turns" in text
    depth = float(text.split("by up to ")[1].split("%")[0]) / 100
    assert depth == pytest.approx(0.03 * np.radians(0.02) / 20e-6, rel=0.25)
    result, text = solved(tmp_path, scene.replace("TILT", "0.0"))
    assert result == "FINISHED"
    assert "turns" not in text


@pytest.mark.parametrize(("arm", "result"), [(5.0, "FACE_TURNED"), (0.2, "FINISHED")])
def test_a_load_beside_the_middle_turns_the_block_over(arm: float, result: str, tmp_path: Path) -> None:
    """On a layer with one row nothing resists the moment; 10 µN m turn it little within the run."""
    scene = (
        BLOCK.replace('kind = "patch" }\nmodes', 'kind = "tie", tie = "rbe2" }\nmodes')
        + """
[body.p]
freedom = ["z", "ry"]
damping.beta = 1e-5

[contact.f]
body = "p"
interface = "foot"
surface_stiffness = 1e10
against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] }

[force.w]
kind = "wrench"
body = "p"
interface = "top"
force = [0, 0, -1000]
moment = [0, ARM, 0]

[run]
duration = 1e-3
checks = false
"""
    )
    outcome, reason = solved(tmp_path, scene.replace("ARM", str(arm)))
    assert outcome == result, reason
