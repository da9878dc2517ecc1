"""Scenes in other units or of other sizes, on the same meshes, and changes that are not checked."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.robustness.subject import ALL_RIGID, Subject, require
from gudgeon.pipeline.robustness.trial import Trial
from gudgeon.pipeline.robustness.units import Units, rescaled, rescaled_grid, rescaled_mesh, rescaled_profile
from gudgeon.pipeline.scenes.change import moved_surface
from gudgeon.pipeline.stages.job import grids_of
from gudgeon.solver.joints.clearance import Clearance


def in_equal_steps(subject: Subject) -> tuple[Subject, Trial | None]:
    """Return a scene whose bodies turn with equal steps, and what it is compared with; others as they are, and None.

    Round-off would choose others of their thousands of steps, and results differ by `run.accuracy` then.
    """
    scene = subject.scene
    loose = any(isinstance(joint, Clearance) for joint in subject.joints.values())
    if not subject.turns or loose or subject.base.passing or scene.run.step is not None:
        return subject, None
    step = scene.run.duration / max(subject.base.steps, 1)
    subject = replace(subject, job=subject.changed({"run": {"step": step, "checks": False}}))
    return subject, Trial(subject.job)


def in_units(subject: Subject, units: Units) -> Trial:
    """Return the trial of the scene in other units, on the same meshes."""
    subject, like = in_equal_steps(subject)
    tables = {}
    for name in subject.meshes:
        moved = moved_surface(subject.scene.component[name], subject.job.path.parent, name)
        if moved is not None and moved[1] is not None:
            target = subject.folder / f"{name}-{units.length:g}.csv"
            rescaled_profile(moved[1], target, units)
            tables[name] = {"change": {"profile": {"table": str(target.resolve())}}}
    grids = {
        name: rescaled_grid(subject.job.store.get(key, "posegrid"), units)
        for name, key in grids_of(subject.scene).items()
    }
    job = replace(subject.job, scene=updated(rescaled(subject.scene, units), {"component": tables}))
    meshes = {name: rescaled_mesh(mesh, units) for name, mesh in subject.meshes.items()}
    stretch, equal = dict.fromkeys(subject.meshes, 1 / units.time), like is not None
    return Trial(job, meshes, grids, units=units, stretch=stretch, length=extent(subject), like=like, equal_steps=equal)


def gap(subject: Subject, operation: Any) -> Trial:
    """Scale lengths so that the least gap of plates is of a given size, at the same material."""
    gaps = [field.gap for field in getattr(subject.scene, "fields", dict)().values() if hasattr(field, "gap")]
    require(gaps, "the scene has no field between plates")
    factor = operation.size / min(gaps)
    return in_units(subject, Units(factor**3, factor, factor))


def material(subject: Subject, operation: Any) -> Trial:
    """Scale modulus and density of every elastic component; of the scene by its units where it has contacts or joints,
    parts of several materials, or masses that are not meshed."""
    names, component = subject.elastic(), subject.scene.component
    faster: float = (operation.modulus / operation.density) ** 0.5
    require(names, ALL_RIGID)
    plain = all(
        component[name].material.simple and not component[name].point_mass and not _added(subject.meshes[name])
        for name in names
    )
    if subject.contacts or subject.turns or not plain:
        return in_units(subject, Units(mass=operation.density, time=1 / faster))
    materials = {name: component[name].material for name in names}
    changed = {
        name: {"material": {"E": m.E * operation.modulus, "rho": m.rho * operation.density}}
        for name, m in materials.items()
    }
    return Trial(job_with(subject, {"component": changed}), stretch=dict.fromkeys(names, faster))


def _added(mesh: MeshRecord) -> bool:
    """Return whether a mesh's file states masses or springs."""
    springs = any(relation.kind == "spring" for relation in mesh.relations.values())
    return springs or any(attachment.mass for attachment in mesh.attachments.values())


def extent(subject: Subject) -> float:
    """Return the largest distance of a body from the origin [m], zero where no body turns."""
    positions = [body.position for body in subject.scene.body.values()] if subject.turns else []
    return max((float(np.linalg.norm(position)) for position in positions), default=0.0)


def updated(old: Any, changes: Mapping[str, Any]) -> Any:
    """Return a model, or models by name, with nested changes, unchecked: values may exceed the limits of input."""
    table = old if isinstance(old, Mapping) else vars(old)
    new = {
        key: updated(table[key], change) if isinstance(change, Mapping) else change for key, change in changes.items()
    }
    return {**old, **new} if isinstance(old, Mapping) else old.model_copy(update=new)


def job_with(subject: Subject, changes: Mapping[str, Any]) -> Any:
    """Return the job with nested changes of its scene, see `updated`."""
    return replace(subject.job, scene=updated(subject.scene, changes))
