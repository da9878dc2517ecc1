"""`pressure.png`: contact pressure over the unrolled interface, at the strongest contact and as peak over time.

A driven scene has one picture, with a panel for each contact at its own strongest moment.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import TriMesh
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from matplotlib.figure import Figure
from matplotlib.tri import TriAnalyzer, Triangulation

from gudgeon.modaldb.records.mesh import Surface
from gudgeon.modaldb.records.modes import InterfaceModes
from gudgeon.pipeline.geometry.surfaces import cylindrical
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.base.surface import surface_of
from gudgeon.pipeline.plots.driven.drive import drive_of, frame_degrees, hardest_first, shown_angle

LEAST_POINTS = 4
"""Fewer points span no map."""
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


def draw_pressure(drawing: Drawing) -> None:
    """Draw one picture for each contact of more than a few points that was closed in some frame."""
    wanted = {
        name: contact
        for name, contact in drawing.trajectory.contacts.items()
        if contact.multipliers.shape[1] >= LEAST_POINTS and contact.multipliers.any()
    }
    if drawing.driven:
        maps = [found for name in hardest_first(wanted) if (found := _strongest(drawing, name)) is not None]
        if maps:
            with style.styled(), drawing.file("pressure.png") as path:
                style.save(_beside(drawing, maps), path)
        return
    for name, contact in wanted.items():
        body = drawing.body(contact.body)
        interface = body.modal.interfaces[contact.interface]
        plane = chart(contact.points, surface_of(body.mesh, interface.nodes))
        if plane is not None:
            with style.styled(), drawing.file(drawing.file_name("pressure", ".png", name, len(wanted))) as path:
                style.save(_picture(drawing, name, interface, plane), path)


def chart(points: np.ndarray, surface: Surface | None) -> Chart | None:
    """Unroll contact points: angle and height on a cylinder, principal coordinates anywhere else.

    Returns:
        None where the points lie on a line.
    """
    if surface is not None and surface.shape.get("kind") == "cylinder":
        radius, angle, height = cylindrical(points, surface.shape)
        middle = np.angle(np.exp(1j * angle).mean())
        # Counted from the middle on, so that a sector across ±180° stays in one piece.
        angle = middle + np.angle(np.exp(1j * (angle - middle)))
        found = Chart(
            np.column_stack([np.degrees(angle), height * 1e3]),
            np.column_stack([radius.mean() * angle, height]),
            ("angle [deg]", "height [mm]"),
        )
    else:
        centred = points - points.mean(axis=0)
        pair = centred @ np.linalg.svd(centred, full_matrices=False)[2][:2].T
        found = Chart(pair * 1e3, pair, ("first principal direction [mm]", "second principal direction [mm]"))
    spread = np.ptp(found.metric, axis=0)
    return found if spread.min() > 1e-6 * spread.max() else None


def _picture(drawing: Drawing, name: str, interface: InterfaceModes, plane: Chart) -> Figure:
    contact = drawing.trajectory.contacts[name]
    areas = interface.areas if contact.areas is None else contact.areas
    pressure = contact.multipliers / areas
    strongest = int(np.argmax(contact.multipliers.sum(axis=1)))
    time = drawing.trajectory.frame_times[strongest]
    shown, unit = style.time_unit(float(drawing.trajectory.times[-1]))
    force = float(np.linalg.norm(contact.multipliers[strongest] @ interface.normals))
    scale, name_of_unit = style.prefixed(float(pressure.max()), "Pa")
    subtitle = f"{drawing.scene_name}  ·  {name}  ·  {len(plane.shown)} contact points on body {contact.body}"
    figure = style.new_figure("Contact pressure", subtitle)
    moment = f"strongest contact: t = {style.digits(time * shown)} {unit}, {style.quantity(force, 'N')}"
    panels = {moment: pressure[strongest], "peak over all frames": pressure.max(axis=0)}
    images = []
    for column, (title, values) in enumerate(panels.items()):
        axes = figure.add_axes((0.085 + 0.405 * column, 0.11, 0.37, 0.70))
        images.append(_map(axes, plane, values * scale, float(pressure.max()) * scale))
        axes.set_title(title, loc="left", fontsize=9.5)
        axes.set_xlabel(plane.labels[0])
        if column:
            axes.set_yticklabels([])
        else:
            axes.set_ylabel(plane.labels[1])
    bar = figure.colorbar(images[0], cax=figure.add_axes((0.888, 0.11, 0.018, 0.70)))
    bar.outline.set_visible(False)  # type: ignore[operator]
    bar.set_label(f"contact pressure [{name_of_unit}]")
    return figure


@dataclass(frozen=True)
class Map:
    """The pressure of one contact at the frame of its largest force."""

    title: str
    plane: Chart
    pressure: np.ndarray
    """[Pa], (c,)"""


def _strongest(drawing: Drawing, name: str) -> Map | None:
    contact = drawing.trajectory.contacts[name]
    body, drive = drawing.body(contact.body), drive_of(drawing)
    interface = body.modal.interfaces[contact.interface]
    plane = chart(contact.points, surface_of(body.mesh, interface.nodes))
    if plane is None:
        return None
    frame = int(np.argmax(contact.multipliers.sum(axis=1)))
    areas = interface.areas if contact.areas is None else contact.areas
    force = float(np.linalg.norm(contact.multipliers[frame] @ interface.normals))
    angle = shown_angle(drive, float(frame_degrees(drawing, drive)[frame]), 1)
    title = f"{name}: {style.quantity(force, 'N')} at crank angle {angle}°"
    return Map(title, plane, contact.multipliers[frame] / areas)


def _beside(drawing: Drawing, maps: Sequence[Map]) -> Figure:
    """Draw maps side by side on one scale of colours."""
    top = max(float(found.pressure.max()) for found in maps)
    scale, unit = style.prefixed(top, "Pa")
    points = sum(len(found.pressure) for found in maps)
    subtitle = f"{drawing.scene_name}  ·  each contact in the frame of its largest force  ·  {points} contact points"
    figure = style.new_figure("Contact pressure", subtitle)
    width = (0.79 - 0.05 * (len(maps) - 1)) / len(maps)
    images = []
    for column, found in enumerate(maps):
        axes = figure.add_axes((0.075 + (width + 0.05) * column, 0.11, width, 0.70))
        images.append(_map(axes, found.plane, found.pressure * scale, top * scale))
        peak = f"peak {style.quantity(float(found.pressure.max()), 'Pa')}"
        axes.set_title(f"{found.title}\n{peak}", loc="left", fontsize=9.5, linespacing=1.5)
        axes.set_xlabel(found.plane.labels[0])
        if not column:
            axes.set_ylabel(found.plane.labels[1])
    bar = figure.colorbar(images[0], cax=figure.add_axes((0.888, 0.11, 0.018, 0.70)))
    bar.outline.set_visible(False)  # type: ignore[operator]
    bar.set_label(f"contact pressure [{unit}]")
    return figure


def _map(axes: Axes, plane: Chart, values: np.ndarray, top: float) -> TriMesh:
    triangles = Triangulation(plane.metric[:, 0], plane.metric[:, 1])
    mask = TriAnalyzer(triangles).get_flat_tri_mask(SLIVER, rescale=False)
    shown = Triangulation(plane.shown[:, 0], plane.shown[:, 1], triangles.triangles[~mask])
    image = axes.tripcolor(shown, values, shading="gouraud", cmap=_colours(), vmin=0.0, vmax=top, rasterized=True)
    axes.plot(*plane.shown.T, ".", ms=1.6, color=style.INK, alpha=0.25, mew=0)
    style.plain_axes(axes)
    axes.margins(0.0)
    return image


def _colours() -> LinearSegmentedColormap:
    """Return a map from the faintest grey at zero, where nothing touches, through magma's bright to dark."""
    magma = colormaps[style.PRESSURE](np.linspace(0.02, 0.95, 15))
    return LinearSegmentedColormap.from_list("pressure", [to_rgba(style.GROUND), *magma])
