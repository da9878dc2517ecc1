"""The exporters and the displacement that they write, read back by meshio."""

import json
import math
import os
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import InterfaceModes, ModalRecord, MorphRecord
from gudgeon.modaldb.records.trajectory import ContactHistory, Trajectory
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.exporters import EXPORTERS, Exporter, vtu
from gudgeon.pipeline.exporters.vtu import BodyRecords
from gudgeon.pipeline.geometry import Bar, Beam, Box, Rigid
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.reduction.expansion import displacement
from tests.pipeline.small import rod_scene

MODES, FRAMES = 3, 5
ROUND_OFF = 1e-13
"""Both sides are the same sums of the same numbers."""

SECTION = {"kind": "circle", "radius": 0.01}
BEAM = {"kind": "beam", "theory": "euler-bernoulli", "length": 1.0, "section": SECTION}
LINES = {
    "line3": Bar(kind="bar", length=1.0, area=1e-4),
    "beam2": Beam.model_validate(BEAM),
    "beam3": Beam.model_validate(BEAM | {"theory": "timoshenko"}),
    "vertex": Rigid.model_validate(
        {"kind": "rigid", "mass": 1.0, "points": {"tip": {"at": [0, 0, 1], "normal": [0, 0, 1]}}}
    ),
}
BENDING = np.array([[0, 0, 2.0, 0, 0, 0], [0, 0, 0, 0, 3.0, 0]])
TWISTS = {
    "tetra10": np.diag([2.0, 3, 5, 7, 11, 13]),
    "line3": np.array([[2.0, 0, 0, 0, 0, 0]]),
    "beam2": BENDING,
    "beam3": BENDING,
    "vertex": np.eye(3, 6),
}


@pytest.fixture(params=TWISTS)
def mesh(request: pytest.FixtureRequest, skirt_mesh: MeshRecord) -> MeshRecord:
    return skirt_mesh if request.param == "tetra10" else LINES[request.param].build(0.1)


@pytest.fixture
def modal(mesh: MeshRecord) -> ModalRecord:
    """Records of numbers: what exporters do does not depend on their being modes."""
    nodes = next(iter(mesh.surfaces.values())).facets.ravel()[:1]
    shapes = np.sin(np.arange(mesh.nodes.size * MODES)).reshape(len(mesh.nodes), 3, MODES)
    c = len(nodes)
    touch = InterfaceModes(
        nodes=nodes,
        points=mesh.nodes[nodes],
        normals=np.ones((c, 3)),
        areas=np.full(c, 0.25),
        edge=np.zeros(c, bool),
        rows=np.ones((c, MODES)),
    )
    omega = 2 * np.pi * np.array([100.0, 1234.52, 98765.43])
    return ModalRecord(
        mesh_key="",
        reduction="",
        normal_count=MODES,
        static_count=0,
        angular_frequencies=omega,
        mass=1.0,
        centre=np.zeros(3),
        inertia=np.eye(3),
        rigid_twists=TWISTS[mesh.cell_type],
        interfaces={"touch": touch},
        interface_rows={},
        residual_flexibility=None,
        shapes=shapes,
        inertia_couplings=None,
        quality={},
    )


@pytest.fixture
def morph(mesh: MeshRecord, modal: ModalRecord) -> MorphRecord:
    return MorphRecord(
        mesh_key="",
        modes_key="",
        update="none",
        points={},
        mass=1.0,
        centre=np.array([0.1, 0.2, 0.3]),
        inertia=np.eye(3),
        rigid_twists=modal.rigid_twists,
        nodes=None,
        quality={},
    )


@pytest.fixture
def trajectory(modal: ModalRecord) -> Trajectory:
    """Body `b` behind four coordinates of `a`; two contacts on `b`, one on `a`."""
    own = len(modal.rigid_twists) + MODES
    frames = np.cos(np.arange(FRAMES * (4 + own))).reshape(FRAMES, 4 + own)
    points = modal.interfaces["touch"].points
    contacts = {
        name: ContactHistory(
            body=body,
            interface="touch",
            force=np.zeros((FRAMES, 3)),
            multipliers=force * np.arange(FRAMES)[:, None] * np.ones((1, len(points))),
            areas=areas,
            points=points,
        )
        for name, body, force, areas in (
            ("wall", "b", 3.0, np.full(len(points), 0.5)),
            ("stop", "b", 4.0, None),
            ("else", "a", 1e3, None),
        )
    }
    times = 1e-3 * np.arange(FRAMES) / 3
    return Trajectory(
        result="done",
        bodies={"a": "", "b": ""},
        coordinate_offsets={"a": 0, "b": 4},
        times=times,
        energies=np.zeros((FRAMES, 4)),
        contacts=contacts,
        frame_times=times,
        frames=frames,
        velocities=frames,
        quantities={},
        energy_drift=0.0,
        momentum_residual=0.0,
        counts={},
    )


def test_displacement_is_twists_about_the_centre_and_shapes(
    mesh: MeshRecord, modal: ModalRecord, morph: MorphRecord
) -> None:
    a = np.arange(1.0, len(morph.rigid_twists) + MODES + 1)
    r = len(morph.rigid_twists)
    found = displacement(mesh.nodes, morph, modal, a)
    assert modal.shapes is not None
    for n in (0, len(mesh.nodes) // 2, len(mesh.nodes) - 1):
        expected = sum((a[r + k] * modal.shapes[n, :, k] for k in range(MODES)), np.zeros(3))
        for k, twist in enumerate(morph.rigid_twists):
            expected += a[k] * (twist[:3] + np.cross(twist[3:], mesh.nodes[n] - morph.centre))
        np.testing.assert_allclose(found[n], expected, rtol=1e-12)


def test_displacement_needs_shapes_that_fit(mesh: MeshRecord, modal: ModalRecord, morph: MorphRecord) -> None:
    a = np.zeros(len(morph.rigid_twists) + MODES)
    with pytest.raises(StageError, match="contains no nodal shapes"):
        displacement(mesh.nodes, morph, replace(modal, shapes=None), a)
    for nodes, coordinates in ((mesh.nodes[1:], a), (mesh.nodes, a[1:])):
        with pytest.raises(StageError, match=f"the shapes have .{len(mesh.nodes)}, {MODES}."):
            displacement(nodes, morph, modal, coordinates)


def test_modes_come_back(mesh: MeshRecord, modal: ModalRecord, tmp_path: Path) -> None:
    path = tmp_path / "made" / "modes.vtu"
    vtu.write_modes(path, mesh, modal)
    back = meshio.read(path)
    np.testing.assert_array_equal(back.points, mesh.nodes)
    written = cell_of(mesh).meshio or mesh.cell_type
    assert [(block.type, block.data.tolist()) for block in back.cells] == [(written, mesh.cells.tolist())]
    assert list(back.point_data) == ["mode_001_100.0Hz", "mode_002_1234.5Hz", "mode_003_98765.4Hz"]
    assert modal.shapes is not None
    np.testing.assert_array_equal(back.point_data["mode_002_1234.5Hz"], modal.shapes[:, :, 1])
    assert os.listdir(path.parent) == ["modes.vtu"]


@pytest.mark.parametrize("every", [1, 2])
def test_frames_come_back(
    every: int, mesh: MeshRecord, modal: ModalRecord, morph: MorphRecord, trajectory: Trajectory, tmp_path: Path
) -> None:
    files = vtu.write_trajectory(tmp_path, BodyRecords(mesh, modal, morph), trajectory, "b", every)
    chosen = range(0, FRAMES, every)
    assert [file.name for file in files] == [*(f"frame_{frame:03d}.vtu" for frame in chosen), "frames.pvd"]
    assert sorted(files) == sorted(tmp_path.iterdir())
    node = int(modal.interfaces["touch"].nodes[0])
    for frame, file in zip(chosen, files, strict=False):
        back = meshio.read(file)
        np.testing.assert_array_equal(back.points, mesh.nodes)
        expected = displacement(mesh.nodes, morph, modal, trajectory.frames[frame, 4:])
        np.testing.assert_allclose(back.point_data["displacement"], expected, rtol=ROUND_OFF)
        pressure = np.zeros(len(mesh.nodes))
        solid = mesh.cell_type == "tetra10"
        pressure[node] = frame * (3.0 / 0.5 + 4.0 / 0.25 if solid else 3.0 + 4.0)
        name = "contact_pressure" if solid else "contact_force"
        np.testing.assert_allclose(back.point_data[name], pressure, rtol=ROUND_OFF)
        assert len({"contact_pressure", "contact_force"} & set(back.point_data)) == 1
    entries = ElementTree.parse(files[-1]).getroot().findall("Collection/DataSet")
    assert [entry.get("file") for entry in entries] == [file.name for file in files[:-1]]
    assert [float(entry.get("timestep", math.nan)) for entry in entries] == trajectory.frame_times[::every].tolist()


def test_frames_stand_where_the_design_stands(
    mesh: MeshRecord, modal: ModalRecord, morph: MorphRecord, trajectory: Trajectory, tmp_path: Path
) -> None:
    moved = replace(morph, nodes=mesh.nodes + 0.5)
    file = vtu.write_trajectory(tmp_path, BodyRecords(mesh, modal, moved), trajectory, "b", FRAMES)[0]
    back = meshio.read(file)
    np.testing.assert_array_equal(back.points, mesh.nodes + 0.5)
    expected = displacement(mesh.nodes + 0.5, moved, modal, trajectory.frames[0, 4:])
    np.testing.assert_allclose(back.point_data["displacement"], expected, rtol=ROUND_OFF)


def test_all_bodies_are_in_one_collection(
    mesh: MeshRecord, modal: ModalRecord, morph: MorphRecord, trajectory: Trajectory, tmp_path: Path
) -> None:
    place, stress = np.array([1.0, -2.0, 3.0]), np.arange(6.0 * len(mesh.nodes)).reshape(-1, 6)
    stress[0] = np.nan
    fast = replace(trajectory, velocities=2 * trajectory.frames)
    bodies = {
        "b": BodyRecords(mesh, modal, morph, place, 1, lambda frame: (1 + frame) * stress),
        "a": BodyRecords(mesh, modal, replace(morph, rigid_twists=np.zeros((0, 6)))),
    }
    files = vtu.write_results(tmp_path, bodies, fast, 2)
    back = meshio.read(tmp_path / "b" / "frame_002.vtu")
    np.testing.assert_allclose(back.points, mesh.nodes + place, rtol=ROUND_OFF)
    np.testing.assert_allclose(back.point_data["velocity"], 2 * back.point_data["displacement"], rtol=ROUND_OFF)
    np.testing.assert_array_equal(back.point_data["stress"], 3 * stress)
    assert np.isnan(back.point_data["von_mises"]).tolist() == [True] + [False] * (len(mesh.nodes) - 1)
    assert set(back.point_data["body_id"]) == {1}
    other = meshio.read(tmp_path / "a" / "frame_002.vtu")
    assert set(other.point_data["body_id"]) == {0}
    assert "stress" not in other.point_data
    entries = ElementTree.parse(files[-1]).getroot().findall("Collection/DataSet")
    assert files[-1].name == "results.pvd"
    found = [(float(one.get("timestep", math.nan)), one.get("part"), one.get("file")) for one in entries]
    times = trajectory.frame_times[::2].tolist()
    assert found == [
        (time, str(part), f"{name}/frame_{2 * k:03d}.vtu")
        for k, time in enumerate(times)
        for part, name in enumerate("ab")
    ]


def test_all_frames_are_exported_unless_fewer_are_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(rod_scene(0.1, 3, 40, 7))
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["export", str(tmp_path), "results", *places, "--json"]) == 0
    every = [Path(name) for name in json.loads(capsys.readouterr().out)]
    store = modaldb.open(tmp_path / "db")
    frames = Drawing(store, open_job(tmp_path, db=tmp_path / "db").trajectory().key, "", tmp_path, tmp_path, print)
    count = len(frames.trajectory.frame_times)
    assert count >= 7
    assert len([path for path in every if path.suffix == ".vtu"]) == count
    assert every[-1] == tmp_path / "out" / "vtu" / "results.pvd"
    assert main(["export", str(tmp_path), "results", *places, "--every", "3"]) == 0
    assert capsys.readouterr().out == f"{every[-1]}: {-(-count // 3)} frames of 1 body\n"


def test_a_turned_body_is_exported_as_it_stands_in_the_scene(tmp_path: Path) -> None:
    """The rod along x, turned to y and moved, struck at its end: it moves along y as it did along x."""
    plain = rod_scene(0.1, 3, 40, 7)
    text = plain.replace(
        "point = [1.0, 0.0, 0.0], normal = [-1.0, 0.0, 0.0]", "point = [0.0, 1.5, 0.0], normal = [0.0, -1.0, 0.0]"
    ).replace(
        "velocity = [1.0, 0.0, 0.0]",
        """velocity = [0.0, 1.0, 0.0]
position = [0.2, 0.5, 0.0]
orientation = { axis = [0.0, 0.0, 1.0], angle = 90.0 }""",
    )
    for name, scene in (("plain", plain), ("turned", text)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "scene.toml").write_text(scene)
        places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / name / "out")]
        assert main(["export", str(tmp_path / name), "results", *places]) == 0
    frames = sorted((tmp_path / "turned" / "out" / "vtu" / "rod").glob("frame_*.vtu"))
    assert len(frames) >= 7
    for frame in (frames[0], frames[1], frames[-1]):
        back, before = meshio.read(frame), meshio.read(tmp_path / "plain" / "out" / "vtu" / "rod" / frame.name)
        assert np.ptp(back.points[:, 0]) < 1e-15
        assert back.points[:, 0] == pytest.approx(np.full(len(back.points), 0.2))
        assert back.points[:, 1] == pytest.approx(before.points[:, 0] + 0.5)
        for what, least in (("displacement", 1e-15), ("velocity", 1e-12)):
            moved, along = back.point_data[what], before.point_data[what][:, 0]
            assert np.abs(moved[:, [0, 2]]).max() < least
            assert moved[:, 1] == pytest.approx(along, rel=1e-6, abs=1e-9 * np.abs(along).max())


@pytest.mark.parametrize("name", EXPORTERS)
def test_every_exporter_refuses_in_one_line(
    name: str, mesh: MeshRecord, modal: ModalRecord, morph: MorphRecord, trajectory: Trajectory, tmp_path: Path
) -> None:
    exporter: Exporter = EXPORTERS[name]
    records = BodyRecords(mesh, modal, morph)
    (tmp_path / "file").write_text("kept")
    cases = [
        (lambda: exporter.write_modes(tmp_path / "file" / "x", mesh, modal), "cannot be written"),
        (lambda: exporter.write_modes(tmp_path, mesh, modal), "cannot be written"),
        (lambda: exporter.write_trajectory(tmp_path / "file", records, trajectory, "b", 1), "cannot be written"),
        (lambda: exporter.write_trajectory(tmp_path, records, trajectory, "c", 1), "no body 'c', it has a, b"),
        (
            lambda: exporter.write_trajectory(tmp_path, records, trajectory, "b", 0),
            "every = 0 given; allowed: 1 or more",
        ),
    ]
    for call, text in cases:
        with pytest.raises(InputError, match=text) as caught:
            call()
        assert "\n" not in str(caught.value)
    with pytest.raises(StageError, match="has no nodal shapes"):
        exporter.write_modes(tmp_path / "x", mesh, replace(modal, shapes=None))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "kept"


def test_a_writer_that_breaks_leaves_what_was_there(
    mesh: MeshRecord, modal: ModalRecord, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "modes.vtu"
    vtu.write_modes(path, mesh, modal)
    before = path.read_bytes()

    def break_down(scratch: Path, *_: object, **__: object) -> None:
        scratch.write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(meshio, "write", break_down)
    with pytest.raises(StageError, match="No space left on device"):
        vtu.write_modes(path, mesh, modal)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["modes.vtu"]


PULLED = """
[component.rod]
geometry = { kind = "bar", length = 1.0, area = 1e-4 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.1 }
supports = ["left"]
interface.tip = { surface = "right", kind = "mean" }
modes = { reduction = "macneal", normal_count = 1 }
[body.rod]
ORIENTATION
[force.pull]
kind = "force"
body = "rod"
interface = "tip"
direction = AXIS
expression = "2.1e4"
[probe.tip]
kind = "displacement"
body = "rod"
interface = "tip"
direction = AXIS
[run]
duration = 1e-3
samples = 20
frames = 4
"""
SPRING = "[force.s]\nkind = 'spring'\nbody = 'rod'\ninterface = 'tip'\ndirection = AXIS\nstiffness = 1e3\n"


@pytest.mark.parametrize("turned", [False, True])
def test_displacement_has_what_kept_modes_lack_of_the_loads(
    turned: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """F L/(E A) = 1 mm at the end and x F/(E A) along the bar with one mode, which alone has 81 % of it."""
    axis = "[0, 1, 0]" if turned else "[1, 0, 0]"
    text = PULLED.replace("AXIS", axis).replace(
        "ORIENTATION", "orientation = { axis = [0, 0, 1], angle = 90 }" if turned else ""
    )
    (tmp_path / "scene.toml").write_text(text)
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["export", str(tmp_path), "results", *places]) == 0
    back = meshio.read(sorted((tmp_path / "out" / "vtu" / "rod").glob("frame_*.vtu"))[-1])
    along, across = (1, 0) if turned else (0, 1)
    assert back.point_data["displacement"][:, along] == pytest.approx(1e-3 * back.points[:, along], rel=1e-9, abs=1e-15)
    assert np.abs(back.point_data["displacement"][:, [across, 2]]).max() < 1e-15
    assert "displacement of body" not in capsys.readouterr().err
    (tmp_path / "scene.toml").write_text(text + SPRING.replace("AXIS", axis))
    assert main(["export", str(tmp_path), "results", *places]) == 0
    error = capsys.readouterr().err
    assert "displacement of body rod is that of its 1 kept coordinates alone, without the residual flexibility" in error
    assert "force.s" in error


def test_a_node_of_two_faces_has_the_larger_of_their_pressures(modal: ModalRecord, trajectory: Trajectory) -> None:
    """On one face pressures add up, at an edge they do not."""
    mesh = Box(kind="box", lx=1.0, ly=1.0, lz=1.0).build(1.0)
    touch = replace(modal.interfaces["touch"], nodes=np.array([3]), areas=np.ones(1))
    sides = {"touch": touch, "side": replace(touch, normals=-touch.normals)}
    contacts = {name: replace(item, areas=np.ones(1), multipliers=item.multipliers[:, :1])
                for name, item in trajectory.contacts.items() if item.body == "b"}  # fmt: skip
    pressed = replace(trajectory, contacts=contacts | {"side": replace(contacts["stop"], interface="side")})
    field = vtu._contact_field(mesh, replace(modal, interfaces=sides), pressed, "b", 2)
    assert field["contact_pressure"][3] == (3.0 + 4.0) * 2
    assert np.count_nonzero(field["contact_pressure"]) == 1
