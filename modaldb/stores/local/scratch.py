"""Files that are being written: locked while their writer lives, so that those of dead writers can be told."""

import contextlib
import errno
import fcntl
import os
import shutil
import stat
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

PREFIX = ".writing-"
DAY = 86400.0
"""Age [s] above which a scratch is its writer's no longer where locks cannot tell."""


@contextlib.contextmanager
def scratch_file(folder: Path, like: os.stat_result) -> Iterator[tuple[int, Path]]:
    """Yield the descriptor and the path of a new locked file, which is removed afterwards unless it was renamed.

    Args:
        folder: Where it is made.
        like: Of the folder whose group and permissions it takes.
    """
    while True:
        # The name is known before the file exists: Ctrl-C between them would leave a file of unknown name.
        path = folder / f"{PREFIX}{uuid.uuid4().hex}"
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
            try:
                if not _locked(descriptor, path):
                    continue
                _share(descriptor, like, stat.S_IMODE(like.st_mode) & 0o666)
                yield descriptor, path
                return
            finally:
                os.close(descriptor)
        finally:
            with contextlib.suppress(OSError):
                path.unlink()


def shared_folder(folder: Path, like: Path) -> None:
    """Make a folder with the group and the permissions of another one, unless it exists."""
    try:
        folder.mkdir()
    except FileExistsError:
        return
    model = like.stat()
    with contextlib.suppress(OSError):  # Another process may have removed the empty folder.
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            _share(descriptor, model, stat.S_IMODE(model.st_mode))
        finally:
            os.close(descriptor)


def shared_file(path: Path, like: Path) -> None:
    """Make an empty file with the group and the permissions of a folder, unless it exists."""
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    except FileExistsError:
        return
    try:
        model = like.stat()
        _share(descriptor, model, stat.S_IMODE(model.st_mode) & 0o666)
    finally:
        os.close(descriptor)


def write_whole(descriptor: int, chunks: tuple[bytes, ...]) -> None:
    """Write bytes to an open file and flush them to the disk."""
    for chunk in chunks:
        remaining = memoryview(chunk)
        while remaining:
            remaining = remaining[os.write(descriptor, remaining) :]
    os.fsync(descriptor)


def flush_folder(folder: Path) -> None:
    """Flush the names in a folder to the disk, where its file system can."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)


def dead_scratch(root: Path) -> list[Path]:
    """Return what writers that live no longer have left in a database."""
    return [path for path in sorted(root.glob(f"??/{PREFIX}*")) if _is_dead(path)]


def remove(path: Path) -> None:
    """Remove a file or a folder, unless another process does so at the same time."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def size(path: Path) -> int:
    """Return the bytes of a file, or of all files in a folder; 0 where it is gone."""
    files = path.rglob("*") if path.is_dir() else [path]
    try:
        return sum(file.stat().st_size for file in files if file.is_file())
    except OSError:
        return 0


def _is_dead(path: Path) -> bool:
    try:
        if path.is_symlink() or not path.is_file():
            return False
        descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC)
    except OSError:
        return False  # Renamed since, or not ours to judge.
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return time.time() - os.fstat(descriptor).st_mtime > DAY
    else:
        return True
    finally:
        os.close(descriptor)


def _locked(descriptor: int, path: Path) -> bool:
    """Lock a new file; return whether it is still there, since another process may have taken it for a dead one's."""
    with contextlib.suppress(OSError):  # A file system without locks.
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    try:
        return path.stat().st_ino == os.fstat(descriptor).st_ino
    except FileNotFoundError:
        return False


def _share(descriptor: int, like: os.stat_result, mode: int) -> None:
    """Give a file or folder of this process a group and permissions, as far as the user may."""
    if os.fstat(descriptor).st_gid != like.st_gid:
        with contextlib.suppress(OSError):
            os.fchown(descriptor, -1, like.st_gid)
    with contextlib.suppress(OSError):
        os.fchmod(descriptor, mode)
