"""Runs of small scenes, and what the tests of their pictures share."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.pipeline import plots
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.stages.run import run_job

if TYPE_CHECKING:
    import pyvista as pv

imageio = pytest.importorskip("imageio.v3")

LEAST_DEVIATION = 10.0
"""Standard deviation of the grey values of a picture that is not blank."""
FAKE_CHILD = """
import json, os, pathlib, runpy, signal, sys, time
job = json.loads(pathlib.Path(sys.argv[1]).read_text())
if job["group"] == "flat":
    runpy.run_module("gudgeon.pipeline.plots.child", run_name="__main__")
else:
    (pathlib.Path(job["scratch"]) / "deformation.png").write_bytes(b"half")
    {end}
"""


class Run(NamedTuple):
    """A trajectory in a store."""

    name: str
    store: Path
    key: str

    def drawing(self, folder: Path, tell: Callable[[str], None] = lambda name: None) -> Drawing:
        return Drawing(modaldb.open(self.store), self.key, self.name, folder, folder, tell)

    def render(self, folder: Path, **options: Any) -> tuple[list[Path], list[str]]:
        """Draw all pictures, or skip the test where they cannot be rendered."""
        drawn, notes = plots.render(self.store, self.key, folder, self.name, **options)
        if any("rendering crashed" in note for note in notes):
            pytest.skip(notes[0])
        return drawn, notes


def solved(folder: Path, name: str, scene: str | Path, changes: Mapping[str, Any] | None = None) -> Run:
    """Run a scene, of its text or its file, with changes."""
    if isinstance(scene, str):
        (folder / "scene.toml").write_text(scene)
        scene = folder
    job = open_job(scene, set=dict(changes or {}), db=folder / "db", out=folder / "out")
    return Run(name, folder / "db", run_job(job, "solve").stages["solve"].key)


def fake_child(folder: Path, monkeypatch: pytest.MonkeyPatch, end: str) -> None:
    """Let the rendered pictures be drawn by a child that leaves a half-written file and then does `end`."""
    (folder / "fake_child.py").write_text(FAKE_CHILD.replace("{end}", end))
    monkeypatch.setattr(plots, "CHILD", "fake_child")
    monkeypatch.setenv("PYTHONPATH", str(folder))


def assert_picture(path: Path, size: tuple[int, int] = (1600, 1200)) -> None:
    """Maps of pressure are as high as they need; the others have a size [px]."""
    image = imageio.imread(path)[..., :3].astype(float)
    assert image.shape[1] == size[0]
    assert 500 < image.shape[0] < 1200 if path.name.startswith("pressure") else image.shape[0] == size[1]
    assert image.mean(axis=2).std() > LEAST_DEVIATION
    # Nothing is cut off: the outermost pixels are all white.
    for border in (image[:8], image[-8:], image[:, :8], image[:, -8:]):
        assert border.min() > 250


def triangles_of(surface: "pv.PolyData") -> np.ndarray:
    """Return the corners of the triangles of a surface, (3, t, 3)."""
    return np.moveaxis(np.asarray(surface.points, float)[surface.regular_faces], 1, 0)


def volume_of(surface: "pv.PolyData") -> float:
    """Return the signed volume within a surface, positive where its triangles look outward."""
    a, b, c = triangles_of(surface)
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6)
