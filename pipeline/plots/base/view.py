"""The 3-D side: a body's skin, its obstacle and a force arrow in a pyvista scene, and the picture of it as an array.

Text, colour bars and curves are matplotlib's, around the rendered image: one look for all pictures.
"""

from dataclasses import dataclass

import numpy as np
import pyvista as pv
from matplotlib.colors import Colormap

from gudgeon.modaldb.records.mesh import Surface
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.surface import Skin, surface_of
from gudgeon.solver.obstacles import Obstacle, basic_surface, obstacle_of

LIGHTS = (((0.5, 0.8, 1.0), 0.55), ((-1.0, 0.2, 0.8), 0.3), ((0.2, -1.0, 0.7), 0.35))
"""Position relative to the camera and strength of each light: from above, and fill for what faces down."""


@dataclass(frozen=True)
class View:
    """Where the camera stands, relative to the body's middle."""

    towards: np.ndarray
    """Unit vector from the body to the camera."""
    up: np.ndarray


def axis_of(surface: Surface | None, outward: np.ndarray) -> np.ndarray:
    """Return the direction that is drawn upwards: the cylinder's axis, or the most upright one across `outward`."""
    if surface is not None and surface.shape.get("kind") == "cylinder":
        axis = np.asarray(surface.shape["axis"], float)
        axis = axis / np.linalg.norm(axis)
        return axis if axis[np.argmax(np.abs(axis))] > 0 else -axis
    axis = np.array([0.0, 0.0, 1.0]) if abs(outward[2]) < 0.7 else np.array([0.0, 1.0, 0.0])
    across = axis - outward * (outward @ axis)
    return across / np.linalg.norm(across)


def looking(outward: np.ndarray, up: np.ndarray, azimuth: float, elevation: float) -> View:
    """Return a view of the side that looks along `outward`, turned and raised by angles [deg]."""
    front = outward - up * (outward @ up)
    if np.linalg.norm(front) < 1e-6:
        front = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
    front /= np.linalg.norm(front)
    a, e = np.radians([azimuth, elevation])
    around = np.cos(a) * front + np.sin(a) * np.cross(up, front)
    return View(np.cos(e) * around + np.sin(e) * up, up)


def poly(points: np.ndarray, triangles: np.ndarray) -> pv.PolyData:
    """Return a triangulated surface."""
    return pv.PolyData.from_regular_faces(points, triangles)


def lines(points: np.ndarray, segments: np.ndarray) -> pv.PolyData:
    """Return line segments."""
    return pv.PolyData(points, lines=np.column_stack([np.full(len(segments), 2), segments]).ravel())


def new_plotter(size: tuple[int, int]) -> pv.Plotter:
    """Return an off-screen scene on white."""
    plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="none")
    plotter.background_color = pv.Color("white")
    for position, strength in LIGHTS:
        plotter.add_light(pv.Light(position=position, light_type="camera light", intensity=strength))
    return plotter


def add_lines(plotter: pv.Plotter, mesh: pv.PolyData, *, color: str, line_width: float) -> None:
    """Add unlit lines; a part without an edge has none, which pyvista refuses to draw."""
    if mesh.n_cells:
        plotter.add_mesh(mesh, color=color, line_width=line_width, lighting=False)


def add_skin(
    plotter: pv.Plotter,
    mesh: pv.PolyData,
    scalars: str,
    limit: float,
    colours: Colormap | str = style.MAGNITUDE,
    *,
    signed: bool = False,
) -> None:
    """Add a surface coloured from zero to `limit`, or from minus `limit` on; its normals are point data."""
    top = limit or 1.0
    plotter.add_mesh(
        mesh, scalars=scalars, clim=(-top if signed else 0.0, top), cmap=colours, n_colors=256,
        nan_color="#d7dce1", show_scalar_bar=False,
        smooth_shading=False, interpolate_before_map=True, ambient=0.42, diffuse=0.7, specular=0.1, specular_power=20,
    ).prop.interpolation = "Phong"  # fmt: skip


def photograph(plotter: pv.Plotter) -> np.ndarray:
    """Render the scene as it stands now, (height, width, 3) bytes."""
    plotter.render()
    image = plotter.screenshot(return_img=True)
    assert image is not None
    return np.asarray(image)


def arrow(tail: np.ndarray, tip: np.ndarray) -> pv.PolyData:
    """Return an arrow from `tail` to `tip`."""
    return pv.Arrow(
        start=tail, direction=tip - tail, scale=float(np.linalg.norm(tip - tail)),
        tip_length=0.3, tip_radius=0.11, shaft_radius=0.042, tip_resolution=48, shaft_resolution=48,
    )  # fmt: skip


def aim(plotter: pv.Plotter, view: View, bounds_points: np.ndarray, *, fill: float = 0.94) -> None:
    """Point the camera and fit it so that the points fill the given share of the picture."""
    width, height = plotter.window_size
    right = np.cross(view.up, view.towards)
    right /= np.linalg.norm(right)
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


def pixel(plotter: pv.Plotter, point: np.ndarray) -> np.ndarray:
    """Return where an aimed camera shows a point, from the upper left corner [px], (2,)."""
    camera, (width, height) = plotter.camera, plotter.window_size
    focus = np.array(camera.focal_point)
    towards = np.array(camera.position) - focus
    towards /= np.linalg.norm(towards)
    up = np.array(camera.up)
    right = np.cross(up, towards)
    scale = height / 2 / camera.parallel_scale
    return np.array([width / 2 + scale * ((point - focus) @ right), height / 2 - scale * ((point - focus) @ up)])


def obstacle_at(drawing: Drawing, contact: str) -> Obstacle | None:
    """Return what a contact's body meets, undeformed; None for points of another body, and where nothing is said."""
    scene_contact = drawing.scene.get("contact", {}).get(contact)
    if scene_contact is None or scene_contact["against"]["shape"] == "body":
        return None
    against = scene_contact["against"]
    if against["shape"] != "surface":
        return obstacle_of(against)
    morph = drawing.store.get(drawing.trajectory.bodies[against["body"]], "morph", only=["modes_key"])
    tractions = drawing.store.get(morph.modes_key, "modes", only=["tractions"]).tractions
    position = np.asarray(drawing.scene["body"][against["body"]]["position"], float)
    return basic_surface(tractions[against["interface"]].chart, position)


def wall_points(
    drawing: Drawing, body: BodyMotion, contact: str, points: np.ndarray, scale: float
) -> np.ndarray | None:
    """Return where the obstacle stands for points on a body, gaps magnified: x − s g(x) ∇g(x), (p, 3).

    Returns:
        None where the record does not say what the body meets.
    """
    obstacle = obstacle_at(drawing, contact)
    if obstacle is None:
        return None
    placed = points + np.asarray(drawing.scene["body"][body.name]["position"], float)
    return points - scale * obstacle.gap(placed)[:, None] * obstacle.direction(placed)


def touched_surface(drawing: Drawing, body: BodyMotion) -> tuple[str, Surface | None]:
    """Return the contact of a body that carries the largest force, and the surface it is on."""
    contacts = drawing.contacts_of(body.name)
    name = max(contacts, key=lambda key: contacts[key].multipliers.sum(axis=1).max())
    interface = body.modal.interfaces[contacts[name].interface]
    return name, surface_of(body.mesh, interface.nodes)


def skin_mesh(
    skin: Skin, nodes: np.ndarray, displacement: np.ndarray, scale: float, magnitude: np.ndarray
) -> pv.PolyData:
    """Return the skin at magnified displacement, with nodal magnitudes (n,) as point data `magnitude`."""
    points = skin.weights @ (nodes + scale * displacement)
    mesh = poly(points, skin.triangles)
    mesh.point_data["Normals"] = skin.normals(points)
    mesh.point_data.active_normals_name = "Normals"
    mesh.point_data["magnitude"] = skin.weights @ magnitude
    return mesh
