"""The folder of results belongs to one scene file, and its pictures show the results beside them."""

import json
import shutil
from pathlib import Path

import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job, run
from tests.pipeline.small import rod_scene


@pytest.fixture
def scenes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the scenes `rods/scene.toml` and `rods/other.toml`, and `more/scene.toml`."""
    for name in ("rods/scene.toml", "rods/other.toml", "more/scene.toml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(rod_scene(0.1, 4, 40, 4))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_scenes_of_one_folder_have_folders_of_their_own(scenes: Path) -> None:
    outs = [open_job(scene).out for scene in ("rods", "rods/other.toml", "more")]
    assert outs == [Path("out/rods/scene"), Path("out/rods/other"), Path("out/more/scene")]


def test_a_folder_of_another_scene_is_refused(scenes: Path) -> None:
    report = run("rods", out="kept", until="solve")
    assert json.loads(Path("kept/scene.json").read_text()) == {"scene": "../rods/scene.toml"}
    assert report.result == "FINISHED"
    before = {path.name: path.read_bytes() for path in Path("kept").iterdir()}
    with pytest.raises(InputError, match=r"--out kept: holds the results of .*rods/scene.toml; .*other.toml needs"):
        run("rods/other.toml", out="kept", until="solve")
    assert {path.name: path.read_bytes() for path in Path("kept").iterdir()} == before
    # A copy of both belongs to the copied scene.
    shutil.copytree(scenes, scenes.parent / f"{scenes.name}-copied")
    assert (
        run(scenes.parent / f"{scenes.name}-copied/rods", out=scenes.parent / "copied/kept", until="solve").result
        == "FINISHED"
    )
    # The same scene with other values may use it, and so may any scene once the first is gone.
    run("rods", set={"run.samples": 20}, out="kept", until="solve")
    Path("rods/scene.toml").unlink()
    assert run("rods/other.toml", out="kept", until="solve").result == "FINISHED"


def test_new_results_have_no_old_pictures_beside_them(scenes: Path) -> None:
    run("rods", out="kept", until="solve")
    Path("kept/force-one.png").write_bytes(b"of the first run")
    Path("kept/of-the-user.png").write_bytes(b"not listed")
    noted = {"key": "of the first run", "files": {"force-one.png": "digest"}}
    Path("kept/pictures.json").write_text(json.dumps(noted))
    run("rods", set={"run.duration": 5e-4}, out="kept", until="solve")
    assert not Path("kept/force-one.png").exists()
    assert not Path("kept/pictures.json").exists()
    assert Path("kept/of-the-user.png").exists()
