"""A scene as a problem of the full FE, with its meshes, contact points, surface layers, loads and rod."""

from dataclasses import replace

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import SplineGrid
from gudgeon.modaldb.records.traction import along_direction, chart_coordinates, spread, turned_chart
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.interfaces.loads import load_rows
from gudgeon.pipeline.interfaces.traction_space import traction_space
from gudgeon.pipeline.nodal.problem import (
    NodalContact,
    NodalLoad,
    NodalProblem,
    NodalRod,
    PointProblem,
    SlidingSurface,
)
from gudgeon.pipeline.nodal.scene.body import Part, load_part
from gudgeon.pipeline.nodal.scene.points import meeting_problem, refuse_contacts
from gudgeon.pipeline.nodal.sliding.weights import sliding_weights
from gudgeon.pipeline.nodal.start import static_start
from gudgeon.pipeline.stages.job import Job
from gudgeon.solver.obstacles import basic_surface, obstacle_of
from gudgeon.solver.scene.oblique import oblique

LINES = ("bar", "beam", "frame", "rigid")
"""Geometries with few contact points."""
START_STEP = 1e-6
"""Interval of loads and crank pin motion for the static deformation at the start [s]."""


def nodal_problem(job: Job) -> NodalProblem | PointProblem:
    """Return the scene in full FE, with the mesh of the changed design where there is one.

    Scenes with points that slide over another body, with a joint or a moving force, or with many points of one solid
    that press a layer against an obstacle become a `NodalProblem`; all others a `PointProblem`.

    Raises:
        InputError: the scene has something that neither supports.
    """
    scene = job.scene
    for name in scene.springs():
        raise InputError(f"{job.path}: report.full_fe: springs are not supported; remove force.{name}")
    for name in scene.fields() | scene.electrodes():
        raise InputError(f"{job.path}: report.full_fe: electrostatic fields are not supported; remove force.{name}")
    for name, force in scene.over_time().items():
        key = f"{job.path}: report.full_fe: force.{name}"
        raise InputError(f"{key}: forces of kind '{force.kind}' are not supported; remove it")
    for name in scene.hinges():
        raise InputError(f"{job.path}: report.full_fe: joint.{name}: joints of two markers are not supported; hold the"
                         " body by component supports")  # fmt: skip
    for name in scene.motion:
        raise InputError(f"{job.path}: report.full_fe: driven bodies are not supported; remove motion.{name}")
    for name in scene.moving() if scene.contact or scene.joint else ():
        key = f"{job.path}: report.full_fe: force.{name}"
        raise InputError(f"{key}: moving forces together with contacts or joints are not supported; remove it")
    if not (scene.contact or scene.moving()):
        raise InputError(f"{job.path}: report.full_fe: the scene has no contact and no moving force; needed: one")
    refuse_contacts(job)
    sliding = bool(scene.masters() or scene.joint or scene.moving())
    return _sliding_problem(job) if sliding or _layered_solid(job) else meeting_problem(job)


def _layered_solid(job: Job) -> bool:
    """Return whether the only body is a free solid whose points press layers against obstacles."""
    scene = job.scene
    if scene.others() or len(scene.body) != 1:
        return False
    component = job.scene.component[scene.component_of(next(iter(scene.body)))]
    layers = all(contact.surface_stiffness is not None for contact in scene.contact.values())
    return layers and component.geometry.kind not in LINES and not component.supports


def _sliding_bodies(job: Job) -> tuple[str, str | None]:
    """Return the body that slides, and the one over which it does, if it is none of the obstacles."""
    scene = job.scene
    slaves = {acting.body for acting in (*scene.contact.values(), *scene.moving().values())}
    master_names = {master.body for master in scene.masters().values()}
    if len(slaves) != 1 or len(master_names) > 1 or slaves | master_names != set(scene.body) or len(scene.joint) > 1:
        raise InputError(
            f"{job.path}: report.full_fe: with sliding points, a joint or a moving force, all contacts and moving"
            " forces must be those of one body, against obstacles or one other body, with one joint at most"
        )
    for name, contact in scene.contact.items():
        if contact.surface_stiffness is None or contact.against.shape == "body":
            raise InputError(
                f"{job.path}: report.full_fe: contact.{name}: with sliding points or a joint, a contact needs"
                " surface_stiffness, and an obstacle or a surface that it is against"
            )
    return slaves.pop(), next(iter(master_names), None)


def _sliding_problem(job: Job) -> NodalProblem:
    scene = job.scene
    slave_name, master_name = _sliding_bodies(job)
    slave = _solid(job, slave_name, np.asarray(scene.run.gravity))
    master = _solid(job, master_name, np.zeros(3)) if master_name is not None else None
    gas = (_gas(job, name, slave) for name in scene.gas())
    moving = (_moving(job, name, slave) for name in scene.moving())
    problem = NodalProblem(
        replace(slave.body, loads=(*gas, *moving, *slave.body.loads)),
        {name: _contact(job, name, slave, master) for name in scene.contact},
        scene.run.duration,
        master=master.body if master else None,
        rod=_rod(job, slave) if scene.joint else None,
        frames=scene.run.frames if master or scene.moving() else 0,
        window=scene.run.window,
    )
    return static_start(problem, START_STEP, deformed=scene.run.start == "rest") if scene.joint else problem


def _solid(job: Job, name: str, field: np.ndarray) -> Part:
    body = load_part(job, name, field)
    cell = cell_of(body.model.mesh)
    if not (cell.solid or cell.axial):
        raise InputError(
            f"{job.path}: component.{job.scene.component_of(name)}.geometry: '{body.component.geometry.kind}' given,"
            " report.full_fe with sliding points, a joint or a moving force allows solids and bars"
        )
    if body.model.held.any() and len(body.model.rigid_twists):
        raise InputError(
            f"{job.path}: component.{job.scene.component_of(name)}.supports: leave some rigid motions free,"
            " report.full_fe with sliding points, a joint or a moving force allows all or none"
        )
    return body


def _contact(job: Job, name: str, slave: Part, master: Part | None) -> NodalContact:
    contact = job.scene.contact[name]
    key = f"contact.{name}.interface"
    points, rows = slave.contact_rows(contact.interface, key)
    placed = slave.placed(points.points)
    if name in job.scene.masters():
        assert master is not None
        surface, space = _surface(job, name, slave, master, placed)
        obstacle = basic_surface(turned_chart(space.chart, master.rotation), master.position)
    else:
        surface, obstacle = None, obstacle_of(contact.against.model_dump())
    directions, stiffness = obstacle.direction(placed), contact.surface_stiffness * points.areas
    if contact.interface in oblique(job.scene)[contact.body]:
        rows = slave.contact_rows(contact.interface, key, -directions)[1]
    return NodalContact(-rows, obstacle.gap(placed), stiffness, directions, surface)


def _surface(job: Job, name: str, slave: Part, master: Part, placed: np.ndarray) -> tuple[SlidingSurface, SplineGrid]:
    space, rows = _space(master, job.scene.masters()[name].interface, f"contact.{name}.against")
    local = (placed - master.position) @ master.rotation
    weights = sliding_weights(space, chart_coordinates(space.chart, local))
    direction = slave.rotation.T @ (master.rotation @ along_direction(space.chart))
    along = slave.model.of_nodes(np.tile(slave.model.directions @ direction, (len(slave.model.nodes), 1)))
    slide = (slave.model.M @ along @ slave.reduction) / slave.model.properties.mass
    return SlidingSurface(rows, weights, slide), space


def _space(body: Part, interface: str, key: str) -> tuple[SplineGrid, sparse.csr_matrix]:
    """Return a traction space and the outward displacement of its functions, (F, dofs of the body)."""
    space = traction_space(body.model.mesh, body.component.interface[interface], key)
    return space, sparse.csr_matrix(space.rows(body.model) @ body.reduction)


def _gas(job: Job, name: str, slave: Part) -> NodalLoad:
    force = job.scene.gas()[name]
    joint = job.scene.cranks()[force.joint]
    rows = load_rows(slave.model, slave.component.interface[force.interface], f"force.{name}.interface")
    return NodalLoad((rows.B @ slave.reduction).toarray(), lambda times: force.pressure(joint.angle(times))[:, None])


def _moving(job: Job, name: str, slave: Part) -> NodalLoad:
    force = job.scene.moving()[name]
    space, rows = _space(slave, force.interface, f"force.{name}.interface")
    return NodalLoad(rows.toarray(), lambda times: spread(space, force.places(times), -force.amounts(times)), name)


def _rod(job: Job, slave: Part) -> NodalRod:
    ((name, joint),) = job.scene.cranks().items()
    if joint.interface is None:
        raise InputError(f"{job.path}: report.full_fe: joint.{name}.interface: is missing; its kind is 'mean'")
    mean_rows = load_rows(slave.model, slave.component.interface[joint.interface], f"joint.{name}.interface")
    along, lateral = joint.axes
    axes = np.stack([lateral, along])
    rows = axes @ slave.rotation @ (mean_rows.B @ slave.reduction).toarray()
    return NodalRod(name, rows, axes @ slave.placed(mean_rows.point), joint.rod_length, joint.crank_pin, axes)
