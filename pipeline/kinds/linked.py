"""Jobs of scenes of bodies: contacts by proximity are found, and grids of poses that fields name, or computed first."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import find_file, merged, named, read_tables
from gudgeon.pipeline.stages.base import Place
from gudgeon.pipeline.stages.job import Job, contact_job
from gudgeon.pipeline.stages.run_report import Progress, RunReport
from gudgeon.solver.scene.contact import AUTO

if TYPE_CHECKING:
    from gudgeon.pipeline.applications.electrostatics.job import FieldJob

WITHOUT = ("mesh", "modes")
"""Stages that no field takes part in."""


def body_job(place: Place) -> Job:
    """Return the job of a scene of bodies, with the keys of the grids of poses that its forces name.

    Raises:
        InputError: a mistake in it, every one listed, or in a scene of conductors that it names.
    """
    place, lines = _with_found(place)
    keys: dict[str, Any] = {}
    for name, fields in _fields(place).items():
        (product,) = fields.pose_grid().values()
        keys[name] = {"record": product.key}
    return replace(contact_job(place if not keys else _with(place, {"force": keys})), found=lines)


def _with_found(place: Place) -> tuple[Place, tuple[str, ...]]:
    """Return a scene with the interfaces that it leaves to be found, and a line for each of its contacts with them."""
    contacts = place.tables.get("contact")
    sides = [one for one in contacts.values() if isinstance(one, dict)] if isinstance(contacts, dict) else []
    sides += [one["against"] for one in sides if isinstance(one.get("against"), dict)]
    if AUTO not in (one.get("interface") for one in sides):
        return place, ()
    from gudgeon.pipeline.drafts.proximity import with_found  # Here: only scenes with it load what meshes parts.

    return with_found(place)


def _with(place: Place, changes: Mapping[str, Any]) -> Place:
    return Place(place.name, place.path, merged(place.tables, changes), place.store, place.out, place.overrides)


def _fields(place: Place) -> dict[str, "FieldJob"]:
    """Return the scene of conductors of each force that names one."""
    found, forces = {}, place.tables.get("force")
    for name, one in forces.items() if isinstance(forces, dict) else ():
        if isinstance(one, dict) and one.get("kind") == "electrostatic" and isinstance(one.get("field"), str):
            with named(place.path, InputError):
                found[name] = _field(place, f"force.{name}", one["field"])
    return found


def _field(place: Place, where: str, file: str) -> "FieldJob":
    # Here: only scenes that name a field import it.
    from gudgeon.pipeline.applications.electrostatics.job import field_job

    path = find_file(file, place.path.parent, f"{where}.field")
    tables = read_tables(path)
    if "conductor" not in tables:
        raise InputError(f"{where}.field: {file} is no scene of conductors; it has no table [conductor.NAME]")
    if "poses" not in tables:
        raise InputError(f"{where}.field: {file} has no table [poses], the grid over which its force is known")
    return field_job(Place(path.stem, path, tables, place.store, place.out / path.stem))


def ensure(job: Job, progress: Progress | None = None) -> None:
    """Compute the grids of poses that a scene names and that the database has not.

    Raises:
        InputError: conductors overlap, or a grid would take longer than its poses.hours.
        StageError: a numerical routine failed.
    """
    for field in _fields(job).values():
        (product,) = field.pose_grid().values()
        if not job.store.has(product.key):
            from gudgeon.pipeline.applications.electrostatics.stages import compute_poses

            compute_poses(field, progress=progress)


def run_bodies(job: Job, until: str = "plot", progress: Progress | None = None) -> RunReport:
    """Compute the records of a job that are missing, those of its fields before; see `kinds.run`."""
    from gudgeon.pipeline.stages.run import run_job

    if until not in WITHOUT:
        ensure(job, progress)
    return run_job(job, until, progress)


def solve_bodies(job: Job, until: str = "solve", progress: Progress | None = None) -> RunReport:
    """Compute the records of a job that are missing, without its folder of results; see `Kind.solve`."""
    from gudgeon.pipeline.stages.run import solve_records

    if until not in WITHOUT:
        ensure(job, progress)
    return solve_records(job, until, progress)
