"""The implicit integrator: builds the arrays of the core's implicit loop from a system."""

import math
from collections.abc import Mapping

import numpy as np

from gudgeon.solver import capabilities, core
from gudgeon.solver.contact.compliance import Compliance
from gudgeon.solver.contact.lcp import empty_set
from gudgeon.solver.contact.pattern import whole
from gudgeon.solver.integrators.flight import flight, memory_of
from gudgeon.solver.integrators.impact_log import Located, impact_log
from gudgeon.solver.integrators.implicit.arrays import Arrays, Drive, Energy, Loads, Masters, Modes, Points
from gudgeon.solver.integrators.implicit.open_contacts import bounds
from gudgeon.solver.integrators.implicit.reading import Ends, Readers
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.integrators.saved import live_arrays, set_arrays
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System

AHEAD = 4096
"""Steps whose loads are computed at once."""
REFRESH = 0.2
"""Share of a traction space's spacing that a pair may slide before its matrix is made anew."""


class Implicit(capabilities.Small):
    """A run of the implicit loop."""

    failure = Result.DEPENDENT_ROWS

    def __init__(self, system: System, dt: float) -> None:
        self._system, self._dt = system, dt
        self.modes = _modes(system, dt)
        self.points = _points(system, dt)
        self.masters = _masters(system, dt, self.modes)
        self.loads = _loads(system, dt, self.modes, self.points)
        self.matrix = _matrix(system, self.modes, self.points, self.masters)
        self.bounds = bounds(system, self.points.memory, self.masters.memory)
        self.energy = _energy(system, self.points, self.loads)
        self._arrays = Arrays(
            dt=dt, modes=self.modes, points=self.points, masters=self.masters, matrix=self.matrix, loads=self.loads,
            bounds=self.bounds, energy=self.energy,
            log=impact_log(system.first_rows, dt, system.separation, system.windows),
        )  # fmt: skip
        self._located = Located(self._arrays.log)
        self._ahead = 0, Drive(np.empty((0, 0)), np.empty((0, 0, 0)))
        self._loop = core.Implicit(self._arrays)
        self._readers = Readers(system)

    def advance(self, start_step: int, stride: int, out: Samples) -> bool:
        """Fill samples of `stride` steps; False where the run cannot continue."""
        count = len(out.forces)
        drive = self._drive(start_step, count * stride)
        if not self._readers.present:
            if not self._loop.march(drive, out, start_step, stride):
                return False
        else:
            # The loop reads no gauges and probes: with any it is called for one sample at a time, with the same bits.
            points, functions = self.points, self.masters.function_forces[1]
            arrays = self.modes.q, self.modes.v, points.multipliers, self.loads.amount, functions
            ends = Ends.of(count, arrays)
            for i in range(count):
                steps = slice(i * stride, (i + 1) * stride)
                step = Drive(drive.loads[steps], drive.crank[steps])
                if not self._loop.march(step, out.part(slice(i, i + 1)), start_step + i * stride, stride):
                    return False
                for values, array in zip(ends, arrays, strict=True):
                    values[i] = array
            self._readers.read(ends, self._dt * (start_step + stride * np.arange(1, count + 1)), out)
        if not self._located.take():
            self.failure = Result.IMPACTS
            return False
        return True

    def impacts(self) -> list[np.ndarray]:
        return self._located.impacts()

    def state(self) -> dict[str, np.ndarray]:
        """Return all that the run goes on from, by name; see `Marching`."""
        return live_arrays(self._arrays, "arrays") | {"impacts": self._located.state()}

    def resume(self, stored: Mapping[str, np.ndarray]) -> None:
        """Go on from a state, with the same bits."""
        set_arrays(live_arrays(self._arrays, "arrays"), stored)
        self._located.resume(stored["impacts"])

    def _drive(self, start_step: int, count: int) -> Drive:
        """Return the given loads and the crank pins of some steps; computed for many at once."""
        block_start, drive = self._ahead
        if not block_start <= start_step <= start_step + count <= block_start + len(drive.loads):
            block_start = start_step
            remaining = math.ceil(self._system.scene.run.duration / self._dt * (1 - 1e-12)) - start_step
            start = self._dt * np.arange(start_step, start_step + max(count, min(remaining, AHEAD)))
            driving = self._system.driving
            # In rows one after the other, so that all parts have the same type.
            loads, crank = driving.loads(start, self._dt), driving.crank(start + self._dt)
            drive = Drive(np.ascontiguousarray(loads), np.ascontiguousarray(crank))
            self._ahead = block_start, drive
        span = slice(start_step - block_start, start_step - block_start + count)
        return Drive(drive.loads[span], drive.crank[span])

    def outcome(self) -> Outcome:
        points, masters, energy = self.points, self.masters, self.energy
        functions, span = masters.residual_force.nonzero()[0], slice(*masters.span)
        inward = self.modes.q[span] @ masters.columns[span]
        if len(functions):
            loaded = slice(functions[0], functions[-1] + 1)
            inward += masters.residual_force[loaded] @ masters.residual[loaded]
        return Outcome(
            q=self.modes.q, v=self.modes.v, multipliers=points.multipliers, impulses=points.impulses,
            extreme=energy.extreme, counts=energy.counts, masters=-inward, master_impulses=masters.impulses,
            drag_impulse=masters.drag_impulse, left=int(masters.left[0]),
        )  # fmt: skip


def _damped_memory(beta: np.ndarray, dt: float) -> np.ndarray:
    """Return a and b of the backward rule, under which constraint forces do not alternate, (2, n)."""
    ratio = beta / dt
    return np.array([ratio / (1 + ratio), 1 / (1 + ratio)])


def _span(rows: np.ndarray) -> np.ndarray:
    """Return the first and last + 1 column that is not zero, (2,)."""
    touched = np.flatnonzero(np.abs(rows).max(axis=0)) if len(rows) else np.empty(0, int)
    return np.array([touched[0], touched[-1] + 1] if len(touched) else [0, 0], np.int64)


def _modes(system: System, dt: float) -> Modes:
    step, m = flight(system.stiffness, system.damping, dt), len(system.velocity)
    return Modes(
        q=system.position.copy(), v=system.velocity.copy(), before=np.zeros((2, m)), force=np.zeros(m),
        end_force=np.zeros(m), moved=np.zeros(m), motion=step.motion, push=step.push, loss=step.loss,
        stiffness=system.stiffness, gravity=system.driving.gravity,
    )  # fmt: skip


def _points(system: System, dt: float) -> Points:
    rows, c = system.rows.dense(), len(system.rows)
    beta = np.array([system.bodies[item.body].stiffness_factor for item in system.contacts])[system.contact_of]
    zeros = {name: np.zeros(c) for name in _PER_ROW}
    forces = system.start_forces
    zeros["response"], zeros["residual_displacement"] = (system.residual @ forces for _ in range(2))
    zeros["total_displacement"] = zeros["response"] + system.driving.to_gap @ system.loads
    zeros["multipliers"], zeros["residual_force"] = forces.copy(), forces.copy()
    closed = np.flatnonzero(forces)
    rows_closed, amounts = np.zeros((2, c), np.int64), np.zeros((2, c))
    rows_closed[1, : len(closed)], amounts[1, : len(closed)] = closed, forces[closed]
    return Points(
        rows=rows, columns=np.ascontiguousarray(rows.T), span=_span(rows), coordinates=np.arange(*_span(rows)),
        gap=system.gap, layer=system.layer,
        residual=system.residual.dense(), memory=memory_of(beta, dt), contact=system.contact_of, active=empty_set(c),
        directions=system.directions, followed=np.ones(len(system.contacts), np.bool_),
        pressed=rows_closed, amounts=amounts, counts=np.array([0, len(closed)], np.int64),
        **zeros,
    )  # fmt: skip


_PER_ROW = (
    "multipliers", "last", "guess", "response", "residual_force", "residual_displacement", "total_displacement",
    "end_residual_force", "end_total_displacement", "free", "shifted", "gaps", "impulses",
)  # fmt: skip


def _masters(system: System, dt: float, modes: Modes) -> Masters:
    functions, count, k = system.functions.dense(), len(system.functions), len(system.contacts)
    c, m = len(system.gap), len(modes.q)
    chart, slide, height = np.ones((k, 2)), np.zeros((k, m)), np.zeros(c)
    beta, start = np.zeros(count), np.full(c, -1)
    for i, item in enumerate(system.contacts):
        if (surface := item.master) is None:
            continue
        chart[i], height[item.rows] = surface.chart, surface.height
        start[item.rows] = np.where(surface.place >= 0, item.functions.start + surface.place, -1)
        beta[item.functions] = system.bodies[surface.body].stiffness_factor
        for name, sign in ((item.body, 1.0), (surface.body, -1.0)):
            body, start_column = system.bodies[name], system.offsets[name]
            centre = body.morph.centre[None]
            slide[i, start_column : start_column + body.rigid_count] += (
                sign * body.rigid_rows(centre, surface.direction[None])[0]
            )
    sigma = np.stack([slide @ modes.q, slide @ modes.q, np.full(k, np.inf)])
    zeros = {name: np.zeros(count) for name in _PER_FUNCTION}
    return Masters(
        functions=functions, columns=np.ascontiguousarray(functions.T), span=_span(functions),
        coordinates=np.arange(*_span(functions)),
        residual=system.function_residual.dense(), memory=memory_of(beta, dt), chart=chart, height=height, slide=slide,
        start=start, filled=np.zeros((k, 2), np.int64), left=np.zeros(1, np.int64),
        corner=np.full((2, c), -1), near=np.full(c, -1), along=np.zeros((2, 4, c)),
        weights_at=np.full((2, k), np.nan), sigma=sigma, slid=np.zeros(k), drag=np.zeros(k), drag_impulse=np.zeros(k),
        function_forces=np.zeros((3, count)), force=np.zeros(m), numbers=np.zeros(count, np.int64),
        size=np.zeros(1, np.int64), refresh=np.array([REFRESH]), **zeros,
    )  # fmt: skip


_PER_FUNCTION = (
    "residual_force", "residual_displacement", "last_displacement", "response", "inward",
    "amounts", "work", "impulses",
)  # fmt: skip


def _loads(system: System, dt: float, modes: Modes, points: Points) -> Loads:
    driving, joints, c = system.driving, len(system.driving.joints), len(system.gap)
    count, memory = len(driving.rows), _damped_memory(driving.damping, dt)
    ahead = modes.push[0] + 0.5 * dt * modes.push[1]
    per_row = 0.5 * ((driving.rows * ahead) @ points.rows.T) + driving.to_gap.T * points.memory[2]
    A = (driving.rows * ahead) @ driving.rows.T + driving.residual * memory[1]
    gap_per_load = (driving.rows * modes.push[0]) @ points.rows.T + driving.to_gap.T * memory[1][:, None]
    residual_displacement = driving.residual @ system.loads + driving.to_gap.T @ system.start_forces
    start = driving.crank(np.zeros(1))[0]
    rod = np.zeros(joints)
    for j, item in enumerate(driving.joints):
        force = system.loads[2 * j : 2 * j + 2]
        arm = item.anchor + driving.rows[2 * j : 2 * j + 2] @ modes.q - start[j, :2]
        rod[j] = np.hypot(*force) * np.sign(arm @ force)
    return Loads(
        rows=driving.rows, memory=memory, residual=driving.residual, to_gap=np.ascontiguousarray(driving.to_gap.T),
        gap_per_load=gap_per_load, numbers=np.arange(count),
        joint_response=np.array([A[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] for j in range(joints)]).reshape(-1, 2, 2),
        joint_per_row=per_row[: 2 * joints],
        anchor=np.array([item.anchor for item in driving.joints]).reshape(joints, 2),
        lengths=np.array([item.joint.rod_length for item in driving.joints]), residual_force=system.loads.copy(),
        last_residual_force=system.loads.copy(), residual_displacement=residual_displacement,
        displacement=driving.rows @ modes.q + residual_displacement, amount=np.zeros(count), rod=rod,
        pin=start, direction=np.zeros((joints, 2)), correction=np.zeros(joints),
        correction_before=np.zeros(joints),
        slopes=np.zeros((joints, c)),
    )  # fmt: skip


def _matrix(system: System, modes: Modes, points: Points, masters: Masters) -> Compliance:
    """Return the contact problem's matrix."""
    c, k, count = len(system.gap), len(system.contacts), len(system.functions)
    end = points.memory[2][:, None]
    base = np.diag(system.layer) + 0.5 * ((points.rows * modes.push[0]) @ points.rows.T) + end * points.residual
    functions, end = masters.functions, masters.memory[2][:, None]
    span = slice(*masters.span)
    master = 0.5 * ((functions[:, span] * modes.push[0, span]) @ functions[:, span].T) + end * masters.residual
    space, across = np.zeros((k, 3), np.int64), np.zeros((c, 4))
    for i, item in enumerate(system.contacts):
        if (surface := item.master) is not None:
            space[i] = item.functions.start, *surface.counts
            across[item.rows] = surface.across
    return Compliance(
        pattern=whole(c), values=np.zeros(c * c) if count else base.ravel(), base=base,
        stamp=np.full(c, -1 if count else 0),
        era=np.zeros(1, np.int64), master=master,
        block=np.array([[x.rows.start, x.rows.stop] for x in system.contacts], np.int64).reshape(k, 2),
        candidate=np.ones(k, np.bool_), space=space, corner=np.full(c, -1), across=across, along=np.zeros((4, c)),
        known=np.zeros(k, np.bool_), window=np.zeros((k, 2), np.int64), scratch=np.zeros(count),
        touched=np.zeros(16, np.int64), weights=np.zeros(16),
    )  # fmt: skip


def _energy(system: System, points: Points, loads: Loads) -> Energy:
    q, v = system.position, system.velocity
    residual_work = (
        points.residual_force @ points.total_displacement + loads.residual_force @ loads.residual_displacement
    )
    strain = 0.5 * (system.stiffness @ q**2 + residual_work)
    energies = np.array(
        [0.5 * float(v @ v), float(strain), 0.5 * float(system.layer @ points.multipliers**2), 0.0, 0.0]
    )
    extreme = np.array([energies.sum(), 0.0, 0.0, 0.0])
    return Energy(system.rigid, np.zeros(len(system.rigid) + 1), energies, np.zeros(6, np.int64), extreme)
