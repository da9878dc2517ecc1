"""A bushing: stiffness and damping of three translations and three rotations between two bodies, or to the ground."""

from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.forces.ends import TwoEnds
from gudgeon.solver.numbers import (
    BushingDamping,
    BushingStiffness,
    CouplingDamping,
    CouplingStiffness,
    TurningDamping,
    TurningStiffness,
)

SYMMETRIC = 1e-12
"""Asymmetry of a matrix, and its least eigenvalue below zero, relative to its diagonal, that is round-off."""
Translations = tuple[BushingStiffness, BushingStiffness, BushingStiffness]
Rotations = tuple[TurningStiffness, TurningStiffness, TurningStiffness]
Both = tuple[CouplingStiffness, CouplingStiffness, CouplingStiffness]
TranslationDampings = tuple[BushingDamping, BushingDamping, BushingDamping]
RotationDampings = tuple[TurningDamping, TurningDamping, TurningDamping]
BothDampings = tuple[CouplingDamping, CouplingDamping, CouplingDamping]


class Bushing(TwoEnds):
    """Linear bushing at a point, relaxed at the start, along the axes of the scene."""

    kind: Literal["bushing"]
    stiffness: Translations | tuple[Translations, Translations, Translations] = Field(
        default=(0.0, 0.0, 0.0), description="Of translations along x, y, z [N/m]: three numbers or a 3 × 3 matrix"
    )
    rotational_stiffness: Rotations | tuple[Rotations, Rotations, Rotations] = Field(
        default=(0.0, 0.0, 0.0),
        description="Of rotations about x, y, z [N m/rad]: three numbers or a 3 × 3 matrix; on an elastic body it needs"
        " an interface of kind 'tie'",
    )
    coupling: tuple[Both, Both, Both] | None = Field(
        default=None, description="Force along x, y, z (rows) per rotation about x, y, z [N/rad], 3 × 3; default: none"
    )
    damping: TranslationDampings | tuple[TranslationDampings, TranslationDampings, TranslationDampings] = Field(
        default=(0.0, 0.0, 0.0), description="Of translations [N s/m], as stiffness"
    )
    rotational_damping: RotationDampings | tuple[RotationDampings, RotationDampings, RotationDampings] = Field(
        default=(0.0, 0.0, 0.0), description="Of rotations [N m s/rad], as rotational_stiffness"
    )
    coupling_damping: tuple[BothDampings, BothDampings, BothDampings] | None = Field(
        default=None, description="Force along x, y, z (rows) per rate of rotation [N s/rad], 3 × 3; default: none"
    )

    @model_validator(mode="after")
    def _passive(self) -> "Bushing":
        for name, matrix in zip(("stiffness", "damping"), self.matrices(), strict=True):
            diagonal = matrix.diagonal()
            if (diagonal < 0).any():
                raise ValueError(f"{name}: {diagonal.min():g} on the diagonal is negative")
            scale = np.sqrt(np.outer(diagonal, diagonal))
            if (np.abs(matrix - matrix.T) > SYMMETRIC * scale).any():
                raise ValueError(f"{name}: the matrix is not symmetric")
            unit = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
            beside = (np.abs(matrix) > scale * (1 + SYMMETRIC)).any()
            if beside or np.linalg.eigvalsh(matrix / np.outer(unit, unit))[0] < -6 * SYMMETRIC:
                raise ValueError(f"{name}: the matrix with rotations and coupling is not positive semidefinite")
        if not any(matrix.any() for matrix in self.matrices()):
            raise ValueError("stiffness and damping are zero; give one of them")
        return self

    @property
    def damped(self) -> bool:
        """Whether it has a damping."""
        return bool(self.matrices()[1].any())

    @property
    def linear(self) -> bool:
        """Whether each of its parts has a stiffness, so that none is a damper alone."""
        return bool((self.parts()[1] > 0).all())

    def parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the motions whose forces are independent, over three translations and three rotations, (b, 6), with
        stiffness and damping of each, (b,).

        Both matrices are positive semidefinite, so that one congruence makes both of them diagonal.
        """
        stiffness, damping = self.matrices()
        both = stiffness / (np.abs(stiffness).max() or 1.0) + damping / (np.abs(damping).max() or 1.0)
        acting = np.flatnonzero(both.diagonal())
        if not (np.count_nonzero(stiffness - np.diag(stiffness.diagonal())) or np.count_nonzero(
            damping - np.diag(damping.diagonal())
        )):  # fmt: skip
            return np.eye(6)[acting], stiffness.diagonal()[acting], damping.diagonal()[acting]
        scale = np.sqrt(both.diagonal()[acting])
        values, vectors = np.linalg.eigh(both[np.ix_(acting, acting)] / np.outer(scale, scale))
        resisted = values > 6 * SYMMETRIC
        root, vectors = np.sqrt(values[resisted]), vectors[:, resisted]
        back = vectors / scale[:, None] / root
        stiff, turn = np.linalg.eigh(back.T @ stiffness[np.ix_(acting, acting)] @ back)
        damped = np.einsum("ib,ij,jb->b", back @ turn, damping[np.ix_(acting, acting)], back @ turn)
        motions = np.zeros((len(root), 6))
        motions[:, acting] = turn.T @ (vectors * root).T * scale
        size = np.abs(motions).max(axis=1)
        clean = [
            np.where(coefficients > 6 * SYMMETRIC * coefficients.max(), coefficients, 0.0)
            for coefficients in (stiff, damped)
        ]
        return motions / size[:, None], clean[0] * size**2, clean[1] * size**2

    def matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness and damping over translations along x, y, z, then rotations about them, (6, 6) each."""
        return (
            _joined(self.stiffness, self.rotational_stiffness, self.coupling),
            _joined(self.damping, self.rotational_damping, self.coupling_damping),
        )


def _joined(translations: Any, rotations: Any, coupling: Any) -> np.ndarray:
    matrix = np.zeros((6, 6))
    for span, matrix_entries in ((slice(3), translations), (slice(3, 6), rotations)):
        values = np.array(matrix_entries, float)
        matrix[span, span] = np.diag(values) if values.ndim == 1 else values
    if coupling is not None:
        matrix[:3, 3:], matrix[3:, :3] = np.array(coupling), np.array(coupling).T
    return matrix
