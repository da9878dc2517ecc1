"""Coordinates in which free motion is uncoupled, springs included."""

from dataclasses import dataclass

import numpy as np

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.event import basis
from gudgeon.solver.integrators.event.regimes import Equations, all_open
from gudgeon.solver.system.system import System

SLOWEST = 1e-6
"""Least approach speed of a contact, relative to the largest so far, in the loss of its law."""


@dataclass(frozen=True)
class Coordinates:
    """p = modes y with ÿ + ω² y = constant + rowsᵀ λ. Shapes: n coordinates, c contacts."""

    solved: basis.Basis
    modes: np.ndarray
    """(n, n), orthonormal."""
    omega: np.ndarray
    """[rad/s], (n,)."""
    constant: np.ndarray
    """(n,)"""
    rows: np.ndarray
    """∂g/∂y, (c, n)."""
    start: np.ndarray
    speed: np.ndarray
    """y and ẏ at the start of the run, (n,)."""
    contact_energy: float
    """In contacts at the start [J]."""

    @property
    def energy(self) -> float:
        """E₀, kinetic, strain and contact energy at the start [J]."""
        bent = self.omega * self.start
        return 0.5 * float(self.speed @ self.speed) + 0.5 * float(bent @ bent) + self.contact_energy


def uncoupled(system: System) -> Coordinates:
    """Return the coordinates of a system without contact.

    Raises:
        SceneError: its contact points couple through R.
    """
    if system.coupled:
        raise SceneError(
            f"run.integrator: '{system.scene.integrator}' needs contact points that are not coupled through R; use"
            " contacts of one point, or method 'penalty'"
        )
    linear = Equations(system).regime(all_open(system), np.zeros(len(system.velocity))).linear
    solved = basis.solve(linear)
    modes = np.column_stack([solved.drift, np.real(solved.shapes)])
    omega = np.concatenate([np.zeros(solved.drift.shape[1]), np.imag(solved.exponents)])
    constant = modes.T @ (linear.force - linear.rows.T @ (linear.springs @ linear.offsets))
    rows = np.ascontiguousarray(system.rows @ modes)
    return Coordinates(
        solved=solved, modes=modes, omega=omega, constant=constant, rows=rows, start=modes.T @ system.position,
        speed=modes.T @ system.velocity, contact_energy=system.start_contact_energy,
    )  # fmt: skip
