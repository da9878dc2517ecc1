"""The report of a run, the same for every kind of scene."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any

Progress = Callable[[str, float], None]
"""Called with the stage's name and the share of it that is done, 0 to 1."""


@dataclass
class StageReport:
    """Whether one stage was computed, how long it took, and the key of its records."""

    state: str
    """`ran` or `fresh`."""
    seconds: float
    key: str


@dataclass(frozen=True)
class RunReport:
    """Stages, quantities and files of a run; `--json` prints the fields in this order, without `files`."""

    scene: str
    result: str | None
    stages: dict[str, StageReport] = field(default_factory=dict)
    quantities: dict[str, Any] = field(default_factory=dict)
    energy_drift: float | None = None
    momentum_residual: float | None = None
    estimates: dict[str, float] = field(default_factory=dict)
    """Estimated relative errors by name, such as `step.impulse`; see `Trajectory.estimates`."""
    out: str = ""
    files: tuple[str, ...] = ("summary.json", "trajectory.h5")
    """Names of the files in `out` beside the pictures."""
    pictures: list[str] = field(default_factory=list)
    frequencies: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    """Modes of each component with their errors, if the run ends with the stage `modes`; see `frequency_table`."""
    notes: list[str] = field(default_factory=list)
    reason: str | None = None
    """Why a run failed physically; None if it did not."""

    def as_json(self) -> dict[str, Any]:
        """Return the document that `--json` prints."""
        document = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "files"}
        return document | {"stages": {name: vars(stage) for name, stage in self.stages.items()}}
