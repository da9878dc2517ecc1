"""Wear of joints with clearance: the shapes that journals and bearings have, and what rubs off them in a run.

Worn volume is k/H times the work that the normal force would do over the sliding distance, ∫ F |v| dt. It is added up
from the differences of the integral that the integrator has of every section, so that its sum over the cells is
`load_distance` to round-off, and lies under the pressure of an elastic foundation, see `core/ports/worn.hpp`.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.contact.bores import ElasticBore
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.turning.arrays import Model, Work
from gudgeon.solver.integrators.turning.touching.columns import APART
from gudgeon.solver.integrators.turning.touching.yielding import Pressed
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.wear import SPREAD

BEARING, JOURNAL_SIDE = range(2)
PLACES_PER_CELL = 2
"""Least number: areas of corners and middles of elements alternate."""
SWEEP = 4
"""Cells that an elastic bearing's pressure may move by between two offsets at which it is computed."""
CELL_SUMS = ("impulse", "load_distance", "journal_load_distance")
"""What is added up: impulse over the bearing [N s], force times sliding distance over bearing and journal [N m]."""


class WornSection(NamedTuple):
    """Wear of one section of a joint."""

    cells: int
    shapes: tuple[np.ndarray | None, np.ndarray | None]
    """Worn depth of bearing and journal at the start [m], (cells,); None where it is round."""
    softness: float
    """[m], see `core/ports/worn.hpp`."""
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
    pressed: Pressed | None = None
    """An elastic bearing."""


def worn_section(joint: Clearance, section: int, bearing_pressure: Pressed | None = None) -> WornSection | None:
    """Return the wear of a section of a joint by its number, None without wear.

    Args:
        bearing_pressure: Its elastic bearing, whose pressure is kept without wear too.
    """
    wear = joint.wear
    if bearing_pressure is not None:
        return _pressed_section(joint, bearing_pressure)
    if wear is None:
        return None
    rows = [r[section] if r and any(r[section]) else None for r in (wear.bearing_depth, wear.journal_depth)]
    bearing, journal = (None if r is None else wear.on_cells(r) for r in rows)
    soft, least_softness = wear.softness(joint.clearance), wear.least_softness(joint.clearance)
    rates = wear.coefficient / wear.hardness, wear.journal_coefficient / wear.hardness
    thickness = np.inf if wear.thickness is None else wear.thickness
    areas = joint.worn_areas()
    return WornSection(
        wear.cells, (bearing, journal), soft, least_softness, wear.after, rates=rates, areas=areas, thickness=thickness
    )


def _pressed_section(joint: Clearance, bearing_pressure: Pressed) -> WornSection:
    """Return the wear of a joint with an elastic bearing; its worn shape is in the gaps of the bearing."""
    wear, bore = joint.wear, bearing_pressure.bore
    thickness = np.inf if wear is None or wear.thickness is None else wear.thickness
    cells = max(1, _places(bore) // PLACES_PER_CELL) if wear is None else wear.cells
    shape = wear.on_cells(wear.bearing_depth[0]) if wear is not None and wear.bearing_depth else None
    area = float(bore.areas.sum()) / cells if wear is None else joint.worn_areas()[0]
    rate, after = (0.0, 0.0) if wear is None else (wear.coefficient / wear.hardness, wear.after)
    return WornSection(
        cells, (shape, None), 0.0, 0.0, after, rates=(rate, 0.0), areas=(area, area), thickness=thickness,
        pressed=bearing_pressure,
    )  # fmt: skip


def _places(bore: ElasticBore) -> int:
    """Return how many places a bore has about its axis."""
    return len(np.unique(np.round(bore.angles, 6)))


def check_cells(name: str, worn: WornSection, bore: ElasticBore) -> None:
    """Raise a SceneError where a cell has so few places of a bore that its pressure would depend on them."""
    if worn.cells > (limit := max(1, _places(bore) // PLACES_PER_CELL)):
        raise SceneError(
            f"joint.{name}.wear.cells: {worn.cells} given; the bore has {_places(bore)} positions about its axis, and"
            f" corners and middles of elements differ: allowed: up to {limit}"
        )


def worn_arrays(worn: list[WornSection | None]) -> dict[str, np.ndarray]:
    """Return the arrays of the worn shapes of all sections; a section without has no cells."""
    c, largest = (
        len(worn),
        max((section.cells for section in worn if section is not None and any_shape(section)), default=0),
    )
    arrays = {
        "worn_cells": np.zeros((c, 2), np.int64), "worn_soft": np.ones(c), "worn_depth": np.zeros((c, 2, largest)),
        "worn_turn": np.zeros((c, largest, 2)),
    }  # fmt: skip
    for i, section in enumerate(worn):
        if section is None or not any_shape(section):
            continue  # Those of an elastic bearing are in its table.
        arrays["worn_soft"][i], arrays["worn_turn"][i, : section.cells] = section.softness, turns(section.cells)
        for side, shape in enumerate(section.shapes):
            if shape is not None:
                arrays["worn_cells"][i, side], arrays["worn_depth"][i, side, : section.cells] = section.cells, shape
    return arrays


def any_shape(section: WornSection) -> bool:
    """Whether a section's bearing or journal is not round, beside that of an elastic bearing."""
    return section.pressed is None and any(shape is not None for shape in section.shapes)


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
        self.most = 0.0
        """Largest force [N]."""
        self._hardest = np.zeros(2), 0.0
        """Offset along the frame of the bearing and indentation then [m]."""
        self._onto = _deposit(worn.pressed.bore.angles, worn.cells) if worn.pressed is not None else None

    def note(self, force: float, offset: np.ndarray, depth: float) -> None:
        """Keep where the journal was, (2,), and how deep [m], if the force is the largest so far [N]."""
        if force > self.most:
            self.most, self._hardest = force, (offset.copy(), depth)

    def pressure(self) -> np.ndarray:
        """Return the pressure over the bearing at the largest force [Pa], (cells,)."""
        offset, depth = self._hardest
        if self.most <= 0:
            return np.zeros(self.worn.cells)
        shares = self._shares(np.array([offset, offset]), np.array([depth, depth]), BEARING)
        return self.most * shares / self.worn.areas[BEARING]

    def pressed_angle(self) -> float:
        """Return the angle over which an elastic bearing is pressed at the largest force [rad]."""
        assert self.worn.pressed is not None
        angles = np.sort(self.worn.pressed.bore.angles[self.worn.pressed.forces(self._hardest[0]) > 0])
        if len(angles) < 2:
            return 0.0
        free = np.diff(np.append(angles, angles[0] + 2 * np.pi))
        return 2 * np.pi - float(free.max())

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
        start_angle, end_angle = (np.arctan2(y, x) for x, y in ends)
        swept = abs((end_angle - start_angle + np.pi) % (2 * np.pi) - np.pi)
        if self._onto is not None:
            return self._pressures(ends, swept)
        softness = max(self.worn.least, SPREAD * max(0.0, float(depths.mean())))
        size = float(np.linalg.norm(ends, axis=1).max())
        width = np.sqrt(softness / size) if size > 0 else np.pi
        count = 1 + int(np.ceil(swept / width))
        fractions = (np.arange(count) + 0.5) / count
        offsets = ends[0] + fractions[:, None] * (ends[1] - ends[0])
        levels = offsets @ self._turns.T
        if (shape := self.worn.shapes[side]) is not None:
            levels = levels - shape
        weights = np.exp((levels - levels.max(axis=1, keepdims=True)) / softness)
        return (weights / weights.sum(axis=1, keepdims=True)).mean(axis=0)

    def _pressures(self, ends: np.ndarray, swept: float) -> np.ndarray:
        """Return the shares of an elastic bearing; both sides have those of the bearing."""
        bearing = self.worn.pressed
        assert bearing is not None
        assert self._onto is not None
        count = 1 + int(swept / (SWEEP * 2 * np.pi / self.worn.cells))
        total = np.zeros(self.worn.cells)
        for fraction in (np.arange(count) + 0.5) / count:
            offset = ends[0] + fraction * (ends[1] - ends[0])
            forces = bearing.forces(offset)
            if not forces.any():
                forces[bearing.first_touch(float(np.arctan2(offset[1], offset[0])))[1]] = 1.0
            total += self._onto @ forces / forces.sum()
        return total / count


def _deposit(angles: np.ndarray, cells: int) -> np.ndarray:
    """Return the shares by which forces at angles act on the two cells beside them, (cells, p)."""
    position = angles / (2 * np.pi) * cells
    low = np.floor(position).astype(int)
    shares, columns = np.zeros((cells, len(angles))), np.arange(len(angles))
    np.add.at(shares, (low % cells, columns), 1 - (position - low))
    np.add.at(shares, ((low + 1) % cells, columns), position - low)
    return shares


def worn_quantities(joint: str, sections: list[Rubbed]) -> Json:
    """Return what wore off a joint in a run, `JOINT.name` → {"value", "unit"}."""
    json: Json = {}
    for side, name in enumerate(("wear", "journal_wear")):
        if not sections[0].worn.rates[side]:
            continue
        depths = np.array([s.depths(side) for s in sections])
        _, cell = np.unravel_index(int(depths.argmax()), depths.shape)
        values = (
            ("volume", float(depths.sum()) * sections[0].worn.areas[side], "m^3"),
            ("depth", float(depths.max()), "m"),
            ("angle", 2 * np.pi * float(cell) / depths.shape[1], "rad"),
        )
        json |= {f"{joint}.{name}_{key}": {"value": value, "unit": unit} for key, value, unit in values}
    work = sum(float(s.sums[1].sum()) for s in sections)
    hardest = max(sections, key=lambda s: s.most)
    if hardest.most > 0:
        json[f"{joint}.pressure_peak"] = {"value": float(hardest.pressure().max()), "unit": "Pa"}
        if hardest.worn.pressed is not None:
            json[f"{joint}.pressed_angle"] = {"value": hardest.pressed_angle(), "unit": "rad"}
    if work > 0 and hardest.worn.pressed is None:
        mean = sum(s.indented for s in sections) / work
        json[f"{joint}.wear_indentation"] = {"value": mean, "unit": "m"}
    return json


def worn_cells(sections: list[Rubbed]) -> Json:
    """Return what was added up over the cells of a joint's sections, and the pressure at the largest force [Pa], a list
    for each; see `CELL_SUMS`."""
    sums = {key: [one.sums[row].tolist() for one in sections] for row, key in enumerate(CELL_SUMS)}
    return sums | {"pressure": [one.pressure().tolist() for one in sections]}
