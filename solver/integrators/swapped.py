"""A run that changes the basis of a body as a force passes over it: runs of one basis after the other.

The basis changes at the begin of the sample in which the force passes a border, so that a frame has the same basis at
any step. What the new basis lacks of the motion shows in the energy, whose jump is an error of the run's balance.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.outcome import ENERGY_ERROR, EXCHANGED, START_ENERGY, Marching, Outcome, Samples
from gudgeon.solver.result import Result
from gudgeon.solver.system.bases.swaps import Basis, Swaps
from gudgeon.solver.system.system import System

LARGEST_JUMP = 1e-4
"""Of the energy at a change of the basis, over that of deformation before."""
LOST = 3
"""First column of the energies that add up over a run: energy dissipated, then work."""


class Swapped:
    """A run of all bases, in the coordinates of all of them."""

    failure: Result
    reason: str

    def __init__(self, swaps: Swaps, dt: float, start: Callable[[System], Marching]) -> None:
        """Start at time zero.

        Args:
            dt: Step [s].
            start: Returns the run of a system.
        """
        self._swaps, self._dt, self._begin = swaps, dt, start
        self._number, self._bases = int(swaps.numbers(np.zeros(1))[0]), dict[int, Basis]()
        self._run = start(self._basis.system)
        self._energies = np.zeros(5)
        self._energies[0] = self._run.outcome().extreme[START_ENERGY]
        self._spent, self._error, self._exchanged, self._jumps = np.zeros(2), 0.0, 0.0, list[float]()
        self._pulled = np.zeros(len(swaps.whole.springs.stiffness))

    @property
    def _basis(self) -> Basis:
        """The present basis; each is compiled once."""
        if self._number not in self._bases:
            self._bases[self._number] = self._swaps.basis(self._number)
        return self._bases[self._number]

    def advance(self, start_step: int, stride: int, out: Samples) -> bool:
        """Advance samples, each by the basis for the place of the force at its end."""
        ends = start_step + stride * np.arange(1, len(out.forces) + 1)
        numbers = self._swaps.numbers(self._dt * ends)
        borders = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(numbers)]
        return all(
            self._advance(int(numbers[start]), start_step + start * stride, stride, out.part(slice(start, end)))
            for start, end in pairwise(borders)
        )

    def _advance(self, basis_number: int, start_step: int, stride: int, out: Samples) -> bool:
        """Advance samples by a basis."""
        if basis_number != self._number:
            self._change(basis_number, self._dt * start_step)
        paths = out.paths._replace(elastic=self._basis.system.elastic_spans)
        sound = self._run.advance(start_step, stride, out._replace(paths=paths))
        self.failure, self.reason = self._run.failure, self._run.reason
        out.energies[:, LOST:] += self._spent
        self._energies = out.energies[-1].copy()
        return sound

    def _change(self, basis_number: int, time: float) -> None:
        """Go on with another basis from a time [s].

        Raises:
            SceneError: energy jumps by more than `LARGEST_JUMP`.
        """
        end, old = self._run.outcome(), self._basis
        self._number = basis_number
        q, v = self._swaps.carried(old, self._basis, np.stack([end.q, end.v]))
        run = self._begin(_started(self._basis.system, q, v, time))
        before = float(self._energies[:LOST].sum())
        jump = abs(float(run.outcome().extreme[START_ENERGY]) - before)
        rigid = end.v[old.system.rigid]
        deformed = before - 0.5 * float(rigid @ rigid)
        relative_jump = jump / deformed if deformed > 0 else 0.0
        if relative_jump > LARGEST_JUMP:
            self._refuse(relative_jump, time)
        self._jumps.append(relative_jump)
        self._error += float(end.extreme[ENERGY_ERROR]) + jump
        self._exchanged = max(self._exchanged, float(end.extreme[EXCHANGED]))
        self._pulled = self._pulled + end.springs if len(end.springs) else self._pulled
        self._spent, self._run = self._energies[LOST:], run

    def _refuse(self, relative_jump: float, time: float) -> None:
        """Raise the SceneError of a change of the basis that the energy does not survive."""
        swaps, along = self._swaps, self._swaps.force.places(np.array([time]))[0, 1]
        component = swaps.whole.scene.component_of(swaps.body)
        raise SceneError(
            f"component.{component}.modes.swap: where force.{swaps.name} passes {along:.4g} m along, at {time:.4g} s,"
            f" the next basis changes the energy of deformation by {relative_jump:.2g} of it, allowed:"
            f" {LARGEST_JUMP:g}; raise component.{component}.modes.normal_count, modes.swap.vectors or run.samples"
        )

    def state(self) -> None:
        """Return None: its marches are repeated from their start where they were stopped."""

    def resume(self, stored: Mapping[str, np.ndarray]) -> None:
        """Not called, since there is no state."""

    def impacts(self) -> list[np.ndarray]:
        return self._run.impacts()

    def outcome(self) -> Outcome:
        end, size = self._run.outcome(), len(self._swaps.whole.velocity)
        q, v, extreme = np.zeros(size), np.zeros(size), end.extreme.copy()
        q[self._basis.columns], v[self._basis.columns] = end.q, end.v
        extreme[ENERGY_ERROR] += self._error
        extreme[EXCHANGED] = max(self._exchanged, extreme[EXCHANGED])
        springs = self._pulled + end.springs if len(end.springs) else end.springs
        return replace(end, q=q, v=v, extreme=extreme, springs=springs, jumps={self._swaps.name: self._jumps})


def _started(system: System, q: np.ndarray, v: np.ndarray, time: float) -> System:
    """Return a system that starts in a state at a time [s] of the run."""
    loads, springs = system.driving.loads(np.array([time]), 0.0)[0], system.springs
    elongation = springs.stretch + springs.rows @ q + springs.to_loads @ loads
    pulls = -springs.tension(elongation)[0] - springs.damping * (springs.rows @ v)
    return replace(system, position=q, velocity=v, loads=loads, start_pulls=pulls)
