"""Archard's law of wear, worn volume V = k/H ∫ F |v| dt of normal force and sliding speed: of joints and of contacts.

J. F. Archard, Contact and rubbing of flat surfaces, J. Appl. Phys. 24 (1953) 981-988.
"""

from pydantic import Field

from gudgeon.solver.numbers import Length, Modulus, RatioFromZero, Strict, TimeFromZero

DEEPEST = 0.1
"""Largest worn depth over the radius: worn shapes are of first order in it."""


class Archard(Strict):
    """Wear of a surface."""

    coefficient: RatioFromZero = Field(description="k of the own surface in V = k/H ∫ F |v| dt [1]")
    hardness: Modulus = Field(description="H, of the softer of both surfaces [Pa]")
    after: TimeFromZero = Field(default=0.0, description="Time from which wear is added up, past a transient [s]")
    thickness: Length | None = Field(
        default=None, description="Depth that may be worn away before the wall is gone and the run ends; default: any"
    )


class ContactWear(Archard):
    """Wear of the points of a contact, and of the surface over which they slide."""

    against_coefficient: RatioFromZero = Field(
        default=0.0, description="k of the other body's traction space, over which the points slide [1]"
    )
    thickness: Length | None = Field(
        default=None,
        description="Depth that may be worn away over many cycles (`gudgeon wear`) before the wall is gone; default:"
        " a tenth of the radius",
    )
