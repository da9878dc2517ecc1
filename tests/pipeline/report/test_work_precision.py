"""The picture of a report, the front, and where numbers of points stand."""

from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib import image

from gudgeon.pipeline.report.front import pareto_front, with_front
from gudgeon.pipeline.report.page.picture import (
    BOX,
    GREY,
    LEAST,
    draw,
    drawn,
    error_chart,
    floor_of,
    front_of,
    looks,
    places,
)
from tests.pipeline import documents

NAMES = ("small", "large", "crowd", "infinite", "biting", "unmatched")


@pytest.mark.parametrize("name", NAMES)
def test_picture_is_drawn(name: str, tmp_path: Path) -> None:
    """At its full size, and with ink in the axes where there is a run to draw; nothing half-written stays."""
    draw(getattr(documents, name)(), tmp_path / "new" / "report.png")
    picture = image.imread(tmp_path / "new" / "report.png")
    assert picture.shape[:2] == (1200, 1600)
    coloured = np.ptp(picture[180:1030, 150:980, :3], axis=-1) > 0.3
    assert coloured.any() == (name != "unmatched")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["report.png"]


def test_front() -> None:
    """By hand: (1, 3), (2, 2), (4, 1) beat the rest; of equal errors the faster one counts."""
    points = [(4.0, 1.0), (1.0, 3.0), (3.0, 2.0), (2.0, 2.0), (5.0, 1.0), (1.0, 4.0)]
    assert pareto_front(points) == [1, 3, 0]
    assert pareto_front([]) == []


def test_runs_know_whether_they_are_on_the_front() -> None:
    runs = [
        documents.run("slow", 0.01, 9.0),
        documents.run("failed", None, 0.1),
        documents.run("fast", -0.05, 1.0),
        documents.run("beaten", 0.05, 2.0),
    ]
    assert [run.front for run in with_front(runs)] == [True, False, True, False]


def test_looks_differ_and_nodal_runs_are_grey() -> None:
    document = documents.large()
    found = looks(document)
    assert len(set(found.values())) == len(found) == 10
    assert {scheme for scheme, look in found.items() if look.colour == GREY} == {"full FE"}


def test_round_off_stands_on_the_lower_edge() -> None:
    assert floor_of([0.0, 1e-15, 0.03, 0.3]) == pytest.approx(0.01)
    assert floor_of([0.0, 1e-15]) == LEAST


def test_numbers_do_not_cover_each_other() -> None:
    """In a crowd some are left out, but never those that matter; none lies on another."""
    points = [(float(10 * (i % 8)), float(9 * (i // 8))) for i in range(64)]
    texts = [str(i + 1) for i in range(64)]
    important = [i == 20 for i in range(64)]
    found = places(points, texts, important)
    assert found[20] is not None
    boxes = [
        (x + shift[0], y + shift[1], x + shift[0] + BOX[0] * len(text), y + shift[1] + BOX[1])
        for (x, y), text, shift, matters in zip(points, texts, found, important, strict=True)
        if shift is not None and not matters
    ]
    assert 0 < len(boxes) < 64
    for a, b in combinations(boxes, 2):
        assert not (a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3])
    assert all(shift is not None for shift in places([(0.0, 0.0), (90.0, 0.0)], ["1", "2"], [False, False]))


def test_points_of_the_chart_carry_their_runs() -> None:
    """Each point has the number, the scheme and the lines of its run; one on the front says so, for each quantity."""
    document = documents.large()
    for quantity in ("", "chatter"):
        chart = ElementTree.fromstring(error_chart(document, quantity))
        points = [node for node in chart.iter() if node.get("class", "").startswith("point")]
        spots = drawn(document.runs, quantity)
        assert [int(node.attrib["data-run"]) for node in points] == [spot.number for spot in spots]
        assert {int(node.attrib["data-run"]) for node in points if node.get("data-front")} == front_of(spots, quantity)
        for node, spot in zip(points, spots, strict=True):
            assert node.attrib["data-scheme"] == spot.run.scheme
            lines = (node.findtext("{http://www.w3.org/2000/svg}title") or "").splitlines()
            assert lines[0] == f"{spot.number + 1}  {spot.run.name}"
            assert lines[-1] == spot.run.scheme
        assert not [node for node in chart.iter() if "id" in node.attrib]
