"""A system that its caller steps: state and ports by name, forces set between steps, checkpoints."""

import hashlib
import io
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.errors import SolverError
from gudgeon.solver.integrators.choice import choose, critical_frequency
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.integrators.steps import driven_step, largest_factor, own_step, parts_of, refuse_unread, step_factor
from gudgeon.solver.linear.load_stiffness import with_load_stiffness
from gudgeon.solver.ports.members import function_ports
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.ports.table import Kind
from gudgeon.solver.ports.uniqueness import refuse_ambiguous_friction
from gudgeon.solver.scene.refusals import suggestion
from gudgeon.solver.system.bases.swaps import refuse_swaps
from gudgeon.solver.system.system import System

ENERGIES = ("kinetic", "strain", "contact", "dissipated", "work")
ROUND_OFF = 1e-9
"""Share of a step by which a time asked for may lie beside a step's end."""


class BodyState(NamedTuple):
    """Motion of a body's centre since the start, and its elastic coordinates."""

    displacement: np.ndarray
    """[m], (3,)"""
    rotation: np.ndarray
    """[rad], (3,)"""
    velocity: np.ndarray
    """[m/s], (3,)"""
    angular_velocity: np.ndarray
    """[rad/s], (3,)"""
    elastic: np.ndarray
    """[m kg^½], (m,)"""


class PortState(NamedTuple):
    """The ports of a contact, joint or force: a contact's are its points, each followed by its tangents."""

    displacement: np.ndarray
    """Gap of a contact, elongation of a spring, displacement along a force [m], (n,)."""
    force: np.ndarray
    """At the end of the step [N], (n,)."""


class Steps:
    """Steps of integrator `small`, one call at a time."""

    def __init__(self, system: System, step: float | None = None) -> None:
        """Start at time zero.

        Args:
            step: [s]; default: run.step, or the integrator's own. A step above its limit is refused.

        Raises:
            SolverError: the step is too long.
        """
        if system.scene.capabilities.turns:
            raise SolverError("run.integrator: bodies that turn by any angle, 'turning', cannot be stepped from Python")
        refuse_swaps(system, "steps from Python are of one basis")
        refuse_ambiguous_friction(system)
        system = with_load_stiffness(system)
        self.system, integrator = system, INTEGRATORS["small"]
        critical, largest = critical_frequency(system), largest_factor(system, integrator)
        prescribed = step or system.scene.run.step
        chosen = choose(system)[1] or critical
        self.dt = prescribed or min(
            own_step(system.scene.run, step_factor(system, integrator, chosen), chosen), driven_step(system)
        )
        if not prescribed and len(system.gap):
            self.dt /= parts_of(self.dt, critical, largest)
        if not self.dt > 0:
            raise SolverError(f"run.step: {self.dt:g} s given; a step above zero is needed")
        if len(system.gap) and parts_of(self.dt, critical, largest) > 1:
            raise SolverError(
                f"run.step: {self.dt:g} s exceeds the limit of integrator 'small',"
                f" {largest / critical:.3g} s; use a smaller step"
            )
        refuse_unread(system, self.dt)
        self.system = at_rest(system)
        self._run, self._done = Small(self.system, self.dt), 0
        self._state, self._problem, self._log = self._run.arrays.state, self._run.arrays.problem, self._run.arrays.log
        self._given = {load.name: slice(rows.start - 2 * len(system.driving.joints),
                                        rows.stop - 2 * len(system.driving.joints))
                       for load, rows in system.driving.given_rows()}  # fmt: skip
        self._applied = np.full(max((rows.stop for rows in self._given.values()), default=0), np.nan)
        for name in system.scene.external():
            self._applied[self._given[name]] = 0.0

    @property
    def time(self) -> float:
        """Time at the end of the last step [s]."""
        return self._done * self.dt

    @property
    def steps(self) -> int:
        """Number of steps taken."""
        return self._done

    def step(self, steps: int = 1, *, until: float | None = None) -> None:
        """Take steps, one by default, or all until a time [s].

        Raises:
            SolverError: the time has passed, or the contact forces of a step were not found.
        """
        if until is not None:
            steps = int(np.ceil((until - self.time) / self.dt - ROUND_OFF))
            if steps < 0:
                raise SolverError(f"until {until:g} s: the time is {self.time:g} s already")
        if steps <= 0:
            return
        if not self._run.advance_bare(self._done, steps, self._applied):
            raise SolverError(f"time {self.time:.6g} s: {self._run.failure.value}")
        self._done += steps

    def force(self, name: str) -> np.ndarray:
        """Return the amounts of a given force [N], which the caller may write, (k,); NaN: as the scene gives it."""
        if name not in self._given:
            raise SolverError(f"force {_known(name, self._given)}")
        return self._applied[self._given[name]]

    def apply(self, name: str, amount: float | np.ndarray) -> None:
        """Set a given force [N], until it is set again."""
        self.force(name)[:] = amount

    def body(self, name: str) -> BodyState:
        """Return the state of a body."""
        if name not in self.system.bodies:
            raise SolverError(f"body {_known(name, self.system.bodies)}")
        body, state = self.system.bodies[name], self._state
        position, rate = body.centre_motion(state.q[body.rigid]), body.centre_motion(state.v[body.rigid])
        return BodyState(position[:3], position[3:], rate[:3], rate[3:], state.q[body.elastic].copy())

    @property
    def ports(self) -> list[str]:
        """Names of the contacts, joints and forces that have ports."""
        return [block.name for block in self._run.ports.blocks if block.kind != Kind.SURFACE]

    def port(self, name: str) -> PortState:
        """Return displacement and force of the ports of `contact.NAME`, `joint.NAME` or `force.NAME`."""
        if name not in self.ports:
            raise SolverError(f"port {_known(name, self.ports)}")
        moved, span = self._displaced(name), self._run.ports.of(name)
        for contact in self.system.contacts:
            if contact.master is not None and name == f"contact.{contact.name}":
                slid, inward = self.system.slid(contact, self._state.q), self._displaced(f"surface.{contact.name}")
                start = self._run.ports.of(f"surface.{contact.name}").start
                surface_motion = [contact.master.at_points(slid, inward[port - start]) for port in
                       function_ports(self._run.ports, contact)]  # fmt: skip
                moved = moved + np.column_stack(surface_motion).ravel()
        return PortState(moved, self._state.unknown[span].copy())

    def _displaced(self, name: str) -> np.ndarray:
        """Return the displacement of ports by their own rows [m], (n,)."""
        table, state, residual = self._run.ports, self._state, self._run.arrays.constants.residual.values
        span = table.of(name)
        moved = table.offset[span] + (table.rows @ state.q)[span]
        for table_side, force in zip(residual, state.held, strict=True):
            moved = moved + (table.pairs.matrix(table_side) @ force)[span]
        return moved

    def contact(self, name: str) -> PortState:
        """Return the gaps and normal forces of a contact's points."""
        ports, span = self.port(f"contact.{name}"), self._run.ports.of(f"contact.{name}")
        each = 3 if self._run.ports.kind[span.start] in (Kind.CONE, Kind.RUBBING_LAW) else 1
        return PortState(ports.displacement[::each], ports.force[::each])

    @property
    def energies(self) -> dict[str, float]:
        """Kinetic, strain, contact and dissipated energy, and the work of loads [J]."""
        return dict(zip(ENERGIES, map(float, self._state.parts), strict=True))

    def checkpoint(self) -> bytes:
        """Return the state, from which `restore` continues with the same bits."""
        entries = {f"{group}.{key}": value for group, arrays in self._arrays() for key, value in arrays.items()}
        text = io.BytesIO()
        np.savez_compressed(
            text, allow_pickle=False, fingerprint=np.array(self._fingerprint()), done=np.array(self._done),
            applied=self._applied, **entries,
        )  # fmt: skip
        return text.getvalue()

    def load(self, checkpoint: bytes) -> None:
        """Take the state of a checkpoint of the same system with the same step.

        Raises:
            SolverError: it is none, or of another system or step.
        """
        try:
            with np.load(io.BytesIO(checkpoint), allow_pickle=False) as file:
                stored = dict(file)
        except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
            raise SolverError(f"checkpoint: it cannot be read ({error})") from None
        targets = {f"{group}.{key}": value for group, arrays in self._arrays() for key, value in arrays.items()}
        same = str(stored.get("fingerprint")) == self._fingerprint()
        if not same or not targets.keys() <= stored.keys():
            raise SolverError("checkpoint: it is of another scene, release or step; restore it with its own")
        for key, value in targets.items():
            value[...] = stored[key]
        self._applied[:], self._done = stored["applied"], int(stored["done"])

    def _arrays(self) -> list[tuple[str, Mapping[str, np.ndarray]]]:
        """Return all arrays that change from step to step."""
        groups = {"state": self._state, "problem": self._problem, "log": self._log, "slides": self._state.slides,
                  "active": self._problem.active, "matrix": self._problem.matrix}  # fmt: skip
        columns = self._run.arrays.constants.columns

        def changes(value: object) -> bool:
            return isinstance(value, np.ndarray) and not np.may_share_memory(value, columns)

        return [
            (name, {key: value for key, value in group._asdict().items() if changes(value)})
            for name, group in groups.items()
        ]

    def _fingerprint(self) -> str:
        """Return a hash of everything that does not change in the run."""
        seal = hashlib.sha256()
        for name, value in self._run.arrays.constants._asdict().items():
            for item in _flat(value):
                seal.update(name.encode() + np.ascontiguousarray(item).tobytes())
        return seal.hexdigest()


def _flat(value: object) -> Iterator[object]:
    """Yield the arrays and numbers of a value and of the tuples within it."""
    if isinstance(value, tuple):
        for item in value:
            yield from _flat(item)
    else:
        yield value


def _known(name: str, members: Iterable[str]) -> str:
    able = list(members)
    return f"'{name}' is unknown, {suggestion(name, able)}the scene has {', '.join(able) or 'none'}"
