"""What a run's surface layers are worth: a run whose layers are twice as stiff.

`surface_stiffness` is data of a surface, of which often no more than the order of magnitude is known. The run with
twice as much, with the same steps, differs by what that does: a force that hangs on the layer is as sure as it is.
"""

from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.checks.basis import Run, differences, fastest_body, pushes
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.result import Result
from gudgeon.solver.system.compile import assembled
from gudgeon.solver.system.system import System

NOTICED = 0.02
"""Share of the compliance of a contact: less changes forces by less than about half of it."""


def with_layer_estimates(system: System, found: Trajectory, run: Run) -> Trajectory:
    """Return a finished run with what layers of twice the stiffness change.

    Args:
        system: The one that was run.
        found: Its trajectory.
        run: Integrates another system.

    Returns:
        Its `estimates` with `layer.impulse`, `layer.force` and `layer.rebound`, relative to what those of the basis
        are. Unchanged where no layer has a noticeable share of the compliance that was pressed, or the other run is
        impossible.
    """
    scene = system.scene
    stiffer = {
        name: contact.model_copy(update={"surface_stiffness": 2 * contact.surface_stiffness})
        for name, contact in scene.contact.items()
        if contact.surface_stiffness is not None and name in found.contacts and _share(system, found, name) > NOTICED
    }
    if not stiffer:
        return found
    changed = scene.model_copy(update={"contact": scene.contact | stiffer})
    try:
        other = assembled(changed, system.bodies, system.terms, fields=system.fields, bores=system.bores)
        against = run(other, float(found.times[0]))
    except (SceneError, SolverError):
        return found
    if not Result[against.result].ok or len(against.times) != len(found.times):
        return found
    apart = differences(found, (found, against), system.window, fastest_body(system))
    return replace(found, estimates=found.estimates | {f"layer.{name}": one for name, one in apart.items()})


def _share(system: System, found: Trajectory, name: str) -> float:
    """Return the share of a contact's layer in the static compliance to the forces that acted; 0 where none did."""
    (contact,) = (one for one in system.contacts if one.name == name)
    forces, elastic = pushes(found, name), system.stiffness > 0
    own, layer = np.arange(contact.rows.start, contact.rows.stop), float(forces**2 @ system.layer[contact.rows])
    modal = (forces @ system.rows[contact.rows])[elastic] ** 2 / system.stiffness[elastic]
    whole = layer + float(forces @ system.residual.among(own, own) @ forces) + float(modal.sum())
    return layer / whole if whole > 0 else 0.0
