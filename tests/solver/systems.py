"""Small records and systems made without gmsh or scikit-fem, for tests of the solver alone."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.modes import InterfaceModes, LoadModes, ModalRecord, MorphRecord, TractionModes
from gudgeon.modaldb.records.tangents import tangents
from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.solver.integrators.implicit.integrator import Implicit
from gudgeon.solver.integrators.outcome import Samples
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System

LENGTH, SPEED, MASS = 1.0, 5000.0, 2.0
SPACING = 0.01
"""Between the knots of the plate's traction space [m]."""
SAG = 2e-5
"""Clearance that gas at the start takes from an elastic piston [m]."""
RADIUS, PIN, CROWN = 0.04, 0.0005, 5e-3
"""Of the piston: radius [m], offset of its pin [m], area of its crown [m²]."""


def rod_records(mode_count: int) -> tuple[ModalRecord, MorphRecord]:
    """A uniform free rod along x by its exact modes, contact at x = LENGTH; R from the series' tail."""
    k = np.arange(1, mode_count + 1)
    omega = np.pi * SPEED / LENGTH * k
    tip = np.sqrt(2 / MASS) * (-1.0) ** k
    total = LENGTH**2 / (3 * MASS * SPEED**2)  # static flexibility of the tip with inertia relief: L / (3 EA)
    residual = total - float((tip**2 / omega**2).sum())
    twist = np.zeros((1, 6))
    twist[0, 0] = 1 / np.sqrt(MASS)
    tip_point, normal = np.array([[LENGTH, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0]])
    centre, inertia = np.array([LENGTH / 2, 0.0, 0.0]), np.diag([0.0, 1.0, 1.0]) * MASS * LENGTH**2 / 12
    modal = ModalRecord(
        "mesh", "macneal", mode_count, 0, omega, MASS, centre, inertia, twist,
        {"tip": InterfaceModes(np.array([1]), tip_point, normal, np.array([1e-4]), np.zeros(1, bool), tip[None])},
        {"tip": [0, 1]}, np.array([[residual]]), None, None, {},
    )  # fmt: skip
    return modal, MorphRecord("mesh", "modes", "none", {"tip": tip_point}, MASS, centre, inertia, twist, None, {})


def block_records(point_count: int, seed: int = 0, mode_count: int = 8) -> tuple[ModalRecord, MorphRecord]:
    """A solid-like body with several coupled contact points facing +x, mass 2 kg, inertia 0.01 kg m²."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([np.full(point_count, 0.05), rng.uniform(-0.04, 0.04, (point_count, 2))])
    normals = np.tile([1.0, 0.0, 0.0], (point_count, 1))
    omega = np.sort(rng.uniform(1e4, 8e4, mode_count))
    rows = rng.standard_normal((point_count, mode_count)) * 0.5
    root = rng.standard_normal((point_count, point_count))
    R = 1e-9 * (root @ root.T / point_count + 0.1 * np.eye(point_count))
    centre, inertia, edge = np.zeros(3), 0.01 * np.eye(3), np.arange(point_count) == 0
    twists = np.diag([1 / np.sqrt(MASS)] * 3 + [10.0] * 3)
    modal = ModalRecord(
        "mesh", "macneal", mode_count, 0, omega, MASS, centre, inertia, twists,
        {"face": InterfaceModes(np.arange(point_count), points, normals, np.full(point_count, 1e-5), edge, rows)},
        {"face": [0, point_count]}, R, None, None, {},
    )  # fmt: skip
    return modal, MorphRecord("mesh", "modes", "none", {"face": points}, MASS, centre, inertia, twists, None, {})


def with_tangential_rows(modal: ModalRecord, name: str, seed: int = 7) -> ModalRecord:
    """Give an interface tangents and tangential rows, and R a positive definite block with all couplings for them."""
    rng, place, first = np.random.default_rng(seed), modal.interfaces[name], modal.row_count
    count = 2 * len(place.nodes)
    R = _coupled(modal, count, rng)
    across = rng.standard_normal((len(place.nodes), 2, len(modal.angular_frequencies)))
    return replace(
        modal,
        interfaces=modal.interfaces
        | {name: replace(place, tangents=tangents(place.normals), tangential_rows=0.3 * across)},
        tangential_spans=modal.tangential_spans | {name: [first, first + count]},
        residual_flexibility=R,
    )


def with_tractions_across(modal: ModalRecord, name: str, seed: int = 9) -> ModalRecord:
    """Give a traction space on a plane the same functions across its normal, and R a block for them."""
    rng, space, first = np.random.default_rng(seed), modal.tractions[name], modal.row_count
    columns, lines = (
        space.start[axis] + (np.arange(space.counts[axis]) - 1) * space.spacing[axis] for axis in range(2)
    )
    across, along = (np.asarray(space.chart[key], float) for key in ("across", "along"))
    at = np.array([np.asarray(space.chart["origin"]) + x * across + y * along for x in columns for y in lines])
    forces = np.stack(
        [np.broadcast_to(one, at.shape) for one in (along, np.cross(space.chart["normal"], along))], axis=1
    )
    rows = 0.3 * rng.standard_normal((space.size, 2, len(modal.angular_frequencies)))
    moments = np.cross(at[:, None], forces)
    wider = replace(space, tangential_rows=rows, tangential_resultant=np.concatenate([forces, moments], axis=2))
    return replace(
        modal,
        tractions=modal.tractions | {name: wider},
        tangential_spans=modal.tangential_spans | {name: [first, first + 2 * space.size]},
        residual_flexibility=_coupled(modal, 2 * space.size, rng),
        gauges={},
    )


def _coupled(modal: ModalRecord, count: int, rng: np.random.Generator) -> np.ndarray | None:
    """Return R with as many further rows, coupled to all others; None where there is none."""
    R, first = modal.residual_flexibility, modal.row_count
    if R is None:
        return None
    lower = np.tril(1e-5 * rng.standard_normal((first + count, first + count)))
    lower[:first, :first] = np.linalg.cholesky(R)
    lower[np.arange(first, first + count), np.arange(first, first + count)] = 3e-5
    wider: np.ndarray = lower @ lower.T
    return wider


def plate_records(
    mode_count: int = 12, *, begin: float = -0.15, length: float = 0.3, free: bool = False, nugget: float = 1e-10
) -> tuple[ModalRecord, MorphRecord]:
    """A plate with a traction space on x = 0, facing -x, along y; its R depends on distances alone.

    Args:
        begin: y of the space's lower end [m].
        length: Of the space [m].
        free: Whether it has rigid motions; mass 3 kg, the centre off the surface.
        nugget: What R has on its diagonal alone [m/N].
    """
    rng, counts = np.random.default_rng(1), np.round(np.array([0.12, length]) / SPACING).astype(int) + 3
    start = np.array([-0.06, begin])
    knots = [start[axis] + (np.arange(counts[axis]) - 1) * SPACING for axis in range(2)]
    centres = np.stack(np.meshgrid(*knots, indexing="ij"), axis=-1).reshape(-1, 2)
    apart = np.linalg.norm(centres[:, None] - centres, axis=2)
    R = 2e-9 * np.exp(-((apart / 0.012) ** 2)) + nugget * np.eye(len(centres))
    omega = np.sort(rng.uniform(5e3, 8e4, mode_count))
    waves = rng.uniform(5, 40, (mode_count, 2))
    rows = 0.5 * np.cos(centres @ waves.T + rng.uniform(0, 6, mode_count))
    chart = {"kind": "plane", "origin": [0.0] * 3, "normal": [-1.0, 0, 0], "across": [0, 0, 1.0], "along": [0, 1.0, 0]}
    outward, arms = np.array([-1.0, 0, 0]), np.column_stack([np.zeros(len(centres)), centres[:, ::-1]])
    resultant = np.column_stack([np.tile(outward, (len(arms), 1)), np.cross(arms, outward)])
    space = TractionModes(chart, start, np.full(2, SPACING), counts, rows, resultant)
    centre, inertia = np.array([0.01, 0.1, 0.0]), np.diag([0.02, 0.01, 0.03])
    twists = np.diag(np.concatenate([np.full(3, 3.0), inertia.diagonal()]) ** -0.5) if free else np.zeros((0, 6))
    modal = ModalRecord(
        "mesh", "macneal", mode_count, 0, omega, 3.0, centre, inertia, twists, {}, {"top": [0, len(centres)]}, R, None,
        None, {}, {"top": space}, {},
    )  # fmt: skip
    return modal, MorphRecord("mesh", "modes", "none", {}, 3.0, centre, inertia, twists, None, {})


def rigid_records(
    mass: float,
    points: dict[str, tuple[Any, Any]],
    inertia: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    axes: tuple[int, ...] = (0, 1, 2),
) -> tuple[ModalRecord, MorphRecord]:
    """A rigid body with its centre at the origin; it turns about axes with inertia alone.

    Args:
        mass: [kg]
        points: Place [m] and outward normal of each interface, (3,) each, or (c, 3) each for c points.
        inertia: Principal moments [kg m²].
        axes: Along which it moves.
    """
    twists = [np.eye(6)[axis] / np.sqrt(mass) for axis in axes]
    twists += [np.eye(6)[3 + axis] / np.sqrt(moment) for axis, moment in enumerate(inertia) if moment > 0]
    interfaces, rows, count = {}, {}, 0
    for name, (place, normal) in points.items():
        at = np.atleast_2d(np.asarray(place, float))
        normals, c = np.broadcast_to(np.asarray(normal, float), at.shape).copy(), len(at)
        interfaces[name] = InterfaceModes(np.arange(c), at, normals, np.ones(c), np.zeros(c, bool), np.zeros((c, 0)))
        rows[name], count = [count, count + c], count + c
    centre, moments, moves = np.zeros(3), np.diag(inertia), np.array(twists)
    modal = ModalRecord(
        "mesh", "rigid", 0, 0, np.zeros(0), mass, centre, moments, moves, interfaces, rows, None, None, None, {}
    )
    places = {name: item.points for name, item in interfaces.items()}
    return modal, MorphRecord("mesh", "modes", "none", places, mass, centre, moments, moves, None, {})


def piston_records(mode_count: int = 0) -> tuple[ModalRecord, MorphRecord]:
    """A piston, crown towards +z: guided at x = ±RADIUS, held at a pin off its centre, pressed on its crown.

    Args:
        mode_count: 0 makes it rigid; otherwise R couples all its rows.
    """
    rng, kilo = np.random.default_rng(4), 0.5
    rows = {"right": [0, 3], "left": [3, 6], "pin": [6, 9], "crown": [9, 10]}
    units = np.append(np.ones(9), CROWN)[:, None]
    shapes, root = 0.5 * units * rng.standard_normal((10, mode_count)), units * rng.standard_normal((10, 10))
    R = 2e-10 * root @ root.T if mode_count else None
    z, guides, points = np.array([-0.02, 0.0, 0.02]), {}, {}
    for name, side in (("right", 1.0), ("left", -1.0)):
        points[name] = np.column_stack([np.full(3, side * RADIUS), np.zeros(3), z])
        guides[name] = InterfaceModes(
            np.arange(3), points[name], np.tile([side, 0.0, 0.0], (3, 1)), np.full(3, 1e-4), np.zeros(3, bool),
            shapes[slice(*rows[name])],
        )  # fmt: skip
    pin, axes, down = np.array([PIN, 0.0, -0.005]), np.eye(3), np.array([[0.0, 0, -CROWN, 0, 0, 0]])
    loads = {
        "pin": LoadModes(shapes[6:9], np.column_stack([axes, np.cross(pin, axes)]), pin, "N"),
        "crown": LoadModes(shapes[9:], down, np.array([0, 0, 0.03]), "Pa"),
    }
    centre, inertia, omega = np.zeros(3), np.diag([4e-4, 3e-4, 4e-4]), np.sort(rng.uniform(2e4, 9e4, mode_count))
    twists = np.diag(np.concatenate([np.full(3, kilo), inertia.diagonal()]) ** -0.5)
    modal = ModalRecord(
        "mesh", "macneal" if mode_count else "rigid", mode_count, 0, omega, kilo, centre, inertia, twists, guides,
        dict(rows), R, None, None, {}, {}, loads,
    )  # fmt: skip
    return modal, MorphRecord("mesh", "modes", "none", points, kilo, centre, inertia, twists, None, {})


def build(folder: Path, records: tuple[ModalRecord, MorphRecord], scene: dict[str, Any]) -> System:
    """Store the records of the only component and compile a scene against them."""
    return build_all(folder, {"part": records}, scene)


def build_all(folder: Path, records: dict[str, tuple[ModalRecord, MorphRecord]], scene: dict[str, Any]) -> System:
    """Store the records of each component and compile a scene against them."""
    return compile_system(stored(folder, records), Scene.model_validate(scene), keys_of(records))


def stored(folder: Path, records: dict[str, tuple[ModalRecord, MorphRecord]]) -> FolderStore:
    """Store the records of each component under the keys that `part_key` returns."""
    store = modaldb.open(folder / "db")
    for name, (modal, morph) in records.items():
        store.put(part_key(name, "modes"), "modes", modal, {"part": name, "kind": "modes"})
        design = replace(morph, modes_key=part_key(name, "modes"))
        store.put(part_key(name, "morph"), "morph", design, {"part": name, "kind": "morph"})
    return store


def part_key(name: str, kind: str) -> str:
    """Return the key of a component's `modes` or `morph` in `stored`."""
    return content_key({"part": name, "kind": kind})


def keys_of(names: Iterable[str]) -> dict[str, str]:
    """Return the key of each component's design in `stored`."""
    return {name: part_key(name, "morph") for name in names}


def arrays(item: Any) -> Iterator[np.ndarray]:
    """Yield every array of a system, bodies' own records aside."""
    if isinstance(item, np.ndarray):
        yield item
    elif is_dataclass(item):
        for entry in fields(item):
            if entry.name not in ("scene", "bodies", "terms"):
                yield from arrays(getattr(item, entry.name))
    elif isinstance(item, list | tuple):
        for one in item:
            yield from arrays(one)


@dataclass(frozen=True)
class March:
    """Every step of the implicit integrator, without a plan of steps; n steps."""

    run: Implicit | Small
    times: np.ndarray
    forces: np.ndarray
    """(n, k, 3)"""
    energies: np.ndarray
    loads: np.ndarray
    snapshots: np.ndarray
    """Rigid coordinates, their rates, length errors, (n, 2 r + j)."""


def march(system: System, dt: float, steps: int, loop: type[Implicit] | type[Small] = Implicit) -> March:
    """Take steps of the implicit integrator by one of its loops."""
    run, driving = loop(system, dt), system.driving
    widths = len(driving.rows), 2 * len(system.rigid) + len(driving.joints)
    forces, energies = np.zeros((steps, max(1, len(system.contacts)), 3)), np.zeros((steps, 5))
    loads, snapshots = (np.zeros((steps, width)) for width in widths)
    assert run.advance(0, 1, Samples(forces, energies, loads, snapshots, np.zeros((steps, 0))))
    return March(run, dt * np.arange(1, steps + 1), forces, energies, loads, snapshots)


def rod_scene(duration: float = 6e-4, checks: bool = False, **contact: Any) -> dict[str, Any]:
    """A rod at 1 m/s against a wall that it touches already."""
    wall = {"shape": "plane", "point": [LENGTH, 0, 0], "normal": [-1, 0, 0]}
    return {
        "body": {"part": {"velocity": [1.0, 0.0, 0.0]}},
        "contact": {"wall": {"body": "part", "interface": "tip", "against": wall} | contact},
        "run": {"duration": duration, "checks": checks},
    }


def block_scene(duration: float = 4e-4, checks: bool = False, **contact: Any) -> dict[str, Any]:
    """A block at 1 m/s, turning a little, 10 µm before a wall."""
    wall = {"shape": "plane", "point": [0.05001, 0, 0], "normal": [-1, 0, 0]}
    return {
        "body": {"part": {"velocity": [1.0, 0.0, 0.0], "angular_velocity": [0.0, 0.5, 1.0]}},
        "contact": {"wall": {"body": "part", "interface": "face", "against": wall} | contact},
        "run": {"duration": duration, "checks": checks},
    }


def pair_scene(speed: float = 10.0, *, press: float = 50.0, duration: float = 4e-3, **run: Any) -> dict[str, Any]:
    """A block 1 µm before the plate, pressed on it by gravity while it slides along y."""
    top = {"shape": "surface", "body": "plate", "interface": "top"}
    part = {"velocity": [0.05, speed, 0], "position": [-0.05 - 1e-6, 0, 0], "freedom": ["x", "y", "rz", "ry"]}
    return {
        "body": {"part": part, "plate": {}},
        "contact": {"slide": {"body": "part", "interface": "face", "against": top, "surface_stiffness": 1e14}},
        "run": {"duration": duration, "checks": False, "gravity": [press, 0, 0]} | run,
    }


def piston_scene(
    *, clearance: float = 0.0, pressure: float = 3e6, start: float = 20.0, duration: float = 5e-3, **run: Any
) -> dict[str, Any]:
    """The piston on a crank that turns towards -x, constant pressure on its crown."""
    sides = {"right": 1.0, "left": -1.0}
    walls = {
        name: {"shape": "plane", "point": [side * (RADIUS + clearance), 0, 0], "normal": [-side, 0, 0]}
        for name, side in sides.items()
    }
    crank = {"crank_radius": 0.04, "rod_length": 0.14, "speed": 3000.0, "start": start, "lateral": [-1, 0, 0]}
    own = {"start": "undeformed"} if clearance < SAG else {}
    gas = {"joint": "rod", "values": [[0, pressure + 1e5], [720, pressure + 1e5]]}
    return {
        "body": {"part": {"freedom": ["x", "z", "ry"]}},
        "contact": {
            name: {"body": "part", "interface": name, "against": wall, "surface_stiffness": 1e12}
            for name, wall in walls.items()
        },
        "joint": {"rod": {"kind": "slider-crank", "body": "part", "interface": "pin"} | crank},
        "force": {"gas": {"kind": "gas", "body": "part", "interface": "crown"} | gas},
        "run": {"duration": duration, "checks": False} | own | run,
    }


def driven_pair_records(mode_count: int = 0) -> dict[str, tuple[ModalRecord, MorphRecord]]:
    """The piston, and a plate that it slides over along z."""
    plate = plate_records()
    plate[0].tractions["top"].chart.update(across=[0, 1.0, 0], along=[0, 0, 1.0])
    return {"part": piston_records(mode_count), "plate": plate}


def driven_pair_scene(**settings: Any) -> dict[str, Any]:
    """The piston's right guide slides over the plate, which begins below it and ends above."""
    scene = piston_scene(**settings)
    scene["body"]["plate"] = {"position": [RADIUS + settings.get("clearance", 0.0), 0, 0.1]}
    scene["contact"]["right"]["against"] = {"shape": "surface", "body": "plate", "interface": "top"}
    return scene
