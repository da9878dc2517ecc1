"""Figures for a notebook, which returns what it draws instead of writing it."""

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.plots.base.style import INK, ShownFigure, prefixed, styled, time_unit


def force_figure(trajectory: Trajectory) -> ShownFigure:
    """Return the resultant force of each contact over time; of a run without contacts, its energies."""
    sizes = {name: np.linalg.norm(history.force, axis=1) for name, history in trajectory.contacts.items()}
    curves = {f"force of {name}": (values, "N") for name, values in sizes.items()}
    if not curves:
        names = ("kinetic energy", "strain energy")
        curves = {name: (trajectory.energies[:, column], "J") for column, name in enumerate(names)}
    factor, unit = time_unit(float(trajectory.times[-1]) if len(trajectory.times) else 1.0)
    with styled():
        figure = ShownFigure(figsize=(7.2, 0.6 + 2.1 * len(curves)), layout="constrained")
        axes = figure.subplots(len(curves), 1, sharex=True, squeeze=False)[:, 0]
        for panel, (name, (values, physical)) in zip(axes, curves.items(), strict=True):
            scale, shown = prefixed(float(np.abs(values).max(initial=0.0)), physical)
            panel.plot(trajectory.times * factor, values * scale, color=INK, linewidth=1.2)
            panel.set_ylabel(f"{name} [{shown}]")
        axes[-1].set_xlabel(f"time [{unit}]")
    return figure
