"""Time loop of the full FE with contact at fixed points: in the core for narrow bodies, or with sparse factors.

The energy drift is the largest error of T + U + V + D − W over the largest energy that contact converted from kinetic
energy, U − U₀ + V + D: T kinetic, U strain, V stored by laws, D dissipated by closings, laws and damping, W work of
loads.
"""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.types import Json
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.nodal.body import MovingBody
from gudgeon.pipeline.nodal.points.banded import Samples, is_narrow, march, new_band
from gudgeon.pipeline.nodal.points.contact import Press, new_press, press
from gudgeon.pipeline.nodal.problem import PointProblem
from gudgeon.pipeline.nodal.quantities import (
    History,
    body_quantities,
    contact_quantities,
    energy_drift,
    named,
    windows_of,
)
from gudgeon.pipeline.process.clock import Clock
from gudgeon.solver.results.contact_events import restitution

PARTS = 100
"""Parts of a run after which its progress is reported."""


def simulate_points(problem: PointProblem, step: float, progress: Callable[[float], None] | None = None) -> NodalRecord:
    """Integrate the problem with a fixed step [s].

    Args:
        progress: Receives the share done.

    Raises:
        StageError: a contact force was not found, or see `MovingBody`.
    """
    count = max(1, round(problem.duration / step))
    stacked = [_stacked(problem, body_id) for body_id in range(len(problem.bodies))]
    gap_at_rest = np.concatenate([contact.gap for contact in problem.contacts.values()])
    narrow = all(body.suppressed is None and is_narrow(body) for body in problem.bodies)
    clock = Clock()
    loop = (_Banded if narrow else _Factored)(problem, stacked, step)
    gap = gap_at_rest + loop.places()
    contact_press = new_press(list(problem.contacts.values()), loop.compliance(), gap, step)
    points = len(gap)
    history = History(
        step * np.arange(count + 1), np.zeros((count, points)), np.zeros((count + 1, points)), loop.rates()
    )
    history.gaps[0] = gap
    energies = np.vstack([loop.energies(contact_press), np.zeros((count, 5))])
    chunk = max(1, count // PARTS)
    for start in range(0, count, chunk):
        chosen = slice(start, min(start + chunk, count))
        out = history.forces[chosen], history.gaps[1:][chosen], energies[1:][chosen]
        if (made := loop.advance(contact_press, gap_at_rest, gap, out)) < len(out[0]):
            raise StageError(f"full FE: no contact force was found in step {start + made + 1} of {step:g} s")
        if progress is not None:
            progress(chosen.stop / count)
    ends = np.cumsum([0, *(len(contact.gap) for contact in problem.contacts.values())])
    rows = {name: slice(*ends[k : k + 2]) for k, name in enumerate(problem.contacts)}
    quantities = _quantities(problem, history, rows, loop.motions()) | {
        "energy_lost": {"value": float(energies[-1, 3]), "unit": "J"}
    }
    taken = clock.read()
    loop.free()
    converted = energies[1:, 1] - energies[0, 1] + energies[1:, 2] + energies[1:, 3]
    forces = {name: history.forces[:, rows[name]] @ contact.directions for name, contact in problem.contacts.items()}
    return NodalRecord(
        step=float(history.times[1]), times=history.times[1:], force=np.sum(list(forces.values()), axis=0),
        energies=energies[1:, :3].copy(), energy_drift=energy_drift(energies, float(np.abs(converted).max())),
        coordinates=sum(body.K.shape[0] for body in problem.bodies), newton_iterations=int(contact_press.balance[2]),
        wall_seconds=taken.wall, cpu_seconds=taken.cpu, forces=forces, quantities=quantities,
    )  # fmt: skip


def _stacked(problem: PointProblem, body_id: int) -> sparse.csr_matrix:
    """Return ∂g/∂u of all points by one body, (c, dofs)."""
    size = problem.bodies[body_id].K.shape[0]
    rows = [(contact.rows[body_id], len(contact.gap)) for contact in problem.contacts.values()]
    return sparse.csr_matrix(sparse.vstack([sparse.csr_matrix((c, size)) if G is None else G for G, c in rows]))


class _Banded:
    """Narrow bodies in the core's loop."""

    def __init__(self, problem: PointProblem, stacked: list[sparse.csr_matrix], step: float) -> None:
        self._bands = tuple(new_band(body, rows, step) for body, rows in zip(problem.bodies, stacked, strict=True))
        self._step = step
        self._parts = list(zip(stacked, self._bands, strict=True))

    def compliance(self) -> np.ndarray:
        """Return W [m/N], (c, c)."""
        W = sum((rows @ band.answers.T for rows, band in self._parts), np.zeros(()))
        return (self._step**2 / 4) * (W + W.T)

    def places(self) -> np.ndarray:
        """Return G u of all bodies now [m], (c,)."""
        return sum((rows @ band.u for rows, band in self._parts), np.zeros(()))

    def rates(self) -> np.ndarray:
        """Return G v of all bodies now [m/s], (c,)."""
        return sum((rows @ band.v for rows, band in self._parts), np.zeros(()))

    def energies(self, contact_press: Press) -> np.ndarray:
        """Return kinetic, strain, contact, dissipated energy and work of loads now [J], (5,)."""
        kinetic = sum(0.5 * float(band.v @ band.Mv) for band in self._bands)
        strain = sum(0.5 * float(band.u @ band.Ku) for band in self._bands)
        balance = sum((band.balance for band in self._bands), np.zeros(2))
        return np.array([kinetic, strain, contact_press.balance[1], contact_press.balance[0] + balance[0], balance[1]])

    def motions(self) -> list[np.ndarray]:
        """Return displacements and velocities of each body now, (2, dofs)."""
        return [np.array([band.u, band.v]) for band in self._bands]

    def advance(self, contact_press: Press, gap_at_rest: np.ndarray, gap: np.ndarray, out: Samples) -> int:
        """Make steps, see `march`."""
        return march(self._bands, contact_press, gap_at_rest, gap, out)

    def free(self) -> None:
        """Release memory that the interpreter does not."""


class _Factored:
    """Bodies of any shape, each with a sparse factor; the functions are those of `_Banded`."""

    def __init__(self, problem: PointProblem, stacked: list[sparse.csr_matrix], step: float) -> None:
        self._bodies = [MovingBody(body, rows, step) for body, rows in zip(problem.bodies, stacked, strict=True)]
        self._loads = [body.load_means(np.array([0.0, step]))[0] for body in problem.bodies]

    def compliance(self) -> np.ndarray:
        return sum((body.W for body in self._bodies), np.zeros(()))

    def places(self) -> np.ndarray:
        return sum((body.places() for body in self._bodies), np.zeros(()))

    def rates(self) -> np.ndarray:
        return sum((body.rates() for body in self._bodies), np.zeros(()))

    def energies(self, contact_press: Press) -> np.ndarray:
        kinetic, strain = sum(body.kinetic for body in self._bodies), sum(body.strain for body in self._bodies)
        dissipated, work = sum(body.dissipated for body in self._bodies), sum(body.work for body in self._bodies)
        return np.array([kinetic, strain, contact_press.balance[1], contact_press.balance[0] + dissipated, work])

    def motions(self) -> list[np.ndarray]:
        return [body.motion() for body in self._bodies]

    def advance(self, contact_press: Press, gap_at_rest: np.ndarray, gap: np.ndarray, out: Samples) -> int:
        forces, gaps, energies = out
        for n in range(len(forces)):
            rate = self.rates() if contact_press.rigid else gap
            free = gap_at_rest.copy()
            for body, loads in zip(self._bodies, self._loads, strict=True):
                free += body.predict(loads)
            if not press(contact_press, gap, rate, free):
                return n
            forces[n] = contact_press.force
            for body in self._bodies:
                body.advance(forces[n])
            gap[:] = gap_at_rest + self.places()
            gaps[n], energies[n] = gap, self.energies(contact_press)
        return len(forces)

    def free(self) -> None:
        for body in self._bodies:
            body.free()


def _quantities(problem: PointProblem, history: History, rows: dict[str, slice], ends: list[np.ndarray]) -> Json:
    """Return the run's quantities, named as the solver's.

    Args:
        rows: Points of each contact.
        ends: Displacements and velocities of each body at the end, (2, dofs).
    """
    elastic, quantities = any(body.K.nnz for body in problem.bodies), {}
    motions = [body.centre_motion(end) for body, end in zip(problem.bodies, ends, strict=True)]
    for name, contact in problem.contacts.items():
        pair = motions[contact.body], None if contact.other is None else motions[contact.other]
        point_history = history.of(rows[name])
        force = point_history.forces @ contact.directions
        windows = windows_of(problem.window, history.times, contact, elastic, force)
        values = contact_quantities(point_history, contact, pair, windows)
        if problem.flying:
            rigid = [body.rigid_velocities(end) for body, end in zip(problem.bodies, ends, strict=True)]
            values |= restitution(*np.concatenate(rigid, axis=1))
        quantities |= named(name, values)
    for body, motion in zip(problem.bodies, motions, strict=True):
        quantities |= body_quantities(body.name, motion)
    return quantities
