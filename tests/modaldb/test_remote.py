"""The store behind a URL: what travels, what the cache keeps and checks, and servers that fail."""

import contextlib
import json
import os
import pickle
import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import urllib3

from gudgeon import modaldb
from gudgeon.modaldb.errors import RecordDamaged, RecordMismatch, RecordMissing, StoreUnusable
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.manifest import BLOCK
from gudgeon.modaldb.stores.remote import RemoteStore
from gudgeon.modaldb.stores.transport import Transport
from tests.modaldb.samples import INPUTS, mesh, modes, ramp, same, write_record
from tests.pipeline.service.serving import served, variables

KEY = content_key(INPUTS)
NODES = 60_000
"""Of a mesh whose basis has many blocks: 60 000 × 3 × 3 numbers, 4.3 MB."""


def large() -> Any:
    return replace(modes(), shapes=ramp(NODES, 3, 3), static_responses=None)


@pytest.fixture
def url(tmp_path: Path) -> Iterator[str]:
    with served(tmp_path / "db") as place:
        yield place


@pytest.fixture
def filled(url: str, tmp_path: Path) -> str:
    """The URL of a server whose folder has a large record that no client has seen."""
    modaldb.open(tmp_path / "db").put(KEY, "modes", large(), INPUTS)
    return url


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str, int]]:
    """Note method, path and answered bytes of every request."""
    found: list[tuple[str, str, int]] = []
    once = Transport._once

    def noted(self: Transport, method: str, target: str, *rest: Any) -> urllib3.BaseHTTPResponse:
        answer = once(self, method, target, *rest)
        found.append((method, target, len(answer.data)))
        return answer

    monkeypatch.setattr(Transport, "_once", noted)
    return found


def test_a_field_travels_without_the_basis(filled: str, sent: list[tuple[str, str, int]]) -> None:
    found = modaldb.open(filled).get(KEY, "modes", only=["interfaces/thrust/rows", "angular_frequencies"])
    assert same(found.interfaces["thrust"].rows, modes().interfaces["thrust"].rows)
    assert sum(size for _, _, size in sent) < 8 * BLOCK < large().shapes.nbytes / 4
    assert len(sent) <= 3


def test_what_was_read_is_not_fetched_again(filled: str, sent: list[tuple[str, str, int]]) -> None:
    for _ in range(2):
        assert same(modaldb.open(filled).get(KEY, "modes"), large())
    first = len(sent)
    assert sum(size for _, _, size in sent) < 1.2 * large().shapes.nbytes
    modaldb.open(filled).get(KEY, "modes", only=["shapes"])
    assert len(sent) == first


def test_what_was_put_is_not_fetched(url: str, sent: list[tuple[str, str, int]]) -> None:
    store = modaldb.open(url)
    store.put(KEY, "modes", modes(), INPUTS)
    assert same(store.get(KEY, "modes"), modes())
    assert [method for method, _, _ in sent] == ["HEAD", "PUT"]


def test_the_cache_serves_without_the_server(tmp_path: Path) -> None:
    with served(tmp_path / "db") as url:
        modaldb.open(url).put(KEY, "modes", modes(), INPUTS)
    with variables({"GUDGEON_CACHE": str(tmp_path / "cache"), "GUDGEON_DB_WAIT": "0.2"}):
        store = modaldb.open(url)
        assert same(store.get(KEY, "modes"), modes())
        with pytest.raises(StoreUnusable, match=rf"{url}: no answer in 0\.\d s \(Connection refused\)"):
            store.get("0" * 64, "mesh")
        with pytest.raises(StoreUnusable, match="no answer"):
            store.put(content_key({"n": 1}), "mesh", mesh(), {"n": 1})


@pytest.mark.parametrize("ending", [".blocks", ".json"])
@pytest.mark.parametrize("harm", ["flip", "cut", "empty", "gone"])
def test_a_damaged_cache_is_fetched_again(
    ending: str, harm: str, filled: str, tmp_path: Path, sent: list[tuple[str, str, int]]
) -> None:
    assert same(modaldb.open(filled).get(KEY, "modes"), large())
    ((path, _),) = [(one, sent.clear()) for one in (tmp_path / "cache").rglob(f"{KEY}{ending}")]
    whole = bytearray(path.read_bytes())
    if harm == "gone":
        path.unlink()
    else:
        whole[len(whole) // 2] ^= 1
        path.write_bytes({"flip": whole, "cut": whole[: len(whole) // 2], "empty": b""}[harm])
    assert same(modaldb.open(filled).get(KEY, "modes"), large())
    assert sent
    if (ending, harm) == (".blocks", "flip"):
        assert [size for _, _, size in sent] == [BLOCK]


def test_a_cache_that_cannot_be_written(filled: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with variables({"GUDGEON_CACHE": str(tmp_path / "file" / "below")}):
        assert same(modaldb.open(filled).get(KEY, "modes"), large())


def test_a_cache_that_is_too_large_is_emptied(url: str, tmp_path: Path) -> None:
    keys = []
    for number in range(4):
        inputs = INPUTS | {"n": number}
        keys.append(content_key(inputs))
        modaldb.open(url).put(keys[-1], "mesh", mesh(), inputs)
        for path in (tmp_path / "cache").rglob(f"{keys[-1]}.blocks"):
            os.utime(path, (number, number))
    kept = {path.stem for path in (tmp_path / "cache").rglob("*.blocks")}
    assert kept == set(keys)
    size = max(512 * path.stat().st_blocks for path in (tmp_path / "cache").rglob("*.blocks"))
    with variables({"GUDGEON_CACHE_GB": repr(2.5 * size / 1e9)}):
        modaldb.open(url).put(content_key(INPUTS), "mesh", mesh(), INPUTS)
    assert {path.stem for path in (tmp_path / "cache").rglob("*.blocks")} == {*keys[2:], KEY}


def test_a_record_that_is_made_again_while_it_is_read(filled: str, tmp_path: Path) -> None:
    """Other bytes under the same key: one clear line, then the new ones."""
    store = modaldb.open(filled)
    store.get(KEY, "modes", only=["angular_frequencies"])
    folder = modaldb.open(tmp_path / "db")
    folder.remove(KEY)
    folder.put(KEY, "modes", replace(large(), shapes=ramp(NODES, 3, 3, start=1.0)), INPUTS)
    with pytest.raises(RecordDamaged, match="is not as its digest says; run the command again"):
        store.get(KEY, "modes")
    assert store.get(KEY, "modes").shapes[0, 0, 0] == 1.0


def test_a_lost_record_is_put_again_although_it_is_in_the_cache(url: str, tmp_path: Path) -> None:
    store = modaldb.open(url)
    store.put(KEY, "mesh", mesh(), INPUTS)
    assert store.has(KEY)
    modaldb.open(tmp_path / "db").remove(KEY)
    assert not store.has(KEY)
    assert isinstance(modaldb.open(url).fault(KEY), RecordMissing)
    store.put(KEY, "mesh", mesh(), INPUTS)
    assert modaldb.open(tmp_path / "db").has(KEY)


def test_the_cache_says_what_is_there_while_the_server_does_not_answer(tmp_path: Path) -> None:
    with served(tmp_path / "db") as url:
        modaldb.open(url).put(KEY, "mesh", mesh(), INPUTS)
    with variables({"GUDGEON_CACHE": str(tmp_path / "cache"), "GUDGEON_DB_WAIT": "0.3"}):
        store, begun = modaldb.open(url), time.monotonic()
        assert [store.has(KEY) for _ in range(20)] == 20 * [True]
        assert time.monotonic() - begun < 20 * 0.3  # It is not waited for every time.


def test_a_store_travels_to_other_processes(url: str, tmp_path: Path) -> None:
    for location in (url, str(tmp_path / "db")):
        store = pickle.loads(pickle.dumps(modaldb.open(location)))
        assert (store.location, list(store.keys())) == (location, [])


@pytest.mark.parametrize(("token", "cause"), [("", "no token; set GUDGEON_TOKEN"), ("wrong", "an unknown token")])
def test_a_token_that_does_not_fit(token: str, cause: str, tmp_path: Path) -> None:
    with served(tmp_path / "db", token=token) as url:
        store = modaldb.open(url)
        uses: list[Callable[[], Any]] = [
            lambda: store.has(KEY), lambda: list(store.keys()), lambda: store.find(),
            lambda: store.put(KEY, "mesh", mesh(), INPUTS),
        ]  # fmt: skip
        for use in uses:
            with pytest.raises(StoreUnusable) as caught:
                use()
            assert str(caught.value).startswith(f"{url}: {cause}")
            assert "\n" not in str(caught.value)
        with pytest.raises(StoreUnusable, match=f"^{url}: {cause}"):
            store.get(KEY, "mesh")
    assert not (tmp_path / "db").exists()


def test_a_token_in_a_file(url: str, tmp_path: Path) -> None:
    (tmp_path / "token").write_text("a-token-for-tests\n")
    with variables({"GUDGEON_TOKEN": "", "GUDGEON_TOKEN_FILE": str(tmp_path / "token")}):
        assert list(modaldb.open(url).keys()) == []
    nothing = variables({"GUDGEON_TOKEN": "", "GUDGEON_TOKEN_FILE": str(tmp_path / "none")})
    with nothing, pytest.raises(StoreUnusable, match=r"GUDGEON_TOKEN_FILE=.*none: cannot be read"):
        modaldb.open(url)
    with variables({"GUDGEON_TOKEN": "two words"}), pytest.raises(StoreUnusable, match="expected one word"):
        modaldb.open(url)


def test_what_is_done_without_a_silent_server_takes_no_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of its stores would wait for it again: for a note, for what is told, for whether a record is there."""
    with served(tmp_path / "db") as place:
        modaldb.open(place).put(KEY, "mesh", mesh(), INPUTS)
    with variables({"GUDGEON_CACHE": str(tmp_path / "cache"), "GUDGEON_DB_WAIT": "0.2"}):
        with pytest.raises(StoreUnusable, match="no answer in"):
            modaldb.open(place).find()
        asked: list[str] = []
        monkeypatch.setattr(Transport, "_once", lambda *arguments: asked.append(arguments[1]))
        for _ in range(3):
            store = modaldb.open(place)
            store.note(KEY, "scene", "part")
            store.tell("0" * 32, None)
            assert store.has(KEY)
            assert same(store.get(KEY, "mesh"), mesh())
    assert asked == []


@pytest.mark.parametrize("wait", ["soon", "-1", "nan", "inf"])
def test_a_wait_that_is_none(wait: str) -> None:
    with variables({"GUDGEON_DB_WAIT": wait}), pytest.raises(StoreUnusable, match="expected a number of seconds"):
        modaldb.open("http://127.0.0.1:1")


@contextlib.contextmanager
def answering(*answers: bytes) -> Iterator[tuple[str, list[bytes]]]:
    """A server that sends prepared bytes, one answer a connection, then hangs up; yields its URL and what it got."""
    got: list[bytes] = []
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def serve() -> None:
            for answer in answers:
                connection, _ = listening.accept()
                with connection:
                    connection.settimeout(5)
                    with contextlib.suppress(OSError):
                        got.append(request := connection.recv(65536))
                        length = re.search(rb"(?i)\r\ncontent-length: (\d+)\r\n.*?\r\n\r\n", request, re.DOTALL)
                        # All of the body: a connection that is closed before may lose the answer.
                        missing = int(length[1]) - len(request) + length.end() if length else 0
                        while missing > 0 and (more := connection.recv(65536)):
                            missing -= len(more)
                        connection.sendall(answer)
                        connection.shutdown(socket.SHUT_WR)
                        connection.settimeout(0.05)
                        while connection.recv(65536):  # What it still sends, lest the answer be lost.
                            pass

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{listening.getsockname()[1]}", got
        thread.join(5)


def http(body: bytes, status: str = "200 OK") -> bytes:
    return f"HTTP/1.1 {status}\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body


KEYS = json.dumps([KEY]).encode()


@pytest.mark.parametrize("first", [b"", b"HTTP/1.1 200", http(KEYS)[:-5], http(b"", "503 Busy")])
def test_an_answer_that_breaks_off_is_asked_for_again(first: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GUDGEON_DB_WAIT", "5")
    with answering(first, http(KEYS)) as (url, got):
        assert list(modaldb.open(url).keys()) == [KEY]
    assert len(got) == 2


def test_a_server_that_restarts_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    stored: list[bool] = []
    monkeypatch.setenv("GUDGEON_DB_WAIT", "20")
    monkeypatch.setenv("GUDGEON_TOKEN", "a-token-for-tests")
    monkeypatch.setenv("GUDGEON_CACHE", str(tmp_path / "cache"))
    store = modaldb.open(f"http://127.0.0.1:{port}")

    def put() -> None:
        store.put(KEY, "mesh", mesh(), INPUTS)
        stored.append(True)

    thread = threading.Thread(target=put)
    thread.start()
    time.sleep(0.3)
    assert not stored
    with served(tmp_path / "db", port=port):
        thread.join(20)
    assert stored
    assert modaldb.open(tmp_path / "db").has(KEY)


@pytest.mark.parametrize(
    ("answer", "cause"),
    [
        (http(b"<html>"), "HTTP status 200, not of a gudgeon server"),
        (http(b"<html>", "404 Not Found"), "HTTP status 404, not of a gudgeon server"),
        (http(b'{"detail": 1}', "500 Oops"), "HTTP status 500, not of a gudgeon server"),
        (http(b'{"error": "RecordDamaged", "detail": "a\\nb"}', "409 Conflict"), "a b"),
    ],
)
def test_answers_of_others(answer: bytes, cause: str) -> None:
    with answering(answer) as (url, _), pytest.raises((StoreUnusable, RecordDamaged), match=f"^{url}: {cause}$"):
        list(modaldb.open(url).keys())


@pytest.mark.parametrize(
    "row",
    [{}, [], {"key": "../x"}, {"key": KEY, "kind": "mesh", "size": 10**15, "block": BLOCK, "digests": "", "head": [],
                              "digest": ""}],
)  # fmt: skip
def test_a_list_of_blocks_that_is_none(row: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GUDGEON_CACHE", str(tmp_path / "cache"))
    refusal = pytest.raises(RecordDamaged, match="the list of its blocks is none")
    with answering(http(json.dumps(row).encode())) as (url, _), refusal:
        modaldb.open(url).get(KEY, "mesh")
    assert not [*tmp_path.rglob("*.json")]


def test_a_record_of_another_key_is_refused(url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A server that gives one record for another is found out by the inputs that the record names."""
    other = content_key({"n": 1})
    modaldb.open(tmp_path / "db").put(other, "mesh", mesh(), {"n": 1})
    manifest = RemoteStore._manifest

    def swapped(self: RemoteStore, key: str, what: str) -> Any:
        found, along = manifest(self, other, what)
        return replace(found, key=key), along

    monkeypatch.setattr(RemoteStore, "_manifest", swapped)
    with pytest.raises(RecordMismatch, match="holds the record of another key"):
        modaldb.open(url).get(KEY, "mesh")


def test_a_newer_record_names_the_versions_that_are_read(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from gudgeon.modaldb.format import hdf5

    path = tmp_path / "db" / KEY[:2] / f"{KEY}.h5"
    path.parent.mkdir(parents=True)
    with monkeypatch.context() as patch:
        patch.setattr(hdf5, "SCHEMA_VERSION", 99)
        write_record(path, "mesh", mesh(), INPUTS)
    with pytest.raises(RecordMismatch, match=r"schema version 99, this release reads 1$"):
        modaldb.open(url).get(KEY, "mesh")


def test_two_readers_of_one_cache(filled: str) -> None:
    """Threads and processes fill the same files; what one has half written the other fetches itself."""
    found: list[np.ndarray] = []
    threads = [
        threading.Thread(target=lambda: found.append(modaldb.open(filled).get(KEY, "modes").shapes)) for _ in range(6)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 6
    assert all(same(one, large().shapes) for one in found)


def test_a_missing_record_is_named_by_its_kind(url: str) -> None:
    with pytest.raises(RecordMissing, match=f"^{url}: .*no mesh record {KEY[:12]}…"):
        modaldb.open(url).get(KEY, "mesh")
