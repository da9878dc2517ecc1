"""Contact dynamics of flexible bodies from modal records: `compile_system`, then `simulate`."""

from typing import TYPE_CHECKING, Any

from gudgeon.solver.errors import SceneError, SolverError

if TYPE_CHECKING:
    from gudgeon.solver.result import Result
    from gudgeon.solver.scene.scene import Scene
    from gudgeon.solver.simulate import simulate
    from gudgeon.solver.system.compile import compile_system
    from gudgeon.solver.system.system import System

__all__ = ["Result", "Scene", "SceneError", "SolverError", "System", "compile_system", "simulate"]

_HOMES = {
    "Result": "result",
    "Scene": "scene.scene",
    "simulate": "simulate",
    "System": "system.system",
    "compile_system": "system.compile",
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that asking for help costs no compiler."""
    if name not in _HOMES:
        raise AttributeError(f"module 'gudgeon.solver' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(f"gudgeon.solver.{_HOMES[name]}"), name)
