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
    found: Instances = {}
    for statement in text.split(";"):
        if (match := INSTANCE.search(statement.strip())) and match[2] in TYPES:
            found[match[1]] = match[2], match[3]
    return found


def labels_of(instances: Instances) -> dict[str, str]:
    """Return the name of each face by its instance, in the order of the file; empty where it is its own number."""
    return {
        number: "" if label[1] == f"#{number}" else label[1].replace("''", "'")
        for number, (kind, body) in instances.items()
        if kind == "ADVANCED_FACE" and (label := LABEL.match(body))
    }


def references(body: str) -> list[str]:
    """Return the numbers of the instances that parameters name, those within texts not."""
    return REFERENCE.findall(re.sub(r"'(?:[^']|'')*'", "", body))


def place_of(number: str, instances: Instances) -> np.ndarray:
    """Return the coordinates of a CARTESIAN_POINT or the components of a DIRECTION, (3,)."""
    _, body = instances.get(number, ("", ""))
    found = [float(value) for value in NUMBER.findall(body.rpartition("(")[2])][:3]
    return np.array(found) if len(found) == 3 else np.zeros(3)


direction_of = place_of


def corners_of(face: str, instances: Instances) -> np.ndarray:
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
