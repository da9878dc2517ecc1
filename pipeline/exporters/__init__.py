"""The family of exporters: modules that write modes and trajectories, each in one file format."""

from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.exporters import vtu
from gudgeon.pipeline.exporters.vtu import BodyRecords


class Exporter(Protocol):
    """The functions of an exporter; an error leaves no incomplete file."""

    def write_modes(self, path: Path, mesh: MeshRecord, modal: ModalRecord) -> None:
        """Write the mesh with its mode shapes."""
        ...

    def write_trajectory(
        self, folder: Path, records: BodyRecords, trajectory: Trajectory, body: str, every: int
    ) -> list[Path]:
        """Write every `every`-th frame of one body and return the paths of the files."""
        ...

    def write_results(
        self, folder: Path, bodies: Mapping[str, BodyRecords], trajectory: Trajectory, every: int
    ) -> list[Path]:
        """Write every `every`-th frame of all bodies, with one file that opens all of them, and return the paths."""
        ...


EXPORTERS: dict[str, Exporter] = {"vtu": vtu}
"""Members by the name of their format."""
