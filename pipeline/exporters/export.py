"""`gudgeon export`: a scene's mode shapes or results as .vtu files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.exporters import EXPORTERS
from gudgeon.pipeline.exporters.vtu import BodyRecords
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.stress import (
    READ,
    friction_contacts,
    left_out,
    nodal_stress,
    row_forces,
    stress_gauges,
)
from gudgeon.pipeline.reduction.reduce import truncated_displacement
from gudgeon.pipeline.stages.folder import EXPORTS, held
from gudgeon.pipeline.stages.job import Job, refuse_turning
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.bodies.placing import turned_tensors, unturned_forces
from gudgeon.solver.methods import METHODS

Note = Callable[[str], object]
"""Receives what is to be said of the files."""


def export(job: Job, content: str, every: int, note: Note = lambda text: None) -> list[Path]:
    """Write mode shapes (`modes`) or results (`results`) of every body as .vtu files into the job's `vtu` folder.

    A body whose forces are not known at frames has no stress in its files, nor the displacement that its kept modes
    lack, which is noted.
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
    bodies = {name: _records(job, drawing, name, body_id, note) for body_id, name in enumerate(job.scene.body)}
    return exporter.write_results(folder, bodies, drawing.trajectory, every)


def _records(job: Job, drawing: Drawing, name: str, body_id: int, note: Note) -> BodyRecords:
    body = drawing.body(name)
    stress = _stress(drawing, body, note) if stress_gauges(drawing, body) else None
    truncated = _truncated(job, drawing, body, note)
    return BodyRecords(
        body.mesh, body.modal, body.morph, drawing.position(name), body_id, stress=stress, truncated=truncated
    )


def _truncated(job: Job, drawing: Drawing, body: BodyMotion, note: Note) -> Callable[[int], np.ndarray] | None:
    """Return a function of the frame: the static displacement at the nodes that the kept modes lack, in the axes of the
    scene [m], (n, 3); None where the run has none, nothing acts, or forces are not known."""
    if "residual_flexibility" not in drawing.store.sizes(body.morph.modes_key):
        return None
    modal = drawing.modes(body.name, READ)
    try:
        forces = row_forces(drawing, body, modal, lambda name: METHODS[job.scene.contact[name].method].flexible)
    except StageError as error:
        note(
            f"displacement of body {body.name} is that of its {len(body.modal.angular_frequencies)} kept coordinates"
            f" alone, without the residual flexibility: {error}; a probe has both"
        )
        return None
    if rough := friction_contacts(drawing, body, modal):
        note(f"displacement of body {body.name} is written without the local part of friction at {', '.join(rough)}")
    if not forces.any():
        return None
    component, Q = job.scene.component_of(body.name), drawing.rotation(body.name)
    unturned = job.store.get(body.morph.modes_key, "modes", only=[*READ, "shapes", "angular_frequencies", "interfaces"])
    mesh = job.store.get(body.morph.mesh_key, "mesh")
    displaced = truncated_displacement(mesh, job.scene.component[component], component, unturned)
    forces = unturned_forces(unturned, forces, Q)
    return lambda frame: displaced(forces[frame]) @ (np.eye(3) if Q is None else Q.T)


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
