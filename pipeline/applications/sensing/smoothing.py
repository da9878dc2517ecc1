"""The wrench on a tool from that of its base: a Kalman smoother of the base's motion, by the noise that is stated.

The base moves by u from where it is placed, on stiffness K and damping C, and carries the inertia M(q) of stand and
arm and of what of itself moves with it. With h(q, q̇, q̈) the wrench of stand and arm on a base at rest, and c that on
the tool,

  M ü + C u̇ + K u = c − h,   ċ = white noise,   y = −K u − C u̇ + noise  (load cells; gauges feel −K u alone).

c is taken as constant from one sample to the next, and u, u̇, c are estimated by all samples together (H. E. Rauch, F.
Tung, C. T. Striebel, AIAA J. 3 (1965) 1445-1450; backwards by G. J. Bierman, Fixed interval smoothing with discrete
measurements, Int. J. Control 18 (1973) 65-75, which inverts no covariance of states). The noise of y is stated; that of
ċ, one figure for forces and one for moments, is the one of greatest likelihood of the samples under this model (F. C.
Schweppe, IEEE Trans. Information Theory 11 (1965) 61-70). So nothing is differentiated and no bandwidth is chosen.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy import linalg

from gudgeon.pipeline.applications.sensing.chain import Chain
from gudgeon.pipeline.errors import InputError

Moved = tuple[np.ndarray, np.ndarray, np.ndarray]
SIZE = 6
HELD = 5e-3
"""Time over which M(q) is taken as constant [s]."""
SEARCHED, CLOSE = 60, 0.05
"""Most evaluations of the likelihood, and the difference of the logarithms of the noise of ċ at which they end."""


@dataclass(frozen=True)
class Yielding:
    """How a base yields, and what is measured of it."""

    stiffness: np.ndarray
    """K about the base point [N/m, N, N m], (6, 6)."""
    damping: np.ndarray
    """C, (6, 6)."""
    feels_damping: bool
    """Whether what is measured is K u + C u̇, or K u alone."""
    mass: np.ndarray = field(default_factory=lambda: np.zeros((SIZE, SIZE)))
    """Of the base itself that moves with its top, about the base point, (6, 6)."""


@dataclass(frozen=True)
class Felt:
    """What is estimated of a tool and its base."""

    contact: np.ndarray
    """Wrench on the tool about the base point [N, N m], (s, 6)."""
    acceleration: np.ndarray
    """Of the base [m/s², rad/s²], (s, 6)."""
    rates: tuple[float, float]
    """Square root of the noise of ċ, by which c changes in a second, of forces [N/√s] and of moments [N m/√s]."""


@dataclass(frozen=True)
class Process:
    """x⁺ = F x + b + noise Q, y = H x + noise R, from x₀ with P₀."""

    steps: np.ndarray
    """The different F, (f, n, n)."""
    which: np.ndarray
    """F of each sample, (s,)."""
    inputs: np.ndarray
    """b, (s, n)."""
    H: np.ndarray
    R: np.ndarray
    start: np.ndarray
    """x₀, (n,)."""
    spread: np.ndarray
    """P₀, (n, n)."""


def smoothed(process: Process, Q: np.ndarray, y: np.ndarray, *, back: bool = True) -> tuple[np.ndarray, float]:
    """Return the states (s, n) by all samples y (s, m), and minus the logarithm of their likelihood.

    Args:
        back: Whether states are smoothed; else they are those by the samples before.
    """
    H, n = process.H, len(process.start)
    x, P, cost = process.start, process.spread, 0.0
    states, spreads = np.zeros((len(y), n)), np.zeros((len(y) if back else 1, n, n))
    innovations, gains = np.zeros(y.shape), np.zeros((len(y) if back else 1, n, y.shape[1]))
    for k, seen in enumerate(y):
        HP = H @ P
        root = np.linalg.cholesky(HP @ H.T + process.R)
        half = linalg.solve_triangular(root, np.column_stack([HP, seen - H @ x]), lower=True, check_finite=False)
        both = linalg.solve_triangular(root, half, lower=True, trans=1, check_finite=False)
        cost += float(np.log(np.diag(root)).sum() + 0.5 * half[:, -1] @ half[:, -1])
        states[k] = x
        if back:
            spreads[k], gains[k], innovations[k] = P, both[:, :-1].T, both[:, -1]
        F = process.steps[process.which[k]]
        x = F @ (x + HP.T @ both[:, -1]) + process.inputs[k]
        P = F @ (P - half[:, :-1].T @ half[:, :-1]) @ F.T + Q
        P = 0.5 * (P + P.T)
    if back:
        adjoint = np.zeros(n)
        for k in range(len(y) - 1, -1, -1):
            adjoint = adjoint - H.T @ (innovations[k] + gains[k].T @ adjoint)
            states[k] -= spreads[k] @ adjoint
            if k:
                adjoint = process.steps[process.which[k - 1]].T @ adjoint
    return states, cost


def likeliest(process: Process, y: np.ndarray, rows: np.ndarray, guess: np.ndarray, interval: float) -> np.ndarray:
    """Return the noise of ċ of greatest likelihood, of forces and of moments, as square roots, (2,).

    Args:
        rows: Numbers of the states that are c.
        guess: Where the search begins.
    """
    from scipy.optimize import minimize

    def cost(logs: np.ndarray) -> float:
        return smoothed(process, diffusion(process, rows, np.exp(logs), interval), y, back=False)[1]

    start = np.log(guess)
    simplex = start + np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]])
    minimum = minimize(cost, start, method="Nelder-Mead", options={"maxfev": SEARCHED, "xatol": CLOSE, "fatol": 0.1,
                                                                 "initial_simplex": simplex})  # fmt: skip
    return np.exp(minimum.x)


def diffusion(process: Process, rows: np.ndarray, rates: np.ndarray, interval: float) -> np.ndarray:
    """Return Q, where c alone changes at random, (n, n)."""
    Q = np.zeros_like(process.spread)
    Q[rows, rows] = np.repeat(np.square(rates), SIZE // 2) * interval
    return Q


def felt(
    chain: Chain,
    stand_inertia: np.ndarray,
    moved: Moved,
    wrench: np.ndarray,
    *,
    base: Yielding | None,
    parameters: np.ndarray,
    gravity: np.ndarray,
    levels: np.ndarray,
    interval: float,
) -> Felt:
    """Return the wrench on a tool by the wrench of its base on the stand, (s, 6), measured about the base point.

    Args:
        stand_inertia: Inertia of the stand about the base point, (6, 6).
        moved: Joint angles, rates and second rates, (s, n) each.
        base: None for one that does not yield.
        parameters: p of the links, (10 n,).
        levels: Standard deviation of the noise of each component [N, N m], (6,).
        interval: From sample to sample [s].

    Raises:
        InputError: a noise that is not positive.
    """
    if not np.all(np.asarray(levels) > 0):
        raise InputError("noise: a component has none; the estimate needs that of each, above zero")
    load = chain.regressor(*moved, gravity) @ parameters + np.concatenate([-gravity, np.zeros(3)]) @ stand_inertia
    sizes = np.repeat([np.sqrt((block**2).mean()) for block in (wrench[:, :3], wrench[:, 3:])], SIZE // 2)
    R, stride = np.diag(np.square(levels)), max(1, round(HELD / interval))
    carried = stand_inertia if base is None else stand_inertia + base.mass
    masses = inertias(chain, carried, (moved[0][::stride], moved[1][::stride], moved[2][::stride]), parameters)
    if base is None:
        process = Process(
            steps=np.eye(SIZE)[None], which=np.zeros(len(wrench), int), inputs=np.zeros_like(wrench), H=-np.eye(SIZE),
            R=R, start=np.zeros(SIZE), spread=np.diag(np.square(sizes)),
        )  # fmt: skip
        y, rows = wrench - load, np.arange(SIZE)
    else:
        process = swaying(base, masses, stride, load, sizes=sizes, R=R, interval=interval)
        y, rows = wrench, np.arange(2 * SIZE, 3 * SIZE)
    guess = np.array([sizes[0], sizes[-1]]) / np.sqrt(interval * len(wrench)) + 1e-9
    rates = likeliest(process, y, rows, 10 * guess, interval)
    states, _ = smoothed(process, diffusion(process, rows, rates, interval), y)
    contact, acceleration = states[:, rows].copy(), np.zeros_like(wrench)
    if base is not None:
        contact[1:] = 0.5 * (
            contact[1:] + contact[:-1]
        )  # What is constant between two samples is that of their middle.
        u, v = states[:, :SIZE], states[:, SIZE : 2 * SIZE]
        net_force = contact - load - u @ base.stiffness.T - v @ base.damping.T
        acceleration = np.linalg.solve(masses[process.which], net_force[:, :, None])[:, :, 0]
    return Felt(contact, acceleration, (float(rates[0]), float(rates[1])))


def inertias(chain: Chain, stand_inertia: np.ndarray, moved: Moved, parameters: np.ndarray) -> np.ndarray:
    """Return M(q) of stand and arm about the base point, (s, 6, 6)."""
    still = 0 * moved[0]
    M = np.zeros((len(moved[0]), SIZE, SIZE))
    for column in range(SIZE):
        unit = np.tile(np.eye(SIZE)[column], (len(M), 1))
        M[:, :, column] = chain.regressor(moved[0], still, still, np.zeros(3), unit) @ parameters
    return 0.5 * (M + M.transpose(0, 2, 1)) + stand_inertia


def swaying(
    base: Yielding,
    masses: np.ndarray,
    stride: int,
    load: np.ndarray,
    *,
    sizes: np.ndarray,
    R: np.ndarray,
    interval: float,
) -> Process:
    """Return the process of u, u̇ and c, (18,); each of M(q), (f, 6, 6), holds for `stride` samples."""
    K, C, n = base.stiffness, base.damping, 3 * SIZE
    A = np.zeros((len(masses), n, n))
    lighter = np.linalg.inv(masses)
    A[:, :SIZE, SIZE : 2 * SIZE] = np.eye(SIZE)
    A[:, SIZE : 2 * SIZE] = np.concatenate([-lighter @ K, -lighter @ C, lighter], axis=2)
    steps = linalg.expm(interval * A)
    which = np.arange(len(load)) // stride
    middle = np.vstack([0.5 * (load[1:] + load[:-1]), load[-1:]])
    # A load acts as c does, with the opposite sign.
    inputs = -np.einsum("sij,sj->si", steps[which][:, :, 2 * SIZE :], middle)
    inputs[:, 2 * SIZE :] = 0.0
    H = np.hstack([-K, -C if base.feels_damping else np.zeros_like(C), np.zeros_like(K)])
    soft = np.linalg.inv(K)
    sagged = soft @ np.diag(np.square(sizes)) @ soft
    swinging = lighter[0] * float(np.trace(np.diag(np.square(sizes)) @ soft))
    return Process(
        steps=steps, which=which, inputs=inputs, H=H, R=R, start=np.zeros(n),
        spread=linalg.block_diag(sagged, swinging, np.diag(np.square(sizes))),
    )  # fmt: skip
