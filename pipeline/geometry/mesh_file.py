"""Solids from mesh files: any format of meshio, as tet10 with named, outward surfaces.

Surfaces get their names from gmsh's physical groups of dimension 2, from sets of triangles or nodes, from integer
cell or point arrays (non-zero = member), or from their true shape only. A true plane, cylinder, cone or sphere is
recognised without being declared.
"""

import contextlib
import io
import warnings
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.geometry.cells import (
    EDGES,
    GMSH_ORDER,
    MIRRORED_TETRA,
    TETRA10,
    Block,
    boundary_facets,
    compacted,
    outer_faces,
)
from gudgeon.pipeline.geometry.cells import SOLIDS as SOLIDS_BY_NODES
from gudgeon.pipeline.geometry.decks.abaqus import read_abaqus
from gudgeon.pipeline.geometry.decks.ansys import read_ansys
from gudgeon.pipeline.geometry.decks.by_gmsh import ENDINGS as GMSH_ENDINGS
from gudgeon.pipeline.geometry.decks.by_gmsh import FIRST as GMSH_FIRST
from gudgeon.pipeline.geometry.decks.by_gmsh import read_by_gmsh
from gudgeon.pipeline.geometry.numbers import CAD_KINDS, Point, UnitVector
from gudgeon.pipeline.geometry.shape_fit import fit_shape
from gudgeon.pipeline.geometry.soundness import refuse_pieces
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, distance, true_surface
from gudgeon.pipeline.process.call import called_apart
from gudgeon.solver.numbers import RANGES, Length, Name, Strict

ON_SHAPE = 1e-5
"""How far corners may lie from a true shape, relative to its size: the round-off of files with six digits."""
FACING = 0.5
"""Least cosine between the normals of facet and true shape: a facet of an end face may have all three corners on the
cylinder, but its normal is perpendicular to the radius."""
LIFTS = 30
"""Alternating projections onto shapes with a common edge; one is enough where they meet at right angles."""
FLAT = 1e-9
"""Least 6 × volume of a tetrahedron by its longest edge cubed; slivers of aspect 1:1000 are at 1e-6."""
MID_REACH = 0.35
"""How far a mid-edge node may lie from the middle of its chord, by the chord: an arc of 120° is at 0.29."""
SOLIDS = ("tetra", "tetra10")
FACETS = {1: ("line", "line3"), 2: ("triangle", "triangle6"), 3: SOLIDS}
"""meshio's types of the cells that can name a boundary or a volume, by their dimension."""
READABLE = "allowed: .msh (saved without Mesh.SaveAll), .inp, .vtu, .unv, .med, .bdf, .cdb or another format of meshio"


class CylinderShape(Strict):
    """A circular cylinder."""

    kind: Literal["cylinder"]
    radius: Length = Field(description="Radius")
    axis: UnitVector = Field(description="Direction of the axis")
    origin: Point = Field(description="A point of the axis [m]")


class PlaneShape(Strict):
    """A plane."""

    kind: Literal["plane"]
    normal: UnitVector = Field(description="Normal of the plane")
    origin: Point = Field(description="A point of the plane [m]")


SurfaceShape = Annotated[CylinderShape | PlaneShape, Field(discriminator="kind")]


class MeshFile(Strict):
    """A tetrahedral mesh in a file; linear tetrahedra become tet10."""

    kind: Literal["file"]
    path: str = Field(description="File of the mesh, from the folder of the scene")
    unit: Length = Field(default=1.0, description="Metres per unit of length of the file")
    surfaces: dict[Name, SurfaceShape] = Field(
        default={}, description="True shapes by name; a name that is not in the file gets the facets on its shape"
    )

    def build(self, size: float | None) -> MeshRecord:
        """Read the mesh; `size` is not used, the file has its own.

        Raises:
            InputError: the file is missing or no mesh, not one solid of tetrahedra, or not on its declared surfaces.
        """
        if cad_kind := CAD_KINDS.get(Path(self.path).suffix.lower()):
            raise InputError(f'{self.path}: {cad_kind} is a shape without a mesh; kind = "cad" meshes it')
        mesh = read_mesh(self.path)
        points = scaled_points(mesh, self.unit, self.path)
        nodes, cells, new_number = compacted(points, _ordered(points, _tetrahedra(mesh, self.path), self.path))
        cell = SOLIDS_BY_NODES[cells.shape[1]]
        _, faces = boundary_facets([Block(cell, np.arange(len(cells)), cells)], self.path)
        members = named_facets(mesh, new_number, faces, dimension=2)
        shapes: dict[str, SurfaceRule] = {name: s.model_dump(mode="json") for name, s in self.surfaces.items()}
        members |= {name: self._on_shape(name, shape, nodes[faces[:, :3]], members) for name, shape in shapes.items()}
        straight = cells.shape[1] == 4
        fitted = {name: _fitted(nodes, faces[members[name]]) for name in sorted(members.keys() - shapes.keys())}
        if straight:
            nodes, cells = _with_mid_nodes(nodes, cells)
            faces = outer_faces(cells)
        facets = {name: faces[chosen] for name, chosen in members.items()}
        if straight:
            _lift(nodes, facets, shapes)
        surfaces = {name: Surface(facets[name], (fitted | shapes)[name]) for name in facets}
        record = MeshRecord(nodes, cells, TETRA10.name, surfaces, _named_cells(mesh, new_number, cells))
        refuse_pieces(record, self.path)
        return record

    def _on_shape(
        self, name: str, shape: SurfaceRule, corners: np.ndarray, members: dict[str, np.ndarray]
    ) -> np.ndarray:
        """Return which boundary facets, with `corners` [m] (f, 3, 3), belong to the surface `name` of a true shape."""
        off = distance(corners.reshape(-1, 3), shape).reshape(-1, 3)
        limit = ON_SHAPE * shape.get("radius", np.ptp(corners.reshape(-1, 3), axis=0).max())
        hint = "check `unit` and the shape, which is in metres"
        if name in members and (worst := off[members[name]].max()) > limit:
            raise InputError(
                f"{self.path}: surface '{name}' lies up to {worst:.3g} m off its {shape['kind']}, allowed:"
                f" {limit:.3g} m; {hint}"
            )
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        with np.errstate(invalid="ignore"):  # a facet with its middle on the axis has no radial direction
            _, true_normal = true_surface(corners.mean(axis=1), normal, shape)
        facing = np.einsum("fi,fi->f", normal, true_normal) > FACING
        belongs = members.get(name, np.ones(len(off), bool)) & facing & (off.max(axis=1) <= limit)
        if not belongs.any():
            have = ", ".join(sorted(members)) or "no surface"
            raise InputError(
                f"{self.path}: no boundary facet lies on the {shape['kind']} of surface '{name}', and the file"
                f" names {have}; {hint}"
            )
        return belongs


def _fitted(nodes: np.ndarray, facets: np.ndarray) -> SurfaceRule:
    """Return the true shape on which all nodes of facets (f, 3) or (f, 6) lie, empty if there is none.

    The nodes stay: those between the corners of a straight mesh lie on chords.
    """
    if not len(facets):
        return {}
    a, b, c = np.moveaxis(nodes[facets[:, :3]], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return fit_shape(nodes[facets].reshape(-1, 3), np.repeat(normals, facets.shape[1], axis=0)).shape


def _lift(nodes: np.ndarray, facets: dict[str, np.ndarray], shapes: dict[str, SurfaceRule]) -> None:
    """Move the mid-edge nodes of facets onto their true shapes, in place."""
    for _ in range(LIFTS):
        for name, shape in shapes.items():
            middle = np.unique(facets[name][:, 3:])
            nodes[middle], _ = true_surface(nodes[middle], nodes[middle], shape)


def _tetrahedra(mesh: Any, path: str) -> np.ndarray:
    """Return the file's tetrahedra (e, 4) or (e, 10); other solid cells are refused, lines and faces omitted."""
    kinds = {block.type for block in mesh.cells if len(block.data)}
    have = ", ".join(sorted(kinds)) or "no cells"
    others = {block.type for block in mesh.cells if block.dim == 3 and len(block.data)} - set(SOLIDS)
    if not kinds & set(SOLIDS) or others:
        fault = f"has cells that are no tetrahedra ({', '.join(sorted(others))})" if others else "has no tetrahedra"
        raise InputError(f"{path}: the mesh {fault}, it has {have}; allowed: solids of tetra or tetra10")
    if kinds >= set(SOLIDS):
        raise InputError(f"{path}: the mesh has both tetra and tetra10; allowed: one of them")
    return np.concatenate([np.asarray(block.data, int) for block in mesh.cells if block.type in SOLIDS])


def _ordered(points: np.ndarray, cells: np.ndarray, path: str) -> np.ndarray:
    """Return the cells in meshio's order, of positive volume, each once (gmsh 2.2 writes one per physical group)."""
    corners = points[cells[:, :4]]
    ends = corners[:, EDGES[3]]
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    if cells.shape[1] == 10:
        centres = ends.mean(axis=2)
        swapped = cells[:, GMSH_ORDER]
        off, off_swapped = (((points[order[:, 4:]] - centres) ** 2).sum(axis=2) for order in (cells, swapped))
        better = off_swapped.sum(axis=1) < off.sum(axis=1)
        cells = np.where(better[:, None], swapped, cells)
        misplaced = np.sqrt(np.where(better[:, None], off_swapped, off)) > MID_REACH * length
        if misplaced.any():
            edge = np.argwhere(misplaced)[0]
            raise InputError(
                f"{path}: the node of edge {edge[1]} of tetrahedron {edge[0]} (from 0) does not lie near that edge;"
                " allowed: mid-edge nodes in the order 01, 12, 02, 03, 13, 23"
            )
    e1, e2, e3 = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 0)
    volume = (np.cross(e1, e2) * e3).sum(axis=1)
    flat = np.abs(volume) <= FLAT * length.max(axis=1) ** 3
    if flat.any():
        raise InputError(
            f"{path}: {int(flat.sum())} of {len(cells)} tetrahedra are flat, the first is number"
            f" {int(np.argmax(flat))} (from 0); allowed: 6 × volume above {FLAT:g} × longest edge³"
        )
    turned = volume < 0
    cells[turned] = cells[turned][:, MIRRORED_TETRA[: cells.shape[1]]]
    _, indices = np.unique(np.sort(cells[:, :4], axis=1), axis=0, return_index=True)
    return cells[np.sort(indices)]


def _with_mid_nodes(nodes: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turn linear tetrahedra (e, 4) into straight tet10 (e, 10); new nodes are last."""
    edges, numbers = np.unique(np.sort(cells[:, EDGES[3]].reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    middle = len(nodes) + numbers.reshape(-1, 6)
    return np.concatenate([nodes, nodes[edges].mean(axis=1)]), np.hstack([cells, middle])


def named_facets(mesh: Any, new_number: np.ndarray, facets: np.ndarray, dimension: int) -> dict[str, np.ndarray]:
    """Return which boundary facets (f, s), corners first, belong to each name of the file; sets of cells before nodes.

    Args:
        new_number: New number of each of the file's nodes, -1 where unused.
        dimension: Of the facets, 1 or 2.
    """
    members: dict[str, np.ndarray] = {}
    corners = np.sort(facets[:, : dimension + 1], axis=1)
    for name, chosen in _facet_sets(mesh, dimension).items():
        rows = np.concatenate([corners, np.sort(new_number[chosen], axis=1)])
        code = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
        members[name] = np.isin(code[: len(corners)], code[len(corners) :])
    sets = {name: np.asarray(nodes, int) for name, nodes in mesh.point_sets.items()}
    sets |= {name: np.flatnonzero(values) for name, values in mesh.point_data.items() if _marks(name, values)}
    for name, nodes in sets.items():
        members.setdefault(name.strip('"'), np.asarray(np.isin(facets, new_number[nodes]).all(axis=1)))
    return {name: chosen for name, chosen in members.items() if chosen.any()}


def _named_cells(mesh: Any, new_number: np.ndarray, cells: np.ndarray) -> dict[str, np.ndarray]:
    """Return the cells of each named volume of a file, by sets of tetrahedra; `new_number` as of `named_facets`."""
    corners, cells_by_name = np.sort(cells[:, :4], axis=1), {}
    for name, chosen in _facet_sets(mesh, 3).items():
        rows = np.concatenate([corners, np.sort(new_number[chosen], axis=1)])
        code = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
        cells_by_name[name] = np.flatnonzero(np.isin(code[: len(corners)], code[len(corners) :]))
    return cells_by_name


def _marks(name: str, values: np.ndarray) -> bool:
    """Return whether an array of a file marks the members of a set, by integers that are not zero."""
    return ":" not in name and values.ndim == 1 and values.dtype.kind in "iub"


def _facet_sets(mesh: Any, dimension: int) -> dict[str, np.ndarray]:
    """Return the corners (k, d + 1) of the lines or triangles in each named set of the file."""
    facet_sets: dict[str, list[np.ndarray]] = {}
    kinds, corners = FACETS[dimension], slice(dimension + 1)
    facets = [(k, np.asarray(block.data)[:, corners]) for k, block in enumerate(mesh.cells) if block.type in kinds]
    for name, members in mesh.cell_sets.items():
        if not name.startswith("gmsh:"):
            facet_sets[name.strip('"')] = [rows[np.asarray(members[k], int)] for k, rows in facets if k < len(members)]
    names = {int(tag): name for name, (tag, of) in mesh.field_data.items() if of == dimension}
    for array, tags in mesh.cell_data.items():
        for k, rows in facets:
            values = np.asarray(tags[k])
            if _marks(array, values):
                facet_sets.setdefault(array, []).append(rows[values != 0])
            elif array in ("gmsh:physical", "medit:ref", "nastran:ref"):
                for tag in set(values.tolist()) - {0}:
                    facet_sets.setdefault(names.get(tag, str(tag)), []).append(rows[values == tag])
    return {name: np.concatenate(chosen) for name, chosen in facet_sets.items() if sum(map(len, chosen))}


def read_mesh(path: str) -> Any:
    """Return the meshio mesh of a file, without the output that meshio prints.

    Raises:
        InputError: the file is missing, damaged, or no mesh.
    """
    if not Path(path).is_file():
        raise InputError(f"{path}: no such file; {READABLE}")
    printed = io.StringIO()
    try:
        _refuse_cut_off(path)
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = _read_any(path)
        points = np.asarray(mesh.points, float)
        sound = points.ndim == 2 and points.shape[1] == 3 and np.isfinite(points).all()
        for block in mesh.cells:
            if block.type in SOLIDS + FACETS[2] and len(block.data):
                sound = sound and block.data.min() >= 0 and block.data.max() < len(points)
    except InputError:
        raise
    except (Exception, SystemExit) as error:  # meshio's readers raise anything, or end the process
        reason = " ".join(str(error).split()) if isinstance(error, Exception) else "not what its name ends in"
        raise InputError(f"{path}: cannot be read as a mesh ({reason or type(error).__name__}); {READABLE}") from error
    if not sound:
        raise InputError(f"{path}: damaged, not every node of its cells has three finite coordinates; {READABLE}")
    return mesh


def _read_any(path: str) -> Any:
    """Read a mesh by meshio, or by gmsh where meshio cannot or drops the names; raises anything."""
    import meshio

    ending = Path(path).suffix.lower()
    if ending == ".cdb":
        return meshio.Mesh(**read_ansys(path)._asdict())
    if ending in GMSH_FIRST:
        return meshio.Mesh(**called_apart(path, "gmsh", read_by_gmsh, path)._asdict())
    try:
        return read_abaqus(path) if ending == ".inp" else meshio.read(path)
    except InputError:
        raise
    except (Exception, SystemExit):
        if ending not in GMSH_ENDINGS:
            raise
        try:
            mesh = called_apart(path, "gmsh", read_by_gmsh, path)
        except (InputError, StageError):  # What meshio says of it stands.
            mesh = None
        if mesh is None or not mesh.cells:
            raise
        return meshio.Mesh(**mesh._asdict())


def scaled_points(mesh: Any, unit: float, path: str) -> np.ndarray:
    """Return the points of a meshio mesh [m], (n, 3), with the file's `unit` [m].

    Raises:
        InputError: the file is farther across than any part.
    """
    points = np.asarray(mesh.points, float)
    farthest, limit = unit * float(np.abs(points).max(initial=0.0)), RANGES["m"][1]
    if farthest > limit:
        raise InputError(f"{path}: has a coordinate of {farthest:.3g} m; allowed: up to {limit:g} m")
    return unit * points


def _refuse_cut_off(path: str) -> None:
    """Refuse a .msh that ends inside a section: meshio only warns, and reads a truncated number as a complete one."""
    if path.lower().endswith(".msh"):
        with open(path, "rb") as file:
            head = file.read(1)
            file.seek(max(0, file.seek(0, io.SEEK_END) - 256))
            last_line = file.read().rstrip().rpartition(b"\n")[2]
        if head == b"$" and not last_line.startswith(b"$End"):
            raise InputError(f"{path}: cut off, its last line is not the end of a section ($End…)")
