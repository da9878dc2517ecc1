"""A first scene of several bodies, or of the solid of a deck: all are thrown together at a rigid plane."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gudgeon.pipeline.drafts.writing import GAP, PASSAGES, SOON, SPEED, SUPPORTS, WAVE, aligned, toml_name
from gudgeon.pipeline.geometry.decks.axes import Axes

STEEL = "{ E = 210e9, nu = 0.3, rho = 7850.0 }  # steel: Pa, 1, kg/m^3"
MODES = 40
"""Elastic modes of each component."""
BESIDE = 9
"""Degrees of freedom of a mesh that are no elastic modes: rigid motions, and three that an extraction keeps spare."""
NEAR = 0.02
"""Distance from the plane, over the size of everything, within which the faces of other bodies touch it too."""
FACING = 0.999
"""Least cosine between the normal of a face and the direction of the throw."""


@dataclass(frozen=True, eq=False)
class Flat:
    """A flat face of a body."""

    surface: str
    normal: np.ndarray
    """Outward, in the component's axes, (3,)."""
    height: float
    """Of its points along the normal [m]."""
    area: float
    """[m^2]"""


@dataclass(frozen=True, eq=False)
class Solid:
    """A component of the draft."""

    name: str
    geometry: Sequence[str]
    """Lines of its table."""
    material: str
    """Value of its material, with a comment; empty where the geometry gives it."""
    mesh: str
    """Line of its mesh size; empty where the file has its own."""
    points: np.ndarray
    """Of its boundary [m], (n, 3)."""
    flats: Sequence[Flat]
    unit: float = 1.0
    """Metres per unit of length of its file."""


@dataclass(frozen=True, eq=False)
class Placed:
    """A body of the draft."""

    name: str
    solid: Solid
    axes: Axes

    @property
    def points(self) -> np.ndarray:
        """Of its boundary in the scene [m], (n, 3)."""
        return self.axes.placed(self.solid.points)


def scene_text(title: str, summary: Sequence[str], bodies: Sequence[Placed]) -> str:
    """Return the text of a scene in which bodies fly at a plane on which they can stand."""
    direction, height = _throw(bodies)
    extent = float(np.linalg.norm(np.ptp(np.concatenate([body.points for body in bodies]), axis=0)))
    duration = PASSAGES * extent / WAVE
    meeting = _meeting(bodies, direction, height, extent)
    verb = "is" if len(bodies) == 1 else "are"
    lines = [f"# {title} {verb} thrown at a rigid plane at {SPEED:g} m/s. SI units. Every number is for you to change."]
    lines += [f"# {line}" for line in summary]
    solids: dict[str, Solid] = {body.solid.name: body.solid for body in bodies}
    for name, solid in solids.items():
        lines += ["", f"[component.{name}]"]
        lines += [f"material = {solid.material}"] if solid.material else []
        lines += [solid.mesh] if solid.mesh else []
        count = MODES if solid.mesh else min(MODES, 3 * len(solid.points) - BESIDE)
        lines += [f"modes = {{ normal_count = {count} }}  # elastic modes; R adds what is left out of them"]
        lines += ["", f"[component.{name}.geometry]", *solid.geometry]
        for surface in dict.fromkeys(s for body, s in meeting.items() if body.solid.name == name):
            lines += ["", f"[component.{name}.interface.{_interface_name(surface)}]", f"surface = {text(surface)}"]
    for body in bodies:
        lines += ["", f"[body.{body.name}]", *_body_lines(body, SPEED * direction)]
    point = direction * (height + min(GAP, SOON * duration * SPEED))
    plane = f'against = {{ shape = "plane", point = {_list(point)}, normal = {_list(-direction)} }}'
    for body, surface in meeting.items():
        interface = f'interface = "{_interface_name(surface)}"'
        lines += ["", f"[contact.{body.name}]", f'body = "{body.name}"', interface, plane,
                  "surface_stiffness = 1e13  # of the rough faces [N/m^3], a guess: try 1e12 and 1e14"]  # fmt: skip
    if not meeting:
        lines += [
            "",
            "# No named flat face can meet a plane: name one in the file, add an interface and a contact.",
        ]
    lines += ["", "[run]", f"duration = {duration:.2g}  # [s]", ""]
    return "\n".join(aligned(line) for line in lines)


def _throw(bodies: Sequence[Placed]) -> tuple[np.ndarray, float]:
    """Return the direction towards a plane on which all bodies can stand, on their largest flat face, and its height
    along it [m]; downward without such a face."""
    points = np.concatenate([body.points for body in bodies])
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    faces = [(face.area, body.axes.turn @ face.normal, body, face) for body in bodies for face in body.solid.flats]
    for _, normal, body, face in sorted(faces, key=lambda row: (-round(row[0], 12), row[1][2])):
        height = face.height + float(normal @ body.axes.origin)
        if float((points @ normal).max()) <= height + SUPPORTS * extent:
            return normal, height
    down = np.array([0.0, 0.0, -1.0])
    return down, float((points @ down).max())


def _meeting(bodies: Sequence[Placed], direction: np.ndarray, height: float, extent: float) -> dict[Placed, str]:
    """Return the surface of each body that can meet the plane."""
    meeting = {}
    for body in bodies:
        lowest = float((body.points @ direction).max())
        facing = [
            face for face in body.solid.flats
            if (body.axes.turn @ face.normal) @ direction > FACING
            and abs(face.height + direction @ body.axes.origin - lowest) < SUPPORTS * extent
        ]  # fmt: skip
        if facing and lowest > height - NEAR * extent:
            meeting[body] = max(facing, key=lambda face: face.area).surface
    return meeting


def _body_lines(body: Placed, velocity: np.ndarray) -> list[str]:
    lines = [] if body.name == body.solid.name else [f'component = "{body.solid.name}"']
    if np.abs(body.axes.origin).max() > 0:
        lines.append(f"position = {_list(body.axes.origin)}")
    if np.abs(body.axes.turn - np.eye(3)).max() > 1e-12:
        lines.append(f"orientation = {_list(quaternion(body.axes.turn))}")
    return [*lines, f"velocity = {_list(velocity)}  # [m/s]"]


def quaternion(turn: np.ndarray) -> np.ndarray:
    """Return the unit quaternion w, x, y, z of a rotation, (4,)."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(turn).as_quat(canonical=True)
    return np.array([w, x, y, z])


def _interface_name(surface: str) -> str:
    """Return a name of an interface that TOML needs no quotes for."""
    return toml_name(surface)


def text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def _list(vector: np.ndarray) -> str:
    return "[{}]".format(", ".join(f"{0.0 if abs(value) < 1e-12 else value:.12g}" for value in vector))
