"""Notes on runs that end within an impact, on windows of forces, on fast impacts, and on short modes of beams."""

import json
from pathlib import Path
from typing import Any

import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import run
from tests.scenes import scene_path

CLOSED = "is closed at the end of the run: its impulse and rebound are not those of a whole impact"
FEW = {"component.rod.modes.normal_count": 10}
BALL = """
[component.ball]
geometry = { kind = "rigid", mass = 0.2, points = { foot = { at = [0.0, 0.0, 0.0], normal = [0.0, 0.0, -1.0] } } }
interface.foot = { surface = "foot" }

[body.ball]
position = [0.0, 0.0, 1e-3]
velocity = [0.0, 0.0, -0.1]

[contact.floor]
body = "ball"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
method = "penalty"
law = { kind = "linear", stiffness = 1e5 }

[run]
duration = 0.05
gravity = [0.0, 0.0, -9.81]
"""
"""The impact lasts π (m/k)^½ = 4.4 ms from 7.4 ms on."""
BLOCK = """
component.part.geometry = { kind = "box", lx = 0.06, ly = 0.04, lz = 0.02 }
component.part.mesh.size = 0.012
component.part.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.part.interface.foot.surface = "bottom"
body.part = { position = [0, 0, 1e-4], velocity = [0, 0, -0.5] }
contact.floor.against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] }
contact.floor.body = "part"
contact.floor.interface = "foot"
contact.floor.surface_stiffness = 1e12
run = { duration = 3e-4, checks = false }
"""
BEAM = """
[component.beam]
geometry = { kind = "beam", length = 0.5, section = { kind = "rectangle", width = 0.02, height = 0.0198 } }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.005 }
supports = ["left"]
interface.tip = { surface = "right-bottom" }
modes = { normal_count = 10 }

[body.beam]

[contact.floor]
body = "beam"
interface = "tip"
against = { shape = "plane", point = [0.0, 0.0, -0.01], normal = [0.0, 0.0, 1.0] }

[run]
duration = 1e-3
"""


def notes(scene: str, folder: Path, **changes: Any) -> str:
    if scene.startswith("\n"):
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "scene.toml"
        path.write_text(scene)
    else:
        path = scene_path(scene)
    found = run(path, set=changes, db=folder / "db", out=folder / "out", until="solve")
    assert found.result == "FINISHED"
    return "\n".join(found.notes)


def run_block(folder: Path, **changes: Any) -> Any:
    folder.mkdir(parents=True)
    (folder / "scene.toml").write_text(BLOCK)
    return run(folder / "scene.toml", set=changes, db=folder / "db", out=folder / "out", until="solve")


def force(found: Any, name: str) -> float:
    return float(found.quantities[f"floor.{name}"]["value"])


def test_a_run_that_ends_within_an_impact_gets_a_note(tmp_path: Path) -> None:
    """The impact of the rod takes 2 L/c = 0.39 ms, after a gap."""
    few = FEW | {"run.integrator": "small"}
    assert f"contact.wall {CLOSED}" in notes("rod-wall", tmp_path / "short", **few, **{"run.duration": 3e-4})
    assert CLOSED not in notes("rod-wall", tmp_path / "whole", **few)


def test_an_impact_under_gravity_is_cut_but_a_resting_body_is_not(tmp_path: Path) -> None:
    assert f"contact.floor {CLOSED}" in notes(BALL, tmp_path / "cut", **{"run.duration": 9e-3})
    assert CLOSED not in notes(BALL, tmp_path / "whole", **{"run.duration": 0.04})
    law = {"kind": "linear", "stiffness": 1e5, "damping": 300.0}
    settled = notes(BALL, tmp_path / "settled", **{"contact.floor.law": law, "run.duration": 0.1})
    assert CLOSED not in settled


def test_an_impact_of_a_loaded_body_is_cut_while_it_is_young(tmp_path: Path) -> None:
    """A force of 10 N presses the ball on; with damping it settles."""
    wrench = {"force.push": {"kind": "wrench", "body": "ball", "at": [0.0, 0.0, 0.0], "force": [0.0, 0.0, -10.0]}}
    cut = notes(BALL, tmp_path / "cut", **wrench, **{"run.duration": 5e-3})
    assert f"contact.floor {CLOSED}, which began at 0.004" in cut
    law = {"kind": "linear", "stiffness": 1e5, "damping": 300.0}
    settled = notes(BALL, tmp_path / "settled", **wrench, **{"contact.floor.law": law, "run.duration": 0.1})
    assert CLOSED not in settled


def test_contacts_that_rest_or_are_driven_get_none(tmp_path: Path) -> None:
    for scene in ("rigid/incline-sticks.toml", "rigid/scene.toml", "extreme/e0.toml"):
        found = notes(scene, tmp_path / scene)
        assert CLOSED not in found


def test_a_window_below_the_step_gets_a_note(tmp_path: Path) -> None:
    given = FEW | {"run.integrator": "small", "run.step": 5e-7}
    words = "is below the step, 5e-07 s, over which forces are known as means; set run.window longer, or run.step"
    assert words in notes("rod-wall", tmp_path / "short", **given, **{"run.window": 1e-7})
    assert words not in notes("rod-wall", tmp_path / "long", **given, **{"run.window": 1e-5})


def test_the_window_of_a_force_follows_the_impact(tmp_path: Path) -> None:
    """A block on its contact layer: a half sine of π (m/k)^½ = 39 µs, its peak v (k m)^½ = 15 kN; README's scene."""
    found = run_block(tmp_path / "default", **{"run.checks": True})
    lasts = found.quantities["floor.duration"]["value"]
    window = found.quantities["floor.force_window"]["value"]
    assert window == pytest.approx(0.1 * lasts, rel=0.02)  # Of the first run, with twice the step.
    assert force(found, "force_peak") == pytest.approx(force(found, "force_peak_raw"), rel=0.02)
    (note,) = [note for note in found.notes if "its hardest impact lasts" in note]
    peak = force(found, "force_peak")
    assert note.startswith(f"contact.floor: force_peak, {peak:.4g} N, is the mean over {window:.3g} s, taken twice")
    resolved = force(found, "force_resolved")
    assert f"which resolve {resolved:.4g} N, over 2.72e-05 s." in note
    assert resolved < 0.7 * force(found, "force_peak")
    given = run_block(tmp_path / "given", **{"run.window": window, "run.checks": True})
    assert not any("its hardest impact lasts" in note for note in given.notes)
    assert force(given, "force_peak") == pytest.approx(force(found, "force_peak"), rel=1e-6)
    for name in ("layer.force", "basis.force", "step.force"):
        assert found.estimates[name] == pytest.approx(given.estimates[name], rel=0.01), name
    wide = run_block(tmp_path / "wide", **{"run.window": found.quantities["floor.resolved_window"]["value"]})
    assert resolved == pytest.approx(force(wide, "force_peak"), rel=1e-3)
    modes = {"component.rod.modes.normal_count": 30}
    assert "its hardest impact lasts" not in notes("rod-wall", tmp_path / "longer", **modes)


def test_a_window_for_jumps_of_velocity_gets_a_note(tmp_path: Path) -> None:
    given = {"contact.floor.method": "impact", "contact.floor.restitution": 0.5, "contact.floor.law": "unset"}
    words = "contact.floor: its impacts are jumps of velocity, so that force_peak is their impulse over run.window"
    assert words in notes(BALL, tmp_path / "given", **given, **{"run.window": 1e-6})
    assert words not in notes(BALL, tmp_path / "none", **given)


def test_a_window_of_round_off_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="window 1e-24 s is below 1e-12 of the duration") as refused:
        notes("rod-wall", tmp_path, **{"run.window": 1e-24})
    assert "\n" not in str(refused.value).strip()


def test_an_impact_near_the_wave_speed_gets_a_note(tmp_path: Path) -> None:
    """Bars of steel: c = 5172 m/s. The limit of the deformation ends such a run unless it is raised."""
    given = FEW | {"run.integrator": "small", "run.duration": 6e-4, "run.limits.angle": 10.0}
    words = "times the wave speed of component.rod,"
    found = notes("rod-wall", tmp_path / "fast", **given, **{"body.rod.velocity": [800.0, 0.0, 0.0]})
    assert words in found
    assert "strains of this size are outside the linear model" in found
    assert words not in notes("rod-wall", tmp_path / "slow", **given)


def test_pictures_of_an_earlier_result_that_are_removed_are_named(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(BALL)
    places = {"db": tmp_path / "db", "out": tmp_path / "out"}
    drawn = run(scene, **places, until="plot").pictures
    assert not [note for note in run(scene, **places, until="solve").notes if "pictures" in note]
    (note,) = run(scene, set={"body.ball.velocity": [0.0, 0.0, -0.2]}, **places, until="solve").notes
    assert note.startswith("pictures of an earlier result were removed: ")
    assert all(Path(name).name in note for name in drawn)


def test_short_modes_of_a_beam_without_shear_get_a_note(tmp_path: Path) -> None:
    """A cantilever of 25.3 heights: mode n has (n − ½) half-waves, shorter than 2 heights from 14 on."""
    height = 0.0198
    general = {"kind": "general", "area": 0.02 * height, "second_moment": 0.02 * height**3 / 12, "height": height}
    beam = BEAM.replace('{ kind = "rectangle", width = 0.02, height = 0.0198 }', toml(general))
    assert "half-waves" not in notes(beam, tmp_path / "few")
    many = {"component.beam.modes.normal_count": 20}
    found = notes(beam, tmp_path / "many", **many)
    assert "component.beam.geometry.section: 7 of 20 modes have half-waves below 2 times the height of the" in found
    assert "the shortest 1.3 times it; without shear_coefficient they have no shear, and" in found
    assert "too high, up to about 1.7 times; set component.beam.geometry.section.shear_coefficient or" in found
    assert "or component.beam.modes.normal_count = 13" in found
    assert "half-waves" not in notes(BEAM, tmp_path / "sheared", **many)
    euler = {"component.beam.geometry.theory": "euler-bernoulli"}
    assert "half-waves" not in notes(BEAM, tmp_path / "named", **many, **euler), "a theory that is named is meant"


def toml(table: dict[str, Any]) -> str:
    """Return an inline table."""
    return "{ " + ", ".join(f"{key} = {json.dumps(value)}" for key, value in table.items()) + " }"


def test_a_restitution_that_an_elastic_bar_does_not_deliver_is_said(tmp_path: Path) -> None:
    """Its end rebounds with 0.5 at each impact of its own, the bar as a whole almost elastically."""
    (tmp_path / "scene.toml").write_text("""
component.b.geometry = { kind = "bar", length = 1.0, area = 1e-4 }
component.b.mesh.size = 0.05
component.b.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.b.interface.r = { surface = "right" }
component.b.modes = { normal_count = 8 }
body.b = { velocity = [1, 0, 0] }
contact.w.against = { shape = "plane", point = [1.0001, 0, 0], normal = [-1, 0, 0] }
contact.w.body = "b"
contact.w.interface = "r"
contact.w.method = "impact"
contact.w.restitution = 0.5
run = { duration = 2e-3, checks = false }
""")
    report = run(tmp_path, until="solve", db=tmp_path / "db", out=tmp_path / "out")
    (note,) = [n for n in report.notes if "contact.w.restitution: 0.5 is given for its points" in n]
    delivered = float(note.partition("rebound with ")[2].partition(":")[0])
    assert delivered > 0.6
