"""What a fault is: a text of a source that stands there once, and another one in its place."""

from collections.abc import Sequence
from typing import NamedTuple


class Fault(NamedTuple):
    """One deliberate fault."""

    subject: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    """Arguments of pytest: files or single tests, the nearest first."""
    why: str = ""
    """Why it may survive; empty where a test must find it."""

    @property
    def native(self) -> bool:
        """Whether it is in the core: an expression, compiled in beside the right one."""
        return self.file.endswith(".hpp")


def faults(
    subject: str, file: str, tests: Sequence[str], *changes: tuple[str, str] | tuple[str, str, str]
) -> list[Fault]:
    """Return the faults of a file: old and new text of each, and why it may survive if it may."""
    return [Fault(subject, file, change[0], change[1], tuple(tests), *change[2:]) for change in changes]
