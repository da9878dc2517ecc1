"""The `material` table of a component."""

from pydantic import Field, model_validator

from gudgeon.pipeline.geometry.numbers import Positive, Strict

WAVE_SPEEDS = (0.5, 1e6)
"""Limits of √(E/ρ) [m/s]: soft gels have 1, diamond has 2e4; a modulus in GPa or a density in t/mm³ is outside."""
USUAL_SPEEDS = (100.0, 20_000.0)
"""√(E/ρ) [m/s] of stiff solids, outside which a note is given: a modulus in MPa or a density in g/cm³ is outside."""
SOLID_SPEEDS = (1000.0, 13_000.0)
"""√(E/ρ) [m/s] from plastics to beryllium: another unit that leads there is the likely mistake."""
UNITS = {"E in MPa": 1e6, "E in GPa": 1e9, "rho in g/cm^3": 1e-3, "rho in t/mm^3": 1e-12}
"""Mistaken units, and the factor on E/ρ that corrects each."""


class Material(Strict):
    """Isotropic linear elasticity."""

    E: Positive = Field(description="Young's modulus [Pa]", json_schema_extra={"unit": "Pa"})
    nu: float = Field(gt=-1, lt=0.5, description="Poisson's ratio", json_schema_extra={"unit": "1"})
    rho: Positive = Field(description="Density [kg/m^3]", json_schema_extra={"unit": "kg/m^3"})

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's constants λ and μ [Pa]."""
        return self.E * self.nu / (1 + self.nu) / (1 - 2 * self.nu), self.E / 2 / (1 + self.nu)

    @property
    def wave_speed(self) -> float:
        """√(E/ρ) [m/s], the speed of longitudinal waves in a bar."""
        return (self.E / self.rho) ** 0.5

    def unit_note(self) -> str | None:
        """Return a line if the wave speed is unusual, with the unit that was probably given; None if it is usual."""
        speed, (low, high) = self.wave_speed, USUAL_SPEEDS
        if _between(speed, USUAL_SPEEDS):
            return None
        likely = [unit for unit, factor in UNITS.items() if _between(speed * factor**0.5, SOLID_SPEEDS)]
        return (
            f"E = {self.E:g} Pa and rho = {self.rho:g} kg/m^3 give a wave speed √(E/rho) of {speed:.3g} m/s, usual are"
            f" {low:g} to {high:g} m/s; " + (f"probably {likely[0]} was given" if likely else "check both units")
        )

    @model_validator(mode="after")
    def _units_agree(self) -> "Material":
        speed, (low, high) = self.wave_speed, WAVE_SPEEDS
        if not _between(speed, WAVE_SPEEDS):
            raise ValueError(
                f"E = {self.E:g} Pa and rho = {self.rho:g} kg/m^3 give a wave speed √(E/rho) of {speed:.3g} m/s,"
                f" allowed: {low:g} to {high:g}; check that the units are SI"
            )
        return self


def _between(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]
