"""Joints: a crank and rod that move a point of a body, joints of bodies that turn, and what couples or drives these."""

from typing import Annotated

from pydantic import Field

from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.coupled import Driven, Gear
from gudgeon.solver.joints.markers import (
    Cylindrical,
    Distance,
    Fixed,
    Planar,
    Revolute,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from gudgeon.solver.joints.slider_crank import SliderCrank

Hinge = Fixed | Revolute | Spherical | Translational | Cylindrical | Universal | Planar | Distance | Screw | Clearance
"""Joints of two markers."""
Joint = Annotated[SliderCrank | Hinge | Gear | Driven, Field(discriminator="kind")]
