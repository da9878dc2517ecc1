"""What records are: lists, provenance, fields, parts of arrays, frequencies; names and tags."""

import time
from typing import Annotated, Any, Literal
from urllib.parse import quote

import numpy as np
from fastapi import APIRouter, Body, Path, Query
from fastapi.responses import JSONResponse, Response
from pydantic import BaseModel, ConfigDict, Field

from gudgeon.modaldb.errors import RecordMissing, StoreUnusable
from gudgeon.modaldb.format import hdf5
from gudgeon.modaldb.stores import query as queries
from gudgeon.modaldb.stores.base import LONGEST_TAG, TAG
from gudgeon.modaldb.stores.local.names import LONGEST
from gudgeon.pipeline.service import arrays
from gudgeon.pipeline.service.access import LONGEST_LINK, Refused
from gudgeon.pipeline.service.context import LINK, PROBLEMS, Key, Linked, Reader, Remover, Service, Writer
from gudgeon.pipeline.service.files import headers_of

router = APIRouter(prefix="/{database}", tags=["records"])
NPY = {"application/x-npy": {"schema": {"type": "string", "format": "binary"}}}
Text = Annotated[str, Query(max_length=LONGEST)]
Name = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f-\x9f]*$", max_length=LONGEST)]
"""A text of one line that a terminal prints as it is."""
Stated = Annotated[str, Field(pattern=queries.LIKE_A_CONDITION, max_length=LONGEST)]
Choice = Annotated[str | None, Query(max_length=20_000, pattern=r"^[0-9:, ]*$", description="such as 0:600,700,::10")]
Tag = Annotated[str, Path(pattern=TAG, max_length=LONGEST_TAG)]
Running = Annotated[str, Path(pattern="^[0-9a-f]{32}$", description="32 hexadecimal digits")]
ROUTES = r"^(blocks|info|spectrum|examine|report|field/[^\x00-\x20\x7f-\x9f]+)?$"
"""Routes that a signed link opens: they read one record and nothing else."""
Moment = Annotated[float | None, Query(allow_inf_nan=False, description="[s since 1970]")]


class Use(BaseModel):
    """A scene that uses a record, for one of its components."""

    scene: Annotated[Name, Field(min_length=1)]
    component: Annotated[Name, Field(min_length=1)]


class Doing(BaseModel):
    """What a command is doing."""

    model_config = ConfigDict(strict=True)  # A truth value is no number.

    command: Annotated[Name, Field(min_length=1, max_length=20)]
    scene: Name
    stage: Name
    share: Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
    """Of the stage that is done."""
    begun: Annotated[float, Field(ge=0.0, le=1e11, allow_inf_nan=False)]
    """[s since 1970]"""
    host: Name


class Target(BaseModel):
    """The record that a tag is of."""

    key: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


@router.get("/keys", responses=PROBLEMS)
def get_keys(context: Reader) -> list[str]:
    """Return the keys of all records, sorted."""
    return list(context.store.keys())


@router.get("/records", responses=PROBLEMS)
def get_records(
    context: Reader, *, kind: Text = "", scene: Text = "", component: Text = "", tag: Text = "", key: Text = "",
    text: Text = "", since: Moment = None, until: Moment = None,
    where: Annotated[list[Stated] | None, Query(max_length=20, description="such as material.E>=2e11")] = None,
    limit: Annotated[int | None, Query(ge=1, le=10**9)] = None, inputs: bool = False,
) -> list[dict[str, Any]]:  # fmt: skip
    """Return the records that match, newest first."""
    entries = context.store.find(
        queries.Query(
            kind=kind, scene=scene, component=component, tag=tag, key=key, text=text, since=since, until=until,
            where=tuple(map(queries.condition, where or ())), limit=limit,
        )
    )  # fmt: skip
    return [row if inputs else row | {"inputs": {}} for row in (e.as_json() for e in entries)]


@router.get("/records/{key}/info", responses=PROBLEMS)
def get_info(key: Key, context: Linked) -> JSONResponse:
    """Return kind, inputs, attributes and fields of a record, without its arrays."""
    with context.store.opened(key) as (source, head):
        body = {"key": key, "kind": head.kind, "size": source.length, "inputs": head.inputs, "fields": fields(head),
                "attributes": {name: value for name, value in head.root.attributes.items() if name not in
                               hdf5.BESIDE and not isinstance(value, float | None)}}  # fmt: skip
    return JSONResponse(body, headers=headers_of(key))


def fields(head: hdf5.Head) -> list[dict[str, Any]]:
    """Return path, shape, type and bytes of every array of a record."""
    rows = []
    for path in hdf5.dataset_bytes(head):
        dataset = arrays.dataset_of(head, path)
        rows.append({"path": path, "shape": list(dataset.shape), "dtype": dataset.dtype, "bytes": dataset.nbytes})
    return rows


@router.get(
    "/records/{key}/field/{path:path}", response_class=Response,
    responses=PROBLEMS | {200: {"content": NPY | {"application/json": {}}, "description": "the numbers"}},
)  # fmt: skip
def get_field(
    key: Key, path: Annotated[str, Path(max_length=500)], context: Linked, *,
    rows: Choice = None,
    columns: Choice = None,
    surface: Annotated[str | None, Query(max_length=500, description="rows: nodes of a surface of the mesh")] = None,
    format: Literal["npy", "json"] = "npy",
) -> Response:  # fmt: skip
    """Return an array, or chosen rows (first axis) and columns (last axis) of it."""
    with context.store.opened(key) as (source, head):
        dataset = arrays.dataset_of(head, path)
        count = dataset.shape[0] if dataset.shape else 0
        chosen_rows = None if rows is None else arrays.chosen(rows, count, "rows")
        if surface is not None:
            if context.who == LINK:
                raise Refused(403, "surface: a link opens this record alone, and not that of its mesh")
            if rows is not None:
                raise arrays.Wrong("surface, rows: give only one of them")
            chosen_rows = surface_nodes(context, key, head, surface)
            if len(chosen_rows) and chosen_rows[-1] >= count:
                raise arrays.Wrong(f"surface: {path} has {count} rows, which are not the nodes of a mesh")
        values = arrays.read_part(source, dataset, chosen_rows, arrays.columns_of(columns, dataset.shape))
    if format == "json":
        return JSONResponse(arrays.json_part(values), headers=headers_of(key))
    return Response(arrays.npy_bytes(values), 200, headers_of(key), "application/x-npy")


def surface_nodes(context: Any, key: str, head: hdf5.Head, surface: str) -> np.ndarray:
    """Return the nodes of a named surface of a record's mesh, ascending, (k,)."""
    mesh = key if head.kind == "mesh" else head.root.attributes.get("mesh_key")
    if not isinstance(mesh, str):
        raise arrays.Wrong(f"surface: a {head.kind} record has no mesh")
    mesh_record = context.store.get(mesh, "mesh", only=[f"surfaces/{surface}"]) if "/" not in surface else None
    if mesh_record is None or surface not in mesh_record.surfaces:
        names = context.store.get(mesh, "mesh", only=["surfaces"]).surfaces
        raise arrays.Wrong(f"no surface '{surface[:80]}'; there are {', '.join(sorted(names)[:20])}", 404)
    return np.unique(mesh_record.surfaces[surface].facets)


@router.get("/records/{key}/spectrum", responses=PROBLEMS)
def get_spectrum(key: Key, context: Linked) -> JSONResponse:
    """Return the frequencies [Hz] of modes with the estimated relative errors of each, null where there is none."""
    only = ["angular_frequencies", "residuals", "algebraic_errors", "discretisation_errors", "normal_count"]
    modes = context.store.get(key, "modes", only=only)
    numbers = {
        "frequencies": modes.angular_frequencies / (2 * np.pi), "residuals": modes.residuals,
        "algebraic_errors": modes.algebraic_errors, "discretisation_errors": modes.discretisation_errors,
    }  # fmt: skip
    body = {name: None if array is None else arrays.json_part(array)["values"] for name, array in numbers.items()}
    return JSONResponse(body | {"normal_count": modes.normal_count}, headers=headers_of(key))


@router.get("/records/{key}/examine", responses=PROBLEMS)
def get_examined(key: Key, context: Linked) -> dict[str, Any]:
    """Read all of a record; return why it cannot be used."""
    fault = context.store.examine(key)
    if isinstance(fault, RecordMissing):
        raise fault
    return {"fault": None if fault is None else {"error": type(fault).__name__, "detail": str(fault)}}


@router.post("/records/{key}/uses", responses=PROBLEMS)
def post_use(key: Key, use: Use, context: Writer) -> dict[str, str]:
    """Note that a scene uses a record."""
    with context.store.opened(key):
        context.store.note(key, use.scene, use.component)
    return {"key": key}


@router.post("/records/{key}/link", responses=PROBLEMS)
def post_link(
    key: Key, context: Reader, seconds: Annotated[int, Query(ge=1, le=LONGEST_LINK)] = 3600, *,
    route: Annotated[str, Query(max_length=500, pattern=ROUTES, description="such as info; all of them if none")] = "",
) -> dict[str, str | int]:  # fmt: skip
    """Return a link by which anybody may read this record, or one route of it, for some time."""
    service: Service = context.request.app.state.service
    with context.store.opened(key):
        expires = int(time.time()) + seconds
    end = f"/{route}" if route else ""
    signature = service.access.signature(f"{context.name}/{key}{end}", expires)
    path = f"/{context.name}/records/{key}{quote(end)}?expires={expires}&signature={signature}"
    context.log("link", key, expires=expires, route=route or "all")
    return {"path": path, "expires": expires}


@router.get("/running", responses=PROBLEMS)
def get_running(context: Reader) -> list[dict[str, Any]]:
    """Return what commands are doing that use this database."""
    return context.store.running()


@router.put("/running/{name}", responses=PROBLEMS)
def put_running(name: Running, row: Doing, context: Writer) -> dict[str, str]:
    """Keep what a command is doing, until it says something else, ends, or says nothing for a while."""
    context.store.tell(name, row.model_dump())
    return {"name": name}


@router.delete("/running/{name}", responses=PROBLEMS)
def delete_running(name: Running, context: Writer) -> dict[str, str]:
    """Note that a command has ended."""
    context.store.tell(name, None)
    return {"name": name}


@router.put("/tags/{tag}", responses=PROBLEMS)
def put_tag(tag: Tag, target: Annotated[Target, Body()], context: Writer) -> dict[str, str]:
    """Give a tag to a record."""
    context.store.tag(tag, target.key)
    context.log("tag", target.key, tag=tag)
    return {"tag": tag, "key": target.key}


@router.delete("/tags/{tag}", responses=PROBLEMS)
def delete_tag(tag: Tag, context: Writer) -> dict[str, str]:
    """Take a tag away."""
    context.store.tag(tag, None)
    context.log("untag", "-", tag=tag)
    return {"tag": tag}


@router.post("/records/{key}/aside", responses=PROBLEMS)
def post_aside(key: Key, context: Remover) -> dict[str, str]:
    """Set a record aside that cannot be used."""
    if (fault := context.store.examine(key)) is None:
        raise arrays.Wrong(f"record {key[:12]}… is sound", 422)
    if isinstance(fault, RecordMissing | StoreUnusable):
        raise fault
    name = context.store.set_aside(context.store.place(key))
    context.log("aside", key)
    return {"name": name}


@router.delete("/records/{key}", responses=PROBLEMS)
def delete_record(key: Key, context: Remover) -> dict[str, str]:
    """Remove a record."""
    if isinstance(fault := context.store.fault(key), RecordMissing):
        raise fault
    context.store.remove(key)
    context.log("delete", key)
    return {"key": key}


@router.get("/leftovers", responses=PROBLEMS)
def get_leftovers(context: Reader) -> list[dict[str, Any]]:
    """Return what writers that were killed have left, and damaged records that were set aside."""
    root = context.store.root
    leftovers = context.store.leftovers()
    return [{"name": e.place.removeprefix(f"{root}/"), "size": e.size, "why": e.why} for e in leftovers]


@router.delete("/leftovers/{name:path}", responses=PROBLEMS)
def delete_leftover(name: Annotated[str, Path(max_length=200)], context: Remover) -> dict[str, str]:
    """Remove a leftover."""
    context.store.remove(f"{context.store.root}/{name}")
    context.log("delete", name)
    return {"name": name}
