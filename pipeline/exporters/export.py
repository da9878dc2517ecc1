"""`gudgeon export`: a scene's mode shapes or results as .vtu files."""

from functools import partial
from pathlib import Path

import numpy as np

from gudgeon.pipeline.exporters import EXPORTERS
from gudgeon.pipeline.exporters.vtu import BodyRecords
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.stress import nodal_stress, stress_gauges
from gudgeon.pipeline.stages.folder import EXPORTS, held
from gudgeon.pipeline.stages.job import Job, refuse_turning
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.bodies.placing import turned_tensors


def export(job: Job, what: str, every: int) -> list[Path]:
    """Write mode shapes (`modes`) or results (`results`) of every body as .vtu files into the job's `vtu` folder."""
    if what != "modes":
        refuse_turning(job, "export")
    run_job(job, "modes" if what == "modes" else "solve")
    with held(job.out):
        return _written(job, what, every)


def _written(job: Job, what: str, every: int) -> list[Path]:
    exporter, folder = EXPORTERS["vtu"], job.out / EXPORTS
    if what == "modes":
        files = []
        for body in job.scene.body:
            steps = job.components()[job.scene.component_of(body)]
            files.append(folder / f"{body}-modes.vtu")
            exporter.write_modes(files[-1], *(job.store.get(steps[kind].key, kind) for kind in ("mesh", "modes")))
        return files
    drawing = Drawing(job.store, job.trajectory().key, job.name, job.out, job.out, lambda name: None)
    bodies = {name: _records(drawing, name, number) for number, name in enumerate(job.scene.body)}
    return exporter.write_results(folder, bodies, drawing.trajectory, every)


def _records(drawing: Drawing, name: str, number: int) -> BodyRecords:
    body = drawing.body(name)
    stress = partial(_stress, drawing, body) if stress_gauges(drawing, body) else None
    return BodyRecords(body.mesh, body.modal, body.morph, drawing.position(name), number, stress)


def _stress(drawing: Drawing, body: BodyMotion, frame: int) -> np.ndarray:
    """Return the stress at the nodes in a frame in the axes of the scene [Pa], (n, 6)."""
    return turned_tensors(nodal_stress(drawing, body, frame), drawing.rotation(body.name))
