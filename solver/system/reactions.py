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
    where: str, body: FlexibleBody, springs: Springs, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what a reaction is found from per coordinate, (k, m), and per rate, (k, m), and its values at zero, (k,).

    Raises:
        SceneError: nothing holds the body.
    """
    if len(body.twists) >= 6:
        raise SceneError(
            f"{where}: nothing holds body '{body.name}': it has no supports, and its freedom is not restricted"
        )
    own = spring_rows(body.name, springs)
    count = MOMENTUM + 2 * len(own)
    rows, rates, offset = np.zeros((count, size)), np.zeros((count, size)), np.zeros(count)
    rates[:MOMENTUM, body.rigid] = body.morph.mass * body.twists[:, :3].T
    if body.modal.participation is not None:
        rates[:MOMENTUM, body.elastic] = body.modal.participation
    rows[MOMENTUM : MOMENTUM + len(own)] = springs.rows[own]
    rates[MOMENTUM + len(own) :] = springs.rows[own]
    offset[MOMENTUM : MOMENTUM + len(own)] = springs.stretch[own]
    return rows, rates, offset


def spring_rows(body: str, springs: Springs) -> list[int]:
    """Return the rows of the springs that act on a body."""
    acting = {name for name, ends in zip(dict.fromkeys(springs.names), springs.ends, strict=True)
              if any(end.body == body for end in ends)}  # fmt: skip
    return [row for row, name in enumerate(springs.names) if name in acting]


def spring_pulls(body: str, springs: Springs, tension: np.ndarray) -> np.ndarray:
    """Return the sum of the springs' forces on a body [N], (t, 3), of the tensions of its rows [N], (t, k)."""
    own = spring_rows(body, springs)
    owners = dict(zip(dict.fromkeys(springs.names), springs.ends, strict=True))
    first = np.array([owners[springs.names[row]][0].body == body for row in own], bool)
    return (np.where(first, -1.0, 1.0) * tension) @ springs.motions[own, :3]


def spring_tensions(body: str, springs: Springs, values: np.ndarray) -> np.ndarray:
    """Return the tensions of a body's springs [N], (t, k), of their elongations [m] and then rates [m/s], (t, 2 k)."""
    own, every = spring_rows(body, springs), np.zeros(len(springs.stiffness))
    found = np.zeros((len(values), len(own)))
    for time, (lengths, speeds) in enumerate(zip(values[:, : len(own)], values[:, len(own) :], strict=True)):
        every[own] = lengths
        found[time] = springs.tension(every)[0][own] + springs.damping[own] * speeds
    return found
