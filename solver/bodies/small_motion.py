"""A flexible body as the solver sees it: rigid twists, frequencies, contact rows. Nothing else is read."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.modes import LoadModes, ModalRecord, MorphRecord
from gudgeon.modaldb.stores.folder import Store
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.body import ALL_FREE, Body

MOVES = 1e-9
"""Share of a body's ways, or of its turns, below which a rigid motion does not move along an axis."""


@dataclass(frozen=True)
class FlexibleBody:
    """One body's share of the generalised coordinates: its rigid ones, then its elastic ones."""

    name: str
    morph_key: str
    morph: MorphRecord
    modal: ModalRecord
    twists: np.ndarray
    """Mass-normalised rigid motions that the scene leaves free: translation, rotation about the centre, (r, 6)."""
    stiffness_factor: float
    """β of its damping [s]."""

    @property
    def rigid_count(self) -> int:
        """Number of rigid coordinates, r."""
        return len(self.twists)

    @property
    def stiffness(self) -> np.ndarray:
        """ω² of all coordinates [rad²/s²], zero for rigid ones, (r + m,)."""
        return np.concatenate([np.zeros(self.rigid_count), self.modal.angular_frequencies**2])

    def rigid_rows(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the displacement of points (c, 3) along directions (c, 3) per rigid coordinate, (c, r)."""
        arm = points - self.morph.centre
        rows = np.empty((len(points), self.rigid_count))
        for r, twist in enumerate(self.twists):
            rows[:, r] = np.einsum("ci,ci->c", directions, twist[:3] + np.cross(twist[3:], arm))
        return rows

    def wrench_rows(self, resultant: np.ndarray) -> np.ndarray:
        """Return the displacement conjugate to loads per rigid coordinate, (k, r).

        Args:
            resultant: Force and moment about the component's origin of each load, (k, 6).
        """
        at_origin = self.twists.copy()
        at_origin[:, :3] -= np.cross(self.twists[:, 3:], self.morph.centre)
        return resultant @ at_origin.T

    def rigid_velocity(self, velocity: np.ndarray, angular_velocity: np.ndarray) -> np.ndarray:
        """Return the rigid coordinates' velocities (r,) of a motion given at the centre: Φ_rᵀ M ẋ."""
        momentum = np.concatenate([self.morph.mass * velocity, self.morph.inertia @ angular_velocity])
        return self.twists @ momentum

    def centre_motion(self, rates: np.ndarray) -> np.ndarray:
        """Return velocity and angular velocity at the centre (..., 6) of rigid coordinate rates (..., r)."""
        return rates @ self.twists

    def load(self, interface: str, where: str) -> LoadModes:
        """Return a load's rows.

        Args:
            where: The key that asks for it, for the message.

        Raises:
            SceneError: the record has none of that name.
        """
        if interface not in self.modal.loads:
            have = ", ".join(sorted(self.modal.loads)) or "none"
            raise SceneError(f"{where}: body '{self.name}' has no load or joint surface '{interface}', it has {have}")
        return self.modal.loads[interface]

    def residual(self, one: str, other: str) -> np.ndarray:
        """Return R between the rows of two interfaces, loads or traction spaces; zero where the record holds none."""
        here, there = (slice(*self.modal.interface_rows[name]) for name in (one, other))
        if self.modal.residual_flexibility is None:
            return np.zeros((here.stop - here.start, there.stop - there.start))
        return self.modal.residual_flexibility[here, there]


def load_body(
    store: Store, name: str, settings: Body, morph_key: str, morph: MorphRecord, modal_fields: Iterable[str]
) -> FlexibleBody:
    """Read from the database just the named fields of the modes of a body's design."""
    modal = store.get(morph.modes_key, "modes", only=list(modal_fields))
    beta = settings.damping.stiffness_factor if settings.damping else 0.0
    return FlexibleBody(name, morph_key, morph, modal, free_twists(morph, settings, name), beta)


def free_twists(morph: MorphRecord, settings: Body, name: str) -> np.ndarray:
    """Return the rigid motions that are left, mass-normalised among themselves."""
    if tuple(settings.freedom) == ALL_FREE or len(morph.rigid_twists) == 0:
        return morph.rigid_twists
    if len(morph.rigid_twists) < 6:
        held = [number for number, one in enumerate(ALL_FREE) if one not in settings.freedom]
        scaled = morph.rigid_twists.copy()
        for part in (slice(3), slice(3, 6)):  # Ways and turns have units of their own.
            scaled[:, part] /= np.linalg.norm(scaled[:, part]) or 1.0
        _, values, right = np.linalg.svd(scaled[:, held].T)
        left = right[int((values > MOVES).sum()) :]
        if not len(left) and settings.freedom:
            raise SceneError(f"body.{name}.freedom: {list(settings.freedom)} given, its component cannot move so alone")
        return left @ morph.rigid_twists
    chosen = np.eye(6)[[ALL_FREE.index(one) for one in settings.freedom]].reshape(-1, 6)
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = morph.mass * np.eye(3), morph.inertia
    # Not by eigenvectors: those of a small part mix masses with moments of inertia that are nothing beside them.
    return np.linalg.solve(np.linalg.cholesky(chosen @ mass @ chosen.T), chosen)
