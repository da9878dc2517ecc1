"""Contacts of a scene."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from gudgeon.solver.laws import Law
from gudgeon.solver.laws.archard import ContactWear
from gudgeon.solver.methods import METHODS
from gudgeon.solver.numbers import LayerStiffness, Length, PositiveSpeed, RatioFromZero, Share, Stiffness, Strict
from gudgeon.solver.obstacles import Bore, Plane
from gudgeon.solver.vectors import Direction

AUTO = "auto"
"""Name of an interface that is to be found by proximity."""


class MasterSurface(Strict):
    """The traction space of another body on which the contact points slide."""

    clearance: ClassVar[str] = "move body.{body}.position"
    """What makes room for points that start inside."""

    shape: Literal["surface"]
    body: str = Field(description="Name of a body of the scene")
    interface: str = Field(
        description="Interface of kind 'traction'; one of kind 'points' or 'patch' is met as by 'body'"
    )


class OtherBody(Strict):
    """An interface of another body, or another one of the same: its points where the meshes match, else its facets."""

    clearance: ClassVar[str] = "move body.{body}.position"
    """What makes room for points that start inside."""

    shape: Literal["body"]
    body: str = Field(description="Name of a body of the scene")
    interface: str = Field(
        description="Interface of kind 'points' or 'patch'; points of meshes that do not match touch its facets"
    )


class Friction(Strict):
    """Coulomb friction, in the plane of contact or along one line of it."""

    static: RatioFromZero = Field(description="Coefficient of static friction")
    kinetic: RatioFromZero | None = Field(
        default=None,
        description="Coefficient of kinetic friction; default: the static coefficient",
    )
    direction: Direction | None = Field(
        default=None,
        description="Line along which it acts, of any length, for rigid contact of rigid bodies that slide along it"
        " only; default: friction acts in the plane of contact",
    )

    speed: PositiveSpeed | None = Field(
        default=None,
        description="v₀ of friction that rises with the sliding speed, μ F v/√(v² + v₀²), for bodies that turn by any"
        " angle (integrator 'turning'): points that should stick creep, slower than this [m/s]; default: points"
        " stick",
    )
    stiffness: Stiffness | None = Field(
        default=None,
        description="Of the tangential spring by which a point sticks where bodies turn by any angle (integrator"
        " 'turning'); default: by Mindlin 0.82 times its stiffness along the normal: that of R and surface_stiffness,"
        " or of its law at an indentation of 1e-4 of the body's radius of gyration [N/m]",
    )

    @property
    def sliding(self) -> float:
        """Kinetic coefficient."""
        return self.static if self.kinetic is None else self.kinetic

    @model_validator(mode="after")
    def _ordered(self) -> "Friction":
        if self.sliding > self.static:
            raise ValueError(f"kinetic {self.sliding} is above static {self.static}; it must not exceed it")
        if self.speed is not None and self.sliding < self.static:
            raise ValueError(
                f"speed given, so that friction has one coefficient; kinetic {self.sliding} and static {self.static}"
                " differ: remove kinetic"
            )
        if self.speed is not None and self.direction is not None:
            raise ValueError("speed and direction cannot be combined: friction with speed acts in the plane of contact")
        if self.stiffness is not None and (self.speed is not None or self.direction is not None):
            raise ValueError(
                "stiffness cannot be combined with speed, with which nothing sticks, nor with direction: its spring"
                " acts in the plane of contact"
            )
        return self


class Contact(Strict):
    """An interface of a body against a rigid obstacle or against another body."""

    body: str = Field(description="Name of a body of the scene")
    interface: str = Field(
        description="Name of an interface of the component of `body`; auto: its named surfaces that face those of"
        " another body nearby, which a note names; also for `against.interface`"
    )
    within: Length | None = Field(
        default=None,
        description="Largest distance of surfaces that interface 'auto' takes [m]; default: a twentieth of the smaller"
        " part's largest extent",
    )
    against: Annotated[Bore | Plane | MasterSurface | OtherBody, Field(discriminator="shape")] = Field(
        description="What the interface may touch, by `shape`"
    )
    method: Literal["residual", "penalty", "constraint", "impact"] = Field(
        default="residual",
        description="residual: gap = g₀ + BΦq + Rλ, with no stiffness parameter; penalty: springs or a law at the"
        " points; constraint: the gap is held at zero from closing until its force would become tensile"
        " (addition-deletion); impact: Newton's restitution at each impact",
    )
    surface_stiffness: LayerStiffness | None = Field(
        default=None,
        description="Stiffness per area of a surface layer, such as asperities, or of the penalty springs [N/m^3]:"
        " measured or assumed data of the surfaces, so there is no default; without it, method 'residual' is rigid"
        " contact of the surfaces on the bodies' own flexibility",
    )
    law: Law | None = Field(
        default=None,
        description="Force of the whole interface as a function of indentation, which its points share by their areas;"
        " instead of a surface layer",
    )
    restitution: Share | None = Field(
        default=None,
        description="Separation speed over approach speed, for method 'impact'; with 0 the contact stays closed until"
        " its force would become tensile",
    )
    friction: Friction | None = Field(default=None, description="Coulomb friction; static = 0 means no friction")
    wear: ContactWear | None = Field(default=None, description="Wear of the surface by sliding; default: none")
    adjust: bool = Field(
        default=False,
        description="Whether points that start inside what they touch are moved onto it; a note says by how much",
    )
    dashpot: Literal["none", "wave-guide"] = Field(
        default="none",
        description="wave-guide: impedance of the truncated modes in parallel to R, for single-point contacts on bars",
    )

    @field_validator("friction")
    @classmethod
    def _holds(cls, value: Friction | None) -> Friction | None:
        return value if value is not None and value.static > 0 else None

    @model_validator(mode="after")
    def _consistent(self) -> "Contact":
        for wrong, message in (*self._method_conflicts(), *self._against_conflicts()):
            if wrong:
                raise ValueError(message)
        return self

    def _method_conflicts(self) -> tuple[tuple[bool, str], ...]:
        """Return settings that contradict the method, each with its message."""
        method, layer, law = METHODS[self.method], self.surface_stiffness is not None, self.law is not None
        dashpot = self.dashpot != "none"
        named = AUTO not in (self.interface, getattr(self.against, "interface", None))
        return (
            (self.within is not None and named, "within given; it is for interface 'auto' only"),
            (method.flexible and layer and law,
             "surface_stiffness and law both describe the surface; give only one of them"),
            (method.flexible and law and dashpot,
             "dashpot 'wave-guide' cannot be combined with a law; give only one of them"),
            (not method.flexible and not method.rigid and layer == law,
             f"method '{self.method}' needs either surface_stiffness [N/m^3] or a law"),
            (method.rigid and (layer or law),
             f"method '{self.method}' is rigid; remove surface_stiffness and law"),
            (not method.flexible and dashpot,
             "dashpot 'wave-guide' acts in parallel to R; it needs method 'residual'"),
            (method.bounces != (self.restitution is not None),
             "restitution is required by method 'impact' and not allowed with other methods"),
        )  # fmt: skip

    def _against_conflicts(self) -> tuple[tuple[bool, str], ...]:
        """Return settings that contradict what the body meets, each with its message."""
        rigid, slides = METHODS[self.method].rigid, isinstance(self.against, MasterSurface)
        return (
            (self.friction is not None and self.friction.direction is not None and slides,
             "friction.direction and against.shape 'surface' cannot be combined: friction over another body's surface"
             " acts in its plane; remove the direction"),
            (self.wear is not None and self.wear.against_coefficient > 0 and not slides,
             f"wear.against_coefficient given; it wears another body's traction space, and against.shape"
             f" '{self.against.shape}' has none"),
            (rigid and isinstance(self.against, Plane) and bool(self.against.edges),
             f"method '{self.method}' and against.edges cannot be combined: a face with edges is met by method"
             " 'residual' or 'penalty'"),
            (rigid and slides,
             f"method '{self.method}' and against.shape 'surface' cannot be combined: points slide over a surface by"
             " its flexibility or a surface stiffness"),
        )  # fmt: skip

    @property
    def smooth_law(self) -> bool:
        """Whether its force is a nonlinear function of indentation."""
        return self.law is not None and self.law.kind != "linear"
