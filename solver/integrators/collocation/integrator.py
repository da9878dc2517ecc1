"""The collocation integrator: exact free flight, contact laws by collocation with steps from the accuracy."""

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from gudgeon.solver import capabilities, core
from gudgeon.solver.integrators.collocation import arrays
from gudgeon.solver.integrators.collocation.arrays import FASTEST, LAST, LEVELS, MONOMIALS, POINTS, REFERENCE, TIME
from gudgeon.solver.integrators.event.motion import Motion
from gudgeon.solver.integrators.event.record import NODES, WEIGHTS, Record
from gudgeon.solver.integrators.event.regimes import Equations, all_open
from gudgeon.solver.integrators.event.segment import Segment, segment
from gudgeon.solver.integrators.outcome import LOST, START_ENERGY, Outcome, Samples
from gudgeon.solver.integrators.polynomial_response import free, responses
from gudgeon.solver.integrators.uncoupled import SLOWEST, uncoupled
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System

CHUNK = 512
"""Steps of a call of the core."""
IMPACT_POINTS = np.linspace(0.0, 1.0, 5)
"""Points of a step between which the impulse of an impact is interpolated."""
START = 100.0
"""Force after the first step of a contact over the error allowed."""


class Collocation(capabilities.Collocation):
    """A run, sampled at the interval `dt` [s]; `fixed_step` [s] replaces the steps that the accuracy requires."""

    failure = Result.NOT_CONVERGED

    def __init__(self, system: System, dt: float, fixed_step: float | None = None) -> None:
        run, c, n = system.scene.run, *system.rows.shape
        self._system, self._dt = system, dt
        self._equations, self._open = Equations(system), all_open(system)
        eigen = uncoupled(system)
        self._basis, self._modes, self._omega = eigen.solved, eigen.modes, eigen.omega
        self._record, self._last = Record(system), run.duration
        self._tolerance = run.accuracy or self.accuracy
        self._fixed = fixed_step is not None
        self._tables = _empty(fixed_step or run.duration / 16, c, n)
        balance = np.zeros(LOST + 1)
        balance[START_ENERGY] = eigen.energy
        self._motion = arrays.Motion(
            y=eigen.start.copy(), v=eigen.speed.copy(), force=np.zeros(c), before=np.zeros((c, 4)),
            approach=np.zeros(c), clock=np.zeros(4), level=np.zeros(1, np.int64), balance=balance,
            counts=np.zeros(3, np.int64),
        )  # fmt: skip
        self._constants = arrays.Constants(
            rows=eigen.rows, gap=system.gap, series=np.ascontiguousarray(system.residual.diagonal()), law=system.law,
            stiffness=eigen.omega**2, constant=eigen.constant, start=eigen.start, tolerance=self._tolerance,
            fixed=0 if self._fixed else -1, floor=SLOWEST,
        )  # fmt: skip
        self._track = _track(CHUNK, c, n)
        self._run = core.Collocation(self._tables, self._constants, self._motion, self._track, _trial(c))
        self._impacts = 0
        self._closed: set[int] = set()
        self._gaps, self._pressed = np.zeros((2, c)), np.zeros(c)
        self._p, self._v = system.position.copy(), system.velocity.copy()
        self._pending: _Steps | None = None
        self._kept_until = 0.0
        self._flight: Segment | None = None if system.start_forces.any() else self._fly(0.0)
        if self._flight is None:
            self._begin_pressed()

    def advance(self, start_step: int, stride: int, out: Samples) -> bool:
        """Fill all but the loads of samples of `stride` intervals; False where a contact force was not found."""
        ends = (start_step + stride * np.arange(1, len(out.forces) + 1)) * self._dt
        end = float(ends[-1])
        self._record.open_samples(ends, stride * self._dt, out)
        if self._pending is not None:
            self._keep(self._pending, end)
        while (self._motion.clock[TIME] if self._flight is None else self._flight.start) < end:
            if self._flight is None:
                if not self._press(end):
                    return False
                continue
            self._record.add_segment(self._flight, min(self._flight.end, end))
            if self._flight.end >= end or self._flight.event is None:
                break
            self._touch(self._flight)
        if self._flight is not None and self._flight.start <= end:
            self._record.add_segment(self._flight, min(self._flight.end, end))
            self._p, self._v = self._flight.motion.state(end - self._flight.start)
        self._record.keep_peaks()
        return bool(np.isfinite(out.energies).all())

    def impacts(self) -> list[np.ndarray]:
        return self._record.impacts()

    def outcome(self) -> Outcome:
        forces = self._pressed if self._flight is None else np.zeros(len(self._system.gap))
        steps, rejected, iterations = map(int, self._motion.counts)
        outcome_ = self._record.outcome(self._p, self._v, forces, np.array([0, steps, iterations, -1]))
        work = {"steps": steps, "steps_rejected": rejected, "newton_iterations": iterations, "impacts": self._impacts}
        return replace(outcome_, work=work)

    # Flight

    def _fly(self, time: float) -> Segment:
        """Return the flight from the present state at a time [s]."""
        motion = self._motion
        p, v = self._modes @ motion.y, self._modes @ motion.v
        regime = self._equations.regime(self._open, p)
        flight = Motion.begin(self._basis, regime.linear, p, v)
        course = flight.course(regime.watched)
        np.maximum(course.a, 0.0, out=course.a)
        self._p, self._v = p, v
        return segment(time, flight, regime, course, self._last * (1 + 1e-9))

    def _touch(self, flight: Segment) -> None:
        """Begin a contact at the end of a flight."""
        assert flight.event is not None
        row, system, motion = flight.event[1], self._system, self._motion
        p, v = flight.motion.state(flight.end - flight.start)
        motion.y[:], motion.v[:] = self._modes.T @ p, self._modes.T @ v
        speed = -float(system.rows[row] @ v)
        stiffness, exponent, _, damping = system.law[row]
        mass = 1.0 / float(system.rows[row] @ system.rows[row])
        # A body that is pressed on at rest moves by its static indentation, which sets the least approach speed.
        load = abs(float(self._constants.rows[row] @ (self._constants.constant - self._omega**2 * motion.y)))
        settling = float(np.sqrt(load * (mass * load / stiffness) ** (1 / exponent)))
        motion.clock[FASTEST] = max(motion.clock[FASTEST], speed, settling)
        motion.approach[:] = 0.0
        motion.approach[row] = max(speed, SLOWEST * motion.clock[FASTEST], np.finfo(float).tiny)
        motion.clock[TIME], motion.clock[LAST] = flight.end, 0.0
        motion.force[:] = 0.0
        motion.force[row] = damping * speed
        deepest = (0.5 * (exponent + 1) * mass * motion.approach[row] ** 2 / stiffness) ** (1 / (exponent + 1))
        motion.clock[REFERENCE] = max(
            motion.clock[REFERENCE], stiffness * deepest**exponent, damping * speed, mass * load
        )
        shallow = (START * self._tolerance * motion.clock[REFERENCE] / stiffness) ** (1 / exponent)
        start_length = min(shallow / motion.approach[row], float(np.sqrt(2 * shallow / load)) if load > 0 else np.inf)
        longest = self._tables.length[0]
        motion.level[0] = 0 if self._fixed else int(np.clip(np.ceil(np.log2(longest / start_length)), 0, LEVELS - 1))
        motion.balance[LOST] = self._record.lost
        self._impacts += 1
        self._record.touches(row, flight.end, speed)
        self._closed = {row}
        self._gaps = np.array([system.gap + system.rows @ p, system.rows @ v])
        self._gaps[0, row] = 0.0
        self._flight = None

    # Contact

    def _begin_pressed(self) -> None:
        """Begin the run in the static equilibrium with contact."""
        system, motion, record = self._system, self._motion, self._record
        rows = np.flatnonzero(system.start_forces)
        motion.force[:] = system.start_forces
        # A contact that begins at rest has no loss: as of an impact of any speed.
        motion.approach[rows] = np.inf
        motion.clock[REFERENCE] = motion.force.max()
        self._gaps = np.array([system.gap + system.rows @ self._p, system.rows @ self._v])
        self._closed, self._impacts = set(rows.tolist()), len(rows)
        for row in self._closed:
            record.touches(row, 0.0, 0.0)

    def _press(self, end: float) -> bool:
        """Advance a contact until it is over or `end` [s] is passed; False where a force was not found."""
        code, count = self._run.march(end)
        if count:
            done = _Steps(*(column[:count] for column in self._track))
            self._follow(done)
            self._keep(done, end)
        if code == arrays.MISSING:
            self._tabulate(int(self._motion.level[0]))
        elif code == arrays.OVER:
            self._flight = self._fly(float(self._motion.clock[TIME]))
            for row in list(self._closed):
                self._record.contact(row).parts(row)
        return code != arrays.FAILED

    def _tabulate(self, level: int) -> None:
        """Fill the tables of a level."""
        tables, rows, constant = self._tables, self._constants.rows, self._constants.constant
        h, n = float(tables.length[level]), len(self._omega)
        times = h * POINTS[1:]
        moved = free(self._omega, times)
        tables.free[level] = moved[:, -1]
        for order, response in enumerate(responses(self._omega, 3, times)):
            cubics = np.einsum("jm,m,mtn->tjn", MONOMIALS, h ** -np.arange(4.0), response)
            tables.drift[level, order], tables.push[level, order] = constant * response[0, -1], cubics[-1]
            tables.gap[level, order, :, :, :n] = moved[2 * order][:, None] * rows
            tables.gap[level, order, :, :, n:] = moved[2 * order + 1][:, None] * rows
            tables.gap_drift[level, order] = (constant * response[0]) @ rows.T
            tables.reach[level, order] = np.einsum("an,bn,tjn->abtj", rows, rows, cubics, optimize=True)
        tables.known[level] = 1

    def _keep(self, done: "_Steps", end: float) -> None:
        """Add accepted steps to the histories up to `end` [s]; a step that passes it is kept for the next frame."""
        record, start = self._record, max(self._kept_until, float(done.start[0]))
        until = min(done.end, end)
        waiting = record.waiting()
        sample_times = waiting[waiting <= until]
        edges = np.unique(
            np.concatenate([[start], done.start[(done.start > start) & (done.start < until)], sample_times, [until]])
        )
        if until > start:
            nothing = np.zeros((len(edges) - 1, done.values.shape[1]))
            record.add_impulses(edges, np.diff(done.impulses(edges), axis=0), nothing)
            self._pull(done, edges)
        if len(sample_times):
            self._fill(done, sample_times)
        record.reached(until, self._motion.balance)
        self._kept_until = until
        self._pending = done.last() if done.end > end else None
        p, v, self._pressed = self._states(done, np.array([until]))
        self._p, self._v, self._pressed = p[0] @ self._modes.T, v[0] @ self._modes.T, self._pressed[0]

    def _pull(self, done: "_Steps", edges: np.ndarray) -> None:
        """Add the impulses of springs between edges [s], (t + 1,), among which are all ends of steps."""
        springs, widths = self._system.springs, np.diff(edges)
        if not len(springs.stiffness):
            return
        times = edges[:-1, None] + widths[:, None] * 0.5 * (1 + NODES)
        y = self._states(done, times.ravel())[0]
        stretch = springs.stretch + (y @ self._modes.T) @ springs.rows.T
        weights = (0.5 * widths[:, None] * WEIGHTS).ravel()
        self._record.add_spring_impulses(springs.stiffness * (weights @ stretch))

    def _states(self, done: "_Steps", times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return y, ẏ, (t, n) each, and contact forces, (t, c), at times within the steps."""
        step, tau = done.place(times)
        moved = free(self._omega, tau)
        scaled = done.cubics[step] / done.length[step][:, None, None] ** np.arange(4)
        load = np.einsum("tcm,cn->mtn", scaled, self._constants.rows)
        position, speed = (
            from_position * done.y[step]
            + fast * done.v[step]
            + self._constants.constant * to[0]
            + (load * to).sum(axis=0)
            for from_position, fast, to in zip(moved[::2], moved[1::2], responses(self._omega, 3, tau), strict=True)
        )
        return position, speed, np.einsum("tcm,tm->tc", scaled, tau[:, None] ** np.arange(4))

    def _fill(self, done: "_Steps", times: np.ndarray) -> None:
        """Fill the samples that end within the steps."""
        position, speed, forces = self._states(done, times)
        series, law = self._constants.series, self._system.law
        depth = np.maximum(-(self._system.gap + position @ self._constants.rows.T) - series * forces, 0.0)
        stored = (law[:, 0] * depth ** (law[:, 1] + 1) / (law[:, 1] + 1)).sum(axis=1) + 0.5 * (forces**2) @ series
        dissipated = done.lost_at(times)
        self._record.states(position @ self._modes.T, speed @ self._modes.T, stored, dissipated, forces, balanced=True)

    def _follow(self, done: "_Steps") -> None:
        """Record which impacts begin and end within the steps, their impulses and largest forces."""
        record, in_contact = self._record, done.values.max(axis=2) > 0
        for k in np.flatnonzero(in_contact.any(axis=1)):
            start, h = float(done.start[k]), float(done.length[k])
            gaps = self._gaps if k == 0 else done.opening[k - 1], done.opening[k]
            rows = [int(row) for row in np.flatnonzero(in_contact[k])]
            for row in rows:
                if row not in self._closed:
                    self._closed.add(row)
                    time, speed = _crossing(gaps[0][:, row], gaps[1][:, row], h, opens=False)
                    record.touches(row, start + time, -speed)
                    self._impacts += 1
            self._add_forces(done, int(k), rows)
            for row in rows:
                if done.values[k, row, 3] == 0:
                    time, speed = _crossing(gaps[0][:, row], gaps[1][:, row], h, opens=True)
                    record.contact(row).leaves(row, start + time, speed)
                    if gaps[1][0, row] > 0:
                        record.contact(row).parts(row)
                        self._closed.discard(row)
        self._gaps = done.opening[-1].copy()

    def _add_forces(self, done: "_Steps", k: int, rows: list[int]) -> None:
        """Add the forces of rows in step k to the impacts of their contacts, and look for the largest resultants."""
        system, start, h = self._system, float(done.start[k]), float(done.length[k])
        x = IMPACT_POINTS * min(1.0, (self._last - start) / h)
        for item in system.contacts:
            contact_rows = [row for row in rows if item.rows.start <= row < item.rows.stop]
            if not contact_rows:
                continue
            contact, cubics = (
                self._record.contact(contact_rows[0]),
                system.directions[contact_rows].T @ done.cubics[k, contact_rows],
            )
            forces = (x[:, None] ** np.arange(4)) @ cubics.T
            impulses = h * (x[:, None] ** np.arange(1, 5) / np.arange(1, 5)) @ cubics.T
            contact.presses(start + h * x, impulses, forces)
            # Of the component along the largest of these forces, whose direction hardly changes within a step.
            sizes = np.linalg.norm(forces, axis=1)
            if (largest := sizes.max()) > 0:
                force, local = _highest((forces[sizes.argmax()] / largest) @ cubics)
                contact.note_peak(force, start + local * h)


class _Steps(arrays.Track):
    """Accepted steps. Shapes: b steps, c contacts."""

    @property
    def end(self) -> float:
        return float(self.start[-1] + self.length[-1])

    @cached_property
    def cubics(self) -> np.ndarray:
        """Force coefficients of (τ/h)^m [N], (b, c, 4)."""
        return np.einsum("jm,tcj->tcm", MONOMIALS, self.values)

    def place(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the number of the step that each time is in, and the time since its start [s], (t,) each."""
        step = np.clip(np.searchsorted(self.start, times, side="left") - 1, 0, len(self.start) - 1)
        return step, times - self.start[step]

    def impulses(self, times: np.ndarray) -> np.ndarray:
        """Return the impulses [N s] from the first step's start to times, (t, c)."""
        powers = np.arange(1, 5)
        per_step = self.length[:, None] * (self.cubics @ (1 / powers))
        totals = np.concatenate([np.zeros((1, per_step.shape[1])), np.cumsum(per_step, axis=0)])
        step, tau = self.place(times)
        local = tau / self.length[step]
        partial_impulse = np.einsum("tcm,tm->tc", self.cubics[step], local[:, None] ** powers / powers)
        return totals[step] + self.length[step, None] * partial_impulse

    def lost_at(self, times: np.ndarray) -> np.ndarray:
        """Return the energy lost by times [J], (t,), linear within a step."""
        step, tau = self.place(times)
        fraction = tau / self.length[step]
        return (1 - fraction) * self.lost[step, 0] + fraction * self.lost[step, 1]

    def last(self) -> "_Steps":
        """Return the last step alone."""
        return _Steps(*(a[-1:].copy() for a in self))


def _highest(cubic: np.ndarray) -> tuple[float, float]:
    """Return the largest value of a cubic on [0, 1], and its place."""
    c0, c1, c2, c3 = map(float, cubic)
    candidates = [(c0, 0.0), (c0 + c1 + c2 + c3, 1.0)]
    under = c2 * c2 - 3 * c3 * c1
    if under >= 0:
        # The roots of 3 c₃ x² + 2 c₂ x + c₁, without subtraction of nearly equal numbers.
        larger = -(c2 + math.copysign(math.sqrt(under), c2))
        roots = [
            numerator / denominator for numerator, denominator in ((larger, 3 * c3), (c1, larger)) if denominator != 0
        ]
        candidates += [(((c3 * x + c2) * x + c1) * x + c0, x) for x in roots if 0 < x < 1]
    return max(candidates)


def _crossing(before: np.ndarray, after: np.ndarray, h: float, *, opens: bool) -> tuple[float, float]:
    """Return when in a step of length h [s] a gap first closes, or last opens, and its rate [m/s] then.

    Args:
        before, after: Gap [m] and its rate [m/s] at the start and the end of the step; between, the gap is a cubic.
    """
    (gap, rate), (later, later_rate) = map(float, before), map(float, after)
    if (later if opens else gap) <= 0:
        return (h, later_rate) if opens else (0.0, rate)
    m0, m1 = rate * h, later_rate * h
    cubic = np.array([2 * (gap - later) + m0 + m1, 3 * (later - gap) - 2 * m0 - m1, m0, gap])
    roots = [root.real for root in np.roots(cubic) if abs(root.imag) < 1e-9 and 0 <= root.real <= 1]
    x = max(roots, default=1.0) if opens else min(roots, default=0.0)
    return x * h, float(np.polyval(np.polyder(cubic), x)) / h


def _empty(longest: float, c: int, n: int) -> arrays.Tables:
    levels = LEVELS
    return arrays.Tables(
        known=np.zeros(levels, np.int64), length=longest * 0.5 ** np.arange(levels), free=np.zeros((levels, 4, n)),
        drift=np.zeros((levels, 2, n)), push=np.zeros((levels, 2, 4, n)), gap=np.zeros((levels, 2, 3, c, 2 * n)),
        gap_drift=np.zeros((levels, 2, 3, c)), reach=np.zeros((levels, 2, c, c, 3, 4)),
    )  # fmt: skip


def _track(count: int, c: int, n: int) -> arrays.Track:
    return arrays.Track(
        start=np.zeros(count), length=np.zeros(count), values=np.zeros((count, c, 4)), y=np.zeros((count, n)),
        v=np.zeros((count, n)), lost=np.zeros((count, 2)), opening=np.zeros((count, 2, c)),
    )  # fmt: skip


def _trial(c: int) -> arrays.Trial:
    return arrays.Trial(
        guess=np.zeros((c, 4)), values=np.zeros((c, 4)), depth=np.zeros((c, 4)), rate=np.zeros((c, 4)),
        loose=np.zeros((c, 3)), loose_rate=np.zeros((c, 3)), matrix=np.zeros((3 * c, 3 * c)), wrong=np.zeros(3 * c),
        approach=np.zeros(c),
    )  # fmt: skip
