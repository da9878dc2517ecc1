"""The browser as a device: a page, and a WebSocket on this machine alone (RFC 6455, messages below 64 kB)."""

import asyncio
import base64
import contextlib
import hashlib
import json
import struct
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.applications.feel.device import Reading
from gudgeon.pipeline.applications.feel.guard import Model

PAGE = Path(__file__).parent / "page"
VENDOR = Path(__file__).parents[2] / "service" / "page" / "vendor"
FILES = {
    "/": (PAGE / "feel.html", "text/html; charset=utf-8"),
    "/feel.js": (PAGE / "feel.js", "text/javascript"),
    "/guard.js": (PAGE / "guard.js", "text/javascript"),
    "/feel.css": (PAGE / "feel.css", "text/css"),
    "/vendor/three.module.js": (VENDOR / "three.module.js", "text/javascript"),
    "/vendor/three.core.js": (VENDOR / "three.core.js", "text/javascript"),
}
MAGIC = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
LARGEST = 65_535
"""Bytes of a message."""
SHOWN = 0.02
"""Time between messages to the page [s]."""
LOCAL = ("127.0.0.1", "localhost", "[::1]")
TEXT, CLOSE, PING, PONG = 1, 8, 9, 10
TAKEN = 4001
"""Why the socket of a page is closed when another page takes the handle; that page does not come back by itself."""
PATIENCE = 2.0
"""How long such a page may take to answer; what it sends until then is read and dropped [s].

A socket that is closed with bytes unread is reset, by which the page loses why, and it would come back.
"""


class Browser:
    """The handle of a page: mouse, keyboard or gamepad."""

    rate = 100.0
    delay = 0.01
    stiffness = 1000.0
    force = 5.0
    mass = 10.0
    """A mouse or a stick is not moved by the force that it shows."""

    def __init__(self) -> None:
        self.model: Model | None = None
        self._reading: Reading | None = None
        self._pose, self._work = np.zeros(6), 0.0
        self._start = time.perf_counter()
        self._lock = threading.Lock()

    def begin(self) -> None:
        """Set the zero of the loop's clock."""
        self._start = time.perf_counter()

    def message(self) -> dict[str, Any]:
        """Return what a page needs to render the force, and to go on where the page before it was: pose and work."""
        with self._lock:
            model = None if self.model is None else self.model.as_json()
            return {"model": model, "pose": self._pose.tolist(), "work": self._work}

    def take(self, message: Any) -> None:
        """Take a message of the page: `pose`, six numbers [m, rad], and `work` [J]; what is none of these is a NaN."""
        pose, work = np.full(6, np.nan), np.nan
        with contextlib.suppress(TypeError, ValueError, KeyError):
            given = np.array(message["pose"], float)
            work = float(message["work"])
            pose = given if given.shape == (6,) and np.isfinite(work) else pose
        with self._lock:
            if np.isfinite(pose).all():
                self._pose, self._work = pose, work
            self._reading = Reading(time.perf_counter() - self._start, pose, self._work)

    def read(self, now: float) -> Reading | None:
        """See `Device`."""
        with self._lock:
            return self._reading

    def write(self, now: float, model: Model) -> None:
        """See `Device`."""
        self.model = model


def accept_key(key: str) -> str:
    """Return the answer to a key of an opening handshake."""
    return base64.b64encode(hashlib.sha1(key.encode() + MAGIC).digest()).decode()


def frame(kind: int, content: bytes) -> bytes:
    """Return a frame of the server."""
    size = len(content)
    head = struct.pack("!BB", 0x80 | kind, size) if size < 126 else struct.pack("!BBH", 0x80 | kind, 126, size)
    return head + content


async def received(reader: asyncio.StreamReader) -> tuple[int, bytes] | None:
    """Return kind and content of the next frame of a page; None where it is not one that a page sends."""
    first, second = await reader.readexactly(2)
    size = second & 127
    if size == 126:
        (size,) = struct.unpack("!H", await reader.readexactly(2))
    if not first & 0x80 or not second & 0x80 or size > LARGEST or second & 127 == 127:
        return None
    mask = await reader.readexactly(4)
    content = await reader.readexactly(size)
    return first & 15, bytes(one ^ mask[i % 4] for i, one in enumerate(content))


class Server:
    """Serves the page of one tool.

    Args:
        shown: What the page draws, sent once.
        state: Returns what the page shows, ten times a second and more.
    """

    def __init__(self, browser: Browser, shown: dict[str, Any], state: Callable[[], dict[str, Any]]) -> None:
        self._browser, self._shown, self._state = browser, json.dumps(shown).encode(), state
        self.connected = threading.Event()
        self.port = 0
        self._driving: asyncio.StreamWriter | None = None
        """Of the page that has the handle: the one that came last."""

    async def serve(self, port: int, ready: Callable[[str], None], stop: threading.Event) -> None:
        """Serve on the loopback interface until `stop` is set; OSError where the port is taken."""
        server = await asyncio.start_server(self._answer, "127.0.0.1", port)
        self.port = server.sockets[0].getsockname()[1]
        ready(f"http://127.0.0.1:{self.port}/")
        async with server:
            while not stop.is_set():
                await asyncio.sleep(0.05)

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(asyncio.IncompleteReadError, ConnectionError, asyncio.LimitOverrunError, TimeoutError):
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), 10)
            lines = head.decode("latin-1").split("\r\n")
            keys = {key.lower(): value.strip() for key, _, value in (line.partition(":") for line in lines[1:])}
            method, path, *_ = [*lines[0].split(" "), "", ""]
            if not self._own(keys):
                writer.write(_response(403, b"this page is for this machine alone", "text/plain"))
            elif method == "GET" and path == "/ws" and "sec-websocket-key" in keys:
                writer.write(
                    "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                    f"Sec-WebSocket-Accept: {accept_key(keys['sec-websocket-key'])}\r\n\r\n".encode()
                )
                await self._talk(reader, writer)
            elif method == "GET" and path == "/scene":
                writer.write(_response(200, self._shown, "application/json"))
            elif method == "GET" and path in FILES:
                file, kind = FILES[path]
                writer.write(_response(200, file.read_bytes(), kind))
            else:
                writer.write(_response(404, b"nothing is here", "text/plain"))
            await writer.drain()
        writer.close()

    def _own(self, keys: dict[str, str]) -> bool:
        """Whether a request is for this machine by one of its own names, and from its own page."""
        names = {f"{name}:{self.port}" for name in LOCAL}
        origin = keys.get("origin")
        return keys.get("host") in names and (origin is None or origin.removeprefix("http://") in names)

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connected.set()
        before, self._driving = self._driving, writer
        if before is not None:
            before.write(frame(CLOSE, struct.pack("!H", TAKEN) + b"another page has the handle"))
        telling = asyncio.create_task(self._tell(writer))
        try:
            while (got := await received(reader)) is not None:
                kind, content = got
                if kind == CLOSE:
                    break
                if self._driving is not writer:
                    continue
                if kind == PING:
                    writer.write(frame(PONG, content[:125]))
                if kind == TEXT:
                    try:
                        message = json.loads(content)
                    except ValueError:
                        message = None
                    self._browser.take(message)
        finally:
            telling.cancel()
            if self._driving is writer:
                self._driving = None
                with contextlib.suppress(ConnectionError):
                    writer.write(frame(CLOSE, b""))

    async def _tell(self, writer: asyncio.StreamWriter) -> None:
        while self._driving is writer:
            writer.write(frame(TEXT, json.dumps(self._state() | self._browser.message()).encode()))
            await writer.drain()
            await asyncio.sleep(SHOWN)
        await asyncio.sleep(PATIENCE)
        writer.close()


def _response(status: int, content: bytes, kind: str) -> bytes:
    words = {200: "OK", 403: "Forbidden", 404: "Not Found"}
    return (
        f"HTTP/1.1 {status} {words[status]}\r\nContent-Type: {kind}\r\nContent-Length: {len(content)}\r\n"
        "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n"
    ).encode() + content
