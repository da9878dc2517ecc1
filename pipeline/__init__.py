"""The pipeline: scenes, meshes, modes, designs, pictures. `pipeline.run(...)` does what `gudgeon run` does."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.stages import RunReport, open_job, plan, run, status

__all__ = ["RunReport", "open_job", "plan", "run", "status"]


def __getattr__(name: str) -> Any:
    """Import the stages on first use, so that asking for help costs nothing."""
    if name not in __all__:
        raise AttributeError(f"module 'pipeline' has no attribute '{name}'")
    from pipeline import stages

    return getattr(stages, name)
