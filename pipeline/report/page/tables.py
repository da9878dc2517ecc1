"""Tables of a report as columns of texts, for the template of the page and as Markdown for the command."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gudgeon.pipeline.report.document import Document, Quantity, Run, StageSeconds, Table
from gudgeon.pipeline.report.page.words import (
    NOTHING,
    SETTLES,
    count_text,
    error_text,
    seconds_text,
    size_text,
    step_text,
)

LONG = 30
"""Number of characters above which a cell is text that wraps."""
Key = float | str | None
TIMES: Mapping[str, tuple[str, Callable[[float], str]]] = {
    "cpu_seconds": ("CPU time", seconds_text),
    "wall_seconds": ("wall time", seconds_text),
}
COUNTS: Mapping[str, tuple[str, Callable[[float], str]]] = {
    "step": ("step", step_text),
    "steps": ("steps", count_text),
    "factorisations": ("factorisations", count_text),
    "iterations": ("iterations", count_text),
    "energy_drift": ("energy drift", "{:.0e}".format),
    "momentum_residual": ("momentum residual", "{:.0e}".format),
    "peak_mib": ("memory [MiB]", count_text),
}
"""Title and writer of a column, by the member of a run."""


@dataclass(frozen=True)
class Column:
    """One column of a table. Lines of a text after the first are notes, which only HTML shows."""

    title: str
    texts: Sequence[str]
    keys: Sequence[Key] = ()
    """What the cells are sorted by; empty in a table that is not sorted."""
    kind: str | None = None
    """CSS class of its cells."""

    def key(self, row: int) -> str | None:
        """Return what a cell is sorted by, empty for what is unknown; None in a table that is not sorted."""
        if not self.keys:
            return None
        value = self.keys[row]
        return "" if value is None or (isinstance(value, float) and not math.isfinite(value)) else str(value)


@dataclass(frozen=True)
class Grid:
    """A table of the page, written by its template."""

    title: str
    """Of the first column."""
    heads: Sequence[Any]
    """Entries of the first column: texts, or the runs of the report."""
    columns: Sequence[Column]
    kinds: Sequence[str | None]
    """CSS classes of the rows."""
    name: str | None = None
    runs: bool = False
    """Whether the heads are runs, which open to their settings; such a table can be sorted."""
    heading: str = ""
    note: str = ""


def run_columns(document: Document) -> list[Column]:
    """Return one row per run: size, errors, times and counts; columns without an entry are omitted."""
    runs = document.runs
    conservative = [run.conservative_error for run in runs]
    columns = [
        *_plain(runs, {"coordinates": ("coordinates", count_text)}),
        Column("largest error", [*map(_largest, runs)], [_size(run.largest_error) for run in runs]),
        _texts("of", [run.largest_of for run in runs], "short"),
        _numbers("conservative error", conservative, size_text),
        _texts("result", [*map(_failure, runs)], "short result"),
        _parts("truncation error", runs, "truncation"),
        _parts("time error", runs, "time"),
        *_plain(runs, TIMES),
        *(_stage(stage, runs) for stage in dict.fromkeys(name for run in runs for name in run.stages)),
        *_plain(runs, COUNTS),
    ]
    if conservative == [run.largest_error for run in runs]:
        del columns[3]
    return [column for column in columns if any(text != NOTHING for text in column.texts)]


def runs_grid(document: Document, name: str, columns: Sequence[Column]) -> Grid:
    """Return a table of all runs."""
    chosen = document.choice.run if document.choice is not None else None
    kinds = [
        " ".join(
            kind
            for kind in ("front" * run.front, "chosen" * (run.name == chosen), "failed" * bool(_failure(run)))
            if kind
        )
        for run in document.runs
    ]
    return Grid("run", document.runs, columns, [kind or None for kind in kinds], name, runs=True)


def error_columns(document: Document) -> list[Column]:
    """Return the error of each run in each quantity, with its truncation and time error."""
    return [
        Column(
            quantity.name,
            [_error(run, quantity) for run in document.runs],
            [_size(run.errors.get(quantity.name)) for run in document.runs],
        )
        for quantity in document.quantities
    ]


def quantities_grid(document: Document) -> Grid:
    """Return the compared quantities, each with its reference and its convergence over the sweep."""
    quantities = document.quantities

    def column(title: str, text: Callable[[Quantity], str], kind: str | None = "short") -> Column:
        return Column(title, [text(quantity) for quantity in quantities], kind=kind)

    columns = [
        column("unit", lambda q: q.unit),
        column("type of error", lambda q: q.measure),
        column("reference", lambda q: NOTHING if q.reference is None else f"{q.reference:.6g}", None),
        column("its own error", lambda q: size_text(q.uncertainty), None),
        column("counts", lambda q: "yes" if q.counts else "no"),
        column("over the sweep", _verdict, "text words"),
    ]
    columns = [c for c in columns if c.title != "its own error" or set(c.texts) != {NOTHING}]
    kinds = ["flagged" if q.converges is False else None for q in quantities]
    return Grid("quantity", [q.name for q in quantities], columns, kinds, "quantities")


def _verdict(quantity: Quantity) -> str:
    """Return whether a quantity converges, and the reason as a note."""
    text = SETTLES[quantity.converges]
    return text if quantity.why in ("", text) else f"{text}\n{quantity.why}"


def front_grid(document: Document) -> Grid:
    """Return the runs that no other run beats in both error and time, the fastest first."""
    runs = sorted((run for run in document.runs if run.front), key=lambda run: run.cpu_seconds)
    rows = [
        [run.name, size_text(run.conservative_error), run.largest_of or "", seconds_text(run.cpu_seconds),
         count_text(run.coordinates), "" if run.step is None else step_text(run.step)]
        for run in runs
    ]  # fmt: skip
    columns = ["run", "conservative error", "largest in", "CPU time", "coordinates", "step"]
    return kind_grid(Table("Runs on the front", columns, rows or [["none", "", "", "", "", ""]]))


def kind_grid(table: Table) -> Grid:
    """Return a further table of the report; columns of long cells wrap."""
    head, *columns = [
        Column(title, texts, kind="text" if max(map(len, texts), default=0) > LONG else None)
        for title, *texts in zip(table.columns, *table.rows, strict=True)
    ]
    return Grid(head.title, head.texts, columns, [None] * len(table.rows), heading=table.title, note=table.note)


def markdown(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table as Markdown, of each cell its first line."""
    cells = [columns, ["---"] * len(columns), *rows]
    return [f"| {' | '.join(cell.partition(chr(10))[0].replace('|', '/') for cell in row)} |" for row in cells]


def _failure(run: Run) -> str | None:
    return None if run.result == "FINISHED" else run.result


def _largest(run: Run) -> str:
    is_reference = run.kind == "nodal" and run.largest_error is None and run.result == "FINISHED"
    return "reference" if is_reference else size_text(run.largest_error)


def _error(run: Run, quantity: Quantity) -> str:
    """Return the error of a run in a quantity, and its truncation and time error as notes."""
    name, measure, unit = quantity.name, quantity.measure, quantity.unit
    notes = [
        f"{label} {error_text(errors[name], measure, unit)}"
        for label, errors in (("truncation", run.truncation), ("time", run.time))
        if errors and errors.get(name) is not None
    ]
    return "\n".join([error_text(run.errors.get(name), measure, unit), *notes])


def _parts(title: str, runs: Sequence[Run], key: str) -> Column:
    """Return the truncation or time error of each run in the quantity of its largest error."""
    values = [_size((getattr(run, key) or {}).get(run.largest_of)) for run in runs]
    return _numbers(title, values, size_text)


def _stage(stage: str, runs: Sequence[Run]) -> Column:
    """Return the CPU time of a stage, with an empty database and with all records present."""
    texts, keys = [], []
    for run in runs:
        entry = run.stages.get(stage, StageSeconds(None, None))
        taken = [None if seconds is None else seconds.cpu for seconds in (entry.cold, entry.warm)]
        texts.append(NOTHING if taken == [None, None] else " / ".join(map(seconds_text, taken)))
        keys.append(taken[1] if taken[0] is None else taken[0])
    return Column(f"{stage}\ncold / warm", texts, keys)


def _texts(title: str, texts: Sequence[str | None], kind: str) -> Column:
    return Column(title, [text or NOTHING for text in texts], texts, kind)


def _plain(runs: Sequence[Run], members: Mapping[str, tuple[str, Callable[[float], str]]]) -> list[Column]:
    """Return a column for each of some members of a run."""
    return [_numbers(title, [getattr(run, key) for run in runs], text) for key, (title, text) in members.items()]


def _numbers(title: str, values: Sequence[float | None], text: Callable[[float], str]) -> Column:
    return Column(title, [NOTHING if value is None else text(value) for value in values], values)


def _size(value: float | None) -> float | None:
    return None if value is None else abs(value)
