"""Writing of result files: first under a temporary name, then renamed, so that no file is ever incomplete."""

import contextlib
import csv
import io
import os
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from gudgeon.pipeline.errors import InputError


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a hidden path beside `path`; it is renamed to `path` at the end, or removed after an error.

    Raises:
        InputError: the folder cannot be written.
    """
    scratch = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield scratch
        os.replace(scratch, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        with contextlib.suppress(OSError):
            scratch.unlink()


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step; see `whole_file`."""
    with whole_file(path) as scratch:
        scratch.write_text(text, encoding="utf-8")


def copy_file(source: Path, target: Path) -> None:
    """Copy a file in one step; see `whole_file`."""
    with whole_file(target) as scratch:
        shutil.copyfile(source, scratch)


def csv_text(rows: Iterable[Iterable[Any]], line_end: str = "\r\n") -> str:
    """Return rows as comma-separated values."""
    text = io.StringIO()
    csv.writer(text, lineterminator=line_end).writerows(rows)
    return text.getvalue()
