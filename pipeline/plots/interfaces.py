"""Choices of kept interface: frequency error and magnification error, over coordinates and over CPU seconds."""

from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from pipeline.plots.style import BLUE, FAINT, GREEN, GREY, INK, ORANGE, new_figure, save, styled

LEAST = 1e-10
"""Errors are drawn no lower than this."""
PANELS = (
    ("frequency_error", "largest frequency error", "coordinates", "coordinates"),
    ("frequency_error", "largest frequency error", "cpu", "CPU time [s]"),
    ("magnification_error", "error of the magnification", "coordinates", "coordinates"),
    ("magnification_error", "error of the magnification", "cpu", "CPU time [s]"),
)
"""What stands upward, its label, what stands to the right, its label."""


def draw(document: dict[str, Any], path: Path) -> None:
    """Draw a report's rows, the full wheel as a line at its coordinates and seconds.

    Args:
        document: As `pipeline.wheel.report.report_wheel` returns it.
        path: The PNG file, written in one step.
    """
    faces = document["sector"]["face_dofs"]
    full, *rows = (
        row | {"cpu": row["cpu_modes"] + row["cpu_response"], "colour": _colour(row["kept"], faces)}
        for row in document["rows"]
    )
    with styled():
        size = document["sector"]
        figure = new_figure(
            f"{document['scene']}: choices of kept interface",
            f"{document['sectors']} mistuned sectors, {size['wheel_dofs']:,} dofs; lowest {document['compared']}"
            f" frequencies; engine order {document['engine_order']}; tuned harmonics = full wheel to"
            f" {document['harmonics_against_full']:.0e}",
        )
        for number, (error, above, value, along) in enumerate(PANELS):
            axes = figure.add_axes((0.08 + 0.315 * (number % 2), 0.515 - 0.435 * (number // 2), 0.235, 0.345))
            _panel(axes, rows, full, error, value)
            axes.set_xlabel(along)
            if number % 2 == 0:
                axes.set_ylabel(above)
        legend = figure.add_axes((0.675, 0.07, 0.32, 0.81))
        legend.axis("off")
        step = min(0.075, 0.95 / (len(rows) + 1))
        for number, row in enumerate(rows):
            height = 0.97 - number * step
            legend.text(0.0, height, f"{number + 1}", color=row["colour"], fontweight="bold", fontsize=9.5)
            legend.text(0.08, height, row["model"], color=INK, fontsize=8.5)
            detail = f"{row['coordinates']:,} coordinates, {row['cpu']:.3g} s"
            legend.text(0.08, height - 0.36 * step, detail, color=FAINT, fontsize=7.5)
        height = 0.97 - len(rows) * step
        legend.text(0.0, height, "–", color=GREY, fontweight="bold", fontsize=9.5)
        legend.text(0.08, height, full["model"], color=INK, fontsize=8.5)
        detail = f"{full['coordinates']:,} dofs, {full['cpu']:.3g} s"
        legend.text(0.08, height - 0.36 * step, detail, color=FAINT, fontsize=7.5)
        scratch = path.with_name(f".{path.name}.part")
        save(figure, scratch)
        scratch.replace(path)


def _panel(axes: Axes, rows: list[dict[str, Any]], full: dict[str, Any], error: str, value: str) -> None:
    axes.axvline(full[value], color=GREY, lw=1.4)
    for number, row in enumerate(rows):
        point = (row[value], max(abs(row[error]), LEAST))
        axes.plot(*point, "o", color=row["colour"], markersize=5, zorder=2)
        axes.annotate(
            f"{number + 1}", point, textcoords="offset points", xytext=(4, 4), fontsize=8, color=row["colour"],
            fontweight="bold",
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")


def _colour(kept: int, faces: int) -> str:
    """Return one colour for all kept, one for none, one for what lies between."""
    return GREEN if kept == faces else BLUE if kept == 0 else ORANGE
