"""The `material` table of a component."""

from pydantic import Field, model_validator

from gudgeon.pipeline.geometry.numbers import Positive, Strict

WAVE_SPEEDS = (0.5, 1e6)
"""Limits of √(E/ρ) [m/s]: soft gels have 1, diamond has 2e4; a modulus in GPa or a density in t/mm³ is outside."""


class Material(Strict):
    """Isotropic linear elasticity."""

    E: Positive = Field(description="Young's modulus [Pa]", json_schema_extra={"unit": "Pa"})
    nu: float = Field(gt=-1, lt=0.5, description="Poisson's ratio", json_schema_extra={"unit": "1"})
    rho: Positive = Field(description="Density [kg/m^3]", json_schema_extra={"unit": "kg/m^3"})

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's constants λ and μ [Pa]."""
        return self.E * self.nu / (1 + self.nu) / (1 - 2 * self.nu), self.E / 2 / (1 + self.nu)

    @model_validator(mode="after")
    def _units_agree(self) -> "Material":
        speed, (low, high) = (self.E / self.rho) ** 0.5, WAVE_SPEEDS
        if not low <= speed <= high:
            raise ValueError(
                f"E = {self.E:g} Pa and rho = {self.rho:g} kg/m^3 give a wave speed √(E/rho) of {speed:.3g} m/s,"
                f" allowed: {low:g} to {high:g}; check that the units are SI"
            )
        return self
