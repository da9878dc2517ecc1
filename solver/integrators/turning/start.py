"""The start of a mechanism: bodies moved onto their joints, velocities that obey them, and what joints leave free."""

from collections import Counter
from typing import NamedTuple

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.bodies.placing import turned_vectors
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.turning.arrays import NONE, PLACE, SPEED, SPIN, TURN, WIDTH, Model, Work
from gudgeon.solver.integrators.turning.build import Linkage, reach_of, size_of
from gudgeon.solver.integrators.turning.constraints.closing import (
    closed_by_least_squares,
    lacks_of,
    motion_between,
    moved,
)
from gudgeon.solver.integrators.turning.constraints.dependence import (
    jacobian,
    kinematic_rows,
    rigid_columns,
    spans,
    unit_rows,
)
from gudgeon.solver.integrators.turning.constraints.nearness import check_nearness
from gudgeon.solver.integrators.turning.energy import modal_parts, motion_of
from gudgeon.solver.integrators.turning.moving_rest import HEAVY, Moment, Shapes, stiff, without_rates
from gudgeon.solver.integrators.turning.rotation import rotation_vectors
from gudgeon.solver.joints.coupled import Driven

ASSEMBLED = 1e-12
"""Violation over the size of the scene up to which a mechanism is closed."""
MORE = 20
"""Times that Newton's method goes on from where it ended."""
OPEN = 1e-6
"""Violation over the size of the scene of joints that are named beside the one that is open most."""
SAID = 1e-9
"""Motion by the assembly, over the size of the scene, and relative change of given velocities, that is said."""
DEPENDENT = 1e-5
"""Singular value of the scaled rows, of lengths 1, below which they depend on each other."""
ASIDE = 1e-3
"""Rotation by which the start is left along its free motions to see whether it is singular [rad]."""
NEARER = (0.1, 0.01)
"""Shares of this rotation that are tried, too, where none is left: near a singular position it may leave the path."""
LOST, NOTED = 0.5, 0.05
"""Share of its motion that a body loses where the joints are closed again and leave none of any size, and motion over
the largest one from which on a body is looked at: along a path, what goes is of second order."""


class Start(NamedTuple):
    """State and findings at the start."""

    state: np.ndarray
    """(numbers,)"""
    rows: int
    rank: int
    notes: list[str]


def start_of(linkage: Linkage, model: Model, work: Work, moment: Moment) -> Start:
    """Return the start of a mechanism.

    Args:
        moment: Drives and loads at the start.

    Raises:
        SceneError: the joints cannot be closed, the position is singular, or a drive contradicts the joints.
    """
    state = _placed(linkage, model, work)
    drives = moment.drives
    if not len(model.row_terms):
        return Start(state, 0, 0, _shaped(linkage, model, work, state, moment))
    size, placed = reach_of(linkage), state.copy()
    check_nearness(linkage.names, linkage.centres, size)
    # First as rigid bodies, where the joints can be closed so.
    if model.elastic[:, 0].any() and not _closes(stiff(model), work, state, drives):
        state[:] = placed
    _assemble(linkage, model, work, state, drives)
    notes = [
        *_overshot(linkage),
        *_moved(linkage, placed, state, size),
        *_deformed(linkage, model, state, size),
    ]
    core.Turning(model, work).keep_angles(state)
    rank = _check_rows(linkage, model, work, state, drives)
    work.within[0] &= rank == len(model.row_terms)
    prescribed = state.copy()
    loaded = np.array([_rates_given(linkage, name) for name in linkage.names])
    if loaded.any() and not loaded.all():
        heavy = np.where(loaded, HEAVY, 1.0)
        heavier = _heavier(stiff(model), heavy)
        for _ in range(2):  # The second time, what the first one left of 1/HEAVY.
            for b, kind in zip(*np.nonzero(loaded), strict=True):
                start = WIDTH * b + (SPEED, SPIN)[kind]
                state[start : start + 3] = prescribed[start : start + 3]
            without_rates(model, work, state)
            _scale_momenta(model, state, heavy[:, 1])
            core.Turning(heavier, work).match(state, drives)
            _scale_momenta(model, state, 1 / heavy[:, 1])
    if model.elastic[:, 0].any():
        without_rates(model, work, state)
        core.Turning(stiff(model), work).match(state, drives)
        without_rates(model, work, state)
    matched = state.copy()
    core.Turning(model, work).match(matched, drives)
    notes += [*_changed(linkage, model, work, prescribed, matched), *_bending(linkage, model, work)]
    notes += _shaped(linkage, model, work, state, moment)
    core.Turning(model, work).match(state, drives)
    m = len(model.row_terms)
    if rank == 6 * len(linkage.names) and not linkage.drives and not model.elastic[:, 0].any():
        notes.append(f"the joints leave no motion: their {m} rows hold all {rank} motions of the bodies")
    if rank < m:
        notes.append(
            f"the joints have {m} rows of rank {rank}: {', '.join(_redundant(linkage, work))}"
            f" {'repeats' if m - rank == 1 else 'repeat'} what other joints hold; the reactions of joints that share a"
            " load are those of least norm"
        )
    return Start(state, m, rank, notes)


def _shaped(linkage: Linkage, model: Model, work: Work, state: np.ndarray, moment: Moment) -> list[str]:
    """Give bodies that deform the shapes of the rigid motion; return a note where there are none."""
    if linkage.system.scene.run.start == "undeformed" or not model.elastic[:, 0].any():
        return []
    if Shapes(model, work).start(state, moment):
        return []
    return [
        "run.start: no stable shapes of the bodies were found that follow the joints, loads and rotation at the start;"
        " they start undeformed, and vibrate from there"
    ]


def _placed(linkage: Linkage, model: Model, work: Work) -> np.ndarray:
    """Return the state as the scene gives it."""
    scene, bodies = linkage.system.scene, linkage.system.bodies
    state = np.zeros(size_of(model))
    for b, (name, body) in enumerate(bodies.items()):
        settings, start = scene.body[name], WIDTH * b
        omega, speed = np.asarray(settings.angular_velocity, float), np.asarray(settings.velocity, float)
        if settings.velocity_at is not None:
            speed = speed + np.cross(omega, body.morph.centre - turned_vectors(settings, settings.velocity_at))
        state[start + PLACE : start + PLACE + 3], state[start + TURN] = linkage.centres[b], 1.0
        state[start + SPEED : start + SPEED + 3], state[start + SPIN : start + SPIN + 3] = (
            speed,
            body.morph.inertia @ omega,
        )
    without_rates(model, work, state)
    return state


def _heavier(model: Model, factors: np.ndarray) -> Model:
    """Return a model with the masses of bodies, and their inertia about their centres, times factors, (n, 2)."""
    straight, turned = factors.T
    scaled = {
        name: getattr(model, name) * turned.reshape(-1, *(1,) * (getattr(model, name).ndim - 1))
        for name in ("inertia", "second", "lever", "pair")
    }
    root = model.modal_root * np.sqrt(turned)[:, None, None]
    return model._replace(
        **scaled, mass=model.mass * straight, modal_root=root, inverse=model.inverse / turned[:, None, None]
    )


def _scale_momenta(model: Model, state: np.ndarray, factors: np.ndarray) -> None:
    for b, factor in enumerate(factors):
        state[WIDTH * b + SPIN : WIDTH * b + SPIN + 3] *= factor
        modal_parts(model, state, b)[1][:] *= factor


def _rates_given(linkage: Linkage, name: str) -> tuple[bool, bool]:
    """Return whether the scene gives the velocity and the angular velocity of a body."""
    settings = linkage.system.scene.body[name].model_fields_set
    return bool({"velocity", "velocity_at"} & settings), "angular_velocity" in settings


def _assemble(linkage: Linkage, model: Model, work: Work, state: np.ndarray, drives: np.ndarray) -> None:
    """Move the bodies onto their joints, by steps where Newton's method does not converge from far, and from where they
    are open least where it leads away."""
    placed = state.copy()
    if _closes(model, work, state, drives):
        return
    state[:] = placed
    lacks = closed_by_least_squares(model, work, state, drives)
    closest = state.copy()
    if _closes(model, work, state, drives):
        return
    state[:] = closest
    joints = list(dict.fromkeys(row.joint for row, lack in zip(linkage.rows, lacks, strict=True) if abs(lack) > OPEN))
    widest, parted = _parted(linkage, model, work, placed, drives)
    i = max(range(len(lacks)), key=lambda k: (linkage.rows[k].joint == widest and widest in joints, abs(lacks[k])))
    others = f" (together with {', '.join(joints)})" if len(joints) > 1 else ""
    opening = f"{abs(lacks[i]) * model.reach[i]:.3g} {'m' if linkage.rows[i].length else 'rad'}"
    raise SceneError(
        f"joint.{linkage.rows[i].joint}: the joints do not close: from the positions given it stays open by {opening}"
        f" where all are open least{others}, and as placed {parted}; check lengths, points and positions of the bodies"
    )


def _parted(linkage: Linkage, model: Model, work: Work, state: np.ndarray, drives: np.ndarray) -> tuple[str, str]:
    """Return the joint whose own condition is open most as the scene places the bodies, and by how much."""
    core.Turning(model, work).keep_angles(state)
    work.turned[:] = 0.0
    lacks, keys = lacks_of(model, work, drives), [(row.joint, row.length) for row in linkage.rows]
    scales = dict(zip(keys, model.reach, strict=True))
    open_by = {key: float(np.linalg.norm(lacks[[k == key for k in keys]])) for key in scales}
    name, length = key = max(open_by, key=lambda joint: open_by[joint])
    if length and Counter(keys)[key] == 3:
        return name, f"the points of joint '{name}' are {open_by[key] * scales[key]:.3g} m apart"
    return name, f"joint '{name}' is open by {open_by[key] * scales[key]:.3g} {'m' if length else 'rad'}"


def _closes(model: Model, work: Work, state: np.ndarray, drives: np.ndarray) -> bool:
    """Move the bodies by Newton's method, again from where it ends; return whether the joints are closed."""
    turning = core.Turning(model, work)
    for _ in range(1 + MORE):
        residual = turning.close(state, drives)
        if not np.isfinite(state).all():
            return False
        if residual <= ASSEMBLED:
            return True
    return False


def _overshot(linkage: Linkage) -> list[str]:
    """Return a sentence for each joint that is driven by a table whose spline leaves the range of its rows.

    Raises:
        SceneError: it leaves it by far, as where rows jump.
    """
    scene, texts = linkage.system.scene, []
    for name, joint in scene.joint.items():
        if not isinstance(joint, Driven) or (overshoot := joint.overshoot(scene.run.duration)) is None:
            continue
        text, refused = overshoot
        if refused:
            raise SceneError(f"joint.{name}.{text}; a jump asks for an infinite acceleration")
        texts.append(f"joint.{name}.{text}")
    return texts


def _moved(linkage: Linkage, placed: np.ndarray, state: np.ndarray, size: float) -> list[str]:
    n = len(linkage.names)
    before, after = (y[: WIDTH * n].reshape(n, WIDTH) for y in (placed, state))
    moves = np.linalg.norm(after[:, :3] - before[:, :3], axis=1)
    turns = np.linalg.norm(rotation_vectors(after[:, TURN : TURN + 4], np.zeros((n, 3))), axis=1)
    if moves.max() <= SAID * size and turns.max() <= SAID:
        return []
    far = int(np.maximum(moves / size, turns).argmax())
    return [
        f"the joints were closed at the start: body {linkage.names[far]} moved most, by {moves[far]:.3g} m and"
        f" {turns[far]:.3g} rad"
    ]


def _deformed(linkage: Linkage, model: Model, state: np.ndarray, size: float) -> list[str]:
    """Return a note of each body that has to deform for the joints to close.

    Raises:
        SceneError: one deforms beyond its range.
    """
    limit, notes = linkage.system.scene.run.limits.deflection, []
    for b, (name, body) in enumerate(linkage.system.bodies.items()):
        deflection = float(np.linalg.norm(modal_parts(model, state, b)[0]) / np.sqrt(body.morph.mass))
        text = f"body.{name}: the joints close at the start only where it deforms by {deflection:.3g} m (rms)"
        if deflection > limit * body.gyration:
            raise SceneError(
                f"{text}, beyond run.limits.deflection = {limit:g} of its radius of gyration {body.gyration:.3g} m;"
                " check lengths, points and positions of the bodies"
            )
        if deflection > SAID * size:
            notes.append(text)
    return notes


def _changed(linkage: Linkage, model: Model, work: Work, prescribed: np.ndarray, state: np.ndarray) -> list[str]:
    """Return a note where velocities that the scene gives do not obey the joints."""
    n, notes = len(linkage.names), []
    before, after = (y[: WIDTH * n].reshape(n, WIDTH) for y in (prescribed, state))
    spins = [motion_of(model, work, y).omega for y in (prescribed, state)]
    largest = max(float(np.abs(y[:, SPEED : SPEED + 3]).max()) for y in (before, after))
    fastest = max(float(np.abs(spin).max()) for spin in spins)
    stiff = " of bodies that do not deform at the start" if model.elastic[:, 0].any() else ""
    for b, name in enumerate(linkage.names):
        moves, turns = _rates_given(linkage, name)
        velocity_change = (
            float(np.linalg.norm(after[b, SPEED : SPEED + 3] - before[b, SPEED : SPEED + 3])) if moves else 0.0
        )
        turned = float(np.linalg.norm(spins[1][b] - spins[0][b])) if turns else 0.0
        if velocity_change > SAID * largest or turned > SAID * fastest:
            notes.append(
                f"body.{name}: its velocity at the start does not obey the joints{stiff}; it was changed by"
                f" {velocity_change:.3g} m/s and {turned:.3g} rad/s"
            )
    return notes


def _rank(rows: np.ndarray) -> int:
    """Return the rank of rows of length 1, by the eigenvalues of their products: the squares of the singular values."""
    return int((np.linalg.eigvalsh(rows @ rows.T) > DEPENDENT**2).sum()) if len(rows) else 0


def _within(rows: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Return the part of a motion that the rows leave free."""
    values, vectors = np.linalg.eigh(rows @ rows.T)
    independent = values > DEPENDENT**2
    return motion - rows.T @ (
        vectors[:, independent] @ ((vectors[:, independent].T @ (rows @ motion)) / values[independent])
    )


def _check_rows(linkage: Linkage, model: Model, work: Work, state: np.ndarray, drives: np.ndarray) -> int:
    """Return the rank of the rows; raise a SceneError for drives that contradict joints, and singular positions."""
    rows = jacobian(model, work)
    driven = model.drive_of != NONE
    before = _rank(rows[~driven])
    for i in np.flatnonzero(driven):
        after = _rank(rows[np.flatnonzero(~driven | (np.arange(len(rows)) <= i) & driven)])
        if after == before:
            raise SceneError(
                f"joint.{linkage.rows[i].joint}: what it drives is held or driven already: no motion is left to joint"
                f" '{linkage.system.scene.joint[linkage.rows[i].joint].joint}'; remove one of the drives"  # type: ignore[union-attr]
            )
        before = after
    rank = _rank(rows)
    if rank == rows.shape[1]:
        return rank
    rng = np.random.default_rng(0)
    for _ in range(2):
        direction = _within(rows, rng.standard_normal(rows.shape[1]))
        motion = direction * (ASIDE / float(np.abs(direction).max()))
        there, motion_lost = _rank_beside(model, work, state, drives, motion)
        if there > rank or (
            motion_lost and all(_rank_beside(model, work, state, drives, s * motion)[1] for s in NEARER)
        ):
            raise SceneError(_singular(linkage, rows, rank, there))
    work.turned[:] = 0.0
    core.Turning(model, work).keep_angles(state)
    return rank


def _rank_beside(
    model: Model, work: Work, state: np.ndarray, drives: np.ndarray, motion: np.ndarray
) -> tuple[int, bool]:
    """Return the rank of the rows where the joints are closed again after a motion from a state, 0 where they are not,
    and whether a body has lost its part of the motion there."""
    beside = moved(model, state, motion)
    if not _closes(model, work, beside, drives):
        return 0, False
    core.Turning(model, work).keep_angles(beside)
    lost_motion, tolerance = motion_between(model, state, beside) - motion, NOTED * float(np.abs(motion).max())
    sizes = [(np.linalg.norm(motion[s]), np.linalg.norm(lost_motion[s])) for s in spans(model)]
    return _rank(jacobian(model, work)), any(size > tolerance and lost_size > LOST * size for size, lost_size in sizes)


def _singular(linkage: Linkage, rows: np.ndarray, rank: int, there: int) -> str:
    """Return why a start is refused whose rows have a rank, and beside it a larger one, or leave no motion there."""
    values, vectors = np.linalg.eigh(rows @ rows.T)
    within = np.abs(vectors[:, values <= DEPENDENT**2]).max(axis=1) > DEPENDENT
    names = list(dict.fromkeys(row.joint for row, row_within in zip(linkage.rows, within, strict=True) if row_within))
    freedom, beside = rows.shape[1] - rank, rows.shape[1] - there
    if there > rank:
        so = f"{beside} in positions near it, so that the motion is not determined; start away from it"
    else:
        fewer = "none" if freedom == 1 else "fewer"
        so = f"{fewer} in positions near it, so that it moves only if they deform; change one of them, or the start"
    return (
        f"joint.{names[0]}: the start is a singular position: the joints ({', '.join(names)}) leave {freedom}"
        f" motion{'s' * (freedom > 1)} there and {so}"
    )


def _bending(linkage: Linkage, model: Model, work: Work) -> list[str]:
    """Return a note of each drive that moves nothing at the start unless bodies deform, as at a dead centre."""
    W, rigid, notes = kinematic_rows(model, work), rigid_columns(model), []
    held_rows, ends = list(np.flatnonzero(model.drive_of == NONE)), np.cumsum(6 + model.elastic[:, 0])[:-1]
    for i in np.flatnonzero(model.drive_of != NONE) if not rigid.all() else ():
        before = _rank(unit_rows(W[held_rows][:, rigid]))
        if _rank(unit_rows(W[[*held_rows, i]][:, rigid])) == before:
            weights = np.linalg.lstsq(W[held_rows][:, rigid].T, W[i, rigid], rcond=DEPENDENT)[0]
            by_body = np.split(np.where(rigid, 0.0, W[i] - weights @ W[held_rows]), ends)
            bent = [np.linalg.norm(x) > DEPENDENT * np.linalg.norm(W[i]) for x in by_body]
            bodies = [f"body.{name}" for name, x in zip(linkage.names, bent, strict=True) if x]
            notes.append(
                f"joint.{linkage.rows[i].joint}: the other joints hold what it drives at the start, as if bodies were"
                f" rigid: it moves only as {', '.join(bodies)} deform{'s' * (len(bodies) == 1)}; if that is not meant,"
                " start elsewhere, or drive another joint"
            )
        held_rows.append(i)
    return notes


def _redundant(linkage: Linkage, work: Work) -> list[str]:
    """Return the joints of the rows that the last factor left out."""
    dropped = work.order[work.rank[0] :]
    return list(dict.fromkeys(f"joint.{linkage.rows[int(i)].joint}" for i in sorted(dropped)))
