"""The solver's part of a scene: bodies, contacts, and how long to run. SI units."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from solver.forces import Force
from solver.forces.gas import GasPressure
from solver.forces.moving import MovingForce
from solver.forces.spring import Spring
from solver.joints import Joint
from solver.laws import Law
from solver.methods import METHODS
from solver.obstacles import Bore, Plane
from solver.obstacles.vectors import Direction, Vector

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Freedom = Literal["x", "y", "z", "rx", "ry", "rz"]
ALL_FREE: tuple[Freedom, ...] = ("x", "y", "z", "rx", "ry", "rz")
Integrator = Literal["event", "collocation", "discrete-gradient", "kick", "trapezoid"]
STRICT = ConfigDict(extra="forbid", frozen=True)


class Damping(BaseModel):
    """Stiffness-proportional damping, given by the ratio that it has at one frequency."""

    model_config = STRICT
    ratio: Annotated[float, Field(gt=0, lt=1, allow_inf_nan=False, description="Of critical damping")]
    frequency: Positive = Field(description="Where it holds [Hz]")

    @property
    def stiffness_factor(self) -> float:
        """β of C = β K [s]; the ratio at ω is βω/2."""
        return self.ratio / (3.141592653589793 * self.frequency)


class Body(BaseModel):
    """A component put into the scene."""

    model_config = STRICT
    component: str | None = Field(default=None, description="Name of its component; the body's own name by default")
    position: Vector = Field(
        default=(0.0, 0.0, 0.0), description="Where the component's origin stands at the start [m]"
    )
    velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="Of the centre of mass at the start [m/s]")
    angular_velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="At the start [rad/s]")
    freedom: tuple[Freedom, ...] = Field(default=ALL_FREE, description="Rigid motions that it may make; all by default")
    damping: Damping | None = None
    gauges: tuple[str, ...] = Field(default=(), description="Gauges of its component to read over time")


class MasterSurface(BaseModel):
    """The traction space of another body, over which the points slide."""

    model_config = STRICT
    shape: Literal["surface"]
    body: str
    interface: str = Field(description="Interface of kind 'traction'")


class OtherBody(BaseModel):
    """An interface of another body, point against point."""

    model_config = STRICT
    shape: Literal["body"]
    body: str
    interface: str = Field(description="Interface of kind 'points' or 'patch' with as many points")


class Friction(BaseModel):
    """Coulomb friction along one line."""

    model_config = STRICT
    static: Annotated[float, Field(ge=0, allow_inf_nan=False, description="Coefficient that holds")]
    kinetic: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = Field(
        default=None, description="Coefficient while sliding; the static one by default"
    )
    direction: Direction = Field(description="Line along which the point slides, any length")

    @property
    def sliding(self) -> float:
        """Kinetic coefficient."""
        return self.static if self.kinetic is None else self.kinetic

    @model_validator(mode="after")
    def _ordered(self) -> "Friction":
        if self.sliding > self.static:
            raise ValueError(f"kinetic {self.sliding} is above static {self.static}; it must not be")
        return self


class Contact(BaseModel):
    """An interface of a body against a rigid obstacle or against another body."""

    model_config = STRICT
    body: str
    interface: str
    against: Annotated[Bore | Plane | MasterSurface | OtherBody, Field(discriminator="shape")]
    method: Literal["residual", "penalty", "constraint", "impact"] = Field(
        default="residual",
        description="residual: gap = g₀ + BΦq + Rλ, no stiffness to tune; penalty: a spring or a law at each point;"
        " constraint: the gap is held at zero from touch until its force would pull (addition-deletion);"
        " impact: Newton's restitution at each blow",
    )
    surface_stiffness: Positive | None = Field(
        default=None, description="Stiffness of a surface layer per area [N/m^3]: asperities, or the penalty's springs"
    )
    law: Law | None = Field(default=None, description="Force of one point over indentation, instead of a layer")
    restitution: Annotated[float, Field(ge=0, le=1)] | None = Field(
        default=None, description="Separation speed over approach speed, for method 'impact'; 0 sticks until pulled"
    )
    friction: Friction | None = Field(default=None, description="For rigid contact of rigid bodies; static = 0 is none")
    dashpot: Literal["none", "wave-guide"] = Field(
        default="none",
        description="wave-guide: impedance of the truncated modes beside R; for single-point contacts on bars only",
    )

    @field_validator("friction")
    @classmethod
    def _holds(cls, value: Friction | None) -> Friction | None:
        return value if value is not None and value.static > 0 else None

    @model_validator(mode="after")
    def _consistent(self) -> "Contact":
        if (wrong := METHODS[self.method].refuses(self)) is not None:
            raise ValueError(wrong)
        return self

    @property
    def smooth_law(self) -> bool:
        """Whether its force is a nonlinear function of indentation."""
        return self.law is not None and self.law.kind != "linear"


class Run(BaseModel):
    """How long, and how fine."""

    model_config = STRICT
    duration: Positive = Field(description="[s]")
    step: Positive | None = Field(
        default=None,
        description="[s]; automatic if left out: 0.2/ω_c, or what the accuracy asks for; a larger one is divided into"
        " substeps, and one that does not divide the run is so much shorter; integrator 'event' has none",
    )
    accuracy: Annotated[float, Field(ge=1e-12, le=0.1)] | None = Field(
        default=None,
        description="Relative error that the step is chosen for: of the force where a law is integrated (1e-8 by"
        " default), of the energy balance elsewhere; event location needs none",
    )
    integrator: Literal["auto", "event", "collocation", "discrete-gradient", "kick", "trapezoid"] = Field(
        default="auto",
        description="event: exact motion between located events, for linear and rigid contact of a few points;"
        " collocation: high order, for contact laws; discrete-gradient: energy to round-off at any step; kick: explicit"
        " contact, step 0.2/ω_c; trapezoid: implicit contact, for damping, joints, loads and sliding pairs; auto takes"
        " what the scene's contacts ask for",
    )
    gravity: Vector = Field(default=(0.0, 0.0, 0.0), description="[m/s^2]")
    samples: int = Field(default=4000, ge=10, le=1_000_000, description="Points of the force and energy histories")
    frames: int = Field(default=200, ge=2, le=10_000, description="Stored deformations")


class Scene(BaseModel):
    """Everything the solver needs to know beside the records."""

    model_config = STRICT
    body: dict[str, Body] = Field(min_length=1)
    contact: dict[str, Contact] = {}
    joint: dict[str, Joint] = {}
    force: dict[str, Force] = {}
    run: Run

    @model_validator(mode="after")
    def _names(self) -> "Scene":
        named = [(f"contact.{name}.body", contact.body) for name, contact in self.contact.items()]
        named += [(f"contact.{name}.against.body", other.body) for name, other in self.others().items()]
        named += [(f"joint.{name}.body", joint.body) for name, joint in self.joint.items()]
        named += [(f"force.{name}.body", force.body) for name, force in self.force.items()]
        named += [(f"force.{n}.against", spring.against) for n, spring in self.springs().items() if spring.against]
        for where, body in named:
            if body not in self.body:
                raise ValueError(f"{where}: no body '{body}', the scene has {', '.join(self.body)}")
        for name, force in self.gas().items():
            if force.joint not in self.joint:
                have = ", ".join(self.joint) or "none"
                raise ValueError(f"force.{name}.joint: no joint '{force.joint}', the scene has {have}")
        for name, other in self.others().items():
            if other.body == self.contact[name].body:
                raise ValueError(f"contact.{name}.against.body: a contact needs two bodies")
        choose(self)
        return self

    def masters(self) -> dict[str, MasterSurface]:
        """Return the master surface of each contact that has one."""
        return {n: c.against for n, c in self.contact.items() if isinstance(c.against, MasterSurface)}

    def others(self) -> dict[str, MasterSurface | OtherBody]:
        """Return the other body of each contact between two bodies."""
        return {n: c.against for n, c in self.contact.items() if isinstance(c.against, MasterSurface | OtherBody)}

    def given(self) -> dict[str, GasPressure | MovingForce]:
        """Return the forces that are given over time."""
        return {n: f for n, f in self.force.items() if isinstance(f, GasPressure | MovingForce)}

    def gas(self) -> dict[str, GasPressure]:
        """Return the gas pressures."""
        return {n: f for n, f in self.force.items() if isinstance(f, GasPressure)}

    def moving(self) -> dict[str, MovingForce]:
        """Return the forces that travel over a surface."""
        return {n: f for n, f in self.force.items() if isinstance(f, MovingForce)}

    def springs(self) -> dict[str, Spring]:
        """Return the springs."""
        return {n: f for n, f in self.force.items() if isinstance(f, Spring)}

    @property
    def integrator(self) -> Integrator:
        """The integrator that runs this scene."""
        return choose(self)

    def component_of(self, body: str) -> str:
        """Return the component that a body is made of."""
        return self.body[body].component or body


IMPLICIT: tuple[str, ...] = ("trapezoid",)
SMOOTH: tuple[str, ...] = ("collocation", "discrete-gradient")
PREFERRED: tuple[Integrator, ...] = ("kick", "trapezoid", "event", "collocation", "discrete-gradient")


def choose(scene: Scene) -> Integrator:
    """Return the integrator of a scene.

    Raises:
        ValueError: the one that it names cannot carry what it has, or nothing can carry all that it has.
    """
    demands, named = _demands(scene), scene.run.integrator
    able: list[Integrator] = [name for name in PREFERRED if not _unable(demands, name)]
    if named == "auto":
        if able:
            return able[0]
        least = min((_unable(demands, name) for name in PREFERRED), key=len)
        others = " and ".join(what for what in demands if what not in least)
        raise ValueError(f"run.integrator: none carries {least[0]} beside {others}; leave one of them out")
    if lacking := _unable(demands, named):
        advice = f"take {' or '.join(map(repr, ('auto', *able)))}" if able else "none carries the whole scene"
        raise ValueError(f"run.integrator: '{named}' cannot carry {lacking[0]}; {advice}")
    if named == "event" and scene.run.step is not None:
        raise ValueError("run.step: integrator 'event' locates events on exact motion and has no step; leave it out")
    return named


def carriers(scene: Scene) -> list[Integrator]:
    """Return the integrators that can carry a scene."""
    demands = _demands(scene)
    return [name for name in PREFERRED if not _unable(demands, name)]


def _unable(demands: dict[str, tuple[str, ...]], name: str) -> list[str]:
    return [what for what, able in demands.items() if name not in able]


def _demands(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Return what a scene has that not every integrator can carry, with those that can."""
    found: dict[str, tuple[str, ...]] = {}
    for name, body in scene.body.items():
        if body.damping is not None:
            found[f"damping of body.{name}"] = IMPLICIT
        if body.gauges:
            found[f"body.{name}.gauges"] = ("event", *SMOOTH, "kick")
    for name in [*(f"joint.{n}" for n in scene.joint), *(f"force.{n}" for n in scene.given())]:
        found[name] = IMPLICIT
    for name in scene.masters():
        found[f"the sliding pair contact.{name}"] = IMPLICIT
    for name, contact in scene.contact.items():
        where = f"contact.{name}"
        method = METHODS[contact.method]
        if method.rigid:
            found[f"the rigid contact {where} (method '{contact.method}')"] = method.integrators
        elif contact.smooth_law:
            found[f"the law of {where}"] = SMOOTH
        elif contact.law is not None:
            found[f"the linear law of {where}"] = ("event", *SMOOTH)
        else:
            found[f"method '{contact.method}' of {where} without a law"] = method.integrators
        if contact.dashpot != "none":
            found[f"the dashpot of {where}"] = ("event", "kick")
    for name, spring in scene.springs().items():
        found[f"force.{name}"] = ("event", *SMOOTH)
        if spring.damping > 0:
            found[f"damping of force.{name}"] = ("event",)
    if any(scene.run.gravity):
        found["run.gravity"] = ("event", *SMOOTH, "trapezoid")
    return found
