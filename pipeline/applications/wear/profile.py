"""The profile of a worn cylinder: the deviations of its scene less worn depths at contact points, on a grid."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.geometry.profile import ProfileTable
from gudgeon.pipeline.scenes.change import deviation_of

FOLDER = "worn"
"""Within the folder of results."""
FINER = 2.0
"""Spacing of contact points over that of the grid."""
MOST = 361
"""Lines of the grid in each direction."""
PASSES = 8
"""Corrections of the grid, after which its spline has the depths at the contact points."""
APART = 1e-9
"""Least distance of two lines of the grid over their span."""


class WornProfile:
    """Writes profile tables of a worn component."""

    def __init__(
        self, job: Any, component: str, surface: str, positions: Mapping[str, np.ndarray], *,
        spacing: float, radius: float, span: tuple[float, float],
    ) -> None:  # fmt: skip
        """Take the unworn profile of a component.

        Args:
            positions: Angle [rad] and height [m] of the points of each contact, (c, 2).
            spacing: Of contact points [m].
            radius: Of the cylinder [m].
            span: Lowest and highest node of the surface [m].
        """
        self.surface, self.component = surface, component
        self._places = {name: np.column_stack([radius * p[:, 0], p[:, 1]]) for name, p in positions.items()}
        self._spacing, self._turn = spacing, 2 * np.pi * radius
        deviation = deviation_of(job.scene.component[component], job.folder, component)
        base = 0.0 if deviation is None else deviation[1]
        step = spacing / FINER
        rows, columns = (
            min(MOST, max(5, int(np.ceil(length / step)) + 1)) for length in (span[1] - span[0], self._turn)
        )
        table = base if isinstance(base, ProfileTable) else None
        self._heights = _lines(np.linspace(*span, rows), None if table is None else table.heights, span)
        turns = None if table is None or len(table.angles) == 1 else np.mod(table.angles + np.pi, 2 * np.pi) - np.pi
        self._angles = _lines(np.linspace(-np.pi, np.pi, columns), turns, (-np.pi, np.pi))
        grid = np.meshgrid(self._heights, self._angles, indexing="ij")
        heights = (
            base(grid[0].ravel(), grid[1].ravel()) if isinstance(base, ProfileTable) else np.full(grid[0].size, base)
        )
        self._unworn = np.asarray(heights).reshape(grid[0].shape)
        self._at = np.column_stack([radius * grid[1].ravel(), grid[0].ravel()])
        self._radius = radius
        self.mismatch = 0.0
        """Largest difference so far of the moved surface from the worn depths at contact points, over the largest."""

    def write(self, depths: Mapping[str, np.ndarray], out: Path, name: str | None = None) -> Path:
        """Write the table of worn depths (c,) by contact [m] into a folder of results, and return its path."""
        worn = self.worn(depths)
        head = ["height [m]", *(f"{angle:.12g}" for angle in np.degrees(self._angles))]
        deviations = self._unworn - worn
        deviations[:, -1] = deviations[:, 0]
        rows = [[f"{z:.12g}", *(f"{x:.15g}" for x in row)] for z, row in zip(self._heights, deviations, strict=True)]
        return write_table(out, self.component, [head, *rows], name)

    def worn(self, depths: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the worn depth on the grid [m], (h, a), whose spline has `depths` at the contact points."""
        total = np.zeros(self._unworn.shape)
        for name, target in depths.items():
            if not target.any():
                continue
            positions, residual = self._places[name], target.copy()
            worn = np.zeros(total.shape)
            for _ in range(PASSES):
                worn = np.maximum(worn + self._spread(positions, residual).reshape(total.shape), 0.0)
                table = ProfileTable(self._heights, self._angles, worn, "worn depths")
                residual = target - table(positions[:, 1], positions[:, 0] / self._radius)
            self.mismatch = max(self.mismatch, float(np.abs(residual).max() / target.max()))
            total += worn
        return total

    def _spread(self, positions: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Interpolate values at places on the unrolled cylinder (c, 2) on the grid, zero two spacings beside them."""
        from scipy.interpolate import LinearNDInterpolator
        from scipy.spatial import KDTree

        spread = np.zeros(len(self._at))
        around = np.concatenate([positions + np.array([n * self._turn, 0.0]) for n in (-1, 0, 1)])
        far, nearest = KDTree(around).query(self._at)
        close = far < 2 * self._spacing
        interpolated = LinearNDInterpolator(around, np.tile(values, 3))(self._at[close])
        fade = np.clip(2 - far[close] / self._spacing, 0.0, 1.0)
        beside = np.tile(values, 3)[nearest[close]]
        spread[close] = fade * np.where(np.isnan(interpolated), beside, interpolated)
        return spread


def _lines(even: np.ndarray, table_lines: np.ndarray | None, span: tuple[float, float]) -> np.ndarray:
    """Return evenly spaced lines of a grid with those of the scene's own table among them, ascending."""
    low, high = span
    both = even if table_lines is None else np.concatenate([even, np.clip(table_lines, low, high)])
    ordered = np.unique(both)
    separate = np.diff(ordered, prepend=-np.inf) > APART * (high - low)
    lines = ordered[separate]
    lines[0], lines[-1] = low, high
    return lines


def write_table(out: Path, component: str, rows: list[list[str]], name: str | None = None) -> Path:
    """Write a profile table into a folder of results, by default under a name of its content, and return its path."""
    text = csv_text(rows)
    name = name or f"{component}-{hashlib.sha256(text.encode()).hexdigest()[:12]}.csv"
    (out / FOLDER).mkdir(parents=True, exist_ok=True)
    write_text(path := out / FOLDER / name, text)
    return path
