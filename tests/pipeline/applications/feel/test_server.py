"""The page's server: files, messages of the page, who is refused, who has the handle; scripts."""

import asyncio
import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus
from websockets.frames import Close, Frame, Opcode
from websockets.typing import Origin

from gudgeon.pipeline.applications.feel.device import Browser
from gudgeon.pipeline.applications.feel.loop import urgent
from gudgeon.pipeline.applications.feel.server import TAKEN, Server
from gudgeon.pipeline.applications.feel.session import Asked, check_asked, scripted
from gudgeon.pipeline.errors import InputError


def masked(content: bytes) -> bytes:
    return Frame(Opcode.TEXT, content).serialize(mask=True)


async def asked(port: int, *lines: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter, str]:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(("\r\n".join(lines) + "\r\n\r\n").encode())
    return reader, writer, (await reader.readuntil(b"\r\n\r\n")).decode()


def test_page_and_socket() -> None:
    browser, stop = Browser(), threading.Event()
    server = Server(browser, {"name": "part"}, lambda: {"tool": [1.0] * 6})

    async def talk() -> None:
        started = asyncio.Event()
        task = asyncio.create_task(server.serve(0, lambda place: started.set(), stop))
        await started.wait()
        host = f"Host: 127.0.0.1:{server.port}"
        for path, kind in (("/", "text/html"), ("/feel.js", "javascript"), ("/vendor/three.module.js", "javascript")):
            _, writer, head = await asked(server.port, f"GET {path} HTTP/1.1", host)
            assert head.startswith("HTTP/1.1 200")
            assert kind in head.lower().partition("content-type: ")[2].partition("\r\n")[0]
            assert "cache-control: no-store" in head.lower()
            writer.close()
        reader, _, head = await asked(server.port, "GET /scene HTTP/1.1", host)
        assert json.loads(await reader.read()) == {"name": "part"}
        for line, status in (("GET /../x HTTP/1.1", 404), ("GET /none.js HTTP/1.1", 404), ("POST / HTTP/1.1", 405)):
            assert (await asked(server.port, line, host))[2].startswith(f"HTTP/1.1 {status}")
        for more in (("Host: evil.test",), (host, "Origin: http://evil.test")):
            for path in ("/", "/ws", "/scene", "/feel.js"):
                assert (await asked(server.port, f"GET {path} HTTP/1.1", *more))[2].startswith("HTTP/1.1 403")
        place = f"ws://127.0.0.1:{server.port}/ws"
        with pytest.raises(InvalidStatus, match="403"):
            await connect(place, proxy=None, origin=Origin("http://evil.test"))
        page = await connect(place, proxy=None, origin=Origin(f"http://127.0.0.1:{server.port}"))
        assert json.loads(await page.recv()) == {"tool": [1.0] * 6, "model": None, "pose": [0.0] * 6, "work": 0.0}
        await page.send('{"pose": [1, 2, 3, 0, 0, 0.5], "work": 0.25}')
        await asyncio.sleep(0.1)
        got = browser.read(0.0)
        assert got is not None
        assert got.pose.tolist() == [1, 2, 3, 0, 0, 0.5]
        assert got.work == 0.25
        huge = f"1{'0' * 400}"
        for text in ("[", '{"pose": [1, 2]}', '{"pose": "x"}', "[" * 60_000,
                     f'{{"pose": [{huge}, 0, 0, 0, 0, 0], "work": 0}}',
                     f'{{"pose": [0, 0, 0, 0, 0, 0], "work": {huge}}}'):  # fmt: skip
            await page.send(text)
            await asyncio.sleep(0.05)
            got = browser.read(0.0)
            assert got is not None
            assert np.isnan(got.pose).all()
        stop.set()
        await task

    asyncio.run(asyncio.wait_for(talk(), 20))


def test_the_page_that_came_last_has_the_handle() -> None:
    """Poses of the page before are not taken any more, also where it ignores that its socket is closed."""
    browser, stop = Browser(), threading.Event()
    server = Server(browser, {}, lambda: {})
    pose = b'{"pose": [%d, 0, 0, 0, 0, 0], "work": %d}'

    def first() -> float:
        got = browser.read(0.0)
        assert got is not None
        return float(got.pose[0])

    async def talk() -> None:
        started = asyncio.Event()
        task = asyncio.create_task(server.serve(0, lambda place: started.set(), stop))
        await started.wait()
        lines = ("GET /ws HTTP/1.1", f"Host: 127.0.0.1:{server.port}", "Upgrade: websocket", "Connection: Upgrade",
                 "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==")  # fmt: skip
        older, old, _ = await asked(server.port, *lines)
        old.write(masked(pose % (1, 1)))
        await asyncio.sleep(0.1)
        assert first() == 1.0
        _, new, _ = await asked(server.port, *lines)
        new.write(masked(pose % (2, 2)))
        await asyncio.sleep(0.1)
        for _ in range(1000):  # More than the server reads at once: bytes unread would reset the socket.
            old.write(masked(pose % (3, 3)))
            await asyncio.sleep(0)
        closing = Frame(Opcode.CLOSE, Close(TAKEN, "another page has the handle").serialize()).serialize(mask=False)
        told = b""
        while closing not in told:
            told += await older.readexactly(1)
        assert first() == 2.0
        got = browser.read(0.0)
        assert got is not None
        assert got.work == 2.0
        new.write(masked(pose % (4, 4)))
        await asyncio.sleep(0.1)
        assert first() == 4.0
        stop.set()
        await task

    asyncio.run(asyncio.wait_for(talk(), 20))


@pytest.mark.skipif(not hasattr(os, "sched_getscheduler"), reason="no such priorities on this system")
def test_urgent_is_for_a_thread_and_what_it_starts_and_for_a_while() -> None:
    policies = [os.sched_getscheduler(0)]
    thread = threading.Thread(target=lambda: policies.append(os.sched_getscheduler(0)))
    with urgent():
        policies.append(os.sched_getscheduler(0))
        thread.start()
        thread.join()
    usual, raised, inherited = policies
    assert raised == inherited == (os.SCHED_FIFO if may_be_urgent() else usual)
    assert os.sched_getscheduler(0) == usual


def may_be_urgent() -> bool:
    """Whether this user may give a process such a priority, as one that ends at once finds out."""
    attempt = "import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))"
    return subprocess.run([sys.executable, "-c", attempt], capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(not hasattr(os, "sched_getscheduler"), reason="no such priorities on this system")
def test_nothing_changes_where_the_system_refuses_urgency(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    usual = os.sched_getscheduler(0)
    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with urgent():
        assert os.sched_getscheduler(0) == usual
    assert os.sched_getscheduler(0) == usual


def test_a_page_that_is_loaded_is_told_where_the_handle_is_and_what_was_done_on_it() -> None:
    """Also where the page before it has sent a faulty pose at last."""
    browser = Browser()
    for message in ({"pose": [1.0, 2.0, 3.0, 0.0, 0.0, 0.5], "work": 0.25}, {"pose": "x", "work": 3.0}):
        browser.take(message)
    told = browser.message()
    assert told["pose"] == [1.0, 2.0, 3.0, 0.0, 0.0, 0.5]
    assert told["work"] == 0.25


@pytest.mark.parametrize(
    ("text", "message"),
    [("", "two rows or more"), ("time,x\n0,1\n1,2\n", "two rows or more"), ("0,0,0,0\n", "two rows or more"),
     ("1,0,0,0\n2,0,0,0\n", "ascend from 0"),
     ("0,0,0,0\n0,1,0,0\n", "ascend from 0"), ("0,0,0,0\n1,a,0,0\n", "needed")],
)  # fmt: skip
def test_a_wrong_script_is_one_line(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        scripted(path, 1000.0, 0.0)
    assert "\n" not in str(caught.value)


def test_numbers_out_of_range_are_refused() -> None:
    for name, value in (("rate", 1e6), ("force_scale", 0.0), ("delay", -1.0), ("device_rate", float("nan"))):
        with pytest.raises(InputError, match="allowed"):
            check_asked(Asked(**{name: value}))
