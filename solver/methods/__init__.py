"""The family of contact methods: how penetration is prevented. Each member is a module-level `Method`."""

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
