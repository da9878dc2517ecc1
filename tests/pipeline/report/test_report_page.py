"""The page of a report: whole in one file, read by headless Chromium without network and without a complaint.

`make test` installs Chromium where there is apt; elsewhere a machine without it skips what needs it.
"""

import itertools
import json
import math
import re
import shutil
import subprocess
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from gudgeon.pipeline.cli.doctor import BROWSERS
from gudgeon.pipeline.report.document import Budget, Cost, Document, Term
from gudgeon.pipeline.report.front import pareto_front
from gudgeon.pipeline.report.page.page import page
from gudgeon.pipeline.report.page.picture import FRAMES
from gudgeon.pipeline.report.page.words import headline
from tests.pipeline import documents
from tests.pipeline.browser import chromium
from tests.pipeline.documents import BITING

DOCUMENTS = {name: getattr(documents, name) for name in ("small", "large", "biting", "unmatched", "infinite")}
CONSOLE = re.compile(r":CONSOLE[:(]\d+[)]?\] (.*)$", re.MULTILINE)
"""What a page writes to the console, uncaught errors and refused loads among it, as Chromium logs it."""


class Elements(HTMLParser):
    """Every element of a page with its attributes, and the text of tables' rows."""

    def __init__(self, text: str, frame: str = "wide") -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str]]] = []
        self.texts: list[str] = []
        self._drawn: list[dict[str, str]] = []
        self._frame, self._chart, self._shown = frame, True, True
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = {key: value or "" for key, value in attrs}
        self.found.append((tag, attributes))
        kinds = attributes.get("class", "").split()
        if "chart" in kinds:
            self._chart = "hidden" not in attributes
        if {"wide", "narrow"} & set(kinds):
            self._shown = self._chart and self._frame in kinds
        if "point" in kinds and "off" not in kinds and self._shown:
            self._drawn.append(attributes)

    def handle_data(self, data: str) -> None:
        self.texts.append(data)

    def points(self) -> list[dict[str, str]]:
        """Return the attributes of the runs that the chart shows in one of its widths."""
        return self._drawn


@pytest.fixture(scope="module")
def browser() -> str:
    """Return Chromium, which must be there where `make test` could have installed it."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None and shutil.which("apt-get") is None:
        pytest.skip("no Chromium here, and no apt to install it by")
    assert found is not None, "Chromium is missing: run `make test`, or apt-get install chromium"
    return found


def browse(browser: str, text: str, folder: Path, address: str = "") -> tuple[str, list[str]]:
    """Return the document of a page after its script, and what it wrote to the console; no name is resolved."""
    (folder / "report.html").write_text(text, encoding="utf-8")
    options = (
        "--headless", "--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP * ~NOTFOUND",
        "--enable-logging=stderr", "--v=0", "--virtual-time-budget=2000", f"--user-data-dir={folder / 'profile'}",
        "--window-size=1200,900", "--dump-dom",
    )  # fmt: skip
    child = subprocess.run(
        [browser, *options, f"{(folder / 'report.html').as_uri()}{address}"],
        capture_output=True, text=True, errors="replace", timeout=120,
    )  # fmt: skip
    assert child.returncode == 0, child.stderr
    return child.stdout, CONSOLE.findall(child.stderr)


def with_errors(document: Document, quantity: str = "") -> list[int]:
    """Return the numbers of the runs that have a finite error, the largest or that of a quantity."""
    errors = [run.errors.get(quantity) if quantity else run.largest_error for run in document.runs]
    return [number for number, error in enumerate(errors) if error is not None and math.isfinite(error)]


@pytest.mark.parametrize("name", DOCUMENTS)
def test_opens_without_network_or_complaint(name: str, browser: str, tmp_path: Path) -> None:
    """The script draws every run that has an error, and the front that the document states."""
    document = DOCUMENTS[name]()
    shown, console = browse(browser, page(document), tmp_path)
    assert console == []
    points = Elements(shown).points()
    assert [int(point["data-run"]) for point in points] == with_errors(document)
    assert {int(point["data-run"]) for point in points if "data-front" in point} == {
        number for number, run in enumerate(document.runs) if run.front
    }
    assert f'data-points="{len(points)}"' in shown


def test_quantity_is_picked_by_the_address(browser: str, tmp_path: Path) -> None:
    """Points are those of the quantity, the front is its own, and larger errors stand higher."""
    document = documents.large()
    shown, console = browse(browser, page(document), tmp_path, "#q=chatter")
    assert console == []
    points = Elements(shown).points()
    chosen = with_errors(document, "chatter")
    assert 0 < len(chosen) < len(with_errors(document))
    assert [int(point["data-run"]) for point in points] == chosen
    plane = [(document.runs[i].cpu_seconds, abs(document.runs[i].errors["chatter"])) for i in chosen]
    best = {chosen[i] for i in pareto_front(plane)}
    assert {int(point["data-run"]) for point in points if "data-front" in point} == best
    chart = shown[
        shown.index('data-quantity="chatter"') : shown.index("</svg>", shown.index('data-quantity="chatter"'))
    ]
    places = re.findall(r'<g[^>]*class="point.*?translate\(\S+ ([\d.]+)\)', chart, re.DOTALL)
    order = sorted(range(len(chosen)), key=lambda i: plane[i][1])
    assert [float(places[i]) for i in order] == sorted(map(float, places), reverse=True)


def test_address_that_names_nothing(browser: str, tmp_path: Path) -> None:
    for address in ("#q=nothing", "#q=%E0%A4%A"):
        shown, console = browse(browser, page(documents.small()), tmp_path, address)
        assert console == []
        assert len(Elements(shown).points()) == 2
        assert "3: reference, 31 s" in shown


CLICKS = """<script>
document.querySelector('ul.legend button[data-hides="full FE"]').click();
document.querySelector('#runs thead th:nth-child(3) [role=button]').click();
document.querySelector('.point:not(.off)').dispatchEvent(new PointerEvent("pointerenter"));
</script></body>"""


def test_schemes_turn_off_and_columns_sort(browser: str, tmp_path: Path) -> None:
    document = documents.large()
    shown, console = browse(browser, page(document).replace("</body>", CLICKS), tmp_path)
    assert console == []
    left = [i for i in with_errors(document) if document.runs[i].kind != "nodal"]
    assert [int(point["data-run"]) for point in Elements(shown).points()] == left
    body = shown[shown.index('id="runs"') : shown.index('id="errors"')]
    rows = [int(number) for number in re.findall(r'<tr data-run="(\d+)"', body)]
    sizes = [document.runs[i].largest_error for i in rows]
    failed = sizes.count(None)
    assert failed > 0
    assert sizes[-failed:] == [None] * failed
    assert sizes[:-failed] == sorted(size for size in sizes if size is not None)
    tip = re.search(r'<div id="tip"[^>]*>.*?</div>', shown)
    assert tip
    marked = re.findall(r'<tr data-run="(\d+)" class="[^"]*marked', shown)
    assert marked == [str(left[0])]
    assert f"<strong>{left[0] + 1}  {document.runs[left[0]].name}</strong>" in tip[0]
    assert "hidden" not in tip[0]


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('"use strict";', '"use strict"; nowhere();', "nowhere is not defined"),
        ("</main>", '</main><img src="https://example.org/a.png">', "Content Security Policy"),
        ('id="runs"', 'id="walks"', "Uncaught TypeError"),
    ],
)
def test_errors_of_a_page_are_noticed(old: str, new: str, complaint: str, browser: str, tmp_path: Path) -> None:
    text = page(documents.small())
    assert old in text
    _, console = browse(browser, text.replace(old, new), tmp_path)
    assert any(complaint in line for line in console)


@pytest.mark.parametrize("name", DOCUMENTS)
def test_chart_stands_there_without_script(name: str) -> None:
    document = DOCUMENTS[name]()
    text = page(document)
    for frame in FRAMES:
        assert len(Elements(text, frame).points()) == len(with_errors(document))
    assert ("3: reference, 31 s" in text) == (name == "small")


def test_whole_in_one_file() -> None:
    """Nothing is loaded: no address but of embedded pictures, and a policy that forbids any other."""
    text = page(documents.large(), b"\x89PNG")
    found = Elements(text).found
    addresses = [
        value
        for tag, attributes in found
        for key, value in attributes.items()
        if key in ("src", "href", "action", "data", "poster", "srcset", "xlink:href") and tag != "meta"
    ]
    assert addresses == ["data:image/png;base64,iVBORw=="]
    assert "url(" not in text
    assert "@import" not in text
    assert not [tag for tag, _ in found if tag in ("link", "iframe", "object", "embed", "base")]
    assert ("default-src 'none'") in next(a["content"] for _, a in found if "http-equiv" in a)


def test_texts_of_a_scene_stay_texts() -> None:
    """Names that try to end their element or attribute are read as names, and come back from the embedded data."""
    text = page(documents.biting())
    found = Elements(text)
    count = Counter(tag for tag, _ in found.found)
    plain = Counter(tag for tag, _ in Elements(page(documents.small())).found)
    assert count["script"] == plain["script"] == 2
    assert count["b"] == 0
    assert not [attributes for _, attributes in found.found if any(key.startswith("on") for key in attributes)]
    assert "".join(found.texts).count(BITING) > 10
    data = re.search(r'<script type="application/json" id="report-data">(.*?)</script>', text, re.DOTALL)
    assert data
    assert json.loads(data[1]) == documents.biting().as_json()


def test_says_what_an_engineer_asks() -> None:
    document = documents.large()
    text = "".join(Elements(page(document)).texts)
    assert document.choice is not None
    for wanted in (
        document.choice.why,
        "d'Alembert's solution",
        "gudgeon report data/rod --tolerance 1%",
        "does not converge over this sweep: not fitted",
        "differences grow from 20 to 40 modes",
        "a law has no exact motion between events",
        "Least of 3 runs",
        "20 µm barrel",
        "what comes later is chaotic",
        "filtered with a Hann window of 40 µs",
        "DIVERGED",
    ):
        assert wanted in text, wanted


def test_numbers_are_those_of_the_document() -> None:
    text = page(documents.small())
    rows = re.findall(r'<tr data-run="\d+".*?</tr>', text, re.DOTALL)
    first = re.findall(r'data-value="([^"]*)"', rows[0])
    assert first[:6] == ["1", "36", "0.0082", "impulse", "0.05", "0.05500000000000001"]
    assert "−0.82%" in text


def test_labels_of_what_is_used_by_hand() -> None:
    """Every control has a name, every drawing a description, every column a scope."""
    found = Elements(page(documents.large())).found
    labels = {attributes["for"] for tag, attributes in found if tag == "label"}
    for tag, attributes in found:
        if tag == "select":
            assert attributes["id"] in labels
        if tag == "svg":
            assert attributes.get("aria-label") or attributes.get("aria-hidden") == "true"
        if tag == "th":
            assert attributes["scope"] in ("row", "col")
        if tag == "img":
            assert attributes["alt"]


FITS = """() => {
  const chart = document.querySelector(".chart:not([hidden])");
  const texts = [...chart.querySelectorAll("svg text")].map((one) => one.getBoundingClientRect());
  const drawn = texts.filter((one) => one.width > 0);
  return [document.documentElement.scrollWidth - innerWidth, chart.scrollWidth - chart.clientWidth,
    Math.min(...drawn.map((one) => one.height)), Math.max(...drawn.map((one) => one.right)) - innerWidth];
}"""
LEAST_TEXT = 9
"""Height of a line of the smallest text of a chart [px]."""


WIDTHS = (360, 390, 720, 721, 960, 1280)


def test_page_and_chart_fit_the_screen(tmp_path: Path) -> None:
    """Nothing is scrolled sideways, texts of the chart can be read, and every run is drawn once."""
    (tmp_path / "report.html").write_text(page(documents.large()), encoding="utf-8")
    with chromium() as browser:
        for width, scheme in itertools.product(WIDTHS, ("light", "dark")):
            screen = browser.new_page(viewport={"width": width, "height": 844}, color_scheme=scheme)
            screen.goto((tmp_path / "report.html").as_uri())
            beside, within, least, right = screen.evaluate(FITS)
            drawn = screen.evaluate("() => document.documentElement.dataset.points")
            screen.close()
            assert (beside, within) == (0, 0), width
            assert right <= 0, width
            assert least >= LEAST_TEXT, width
            assert int(drawn) == len(with_errors(documents.large())), width


ROW = """<script>
document.querySelector('#runs tr[data-run="1"]').dispatchEvent(new PointerEvent("pointerenter"));
</script></body>"""


def test_row_of_the_table_shows_its_point(browser: str, tmp_path: Path) -> None:
    """The point and its number in both widths and the row are marked, nothing else is; the tip says what the run is."""
    shown, console = browse(browser, page(documents.small()).replace("</body>", ROW), tmp_path, "#q=impulse")
    assert console == []
    marked = [attributes for _, attributes in Elements(shown).found if "marked" in attributes.get("class", "").split()]
    assert [attributes["data-run"] for attributes in marked] == ["1"] * 5
    assert [a["data-run"] for frame in FRAMES for a in Elements(shown, frame).points() if "marked" in a["class"]] == [
        "1", "1"
    ]  # fmt: skip
    tip = re.search(r'<div id="tip"[^>]*>.*?</div>', shown)
    assert tip
    assert "<strong>2  60 modes</strong><span>0.31% impulse</span>" in tip[0]


def test_headline_says_what_was_gained() -> None:
    plain = documents.large()
    assert plain.choice is not None
    tolerance = plain.choice.tolerance

    def head(full: float | None) -> str:
        costs = [Cost(tolerance, "reduced", "a run", 0.004, 0.01)]
        costs += [] if full is None else [Cost(tolerance, "nodal", "full FE", 0.01, full)]
        return headline(replace(plain, costs=costs))

    assert head(7.4).endswith(" accuracy in 7.28 ms: 740 × less CPU time than full FE")
    assert head(0.005).endswith(" accuracy in 7.28 ms: full FE takes 5 ms, nothing is gained")
    assert head(None).endswith(" accuracy in 7.28 ms")
    assert headline(documents.small()) == "rod: error against run time"

    def with_layer(size: float | None, run: str | None = plain.choice.run) -> str:
        terms = [Term("step", "", size=1e-4, of="impulse"), Term("contact layer", "", size=size, of="pressure_peak")]
        return headline(replace(plain, costs=[], budget=Budget(run or "", terms)))

    assert with_layer(0.41).endswith(" accuracy in 7.28 ms; but contact layer ±41.00% (pressure_peak)")
    assert with_layer(0.9 * tolerance).endswith(" accuracy in 7.28 ms")
    assert with_layer(0.41, "another").endswith(" accuracy in 7.28 ms")
    text = page(plain)
    assert text.index("gudgeon run data/rod --tolerance 5%") < text.index("<svg")


def test_the_front_stands_before_all_runs() -> None:
    text = page(documents.large())
    front = text[text.index("Runs on the front") : text.index('<details class="words"')]
    assert front.count("<tr") == 1 + sum(run.front for run in documents.large().runs)
