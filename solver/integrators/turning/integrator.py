"""Bodies that turn by any angle, held by joints: explicit or implicit steps with projection."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.capabilities import Turning as Capabilities
from gudgeon.solver.forces.fields.co_energy import LEFT, left_text, refuse_outside
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.integrators.turning.arrays import DEFLECTION, DRAG_PUSH, NORMAL_PUSH, SPEED, TURN, pushes_of
from gudgeon.solver.integrators.turning.build import linkage_of, model_of, reach_of
from gudgeon.solver.integrators.turning.constraints.dependence import Dependence
from gudgeon.solver.integrators.turning.energy import bodies_of, energies, modal_parts, motion_of, to_coordinates
from gudgeon.solver.integrators.turning.flexible.range import deformed_text
from gudgeon.solver.integrators.turning.histories import Recorder, Sample
from gudgeon.solver.integrators.turning.moving_rest import Moment
from gudgeon.solver.integrators.turning.rotation import rotation_vectors
from gudgeon.solver.integrators.turning.start import start_of
from gudgeon.solver.integrators.turning.stepping import breaks_in, given_of, kinds_text, settings_of
from gudgeon.solver.integrators.turning.touching.log import Touching
from gudgeon.solver.integrators.turning.touching.sections import refuse_overlap
from gudgeon.solver.integrators.turning.touching.track import Track
from gudgeon.solver.result import Result
from gudgeon.solver.scene.contact import MasterSurface
from gudgeon.solver.system.system import System

REACHED, STUCK, HALF_TURN = range(3)
"""Why `core.TurningSteps.advance` ends."""
TOGETHER = 1e-14
"""Time over the duration within which journals touch or part together."""
ENDLESS = 100
"""Times that a section may touch or part without time passing, after which the run ends."""
UNBOUNDED = (
    "the joints pass a position in which some of them repeat what others hold, as four bars in one line do: forces of"
    " joints grow without bound towards it, so that their largest ones are those of the samples; motion and energy are"
    " not affected"
)
RESOLVED = 1e-9
"""Share of the work of gravity over the size of the scene below which an exchange of energy is round-off."""


class Turning(Capabilities):
    """A run whose samples are `interval` apart [s]; its steps are its own, or `fixed_step` [s]."""

    failure = Result.JAMMED
    reason = ""

    def __init__(self, system: System, interval: float, *, fixed_step: float | None = None) -> None:
        self._system, self._interval = system, interval
        self.linkage = linkage_of(system)
        self.model = model_of(self.linkage)
        self.work = core.turning_work(self.model, len(self.linkage.drives))
        loads = system.scene.turning_loads()
        functions = [load.function(f"force.{name}") for name, load in loads.items()]
        self._given = given_of(self.linkage.drives, functions)
        drives, amounts = self._given(np.zeros(1))
        self.start = start_of(self.linkage, self.model, self.work, Moment(drives[0], amounts[0]))
        run = system.scene.run
        self._duration, self._fixed, self._size = run.duration, fixed_step, reach_of(self.linkage)
        self._rows = [to_coordinates(body) for body in system.bodies.values()]
        self._turning = core.Turning(self.model, self.work)
        breaks = breaks_in(self._given, [load.values for load in loads.values() if load.values], self._duration)
        settings = settings_of(
            self.model, run.stepping, run.accuracy or self.accuracy, duration=self._duration, fixed=fixed_step,
            rank=self.start.rank, breaks=breaks,
        )  # fmt: skip
        owners = np.array([s.owner for s in self.linkage.sections])
        tracks = [Track(np.flatnonzero(owners == contact.name)) for contact in system.contacts]
        worn = {i: s.worn for i, s in enumerate(self.linkage.sections) if s.worn is not None}
        self._at_once = 0
        self._bearable = {
            i: section.yielding.load for i, section in enumerate(self.linkage.sections) if section.yielding is not None
        }
        self.touching = Touching(self.model, self.work, tracks, self._size, worn=worn)
        state = self.start.state
        refuse_overlap(system, self.touching.depths(state), tracks, self._size)
        self.touching.begin(state)
        dependence = Dependence(self.model, self.work, self.start.rank)
        drives, amounts = ([f.signal for f in every] for every in (self.linkage.drives, functions))
        self.steps = core.TurningSteps(
            self.model, self.work, settings, drives, amounts, self._given, dependence.passes, state
        )
        """The steps, `core.TurningSteps`."""
        self._recorder = Recorder(self.linkage, self.model, self.work, self.touching)
        drives, amounts = self._given(np.zeros(1))
        self._recorder.take(state, self.steps.vectors.copy(), drives[0], amounts[0])
        self._refuse_outside()
        self._energy = energies(self.model, state[None], [self._recorder.samples[0].motion])[0]
        self._extreme = np.array([float(self._energy @ (1, 1, 1, 1, -1)), 0.0, 0.0, 0.0])
        self.steps.restart()
        q, v = self._coordinates(self._recorder.samples)
        self._at = q[0], v[0]

    def _refuse_outside(self) -> None:
        """Raise a SceneError where a body is outside of a field as the run starts."""
        for i, name in enumerate(self._system.scene.fields()):
            if code := int(self.work.field[i, LEFT]):
                (bushing,) = np.flatnonzero(self.model.bush_field == i)
                refuse_outside(name, self.model.fields, i, code, self.work.bush[bushing, :6])

    def turned(self, state: np.ndarray) -> np.ndarray:
        """Return the rotation vectors of a state that continue those of the last step [rad], (n, 3)."""
        return rotation_vectors(bodies_of(self.model, state)[:, TURN : TURN + 4], self.steps.vectors)

    def advance(self, start_step: int, stride: int, out: Samples) -> bool:
        """Fill samples of `stride` intervals; False where the run cannot continue."""
        count, r = len(out.forces), len(self._system.rigid)
        states = np.zeros((count, len(self.start.state)))
        vectors = np.zeros((count, len(self.model.mass), 3))
        times = np.minimum(self._interval * (start_step + stride * np.arange(1, count + 1)), self._duration)
        drives, amounts = self._given(times)
        for i, time in enumerate(map(float, times)):
            if not self._advance(time):
                return False
            states[i] = self.steps.state_at(time)
            vectors[i] = self.turned(states[i])
            self._recorder.take(states[i], vectors[i], drives[i], amounts[i])
        taken = self._recorder.samples[len(self._recorder.samples) - count :]
        out.energies[:] = energies(self.model, states, [s.motion for s in taken])
        self._note_energies(out.energies, float(np.abs(amounts).sum(axis=1).max(initial=0.0)))
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

    def state(self) -> None:
        """Return None: its marches are repeated from their start where they were stopped."""

    def resume(self, stored: Mapping[str, np.ndarray]) -> None:
        """Not called, since there is no state."""

    def _set_forces(self, forces: np.ndarray, interval: float) -> None:
        """Set the mean resultant of each contact over the last samples, (s, k, 3)."""
        samples = self._recorder.samples[len(self._recorder.samples) - len(forces) - 1 :]
        sums = pushes_of(np.array([s.state for s in samples]), len(self.linkage.sections))
        impulses = sums[:, :, NORMAL_PUSH:DRAG_PUSH] + sums[:, :, DRAG_PUSH:DEFLECTION]
        for i, track in enumerate(self.touching.tracks):
            forces[:, i] = np.diff(impulses[:, track.sections].sum(axis=1), axis=0) / interval

    def _note_energies(self, energies_: np.ndarray, load: float) -> None:
        """Note energies [J], (s, 5): what weight and loads [N] do on round-off of positions is no exchange."""
        total = energies_ @ (1, 1, 1, 1, -1)
        self._extreme[1] = max(self._extreme[1], float(np.abs(total - self._extreme[0]).max()))
        exchanged = max(float(energies_[:, 0].max()), float(np.abs(energies_[:, 4] - self._energy[4]).max()))
        weight = float(self.model.mass.sum() * np.linalg.norm(self.model.gravity)) + load
        self._extreme[2] = max(self._extreme[2], exchanged, float(self._energy[0]), RESOLVED * weight * self._size)

    def _advance(self, time: float) -> bool:
        """Take steps up to a time [s]; False where the run cannot continue."""
        if self.touching:
            while self.steps.time < time * (1 - 1e-14):
                if not (self._step() and self._holds()):
                    return False
            return True
        stop = self.steps.advance(time)
        if stop == STUCK:
            self._note_left()
        elif stop == HALF_TURN:
            self.failure = Result.HALF_TURN
        return bool(stop == REACHED)

    def _step(self) -> bool:
        """Take one step, or the part of it up to the first time at which a journal touches or parts; False where none
        is short enough."""
        steps, touching = self.steps, self.touching
        touching.slipped, touching.pressed = self.work.slipping.copy(), self.work.touching.copy()
        if not steps.take(np.inf):
            self._note_left()
            return False
        event = touching.first(steps.state_at, steps.before, steps.until)
        if self._ran_off():
            return False
        h = 0.0 if event is None else event.time - steps.time
        cut = h > TOGETHER * self._duration
        if cut and not steps.retake(h):
            return False
        if (cut or event is None) and not self._accept():
            self.failure = Result.HALF_TURN
            return False
        if event is not None:
            touching.switch(event, steps.state)
            steps.restart()
            self._at_once = 0 if cut else self._at_once + 1
            if self._at_once > ENDLESS * len(self.linkage.sections):
                self.failure, self.reason = Result.CHATTER, self._endless(event.section)
                return False
        return True

    def _accept(self) -> bool:
        """Go on to the end of a step; False where a bushing turns by half a turn."""
        if self.touching.rubbed:
            self.touching.rub(self.steps.state_at, self.steps.before, self.steps.until)
        turns = self.steps.accept()
        self._recorder.heed(self.steps.state, self.steps.time, self._given)
        return bool(turns)

    def _holds(self) -> bool:
        """Return whether no section is worn through or overloaded."""
        if self.touching.worn_through:
            self.failure = Result.WORN_THROUGH
            return False
        if (section := self.touching.overloaded(self._bearable)) is not None:
            self.failure, self.reason = Result.OVERLOADED, self._overload(section)
            return False
        return True

    def _endless(self, section: int) -> str:
        """Return why a run ends in which a section touches and parts without end."""
        event = f"at {self.steps.time:.6g} s the contact of '{self.linkage.sections[section].owner}' begins and ends"
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
            f"at {self.steps.time:.6g} s the force on joint '{name}' exceeds {load:g} N, up to which its bearing is"
            f" tabulated; increase joint.{name}.bearing.load"
        )

    def _note_left(self) -> None:
        """Say why the run cannot continue, such as since a body left a field."""
        fields_left = np.flatnonzero(self.work.field[:, LEFT])
        self.reason = self._stuck()
        if len(fields_left):
            i = int(fields_left[0])
            motion = motion_of(self.model, self.work, self.steps.state, self._turning)
            pose = motion.bushings[self.model.bush_field == i][0, :6]
            self.failure = Result.FIELD_LEFT
            self.reason = left_text(self._system.fields.names[i], self.model.fields, i, pose, self.steps.time)

    def _stuck(self) -> str:
        """Return why no step could be taken, where there is more to say than that none is short enough."""
        time = self.steps.time
        if self._fixed is not None:
            return f"at {time:.6g} s no step of {self._fixed:g} s can be taken; reduce run.step, or leave it out"
        if self.steps.too_fast:
            return (
                f"at {time:.6g} s a body turns so fast that it is followed only by steps of {self.steps.longest:.2g} s;"
                " check drives and loads, or shorten run.duration"
            )
        return ""

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
        separation, state = self._system.separation, (self.steps.state, self.steps.time)
        tracks = zip(self.touching.tracks, self._system.windows.tolist(), strict=True)
        return [self.touching.of_contact(track, *state, separation, window) for track, window in tracks]

    def outcome(self) -> Outcome:
        (q, v), sample = self._at, self._recorder.samples[-1]
        rows = np.concatenate([np.empty(0, int), *(track.sections for track in self.touching.tracks)]).astype(int)
        impulses = pushes_of(sample.state, len(self.linkage.sections))[rows]
        self._extreme[3] = self.touching.deepest
        counts: dict[str, Any] = self.steps.counts
        notes = self.start.notes + ([UNBOUNDED] if counts["singular_steps"] else []) + kinds_text(counts)
        return Outcome(
            q=q, v=v, multipliers=sample.pressed[rows], impulses=impulses[:, 0], extreme=self._extreme,
            counts=np.zeros(3), work=counts | {"rows": self.start.rows, "rank": self.start.rank},
            linkage=partial(self._recorder.found, self._interval, notes, (self.steps.state.copy(), self.steps.time)),
        )  # fmt: skip
