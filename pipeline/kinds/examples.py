"""Scenes that come with the package: `gudgeon.examples`, the folder data/ of the repository."""

import difflib
import shutil
from importlib.resources import as_file, files
from importlib.resources.abc import Traversable
from pathlib import Path

from gudgeon.pipeline.errors import InputError

SCENE = "scene.toml"


def examples() -> dict[str, str]:
    """Return the first sentence of each folder's first scene by the folder's name."""
    return {name: _title(_scenes(folder)[0]) for name, folder in sorted(_folders().items())}


def copy_example(name: str, target: Path | None) -> Path:
    """Copy a scene's folder to `target`, `./<name>` for None, and return the new folder.

    Raises:
        InputError: there is no such scene, or the target exists or cannot be written.
    """
    folders, target = _folders(), target or Path(name)
    if name not in folders:
        close = difflib.get_close_matches(name, folders, 1)
        meant = f"did you mean '{close[0]}'?" if close else f"there are {', '.join(sorted(folders))}"
        raise InputError(f"example copy: no scene '{name}'; {meant}")
    if target.exists():
        raise InputError(f"example copy: {target} exists; name another folder")
    try:
        with as_file(folders[name]) as source:
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__", "*.py"))
    except OSError as error:
        raise InputError(f"example copy: {error.filename or target}: {error.strerror or error}") from error
    return target


def _folders() -> dict[str, Traversable]:
    return {folder.name: folder for folder in files("gudgeon.examples").iterdir() if _scenes(folder)}


def _scenes(folder: Traversable) -> list[Traversable]:
    """Return the scene files of a folder, `scene.toml` and short names first."""
    scenes = [file for file in folder.iterdir() if file.name.endswith(".toml")] if folder.is_dir() else []
    return sorted(scenes, key=lambda file: (file.name != SCENE, len(file.name), file.name))


def _title(scene: Traversable) -> str:
    """Return the first sentence of the comment at the top of a scene."""
    lines = []
    for line in scene.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("# "))
    return " ".join(lines).partition(". ")[0].rstrip(".")
