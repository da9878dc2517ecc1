"""Pictures of located impacts, sliding, bending and gauges, and the numbers that they are drawn from."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import ContactHistory, Trajectory
from gudgeon.pipeline import plots
from gudgeon.pipeline.plots.base.run import Curve

pytest.importorskip("matplotlib")
pytest.importorskip("pyvista")

from matplotlib.figure import Figure

from gudgeon.pipeline.plots.contact.curves import balance, energy_curves
from gudgeon.pipeline.plots.contact.force_axes import (
    WRITTEN,
    force_axes,
    shown_force,
    smoothed,
    spaced,
    windowed,
)
from gudgeon.pipeline.plots.contact.located import Touch, course, normal_courses, touches
from gudgeon.solver.integrators.curves import windowed as windowed_force
from tests.pipeline.plots.runs import Run, assert_picture, solved

RIGID = """
[component.{body}]
geometry = {{ kind = "rigid", mass = 1.0, points = {{ foot = {{ at = [0, 0, 0], normal = [0, 0, -1.0] }} }} }}
interface.foot = {{ surface = "foot" }}
"""
FLOOR = """
body = "{body}"
interface = "foot"
against = {{ shape = "plane", point = [0, 0, 0], normal = [0, 0, 1.0]{more} }}
"""

BALL = f"""
{RIGID.format(body="ball")}
[body.ball]
position = [0.0, 0.0, 1.0]
[contact.floor]
{FLOOR.format(body="ball", more="")}
method = "impact"
restitution = 0.8
[run]
duration = 5.0
gravity = [0.0, 0.0, -9.81]
"""
BELT = f"""
{RIGID.format(body="block")}
[body.block]
velocity = [0.2, 0.0, 0.0]
[force.spring]
kind = "spring"
body = "block"
direction = [1.0, 0.0, 0.0]
stiffness = 100.0
[contact.belt]
{FLOOR.format(body="block", more=", velocity = [0.2, 0, 0]")}
method = "constraint"
friction = {{ static = 0.5, kinetic = 0.3, direction = [1.0, 0.0, 0.0] }}
[run]
duration = 2.0
gravity = [0.0, 0.0, -9.81]
"""
BEAM = f"""
{RIGID.format(body="ball")}
[component.beam]
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
mesh = {{ size = 0.03 }}
supports = [{{ surface = "left", hold = ["z"] }}, {{ surface = "right", hold = ["z"] }}]
interface.mid = {{ surface = "mid-top" }}
gauge.under = {{ station = "mid", fibre = "bottom" }}
modes = {{ reduction = "macneal", normal_count = 6 }}
[component.beam.geometry]
kind = "beam"
theory = "euler-bernoulli"
length = 0.3
section = {{ kind = "rectangle", width = 0.01, height = 0.01 }}
stations = {{ mid = 0.15 }}
[body.ball]
position = [0.15, 0.0, 0.005]
velocity = [0.0, 0.0, -0.1]
[body.beam]
gauges = ["under"]
[contact.pair]
body = "ball"
interface = "foot"
against = {{ shape = "body", body = "beam", interface = "mid" }}
method = "residual"
law = {{ kind = "hertz", stiffness = 1e9 }}
[run]
duration = 0.01
samples = 500
frames = 40
"""
IMPACTS = {"flat": {"impacts": plots.PLOTS["flat"]["impacts"]}, "rendered": {}}
NAMES = {
    "ball": ["force.png", "energy.png", "impacts.png"],
    "belt": ["force.png", "energy.png", "impacts.png"],
    "beam": ["force.png", "energy.png", "impacts.png", "gauges.png", "deformation.png", "modes.png", "impact.mp4"],
}


@pytest.fixture(scope="module", params=["ball", "belt", "beam"])
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Run:
    text = {"ball": BALL, "belt": BELT, "beam": BEAM}[request.param]
    return solved(tmp_path_factory.mktemp(request.param), request.param, text)


def made(impacts: np.ndarray, force: np.ndarray, window: float | None = None) -> Trajectory:
    """Return a trajectory of one contact, sampled every second."""
    s = len(force)
    history = ContactHistory("a", "tip", force[:, None] * [[0.0, 0.0, 1.0]], np.zeros((1, 1)), None, np.zeros((1, 3)))
    quantities = {} if window is None else {"c.force_window": {"value": window, "unit": "s"}}
    return Trajectory(
        "FINISHED", {}, {}, np.arange(1.0, s + 1), np.zeros((s, 5)), {"c": history}, np.array([s]), np.zeros((1, 0)),
        np.zeros((1, 0)), quantities, 0.0, 0.0, {}, impacts={"c": impacts},
    )  # fmt: skip


def test_pictures(scene: Run, tmp_path: Path) -> None:
    drawn, notes = scene.render(tmp_path)
    assert notes == []
    assert [path.name for path in drawn] == NAMES[scene.name]
    assert set(NAMES[scene.name]) <= set(plots.FILES)
    for path in (path for path in drawn if path.suffix == ".png"):
        assert_picture(path)


def test_points_meet_in_impacts_and_nowhere_else(scene: Run, tmp_path: Path) -> None:
    drawing = scene.drawing(tmp_path)
    (touch,) = touches(drawing)
    courses = normal_courses(drawing, touch)
    own = courses[0]
    other = np.interp(own.times, courses[1].times, courses[1].place) if touch.partner else np.zeros(len(own.times))
    apart = own.place - other
    start = touch.impacts[:, 0]
    impacts = touch.impacts[start > 0]
    # A ball meets the floor at the located times; frames of the beam are 0.25 ms apart, 25 µm at the first speed.
    resolved = 1e-5 if touch.partner else touch.interval * np.abs(impacts[:, 5]).max(initial=0.0)
    assert np.abs(np.interp(impacts[:, 0], own.times, apart)).max(initial=0.0) <= resolved + 1e-12
    inside = ((own.times[:, None] >= touch.impacts[:, 0]) & (own.times[:, None] <= touch.impacts[:, 1])).any(axis=1)
    free = ~inside & (own.times > 0)
    assert (apart[free] > -resolved - 1e-12).all()


def test_paths_at_samples_pass_through_the_frames(scene: Run, tmp_path: Path) -> None:
    """What is drawn at every sample is, at frames, the motion that coordinates and R give."""
    drawing = scene.drawing(tmp_path)
    (touch,) = touches(drawing)
    courses = normal_courses(drawing, touch)
    contact = drawing.scene["contact"][touch.name]
    pressed = -touch.contact.multipliers if contact.get("method") == "residual" else None
    size = max(float(np.ptp(one.place)) for one in courses)
    for found, side, start in zip(courses, (touch.side, touch.partner), (touch.gap, 0.0), strict=False):
        assert len(found.times) == len(touch.trajectory.times) + 1
        assert side is not None
        expected = course(drawing, side, touch.direction, pressed, start=start)
        np.testing.assert_allclose(
            np.interp(expected.times, found.times, found.place), expected.place, rtol=0, atol=1e-9 * size
        )


@pytest.mark.parametrize("scene", ["beam"], indirect=True)
def test_a_point_that_loads_deform_at_the_start_begins_at_its_first_known_place(scene: Run, tmp_path: Path) -> None:
    """Under gravity the beam is bent when its run starts, by what the record does not have; the rigid ball is not."""
    drawing = scene.drawing(tmp_path)
    (touch,) = touches(drawing)
    assert [one.times[0] for one in normal_courses(drawing, touch)] == [0.0, 0.0]
    drawing.scene["run"]["gravity"] = [0.0, 0.0, -9.81]
    ball, beam = normal_courses(drawing, touch)
    assert ball.times[0] == 0.0
    assert beam.times[0] > 0.0
    assert touch.contact.path is not None
    assert beam.place[0] == touch.contact.path[0, 1]


def test_a_reference_is_drawn_within_the_window_of_the_run() -> None:
    rough = 1.0 + 0.5 * (-1.0) ** np.arange(200)
    trajectory = made(np.array([[0.0, 200.0, 200.0, 1.5, 1.0, 1, 1]]), rough, 10.0)
    found = windowed(trajectory, "c", Curve("file", np.arange(1.0, 151.0), rough[:150]))
    assert found.times[-1] == 150
    np.testing.assert_allclose(found.force[20:-20], 1.0, rtol=1e-12)


def test_energy_curves_hold_work_and_no_round_off() -> None:
    energies = np.zeros((3, 5))
    energies[:, 0], energies[:, 4], energies[:, 2] = [1.0, 3.0, 5.0], [0.0, 2.0, 4.0], 1e-14
    curves = {label: values for label, _, values in energy_curves(energies)}
    assert list(curves) == ["energy balance", "kinetic", "work of loads"]
    np.testing.assert_allclose(curves["energy balance"], balance(energies))
    assert [label for label, _, _ in energy_curves(energies[:, :4])] == ["total", "kinetic"]
    energies[:, 4] = energies[:, 0] * (1 + 1e-13)
    assert not energy_curves(energies)[0][2].any()


def test_brief_impacts_are_impulses_and_the_rest_is_force() -> None:
    impacts = np.array(
        [
            [10.5, 10.5, 7.0, 0, 10.5, 1, 1, 0, 10.5],
            [20.0, 21.0, 3.0, 6, 20.5, 1, 1, 6, 20.5],
            [40.0, 60.0, 20.0, 1, 50, 1, 1, 1, 50],
        ]
    )
    force = np.zeros(100)
    force[10], force[20], force[40:60] = 7.0, 3.0, 1.0
    touch = Touch("c", made(impacts, force), None, None, np.array([0.0, 0.0, 1.0]), 0.0)  # type: ignore[arg-type]
    assert touch.brief.tolist() == [True, True, False]
    assert touch.impulsive
    np.testing.assert_array_equal(np.flatnonzero(touch.lasting_force), np.arange(40, 60))
    assert touch.span == (0.0, 60.0 + 0.25 * 49.5)


def test_window_is_drawn_only_where_it_smooths_something() -> None:
    rough = 1.0 + 0.5 * (-1.0) ** np.arange(200)
    impacts = np.array([[0.0, 200.0, 200.0, 1.5, 1.0, 1, 1, 1, 100.0]])
    found = smoothed(made(impacts, rough, 10.0), "c")
    assert found is not None
    assert found[1] == "mean over 10.0 s, twice"
    np.testing.assert_allclose(found[0][20:-20, 2], 1.0, rtol=1e-12)
    assert smoothed(made(impacts, np.ones(200), 10.0), "c") is None
    assert smoothed(made(impacts, rough, 2.0), "c") is None
    assert smoothed(made(impacts, rough), "c") is None


def test_the_drawn_window_has_the_peak_of_its_quantity() -> None:
    """A force that begins with a jump: before the run it is zero, as in `force_peak`."""
    times = np.arange(1, 401) * 1.0
    force = np.exp(-times / 40) * (1 + 0.3 * np.cos(times))
    edges, sums = np.append(0.0, times), np.append(0.0, np.cumsum(force))[:, None] * [0.0, 0.0, 1.0]
    impacts = np.array([[0.0, 400.0, force.sum(), force[0], 1.0, 1, 1, 1, 200.0]])
    for window in (20.0, 25.0, 17.4):
        found = smoothed(made(impacts, force, window), "c")
        assert found is not None
        peak = windowed_force(edges, sums, window)[0]
        assert np.abs(found[0]).max() == pytest.approx(peak, rel=5e-4)


def test_a_window_longer_than_the_contact_is_drawn_beside_its_force() -> None:
    """The largest value of `force_peak` is a curve of the picture; films show the same force as the picture."""
    times = np.arange(1, 401) * 1.0
    force = np.where((times > 100) & (times < 140), np.sin(np.pi * (times - 100) / 40), 0.0)
    impacts = np.array([[100.0, 140.0, force.sum(), force.max(), 1.0, 1, 1, 1, 120.0]])
    run = made(impacts, force, 30.0)
    found = smoothed(run, "c")
    assert found is not None
    assert not found.resolved
    edges, sums = np.append(0.0, times), np.append(0.0, np.cumsum(force))[:, None] * [0.0, 0.0, 1.0]
    peak = windowed_force(edges, sums, 30.0)[0]
    assert np.abs(found.force).max() == pytest.approx(peak, rel=2e-3)
    assert peak < 0.8
    axes = Figure().add_axes((0, 0, 1, 1))
    force_axes(axes, run, "c", times)
    raw, within = axes.get_lines()[:2]
    assert [np.max(line.get_ydata()) for line in (raw, within)] == pytest.approx([force.max(), peak], rel=2e-3)
    assert raw.get_linewidth() > within.get_linewidth()
    shown, name = shown_force(run, "c")
    assert name == "mean over 1.00 s"
    np.testing.assert_array_equal(shown[:, 2], force)
    long = made(impacts, 1.0 + 0.5 * (-1.0) ** np.arange(400), 30.0)
    assert shown_force(long, "c")[1] == "mean over 30.0 s, twice"


def test_texts_keep_their_distance() -> None:
    assert spaced(np.array([0.0, 1.0, 10.0, 20.0]), (0.0, 100.0)) == [0, 2, 3]
    assert len(spaced(np.arange(0.0, 100.0, 6.0), (0.0, 100.0))) == WRITTEN


def test_a_block_slides_in_the_main_direction_of_its_friction(tmp_path: Path) -> None:
    """Friction in the plane of contact has no direction in the scene."""
    more = """
    [body.block]
    velocity = [0.3, 0.2, 0.0]
    freedom = ["x", "y", "z"]
    [contact.floor]
    """
    text = RIGID.format(body="block") + more + FLOOR.format(body="block", more="")
    text += 'method = "impact"\nrestitution = 0.0\nfriction = { static = 0.1 }\n'
    text += "[run]\nduration = 0.6\ngravity = [0, 0, -9.81]\n"
    drawn, notes = solved(tmp_path, "block", text).render(tmp_path / "out", pictures=IMPACTS)
    assert notes == []
    assert_picture(drawn[0])
