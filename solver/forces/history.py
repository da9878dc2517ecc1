"""What forces over time share: their amount, by a table or an expression of time."""

from collections.abc import Callable
from typing import ClassVar, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from gudgeon.solver.forces.expression import parsed, values_of
from gudgeon.solver.numbers import Strict

Point = tuple[float, float, float]
GAUSS = np.polynomial.legendre.leggauss(4)
"""Places and weights of the mean of an expression over a step, of order 8."""


class Amount(Strict):
    """Amount over time by a table or an expression; a member sets the unit of `values` and `expression`."""

    table: str | None = Field(default=None, description="CSV: time [s], amount; linear between the rows")
    values: tuple[tuple[float, float], ...] = ()
    expression: str | None = None

    @field_validator("expression")
    @classmethod
    def _is_one(cls, value: str | None) -> str | None:
        if value is not None:
            parsed(value)
        return value

    @model_validator(mode="after")
    def _one_amount(self) -> Self:
        tabled = self.table is not None or bool(self.values)
        if tabled == (self.expression is not None):
            raise ValueError("give one of: table, values, expression")
        times = np.array([row[0] for row in self.values])
        if self.values and (len(times) < 2 or (np.diff(times) <= 0).any()):
            raise ValueError("values: at least two rows of rising times are needed")
        return self

    def refusal(self, duration: float) -> str | None:
        """Return why the amount does not reach over a run's duration [s], after the name of the force; else None."""
        if self.expression is not None:
            return None
        first, last = self.values[0][0], self.values[-1][0]
        if first <= 0 and last >= duration * (1 - 1e-12):
            return None
        key = "values" if self.table is None else "table"
        return f"{key}: reaches from {first:.6g} to {last:.6g} s, the run from 0 to run.duration = {duration:.6g} s"

    def amounts(self, times: np.ndarray, where: str) -> np.ndarray:
        """Return the amount at times [s], (t,); a SceneError that names the force `where` if it is not finite."""
        if self.expression is not None:
            return values_of(self.expression, times, f"{where}.expression")
        return np.interp(times, *np.array(self.values, float).T)

    def means(self, start: np.ndarray, dt: float, where: str) -> np.ndarray:
        """Return the means over steps dt [s] from `start` [s], (t,): exact of a table, by Gauss of an expression."""
        if self.expression is not None:
            places, weights = GAUSS
            times = start[:, None] + 0.5 * dt * (1 + places)
            return 0.5 * (self.amounts(times.ravel(), where).reshape(times.shape) @ weights)
        ends = self._integral(np.append(start, start[-1:] + dt)) if len(start) else np.zeros(1)
        consecutive = np.allclose(np.diff(start), dt, rtol=1e-9, atol=0)
        last = ends[1:] if consecutive else self._integral(start + dt)
        return (last - ends[:-1]) / dt

    def _integral(self, times: np.ndarray) -> np.ndarray:
        """Return ∫ amount dt from the first row of the table to given times, (t,); constant amounts outside of it."""
        knots, values = np.array(self.values, float).T
        whole = np.append(0.0, np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(knots)))
        at = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
        inside = np.clip(times, knots[0], knots[-1])
        found = whole[at] + 0.5 * (values[at] + np.interp(inside, knots, values)) * (inside - knots[at])
        return found + np.minimum(times - knots[0], 0) * values[0] + np.maximum(times - knots[-1], 0) * values[-1]


class History(Amount):
    """Amount over time that acts on a body; a member sets where and along what."""

    surface: ClassVar[str | None] = "mean"
    """Kind of the interface on which it acts; None: on rigid bodies alone."""
    body: str = Field(description="Name of a body of the scene")

    def mix(self) -> np.ndarray:
        """Return a unit of it over the forces of its interface, (1, k)."""
        return np.ones((1, 1))

    def share(self) -> np.ndarray:
        """Return the forces of its rows at an amount of one, (k,)."""
        return np.ones(1)

    def wrench(self, turned: Callable[[Point], np.ndarray]) -> np.ndarray:
        """Return force and moment of a unit of it about the component's origin of a rigid body, (6,) or (k, 6).

        Args:
            turned: Turns a vector of the component into the axes of the scene.
        """
        raise NotImplementedError
