"""The report of a run, the same for every kind of scene."""

import base64
import html
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gudgeon.pipeline.errors import InputError, pandas

if TYPE_CHECKING:
    from pandas import DataFrame

    from gudgeon.modaldb.records.trajectory import Trajectory
    from gudgeon.pipeline.plots.base.frames import BodyFrames

Progress = Callable[[str, float], None]
"""Called with the stage's name and the share of it that is done, 0 to 1."""


@dataclass
class StageReport:
    """Whether one stage was computed, how long it took, and the keys of its records."""

    state: str
    """`ran` or `fresh`."""
    seconds: float
    key: str
    """Key of the stage's record, or one key for all where it has several."""
    keys: dict[str, str] = field(default_factory=dict)
    """Key of the record of each component, or of the scene."""
    cpu: float = 0.0
    """CPU time of computing its records, without reading and writing the database [s]."""


SHOWN = ("deformation.png", "mechanism.png", "force.png")
"""Pictures of a run, the one that a notebook shows first."""
TRAJECTORY = "trajectory.h5"
"""Copy of the record of a run, beside its summary."""


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
    not_estimated: dict[str, str] = field(default_factory=dict)
    """Why there are none, by source of the error, `step`, `basis`, `mesh`, and by what quantities are, as `times`."""
    out: str = ""
    files: tuple[str, ...] = ("summary.json", TRAJECTORY)
    """Names of the files in `out` in addition to the pictures."""
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
    job: Any = field(default=None, repr=False, compare=False)
    """The job of `gudgeon.run`, whose database has the records; None of a report of the command line."""

    def as_json(self) -> dict[str, Any]:
        """Return the document that `--json` prints."""
        document = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("files", "job")}
        return document | {"stages": {name: vars(stage) for name, stage in self.stages.items()}}

    def to_frame(self) -> "DataFrame":
        """Return the quantities as a table: value, unit, reference and error of each.

        Raises:
            ImportError: pandas is not installed.
        """
        rows = {name: {key: q[key] for key in ("value", "unit", "reference", "error")}
                for name, q in self.quantities.items()}  # fmt: skip
        return pandas().DataFrame.from_dict(rows, orient="index", columns=["value", "unit", "reference", "error"])

    def trajectory(self) -> "Trajectory":
        """Return the record of the run.

        Raises:
            InputError: the run has none, such as that of a wheel or one that ended before the stage `solve`.
        """
        from gudgeon.modaldb.format.hdf5 import read_record

        if (key := self._key()) is not None:  # The folder may have the results of another run since.
            return self.job.store.get(key, "trajectory")
        path = Path(self.out) / TRAJECTORY
        if TRAJECTORY not in self.files or not self.out or not path.is_file():
            raise InputError(f"{self.scene}: no trajectory; run a scene of bodies up to the stage 'solve'")
        return read_record(path, "trajectory")

    def _key(self) -> str | None:
        """Return the key of the record of the run in the database; None where it is not known."""
        has_one = self.job is not None and TRAJECTORY in self.files and "solve" in self.stages
        return self.stages["solve"].key if has_one else None

    @property
    def frames(self) -> "dict[str, BodyFrames]":
        """Displacement of the nodes of each body at the frames of the run, by the body's name.

        Raises:
            InputError: as `trajectory`; or the bodies turn by any angle.
        """
        from gudgeon.pipeline.plots.base.frames import body_frames

        if (key := self._key()) is None:
            raise InputError(
                f"{self.scene}: no frames; gudgeon.run of a scene of bodies up to the stage 'solve' has them"
            )
        return body_frames(self.job.store, key, self.scene)

    def plot(self) -> Any:
        """Return the forces of all contacts over time, a `matplotlib.figure.Figure`.

        Raises:
            InputError: as `trajectory`.
        """
        from gudgeon.pipeline.plots.figures import force_figure

        return force_figure(self.trajectory())

    def _repr_html_(self) -> str:
        head = f"<b>{html.escape(self.scene)}: {html.escape(self.reason or self.result or 'no run')}</b>"
        pictures = {Path(name).name: Path(name) for name in self.pictures}
        name = next((p for p in SHOWN if p in pictures), None)
        image = ""
        if name is not None and pictures[name].is_file():
            image = image_html(pictures[name], 480)
        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{q['value']:.6g}</td><td>{html.escape(q['unit'])}</td></tr>"
            for name, q in self.quantities.items()
        )
        return f"{head}{image}<table><tr><th>quantity</th><th>value</th><th>unit</th></tr>{rows}</table>"


def image_html(path: Path, width: int) -> str:
    """Return a PNG as HTML that holds it."""
    coded = base64.b64encode(path.read_bytes()).decode()
    return f'<div><img alt="{html.escape(path.name)}" width="{width}" src="data:image/png;base64,{coded}"></div>'
