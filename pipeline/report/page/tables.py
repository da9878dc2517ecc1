"""Tables of a report as columns of texts, written as HTML for the page and as Markdown for the command."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

from gudgeon.pipeline.report.document import Document, Quantity, Run, StageSeconds, Table
from gudgeon.pipeline.report.page.words import (
    NOTHING,
    SETTLES,
    count_text,
    error_text,
    seconds_text,
    setting_texts,
    size_text,
    step_text,
)

LONG = 30
"""Number of characters above which a cell is text that wraps."""
Key = float | str | None


@dataclass(frozen=True)
class Column:
    """One column of a table. Lines of a text after the first are notes, which only HTML shows."""

    title: str
    texts: list[str]
    keys: Sequence[Key] = ()
    """What the cells are sorted by; empty in a table that is not sorted."""
    kind: str = ""
    """CSS class of its cells."""


def run_columns(document: Document) -> list[Column]:
    """Return one row per run: size, errors, times and counts; columns without an entry are omitted."""
    runs = document.runs
    conservative = [run.conservative_error for run in runs]
    columns = [
        _numbers("coordinates", [run.coordinates for run in runs], count_text),
        Column("largest error", [_largest(run) for run in runs], [_size(run.largest_error) for run in runs]),
        Column("of", [run.largest_of or NOTHING for run in runs], [run.largest_of for run in runs], "short"),
        _numbers("conservative error", conservative, size_text),
        Column("result", [_failure(run) or NOTHING for run in runs], [_failure(run) for run in runs], "short result"),
        _parts("truncation error", runs, "truncation"),
        _parts("time error", runs, "time"),
        _numbers("CPU time", [run.cpu_seconds for run in runs], seconds_text),
        _numbers("wall time", [run.wall_seconds for run in runs], seconds_text),
        *(_stage(stage, runs) for stage in dict.fromkeys(name for run in runs for name in run.stages)),
        _numbers("step", [run.step for run in runs], step_text),
        _numbers("steps", [run.steps for run in runs], count_text),
        _numbers("factorisations", [run.factorisations for run in runs], count_text),
        _numbers("iterations", [run.iterations for run in runs], count_text),
        _numbers("energy drift", [run.energy_drift for run in runs], "{:.0e}".format),
        _numbers("momentum residual", [run.momentum_residual for run in runs], "{:.0e}".format),
        _numbers("memory [MiB]", [run.peak_mib for run in runs], count_text),
    ]
    if conservative == [run.largest_error for run in runs]:
        del columns[3]
    return [column for column in columns if any(text != NOTHING for text in column.texts)]


def runs_table(document: Document) -> str:
    """Return the table of runs as HTML; the name of a run opens to its settings."""
    return _run_table("runs", document, run_columns(document))


def errors_table(document: Document) -> str:
    """Return the error of each run in each quantity as HTML, with its truncation and time error."""
    columns = [
        Column(
            one.name,
            [_error(run, one) for run in document.runs],
            [_size(run.errors.get(one.name)) for run in document.runs],
        )
        for one in document.quantities
    ]
    return _run_table("errors", document, columns)


def quantities_table(document: Document) -> str:
    """Return the compared quantities as HTML, each with its reference and its convergence over the sweep."""
    quantities = document.quantities
    verdicts = [
        SETTLES[one.converges] + (f"\n{one.why}" if one.why not in ("", SETTLES[one.converges]) else "")
        for one in quantities
    ]
    columns = [
        Column("unit", [one.unit for one in quantities], kind="short"),
        Column("type of error", [one.measure for one in quantities], kind="short"),
        Column("reference", [NOTHING if one.reference is None else f"{one.reference:.6g}" for one in quantities]),
        Column("its own error", [size_text(one.uncertainty) for one in quantities]),
        Column("counts", ["yes" if one.counts else "no" for one in quantities], kind="short"),
        Column("over the sweep", verdicts, kind="text words"),
    ]
    columns = [one for one in columns if one.title != "its own error" or set(one.texts) != {NOTHING}]
    rows = [_class("flagged" if one.converges is False else "") for one in quantities]
    return _html("quantities", "quantity", [escape(one.name) for one in quantities], columns, rows)


def kind_table(table: Table) -> str:
    """Return a further table of the report as HTML; columns of long cells wrap."""
    first, *others = [
        Column(title, texts, kind="text" if max(map(len, texts), default=0) > LONG else "")
        for title, *texts in zip(table.columns, *table.rows, strict=True)
    ]
    return _html("", first.title, list(map(escape, first.texts)), others, [""] * len(first.texts))


def markdown(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table as Markdown, of each cell its first line."""
    cells = [columns, ["---"] * len(columns), *rows]
    return [f"| {' | '.join(cell.partition(chr(10))[0].replace('|', '/') for cell in row)} |" for row in cells]


def _run_table(name: str, document: Document, columns: Sequence[Column]) -> str:
    chosen = document.choice.run if document.choice is not None else None
    kinds = [
        " ".join(
            kind
            for kind, holds in (("front", run.front), ("chosen", run.name == chosen), ("failed", bool(_failure(run))))
            if holds
        )
        for run in document.runs
    ]
    rows = [f' data-run="{number}"{_class(kind)}' for number, kind in enumerate(kinds)]
    heads = [_name(number, run) for number, run in enumerate(document.runs)]
    return _html(name, "run", heads, columns, rows)


def _html(name: str, title: str, heads: Sequence[str], columns: Sequence[Column], rows: Sequence[str]) -> str:
    """Return a table as HTML that scrolls by itself.

    Args:
        title: Of the first column.
        heads: HTML of its cells.
        rows: Attributes of each row.
    """
    header = "".join(
        f'<th scope="col"{_class(kind)}>{_cell(text)}</th>'
        for text, kind in ((title, ""), *((column.title, column.kind) for column in columns))
    )
    body = []
    for number, (attributes, head) in enumerate(zip(rows, heads, strict=True)):
        cells = "".join(
            f"<td{_class(one.kind)}{_key(one.keys[number]) if one.keys else ''}>{_cell(one.texts[number])}</td>"
            for one in columns
        )
        body.append(f'<tr{attributes}><th scope="row" data-value="{number + 1}">{head}</th>{cells}</tr>')
    identity = f' id="{name}"' if name else ""
    kind = _class("sortable" if any(column.keys for column in columns) else "")
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{name or "table"}"><table{identity}{kind}>'
        f"<thead><tr>{header}</tr></thead>\n<tbody>\n{chr(10).join(body)}\n</tbody></table></div>"
    )


def _name(number: int, run: Run) -> str:
    """Return the number and name of a run as HTML; they open to its settings and to the runs it is compared with."""
    name = f"{number + 1}&ensp;{escape(run.name)}"
    if run.front:
        name += '&nbsp;<span class="best-run" title="on the front">●</span>'
    lines = setting_texts(run)
    for part, found, against in (
        ("truncation error", run.truncation, run.truncation_against),
        ("time error", run.time, run.time_against),
    ):
        if against:
            lines.append(f"{part}: {NOTHING if found is None else 'against'} {against}")
    if not lines:
        return name
    return f"<details><summary>{name}</summary>{''.join(f'<code>{escape(line)}</code>' for line in lines)}</details>"


def _failure(run: Run) -> str | None:
    return None if run.result == "FINISHED" else run.result


def _largest(run: Run) -> str:
    is_reference = run.kind == "nodal" and run.largest_error is None and run.result == "FINISHED"
    return "reference" if is_reference else size_text(run.largest_error)


def _error(run: Run, quantity: Quantity) -> str:
    """Return the error of a run in a quantity, and its truncation and time error as notes."""
    name, measure, unit = quantity.name, quantity.measure, quantity.unit
    parts = [
        f"{label} {error_text(found[name], measure, unit)}"
        for label, found in (("truncation", run.truncation), ("time", run.time))
        if found and found.get(name) is not None
    ]
    return "\n".join([error_text(run.errors.get(name), measure, unit), *parts])


def _parts(title: str, runs: Sequence[Run], part: str) -> Column:
    """Return the truncation or time error of each run in the quantity of its largest error."""
    values = [_size((getattr(run, part) or {}).get(run.largest_of)) for run in runs]
    return _numbers(title, values, size_text)


def _stage(stage: str, runs: Sequence[Run]) -> Column:
    """Return the CPU time of a stage, with an empty database and with all records present."""
    texts, keys = [], []
    for run in runs:
        entry = run.stages.get(stage, StageSeconds(None, None))
        taken = [None if one is None else one.cpu for one in (entry.cold, entry.warm)]
        texts.append(NOTHING if taken == [None, None] else " / ".join(map(seconds_text, taken)))
        keys.append(taken[1] if taken[0] is None else taken[0])
    return Column(f"{stage}\ncold / warm", texts, keys)


def _numbers(title: str, values: Sequence[float | None], text: Callable[[float], str]) -> Column:
    return Column(title, [NOTHING if value is None else text(value) for value in values], values)


def _size(value: float | None) -> float | None:
    return None if value is None else abs(value)


def _cell(text: str) -> str:
    first, *notes = text.split("\n")
    return escape(first) + "".join(f"<small>{escape(note)}</small>" for note in notes)


def _key(value: Key) -> str:
    unknown = value is None or (isinstance(value, float) and not math.isfinite(value))
    return f' data-value="{"" if unknown else escape(str(value))}"'


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""
