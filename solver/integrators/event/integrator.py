"""The event integrator: exact motion from event to event, independent of the samples."""

from collections.abc import Mapping

import numpy as np

from gudgeon.solver import capabilities
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.integrators.event import basis
from gudgeon.solver.integrators.event.jumps import (
    HOP,
    RESTING,
    collide,
    force_scale,
    gaps_of,
    settle,
    settle_slip,
    struck,
)
from gudgeon.solver.integrators.event.motion import Motion
from gudgeon.solver.integrators.event.record import Record
from gudgeon.solver.integrators.event.regimes import Equations, Regime, Status, Watch, acceleration, at_start
from gudgeon.solver.integrators.event.segment import Segment, segment
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System

MOST_EVENTS = 2_000_000
"""Largest number of events in a run, above which it ends as chatter."""
GAIN = 1e-9
"""Energy that an impact may create by round-off, relative to the energy of its compression."""
ROUND_OFF = 16 * float(np.finfo(float).eps)
"""The same relative to the kinetic energy: surfaces that slide and close at a speed of round-off are not compressed."""
STALLED = 200
"""Largest number of events in a row without time between them."""
CACHED = 64
"""Bases that are kept, since conditions recur."""


class Event(capabilities.Event):
    """A run of the event integrator, sampled at the interval `dt` [s]."""

    def __init__(self, system: System, dt: float) -> None:
        _refuse_shared_friction(system)
        if np.any(system.dashpot) and system.coupled:
            name = next(item.name for item in system.contacts if np.any(system.dashpot[item.rows]))
            raise SceneError(
                f"contact.{name}: dashpots, of its law or 'wave-guide', need contact points that are not coupled"
                " through R; use contacts of one point, or method 'penalty'"
            )
        self._system, self._equations, self._dt = system, Equations(system), dt
        self._p, self._v = system.position.copy(), system.velocity.copy()
        self._last = system.scene.run.duration * (1 + 1e-9)
        self._fastest = np.zeros(len(system.gap))
        self._bases: dict[bytes, basis.Basis] = {}
        self._patient: set[tuple[Watch, int]] = set()
        self._reclosed = False
        self._struck: set[int] = set()
        self._hopped: set[int] = set()
        self._gained = False
        self._events = self._stall = self._regimes = 0
        self._record = Record(system)
        self.failure = Result.DIVERGED
        self._now = at_start(system)
        try:
            self._segment = self._begin(0.0)
        except np.linalg.LinAlgError as error:
            raise SolverError(f"contact {', '.join(system.scene.contact)}: {_reason(error).value}") from None

    def advance(self, start_step: int, stride: int, out: Samples) -> bool:
        """Fill all but the loads of samples of `stride` intervals; False where the motion has no solution."""
        ends = (start_step + stride * np.arange(1, len(out.forces) + 1)) * self._dt
        self._record.open_samples(ends, stride * self._dt, out)
        while True:
            segment = self._segment
            until = min(segment.end, float(ends[-1]))
            self._record.add_segment(segment, until)
            if segment.end > ends[-1]:
                break
            if segment.event is None and segment.end >= self._last:
                break
            if not self._pass(segment):
                return False
        self._record.keep_peaks()
        self._p, self._v = segment.motion.state(float(ends[-1]) - segment.start)
        self._time = float(ends[-1])
        return True

    def impacts(self) -> list[np.ndarray]:
        return self._record.impacts()

    def outcome(self) -> Outcome:
        segment = self._segment
        multipliers = segment.regime.forces(self._p - segment.motion.start, self._v)
        return self._record.outcome(self._p, self._v, multipliers, np.array([0, self._events, self._regimes, -1]))

    def state(self) -> None:
        """Return None: its marches are repeated from their start where they were stopped."""

    def resume(self, stored: Mapping[str, np.ndarray]) -> None:
        """Not called, since there is no state."""

    def _pass(self, segment: Segment) -> bool:
        """Handle the event at the end of a segment; False where the run cannot continue."""
        assert segment.event is not None
        kind, row = segment.event
        self._p, self._v = segment.motion.state(segment.end - segment.start)
        self._events += 1
        self._stall = self._stall + 1 if segment.end - segment.start <= 0 else 0
        if self._events > MOST_EVENTS or self._stall > STALLED:
            self.failure = Result.CHATTER
            return False
        try:
            if segment.end - segment.start > HOP * self._system.shortest_period:
                self._hopped.clear()
            self._react(kind, row, segment.end)
            self._segment = self._begin(segment.end, (kind, row))
        except np.linalg.LinAlgError as error:
            self.failure = _reason(error)
            return False
        if self._gained:
            self.failure = Result.RESTITUTION
        return bool(np.isfinite(self._p).all()) and not self._gained

    def _react(self, kind: Watch, row: int, time: float) -> None:
        """Change the conditions, and the velocities where a rigid contact closes."""
        state, system, record = self._now, self._system, self._record
        if kind is Watch.CLOSES and system.rigid_contact[row]:
            self._collide(row, time)
        elif kind is Watch.CLOSES:
            self._reclosed = bool(state.status[row] == Status.SLACK)
            if self._reclosed:
                record.returned(row, self._p)
            else:
                record.touches(row, time, -float(self._equations.rows[row] @ self._v))
            state.status[row] = Status.CLOSED
        elif kind is Watch.LEAVES:
            state.status[row] = Status.OPEN
            record.contact(row).parts(row)
        elif kind is Watch.OPENS and (kind, row) in self._patient:
            # The mean force is zero; from now on the force itself is watched.
            self._patient.discard((kind, row))
        elif kind is Watch.OPENS:
            slack = system.dashpot[row] > 0 and not system.rigid_contact[row]
            state.status[row] = Status.SLACK if slack else Status.OPEN
            state.slip[row] = 0
            if slack:
                record.let_go(row, time, self._p, self._v)
            else:
                record.parts(row, time, self._v)
            settle(self._equations, state, self._p, self._v)
        else:
            state.slip[row] = {Watch.STICKS: 0, Watch.SLIPS_BACK: -1, Watch.SLIPS_AHEAD: 1}[kind]
            if kind is Watch.STICKS:
                settle_slip(self._equations, state, self._p, self._v, row)
            record.slides(row, time, bool(state.slip[row]))

    def _collide(self, row: int, time: float) -> None:
        """Change the conditions and velocities where a rigid contact closes."""
        state, record = self._now, self._record
        rows = struck(self._equations, state, row, self._p, self._v)
        for closing in rows:
            record.touches(int(closing), time, -float(self._equations.rows[closing] @ self._v))
        self._reclosed = False
        kinetic = 0.5 * float(self._v @ self._v)
        impact = collide(self._equations, state, rows, self._v, self._fastest, self._hopped)
        self._hopped.update(map(int, rows))
        settle(self._equations, state, self._p, self._v)
        record.impact(impact, time, self._v, state)
        tolerance = GAIN * (abs(impact.lost) + impact.compressed) + ROUND_OFF * kinetic
        self._gained = self._gained or impact.lost < -tolerance
        self._struck = set(map(int, rows))
        if self._system.shortest_period > 0 and state.status[row] == Status.CLOSED:
            self._patient.add((Watch.OPENS, row))

    def _begin(self, start: float, after: tuple[Watch, int] | None = None) -> Segment:
        """Return the segment that starts at a time [s] under the present conditions."""
        if after is None:
            self._touch_at_start()
        state = self._now
        gaps, functions = self._zero(after)
        regime = self._equations.regime(state, self._p, gaps)
        key = state.key()
        if key not in self._bases:
            if len(self._bases) >= CACHED:
                self._bases.pop(next(iter(self._bases)))
            self._bases[key] = basis.solve(regime.linear)
            self._regimes += 1
        motion = Motion.begin(self._bases[key], regime.linear, self._p, self._v)
        course = motion.course(regime.watched)
        for k, event in enumerate(regime.events):
            if event in functions:
                course.a[k] = 0.0
        guarded = [i for i, event in enumerate(regime.events) if event in self._patient]
        course = course.averaged(guarded, self._system.shortest_period)
        return segment(start, motion, regime, course, self._last, floor=self._floor(regime))

    def _floor(self, regime: Regime) -> np.ndarray:
        """Return how far each watched force of a rigid row may fall below zero by round-off [N]."""
        scale = force_scale(acceleration(regime.linear), np.zeros_like(self._p), self._v, self._equations.rows)
        hard = [kind is Watch.OPENS and bool(self._system.rigid_contact[row]) for kind, row in regime.events]
        rows = [row for _, row in regime.events]
        return np.where(hard, RESTING * scale[rows], 0.0) if rows else np.empty(0)

    def _zero(self, after: tuple[Watch, int] | None) -> tuple[frozenset[int], frozenset[tuple[Watch, int]]]:
        """Return what is exactly zero after an event, but for round-off: gaps by row, and watched functions."""
        gaps, functions = set(self._record.at_zero) | self._struck | self._parting(), set[tuple[Watch, int]]()
        self._struck = set()
        if after is not None:
            kind, row = after
            soft = not self._system.rigid_contact[row]
            slack = self._now.status[row] == Status.SLACK
            if kind in (Watch.OPENS, Watch.LEAVES) or (kind is Watch.CLOSES and not self._reclosed):
                if not slack:
                    gaps.add(row)
                functions.add((Watch.CLOSES, row))
            if kind is Watch.CLOSES and soft and (self._reclosed or not self._system.dashpot[row]):
                functions.add((Watch.OPENS, row))
            if kind in (Watch.SLIPS_BACK, Watch.SLIPS_AHEAD, Watch.STICKS):
                functions.add((Watch.STICKS, row))
        functions |= {(Watch.CLOSES, row) for row in gaps}
        return frozenset(gaps), frozenset(functions)

    def _parting(self) -> set[int]:
        """Return the open rigid rows that part from a gap of round-off, which may be below zero."""
        system = self._system
        gaps, size = gaps_of(self._equations, self._p)
        touching = system.rigid_contact & (self._now.status == Status.OPEN) & (np.abs(gaps) <= ROUND_OFF * size)
        return {int(row) for row in np.flatnonzero(touching) if float(self._equations.rows[row] @ self._v) > 0}

    def _touch_at_start(self) -> None:
        """Close the rigid rows that touch at the start and approach or press."""
        system, state, rows = self._system, self._now, self._equations.rows
        gaps, size = gaps_of(self._equations, self._p)
        loaded = system.start_forces > 0
        touching = np.flatnonzero(system.rigid_contact & (loaded | (np.abs(gaps) <= 1e-14 * size)))
        speeds = rows @ self._v
        for row in touching:
            if speeds[row] < 0 and state.status[row] == Status.OPEN:
                self._react(Watch.CLOSES, int(row), 0.0)
        resting = [
            int(row) for row in touching
            if state.status[row] == Status.OPEN
            and abs(float(rows[row] @ self._v)) <= 1e-12 * float(np.abs(rows[row]) @ np.abs(self._v))
        ]  # fmt: skip
        for row in resting:
            state.status[row] = Status.CLOSED
        settle(self._equations, state, self._p, self._v)
        for row in sorted({*resting, *np.flatnonzero(loaded).tolist()}):
            if state.status[row] == Status.CLOSED:
                self._record.touches(row, 0.0, -float(speeds[row]))
        self._record.at_zero = {int(row) for row in touching}


def _reason(error: np.linalg.LinAlgError) -> Result:
    """Return the result of a run in which a regime has no basis."""
    return Result.INCOMPLETE if isinstance(error, basis.IncompleteError) else Result.DEPENDENT_ROWS


def _refuse_shared_friction(system: System) -> None:
    """Refuse friction at a point of a body that has other contacts, since impacts of several points have no friction.

    Raises:
        SceneError: there is such a point.
    """
    names = [item.name for item in system.contacts for _ in item.points]
    moved = system.rows.dense() != 0
    for row in np.flatnonzero(system.friction[:, 0] > 0):
        others = [k for k in range(len(names)) if k != row and np.any(moved[row] & moved[k])]
        if others:
            partner = f"contact '{names[others[0]]}'" if names[others[0]] != names[row] else "another point"
            raise SceneError(
                f"contact.{names[row]}.friction: the body has {partner} too, but friction needs a body with one contact"
                " point; remove friction, or use one point"
            )
