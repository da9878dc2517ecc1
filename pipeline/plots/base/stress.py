"""Stress on the surfaces of a body's gauges, at a frame of a trajectory."""

from collections.abc import Callable
from fnmatch import fnmatch

import numpy as np

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.interfaces.stress_recovery import COMPONENTS, von_mises
from gudgeon.pipeline.plots.base.row_forces import READ, friction_contacts, row_forces
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing


def stress_gauges(drawing: Drawing, body: BodyMotion) -> list[str]:
    """Return the gauges of stress on surfaces of a body, without reading large arrays."""
    paths = [path for path in drawing.store.sizes(body.morph.modes_key) if fnmatch(path, "gauges/*/nodes")]
    gauges = drawing.store.get(body.morph.modes_key, "modes", only=paths).gauges if paths else {}
    return [name for name, gauge in gauges.items() if gauge.unit == "Pa"]


def equivalent_stress(drawing: Drawing, body: BodyMotion, frame: int) -> np.ndarray:
    """Return the von Mises stress at the nodes [Pa], (n,), NaN where no gauge has it; see `nodal_stress` for errors."""
    return von_mises(nodal_stress(drawing, body)(frame))


def nodal_stress(drawing: Drawing, body: BodyMotion) -> Callable[[int], np.ndarray]:
    """Return a function of the frame: the stress at the nodes [Pa], (n, 6), NaN where no gauge has it, in the body's
    own axes: rows q + residual λ.

    Raises:
        StageError: see `row_forces`.
    """
    modal = _gauged(drawing, body)
    pressed = any(gauge.residual.shape[1] for gauge in modal.gauges.values())
    forces = row_forces(drawing, body, modal) if pressed else np.empty(0)

    def at(frame: int) -> np.ndarray:
        q = body.coordinates[frame, len(body.morph.rigid_twists) :]
        values = np.full((len(body.nodes), len(COMPONENTS)), np.nan)
        for gauge in modal.gauges.values():
            stress = gauge.rows @ q
            if gauge.residual.shape[1]:
                stress = stress + gauge.residual @ forces[frame]
            values[gauge.nodes] = stress.reshape(-1, len(COMPONENTS))
        return values

    return at


def left_out(drawing: Drawing, body: BodyMotion) -> str:
    """Return what the stress of a body lacks, to be written beside it; empty if nothing."""
    rough = friction_contacts(drawing, body, _gauged(drawing, body))
    return f"without the local stress of friction at {', '.join(rough)}" if rough else ""


def _gauged(drawing: Drawing, body: BodyMotion) -> ModalRecord:
    """Return the gauges of stress on surfaces of a body, and what forces are put on their columns with."""
    names = [f"gauges/{name}" for name in stress_gauges(drawing, body)]
    return drawing.modes(body.name, [*names, *READ])
