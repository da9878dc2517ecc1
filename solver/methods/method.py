"""The contract of a contact method, and the checks that methods share."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

RESTITUTION = "restitution is required by method 'impact' and not allowed with other methods"


class Settings(Protocol):
    """The keys of a contact that methods check."""

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
    """Whether points have no compliance: forces are multipliers, and closing is an impact."""
    flexible: bool
    """Whether the residual flexibility R of the bodies is part of the compliance."""
    refuses: Callable[[Settings], str | None]
    """Return an error message about a contact's keys, or None."""

    def restitution(self, settings: Settings) -> float:
        """Return separation speed over approach speed [1] of rigid contact; −1 for compliant contact."""
        return (settings.restitution or 0.0) if self.rigid else -1.0


def rigid_refuses(name: str, settings: Settings) -> str | None:
    """Return the message about keys that no rigid method has, or None."""
    if settings.surface_stiffness is not None or settings.law is not None:
        return f"method '{name}' is rigid; remove surface_stiffness and law"
    return compliant_dashpot(settings)


def compliant_dashpot(settings: Settings) -> str | None:
    """Return the message about a dashpot without R, or None."""
    if settings.dashpot != "none":
        return "dashpot 'wave-guide' acts in parallel to R; it needs method 'residual'"
    return None


def no_impacts(settings: Settings) -> str | None:
    """Return the message about keys that only rigid methods have, or None."""
    if settings.restitution is not None:
        return RESTITUTION
    if settings.friction is not None:
        return "friction needs method 'constraint' or 'impact'"
    return None
