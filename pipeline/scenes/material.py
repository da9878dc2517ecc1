"""The `material` table of a component."""

from pydantic import Field, model_validator

from gudgeon.solver.numbers import Density, Modulus, Poisson, Strict

WAVE_SPEEDS = (0.5, 1e6)
"""Limits of √(E/ρ) [m/s]: soft gels have 1, diamond has 2e4; a modulus in GPa or a density in t/mm³ is outside."""
USUAL = {"speed": (100.0, 20_000.0), "E": (1e5, 2e12), "rho": (10.0, 25_000.0)}
"""√(E/ρ) [m/s], E [Pa] and ρ [kg/m^3] of solids, foams and rubber among them, outside which a note is given: a modulus
in MPa or a density in g/cm³ is outside, or both are."""
LIKELY = {"speed": (1000.0, 13_000.0), "E": (1e8, 1.3e12), "rho": (100.0, 23_000.0)}
"""The same from plastics to diamond and osmium: other units that lead there are the likely mistake."""
MISTAKEN_E = {"": 1.0, "E in MPa": 1e6, "E in GPa": 1e9}
"""Units in which E may be given by mistake [Pa], the most frequent first."""
MISTAKEN_RHO = {
    "": 1.0, "rho in g/cm^3": 1e3, "rho in g/mm^3": 1e6, "rho in kg/mm^3": 1e9, "rho in t/mm^3": 1e12
}  # fmt: skip
"""Units in which ρ may be given by mistake [kg/m^3], the most frequent first."""


class Material(Strict):
    """Isotropic linear elasticity."""

    E: Modulus = Field(description="Young's modulus [Pa]")
    nu: Poisson = Field(description="Poisson's ratio")
    rho: Density = Field(description="Density [kg/m^3]")

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's constants λ and μ [Pa]."""
        return self.E * self.nu / (1 + self.nu) / (1 - 2 * self.nu), self.E / 2 / (1 + self.nu)

    @property
    def wave_speed(self) -> float:
        """√(E/ρ) [m/s], the speed of longitudinal waves in a bar."""
        return (self.E / self.rho) ** 0.5

    def unit_note(self) -> str | None:
        """Return a line if values are unusual, with the units that were probably given; None if all are usual."""
        text = f"E = {self.E:g} Pa and rho = {self.rho:g} kg/m^3"
        if not _between(self.wave_speed, USUAL["speed"]):
            text += f" give a wave speed √(E/rho) of {self.wave_speed:.3g} m/s, usual are {_range('speed')} m/s"
        elif not (_between(self.E, USUAL["E"]) and _between(self.rho, USUAL["rho"])):
            text += f"; usual are {_range('E')} Pa and {_range('rho')} kg/m^3"
        else:
            return None
        return f"{text}; {self._mistake() or 'check both units'}"

    def _mistake(self) -> str | None:
        """Return the units that were probably given, one other unit before two; None if there are none."""
        pairs = [(e, rho) for e in MISTAKEN_E.items() for rho in MISTAKEN_RHO.items()]
        for (one, e), (other, r) in sorted(pairs, key=lambda pair: bool(pair[0][0]) + bool(pair[1][0])):
            E, rho, names = self.E * e, self.rho * r, [name for name in (one, other) if name]
            values = {"speed": (E / rho) ** 0.5, "E": E, "rho": rho}
            if names and all(_between(values[key], limits) for key, limits in LIKELY.items()):
                return f"probably {' and '.join(names)} {'was' if len(names) == 1 else 'were'} given"
        return None

    @model_validator(mode="after")
    def _units_agree(self) -> "Material":
        speed, (low, high) = self.wave_speed, WAVE_SPEEDS
        if not _between(speed, WAVE_SPEEDS):
            raise ValueError(
                f"E = {self.E:g} Pa and rho = {self.rho:g} kg/m^3 give a wave speed √(E/rho) of {speed:.3g} m/s,"
                f" allowed: {low:g} to {high:g}; {self._mistake() or 'check that the units are SI'}"
            )
        return self


def _between(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]


def _range(name: str) -> str:
    return "{:g} to {:g}".format(*USUAL[name])
