"""Duration, steps and integrator of a run."""

from math import isfinite
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.numbers import Duration, Length, RotationAngle, Strict
from gudgeon.solver.vectors import Gravity

STEPPING = {name: one for name, one in INTEGRATORS.items() if not one.own_steps}
"""Integrators with a fixed step."""
DEFAULTS = ", ".join(
    f"{one.step_factor:g}/ω_c ({name}; {one.resolving:g}/ω_c where undamped bodies have nothing but contact over a"
    " compliance, or where a law is the only compliance of a contact point)"
    for name, one in STEPPING.items()
)
LIMITS = ", ".join(f"{one.largest:g}/ω_c ({name})" for name, one in INTEGRATORS.items() if isfinite(one.largest))

FORMER = dict.fromkeys(("explicit", "implicit", "collocation", "discrete-gradient", "general"), "small") | {
    "mechanism": "turning"
}
"""Former names of integrators by the one that has their scenes."""
LEAST_WINDOW = 1e-12
"""Least window over the duration: times of a run have round-off of 1e-16 of it."""


SMALL_ROTATION = 0.05
"""Rotation of a body up to which its motion is small [rad]."""


class Limits(Strict):
    """Range of the motion, which is small: a run that leaves it ends as a failure."""

    angle: RotationAngle = Field(
        default=SMALL_ROTATION,
        description="Largest rotation of a body [rad]: rotations are linear and gyroscopic terms are missing. Also the"
        " largest elastic deflection of a body (root mean square) over its radius of gyration, which estimates the"
        " rotation by bending",
    )
    deflection: RotationAngle = Field(
        default=0.05,
        description="Largest elastic deflection of a body of a mechanism (root mean square over its mass, relative to"
        " its attachment) over its radius of gyration: the deformation of bodies that turn is of second order. A beam"
        " whose end is bent by w has 0.15 to 0.2 w/L relative to its mean axis, 1.7 w/L with attachment 'fixed'",
    )
    offset: Length | None = Field(
        default=None,
        description="Largest lateral offset of the points of a contact against another body while they touch, or over"
        " a curved surface [m]. Default: the distance of neighbouring contact points; of a single point 2 % of its"
        " distance from the centre of mass",
    )


class Run(Strict):
    """Duration, steps and integrator of a run, and its gravity."""

    duration: Duration = Field(description="Duration of the run [s]")
    step: Duration | None = Field(
        default=None,
        description="Time step [s]. Default: the step that run.accuracy requires, found by repeating the run with finer"
        f" steps from 2 times {DEFAULTS} on. A step above the limit of the integrator, {LIMITS}, is divided into"
        " substeps; a step that does not divide the duration is reduced; its error is estimated from a run of twice the"
        " step. Integrator 'event' has no step.",
    )
    accuracy: Annotated[float, Field(ge=1e-12, le=0.1)] | None = Field(
        default=None,
        description="Relative error that determines the step where run.step is left out: with small of"
        " the impulse and the windowed force of each contact and of the energy balance (default 1e-3); with"
        " turning of the motion (default 1e-8); not used by event",
        json_schema_extra={"unit": "1"},
    )
    checks: bool = Field(
        default=True,
        description="Whether the errors of the step and of the modal basis are estimated by further runs, and the step"
        " is chosen by them; false saves the time, and a step left out is then the first one of the integrator",
    )
    tolerance: float = Field(
        default=0.01,
        gt=0,
        le=1,
        description="Estimated relative error of a given step, the modal basis or the mesh above which a run names the"
        " key that reduces it; the estimates are printed in any case",
        json_schema_extra={"unit": "1"},
    )
    window: Duration | None = Field(
        default=None,
        description="Window of peak forces [s]: the mean over it of the mean force over it is reported, and impacts"
        " that are separated by less than it are one. Default of the latter: the longest of the shortest kept periods"
        " of the elastic bodies in contact, times 2.5 unless all contacts have nonlinear laws, at most the duration;"
        " none for rigid bodies. Default of the window: of each contact a tenth of its hardest impact, at most that",
    )
    integrator: Literal["auto", "event", "small", "turning"] = Field(
        default="auto",
        description="event: exact motion between located events, for linear and rigid contact of a few points;"
        " small: exact motion of the modes under mean forces, for every feature of small motion; turning: order 8"
        " with projection, for rigid bodies that turn by any angle, on joints; auto: selected from the features of the"
        " scene",
    )
    stepping: Literal["auto", "explicit", "implicit"] = Field(
        default="auto",
        description="Steps of integrator turning. explicit: of order 8, below about 6 over the highest frequency of a"
        " body; implicit: of order 10 and not bounded by it, for bodies that deform, without contact and without"
        " attachment 'fixed', exponential ones, exact in vibrations, of bodies without joints; auto: explicit ones, and"
        " the others while those are bounded by frequencies and these are longer",
    )
    gravity: Gravity = Field(default=(0.0, 0.0, 0.0), description="Acceleration of gravity [m/s^2]")
    start: Literal["rest", "undeformed"] = Field(
        default="rest",
        description="Shape of the bodies at the start. rest: static equilibrium of the elastic deformation with"
        " gravity, the loads at that time, fields below pull-in and contacts; free rigid motions start as the scene"
        " places them, unless contacts hold them; in mechanisms the shapes that bodies have in their rigid motion,"
        " under loads, joints, gravity and inertia; undeformed: no deformation",
    )
    limits: Limits = Limits()
    samples: int = Field(
        default=4000,
        ge=10,
        le=1_000_000,
        description="Number of points of the force and energy histories, rounded up to a multiple of run.frames",
    )
    frames: int = Field(default=200, ge=2, le=10_000, description="Number of stored deformations")

    @field_validator("integrator", mode="before")
    @classmethod
    def _present(cls, name: object) -> object:
        if isinstance(name, str) and name in FORMER:
            raise ValueError(f"'{name}' given, a former integrator; use '{FORMER[name]}' or 'auto'")
        return name

    @model_validator(mode="after")
    def _window_within(self) -> "Run":
        if self.window is not None and self.window > self.duration:
            raise ValueError(f"window {self.window:g} s is longer than the duration, {self.duration:g} s")
        if self.window is not None and self.window < LEAST_WINDOW * self.duration:
            raise ValueError(
                f"window {self.window:g} s is below {LEAST_WINDOW:g} of the duration, {self.duration:g} s: the times of"
                " forces are not known as finely"
            )
        return self
