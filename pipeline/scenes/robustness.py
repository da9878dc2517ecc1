"""Cases of `gudgeon robustness` as they stand in a file: what is changed, and what decides."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, field_validator

from gudgeon.pipeline.geometry.numbers import STRICT, Positive

Factor = Annotated[float, Field(gt=0, allow_inf_nan=False, json_schema_extra={"unit": "1"})]


class ContactStiffness(BaseModel):
    """Everything that yields at contacts, and springs; the bodies' moduli where nothing else does."""

    model_config = STRICT
    kind: Literal["contact-stiffness"]
    factor: Factor


class FirstMass(BaseModel):
    """The mass of the first body that a contact names, or of the first body."""

    model_config = STRICT
    kind: Literal["mass"]
    factor: Factor


class Step(BaseModel):
    """The step that the integrator takes by itself."""

    model_config = STRICT
    kind: Literal["step"]
    factor: Factor


class Restitution(BaseModel):
    """Rigid contact of method 'impact'; laws that have a restitution take it."""

    model_config = STRICT
    kind: Literal["restitution"]
    value: float = Field(ge=0, le=1, json_schema_extra={"unit": "1"})


class Grazing(BaseModel):
    """Slower approach from as much nearer."""

    model_config = STRICT
    kind: Literal["grazing"]
    factor: Factor


class Penetration(BaseModel):
    """The first contact's body moved into what it touches."""

    model_config = STRICT
    kind: Literal["penetration"]
    share: Factor = Field(description="Depth over the size of the body")


class Poisson(BaseModel):
    """Poisson's ratio of every elastic component."""

    model_config = STRICT
    kind: Literal["poisson"]
    nu: float = Field(gt=-1, lt=0.5, json_schema_extra={"unit": "1"})


class Slivers(BaseModel):
    """Elements split so that slivers result; every mesh holds the one before."""

    model_config = STRICT
    kind: Literal["slivers"]
    aspect: float = Field(gt=1, allow_inf_nan=False, description="Edge over height", json_schema_extra={"unit": "1"})
    count: int = Field(default=10, ge=1, description="Elements that are split, of each component")


class Collinear(BaseModel):
    """Static shapes of every interface, and of a second one that is the same."""

    model_config = STRICT
    kind: Literal["collinear"]


class OtherUnits(BaseModel):
    """The same numbers in other units of mass, length and time; 1/1000 is a unit a thousand times as large."""

    model_config = STRICT
    kind: Literal["units"]
    mass: Factor = 1.0
    length: Factor = 1.0
    time: Factor = 1.0


class Size(BaseModel):
    """The same machine of the same material in another size: times go with lengths, masses with their cube."""

    model_config = STRICT
    kind: Literal["size"]
    factor: Factor


class Elasticity(BaseModel):
    """Modulus and density of every elastic component."""

    model_config = STRICT
    kind: Literal["material"]
    modulus: Factor = 1.0
    density: Factor = 1.0


class Set(BaseModel):
    """Any keys of the scene."""

    model_config = STRICT
    kind: Literal["set"]
    values: dict[str, Any] = Field(description="Changes of the scene, as nested tables")


Operation = Annotated[
    ContactStiffness | FirstMass | Step | Restitution | Grazing | Penetration | Poisson | Slivers | Collinear
    | OtherUnits | Size | Elasticity | Set,
    Field(discriminator="kind"),
]  # fmt: skip
RuleName = Literal[
    "similarity", "frequencies", "collision", "loss", "agreement", "nested", "shear", "resolved", "momentum", "energy",
    "creation", "penetration", "monotone", "orthogonality",
]  # fmt: skip


class Case(BaseModel):
    """One extreme."""

    model_config = STRICT
    group: str = Field(default="own", description="Under which it stands in table and picture")
    operation: Operation
    rules: tuple[RuleName, ...] = Field(description="What decides, the sharpest first; at least one")
    refusal: bool = Field(default=False, description="Whether it may be refused with a reason")

    @field_validator("rules")
    @classmethod
    def _decides(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if not value:
            raise ValueError("[] given, at least one rule is needed")
        return value


class Robustness(BaseModel):
    """What `gudgeon robustness` does with a scene beside the shipped cases."""

    model_config = STRICT
    duration: Positive | None = Field(
        default=None,
        description="Cases end here [s]: soon after the first contact; the scene's own by default",
        json_schema_extra={"unit": "s"},
    )
    case: dict[str, Case] = Field(default={}, description="Further cases by name; a shipped one's name replaces it")
