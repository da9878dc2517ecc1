"""Names of faces: in a script the physical groups; in a STEP file, whose names OpenCASCADE drops, by their corners."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.geometry.cad.units import MODEL_UNIT, kind_of_file, stated_unit

INSTANCE = re.compile(r"#(\d+)\s*=\s*(\w+)\s*\((.*)\)\s*$", re.DOTALL)
TYPES = {
    "ADVANCED_FACE", "FACE_BOUND", "FACE_OUTER_BOUND", "EDGE_LOOP", "ORIENTED_EDGE", "EDGE_CURVE", "VERTEX_POINT",
    "CARTESIAN_POINT",
}  # fmt: skip
REFERENCE, LABEL = re.compile(r"#(\d+)"), re.compile(r"\s*'((?:[^']|'')*)'")
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
NO_NAME = ("", "NONE", "none")
ROUNDED = 1e-5
"""Corners are the same that differ by less, over the part's extent."""

Instances = dict[str, tuple[str, str]]


def face_names(gmsh: Any, path: str, faces: list[int]) -> dict[int, str]:
    """Return the names of faces in gmsh's model that have one in their file, by number.

    A face is that of the file with the same corners; of several with the same corners, such as the halves of a
    cylinder, in the order of the file. Parts that an assembly places elsewhere have none.
    """
    if kind_of_file(path) == "gmsh script":
        groups = [(gmsh.model.getPhysicalName(2, tag), tag) for _, tag in gmsh.model.getPhysicalGroups(2)]
        return {int(one): name for name, tag in groups for one in gmsh.model.getEntitiesForPhysicalGroup(2, tag)}
    if kind_of_file(path) != "STEP":
        return {}
    named = _named_corners(Path(path).read_text(errors="replace"))
    if len({name for name, _ in named} - set(NO_NAME)) < 2:
        return {}  # The only name is that of the part.
    unit = (stated_unit(path) or MODEL_UNIT) / MODEL_UNIT
    corners = {face: _corners(gmsh, face) for face in faces}
    every = np.concatenate([one for one in corners.values() if len(one)] or [np.zeros((1, 3))])
    grid = ROUNDED * float(np.linalg.norm(np.ptp(every, axis=0))) or 1.0
    of_file: dict[Any, list[str]] = {}
    for name, points in named:
        of_file.setdefault(_key(unit * points, grid), []).append(name)
    of_model: dict[Any, list[int]] = {}
    for face, points in corners.items():
        of_model.setdefault(_key(points, grid), []).append(face)
    found: dict[int, str] = {}
    for key, numbers in of_model.items():
        names = of_file.get(key, [])
        if len(names) == len(numbers):
            found |= {face: name for face, name in zip(numbers, names, strict=True) if name not in NO_NAME}
    return found


def _key(points: np.ndarray, grid: float) -> Any:
    return tuple(sorted({tuple(one) for one in np.round(points / grid / 10).astype(int).tolist()}))


def _corners(gmsh: Any, face: int) -> np.ndarray:
    points = gmsh.model.getBoundary([(2, face)], combined=False, oriented=False, recursive=True)
    return np.array([gmsh.model.getValue(0, tag, []) for _, tag in points]).reshape(-1, 3)


def _named_corners(text: str) -> list[tuple[str, np.ndarray]]:
    """Return name and corners (k, 3) of each face of a STEP file, in its order."""
    instances: Instances = {}
    for statement in text.split(";"):
        if (found := INSTANCE.search(statement.strip())) and found[2] in TYPES:
            instances[found[1]] = found[2], found[3]
    return [
        ("" if label[1] == f"#{number}" else label[1].replace("''", "'"), _points(number, instances))
        for number, (kind, body) in instances.items()
        if kind == "ADVANCED_FACE" and (label := LABEL.match(body))
    ]


def _points(face: str, instances: Instances) -> np.ndarray:
    """Return the corners of a face, (k, 3), through its loops, edges and vertices."""
    found, rest, seen = [], [face], {face}
    while rest:
        kind, body = instances.get(rest.pop(), ("", ""))
        below = REFERENCE.findall(LABEL.sub("", body))
        if kind == "CARTESIAN_POINT":
            found.append([float(value) for value in NUMBER.findall(body.rpartition("(")[2])][:3])
        else:
            last = {"ADVANCED_FACE": len(below) - 1, "EDGE_CURVE": 2}.get(kind, len(below))  # Then comes the geometry.
            rest += [one for one in below[:last] if one not in seen]
            seen.update(below)
    return np.array([one for one in found if len(one) == 3]).reshape(-1, 3)
