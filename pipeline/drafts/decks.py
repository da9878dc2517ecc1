"""A first scene of a deck or a mesh file: a component for each part, a body for each instance."""

from pathlib import Path

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.drafts.bodies import STEEL, Flat, Placed, Solid, scene_text, text
from gudgeon.pipeline.drafts.deck_materials import material_table
from gudgeon.pipeline.drafts.writing import free_folder, toml_name, write_scene
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import FACETS, blocks_of
from gudgeon.pipeline.geometry.decks.abaqus.deck import instances_of
from gudgeon.pipeline.geometry.decks.axes import Axes
from gudgeon.pipeline.geometry.decks.included import included_files
from gudgeon.pipeline.geometry.decks.naming import Omissible
from gudgeon.pipeline.geometry.decks.separate import bodies_of
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from gudgeon.pipeline.scenes.material import Material

MOST_OMISSIONS = 50
"""Kinds of things in a deck that a body does not have."""
TONNES = 1000.0
SI, MILLIMETRES = (1.0, None), (1e-3, TONNES)
"""Metres and kilograms per unit of length and mass, None where the file's densities are in kg/m^3."""


def write_deck_draft(file: str, unit: float | None, folder: Path | None) -> tuple[Path, list[str]]:
    """Write a folder with a scene of all bodies of a deck or a mesh file, and copies of its files.

    Args:
        file: The deck.
        unit: Metres per unit of length; None: 1, or 0.001 where the deck's materials are in mm, t and s.
        folder: That is new; default: the name of the file.

    Returns:
        The folder, and a line for each kind of things that the bodies do not have.

    Raises:
        InputError: the file has no solids, or the folder exists or cannot be written.
    """
    folder = free_folder(file, folder)
    if not Path(file).is_file():
        raise InputError(f"{file}: no such file")
    instances = instances_of(file) if Path(file).suffix.lower() == ".inp" else {}
    solids: dict[str, Solid] = {}
    notes: list[str] = []
    if not instances:
        try:
            solids[""], notes = _solid(file, "", unit)
        except InputError:
            whole = MeshFile.model_validate({"kind": "file", "path": file}).deck()
            instances = {name: (name, Axes()) for name in bodies_of(whole)}
            if not instances:
                raise
    for part_name in dict.fromkeys(name for name, _ in instances.values()):
        solids[part_name], lines = _solid(file, part_name, unit)
        notes += lines
    bodies = [
        Placed(toml_name(name), solids[part_name], Axes(axes.turn, solids[part_name].unit * axes.origin))
        for name, (part_name, axes) in instances.items()
    ] or [Placed(solids[""].name, solids[""], Axes())]
    title = Path(file).name
    names = ", ".join(body.name for body in bodies)
    summary = [f"{title}: {len(bodies)} bod{'ies' if len(bodies) > 1 else 'y'}, {names}.",
               f"`gudgeon mesh {folder.name}` prints their mass, extents and named surfaces."]  # fmt: skip
    write_scene(file, [file, *included_files(file)], folder, scene_text(title, summary, bodies))
    return folder, notes


def _solid(file: str, part_name: str, unit: float | None) -> tuple[Solid, list[str]]:
    """Return the component of a part, and a line for what it does not have."""
    keys: dict[str, object] = {"kind": "file", "path": file, **({"part": part_name} if part_name else {})}
    mesh, keys, material = _read(keys, unit)
    leave_out = keys.get("leave_out", [])
    assert isinstance(leave_out, list)
    note = f"{file}: {part_name or 'the body'} has nothing in place of {', '.join(leave_out)} (leave_out)"
    lines = [f"{key} = {_value(value)}" for key, value in (keys | {"path": Path(file).name}).items()]
    flats = [flat for name, surface in mesh.surfaces.items() if (flat := _flat(mesh, name, surface.facets)) is not None]
    scale = keys.get("unit", 1.0)
    assert isinstance(scale, float)
    name = toml_name(part_name or Path(file).stem)
    solid = Solid(name, lines, material, mesh="", points=mesh.nodes, flats=flats, unit=scale)
    return solid, [note] if leave_out else []


def _read(keys: dict[str, object], unit: float | None) -> tuple[MeshRecord, dict[str, object], str]:
    """Return the mesh of a part, the keys by which it was read, and the value of its material, empty of the deck's."""
    choices = [SI, MILLIMETRES] if unit is None else [(unit, None), (unit, TONNES)]
    for length, mass in choices:
        units: dict[str, object] = {"unit": length} if length != 1.0 else {}
        units |= {} if mass is None else {"mass_unit": mass}
        try:
            Material.model_validate(material_table(MeshFile.model_validate(keys | units), "new"))
        except (InputError, ValueError):  # Of other units, or of none: the draft has steel.
            continue
        return _built(keys | units | {"materials": True}, "")
    return _built(keys | {"unit": unit if unit is not None else _stated_unit(keys)}, STEEL)


def _stated_unit(keys: dict[str, object]) -> float:
    """Return the unit of length that a file states [m].

    Raises:
        InputError: it states none.
    """
    stated = MeshFile.model_validate(keys).deck().length_unit
    if stated is None:
        raise InputError(f"{keys['path']}: neither the file nor its materials tell its unit of length; --unit states"
                         " the metres per unit, 0.001 for mm")  # fmt: skip
    return stated[1]


def _built(keys: dict[str, object], material: str) -> tuple[MeshRecord, dict[str, object], str]:
    leave_out: list[str] = []
    for _ in range(MOST_OMISSIONS):
        omitted: dict[str, object] = {"leave_out": leave_out} if leave_out else {}
        try:
            return MeshFile.model_validate(keys | omitted).build(None), keys | omitted, material
        except Omissible as error:
            leave_out = [*leave_out, *error.keywords]
    raise InputError(f"{keys['path']}: more than {MOST_OMISSIONS} kinds of things are not taken over")


def _value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(text(str(item)) for item in value)}]  # what the deck has and the body shall not have"
    return text(value) if isinstance(value, str) else f"{value:g}"


def _flat(mesh: MeshRecord, name: str, facets: np.ndarray) -> Flat | None:
    """Return a surface that is a plane, None of another one."""
    shape = mesh.surfaces[name].shape
    if shape.get("kind") != "plane" or not len(facets):
        return None
    normal = np.zeros(3)
    for block in blocks_of(facets, FACETS):
        corners = mesh.nodes[block.nodes[:, : block.cell.shape.corners]]
        for k in range(1, corners.shape[1] - 1):
            normal += 0.5 * np.cross(corners[:, k] - corners[:, 0], corners[:, k + 1] - corners[:, 0]).sum(axis=0)
    area = float(np.linalg.norm(normal))
    return Flat(name, normal / area, float(mesh.nodes[facets[0, 0]] @ normal) / area, area) if area > 0 else None
