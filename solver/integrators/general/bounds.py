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
    found = np.zeros((2, len(ports.offset)))
    for own, to, values in ports.pairs.blocks(ports.flexibility):
        here = slice(own.start, own.stop)
        others = np.abs(values)
        if not damped:
            for columns in others:
                columns[block[here, None] == block[to]] = 0.0
        for side, body in enumerate(ports.sides[own.start]):
            for columns, of_body in zip(others, body == ports.sides[to].T, strict=True):
                if body >= 0 and of_body.any():
                    largest = (columns if of_body.all() else columns[:, of_body]).max(axis=1)
                    found[side, here] = np.maximum(found[side, here], largest)
    return found


def body_parts(system: System, ports: Ports) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the rigid and the elastic coordinates of each body, the parts that each port moves with, and ‖W‖ there.

    Bounds by parts are closer than by all coordinates: bodies approach by their rigid motion.
    """
    parts = [here for body in system.bodies.values() for here in (body.rigid, body.elastic)]
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
            first = 2 if ports.sides[points.start, 1] >= 0 else 0
            norms[first : first + 2, points] += norms[:2, functions].max(axis=1, keepdims=True)
    return np.array([[here.start, here.stop] for here in parts]).reshape(-1, 2), near, norms


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
    for number, body in enumerate(system.bodies.values()):
        for own, _, rows in ports.rows.over(body.coordinates).blocks:
            side = np.where(ports.sides[own, 0] == number, 0, 1)
            yield body, np.arange(len(ports.offset))[own], side, rows
