"""Maps of contacts: their points unrolled onto a plane, pixels between them, and what the points carry at frames."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from matplotlib.tri import TriAnalyzer, Triangulation
from scipy.spatial import cKDTree

from gudgeon.modaldb.records.mesh import Surface
from gudgeon.modaldb.records.trajectory import ContactHistory
from gudgeon.pipeline.geometry.cells import FACET_WIDTH, corner_triangles
from gudgeon.pipeline.geometry.surfaces import cylindrical
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.hardest import Hardest, hardest
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.drive import hardest_first
from gudgeon.solver.contact.pressure import Patches, patches

LEAST_POINTS = 4
"""Least number of points of a map."""
SIDE = 600
"""Pixels along the longer side of a map."""
MILLIMETRE = 0.5e-3
"""Extent from which lengths are in mm [m]."""
PLANE = 1e-6
"""Thickness over width of points on a plane."""
SLIVER = 0.02
"""Least ratio of in- to circumradius (times two) of a triangle at the map's border."""
OPEN, STICKS, SLIPS = range(3)
"""Of a point in a frame."""
NEIGHBOURS = 7
"""Points by which directions are taken to a chart."""
SAME = 1e-6
"""Difference of a friction force from its limit, relative to it, that is round-off."""
LEAST = 1e-9
"""The same relative to the largest normal force."""


@dataclass(frozen=True)
class Chart:
    """Contact points on a plane."""

    shown: np.ndarray
    """Coordinates as labelled, (c, 2)."""
    metric: np.ndarray
    """The same in metres, (c, 2)."""
    labels: tuple[str, ...]
    """Of both axes."""
    filled: Triangulation | None = None
    """Facets of a plane surface [m]; None of others, and where they are not known."""

    @property
    def aspect(self) -> float:
        """Height of one labelled unit over the width of one, where lengths along both axes have one scale."""
        width, height = np.ptp(self.metric, axis=0) / np.ptp(self.shown, axis=0)
        return float(height / width)

    def in_holes(self, triangles: np.ndarray) -> np.ndarray:
        """Return which triangles (t, 3) of the points have their middle on no facet of the surface, (t,)."""
        if self.filled is None:
            return np.zeros(len(triangles), bool)
        return np.asarray(self.filled.get_trifinder()(*self.metric[triangles].mean(axis=1).T)) < 0


@dataclass(frozen=True)
class Raster:
    """Pixels of the box around a chart's points, row by row from below."""

    chart: Chart
    covered: np.ndarray
    """Whether a pixel is between the points and not in a hole, (h, w)."""
    positions: np.ndarray
    """Of the covered pixels [m], (n, 2)."""
    corners: np.ndarray
    """Points of the triangle of each, (n, 3)."""
    weights: np.ndarray
    """Of these in its value, (n, 3)."""

    @cached_property
    def nearest(self) -> np.ndarray:
        """Number of the point nearest to each covered pixel, (n,)."""
        return np.asarray(cKDTree(self.chart.metric).query(self.positions)[1], int)

    def between(self, values: np.ndarray) -> np.ndarray:
        """Return values of points (c,) interpolated linearly; NaN elsewhere, (h, w)."""
        return self._spread((values[self.corners] * self.weights).sum(axis=1))

    def of_nearest(self, values: np.ndarray) -> np.ndarray:
        """Return the value of the nearest of the points (c,) at each pixel; NaN elsewhere, (h, w)."""
        return self._spread(values[self.nearest])

    def _spread(self, values: np.ndarray) -> np.ndarray:
        image = np.full(self.covered.shape, np.nan)
        image[self.covered] = values
        return image

    def draw(self, axes: Axes, values: np.ndarray, *, points: bool = True, **colours: Any) -> AxesImage:
        """Draw values of pixels (h, w), both axes in one scale of length, and where the points are.

        Args:
            colours: As `Axes.imshow` takes them.
        """
        (x_low, low), (right, high) = self.chart.shown.min(axis=0), self.chart.shown.max(axis=0)
        image = axes.imshow(
            values, extent=(x_low, right, low, high), origin="lower", aspect=self.chart.aspect, interpolation="nearest",
            **colours,
        )  # fmt: skip
        axes.set_anchor("NW")
        if points:
            axes.plot(*self.chart.shown.T, ".", ms=1.6, color=style.INK, alpha=0.25, mew=0)
        axes.margins(0.0)
        style.plain_axes(axes)
        axes.set_xlabel(self.chart.labels[0])
        return image


@dataclass(frozen=True)
class Map:
    """A contact with a map, at f frames."""

    name: str
    body: str
    pixels: Raster
    multipliers: np.ndarray
    """[N], (f, c)"""
    pressure: np.ndarray
    """[Pa], (f, c)"""
    patches: Patches
    hardest: Hardest
    """Its largest force."""
    states: np.ndarray | None
    """OPEN, STICKS or SLIPS of each point, (f, c); None where the record has no friction of points."""
    friction: np.ndarray | None = None
    """Force on the points along the axes of the chart at the largest force [N], (c, 2)."""

    @property
    def chart(self) -> Chart:
        """The contact's points."""
        return self.pixels.chart


def chart(points: np.ndarray, surface: Surface | None, nodes: np.ndarray | None = None) -> Chart | None:
    """Unroll contact points to angle and height on a cylinder, else to principal axes; None of points on a line.

    Args:
        nodes: Of the mesh [m], (n, 3), to leave out holes of a plane surface.
    """
    filled = None
    if surface is not None and surface.shape.get("kind") == "cylinder":
        radius, angle, height = cylindrical(points, surface.shape)
        middle = np.angle(np.exp(1j * angle).mean())
        # Counted from the middle, so that a sector across ±180° is not split.
        angle = middle + np.angle(np.exp(1j * (angle - middle)))
        scale, unit = length_unit(height)
        shown = np.column_stack([np.degrees(angle), height * scale])
        metric, labels = np.column_stack([radius.mean() * angle, height]), ("angle [deg]", f"height [{unit}]")
    else:
        centre = points.mean(axis=0)
        _, sizes, axes = np.linalg.svd(points - centre, full_matrices=False)
        scale, unit = length_unit(points)
        labels = (f"first principal direction [{unit}]", f"second principal direction [{unit}]")
        flat, normal = sizes[-1] < PLANE * sizes[0], np.abs(axes[-1]) > 1 - PLANE
        if flat and normal.any():
            # On a face at right angles to an axis of the part: its other two, from the part's own origin.
            axes, centre = np.eye(3)[~normal], np.zeros(3)
            labels = tuple(f"{axis} of the part [{unit}]" for axis, n in zip("xyz", normal, strict=True) if not n)
        metric = (points - centre) @ axes[:2].T
        shown = metric * scale
        if flat and surface is not None and nodes is not None and surface.facets.shape[1] >= FACET_WIDTH:
            corners, cells = np.unique(corner_triangles(surface.facets)[0], return_inverse=True)
            x, y = axes[:2] @ (nodes[corners] - centre).T
            filled = Triangulation(x, y, cells.reshape(-1, 3))
    spread = np.ptp(metric, axis=0)
    return Chart(shown, metric, labels, filled) if spread.min() > 1e-6 * spread.max() else None


def length_unit(positions: np.ndarray) -> tuple[float, str]:
    """Return factor and unit in which positions [m], (c, ...), are written: mm, or smaller where they extend less."""
    extent = float(np.ptp(positions, axis=0).max())
    return (1e3, "mm") if extent >= MILLIMETRE else style.prefixed(extent, "m")


def on_an_edge(points: np.ndarray, normals: np.ndarray) -> bool:
    """Return whether points (c, 3) are those of the edge of a plane part: their normals (c, 3) lie in their plane."""
    _, sizes, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    return bool(sizes[-1] <= 1e-9 * sizes[0] and np.abs(normals @ axes[-1]).max() < 0.1)


def raster(plane: Chart, side: int) -> Raster:
    """Return the pixels of a chart, `side` of them along its longer side."""
    triangles = Triangulation(*plane.metric.T)
    slivers = TriAnalyzer(triangles).get_flat_tri_mask(SLIVER, rescale=False)
    triangles.set_mask(slivers | plane.in_holes(triangles.triangles))
    low, size = plane.metric.min(axis=0), np.ptp(plane.metric, axis=0)
    counts = np.maximum(2, np.rint(side * size / size.max())).astype(int)
    grid = np.meshgrid(*(a + b * (np.arange(n) + 0.5) / n for a, b, n in zip(low, size, counts, strict=True)))
    triangle = np.asarray(triangles.get_trifinder()(*grid))
    covered = triangle >= 0
    positions = np.column_stack([axis[covered] for axis in grid])
    corners = triangles.triangles[triangle[covered]]
    a, b, c = (plane.metric[corners[:, k]] for k in range(3))
    weights = np.column_stack([_cross(b - positions, c - positions), _cross(c - positions, a - positions)])
    weights /= _cross(b - a, c - a)[:, None]
    weights = np.column_stack([weights, 1.0 - weights.sum(axis=1)])
    return Raster(plane, covered, positions, corners, weights)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def states_of(multipliers: np.ndarray, friction: np.ndarray, kinetic: float) -> np.ndarray:
    """Return whether points are open, stick or slip, (f, c).

    Args:
        multipliers: Normal forces [N], (f, c).
        friction: On the points [N], (f, c, 3).
        kinetic: Coefficient of friction of points that slip.
    """
    size, limit = np.linalg.norm(friction, axis=2), kinetic * multipliers
    slips = np.abs(size - limit) <= SAME * limit + LEAST * multipliers.max(initial=0.0)
    return np.where(multipliers > 0, np.where(slips, SLIPS, STICKS), OPEN)


def on_chart(plane: Chart, points: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors at points (c, 3) along the axes of a chart, (c, 2), by the map of the nearest points."""
    count = min(NEIGHBOURS, len(points))
    turned = np.zeros((len(points), 2))
    for k, rows in enumerate(cKDTree(points).query(points, k=[*range(1, count + 1)])[1]):
        to_chart = np.linalg.lstsq(points[rows] - points[k], plane.metric[rows] - plane.metric[k], rcond=1e-6)[0]
        turned[k] = vectors[k] @ to_chart
    return turned


def kinetic_of(friction: Mapping[str, Any]) -> float:
    """Return the coefficient of kinetic friction of a contact of a scene."""
    kinetic = friction.get("kinetic")
    return float(friction["static"] if kinetic is None else kinetic)


def mapped(drawing: Drawing) -> dict[str, ContactHistory]:
    """Return the contacts with enough points for a map that were closed in some frame."""
    return {
        name: contact
        for name, contact in drawing.trajectory.contacts.items()
        if contact.multipliers.shape[1] >= LEAST_POINTS and contact.multipliers.any()
    }


def maps_of(drawing: Drawing) -> list[Map]:
    """Return the contacts that have a map; of a driven scene, the hardest first."""
    contacts = mapped(drawing)
    names = hardest_first(contacts) if drawing.driven else [*contacts]
    return [contact_map for name in names if (contact_map := _map(drawing, name)) is not None]


def _map(drawing: Drawing, name: str) -> Map | None:
    contact = drawing.trajectory.contacts[name]
    body = drawing.body(contact.body)
    interface = body.modal.interfaces[contact.interface]
    plane, strongest = (
        chart(contact.points, body.surface(contact.interface), body.nodes),
        hardest(drawing.trajectory, [name]),
    )
    if plane is None or strongest is None or on_an_edge(contact.points, interface.normals):
        return None
    areas, forces, states = interface.areas if contact.areas is None else contact.areas, contact.multipliers, None
    cells = patches(contact.points, areas)
    pressure = np.where(cells.slivers, cells.mean(forces), forces / areas)
    if contact.friction is not None:
        states = states_of(forces, contact.friction, kinetic_of(drawing.scene["contact"][name]["friction"]))
    friction = contact.friction
    drawn = None if friction is None else on_chart(plane, contact.points, friction[strongest.frame])
    return Map(
        name, body.name, raster(plane, SIDE), forces, pressure, cells, hardest=strongest, states=states, friction=drawn
    )
