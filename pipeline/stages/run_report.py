"""What a run found, whatever the kind of its scene."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

Progress = Callable[[str, float], None]
"""Told the stage's name and the share of it that is done."""


@dataclass
class StageReport:
    """What became of one stage."""

    state: str
    """`ran` or `fresh`."""
    seconds: float
    key: str


@dataclass(frozen=True)
class RunReport:
    """What a run found, as `--json` prints it."""

    scene: str
    result: str | None
    stages: dict[str, StageReport] = field(default_factory=dict)
    quantities: dict[str, Any] = field(default_factory=dict)
    energy_drift: float | None = None
    momentum_residual: float | None = None
    out: str = ""
    files: tuple[str, ...] = ("summary.json", "trajectory.h5")
    """Names of what stands in `out` beside the pictures."""
    pictures: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    frequencies: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    """Modes of each component with their errors, where a run ends with them; see `frequency_table`."""
    reason: str | None = None
    """Why a run failed physically; None where it did not."""

    def as_json(self) -> dict[str, Any]:
        """Return the document."""
        return {
            "scene": self.scene,
            "result": self.result,
            "stages": {name: vars(stage) for name, stage in self.stages.items()},
            "quantities": self.quantities,
            "energy_drift": self.energy_drift,
            "momentum_residual": self.momentum_residual,
            "out": self.out,
            "pictures": self.pictures,
            "frequencies": self.frequencies,
            "notes": self.notes,
            "reason": self.reason,
        }
