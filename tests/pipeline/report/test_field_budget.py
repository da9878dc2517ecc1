"""Terms of panels and grid in the error budget of scenes of bodies with a field."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from gudgeon import modaldb
from gudgeon.modaldb.records.field import PoseGridRecord
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.report.budget.fields import by_panels, by_points, changed_grids
from gudgeon.pipeline.stages.job import grids_of
from tests.scenes import scene_path

Z = np.linspace(0.0, 1.0, 9)
Y = np.linspace(0.0, 1.0, 5)


def grid() -> PoseGridRecord:
    """Return C = exp(z) (1 + y) of two conductors, 1 % too small."""
    values = (1 + Y)[:, None] * np.exp(Z)
    C = values.reshape(-1, 1, 1) * np.array([[1.0, -0.5], [-0.5, 1.0]])
    return PoseGridRecord(
        field_key="f", moved={"names": ["a"], "pivot": [0.0, 0.0, 0.0]}, axes={"y": Y, "z": Z}, capacitance=0.99 * C,
        panel_error=0.01 * np.abs(C), cell_errors=np.zeros(32), potentials=np.array([1.0, 0.0]), charges=np.zeros(2),
        counts={},
    )  # fmt: skip


def test_capacitances_grow_by_what_panels_lack() -> None:
    """Also those between conductors, which are negative."""
    found, own = by_panels(grid()), grid()
    np.testing.assert_allclose(found.capacitance, own.capacitance / 0.99, rtol=1e-12)


def test_every_second_point_of_long_axes_is_left() -> None:
    found = by_points(grid())
    assert found is not None
    np.testing.assert_array_equal(found.axes["z"], Z[::2])
    np.testing.assert_array_equal(found.axes["y"], Y)
    C = grid().capacitance.reshape(5, 9, 2, 2)[:, ::2]
    np.testing.assert_array_equal(found.capacitance, C.reshape(-1, 2, 2))
    assert found.cell_errors.shape == (4 * 4,)
    assert by_points(replace(grid(), axes={"y": Y, "z": Z[:5]}, capacitance=grid().capacitance[:25])) is None


def test_points_of_a_file_are_left_as_they_run() -> None:
    """A file has the axes by name, rz before z; the points run over z first."""
    turned = replace(grid(), axes={"rz": Z, "z": Y})
    found = by_points(turned)
    assert found is not None
    assert list(found.axes) == ["z", "rz"]
    C = turned.capacitance.reshape(5, 9, 2, 2)[:, ::2]
    np.testing.assert_array_equal(found.capacitance, C.reshape(-1, 2, 2))


def test_the_database_gets_the_grids_of_a_scene(tmp_path: Path) -> None:
    """Each once, and the scene names them; a scene without a grid has no such terms."""
    job = open_job(scene_path("pull-in"), db=tmp_path / "db", out=tmp_path / "out")
    (key,) = grids_of(job.scene).values()
    store = modaldb.open(tmp_path / "db")
    inputs = {"of": "test"}
    own = modaldb.keys.content_key(inputs)
    store.put(own, "posegrid", grid(), inputs)
    named = replace(job, scene=job.scene.model_copy(update={"force": {
        name: one.model_copy(update={"record": own}) if getattr(one, "record", None) == key else one
        for name, one in job.scene.force.items()
    }}))  # fmt: skip
    changes = changed_grids(named, by_panels)
    assert list(changes["force"]) == ["attraction"]
    made = changes["force"]["attraction"]["record"]
    assert store.has(made)
    assert changed_grids(named, by_panels) == changes
    assert not grids_of(open_job(scene_path("two-mass"), db=tmp_path / "db", out=tmp_path / "other"))
