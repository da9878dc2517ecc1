"""The page in headless Chromium, clicked and typed at by Playwright, at two sizes; nothing leaves the machine."""

import re
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi", reason="the extra 'service' is not installed")
if find_spec("playwright") is None:
    pytest.skip("playwright is not installed", allow_module_level=True)

import gudgeon
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.report import ReportRecord
from gudgeon.pipeline.gudgeon import run, study
from tests.pipeline.browser import chromium
from tests.pipeline.service.serving import TOKEN, served
from tests.pipeline.small import write_scene
from tests.pipeline.studies.cases import thread

SIZES = {"wide": (1366, 900), "narrow": (420, 800)}
REPORT = {
    "scene": "skirt", "choice": {"run": "macneal 8", "tolerance": 0.01},
    "runs": [{"name": f"macneal {count}", "cpu_seconds": 0.1 * count, "conservative_error": 0.3 / count**2,
              "result": "FINISHED"} for count in (4, 8, 16)],
}  # fmt: skip
SOON = 60_000
"""Longest wait for something to appear [ms]."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("page")


@pytest.fixture(scope="module")
def url(folder: Path) -> Iterator[str]:
    """A server with a run, and the modes of a coarser mesh, which have a tag."""
    scene, places = write_scene(folder / "skirt"), {"db": folder / "db", "out": folder / "out"}
    store, inputs = gudgeon.open(folder / "db"), {"stage": "report", "scene": "skirt"}
    store.put(content_key(inputs), "report", ReportRecord(REPORT), inputs)
    run(scene, until="solve", **places)
    coarse = run(scene, until="modes", set={"component.skirt.mesh.size": 0.016}, **places)
    store.tag("coarse", coarse.stages["modes"].keys["skirt"])
    vary = {"body.skirt.velocity.0": [0.1, 0.2], "component.skirt.change.profile.offset": [-2e-5, 0.0, 1e-5]}
    assert study(scene, vary, executor=thread, **places).counts == {"FINISHED": 4, "REFUSED": 2}
    with served(folder / "db") as place:
        yield place


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as found:
        yield found


@pytest.fixture(params=SIZES)
def page(request: pytest.FixtureRequest, browser: Any, url: str) -> Iterator[Any]:
    """The page with the token given; afterwards no complaint must be in its log, and no request to elsewhere."""
    width, height = SIZES[request.param]
    found = browser.new_page(viewport={"width": width, "height": height})
    complaints, asked = [], []
    found.on("console", lambda one: complaints.append(one.text) if one.type == "error" else None)
    found.on("pageerror", lambda error: complaints.append(str(error)))
    found.on("request", lambda one: asked.append(one.url))
    found.goto(url)
    found.wait_for_selector("#login:not([hidden])", timeout=SOON)
    found.fill("#token", TOKEN)
    found.press("#token", "Enter")
    found.wait_for_selector("#records button", timeout=SOON)
    yield found
    found.close()
    assert complaints == []
    assert {one.partition("/page")[0].partition("/default")[0].rstrip("/") for one in asked
            if not one.startswith("data:")} <= {url, f"{url}/health"}  # fmt: skip


def until(page: Any, condition: str, meanwhile: Callable[[], None] = lambda: None) -> None:
    """Wait until an expression is true; the page's policy forbids Playwright's own way, which evaluates texts in it."""
    end = time.monotonic() + SOON / 1000
    while not page.evaluate(condition):
        assert time.monotonic() < end, condition
        meanwhile()
        page.wait_for_timeout(50)


def texts(page: Any, place: str) -> list[str]:
    return page.locator(place).all_inner_texts()


def picture(page: Any) -> str:
    """Return what is drawn now, of the next frame but one: what is set before shows in it."""
    until(page, f"window.gudgeon.views[0].frames > {page.evaluate('window.gudgeon.views[0].frames') + 1}")
    return page.evaluate("document.querySelector('canvas').toDataURL()")


def changed(page: Any, before: str) -> None:
    """Wait until something else is drawn."""
    end = time.monotonic() + SOON / 1000
    while picture(page) == before:
        assert time.monotonic() < end, "nothing else is drawn"


def test_a_search_and_a_click(page: Any) -> None:
    assert len(texts(page, "#records button")) == 14
    page.select_option("select[name=kind]", "modes")
    page.fill("input[name=where]", "material.rho>1000")
    page.click("#search button")
    until(page, "document.querySelectorAll('#records button').length === 2")
    page.fill("input[name=where]", "material.rho>1e6")
    page.press("input[name=where]", "Enter")
    until(page, "document.querySelectorAll('#records button').length === 0")
    page.fill("input[name=where]", "nonsense")
    page.press("input[name=where]", "Enter")
    until(page, "document.getElementById('message').textContent.includes('where')")


def test_a_mode_is_drawn_and_moves(page: Any) -> None:
    page.click("#records button:has-text('coarse')")
    until(page, "window.gudgeon.views[0]?.frames > 5")
    until(page, "document.querySelectorAll('#record svg .bar').length === 8")
    changed(page, picture(page))  # It vibrates.
    page.click("#stop")
    page.evaluate("window.gudgeon.views[0].phase = 0.3")
    still = picture(page)
    page.wait_for_timeout(300)
    assert picture(page) == still
    page.select_option("#mode", "4")
    changed(page, still)
    page.focus("canvas")
    before = page.evaluate("window.gudgeon.views[0].turn.about")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("window.gudgeon.views[0].turn.about") > before
    page.evaluate("window.gudgeon.views[0].phase = 0")  # Still, but for its colours.
    still = picture(page)
    page.select_option("#colour", "stress")
    changed(page, still)
    page.select_option("#colour", "nothing")
    until(page, "window.gudgeon.views[0].uniforms.coloured.value === 0")
    assert page.evaluate("window.gudgeon.views[0].uniforms.coloured.value") == 0
    page.fill("#scale", "0.4")
    amplitude = page.evaluate("window.gudgeon.views[0].uniforms.amplitude.value / window.gudgeon.views[0].radius")
    assert amplitude == pytest.approx(0.4)


def test_two_bases_beside_each_other(page: Any) -> None:
    page.click("#records button:has-text('coarse')")
    page.wait_for_selector("#beside", timeout=SOON)
    page.select_option("#beside", index=1)
    until(page, "window.gudgeon.views.length === 2 && window.gudgeon.views[1].frames > 2")
    page.wait_for_selector("svg[aria-label='MAC matrix'] rect", timeout=SOON)
    assert page.locator("svg[aria-label='MAC matrix'] rect").count() == 64
    page.locator("svg[aria-label='MAC matrix'] rect").nth(8 * 2).click()
    until(page, "document.getElementById('mode').value === '2'")
    page.select_option("#beside", "")
    until(page, "window.gudgeon.views.length === 1")


def test_a_choice_made_while_the_first_part_is_still_on_its_way(page: Any) -> None:
    page.evaluate("""() => {
      const real = window.fetch, later = () => new Promise((go) => setTimeout(go, 500));
      window.fetch = async (place, how) => {
        if (`${place}`.endsWith("/skin")) await later();
        return real(place, how);
      };
    }""")
    page.click("#records button:has-text('coarse')")
    page.wait_for_selector("#beside", timeout=SOON)
    page.select_option("#beside", index=1)
    page.click("#records button:has-text('trajectory')")  # And left before the second one has come.
    page.wait_for_selector("svg[aria-label='contact forces'] path", timeout=SOON)
    assert page.locator("#record svg .bar").count() == 0
    page.click("#records button:has-text('coarse')")
    page.wait_for_selector("#beside", timeout=SOON)
    page.select_option("#beside", index=1)
    page.select_option("#beside", "")
    page.select_option("#beside", index=1)
    until(page, "window.gudgeon.views.length === 2 && window.gudgeon.views[1].frames > 2")
    assert page.locator("#record canvas").count() == 2


def test_a_run_and_where_it_came_from(page: Any) -> None:
    page.click("#records button:has-text('trajectory')")
    page.wait_for_selector("svg[aria-label='contact forces'] path", timeout=SOON)
    page.wait_for_selector("svg .node", timeout=SOON)
    assert page.locator("svg .node").count() == 6  # Scene, mesh, modes, design, run and study.
    assert "bore.impulse" in page.inner_text("#record")
    until(page, "window.gudgeon.views[0]?.frame > 1")
    changed(page, picture(page))  # The film runs; nothing deforms before the part touches.
    page.focus("#film-stop")
    page.keyboard.press("Enter")
    until(page, "!window.gudgeon.views[0].running")
    still, time_shown = picture(page), page.inner_text("#film-time")
    page.wait_for_timeout(500)
    assert (picture(page), page.inner_text("#film-time")) == (still, time_shown)
    page.select_option("#film-colour", "stress")
    until(page, "document.querySelector('#record').textContent.includes('Pa, von Mises')")
    assert re.search(r"0 to [\d.]+ [kM]Pa, von Mises", page.inner_text("#record"))
    chart = page.text_content("svg[aria-label='contact forces']")
    assert re.search(r"time \[[mµ]s\]", chart), chart
    page.locator("svg .node:has-text('scene')").click()
    until(page, "document.querySelector('#search input[name=scene]').value === 'skirt'")
    until(page, "document.querySelectorAll('#records button').length === 13")  # All but the report.
    page.locator("svg .node:has-text('modes')").click()
    until(page, "document.querySelector('#record h2').textContent.startsWith('modes')")
    page.go_back()
    until(page, "document.querySelector('#record h2').textContent.startsWith('trajectory')")


def test_a_report(page: Any) -> None:
    page.click("#records button:has-text('report')")
    page.wait_for_selector("svg[aria-label='error over run time'] circle", timeout=SOON)
    assert page.locator("svg[aria-label='error over run time'] circle").count() == 3
    assert "cheapest setting within the tolerance: macneal 8" in page.inner_text("#record")


def test_a_study(page: Any) -> None:
    """Its table and its picture: quantities over parameters with stated errors, and a way to each run."""
    page.click("#records button:has-text('study')")
    page.wait_for_selector("svg[aria-label='quantity over parameter'] circle", timeout=SOON)
    assert page.locator("svg[aria-label='quantity over parameter'] circle").count() == 4
    assert page.input_value("#study-quantity") == "bore.force_peak [N]"
    assert page.input_value("#study-lines") == "component.skirt.change.profile.offset"
    assert page.locator("svg[aria-label='quantity over parameter'] path[fill=none][stroke-width='1.3']").count() == 2
    assert "6 designs: 4 FINISHED, 2 REFUSED" in page.inner_text("#record")
    assert page.locator("#record tbody tr").count() == 6
    page.select_option("#study-quantity", "bore.impulse [N s]")
    page.select_option("#study-over", "component.skirt.change.profile.offset")
    until(page, "document.querySelector('#record svg.chart').textContent.includes('bore.impulse')")
    columns = page.locator("#record thead th").count()
    page.focus("#study-all")
    page.keyboard.press("Space")
    assert page.locator("#record thead th").count() > columns + 10
    page.locator("svg[aria-label='quantity over parameter'] .bar").first.focus()
    page.keyboard.press("Enter")
    until(page, "document.querySelector('#record h2').textContent.startsWith('trajectory')")
    page.go_back()
    page.wait_for_selector("#record tbody button", timeout=SOON)
    page.locator("#record tbody button").last.click()
    until(page, "document.querySelector('#record h2').textContent.startsWith('trajectory')")


def test_the_raw_tree(page: Any) -> None:
    """Groups unfold, arrays show their attributes and numbers, those that the server has."""
    pytest.importorskip("h5grove", reason="h5grove is not installed")
    page.click("#records button:has-text('coarse')")
    page.wait_for_selector("#tree", timeout=SOON)
    page.focus("#tree > summary")
    page.keyboard.press("Enter")
    page.wait_for_selector(".tree button:has-text('shapes')", timeout=SOON)
    page.click(".tree summary:has-text('interfaces')")
    page.click(".tree summary:has-text('thrust')")
    page.wait_for_selector(".tree button:has-text('rows')", timeout=SOON)
    page.click(".tree button:has-text('shapes')")
    page.wait_for_selector("#tree-shown td.number", timeout=SOON)
    assert "kg^-0.5" in page.inner_text("#tree-shown")
    before = texts(page, "#tree-shown td.number")
    assert len(before) == 12 * 8
    page.fill("#tree-shown input[aria-label='first row']", "5")
    page.press("#tree-shown input[aria-label='first row']", "Tab")
    until(page, "document.querySelector('#tree-shown .scroll tr:nth-child(2) th')?.textContent === '5'")
    assert texts(page, "#tree-shown td.number")[: 8 * 7] == before[8 * 5 :]
    page.click(".tree button:has-text('attributes of the file')")
    until(page, "document.getElementById('tree-shown').textContent.includes('encoding-type')")
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_a_command_that_runs(page: Any, folder: Path) -> None:
    store = gudgeon.open(folder / "db")
    row = {"command": "study", "scene": "skirt", "stage": "study", "share": 0.25, "begun": time.time(), "host": "here"}
    # As commands do, again and again: one that is silent is taken for dead.
    shown = "document.getElementById('running').textContent.startsWith('study skirt: study 25 %')"
    until(page, shown, lambda: store.tell("a" * 32, row))
    store.tell("a" * 32, None)
    until(page, "document.getElementById('running').children.length === 0")


def test_a_refusal_that_comes_after_the_token(browser: Any, url: str) -> None:
    found = browser.new_page()
    found.add_init_script("""
      const real = window.fetch, later = () => new Promise((go) => setTimeout(go, 1500));
      window.fetch = async (place, how) => {
        const answer = await real(place, how);
        if (answer.status === 401) await later();
        return answer;
      };
    """)
    found.goto(url)
    found.wait_for_selector("#login:not([hidden])", timeout=SOON)
    for token in ("another", TOKEN):
        found.fill("#token", token)
        found.press("#token", "Enter")
        found.wait_for_timeout(200)
        found.evaluate("document.getElementById('login').hidden = false")
    found.press("#token", "Enter")
    found.wait_for_selector("#records button", timeout=SOON)
    found.wait_for_timeout(2500)
    assert found.evaluate("document.getElementById('login').hidden")
    found.close()


def test_arrow_keys_walk_the_list_after_a_click(page: Any) -> None:
    page.locator("#records button").nth(2).click()
    until(page, "document.body.dataset.ready.length === 64")
    walked = "[...document.querySelectorAll('#records button')].indexOf(document.activeElement)"
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    assert page.evaluate(walked) == 4
    page.keyboard.press("Enter")
    until(page, "document.querySelectorAll('#records button')[4].getAttribute('aria-current') === 'true'")
    page.wait_for_selector("#tree", timeout=SOON, state="attached")
    page.keyboard.press("ArrowUp")
    assert page.evaluate(walked) == 3
    page.keyboard.press("ArrowRight")
    assert page.evaluate("document.activeElement.id") == "record"


def test_dark(page: Any) -> None:
    """Texts on their grounds keep a contrast of 4.5 in both schemes."""
    page.click("#records button:has-text('trajectory')")
    page.wait_for_selector("svg[aria-label='contact forces'] path", timeout=SOON)
    contrast = """() => {
      const light = (colour) => {
        const linear = (c) => (c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
        const [r, g, b] = colour.match(/[\\d.]+/g).map((c) => linear(c / 255));
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
      };
      const ratio = (one, other) => (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
      const ground = light(getComputedStyle(document.body).backgroundColor);
      const curve = document.querySelector("svg.chart path[stroke-width='1.3']");
      const colours = [getComputedStyle(curve).stroke, ...["h2", ".faint", "label", "svg text"].map((name) => {
        const style = getComputedStyle(document.querySelector(name));
        return name === "svg text" ? style.fill : style.color;
      })];
      return [ground, Math.min(...colours.map((colour) => ratio(light(colour), ground)))];
    }"""
    page.emulate_media(color_scheme="light")
    bright, least = page.evaluate(contrast)
    assert bright > 0.9
    assert least > 4.5
    page.emulate_media(color_scheme="dark")
    dark, least = page.evaluate(contrast)
    assert dark < 0.05
    assert least > 4.5


def test_by_keyboard_alone(page: Any) -> None:
    page.focus("#records button")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    until(page, "document.querySelector('#record h2')?.textContent.startsWith('trajectory')")
    page.locator("svg .node:has-text('modes')").focus()
    page.keyboard.press("Enter")
    until(page, "document.querySelector('#record h2').textContent.startsWith('modes')")


def test_nothing_is_wider_than_the_window(page: Any) -> None:
    for kind in ("modes", "trajectory", "mesh", "report", "study"):
        page.locator(f"#records button:has-text('{kind}')").first.click()
        until(page, f"document.querySelector('#record h2')?.textContent.startsWith('{kind}')")
        page.wait_for_selector("svg .node", timeout=SOON)
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
