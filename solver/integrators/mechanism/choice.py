"""Which steps a mechanism takes: explicit ones, or others where frequencies bound those.

An explicit step cannot exceed about 6 over the highest frequency of a body, whatever moves. So a run begins explicitly,
tries other steps where explicit ones come near to that, and goes back where they turn out not to be longer by what they
cost: numbers of the run alone decide, no times.
"""

from collections import Counter, deque

import numpy as np

from gudgeon.solver.integrators.mechanism.arrays import Model
from gudgeon.solver.integrators.mechanism.steps import Steps, Tried

LOOKS = 12
"""Steps that are looked at, refused ones with them."""
WAIT = 4
"""Times more explicit steps before implicit ones are tried again, each time that they were not longer."""


def lack_of(model: Model) -> str | None:
    """Return why a mechanism cannot take implicit steps; None if it can."""
    if len(model.touch_pair):
        return "something touches, which begins and ends with explicit steps"
    if not model.orthogonal.all():
        return "the modes of a body are coupled by their inertia, as they are by attachment 'fixed'"
    return None


class Choice:
    """Follows the steps of a run."""

    def __init__(self, model: Model, methods: list[Steps]) -> None:
        """
        Args:
            methods: Explicit steps and others, or the only ones there are.
        """
        self._methods, self.steps = methods, methods[0]
        mass = np.einsum("bkk->bk", model.modal_root) ** 2
        elastic = model.modal_stiffness > 0
        self._highest = float(np.sqrt((model.modal_stiffness[elastic] / mass[elastic]).max(initial=0.0)))
        self._sizes: deque[float] = deque(maxlen=LOOKS)
        self._explicit, self._patience, self._since, self._rejected = 0.0, LOOKS, 0, 0
        self.taken = Counter[str]()
        """Steps by their kind."""

    def note(self, tried: Tried, rejected: int, *, singular: bool) -> bool:
        """Note an accepted step; return whether the next one is of the other kind.

        Args:
            rejected: Steps that were refused so far.
            singular: Whether it is near a position in which joints depend on each other, where steps are explicit.
        """
        self.taken[self.steps.kind] += 1
        self._sizes.extend([*[0.0] * (rejected - self._rejected), tried.h])
        self._since, self._rejected = self._since + 1, rejected
        if len(self._methods) < 2 or not self._turns(singular):
            return False
        self.steps = self._methods[0 if self.steps is not self._methods[0] else 1]
        self._sizes.clear()
        self._since = 0
        return True

    def _turns(self, singular: bool) -> bool:
        """Return whether to go over to the other kind of steps."""
        explicit = self.steps is self._methods[0]
        if singular or len(self._sizes) < LOOKS:
            return singular and not explicit
        mean = sum(self._sizes) / len(self._sizes)
        if explicit:
            self._explicit = mean
            return self._since >= self._patience and mean * self._highest >= self._methods[1].bound
        if mean >= self.steps.cost * self._explicit:
            return False
        self._patience *= WAIT
        return True

    def notes(self) -> list[str]:
        """Return what is said of the steps of a run."""
        if not self.taken["implicit"]:
            return []
        return [
            f"{self.taken['implicit']} of {self.taken.total()} steps are implicit, longer than the highest frequency of"
            " a body allows explicit ones (run.stepping): vibrations whose motion is below run.accuracy may have"
            " another phase"
        ]
