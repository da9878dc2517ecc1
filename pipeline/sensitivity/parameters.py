"""Keys of a scene as parameters: their values, units and steps, and the keys that are taken by default."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import nested
from gudgeon.pipeline.scenes.reference.units import unit_at
from gudgeon.pipeline.stages.job import Job

STEP = 1e-3
"""Step of differences of arrays over the value of a key: that of fourth order has an error of 1e-12."""
SHORT_STEP = 3e-6
"""The same of lengths, by which gaps change, small differences of places, and of components, with linear records."""
LEAST = 1e-6
"""Step of a key whose value is zero, in its unit."""
TIMES = ("run",)
"""Tables whose keys choose how a scene is computed."""


@dataclass(frozen=True)
class Parameter:
    """A key of a scene with a number."""

    key: str
    value: float
    unit: str
    """Empty where it has none."""
    step: float
    """Of differences, in its unit."""

    @property
    def component(self) -> str | None:
        """Name of the component that it belongs to; None: it is of the scene's dynamics."""
        table, _, below = self.key.partition(".")
        return below.partition(".")[0] if table == "component" else None

    def moved(self, scene: Any, multiple: float) -> dict[str, Any]:
        """Return the tables that move it in a scene by a multiple of its step."""
        return moved_by(scene, self.key, self.value + multiple * self.step)


def moved_by(scene: Any, key: str, value: float) -> dict[str, Any]:
    """Return the nested tables that give a key of a scene a value, of an item of a list all of it."""
    table, _, item_number = key.rpartition(".")
    beside = item_of(scene, table)
    tables: dict[str, Any]
    if isinstance(beside, list | tuple):
        values = list(beside)
        values[int(item_number)] = value
        tables = nested(table.split("."), values)
    else:
        tables = nested(key.split("."), value)
    return tables


def item_of(model: Any, key: str) -> Any:
    """Return what a key names within a model, None where it names nothing."""
    for name_below in key.split("."):
        if isinstance(model, Mapping):
            model = model.get(name_below)
        elif isinstance(model, list | tuple):
            model = model[int(name_below)] if name_below.isdecimal() and int(name_below) < len(model) else None
        else:
            model = getattr(model, name_below, None)
    return model


def parameters_of(job: Job, keys: Sequence[str]) -> list[Parameter]:
    """Return the parameters of some keys, by default those that `default_keys` yields.

    Raises:
        InputError: a key names no number, or one without a derivative.
    """
    schema = job.kind.model.object().model_json_schema()
    parameters = []
    for key in dict.fromkeys(keys or default_keys(job)):
        value = item_of(job.scene, key)
        if isinstance(value, bool) or not isinstance(value, int | float):
            there = "nothing there" if value is None else f"{value!r} there"
            raise InputError(
                f"{job.path}: --by {key}: it names no number, {there}; name a key as --set does, such as"
                " component.rod.material.E or body.rod.velocity.0"
            )
        if key.startswith(TIMES) and not key.startswith("run.gravity"):
            raise InputError(f"{job.path}: --by {key}: it chooses how the run is computed; only run.gravity is varied")
        unit = unit_at(schema, key)
        step_share = SHORT_STEP if unit == "m" or key.startswith("component.") else STEP
        parameters.append(Parameter(key, float(value), unit, abs(float(value)) * step_share or LEAST))
    return parameters


def default_keys(job: Job) -> Iterator[str]:
    """Yield E, nu and rho of elastic components, speeds, laws, layers, damping and springs of a scene."""
    for name, component in job.used().items():
        if component.material is not None and component.geometry.kind != "rigid":
            for constant in ("E", "nu", "rho"):
                key = f"component.{name}.material.{constant}"
                # The modes of a bar have no Poisson's ratio.
                if isinstance(item_of(job.scene, key), float) and not (
                    constant == "nu" and component.geometry.kind == "bar"
                ):
                    yield key
    for name, body in job.scene.body.items():
        for motion in ("velocity", "angular_velocity"):
            yield from (f"body.{name}.{motion}.{i}" for i, rate in enumerate(getattr(body, motion)) if rate)
        yield from _numbers(job, f"body.{name}.damping", ("ratio", "alpha", "beta"))
    for name in job.scene.contact:
        yield from _numbers(job, f"contact.{name}", ("surface_stiffness",))
        yield from _numbers(job, f"contact.{name}.law", ("stiffness", "radius", "modulus", "damping"))
    for name in job.scene.force:
        yield from _numbers(job, f"force.{name}", ("stiffness", "damping"))


def _numbers(job: Job, table: str, names: Sequence[str]) -> Iterator[str]:
    for name in names:
        if item_of(job.scene, key := f"{table}.{name}"):
            yield key
