"""The mesh stage: from a component's geometry to a MeshRecord, and the movement of its surface by a design change."""

from pathlib import Path

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.design_change.morph import Movement
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.scenes.change import deviation_of
from gudgeon.pipeline.scenes.component import Component, Meshed
from gudgeon.pipeline.scenes.reading import find_file
from gudgeon.pipeline.stages.run_report import Progress

LARGEST = 10.0
"""Ratio of mesh.size and a part's largest extent above which its unit is mistaken."""


def build_mesh(
    component: Meshed, folder: Path, name: str, table: str = "component", tell: Progress = lambda stage, fraction: None
) -> MeshRecord:
    """Mesh a part, or read its mesh file; relative paths start at the scene's folder.

    Args:
        table: The scene's table of such parts, for messages.
        tell: Called with what the mesh of a CAD part needs by an estimate, before it is made.

    Raises:
        InputError: the size is missing, or the file is not readable.
        StageError: gmsh failed.
    """
    geometry = component.geometry
    paths = {
        key: str(find_file(file, folder, f"{table}.{name}.geometry.{key}")) for key, file in component.files.items()
    }
    geometry = geometry.model_copy(update=paths)
    if (
        geometry.kind == "file"
        or geometry.kind == "plane-file"
        or geometry.kind == "matrices"
        or geometry.kind == "rigid"
    ):
        return geometry.build(None)
    size = component.mesh.size
    try:
        if geometry.kind == "cad":
            mesh = geometry.build(
                size, component.mesh.nodes, component.places, lambda text: tell(f"mesh ({name}: {text})", 0.0)
            )
        elif size is None:
            raise InputError("mesh.size: is missing; give an edge length [m]")
        else:
            mesh = geometry.build(size)
    except InputError as error:
        if not str(error).startswith("mesh."):
            raise
        raise InputError(f"{table}.{name}.{error}") from error
    except StageError as error:
        raise StageError(f"{table}.{name}.geometry: {error}") from error
    extent = float(np.ptp(mesh.nodes, axis=0).max(initial=0.0))
    if size is not None and size > LARGEST * extent > 0:
        raise InputError(
            f"{table}.{name}.mesh.size: {size:g} m given; allowed: up to {LARGEST:g} times the part's"
            f" largest extent, {extent:.3g} m; lengths are in metres, {1e-3 * size:g} for"
            f" {size:g} mm"
        )
    return mesh


def movement_of(component: Component, folder: Path, name: str, key: str = "profile") -> Movement | None:
    """Return the movement of a component's nodes; None if nothing moves them.

    Args:
        key: The profile's key in the change, for messages.
    """
    moved, growth = deviation_of(component, folder, name, key), component.change.growth
    if moved is None and not growth:
        return None
    surface, deviation = moved or (None, 0.0)
    return Movement(surface, deviation, f"component.{name}.change.{key}", growth)
