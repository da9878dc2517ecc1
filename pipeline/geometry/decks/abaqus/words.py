"""Nodes and elements that lines of a deck name by numbers and sets, in a part or in the assembly."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

NOTHING = np.empty(0, np.int64)


@dataclass(frozen=True)
class Words:
    """What numbers and names stand for in a part, or in an assembly for one of its instances."""

    nodes: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Labels by name of a set."""
    elements: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Labels by name of a set, of surfaces of elements too."""
    instance: str | None = None
    """Of the assembly; None in a part."""
    shift: int = 0
    """What is added to numbers of the assembly's own nodes and elements."""

    def numbers(self, words: list[str]) -> np.ndarray | None:
        """Return the labels of numbers such as 5 and Part-1.5; None of those of another instance."""
        labels = [self._number(word) for word in words]
        present = [label for label in labels if label is not None]
        return np.array(present, np.int64) if len(present) == len(labels) else None

    def nodes_of(self, word: str) -> np.ndarray | None:
        """Return the nodes of a number or a set, ascending; None where there are none here."""
        label = self._number(word)
        if label is not None:
            return np.array([label])
        return self._members(self.nodes, word)

    def elements_of(self, word: str) -> np.ndarray:
        """Return the elements of a number or a set, ascending."""
        label = self._number(word)
        members = np.array([label]) if label is not None else self._members(self.elements, word)
        return NOTHING if members is None else members

    def name_of(self, word: str) -> str | None:
        """Return the name of a set or a surface as it is spelled, None where it has no member here."""
        for group in (self.nodes, self.elements):
            for name, members in group.items():
                if name.casefold() == word.casefold() and len(members):
                    return name
        return None

    def _number(self, word: str) -> int | None:
        if word.isdecimal():
            return int(word) + self.shift
        owner, _, digits = word.rpartition(".")
        if self.instance is not None and digits.isdecimal() and owner.casefold() == self.instance.casefold():
            return int(digits)
        return None

    def _members(self, sets: Mapping[str, np.ndarray], word: str) -> np.ndarray | None:
        members = {name.casefold(): labels for name, labels in sets.items()}.get(word.casefold())
        return members if members is not None and len(members) else None
