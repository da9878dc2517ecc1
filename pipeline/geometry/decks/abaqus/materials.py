"""Materials, sections and orientations of decks of Abaqus and CalculiX."""

from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.decks.abaqus.keywords import Keyword
from gudgeon.pipeline.geometry.decks.abaqus.systems import orientation
from gudgeon.pipeline.geometry.decks.constants import engineering_constants
from gudgeon.pipeline.geometry.decks.model import Section, Source


class Assigned(NamedTuple):
    """A section of solids."""

    elements: str
    material: str
    orientation: str
    source: Source


class Materials:
    """Materials, and the sections that give them to elements, gathered keyword by keyword."""

    def __init__(self) -> None:
        self.stated: list[tuple[Source, dict[str, float]]] = []
        self._orthotropic: dict[int, dict[str, tuple[float, ...]] | None] = {}
        self._names: dict[str, int] = {}
        self._assigned: list[Assigned] = []
        self._systems: dict[str, np.ndarray | None] = {}

    def take(self, keyword: Keyword) -> None:
        """Take a keyword."""
        if keyword.name == "MATERIAL":
            self._names[keyword.options.get("NAME", "").casefold()] = len(self.stated)
            self.stated.append((keyword.source, {}))
        elif keyword.name == "SOLID SECTION":
            options = keyword.options
            material, system = (options.get(key, "").casefold() for key in ("MATERIAL", "ORIENTATION"))
            self._assigned.append(Assigned(options.get("ELSET", ""), material, system, keyword.source))
        elif keyword.name == "ORIENTATION":
            self._systems[keyword.option("NAME").casefold()] = orientation(keyword)
        elif self.stated and keyword.rows and keyword.name in ("ELASTIC", "DENSITY"):
            self._constants(keyword)

    def _constants(self, keyword: Keyword) -> None:
        values, constants = keyword.rows[0].reals(), self.stated[-1][1]
        kind = keyword.options.get("TYPE", "ISOTROPIC").upper()
        if keyword.name == "DENSITY":
            constants["rho"] = values[0]
        elif kind.startswith("ISO"):
            constants |= dict(zip(("E", "nu"), values, strict=False))
        else:
            constants["anisotropic"] = 1.0
            every = [x for row in keyword.rows[:2] for x in row.reals()]
            self._orthotropic[len(self.stated) - 1] = _orthotropic(kind, every)

    def add(self, outer: "Materials") -> None:
        """Add those of another part of the deck, whose sections are not this one's."""
        start = len(self.stated)
        self.stated += outer.stated
        self._orthotropic |= {start + k: constants for k, constants in outer._orthotropic.items()}
        for name, k in outer._names.items():
            self._names.setdefault(name, start + k)
        self._systems = outer._systems | self._systems

    def assigned(self, inner: "Materials") -> None:
        """Take the sections of another part."""
        self._assigned += inner._assigned

    def sections(self, turn: np.ndarray) -> list[Section]:
        """Return the material of each set of elements; `turn` are the axes of the part as columns, (3, 3)."""
        sections = []
        for elements, material, system, source in self._assigned:
            k = self._names.get(material)
            if k is None:
                continue
            constants = self.stated[k][1]
            axes = np.eye(3) if not system else self._systems.get(system)
            sections.append(Section(
                elements, source, constants, self._orthotropic.get(k),
                None if axes is None else turn @ axes,
            ))  # fmt: skip
        if not self._assigned and len(self.stated) == 1:
            source, constants = self.stated[0]
            sections.append(Section("", source, constants, self._orthotropic.get(0), turn))
        return sections


def _orthotropic(kind: str, values: list[float]) -> dict[str, tuple[float, ...]] | None:
    """Return moduli, Poisson's ratios and shear moduli of orthotropic constants; None of other kinds."""
    if len(values) < 9:
        return None
    if kind.startswith("ENGINEERING"):
        return {"E": tuple(values[:3]), "nu": tuple(values[3:6]), "G": tuple(values[6:9])}
    if kind.startswith("ORTHO"):
        xx, xy, yy, xz, yz, zz, *G = values[:9]
        return engineering_constants(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), G)
    return None
