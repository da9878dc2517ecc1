"""Stress on the surfaces of a body's gauges, at a frame of a trajectory."""

from fnmatch import fnmatch

import numpy as np

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.interfaces.stress_recovery import COMPONENTS, von_mises
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing


def stress_gauges(drawing: Drawing, body: BodyMotion) -> list[str]:
    """Return the gauges of stress on surfaces of a body, without reading large arrays."""
    paths = [path for path in drawing.store.sizes(body.morph.modes_key) if fnmatch(path, "gauges/*/nodes")]
    gauges = drawing.store.get(body.morph.modes_key, "modes", only=paths).gauges if paths else {}
    return [name for name, gauge in gauges.items() if gauge.unit == "Pa"]


def equivalent_stress(drawing: Drawing, body: BodyMotion, frame: int) -> np.ndarray:
    """Return the von Mises stress at the nodes [Pa], (n,), NaN where no gauge has it; see `nodal_stress` for errors."""
    return von_mises(nodal_stress(drawing, body, frame))


def nodal_stress(drawing: Drawing, body: BodyMotion, frame: int) -> np.ndarray:
    """Return the stress at the nodes [Pa], (n, 6), NaN where no gauge has it: rows q + residual λ.

    Raises:
        StageError: see `row_forces`.
    """
    names = [f"gauges/{name}" for name in stress_gauges(drawing, body)]
    modal = drawing.store.get(body.morph.modes_key, "modes", only=[*names, "interface_rows"])
    q = body.coordinates[frame, len(body.morph.rigid_twists) :]
    pressed = any(gauge.residual.shape[1] for gauge in modal.gauges.values())
    forces = row_forces(drawing, body, modal, frame) if pressed else np.empty(0)
    values = np.full((len(body.nodes), len(COMPONENTS)), np.nan)
    for gauge in modal.gauges.values():
        stress = gauge.rows @ q
        if gauge.residual.shape[1]:
            stress = stress + gauge.residual @ forces
        values[gauge.nodes] = stress.reshape(-1, len(COMPONENTS))
    return values


def row_forces(drawing: Drawing, body: BodyMotion, modal: ModalRecord, frame: int) -> np.ndarray:
    """Return the force on each row of R at a frame, (C,); a contact pushes against the outward normal.

    Raises:
        StageError: the trajectory does not hold the force on each row: another body's points press on several rows, or
            a force acts that is no contact.
    """
    for name, force in drawing.scene.get("force", {}).items():
        if body.name in (force.get("body"), force.get("against")):
            raise StageError(f"the trajectory does not hold force {name} on body {body.name} at frames")
    forces = np.zeros(modal.row_count)
    for name, contact in drawing.contacts_on(body.name).items():
        interface, pressed = contact.interface, contact.multipliers[frame]
        if contact.body != body.name:
            interface = drawing.scene["contact"][name]["against"]["interface"]
        rows = slice(*modal.interface_rows[interface])
        if contact.body != body.name and rows.stop - rows.start > 1:
            raise StageError(f"the points of contact {name} press on several rows of '{interface}' in another order")
        forces[rows] -= pressed
    return forces
