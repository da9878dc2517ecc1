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
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:;"
    " frame-ancestors 'none'"
)
"""What the page may load: nothing that is not of this server."""
HEADERS = {"Content-Security-Policy": POLICY, "Referrer-Policy": "no-referrer", "Cache-Control": "no-cache"}
MOST_RELATED = 100
"""Records of a graph."""


@router.get("/records/{key}/skin", responses=PROBLEMS)
def get_skin(key: Key, context: Reader) -> JSONResponse:
    """Return the outside of the mesh of a record of modes, of a design or of a mesh, as triangles."""
    return JSONResponse(skin.skin_json(mesh_of(context.store, key)), headers=headers_of(key))


@router.get(
    "/records/{key}/skin/{mode}", response_class=Response,
    responses=PROBLEMS | {200: {"content": {"application/octet-stream": {}}, "description": "float32, point by point"}},
)  # fmt: skip
def get_shape(key: Key, mode: Annotated[int, fastapi.Path(ge=0, le=10**6)], context: Reader) -> Response:
    """Return a mode shape at the points of the skin, scaled to a largest displacement of 1; modes count from 0."""
    nodes = skin.skin_of(mesh_of(context.store, key)).nodes
    with context.store.opened(key, "modes") as (source, head):
        dataset = arrays.dataset_of(head, "shapes")
        column = arrays.chosen(str(mode), dataset.shape[2], "mode")
        shape = arrays.read_part(source, dataset, nodes, column)[:, :, 0]
    return Response(skin.shape_bytes(shape), 200, headers_of(key), "application/octet-stream")


@router.get("/records/{key}/graph", responses=PROBLEMS)
def get_graph(key: Key, context: Reader) -> dict[str, Any]:
    """Return what a record was made from, directly or not, and what was made from it, as rows and pairs of keys."""
    with context.store.opened(key):
        pass
    entries = {e.key: e for e in context.store.find()}
    makes: dict[str, list[str]] = {}
    for entry in entries.values():
        for target in entry.refers:
            makes.setdefault(target, []).append(entry.key)
    above = _reached(key, lambda k: entries[k].refers if k in entries else ())
    below = _reached(key, lambda k: makes.get(k, ()))
    related = [k for k in dict.fromkeys([*above, *below]) if k in entries][:MOST_RELATED]
    rows = [_row(entries[k]) for k in related]
    edges = [[target, k] for k in related for target in entries[k].refers if target in related]
    return {"records": rows, "edges": edges, "left_out": max(len({*above, *below}) - len(related), 0)}


def _reached(key: str, following: Any) -> list[str]:
    keys: dict[str, None] = {}
    waiting = [key]
    while waiting:
        current = waiting.pop(0)
        if current not in keys:
            keys[current] = None
            waiting += following(current)
    return list(keys)


def _row(entry: Entry) -> dict[str, Any]:
    return {"key": entry.key, "kind": entry.kind, "made": entry.made, "uses": [list(use) for use in entry.uses],
            "tags": list(entry.tags)}  # fmt: skip


@router.get("/records/{key}/mac/{other}", responses=PROBLEMS)
def get_mac(key: Key, other: Annotated[str, fastapi.Path(pattern=KEY)], context: Reader) -> dict[str, Any]:
    """Return the MAC matrix of the normal modes of two bases, and which mode is which."""
    return compare_modes(context.store, key, other).as_json()


class Page(StaticFiles):
    """The files of the page; a browser asks each time whether they have changed."""

    def file_response(self, full_path: Any, stat_result: Any, scope: Scope, status_code: int = 200) -> Response:
        """See `StaticFiles`."""
        answer = super().file_response(full_path, stat_result, scope, status_code)
        answer.headers.update(HEADERS)
        return answer
