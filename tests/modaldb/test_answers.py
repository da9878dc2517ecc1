"""Answers of servers that are none of ours, or were made to harm: one line each, whatever their form and size."""

import contextlib
import gzip
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.errors import ModalDBError, RecordDamaged, StoreUnusable
from gudgeon.modaldb.format.hdf5 import record_bytes
from gudgeon.modaldb.format.source import BytesSource
from gudgeon.modaldb.stores import transport
from gudgeon.modaldb.stores.base import Store
from gudgeon.modaldb.stores.manifest import manifest_of, packed
from tests.modaldb.samples import INPUTS, mesh
from tests.modaldb.test_remote import KEY, answering, http

ROW = {"key": KEY, "kind": "mesh", "size": 1, "made": 1.0, "uses": [], "tags": [], "refers": [], "referred": 0,
       "inputs": {}}  # fmt: skip
ASKED: dict[str, Callable[[Store], Any]] = {
    "keys": lambda store: list(store.keys()),
    "find": lambda store: store.find(),
    "running": lambda store: store.running(),
    "leftovers": lambda store: store.leftovers(),
    "examine": lambda store: store.examine(KEY),
    "aside": lambda store: store.set_aside(KEY),
}
SHAPES: list[tuple[str, Any]] = [
    *((name, answer) for name in ASKED for answer in (None, 1, True)),
    ("keys", [1]), ("keys", ["../../x"]), ("keys", {"a": 1}), ("find", [[]]), ("find", [{"key": KEY}]), ("find", ["a"]),
    *(("find", [ROW | change]) for change in (
        {"key": "../x"}, {"key": 1}, {"kind": []}, {"size": 10**400}, {"size": "1"}, {"size": -1}, {"made": 1e300},
        {"made": None}, {"uses": [[1, 2]]}, {"uses": [["a"]]}, {"tags": [{}]}, {"refers": ["a"]}, {"referred": None},
        {"inputs": []})),
    ("leftovers", [1]), ("leftovers", [{"name": 1, "size": 1, "why": ""}]),
    ("leftovers", [{"name": "a", "size": "x", "why": ""}]), ("examine", {}), ("examine", {"fault": 1}),
    ("examine", {"fault": {"error": "Nothing", "detail": ""}}), ("examine", {"fault": {"error": [], "detail": ""}}),
    ("aside", []), ("aside", {"nam": 1}),
]  # fmt: skip


@pytest.fixture(autouse=True)
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GUDGEON_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("GUDGEON_DB_WAIT", "0")


@pytest.mark.parametrize(("name", "answer"), SHAPES)
def test_answers_of_another_form_are_one_line(name: str, answer: Any) -> None:
    with answering(http(json.dumps(answer).encode())) as (url, _), pytest.raises(StoreUnusable, match="another form"):
        ASKED[name](modaldb.open(url))


def test_an_entry_as_it_should_be_is_read() -> None:
    """What is refused above is the change."""
    with answering(http(json.dumps([ROW]).encode())) as (url, _):
        assert modaldb.open(url).find()[0].as_json() == ROW | {"uses": (), "tags": (), "refers": ()}


def test_rows_of_commands_that_are_none_are_left_out() -> None:
    row = {"command": "run", "scene": "a", "stage": "", "host": "", "share": 0.5, "begun": 1.0}
    rows = [1, {}, row | {"share": "half"}, row | {"begun": 10**400}, row | {"scene": 1}, row]
    with answering(http(json.dumps(rows).encode())) as (url, _):
        assert modaldb.open(url).running() == [row]


FAILING: dict[str, Callable[[Store], Any]] = {"keys": ASKED["keys"], "get": lambda store: store.get(KEY, "mesh")}


@pytest.mark.parametrize("error", [[], {}, None, 1])
@pytest.mark.parametrize("name", sorted(FAILING))
def test_an_error_of_another_form(name: str, error: Any) -> None:
    body = json.dumps({"error": error, "detail": ["a", {}]}).encode()
    with answering(http(body, "409 Conflict")) as (url, _), pytest.raises(ModalDBError, match=f"^{url}"):
        FAILING[name](modaldb.open(url))


def test_a_put_that_is_answered_otherwise() -> None:
    missing = b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n"
    for answer in ([], {}, {"digest": 1}):
        with (
            answering(missing, http(json.dumps(answer).encode())) as (url, _),
            pytest.raises(StoreUnusable, match="form"),
        ):
            modaldb.open(url).put(KEY, "mesh", mesh(), INPUTS)


def test_bytes_that_the_server_did_not_get(tmp_path: Path) -> None:
    """It says another digest than that of what was sent; a record that was there may differ."""
    missing = b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n"
    written, kept = (http(json.dumps({"digest": "0" * 64, "state": state}).encode()) for state in ("written", "kept"))
    with (
        answering(missing, written) as (url, _),
        pytest.raises(RecordDamaged, match="other bytes than those that were"),
    ):
        modaldb.open(url).put(KEY, "mesh", mesh(), INPUTS)
    with answering(missing, kept) as (url, _):
        modaldb.open(url).put(KEY, "mesh", mesh(), INPUTS)
    assert not list((tmp_path / "cache").rglob("*.json"))


def blocks_of(record: Any) -> bytes:
    """Return the list of blocks of a record of KEY, as the server gives it."""
    source = BytesSource(b"".join(record_bytes("mesh", record, INPUTS)))
    manifest = manifest_of(KEY, source, "here")
    return http(json.dumps(manifest.as_json() | {"blocks": packed(source, manifest.head)}).encode())


def test_blocks_of_another_record() -> None:
    with (
        answering(blocks_of(mesh())) as (url, _),
        pytest.raises(RecordDamaged, match="list of blocks of another record"),
    ):
        modaldb.open(url).get("1" * 64, "mesh")


@pytest.mark.parametrize(("size", "status"), [(3, "206 Partial Content"), (10, "200 OK"), (12, "206 Partial Content")])
def test_a_range_that_is_answered_otherwise(size: int, status: str) -> None:
    with (
        answering(http(b"x" * size, status)) as (url, _),
        pytest.raises(RecordDamaged, match=f"{size} came with status"),
    ):
        modaldb.open(url)._fetch(KEY, 0, 10)  # pyright: ignore[reportAttributeAccessIssue]


def test_an_answer_that_is_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "LARGEST", 10**6)
    monkeypatch.setattr(transport, "PIECE", 2**16)
    body = b"[" + b" " * 2 * 10**6 + b"]"
    chunked = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n" + b"%x\r\n%b\r\n0\r\n\r\n" % (len(body), body)
    for answer in (http(body), chunked):
        with answering(answer) as (url, _), pytest.raises(StoreUnusable, match="an answer of more than 1000000 bytes"):
            list(modaldb.open(url).keys())


def test_packed_answers_are_not_unpacked() -> None:
    """A server that was not asked to pack could make gigabytes of kilobytes."""
    body = gzip.compress(b"[]")
    head = f"HTTP/1.1 200 OK\r\nContent-Encoding: gzip\r\nContent-Length: {len(body)}\r\n\r\n".encode()
    with answering(head + body) as (url, _), pytest.raises(StoreUnusable, match="not of a gudgeon server"):
        list(modaldb.open(url).keys())


@contextlib.contextmanager
def dripping() -> Iterator[str]:
    """A server that sends a byte now and then, for ever."""
    ended = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def serve() -> None:
            connection, _ = listening.accept()
            with connection, contextlib.suppress(OSError):
                connection.recv(65536)
                connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 1000000\r\n\r\n")
                while not ended.wait(0.02):
                    connection.sendall(b" ")

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
        ended.set()
        thread.join(5)


def test_an_answer_that_comes_too_slowly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "SLOWEST", 0.2)
    start = time.monotonic()
    with dripping() as url, pytest.raises(StoreUnusable, match="bytes of an answer in"):
        list(modaldb.open(url).keys())
    assert time.monotonic() - start < 10  # And not 20 000 s.
