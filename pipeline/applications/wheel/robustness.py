"""Robustness cases of a wheel: its modes by cyclic symmetry under other units, materials and slivers."""

from functools import partial

from gudgeon.modaldb.records.cyclic import CyclicRecord
from gudgeon.pipeline.applications.wheel.job import WheelJob
from gudgeon.pipeline.robustness.evidence import Evidence
from gudgeon.pipeline.robustness.subject import Subject
from gudgeon.pipeline.robustness.trial import attempt, mesh_of_component
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress


def wheel_subject(job: WheelJob, progress: Progress) -> Subject:
    """Return a wheel as the subject of its robustness cases; it is meshed first."""
    run_job(job, "mesh", progress)
    meshes = {job.wheel.component: job.store.get(job.mesh().key, "mesh")}
    evidence = partial(_evidence, progress=progress)
    return Subject(job, meshes, lambda trial, folder: attempt(trial, folder, evidence, mesh_of_component), job.changed)


def _evidence(job: WheelJob, progress: Progress) -> Evidence:
    run_job(job, "modes", progress)
    record: CyclicRecord = job.store.get(job.modes().key, "cyclic", only=["harmonics"])
    material = job.component.material
    assert material is not None
    names = {f"{job.wheel.component}, harmonic {h.harmonic}": h for h in record.harmonics.values()}
    lowest = min(float(h.angular_frequencies[0]) for h in names.values())
    highest = max(float(h.angular_frequencies[-1]) for h in names.values())
    return Evidence(
        frequencies={name: h.angular_frequencies for name, h in names.items()},
        shear={name: material.lame[1] for name in names},
        orthogonality=max(float(h.quality["orthogonality"]) for h in names.values()),
        condition=(highest / lowest) ** 2,
    )
