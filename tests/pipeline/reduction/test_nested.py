"""A record with half of its modes left out is the record that the pipeline makes with half as many."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.solver.system.bases.nested import truncated
from tests.scenes import scene_path

ROUND_OFF = 1e-9
"""Relative to the largest entry: both sides extract their modes on their own."""
CURVED = 1e-8
"""The same of stress, a second derivative of the deflection."""


SIDES = {"rods-3d": ("rod", "front"), "beam-sphere": ("beam", "mid")}
"""A component of each scene, and an interface of one point on it."""


def record(scene: str, name: str, count: int, folder: Path, *rubbed: str) -> ModalRecord:
    key = f"component.{name}.modes"
    changes = {f"{key}.normal_count": count, f"{key}.static_count": 0, f"{key}.reduction": "macneal"}
    job = open_job(scene_path(scene), set=changes, db=folder)
    component = job.scene.component[name]
    return reduce_component(component.geometry.build(component.mesh.size), "mesh", component, name, rubbed)


@pytest.mark.parametrize(
    ("scene", "name"), [("rod-wall", "rod"), ("rod-mass/free.toml", "rod"), ("beam-sphere", "beam")]
)
def test_half_a_record_is_the_record_of_half_the_modes(scene: str, name: str, tmp_path: Path) -> None:
    more, fewer = (record(scene, name, count, tmp_path) for count in (12, 6))
    found = truncated(more, 0.5)
    assert close(found.angular_frequencies, fewer.angular_frequencies)
    assert close(found.residual_flexibility, fewer.residual_flexibility)
    for key, interface in fewer.interfaces.items():
        assert close(np.abs(found.interfaces[key].rows), np.abs(interface.rows))
    for key, gauge in fewer.gauges.items():
        assert close(np.abs(found.gauges[key].rows), np.abs(gauge.rows))
        assert close(found.gauges[key].residual, gauge.residual, CURVED)
    if fewer.participation is not None:
        assert found.participation is not None
        assert np.abs(found.participation).max() == pytest.approx(np.abs(fewer.participation).max(), rel=ROUND_OFF)


def close(one: np.ndarray | None, other: np.ndarray | None, within: float = ROUND_OFF) -> bool:
    assert one is not None
    assert other is not None
    return one.shape == other.shape and np.allclose(one, other, rtol=0, atol=within * np.abs(other).max(initial=0.0))


@pytest.mark.parametrize("scene", ["rods-3d", "beam-sphere"])
def test_half_a_record_with_tangential_rows(scene: str, tmp_path: Path) -> None:
    more, fewer = (record(scene, SIDES[scene][0], count, tmp_path, SIDES[scene][1]) for count in (12, 6))
    found, name = truncated(more, 0.5), SIDES[scene][1]
    assert fewer.row_count == len(fewer.interface_rows) + 2
    assert close(found.residual_flexibility, fewer.residual_flexibility)
    one, other = found.interfaces[name].tangential_rows, fewer.interfaces[name].tangential_rows
    assert one is not None
    assert other is not None
    assert close((one**2).sum(axis=2), (other**2).sum(axis=2), 1e-6)
