"""Records of measurements and reports."""

from dataclasses import dataclass

from gudgeon.modaldb.records.types import Json


@dataclass(frozen=True)
class MeasurementRecord:
    """What a product took, alone on one machine."""

    seconds: Json
    """Part → {"wall", "cpu"} [s]: stages in an empty database, or a solution and what surrounds it."""
    peak_mib: float
    """Largest resident memory of the process meanwhile."""
    counts: Json
    """Work that was done, `factorisations` of it."""
    machine: Json


@dataclass(frozen=True)
class ReportRecord:
    """What a sweep over a scene found: the document of `report.json`."""

    document: Json
