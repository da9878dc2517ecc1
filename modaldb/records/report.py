"""Records of measurements and reports."""

from dataclasses import dataclass

from gudgeon.modaldb.records.types import Json


@dataclass(frozen=True)
class MeasurementRecord:
    """Time and memory that a product took, measured alone on one machine."""

    seconds: Json
    """Part → {"wall", "cpu"} [s]: stages in an empty database, or a solution with its preparation."""
    peak_mib: float
    """Largest resident memory of the process during the measurement [MiB]."""
    counts: Json
    """Numbers of operations, such as `factorisations`."""
    machine: Json


@dataclass(frozen=True)
class ReportRecord:
    """The result of a sweep over a scene: the document of `report.json`."""

    document: Json
