"""The job of a scene of bodies: its checked scene and its products."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.pipeline.scenes.checks import checked, possible_quantities
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.reading import merged, named
from gudgeon.pipeline.stages.base import Place, SceneJob
from gudgeon.pipeline.stages.keys.products import Product, component_products, nodal_product, plot_inputs, product
from gudgeon.pipeline.stages.reference_curve import reference_curve
from gudgeon.solver.forces.fields.electrostatic import Electrostatic
from gudgeon.solver.scene.scene import Scene

if TYPE_CHECKING:
    import numpy as np

    from gudgeon.modaldb.records.mesh import MeshRecord
    from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord

KINDS = ("mesh", "modes", "morph")
"""Kinds of the records of a component."""
UNCHECKED = {"run": {"checks": False}}
"""Changes of a scene for the runs of a sweep, which judges their errors itself."""


@dataclass(frozen=True, kw_only=True)
class Job(SceneJob):
    """A checked scene of bodies, with the places where its products go."""

    scene: SceneFile
    found: tuple[str, ...] = ()
    """A line for each contact whose interfaces were found by proximity."""
    linked: tuple[SceneJob, ...] = ()
    """Scenes that it names: its own designs and runs read the records of their last stage."""

    @property
    def folder(self) -> Path:
        """Folder of the scene file."""
        return self.path.parent

    def used(self) -> dict[str, Component]:
        """Return the components that a body uses, or an elastic bearing."""
        names = {self.scene.component_of(body) for body in self.scene.body} | set(self.scene.bearings().values())
        return {name: component for name, component in self.scene.component.items() if name in names}

    def components(self) -> Mapping[str, dict[str, Product]]:
        """Return the products of every component that a body uses, of its files as they were at the first call."""
        return self._components

    @cached_property
    def _components(self) -> Mapping[str, dict[str, Product]]:
        with named(self.path, InputError):
            return {
                name: component_products(name, component, self.folder, **self.scene.reduced_with(name))
                for name, component in self.used().items()
            }

    @overload
    def record(self, component: str, kind: Literal["modes"] = "modes") -> "ModalRecord": ...
    @overload
    def record(self, component: str, kind: Literal["mesh"]) -> "MeshRecord": ...
    @overload
    def record(self, component: str, kind: Literal["morph"]) -> "MorphRecord": ...
    def record(self, component: str, kind: str = "modes") -> Any:
        """Return the record of a component: its `mesh`, `modes` or `morph` (the design).

        Raises:
            InputError: there is no such component or kind.
            RecordMissing: it is not in the database; `gudgeon.run(scene, until="morph")` computes it.
        """
        made = self.components()
        if component not in made:
            raise InputError(f"{self.path}: record: no component '{component}'; the scene has {', '.join(made)}")
        if kind not in KINDS:
            raise InputError(f"{self.path}: record: no kind '{kind}'; allowed: {', '.join(KINDS)}")
        return self.store.get(made[component][kind].key, kind)

    def morphs(self) -> dict[str, str]:
        """Return the keys of the records that the solver reads, by component."""
        return {name: steps["morph"].key for name, steps in self.components().items()}

    def compared(self) -> Mapping[str, "Job"]:
        """Return the runs that the pictures compare this one with, checked at the first call."""
        return self._compared

    @cached_property
    def _compared(self) -> Mapping[str, "Job"]:
        return {name: variant(self, changes) for name, changes in self.scene.plot.compare.items()}

    def pictures(self) -> dict[str, Any]:
        others = {name: job.trajectory().key for name, job in self.compared().items()}
        inputs = plot_inputs(self.trajectory().key, others | {"": self.scene.plot.label} if others else {})
        curve = self.reference()
        return inputs | ({"reference": curve} if curve is not None else {})

    def reference(self) -> dict[str, Any] | None:
        """Return the reference of the contact force, see `reference_curve`."""
        return reference_curve(self.path, self.scene, self._full_fe)

    def _full_fe(self, step: float) -> str | None:
        """Return the key of the full-FE run with a step [s] if it is in the database."""
        inputs = {name: (made["modes"].inputs, made["morph"].inputs) for name, made in self.components().items()}
        key = nodal_product(self.name, self.dynamics(), inputs, step).key
        return key if self.store.has(key) else None

    def dynamics(self) -> dict[str, Any]:
        """Return the solver's part of the scene, as JSON, without what only decides which notes are given."""
        return self.scene.model_dump(mode="json", include={*Scene.model_fields}, exclude={"run": {"tolerance"}})

    def trajectory(self) -> Product:
        """Return the product of the solve stage."""
        return self._trajectory

    @cached_property
    def _trajectory(self) -> Product:
        return product("solve", self.name, {"scene": self.dynamics(), "morphs": self.morphs()})

    def quantities(self) -> Sequence[str]:
        """See `SceneJob`."""
        return possible_quantities(self.scene)


def mesh_products(job: Job) -> dict[str, Product]:
    """Return the meshes of components, as they are built and as they are moved for a design change."""
    return _steps(job, "mesh")


def modes_products(job: Job) -> dict[str, Product]:
    """Return the modes of components."""
    return _steps(job, "modes")


def morph_products(job: Job) -> dict[str, Product]:
    """Return the designs of components."""
    return _steps(job, "morph")


def run_products(job: Job) -> dict[str, Product]:
    """Return the run of the scene."""
    return {"solve": job.trajectory()}


def _steps(job: Job, stage: str) -> dict[str, Product]:
    """Return the products of a stage of components, by component and step."""
    return {
        f"{name}.{step}": product
        for name, steps in job.components().items()
        for step, product in steps.items()
        if product.stage == stage
    }


def contact_job(scene_place: Place) -> Job:
    """Return the job of a scene of bodies; raises InputError with every mistake listed."""
    return Job(**vars(scene_place), scene=checked(scene_place.path, scene_place.tables, SceneFile))


def variant(job: Job, changes: Mapping[str, Any]) -> Job:
    """Return the job of the scene changed by nested tables; raises InputError as `contact_job` does."""
    tables = merged(job.tables, changes)
    return replace(job, tables=tables, scene=checked(job.path, tables, SceneFile))


def placed_design(job: Job, body: str, only: Sequence[str]) -> "MorphRecord":
    """Return some fields of a body's design, turned as the scene places it."""
    from gudgeon.solver.bodies import placing

    key = job.components()[job.scene.component_of(body)]["morph"].key
    design = job.store.get(key, "morph", only=only)
    return placing.turned_design(design, placing.rotation(job.scene.body[body]))


def free_twists(job: Job, body: str) -> "np.ndarray":
    """Return the mass-normalised rigid motions that are free in a scene: translation and rotation [kg^-½], (r, 6)."""
    from gudgeon.solver.bodies import small_motion

    morph = placed_design(job, body, ["mass", "inertia", "rigid_twists"])
    return small_motion.free_twists(morph, job.scene.body[body], body)


def grids_of(scene: Any) -> dict[str, str]:
    """Return the key of the grid of poses of each field of a scene that has one, by name."""
    forces = getattr(scene, "force", {})
    return {name: f.record for name, f in forces.items() if isinstance(f, Electrostatic) and f.record}


def refuse_turning(job: Job, command: str) -> None:
    """Raise an InputError where the bodies of a scene turn by any angle, which a command does not support."""
    if job.scene.capabilities.turns:
        raise InputError(
            f"{job.path}: {command}: the bodies of this scene turn by any angle (integrator 'turning'), which this"
            " command does not support; `gudgeon run` does"
        )
