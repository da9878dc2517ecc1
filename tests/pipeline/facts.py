"""Facts that notes are written of, as tests state them."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any


def of_modes(records: Mapping[str, Any], components: Mapping[str, Any] | None = None) -> Any:
    """Return facts with modal records by component; the components are meshed by default."""
    meshed = SimpleNamespace(from_file=False)
    return SimpleNamespace(modes=records, scene=SimpleNamespace(component=components or dict.fromkeys(records, meshed)))


def of_run(scene: Any, estimates: Mapping[str, float], reason: str = "", window: float = 0.0) -> Any:
    """Return facts with estimated errors of a run, why those of its basis failed, and a window of forces [s]."""
    quantities = {"contact.force_window": {"value": window, "unit": "s"}}
    counts = {"basis_reason": reason}
    return SimpleNamespace(scene=scene, summary={"estimates": estimates, "counts": counts, "quantities": quantities})
