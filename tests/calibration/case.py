"""A random scene with its exact figures, and what draws it."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Tables = dict[str, Any]
Values = Mapping[str, float]
STEEL = {"E": 210e9, "nu": 0.3, "rho": 7850.0}
MATERIALS = (STEEL, {"E": 70e9, "nu": 0.33, "rho": 2700.0}, {"E": 110e9, "nu": 0.34, "rho": 4430.0},
             {"E": 3e9, "nu": 0.38, "rho": 1200.0}, {"E": 5e6, "nu": 0.45, "rho": 1100.0})  # fmt: skip
"""Steel, aluminium, titanium, a polymer, a rubber: E [Pa], nu, rho [kg/m^3]."""
STIFF = MATERIALS[:3]


@dataclass(frozen=True)
class Case:
    """A random scene."""

    scene: Tables
    """Its tables."""
    exact: Mapping[str, float | Callable[[Values], float]] = field(default_factory=dict)
    """Exact values by the names of quantities, or functions of all printed values, such as the window of a force [SI]:
    the total of all errors is judged by them."""
    histories: Mapping[str, Callable[[Any], Any]] = field(default_factory=dict)
    """Exact histories of probes, functions of times [s], which estimates of probes are about."""
    finer: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """By source, `basis` or `mesh`: overrides with which its error is negligible and the others stay."""
    read: Sequence[str] = ()
    """Quantities that finer runs are compared in; those of `exact`, and all probes, too."""
    steps: bool = True
    """Whether errors of steps are judged by a run of finer ones."""
    command: str = "solve"
    """`solve`, or the function of `judged` that computes figures and stated errors."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Of the command."""


class Draw:
    """Draws of one scene from its own generator."""

    def __init__(self, seed: int, name: str, number: int) -> None:
        self._rng = np.random.default_rng([seed, number, *name.encode()])

    def between(self, low: float, high: float) -> float:
        """Return a number, rounded to four digits, whose logarithm is uniform."""
        return float(f"{math.exp(self._rng.uniform(math.log(low), math.log(high))):.4g}")

    def count(self, low: int, high: int) -> int:
        """Return a number from `low` to `high`, uniform in its logarithm."""
        return round(math.exp(self._rng.uniform(math.log(low - 0.49), math.log(high + 0.49))))

    def of(self, choices: Sequence[Any]) -> Any:
        """Return one of several."""
        return choices[int(self._rng.integers(len(choices)))]

    def chance(self, probability: float) -> bool:
        """Return true with a probability."""
        return bool(self._rng.random() < probability)


Kind = Callable[[Draw], Case]


def force(body: str, interface: str | None, direction: Sequence[float], expression: str) -> Tables:
    """Return a force on an interface, or at the origin of a rigid body."""
    where: Tables = {"at": [0.0, 0.0, 0.0]} if interface is None else {"interface": interface}
    return {"kind": "force", "body": body, "direction": list(direction), "expression": expression} | where


def probe(kind: str, body: str, direction: Sequence[float], interface: str | None = None) -> Tables:
    """Return a probe along a direction."""
    where = {} if interface is None else {"interface": interface}
    return {"kind": kind, "body": body, "direction": list(direction)} | where


def plane(point: Sequence[float], normal: Sequence[float]) -> Tables:
    """Return a plane to touch."""
    return {"shape": "plane", "point": list(point), "normal": list(normal)}


def rigid(mass: float, **points: Sequence[Sequence[float]]) -> Tables:
    """Return a rigid component, with points given as place and normal."""
    shape: Tables = {"kind": "rigid", "mass": mass, "inertia": [mass * 1e-3] * 3}
    if points:
        shape["points"] = {name: {"at": list(at), "normal": list(normal)} for name, (at, normal) in points.items()}
    return {"geometry": shape, "interface": {name: {"surface": name} for name in points}}


def windowed_peak(force: Callable[[np.ndarray], np.ndarray], duration: float, window: float) -> float:
    """Return the largest mean over a window of the mean over it of a force that acts from 0 to a duration [N].

    Times in s.
    """
    times = np.linspace(0.0, duration, 8001)
    if window <= 0:
        return float(force(times).max())
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * (force(times[1:]) + force(times[:-1]))) * times[1]])
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (impulse[1:] + impulse[:-1])) * times[1]])

    def I(t: np.ndarray) -> np.ndarray:  # noqa: E743
        return np.interp(t, times, integral) + np.maximum(t - duration, 0.0) * impulse[-1]

    middles = np.linspace(0.0, duration, 4001)
    return float((I(middles + window) - 2 * I(middles) + I(middles - window)).max()) / window**2
