"""From a conductor's mesh to its panels in the scene, and what conductors must be."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import permutations

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.applications.electrostatics.capacitance import HalfSpace
from gudgeon.pipeline.applications.electrostatics.enclosure import enclosed
from gudgeon.pipeline.applications.electrostatics.panels import Grading, Onto, Panels, Skin, panels_of
from gudgeon.pipeline.applications.electrostatics.scene import Conductor
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import cell_of, outer_facets
from gudgeon.pipeline.geometry.surfaces import find_surface, true_surface
from gudgeon.solver import core

KNOWN = ("plane", "sphere", "cylinder", "cone")
"""Kinds of true surface onto which points can be moved."""
MOST_PANELS = 20_000
"""Of all conductors together: their matrix has 3.2 GB."""


def skin_of(mesh: MeshRecord, surfaces: Sequence[str], key: str) -> Skin:
    """Return the whole boundary of a solid, or named surfaces of it as a sheet.

    Args:
        key: Key of the conductor, for messages.

    Raises:
        InputError: the mesh has no such surface, or is none of a solid or a plane part.
    """
    if cell_of(mesh).dimension == 2 and not surfaces:
        return Skin(mesh.nodes, mesh.cells)
    if not cell_of(mesh).solid:
        raise InputError(f"{key}.geometry: a mesh of cells '{mesh.cell_type}' has no surface; allowed: solids, and"
                         " plane parts without `surfaces`, which are sheets")  # fmt: skip
    if surfaces:
        chosen = [find_surface(mesh, name, f"{key}.surfaces") for name in surfaces]
        numbers = np.repeat(np.arange(len(chosen)), [len(s.facets) for s in chosen])
        facets = [_triangles(surface.facets, key) for surface in chosen]
        return Skin(mesh.nodes, np.concatenate(facets), list(map(_onto, chosen)), numbers)
    outer = _triangles(outer_facets(mesh), key)
    named = list(mesh.surfaces.values())
    shape_of = {}
    for index, surface in enumerate(named):
        shape_of |= dict.fromkeys(map(tuple, np.sort(surface.facets[:, :3], axis=1).tolist()), index)
    shape = [shape_of.get(tuple(f), -1) for f in np.sort(outer[:, :3], axis=1).tolist()]
    return Skin(mesh.nodes, outer, list(map(_onto, named)), np.array(shape))


def _triangles(facets: np.ndarray, key: str) -> np.ndarray:
    """Return facets of six nodes; others raise an InputError."""
    if facets.shape[1] != 6:
        raise InputError(f"{key}.geometry: its surface has facets of up to {facets.shape[1]} nodes; allowed: triangles"
                         " of six, of a mesh of tetrahedra")  # fmt: skip
    return facets


def _onto(surface: Surface) -> Onto | None:
    if surface.shape.get("kind") not in KNOWN or surface.shape.get("profiled"):
        return None
    return partial(_moved, surface)


def _moved(surface: Surface, points: np.ndarray) -> np.ndarray:
    return true_surface(points, np.ones_like(points), surface.shape)[0]


def placed(panels: Panels, conductor: Conductor) -> Panels:
    """Return the panels of a conductor at its place in the scene."""
    Q = np.eye(3) if conductor.orientation is None else conductor.orientation.matrix()
    return replace(panels, facets=panels.facets @ Q.T + np.array(conductor.position))


def conductor_panels(
    conductors: Mapping[str, Conductor], meshes: Mapping[str, MeshRecord], grading: Grading
) -> list[Panels]:
    """Return the panels of each conductor at its place.

    Raises:
        InputError: a surface is missing, or there are more panels than fit in memory.
    """
    panels = []
    for n, (name, conductor) in enumerate(conductors.items()):
        skin = skin_of(meshes[name], conductor.surfaces, f"conductor.{name}")
        panels.append(placed(panels_of(skin, grading, n), conductor))
    if (count := sum(map(len, panels))) > MOST_PANELS:
        raise InputError(
            f"panels.strips: {count} panels in all, whose matrix has {8e-9 * count**2:.1f} GB; allowed: {MOST_PANELS}."
            " Give fewer strips or a larger conductor.NAME.mesh.size"
        )
    return panels


def solids(conductors: Mapping[str, Conductor], meshes: Mapping[str, MeshRecord]) -> set[str]:
    """Return the conductors that are filled, not sheets."""
    return {name for name, c in conductors.items() if not c.surfaces and cell_of(meshes[name]).solid}


def refuse_overlap(panels: Mapping[str, Panels], half_space: HalfSpace | None, filled: Collection[str] = ()) -> None:
    """Raise InputError where conductors cross, touch or contain each other, or cross the plane of a half-space.

    Args:
        filled: Conductors in which no other may be; one may be within a closed sheet.
    """
    names, groups = list(panels), [p.group() for p in panels.values()]
    for i, group in enumerate(groups):
        for j in range(i):
            crossed = core.panels.crossing(groups[j], group)
            if crossed is not None:
                position = ", ".join(f"{x:.4g}" for x in groups[j].centres[crossed[0]])
                raise InputError(
                    f"conductor.{names[i]}: it touches or overlaps '{names[j]}' near ({position}) m; conductors need a"
                    " gap"
                )
    if nested := enclosed(panels, filled, list(permutations(names, 2))):
        raise InputError(
            f"conductor.{nested[1]}: it lies within '{nested[0]}', which is solid; conductors need a gap, and a"
            " hollow one has a cavity in its geometry, or is a sheet of surfaces"
        )
    if half_space is None:
        return
    for name, surface in panels.items():
        height = (surface.facets - half_space.point) @ half_space.normal
        size = float(np.ptp(surface.facets.reshape(-1, 3), axis=0).max())
        if height.min() < -1e-9 * size or (half_space.factor == -1 and height.min() <= 1e-9 * size):
            raise InputError(
                f"conductor.{name}: its lowest point is {height.min():.4g} m above the plane of half_space;"
                f" allowed: {'above 0' if half_space.factor == -1 else '0 and above'}"
            )
