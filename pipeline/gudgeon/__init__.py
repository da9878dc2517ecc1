"""Gudgeon: contact dynamics of flexible machine parts from a modal database.

In a notebook:

    import gudgeon

    found = gudgeon.run("data/skirt", until="solve")        # mesh, modes, design, trajectory; fresh stages are kept
    found.quantities["bore.impulse"]                       # {"value": …, "unit": "N s", …}
    gudgeon.status("data/skirt")                            # which stages are fresh or stale, and why

    store = gudgeon.open(".gudgeon")                        # the modal database
    modes = store.get(found.stages["modes"].keys["skirt"], "modes", only=["angular_frequencies"])

`run`, `status`, `plan`, `report`, `study` and `open_job` take a scene's folder or TOML file; `compile_system` and
`simulate` run a scene's dynamics from records directly. `gudgeon.pipeline`, `gudgeon.modaldb` and `gudgeon.solver` have
the rest. Large libraries are imported when a function first needs them.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gudgeon.modaldb import open
    from gudgeon.pipeline.kinds import open_job, plan, report, run, simulation, status
    from gudgeon.pipeline.studies.study import study
    from gudgeon.solver.simulate import simulate
    from gudgeon.solver.system.compile import compile_system

__all__ = [
    "__version__",
    "compile_system",
    "open",
    "open_job",
    "plan",
    "report",
    "run",
    "simulate",
    "simulation",
    "status",
    "study",
]

_HOMES = {
    "compile_system": "gudgeon.solver.system.compile:compile_system",
    "open": "gudgeon.modaldb:open",
    "open_job": "gudgeon.pipeline.kinds:open_job",
    "plan": "gudgeon.pipeline.kinds:plan",
    "report": "gudgeon.pipeline.kinds:report",
    "run": "gudgeon.pipeline.kinds:run",
    "simulate": "gudgeon.solver.simulate:simulate",
    "simulation": "gudgeon.pipeline.kinds:simulation",
    "status": "gudgeon.pipeline.kinds:status",
    "study": "gudgeon.pipeline.studies.study:study",
}


def __getattr__(name: str) -> Any:
    """Import a function on first use; the version is the installed distribution's."""
    if name == "__version__":
        from importlib.metadata import version

        return version("gudgeon")
    if name not in _HOMES:
        raise AttributeError(f"module 'gudgeon' has no attribute '{name}'; it has {', '.join(__all__)}")
    module, _, member = _HOMES[name].partition(":")
    return getattr(import_module(module), member)


def __dir__() -> list[str]:
    return [*__all__, "modaldb", "pipeline", "solver"]
