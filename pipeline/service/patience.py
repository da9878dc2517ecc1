"""The protocol of the server: a connection that sends no whole head of a request is closed after a while.

Otherwise some thousand of them, of somebody without a token, would keep everybody else out.
"""

import asyncio
from typing import Any

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

HEADERS = [("X-Frame-Options", "DENY"), ("X-Content-Type-Options", "nosniff")]
"""Of every answer: no other site shows it in a frame, and no browser takes it for something else than it says."""
LONGEST_HEAD = 30.0
"""Longest time [s] from a connection, or from the first byte of a further request, to the end of its headers."""


class Protocol(H11Protocol):
    """HTTP/1.1 with a time limit for headers."""

    _late: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """See `H11Protocol`."""
        super().connection_made(transport)
        self._watch()

    def data_received(self, data: bytes) -> None:
        """See `H11Protocol`."""
        super().data_received(data)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """See `H11Protocol`."""
        self._stop()
        super().connection_lost(exc)

    def _watch(self) -> None:
        """Start the clock where a head is awaited, and stop it where a request goes on."""
        if self.cycle is not None and not self.cycle.response_complete:
            self._stop()
        elif self._late is None:
            self._late = self.loop.call_later(LONGEST_HEAD, self.transport.close)

    def _stop(self) -> None:
        if self._late is not None:
            self._late.cancel()
            self._late = None


def configured(app: Any, *, graceful: int = 10) -> uvicorn.Config:
    """Return how an application is served.

    Args:
        graceful: How long requests that go on may take when the server ends [s].
    """
    return uvicorn.Config(
        app, http=Protocol, ws="none", log_level="warning", access_log=False, timeout_keep_alive=60,
        timeout_graceful_shutdown=graceful, limit_concurrency=2000, server_header=False,
        h11_max_incomplete_event_size=2**20, headers=HEADERS,
    )  # fmt: skip
