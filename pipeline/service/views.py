"""What the page asks for beside records: skins and shapes, provenance as a graph, MAC matrices; and the page itself."""

from pathlib import Path
from typing import Annotated, Any

import fastapi
from fastapi import APIRouter
from fastapi.responses import JSONResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from gudgeon.modaldb.stores.query import Entry
from gudgeon.pipeline.modes.comparison import compare_modes
from gudgeon.pipeline.service import arrays, skin
from gudgeon.pipeline.service.context import KEY, PROBLEMS, Key, Reader
from gudgeon.pipeline.service.files import headers_of
from gudgeon.pipeline.service.motion import mesh_of

router = APIRouter(prefix="/{database}", tags=["views"])
PAGE = Path(__file__).parent / "page"
POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:"
"""What the page may load: nothing that is not of this server."""
HEADERS = {"Content-Security-Policy": POLICY, "Referrer-Policy": "no-referrer", "Cache-Control": "no-cache"}
MOST_RELATED = 100
"""Records of a graph."""


@router.get("/records/{key}/skin", responses=PROBLEMS)
def get_skin(key: Key, asked: Reader) -> JSONResponse:
    """Return the outside of the mesh of a record of modes, of a design or of a mesh, as triangles."""
    return JSONResponse(skin.skin_json(mesh_of(asked.store, key)), headers=headers_of(key))


@router.get(
    "/records/{key}/skin/{mode}", response_class=Response,
    responses=PROBLEMS | {200: {"content": {"application/octet-stream": {}}, "description": "float32, point by point"}},
)  # fmt: skip
def get_shape(key: Key, mode: Annotated[int, fastapi.Path(ge=0, le=10**6)], asked: Reader) -> Response:
    """Return a mode shape at the points of the skin, scaled to a largest displacement of 1; modes count from 0."""
    nodes = skin.skin_of(mesh_of(asked.store, key)).nodes
    with asked.store.opened(key, "modes") as (source, head):
        dataset = arrays.dataset_of(head, "shapes")
        column = arrays.chosen(str(mode), dataset.shape[2], "mode")
        found = arrays.read_part(source, dataset, nodes, column)[:, :, 0]
    return Response(skin.shape_bytes(found), 200, headers_of(key), "application/octet-stream")


@router.get("/records/{key}/graph", responses=PROBLEMS)
def get_graph(key: Key, asked: Reader) -> dict[str, Any]:
    """Return what a record was made from, directly or not, and what was made from it, as rows and pairs of keys."""
    with asked.store.opened(key):
        pass
    entries = {one.key: one for one in asked.store.find()}
    makes: dict[str, list[str]] = {}
    for one in entries.values():
        for target in one.refers:
            makes.setdefault(target, []).append(one.key)
    above = _reached(key, lambda one: entries[one].refers if one in entries else ())
    below = _reached(key, lambda one: makes.get(one, ()))
    found = [one for one in dict.fromkeys([*above, *below]) if one in entries][:MOST_RELATED]
    rows = [_row(entries[one]) for one in found]
    edges = [[target, one] for one in found for target in entries[one].refers if target in found]
    return {"records": rows, "edges": edges, "left_out": max(len({*above, *below}) - len(found), 0)}


def _reached(key: str, following: Any) -> list[str]:
    found: dict[str, None] = {}
    rest = [key]
    while rest:
        one = rest.pop(0)
        if one not in found:
            found[one] = None
            rest += following(one)
    return list(found)


def _row(one: Entry) -> dict[str, Any]:
    return {"key": one.key, "kind": one.kind, "made": one.made, "uses": [list(use) for use in one.uses],
            "tags": list(one.tags)}  # fmt: skip


@router.get("/records/{key}/mac/{other}", responses=PROBLEMS)
def get_mac(key: Key, other: Annotated[str, fastapi.Path(pattern=KEY)], asked: Reader) -> dict[str, Any]:
    """Return the MAC matrix of the normal modes of two bases, and which mode is which."""
    return compare_modes(asked.store, key, other).as_json()


class Page(StaticFiles):
    """The files of the page; a browser asks each time whether they have changed."""

    def file_response(self, full_path: Any, stat_result: Any, scope: Scope, status_code: int = 200) -> Response:
        """See `StaticFiles`."""
        answer = super().file_response(full_path, stat_result, scope, status_code)
        answer.headers.update(HEADERS)
        return answer
