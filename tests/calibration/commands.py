"""Commands other than `solve` whose figures have stated errors: frequencies."""

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import gudgeon
from gudgeon.pipeline.stages.run import run_job
from tests.calibration.case import Case

Figure = tuple[str, float | None, float, str]


def frequencies(case: Case, folder: Path) -> Iterator[Figure]:
    """Yield the stated and true errors of a part's elastic frequencies; in groups that are equal, in order."""
    rows = modes_of(case, {}, folder)
    exact = list(case.options.get("exact", ()))
    if not exact:
        exact = [f for f, _ in modes_of(case, case.finer["mesh"], folder)]
    for number, ((frequency, stated), true) in enumerate(zip(rows, exact, strict=False)):
        yield f"frequency {number + 1}", stated, abs(frequency / true - 1), "mesh"


def modes_of(case: Case, overrides: Mapping[str, Any], folder: Path) -> list[tuple[float, float | None]]:
    """Return frequencies [Hz] and their stated errors."""
    job = gudgeon.open_job(case.scene, set=overrides, db=folder / "db", out=folder / "out")
    run_job(job, "modes")
    record = job.store.get(job.components()["b"]["modes"].key, "modes")
    errors = record.discretisation_errors
    rows = []
    for mode in range(record.normal_count):
        stated = None if errors is None or not math.isfinite(errors[mode]) else float(errors[mode])
        rows.append((float(record.angular_frequencies[mode]) / 2 / math.pi, stated))
    return rows


def assembled_frequencies(case: Case, folder: Path) -> Iterator[Figure]:
    """Yield the stated and true errors of assembled frequencies, by all sources."""
    answer = gudgeon.linear(case.scene, db=folder / "db", out=folder / "out-linear", progress=lambda *_: None)
    rows = [row for row in answer.modes if row["frequency"] > 0]
    for row, true in zip(rows, case.options["exact"], strict=False):
        stated = row.get("estimated_errors") or None
        total = None if stated is None else sum(stated.values())
        yield f"frequency {row['number']}", total, abs(row["frequency"] / true - 1), "total"


COMMANDS: dict[str, Callable[[Case, Path], Iterator[Figure]]] = {
    "frequencies": frequencies,
    "linear": assembled_frequencies,
}
