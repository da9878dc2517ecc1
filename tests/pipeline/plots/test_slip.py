"""Maps of slip and stick: states of points, pixels between them, and the pictures of a run with friction."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
imageio = pytest.importorskip("imageio.v3")

from matplotlib.figure import Figure  # noqa: E402

from gudgeon.pipeline.plots.contact.maps import (  # noqa: E402
    OPEN,
    SLIPS,
    STICKS,
    Chart,
    kinetic_of,
    maps_of,
    raster,
    states_of,
)
from gudgeon.pipeline.plots.contact.pressure_film import draw_pressure_film  # noqa: E402
from gudgeon.pipeline.plots.contact.slip import draw_slip  # noqa: E402
from tests.pipeline.plots.runs import assert_picture, solved  # noqa: E402

BLOCK = """
[component.block]
geometry = { kind = "box", lx = 0.03, ly = 0.02, lz = 0.01 }
material = { E = 7e10, nu = 0.3, rho = 2700.0 }
mesh = { size = 0.006 }
interface.face = { surface = "bottom", kind = "points" }
modes = { normal_count = 6 }

[body.block]
component = "block"
position = [0.0, 0.0, 1e-6]
velocity = [0.5, 0.1, -0.2]

[contact.floor]
body = "block"
interface = "face"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
friction = { static = 0.3, kinetic = 0.2 }

[run]
duration = 3e-5
samples = 200
frames = 40
"""


def test_a_point_is_open_sticks_or_slips() -> None:
    normal = np.array([[0.0, 1.0, 1.0, 1.0, 2.0]])
    across = np.zeros((1, 5, 3))
    across[0, :, 0] = [0.0, 0.1, 0.2, 0.25, -0.4 * 0.6]
    across[0, 4, 1] = 0.4 * 0.8
    assert states_of(normal, across, 0.2).tolist() == [[OPEN, STICKS, SLIPS, STICKS, SLIPS]]


def test_kinetic_friction_is_static_friction_where_it_is_left_out() -> None:
    assert kinetic_of({"static": 0.3}) == 0.3
    assert kinetic_of({"static": 0.3, "kinetic": None}) == 0.3
    assert kinetic_of({"static": 0.3, "kinetic": 0.2}) == 0.2


def test_pixels_between_points() -> None:
    """Linear functions are exact, a pixel shows its nearest point, and none is beside the points."""
    lattice = np.array([[i / 6, j / 6] for i in range(7) for j in range(7 - i)])
    places = lattice * [2.0, 1.0]
    pixels = raster(Chart(1e3 * places, places, ("x", "y")), 100)
    assert tuple(pixels.draw(Figure().subplots(), 1.0 * pixels.covered).get_extent()) == (0.0, 2000.0, 0.0, 1000.0)
    assert pixels.covered.shape == (50, 100)
    assert pixels.covered.mean() == pytest.approx(0.5, abs=0.02)
    x, y = np.meshgrid((np.arange(100) + 0.5) / 50, (np.arange(50) + 0.5) / 50)
    between = pixels.between(3.0 + places @ [1.0, -2.0])
    assert np.isnan(between[~pixels.covered]).all()
    np.testing.assert_allclose(between[pixels.covered], (3.0 + x - 2.0 * y)[pixels.covered], rtol=0, atol=1e-12)
    there = np.column_stack([x[pixels.covered], y[pixels.covered]])
    nearest = pixels.of_nearest(np.arange(28.0))[pixels.covered].astype(int)
    apart = np.linalg.norm(there[:, None] - places, axis=2)
    np.testing.assert_allclose(apart[np.arange(len(there)), nearest], apart.min(axis=1), rtol=1e-12)


def test_friction_of_points_is_kept_and_drawn(tmp_path: Path) -> None:
    """Of a block that falls askew on a floor."""
    told: list[str] = []
    drawing = solved(tmp_path, "block", BLOCK).drawing(tmp_path, told.append)
    contact = drawing.trajectory.contacts["floor"]
    friction, normal = contact.friction, contact.multipliers
    assert friction is not None
    assert friction.shape == (*normal.shape, 3)
    size = np.linalg.norm(friction, axis=2)
    assert (size <= 0.3 * normal + 1e-9 * normal.max()).all()
    assert not friction[..., 2].any()
    (found,) = maps_of(drawing)
    slips = found.states == SLIPS
    assert slips.any()
    np.testing.assert_allclose(size[slips], 0.2 * normal[slips], rtol=1e-6, atol=1e-9 * normal.max())
    # What slides along x is dragged back.
    assert friction[..., 0].sum() < 0
    draw_slip(drawing)
    draw_pressure_film(drawing)
    assert told == ["slip.png", "pressure.mp4"]
    assert_picture(tmp_path / "slip.png")
    movie = imageio.imread(tmp_path / "pressure.mp4")
    assert movie.shape[1:] == (1200, 1600, 3)
