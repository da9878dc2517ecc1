"""Where a scene and its results are, and writing of result files: first under a temporary name, then renamed, so that
no file is ever incomplete.

A sealed file is a JSON document with the digest of its own content, so that one that was edited or cut is not read.
"""

import contextlib
import csv
import errno
import io
import json
import math
import os
import re
import shutil
import sys
import uuid
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from gudgeon.modaldb.keys import content_key, open_file
from gudgeon.pipeline.errors import InputError, StageError

SCENE_FILE, DEFAULT_OUT = "scene.toml", "out"
ABSENT = "gudgeon.absent"
"""Name of the audit event of a file that is looked for and not there."""
SCRATCH = re.compile(r"\..+\.[0-9a-f]{32}\.part|\.drawing-[0-9a-f]{32}")
"""Names of temporary files and folders beside results."""
DIGEST = "digest"
SHOWN = 200
"""Characters of a wrong path in a message."""
FAILING = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Numbers of errors that are the device's, not the user's."""


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


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a hidden path beside `path`; it is renamed to `path` at the end, or removed after an error.

    Raises:
        InputError: the folder cannot be written.
        StageError: the disk is full, a quota is used up, or the device fails.
    """
    scratch = path.with_name(f".{path.name}.{uuid.uuid4().hex}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Made here and by nobody else: a link that waits under this name is not followed.
        os.close(os.open(scratch, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        yield scratch
        os.replace(scratch, path)
    except OSError as error:
        kind = StageError if error.errno in FAILING else InputError
        raise kind(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        with contextlib.suppress(OSError):
            scratch.unlink()


def usable_path(out: str | Path) -> Path:
    """Return the path of a folder of results, which need not exist yet.

    Raises:
        InputError: no folder can have this path.
    """
    if not str(out):
        raise InputError("--out: is empty; a folder is needed")
    path = Path(out)
    try:
        path = path.expanduser()
        path.lstat()
    except (FileNotFoundError, NotADirectoryError, PermissionError):  # Making it says so.
        pass
    except (OSError, ValueError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"--out {str(out)[:SHOWN]!r}: no folder can be here ({reason})") from error
    return path


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step; see `whole_file`."""
    with whole_file(path) as scratch:
        scratch.write_text(text, encoding="utf-8")


def write_sealed(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON document with its digest; see `whole_file`."""
    write_text(path, json.dumps({**content, DIGEST: content_key(content)}, indent=1))


def read_json(path: Path) -> Any:
    """Return the content of a JSON file.

    Raises:
        OSError: it cannot be read, or is a pipe or a device.
        ValueError, RecursionError: it is not JSON.
    """
    with open_file(path) as file:
        return json.loads(file.read().decode("utf-8-sig"))


def read_sealed(path: Path) -> dict[str, Any] | None:
    """Return the content of a sealed document; None if it is missing or not as it was written."""
    try:
        found = read_json(path)
        digest = found.pop(DIGEST)
        return found if content_key(found) == digest else None
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


def remove_scratch(folder: Path) -> None:
    """Remove the temporary files and folders that killed runs left in a folder of results."""
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            if SCRATCH.fullmatch(entry.name) is None:
                continue
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                os.unlink(entry.path)


def csv_text(rows: Iterable[Iterable[Any]], line_end: str = "\r\n") -> str:
    """Return rows as comma-separated values."""
    text = io.StringIO()
    csv.writer(text, lineterminator=line_end).writerows(rows)
    return text.getvalue()


def finite_number(cell: str, where: str) -> float:
    """Return the number in a cell of a CSV file; `where` is its place, for the message.

    Raises:
        InputError: it is no finite number.
    """
    try:
        value = float(cell)
    except ValueError:
        raise InputError(f"{where} holds '{cell.strip()}', a number is needed") from None
    if not math.isfinite(value):
        raise InputError(f"{where} holds '{cell.strip()}', a finite number is needed")
    return value
