"""3-D rendering: skins of bodies and force arrows in a pyvista scene, and its image.

Text, colour bars and curves around the image are drawn by matplotlib, alike in all pictures.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyvista as pv
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from PIL import Image

from gudgeon.modaldb.records.mesh import Surface
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.base.surface import Skin, Thread
from gudgeon.solver.obstacles import Obstacle, basic_surface, obstacle_of
from gudgeon.solver.vectors import unit

FINER = 2.0
"""Factor by which a picture is rendered larger before it is averaged."""
LIGHTS = (((0.5, 0.8, 1.0), 0.55), ((-1.0, 0.2, 0.8), 0.3), ((0.2, -1.0, 0.7), 0.35))
"""Position relative to the camera and strength of each light: from above, and fill for what faces down."""

SEEN, LIFT, ALIKE = 40, 2e-3, 0.02
"""Points of a contact that are looked for from a side, their distance from the body, of its diagonal, and shares of
them that are alike."""
STEEP = 0.7
"""Vertical part of a unit normal from which a contact is above or below the body, not beside it."""
TRIAD = (0.868, 0.03, 0.1)
"""Left and lower corner and width of the coordinate axes beside a picture, in its figure."""
ARROW = {"width": 1.2, "headwidth": 5, "headlength": 5}
AXES = (("x", style.RED), ("y", style.GREEN), ("z", style.BLUE))
LINE, POINT = 7.0, 24.0
"""Width of a bar or a beam, and diameter of a rigid body's point [px]."""


@dataclass(frozen=True)
class View:
    """Direction of the camera."""

    towards: np.ndarray
    """Unit vector from the body to the camera."""
    up: np.ndarray


def axis_of(surface: Surface | None, outward: np.ndarray) -> np.ndarray:
    """Return the direction drawn upwards: the cylinder's axis, or z, made normal to an oblique `outward`."""
    if surface is not None and surface.shape.get("kind") == "cylinder":
        axis = unit(surface.shape["axis"])
        return axis if axis[np.argmax(np.abs(axis))] > 0 else -axis
    axis = np.array([0.0, 0.0, 1.0])
    return axis if abs(outward[2]) > STEEP else unit(axis - outward * outward[2])


def looking(outward: np.ndarray, up: np.ndarray, azimuth: float, elevation: float) -> View:
    """Return a view of the side whose normal is `outward`, rotated and raised by angles [deg]."""
    front = outward - up * (outward @ up)
    if np.linalg.norm(front) < 1e-6:
        front = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
    front /= np.linalg.norm(front)
    a, e = np.radians([azimuth, elevation])
    around = np.cos(a) * front + np.sin(a) * np.cross(up, front)
    return View(np.cos(e) * around + np.sin(e) * up, up)


def shares_seen(
    points: np.ndarray, outward: np.ndarray, surfaces: Sequence[pv.PolyData], views: Sequence[View]
) -> np.ndarray:
    """Return the share of points of contact that is seen in each view, (v,).

    Args:
        points: On a body [m], (c, 3).
        outward: Unit normals out of that body, (c, 3).
        surfaces: Triangles of all bodies, which hide points.
    """
    chosen = np.unique(np.linspace(0, len(points) - 1, SEEN).astype(int))
    length = max((surface.length for surface in surfaces), default=1.0)
    starts = points[chosen] + LIFT * length * outward[chosen]
    return np.array([
        np.mean([not any(len(s.ray_trace(p, p + 4 * length * v.towards)[1]) for s in surfaces) for p in starts])
        for v in views
    ])  # fmt: skip


def largest_alike(shares: np.ndarray) -> int:
    """Return the number of the first of the largest shares that are about alike."""
    return int(np.argmax(shares >= shares.max() - ALIKE))


def new_plotter(size: tuple[int, int], finer: float = FINER) -> pv.Plotter:
    """Return an off-screen scene on white, rendered larger than its picture of `size` [px] by a factor."""
    plotter = pv.Plotter(off_screen=True, window_size=[round(finer * length) for length in size], lighting="none")
    plotter.background_color = pv.Color("white")
    for position, strength in LIGHTS:
        plotter.add_light(pv.Light(position=position, light_type="camera light", intensity=strength))
    return plotter


def add_edges(plotter: pv.Plotter, edges: pv.PolyData, colour: str, width: float) -> None:
    """Add unlit lines; pyvista refuses to draw the empty set of a part without edges."""
    if edges.n_cells:
        plotter.add_mesh(edges, color=colour, line_width=width, lighting=False)


def add_skin(plotter: pv.Plotter, skin: Skin, colours: Colormap, limits: tuple[float, float], width: float) -> None:
    """Add a moved and coloured skin and its edges of some width [px]; the colours end at the limits."""
    plotter.add_mesh(
        skin.surface, scalars="magnitude", clim=limits, cmap=colours, n_colors=256,
        nan_color="#d7dce1", show_scalar_bar=False,
        smooth_shading=False, interpolate_before_map=True, ambient=0.42, diffuse=0.7, specular=0.1, specular_power=20,
    ).prop.interpolation = "Phong"  # fmt: skip
    add_edges(plotter, skin.edges, style.INK, width)


def add_thread(plotter: pv.Plotter, thread: Thread, colours: Colormap, limits: tuple[float, float]) -> None:
    """Add a moved and coloured line or points; the colours end at the limits."""
    plotter.add_mesh(
        thread.surface, scalars="magnitude", clim=limits, cmap=colours, show_scalar_bar=False, line_width=LINE,
        render_lines_as_tubes=True, point_size=POINT, render_points_as_spheres=True, ambient=0.4,
    )  # fmt: skip


def add_arrow(plotter: pv.Plotter, tail: np.ndarray, tip: np.ndarray) -> None:
    """Add the arrow of a force."""
    length = float(np.linalg.norm(tip - tail))
    shape = pv.Arrow(
        start=tail, direction=tip - tail, scale=length,
        tip_length=0.3, tip_radius=0.11, shaft_radius=0.042, tip_resolution=48, shaft_resolution=48,
    )  # fmt: skip
    plotter.add_mesh(shape, color=style.RED, ambient=0.35, smooth_shading=True)


def photograph(plotter: pv.Plotter, size: tuple[int, int], *, last: bool = False) -> Image.Image:
    """Render the present scene, averaged to a picture of some size [px], and close it after the `last` one."""
    plotter.render()
    image = plotter.screenshot(return_img=True)
    assert image is not None
    if last:
        plotter.close()
    return Image.fromarray(np.asarray(image)).resize(size, Image.Resampling.BOX)


def aim(plotter: pv.Plotter, view: View, bounds_points: np.ndarray, *, fill: float = 0.94) -> None:
    """Point the camera and fit it so that the points fill the given share of the picture."""
    width, height = plotter.window_size
    right = unit(np.cross(view.up, view.towards))
    upright = np.cross(view.towards, right)
    across, above = bounds_points @ right, bounds_points @ upright
    middle = bounds_points.mean(axis=0)
    middle = middle + right * (np.mean([across.min(), across.max()]) - middle @ right)
    middle = middle + upright * (np.mean([above.min(), above.max()]) - middle @ upright)
    depth = np.ptp(bounds_points @ view.towards)
    camera = plotter.camera
    camera.parallel_projection = True
    camera.focal_point = middle
    camera.position = middle + view.towards * (3 * depth + np.ptp(across) + np.ptp(above))
    camera.up = upright
    camera.parallel_scale = max(np.ptp(above), np.ptp(across) * height / width) / 2 / fill
    plotter.reset_camera_clipping_range()


def draw_triad(figure: Figure, seen: View) -> None:
    """Draw the directions of x, y and z as the camera sees them, the nearest on top."""
    left_edge, low, width = TRIAD
    axes = figure.add_axes((left_edge, low, width, width * figure.get_figwidth() / figure.get_figheight()))
    right = unit(np.cross(seen.up, seen.towards))
    across = np.stack([right, np.cross(seen.towards, right)])
    for k in np.argsort(seen.towards):
        name, colour = AXES[k]
        x, y = across[:, k]
        axes.annotate("", (x, y), (0.0, 0.0), arrowprops={"color": colour, **ARROW})
        # What points at the camera has its name beside its foot.
        length = max(float(np.hypot(x, y)), 1e-9)
        x, y = np.array([x, y]) * (1 + 0.28 / length) if length > 0.2 else (0.25, -0.3)
        axes.text(x, y, name, color=colour, ha="center", va="center", fontsize=9)
    axes.set(xlim=(-1.5, 1.5), ylim=(-1.5, 1.5))
    axes.axis("off")


def pixel(plotter: pv.Plotter, size: tuple[int, int], point: np.ndarray) -> np.ndarray:
    """Return the pixel of a point in a picture of some size [px], from the upper left corner, (2,)."""
    camera, (width, height) = plotter.camera, size
    up = np.array(camera.up)
    right = np.cross(up, unit(np.array(camera.position) - camera.focal_point))
    away = (point - camera.focal_point) * height / 2 / camera.parallel_scale
    return np.array([width / 2 + away @ right, height / 2 - away @ up])


def obstacle_at(drawing: Drawing, contact: str) -> Obstacle | None:
    """Return the undeformed obstacle of a contact; None for points of another body, and where the scene has none."""
    scene_contact = drawing.scene.get("contact", {}).get(contact)
    if scene_contact is None or scene_contact["against"]["shape"] == "body":
        return None
    against = scene_contact["against"]
    if against["shape"] != "surface":
        return obstacle_of(against)
    tractions = drawing.modes(against["body"], ["tractions"]).tractions
    return basic_surface(tractions[against["interface"]].chart, drawing.position(against["body"]))
