"""Scenes solved as they are or with a few keys changed."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon import modaldb
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import run
from gudgeon.pipeline.stages.run_report import RunReport
from tests.scenes import scene_path


@dataclass(frozen=True)
class Solved:
    """One run of a scene."""

    report: RunReport
    history: Trajectory

    def __getitem__(self, quantity: str) -> float:
        return float(self.report.quantities[quantity]["value"])

    def __contains__(self, quantity: str) -> bool:
        return quantity in self.report.quantities

    def impacts(self, contact: str) -> np.ndarray:
        """Return the impacts of a contact as in `Trajectory.impacts`, (b, 7)."""
        return self.history.impacts[contact]

    @property
    def energy(self) -> np.ndarray:
        """Kinetic, strain and contact energy together at the end of each sample interval [J], (s,)."""
        return self.history.energies[:, :3].sum(axis=1)


def solve(scene: str, folder: Path, changes: Mapping[str, Any] | None = None) -> Solved:
    """Solve a scene, given by the name of its folder or of a file in it; products go to `folder`."""
    out = folder / "out" / scene.removesuffix(".toml")
    report = run(scene_path(scene), set=dict(changes or {}), db=folder / "db", out=out, until="solve")
    history = modaldb.open(folder / "db").get(report.stages["solve"].key, "trajectory")
    assert report.result == "FINISHED", report.reason
    return Solved(report, history)
