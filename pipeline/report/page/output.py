"""The files of a report, and the tables that its command prints."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.report.document import Document, csv_text
from gudgeon.pipeline.report.page.words import (
    NOTHING,
    count_text,
    error_text,
    flagged,
    machine_text,
    seconds_text,
    size_text,
    small_text,
    tables_of,
    verdict,
)

FILES = ("report.json", "report.csv", "report.html", "report.png")
WIDE = 6
"""Quantities up to which each has a column in the table that is printed; of more the largest error is shown."""


@contextlib.contextmanager
def report_folder(folder: Path, scene: str, *pictures: str) -> Iterator[None]:
    """See to it that the folder of a report holds this one or none; one whose runs fail takes an earlier one's files.

    Wrong input and interruption leave what is there.

    Args:
        pictures: Files that belong to it beside `FILES`.

    Raises:
        InputError: the folder holds the report of another scene.
    """
    if (holder := _scene_of(folder / FILES[0])) not in (None, scene):
        raise InputError(f"--out {folder}: holds the report of '{holder}', '{scene}' needs a folder of its own")
    try:
        yield
    except InputError:
        raise
    except Exception:
        for name in (*FILES, *pictures):
            (folder / name).unlink(missing_ok=True)
        raise


def _scene_of(path: Path) -> str | None:
    """Return the scene that a `report.json` is of, None where there is none that can be read."""
    try:
        return str(json.loads(path.read_text(encoding="utf-8"))["scene"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def write_report(document: Document, folder: Path, *, picture: bytes | None = None) -> None:
    """Write `report.json`, `report.csv`, `report.png` and `report.html`, each in one step.

    Args:
        picture: A further picture for the page, as PNG.

    Raises:
        InputError: the folder cannot be written.
    """
    write_text(folder / "report.json", document.as_text())
    write_text(folder / "report.csv", csv_text(document))
    # Imported late: matplotlib would count into the memory of timed runs.
    from gudgeon.pipeline.report.page.page import page
    from gudgeon.pipeline.report.page.picture import draw

    write_text(folder / "report.html", page(document, picture))
    draw(document, folder / "report.png")


def report_text(document: Document) -> str:
    """Return a report as Markdown: reference, verdict, a table of runs, design changes, tables of the scene's kind."""
    lines = [
        f"Reference ({document.reference['kind']}): {document.reference['source']}; {machine_text(document)}",
        *([f"Compared up to {document.until * 1e3:g} ms."] if document.until else []),
        verdict(document),
        *(f"Does not converge over this sweep, not fitted: {one.name}. {one.why}" for one in flagged(document)),
        *document.notes,
        "",
        *_runs(document),
    ]
    for table in tables_of(document):
        lines += ["", f"{table.title}{': ' if table.note else ''}{table.note}", ""]
        lines += _table(table.columns, table.rows)
    if document.left_out:
        lines += ["", "Left out:", *(f"- {one['name']}: {one['why']}" for one in document.left_out)]
    return "\n".join(lines)


def _runs(document: Document) -> list[str]:
    """Return one line a run; columns that no run fills are left out."""
    window = f", Hann {document.window * 1e6:g} µs" if document.window else ""
    columns = {"run": [run.name for run in document.runs]}
    columns["coordinates"] = [count_text(run.coordinates) for run in document.runs]
    if len(document.quantities) <= WIDE:
        for one in document.quantities:
            title = one.name + (f" (L2{window})" if one.measure == "L2" else "")
            columns[title] = [error_text(run.errors.get(one.name), one.measure, one.unit) for run in document.runs]
    else:
        columns["largest error"] = [size_text(run.largest_error) for run in document.runs]
        columns["of"] = [run.largest_of or NOTHING for run in document.runs]
    if any(run.conservative_error != run.largest_error for run in document.runs):
        columns["conservative error"] = [size_text(run.conservative_error) for run in document.runs]
    columns["result"] = [NOTHING if run.result == "FINISHED" else run.result for run in document.runs]
    columns["energy drift"] = [small_text(run.energy_drift) for run in document.runs]
    columns["steps"] = [count_text(run.steps) for run in document.runs]
    columns["CPU time"] = [seconds_text(run.cpu_seconds) for run in document.runs]
    kept = {key: cells for key, cells in columns.items() if any(cell != NOTHING for cell in cells)}
    return _table(list(kept), [list(row) for row in zip(*kept.values(), strict=True)])


def _table(columns: list[str], rows: list[list[str]]) -> list[str]:
    cells = [columns, ["---"] * len(columns), *rows]
    return [f"| {' | '.join(cell.replace('|', '/') for cell in row)} |" for row in cells]
