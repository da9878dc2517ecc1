"""`summary.json`: quantities of a run with their reference values and errors."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gudgeon.modaldb.keys import file_digest
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import read_json, read_sealed, write_sealed
from gudgeon.pipeline.scenes.reading import find_file
from gudgeon.pipeline.scenes.report import Report

SUMMARY = "summary.json"


def write_summary(
    out: Path, key: str, expected: dict[str, float], trajectory: Trajectory, beside: str
) -> dict[str, Any]:
    """Write the summary of a trajectory with this key, and return it.

    Args:
        expected: Reference values by quantity.
        beside: Name of the file with the result itself.
    """
    quantities = {}
    for name, entry in trajectory.quantities.items():
        reference = expected.get(name)
        # Absolute where the reference is zero.
        error = None if reference is None else entry["value"] / reference - 1 if reference else entry["value"]
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
    return seal_summary(out, summary, beside)


def seal_summary(out: Path, summary: dict[str, Any], beside: str) -> dict[str, Any]:
    """Write a summary with the digest of the file `beside`, and return it."""
    summary = summary | {"files": {beside: file_digest(out / beside)}}
    write_sealed(out / SUMMARY, summary)
    return summary


def read_summary(out: Path, key: str, beside: str, expected: dict[str, float] | None = None) -> dict[str, Any] | None:
    """Return the summary of a result; None if there is none, it belongs to another result, or a file was changed.

    It must have the key, be as it was written, and so must the file `beside`; its reference values must be `expected`.
    """
    summary = read_sealed(out / SUMMARY)
    if summary is None or summary["key"] != key or summary.get("expected") != expected:
        return None
    try:
        return summary if summary["files"] == {beside: file_digest(out / beside)} else None
    except OSError:
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
    path, sources = find_file(report.reference, folder, "report.reference"), names or report.quantities
    try:
        expected = read_json(path)["expected"]
        return {name: _entry(expected, source) for name, source in sources.items()}
    except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
        raise InputError(f"{path}: not a reference file with these quantities ({error})") from error


def _entry(expected: Any, source: str) -> float:
    """Return a number of a reference file by its path: names and list indices, separated by slashes."""
    node = expected
    for step in source.split("/"):
        node = node[int(step)] if isinstance(node, list) else node[step]
    value = node["value"] if isinstance(node, dict) else node
    if isinstance(value, bool) or not math.isfinite(result := float(value)):
        raise ValueError(f"{source}: {value} is not a finite number")
    return result
