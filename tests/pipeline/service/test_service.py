"""The server, asked with the standard library: ranges, parts of arrays, rights, links, uploads that break off."""

import asyncio
import http.client
import io
import json
import logging
import os
import socket
import threading
import time
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

import numpy as np
import pytest

pytest.importorskip("fastapi", reason="the extra 'service' is not installed")

from gudgeon import modaldb
from gudgeon.modaldb.format import hdf5
from gudgeon.modaldb.format.hdf5 import record_bytes
from gudgeon.modaldb.keys import content_key, text_key
from gudgeon.modaldb.records import KINDS
from gudgeon.modaldb.stores.folder import FolderStore, open_folder
from gudgeon.modaldb.stores.index import UNKNOWN
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.service import access, arrays, files
from gudgeon.pipeline.service.access import EVERY, RIGHTS, Access, Token
from gudgeon.pipeline.service.run import bound, check_host, named_stores
from tests.modaldb.samples import INPUTS, SAMPLES, mesh, modes, ramp
from tests.modaldb.test_keys import NOT_INPUTS
from tests.pipeline.service.serving import TOKEN, served

KEY = content_key(INPUTS)
RECORD = f"/default/records/{KEY}"
Given = tuple[int, dict[str, str], bytes]


class Client:
    """Asks a server; names of headers in answers are in lower case."""

    def __init__(self, url: str) -> None:
        self.parts = urlsplit(url)

    def ask(self, method: str, path: str, body: bytes | None = None, **headers: str) -> Given:
        connection = http.client.HTTPConnection(self.parts.hostname or "", self.parts.port, timeout=10)
        sent = {"Authorization": f"Bearer {TOKEN}"} | {name.replace("_", "-"): text for name, text in headers.items()}
        connection.request(method, path, body, {name: text for name, text in sent.items() if text})
        answer = connection.getresponse()
        found = answer.status, {name.lower(): text for name, text in answer.getheaders()}, answer.read()
        connection.close()
        return found

    def get(self, path: str, **headers: str) -> Given:
        return self.ask("GET", path, **headers)

    def json(self, path: str) -> Any:
        status, _, body = self.get(path)
        assert status == 200, body
        return json.loads(body)


@pytest.fixture
def client(tmp_path: Path) -> Iterator[Client]:
    with served(tmp_path / "db") as url:
        yield Client(url)


@pytest.fixture
def store(tmp_path: Path) -> FolderStore:
    return open_folder(tmp_path / "db")


def line_of(given: Given, status: int, error: str) -> str:
    """Return the detail of an answer that is an error."""
    assert given[0] == status, given
    found = json.loads(given[2])
    assert found.keys() == {"error", "detail"}
    assert found["error"] == error
    assert "\n" not in found["detail"]
    return found["detail"]


# Whole records and ranges


def test_a_record_is_its_file(client: Client, store: FolderStore) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    whole = store.path(KEY).read_bytes()
    status, headers, body = client.get(RECORD)
    assert (status, body) == (200, whole)
    assert headers["etag"] == f'"{KEY}"'
    assert headers["accept-ranges"] == "bytes"
    assert "immutable" in headers["cache-control"]
    status, headers, body = client.ask("HEAD", RECORD)
    assert (status, body, int(headers["content-length"])) == (200, b"", len(whole))
    assert client.get(RECORD, If_None_Match=f'"x", "{KEY}"')[0] == 304


@pytest.mark.parametrize(
    ("text", "first", "end"),
    [("bytes=0-0", 0, 1), ("bytes=10-99", 10, 100), ("bytes=500-", 500, None), ("bytes=-7", -7, None),
     ("bytes=5-999999999", 5, None), ("BYTES = 3-4", 3, 5), ("bytes=-999999999", 0, None)],
)  # fmt: skip
def test_ranges(text: str, first: int, end: int | None, client: Client, store: FolderStore) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    whole = store.path(KEY).read_bytes()
    status, headers, body = client.get(RECORD, Range=text)
    assert (status, body) == (206, whole[first:end])
    place = first % len(whole)
    assert headers["content-range"] == f"bytes {place}-{place + len(body) - 1}/{len(whole)}"


@pytest.mark.parametrize(
    "text", ["lines=0-5", "bytes=5", "bytes=9-3", "bytes=0-1,4-5", "bytes=a-b", "bytes=-", "bytes=²-3"]
)
def test_ranges_that_are_ignored(text: str, client: Client, store: FolderStore) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    assert files.byte_range(text, 1000) is None
    if text.isascii():
        assert client.get(RECORD, Range=text)[0] == 200


def test_a_range_beyond_the_end(client: Client, store: FolderStore) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    size = store.path(KEY).stat().st_size
    for text in (f"bytes={size}-", f"bytes={size}-{size}", "bytes=99999999-", "bytes=-0"):
        given = client.get(RECORD, Range=text)
        assert line_of(given, 416, "QueryWrong")
        assert given[1]["content-range"] == f"bytes */{size}"
    assert client.get(RECORD, Range=f"bytes={size - 1}-{size}")[2] == store.path(KEY).read_bytes()[-1:]


def test_what_is_not_there_is_not_unchanged(client: Client, store: FolderStore) -> None:
    line_of(client.get(RECORD, If_None_Match=f'"{KEY}"'), 404, "RecordMissing")
    store.put(KEY, "mesh", mesh(), INPUTS)
    assert client.get(RECORD, If_None_Match=f'"{KEY}"')[0] == 304


def test_a_range_of_another_version_is_the_whole(client: Client, store: FolderStore) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    assert client.get(RECORD, Range="bytes=0-3", If_Range='"other"')[0] == 200
    assert client.get(RECORD, Range="bytes=0-3", If_Range=f'"{KEY}"')[0] == 206


def test_a_record_that_is_larger_than_a_part(client: Client, store: FolderStore) -> None:
    store.put(KEY, "modes", replace(modes(), shapes=ramp(60_000, 3, 3), static_responses=None), INPUTS)
    whole = store.path(KEY).read_bytes()
    assert len(whole) > 3 * files.PART
    assert client.get(RECORD)[2] == whole
    assert client.get(RECORD, Range=f"bytes=100-{3 * files.PART}")[2] == whole[100 : 3 * files.PART + 1]


def test_a_file_that_is_cut_while_it_is_sent(tmp_path: Path) -> None:
    """The answer ends after the bytes that there are."""
    (tmp_path / "file").write_bytes(b"x" * 10)

    async def sent() -> list[bytes]:
        pieces = files._parts(os.open(tmp_path / "file", os.O_RDONLY), 4, 100)
        return [await anext(pieces, b"end") for _ in range(3)]

    assert asyncio.run(sent()) == [b"x" * 6, b"end", b"end"]


# Parts of arrays


def array(given: Given) -> np.ndarray:
    assert given[0] == 200, given
    assert given[1]["content-type"] == "application/x-npy"
    return np.load(io.BytesIO(given[2]), allow_pickle=False)


@pytest.mark.parametrize("kind", KINDS)
def test_every_field_is_served(kind: str, client: Client, store: FolderStore) -> None:
    store.put(KEY, kind, SAMPLES[kind](), INPUTS)
    info = client.json(f"{RECORD}/info")
    assert (info["kind"], info["inputs"], info["size"]) == (kind, INPUTS, store.path(KEY).stat().st_size)
    assert {row["path"]: row["bytes"] for row in info["fields"]} == store.sizes(KEY)
    with store.opened(KEY) as (source, head):
        for row in info["fields"]:
            expected = hdf5.read_array(source, arrays.dataset_of(head, row["path"]), "")
            found = array(client.get(f"{RECORD}/field/{quote(row['path'])}"))
            assert (found.dtype, found.shape, found.tobytes()) == (expected.dtype, expected.shape, expected.tobytes())
            assert row["shape"] == list(expected.shape)


CHOICES = {
    "rows=2:5": (slice(2, 5), slice(None)),
    "rows=7,3,3,0": ([7, 3, 3, 0], slice(None)),
    "rows=::4,9": ([0, 4, 8, 9], slice(None)),
    "columns=2,0": (slice(None), [2, 0]),
    "rows=:3&columns=1": (slice(3), [1]),
    "rows=4:4": (slice(0, 0), slice(None)),
}


@pytest.mark.parametrize("choice", CHOICES)
def test_chosen_rows_and_columns(choice: str, client: Client, store: FolderStore) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    rows, columns = CHOICES[choice]
    expected = modes().shapes[rows][..., columns]
    assert np.array_equal(array(client.get(f"{RECORD}/field/shapes?{choice}")), expected)
    found = client.json(f"{RECORD}/field/shapes?{choice}&format=json")
    assert (found["shape"], found["values"]) == (list(expected.shape), expected.ravel().tolist())


def test_chosen_rows_are_read_alone(store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    with store.opened(KEY) as (source, head):
        dataset, read = arrays.dataset_of(head, "shapes"), []
        whole = type(source).read_into
        monkeypatch.setattr(
            type(source), "read_into", lambda self, at, buffer: (read.append(len(buffer)), whole(self, at, buffer))[1]
        )
        arrays.read_part(source, dataset, np.array([1, 2, 3, 7]))
    assert read == [3 * 3 * 3 * 8, 3 * 3 * 8]


def test_the_nodes_of_a_surface(client: Client, store: FolderStore) -> None:
    inputs = {"stage": "mesh"}
    store.put(content_key(inputs), "mesh", mesh(), inputs)
    store.put(KEY, "modes", replace(modes(), mesh_key=content_key(inputs)), INPUTS)
    nodes = np.unique(mesh().surfaces["skirt"].facets)
    assert np.array_equal(array(client.get(f"{RECORD}/field/shapes?surface=skirt")), modes().shapes[nodes])
    own = f"/default/records/{content_key(inputs)}/field/nodes?surface=open_end"
    assert len(array(client.get(own))) == len(np.unique(mesh().surfaces["open_end"].facets))
    assert "there are open_end, set, skirt" in line_of(
        client.get(f"{RECORD}/field/shapes?surface=bore"), 404, "RecordMissing"
    )
    line_of(client.get(f"{RECORD}/field/shapes?surface=a/b"), 404, "RecordMissing")
    line_of(client.get(f"{RECORD}/field/shapes?surface=skirt&rows=1"), 422, "QueryWrong")
    line_of(client.get(f"{RECORD}/field/mass?surface=skirt"), 404, "RecordMissing")
    line = line_of(client.get(f"{RECORD}/field/angular_frequencies?surface=skirt"), 422, "QueryWrong")
    assert line == "surface: angular_frequencies has 3 rows, which are not the nodes of a mesh"


@pytest.mark.parametrize(
    "choice",
    ["rows=10", "rows=0:11", "rows=-1", "rows=", "rows=a", "rows=1:2:0", "rows=1;2", "columns=3", "rows=²",
     "columns=0:9", f"rows={'9' * 30}", "format=csv"],
)  # fmt: skip
def test_choices_that_an_array_does_not_have(choice: str, client: Client, store: FolderStore) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    line_of(client.get(f"{RECORD}/field/shapes?{quote(choice, safe='=:,')}"), 422, "QueryWrong")


def test_answers_that_would_be_too_large(store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    with store.opened(KEY) as (source, head):
        dataset = arrays.dataset_of(head, "shapes")
        monkeypatch.setattr(arrays, "MOST_BYTES", 100)
        with pytest.raises(arrays.Wrong, match="more than 100 bytes; ask for fewer"):
            arrays.read_part(source, dataset)
        assert arrays.read_part(source, dataset, np.array([3])).shape == (1, 3, 3)
    with pytest.raises(arrays.Wrong, match="more than 1000000 are chosen"):
        arrays.chosen(",".join(["0:100000"] * 11), 100_000, "rows")
    monkeypatch.setattr(arrays, "MOST_NUMBERS", 5)
    with pytest.raises(arrays.Wrong, match="ask for format=npy"):
        arrays.json_part(np.zeros(6))


def test_spectrum(client: Client, store: FolderStore) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    found = client.json(f"{RECORD}/spectrum")
    assert found["frequencies"] == pytest.approx(modes().angular_frequencies / (2 * np.pi))
    assert found["discretisation_errors"] == [0.125, 0.25, None]  # NaN is no JSON.
    assert found["normal_count"] == 2
    store.put(other := content_key({"n": 1}), "mesh", mesh(), {"n": 1})
    line_of(client.get(f"/default/records/{other}/spectrum"), 409, "RecordMismatch")


# Who may


def tokens(**rights: tuple[str, ...]) -> Access:
    rows = {name: Token(name, ("default",), own) for name, own in rights.items()}
    return Access({sha256(name.encode()).hexdigest(): row for name, row in rows.items()})


@pytest.mark.parametrize(
    ("method", "path"),
    [("GET", "/keys"), ("GET", "/records"), ("GET", f"/records/{KEY}"), ("HEAD", f"/records/{KEY}"),
     ("GET", f"/records/{KEY}/info"), ("GET", f"/records/{KEY}/blocks"), ("GET", f"/records/{KEY}/field/nodes"),
     ("GET", f"/records/{KEY}/spectrum"), ("GET", f"/records/{KEY}/examine"), ("GET", "/leftovers"),
     ("PUT", f"/records/{KEY}"), ("DELETE", f"/records/{KEY}"), ("POST", f"/records/{KEY}/aside"),
     ("POST", f"/records/{KEY}/uses"), ("POST", f"/records/{KEY}/link"), ("PUT", "/tags/a"), ("DELETE", "/tags/a"),
     ("DELETE", "/leftovers/a")],
)  # fmt: skip
def test_no_route_without_a_token(method: str, path: str, client: Client, store: FolderStore) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    for given in ("", "Bearer wrong", "Basic YTpi", f"Bearer {TOKEN}x", f"bearer{TOKEN}", "Bearer \xff"):
        status, headers, _ = client.ask(method, f"/default{path}", b"{}", Authorization=given)
        assert (status, headers["www-authenticate"]) == (401, "Bearer")
    assert store.has(KEY)


def test_rights_hold_for_one_database_and_one_thing() -> None:
    found = tokens(reader=("read",), writer=("read", "put"))
    assert found.check("Bearer reader", "read", "default").name == "reader"
    for right, database in (("put", "default"), ("delete", "default"), ("read", "other")):
        with pytest.raises(access.Refused, match=f"no right '{right}' on database '{database}'") as caught:
            found.check("Bearer reader", right, database)
        assert caught.value.status == 403
    assert found.check("Bearer writer", "put", "default").name == "writer"
    assert found.check("bEARER  writer ", "put", "default").name == "writer"
    for header in ("Basic writer", "Digest writer", " writer", "writer"):
        with pytest.raises(access.Refused, match="an unknown token") as caught:
            found.check(header, "read", "default")
        assert caught.value.status == 401
    everybody = Access({})
    assert everybody.check(None, "read", "default").name == "anonymous"
    for right in ("put", "delete"):
        for header in (None, "Bearer any"):
            with pytest.raises(access.Refused, match="start it with GUDGEON_TOKEN"):
                everybody.check(header, right, "default")


def test_every_route_asks_for_a_right() -> None:
    """A route that forgot it would be open to all."""
    from gudgeon.pipeline.service.app import build_app
    from gudgeon.pipeline.service.context import Service

    app = build_app(Service({}, Access({}), frozenset(), 1))
    free = {path for path, methods in app.openapi()["paths"].items() for method in methods.values()
            if "database" not in {one["name"] for one in method.get("parameters", ())}}  # fmt: skip
    assert free == {"/health"}  # And the page, which asks for the rest with a token.


TOKENS = """
[[token]]
name = "ann"
sha256 = "{digest}"
databases = ["default"]
rights = ["read", "put"]
"""


def test_a_file_of_tokens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("GUDGEON_TOKEN", raising=False)
    (tmp_path / "tokens.toml").write_text(TOKENS.format(digest=sha256(b"secret").hexdigest()))
    found = access.read_access(tmp_path / "tokens.toml")
    assert found.check("Bearer secret", "put", "default") == Token("ann", ("default",), ("read", "put"))
    monkeypatch.setenv("GUDGEON_TOKEN", "mine")
    assert access.read_access(None).check("Bearer mine", "delete", "any") == Token("environment", (EVERY,), RIGHTS)


@pytest.mark.parametrize(
    ("change", "cause"),
    [(("[[token]]", "[[tokens]]"), r"expected \[\[token\]\]"), (("ann", ""), "token 1: name: expected a text"),
     (("sha256", "sha"), "token 1: allowed are name, sha256"), (('"read", "put"', '"write"'), "'write'; allowed: read"),
     (('["default"]', '"default"'), "databases: expected a list"), (("[[token]]", "[[token"), "tokens.toml: "),
     (("{digest}", "12"), "sha256: expected that of the token")],
)  # fmt: skip
def test_files_of_tokens_that_are_wrong(change: tuple[str, str], cause: str, tmp_path: Path) -> None:
    text = TOKENS.replace(*change).replace("{digest}", "0" * 64)
    (tmp_path / "tokens.toml").write_text(text)
    with pytest.raises(InputError, match=cause) as caught:
        access.read_access(tmp_path / "tokens.toml")
    assert str(caught.value).startswith(str(tmp_path / "tokens.toml"))
    with pytest.raises(InputError, match="cannot be read"):
        access.read_access(tmp_path / "none.toml")


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.1", "example.org", ""])
def test_others_are_not_served_without_tokens(host: str) -> None:
    with pytest.raises(InputError, match="can be reached by others; give tokens"):
        check_host(host, Access({}))
    check_host(host, tokens(reader=("read",)))


@pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "::1", "localhost"])
def test_this_machine_is_served(host: str) -> None:
    check_host(host, Access({}))


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "[::2]"])
def test_names_that_are_not_this_servers(host: str, client: Client) -> None:
    """A page elsewhere may give this address a name of its own, and ask from a browser here."""
    line_of(client.get("/health", Host=host), 400, "StoreUnusable")


# Uploads


def image(kind: str = "mesh") -> bytes:
    return b"".join(record_bytes(kind, SAMPLES[kind](), INPUTS))


def files_of(store: FolderStore) -> list[str]:
    """Return the files of records and of their writers in a folder."""
    return sorted(path.name for path in store.root.glob("??/*"))


def test_put_writes_once_and_leaves_a_line(
    client: Client, store: FolderStore, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "gudgeon.audit")
    status, _, body = client.ask("PUT", RECORD, image())
    assert status == 201
    assert json.loads(body)["state"] == "written"
    assert store.path(KEY).read_bytes() == image()
    status, _, body = client.ask("PUT", RECORD, image("modes"))
    assert (status, json.loads(body)["state"]) == (200, "kept")
    (line,) = caplog.messages
    assert f" put default {KEY} by=tests from=127.0.0.1 bytes={len(image())}" in line
    assert files_of(store) == [f"{KEY}.h5"]


BAD = {
    "a flipped byte": lambda whole: whole[:700] + bytes([whole[700] ^ 1]) + whole[701:],
    "no record": lambda whole: b"<html>" * 100,
    "nothing": lambda whole: b"",
    "an end that is cut off": lambda whole: whole[:-8],
    "another key": lambda whole: b"".join(record_bytes("mesh", mesh(), INPUTS | {"more": 1})),
}


@pytest.mark.parametrize("harm", BAD)
def test_what_is_no_record_of_the_key_is_not_kept(harm: str, client: Client, store: FolderStore) -> None:
    given = client.ask("PUT", RECORD, BAD[harm](image()))
    assert given[0] == 409
    assert json.loads(given[2])["error"] in ("RecordDamaged", "RecordMismatch")
    assert files_of(store) == []


def test_inputs_that_no_answer_can_repeat(client: Client, store: FolderStore) -> None:
    """One record would keep the list of all from everybody, or two keys would be of the same inputs."""
    for text in NOT_INPUTS:
        body = b"".join(record_bytes("mesh", mesh(), text))
        line_of(client.ask("PUT", f"/default/records/{text_key(text)}", body), 409, "RecordMismatch")
        path = store.path(text_key(text))  # As a copy by hand would be.
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(body)
        for route in ("", "/info", "/blocks", "/spectrum", "/field/nodes"):
            line_of(client.get(f"/default/records/{text_key(text)}{route}"), 409, "RecordMismatch")
    rows = client.json("/default/records?inputs=true")
    assert {row["kind"] for row in rows} == {UNKNOWN}
    assert len(rows) == len(NOT_INPUTS) == len(client.json("/default/keys"))


@pytest.mark.parametrize(
    "path",
    ["/default/records/..%2f..%2fetc%2fpasswd", "/default/records/../../etc/passwd", "/default/records/abc",
     f"/default/records/{KEY.upper()}", f"/default/records/{KEY}%00", "/../records/x", f"/other/records/{KEY}",
     f"/%2e%2e/records/{KEY}"],
)  # fmt: skip
def test_paths_that_lead_nowhere(path: str, client: Client, store: FolderStore, tmp_path: Path) -> None:
    for method in ("GET", "PUT", "DELETE"):
        assert client.ask(method, path, image())[0] in (401, 403, 404, 405)
    assert [one.name for one in tmp_path.iterdir()] == []


def test_a_record_that_is_too_large(tmp_path: Path) -> None:
    with served(tmp_path / "db", largest=1000) as url:
        line = line_of(Client(url).ask("PUT", RECORD, image()), 413, "QueryWrong")
    assert "this server takes 1000" in line
    assert not (tmp_path / "db").exists()


def half_sent(client: Client, head: str, body: bytes, *, close: bool = True) -> bytes:
    """Send a request and a part of its body; return what the server says before it or the client hangs up."""
    with socket.create_connection((client.parts.hostname or "", client.parts.port or 0), timeout=10) as connection:
        connection.sendall(f"{head}Host: localhost\r\nAuthorization: Bearer {TOKEN}\r\n\r\n".encode() + body)
        if close:
            connection.shutdown(socket.SHUT_WR)
        found = connection.recv(4096)
        while found and not found.endswith(b"}"):
            if not (more := connection.recv(4096)):
                break
            found += more
        return found


def test_a_body_that_breaks_off_is_not_kept(
    client: Client, store: FolderStore, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    half_sent(client, f"PUT {RECORD} HTTP/1.1\r\nContent-Length: {len(image())}\r\n", image()[:1000])
    for _ in range(200):
        if caplog.messages:
            break
        time.sleep(0.05)
    assert files_of(store) == []
    (line,) = caplog.messages  # Of the audit; no other, such as of an unexpected error.
    assert f" refuse default {KEY} by=tests from=127.0.0.1 bytes={len(image())} why=Wrong" in line
    assert client.ask("PUT", RECORD, image())[0] == 201


class Body:
    """A request whose body comes in these pieces, as from a server that counts none of them."""

    def __init__(self, *pieces: bytes) -> None:
        self._pieces = pieces

    async def stream(self) -> AsyncIterator[bytes]:
        for piece in self._pieces:
            yield piece


def test_a_body_of_another_size_than_announced(tmp_path: Path) -> None:
    """Uvicorn counts by itself; another server may not, and a file is never longer than announced."""
    for pieces, size, cause in (((b"abcd", b"ef"), 5, "more than the 5 bytes of Content-Length"),
                                ((b"abcd",), 5, "4 of 5 bytes came")):  # fmt: skip
        with (tmp_path / "body").open("wb") as file, pytest.raises(arrays.Wrong, match=cause):
            asyncio.run(files._receive(Body(*pieces), file.fileno(), size))  # type: ignore[arg-type]
        assert (tmp_path / "body").read_bytes() == b"abcd"
    with (tmp_path / "body").open("wb") as file:
        asyncio.run(files._receive(Body(b"abcd", b"e"), file.fileno(), 5))  # type: ignore[arg-type]
    assert (tmp_path / "body").read_bytes() == b"abcde"


def test_a_body_that_pauses_for_too_long(client: Client, store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "SLOWEST", 0.2)
    head = f"PUT {RECORD} HTTP/1.1\r\nContent-Length: {len(image())}\r\n"
    answer = half_sent(client, head, image()[:1000], close=False)
    assert answer.startswith(b"HTTP/1.1 408")
    assert b"after 1000 of" in answer
    assert files_of(store) == []


def test_an_upload_that_takes_long(client: Client, store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that goes on is taken, however long it takes; whoever writes meanwhile leaves its unfinished file alone."""
    monkeypatch.setattr(files, "SLOWEST", 0.5)
    body = image()
    size = -(-len(body) // 8)
    with socket.create_connection((client.parts.hostname or "", client.parts.port or 0), timeout=10) as connection:
        head = f"PUT {RECORD} HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {TOKEN}\r\n"
        connection.sendall(f"{head}Connection: close\r\nContent-Length: {len(body)}\r\n\r\n".encode())
        for start in range(0, len(body), size):
            time.sleep(0.15)
            connection.sendall(body[start : start + size])
            open_folder(store.root).put(content_key({"n": start}), "mesh", mesh(), {"n": start})
        assert connection.recv(100).startswith(b"HTTP/1.1 201")
    assert open_folder(store.root).fault(KEY) is None


def test_a_body_of_unknown_length(client: Client, store: FolderStore) -> None:
    head = f"PUT {RECORD} HTTP/1.1\r\nTransfer-Encoding: chunked\r\n"
    assert half_sent(client, head, b"5\r\nabcde\r\n0\r\n\r\n", close=False).startswith(b"HTTP/1.1 411")
    assert files_of(store) == []


def test_a_full_disk_is_said(client: Client, store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int, part: bytes) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files, "_write", full)
    line = line_of(client.ask("PUT", RECORD, image()), 507, "RecordNotWritten")
    assert "No space left on device" in line
    assert files_of(store) == []


# Lists, tags, removal


@pytest.mark.parametrize(
    ("path", "name", "allowed"),
    [(f"{RECORD}/field/shapes?modes=-1", "modes", "rows, columns, surface, format"),
     (f"{RECORD}/field/shapes?rows=0:1&Columns=2", "Columns", "rows, columns, surface, format"),
     ("/default/records?materal.E=1", "materal.E", "kind, scene, component, tag, key, text, since, until, where"),
     (f"{RECORD}/spectrum?signatur=1", "signatur", "none"), ("/health?x", "x", "none"),
     (f"{RECORD}?rows=0", "rows", "none")],
)  # fmt: skip
def test_parameters_that_a_route_does_not_have(
    path: str, name: str, allowed: str, client: Client, store: FolderStore
) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    if path.endswith("x"):
        path += "="
    line = line_of(client.get(path), 422, "QueryWrong")
    assert line.startswith(f"{name}: no such parameter of ")
    assert f"; allowed: {allowed}" in line


def test_puts_of_one_key_at_once(client: Client, store: FolderStore, caplog: pytest.LogCaptureFixture) -> None:
    """Eight clients send one record: all are told that it is there, one wrote it, and it is whole."""
    caplog.set_level(logging.INFO, "gudgeon.audit")
    given: list[Given] = []
    threads = [threading.Thread(target=lambda: given.append(client.ask("PUT", RECORD, image()))) for _ in range(8)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert {one[0] for one in given} <= {200, 201}
    assert len({json.loads(one[2])["digest"] for one in given}) == 1
    assert files_of(store) == [f"{KEY}.h5"]
    assert store.examine(KEY) is None
    assert len(caplog.messages) == [one[0] for one in given].count(201)


def test_wrong_queries(client: Client) -> None:
    for text in ("where=x", "limit=0", "limit=a", "since=nan", "since=x", f"text={'a' * 300}"):
        line_of(client.get(f"/default/records?{text}"), 422, "QueryWrong")
    line_of(client.get("/nobody/records"), 404, "RecordMissing")
    line_of(client.get("/default/nothing"), 404, "StoreUnusable")
    line_of(client.ask("PATCH", RECORD), 405, "StoreUnusable")


def test_an_answer_405_names_the_methods_of_all_routes_of_the_path(client: Client) -> None:
    paths = {"/health": "GET", "/": "GET", "/default/records": "GET", "/page/page.js": "GET, HEAD",
             "/page/default/records": "GET, HEAD", RECORD: "DELETE, GET, HEAD, PUT"}  # fmt: skip
    assert {path: client.ask("PATCH", path)[1]["allow"] for path in paths} == paths


def test_a_sound_record_is_not_set_aside(client: Client, store: FolderStore) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    assert "is sound" in line_of(client.ask("POST", f"{RECORD}/aside", b""), 422, "QueryWrong")
    assert store.has(KEY)


def test_only_leftovers_are_removed_by_their_names(client: Client, store: FolderStore) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    for name in (f"{KEY[:2]}/{KEY}.h5", "index.sqlite", "../db/index.sqlite", "..%2fx", ""):
        assert client.ask("DELETE", f"/default/leftovers/{name}")[0] in (404, 405)
    assert store.has(KEY)


def test_a_use_of_nothing_is_not_noted(client: Client, store: FolderStore) -> None:
    body = b'{"scene":"a","component":"b"}'
    line_of(client.ask("POST", f"{RECORD}/uses", body, Content_Type="application/json"), 404, "RecordMissing")
    store.put(KEY, "mesh", mesh(), INPUTS)
    for body in (b"{}", b"", b"[1]", b'{"scene":"","component":"b"}', b'{"scene":1,"component":"b"}'):
        line_of(client.ask("POST", f"{RECORD}/uses", body, Content_Type="application/json"), 422, "QueryWrong")


# Starting


def test_databases_by_name(tmp_path: Path) -> None:
    found = named_stores([str(tmp_path), f"blades={tmp_path / 'b'}"])
    assert {name: store.root for name, store in found.items()} == {"default": tmp_path, "blades": tmp_path / "b"}
    with pytest.raises(InputError, match="two databases 'a'"):
        named_stores(["a=x", "a=y"])
    with pytest.raises(InputError, match="expected a folder"):
        named_stores(["http://host"])


def test_a_port_that_is_taken(tmp_path: Path) -> None:
    with bound("127.0.0.1", 0) as taken, pytest.raises(InputError, match="Address already in use"):
        bound("127.0.0.1", taken.getsockname()[1])


def test_health_says_what_there_is(client: Client) -> None:
    found = json.loads(client.get("/health", Authorization="")[2])
    assert found["databases"] == ["default"]
    assert found["token_needed"]


def test_damage_is_said_and_no_byte_of_it_is_served(client: Client, store: FolderStore) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    whole = bytearray(store.path(KEY).read_bytes())
    whole[-3] ^= 1
    store.path(KEY).write_bytes(whole)
    for path in ("", "/info", "/blocks", "/field/nodes"):
        assert "checksum differs" in line_of(client.get(f"{RECORD}{path}"), 409, "RecordDamaged")
    assert "checksum differs" in client.json(f"{RECORD}/examine")["fault"]["detail"]
    assert modaldb.open(store.root).fault(KEY) is not None
