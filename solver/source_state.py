"""Digests of sources, kept in a folder by the state of all files of the packages, since finding them takes long.

The state is their names, sizes, inodes, and when each was last written or replaced, which no copying tool sets.
"""

import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Collection, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
"""The folder that has the packages."""
PACKAGES = ("modaldb", "pipeline", "solver")


def sources_state(root: Path = ROOT) -> str:
    """Return 32 digits that tell the files of the sources apart from what they were before any change."""
    digest = hashlib.sha256(str(root).encode())
    for package in PACKAGES:
        for folder, below, names in os.walk(root / package):
            below[:] = sorted(name for name in below if name != "__pycache__")
            for name in sorted(name for name in names if name.endswith(".py")):
                state = os.stat(os.path.join(folder, name))
                state_of_file = (folder, name, state.st_size, state.st_ino, state.st_mtime_ns, state.st_ctime_ns)
                digest.update(repr(state_of_file).encode())
    return digest.hexdigest()[:32]


def kept_digests(
    folder: Path, name: str, names: Collection[str], find: Callable[[], Mapping[str, str]], root: Path = ROOT
) -> Mapping[str, str]:
    """Return digests by their names: those that are kept for the files as they stand, or those that are found now.

    Args:
        folder: Folder where they are kept; where it cannot be written, they are found each time.
        name: What they are of, in the name of their file.
        names: Those that there are at least.
        find: Finds them.
        root: Folder that has the packages.
    """
    path = folder / f"{name}-{sources_state(root)}.json"
    with contextlib.suppress(OSError, ValueError):
        digests = json.loads(path.read_text())
        if isinstance(digests, dict) and digests.keys() >= set(names):
            return {key: str(digest) for key, digest in digests.items()}
    digests = find()
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        unfinished = path.with_name(f".{path.name}.{os.getpid()}")
        unfinished.write_text(json.dumps(digests))
        os.replace(unfinished, path)
    return digests
