"""The family of exporters: each member is a module that writes modes and trajectories in one format."""

from pathlib import Path
from typing import Protocol

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.exporters import vtu
from gudgeon.pipeline.exporters.vtu import BodyRecords


class Exporter(Protocol):
    """What a member offers; whatever it writes appears under its final name whole or not at all."""

    def write_modes(self, path: Path, mesh: MeshRecord, modal: ModalRecord, count: int | None) -> None:
        """Write the mesh with its first `count` mode shapes, all for None."""
        ...

    def write_trajectory(
        self, folder: Path, records: BodyRecords, trajectory: Trajectory, body: str, every: int
    ) -> list[Path]:
        """Write every `every`-th frame of one body and return the files."""
        ...


EXPORTERS: dict[str, Exporter] = {"vtu": vtu}
"""Members by the name of their format."""
