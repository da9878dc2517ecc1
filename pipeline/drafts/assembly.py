"""A first scene of an assembly of a CAD file: a component and a body for each solid, where the file has it."""

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gudgeon.pipeline.drafts.bodies import STEEL, Flat, Placed, Solid, scene_text, text
from gudgeon.pipeline.drafts.faces import Look, look_at
from gudgeon.pipeline.drafts.writing import mesh_line, toml_name
from gudgeon.pipeline.geometry.decks.axes import Axes


def assembly_text(file: str, unit: float | None, names: Mapping[int, str], folder: Path) -> tuple[str, list[str]]:
    """Return the text of a scene of all solids of a file, and what is to be said of it.

    Args:
        file: STEP, IGES or BREP.
        unit: Metres per unit of length; None: as the file states.
        names: Of its solids by tag.
        folder: Of the scene.

    Raises:
        InputError: a solid is none that can be meshed.
        StageError: gmsh failed.
    """
    counts = Counter(names.values())
    bodies, notes, taken = list[Placed](), list[str](), set[str]()
    for tag, name in names.items():
        chosen = name if name and counts[name] == 1 else tag
        look = look_at(file, unit, [chosen], None)
        notes += [note for note in look.notes if note not in notes]
        label = toml_name(name) if name else f"solid{tag}"
        label = label if label not in taken else f"{label}-{tag}"
        taken.add(label)
        bodies.append(Placed(label, _solid(look, label, chosen, unit), Axes()))
    title = Path(file).name
    summary = [f"{title}: {len(bodies)} solids, a component each, where the file has them.",
               f"`gudgeon faces {title} --solid NAME` lists the faces of one, which its surfaces name."]  # fmt: skip
    return scene_text(title, summary, bodies), notes


def _solid(look: Look, name: str, chosen: str | int, unit: float | None) -> Solid:
    """Return the component of one solid; its faces have their numbers as names."""
    flats = [
        Flat(f"face{face.number}", np.array(face.shape["normal"]),
             float(np.dot(face.shape["origin"], face.shape["normal"])), face.area)
        for face in look.faces if face.kind == "plane"
    ]  # fmt: skip
    geometry = ['kind = "cad"', f"path = {text(Path(look.path).name)}"]
    geometry += [f"solids = {json.dumps([chosen], ensure_ascii=False)}"]
    geometry += [] if unit is None else [f"unit = {unit:g}"]
    largest = max(flats, key=lambda flat: flat.area, default=None)
    _, mesh = mesh_line(look, [chosen], "" if largest is None else largest.surface)
    return Solid(name, geometry, STEEL, mesh, look.points, flats)
