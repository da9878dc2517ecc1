"""Damping of a body's elastic coordinates: q̈ + c q̇ + ω² q = f with c = 2 ζ ω, or α + β ω²."""

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.errors import SceneError
from gudgeon.solver.numbers import DecayRate, Frequency, PositiveRatio, RatioFromZero, Strict, TimeFromZero

Below1 = Annotated[PositiveRatio, Field(lt=1)]
ShareOfCritical = Annotated[RatioFromZero, Field(lt=1)]


class Damping(Strict):
    """Damping of a body, in one of five forms; its rigid motion is not damped."""

    ratio: Below1 | None = Field(
        default=None,
        description="Damping ratio, relative to critical damping: with `frequency`, that of stiffness-proportional"
        " damping at this frequency; alone, that of every elastic coordinate",
    )
    ratios: tuple[ShareOfCritical, ...] | None = Field(
        default=None,
        min_length=1,
        description="Damping ratio of each elastic coordinate in the order of their frequencies; further ones are not"
        " used",
    )
    frequency: Frequency | None = Field(
        default=None, description="Frequency at which stiffness-proportional damping has the `ratio` [Hz]"
    )
    table: str | None = Field(default=None, description="CSV: frequency [Hz], damping ratio; linear between the rows")
    values: tuple[tuple[Frequency, ShareOfCritical], ...] = Field(
        default=(),
        description="The same as pairs; read from the table if one is given",
        json_schema_extra={"unit": ["Hz", "1"]},
    )
    alpha: DecayRate | None = Field(
        default=None, description="α of Rayleigh damping α M + β K [1/s], on the elastic coordinates alone"
    )
    beta: TimeFromZero | None = Field(default=None, description="β of Rayleigh damping α M + β K [s]")

    @model_validator(mode="after")
    def _one_form(self) -> "Damping":
        tabled, rayleigh = self.table is not None or bool(self.values), (self.alpha, self.beta) != (None, None)
        if sum([self.ratio is not None, self.ratios is not None, tabled, rayleigh]) != 1:
            raise ValueError("give one of: ratio, with or without frequency; ratios; table or values; alpha and beta")
        if self.frequency is not None and self.ratio is None:
            raise ValueError("frequency belongs to ratio")
        frequencies = np.array([row[0] for row in self.values])
        if (np.diff(frequencies) <= 0).any() or (self.values and len(frequencies) < 2):
            raise ValueError("values: at least two rows of rising frequencies are needed")
        return self

    @property
    def proportional(self) -> float | None:
        """β of damping that is proportional to the stiffness alone, C = β K [s]; None of other forms."""
        if self.frequency is not None and self.ratio is not None:
            return self.ratio / (3.141592653589793 * self.frequency)
        return None if self.alpha else self.beta

    def rates(self, omega: np.ndarray, body: str) -> np.ndarray:
        """Return c of elastic coordinates [1/s], (m,), with angular frequencies ω [rad/s], (m,).

        Raises:
            SceneError: a table or the list of ratios ends before the frequencies of the body.
        """
        if (beta := self.proportional) is not None:
            return beta * omega**2
        if self.alpha is not None:
            return self.alpha + (self.beta or 0.0) * omega**2
        return 2 * self._ratios(omega, body) * omega

    def stiffness_factor(self, omega: np.ndarray, body: str) -> float:
        """Return β of the residual flexibility [s]: that of the damping, or 2 ζ/ω at the highest kept frequency.

        Args:
            omega: Angular frequencies of the elastic coordinates [rad/s], (m,); without any, ratios give no β.
            body: For the message.

        Raises:
            SceneError: as `rates`.
        """
        if (beta := self.proportional) is not None:
            return beta
        if self.alpha is not None:
            return self.beta or 0.0
        if not len(omega):
            return 0.0
        highest = int(omega.argmax())
        return 2 * float(self._ratios(omega, body)[highest]) / float(omega[highest])

    def _ratios(self, omega: np.ndarray, body: str) -> np.ndarray:
        """Return the damping ratio of each coordinate, (m,)."""
        if self.ratio is not None:
            return np.full(len(omega), self.ratio)
        if self.ratios is not None:
            if len(self.ratios) < len(omega):
                raise SceneError(
                    f"body.{body}.damping.ratios: {len(self.ratios)} given, the body has {len(omega)} elastic"
                    " coordinates; one for each is needed"
                )
            in_order = np.zeros(len(omega))
            in_order[np.argsort(omega, kind="stable")] = self.ratios[: len(omega)]
            return in_order
        frequencies, ratios = np.array(self.values, float).T
        natural = omega / (2 * np.pi)
        if len(natural) and (natural.min() < frequencies[0] or natural.max() > frequencies[-1]):
            key = "values" if self.table is None else "table"
            raise SceneError(
                f"body.{body}.damping.{key}: reaches from {frequencies[0]:.6g} to {frequencies[-1]:.6g} Hz, the elastic"
                f" coordinates of the body from {natural.min():.6g} to {natural.max():.6g} Hz; extend the table"
            )
        return np.interp(natural, frequencies, ratios)
