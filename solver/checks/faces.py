"""Where the one row of a patch does not stand for its face: a face that turns has its edge below what it meets.

The row is the mean displacement of a face. With d the depth of its centroid in what it meets and e that by which its
deepest corner lies below both, the pressure is that of the row while e is small against the indentation of the contact:
at e = d a face on a layer parts at its other edge. The indentation is the largest d so far, or √(d² + δ²) with what an
approach at the speed v adds,

    m v² / 2 = δ² / (2 c)   over a compliance c,   m v² / 2 = K δⁿ⁺¹ / (n + 1)   of a law.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.integrators.outcome import Samples
from gudgeon.solver.obstacles import Plane, basic_surface
from gudgeon.solver.scene.contact import MasterSurface
from gudgeon.solver.system.system import System
from gudgeon.solver.vectors import unit

Changed = Callable[[np.ndarray], np.ndarray]
FLAT = 1e-5
"""Depth of a corner over the size of its face up to which it is flat: faces of given positions have few digits."""
NOTED = 0.1
"""Depth of a corner over the indentation from which on a note says so."""
ALIKE = 1e-6
"""Largest difference of the normals of points of one plane."""


class Face(NamedTuple):
    """The face of a patch and the plane before it. h: corners; a body of −1 is the ground."""

    name: str
    """Of the contact."""
    interface: str
    component: str
    sides: tuple[int, int]
    """Numbers of the face's body and of the plane's."""
    corners: np.ndarray
    """Corners of the face and, the last, its centroid, as the scene places its body [m], (h + 1, 3)."""
    point: np.ndarray
    """Of the plane as placed [m], (3,)."""
    normal: np.ndarray
    """Out of the plane's body, (3,)."""
    row: np.ndarray
    """Gap per rigid coordinate of the system, (r,)."""
    compliance: float
    """c [m/N], 0 of a law."""
    law: tuple[float, float]
    """K and n, zero without one."""
    size: float
    """Of the face [m]."""

    def indentation(self, rates: np.ndarray) -> np.ndarray:
        """Return the indentations [m], (s,), that approaches at these rates of the rigid coordinates, (s, r), have."""
        inverse_mass = float(self.row @ self.row)
        if not inverse_mass > 0:
            return np.zeros(len(rates))
        energy, (K, n) = (rates @ self.row) ** 2 / inverse_mass / 2, self.law
        if K > 0:
            return np.asarray((energy * (n + 1) / K) ** (1 / (n + 1)))
        return np.sqrt(2 * energy * self.compliance)


class Turned(NamedTuple):
    """When a patch no longer stood for its face [s], and what is said of it."""

    time: float
    sentence: str


class Faces:
    """The patches of a system, tested frame by frame."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._faces = list(_faces(system))
        self._deepest = dict.fromkeys((face.name for face in self._faces), 0.0)
        self._ended = False
        self._tilted = dict.fromkeys(self._deepest, 0.0)

    def test(self, times: np.ndarray, samples: Samples) -> Iterator[Turned]:
        """Yield where patches first do not stand for their faces.

        Args:
            times: Ends of the samples of a frame [s], (s,).
            samples: Its samples.
        """
        r = len(self._system.rigid)
        motions = self._motions(samples.snapshots[:, :r]) if self._faces else []
        for face in self._faces:
            gaps = self._gaps(face, motions)
            depth = np.maximum(-gaps[:, -1], 0.0)
            excess = np.maximum(-gaps[:, :-1].min(axis=1), 0.0) - depth
            deepest = np.maximum.accumulate(np.append(self._deepest[face.name], depth))[1:]
            approach = np.hypot(depth, face.indentation(samples.snapshots[:, r : 2 * r]))
            allowed = np.maximum(deepest, approach) + FLAT * face.size
            self._deepest[face.name] = float(deepest[-1])
            self._tilted[face.name] = max(self._tilted[face.name], float((excess / allowed).max()))
            if len(beyond := np.flatnonzero(excess > allowed)):
                sample = int(beyond[0])
                depths = float(excess[sample] + depth[sample]), float(depth[sample])
                self._ended = True
                yield Turned(float(times[sample]), _sentence(face, depths, float(times[sample])))

    def notes(self) -> list[str]:
        """Return a note of each patch whose corners were further below its plane than the rest by a tenth of its
        indentation."""
        return [
            f"contact.{face.name}: the face of '{face.interface}' turns, a corner of it lies deeper than its middle by"
            f" up to {self._tilted[face.name]:.0%} of the indentation, and kind 'patch' has one force for all of it;"
            f' kind = "points" has one for each point'
            for face in self._faces
            if self._tilted[face.name] > NOTED and not self._ended
        ]

    def _motions(self, positions: np.ndarray) -> list[np.ndarray]:
        """Return displacement of the centre and rotation vector of each body, (s, 6)."""
        motions, start = [], 0
        for body in self._system.bodies.values():
            motions.append(body.centre_motion(positions[:, start : start + body.rigid_count]))
            start += body.rigid_count
        return motions

    def _gaps(self, face: Face, motions: list[np.ndarray]) -> np.ndarray:
        """Return the gaps of the corners and the centroid to the plane [m], (s, h + 1)."""
        face_body, plane_body = face.sides
        points, _ = self._moved(face_body, face.corners, motions)
        origin, turned = self._moved(plane_body, face.point[None], motions)
        normal = face.normal + turned(face.normal)
        return np.asarray(np.einsum("shi,si->sh", points - origin, np.broadcast_to(normal, (len(points), 3))))

    def _moved(self, body_id: int, points: np.ndarray, motions: list[np.ndarray]) -> tuple[np.ndarray, Changed]:
        """Return points of a body as it moves [m], (s, h, 3), and by what its rotation changes a vector, (s, 3)."""
        if body_id < 0:
            return points[None], np.zeros_like
        motion, body = motions[body_id], list(self._system.bodies.values())[body_id]
        settings = self._system.scene.body[body.name]
        arms = points - (body.morph.centre + np.asarray(settings.position))
        turns = self._system.scene.capabilities.turns
        rotations = None
        if turns:
            from scipy.spatial.transform import Rotation  # Late: bodies in small motion need none, and it takes long.

            rotations = Rotation.from_rotvec(motion[:, 3:]).as_matrix() - np.eye(3)

        def changed(vectors: np.ndarray) -> np.ndarray:
            if rotations is not None:
                return np.einsum("sij,...j->s...i", rotations, vectors)
            return np.cross(motion[:, 3:].reshape(-1, *(1,) * (vectors.ndim - 1), 3), vectors)

        return points + motion[:, None, :3] + changed(arms), changed


def _faces(system: System) -> Iterator[Face]:
    """Yield the faces of patches and the planes that they meet."""
    names = list(system.bodies)
    for contact in system.contacts:
        plane = _plane(system, contact)
        if len(contact.points) > 1 or plane is None:
            continue
        body, interface = system.bodies[contact.body], contact.interface
        point, normal, plane_body = plane
        face_body, corners = names.index(contact.body), _corners(system, body, interface)
        if contact.other is not None:
            partner = system.bodies[contact.other.body]
            partner_corners = _corners(system, partner, contact.other.interface)
            if (
                np.ptp(partner_corners, axis=0).max() < np.ptp(corners, axis=0).max()
            ):  # The smaller face lies on the larger.
                point, normal = corners.mean(axis=0), body.modal.interfaces[interface].normals[0]
                face_body, plane_body = plane_body, face_body
                corners, interface = partner_corners, contact.other.interface
        if len(corners) < 2:
            continue
        row = contact.rows.start
        W, stiffness = system.rows[[row]][0], system.stiffness
        elastic = stiffness > 0
        flexible = float((W[elastic] ** 2 / stiffness[elastic]).sum())
        residual = float(system.residual.among(np.array([row]), np.array([row]))[0, 0])
        K, n = map(float, system.law[row, :2])
        yield Face(
            name=contact.name,
            interface=interface,
            component=system.scene.component_of(names[face_body]),
            sides=(face_body, plane_body),
            corners=np.vstack([corners, corners.mean(axis=0)]),
            point=point,
            normal=normal,
            row=W[system.rigid],
            compliance=0.0 if K > 0 else flexible + residual + float(system.layer[row]),
            law=(K, n),
            size=float(np.ptp(corners, axis=0).max()),
        )


def _corners(system: System, body: FlexibleBody, interface: str) -> np.ndarray:
    """Return the corners of the face of an interface as the scene places its body [m], (h, 3)."""
    modes, points = body.modal.interfaces[interface], body.morph.points[interface]
    if modes.outline is not None and len(points) == 1:
        points = modes.outline + (points[0] - modes.points[0])  # A design change moves the face.
    return points + np.asarray(system.scene.body[body.name].position)


def _plane(system: System, contact: ContactRows) -> tuple[np.ndarray, np.ndarray, int] | None:
    """Return a point [m] and the normal, (3,) each, of the plane that a contact meets, and the number of its body, −1
    of the ground; None where it meets something else."""
    against, names = system.scene.contact[contact.name].against, list(system.bodies)
    if isinstance(against, Plane):
        return (np.asarray(against.point, float), unit(against.normal), -1) if not against.edges else None
    if (partner := contact.other) is not None:
        body = system.bodies[partner.body]
        normals = body.modal.interfaces[partner.interface].normals
        if np.ptp(normals, axis=0).max(initial=0.0) > ALIKE:
            return None
        position = np.asarray(system.scene.body[partner.body].position)
        return body.morph.points[partner.interface].mean(axis=0) + position, normals[0], names.index(partner.body)
    if isinstance(against, MasterSurface) and (space := system.bodies[against.body].modal.tractions.get(
        against.interface)) is not None and space.chart["kind"] == "plane":  # fmt: skip
        plane = basic_surface(space.chart, np.asarray(system.scene.body[against.body].position))
        assert isinstance(plane, Plane)
        return np.asarray(plane.point, float), unit(plane.normal), names.index(against.body)
    return None


def _sentence(face: Face, depths: tuple[float, float], time: float) -> str:
    corner, middle = depths
    return (
        f"contact.{face.name}: a corner of the face of '{face.interface}' is {corner:.3g} m below what it meets at"
        f" {time:.6g} s, and its middle {middle:.3g} m: kind 'patch' has one force for the mean of the face, which"
        f' does not hold one that turns; set component.{face.component}.interface.{face.interface}.kind to "points"'
    )
