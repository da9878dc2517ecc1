"""The report of a run, the same for every kind of scene."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any

Progress = Callable[[str, float], None]
"""Called with the stage's name and the share of it that is done, 0 to 1."""


@dataclass
class StageReport:
    """Whether one stage was computed, how long it took, and the keys of its records."""

    state: str
    """`ran` or `fresh`."""
    seconds: float
    key: str
    """Of its record, or one for all where it has several."""
    keys: dict[str, str] = field(default_factory=dict)
    """Of the record of each component, or of the scene."""
    cpu: float = 0.0
    """CPU time of computing its records, without reading and writing the database [s]."""


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
    parts: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Size and inertia of each component, if the run ends with the stage `mesh`; extents and mass of each meshed one,
    if it solves; see `stages.parts`."""
    changes: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Estimated changes of each component that reuses modes after a design change, and its tolerance."""
    notes: list[str] = field(default_factory=list)
    reason: str | None = None
    """Why a run failed physically; None if it did not."""

    def as_json(self) -> dict[str, Any]:
        """Return the document that `--json` prints."""
        document = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "files"}
        return document | {"stages": {name: vars(stage) for name, stage in self.stages.items()}}
