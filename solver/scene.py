"""The solver's part of a scene: bodies, contacts, and how long to run. SI units."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from solver.forces import Force
from solver.joints import Joint
from solver.obstacles import Bore, Plane
from solver.obstacles.vectors import Vector

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Freedom = Literal["x", "y", "z", "rx", "ry", "rz"]
ALL_FREE: tuple[Freedom, ...] = ("x", "y", "z", "rx", "ry", "rz")
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


class MasterSurface(BaseModel):
    """The traction space of another body, over which the points slide."""

    model_config = STRICT
    shape: Literal["surface"]
    body: str
    interface: str = Field(description="Interface of kind 'traction'")


class Contact(BaseModel):
    """An interface of a body against a rigid obstacle or against another body."""

    model_config = STRICT
    body: str
    interface: str
    against: Annotated[Bore | Plane | MasterSurface, Field(discriminator="shape")]
    method: Literal["residual", "penalty"] = Field(
        default="residual",
        description="residual: gap = g₀ + BΦq + Rλ, no stiffness to tune; penalty: a spring at each point",
    )
    surface_stiffness: Positive | None = Field(
        default=None, description="Stiffness of a surface layer per area [N/m^3]: asperities, or the penalty's springs"
    )
    dashpot: Literal["none", "wave-guide"] = Field(
        default="none",
        description="wave-guide: impedance of the truncated modes beside R; for single-point contacts on bars only",
    )

    @model_validator(mode="after")
    def _consistent(self) -> "Contact":
        if self.method == "penalty" and self.surface_stiffness is None:
            raise ValueError("method 'penalty' needs surface_stiffness [N/m^3]")
        if self.method == "penalty" and self.dashpot != "none":
            raise ValueError("dashpot 'wave-guide' stands beside R, so it needs method 'residual'")
        return self


class Run(BaseModel):
    """How long, and how fine."""

    model_config = STRICT
    duration: Positive = Field(description="[s]")
    step: Positive | None = Field(
        default=None, description="[s]; automatic (0.2/ω_c) if left out, and divided into substeps if larger than that"
    )
    integrator: Literal["auto", "kick", "trapezoid"] = Field(
        default="auto",
        description="kick: explicit contact, step 0.2/ω_c; trapezoid: implicit contact, for damping, joints, loads and"
        " sliding pairs; auto takes the first that can",
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
        named += [(f"contact.{name}.against.body", master.body) for name, master in self.masters().items()]
        named += [(f"joint.{name}.body", joint.body) for name, joint in self.joint.items()]
        named += [(f"force.{name}.body", force.body) for name, force in self.force.items()]
        for where, body in named:
            if body not in self.body:
                raise ValueError(f"{where}: no body '{body}', the scene has {', '.join(self.body)}")
        for name, force in self.force.items():
            if force.joint not in self.joint:
                have = ", ".join(self.joint) or "none"
                raise ValueError(f"force.{name}.joint: no joint '{force.joint}', the scene has {have}")
        needs = self.needs_trapezoid()
        if self.run.integrator == "kick" and needs:
            raise ValueError(f"run.integrator: 'kick' cannot carry {needs[0]}; take 'auto' or 'trapezoid'")
        return self

    def masters(self) -> dict[str, MasterSurface]:
        """Return the master surface of each contact that has one."""
        return {n: c.against for n, c in self.contact.items() if isinstance(c.against, MasterSurface)}

    def needs_trapezoid(self) -> list[str]:
        """List what only the implicit integrator can carry."""
        needs = [f"damping of body.{name}" for name, body in self.body.items() if body.damping is not None]
        needs += [f"joint.{name}" for name in self.joint] + [f"force.{name}" for name in self.force]
        needs += [f"the sliding pair contact.{name}" for name in self.masters()]
        return needs + (["run.gravity"] if any(self.run.gravity) else [])

    @property
    def integrator(self) -> Literal["kick", "trapezoid"]:
        """The integrator that runs this scene."""
        if self.run.integrator != "auto":
            return self.run.integrator
        return "trapezoid" if self.needs_trapezoid() else "kick"

    def component_of(self, body: str) -> str:
        """Return the component that a body is made of."""
        return self.body[body].component or body
