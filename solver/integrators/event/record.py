"""Record of a run between located events: histories, impacts, energy and impulse balances."""

import numpy as np
from scipy import optimize

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.event.impacts import ContactImpacts
from gudgeon.solver.integrators.event.jumps import Impact
from gudgeon.solver.integrators.event.motion import Course, Probe
from gudgeon.solver.integrators.event.regimes import Conditions, Regime, Status
from gudgeon.solver.integrators.event.search import PER_RADIAN
from gudgeon.solver.integrators.event.segment import Segment
from gudgeon.solver.integrators.outcome import (
    ENERGY_ERROR,
    EXCHANGED,
    START_ENERGY,
    Outcome,
    Samples,
)
from gudgeon.solver.system.system import System

NOTHING = 1e-9
"""Least exchanged energy as a share of all energies, for runs in which no contact exchanges any."""
PANELS = 2000
"""Panels of a dissipation integral that are evaluated at once."""
MOST_PANELS = 10**7
"""Panels of a motion between two events, about a minute."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)


class Record:
    """Impulses, energies and impacts, from the functions of time of the motion and not from the states at its ends."""

    def __init__(self, system: System) -> None:
        self._system = system
        c, k, springs = len(system.rows), len(system.contacts), system.springs
        self._rows, self._yields = system.rows.dense(), system.compliance.diagonal()
        self._impulses, self._drags, self._pulls = np.zeros(c), np.zeros(c), np.zeros(len(springs.stiffness))
        self._tension = Probe.of(
            springs.stiffness * springs.stretch,
            springs.stiffness[:, None] * springs.rows,
            springs.damping[:, None] * springs.rows,
        )
        self.lost = 0.0
        """Energy lost so far [J]."""
        self._driven = 0.0  # Work of moving obstacles by friction so far [J].
        self._rubbed = np.zeros(c)  # Energy that friction of each row took [J].
        self._start = (system.position.copy(), system.velocity.copy())
        energy = float(self._energies(*(a[None] for a in self._start))[0, :3].sum()) + system.start_contact_energy
        self._extreme = np.array([energy, 0.0, 0.0, 0.0])
        self._contact_of, self._directions, self._lines = system.contact_of, system.directions, system.friction_lines
        self._contacts = [ContactImpacts(system.separation, float(window)) for window in system.windows]
        self.at_zero: set[int] = set()
        """Rows whose gaps are zero since the start of the run."""
        self._slips: list[list[tuple[float, bool]]] = [[] for _ in range(k)]
        self._done = 0
        self._pending: list[np.ndarray] = []

    # Histories

    def open_samples(self, ends: np.ndarray, interval: float, out: Samples) -> None:
        """Set the arrays for the samples of a frame, which end at `ends` [s]."""
        self._ends, self._interval, self._out = ends, interval, out
        out.forces[:] = 0.0
        for impulse in self._pending:
            np.add.at(out.forces[0], self._contact_of, impulse / interval)
        self._pending = []
        self._states: list[tuple[np.ndarray, ...]] = []
        self._done, self._from = 0, float(ends[0]) - interval

    def add_segment(self, segment: Segment, until: float) -> None:
        """Add the motion from the last recorded time to `until` [s] to the histories."""
        start = max(self._from, segment.start)
        if until < start:
            return
        ends = self.waiting()
        sample_times = ends[ends <= until]
        edges = np.unique(np.concatenate([[start], sample_times, [until]])) - segment.start
        course, driven = segment.motion.course(segment.regime.forces), np.zeros(len(edges))
        if any(map(np.any, (course.a, course.A, course.b, course.c))):
            drag = np.diff(segment.motion.course(segment.regime.tangential).integral(edges), axis=0)
            driven[1:] = np.cumsum(drag @ self._system.belt)
            self.add_impulses(edges + segment.start, np.diff(course.integral(edges), axis=0), drag)
            for i, item in enumerate(self._system.contacts):
                if self._contacts[i].touching:
                    self._locate(i, course[item.rows], edges, segment.start)
        if len(self._pulls) and edges[-1] > edges[0]:
            tension = Probe(self._tension.matrix.copy())
            tension.constant[:] = self._tension(segment.motion.start, np.zeros_like(segment.motion.v))
            tension = segment.motion.course(tension)
            self.add_spring_impulses(np.diff(tension.integral(edges[[0, -1]]), axis=0)[0])
        dissipated = np.concatenate([[0.0], np.cumsum(self._dissipate(segment, edges))])
        sample_edges = np.searchsorted(edges, sample_times - segment.start)
        if len(sample_times):
            u, v = segment.motion.displacements(sample_times - segment.start)
            forces = segment.regime.forces(u, v)
            stored = _pressed_energy(u, segment.regime, len(self._pulls))
            belts = self._driven + driven[sample_edges]
            self.states(segment.motion.start + u, v, stored, self.lost + dissipated[sample_edges], forces, belts)
        self.lost += float(dissipated[-1])
        self._driven += float(driven[-1])
        self._from = until

    def add_impulses(self, edges: np.ndarray, normal: np.ndarray, drag: np.ndarray) -> None:
        """Add impulses of each row to the histories.

        Args:
            edges: Times [s], among them the ends of all samples between the first and the last, (t + 1,).
            normal, drag: Normal and tangential impulse between them [N s], (t, c).
        """
        forces = self._out.forces
        self._impulses += normal.sum(axis=0)
        self._drags += drag.sum(axis=0)
        sample = np.searchsorted(self._ends, edges[1:] - 1e-12 * self._interval)
        sample = np.minimum(sample, len(forces) - 1)
        for row in np.flatnonzero(np.abs(normal).sum(axis=0) > 0):
            impulse = normal[:, row, None] * self._directions[row] + drag[:, row, None] * self._lines[row]
            np.add.at(forces[:, self._contact_of[row]], sample, impulse / self._interval)

    def _locate(self, contact_id: int, course: Course, edges: np.ndarray, start: float) -> None:
        """Add the course of a contact's force to its present impact, and look for the largest force [N]."""
        t0, t1 = float(edges[0]), float(edges[-1])
        if t1 <= t0:
            return
        contact, directions = self._contacts[contact_id], self._directions[self._system.contacts[contact_id].rows]
        fastest = float(np.abs(course.exponents).max()) if len(course.exponents) else 0.0
        count = min(int(np.ceil(PER_RADIAN * fastest * (t1 - t0))) + 2, 200_000)
        time = np.linspace(t0, t1, count)
        force = course.values(time) @ directions
        if self._system.separation > 0:
            impulse = course.integral(time) @ directions
            contact.presses(time + start, impulse - impulse[0], force)
        else:
            impulse = course.integral(edges[[0, -1]]) @ directions
            contact.presses(edges[[0, -1]] + start, impulse - impulse[0], force[[0, -1]])
        size = np.sqrt((force**2).sum(axis=1))
        peak = int(size.argmax())
        best, when = float(size[peak]), float(time[peak])

        def growth(moment: float) -> float:
            t = np.array([moment])
            return float((course.values(t) @ directions)[0] @ (course.rate.values(t) @ directions)[0])

        around = time[max(peak - 1, 0)], time[min(peak + 1, count - 1)]
        if best > 0.9 * contact.peak and growth(around[0]) > 0 > growth(around[1]):
            when = optimize.brentq(growth, *around, xtol=1e-300, rtol=1e-14)
            best = float(np.linalg.norm(course.values(np.array([when])) @ directions))
        contact.note_peak(best, when + start)

    def _dissipate(self, segment: Segment, edges: np.ndarray) -> np.ndarray:
        """Return the energy [J] that dashpots and friction take between edges [s], (t + 1,), (t,).

        Integrated over panels of about one radian of the fastest oscillator.
        """
        system, regime = self._system, segment.regime
        dissipated = np.zeros(len(edges) - 1)
        sliding = np.any(regime.tangential.matrix)
        if not np.any(regime.linear.dampers) and not sliding:
            return dissipated
        spans, panels = np.diff(edges), _panels(segment, edges)
        ends = np.cumsum(panels)
        for block in range(0, int(ends[-1]) if len(ends) else 0, PANELS):
            numbers = np.arange(block, min(block + PANELS, ends[-1]))
            owner = np.searchsorted(ends, numbers, side="right")
            width = (spans / panels)[owner]
            start = edges[owner] + width * (numbers - (ends - panels)[owner])
            time = (start[:, None] + width[:, None] * 0.5 * (1 + NODES)).ravel()
            u, v = segment.motion.displacements(time)
            power = ((v @ regime.linear.rows.T) ** 2) @ regime.linear.dampers
            if sliding:
                rubbed = -regime.tangential(u, v) * (v @ system.tangents.T - system.belt)
                power = power + rubbed.sum(axis=1)
                self._rubbed += (0.5 * width[:, None] * WEIGHTS).ravel() @ rubbed
            np.add.at(dissipated, owner, 0.5 * width * (power.reshape(-1, len(NODES)) @ WEIGHTS))
        return dissipated

    def states(
        self,
        p: np.ndarray,
        v: np.ndarray,
        contact: np.ndarray,
        dissipated: np.ndarray,
        forces: np.ndarray,
        driven: np.ndarray | float = 0.0,
    ) -> None:
        """Fill the next samples.

        Args:
            p, v: States at their ends, (t, n).
            contact, lost: Energy stored in contacts, and lost so far [J], (t,).
            forces: Contact forces [N], (t, c).
            driven: Work of moving obstacles by friction so far [J], (t,).
        """
        span = slice(self._done, self._done + len(p))
        energies = self._energies(p, v)
        energies[:, 2], energies[:, 3] = contact, dissipated
        energies[:, 4] += driven
        self._out.energies[span] = energies
        self._balance(p, v, energies)
        self._out.set_states(span, self._system, p, v, forces)
        self._states.append((p, v, forces))
        self._done += len(p)

    def keep_peaks(self) -> None:
        """Keep the largest forces of the samples that are now filled."""
        if self._states:
            states = (np.concatenate(columns)[: self._done] for columns in zip(*self._states, strict=True))
            before = round(float(self._ends[0]) / self._interval) - 1
            self._out.peaks.keep_highest(before, self._out.forces[: self._done], *states)

    def waiting(self) -> np.ndarray:
        """Return the ends of the samples that are not filled yet [s], (t,)."""
        return self._ends[self._done :]

    # Balances

    def add_spring_impulses(self, impulses: np.ndarray) -> None:
        """Add impulses of springs [N s], (b,)."""
        self._pulls += impulses

    def _energies(self, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return kinetic and strain energy, no contact energy, energy lost, work of gravity [J] of states, (t, 5)."""
        system, springs = self._system, self._system.springs
        stretch = springs.stretch + p @ springs.rows.T
        strain = 0.5 * ((p**2) @ system.stiffness + (stretch**2) @ springs.stiffness)
        work = (p - self._start[0]) @ system.driving.gravity
        kinetic = 0.5 * (v**2).sum(axis=1)
        return np.column_stack([kinetic, strain, np.zeros(len(p)), np.full(len(p), self.lost), work])

    def _balance(self, p: np.ndarray, v: np.ndarray, energies: np.ndarray) -> None:
        """Update the largest error of the energy balance, and the largest exchange [J]."""
        system, extreme = self._system, self._extreme
        error = np.abs(energies[:, :4].sum(axis=1) - energies[:, 4] - extreme[START_ENERGY])
        extreme[ENERGY_ERROR] = max(extreme[ENERGY_ERROR], float(error.max()))
        gravity, start = system.driving.gravity, self._start
        gained = 0.5 * (v**2 - start[1] ** 2) - (p - start[0]) * gravity
        rigid = gained[:, system.rigid]
        elastic = gained.sum(axis=1) - rigid.sum(axis=1) + energies[:, 1]
        swing = 0.5 * (np.abs(rigid).sum(axis=1) + np.abs(elastic) + energies[:, 2])
        # Without any exchange, round-off of the energies would be compared with itself.
        round_off = NOTHING * np.abs(energies).sum(axis=1)
        extreme[EXCHANGED] = max(extreme[EXCHANGED], float(swing.max()), float(round_off.max()))

    # Impacts

    def touches(self, row: int, time: float, closing: float) -> None:
        """Begin an impact of a row at a closing speed [m/s], unless it has one already."""
        contact = self.contact(row)
        if row not in contact.touching:
            # The energy of closing, since no sample may fall into the contact.
            square = float(self._rows[row] @ self._rows[row])
            energy = 0.25 * closing**2 / square if square > 0 else 0.0
            self._extreme[EXCHANGED] = max(self._extreme[EXCHANGED], energy)
        contact.touches(row, time, closing)

    def contact(self, row: int) -> ContactImpacts:
        """Return the impacts of a row's contact."""
        return self._contacts[self._contact_of[row]]

    def parts(self, row: int, time: float, v: np.ndarray) -> None:
        """Let a row part at a time [s]."""
        self.contact(row).leaves(row, time, float(self._rows[row] @ v))
        self.contact(row).parts(row)

    def impact(self, impact: Impact, time: float, v: np.ndarray, state: Conditions) -> None:
        """Add velocity jumps; rows that do not remain closed have completed their impacts."""
        self._impulses += impact.impulses
        self._drags += impact.tangential
        self.lost += impact.lost
        self._driven += impact.driven
        self._rubbed += impact.rubbed
        self._extreme[EXCHANGED] = max(self._extreme[EXCHANGED], impact.compressed)
        impulse = impact.impulses[:, None] * self._directions + impact.tangential[:, None] * self._lines
        if time > 0:
            sample = min(int(np.searchsorted(self._ends, time * (1 - 1e-15))), len(self._ends) - 1)
            np.add.at(self._out.forces[sample], self._contact_of, impulse / self._interval)
        else:
            self._pending.append(impulse)
        normal = impact.impulses[:, None] * self._directions
        for item, contact in zip(self._system.contacts, self._contacts, strict=True):
            if impact.impulses[item.rows].any():
                contact.jumps(time, normal[item.rows].sum(axis=0))
            for row in [row for row in contact.touching if state.status[row] == Status.OPEN]:
                self.parts(row, time, v)

    def slides(self, row: int, time: float, begins: bool) -> None:
        """Record that a point begins to slip, or sticks, at a time [s]."""
        self._slips[self._contact_of[row]].append((time, begins))

    def let_go(self, row: int, time: float, p: np.ndarray, v: np.ndarray) -> None:
        """Record that a surface becomes slack: its dashpot balances its spring, whose energy is lost."""
        self.contact(row).leaves(row, time, float(self._rows[row] @ v))
        self.lost += self._stored(row, p)

    def returned(self, row: int, p: np.ndarray) -> None:
        """Record that a slack surface is in contact again before it has recovered: its energy is not lost."""
        self.contact(row).returns(row)
        self.lost -= self._stored(row, p)

    def _stored(self, row: int, p: np.ndarray) -> float:
        """Return the energy [J] in the spring of a row."""
        gap = self._system.gap[row] + float(self._rows[row] @ p)
        return 0.5 * gap**2 / self._yields[row]

    def impacts(self) -> list[np.ndarray]:
        """Return the impacts of each contact, (b, 9) each; the present ones end at the time reached."""
        return [contact.impacts(self._from) for contact in self._contacts]

    def outcome(self, p: np.ndarray, v: np.ndarray, multipliers: np.ndarray, counts: np.ndarray) -> Outcome:
        """Return the state and the totals so far."""
        return Outcome(
            q=p, v=v, multipliers=multipliers, impulses=self._impulses.copy(), extreme=self._extreme.copy(),
            counts=counts, drags=self._drags[:, None] * self._lines, springs=self._pulls.copy(),
            slips=[list(entries) for entries in self._slips],
            rubbed=np.array([self._rubbed[item.rows].sum() for item in self._system.contacts]),
        )  # fmt: skip


def _pressed_energy(u: np.ndarray, regime: Regime, springs: int) -> np.ndarray:
    """Return the energy [J] in closed compliant contacts at displacements (t, n), (t,)."""
    soft = len(regime.linear.rows) - springs
    gaps = regime.linear.offsets[:soft] + u @ regime.linear.rows[:soft].T
    return 0.5 * np.einsum("ti,ij,tj->t", gaps, regime.linear.springs[:soft, :soft], gaps)


def _panels(segment: Segment, edges: np.ndarray) -> np.ndarray:
    """Return the number of panels between edges [s], (t + 1,), of about a radian of the fastest oscillator each, (t,).

    Raises:
        SceneError: there are too many.
    """
    fastest = float(np.abs(segment.motion.exponents).max()) if len(segment.motion.exponents) else 0.0
    radians = fastest * float(edges[-1] - edges[0])
    if radians > MOST_PANELS:
        raise SceneError(
            f"run.duration: {edges[-1] - edges[0]:.3g} s of damped motion without an event are {radians:.3g} rad of its"
            f" fastest oscillation, {fastest:.3g} rad/s; integrator 'event' sums what dampers take over up to"
            f" {MOST_PANELS:.0e} rad; allowed: a shorter duration, fewer modes, or run.integrator = 'small'"
        )
    return np.maximum(1, np.ceil(fastest * np.diff(edges))).astype(int)
