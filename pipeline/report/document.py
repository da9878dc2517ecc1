"""A report as data, whatever the kind of its scene; docs/report.md describes it for readers of `report.json`.

Errors are relative to the reference value and signed, absolute where the reference is zero; those of histories are
relative L2 norms and of no sign. None stands for what a run does not have.
"""

import csv
import io
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from gudgeon.modaldb.records.types import FORMER
from gudgeon.pipeline.measuring.clock import Seconds

SCHEMA = 3
"""Version of the document; raised when a field changes its meaning, its name or goes."""
Errors = dict[str, float]
"""By the name of the quantity."""


@dataclass(frozen=True)
class StageSeconds:
    """A stage in an empty database and with everything at hand, both with libraries loaded and loops compiled."""

    cold: Seconds | None
    warm: Seconds | None


@dataclass(frozen=True)
class Run:
    """One setting, or one contestant: its errors beside what it took."""

    name: str
    kind: str
    """`reduced`, or `nodal`: full FE."""
    scheme: str
    """What it has in common with runs that differ in basis or step only."""
    settings: dict[str, Any]
    """What it changes of the scene, as nested tables."""
    coordinates: int
    result: str
    """`FINISHED`, or why it failed."""
    errors: Errors
    """By quantity, against the reference; a failed run has none."""
    largest_error: float | None = None
    """Of the quantities that count; see `Quantity.counts`."""
    largest_of: str | None = None
    truncation: Errors | None = None
    """What its basis lacks: against the largest basis of the same scheme and step."""
    truncation_against: str = ""
    """Name of that run, or why there is none."""
    time: Errors | None = None
    """What its step adds: against the finest step of the same scheme and basis."""
    time_against: str = ""
    """Name of that run, or why there is none."""
    energy_drift: float | None = None
    momentum_residual: float | None = None
    step: float | None = None
    """[s]; None where the integrator chooses its own."""
    steps: int | None = None
    factorisations: int | None = None
    """Of sparse matrices: for the bases of a reduced run, for the steps of a nodal one."""
    iterations: int | None = None
    """Pivots of the contact problem, Newton iterations of the full-FE run."""
    cpu_seconds: float = 0.0
    """Of the solution alone, least of the repeats: what the picture and the front show."""
    wall_seconds: float = 0.0
    stages: dict[str, StageSeconds] = field(default_factory=dict)
    """`mesh`, `modes`, `morph`, `solve`."""
    peak_mib: float | None = None
    """Largest resident memory of the process during the solution."""
    front: bool = False
    """Whether no other run is both faster and better by its conservative error."""
    conservative_error: float | None = field(default=None, metadata={FORMER: "sound_error"})
    """Largest of total, truncation and time error over the quantities that count; chart, front and choice use it."""


@dataclass(frozen=True)
class Chain:
    """Values of a quantity along one axis of the sweep, coarse to fine, all else equal."""

    axis: str
    """`basis` or `step`."""
    runs: list[str]
    """Some may stand here only: finer steps that serve as references are no runs of the report."""
    sizes: list[float]
    """Coordinates of each; its step [s] or accuracy; its edge length [m]."""
    values: list[float]
    """Errors, or values over the finest one."""
    differences: list[float]
    """Of each from the finest, relative; the last is 0."""
    converges: bool | None
    """None where there are too few."""
    order: float | None
    """Fitted in 1/coordinates or step where it converges, else None."""


@dataclass(frozen=True)
class Quantity:
    """What is compared."""

    name: str
    unit: str
    measure: str
    """`relative`, `absolute` or `L2`."""
    reference: float | None
    counts: bool
    """Whether it enters `largest_error`: not where its only reference is a sweep over which it does not converge."""
    converges: bool | None
    """Whether it settles along every chain; None where no chain is long enough to tell."""
    why: str
    """What was found, in words; flagged quantities say so here."""
    chains: list[Chain]


@dataclass(frozen=True)
class Choice:
    """The cheapest run that meets a tolerance."""

    tolerance: float
    run: str | None
    settings: dict[str, Any] | None
    error: float | None
    of: str | None
    cpu_seconds: float | None
    why: str
    """In words; where there is none, what comes nearest."""


@dataclass(frozen=True)
class Table:
    """Something that a kind of scene reports beside its runs."""

    title: str
    columns: list[str]
    rows: list[list[str]]
    note: str = ""


@dataclass(frozen=True)
class Document:
    """A whole report."""

    scene: str
    command: str
    reference: dict[str, str]
    """`kind`: analytic, published, nodal or finest; `source`: in words."""
    machine: dict[str, Any]
    version: str
    quantities: list[Quantity]
    runs: list[Run]
    left_out: list[dict[str, str]] = field(default_factory=list)
    """Settings of the sweep that contradict themselves: `name` and `why`."""
    changes: list[dict[str, Any]] = field(default_factory=list)
    """Reuse against recompute, one row a design change."""
    choice: Choice | None = None
    window: float = 0.0
    """Full width of the Hann window on forces [s]."""
    until: float | None = None
    """[s]"""
    notes: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    timing: str = ""
    """How seconds were taken."""
    schema: int = SCHEMA

    def as_json(self) -> dict[str, Any]:
        """Return the document of `report.json`: plain types, no NaN or infinity."""
        return _plain(asdict(self))

    @classmethod
    def from_json(cls, found: Mapping[str, Any]) -> "Document":
        """Return the document that `as_json` made, of this schema or an earlier one; what was not finite is None."""
        parts = {
            "quantities": [_quantity(entry) for entry in found["quantities"]],
            "runs": [_run(entry) for entry in found["runs"]],
            "choice": None if found["choice"] is None else Choice(**found["choice"]),
            "tables": [Table(**entry) for entry in found["tables"]],
        }
        return cls(**{**found, **parts, "schema": SCHEMA})

    def as_text(self) -> str:
        """Return the text of `report.json`."""
        return json.dumps(self.as_json(), indent=1, allow_nan=False, ensure_ascii=False)


def csv_text(document: Document) -> str:
    """Return `report.csv`: one line a run; columns of errors are named `error: QUANTITY` and the like."""
    names = [quantity.name for quantity in document.quantities]
    plain = (
        "name", "kind", "scheme", "coordinates", "result", "largest_error", "largest_of", "conservative_error",
        "energy_drift", "momentum_residual", "step", "steps", "factorisations", "iterations", "cpu_seconds",
        "wall_seconds", "peak_mib", "front",
    )  # fmt: skip
    parts = (("error", "errors"), ("truncation", "truncation"), ("time", "time"))
    stages = list(dict.fromkeys(stage for run in document.runs for stage in run.stages))
    header = [*plain, *(f"{label}: {name}" for label, _ in parts for name in names)]
    header += [
        f"{stage} {state} {clock}" for stage in stages for state in ("cold", "warm") for clock in ("wall", "cpu")
    ]
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(header)
    for run in document.runs:
        row: list[Any] = [getattr(run, name) for name in plain]
        row += [(getattr(run, part) or {}).get(name) for _, part in parts for name in names]
        for stage in stages:
            entry = run.stages.get(stage, StageSeconds(None, None))
            for taken in (entry.cold, entry.warm):
                row += [None, None] if taken is None else [taken.wall, taken.cpu]
        writer.writerow(["" if value is None else value for value in row])
    return text.getvalue()


def _quantity(entry: Mapping[str, Any]) -> Quantity:
    return Quantity(**{**entry, "chains": [Chain(**chain) for chain in entry["chains"]]})


def _run(entry: Mapping[str, Any]) -> Run:
    stages = {
        name: StageSeconds(*(None if states[key] is None else Seconds(**states[key]) for key in ("cold", "warm")))
        for name, states in entry["stages"].items()
    }
    former = {one.metadata[FORMER]: one.name for one in fields(Run) if FORMER in one.metadata}
    return Run(**{former.get(key, key): value for key, value in entry.items()} | {"stages": stages})


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, bool) or value is None or isinstance(value, str | int):
        return value
    return float(value) if math.isfinite(value) else None
