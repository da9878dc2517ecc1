"""Result files that are never half-written: a temporary name first, then one rename."""

import os
import shutil
import tempfile
from pathlib import Path

from pipeline.errors import InputError


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step.

    Raises:
        InputError: the folder cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(scratch, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from error


def copy_file(source: Path, target: Path) -> None:
    """Copy a file in one step.

    Raises:
        InputError: the folder cannot be written.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        scratch = target.with_name(f".{target.name}.part")
        shutil.copyfile(source, scratch)
        os.replace(scratch, target)
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror})") from error
