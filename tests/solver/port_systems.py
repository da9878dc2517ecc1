"""Systems of many ports made in code: two elastic blocks that face each other, and chains of bars.

The residual flexibility of a block is that of a half-space at the patches of its points (Boussinesq and Cerruti; K. L.
Johnson, Contact Mechanics, 1985, section 3.2 and 3.6), with all three directions; its modes are waves over the face.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from gudgeon.modaldb.records.modes import InterfaceModes, ModalRecord, MorphRecord
from gudgeon.solver.contact.blocks import summed
from gudgeon.solver.ports.members import ports_of
from gudgeon.solver.ports.table import Kind, Ports
from gudgeon.solver.system.system import System
from tests.solver.systems import build_all, with_tangential_rows

SHEAR, POISSON, MASS = 8e10, 0.3, 2.0
STIFFER = 0.3
"""Flexibility of the second block over that of the first, with friction."""
SPACING = 0.005
"""Between points [m]."""
SPEED, LENGTH = 5000.0, 0.1
"""Of waves [m/s], and of each bar of a chain [m]."""
BARS_MASS = 1.0


def grid(count: int) -> np.ndarray:
    """Return the places of some points of a face, nearest to its middle first [m], (count, 2)."""
    side = np.arange(-30, 31) * SPACING
    found = np.stack(np.meshgrid(side, side * 1.0001, indexing="ij"), axis=-1).reshape(-1, 2)
    return found[np.argsort(np.linalg.norm(found, axis=1), kind="stable")[:count]]


def half_space(places: np.ndarray) -> np.ndarray:
    """Return the flexibility of a half-space at square patches along its inward normal and both tangents [m/N].

    Args:
        places: (n, 2).

    Returns:
        By point and direction, (n, 3, n, 3).
    """
    n, apart = len(places), places[:, None] - places
    r = np.linalg.norm(apart, axis=2) + np.eye(n)
    own = SPACING / 3.525  # The mean of 1/r over a square is 3.525 over its side.
    inverse = np.where(np.eye(n, dtype=bool), 1 / own, 1 / r)
    x, y = (np.where(np.eye(n, dtype=bool), 0.0, apart[..., axis] / r) for axis in range(2))
    half = np.eye(n) * 0.5
    found = np.zeros((n, 3, n, 3))
    found[:, 0, :, 0] = 2 * (1 - POISSON) * inverse
    found[:, 1, :, 1] = 2 * (1 - POISSON + POISSON * (x * x + half)) * inverse
    found[:, 2, :, 2] = 2 * (1 - POISSON + POISSON * (y * y + half)) * inverse
    found[:, 1, :, 2] = found[:, 2, :, 1] = 2 * POISSON * x * y * inverse
    for axis, part in ((1, x), (2, y)):
        found[:, 0, :, axis] = -(1 - 2 * POISSON) * part * inverse
        found[:, axis, :, 0] = (1 - 2 * POISSON) * part * inverse
    return found / (4 * np.pi * SHEAR)


def _waves(places: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Return the displacement of points along three directions by some modes [kg^-½], (n, 3, count)."""
    rng = np.random.default_rng(seed)
    waves, phase = rng.uniform(-60, 60, (count, 2)), rng.uniform(0, 6, (3, count))
    return np.cos((places @ waves.T)[:, None] + phase) * rng.uniform(0.1, 1.0, (3, count))


def block(count: int, modes: int, facing: float, bulge: float, seed: int) -> tuple[ModalRecord, MorphRecord]:
    """Return a block whose face at x = 0 has some points and a paraboloid's shape.

    Args:
        facing: Sign of the face's normal along x.
        bulge: Curvature of the face [1/m].
    """
    places, rng = grid(count), np.random.default_rng(seed)
    height = -facing * 0.5 * bulge * (places**2).sum(axis=1)
    points, normals = np.column_stack([height, places]), np.tile([facing, 0.0, 0.0], (count, 1))
    omega = np.sort(rng.uniform(2e4, 2e5, modes))
    rows = _waves(places, modes, seed)[:, 0]
    R = half_space(places)[:, 0, :, 0]
    centre, inertia = np.array([-facing * 0.05, 0.0, 0.0]), 0.02 * np.eye(3)
    twists = np.diag([MASS**-0.5] * 3 + [0.02**-0.5] * 3)
    face = InterfaceModes(np.arange(count), points, normals, np.full(count, SPACING**2), np.zeros(count, bool), rows)
    modal = ModalRecord(
        "mesh", "macneal", modes, 0, omega, MASS, centre, inertia, twists, {"face": face}, {"face": [0, count]}, R,
        None, None, {},
    )  # fmt: skip
    return modal, MorphRecord("mesh", "modes", "none", {"face": points}, MASS, centre, inertia, twists, None, {})


def pair(
    folder: Path,
    count: int,
    modes: int = 60,
    *,
    bulge: float = 0.0,
    friction: float = 0.0,
    speed: float = 1.0,
    damping: float = 0.0,
):
    """Return two blocks that touch and approach each other; with friction one slides askew over the other.

    Args:
        speed: Of approach [m/s].
    """
    records = {"a": block(count, modes, 1.0, bulge, 1), "b": block(count, modes, -1.0, 0.0, 2)}
    if friction:
        records = {name: (with_tangential_rows(modal, "face"), morph) for name, (modal, morph) in records.items()}
    aside = [0.5 * speed, 0.3 * speed] if friction else [0.0, 0.0]
    damped = {"damping": {"ratio": damping, "frequency": 1e4}} if damping else {}
    rubs = {"friction": {"static": friction}} if friction else {}
    scene = {
        "body": {"a": {"velocity": [speed, *aside]} | damped, "b": dict(damped)},
        "contact": {
            "touch": {"body": "a", "interface": "face", "against": {"shape": "body", "body": "b", "interface": "face"}}
            | rubs
        },
        "run": {"duration": 1e-3, "integrator": "small"},
    }
    return build_all(folder, records, scene)


def rubbing_ports(system: System) -> Ports:
    """Return the ports of a pair with the elastic rows and the residual flexibility of tangents, the second stiffer."""
    ports, (a, b) = ports_of(system), system.bodies.values()
    assert set(ports.kind) == {Kind.CONE}
    places = a.morph.points["face"][:, 1:]
    rows, count = ports.rows.dense(), len(places)
    sense = np.array([1.0, -1.0, -1.0])
    directions = ports.blocks[0].directions
    assert directions is not None
    across = directions.reshape(count, 3, 3)[:, :, 1:]
    for body, sign, seed in ((a, 1.0, 1), (b, -1.0, 2)):
        waves = _waves(places, len(body.modal.angular_frequencies), seed)
        for direction in (1, 2):
            along = np.einsum("na,nam->nm", across[:, direction], waves[:, 1:])
            rows[direction::3, body.elastic] = sign * along
    one = half_space(places)
    turn = np.zeros((count, 3, 3))
    turn[:, 0, 0] = 1.0
    turn[:, 1:, 1:] = across[:, 1:]
    one = np.einsum("nab,nbmc,mdc->namd", turn, one, turn).reshape(3 * count, 3 * count)
    # Of equal flexibility, what normal forces do along tangents would be the same on both.
    residual = np.stack([one, STIFFER * one * np.outer(np.tile(sense, count), np.tile(sense, count))])
    residual = 0.5 * (residual + residual.transpose(0, 2, 1))
    by_body = [(slice(0, len(rows)), body.coordinates, rows[:, body.coordinates]) for body in (a, b)]
    return replace(ports, rows=summed(rows.shape, by_body), flexibility=ports.pairs.held(residual))


def bar(modes: int) -> tuple[ModalRecord, MorphRecord]:
    """Return a free bar along x from 0 to LENGTH with a contact point at either end; R from its series' tail."""
    k = np.arange(1, modes + 1)
    omega = np.pi * SPEED / LENGTH * k
    ends = np.sqrt(2 / BARS_MASS) * np.stack([np.ones(modes), (-1.0) ** k])
    whole = LENGTH**2 / (BARS_MASS * SPEED**2) * np.array([[1 / 3, -1 / 6], [-1 / 6, 1 / 3]])
    # A force acts along the outward normals: −x at the first end.
    rows = ends * np.array([[-1.0], [1.0]])
    residual = whole * np.array([[1, -1], [-1, 1]]) - (rows / omega**2) @ rows.T
    twist = np.zeros((1, 6))
    twist[0, 0] = BARS_MASS**-0.5
    points = {"first": np.zeros((1, 3)), "last": np.array([[LENGTH, 0.0, 0.0]])}
    faces = {
        name: InterfaceModes(
            np.array([i]), points[name], np.array([[(-1.0) ** (i + 1), 0.0, 0.0]]), np.array([1e-4]),
            np.zeros(1, bool), rows[i : i + 1],
        )
        for i, name in enumerate(points)
    }  # fmt: skip
    centre, inertia = np.array([LENGTH / 2, 0.0, 0.0]), np.diag([0.0, 1.0, 1.0]) * BARS_MASS * LENGTH**2 / 12
    modal = ModalRecord(
        "mesh", "macneal", modes, 0, omega, BARS_MASS, centre, inertia, twist, faces,
        {"first": [0, 1], "last": [1, 2]}, residual, None, None, {},
    )  # fmt: skip
    return modal, MorphRecord("mesh", "modes", "none", points, BARS_MASS, centre, inertia, twist, None, {})


def chain(
    folder: Path,
    bars: int,
    modes: int = 40,
    *,
    integrator: str = "small",
    damping: float = 0.0,
    apart: float = 0.0,
) -> System:
    """Return bars in a row that touch; each is slower than the one behind it, so that all contacts close.

    Args:
        apart: By how much each gap is larger than the one before it [m].
    """
    names = [f"bar{number}" for number in range(bars)]
    places = [LENGTH * i + 0.5 * apart * i**2 for i in range(bars)]
    damped = {"damping": {"ratio": damping, "frequency": 1e4}} if damping else {}
    scene = {
        "body": {
            name: {"component": "bar", "position": [places[i], 0, 0], "velocity": [1.0 - i / bars, 0, 0]} | damped
            for i, name in enumerate(names)
        },
        "contact": {
            f"c{i}": {
                "body": names[i], "interface": "last",
                "against": {"shape": "body", "body": names[i + 1], "interface": "first"},
            }
            for i in range(bars - 1)
        },
        "run": {"duration": 1e-3, "integrator": integrator},
    }  # fmt: skip
    return build_all(folder, {"bar": bar(modes)}, scene)
