"""`nodal-diameters.png` and `blades.png` of a wheel: frequencies over harmonics, and the response of every blade."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

from gudgeon.modaldb.records.cyclic import CyclicRecord, WheelRecord
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing

NUMBERED = 30
"""Number of blades up to which their numbers and changes of stiffness are written."""


def draw_nodal_diameters(drawing: Drawing) -> None:
    """Draw the frequencies of every harmonic, the harmonic of the engine order and the frequency band of the force."""
    wheel: WheelRecord = drawing.store.get(drawing.key, "wheel", only=["excitation"])
    cyclic: CyclicRecord = drawing.store.get(wheel.modes_key, "cyclic", only=["harmonics"])
    style.draw(drawing.file("nodal-diameters.png"), _diameters, drawing.scene_name, wheel, cyclic)


def draw_blades(drawing: Drawing) -> None:
    """Draw the amplitude of every blade over frequency, and the peak of each blade."""
    wheel: WheelRecord = drawing.store.get(drawing.key, "wheel")
    style.draw(drawing.file("blades.png"), _blades, drawing.scene_name, wheel)


def harmonic_of(engine_order: int, sectors: int) -> int:
    """Return the harmonic that an engine order excites: the order itself, or its alias on so few blades."""
    return min(engine_order % sectors, -engine_order % sectors)


def _diameters(scene: str, wheel: WheelRecord, cyclic: CyclicRecord) -> Figure:
    harmonics = sorted(cyclic.harmonics.values(), key=lambda h: h.harmonic)
    numbers = [h.harmonic for h in harmonics]
    table = np.array([h.angular_frequencies for h in harmonics]) / (2 * np.pi)
    factor, unit = style.prefixed(float(table.max()), "Hz")
    r, excited = wheel.engine_order, harmonic_of(wheel.engine_order, cyclic.sectors)
    missed = sum(h.quality["expected"] - h.quality["found"] for h in harmonics)
    worst = max(float(h.residuals.max()) for h in harmonics)
    figure = style.new_figure(
        "Frequencies over nodal diameters",
        f"{scene}  ·  {cyclic.sectors} sectors, {table.shape[1]} modes of each harmonic  ·  residuals up to"
        f" {worst:.0e}, {missed} missing by inertia count",
    )
    axes = figure.add_axes((0.09, 0.1, 0.87, 0.73))
    band = wheel.excitation[[0, -1]] / (2 * np.pi) * factor
    axes.axhspan(*band, color=style.ORANGE, alpha=0.16, lw=0, zorder=0)
    axes.axvline(excited, color=style.ORANGE, lw=1.2, zorder=1)
    for family in table.T:
        axes.plot(numbers, family * factor, "-", color=style.GREY, lw=1.0, alpha=0.6, zorder=2)
    pair = np.array([h.multiplicity == 2 for h in harmonics])
    for which, colour, label in ((pair, style.BLUE, "pair of modes"), (~pair, style.GREEN, "single mode")):
        x = np.repeat(np.array(numbers)[which], table.shape[1])
        axes.plot(x, table[which].ravel() * factor, "o", ms=4.5, color=colour, label=label, zorder=3)
    axes.plot([], [], color=style.ORANGE, lw=1.2, label=f"harmonic of engine order {r}")
    axes.fill_between([], [], color=style.ORANGE, alpha=0.16, lw=0, label="band of the force")
    axes.set(xlabel="harmonic (nodal diameters)", ylabel=f"frequency [{unit}]", xticks=numbers, yscale="log")
    axes.set_xlim(-0.4, numbers[-1] + 0.4)
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, columnspacing=1.6)
    return figure


def _blades(scene: str, wheel: WheelRecord) -> Figure:
    tuned, mistuned = (np.hypot(*np.moveaxis(v, -1, 0)) for v in (wheel.tuned, wheel.mistuned))
    sectors, size = tuned.shape[1], wheel.counts["coordinates"]
    factor, unit = style.prefixed(float(mistuned.max()), "m/N")
    hertz = wheel.excitation / (2 * np.pi)
    gain = wheel.quantities["magnification"]["value"]
    highest = int(mistuned.max(axis=0).argmax())
    figure = style.new_figure(
        "Amplitudes of the blades",
        f"{scene}  ·  engine order {wheel.engine_order}, loss factor {wheel.loss_factor:g}, {size:,} coordinates"
        f"  ·  magnification {gain:.3f}; Whitehead's bound {(1 + np.sqrt(sectors)) / 2:.3f}",
    )
    axes = figure.add_axes((0.09, 0.44, 0.87, 0.42))
    axes.plot(hertz, mistuned * factor, color=style.BLUE, lw=0.7, alpha=0.45)
    axes.plot([], [], color=style.BLUE, lw=0.9, alpha=0.6, label=f"each of {sectors} mistuned blades")
    axes.plot(hertz, mistuned[:, highest] * factor, color=style.RED, lw=1.4, label=f"blade {highest}")
    axes.plot(hertz, tuned[:, 0] * factor, color=style.INK, lw=1.4, label="every blade of the tuned wheel")
    axes.set(xlabel="frequency [Hz]", ylabel=f"amplitude [{unit}]", xlim=(hertz[0], hertz[-1]), ylim=(0, None))
    axes.legend(loc="upper right")
    lower = figure.add_axes((0.09, 0.09, 0.87, 0.24))
    peaks = mistuned.max(axis=0) / tuned.max()
    colours = [style.RED if j == highest else style.BLUE for j in range(sectors)]
    lower.bar(np.arange(sectors), peaks, width=0.82, color=colours)
    lower.axhline(1.0, color=style.INK, lw=1.2)
    lower.set(xlabel="blade", ylabel="largest / tuned", xlim=(-0.6, sectors - 0.4))
    if sectors <= NUMBERED:
        for j, change in enumerate(wheel.stiffness_changes):
            text = style.signed(100 * change, 1)
            lower.text(j, 0.04 * peaks.max(), text, fontsize=6.5, color="white", ha="center")
        lower.set(xlabel="blade; the number in its bar is the change of its stiffness [%]", xticks=np.arange(sectors))
    lower.grid(axis="x", visible=False)
    return figure
