"""Jobs of scenes of bodies: contacts by proximity are found, and the scenes of fields that forces name are opened."""

from dataclasses import replace
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds.applications import CONDUCTORS
from gudgeon.pipeline.scenes.reading import find_file, merged, named, read_tables
from gudgeon.pipeline.stages.base import Place, SceneJob
from gudgeon.pipeline.stages.job import Job, contact_job
from gudgeon.solver.scene.contact import AUTO


def body_job(scene_place: Place) -> Job:
    """Return the job of a scene of bodies, with the keys of the grids of poses that its forces name.

    Raises:
        InputError: a mistake in it, every one listed, or in a scene of conductors that it names.
    """
    scene_place, lines = _with_found(_with_materials(scene_place))
    linked = _fields(scene_place)
    keys: dict[str, Any] = {}
    for name, field in linked.items():
        (product,) = field.products(["poses"]).values()
        keys[name] = {"record": product.key}
    if keys:
        scene_place = replace(scene_place, tables=merged(scene_place.tables, {"force": keys}))
    return replace(contact_job(scene_place), found=lines, linked=tuple(linked.values()))


def _with_materials(scene_place: Place) -> Place:
    """Return a scene whose components have the materials of the decks from which they take them."""
    components = scene_place.tables.get("component")
    geometries = (
        [c.get("geometry") for c in components.values() if isinstance(c, dict)] if isinstance(components, dict) else []
    )
    if not any(isinstance(geometry, dict) and geometry.get("materials") is True for geometry in geometries):
        return scene_place
    from gudgeon.pipeline.drafts.deck_materials import with_materials  # Here: only scenes with it read decks first.

    return with_materials(scene_place)


def _with_found(scene_place: Place) -> tuple[Place, tuple[str, ...]]:
    """Return a scene with the interfaces that it leaves to be found, and a line for each of its contacts with them."""
    contacts = scene_place.tables.get("contact")
    sides = [s for s in contacts.values() if isinstance(s, dict)] if isinstance(contacts, dict) else []
    sides += [s["against"] for s in sides if isinstance(s.get("against"), dict)]
    if AUTO not in (s.get("interface") for s in sides):
        return scene_place, ()
    from gudgeon.pipeline.drafts.proximity import with_found  # Here: only scenes with it load what meshes parts.

    return with_found(scene_place)


def _fields(scene_place: Place) -> dict[str, SceneJob]:
    """Return the scene of conductors of each force that names one."""
    jobs, forces = {}, scene_place.tables.get("force")
    for name, force in forces.items() if isinstance(forces, dict) else ():
        if isinstance(force, dict) and force.get("kind") == "electrostatic" and isinstance(force.get("field"), str):
            with named(scene_place.path, InputError):
                jobs[name] = _field(scene_place, f"force.{name}", force["field"])
    return jobs


def _field(scene_place: Place, key: str, file: str) -> SceneJob:
    path = find_file(file, scene_place.path.parent, f"{key}.field")
    tables = read_tables(path)
    if "conductor" not in tables:
        raise InputError(f"{key}.field: {file} is no scene of conductors; it has no table [conductor.NAME]")
    if "poses" not in tables:
        raise InputError(f"{key}.field: {file} has no table [poses], the grid over which its force is known")
    return CONDUCTORS.open(Place(CONDUCTORS, path.stem, path, tables, scene_place.store, scene_place.out / path.stem))
