"""MacNeal's basis: normal modes, static correction shapes on request, and the residual flexibility of the rest without
mass (MacNeal 1971; massless contact boundary: Monjaraz-Tec, Gross & Krack 2022)."""

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction, completed
from gudgeon.pipeline.scenes.modes import ModesSettings


def macneal(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to its lowest normal modes and static correction."""
    return completed(model, rows, normal_modes(model, settings.normal_count))
