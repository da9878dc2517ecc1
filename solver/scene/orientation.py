"""Orientation of a body: a unit quaternion, three Euler angles, or an axis and an angle."""

from typing import Any, Literal, get_args

import numpy as np
from pydantic import ConfigDict, Field, model_validator

from gudgeon.solver.numbers import Angle, Strict
from gudgeon.solver.vectors import Direction, Quaternion, unit

Order = Literal["xyz", "yzx", "zxy", "xzy", "zyx", "yxz", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz"]
UNIT = 1e-4
"""Distance of a quaternion's norm from 1 up to which it counts as written with few digits, and is normalised."""
OF_UNIT = {"type": "number", "minimum": -1, "maximum": 1}
"""Schema of a number of a unit quaternion."""


class Orientation(Strict):
    """Rotation of a component about its origin, from its own axes to those of the scene."""

    model_config = ConfigDict(
        json_schema_extra={"short_form": {"type": "array", "items": OF_UNIT, "minItems": 4, "maxItems": 4}}
    )

    quaternion: Quaternion | None = Field(
        default=None, description="Unit quaternion w, x, y, z; a list in place of the table is one"
    )
    euler: tuple[Angle, Angle, Angle] | None = Field(
        default=None, description="Euler angles in the sequence of `order` [deg]"
    )
    order: Order | None = Field(default=None, description="Axes of the Euler angles in sequence")
    about: Literal["intrinsic", "extrinsic"] = Field(
        default="intrinsic",
        description="Euler angles about axes that turn with the body (intrinsic), or about those of the scene"
        " (extrinsic)",
    )
    axis: Direction | None = Field(default=None, description="Axis of rotation, of any length, by the right hand")
    angle: Angle | None = Field(default=None, description="Angle about `axis` [deg]")

    @model_validator(mode="before")
    @classmethod
    def _list_is_a_quaternion(cls, value: Any) -> Any:
        return {"quaternion": value} if isinstance(value, list | tuple) else value

    @model_validator(mode="after")
    def _one_kind(self) -> "Orientation":
        named = [self.quaternion is not None, self.euler is not None, self.axis is not None or self.angle is not None]
        if sum(named) != 1:
            raise ValueError("give one of: a quaternion [w, x, y, z]; euler and order; axis and angle")
        if (self.order is None) == (self.euler is not None):
            raise ValueError(f"euler needs order, and order euler; order is one of {', '.join(get_args(Order))}")
        if self.about != "intrinsic" and self.euler is None:
            raise ValueError("about belongs to euler")
        if (self.axis is None) != (self.angle is None):
            raise ValueError("axis needs angle, and angle axis")
        if self.quaternion is not None and abs((norm := float(np.linalg.norm(self.quaternion))) - 1) > UNIT:
            raise ValueError(
                f"the quaternion {list(self.quaternion)} has the norm {norm:.6g}; needed: 1 within {UNIT:g}"
            )
        return self

    def matrix(self) -> np.ndarray:
        """Return the rotation matrix Q, (3, 3): a vector x of the component is Q x in the scene."""
        if self.quaternion is not None:
            return _of_quaternion(np.array(self.quaternion))
        if self.euler is not None and self.order is not None:
            turns = [_about(np.eye(3)["xyz".index(x)], a) for x, a in zip(self.order, self.euler, strict=True)]
            Q1, Q2, Q3 = turns if self.about == "intrinsic" else turns[::-1]
            return Q1 @ Q2 @ Q3
        assert self.axis is not None
        assert self.angle is not None
        return _about(unit(self.axis), self.angle)


def quaternion_of(Q: np.ndarray) -> tuple[float, float, float, float]:
    """Return the unit quaternion w, x, y, z of a rotation matrix, (3, 3).

    It is the eigenvector of the largest eigenvalue of a symmetric matrix that is linear in Q (Bar-Itzhack 2000).
    """
    K = np.array(
        [
            [np.trace(Q), Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1]],
            [0.0, Q[0, 0] - Q[1, 1] - Q[2, 2], Q[1, 0] + Q[0, 1], Q[2, 0] + Q[0, 2]],
            [0.0, 0.0, Q[1, 1] - Q[0, 0] - Q[2, 2], Q[2, 1] + Q[1, 2]],
            [0.0, 0.0, 0.0, Q[2, 2] - Q[0, 0] - Q[1, 1]],
        ]
    )
    w, x, y, z = np.linalg.eigh(K, UPLO="U")[1][:, -1]
    return float(w), float(x), float(y), float(z)


def _of_quaternion(q: np.ndarray) -> np.ndarray:
    w, x, y, z = q
    square = float(q @ q)
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    ) / square  # fmt: skip


def _about(axis: np.ndarray, degrees: float) -> np.ndarray:
    """Return the rotation about a unit axis, (3, 3), without round-off at multiples of 90 degrees (Rodrigues)."""
    quarters = round(degrees / 90)
    remainder = np.radians(degrees - 90 * quarters)
    cosine, sine = np.cos(remainder), np.sin(remainder)
    for _ in range(quarters % 4):
        cosine, sine = -sine, cosine
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.outer(axis, axis) * (1 - cosine) + cosine * np.eye(3) + sine * cross
