"""The pipeline: scenes, meshes, modes, designs, pictures. `gudgeon.pipeline.run(...)` does what `gudgeon run` does."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gudgeon.pipeline.kinds import open_job, run
    from gudgeon.pipeline.stages.plan import plan
    from gudgeon.pipeline.stages.run_report import RunReport
    from gudgeon.pipeline.stages.status import status

__all__ = ["RunReport", "open_job", "plan", "run", "status"]

_HOMES = {
    "RunReport": "stages.run_report",
    "open_job": "kinds",
    "plan": "stages.plan",
    "run": "kinds",
    "status": "stages.status",
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that asking for help costs nothing."""
    if name not in _HOMES:
        raise AttributeError(f"module 'gudgeon.pipeline' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(f"gudgeon.pipeline.{_HOMES[name]}"), name)
