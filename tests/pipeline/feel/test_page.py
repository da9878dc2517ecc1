"""The page in a real browser: drag, keys, and what it shows of the force."""

import asyncio
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.feel.coupling import Coupling, Felt, Scales
from gudgeon.pipeline.feel.loop import run_loop
from gudgeon.pipeline.feel.server import Browser, Server
from tests.pipeline.browser import chromium
from tests.pipeline.feel.tools import tool

SQUARE = [[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]]
SHOWN = {"name": "plates", "body": "part", "size": 1e-4, "length": 1e4, "force": 5.0, "reach": 0.03, "pivot": [0, 0, 0],
         "fixed": [(np.array(SQUARE) - [0, 0, 0.3]).tolist()], "moved": [SQUARE]}  # fmt: skip


@pytest.fixture
def url() -> Iterator[str]:
    """A tool between plates, whose loop and server run in threads."""
    device, stop, ready, place = Browser(), threading.Event(), threading.Event(), []
    coupling = Coupling(tool("attracted"), device, Scales(1e6, 1e4), 1e-3)
    latest: list[Felt] = []

    def state() -> dict[str, Any]:
        felt = latest[0]
        return {"wrench": device.wrench.tolist(), "state": felt.state, "tool": felt.tool.tolist(), "period": 1.0,
                "missed": 0, "truth": None, "reserve": float(felt.reserve)}  # fmt: skip

    def found(at: str) -> None:
        place.append(at)
        ready.set()

    device.begin()
    loop = threading.Thread(
        target=run_loop,
        args=(coupling, None),
        kwargs={"stop": stop, "told": lambda _, felt: latest.__setitem__(slice(None), [felt])},
    )
    serving = threading.Thread(target=lambda: asyncio.run(Server(device, SHOWN, state).serve(0, found, stop)))
    for thread in (loop, serving):
        thread.start()
    assert ready.wait(10)
    yield place[0]
    stop.set()
    for thread in (loop, serving):
        thread.join(10)


def test_a_drag_moves_the_tool_and_shows_its_force(url: str) -> None:
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1000, "height": 600})
        wrong: list[str] = []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto(url)
        page.wait_for_selector("#state.live", timeout=30_000)
        before = page.evaluate("[...feel.pose]")
        page.mouse.move(300, 300)
        page.mouse.down()
        page.mouse.move(300, 360, steps=5)
        page.mouse.up()
        page.wait_for_function("Math.hypot(...feel.wrench) > 0.01", timeout=30_000)
        assert page.evaluate("feel.pose[2]") < before[2]
        assert page.evaluate("feel.wrench[2]") < 0
        page.keyboard.press("Home")
        page.wait_for_function("feel.pose.every((one) => one === 0)", timeout=30_000)
        assert page.locator("#name").text_content() == "plates: part"
        assert wrong == []


def test_a_second_page_takes_the_handle_and_the_first_does_not_come_back(url: str) -> None:
    with chromium() as browser:
        first, second = browser.new_page(), browser.new_page()
        first.goto(url)
        first.wait_for_selector("#state.live", timeout=30_000)
        second.goto(url)
        second.wait_for_selector("#state.live", timeout=30_000)
        first.wait_for_function(
            "document.getElementById('state').textContent.includes('another page has the handle')", timeout=30_000
        )
        first.wait_for_timeout(1500)  # A page whose connection is lost tries again after a second.
        assert "another page" in (first.locator("#state").text_content() or "")
        assert second.locator("#state.live").count() == 1
