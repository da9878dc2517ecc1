"""What a run of the event integrator keeps: histories, impacts, energy and impulse balances."""

from dataclasses import replace

import numpy as np
from scipy import optimize

from gudgeon.solver.integrators.event.jumps import Impact
from gudgeon.solver.integrators.event.motion import Course, Probe
from gudgeon.solver.integrators.event.regimes import Conditions, Regime, Status
from gudgeon.solver.integrators.event.search import PER_RADIAN
from gudgeon.solver.integrators.event.segment import Segment
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.system.system import System

NOTHING = 1e-9
"""Share of the energies that counts as exchanged even where no contact exchanges any."""
PANELS = 2000
"""Integrated at once."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)


class Record:
    """Everything is added up from courses of the motion, independently of the states that the motion leads to."""

    def __init__(self, system: System) -> None:
        self._system = system
        c, k = system.rows.shape[0], max(1, len(system.contacts))
        self._impulses = np.zeros(c)
        self._drags = np.zeros(c)
        springs, nothing = system.springs, np.zeros((0, system.rows.shape[1]))
        self._tension = (
            Probe(
                springs.stiffness * springs.stretch,
                springs.stiffness[:, None] * springs.rows,
                springs.damping[:, None] * springs.rows,
            )
            if len(springs.stiffness)
            else Probe(np.zeros(0), nothing, nothing)
        )
        self._pulls = np.zeros(len(springs.stiffness))
        self._lost = self._driven = 0.0
        self._slack: set[int] = set()
        self._start = (system.position.copy(), system.velocity.copy())
        self._extreme = np.array([self._energy(*self._start), 0.0, 0.0, 0.0, -1.0, -1.0])
        self._contact_of = np.zeros(c, np.int64)
        self._directions = np.zeros((c, 3))
        for number, item in enumerate(system.contacts):
            self._contact_of[item.rows] = number
            self._directions[item.rows] = item.directions
        self._lines = _lines(system, self._directions)
        self._running: dict[int, list[float]] = {}
        self.impacts: list[list[list[float]]] = [[] for _ in range(k)]
        self.at_zero: set[int] = set()
        self.slips: list[list[tuple[float, bool]]] = [[] for _ in range(k)]
        self._done = 0
        self._pending: list[np.ndarray] = []

    # Histories

    def open_samples(self, ends: np.ndarray, interval: float, out: Samples) -> None:
        """Take the arrays that the samples of a frame go to."""
        self._ends, self._interval, self._out = ends, interval, out
        out.forces[:] = 0.0
        for share in self._pending:
            np.add.at(out.forces[0], self._contact_of, share / interval)
        self._pending = []
        self._done, self._from = 0, float(ends[0]) - interval

    def add_segment(self, segment: Segment, until: float) -> None:
        """Add the motion between what was recorded last and `until` to the histories."""
        begin = max(self._from, segment.start)
        if until < begin:
            return
        ends = self._ends[self._done :]
        inside = ends[ends <= until]
        edges = np.unique(np.concatenate([[begin], inside, [until]])) - segment.start
        course, driven = segment.motion.course(segment.regime.forces), np.zeros(len(edges))
        if np.any(course.a) or np.any(course.A) or np.any(course.b) or np.any(course.c):
            drag = np.diff(segment.motion.course(segment.regime.tangential).integral(edges), axis=0)
            driven[1:] = np.cumsum(drag @ self._system.belt)
            self.add_impulses(edges + segment.start, np.diff(course.integral(edges), axis=0), drag)
            for row in list(self._running):
                self._peak(row, course[row], edges, segment.start)
        if len(self._pulls) and edges[-1] > edges[0]:
            stretch = self._tension(segment.motion.start, np.zeros_like(segment.motion.v))
            tension = segment.motion.course(replace(self._tension, constant=stretch))
            self.add_spring_impulses(np.diff(tension.integral(edges[[0, -1]]), axis=0)[0])
        lost = np.concatenate([[0.0], np.cumsum(self._dissipate(segment, edges))])
        at = np.searchsorted(edges, inside - segment.start)
        self._samples(segment, inside, self._lost + lost[at], self._driven + driven[at])
        self._lost += float(lost[-1])
        self._driven += float(driven[-1])
        self._from = until

    def add_impulses(self, edges: np.ndarray, given: np.ndarray, drag: np.ndarray, *, to_impacts: bool = True) -> None:
        """Add impulses of each row to the histories.

        Args:
            edges: Times, with every sample's end that lies between among them, (t + 1,).
            given, drag: Normal and tangential between them [N s], (t, c).
            to_impacts: Whether running impacts take them, too.
        """
        forces = self._out.forces
        self._impulses += given.sum(axis=0)
        self._drags += drag.sum(axis=0)
        number = np.searchsorted(self._ends, edges[1:] - 1e-12 * self._interval)
        number = np.minimum(number, len(forces) - 1)
        for row in np.flatnonzero(np.abs(given).sum(axis=0) > 0):
            share = given[:, row, None] * self._directions[row] + drag[:, row, None] * self._lines[row]
            np.add.at(forces[:, self._contact_of[row]], number, share / self._interval)
            if to_impacts:
                self.gives(int(row), float(given[:, row].sum()))
        if self._extreme[4] < 0:
            self._extreme[4] = edges[0]
        self._extreme[5] = edges[-1]

    def _peak(self, row: int, course: Course, edges: np.ndarray, start: float) -> None:
        """Note the largest force of a running impact."""
        if row not in self._running or edges[-1] <= edges[0]:
            return
        fastest = float(np.abs(course.exponents).max()) if len(course.exponents) else 0.0
        count = min(int(np.ceil(PER_RADIAN * fastest * (edges[-1] - edges[0]))) + 2, 200_000)
        time = np.linspace(edges[0], edges[-1], count)
        values = course.values(time)[:, 0]
        at = int(values.argmax())
        best, when = float(values[at]), float(time[at])
        around = course.rate.values(time[[max(at - 1, 0), min(at + 1, count - 1)]])[:, 0]
        if best > 0.9 * self._running[row][3] and around[0] > 0 > around[1]:
            when = optimize.brentq(
                lambda moment: float(course.rate.values(np.array([moment]))[0, 0]),
                time[max(at - 1, 0)], time[min(at + 1, count - 1)], xtol=1e-300, rtol=1e-14,
            )  # fmt: skip
            best = float(course.values(np.array([when]))[0, 0])
        self.peak(row, best, when + start)

    def _dissipate(self, segment: Segment, edges: np.ndarray) -> np.ndarray:
        """Return what dashpots and friction take between edges (t + 1,), over panels of about one radian, (t,)."""
        system, regime = self._system, segment.regime
        lost = np.zeros(len(edges) - 1)
        sliding = np.any(regime.tangential.position) or np.any(regime.tangential.constant)
        if not np.any(regime.linear.dampers) and not sliding:
            return lost
        fastest = float(np.abs(segment.motion.exponents).max()) if len(segment.motion.exponents) else 0.0
        spans = np.diff(edges)
        panels = np.maximum(1, np.ceil(fastest * spans)).astype(int)
        owner = np.repeat(np.arange(len(spans)), panels)
        width = (spans / panels)[owner]
        start = edges[owner] + width * (np.arange(len(owner)) - np.repeat(np.cumsum(panels) - panels, panels))
        tangential = regime.tangential
        for block in range(0, len(owner), PANELS):
            here = slice(block, block + PANELS)
            time = (start[here, None] + width[here, None] * 0.5 * (1 + NODES)).ravel()
            u, v = segment.motion.displacements(time)
            power = ((v @ regime.linear.rows.T) ** 2) @ regime.linear.dampers
            if sliding:
                drag = tangential.constant + u @ tangential.position.T + v @ tangential.velocity.T
                power = power - (drag * (v @ system.tangents.T - system.belt)).sum(axis=1)
            np.add.at(lost, owner[here], 0.5 * width[here] * (power.reshape(-1, len(NODES)) @ WEIGHTS))
        return lost

    def _samples(self, segment: Segment, inside: np.ndarray, lost: np.ndarray, driven: np.ndarray) -> None:
        if not len(inside):
            return
        u, v = segment.motion.displacements(inside - segment.start)
        forces = segment.regime.forces
        pressed = forces.constant + u @ forces.position.T + v @ forces.velocity.T
        stored = _pressed_energy(u, segment.regime, len(self._pulls))
        self.states(segment.motion.start + u, v, stored, lost, pressed, driven)

    def states(
        self,
        p: np.ndarray,
        v: np.ndarray,
        contact: np.ndarray,
        lost: np.ndarray,
        pressed: np.ndarray,
        driven: np.ndarray | float = 0.0,
        balanced: bool = False,
    ) -> None:
        """Fill the next samples.

        Args:
            p, v: States at their ends, (t, n).
            contact, lost: Energy stored in contacts and lost so far [J], (t,).
            pressed: Contact forces [N], (t, c).
            driven: Work that moving obstacles have done so far through friction [J], (t,).
            balanced: Whether the energy balance is kept elsewhere, closer than at samples.
        """
        _, energies, _, snapshots, gauges = self._out
        here = slice(self._done, self._done + len(p))
        parts = self._energies(p, v)
        parts[:, 2], parts[:, 3] = contact, lost
        parts[:, 4] += driven
        energies[here] = parts
        if not balanced:
            self._balance(p, v, parts)
        system, r = self._system, len(self._system.rigid)
        snapshots[here, :r], snapshots[here, r : 2 * r] = p[:, system.rigid], v[:, system.rigid]
        if gauges.shape[1]:
            gauges[here] = p @ system.gauge_rows.T + pressed @ system.gauge_residual.T
        self._done += len(p)

    # Balances

    def _energies(self, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return kinetic, strain, no contact energy, what was lost, work of gravity at states (t, n), (t, 5)."""
        system, springs = self._system, self._system.springs
        stretch = springs.stretch + p @ springs.rows.T
        strain = 0.5 * ((p**2) @ system.stiffness + (stretch**2) @ springs.stiffness)
        work = (p - self._start[0]) @ system.driving.gravity
        kinetic = 0.5 * (v**2).sum(axis=1)
        return np.column_stack([kinetic, strain, np.zeros(len(p)), np.full(len(p), self._lost), work])

    def _energy(self, p: np.ndarray, v: np.ndarray) -> float:
        parts = self._energies(p[None], v[None])[0]
        return float(parts[:3].sum())

    def _balance(self, p: np.ndarray, v: np.ndarray, parts: np.ndarray) -> None:
        """Note the largest error of the energy balance, and the largest exchange."""
        system, extreme = self._system, self._extreme
        error = np.abs(parts[:, :4].sum(axis=1) - parts[:, 4] - extreme[0])
        extreme[1] = max(extreme[1], float(error.max()))
        gravity, start = system.driving.gravity, self._start
        gained = 0.5 * (v**2 - start[1] ** 2) - (p - start[0]) * gravity
        rigid = gained[:, system.rigid]
        elastic = gained.sum(axis=1) - rigid.sum(axis=1) + parts[:, 1]
        swing = 0.5 * (np.abs(rigid).sum(axis=1) + np.abs(elastic) + parts[:, 2])
        # Where nothing is exchanged, round-off of all that there is would be compared with itself.
        least = NOTHING * np.abs(parts).sum(axis=1)
        extreme[2] = max(extreme[2], float(swing.max()), float(least.max()))

    # Impacts

    def touches(self, row: int, time: float, closing: float) -> None:
        """Begin an impact at a closing speed [m/s], unless one runs."""
        if row not in self._running:
            # What its closing brings, whether a sample falls into the contact or not.
            square = float(self._system.rows[row] @ self._system.rows[row])
            self._extreme[2] = max(self._extreme[2], 0.25 * closing**2 / square if square > 0 else 0.0)
            self._running[row] = [time, time, 0.0, 0.0, time, closing, 0.0]
        if self._extreme[4] < 0:
            self._extreme[4] = time
        self._extreme[5] = time

    def add_spring_impulses(self, impulses: np.ndarray) -> None:
        """Add impulses of springs [N s], (b,)."""
        self._pulls += impulses

    def gives(self, row: int, impulse: float) -> None:
        """Add to the impulse [N s] of a running impact."""
        if row in self._running:
            self._running[row][2] += impulse

    def parts(self, row: int, time: float, v: np.ndarray) -> None:
        """End an impact."""
        if row in self._running:
            entry = self._running.pop(row)
            entry[1], entry[6] = time, float(self._system.rows[row] @ v)
            self.impacts[self._contact_of[row]].append(entry)
        self._extreme[5] = time

    def impact(self, impact: Impact, time: float, v: np.ndarray, now: Conditions) -> None:
        """Add an impulsive contact; a row that does not stay closed has had its whole impact."""
        self._impulses += impact.impulses
        self._drags += impact.tangential
        self._lost += impact.lost
        self._extreme[2] = max(self._extreme[2], impact.compressed)
        share = impact.impulses[:, None] * self._directions + impact.tangential[:, None] * self._lines
        if time > 0:
            number = min(int(np.searchsorted(self._ends, time * (1 - 1e-15))), len(self._ends) - 1)
            np.add.at(self._out.forces[number], self._contact_of, share / self._interval)
        else:
            self._pending.append(share)
        for row in np.flatnonzero(impact.impulses):
            self.gives(int(row), float(impact.impulses[row]))
        for row in [row for row in self._running if now.status[row] == Status.OPEN]:
            self.parts(row, time, v)

    def peak(self, row: int, force: float, time: float) -> None:
        """Note a force of a running impact."""
        if row in self._running and force > self._running[row][3]:
            self._running[row][3:5] = [force, time]

    def leaves(self, row: int, time: float, speed: float) -> None:
        """Note when a running impact's force has vanished, and the opening speed [m/s] then."""
        if row in self._running:
            self._running[row][1], self._running[row][6] = time, speed

    def waiting(self) -> np.ndarray:
        """Return the ends of the samples that are still to be filled, (t,)."""
        return self._ends[self._done :]

    def reached(self, time: float, drift: float, exchanged: float, lost: float) -> None:
        """Take over what was recorded by other means than segments, up to a time, with its balances [J]."""
        self._from, self._lost = time, lost
        self._extreme[1], self._extreme[2] = max(self._extreme[1], drift), max(self._extreme[2], exchanged)

    @property
    def lost(self) -> float:
        """Energy lost so far [J]."""
        return self._lost

    def slides(self, row: int, time: float, begins: bool) -> None:
        """Note that a point begins to slip, or sticks."""
        self.slips[self._contact_of[row]].append((time, begins))

    def parted(self, row: int) -> None:
        """End an impact whose force had vanished before."""
        if row in self._running:
            self.impacts[self._contact_of[row]].append(self._running.pop(row))
        self._slack.discard(row)

    def let_go(self, row: int, time: float, p: np.ndarray, v: np.ndarray) -> None:
        """A pressed surface that its dashpot keeps from pushing: what it stores is lost inside."""
        if row in self._running:
            self.leaves(row, time, float(self._system.rows[row] @ v))
        self._slack.add(row)
        gap = self._system.gap[row] + float(self._system.rows[row] @ p)
        self._lost += 0.5 * gap**2 / self._system.compliance[row, row]

    def returned(self, row: int, p: np.ndarray) -> None:
        """The same surface pushes again before it has come back to its place."""
        self._slack.discard(row)
        gap = self._system.gap[row] + float(self._system.rows[row] @ p)
        self._lost -= 0.5 * gap**2 / self._system.compliance[row, row]

    def outcome(self, p: np.ndarray, v: np.ndarray, multipliers: np.ndarray, counts: np.ndarray) -> Outcome:
        """Return where the run stands."""
        none, k = np.empty(0), max(1, len(self._system.contacts))
        for row, entry in self._running.items():
            if row in self._slack:
                continue
            entry[1] = max(entry[1], self._from)
            entry[6] = float(self._system.rows[row] @ v)
        running: list[list[list[float]]] = [list(entries) for entries in self.impacts]
        for row, entry in self._running.items():
            running[self._contact_of[row]].append(list(entry))
        return Outcome(
            p, v, multipliers, self._impulses.copy(), self._extreme.copy(), counts, none, none, np.zeros(k),
            impacts=[np.array(sorted(entries)).reshape(-1, 7) for entries in running], drags=self._drags.copy(),
            springs=self._pulls.copy(),
            slips=[list(entries) for entries in self.slips],
        )  # fmt: skip


def _pressed_energy(u: np.ndarray, regime: Regime, springs: int) -> np.ndarray:
    """Return what closed compliant contacts store at displacements (t, n), (t,)."""
    soft = len(regime.linear.rows) - springs
    gaps = regime.linear.offsets[:soft] + u @ regime.linear.rows[:soft].T
    return 0.5 * np.einsum("ti,ij,tj->t", gaps, regime.linear.springs[:soft, :soft], gaps)


def _lines(system: System, directions: np.ndarray) -> np.ndarray:
    """Return the unit vector of each row's friction, (c, 3)."""
    lines = np.zeros_like(directions)
    for item in system.contacts:
        friction = system.scene.contact[item.name].friction
        if friction is not None:
            line = np.asarray(friction.direction, float)
            lines[item.rows] = line / np.linalg.norm(line)
    return lines
