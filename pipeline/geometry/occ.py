"""From a drawing in gmsh's OpenCASCADE kernel to a curved tet10 mesh with named surfaces."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import model_validator

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError, PipelineError, StageError
from gudgeon.pipeline.geometry.cells import GMSH_ORDER, TETRA10, compacted
from gudgeon.pipeline.geometry.mesh_estimate import refuse_large
from gudgeon.pipeline.geometry.signals import unchanged_signals
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, distance
from gudgeon.solver.numbers import Strict

GMSH_TETRA4, GMSH_TETRA10, GMSH_TRIANGLE6 = 4, 11, 9
ON_SURFACE = 1e-5
"""How far a CAD face's nodes may lie from the named shape, relative to its size."""
FLAT = 1e-3
"""Least signed inverse condition number of a straight element, 1 for a regular one; valid meshes have at least 0.1."""
TURN = 14
"""Least elements around a full circle: with fewer, curved elements on a pin bore are nearly inverted."""
REVOLVED: dict[str, float] = {
    "Geometry.OCCUnionUnify": 0,  # keeps the halves of `revolve` apart
    "Mesh.Algorithm": 1,  # MeshAdapt: the others can make triangles out of three nodes of one straight edge
    "Mesh.Algorithm3D": 10,  # HXT: its optimiser also removes slivers from walls of one element's thickness
    "Mesh.MeshSizeFromCurvature": TURN,
    "Mesh.MeshSizeMin": 0,
}
"""Options for solids with walls and bores of few elements. Not for the skirt, whose meshes are published."""

ROUND_OFF = 1e-9
"""Relative: a length that equals its limit but for round-off makes faces that touch, and gmsh cannot mesh those."""


class Solid(Strict):
    """A solid that is drawn in OCC and meshed with curved tet10. All lengths in metres."""

    OPTIONS: ClassVar[Mapping[str, float]] = {}
    """Further options of gmsh by name, such as `REVOLVED`."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        for key, value, limit, meaning in self.limits():
            if value >= limit * (1 - ROUND_OFF):
                raise ValueError(f"{key} is {value:.6g} m, it must be below {meaning} = {limit:.6g} m")
        return self

    def limits(self) -> list[tuple[str, float, float, str]]:
        """Return lengths that must be below others [m]: key, its value, the limit and what the limit is."""
        return []

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        """Return the named surfaces with the true shape of each."""
        raise NotImplementedError

    def draw(self, occ: Any) -> None:
        """Add the solid to gmsh's OCC model."""
        raise NotImplementedError

    def tie(self, model: Any) -> bool:
        """Tie faces of gmsh's model before it is meshed; return whether there are any.

        Inverted elements are then refused and not repaired, since a repair moves the nodes of tied faces apart.
        """
        return False

    def refine(self, gmsh: Any) -> None:
        """Set the size of elements where it is smaller, before gmsh's model is meshed."""

    def expected(self, volume: float, area: float, size: float) -> float:
        """Return about how many elements of edge length `size` [m] a solid has by volume [m^3] and surface [m^2].

        Within a factor of two for the shapes of the scenes at 1e3 to 2e5 elements; thin walls are one element thick.
        """
        return max(5.0 * volume / size**3, 4.0 * area / size**2)

    def build(self, size: float) -> MeshRecord:
        """Mesh the solid with elements of edge length `size` [m].

        Raises:
            InputError: the size is too coarse for the curved faces, or gives flat elements.
            StageError: gmsh failed, or a named surface has no face.
        """
        with meshing(size, self.OPTIONS) as gmsh:
            model = gmsh.model
            self.draw(model.occ)
            model.occ.synchronize()
            volume, area = (sum(model.occ.getMass(d, tag) for _, tag in model.getEntities(d)) for d in (3, 2))
            refuse_large("solid", self.expected(volume, area, size), size)
            self.refine(gmsh)
            generate(model.mesh, size, repair=not self.tie(model))
            outer = [tag for _, tag in model.getEntities(2) if len(model.getAdjacencies(2, tag)[0]) == 1]
            return _collect(model.mesh, outer, self.surface_shapes())


@contextmanager
def meshing(size: float, options: Mapping[str, float], file: str = "") -> Iterator[Any]:
    """Give gmsh, on one thread, with edge length `size` [m] and further options; close it at the end.

    Args:
        file: Whose faces are meshed, where they are of a file.

    Raises:
        InputError: gmsh failed on a file.
        StageError: gmsh failed, or does not load.
    """
    try:
        import gmsh
    except (ImportError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise StageError(
            f"gmsh does not load: {reason}; 'gudgeon doctor' prints the command that installs it"
        ) from error

    try:
        with unchanged_signals():
            gmsh.initialize(interruptible=False)
        sizes = {"Mesh.MeshSizeMin": size, "Mesh.MeshSizeMax": size}
        for name, value in ({"General.Terminal": 0, "General.NumThreads": 1} | sizes | dict(options)).items():
            gmsh.option.setNumber(name, value)
        yield gmsh
    except PipelineError:
        raise
    except Exception as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        if file:
            raise InputError(
                f"{file}: geometry.path: a face or an edge is damaged, gmsh says: {reason}; allowed: closed solids"
                " whose faces end at their edges; repair the part in its CAD program and write it as STEP, or change"
                " mesh.size"
            ) from error
        raise StageError(f"gmsh: {reason}") from error
    finally:
        if gmsh.isInitialized():
            gmsh.finalize()


def read_file(gmsh: Any, path: str) -> None:
    """Read a file into gmsh's present model.

    gmsh's errors are collected rather than thrown: thrown within its parser of scripts, they leave the rest of the file
    there, before the next file.

    Raises:
        ValueError: gmsh's first error.
    """
    before = gmsh.option.getNumber("General.AbortOnError")
    gmsh.option.setNumber("General.AbortOnError", 0)
    gmsh.logger.start()
    try:
        gmsh.merge(path)
        errors = [line for line in gmsh.logger.get() if line.startswith("Error")]
    finally:
        gmsh.logger.stop()
        gmsh.option.setNumber("General.AbortOnError", before)
    if errors:
        raise ValueError(errors[0].partition(":")[2].strip())


def polygon_face(occ: Any, corners: Sequence[tuple[float, float, float]]) -> tuple[int, int]:
    """Draw a plane polygon of corners [m] and return it, as gmsh's (dimension, tag)."""
    points = [occ.addPoint(*corner) for corner in corners]
    edges = [occ.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    return 2, occ.addPlaneSurface([occ.addCurveLoop(edges)])


def turned_solid(occ: Any, face: tuple[int, int], angle: float) -> list[tuple[int, int]]:
    """Revolve a face about the z axis by an angle [rad] and return the solid, as gmsh's (dimension, tag)."""
    return [entity for entity in occ.revolve([face], 0, 0, 0, 0, 0, 1, angle) if entity[0] == 3]


def revolve(occ: Any, section: Sequence[tuple[float, float]]) -> list[tuple[int, int]]:
    """Revolve a polygon of radii and heights [m] about the z axis and return the solid, as gmsh's (dimension, tag).

    With the options `REVOLVED` it consists of two halves that meet at ±y: gmsh meshes a closed cylinder badly if a cut
    has left only a part of its seam. Nodes line up where the halves meet, away from the thrust sides at ±x.
    """
    corners = [(0.0, radius, height) for radius, height in section]
    return occ.fuse(*(turned_solid(occ, polygon_face(occ, corners), turn) for turn in (np.pi, -np.pi)))[0]


def generate(mesh: Any, size: float, repair: bool, straighten: Callable[[], None] = lambda: None) -> None:
    """Make curved elements, and let gmsh repair those that are inverted by it; refuse those that remain.

    Flat elements are refused before gmsh curves the mesh: it cannot repair them and may abort the process.

    Args:
        straighten: Called before that where elements are inverted, to straighten those whose curve is of no account.

    Raises:
        InputError: elements are flat or turn inside out.
    """

    def count_below(limit: float, measure: str, element_type: int) -> int:
        tags, _ = mesh.getElementsByType(element_type)
        return int(np.count_nonzero(np.asarray(mesh.getElementQualities(tags, measure)) <= limit))

    mesh.generate(3)
    if count := count_below(FLAT, "minSICN", GMSH_TETRA4):
        raise InputError(f"mesh.size: at {size} m gmsh makes {count} flat elements, try another size")
    mesh.setOrder(2)
    if count_below(0.0, "minDetJac", GMSH_TETRA10):
        straighten()
    if repair and count_below(0.0, "minDetJac", GMSH_TETRA10):
        mesh.optimize("HighOrder")
    if count := count_below(0.0, "minDetJac", GMSH_TETRA10):
        raise InputError(f"mesh.size: {size} m is too coarse for the curved faces, {count} elements turn inside out")


def nodes_and_cells(mesh: Any, element_type: int, order: list[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return nodes [m] (n, 3), cells of one type with their nodes in an order, and the new number of gmsh's nodes."""
    tags, positions, _ = mesh.getNodes()
    points = np.zeros((int(tags.max()) + 1, 3))
    points[tags.astype(int)] = positions.reshape(-1, 3)
    _, cell_nodes = mesh.getElementsByType(element_type)
    return compacted(points, cell_nodes.astype(int).reshape(-1, len(order))[:, order])


def _collect(mesh: Any, faces: list[int], surfaces: dict[str, SurfaceRule]) -> MeshRecord:
    nodes, cells, node_ids = nodes_and_cells(mesh, GMSH_TETRA10, GMSH_ORDER)
    facets: dict[str, list[np.ndarray]] = {name: [] for name in surfaces}
    for face in faces:
        _, face_nodes = mesh.getElementsByType(GMSH_TRIANGLE6, face)
        triangles = node_ids[face_nodes.astype(int).reshape(-1, 6)]
        for name, shape in surfaces.items():
            points = nodes[triangles.ravel()]
            if distance(points, shape).max() < ON_SURFACE * shape.get("radius", np.ptp(points, axis=0).max()):
                facets[name].append(triangles)
    for name, triangles_found in facets.items():
        if not triangles_found:
            raise StageError(f"geometry: no face of the solid lies on surface '{name}'")
    named = {name: Surface(np.concatenate(facets[name]), surfaces[name]) for name in surfaces}
    return MeshRecord(nodes, cells, TETRA10.name, named)
