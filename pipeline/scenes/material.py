"""The `material` table of a component: isotropic, orthotropic, and one for each volume of a solid."""

from typing import Any

import numpy as np
from pydantic import ConfigDict, Field, ValidationError, ValidationInfo, field_validator, model_validator

from gudgeon.pipeline.scenes.modes import optional
from gudgeon.solver.numbers import Density, Modulus, Name, Poisson, Ratio, Strict
from gudgeon.solver.vectors import Vector

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
ACROSS = 1e-6
"""Largest cosine between two axes."""
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Directions of the components 11, 22, 33, 12, 13, 23."""
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


class Orthotropic(Strict):
    """Orthotropic linear elasticity; directions 1, 2, 3 are right-handed."""

    E: tuple[Modulus, Modulus, Modulus] = Field(description="Young's moduli along 1, 2, 3 [Pa]")
    nu: tuple[Ratio, Ratio, Ratio] = Field(
        description="Poisson's ratios 12, 13, 23: ν_ij is the contraction along j over the extension along i under"
        " tension along i"
    )
    G: tuple[Modulus, Modulus, Modulus] = Field(description="Shear moduli 12, 13, 23 [Pa]")
    axes: tuple[Vector, Vector] = Field(
        default=(X, Y), description="Directions 1 and 2 in the component's axes, of any length, at a right angle"
    )

    @property
    def tensor(self) -> np.ndarray:
        """Elastic constants C_ijkl in the component's axes [Pa], (3, 3, 3, 3)."""
        inner = np.linalg.inv(self._compliance())
        C = np.zeros((3, 3, 3, 3))
        for row, (i, j) in enumerate(PAIRS):
            for column, (k, l) in enumerate(PAIRS):
                value = inner[row, column]
                for a, b in {(i, j), (j, i)}:
                    for c, d in {(k, l), (l, k)}:
                        C[a, b, c, d] = value
        e1, two = (np.array(axis) / np.linalg.norm(axis) for axis in self.axes)
        Q = np.stack([e1, two, np.cross(e1, two)], axis=1)
        return np.einsum("ia,jb,kc,ld,abcd->ijkl", Q, Q, Q, Q, C, optimize=True)

    @property
    def isotropic(self) -> tuple[float, float]:
        """Young's modulus [Pa] and Poisson's ratio of Voigt's average over all directions."""
        C = self.tensor
        bulk, shear = np.einsum("iikk->", C), np.einsum("ikik->", C)
        K, mu = bulk / 9, (3 * shear - bulk) / 30
        return float(9 * K * mu / (3 * K + mu)), float((3 * K - 2 * mu) / (2 * (3 * K + mu)))

    def _compliance(self) -> np.ndarray:
        """Return the compliance of the components 11, 22, 33 and of engineering shears 12, 13, 23 [1/Pa], (6, 6)."""
        (E1, two, three), (n12, n13, n23) = self.E, self.nu
        S = np.diag([1 / E1, 1 / two, 1 / three, *(1 / G for G in self.G)])
        S[0, 1] = S[1, 0] = -n12 / E1
        S[0, 2] = S[2, 0] = -n13 / E1
        S[1, 2] = S[2, 1] = -n23 / two
        return S

    @model_validator(mode="after")
    def _sound(self) -> "Orthotropic":
        lengths = [float(np.linalg.norm(axis)) for axis in self.axes]
        if min(lengths) == 0 or abs(np.dot(*self.axes)) > ACROSS * lengths[0] * lengths[1]:
            raise ValueError(
                f"axes are {[list(axis) for axis in self.axes]}; two directions at a right angle are needed"
            )
        S = self._compliance()
        scale = 1 / np.sqrt(S.diagonal())
        if np.linalg.eigvalsh(S * np.outer(scale, scale))[0] < ACROSS:
            raise ValueError(
                f"nu is {list(self.nu)}; with these E the strain energy is not positive: ν_ij² < E_i/E_j is needed for"
                " each pair, and 1 − ν12² E2/E1 − ν23² E3/E2 − ν13² E3/E1 − 2 ν12 ν23 ν13 E3/E1 above zero"
            )
        return self


class Material(Strict):
    """Linear elasticity: isotropic, or orthotropic; of a solid of several volumes one for each, if they differ."""

    model_config = ConfigDict(
        json_schema_extra={
            "required": ["rho"],
            "anyOf": [{"required": ["E", "nu"]}, {"required": ["orthotropic"]}],
        }
    )

    E: Modulus = Field(description="Young's modulus [Pa]; not with orthotropic")
    nu: Poisson = Field(description="Poisson's ratio; not with orthotropic")
    rho: Density = Field(description="Density [kg/m^3]")
    orthotropic: Orthotropic | None = optional("Orthotropic constants, instead of E and nu; for solids")
    volumes: dict[Name, "Material"] = optional(
        "Materials of named volumes of a CAD part or a mesh file; the rest has the constants above", default={}
    )

    @model_validator(mode="before")
    @classmethod
    def _averaged(cls, values: Any) -> Any:
        """Give an orthotropic material the E and nu of its average, by which units and steps are judged."""
        if not isinstance(values, dict) or values.get("orthotropic") is None:
            return values
        try:
            E, nu = Orthotropic.model_validate(values["orthotropic"]).isotropic
        except ValidationError:
            return {"E": 1.0, "nu": 0.0, **values}  # The field itself says what is wrong.
        for key, average in (("E", E), ("nu", nu)):
            if key in values and values[key] != average:
                raise ValueError(f"{key} given with orthotropic, which has its own constants; remove one of them")
        return {**values, "E": E, "nu": nu}

    @field_validator("volumes")
    @classmethod
    def _flat(cls, value: dict[str, "Material"], info: ValidationInfo) -> dict[str, "Material"]:
        for name, material in value.items():
            if material.volumes:
                raise ValueError(f"{name}: volumes given within a volume; allowed: one level")
        return value

    @property
    def simple(self) -> bool:
        """Whether it is isotropic and the same everywhere."""
        return self.orthotropic is None and not self.volumes

    @property
    def contrast(self) -> float:
        """The largest ratio of two of its moduli."""
        moduli = [self.E, *(m.E for m in self.volumes.values())]
        return max(moduli) / min(moduli)

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
        for (unit_E, e), (unit_rho, r) in sorted(pairs, key=lambda pair: bool(pair[0][0]) + bool(pair[1][0])):
            E, rho, names = self.E * e, self.rho * r, [name for name in (unit_E, unit_rho) if name]
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
