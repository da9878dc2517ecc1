"""Contact dynamics of flexible bodies from modal records: `compile_system`, then `simulate`."""

from typing import TYPE_CHECKING, Any

from solver.errors import SceneError, SolverError

if TYPE_CHECKING:
    from solver.result import Result
    from solver.scene import Scene
    from solver.simulation import simulate
    from solver.system import System, compile_system

__all__ = ["Result", "Scene", "SceneError", "SolverError", "System", "compile_system", "simulate"]

_HOMES = {
    "Result": "result",
    "Scene": "scene",
    "simulate": "simulation",
    "System": "system",
    "compile_system": "system",
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that asking for help costs no compiler."""
    if name not in _HOMES:
        raise AttributeError(f"module 'solver' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(f"solver.{_HOMES[name]}"), name)
