"""The tool of `make defaults` opens every neighbour of a scene that its settings allow."""

import pytest

from docs.tools.default_accuracy import as_converged, neighbours
from gudgeon.pipeline.kinds import open_job
from tests.validation.scenes import DATA


@pytest.mark.parametrize("step", [None, 1e-7])
def test_every_variant_of_a_scene_is_set(step: float | None) -> None:
    given = {} if step is None else {"run.step": step}
    plain = open_job(DATA / "rod-wall", set=given)
    assert plain.scene.run.step == step
    variants = {name: settings for name, settings in neighbours(plain) if not name.startswith("integrator")}
    assert len(variants) > 8
    for name, settings in variants.items():
        job = open_job(DATA / "rod-wall", set=given | as_converged(plain) | settings)
        assert job.scene.run.step is None
        assert (job.scene.body["rod"].damping is not None) == name.startswith("damping")
