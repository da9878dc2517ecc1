"""Picture of the robustness cases of a scene: the value of every rule as a share of its bound."""

from pathlib import Path
from typing import Any

from gudgeon.pipeline.plots.base.style import (
    BLUE,
    FAINT,
    GREEN,
    GREY,
    INK,
    LEAST_TEXT,
    ORANGE,
    RED,
    new_figure,
    save,
    styled,
)

COLOURS = {"right": GREEN, "refused": ORANGE, "wrong": RED, "does not apply": GREY}
LEAST = 1e-8
"""Least share of a bound that is drawn."""
LONGEST = 76
"""Characters of a reason that the picture shows."""


def draw(document: dict[str, Any], path: Path) -> None:
    """Draw a line for each case of the document: its verdict, and the value over bound of each rule."""
    rows, counts = document["rows"], document["counts"]
    height = 330 + 44 * len(rows)
    with styled():
        label = ", ".join(f"{i} {name}" for name, i in counts.items() if i)
        label = label.replace("does not", "do not")
        figure = new_figure(f"{document['scene']}: robustness cases", label, height=height)
        axes = figure.add_axes((0.20, 130 / height, 0.36, (height - 290) / height))
        for i, row in enumerate(rows):
            colour = COLOURS[row["verdict"]]
            y = len(rows) - 1 - i
            axes.text(
                -0.03, y, row["case"], transform=axes.get_yaxis_transform(), ha="right", va="center",
                fontsize=LEAST_TEXT, color=INK,
            )  # fmt: skip
            for f in row["findings"]:
                axes.plot(_share(f), y, "o", color=RED if not f["holds"] else BLUE, alpha=0.45, markersize=4)
            if row["rule"] is not None:
                axes.plot(_share(row), y, "o", color=colour, markersize=6)
            says = row["rests_on"] if row["verdict"] == "right" else f"{row['verdict']}: {row['reason']}"
            says = says if len(says) <= LONGEST else f"{says[: LONGEST - 1]}…"
            axes.text(
                1.03, y, says, transform=axes.get_yaxis_transform(), va="center", fontsize=LEAST_TEXT,
                color=FAINT if row["verdict"] in ("right", "does not apply") else colour,
            )  # fmt: skip
        axes.axvline(1.0, color=RED, linewidth=1.0)
        axes.set_xscale("log")
        axes.set_xlim(LEAST / 2, 20)
        axes.set_ylim(-0.7, len(rows) - 0.3)
        axes.set_yticks([])
        axes.set_xlabel("value over bound of each rule; large marks: rules that determine the verdict")
        save(figure, path)


def _share(f: dict[str, Any]) -> float:
    """Return value over bound, limited to the range of the picture."""
    if f["value"] is None or (f["value"] and not f["bound"]):
        return 10.0
    return min(max(f["value"] / (f["bound"] or 1.0), LEAST), 10.0)
