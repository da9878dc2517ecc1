"""Reading of CAD files by gmsh's OpenCASCADE: solids by name or number, and what is refused."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cad.units import kind_of_file
from gudgeon.pipeline.geometry.occ import meshing, read_file
from gudgeon.pipeline.geometry.quiet import quiet_stdout
from gudgeon.pipeline.process.call import at_most

SEWN = (1e-6, 1e-5, 1e-4)
"""Gaps between faces that are closed where a file has faces and no solid, by its extent."""
LEAST_VOLUME = 1e-7
"""Of a solid, by its extent cubed."""
SHOWN = 8
"""Faces or solids that a message lists."""
LEAST_SECONDS, SECONDS_PER_BYTE = 5.0, 3e-5
"""CPU time after which a file is not read to its end: OpenCASCADE takes up to 1e-6 s a byte, and waits without end for
what is missing from a BREP file."""
COMMANDS = re.compile(
    r"\b(SystemCall|NonBlockingSystemCall|OnelabRun|Include|Merge|MergeWithBoundingBox|ShapeFromFile|Save|Print|Exit|"
    r"Abort|Plugin)\b"
)
"""Commands of scripts that start programs, read or write other files, or end the process."""
WRITES = re.compile(r"\)\s*>{1,2}\s*[\"A-Za-z]")
"""`Printf("…") > "file"`."""
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/|\"[^\"]*\"", re.DOTALL)


def read_solids(gmsh: Any, path: str, requested: Sequence[str | int]) -> list[int]:
    """Load a CAD file into gmsh's model, drop the solids that are not wanted, and return the numbers of the others.

    Several solids are glued where they touch: their meshes have the same nodes there.

    Raises:
        InputError: the file is missing or damaged, has an open shell or a solid without volume, or no such solid.
    """
    if not Path(path).is_file():
        raise InputError(f"{path}: no such file")
    kind = kind_of_file(path)
    if kind == "gmsh script":
        _refuse_commands(path)
    try:
        with quiet_stdout():
            _load(gmsh, path, kind)
    except InputError:
        raise
    except Exception as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{path}: cannot be read as {kind} ({reason})") from error
    every = [tag for _, tag in gmsh.model.getEntities(3)]
    if not every:
        raise InputError(f"{path}: has no solid{'' if gmsh.model.getEntities(2) else ' and no face'}; allowed: solids")
    _refuse_flat(gmsh, path, every)
    _refuse_loose(gmsh, path)
    chosen = chosen_solids(gmsh, path, requested, every)
    if len(chosen) < len(every):
        _drop(gmsh, [tag for tag in every if tag not in chosen])
    if len(chosen) > 1 and gmsh.model.occ.getEntities(3):
        chosen = _glued(gmsh, path, chosen)
    return chosen


def solid_name(gmsh: Any, tag: int) -> str:
    """Return a solid's name in its file: of its physical group, or the last part of its path through the assembly."""
    if len(groups := gmsh.model.getPhysicalGroupsForEntity(3, tag)):
        return str(gmsh.model.getPhysicalName(3, groups[0]))
    path = gmsh.model.getEntityName(3, tag).removeprefix("Shapes/")
    return re.sub(r"( & ?)+\d*$", "", path.rpartition("/")[2]).strip()


def solid_volume(gmsh: Any, tag: int) -> float:
    """Return the volume of a solid in the model's unit cubed, by OpenCASCADE; NaN for gmsh's own kernel."""
    try:
        return float(gmsh.model.occ.getMass(3, tag))
    except Exception:  # gmsh raises bare Exceptions
        return math.nan


def solid_names(path: str) -> dict[int, str]:
    """Return the name of each solid of a CAD file by number, empty where it has none.

    Raises:
        InputError: the file is missing or damaged.
        StageError: gmsh failed.
    """
    if not Path(path).is_file():
        raise InputError(f"{path}: no such file")
    with meshing(1.0, {}, path) as gmsh:
        try:
            with quiet_stdout():
                _load(gmsh, path, kind_of_file(path))
        except InputError:
            raise
        except Exception as error:
            raise InputError(f"{path}: cannot be read ({str(error).splitlines()[0]})") from error
        return {tag: solid_name(gmsh, tag) for _, tag in gmsh.model.getEntities(3)}


def _load(gmsh: Any, path: str, kind: str) -> None:
    """Load a script or a file of shapes, whose faces are sewn if it has no solids."""
    if kind == "gmsh script":
        read_file(gmsh, path)
        gmsh.model.occ.synchronize()
        return
    with at_most(LEAST_SECONDS + SECONDS_PER_BYTE * Path(path).stat().st_size):
        gmsh.model.occ.importShapes(path, False)
    gmsh.model.occ.synchronize()
    if not gmsh.model.getEntities(3) and gmsh.model.getEntities(2):
        _sew(gmsh, path)


def chosen_solids(gmsh: Any, path: str, requested: Sequence[str | int], every: list[int]) -> list[int]:
    """Return the numbers of the wanted solids, all for none; a name must belong to one solid.

    Raises:
        InputError: there is no such solid, several have the name, or one is wanted twice.
    """
    names = {tag: solid_name(gmsh, tag) for tag in every}
    listed = ", ".join(f"{tag} '{name}'" if name else str(tag) for tag, name in list(names.items())[:SHOWN])
    listed += f" and {len(every) - SHOWN} more" if len(every) > SHOWN else ""
    chosen: list[int] = []
    for solid in requested:
        tags = [solid] if solid in names else [tag for tag, name in names.items() if name and name == solid]
        if len(tags) != 1:
            many = f"{len(tags)} solids have this name ({', '.join(map(str, tags))}), give a number; " if tags else ""
            raise InputError(f"{path}: solids: {solid!r} given; {many}the file has {listed}")
        if tags[0] in chosen:
            raise InputError(f"{path}: solids: solid {tags[0]} given twice")
        chosen += tags
    return chosen or every


def _sew(gmsh: Any, path: str) -> None:
    """Sew faces to solids with growing tolerance; refuse faces that do not close."""
    low, high = gmsh.model.getBoundingBox(-1, -1)[:3], gmsh.model.getBoundingBox(-1, -1)[3:]
    extent = math.dist(low, high)
    for fraction in SEWN:
        gmsh.model.occ.healShapes([], fraction * extent, True, True, True, True, True)
        gmsh.model.occ.synchronize()
        if gmsh.model.getEntities(3):
            return
    raise InputError(f"{path}: open shell: {_open_faces(gmsh)}; allowed: closed solids")


def _open_faces(gmsh: Any) -> str:
    """Return the faces with an edge that no other face shares, as text."""
    faces = sorted(
        {
            int(up[0])
            for _, edge in gmsh.model.getEntities(1)
            if len(up := gmsh.model.getAdjacencies(1, edge)[0]) == 1 and not _is_seam(gmsh, int(up[0]), edge)
        }
    )
    shown = ", ".join(map(str, faces[:SHOWN])) + (f" and {len(faces) - SHOWN} more" if len(faces) > SHOWN else "")
    return f"faces {shown} have edges that no other face shares" if faces else "its faces enclose nothing"


def _is_seam(gmsh: Any, face: int, edge: int) -> bool:
    """Return whether an edge bounds its face twice, as that of a full cylinder, or has no length."""
    around = [abs(tag) for _, tag in gmsh.model.getBoundary([(2, face)], combined=False, oriented=True)]
    return around.count(edge) > 1 or not gmsh.model.getBoundary([(1, edge)])


def _refuse_loose(gmsh: Any, path: str) -> None:
    """Refuse faces that belong to no solid: an open shell beside the solids."""
    loose = [tag for _, tag in gmsh.model.getEntities(2) if not len(gmsh.model.getAdjacencies(2, tag)[0])]
    if loose:
        shown = ", ".join(map(str, loose[:SHOWN])) + (f" and {len(loose) - SHOWN} more" if len(loose) > SHOWN else "")
        raise InputError(f"{path}: open shell: faces {shown} belong to no solid; allowed: closed solids")


def _refuse_flat(gmsh: Any, path: str, solids: list[int]) -> None:
    for tag in solids:
        box = gmsh.model.getBoundingBox(3, tag)
        volume, extent = solid_volume(gmsh, tag), math.dist(box[:3], box[3:])
        if volume <= LEAST_VOLUME * extent**3:
            raise InputError(
                f"{path}: solid {tag} has a volume of {volume:.3g} at an extent of {extent:.3g}, in its unit of length;"
                f" allowed: above {LEAST_VOLUME:g} × extent³"
            )


def _refuse_commands(path: str) -> None:
    text = COMMENT.sub('""', Path(path).read_text(errors="replace"))
    match = COMMANDS.search(text) or WRITES.search(text)
    if match:
        raise InputError(
            f"{path}: has `{match[0].strip()}`; allowed: scripts that start no program and use no other file"
        )


def _drop(gmsh: Any, solids: list[int]) -> None:
    pairs = [(3, tag) for tag in solids]
    if gmsh.model.occ.getEntities(3):
        gmsh.model.occ.remove(pairs, recursive=True)
        gmsh.model.occ.synchronize()
    else:
        gmsh.model.removeEntities(pairs, recursive=True)


def _glued(gmsh: Any, path: str, solids: list[int]) -> list[int]:
    """Divide the faces of touching solids where they touch, and return the solids, in their order."""
    pairs = [(3, tag) for tag in solids]
    labels = {tag: gmsh.model.getEntityName(3, tag) or solid_name(gmsh, tag) for tag in solids}
    _, images = gmsh.model.occ.fragment(pairs[:1], pairs[1:])
    gmsh.model.occ.synchronize()
    glued = []
    for tag, image in zip(solids, images, strict=True):
        pieces = [piece for dimension, piece in image if dimension == 3]
        shared = [
            solid
            for solid, solid_image in zip(solids, images, strict=True)
            if solid != tag and set(solid_image) & set(image)
        ]
        if shared or len(pieces) != 1:
            raise InputError(
                f"{path}: solids {tag} and {', '.join(map(str, shared))} overlap; allowed: solids that touch"
            )
        gmsh.model.setEntityName(3, pieces[0], labels[tag])
        glued += pieces
    return glued
