"""Capacitances at many poses of a group of conductors: what does not change with the pose is computed once.

The panels' matrix consists of a block of those that stay, one of those that move, and the blocks between them, which
alone depend on the pose (beside images of what moves). The first two are factorised once and precondition conjugate
gradients on the whole.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.field import POSE_AXES, FieldRecord, PoseRecord
from gudgeon.pipeline.applications.electrostatics.capacitance import (
    COARSE_SHARE,
    RULES,
    Factor,
    HalfSpace,
    areas_by_conductor,
    coarse_matrix,
    coarsened,
    integrals,
)
from gudgeon.pipeline.applications.electrostatics.grid import Moved
from gudgeon.pipeline.applications.electrostatics.panels import Group, Panels
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.solver import core
from gudgeon.solver.vectors import rotation_of

CONVERGED = 1e-8
"""Residual of a solution relative to the right-hand side, in the norm of the preconditioner. C is a quadratic form at
its minimum, so its error is of the square of this."""
MOST_ITERATIONS = 500


def memory(fixed: int, moving: int, *, images: bool) -> float:
    """Return what a process needs for the matrices of a grid with so many panels that stay and that move [bytes].

    Matrix and factor of both parts stay; of a pose there are the block between them, with images the moving block once
    more, and the coarse matrix with its factor.
    """
    coarse = ((fixed + moving) / 4) ** 2
    return 8.0 * (2 * fixed**2 + (3 if images else 2) * moving**2 + fixed * moving + 3 * coarse)


class _Part(NamedTuple):
    """Panels that keep their places relative to each other."""

    panels: Panels
    group: Group
    matrix: np.ndarray
    factor: Factor
    right: np.ndarray
    """Areas of the panels by conductor [m²], (panels, k)."""


def panels_of_record(record: FieldRecord) -> Panels:
    """Return the panels of a record; their distance from the true surface is in its errors and is 0 here."""
    return Panels(record.facets, record.panel, record.coarse, record.conductor, np.zeros(len(record.coarse)))


def half_space_of_record(record: FieldRecord) -> HalfSpace | None:
    """Return the half-space of a record, None without one."""
    medium = record.medium
    if "image_factor" not in medium:
        return None
    return HalfSpace(np.array(medium["point"]), np.array(medium["normal"]), medium["image_factor"])


def chosen_panels(panels: Panels, chosen: np.ndarray) -> Panels:
    """Return the panels of some conductors, (conductors,) bool, numbered anew; coarse panels are within conductors."""
    keep = chosen[panels.conductor]
    facets = keep[panels.panel]
    renumbered = np.cumsum(keep) - 1
    coarse = np.unique(panels.coarse[keep], return_inverse=True)[1]
    return Panels(
        panels.facets[facets], renumbered[panels.panel[facets]], coarse, panels.conductor[keep], panels.deviation[keep]
    )


class PoseProblem:
    """Conductors of which some move as one.

    Raises:
        StageError: panels of two conductors coincide.
    """

    def __init__(self, record: FieldRecord, moved: Moved) -> None:
        names = record.conductors["names"]
        self._half_space, self._moved, self._count = half_space_of_record(record), moved, len(names)
        self._scale = 4 * np.pi * record.medium["permittivity"]
        panels, moves = panels_of_record(record), np.isin(names, moved.names)
        self._fixed = self._part(chosen_panels(panels, ~moves), self._half_space)
        self._moving = self._part(chosen_panels(panels, moves), None)

    def _part(self, panels: Panels, half_space: HalfSpace | None) -> _Part:
        group = panels.group()
        matrix = integrals(panels, half_space, lambda stage, fraction: None)
        factor = Factor.of(matrix.copy(), "poses")
        return _Part(panels, group, matrix, factor, areas_by_conductor(panels, group.areas, self._count))

    def at(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        """Return C and its error [F], (k, k) each, at a pose (6,), and the iterations.

        Raises:
            InputError: conductors touch or overlap there.
            StageError: the iteration did not converge.
        """
        fixed, moving = self._fixed, self._moving
        Q = rotation_of(pose[3:])
        pivot = self._moved.pivot
        panels = replace(moving.panels, facets=(moving.panels.facets - pivot) @ Q.T + pivot + pose[:3])
        group = panels.group()
        self._refuse_overlap(panels, group, pose)
        between, among = np.zeros((len(fixed.panels), len(panels))), moving.matrix
        if len(fixed.panels):  # A half-space may be all that stays.
            core.panels.fill(fixed.group, group, 1.0, between)
        if (half := self._half_space) is not None:
            image = half.mirrored(panels).group()
            if len(fixed.panels):
                core.panels.fill(fixed.group, image, half.factor, between)
            among = among.copy()
            core.panels.fill_symmetric(group, image, half.factor, 0, len(panels), among)
        split, right = len(fixed.panels), np.concatenate([fixed.right, moving.right])

        def product(x: np.ndarray) -> np.ndarray:
            a, b = x[:split], x[split:]
            return np.concatenate([fixed.matrix @ a + between @ b, between.T @ a + among @ b])

        def precondition(x: np.ndarray) -> np.ndarray:
            return np.concatenate([fixed.factor.solve(x[:split]), moving.factor.solve(x[split:])])

        density, iterations = conjugate_gradients(product, precondition, right)
        # Second order in the error of the density: 2 bᵀx − xᵀAx.
        C = right.T @ density
        C = self._scale * (C + C.T - density.T @ product(density))
        small = self._coarse(between, among)
        error = COARSE_SHARE * np.abs(C - small) + RULES * np.abs(C)
        return 0.5 * (C + C.T), error, iterations

    def _coarse(self, between: np.ndarray, among: np.ndarray) -> np.ndarray:
        a, b = self._fixed.panels.coarse, self._moving.panels.coarse
        matrix, right = coarse_matrix(among, b, b), coarsened(self._moving.right, b)
        if len(a):
            mixed = coarse_matrix(between, a, b)
            matrix = np.block([[coarse_matrix(self._fixed.matrix, a, a), mixed], [mixed.T, matrix]])
            right = np.concatenate([coarsened(self._fixed.right, a), right])
        return self._scale * (right.T @ Factor.of(matrix, "poses").solve(right))

    def _refuse_overlap(self, panels: Panels, group: Group, pose: np.ndarray) -> None:
        position = ", ".join(f"{name} = {value:.6g}" for name, value in zip(POSE_AXES, pose, strict=True) if value)
        if len(self._fixed.panels) and core.panels.crossing(self._fixed.group, group) is not None:
            raise InputError(
                f"poses.moved: conductors touch or overlap at the pose {position or 'of the scene'}; narrow the grid"
            )
        if (half := self._half_space) is not None:
            height = float(((panels.facets - half.point) @ half.normal).min())
            if height < 0 or (half.factor == -1 and height <= 0):
                raise InputError(
                    f"poses.moved: a conductor is {height:.4g} m above the plane of half_space at the pose {position};"
                    " narrow the grid"
                )


def conjugate_gradients(
    product: Callable[[np.ndarray], np.ndarray], precondition: Callable[[np.ndarray], np.ndarray], right: np.ndarray
) -> tuple[np.ndarray, int]:
    """Return the solutions of a symmetric positive system for several right-hand sides (n, k), and the iterations.

    Raises:
        StageError: it did not converge.
    """
    x, r = np.zeros_like(right), right.copy()
    z = precondition(r)
    p, energy = z.copy(), np.einsum("nk,nk->k", r, z)
    limit = CONVERGED**2 * energy
    for iteration in range(MOST_ITERATIONS):
        active = energy > limit
        if not active.any():
            return x, iteration
        image = product(p)
        curvature = np.einsum("nk,nk->k", p, image)
        if not (curvature[active] > 0).all():
            raise StageError("poses: the matrix of the panels is not positive definite; panels nearly touch")
        step = np.where(active, energy / np.where(active, curvature, 1.0), 0.0)
        x += step * p
        r -= step * image
        z = precondition(r)
        new = np.einsum("nk,nk->k", r, z)
        p = z + np.where(active, new / np.where(active, energy, 1.0), 0.0) * p
        energy = np.where(active, new, energy)
    raise StageError(
        f"poses: conjugate gradients did not converge in {MOST_ITERATIONS} iterations; panels nearly touch"
    )


def pose_block(record: FieldRecord, key: str, moved: Moved, poses: Sequence[np.ndarray]) -> PoseRecord:
    """Compute the capacitances at some poses, (p, 6), of the field with a key; see `PoseProblem` for what is raised."""
    start = time.process_time()
    problem = PoseProblem(record, moved)
    results = [problem.at(np.asarray(pose)) for pose in poses]
    return PoseRecord(
        field_key=key, moved={"names": list(moved.names), "pivot": moved.pivot.tolist()}, poses=np.array(poses),
        capacitance=np.array([r[0] for r in results]), panel_error=np.array([r[1] for r in results]),
        counts={"iterations": sum(r[2] for r in results), "cpu_seconds": time.process_time() - start},
    )  # fmt: skip
