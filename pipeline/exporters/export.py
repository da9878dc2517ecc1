"""`gudgeon export`: a scene's mode shapes or results as .vtu files."""

from dataclasses import replace
from pathlib import Path

from gudgeon.pipeline.exporters import EXPORTERS
from gudgeon.pipeline.exporters.vtu import BodyRecords
from gudgeon.pipeline.stages.job import Job, free_twists
from gudgeon.pipeline.stages.run import run_job


def export(job: Job, what: str, every: int) -> list[Path]:
    """Write mode shapes (`modes`) or results (`results`) of every body as .vtu files into the job's `vtu` folder."""
    run_job(job, "modes" if what == "modes" else "solve")
    files, exporter = [], EXPORTERS["vtu"]
    for body in job.scene.body:
        steps = job.components()[job.scene.component_of(body)]
        mesh, modal = (job.store.get(steps[kind].key, kind) for kind in ("mesh", "modes"))
        if what == "modes":
            files.append(job.out / "vtu" / f"{body}-modes.vtu")
            exporter.write_modes(files[-1], mesh, modal)
        else:
            # Rigid motions that the scene fixes have no coordinates in the trajectory.
            morph = replace(job.store.get(steps["morph"].key, "morph"), rigid_twists=free_twists(job, body))
            trajectory = job.store.get(job.trajectory().key, "trajectory")
            records = BodyRecords(mesh, modal, morph)
            files += exporter.write_trajectory(job.out / "vtu" / body, records, trajectory, body, every)
    return files
