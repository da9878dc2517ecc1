"""The OpenAPI schema against what the server does, by schemathesis: no status, type or body that it does not state."""

import subprocess
import sys
from pathlib import Path

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from tests.modaldb.samples import INPUTS, mesh
from tests.pipeline.service.serving import TOKEN, served


def test_the_server_does_what_its_schema_says(tmp_path: Path) -> None:
    program = Path(sys.executable).with_name("schemathesis")
    with served(tmp_path / "db") as url:
        modaldb.open(url).put(content_key(INPUTS), "mesh", mesh(), INPUTS)
        child = subprocess.run(
            [str(program), "run", f"{url}/openapi.json", "-H", f"Authorization: Bearer {TOKEN}", "--max-examples", "10",
             "--phases", "examples,coverage,fuzzing", "--continue-on-failure", "--generation-deterministic"],
            capture_output=True, text=True, cwd=tmp_path,
        )  # fmt: skip
    assert child.returncode == 0, child.stdout[-4000:]
