"""`pressure.png`: contact pressure over the unrolled interface, at the largest contact force and as peak over time.

A driven scene has one picture, with a panel for each contact at its own largest force. Both axes have one scale of
length. Values between points are interpolated linearly; holes of a plane surface are left out. The printed value is the
largest mean over a patch of stated area; a point whose area is a sliver shows the mean over its patch.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from matplotlib.figure import Figure
from matplotlib.tri import LinearTriInterpolator, TriAnalyzer, Triangulation

from gudgeon.modaldb.records.mesh import Surface
from gudgeon.modaldb.records.trajectory import ContactHistory
from gudgeon.pipeline.geometry.surfaces import cylindrical
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.hardest import Hardest, hardest
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.drive import drive_of, frame_degrees, hardest_first, shown_angle
from gudgeon.solver.contact.pressure import Patches, patches, pressure_peak

LEAST_POINTS = 4
"""Least number of points of a map."""
GRID = 600
"""Values interpolated along each side of a map."""
LEFT, BETWEEN, WIDE = 0.08, 0.05, 0.79
"""Left border of the maps, distance between them, and width of all, of the figure's width."""
HEAD, FOOT, LOW, HIGH = 240, 130, 200, 830
"""Heights above and below the maps, and least and largest height of a map [px]."""
PLANE = 1e-6
"""Thickness over width of points on a plane."""
SLIVER = 0.02
"""Least ratio of in- to circumradius (times two) of a triangle at the map's border."""


@dataclass(frozen=True)
class Chart:
    """Contact points on a plane."""

    shown: np.ndarray
    """Coordinates as labelled, (c, 2)."""
    metric: np.ndarray
    """The same in metres, (c, 2)."""
    labels: tuple[str, str]
    filled: Triangulation | None = None
    """Facets of a plane surface [m]; None of others, and where they are not known."""

    @property
    def aspect(self) -> float:
        """Height of one labelled unit over the width of one, where lengths along both axes have one scale."""
        across, up = np.ptp(self.metric, axis=0) / np.ptp(self.shown, axis=0)
        return float(up / across)


def draw_pressure(drawing: Drawing) -> None:
    """Draw one picture for each contact with enough points that was closed in some frame."""
    wanted, maps = _wanted(drawing), maps_of(drawing)
    if drawing.driven and maps:
        style.draw(drawing.file("pressure.png"), _beside, drawing, maps)
        return
    for found in maps:
        style.draw(drawing.file("pressure.png", found.name, len(wanted)), _picture, drawing, found)


def _wanted(drawing: Drawing) -> dict[str, ContactHistory]:
    """Return the contacts with enough points that were closed in some frame."""
    return {
        name: contact
        for name, contact in drawing.trajectory.contacts.items()
        if contact.multipliers.shape[1] >= LEAST_POINTS and contact.multipliers.any()
    }


def maps_of(drawing: Drawing) -> "list[Map]":
    """Return the pressures of the contacts that have a map; of a driven scene, the hardest contact first."""
    wanted = _wanted(drawing)
    names = hardest_first(wanted) if drawing.driven else [*wanted]
    return [found for name in names if (found := _strongest(drawing, name)) is not None]


def chart(points: np.ndarray, surface: Surface | None, nodes: np.ndarray | None = None) -> Chart | None:
    """Unroll contact points to angle and height on a cylinder, else to principal axes; None of points on a line.

    Args:
        nodes: Of the mesh [m], (n, 3), to leave out holes of a plane surface.
    """
    if surface is not None and surface.shape.get("kind") == "cylinder":
        radius, angle, height = cylindrical(points, surface.shape)
        middle = np.angle(np.exp(1j * angle).mean())
        # Counted from the middle, so that a sector across ±180° is not split.
        angle = middle + np.angle(np.exp(1j * (angle - middle)))
        found = Chart(
            np.column_stack([np.degrees(angle), height * 1e3]),
            np.column_stack([radius.mean() * angle, height]),
            ("angle [deg]", "height [mm]"),
        )
    else:
        centre = points.mean(axis=0)
        _, sizes, axes = np.linalg.svd(points - centre, full_matrices=False)
        labels = ("first principal direction [mm]", "second principal direction [mm]")
        own = np.abs(axes[-1]) > 1 - PLANE
        if own.any() and sizes[-1] < PLANE * sizes[0]:
            # On a face at right angles to an axis of the part: its other two, from the part's own origin.
            axes, centre = np.eye(3)[~own], np.zeros(3)
            first, second = (name for name, off in zip("xyz", own, strict=True) if not off)
            labels = (f"{first} of the part [mm]", f"{second} of the part [mm]")
        pair = (points - centre) @ axes[:2].T
        filled = None
        if surface is not None and nodes is not None and surface.facets.shape[1] == 6 and sizes[-1] < PLANE * sizes[0]:
            corners, number = np.unique(surface.facets[:, :3], return_inverse=True)
            across, up = axes[:2] @ (nodes[corners] - centre).T
            filled = Triangulation(across, up, number.reshape(-1, 3))
        found = Chart(pair * 1e3, pair, labels, filled)
    spread = np.ptp(found.metric, axis=0)
    return found if spread.min() > 1e-6 * spread.max() else None


def in_holes(plane: Chart, triangles: np.ndarray) -> np.ndarray:
    """Return which triangles (t, 3) of a chart's points have their middle on no facet of the surface, (t,)."""
    if plane.filled is None:
        return np.zeros(len(triangles), bool)
    middles = plane.metric[triangles].mean(axis=1)
    return np.asarray(plane.filled.get_trifinder()(middles[:, 0], middles[:, 1])) < 0


def on_an_edge(points: np.ndarray, normals: np.ndarray) -> bool:
    """Return whether points (c, 3) are those of the edge of a plane part: their normals (c, 3) lie in their plane."""
    _, sizes, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    return bool(sizes[-1] <= 1e-9 * sizes[0] and np.abs(normals @ axes[-1]).max() < 0.1)


@dataclass(frozen=True)
class Map:
    """The pressure of one contact."""

    name: str
    body: str
    plane: Chart
    pressure: np.ndarray
    """At all frames [Pa], (f, c)."""
    most: Hardest
    """Its largest force."""
    over: Patches
    multipliers: np.ndarray
    """[N], (f, c)"""

    def peak_text(self, frame: int | None = None) -> str:
        """Return the largest mean over a patch, in one frame or in all, with the patch's area and place."""
        shown = self.multipliers if frame is None else self.multipliers[frame : frame + 1]
        peak = pressure_peak(self.over, shown)
        place = self.plane.shown[peak.point]
        units = (" " + label.partition("[")[2].rstrip("]") for label in self.plane.labels)
        at = ", ".join(style.signed(x, 1) + unit.replace(" deg", "°") for x, unit in zip(place, units, strict=True))
        return f"largest mean {style.quantity(peak.pressure, 'Pa')} over {peak.area * 1e6:.3g} mm²\nat {at}"

    @property
    def sliver_text(self) -> str:
        """Return what the picture does with points whose area is a sliver, and the force that they carry."""
        count = int(self.over.slivers.sum())
        if not count:
            return ""
        share = self.multipliers[self.most.frame, self.over.slivers].sum() / self.multipliers[self.most.frame].sum()
        return f"  ·  {count} border points with slivers of area ({share:.1%} of the force) show their patch's mean"


def _strongest(drawing: Drawing, name: str) -> Map | None:
    contact = drawing.trajectory.contacts[name]
    body = drawing.body(contact.body)
    interface = body.modal.interfaces[contact.interface]
    plane = chart(contact.points, body.surface(contact.interface), body.nodes)
    if plane is None or on_an_edge(contact.points, interface.normals):
        return None
    most = hardest(drawing.trajectory, [name])
    assert most is not None
    areas = interface.areas if contact.areas is None else contact.areas
    over = patches(contact.points, areas)
    pressure = np.where(over.slivers, over.mean(contact.multipliers), contact.multipliers / areas)
    return Map(name, body.name, plane, pressure, most, over=over, multipliers=contact.multipliers)


def _picture(drawing: Drawing, found: Map) -> Figure:
    """Draw one contact at its largest force, and the peak of each of its points."""
    points = f"{len(found.plane.shown)} contact points on body {found.body}"
    subtitle = f"{drawing.scene_name}  ·  {points}{found.sliver_text}"
    most = found.most
    moment = f"{style.moment_text(most, drawing.trajectory)}\n{found.peak_text(most.frame)}"
    every = f"largest of each point in all frames\n{found.peak_text()}"
    panels = {moment: found.pressure[most.frame], every: found.pressure.max(axis=0)}
    figure, drawn = _panels(subtitle, [(found.plane, values) for values in panels.values()])
    for column, axes in enumerate(drawn):
        axes.set_title([*panels][column], loc="left", fontsize=8.5, linespacing=1.5)
        if column:
            axes.set_yticklabels([])
    return figure


def _beside(drawing: Drawing, maps: Sequence[Map]) -> Figure:
    """Draw maps of several contacts, each at its largest force, side by side with one colour scale."""
    angles = frame_degrees(drawing, drive_of(drawing))
    points = sum(found.pressure.shape[1] for found in maps)
    subtitle = f"{drawing.scene_name}  ·  each contact at its largest force  ·  {points} contact points"
    hidden = sum(int(found.over.slivers.sum()) for found in maps)
    subtitle += f", {hidden} of them slivers with their patch's mean" if hidden else ""
    figure, panels = _panels(subtitle, [(found.plane, found.pressure[found.most.frame]) for found in maps])
    for found, axes in zip(maps, panels, strict=True):
        angle = shown_angle(float(angles[found.most.frame]), 1)
        title = f"{found.name}: {style.quantity(found.most.force, 'N')} at crank angle {angle}°"
        text, size = f"{title}\n{found.peak_text(found.most.frame)}", 8.5 if len(maps) < 3 else 6.5
        axes.set_title(text, loc="left", fontsize=size, linespacing=1.5)
    return figure


def _panels(subtitle: str, maps: Sequence[tuple[Chart, np.ndarray]]) -> tuple[Figure, list[Axes]]:
    """Draw maps side by side in a figure as high as they need, with one colour bar for their pressures [Pa]."""
    top = max(float(values.max()) for _, values in maps)
    scale, unit = style.prefixed(top, "Pa")
    width = (WIDE - BETWEEN * (len(maps) - 1)) / len(maps)
    tall = max(float(np.divide(*np.ptp(plane.metric, axis=0)[::-1])) for plane, _ in maps)
    inner = round(min(HIGH, max(LOW, tall * width * style.WIDTH)))
    height = inner + HEAD + FOOT
    low, share = FOOT / height, inner / height
    figure = style.new_figure("Contact pressure", subtitle, height=height)
    panels = [figure.add_axes((LEFT + (width + BETWEEN) * n, low, width, share)) for n in range(len(maps))]
    for axes, (plane, values) in zip(panels, maps, strict=True):
        image = _map(axes, plane, values * scale, top * scale)
        axes.set_xlabel(plane.labels[0])
        if axes is panels[0]:
            axes.set_ylabel(plane.labels[1])
            style.colour_bar(figure, image, f"contact pressure [{unit}]", (0.892, low, 0.018, share))
    return figure, panels


def _map(axes: Axes, plane: Chart, values: np.ndarray, top: float) -> ScalarMappable:
    triangles = Triangulation(plane.metric[:, 0], plane.metric[:, 1])
    mask = TriAnalyzer(triangles).get_flat_tri_mask(SLIVER, rescale=False) | in_holes(plane, triangles.triangles)
    shown = Triangulation(plane.shown[:, 0], plane.shown[:, 1], triangles.triangles[~mask])
    low, high = plane.shown.min(axis=0), plane.shown.max(axis=0)
    across, up = (np.linspace(a, b, 2 * GRID + 1)[1::2] for a, b in zip(low, high, strict=True))
    between = LinearTriInterpolator(shown, values)(*np.meshgrid(across, up))
    image = axes.imshow(
        between, extent=(low[0], high[0], low[1], high[1]), origin="lower", aspect=plane.aspect,
        interpolation="nearest", cmap=colours(), vmin=0.0, vmax=top,
    )  # fmt: skip
    axes.set_anchor("NW")
    axes.plot(*plane.shown.T, ".", ms=1.6, color=style.INK, alpha=0.25, mew=0)
    style.plain_axes(axes)
    axes.margins(0.0)
    return image


def colours() -> LinearSegmentedColormap:
    """Return a colour map from light grey at zero pressure through the bright part of magma to its violet."""
    magma = colormaps[style.PRESSURE](np.linspace(0.02, 0.76, 15))
    return LinearSegmentedColormap.from_list("pressure", [to_rgba(style.GROUND), *magma])
