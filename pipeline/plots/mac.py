"""The MAC matrix of two bases as a picture."""

from pathlib import Path

from gudgeon.pipeline.modes.comparison import ModeComparison

LABELLED = 40
"""Modes up to which each has its frequency at the axis."""


def draw_mac(comparison: ModeComparison, names: tuple[str, str], path: Path) -> None:
    """Write the MAC matrix of two bases as a PNG, modes of the first downwards."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows, columns = comparison.mac.shape
    figure = Figure(figsize=(min(3 + 0.25 * columns, 14), min(2.5 + 0.25 * rows, 14)), layout="constrained")
    axes = figure.add_subplot()
    image = axes.imshow(comparison.mac, vmin=0.0, vmax=1.0, cmap="Blues", origin="upper", aspect="equal")
    for axis, spectrum, name in zip((axes.yaxis, axes.xaxis), comparison.frequencies, names, strict=True):
        step = -(-len(spectrum) // LABELLED)
        axis.set_ticks(range(0, len(spectrum), step), [f"{mode + 1}: {spectrum[mode]:.4g}" for mode in
                                                       range(0, len(spectrum), step)])  # fmt: skip
        axis.set_label_text(f"{name}: mode and frequency [Hz]")
    axes.tick_params(axis="x", rotation=90)
    axes.tick_params(labelsize=7)
    figure.colorbar(image, ax=axes, label="MAC", shrink=0.8)
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure).print_png(str(path))
