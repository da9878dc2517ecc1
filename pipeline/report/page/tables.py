"""Tables of a report's page as HTML; what a cell sorts by stands beside its text."""

import math
from collections.abc import Sequence
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
    small_text,
    step_text,
)

LONG = 30
"""Characters of a cell that is text."""


@dataclass(frozen=True)
class Column:
    """One column: its heading, its cells and what they sort by."""

    title: str
    cells: list[str]
    """As HTML."""
    keys: list[float | str | None]
    kind: str = ""
    """Class of its cells."""
    hint: str = ""


def runs_table(document: Document) -> str:
    """Return one row a run; columns that no run fills are left out."""
    runs = document.runs
    luck = any(run.conservative_error != run.largest_error for run in runs)
    columns = [
        _numbers("coordinates", [run.coordinates for run in runs], count_text),
        Column("largest error", [_result(run) for run in runs], [_size(run.largest_error) for run in runs]),
        Column("of", [escape(run.largest_of or NOTHING) for run in runs], [run.largest_of for run in runs], "short"),
        *([_numbers("conservative error", [run.conservative_error for run in runs], size_text)] if luck else []),
        _parts("basis", runs, "truncation"),
        _parts("step", runs, "time"),
        _numbers("CPU", [run.cpu_seconds for run in runs], seconds_text),
        _numbers("wall", [run.wall_seconds for run in runs], seconds_text),
        *(_stage(stage, runs) for stage in dict.fromkeys(name for run in runs for name in run.stages)),
        _numbers("step size", [run.step for run in runs], step_text),
        _numbers("steps", [run.steps for run in runs], count_text),
        _numbers("factorisations", [run.factorisations for run in runs], count_text),
        _numbers("iterations", [run.iterations for run in runs], count_text),
        _numbers("energy drift", [run.energy_drift for run in runs], small_text),
        _numbers("momentum residual", [run.momentum_residual for run in runs], small_text),
        _numbers("memory [MiB]", [run.peak_mib for run in runs], count_text),
    ]
    kept = [column for column in columns if any(key is not None for key in column.keys)]
    return _run_rows("runs", document, kept)


def errors_table(document: Document) -> str:
    """Return the error of each quantity of each run, and below it what basis and step add."""
    columns = [
        Column(
            escape(one.name),
            [_error(run, one) for run in document.runs],
            [_size(run.errors.get(one.name)) for run in document.runs],
        )
        for one in document.quantities
    ]
    return _run_rows("errors", document, columns)


def quantities_table(document: Document) -> str:
    """Return what is compared, with what, and whether it settles."""
    rows = [
        f'<tr><th scope="row">{escape(one.name)}</th><td class="short">{escape(one.unit)}</td>'
        f'<td class="short">{escape(one.measure)}</td>'
        f"<td>{NOTHING if one.reference is None else f'{one.reference:.6g}'}</td>"
        f'<td class="short">{"yes" if one.counts else "no"}</td>'
        f'<td class="text words"><span{_flag(one)}>{SETTLES[one.converges]}</span>'
        f"{f'<small>{escape(one.why)}</small>' if one.why not in ('', SETTLES[one.converges]) else ''}</td></tr>"
        for one in document.quantities
    ]
    heads = ["quantity", "unit", "error is", "reference", "in the largest error", "over the sweep"]
    kinds = ["", "short", "short", "", "short", "text"]
    return _wrapped("quantities", _header(heads, kinds), rows)


def kind_table(table: Table) -> str:
    """Return a table beside the runs; long cells are text that wraps."""
    rows = []
    for first, *others in table.rows:
        cells = (f"<td{_class('text' if len(cell) > LONG else '')}>{escape(cell)}</td>" for cell in others)
        rows.append(f'<tr><th scope="row">{escape(first)}</th>{"".join(cells)}</tr>')
    return _wrapped("", _header(table.columns, [""] * len(table.columns)), rows)


def _run_rows(name: str, document: Document, columns: Sequence[Column]) -> str:
    chosen = document.choice.run if document.choice is not None else None
    rows = []
    for number, run in enumerate(document.runs):
        kinds = " ".join(kind for kind, holds in (("front", run.front), ("chosen", run.name == chosen)) if holds)
        cells = "".join(
            f'<td{_class(column.kind)} data-value="{_key(column.keys[number])}">{column.cells[number]}</td>'
            for column in columns
        )
        head = f'<th scope="row" data-value="{number + 1}">{_name(number, run)}</th>'
        rows.append(f'<tr data-run="{number}"{_class(kinds)}>{head}{cells}</tr>')
    heads = [("run", ""), *((column.title, column.kind) for column in columns)]
    header = "".join(f'<th scope="col"{_class(kind)}>{title}</th>' for title, kind in heads)
    return _wrapped(name, f"<tr>{header}</tr>", rows, "sortable")


def _name(number: int, run: Run) -> str:
    """Return number and name, which open to what the run changes of the scene."""
    name = f"{number + 1}&ensp;{escape(run.name)}"
    if run.front:
        name += '&nbsp;<span class="best-run" title="on the front">●</span>'
    lines = [escape(text) for text in setting_texts(run)]
    for part, found, against in (
        ("basis", run.truncation, run.truncation_against),
        ("step", run.time, run.time_against),
    ):
        if against:
            lines.append(f"{part}: {'—' if found is None else 'against'} {escape(against)}")
    if not lines:
        return name
    return f"<details><summary>{name}</summary>{''.join(f'<code>{line}</code>' for line in lines)}</details>"


def _result(run: Run) -> str:
    if run.result != "FINISHED":
        return f'<span class="bad">{escape(run.result)}</span>'
    if run.kind == "nodal" and run.largest_error is None:
        return "reference"
    return size_text(run.largest_error)


def _error(run: Run, quantity: Quantity) -> str:
    text = error_text(run.errors.get(quantity.name), quantity.measure, quantity.unit)
    parts = [
        f"{label} {error_text(found[quantity.name], quantity.measure, quantity.unit)}"
        for label, found in (("basis", run.truncation), ("step", run.time))
        if found and found.get(quantity.name) is not None
    ]
    return text + "".join(f"<small>{part}</small>" for part in parts)


def _parts(title: str, runs: Sequence[Run], part: str) -> Column:
    """Return what basis or step add to the quantity that is farthest off."""
    values = [_size((getattr(run, part) or {}).get(run.largest_of)) for run in runs]
    return _numbers(title, values, size_text)


def _stage(stage: str, runs: Sequence[Run]) -> Column:
    found = [run.stages.get(stage, StageSeconds(None, None)) for run in runs]
    cold, warm = (
        [None if one is None else one.cpu for one in states]
        for states in zip(*((one.cold, one.warm) for one in found), strict=True)
    )
    cells = [
        NOTHING if a is None and b is None else f"{seconds_text(a)} / {seconds_text(b)}"
        for a, b in zip(cold, warm, strict=True)
    ]
    keys: list[float | str | None] = [b if a is None else a for a, b in zip(cold, warm, strict=True)]
    return Column(f"{escape(stage)}<small>cold / warm</small>", cells, keys)


def _numbers(title: str, values: Sequence[float | None], text) -> Column:
    return Column(title, [text(value) for value in values], list(values))


def _size(value: float | None) -> float | None:
    return None if value is None else abs(value)


def _key(value: float | str | None) -> str:
    return "" if value is None or (isinstance(value, float) and not math.isfinite(value)) else escape(str(value))


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""


def _flag(quantity: Quantity) -> str:
    return ' class="bad"' if quantity.converges is False else ""


def _header(titles: Sequence[str], kinds: Sequence[str]) -> str:
    cells = (f'<th scope="col"{_class(kind)}>{escape(title)}</th>' for title, kind in zip(titles, kinds, strict=True))
    return f"<tr>{''.join(cells)}</tr>"


def _wrapped(name: str, header: str, rows: Sequence[str], kind: str = "") -> str:
    identity = f' id="{name}"' if name else ""
    label = f' aria-label="{name or "table"}"'
    body = f"<thead>{header}</thead>\n<tbody>\n{chr(10).join(rows)}\n</tbody>"
    return f'<div class="scroll" tabindex="0" role="region"{label}><table{identity}{_class(kind)}>{body}</table></div>'
