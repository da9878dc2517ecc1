"""A part from a CAD file, meshed with curved tet10: size by curvature and by named surface."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, field_validator

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cad.faces import Face, distances, faces_of
from gudgeon.pipeline.geometry.cad.reading import read_solids, solid_name, solid_volume
from gudgeon.pipeline.geometry.cad.selection import FaceRule, Number, faces_by_name
from gudgeon.pipeline.geometry.cad.units import model_scale
from gudgeon.pipeline.geometry.cells import FLAT_TRIANGLES, GMSH_ORDER, TETRA10, Block, boundary_facets
from gudgeon.pipeline.geometry.mesh_estimate import refuse_large
from gudgeon.pipeline.geometry.occ import GMSH_TETRA10, GMSH_TRIANGLE6, generate, meshing, nodes_and_cells
from gudgeon.pipeline.geometry.soundness import refuse_pieces
from gudgeon.pipeline.geometry.surfaces import SurfaceRule
from gudgeon.pipeline.process.call import called_apart
from gudgeon.solver.numbers import Length, Name, Strict

TURN = 14
"""Default number of elements around a full circle."""
LEAST_TURN, MOST_TURN = 6, 200
FINEST = 1 / 20
"""Least element size by curvature, over the size of the mesh: blends of small radius do not fill the memory."""
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
        default=TURN, ge=LEAST_TURN, le=MOST_TURN, description="Elements around a full circle of a curved face"
    )
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

    def build(self, size: float) -> MeshRecord:
        """Mesh the part with elements of edge length `size` [m].

        Raises:
            InputError: the file has no such part, a surface matches no face or several, or the size does not fit.
            StageError: gmsh failed.
        """
        record = called_apart(self.path, "gmsh", _meshed, self, size)
        refuse_pieces(record, self.path)
        return record


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


def _meshed(cad: CadPart, size: float) -> MeshRecord:
    """Mesh a part with elements of edge length `size` [m], in this process; see `CadPart.build`."""
    with opened(cad) as opened_part:
        gmsh, scale = opened_part.gmsh, opened_part.scale
        named = faces_by_name(cad.surfaces, opened_part.faces, opened_part.away, cad.path)
        unknown = [name for name in cad.sizes if name not in named]
        if unknown:
            have = ", ".join(cad.surfaces) or "face1, face2, …"
            raise InputError(f"{cad.path}: sizes.{unknown[0]}: no surface of this name; surfaces are {have}")
        volume, area = opened_part.volume(), sum(face.area for face in opened_part.faces)
        refuse_large("solid", max(5.0 * volume / size**3, 4.0 * area / size**2), size)
        fine = [(length / scale, [f.number for f in named[name][0]]) for name, length in cad.sizes.items()]
        _set_sizes(gmsh, size / scale, cad.around, fine)
        generate(gmsh.model.mesh, size, repair=True)
        _refuse_damaged(gmsh, opened_part.faces, scale, cad.path)
        record = _collected(gmsh, named, scale, cad.path)
        return replace(record, volumes=_volumes(gmsh, opened_part.solids)) if len(opened_part.solids) > 1 else record


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
