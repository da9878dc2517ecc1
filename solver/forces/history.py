"""What forces over time share: their amount, by a table or an expression of time."""

from collections.abc import Callable
from typing import ClassVar, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.breaks import breaks_of
from gudgeon.solver.forces.expression import function_of, parsed
from gudgeon.solver.forces.jumps import pole_of
from gudgeon.solver.forces.signals import Function, lines
from gudgeon.solver.numbers import Strict

Point = tuple[float, float, float]
GAUSS = np.polynomial.legendre.leggauss(4)
"""Places and weights of the mean of an expression over a step, of order 8."""
PARTS = 8
"""Parts of a span between two breaks over each of which an expression is integrated."""
NONE = np.empty((0, 2))
LOOKED_AT = 4001
"""Times of a run at which an expression is read to see whether it jumps or grows without bound."""


class Amount(Strict):
    """Amount over time by a table or an expression; a member sets the unit of `values` and `expression`."""

    unbounded: ClassVar[str] = "load"
    """What is infinite where the amount, or the rate of it that acts, grows without bound."""
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
        """Return why the amount does not reach over a run's duration [s], or grows without bound in it, after the name
        of the force; else None."""
        if self.expression is not None:
            time = pole_of(self._course, np.linspace(0.0, duration, LOOKED_AT))
            asks = f"which asks for an infinite {self.unbounded}"
            return None if time is None else f"expression: grows without bound near t = {time:.6g} s, {asks}"
        start, stop = self.values[0][0], self.values[-1][0]
        if start <= 0 and stop >= duration * (1 - 1e-12):
            return None
        key = "values" if self.table is None else "table"
        return f"{key}: reaches from {start:.6g} to {stop:.6g} s, the run from 0 to run.duration = {duration:.6g} s"

    def check(self, duration: float, key: str) -> None:
        """Raise a SceneError that names the force `key` unless the amount is finite over a run's duration [s]."""
        if (reason := self.refusal(duration)) is not None:
            raise SceneError(f"{key}.{reason}")
        self.amounts(np.linspace(0.0, duration, LOOKED_AT), key)

    def _course(self, times: np.ndarray) -> np.ndarray:
        """Return an expression, and those of its rates that act, at times [s], finite or not, (t, k)."""
        assert self.expression is not None
        return function_of(self.expression, "").plain(times)

    def function(self, key: str) -> Function:
        """Return the amount over time, of which refusals name the force `key`."""
        return lines(self.values) if self.expression is None else function_of(self.expression, f"{key}.expression")

    def amounts(self, times: np.ndarray, key: str) -> np.ndarray:
        """Return the amount at times [s], (t,); a SceneError that names the force `key` if it is not finite."""
        return self.function(key).read(times)[:, 0]

    def breaks(self, duration: float, key: str) -> np.ndarray:
        """Return the times of a run [s] about which an expression changes within a short time, (b, 2), see `breaks`."""
        if self.expression is None:
            return np.empty((0, 2))
        return breaks_of(lambda times: self.amounts(times, key), duration)

    def means(self, start: np.ndarray, dt: float, key: str, breaks: np.ndarray = NONE) -> np.ndarray:
        """Return the means over steps dt [s] from `start` [s], (t,): exact of a table, by Gauss of an expression.

        Args:
            breaks: Between which the expression is even, (b, 2): steps over them are taken in parts.
        """
        if self.expression is not None:
            means = self._integrals(start, np.full(len(start), dt), key) / dt
            broken = np.searchsorted(breaks[:, 0], start + dt) > np.searchsorted(breaks[:, 0], start)
            for step in np.flatnonzero(broken):
                step_start, end = start[step], start[step] + dt
                inner = breaks[(breaks[:, 0] > step_start) & (breaks[:, 1] < end)].ravel()
                edges = np.concatenate([[step_start], inner, [end]])
                starts = (edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.0, 1.0, PARTS + 1)[:-1]).ravel()
                means[step] = self._integrals(starts, np.diff(np.append(starts, end)), key).sum() / dt
            return means
        ends = self._integral(np.append(start, start[-1:] + dt)) if len(start) else np.zeros(1)
        consecutive = np.allclose(np.diff(start), dt, rtol=1e-9, atol=0)
        to_ends = ends[1:] if consecutive else self._integral(start + dt)
        return (to_ends - ends[:-1]) / dt

    def _integrals(self, start: np.ndarray, size: np.ndarray, key: str) -> np.ndarray:
        """Return the integrals of an expression over spans from `start` of given sizes [s], (t,), by Gauss."""
        nodes, weights = GAUSS
        times = start[:, None] + 0.5 * size[:, None] * (1 + nodes)
        return 0.5 * size * (self.amounts(times.ravel(), key).reshape(times.shape) @ weights)

    def _integral(self, times: np.ndarray) -> np.ndarray:
        """Return ∫ amount dt from the first row of the table to given times, (t,); constant amounts outside of it."""
        knots, values = np.array(self.values, float).T
        integrals = np.append(0.0, np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(knots)))
        row = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
        clipped = np.clip(times, knots[0], knots[-1])
        integral = integrals[row] + 0.5 * (values[row] + np.interp(clipped, knots, values)) * (clipped - knots[row])
        return integral + np.minimum(times - knots[0], 0) * values[0] + np.maximum(times - knots[-1], 0) * values[-1]


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
