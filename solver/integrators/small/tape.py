"""The states of a run of the loop over ports at the ends of all its steps, and derivatives by one pass back over them.

Shapes: S steps, m coordinates, p ports, s sides of the residual flexibility, g given loads.
"""

from typing import NamedTuple

import numpy as np


class Tape(NamedTuple):
    """The states at the ends of all steps, the start included where there is one row more."""

    q: np.ndarray
    v: np.ndarray
    """(S + 1, m)"""
    unknown: np.ndarray
    """As in `arrays.State` [N], (S + 1, p)."""
    held: np.ndarray
    """r: forces in the residual flexibility [N], (S + 1, s, p)."""
    mean: np.ndarray
    """Mean forces of the steps [N], (S, p)."""


class Gradient(NamedTuple):
    """Derivatives of a quantity by the arrays of a run; those by a state are of its start after the pass."""

    motion: np.ndarray
    push: np.ndarray
    """As in `Flight`, (4, m), (2, m)."""
    gravity: np.ndarray
    rows: np.ndarray
    """By W, (p, m)."""
    residual: np.ndarray
    """By the displacement of port i for the force of port j on each side, (s, p, p)."""
    memory: np.ndarray
    """(s, 3, p)"""
    layer: np.ndarray
    offset: np.ndarray
    law: np.ndarray
    """(p, 4)"""
    loads: np.ndarray
    """By means of given loads, and by those at the ends of steps, (2, S, g)."""
    state: np.ndarray
    """By q and its rate, (2, m)."""
    force: np.ndarray
    """By the forces of the ports, (p,)."""
    held: np.ndarray
    """By r, (s, p)."""


class Backward(NamedTuple):
    """Work arrays of a pass, see `Backward` in solver/core/small/adjoint.hpp."""

    ports: np.ndarray
    active: np.ndarray
    altered: np.ndarray
    total: np.ndarray
    pulled: np.ndarray
    after: np.ndarray
    before: np.ndarray
    way: np.ndarray
    now: np.ndarray
    ways: np.ndarray
    starts: np.ndarray
    matrix: np.ndarray
    right: np.ndarray


def empty_tape(steps: int, m: int, p: int, s: int) -> Tape:
    """Return the tape of a run before its first step."""
    return Tape(np.zeros((steps + 1, m)), np.zeros((steps + 1, m)), np.zeros((steps + 1, p)),
                np.zeros((steps + 1, s, p)), np.zeros((steps, p)))  # fmt: skip


def begun(tape: Tape, ends: np.ndarray, g: int) -> tuple[Gradient, Backward]:
    """Return derivatives before the pass, those by the state at the end (2, m) given, and its work arrays."""
    steps, p = tape.mean.shape
    m, s = tape.q.shape[1], tape.held.shape[1]
    gradient = Gradient(
        motion=np.zeros((4, m)), push=np.zeros((2, m)), gravity=np.zeros(m), rows=np.zeros((p, m)),
        residual=np.zeros((s, p, p)), memory=np.zeros((s, 3, p)), layer=np.zeros(p), offset=np.zeros(p),
        law=np.zeros((p, 4)), loads=np.zeros((2, steps, g)), state=np.array(ends), force=np.zeros(p),
        held=np.zeros((s, p)),
    )  # fmt: skip
    work = Backward(
        ports=np.zeros(p + 1, np.int64), active=np.zeros(p + 1, np.int64), altered=np.zeros(p + 1, np.int64),
        total=np.zeros(m), pulled=np.zeros(m), after=np.zeros(p), before=np.zeros(p), way=np.zeros(p),
        now=np.zeros(p), ways=np.zeros((s, p)),
        starts=np.zeros((s, p)), matrix=np.zeros((2 * p, 2 * p)), right=np.zeros(2 * p),
    )  # fmt: skip
    return gradient, work
