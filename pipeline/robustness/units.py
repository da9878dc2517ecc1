"""Units of the numbers of a scene, and scenes in other units of mass, length and time.

Every number with a dimension is multiplied by a factor, in meshes as well; the result must then differ by round-off
only.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar, get_args

import numpy as np
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from gudgeon.modaldb.records.field import PoseGridRecord
from gudgeon.modaldb.records.mesh import MeshRecord, SystemMatrices, Triangle
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.geometry.profile import read_rows
from gudgeon.solver.forces.expression import in_units
from gudgeon.solver.joints.coupled import Driven

Model = TypeVar("Model", bound=BaseModel)
Dimension = tuple[float, float, float]
"""Exponents of mass, length and time. Charges keep their number: a volt is a joule per coulomb."""

SYMBOLS: dict[str, Dimension] = {
    "1": (0, 0, 0), "deg": (0, 0, 0), "rad": (0, 0, 0), "rev": (0, 0, 0), "kg": (1, 0, 0), "m": (0, 1, 0),
    "s": (0, 0, 1), "min": (0, 0, 1), "Hz": (0, 0, -1), "N": (1, 1, -2), "Pa": (1, -1, -2),
    "h": (0, 0, 0), "C": (0, 0, 0), "V": (1, 2, -2), "F": (-1, -2, 2),
}  # fmt: skip
KEPT = ("report", "plot", "robustness", "sensor")
"""Parts of a scene that no run depends on; they are not changed."""
SHAPE = {"radius": "m", "origin": "m", "area": "m^2", "thickness": "m"}
"""Units of the numbers of a true surface."""
PLAIN = ("kind", "axis", "normal", "along", "across")


def dimension(unit: str, model: BaseModel | None = None) -> Dimension:
    """Return the dimension of a unit such as `kg/m^3`, `N s/m` or `N/m^exponent`.

    Symbols are separated by blanks, and those after a slash divide; an exponent is a number or a key of `model`. Of
    `rad or m` the `motion` of the model says which, an angle if it does not.
    """
    angle, _, displacement = unit.partition(" or ")
    unit = displacement if displacement and getattr(model, "motion", None) == "displacement" else angle
    exponents = (0.0, 0.0, 0.0)
    for sign, product in zip((1, -1), unit.split("/"), strict=False):
        for factor in product.split():
            symbol, _, power = factor.partition("^")
            times = sign * (getattr(model, power) if power.isalpha() else float(power or 1))
            mass, length, time = (a + times * b for a, b in zip(exponents, SYMBOLS[symbol], strict=True))
            exponents = mass, length, time
    return exponents


@dataclass(frozen=True)
class Units:
    """Factors on numbers of mass, length and time in new units."""

    mass: float = 1.0
    length: float = 1.0
    time: float = 1.0

    def of(self, unit: str, model: BaseModel | None = None) -> float:
        """Return the factor on numbers of a unit; see `dimension`."""
        mass, length, time = dimension(unit, model)
        return self.mass**mass * self.length**length * self.time**time


def declared_units(model: type[BaseModel]) -> dict[str, str | list[str]]:
    """Return the units that a model's own numbers declare by key; a list of units if the entries of rows differ."""
    units = {name: _unit(field) for name, field in model.model_fields.items()}
    return {name: unit for name, unit in units.items() if unit is not None}


def _unit(field: FieldInfo) -> Any:
    """Return the unit of a field, declared by itself or within its annotation."""
    extra = field.json_schema_extra
    return extra["unit"] if isinstance(extra, dict) and "unit" in extra else _unit_within(field.annotation)


def _unit_within(annotation: Any) -> Any:
    declared = [item for item in getattr(annotation, "__metadata__", ()) if isinstance(item, FieldInfo)]
    units = [_unit(item) for item in declared] + [_unit_within(item) for item in get_args(annotation)]
    return next((unit for unit in units if unit is not None), None)


def with_values(model: Model, changes: Mapping[str, Any]) -> Model:
    """Return a model with other values, not validated again; keys that its file leaves out stay left out."""
    changed = model.model_copy(update=dict(changes))
    changed.__pydantic_fields_set__ = set(model.model_fields_set)
    return changed


def with_motions(joints: Mapping[str, Any]) -> dict[str, Any]:
    """Return joints whose drives say whether they give an angle or a displacement."""
    return {
        name: with_values(joint, {"motion": joint.given(joints.get(joint.joint))})
        if isinstance(joint, Driven)
        else joint
        for name, joint in joints.items()
    }


def rescaled(model: Model, units: Units) -> Model:
    """Return a model with every number in new units, not validated again since limits of input are in SI.

    Raises:
        StageError: a number declares no unit.
    """
    declared, changes = declared_units(type(model)), {}
    for name in type(model).model_fields:
        value, unit = getattr(model, name), declared.get(name)
        value = with_motions(value) if name == "joint" and isinstance(value, Mapping) else value
        if name in KEPT and unit is None:
            continue
        factors = [units.of(symbol, model) for symbol in ([unit] if isinstance(unit, str) else unit or ())]
        changed = _changed(value, factors, units, f"{type(model).__name__}.{name}")
        if changed is not value:
            changes[name] = changed
    return with_values(model, changes)


def _changed(value: Any, factors: list[float], units: Units, key_path: str) -> Any:
    if isinstance(value, BaseModel):
        return rescaled(value, units)
    if isinstance(value, Mapping):
        return {key: _changed(item, factors, units, key_path) for key, item in value.items()}
    if isinstance(value, str) and factors:
        return in_units(value, *factors)
    if isinstance(value, tuple):
        if len(factors) > 1:
            return tuple(tuple(x * f for x, f in zip(row, factors, strict=True)) for row in value)
        return tuple(_changed(item, factors, units, key_path) for item in value)
    if not isinstance(value, float):
        return value
    if not factors:
        raise StageError(f"{key_path}: no unit is declared, so it cannot be written in other units")
    return value * factors[0]


def rescaled_mesh(mesh: MeshRecord, units: Units) -> MeshRecord:
    """Return the same mesh in other units.

    Raises:
        StageError: a true surface has a number without a declared unit.
    """
    surfaces = {
        name: replace(
            surface,
            shape=_shape(name, surface.shape, units),
            areas=None if surface.areas is None else surface.areas * units.length**2,
        )
        for name, surface in mesh.surfaces.items()
    }
    system = None if mesh.system is None else _rescaled_system(mesh.system, units)
    attachments = {
        name: replace(
            item, point=item.point * units.length, mass=item.mass * units.of("kg"),
            inertia=None if item.inertia is None else item.inertia * units.of("kg m^2"),
        )
        for name, item in mesh.attachments.items()
    }  # fmt: skip
    relations = {
        name: replace(item, stiffness=item.stiffness * units.of("N/m")) for name, item in mesh.relations.items()
    }
    return replace(
        mesh, nodes=mesh.nodes * units.length, surfaces=surfaces, system=system, attachments=attachments,
        relations=relations,
    )  # fmt: skip


def rescaled_grid(grid: PoseGridRecord, units: Units) -> PoseGridRecord:
    """Return the capacitances of a grid of poses in other units; charges keep their number."""
    axes = {name: values * (units.length if name in "xyz" else 1.0) for name, values in grid.axes.items()}
    moved = {**grid.moved, "pivot": (np.asarray(grid.moved["pivot"], float) * units.length).tolist()}
    return replace(
        grid, axes=axes, moved=moved, capacitance=grid.capacitance * units.of("F"),
        panel_error=grid.panel_error * units.of("F"), potentials=grid.potentials * units.of("V"),
    )  # fmt: skip


def _rescaled_system(system: SystemMatrices, units: Units) -> SystemMatrices:
    """Return matrices in other units; an entry of a rotation has one length more for each."""
    lengths = np.where(system.directions > 2, units.length, 1.0)

    def scaled(half: Triangle, factor: float) -> Triangle:
        return replace(half, values=half.values * factor * lengths[half.rows] * lengths[half.columns])

    return replace(
        system, stiffness=scaled(system.stiffness, units.of("N/m")), mass=scaled(system.mass, units.of("kg"))
    )


def _shape(surface: str, shape: Mapping[str, Any], units: Units) -> dict[str, Any]:
    if unknown := [key for key in shape if key not in SHAPE and key not in PLAIN]:
        raise StageError(f"surface {surface}: no unit is declared for '{unknown[0]}'")
    scaled = {key: (np.asarray(shape[key], float) * units.of(SHAPE[key])).tolist() for key in shape if key in SHAPE}
    return {**shape, **scaled}


def rescaled_profile(source: Path, target: Path, units: Units) -> None:
    """Write a profile table with heights and deviations in another unit of length."""
    head, *rows = read_rows(source, "profile table")
    write_text(target, csv_text([head, *([repr(float(cell) * units.length) for cell in row] for row in rows)]))
