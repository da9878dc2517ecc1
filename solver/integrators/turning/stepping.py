"""What the steps of a mechanism are taken with, by `core.TurningSteps`: their methods, errors, and where they end.

Explicit steps cannot exceed about 6 over the highest frequency of a body. Where they come near to that the run tries
others: implicit ones by collocation, or, of bodies without joints, exponential ones, in which vibrations are exact.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.breaks import breaks_of, kinks_of, within
from gudgeon.solver.forces.signals import Function
from gudgeon.solver.integrators.turning.arrays import CURL, Model
from gudgeon.solver.integrators.turning.tables import STAGES, Nodes, Table, Tableau, nodes_of, table_of, tableau

ERROR_RATIO = 1e-3
"""Error of an explicit step over run.accuracy: errors of hundreds of steps add up."""
FREE_ERROR_RATIO = 0.1
"""The same of an implicit step without joints, whose estimate is of order 5 and its motion of order 10; multipliers of
joints are of lower order."""
FINEST = 2e-13
"""Least error of a step that is asked for: below is round-off."""
FINEST_EXPLICIT = 1e-14
"""The same of explicit steps, whose estimate has no round-off of the reactions."""
EXPLICIT, IMPLICIT, EXPONENTIAL = 1, 2, 4
"""Methods of steps; the sum of the first and one of the others is both."""
SWINGS = 0.3
"""Frequency of a mode over that without damping, from which on it counts as one that vibrates."""
COUPLED = 1e-9
"""Angular momentum of rates of modes over the root of the largest moment of mass, up to which it is none."""

Given = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Drives (t, d, 3) and loads (t, l) at times [s], (t,)."""


class Settings(NamedTuple):
    """What the steps of a run are taken with."""

    duration: float
    """Of the run [s]."""
    fixed: float
    """Size of all steps; 0 of steps that choose their own [s]."""
    methods: int
    tolerance: float
    """Error of an explicit step."""
    longer_tolerance: float
    """Error of another one."""
    kinetic: float
    """Energy by which errors of the energy balance are measured at least [J]."""
    rank: int
    """Of the rows of joints at the start."""
    breaks: np.ndarray
    """Times at which steps end, and where the next ones begin, ascending [s], (b, 2)."""
    tableau: Tableau
    times: np.ndarray
    """Of the stages of an explicit step over it, (16,)."""
    table: Table
    nodes: Nodes
    roots: np.ndarray
    """`roots_of` the model, (n, E)."""


def settings_of(
    model: Model, stepping: str, accuracy: float, *, duration: float, fixed: float | None, rank: int, breaks: np.ndarray
) -> Settings:
    """Return what the steps of a run are taken with.

    Args:
        stepping: `run.stepping`.
        fixed: Size of all steps [s]; None of steps that choose their own.

    Raises:
        SceneError: implicit steps are asked for that the mechanism cannot have.
    """
    lack = lack_of(model)
    if stepping == "implicit" and lack:
        raise SceneError(f"run.stepping: 'implicit' given, and {lack}; use 'auto' or 'explicit'")
    other, ratio = (EXPONENTIAL, FREE_ERROR_RATIO) if propagates(model) else (IMPLICIT, ERROR_RATIO)
    methods = EXPLICIT + other
    if stepping == "explicit" or lack or (stepping == "auto" and fixed is not None):
        methods = EXPLICIT
    elif stepping == "implicit":
        methods = other
    table, (coefficients, times) = table_of(STAGES), tableau()
    return Settings(
        duration, fixed or 0.0, methods, max(FINEST_EXPLICIT, ERROR_RATIO * accuracy), max(FINEST, ratio * accuracy),
        kinetic=0.5 * float(model.mass.sum()) * (model.size / duration) ** 2, rank=rank, breaks=breaks,
        tableau=coefficients, times=times, table=table, nodes=nodes_of(table), roots=roots_of(model),
    )  # fmt: skip


def given_of(drives: Sequence[Function], loads: Sequence[Function]) -> Given:
    """Return what drives and loads are at times."""

    def given(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        driven, amounts = np.zeros((len(times), len(drives), 3)), np.zeros((len(times), len(loads)))
        for i, drive in enumerate(drives):
            driven[:, i] = drive.read(times, 2)
        for i, load in enumerate(loads):
            amounts[:, i] = load.read(times)[:, 0]
        return driven, amounts

    return given


def breaks_in(drives: Given, tables: Iterable[tuple[tuple[float, float], ...]], duration: float) -> np.ndarray:
    """Return the times of a run at which steps end and the next begin, (b, 2) [s]: for its drives and loads, and at the
    kinks of the tables of loads."""

    def read(times: np.ndarray) -> np.ndarray:
        return np.hstack([a.reshape(len(times), -1) for a in drives(times)])

    if not read(np.zeros(1)).size:
        return np.empty((0, 2))
    return within([breaks_of(read, duration, trains=False), *(kinks_of(t, duration) for t in tables)], duration)


def lack_of(model: Model) -> str | None:
    """Return why a mechanism cannot take implicit steps; None if it can."""
    if len(model.touch_pair):
        return "something touches, which begins and ends with explicit steps"
    if not model.orthogonal.all():
        return "the modes of a body are coupled by their inertia, as they are by attachment 'fixed'"
    return None


def propagates(model: Model) -> bool:
    """Return whether steps may take the vibrations of a mechanism's modes as exact: without joints, of bodies that
    deform whose modes are coupled by rotation alone and are damped below their critical damping."""
    roots, count = roots_of(model), model.elastic[:, 0]
    if len(model.row_terms) or not count.any():
        return False
    used = np.arange(roots.shape[1]) < count[:, None]
    swing = np.imag(roots[used]) > SWINGS * np.abs(roots[used])
    uncoupled = np.abs(model.lever[:, CURL:]).max() <= COUPLED * np.sqrt(model.second.max())
    return bool(uncoupled and swing.all())


def roots_of(model: Model) -> np.ndarray:
    """Return λ of all modes, z' = λ z + … with z = v − conj(λ) q [1/s], complex, (n, E); zero where a body has none.
    Those that do not vibrate are real."""
    mass = np.einsum("bkk->bk", model.modal_root) ** 2
    mass[mass == 0.0] = 1.0
    half, square = 0.5 * model.modal_damping / mass, model.modal_stiffness / mass
    return -half + np.sqrt(np.maximum(square - half**2, 0.0)) * 1j


def kinds_text(counts: dict[str, int]) -> list[str]:
    """Return what is said of the steps of a run."""
    if not counts["implicit_steps"]:
        return []
    return [
        f"{counts['implicit_steps']} of {counts['steps_taken']} steps are implicit, longer than the highest frequency"
        " of a body allows explicit ones (run.stepping): vibrations whose motion is below run.accuracy may have"
        " another phase"
    ]
