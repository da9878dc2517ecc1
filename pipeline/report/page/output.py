"""The files of a report, and the tables that its command prints."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import read_json, write_text
from gudgeon.pipeline.report.document import Document, csv_text
from gudgeon.pipeline.report.page.tables import markdown, run_columns
from gudgeon.pipeline.report.page.words import (
    NOTHING,
    budget_table,
    budget_text,
    error_text,
    flagged,
    machine_text,
    reference_text,
    tables_of,
    verdict,
)

FILES = ("report.json", "report.csv", "report.html", "report.png")
FORCE_PICTURE = "report-force.png"
"""Force of the run of the error budget and of the reference run, where the reference is a run."""
WIDE = 6
"""Largest number of quantities that have a column each in the printed table; above it the largest error is printed."""


@contextlib.contextmanager
def report_folder(folder: Path, scene: str, *pictures: str) -> Iterator[None]:
    """Remove the report files of a folder if the block fails, so that no older report is taken for the new one.

    Wrong input and interruption change no file.

    Args:
        pictures: Files of the report beside `FILES`.

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
            with contextlib.suppress(OSError):  # A folder that is only read; the error above says more.
                (folder / name).unlink()
        raise


def _scene_of(path: Path) -> str | None:
    """Return the scene of a `report.json`, None if there is no readable one."""
    try:
        return str(read_json(path)["scene"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
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
    """Return a report as Markdown: error budget, reference, verdict, table of runs, design changes, further tables."""
    lines = [
        *([budget] if (budget := budget_text(document)) else []),
        f"Reference ({document.reference['kind']}): {reference_text(document)}; {machine_text(document)}",
        *([f"Compared up to {document.until * 1e3:g} ms."] if document.until else []),
        verdict(document),
        *(f"Does not converge over this sweep, not fitted: {q.name}. {q.why}" for q in flagged(document)),
        *document.notes,
        "",
        *_runs(document),
    ]
    budget_rows = budget_table(document)
    for table in [*([budget_rows] if budget_rows else []), *tables_of(document)]:
        lines += ["", f"{table.title}{': ' if table.note else ''}{table.note}", ""]
        lines += markdown(table.columns, table.rows)
    if document.left_out:
        lines += ["", "Omitted settings:", *(f"- {entry['name']}: {entry['why']}" for entry in document.left_out)]
    return "\n".join(lines)


def _runs(document: Document) -> list[str]:
    """Return one line per run with its main figures; columns without an entry are omitted."""
    texts_of = {column.title: column.texts for column in run_columns(document)}
    names, errors = ["coordinates"], {}
    if len(document.quantities) <= WIDE:
        window = f", Hann {document.window * 1e6:g} µs" if document.window else ""
        for quantity in document.quantities:
            texts = [
                error_text(run.errors.get(quantity.name), quantity.measure, quantity.unit) for run in document.runs
            ]
            errors[quantity.name + (f" (L2{window})" if quantity.measure == "L2" else "")] = texts
    else:
        names += ["largest error", "of"]
    names += ["conservative error", "result", "energy drift", "steps", "CPU time"]
    columns = {"run": [run.name for run in document.runs], "coordinates": texts_of["coordinates"], **errors}
    columns |= {name: texts_of[name] for name in names if name in texts_of}
    shown = {title: texts for title, texts in columns.items() if any(text != NOTHING for text in texts)}
    return markdown(list(shown), list(zip(*shown.values(), strict=True)))
