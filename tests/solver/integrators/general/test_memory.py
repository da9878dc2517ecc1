"""A run whose arrays would not find room on the machine is refused before they are made."""

from pathlib import Path

import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.general import integrator
from tests.solver.port_systems import pair


def test_too_many_points_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    system = pair(tmp_path, 30)
    integrator.General(system, 2e-7)
    monkeypatch.setattr(integrator, "MATRICES", 1e12)
    with pytest.raises(SceneError, match=r"contacts? have 30 points, for which the solver needs about .* GB"):
        integrator.General(system, 2e-7)
