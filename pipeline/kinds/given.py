"""Scenes as Python gives them, a path, a mapping of tables or a model: each becomes tables, and the name of their file.

Relative names of files start at the current folder, of a model that was read at the folder of its file.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from gudgeon.modaldb.keys import text_key
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import DEFAULT_OUT, results_folder, scene_path, usable_path
from gudgeon.pipeline.scenes.reading import changed_tables, given_tables, read_tables

MAPPING = "<mapping>"
"""In place of the name of a file, of a scene that has none."""
DIGITS = 8
"""Of the digest of a mapping in the name of the folder of its results."""
OBJECTS = "geometry"
"""Folder of the meshes and matrices that a mapping holds."""

Given = str | Path | Mapping[str, Any] | BaseModel
"""A scene: its folder or TOML file, its tables as `tomllib` returns them, or a model of them, `gudgeon.Scene`."""


def tables_of(scene: Given, overrides: Sequence[str], out: str | Path | None) -> tuple[str, Path, dict[str, Any], Path]:
    """Return name, file, tables with overrides applied, and folder of the results of a scene.

    Raises:
        InputError: there is no such scene, it is none, or an override has no `=`.
    """
    if isinstance(scene, str | Path):
        path = scene_path(scene)
        folder = path.parent.resolve().name
        name = folder if path.name == "scene.toml" else path.stem
        return name, path, read_tables(path, overrides), results_folder(path, out)
    base = Path(DEFAULT_OUT) / Path.cwd().name if out is None else usable_path(out)
    if isinstance(scene, BaseModel):
        path = Path(getattr(scene, "folder", Path())) / MAPPING
        tables: Mapping[str, Any] = scene.model_dump(mode="json", exclude_unset=True)
    elif isinstance(scene, Mapping):
        from gudgeon.pipeline.geometry.objects.files import with_files  # Late: it loads what reads meshes.

        path, tables = Path(MAPPING), with_files(scene, base / OBJECTS, MAPPING)
    else:
        raise InputError(
            f"scene: a {type(scene).__name__} given; allowed: a folder or TOML file, a mapping of tables, or a"
            " gudgeon.Scene"
        )
    changed = changed_tables(given_tables(tables, str(path)), overrides)
    name = f"mapping-{text_key(json.dumps(changed, sort_keys=True, default=str))[:DIGITS]}"
    return name, path, changed, base / name if out is None else base
