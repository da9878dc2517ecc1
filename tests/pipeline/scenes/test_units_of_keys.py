"""Units of keys by their paths, and on the axes of studies."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from gudgeon.pipeline.kinds import open_job, schema_of
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.scenes.reference.units import unit_at
from gudgeon.pipeline.studies import picture
from gudgeon.pipeline.studies.task import Row
from tests.scenes import scene_path


@pytest.mark.parametrize(
    ("path", "unit"),
    [
        ("component.skirt.mesh.size", "m"),
        ("component.skirt.geometry.wall", "m"),
        ("component.skirt.material.E", "Pa"),
        ("component.skirt.modes.normal_count", ""),
        ("component.skirt.interface.thrust.height.0", "m"),
        ("body.skirt.velocity.0", "m/s"),
        ("body.skirt.damping.ratio", ""),
        ("contact.bore.surface_stiffness", "N/m^3"),
        ("contact.bore.law.stiffness", ""),
        ("no.such.key", ""),
    ],
)
def test_a_key_has_the_unit_of_its_description(path: str, unit: str) -> None:
    """A law's stiffness has one for each kind of law, and so none for all."""
    assert unit_at(schema_of(open_job(scene_path("skirt"))), path) == unit


def test_the_axis_of_a_parameter_has_its_unit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = list[Figure]()
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure))
    rows = {n: Row(n, "FINISHED", quantities={"wall.impulse": {"value": 1.0 + n, "unit": "N s"}}) for n in (1, 2, 3)}
    paths, designs = ["a.length", "a.count"], [[1.0, 1], [2.0, 2], [3.0, 3]]
    assert picture.draw(tmp_path / "study.png", "scene", paths, (designs, rows), units={"a.length": "m"})
    labels = [axes.get_xlabel() for axes in drawn[0].axes[-2:]]
    assert labels == ["a.length [m]", "a.count"]
