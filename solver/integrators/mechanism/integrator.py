"""Bodies that turn by any angle, held by joints: explicit or implicit steps with projection."""

import math
from functools import partial

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.capabilities import Mechanism as Capabilities
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.fields.co_energy import LEFT, left_text, refuse_outside
from gudgeon.solver.integrators.mechanism.arrays import (
    DEFLECTION,
    DRAG_PUSH,
    NORMAL_PUSH,
    PLACE,
    SPEED,
    SPIN,
    TURN,
    pushes_of,
)
from gudgeon.solver.integrators.mechanism.build import linkage_of, model_of, reach_of, work_of
from gudgeon.solver.integrators.mechanism.choice import Choice, lack_of
from gudgeon.solver.integrators.mechanism.constraints.dependence import Dependence
from gudgeon.solver.integrators.mechanism.energy import bodies_of, energies, modal_parts, motion_of, to_coordinates
from gudgeon.solver.integrators.mechanism.exponential.steps import ExponentialSteps, propagates
from gudgeon.solver.integrators.mechanism.flexible.range import deformed_text
from gudgeon.solver.integrators.mechanism.histories import Recorder, Sample
from gudgeon.solver.integrators.mechanism.implicit.steps import ImplicitSteps
from gudgeon.solver.integrators.mechanism.rotation import rotation_vectors
from gudgeon.solver.integrators.mechanism.start import start_of
from gudgeon.solver.integrators.mechanism.stepping import Stepping, breaks_in
from gudgeon.solver.integrators.mechanism.steps import ExplicitSteps, Steps, Tried, Within
from gudgeon.solver.integrators.mechanism.touching.log import Touching
from gudgeon.solver.integrators.mechanism.touching.sections import refuse_overlap
from gudgeon.solver.integrators.mechanism.touching.track import Track
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.result import Result
from gudgeon.solver.scene.contact import MasterSurface
from gudgeon.solver.system.system import System

SHARE = 1e-3
"""Error of an explicit step over run.accuracy: errors of hundreds of steps add up."""
FREE_SHARE = 0.1
"""The same of an implicit step without joints, whose estimate is of order 5 and its motion of order 10; multipliers of
joints are of lower order."""
FINEST = 2e-13
"""Least error of a step that is asked for: below is round-off."""
FINEST_EXPLICIT = 1e-14
"""The same of explicit steps, whose estimate has no round-off of the reactions."""
TOGETHER = 1e-14
"""Time over the duration within which journals touch or part together."""
ENDLESS = 100
"""Times that a section may touch or part without time passing, after which the run ends."""
UNBOUNDED = (
    "the joints pass a position in which some of them repeat what others hold, as four bars in one line do: forces of"
    " joints grow without bound towards it, so that their largest ones are those of the samples; motion and energy are"
    " not affected"
)
FOLLOWED = 1.0
"""Rotation after which those of bodies are continued: by less than half a turn they are [rad]."""
LONGEST = 1.4
"""Rotation of a step at most: with `FOLLOWED`, and of two bodies against each other, less than half a turn [rad]."""
WIDEST = 3.0
"""Rotation of a bushing above which it is not defined: near a half turn [rad]."""
RESOLVED = 1e-9
"""Share of the work of gravity over the size of the scene below which an exchange of energy is round-off."""


class Mechanism(Capabilities):
    """A run whose samples are `interval` apart [s]; its steps are its own, or `fixed_step` [s]."""

    failure = Result.JAMMED
    reason = ""

    def __init__(self, system: System, interval: float, *, fixed_step: float | None = None) -> None:
        self._system, self._interval = system, interval
        self.linkage = linkage_of(system)
        self.model = model_of(self.linkage)
        self.work = work_of(self.model, len(self.linkage.drives))
        loads = system.scene.turning_loads()
        self._loads = [load.reader(f"force.{name}") for name, load in loads.items()]
        self.start = start_of(self.linkage, self.model, self.work, self._given(np.zeros(1))[0][0])
        self._duration = system.scene.run.duration
        self._size, n = reach_of(self.linkage), len(self.model.mass)
        self._before, self._time, self._state = 0.0, 0.0, self.start.state.copy()
        self._end, self._until, self._jumps = self._state, 0.0, False
        self._rows = [to_coordinates(body) for body in system.bodies.values()]
        self._turning = core.Turning(self.model, self.work)
        self._within: Within = lambda x: self._state
        self._methods = self._methods_of(fixed=fixed_step is not None)
        self._choice = Choice(self.model, self._methods)
        self._steps = self._choice.steps
        breaks = breaks_in(self._given, [load.values for load in loads.values() if load.values], self._duration)
        self._stepping = Stepping(self._steps, self.work, self._duration, breaks, fixed=fixed_step)
        self._parts, self._target = self._shares(), 0.0
        self._vectors = np.zeros((n, 3))
        self._vectors, self._turned_at = self._turned(self._state), 0.0
        self._dependence, self._singular = Dependence(self.model, self.work, self.start.rank), 0
        self._fastest, self._widest = (0.0, 0.0), 0.0
        self._weight: np.ndarray | None = None
        owners = np.array([s.owner for s in self.linkage.sections])
        tracks = [Track(np.flatnonzero(owners == contact.name)) for contact in system.contacts]
        worn = {i: s.worn for i, s in enumerate(self.linkage.sections) if s.worn is not None}
        self._at_once = 0
        self._bearable = {
            i: section.yielding.load for i, section in enumerate(self.linkage.sections) if section.yielding is not None
        }
        self.touching = Touching(self.model, self.work, tracks, self._size, worn=worn)
        refuse_overlap(system, self.touching.depths(self._state), tracks, self._size)
        self.touching.begin(self._state)
        self._recorder = Recorder(self.linkage, self.model, self.work, self.touching)
        drives, amounts = self._given(np.zeros(1))
        self._recorder.take(self._state, self._vectors, drives[0], amounts[0])
        self._refuse_outside()
        self._energy = energies(self.model, self._state[None], [self._recorder.samples[0].motion])[0]
        self._extreme = np.array([float(self._energy @ (1, 1, 1, 1, -1)), 0.0, 0.0, 0.0])
        self._steps.restart(self._state, 0.0)
        q, v = self._coordinates(self._recorder.samples)
        self._at = q[0], v[0]

    def _methods_of(self, *, fixed: bool) -> list[Steps]:
        """Return the methods of steps that the run may take, the first one to begin with.

        Raises:
            SceneError: implicit steps are asked for that the scene cannot have.
        """
        stepping, accuracy = self._system.scene.run.stepping, self._system.scene.run.accuracy or self.accuracy
        lack = lack_of(self.model)
        if stepping == "implicit" and lack:
            raise SceneError(f"run.stepping: 'implicit' given, and {lack}; use 'auto' or 'explicit'")
        arguments = self._given, self._weights
        explicit = ExplicitSteps(self.model, self.work, max(FINEST_EXPLICIT, SHARE * accuracy), *arguments)
        if stepping == "explicit" or lack or (stepping == "auto" and fixed):
            return [explicit]
        energy = 0.5 * float(self.model.mass.sum()) * (self._size / self._duration) ** 2
        kind, fraction = (ExponentialSteps, FREE_SHARE) if propagates(self.model) else (ImplicitSteps, SHARE)
        longer: Steps = kind(self.model, self.work, max(FINEST, fraction * accuracy), *arguments, least=energy)
        return [longer] if stepping == "implicit" else [explicit, longer]

    def _refuse_outside(self) -> None:
        """Raise a SceneError where a body is outside of a field as the run starts."""
        for i, name in enumerate(self._system.scene.fields()):
            if code := int(self.work.field[i, LEFT]):
                (bushing,) = np.flatnonzero(self.model.bush_field == i)
                refuse_outside(name, self.model.fields, i, code, self.work.bush[bushing, :6])

    def _turned(self, state: np.ndarray) -> np.ndarray:
        """Return the rotation vectors of a state that continue those of the last step [rad], (n, 3)."""
        return rotation_vectors(bodies_of(self.model, state)[:, TURN : TURN + 4], self._vectors)

    def _given(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return drives (t, d, 3) and loads (t, l) at times [s], (t,)."""
        drives = self.linkage.drives
        driven, amounts = np.zeros((len(times), len(drives), 3)), np.zeros((len(times), len(self._loads)))
        for i, drive in enumerate(drives):
            driven[:, i] = drive(times)
        for i, load in enumerate(self._loads):
            amounts[:, i] = load(times)
        return driven, amounts

    def advance(self, start_step: int, stride: int, out: Samples) -> bool:
        """Fill samples of `stride` intervals; False where the run cannot continue."""
        count, r = len(out.forces), len(self._system.rigid)
        states = np.zeros((count, len(self._state)))
        vectors = np.zeros((count, len(self.model.mass), 3))
        times = np.minimum(self._interval * (start_step + stride * np.arange(1, count + 1)), self._duration)
        drives, amounts = self._given(times)
        for i, time in enumerate(map(float, times)):
            self._target = time
            while self._time < time * (1 - 1e-14):
                if not self._advance():
                    return False
                if self.touching.worn_through:
                    self.failure = Result.WORN_THROUGH
                    return False
                if (section := self.touching.overloaded(self._bearable)) is not None:
                    self.failure = Result.OVERLOADED
                    self.reason = self._overload(section)
                    return False
            states[i] = self._interpolated(time)
            vectors[i] = self._turned(states[i])
            self._recorder.take(states[i], vectors[i], drives[i], amounts[i])
        taken = self._recorder.samples[len(self._recorder.samples) - count :]
        out.energies[:] = energies(self.model, states, [s.motion for s in taken])
        self._note_energies(out.energies)
        out.energies[:, 4] -= self._energy[4]
        self._set_forces(out.forces, stride * self._interval)
        q, v = self._coordinates(taken)
        rigid = self._system.rigid
        out.gauges[:] = q @ self._system.gauge_rows.T + self._recorder.static_gauges(amounts)
        out.snapshots[:, :r], out.snapshots[:, r : 2 * r] = q[:, rigid], v[:, rigid]
        self._at = q[-1], v[-1]
        if text := deformed_text(self._system, times, q):
            self.failure, self.reason = Result.DEFLECTION, text
        return not text

    def _set_forces(self, forces: np.ndarray, interval: float) -> None:
        """Set the mean resultant of each contact over the last samples, (s, k, 3)."""
        samples = self._recorder.samples[len(self._recorder.samples) - len(forces) - 1 :]
        sums = pushes_of(np.array([s.state for s in samples]), len(self.linkage.sections))
        impulses = sums[:, :, NORMAL_PUSH:DRAG_PUSH] + sums[:, :, DRAG_PUSH:DEFLECTION]
        for i, track in enumerate(self.touching.tracks):
            forces[:, i] = np.diff(impulses[:, track.sections].sum(axis=1), axis=0) / interval

    def _note_energies(self, energies_: np.ndarray) -> None:
        total = energies_ @ (1, 1, 1, 1, -1)
        self._extreme[1] = max(self._extreme[1], float(np.abs(total - self._extreme[0]).max()))
        exchanged = max(float(energies_[:, 0].max()), float(np.abs(energies_[:, 4] - self._energy[4]).max()))
        weight = float(self.model.mass.sum() * np.linalg.norm(self.model.gravity)) * self._size
        self._extreme[2] = max(self._extreme[2], exchanged, float(self._energy[0]), RESOLVED * weight)

    def _advance(self) -> bool:
        """Take one step, or the part of it up to the first time at which a journal touches or parts; False where none
        is short enough."""
        self.touching.slipped, self.touching.pressed = self.work.slipping.copy(), self.work.touching.copy()
        tried = self._stepping.take(self._state, self._time)
        if tried is None or not self._span(tried):
            self._note_left()
            return False
        event = self.touching.first(self._interpolated, self._before, self._until) if self.touching else None
        if self._ran_off():
            return False
        h = 0.0 if event is None else event.time - self._time
        if h > TOGETHER * self._duration:
            tried = self._steps.computed(self._state, self._time, h)
            if not tried.sound or not self._span(tried):
                return False
        if event is None or h > TOGETHER * self._duration:
            self._accept(tried)
        if self._widest > WIDEST:
            self.failure = Result.HALF_TURN
            return False
        if event is not None:
            self.touching.switch(event, self._state)
            self._steps.restart(self._state, self._time)
            self._at_once = self._at_once + 1 if h <= TOGETHER * self._duration else 0
            if self._at_once > ENDLESS * len(self.linkage.sections):
                self.failure, self.reason = Result.CHATTER, self._endless(event.section)
                return False
        return True

    def _endless(self, section: int) -> str:
        """Return why a run ends in which a section touches and parts without end."""
        event = f"at {self._time:.6g} s the contact of '{self.linkage.sections[section].owner}' begins and ends"
        step = self._system.scene.run.step
        if step is None:
            return f"{event} without end in steps of any size; reduce run.accuracy, or shorten run.duration"
        return f"{event} without end: run.step, {step:g} s, is too long for it; reduce it, or leave it out"

    def _ran_off(self) -> bool:
        """Say so where a point left a surface with a force, or came onto it from the side."""
        if (exit_ := self.touching.left) is None:
            return False
        name = self.linkage.sections[exit_.section].owner
        against = self._system.scene.contact[name].against
        assert isinstance(against, MasterSurface)
        self.failure, (x, y, z) = Result.SURFACE_LEFT, exit_.place
        self.reason = (
            f"contact.{name}: a point {'left' if exit_.pressed else 'came from the side below'} the surface"
            f" '{against.interface}' of body '{against.body}' at {exit_.time:.6g} s, at ({x:.4g}, {y:.4g}, {z:.4g}) m;"
            " widen the surface or its extent, shorten run.duration, or round off the edge"
        )
        return True

    def _overload(self, section: int) -> str:
        """Return why a run ends whose elastic bearing is pressed beyond its table."""
        name, load = self.linkage.sections[section].owner, self._bearable[section]
        return (
            f"at {self._time:.6g} s the force on joint '{name}' exceeds {load:g} N, up to which its bearing is"
            f" tabulated; increase joint.{name}.bearing.load"
        )

    def _note_left(self) -> None:
        """Say why the run cannot continue, such as since a body left a field."""
        fields_left = np.flatnonzero(self.work.field[:, LEFT])
        self.reason = self._stepping.reason(self._time)
        if len(fields_left):
            i = int(fields_left[0])
            motion = motion_of(self.model, self.work, self._state, self._turning)
            pose = motion.bushings[self.model.bush_field == i][0, :6]
            self.failure = Result.FIELD_LEFT
            self.reason = left_text(self._system.fields.names[i], self.model.fields, i, pose, self._time)

    def _span(self, tried: Tried) -> bool:
        """Set the interpolation of a step from the present state, if a sample or an event may be within it; False where
        it overflows, of a given step that is too long."""
        self._before, self._end = self._time, tried.state
        self._until, self._jumps = self._stepping.end(self._time + tried.h)
        if not self.touching and self._target > self._until:
            return True
        self._within = self._steps.within(tried, self._state)
        return bool(np.isfinite(self._within(0.5)).all())

    def _accept(self, tried: Tried) -> None:
        """Go on to the end of a step."""
        if self.touching.rubbed:
            self.touching.rub(self._interpolated, self._before, self._until)
        self._state, self._time = tried.state, self._until
        turned = self._turning.keep_angles(tried.state)
        singular = self._stepping.near_singular(tried)
        self._singular += self._dependence.passes(tried.least, near=singular)
        self._note_speeds(turned)
        self._recorder.heed(self._state, self._time, self._given)
        if self._fastest[1] * (self._time - self._turned_at) > FOLLOWED:
            self._vectors, self._turned_at = self._turned(tried.state), self._time
        if self._fastest[1] > 0:
            self._stepping.longest = LONGEST / self._fastest[1]
        self._steps.accept(tried)
        if self._choice.note(tried, self._stepping.rejected, singular=singular) or self._jumps:
            self._steps = self._stepping.steps = self._choice.steps
            self._steps.restart(self._state, self._time)

    def _note_speeds(self, squares: tuple[float, float]) -> None:
        """Keep the largest speed and angular velocity of the run, by which errors are measured, of their squares now;
        poses are set. What touches is left in `work` as it is now."""
        if self.touching or len(self.model.bush_rest):
            bushings = motion_of(self.model, self.work, self._state, self._turning).bushings
            self._widest = float(np.linalg.norm(bushings[:, 3:6], axis=1).max(initial=0.0))
        speed, turning = (max(fastest, math.sqrt(s)) for fastest, s in zip(self._fastest, squares, strict=True))
        if (speed, turning) != self._fastest:
            self._fastest, self._weight = (speed, turning), None

    def _shares(self) -> np.ndarray:
        """Return what makes up `_weights`: shares that are constant, and over the largest speed, its square and the
        largest angular velocity, (4, 13 n + SUMS)."""
        weights = np.zeros((4, len(self._state)))
        constant, speed, square, spin = weights
        constant_bodies = bodies_of(self.model, constant)
        constant_bodies[:, PLACE : PLACE + 3], constant_bodies[:, TURN : TURN + 4] = 1 / self._size, 1.0
        bodies_of(self.model, speed)[:, SPEED : SPEED + 3] = 1.0
        bodies_of(self.model, spin)[:, SPIN : SPIN + 3] = 1.0
        for b, mass in enumerate(self.model.mass):
            # A coordinate of unit modal mass moves the body by about 1/√mass.
            modal_parts(self.model, constant, b)[0][:] = 1 / (np.sqrt(mass) * self._size)
            modal_parts(self.model, speed, b)[1][:] = 1 / np.sqrt(mass)
        sections, mass = len(self.model.touch_pair), float(self.model.mass.sum())
        pushes = pushes_of(speed, sections)
        pushes[:] = 1 / mass
        pushes[:, 1], pushes[:, DEFLECTION:] = 0.0, 0.0
        pushes_of(square, sections)[:, 1] = 1 / mass
        pushes_of(constant, sections)[:, DEFLECTION:] = 1 / self._size
        return weights

    def _weights(self) -> np.ndarray:
        """Return what the error of each number is multiplied by, (13 n + SUMS,)."""
        if self._weight is None:
            rate = 1.0 / self._duration
            speed, spin = max(self._fastest[0], rate * self._size), max(self._fastest[1], rate)
            self._weight = np.array([1.0, 1 / speed, 1 / speed**2, 1 / spin]) @ self._parts
        return self._weight

    def _interpolated(self, time: float) -> np.ndarray:
        """Return the state at a time within the last step [s]."""
        if time >= self._until:
            return self._end.copy()
        x = (time - self._before) / (self._until - self._before)
        state = self._within(x)
        turns = bodies_of(self.model, state)[:, TURN : TURN + 4]
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        return state

    def _coordinates(self, samples: list[Sample]) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates and velocities of samples, as records have them, (s, coordinates)."""
        states, vectors = (np.array([getattr(s, key) for s in samples]) for key in ("state", "vectors"))
        omega, modal = (np.array([getattr(s.motion, key) for s in samples]) for key in ("omega", "modal"))
        bodies, q, v = bodies_of(self.model, states), [], []
        for b, rows in enumerate(self._rows):
            elastic = modal_parts(self.model, states, b)[0]
            rates = modal[:, b, : elastic.shape[1]]
            q += [np.hstack([bodies[:, b, :3] - self.linkage.centres[b], vectors[:, b]]) @ rows, elastic]
            v += [np.hstack([bodies[:, b, SPEED : SPEED + 3], omega[:, b]]) @ rows, rates]
        return np.hstack(q), np.hstack(v)

    def impacts(self) -> list[np.ndarray]:
        """Return the impacts of each contact up to the last step, (b, 9) each."""
        window = self._system.window
        return [self.touching.of_contact(track, self._state, self._time, window) for track in self.touching.tracks]

    def outcome(self) -> Outcome:
        (q, v), sample = self._at, self._recorder.samples[-1]
        rows = np.concatenate([np.empty(0, int), *(track.sections for track in self.touching.tracks)]).astype(int)
        impulses = pushes_of(sample.state, len(self.linkage.sections))[rows]
        self._extreme[3] = self.touching.deepest
        counts: dict[str, int | str] = {
            "steps_taken": self._stepping.taken,
            "steps_rejected": self._stepping.rejected,
            "singular_steps": self._singular,
            "implicit_steps": self._choice.taken["implicit"],
            "exponential_steps": self._choice.taken["exponential"],
            "rows": self.start.rows,
        }
        notes = self.start.notes + ([UNBOUNDED] if self._singular else [])
        notes = notes + self._choice.notes()
        return Outcome(
            q=q, v=v, multipliers=sample.pressed[rows], impulses=impulses[:, 0], extreme=self._extreme,
            counts=np.zeros(3), work=counts | {"rank": self.start.rank},
            linkage=partial(self._recorder.found, self._interval, notes, (self._state, self._time)),
        )  # fmt: skip
