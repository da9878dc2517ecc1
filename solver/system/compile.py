"""Compile a scene: read records, build the arrays of the time loop."""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from itertools import permutations
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.modaldb.errors import RecordMismatch
from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.modaldb.stores.base import Store
from gudgeon.solver.bodies.holding import held_body
from gudgeon.solver.bodies.placing import rotation, turned_design, turned_modes, turned_vectors
from gudgeon.solver.bodies.slanting import along_obstacles
from gudgeon.solver.bodies.small_motion import FlexibleBody, free_twists
from gudgeon.solver.contact.blocks import summed
from gudgeon.solver.contact.bores import ElasticBore, read_bores
from gudgeon.solver.contact.rows import (
    PER_ROW,
    ContactBlock,
    ContactPoints,
    ContactRows,
    SlidingBlock,
    contact_block,
    sliding_block,
)
from gudgeon.solver.contact.shares import shared_twice
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.fields.co_energy import joined
from gudgeon.solver.methods import METHODS
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.drives import begin_velocities
from gudgeon.solver.system.equilibrium import settled
from gudgeon.solver.system.fields.reading import Fields, read_fields
from gudgeon.solver.system.friction import refuse_motion_across
from gudgeon.solver.system.gauges import compile_gauges
from gudgeon.solver.system.held import begin_driven, held_statics
from gudgeon.solver.system.held_damping import damped_as_held
from gudgeon.solver.system.loads import Driving, compile_driving
from gudgeon.solver.system.probes import compile_probes
from gudgeon.solver.system.springs import compile_springs
from gudgeon.solver.system.system import System
from gudgeon.solver.system.terms.scene_terms import scene_terms
from gudgeon.solver.system.terms.term import Stock, Term, fields_read


def compile_system(store: Store, scene: Scene, morphs: Mapping[str, str]) -> System:
    """Read the records that a scene needs, and return its equations of motion.

    >>> import gudgeon
    >>> coarse = {"component.rod.mesh.size": 0.1, "component.rod.modes.normal_count": 3}
    >>> scene = gudgeon.Scene.from_file(gudgeon.example("rod-wall"), set=coarse)
    >>> report = gudgeon.run(scene, until="morph")
    >>> system = gudgeon.compile_system(gudgeon.open(), scene, report.stages["morph"].keys)
    >>> list(system.bodies), [contact.name for contact in system.contacts]
    (['rod'], ['wall'])

    Args:
        morphs: Key of each component's MorphRecord.

    Raises:
        SceneError: a component has no key, an interface or the residual flexibility is missing, an obstacle does not
            face its surface, points start inside of it, or one moves across its line of friction.
        ModalDBError: a record is missing or cannot be used, or a design does not fit its modes.
    """
    used = {scene.component_of(name) for name in scene.body} | set(scene.bearings().values())
    if missing := used - morphs.keys():
        names = ", ".join(morphs) or "none"
        raise SceneError(f"morphs: no key for component '{min(missing)}'; keys are given for: {names}")
    keys = {name: morphs[scene.component_of(name)] for name in scene.body}
    possible = scene_terms(scene)  # What is read of a design does not depend on what its modes have.
    designs = {name: store.get(key, "morph", only=fields_read(possible, name, "morph")) for name, key in keys.items()}
    # Without modes, reading them raises the error that says so.
    modes = {name: morph.modes_key for name, morph in designs.items()}
    stocks = {name: Stock.of(store.sizes(key)) if store.has(key) else Stock() for name, key in modes.items()}
    terms, bodies, size, interfaces = scene_terms(scene, stocks), {}, 0, scene.held()
    for name, settings in scene.body.items():
        Q = rotation(settings)
        modal = turned_modes(_checked_modes(store, name, designs[name], fields_read(terms, name, "modes")), Q)
        design = turned_design(designs[name], Q)
        twists = free_twists(design, settings, name)
        body = FlexibleBody(name, keys[name], design, modal, twists, settings.damping, first=size)
        joints = {joint: j.interface for joint, j in interfaces.items() if j.body == name and j.interface is not None}
        bodies[name] = held_body(body, joints) if joints else body
        size = bodies[name].elastic.stop
    if not size:
        raise SceneError(
            "body: all rigid motions are fixed by supports and freedom, and no body is elastic; release at least one"
            " motion"
        )
    bores = read_bores(store, scene, morphs)
    bodies = along_obstacles(scene, bodies)
    scene, bodies = damped_as_held(scene, bodies)
    return assembled(scene, bodies, terms, fields=read_fields(store, scene, bodies), bores=bores)


def _checked_modes(store: Store, name: str, design: MorphRecord, only: list[str]) -> ModalRecord:
    """Return the modes of a body's design; raise a RecordMismatch where the design does not fit them."""
    modal: ModalRecord = store.get(design.modes_key, "modes", only=only)
    for interface, interface_modes in modal.interfaces.items():
        count, points = max(len(interface_modes.rows), len(interface_modes.normals)), design.points.get(interface)
        if count and (points is None or len(points) not in (0, count)):
            there = "no" if points is None else len(points)
            raise RecordMismatch(
                f"body {name}: interface {interface}: {there} points in its design, {count} in its modes"
            )
    return modal


def assembled(
    scene: Scene,
    bodies: dict[str, FlexibleBody],
    terms: list[Term],
    *,
    sag: np.ndarray | None = None,
    fields: Fields | None = None,
    bores: dict[str, ElasticBore] | None = None,
) -> System:
    """Build the system of bodies whose records have been read, one after the other in the coordinates.

    Args:
        sag: Change of the gaps by what the bodies' coordinates do not contain [m], (c,).
        fields: Those of the scene; default: none.
        bores: Of its elastic bearings, by joint; default: none.

    Raises:
        SceneError: as `compile_system`.
    """
    size, full_scene = max(body.elastic.stop for body in bodies.values()), scene
    if scene.capabilities.turns:
        # Its joints, forces and probes turn with the bodies: the integrator builds them.
        scene = scene.model_copy(update={"joint": {}, "force": {}, "probe": {}})
    contacts, arrays = _contacts(full_scene, bodies, size)
    sag = np.zeros(len(arrays["gap"])) if sag is None else sag
    arrays["gap"] = arrays["gap"] + sag
    driving = compile_driving(scene, bodies, contacts, size)
    position, velocity = np.zeros(size), _start(scene, bodies, size)
    loads = driving.begin(bodies, position, velocity, deformed=scene.run.start == "rest")
    begin_velocities(scene, bodies, list(driving.driven_rows()), driving.rows, velocity)
    stiffness = np.concatenate([body.stiffness for body in bodies.values()])
    rigid = np.concatenate([np.arange(size)[body.rigid] for body in bodies.values()])
    statics = held_statics(driving, stiffness, rigid, deforms=scene.run.start == "rest")
    begin_driven(driving, statics, position, loads)
    _check_travel(contacts, driving)
    springs = compile_springs(scene, bodies, contacts, driving, size)
    system = System(
        scene=full_scene, bodies=bodies, contacts=contacts, sag=sag,
        stiffness=stiffness,
        damping=np.concatenate([body.damping_rates for body in bodies.values()]),
        rigid=rigid,
        driving=driving, springs=springs, loads=loads, position=position,
        velocity=velocity, start_forces=np.zeros(len(arrays["gap"])), start_pulls=np.zeros(len(springs.stiffness)),
        start_friction=np.zeros((len(arrays["gap"]), 2)), start_stretch=np.zeros((len(arrays["gap"]), 2)),
        overlaps=np.zeros(len(arrays["gap"]), np.bool_),
        fields=Fields([], joined([])) if fields is None else fields, bores=bores or {},
        terms=terms, probes=compile_probes(scene, bodies, contacts, springs, size), **arrays,
        **compile_gauges(bodies, contacts, size, scene.run.gravity),
    )  # fmt: skip
    if full_scene.capabilities.turns:
        return system
    refuse_motion_across(system)
    return settled(system, statics)


def _check_travel(contacts: list[ContactRows], driving: Driving) -> None:
    """Raise a SceneError where a crank moves points beyond the traction space over which they slide."""
    for contact in contacts:
        joint_point = next((item for item in driving.joints if item.joint.body == contact.body), None)
        if joint_point is None or (surface := contact.master) is None:
            continue
        path = (joint_point.turn() - joint_point.anchor[1]) * float(surface.direction @ joint_point.joint.axes[0])
        low, high = surface.height.min() + path.min(), surface.height.max() + path.max()
        start, end = surface.chart[0], surface.chart[0] + surface.chart[1] * (surface.counts[1] - 3)
        if low < start - 1e-9 or high > end + 1e-9:
            raise SceneError(
                f"contact.{contact.name}: its points travel from {low:.4g} to {high:.4g} m along '{surface.interface}',"
                f" which reaches from {start:.4g} to {end:.4g} m; use a longer surface or a shorter stroke"
            )


def _start(scene: Scene, bodies: dict[str, FlexibleBody], size: int) -> np.ndarray:
    """Return the velocities of all coordinates at the start, (size,)."""
    velocity = np.zeros(size)
    for name, body in bodies.items():
        start = scene.body[name]
        target = np.array([*start.velocity, *start.angular_velocity])
        if start.velocity_at is not None:
            arm = body.morph.centre - turned_vectors(start, start.velocity_at)
            target[:3] += np.cross(target[3:], arm)
        velocity[body.rigid] = body.rigid_velocity(target[:3], target[3:])
        lacking = np.abs(body.centre_motion(velocity[body.rigid]) - target).reshape(2, 3).max(axis=1)
        radius = np.sqrt(np.trace(body.morph.inertia) / body.morph.mass)
        sizes = (
            np.abs(np.array([target, [*start.velocity, *start.angular_velocity]])).max(axis=0).reshape(2, 3).max(axis=1)
        )
        # Round-off of one motion is in the other, too, by the radius of gyration.
        allowed = 1e-6 * sizes + 1e-9 * sizes[::-1] * np.array([radius, 1 / radius if radius > 0 else 0.0])
        for key, missed, limit in zip(("velocity", "angular_velocity"), lacking, allowed, strict=True):
            if missed > limit:
                raise SceneError(
                    f"body.{name}.{key}: {list(getattr(start, key))} given, but its freedom, supports or inertia do not"
                    " allow this motion"
                )
    return velocity


def _contact_blocks(
    scene: Scene, bodies: dict[str, FlexibleBody]
) -> tuple[list[ContactBlock], list[SlidingBlock | None]]:
    """Return the rows of each contact on its bodies, and those over a traction space that its points slide over."""
    others = scene.others()
    masters = {} if scene.capabilities.turns else scene.masters()
    blocks = [
        contact_block(scene, name, bodies[contact.body], bodies[others[name].body] if name in others else None)
        for name, contact in scene.contact.items()
    ]
    slides = [
        sliding_block(scene, b.name, b, bodies[masters[b.name].body]) if b.name in masters else None for b in blocks
    ]
    return blocks, slides


def _contacts(scene: Scene, bodies: dict[str, FlexibleBody], size: int) -> tuple[list[ContactRows], dict[str, Any]]:
    """Return the contacts, and their rows and residuals as arrays of the system."""
    blocks, slides = _contact_blocks(scene, bodies)
    ends = np.cumsum([0, *(len(block.rows) for block in blocks)])
    ends_f = np.cumsum([0, *(len(slide.rows) if slide else 0 for slide in slides)])
    rows, tangents, functions, contacts = list[Part](), list[Part](), list[Part](), list[ContactRows]()
    for i, (block, slide) in enumerate(zip(blocks, slides, strict=True)):
        span, there = slice(*ends[i : i + 2].tolist()), slice(*ends_f[i : i + 2].tolist())
        for side in (block, block.other):
            if side is not None:
                rows.append((span, bodies[side.body].coordinates, side.rows))
                tangents.append((span, bodies[side.body].coordinates, side.tangents))
        if slide is not None:
            functions.append((there, bodies[slide.body].coordinates, slide.rows))
        shared = {entry.name: getattr(block, entry.name) for entry in fields(ContactPoints)}
        contacts.append(ContactRows(**shared, rows=span, master=slide, functions=there))
    c, f = int(ends[-1]), int(ends_f[-1])
    own_residuals = [
        (contact.rows, contact.rows, block.residual) for contact, block in zip(contacts, blocks, strict=True)
    ]
    return contacts, {
        name: np.concatenate([np.empty((0, *shape)), *(block.per_row[name] for block in blocks)])
        for name, shape in PER_ROW.items()
    } | {
        "rows": summed((c, size), rows), "functions": summed((f, size), functions),
        "tangents": summed((c, size), (t for t in tangents if t[2].any())),
        "residual": summed((c, c), [*own_residuals, *_between_contacts(scene, bodies, contacts)]),
        "function_residual": summed((f, f), _between_functions(scene, bodies, contacts)),
    }  # fmt: skip


Part = tuple[slice, slice, np.ndarray]
"""Rows, columns and values of a block that is added."""


def _between_contacts(scene: Scene, bodies: dict[str, FlexibleBody], contacts: list[ContactRows]) -> Iterator[Part]:
    """Yield R between the points of different contacts on one body."""
    on = dict[str, list[tuple[ContactRows, str, sparse.csr_matrix]]]()
    for contact in contacts:
        if METHODS[scene.contact[contact.name].method].flexible:
            for body, interface, weights, *_ in contact.sides:
                on.setdefault(body, []).append((contact, interface, weights))
    for body, sides in on.items():
        for (contact, interface, weights), (partner, partner_interface, there) in permutations(sides, 2):
            if contact is not partner:
                R = bodies[body].residual(interface, partner_interface)
                yield contact.rows, partner.rows, shared_twice(weights, R, there)


def _between_functions(scene: Scene, bodies: dict[str, FlexibleBody], contacts: list[ContactRows]) -> Iterator[Part]:
    """Yield R of the traction spaces: of each contact's own, and between those of different ones on one body."""
    slides = [(c, c.master) for c in contacts if c.master is not None]
    yield from ((c.functions, c.functions, master.residual) for c, master in slides)
    flexible = [(c, master) for c, master in slides if METHODS[scene.contact[c.name].method].flexible]
    for (slider, near_master), (partner, master) in permutations(flexible, 2):
        if near_master.body == master.body:
            block = bodies[near_master.body].residual(near_master.interface, master.interface)
            yield slider.functions, partner.functions, block[np.ix_(near_master.order, master.order)]
