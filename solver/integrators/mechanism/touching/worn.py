"""Wear of joints with clearance: the shapes that journals and bearings have, and what rubs off them in a run.

Worn volume is k/H times the work that the normal force would do over the sliding distance, ∫ F |v| dt. It is added up
from the differences of the integral that the integrator has of every section, so that its sum over the cells is `slide`
to round-off, and lies under the pressure of an elastic foundation, see `touching.soft`.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.integrators.mechanism.arrays import Model, Work
from gudgeon.solver.integrators.mechanism.touching.kernel import APART
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.wear import SPREAD

BEARING, JOURNAL_SIDE = range(2)
CELL_SUMS = ("impulse", "slide", "journal_slide")
"""What is added up: impulse over the bearing [N s], force times sliding distance over bearing and journal [N m]."""


class WornSection(NamedTuple):
    """Wear of one section of a joint."""

    cells: int
    shapes: tuple[np.ndarray | None, np.ndarray | None]
    """Worn depth of bearing and journal at the start [m], (cells,); None where it is round."""
    softness: float
    """[m], see `touching.soft`."""
    least: float
    """Finest softness that cells resolve [m]."""
    after: float
    """Time from which wear counts [s]."""
    rates: tuple[float, float]
    """k/H of bearing and journal [1/Pa]."""
    areas: tuple[float, float]
    """Of a cell of both [m²]."""
    thickness: float
    """Of the wall that may be worn away [m]."""


def worn_section(joint: Clearance, number: int) -> WornSection | None:
    """Return the wear of a section of a joint by its number, None without wear."""
    wear = joint.wear
    if wear is None:
        return None
    rows = [one[number] if one and any(one[number]) else None for one in (wear.bearing_depth, wear.journal_depth)]
    bearing, journal = (None if one is None else wear.on_cells(one) for one in rows)
    soft, least = wear.softness(joint.clearance), wear.least_softness(joint.clearance)
    rates = wear.coefficient / wear.hardness, wear.journal_coefficient / wear.hardness
    thickness = np.inf if wear.thickness is None else wear.thickness
    areas = joint.worn_areas()
    return WornSection(
        wear.cells, (bearing, journal), soft, least, wear.after, rates=rates, areas=areas, thickness=thickness
    )


def worn_arrays(worn: list[WornSection | None]) -> dict[str, np.ndarray]:
    """Return the arrays of the worn shapes of all sections; a section without has no cells."""
    c, most = len(worn), max((one.cells for one in worn if one is not None and any_shape(one)), default=0)
    arrays = {
        "worn_cells": np.zeros((c, 2), np.int64), "worn_soft": np.ones(c), "worn_depth": np.zeros((c, 2, most)),
        "worn_turn": np.zeros((c, most, 2)),
    }  # fmt: skip
    for i, one in enumerate(worn):
        if one is None or not any_shape(one):
            continue
        arrays["worn_soft"][i], arrays["worn_turn"][i, : one.cells] = one.softness, turns(one.cells)
        for side, shape in enumerate(one.shapes):
            if shape is not None:
                arrays["worn_cells"][i, side], arrays["worn_depth"][i, side, : one.cells] = one.cells, shape
    return arrays


def any_shape(one: WornSection) -> bool:
    """Whether a section's bearing or journal is not round."""
    return any(shape is not None for shape in one.shapes)


def turns(cells: int) -> np.ndarray:
    """Return cosine and sine of the angles of cells, (cells, 2)."""
    angles = 2 * np.pi / cells * np.arange(cells)
    return np.column_stack([np.cos(angles), np.sin(angles)])


def offsets(model: Model, work: Work, section: int) -> np.ndarray:
    """Return a section's offset, as last observed, along the frames of bearing and journal [m], (2, 2)."""
    a, d = 2 * int(model.touch_pair[section]), work.touch[section, APART : APART + 3]
    u = work.axes[a, :, 2]
    e = d - (d @ u) * u
    return np.array([e @ work.axes[a, :, :2], e @ work.axes[a + 1, :, :2]])


class Rubbed:
    """What is added up over the cells of one section."""

    def __init__(self, worn: WornSection) -> None:
        self.worn, self._turns = worn, turns(worn.cells)
        self.sums = np.zeros((len(CELL_SUMS), worn.cells))
        """See `CELL_SUMS`, (3, cells)."""
        self.indented = 0.0
        """Integral of the indentation over force times sliding distance [N m²]."""

    def add(self, ends: np.ndarray, depths: np.ndarray, impulse: float, work: float) -> None:
        """Add what happened between two times.

        Args:
            ends: Offset of the journal along the frames of bearing and journal at both times [m], (2, 2, 2).
            depths: Indentations then [m], (2,).
            impulse: Integral of the force [N s].
            work: Integral of force times sliding speed [N m].
        """
        self.indented += work * max(0.0, float(depths.mean()))
        bearing = self._shares(ends[:, BEARING], depths, BEARING)
        self.sums[0] += impulse * bearing
        self.sums[1] += work * bearing
        self.sums[2] += work * self._shares(ends[:, JOURNAL_SIDE], depths, JOURNAL_SIDE)

    def depths(self, side: int) -> np.ndarray:
        """Return the depth that this run has worn off the bearing or the journal [m], (cells,)."""
        return self.worn.rates[side] / self.worn.areas[side] * self.sums[1 + side]

    @property
    def through(self) -> bool:
        """Whether a worn depth, with that of the start, exceeds the wall."""
        for side, shape in enumerate(self.worn.shapes if np.isfinite(self.worn.thickness) else ()):
            before = 0.0 if shape is None else shape
            if (self.depths(side) + before).max() > self.worn.thickness:
                return True
        return False

    def _shares(self, ends: np.ndarray, depths: np.ndarray, side: int) -> np.ndarray:
        """Return the share of each cell, (cells,), whose sum is one, of pressure that moves from one end to another."""
        first, last = (np.arctan2(y, x) for x, y in ends)
        swept = abs((last - first + np.pi) % (2 * np.pi) - np.pi)
        softness = max(self.worn.least, SPREAD * max(0.0, float(depths.mean())))
        size = float(np.linalg.norm(ends, axis=1).max())
        width = np.sqrt(softness / size) if size > 0 else np.pi
        count = 1 + int(np.ceil(swept / width))
        at = (np.arange(count) + 0.5) / count
        offsets = ends[0] + at[:, None] * (ends[1] - ends[0])
        levels = offsets @ self._turns.T
        if (shape := self.worn.shapes[side]) is not None:
            levels = levels - shape
        weights = np.exp((levels - levels.max(axis=1, keepdims=True)) / softness)
        return (weights / weights.sum(axis=1, keepdims=True)).mean(axis=0)


def worn_quantities(joint: str, sections: list[Rubbed]) -> Json:
    """Return what wore off a joint in a run, `JOINT.name` → {"value", "unit"}."""
    found: Json = {}
    for side, name in enumerate(("worn", "journal_worn")):
        if not sections[0].worn.rates[side]:
            continue
        depths = np.array([one.depths(side) for one in sections])
        _, cell = np.unravel_index(int(depths.argmax()), depths.shape)
        values = (
            ("volume", float(depths.sum()) * sections[0].worn.areas[side], "m^3"),
            ("depth", float(depths.max()), "m"),
            ("angle", 2 * np.pi * float(cell) / depths.shape[1], "rad"),
        )
        found |= {f"{joint}.{name}_{key}": {"value": value, "unit": unit} for key, value, unit in values}
    work = sum(float(one.sums[1].sum()) for one in sections)
    if work > 0:
        mean = sum(one.indented for one in sections) / work
        found[f"{joint}.rubbed_indentation"] = {"value": mean, "unit": "m"}
    return found


def worn_cells(sections: list[Rubbed]) -> Json:
    """Return what was added up over the cells of a joint's sections, a list for each; see `CELL_SUMS`."""
    return {key: [one.sums[row].tolist() for one in sections] for row, key in enumerate(CELL_SUMS)}
