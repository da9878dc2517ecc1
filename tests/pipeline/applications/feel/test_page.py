"""The page in a real browser: drag, keys, and what it shows of the force."""

import asyncio
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.applications.feel import coupling as coupling_module
from gudgeon.pipeline.applications.feel.coupling import Coupling, Felt, Scales
from gudgeon.pipeline.applications.feel.device import Browser, Scripted
from gudgeon.pipeline.applications.feel.guard import Guard, Model
from gudgeon.pipeline.applications.feel.loop import run_loop
from gudgeon.pipeline.applications.feel.server import Server
from tests.pipeline.applications.feel.test_passive import wander
from tests.pipeline.applications.feel.tools import felt, tool
from tests.pipeline.browser import chromium

SQUARE = [[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]]
SHOWN = {"name": "plates", "body": "part", "size": 1e-4, "length": 1e4, "force": 5.0, "mass": 10.0,
         "reach": 0.03, "pivot": [0, 0, 0],
         "fixed": [(np.array(SQUARE) - [0, 0, 0.3]).tolist()], "moved": [SQUARE]}  # fmt: skip
RESTS = "new Promise((done) => { const { frames } = feel; setTimeout(() => done(frames === feel.frames), 300); })"
"""Whether a page draws nothing for a while."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as found:
        yield found


@pytest.fixture
def url(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A tool between plates, whose loop and server run in threads. Poses may be late: the machine may be busy."""
    monkeypatch.setattr(coupling_module, "SILENT", 60.0)
    device, stop, ready, place = Browser(), threading.Event(), threading.Event(), []
    coupling = Coupling(tool("attracted"), device, Scales(1e6, 1e4), 1e-3)
    latest: list[Felt] = []

    def state() -> dict[str, Any]:
        felt = latest[0]
        return {"state": felt.state, "tool": felt.tool.tolist(), "period": 1.0, "missed": 0, "truth": None,
                "reserve": float(felt.reserve)}  # fmt: skip

    def found(at: str) -> None:
        place.append(at)
        ready.set()

    device.begin()
    loop = threading.Thread(
        target=run_loop,
        args=(coupling, None),
        kwargs={"stop": stop, "on_tick": lambda _, felt: latest.__setitem__(slice(None), [felt])},
    )
    serving = threading.Thread(target=lambda: asyncio.run(Server(device, SHOWN, state).serve(0, found, stop)))
    for thread in (loop, serving):
        thread.start()
    assert ready.wait(10)
    yield place[0]
    stop.set()
    for thread in (loop, serving):
        thread.join(10)


def test_a_drag_moves_the_tool_and_shows_its_force(url: str, browser: Any) -> None:
    with browser.new_page(viewport={"width": 1000, "height": 600}) as page:
        wrong: list[str] = []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto(url)
        page.wait_for_selector("#state.live", timeout=30_000)
        before = page.evaluate("[...feel.pose]")
        page.mouse.move(300, 300)
        page.mouse.down()
        page.mouse.move(300, 360, steps=5)
        page.mouse.up()
        page.wait_for_function("feel.wrench[2] < -0.01", timeout=30_000)
        assert page.evaluate("feel.pose[2]") < before[2]
        assert page.evaluate("feel.frames") > 0
        page.wait_for_function(RESTS, timeout=30_000)
        page.keyboard.press("Home")
        page.wait_for_function("feel.pose.every((one) => one === 0)", timeout=30_000)
        assert page.locator("#name").text_content() == "plates: part"
        assert wrong == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_narrow_page_has_a_view_to_drag_in(url: str, browser: Any, scheme: str) -> None:
    with browser.new_page(viewport={"width": 390, "height": 844}, color_scheme=scheme) as page:
        page.goto(url)
        page.wait_for_selector("#state.live", timeout=30_000)
        view, aside = page.locator("main canvas").bounding_box(), page.locator("aside").bounding_box()
        assert view["width"] == 390
        assert view["height"] > 400
        assert aside["width"] == 390
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (int(ground.split("(")[1].split(",")[0]) < 40) == (scheme == "dark")
        page.mouse.move(200, 200)
        page.mouse.down()
        page.mouse.move(200, 260, steps=5)
        page.mouse.up()
        page.wait_for_function("feel.wrench[2] < -0.01", timeout=30_000)


def test_the_guard_of_the_page_is_that_of_a_device(url: str, browser: Any) -> None:
    """The same wrenches for the same poses and models, above the start and below it, to round-off."""
    device = Scripted(wander, rate=250.0, delay=0.002)
    models: list[Model] = []
    taken: list[tuple[int, Model]] = []

    class Watched(Guard):
        def sample(self, pose: np.ndarray) -> np.ndarray:
            if self.model is not None and (not models or self.model is not models[-1]):
                models.append(self.model)
                taken.append((len(device.history), self.model))
            return super().sample(pose)

    device.guard = Watched(device.rate, device.force, device.mass)
    device.guard.sample(device.pose)
    felt("repelled", device, 1e6, 1.1)
    frames = dict((at, model.as_json()) for at, model in taken)
    steps = [{"pose": pose.tolist(), "model": frames.get(at)} for at, (_, pose, _, _) in enumerate(device.history)]
    with browser.new_page() as page:
        page.goto(url)
        got = page.evaluate(
            """async ({ steps, rate, force, mass }) => {
                const { Guard } = await import("/guard.js");
                const guard = new Guard(rate, force, mass);
                return steps.map(({ pose, model }) => {
                    guard.model = model ?? guard.model;
                    return [...guard.sample(pose)];
                });
            }""",
            {"steps": steps, "rate": device.rate, "force": device.force, "mass": device.mass},
        )
    expected = np.array([wrench for _, _, wrench, _ in device.history])
    energies = [one.energies[len(one.marks) // 2] for one in models]
    assert min(energies) < 0 < max(energies)
    assert np.abs(expected).max() > 0.01
    assert np.array(got) == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.abs(expected).max())


def test_a_page_takes_over_where_the_one_before_has_left_the_handle(url: str, browser: Any) -> None:
    with browser.new_page() as page:
        page.goto(url)
        page.wait_for_selector("#state.live", timeout=30_000)
        page.evaluate("feel.pose[2] = -0.004")
        page.wait_for_function("Math.hypot(...feel.wrench) > 0.01", timeout=30_000)
        work = page.evaluate("feel.guard.work")
        page.reload()
        page.wait_for_selector("#state.live", timeout=30_000)
        assert page.evaluate("feel.pose[2]") == -0.004
        assert page.evaluate("feel.guard.work") == pytest.approx(work)


def test_a_second_page_takes_the_handle_and_the_first_does_not_come_back(url: str, browser: Any) -> None:
    small = {"width": 400, "height": 300}
    with browser.new_page(viewport=small) as first, browser.new_page(viewport=small) as second:
        first.goto(url)
        first.wait_for_selector("#state.live", timeout=30_000)
        second.goto(url)
        second.wait_for_selector("#state.live", timeout=30_000)
        first.wait_for_function(
            "document.getElementById('state').textContent.includes('another page has the handle')", timeout=30_000
        )
        first.wait_for_timeout(1500)  # A page whose connection is lost tries again after a second.
        assert "another page" in (first.locator("#state").text_content() or "")
        second.wait_for_selector("#state.live", timeout=30_000)
