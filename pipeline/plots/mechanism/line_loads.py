"""`line-loads.png`: how the force of contacts with many points runs over their surfaces, over time.

The force per length, along the direction in the surface along which the centre of the force moves most: along the flank
of a tooth. Its integral over the length is the contact's force.
"""

from dataclasses import dataclass

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing

LEAST_POINTS = 8
"""Least number of points of a contact that is drawn."""
LEAST_FRAMES = 3
MOST = 4
"""Contacts that are drawn, those of the largest forces."""
WIDTH, HEAD, ROW = 1600, 330, 300
STILL = 1e-9
"""Way of the force's centre over the extent of the points below which it does not run."""


@dataclass(frozen=True)
class Runs:
    """Force of a contact over time and place."""

    name: str
    edges: np.ndarray
    """Borders of the bins along the surface, from its middle [m], (b + 1,)."""
    loads: np.ndarray
    """Force per length at frames [N/m], (f, b)."""


def draw_line_loads(drawing: Drawing) -> None:
    """Draw a row for each contact of many points that touched at a frame."""
    trajectory = drawing.trajectory
    peaks = {
        name: contact.multipliers.sum(axis=1).max()
        for name, contact in trajectory.contacts.items()
        if contact.multipliers.shape[1] >= LEAST_POINTS and contact.multipliers.any()
    }
    if len(trajectory.frame_times) < LEAST_FRAMES:
        return
    names = sorted(peaks, key=lambda name: -peaks[name])[:MOST]
    shown = [runs for name in trajectory.contacts if name in names and (runs := line_load(drawing, name)) is not None]
    if shown:
        style.draw(drawing.file("line-loads.png"), _figure, drawing, shown)


def line_load(drawing: Drawing, name: str) -> Runs | None:
    """Return the force per length of a contact; None of points in one place."""
    contact = drawing.trajectory.contacts[name]
    points, forces = contact.points - contact.points.mean(axis=0), contact.multipliers
    _, sizes, axes = np.linalg.svd(points, full_matrices=False)
    if not sizes[0] > 0:
        return None
    plane, total = points @ axes[:2].T, forces.sum(axis=1)
    centres = forces[total > 0] @ plane / total[total > 0, None]
    ways, turn = np.linalg.eigh(np.atleast_2d(np.cov(centres.T, aweights=total[total > 0], bias=True)))
    runs = np.sqrt(max(float(ways[-1]), 0.0)) > STILL * np.ptp(plane, axis=0).max()
    along = turn[:, -1] if runs else np.array([1.0, 0.0])
    along = along * np.sign(along[np.abs(along).argmax()])
    position = plane @ along
    count = max(int(np.sqrt(len(points))), 2)
    edges = np.linspace(position.min(), position.max(), count + 1)
    bins = np.clip(np.searchsorted(edges, position, side="right") - 1, 0, count - 1)
    members = (bins[:, None] == np.arange(count)).astype(float)
    return Runs(name, edges, forces @ members / np.diff(edges))


def _figure(drawing: Drawing, shown: list[Runs]) -> Figure:
    subtitle = "force over the length along which its centre moves most, from the middle of the contact's points"
    figure = style.new_figure("Forces that run over surfaces", subtitle, width=WIDTH, height=HEAD + ROW * len(shown))
    height = HEAD + ROW * len(shown)
    borders_of = {"left": 0.1, "right": 0.86, "bottom": 130 / height, "top": 1 - 200 / height, "hspace": 0.25}
    rows = figure.subplots(len(shown), 1, sharex=True, squeeze=False, gridspec_kw=borders_of)[:, 0]
    times = drawing.trajectory.frame_times
    scale, unit = style.time_unit(float(times[-1]))
    factor, newtons = style.prefixed(max(float(runs.loads.max()) for runs in shown), "N")
    length, metres = style.prefixed(max(float(np.abs(runs.edges).max()) for runs in shown), "m")
    middles = 0.5 * (times[1:] + times[:-1])
    borders = scale * np.array([max(2 * times[0] - middles[0], 0.0), *middles, times[-1]])
    largest = factor * max(float(runs.loads.max()) for runs in shown)
    for axes, runs in zip(rows, shown, strict=True):
        axes.pcolormesh(
            borders, length * runs.edges, factor * runs.loads.T, cmap=style.PRESSURE, vmin=0.0, vmax=largest,
            shading="flat", rasterized=True,
        )  # fmt: skip
        axes.set_ylabel(f"{runs.name} [{metres}]")
        axes.grid(visible=False)
    rows[-1].set_xlabel(f"time [{unit}]")
    box = (0.88, 130 / height, 0.018, 1 - 330 / height)
    colours = ScalarMappable(Normalize(0.0, largest), style.PRESSURE)
    style.colour_bar(figure, colours, f"force per length [{newtons}/m]", box)
    return figure
