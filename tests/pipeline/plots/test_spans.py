"""Axes of constant quantities, and the order of labels."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from gudgeon.pipeline.plots.base import style


def axes_of(
    x: np.ndarray, y: np.ndarray, *, equal: bool = False
) -> tuple[Figure, tuple[float, float], tuple[float, float]]:
    figure = style.new_figure("title", "subtitle")
    axes = figure.add_axes((0.1, 0.1, 0.8, 0.7))
    axes.plot(x, y)
    if equal:
        axes.set_aspect("equal", adjustable="datalim")
    style.keep_spans(axes)
    style.fit(figure)
    return figure, axes.get_xlim(), axes.get_ylim()


@pytest.mark.parametrize("level", [40.0, -40.0, 0.04])
def test_round_off_of_a_constant_is_not_enlarged(level: float) -> None:
    x = np.linspace(0.0, 1.0, 50)
    figure, _, (low, high) = axes_of(x, level * (1 + 1e-13 * np.sin(20 * x)))
    assert high - low >= 0.999e-3 * abs(level)
    assert low < level < high
    axes = figure.axes[0]
    assert not axes.yaxis.get_offset_text().get_text()
    assert len({label.get_text() for label in axes.get_yticklabels()}) == len(axes.get_yticklabels())


def test_what_varies_keeps_its_span_and_times_may_be_enlarged() -> None:
    x = np.linspace(0.402, 0.40201, 50)
    _, along, (low, high) = axes_of(x, 40 + np.sin(1e6 * x))
    assert high - low == pytest.approx(2.2, rel=0.02)
    assert along[1] - along[0] == pytest.approx(1.1e-5, rel=0.01)


def test_a_path_along_a_line_is_no_sliver() -> None:
    x = np.linspace(0.0, 10.0, 50)
    _, along, across = axes_of(x, 2.0 + 1e-12 * x, equal=True)
    assert np.ptp(across) >= 0.19 * np.ptp(along)
    _, along, across = axes_of(np.full(2, 3.0), np.array([2.0, 2.0 + 1e-14]), equal=True)
    assert min(np.ptp(along), np.ptp(across)) >= 2.9e-3


@pytest.mark.parametrize("count", [1, 4, 5, 7])
def test_labels_stand_in_rows_in_the_order_of_the_curves(count: int) -> None:
    figure = style.new_figure("title", "subtitle")
    axes = figure.add_axes((0.1, 0.1, 0.8, 0.6))
    for number in range(count):
        axes.plot([0, 1], [number, number], label=f"{number}")
    style.legend(axes)
    style.fit(figure)
    texts = axes.get_legend().get_texts()  # type: ignore[union-attr]
    boxes = {text.get_text(): text.get_window_extent() for text in texts}
    read = sorted(boxes, key=lambda one: (-round(boxes[one].y0), boxes[one].x0))
    assert read == [f"{number}" for number in range(count)]
