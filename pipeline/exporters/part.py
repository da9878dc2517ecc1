"""`gudgeon export SCENE BODY --format F`: a reduced body as files for another program."""

from collections.abc import Callable
from pathlib import Path

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.exporters import abaqus, exudyn, nastran, numpy_file, uff
from gudgeon.pipeline.exporters.reduced import ReducedBody, reduced_body
from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.interfaces.point_mass import component_model
from gudgeon.pipeline.interfaces.tie import refuse_rigid
from gudgeon.pipeline.stages.folder import held
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job

FORMATS: dict[str, Callable[[ReducedBody, Path], list[Path]]] = {
    "uff": uff.write, "op4": nastran.write, "abaqus": abaqus.write, "npz": numpy_file.write,
}  # fmt: skip
"""Writers of a reduced body into a folder by the name of their format; each returns the files."""
EXUDYN = "exudyn"
"""A format that takes the full matrices of a body as well."""
HEAD = ["row", "name", "unit", "node", "x [m]", "y [m]", "z [m]", "nx", "ny", "nz"]


def export_part(job: Job, name: str, form: str) -> list[Path]:
    """Write a body into the folder `parts` of the results and return the files, the table of its rows last.

    Raises:
        InputError: the scene has no such body, or its component does not suit the format.
    """
    run_job(job, "morph")
    with held(job.out):
        body, folder = reduced_body(job, name), job.out / "parts"
        if form == EXUDYN:
            component = job.scene.component[job.scene.component_of(name)]
            if not (cell_of(body.mesh).solid or body.mesh.system is not None) or component.supports:
                raise InputError(
                    f"{job.path}: export: body '{name}' given; format 'exudyn' needs a free solid, whose frame floats"
                )
            key = f"component.{job.scene.component_of(name)}"
            refuse_rigid({}, body.mesh, key, "format 'exudyn'")
            files = exudyn.write(body, component_model(body.mesh, component, key), folder)
        else:
            files = FORMATS[form](body, folder)
        table = folder / f"{name}-rows.csv"
        rows = [[str(k), row.name, row.unit, str(row.node), *map(repr, map(float, (*row.place, *row.direction)))]
                for k, row in enumerate(body.rows)]  # fmt: skip
        write_text(table, csv_text([HEAD, *rows]))
    return [*files, table]
