"""`python -m docs.tools.theory_figures [NAME …]`: draw the figures of docs/theory; `make docs` does.

Bars are in units of their length, mass and wave speed: modes are known, φ_k = √2 cos kπx, ω_k = kπ, and so is the
flexibility at an end, 1/3. Schemes are drawn in `theory_schemes`.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp
from scipy.integrate._ivp import dop853_coefficients as dop853

from docs.tools.theory_schemes import SCHEMES, panels
from gudgeon.pipeline.plots.base.style import BLUE, FAINT, GREEN, GREY, ORANGE, RED, SETTINGS
from gudgeon.solver.laws.dissipative import LOSSES
from gudgeon.solver.laws.restitution import delivered_restitution, loss_of_restitution

FOLDER = Path(__file__).resolve().parents[1] / "theory"
END_FLEXIBILITY = 1 / 3
STEP = 1.0
"""h ω_c of the runs that are drawn."""
RINGS = 2.5
"""Window of forces over the shortest period, as of runs."""


def residual_of(count: int) -> float:
    """Return R at the end of a free bar with so many modes."""
    return END_FLEXIBILITY - float((2 / (np.pi * np.arange(1, count + 1)) ** 2).sum())


def residual_flexibility() -> Figure:
    """Draw the static displacement of a bar and what modes leave of it."""
    figure, (left, right) = panels(2)
    x = np.linspace(0, 1, 400)
    total = x**2 / 2 - 1 / 6
    modal = sum(2 * (-1) ** k * np.cos(k * np.pi * x) / (k * np.pi) ** 2 for k in range(1, 6))
    left.plot(x, total, color=FAINT, lw=2.4, label="all modes, $G\\,B^T$")
    left.plot(x, modal, color=BLUE, label="5 modes")
    left.plot(x, total - modal, color=ORANGE, label="residual")
    left.set(xlabel="place over the length", ylabel="displacement per unit force", xlim=(0, 1))
    left.legend(loc="upper left")
    counts = np.arange(1, 101)
    bar = np.array([residual_of(n) for n in counts]) / END_FLEXIBILITY
    beta = np.concatenate([[4.730040745, 7.853204624, 10.99560784], (np.arange(4, 20_001) + 0.5) * np.pi])
    terms = 1 / beta**4
    beam = 1 - np.cumsum(terms)[:100] / terms.sum()
    right.loglog(counts, bar, color=ORANGE, label="bar, force along it")
    right.loglog(counts, beam, color=GREEN, label="beam, force across it")
    right.set(xlabel="number of modes", ylabel="residual over total flexibility", xlim=(1, 100), ylim=(1e-6, 1.3))
    right.legend(loc="lower left")
    return figure


def reduction_shapes() -> Figure:
    """Draw the shapes of a bar in four reductions."""
    figure, axes = panels(4, height=2.6)
    x = np.linspace(0, 1, 300)
    residual = x**2 / 2 - 1 / 6
    for k in (1, 2):
        residual = residual - 2 * (-1) ** k * np.cos(k * np.pi * x) / (k * np.pi) ** 2
    shapes = {
        "normal modes": [np.cos(k * np.pi * x) for k in (1, 2)],
        "rows held": [np.sin(k * np.pi * x) for k in (1, 2)],
        "constraint mode": [2 * x - 1],
        "residual shape": [residual / residual.max()],
    }
    for axis, (title, curves) in zip(axes, shapes.items(), strict=True):
        for curve, colour in zip(curves, (BLUE, ORANGE), strict=False):
            axis.plot(x, curve, color=colour)
        axis.set_title(title, fontsize=9.5)
        axis.set(xlim=(0, 1), ylim=(-1.15, 1.15), xticks=(0, 1), yticks=(-1, 0, 1))
        axis.set_xlabel("place over the length")
    return figure


def struck(count: int, duration: float, mass: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return times and mean forces of steps of a free bar whose end strikes a wall, or is struck by a mass, at speed 1.

    By equations (8.1) to (8.4) with one point, `count` modes and R.
    """
    k = np.arange(1, count + 1)
    omega = np.concatenate([[0.0], k * np.pi])
    row = np.concatenate([[1.0], np.sqrt(2) * np.ones(count)])
    velocity = np.zeros(count + 1)
    if mass is None:
        velocity[0] = -1.0
    else:
        omega, row = np.append(omega, 0.0), np.append(row, 1 / np.sqrt(mass))
        velocity = np.append(velocity, -np.sqrt(mass))
    R, q = residual_of(count), np.zeros(len(omega))
    critical = (
        np.sqrt(np.linalg.eigvalsh(np.diag(omega**2) + np.outer(row, row) / R)[-1]) if count < 400 else 4 * omega.max()
    )
    h = STEP / critical
    safe = np.where(omega > 0, omega, 1.0)
    cosine, sine = np.cos(omega * h), np.where(omega > 0, np.sin(omega * h) / safe, h)
    by_force = np.where(omega > 0, (1 - cosine) / safe**2, h * h / 2)
    mobility = 0.5 * float(row @ (by_force * row)) + R
    means, force = np.zeros(int(duration / h)), 0.0
    for i in range(len(means)):
        half = 0.5 * force * row
        free = cosine * q + sine * velocity + by_force * half
        after = max(0.0, -float(row @ free) / mobility)
        total = half + 0.5 * after * row
        velocity = cosine * velocity - omega**2 * sine * q + sine * total
        q = free + by_force * (0.5 * after * row)
        means[i], force = 0.5 * (force + after), after
    return h * np.arange(1, len(means) + 1), means


def windowed(times: np.ndarray, means: np.ndarray, window: float) -> np.ndarray:
    """Return the mean over a window of the mean over it, equation (4.6), at the times."""
    edges = np.concatenate([[0.0], times])
    impulse = np.concatenate([[0.0], np.cumsum(means) * times[0]])
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (impulse[1:] + impulse[:-1])) * times[0]])

    def at(t: np.ndarray) -> np.ndarray:
        beyond = np.maximum(t - edges[-1], 0.0) * impulse[-1]
        return np.interp(t, edges, integral, left=0.0) + beyond

    return (at(times + window) - 2 * at(times) + at(times - window)) / window**2


def bar_on_wall() -> Figure:
    """Draw the force of a bar on a wall, and errors over the number of modes."""
    figure, (left, right) = panels(2)
    times, means = struck(60, 3.0)
    left.plot(times, means, color=GREY, lw=0.6, label="mean of each step")
    left.plot(times, windowed(times, means, RINGS * 2 / 60), color=BLUE, lw=1.8, label="windowed")
    left.plot([0, 0, 2, 2, 3], [0, 1, 1, 0, 0], color=ORANGE, lw=1.2, label="exact")
    left.set(
        xlabel="time over that of a wave along the bar", ylabel="force over $F_0$", xlim=(-0.1, 3), ylim=(-0.1, 2.9)
    )
    left.legend(loc="upper right")
    counts = np.array([5, 8, 12, 18, 27, 40, 60, 90, 130, 200])
    errors = []
    for n in counts:
        t, f = struck(int(n), 3.0)
        errors.append((abs(f.sum() * t[0] / 2 - 1), abs(windowed(t, f, RINGS * 2 / n).max() - 1)))
    impulse, force = np.array(errors).T
    right.loglog(counts, impulse, "o-", color=GREEN, ms=4, label="impulse")
    right.loglog(counts, force, "s-", color=BLUE, ms=4, label="largest windowed force")
    right.set(xlabel="number of modes", ylabel="relative error")
    right.legend(loc="lower left")
    return figure


def contact_laws() -> Figure:
    """Draw loops of laws, and the restitution that they deliver."""
    figure, (left, right) = panels(2)
    loops = {
        "hertz": (0.0, FAINT), "lankarani-nikravesh": (LOSSES["lankarani-nikravesh"](0.5), ORANGE),
        "exact": (loss_of_restitution(0.5), BLUE),
    }  # fmt: skip
    for name, (loss, colour) in loops.items():

        def force(d: np.ndarray, rate: np.ndarray, chi: float = loss) -> np.ndarray:
            return np.maximum(0.0, np.maximum(d, 0.0) ** 1.5 * (1 + chi * rate))

        def ended(_: float, y: np.ndarray) -> float:
            return y[0]

        ended.terminal, ended.direction = True, -1  # type: ignore[attr-defined]
        run = solve_ivp(
            lambda _, y, F=force: [y[1], -F(y[0], y[1])], (0, 20), [1e-9, 1.0], events=ended, rtol=1e-9, atol=1e-12,
            max_step=0.01,
        )  # fmt: skip
        left.plot(run.y[0], force(run.y[0], run.y[1]), color=colour, label=name)
    left.set(xlabel="indentation $d$", ylabel="force $F$", xlim=(0, None), ylim=(0, None))
    left.set_xticklabels([])
    left.set_yticklabels([])
    left.legend(loc="upper left")
    wanted = np.linspace(0.02, 1, 99)
    colours = {
        "hunt-crossley": GREEN,
        "lankarani-nikravesh": ORANGE,
        "flores": RED,
        "hu-guo": GREY,
        "gonthier": "#7b5ea7",
        "exact": BLUE,
    }
    for kind, colour in colours.items():
        right.plot(wanted, [delivered_restitution(LOSSES[kind](e)) for e in wanted], color=colour, label=kind)  # type: ignore[index]
    right.set(xlabel="restitution asked for", ylabel="restitution delivered", xlim=(0, 1), ylim=(0, 1))
    right.legend(loc="lower right")
    return figure


def stability() -> Figure:
    """Draw the modulus of stability functions on the imaginary axis."""
    figure, (axis,) = panels(1)
    y = np.linspace(0, 30, 1201)

    def modulus(A: np.ndarray, b: np.ndarray) -> np.ndarray:
        one = np.ones(len(b))
        return np.array([abs(1 + 1j * t * (b @ np.linalg.solve(np.eye(len(b)) - 1j * t * A, one))) for t in y])

    def collocation(nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        powers = np.arange(len(nodes))
        A = (nodes[:, None] ** (powers + 1) / (powers + 1)) @ np.linalg.inv(nodes[:, None] ** powers)
        return A, A[-1]

    lobatto = np.polynomial.legendre.Legendre.basis(5).deriv().roots()
    radau = (np.polynomial.legendre.Legendre.basis(4) - np.polynomial.legendre.Legendre.basis(5)).roots()
    axis.plot(
        y,
        modulus(*collocation(np.concatenate([[0], 0.5 * (lobatto + 1), [1]]))),
        color=BLUE,
        lw=2,
        label="Lobatto IIIA, order 10",
    )
    axis.plot(y, modulus(*collocation(np.sort(0.5 * (radau + 1)))), color=ORANGE, label="Radau IIA, order 9")
    explicit = modulus(dop853.A[:12, :12], dop853.B)
    axis.plot(y[explicit < 1.4], explicit[explicit < 1.4], color=GREY, label="Dormand and Prince, order 8")
    axis.set(xlabel="frequency times step, $\\omega h$", ylabel="modulus", xlim=(0, 30), ylim=(0, 1.3))
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def basis_estimate() -> Figure:
    """Draw the error of the impulse of a light mass on a bar, its differences and its estimate."""
    figure, (axis,) = panels(1)
    counts = np.array([8, 12, 16, 24, 32, 48, 64, 96, 128])

    def impulse(n: int) -> float:
        t, f = struck(n, 4.0, 0.1)
        return float(f.sum() * t[0])

    found = {int(n): impulse(int(n)) for n in {*counts, *(counts // 2), *(counts // 4), 600}}
    exact = found[600]
    error = np.array([abs(found[n] / exact - 1) for n in counts])
    halves = np.array([abs(found[n] - found[n // 2]) / found[n] for n in counts])
    quarters = np.array([abs(found[n // 2] - found[n // 4]) / found[n] for n in counts])
    axis.loglog(counts, 1.3 * np.maximum(halves, quarters / 2), color=BLUE, lw=2, label="estimate (10.2)")
    axis.loglog(counts, error, "o", color=ORANGE, ms=5, label="error")
    axis.loglog(counts, halves, ":", color=GREEN, label="$\\Delta_1$, from half of the modes")
    axis.loglog(counts, quarters / 2, "--", color=GREY, label="$\\Delta_2/2$, from half and a quarter")
    axis.set(xlabel="number of modes", ylabel="relative to the impulse", ylim=(1e-4, 0.4))
    axis.set_xticks(counts, [str(n) for n in counts])
    axis.minorticks_off()
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def reuse() -> Figure:
    """Draw what a change of thickness does to a wall in bending, and what reuse and its estimate say."""
    figure, (left, right) = panels(2)
    x = np.linspace(-0.1, 0.1, 201)
    for exponent, name, colour in ((1, "frequency", BLUE), (-3, "compliance", ORANGE)):
        left.plot(100 * x, 100 * ((1 + x) ** exponent - 1), color=colour, label=f"{name}")
        left.plot(100 * x, 100 * exponent * x, "--", color=colour, lw=1, label=f"{name}, by the derivative")
    left.axhline(0, color=FAINT, lw=1.2, label="kept")
    left.set(xlabel="change of thickness [%]", ylabel="change [%]", xlim=(-10, 10))
    left.legend(loc="upper right")
    small = np.geomspace(1e-4, 0.1, 100)
    true = np.abs((1 + small) ** -3 - 1)
    right.loglog(100 * small, 100 * true, color=ORANGE, label="compliance: error of reuse")
    right.loglog(100 * small, 100 * np.abs(true - 3 * small), "--", color=ORANGE, lw=1, label="error of its estimate")
    right.loglog(100 * small, 100 * small, color=BLUE, label="frequency: error of reuse")
    right.axhline(2, color=FAINT, lw=1, ls="--")
    right.set(xlabel="change of thickness [%]", ylabel="error [%]", ylim=(1e-4, 100))
    right.legend(loc="upper left")
    return figure


CURVES: dict[str, Callable[[], Figure]] = {
    "residual-flexibility": residual_flexibility, "reduction-shapes": reduction_shapes, "bar-on-wall": bar_on_wall,
    "contact-laws": contact_laws, "stability": stability, "basis-estimate": basis_estimate, "reuse": reuse,
}  # fmt: skip


def main(names: list[str]) -> None:
    """Draw some figures, or all."""
    figures = CURVES | SCHEMES
    # The same bytes for the same figure.
    settings = SETTINGS | {"svg.hashsalt": "gudgeon", "svg.fonttype": "path", "mathtext.fontset": "dejavusans"}
    with matplotlib.rc_context(settings):
        for name in names or list(figures):
            figure = figures[name]()
            figure.savefig(FOLDER / f"{name}.svg", format="svg", metadata={"Date": None}, facecolor="white")


if __name__ == "__main__":
    main(sys.argv[1:])
