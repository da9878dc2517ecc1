"""What the page shows of results: stress of modes, films of runs, error over run time of reports."""

from dataclasses import replace
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Path, Query
from fastapi.responses import JSONResponse, Response
from pydantic import ValidationError

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.interfaces.stress_recovery import hooke, strain_rows, von_mises
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.service import arrays, skin
from gudgeon.pipeline.service.context import PROBLEMS, Key, Linked, Reader
from gudgeon.pipeline.service.files import headers_of

router = APIRouter(prefix="/{database}", tags=["views"])
MOST_NUMBERS = 6_000_000
"""Coordinates of all frames of a film, 24 MB."""
FLOATS = {"application/octet-stream": {}}


def mesh_of(store: FolderStore, key: str) -> MeshRecord:
    """Return nodes and cells of the mesh of a record of modes, of a design or of a mesh, those of a design moved.

    Raises:
        Wrong: the record has no mesh.
    """
    only = ["nodes", "cells", "cell_type", "formulations"]
    with store.opened(key) as (_, head):
        mesh = key if head.kind == "mesh" else head.root.attributes.get("mesh_key")
        if not isinstance(mesh, str):
            raise arrays.Wrong(f"a {head.kind} record has no mesh")
        kind = head.kind
    record = store.get(mesh, "mesh", only=only)
    nodes = store.get(key, "morph", only=["nodes"]).nodes if kind == "morph" else None
    return record if nodes is None else replace(record, nodes=nodes)


@router.get(
    "/records/{key}/skin/{mode}/stress", response_class=Response,
    responses=PROBLEMS | {200: {"content": FLOATS, "description": "float32, point by point"}},
)  # fmt: skip
def get_mode_stress(key: Key, mode: Annotated[int, Path(ge=0, le=10**6)], context: Reader) -> Response:
    """Return the von Mises stress of a mode shape at the points of the skin, its largest being 1; solids only."""
    mesh = mesh_of(context.store, key)
    with context.store.opened(key, "modes") as (source, head):
        dataset = arrays.dataset_of(head, "shapes")
        column = arrays.chosen(str(mode), dataset.shape[2], "mode")
        nodes = skin.skin_of(mesh).nodes
        shape = arrays.read_part(source, dataset, None, column)[:, :, 0]
    stress = von_mises(_stress(context.store, key, mesh, nodes, shape[..., None])[..., 0])
    largest = float(stress.max(initial=0.0))
    return Response(
        np.ascontiguousarray(stress / largest if largest > 0 else stress, "<f4").tobytes(), 200, headers_of(key),
        "application/octet-stream",
    )  # fmt: skip


def _stress(store: FolderStore, modes: str, mesh: MeshRecord, nodes: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Return the stress of displacements (n, 3, m) at some nodes, (k, 6, m).

    Raises:
        Wrong: the part is no solid of one material, or the libraries of the pipeline are not installed.
    """
    if not (cell := cell_of(mesh)).solid:
        raise arrays.Wrong(f"stress: a mesh of {cell.name}; only that of solids is recovered here")
    try:
        material = Material.model_validate(store.provenance(modes).get("material"))
    except ValidationError:
        raise arrays.Wrong("stress: the record does not name one material") from None
    if getattr(material, "volumes", None):
        raise arrays.Wrong("stress: the part has several materials")
    try:
        rows = strain_rows(mesh, nodes, material)
    except ModuleNotFoundError as error:
        raise arrays.Wrong(f"stress: {error.name} is not installed on the server", 422) from None
    strain = (rows @ shapes.reshape(-1, shapes.shape[2])).reshape(len(nodes), 6, -1)
    return np.einsum("ij,kjm->kim", hooke(material), strain)


@router.get("/records/{key}/film/{body}", responses=PROBLEMS)
def get_film(
    key: Key, body: Annotated[str, Path(max_length=200)], context: Reader, *,
    colour: Annotated[str, Query(pattern="^(displacement|stress)$")] = "displacement",
) -> JSONResponse:  # fmt: skip
    """Return a body of a run over time: triangles and points of its design [m], and for each frame the elastic
    displacement of the points [m], its rigid motion, and the size of the displacement [m] or the von Mises stress [Pa]
    that the elastic shapes have; float32 as base64, frame by frame. Frames are left out where there are many."""
    store = context.store
    only = ["bodies", "coordinate_offsets", "frame_times", "frames"]
    run = store.get(key, "trajectory", only=only)
    if body not in run.bodies:
        raise arrays.Wrong(f"no body '{body[:80]}'; there are {', '.join(sorted(run.bodies)[:20])}", 404)
    design = run.bodies[body]
    morph = store.get(design, "morph", only=["modes_key", "mesh_key", "centre", "rigid_twists", "nodes"])
    mesh = mesh_of(store, design)
    seen = skin.skin_of(mesh)
    every = max(1, -(-len(run.frames) * len(seen.nodes) * 3 // MOST_NUMBERS))
    shapes, start = _shapes(store, morph.modes_key, len(mesh.nodes)), run.coordinate_offsets[body]
    coordinates = run.frames[::every, start : start + len(morph.rigid_twists) + shapes.shape[2]]
    q = coordinates[:, len(morph.rigid_twists) :]
    moved = np.einsum("kim,fm->fki", shapes[seen.nodes], q, optimize=True)
    if colour == "stress":
        each = _stress(store, morph.modes_key, mesh, seen.nodes, shapes)
        sizes = np.stack([von_mises(each @ amplitudes) for amplitudes in q])
    else:
        sizes = np.linalg.norm(moved, axis=2)
    twist = coordinates[:, : len(morph.rigid_twists)] @ morph.rigid_twists
    return JSONResponse(
        skin.skin_json(mesh)
        | {"times": run.frame_times[::every].tolist(), "moved": skin.packed(moved, "<f4"),
           "sizes": skin.packed(sizes, "<f4"), "largest": float(sizes.max(initial=0.0)), "every": every,
           "twists": twist.tolist(), "centre": morph.centre.tolist()},
        headers=headers_of(key),
    )  # fmt: skip


def _shapes(store: FolderStore, modes: str, nodes: int) -> np.ndarray:
    """Return the elastic shapes of a basis, (n, 3, m); raise Wrong where they are too large, or of another mesh."""
    with store.opened(modes, "modes") as (source, head):
        shapes = arrays.read_part(source, arrays.dataset_of(head, "shapes"))
    if len(shapes) != nodes:
        raise arrays.Wrong("the modes are of another mesh")
    return shapes


@router.get("/records/{key}/report", responses=PROBLEMS)
def get_report(key: Key, context: Linked) -> JSONResponse:
    """Return the runs of a report with their run time [s] and largest conservative error, and the one that it chose."""
    document = context.store.get(key, "report").document
    runs, choice = document.get("runs") or (), document.get("choice") or {}
    if not isinstance(runs, list | tuple) or not all(isinstance(r, dict) for r in (*runs, choice)):
        raise arrays.Wrong("the report is of another form: expected runs, a list of tables, and choice, a table")
    rows = [
        {"name": r.get("name", ""), "seconds": r.get("cpu_seconds"), "note": r.get("result", ""),
         "error": r.get("conservative_error", r.get("largest_error"))}
        for r in runs
    ]  # fmt: skip
    body = {"scene": document.get("scene"), "rows": rows, "choice": choice.get("run"), "why": choice.get("why", "")}
    return JSONResponse(arrays.finite(body), headers=headers_of(key))
