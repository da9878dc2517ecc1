"""When sections touch and part: contact begins and ends with steps, and its impacts are kept.

Steps are smooth because a section presses either throughout a step or not at all: a step within which one touches or
parts is taken again, to that time. It is located on the interpolation of the step.
"""

from collections.abc import Callable, Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from gudgeon.modaldb.records.trajectory import (
    BEGINS,
    CLOSING,
    ENDS,
    IMPACT_COLUMNS,
    IMPULSE,
    OPENING,
    PEAK,
    PEAK_TIME,
    WINDOWED,
)
from gudgeon.solver import core
from gudgeon.solver.integrators.turning.arrays import (
    DRAG_PUSH,
    NORMAL_PUSH,
    PLACE,
    SURFACE,
    WIDTH,
    Model,
    Work,
    pushes_of,
)
from gudgeon.solver.integrators.turning.touching.columns import DEPTH, FORCE, NORMAL, OVER, RATE
from gudgeon.solver.integrators.turning.touching.cone import Cones, polynomial
from gudgeon.solver.integrators.turning.touching.track import Track
from gudgeon.solver.integrators.turning.touching.worn import BEARING, Rubbed, WornSection, offsets

LOOKS = 8
"""Times of a step at which sections are looked at, evenly spaced: so many times less may a contact last unnoticed."""
AT_ONE_TIME = 1e-14
"""Difference of times over the time within which they are one."""
AT_ONCE = 1e-6
"""Indentation over `Surfaces.deep` at which no point can be that touched just now."""
SHIFT = 1e-14
"""Indentation at which a contact begins, over the clearance of a journal or the size of the mechanism."""

NONE_WORN: Mapping[int, WornSection] = MappingProxyType({})
At = Callable[[float], np.ndarray]
"""State at a time of the last step [s]."""


class Event(NamedTuple):
    """A section touches or parts, or, pressed, begins to slip or to stick."""

    time: float
    """[s]"""
    section: int
    turns: bool = False
    """Between slip and stick."""


class Left(NamedTuple):
    """A point that left the surface of another body with a force, or came onto it from the side, below it."""

    section: int
    time: float
    """[s]"""
    place: np.ndarray
    """[m], (3,)."""
    pressed: bool


class Touching:
    """Which sections press, and their impacts so far."""

    def __init__(
        self,
        model: Model,
        work: Work,
        tracks: list[Track],
        size: float,
        *,
        worn: Mapping[int, WornSection] = NONE_WORN,
    ) -> None:
        """
        Args:
            tracks: Of the contacts with obstacles.
            size: Of the mechanism [m].
            worn: Sections that wear.
        """
        self._model, self._work, c = model, work, len(model.touch_pair)
        self._turning = core.Turning(model, work)
        self.impacts: list[list[np.ndarray]] = [[] for _ in range(c)]
        self.deepest = 0.0
        self.tracks = tracks
        self.slipped = work.slipping.copy()
        """Which sections slipped in the last step."""
        self.pressed = work.touching.copy()
        """Which pressed in it."""
        self.left: Left | None = None
        self.rubbed = {section: Rubbed(wear) for section, wear in worn.items()}
        """What rubs off sections that wear."""
        self._impulse = np.zeros(c)
        self._cones = Cones(model, work, LOOKS + 1)
        self._turned: dict[int, float] = {}
        self._scale = np.where(model.touch_size[:, 0] > 0, model.touch_size[:, 0], size)

    def __bool__(self) -> bool:
        return len(self._work.touching) > 0

    def begin(self, state: np.ndarray) -> None:
        """Let press what is indented at the start; its contact began at rest, without the loss of an impact."""
        for i in np.flatnonzero(self._looked(state)[:, DEPTH] > 0):
            self._close(int(i), 0.0, state, 0.0)

    def depths(self, state: np.ndarray) -> np.ndarray:
        """Return the indentations of all sections in a state [m], (c,)."""
        return self._looked(state)[:, DEPTH]

    def _looked(self, state: np.ndarray) -> np.ndarray:
        """Return what all sections do in a state, (c, 16)."""
        self._turning.observe(state)
        return self._work.touch.copy()

    def first(self, state_at: At, before: float, after: float) -> Event | None:
        """Return what happens first between the times before and after a step [s]; None if nothing does.

        Peaks of forces within the step, up to then, are kept.
        """
        times = np.linspace(before, after, LOOKS + 1)
        states = np.array([state_at(time) for time in times])
        looks = np.array([self._looked(state) for state in states])
        depths, pressing = looks[:, :, DEPTH], self._work.touching.astype(bool)
        # A section that presses began this step indented, and one that does not began it free, up to round-off.
        indented = depths > 0
        indented[0] = pressing
        changes = indented[1:] != indented[:-1]
        events = [
            Event(self._located(state_at, int(i), times[k : k + 2]), int(i))
            for i in np.flatnonzero(changes.any(axis=0))
            for k in [int(changes[:, i].argmax())]
        ]
        events += self._grazed(state_at, times, looks)
        events += self._turns(times, looks)
        earliest = min(events, default=None)
        until = after if earliest is None else earliest.time
        self._watch_borders(state_at, times[times <= until], looks, earliest)
        self._note_peaks(times, looks, until)
        self._note_tracks(times, looks, states, until)
        return earliest

    def _watch_borders(self, state_at: At, times: np.ndarray, looks: np.ndarray, event: Event | None) -> None:
        """Find a point that presses and is beside its surface, or that touches it from beside."""
        between = self._model.touch_shape == SURFACE
        if not between.any():
            return
        pressing = self._work.touching != 0
        off_surface = np.argwhere((looks[: len(times), :, OVER] == 0) & between & pressing)
        if len(off_surface):
            k, i = map(int, off_surface[0])
            self.left = Left(i, float(times[k]), self._place(state_at(float(times[k])), i), pressed=True)
        elif event is not None and not event.turns and between[event.section]:
            state, i = state_at(event.time), event.section
            # Where it touches or parts its indentation is zero, unless it crosses a border.
            if abs(self._looked(state)[i, DEPTH]) > AT_ONCE * self._model.surfaces.deep.min():
                self.left = Left(i, event.time, self._place(state, i), pressed=bool(pressing[i]))

    def _place(self, state: np.ndarray, section: int) -> np.ndarray:
        """Return where a point before another body is [m], (3,)."""
        self._looked(state)
        f = self._model.surfaces
        p = section - (len(self._model.touch_pair) - len(f.arm))
        s = int(np.flatnonzero((f.points[:, 0] <= p) & (p < f.points[:, 1]))[0])
        start = WIDTH * int(f.owner[s, 0]) + PLACE
        return np.asarray(state[start : start + 3] + self._work.pressing.arm[p, 0])

    def _turns(self, times: np.ndarray, looks: np.ndarray) -> list[Event]:
        """Return when sections that press begin to slip or to stick: where their margin first falls below zero."""
        events = []
        for i, margins in self._cones.margins(looks, float(times[-1] - times[0])).items():
            # It began this step above zero, up to round-off.
            if not len(below := np.flatnonzero(margins[1:] < 0)):
                continue
            k, time = int(below[0]), float(times[0])
            if margins[k] > 0:
                ends = k / LOOKS, (k + 1) / LOOKS
                fraction = brentq(
                    lambda x, coefficients=margins: polynomial(coefficients, x), *ends, xtol=1e-15, rtol=8.9e-16
                )
                time += float(fraction) * float(times[-1] - times[0])
            # Not twice at one time, up to round-off.
            if (k > 0 and margins[k] <= 0) or time <= self._turned.get(i, -np.inf) + AT_ONE_TIME * abs(time):
                time = float(times[k + 1])
            events.append(Event(time, i, turns=True))
        return events

    def rub(self, state_at: At, before: float, after: float) -> None:
        """Add what rubs off between the times before and after an accepted step [s]."""
        pressing = [
            (i, rubbed) for i, rubbed in self.rubbed.items() if self._work.touching[i] and rubbed.worn.after < after
        ]
        for after_begin in sorted({max(before, rubbed.worn.after) for _, rubbed in pressing}):
            times = np.linspace(after_begin, after, LOOKS + 1)
            active = [(i, rubbed) for i, rubbed in pressing if max(before, rubbed.worn.after) == after_begin]
            rubbings = [self._rubbing(state_at(float(time)), active) for time in times]
            for k, (_, rubbed) in enumerate(active):
                for bearing_offsets, depth, _, forces in rubbings:
                    rubbed.note(float(forces[k]), bearing_offsets[k, BEARING], float(depth[k]))
                for (x, depth, sums, _), (y, deeper, later_sums, _) in pairwise(rubbings):
                    impulse, work = later_sums[k] - sums[k]
                    ends, depths = np.array([x[k], y[k]]), np.array([depth[k], deeper[k]])
                    rubbed.add(ends, depths, float(impulse), float(work))

    @property
    def worn_through(self) -> bool:
        """Whether the wear of a section exceeds its wall."""
        return any(section.through for section in self.rubbed.values())

    def overloaded(self, loads: Mapping[int, float]) -> int | None:
        """Return the first section whose present force has exceeded its load [N]; None if none has."""
        pressing = (i for i in loads if self._work.touching[i])
        return next((i for i in pressing if self.impacts[i][-1][PEAK] > loads[i]), None)

    def _rubbing(self, state: np.ndarray, sections_rubbed: list[tuple[int, Rubbed]]) -> tuple[np.ndarray, ...]:
        """Return offsets (k, 2, 2), indentations (k,), integrals of force and of its work of sliding (k, 2), forces."""
        self._turning.observe(state)
        sections = [i for i, _ in sections_rubbed]
        bearing_offsets = np.array([offsets(self._model, self._work, i) for i in sections])
        sums = pushes_of(state, len(self.impacts))[sections, :2]
        return bearing_offsets, self._work.touch[sections, DEPTH].copy(), sums, self._work.touch[sections, FORCE].copy()

    def _grazed(self, state_at: At, times: np.ndarray, looks: np.ndarray) -> list[Event]:
        """Return when free sections touch which are free again at the next look: where they are deepest in between."""
        approaching, free = looks[:, :, RATE] > 0, looks[:, :, DEPTH] <= 0
        turns = approaching[:-1] & ~approaching[1:] & free[:-1] & free[1:]
        events = []
        for k, i in np.argwhere(turns & (self._work.touching == 0)):
            deepest = self._deepest(state_at, int(i), times[k : k + 2])
            if self._looked(state_at(deepest))[i, DEPTH] > 0:
                events.append(Event(self._located(state_at, int(i), np.array([times[k], deepest])), int(i)))
        return events

    def _deepest(self, state_at: At, section: int, span: np.ndarray) -> float:
        """Return when a section is deepest, between two times at which it approaches and leaves [s]."""

        def rate(time: float) -> float:
            return float(self._looked(state_at(time))[section, RATE])

        return float(brentq(rate, *span, xtol=1e-15 * max(abs(float(span[1])), 1e-300), rtol=8.9e-16))

    def _note_tracks(self, times: np.ndarray, looks: np.ndarray, states: np.ndarray, until: float) -> None:
        """Keep forces and impulses of contacts that press, up to a time, and the deepest indentation of all."""
        until_event = times <= until * (1 + 1e-15)
        impulses = pushes_of(states, len(self.impacts))[:, :, NORMAL_PUSH:DRAG_PUSH]
        for track in self.tracks:
            sections = track.sections
            track.watch(
                times[until_event], -looks[until_event][:, sections, DEPTH], -looks[until_event][:, sections, RATE]
            )
            if not self._work.touching[sections].any():
                continue
            forces = -(looks[:, sections, FORCE, None] * looks[:, sections, NORMAL : NORMAL + 3]).sum(axis=1)
            track.add(times[until_event], forces[until_event], impulses[until_event][:, sections].sum(axis=1))
            self.deepest = max(self.deepest, float(looks[until_event][:, sections, DEPTH].max()))

    def _mark(self, section: int, state: np.ndarray, time: float) -> None:
        """Keep force and impulse of the contact of a section as it begins or ends."""
        for track in self.tracks:
            if section in track.sections:
                look = self._looked(state)[track.sections]
                force = -(look[:, FORCE, None] * look[:, NORMAL : NORMAL + 3]).sum(axis=0)
                impulse = pushes_of(state, len(self.impacts))[track.sections, NORMAL_PUSH:DRAG_PUSH].sum(axis=0)
                track.add(np.array([time]), force[None], impulse[None])

    def _located(self, state_at: At, section: int, span: np.ndarray) -> float:
        """Return the time between two looks at which a section touches or parts [s]."""

        def depth(time: float) -> float:
            return float(self._looked(state_at(time))[section, DEPTH])

        ends = [depth(float(time)) for time in span]
        if ends[0] * ends[1] >= 0:  # Within round-off of its touching at the beginning of the step.
            rates = [float(self._looked(state_at(float(time)))[section, RATE]) for time in span]
            dips = self._work.touching[section] and rates[0] > 0 > rates[1]
            deepest = self._deepest(state_at, section, span) if dips else float(span[0])
            if not (dips and depth(deepest) > 0):
                return float(span[0])
            span = np.array([deepest, span[1]])  # In and out again before the first look.
        return float(brentq(depth, *span, xtol=1e-15 * max(abs(float(span[1])), 1e-300), rtol=8.9e-16))

    def _note_peaks(self, times: np.ndarray, looks: np.ndarray, until: float) -> None:
        """Keep the largest forces up to a time, by parabolas through the looks beside the largest."""
        until_event = times <= until * (1 + 1e-15)
        for i in np.flatnonzero(self._work.touching):
            forces = looks[until_event, i, FORCE]
            peak = int(forces.argmax())
            value, when = float(forces[peak]), float(times[peak])
            if 0 < peak < len(forces) - 1:
                rise, fall = value - float(forces[peak - 1]), value - float(forces[peak + 1])
                if rise + fall > 0:
                    shift = 0.5 * (rise - fall) / (rise + fall)
                    when += shift * float(times[1] - times[0])
                    value += 0.25 * (rise - fall) * shift
            impact = self.impacts[i][-1]
            if value > impact[PEAK]:
                impact[PEAK], impact[PEAK_TIME] = value, when

    def switch(self, event: Event, state: np.ndarray) -> None:
        """Let a section press from an event on, or no longer; or slip or stick. The deflection in the state follows."""
        i = event.section
        look = self._looked(state)[i]
        if event.turns:
            self._cones.turn(i, look, state)
            self._turned[i] = event.time
            return
        if not self._work.touching[i]:
            self._close(i, event.time, state, float(look[RATE]))
            self._work.shift[i] = max(0.0, -float(look[DEPTH])) + SHIFT * self._scale[i]
            self._cones.begin(i, self._looked(state)[i], state)
            return
        impact = self.impacts[i][-1]
        impact[ENDS], impact[OPENING] = event.time, -look[RATE]
        impact[IMPULSE] = self._pushed(i, state) - self._impulse[i]
        self._mark(i, state, event.time)
        self._work.touching[i] = False
        self._cones.end(i, state)

    def _close(self, i: int, time: float, state: np.ndarray, rate: float) -> None:
        impact = np.full(IMPACT_COLUMNS, np.nan)
        impact[[BEGINS, CLOSING, PEAK, PEAK_TIME, WINDOWED]] = time, rate, 0.0, time, 0.0
        self.impacts[i].append(impact)
        self._impulse[i] = self._pushed(i, state)
        self._work.touching[i], self._work.approach[i] = True, max(rate, 0.0)
        self._mark(i, state, time)

    def _pushed(self, i: int, state: np.ndarray) -> float:
        """Return the integral of a section's force since the start [N s]."""
        return float(pushes_of(state, len(self.impacts))[i, 0])

    def of_sections(self, sections: np.ndarray, state: np.ndarray, time: float) -> np.ndarray:
        """Return the impacts of some sections up to a time, as `Trajectory.impacts`, (b, 9), sorted by their begins.

        Args:
            state: At this time.
        """
        every = []
        for i in sections:
            for impact in self.impacts[int(i)]:
                complete = impact.copy()
                if np.isnan(complete[ENDS]):  # It still presses.
                    complete[ENDS], complete[IMPULSE] = time, self._pushed(int(i), state) - self._impulse[i]
                every.append(complete)
        return np.array(sorted(every, key=lambda impact: float(impact[BEGINS]))).reshape(-1, IMPACT_COLUMNS)

    def of_contact(self, track: Track, state: np.ndarray, time: float, separation: float, window: float) -> np.ndarray:
        """Return the impacts of a contact up to a time, (b, 9); those separated by less than a time [s] are one."""
        return track.impacts(self.of_sections(track.sections, state, time), separation, window)
