"""Dashpots of a body that damp its modes as it is held; the system makes them, a scene has none."""

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Dashpots:
    """Dashpots of 1 N s/m along rows of a load of a body's own."""

    body: str
    interface: str
    """Name of the load."""
    count: int
    kind: ClassVar[str] = "dashpots"
    against: ClassVar[None] = None
    against_interface: ClassVar[None] = None
    tabled: ClassVar[bool] = False
    elastic: ClassVar[bool] = True
    linear: ClassVar[bool] = False
    damped: ClassVar[bool] = True
