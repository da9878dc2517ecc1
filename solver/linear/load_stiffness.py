"""Stiffness of the loads at the start: the part of second order of what they do as bodies turn and bend.

A force F at the place r from the centre of mass, whose direction stays, does the work F · ½ θ × (θ × r) of second order
on a rotation θ, so that it has the stiffness

    K_θθ = (F · r) 1 − ½ (F rᵀ + r Fᵀ);

a contact in a bore, whose normal turns as its point slides by s around the axis, f/ρ along s besides, with ρ the
distance from the axis. On an elastic body a force at an interface moves by Ψ q − ½ qᵀ K q, with K by the stress that it
causes (`LoadModes.stress_stiffness`), and weight on supports alike. Forces are those of the static equilibrium at the
start, in which motions, springs, bushings and closed contacts bear loads and weight.

With K₀ the stiffness of bodies and of what holds them, the least eigenvalue μ of (K, K₀) is −1 at the buckling load,
and −1/μ the factor of the loads up to it. K acts as springs of either sign along its eigenvectors; where |μ| is below
`NEGLIGIBLE` and K does not act on what nothing holds, it is left out.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gudgeon.solver.bodies.holding import HELD
from gudgeon.solver.bodies.placing import turned_vectors
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.load_stiffness import LoadStiffness
from gudgeon.solver.linear.left_out import left_out_note, travelling_notes
from gudgeon.solver.linear.modes import free_motions, matrices, undamped
from gudgeon.solver.linear.state import Linearised, linearised
from gudgeon.solver.obstacles.bore import Bore
from gudgeon.solver.ports.members import gauge_ports, start_unknowns
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.compile import assembled
from gudgeon.solver.system.held_damping import with_rows
from gudgeon.solver.system.springs import spring_place
from gudgeon.solver.system.system import System

NEGLIGIBLE = 1e-3
"""Share of the stiffness of what holds a body below which that of its loads changes no figure: half of it in a
frequency."""
ROUND_OFF = 1e-9
"""Share of the stiffness of loads that is round-off on motions that nothing holds."""
KEPT = 1e-7
"""Eigenvalue of the stiffness of loads over the largest below which it is left out."""
MOST_PORTS = 120
"""Closed contact ports of which the stiffness that holds bodies is taken; others would add to it."""
LABEL = "load stiffness of "
"""Beginning of the names of its springs; those of scenes have no blanks."""


@dataclass(frozen=True)
class Acting:
    """A force on a body at a place."""

    body: str
    interface: str | None
    """Interface of an elastic body whose rows it loads; None of a place."""
    rows: np.ndarray
    """Forces on the rows of the interface, (k,)."""
    force: np.ndarray
    """[N], (3,)."""
    place: np.ndarray
    """From the component's origin [m], (3,)."""


def with_load_stiffness(system: System, notes: list[str] | None = None) -> System:
    """Return a system with the stiffness of its loads at the start.

    Args:
        notes: Receives a sentence for each body the stress of whose loads is not known.

    Raises:
        SceneError: the loads buckle a body at the start.
    """
    state = _at_rest(system) if _applies(system) else None
    if state is None:
        if notes is not None:
            notes += travelling_notes(system)
        return system
    scene, state = system.scene, _few(state)
    ports = balanced(state)
    K = {name: np.zeros((len(body.stiffness),) * 2) for name, body in system.bodies.items()}
    for name, body in system.bodies.items():
        if scene.body[name].geometric_stiffness:
            K[name] = stiffness_of(state, body, ports)
    said = list[str]() if notes is None else notes
    significant = _significant(state, K, said)
    said += [note for name, body in system.bodies.items() if (note := _left_out(state, body, ports)) is not None]
    forces, bodies = dict[str, Any](scene.force), dict(system.bodies)
    for name in significant:
        forces[LABEL + name], bodies[name] = _springs(state, bodies[name], K[name])
    scene = scene.model_copy(update={"force": forces})
    if not significant or not _carried(scene, significant, said):
        return system
    return assembled(scene, bodies, system.terms, fields=system.fields, bores=system.bores)


def _carried(scene: Scene, softened: list[str], notes: list[str]) -> bool:
    """Whether an integrator carries a scene with the stiffness of loads; its note says where none does."""
    try:
        return bool(scene.integrator)
    except ValueError:
        names = " and ".join(f"body.{name}" for name in softened)
        notes.append(
            f"run.integrator: '{scene.run.integrator}' carries no softening by loads, and that of {names} is not"
            " included; use 'auto' or 'small'"
        )
        return False


def _applies(system: System) -> bool:
    """Whether anything loads a body at the start in small motion whose stiffness is wanted and not there yet."""
    scene = system.scene
    if scene.capabilities.turns or scene.cranks() or scene.moving():
        return False
    there = any(isinstance(force, LoadStiffness) for force in scene.force.values())
    requested = any(body.geometric_stiffness for body in scene.body.values())
    return requested and not there and _loaded(system)


def _loaded(system: System) -> bool:
    """Whether anything loads a body at the start."""
    stretched = system.springs.stiffness * system.springs.stretch
    return bool(system.driving.gravity.any() or system.loads.any() or stretched.any() or system.start_forces.any())


def _at_rest(system: System) -> Linearised | None:
    """Return the linearised system in equilibrium without velocities; None where it has none."""
    scene = system.scene
    still = {"velocity": (0.0, 0.0, 0.0), "angular_velocity": (0.0, 0.0, 0.0), "velocity_at": None}
    bodies = {name: body.model_copy(update=still) for name, body in scene.body.items()}
    run = scene.run.model_copy(update={"start": "rest"})
    if run == scene.run and bodies == scene.body:
        return linearised(system)
    scene = scene.model_copy(update={"run": run, "body": bodies})
    try:
        return linearised(assembled(scene, system.bodies, system.terms, fields=system.fields, bores=system.bores))
    except SceneError:
        return None  # Loads would press it into an obstacle: it does not start at rest.


def _few(state: Linearised) -> Linearised:
    """Return the state with some of the ports that hold, which hold less."""
    if len(state.holding) <= MOST_PORTS:
        return state
    contacts = state.ports.of(f"contact.{state.system.contacts[-1].name}").stop if state.system.contacts else 0
    touching = np.flatnonzero(state.holding < contacts)
    chosen = (
        touching[np.unique(np.linspace(0, len(touching) - 1, MOST_PORTS).astype(int))] if len(touching) else touching
    )
    rows = np.union1d(chosen, np.flatnonzero(state.holding >= contacts))
    return replace(state, holding=state.holding[rows], stiffness=state.stiffness[rows], damping=state.damping[rows])


def balanced(state: Linearised) -> np.ndarray:
    """Return the forces of all ports at the start with those that bear loads on rigid motions, (p,).

    Contacts bear them in the equilibrium already; what nothing bears accelerates the body.
    """
    system, forces = state.system, start_unknowns(state.system, state.ports)
    rigid = system.rigid
    lacking = (system.driving.gravity + forces @ state.rows)[rigid]
    bears = state.stiffness > 0
    a, S = state.holding[bears], 1 / state.stiffness[bears]
    W, count = state.rows[a], len(a)
    R = state.residual.sum(axis=0)[np.ix_(a, a)]
    C = (W * system.flexibility) @ W.T + 0.5 * (R + R.T) + np.diag(S)
    size = 1 / np.sqrt(np.maximum(C.diagonal(), np.finfo(float).tiny))
    firm = ~(C.diagonal() > 0)
    size[firm] = np.median(size[~firm]) if (~firm).any() else 1.0
    scaled = W[:, rigid] * size[:, None]
    motion = np.linalg.norm(scaled, axis=0)
    motion = 1 / np.where(motion > 0, motion, 1.0)
    matrix = np.zeros((count + len(rigid),) * 2)
    matrix[:count, :count], matrix[:count, count:] = C * np.outer(size, size), scaled * motion
    matrix[count:, :count] = (scaled * motion).T
    right = np.concatenate([np.zeros(count), -lacking * motion])
    answer = np.linalg.lstsq(matrix, right, rcond=1e-13)[0]
    forces[a] += size * answer[:count]
    return forces


def acting(state: Linearised, ports: np.ndarray, name: str) -> Iterator[Acting]:
    """Yield the forces on a body of contacts, loads, motions, springs and bushings."""
    body = state.system.bodies[name]
    yield from _of_contacts(state, ports, name)
    yield from _of_loads(state, ports, body)
    yield from _of_springs(state, ports, body)
    yield from _of_joints(state, ports, body)


def _of_contacts(state: Linearised, ports: np.ndarray, name: str) -> Iterator[Acting]:
    """Yield the forces of contacts on a body."""
    for contact in state.system.contacts:
        span = state.ports.of(f"contact.{contact.name}")
        block = next(b for b in state.ports.blocks if b.name == f"contact.{contact.name}")
        directions = np.zeros((0, 3)) if block.directions is None else block.directions
        each = len(directions) // max(1, len(contact.points))
        pushes = (ports[span, None] * directions).reshape(-1, each, 3).sum(axis=1)
        for owner, _, _, points, sign in contact.sides:
            if owner == name:
                for force, point in zip(sign * pushes, points, strict=True):
                    yield Acting(name, None, np.zeros(0), force, point)


def _of_loads(state: Linearised, ports: np.ndarray, body: FlexibleBody) -> Iterator[Acting]:
    """Yield the forces of loads and motions on a body."""
    scene, driving, name = state.system.scene, state.system.driving, body.name
    for load, _ in [*driving.given_rows(), *driving.driven_rows()]:
        if load.body != name:
            continue
        prefix = "motion" if load in driving.drives else "force"
        forces = ports[state.ports.of(f"{prefix}.{load.name}")]
        settings = scene.motion.get(load.name) if prefix == "motion" else scene.force.get(load.name)
        point = turned_vectors(scene.body[name], getattr(settings, "at", None) or (0.0, 0.0, 0.0))
        position = point if load.interface is None else _place_of(body, load.interface)
        on_rows = forces @ load.mix if load.interface in body.modal.loads else np.zeros(0)
        yield Acting(name, load.interface, on_rows, forces @ load.resultant[:, :3], position)


def _of_springs(state: Linearised, ports: np.ndarray, body: FlexibleBody) -> Iterator[Acting]:
    """Yield the forces of springs and bushings on a body."""
    system, name = state.system, body.name
    scene = system.scene
    for force, ends in zip(scene.springs(), system.springs.ends, strict=True):
        settings, tension = scene.springs()[force], ports[state.ports.of(f"force.{force}")]
        for i, end in enumerate(ends):
            if end.body == name and isinstance(settings.kind, str) and settings.kind in ("spring", "bushing"):
                position = spring_place(scene, force, settings, system.bodies, i) - np.asarray(
                    scene.body[name].position
                )
                end_force = (1 - 2 * i) * tension @ system.springs.motions[system.springs.of(force), :3]
                on_rows = tension @ end.mix if end.interface in body.modal.loads else np.zeros(0)
                yield Acting(name, end.interface, on_rows, end_force, position)


def _of_joints(state: Linearised, ports: np.ndarray, body: FlexibleBody) -> Iterator[Acting]:
    """Yield the forces of the joints that hold a body on the ground."""
    system = state.system
    values = system.gauged(system.position, 0 * system.position) + gauge_ports(system, state.ports) @ ports
    for label, joint in system.scene.held().items() if body.basis is not None else ():
        rows = [i for i, gauge in enumerate(system.gauges) if gauge == f"{body.name}.{HELD}{label}"]
        if joint.body == body.name and joint.interface is not None:
            yield Acting(body.name, joint.interface, values[rows], values[rows][:3], body.morph.centre)


def _place_of(body: FlexibleBody, interface: str) -> np.ndarray:
    """Return the place of an interface of a body from the component's origin [m], (3,)."""
    if interface in body.modal.loads:
        return body.modal.loads[interface].point
    points = body.morph.points.get(interface)
    return body.morph.centre if points is None or not len(points) else points.mean(axis=0)


def stiffness_of(state: Linearised, body: FlexibleBody, ports: np.ndarray) -> np.ndarray:
    """Return K of the loads on a body over its coordinates [rad²/s²], (r + m, r + m)."""
    r, m = body.rigid_count, len(body.modal.angular_frequencies)
    turned = np.zeros((m + 3, r + m))
    turned[:m, r:], turned[m:, :r] = np.eye(m), body.twists[:, 3:].T
    total = np.zeros((m + 3, m + 3))
    for item in acting(state, ports, body.name):
        load = body.modal.loads.get(item.interface or "")
        stress = None if load is None else load.stress_stiffness
        if stress is not None and len(stress) == len(item.rows):
            total += np.einsum("k,kij->ij", item.rows, stress)
        else:
            arm = item.place - body.morph.centre
            both = np.outer(item.force, arm)
            total[m:, m:] += np.trace(both) * np.eye(3) - 0.5 * (both + both.T)
    if body.modal.weight_stiffness is not None:
        total += np.einsum("k,kij->ij", np.asarray(state.system.scene.run.gravity), body.modal.weight_stiffness)
    K = turned.T @ total @ turned
    K[:r, :r] += _of_bores(state, body, ports)
    return 0.5 * (K + K.T)


def _of_bores(state: Linearised, body: FlexibleBody, ports: np.ndarray) -> np.ndarray:
    """Return the stiffness of contacts in bores by their curvature over the rigid coordinates, (r, r)."""
    system, K = state.system, np.zeros((body.rigid_count,) * 2)
    for contact in system.contacts:
        obstacle = system.scene.contact[contact.name].against
        if contact.body != body.name or not isinstance(obstacle, Bore):
            continue
        span = state.ports.of(f"contact.{contact.name}")
        forces = ports[span][:: (span.stop - span.start) // len(contact.points)]
        placed = contact.points + np.asarray(system.scene.body[body.name].position)
        rows = body.rigid_rows(contact.points, obstacle.lateral(contact.directions))
        K += (rows.T * (forces / (obstacle.radius - obstacle.gap(placed)))) @ rows
    return K


def _left_out(state: Linearised, body: FlexibleBody, ports: np.ndarray) -> str | None:
    """Return a sentence where contacts and pressures, whose stress is not known, may soften or stiffen a body."""
    loads = body.modal.loads
    sizes = [float(np.linalg.norm(a.force)) for a in acting(state, ports, body.name)
             if a.interface not in loads or loads[a.interface].stress_stiffness is None]  # fmt: skip
    return left_out_note(state.system, body, max(sizes, default=0.0), "contact forces and pressures")


def _topples(state: Linearised, body: FlexibleBody, K: np.ndarray, free: np.ndarray) -> bool:
    """Whether loads would turn over a body that touches others and that nothing else holds against it.

    Args:
        free: Motions that nothing holds, as columns over all coordinates, (m, f).
    """
    touches = any(body.name == side[0] for contact in state.system.contacts for side in contact.sides)
    moves = free[body.coordinates]
    lowest = float(np.linalg.eigvalsh(moves.T @ K @ moves).min(initial=0.0))
    return touches and lowest < -ROUND_OFF * np.abs(K).max()


def _significant(state: Linearised, K: dict[str, np.ndarray], notes: list[str]) -> list[str]:
    """Return the bodies on which the stiffness of loads counts.

    Args:
        notes: Receives a sentence for each body on which it is left out although it counts.

    Raises:
        SceneError: the loads exceed those up to which bodies are stable.
    """
    system = state.system
    if not any(block.any() for block in K.values()):
        return []
    total = np.zeros((len(system.stiffness),) * 2)
    for name, block in K.items():
        total[system.bodies[name].coordinates, system.bodies[name].coordinates] = block
    F, _, N, _ = matrices(state)
    free = free_motions(state)
    omega, Phi = undamped(F, free)
    loaded = [name for name, block in K.items() if block.any()]
    toppling = [name for name in loaded if _topples(state, system.bodies[name], K[name], N @ Phi[:, :free])]
    for name in toppling:
        total[system.bodies[name].coordinates, system.bodies[name].coordinates] = 0.0
        notes.append(
            f"body.{name}.geometric_stiffness: its contact forces would turn it over at the points that touch, which"
            " nothing else holds; their stiffness is not included"
        )
    loaded = [name for name in loaded if name not in toppling]
    G = Phi.T @ (N.T @ total @ N) @ Phi
    constrained = omega > 0
    scale = np.where(constrained, 1 / np.where(constrained, omega, 1.0), 0.0)
    mu, vectors = np.linalg.eigh(G * np.outer(scale, scale))
    if mu.min(initial=0.0) <= -1:
        shape = np.abs(N @ (Phi @ (scale * vectors[:, 0]))) ** 2
        worst = max(loaded, key=lambda name: float(shape[system.bodies[name].coordinates].sum()))
        raise SceneError(
            f"body.{worst}: it buckles under the loads at the start, load factor {-1 / mu.min():.4g} of them, allowed:"
            f" above 1; reduce them, hold it more stiffly, or set body.{worst}.geometric_stiffness to false"
        )
    loose = np.abs(G[~constrained][:, ~constrained]).max(initial=0.0) > ROUND_OFF * np.abs(total).max()
    if not loose and np.abs(mu).max(initial=0.0) < NEGLIGIBLE:
        return []
    K.update(_without_free(system, {name: K[name] for name in loaded}, N @ Phi[:, :free], loose=loose))
    return loaded


def _without_free(system: System, K: dict[str, np.ndarray], Z: np.ndarray, *, loose: bool) -> dict[str, np.ndarray]:
    """Return K of bodies without its round-off on motions Z that nothing holds, (m, f), and nothing would hold; the
    same where loads act on these motions (`loose`)."""
    if loose:
        return K
    projectors = {}
    for name in K:
        Z_body = Z[system.bodies[name].coordinates]
        projectors[name] = np.eye(len(Z_body)) - Z_body @ np.linalg.pinv(Z_body)
    return {name: projectors[name] @ K[name] @ projectors[name] for name in K}


def _springs(state: Linearised, body: FlexibleBody, K: np.ndarray) -> tuple[LoadStiffness, FlexibleBody]:
    """Return the stiffness of loads on a body as springs along the eigenvectors of K, and the body with their rows."""
    r, columns = body.rigid_count, body.coordinates
    W = state.rows[state.holding][:, columns]
    holds = np.isfinite(state.stiffness) & (state.stiffness > 0)
    size = body.stiffness + (W[holds] ** 2 * state.stiffness[holds, None]).sum(axis=0)
    size = np.sqrt(np.maximum(size, np.abs(K).max(axis=1)))
    size[size == 0] = 1.0
    mu, vectors = np.linalg.eigh(K / np.outer(size, size))
    chosen = np.abs(mu) > KEPT * np.abs(mu).max()
    rows = (size[:, None] * vectors[:, chosen]).T
    norms = np.linalg.norm(rows, axis=1) * np.sqrt(body.morph.mass)
    rows, stiffness = rows / norms[:, None], mu[chosen] * norms**2
    label = LABEL + body.name if len(body.modal.angular_frequencies) else None
    if label is not None:
        nothing = np.zeros((len(rows), body.modal.row_count))
        body = replace(body, modal=with_rows(body.modal, label, rows[:, r:], nothing))
    return LoadStiffness(body.name, label, rows[:, :r], stiffness), body
