"""Schemes of docs/theory, which are drawn by `docs.tools.theory_figures`."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.tri import Triangulation

from gudgeon.modaldb.records.traction import cubic_weights
from gudgeon.pipeline.plots.base.style import BLUE, FAINT, GREEN, GREY, GROUND, INK, ORANGE, RED, SIGNED

WIDTH, HEIGHT = 8.6, 3.3
"""Size of a figure of two panels [in]."""


def panels(count: int, *, width: float = WIDTH, height: float = HEIGHT) -> tuple[Figure, list[Axes]]:
    """Return a figure with panels next to each other, (count,)."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, list(np.atleast_1d(figure.subplots(1, count)))


def blank(axes: Axes) -> None:
    """Leave axes without frame and ticks, lengths to scale."""
    axes.set_axis_off()
    axes.set_aspect("equal")


def arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], colour: str, *, both: bool = False) -> None:
    """Draw an arrow from one place to another."""
    style = "<|-|>" if both else "-|>"
    axes.annotate(
        "", end, start, arrowprops={"arrowstyle": style, "color": colour, "lw": 1.4, "shrinkA": 0, "shrinkB": 0}
    )


def gap_and_force() -> Figure:
    """Draw the three parts of a gap, and forces over the approach."""
    figure, (left, right) = panels(2)
    blank(left)
    x = np.linspace(-1.6, 1.6, 200)
    placed, moved = 1.55 + 0.28 * x**2, 0.95 + 0.24 * x**2 + 0.06 * np.sin(3 * x + 0.5)
    dented = moved + 0.33 * np.exp(-((x / 0.28) ** 2))
    left.fill_between(x, dented, 2.6, color=GROUND)
    left.fill_between([-1.7, 1.7], -0.22, 0, color="#d8dee4")
    left.plot([-1.7, 1.7], [0, 0], color=INK, lw=1.2)
    left.plot(x, placed, color=GREY, ls=":", label="as placed")
    left.plot(x, moved, color=BLUE, ls="--", label="rigid motion and modes")
    left.plot(x, dented, color=INK, lw=1.6, label="with the residual")
    height = float(np.interp(0, x, moved))
    arrow(left, (-0.42, 0), (-0.42, 1.55), FAINT)
    left.text(-0.5, 0.75, "$g_0$", ha="right", va="center")
    arrow(left, (0.42, 1.55), (0.42, height), BLUE)
    left.text(0.5, 1.2, "$W q$", color=BLUE, va="center")
    arrow(left, (0, height), (0, float(dented.max(where=np.abs(x) < 0.05, initial=0))), ORANGE)
    left.text(0.06, 1.16, "$R\\lambda$", color=ORANGE, va="center")
    arrow(left, (0, 0), (0, height), GREEN, both=True)
    left.text(0.07, 0.4, "$g$ without $R\\lambda$", color=GREEN, va="center")
    left.set(xlim=(-1.7, 1.7), ylim=(-0.25, 2.75))
    left.legend(loc="upper center", ncols=3, fontsize=7.5, columnspacing=1, handlelength=1.6)
    approach = np.array([-0.9, 0.0, 1.0])
    for slope, name, colour in (
        (6.0, "$R$ alone", BLUE),
        (2.2, "$R$ and a layer", GREEN),
        (0.9, "soft penalty", ORANGE),
    ):
        right.plot(approach, np.maximum(0, slope * approach), color=colour, label=name)
    right.plot([-0.9, 0, 0], [0, 0, 3], color=INK, lw=1.6, label="rigid")
    right.set(
        xlabel="approach without contact forces, $-(g_0 + W q)$",
        ylabel="force $\\lambda$",
        xlim=(-0.9, 1),
        ylim=(-0.1, 3),
    )
    right.set_xticks([0])
    right.set_yticks([0])
    right.legend(loc="upper left")
    return figure


def interface_functions() -> Figure:
    """Draw the function of a side of a facet, and splines along a traction space."""
    figure, (left, right) = panels(2)
    blank(left)
    corners = np.array([[0.0, 0.0], [1.0, 0.05], [0.42, 0.85]])
    steps = np.array([(i, j) for i in range(41) for j in range(41 - i)]) / 40
    barycentric = np.column_stack([1 - steps.sum(axis=1), steps])
    mesh = Triangulation(*(barycentric @ corners).T)
    left.tripcolor(
        mesh, 1 - 2 * barycentric[:, 2], cmap=SIGNED, vmin=-1.3, vmax=1.3, shading="gouraud", rasterized=True
    )
    left.add_patch(Polygon(corners, fill=False, color=INK, lw=1.2))
    for i, value in enumerate((1, 0, 0)):
        middle = 0.5 * (corners[i] + corners[(i + 1) % 3])
        left.plot(*middle, "o", color=INK, ms=6)
        offset = np.array([(0, -0.09), (0.09, 0.03), (-0.09, 0.03)][i])
        left.text(*(middle + offset), f"{value}", ha="center", va="center", fontsize=11)
    left.text(*(corners[2] + [0, 0.06]), "−1", ha="center", fontsize=11)
    left.set_title("$\\psi$ of the lower side", fontsize=9.5)
    left.set(xlim=(-0.15, 1.15), ylim=(-0.2, 1.0))
    t = np.linspace(0, 1, 50)
    values, place = cubic_weights(t), 3.35
    for a in range(8):
        pieces = [(a + k - 3 + t, values[:, 3 - k]) for k in range(4)]
        x, y = (np.concatenate(part) for part in zip(*pieces, strict=True))
        right.plot(x + 1, y, color=GREY, lw=1)
    weights = cubic_weights(np.array([place % 1]))[0]
    right.plot([place, place], [0, weights.max()], color=FAINT, lw=0.8)
    for weight, side in zip(weights, ("right", "left", "left", "left"), strict=True):
        right.plot(place, weight, "o", color=ORANGE, ms=6)
        aside = 0.12 if side == "left" else -0.12
        right.text(place + aside, weight + 0.012, f"{weight:.2f}", color=ORANGE, ha=side, va="bottom")
    right.set(xlabel="place over the spacing of knots, $\\xi$", ylabel="$N_a$", xlim=(0, 6), ylim=(0, 0.8))
    return figure


def closing_within_a_step() -> Figure:
    """Draw gap and force of a point that closes within a step."""
    figure, (left, right) = panels(2, height=2.7)
    share, end = 0.4, 1.0
    left.plot([0, share], [0.6, 0], color=BLUE, lw=1.8)
    left.plot([share, 1], [0, -0.9], color=BLUE, lw=1.2, ls="--", label="without a force")
    left.plot([share, 1], [0, 0], color=BLUE, lw=1.8, label="with it")
    left.set(ylabel="gap", ylim=(-1, 0.7))
    left.legend(loc="lower left")
    right.fill_between([share, 1], [0, end], color=ORANGE, alpha=0.25, lw=0)
    right.plot([0, share, 1], [0, 0, end], color=ORANGE, lw=1.8)
    right.axhline(0.5 * end, color=GREY, ls="--", lw=1)
    right.text(0.02, 0.53, "half of the force at the end", color=FAINT)
    right.axhline(0.5 * (1 - share) * end, color=INK, lw=1)
    right.text(0.02, 0.33, "mean over the step, $\\frac{1}{2}(1-\\vartheta)\\,\\lambda^+$", color=INK)
    right.set(ylabel="force", ylim=(0, 1.1), yticks=(0, end))
    right.set_yticklabels(["0", "$\\lambda^+$"])
    left.set_yticks([0])
    for axes in (left, right):
        axes.set(xlim=(0, 1), xticks=(0, share, 1), xlabel="time")
        axes.set_xticklabels(["$t$", "$t+\\vartheta h$", "$t+h$"])
    return figure


def friction_cone() -> Figure:
    """Draw the cone of a point, the projection in its disc, and the cycle of a bar on a rough ground."""
    figure, (left, middle, right) = panels(3, height=3.0)
    for axes in (left, middle):
        blank(axes)
    left.add_patch(Polygon([(0, 0), (-0.75, 1.5), (0.75, 1.5)], color=GROUND))
    left.plot([-0.75, 0, 0.75], [1.5, 0, 1.5], color=INK)
    arrow(left, (0, 0), (0, 1.65), GREY)
    left.text(0.06, 1.6, "$\\lambda_n$")
    arrow(left, (-1, 0), (1, 0), GREY)
    left.text(1.0, 0.08, "$\\lambda_t$", ha="right")
    arrow(left, (0, 0), (0.38, 1.1), BLUE)
    left.text(0.1, 1.18, "sticks", color=BLUE, fontsize=9)
    arrow(left, (0, 0), (-0.55, 1.1), RED)
    left.text(-0.62, 1.02, "slips", color=RED, ha="right", fontsize=9)
    left.text(0.38, 0.42, "slope $\\mu$", color=FAINT, fontsize=9)
    left.set(xlim=(-1.1, 1.1), ylim=(-0.15, 1.75))
    middle.add_patch(Circle((0, 0), 1, color=GROUND))
    middle.add_patch(Circle((0, 0), 1, fill=False, color=INK))
    arrow(middle, (0, 0), (0.35, -0.5), BLUE)
    middle.text(0.38, -0.62, "stays", color=BLUE, fontsize=9)
    trial = np.array([1.15, 1.0])
    middle.plot([0, trial[0]], [0, trial[1]], color=GREY, ls="--", lw=1)
    middle.plot(*trial, "o", color=RED, ms=5, mfc="white")
    middle.text(1.15, 1.1, "$\\lambda_t - \\rho s$", color=RED, ha="center", fontsize=9)
    arrow(middle, (0, 0), tuple(trial / np.linalg.norm(trial)), RED)
    middle.text(-0.95, -1.28, "$|\\lambda_t| \\leq \\mu\\lambda_n$", fontsize=9)
    middle.set(xlim=(-1.3, 1.6), ylim=(-1.4, 1.4))
    load = np.linspace(0, 1, 100)
    turn = np.linspace(-1, 1, 200)
    right.plot(load**2, load, color=FAINT, label="first load")
    right.plot(1 - (1 - turn) ** 2 / 2, turn, color=BLUE, label="cycle")
    right.plot(-1 + (1 + turn) ** 2 / 2, turn, color=BLUE)
    right.set(
        xlabel="displacement of the end",
        ylabel="load",
        xlim=(-1.1, 1.1),
        ylim=(-1.1, 1.1),
        xticks=(-1, 0, 1),
        yticks=(-1, 0, 1),
    )
    right.legend(loc="upper left", fontsize=8)
    return figure


def floating_frame() -> Figure:
    """Draw frame and deformation of a body, and the shortening of a bent beam."""
    figure, (left, right) = panels(2, height=3.0)
    for axes in (left, right):
        blank(axes)
    arrow(left, (0, 0), (0.7, 0), INK)
    arrow(left, (0, 0), (0, 0.7), INK)
    left.text(-0.1, -0.18, "scene")
    angle, centre = np.radians(24), np.array([2.2, 1.0])
    Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    s = np.linspace(-1.3, 1.3, 100)
    bend = 0.42 * (s / 1.3) ** 2 - 0.14
    for y, colour, style in ((0 * s, GREY, ":"), (bend, BLUE, "-")):
        outline = np.concatenate([np.column_stack([s, y + 0.13]), np.column_stack([s, y - 0.13])[::-1]])
        left.add_patch(Polygon(outline @ Q.T + centre, fill=style == "-", fc=GROUND, ec=colour, ls=style, lw=1.4))
    for axis in Q.T:
        arrow(left, tuple(centre), tuple(centre + 0.62 * axis), ORANGE)
    left.text(*(centre + Q @ [0.02, 0.68]), "$Q$", color=ORANGE, ha="center")
    arrow(left, (0, 0), tuple(centre), GREEN)
    left.text(1.05, 0.3, "$x$", color=GREEN)
    point = np.array([1.12, 0.0])
    bent = np.array([1.12, 0.42 * (1.12 / 1.3) ** 2 - 0.14])
    arrow(left, tuple(centre), tuple(centre + Q @ point), FAINT)
    left.text(*(centre + Q @ [0.72, -0.26]), "$a$", color=FAINT)
    arrow(left, tuple(centre + Q @ point), tuple(centre + Q @ bent), RED)
    left.text(*(centre + Q @ [1.2, 0.02]), "$\\phi q$", color=RED)
    left.set(xlim=(-0.2, 4.1), ylim=(-0.3, 2.3))
    x = np.linspace(0, 1, 100)
    w, slope = 0.34 * (3 * x**2 - x**3) / 2, 0.34 * (6 * x - 3 * x**2) / 2
    short = np.concatenate([[0], np.cumsum(0.5 * 0.5 * (slope[1:] ** 2 + slope[:-1] ** 2) * np.diff(x))])
    right.plot([0, 0], [-0.15, 0.2], color=INK, lw=3)
    right.plot(x, 0 * x, color=GREY, ls=":", lw=2, label="undeformed")
    right.plot(x, w, color=ORANGE, lw=1.6, ls="--", label="$a + \\phi q$, too long")
    right.plot(x - short, w, color=BLUE, lw=2.4, label="with $-\\frac{1}{2} q^T K q$")
    arrow(right, (1, w[-1] + 0.05), (1 - short[-1], w[-1] + 0.05), RED)
    right.set(xlim=(-0.05, 1.15), ylim=(-0.2, 0.75))
    right.legend(loc="upper left")
    return figure


SCHEMES: dict[str, Callable[[], Figure]] = {
    "gap-and-force": gap_and_force, "interface-functions": interface_functions,
    "closing-within-a-step": closing_within_a_step, "friction-cone": friction_cone, "floating-frame": floating_frame,
}  # fmt: skip
"""Figures by the name of their file."""
