"""Input of a drawing function: the records of one trajectory, read on access, and the output folder."""

import contextlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.modaldb.records.trajectory import ContactHistory, JointHistory, Trajectory
from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.geometry.cells import Cell, cell_of
from gudgeon.pipeline.plots.base.hardest import Hardest, hardest, with_peaks
from gudgeon.pipeline.reduction.expansion import displacement
from gudgeon.solver.bodies.placing import rotation, turned_design, turned_mesh, turned_modes
from gudgeon.solver.bodies.small_motion import free_twists
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.scene.body import Body


class Press(NamedTuple):
    """A contact as it presses on one of its bodies."""

    interface: str
    """Of the body."""
    points: np.ndarray
    """In the body's design position [m], (c, 3)."""
    outward: np.ndarray
    """Unit normals out of the body; forces act against them, (c, 3)."""
    multipliers: np.ndarray
    """[N], (f, c)"""


class Curve(NamedTuple):
    """A force over time."""

    label: str
    times: np.ndarray
    """[s], (t,)"""
    force: np.ndarray
    """Its size [N], (t,)."""


@dataclass(frozen=True)
class BodyMotion:
    """One body of a trajectory."""

    name: str
    mesh: MeshRecord
    modal: ModalRecord
    morph: MorphRecord
    """Its rigid twists are those that the scene leaves free."""
    nodes: np.ndarray
    """Nodal positions of the design [m], (n, 3)."""
    coordinates: np.ndarray
    """Rigid, then elastic coordinates at each frame, (f, r + m)."""
    held: bool = False
    """Whether joints hold it on the ground in small motion: all of its displacement is deformation."""

    @property
    def size(self) -> float:
        """Diagonal of the box around its nodes [m]."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    def on(self, points: np.ndarray, shapes: np.ndarray) -> "BodyMotion":
        """Return the same motion of other points (p, 3), with the values of the shapes there (p, 3 m)."""
        modal = replace(self.modal, shapes=shapes.reshape(len(points), 3, -1))
        return replace(self, modal=modal, nodes=points)

    def surface(self, interface: str) -> Surface | None:
        """Return the named surface with all nodes of an interface of points, the one with the fewest facets.

        None where the surface is a set of nodes without facets.
        """
        if interface not in self.modal.interfaces:
            return None
        nodes = self.modal.interfaces[interface].nodes
        surfaces = [s for s in self.mesh.surfaces.values() if s.areas is None and np.isin(nodes, s.facets).all()]
        return min(surfaces, key=lambda surface: len(surface.facets), default=None)

    def elastic(self, frame: int) -> np.ndarray:
        """Return the displacement without its rigid part [m], (n, 3); of a body that joints hold, all of it."""
        if self.held:
            return self.total(frame)
        coordinates = self.coordinates[frame].copy()
        coordinates[: len(self.morph.rigid_twists)] = 0.0
        return displacement(self.nodes, self.morph, self.modal, coordinates)

    def twist(self, frame: int) -> np.ndarray:
        """Return translation and rotation of the centre of mass [m, rad], (6,); none of a body that joints hold."""
        if self.held:
            return np.zeros(6)
        return self.coordinates[frame, : len(self.morph.rigid_twists)] @ self.morph.rigid_twists

    def rigid(self, frame: int) -> np.ndarray:
        """Return the displacement without its elastic part [m], (n, 3)."""
        twist = self.twist(frame)
        return twist[:3] + np.cross(twist[3:], self.nodes - self.morph.centre)

    def total(self, frame: int) -> np.ndarray:
        """Return the whole displacement from the initial position [m], (n, 3)."""
        return displacement(self.nodes, self.morph, self.modal, self.coordinates[frame])


@dataclass(frozen=True)
class Drawing:
    """A trajectory to draw; of a wheel, `key` is that of its response and there is no trajectory."""

    store: Store
    key: str
    scene_name: str
    out: Path
    scratch: Path
    tell: Callable[[str], None]
    """Receives the name of each complete file."""
    compare: Mapping[str, str] = field(default_factory=dict)
    """Keys of other runs of the same scene, by their labels."""
    reference: Mapping[str, Any] | None = None
    """As `render` takes it."""

    def reference_force(self, contact: str) -> Curve | None:
        """Return the reference of the force of a contact, of full FE at the middles of steps; None if there is none."""
        if self.reference is None:
            return None
        label = self.reference["label"]
        if "key" not in self.reference:
            return Curve(label, np.array(self.reference["times"]), np.array(self.reference["force"]))
        record = self.store.get(self.reference["key"], "nodal", only=["times", "force", "forces"])
        force = record.forces.get(contact, record.force if len(self.trajectory.contacts) == 1 else None)
        middles = record.times - 0.5 * np.diff(record.times, prepend=0.0)
        return None if force is None else Curve(label, middles, np.linalg.norm(force, axis=1))

    @cached_property
    def trajectory(self) -> Trajectory:
        """The whole trajectory, with the states at the largest forces among its frames."""
        return with_peaks(self.store.get(self.key, "trajectory"))

    @cached_property
    def scene(self) -> dict[str, Any]:
        """The solver's part of the scene as JSON; empty if the record has none."""
        return self.store.provenance(self.key).get("scene", {})

    def body(self, name: str) -> BodyMotion:
        """Return one body's records without the residual flexibility, which may be huge."""
        morph, Q = self.design(name), self.rotation(name)
        if (settings := self.scene.get("body", {}).get(name)) is not None:
            morph = replace(morph, rigid_twists=free_twists(morph, Body.model_validate(settings), name))
        mesh = turned_mesh(self.store.get(morph.mesh_key, "mesh"), Q)
        modal = self.modes(name, ["shapes", "angular_frequencies", "interfaces"])
        start = self.trajectory.coordinate_offsets[name]
        stop = start + len(morph.rigid_twists) + len(modal.angular_frequencies)
        nodes = mesh.nodes if morph.nodes is None else morph.nodes
        coordinates = self.trajectory.frames[:, start:stop]
        return BodyMotion(name, mesh, modal, morph, nodes, coordinates, held=name in self.held)

    def design(self, body: str, only: Sequence[str] | None = None) -> MorphRecord:
        """Return a body's design, or some fields of it, turned as the scene places it."""
        return turned_design(self.store.get(self.trajectory.bodies[body], "morph", only=only), self.rotation(body))

    def modes(self, body: str, only: Sequence[str]) -> ModalRecord:
        """Return some fields of a body's modes, turned as the scene places it."""
        key = self.store.get(self.trajectory.bodies[body], "morph", only=["modes_key"]).modes_key
        return turned_modes(self.store.get(key, "modes", only=only), self.rotation(body))

    def rotation(self, body: str) -> np.ndarray | None:
        """Return the rotation matrix of a body, (3, 3); None where the scene does not turn it."""
        settings = self.scene.get("body", {}).get(body)
        return None if settings is None else rotation(Body.model_validate(settings))

    @property
    def held(self) -> set[str]:
        """The bodies that joints hold on the ground in small motion."""
        joints = self.scene.get("joint", {}).values()
        return set() if self.turning else {joint["body"] for joint in joints if joint["kind"] == "fixed"}

    @property
    def driven(self) -> bool:
        """Whether a crank drives the scene, so that the rigid motion is large and mostly prescribed."""
        return bool(self.cranks) and not self.turning

    @property
    def cranks(self) -> dict[str, JointHistory]:
        """The joints of the run that are slider-cranks."""
        kinds = {name: joint.get("kind") for name, joint in self.scene.get("joint", {}).items()}
        joints = self.trajectory.joints.items()
        return {name: joint for name, joint in joints if kinds.get(name, "slider-crank") == "slider-crank"}

    @property
    def turning(self) -> bool:
        """Whether the bodies turn by any angle."""
        name = self.trajectory.counts.get("integrator")
        return name is not None and INTEGRATORS[name].turns

    def cell(self, body: str) -> Cell:
        """Return the type of a body's cells without reading its mesh."""
        morph = self.store.get(self.trajectory.bodies[body], "morph", only=["mesh_key"])
        return cell_of(self.store.get(morph.mesh_key, "mesh", only=["cell_type"]))

    def position(self, body: str) -> np.ndarray:
        """Return the position of a body's origin in the scene [m], (3,)."""
        return np.asarray(self.scene["body"][body]["position"], float)

    def contacts_of(self, body: str) -> dict[str, ContactHistory]:
        """Return the contacts of a body."""
        return {name: item for name, item in self.trajectory.contacts.items() if item.body == body}

    def contacts_on(self, body: str) -> dict[str, ContactHistory]:
        """Return the contacts of a body and those of others against it."""
        against = {name: item["against"].get("body") for name, item in self.scene.get("contact", {}).items()}
        contacts = self.trajectory.contacts.items()
        return {name: item for name, item in contacts if body in (item.body, against.get(name))}

    def touched(self, body: str) -> bool:
        """Return whether a contact, its own or another's, acts on a body in some frame."""
        return any(contact.multipliers.any() for contact in self.contacts_on(body).values())

    def deformed(self, dimension: int) -> list[str]:
        """Return the bodies of cells of a dimension whose elastic coordinates, or on which contacts, ever act."""
        trajectory, names = self.trajectory, []
        offsets = [*trajectory.coordinate_offsets.values(), trajectory.frames.shape[1]]
        for name in trajectory.bodies:
            stop = min(offset for offset in offsets if offset > trajectory.coordinate_offsets[name])
            modes = len(self.modes(name, ["angular_frequencies"]).angular_frequencies)
            if not modes or self.cell(name).dimension != dimension:
                continue
            if trajectory.frames[:, stop - modes : stop].any() or self.touched(name):
                names.append(name)
        return names

    def shaped(self, names: Iterable[str]) -> Iterator[BodyMotion]:
        """Yield those of some bodies whose modes have shapes."""
        for body in map(self.body, names):
            if body.modal.shapes is not None and body.modal.shapes.size:
                yield body

    def deformed_count(self) -> int:
        """Return how many bodies have a picture of their deformation."""
        return sum(len(self.deformed(dimension)) for dimension in (1, 2, 3))

    def frame_force(self, body: str) -> np.ndarray:
        """Return the sum of all contact forces on a body at each frame [N], (f,)."""
        return np.sum([contact.multipliers.sum(axis=1) for contact in self.contacts_on(body).values()], axis=0)

    def hardest(self, body: str) -> Hardest | None:
        """Return the largest force of all contacts on a body; None if no frame shows one closed."""
        return hardest(self.trajectory, self.contacts_on(body))

    def shown_frame(self, body: BodyMotion) -> int:
        """Return the frame that pictures show of a body: that of its largest contact force, or without contact of its
        largest elastic displacement."""
        strongest = self.hardest(body.name)
        if strongest is not None:
            return strongest.frame
        frames = range(len(body.coordinates))
        return max(frames, key=lambda frame: float(np.linalg.norm(body.elastic(frame), axis=1).max()))

    def presses(self, body: str) -> dict[str, Press]:
        """Return the closed contacts on a body, own ones and those of other bodies."""
        presses = {}
        for name, contact in self.contacts_on(body).items():
            outward = self.modes(contact.body, ["interfaces"]).interfaces[contact.interface].normals
            points, interface = contact.points, contact.interface
            if contact.body != body:
                points, outward = points + self.position(contact.body) - self.position(body), -outward
                interface = self.scene["contact"][name]["against"]["interface"]
            presses[name] = Press(interface, points, outward, contact.multipliers)
        return presses

    @contextlib.contextmanager
    def file(self, name: str, subject: str = "", subjects: int = 1) -> Iterator[Path]:
        """Yield a scratch path, which replaces `out/name` at the end; a picture of an earlier result is removed first.

        Args:
            subject: Of the picture, written before the dot if there are several `subjects`.
        """
        if subjects > 1:
            name = "{0}-{subject}.{2}".format(*name.partition("."), subject=subject)
        with contextlib.suppress(FileNotFoundError):
            (self.out / name).unlink()
        path = self.scratch / name
        yield path
        os.replace(path, self.out / name)
        self.tell(name)
