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
    names, found = list(scene.fields()), []
    for name, one in scene.fields().items():
        if isinstance(one, Adhesion):
            normal = unit(one.normal)
            gap = float((_place(name, one, scene, bodies) - np.array(one.point)) @ normal) - one.radius
            pull = 2 * np.pi * one.work * one.radius
            found.append(adhesion_field(gap, one.axes().T @ normal, pull, one.range))
        elif isinstance(one, ParallelPlates):
            if one.charge is None:
                strength = 0.5 * one.permittivity * one.area * (one.potential or 0.0) ** 2
            else:
                strength = -0.5 * one.charge**2 / (one.permittivity * one.area)
            normal = one.axes().T @ unit(one.direction)
            found.append(plates_field((one.gap, one.touching), normal, strength, charged=one.charge is not None))
        else:
            found.append(_on_grid(store, name, one))
    for name, electrode in scene.electrodes().items():
        points = _electrode(name, electrode, scene, bodies)
        names += [name] * len(points)
        found += points
    return Fields(names, joined(found))


def _place(name: str, one: FieldForce, scene: Scene, bodies: Mapping[str, FlexibleBody]) -> np.ndarray:
    """Return where a field acts on its body as the run starts [m], (3,)."""
    settings = scene.body[one.body]
    if one.interface is None:
        return np.asarray(settings.position) + turned_vectors(settings, one.at)
    where = f"force.{name}.interface: body '{one.body}' has no load or joint surface"
    return named(bodies[one.body].modal.loads, one.interface, where).point + np.asarray(settings.position)


def _electrode(
    name: str, one: ElectrostaticPressure, scene: Scene, bodies: Mapping[str, FlexibleBody]
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return the field of each point of an electrode, whose only motion is that along its outward normal."""
    body, where = bodies[one.body], f"force.{name}"
    surface = named(body.modal.interfaces, one.interface, f"{where}.interface: body '{one.body}' has no contact points")
    normal = unit(one.normal)
    turned = float((surface.normals @ normal).max())
    if turned > FACING:
        raise SceneError(
            f"{where}.normal: a point of '{one.interface}' has a normal {np.degrees(np.arccos(min(1.0, -turned))):.3g}"
            " degrees from the plane's; a surface that faces the plane is needed, within 8 degrees"
        )
    points = body.morph.points[one.interface] + np.asarray(scene.body[one.body].position)
    gaps = (points - np.array(one.point)) @ normal
    least = TOUCHING * float(gaps.max()) if one.least_gap is None else one.least_gap
    if gaps.min() <= least:
        raise SceneError(
            f"{where}.point: a point of '{one.interface}' is {gaps.min():.4g} m above the plane as the run starts;"
            f" needed: more than the gap at which it touches, {least:.4g} m"
        )
    strengths = 0.5 * one.permittivity * np.asarray(surface.areas) * one.potential**2
    return [
        plates_field((float(gap), least), np.array([-1.0, 0.0, 0.0]), float(strength), charged=False)
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
            rows = [n for n, one in enumerate(loads) if one == name + more]
            if len(fields) > 1 or len(rows) == 1:
                found[fields[: len(rows)], side, 0] = rows
            else:
                found[fields[0], side, : len(rows)] = rows
    return found


def _on_grid(store: Store, name: str, one: Electrostatic) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if one.record is None:
        raise SceneError(f"force.{name}.field: '{one.field}' is not computed yet; `gudgeon run` does that first")
    if not store.has(one.record):
        where = "record" if one.field is None else "field"
        raise SceneError(
            f"force.{name}.{where}: no grid of poses '{one.record[:12]}' in the database; compute its scene of"
            " conductors"
        )
    grid: PoseGridRecord = store.get(one.record, "posegrid")
    field: FieldRecord = store.get(grid.field_key, "field", only=["conductors"])
    names, potentials = list(field.conductors["names"]), np.array(grid.potentials, float)
    for conductor, value in one.potentials.items():
        if conductor not in names:
            raise SceneError(f"force.{name}.potentials: no conductor '{conductor}'; the field has {', '.join(names)}")
        potentials[names.index(conductor)] = value
    axes = {axis: np.asarray(grid.axes[axis], float) for axis in POSE_AXES if axis in grid.axes}
    shape = tuple(map(len, axes.values()))
    G = co_energy_values(np.asarray(grid.capacitance), potentials, np.asarray(grid.charges)).reshape(shape)
    extents = [float(np.ptp(nodes)) for axis, nodes in axes.items() if axis in POSE_AXES[:3]]
    wide = float(np.abs(grid.capacitance).max()) / (4 * np.pi * VACUUM)
    length = OFF_AXIS * min(extents, default=wide) if one.off_axis_length is None else one.off_axis_length
    return grid_field(axes, G, (length, one.off_axis_angle))


def field_ends(name: str, one: FieldForce, scene: Scene, bodies: Mapping[str, FlexibleBody]) -> list[End]:
    """Return the ends of a field: of its body, and of the other one where there is one.

    Raises:
        SceneError: a body is elastic and no interface of it is named, or both ends are at different places.
    """
    axes, where = one.axes(), f"force.{name}"
    ends, places = [], []
    for number, (body_name, interface) in enumerate(((one.body, one.interface), (one.against, one.against_interface))):
        if body_name is None:
            continue
        body, key = bodies[body_name], "against_interface" if number else "interface"
        origin = np.asarray(scene.body[body_name].position)
        if interface is None:
            if len(body.modal.angular_frequencies):
                raise SceneError(
                    f"{where}.{key}: body '{body_name}' is elastic; name an interface of kind 'mean' or 'tie'"
                )
            if number == 0:
                places.append(origin + turned_vectors(scene.body[body_name], one.at))
            arm = places[0] - origin
            rows = [np.column_stack([axes.T, np.cross(arm, axes.T)]), np.column_stack([np.zeros((3, 3)), axes.T])]
            ends.append((body, None, np.eye(6), np.vstack(rows)))
            continue
        load = named(body.modal.loads, interface, f"{where}.{key}: body '{body_name}' has no load or joint surface")
        if len(load.rows) not in (3, 6):
            raise SceneError(f"{where}.{key}: '{interface}' is no interface of kind 'mean' or 'tie'")
        places.append(load.point + origin)
        mix = axes.T if len(load.rows) == 3 else np.kron(np.eye(2), axes.T)
        ends.append((body, interface, mix, mix @ load.resultant))
    apart, body = places[0] - places[-1], bodies[one.body]
    gyration = np.sqrt(np.linalg.eigvalsh(body.morph.inertia)[-1] / body.morph.mass)
    if np.linalg.norm(apart) > ASIDE * gyration:
        raise SceneError(
            f"{where}.against_interface: its ends are {np.linalg.norm(apart):.3g} m apart, so that its forces would"
            " turn the bodies; a field acts at one point"
        )
    return ends


def start_pose(one: object) -> np.ndarray:
    """Return the pose of a field as the run starts, (6,)."""
    return np.array([*one.start, 0.0, 0.0, 0.0]) if isinstance(one, Electrostatic) else np.zeros(6)


def evaluated(names: list[str], fields: CoEnergies, poses: np.ndarray) -> np.ndarray:
    """Return what `co_energy.evaluate` finds of each field at its pose (f, 6) as a run starts, (f, OUT).

    Raises:
        SceneError: a pose is outside of its field.
    """
    found = np.array([values(fields, i, poses[i : i + 1])[0] for i in range(len(names))]).reshape(-1, OUT)
    for i, name in enumerate(names):
        if code := int(found[i, LEFT]):
            refuse_outside(name, fields, i, code, poses[i])
    return found


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
    found = np.zeros((6, 6))
    for axis in np.flatnonzero(free):
        ends = np.tile(pose, (2, 1))
        ends[:, axis] += [-step[axis], step[axis]]
        ends[:, axis] = np.clip(ends[:, axis], low[axis], high[axis])
        gradient = values(fields, i, ends)[:, 1:7]
        found[axis] = (gradient[1] - gradient[0]) / (ends[1, axis] - ends[0, axis])
    return 0.5 * (found + found.T)
