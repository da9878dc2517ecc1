"""Pictures of stress and of plane parts, and the numbers that they are drawn from."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.pipeline import plots
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.interfaces.stress_recovery import von_mises
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.base.stress import equivalent_stress, row_forces
from gudgeon.pipeline.stages.run import run_job

pytest.importorskip("matplotlib")
pytest.importorskip("pyvista")

from gudgeon.pipeline.plots.base.surface import make_skin
from gudgeon.pipeline.plots.deformation.solid import values_where_known
from tests.pipeline.plots.test_plots import assert_picture

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
NAMES = {"sheet": SHARED, "block": [*SHARED, "impact.mp4"]}


@pytest.fixture(scope="module", params=SCENES)
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path, str]:
    """Name, store and key of each scene's trajectory."""
    folder = tmp_path_factory.mktemp(request.param)
    (folder / "scene.toml").write_text(SCENES[request.param] + END)
    job = open_job(folder, db=folder / "db", out=folder / "out")
    return request.param, folder / "db", run_job(job, "solve").stages["solve"].key


def drawing_of(scene: tuple[str, Path, str], folder: Path) -> Drawing:
    return Drawing(modaldb.open(scene[1]), scene[2], scene[0], folder, folder, lambda _: None)


def test_pictures(scene: tuple[str, Path, str], tmp_path: Path) -> None:
    drawn, notes = plots.render(scene[1], scene[2], tmp_path, scene[0])
    assert notes == []
    assert [path.name for path in drawn] == NAMES[scene[0]]
    assert set(NAMES[scene[0]]) <= set(plots.FILES)
    for path in drawn:
        if path.suffix == ".png":
            low = scene[0] == "sheet" and path.stem in ("deformation", "stress")
            assert_picture(path, (1600, 1182) if low else (1600, 1200))


def test_shown_stress_is_rows_of_coordinates_and_of_forces(scene: tuple[str, Path, str], tmp_path: Path) -> None:
    drawing = drawing_of(scene, tmp_path)
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
    assert len(others) == 0 if scene[0] == "sheet" else len(others) > 0


@pytest.mark.parametrize("scene", ["block"], indirect=True)
def test_a_solid_is_coloured_on_the_sides_that_are_read_alone(scene: tuple[str, Path, str], tmp_path: Path) -> None:
    body = drawing_of(scene, tmp_path).body("part")
    top = body.nodes[:, 2] > body.nodes[:, 2].max() - 1e-9
    height = body.nodes[:, 0]
    skin = make_skin(body.nodes, body.mesh.cells, 5000, {"stress": np.where(top, height, 0.0), "known": 1.0 * top})
    values = values_where_known(skin)
    faces, points = skin.surface.regular_faces, skin.surface.points
    above = (points[faces][:, :, 2] > points[:, 2].max() - 1e-9).all(axis=1)
    assert 0 < above.sum() < len(above)
    np.testing.assert_allclose(values[faces[above]], points[faces[above]][:, :, 0], rtol=1e-9, atol=1e-12)
    assert np.isnan(values[faces[~above]]).all()


def test_shown_and_recorded_stress_agree(scene: tuple[str, Path, str], tmp_path: Path) -> None:
    """The recorded gauge at the middle, at the time of a frame, lies within what its own rows give there."""
    drawing = drawing_of(scene, tmp_path)
    body, trajectory = drawing.body("part"), drawing.trajectory
    modal = drawing.store.get(body.morph.modes_key, "modes", only=["gauges", "interface_rows"])
    frame = int(np.argmax(drawing.frame_force("part")))
    forces = row_forces(drawing, body, modal, frame)
    gauge = modal.gauges["middle"]
    value = gauge.rows @ body.coordinates[frame, len(body.morph.rigid_twists) :] + gauge.residual @ forces
    sample = int(np.abs(trajectory.times - trajectory.frame_times[frame]).argmin())
    recorded = trajectory.gauges["part.middle"][sample]
    np.testing.assert_allclose(value, recorded, atol=1e-6 * np.abs(recorded).max())


def test_forces_that_are_not_known_row_by_row_are_refused(
    scene: tuple[str, Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawing = drawing_of(scene, tmp_path)
    body = drawing.body("part")
    modal = drawing.store.get(body.morph.modes_key, "modes", only=["gauges", "interface_rows"])
    drawing.scene["contact"]["wall"]["against"] |= {"body": "part", "interface": "face"}
    object.__setattr__(drawing.trajectory.contacts["wall"], "body", "other")
    modal.interface_rows["face"] = [1, 3]
    with pytest.raises(StageError, match="the points of contact wall press on several rows of 'face' in another order"):
        row_forces(drawing, body, modal, 0)
    drawing.scene["force"] = {"press": {"kind": "moving", "body": "part"}}
    with pytest.raises(StageError, match="the trajectory does not hold force press on body part at frames"):
        row_forces(drawing, body, modal, 0)
