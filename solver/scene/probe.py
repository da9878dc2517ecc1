"""Probes of a scene: what is recorded at every sample."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gudgeon.solver.numbers import Strict
from gudgeon.solver.vectors import Direction, Place


class PointProbe(Strict):
    """Motion of a point or interface of a body."""

    kind: Literal["displacement", "velocity", "acceleration", "rotation"] = Field(
        description="displacement: from the undeformed body as the scene places it [m]; velocity [m/s];"
        " acceleration: mean over each sample interval [m/s^2]; rotation [rad], of rigid bodies and of interfaces"
        " of kind 'tie'"
    )
    body: str = Field(description="Name of a body of the scene")
    interface: str | None = Field(
        default=None,
        description="Interface of its component, needed on elastic bodies: kind 'mean' or 'tie', or contact points, of"
        " which the one nearest to `at` is taken, along its normal",
    )
    at: Place | None = Field(
        default=None,
        description="Point relative to the component's origin [m], any point of a rigid body; default: the origin, or"
        " the only point of the interface",
    )
    direction: Direction | None = Field(
        default=None, description="Direction of any length; default: x, y and z, or the normal of a contact point"
    )


class DistanceProbe(Strict):
    """Distance of two points or interfaces [m]."""

    kind: Literal["distance"]
    body: str = Field(description="Name of a body of the scene")
    interface: str | None = Field(default=None, description="As of a displacement")
    at: Place | None = Field(default=None, description="As of a displacement [m]")
    against: str = Field(description="Other body")
    against_interface: str | None = Field(default=None, description="The same of the other body")
    against_at: Place | None = Field(default=None, description="The same of the other body [m]")


class ForceProbe(Strict):
    """Force of a contact, joint or spring, or the position at which a contact's force acts."""

    kind: Literal["force", "centre"] = Field(
        description="force: resultant on the body of a contact or joint, or what a motion needs, mean over each sample"
        " interval; of a body the force by which its supports and its restricted freedom hold it, also a mean; the"
        " tension of a spring; force and moment of a bushing on its body [N, N m]; centre: centre of"
        " pressure of a contact in the axes of the body's component, from its origin [m], NaN where it is open"
    )
    of: str = Field(description="contact.NAME, joint.NAME, force.NAME, motion.NAME or body.NAME")

    @model_validator(mode="after")
    def _of_a_contact(self) -> "ForceProbe":
        if self.kind == "centre" and not self.of.startswith("contact."):
            raise ValueError(f"of '{self.of}': only a contact has a centre of pressure; give contact.NAME")
        return self


Probe = Annotated[PointProbe | DistanceProbe | ForceProbe, Field(discriminator="kind")]
