"""Instances of a STEP file as text: what OpenCASCADE drops when gmsh reads the file."""

import re

import numpy as np

INSTANCE = re.compile(r"#(\d+)\s*=\s*(\w+)\s*\((.*)\)\s*$", re.DOTALL)
TYPES = {
    "ADVANCED_FACE", "FACE_BOUND", "FACE_OUTER_BOUND", "EDGE_LOOP", "ORIENTED_EDGE", "EDGE_CURVE", "VERTEX_POINT",
    "CARTESIAN_POINT", "CLOSED_SHELL", "ITEM_DEFINED_TRANSFORMATION", "AXIS2_PLACEMENT_3D", "DIRECTION",
}  # fmt: skip
REFERENCE, LABEL = re.compile(r"#(\d+)"), re.compile(r"\s*'((?:[^']|'')*)'")
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")

Instances = dict[str, tuple[str, str]]
"""Type and parameters of instances by their number."""


def instances_of(text: str) -> Instances:
    """Return the instances of the types that names and placements need."""
    instances: Instances = {}
    for statement in text.split(";"):
        if (match := INSTANCE.search(statement.strip())) and match[2] in TYPES:
            instances[match[1]] = match[2], match[3]
    return instances


def labels_of(instances: Instances) -> dict[str, str]:
    """Return the name of each face by its instance, in the order of the file; empty where it is its own number."""
    return {
        instance: "" if label[1] == f"#{instance}" else label[1].replace("''", "'")
        for instance, (kind, body) in instances.items()
        if kind == "ADVANCED_FACE" and (label := LABEL.match(body))
    }


def references(body: str) -> list[str]:
    """Return the numbers of the instances that parameters name, those within texts not."""
    return REFERENCE.findall(re.sub(r"'(?:[^']|'')*'", "", body))


def place_of(instance: str, instances: Instances) -> np.ndarray:
    """Return the coordinates of a CARTESIAN_POINT or the components of a DIRECTION, (3,)."""
    _, body = instances.get(instance, ("", ""))
    coordinates = [float(value) for value in NUMBER.findall(body.rpartition("(")[2])][:3]
    return np.array(coordinates) if len(coordinates) == 3 else np.zeros(3)


direction_of = place_of


def corners_of(face: str, instances: Instances) -> np.ndarray:
    """Return the corners of a face, (k, 3), through its loops, edges and vertices."""
    points, pending, seen = [], [face], {face}
    while pending:
        kind, body = instances.get(pending.pop(), ("", ""))
        below = REFERENCE.findall(LABEL.sub("", body))
        if kind == "CARTESIAN_POINT":
            points.append([float(value) for value in NUMBER.findall(body.rpartition("(")[2])][:3])
        else:
            stop = {"ADVANCED_FACE": len(below) - 1, "EDGE_CURVE": 2}.get(kind, len(below))  # Then comes the geometry.
            pending += [p for p in below[:stop] if p not in seen]
            seen.update(below)
    return np.array([p for p in points if len(p) == 3]).reshape(-1, 3)
