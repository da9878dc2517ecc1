"""The folder of a scene's results: it belongs to one scene file, one run writes in it at a time, and its pictures show
the results beside them."""

import contextlib
import errno
import fcntl
import json
import logging
import math
import os
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from gudgeon.modaldb.errors import ModalDBError
from gudgeon.modaldb.format.hdf5 import read_record, record_bytes
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError, PipelineError
from gudgeon.pipeline.files import read_json, read_sealed, remove_scratch, whole_file, write_text
from gudgeon.pipeline.plots import FILES
from gudgeon.pipeline.stages.base import Place

log = logging.getLogger(__name__)
OWNER, PICTURES, LOCK = "scene.json", "pictures.json", ".lock"
"""Files that name the scene file of a folder, relative to it so that both can be copied together; its pictures with the
key of what they show; and a file that exists while a run writes."""
UNABLE = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.EINVAL)
"""Errors of file systems without locks."""
CLOSED = (errno.EACCES, errno.EPERM, errno.EROFS)
"""Errors of folders that this user only reads."""
STOPPED, DIGITS = "stopped", 16
"""Begin of the name of the folder that a stopped run goes on from, and the digits of its key that follow: what belongs
to another scene, or to another version of the program, is not read."""
INTERVAL, SECONDS = "GUDGEON_CHECKPOINT", 5.0
"""Variable of the environment that gives the CPU time between two states of a run [s], and its default."""
TRAJECTORIES = "trajectory"
"""Kind of the records of marches."""
EXPORTS = "vtu"
"""Folder of exported files within the results."""


@contextlib.contextmanager
def held(out: Path, waits: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Keep other runs from writing in a folder of results during the block, and remove what killed ones left there.

    Args:
        waits: Called before waiting for another run.

    Raises:
        InputError: the folder cannot be written.
    """
    lock = _Lock(out / LOCK)
    try:
        try:
            out.mkdir(parents=True, exist_ok=True)
            lock.take(waits)
        except OSError as error:
            if not (out.is_dir() and error.errno in CLOSED):
                raise InputError(f"{out}: cannot be written ({error.strerror or error})") from error
            yield  # Fresh results are read; whatever would be written says that it cannot.
            return
        for folder in (out, out / EXPORTS, *_folders(out / EXPORTS)):
            remove_scratch(folder)
        yield
    finally:
        lock.release()


class _Lock:
    """A lock file, which exists while one process has it, whatever signal ends that between two instructions."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: int | None = None
        self._own = False

    def take(self, waits: Callable[[], None]) -> None:
        """Make and lock the file; `waits` is called before waiting for another process."""
        while not self._own:
            self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                waits()
                fcntl.flock(self._file, fcntl.LOCK_EX)
            except OSError as error:
                if error.errno not in UNABLE:
                    raise
                log.warning("%s: this file system has no locks; start one run at a time in it", self._path.parent)
            self._own = self._is_there()
            if not self._own:
                self._close()

    def release(self) -> None:
        """Remove the file if this process has it, or if it made the file and was ended before it had it."""
        with contextlib.suppress(OSError):
            if not self._own:
                self._close()
                self._file = os.open(self._path, os.O_RDWR | os.O_NOFOLLOW)
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Removed while it is locked, so that nobody else can have it.
            if self._is_there():
                self._path.unlink()
        self._close()

    def _is_there(self) -> bool:
        """Whether the locked file still has this name: the one that had it before may have removed it."""
        assert self._file is not None
        with contextlib.suppress(FileNotFoundError):
            return os.path.samestat(os.fstat(self._file), os.stat(self._path))
        return False

    def _close(self) -> None:
        if self._file is not None:
            os.close(self._file)
        self._file, self._own = None, False


def _folders(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.iterdir() if path.is_dir() and not path.is_symlink()]
    except OSError:
        return []


def claim(job: Place) -> None:
    """Write into the folder of a job which scene file it belongs to, before any result.

    Raises:
        InputError: the folder has the results of another scene file that still exists, or cannot be written.
    """
    named, scene = _owner(job.out / OWNER), job.path.resolve()
    if named is not None:
        owner = (job.out.resolve() / named).resolve()
        if owner != scene:
            raise InputError(f"--out {job.out}: holds the results of {owner}; {job.path} needs a folder of its own")
    scene_path = os.path.relpath(scene, job.out.resolve())
    if scene_path != named:
        write_text(job.out / OWNER, json.dumps({"scene": scene_path}, indent=1))


def remove_pictures(out: Path, key: str) -> list[str]:
    """Remove the pictures of a folder unless they were drawn for `key`, and return the names of those removed.

    Those of a list that is not as it was written are removed by their names.
    """
    noted = read_sealed(out / PICTURES)
    if noted is None and not (out / PICTURES).exists():
        return []
    if noted is not None and noted["key"] == key:
        return []
    listed = [*FILES, *_named(out / PICTURES)] if noted is None else noted["files"]
    removed = []
    for name in dict.fromkeys(Path(p).name for p in [*listed, PICTURES]):
        with contextlib.suppress(OSError):
            (out / name).unlink()
            removed.append(name)
    return [name for name in removed if name != PICTURES]


def _named(path: Path) -> list[str]:
    """Return the pictures that a list of pictures names that is not as it was written."""
    text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    return re.findall(r'"([^"/\\\\]+\.(?:png|mp4))"', text)


def _owner(path: Path) -> str | None:
    """Return the scene file that a folder names; None if it names none that exists."""
    try:
        scene = read_json(path)["scene"]
        return scene if isinstance(scene, str) and (path.parent / scene).resolve().is_file() else None
    except (OSError, ValueError, LookupError, TypeError, RecursionError, RuntimeError):
        return None


class Kept:
    """A keeper of marches, see `solver.checkpoints`; what cannot be written or read is computed again.

    Args:
        out: Folder of the results.
        key: Of the trajectory.
        inputs: What it depends on.
    """

    def __init__(self, out: Path, key: str, inputs: dict[str, Any]) -> None:
        self.interval = _interval()
        self._folder, self._inputs = out / f"{STOPPED}-{key[:DIGITS]}", inputs
        for folder in out.glob(f"{STOPPED}-*"):
            if folder != self._folder:
                shutil.rmtree(folder, ignore_errors=True)

    def read(self, name: str) -> bytes | None:
        """Return what was written under a name, None where nothing was."""
        with contextlib.suppress(OSError):
            return (self._folder / name).read_bytes()
        return None

    def write(self, name: str, content: bytes) -> None:
        """Write at once all of it, so that it survives a crash of the machine, or nothing."""
        with contextlib.suppress(PipelineError), whole_file(self._folder / name) as scratch, scratch.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())

    def read_trajectory(self, name: str) -> Trajectory | None:
        """Return the trajectory that was written under a name, None where none was."""
        path = self._folder / f"{name}.h5"
        if not path.is_file():
            return None
        try:
            trajectory = read_record(path, TRAJECTORIES)
        except (ModalDBError, OSError):
            return None
        return trajectory if isinstance(trajectory, Trajectory) else None

    def write_trajectory(self, name: str, trajectory: Trajectory) -> None:
        """Write a trajectory, unless a number of it is not finite."""
        with contextlib.suppress(ModalDBError):
            self.write(f"{name}.h5", b"".join(record_bytes(TRAJECTORIES, trajectory, self._inputs)))

    def remove(self) -> None:
        """Remove all, since the run is finished."""
        shutil.rmtree(self._folder, ignore_errors=True)


def _interval() -> float:
    text = os.environ.get(INTERVAL) or str(SECONDS)
    try:
        interval = float(text)
    except ValueError:
        interval = math.nan
    if not 0 <= interval < math.inf:
        raise InputError(f"{INTERVAL}: '{text}' given; expected the CPU seconds between two checkpoints, 0 or more")
    return interval
