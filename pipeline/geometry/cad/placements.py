"""Names of faces of parts that an assembly places: the file's shells, moved as its placements say, meet the solids.

A STEP file has each part once, in its own axes, and item-defined transformations from axes to axes. Every chain of up
to `DEEPEST` of them is a candidate; one that moves the corners of a shell onto those of a solid is the place of that
solid. Where several do, as with a symmetric part, a face has a name only if all agree. Solids that were glued have more
corners, and a face that was divided has no name.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.cad.step_text import Instances, corners_of, direction_of, place_of, references

DEEPEST = 3
"""Assemblies within assemblies."""
MOST_CHAINS = 10_000
"""Of one length."""
NEAR = 1e-5
"""How far corners may be from each other, over the extent of all faces."""


class Shell(NamedTuple):
    """The faces of a part in the file."""

    names: list[str]
    corners: list[np.ndarray]
    """In the file's unit, (k, 3) each."""


Motion = tuple[np.ndarray, np.ndarray]
"""Rotation (3, 3) and translation (3,)."""


def placed_names(
    shells: Sequence[Shell], motions: Sequence[Motion], solids: Sequence[Mapping[int, np.ndarray]], extent: float
) -> dict[int, str]:
    """Return the names of faces of placed solids by their number; a name may be empty.

    Args:
        shells: In the unit of the solids.
        motions: Of chains of placements.
        solids: Corners (k, 3) of the faces of each by their number.
        extent: Of all faces.
    """
    names: dict[int, str] = {}
    turns, shifts = (np.array(stack) for stack in zip(*motions, strict=True))
    different = [_different(shell.corners, NEAR * extent) for shell in shells]
    for solid in solids:
        cloud = _different(list(solid.values()), NEAR * extent)
        choices: list[dict[int, str]] = []
        for shell, corners in zip(shells, different, strict=True):
            if not 0 < len(corners) <= len(cloud):
                continue
            fitting = np.arange(len(turns))
            for corner in corners:  # Each leaves fewer motions to look at.
                moved = turns[fitting] @ corner + shifts[fitting]
                off = np.linalg.norm(moved[:, None] - cloud, axis=2).min(axis=1)
                fitting = fitting[off <= NEAR * extent]
            choices += [_matched(shell, solid, cloud, motions[int(k)], NEAR * extent) for k in fitting]
        if choices:
            names |= {face: name for face, name in choices[0].items() if all(c.get(face) == name for c in choices)}
    return names


def chains(instances: Instances, unit: float) -> list[Motion]:
    """Return the motions of all chains of placements in a file; lengths times `unit`."""
    ways: tuple[list[Motion], list[Motion]] = [], []
    for kind, body in instances.values():
        if kind == "ITEM_DEFINED_TRANSFORMATION" and len(ends := references(body)) >= 2:
            start, stop = (_axes(end, instances, unit) for end in ends[-2:])
            if start is None or stop is None:
                continue
            # Programs differ in which of both ends is that of the part.
            for motions, p, q in zip(ways, (start, stop), (stop, start), strict=True):
                turn = q[0] @ p[0].T
                motions.append((turn, q[1] - turn @ p[1]))
    all_motions: list[Motion] = []
    for single in ways:
        level = single
        all_motions += single
        for _ in range(DEEPEST - 1):
            level = [(a @ b, a @ s + t) for a, t in single for b, s in level][:MOST_CHAINS]
            all_motions += level
    rows = np.array([[*np.round(turn.ravel(), 9), *np.round(shift, 9)] for turn, shift in all_motions]).reshape(-1, 12)
    _, first_of = np.unique(rows, axis=0, return_index=True)
    return [all_motions[k] for k in sorted(first_of)]


def shells_of(instances: Instances, faces: Mapping[str, str], unit: float) -> Iterator[Shell]:
    """Yield the shells of a file; `faces` has the name of each face by its instance."""
    for kind, body in instances.values():
        if kind == "CLOSED_SHELL":
            named = [face for face in references(body) if face in faces]
            yield Shell([faces[face] for face in named], [unit * corners_of(face, instances) for face in named])


def _axes(instance: str, instances: Instances, unit: float) -> Motion | None:
    """Return an AXIS2_PLACEMENT_3D as rotation and origin; None if it is something else."""
    kind, body = instances.get(instance, ("", ""))
    if kind != "AXIS2_PLACEMENT_3D":
        return None
    origin, *directions = references(body)
    directions_given = [direction_of(r, instances) for r in directions]
    axis = directions_given[0] if directions_given else np.array([0.0, 0.0, 1.0])
    towards = directions_given[1] if len(directions_given) > 1 else np.array([1.0, 0.0, 0.0])
    z = axis / np.linalg.norm(axis)
    x = towards - (towards @ z) * z
    if np.linalg.norm(x) < 1e-9:
        x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z]), unit * place_of(origin, instances)


def _different(corners: Sequence[np.ndarray], tolerance: float) -> np.ndarray:
    """Return the different corners of faces, (k, 3)."""
    distinct: list[np.ndarray] = []
    for point in np.concatenate([np.empty((0, 3)), *corners]):
        if not distinct or np.linalg.norm(np.array(distinct) - point, axis=1).min() > tolerance:
            distinct.append(point)
    return np.array(distinct).reshape(-1, 3)


def _matched(
    shell: Shell, solid: Mapping[int, np.ndarray], cloud: np.ndarray, motion: Motion, tolerance: float
) -> dict[int, str]:
    """Return the names of those faces of a solid that have the corners of a face of the moved shell."""
    turn, shift = motion
    keys: dict[frozenset[int], list[str]] = {}
    for name, corners in zip(shell.names, shell.corners, strict=True):
        if (key := _numbers(corners @ turn.T + shift, cloud, tolerance)) is not None:
            keys.setdefault(key, []).append(name)
    names: dict[int, str] = {}
    groups: dict[frozenset[int], list[int]] = {}
    for face, corners in solid.items():
        if (key := _numbers(corners, cloud, tolerance)) is not None:
            groups.setdefault(key, []).append(face)
    for key, faces in groups.items():
        if len(keys.get(key, [])) == len(faces):
            names |= dict(zip(faces, keys[key], strict=True))
    return names


def _numbers(corners: np.ndarray, cloud: np.ndarray, tolerance: float) -> frozenset[int] | None:
    """Return which points of a cloud corners are; None if one is none of them."""
    if not len(corners):
        return frozenset()
    lengths = np.linalg.norm(corners[:, None] - cloud, axis=2)
    return None if lengths.min(axis=1).max() > tolerance else frozenset(lengths.argmin(axis=1).tolist())
