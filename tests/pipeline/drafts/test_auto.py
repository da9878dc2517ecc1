"""`interface = "auto"`: surfaces of two bodies that face each other nearby, wherever and however they stand."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job

SCENE = """
[component.hammer]
geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.02 }
material = { E = 210e9, nu = 0.3, rho = 7800.0 }
mesh = { size = 0.01 }
modes = { normal_count = 6 }

[component.anvil]
geometry = { kind = "box", lx = 0.04, ly = 0.04, lz = 0.02 }
material = { E = 210e9, nu = 0.3, rho = 7800.0 }
mesh = { size = 0.012 }
supports = ["bottom"]
modes = { normal_count = 6 }

[body.hammer]
position = [0.004, 0.0, 0.0202]
velocity = [0.0, 0.0, -1.0]

[body.anvil]

[contact.faces]
body = "hammer"
interface = "auto"
against = { shape = "body", body = "anvil", interface = "auto" }

[run]
duration = 2e-5
checks = false
"""


def opened(folder: Path, text: str = SCENE, **sets: Any) -> Job:
    (folder / "scene.toml").write_text(text)
    changes = {key.replace("__", "."): value for key, value in sets.items()}
    job = open_job(folder, set=changes, db=folder / "db", out=folder / "out")
    assert isinstance(job, Job)
    return job


def sides(job: Job) -> dict[str, tuple[str, str]]:
    """Return the surfaces of the interfaces of each contact."""
    found = {}
    for name, contact in job.scene.contact.items():
        own = job.scene.component[job.scene.component_of(contact.body)].interface[contact.interface]
        other = job.scene.others()[name]
        facing = job.scene.component[job.scene.component_of(other.body)].interface[other.interface]
        found[name] = (own.surface, facing.surface)
    return found


def test_the_faces_that_meet_are_found_and_said(tmp_path: Path) -> None:
    job = opened(tmp_path)
    assert sides(job) == {"faces": ("bottom", "top")}
    (line,) = job.found
    assert line.startswith("contact.faces: 'bottom' of hammer (")
    assert "and 'top' of anvil (" in line
    assert "0.2 to 0.2 mm apart; within 1 mm" in line


def test_the_scene_is_that_with_named_interfaces(tmp_path: Path) -> None:
    """Same points, gaps and rows as where both are written out; the line is a note of the run."""
    job = opened(tmp_path)
    notes = run_job(job, "morph").notes
    assert any(note.startswith("contact.faces: 'bottom'") for note in notes)
    (tmp_path / "named").mkdir()
    text = SCENE.replace('interface = "auto"\nagainst', 'interface = "bottom"\nagainst').replace('"auto" }', '"top" }')
    for part, surface in (("hammer", "bottom"), ("anvil", "top")):
        interface = f'[component.{part}.interface.{surface}]\nsurface = "{surface}"'
        text = text.replace(f"[body.{part}]", f"{interface}\n\n[body.{part}]")
    named = opened(tmp_path / "named", text)
    run_job(named, "morph")
    found, other = system_of(job), system_of(named)
    np.testing.assert_array_equal(found.gap, other.gap)
    np.testing.assert_array_equal(found.rows, other.rows)


@pytest.mark.parametrize("angle", [90.0, 180.0])
def test_bodies_that_are_turned(tmp_path: Path, angle: float) -> None:
    """A hammer that lies on its side strikes with the face that is below."""
    place = {90.0: 0.0302, 180.0: 0.0402}[angle]
    turned = {"axis": [0.0, 1.0, 0.0], "angle": angle}
    job = opened(tmp_path, body__hammer__orientation=turned, body__hammer__position=[0.0, 0.0, place])
    assert sides(job) == {"faces": ("right" if angle == 90 else "top", "top")}


def test_two_pairs_of_faces_are_two_contacts(tmp_path: Path) -> None:
    """A step: the hammer stands before a wall and on a floor of one part."""
    text = SCENE.replace("position = [0.004, 0.0, 0.0202]", "position = [0.0, 0.0, 0.0202]")
    text = text.replace(
        "[contact.faces]", '[body.wall]\ncomponent = "anvil"\nposition = [0.0302, 0.0, 0.0202]\n\n[contact.faces]'
    )
    text = text.replace('body = "anvil", interface = "auto"', 'body = "wall", interface = "auto"')
    assert sides(opened(tmp_path, text)) == {"faces": ("right", "left")}


def test_one_side_may_be_named(tmp_path: Path) -> None:
    text = SCENE.replace("[body.anvil]", '[component.anvil.interface.deck]\nsurface = "top"\n\n[body.anvil]')
    text = text.replace('body = "anvil", interface = "auto"', 'body = "anvil", interface = "deck"')
    job = opened(tmp_path, text)
    assert sides(job) == {"faces": ("bottom", "top")}
    assert job.scene.others()["faces"].interface == "deck"


FAR = (
    "contact.faces.interface: no named surfaces of 'hammer' and 'anvil' face each other within 0.001 m; the nearest"
    " ones are 0.01 m apart; give within"
)
PLANE = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}


@pytest.mark.parametrize(
    ("sets", "message"),
    [
        ({"body__hammer__position": [0.0, 0.0, 0.03]}, FAR),
        ({"contact__faces__against": PLANE}, "against.shape must be 'body'"),
        ({"contact__faces__against__body": "anvl"}, "against.body: no body 'anvl', the scene has hammer, anvil"),
        ({"contact__faces__against__body": "hammer"}, "'auto' finds surfaces of two different bodies"),
        (
            {"contact__faces__interface": "sole", "contact__faces__within": 1e-3},
            "contact.faces.interface: no interface 'sole', the component has none",
        ),
    ],
)
def test_what_does_not_fit_is_one_line(tmp_path: Path, sets: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match="contact") as raised:
        opened(tmp_path, **sets)
    assert message in str(raised.value)


def test_a_larger_distance_finds_them(tmp_path: Path) -> None:
    job = opened(tmp_path, body__hammer__position=[0.0, 0.0, 0.03], contact__faces__within=0.02)
    assert sides(job) == {"faces": ("bottom", "top")}


def test_within_is_for_auto_only(tmp_path: Path) -> None:
    text = SCENE.replace('"auto"', '"face"').replace("[contact.faces]", "[contact.faces]\nwithin = 1e-3")
    with pytest.raises(InputError, match=r"within given; it is for interface 'auto' only"):
        opened(tmp_path, text)
