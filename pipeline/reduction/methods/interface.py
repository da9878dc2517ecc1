"""Characteristic interface modes: eigenmodes of the condensed boundary in place of its dofs (Castanier, Tan & Pierre
2001). See `partial_interface`, which keeps some of the dofs beside them."""

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.methods.partial_interface import partial_interface
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction
from gudgeon.pipeline.scenes.modes import ModesSettings


def interface(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body, free or held; whatever `kept` names is reduced too.

    Raises:
        InputError: the mesh or its boundary lack what is asked for; its key begins with `modes`.
        StageError: a shape fails its own check.
    """
    return partial_interface(model, rows, settings.model_copy(update={"kept": ()}))
