"""Scenes with friction on elastic bodies: their parts have tangential rows, and their points face each other."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.plan import plan
from gudgeon.pipeline.stages.run import run_job
from tests.validation.friction.meshes import write_all

HERE = Path(__file__).parent
COARSE = 0.8
"""Element size at the contact of the spheres over its radius."""
SCENES = {"mindlin": ["upper", "lower"], "cattaneo": ["upper", "lower"], "bar": ["bar"]}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("friction")
    write_all(made, COARSE)
    for name in SCENES:
        (made / f"{name}.toml").write_text((HERE / f"{name}.toml").read_text())
    return made


def opened(folder: Path, name: str) -> Job:
    few = {f"component.{part}.modes.normal_count": 10 for part in SCENES[name]}
    return open_job(folder / f"{name}.toml", set=few, db=folder / "db", out=folder / name)


@pytest.mark.parametrize("name", SCENES)
def test_parts_have_tangential_rows_of_their_interfaces(folder: Path, name: str) -> None:
    job = opened(folder, name)
    run_job(job, "morph")
    for part in SCENES[name]:
        record = job.store.get(job.components()[part]["modes"].key, "modes")
        (interface,) = record.interfaces
        place = record.interfaces[interface]
        assert record.tangential_spans.keys() == {interface}
        assert place.tangential_rows is not None
        moving = 2 if name == "mindlin" else 1
        assert (np.abs(place.tangential_rows).max(axis=(0, 2)) > 0).sum() == moving, "a plane part moves in its plane"
    read = {(one["body"], one["term"].partition(" of ")[0]): one for one in plan(job)["terms"]}
    assert all(read[part, "friction"]["bytes"] > 0 for part in SCENES[name])
