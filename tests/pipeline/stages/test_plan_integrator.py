"""`gudgeon plan` names the integrators that the size of contacts may select, not only that of the features."""

import pytest

from gudgeon.pipeline.cli import main
from tests.scenes import scene_path


@pytest.mark.parametrize(
    ("scene", "changes", "line"),
    [
        ("two-blocks", [], "integrator small"),
        ("rigid", [], "integrator event; small with more than 8 contact points, all over flexibility"),
        ("rigid", ["run.integrator=event"], "integrator event"),
        ("hertz", [], "integrator small"),
    ],
)
def test_the_size_of_contacts_may_select_another_integrator(
    scene: str, changes: list[str], line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = [part for one in changes for part in ("--set", one)]
    assert main(["plan", str(scene_path(scene)), *settings]) == 0
    assert line in capsys.readouterr().out.splitlines()
