"""From a drawing in gmsh's OpenCASCADE kernel to a curved tet10 mesh with named surfaces."""

from collections.abc import Callable
from typing import Any

import numpy as np

from modaldb.schema import MeshRecord, Surface
from pipeline.errors import InputError, PipelineError, StageError

SurfaceRule = dict[str, Any]
"""The true shape of a named surface, as `modaldb.schema.Surface.shape`."""

GMSH_TETRA10, GMSH_TRIANGLE6 = 11, 9
MESHIO_TETRA10 = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
"""gmsh numbers the last two edges of a tet10 the other way round than meshio and VTK."""

ON_SURFACE = 1e-6
"""How far a CAD face's nodes may lie from the named shape, relative to its size."""


def build_solid(draw: Callable[[Any], None], size: float, surfaces: dict[str, SurfaceRule]) -> MeshRecord:
    """Draw a solid, mesh it, and name its faces.

    Args:
        draw: Adds the solid to gmsh's OCC model that it is given.
        size: Edge length [m].
        surfaces: The true shape of each name.

    Raises:
        InputError: the size is too coarse for the curved faces.
        StageError: gmsh failed, or a named surface has no face.
    """
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        draw(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        _straighten(gmsh.model.mesh, size)
        return _collect(gmsh.model.mesh, [tag for _, tag in gmsh.model.getEntities(2)], surfaces)
    except PipelineError:
        raise
    except Exception as error:
        raise StageError(f"gmsh: {str(error).splitlines()[0]}") from error
    finally:
        gmsh.finalize()


def _straighten(mesh: Any, size: float) -> None:
    """Let gmsh mend elements that curving their edges turned inside out."""

    def inverted() -> int:
        tags, _ = mesh.getElementsByType(GMSH_TETRA10)
        return int(np.count_nonzero(np.asarray(mesh.getElementQualities(tags, "minDetJac")) <= 0))

    if inverted():
        mesh.optimize("HighOrder")
    if count := inverted():
        raise InputError(f"mesh.size: {size} m is too coarse for the curved faces, {count} elements turn inside out")


def _collect(mesh: Any, faces: list[int], surfaces: dict[str, SurfaceRule]) -> MeshRecord:
    tags, positions, _ = mesh.getNodes()
    _, cell_nodes = mesh.getElementsByType(GMSH_TETRA10)
    cell_tags = cell_nodes.reshape(-1, 10)[:, MESHIO_TETRA10]
    used = np.unique(cell_tags)
    number = np.full(int(tags.max()) + 1, -1)
    number[used] = np.arange(len(used))
    row = np.empty(int(tags.max()) + 1, int)
    row[tags.astype(int)] = np.arange(len(tags))
    nodes = positions.reshape(-1, 3)[row[used]]
    facets: dict[str, list[np.ndarray]] = {name: [] for name in surfaces}
    for face in faces:
        _, face_nodes = mesh.getElementsByType(GMSH_TRIANGLE6, face)
        triangles = number[face_nodes.astype(int).reshape(-1, 6)]
        for name, shape in surfaces.items():
            if _lies_on(nodes[triangles.ravel()], shape):
                facets[name].append(triangles)
    for name, found in facets.items():
        if not found:
            raise StageError(f"geometry: no face of the solid lies on surface '{name}'")
    return MeshRecord(
        nodes=nodes,
        cells=number[cell_tags.astype(int)],
        cell_type="tetra10",
        surfaces={name: Surface(np.concatenate(facets[name]), surfaces[name]) for name in surfaces},
    )


def _lies_on(points: np.ndarray, shape: SurfaceRule) -> bool:
    from_origin = points - np.asarray(shape["origin"])
    if shape["kind"] == "plane":
        return bool(np.abs(from_origin @ np.asarray(shape["normal"])).max() < ON_SURFACE * np.ptp(points, axis=0).max())
    axis = np.asarray(shape["axis"])
    radial = np.linalg.norm(from_origin - np.outer(from_origin @ axis, axis), axis=1)
    return bool(np.abs(radial / shape["radius"] - 1).max() < ON_SURFACE)
