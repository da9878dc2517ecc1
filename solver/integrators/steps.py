"""Steps of a run: how a given duration, samples and frames are divided."""

import math
from dataclasses import dataclass, replace

import numpy as np

from gudgeon.solver.capabilities import INTEGRATORS, MANY, UNTOUCHED, Integrator
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.breaks import FINEST
from gudgeon.solver.integrators.choice import choose
from gudgeon.solver.ports.stick import sticks
from gudgeon.solver.scene.run import Run
from gudgeon.solver.system.drives import DrivenRows
from gudgeon.solver.system.system import System

MOST_SAMPLES = 200_000
"""Samples of a run at most where its scene asks for fewer."""
FOLLOWED, PASSED_OVER = 0.02, 0.25
"""Difference of a driven motion from the lines between the ends of steps, over its range: at most where steps are
chosen, and that above which steps do not read it."""
MOST_STEPS = 10**11
"""Steps of a run at most: hours of the fastest time loop."""


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

    @property
    def interval(self) -> float:
        """Sample interval [s]."""
        return self.dt * self.stride

    def finer(self, halvings: int, samples: int) -> "Schedule":
        """Return the schedule with steps halved so often, frames as before, and as many samples as are asked for."""
        stride, per_frame = self.stride * 2**halvings, self.samples_per_frame
        while stride % 2 == 0 and 2 * per_frame * self.frames <= samples:
            stride, per_frame = stride // 2, 2 * per_frame
        return replace(self, stride=stride, samples_per_frame=per_frame, dt=self.dt / 2**halvings)

    def sampled(self, interval: float, *, divides: bool) -> "Schedule":
        """Return the schedule with samples at most so far apart [s], `MOST_SAMPLES` at most.

        Args:
            divides: Whether steps may be divided, which only end at samples; otherwise a sample has one step at least.
        """
        limit = MOST_SAMPLES // (self.samples_per_frame * self.frames)
        divisions = min(math.ceil(self.interval / interval * (1 - 1e-9)), limit)
        if divisions <= 1:
            return self
        if not divides:
            divisions = next((d for d in range(divisions, self.stride) if self.stride % d == 0), self.stride)
        stride, dt = (self.stride, self.dt / divisions) if divides else (self.stride // divisions, self.dt)
        return replace(self, stride=stride, dt=dt, samples_per_frame=self.samples_per_frame * divisions)


@dataclass(frozen=True)
class Plan:
    """What a compiled system is run with."""

    name: str
    critical: float
    """ω_c that sets the step [rad/s]; 0 where the integrator chooses its steps."""
    schedule: Schedule
    fixed_step: float | None = None
    """Step that an integrator of own steps is held to [s]; None where its accuracy sets them."""

    @property
    def integrator(self) -> type[Integrator]:
        return INTEGRATORS[self.name]

    def finer(self, halvings: int, samples: int) -> "Plan":
        """Return the plan with finer steps, see `Schedule.finer`."""
        return replace(self, schedule=self.schedule.finer(halvings, samples))

    @property
    def step(self) -> float:
        """Step of its integrator [s]; the sample interval where the integrator chooses its steps."""
        return self.schedule.dt if self.fixed_step is None else self.fixed_step

    def within(self, step: float) -> "Plan":
        """Return the plan with steps of a given length at most [s], and its frames and samples."""
        schedule = self.schedule
        stride = math.ceil(schedule.interval / step * (1 - 1e-12))
        return replace(self, schedule=replace(schedule, dt=schedule.interval / stride, stride=stride))

    def halved(self, samples: int) -> "Plan":
        """Return the plan with half of a given step."""
        return self.finer(1, samples) if self.fixed_step is None else replace(self, fixed_step=self.fixed_step / 2)

    def sampled(self, interval: float) -> "Plan":
        """Return the plan with the same steps and closer samples, see `Schedule.sampled`."""
        return replace(self, schedule=self.schedule.sampled(interval, divides=self.integrator.own_steps))


def plan_run(system: System, coarser: float = 1.0) -> Plan:
    """Choose the integrator and the steps of a run.

    Args:
        coarser: Factor of a step that is left out.

    Raises:
        SolverError: the contact's compliance is singular.
    """
    name, critical = choose(system)
    run, integrator = system.scene.run, INTEGRATORS[name]
    if not integrator.own_steps:
        largest = largest_factor(system, integrator)
        # Errors by steps do not say what none of them reads.
        factor = step_factor(system, integrator, critical)
        read = factor / driven_step(system) if run.step is None else 0.0
        return Plan(name, critical, plan_steps(run, factor, max(critical / coarser, read), largest))
    per_frame = max(1, math.ceil(run.samples / run.frames))
    schedule = Schedule(run.duration / (run.frames * per_frame), 1, 1, per_frame, run.frames)
    return Plan(name, 0.0, schedule, run.step)


def driven_step(system: System) -> float:
    """Return the longest step that reads all driven motions [s], at most one for each sample; infinite without any."""
    run = system.scene.run
    longest = run.duration / run.samples
    for drive in system.driving.drives:
        longest, _ = _followed(drive, run.duration, longest, FOLLOWED)
    return longest if system.driving.drives else math.inf


def refuse_unread(system: System, step: float) -> None:
    """Raise a SceneError where steps [s] pass over a part of a driven motion."""
    for drive in system.driving.drives:
        longest, time = _followed(drive, system.scene.run.duration, step, PASSED_OVER)
        if longest < step:
            raise SceneError(
                f"motion.{drive.name}: it moves and comes back near t = {time:.6g} s between the ends of two steps of"
                f" {step:.3g} s, which do not read it; set run.step = {longest:.2g} or leave it out"
            )


def _followed(drive: DrivenRows, duration: float, step: float, fraction: float) -> tuple[float, float]:
    """Return the longest step between whose ends a motion follows lines, by halvings of a given one [s], and the time
    at which it differs most from them [s].

    Args:
        fraction: Of the range of the motion, by which it may differ.

    Raises:
        SceneError: it jumps.
    """
    key, knots = f"motion.{drive.name}", [time for time, _ in drive.motion.values if 0 < time < duration]
    grid = np.union1d(np.linspace(0.0, duration, FINEST + 1), knots)
    if (jump := drive.motion.jump(grid, key)) is not None:
        raise SceneError(f"{key}.expression: it jumps at t = {jump:.6g} s; a body moves continuously")

    def read(times: np.ndarray) -> np.ndarray:
        return drive.motion.places(times, key)[:, 0]

    values, worst = read(grid), 0.0
    size = float(np.ptp(values))
    while size > 0 and duration < step * len(grid):
        ends = np.append(np.arange(0.0, duration, step), duration)
        deviation = np.abs(values - np.interp(grid, ends, read(ends)))
        if deviation.max() <= fraction * size:
            break
        worst, step = float(grid[deviation.argmax()]), 0.5 * step
    return step, worst


def largest_factor(system: System, integrator: type[Integrator]) -> float:
    """Return the largest dt·ω_c of a given step that is not divided."""
    if not len(system.gap):
        return min(integrator.largest, UNTOUCHED)
    largest = min(integrator.largest, integrator.sticking) if sticks(system) else integrator.largest
    if integrator.resolving is None or not on_laws_alone(system, system.residual.diagonal()):
        return largest
    return min(largest, integrator.resolving)


def step_factor(system: System, integrator: type[Integrator], critical: float) -> float:
    """Return dt·ω_c of the default step of an integrator; one that resolves contact where nothing else acts, or where
    a law is the only compliance of a point, unless so many points would take too many.

    Args:
        critical: ω_c [rad/s].
    """
    resolving = (
        integrator.resolving if system.scene.impulsive or on_laws_alone(system, system.compliance.diagonal()) else None
    )
    if resolving is None or system.scene.run.duration * critical / resolving * len(system.gap) > MANY:
        return integrator.step_factor
    return resolving


def on_laws_alone(system: System, compliance: np.ndarray) -> bool:
    """Return whether a law is the only compliance of a contact point: it sets the duration of contact.

    Args:
        compliance: Of the points beside it [m/N], (c,).
    """
    return bool(((system.law[:, 0] > 0) & ~(compliance > 0)).any())


def plan_steps(run: Run, factor: float, critical: float, largest: float) -> Schedule:
    """Choose the steps of an integrator that has no steps of its own.

    Args:
        factor: dt·ω_c of the default step.
        critical: ω_c [rad/s].
        largest: dt·ω_c above which a given step is divided.
    """
    duration, samples, frames = run.duration, run.samples, run.frames
    _refuse_endless(run, factor, critical)
    if run.step is None:
        step = own_step(run, factor, critical)
        per_frame = max(1, min(round(samples / frames), math.ceil(duration / step / frames)))
        stride = math.ceil(duration / step / (frames * per_frame))
        return Schedule(duration / (frames * per_frame * stride), 1, stride, per_frame, frames)
    substeps = parts_of(run.step, critical, largest)
    dt = run.step / substeps
    count = math.ceil(duration / dt * (1 - 1e-12))
    stride = max(1, count // samples)
    per_frame = max(1, count // (stride * frames))
    frames = math.ceil(count / (stride * per_frame))
    # Whole frames end with the run: steps are as much shorter.
    return Schedule(duration / (stride * per_frame * frames), substeps, stride, per_frame, frames)


def _refuse_endless(run: Run, factor: float, critical: float) -> None:
    """Raise SceneError if a run would have more steps than can be taken, or its critical frequency is not finite."""
    shortest = own_step(run, factor, critical) if math.isfinite(critical) else 0.0
    shortest = shortest if run.step is None else min(shortest, run.step)
    if run.duration > MOST_STEPS * shortest:
        cause = (
            f"run.step = {run.step:g} s"
            if run.step is not None and shortest == run.step
            else f"ω_c = {critical:g} rad/s"
        )
        raise SceneError(
            f"run.duration: {run.duration:g} s given; with {cause} the run has more than {MOST_STEPS:.0e} steps:"
            " shorten it, or check the units of stiffnesses, masses and lengths"
        )


def parts_of(step: float, critical: float, most: float) -> int:
    """Return how many equal parts of a given step [s] stay at or below most/ω_c."""
    return max(1, math.ceil(step * critical / most * (1 - 1e-12)))


def own_step(run: Run, factor: float, critical: float) -> float:
    """Return the largest step of an integrator left to itself, of a dt·ω_c [s]."""
    # Nothing that moves by itself sets no step: one for each sample does.
    return factor / critical if critical > 0 else run.duration / run.samples
