"""`python -m docs.tools.basis_swap`: a basis that changes as a force passes beside fixed ones of equal size, for
docs/moving-forces.md.

Errors are those of the displacement under the force of `ritz/swap.toml` at frames, root mean square and largest,
over its largest value; the reference has 250 normal modes and residual flexibility. CPU time of the run is the median
of five, each after one of all others, its compilation from records included; that of the modes is of one.
"""

import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any, NamedTuple

import numpy as np

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.errors import SceneError
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.bases.swaps import swaps_of
from gudgeon.solver.system.system import System
from tests.scenes import scene_path

SCENE = scene_path("ritz/swap.toml")
SIZE, REFERENCE, REPEATS = 18, 250, 5
"""Coordinates of each basis, normal modes of the reference, runs of which the median counts."""
STEPS = 8
"""Of a frame."""
SPEEDS = (6.0, 20.0, 60.0)
"""[m/s]"""
PATH, FRAMES = 0.9, 450
"""Of the force [m], and how many frames it takes."""


def swap(bases: int, vectors: int) -> dict[str, Any]:
    """Return the settings of modes with so many bases, each with Ritz vectors beside normal modes."""
    return {
        "reduction": "normal+static", "normal_count": SIZE - vectors, "swap": {"bases": bases, "vectors": vectors}
    }  # fmt: skip


BASES: dict[str, dict[str, Any]] = {
    f"{SIZE} normal modes": {"reduction": "normal+static", "normal_count": SIZE},
    "14 normal modes, 4 vectors, one basis": swap(1, 4),
    "4 normal modes, 14 vectors, one basis": swap(1, 14),
    "14 normal modes, 4 vectors, 4 bases": swap(4, 4),
    "14 normal modes, 4 vectors, 8 bases": swap(8, 4),
    f"{SIZE} normal modes and R": {"reduction": "macneal", "normal_count": SIZE},
    f"{SIZE} Ritz vectors and R": {"reduction": "ritz", "normal_count": SIZE},
}


def changes(speed: float, modes: dict[str, Any]) -> dict[str, Any]:
    """Return the keys of the scene at a speed [m/s] with a basis."""
    duration, own = PATH / speed, {"swap": "unset"} | modes
    return {
        "component.beam.modes": own, "force.load.speed": speed, "force.load.rise": 0.05 * duration,
        "run.duration": duration, "run.frames": FRAMES, "run.samples": FRAMES * STEPS,
        "run.step": duration / (FRAMES * STEPS), "run.checks": False,
    }  # fmt: skip


def under(system: System, times: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return the displacement under the only force along it at frames [m], (f,), of their coordinates, (f, m)."""
    loads = system.driving.loads(times, 0.0)
    moved = frames @ system.driving.rows.T
    if swaps_of(system) is None:
        moved = moved + loads @ system.driving.residual
    return np.einsum("tf,tf->t", loads, moved) / np.abs(loads.sum(axis=1))


class Case(NamedTuple):
    """A basis at a speed."""

    job: Any
    making: float
    """CPU time of its modes [s]."""

    @classmethod
    def of(cls, folder: Path, speed: float, modes: dict[str, Any], more: dict[str, Any] | None = None) -> "Case":
        """Make the modes, in a database of their own, of the scene with more changed keys."""
        job = open_job(SCENE, set=changes(speed, modes) | (more or {}), db=mkdtemp(dir=folder), out=folder / "out")
        run_job(job, "mesh")
        begun = time.process_time()
        run_job(job, "morph")
        return cls(job, time.process_time() - begun)

    def solved(self) -> tuple[np.ndarray, float, float]:
        """Return the displacement under the force (f,) [m], the CPU time of a run [s], and its largest energy jump.

        Raises:
            SceneError: the energy jumps by more than is allowed.
        """
        begun = time.process_time()
        system = system_of(self.job)
        found = simulate(system)
        spent = time.process_time() - begun
        jump = found.quantities.get("load.energy_jump", {"value": 0.0})["value"]
        return under(system, found.frame_times, found.frames), spent, float(jump)


def errors(found: np.ndarray, exact: np.ndarray) -> tuple[float, float]:
    """Return the error by root mean square and the largest error, over the largest displacement."""
    apart, size = np.abs(found - exact), np.abs(exact).max()
    return float(np.sqrt(np.mean(apart**2)) / size), float(apart.max() / size)


def reference(folder: Path, speed: float, more: dict[str, Any] | None = None) -> np.ndarray:
    """Return the displacement under the force with many normal modes and residual flexibility (f,) [m]."""
    return Case.of(folder, speed, {"reduction": "macneal", "normal_count": REFERENCE}, more).solved()[0]


def main() -> None:
    """Print a table for each speed."""
    with TemporaryDirectory() as name:
        for speed in SPEEDS:
            exact, cases = reference(Path(name), speed), dict[str, Case]()
            print(f"{speed:g} m/s, largest {1e6 * np.abs(exact).max():.1f} µm")
            for label, modes in BASES.items():
                case = Case.of(Path(name), speed, modes)
                try:
                    case.solved()
                except SceneError as error:
                    print(f"| {label} | refused: {error} |")
                    continue
                cases[label] = case
            runs = [[case.solved() for case in cases.values()] for _ in range(REPEATS)]
            for (label, case), own in zip(cases.items(), zip(*runs, strict=True), strict=True):
                (rms, most), jump = errors(own[0][0], exact), own[0][2]
                said, spent = f"{jump:.1e}" if jump else "–", median(one[1] for one in own)
                print(
                    f"| {label} | {rms:.1e} | {most:.1e} | {said} | {case.making:.2f} s | {spent:.2f} s |", flush=True
                )


if __name__ == "__main__":
    main()
