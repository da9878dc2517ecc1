"""From a scene with `report.vectors` to its moving force, on the scene's mesh or on another one."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.elements import ASSEMBLERS
from gudgeon.pipeline.fem.supports import surface_nodes
from gudgeon.pipeline.interfaces.tie import refuse_rigid
from gudgeon.pipeline.interfaces.traction_space import traction_space
from gudgeon.pipeline.report.vectors.travelling import Root, Travel
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.report import Vectors
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.mesh import build_mesh


@dataclass(frozen=True)
class Problem:
    """A moving force of a scene, and the component under it."""

    job: Job
    settings: Vectors
    force: Any
    """The moving force of the scene."""
    component: Component
    name: str
    """Of the component."""

    @property
    def where(self) -> str:
        """The component's key in the scene."""
        return f"component.{self.name}"

    def travel(self, mesh: MeshRecord) -> Travel:
        """Return the force on its path over a mesh.

        Raises:
            InputError: the supports permit rigid motions of the body.
        """
        part, where = self.component, self.where
        refuse_rigid(part.interface, where, "report.vectors")
        model = build_model(mesh, part.material, part.supports, where, part.geometry)
        if count := len(model.rigid_twists):
            raise InputError(f"report.vectors: {where}.supports permit {count} rigid motions; support the body fully")
        interface = self.force.interface
        space = traction_space(mesh, part.interface[interface], f"{where}.interface.{interface}")
        inward = sparse.csr_matrix(-space.rows(model))
        return Travel(model, inward, space, self.force.amounts, self.force.places, self.job.scene.run.duration)

    def finer(self, size: float) -> Travel:
        """Return the force on a mesh of another edge length [m]."""
        mesh = self.component.mesh.model_copy(update={"size": size})
        return self.travel(build_mesh(self.component.model_copy(update={"mesh": mesh}), self.job.folder, self.name))

    def root(self, mesh: MeshRecord) -> Root:
        """Return the cells whose middle is near the supports.

        Raises:
            InputError: there are none.
        """
        part, limit = self.component, self.settings.root
        held = [surface_nodes(mesh, item.surface, f"{self.where}.supports") for item in part.supports]
        apart, _ = cKDTree(mesh.nodes[np.concatenate(held)]).query(mesh.nodes[mesh.cells].mean(axis=1))
        near = mesh.cells[apart < limit]
        if not len(near):
            raise InputError(f"report.vectors.root: {limit} m given, the nearest cell is {apart.min():.3g} m away")
        assert part.material is not None
        piece = ASSEMBLERS[mesh.cell_type](replace(mesh, cells=near), part.material, part.geometry)
        d = len(piece.directions)
        dofs = np.unique(d * near[:, :, None] + np.arange(d))
        return Root(dofs, sparse.csr_matrix(piece.K[dofs][:, dofs]))


def problem_of(job: Job) -> Problem:
    """Return the moving force that a scene names in `report.vectors`.

    Raises:
        InputError: the scene has no such force, or a design change.
    """
    settings, forces = job.scene.report.vectors, job.scene.moving()
    assert settings is not None
    if settings.force not in forces:
        have = ", ".join(forces) or "none"
        raise InputError(f"report.vectors.force: no moving force '{settings.force}', the scene has {have}")
    name = job.scene.component_of(forces[settings.force].body)
    if job.components()[name]["morph"].inputs["profile"]:
        raise InputError(f"report.vectors: design changes are not supported; remove component.{name}.change")
    return Problem(job, settings, forces[settings.force], job.scene.component[name], name)
