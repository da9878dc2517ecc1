"""Meshes of two equal caps, mirrored at z = 0 (3-D) or y = 0 (plane), so that their contact points face each other, or
not: the lower one may have elements of another size, and be turned about the normal.

Two spheres of radius 2 R of one material touch as a sphere of radius R touches a flat of it; so do cylinders. Caps are
fine about the point of contact. Run as a program: `python -m tests.validation.friction.meshes FOLDER [SIZE/a]`.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import meshio
import numpy as np

GMSH_TET10, GMSH_TRIANGLE6 = 11, 9


@dataclass(frozen=True)
class Cap:
    """A block with a round face."""

    radius: float
    """Of its round face [m]."""
    half_width: float
    """[m]"""
    height: float
    """[m]"""
    contact: float
    """Expected half-width a of the contact [m]."""
    zone: float = 1.3
    """Half-width of the interface over a."""
    fine: float = 1.2
    """Radius of the zone of small elements over the half-width of the interface."""
    growth: float = 0.25
    """Growth of elements beyond it, per distance."""
    half: bool = False
    """Whether a solid is that half of the cap whose y is above zero, with `middle` as its plane of symmetry."""


@dataclass(frozen=True)
class Lower:
    """How the mesh of the lower cap differs from the mirrored one."""

    ratio: float = 1.0
    """Of its elements' size to those of the upper cap."""
    turn: float = 0.0
    """About the normal [rad]."""


MIRRORED = Lower()
MINDLIN = Cap(radius=0.04, half_width=5e-3, height=6e-3, contact=3.7325e-4)
CATTANEO = Cap(radius=0.1, half_width=10e-3, height=10e-3, contact=4.9308e-4)


def write_pair(folder: Path, name: str, cap: Cap, size: float, *, solid: bool, lower: Lower = MIRRORED) -> None:
    """Write `name-upper.vtu`, with its round face down, and `name-lower.vtu`, its mirror image by default.

    Args:
        size: Edge length of elements at the contact [m].
        solid: Whether the caps are solids of revolution about z, or plane in x and y.
    """
    for side, sign, one in (("upper", 1.0, MIRRORED), ("lower", -1.0, lower)):
        mesh = _cap_mesh(cap, one.ratio * size, solid=solid)
        axis = 2 if solid else 1
        mesh.points[:, axis] *= sign
        if one.turn:
            c, s = np.cos(one.turn), np.sin(one.turn)
            mesh.points[:, :2] = mesh.points[:, :2] @ np.array([[c, s], [-s, c]])
        mesh.write(folder / f"{name}-{side}.vtu")


def _cap_mesh(cap: Cap, size: float, *, solid: bool) -> meshio.Mesh:
    """Return the mesh of the upper cap."""
    points, cells = _solid(cap, size) if solid else _plane(cap, size)
    axis = 2 if solid else 1
    round_face = np.abs(np.linalg.norm(points - cap.radius * np.eye(3)[axis], axis=1) - cap.radius) < 1e-7 * cap.radius
    across = np.linalg.norm(np.delete(points, axis, axis=1), axis=1)
    flags = {
        "contact": (round_face & (across < cap.zone * cap.contact)).astype(int),
        "back": (np.abs(points[:, axis] - cap.height) < 1e-7 * cap.height).astype(int),
        "middle": (np.abs(points[:, 1]) < 1e-7 * cap.height).astype(int),
    }
    return meshio.Mesh(points, [("tetra10" if solid else "triangle6", cells)], point_data=flags)


def _solid(cap: Cap, size: float) -> tuple[np.ndarray, np.ndarray]:
    with _meshing(cap, size) as gmsh:
        occ = gmsh.model.occ
        ball = occ.addSphere(0, 0, cap.radius, cap.radius)
        block = occ.addCylinder(0, 0, -cap.height, 0, 0, 2 * cap.height, cap.half_width)
        (cut,), _ = occ.intersect([(3, ball)], [(3, block)])
        if cap.half:
            w, h = 2 * cap.half_width, 2 * cap.height
            occ.intersect([cut], [(3, occ.addBox(-w, 0, -h, 2 * w, w, 2 * h))])
        occ.synchronize()
        return _meshed(gmsh, 3, GMSH_TET10)


def _plane(cap: Cap, size: float) -> tuple[np.ndarray, np.ndarray]:
    with _meshing(cap, size) as gmsh:
        occ, w, h = gmsh.model.occ, cap.half_width, cap.height
        foot = cap.radius - np.sqrt(cap.radius**2 - w**2)
        points = [occ.addPoint(*place, 0) for place in ((-w, foot), (0, 0), (w, foot), (w, h), (-w, h))]
        centre = occ.addPoint(0, cap.radius, 0)
        arcs = [occ.addCircleArc(points[0], centre, points[1]), occ.addCircleArc(points[1], centre, points[2])]
        lines = [occ.addLine(points[i], points[(i + 1) % 5]) for i in (2, 3, 4)]
        occ.addPlaneSurface([occ.addCurveLoop([*arcs, *lines])])
        occ.synchronize()
        return _meshed(gmsh, 2, GMSH_TRIANGLE6)


@contextmanager
def _meshing(cap: Cap, size: float) -> Iterator[Any]:
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
        gmsh.model.add("cap")
        reach, coarse = cap.fine * cap.zone * cap.contact, cap.half_width / 4
        field = gmsh.model.mesh.field
        field.add("MathEval", 1)
        away = "sqrt(x*x + y*y + z*z)"
        field.setString(1, "F", f"Min({coarse}, {size} + {cap.growth} * (Max({away}, {reach}) - {reach}))")
        field.setAsBackgroundMesh(1)
        yield gmsh
    finally:
        gmsh.finalize()


def _meshed(gmsh: Any, dimension: int, kind: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes and the cells in VTK's order."""
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.model.mesh.generate(dimension)
    tags, places, _ = gmsh.model.mesh.getNodes()
    _, connected = gmsh.model.mesh.getElementsByType(kind)
    number = np.zeros(int(tags.max()) + 1, int)
    number[tags] = np.arange(len(tags))
    cells = number[connected].reshape(-1, 10 if dimension == 3 else 6)
    used, cells = np.unique(cells, return_inverse=True)
    cells = cells.reshape(-1, 10 if dimension == 3 else 6)
    if dimension == 3:
        cells = cells[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]  # gmsh has the last two middles the other way round.
    return places.reshape(-1, 3)[used], cells


def write_all(folder: Path, share: float = 0.25) -> None:
    """Write the meshes of both scenes with elements of a share of a at the contact."""
    write_pair(folder, "mindlin", MINDLIN, share * MINDLIN.contact, solid=True)
    write_pair(folder, "cattaneo", CATTANEO, share / 4 * CATTANEO.contact, solid=False)


if __name__ == "__main__":
    write_all(Path(sys.argv[1]), *map(float, sys.argv[2:]))
