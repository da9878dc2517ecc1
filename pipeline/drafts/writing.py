"""What drafts of all kinds of files share: their folder, names, speed and duration, and the size of elements."""

import math
import re
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gudgeon.pipeline.drafts.faces import Look
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cad.part import CadPart, Places
from gudgeon.pipeline.geometry.mesh_estimate import cost_text

ELEMENTS = 3000
"""About as many a draft's mesh has."""
SUPPORTS = 1e-6
"""How far the part may lie beyond a face on which it can stand, by its extent."""
SPEED = 1.0
"""Of the throw [m/s]."""
GAP, SOON = 1e-5, 0.05
"""Distance from the plane at the start [m], and the largest share of the duration before the impact."""
PASSAGES = 20
"""Duration, in passages of a longitudinal wave along the part."""
WAVE = math.sqrt(210e9 / 7850.0)
"""Its speed [m/s] in the draft's steel."""
COLUMN = 52
"""Of comments."""


def free_folder(file: str, folder: Path | None) -> Path:
    """Return the folder of a draft of a file.

    Raises:
        InputError: it exists.
    """
    folder = folder or Path(Path(file).stem)
    if folder.exists():
        raise InputError(f"new: {folder} exists; name another folder, as in `--folder {folder}-2`")
    return folder


def write_scene(file: str, files: Sequence[str], folder: Path, text: str) -> None:
    """Write a folder with a scene and copies of the files that it reads.

    Args:
        file: That the draft is of.
        files: It, and others that it names, whose places from its folder are kept.

    Raises:
        InputError: the folder cannot be written, or a file is outside the folder of the first.
    """
    base = Path(file).parent.resolve()
    try:
        folder.mkdir(parents=True)
        for name in files:
            path = Path(name).resolve()
            if not path.is_relative_to(base):
                raise InputError(f"new: {file} names {name}, which is not in its folder; allowed: files in it or below")
            target = folder / path.relative_to(base)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
        (folder / "scene.toml").write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"new: {error.filename or folder}: {error.strerror or error}") from error


def mesh_line(look: Look, solids: Sequence[str | int], acted: str) -> tuple[float, str]:
    """Return the edge length of a part's mesh [m] and its line of a scene, with what the mesh needs.

    The size gives about `ELEMENTS` elements where nothing is curved, and thin walls of one element; it is larger where
    that would be more nodes than mesh.nodes allows.

    Args:
        acted: Surface that meets the plane.
    """
    area = sum(face.area for face in look.faces)
    size = max((5.0 * volume_of(look) / ELEMENTS) ** (1 / 3), (4.0 * area / ELEMENTS) ** 0.5)
    cad = CadPart(kind="cad", path=look.path, unit=look.given_unit, solids=tuple(solids))
    size, nodes = cad.size_within(float(f"{size:.2g}"), acted_on=Places((acted,)))
    return size, f"mesh = {{ size = {size:.2g} }}  # edge length [m]; its modes need {cost_text('solid', nodes)}"


def mesh_notes(text: str) -> list[str]:
    """Return what the meshes of a scene need by its comments."""
    return re.findall(r"its (modes need about .*)", text)


def volume_of(look: Look) -> float:
    """Return the volume of a part [m^3], by its flat triangles where gmsh's own kernel has none."""
    if math.isfinite(look.volume):
        return look.volume
    a, b, c = np.moveaxis(look.points[look.triangles], 1, 0)
    return abs(float(np.einsum("ti,ti->", a, np.cross(b, c)))) / 6


def aligned(line: str) -> str:
    """Return a line of a scene with its comment, which follows two spaces, at the column of all comments."""
    code, separator, comment = line.rpartition("  # ")
    return f"{code:{COLUMN}}  # {comment}" if separator else line


def toml_name(stem: str) -> str:
    """Return a name of a component and a body that TOML needs no quotes for."""
    name = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "-" for c in stem).strip("-")
    return name or "part"
