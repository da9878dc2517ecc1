"""Steps of a run: how a given duration, samples and frames are divided."""

import math
from dataclasses import dataclass

from gudgeon.solver.system.system import STEP_FACTOR

SAMPLED = ("event", "collocation")
"""Integrators that choose their own steps between samples."""


READS_GAUGES = (*SAMPLED, "discrete-gradient", "kick")
"""Integrators that read gauges at every sample."""


FACTORS: dict[str, float | None] = {"kick": None, "trapezoid": 4.0, "discrete-gradient": 0.05}
"""dt·ω_c that integrators take by themselves; at 0.05 the discrete gradient resolves a blow in about sixty steps."""


LARGEST: dict[str, float] = {"kick": STEP_FACTOR, "trapezoid": 40.0, "discrete-gradient": 0.5, "collocation": 1.0}
"""dt·ω_c of a given step above which it is divided: explicit contact gains energy, the others step over blows."""


UNTOUCHED = 10.0
"""The same where nothing touches: then the motion of the modes is all there is to follow."""


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


def plan_steps(
    duration: float,
    step: float | None,
    samples: int,
    frames: int,
    critical: float,
    factor: float | None = None,
    most: float = STEP_FACTOR,
) -> Schedule:
    """Choose the steps of a run.

    Args:
        step: The scene's [s]; None chooses factor/ω_c, 0.2/ω_c for the explicit integrator.
        critical: ω_c [rad/s].
        factor: dt·ω_c that an integrator takes by itself; None for the explicit one.
        most: dt·ω_c above which a given step is divided.
    """
    # Nothing that moves by itself sets no step: one for each sample does.
    largest = (factor or STEP_FACTOR) / critical if critical > 0 else duration / samples
    if step is None:
        per_frame = max(1, min(round(samples / frames), math.ceil(duration / largest / frames)))
        stride = math.ceil(duration / largest / (frames * per_frame))
        return Schedule(duration / (frames * per_frame * stride), 1, stride, per_frame, frames)
    substeps = parts_of(step, critical, most)
    dt = step / substeps
    count = math.ceil(duration / dt * (1 - 1e-12))
    stride = max(1, count // samples)
    per_frame = max(1, count // (stride * frames))
    frames = math.ceil(count / (stride * per_frame))
    # Whole frames end with the run: steps are as much shorter.
    return Schedule(duration / (stride * per_frame * frames), substeps, stride, per_frame, frames)


def parts_of(step: float, critical: float, most: float) -> int:
    """Return how many equal parts of a given step [s] stay at or below most/ω_c."""
    return max(1, math.ceil(step * critical / most * (1 - 1e-12)))


def sample_plan(duration: float, samples: int, frames: int) -> Schedule:
    """Return the sample intervals of a run whose integrator chooses its own steps."""
    per_frame = max(1, math.ceil(samples / frames))
    return Schedule(duration / (frames * per_frame), 1, 1, per_frame, frames)
