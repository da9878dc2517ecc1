"""Couplings of a deck of Abaqus or CalculiX: nodes of a set that a reference node leads, and nodes of equations.

`*COUPLING` with `*KINEMATIC`, `*KINEMATIC COUPLING` and `*RIGID BODY` make a set rigid (RBE2); `*COUPLING` with
`*DISTRIBUTING` gives the reference node the set's mean motion (RBE3). One of some directions is neither.
"""

from collections.abc import Callable, Mapping

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.matrices.model import Block, Coupling

Words = Callable[[str], list[str]]
DIRECTIONS = 3
"""Translations that a kinematic coupling of solids has to carry along."""


class DeckCouplings:
    """What a deck says of couplings, gathered keyword by keyword.

    Args:
        path: Of the deck, for messages.
        words: Splits a line of data.
    """

    def __init__(self, path: str, words: Words) -> None:
        self._path, self._words = path, words
        self._open: dict[str, str] | None = None
        self._couplings: list[Coupling] = []
        self._equations: list[str] = []
        self.node_sets: dict[str, list[str]] = {}
        """Labels or names of sets whose nodes each set has that a coupling lists itself."""

    def take(self, keyword: str, options: Mapping[str, str], rows: list[str]) -> None:
        """Take a keyword of the deck; those that couple nothing are passed over.

        Raises:
            InputError: an option is missing.
        """
        if keyword == "COUPLING":
            self._open = dict(options)
        elif keyword in ("KINEMATIC", "DISTRIBUTING") and self._open is not None:
            coupling_options, self._open = self._open, None
            if keyword == "KINEMATIC" and not self._whole(rows):
                return
            surface = self._option(coupling_options, "SURFACE", "COUPLING")
            name = coupling_options.get("CONSTRAINT NAME", surface)
            self._add(name, surface, coupling_options, "rbe2" if keyword == "KINEMATIC" else "rbe3")
        elif keyword == "RIGID BODY":
            name = options.get("NSET") or options.get("TIE NSET") or options.get("ELSET")
            if name is not None and "REF NODE" in options:
                self._add(name, name, options, "rbe2")
        elif keyword == "KINEMATIC COUPLING":
            members = [self._words(row)[0] for row in rows]
            name = f"rbe2_{self._option(options, 'REF NODE', keyword)}"
            self.node_sets[name] = members
            self._add(name, name, options, "rbe2")
        elif keyword == "EQUATION":
            self._equations += self._dependent(rows)

    def couplings(self) -> list[Coupling]:
        """Return all of them."""
        return self._couplings

    def dependent(
        self, nodes: Mapping[str, np.ndarray], sides: Mapping[str, np.ndarray], blocks: list[Block]
    ) -> np.ndarray:
        """Return labels of the nodes that couplings and equations express by others.

        Args:
            nodes: Labels of the nodes of each set.
            sides: Pairs of element and face of each surface, (f, 2).
            blocks: Elements.
        """
        labels = [np.array([int(word) for word in self._equations if word.isdigit()], int)]
        labels += [nodes.get(word, np.empty(0, int)) for word in self._equations if not word.isdigit()]
        for coupling in self._couplings:
            if coupling.tie == "rbe3":
                labels.append(np.array([coupling.reference]))
            elif coupling.surface in sides:
                labels.append(nodes_of_sides(sides[coupling.surface], blocks))
            else:
                labels.append(nodes.get(coupling.surface, np.empty(0, int)))
        return np.unique(np.concatenate(labels))

    def _add(self, name: str, surface: str, options: Mapping[str, str], tie: str) -> None:
        label = self._option(options, "REF NODE", "COUPLING")
        if not label.isdigit():
            raise InputError(f"{self._path}: REF NODE={label} of '{name}'; allowed: the number of a node")
        self._couplings.append(Coupling(name, surface, int(label), tie))

    def _option(self, options: Mapping[str, str], key: str, keyword: str) -> str:
        if not options.get(key):
            raise InputError(f"{self._path}: *{keyword} without {key}")
        return options[key]

    def _whole(self, rows: list[str]) -> bool:
        """Return whether a kinematic coupling carries all translations: `first, last` or single directions a line."""
        carried: set[int] = set()
        for row in rows:
            ends = [int(word) for word in self._words(row) if word.isdigit()]
            carried |= set(range(ends[0], ends[-1] + 1)) if ends else set()
        return not rows or carried >= set(range(1, DIRECTIONS + 1))

    def _dependent(self, rows: list[str]) -> list[str]:
        """Return node or set of the first term of each equation: number of terms, then node, direction, coefficient."""
        words, i = [], 0
        while i < len(rows):
            count = self._words(rows[i])[0]
            if not count.isdigit() or i + 1 >= len(rows):
                raise InputError(f"{self._path}: *EQUATION: {rows[i][:60]!r}, expected the number of terms")
            words.append(self._words(rows[i + 1])[0])
            terms, i = 0, i + 1
            while i < len(rows) and terms < int(count):
                terms += len([word for word in self._words(rows[i]) if word]) // 3
                i += 1
        return words


def nodes_of_sides(sides: np.ndarray, blocks: list[Block]) -> np.ndarray:
    """Return labels of the nodes of faces of elements, ascending.

    Args:
        sides: Pairs of an element's label and the number of its face from 0, (f, 2).
    """
    labels = [np.empty(0, int)]
    for block in blocks:
        for face_id, face in enumerate(block.cell.faces):
            owners = sides[sides[:, 1] == face_id, 0]
            labels.append(block.nodes[np.isin(block.labels, owners)][:, face].ravel())
    return np.unique(np.concatenate(labels))
