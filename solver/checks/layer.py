"""What a run's surface layers are worth: a run whose layers are twice as stiff.

`surface_stiffness` is data of a surface, of which often no more than the order of magnitude is known. The run with
twice as much, with the same steps, differs by what that does: a force that hangs on the layer is as sure as it is.
"""

from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.checks.basis import Run, differences, fastest_body, pushes
from gudgeon.solver.checks.readings import changes, readings
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.result import Result
from gudgeon.solver.system.compile import assembled
from gudgeon.solver.system.system import System

NOTICED = 0.02
"""Share of the compliance of a contact: less changes forces by less than about half of it."""


def with_layer_estimates(system: System, trajectory: Trajectory, run: Run) -> Trajectory:
    """Return a finished run with what layers of twice the stiffness change.

    Args:
        system: The one that was run.
        trajectory: Its trajectory.
        run: Integrates another system.

    Returns:
        Its `estimates` with `layer.impulse`, `layer.force`, `layer.rebound` and `layer.NAME.KIND`, relative to what
        those of the basis are. Unchanged where no layer has a noticeable share of the compliance that was pressed,
        or the other run is impossible.
    """
    scene = system.scene
    stiffer = {
        name: contact.model_copy(update={"surface_stiffness": 2 * contact.surface_stiffness})
        for name, contact in scene.contact.items()
        if contact.surface_stiffness is not None
        and name in trajectory.contacts
        and _share(system, trajectory, name) > NOTICED
    }
    if not stiffer:
        return trajectory
    changed = scene.model_copy(update={"contact": scene.contact | stiffer})
    try:
        stiffer_system = assembled(changed, system.bodies, system.terms, fields=system.fields, bores=system.bores)
        against = run(stiffer_system, float(trajectory.times[0]))
    except (SceneError, SolverError):
        return trajectory
    if not Result[against.result].ok or len(against.times) != len(trajectory.times):
        return trajectory
    run_readings = readings(system, trajectory)
    relative_changes = changes(run_readings, readings(stiffer_system, against))
    relative_changes |= differences(trajectory, (trajectory, against), system.windows, fastest_body(system))
    return replace(
        trajectory, estimates=trajectory.estimates | {f"layer.{name}": c for name, c in relative_changes.items()}
    )


def _share(system: System, trajectory: Trajectory, name: str) -> float:
    """Return the share of a contact's layer in the static compliance to the forces that acted; 0 where none did."""
    (contact,) = (c for c in system.contacts if c.name == name)
    forces, elastic = pushes(trajectory, name), system.stiffness > 0
    rows, layer_compliance = (
        np.arange(contact.rows.start, contact.rows.stop),
        float(forces**2 @ system.layer[contact.rows]),
    )
    modal = (forces @ system.rows[contact.rows])[elastic] ** 2 / system.stiffness[elastic]
    total_compliance = (
        layer_compliance + float(forces @ system.residual.among(rows, rows) @ forces) + float(modal.sum())
    )
    return layer_compliance / total_compliance if total_compliance > 0 else 0.0
