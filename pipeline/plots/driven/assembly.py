"""`deformation.png` of a driven scene: all its bodies, what surrounds the driven one cut open.

The prescribed motion is drawn as it is; gaps, what moves across, tilt and deformation are magnified alike, so that
bodies touch in the picture where they touch in the run.
"""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from PIL.Image import Image
from scipy.spatial import KDTree

from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.surface import Cut, Skin, make_skin, skin_of
from gudgeon.pipeline.plots.driven.drive import Drive, drive_of, frame_degrees, own_cycle, shown_angle

IMAGE = (1180, 1020)
"""Part of the picture that is rendered [px]."""
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
    """One body as it is drawn, on the points of its skin."""

    body: BodyMotion
    skin: Skin
    colours: Colormap
    still: np.ndarray
    """Where its points stand without displacement, gaps magnified [m], (p, 3)."""

    def moved(self, frame: int, along: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
        """Return where its points are drawn (p, 3), and their elastic displacement across `along` (p,) [m]."""
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

    @property
    def size(self) -> float:
        """Diagonal of the driven body [m]."""
        return self.parts[self.drive.body].body.size

    @property
    def view(self) -> view.View:
        """From the front, the right side to the right."""
        angle = np.radians(ELEVATION)
        front = np.cross(self.drive.right, self.drive.along)
        return view.View(np.cos(angle) * front + np.sin(angle) * self.drive.along, self.drive.along)

    def turn_to(self, frame: int) -> None:
        """Move and colour all skins as they are at a frame."""
        for part in self.parts.values():
            points, magnitude = part.moved(frame, self.drive.along, self.scale)
            part.skin.move(points)
            part.skin.colour(magnitude)


def draw_assembly(drawing: Drawing) -> None:
    """Draw the bodies of a driven scene at the frame of the hardest contact."""
    if not drawing.contacts_of(drive_of(drawing).body):
        return
    frame = drawing.strongest_frame(drive_of(drawing).body)
    assembly = assemble(drawing, TRIANGLES, [frame])
    if assembly is not None:
        style.draw(drawing.file("deformation.png"), _picture, drawing, assembly, frame)


def assemble(drawing: Drawing, triangles: int, frames: list[int]) -> Assembly | None:
    """Return all solid bodies, with one scale that suits some frames.

    Args:
        triangles: Aim for the number of flat triangles of each body.

    Returns:
        None where the driven body is no solid, or its modes have no shapes.
    """
    drive = drive_of(drawing)
    names = [name for name in drawing.trajectory.bodies if drawing.cell_type(name) == "tetra10"]
    bodies = {body.name: body for body in drawing.shaped(names)}
    if drive.body not in bodies:
        return None
    driven = bodies[drive.body]
    parts = {name: _part(drawing, drive, bodies.pop(name), triangles) for name in list(bodies)}
    largest = max(_largest_across(part, drive.along, frame) for part in parts.values() for frame in frames)
    scale = style.nice_scale(SHOWN * driven.size, largest)
    shift = gap_shift(drawing, driven, scale, NEAR * largest)
    shifts = make_skin(driven.nodes, driven.mesh.cells, triangles, {"shift": shift}).take("shift")
    parts[drive.body] = replace(parts[drive.body], still=parts[drive.body].still + shifts)
    return Assembly(drive, parts, scale)


def _part(drawing: Drawing, drive: Drive, body: BodyMotion, triangles: int) -> Part:
    """Reduce a body to its skin; one that surrounds the driven body is cut along the plane of its motion."""
    driven = body.name == drive.body
    cut = None if driven else Cut(body.nodes.mean(axis=0), np.cross(drive.along, drive.right))
    body, skin = skin_of(body, triangles, cut=cut)
    colours = style.MAGNITUDE if driven else style.AROUND
    return Part(body, skin, colours, body.nodes + drawing.position(body.name))


def _largest_across(part: Part, along: np.ndarray, frame: int) -> float:
    displacement = part.body.total(frame)
    across = displacement - (displacement @ along)[:, None] * along
    return float(np.linalg.norm(across, axis=1).max())


def gap_shift(drawing: Drawing, body: BodyMotion, scale: float, near: float) -> np.ndarray:
    """Return how far the nodes of a body move back so that its gaps g at the start become s g [m], (n, 3).

    What is within `near` of an obstacle moves by (s − 1) g along the gap; what lies deeper goes along with the closest
    of these, less towards the body's middle.
    """
    still, gaps, directions = body.nodes + drawing.position(body.name), [], []
    for name in drawing.contacts_of(body.name):
        obstacle = view.obstacle_at(drawing, name)
        if obstacle is not None:
            gaps.append(obstacle.gap(still))
            with np.errstate(invalid="ignore"):
                # On the axis of a bore there is no direction, and no gap to magnify.
                directions.append(np.nan_to_num(obstacle.direction(still)))
    shift = np.zeros_like(still)
    if not gaps:
        return shift
    nearest, every = np.argmin(gaps, axis=0), np.arange(len(shift))
    gap, direction = np.array(gaps)[nearest, every], np.array(directions)[nearest, every]
    touching = gap <= near
    if not touching.any():
        return shift
    feet = still - gap[:, None] * direction
    count = min(NEIGHBOURS, int(touching.sum()))
    distance, neighbour = KDTree(feet[touching]).query(feet, k=[*range(1, count + 1)])
    weight = 1 / (distance + 1e-6 * float(gap.max()))
    followed = (gap[touching][neighbour] * weight).sum(axis=1) / weight.sum(axis=1)
    depth = np.clip(1 - gap / gap.max(), 0.0, 1.0)
    amount = np.where(touching, gap, np.minimum(followed, near) * depth)
    return (scale - 1) * amount[:, None] * direction


def _picture(drawing: Drawing, assembly: Assembly, frame: int) -> Figure:
    drive, run = assembly.drive, own_cycle(drawing)
    degrees = float(frame_degrees(drawing, drive)[frame])
    tilt, shift = (float(np.interp(degrees, run.degrees, values)) for values in (run.tilt, run.lateral))
    subtitle = (
        f"{drawing.scene_name}  ·  hardest contact, at crank angle {shown_angle(drive, degrees, 1)}°"
        f"  ·  {drive.body}: tilt {style.signed(tilt * 1e3, 2)} mrad, shift {style.signed(shift * 1e6, 0)} µm"
    )
    title = f"Deformation, lateral motion, tilt and gaps × {assembly.scale:g}"
    figure = style.new_figure(title, subtitle)
    tops = {name: float(part.moved(frame, drive.along, 0.0)[1].max()) for name, part in assembly.parts.items()}
    image, forces = _render(drawing, assembly, frame, tops)
    axes = style.show_image(figure, image, (0.02, 0.02))
    for x, y, text in forces:
        axes.text(x, y - 38, text, ha="center", va="bottom", fontsize=10, color=style.RED, fontweight="bold")
    for number, (name, top) in enumerate(tops.items()):
        factor, unit = style.prefixed(top, "m")
        box = (0.785 + 0.11 * number, 0.18, 0.018, 0.55)
        style.colour_bar(figure, style.scale(0.0, top * factor, assembly.parts[name].colours), "", box)
        figure.text(box[0], 0.745, f"{name}\n[{unit}]", fontsize=9.5)
    figure.text(0.785, 0.15, "elastic displacement\nacross the motion", fontsize=9.5, va="top")
    return figure


def _render(
    drawing: Drawing, assembly: Assembly, frame: int, tops: dict[str, float]
) -> tuple[Image, list[tuple[float, float, str]]]:
    """Return the bodies and the forces on the driven one, and where the text of each force stands [px]."""
    plotter = view.new_plotter(IMAGE)
    assembly.turn_to(frame)
    for name, part in assembly.parts.items():
        view.add_skin(plotter, part.skin, part.colours, (0.0, tops[name] or 1.0), 3.0)
    found = arrows(drawing, assembly, frame)
    for tail, tip, _ in found:
        view.add_arrow(plotter, tail, tip)
    seen = [part.skin.points for part in assembly.parts.values()]
    view.aim(plotter, assembly.view, np.vstack([*seen, *(tail for tail, _, _ in found)]))
    image = view.photograph(plotter, IMAGE)
    texts = [(*view.pixel(plotter, IMAGE, (tail + tip) / 2), text) for tail, tip, text in found]
    plotter.close()
    return image, texts


def arrows(drawing: Drawing, assembly: Assembly, frame: int) -> list[tuple[np.ndarray, np.ndarray, str]]:
    """Return tail, tip and text of an arrow for each contact force on the driven body, outside of all bodies."""
    drive, driven = assembly.drive, assembly.parts[assembly.drive.body].body
    largest = max(float(drawing.frame_force(drive.body).max()), 1e-300)
    outside = max(float(np.abs(part.still @ drive.right).max()) for part in assembly.parts.values())
    position = drawing.position(drive.body)
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
