"""Jobs of scenes of bodies: contacts by proximity are found, and the scenes of fields that forces name are opened."""

from dataclasses import replace
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds.applications import CONDUCTORS
from gudgeon.pipeline.scenes.reading import find_file, merged, named, read_tables
from gudgeon.pipeline.stages.base import Place, SceneJob
from gudgeon.pipeline.stages.job import Job, contact_job
from gudgeon.solver.scene.contact import AUTO


def body_job(place: Place) -> Job:
    """Return the job of a scene of bodies, with the keys of the grids of poses that its forces name.

    Raises:
        InputError: a mistake in it, every one listed, or in a scene of conductors that it names.
    """
    place, lines = _with_found(place)
    linked = _fields(place)
    keys: dict[str, Any] = {}
    for name, field in linked.items():
        (product,) = field.products(["poses"]).values()
        keys[name] = {"record": product.key}
    if keys:
        place = replace(place, tables=merged(place.tables, {"force": keys}))
    return replace(contact_job(place), found=lines, linked=tuple(linked.values()))


def _with_found(place: Place) -> tuple[Place, tuple[str, ...]]:
    """Return a scene with the interfaces that it leaves to be found, and a line for each of its contacts with them."""
    contacts = place.tables.get("contact")
    sides = [one for one in contacts.values() if isinstance(one, dict)] if isinstance(contacts, dict) else []
    sides += [one["against"] for one in sides if isinstance(one.get("against"), dict)]
    if AUTO not in (one.get("interface") for one in sides):
        return place, ()
    from gudgeon.pipeline.drafts.proximity import with_found  # Here: only scenes with it load what meshes parts.

    return with_found(place)


def _fields(place: Place) -> dict[str, SceneJob]:
    """Return the scene of conductors of each force that names one."""
    found, forces = {}, place.tables.get("force")
    for name, one in forces.items() if isinstance(forces, dict) else ():
        if isinstance(one, dict) and one.get("kind") == "electrostatic" and isinstance(one.get("field"), str):
            with named(place.path, InputError):
                found[name] = _field(place, f"force.{name}", one["field"])
    return found


def _field(place: Place, where: str, file: str) -> SceneJob:
    path = find_file(file, place.path.parent, f"{where}.field")
    tables = read_tables(path)
    if "conductor" not in tables:
        raise InputError(f"{where}.field: {file} is no scene of conductors; it has no table [conductor.NAME]")
    if "poses" not in tables:
        raise InputError(f"{where}.field: {file} has no table [poses], the grid over which its force is known")
    return CONDUCTORS.open(Place(CONDUCTORS, path.stem, path, tables, place.store, place.out / path.stem))
