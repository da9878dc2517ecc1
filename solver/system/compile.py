"""Compile a scene: read records, build the arrays of the time loop."""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.stores.folder import Store
from gudgeon.solver.bodies.small_motion import FlexibleBody, load_body
from gudgeon.solver.contact.rows import ContactRows, contact_block, sliding_block
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.gauges import compile_gauges, sides_of
from gudgeon.solver.system.loads import Driving, compile_driving
from gudgeon.solver.system.requirements import Stock, fields_read, scene_terms
from gudgeon.solver.system.springs import compile_springs
from gudgeon.solver.system.system import System


def compile_system(store: Store, scene: Scene, morphs: Mapping[str, str]) -> System:
    """Read what the scene needs and build its system.

    Args:
        morphs: Key of each component's MorphRecord.

    Raises:
        SceneError: an interface or the residual flexibility is missing, or an obstacle does not face its surface.
    """
    keys = {name: morphs[scene.component_of(name)] for name in scene.body}
    asked = scene_terms(scene)  # Of a design that is the same whatever its modes hold.
    designs = {name: store.get(key, "morph", only=fields_read(asked, name, "morph")) for name, key in keys.items()}
    terms = scene_terms(scene, {name: _stock(store, morph.modes_key) for name, morph in designs.items()})
    bodies, offsets, size = {}, {}, 0
    for name, settings in scene.body.items():
        fields = fields_read(terms, name, "modes")
        bodies[name] = load_body(store, name, settings, keys[name], designs[name], fields)
        offsets[name] = size
        size += len(bodies[name].stiffness)
    if not size:
        raise SceneError("body: no body can move, supports and freedom hold all of them; leave a motion free")
    contacts, arrays = _contacts(scene, bodies, offsets, size)
    stiffness = np.concatenate([body.stiffness for body in bodies.values()])
    damping = np.concatenate([np.full(len(body.stiffness), body.stiffness_factor) for body in bodies.values()])
    rigid = np.concatenate([offsets[name] + np.arange(body.rigid_count) for name, body in bodies.items()])
    driving = compile_driving(scene, bodies, offsets, contacts, size)
    position, velocity = _start(scene, bodies, offsets, size)
    loads = driving.begin(bodies, offsets, position, velocity)
    _check_travel(contacts, driving)
    return System(
        scene=scene, bodies=bodies, offsets=offsets, contacts=contacts, stiffness=stiffness, damping=damping,
        rigid=rigid.astype(int), driving=driving, springs=compile_springs(scene, bodies, offsets, size),
        loads=loads, position=position, velocity=velocity, terms=terms, **arrays,
        **compile_gauges(bodies, offsets, contacts, size),
    )  # fmt: skip


def _stock(store: Store, modes_key: str) -> Stock:
    """Return what the modes of a component hold; of their arrays the sizes alone are looked at."""
    # Where there are none, reading them says what is wrong.
    return Stock.of(store.sizes(modes_key)) if store.has(modes_key) else Stock()


def _check_travel(contacts: list[ContactRows], driving: Driving) -> None:
    """Refuse a crank that carries points beyond the traction space that they slide over."""
    for contact in contacts:
        held = next((item for item in driving.joints if item.body == contact.body), None)
        if held is None or (over := contact.master) is None:
            continue
        turn = np.linspace(0.0, 2 * np.pi / held.joint.rate, 721)
        along, _ = held.joint.axes
        way = (held.joint.piston_pin(turn, held.anchor[0])[:, 0] - held.anchor[1]) * float(over.direction @ along)
        low, high = over.height.min() + way.min(), over.height.max() + way.max()
        start, end = over.chart[0], over.chart[0] + over.chart[1] * (over.counts[1] - 3)
        if low < start - 1e-9 or high > end + 1e-9:
            raise SceneError(
                f"contact.{contact.name}: its points travel from {low:.4g} to {high:.4g} m along '{over.interface}',"
                f" which reaches from {start:.4g} to {end:.4g} m; give a longer surface or a shorter stroke"
            )


def _start(
    scene: Scene, bodies: dict[str, FlexibleBody], offsets: dict[str, int], size: int
) -> tuple[np.ndarray, np.ndarray]:
    velocity = np.zeros(size)
    for name, body in bodies.items():
        start = scene.body[name]
        columns = offsets[name] + np.arange(body.rigid_count)
        wanted = np.array([*start.velocity, *start.angular_velocity])
        velocity[columns] = body.rigid_velocity(wanted[:3], wanted[3:])
        lacking = np.abs(body.centre_motion(velocity[columns]) - wanted).reshape(2, 3).max(axis=1)
        for key, missed, part in zip(("velocity", "angular_velocity"), lacking, wanted.reshape(2, 3), strict=True):
            if missed > 1e-6 * np.abs(part).max():
                raise SceneError(
                    f"body.{name}.{key}: {part.tolist()} given, its freedom, supports or inertia do not let it move so"
                )
    return np.zeros(size), velocity


def _contacts(
    scene: Scene, bodies: dict[str, FlexibleBody], offsets: dict[str, int], size: int
) -> tuple[list[ContactRows], dict[str, np.ndarray]]:
    """Put all contacts' blocks into arrays over all coordinates."""
    masters, others = scene.masters(), scene.others()
    blocks = [
        contact_block(scene, name, bodies[contact.body], bodies[others[name].body] if name in others else None)
        for name, contact in scene.contact.items()
    ]
    slides = [
        sliding_block(scene, b.name, b, bodies[masters[b.name].body]) if b.name in masters else None for b in blocks
    ]
    ends = np.cumsum([0, *(len(block.gap) for block in blocks)])
    ends_f = np.cumsum([0, *(len(slide.rows) if slide else 0 for slide in slides)])
    rows, residual = np.zeros((ends[-1], size)), np.zeros((ends[-1], ends[-1]))
    tangents = np.zeros((ends[-1], size))
    functions, function_residual = np.zeros((ends_f[-1], size)), np.zeros((ends_f[-1], ends_f[-1]))
    contacts = []
    for number, (block, slide) in enumerate(zip(blocks, slides, strict=True)):
        here, there = slice(*ends[number : number + 2].tolist()), slice(*ends_f[number : number + 2].tolist())
        _put(rows, here, offsets[block.body], block.rows)
        _put(tangents, here, offsets[block.body], block.surface.tangents)
        if (other := block.other) is not None:
            _put(rows, here, offsets[other.body], other.rows)
            _put(tangents, here, offsets[other.body], other.tangents)
        residual[here, here] = block.residual
        if slide is not None:
            _put(functions, there, offsets[slide.body], slide.rows)
            function_residual[there, there] = slide.residual
        contacts.append(
            ContactRows(
                name=block.name, body=block.body, interface=block.interface, rows=here, points=block.points,
                directions=block.directions, areas=block.areas, edge=block.edge, master=slide, other=block.other,
                functions=there,
            )
        )  # fmt: skip
    _couple(scene, bodies, contacts, residual, function_residual)
    joined = {name: np.concatenate([np.empty(0), *(getattr(block, name) for block in blocks)]) for name in _PER_ROW}
    for name, empty in _PER_SURFACE.items():
        joined[name] = np.concatenate([empty, *(getattr(block.surface, name) for block in blocks)])
    return contacts, joined | {
        "rows": rows, "residual": residual, "functions": functions, "function_residual": function_residual,
        "tangents": tangents,
    }  # fmt: skip


_PER_ROW = ("gap", "layer", "dashpot")


_PER_SURFACE = {"restitution": np.empty(0), "law": np.empty((0, 4)), "friction": np.empty((0, 2)), "belt": np.empty(0)}


def _put(target: np.ndarray, rows: slice, first: int, block: np.ndarray) -> None:
    target[rows, first : first + block.shape[1]] = block


def _couple(
    scene: Scene,
    bodies: dict[str, FlexibleBody],
    contacts: list[ContactRows],
    residual: np.ndarray,
    function_residual: np.ndarray,
) -> None:
    """Fill in R between two interfaces of one body."""
    for one in contacts:
        for other in contacts:
            both = {scene.contact[one.name].method, scene.contact[other.name].method}
            if one is other or both != {"residual"}:
                continue
            for body, interface, order in sides_of(one):
                for same, at, places in sides_of(other):
                    if body == same:
                        block = bodies[body].residual(interface, at)
                        residual[one.rows, other.rows] += block[np.ix_(order, places)]
            if one.master is not None and other.master is not None and one.master.body == other.master.body:
                block = bodies[one.master.body].residual(one.master.interface, other.master.interface)
                ordered = block[np.ix_(one.master.order, other.master.order)]
                function_residual[one.functions, other.functions] = ordered
