"""The full FE of bodies that meet at fixed points: compiled for narrow bodies, or over sparse factors.

Energy drift is the largest error of T + U + V + D − W over the largest part of the energy that contact turned into
others than kinetic, U − U₀ + V + D, with T kinetic, U strain, V what laws store, D what closings, lossy laws and
damping took, W the work of loads.
"""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.types import Json
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.measuring.clock import Clock
from gudgeon.pipeline.nodal.body import MovingBody
from gudgeon.pipeline.nodal.points.banded import is_narrow, march, new_band
from gudgeon.pipeline.nodal.points.contact import Press, new_press, press
from gudgeon.pipeline.nodal.problem import PointProblem
from gudgeon.pipeline.nodal.quantities import History, body_quantities, contact_quantities, named

PARTS = 100
"""Into which a run is divided to tell its progress."""


def simulate_points(problem: PointProblem, step: float, progress: Callable[[float], None] | None = None) -> NodalRecord:
    """Integrate the problem with a fixed step [s].

    Args:
        progress: Told the share done from time to time.

    Raises:
        StageError: a contact force could not be found, or a body's rigid motions are none.
    """
    count = max(1, round(problem.duration / step))
    stacked = [_stacked(problem, number) for number in range(len(problem.bodies))]
    rest = np.concatenate([contact.gap for contact in problem.contacts.values()])
    narrow = all(body.suppressed is None and is_narrow(body) for body in problem.bodies)
    _compile(problem, stacked, rest, narrow)
    clock = Clock()
    loop = (_Compiled if narrow else _Factored)(problem, stacked, step)
    gap = rest + loop.places()
    now = new_press(list(problem.contacts.values()), loop.compliance(), gap, step)
    points = len(gap)
    history = History(
        step * np.arange(count + 1), np.zeros((count, points)), np.zeros((count + 1, points)), loop.rates()
    )
    history.gaps[0] = gap
    energies, begun = np.zeros((count, 5)), loop.energies(now)
    part = max(1, count // PARTS)
    for first in range(0, count, part):
        chosen = slice(first, min(first + part, count))
        out = history.forces[chosen], history.gaps[1:][chosen], energies[chosen]
        if (made := loop.advance(now, rest, gap, *out)) < len(out[0]):
            raise StageError(f"nodal: no contact force was found in step {first + made + 1} of {step:g} s")
        if progress is not None:
            progress(chosen.stop / count)
    found = _quantities(problem, history, loop, float(energies[-1, 3]))
    taken = clock.read()
    loop.free()
    return _record(problem, history, energies, begun, (int(now.balance[2]), taken.wall, taken.cpu), found)


def _stacked(problem: PointProblem, number: int) -> sparse.csr_matrix:
    """Return ∂g/∂u of all points by one body, (c, dofs)."""
    size = problem.bodies[number].K.shape[0]
    rows = [(contact.rows[number], len(contact.gap)) for contact in problem.contacts.values()]
    return sparse.csr_matrix(sparse.vstack([sparse.csr_matrix((c, size)) if G is None else G for G, c in rows]))


def _compile(problem: PointProblem, stacked: list[sparse.csr_matrix], rest: np.ndarray, narrow: bool) -> None:
    """Have what is compiled compiled, which is no part of a run's time."""
    c = len(rest)
    now = new_press(list(problem.contacts.values()), np.eye(c), rest + 1.0, 1.0)
    if narrow:
        out = np.zeros((1, c)), np.zeros((1, c)), np.zeros((1, 5))
        _Compiled(problem, stacked, problem.duration).advance(now, rest, rest + 1.0, *out)
    else:
        press(now, rest + 1.0, np.zeros(c), rest + 1.0)


class _Compiled:
    """Narrow bodies."""

    def __init__(self, problem: PointProblem, stacked: list[sparse.csr_matrix], step: float) -> None:
        self._bands = tuple(new_band(body, rows, step) for body, rows in zip(problem.bodies, stacked, strict=True))
        self._works, self._step = tuple(np.zeros(len(band.u)) for band in self._bands), step
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

    def energies(self, now: Press) -> np.ndarray:
        """Return kinetic, strain, contact, lost, work of loads now [J], (5,)."""
        kinetic = sum(0.5 * float(band.v @ band.Mv) for band in self._bands)
        strain = sum(0.5 * float(band.u @ band.Ku) for band in self._bands)
        balance = sum((band.balance for band in self._bands), np.zeros(2))
        return np.array([kinetic, strain, now.balance[1], now.balance[0] + balance[0], balance[1]])

    def motions(self) -> list[np.ndarray]:
        """Return displacements and velocities of each body now, (2, dofs)."""
        return [np.array([band.u, band.v]) for band in self._bands]

    def advance(self, now: Press, rest: np.ndarray, gap: np.ndarray, *out: np.ndarray) -> int:
        """Make steps, see `march`."""
        return march(self._bands, self._works, now, rest, gap, self._step, *out)

    def free(self) -> None:
        """Nothing is held that the interpreter does not free."""


class _Factored:
    """Bodies of any shape, each with a sparse factor; the same functions."""

    def __init__(self, problem: PointProblem, stacked: list[sparse.csr_matrix], step: float) -> None:
        self._bodies = [MovingBody(body, rows, step) for body, rows in zip(problem.bodies, stacked, strict=True)]
        self._loads = [body.load_means(np.array([0.0, step]))[0] for body in problem.bodies]

    def compliance(self) -> np.ndarray:
        return sum((body.W for body in self._bodies), np.zeros(()))

    def places(self) -> np.ndarray:
        return sum((body.places() for body in self._bodies), np.zeros(()))

    def rates(self) -> np.ndarray:
        return sum((body.rates() for body in self._bodies), np.zeros(()))

    def energies(self, now: Press) -> np.ndarray:
        kinetic, strain = sum(body.kinetic for body in self._bodies), sum(body.strain for body in self._bodies)
        lost, work = sum(body.dissipated for body in self._bodies), sum(body.work for body in self._bodies)
        return np.array([kinetic, strain, now.balance[1], now.balance[0] + lost, work])

    def motions(self) -> list[np.ndarray]:
        return [body.motion() for body in self._bodies]

    def advance(self, now: Press, rest: np.ndarray, gap: np.ndarray, *out: np.ndarray) -> int:
        forces, gaps, energies = out
        for n in range(len(forces)):
            rate = self.rates() if now.rigid else gap
            free = rest.copy()
            for body, loads in zip(self._bodies, self._loads, strict=True):
                free += body.predict(loads)
            if not press(now, gap, rate, free):
                return n
            forces[n] = now.force
            for body in self._bodies:
                body.advance(forces[n])
            gap[:] = rest + self.places()
            gaps[n], energies[n] = gap, self.energies(now)
        return len(forces)

    def free(self) -> None:
        for body in self._bodies:
            body.free()


def _quantities(problem: PointProblem, history: History, loop: "_Compiled | _Factored", lost: float) -> Json:
    """Return name → {"value", "unit"} as the solver names them, and what was lost."""
    elastic = any(body.K.nnz for body in problem.bodies)
    motions = []
    for body, motion in zip(problem.bodies, loop.motions(), strict=True):
        motions.append(body.centre_motion(motion))
    found, first = {}, 0
    for name, contact in problem.contacts.items():
        rows = slice(first, first + len(contact.gap))
        other = None if contact.other is None else motions[contact.other]
        values = contact_quantities(history.of(rows), contact, (motions[contact.body], other), elastic, problem.flying)
        found |= named(name, values)
        first = rows.stop
    for body, motion in zip(problem.bodies, motions, strict=True):
        found |= body_quantities(body.name, motion)
    return found | {"energy_lost": {"value": lost, "unit": "J"}}


def _record(
    problem: PointProblem,
    history: History,
    energies: np.ndarray,
    begun: np.ndarray,
    counts: tuple[int, float, float],
    quantities: Json,
) -> NodalRecord:
    balance = energies[:, :4].sum(axis=1) - energies[:, 4]
    turned = energies[:, 1] - begun[1] + energies[:, 2] + energies[:, 3]
    error, exchanged = float(np.abs(balance - (begun[:4].sum() - begun[4])).max()), float(np.abs(turned).max())
    forces, first = {}, 0
    for name, contact in problem.contacts.items():
        rows = slice(first, first + len(contact.gap))
        forces[name], first = history.forces[:, rows] @ contact.directions, rows.stop
    total = np.sum(list(forces.values()), axis=0)
    coordinates = sum(body.K.shape[0] for body in problem.bodies)
    iterations, wall, cpu = counts
    return NodalRecord(
        float(history.times[1]), history.times[1:], total, energies[:, :3].copy(),
        error / exchanged if exchanged else 0.0, coordinates, iterations, wall, cpu, forces=forces,
        quantities=quantities,
    )  # fmt: skip
