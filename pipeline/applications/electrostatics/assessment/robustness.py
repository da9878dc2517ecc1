"""Robustness cases of a scene of conductors: its capacitances under other units and sizes, turned, and without voltage.

A capacitance over 4π ε₀ is a length: of the same panels in other units it has the factor of the lengths.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from gudgeon.modaldb.records.field import FieldRecord
from gudgeon.pipeline.applications.electrostatics.capacitance import VACUUM
from gudgeon.pipeline.applications.electrostatics.job import FieldJob
from gudgeon.pipeline.applications.electrostatics.scene import FieldFile
from gudgeon.pipeline.robustness.evidence import Evidence
from gudgeon.pipeline.robustness.operations.table import OPERATIONS as BODIES
from gudgeon.pipeline.robustness.rules import SAME
from gudgeon.pipeline.robustness.subject import DoesNotApply, Subject
from gudgeon.pipeline.robustness.trial import Trial, attempt
from gudgeon.pipeline.robustness.turning import ANY
from gudgeon.pipeline.robustness.units import Units, rescaled, rescaled_mesh, with_values
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver.scene.orientation import Orientation, quaternion_of

ALIKE = 1e-7
"""Allowed relative difference of capacitances: rules of integration are chosen by distances, so that round-off decides
at their limits, where they differ by some 1e-9."""


def field_subject(job: FieldJob, progress: Progress) -> Subject:
    """Return a scene of conductors as the subject of robustness cases; its conductors are meshed first."""
    run_job(job, "mesh", progress)
    meshes = {name: job.store.get(product.key, "mesh") for name, product in job.meshes().items()}
    evidence, mesh_of = partial(_evidence, progress=progress), lambda trial_job, name: trial_job.meshes()[name]
    return Subject(
        job, meshes, lambda trial, folder: attempt(trial, folder, evidence, mesh_of), _unchanged,
        operations=dict.fromkeys(BODIES, _no_bodies) | OPERATIONS,
    )  # fmt: skip


def _evidence(job: FieldJob, progress: Progress) -> Evidence:
    run_job(job, "solve", progress)
    record: FieldRecord = job.store.get(job.field().key, "field", only=["conductors", "capacitance", "counts"])
    names, C = record.conductors["names"], record.capacitance / (4 * np.pi * VACUUM)
    readings = {f"{a}.{b}": (float(C[i, j]), "m") for i, a in enumerate(names) for j, b in enumerate(names)}
    values = np.linalg.eigvalsh(0.5 * (C + C.T))
    return Evidence(readings=readings, condition=float(values[-1] / values[0]), steps=int(record.counts["panels"]))


def _unchanged(changes: Any) -> Any:
    raise DoesNotApply("cases that set keys are of scenes of bodies")


def _in_units(subject: Subject, units: Units) -> Trial:
    """Return the trial of the same panels with all lengths in another unit."""
    scene: FieldFile = subject.scene
    conductors = {name: rescaled(c, units) for name, c in scene.conductor.items()}
    half = scene.half_space
    if half is not None:
        half = with_values(half, {"point": tuple(units.length * x for x in half.point)})
    meshes = {name: rescaled_mesh(mesh, units) for name, mesh in subject.meshes.items()}
    return _trial(subject, {"conductor": conductors, "half_space": half}, Units(length=units.length), meshes)


def _trial(subject: Subject, changes: dict[str, Any], units: Units, meshes: Any) -> Trial:
    # The field of the scene's own places is judged: a grid of poses repeats it.
    scene = subject.scene.model_copy(update={"poses": None} | changes)
    return Trial(replace(subject.job, scene=scene), meshes, units=units, alike=ALIKE)


def _turned(subject: Subject, operation: Any) -> Trial:
    """Turn the whole scene: its capacitances are the same."""
    scene: FieldFile = subject.scene
    Q, conductors = ANY.matrix(), {}
    for name, conductor in scene.conductor.items():
        Q_conductor = np.eye(3) if conductor.orientation is None else conductor.orientation.matrix()
        turn = Orientation(quaternion=tuple(np.array(quaternion_of(Q @ Q_conductor)).tolist()))
        conductors[name] = with_values(
            conductor, {"position": tuple((Q @ conductor.position).tolist()), "orientation": turn}
        )
    half = scene.half_space
    if half is not None:
        placed = {"point": tuple((Q @ half.point).tolist()), "normal": tuple((Q @ half.normal).tolist())}
        half = with_values(half, placed)
    return _trial(subject, {"conductor": conductors, "half_space": half}, Units(), subject.meshes)


def _voltage(subject: Subject, operation: Any) -> Trial:
    """Scale potentials and charges: capacitances do not depend on them."""
    conductors = {}
    for name, conductor in subject.scene.conductor.items():
        key = "charge" if conductor.potential is None else "potential"
        conductors[name] = with_values(conductor, {key: operation.factor * getattr(conductor, key)})
    scene = subject.scene.model_copy(update={"poses": None, "conductor": conductors})
    return Trial(replace(subject.job, scene=scene), subject.meshes, agreement=SAME)


def _no_bodies(subject: Subject, operation: Any) -> Trial:
    raise DoesNotApply("the scene has conductors and no bodies that move")


OPERATIONS: dict[str, Callable[[Subject, Any], Trial]] = {
    "units": lambda subject, to: _in_units(subject, Units(to.mass, to.length, to.time)),
    "size": lambda subject, to: _in_units(subject, Units(to.factor**3, to.factor, to.factor)),
    "turned": _turned,
    "voltage": _voltage,
}
"""What the operations of cases do to conductors."""
