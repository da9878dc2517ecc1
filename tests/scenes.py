"""Scenes by name: those of `data/`, for users, and those of `tests/validation/scenes`, which only prove something."""

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = (ROOT / "data", ROOT / "tests" / "validation" / "scenes")


def scene_path(name: str) -> Path:
    """Return the path of a scene's folder or of a file in it, from its path below one of `FOLDERS`."""
    return next((folder / name for folder in FOLDERS if (folder / name).exists()), FOLDERS[0] / name)


def scene_files() -> dict[str, Path]:
    """Return the files of all scenes by their path below the folder of `FOLDERS` that has them, in its order."""
    paths = {path.relative_to(folder).as_posix(): path for folder in FOLDERS for path in folder.glob("*/*.toml")}
    return dict(sorted(paths.items()))


def reference(name: str) -> dict[str, Any]:
    """Return the expected values of a reference file, from its path below one of `FOLDERS`."""
    return json.loads(scene_path(name).read_text())["expected"]
