"""`gudgeon report` of a wheel: every choice of kept interface against the full wheel, error beside size and seconds."""

import csv
import io
import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from modaldb.schema import WheelRecord
from pipeline.cyclic import sector_parts
from pipeline.errors import InputError, StageError
from pipeline.machine import machine
from pipeline.runreport import Progress
from pipeline.scenefile import named
from pipeline.study.effort import Effort
from pipeline.textfile import write_text
from pipeline.wheel.solve import (
    Case,
    amplitudes,
    full_modes,
    kept_dofs,
    reduced_modes,
    reduction_error,
    truncation_error,
    wheel_record,
)

if TYPE_CHECKING:
    from pipeline.wheel.job import WheelJob

FULL = "full wheel"


@dataclass(frozen=True)
class InterfaceRow:
    """One choice of kept interface, on the mistuned wheel unless it says otherwise."""

    model: str
    coordinates: int
    kept: int
    """Physical dofs of a face."""
    interface_modes: int
    """Of the whole wheel, the rigid ones that nothing holds among them."""
    frequency_error: float
    """Largest relative error of the compared frequencies."""
    tuned_frequency_error: float
    """The same of the tuned wheel."""
    magnification: float
    magnification_error: float
    """Relative, signed."""
    response_error: float
    """Relative L2 error of all blades' complex amplitudes over the band."""
    cpu_sector: float
    """For the sector's own reduction, once for all choices [s]."""
    cpu_modes: float
    """From the sector's matrices to the modes of the mistuned wheel [s]."""
    cpu_response: float
    """[s]"""


def report_wheel(job: "WheelJob", how: Effort, progress: Progress) -> dict[str, Any]:
    """Compare every choice and write `report.json`, `report.csv` and `report.png` into the job's folder.

    Args:
        how: Its timed runs are those of each choice; the least time counts. The full wheel is solved once and kept.

    Returns:
        The document of `report.json`.

    Raises:
        InputError: a choice does not fit the mesh.
        StageError: a numerical routine failed.
    """
    job.run("modes", progress)
    name, wheel = job.scene.only
    choices = job.scene.report.choices or {"as in the scene": wheel.interface}
    with named(job.path, InputError, StageError):
        case = job.case()
        # What is misspelt in them shall not come out after the full wheel.
        dofs = {key: kept_dofs(case.sector, one, f"report.choices.{key}") for key, one in choices.items()}
        full = _full(job, case, progress)
        rows = [_row(FULL, full, full)]
        runs = (sector_parts(case.sector, wheel.fixed_count, f"wheel.{name}") for _ in range(how.repeat))
        parts = min(runs, key=lambda one: one.cpu_seconds)
        for number, (key, choice) in enumerate(choices.items()):
            progress(f"choice {number + 1} of {len(choices)}", number / len(choices))
            mistuned = min(
                (reduced_modes(case, parts, dofs[key], True) for _ in range(how.repeat)), key=lambda one: one.cpu_seconds
            )
            pair = reduced_modes(case, parts, dofs[key], False), mistuned
            rows.append(_row(key, wheel_record(case, job.modes().key, choice, pair, parts.cpu_seconds), full))
    tuned = job.store.get(job.modes().key, "cyclic")
    document = {
        "scene": job.name,
        "wheel": name,
        "sectors": wheel.sectors,
        "compared": wheel.count,
        "fixed_count": wheel.fixed_count,
        "sector": tuned.quality,
        "engine_order": wheel.response.engine_order,
        "harmonics_against_full": reduction_error(tuned, full.tuned_frequencies),
        "truncation_error": full.quantities["truncation_error"]["value"],
        "machine": machine(),
        "rows": [asdict(row) for row in rows],
    }
    write_text(job.out / "report.json", json.dumps(document, indent=1))
    write_text(job.out / "report.csv", _csv(document["rows"]))
    from pipeline.plots.interfaces import draw

    draw(document, job.out / "report.png")
    progress("report", 1.0)
    return document


def table_text(document: dict[str, Any]) -> str:
    """Return a report as a Markdown table."""
    size = document["sector"]
    lines = [
        f"{document['sectors']} sectors of {size['sector_dofs']:,} dofs, {size['face_dofs']} on a face,"
        f" {document['fixed_count']} fixed-interface modes of each; the lowest {document['compared']} frequencies are"
        f" compared; {document['machine']['cpu']}, {document['machine']['cores']} cores",
        f"Tuned: harmonics against the full wheel differ by {document['harmonics_against_full']:.1e} at most. Full"
        f" wheel: these modes give the largest amplitude to {document['truncation_error']:.1e} of a direct solution.",
        "",
        "| kept interface | dofs kept per face | interface modes | coordinates | frequency error | magnification |"
        " its error | response error (L2) | CPU modes | CPU response |",
        "|---" * 10 + "|",
    ]
    for row in document["rows"]:
        whole = row["model"] == FULL
        errors = (
            ("–", "–", "–")
            if whole
            else (
                f"{row['frequency_error']:.1e}", f"{row['magnification_error']:+.2%}", f"{row['response_error']:.2%}"
            )
        )  # fmt: skip
        lines.append(
            f"| {row['model']} | {row['kept']} | {row['interface_modes']} | {row['coordinates']:,} | {errors[0]} |"
            f" {row['magnification']:.4f} | {errors[1]} | {errors[2]} | {row['cpu_modes']:.2f} s |"
            f" {row['cpu_response']:.3f} s |"
        )
    once = document["rows"][-1]["cpu_sector"]
    return "\n".join([*lines, "", f"Beside that, the sector's own reduction takes {once:.2f} s once for all choices."])


def _full(job: "WheelJob", case: Case, progress: Progress) -> WheelRecord:
    """Return the response of the full wheel; a finished one is read back."""
    product = job.response(None)
    if not job.store.has(product.key):
        progress("full wheel, tuned", 0.0)
        tuned = full_modes(case, False)
        progress("full wheel, mistuned", 0.4)
        mistuned = full_modes(case, True)
        progress("full wheel, direct", 0.8)
        record = wheel_record(case, job.modes().key, None, (tuned, mistuned), 0.0)
        record.quantities["truncation_error"] = {"value": truncation_error(case, record), "unit": "1"}
        job.store.put(product.key, product.kind, record, product.inputs)
    return job.store.get(product.key, "wheel")


def _row(name: str, record: WheelRecord, full: WheelRecord) -> InterfaceRow:
    ours, theirs = amplitudes(record.mistuned), amplitudes(full.mistuned)
    gain, exact = (one.quantities["magnification"]["value"] for one in (record, full))
    counts = record.counts
    return InterfaceRow(
        name, counts["coordinates"], counts["kept"], counts["interface_modes"],
        float(np.abs(record.mistuned_frequencies / full.mistuned_frequencies - 1).max()),
        float(np.abs(record.tuned_frequencies / full.tuned_frequencies - 1).max()), gain, gain / exact - 1,
        float(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)), counts["cpu_sector"], counts["cpu_modes"],
        counts["cpu_response"],
    )  # fmt: skip


def _csv(rows: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
