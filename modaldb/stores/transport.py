"""Requests to a server of records: what it answers, or one line that says why not."""

import functools
import json
import os
import random
import ssl
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlencode

import urllib3
from urllib3.exceptions import HTTPError, LocationParseError, NameResolutionError, ProtocolError, SSLError
from urllib3.util import Timeout, Url, parse_url

from gudgeon.modaldb import errors
from gudgeon.modaldb.errors import ModalDBError, StoreUnusable
from gudgeon.modaldb.stores.query import QueryWrong

TOKEN, TOKEN_FILE, WAIT = "GUDGEON_TOKEN", "GUDGEON_TOKEN_FILE", "GUDGEON_DB_WAIT"
"""Variables: the token, a file that has it, and how long a server is waited for [s]."""
USUAL_WAIT = 10.0
SLOWEST = 60.0
"""Longest pause of a server within an answer [s]."""
LEAST_RATE = 2**14
"""Bytes per second that an answer of more than `SLOWEST` must have on average."""
LARGEST = 2**29
"""Bytes of an answer."""
PIECE = 2**18
"""Bytes that are read at a time."""
PAUSE = 0.05, 1.0
"""First and longest pause before a request is repeated [s]."""
BUSY = 503
ALONE = 60.0
"""Seconds without asking what one can do without, after a server did not answer."""
LENGTHS = ("content-length", "transfer-encoding")
HEADS = {404: errors.RecordMissing, 409: errors.RecordDamaged}
"""Errors of answers without a body, by their status."""
DEFAULT = "default"
"""Database of a URL that names none."""
KNOWN = {name: kind for name, kind in vars(errors).items() if isinstance(kind, type)} | {"QueryWrong": QueryWrong}
FINAL = (NameResolutionError, SSLError)
"""Errors after which no other try helps. Every request of ours may be repeated after any other error."""


class Answer(NamedTuple):
    """What a server answered."""

    status: int
    headers: Mapping[str, str]
    data: bytes


class Unanswered(StoreUnusable):
    """A server that did not answer in time."""


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
        parsed = _checked(url)
        self.url = url.rstrip("/")
        self._root = self.url if (parsed.path or "/").strip("/") else f"{self.url}/{DEFAULT}"
        self._headers = {"Authorization": f"Bearer {token}"} if (token := _token()) else {}
        self._wait = allowed_wait()

    @property
    def is_silent(self) -> bool:
        """Whether the server did not answer lately, so that only what is needed is asked."""
        return time.monotonic() < _silent.get(self.url, 0.0)

    def json(
        self, method: str, path: str, *, query: Mapping[str, Any] | None = None, body: Any = None,
    ) -> Any:  # fmt: skip
        """Return what the JSON of an answer stands for; the body is sent as JSON, see `request`."""
        content = None if body is None else json.dumps(body).encode()
        answer = self.request(method, path, query=query, body=content, headers={"Content-Type": "application/json"})
        return self.parsed(answer)

    def request(
        self, method: str, path: str, *, query: Mapping[str, Any] | None = None,
        body: bytes | Sequence[bytes] | None = None, headers: Mapping[str, str] | None = None,
        largest: int | None = None,
    ) -> Answer:  # fmt: skip
        """Return the answer to a request below the database; one that was not answered is repeated for a while.

        Args:
            largest: Bytes of an answer that is read; `LARGEST` if it is not given.

        Raises:
            ModalDBError: the server said so, or did not answer in time, or something else answered.
        """
        target = f"{self._root}{path}" + (f"?{urlencode(query, doseq=True)}" if query else "")
        sent = self._headers | dict(headers or {})
        largest = LARGEST if largest is None else largest
        start, pause = time.monotonic(), PAUSE[0]
        while True:
            try:
                answer = self._once(method, target, body, sent, largest)
                if method == "HEAD" and answer.status >= 400 and answer.status not in (*HEADS, BUSY):
                    # Such an answer has no body to say why.
                    answer = self._once("GET", target, None, sent | {"Range": "bytes=0-0"}, largest)
                _silent.pop(self.url, None)
                if answer.status != BUSY or time.monotonic() - start + pause > self._wait:
                    return self._checked_answer(answer, method)
            except HTTPError as error:
                waited = time.monotonic() - start
                if isinstance(error, FINAL) or waited + pause > self._wait:
                    _silent[self.url] = time.monotonic() + ALONE
                    raise Unanswered(f"{self.url}: no answer in {waited:.1f} s ({_cause(error)})") from error
            time.sleep(pause * random.uniform(0.5, 1.0))
            pause = min(2 * pause, PAUSE[1])

    def _once(self, method: str, target: str, body: Any, headers: Mapping[str, str], largest: int) -> Answer:
        timeout = Timeout(connect=min(SLOWEST, max(self._wait, 1.0)), read=SLOWEST)
        connections = _connections(os.getpid())
        answer = connections.urlopen(method, target, body=body, headers=headers, timeout=timeout, redirect=False,
                                     preload_content=False, decode_content=False)  # fmt: skip
        if method != "HEAD" and not any(name in answer.headers for name in LENGTHS):
            answer.close()
            raise ProtocolError("without its length, nobody knows whether an answer is whole")
        return Answer(answer.status, answer.headers, self._content(answer, largest))

    def _content(self, answer: urllib3.BaseHTTPResponse, largest: int) -> bytes:
        """Return the body of an answer; raise StoreUnusable where it is too large or comes too slowly."""
        content, start = bytearray(), time.monotonic()
        while piece := answer.read1(PIECE):
            content += piece
            if len(content) > largest:
                answer.close()
                raise StoreUnusable(f"{self.url}: an answer of more than {largest} bytes, not of a gudgeon server")
            if time.monotonic() - start > SLOWEST + len(content) / LEAST_RATE:
                answer.close()
                raise Unanswered(f"{self.url}: {len(content)} bytes of an answer in {time.monotonic() - start:.0f} s")
        return bytes(content)

    def _checked_answer(self, answer: Answer, method: str) -> Answer:
        if answer.status < 400:
            return answer
        if method == "HEAD" and answer.status in HEADS:
            raise HEADS[answer.status](f"{self.url}: HTTP status {answer.status}")
        try:
            row = self.parsed(answer)
            kind, text = str(row["error"]), " ".join(str(row["detail"]).split())
        except (LookupError, TypeError):
            raise self._foreign(answer) from None
        text = text if text.startswith(self.url) else f"{self.url}: {text}"
        raise KNOWN.get(kind, StoreUnusable if answer.status < 500 else ModalDBError)(text)

    def parsed(self, answer: Answer) -> Any:
        """Return what the JSON of an answer stands for; raise StoreUnusable where it is none."""
        try:
            return json.loads(answer.data)
        except (ValueError, RecursionError):
            raise self._foreign(answer) from None

    def _foreign(self, answer: Answer) -> StoreUnusable:
        return StoreUnusable(f"{self.url}: HTTP status {answer.status}, not of a gudgeon server")


@functools.cache
def _connections(process: int) -> urllib3.PoolManager:
    """Return the connections of a process: a child must not share those of its parent."""
    return urllib3.PoolManager(maxsize=16, retries=False)


def _checked(url: str) -> Url:
    try:
        address = parse_url(url)
    except LocationParseError:
        address = Url()
    sound = address.scheme in ("http", "https") and address.host and address.port != 0
    if not sound or address.query or address.fragment or address.auth or (address.path or "").strip("/").count("/"):
        raise StoreUnusable(f"{url[:200]}: no URL of a database; expected http://HOST:PORT or http://HOST:PORT/NAME")
    return address


def _token() -> str:
    token, file = os.environ.get(TOKEN, ""), os.environ.get(TOKEN_FILE, "")
    if not token and file:
        try:
            token = Path(file).read_text(encoding="ascii")
        except (OSError, ValueError) as error:
            raise StoreUnusable(f"{TOKEN_FILE}={file}: cannot be read ({getattr(error, 'strerror', error)})") from error
    token = token.strip()
    if not token.isascii() or any(c.isspace() or not c.isprintable() for c in token):
        raise StoreUnusable(f"{TOKEN if os.environ.get(TOKEN) else TOKEN_FILE}: expected one word of ASCII letters")
    return token


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


def _cause(error: BaseException) -> str:
    while isinstance(error, HTTPError) and error.__context__ is not None:
        error = error.__context__
    if isinstance(error, ssl.SSLError):
        return f"TLS: {error.reason or error}"
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
