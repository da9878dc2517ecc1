"""`deformation.png` of a driven scene: all its bodies, what surrounds the driven one cut open.

The prescribed motion is drawn as it is; gaps, what moves across, tilt and deformation are magnified alike, so that
bodies touch in the picture where they touch in the run.
"""

from dataclasses import dataclass, replace

import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from scipy.spatial import KDTree

from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.section import cut, on_nodes, used_nodes
from gudgeon.pipeline.plots.base.surface import Skin, boundary_facets, make_skin
from gudgeon.pipeline.plots.deformation.solid import add_colour_bar
from gudgeon.pipeline.plots.driven.drive import Drive, cycles, drive_of, frame_degrees, shown_angle

IMAGE = (1180, 1020)
"""Part of the picture that is rendered [px]; drawn twice as large and averaged."""
TRIANGLES = 100_000
"""Aim for the number of flat triangles of each body."""
SHOWN = 0.045
"""Largest drawn displacement across, relative to the driven body's diagonal."""
NEAR = 1.3
"""Gaps up to this times the largest displacement are magnified, wider ones no further."""
NEIGHBOURS = 4
"""Points of the touching side that an inner point goes along with."""
ELEVATION = 14.0
"""Of the camera [deg]."""
ARROW = 0.3
"""Length of the arrow of the largest force, relative to the driven body's diagonal."""
LEAST_LENGTH = 0.4
"""Of the arrow of the least force, relative to that; in between it grows evenly."""
LEAST_FORCE = 0.03
"""Forces below this share of the largest have no arrow."""


@dataclass(frozen=True)
class Part:
    """One body as it is drawn, on the nodes of its skin only."""

    body: BodyMotion
    skin: Skin
    colours: Colormap
    still: np.ndarray
    """Where its nodes stand without displacement, gaps magnified [m], (n, 3)."""

    def moved(self, frame: int, along: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
        """Return where its nodes are drawn (n, 3), and their elastic displacement across `along` (n,) [m]."""
        rigid = self.body.rigid(frame)
        twist = self.body.twist(frame)
        carried = (twist[:3] @ along) * along
        elastic = self.body.elastic(frame)
        across = elastic - (elastic @ along)[:, None] * along
        return self.still + carried + scale * (rigid - carried + elastic), np.linalg.norm(across, axis=1)


@dataclass(frozen=True)
class Assembly:
    """All bodies of a driven scene."""

    drive: Drive
    parts: dict[str, Part]
    scale: float
    size: float
    """Diagonal of the driven body [m]."""

    @property
    def view(self) -> view.View:
        """From the front, the right side to the right."""
        angle = np.radians(ELEVATION)
        front = np.cross(self.drive.right, self.drive.along)
        return view.View(np.cos(angle) * front + np.sin(angle) * self.drive.along, self.drive.along)


def draw_assembly(drawing: Drawing) -> None:
    """Draw the bodies of a driven scene at the frame of the hardest contact."""
    if not drawing.contacts_of(drive_of(drawing).body):
        return
    frame = int(np.argmax(drawing.frame_force(drive_of(drawing).body)))
    assembly = assemble(drawing, TRIANGLES, [frame])
    if assembly is not None:
        with style.styled(), drawing.file("deformation.png") as path:
            style.save(_picture(drawing, assembly, frame), path)


def assemble(drawing: Drawing, triangles: int, frames: list[int]) -> Assembly | None:
    """Return all solid bodies, with one scale that suits some frames.

    Args:
        triangles: Aim for the number of flat triangles of each body.

    Returns:
        None where the driven body is no solid, or its modes have no shapes.
    """
    drive = drive_of(drawing)
    names = [name for name in drawing.trajectory.bodies if drawing.cell_type(name) == "tetra10"]
    bodies = {name: drawing.body(name) for name in names}
    bodies = {name: body for name, body in bodies.items() if body.modal.shapes is not None}
    if drive.body not in bodies:
        return None
    parts = {name: _part(drawing, drive, bodies.pop(name), triangles) for name in list(bodies)}
    driven = parts[drive.body]
    size = float(np.linalg.norm(np.ptp(driven.body.nodes, axis=0)))
    largest = max(_largest_across(part, drive.along, frame) for part in parts.values() for frame in frames)
    scale = style.nice_scale(SHOWN * size, largest)
    shift = gap_shift(drawing, driven, scale, NEAR * largest)
    parts[drive.body] = replace(driven, still=driven.still + shift)
    return Assembly(drive, parts, scale, size)


def _part(drawing: Drawing, drive: Drive, body: BodyMotion, triangles: int) -> Part:
    """Reduce a body to its skin; one that surrounds the driven body is cut along the plane of its motion."""
    skin = make_skin(body.nodes, boundary_facets(body.mesh.cells), triangles)
    position = np.asarray(drawing.scene["body"][body.name]["position"], float)
    if body.name != drive.body:
        middle = body.nodes.mean(axis=0)
        skin = cut(skin, body.nodes, body.mesh.cells, middle, np.cross(drive.along, drive.right))
    numbers = used_nodes(skin)
    body = body.on(numbers)
    colours = style.MAGNITUDE if body.name == drive.body else style.AROUND
    return Part(body, on_nodes(skin, numbers), colours, body.nodes + position)


def _largest_across(part: Part, along: np.ndarray, frame: int) -> float:
    displacement = part.body.total(frame)
    across = displacement - (displacement @ along)[:, None] * along
    return float(np.linalg.norm(across, axis=1).max())


def gap_shift(drawing: Drawing, part: Part, scale: float, near: float) -> np.ndarray:
    """Return how far the nodes of a body move back so that its gaps g at the start become s g [m], (n, 3).

    What is within `near` of an obstacle moves by (s − 1) g along the gap; what lies deeper goes along with the closest
    of these, less towards the body's middle.
    """
    gaps, directions = [], []
    for name in drawing.contacts_of(part.body.name):
        obstacle = view.obstacle_at(drawing, name)
        if obstacle is not None:
            gaps.append(obstacle.gap(part.still))
            with np.errstate(invalid="ignore"):
                # On the axis of a bore there is no direction, and no gap to magnify.
                directions.append(np.nan_to_num(obstacle.direction(part.still)))
    shift = np.zeros_like(part.still)
    if not gaps:
        return shift
    nearest, every = np.argmin(gaps, axis=0), np.arange(len(shift))
    gap, direction = np.array(gaps)[nearest, every], np.array(directions)[nearest, every]
    touching = gap <= near
    if not touching.any():
        return shift
    feet = part.still - gap[:, None] * direction
    count = min(NEIGHBOURS, int(touching.sum()))
    distance, neighbour = KDTree(feet[touching]).query(feet, k=[*range(1, count + 1)])
    weight = 1 / (distance + 1e-6 * float(gap.max()))
    followed = (gap[touching][neighbour] * weight).sum(axis=1) / weight.sum(axis=1)
    depth = np.clip(1 - gap / gap.max(), 0.0, 1.0)
    amount = np.where(touching, gap, np.minimum(followed, near) * depth)
    return (scale - 1) * amount[:, None] * direction


def _picture(drawing: Drawing, assembly: Assembly, frame: int) -> Figure:
    drive, run = assembly.drive, cycles(replace(drawing, compare={}))[0]
    degrees = float(frame_degrees(drawing, drive)[frame])
    tilt, shift = (float(np.interp(degrees, run.degrees, values)) for values in (run.tilt, run.lateral))
    subtitle = (
        f"{drawing.scene_name}  ·  hardest contact, at crank angle {shown_angle(drive, degrees, 1)}°"
        f"  ·  {drive.body}: tilt {style.signed(tilt * 1e3, 2)} mrad, shift {style.signed(shift * 1e6, 0)} µm"
    )
    title = f"Deformation, lateral motion, tilt and gaps × {assembly.scale:g}"
    figure = style.new_figure(title, subtitle)
    axes = figure.add_axes((0.02, 0.02, IMAGE[0] / style.WIDTH, IMAGE[1] / style.HEIGHT))
    tops = _show(drawing, assembly, frame, axes)
    axes.axis("off")
    for number, (name, top) in enumerate(tops.items()):
        factor, unit = style.prefixed(top, "m")
        box = (0.785 + 0.11 * number, 0.18, 0.018, 0.55)
        add_colour_bar(figure, top * factor, "", box, assembly.parts[name].colours)
        figure.text(box[0], 0.745, f"{name}\n[{unit}]", fontsize=9.5)
    if tops:
        figure.text(0.785, 0.15, "elastic displacement\nacross the motion", fontsize=9.5, va="top")
    return figure


def _show(drawing: Drawing, assembly: Assembly, frame: int, axes: Axes) -> dict[str, float]:
    """Draw the bodies and the forces; return the largest elastic displacement of each body [m]."""
    plotter = view.new_plotter((2 * IMAGE[0], 2 * IMAGE[1]))
    seen, tops = [], {}
    for name, part in assembly.parts.items():
        points, magnitude = part.moved(frame, assembly.drive.along, assembly.scale)
        tops[name] = float((part.skin.weights @ magnitude).max())
        mesh, edges = meshes(part)
        place(part, mesh, edges, points, magnitude / (tops[name] or 1.0))
        view.add_skin(plotter, mesh, "magnitude", 1.0, part.colours)
        view.add_lines(plotter, edges, color=style.INK, line_width=3.0)
        seen.append(mesh.points)
    found = arrows(drawing, assembly, frame)
    for tail, tip, _ in found:
        plotter.add_mesh(view.arrow(tail, tip), color=style.RED, ambient=0.35, smooth_shading=True)
        seen.append(np.array([tail]))
    view.aim(plotter, assembly.view, np.vstack(seen))
    image = view.photograph(plotter)
    for tail, tip, text in found:
        x, y = view.pixel(plotter, (tail + tip) / 2) / 2
        axes.text(x, y - 38, text, ha="center", va="bottom", fontsize=10, color=style.RED, fontweight="bold")
    plotter.close()
    halves = np.asarray(image, float).reshape(IMAGE[1], 2, IMAGE[0], 2, 3)
    axes.imshow(halves.mean(axis=(1, 3)).astype(np.uint8), interpolation="none")
    return tops


def meshes(part: Part) -> tuple[pv.PolyData, pv.PolyData]:
    """Return a part's skin and edges as they stand without displacement."""
    mesh = view.skin_mesh(part.skin, part.still, np.zeros_like(part.still), 0.0, np.zeros(len(part.still)))
    return mesh, view.lines(part.skin.edge_weights @ part.still, part.skin.segments)


def place(part: Part, mesh: pv.PolyData, edges: pv.PolyData, points: np.ndarray, magnitude: np.ndarray) -> None:
    """Move a part's skin and edges to where its nodes are drawn, and colour it."""
    mesh.points = part.skin.weights @ points
    mesh.point_data["Normals"] = part.skin.normals(mesh.points)
    mesh.point_data["magnitude"] = part.skin.weights @ magnitude
    edges.points = part.skin.edge_weights @ points


def arrows(drawing: Drawing, assembly: Assembly, frame: int) -> list[tuple[np.ndarray, np.ndarray, str]]:
    """Return tail, tip and text of an arrow for each contact force on the driven body, outside of all bodies."""
    drive, driven = assembly.drive, assembly.parts[assembly.drive.body].body
    largest = max(float(drawing.frame_force(drive.body).max()), 1e-300)
    outside = max(float(np.abs(part.still @ drive.right).max()) for part in assembly.parts.values())
    position = np.asarray(drawing.scene["body"][drive.body]["position"], float)
    found = []
    for name, contact in drawing.contacts_of(drive.body).items():
        weights = contact.multipliers[frame]
        force = weights @ driven.modal.interfaces[contact.interface].normals
        share = float(np.linalg.norm(force)) / largest
        if share < LEAST_FORCE:
            continue
        point = weights @ contact.points / weights.sum() + position + driven.twist(frame)[:3]
        side = np.sign(force @ drive.right) * drive.right
        tip = 1.06 * outside * side + (point @ drive.along) * drive.along
        text = f"{name}\n{style.quantity(float(np.linalg.norm(force)), 'N')}"
        length = (LEAST_LENGTH + (1 - LEAST_LENGTH) * share) * ARROW * assembly.size
        found.append((tip + length * side, tip, text))
    return found
