"""A body of a scene with its mesh and FE matrices, for the full FE."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from gudgeon.pipeline.design_change.morph import moved_mesh
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.interfaces.patch import POINT_FINDERS, normal_rows
from gudgeon.pipeline.interfaces.point_mass import component_model
from gudgeon.pipeline.interfaces.points import ContactPoints
from gudgeon.pipeline.interfaces.tie import refuse_rigid
from gudgeon.pipeline.nodal.problem import NodalBody
from gudgeon.pipeline.nodal.start import supported_body
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.job import Job, free_twists
from gudgeon.pipeline.stages.mesh import movement_of


@dataclass(frozen=True)
class Part:
    """One body of the scene on its mesh, that of the changed design where there is one."""

    name: str
    model: FEModel
    component: Component
    body: NodalBody
    reduction: sparse.csr_matrix
    """Displacement of the model's dofs per dof of the body, (dofs of the model, dofs)."""
    position: np.ndarray
    """[m], (3,)"""
    rotation: np.ndarray
    """Q, from the axes of the mesh to those of the scene, (3, 3)."""

    def placed(self, points: np.ndarray) -> np.ndarray:
        """Return points in the scene [m], (..., 3), of their places on the mesh [m], (..., 3)."""
        return points @ self.rotation.T + self.position

    def contact_rows(
        self, name: str, key: str, along: np.ndarray | None = None
    ) -> tuple[ContactPoints, sparse.csr_matrix]:
        """Return the points of an interface and their outward normal displacement, (c, dofs of the body).

        Args:
            key: The key that names it, for messages.
            along: Unit vectors in the axes of the scene along which they are displaced instead, (c, 3) or (3,).

        Raises:
            InputError: there is no such interface, or it is of another kind or does not fit its surface.
        """
        if name not in self.component.interface:
            have = ", ".join(self.component.interface) or "none"
            raise InputError(f"{key}: body '{self.name}' has no '{name}', it has {have}")
        interface = self.component.interface[name]
        if interface.kind not in POINT_FINDERS:
            raise InputError(f"{key}: '{name}' is of kind '{interface.kind}', report.full_fe allows 'points', 'patch'")
        points = POINT_FINDERS[interface.kind](self.model.mesh, interface, key)
        turned = points
        if along is not None:
            turned = replace(points, normals=np.broadcast_to(along @ self.rotation, points.normals.shape))
        return points, sparse.csr_matrix(normal_rows(self.model, interface, turned) @ self.reduction)


def load_part(job: Job, name: str, field: np.ndarray) -> Part:
    """Return a body of a scene.

    Args:
        field: Gravity that acts on it [m/s²], (3,).

    Raises:
        InputError: its component has a rigid surface, or what `build_model` refuses.
    """
    component_name = job.scene.component_of(name)
    component = job.scene.component[component_name]
    base = job.store.get(job.components()[component_name]["base-mesh"].key, "mesh")
    movement = movement_of(component, job.folder, component_name)
    mesh = base if movement is None else moved_mesh(base, movement)
    key = f"component.{component_name}"
    refuse_rigid(component.interface, mesh, f"{job.path}: {key}", "report.full_fe")
    model = component_model(mesh, component, key)
    settings, properties = job.scene.body[name], model.properties
    Q = np.eye(3) if settings.orientation is None else settings.orientation.matrix()
    # The mesh keeps its axes: what the scene gives is turned back.
    velocity, spin = np.asarray(settings.velocity) @ Q, np.asarray(settings.angular_velocity) @ Q
    if settings.velocity_at is not None:
        velocity = velocity + np.cross(spin, properties.centre - settings.velocity_at)
    momentum = np.concatenate([properties.mass * velocity, properties.inertia @ spin])
    damping = 0.0 if settings.damping is None else settings.damping.proportional
    if damping is None:
        raise InputError(
            f"{job.path}: report.full_fe: body.{name}.damping: full FE has damping proportional to the stiffness alone;"
            " give ratio and frequency, or beta"
        )
    twists = free_twists(job, name)
    body_twists = np.column_stack([twists[:, :3] @ Q, twists[:, 3:] @ Q])
    deformed = job.scene.run.start == "rest"
    body, reduction = supported_body(
        name, model, body_twists, momentum, damping=damping, field=field @ Q, deformed=deformed
    )
    body = replace(body, twists=twists)
    position = np.asarray(settings.position, float)
    return Part(name, model, component, body, reduction, position=position, rotation=Q)
