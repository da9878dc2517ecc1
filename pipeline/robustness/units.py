"""Units of mass, length and time: what each number of a scene is measured in, and scenes in other units.

A scene in other units is the same scene: every number with a dimension times its factor, meshes included. What the
solver finds must then differ by round-off alone.
"""

import csv
import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.files import write_text

Model = TypeVar("Model", bound=BaseModel)
Dimension = tuple[float, float, float]
"""Exponents of mass, length and time."""

NUMBER: Dimension = (0, 0, 0)
LENGTH: Dimension = (0, 1, 0)
AREA: Dimension = (0, 2, 0)
FOURTH: Dimension = (0, 4, 0)
TIME: Dimension = (0, 0, 1)
RATE: Dimension = (0, 0, -1)
SPEED: Dimension = (0, 1, -1)
ACCELERATION: Dimension = (0, 1, -2)
MASS: Dimension = (1, 0, 0)
DENSITY: Dimension = (1, -3, 0)
INERTIA: Dimension = (1, 2, 0)
FORCE: Dimension = (1, 1, -2)
IMPULSE: Dimension = (1, 1, -1)
PRESSURE: Dimension = (1, -1, -2)
STIFFNESS: Dimension = (1, 0, -2)
DAMPING: Dimension = (1, 0, -1)
LAYER: Dimension = (1, -2, -2)


@dataclass(frozen=True)
class Units:
    """New units: a number with a dimension is multiplied by these to its exponents."""

    mass: float = 1.0
    length: float = 1.0
    time: float = 1.0

    def of(self, dimension: Dimension) -> float:
        """Return the factor of a dimension."""
        mass, length, time = dimension
        return self.mass**mass * self.length**length * self.time**time


def _law_stiffness(law: BaseModel) -> Dimension:
    """K of K dⁿ."""
    return (1, 1 - getattr(law, "exponent", 1.0), -2)


LAW: dict[str, Any] = {
    "stiffness": _law_stiffness, "radius": LENGTH, "modulus": PRESSURE, "exponent": NUMBER, "restitution": NUMBER,
}  # fmt: skip
FILE_UNIT = {"unit": LENGTH}
TABLE: dict[str, dict[str, Any]] = {
    "body.Body": {"position": LENGTH, "velocity": SPEED, "angular_velocity": RATE},
    "body.Damping": {"ratio": NUMBER, "frequency": RATE},
    "contact.Contact": {"surface_stiffness": LAYER, "restitution": NUMBER},
    "contact.Friction": {"static": NUMBER, "kinetic": NUMBER, "direction": NUMBER},
    "run.Run": {"duration": TIME, "step": TIME, "accuracy": NUMBER, "gravity": ACCELERATION},
    "bore.Bore": {"radius": LENGTH, "axis": NUMBER, "origin": LENGTH},
    "plane.Plane": {"point": LENGTH, "normal": NUMBER, "velocity": SPEED},
    "linear.Linear": {"stiffness": STIFFNESS, "damping": DAMPING},
    "hertz.Hertz": {key: LAW[key] for key in ("stiffness", "radius", "modulus", "exponent")},
    "hunt_crossley.HuntCrossley": LAW, "lankarani_nikravesh.LankaraniNikravesh": LAW,
    "flores.Flores": LAW, "hu_guo.HuGuo": LAW, "gonthier.Gonthier": LAW, "exact.Exact": LAW,
    "slider_crank.SliderCrank": {
        "crank_radius": LENGTH, "rod_length": LENGTH, "speed": RATE, "start": NUMBER, "centre": LENGTH,
        "along": NUMBER, "lateral": NUMBER,
    },
    "gas.GasPressure": {"values": (NUMBER, PRESSURE), "ambient": PRESSURE},
    "moving.MovingForce": {"force": FORCE, "at": LENGTH, "speed": SPEED, "rise": TIME},
    "spring.Spring": {
        "direction": NUMBER, "at": LENGTH, "stiffness": STIFFNESS, "damping": DAMPING, "stretch": LENGTH,
    },
    "skirt.Skirt": dict.fromkeys(("outer_radius", "wall", "height", "crown"), LENGTH),
    "piston.Piston": dict.fromkeys(
        ("outer_radius", "height", "crown", "skirt_height", "wall", "pin_radius", "pin_height", "pin_offset",
         "boss_radius", "boss_gap", "rib_width", "belt_relief", "relief_height"), LENGTH,
    ),
    "liner.Liner": dict.fromkeys(("bore_radius", "wall", "length", "flange_height", "flange_width"), LENGTH),
    "box.Box": dict.fromkeys(("lx", "ly", "lz", "patch"), LENGTH),
    "plate.Plate": dict.fromkeys(("lx", "ly", "thickness"), LENGTH),
    "sphere.Sphere": {"radius": LENGTH},
    "plane.Rectangle": dict.fromkeys(("thickness", "lx", "ly"), LENGTH),
    "plane_file.PlaneFile": {"thickness": LENGTH, "unit": LENGTH},
    "bar.Bar": {"length": LENGTH, "area": AREA},
    "beam.Beam": {"length": LENGTH, "stations": LENGTH},
    "section.Rectangle": {"width": LENGTH, "height": LENGTH, "shear_coefficient": NUMBER},
    "section.Circle": {"radius": LENGTH, "shear_coefficient": NUMBER},
    "section.IBeam": dict.fromkeys(("height", "width", "flange", "web"), LENGTH) | {"shear_coefficient": NUMBER},
    "section.General": {"area": AREA, "second_moment": FOURTH, "height": LENGTH, "shear_coefficient": NUMBER},
    "rigid.Rigid": {"mass": MASS, "inertia": INERTIA},
    "rigid.RigidPoint": {"at": LENGTH, "normal": NUMBER, "area": AREA},
    "bladed_sector.BladedSector": dict.fromkeys(
        ("bore_radius", "hub_radius", "hub_width", "web", "rim_radius", "rim_height", "rim_width", "tip_radius",
         "chord", "blade_thickness"), LENGTH,
    ) | {"stagger_deg": NUMBER},
    "mesh_file.MeshFile": FILE_UNIT,
    "mesh_file.CylinderShape": {"radius": LENGTH, "axis": NUMBER, "origin": LENGTH},
    "mesh_file.PlaneShape": {"normal": NUMBER, "origin": LENGTH},
    "material.Material": {"E": PRESSURE, "nu": NUMBER, "rho": DENSITY},
    "component.MeshSettings": {"size": LENGTH},
    "component.Profile": {"scale": NUMBER, "offset": LENGTH},
    "interface.Interface": {
        "sector_deg": NUMBER, "height": LENGTH, "spacing": LENGTH, "along": NUMBER, "extent": LENGTH, "point": LENGTH,
    },
    "gauge.Gauge": {"point": LENGTH},
    "scene.Wheel": {"axis": NUMBER, "origin": LENGTH, "blade_radius": LENGTH},
    "scene.Mistuning": {"values": NUMBER, "deviation": NUMBER},
    "scene.Response": {"direction": NUMBER, "loss_factor": NUMBER, "band": RATE},
}  # fmt: skip
"""Dimension of every number of a scene by the model that has it, `module.Class`; a pair where entries differ."""

KEPT = ("report", "plot", "stress")
"""Parts of a scene that no run depends on: they stay as they are."""
SHAPE: dict[str, Dimension] = {"radius": LENGTH, "origin": LENGTH, "area": AREA, "thickness": LENGTH}
"""Of a true surface."""
PLAIN = ("kind", "axis", "normal", "along", "across")


def dimensions_of(model: type[BaseModel]) -> Mapping[str, Any]:
    """Return the dimensions of a model's own numbers; empty where none is declared."""
    return TABLE.get(f"{model.__module__.rpartition('.')[2]}.{model.__name__}", {})


def rescaled(model: Model, units: Units) -> Model:
    """Return a model with every number in new units. Nothing is validated again: limits of input are in SI.

    Raises:
        StageError: a number has no declared dimension.
    """
    declared, changes = dimensions_of(type(model)), {}
    for name in type(model).model_fields:
        value = getattr(model, name)
        if name in KEPT and name not in declared:
            continue
        dimension = declared.get(name)
        if isinstance(dimension, Callable):
            dimension = dimension(model)
        changed = _changed(value, dimension, units, f"{type(model).__name__}.{name}")
        if changed is not value:
            changes[name] = changed
    return model.model_copy(update=changes)


def _changed(value: Any, dimension: Any, units: Units, where: str) -> Any:
    if isinstance(value, BaseModel):
        return rescaled(value, units)
    if isinstance(value, Mapping):
        return {key: _changed(one, dimension, units, where) for key, one in value.items()}
    if isinstance(value, tuple):
        if dimension is not None and isinstance(dimension[0], tuple):
            return tuple(
                tuple(_changed(x, d, units, where) for x, d in zip(one, dimension, strict=True)) for one in value
            )
        return tuple(_changed(one, dimension, units, where) for one in value)
    if not isinstance(value, float):
        return value
    if dimension is None:
        raise StageError(f"{where}: its dimension is not declared, so it cannot be put into other units")
    return value * units.of(dimension)


def rescaled_mesh(mesh: MeshRecord, units: Units) -> MeshRecord:
    """Return the same mesh in another unit of length.

    Raises:
        StageError: a true surface has a number whose dimension is not declared.
    """
    surfaces = {name: Surface(one.facets, _shape(name, one.shape, units)) for name, one in mesh.surfaces.items()}
    return replace(mesh, nodes=mesh.nodes * units.length, surfaces=surfaces)


def _shape(surface: str, shape: Mapping[str, Any], units: Units) -> dict[str, Any]:
    found = {}
    for key, value in shape.items():
        if key not in SHAPE and key not in PLAIN:
            raise StageError(f"surface {surface}: the dimension of its '{key}' is not declared")
        array = np.asarray(value, float) * units.of(SHAPE[key]) if key in SHAPE else None
        found[key] = value if array is None else array.tolist()
    return found


def rescaled_profile(source: Path, target: Path, units: Units) -> None:
    """Write a profile table with heights and deviations in another unit of length."""
    with source.open(newline="", encoding="utf-8") as file:
        head, *rows = [row for row in csv.reader(file) if any(cell.strip() for cell in row)]
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(head)
    writer.writerows([repr(float(cell) * units.length) for cell in row] for row in rows)
    write_text(target, text.getvalue())
