"""The `robustness` table of a scene: cases of `gudgeon robustness`, each an operation on the scene and its rules."""

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from gudgeon.solver.numbers import (
    MOST,
    Duration,
    Length,
    Poisson,
    PositiveAcceleration,
    PositiveRatio,
    RatioFromZero,
    RotationAngle,
    Share,
    Strict,
)


class Scaled(Strict):
    """Scale one quantity of the scene."""

    kind: Literal["contact-stiffness", "mass", "step", "grazing", "size", "duration", "modes", "mesh"] = Field(
        description="contact-stiffness: surface layers, laws and springs, or the moduli of the bodies if the scene has"
        " none of these; mass: that of the body that the first contact names, or of the first body; step: a multiple of"
        " the one that the integrator chooses by itself; grazing: the speed of approach, and the distance with it;"
        " size: all lengths at the same material, so that times scale with the factor, masses with its cube;"
        " duration: that of the run; modes: the numbers of normal modes"
    )
    factor: PositiveRatio = Field(description="Factor on the quantity")


class Restitution(Strict):
    """Use rigid contact of method 'impact'; laws that have a restitution keep their method."""

    kind: Literal["restitution"]
    value: Share = Field(description="Separation speed over approach speed")


class Penetration(Strict):
    """Move the body of the first contact into the other surface."""

    kind: Literal["penetration"]
    share: PositiveRatio = Field(description="Depth over the size of the body")


class Samples(Strict):
    """Set the number of points of the histories."""

    kind: Literal["samples"]
    count: int = Field(ge=10, le=1_000_000, description="Number of points")


class Gravity(Strict):
    """Add gravity towards the surface of the first contact; in a scene with gravity, double it."""

    kind: Literal["gravity"]
    size: PositiveAcceleration = Field(default=9.81, description="Acceleration [m/s^2]")


class Damped(Strict):
    """Damp every elastic body in proportion to its stiffness."""

    kind: Literal["damping"]
    ratio: Annotated[PositiveRatio, Field(lt=1)] = Field(
        description="Damping ratio at the frequency whose half period is the duration of the first contact"
    )


class Sagging(Strict):
    """Deflect a held body against its obstacle by gravity, so that it starts at rest on it."""

    kind: Literal["static-deflection"]
    factor: PositiveRatio = Field(description="Deflection without contact over the gap, at the point of the least gap")


class Rubbing(Strict):
    """Give every contact a coefficient of friction, while the surfaces of the first one move along each other."""

    kind: Literal["friction"]
    coefficient: RatioFromZero = Field(description="Coefficient of friction, static and kinetic")
    press: PositiveAcceleration | None = Field(
        default=None, description="Acceleration that presses the surfaces on each other [m/s^2]; default: none"
    )
    compared: Literal["alone", "units", "turned", "frictionless"] = Field(
        default="alone",
        description="With what the run is compared: units, turned: the same scene in mm and t, or turned as a whole;"
        " frictionless: the scene without friction; alone: with nothing, its balances decide",
    )


class Reuse(Strict):
    """Move a cylindrical contact surface of an elastic body inwards, and reuse its modes."""

    kind: Literal["change"]
    share: PositiveRatio = Field(description="Offset over the radius")


class Spin(Strict):
    """Turn the body of the first contact, across the direction of the contact's force."""

    kind: Literal["spin"]
    angle: RotationAngle = Field(description="Rotation over the run [rad]")


class PoissonRatio(Strict):
    """Set Poisson's ratio of every elastic component."""

    kind: Literal["poisson"]
    nu: Poisson = Field(description="Poisson's ratio")


class Slivers(Strict):
    """Split elements into slivers; the new mesh contains the shapes of the old one."""

    kind: Literal["slivers"]
    aspect: Annotated[PositiveRatio, Field(gt=1)] = Field(description="Edge over height")
    count: int = Field(default=10, ge=1, le=MOST, description="Elements that are split, of each component")


class Collinear(Strict):
    """Add all static correction modes of every interface, and those of an identical second interface."""

    kind: Literal["collinear"]


class Turned(Strict):
    """Turn the whole scene: bodies, obstacles, joints, forces, velocities and gravity."""

    kind: Literal["turned"]


class RepeatedJoint(Strict):
    """Add the first joint of two markers once more."""

    kind: Literal["repeated-joint"]


class Gap(Strict):
    """Scale all lengths at the same material so that the least gap of a field between plates has a given size."""

    kind: Literal["gap"]
    size: Length = Field(description="Gap as the run starts [m]")


class Voltage(Strict):
    """Scale all voltages, or charges, of fields, and compare with the scene without these fields."""

    kind: Literal["voltage"]
    factor: RatioFromZero = Field(description="Factor on voltages and charges; so small that no force is left")


class OtherUnits(Strict):
    """Write the same numbers in other units of mass, length and time; 1/1000 is a unit a thousand times as large."""

    kind: Literal["units"]
    mass: PositiveRatio = Field(default=1.0, description="Factor on the unit of mass")
    length: PositiveRatio = Field(default=1.0, description="Factor on the unit of length")
    time: PositiveRatio = Field(default=1.0, description="Factor on the unit of time")


class Elasticity(Strict):
    """Scale modulus and density of every elastic component."""

    kind: Literal["material"]
    modulus: PositiveRatio = Field(default=1.0, description="Factor on Young's modulus")
    density: PositiveRatio = Field(default=1.0, description="Factor on the density")


class Set(Strict):
    """Change any keys of the scene."""

    kind: Literal["set"]
    values: dict[str, Any] = Field(description="Changes of the scene, as nested tables")


Operation = Annotated[
    Scaled | Restitution | Penetration | Samples | Gravity | Damped | Sagging | Rubbing | Reuse | Spin | PoissonRatio
    | Slivers | Collinear | OtherUnits | Turned | Voltage | Gap | RepeatedJoint | Elasticity | Set,
    Field(discriminator="kind"),
]  # fmt: skip
RuleName = Literal[
    "similarity", "frequencies", "collision", "loss", "agreement", "nested", "shear", "resolved", "momentum", "energy",
    "creation", "penetration", "monotone", "orthogonality", "rotation", "impact", "basis", "mesh", "reuse",
    "rest",
]  # fmt: skip


class Case(Strict):
    """One robustness case."""

    group: str = Field(default="own", description="Group of the case in table and picture, and for --only")
    operation: Operation = Field(description="What changes in the scene, by `kind`")
    rules: tuple[RuleName, ...] = Field(
        description="Rules that determine the verdict, the strictest first; at least one"
    )
    refusal: bool = Field(default=False, description="Whether the program may refuse the case with a reason")

    @field_validator("rules")
    @classmethod
    def _decides(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if not value:
            raise ValueError("[] given; at least one rule is needed")
        return value


class Robustness(Strict):
    """Settings of `gudgeon robustness`, and cases in addition to the shipped ones."""

    duration: Duration | None = Field(
        default=None,
        description="Duration of the cases [s], soon after the first contact; default: the scene's own",
    )
    case: dict[str, Case] = Field(
        default={}, description="Further cases by name; a shipped case with this name is replaced"
    )
