"""The picture of a report, the front, and where numbers of points stand."""

from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib import image
from matplotlib.path import Path as MplPath
from matplotlib.transforms import Bbox

from gudgeon.pipeline.report.document import Choice, Cost
from gudgeon.pipeline.report.front import pareto_front, with_front
from gudgeon.pipeline.report.page.labels import BOX, labels, places
from gudgeon.pipeline.report.page.picture import GREY, LEAST, draw, drawn, error_chart, floor_of, front_of, looks
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
    important = [int(i == 20) for i in range(64)]
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
    assert all(shift is not None for shift in places([(0.0, 0.0), (90.0, 0.0)], ["1", "2"], [0, 0]))


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


def test_texts_stay_within_the_axes() -> None:
    """A text of a point in the right upper corner stands to its left and below."""
    (shift,) = places([(95.0, 45.0)], ["abcd"], [2], within=Bbox([(0.0, 0.0), (100.0, 50.0)]))
    assert shift is not None
    assert shift[0] < -BOX[0] * 4
    assert shift[1] < -BOX[1]
    assert places([(95.0, 45.0)], ["a" * 40], [0], within=Bbox([(0.0, 0.0), (100.0, 50.0)])) == [None]


def test_four_runs_of_the_chart_say_what_they_are() -> None:
    """The choice, the fastest full FE and rival within the tolerance, and the most accurate setting; error and time."""
    runs = [
        documents.run("60 modes", 0.004, 0.2),
        documents.run("200 modes", 1e-4, 1.0),
        documents.run("10 modes", 0.2, 0.05),
        documents.run("rival, coarse", 0.02, 0.6, scheme="penalty"),
        documents.run("rival, fine", 0.006, 0.8, scheme="penalty"),
        documents.run("full FE, 4 µs", 0.008, 90.0, kind="nodal"),
        documents.run("full FE, 1 µs", 0.001, 300.0, kind="nodal"),
        documents.run("failed", None, 0.1),
    ]
    choice = Choice(0.01, "60 modes", {}, 0.004, "impulse", 0.2, "the cheapest")
    costs = [Cost(0.01, "rival", "rival, fine", 0.006, 0.8)]
    document = documents.document(runs, [documents.quantity("impulse")], choice=choice, costs=costs)
    assert labels(document) == {
        "60 modes": "gudgeon", "200 modes": "most accurate", "rival, fine": "rival", "full FE, 4 µs": "full FE",
    }  # fmt: skip
    chart = ElementTree.fromstring(error_chart(document))
    told = [text for node in chart.iter() if (text := node.text or "").count(": ") and text[0].isdigit()]
    assert sorted(told) == [
        "1  gudgeon: 0.40%, 0.2 s", "2  most accurate: 1.0e-04, 1 s", "5  rival: 0.60%, 0.8 s",
        "6  full FE: 0.80%, 90 s",
    ]  # fmt: skip


def test_a_label_crosses_no_line_where_there_is_room() -> None:
    """Without a line it stands right of its point, above; a line there sends it below, and lines beside to the left."""
    (free,) = places([(0.0, 0.0)], ["abcd"], [2])
    (below,) = places([(0.0, 0.0)], ["abcd"], [2], lines=[MplPath([(0.0, 0.0), (100.0, 20.0)])])
    (aside,) = places(
        [(0.0, 0.0)], ["abcd"], [2], lines=[MplPath([(0.0, 0.0), (40.0, rise)]) for rise in (10.0, -10.0)]
    )
    assert free is not None
    assert below is not None
    assert aside is not None
    assert free[0] > 0 <= free[1]
    assert below != free
    assert aside[0] < 0
    assert places([(0.0, 0.0)], ["1"], [0], lines=[MplPath([(0.0, 0.0), (100.0, 1.0)])]) == places(
        [(0.0, 0.0)], ["1"], [0]
    )


def test_a_label_keeps_off_the_line_of_the_tolerance(monkeypatch: pytest.MonkeyPatch) -> None:
    """The choice just below it has its label below its point, where it would else stand on the line."""
    shifts: dict[str, tuple[float, float] | None] = {}

    def kept(points, texts, *rest):  # type: ignore[no-untyped-def]
        shifts.update(zip(texts, found := places(points, texts, *rest), strict=True))
        return found

    monkeypatch.setattr("gudgeon.pipeline.report.page.picture.places", kept)
    runs = [documents.run("a", 0.5, 0.01), documents.run("b", 0.0065, 0.1), documents.run("c", 1e-5, 9.0)]
    choice = Choice(0.01, "b", {}, 0.0065, "impulse", 0.1, "the cheapest")
    error_chart(documents.document(runs, [documents.quantity("impulse")], choice=choice))
    (shift,) = [shift for text, shift in shifts.items() if "gudgeon" in text]
    assert shift is not None
    assert shift[1] < 0


def test_without_full_fe_and_rival_the_fastest_run_on_the_front_has_a_label() -> None:
    """And of runs without a tolerance, the fastest within 1 %."""
    runs = with_front([documents.run("a", 0.5, 0.01), documents.run("b", 0.005, 0.1), documents.run("c", 1e-5, 9.0)])
    found = labels(documents.document(runs, [documents.quantity("impulse")]))
    assert found == {"b": "gudgeon", "c": "most accurate", "a": "fastest"}
