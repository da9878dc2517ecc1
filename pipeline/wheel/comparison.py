"""One choice of kept interface against the full wheel."""

from dataclasses import dataclass
from typing import Any

from gudgeon.modaldb.records.cyclic import WheelRecord
from gudgeon.pipeline.report.document import Errors

FULL = "full wheel"
FREQUENCY, TUNED, MAGNIFICATION, RESPONSE = "frequencies", "frequencies, tuned", "magnification", "response"


@dataclass(frozen=True)
class InterfaceRow:
    """One choice of kept interface, on the mistuned wheel unless it says otherwise."""

    name: str
    scheme: str
    record: WheelRecord
    errors: Errors
    """Against the full wheel: largest relative error of the compared frequencies, mistuned and tuned; of the
    magnification, signed; relative L2 error of all blades' complex amplitudes over the band."""
    cpu_sector: float
    """For the sector's own reduction, once for all choices [s]."""
    wall_sector: float
    """[s]"""
    wall: float
    """For modes and response, that reduction aside [s]."""

    @property
    def coordinates(self) -> int:
        """Of the whole wheel."""
        return self.record.counts["coordinates"]

    @property
    def kept(self) -> int:
        """Physical dofs of a face."""
        return self.record.counts["kept"]

    @property
    def magnification(self) -> float:
        """Largest amplitude over that of the tuned wheel."""
        return self.record.quantities["magnification"]["value"]

    @property
    def cpu(self) -> float:
        """From the sector's matrices to the response [s]."""
        return self.cpu_sector + self.record.counts["cpu_modes"] + self.record.counts["cpu_response"]


@dataclass(frozen=True)
class Comparison:
    """Every choice beside the full wheel, which is the first row."""

    scene: str
    sectors: int
    compared: int
    """Lowest frequencies."""
    fixed_count: int
    sector: dict[str, Any]
    """Dofs of a sector, of its face, of the wheel."""
    engine_order: int
    harmonics_against_full: float
    """Largest relative difference of the tuned wheel's frequencies by harmonics from those of all its dofs."""
    truncation_error: float
    """Of the largest amplitude by the compared modes, against a direct solution."""
    rows: list[InterfaceRow]
