"""How a gap is kept from closing further: the family of contact methods. A new one is a file and a line here.

Each member is a module-level `Method`: what it makes of the settings of a contact, and of the bodies' flexibility.
"""

from gudgeon.solver.methods.constraint import CONSTRAINT
from gudgeon.solver.methods.impact import IMPACT
from gudgeon.solver.methods.method import Method, Settings
from gudgeon.solver.methods.penalty import PENALTY
from gudgeon.solver.methods.residual import RESIDUAL

__all__ = ["METHODS", "Method", "Settings"]

METHODS: dict[str, Method] = {
    "residual": RESIDUAL,
    "penalty": PENALTY,
    "constraint": CONSTRAINT,
    "impact": IMPACT,
}
"""Members by the name that a scene writes."""
