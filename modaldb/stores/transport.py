"""Requests to a server of records, with the standard library: what it answers, or one line that says why not."""

import http.client
import json
import os
import random
import socket
import ssl
import threading
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult, urlencode, urlsplit

from gudgeon.modaldb import errors
from gudgeon.modaldb.errors import ModalDBError, RecordNotWritten, StoreUnusable
from gudgeon.modaldb.stores.query import QueryWrong

TOKEN, TOKEN_FILE, WAIT = "GUDGEON_TOKEN", "GUDGEON_TOKEN_FILE", "GUDGEON_DB_WAIT"
"""Variables: the token, a file that has it, and how long a server is waited for [s]."""
USUAL_WAIT = 10.0
SLOWEST = 60.0
"""Longest pause of a server within an answer [s]."""
PAUSE = 0.05, 1.0
"""First and longest pause before a request is repeated [s]."""
BUSY = 503
ALONE = 60.0
"""Seconds without asking what one can do without, after a server did not answer."""
HEADS = {404: errors.RecordMissing, 409: errors.RecordDamaged}
"""Errors of answers without a body, by their status."""
DEFAULT = "default"
"""Database of a URL that names none."""
KNOWN = {name: one for name, one in vars(errors).items() if isinstance(one, type)} | {"QueryWrong": QueryWrong}
LOST = (ConnectionError, socket.timeout, TimeoutError, http.client.BadStatusLine, http.client.IncompleteRead,
        http.client.CannotSendRequest)  # fmt: skip
"""Errors after which a request is worth another try: every one of ours may be repeated."""


class Unanswered(StoreUnusable):
    """A server that did not answer in time."""


@dataclass(frozen=True)
class Answer:
    """What a server answered."""

    status: int
    headers: Mapping[str, str]
    """Names in lower case."""
    body: bytes
    url: str
    """Of the server, for messages."""

    def json(self) -> Any:
        """Return the body as JSON; raise StoreUnusable where it is none."""
        try:
            return json.loads(self.body)
        except (ValueError, RecursionError):
            raise StoreUnusable(f"{self.url}: HTTP status {self.status}, not of a gudgeon server") from None


_silent: dict[str, float] = {}
"""When servers that did not answer are asked again, by URL: a process opens the same database many times."""


class Transport:
    """Requests to one database.

    Args:
        url: `http://host:port` or `https://host:port`, with `/NAME` of the database behind it if the server has
            several.

    Raises:
        StoreUnusable: the URL is none, or the token's file cannot be read.
    """

    def __init__(self, url: str) -> None:
        self._parts = _checked(url)
        self.url = url.rstrip("/")
        self._base = self._parts.path.rstrip("/") or f"/{DEFAULT}"
        self._token = _token()
        self._wait = allowed_wait()
        self._local = threading.local()

    @property
    def is_silent(self) -> bool:
        """Whether the server did not answer lately, so that only what is needed is asked."""
        return time.monotonic() < _silent.get(self.url, 0.0)

    def request(
        self, method: str, path: str, *, query: Mapping[str, Any] | None = None, body: Iterable[bytes] = (),
        headers: Mapping[str, str] | None = None,
    ) -> Answer:  # fmt: skip
        """Return the answer to a request below the database; one that was not answered is repeated for a while.

        Raises:
            ModalDBError: the server said so, or did not answer in time, or something else answered.
        """
        parts = list(body)
        target = f"{self._base}{path}" + (f"?{urlencode(query, doseq=True)}" if query else "")
        sent = {"Content-Length": str(sum(map(len, parts)))} if parts or method in ("PUT", "POST") else {}
        sent |= {"Authorization": f"Bearer {self._token}"} if self._token else {}
        sent |= dict(headers or {})
        begun, pause = time.monotonic(), PAUSE[0]
        while True:
            try:
                answer = self._once(method, target, parts, sent)
                if method == "HEAD" and answer.status >= 400 and answer.status not in (*HEADS, BUSY):
                    # Such an answer has no body to say why.
                    answer = self._once("GET", target, parts, sent | {"Range": "bytes=0-0"})
                _silent.pop(self.url, None)
                if answer.status != BUSY or time.monotonic() - begun + pause > self._wait:
                    return self._checked_answer(answer, method)
            except (OSError, http.client.HTTPException) as error:
                self._drop()
                waited = time.monotonic() - begun
                if not isinstance(error, LOST) or waited + pause > self._wait:
                    _silent[self.url] = time.monotonic() + ALONE
                    raise Unanswered(f"{self.url}: no answer in {waited:.1f} s ({_cause(error)})") from error
            time.sleep(pause * random.uniform(0.5, 1.0))
            pause = min(2 * pause, PAUSE[1])

    def _once(self, method: str, target: str, parts: list[bytes], headers: Mapping[str, str]) -> Answer:
        connection = self._connection()
        connection.putrequest(method, target, skip_accept_encoding=True)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        try:
            for part in parts:
                connection.send(part)
        except (BrokenPipeError, ConnectionResetError):
            # A server that refuses a body says why before it hangs up.
            pass
        answer = connection.getresponse()
        if answer.length is None and not answer.chunked and method != "HEAD":
            raise http.client.IncompleteRead(b"")  # Without its length, nobody knows whether it is whole.
        body = answer.read()
        if answer.will_close:
            self._drop()
        headers = {name.lower(): value for name, value in answer.getheaders()}
        return Answer(answer.status, headers, body, self.url)

    def _checked_answer(self, answer: Answer, method: str) -> Answer:
        if answer.status < 400:
            return answer
        if method == "HEAD" and answer.status in HEADS:
            raise HEADS[answer.status](f"{self.url}: HTTP status {answer.status}")
        try:
            found = answer.json()
            kind, text = found["error"], found["detail"]
        except (LookupError, TypeError):
            raise StoreUnusable(f"{self.url}: HTTP status {answer.status}, not of a gudgeon server") from None
        raise KNOWN.get(kind, StoreUnusable if answer.status < 500 else ModalDBError)(self._named(str(text)))

    def _named(self, text: str) -> str:
        line = " ".join(text.split())
        return line if line.startswith(self.url) else f"{self.url}: {line}"

    def _connection(self) -> http.client.HTTPConnection:
        found = getattr(self._local, "connection", None)
        if found is None or self._local.process != os.getpid():  # A child process must not share a connection.
            kind = http.client.HTTPSConnection if self._parts.scheme == "https" else http.client.HTTPConnection
            found = kind(self._parts.hostname or "", self._parts.port, timeout=SLOWEST)
            found.timeout = min(SLOWEST, max(self._wait, 1.0))
            found.connect()
            found.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            found.sock.settimeout(SLOWEST)
            self._local.connection, self._local.process = found, os.getpid()
        return found

    def _drop(self) -> None:
        found = getattr(self._local, "connection", None)
        self._local.connection = None
        if found is not None:
            found.close()


def _checked(url: str) -> SplitResult:
    try:
        parts = urlsplit(url)
        sound = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:
        parts, sound = urlsplit(""), False
    if not sound or parts.query or parts.fragment or parts.username or parts.path.strip("/").count("/"):
        raise StoreUnusable(f"{url[:200]}: no URL of a database; expected http://HOST:PORT or http://HOST:PORT/NAME")
    return parts


def _token() -> str:
    found, file = os.environ.get(TOKEN, ""), os.environ.get(TOKEN_FILE, "")
    if not found and file:
        try:
            found = Path(file).read_text(encoding="ascii")
        except (OSError, ValueError) as error:
            raise StoreUnusable(f"{TOKEN_FILE}={file}: cannot be read ({getattr(error, 'strerror', error)})") from error
    found = found.strip()
    if not found.isascii() or any(one.isspace() or not one.isprintable() for one in found):
        raise StoreUnusable(f"{TOKEN if os.environ.get(TOKEN) else TOKEN_FILE}: expected one word of ASCII letters")
    return found


def allowed_wait() -> float:
    """Return how long a server is waited for [s]; raise StoreUnusable where the variable has no such number."""
    text = os.environ.get(WAIT, "")
    try:
        wait = float(text) if text else USUAL_WAIT
    except ValueError:
        wait = -1.0
    if not 0.0 <= wait <= 86400.0:
        raise StoreUnusable(f"{WAIT}={text}: expected a number of seconds, 0 to 86400")
    return wait


def _cause(error: Exception) -> str:
    if isinstance(error, ssl.SSLError):
        return f"TLS: {error.reason or error}"
    if isinstance(error, RecordNotWritten):
        return str(error)
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
