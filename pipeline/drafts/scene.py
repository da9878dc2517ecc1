"""A first scene of a CAD part: it is thrown at a rigid plane, on its largest face that can lie on one."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gudgeon.pipeline.drafts.faces import Look, look_at, surface_name
from gudgeon.pipeline.drafts.writing import (
    GAP,
    PASSAGES,
    SOON,
    SPEED,
    SUPPORTS,
    WAVE,
    aligned,
    free_folder,
    mesh_line,
    mesh_notes,
    toml_name,
    volume_of,
    write_scene,
)
from gudgeon.pipeline.geometry.cad.faces import Face
from gudgeon.pipeline.geometry.cad.reading import solid_names
from gudgeon.pipeline.geometry.numbers import CAD_KINDS
from gudgeon.pipeline.geometry.surfaces import cylindrical
from gudgeon.pipeline.process.call import called_apart

EQUAL = 50
"""Faces whose areas differ by less than 1/50 are equal."""
TURN = np.pi / 2
"""Largest angle [rad] without samples around a bore; a fillet has more."""
MOST_SURFACES = 12

TEXT = """\
# {title} is thrown at a rigid plane at {speed:g} m/s. SI units. Every number is for you to change.
# {file}: {kind}, {size} mm, {mass:.4g} kg in steel.

[component.{name}]
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}  # steel: Pa, 1, kg/m^3
{mesh}
modes = {{ normal_count = 80 }}  # elastic modes; R adds what is left out of them

[component.{name}.geometry]
kind = "cad"
path = {path}
{unit}{solids}# around = 14  # elements around a full circle of curved faces, of blends where nothing acts fewer
# sizes = {{ {first} = {fine} }}  # finer elements on one surface [m]

[component.{name}.geometry.surfaces]  # the largest faces; `gudgeon faces {file}` lists and draws all
{surfaces}

# What touches the plane. Other kinds: "patch" (one mean row), "traction" (bodies slide over it), "mean", "tie".
[component.{name}.interface.impact]
surface = "{impact}"
{more}
[body.{name}]
velocity = {velocity}  # [m/s]

[contact.plane]
body = "{name}"
interface = "impact"
against = {{ shape = "plane", point = {point}, normal = {normal} }}
surface_stiffness = 1e13  # of the rough faces [N/m^3], a guess: the largest force grows with it, try 1e12 and 1e14

[run]
duration = {duration:.2g}  # [s]
"""


@dataclass(frozen=True)
class Impact:
    """The face that meets the plane."""

    face: Face
    direction: np.ndarray
    """Of the throw, unit vector (3,)."""
    reach: float
    """Largest coordinate of the part along it [m]."""


def write_draft(
    file: str, unit: float | None, solids: Sequence[str | int], folder: Path | None
) -> tuple[Path, list[str]]:
    """Write a folder with a scene of a CAD part and a copy of its file; return the folder and notes.

    Raises:
        InputError: the file is no part, or the folder exists or cannot be written.
        StageError: gmsh failed.
    """
    folder = free_folder(file, folder)
    if not solids and Path(file).suffix.lower() in CAD_KINDS:
        from gudgeon.pipeline.drafts.assembly import assembly_text

        names = called_apart(file, "gmsh", solid_names, file)
        if len(names) > 1:
            text, notes = assembly_text(file, unit, names, folder)
            write_scene(file, [file], folder, text)
            return folder, [*notes, *mesh_notes(text)]
    look = look_at(file, unit, solids, None)
    text = draft(look, unit, solids)
    write_scene(file, [file], folder, text)
    return folder, [*look.notes, *mesh_notes(text)]


def draft(look: Look, unit: float | None, solids: Sequence[str | int]) -> str:
    """Return the text of a scene of a part."""
    file = Path(look.path).name
    name = toml_name(Path(look.path).stem)
    impact = impact_of(look)
    extents = look.extents
    size, mesh = mesh_line(look, solids, impact.face.label)
    chosen = _surfaces(look, impact.face)
    duration = PASSAGES * float(np.linalg.norm(extents)) / WAVE
    foot = impact.direction * (impact.reach + min(GAP, SOON * duration * SPEED))
    surface = surface_name(impact.face)
    fine = f"{size / 2:.2g}"
    text = TEXT.format(
        title=file, file=file, kind=look.kind, name=name, speed=SPEED, mesh=mesh, fine=fine, first=surface,
        size=" × ".join(f"{1e3 * length:.4g}" for length in extents), mass=7850.0 * volume_of(look),
        path=json.dumps(file, ensure_ascii=False), unit="" if unit is None else f"unit = {unit:g}\n", impact=surface,
        solids=f"solids = {json.dumps(list(solids))}\n" if solids else "",
        surfaces="\n".join(look.rule_line(face) for face in chosen),
        more=_more(name, _bore(look, chosen)), velocity=_list(SPEED * impact.direction), point=_list(foot),
        normal=_list(-impact.direction), duration=duration,
    )  # fmt: skip
    return "\n".join(aligned(line) for line in text.split("\n"))


def impact_of(look: Look) -> Impact:
    """Return the largest flat face on which the part can stand; without one, the face of its lowest point."""
    extent = look.faces[0].extent
    flat = [face for face in look.faces if face.kind == "plane"]
    # Downward of equal ones.
    for face in sorted(flat, key=lambda face: (-round(EQUAL * math.log(face.area)), face.shape["normal"][2])):
        normal = np.array(face.shape["normal"])
        support = float(np.array(face.shape["origin"]) @ normal)
        if float((look.points @ normal).max()) <= support + SUPPORTS * extent:
            return Impact(face, normal, support)
    lowest = int(look.points[:, 2].argmin())
    owners = look.owner[(look.triangles == lowest).any(axis=1)]
    face = max((look.faces[int(owner)] for owner in owners), key=lambda face: face.area)
    return Impact(face, np.array([0.0, 0.0, -1.0]), -float(look.points[lowest, 2]))


def _surfaces(look: Look, impact: Face) -> list[Face]:
    """Return the face of the impact and the largest others, one of each rule."""
    faces: dict[str, Face] = {look.rules[impact.number]: impact}
    for face in sorted(look.faces, key=lambda face: -face.area):
        if len(faces) < MOST_SURFACES:
            faces.setdefault(look.rules[face.number], face)
    return list(faces.values())


def _bore(look: Look, faces: Sequence[Face]) -> Face | None:
    """Return the first hollow cylinder around a full turn, alone or with others by the same rule; None without one."""
    for face in faces:
        if face.kind != "cylinder" or not face.hollow:
            continue
        points = [f.points for f in look.same_rule(face)]
        _, angle, _ = cylindrical(np.concatenate(points), face.shape)
        angles = np.sort(angle)
        if np.diff(angles, append=angles[0] + 2 * np.pi).max() < TURN:
            return face
    return None


def _more(name: str, bore: Face | None) -> str:
    """Return further interfaces as comments: a bore for joints and forces, stress on the skin."""
    lines = []
    if bore is not None:
        lines += [f"# [component.{name}.interface.pin]  # for joints, springs and forces: a bore that moves rigidly",
                  f'# surface = "{surface_name(bore)}"', '# kind = "tie"', '# tie = "rbe2"', ""]  # fmt: skip
    lines += [f"# [component.{name}.gauge]  # stress.png: stress on the whole boundary",
              '# skin = { surface = "skin" }', ""]  # fmt: skip
    return "\n" + "\n".join(lines)


def _list(vector: np.ndarray) -> str:
    return "[{}]".format(", ".join(f"{0.0 if abs(value) < 1e-12 else value:.9g}" for value in vector))
