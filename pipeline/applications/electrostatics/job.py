"""The job of a scene of conductors: its checked scene and its products."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gudgeon.pipeline.applications.electrostatics.grid import Grid, Moved
from gudgeon.pipeline.applications.electrostatics.scene import FieldFile
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import check_scene, named
from gudgeon.pipeline.scenes.report import Report
from gudgeon.pipeline.stages.base import Place, SceneJob
from gudgeon.pipeline.stages.keys.products import Product, mesh_product, plot_inputs, product
from gudgeon.pipeline.stages.summary import reference_values

PLACED = {"surfaces", "position", "orientation", "potential", "charge"}
"""Settings of a conductor that its field depends on beside its mesh."""


@dataclass(frozen=True, kw_only=True)
class FieldJob(SceneJob):
    """A checked scene of conductors, with the places where its products go."""

    scene: FieldFile
    expected: dict[str, float]
    """Reference values by quantity."""

    def meshes(self) -> dict[str, Product]:
        """Return the mesh of each conductor, by name."""
        folder = self.path.parent
        return {name: mesh_product(name, c, folder, "conductor") for name, c in self.scene.conductor.items()}

    def field(self) -> Product:
        """Return the field of the conductors in their places."""
        meshes = self.meshes()
        conductors = [
            {"name": name, "mesh": meshes[name].key} | c.model_dump(mode="json", include=PLACED)
            for name, c in self.scene.conductor.items()
        ]
        settings = self.scene.model_dump(mode="json", include={"permittivity", "half_space", "panels"})
        return product("field", self.name, {"conductors": conductors} | settings)

    def grid(self) -> Grid | None:
        """Return the grid of poses; None where the scene has none."""
        if (poses := self.scene.poses) is None:
            return None
        pivot = self.scene.conductor[poses.moved[0]].position if poses.pivot is None else poses.pivot
        return Grid(self.field().key, Moved(tuple(poses.moved), np.array(pivot, float)), poses.axes())

    def pose_grid(self) -> dict[str, Product]:
        """Return the product of the grid of poses by its place; empty where the scene has none."""
        if (grid := self.grid()) is None:
            return {}
        conditions: dict[str, Any] = {
            name: c.model_dump(mode="json", include={"potential", "charge"}) for name, c in self.scene.conductor.items()
        }
        assert self.scene.poses is not None
        if (tolerance := self.scene.poses.tolerance) is not None:
            conditions = {"conductors": conditions, "tolerance": tolerance}
        return {"poses": grid.product(self.name, conditions)}

    def pictures(self) -> dict[str, Any]:
        return plot_inputs(self.field().key, {})


def mesh_products(job: FieldJob) -> dict[str, Product]:
    """Return the mesh of each conductor."""
    return {f"{name}.mesh": mesh for name, mesh in job.meshes().items()}


def field_products(job: FieldJob) -> dict[str, Product]:
    """Return the field of the conductors in their places."""
    return {"solve": job.field()}


def pose_products(job: FieldJob) -> dict[str, Product]:
    """Return the grid of poses, if the scene has one."""
    return job.pose_grid()


def field_job(scene_place: Place) -> FieldJob:
    """Return the job of a scene of conductors; raises InputError with every mistake of one kind listed."""
    scene = check_scene(scene_place.path, scene_place.tables, FieldFile)
    with named(scene_place.path, InputError):
        expected = reference_values(Report(**scene.report.model_dump()), scene_place.path.parent)
    return FieldJob(**vars(scene_place), scene=scene, expected=expected)
