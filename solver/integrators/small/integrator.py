"""Small motion: runs the loop over ports."""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.trajectory import EDGE_NOTES
from gudgeon.solver import capabilities, core
from gudgeon.solver.contact.rows import touching_depth
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.fields.co_energy import LEFT, left_text
from gudgeon.solver.integrators.impact_log import Located, impact_log
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.integrators.saved import live_arrays, set_arrays
from gudgeon.solver.integrators.small.arrays import (
    STABILISED,
    Arrays,
    Found,
    Given,
)
from gudgeon.solver.integrators.small.constants import constants_of, loop_of
from gudgeon.solver.integrators.small.start import candidates, problem_of, state_of
from gudgeon.solver.integrators.small.tape import Gradient, Tape, begun, empty_tape
from gudgeon.solver.machine.memory import total_memory
from gudgeon.solver.ports.members import contact_ports, function_ports, gauge_ports, ports_of, probe_ports
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System

TABLES = 12
"""Arrays of a run with a number for each two ports that share a body."""
PLAIN, MATRICES = 0.5, 2.0
"""Work arrays with a number for each two ports that respond: where all are unilateral, or of joints, and else."""
SHARE = 0.8
"""Of the memory of the machine, or of its container, that they may take."""
AHEAD = 256
"""Steps for which forces, drives and cranks are evaluated together: one at a time takes longer than the step."""


def _refuse_large(system: System, numbers: float) -> None:
    """Raise a SceneError where arrays of so many numbers would not find room on this machine."""
    memory = total_memory()
    if 8.0 * numbers <= SHARE * memory:
        return
    points = sum(contact.rows.stop - contact.rows.start for contact in system.contacts)
    raise SceneError(
        f"contact: {len(system.contacts)} contacts have {points} points, for which the solver needs about"
        f" {8.0 * numbers / 2**30:.3g} GB, and this machine has {memory / 2**30:.3g} GB; give them fewer by a larger"
        " component.*.mesh.size, or interfaces of kind 'patch'"
    )


class Small(capabilities.Small):
    """A run of steps `dt`."""

    failure = Result.NOT_CONVERGED
    reason = ""

    def __init__(self, system: System, dt: float) -> None:
        self._system, self._dt = system, dt
        self.ports = ports_of(system)
        tables = TABLES * self.ports.pairs.size
        _refuse_large(system, tables)
        constants = constants_of(system, self.ports, dt)
        closes = constants.plain or constants.paired
        _refuse_large(system, tables + (PLAIN if closes else MATRICES) * candidates(constants) ** 2)
        state = state_of(system, self.ports, constants)
        normals = [contact_ports(self.ports, contact) for contact in system.contacts]
        self._normals = np.concatenate([np.empty(0, np.int64), *normals]).astype(np.int64)
        functions = {
            i: function_ports(self.ports, contact)
            for i, contact in enumerate(system.contacts)
            if contact.master is not None
        }
        self._functions = np.concatenate([np.empty(0, np.int64), *(f[0] for f in functions.values())])
        self._rubbed = {contact_id: f[1:] for contact_id, f in functions.items() if len(f) > 1}
        log = impact_log([int(rows[0]) for rows in normals], dt, system.separation, system.windows)
        self.arrays = Arrays(constants, state, problem_of(constants, state.slides), log)
        self._loop = core.Small(*loop_of(self.arrays, system, self.ports))
        self._located, self._end_forces = Located(log), state.unknown
        loaded, contacts = len(constants.loaded), max(1, len(system.contacts))
        self._bare = Found(
            forces=np.zeros((1, contacts, 3)), energies=np.zeros((1, 5)), loads=np.zeros((1, loaded)),
            q=np.zeros((1, len(state.q))), v=np.zeros((1, len(state.q))), ports=np.zeros((1, len(state.unknown))),
            lengths=np.zeros((1, len(state.pin))),
        )  # fmt: skip
        self._one_step = Given(
            np.zeros((2, 1, len(constants.given))), np.zeros((1, len(system.driving.joints), 4)),
            np.zeros((1, len(constants.drives))),
        )  # fmt: skip
        self._steps = self._one_step
        self._driven = bool(system.driving.joints or system.driving.drives)
        self._ahead = range(0), self._one_step
        self._whole = round(system.scene.run.duration / dt)
        self._slips: list[list[tuple[float, bool]]] = [[] for _ in system.contacts]
        self._springs = list(system.scene.springs())
        self._gauges = gauge_ports(system, self.ports)
        self._probes = probe_ports(system, self.ports)

    def advance(self, start_step: int, stride: int, out: Samples) -> bool:
        """Fill samples of `stride` steps; False where the run cannot continue."""
        system, state, count = self._system, self.arrays.state, len(out.forces)
        arrays = Found(
            forces=out.forces, energies=out.energies, loads=out.loads, q=np.zeros((count, len(state.q))),
            v=np.zeros((count, len(state.q))), ports=np.zeros((count, len(state.unknown))),
            lengths=np.zeros((count, len(state.pin))),
        )  # fmt: skip
        sound = self._loop.march(self._drive(start_step, count * stride), start_step, stride, arrays)
        if not sound:
            self._note_left()
        self._end_forces = arrays.ports[-1] if sound else state.unknown
        self._take_slips()
        normal_forces = arrays.ports[:, self._normals]
        out.set_states(slice(None), system, arrays.q, arrays.v, normal_forces)
        if len(system.probes.names):
            contacts = normal_forces @ system.probes.pressed.T
            out.probes[:] = system.probes.values(arrays.q, arrays.v) + np.where(
                self._probes.any(axis=1), arrays.ports @ self._probes.T, contacts
            )
        if system.gauges:
            out.gauges[:] = system.gauged(arrays.q, arrays.v) + arrays.ports @ self._gauges.T
        out.snapshots[:, 2 * len(system.rigid) :] = arrays.lengths
        function_forces, dragged = (
            arrays.ports[:, self._functions],
            self._friction(arrays.ports) if system.rubbing else None,
        )
        out.peaks.keep_highest(
            start_step // stride, out.forces, arrays.q, arrays.v, normal_forces, function_forces, friction=dragged
        )
        if sound and not self._located.take():
            self.failure = Result.IMPACTS
            return False
        return sound

    def _note_left(self) -> None:
        """Say so where the run cannot continue since a body left a field."""
        state = self.arrays.state
        for i, name in enumerate(self._system.fields.names):
            if state.field[i, LEFT]:
                self.failure, fields = Result.FIELD_LEFT, self._system.fields.energies
                self.reason = left_text(name, fields, i, state.field_pose[i], state.field_energy[1] * self._dt)

    def advance_bare(self, start_step: int, count: int, applied: np.ndarray) -> bool:
        """Take steps without histories; False where the run cannot continue.

        Args:
            applied: Given loads [N], NaN: as the scene gives them, (g,).
        """
        drive = self._one_step
        if self._driven or (len(applied) and np.isnan(applied).any()):
            if count > 1:
                drive = self._drive(start_step, count)
            else:
                steps, ahead = self._block(start_step)
                row = start_step - steps.start
                drive.loads[:, 0], drive.crank[0] = ahead.loads[:, row], ahead.crank[row]
                drive.driven[0] = ahead.driven[row]
            set_ = ~np.isnan(applied)
            drive.loads[:, :, set_] = applied[set_]
        elif count > 1:
            if count != len(self._steps.crank):
                self._steps = Given(np.empty((2, count, len(applied))), np.zeros((count, 0, 4)), np.zeros((count, 0)))
            drive = self._steps
            drive.loads[:] = applied
        else:
            drive.loads[:] = applied
        # What it sums up of forces and loads is not read.
        sound = self._loop.march(drive, start_step, count, self._bare)
        self._take_slips()
        if not self._located.take():
            self.failure = Result.IMPACTS
            return False
        return sound

    def kept(self, steps: int) -> Tape | None:
        """Take steps from the start and return their states; None where one failed. No impacts are noted."""
        state, (sides, p) = self.arrays.state, self.arrays.state.held.shape
        tape = empty_tape(steps, len(state.q), p, sides)
        return tape if self._loop.march_kept(self._drive(0, steps), self._bare, tape) else None

    def derivatives(self, tape: Tape, means: np.ndarray, ends: np.ndarray) -> Gradient | None:
        """Return the derivatives of a quantity by one pass back over a tape; None where those of a step are singular.

        Args:
            means: Its derivatives by the mean force of each port in each step, (S, p).
            ends: The same by q and its rate at the end, (2, m).
        """
        gradient, work = begun(tape, ends, len(self.arrays.constants.given))
        return gradient if self._loop.march_backward(tape, np.ascontiguousarray(means), work, gradient) else None

    def model(self, steps: int) -> Gradient:
        """Return all arrays that the result of a run depends on, in the places of their derivatives."""
        constants, state, pairs = self.arrays.constants, self.arrays.state, self.ports.pairs
        tables = [pairs.matrix(table).dense() for table in constants.residual.values]
        p = len(constants.offset)
        return Gradient(
            motion=constants.motion, push=constants.push, gravity=constants.gravity, rows=self.ports.rows.dense(),
            residual=np.array(tables).reshape(-1, p, p), memory=constants.memory, layer=constants.layer,
            offset=constants.offset, law=constants.law, loads=self._drive(0, steps).loads,
            state=np.stack([state.q, state.v]), force=state.unknown, held=state.held,
        )  # fmt: skip

    def _take_slips(self) -> None:
        """Take the changes between slip and stick of the last steps."""
        slips = self.arrays.state.slips
        if not slips[0, 0]:
            return
        for contact, time, begins in slips[1 : int(slips[0, 0]) + 1]:
            self._slips[int(contact)].append((float(time), bool(begins)))
        slips[0, 0] = 0.0

    def _drive(self, start_step: int, count: int) -> Given:
        """Return what the scene gives in some steps."""
        if not (self._driven or len(self.arrays.constants.given)):
            return Given(np.zeros((2, count, 0)), np.zeros((count, 0, 4)), np.zeros((count, 0)))
        blocks, step = list[Given](), start_step
        while step < start_step + count:
            steps, ahead = self._block(step)
            span = slice(step - steps.start, min(start_step + count, steps.stop) - steps.start)
            blocks.append(Given(ahead.loads[:, span], ahead.crank[span], ahead.driven[span]))
            step = steps.stop
        loads, crank, driven = zip(*blocks, strict=True)
        return Given(np.concatenate(loads, axis=1), np.concatenate(crank), np.concatenate(driven))

    def _block(self, step: int) -> tuple[range, Given]:
        """Return the block of steps that a step is in, and what the scene gives there, which is kept.

        Blocks begin at multiples of `AHEAD`, so that what is given has the same bits however the steps are taken; none
        reaches beyond the run, where a table or an expression need not have a value.
        """
        if step not in self._ahead[0]:
            start = step - step % AHEAD
            end = min(start + AHEAD, self._whole)
            steps = range(start, end) if step < end else range(step, step + 1)
            self._ahead = steps, self._given(steps.start, len(steps))
        return self._ahead

    def _given(self, start_step: int, count: int) -> Given:
        """Return what the scene gives in some steps, from its tables and expressions."""
        driving, dt, constants = self._system.driving, self._dt, self.arrays.constants
        start, j = dt * np.arange(start_step, start_step + count), 2 * len(self._system.driving.joints)
        loads, targets = (
            np.stack([driving.loads(start, dt), driving.loads(start + dt, 0.0)]),
            driving.driven(start + dt),
        )
        ahead = np.where(constants.level[constants.drives] == STABILISED, 0.5 * dt, 0.0)
        prescribed = np.ascontiguousarray(loads[:, :, j : j + len(constants.given)])
        return Given(prescribed, driving.crank(start + dt), targets[:, :, 0] + ahead * targets[:, :, 1])

    def _edge_notes(self) -> dict[str, int | str]:
        """Return a note where a point came past an edge inside of the solid."""
        depth = float(self.arrays.state.inside[0])
        if not self.arrays.constants.edged or depth <= touching_depth(
            np.concatenate([c.points for c in self._system.contacts] or [np.zeros((1, 3))])
        ):
            return {}
        return {
            EDGE_NOTES: "an edge of an obstacle met a body between its contact points: a point came past it"
            f" {depth:.2g} m inside and had no force until it was out; a finer mesh of the body has points there"
        }

    def impacts(self) -> list[np.ndarray]:
        return self._located.impacts()

    def state(self) -> dict[str, np.ndarray]:
        """Return all that the run goes on from, by name; see `Marching`."""
        slips = [[i, time, begins] for i, changes in enumerate(self._slips) for time, begins in changes]
        return self._live() | {
            "impacts": self._located.state(), "slips": np.array(slips, float).reshape(-1, 3),
            "end_forces": self._end_forces,
        }  # fmt: skip

    def resume(self, stored: Mapping[str, np.ndarray]) -> None:
        """Go on from a state, with the same bits."""
        set_arrays(self._live(), stored)
        self._located.resume(stored["impacts"])
        for contact, time, begins in stored["slips"]:
            self._slips[int(contact)].append((float(time), bool(begins)))
        self._end_forces = stored["end_forces"]

    def _live(self) -> dict[str, np.ndarray]:
        """Return the arrays of the loop that change from step to step."""
        arrays = self.arrays
        return {**live_arrays(arrays.state, "state"), **live_arrays(arrays.problem, "problem"),
                **live_arrays(arrays.log, "log")}  # fmt: skip

    def _friction(self, values: np.ndarray) -> np.ndarray:
        """Return the vectors across the normals, (s, c, 3), of values of all ports, (s, p)."""
        each = self.arrays.constants.size[self._normals]
        vectors = np.zeros((len(values), len(each), 3))
        if not self._system.rubbing:
            return vectors
        for b in (1, 2):
            (rubbed,) = np.nonzero(each > b)
            tangents = self._normals[rubbed] + b
            vectors[:, rubbed] += values[:, tangents, None] * self.arrays.constants.direction[tangents]
        return vectors

    def outcome(self) -> Outcome:
        state, ports, system = self.arrays.state, self.ports, self._system
        drags = self._friction(state.impulses[None])[0]
        functions, slid = self._functions, [contact.master is not None for contact in system.contacts]
        inward = np.zeros(len(functions))
        if len(functions):
            inward = (ports.rows @ state.q)[functions]
            for table, force in zip(self.arrays.constants.residual.values, state.held, strict=True):
                inward += (ports.pairs.matrix(table) @ force)[functions]
        drag_impulse = np.zeros(len(slid))
        drag_impulse[slid] = state.slides.drag_impulse
        wrenches = np.zeros((len(slid), 6))
        for i, across in self._rubbed.items():
            surface = system.contacts[i].master
            assert surface is not None
            assert surface.tangential is not None
            wrenches[i] = -np.einsum("tf,ftw->w", state.impulses[across], surface.tangential)
        springs = [-state.impulses[ports.of(f"force.{name}")] for name in self._springs]
        return Outcome(
            q=state.q, v=state.v, multipliers=self._end_forces[self._normals], impulses=state.impulses[self._normals],
            extreme=state.extreme, counts=state.counts, drags=drags if drags.any() else np.empty(0),
            friction=self._friction(state.unknown[None])[0] if system.rubbing else np.empty((0, 3)),
            springs=np.concatenate([np.empty(0), *springs]), slips=self._slips, rubbed=state.rubbed,
            left=int(state.slides.left[0]), work=self._edge_notes(),
            masters=-inward, master_impulses=state.impulses[self._functions], drag_impulse=drag_impulse,
            master_drags=wrenches,
        )  # fmt: skip
