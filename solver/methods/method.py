"""What every contact method tells of itself."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

RESTITUTION = "restitution goes with method 'impact', and method 'impact' needs it"


class Settings(Protocol):
    """The keys of a contact that methods look at."""

    @property
    def surface_stiffness(self) -> float | None: ...

    @property
    def law(self) -> object | None: ...

    @property
    def restitution(self) -> float | None: ...

    @property
    def friction(self) -> object | None: ...

    @property
    def dashpot(self) -> str: ...


@dataclass(frozen=True)
class Method:
    """A contact method."""

    rigid: bool
    """Whether points have no compliance: forces are multipliers, closings are impacts."""
    flexible: bool
    """Whether the residual flexibility R of the bodies yields."""
    refuses: Callable[[Settings], str | None]
    """Return what is wrong with a contact's keys, or None."""

    def restitution(self, settings: Settings) -> float:
        """Return separation over approach speed of rigid contact; −1 where contact is compliant."""
        return (settings.restitution or 0.0) if self.rigid else -1.0


def rigid_refuses(name: str, settings: Settings) -> str | None:
    """Return what no rigid method can use."""
    if settings.surface_stiffness is not None or settings.law is not None:
        return f"method '{name}' is rigid, so it takes neither surface_stiffness nor law"
    return compliant_dashpot(settings)


def compliant_dashpot(settings: Settings) -> str | None:
    """Return that a dashpot has no R to stand beside."""
    if settings.dashpot != "none":
        return "dashpot 'wave-guide' stands beside R, so it needs method 'residual'"
    return None


def no_impacts(settings: Settings) -> str | None:
    """Return what only rigid methods can use."""
    if settings.restitution is not None:
        return RESTITUTION
    if settings.friction is not None:
        return "friction needs method 'constraint' or 'impact'"
    return None
