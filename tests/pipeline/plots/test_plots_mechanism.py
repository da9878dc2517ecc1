"""Pictures of bodies that turn by any angle: where their joints are drawn, and what captions name."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline import plots
from gudgeon.pipeline.plots.base.run import Drawing

pytest.importorskip("matplotlib")
pytest.importorskip("pyvista")

from matplotlib.colors import to_hex, to_rgb

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.mechanism import film, picture
from gudgeon.pipeline.plots.mechanism.motion import Moving, moving_bodies
from gudgeon.pipeline.plots.mechanism.shapes import shown_bodies
from tests.pipeline.plots.runs import solved

REACH = 0.2 / np.sqrt(2)
"""Of the link along x and along z, which a body turned by 45 degrees about −y has [m]."""
TURNED = """
[component.link]
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh.size = 0.05
modes = { reduction = "row-craig-bampton", normal_count = 0, fixed_count = 0 }
interface.a = { surface = "left", kind = "tie", tie = "rbe2" }
interface.b = { surface = "right", kind = "tie", tie = "rbe2" }
gauge.near = { station = "near", fibre = "top" }
[component.link.geometry]
kind = "beam"
theory = "euler-bernoulli"
length = 0.2
motion = "space"
section = { kind = "rectangle", width = 0.01, height = 0.01 }
stations = { near = 0.05 }
[component.bob]
geometry = { kind = "rigid", mass = 1.0, inertia = [1e-4, 1e-4, 1e-4] }
[body.link]
gauges = ["near"]
orientation = { axis = [0.0, 1.0, 0.0], angle = -45.0 }
[body.bob]
position = [0.1414213562373095, 0.0, 0.1414213562373095]
[joint.pin]
kind = "revolute"
body = "link"
interface = "a"
axis = [0.0, 1.0, 0.0]
[joint.end]
kind = "revolute"
body = "link"
interface = "b"
against = "bob"
axis = [0.0, 1.0, 0.0]
[run]
duration = 0.001
gravity = [0.0, 0.0, -9.81]
samples = 20
frames = 4
accuracy = 1e-4
checks = false
"""


ROTOR = """
[component.rotor]
geometry = { kind = "rigid", mass = 1.0, inertia = [1e-4, 1e-3, 1e-3] }
[body.rotor]
angular_velocity = [100.0, 0.0, 0.0]
[joint.left]
kind = "revolute"
body = "rotor"
at = [-0.1, 0.0, -0.001]
axis = [1.0, 0.0, 0.0]
[force.right]
kind = "bushing"
body = "rotor"
at = [0.1, 0.0, -0.001]
stiffness = [1e3, 1e3, 1e3]
[run]
duration = 0.02
samples = 20
accuracy = 1e-4
"""
STOP = {"body": "bob", "against": {"shape": "plane", "point": [0.0, 0.0, -0.05], "normal": [0.0, 0.0, 1.0]}}


@pytest.fixture(scope="module")
def turned(tmp_path_factory: pytest.TempPathFactory) -> Drawing:
    """A link held by a pin, turned by its scene, with a mass at its end."""
    folder = tmp_path_factory.mktemp("turned")
    return solved(folder, "turned", TURNED).drawing(folder)


def test_joints_at_interfaces_of_a_turned_body_are_drawn_where_they_are(turned: Drawing) -> None:
    """In the picture and in the film, on the body itself and on the one at its end."""
    link, bob = moving_bodies(turned)
    ends = [[0.0, 0.0, 0.0], [REACH, 0.0, REACH]]
    # The record has joints by name.
    np.testing.assert_allclose((link.points + link.centre)[1::-1], ends, rtol=0, atol=1e-12)
    np.testing.assert_allclose((bob.points + bob.centre)[0], ends[1], rtol=0, atol=1e-12)
    shown = shown_bodies(turned, np.array([0]))[0]
    for name, end in zip(("pin", "end"), ends, strict=True):
        np.testing.assert_allclose(shown.joints[name][0], end, rtol=0, atol=1e-5)
        assert np.linalg.norm(shown.places[0] - shown.joints[name][0], axis=1).min() < 1e-7


def test_a_film_shows_the_planes_that_bodies_meet_and_its_colours(turned: Drawing) -> None:
    """A stop below the bodies is in view beside them, and the colour bar beside what is drawn."""
    bodies = shown_bodies(turned, np.array([0, 3]))
    assert film._walls(turned, bodies) == []
    turned.scene["contact"]["stop"] = STOP
    (wall,) = film._walls(turned, bodies)
    np.testing.assert_allclose(wall[:, 2], -0.05, rtol=0, atol=1e-12)
    view = film._view(bodies, moving_bodies(turned), [], [wall])
    seen, room = view.seen(wall)[:, :2], film.FINER * np.array([film.BOX[2] - film.BOX[0], film.BOX[3] - film.BOX[1]])
    assert (seen >= 0).all()
    assert (seen <= room).all()
    figure, _ = film._ground(turned, 1e-3, arrows=True, walls=True)
    subtitle = figure.texts[1].get_text()
    assert "grey: paths of joints, obstacles" in subtitle
    assert "forces of joints on their bodies" in subtitle
    bar = figure.axes[1].get_position()
    assert bar.x0 * film.SIZE[0] > film.BOX[2]
    del turned.scene["contact"]["stop"]


def test_pictures_name_gauges_and_how_bodies_are_drawn(turned: Drawing, tmp_path: Path) -> None:
    flat = {"flat": plots.TURNING["flat"], "rendered": {}}
    drawn, notes = plots.render(turned.out / "db", turned.key, tmp_path, "turned", pictures=flat)
    assert notes == []
    assert {"mechanism.png", "gauges.png"} <= {path.name for path in drawn}
    assert picture.LINES in picture._figure(turned).texts[1].get_text()


def test_paths_are_smooth_between_few_samples() -> None:
    """A point that goes round with eight samples a turn; beside the chords between them it is 7 % off the circle."""
    times, rate, radius = np.linspace(0.0, 2.0, 17), np.pi, 0.3
    motion = np.zeros((len(times), 12))
    motion[:, 5], motion[:, 11] = rate * times, rate
    moving = Moving("wheel", np.array([[radius, 0.0, 0.0], [0.0, 0.0, 0.0]]), np.zeros(3), motion)
    at, places = moving.course(times)
    exact = radius * np.column_stack([np.cos(rate * at), np.sin(rate * at), np.zeros_like(at)])
    np.testing.assert_allclose(places[:, 0], exact, rtol=0, atol=5e-4 * radius)
    assert np.linalg.norm(np.diff(places[:, 0], axis=0), axis=1).max() < 0.11 * radius
    assert set(times) <= set(at)
    few = replace(moving, motion=motion[::4])
    assert len(few.course(times[::4])[0]) == len(times[::4])  # Half a turn apart: what is between is not known.


def test_paths_have_a_place_at_each_sample_and_are_seen(turned: Drawing) -> None:
    """Of the film and of the picture, in a tone that stands out from white."""
    link, _ = shown_bodies(turned, np.array([0, 3]))
    samples, (at, path) = turned.trajectory.times, link.paths["end"]
    assert len(at) >= len(samples) == 20
    np.testing.assert_allclose(path[-1], link.joints["end"][-1], rtol=0, atol=1e-12)
    lines = picture._figure(turned).axes[0].lines
    assert sum(to_hex(line.get_color()) == style.GREY and np.size(line.get_xdata()) >= 20 for line in lines) == 5
    tone = np.array(to_rgb(style.GREY)) @ [0.2126, 0.7152, 0.0722]
    assert tone < 0.65


def test_axes_in_space_have_one_scale_and_ticks_that_fit(tmp_path: Path) -> None:
    """A rotor whose centre is a millimetre off its axis, on a bushing at its end, to which it is drawn."""
    drawing = solved(tmp_path, "rotor", ROTOR).drawing(tmp_path)
    figure = picture._figure(drawing)
    figure.canvas.draw()
    axes: Any = figure.axes[0]
    widths = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    box = axes._box_aspect
    np.testing.assert_allclose(widths / widths.max(), box / box.max(), rtol=0.02)
    for axis, limits in ((axes.yaxis, axes.get_ylim()), (axes.zaxis, axes.get_zlim())):
        ticks = axis.get_major_locator()()
        assert 2 <= ((ticks >= limits[0]) & (ticks <= limits[1])).sum() <= 3
    (rotor,) = moving_bodies(drawing)
    np.testing.assert_allclose((rotor.points + rotor.centre)[:2, 0], [-0.1, 0.1], rtol=0, atol=1e-12)


def test_positions_of_whole_turns_are_not_all_alike() -> None:
    """Of two turns the fourths are dead centres; the fifths are five positions."""
    angle = np.linspace(0.0, 4 * np.pi, 401)
    crank = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)[:, None]
    samples = picture.shown_samples([crank])
    assert len(np.unique(crank[samples, 0].round(3), axis=0)) >= 4
    still = np.zeros((1, 1, 3))
    assert picture.shown_samples([still]).tolist() == [0]
