"""Films run slowly around impacts, from the side from which the contact is seen, and show gaps between bodies."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pv = pytest.importorskip("pyvista")

from gudgeon.pipeline.plots.base import view  # noqa: E402
from gudgeon.pipeline.plots.base.pace import at_times, closed_spans, merged, pace_of  # noqa: E402
from gudgeon.pipeline.plots.deformation.script import script_of  # noqa: E402
from tests.pipeline.plots.runs import solved  # noqa: E402
from tests.pipeline.small import block_on_floor  # noqa: E402

ROUND_OFF = 1e-12
PAIR = """
[component.cube]
geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.02 }
mesh.size = 0.02
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
interface.low = { surface = "bottom" }
interface.high = { surface = "top" }
modes = { normal_count = 4 }

[body.lower]
component = "cube"

[body.upper]
component = "cube"
position = [0.0, 0.0, 0.02002]
velocity = [0.0, 0.0, -1.0]

[contact.faces]
body = "upper"
interface = "low"
against = { shape = "body", body = "lower", interface = "high" }

[run]
duration = 6e-5
samples = 200
frames = 60
checks = false
"""


@pytest.mark.parametrize(
    "impacts", [[(4e-3, 4.1e-3)], [(0.0, 1e-4), (5e-3, 5.2e-3)], [(0.0, 5e-3)], [(2e-3, 2e-3)], []]
)
def test_half_of_the_frames_are_within_impacts_or_the_film_is_even(impacts: list[tuple[float, float]]) -> None:
    pace = pace_of((0.0, 1e-2), impacts, 100, [4.05e-3])
    assert 4.05e-3 in pace.times
    assert pace.times[[0, -1]].tolist() == [0.0, 1e-2]
    long = merged(impacts) and sum(b - a for a, b in impacts) >= 5e-3
    if not impacts or long:
        assert pace.factor == 1.0
        np.testing.assert_allclose(np.diff(pace.times), 1e-2 / 99, rtol=0.6)
        return
    assert pace.slow.mean() == pytest.approx(0.5, abs=0.05)
    inside, outside = (np.diff(pace.times)[mask] for mask in (pace.slow[1:] & pace.slow[:-1], ~pace.slow[1:]))
    assert np.median(outside) / np.median(inside) == pytest.approx(pace.factor, rel=0.05)
    assert pace.text(int(pace.slow.argmax())).strip() == f"{pace.factor:.2g} × slower"


def test_states_between_frames_are_linear(tmp_path: Path) -> None:
    drawing = solved(tmp_path, "block", block_on_floor()).drawing(tmp_path)
    trajectory = drawing.trajectory
    middle = 0.25 * trajectory.frame_times[3] + 0.75 * trajectory.frame_times[4]
    between = at_times(drawing, np.array([trajectory.frame_times[2], middle])).trajectory
    np.testing.assert_array_equal(between.frames[0], trajectory.frames[2])
    expected = 0.25 * trajectory.frames[3] + 0.75 * trajectory.frames[4]
    np.testing.assert_allclose(between.frames[1], expected, rtol=0, atol=ROUND_OFF * np.abs(expected).max())
    ((start, stop),) = closed_spans(trajectory, ["floor"])
    assert 0 <= start < stop <= trajectory.times[-1]


def test_the_film_of_a_pair_shows_its_gap(tmp_path: Path) -> None:
    """Drawn gaps are those of the run, magnified by one factor, and nothing is drawn within the other body."""
    script = script_of(solved(tmp_path, "pair", PAIR).drawing(tmp_path))
    assert script is not None
    assert script.landing is not None
    actors = {actor.body.name: actor for actor in script.actors}

    def gap(frame: int, scale: float) -> float:
        upper, lower = (script.points(actors[name], frame, scale) for name in ("upper", "lower"))
        return float(upper[:, 2].min() - lower[:, 2].max())

    moved = {name: a.body.nodes + a.position + a.body.total(0) for name, a in actors.items()}
    true = float(moved["upper"][:, 2].min() - moved["lower"][:, 2].max())
    assert 0 < true < 20e-6
    assert gap(0, script.scale) == pytest.approx(true * script.landing.scale, rel=1e-6)
    assert gap(0, script.scale) > 0.02 * 0.02
    closed = script.drawing.trajectory.contacts["faces"].multipliers.sum(axis=1) > 0
    assert closed.mean() >= 1 / 3
    for frame in np.flatnonzero(closed):
        # Faces that bend meet at their nearest points.
        assert abs(gap(int(frame), script.scale)) < 0.05 * 0.02


def test_the_side_is_chosen_by_what_is_seen() -> None:
    """Points on the top of a cube below a lid are seen from aside, not from above."""
    cube = pv.Cube(center=(0.0, 0.0, 0.0)).triangulate()
    lid = pv.Cube(center=(0.0, 0.0, 1.2), x_length=3.0, y_length=3.0, z_length=0.2).triangulate()
    x, y = (grid.ravel() for grid in np.meshgrid([-0.4, 0.0, 0.4], [-0.4, 0.0, 0.4]))
    points, up = np.column_stack([x, y, np.full(9, 0.5)]), np.array([0.0, 0.0, 1.0])
    sides = [view.looking(np.array([1.0, 0.0, 0.0]), up, 0.0, angle) for angle in (64.0, 20.0, -64.0)]
    shares = view.shares_seen(points, np.tile(up, (9, 1)), [cube, lid], sides)
    assert shares[1] > max(shares[0], shares[2])
    assert view.largest_alike(shares) == 1
    assert view.largest_alike(np.array([0.49, 0.5, 0.2])) == 0
