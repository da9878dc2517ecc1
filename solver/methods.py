"""The family of contact methods: how penetration is prevented. Each member is a line of `METHODS`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Method:
    """A contact method."""

    rigid: bool = False
    """Whether points have no compliance: forces are multipliers, and closing is an impact."""
    flexible: bool = False
    """Whether the residual flexibility R of the bodies is part of the compliance."""
    bounces: bool = False
    """Whether the scene gives the restitution of impacts."""


METHODS = {
    # g = g₀ + B Φ q + R λ: the truncated modes act as a massless flexibility R, with no parameter to choose
    # (Monjaraz-Tec, Gross & Krack 2022).
    "residual": Method(flexible=True),
    # A spring or a law at each point, without R; the stiffness is a parameter to choose.
    "penalty": Method(),
    # Constraint addition and deletion (Wu & Haug 1990): a gap that closes is held at zero, with the velocity jump of
    # the reduced mass, until its force would become tensile.
    "constraint": Method(rigid=True),
    # Newton's restitution at each impact; an accumulation of impacts ends in a constraint, as with restitution 0.
    "impact": Method(rigid=True, bounces=True),
}
"""Members by the name that a scene writes."""
RIGID_NEEDS = (
    "contact of rigid bodies needs it, or a law, or method = 'constraint' (no rebound) or 'impact' with a restitution"
)
"""What to give where a contact has no compliance."""
