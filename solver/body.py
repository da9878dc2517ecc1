"""A flexible body as the solver sees it: rigid twists, frequencies, contact rows. Nothing else is read."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from modaldb.schema import ModalRecord, MorphRecord
from modaldb.store import Store


@dataclass(frozen=True)
class FlexibleBody:
    """One body's share of the generalised coordinates: its rigid ones, then its elastic ones."""

    name: str
    morph_key: str
    morph: MorphRecord
    modal: ModalRecord

    @property
    def rigid_count(self) -> int:
        """Number of rigid coordinates, r."""
        return len(self.morph.rigid_twists)

    @property
    def stiffness(self) -> np.ndarray:
        """ω² of all coordinates [rad²/s²], zero for rigid ones, (r + m,)."""
        return np.concatenate([np.zeros(self.rigid_count), self.modal.angular_frequencies**2])

    def rigid_rows(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the displacement of points (c, 3) along directions (c, 3) per rigid coordinate, (c, r)."""
        arm = points - self.morph.centre
        rows = np.empty((len(points), self.rigid_count))
        for r, twist in enumerate(self.morph.rigid_twists):
            rows[:, r] = np.einsum("ci,ci->c", directions, twist[:3] + np.cross(twist[3:], arm))
        return rows

    def rigid_velocity(self, velocity: np.ndarray, angular_velocity: np.ndarray) -> np.ndarray:
        """Return the rigid coordinates' velocities (r,) of a motion given at the centre: Φ_rᵀ M ẋ."""
        momentum = np.concatenate([self.morph.mass * velocity, self.morph.inertia @ angular_velocity])
        return self.morph.rigid_twists @ momentum

    def centre_motion(self, rates: np.ndarray) -> np.ndarray:
        """Return velocity and angular velocity at the centre (6,) of rigid coordinate rates (r,)."""
        return rates @ self.morph.rigid_twists

    def residual_block(self, interface: str) -> np.ndarray:
        """Return R [m/N] of one interface's rows, (c, c)."""
        rows = slice(*self.modal.interface_rows[interface])
        assert self.modal.residual_flexibility is not None
        return self.modal.residual_flexibility[rows, rows]


def load_body(
    store: Store, name: str, morph_key: str, morph_fields: Iterable[str], modal_fields: Iterable[str]
) -> FlexibleBody:
    """Read from the database just the named fields of a body."""
    morph = store.get(morph_key, "morph", only=list(morph_fields))
    modal = store.get(morph.modes_key, "modes", only=list(modal_fields))
    return FlexibleBody(name, morph_key, morph, modal)
