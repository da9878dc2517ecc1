"""`python -m docs.tools.cycle_scatter`: how far start differences of the piston grow over the engine cycle.

Runs `data/piston/coarse.toml` with the piston displaced laterally by 1e-12 m … 1e-7 m and without, for three ratios of
damping, and writes `docs/piston.md`: the largest lateral displacement between two runs up to a time, over the start
difference, and the L2 norm of the difference of the windowed contact force.
"""

import sys
from pathlib import Path

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.report.force import GRID, contact_forces, smooth
from gudgeon.pipeline.report.timing import made
from gudgeon.pipeline.stages.job import Job, variant

ROOT = Path(__file__).resolve().parents[2]
SCENE, PAGE = ROOT / "data" / "piston" / "coarse.toml", ROOT / "docs" / "piston.md"
MODES = 70
DURATION, STEP, SAMPLES = 0.032, 4e-6, 8000
WINDOW = 40e-6
SCATTER = 0.05
"""Difference of windowed forces that claims about the scene allow, relative."""
UNTIL = (0.012, 0.014, 0.016, 0.020, 0.032)
"""Ends of the intervals that are compared [s]."""
DISTANCES = (1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7)
"""Start differences [m]."""
RATIOS = (0.0, 0.01, 0.05)
"""Damping ratios of both bodies at the frequency of the scene."""
LIMIT = 600.0
"""CPU time of a run [s]."""


def piston(ratio: float, distance: float) -> Job:
    """Return the cycle with a damping ratio and a start difference [m]."""
    modes = {"modes": {"normal_count": MODES, "static_count": 0}}
    damping = {"ratio": ratio, "frequency": 5000.0} if ratio else "unset"
    bodies = {"piston": {"damping": damping, "position": [distance, 0.0, 0.0]}, "liner": {"damping": damping}}
    run = {"duration": DURATION, "step": STEP, "samples": SAMPLES, "frames": 10, "checks": False}
    changes = {"component": {"piston": modes, "liner": modes}, "body": bodies, "run": run}
    return variant(open_job(SCENE), changes)


def scatter(one: Trajectory, other: Trajectory) -> tuple[list[float], list[float]]:
    """Return the largest lateral displacement between two runs [m] and the relative difference of force, by `UNTIL`."""
    apart = np.abs(one.motion["piston"][:, 0] - other.motion["piston"][:, 0])
    grid = np.linspace(0.0, DURATION, GRID + 1)
    forces = [
        smooth(run.times, np.column_stack(list(contact_forces(run).values())), grid, WINDOW) for run in (one, other)
    ]
    lengths, relative = [], []
    for until in UNTIL:
        inside = grid[1:] <= until * (1 + 1e-9)
        lengths.append(float(apart[one.times <= until * (1 + 1e-9)].max()))
        size = np.linalg.norm(forces[0][inside])
        relative.append(float(np.linalg.norm(forces[1][inside] - forces[0][inside]) / size))
    return lengths, relative


def table(ratio: float) -> list[str]:
    """Return the lines of the table of one damping ratio."""
    runs = {distance: made(piston(ratio, distance), LIMIT) for distance in (0.0, *DISTANCES)}
    ends = [f"{until * 1e3:g} ms" for until in UNTIL]
    lines = [f"| start difference | {' | '.join(ends)} |", f"|{'---|' * (len(ends) + 1)}"]
    reach = []
    for distance in DISTANCES:
        lengths, relative = scatter(runs[0.0], runs[distance])
        able = [until for until, size in zip(UNTIL, relative, strict=True) if size < SCATTER]
        reach.append(f"{distance:.0e} m: {max(able) * 1e3:g} ms" if able else f"{distance:.0e} m: none")
        cells = [f"{a / distance:.3g} / {b:.0e}" for a, b in zip(lengths, relative, strict=True)]
        lines.append(f"| {distance:.0e} m | {' | '.join(cells)} |")
    return [*lines, "", f"Forces agree to {SCATTER:.0%} up to, of the times above: {', '.join(reach)}."]


def main(page: Path = PAGE) -> None:
    """Write the page."""
    lines = [
        "# The piston's cycle: growth of start differences",
        "",
        f"`python -m docs.tools.cycle_scatter`: {SCENE.relative_to(ROOT)} with {MODES} normal modes a body, steps of"
        f" {STEP * 1e6:g} µs, the piston displaced laterally at the start. Each cell: largest lateral displacement"
        " between the two runs up to that time over the start difference / L2 norm of the difference of the contact"
        f" forces behind a {WINDOW * 1e6:g} µs Hann window, relative.",
    ]
    for ratio in RATIOS:
        lines += ["", f"## Damping ratio {ratio:.0%} at 5 kHz", "", *table(ratio)]
    write_text(page, "\n".join(lines) + "\n")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
