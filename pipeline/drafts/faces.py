"""The faces of a CAD part as a table, as rules that a scene can use, and as a picture."""

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cad.faces import Face, vector_text
from gudgeon.pipeline.geometry.cad.part import CadPart, opened
from gudgeon.pipeline.geometry.cad.picture import triangles_of
from gudgeon.pipeline.geometry.cad.reading import solid_name
from gudgeon.pipeline.geometry.cad.selection import FaceRule, chosen_faces, common_shape
from gudgeon.pipeline.geometry.cad.units import differs, kind_of_file, stated_unit
from gudgeon.pipeline.plots import render_faces
from gudgeon.pipeline.process.call import called_apart


@dataclass(frozen=True)
class Look:
    """What a CAD part consists of."""

    path: str
    kind: str
    unit: float | None
    """Metres per unit that the file states, or that was given."""
    given_unit: float | None
    """Of them what was given."""
    solids: dict[int, str]
    """Names by number."""
    faces: list[Face]
    rules: dict[int, str]
    """Rule that describes each face, or its surface, alone, as a table of a scene."""
    points: np.ndarray
    """Corners of the triangles of its boundary [m], (n, 3)."""
    triangles: np.ndarray
    """(t, 3)."""
    owner: np.ndarray
    """Place in `faces` of the face of each triangle, (t,)."""
    volume: float
    """[m^3]; NaN of gmsh's own kernel."""
    picture: Path | None
    notes: list[str]

    @property
    def extents(self) -> np.ndarray:
        """Extents along x, y, z [m], (3,)."""
        return np.ptp(self.points, axis=0)

    def as_json(self) -> dict[str, Any]:
        """Return it as one document, in SI units."""
        keys = ("number", "solid", "kind", "hollow", "area", "name", "colour", "residual", "shape")
        return {
            "file": self.path, "kind": self.kind, "unit": self.unit, "solids": self.solids,
            "extents": self.extents.tolist(), "volume": self.volume,
            "faces": [
                {key: getattr(face, key) for key in keys}
                | {"centre": face.centre.tolist(), "rule": self.rules[face.number]}
                for face in self.faces
            ],
            "picture": None if self.picture is None else str(self.picture),
        }  # fmt: skip

    def as_text(self) -> str:
        """Return a table of the faces, and the rules to paste into a scene."""
        size = " × ".join(f"{1e3 * length:.5g}" for length in self.extents)
        unit = "no unit" if self.unit is None else f"unit {self.unit:g} m"
        solids = ", ".join(f"{n} '{name}'" if name else str(n) for n, name in self.solids.items())
        lines = [
            f"{self.path}: {self.kind}, {unit}, {size} mm, {1e9 * self.volume:.6g} mm^3",
            f"solids: {solids}",
            "",
            f"{'face':>4}  {'kind':17} {'area [mm^2]':>11}  {'centre [mm]':26} {'normal, radius or angle':30}"
            f" {'off [mm]':>8}  name, colour",
        ]
        for face in self.faces:
            centre = ", ".join(f"{_clean(1e3 * value, face):.5g}" for value in face.centre)
            kind = f"{face.kind}, hollow" if face.hollow else face.kind
            lines.append(
                f"{face.number:4}  {kind:17} {1e6 * face.area:11.5g}  {centre:26} {_size(face):30}"
                f" {1e3 * face.residual:8.1g}  {' '.join(filter(None, (face.name, face.colour)))}".rstrip()
            )
        lines += ["", "[component.NAME.geometry.surfaces]    # for the scene: what you need, by names of your own"]
        lines += [self.rule_line(face) for face in self.faces]
        return "\n".join(lines)

    def rule_line(self, face: Face) -> str:
        """Return a face's name and rule as a line of a scene; of faces apart from each other, which they are."""
        line, same = f"{surface_name(face)} = {self.rules[face.number]}", self.same_rule(face)
        joined = [face]
        for member in joined:
            joined += [f for f in same if f not in joined and f.edges & member.edges]
        if len(joined) == len(same):
            return line
        numbers = ", ".join(str(member.number) for member in same)
        return f"{line}  # faces {numbers}; with `at`, a point on one of them, that one alone"

    def same_rule(self, face: Face) -> list[Face]:
        """Return the faces that the rule of a face describes."""
        return [f for f in self.faces if self.rules[f.number] == self.rules[face.number]]


def look_at(path: str, unit: float | None, solids: Sequence[str | int], picture: Path | None) -> Look:
    """Read a CAD part, and draw its faces with their numbers if a picture is wanted.

    Raises:
        InputError: the file is no part, see `geometry.cad.reading`.
        StageError: gmsh failed.
    """
    cad = CadPart(kind="cad", path=path, unit=unit, solids=tuple(solids))
    notes = []
    names, faces, rules, volume, arrays = called_apart(path, "gmsh", _read, cad)
    stated = stated_unit(path)
    if (stated_other := differs(path, unit)) is not None:
        notes.append(f"{path}: states a unit of {stated_other:g} m, {unit:g} m is used")
    drawn = None
    if picture is not None:
        reason = _draw(arrays, Path(path).name, picture)
        drawn = picture if reason is None else None
        notes += [] if reason is None else [f"{picture} was not drawn: {reason}"]
    return Look(
        path=path, kind=kind_of_file(path), unit=unit if unit is not None else stated,
        given_unit=unit, solids=names, faces=faces,
        rules=rules, points=arrays["points"], triangles=arrays["triangles"], owner=arrays["owner"], volume=volume,
        picture=drawn, notes=notes,
    )  # fmt: skip


def _read(
    cad: CadPart,
) -> tuple[dict[int, str], list[Face], dict[int, str], float, dict[str, np.ndarray]]:
    """Return the solids, faces and rules of a part, its volume, and its triangles: what `Look` keeps of gmsh."""
    with opened(cad) as opened_part:
        gmsh, faces, scale = opened_part.gmsh, opened_part.faces, opened_part.scale
        names = {tag: solid_name(gmsh, tag) for tag in opened_part.solids}
        rules = {face.number: rule_of(face, faces, opened_part.away) for face in faces}
        return names, faces, rules, opened_part.exact_volume(), triangles_of(gmsh, faces, scale)


def rule_of(face: Face, faces: Sequence[Face], away: Callable[[Sequence[Face], np.ndarray], np.ndarray]) -> str:
    """Return the shortest rule that describes a face, with the others on its true surface, as a table of a scene."""
    size = _key(face)
    position = face.points[int(np.linalg.norm(face.points - face.centre, axis=1).argmin())]
    point = "[{}]".format(", ".join(f"{_clean(value, face):.6g}" for value in position))
    texts = ([size] if size else []) + [f"{size}, at = {point}" if size else f"at = {point}"]
    for text in texts:
        try:
            chosen = chosen_faces(FaceRule.model_validate(_values(text)), faces, away, "")
        except InputError:
            continue
        if face in chosen and (len(chosen) == 1 or common_shape(chosen)):
            return f"{{ {text} }}"
    return f"{{ face = {face.number} }}"


def surface_name(face: Face) -> str:
    """Return a name for a face, by its kind and number."""
    kind = "bore" if face.kind == "cylinder" and face.hollow else face.kind.split()[0]
    return f"{''.join(c for c in kind if c.isalnum()) or 'surface'}{face.number}"


def _key(face: Face) -> str:
    if face.kind == "plane":
        return f"plane_normal = {_vector(face.shape['normal'])}"
    if face.kind in ("cylinder", "sphere"):
        return f"{face.kind}_radius = {face.shape['radius']:.7g}"
    return f"cone_angle_deg = {np.degrees(face.shape['angle']):.6g}" if face.kind == "cone" else ""


def _vector(vector: Sequence[float]) -> str:
    return "[{}]".format(", ".join(f"{value:.7g}" if abs(value) > 1e-9 else "0" for value in vector))


def _values(text: str) -> Mapping[str, Any]:
    import tomllib

    return tomllib.loads(f"rule = {{ {text} }}")["rule"]


def _size(face: Face) -> str:
    if face.kind == "plane":
        return vector_text(face.shape["normal"])
    if face.kind in ("cylinder", "sphere"):
        return f"{1e3 * face.shape['radius']:.6g} mm"
    return f"{np.degrees(face.shape['angle']):.5g} deg" if face.kind == "cone" else ""


def _clean(value: float, face: Face) -> float:
    """Return a coordinate of a face without its round-off."""
    return 0.0 if abs(value) < 1e-9 * max(face.extent, 1e3 * face.extent * (abs(value) > 1)) else value


def _draw(arrays: Mapping[str, np.ndarray], title: str, picture: Path) -> str | None:
    if not picture.parent.is_dir():
        raise InputError(f"{picture}: no folder {picture.parent}; allowed: a file in an existing folder")
    with tempfile.TemporaryDirectory(prefix="gudgeon-") as folder:
        data = Path(folder) / "faces.npz"
        np.savez(data, allow_pickle=False, title=np.array(title), **arrays)
        return render_faces(data, picture.resolve())
