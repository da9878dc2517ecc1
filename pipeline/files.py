"""Result files that are never half-written: a temporary name first, then one rename."""

import contextlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from gudgeon.pipeline.errors import InputError


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step.

    Raises:
        InputError: the folder cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with _scratch(path) as scratch:
            scratch.write_text(text, encoding="utf-8")
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
        with _scratch(target) as scratch:
            shutil.copyfile(source, scratch)
            os.replace(scratch, target)
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror})") from error


@contextlib.contextmanager
def _scratch(path: Path) -> Iterator[Path]:
    """Yield a hidden name beside `path`; what still stands there afterwards is removed."""
    scratch = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield scratch
    finally:
        scratch.unlink(missing_ok=True)
