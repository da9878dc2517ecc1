"""`report-force.png`: the force of each contact, the reference run beside the run of the error budget."""

from pathlib import Path

import numpy as np

from gudgeon.pipeline.plots.base.style import BLUE, FAINT, INK, SIDES, new_figure, save, styled
from gudgeon.pipeline.report.force import GRID, Ran, contact_forces, end_of, smooth
from gudgeon.pipeline.stages.job import Job

GREY = "#a4adb6"
SHOWN = 4
"""Largest number of contacts that are drawn."""
BOTTOM, TOP, BETWEEN = 0.1, 0.86, 0.07
"""Lower and upper border of the axes and the distance between them, relative to the height."""


def draw_forces(job: Job, runs: tuple[Ran, Ran], names: tuple[str, str], path: Path) -> None:
    """Draw the windowed contact forces of two runs up to the time that is compared.

    Args:
        runs: The reference run, and the run that is compared with it.
        names: Their names in the legend.
        path: The PNG file, written in one step.
    """
    window, grid = job.scene.report.window, np.linspace(0.0, end_of(job), GRID + 1)
    contacts = list(job.scene.contact)[:SHOWN]
    forces = [contact_forces(run) for run in runs]
    subtitle = f"resultant behind a Hann window of {window * 1e6:g} µs" if window else "resultant"
    with styled():
        figure = new_figure(f"{job.name}: contact force and reference", subtitle)
        height = (TOP - BOTTOM - BETWEEN * (len(contacts) - 1)) / len(contacts)
        for i, name in enumerate(contacts):
            low = TOP - (i + 1) * height - i * BETWEEN
            axes = figure.add_axes((SIDES[0], low, SIDES[1] - SIDES[0], height))
            curves = [
                np.linalg.norm(smooth(run.times, force[name], grid, window), axis=1)
                for run, force in zip(runs, forces, strict=True)
            ]
            axes.plot(grid[1:] * 1e3, curves[0], color=GREY, linewidth=2.8, label=f"reference: {names[0]}")
            axes.plot(grid[1:] * 1e3, curves[1], color=BLUE, linewidth=0.9, label=names[1])
            axes.set_xlim(0.0, grid[-1] * 1e3)
            axes.set_ylim(0.0, 1.3 * max(1e-300, *(float(curve.max()) for curve in curves)))
            axes.set_ylabel(f"{name} [N]", parse_math=False, color=INK)
            if i == 0:
                axes.legend(loc="upper right", ncols=1)
            if i == len(contacts) - 1:
                axes.set_xlabel("time [ms]", color=FAINT)
        save(figure, path)
