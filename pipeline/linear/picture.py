"""`linear-response.png`: amplitude and phase over frequency."""

from pathlib import Path

import numpy as np

from gudgeon.pipeline.plots.base import style

COLOURS = (style.BLUE, style.ORANGE, style.GREEN, style.GREY, "#8a5fb0", "#b08a2e")


def draw(
    path: Path, titles: tuple[str, str], frequencies: np.ndarray, answers: np.ndarray, labels: list[str], limit: float
) -> None:
    """Draw frequency responses, (f, n).

    Args:
        titles: Name of the scene, and what is drawn with its unit.
        limit: Frequency beyond which modes are missing [Hz].
    """
    with style.styled():
        figure = style.new_figure("Frequency response", f"{titles[0]}  ·  {titles[1]}", height=900)
        upper, lower = style.rows(figure, [2.0, 1.0], 0.12)
        for i, label in enumerate(labels):
            colour = COLOURS[i % len(COLOURS)]
            upper.loglog(frequencies, np.abs(answers[:, i]), color=colour, lw=1.3, label=label)
            lower.semilogx(frequencies, np.degrees(np.angle(answers[:, i])), color=colour, lw=1.1)
        for axes in (upper, lower):
            axes.set_xlim(frequencies[0], frequencies[-1])
            if limit < frequencies[-1]:
                axes.axvspan(max(limit, frequencies[0]), frequencies[-1], color=style.FAINT, alpha=0.25, lw=0)
        upper.set_ylabel("amplitude")
        upper.tick_params(labelbottom=False)
        lower.set_ylabel("phase [deg]")
        lower.set_yticks([-180, -90, 0, 90, 180])
        lower.set_xlabel("frequency [Hz]")
        if len(labels) > 1:
            upper.legend(ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
        style.save(figure, path)
