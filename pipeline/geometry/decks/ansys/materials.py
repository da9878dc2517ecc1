"""Materials of archives of Ansys: MP and MPDATA."""

from collections.abc import Mapping, Sequence

import numpy as np

from gudgeon.pipeline.geometry.decks.ansys.cells import Row
from gudgeon.pipeline.geometry.decks.model import Section, Source

LABELS: Mapping[str, str] = {"EX": "E", "NUXY": "nu", "PRXY": "nu", "DENS": "rho"}
DIRECTIONAL = ("EY", "EZ", "GXY", "GXZ", "GYZ")


class Materials:
    """Constants by number of a material, gathered command by command."""

    def __init__(self) -> None:
        self._constants: dict[int, tuple[Source, dict[str, float]]] = {}

    def take(self, words: Sequence[str], source: Source) -> None:
        """Take a command MP, or MPDATA with its release, of which the first temperature holds.

        Raises:
            InputError: it has no number where one has to be.
        """
        label, material_id, value = (words[k] for k in ((3, 4, 6) if words[0].upper() == "MPDATA" else (1, 2, 3)))
        try:
            material, amount = int(material_id), float(value)
        except ValueError:
            raise source.error(f"{','.join(words)[:60]!r}, expected the number of a material and a value") from None
        constants = self._constants.setdefault(material, (source, {}))[1]
        if label.upper() in LABELS:
            constants[LABELS[label.upper()]] = amount
        elif label.upper() in DIRECTIONAL:
            constants["anisotropic"] = 1.0

    @property
    def stated(self) -> list[tuple[Source, dict[str, float]]]:
        """Constants of each material."""
        return list(self._constants.values())

    def sections(self, rows: Sequence[Row]) -> tuple[list[Section], dict[str, np.ndarray]]:
        """Return the material of the solids of each number, and these by names such as `mat2`."""
        sets: dict[str, np.ndarray] = {}
        sections = []
        numbers = np.array([row.material for row in rows])
        labels = np.array([row.label for row in rows], np.int64)
        for material_id in np.unique(numbers).tolist():
            if material_id in self._constants:
                sets[f"mat{material_id}"] = labels[numbers == material_id]
                source, constants = self._constants[material_id]
                sections.append(Section(f"mat{material_id}", source, constants, None, None))
        return sections, sets
