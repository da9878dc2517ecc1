"""A part from a CAD file, meshed with curved tet10: size by curvature and by named surface."""

import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, field_validator

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cad.faces import Face, distances, faces_of
from gudgeon.pipeline.geometry.cad.reading import read_solids, solid_name, solid_volume
from gudgeon.pipeline.geometry.cad.selection import FaceRule, Number, faces_by_name
from gudgeon.pipeline.geometry.cad.sizing import COARSE, FINEST, Sizing, rounded_up, with_edges
from gudgeon.pipeline.geometry.cad.units import model_scale
from gudgeon.pipeline.geometry.cells import FLAT_TRIANGLES, GMSH_ORDER, TETRA10, Block, boundary_facets
from gudgeon.pipeline.geometry.mesh_estimate import NODES, cost_text, of_nodes, refuse_large
from gudgeon.pipeline.geometry.occ import GMSH_TETRA10, GMSH_TRIANGLE6, generate, meshing, nodes_and_cells
from gudgeon.pipeline.geometry.soundness import refuse_pieces
from gudgeon.pipeline.geometry.surfaces import SurfaceRule
from gudgeon.pipeline.process.call import at_most, called_apart
from gudgeon.solver.numbers import Length, Name, Strict

log = logging.getLogger(__name__)
TURN = 14
"""Default number of elements around a full circle."""
LEAST_TURN, MOST_TURN = 6, 200
COARSENESSES = (COARSE, COARSE / 2, COARSE / 4)
"""Least sizes where nothing acts, in their order, until no element is flat or turns inside out."""
ATTEMPTS = 6
"""Meshes of growing size until one has no more nodes than allowed."""
GROWTH = 1.15
"""Of the size at least, from one to the next."""
SPARE = 0.75
"""Share of the allowed nodes that are estimated for the first of them."""
PASSES = 3
"""In which inverted elements are straightened: their neighbours may be inverted thereby."""
LEAST_SECONDS, SECONDS_PER_NODE = 120.0, 5e-3
"""CPU time after which a part is not meshed to its end: gmsh takes up to 3e-4 s a node."""
ON_FACE = 1e-6
"""Distance of a point from a face on which it lies, over the part's extent, beyond that from the nearest one."""
SAME_AREA, SMALL_FACE = 0.3, 1e-4
"""Share by which a face may differ from its mesh: six elements around a small sphere leave 0.2. Faces of less than the
second share of the boundary are not compared."""
SKIN = "skin"
"""The whole boundary."""
OPTIONS: dict[str, float] = {
    "Algorithm": 6, "Algorithm3D": 1, "ElementOrder": 1, "MeshSizeExtendFromBoundary": 1, "MeshSizeFactor": 1,
    "RecombineAll": 0, "SecondOrderIncomplete": 0, "SecondOrderLinear": 0, "SubdivisionAlgorithm": 0,
}  # fmt: skip
"""gmsh's defaults that a script may change."""


class Places(NamedTuple):
    """Where something acts on a part: contacts, joints, supports, loads, gauges."""

    surfaces: tuple[str, ...]
    points: tuple[tuple[float, ...], ...] = ()
    """[m]"""


class Fineness(NamedTuple):
    """How fine a mesh is."""

    size: float | None
    """Edge length [m]; None: by the number of nodes."""
    nodes: int
    """Allowed where the size is left out."""
    acted_on: Places | None
    """Where curved faces have elements by curvature alone; None: everywhere."""


class CadPart(Strict):
    """Solids of a STEP, IGES or BREP file, or of a script of gmsh (.geo)."""

    kind: Literal["cad"]
    path: str = Field(description="File of the part, from the folder of the scene")
    unit: Length | None = Field(
        default=None, description="Metres per unit of length of the file; default: as the file states, needed if none"
    )
    solids: tuple[Number | str, ...] = Field(
        default=(), description="Numbers or names of the solids that the component takes; default: all, glued"
    )
    surfaces: dict[Name, FaceRule] = Field(
        default={},
        description="Faces by name; without it each face is a surface `face1`, `face2`, … as `gudgeon faces` shows",
    )
    around: int = Field(
        default=TURN, ge=LEAST_TURN, le=MOST_TURN,
        description="Elements around a full circle of a curved face; where nothing acts they have half of mesh.size or"
        " more",
    )  # fmt: skip
    sizes: dict[Name, Length] = Field(
        default={}, description="Edge length of the elements on named surfaces [m], where it is below mesh.size"
    )

    @field_validator("solids")
    @classmethod
    def _once(cls, value: tuple[int | str, ...]) -> tuple[int | str, ...]:
        twice = {v for v in value if value.count(v) > 1}
        if twice:
            raise ValueError(f"{', '.join(map(repr, twice))} given twice")
        return value

    def build(
        self,
        size: float | None,
        nodes: int = NODES,
        acted_on: Places | None = None,
        tell: Callable[[str], None] = lambda text: None,
    ) -> MeshRecord:
        """Mesh the part with elements of edge length `size` [m], or by about so many nodes as are allowed.

        Args:
            nodes: Allowed where the size is left out.
            acted_on: Where curved faces have elements by curvature alone; None: everywhere.
            tell: Called with nodes, memory and time by an estimate, before meshing.

        Raises:
            InputError: the file has no such part, a surface matches no face or several, or the size does not fit.
            StageError: gmsh failed.
        """
        fineness = Fineness(size, nodes, acted_on)
        chosen, estimate = called_apart(self.path, "gmsh", _estimated, self, fineness)
        tell(cost_text("solid", estimate))
        refuse_large("solid", of_nodes("solid", estimate).elements, chosen)
        if size is not None and estimate > nodes:
            text = "mesh.size: %g m gives %s, more nodes than mesh.nodes, %s, which the size precedes"
            log.warning(text, size, cost_text("solid", estimate), f"{nodes:,}")
        record = called_apart(self.path, "gmsh", _meshed, self, fineness, chosen)
        refuse_pieces(record, self.path)
        return record

    def size_within(self, size: float, nodes: int = NODES, acted_on: Places | None = None) -> tuple[float, float]:
        """Return an edge length [m], or a larger one that gives about so many nodes, and about how many a mesh has.

        Raises:
            InputError, StageError: see `build`.
        """
        chosen, estimate = called_apart(self.path, "gmsh", _estimated, self, Fineness(size, nodes, acted_on))
        if estimate > SPARE * nodes:
            chosen, estimate = called_apart(self.path, "gmsh", _estimated, self, Fineness(None, nodes, acted_on))
        return chosen, estimate


class OpenPart(NamedTuple):
    """A part in gmsh's model."""

    gmsh: Any
    solids: list[int]
    faces: list[Face]
    scale: float
    """Metres per unit of the model."""

    def exact_volume(self) -> float:
        """Return the volume [m^3]; NaN of gmsh's own kernel."""
        return sum(solid_volume(self.gmsh, tag) for tag in self.solids) * self.scale**3

    def volume(self) -> float:
        """Return the volume [m^3]; of gmsh's own kernel by samples of the faces, within a factor of two."""
        exact = self.exact_volume()
        return exact if math.isfinite(exact) else sum(face.share for face in self.faces)

    def away(self, faces: Sequence[Face], point: np.ndarray) -> np.ndarray:
        """Return the distances of faces from a point [m], (k,)."""
        return distances(self.gmsh, faces, point, self.scale)


@contextmanager
def opened(cad: CadPart) -> Iterator[OpenPart]:
    """Give a part in gmsh's model, and close gmsh at the end.

    Raises:
        InputError: the file is no part, see `read_solids`.
        StageError: gmsh failed.
    """
    if not Path(cad.path).is_file():
        raise InputError(f"{cad.path}: no such file")
    scale = model_scale(cad.path, cad.unit)
    with meshing(1.0, {}, cad.path) as gmsh:
        solids = read_solids(gmsh, cad.path, cad.solids)
        yield OpenPart(gmsh, solids, faces_of(gmsh, cad.path, solids, scale), scale)


def _estimated(cad: CadPart, fineness: Fineness) -> tuple[float, float]:
    """Return the edge length of a part [m] and about how many nodes it gives, in this process."""
    with opened(cad) as opened_part:
        named = faces_by_name(cad.surfaces, opened_part.faces, opened_part.away, cad.path)
        sizing, size = _sizing(cad, opened_part, named, fineness.acted_on), fineness.size
        extent = opened_part.faces[0].extent
        chosen = sizing.size_for(int(SPARE * fineness.nodes), extent / 2) if size is None else size
        return chosen, sizing.nodes(chosen)


def _sizing(
    cad: CadPart, opened_part: OpenPart, named: Mapping[str, tuple[list[Face], SurfaceRule]], acted_on: Places | None
) -> Sizing:
    if unknown := [name for name in cad.sizes if name not in named]:
        have = ", ".join(cad.surfaces) or "face1, face2, …"
        raise InputError(f"{cad.path}: sizes.{unknown[0]}: no surface of this name; surfaces are {have}")
    acted = _acted(cad, opened_part, named, acted_on)
    fine = [(length, [face.number for face in named[name][0]]) for name, length in cad.sizes.items()]
    sizing = Sizing(opened_part.faces, acted, cad.around, opened_part.scale, opened_part.volume(), fine)
    return with_edges(opened_part.gmsh, sizing)


def _acted(
    cad: CadPart, opened_part: OpenPart, named: Mapping[str, tuple[list[Face], SurfaceRule]], acted_on: Places | None
) -> frozenset[int]:
    """Return the numbers of the faces on which something acts."""
    faces = opened_part.faces
    if acted_on is None:
        return frozenset(face.number for face in faces)
    surfaces = [named[name][0] for name in (*cad.sizes, *acted_on.surfaces) if name in named]
    acted = {face.number for surface in surfaces for face in surface}
    for point in acted_on.points:
        distance = opened_part.away(faces, np.array(point))
        nearest = distance <= distance.min() + ON_FACE * faces[0].extent
        acted |= {face.number for face, on in zip(faces, nearest, strict=True) if on}
    return frozenset(acted)


def _meshed(cad: CadPart, fineness: Fineness, size: float) -> MeshRecord:
    """Mesh a part with elements of edge length `size` [m], or larger ones where it has more nodes than are allowed, in
    this process; see `CadPart.build`."""
    with opened(cad) as opened_part:
        gmsh, scale = opened_part.gmsh, opened_part.scale
        named = faces_by_name(cad.surfaces, opened_part.faces, opened_part.away, cad.path)
        sizing = _sizing(cad, opened_part, named, fineness.acted_on)
        for _ in range(ATTEMPTS):
            with at_most(LEAST_SECONDS + SECONDS_PER_NODE * sizing.nodes(size)):
                _generate(gmsh, sizing, size)
            count = len(gmsh.model.mesh.getNodes()[0])
            if fineness.size is not None or count <= fineness.nodes:
                break
            size = rounded_up(GROWTH * size * count / fineness.nodes)
        _refuse_damaged(gmsh, opened_part.faces, scale, cad.path)
        record = _collected(gmsh, named, scale, cad.path)
        return replace(record, volumes=_volumes(gmsh, opened_part.solids)) if len(opened_part.solids) > 1 else record


def _generate(gmsh: Any, sizing: Sizing, size: float) -> None:
    """Make elements of edge length `size` [m], finer ones on blends where coarse ones turn inside out."""
    fine = [(length / sizing.scale, faces) for length, faces in sizing.fine]
    for coarse in COARSENESSES:
        _set_sizes(gmsh, size / sizing.scale, sizing.around, fine)
        sizing.apply(gmsh, size / sizing.scale, coarse)
        try:
            return generate(gmsh.model.mesh, size, repair=True, straighten=partial(_straighten, gmsh, sizing.acted))
        except InputError:
            if coarse == COARSENESSES[-1] or len(sizing.acted) == len(sizing.faces):
                raise


def _straighten(gmsh: Any, acted: frozenset[int]) -> None:
    """Put nodes of inverted elements into the middle of their edges, except on faces on which something acts.

    gmsh's own repair takes minutes where many elements are longer than the radius of the blend that they lie on.
    """
    mesh = gmsh.model.mesh
    tags, coordinates, _ = mesh.getNodes()
    points = np.zeros((int(tags.max()) + 1, 3))
    points[tags.astype(int)] = coordinates.reshape(-1, 3)
    acted_nodes = np.concatenate([mesh.getNodes(2, face, includeBoundary=True)[0] for face in acted] or [tags[:0]])
    elements, nodes = mesh.getElementsByType(GMSH_TETRA10)
    rows = nodes.astype(int).reshape(-1, 10)[:, GMSH_ORDER]
    for _ in range(PASSES):
        inverted = rows[np.asarray(mesh.getElementQualities(elements, "minDetJac")) <= 0]
        ends, middles = inverted[:, TETRA10.shape.edges].reshape(-1, 2), inverted[:, TETRA10.shape.corners :].ravel()
        movable = ~np.isin(middles, acted_nodes)
        for node, pair in zip(middles[movable].tolist(), ends[movable], strict=True):
            mesh.setNode(node, points[pair].mean(axis=0).tolist(), [])


def _set_sizes(gmsh: Any, size: float, around: int, fine: Sequence[tuple[float, list[int]]]) -> None:
    """Set what gmsh makes elements by, over what a script may have set.

    Args:
        size: Edge length, in the model's unit, as all lengths here.
        fine: Edge lengths on faces, with their numbers.
    """
    low = min([FINEST * size, *(length for length, _ in fine)])
    for name, value in {**OPTIONS, "MeshSizeMin": low, "MeshSizeMax": size, "MeshSizeFromCurvature": around}.items():
        gmsh.option.setNumber(f"Mesh.{name}", value)
    gmsh.model.mesh.clear()
    fields = gmsh.model.mesh.field
    numbers = []
    for length, faces in fine:
        field = fields.add("Constant")
        fields.setNumbers(field, "SurfacesList", faces)
        fields.setNumber(field, "VIn", min(length, size))
        fields.setNumber(field, "VOut", size)
        numbers.append(field)
    if numbers:
        smallest = fields.add("Min")
        fields.setNumbers(smallest, "FieldsList", numbers)
        fields.setAsBackgroundMesh(smallest)


def _refuse_damaged(gmsh: Any, faces: Sequence[Face], scale: float, path: str) -> None:
    """Raise an InputError where a face as it is meshed has not the area that the file gives it."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    points = np.empty((int(tags.max()) + 1, 3))
    points[tags.astype(int)] = coordinates.reshape(-1, 3) * scale
    total_area = sum(face.area for face in faces)
    for face in faces:
        nodes = gmsh.model.mesh.getElementsByType(GMSH_TRIANGLE6, face.number)[1].astype(int).reshape(-1, 6)
        a, b, c = np.moveaxis(points[nodes[:, FLAT_TRIANGLES].reshape(-1, 3)], 1, 0)
        area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
        if abs(area - face.area) > SAME_AREA * face.area and face.area > SMALL_FACE * total_area:
            raise InputError(
                f"{path}: face {face.number}, a {face.kind}, has {face.area:.4g} m^2 by the file and {area:.4g} m^2 as"
                " it is meshed: its boundary is damaged. IGES often is: write the part as STEP, or repair the face"
            )


def _collected(gmsh: Any, named: Mapping[str, tuple[list[Face], SurfaceRule]], scale: float, path: str) -> MeshRecord:
    """Return gmsh's mesh with named surfaces, whose facets are turned outward."""
    nodes, cells, node_ids = nodes_and_cells(gmsh.model.mesh, GMSH_TETRA10, GMSH_ORDER)
    skin = boundary_facets([Block(TETRA10, np.arange(len(cells)), cells)], path)[1]
    corners = np.sort(skin[:, :3], axis=1)
    surfaces = {}
    for name, (faces, shape) in named.items():
        rows = [gmsh.model.mesh.getElementsByType(GMSH_TRIANGLE6, face.number)[1] for face in faces]
        triangles = node_ids[np.concatenate(rows).astype(int).reshape(-1, 6)]
        surfaces[name] = Surface(skin[_places(corners, np.sort(triangles[:, :3], axis=1))], shape)
    surfaces[SKIN] = surfaces.get(SKIN, Surface(skin))
    return MeshRecord(nodes * scale, cells, TETRA10.name, surfaces)


def _volumes(gmsh: Any, solids: Sequence[int]) -> dict[str, np.ndarray]:
    """Return the elements of each solid by its name, if only one has it, and as `solid1`, `solid2`, …"""
    every = gmsh.model.mesh.getElementsByType(GMSH_TETRA10)[0]
    order = np.argsort(every)
    cells_by_name, names = {}, [solid_name(gmsh, tag) for tag in solids]
    for i, (tag, name) in enumerate(zip(solids, names, strict=True), 1):
        element_tags = gmsh.model.mesh.getElementsByType(GMSH_TETRA10, tag)[0]
        cells_by_name[f"solid{i}"] = np.sort(order[np.searchsorted(every, element_tags, sorter=order)])
        if name and names.count(name) == 1:
            cells_by_name[name] = cells_by_name[f"solid{i}"]
    return cells_by_name


def _places(rows: np.ndarray, requested: np.ndarray) -> np.ndarray:
    """Return the places of wanted rows (w, 3) among different rows (k, 3), (w,)."""
    code = np.unique(np.concatenate([rows, requested]), axis=0, return_inverse=True)[1].ravel()
    row = np.empty(code.max() + 1, int)
    row[code[: len(rows)]] = np.arange(len(rows))
    return row[code[len(rows) :]]
