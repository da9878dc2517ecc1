"""Mechanisms through the commands: results, pictures, and what is refused in one line."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.exporters.export import export
from gudgeon.pipeline.kinds import open_job, plan, run
from gudgeon.pipeline.linear.analysis import Asked, analyse
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.mechanism import film
from gudgeon.pipeline.plots.mechanism.motion import moving_bodies
from gudgeon.pipeline.plots.mechanism.shapes import Shape, Shown, shown_bodies
from gudgeon.solver.errors import SceneError
from tests.scenes import scene_path

SECOND = 5e-5
"""Shortening of a rod that bends by 3 mm, of second order, which films leave out [m]."""
SHORT = {"run.duration": 0.05, "run.samples": 20, "run.frames": 4}


def test_a_run_has_results_and_pictures(tmp_path: Path) -> None:
    report = run(scene_path("four-bar"), set=SHORT, db=tmp_path / "db", out=tmp_path / "out")
    assert report.result == "FINISHED"
    assert {"mechanism.png", "mechanism.mp4", "energy.png", "probes.png", "summary.json", "trajectory.h5"} <= {
        path.name for path in (tmp_path / "out").iterdir()
    }
    assert report.quantities["ground0.angle_end"]["value"] == pytest.approx(-0.05, rel=2e-2)
    assert any("35 rows of rank 29" in note for note in report.notes)


def test_arrows_of_a_film_end_within_it(tmp_path: Path) -> None:
    short = {"run.duration": 0.03, "run.samples": 100, "run.frames": 20}
    done = run(scene_path("squeezer"), set=short, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    drawing = Drawing(modaldb.open(tmp_path / "db"), done.stages["solve"].key, "squeezer", tmp_path, tmp_path, print)
    times = drawing.trajectory.frame_times
    bodies = shown_bodies(drawing, np.arange(len(times)))
    arrows = film._arrows(drawing, times, bodies)
    view = film._view(bodies, moving_bodies(drawing), arrows)
    room = film.FINER * np.array([film.BOX[2] - film.BOX[0], film.BOX[3] - film.BOX[1]])
    longest = 0.0
    for arrow in arrows:
        along = film.FINER * film.LONGEST * (film.BOX[2] - film.BOX[0]) * (arrow.forces @ view.axes[:2].T) * [1, -1]
        tips = view.seen(arrow.places)[:, :2] + along
        longest = max(longest, float(np.linalg.norm(along, axis=1).max()))
        assert (tips > 0).all()
        assert (tips < room).all()
    assert longest > 0.1 * room[0]


def test_the_plan_says_how_it_runs(tmp_path: Path) -> None:
    found = plan(scene_path("squeezer"), db=tmp_path / "db")
    assert found["integrator"] == "turning"
    ports = {row["member"]: row for row in found["ports"]}
    assert (ports["joint.o"]["number"], ports["joint.o"]["rows"]) == (5, "moving")
    assert ports["force.spring"]["rows"] == "moving"
    assert set(found["inertia"].values()) == {"rigid, turns by any angle"}
    assert found["turning"] == "any angle: joint 'o' and 9 more of two markers"


def test_the_plan_says_the_order_of_inertia_couplings(tmp_path: Path) -> None:
    """Of each body, with its frame, and why the scene turns."""
    terms = {}
    for name, stiff, order in (("a", True, "second order (geometric stiffness)"), ("b", False, "first order")):
        given = {"body.rod.geometric_stiffness": stiff}
        found = plan(scene_path("elastic-slider-crank"), set=given, db=tmp_path / name)
        assert found["inertia"]["rod"] == f"floating frame of mean axes: couplings by displacements of {order}"
        assert found["inertia"]["crank"] == "rigid, turns by any angle"
        terms = {(row["body"], row["term"]): row["reason"] for row in found["terms"]}
    assert terms["rod", "elastic flight"] == "coordinates of the floating frame, integrated by steps"


@pytest.mark.parametrize(
    ("rate", "wanted"),
    [
        (0.0, "small motion: no body has an angular velocity, within run.limits.angle, 0.05 rad"),
        (0.4, "small motion: body 'bar' at 0.4 rad/s for 0.1 s turns by 0.04 rad, within run.limits.angle, 0.05 rad"),
        (2.0, "any angle: body 'bar' at 2 rad/s for 0.1 s turns by 0.2 rad, beyond run.limits.angle, 0.05 rad"),
    ],
)
def test_the_plan_says_which_bound_decides(rate: float, wanted: str, tmp_path: Path) -> None:
    path = tmp_path / "bar.toml"
    path.write_text(
        """
        component.bar.geometry = {kind = "box", lx = 0.4, ly = 0.02, lz = 0.02}
        component.bar.material = {E = 7e10, nu = 0.0, rho = 2700}
        component.bar.mesh.size = 0.02
        component.bar.modes.normal_count = 4
        run.duration = 0.1
        """
        f"body.bar.angular_velocity = [0.0, 0.0, {rate}]\n"
    )
    found = plan(path, db=tmp_path / "db")
    assert found["turning"] == wanted
    small = "elastic, small motion: frame and deformation are not coupled"
    assert (found["inertia"]["bar"] == small) == (rate < 1)


@pytest.mark.parametrize("command", ["linear", "export"])
def test_commands_for_small_motion_refuse(command: str, tmp_path: Path) -> None:
    job = open_job(scene_path("top"), db=tmp_path / "db", out=tmp_path / "out")
    calls = {
        "linear": lambda: analyse(job, Asked(), lambda stage, share: None),
        "export": lambda: export(job, "results", 1),
    }
    with pytest.raises(InputError, match=f"{command}: the bodies of this scene turn by any angle"):
        calls[command]()


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "contact": (
        {"contact.floor": {"body": "top", "interface": "foot", "method": "impact", "restitution": 0.5,
                           "against": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}}},
        r"contact\.floor\.method: 'impact' given; contact there has method 'residual', or 'penalty' with a law of kind"
        r" linear, hertz.* \(joint\.pivot\.kind is 'spherical', so bodies turn by any angle",
    ),
    "name": (
        {"contact.pivot": {"body": "top", "interface": "foot", "method": "penalty",
                           "law": {"kind": "linear", "stiffness": 1e6},
                           "against": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}}},
        r"contact\.pivot: a joint 'pivot' has quantities of the same names; give the contact another name",
    ),
    "freedom": ({"body.top.freedom": ["x", "y", "z"]}, r"body\.top\.freedom: the body turns by any angle"),
    "interface": ({"joint.pivot.interface": "bore"}, r"joint\.pivot: give one of: at, interface"),
    "ratio": ({"joint.mesh": {"kind": "gear", "joint": "pivot", "other": "pivot", "ratio": -1.0}},
              r'ratio: -1 given; allowed: above 0; meshing = "external" or "internal" gives the direction'),
    "elastic": (
        {"component.top.geometry": {"kind": "box", "lx": 0.1, "ly": 0.1, "lz": 0.2},
         "component.top.material": {"E": 2e11, "nu": 0.3, "rho": 7850.0}, "component.top.mesh": {"size": 0.05},
         "component.top.geometry.mass": "unset",
         "component.top.geometry.inertia": "unset"},
        r"joint\.pivot\.at: body 'top' deforms, and is held at interfaces",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_turn_is_refused_before_any_stage(name: str, tmp_path: Path) -> None:
    changes, text = BAD[name]
    with pytest.raises(InputError, match=text):
        open_job(scene_path("top"), set=changes, db=tmp_path / "db")


MESHED: dict[str, Any] = {
    "component.top.geometry": {"kind": "box", "lx": 0.1, "ly": 0.1, "lz": 0.2},
    "component.top.material": {"E": 2e11, "nu": 0.3, "rho": 7850.0}, "component.top.mesh": {"size": 0.1},
    "component.top.modes.reduction": "rigid", "component.top.geometry.mass": "unset",
    "component.top.geometry.inertia": "unset", "run.duration": 1e-3, "run.samples": 10, "run.frames": 2,
}  # fmt: skip


@pytest.mark.parametrize("key", ["at", "against_at"])
def test_a_probe_off_a_meshed_part_is_refused(key: str, tmp_path: Path) -> None:
    probe = {"kind": "distance", "body": "top", "against": "top", "at": [0.0, 0.0, 0.0], key: [10.0, 0.0, 0.0]}
    text = rf"probe\.far\.{key}: \[10\.0, 0\.0, 0\.0\] given, it lies 9\.95 m off the part; .* is \[0\.05, 0\.0, 0\.0\]"
    with pytest.raises(InputError, match=text):
        run(scene_path("top"), set=MESHED | {"probe.far": probe}, db=tmp_path / "db", out=tmp_path / "out")


def test_a_chain_that_does_not_close_is_wrong_input(tmp_path: Path) -> None:
    changes = SHORT | {"joint.ground2.against_at": [9.0, 0.0, 0.0]}
    with pytest.raises((InputError, SceneError), match="the joints do not close"):
        run(scene_path("four-bar"), set=changes, db=tmp_path / "db", out=tmp_path / "out")


SHORTEST: dict[str, Any] = {"run.duration": 1e-6, "run.samples": 10, "run.frames": 2}


def test_joints_close_without_deformation_where_they_can(tmp_path: Path) -> None:
    """A drive that begins at 1 rad moves the crank there; the rod keeps its shape."""
    changes = SHORTEST | {"joint.drive.expression": "1 + 150*t"}
    done = run(scene_path("elastic-slider-crank"), set=changes, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    found = modaldb.open(tmp_path / "db").get(done.stages["solve"].key, "trajectory")
    assert found.result == "FINISHED"
    first = found.coordinate_offsets["rod"] + 6
    bent = np.abs(found.frames[0, first : first + 20]).max()
    assert bent < 1e-6, "the velocities of the scene, which do not obey the joints there, deform it by 1e-7"
    assert not any("only where it deforms" in note for note in done.notes)
    np.testing.assert_allclose(found.joints["axle"].angle, 1.0, atol=1e-3)


def test_joints_that_close_by_deformation_say_so(tmp_path: Path) -> None:
    places: dict[str, Any] = {"db": tmp_path / "db", "out": tmp_path / "out", "until": "solve"}
    held = {"kind": "fixed", "body": "slider", "against_at": [0.4501, 0.0, 0.0]}
    done = run(scene_path("elastic-slider-crank"), set=SHORTEST | {"joint.held": held}, **places)
    assert any("body.rod: the joints close at the start only where it deforms by" in note for note in done.notes)
    changes = SHORTEST | {"joint.slider-pin.against_at": [0.0, 0.0, 0.5], "joint.slider-pin.against": "crank"}
    with pytest.raises(
        (InputError, SceneError), match=r"body\.rod: the joints close .* beyond run\.limits\.deflection"
    ):
        run(scene_path("elastic-slider-crank"), set=changes, **places)


def test_velocities_that_need_deformation_are_said(tmp_path: Path) -> None:
    places: dict[str, Any] = {"db": tmp_path / "db", "out": tmp_path / "out", "until": "solve"}
    done = run(scene_path("elastic-slider-crank"), set=SHORTEST | {"body.slider.velocity": [5.0, 0.0, 0.0]}, **places)
    text = "body.slider: its velocity at the start does not obey the joints of bodies that do not deform at the start;"
    assert any(note.startswith(f"{text} it was changed by 5 m/s") for note in done.notes)


@pytest.mark.parametrize("start", [0.0, 0.3])
def test_a_drive_that_works_by_deformation_alone_is_said(start: float, tmp_path: Path) -> None:
    """At the dead centre a drive of the slider stretches the rod; beside it, the crank turns."""
    tilt, c, s = float(np.arcsin(0.5 * np.sin(start))), float(np.cos(start)), float(np.sin(start))
    changes = SHORTEST | {
        "joint.drive.joint": "guide", "joint.drive.expression": "-0.01*t",
        "body.crank": {"position": [0.075 * c, 0.0, 0.075 * s],
                       "orientation": {"axis": [0.0, -1.0, 0.0], "angle": float(np.degrees(start))}},
        "body.rod.position": [0.15 * c, 0.0, 0.15 * s],
        "body.rod.orientation": {"axis": [0.0, 1.0, 0.0], "angle": float(np.degrees(tilt))},
        "body.slider.position": [0.15 * c + 0.3 * float(np.cos(tilt)), 0.0, 0.0],
    }  # fmt: skip
    places: dict[str, Any] = {"db": tmp_path / "db", "out": tmp_path / "out", "until": "solve"}
    done = run(scene_path("elastic-slider-crank"), set=changes, **places)
    text = "joint.drive: the other joints hold what it drives at the start, as if bodies were rigid: it moves only as"
    assert any(note.startswith(f"{text} body.rod deforms") for note in done.notes) is (start == 0)


def test_modes_without_static_shapes_are_refused_at_joints(tmp_path: Path) -> None:
    """Residual flexibility does not act in mechanisms: the default reduction would be too stiff there, in silence."""
    changes = {"component.rod.modes.reduction": "macneal", "component.rod.modes.normal_count": 20}
    with pytest.raises(InputError, match=r"component.rod.modes.reduction: 'macneal' has no static shape of interface"):
        open_job(scene_path("elastic-slider-crank"), set=changes, db=tmp_path / "db", out=tmp_path / "out")


def test_points_of_joints_are_drawn_where_they_are(tmp_path: Path) -> None:
    """Joints at the origin of a body, by default, and at interfaces of bodies that deform."""
    for scene, body in (("clearance-joint", "slider"), ("elastic-slider-crank", "rod")):
        out = tmp_path / scene
        done = run(scene_path(scene), set=SHORT | {"run.duration": 1e-4}, db=tmp_path / "db", out=out, until="solve")
        store = modaldb.open(tmp_path / "db")
        drawing = Drawing(store, done.stages["solve"].key, scene, out, out, print)
        found = {one.name: one for one in moving_bodies(drawing)}
        assert all(np.isfinite(one.places(slice(None))).all() for one in found.values())
        ends = {tuple(np.round(one, 12)) for one in found[body].points + found[body].centre}
        expected = {(0.17, 0.0, 0.0)} if body == "slider" else {(0.15, 0, 0), (0.45, 0, 0), (0.3, 0, 0)}
        assert ends == expected


def filmed(scene: str, changes: dict[str, Any], folder: Path) -> tuple[dict[str, Shown], dict[str, np.ndarray]]:
    """Return the bodies of a scene at its frames, and what its probes of displacement read at them [m]."""
    places: dict[str, Any] = {"db": folder / "db", "out": folder / "out"}
    done = run(scene_path(scene), set=changes, **places, until="solve")
    drawing = Drawing(modaldb.open(places["db"]), done.stages["solve"].key, scene, places["out"], places["out"], print)
    trajectory = drawing.trajectory
    shown = shown_bodies(drawing, np.arange(len(trajectory.frame_times)))
    samples = np.searchsorted(trajectory.times, trajectory.frame_times * (1 - 1e-9))
    return {one.name: one for one in shown}, {name: one.values[samples] for name, one in trajectory.probes.items()}


def test_the_film_shows_a_rod_between_its_pins_as_it_bends(tmp_path: Path) -> None:
    """Its nodes at the ends stand where its joints are and where probes read, its middle beside the chord."""
    changes: dict[str, Any] = {"run.duration": 0.0125, "run.samples": 30, "run.frames": 3}
    found, read = filmed("elastic-slider-crank", changes, tmp_path)
    for name, joint, x in (("big", "crank-pin", 0.15), ("small", "slider-pin", 0.45), ("middle", None, 0.3)):
        places = read[name][1:] + np.array([x, 0.0, 0.0])
        if joint is not None:
            np.testing.assert_allclose(found["rod"].joints[joint][1:], places, rtol=0, atol=SECOND)
        nearest = np.linalg.norm(found["rod"].places[1:] - places[:, None], axis=2).min(axis=1)
        assert nearest.max() < SECOND
    assert found["rod"].bent.max() > 1e-3
    assert found["slider"].shape is Shape.RIGID


def test_the_film_shows_a_beam_whose_frame_follows_its_root(tmp_path: Path) -> None:
    changes: dict[str, Any] = {"run.duration": 2e-3, "run.samples": 20, "run.frames": 3}
    found, read = filmed("rotating-beam", changes, tmp_path)
    places = read["tip"][1:] + np.array([0.5, 0.0, 0.0])
    assert np.linalg.norm(found["beam"].places[1:] - places[:, None], axis=2).min(axis=1).max() < SECOND


AXIAL = {"component.rod.modes": {"reduction": "row-craig-bampton", "normal_count": 0, "fixed_count": 12}}
"""Among its modes is the first along the rod."""
HELD = {"component.rod.modes": {"reduction": "row-craig-bampton", "normal_count": 0, "fixed_count": 4}}
LACKS = "strain energy that the forces of its joints"


def test_what_modes_lack_at_joints_is_said(tmp_path: Path) -> None:
    """A bar drawn at one end has N = F (1 - x/L); a uniform stretch, all that its modes have along it, has 3/4 of its
    energy, (∫ N dx)²/L over ∫ N² dx."""
    short = {"run.duration": 1e-3, "run.samples": 20, "run.frames": 2}
    found = run(scene_path("rotating-beam"), set=short, db=tmp_path / "db", out=tmp_path / "a", until="solve")
    assert found.quantities["beam.joint_truncation"]["value"] == pytest.approx(0.25, rel=1e-3)
    assert any(
        note.startswith("body.beam: its modes do not represent 0.25 of the strain energy") for note in found.notes
    )


def test_forces_that_balance_each_other_find_all_static_shapes(tmp_path: Path) -> None:
    """A force at one end alone lacks a quarter along the rod, see above; gas and crank press at both."""
    short = {"run.duration": 4e-3, "run.samples": 200, "run.frames": 2}
    lacks = []
    for name, modes in (("few", HELD), ("more", AXIAL)):
        given = short | modes
        found = run(
            scene_path("piston/crank-train.toml"), set=given, db=tmp_path / "db", out=tmp_path / name, until="solve"
        )
        lacks.append(found.quantities["rod.joint_truncation"]["value"])
        assert not any(LACKS in note for note in found.notes)
    assert 0 <= lacks[1] < 0.2 * lacks[0] < 1e-3
