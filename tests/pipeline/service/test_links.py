"""Signed links: each opens one record, or one route of it, until it ends, and nothing else."""

import json
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import pytest

pytest.importorskip("fastapi", reason="the extra 'service' is not installed")

from fastapi.routing import APIRoute

from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.folder import FolderStore, open_folder
from gudgeon.pipeline.service import access, files, motion, records, views
from gudgeon.pipeline.service.context import Linked
from tests.modaldb.samples import INPUTS, mesh
from tests.pipeline.service.serving import served
from tests.pipeline.service.test_service import KEY, RECORD, Client, line_of

OTHER = content_key({"n": 1})
CLOSED = [("POST", "/link"), ("GET", f"/mac/{OTHER}"), ("GET", "/graph"), ("GET", "/skin"), ("GET", "/skin/0"),
          ("GET", "/skin/0/stress"), ("GET", "/film/block"), ("POST", "/uses"), ("POST", "/aside"), ("PUT", ""),
          ("DELETE", "")]  # fmt: skip
"""Routes below a record that no link opens."""


@pytest.fixture
def client(tmp_path: Path) -> Iterator[Client]:
    with served(tmp_path / "db") as url:
        yield Client(url)


@pytest.fixture
def store(tmp_path: Path) -> FolderStore:
    folder = open_folder(tmp_path / "db")
    folder.put(KEY, "mesh", mesh(), INPUTS)
    folder.put(OTHER, "mesh", mesh(), {"n": 1})
    return folder


def link_of(client: Client, query: str) -> str:
    status, _, body = client.ask("POST", f"{RECORD}/link?{query}", b"")
    assert status == 200, body
    return json.loads(body)["path"]


def test_a_link_opens_its_record(client: Client, store: FolderStore) -> None:
    link = link_of(client, "seconds=60")
    assert client.get(link, Authorization="")[2] == store.path(KEY).read_bytes()
    for route in ("info", "blocks", "field/nodes", "examine"):
        assert client.get(link.replace("?", f"/{route}?"), Authorization="")[0] == 200, route
    assert client.ask("HEAD", link, Authorization="")[0] == 200


def test_what_a_link_does_not_open(client: Client, store: FolderStore) -> None:
    """It mints no further link, and no route opens that reads other records."""
    link = link_of(client, "seconds=3")
    for method, route in CLOSED:
        path = link.replace("?", f"{route}?") + ("&seconds=604800" if route == "/link" else "")
        assert client.ask(method, path, b"{}", Authorization="")[0] == 401, route
    for path in ("records", "keys", "running", "leftovers", f"h5grove/meta?file={KEY}.h5"):
        signed = f"/default/{path}{'&' if '?' in path else '?'}{link.partition('?')[2]}"
        assert client.get(signed, Authorization="")[0] in (401, 404), path
    line = line_of(
        client.get(link.replace("?", "/field/nodes?") + "&surface=skirt", Authorization=""), 403, "StoreUnusable"
    )
    assert line.startswith("surface: a link opens this record alone")


def test_links_that_are_not_signed_for_this(client: Client, store: FolderStore) -> None:
    link = link_of(client, "seconds=60")
    expires = link.partition("expires=")[2].partition("&")[0]
    later = str(int(time.time()) + 9999)
    for wrong in (link.replace(KEY, OTHER), link.replace(expires, later), link[:-1] + "0g", link.replace(expires, "1"),
                  link.replace(expires, "²"), link[:-64] + "é"):  # fmt: skip
        line_of(client.get(quote(wrong, safe="/?&="), Authorization=""), 403, "StoreUnusable")


def test_a_link_ends(client: Client, store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    link, now = link_of(client, "seconds=60"), time.time()
    monkeypatch.setattr(access.time, "time", lambda: now + 59)
    assert client.get(link, Authorization="")[0] == 200
    monkeypatch.setattr(access.time, "time", lambda: now + 62)
    assert "has expired" in line_of(client.get(link, Authorization=""), 403, "StoreUnusable")


def test_a_link_to_one_route(client: Client, store: FolderStore) -> None:
    link = link_of(client, "seconds=60&route=field/nodes")
    assert link.startswith(f"{RECORD}/field/nodes?expires=")
    assert client.get(link, Authorization="")[0] == 200
    for other in (
        link.replace("/field/nodes", ""),
        link.replace("/field/nodes", "/info"),
        link.replace("nodes", "cells"),
    ):
        line_of(client.get(other, Authorization=""), 403, "StoreUnusable")
    for route in ("graph", "link", "field/", "field/a%0Ab", "skin", f"mac/{OTHER}"):
        line_of(client.ask("POST", f"{RECORD}/link?route={route}", b""), 422, "QueryWrong")
    line_of(client.ask("POST", f"{RECORD}/link?seconds=99999999", b""), 422, "QueryWrong")


def test_routes_that_links_open_are_these() -> None:
    """A new route is closed to links unless it says otherwise, and then it stands here."""
    linked = Linked.__metadata__[0].dependency  # pyright: ignore[reportAttributeAccessIssue]
    routes = [route for module in (files, motion, records, views) for route in module.router.routes]
    found = {(method, route.path) for route in routes if isinstance(route, APIRoute)
             if linked in {one.call for one in route.dependant.dependencies}
             for method in route.methods or ()}  # fmt: skip
    base = "/{database}/records/{key}"
    assert found == {("HEAD", base)} | {("GET", base + end) for end in (
        "", "/blocks", "/info", "/field/{path:path}", "/spectrum", "/examine", "/report")}  # fmt: skip
