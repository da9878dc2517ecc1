"""Bars of relative derivatives, a panel for each quantity."""

from collections.abc import Mapping
from pathlib import Path

SHOWN = 20
"""Largest number of bars of a panel."""


def draw(path: Path, scene: str, bars: Mapping[str, Mapping[str, float]]) -> None:
    """Draw the relative derivatives p/J dJ/dp of quantities by key, the largest first."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    panels = max(1, len(bars))
    rows = [min(SHOWN, len(of)) for of in bars.values()] or [1]
    figure, axes = pyplot.subplots(
        panels, 1, figsize=(8, 0.8 * panels + 0.3 * sum(rows) + 0.6), squeeze=False, height_ratios=rows,
        layout="constrained",
    )  # fmt: skip
    for axis, (name, of) in zip(axes[:, 0], bars.items(), strict=False):
        largest = sorted(of.items(), key=lambda item: -abs(item[1]))[:SHOWN][::-1]
        colours = ["tab:blue" if value >= 0 else "tab:red" for _, value in largest]
        axis.barh([key for key, _ in largest], [value for _, value in largest], color=colours)
        axis.axvline(0.0, color="black", linewidth=0.8)
        axis.set_title(name, fontsize=10)
        axis.tick_params(labelsize=8)
    axes[-1, 0].set_xlabel("relative derivative p/J dJ/dp [1]")
    figure.suptitle(scene)
    figure.savefig(path, dpi=120)
    pyplot.close(figure)
