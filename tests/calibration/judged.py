"""Runs of a case, and what it states over what it is off."""

import json
import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import gudgeon
from tests.calibration.case import Case
from tests.calibration.commands import COMMANDS

FLOOR = 1e-5
"""Relative error below which a figure is met: smaller ones of truth and statement are taken to be it."""
FINER = 8
"""Steps of a run over those of the run that shows their error."""
NEGLIGIBLE = 0.1
"""Share of the largest stated error of a figure by other sources below which that by one source does not matter."""
SOURCES = ("step", "basis", "mesh")
LARGEST = 0.5
"""True relative error from which a figure has no digit: a statement above half of that is enough."""


@dataclass(frozen=True)
class Row:
    """One figure of one case: what is stated and what is true."""

    kind: str
    number: int
    figure: str
    """Name of the estimate that covers it, such as `impulse` or `t.displacement`."""
    source: str
    """step, basis, mesh or total."""
    stated: float | None
    """Relative error; None without one."""
    true: float
    reason: str = ""
    """Why nothing is stated."""
    largest: float = 0.0
    """Largest stated error of the figure by another source."""

    @property
    def floor(self) -> float:
        """Error below which the figure is met, or the source does not matter beside another one."""
        return max(FLOOR, NEGLIGIBLE * min(self.largest, LARGEST) if self.source != "total" else 0.0)

    @property
    def ratio(self) -> float:
        """Stated over true error; both are at least the floor, at most `LARGEST`."""
        stated, true = (min(max(abs(error), self.floor), LARGEST) for error in (self.stated or 0.0, self.true))
        return stated / true


@dataclass(frozen=True)
class Answer:
    """What a command prints."""

    values: Mapping[str, float]
    estimates: Mapping[str, float]
    reasons: Mapping[str, str]
    """Why sources are not estimated."""
    histories: Mapping[str, tuple[np.ndarray, np.ndarray]]
    """Times [s] and values of probes, (s,) and (s, k)."""
    kinds: Mapping[str, str]
    """Of the probes."""
    step: float | None
    """Step of a run whose integrator has one [s]."""

    def size(self, figure: str) -> float:
        """Return the largest size of a probe's history, 0 of other figures."""
        owner = figure.partition(".")[0]
        if owner not in self.histories:
            return 0.0
        return float(np.linalg.norm(self.histories[owner][1], axis=1).max())


class Failed(Exception):
    """A run did not finish."""


def rows_of(kind: str, number: int, case: Case, folder: Path) -> Iterator[Row]:
    """Yield the rows of a case; raises Failed, InputError, StageError."""
    if case.command != "solve":
        for figure, stated, true, source in COMMANDS[case.command](case, folder):
            yield Row(kind, number, figure, source, stated, true)
        return
    answer = solved(case, {}, folder)
    errors: dict[tuple[str, str], float] = {}

    def note(figure: str, source: str, value: float) -> None:
        errors[figure, source] = max(errors.get((figure, source), 0.0), value)

    for name, exact in case.exact.items():
        figure, truth = figure_of(name), exact(answer.values) if callable(exact) else exact
        note(figure, "total", relative(answer.values.get(name, 0.0), truth, answer.size(figure)))
    for name, history in case.histories.items():
        times, values = answer.histories[name]
        truth = history(times)
        figure = f"{name}.{answer.kinds[name]}"
        note(figure, "total", float(np.abs(values[:, 0] - truth).max() / np.abs(truth).max()))
    finer = {source: dict(overrides) for source, overrides in case.finer.items()}
    fixed: dict[str, Any] = {"run.step": answer.step} if answer.step else {}
    windows = [value for name, value in answer.values.items() if name.endswith(".force_window")]
    if windows and windows[0] > 0:  # Peaks are compared over one window.
        fixed["run.window"] = windows[0]
    finer = {source: overrides | fixed for source, overrides in finer.items()}
    if case.steps and answer.step:
        finer["step"] = fixed | {"run.step": answer.step / FINER}
    for source, overrides in finer.items():
        against = solved(case, overrides | {"run.checks": False}, folder)
        for name in [*case.exact, *case.read]:
            if name in against.values and name.partition(".")[0] not in answer.histories:
                figure = figure_of(name)
                note(figure, source, relative(answer.values[name], against.values[name], answer.size(figure)))
        for name, (_, values) in answer.histories.items():
            truth = against.histories[name][1]
            if truth.shape == values.shape and answer.size(f"{name}.{answer.kinds[name]}"):
                difference = np.linalg.norm(values - truth, axis=1).max() / np.linalg.norm(truth, axis=1).max()
                note(f"{name}.{answer.kinds[name]}", source, float(difference))
    for (figure, source), true in errors.items():
        stated, reason = stated_of(answer, figure, source)
        others = [answer.estimates.get(f"{name}.{figure}", 0.0) for name in SOURCES if name != source]
        yield Row(kind, number, figure, source, stated, true, reason, max(others))


def relative(value: float, truth: float, size: float) -> float:
    """Return a relative error, over the larger of the exact value and the size of its history."""
    scale = max(size, abs(truth))
    return abs(value - truth) / scale if scale else abs(value)


def stated_of(answer: Answer, figure: str, source: str) -> tuple[float | None, str]:
    """Return the stated error of a figure by a source, or by all of them, and why there is none."""
    stated, reasons = [], []
    for name in SOURCES if source == "total" else [source]:
        entry = answer.estimates.get(f"{name}.{figure}")
        if entry is None and name == "step":
            entry = answer.estimates.get("step.motion")
        if entry is not None:
            stated.append(entry)
        elif name in answer.reasons:
            reasons.append(answer.reasons[name])
    return (sum(stated) if stated else None), "; ".join(reasons)


PLAIN = {"impulse": "impulse", "force_peak": "force", "force_peak_raw": "force", "rebound_velocity": "rebound",
         "restitution": "rebound"}  # fmt: skip
READ = ("displacement", "velocity", "acceleration", "rotation", "force", "moment", "distance")


def figure_of(quantity: str) -> str:
    """Return the name of the estimate that covers a quantity."""
    owner, _, name = quantity.partition(".")
    if "." in name:  # Of a gauge of a body.
        return quantity.rpartition(".")[0]
    if name == "wear_volume":
        return quantity
    if name in PLAIN and owner not in ("r", "v", "t", "d", "j"):
        return PLAIN[name]
    base = name.removesuffix("_peak").removesuffix("_end")
    return f"{owner}.{base}" if base in READ else f"{owner}.{base.rstrip('xyz').rstrip('_')}"


def solved(case: Case, overrides: Mapping[str, Any], folder: Path) -> Answer:
    """Return the figures and stated errors of a run."""
    settings = {"run.checks": True} | dict(overrides)
    report = gudgeon.run(case.scene, set=settings, db=folder / "db", out=folder / "out", until="solve",
                         progress=lambda *_: None)  # fmt: skip
    if report.result != "FINISHED":
        raise Failed(f"{report.result}: {report.reason}")
    values = {name: entry["value"] for name, entry in report.quantities.items()}
    record = report.trajectory()
    histories = {name: (np.asarray(record.times), np.asarray(p.values)[:, :3]) for name, p in record.probes.items()}
    kinds = {name: p.kind for name, p in record.probes.items()}
    step = float(record.counts["step"]) if record.counts.get("integrator") == "small" else None
    return Answer(values, report.estimates, getattr(report, "not_estimated", {}), histories, kinds, step)


def judged(kind: str, number: int, case: Case, folder: Path) -> dict[str, Any]:
    """Return the rows of a case and its CPU time as JSON, or why it failed."""
    start = time.process_time()
    entry: dict[str, Any] = {"kind": kind, "number": number}
    try:
        rows = list(rows_of(kind, number, case, folder))
        entry["rows"] = [asdict(row) for row in rows if math.isfinite(row.true)]
    except Exception as failure:  # What fails is a row of the table, too.
        entry["failed"] = f"{type(failure).__name__}: {str(failure)[:300]}"
    return entry | {"cpu": round(time.process_time() - start, 2), "scene": json.dumps(case.scene)}
