"""`gudgeon export`: a scene's mode shapes or results as .vtu files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.exporters import EXPORTERS
from gudgeon.pipeline.exporters.vtu import BodyRecords
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.stress import left_out, nodal_stress, stress_gauges
from gudgeon.pipeline.stages.folder import EXPORTS, held
from gudgeon.pipeline.stages.job import Job, refuse_turning
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.bodies.placing import turned_tensors

Note = Callable[[str], object]
"""Receives what is to be said of the files."""


def export(job: Job, content: str, every: int, note: Note = lambda text: None) -> list[Path]:
    """Write mode shapes (`modes`) or results (`results`) of every body as .vtu files into the job's `vtu` folder.

    A body whose forces are not known at frames has no stress in its files, which is noted.
    """
    if content != "modes":
        refuse_turning(job, "export")
    run_job(job, "modes" if content == "modes" else "solve")
    with held(job.out):
        return _written(job, content, every, note)


def _written(job: Job, content: str, every: int, note: Note) -> list[Path]:
    exporter, folder = EXPORTERS["vtu"], job.out / EXPORTS
    if content == "modes":
        files = []
        for body in job.scene.body:
            steps = job.components()[job.scene.component_of(body)]
            files.append(folder / f"{body}-modes.vtu")
            exporter.write_modes(files[-1], *(job.store.get(steps[kind].key, kind) for kind in ("mesh", "modes")))
        return files
    drawing = Drawing(job.store, job.trajectory().key, job.name, job.out, job.out, lambda name: None)
    bodies = {name: _records(drawing, name, body_id, note) for body_id, name in enumerate(job.scene.body)}
    return exporter.write_results(folder, bodies, drawing.trajectory, every)


def _records(drawing: Drawing, name: str, body_id: int, note: Note) -> BodyRecords:
    body = drawing.body(name)
    stress = _stress(drawing, body, note) if stress_gauges(drawing, body) else None
    return BodyRecords(body.mesh, body.modal, body.morph, drawing.position(name), body_id, stress)


def _stress(drawing: Drawing, body: BodyMotion, note: Note) -> Callable[[int], np.ndarray] | None:
    """Return a function of the frame: the stress at the nodes in the axes of the scene [Pa], (n, 6); None where it is
    not known."""
    try:
        stress = nodal_stress(drawing, body)
    except StageError as error:
        note(f"stress of body {body.name} was not written: {error}")
        return None
    if lacks := left_out(drawing, body):
        note(f"stress of body {body.name} is written {lacks}")
    return lambda frame: turned_tensors(stress(frame), drawing.rotation(body.name))
