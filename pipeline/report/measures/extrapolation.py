"""The full-FE run at step zero, by Richardson's extrapolation of the two finest runs, and its own uncertainty.

With errors C hᵖ in every history, f = f₂ + (f₂ − f₁) / ((h₁/h₂)ᵖ − 1). All quantities are then those of the
extrapolated histories, curves and numbers alike. The order p is observed in the windowed forces of the three finest
runs.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.plots.contact.force_window import resample_mean
from gudgeon.pipeline.report.convergence import order_between
from gudgeon.pipeline.report.force import GRID, contact_forces, end_of, smooth
from gudgeon.pipeline.stages.job import Job

ORDER = 2.0
"""Order of the full-FE integrator, the trapezoidal rule: the largest that is used, and the one without three runs."""


@dataclass(frozen=True)
class Extrapolation:
    """An extrapolated full-FE run."""

    run: NodalRecord
    rougher: NodalRecord
    """The extrapolation of the two runs before, or the finest run where there are only two."""
    share: float
    """Estimated error of the extrapolated run over its distance from the rougher one."""
    words: str
    """Steps and order."""


def extrapolation(job: Job, runs: Sequence[NodalRecord]) -> Extrapolation:
    """Return the extrapolation of the two finest of some full-FE runs, coarse to fine.

    The extrapolation of the runs before it has an error that falls with the order p at least, so the distance of the
    two over (h₁/h₂)ᵖ − 1 estimates the error that is left. With two runs alone, it is their whole correction.
    """
    *_, coarse, fine = runs
    observed = _observed_order(job, runs[-3:]) if len(runs) > 2 and job.scene.contact else None
    order = ORDER if observed is None else min(observed, ORDER)
    run = _extrapolated(coarse, fine, order)
    how = (
        f"of order {order:g}, which is stated" if observed is None else f"of order {order:.2g}, observed {observed:.2f}"
    )
    words = f"full FE at {coarse.step * 1e6:g} and {fine.step * 1e6:g} µs, extrapolated with errors {how}"
    if observed is None:
        return Extrapolation(run, fine, 1.0, words)
    share = 1 / ((coarse.step / fine.step) ** order - 1)
    return Extrapolation(run, _extrapolated(runs[-3], coarse, order), share, words)


def _observed_order(job: Job, runs: Sequence[NodalRecord]) -> float:
    """Return p of the windowed forces of three runs, by their L2 distances; `LOWEST` at least and 4 at most."""
    grid, window = np.linspace(0.0, end_of(job), GRID + 1), job.scene.report.window
    curves = []
    for run in runs:
        forces = contact_forces(run)
        curves.append(smooth(run.times, np.column_stack([forces[name] for name in job.scene.contact]), grid, window))
    above, below = (float(np.linalg.norm(f - g)) for f, g in itertools.pairwise(curves))
    return order_between([run.step for run in runs], (above, below), 2 * ORDER)


def _extrapolated(coarse: NodalRecord, fine: NodalRecord, order: float) -> NodalRecord:
    """Return the extrapolation of two runs, at the times of the finer one."""
    factor = 1 / ((coarse.step / fine.step) ** order - 1)
    edges, fine_edges = (np.concatenate([[0.0], run.times]) for run in (coarse, fine))

    def means(name: str) -> np.ndarray:
        return fine.forces[name] + factor * (fine.forces[name] - resample_mean(edges, coarse.forces[name], fine_edges))

    forces = {name: means(name) for name in fine.forces}
    total = fine.force + factor * (fine.force - resample_mean(edges, coarse.force, fine_edges))
    motion = {
        name: _corrected((fine.times, values), (coarse.times, coarse.motion[name]), factor)
        for name, values in fine.motion.items()
    }
    masters = fine.masters
    if fine.frame_times is not None and coarse.frame_times is not None:
        masters = {
            name: _corrected((fine.frame_times, values), (coarse.frame_times, coarse.masters[name]), factor)
            for name, values in fine.masters.items()
        }
    quantities = {name: _value(entry, coarse.quantities.get(name), factor) for name, entry in fine.quantities.items()}
    return replace(fine, force=total, forces=forces, motion=motion, masters=masters, quantities=quantities)


def _corrected(fine: tuple[np.ndarray, np.ndarray], coarse: tuple[np.ndarray, np.ndarray], factor: float) -> np.ndarray:
    """Return values of the finer run with the correction at the times of the coarser one, linear in between, (f, k).

    Args:
        fine, coarse: Times [s], (f,) and (c,), and values, (f, k) and (c, k).
    """
    rows = [
        fine_values + factor * np.interp(fine[0], coarse[0], np.interp(coarse[0], fine[0], fine_values) - coarse_values)
        for fine_values, coarse_values in zip(fine[1].T, coarse[1].T, strict=True)
    ]
    return np.array(rows).T.reshape(fine[1].shape)


def _value(fine: Mapping[str, Any], coarse: Mapping[str, Any] | None, factor: float) -> dict[str, Any]:
    if coarse is None:
        return dict(fine)
    value = fine["value"] + factor * (fine["value"] - coarse["value"])
    return {**fine, "value": value}
