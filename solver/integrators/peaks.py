"""The state at the largest force of each contact, which every integrator keeps while it runs."""

from typing import NamedTuple

import numpy as np


class Peaks(NamedTuple):
    """State at the end of the sample of each contact's largest mean force so far.

    Shapes: k contacts, m coordinates, c contact rows, F functions of traction spaces.
    """

    force: np.ndarray
    """Size of the mean resultant over that sample [N], (k,); 0 where the contact was open so far."""
    sample: np.ndarray
    """Number of samples from the start of the run to the end of that one, (k,)."""
    q: np.ndarray
    """(k, m)"""
    v: np.ndarray
    """(k, m)"""
    multipliers: np.ndarray
    """Of all rows [N], (k, c)."""
    functions: np.ndarray
    """Forces on the residual flexibility of all functions [N], (k, F)."""
    friction: np.ndarray
    """Of all rows on their first bodies [N], (k, c, 3); (k, 0, 3) where none is kept."""

    @classmethod
    def empty(
        cls, contacts: int = 0, coordinates: int = 0, rows: int = 0, functions: int = 0, rubbing: int = 0
    ) -> "Peaks":
        """Return the peaks of contacts that were open so far.

        Args:
            rubbing: As many as rows where friction is kept.
        """
        widths = coordinates, coordinates, rows, functions
        q, v, multipliers, pushed = (np.zeros((contacts, width)) for width in widths)
        friction = np.zeros((contacts, rubbing, 3))
        return cls(np.zeros(contacts), np.zeros(contacts, np.int64), q, v, multipliers, pushed, friction)

    def keep_highest(
        self,
        before: int,
        forces: np.ndarray,
        q: np.ndarray,
        v: np.ndarray,
        multipliers: np.ndarray,
        functions: np.ndarray | None = None,
        *,
        friction: np.ndarray | None = None,
    ) -> None:
        """Keep the highest of some samples where it exceeds what is kept.

        Args:
            before: Number of samples before these.
            forces: Mean resultants [N], (s, k, 3).
            q, v: At the ends of the samples, (s, m).
            multipliers: (s, c)
            functions: (s, F)
            friction: (s, c, 3)
        """
        if not len(forces):
            return
        for number in range(len(self.force)):
            sizes = np.linalg.norm(forces[:, number], axis=1)
            at = int(sizes.argmax())
            if sizes[at] > self.force[number]:
                self.force[number], self.sample[number] = sizes[at], before + at + 1
                self.q[number], self.v[number], self.multipliers[number] = q[at], v[at], multipliers[at]
                if functions is not None:
                    self.functions[number] = functions[at]
                if friction is not None:
                    self.friction[number] = friction[at]
