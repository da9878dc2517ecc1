"""One look: colours of the house, letters that are read, one largest force, ringing in grey, MAC with names."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
imageio = pytest.importorskip("imageio.v3")

from matplotlib.colors import to_hex  # noqa: E402
from matplotlib.text import Text  # noqa: E402
from PIL import Image  # noqa: E402

from gudgeon.pipeline.cli.results import absent_line  # noqa: E402
from gudgeon.pipeline.modes.comparison import ModeComparison  # noqa: E402
from gudgeon.pipeline.plots.base import style  # noqa: E402
from gudgeon.pipeline.plots.base.hardest import hardest  # noqa: E402
from gudgeon.pipeline.plots.contact.curves import draw_force  # noqa: E402
from gudgeon.pipeline.plots.contact.maps import Chart, on_chart  # noqa: E402
from gudgeon.pipeline.plots.mac import draw_mac  # noqa: E402
from gudgeon.pipeline.plots.mechanism.picture import ringing  # noqa: E402
from tests.pipeline.plots.runs import solved  # noqa: E402
from tests.pipeline.small import rod_scene  # noqa: E402

WIDE = 1280
"""Width at which letters are measured [px]."""


def described(path: Path) -> str:
    return str(Image.open(path).info["Description"])


def test_colours_of_curves_are_those_of_the_house() -> None:
    with style.styled():
        axes = style.new_figure("", "").add_subplot()
        colours = [to_hex(axes.plot([0, 1])[0].get_color()) for _ in style.COLOURS]
    assert colours == [to_hex(colour) for colour in style.COLOURS]
    assert len(set(colours)) == len(colours)


def test_letters_stay_large_and_long_texts_get_lines(tmp_path: Path) -> None:
    with style.styled():
        figure = style.new_figure("Title", "one part of a subtitle that is long  ·  " * 6)
        axes = figure.add_axes((0.1, 0.1, 0.8, 0.6))
        for k in range(5):
            axes.plot([0, 1], [k, 1], label=f"the label of curve {k}, which is rather long for a legend")
        axes.set_ylabel("a label of the axis that is longer than the axis is high " * 2)
        style.legend(axes)
        style.save(figure, tmp_path / "picture.png")
    sizes = [float(text.get_fontsize()) for text in figure.findobj(Text) if isinstance(text, Text)]
    assert min(sizes) >= style.LEAST_TEXT
    assert "\n" in figure.texts[1].get_text()
    lines = described(tmp_path / "picture.png").splitlines()
    assert lines[:2] == ["Title", figure.texts[1].get_text().replace("\n", " ")]
    # 9 pt of a figure 8 in wide are more than 9 pt, 12 px, of a screen that shows it 1280 px wide.
    assert style.LEAST_TEXT * style.DPI / 72 * WIDE / style.WIDTH >= 12


def test_all_pictures_name_the_printed_peak(tmp_path: Path) -> None:
    """The largest mean over a sample is nearly twice that of the window: it is neither named nor marked."""
    run = solved(tmp_path, "rod", rod_scene(0.02, 20, 400, 30))
    drawing = run.drawing(tmp_path)
    trajectory = drawing.trajectory
    peak, raw = (trajectory.quantities[f"wall.{name}"]["value"] for name in ("force_peak", "force_peak_raw"))
    assert raw > 1.2 * peak
    strongest = hardest(trajectory, ["wall"])
    assert strongest is not None
    assert strongest.force == peak
    assert style.quantity(peak, "N") in style.moment_text(strongest, trajectory)
    # The frame that is shown lies at the time of that force, also where a single sample is higher elsewhere.
    when = 0.5 * (trajectory.frame_times[3] + trajectory.frame_times[4])
    later = {"wall.peak_time": {"value": when, "unit": "s"}, "wall.force_window": {"value": 1e-9, "unit": "s"}}
    moved = hardest(replace(trajectory, quantities={**trajectory.quantities, **later}), ["wall"])
    assert moved is not None
    assert moved.time in trajectory.frame_times[3:5]
    draw_force(drawing)
    text = described(tmp_path / "force.png")
    assert f"largest {style.quantity(peak, 'N')}" in text
    assert style.quantity(raw, "N") not in text


def test_a_force_that_rings_has_the_period_of_its_ringing() -> None:
    times = 1e-4 * np.arange(1, 2001)
    turning = 1e3 * np.cos(2 * np.pi * 5.0 * times)
    steady = np.column_stack([turning, 0 * times, 0 * times])
    assert ringing(times, steady, 5.0) == 0.0
    rings = steady + np.column_stack([0 * times, 400 * np.sin(2 * np.pi * 310.0 * times), 0 * times])
    assert ringing(times, rings, 5.0) == pytest.approx(1 / 310.0, rel=0.02)


def test_directions_of_slip_are_those_of_the_map() -> None:
    """Around a cylinder: what points along the circumference points to the right of its unrolled surface."""
    angle, height = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.5, 0.5, 6), np.linspace(0, 0.02, 5)))
    points = np.column_stack([0.05 * np.cos(angle), 0.05 * np.sin(angle), height])
    chart = Chart(np.column_stack([angle, height]), np.column_stack([0.05 * angle, height]), ("", ""))
    around = np.column_stack([-np.sin(angle), np.cos(angle), 0 * angle])
    turned = on_chart(chart, points, 3.0 * around + [0.0, 0.0, 4.0])
    np.testing.assert_allclose(turned, np.tile([3.0, 4.0], (30, 1)), rtol=0.03)


def test_mac_has_title_names_and_values(tmp_path: Path) -> None:
    frequencies = np.array([100.0, 250.0]), np.array([101.0, 2500.0, 3000.0])
    mac = np.array([[0.99, 0.02, 0.0], [0.0, 0.5, 0.3]])
    draw_mac(ModeComparison(frequencies, mac, 1e-6), ("coarse (abc)", "fine (def)"), tmp_path / "mac.png")
    text = described(tmp_path / "mac.png")
    assert text.startswith("MAC of two bases\ncoarse (abc), 2 modes, downwards")
    assert "mode of fine (def)" in text
    assert "0.99" in text
    picture = imageio.imread(tmp_path / "mac.png")[..., :3]
    assert min(border.min() for border in (picture[:8], picture[-8:], picture[:, :8], picture[:, -8:])) > 250


def test_what_is_not_drawn_is_said_in_one_line() -> None:
    two_masses = {name: Path(name) for name in ("force.png", "energy.png", "impacts.png")}
    (line,) = absent_line(two_masses, [])
    assert line.startswith("not drawn: deformation: no body with an extent deforms; film: ")
    assert "stress: no body has a gauge of stress on a surface" in line
    whole = two_masses | {name: Path(name) for name in ("deformation-a.png", "impact.mp4", "stress-a.png")}
    assert not list(absent_line(whole, []))
    assert "stress" not in next(iter(absent_line(two_masses, ["stress was not drawn: StageError: no force"])))
    assert not list(absent_line({"charge.png": Path("charge.png")}, []))
