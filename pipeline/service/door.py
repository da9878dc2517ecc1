"""What a request must be before any route sees it: for a name of this server, and small unless it puts a record."""

import asyncio
import re

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gudgeon.pipeline.service.context import problem

HOST = re.compile(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+)(?::\d{1,5})?")
RECORD = re.compile(r"/[^/]+/records/[^/]+/?")
MOST_BODY = 2**16
"""Bytes of a body that is no record."""
SLOWEST_BODY = 30.0
"""Longest time [s] that a client may take to send such a body."""


class KnownHost:
    """Refuses names that are not this server's: a page elsewhere could lead a browser here by a name of its own.

    Args:
        hosts: Names under which the server may be called; none: any.
    """

    def __init__(self, app: ASGIApp, hosts: frozenset[str]) -> None:
        self._app = app
        self._hosts = frozenset(h.lower().strip("[]") for h in hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request; one of HTTP/1.0 may have no name, which no browser leaves out."""
        if scope["type"] == "http" and self._hosts:
            text = Headers(scope=scope).get("host", "")
            match = HOST.fullmatch(text)
            name = match[1].lower().strip("[]") if match is not None else None
            if text and name not in self._hosts:
                shown = text if name is None else name
                await problem(400, "StoreUnusable", f"this server is not '{shown[:80]}'")(scope, receive, send)
                return
        await self._app(scope, receive, send)


class SmallBodies:
    """Takes the body of a request that puts no record itself: it is read before anybody asks for a token."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http" or (scope["method"] == "PUT" and RECORD.fullmatch(scope["path"])):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        size = int(headers.get("content-length", "0"))  # Digits alone: the protocol has looked.
        refused = None
        if "transfer-encoding" in headers:
            refused = problem(411, "QueryWrong", "Content-Length: expected the number of bytes")
        elif size > MOST_BODY:
            refused = problem(413, "QueryWrong", f"a body of {size} bytes; allowed here: up to {MOST_BODY}")
        elif size:
            try:
                receive = _again(await asyncio.wait_for(_whole(receive), SLOWEST_BODY), receive)
            except TimeoutError:
                text = f"fewer than the {size} bytes of Content-Length came in {SLOWEST_BODY:g} s"
                refused = problem(408, "StoreUnusable", text)
        await (self._app if refused is None else refused)(scope, receive, send)


async def _whole(receive: Receive) -> Message:
    """Return the messages of a body as one, or that the client has gone."""
    bodies = []
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return message
        bodies.append(message.get("body", b""))
        if not message.get("more_body", False):
            return {"type": "http.request", "body": b"".join(bodies), "more_body": False}


def _again(message: Message, receive: Receive) -> Receive:
    """Return what gives a message that was received already, then those that follow."""
    waiting = [message]

    async def receive_again() -> Message:
        return waiting.pop() if waiting else await receive()

    return receive_again
