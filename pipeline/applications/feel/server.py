"""The page of `gudgeon feel` and its WebSocket, on this machine alone."""

import asyncio
import contextlib
import json
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from gudgeon.pipeline.applications.feel.device import Browser

PAGE = Path(__file__).parent / "page"
VENDOR = Path(__file__).parents[2] / "service" / "page" / "vendor"
LARGEST = 65_535
"""Bytes of a message."""
SHOWN = 0.02
"""Time between messages to the page [s]."""
LOCAL = ("127.0.0.1", "localhost", "[::1]")
HEADERS = [("Cache-Control", "no-store"), ("X-Content-Type-Options", "nosniff"), ("X-Frame-Options", "DENY")]
TAKEN = 4001
"""Why the socket of a page is closed when another page takes the handle; that page does not come back by itself."""


class Server:
    """Serves the page of one tool.

    Args:
        shown: What the page draws, sent once.
        state: Returns what the page shows, ten times a second and more.
    """

    def __init__(self, browser: Browser, shown: dict[str, Any], state: Callable[[], dict[str, Any]]) -> None:
        self._browser, self._shown, self._state = browser, json.dumps(shown), state
        self.port = 0
        self._driving: WebSocket | None = None
        """Of the page that has the handle: the one that came last."""
        self._app = Starlette(
            routes=[
                Route("/", lambda request: FileResponse(PAGE / "feel.html")),
                Route("/scene", lambda request: Response(self._shown, media_type="application/json")),
                WebSocketRoute("/ws", self._talk),
                Mount("/vendor", StaticFiles(directory=VENDOR)),
                Mount("/", StaticFiles(directory=PAGE)),
            ]
        )

    async def serve(self, port: int, ready: Callable[[str], None], stop: threading.Event) -> None:
        """Serve on the loopback interface until `stop` is set; OSError where the port is taken."""
        # By this protocol asyncio knows the socket for TCP and turns Nagle's algorithm off.
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP) as listening:
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listening.bind(("127.0.0.1", port))
            listening.listen()
            self.port = listening.getsockname()[1]
            server = uvicorn.Server(
                uvicorn.Config(
                    self, http="h11", ws=WebSocketsSansIOProtocol, ws_max_size=LARGEST, ws_per_message_deflate=False,
                    lifespan="off", log_level="critical", headers=HEADERS, server_header=False,
                    timeout_graceful_shutdown=1,
                )
            )  # fmt: skip
            serving = asyncio.create_task(server.serve([listening]))
            ready(f"http://127.0.0.1:{self.port}/")
            while not (stop.is_set() or serving.done()):  # Ctrl-C ends it.
                await asyncio.sleep(0.05)
            server.should_exit = True
            await serving

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer requests for this machine by one of its own names, and from its own page."""
        headers, names = Headers(scope=scope), {f"{name}:{self.port}" for name in LOCAL}
        origin = headers.get("origin")
        app = self._app
        if headers.get("host") not in names or (origin is not None and origin.removeprefix("http://") not in names):
            app = PlainTextResponse("this page is for this machine alone", 403)
        await app(scope, receive, send)

    async def _talk(self, page: WebSocket) -> None:
        await page.accept()
        previous, self._driving = self._driving, page
        if previous is not None:
            with contextlib.suppress(WebSocketDisconnect, RuntimeError):  # It has gone meanwhile.
                await previous.close(TAKEN, "another page has the handle")
        telling = asyncio.create_task(self._tell(page))
        try:
            async for text in page.iter_text():
                if self._driving is page:
                    message = None
                    with contextlib.suppress(ValueError, RecursionError):
                        message = json.loads(text)
                    self._browser.take(message)
        finally:
            telling.cancel()
            if self._driving is page:
                self._driving = None

    async def _tell(self, page: WebSocket) -> None:
        with contextlib.suppress(WebSocketDisconnect):
            while self._driving is page:
                await page.send_json(self._state() | self._browser.message())
                await asyncio.sleep(SHOWN)
