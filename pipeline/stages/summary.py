"""`summary.json`: quantities of a run with their reference values and errors."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.scenes.reading import find_file
from gudgeon.pipeline.scenes.report import Report

SUMMARY = "summary.json"


def write_summary(out: Path, key: str, expected: dict[str, float], trajectory: Trajectory) -> dict[str, Any]:
    """Write the summary of a trajectory with this key, and return it; `expected` has reference values by quantity."""
    quantities = {}
    for name, entry in trajectory.quantities.items():
        reference = expected.get(name)
        error = entry["value"] / reference - 1 if reference else None
        quantities[name] = entry | {"reference": reference, "error": error}
    summary = {
        "key": key,
        "expected": expected,
        "result": trajectory.result,
        "quantities": quantities,
        "energy_drift": trajectory.energy_drift,
        "momentum_residual": trajectory.momentum_residual,
        "estimates": trajectory.estimates,
        "counts": trajectory.counts,
    }
    write_text(out / SUMMARY, json.dumps(summary, indent=1))
    return summary


def read_summary(out: Path, key: str, beside: str, expected: dict[str, float] | None = None) -> dict[str, Any] | None:
    """Return the summary of a result, or None if there is none, or it belongs to another result.

    It must have the key, the file `beside` must exist, and its reference values must be `expected`.
    """
    try:
        summary = json.loads((out / SUMMARY).read_text())
        fresh = (
            summary["key"] == key
            and summary.get("expected") == expected
            and "estimates" in summary
            and (out / beside).is_file()
        )
        return summary if fresh else None
    except (OSError, ValueError, KeyError):
        return None


def reference_values(report: Report, folder: Path, names: Mapping[str, str] | None = None) -> dict[str, float]:
    """Return the reference value of each quantity that has one.

    Args:
        names: Quantity → its name in the file; default: `report.quantities`.

    Raises:
        InputError: the file is missing, is not JSON, or does not contain a name.
    """
    if report.reference is None:
        return {}
    path, wanted = find_file(report.reference, folder, "report.reference"), names or report.quantities
    try:
        expected = json.loads(path.read_text())["expected"]
        return {name: _entry(expected, source) for name, source in wanted.items()}
    except (ValueError, LookupError, TypeError) as error:
        raise InputError(f"{path}: not a reference file with these quantities ({error})") from error


def _entry(expected: Any, source: str) -> float:
    """Return a number of a reference file by its path: names and list indices, separated by slashes."""
    found = expected
    for part in source.split("/"):
        found = found[int(part)] if isinstance(found, list) else found[part]
    value = found["value"] if isinstance(found, dict) else found
    if isinstance(value, bool) or not math.isfinite(number := float(value)):
        raise ValueError(f"{source}: {value} is not a finite number")
    return number
