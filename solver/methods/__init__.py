"""How a gap is kept from closing further: the family of contact methods. A new one is a file and a line here.

Each member is a module-level `Method`: what it makes of the settings of a contact, and of the bodies' flexibility.
"""

from solver.methods.constraint import CONSTRAINT
from solver.methods.impact import IMPACT
from solver.methods.method import Method, Settings
from solver.methods.penalty import PENALTY
from solver.methods.residual import RESIDUAL

__all__ = ["METHODS", "Method", "Settings"]

METHODS: dict[str, Method] = {
    "residual": RESIDUAL,
    "penalty": PENALTY,
    "constraint": CONSTRAINT,
    "impact": IMPACT,
}
"""Members by the name that a scene writes."""
