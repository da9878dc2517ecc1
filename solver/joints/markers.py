"""Joints between two markers, one on a body and one on another body or the ground, that allow motions of any size.

A marker is a point with three axes, fixed to its body. u_i are the axes of the marker on the other side, w_i those of
the marker on `body`, and d is the vector from the former to the latter; u_3 and w_3 are along `against_axis` and
`axis`. docs/mechanisms.md has the rows of every kind.
"""

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.numbers import Coordinate, Length, Strict
from gudgeon.solver.vectors import Direction, Place, unit

Square = tuple[int, int]
ALIGNED: tuple[Square, ...] = ((0, 2), (1, 2))
"""w_3 is along u_3."""
LOCKED: tuple[Square, ...] = ((0, 1), (0, 2), (1, 2))
"""All axes are along each other."""


class Marker(Strict):
    """What holds a point of a body."""

    body: str = Field(description="Body on which its force and moment are reported")
    at: Place | None = Field(
        default=None,
        description="Its point of a rigid body, in the axes of the component and relative to its origin [m]; default:"
        " the origin",
    )
    interface: str | None = Field(
        default=None,
        description="Its point of a body that deforms: an interface of kind 'tie', or 'mean' for kinds 'spherical',"
        " 'distance' and 'slider-crank'",
    )

    @model_validator(mode="after")
    def _one_point(self) -> "Marker":
        if self.at is not None and self.interface is not None:
            raise ValueError("give one of: at, interface")
        return self


class Marked(Marker):
    """A joint of two markers. Rows: d is zero along some axes u_i, and u_i is at right angles to w_k for some pairs."""

    along: ClassVar[tuple[int, ...]] = (0, 1, 2)
    """Axes along which d is zero."""
    squares: ClassVar[tuple[Square, ...]] = ()
    """Axes i of the other marker and k of this one that stay at right angles."""
    turns: ClassVar[bool] = False
    """Whether it leaves a rotation about its axis alone, whose angle can be driven."""
    slides: ClassVar[bool] = False
    """Whether it leaves a translation along its axis alone."""
    against: str | None = Field(default=None, description="Other body; default: the ground")
    against_at: Place | None = Field(
        default=None,
        description="Its point of the other body, as `at` [m]; of the ground the position in the scene. Default: that"
        " of `at` as the scene places the bodies",
    )
    against_interface: str | None = Field(default=None, description="The same of the other body, as `interface`")

    @model_validator(mode="after")
    def _two(self) -> "Marked":
        if self.against_at is not None and self.against_interface is not None:
            raise ValueError("give one of: against_at, against_interface")
        if self.against is None and self.against_interface is not None:
            raise ValueError("against_interface needs against, the body that has it")
        if self.against == self.body:
            raise ValueError("it needs two bodies, or one and the ground")
        return self

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Third axes of this marker and the other one, in the axes of the scene as it places the bodies, (3,) each."""
        return np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0])

    @property
    def row_count(self) -> int:
        """Number of its constraint rows."""
        return len(self.along) + len(self.squares)


class Axial(Marked):
    """A joint with an axis."""

    axis: Direction = Field(
        description="Axis on the body, of any length, in the axes of the scene as it places the bodies"
    )
    against_axis: Direction | None = Field(
        default=None, description="The same on the other body, or the ground. Default: `axis`"
    )

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        axis = unit(self.axis)
        return axis, axis if self.against_axis is None else unit(self.against_axis)

    @model_validator(mode="after")
    def _acute(self) -> "Axial":
        axis, against = self.axes
        if self.squares == ALIGNED and axis @ against <= 0:
            raise ValueError("axis and against_axis are more than 90 degrees apart; reverse one of them")
        return self


class Fixed(Marked):
    """Holds both markers together. A scene whose joints all hold interfaces of bodies that deform on the ground runs in
    small motion, see docs/mechanisms.md."""

    squares = LOCKED
    kind: Literal["fixed"]


class Revolute(Axial):
    """Leaves the rotation about its axis."""

    squares = ALIGNED
    turns = True
    kind: Literal["revolute"]


class Spherical(Marked):
    """Leaves all rotations."""

    kind: Literal["spherical"]


class Translational(Axial):
    """Leaves the translation along its axis."""

    along = (0, 1)
    squares = LOCKED
    slides = True
    kind: Literal["translational"]


class Cylindrical(Axial):
    """Leaves translation along and rotation about its axis."""

    along = (0, 1)
    squares = ALIGNED
    turns = True
    slides = True
    kind: Literal["cylindrical"]


class Universal(Axial):
    """Leaves the rotations about `axis`, fixed on the body, and `against_axis`, fixed on the other one."""

    squares = ((2, 2),)
    kind: Literal["universal"]

    @model_validator(mode="after")
    def _crossed(self) -> "Universal":
        axis, against = self.axes
        if self.against_axis is None:
            raise ValueError("against_axis is needed, at right angles to axis")
        if abs(axis @ against) > 1e-9:
            raise ValueError("axis and against_axis must be at right angles")
        return self


class Planar(Axial):
    """Leaves the motion in a plane whose normal is its axis."""

    along = (2,)
    squares = ALIGNED
    kind: Literal["planar"]


class Distance(Marked):
    """Keeps the distance of two points, as a massless rod with spherical joints."""

    along = ()
    kind: Literal["distance"]
    length: Length | None = Field(
        default=None, description="Distance of the points [m]; default: as the scene places the bodies"
    )

    @property
    def row_count(self) -> int:
        return 1

    @model_validator(mode="after")
    def _apart(self) -> "Distance":
        if self.against_at is None and self.against_interface is None:
            raise ValueError("against_at is needed, or against_interface: by default both points would coincide")
        return self


class Screw(Axial):
    """A cylindrical joint whose translation is `pitch` for each turn."""

    along = (0, 1)
    squares = ALIGNED
    turns = True
    kind: Literal["screw"]
    pitch: Coordinate = Field(description="Translation along the axis for each turn about it [m]; below 0: left-handed")

    @property
    def row_count(self) -> int:
        return 5

    @model_validator(mode="after")
    def _rises(self) -> "Screw":
        if self.pitch == 0:
            raise ValueError("pitch 0 given; a revolute joint does not translate")
        return self
