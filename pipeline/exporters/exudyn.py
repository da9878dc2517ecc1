"""A script of Exudyn with the body in a floating frame, `ObjectFFRFreducedOrder`, and its data as .npz.

Exudyn forms the inertia of the moving frame from the mass matrix, which is therefore part of the data. The shapes are
the elastic coordinates: they must be free modes or static shapes beside them, M-orthogonal to the rigid motions.
"""

from pathlib import Path

import numpy as np

from gudgeon.modaldb.records.modes import InterfaceModes, TractionModes
from gudgeon.pipeline.exporters.reduced import ReducedBody
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.files import whole_file, write_text
from gudgeon.pipeline.interfaces.points import surface_weights

SCRIPT = Path(__file__).with_name("exudyn_script.txt")


def write(body: ReducedBody, model: FEModel, folder: Path) -> list[Path]:
    """Write `NAME.py` and `NAME-exudyn.npz` and return them."""
    script, data = folder / f"{body.name}.py", folder / f"{body.name}-exudyn.npz"
    arrays = {"nodes": body.nodes, "labels": body.labels, "shapes": body.shapes[:, :, body.rigid_count :],
              "angular_frequencies": body.modal.angular_frequencies}  # fmt: skip
    for name, A in (("K", model.K), ("M", model.M)):
        arrays |= {f"{name}_data": A.data, f"{name}_indices": A.indices, f"{name}_indptr": A.indptr}
    for name, (nodes, weights) in _spread(body).items():
        arrays |= {f"interface/{name}/nodes": nodes, f"interface/{name}/weights": weights}
    with whole_file(data) as scratch, open(scratch, "wb") as file:
        np.savez(file, allow_pickle=False, **arrays)
    write_text(script, SCRIPT.read_text().replace("@BODY@", body.name))
    return [script, data]


def _spread(body: ReducedBody) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return nodes and weights of sum 1 of every surface, and of the interfaces, whose points have their areas."""
    weights = {}
    for name, surface in body.mesh.surfaces.items():
        nodes, areas, _ = surface_weights(body.mesh, surface)
        weights[f"surface {name}"] = nodes, areas / areas.sum()
    for name, interface in body.modal.interfaces.items():
        if isinstance(interface, InterfaceModes) and len(interface.nodes) > 1:
            weights[name] = interface.nodes, interface.areas / interface.areas.sum()
    return {name: pair for name, pair in weights.items() if not isinstance(pair, TractionModes)}
