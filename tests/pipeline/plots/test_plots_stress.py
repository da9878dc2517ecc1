"""Pictures of stress and of plane parts, and the numbers that they are drawn from."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline import plots
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.exporters.export import _stress
from gudgeon.pipeline.geometry.cells import cell_blocks
from gudgeon.pipeline.interfaces.stress_recovery import von_mises
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.base.stress import READ, equivalent_stress, left_out, nodal_stress, row_forces

pytest.importorskip("matplotlib")
pytest.importorskip("pyvista")

from gudgeon.pipeline.plots.base.surface import make_skin
from gudgeon.pipeline.plots.deformation import movie
from gudgeon.pipeline.plots.deformation.script import script_of
from gudgeon.pipeline.plots.deformation.solid import values_where_known
from tests.pipeline.plots.runs import Run, assert_picture, solved

END = """
[body.part]
velocity = [1.0, 0.0, 0.0]
gauges = ["middle"]

[contact.wall]
body = "part"
interface = "head"
against = { shape = "plane", point = [0.02, 0.0, 0.0], normal = [-1.0, 0.0, 0.0] }

[run]
duration = 2e-5
integrator = "event"
samples = 60
frames = 30
"""
PART = """
[component.part]
geometry = {geometry}
material = {{ E = 2e11, nu = 0.3, rho = 7800.0 }}
mesh = {{ size = 0.01 }}
interface.head = {{ surface = "right", kind = "patch" }}
gauge.middle = {{ point = [0.0, 0.0, 0.0] }}
gauge.shown = {{ surface = "{surface}" }}
modes = {{ normal_count = 12 }}
"""
SCENES = {
    "sheet": PART.format(geometry='{ kind = "rectangle", lx = 0.04, ly = 0.02, thickness = 0.01 }', surface="skin"),
    "block": PART.format(geometry='{ kind = "box", lx = 0.04, ly = 0.02, lz = 0.02 }', surface="top"),
}
SHARED = ["force.png", "energy.png", "impacts.png", "gauges.png", "deformation.png", "stress.png", "modes.png"]
NAMES = [*SHARED, "impact.mp4"]


@pytest.fixture(scope="module", params=SCENES)
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Run:
    return solved(tmp_path_factory.mktemp(request.param), request.param, SCENES[request.param] + END)


def test_pictures(scene: Run, tmp_path: Path) -> None:
    drawn, notes = scene.render(tmp_path)
    assert notes == []
    assert [path.name for path in drawn] == NAMES
    assert set(NAMES) <= set(plots.FILES)
    for path in drawn:
        if path.suffix == ".png":
            low = scene.name == "sheet" and path.stem in ("deformation", "stress")
            assert_picture(path, (1600, 1182) if low else (1600, 1200))


def test_shown_stress_is_rows_of_coordinates_and_of_forces(scene: Run, tmp_path: Path) -> None:
    drawing = scene.drawing(tmp_path)
    body, frame = drawing.body("part"), int(np.argmax(drawing.frame_force("part")))
    values = equivalent_stress(drawing, body, frame)
    gauge = drawing.store.get(body.morph.modes_key, "modes", only=["gauges"]).gauges["shown"]
    pressed = drawing.trajectory.contacts["wall"].multipliers[frame]
    assert pressed.sum() > 0
    q = body.coordinates[frame, len(body.morph.rigid_twists) :]
    expected = von_mises((gauge.rows @ q - gauge.residual @ pressed).reshape(-1, 6))
    np.testing.assert_allclose(values[gauge.nodes], expected, rtol=1e-12)
    others = np.setdiff1d(np.arange(len(values)), gauge.nodes)
    assert np.isnan(values[others]).all()
    assert len(others) == 0 if scene.name == "sheet" else len(others) > 0


@pytest.mark.parametrize("scene", ["block"], indirect=True)
def test_a_solid_is_coloured_on_the_sides_that_are_read_alone(scene: Run, tmp_path: Path) -> None:
    body = scene.drawing(tmp_path).body("part")
    top = body.nodes[:, 2] > body.nodes[:, 2].max() - 1e-9
    height = body.nodes[:, 0]
    skin = make_skin(
        body.nodes, cell_blocks(body.mesh), 5000, {"stress": np.where(top, height, 0.0), "known": 1.0 * top}
    )
    values = values_where_known(skin)
    faces, points = skin.surface.regular_faces, skin.surface.points
    above = (points[faces][:, :, 2] > points[:, 2].max() - 1e-9).all(axis=1)
    assert 0 < above.sum() < len(above)
    np.testing.assert_allclose(values[faces[above]], points[faces[above]][:, :, 0], rtol=1e-9, atol=1e-12)
    assert np.isnan(values[faces[~above]]).all()


def gauged(drawing: Drawing, body: str) -> ModalRecord:
    return drawing.modes(body, ["gauges", *READ])


def read_and_shown(drawing: Drawing, name: str, gauge: str) -> tuple[np.ndarray, np.ndarray]:
    """Return what a gauge recorded at the samples of frames, and what its rows give there by `row_forces`, (f, k)."""
    body, trajectory, modal = drawing.body(name), drawing.trajectory, gauged(drawing, name)
    own = modal.gauges[gauge]
    shown = body.coordinates[:, len(body.morph.rigid_twists) :] @ own.rows.T
    shown = shown + row_forces(drawing, body, modal) @ own.residual.T
    samples = np.abs(trajectory.times[:, None] - trajectory.frame_times).argmin(axis=0)
    return trajectory.gauges[f"{name}.{gauge}"][samples], shown


def test_shown_and_recorded_stress_agree(scene: Run, tmp_path: Path) -> None:
    """The recorded gauge at the middle, at the time of a frame, lies within what its own rows give there."""
    drawing = scene.drawing(tmp_path)
    frame = int(np.argmax(drawing.frame_force("part")))
    recorded, shown = (one[frame] for one in read_and_shown(drawing, "part", "middle"))
    np.testing.assert_allclose(shown, recorded, atol=1e-6 * np.abs(recorded).max())


def test_forces_that_are_not_known_at_frames_are_refused(scene: Run, tmp_path: Path) -> None:
    drawing = scene.drawing(tmp_path)
    spring = {"kind": "spring", "body": "part", "interface": "head", "stiffness": 1.0, "direction": [1, 0, 0]}
    drawing.scene["force"] = {"press": spring}
    drawing.scene["run"]["integrator"] = "auto"
    with pytest.raises(StageError, match=r"does not hold force\.press on body part at frames"):
        row_forces(drawing, drawing.body("part"), gauged(drawing, "part"))
    notes: list[str] = []
    assert _stress(drawing, drawing.body("part"), notes.append) is None
    (note,) = notes
    assert note.startswith("stress of body part was not written: the trajectory does not hold force.press on body part")


TWO = """
[component.block]
geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.02 }
material = { E = 70e9, nu = 0.33, rho = 2700.0 }
mesh = { size = 0.02 }
modes = { normal_count = 8 }
interface.bottom = { surface = "bottom" }
interface.back = { surface = "left", kind = "mean" }
gauge.skin = { surface = "skin" }
gauge.middle = { point = [0.0, 0.0, 0.008] }
[component.anvil]
geometry = { kind = "box", lx = 0.03, ly = 0.03, lz = 0.02 }
material = { E = 70e9, nu = 0.33, rho = 2700.0 }
mesh = { size = 0.015 }
modes = { normal_count = 8 }
interface.top = { surface = "top" }
gauge.skin = { surface = "skin" }
gauge.middle = { point = [0.003, 0.002, 0.012] }
[body.anvil]
gauges = ["middle"]
[body.upper]
component = "block"
gauges = ["middle"]
position = [0.0, 0.0, 0.02]
orientation = { axis = [0.0, 0.0, 1.0], angle = 30.0 }
velocity = [0.0, 0.0, -0.2]
[contact.faces]
body = "upper"
interface = "bottom"
against = { shape = "body", body = "anvil", interface = "top" }
surface_stiffness = 1e12
[force.push]
kind = "force"
body = "upper"
interface = "back"
direction = [1.0, 0.3, 0.0]
values = [[0.0, 0.0], [1e-5, 300.0], [1.0, 300.0]]
[run]
duration = 3e-5
samples = 60
frames = 20
checks = false
"""
PAIRED = {
    "facets": {},
    "points": {"component.anvil.geometry.lx": 0.02, "component.anvil.geometry.ly": 0.02,
               "component.anvil.mesh.size": 0.02, "body.upper.orientation": "unset"},
}  # fmt: skip


@pytest.mark.parametrize("meets", PAIRED)
def test_stress_of_both_bodies_has_the_forces_of_their_contact_and_loads(meets: str, tmp_path: Path) -> None:
    """Points that meet facets of another mesh, and points of an equal one; a load over time on a body that turns."""
    drawing = solved(tmp_path, "two", TWO, PAIRED[meets]).drawing(tmp_path)
    pressed = drawing.trajectory.contacts["faces"].multipliers
    frame = int(pressed.sum(axis=1).argmax())
    assert pressed[frame].sum() > 100
    for name in ("anvil", "upper"):
        recorded, shown = read_and_shown(drawing, name, "middle")
        local = shown - drawing.body(name).coordinates[:, -8:] @ gauged(drawing, name).gauges["middle"].rows.T
        assert np.abs(local).max() > 1e-3 * np.abs(recorded).max()
        np.testing.assert_allclose(shown, recorded, rtol=0, atol=1e-6 * np.abs(recorded).max())
        assert np.isfinite(nodal_stress(drawing, drawing.body(name))(frame)).any()
        assert left_out(drawing, drawing.body(name)) == ""
    script = script_of(drawing)
    assert script is not None
    assert script.meets
    assert script.wall is None
    assert "obstacle" not in movie._subtitle(script)


def test_stress_under_a_traction_space_is_refused(tmp_path: Path) -> None:
    """The record has the forces of points, not those of functions."""
    changes = {
        "component.anvil.interface.top": {"surface": "top", "kind": "traction", "along": [1.0, 0.0, 0.0],
                                          "spacing": 0.01},
        "contact.faces.against.shape": "surface", "component.anvil.modes.reduction": "macneal",
    }  # fmt: skip
    drawing = solved(tmp_path, "two", TWO, changes).drawing(tmp_path)
    with pytest.raises(StageError, match="does not hold the forces of contact faces on 'top'"):
        row_forces(drawing, drawing.body("anvil"), gauged(drawing, "anvil"))
