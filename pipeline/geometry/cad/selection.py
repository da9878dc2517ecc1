"""Which faces of a part a scene means: by number, name or colour in the file, kind and size, or nearest point."""

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated

import numpy as np
from pydantic import Field, field_validator, model_validator

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cad.faces import Face
from gudgeon.pipeline.geometry.numbers import Point, UnitVector
from gudgeon.pipeline.geometry.shape_fit import same_surface
from gudgeon.pipeline.geometry.surfaces import SurfaceRule
from gudgeon.solver.numbers import MOST, Angle, Length, Strict

Number = Annotated[int, Field(ge=1, le=MOST)]
"""Of a face or a solid."""

SAME_SIZE = 1e-3
"""Relative difference of radii that are the same: drawings state three digits."""
SAME_DIRECTION = 1e-3
"""Angle between normals that are the same [rad]."""
EQUALLY_NEAR = 1e-3
"""Difference of distances that may be equal, by the part's extent: points have few digits."""
TWICE, ON = 2.0, 1e-7
"""Distance of another face over that of the nearest one, and by the part's extent, from which on the point is next to
the latter alone: faces may be a hundredth of a millimetre apart."""
NEAR = 0.1
"""Distance of a point from all faces, by the part's extent, from which the point is refused."""
SHOWN = 4
Away = Callable[[Sequence[Face], np.ndarray], np.ndarray]
"""Returns the distances [m] of faces from a point [m], (3,)."""


class FaceRule(Strict):
    """A description that faces meet in every given key."""

    face: tuple[Number, ...] | Number | None = Field(default=None, description="Numbers of faces, from `gudgeon faces`")
    name: str | None = Field(default=None, description="Name of the faces in the CAD file")
    colour: str | None = Field(default=None, description="Colour of the faces in the CAD file, as '#rrggbb'")
    plane_normal: UnitVector | None = Field(default=None, description="Flat, with this outward normal")
    cylinder_radius: Length | None = Field(default=None, description="Cylindrical, with this radius [m]")
    sphere_radius: Length | None = Field(default=None, description="Spherical, with this radius [m]")
    cone_angle_deg: Angle | None = Field(default=None, description="Conical, with this angle between surface and axis")
    at: Point | None = Field(
        default=None,
        description="Of the faces that meet the other keys the one nearest to this point [m], with its neighbours on"
        " the same true surface",
    )
    all: bool = Field(
        default=False, description="Take all faces that meet the other keys, although they lie on several surfaces"
    )

    @field_validator("colour")
    @classmethod
    def _colour(cls, value: str | None) -> str | None:
        if value is not None and not (value.startswith("#") and len(value) == 7):
            raise ValueError(f"'{value}' given; a colour is written as '#rrggbb'")
        return None if value is None else value.lower()

    @model_validator(mode="after")
    def _says_something(self) -> "FaceRule":
        if not self.model_fields_set - {"all"}:
            raise ValueError("is empty; give face, name, colour, plane_normal, cylinder_radius, … or at")
        if self.all and self.at is not None:
            raise ValueError("`all` and `at` given; `at` chooses one surface")
        return self

    def meets(self, face: Face) -> bool:
        """Return whether a face meets every key but `at`."""
        return self.misses(face) == 0

    def misses(self, face: Face) -> float:
        """Return how far a face is from the rule: 0 if it meets it, ∞ if it is of another kind, without `at`."""
        misses = [0.0]
        for rule_text, face_text in ((self.name, face.name), (self.colour, face.colour)):
            misses.append(0.0 if rule_text in (None, face_text) else np.inf)
        if self.face is not None:
            misses.append(0.0 if face.number in np.atleast_1d(self.face) else np.inf)
        for key, kind, target, allowed in self._sizes():
            if face.kind != kind:
                misses.append(np.inf)
            elif kind == "plane":
                angle = float(np.linalg.norm(np.subtract(face.shape["normal"], target)))
                misses.append(0.0 if angle <= allowed else angle)
            else:
                off = abs(face.shape[key] / target - 1)
                misses.append(0.0 if off <= allowed else off)
        return float(sum(misses))

    def _sizes(self) -> list[tuple[str, str, float, float]]:
        angle = None if self.cone_angle_deg is None else np.radians(self.cone_angle_deg)
        rows = [
            ("normal", "plane", self.plane_normal, SAME_DIRECTION),
            ("radius", "cylinder", self.cylinder_radius, SAME_SIZE),
            ("radius", "sphere", self.sphere_radius, SAME_SIZE), ("angle", "cone", angle, SAME_SIZE),
        ]  # fmt: skip
        return [(key, kind, target, allowed) for key, kind, target, allowed in rows if target is not None]


def faces_by_name(
    rules: Mapping[str, FaceRule], faces: Sequence[Face], away: Away, path: str
) -> dict[str, tuple[list[Face], SurfaceRule]]:
    """Return the faces of each named surface, and its true shape, empty if its faces have no common one.

    Every face is also a surface of its own, `face7`.

    Args:
        path: The file, for messages.

    Raises:
        InputError: a rule matches no face, or faces on several surfaces, or has the name of another face.
    """
    named = {face.label: ([face], face.shape) for face in faces}
    for name, rule in rules.items():
        if name in named:
            raise InputError(f"{path}: surfaces.{name}: given twice, it is also the name of face {name[4:]}")
        chosen = chosen_faces(rule, faces, away, f"{path}: surfaces.{name}")
        named[name] = chosen, common_shape(chosen)
    return named


def chosen_faces(rule: FaceRule, faces: Sequence[Face], away: Away, key: str) -> list[Face]:
    """Return the faces that a rule describes; `key` is its key, for messages.

    Raises:
        InputError: there is none, or they lie on several true surfaces and the rule has neither `at` nor `all`.
    """
    matching = [face for face in faces if rule.meets(face)]
    if rule.face is not None and (unknown := set(np.atleast_1d(rule.face).tolist()) - {f.number for f in faces}):
        lowest, highest = faces[0].number, faces[-1].number
        raise InputError(f"{key}: no outer face {min(unknown)}; the part has {len(faces)}, from {lowest} to {highest}")
    if not matching:
        raise InputError(f"{key}: no face matches; {_in_metres(rule, faces)}{_nearest(rule, faces)}")
    if rule.at is not None:
        return _at(matching, away(matching, np.array(rule.at)), key)
    if rule.face is not None or rule.all or common_shape(matching) or len(matching) == 1:
        return matching
    raise InputError(
        f"{key}: {len(matching)} faces match, which lie on several surfaces: {_listed(matching)}; add `at`, a point"
        " next to the one, or `all = true`"
    )


def common_shape(faces: Sequence[Face]) -> SurfaceRule:
    """Return the true surface on which all faces lie, empty if there is none."""
    reference = faces[0]
    same = all(
        same_surface(reference.shape, face.shape, face.extent) and face.hollow == reference.hollow for face in faces
    )
    return reference.shape if same else {}


def _at(matching: list[Face], away: np.ndarray, key: str) -> list[Face]:
    """Return the nearest face with the neighbours that continue its true surface; `away` are distances [m], (k,)."""
    order = np.argsort(away)
    nearest, extent = matching[order[0]], matching[order[0]].extent
    if away[order[0]] > NEAR * extent:
        raise InputError(
            f"{key}: `at` is {1e3 * away[order[0]]:.4g} mm from the nearest face that matches,"
            f" {nearest.text()}; allowed: {1e3 * NEAR * extent:.4g} mm; it is in metres"
        )
    chosen = [nearest]
    for face in chosen:
        chosen += [
            f for f in matching
            if f not in chosen and f.edges & face.edges and common_shape([nearest, f])
        ]  # fmt: skip
    rivals_within = min(away[order[0]] + EQUALLY_NEAR * extent, TWICE * away[order[0]] + ON * extent)
    rivals = [matching[k] for k in order[1:] if matching[k] not in chosen and away[k] <= rivals_within]
    if rivals:
        raise InputError(f"{key}: `at` is equally near to {_listed([nearest, *rivals])}; give a point inside of one")
    return chosen


def _nearest(rule: FaceRule, faces: Sequence[Face]) -> str:
    """Return the faces that come nearest to a rule, as text."""
    sizes = {face.number: FaceRule.model_validate(_only_sizes(rule)).misses(face) for face in faces} if _only_sizes(
        rule) else {}  # fmt: skip
    nearest = sorted((f for f in faces if np.isfinite(sizes.get(f.number, np.inf))), key=lambda f: sizes[f.number])
    if nearest:
        return f"the nearest are {_listed(nearest)}"
    for key in ("name", "colour"):
        have = sorted({getattr(face, key) for face in faces} - {""})
        if getattr(rule, key) is not None:
            return f"the file's {key}s are {', '.join(have[:SHOWN])}" if have else f"its faces have no {key}s"
    kinds = ", ".join(sorted({face.kind for face in faces}))
    return f"the part's {len(faces)} faces are of kind {kinds}"


def _in_metres(rule: FaceRule, faces: Sequence[Face]) -> str:
    """Return the radius in metres of a rule that was written in mm or µm; empty of any other."""
    for key, value in _only_sizes(rule).items():
        for factor in (1e-3, 1e-6):
            if key.endswith("radius") and isinstance(value, float):
                size = f"{value * factor:.7g}"
                if any(FaceRule.model_validate({key: float(size)}).meets(face) for face in faces):
                    return f"lengths are in metres: {key} = {size}; "
    return ""


def _only_sizes(rule: FaceRule) -> dict[str, object]:
    sizes = rule.model_dump(exclude_none=True, include={"plane_normal", "cylinder_radius", "sphere_radius",
                                                        "cone_angle_deg"})  # fmt: skip
    return dict(sizes)


def _listed(faces: Sequence[Face]) -> str:
    suffix = f" and {len(faces) - SHOWN} more" if len(faces) > SHOWN else ""
    return ", ".join(face.text() for face in faces[:SHOWN]) + suffix
