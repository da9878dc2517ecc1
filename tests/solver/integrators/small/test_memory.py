"""A run whose arrays would not find room on the machine is refused before they are made."""

from pathlib import Path
from typing import Any

import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.small import integrator
from tests.solver.port_systems import pair, rubbing_ports


@pytest.mark.parametrize(
    ("arrays", "contact"), [("TABLES", {}), ("PLAIN", {}), ("MATRICES", {"friction": 0.3})], ids=lambda one: str(one)
)
def test_too_many_points_are_refused(
    arrays: str, contact: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if contact:
        monkeypatch.setattr(integrator, "ports_of", rubbing_ports)
    system = pair(tmp_path, 30, **contact)
    integrator.Small(system, 2e-7)
    monkeypatch.setattr(integrator, arrays, 1e12)
    with pytest.raises(SceneError, match=r"contacts? have 30 points, for which the solver needs about .* GB"):
        integrator.Small(system, 2e-7)
