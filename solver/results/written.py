"""What a record says in two ways: histories against totals, frames against energies, probes and peaks.

The run computes each side by itself, so that a fault on the way of one of them into the record shows. Round-off alone
is allowed: sums over samples, and energies of frames, are of the same states.
"""

from collections.abc import Iterator

import numpy as np

from gudgeon.modaldb.records.trajectory import BEGINS, ENDS, Trajectory
from gudgeon.solver.scene.probe import ForceProbe, PointProbe
from gudgeon.solver.system.system import System

ALLOWED = 1e-5
"""Allowed relative difference of what is said twice: round-off of sums over up to 10⁹ steps."""
SLIDING = 1e-4
"""That of the momentum of bodies that slide over traction spaces, whose functions move under the points in a sample."""
AT_ONCE = 1e-6
"""Time between an impact and a frame, over that between samples, at which they are at one time."""
EXACT = "event"
"""Integrator whose strain energy is that of modes alone; others add that of springs, loads, fields and dampers."""
MOVING = 1e-6
"""Share of a body's momentum below which an impulse is lost in its round-off."""


def unequal(system: System, trajectory: Trajectory) -> str:
    """Return what the record of a finished run says twice and not alike, in one line; nothing where all is alike."""
    for name, value in disagreements(system, trajectory).items():
        if not value <= (bound := allowed(system, name)):
            return f"the record contradicts itself: {name}, relative difference {value:.2g}, allowed {bound:.0e}"
    return ""


def allowed(system: System, name: str) -> float:
    """Return the allowed difference of an entry of `disagreements`."""
    slides = any(contact.master is not None for contact in system.contacts)
    return SLIDING if slides and name.startswith("momentum") else ALLOWED


def disagreements(system: System, trajectory: Trajectory) -> dict[str, float]:
    """Return the relative differences of what a finished run's record says twice, by what they are of.

    Forces summed over the samples are compared with impulses and with the momentum of bodies that nothing else moves;
    energies with those of the frames; force probes with the histories that they are of, others with the frames; the
    state that pictures show with the largest force of the history.
    """
    if not len(trajectory.times) or not len(trajectory.frame_times):
        return {}
    return dict(
        (*_impulses(system, trajectory), *_momenta(system, trajectory), *_energies(system, trajectory),
         *_probes(system, trajectory), *_peaks(trajectory))
    )  # fmt: skip


def _impulses(system: System, trajectory: Trajectory) -> Iterator[tuple[str, float]]:
    """Yield the difference of each contact's summed force from its impulse; friction is in the force alone."""
    for name, history in trajectory.contacts.items():
        stated = trajectory.quantities.get(f"{name}.impulse")
        if stated is None or system.scene.contact[name].friction is not None:
            continue
        summed = float(np.linalg.norm(trajectory.times[0] * history.force.sum(axis=0)))
        size = max(stated["value"], trajectory.times[0] * float(np.linalg.norm(history.force, axis=1).sum()))
        if size > 0:
            yield f"impulse of contact.{name}", abs(summed - stated["value"]) / size


def _momenta(system: System, trajectory: Trajectory) -> Iterator[tuple[str, float]]:
    """Yield the difference of what moves each body in its record from the change of its momentum."""
    if (
        len(system.driving.rows)
        or len(system.springs.stiffness)
        or system.scene.joint
        or system.scene.capabilities.turns
    ):
        return
    if _strikes(trajectory, trajectory.frame_times[-1:]):
        return
    interval, count = float(trajectory.times[0]), round(trajectory.frame_times[-1] / trajectory.times[0])
    end = system.of_records(trajectory.velocities[-1:])[0]
    for name, body in system.bodies.items():
        shifts = np.flatnonzero(~body.twists[:, 3:].any(axis=1))
        if not len(shifts):
            continue
        impulse, size = np.zeros(3), 0.0
        for contact in system.contacts:
            force = interval * trajectory.contacts[contact.name].force[:count]
            sign = sum(side_sign for owner, *_, side_sign in contact.sides if owner == name)
            sign -= contact.master is not None and contact.master.body == name
            impulse, size = (
                impulse + sign * force.sum(axis=0),
                size + abs(sign) * float(np.linalg.norm(force, axis=1).sum()),
            )
        impulse += interval * count * body.morph.mass * np.asarray(system.scene.run.gravity)
        moved = (end - system.velocity)[body.rigid][shifts]
        error = np.abs(moved - body.twists[shifts, :3] @ impulse) / np.linalg.norm(body.twists[shifts, :3], axis=1)
        if size > 0:
            round_off = float(np.abs(system.velocity[body.rigid]).max(initial=0.0)) * body.morph.mass**0.5
            yield f"momentum of body.{name}", float(error.max()) / max(size, MOVING * round_off)


def _strikes(trajectory: Trajectory, times: np.ndarray) -> bool:
    """Return whether an impact begins or ends at one of some times [s], (t,)."""
    ends = [impacts[:, [BEGINS, ENDS]].ravel() for impacts in trajectory.impacts.values()]
    moments = np.concatenate([*ends, np.empty(0)])
    return bool((np.abs(moments[:, None] - times) <= AT_ONCE * trajectory.times[0]).any())


def _energies(system: System, trajectory: Trajectory) -> Iterator[tuple[str, float]]:
    """Yield the differences of kinetic and strain energy from those of the frames."""
    if system.scene.capabilities.turns:
        return
    q, v = (system.of_records(states) for states in (trajectory.frames, trajectory.velocities))
    rows = np.rint(trajectory.frame_times / trajectory.times[0]).astype(int) - 1
    size = float(np.abs(trajectory.energies).max(initial=0.0))
    if not size > 0:
        return
    if _strikes(trajectory, trajectory.frame_times):
        return  # Velocities jump there: a frame has those before an impact, or those after it.
    kinetic = trajectory.energies[rows, 0] - 0.5 * np.einsum("fi,fi->f", v, v)
    yield "kinetic energy", float(np.abs(kinetic).max()) / size
    if trajectory.counts["integrator"] == EXACT and not len(system.springs.stiffness):
        strain = trajectory.energies[rows, 1] - 0.5 * (q * q) @ system.stiffness
        yield "strain energy", float(np.abs(strain).max()) / size


def _probes(system: System, trajectory: Trajectory) -> Iterator[tuple[str, float]]:
    """Yield the differences of probes from what they are of: forces of contacts, places at frames."""
    probes, rows = system.probes, np.rint(trajectory.frame_times / trajectory.times[0]).astype(int) - 1
    read = None
    for name, history in trajectory.probes.items():
        probe, columns = system.scene.probe.get(name), slice(0)
        if isinstance(probe, PointProbe):
            if (
                probe.kind not in ("displacement", "rotation")
                or system.scene.capabilities.turns
                or name not in probes.names
                or _moved_by_loads(system, name)
            ):
                continue
            if read is None:
                q, v = (system.of_records(states) for states in (trajectory.frames, trajectory.velocities))
                contact_forces = np.zeros((len(q), len(system.gap)))
                for contact in system.contacts:
                    contact_forces[:, contact.rows] = trajectory.contacts[contact.name].multipliers
                read = probes.values(q, v) + contact_forces @ probes.pressed.T
            columns = probes.places[probes.names.index(name)]
            values, expected = history.values[rows], read[:, columns]
        elif isinstance(probe, ForceProbe) and probe.of.startswith("contact.") and history.kind == "force":
            values, expected = history.values, trajectory.contacts[probe.of.removeprefix("contact.")].force
        else:
            continue
        size = float(np.abs(expected).max(initial=0.0))
        if size > 0:
            yield f"probe.{name}", float(np.abs(values - expected).max()) / size


def _moved_by_loads(system: System, probe: str) -> bool:
    """Return whether residual flexibility moves the place of a probe by other forces than those of contacts."""
    acting = {owner for owner, interface, *_ in system.driving.places() if interface is not None}
    acting |= {end.body for ends in system.springs.ends for end in ends if end.interface is not None}
    readings = system.probes.readings[system.probes.names.index(probe)]
    return any(
        reading.body in acting
        and len(reading.index)
        and system.bodies[reading.body].modal.residual_flexibility is not None
        for _, _, reading in readings
    )


def _peaks(trajectory: Trajectory) -> Iterator[tuple[str, float]]:
    """Yield by how much the force of the state that pictures show falls short of the largest of the history."""
    for name, row in trajectory.peaks.items():
        assert trajectory.peak_times is not None
        sizes = np.linalg.norm(trajectory.contacts[name].force, axis=1)
        shown = sizes[round(trajectory.peak_times[row] / trajectory.times[0]) - 1]
        if sizes.max() > 0:
            yield f"peak of contact.{name}", 1.0 - float(shown) / float(sizes.max())
