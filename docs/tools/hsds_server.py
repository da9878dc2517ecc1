"""HSDS in POSIX mode, for this machine alone: `make hsds`, or `python -m docs.tools.hsds_server [--root FOLDER]`.

It listens at sockets of the file system, which the user alone can open: by TCP, HSDS 1.0 listens at every address of a
machine. Prints the variables that clients need, and runs until Ctrl-C.
"""

import argparse
import contextlib
import os
import secrets
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from urllib.parse import quote

ROOT = Path(__file__).resolve().parents[2]
BUCKET = "hsdstest"
"""Folder below the root that HSDS takes where clients name none."""
USER = "gudgeon"
STARTS = 60.0
"""Longest wait [s] until it listens."""


def program() -> Path | None:
    """Return the program of HSDS: of `make hsds`, or on the path; None if there is none."""
    own = ROOT / ".venv-hsds/bin/hsds"
    found = str(own) if own.exists() else shutil.which("hsds")
    return None if found is None else Path(found)


@contextlib.contextmanager
def started(root: Path) -> Iterator[Mapping[str, str]]:
    """Run HSDS on a folder; yield the variables that h5pyd reads.

    Raises:
        RuntimeError: it is not installed, or does not start; the message has its last lines.
    """
    if (hsds := program()) is None:
        raise RuntimeError("HSDS is not installed; `make hsds` installs it in an environment of its own")
    (root / BUCKET).mkdir(parents=True, exist_ok=True)
    password = secrets.token_hex(16)
    with tempfile.TemporaryDirectory() as sockets:  # A short path: that of a socket has 107 characters at most.
        log, told = Path(sockets) / "log", Path(sockets) / "told"
        child = subprocess.Popen(
            [hsds, "--root_dir", root, "--hs_username", USER, "--hs_password", password, "--socket_dir", sockets,
             "--count", "1", "--loglevel", "ERROR", "--logfile", log],
            stdout=told.open("wb"), stderr=subprocess.STDOUT, start_new_session=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
        )  # fmt: skip
        socket, begun = Path(sockets) / "sn_1.sock", time.monotonic()
        variables = {"HS_ENDPOINT": f"http+unix://{quote(str(socket), safe='')}", "HS_USERNAME": USER,
                     "HS_PASSWORD": password}  # fmt: skip
        try:
            while b"READY" not in told.read_bytes():
                if child.poll() is not None or time.monotonic() - begun > STARTS:
                    last = told.read_text().splitlines()[-5:]
                    raise RuntimeError("\n".join(["HSDS does not start", *last]))
                time.sleep(0.2)
            yield variables
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGTERM)
            child.wait()


def main() -> None:
    """Run it until Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path, default=Path(".hsds"), help="folder of the data (default .hsds)")
    with started(parser.parse_args().root.resolve()) as variables:
        for name, value in variables.items():
            print(f"export {name}={value}")
        print("export GUDGEON_DB=hsds:///home/records", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            signal.pause()


if __name__ == "__main__":
    main()
