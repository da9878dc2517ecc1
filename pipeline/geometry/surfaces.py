"""Named surfaces and their true shapes: points, planes, cylinders, cones and spheres."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.modaldb.records.traction import cross_axes
from gudgeon.pipeline.errors import InputError

Triple = Sequence[float] | np.ndarray
SurfaceRule = dict[str, Any]
"""The true shape of a named surface, as `modaldb.records.mesh.Surface.shape`."""


def find_surface(mesh: MeshRecord, name: str, key: str) -> Surface:
    """Return a named surface of a mesh; `key` is the key that names it, for messages.

    Raises:
        InputError: the mesh has no such surface.
    """
    return mesh.surfaces[surface_name(mesh, name, key)]


def surface_name(mesh: MeshRecord, name: str, key: str) -> str:
    """Return the name of a surface as the mesh spells it: decks do not tell names by their case; see `find_surface`."""
    if name in mesh.surfaces:
        return name
    alike = [spelling for spelling in mesh.surfaces if spelling.casefold() == name.casefold()]
    if len(alike) != 1:
        have = ", ".join(sorted(mesh.surfaces)) or "none"
        raise InputError(f"{key}: the mesh has no surface '{name}', it has {have}")
    return alike[0]


def point_surface(node: int, normal: np.ndarray, area: float, origin: np.ndarray) -> Surface:
    """Return one node as a surface with an outward unit normal (3,), an area [m^2] and a position [m], (3,)."""
    shape = {"kind": "point", "normal": normal.tolist(), "area": area, "origin": origin.tolist()}
    return Surface(np.array([[node]]), shape)


def cylinder(radius: float, axis: Triple = (0, 0, 1), origin: Triple = (0, 0, 0)) -> SurfaceRule:
    """Return the shape of a circular cylinder of `radius` [m] about `axis` through `origin` [m]."""
    return {"kind": "cylinder", "radius": radius, "axis": list(map(float, axis)), "origin": list(map(float, origin))}


def sphere(radius: float, origin: Triple = (0, 0, 0)) -> SurfaceRule:
    """Return the shape of a sphere of `radius` about `origin` [m]."""
    return {"kind": "sphere", "radius": radius, "origin": list(map(float, origin))}


def cone(angle: float, axis: Triple, origin: Triple) -> SurfaceRule:
    """Return the shape of a circular cone: `angle` [rad] between surface and axis, which points from the apex on."""
    return {"kind": "cone", "angle": float(angle), "axis": list(map(float, axis)), "origin": list(map(float, origin))}


def plane(normal: Triple, origin: Triple) -> SurfaceRule:
    """Return the shape of the plane through `origin` [m] with the outward unit `normal`."""
    return {"kind": "plane", "normal": list(map(float, normal)), "origin": list(map(float, origin))}


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


def grown(surface: Surface, growth: float) -> Surface:
    """Return a surface of a solid after uniform growth of all lengths about the origin, over them."""
    shape, areas, scale = dict(surface.shape), surface.areas, 1 + growth
    if "radius" in shape:
        shape["radius"] *= scale
    if "origin" in shape:
        shape["origin"] = [scale * x for x in shape["origin"]]
    return replace(surface, shape=shape, areas=None if areas is None else scale**2 * areas)


def cylindrical(points: np.ndarray, shape: SurfaceRule) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return radius [m], angle [rad] and height [m] of points (k, 3) about a shape's axis.

    The angle is measured from the x axis (from z, if the axis is x) by the right-hand rule.
    """
    axis = np.asarray(shape["axis"], float)
    axis = axis / np.linalg.norm(axis)
    e1, e2 = cross_axes(axis)
    arm = points - np.asarray(shape["origin"], float)
    a, b = arm @ e1, arm @ e2
    return np.hypot(a, b), np.arctan2(b, a), arm @ axis


def radial_directions(points: np.ndarray, shape: SurfaceRule) -> np.ndarray:
    """Return unit vectors (k, 3) from a shape's axis to the points."""
    axis = np.asarray(shape["axis"], float)
    axis = axis / np.linalg.norm(axis)
    arm = points - np.asarray(shape["origin"], float)
    radial = arm - np.outer(arm @ axis, axis)
    return radial / np.linalg.norm(radial, axis=1, keepdims=True)


def distance(points: np.ndarray, shape: SurfaceRule) -> np.ndarray:
    """Return the distance of points (k, 3) from a true shape [m], (k,)."""
    if shape["kind"] == "plane":
        return np.abs((points - np.asarray(shape["origin"])) @ np.asarray(shape["normal"]))
    if shape["kind"] == "cone":
        return np.linalg.norm(points - _on_cone(points, shape)[0], axis=1)
    sphere = shape["kind"] == "sphere"
    radius = np.linalg.norm(points - shape["origin"], axis=1) if sphere else cylindrical(points, shape)[0]
    return np.abs(radius - shape["radius"])


def true_surface(points: np.ndarray, outward: np.ndarray, shape: SurfaceRule) -> tuple[np.ndarray, np.ndarray]:
    """Return points (k, 3) moved onto a true shape, and its unit normals there on the `outward` side, (k, 3) each.

    A profile has already moved the nodes of a `profiled` cylinder: they stay.
    """
    origin = np.asarray(shape["origin"], float)
    if shape["kind"] == "plane":
        normal = np.asarray(shape["normal"], float) / np.linalg.norm(shape["normal"])
        moved = points - np.outer((points - origin) @ normal, normal)
        normals = np.broadcast_to(normal, points.shape).copy()
    elif shape["kind"] == "sphere":
        normals = (points - origin) / np.linalg.norm(points - origin, axis=1, keepdims=True)
        moved = origin + shape["radius"] * normals
    elif shape["kind"] == "cone":
        moved, normals = _on_cone(points, shape)
    else:
        normals = radial_directions(points, shape)
        depth = shape["radius"] - cylindrical(points, shape)[0]
        moved = points if shape.get("profiled") else points + normals * depth[:, None]
    side = np.sign(np.einsum("ki,ki->k", normals, outward))
    return moved, normals * side[:, None]


def _on_cone(points: np.ndarray, shape: SurfaceRule) -> tuple[np.ndarray, np.ndarray]:
    """Return the nearest points of a cone, beyond its apex the apex, and its normals there, (k, 3) each."""
    axis, apex, angle = np.asarray(shape["axis"], float), np.asarray(shape["origin"], float), shape["angle"]
    radial = radial_directions(points, shape)
    line = np.cos(angle) * axis + np.sin(angle) * radial
    along = np.maximum(((points - apex) * line).sum(axis=1), 0.0)
    return apex + along[:, None] * line, np.cos(angle) * radial - np.sin(angle) * axis
