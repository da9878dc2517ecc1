"""The tool of `make defaults` opens every neighbour of a scene, keeps the rows that it has, and writes their table."""

import json
from pathlib import Path

import pytest

from docs.tools import default_accuracy as tool
from docs.tools.default_accuracy import as_converged, main, neighbours, table
from gudgeon.pipeline.kinds import open_job
from tests.scenes import scene_path


@pytest.mark.parametrize("step", [None, 1e-7])
def test_every_variant_of_a_scene_is_set(step: float | None) -> None:
    given = {} if step is None else {"run.step": step}
    plain = open_job(scene_path("rod-wall"), set=given)
    assert plain.scene.run.step == step
    variants = {name: settings for name, settings in neighbours(plain) if not name.startswith("integrator")}
    assert len(variants) == 7
    for name, settings in variants.items():
        job = open_job(scene_path("rod-wall"), set=given | as_converged(plain) | settings)
        assert job.scene.run.step is None
        assert (job.scene.body["rod"].damping is not None) == name.startswith("damping")


def test_a_damped_scene_has_a_neighbour_without_damping() -> None:
    piston = scene_path("piston") / "coarse.toml"
    (settings,) = (settings for name, settings in neighbours(open_job(piston)) if name == "damping 0")
    assert all(body.damping is None for body in open_job(piston, set=settings).scene.body.values())


def test_rows_are_kept_and_the_rest_follows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    made: list[str] = []

    def row(scene: Path, settings: object, *rest: object) -> dict[str, object]:
        made.append(json.dumps(settings))
        return {"result": "FINISHED", "impulse": 1e-4, "force_peak": 0.5, "reason": "own | estimate"}

    monkeypatch.setattr(tool, "row_of", row)
    scene, count = str(scene_path("hertz")), len(list(neighbours(open_job(scene_path("hertz")))))
    assert main(["--minutes", "0", "--folder", str(tmp_path), scene]) == 0
    assert made == []
    assert capsys.readouterr().err.endswith(f"{count} rows are missing; run it again\n")
    assert main(["--folder", str(tmp_path), scene]) == 0
    assert len(made) == count
    assert main(["--folder", str(tmp_path), scene]) == 0
    assert len(made) == count
    kept = json.loads((tmp_path / "defaults.json").read_text())
    kept["hertz"]["50 samples"]["code"] = "earlier"
    (tmp_path / "defaults.json").write_text(json.dumps(kept))
    assert main(["--folder", str(tmp_path), scene]) == 0
    assert len(made) == count + 1
    page = (tmp_path / "defaults.md").read_text()
    assert "| `hertz` | 50 samples | 1.0e-04 | 5.0e-01 | own / estimate |" in page
    assert f"{count} runs: {count} beyond them.\n" in page


def test_the_table_counts_what_it_does_not_list() -> None:
    rows = {
        "as it is": {"result": "FINISHED", "impulse": 1e-6, "force_peak": 1e-5, "code": "old"},
        "gravity": {"result": "ROTATION", "reason": "turned", "code": "new"},
        "integrator event": {"refused": "does not carry damping", "code": "new"},
        "duration × 4": {"left out": "longer than 20 s of CPU time", "code": "new"},
    }
    page = table({"one": rows}, "new")
    counts = "1 within the limits, 1 ended with a reason, 1 refused, 1 no row"
    assert f"4 runs: {counts}. 1 of them are of other versions of the code.\n" in page
    assert "| `one` | gravity | – | – | turned |\n" in page
    assert "integrator event" not in page
