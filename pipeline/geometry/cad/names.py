"""Names of faces: in a script the physical groups; in a STEP file, whose names OpenCASCADE drops, by their corners."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.geometry.cad.placements import chains, placed_names, shells_of
from gudgeon.pipeline.geometry.cad.step_text import corners_of, instances_of, labels_of
from gudgeon.pipeline.geometry.cad.units import MODEL_UNIT, kind_of_file, stated_unit

NO_NAME = ("", "NONE", "none")
ROUNDED = 1e-5
"""Corners are the same that differ by less, over the part's extent."""


def face_names(gmsh: Any, path: str, faces: list[int]) -> dict[int, str]:
    """Return the names of faces in gmsh's model that have one in their file, by number.

    A face is that of the file with the same corners, of a part that an assembly places elsewhere once its shell is
    moved there; of several with the same corners, such as the halves of a cylinder, in the order of the file.
    """
    if kind_of_file(path) == "gmsh script":
        return _names_of_groups(gmsh)
    if kind_of_file(path) != "STEP":
        return {}
    instances = instances_of(Path(path).read_text(errors="replace"))
    labels = labels_of(instances)
    if len(set(labels.values()) - set(NO_NAME)) < 2:
        return {}  # The only name is that of the part.
    unit = (stated_unit(path) or MODEL_UNIT) / MODEL_UNIT
    corners = {face: _corners(gmsh, face) for face in faces}
    every = np.concatenate([c for c in corners.values() if len(c)] or [np.zeros((1, 3))])
    extent = float(np.linalg.norm(np.ptp(every, axis=0)))
    grid = ROUNDED * extent or 1.0
    of_file: dict[Any, list[str]] = {}
    for instance, name in labels.items():
        of_file.setdefault(_key(unit * corners_of(instance, instances), grid), []).append(name)
    names_by_face = _names_at(of_file, corners, grid)
    motions = chains(instances, unit)
    if motions:
        elsewhere = _unnamed_solids(gmsh, corners, names_by_face)
        names_by_face |= placed_names(list(shells_of(instances, labels, unit)), motions, elsewhere, extent)
    return {face: name for face, name in names_by_face.items() if face in corners and name not in NO_NAME}


def _names_of_groups(gmsh: Any) -> dict[int, str]:
    """Return the names of the physical groups of faces by face."""
    groups = [(gmsh.model.getPhysicalName(2, tag), tag) for _, tag in gmsh.model.getPhysicalGroups(2)]
    return {int(face): name for name, tag in groups for face in gmsh.model.getEntitiesForPhysicalGroup(2, tag)}


def _names_at(of_file: Mapping[Any, list[str]], corners: Mapping[int, np.ndarray], grid: float) -> dict[int, str]:
    """Return the names of faces by number, where the file has as many faces with the same corners."""
    of_model: dict[Any, list[int]] = {}
    for face, points in corners.items():
        of_model.setdefault(_key(points, grid), []).append(face)
    names_by_face: dict[int, str] = {}
    for key, numbers in of_model.items():
        if len(names := of_file.get(key, [])) == len(numbers):
            names_by_face |= dict(zip(numbers, names, strict=True))
    return names_by_face


def _unnamed_solids(
    gmsh: Any, corners: Mapping[int, np.ndarray], names_by_face: Mapping[int, str]
) -> list[dict[int, np.ndarray]]:
    """Return the corners of all faces of each solid with a face that has no name."""
    solids = [[int(face) for face in gmsh.model.getAdjacencies(3, tag)[1]] for _, tag in gmsh.model.getEntities(3)]
    return [
        {face: corners[face] if face in corners else _corners(gmsh, face) for face in faces}
        for faces in solids
        if not all(face in names_by_face for face in faces if face in corners)
    ]


def _key(points: np.ndarray, grid: float) -> Any:
    return tuple(sorted({tuple(p) for p in np.round(points / grid / 10).astype(int).tolist()}))


def _corners(gmsh: Any, face: int) -> np.ndarray:
    points = gmsh.model.getBoundary([(2, face)], combined=False, oriented=False, recursive=True)
    return np.array([gmsh.model.getValue(0, tag, []) for _, tag in points]).reshape(-1, 3)
