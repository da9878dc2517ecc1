"""Time loop of the full FE where points slide or press a layer, and its energy balance.

Work is given by loads and the rod, and as contact energy by points that enter a surface or leave it pressed; the drag
is internal. Contacts exchange ½ (Σ |w_k| + |w_e| + V), with w_k the work of the contact forces so far on each rigid
motion of the slave, w_e that on its deformation and V the contact energy, so that a driven stroke is excluded.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import numpy as np
from threadpoolctl import ThreadpoolController

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.types import Json
from gudgeon.pipeline.nodal.body import MovingBody
from gudgeon.pipeline.nodal.points.loop import simulate_points
from gudgeon.pipeline.nodal.problem import NodalProblem, PointProblem
from gudgeon.pipeline.nodal.quantities import (
    body_quantities,
    energy_drift,
    force_quantities,
    named,
    resultant_quantities,
    windows_of,
)
from gudgeon.pipeline.nodal.sliding.contact import contact_energy
from gudgeon.pipeline.nodal.sliding.coupling import Coupling, StepForces, master_ports, slave_ports
from gudgeon.pipeline.process.clock import Clock, Seconds

PROGRESS_STRIDE = 64


def simulate_nodal(
    problem: NodalProblem | PointProblem, step: float, progress: Callable[[float], None] | None = None
) -> NodalRecord:
    """Integrate a problem with a fixed step [s].

    Args:
        progress: Receives the share done.

    Raises:
        StageError: contact did not converge in a step, or see `MovingBody`.
    """
    with ExitStack() as stack:
        # OpenBLAS uses all cores for vectors of 10⁴ entries, and its threads spin between calls: beside PARDISO and
        # other processes a step took ten times longer.
        stack.enter_context(ThreadpoolController().select(internal_api="openblas").limit(limits=1))
        if isinstance(problem, PointProblem):
            return simulate_points(problem, step, progress)
        clock = Clock()
        count = max(1, round(problem.duration / step))
        run = _Run(problem, step, count)
        stack.callback(run.free)
        for n in range(count):
            run.advance(n)
            if progress is not None and n % PROGRESS_STRIDE == 0:
                progress(n / count)
    return run.record(clock.read())


class _Run:
    def __init__(self, problem: NodalProblem, step: float, count: int) -> None:
        self.problem, self.step, self.times = problem, step, step * np.arange(count + 1)
        self.slave = MovingBody(problem.slave, slave_ports(problem), step)
        self.master = None if problem.master is None else MovingBody(problem.master, master_ports(problem), step)
        self.bodies = [(problem.slave, self.slave)]
        if problem.master is not None and self.master is not None:
            self.bodies.append((problem.master, self.master))
        self.coupling = Coupling(problem, self.slave, self.master)
        # Solves release the interpreter's lock: the master's runs in parallel to the slave's.
        self._pool = ThreadPoolExecutor(1)
        self._loads = [body.load_means(self.times) for body, _ in self.bodies]
        self._pins = np.zeros((count + 1, 0)) if problem.rod is None else np.asarray(problem.rod.crank(self.times))
        self._energies, self._iterations = np.zeros((count + 1, 5)), 0
        self._given, self._exchanged = 0.0, 0.0
        self._on_rigid, self._on_all = np.zeros(self.slave.rigid_count), 0.0
        self._energies[0] = self._balance()
        self._contact_forces = {name: np.zeros((count, 3)) for name in problem.contacts}
        self._rod_force = np.zeros((count, 2))
        self._motion = {body.name: np.zeros((count, 12)) for body, _ in self.bodies if body.twists is not None}
        shares = np.arange(1, problem.frames + 1) / max(1, problem.frames)
        self._frames = np.unique(np.maximum(np.round(count * shares), 1).astype(int))
        self._surfaces: list[np.ndarray] = []
        self._under = {load.travels: (load, []) for load in problem.slave.loads if load.travels}
        self._start = [moving.q.copy() for _, moving in self.bodies]

    def advance(self, n: int) -> None:
        """Make step n."""
        slave, master = self.slave, self.master
        waiting = None if master is None else self._pool.submit(master.predict, self._loads[1][n])
        displacements = slave.predict(self._loads[0][n])
        inward = np.zeros(0) if waiting is None else waiting.result()
        step_forces = self.coupling.solve(displacements, inward, self._pins[n : n + 2])
        growth = slave.advance(step_forces.ports)
        if master is not None:
            master.advance(step_forces.functions)
        port_change = self.coupling.finish(inward if master is None else master.places())
        self._keep(n, step_forces)
        self._account(n, step_forces, port_change, growth)

    def free(self) -> None:
        """Release the factors' memory and the thread."""
        self._pool.shutdown()
        for _, moving in self.bodies:
            moving.free()

    def record(self, taken: Seconds) -> NodalRecord:
        """Return the record of the run, which took some time."""
        forces = dict(self._contact_forces)
        total = np.sum([np.zeros((len(self.times) - 1, 3)), *forces.values()], axis=0)
        if self.problem.rod is not None:
            forces[self.problem.rod.name] = self._rod_force @ self.problem.rod.directions
        surfaces = self.coupling.surfaces
        masters = {
            name: np.array([-inward[surfaces.functions[k]] for inward in self._surfaces])
            for k, name in enumerate(self.problem.contacts)
            if k in surfaces.sliding and self._surfaces
        }
        return NodalRecord(
            step=self.step, times=self.times[1:], force=total, energies=self._energies[1:, :3].copy(),
            energy_drift=energy_drift(self._energies, self._exchanged),
            coordinates=sum(len(moving.u) for _, moving in self.bodies),
            newton_iterations=self._iterations, wall_seconds=taken.wall, cpu_seconds=taken.cpu, forces=forces,
            motion=self._motion, masters=masters,
            frame_times=self.times[self._frames] if self.problem.frames else None,
            quantities=self._quantities(),
        )  # fmt: skip

    def _quantities(self) -> Json:
        """Return the run's quantities, named as the solver's."""
        quantities: Json = {}
        for name, forces in self._contact_forces.items():
            windows = windows_of(self.problem.window, self.times, None, True, forces)
            quantities |= named(name, resultant_quantities(self.times, forces, windows))
        for body, moving in self.bodies:
            quantities |= body_quantities(body.name, body.centre_motion(moving.motion()))
        for load, moved in self._under.values():
            quantities |= force_quantities(load, self.times[self._frames], np.array(moved))
        return quantities

    def _keep(self, n: int, step_forces: StepForces) -> None:
        self._iterations += step_forces.iterations
        for (name, contact), points in zip(self.problem.contacts.items(), self.coupling.surfaces.points, strict=True):
            self._contact_forces[name][n] = step_forces.multipliers[points] @ contact.directions
        if self.problem.rod is not None:
            c = len(step_forces.multipliers)
            self._rod_force[n] = step_forces.ports[c : c + 2]
        for (body, moving), start in zip(self.bodies, self._start, strict=True):
            if body.twists is not None:
                self._motion[body.name][n, :6] = (moving.q - start) @ body.twists
                self._motion[body.name][n, 6:] = moving.p @ body.twists
        if n + 1 in self._frames:
            self._surfaces.append(self.coupling.inward.copy())
            for load, moved in self._under.values():
                moved.append(load.rows @ self.slave.motion()[0])

    def _account(self, n: int, step_forces: StepForces, port_change: np.ndarray, growth: np.ndarray) -> None:
        """Add a step to the energies and to what contacts exchange.

        Args:
            port_change: Change of the slave's ports [m].
            growth: Change of its rigid coordinates.
        """
        c = len(step_forces.multipliers)
        if self.problem.rod is not None:
            self._given += float(step_forces.ports[c : c + 2] @ port_change[c : c + 2])
        self._given += step_forces.edge
        acting = np.flatnonzero(step_forces.multipliers)
        if len(acting):
            force = step_forces.multipliers[acting]
            self._on_rigid += (force @ self.slave.ports_rigid[acting]) * growth
            self._on_all += float(force @ port_change[acting])
        self._energies[n + 1] = self._balance()
        remainder = self._on_all - float(self._on_rigid.sum())
        exchanged = np.abs(self._on_rigid).sum() + abs(remainder) + self._energies[n + 1, 2]
        self._exchanged = max(self._exchanged, 0.5 * float(exchanged))

    def _balance(self) -> tuple[float, float, float, float, float]:
        """Return kinetic, strain, contact, dissipated energy and work given now [J]."""
        moving = [moving for _, moving in self.bodies]
        kinetic, strain = sum(body.kinetic for body in moving), sum(body.strain for body in moving)
        contact = contact_energy(self.coupling.stiffness, self.coupling.gap)
        dissipated = sum(body.dissipated for body in moving)
        return kinetic, strain, contact, dissipated, self._given + sum(body.work for body in moving)
