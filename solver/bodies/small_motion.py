"""A flexible body of the solver: rigid twists, frequencies and rows from its modal record."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np

from gudgeon.modaldb.records.modes import InterfaceModes, ModalRecord, MorphRecord
from gudgeon.modaldb.records.tangents import tangents
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.body import ALL_FREE, Body
from gudgeon.solver.scene.damping import Damping

MOVES = 1e-9
"""Relative size below which a component of a rigid motion, a translation or a rotation, is round-off."""
ROUND_OFF = 16 * float(np.finfo(float).eps)
"""Share of its terms below which the motion of a point along a direction is round-off."""

T = TypeVar("T")


@dataclass(frozen=True)
class FlexibleBody:
    """One body's part of the generalised coordinates: r rigid ones, then m elastic ones."""

    name: str
    morph_key: str
    morph: MorphRecord
    modal: ModalRecord
    twists: np.ndarray
    """Mass-normalised rigid motions that the scene leaves free: translation, rotation about the centre, (r, 6)."""
    damping: Damping | None
    first: int
    """Its first coordinate in the system."""
    pressed: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Unit vectors along which interfaces have their rows, (c, 3, 3), where not along normals, see `slanting`."""
    basis: np.ndarray | None = None
    """Coordinates of its records, rigid and elastic ones, per coordinate of a body that joints hold, (n, m), see
    `holding`; None: they are its own."""

    damped_as_held: bool = False
    """Whether dashpots of the system damp it, see `system.held_damping`, and not its coordinates."""

    @property
    def record_count(self) -> int:
        """Number of coordinates of its records, rigid and elastic ones."""
        return len(self.stiffness if self.basis is None else self.basis)

    @property
    def rigid_count(self) -> int:
        """Number of rigid coordinates, r."""
        return len(self.twists)

    @property
    def rigid(self) -> slice:
        """Its rigid coordinates in the system."""
        return slice(self.first, self.first + len(self.twists))

    @property
    def coordinates(self) -> slice:
        """All its coordinates in the system."""
        return slice(self.first, self.elastic.stop)

    @property
    def elastic(self) -> slice:
        """Its elastic coordinates in the system."""
        return slice(self.rigid.stop, self.first + len(self.stiffness))

    @property
    def stiffness(self) -> np.ndarray:
        """ω² of its coordinates [rad²/s²], zero for rigid ones, (r + m,)."""
        return np.concatenate([np.zeros(self.rigid_count), self.modal.angular_frequencies**2])

    @cached_property
    def gyration(self) -> float:
        """Largest radius of gyration about the centre of mass [m]."""
        return float(np.sqrt(np.linalg.eigvalsh(self.morph.inertia)[-1] / self.morph.mass))

    @property
    def damping_rates(self) -> np.ndarray:
        """c of its coordinates [1/s], zero for rigid ones, (r + m,); a SceneError as `Damping.rates`."""
        omega = self.modal.angular_frequencies
        damping = None if self.damped_as_held else self.damping
        elastic = np.zeros(len(omega)) if damping is None else damping.rates(omega, self.name)
        return np.concatenate([np.zeros(self.rigid_count), elastic])

    @property
    def stiffness_factor(self) -> float:
        """β of its residual flexibility [s]; a SceneError as `Damping.rates`."""
        return 0.0 if self.damping is None else self.damping.stiffness_factor(self.modal.angular_frequencies, self.name)

    def rigid_rows(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the displacement of points (c, 3) along directions (c, 3) per rigid coordinate, (c, r).

        Zero where it is round-off of its terms: a body that is held across has no motion there, not one of 1e-16.
        """
        arm = points - self.morph.centre
        sizes, radii = np.linalg.norm(directions, axis=1), np.linalg.norm(arm, axis=1)
        rows = np.empty((len(points), self.rigid_count))
        for r, twist in enumerate(self.twists):
            rows[:, r] = np.einsum("ci,ci->c", directions, twist[:3] + np.cross(twist[3:], arm))
            terms = sizes * (np.linalg.norm(twist[:3]) + np.linalg.norm(twist[3:]) * radii)
            rows[np.abs(rows[:, r]) < ROUND_OFF * terms, r] = 0.0
        return rows

    def wrench_rows(self, resultant: np.ndarray) -> np.ndarray:
        """Return the displacement conjugate to k loads per rigid coordinate, (k, r).

        Args:
            resultant: Force and moment of each load about the component's origin, (k, 6).
        """
        at_origin = self.twists.copy()
        at_origin[:, :3] -= np.cross(self.twists[:, 3:], self.morph.centre)
        return resultant @ at_origin.T

    def rigid_velocity(self, velocity: np.ndarray, angular_velocity: np.ndarray) -> np.ndarray:
        """Return the rigid coordinates' velocities Φ_rᵀ M ẋ, (r,), of a velocity and angular velocity at the centre."""
        momentum = np.concatenate([self.morph.mass * velocity, self.morph.inertia @ angular_velocity])
        return self.twists @ momentum

    def centre_motion(self, rates: np.ndarray) -> np.ndarray:
        """Return velocity and angular velocity at the centre (..., 6) of rigid coordinate rates (..., r)."""
        return rates @ self.twists

    def residual(self, row_name: str, column_name: str) -> np.ndarray:
        """Return R between the rows of two interfaces, loads or traction spaces; zero where the record has no R."""
        row_span, column_span = (slice(*self.modal.interface_rows[name]) for name in (row_name, column_name))
        if self.modal.residual_flexibility is None:
            return np.zeros((row_span.stop - row_span.start, column_span.stop - column_span.start))
        return self.modal.residual_flexibility[row_span, column_span]

    def contact_frame(self, interface: str) -> np.ndarray:
        """Return the directions of the rows of each contact point, right-handed unit vectors, (c, 3, 3).

        The first is the outward normal, or against the direction of the obstacle that presses at a slant.

        Raises:
            SceneError: see `contact_rows`.
        """
        if interface in self.pressed:
            return self.pressed[interface]
        modes = self._with_tangents(interface)
        along = tangents(modes.normals) if modes.tangents is None else modes.tangents
        return np.concatenate([modes.normals[:, None], along], axis=1)

    def outward(self, interface: str) -> np.ndarray:
        """Return the unit vectors along which contact points have their normal rows, (c, 3)."""
        return self.pressed[interface][:, 0] if interface in self.pressed else self.modal.interfaces[interface].normals

    def contact_rows(self, interface: str) -> np.ndarray:
        """Return the displacement along outward normal, t1, t2 of points per elastic coordinate [kg^-½], (c, 3, m).

        Raises:
            SceneError: the body is elastic and its modes have no tangential rows for the interface.
        """
        modes = self._with_tangents(interface)
        if modes.tangential_rows is None:
            return np.zeros((len(modes.normals), 3, 0))
        return np.concatenate([modes.rows[:, None], modes.tangential_rows], axis=1)

    def contact_residual(self, row_name: str, column_name: str) -> np.ndarray:
        """Return R between the contact points of two interfaces [m/N], (3 c, 3 k); zero where the record has no R.

        Rows and columns are along outward normal, t1, t2 of the first point, then of the second, and so on.

        Raises:
            SceneError: see `contact_rows`.
        """
        row_numbers, column_numbers = (self.contact_places(name) for name in (row_name, column_name))
        if self.modal.residual_flexibility is None:
            return np.zeros((len(row_numbers), len(column_numbers)))
        return self.modal.residual_flexibility[np.ix_(row_numbers, column_numbers)]

    def contact_places(self, interface: str) -> np.ndarray:
        """Return the rows of R along normal, t1, t2 of each contact point, (3 c,)."""
        modes = self._with_tangents(interface)
        if modes.tangential_rows is None:
            return np.zeros(3 * len(modes.normals), int)
        normal = np.arange(*self.modal.interface_rows[interface])
        across = np.arange(*self.modal.tangential_spans[interface]).reshape(-1, 2)
        return np.column_stack([normal, across]).ravel()

    def _with_tangents(self, interface: str) -> InterfaceModes:
        """Return an interface that has tangential rows if the body is elastic."""
        modes = self.modal.interfaces[interface]
        if self.modal.reduction != "rigid" and modes.tangential_rows is None:
            raise SceneError(
                f"body.{self.name}: friction acts on interface '{interface}', for which the record of its modes,"
                f" {self.morph.modes_key[:12]}, has no tangential rows, since it was made for a"
                " scene without friction; `gudgeon modes SCENE` makes them"
            )
        return modes


def named(members: Mapping[str, T], name: str, owner: str) -> T:
    """Return a member of a record by its name.

    Raises:
        SceneError: there is no such member; its message begins with `owner`, "key: body 'b' has no".
    """
    if name not in members:
        raise SceneError(f"{owner} '{name}', it has {', '.join(sorted(members)) or 'none'}")
    return members[name]


def free_twists(morph: MorphRecord, settings: Body, name: str) -> np.ndarray:
    """Return the rigid motions that supports and `freedom` leave free, mass-normalised, (r, 6)."""
    if tuple(settings.freedom) == ALL_FREE or len(morph.rigid_twists) == 0:
        return morph.rigid_twists
    if len(morph.rigid_twists) < 6:
        constrained = [i for i, motion in enumerate(ALL_FREE) if motion not in settings.freedom]
        scaled = morph.rigid_twists.copy()
        for columns in (slice(3), slice(3, 6)):  # Translations and rotations have different units.
            scaled[:, columns] /= np.linalg.norm(scaled[:, columns]) or 1.0
        _, values, right = np.linalg.svd(scaled[:, constrained].T)
        free = right[int((values > MOVES).sum()) :]
        if not len(free) and settings.freedom:
            raise SceneError(
                f"body.{name}.freedom: {list(settings.freedom)} given, but the supports of its component forbid it"
            )
        return free @ morph.rigid_twists
    chosen = np.eye(6)[[ALL_FREE.index(motion) for motion in settings.freedom]].reshape(-1, 6)
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = morph.mass * np.eye(3), morph.inertia
    # Not by eigenvectors: for a small part they mix masses with much smaller moments of inertia.
    return np.linalg.solve(np.linalg.cholesky(chosen @ mass @ chosen.T), chosen)
