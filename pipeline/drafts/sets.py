"""The sets and couplings of a model of another program as a table, and its couplings as interfaces of a scene."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import Surface
from gudgeon.pipeline.geometry.decks.model import Coupling, Deck, Scope
from gudgeon.pipeline.geometry.decks.reading import WHOLE
from gudgeon.pipeline.geometry.matrices.reading import read_model, surfaces_of

ROUND_OFF = 1e-9
"""Coordinates below this share of the part's size are printed as zero."""


@dataclass(frozen=True)
class SetsLook:
    """What a deck of Abaqus, CalculiX, Nastran or Ansys names."""

    path: str
    unit: float
    """Metres per unit of length of the file."""
    model: Deck
    surfaces: Mapping[str, Surface]
    """In metres."""

    @property
    def size(self) -> np.ndarray:
        """Extents along x, y, z of the elements, or of all nodes where there are none [m], (3,)."""
        labels = [np.unique(block.nodes) for block in self.model.blocks]
        rows = self.model.rows(np.concatenate(labels), self.path) if labels else slice(None)
        return self.unit * np.ptp(self.model.points[rows], axis=0)

    def reference(self, coupling: Coupling) -> list[float]:
        """Return the reference point of a coupling [m]."""
        row = int(self.model.rows(np.array([coupling.reference]), self.path)[0])
        return [float(f"{value:.9g}") for value in self._clean(self.unit * self.model.points[row])]

    def interfaces(self) -> dict[str, str]:
        """Return each coupling as an interface of a scene, by a name for it."""
        return {
            coupling.name: f'{{ surface = "{coupling.surface}", kind = "tie", tie = "{coupling.tie}",'
            f" point = {self.reference(coupling)} }}"
            for coupling in self.model.couplings
        }

    def as_json(self) -> dict[str, Any]:
        """Return it as one document, in SI units."""
        return {
            "file": self.path, "unit": self.unit, "nodes": len(self.model.labels),
            "elements": self._elements(), "extents": self.size.tolist(),
            "sets": {
                name: {
                    "nodes": len(np.unique(surface.facets)), "kind": surface.shape.get("kind", "free"),
                    "shape": surface.shape, "centre": self._centre(surface).tolist(),
                }
                for name, surface in self.surfaces.items()
            },
            "couplings": {
                c.name: {"surface": c.surface, "tie": c.tie, "point": self.reference(c)}
                for c in self.model.couplings
            },
        }  # fmt: skip

    def as_text(self) -> str:
        """Return a table of the sets, and the interfaces to paste into a scene."""
        size = " × ".join(f"{1e3 * length:.5g}" for length in self.size)
        elements = ", ".join(f"{count} {kind}" for kind, count in self._elements().items()) or "no solid elements"
        lines = [
            f"{self.path}: {len(self.model.labels)} nodes, {elements}, unit {self.unit:g} m, {size} mm",
            "",
            f"{'set':24} {'nodes':>7}  {'kind':9} centre [mm]",
        ]
        for name, surface in self.surfaces.items():
            centre = ", ".join(f"{value:.5g}" for value in 1e3 * self._centre(surface))
            kind = surface.shape.get("kind", "free")
            lines.append(f"{name:24} {len(np.unique(surface.facets)):7}  {kind:9} {centre:28}".rstrip())
        if self.model.couplings:
            lines += ["", "[component.NAME.interface]    # the couplings of the file"]
            lines += [f'"{name}" = {text}' for name, text in self.interfaces().items()]
        return "\n".join(lines)

    def _elements(self) -> dict[str, int]:
        names = dict.fromkeys(block.cell.name for block in self.model.blocks)
        return {name: sum(len(b.labels) for b in self.model.blocks if b.cell.name == name) for name in names}

    def _centre(self, surface: Surface) -> np.ndarray:
        return self._clean(self.unit * self.model.points[np.unique(surface.facets)].mean(axis=0))

    def _clean(self, point: np.ndarray) -> np.ndarray:
        return np.where(np.abs(point) < ROUND_OFF * self.size.max(), 0.0, point)


def look_at_sets(path: str, unit: float | None, scope: Scope = WHOLE) -> SetsLook:
    """Read the model of another program.

    Args:
        unit: Metres per unit of length; None is 1.
        scope: Which of several bodies it is.

    Raises:
        InputError: the file is missing, damaged or of another kind.
    """
    model = read_model(path, scope)
    return SetsLook(path, unit or 1.0, model, surfaces_of(path, model, unit or 1.0))
