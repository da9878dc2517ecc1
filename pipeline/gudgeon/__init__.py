"""Gudgeon: contact dynamics of flexible machine parts from a modal database.

In a notebook:

    import gudgeon

    result = gudgeon.run("data/skirt", until="solve")       # mesh, modes, design, trajectory; fresh stages are kept
    result.quantities["bore.impulse"]                      # {"value": …, "unit": "N s", …}
    result.frames["skirt"].displacement                    # [m], (frames, nodes, 3)
    gudgeon.status("data/skirt")                            # which stages are fresh or stale, and why

    scene = gudgeon.Scene.from_file("data/skirt")           # typed; mappings of tables are scenes as well
    skirt = gudgeon.component(scene, "skirt")               # stiffness, mass, modes, residual_flexibility
    store = gudgeon.open(".gudgeon")                        # the modal database

Functions take a scene as a folder, a TOML file, a mapping of tables or a `Scene`. `gudgeon.models` has the classes of
the tables; `gudgeon.pipeline`, `gudgeon.modaldb` and `gudgeon.solver` have the rest. Large libraries are imported when
a function first needs them.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str
    from gudgeon.modaldb import open
    from gudgeon.pipeline.kinds import open_job, plan, report, run, simulation, status
    from gudgeon.pipeline.kinds.commands import component, export, linear, robustness, wear
    from gudgeon.pipeline.kinds.parts import example, faces, new, schema
    from gudgeon.pipeline.kinds.sensors import calibrate, identify, infer, signals, wrench
    from gudgeon.pipeline.scenes.bodies import SceneFile as Scene
    from gudgeon.pipeline.studies.family import family
    from gudgeon.pipeline.studies.study import study
    from gudgeon.solver.simulate import simulate
    from gudgeon.solver.system.compile import compile_system

_HOMES = {
    "Scene": "gudgeon.pipeline.scenes.bodies:SceneFile",
    "calibrate": "gudgeon.pipeline.kinds.sensors:calibrate",
    "compile_system": "gudgeon.solver.system.compile:compile_system",
    "component": "gudgeon.pipeline.kinds.commands:component",
    "example": "gudgeon.pipeline.kinds.parts:example",
    "export": "gudgeon.pipeline.kinds.commands:export",
    "faces": "gudgeon.pipeline.kinds.parts:faces",
    "family": "gudgeon.pipeline.studies.family:family",
    "identify": "gudgeon.pipeline.kinds.sensors:identify",
    "infer": "gudgeon.pipeline.kinds.sensors:infer",
    "linear": "gudgeon.pipeline.kinds.commands:linear",
    "new": "gudgeon.pipeline.kinds.parts:new",
    "open": "gudgeon.modaldb:open",
    "open_job": "gudgeon.pipeline.kinds:open_job",
    "plan": "gudgeon.pipeline.kinds:plan",
    "report": "gudgeon.pipeline.kinds:report",
    "robustness": "gudgeon.pipeline.kinds.commands:robustness",
    "run": "gudgeon.pipeline.kinds:run",
    "schema": "gudgeon.pipeline.kinds.parts:schema",
    "signals": "gudgeon.pipeline.kinds.sensors:signals",
    "simulate": "gudgeon.solver.simulate:simulate",
    "simulation": "gudgeon.pipeline.kinds:simulation",
    "status": "gudgeon.pipeline.kinds:status",
    "study": "gudgeon.pipeline.studies.study:study",
    "wear": "gudgeon.pipeline.kinds.commands:wear",
    "wrench": "gudgeon.pipeline.kinds.sensors:wrench",
}
__all__ = [
    "Scene",
    "__version__",
    "calibrate",
    "compile_system",
    "component",
    "example",
    "export",
    "faces",
    "family",
    "identify",
    "infer",
    "linear",
    "new",
    "open",
    "open_job",
    "plan",
    "report",
    "robustness",
    "run",
    "schema",
    "signals",
    "simulate",
    "simulation",
    "status",
    "study",
    "wear",
    "wrench",
]


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
    return [*__all__, "modaldb", "models", "pipeline", "solver"]
