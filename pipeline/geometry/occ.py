"""From a drawing in gmsh's OpenCASCADE kernel to a curved tet10 mesh with named surfaces."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError, PipelineError, StageError

SurfaceRule = dict[str, Any]
"""The true shape of a named surface, as `modaldb.records.mesh.Surface.shape`."""

GMSH_TETRA4, GMSH_TETRA10, GMSH_TRIANGLE6 = 4, 11, 9
MESHIO_TETRA10 = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
"""gmsh numbers the last two edges of a tet10 the other way round than meshio and VTK."""

ON_SURFACE = 1e-5
"""How far a CAD face's nodes may lie from the named shape, relative to its size."""

FLAT = 1e-3
"""Least signed inverse condition number of a straight element, 1 where it is regular; sound meshes keep 0.1."""

TURN = 14
"""Least elements around a full circle: fewer on a pin bore leave curved elements that are nearly inside out."""

REVOLVED: dict[str, float] = {
    "Geometry.OCCUnionUnify": 0,  # keeps the halves of `revolve` apart
    "Mesh.Algorithm": 1,  # MeshAdapt: the others can make triangles out of three nodes of one straight edge
    "Mesh.Algorithm3D": 10,  # HXT: its optimiser also removes slivers from walls of one element's thickness
    "Mesh.MeshSizeFromCurvature": TURN,
    "Mesh.MeshSizeMin": 0,
}
"""Options for solids with walls and bores of few elements. The skirt goes without: its meshes are published."""


def build_solid(
    draw: Callable[[Any], None],
    size: float,
    surfaces: dict[str, SurfaceRule],
    *,
    options: Mapping[str, float] | None = None,
    prepare: Callable[[Any], None] | None = None,
) -> MeshRecord:
    """Draw a solid, mesh it, and name its faces.

    Args:
        draw: Adds the solid to gmsh's OCC model that it is given.
        size: Edge length [m].
        surfaces: The true shape of each name.
        options: Further options of gmsh by name, such as `REVOLVED`.
        prepare: Is given gmsh's model once its faces are known, to tie them before they are meshed. Elements that turn
            inside out are then not mended, since that moves nodes of tied faces apart.

    Raises:
        InputError: the size is too coarse for the curved faces, or gives flat elements.
        StageError: gmsh failed, or a named surface has no face.
    """
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        for name, value in (options or {}).items():
            gmsh.option.setNumber(name, value)
        draw(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        if prepare is not None:
            prepare(gmsh.model)
        gmsh.model.mesh.generate(3)
        _refuse_flat(gmsh.model.mesh, size)
        gmsh.model.mesh.setOrder(2)
        _straighten(gmsh.model.mesh, size, mend=prepare is None)
        outer = [tag for _, tag in gmsh.model.getEntities(2) if len(gmsh.model.getAdjacencies(2, tag)[0]) == 1]
        return _collect(gmsh.model.mesh, outer, surfaces)
    except PipelineError:
        raise
    except Exception as error:
        raise StageError(f"gmsh: {str(error).splitlines()[0]}") from error
    finally:
        gmsh.finalize()


def cylinder(radius: float, axis: Sequence[float] = (0, 0, 1), origin: Sequence[float] = (0, 0, 0)) -> SurfaceRule:
    """Return the shape of a circular cylinder of `radius` [m] about `axis` through `origin` [m]."""
    return {
        "kind": "cylinder",
        "radius": radius,
        "axis": [float(a) for a in axis],
        "origin": [float(x) for x in origin],
    }


def sphere(radius: float, origin: Sequence[float] = (0, 0, 0)) -> SurfaceRule:
    """Return the shape of a sphere of `radius` [m] about `origin` [m]."""
    return {"kind": "sphere", "radius": radius, "origin": [float(x) for x in origin]}


def plane(normal: Sequence[float], origin: Sequence[float]) -> SurfaceRule:
    """Return the shape of the plane through `origin` [m] with the outward unit `normal`."""
    return {"kind": "plane", "normal": [float(a) for a in normal], "origin": [float(x) for x in origin]}


def box_faces(lx: float, ly: float, lz: float) -> dict[str, SurfaceRule]:
    """Return the faces of a block centred in x and y, from z = 0 up to z = lz [m]."""
    x, y = lx / 2, ly / 2
    return {
        "left": plane((-1, 0, 0), (-x, 0, 0)),
        "right": plane((1, 0, 0), (x, 0, 0)),
        "front": plane((0, -1, 0), (0, -y, 0)),
        "back": plane((0, 1, 0), (0, y, 0)),
        "bottom": plane((0, 0, -1), (0, 0, 0)),
        "top": plane((0, 0, 1), (0, 0, lz)),
    }


def revolve(occ: Any, section: Sequence[tuple[float, float]]) -> list[tuple[int, int]]:
    """Turn a polygon of radii and heights [m] about the z axis and return the solid, as gmsh's (dimension, tag).

    It is made of two halves that meet at ±y, if drawn with `REVOLVED`: gmsh meshes a closed cylinder badly once a cut
    has left only a piece of its seam. Nodes line up where the halves meet, of which thrust sides at ±x are to be free.
    """
    halves = []
    for turn in (np.pi, -np.pi):
        corners = [occ.addPoint(0, radius, height) for radius, height in section]
        edges = [occ.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
        face = (2, occ.addPlaneSurface([occ.addCurveLoop(edges)]))
        halves.append([entity for entity in occ.revolve([face], 0, 0, 0, 0, 0, 1, turn) if entity[0] == 3])
    return occ.fuse(*halves)[0]


def _refuse_flat(mesh: Any, size: float) -> None:
    """Stop before gmsh's curving, which cannot mend flat elements and may end the whole process over them."""
    tags, _ = mesh.getElementsByType(GMSH_TETRA4)
    if count := int(np.count_nonzero(np.asarray(mesh.getElementQualities(tags, "minSICN")) < FLAT)):
        raise InputError(f"mesh.size: at {size} m gmsh makes {count} flat elements, try another size")


def _straighten(mesh: Any, size: float, mend: bool) -> None:
    """Let gmsh mend elements that curving their edges turned inside out, or refuse them."""

    def inverted() -> int:
        tags, _ = mesh.getElementsByType(GMSH_TETRA10)
        return int(np.count_nonzero(np.asarray(mesh.getElementQualities(tags, "minDetJac")) <= 0))

    if mend and inverted():
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
    if shape["kind"] == "cylinder":
        axis = np.asarray(shape["axis"])
        from_origin = from_origin - np.outer(from_origin @ axis, axis)
    return bool(np.abs(np.linalg.norm(from_origin, axis=1) / shape["radius"] - 1).max() < ON_SURFACE)
