"""Wear of a journal and its bearing, see `laws.archard`: worn shapes, and how they meet."""

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.laws.archard import Archard
from gudgeon.solver.numbers import Length, RatioFromZero, from_zero, sizeable

Depth = Annotated[float, from_zero("m"), sizeable("m")]
Depths = tuple[tuple[Depth, ...], ...]
FEWEST = 8
"""Depths of a worn shape."""
CELLS = 360
"""Default."""
PRESSED = 0.02
"""Default of `indentation` over the clearance."""
FINEST = 1.5
"""Least standard deviation of the pressure over a cell: sums over cells then depend on their places by 1e-19."""
SPREAD = 0.4
"""Square of the standard deviation of the parabolic pressure of a thin elastic foundation over δ/e: its half-width is
√(2 δ/e), and the variance of a parabola is a fifth of the square of that."""


class JournalWear(Archard):
    """Wear of a joint with clearance: worn volumes over the angle, and the worn shapes that it starts with."""

    coefficient: RatioFromZero = Field(description="k of the bearing in V = k/H ∫ F |v| dt [1]")
    journal_coefficient: RatioFromZero = Field(default=0.0, description="k of the journal [1]")
    length: Length | None = Field(
        default=None,
        description="Of the bearing along its axis, over which depths are volumes per area; default: that of the joint",
    )
    cells: int = Field(default=CELLS, ge=36, le=3600, description="Number of cells about the axis")
    bearing_depth: Depths = Field(
        default=(),
        description="Worn depth of the bearing at the start, at evenly spaced angles from zero, one list for each"
        " touching section; default: round [m]",
    )
    journal_depth: Depths = Field(default=(), description="The same of the journal [m]")
    indentation: Length | None = Field(
        default=None,
        description="Typical indentation δ under load: a worn shape is averaged over the angle √(0.4 δ/clearance), the"
        " standard deviation of the pressure of an elastic foundation; default: 2 % of the clearance",
    )

    @model_validator(mode="after")
    def _shapes(self) -> "JournalWear":
        for key in ("bearing_depth", "journal_depth"):
            for row in getattr(self, key):
                if len(row) < FEWEST:
                    raise ValueError(f"{key}: {len(row)} depths given; allowed: {FEWEST} or more for each section")
                if self.thickness is not None and max(row) > self.thickness:
                    raise ValueError(f"{key}: {max(row):g} m is deeper than the wall, thickness = {self.thickness:g} m")
        return self

    @property
    def step(self) -> float:
        """Angle of a cell [rad]."""
        return 2 * np.pi / self.cells

    def on_cells(self, depths: tuple[float, ...]) -> np.ndarray:
        """Return the depth of each cell from evenly spaced ones, by a periodic cubic spline [m], (cells,)."""
        y, n = np.array(depths, float), len(depths)
        if n == self.cells:
            return y
        # Second derivatives per square of the spacing, M_{i-1} + 4 M_i + M_{i+1} = 6 (y_{i-1} − 2 y_i + y_{i+1}).
        wave = 2 * np.cos(2 * np.pi * np.fft.fftfreq(n))
        bend = np.fft.ifft(6 * (wave - 2) / (4 + wave) * np.fft.fft(y)).real
        position = np.arange(self.cells) * n / self.cells
        k = position.astype(int)
        s, after = position - k, (k + 1) % n
        r = 1 - s
        curved = (r**3 - r) * bend[k] + (s**3 - s) * bend[after]
        return r * y[k] + s * y[after] + curved / 6

    def least_softness(self, clearance: float) -> float:
        """Return the least softness that the cells resolve [m]."""
        return clearance * (FINEST * self.step) ** 2

    def softness(self, clearance: float) -> float:
        """Return the depth over which the pressure on a worn shape falls by e [m]; see `core/ports/worn.hpp`."""
        return max(self.least_softness(clearance), SPREAD * (self.indentation or PRESSED * clearance))
