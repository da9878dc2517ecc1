"""Run a compiled system and collect its trajectory."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from modaldb.schema import ContactHistory, Json, Trajectory
from solver import kernel
from solver.quantities import momentum_residual, quantities
from solver.result import Result
from solver.system import STEP_FACTOR, System

CREATED_ENERGY = 0.5
"""Energy error over energy exchanged above which a run is not an answer."""


@dataclass(frozen=True)
class Schedule:
    """Steps, grouped into samples, grouped into frames."""

    dt: float
    """[s]"""
    substeps: int
    """Steps per step that the scene asked for; 1 where the step is automatic."""
    stride: int
    """Steps per sample."""
    samples_per_frame: int
    frames: int

    @property
    def steps(self) -> int:
        return self.stride * self.samples_per_frame * self.frames


def plan_steps(duration: float, step: float | None, samples: int, frames: int, critical: float) -> Schedule:
    """Choose the steps of a run.

    Args:
        step: The scene's [s]; None chooses 0.2/ω_c.
        critical: ω_c [rad/s].
    """
    largest = STEP_FACTOR / critical
    if step is None:
        per_frame = max(1, min(round(samples / frames), math.ceil(duration / largest / frames)))
        stride = math.ceil(duration / largest / (frames * per_frame))
        return Schedule(duration / (frames * per_frame * stride), 1, stride, per_frame, frames)
    substeps = math.ceil(step / largest * (1 - 1e-12))
    dt = step / substeps
    count = math.ceil(duration / dt * (1 - 1e-12))
    stride = max(1, count // samples)
    per_frame = max(1, count // (stride * frames))
    return Schedule(dt, substeps, stride, per_frame, math.ceil(count / (stride * per_frame)))


def simulate(system: System, progress: Callable[[float], None] | None = None) -> Trajectory:
    """Integrate a system over its scene's duration.

    Args:
        progress: Told the share done after every frame; an exception that it raises ends the run.

    Returns:
        The trajectory; a run that failed physically is kept up to its last good frame, with the reason in `result`.

    Raises:
        SolverError: the contact's compliance is singular.
    """
    run = system.scene.run
    critical = system.critical_frequency()
    plan = plan_steps(run.duration, run.step, run.samples, run.frames, critical)
    law, state, histories = _law(system, plan.dt), _state(system, plan.dt), _Histories.empty(system, plan)
    result, done = Result.FINISHED, 0
    for frame in range(plan.frames):
        here = slice(frame * plan.samples_per_frame, (frame + 1) * plan.samples_per_frame)
        forces, energies = histories.forces[here], histories.energies[here]
        sound = kernel.march(law, state, system.rigid, here.start * plan.stride, forces, energies, plan.stride)
        if not sound or not np.isfinite(energies).all():
            result = Result.DEPENDENT_ROWS if not sound else Result.DIVERGED
            break
        histories.frames[frame], histories.velocities[frame] = state.q, state.v
        histories.multipliers[frame] = state.multipliers
        done = frame + 1
        if progress is not None:
            progress(done / plan.frames)
    exchanged = float(state.extreme[2])
    drift = float(state.extreme[1]) / exchanged if exchanged > 0 else 0.0
    if result.ok and drift > CREATED_ENERGY:
        result = Result.ENERGY
    counts = {
        "steps": plan.steps,
        "substeps": plan.substeps,
        "step": plan.dt,
        "critical_frequency": critical,
        "contact_steps": int(state.tally[1]),
        "pivots": int(state.tally[2]),
        "coordinates": len(state.q),
        "contact_rows": len(system.gap),
    }
    return _trajectory(system, plan, state, histories.cut(done, plan), result, drift, counts)


@dataclass(frozen=True)
class _Histories:
    forces: np.ndarray
    energies: np.ndarray
    frames: np.ndarray
    velocities: np.ndarray
    multipliers: np.ndarray

    @classmethod
    def empty(cls, system: System, plan: Schedule) -> "_Histories":
        samples, size = plan.frames * plan.samples_per_frame, len(system.velocity)
        return cls(
            np.zeros((samples, max(1, len(system.contacts)), 3)),
            np.zeros((samples, 4)),
            np.zeros((plan.frames, size)),
            np.zeros((plan.frames, size)),
            np.zeros((plan.frames, len(system.gap))),
        )

    def cut(self, frames: int, plan: Schedule) -> "_Histories":
        """Keep what was finished."""
        samples = frames * plan.samples_per_frame
        return _Histories(
            self.forces[:samples], self.energies[:samples], self.frames[:frames], self.velocities[:frames],
            self.multipliers[:frames],
        )  # fmt: skip


def _trajectory(
    system: System, plan: Schedule, state: kernel.State, found: _Histories, result: Result, drift: float, counts: Json
) -> Trajectory:
    interval = plan.dt * plan.stride
    contacts = {
        contact.name: ContactHistory(
            contact.body, contact.interface, found.forces[:, number], found.multipliers[:, contact.rows],
            contact.areas, contact.points,
        )
        for number, contact in enumerate(system.contacts)
    }  # fmt: skip
    return Trajectory(
        result=result.name,
        bodies={name: body.morph_key for name, body in system.bodies.items()},
        coordinate_offsets=dict(system.offsets),
        times=interval * np.arange(1, len(found.forces) + 1),
        energies=found.energies,
        contacts=contacts,
        frame_times=interval * plan.samples_per_frame * np.arange(1, len(found.frames) + 1),
        frames=found.frames,
        velocities=found.velocities,
        quantities=quantities(system, state, plan.dt, interval, found.forces, found.multipliers),
        energy_drift=drift,
        momentum_residual=momentum_residual(system, state),
        counts=counts,
    )


def _law(system: System, dt: float) -> kernel.Law:
    contact = np.zeros(len(system.gap), np.int64)
    normals = np.zeros((len(system.gap), 3))
    for number, item in enumerate(system.contacts):
        contact[item.rows] = number
        normals[item.rows] = item.directions
    reach = np.abs(system.rows).max(axis=0) if len(system.gap) else np.zeros(len(system.velocity))
    return kernel.Law(
        dt, flight(system.stiffness, dt), system.stiffness, np.ascontiguousarray(system.rows),
        np.ascontiguousarray(system.rows.T), reach, system.gap,
        system.compliance, system.coupled, system.dashpot, normals, contact,
    )  # fmt: skip


def flight(stiffness: np.ndarray, dt: float) -> np.ndarray:
    """Return the exact propagator of each coordinate over dt: q←q, q←q̇, q̇←q, q̇←q̇, (4, m)."""
    omega = np.sqrt(stiffness)
    return np.array(
        [np.cos(omega * dt), dt * np.sinc(omega * dt / np.pi), -omega * np.sin(omega * dt), np.cos(omega * dt)]
    )


def _state(system: System, dt: float) -> kernel.State:
    """Start half a step before the first kick."""
    half = flight(system.stiffness, dt / 2)
    v0 = system.velocity
    c, energy = len(system.gap), 0.5 * float(v0 @ v0)
    return kernel.State(
        half[1] * v0, half[3] * v0, np.zeros(c, np.int64), np.zeros((c, c)), np.zeros(c), np.zeros(c), np.zeros(c),
        np.zeros(len(system.rigid) + 1), np.array([energy, 0.0, 0.0, 0.0]), np.zeros(4, np.int64),
        np.array([energy, 0.0, 0.0, 0.0, -1.0, -1.0]),
    )  # fmt: skip
