"""Grid points and coordinate systems of bulk data of Nastran."""

import re
from collections.abc import Mapping

import numpy as np

from gudgeon.pipeline.geometry.decks.axes import Axes, from_z_x
from gudgeon.pipeline.geometry.decks.model import Source
from gudgeon.pipeline.geometry.decks.nastran.bulk import Card

ON_AXIS = 1e-9
"""Distance from an axis, over that from the origin, below which a point is on it."""


class Grids:
    """Grid points and coordinate systems, which may be defined by each other."""

    def __init__(self, path: str, by_name: Mapping[str, list[Card]]) -> None:
        self._path = path
        self._grids: dict[int, Card] = {}
        for card in by_name["GRID"]:
            label = card.integer(0)
            if label in self._grids and card.fields != self._grids[label].fields:
                raise card.source.error(f"GRID {label} is given twice")
            self._grids[label] = card
        default = by_name.get("GRDSET", [])
        self._default = default[0].integer(1, 0) if default else 0
        self._default_directions = default[0].integer(5, 0) if default else 0
        self._cards: dict[int, tuple[Card, int]] = {}
        for name, cards in by_name.items():
            if not re.fullmatch(r"CORD[12][RCS]", name):
                continue
            for card in cards:
                for start in (0, 4) if name[4] == "1" else (0,):
                    if card.text(start):
                        self._cards[card.integer(start)] = (card, start)
        self._axes: dict[int, Axes] = {0: Axes()}
        self._open: list[int] = []

    def positions(self) -> tuple[np.ndarray, np.ndarray]:
        """Return labels and positions in the basic system of all grid points."""
        labels = np.array(list(self._grids), np.int64)
        raw = np.array([[card.real(k) for k in (2, 3, 4)] for card in self._grids.values()])
        systems = np.array([card.integer(1, self._default) for card in self._grids.values()], np.int64)
        points = np.empty_like(raw)
        for system in np.unique(systems).tolist():
            rows = systems == system
            points[rows] = self._placed(system, raw[rows], next(iter(self._of(system))))
        return labels, points

    def directions(self) -> dict[int, np.ndarray]:
        """Return the directions 1, 2, 3 of grid points in systems of their own (CD), as columns (3, 3), by label."""
        directions = {}
        for label, card in self._grids.items():
            system = card.integer(5, self._default_directions)
            if system > 0:
                directions[label] = self.axes_at(system, self.position(label, card.source), card.source)
        return directions

    def axes_at(self, system: int, point: np.ndarray, source: Source) -> np.ndarray:
        """Return the directions of a system at a point of the basic one, as columns (3, 3); on the axis of a round
        system, x of the system is the radial one."""
        axes = self._system(system, source)
        kind = self._cards[system][0].name[5] if system else "R"
        if kind == "R":
            return axes.turn
        arm = (point - axes.origin) @ axes.turn
        radius, flat = float(np.linalg.norm(arm)), float(np.hypot(arm[0], arm[1]))
        sine, cosine = (flat / radius, arm[2] / radius) if radius > 0 else (1.0, 0.0)
        if not flat > ON_AXIS * radius:
            arm, flat = np.array([1.0, 0.0, arm[2]]), 1.0
        radial, around = np.array([arm[0], arm[1], 0.0]) / flat, np.array([-arm[1], arm[0], 0.0]) / flat
        upward = np.array([0.0, 0.0, 1.0])
        if kind == "C":
            return axes.turn @ np.column_stack([radial, around, upward])
        return axes.turn @ np.column_stack([sine * radial + cosine * upward, cosine * radial - sine * upward, around])

    def rectangular(self, system: int) -> bool:
        """Return whether a system is Cartesian."""
        return not system or (system in self._cards and self._cards[system][0].name[5] == "R")

    def position(self, label: int, source: Source) -> np.ndarray:
        """Return a grid point in the basic system, (3,)."""
        return self._grid(label, source)

    def placed(self, system: int, point: np.ndarray, source: Source) -> np.ndarray:
        """Return a point of a system in the basic one, (3,)."""
        return self._placed(system, point[None], source)[0]

    def _of(self, system: int) -> list[Source]:
        return [c.source for c in self._grids.values() if c.integer(1, self._default) == system]

    def _placed(self, system: int, points: np.ndarray, source: Source) -> np.ndarray:
        """Return points of a system in the basic one."""
        axes = self._system(system, source)
        kind = self._cards[system][0].name[5] if system else "R"
        if kind == "R":
            return axes.placed(points)
        r, a, b = points[:, 0], np.radians(points[:, 1]), points[:, 2]
        if kind == "C":
            return axes.placed(np.column_stack([r * np.cos(a), r * np.sin(a), b]))
        around = np.radians(b)
        off = r * np.sin(a)
        return axes.placed(np.column_stack([off * np.cos(around), off * np.sin(around), r * np.cos(a)]))

    def _system(self, system: int, source: Source) -> Axes:
        if system in self._axes:
            return self._axes[system]
        if system not in self._cards:
            raise source.error(f"names coordinate system {system}, which the deck does not have (CORD1 or CORD2)")
        card, start = self._cards[system]
        if system in self._open:
            raise card.source.error(f"{card.name} {system} is defined by itself")
        self._open.append(system)
        if card.name[4] == "2":
            corners = np.array([card.real(k) for k in range(2, 11)]).reshape(3, 3)
            a, b, c = self._placed(card.integer(1, 0), corners, card.source)
        else:
            a, b, c = (self._grid(card.integer(start + k), card.source) for k in (1, 2, 3))
        self._open.pop()
        self._axes[system] = from_z_x(a, b - a, c - a, card.source)
        return self._axes[system]

    def _grid(self, label: int, source: Source) -> np.ndarray:
        if label not in self._grids:
            raise source.error(f"names grid point {label}, which the deck does not have")
        card = self._grids[label]
        raw = np.array([[card.real(k) for k in (2, 3, 4)]])
        return self._placed(card.integer(1, self._default), raw, card.source)[0]
