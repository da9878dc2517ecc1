"""What `gudgeon sensitivity` finds, as tables, as a document and as text."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from gudgeon.pipeline.files import csv_text, write_sealed, write_text
from gudgeon.pipeline.sensitivity.parameters import Parameter
from gudgeon.pipeline.sensitivity.picture import draw
from gudgeon.pipeline.stages.folder import claim, held
from gudgeon.pipeline.stages.job import Job

TABLE, MODES, DOCUMENT, PICTURE = "sensitivity.csv", "sensitivity-modes.csv", "sensitivity.json", "sensitivity.png"
LISTED = 5
"""Frequencies that are printed for each key."""


@dataclass(frozen=True)
class Derivative:
    """One entry of the table."""

    quantity: str
    value: float
    unit: str
    parameter: Parameter
    slope: float
    """dJ/dp"""
    error: float | None
    """Estimated, by the step; None with a given one."""

    @property
    def relative(self) -> float | None:
        """p/J dJ/dp; None where J is zero."""
        return self.parameter.value / self.value * self.slope if self.value else None

    @property
    def slope_unit(self) -> str:
        """Unit of the derivative."""
        unit = self.parameter.unit
        if unit in ("", "1"):
            return self.unit
        return f"{self.unit}/({unit})" if set(unit) & {"/", " "} else f"{self.unit}/{unit}"


@dataclass(frozen=True)
class SensitivityReport:
    """Derivatives of quantities and of frequencies."""

    scene: str
    derivatives: list[Derivative]
    frequencies: list[dict[str, Any]]
    """Component, modes, frequency [Hz], parameter, derivative and relative derivative of each group of modes."""
    step: float
    """[s]"""
    steps: int
    out: Path
    files: list[str]
    notes: list[str] = field(default_factory=list)

    def as_json(self) -> dict[str, Any]:
        """Return the document that `--json` prints."""
        rows = [
            {
                "quantity": d.quantity, "value": d.value, "unit": d.unit, "parameter": d.parameter.key,
                "parameter_value": d.parameter.value, "parameter_unit": d.parameter.unit, "derivative": d.slope,
                "derivative_unit": d.slope_unit, "relative": d.relative, "estimated_error": d.error,
            }
            for d in self.derivatives
        ]  # fmt: skip
        return {"scene": self.scene, "step": self.step, "steps": self.steps, "derivatives": rows,
                "frequencies": self.frequencies, "files": self.files, "notes": self.notes}  # fmt: skip

    def gradient(self, quantity: str) -> dict[str, float]:
        """Return the derivative of a quantity by each key."""
        return {d.parameter.key: d.slope for d in self.derivatives if d.quantity == quantity}


def written(job: Job, report: SensitivityReport) -> SensitivityReport:
    """Write the tables and the picture of a report."""
    heads = ["quantity", "value", "unit", "parameter", "parameter value", "parameter unit", "derivative",
             "derivative unit", "relative derivative [1]", "estimated error"]  # fmt: skip
    lines = [
        [d.quantity, repr(d.value), d.unit, d.parameter.key, repr(d.parameter.value), d.parameter.unit, repr(d.slope),
         d.slope_unit, "" if d.relative is None else repr(d.relative), "" if d.error is None else repr(d.error)]
        for d in report.derivatives
    ]  # fmt: skip
    files = [TABLE, DOCUMENT, PICTURE]
    with held(job.out):
        claim(job)
        write_text(job.out / TABLE, csv_text([heads, *lines]))
        (job.out / MODES).unlink(missing_ok=True)
        if report.frequencies:
            mode_heads = ["component", "modes", "frequency [Hz]", "parameter", "derivative [Hz per unit]",
                          "parameter unit", "relative derivative [1]"]  # fmt: skip
            mode_lines = [
                [row["component"], _numbers(row["modes"]), repr(row["frequency"]), row["parameter"],
                 repr(row["derivative"]), row["parameter_unit"], repr(row["relative"])]
                for row in report.frequencies
            ]  # fmt: skip
            write_text(job.out / MODES, csv_text([mode_heads, *mode_lines]))
            files.insert(1, MODES)
        report = replace(report, files=files)
        write_sealed(job.out / DOCUMENT, report.as_json())
        draw(job.out / PICTURE, job.name, _bars(report))
    return report


def _bars(report: SensitivityReport) -> dict[str, dict[str, float]]:
    """Return the relative derivatives of each quantity by key."""
    bars: dict[str, dict[str, float]] = {}
    for d in report.derivatives:
        if d.relative is not None:
            bars.setdefault(d.quantity, {})[d.parameter.key] = d.relative
    return bars


def _numbers(modes: Sequence[int]) -> str:
    return str(modes[0]) if len(modes) == 1 else f"{modes[0]}-{modes[-1]}"


def report_text(report: SensitivityReport) -> str:
    """Return the tables that the command prints."""
    lines = [f"{report.steps:,} steps of {report.step:.4g} s"]
    for name in dict.fromkeys(d.quantity for d in report.derivatives):
        rows = sorted((d for d in report.derivatives if d.quantity == name), key=lambda d: -abs(d.relative or 0.0))
        estimated = any(d.error is not None for d in rows)
        lines.append(f"\n{name} = {rows[0].value:.6g} {rows[0].unit}")
        head = f"  {'parameter':34} {'value':>18} {'dJ/dp':>26} {'p/J dJ/dp':>10}"
        lines.append(head + (f" {'error':>8}" if estimated else ""))
        for d in rows:
            value, slope = f"{d.parameter.value:.6g} {d.parameter.unit}", f"{d.slope:.6g} {d.slope_unit}"
            relative = "" if d.relative is None else f"{d.relative + 0.0:.6f}".replace("-0.000000", "0.000000")
            error = "" if d.error is None else f" {abs(d.error * d.parameter.value / (d.value or 1.0)):>8.0e}"
            lines.append(f"  {d.parameter.key:34} {value:>18} {slope:>26} {relative:>10}{error}")
    lines += _frequency_lines(report)
    return "\n".join([*lines, f"\nresults in {report.out}: {', '.join(report.files)}"])


def _frequency_lines(report: SensitivityReport) -> list[str]:
    """Return the table of the first frequencies of each key."""
    if not report.frequencies:
        return []
    lines = [f"\n  {'frequencies by':34} {'modes':>7} {'f [Hz]':>10} {'df/dp':>26} {'p/f df/dp':>10}"]
    counts: Counter[str] = Counter()
    for row in report.frequencies:
        counts[row["parameter"]] += 1
        if counts[row["parameter"]] > LISTED:
            continue
        slope = f"{row['derivative']:.6g} Hz/({row['parameter_unit']})"
        lines.append(
            f"  {row['parameter']:34} {_numbers(row['modes']):>7} {row['frequency']:>10.6g} {slope:>26}"
            f" {row['relative']:>10.6f}"
        )
    if max(counts.values()) > LISTED:
        lines.append(f"  … the first {LISTED} of each key; {MODES} has all {max(counts.values())}")
    return lines
