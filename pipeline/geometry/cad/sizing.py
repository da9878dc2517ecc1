"""Sizes of the elements of a CAD part: by curvature where something acts on it, coarser on blends elsewhere.

gmsh extends the sizes of edges over faces and into the solid, so that nodes follow from the sizes of edges.
"""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.cad.faces import Face

COARSE = 0.5
"""Least element size by curvature where nothing acts, over the size of the mesh: blends of small radius do not fill the
memory, and have two elements or more across a right angle from a radius of 0.6 sizes on."""
FINEST = 1 / 20
"""The same where contacts, supports, loads and gauges are."""
SAMPLES = np.linspace(0.05, 0.95, 7)
"""Places along an edge at which its curvature is taken, over its parameter."""
TRIANGLE, TETRAHEDRON = 0.43, 0.24
"""Area of a triangle over its size squared, and volume of a tetrahedron over its size cubed, of gmsh's meshes."""
FLAT_PART = 2.2
"""Tetrahedra a triangle of the boundary where no node lies inside of the part."""
TRIES = 40
"""Halvings of the interval in which the size for a number of nodes lies."""


class Edge(NamedTuple):
    """An edge of a part; lengths in the model's unit."""

    length: float
    curvature: float
    """Of itself, and of the faces at it on which something acts."""
    blend: float
    """Largest of the faces at it."""
    acted: bool
    """Whether something acts on a face at it."""

    def size(self, size: float, around: int) -> float:
        """Return the size of its elements in a mesh of a size."""
        fine = float(np.clip(_turned(self.curvature, around), FINEST * size, size)) if self.acted else size
        # Elements grow within a few rows beside an edge that is shorter than the finest of them.
        longest = max(self.length, FINEST * size)
        return min(fine, longest, float(np.clip(_turned(self.blend, around), COARSE * size, size)))


class Sizing(NamedTuple):
    """What sizes of elements follow from."""

    faces: Sequence[Face]
    acted: frozenset[int]
    """Numbers of the faces on which something acts."""
    around: int
    scale: float
    """Metres per unit of the model."""
    volume: float
    """[m^3]"""
    fine: Sequence[tuple[float, list[int]]]
    """Edge lengths on faces [m], with their numbers."""
    edges: Mapping[int, Edge] = MappingProxyType({})
    curvatures: Mapping[int, np.ndarray] = MappingProxyType({})
    """Largest principal curvature at the samples of each face, by number."""

    def nodes(self, size: float) -> float:
        """Return about how many nodes a mesh of an edge length [m] has, within a factor of 1.5."""
        size /= self.scale
        triangles, area = 0.0, 0.0
        for face in self.faces:
            face_area = face.area / self.scale**2
            edges = [self.edges[tag] for tag in face.edges]
            weights = [edge.length for edge in edges]
            by_edges = [edge.size(size, self.around) ** -2 for edge in edges]
            density = float(np.average(by_edges, weights=weights)) if sum(weights) else size**-2
            low = FINEST if face.number in self.acted else COARSE
            local = np.clip(_turned(self.curvatures[face.number], self.around), low * size, size)
            density = max(density, float(np.mean(local**-2.0)))
            lengths = [length / self.scale for length, numbers in self.fine if face.number in numbers]
            density = max(density, *(min(length, size) ** -2 for length in lengths)) if lengths else density
            # Narrow faces have a strip of triangles along both of their sides.
            triangles += max(face_area * density / TRIANGLE, sum(weights) * math.sqrt(density))
            area += face_area
        mean_size = math.sqrt(area / TRIANGLE / triangles)
        inner = max(FLAT_PART * triangles, self.volume / self.scale**3 / (TETRAHEDRON * mean_size**3))
        return 2 * triangles + inner

    def size_for(self, count: int, largest: float) -> float:
        """Return the edge length [m], with two digits, of a mesh of about so many nodes; at most the largest one."""
        low, high = math.log(1e-4 * largest), math.log(largest)
        for _ in range(TRIES):
            middle = (low + high) / 2
            low, high = (low, middle) if self.nodes(math.exp(middle)) < count else (middle, high)
        return rounded_up(math.exp(high))

    def apply(self, gmsh: Any, size: float, coarse: float) -> None:
        """Have gmsh make elements of these sizes; `size` is in the model's unit, `coarse` as `COARSE`."""
        blend_size, low = coarse * size, FINEST * size
        limits = {
            tag: min(blend_size, max(low, _turned(edge.curvature, self.around))) if edge.acted else blend_size
            for tag, edge in self.edges.items()
        }

        def limited(dimension: int, tag: int, x: float, y: float, z: float, length: float) -> float:
            if dimension == 1:
                return max(length, limits.get(tag, 0.0))
            return max(length, blend_size) if dimension == 2 and tag not in self.acted else length

        gmsh.model.mesh.removeSizeCallback()
        if len(self.acted) < len(self.faces):
            gmsh.model.mesh.setSizeCallback(limited)


def with_edges(gmsh: Any, sizing: Sizing) -> Sizing:
    """Return what sizes follow from with the edges and the curvatures of the faces in gmsh's model."""
    faces, acted, scale = sizing.faces, sizing.acted, sizing.scale
    curvatures = {face.number: _curvatures(gmsh, face, scale) for face in faces}
    edges = {}
    for tag in sorted({tag for face in faces for tag in face.edges}):
        at_edge = [face for face in faces if tag in face.edges]
        length, bend = _edge(gmsh, tag)
        blends = [float(curvatures[face.number].max(initial=0.0)) for face in at_edge]
        acted_curvatures = [k for face, k in zip(at_edge, blends, strict=True) if face.number in acted]
        edges[tag] = Edge(length, max([bend, *acted_curvatures]), max([bend, *blends]), bool(acted_curvatures))
    return sizing._replace(edges=edges, curvatures=curvatures)


def rounded_up(size: float) -> float:
    """Return a size with two digits, not below it."""
    power = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{math.ceil(size / power * (1 - 1e-12)) * power:.2g}")


def _turned(curvature: Any, around: int) -> Any:
    """Return the length of an element of which so many are around a full circle; infinite where it is flat."""
    with np.errstate(divide="ignore"):
        return 2 * np.pi / (around * np.abs(curvature))


def _curvatures(gmsh: Any, face: Face, scale: float) -> np.ndarray:
    if face.kind == "plane":
        return np.zeros(1)
    uv = gmsh.model.getParametrization(2, face.number, (face.points / scale).ravel())
    largest, smallest, *_ = gmsh.model.getPrincipalCurvatures(face.number, uv)
    return np.maximum(np.abs(largest), np.abs(smallest))


def _edge(gmsh: Any, tag: int) -> tuple[float, float]:
    """Return length and largest curvature of an edge, by samples."""
    low, high = (float(bound[0]) for bound in gmsh.model.getParametrizationBounds(1, tag))
    ends = np.linspace(low, high, 2 * len(SAMPLES) + 1)
    points = np.array(gmsh.model.getValue(1, tag, ends)).reshape(-1, 3)
    curvature = np.abs(gmsh.model.getCurvature(1, tag, low + (high - low) * SAMPLES))
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()), float(np.max(curvature))
