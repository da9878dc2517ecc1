"""Where a scene and its results are. Light: a command looks there before it loads what reads a scene."""

import contextlib
import sys
from pathlib import Path

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import usable_path

SCENE_FILE = "scene.toml"
DEFAULT_OUT = "out"
ABSENT = "gudgeon.absent"
"""Name of the audit event of a file that is looked for and not there."""
SHOWN = 200
"""Characters of a wrong value in a message."""


def scene_path(scene: str | Path) -> Path:
    """Return the TOML file of a scene given as a file or as its folder.

    Raises:
        InputError: it does not exist.
    """
    path = Path(scene)
    path = path / SCENE_FILE if is_file(path / SCENE_FILE) else path
    if not is_file(path):
        raise InputError(f"{str(scene)[:SHOWN]}: no scene here; give a folder with {SCENE_FILE} or a TOML file")
    return path


def results_folder(path: Path, out: str | Path | None) -> Path:
    """Return the folder of the results of a scene's file: the one that is given, or `out/<folder>/<scene>`.

    Raises:
        InputError: no folder can be there.
    """
    return Path(DEFAULT_OUT) / path.parent.resolve().name / path.stem if out is None else usable_path(out)


def is_file(path: Path) -> bool:
    """Return whether there is a file at a path; no file can have some paths, such as those that are too long.

    Where there is none an audit hook is told so: what follows depends on it as on a file that is read.
    """
    with contextlib.suppress(OSError, ValueError):
        if path.is_file():
            return True
    sys.audit(ABSENT, str(path))
    return False
