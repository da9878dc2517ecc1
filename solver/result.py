"""Every way in which a run can end, with the message for its user."""

from enum import Enum


class Result(Enum):
    """How a simulation ended."""

    FINISHED = "finished"
    DIVERGED = "the motion left the range of numbers; the scene's data are inconsistent"
    DEPENDENT_ROWS = (
        "contact points are the same to round-off, or more than can be told apart, so their forces are not determined;"
        " take fewer points, coarsen the interface, or let a surface layer yield (contact.NAME.surface_stiffness)"
    )
    INCOMPLETE = (
        "the motion between two events is no sum of drifts and oscillations: dashpots at critical damping, or beside"
        " slip, or slip that feeds motion; leave one of them out, or take another run.integrator"
    )
    CHATTER = "contacts close and open for ever without time passing; use method 'residual', which needs no impact"
    NOT_CONVERGED = (
        "the contact force could not be found within a step; take a smaller step where the scene gives one, or a law"
        " whose stiffness and exponent are in range"
    )
    INACCURATE = "the energy drift stays above run.accuracy at any step tried; state a larger accuracy, or leave it out"
    ENERGY = "contact made energy from nothing; take a smaller step where the integrator has one, or state run.accuracy"
    RESTITUTION = (
        "an impact would make energy: Newton's restitution with so much friction; lower contact.NAME.restitution"
    )

    @property
    def ok(self) -> bool:
        """Whether the answer can be used."""
        return self is Result.FINISHED
