"""`python -m gudgeon.solver.warm_up [INTEGRATOR…]`: compiles the time loops ahead of the first run.

Machine code depends on the types of arguments alone, so a run of two small bodies compiles all that any scene of the
same integrator needs. `make setup` does so for the whole family; a run that finds an integrator not yet compiled does
it in a child process beside mesh and modes.
"""

import sys
import time
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from gudgeon.modaldb.records.modes import InterfaceModes, ModalRecord, MorphRecord, TractionModes
from gudgeon.solver.kernel_cache import COMPILED, is_compiled, note_compiled
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system

POINTS = np.array([[0.01, 0.0, -0.001], [0.01, 0.0, 0.001], [0.01, 0.001, 0.0]])
"""Contact points of the moving body, which faces +x [m]."""
PLACES = {"face": slice(0, 2), "tip": slice(2, 3)}
"""Points of each interface."""
OMEGA = np.array([2e4, 5e4])
TWISTS, INERTIA = np.diag([1.0] * 3 + [100.0] * 3), 1e-4 * np.eye(3)
SPACE = np.array([5, 6])
"""Splines of the plate's traction space across and along."""
AGAINST: dict[str, dict[str, Any]] = {
    "wall": {"shape": "plane", "point": [0.01, 0.0, 0.0], "normal": [-1, 0, 0]},
    "plate": {"shape": "surface", "body": "plate", "interface": "top"},
}
HERTZ = {"kind": "hunt-crossley", "stiffness": 1e9, "exponent": 1.5, "restitution": 0.8}
CASES: dict[str, tuple[dict[str, Any], ...]] = {
    "collocation": ({"interface": "tip", "method": "penalty", "law": HERTZ},),
}
"""Contacts that make every kind of argument, by time loop; the core's loops compile nothing."""


class _Records:
    """A store in memory that holds modes and design of one body, for every key."""

    def __init__(self) -> None:
        self._modes = _modes()

    def has(self, key: str) -> bool:
        return True

    def get(self, key: str, kind: str, *, only: Collection[str] | None = None) -> Any:
        return self._modes if kind == "modes" else _design()

    def sizes(self, key: str) -> dict[str, int]:
        return {"residual_flexibility": 1, "interfaces/face/rows": 1, "interfaces/tip/rows": 1, "tractions/top/rows": 1}


def warm_up(name: str) -> float:
    """Compile the time loop of an integrator and return the CPU seconds that it took."""
    start = time.process_time()
    for case in CASES.get(name, ()):
        simulate(compile_system(_Records(), _scene(name, case), {"part": "part", "plate": "plate"}))  # type: ignore[arg-type]
    note_compiled(name)
    return time.process_time() - start


def _scene(name: str, case: dict[str, Any]) -> Scene:
    contact = {"body": "part", "against": AGAINST[case.get("against", "wall")]}
    contact |= {key: value for key, value in case.items() if key != "against"}
    bodies = {"part": {"velocity": [1.0, 0.1, 0.0]}} | ({"plate": {}} if "against" in case else {})
    run = {"duration": 2e-6, "samples": 10, "frames": 2, "integrator": name}
    return Scene.model_validate({"body": bodies, "contact": {"touch": contact}, "run": run})


def _modes() -> ModalRecord:
    """Return two modes of a free body with three contact points and a traction space."""
    rows, functions = np.array([[1.0, 0.3], [1.0, -0.3], [0.8, 0.1]]), int(SPACE.prod())
    interfaces = {
        key: InterfaceModes(
            np.arange(len(rows[rows_of])), POINTS[rows_of], np.tile([1.0, 0, 0], (len(rows[rows_of]), 1)),
            np.full(len(rows[rows_of]), 1e-6), np.zeros(len(rows[rows_of]), bool), rows[rows_of],
        )
        for key, rows_of in PLACES.items()
    }  # fmt: skip
    chart = {
        "kind": "plane", "origin": [0.01, 0, 0], "normal": [-1.0, 0, 0], "across": [0, 0, 1.0], "along": [0, 1.0, 0],
    }  # fmt: skip
    resultant = np.tile([-1.0, 0, 0, 0, 0, 0], (functions, 1))
    space = TractionModes(chart, np.full(2, -0.01), np.full(2, 0.01), SPACE, np.full((functions, 2), 0.1), resultant)
    return ModalRecord(
        mesh_key="mesh", reduction="macneal", normal_count=2, static_count=0, angular_frequencies=OMEGA, mass=1.0,
        centre=np.zeros(3), inertia=INERTIA, rigid_twists=TWISTS, interfaces=interfaces, tractions={"top": space},
        interface_rows={"face": [0, 2], "tip": [2, 3], "top": [3, 3 + functions]},
        residual_flexibility=1e-9 * np.eye(3 + functions), shapes=None, inertia_couplings=None, quality={},
    )  # fmt: skip


def _design() -> MorphRecord:
    """Return the design of the same body."""
    return MorphRecord(
        mesh_key="mesh", modes_key="modes", update="none", points={key: POINTS[rows] for key, rows in PLACES.items()},
        mass=1.0, centre=np.zeros(3), inertia=INERTIA, rigid_twists=TWISTS, nodes=None, quality={},
    )  # fmt: skip


def main(names: Sequence[str]) -> None:
    """Compile what is not compiled yet and tell what it took."""
    if unknown := [name for name in names if name not in COMPILED]:
        sys.exit(f"warm_up: no compiled time loop '{unknown[0]}'; there are {', '.join(COMPILED)}")
    for name in names or COMPILED:
        if is_compiled(name):
            print(f"time loop '{name}': compiled already")
            continue
        print(f"time loop '{name}': compiling …", flush=True)
        print(f"time loop '{name}': {warm_up(name):.1f} s of CPU time", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
