"""Electrostatic fields of a scene: read from records, and their rows on bodies whose rotations are small."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.field import POSE_AXES, FieldRecord, PoseGridRecord
from gudgeon.modaldb.stores.base import Store
from gudgeon.solver.bodies.placing import turned_vectors
from gudgeon.solver.bodies.small_motion import FlexibleBody, named
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.fields.co_energy import (
    LEFT,
    OUT,
    CoEnergies,
    adhesion_field,
    co_energy_values,
    grid_field,
    joined,
    plates_field,
    refuse_outside,
    values,
)
from gudgeon.solver.forces.fields.electrostatic import (
    TOUCHING,
    VACUUM,
    Adhesion,
    Electrostatic,
    ElectrostaticPressure,
    FieldForce,
    ParallelPlates,
)
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.vectors import unit

OFF_AXIS = 1e-3
"""Default motion along a translation that a grid has not, relative to the grid's smallest extent."""
ASIDE = 1e-3
"""Distance of the two ends of a field over the radius of gyration of its body, from which on its forces would turn the
bodies noticeably."""
FACING = -0.99
"""Largest scalar product of normals of a surface and of a plane that face each other."""
SHIFT = 1e-4
"""Step of the differences that give a stiffness, relative to the extent of an axis or to a gap."""
End = tuple[FlexibleBody, str | None, np.ndarray, np.ndarray]
"""A body, its interface or None, the mix of the rows of the interface, and force and moment per unit of each row."""


class Fields(NamedTuple):
    """The fields of a scene, f of them; an electrode has one for each of its points."""

    names: list[str]
    """Of the force of each."""
    energies: CoEnergies


def read_fields(store: Store, scene: Scene, bodies: Mapping[str, FlexibleBody]) -> Fields:
    """Return the fields of a scene.

    Raises:
        SceneError: a record is missing, a conductor is named that it has not, or a surface does not face its plane.
    """
    names, tables = list(scene.fields()), []
    for name, field in scene.fields().items():
        if isinstance(field, Adhesion):
            normal = unit(field.normal)
            gap = float((_place(name, field, scene, bodies) - np.array(field.point)) @ normal) - field.radius
            adhesion_force = 2 * np.pi * field.work * field.radius
            tables.append(adhesion_field(gap, field.axes().T @ normal, adhesion_force, field.range))
        elif isinstance(field, ParallelPlates):
            if field.charge is None:
                strength = 0.5 * field.permittivity * field.area * (field.potential or 0.0) ** 2
            else:
                strength = -0.5 * field.charge**2 / (field.permittivity * field.area)
            normal = field.axes().T @ unit(field.direction)
            tables.append(plates_field((field.gap, field.touching), normal, strength, charged=field.charge is not None))
        else:
            tables.append(_on_grid(store, name, field))
    for name, electrode in scene.electrodes().items():
        points = _electrode(name, electrode, scene, bodies)
        names += [name] * len(points)
        tables += points
    return Fields(names, joined(tables))


def _place(name: str, field: FieldForce, scene: Scene, bodies: Mapping[str, FlexibleBody]) -> np.ndarray:
    """Return where a field acts on its body as the run starts [m], (3,)."""
    settings = scene.body[field.body]
    if field.interface is None:
        return np.asarray(settings.position) + turned_vectors(settings, field.at)
    key = f"force.{name}.interface: body '{field.body}' has no load or joint surface"
    return named(bodies[field.body].modal.loads, field.interface, key).point + np.asarray(settings.position)


def _electrode(
    name: str, electrode: ElectrostaticPressure, scene: Scene, bodies: Mapping[str, FlexibleBody]
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return the field of each point of an electrode, whose only motion is that along its outward normal."""
    body, key = bodies[electrode.body], f"force.{name}"
    surface = named(
        body.modal.interfaces, electrode.interface, f"{key}.interface: body '{electrode.body}' has no contact points"
    )
    normal = unit(electrode.normal)
    turned = float((surface.normals @ normal).max())
    if turned > FACING:
        raise SceneError(
            f"{key}.normal: a point of '{electrode.interface}' has a normal"
            f" {np.degrees(np.arccos(min(1.0, -turned))):.3g} degrees from the plane's; a surface that faces the plane"
            " is needed, within 8 degrees"
        )
    points = body.morph.points[electrode.interface] + np.asarray(scene.body[electrode.body].position)
    gaps = (points - np.array(electrode.point)) @ normal
    gap_limit = TOUCHING * float(gaps.max()) if electrode.least_gap is None else electrode.least_gap
    if gaps.min() <= gap_limit:
        raise SceneError(
            f"{key}.point: a point of '{electrode.interface}' is {gaps.min():.4g} m above the plane as the run starts;"
            f" needed: more than the gap at which it touches, {gap_limit:.4g} m"
        )
    strengths = 0.5 * electrode.permittivity * np.asarray(surface.areas) * electrode.potential**2
    return [
        plates_field((float(gap), gap_limit), np.array([-1.0, 0.0, 0.0]), float(strength), charged=False)
        for gap, strength in zip(gaps, strengths, strict=True)
    ]


def electrode_end(name: str, one: ElectrostaticPressure, bodies: Mapping[str, FlexibleBody]) -> End:
    """Return the end of an electrode, a row along the outward normal of each point."""
    body = bodies[one.body]
    surface = named(body.modal.interfaces, one.interface, f"force.{name}.interface: body '{one.body}' has no points")
    first, last = body.modal.interface_rows[one.interface]
    normals = np.asarray(surface.normals)
    resultant = np.column_stack([normals, np.cross(body.morph.points[one.interface], normals)])
    return body, one.interface, np.eye(len(normals), last - first), resultant


def field_loads(names: list[str], loads: list[str]) -> np.ndarray:
    """Return the numbers of the load rows that move each field, of its body and of the other one, (f, 2, 6).

    Args:
        names: Force of each field, (f,).
        loads: Name of the load of each row; that of the other end has `.against` behind it.
    """
    found = np.full((len(names), 2, 6), -1)
    for side, more in enumerate(("", ".against")):
        for name in dict.fromkeys(names):
            fields = [i for i, one in enumerate(names) if one == name]
            rows = [n for n, load in enumerate(loads) if load == name + more]
            if len(fields) > 1 or len(rows) == 1:
                found[fields[: len(rows)], side, 0] = rows
            else:
                found[fields[0], side, : len(rows)] = rows
    return found


def _on_grid(store: Store, name: str, field_force: Electrostatic) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if field_force.record is None:
        raise SceneError(
            f"force.{name}.field: '{field_force.field}' is not computed yet; `gudgeon run` does that first"
        )
    if not store.has(field_force.record):
        key = "record" if field_force.field is None else "field"
        raise SceneError(
            f"force.{name}.{key}: no grid of poses '{field_force.record[:12]}' in the database; compute its scene of"
            " conductors"
        )
    grid: PoseGridRecord = store.get(field_force.record, "posegrid")
    field: FieldRecord = store.get(grid.field_key, "field", only=["conductors"])
    names, potentials = list(field.conductors["names"]), np.array(grid.potentials, float)
    for conductor, value in field_force.potentials.items():
        if conductor not in names:
            raise SceneError(f"force.{name}.potentials: no conductor '{conductor}'; the field has {', '.join(names)}")
        potentials[names.index(conductor)] = value
    axes = {axis: np.asarray(grid.axes[axis], float) for axis in POSE_AXES if axis in grid.axes}
    shape = tuple(map(len, axes.values()))
    G = co_energy_values(np.asarray(grid.capacitance), potentials, np.asarray(grid.charges)).reshape(shape)
    extents = [float(np.ptp(nodes)) for axis, nodes in axes.items() if axis in POSE_AXES[:3]]
    wide = float(np.abs(grid.capacitance).max()) / (4 * np.pi * VACUUM)
    length = (
        OFF_AXIS * min(extents, default=wide) if field_force.off_axis_length is None else field_force.off_axis_length
    )
    return grid_field(axes, G, (length, field_force.off_axis_angle))


def field_ends(name: str, field: FieldForce, scene: Scene, bodies: Mapping[str, FlexibleBody]) -> list[End]:
    """Return the ends of a field: of its body, and of the other one where there is one.

    Raises:
        SceneError: a body is elastic and no interface of it is named, or both ends are at different places.
    """
    axes, scene_key = field.axes(), f"force.{name}"
    ends, positions = [], []
    for i, (body_name, interface) in enumerate(
        ((field.body, field.interface), (field.against, field.against_interface))
    ):
        if body_name is None:
            continue
        body, key = bodies[body_name], "against_interface" if i else "interface"
        origin = np.asarray(scene.body[body_name].position)
        if interface is None:
            if len(body.modal.angular_frequencies):
                raise SceneError(
                    f"{scene_key}.{key}: body '{body_name}' is elastic; name an interface of kind 'mean' or 'tie'"
                )
            if i == 0:
                positions.append(origin + turned_vectors(scene.body[body_name], field.at))
            arm = positions[0] - origin
            rows = [np.column_stack([axes.T, np.cross(arm, axes.T)]), np.column_stack([np.zeros((3, 3)), axes.T])]
            ends.append((body, None, np.eye(6), np.vstack(rows)))
            continue
        load = named(body.modal.loads, interface, f"{scene_key}.{key}: body '{body_name}' has no load or joint surface")
        if len(load.rows) not in (3, 6):
            raise SceneError(f"{scene_key}.{key}: '{interface}' is no interface of kind 'mean' or 'tie'")
        positions.append(load.point + origin)
        mix = axes.T if len(load.rows) == 3 else np.kron(np.eye(2), axes.T)
        ends.append((body, interface, mix, mix @ load.resultant))
    offset, body = positions[0] - positions[-1], bodies[field.body]
    gyration = np.sqrt(np.linalg.eigvalsh(body.morph.inertia)[-1] / body.morph.mass)
    if np.linalg.norm(offset) > ASIDE * gyration:
        raise SceneError(
            f"{scene_key}.against_interface: its ends are {np.linalg.norm(offset):.3g} m apart, so that its forces"
            " would turn the bodies; a field acts at one point"
        )
    return ends


def start_pose(field: object) -> np.ndarray:
    """Return the pose of a field as the run starts, (6,)."""
    return np.array([*field.start, 0.0, 0.0, 0.0]) if isinstance(field, Electrostatic) else np.zeros(6)


def evaluated(names: list[str], fields: CoEnergies, poses: np.ndarray) -> np.ndarray:
    """Return what `co_energy.evaluate` finds of each field at its pose (f, 6) as a run starts, (f, OUT).

    Raises:
        SceneError: a pose is outside of its field.
    """
    results = np.array([values(fields, i, poses[i : i + 1])[0] for i in range(len(names))]).reshape(-1, OUT)
    for i, name in enumerate(names):
        if code := int(results[i, LEFT]):
            refuse_outside(name, fields, i, code, poses[i])
    return results


def stiffness(fields: CoEnergies, i: int, pose: np.ndarray) -> np.ndarray:
    """Return the second derivatives of a field's co-energy at a pose, by differences, (6, 6)."""
    head, size = fields.head[i], fields.size[i]
    step = np.full(6, SHIFT * max(abs(size[2]), size[7]))
    low, high = np.full(6, -np.inf), np.full(6, np.inf)
    free = np.abs(size[[3, 4, 5, 2, 2, 2]]) > 0
    free[3:] = False
    if head[1]:
        free[:] = False
        for a in range(head[1]):
            axis, start, count = head[3 + 3 * a : 6 + 3 * a]
            free[axis] = True
            low[axis], high[axis] = fields.data[start], fields.data[start + count]
            step[axis] = SHIFT * (high[axis] - low[axis])
    hessian = np.zeros((6, 6))
    for axis in np.flatnonzero(free):
        ends = np.tile(pose, (2, 1))
        ends[:, axis] += [-step[axis], step[axis]]
        ends[:, axis] = np.clip(ends[:, axis], low[axis], high[axis])
        gradient = values(fields, i, ends)[:, 1:7]
        hessian[axis] = (gradient[1] - gradient[0]) / (ends[1, axis] - ends[0, axis])
    return 0.5 * (hessian + hessian.T)
