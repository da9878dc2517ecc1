"""The pictures of a piston driven in its liner: their names, what they compare, and what they are made of."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline import plots
from gudgeon.pipeline.geometry.cells import cell_blocks
from gudgeon.pipeline.plots.base.run import Drawing
from tests.pipeline.plots.runs import Run, assert_picture, fake_child, solved, triangles_of, volume_of

pytest.importorskip("matplotlib")
pytest.importorskip("pyvista")
imageio = pytest.importorskip("imageio.v3")

from matplotlib.figure import Figure  # noqa: E402

from gudgeon.pipeline.plots.base.hardest import hardest  # noqa: E402
from gudgeon.pipeline.plots.base.surface import Cut, make_skin  # noqa: E402
from gudgeon.pipeline.plots.contact.curves import across_energy, balance  # noqa: E402
from gudgeon.pipeline.plots.contact.drive import crank_axis, cycles, drive_of, frame_degrees, shown_angle  # noqa: E402
from gudgeon.pipeline.plots.contact.force_axes import windowed_force  # noqa: E402
from gudgeon.pipeline.plots.driven.assembly import assemble  # noqa: E402

PISTON = Path(__file__).resolve().parents[3] / "data" / "piston" / "coarse.toml"
COARSER = {
    "component.piston.mesh.size": 0.02,
    "component.liner.mesh.size": 0.03,
    "component.piston.modes.normal_count": 4,
    "component.piston.modes.static_count": 2,
    "component.liner.modes.normal_count": 4,
    "component.liner.modes.static_count": 2,
    "component.liner.interface.thrust.spacing": 0.02,
    "component.liner.interface.anti.spacing": 0.02,
    "joint.rod.start": 700.0,
    "run.duration": 2e-3,
    "run.step": 2e-6,
    "run.samples": 200,
    "run.frames": 8,
}
FLAT = ["force.png", "energy.png", "pressure.png", "cycle.png", "pressure.mp4"]
ROUND_OFF = 1e-9
"""Relative: sums and interpolations of a few hundred numbers."""
CHORDS = 0.03
"""Relative: a mesh with curved edges of 3 cm against the exact volume of a thin tube."""


@pytest.fixture(scope="module")
def piston(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A small piston around its firing dead centre."""
    return solved(tmp_path_factory.mktemp("piston"), "piston", PISTON, COARSER)


@pytest.fixture
def drawing(piston: Run, tmp_path: Path) -> Drawing:
    return piston.drawing(tmp_path)


def test_pictures_of_a_piston(piston: Run, tmp_path: Path) -> None:
    drawn, notes = piston.render(tmp_path)
    assert notes == []
    assert [path.name for path in drawn] == [
        *FLAT,
        "deformation.png",
        "modes-piston.png",
        "modes-liner.png",
        "cycle.mp4",
    ]
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in drawn}
    for path in drawn:
        if path.suffix == ".png":
            assert_picture(path)
    movie = imageio.imread(drawn[-1])
    assert 8 <= len(movie) <= 10
    assert movie.shape[1:] == (720, 1280, 3)
    change = np.abs(np.diff(movie[:, 84:640, 150:550].astype(float), axis=0)).max(axis=(1, 2, 3))
    assert (change > 50).all()


def test_crash_of_rendering_spares_the_curves(piston: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake_child(tmp_path, monkeypatch, "os.kill(os.getpid(), signal.SIGSEGV)")
    drawn, notes = plots.render(piston.store, piston.key, tmp_path / "out", "piston")
    assert [path.name for path in drawn] == FLAT
    assert len(notes) == 1
    assert "rendering crashed (SIGSEGV)" in notes[0]


def test_compared_runs_are_in_the_cycle(
    piston: Run, tmp_path: Path, drawing: Drawing, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake_child(tmp_path, monkeypatch, "")
    trajectory = drawing.trajectory
    halved = {name: replace(one, force=one.force / 2) for name, one in trajectory.contacts.items()}
    provenance = drawing.store.provenance(piston.key) | {"changed": True}
    other = content_key(provenance)
    drawing.store.put(other, "trajectory", replace(trajectory, contacts=halved), provenance)
    compare = {"as designed": piston.key, "half": other}
    runs = cycles(replace(drawing, compare=compare))
    assert [run.label for run in runs] == ["as designed", "half"]
    np.testing.assert_allclose(runs[1].side_force, runs[0].side_force / 2, rtol=ROUND_OFF)
    pictures = {}
    for folder, runs_of in (("alone", {}), ("both", compare)):
        piston.render(tmp_path / folder, compare=runs_of)
        pictures[folder] = imageio.imread(tmp_path / folder / "cycle.png")
        assert_picture(tmp_path / folder / "cycle.png")
    # Only the second run is drawn in orange, which nothing else in the picture has.
    orange = [
        (np.abs(image[..., :3] - np.array([224.0, 122, 16])).max(axis=2) < 40).sum() for image in pictures.values()
    ]
    assert orange[0] == 0 < 300 < orange[1]


def test_sides_of_the_cycle(drawing: Drawing) -> None:
    run = cycles(drawing)[0]
    np.testing.assert_allclose(run.drive.right, [1, 0, 0])
    np.testing.assert_allclose(run.drive.axis, [0, 1, 0])
    assert run.drive.cycle == 720.0
    assert run.sides["thrust"].sum() > 0 > run.sides["anti"].sum()
    force, _ = windowed_force(drawing.trajectory, "thrust")
    assert run.sides["thrust"].sum() == pytest.approx(np.linalg.norm(force.sum(axis=0)), rel=0.01)
    assert frame_degrees(drawing, run.drive)[-1] == pytest.approx(736, rel=ROUND_OFF)


@pytest.mark.parametrize(("degrees", "text"), [(-12.6, "−13"), (-0.3, "0"), (360, "360"), (719.6, "720"), (750, "750")])
def test_texts_name_the_angles_of_the_axis(degrees: float, text: str) -> None:
    assert shown_angle(degrees, 0) == text
    axes = Figure().subplots()
    crank_axis(axes, degrees - 40, degrees + 40)
    assert axes.xaxis.get_major_formatter()(degrees) == text


def test_all_pictures_show_the_largest_force(drawing: Drawing) -> None:
    trajectory = drawing.trajectory
    assert len(trajectory.frame_times) > 8
    assert (np.diff(trajectory.frame_times) > 0).all()
    for name, contact in trajectory.contacts.items():
        if not contact.force.any():
            continue
        most = hardest(trajectory, [name])
        assert most is not None
        peak, when, window = (
            trajectory.quantities[f"{name}.{key}"]["value"] for key in ("force_peak", "peak_time", "force_window")
        )
        assert (most.contact, most.force) == (name, peak)
        assert abs(most.time - when) <= window
        assert trajectory.frame_times[most.frame] == pytest.approx(most.time, rel=1e-12)
        # The state presses as hard as within its window, at most as ever.
        raw = trajectory.quantities[f"{name}.force_peak_raw"]["value"]
        assert (
            0.9 * most.force < contact.multipliers[most.frame].sum() < 1.05 * raw
        )  # Points press in slightly different directions.


def test_rigid_motion_is_what_the_scene_leaves(drawing: Drawing) -> None:
    body, trajectory = drawing.body("piston"), drawing.trajectory
    assert body.morph.rigid_twists.shape == (3, 6)
    assert drawing.body("liner").morph.rigid_twists.shape == (0, 6)
    for frame, time in enumerate(trajectory.frame_times):
        sample = int(np.argmin(np.abs(trajectory.times - time)))
        np.testing.assert_allclose(body.twist(frame), trajectory.motion["piston"][sample, :6], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(body.total(3), body.rigid(3) + body.elastic(3), rtol=0, atol=1e-15)


def test_gaps_are_magnified_like_the_motion(drawing: Drawing) -> None:
    frame = int(np.abs(drawing.trajectory.frame_times - 7.5e-4).argmin())
    assembly = assemble(drawing, 5000, [frame])
    assert assembly is not None
    part = assembly.parts["piston"]
    assert assembly.scale > 2
    true = part.body.nodes[:, :2]
    # Between nodes the skin goes along with them: chords of facets have wider gaps than it is drawn with.
    at_node = cKDTree(drawing.body("piston").nodes).query(part.body.nodes)[0] < 1e-9
    skirt = at_node & (np.hypot(*true.T) > 0.0428)
    assert skirt.sum() > 20
    gap = 0.043 - np.hypot(*true[skirt].T)
    drawn = 0.043 - np.hypot(*part.still[skirt][:, :2].T)
    np.testing.assert_allclose(drawn, assembly.scale * gap, rtol=ROUND_OFF, atol=1e-12)
    # No point is turned inside out, and the liner stays where it is.
    assert (np.einsum("ni,ni->n", part.still[:, :2], true) >= 0).all()
    np.testing.assert_array_equal(assembly.parts["liner"].still, assembly.parts["liner"].body.nodes)
    assert assembly.parts["liner"].body.nodes[:, 1].max() > 0.04


def test_driven_motion_is_not_magnified(drawing: Drawing) -> None:
    assembly = assemble(drawing, 5000, [0, 7])
    assert assembly is not None
    part, along = assembly.parts["piston"], assembly.drive.along
    heights = [(part.moved(frame, along, assembly.scale)[0] @ along).mean() for frame in (0, 7)]
    travel = [part.body.twist(frame)[2] for frame in (0, 7)]
    elastic = [(part.body.elastic(frame) @ along).mean() * assembly.scale for frame in (0, 7)]
    tilted = [
        assembly.scale * ((part.body.rigid(frame) @ along).mean() - part.body.twist(frame)[2]) for frame in (0, 7)
    ]
    expected = travel[1] - travel[0] + elastic[1] - elastic[0] + tilted[1] - tilted[0]
    assert heights[1] - heights[0] == pytest.approx(expected, rel=1e-6)


def test_energy_of_a_free_drop_across(drawing: Drawing) -> None:
    trajectory = drawing.trajectory
    motion = np.zeros_like(trajectory.motion["piston"])
    motion[:, 6], motion[:, 8], motion[:, 10] = 2.0, 100.0, 3.0
    morph = drawing.body("piston").morph
    found = across_energy(drawing, motion, drive_of(drawing))
    np.testing.assert_allclose(found, 0.5 * morph.mass * 4 + 0.5 * morph.inertia[1, 1] * 9, rtol=ROUND_OFF)
    total = balance(trajectory.energies)
    assert np.ptp(total) < 0.01 * np.ptp(trajectory.energies[:, 4])


def test_cut_body_is_closed(skirt_mesh: MeshRecord) -> None:
    nodes, blocks, keep = skirt_mesh.nodes, cell_blocks(skirt_mesh), np.array([0.0, 1.0, 0.0])
    linear = {"linear": nodes @ np.array([1.0, 2.0, 3.0])}
    whole = make_skin(nodes, blocks, 20_000, {})
    half = make_skin(nodes, blocks, 20_000, linear, Cut(np.zeros(3), keep))
    points = half.points
    np.testing.assert_allclose(half.take("linear"), points @ np.array([1.0, 2.0, 3.0]), rtol=ROUND_OFF, atol=1e-12)
    assert points[:, 1].min() > -1e-9
    volume = volume_of(half.surface)
    assert volume == pytest.approx(volume_of(whole.surface) / 2, rel=CHORDS)
    a, b, c = triangles_of(half.surface)
    face = np.abs(np.array([a, b, c])[..., 1]).max(axis=0) < 1e-8
    normal = np.cross(b - a, c - a)[face, 1]
    assert normal.max() < 1e-6 * -normal.min()
    assert -normal.sum() / 2 == pytest.approx(2 * 0.052 * 0.004 + 2 * 0.04296 * 0.008, rel=CHORDS)
    lengths = np.linalg.norm(np.diff(half.edges.points[half.edges.lines.reshape(-1, 3)[:, 1:]], axis=1)[:, 0], axis=1)
    assert lengths.max() < 0.02
    # A shifted origin changes the signed volume of a surface that is not closed.
    half.surface.points += np.array([0.1, 0.2, 0.3])
    assert volume_of(half.surface) == pytest.approx(volume, rel=CHORDS)
