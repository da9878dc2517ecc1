"""Forces by which supports, restricted freedom and joints of two markers hold bodies, from their momentum.

The mean reaction over an interval is the change of the momentum Tᵀ M ẋ of the body less the impulses of all other
forces on it. Statically it is exact with any number of modes: what the kept ones lack is massless.
"""

import numpy as np

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.errors import SceneError
from gudgeon.solver.system.springs import Springs

MOMENTUM = 3
"""Values of a reaction's probe that are the momentum; elongations and rates of the body's springs follow."""


def reaction_rows(
    key: str, body: FlexibleBody, springs: Springs, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what a reaction is found from per coordinate, (k, m), and per rate, (k, m), and its values at zero, (k,).

    Raises:
        SceneError: nothing holds the body.
    """
    if len(body.twists) >= 6:
        raise SceneError(
            f"{key}: nothing holds body '{body.name}': it has no supports, and its freedom is not restricted"
        )
    numbers = spring_rows(body.name, springs)
    count = MOMENTUM + 2 * len(numbers)
    rows, rates, offset = np.zeros((count, size)), np.zeros((count, size)), np.zeros(count)
    rates[:MOMENTUM, body.rigid] = body.morph.mass * body.twists[:, :3].T
    if body.modal.participation is not None:
        rates[:MOMENTUM, body.elastic] = body.modal.participation
    rows[MOMENTUM : MOMENTUM + len(numbers)] = springs.rows[numbers]
    rates[MOMENTUM + len(numbers) :] = springs.rows[numbers]
    offset[MOMENTUM : MOMENTUM + len(numbers)] = springs.stretch[numbers]
    return rows, rates, offset


def spring_rows(body: str, springs: Springs) -> list[int]:
    """Return the rows of the springs that act on a body."""
    acting = {name for name, ends in zip(dict.fromkeys(springs.names), springs.ends, strict=True)
              if any(end.body == body for end in ends)}  # fmt: skip
    return [row for row, name in enumerate(springs.names) if name in acting]


def spring_pulls(body: str, springs: Springs, tension: np.ndarray) -> np.ndarray:
    """Return the sum of the springs' forces on a body [N], (t, 3), of the tensions of its rows [N], (t, k)."""
    numbers = spring_rows(body, springs)
    owners = dict(zip(dict.fromkeys(springs.names), springs.ends, strict=True))
    near_end = np.array([owners[springs.names[row]][0].body == body for row in numbers], bool)
    return (np.where(near_end, -1.0, 1.0) * tension) @ springs.motions[numbers, :3]


def spring_tensions(body: str, springs: Springs, values: np.ndarray) -> np.ndarray:
    """Return the tensions of a body's springs [N], (t, k), of their elongations [m] and then rates [m/s], (t, 2 k)."""
    numbers, every = spring_rows(body, springs), np.zeros(len(springs.stiffness))
    tensions = np.zeros((len(values), len(numbers)))
    for time, (lengths, speeds) in enumerate(zip(values[:, : len(numbers)], values[:, len(numbers) :], strict=True)):
        every[numbers] = lengths
        tensions[time] = springs.tension(every)[0][numbers] + springs.damping[numbers] * speeds
    return tensions
