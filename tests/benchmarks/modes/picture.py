"""Picture of CPU time and memory over dofs: a line for each contestant, in one thread."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from tests.benchmarks.modes.table import OURS, Row

COLOURS = {OURS: "C0", "ngsolve": "C1", "scipy": "C2", "calculix": "C3", "exudyn": "C4"}


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the medians of whole jobs, from the mesh to verified modes."""
    figure = Figure(figsize=(8, 3.4), layout="constrained")
    time, memory = figure.subplots(1, 2)
    for name, colour in COLOURS.items():
        own = sorted((row for row in rows if row.contestant == name and row.threads == 1), key=lambda row: row.dofs)
        if own:
            dofs = [row.dofs for row in own]
            time.loglog(dofs, [row.job_cpu for row in own], "o-", color=colour, label=name)
            memory.loglog(dofs, [row.peak / 1024 for row in own], "o-", color=colour, label=name)
    sizes = {row.dofs: row.size for row in rows}
    for axes, text in ((time, "CPU time of 30 modes [s]"), (memory, "peak memory [GiB]")):
        axes.set_xticks(list(sizes), list(sizes.values()))
        axes.set_xticks([], minor=True)
        axes.set_xlabel("degrees of freedom")
        axes.set_ylabel(text)
        axes.grid(True, which="both", alpha=0.3)
    time.legend()
    figure.savefig(path, dpi=100)
