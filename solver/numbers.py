"""Numbers and names of a scene file, with the range of each.

A number is zero, where its key allows that, or has a magnitude within the range of its unit. Ranges are wide enough for
lengths of 1e-9 nm and scenes in any units, and narrow enough that no product that a stage forms exceeds the range of
floating-point numbers.
"""

import re
from inspect import cleandoc
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

RANGES: dict[str, tuple[float, float]] = {
    "1": (1e-15, 1e15), "deg": (1e-12, 1e9), "rad": (1e-15, 1e6), "s": (1e-30, 1e15), "1/s": (1e-15, 1e30),
    "Hz": (1e-15, 1e30), "rev/min": (1e-15, 1e15), "rad/s": (1e-24, 1e24), "m": (1e-21, 1e12), "m^2": (1e-36, 1e24),
    "m^4": (1e-72, 1e48), "m/s": (1e-24, 1e12), "m/s^2": (1e-24, 1e24), "kg": (1e-40, 1e40), "kg m^2": (1e-80, 1e60),
    "kg/m^3": (1e-24, 1e24), "N": (1e-40, 1e40), "Pa": (1e-18, 1e24), "N/m": (1e-40, 1e40), "N/m^3": (1e-30, 1e45),
    "N/m^exponent": (1e-45, 1e60), "N s/m": (1e-45, 1e45), "N m": (1e-60, 1e52),
    "N m/rad": (1e-45, 1e45), "N/rad": (1e-45, 1e45), "N m s/rad": (1e-45, 1e45), "N s/rad": (1e-45, 1e45),
    "V": (1e-12, 1e12), "C": (1e-30, 1e12), "F/m": (1e-40, 1e20),
}  # fmt: skip
"""Smallest and largest magnitude of a number of a scene by its unit."""
MOST = 1_000_000
"""Largest count of a scene: modes, elements through a thickness, seeds and the like."""
LEAST_COMPLIANCE = 1e-9
"""Distance of Poisson's ratio from -1 and 0.5, where the stiffness of a solid is infinite."""
ROUNDED = 1e-3
"""By how much a given moment of inertia may exceed the sum of the others, of that sum: thin bodies, few digits."""
NAME_LENGTH = 100
"""Characters of a name, which becomes part of the names of files."""
KEYS = "\nKeys:"
"""Line of a docstring above the keys of a table."""
NAME = re.compile(r"[\w.-]([\w. -]*[\w.-])?")


def above_zero(unit: str) -> Any:
    """Return the limits of a number above zero of a unit."""
    low, high = RANGES[unit]
    return Field(gt=0, le=high, allow_inf_nan=False, json_schema_extra={"unit": unit, "minimum": low})


def from_zero(unit: str) -> Any:
    """Return the limits of a number of a unit that is zero or above."""
    low, high = RANGES[unit]
    return Field(ge=0, le=high, allow_inf_nan=False, json_schema_extra={"unit": unit, "least_magnitude": low})


def signed(unit: str) -> Any:
    """Return the limits of a number of a unit of either sign."""
    low, high = RANGES[unit]
    return Field(ge=-high, le=high, allow_inf_nan=False, json_schema_extra={"unit": unit, "least_magnitude": low})


def sizeable(unit: str) -> WrapValidator:
    """Return a check that refuses truth values, and numbers of a unit that are smaller than its range without being
    zero."""
    low, high = RANGES[unit]
    suffix = "" if unit == "1" else f" {unit}"

    def check(raw: Any, validated: ValidatorFunctionWrapHandler) -> float:
        if isinstance(raw, bool):
            raise ValueError(f"{str(raw).lower()} given; a number is needed")
        value = validated(raw)
        if 0 < abs(value) < low:
            raise ValueError(f"{value} given; allowed magnitude: {low:g} to {high:g}{suffix}")
        return value

    return WrapValidator(check)


def _of_a_body(moments: tuple[float, float, float]) -> tuple[float, float, float]:
    """Refuse moments of inertia of which one exceeds the sum of the others; zeros stand for axes that are left out."""
    largest = max(moments)
    if all(moments) and largest > (sum(moments) - largest) * (1 + ROUNDED):
        raise ValueError(f"{list(moments)} given; allowed: no moment above the sum of the other two")
    return moments


def _invertible(nu: float) -> float:
    if min(nu + 1, 0.5 - nu) < LEAST_COMPLIANCE:
        raise ValueError(f"{nu} given; allowed: {LEAST_COMPLIANCE:g} away from -1 and 0.5")
    return nu


AbsolutePermittivity = Annotated[float, above_zero("F/m"), sizeable("F/m")]
Acceleration = Annotated[float, signed("m/s^2"), sizeable("m/s^2")]
Angle = Annotated[float, signed("deg"), sizeable("deg")]
AngularVelocity = Annotated[float, signed("rad/s"), sizeable("rad/s")]
Area = Annotated[float, above_zero("m^2"), sizeable("m^2")]
BushingDamping = Annotated[float, signed("N s/m"), sizeable("N s/m")]
BushingStiffness = Annotated[float, signed("N/m"), sizeable("N/m")]
Charge = Annotated[float, signed("C"), sizeable("C")]
"""Electric."""
Component = Annotated[float, signed("1")]
"""Of a direction or a quaternion, beside which round-off is none."""
Coordinate = Annotated[float, signed("m"), sizeable("m")]
CouplingDamping = Annotated[float, signed("N s/rad"), sizeable("N s/rad")]
CouplingStiffness = Annotated[float, signed("N/rad"), sizeable("N/rad")]
DampingConstant = Annotated[float, from_zero("N s/m"), sizeable("N s/m")]
DecayRate = Annotated[float, from_zero("1/s"), sizeable("1/s")]
Density = Annotated[float, above_zero("kg/m^3"), sizeable("kg/m^3")]
Duration = Annotated[float, above_zero("s"), sizeable("s")]
Exponent = Annotated[float, Field(ge=0.1, le=10, allow_inf_nan=False, json_schema_extra={"unit": "1"})]
ForceValue = Annotated[float, signed("N"), sizeable("N")]
Frequency = Annotated[float, above_zero("Hz"), sizeable("Hz")]
HertzStiffness = Annotated[float, above_zero("N/m^exponent"), sizeable("N/m^exponent")]
LayerStiffness = Annotated[float, above_zero("N/m^3"), sizeable("N/m^3")]
Length = Annotated[float, above_zero("m"), sizeable("m")]
Mass = Annotated[float, above_zero("kg"), sizeable("kg")]
Modulus = Annotated[float, above_zero("Pa"), sizeable("Pa")]
Moment = Annotated[float, from_zero("kg m^2"), sizeable("kg m^2")]
"""Of inertia."""
Moments = Annotated[tuple[Moment, Moment, Moment], AfterValidator(_of_a_body)]
"""Of inertia about three axes."""
Permittivity = Annotated[float, Field(ge=1, le=1e6, allow_inf_nan=False, json_schema_extra={"unit": "1"})]
"""Relative."""
Poisson = Annotated[float, Field(gt=-1, lt=0.5, json_schema_extra={"unit": "1"}), AfterValidator(_invertible)]
"""Poisson's ratio."""
Potential = Annotated[float, signed("V"), sizeable("V")]
PositiveAcceleration = Annotated[float, above_zero("m/s^2"), sizeable("m/s^2")]
PositiveSpeed = Annotated[float, above_zero("m/s"), sizeable("m/s")]
PositiveRatio = Annotated[float, above_zero("1"), sizeable("1")]
Pressure = Annotated[float, signed("Pa"), sizeable("Pa")]
Ratio = Annotated[float, signed("1"), sizeable("1")]
RatioFromZero = Annotated[float, from_zero("1"), sizeable("1")]
RotationAngle = Annotated[float, above_zero("rad"), sizeable("rad")]
RotationRate = Annotated[float, above_zero("rev/min"), sizeable("rev/min")]
SecondMoment = Annotated[float, above_zero("m^4"), sizeable("m^4")]
Share = Annotated[float, Field(ge=0, le=1, json_schema_extra={"unit": "1"}), sizeable("1")]
Speed = Annotated[float, signed("m/s"), sizeable("m/s")]
Stiffness = Annotated[float, above_zero("N/m"), sizeable("N/m")]
SurfaceEnergy = Annotated[float, above_zero("N/m"), sizeable("N/m")]
"""Work of adhesion per area."""
TimeValue = Annotated[float, signed("s"), sizeable("s")]
TorqueValue = Annotated[float, signed("N m"), sizeable("N m")]
TimeFromZero = Annotated[float, from_zero("s"), sizeable("s")]
TurningDamping = Annotated[float, signed("N m s/rad"), sizeable("N m s/rad")]
TurningStiffness = Annotated[float, signed("N m/rad"), sizeable("N m/rad")]


def _name(value: str) -> str:
    if not NAME.fullmatch(value) or set(value) == {"."} or len(value) > NAME_LENGTH:
        raise ValueError(
            f"name {value[:NAME_LENGTH]!r} given; allowed: at most {NAME_LENGTH} letters, digits, '_', '.', '-' and"
            " spaces between them"
        )
    return value


Name = Annotated[str, AfterValidator(_name)]
"""Of a body, contact, component and the like: it becomes part of the names of files and of fields of records."""


def _each_once(values: tuple[str, ...]) -> tuple[str, ...]:
    if twice := sorted({v for v in values if values.count(v) > 1}):
        raise ValueError(f"{', '.join(twice)} given more than once; give each once")
    return values


EachOnce = AfterValidator(_each_once)
"""Of a list of names that may not repeat."""


def key_lines(table: type[BaseModel]) -> list[str]:
    """Return a line for each key of a table: its unit and what it is."""
    lines = []
    for name, key in table.model_fields.items():
        unit = key.json_schema_extra.get("unit") if isinstance(key.json_schema_extra, dict) else None
        default = "" if key.is_required() else " (optional)"
        lines.append(f"    {name}{f' [{unit}]' if unit else ''}: {key.description or 'see its keys'}{default}")
    return lines


class Strict(BaseModel):
    """A table of a scene file; unknown keys are refused.

    pydantic builds what validates a table when it is first needed: that of a whole scene has those of all tables in it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Give the docstring of a table its keys."""
        if text := vars(cls).get("__doc__"):
            type.__setattr__(cls, "__doc__", "\n".join([text, KEYS, *key_lines(cls)]))

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the JSON schema of a table, described by what it is: the keys are in it."""
        schema = handler(core_schema)
        if text := vars(cls).get("__doc__"):
            handler.resolve_ref_schema(schema)["description"] = cleandoc(text.partition(f"\n{KEYS}\n")[0])
        return schema
