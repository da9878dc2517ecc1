"""A report as data, for every kind of scene; docs/report.md describes each field for readers of `report.json`.

Errors are relative to the reference value and signed, absolute where the reference is zero; those of histories are
relative L2 norms without sign. None is a value that a run does not have.
"""

import io
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import SkipValidation, TypeAdapter

from gudgeon.pipeline.errors import pandas
from gudgeon.pipeline.files import csv_text as rows_text
from gudgeon.pipeline.process.clock import Seconds

if TYPE_CHECKING:
    from pandas import DataFrame

SCHEMA = 1
"""Version of the document; raised when a field changes its meaning, its name or goes."""
MISSING = "not estimated"
"""Beginning of `Term.how` where an error could not be estimated."""
Number = Annotated[float, SkipValidation]
"""One that a document which was read back has as None where it was not finite."""
Errors = dict[str, Number]
"""By the name of the quantity."""


@dataclass(frozen=True)
class StageSeconds:
    """Time of a stage with an empty database, and with all records present."""

    cold: Seconds | None
    warm: Seconds | None


@dataclass(frozen=True)
class Run:
    """The errors, times and counts of one setting."""

    name: str
    kind: str
    """`reduced`, `nodal`: full FE, or `spline`: a degree of splines that is compared only."""
    scheme: str
    """Common to runs that differ in basis or step only."""
    settings: dict[str, Any]
    """Changes of the scene by this run, as nested tables."""
    coordinates: int
    result: str
    """`FINISHED`, or the reason of the failure."""
    errors: Errors
    """By quantity; a failed run has none."""
    largest_error: float | None = None
    """Absolute value of the largest error in the quantities that count; see `Quantity.counts`."""
    largest_of: str | None = None
    truncation: Errors | None = None
    """Difference from the largest basis of the same scheme and step."""
    truncation_against: str = ""
    """Name of that run, or why there is none."""
    time: Errors | None = None
    """Difference from the finest step of the same scheme and basis."""
    time_against: str = ""
    energy_drift: float | None = None
    momentum_residual: float | None = None
    step: float | None = None
    """[s]; None if the integrator chooses its own steps."""
    steps: int | None = None
    factorisations: int | None = None
    iterations: int | None = None
    """Pivots of the contact problem, or Newton iterations of full FE."""
    cpu_seconds: float = 0.0
    """CPU time of the solution alone, the least of the repeats; chart and front use it [s]."""
    wall_seconds: float = 0.0
    stages: dict[str, StageSeconds] = field(default_factory=dict)
    peak_mib: float | None = None
    """Largest resident memory of the process during the solution [MiB]."""
    front: bool = False
    """Whether no other run is both faster and has a smaller conservative error."""
    conservative_error: float | None = None
    """Largest of total, truncation and time error over the quantities that count; chart, front and choice use it."""


@dataclass(frozen=True)
class Chain:
    """Values of a quantity along one axis of the sweep, coarse to fine, all else equal."""

    axis: str
    """`basis`, `step`, `mesh` or `grid`."""
    runs: list[str]
    """Names; finer runs that serve as references only are not among the runs of the report."""
    sizes: list[Number]
    """Coordinates of each; its step [s] or accuracy; its edge length [m]; its spacing over that of the grid."""
    values: list[Number]
    """Errors, or values relative to the finest one."""
    differences: list[Number]
    """Relative difference of each from the finest; the last is 0."""
    converges: bool | None
    """None if there are too few runs."""
    order: float | None
    """Order of convergence in 1/coordinates, step or edge length, if it converges."""


@dataclass(frozen=True)
class Quantity:
    """A compared quantity and its convergence over the sweep."""

    name: str
    unit: str
    measure: str
    """`relative`, `absolute` or `L2`."""
    reference: float | None
    counts: bool
    """Whether it enters `largest_error`: not if its only reference is a sweep over which it does not converge."""
    converges: bool | None
    """Along every chain; None if no chain is long enough."""
    why: str
    """Result of the convergence check, in words."""
    chains: list[Chain]
    uncertainty: float | None = None
    """Estimated relative error of the reference itself, where it is an extrapolation."""


@dataclass(frozen=True)
class Cost:
    """CPU time for an accuracy by one method, on one thread: seconds of one run, and of several on the same bodies."""

    tolerance: float
    method: str
    """`reduced`, `nodal`: full FE, or `rival`: a model of `report.rivals`."""
    run: str
    """The setting, or the full-FE step and how it was found; why there is none."""
    error: float | None = None
    """Conservative error of the run; of full FE the total error."""
    integration: float | None = None
    """The time loop alone, of full FE without assembly and factorisation [s]."""
    database: float | None = None
    """With reading records and compiling the scene, or assembly and factors; mesh and modes are in the database [s]."""
    first: float | None = None
    """With mesh, modes, residual flexibility and all else [s]."""
    ten: float | None = None
    """The first run and nine from the database; full FE keeps its factors [s]."""
    hundred: float | None = None


@dataclass(frozen=True)
class Choice:
    """The fastest run within a tolerance; if there is none, error and quantity of the nearest one."""

    tolerance: float
    run: str | None = None
    settings: dict[str, Any] | None = None
    error: float | None = None
    of: str | None = None
    cpu_seconds: float | None = None
    why: str = ""


@dataclass(frozen=True)
class Term:
    """Source of error of a run, such as step or mesh: estimates from runs that differ in it only."""

    source: str
    """`basis`, `step`, `mesh`, `spline spacing` or `contact layer`."""
    how: str
    """Method of the estimate, or the reason why there is none, in words."""
    errors: Errors = field(default_factory=dict)
    """Estimated error of each quantity, without sign; empty if there is none."""
    orders: Errors = field(default_factory=dict)
    """Observed order of convergence of each quantity that has one."""
    size: float | None = None
    """Largest error of the quantities that count."""
    of: str | None = None

    @property
    def bound(self) -> float | None:
        """The size, also of a document that was read back, which has no infinity."""
        return math.inf if self.size is None and self.of is not None else self.size

    @property
    def missing(self) -> bool:
        """Whether there is such an error, but no estimate of it."""
        return self.how.startswith(MISSING)


@dataclass(frozen=True)
class Budget:
    """The error budget of one run."""

    run: str
    terms: list[Term]

    def term(self, source: str) -> Term | None:
        """Return a term, None if the budget has none of this source."""
        return next((t for t in self.terms if t.source == source), None)


@dataclass(frozen=True)
class Table:
    """A further table of a kind of scene."""

    title: str
    columns: list[str]
    rows: list[list[str]]
    note: str = ""


@dataclass(frozen=True)
class Document:
    """A report."""

    scene: str
    command: str
    reference: dict[str, str]
    """`kind`: analytic, published, nodal or finest; `source`: in words."""
    machine: dict[str, Any]
    version: str
    quantities: list[Quantity]
    runs: list[Run]
    left_out: list[dict[str, str]] = field(default_factory=list)
    """Omitted settings of the sweep: `name` and `why`."""
    changes: list[dict[str, Any]] = field(default_factory=list)
    """Reuse against recompute, one row per design change."""
    choice: Choice | None = None
    budget: Budget | None = None
    """Error budget of the chosen run, or of that with the least conservative error; None for kinds without a budget."""
    costs: list[Cost] = field(default_factory=list)
    """Run times for tolerances by method; empty without full FE or rivals."""
    window: float = 0.0
    """Full width of the Hann window on forces [s]."""
    peak_window: float = 0.0
    """Window of the quantities `force_peak` in all runs, `run.window` [s]; 0 where forces are not averaged."""
    until: float | None = None
    """Time up to which runs are compared [s]."""
    notes: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    timing: str = ""
    """Text on how times were measured."""
    kind: str = "body"
    """Kind of the scene, by its identifying table."""
    schema: int = SCHEMA

    def as_json(self) -> dict[str, Any]:
        """Return the document of `report.json`: plain types, no NaN or infinity."""
        return _plain(asdict(self))

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> "Document":
        """Return the document that `as_json` made; what was not finite is None."""
        return TypeAdapter(cls).validate_python(document)

    def to_frame(self) -> "DataFrame":
        """Return the table of `report.csv`, one row a run.

        Raises:
            ImportError: pandas is not installed.
        """
        return pandas().read_csv(io.StringIO(csv_text(self)))

    def as_text(self) -> str:
        """Return the text of `report.json`."""
        return json.dumps(self.as_json(), indent=1, allow_nan=False, ensure_ascii=False)


def counted_names(quantities: Sequence[Quantity]) -> set[str]:
    """Return the names of the quantities that count."""
    return {quantity.name for quantity in quantities if quantity.counts}


def csv_text(document: Document) -> str:
    """Return `report.csv`: one line per run; columns of errors are named `error: QUANTITY` and the like.

    Those of the budget, `budget SOURCE: QUANTITY`, have values in the line of its run.
    """
    plain = (
        "name", "kind", "scheme", "coordinates", "result", "largest_error", "largest_of", "conservative_error",
        "energy_drift", "momentum_residual", "step", "steps", "factorisations", "iterations", "cpu_seconds",
        "wall_seconds", "peak_mib", "front",
    )  # fmt: skip
    runs, budget = document.runs, document.budget or Budget("", [])
    stages = dict.fromkeys(stage for run in runs for stage in run.stages)
    columns: dict[str, list[Any]] = {name: [getattr(run, name) for run in runs] for name in plain}
    labels = {"error": "errors", "truncation": "truncation", "time": "time"}
    for (label, key), quantity in itertools.product(labels.items(), document.quantities):
        columns[f"{label}: {quantity.name}"] = [(getattr(run, key) or {}).get(quantity.name) for run in runs]
    for term, quantity in itertools.product(budget.terms, document.quantities):
        errors = {budget.run: term.errors.get(quantity.name)}
        columns[f"budget {term.source}: {quantity.name}"] = [errors.get(run.name) for run in runs]
    for stage, state, clock in itertools.product(stages, ("cold", "warm"), ("wall", "cpu")):
        seconds = [getattr(run.stages.get(stage), state, None) for run in runs]
        columns[f"{stage} {state} {clock}"] = [getattr(s, clock, None) for s in seconds]
    return rows_text([columns, *zip(*columns.values(), strict=True)])


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, bool) or value is None or isinstance(value, str | int):
        return value
    return float(value) if math.isfinite(value) else None
