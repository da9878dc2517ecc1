"""What every contestant's process shares: the mesh, a stopwatch from after the imports, and one JSON line as answer."""

import json
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7800.0
"""Steel: [Pa], –, [kg/m³]."""
RIGID = 6
SHIFT = -((2 * np.pi * 100.0) ** 2)
"""[rad²/s²], of the peers that take one: below all eigenvalues, close to zero beside the first elastic one."""
RESIDUAL = 1e-8
"""Largest ‖Kφ − λMφ‖ / ‖Kφ‖ that counts as verified, as in `gudgeon.pipeline.modes.normal`."""
MIB = 1024
"""Linux counts ru_maxrss in KiB."""


@dataclass(frozen=True)
class Mesh:
    """The shared mesh."""

    nodes: np.ndarray
    """[m], (n, 3)"""
    cells: np.ndarray
    """(e, 10), meshio's order."""
    skirt: np.ndarray
    """Facets of the outer surface, (f, 6)."""


@dataclass
class Answer:
    """What a contestant found, and what it took."""

    version: str
    verified: str = ""
    """What was checked inside the timed job."""
    frequencies: list[float] = field(default_factory=list)
    """Elastic ones [Hz], ascending."""
    residual: float | None = None
    solves: int | None = None
    """Right-hand sides solved."""
    factorisations: int | None = None
    phases: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Wall and CPU seconds of each."""
    base: tuple[float, float] = (0.0, 0.0)
    """CPU seconds and peak memory [MiB] of the process when its imports were done."""


class Stopwatch:
    """Seconds of one phase after the other."""

    def __init__(self) -> None:
        self.base = (cpu_seconds(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MIB)
        self.phases: dict[str, tuple[float, float]] = {}
        self.restart()

    def restart(self) -> None:
        """Begin a phase anew: what was done since the last one ended is no part of the job."""
        self._last = (time.perf_counter(), cpu_seconds())

    def lap(self, phase: str) -> None:
        """End a phase; the next begins."""
        now = (time.perf_counter(), cpu_seconds())
        self.phases[phase] = (now[0] - self._last[0], now[1] - self._last[1])
        self._last = now


def cpu_seconds() -> float:
    """Return user and system seconds of this process and of those that it waited for, all threads."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def load_mesh(path: str) -> Mesh:
    """Read the shared mesh."""
    with np.load(path) as arrays:
        return Mesh(arrays["nodes"], arrays["cells"], arrays["skirt"])


def largest_residual(K: Any, M: Any, values: np.ndarray, vectors: np.ndarray) -> tuple[str, float]:
    """Return whether the largest ‖Kφ − λMφ‖ / ‖Kφ‖ is accepted, in words, and its value."""
    forces = K @ vectors
    errors = forces - (M @ vectors) * values
    residual = float((np.linalg.norm(errors, axis=0) / np.linalg.norm(forces, axis=0)).max())
    return "residual" if residual <= RESIDUAL else f"FAILED: residual {residual:.1g}", residual


def hertz(values: np.ndarray) -> list[float]:
    """Turn eigenvalues [rad²/s²] into frequencies [Hz]."""
    return [float(f) for f in np.sqrt(values) / (2 * np.pi)]


def run(contestant: Callable[[str, int, Stopwatch], Answer]) -> None:
    """Run a contestant on `MESH COUNT` of the command line and print its answer."""
    path, count = sys.argv[1], int(sys.argv[2])
    watch = Stopwatch()
    answer = contestant(path, count, watch)
    answer.phases, answer.base = watch.phases, watch.base
    print(json.dumps(asdict(answer)))
