"""Which integrator runs a scene: by what the scene has, then, where it leaves that open, by the system's size."""

import math
from collections.abc import Callable, Mapping

from gudgeon.solver.integrators.capabilities import Feature
from gudgeon.solver.integrators.family import INTEGRATORS
from gudgeon.solver.scene.run import Run

FEW_POINTS = 8
"""Contact points up to which `auto` takes located events where it can."""
MANY = 5e7
"""Steps times contact points from which `auto` takes implicit contact, whose step stiff surfaces do not shorten."""

Demands = Mapping[str, Feature]
"""What a scene has that not every integrator can carry, by what asks for it."""


def carriers(demands: Demands) -> list[str]:
    """Return the integrators that can carry a scene, in the order in which `auto` prefers them."""
    return [name for name in INTEGRATORS if not _lacking(demands, name)]


def choose(demands: Demands, run: Run) -> str:
    """Return the integrator that a scene names, or the one that `auto` takes for what the scene has.

    Raises:
        ValueError: the one that it names cannot carry what it has, or nothing can carry all that it has.
    """
    able, named = carriers(demands), run.integrator
    if named == "auto":
        if able:
            return able[0]
        least = min((_lacking(demands, name) for name in INTEGRATORS), key=len)
        others = " and ".join(what for what in demands if what not in least)
        raise ValueError(f"run.integrator: none carries {least[0]} beside {others}; leave one of them out")
    if lacking := _lacking(demands, named):
        advice = f"take {' or '.join(map(repr, ('auto', *able)))}" if able else "none carries the whole scene"
        raise ValueError(f"run.integrator: '{named}' cannot carry {lacking[0]}; {advice}")
    if math.isinf(INTEGRATORS[named].order) and run.step is not None:
        raise ValueError(f"run.step: integrator '{named}' locates events on exact motion and has no step; leave it out")
    return named


def choose_by_size(demands: Demands, run: Run, points: int, critical: Callable[[], float]) -> str:
    """Return the integrator of a compiled scene.

    Of those that `auto` can take, exact motion between located events is the better one while points are few, and
    explicit contact gives way to implicit contact where stiff surfaces ask for too many steps.

    Args:
        points: Contact points.
        critical: Returns ω_c [rad/s]; asked for where the choice depends on it.
    """
    name = choose(demands, run)
    if run.integrator != "auto":
        return name
    able = carriers(demands)
    if name == "trapezoid" and points <= FEW_POINTS and "event" in able:
        return "event"
    if name == "kick" and "trapezoid" in able:
        steps = run.duration * critical() / INTEGRATORS[name].step_factor
        return "trapezoid" if steps * max(1, points) > MANY else name
    return name


def _lacking(demands: Demands, name: str) -> list[str]:
    return [what for what, feature in demands.items() if feature not in INTEGRATORS[name].carries]
