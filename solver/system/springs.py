"""Compiled springs and bushings: rows, stiffness and damping, tables, residual flexibility at their interfaces."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gudgeon.solver.bodies.placing import turned_vectors
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.contact.shares import shared
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.forces.dashpots import Dashpots
from gudgeon.solver.forces.load_stiffness import LoadStiffness
from gudgeon.solver.forces.spring import Spring
from gudgeon.solver.methods import METHODS
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.loads import Driving
from gudgeon.solver.vectors import unit

ASIDE = 1e-3
"""Offset of the two ends of a spring across its line over the radius of gyration of its body, from which on the pair of
forces would turn the bodies noticeably."""


class End(NamedTuple):
    """What b rows of elongation are made of on one body with r rigid coordinates."""

    body: str
    rigid: np.ndarray
    """Elongation per rigid coordinate, (b, r)."""
    interface: str | None
    """Interface of an elastic body; None of a point of a rigid one."""
    mix: np.ndarray
    """Elongation per displacement of the k rows of the interface, (b, k)."""


@dataclass(frozen=True)
class Springs:
    """Springs between bodies and to the ground, b rows; a bushing has several."""

    names: list[str]
    """Name of the force of each row."""
    motions: np.ndarray
    """Elongation of each row per translation of the body's end along x, y, z and rotation about them, (b, 6)."""
    ends: list[tuple[End, ...]]
    """Of each force."""
    rows: np.ndarray
    """Elongation per coordinate, (b, m)."""
    stiffness: np.ndarray
    """[N/m]; of a table its largest, (b,)."""
    damping: np.ndarray
    """[N s/m], (b,)"""
    stretch: np.ndarray
    """Elongation at q = 0 [m], (b,)."""
    knots: dict[int, np.ndarray]
    """Elongation [m] and tension [N] of the rows with a table, (knots, 2)."""
    residual: np.ndarray
    """R among the springs [m/N], (b, b)."""
    to_gap: np.ndarray
    """Change of the gaps per force on a spring's row by R [m/N], (c, b)."""
    to_loads: np.ndarray
    """Elongation per load by R [m/N], (b, L)."""

    def of(self, name: str) -> slice:
        """Return the rows of a force."""
        start = self.names.index(name)
        return slice(start, start + self.names.count(name))

    def tension(self, elongation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return tension [N] and stiffness [N/m] of all rows at elongations [m], (b,) each."""
        force, slope = self.stiffness * elongation, self.stiffness.copy()
        for row, knots in self.knots.items():
            piece = int(np.clip(np.searchsorted(knots[:, 0], elongation[row], side="right") - 1, 0, len(knots) - 2))
            slope[row] = np.diff(knots[piece : piece + 2, 1])[0] / np.diff(knots[piece : piece + 2, 0])[0]
            force[row] = knots[piece, 1] + slope[row] * (elongation[row] - knots[piece, 0])
        return force, slope

    def energy(self, elongation: np.ndarray) -> float:
        """Return what all rows store at elongations [J], (b,), from zero elongation on."""
        linear = np.setdiff1d(np.arange(len(elongation)), list(self.knots))
        total = 0.5 * float(self.stiffness[linear] @ elongation[linear] ** 2)
        for row in self.knots:
            (low, high), knots = sorted((0.0, float(elongation[row]))), self.knots[row][:, 0]
            elongations = np.concatenate([[low], knots[(knots > low) & (knots < high)], [high]])
            tension = np.array(
                [self.tension(np.where(np.arange(len(elongation)) == row, x, 0.0))[0][row] for x in elongations]
            )
            total += (
                0.5
                * float(np.diff(elongations) @ (tension[1:] + tension[:-1]))
                * (1.0 if elongation[row] >= 0 else -1.0)
            )
        return total

    def softened(self) -> np.ndarray:
        """Return the stiffness of the rows in series with R, (b, b)."""
        return np.linalg.solve(np.eye(len(self.stiffness)) + self.stiffness[:, None] * self.residual,
                               np.diag(self.stiffness))  # fmt: skip


def compile_springs(
    scene: Scene, bodies: dict[str, FlexibleBody], contacts: list[ContactRows], driving: Driving, size: int
) -> Springs:
    """Build the springs of a scene.

    Raises:
        SceneError: a spring acts on an elastic body without an interface, an interface does not have its directions, or
            no motion changes its length.
    """
    names, ends, row_values, knots, motions = [], [], [np.zeros((3, 0))], {}, [np.zeros((0, 6))]
    for name, force in scene.springs().items():
        both, moved, (stiffness, damping, stretch) = spring_ends(scene, name, force, bodies)
        motions.append(moved)
        if isinstance(force, Spring) and force.tabled:
            knots[len(names)] = np.array(force.values, float) + np.array([0.0, force.preload])
        names += [name] * len(stiffness)
        ends.append(both)
        row_values.append(np.stack([stiffness, damping, stretch]))
    rows, start = np.zeros((len(names), size)), 0
    owners: list[tuple[slice, End]] = []
    for both in ends:
        span = slice(start, start + len(both[0].rigid))
        start = span.stop
        for end in both:
            body = bodies[end.body]
            rows[span, body.rigid] += end.rigid
            if end.interface is not None:
                rows[span, body.elastic] += end.mix @ _elastic(body, end.interface)
                owners.append((span, end))
    immovable = [name for name in scene.springs() if not np.any(rows[[n == name for n in names]])]
    if immovable:
        key = ".direction" if scene.springs()[immovable[0]].kind == "spring" else ""
        raise SceneError(f"force.{immovable[0]}{key}: the body cannot move along it")
    residual, to_gap, to_loads = _shared(scene, bodies, contacts, driving, owners, len(names))
    stiffness, damping, stretch = np.concatenate(row_values, axis=1)
    return Springs(
        names, np.vstack(motions), ends, rows, stiffness=stiffness, damping=damping, stretch=stretch, knots=knots,
        residual=residual, to_gap=to_gap, to_loads=to_loads,
    )  # fmt: skip


def _shared(
    scene: Scene,
    bodies: dict[str, FlexibleBody],
    contacts: list[ContactRows],
    driving: Driving,
    owners: list[tuple[slice, End]],
    count: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return R among springs, (b, b), of gaps by springs, (c, b), and of springs by loads, (b, L) [m/N]."""
    residual = np.zeros((count, count))
    to_gap = np.zeros((sum(len(contact.points) for contact in contacts), count))
    to_loads = np.zeros((count, len(driving.rows)))
    for span, end in owners:
        for there, partner in owners:
            if end.body == partner.body and end.interface is not None and partner.interface is not None:
                block = bodies[end.body].residual(end.interface, partner.interface)
                residual[span, there] += end.mix @ block @ partner.mix.T
        for body, interface, mix, there in driving.places():
            if body == end.body and end.interface is not None and interface is not None:
                to_loads[span, there] += end.mix @ bodies[body].residual(end.interface, interface) @ mix.T
        for contact in contacts:
            if METHODS[scene.contact[contact.name].method].flexible:
                for body, interface, point_weights, *_ in contact.sides:
                    if body == end.body and end.interface is not None:
                        block = shared(point_weights, bodies[body].residual(interface, end.interface))
                        # A contact force acts against the outward normal, R's rows along it.
                        to_gap[contact.rows, span] -= block @ end.mix.T
    return residual, to_gap, to_loads


def spring_ends(
    scene: Scene, name: str, force: Spring | Bushing | Dashpots | LoadStiffness, bodies: Mapping[str, FlexibleBody]
) -> tuple[tuple[End, ...], np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return a force's ends, the motions that it resists, (b, 6), and stiffness, damping and stretch of its rows."""
    if isinstance(force, LoadStiffness):
        count = len(force.stiffness)
        mix = np.eye(count) if force.elastic else np.empty((count, 0))
        end, zeros = End(force.body, force.rigid, force.interface, mix), np.zeros(count)
        return (end,), np.zeros((count, 6)), (force.stiffness, zeros, zeros)
    if isinstance(force, Dashpots):
        rigid, zeros = np.zeros((force.count, bodies[force.body].rigid_count)), np.zeros(force.count)
        end = End(force.body, rigid, force.interface, np.eye(force.count))
        return (end,), np.zeros((force.count, 6)), (zeros, np.ones(force.count), zeros)
    positions = [spring_place(scene, name, force, bodies, i) for i in range(2 if force.against else 1)]
    if isinstance(force, Bushing):
        motions, stiffness, damping = force.parts()
        _refuse_apart(name, positions, bodies[force.body], None)
        values = stiffness, damping, np.zeros(len(stiffness))
    else:
        line = _line(name, force, bodies, positions)
        motions = np.concatenate([line, np.zeros(3)])[None]
        stiffness = force.stiffness or 0.0
        stretch = force.stretch + (force.preload / stiffness if stiffness else 0.0)
        if force.tabled:
            knots = np.array(force.values, float)
            stiffness = float((np.diff(knots[:, 1]) / np.diff(knots[:, 0])).max())
        values = np.array([stiffness]), np.array([force.damping]), np.array([stretch])
    ends = [_end(scene, name, motions, (bodies[force.body], force.interface), positions[0])]
    if force.against is not None:
        far_end = (bodies[force.against], force.against_interface)
        ends.append(_end(scene, name, -motions, far_end, positions[-1]))
    return tuple(ends), motions, values


def spring_place(
    scene: Scene, name: str, force: Spring | Bushing, bodies: Mapping[str, FlexibleBody], end: int
) -> np.ndarray:
    """Return where an end of a force is [m], (3,); without an interface the second end is where the first one is."""
    body, interface = ((force.body, force.interface), (force.against, force.against_interface))[end]
    if interface is None or body is None:
        if end == 1:
            return spring_place(scene, name, force, bodies, 0)
        return np.asarray(scene.body[force.body].position) + turned_vectors(scene.body[force.body], force.at)
    modal, key = bodies[body].modal, "against_interface" if end else "interface"
    if interface in modal.loads:
        return modal.loads[interface].point + np.asarray(scene.body[body].position)
    points = bodies[body].morph.points.get(interface)
    if points is None:
        have = ", ".join([*modal.loads, *modal.interfaces]) or "none"
        raise SceneError(
            f"force.{name}.{key}: body '{body}' has no interface '{interface}' for a spring, it has {have}"
        )
    if len(points) != 1:
        raise SceneError(
            f"force.{name}.{key}: '{interface}' has {len(points)} contact points, a spring acts on a single one; use an"
            " interface of kind 'mean'"
        )
    return points[0] + np.asarray(scene.body[body].position)


def _line(name: str, force: Spring, bodies: Mapping[str, FlexibleBody], positions: list[np.ndarray]) -> np.ndarray:
    """Return the unit vector along which a spring elongates when its body moves, (3,)."""
    modal = bodies[force.body].modal
    if force.direction is not None:
        line = unit(force.direction)
        _refuse_apart(name, positions, bodies[force.body], line)
        return line
    offset = positions[0] - positions[-1]
    if np.linalg.norm(offset) > ASIDE * bodies[force.body].gyration:
        return unit(offset)
    if force.interface in modal.interfaces:
        return bodies[force.body].outward(force.interface)[0]
    raise SceneError(f"force.{name}.direction: it is needed, since its ends do not give a line")


def _refuse_apart(name: str, positions: list[np.ndarray], body: FlexibleBody, line: np.ndarray | None) -> None:
    """Raise a SceneError where the ends of a force are apart, across its line if there is one."""
    offset = positions[0] - positions[-1]
    across = offset if line is None else offset - (offset @ line) * line
    if np.linalg.norm(across) > ASIDE * body.gyration:
        remedy = (
            "a bushing acts at one point" if line is None else "leave out direction, which is then the line of them"
        )
        key = "against_interface" if line is None else "direction"
        beside = "" if line is None else " across the direction"
        raise SceneError(
            f"force.{name}.{key}: its ends are {np.linalg.norm(across):.3g} m apart{beside}, so that its forces would"
            f" turn the bodies; {remedy}"
        )


def _end(
    scene: Scene, name: str, motions: np.ndarray, owner: tuple[FlexibleBody, str | None], position: np.ndarray
) -> End:
    """Return one end of a force whose elongations are motions of a place, translations then rotations, (b, 6)."""
    body, interface = owner
    point = position - np.asarray(scene.body[body.name].position)
    if interface is None:
        if len(body.modal.angular_frequencies):
            raise SceneError(
                f"force.{name}: body '{body.name}' is elastic; name an interface of its component, of kind 'mean' or of"
                " a single point"
            )
        moment = np.cross(point, motions[:, :3]) + motions[:, 3:]
        return End(body.name, body.wrench_rows(np.column_stack([motions[:, :3], moment])), None, np.empty((0, 0)))
    if interface in body.modal.loads:
        load = body.modal.loads[interface]
        if len(load.rows) not in (3, 6):
            raise SceneError(f"force.{name}: '{interface}' is of kind 'pressure'; kind 'mean' or 'tie' is needed")
        if len(load.rows) == 3 and motions[:, 3:].any():
            raise SceneError(f"force.{name}: '{interface}' is of kind 'mean', which has no rotations; use kind 'tie'")
        mix = motions[:, : len(load.rows)]
        return End(body.name, body.wrench_rows(mix @ load.resultant), interface, mix)
    normal = body.outward(interface)[0]
    along = motions[:, :3] @ normal
    if motions[:, 3:].any() or (np.abs(motions[:, :3] - along[:, None] * normal) > ASIDE).any():
        raise SceneError(
            f"force.{name}.direction: the contact point '{interface}' has its normal {np.round(normal, 6).tolist()}"
            " alone; use this direction, or an interface of kind 'mean'"
        )
    rows = body.rigid_rows(np.repeat(point[None], len(motions), axis=0), along[:, None] * normal)
    return End(body.name, rows, interface, along[:, None])


def _elastic(body: FlexibleBody, interface: str) -> np.ndarray:
    """Return the rows of an interface over the elastic coordinates, (k, m)."""
    interfaces = body.modal.loads if interface in body.modal.loads else body.modal.interfaces
    return interfaces[interface].rows
