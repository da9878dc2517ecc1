"""Choices of kept interface, compared with the full wheel: the data of the report and its picture."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gudgeon.modaldb.records.cyclic import WheelRecord
from gudgeon.pipeline.applications.wheel.response import amplitudes
from gudgeon.pipeline.applications.wheel.scene import Wheel
from gudgeon.pipeline.report.document import Errors

FULL = "full wheel"
FREQUENCY, TUNED, MAGNIFICATION, RESPONSE = "frequencies", "frequencies, tuned", "magnification", "response"


@dataclass(frozen=True)
class InterfaceRow:
    """One choice of kept interface; figures are of the mistuned wheel unless stated otherwise."""

    name: str
    scheme: str
    record: WheelRecord
    errors: Errors
    """Against the full wheel: largest relative error of the compared frequencies, mistuned and tuned; of the
    magnification, signed; relative L2 error of all blades' complex amplitudes over the band."""
    wall_sector: float
    """Wall time of the sector's own reduction, once for all choices [s]."""
    wall: float
    """Wall time of modes and response, without that reduction [s]."""

    @property
    def coordinates(self) -> int:
        """Number of coordinates of the whole wheel."""
        return self.record.counts["coordinates"]

    @property
    def kept(self) -> int:
        """Number of physical dofs of a face."""
        return self.record.counts["kept"]

    @property
    def magnification(self) -> float:
        """Largest amplitude over that of the tuned wheel."""
        return self.record.quantities["magnification"]["value"]

    @property
    def cpu(self) -> float:
        """CPU time from the sector's matrices to the response [s]."""
        return sum(self.record.counts[key] for key in ("cpu_sector", "cpu_modes", "cpu_response"))


@dataclass(frozen=True)
class Comparison:
    """The full wheel, as the first row, and every choice."""

    scene: str
    wheel: Wheel
    sector: dict[str, Any]
    """Dofs of a sector, of its face and of the wheel, by name."""
    harmonics_against_full: float
    """Largest relative difference of the tuned wheel's frequencies by harmonics from those of all its dofs."""
    truncation_error: float
    """Relative error of the largest amplitude by the compared modes, against a direct solution."""
    rows: list[InterfaceRow]


def differences(record: WheelRecord, reference: WheelRecord) -> Errors:
    """Return the errors of a wheel against another one, see `InterfaceRow.errors`."""
    ours, theirs = amplitudes(record.mistuned), amplitudes(reference.mistuned)
    gain, exact = (r.quantities["magnification"]["value"] for r in (record, reference))
    return {
        FREQUENCY: float(np.abs(record.mistuned_frequencies / reference.mistuned_frequencies - 1).max()),
        TUNED: float(np.abs(record.tuned_frequencies / reference.tuned_frequencies - 1).max()),
        MAGNIFICATION: gain / exact - 1,
        RESPONSE: float(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)),
    }
