"""Bounds of what ports of the loop over ports move: norms of rows by parts of bodies, and largest flexibilities."""

from collections.abc import Iterator

import numpy as np

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.ports.table import Ports
from gudgeon.solver.system.system import System


def largest_flexibilities(ports: Ports, block: np.ndarray, *, damped: bool) -> np.ndarray:
    """Return the largest |R| of each port by forces on either of its bodies [m/N], (2, p).

    An open port has no force itself, nor the others of its block; where r is damped, one of an earlier step.

    Args:
        block: First port of each port's block, (p,).
    """
    flexibilities = np.zeros((2, len(ports.offset)))
    for group, to, values in ports.pairs.blocks(ports.flexibility):
        span = slice(group.start, group.stop)
        sizes = np.abs(values)
        if not damped:
            for columns in sizes:
                columns[block[span, None] == block[to]] = 0.0
        for side, body in enumerate(ports.sides[group.start]):
            for columns, of_body in zip(sizes, body == ports.sides[to].T, strict=True):
                if body >= 0 and of_body.any():
                    largest = (columns if of_body.all() else columns[:, of_body]).max(axis=1)
                    flexibilities[side, span] = np.maximum(flexibilities[side, span], largest)
    return flexibilities


def body_parts(system: System, ports: Ports) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the rigid and the elastic coordinates of each body, the parts that each port moves with, and ‖W‖ there.

    Bounds by parts are closer than by all coordinates: bodies approach by their rigid motion.
    """
    spans = [span for body in system.bodies.values() for span in (body.rigid, body.elastic)]
    near, norms = np.zeros((len(ports.offset), 4), np.int64), np.zeros((4, len(ports.offset)))
    for side in range(2):
        for n in range(2):
            near[:, 2 * side + n] = 2 * np.maximum(ports.sides[:, side], 0) + n
    for body, numbers, side, rows in by_body(system, ports):
        norms[2 * side, numbers] = np.linalg.norm(rows[:, : body.rigid_count], axis=1)
        norms[2 * side + 1, numbers] = np.linalg.norm(rows[:, body.rigid_count :], axis=1)
    for contact in system.contacts:
        if contact.master is not None:
            # The weights of functions are positive, with a sum of one.
            points, functions = ports.of(f"contact.{contact.name}"), ports.of(f"surface.{contact.name}")
            row = 2 if ports.sides[points.start, 1] >= 0 else 0
            norms[row : row + 2, points] += norms[:2, functions].max(axis=1, keepdims=True)
    return np.array([[span.start, span.stop] for span in spans]).reshape(-1, 2), near, norms


def largest_norms(parts: np.ndarray, near: np.ndarray, norms: np.ndarray, touching: np.ndarray) -> np.ndarray:
    """Return `widest` of `Constants`; touching: first ports of the blocks of contacts, (p,)."""
    sums = np.zeros(len(parts))
    for part, norm in zip(near[touching].T, norms[:, touching], strict=True):
        largest = np.zeros(len(parts))
        np.maximum.at(largest, part, norm)
        sums += largest
    return sums


def by_body(system: System, ports: Ports) -> Iterator[tuple[FlexibleBody, np.ndarray, np.ndarray, np.ndarray]]:
    """Yield a body, ports that it moves, which of their sides it is, and their rows over its coordinates."""
    for body_id, body in enumerate(system.bodies.values()):
        for ports_of, _, rows in ports.rows.over(body.coordinates).blocks:
            side = np.where(ports.sides[ports_of, 0] == body_id, 0, 1)
            yield body, np.arange(len(ports.offset))[ports_of], side, rows
