"""The folder of a scene's results: it belongs to one scene file, and its pictures show the results beside them."""

import contextlib
import json
import os
from pathlib import Path

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.stages.base import Place

OWNER, PICTURES = "scene.json", "pictures.json"
"""Files that name the scene file of a folder, relative to it so that both can be copied together, and its pictures with
the key of what they show."""


def claim(job: Place) -> None:
    """Write into the folder of a job which scene file it belongs to, before any result.

    Raises:
        InputError: the folder has the results of another scene file that still exists, or cannot be written.
    """
    named = _read(job.out / OWNER).get("scene")
    owner = (job.out.resolve() / str(named)).resolve()
    if named is not None and owner.is_file() and owner != job.path.resolve():
        raise InputError(f"--out {job.out}: holds the results of {owner}; {job.path} needs a folder of its own")
    content = {"scene": os.path.relpath(job.path.resolve(), job.out.resolve())}
    if content["scene"] != named:
        write_text(job.out / OWNER, json.dumps(content, indent=1))


def remove_pictures(out: Path, key: str) -> None:
    """Remove the pictures of a folder unless they were drawn for `key`."""
    noted = _read(out / PICTURES)
    if not noted or noted.get("key") == key:
        return
    for name in [*noted.get("files", ()), PICTURES]:
        with contextlib.suppress(FileNotFoundError):
            (out / Path(name).name).unlink()


def _read(path: Path) -> dict:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
