"""The pictures of a small skirt and a small rod, and what is left when drawing them goes wrong."""

import os
import signal
import subprocess
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline import plots
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.geometry.cells import cell_blocks
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.force_window import hann_filter, resample_mean
from tests.pipeline.plots.runs import Run, assert_picture, fake_child, solved, triangles_of, volume_of
from tests.pipeline.small import block_on_floor, rod_scene, write_scene

pytest.importorskip("matplotlib")
pytest.importorskip("pyvista")
imageio = pytest.importorskip("imageio.v3")

from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: E402

from gudgeon.pipeline.plots.base import style  # noqa: E402
from gudgeon.pipeline.plots.base.surface import SHARP, Cut, make_skin  # noqa: E402
from gudgeon.pipeline.plots.contact.curves import draw_energy, draw_force  # noqa: E402
from gudgeon.pipeline.plots.deformation import movie  # noqa: E402
from gudgeon.pipeline.plots.deformation.modes import lowest  # noqa: E402
from gudgeon.pipeline.plots.deformation.script import script_of  # noqa: E402
from gudgeon.pipeline.studies.picture import _write_ticks  # noqa: E402

ROUND_OFF = 1e-12
"""Relative: sums of a few hundred numbers."""
MOVIE = {"flat": {}, "rendered": {"movie": plots.PLOTS["rendered"]["movie"]}}
SLIVER = 1e-3
"""Of the mean area of triangles: smaller ones are not looked at."""


@pytest.fixture(scope="module")
def skirt(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("skirt")
    return solved(folder, "skirt", write_scene(folder / "skirt"))


@pytest.fixture(scope="module")
def rod(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return solved(tmp_path_factory.mktemp("rod"), "rod", rod_scene(0.02, 20, 400, 30))


def test_pictures_of_a_skirt(skirt: Run, tmp_path: Path) -> None:
    drawn, notes = skirt.render(tmp_path)
    assert notes == []
    flat = ["force.png", "energy.png", "impacts.png", "pressure.png", "pressure.mp4"]
    names = [*flat, "deformation.png", "modes.png", "impact.mp4"]
    assert [path.name for path in drawn] == names
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    for path in drawn:
        if path.suffix == ".png":
            assert_picture(path)
    film = imageio.imread(drawn[4])
    assert film.shape[1:] == (1200, 1600, 3)
    assert np.ptp(film.astype(int), axis=0).max() > 100
    movie = imageio.imread(drawn[-1])
    assert movie.shape[1:] == (720, 960, 3)
    assert len(movie) == 42  # Two for each frame of the run.
    # The part above the force curve moves from each fourth frame to the next.
    change = np.abs(np.diff(movie[::4, 80:548, 8:776].astype(float), axis=0)).max(axis=(1, 2, 3))
    assert (change > 50).all()
    assert drawn[-1].stat().st_size < 1.5e6


def test_pictures_of_a_rod(rod: Run, tmp_path: Path) -> None:
    drawn, notes = rod.render(tmp_path)
    assert notes == []
    names = ["force.png", "energy.png", "impacts.png", "deformation.png", "modes.png", "impact.mp4"]
    assert [path.name for path in drawn] == names
    for path in drawn[:-1]:
        assert_picture(path)


DROP = {
    "component.block.mesh.size": 0.02, "body.block.position": [0.0, 0.0, 1e-4],
    "run.duration": 1e-3, "run.frames": 40, "run.checks": True,
}  # fmt: skip


def test_a_block_falls_onto_its_floor_in_the_movie(tmp_path: Path) -> None:
    block = solved(tmp_path, "drop", block_on_floor(), DROP)
    drawing = block.drawing(tmp_path)
    script = script_of(drawing)
    assert script is not None
    assert script.landing is not None
    body, position = script.actors[0].body, script.actors[0].position
    forces = script.drawing.trajectory.contacts["floor"].multipliers.sum(axis=1)
    pressed = forces > 0.3 * forces.max()  # Forces are linear between the frames of the run, 25 µs apart.
    assert 1 / 3 <= pressed.mean() < 1
    assert script.pace.factor > 1
    assert script.pace.slow[pressed].all()
    for frame in range(len(pressed)):
        lowest = script.landing.places(body, position, frame, script.scale)[:, 2].min()
        own = max((body.nodes + position + body.total(frame))[:, 2].min(), 0.0)
        assert lowest == pytest.approx(script.landing.scale * own, abs=ROUND_OFF)
        assert own < 2e-6 or not pressed[frame]
    drawn, _ = block.render(tmp_path / "pictures", pictures=MOVIE)
    assert movie._subtitle(script).endswith("grey: obstacle")
    grey = np.abs(imageio.imread(drawn[-1]).astype(float)[:, 80:548, 8:776] - [206, 210, 214]).max(axis=3) < 8
    assert (grey.mean(axis=(1, 2)) > 0.02).all()


def test_numbers_are_written_with_the_digits_that_they_need() -> None:
    assert [style.magnified(one) for one in (1.0, 2.5, 8e5, 1e6, 3e7)] == ["1", "2.5", "800000", "10⁶", "3×10⁷"]
    axes = style.new_figure("", "").add_subplot()
    axes.plot([0, 1], [0.9994788e3, 0.9994823e3])
    _write_ticks(axes.yaxis, 1e-3)
    ticks = axes.get_yticks()
    texts = [axes.yaxis.get_major_formatter()(tick) for tick in ticks]
    np.testing.assert_allclose([float(text) for text in texts], 1e-3 * ticks, rtol=0, atol=0.01e-3 * np.diff(ticks)[0])


def test_long_texts_are_not_cut_off() -> None:
    figure = style.new_figure("Title", "a subtitle that is much too long for its picture " * 4)
    axes = figure.add_axes((0.1, 0.1, 0.8, 0.7))
    axes.plot([0, 1], [0, 1], label="the first of three long labels of a legend")
    axes.plot([0, 1], [1, 1], label="the second of three long labels of a legend")
    axes.plot([0, 1], [0, 0], label="the third of three long labels of a legend")
    style.legend(axes)
    style.fit(figure)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    legend = axes.get_legend()
    assert legend is not None
    boxes = [text.get_window_extent(canvas.get_renderer()) for text in [*figure.texts, *legend.get_texts()]]
    assert max(box.x1 for box in boxes) <= style.WIDTH
    assert min(box.x0 for box in boxes) >= 0


def test_modes_of_a_rod_have_their_exact_frequencies(rod: Run, tmp_path: Path) -> None:
    drawing = rod.drawing(tmp_path)
    body = drawing.body("rod")
    numbers = lowest(body)
    exact = np.sqrt(210e9 / 7850.0) / 2 * np.arange(1, 7)
    np.testing.assert_allclose(body.modal.angular_frequencies[numbers] / (2 * np.pi), exact, rtol=1e-3)
    # The highest modes of a beam are thousands of times as fast as its first.
    wide = replace(body, modal=replace(body.modal, angular_frequencies=np.geomspace(1.0, 1e5, 20)))
    assert lowest(wide).tolist() == [0, 1, 2, 3, 4, 5]


def test_nothing_is_drawn_of_nothing(rod: Run, tmp_path: Path) -> None:
    """A rod that flies away has no force; a picture of it is not written."""
    store, told = modaldb.open(rod.store), []
    found = store.get(rod.key, "trajectory")
    contact = found.contacts["wall"]
    still = replace(contact, force=0 * contact.force, multipliers=0 * contact.multipliers)
    free = replace(found, contacts={"wall": still}, energies=0 * found.energies, peaks={}, peak_times=None)
    inputs = store.provenance(rod.key) | {"changed": True}
    store.put(content_key(inputs), "trajectory", free, inputs)
    drawing = Drawing(store, content_key(inputs), "rod", tmp_path, tmp_path, told.append)
    draw_force(drawing)
    draw_energy(drawing)
    assert told == []
    assert not drawing.touched("rod")


def test_crash_of_rendering_spares_the_rest(skirt: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake_child(tmp_path, monkeypatch, "os.kill(os.getpid(), signal.SIGSEGV)")
    out = tmp_path / "out"
    drawn, notes = plots.render(skirt.store, skirt.key, out, "skirt")
    assert [path.name for path in drawn] == ["force.png", "energy.png", "impacts.png", "pressure.png", "pressure.mp4"]
    assert len(notes) == 1
    assert "rendering crashed (SIGSEGV)" in notes[0]
    assert "gudgeon doctor" in notes[0]
    assert sorted(path.name for path in out.iterdir()) == FLAT


FLAT = ["energy.png", "force.png", "impacts.png", "pressure.mp4", "pressure.png"]


@pytest.mark.parametrize("last", ["force.png", "pressure.mp4"], ids=["between pictures", "after them"])
def test_interruption_ends_both_children_and_leaves_nothing_half_written(
    last: str, skirt: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SIGINT while one child draws, or is done, and the other has written half a file and sleeps."""
    ends = "from gudgeon.pipeline.process.lifeline import end_with_parent; end_with_parent(); time.sleep(60)"
    fake_child(tmp_path, monkeypatch, ends)
    children: list[subprocess.Popen[str]] = []
    start, out = subprocess.Popen.__init__, tmp_path / "out"

    def started(child: "subprocess.Popen[str]", *arguments: Any, **options: Any) -> None:
        start(child, *arguments, **options)
        children.append(child)

    def interrupt() -> None:
        half = False
        while not (half and (out / last).is_file()):
            half = any(out.glob(".drawing-*/deformation.png"))
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(subprocess.Popen, "__init__", started)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # Ignored where the tests run in the background.
    try:
        threading.Thread(target=interrupt, daemon=True).start()
        with pytest.raises(KeyboardInterrupt):
            plots.render(skirt.store, skirt.key, out, "skirt")
    finally:
        signal.signal(signal.SIGINT, before)
    assert [child.poll() is None for child in children] == [False, False]
    left = sorted(path.name for path in out.iterdir())
    assert left == FLAT if last == "pressure.mp4" else last in left
    assert not set(left) - set(FLAT)
    for name in left:
        if name.endswith(".png"):
            assert_picture(out / name)


def test_pictures_are_counted_as_they_are_drawn(skirt: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of both children; a drawing function that has nothing to draw lowers the number of pictures."""
    (tmp_path / "fake_child.py").write_text(COUNTING_CHILD)
    monkeypatch.setattr(plots, "CHILD", "fake_child")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    told: list[tuple[str, float]] = []
    skirt.render(tmp_path / "out", tell=lambda stage, share: told.append((stage, share)))
    # Which child speaks first is not determined: the numbers before both have begun, and drawn nothing, differ.
    assert told[-1] == ("plot (3 of 4 pictures)", 3 / 4)
    assert told == sorted(told, key=lambda one: one[1])


COUNTING_CHILD = """
import json, pathlib, sys, time
job = json.loads(pathlib.Path(sys.argv[1]).read_text())
lines = {"flat": ["begin 4", "end empty"], "rendered": ["begin 3", "end empty", "end empty"]}[job["group"]]
print(*lines, sep="\\n", flush=True)
if job["group"] == "rendered":
    print("end drawn", flush=True)
    time.sleep(1.0)
    job["group"] = ""
time.sleep(0.5)
for _ in range(3 if job["group"] else 0):
    print("end drawn", flush=True)
"""


def test_missing_library_is_noted(rod: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "matplotlib.py").write_text("raise ModuleNotFoundError('none here', name='matplotlib')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    out = tmp_path / "out"
    out.mkdir()
    (out / "force.png").write_bytes(b"of an earlier result")
    drawn, notes = rod.render(out)
    assert drawn == []
    assert list(out.iterdir()) == []
    assert "force was not drawn: matplotlib is not installed; pip install 'gudgeon[plots]'" in notes


def test_picture_of_an_earlier_result_does_not_outlive_a_failure(rod: Run, tmp_path: Path) -> None:
    told: list[str] = []
    drawing = rod.drawing(tmp_path, told.append)
    (tmp_path / "force.png").write_bytes(b"of an earlier result")
    with pytest.raises(ZeroDivisionError), drawing.file("force.png"):
        raise ZeroDivisionError
    assert not (tmp_path / "force.png").exists()
    assert told == []


def test_boundary_is_what_the_surfaces_cover(skirt_mesh: MeshRecord) -> None:
    named = np.concatenate([surface.facets for surface in skirt_mesh.surfaces.values()])
    skin = make_skin(
        skirt_mesh.nodes, cell_blocks(skirt_mesh), len(named), {"number": np.arange(float(len(skirt_mesh.nodes)))}
    )
    numbers = skin.surface.point_data["number"].astype(int)[skin.surface.regular_faces]
    assert {frozenset(facet) for facet in numbers} == {frozenset(facet) for facet in named[:, :3]}
    assert 0.9 < volume_of(skin.surface) / (np.pi * (0.04296**2 * 0.06 - 0.03896**2 * 0.052)) < 1.0


def test_skin_follows_the_curved_facets(skirt_mesh: MeshRecord) -> None:
    facets = sum(len(surface.facets) for surface in skirt_mesh.surfaces.values())
    linear = skirt_mesh.nodes @ np.array([1.0, 2.0, 3.0]) + 4.0
    skin = make_skin(skirt_mesh.nodes, cell_blocks(skirt_mesh), 16 * facets, {"linear": linear})
    assert skin.surface.n_cells == 16 * facets
    points = skin.points
    # Fields are interpolated as the positions are.
    np.testing.assert_allclose(skin.take("linear"), points @ np.array([1.0, 2.0, 3.0]) + 4.0, rtol=ROUND_OFF)
    # Patches: outside, inside, crown, its inner side, open end. Edges: two circles outside, two inside.
    rim = skin.edges.points[skin.edges.lines.reshape(-1, 3)[:, 1:]]
    lengths = np.linalg.norm(np.diff(rim, axis=1)[:, 0], axis=1)
    circles = 2 * np.pi * 2 * (0.04296 + 0.03896)
    # Quadratic arcs of 12 mm on a radius of 43 mm, in chords of a quarter.
    assert lengths.sum() == pytest.approx(circles, rel=1e-3)
    # Each patch is closed up: as many points as a planar or a tubular triangulation has, V = F/2 + b/2 + χ.
    boundary = 2 * skin.edges.n_cells
    assert skin.surface.n_points == (skin.surface.n_cells + boundary) // 2 + 1 + 1 + 0 + 0 + 0


@pytest.mark.parametrize("cut", [None, Cut(np.zeros(3), np.array([0.0, 1.0, 0.0]))], ids=["whole", "cut open"])
def test_normals_follow_a_moved_skin(skirt_mesh: MeshRecord, cut: Cut | None) -> None:
    skin = make_skin(skirt_mesh.nodes, cell_blocks(skirt_mesh), 20_000, {}, cut)
    sheared = skin.points.copy()
    sheared[:, 2] += 0.5 * sheared[:, 0]
    for points in (skin.points, sheared):
        skin.move(points)
        a, b, c = triangles_of(skin.surface)
        flat = np.cross(b - a, c - a)
        area = np.linalg.norm(flat, axis=1)
        # A cut leaves slivers, which have a direction of their own.
        whole = area > SLIVER * area.mean()
        smooth = skin.surface.point_data["Normals"][skin.surface.regular_faces[whole]]
        turned = np.einsum("fi,fki->fk", flat[whole] / area[whole, None], smooth)
        assert turned.min() > np.cos(np.radians(SHARP / 2))


def test_window_keeps_impulse_and_constants() -> None:
    times = 2e-7 * np.arange(1, 501)
    force = np.random.default_rng(1).random((500, 3))
    force[:450] *= 1e3
    filtered = hann_filter(times, force, 4e-5)
    np.testing.assert_allclose(filtered.sum(axis=0), force.sum(axis=0), rtol=ROUND_OFF)
    np.testing.assert_allclose(hann_filter(times, np.ones(500), 4e-5), 1.0, rtol=ROUND_OFF)
    spike = np.zeros(500)
    spike[250] = 1.0
    answer = hann_filter(times, spike, 4e-5)
    np.testing.assert_allclose(answer[250 - 99 : 250], answer[251 : 250 + 100][::-1], rtol=0, atol=ROUND_OFF)
    assert not answer[:151].any()
    assert not answer[350:].any()
    with pytest.raises(StageError, match="sample intervals"):
        hann_filter(np.array([1.0, 2.0, 4.0]), np.ones(3), 1.0)


def test_resampled_means_keep_the_impulse() -> None:
    times = 0.1 * np.arange(1, 101)
    force = np.random.default_rng(2).random((100, 3))
    grid = np.sort(np.concatenate([[-1.0, 0.0, 12.0], np.random.default_rng(3).random(17) * 10]))
    means = resample_mean(np.append(0.0, times), force, grid)
    np.testing.assert_allclose(means.T @ np.diff(grid), 0.1 * force.sum(axis=0), rtol=ROUND_OFF)
    np.testing.assert_allclose(resample_mean(np.append(0.0, times), force, np.append(0.0, times)), force, rtol=1e-9)
