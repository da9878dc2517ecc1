"""Least squares of what joints lack to be closed, from positions where Newton's method leads away.

The method of Broyden, Fletcher, Goldfarb and Shanno (J. Nocedal and S. J. Wright, Numerical Optimization, 2006, ch. 6)
in motions of `dependence`, from the curvature of Gauss and Newton: forces of joints that stay open stiffen rotations,
which the latter leaves out. Where they can be closed from there it ends at zero, else where they are open least.
"""

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.integrators.turning.arrays import NONE, PLACE, TURN, WIDTH, Model, Work
from gudgeon.solver.integrators.turning.constraints.dependence import kinematic_rows, roots, spans
from gudgeon.solver.integrators.turning.energy import modal_parts

MOST_STEPS = 1000
STILL = 1e-9
"""Gradient over the violation at which it is least."""
WIDEST = 0.5
"""Largest rotation of a body in a step [rad], and motion over the size of the mechanism."""
DAMPED = 1e-3
"""Curvature that is added at first, over the largest one."""
ENOUGH, HALVINGS = 1e-4, 40
"""Share of the decrease along the gradient that a step has at least, and how often it is halved for it."""


def closed_by_least_squares(model: Model, work: Work, state: np.ndarray, drives: np.ndarray) -> np.ndarray:
    """Move bodies to where the joints are open least; return what each row lacks there, over its reach, (m,).

    Args:
        state: Moved in place.
        drives: Places, rates and second rates of the drives, (d, 3).
    """
    turning = core.Turning(model, work)

    def read(trial: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turning.keep_angles(trial)
        lacks = lacks_of(model, work, drives)
        return lacks, _rows(model, work).T @ lacks

    lacks, gradient = read(state)
    products = _rows(model, work).T @ _rows(model, work)
    inverse = np.linalg.inv(products + DAMPED * products.diagonal().max() * np.eye(len(products)))
    for _ in range(MOST_STEPS):
        size = float(np.linalg.norm(lacks))
        if size == 0.0 or np.linalg.norm(gradient) <= STILL * size:
            break
        step = -inverse @ gradient
        step *= min(1.0, WIDEST / float(np.abs(step).max()))
        for _halving in range(HALVINGS):
            tried = moved(model, state, step)
            trial_lacks, slope = read(tried)
            if trial_lacks @ trial_lacks <= lacks @ lacks + 2 * ENOUGH * float(gradient @ step):
                break
            step = 0.5 * step
        else:
            break
        inverse = _updated(inverse, step, slope - gradient)
        state[:], lacks, gradient = tried, trial_lacks, slope
    turning.keep_angles(state)
    return lacks


def _updated(inverse: np.ndarray, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return the inverse of the curvature after a step that changed the gradient, definite as before."""
    along = float(step @ change)
    if along <= np.finfo(float).eps * float(np.linalg.norm(step) * np.linalg.norm(change)):
        return inverse
    away = np.eye(len(step)) - np.outer(step, change) / along
    return away @ inverse @ away.T + np.outer(step, step) / along


def moved(model: Model, state: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Return a state after a motion in the metric of `dependence`, (6 n + E's,)."""
    result = state.copy()
    for b, (root, span) in enumerate(zip(roots(model), spans(model), strict=True)):
        move, start = root * motion[span], WIDTH * b
        result[start + PLACE : start + PLACE + 3] += move[:3]
        turn(result[start + TURN : start + TURN + 4], move[3:6])
        modal_parts(model, result, b)[0][:] += move[6:]
    return result


def motion_between(model: Model, state: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the motion by which `moved` leads from a state to another one nearby, (6 n + E's,)."""
    motion = np.zeros(spans(model)[-1].stop)
    for b, (root, span) in enumerate(zip(roots(model), spans(model), strict=True)):
        a, goal = (y[WIDTH * b : WIDTH * (b + 1)] for y in (state, target))
        (w, *_), (v, *_) = a[TURN:], goal[TURN:]
        u, x = a[TURN + 1 : TURN + 4], goal[TURN + 1 : TURN + 4]
        turned = 2 * np.sign(a[TURN : TURN + 4] @ goal[TURN : TURN + 4]) * (w * x - v * u - np.cross(x, u))
        bent = modal_parts(model, target, b)[0] - modal_parts(model, state, b)[0]
        motion[span] = np.concatenate([goal[PLACE : PLACE + 3] - a[PLACE : PLACE + 3], turned, bent]) / root
    return motion


def turn(e: np.ndarray, vector: np.ndarray) -> None:
    """Turn a quaternion by a small rotation vector [rad]."""
    half = 0.5 * vector
    w, v = float(e[0]), e[1:].copy()
    e[0] = w - half @ v
    e[1:] = v + w * half + np.cross(half, v)
    e /= np.linalg.norm(e)


def lacks_of(model: Model, work: Work, drives: np.ndarray) -> np.ndarray:
    """Return what each row lacks over its reach, of the values that `work` has, (m,)."""
    terms, driven = model.row_terms, model.drive_of != NONE
    lacks = (model.factors * np.where(terms == NONE, 0.0, work.value[terms])).sum(axis=1) - model.constant
    lacks[driven] -= drives[model.drive_of[driven], 0]
    return lacks / model.reach


def _rows(model: Model, work: Work) -> np.ndarray:
    """Return the change of `lacks_of` with the motions, (m, 6 n + E's)."""
    return kinematic_rows(model, work) / model.reach[:, None]
