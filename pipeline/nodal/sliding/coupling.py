"""Forces between the bodies in one step: contact points, the rod, and the drag of a deformed surface.

With N at the start and N⁺ at the end of the step, N̄ their mean, e the inward displacement of the master's functions:

    g⁺ = g₀ + G u⁺ + N⁺ e⁺,   force on the functions N̄ᵀ λ̄,   g⁺ − g = G Δu + N̄ Δe + ΔN ē

so that λ̄ᵀ ΔN ē is work that neither body receives: the slave climbs the deformed surface. The drag
d = λ̄ᵀ ΔN ē / Δσ along the sliding direction in the same step returns it, which closes the energy balance. N⁺ is that
of σ⁺ predicted with the last step's forces; d depends so little on itself that Newton's method omits its derivative.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.pipeline.nodal.body import MovingBody
from gudgeon.pipeline.nodal.problem import NodalProblem
from gudgeon.pipeline.nodal.sliding.contact import close_gaps, contact_energy
from gudgeon.pipeline.nodal.sliding.rod import prepare_rod
from gudgeon.pipeline.nodal.sliding.weights import Surfaces, Touch

FAR = 1.0
"""Gap of a point off its surface [m]."""
PREDICTED = 0.1
"""Relative difference of Δσ from its prediction above which the drag uses the prediction: Δσ passes zero there."""
NEAR = 4.0
"""Gaps below this times the largest change by contact in the last step are solved for, the others verified."""


@dataclass
class StepForces:
    """Forces in one step."""

    ports: np.ndarray
    """Force on each port of the slave: λ̄, rod lateral and along, drags [N], (p,)."""
    functions: np.ndarray
    """Force on each function of the master, inward [N], (F,)."""
    multipliers: np.ndarray
    """λ̄ [N], (c,)."""
    edge: float
    """Contact energy of points that entered a surface, less that of points that left one [J]."""
    iterations: int


def slave_ports(problem: NodalProblem) -> sparse.csr_matrix:
    """Stack G of all contacts, J of the rod and the rows of sliding."""
    contacts = problem.contacts.values()
    rows = [sparse.csr_matrix((0, problem.slave.K.shape[0])), *(contact.G for contact in contacts)]
    if problem.rod is not None:
        rows.append(sparse.csr_matrix(problem.rod.rows))
    rows += [sparse.csr_matrix(c.surface.slide[None]) for c in contacts if c.surface is not None]
    return sparse.csr_matrix(sparse.vstack(rows))


def master_ports(problem: NodalProblem) -> sparse.csr_matrix:
    """Stack the inward displacements of all surfaces' functions."""
    rows = [-contact.surface.rows for contact in problem.contacts.values() if contact.surface is not None]
    return sparse.csr_matrix(sparse.vstack(rows))


class Coupling:
    """Contacts and rod with their state at the start of a step.

    Args:
        slave: With the ports `slave_ports(problem)`.
        master: With the ports `master_ports(problem)`.
    """

    def __init__(self, problem: NodalProblem, slave: MovingBody, master: MovingBody | None) -> None:
        contacts = list(problem.contacts.values())
        self.surfaces, self.rod = Surfaces(contacts), problem.rod
        self.gap_at_rest = np.concatenate([np.zeros(0), *(contact.gap for contact in contacts)])
        self.stiffness = np.concatenate([np.zeros(0), *(contact.stiffness for contact in contacts)])
        c, rods = self.surfaces.count, 0 if problem.rod is None else 2
        self._slides = slice(c + rods, c + rods + len(self.surfaces.sliding))
        self._contact_of_slide = [self.surfaces.points[k] for k in self.surfaces.sliding]
        self._slave, self._W = slave, slave.W
        self._R = np.zeros((0, 0)) if master is None else master.W
        self._aux = np.zeros(len(self._W) - c)
        self._reach, self._places = 0.0, slave.places()
        self.inward = np.zeros(0) if master is None else master.places()
        self._sigma = self._places[self._slides]
        self._touch = self.surfaces.touch(self._sigma)
        self.gap = self._gaps(self._places, self.inward, self._touch)

    def solve(self, displacements: np.ndarray, inward: np.ndarray, pins: np.ndarray) -> StepForces:
        """Find the forces of a step.

        Args:
            displacements: Displacement of the slave's ports at its end without them [m], (p,).
            inward: That of the master's functions, (F,).
            pins: Crank pin at its start and end, (2, 4); empty without a rod.
        """
        c = self.surfaces.count
        predicted = displacements[c:] + self._W[c:, c:] @ self._aux
        sigma = predicted[self._slides.start - c :]
        touch = self.surfaces.touch(sigma) if len(sigma) else self._touch
        work = _Step(self, displacements, inward, touch, sigma)
        if self.rod is not None:
            point = slice(c, c + 2)
            rates = self._slave.rates(point)
            work.hold(*prepare_rod(self.rod, self._places[point], rates, predicted[:2], pins, self._slave.step))
        step_forces = work.run()
        self._sigma, self._touch, self._aux = sigma, touch, step_forces.ports[c:]
        return step_forces

    def finish(self, inward: np.ndarray) -> np.ndarray:
        """Take over the bodies' positions after a step; returns the change of the slave's ports [m], (p,)."""
        before, self._places, self.inward = self._places, self._slave.places(), inward
        return self._places - before

    def _gaps(self, displacements: np.ndarray, inward: np.ndarray, touch: Touch) -> np.ndarray:
        gap = self.gap_at_rest + displacements[: self.surfaces.count]
        if self.surfaces.size:
            gap += touch.N @ inward
            gap[~touch.present] = FAR
        return gap


class _Step:
    """The unknowns of one step, reduced to the multipliers of the points near contact."""

    def __init__(
        self, home: Coupling, displacements: np.ndarray, inward: np.ndarray, touch: Touch, sigma: np.ndarray
    ) -> None:
        self.home, self.places, self.inward, self.touch, self.sigma = home, displacements, inward, touch, sigma
        self.c = home.surfaces.count
        self.free = home._gaps(displacements, inward, touch)
        self.usable = touch.present & home._touch.present
        self.rod_direction: np.ndarray | None = None
        # x = rod_free − rod_per_row·λ̄ − rod_per_drag·d
        self.rod_free, self.rod_per_row, self.push = 0.0, np.zeros(self.c), np.zeros(self.c)
        self.rod_per_drag = np.zeros(len(sigma))
        self.drag = np.zeros(len(sigma))

    def hold(self, direction: np.ndarray, end: np.ndarray, error: float) -> None:
        """Add the rod, whose force follows from all others; see `prepare_rod`."""
        W, c = self.home._W, self.c
        two, slides = slice(c, c + 2), self.home._slides
        give = 2 * float(end @ W[two, two] @ direction)
        ahead = error - 2 * float(end @ (W[two, c:] @ self.home._aux))
        self.rod_direction = direction
        self.rod_free = -ahead / give
        self.rod_per_row = (2 / give) * (end @ W[two, :c])
        self.rod_per_drag = (2 / give) * (end @ W[two, slides])
        self.push = direction @ W[two, :c]
        self.free = np.where(self.touch.present, self.free + self.push * self.rod_free, FAR)

    def run(self) -> StepForces:
        """Solve for points near contact, verify all others, and collect the forces."""
        home, c = self.home, self.c
        multipliers, functions = np.zeros(c), np.zeros(home.surfaces.size)
        old, new = home.gap, self.free
        distance, iterations = NEAR * home._reach, 0
        candidates = self.usable & ((old <= distance) | (new <= distance))
        touching = bool((self.usable & ((old < 0) | (new < 0))).any())
        while touching:
            rows = np.flatnonzero(candidates)
            gaps, multipliers[rows], used = self._close(rows)
            iterations += used
            new, functions = self._respond(multipliers)
            missed = self.usable & ~candidates & (new < 0)
            new[rows] = gaps
            if not missed.any():
                home._reach = float(np.abs(new - self.free)[self.usable].max())
                break
            candidates |= missed
        crossing = self.touch.present != home._touch.present
        edge = 0.0
        if crossing.any():
            kappa = home.stiffness[crossing]
            edge = contact_energy(kappa, new[crossing]) - contact_energy(kappa, old[crossing])
        home.gap = new
        ports = np.concatenate([multipliers, self._aux_forces(multipliers)])
        return StepForces(ports, functions, multipliers, edge, iterations)

    def _aux_forces(self, multipliers: np.ndarray) -> np.ndarray:
        """Return the forces of the rod and of the drag under given multipliers."""
        if self.rod_direction is None:
            return self.drag
        force = self.rod_free - self.rod_per_row @ multipliers - self.rod_per_drag @ self.drag
        return np.concatenate([force * self.rod_direction, self.drag])

    def _close(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        """Close the gaps of the rows near contact."""
        home = self.home
        W = home._W[np.ix_(rows, rows)]
        if self.rod_direction is not None:
            W -= np.outer(self.push[rows], self.rod_per_row[rows])
        scale = float(np.abs(self.free[self.usable]).max())
        if not home.surfaces.size:
            return close_gaps(W, home.stiffness[rows], home.gap[rows], self.free[rows], scale)
        self._local(rows)
        W += (self.N_new @ self.R) @ self.N_mean.T
        to_drag = home._W[rows, home._slides] - np.outer(self.push[rows], self.rod_per_drag)

        def follow(multipliers: np.ndarray) -> np.ndarray:
            self._find_drag(rows, multipliers)
            return to_drag @ self.drag

        closed = close_gaps(W, home.stiffness[rows], home.gap[rows], self.free[rows], scale, follow)
        self._find_drag(rows, closed[1])
        return closed

    def _local(self, rows: np.ndarray) -> None:
        """Restrict N and the master's response to the functions that these rows touch."""
        N_old, N_new = self.home._touch.N[rows], self.touch.N[rows]
        used = np.unique(np.concatenate([N_old.indices, N_new.indices]))
        N_old, self.N_new = N_old[:, used].toarray(), N_new[:, used].toarray()
        self.N_mean, self.N_change = 0.5 * (N_old + self.N_new), self.N_new - N_old
        self.R = self.home._R[np.ix_(used, used)]
        self.mean_free = 0.5 * (self.home.inward[used] + self.inward[used])

    def _find_drag(self, rows: np.ndarray, multipliers: np.ndarray) -> None:
        """d = λ̄ᵀ ΔN ē / Δσ of every sliding contact."""
        home, c = self.home, self.c
        inward = self.mean_free + 0.5 * (self.R @ (self.N_mean.T @ multipliers))
        work_by_row = multipliers * (self.N_change @ inward)
        every = np.zeros(c)
        every[rows] = multipliers
        slides = home._slides
        aux = self._aux_forces(every)
        start = home._places[slides]
        true = self.places[slides] + home._W[slides, rows] @ multipliers + home._W[slides, c:] @ aux - start
        guess = self.sigma - home._sigma
        drag = np.zeros(len(guess))
        for k, points in enumerate(home._contact_of_slide):
            slide = true[k] if abs(true[k] - guess[k]) <= PREDICTED * abs(guess[k]) else guess[k]
            if slide != 0:
                start_row, stop_row = np.searchsorted(rows, [points.start, points.stop])
                drag[k] = work_by_row[start_row:stop_row].sum() / slide
        self.drag = drag

    def _respond(self, multipliers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return all gaps and the forces on the functions under given multipliers."""
        home, c = self.home, self.c
        acting = np.flatnonzero(multipliers)
        force = multipliers[acting]
        rod = -float(self.rod_per_row[acting] @ force) - float(self.rod_per_drag @ self.drag)
        gaps = self.free + force @ home._W[acting, :c] + self.push * rod
        functions = np.zeros(home.surfaces.size)
        if home.surfaces.size:
            gaps += home._W[:c, home._slides] @ self.drag
            functions = 0.5 * (home._touch.N.T @ multipliers + self.touch.N.T @ multipliers)
            loaded = np.flatnonzero(functions)
            gaps += self.touch.N @ (functions[loaded] @ home._R[loaded])
            gaps[~self.touch.present] = FAR
        return gaps, functions
