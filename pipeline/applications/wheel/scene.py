"""The scene file of a wheel: sector, mistuning, kept interface, response, and the choices that a report compares."""

from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.numbers import NonZero
from gudgeon.pipeline.geometry.symmetry import CyclicSymmetry
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.reading import find_file
from gudgeon.pipeline.scenes.robustness import Robustness
from gudgeon.solver.numbers import MOST, Frequency, Length, Name, PositiveRatio, Ratio, Strict


class Mistuning(Strict):
    """Relative changes of the blades' stiffness: as numbers, from a file, or random."""

    values: tuple[Ratio, ...] = Field(default=(), description="Relative change of each blade's stiffness")
    table: str | None = Field(default=None, description="CSV file with the change of each blade, in the scene's folder")
    deviation: PositiveRatio | None = Field(
        default=None, description="Standard deviation of normally distributed changes"
    )
    seed: int = Field(default=0, ge=0, le=MOST, description="Seed of the random numbers, with deviation")

    @model_validator(mode="after")
    def _one_source(self) -> "Mistuning":
        sources = [name for name in ("values", "table", "deviation") if name in self.model_fields_set]
        if len(sources) != 1:
            raise ValueError(f"{' and '.join(sources) or 'none'} given; one of values, table and deviation is needed")
        return self

    def changes(self, sectors: int, folder: Path, owner: str) -> tuple[float, ...]:
        """Return the relative change of each blade's stiffness, (N,); `owner` is the key in the scene, for messages.

        Raises:
            InputError: the number of changes is wrong, one leaves no stiffness, or the file has more than numbers.
        """
        if self.deviation is not None:
            values = self.deviation * np.random.default_rng(self.seed).standard_normal(sectors)
            key = "deviation"
        elif self.table is not None:
            values, key = _numbers(find_file(self.table, folder, f"{owner}.table"), f"{owner}.table"), "table"
        else:
            values, key = np.array(self.values), "values"
        if len(values) != sectors:
            raise InputError(f"{owner}.{key}: {len(values)} given; the wheel has {sectors} blades")
        if not values.min() > -1:
            raise InputError(f"{owner}.{key}: {values.min():.6g} given; the change of a blade must be above -1")
        return tuple(values.tolist())


STEP_SHARE = 0.4
"""Step of the excitation's frequencies over the width of a peak. The largest sample of a peak is then at least
1 / (1 + 0.4²)^½ of it, an error of at most 8 %, which decreases with the square of the step."""


class KeptInterface(Strict):
    """Dofs between sectors that are kept, and the number of interface modes that replace the others (Tran 2009)."""

    kept: Literal["all"] | tuple[str, ...] = Field(
        default=(), description="Surfaces whose dofs on the low face are kept; 'all' is Craig-Bampton"
    )
    interface_count: int | None = Field(
        default=None, ge=0, le=MOST, description="Elastic interface modes per sector for the other dofs; default: all"
    )

    @model_validator(mode="after")
    def _consistent(self) -> "KeptInterface":
        if self.kept == "all" and self.interface_count:
            raise ValueError(f"interface_count {self.interface_count} given; kept = 'all' leaves no dofs for them")
        return self


class Response(Strict):
    """Excitation of the blades: unit forces e^{2πi r j/N} on blade j along one direction."""

    surface: str = Field(default="tip", description="Surface of the blade on which the force is uniform")
    direction: NonZero = Field(default=(0.0, 0.0, 1.0), description="Direction of the force, any length")
    engine_order: int = Field(ge=0, le=MOST, description="r, below the number of sectors")
    loss_factor: PositiveRatio = Field(default=2e-3, description="η of structural damping, K (1 + iη)")
    band: tuple[Frequency, Frequency] = Field(description="Lowest and highest frequency of the force [Hz]")
    points: int = Field(default=2001, ge=3, le=1_000_000, description="Number of frequencies in the band")

    @field_validator("band")
    @classmethod
    def _rises(cls, value: tuple[float, float]) -> tuple[float, float]:
        if not value[0] < value[1]:
            raise ValueError(f"{list(value)} given; the first must be below the second")
        return value

    @model_validator(mode="after")
    def _sees_its_peaks(self) -> "Response":
        low, high = self.band
        width = self.loss_factor * low
        needed = int(np.ceil((high - low) / (STEP_SHARE * width))) + 1
        if self.points < needed:
            raise ValueError(
                f"points {self.points} given over {high - low:g} Hz; a peak at {low:g} Hz has a width of loss_factor ·"
                f" frequency = {width:.3g} Hz, which needs at least {needed} points"
            )
        return self

    @property
    def excitation(self) -> np.ndarray:
        """Angular frequencies of the force [rad/s], (points,)."""
        return 2 * np.pi * np.linspace(*self.band, self.points)


class Wheel(CyclicSymmetry):
    """Equal sectors about an axis, whose blades differ in stiffness."""

    component: str = Field(description="Component that is the sector")
    mode_count: int = Field(default=10, ge=1, le=MOST, description="Elastic modes of each harmonic")
    count: int = Field(
        default=60, ge=1, le=MOST, description="Lowest elastic modes of the whole wheel, for its response"
    )
    blade_radius: Length | None = Field(
        default=None,
        description="Distance from the axis beyond which cells belong to the blade [m]; default: the geometry's",
    )
    mistuning: Mistuning
    fixed_count: int = Field(default=20, ge=0, le=MOST, description="Number of modes of a sector with both faces held")
    interface: KeptInterface = Field(
        default=KeptInterface.model_construct(), description="Kept interface in the solve stage"
    )
    response: Response


class WheelReport(Strict):
    """Choices of kept interface to compare with the full wheel."""

    choices: dict[str, KeptInterface] = Field(default={}, description="Name → choice; default: the wheel's own")


class WheelFile(Strict):
    """A whole scene file of a wheel."""

    component: dict[Name, Component] = Field(description="Parts, by name")
    wheel: dict[Name, Wheel] = Field(min_length=1, max_length=1, description="The wheel, by name")
    report: WheelReport = WheelReport.model_construct()
    robustness: Robustness = Robustness.model_construct()

    @property
    def only(self) -> tuple[str, Wheel]:
        """The wheel and its name."""
        return next(iter(self.wheel.items()))


READ = ("geometry", "material", "mesh", "supports")
"""Keys of a component that a wheel reads."""


def wrong_names(scene: WheelFile) -> list[str]:
    """List contradictions of the scene, one line each; surfaces of mesh files are unknown before meshing."""
    name, wheel = scene.only
    table, sectors, order = f"wheel.{name}", wheel.sectors, wheel.response.engine_order
    if wheel.component not in scene.component:
        return [f"{table}.component: no component '{wheel.component}'; the scene has {', '.join(scene.component)}"]
    component = scene.component[wheel.component]
    lines = [
        f"component.{wheel.component}.{key}: given; a wheel reads geometry, material, mesh and supports only"
        for key in type(component).model_fields
        if key in component.model_fields_set and key not in READ
    ]
    made = getattr(component.geometry, "sectors", sectors)
    if made != sectors:
        lines.append(f"{table}.sectors: {sectors} given; the geometry is one of {made} sectors")
    if order >= sectors:
        lines.append(f"{table}.response.engine_order: {order} given; allowed with {sectors} blades: 0 to {sectors - 1}")
    if blade_radius(wheel, component) is None:
        lines.append(f"{table}.blade_radius: is missing; geometry '{component.geometry.kind}' has no default for it")
    shapes = getattr(component.geometry, "surface_shapes", None)
    have = None if shapes is None else sorted(shapes())
    for key, surface in _surfaces(scene, table, wheel):
        if have is not None and surface not in have:
            lines.append(f"{key}: the geometry has no surface '{surface}'; it has {', '.join(have)}")
    return lines


def blade_radius(wheel: Wheel, component: Component) -> float | None:
    """Return the distance from the axis beyond which cells belong to the blade [m]; None if it is unknown."""
    return getattr(component.geometry, "blade_radius", None) if wheel.blade_radius is None else wheel.blade_radius


def reduction(wheel: Wheel, interface: KeptInterface) -> dict[str, Any]:
    """Return the settings of a wheel's reduction by a choice of kept interface, as JSON."""
    return interface.model_dump(mode="json") | {"fixed_count": wheel.fixed_count}


def _surfaces(scene: WheelFile, table: str, wheel: Wheel) -> list[tuple[str, str]]:
    """Return every surface that a wheel names, with the key that names it."""
    named = [(f"{table}.low", wheel.low), (f"{table}.high", wheel.high)]
    named += [(f"{table}.response.surface", wheel.response.surface)]
    choices = {f"{table}.interface": wheel.interface}
    choices |= {f"report.choices.{key}": choice for key, choice in scene.report.choices.items()}
    return named + [(f"{key}.kept", s) for key, choice in choices.items() if choice.kept != "all" for s in choice.kept]


def _numbers(path: Path, key: str) -> np.ndarray:
    """Return the numbers of a text file, separated by commas, semicolons or white space."""
    try:
        text = path.read_text(encoding="utf-8")
        return np.array([float(word) for word in text.replace(",", " ").replace(";", " ").split()])
    except (OSError, ValueError) as error:
        raise InputError(f"{key}: {path} is not a file of numbers ({error})") from error
