"""`linear-response.png`: amplitudes over frequency, a panel for each unit, and the phase below."""

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.patches import Patch

from gudgeon.pipeline.plots.base import style

LINES = ("-", "--", ":")
"""Of further curves, once all colours are taken."""
COMPONENTS = {3: ("x", "y", "z"), 6: ("xx", "yy", "zz", "xy", "yz", "zx")}
"""Names of the components of what has so many."""
NUMBERED = re.compile(r"(.+)\[(\d+)\]$")
DECADES = 1e-7
"""Least amplitude that a panel shows, over its largest: below it a response is round-off."""
PANEL, PHASE = 420, 330
"""Heights of a panel and of the phase [px]."""


def draw(
    path: Path,
    titles: tuple[str, str],
    frequencies: np.ndarray,
    answers: np.ndarray,
    curves: tuple[Sequence[str], Sequence[str]],
    limit: float,
) -> None:
    """Draw frequency responses, (f, n).

    Args:
        titles: Name of the scene, and what is drawn.
        curves: Label and unit of each.
        limit: Frequency beyond which modes are missing [Hz].
    """
    labels, units = component_names(curves[0]), list(curves[1])
    panels = list(dict.fromkeys(units))
    with style.styled():
        figure = style.new_figure("Frequency response", "  ·  ".join(titles), height=PANEL * len(panels) + PHASE + 260)
        heights = [PANEL / PHASE] * len(panels) + [1.0]
        *amplitudes, phase = style.rows(figure, heights, 0.16, (0.1, 0.74), 1 - 0.75 / figure.get_figheight())
        for unit, axes in zip(panels, amplitudes, strict=True):
            members = [i for i, of_curve in enumerate(units) if of_curve == unit]
            largest = float(np.abs(answers[:, members]).max())
            for i in members:
                if np.abs(answers[:, i]).max() < DECADES * largest:
                    continue
                colour, line = style.COLOURS[i % len(style.COLOURS)], LINES[i // len(style.COLOURS) % len(LINES)]
                axes.loglog(frequencies, np.abs(answers[:, i]), color=colour, ls=line, lw=1.3, label=labels[i])
                degrees = np.degrees(np.angle(answers[:, i]))
                phase.semilogx(frequencies, degrees, color=colour, ls=line, lw=1.0)
            if largest > 0:
                axes.set_ylim(bottom=max(axes.get_ylim()[0], DECADES * largest))
            axes.set_ylabel(f"amplitude [{unit}]")
            axes.tick_params(labelbottom=False)
            axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
        for axes in (*amplitudes, phase):
            axes.set_xlim(frequencies[0], frequencies[-1])
            if limit < frequencies[-1]:
                axes.axvspan(max(limit, frequencies[0]), frequencies[-1], color=style.FAINT, alpha=0.25, lw=0)
        if limit < frequencies[-1]:
            missing = Patch(color=style.FAINT, alpha=0.25, lw=0, label="modes are missing")
            phase.legend(handles=[missing], loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
        phase.set_ylabel("phase [deg]")
        phase.set_ylim(-190, 190)
        phase.set_yticks([-180, -90, 0, 90, 180])
        phase.set_xlabel("frequency [Hz]")
        style.save(figure, path)


def component_names(labels: Sequence[str]) -> list[str]:
    """Return labels with the names of components instead of their numbers where all three or six are there."""
    matches = [NUMBERED.match(label) for label in labels]
    counts = Counter(match[1] for match in matches if match)
    return [
        f"{match[1]} {names[int(match[2]) - 1]}" if match and (names := COMPONENTS.get(counts[match[1]])) else label
        for match, label in zip(matches, labels, strict=True)
    ]
