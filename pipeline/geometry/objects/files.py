"""Geometries of a scene in which meshes or matrices of Python stand in place of files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.objects.matrices import body_of, write_body
from gudgeon.pipeline.geometry.objects.mesh import deck_of_object, is_mesh, write_mesh

PARTS = ("component", "conductor")
"""Tables of parts with a geometry."""
SOLID, PLANE = "file", "plane-file"
MATRICES = ("stiffness", "mass", "model")
"""Keys of a geometry of matrices that values of Python may have."""
DIMENSIONS = {SOLID: 3, PLANE: 2}
"""Dimension of the cells of a geometry from a mesh."""


def with_files(tables: Mapping[str, Any], folder: Path, source: str) -> dict[str, Any]:
    """Return the tables of a scene with what Python gives in place of files written into a folder, by content.

    A geometry may be a mesh of meshio or scikit-fem, a basis, or a tuple of stiffness, mass, nodes and, if there are
    any, sets of nodes by name. A mesh may stand for `path` of a geometry `file` or `plane-file`, matrices for
    `stiffness` and `mass` of `matrices`, and nodes, a mesh or a basis for its `model`, with `sets`.

    Args:
        source: The scene in messages.

    Raises:
        InputError: such an object is wrong; see `deck_of_object` and `body_of`.
    """
    result = dict(tables)
    for table in PARTS:
        entries = tables.get(table)
        if isinstance(entries, Mapping):
            result[table] = {
                name: _part(settings, folder, f"{source}: {table}.{name}") for name, settings in entries.items()
            }
    return result


def _part(settings: Any, folder: Path, key: str) -> Any:
    if not isinstance(settings, Mapping) or "geometry" not in settings:
        return settings
    return {**settings, "geometry": _geometry(settings["geometry"], folder, f"{key}.geometry")}


def _geometry(geometry: Any, folder: Path, key: str) -> Any:
    if isinstance(geometry, tuple):
        if len(geometry) not in (3, 4):
            raise InputError(f"{key}: a tuple of {len(geometry)} given; allowed: stiffness, mass, nodes and, if there"
                             " are any, sets of nodes by name")  # fmt: skip
        geometry = {"kind": "matrices", **dict(zip((*MATRICES, "sets"), geometry, strict=False))}
    elif is_mesh(geometry):
        geometry = {"kind": SOLID, "path": geometry}
    kind = geometry.get("kind") if isinstance(geometry, Mapping) else None
    if kind in DIMENSIONS and is_mesh(geometry.get("path")):
        return {"unit": 1.0, **geometry, "path": str(_mesh_file(geometry, folder, key))}
    return _matrices(geometry, folder, key) if kind == "matrices" else geometry


def _matrices(geometry: Mapping[str, Any], folder: Path, key: str) -> Mapping[str, Any]:
    """Return a geometry of matrices with those that Python gives in files; all of them are files, or none."""
    supplied = [name for name in MATRICES if not isinstance(geometry.get(name), str | Path | None)]
    if not supplied:
        return geometry
    if missing := [name for name in MATRICES if name not in supplied]:
        raise InputError(f"{key}.{missing[0]}: {geometry.get(missing[0])!r} given; allowed: a value of Python,"
                         f" as {supplied[0]} is")  # fmt: skip
    others = {name: value for name, value in geometry.items() if name not in (*MATRICES, "sets")}
    K, M, nodes = (geometry[name] for name in MATRICES)
    return others | write_body(body_of(K, M, nodes, geometry.get("sets", {}), key), folder)


def _mesh_file(geometry: Mapping[str, Any], folder: Path, key: str) -> Path:
    deck, kind = deck_of_object(geometry["path"], key), geometry["kind"]
    dimension = max((block.cell.dimension for block in deck.blocks), default=0)
    if dimension != DIMENSIONS[kind]:
        cells = ", ".join(sorted({block.cell.name for block in deck.blocks})) or "no cells"
        needed = "solid cells" if kind == SOLID else "triangle6 alone"
        raise InputError(f"{key}: the mesh has {cells}; allowed with kind '{kind}': {needed}")
    return write_mesh(deck, folder)
