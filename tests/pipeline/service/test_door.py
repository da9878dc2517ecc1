"""What stops a request before a route sees it: names, bodies that nobody may send, heads that never end."""

import http.client
import json
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

pytest.importorskip("fastapi", reason="the extra 'service' is not installed")

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.service import door, patience
from tests.modaldb.samples import INPUTS, mesh
from tests.pipeline.service.serving import TOKEN, served

KEY = content_key(INPUTS)
USES = f"POST /default/records/{KEY}/uses HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"


@pytest.fixture
def place(tmp_path: Path) -> Iterator[tuple[str, int]]:
    with served(tmp_path / "db") as url:
        modaldb.open(url).put(KEY, "mesh", mesh(), INPUTS)
        parts = urlsplit(url)
        yield parts.hostname or "", parts.port or 0


def said(place: tuple[str, int], text: bytes) -> bytes:
    """Return what the server says to some bytes until it is silent for a while or hangs up."""
    with socket.create_connection(place, timeout=5) as connection:
        connection.sendall(text)
        found = b""
        while not found.endswith(b"}") and (part := connection.recv(4096)):
            found += part
        return found


@pytest.mark.parametrize(
    "host", ["evil.example", "evil_x.example", "[::1", "localhost:x", "localhost:99999999", "evil@localhost",
             "localhost/@evil", "localhost.", "l\u0151calhost", "localhost evil"],
)  # fmt: skip
def test_names_that_are_none_of_the_servers(host: str, place: tuple[str, int]) -> None:
    found = said(place, f"GET /health HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
    assert found.startswith(b"HTTP/1.1 400")
    assert b"this server is not '" in found


@pytest.mark.parametrize("host", ["localhost", "LocalHost:80", "127.0.0.1:8765", "[::1]:8765"])
def test_names_that_are(host: str, place: tuple[str, int]) -> None:
    assert said(place, f"GET /health HTTP/1.1\r\nHost: {host}\r\n\r\n".encode()).startswith(b"HTTP/1.1 200")


def test_a_large_body_is_refused_before_it_is_read(place: tuple[str, int]) -> None:
    """Of somebody without a token, none of it is kept in memory."""
    found = said(place, f"{USES}Content-Length: 300000000\r\n\r\n".encode())
    assert found.startswith(b"HTTP/1.1 413")
    assert b"a body of 300000000 bytes; allowed here: up to 65536" in found
    assert said(place, f"{USES}Transfer-Encoding: chunked\r\n\r\n".encode()).startswith(b"HTTP/1.1 411")


def test_a_body_that_never_ends(place: tuple[str, int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(door, "SLOWEST_BODY", 0.2)
    found = said(place, f"{USES}Content-Length: 100\r\n\r\n{{".encode())
    assert found.startswith(b"HTTP/1.1 408")
    assert b"fewer than the 100 bytes" in found


def test_a_client_that_leaves_within_its_body(place: tuple[str, int], caplog: pytest.LogCaptureFixture) -> None:
    with socket.create_connection(place, timeout=5) as connection:
        connection.sendall(f"{USES}Content-Length: 100\r\n\r\n{{".encode())
    time.sleep(0.3)
    assert said(place, b"GET /health HTTP/1.1\r\nHost: localhost\r\n\r\n").startswith(b"HTTP/1.1 200")
    assert caplog.messages == []


@pytest.mark.parametrize("first", [b"", b"GET /health HTTP/1.1\r\nHost: loc"])
def test_a_head_that_never_ends(first: bytes, place: tuple[str, int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patience, "LONGEST_HEAD", 0.2)
    with socket.create_connection(place, timeout=5) as connection:
        connection.sendall(first)
        assert connection.recv(100) == b""


def test_a_further_request_that_never_ends(place: tuple[str, int], monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock of a head stops with it: a connection may wait between two requests, not within the second one."""
    monkeypatch.setattr(patience, "LONGEST_HEAD", 0.3)
    connection = http.client.HTTPConnection(*place, timeout=5)
    for _ in range(2):
        connection.request("GET", "/health")
        assert connection.getresponse().read().startswith(b"{")
        time.sleep(0.5)
    assert connection.sock is not None
    connection.sock.sendall(b"GET /health HT")
    assert connection.sock.recv(100) == b""
    connection.close()


def test_names_with_letters_that_terminals_obey(
    place: tuple[str, int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    body = json.dumps({"scene": "a\x1b[2J\nb", "component": "c"})
    head = f"{USES}Authorization: Bearer {TOKEN}\r\nContent-Length: {len(body)}\r\n\r\n"
    assert said(place, (head + body).encode()).startswith(b"HTTP/1.1 422")
    modaldb.open(tmp_path / "db").note(KEY, "a\x1b[2J\nb", "c")  # As a release before may have noted it.
    for command in (["ls"], ["show", KEY[:8]]):
        assert main(["db", *command, "--db", str(tmp_path / "db")]) == 0
        printed = capsys.readouterr().out
        assert "\x1b" not in printed
        assert "a\N{REPLACEMENT CHARACTER}[2J\N{REPLACEMENT CHARACTER}b" in printed
