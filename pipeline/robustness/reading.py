"""Reads the numbers that the rules need from a run of a scene of bodies."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.modaldb.records.trajectory import BEGINS, CLOSING, ENDS, IMPULSE, WINDOWED, Trajectory
from gudgeon.pipeline.robustness.evidence import Evidence, FirstContact, Impacts
from gudgeon.pipeline.robustness.overlap import multipliers_of, overlaps
from gudgeon.pipeline.stages.change import change_estimates, largest_changes
from gudgeon.pipeline.stages.job import Job
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.results import written
from gudgeon.solver.scene.run import LEAST_WINDOW
from gudgeon.solver.system.system import System

WHOLE = ("macneal", "normal+static", "rubin")
"""Reductions whose first coordinates are normal modes of the whole mesh."""
EPS = float(np.finfo(float).eps)


def run_evidence(job: Job, system: System, trajectory: Trajectory, modes: Mapping[str, ModalRecord]) -> Evidence:
    """Return the evidence of a run."""
    contradiction = _contradiction(system, trajectory)
    along = {name: system.of_records(getattr(trajectory, name)) for name in ("frames", "velocities")}
    trajectory = replace(trajectory, **along)
    elastic = {name: record for name, record in modes.items() if len(record.angular_frequencies)}
    materials = {name: job.scene.component[name].material for name in elastic}
    counts, estimates, energies = trajectory.counts, trajectory.estimates, trajectory.energies
    exchanged, contact = _exchanged(trajectory), first_contact(trajectory)
    deepest, depth, allowed = overlaps(system, trajectory)
    return Evidence(
        frequencies={n: r.angular_frequencies[: r.normal_count] for n, r in elastic.items() if r.reduction in WHOLE},
        shear={name: material.lame[1] for name, material in materials.items() if material is not None},
        contrast=max((material.contrast for material in materials.values() if material is not None), default=1.0),
        passing=_passing(system.scene.run.accuracy, trajectory),
        estimated=max(_estimates(elastic.values()), default=None),
        orthogonality=max(_orthogonality(elastic.values()), default=None),
        contact=contact,
        readings=_readings(trajectory),
        impacts=_impacts(system, trajectory),
        integrator=str(counts["integrator"]),
        energy_drift=trajectory.energy_drift,
        contradiction=contradiction,
        momentum_residual=trajectory.momentum_residual if _moves_freely(system, trajectory) else None,
        momentum_round_off=_last_digit(system, trajectory),
        pulled=any(system.scene.run.gravity),
        energy_round_off=EPS * float(np.abs(energies).max(initial=0.0)) / exchanged if exchanged > 0 else 0.0,
        force_round_off=_ringing(system, trajectory, contact),
        gap_round_off=_blur(system),
        rise=_rise(system, trajectory, exchanged),
        loss=float(energies[-1, 3]) if len(energies) else 0.0,
        exchanged=exchanged,
        unrest=_unrest(trajectory),
        deepest=deepest,
        penetration=depth,
        penetration_bound=allowed,
        basis=estimates.get("basis.impulse"),
        mesh=estimates.get("mesh.impulse"),
        stepped=estimates.get("step.impulse" if trajectory.contacts else "step.motion"),
        changed=max(_changes(job), default=None),
        turned=_turned(system, trajectory),
        condition=_condition(system),
        steps=int(counts.get("steps_taken", counts["steps"])),
        substeps=int(counts["substeps"]),
        step=float(counts["step"]),
    )


def _contradiction(system: System, trajectory: Trajectory) -> tuple[str, float]:
    """Return what a record says twice and least alike, and the difference over the allowed one."""
    differences = written.disagreements(system, trajectory)
    twice = [(name, value / written.allowed(system, name)) for name, value in differences.items()]
    return max(twice, key=lambda pair: pair[1], default=("", 0.0))


def _moves_freely(system: System, trajectory: Trajectory) -> bool:
    """Return whether a body can move freely, and a force acts on one."""
    forced = any(history.force.any() for history in trajectory.contacts.values()) or bool(trajectory.joints)
    return forced and any(body.rigid_count for body in system.bodies.values())


def _estimates(records: Iterable[ModalRecord]) -> Iterator[float]:
    """Yield the largest estimated error of the frequencies of each component that has estimates."""
    for record in records:
        errors = record.discretisation_errors
        if errors is not None and np.isfinite(errors[: record.normal_count]).any():
            yield float(np.nanmax(errors[: record.normal_count]))


def _orthogonality(records: Iterable[ModalRecord]) -> Iterator[float]:
    """Yield the deviation of ΦᵀMΦ from I of each component that has it."""
    yield from (float(r.quality["orthogonality"]) for r in records if "orthogonality" in r.quality)


def _changes(job: Job) -> Iterator[float]:
    """Yield the estimated changes by a design with reused modes, over its tolerance."""
    for entry in change_estimates(job).values():
        yield from (abs(value) / entry["tolerance"] for value in largest_changes(entry).values())


def _readings(trajectory: Trajectory) -> dict[str, tuple[float, str]]:
    """Return value and unit of the quantities of a run without contact that two runs of one motion share.

    The time of a peak is that of a sample. Reactions have no bound at singular positions of joints.
    """
    if trajectory.contacts:
        return {}
    unbounded = bool(trajectory.counts.get("singular_steps", 0))
    return {
        name: (entry["value"], entry["unit"])
        for name, entry in trajectory.quantities.items()
        if not name.endswith("_time") and not (unbounded and entry["unit"] in ("N", "N m"))
    }


def _passing(accuracy: float | None, trajectory: Trajectory) -> float:
    """Return the accuracy of a mechanism that passed positions at which its joints depend on each other, or 0.

    Args:
        accuracy: `run.accuracy`.
    """
    accuracy = accuracy or INTEGRATORS[trajectory.counts["integrator"]].accuracy
    return accuracy if trajectory.counts.get("singular_steps") else 0.0


def _exchanged(trajectory: Trajectory) -> float:
    """Return the energy that kinetic, strain and contact energy exchange [J]; samples do not resolve short impacts."""
    exchanged = float(sum(np.ptp(trajectory.energies[:, i]) for i in range(3)))
    for impacts in trajectory.impacts.values():
        exchanged = max(exchanged, 0.25 * float((impacts[:, IMPULSE] * np.abs(impacts[:, CLOSING])).max(initial=0.0)))
    return exchanged


def _rise(system: System, trajectory: Trajectory, exchanged: float) -> float | None:
    """Return the largest increase of the mechanical energy less the work of the loads, over the energy exchanged.

    None where nothing is exchanged, and with dashpots, which recover with a delay: their energy is not in it.
    """
    if not exchanged > 0 or system.dashpot.any():
        return None
    mechanical = trajectory.energies[:, :3].sum(axis=1) - trajectory.energies[:, 4]
    return float((mechanical - np.minimum.accumulate(mechanical)).max()) / exchanged


def _unrest(trajectory: Trajectory) -> float | None:
    """Return the largest kinetic over the largest strain energy of a run; None where nothing is deformed."""
    kinetic, strain = np.abs(trajectory.energies[:, :2]).max(axis=0, initial=0.0)
    return float(kinetic / strain) if strain > 0 else None


def first_contact(trajectory: Trajectory) -> FirstContact | None:
    """Return a run's first impact, with its windowed force, if any."""
    contacts = []
    for impacts in trajectory.impacts.values():
        for impact in impacts[:1]:
            start, end, impulse, force = impact[[BEGINS, ENDS, IMPULSE, WINDOWED]].tolist()
            contacts.append(FirstContact(start, impulse, end - start, force))
    return min(contacts, key=lambda c: c.start, default=None)


def _restitution(contact: Any) -> float | None:
    """Return the restitution of a law between free rigid bodies, if it is known."""
    if contact.law is None:
        return 1.0 if contact.surface_stiffness is not None else None
    if contact.law.kind == "hertz" or (contact.law.kind == "linear" and contact.law.damping == 0):
        return 1.0
    return contact.law.restitution if contact.law.kind == "exact" else None


def _last_digit(system: System, trajectory: Trajectory) -> float:
    """Return the round-off of the largest momentum over the impulse of all contacts."""
    impulse = sum(
        float(np.linalg.norm(history.force, axis=1).sum()) * float(trajectory.times[0])
        for history in trajectory.contacts.values()
    )
    speed = max((float(np.abs(trajectory.velocities[:, k]).max(initial=0.0)) for k in system.rigid), default=0.0)
    masses = [body.morph.mass for body in system.bodies.values()]
    return EPS * max(masses) ** 0.5 * speed / impulse if impulse > 0 else 0.0


def _ringing(system: System, trajectory: Trajectory, contact: FirstContact | None) -> float:
    """Return the relative round-off of the contact force, from that of frequencies; docs/robustness.md derives it."""
    damped = bool(system.dashpot.any())  # Vibration decays before its phase has an error.
    exact = math.isinf(INTEGRATORS[trajectory.counts["integrator"]].order)
    if contact is None or not exact or system.shortest_period == 0 or damped:
        return 0.0
    phase = EPS * (2 * np.pi * contact.duration / system.shortest_period) ** 2 / (2 * np.pi)
    elastic, worst = system.stiffness > 0, 0.0
    yields, multipliers = system.residual.diagonal() + system.layer, multipliers_of(system, trajectory)
    maxima = multipliers.max(axis=0, initial=0.0)
    for row in np.flatnonzero((yields > 0) & (maxima > 0)):
        paths = np.abs(trajectory.frames[multipliers[:, row] > 0][:, elastic]) @ np.abs(system.rows[row][elastic])
        worst = max(worst, float(paths.max()) / float(yields[row] * maxima[row]))
    return phase * worst


def _blur(system: System) -> float:
    """Return the round-off of the points' positions over the least gap; 0 if points touch at the start."""
    positions = [float(np.abs(c.points + system.scene.body[c.body].position).max()) for c in system.contacts]
    smallest_gap = float(system.gap.min(initial=np.inf))
    return EPS * max(positions) / smallest_gap if positions and smallest_gap > 0 else 0.0


def _turned(system: System, trajectory: Trajectory) -> float | None:
    """Return the largest rotation of a body at a frame over the limit of the scene; None where no body can turn."""
    bodies = [body for body in system.bodies.values() if body.twists[:, 3:].any()]
    angles = [np.linalg.norm(body.centre_motion(trajectory.frames[:, body.rigid])[:, 3:], axis=1) for body in bodies]
    largest = max((float(magnitudes.max(initial=0.0)) for magnitudes in angles), default=None)
    return None if largest is None else largest / system.scene.run.limits.angle


def _condition(system: System) -> float | None:
    """Return the condition number of the matrix from which contact forces are computed, at unit diagonal."""
    if not len(system.gap):
        elastic = system.stiffness[system.stiffness > 0]
        return float(elastic.max() / elastic.min()) if len(elastic) else None
    yields, rows = system.compliance, system.rows
    matrix = yields.dense() if yields.diagonal().min() > 0 else rows.dense() @ rows.dense().T
    size = np.sqrt(matrix.diagonal())
    values = np.linalg.eigvalsh(matrix / np.outer(size, size))
    return float(values[-1] / values[0]) if values[0] > 0 else float("inf")


def _impacts(system: System, trajectory: Trajectory) -> Impacts | None:
    """Return the impacts that closed forms describe; None if there are none."""
    if len(system.contacts) != 1 or len(system.gap) != 1:
        return None
    scene, contact = system.scene, system.contacts[0]
    settings, row, square = scene.contact[contact.name], system.rows[0], float(system.rows[0] @ system.rows[0])
    rigid = not (system.stiffness > 0).any()
    impact = settings.method == "impact"
    separate = system.separation <= LEAST_WINDOW * scene.run.duration
    if settings.friction is not None or not (rigid or impact):
        return None
    e = settings.restitution if impact else _restitution(settings)
    forced = any(scene.run.gravity) or bool(scene.force)
    impacts = trajectory.impacts.get(contact.name)
    closing = impacts[:, CLOSING] if impacts is not None else np.empty(0)
    return Impacts(e, 1 / square, closing, -float(row @ system.velocity), rigid and not forced, impact and separate)
