"""Small vibrations of the rotating cantilever of M5 about its steady rotation, by the accelerations of the solver."""

from pathlib import Path
from typing import Any

import numpy as np

from gudgeon import modaldb
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.solver import core
from gudgeon.solver.integrators.turning.arrays import PLACE, SPEED, SPIN, WIDTH
from gudgeon.solver.integrators.turning.energy import inertia_factor
from gudgeon.solver.integrators.turning.flexible.frame import point_of
from gudgeon.solver.integrators.turning.integrator import Turning
from gudgeon.solver.system.compile import compile_system
from tests.scenes import scene_path

SCALE = np.sqrt(2.1e11 * 0.004**2 / 12 / 7850.0) / 0.5**2
"""Angular frequency of λ = 1 [rad/s]."""
STEP = 1e-6
"""Of the finite differences, over the length of the beam."""


def frequencies(folder: Path, gamma: float, axis: str, *, geometric: bool = True) -> np.ndarray:
    """Return the three lowest λ of bending towards z at speed γ about an axis through the root, (3,)."""
    along = [0.0, 1.0, 0.0] if axis == "y" else [0.0, 0.0, 1.0]
    changes: dict[str, Any] = {"joint.axle.axis": along, "joint.drive.expression": f"{gamma * SCALE:.15g}*t"}
    if not geometric:
        changes["body.beam.geometric_stiffness"] = False
    scene = scene_path("rotating-beam")
    run(scene, set=changes, db=folder / "db", out=folder / "out", until="morph")
    job = open_job(scene, set=changes, db=folder / "db", out=folder / "out")
    system = compile_system(modaldb.open(folder / "db"), job.scene, job.morphs())
    found = Turning(system, 1e-3)
    m = int(found.model.elastic[1, 0])
    frame, body = found.linkage.frames[1], system.bodies["beam"]
    tip = point_of(body, frame, "tip")[1][:3] - point_of(body, frame, "root")[1][:3]
    h = STEP * 0.5 / np.abs(tip).max()
    omega = gamma * SCALE * np.array(along)
    q = np.zeros(m)
    for _ in range(8):  # The stretch by the rotation, by Newton's method.
        q = q - np.linalg.solve(_slope(found, omega, q, h)[:, :m], _accelerations(found, omega, q, np.zeros(m)))
    slope = _slope(found, omega, q, h)
    values, vectors = np.linalg.eig(np.block([[np.zeros((m, m)), np.eye(m)], [slope]]))
    moved = np.abs(tip @ vectors[:m])
    bends = (values.imag > 0) & (moved[2] > 10 * np.maximum(moved[0], moved[1]))
    return np.sort(values.imag[bends])[:3] / SCALE


def _slope(found: Turning, omega: np.ndarray, q: np.ndarray, h: float) -> np.ndarray:
    """Return the derivatives of the modal accelerations by coordinates and rates, (m, 2 m)."""
    m, columns = len(q), []
    for number in range(2 * m):
        move = np.zeros(2 * m)
        move[number] = h if number < m else h * SCALE
        ends = [_accelerations(found, omega, q + s * move[:m], s * move[m:]) for s in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2 * move[number]))
    return np.column_stack(columns)


def _accelerations(found: Turning, omega: np.ndarray, q: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Return q̈ of the beam, whose root stands at the origin and turns steadily, (m,)."""
    model, work, m = found.model, found.work, len(q)
    state, beam = found.start.state.copy(), WIDTH
    at, momentum = int(model.elastic[1, 1]), int(model.elastic[1, 2])
    state[at : at + m] = q
    state[SPEED : SPEED + 3], state[SPIN : SPIN + 3] = 0.0, model.inertia[0] @ omega
    turning = core.Turning(model, work)
    turning.observe(state)
    clamp = next(p for p, owner in enumerate(model.point_owner) if owner == 1)
    rows, arm = work.point_rows[clamp, :3, :m].copy(), work.arm[clamp].copy()
    L = inertia_factor(model, work, 1)
    momenta = np.roll(L @ (L.T @ np.concatenate([rates, omega])), 3)
    state[beam + PLACE : beam + PLACE + 3] = -arm
    state[beam + SPEED : beam + SPEED + 3] = -np.cross(omega, arm) - rows @ rates
    state[beam + SPIN : beam + SPIN + 3], state[momentum : momentum + m] = momenta[:3], momenta[3:]
    given, amounts = np.array([[0.0, float(np.linalg.norm(omega)), 0.0]]), np.zeros(0)
    turning.begin(state, given, amounts)
    found_rates = work.rate[1, 6 : 6 + m].copy()
    for i, multiplier in enumerate(work.multiplier):
        for p in range(4):
            if work.block_owner[i, p] == 1:
                row = np.roll(work.block[i, p, 3 : 6 + m], -3)
                found_rates += multiplier * np.linalg.solve(L @ L.T, row)[:m]
    return found_rates
