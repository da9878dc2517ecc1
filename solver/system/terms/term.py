"""A term of the equations of motion, and what it depends on in the records of a body's component."""

from collections.abc import Mapping
from dataclasses import dataclass

RIGID = "a rigid body does not deform"
"""Why a rigid body has no elastic term."""
PLACES = ("interfaces", "tractions", "loads", "gauges")
"""Groups of a modal record whose members are named by the user."""


@dataclass(frozen=True)
class Term:
    """One term of the equations of motion."""

    name: str
    body: str
    present: bool
    reason: str
    fields: tuple[str, ...] = ()
    """`record:path` of the fields that it reads, or would read if present."""


@dataclass(frozen=True)
class Stock:
    """Contents of the records of a body's component on which terms depend."""

    elastic: bool = True
    """Whether it has elastic coordinates or R."""
    held: bool = True
    """Whether it has supports, so that modes take part in translations."""
    swapped: bool = False
    """Whether it has bases that change as a force passes."""
    estimated: bool = True
    """Whether the errors of its frequencies by the mesh are known."""
    places: tuple[str, ...] = ()
    """`group/name` of its interfaces, traction spaces, loads and gauges."""

    @classmethod
    def of(cls, sizes: Mapping[str, int]) -> "Stock":
        """Return the contents of a modal record from the sizes of its datasets [bytes]."""
        places = dict.fromkeys(
            path.rpartition("/")[0] for path in sizes if path.startswith(tuple(f"{group}/" for group in PLACES))
        )
        elastic = sizes.get("angular_frequencies", 0) > 0 or "residual_flexibility" in sizes
        return cls(
            elastic, "participation" in sizes, "swap/number" in sizes, "discretisation_errors" in sizes, tuple(places)
        )


def fields_read(terms: list[Term], body: str, record: str) -> list[str]:
    """Return the field paths of one record of a body that its present terms read."""
    prefix = f"{record}:"
    return [
        field.removeprefix(prefix)
        for term in terms
        if term.present and term.body == body
        for field in term.fields
        if field.startswith(prefix)
    ]
