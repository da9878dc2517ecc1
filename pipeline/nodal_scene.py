"""A scene as a problem in all nodal dofs: same meshes, same points, same surface layer, same loads and rod."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from modaldb.schema import MeshRecord, TractionModes
from modaldb.traction import along_direction, chart_coordinates
from pipeline.component import Component
from pipeline.errors import InputError
from pipeline.femodel import FEModel
from pipeline.interface import contact_points
from pipeline.loads import load_rows
from pipeline.mesh import movement_of
from pipeline.model import build_model
from pipeline.morph import moved_mesh
from pipeline.nodal import (
    NodalBody,
    NodalContact,
    NodalLoad,
    NodalProblem,
    NodalRod,
    SlidingSurface,
    SplineWeights,
    free_body,
    gravity,
    static_start,
)
from pipeline.patch import patch_point, patch_row
from pipeline.stages import Job, basic_surface, free_twists, obstacle_of
from pipeline.tie import refuse_rigid
from pipeline.traction import traction_space

START_STEP = 1e-6
"""Over which loads and the crank pin's motion are taken for the deformation at the start [s]."""


@dataclass(frozen=True)
class _Part:
    """One body of the scene on its mesh."""

    name: str
    mesh: MeshRecord
    model: FEModel
    component: Component
    settings: Any

    @property
    def position(self) -> np.ndarray:
        return np.asarray(self.settings.position, float)


def nodal_problem(job: Job) -> NodalProblem:
    """Return the scene in all nodal dofs, on the mesh of the changed design where it has a change.

    Raises:
        InputError: the scene has more bodies than points on one can meet, or a contact has no layer to press against.
    """
    scene, masters = job.scene, job.scene.masters()
    slaves = {contact.body for contact in scene.contact.values()}
    over = {master.body for master in masters.values()}
    if len(slaves) != 1 or len(over) > 1 or slaves | over != set(scene.body) or len(scene.joint) > 1:
        raise InputError(
            f"{job.path}: report.nodal: is for the contact points of one body, against obstacles or one other body, and"
            " one joint"
        )
    for name in scene.moving():
        raise InputError(f"{job.path}: report.nodal: knows no moving forces, leave force.{name} out")
    for name, contact in scene.contact.items():
        if contact.surface_stiffness is None:
            raise InputError(f"{job.path}: report.nodal: contact.{name} needs surface_stiffness, nodes need a spring")
    slave = _part(job, slaves.pop())
    master = _part(job, over.pop()) if over else None
    loads = [_gas(job, name, slave) for name in scene.gas()]
    if any(scene.run.gravity):
        loads.append(gravity(slave.model, np.asarray(scene.run.gravity)))
    spin = np.cross(np.asarray(slave.settings.angular_velocity), slave.model.nodes - slave.model.properties.centre)
    velocity = (np.asarray(slave.settings.velocity) + spin) @ slave.model.directions.T
    body = free_body(
        slave.name, slave.model, velocity.ravel(), twists=free_twists(job, slave.name), damping=_beta(slave),
        loads=tuple(loads),
    )  # fmt: skip
    problem = NodalProblem(
        body,
        {name: _contact(job, name, slave, master) for name in scene.contact},
        scene.run.duration,
        master=_held_body(master) if master else None,
        rod=_rod(job, slave) if scene.joint else None,
        frames=scene.run.frames if master else 0,
    )
    return static_start(problem, START_STEP) if scene.joint else problem


def _part(job: Job, name: str) -> _Part:
    component_name = job.scene.component_of(name)
    component = job.scene.component[component_name]
    base = job.store.get(job.components()[component_name]["base-mesh"].key, "mesh")
    movement = movement_of(component, job.folder, component_name)
    mesh = base if movement is None else moved_mesh(base, movement)
    where = f"component.{component_name}"
    if mesh.cell_type not in ("tetra10", "line3"):
        raise InputError(
            f"{job.path}: report.nodal: is for solids and bars, {where}.geometry is '{component.geometry.kind}'"
        )
    refuse_rigid(component.interface, f"{job.path}: {where}", "report.nodal")
    model = build_model(mesh, component.material, component.supports, where, component.geometry)
    if model.held.any() and len(model.rigid_twists):
        raise InputError(f"{job.path}: report.nodal: is for bodies free or held, {where}.supports hold it in part")
    return _Part(name, mesh, model, component, job.scene.body[name])


def _beta(part: _Part) -> float:
    return part.settings.damping.stiffness_factor if part.settings.damping else 0.0


def _held_body(part: _Part) -> NodalBody:
    if not part.model.held.any():
        return free_body(part.name, part.model, np.zeros(part.model.K.shape[0]), damping=_beta(part))
    K, M = part.model.free_matrices()
    return NodalBody(part.name, K, M, damping=_beta(part))


def _contact(job: Job, name: str, slave: _Part, master: _Part | None) -> NodalContact:
    contact = job.scene.contact[name]
    interface, where = slave.component.interface[contact.interface], f"contact.{name}.interface"
    if interface.kind == "patch":
        points = patch_point(slave.mesh, interface, where)
        rows = patch_row(slave.mesh, slave.model, interface, where)
    else:
        points = contact_points(slave.mesh, interface, where)
        rows = slave.model.rows(points.nodes, points.normals)
    placed = points.points + slave.position
    if name in job.scene.masters():
        assert master is not None
        surface, space = _surface(job, name, slave, master, placed)
        obstacle = basic_surface(space.chart, master.position)
    else:
        surface, obstacle = None, obstacle_of(contact.against.model_dump())
    directions = obstacle.direction(placed)
    return NodalContact(
        sparse.csr_matrix(-rows),
        obstacle.gap(placed),
        contact.surface_stiffness * points.areas,
        directions,
        surface,
    )


def _surface(
    job: Job, name: str, slave: _Part, master: _Part, placed: np.ndarray
) -> tuple[SlidingSurface, TractionModes]:
    over = job.scene.masters()[name]
    found = traction_space(master.mesh, master.component.interface[over.interface], f"contact.{name}.against")
    space = TractionModes(
        found.chart, found.start, found.spacing, found.counts, np.empty((0, 0)), found.resultant
    )  # fmt: skip
    weights = SplineWeights(space, chart_coordinates(found.chart, placed - master.position))
    along = np.tile(slave.model.directions @ along_direction(found.chart), len(slave.model.nodes))
    slide = np.asarray(slave.model.M @ along) / slave.model.properties.mass
    rows = sparse.csr_matrix(found.rows(master.model)[:, master.model.free])
    return SlidingSurface(rows, weights, slide), space


def _gas(job: Job, name: str, slave: _Part) -> NodalLoad:
    force = job.scene.gas()[name]
    joint = job.scene.joint[force.joint]
    rows = load_rows(slave.mesh, slave.model, slave.component.interface[force.interface], f"force.{name}.interface")

    def mean(edges: np.ndarray) -> np.ndarray:
        return force.pressure(joint.angle(0.5 * (edges[1:] + edges[:-1])))

    return NodalLoad(rows.B.toarray()[0], mean)


def _rod(job: Job, slave: _Part) -> NodalRod:
    ((name, joint),) = job.scene.joint.items()
    held = load_rows(slave.mesh, slave.model, slave.component.interface[joint.interface], f"joint.{name}.interface")
    along, lateral = joint.axes
    axes = np.stack([lateral, along])
    point = axes @ (held.point + slave.position)
    return NodalRod(name, axes @ held.B.toarray(), point, joint.rod_length, joint.crank_pin, axes)
