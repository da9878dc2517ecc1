"""Coefficients of friction up to which the contact forces of elastic bodies are unique.

With W the flexibility of the points of a contact and S their directions of slip, the forces are unique while the
symmetric part of W_nn − μ W_nt S is positive definite. Above it a second solution may exist, but was met on no step of
a part's contact up to several times that μ. Beyond W_nn/|W_nt| of one point its own friction can hold or free it
(P. Painlevé, C. R. Acad. Sci. 121 (1895) 112): its force is not determined.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from gudgeon.solver.errors import SceneError
from gudgeon.solver.ports.members import ports_of, with_surfaces
from gudgeon.solver.ports.stick import sticks
from gudgeon.solver.ports.table import Kind
from gudgeon.solver.system.system import System

SHARE = 0.9
"""Of the coefficient at which the force of a point is no longer determined, above which a scene is refused."""
DIRECTIONS = 8
"""Directions of slip in a half-turn that are tried, the same one at all points."""


@dataclass(frozen=True)
class FrictionLimit:
    """Coefficients of one contact."""

    name: str
    friction: float
    """That of the scene."""
    unique: float
    """Up to which W_nn − μ W_nt S is positive definite."""
    single: float
    """Least W_nn/|W_nt| of a point."""
    point: np.ndarray
    """Its place [m], (3,)."""

    def note(self) -> str | None:
        """Return a sentence where the forces need not be unique."""
        if self.friction <= self.unique:
            return None
        return (
            f"contact.{self.name}.friction: above a coefficient of {self.unique:.2g} the contact forces need not be"
            f" unique (W_nn − μ W_nt is not positive definite), {self.friction:g} is given; compare with a coefficient"
            " below it, or keep more modes"
        )


def friction_limits(system: System) -> Iterator[FrictionLimit]:
    """Yield the coefficients of the contacts with friction over the flexibility of bodies."""
    if not sticks(system):
        return
    ports = with_surfaces(system, ports_of(system), system.position)
    R = ports.residual
    for i, item in enumerate(system.contacts):
        span, friction = ports.places[i], system.scene.contact[item.name].friction
        if ports.kind[span.start] != Kind.CONE or friction is None:
            continue
        numbers = np.arange(span.start, span.stop)
        matrix = R.among(numbers, numbers).reshape(len(item.points), 3, len(item.points), 3)
        normal = matrix[:, 0, :, 0] + np.diag(system.layer[item.rows])
        across = [matrix[:, 0, :, axis] for axis in (1, 2)]
        alone, tangential = normal.diagonal(), np.hypot(across[0].diagonal(), across[1].diagonal())
        if not (alone > 0).all():
            continue
        worst = int((tangential / alone).argmax())
        single = float(alone[worst] / tangential[worst]) if tangential[worst] > 0 else np.inf
        yield FrictionLimit(item.name, friction.static, _definite(normal, across), single, item.points[worst])


def _definite(normal: np.ndarray, across: list[np.ndarray]) -> float:
    """Return the least μ at which W_nn − μ W_nt S is not positive definite, 0 where W_nn is not."""
    scale = 1 / np.sqrt(normal.diagonal())
    try:
        lower = linalg.cholesky(normal * np.outer(scale, scale), lower=True)
    except linalg.LinAlgError:
        return 0.0
    largest = 0.0
    for angle in np.pi / DIRECTIONS * np.arange(DIRECTIONS):
        mixed = np.cos(angle) * across[0] + np.sin(angle) * across[1]
        half_scaled = linalg.solve_triangular(lower, 0.5 * (mixed + mixed.T) * np.outer(scale, scale), lower=True)
        values = linalg.eigvalsh(linalg.solve_triangular(lower, half_scaled.T, lower=True))
        largest = max(largest, float(np.abs(values).max()))
    return 1 / largest if largest > 0 else np.inf


def refuse_ambiguous_friction(system: System) -> None:
    """Refuse coefficients of friction at which the force of a single point is not determined.

    Raises:
        SceneError: there is one.
    """
    for limit in friction_limits(system):
        if limit.friction > SHARE * limit.single:
            coordinates = ", ".join(f"{x:.4g}" for x in limit.point)
            raise SceneError(
                f"contact.{limit.name}.friction.static: {limit.friction:g} given; above {limit.single:.3g} the point"
                f" at ({coordinates}) can be held by its own friction, so that its force is not determined; allowed: up"
                f" to {SHARE * limit.single:.3g}"
            )
