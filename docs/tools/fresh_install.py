"""Whether the wheel installs and serves in a fresh environment: `python -m docs.tools.fresh_install`, some minutes.

Builds the wheel, installs it with its extra `service` and nothing else, serves a database there, and puts, lists and
fetches through it with the commands of the new environment. Prints what was done; a failure ends it.
"""

import json
import os
import re
import secrets
import shutil
import subprocess
import sys
import tempfile
import urllib.request
import venv
from pathlib import Path

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from tests.modaldb.samples import INPUTS, mesh

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("modaldb", "pipeline", "solver", "data", "pyproject.toml", "README.md", "LICENSE")


def wheel(folder: Path) -> Path:
    """Build the wheel of a copy of the sources."""
    for name in SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(ROOT / name, folder / name)
    code = "from scikit_build_core.setuptools import build_meta; print(build_meta.build_wheel('.'))"
    child = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    return folder / child.stdout.splitlines()[-1]


def main() -> None:
    """Do it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "sources").mkdir()
        built = wheel(folder / "sources")
        print(f"built {built.name}, {built.stat().st_size / 1e6:.2g} MB", flush=True)
        venv.create(folder / "env", with_pip=True)
        programs = folder / "env/bin"
        subprocess.run([programs / "python", "-m", "pip", "install", "-q", f"{built}[service]"], check=True)
        print("installed with the extra 'service'", flush=True)
        token = secrets.token_hex(16)
        clean = {key: text for key, text in os.environ.items() if not key.startswith(("PYTHON", "GUDGEON"))}
        environment = clean | {"GUDGEON_TOKEN": token, "GUDGEON_CACHE": str(folder / "cache")}
        server = subprocess.Popen(
            [programs / "gudgeon", "serve", "--db", folder / "db", "--port", "0"], stdout=subprocess.PIPE, text=True,
            env=environment, cwd=folder,
        )  # fmt: skip
        try:
            assert server.stdout is not None
            found = re.search(r"http://\S+", server.stdout.readline())
            assert found is not None, "it does not serve"
            url = found[0]
            os.environ |= {"GUDGEON_TOKEN": token, "GUDGEON_CACHE": str(folder / "cache2")}
            modaldb.open(url).put(content_key(INPUTS), "mesh", mesh(), INPUTS)
            command = [programs / "gudgeon", "db", "ls", "--db", url, "--json"]
            listed = subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=True)
            assert [row["kind"] for row in json.loads(listed.stdout)] == ["mesh"]
            command = [programs / "gudgeon", "db", "export", content_key(INPUTS)[:8], "copy.h5", "--db", url]
            subprocess.run(command, env=environment, cwd=folder, capture_output=True, check=True)
            assert (folder / "copy.h5").stat().st_size > 1000
            for path in ("page/", "page/page.js", "page/vendor/three.core.js"):
                assert urllib.request.urlopen(f"{url}/{path}", timeout=20).status == 200
            print("served: put, list, export and the page are as they must be")
        finally:
            server.terminate()
            server.wait()


if __name__ == "__main__":
    main()
