"""`deformation.png` of a driven scene: all bodies, those around the driven one cut open.

The prescribed motion is drawn to scale; gaps, lateral motion, tilt and deformation are magnified alike, so that bodies
touch in the picture where they touch in the run.
"""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from PIL.Image import Image
from scipy.spatial import KDTree

from gudgeon.pipeline.geometry.cells import cell_blocks
from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.plots.base.hardest import Hardest, hardest
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.surface import Cut, Skin, make_skin, skin_of
from gudgeon.pipeline.plots.contact.drive import Drive, drive_of, frame_degrees, own_cycle, shown_angle
from gudgeon.pipeline.plots.contact.force_axes import middles, windowed_force
from gudgeon.solver.vectors import length_across

IMAGE = (1180, 1020)
"""Size of the rendered part of the picture [px]."""
TRIANGLES = 100_000
"""Target number of flat triangles of each body."""
NEAR = 1.3
"""Gaps up to this times the largest displacement are magnified; wider ones move by as much as that."""
NEIGHBOURS = 4
"""Number of near points of the side in contact that an inner point follows."""
ELEVATION = 14.0
"""Of the camera [deg]."""
ARROW = 0.3
"""Length of the arrow of the largest force, relative to the driven body's diagonal."""
LEAST_LENGTH = 0.4
"""Length of the arrow of a zero force, relative to that; linear in between."""
LEAST_FORCE = 0.03
"""Forces below this share of the largest have no arrow."""


@dataclass(frozen=True)
class Part:
    """One body in the picture, on the points of its skin."""

    body: BodyMotion
    skin: Skin
    colours: Colormap
    still: np.ndarray
    """Positions of its points without displacement, gaps magnified [m], (p, 3)."""

    def moved(self, frame: int, along: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
        """Return drawn positions of its points [m], (p, 3), and their elastic displacement across `along` [m], (p,)."""
        rigid, elastic = self.body.rigid(frame), self.body.elastic(frame)
        carried = (self.body.twist(frame)[:3] @ along) * along
        return self.still + carried + scale * (rigid - carried + elastic), length_across(elastic, along)


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
        """Move and colour all skins to a frame."""
        for member in self.parts.values():
            points, magnitude = member.moved(frame, self.drive.along, self.scale)
            member.skin.move(points)
            member.skin.colour(magnitude)


def draw_assembly(drawing: Drawing) -> None:
    """Draw the bodies of a driven scene at the frame of the largest contact force."""
    body = drive_of(drawing).body
    strongest = hardest(drawing.trajectory, drawing.contacts_of(body))
    if strongest is None:
        return
    frame = strongest.frame
    if (assembly := assemble(drawing, TRIANGLES, [frame])) is not None:
        style.draw(drawing.file("deformation.png"), _picture, drawing, assembly, strongest)


def assemble(drawing: Drawing, triangles: int, frames: list[int]) -> Assembly | None:
    """Return all solid bodies, with one scale for some frames; None if the driven body has no solid mode shapes.

    Args:
        triangles: Target number of flat triangles of each body.
    """
    drive = drive_of(drawing)
    names = [name for name in drawing.trajectory.bodies if drawing.cell(name).dimension == 3]
    bodies = {body.name: body for body in drawing.shaped(names)}
    if drive.body not in bodies:
        return None
    driven = bodies[drive.body]
    members = {name: _part(drawing, drive, bodies.pop(name), triangles) for name in list(bodies)}
    moved = (member.body.total(frame) for member in members.values() for frame in frames)
    largest = max(float(length_across(displacement, drive.along).max()) for displacement in moved)
    scale = style.nice_scale(style.SHOWN * driven.size, largest)
    shift = gap_shift(drawing, driven, scale, NEAR * largest)
    shifts = make_skin(driven.nodes, cell_blocks(driven.mesh), triangles, {"shift": shift}).take("shift")
    members[drive.body] = replace(members[drive.body], still=members[drive.body].still + shifts)
    return Assembly(drive, members, scale)


def _part(drawing: Drawing, drive: Drive, body: BodyMotion, triangles: int) -> Part:
    """Reduce a body to its skin; bodies around the driven one are cut along the plane of its motion."""
    driven = body.name == drive.body
    cut = None if driven else Cut(body.nodes.mean(axis=0), np.cross(drive.along, drive.right))
    body, skin = skin_of(body, triangles, cut=cut)
    colours = style.MAGNITUDE if driven else style.AROUND
    return Part(body, skin, colours, body.nodes + drawing.position(body.name))


def gap_shift(drawing: Drawing, body: BodyMotion, scale: float, limit: float) -> np.ndarray:
    """Return the shift of a body's nodes that turns its gaps g at the start into s g [m], (n, 3).

    Nodes within `limit` of an obstacle move by (s − 1) g along the gap; deeper nodes follow the closest of these, less
    towards the middle of the body.
    """
    still, gaps, directions = body.nodes + drawing.position(body.name), [], []
    for name in drawing.contacts_of(body.name):
        obstacle = view.obstacle_at(drawing, name)
        if obstacle is not None:
            gaps.append(obstacle.gap(still))
            with np.errstate(invalid="ignore"):
                # A bore has no direction on its axis, and no gap there to magnify.
                directions.append(np.nan_to_num(obstacle.direction(still)))
    shift = np.zeros_like(still)
    if not gaps:
        return shift
    nearest, every = np.argmin(gaps, axis=0), np.arange(len(shift))
    gap, direction = np.array(gaps)[nearest, every], np.array(directions)[nearest, every]
    touching = gap <= limit
    if not touching.any():
        return shift
    feet = still - gap[:, None] * direction
    count = min(NEIGHBOURS, int(touching.sum()))
    distance, neighbour = KDTree(feet[touching]).query(feet, k=[*range(1, count + 1)])
    weight = 1 / (distance + 1e-6 * float(gap.max()))
    followed = (gap[touching][neighbour] * weight).sum(axis=1) / weight.sum(axis=1)
    depth = np.clip(1 - gap / gap.max(), 0.0, 1.0)
    amount = np.where(touching, gap, np.minimum(followed, limit) * depth)
    return (scale - 1) * amount[:, None] * direction


def _picture(drawing: Drawing, assembly: Assembly, strongest: Hardest) -> Figure:
    frame, drive, run = strongest.frame, assembly.drive, own_cycle(drawing)
    degrees = float(frame_degrees(drawing, drive)[frame])
    tilt, shift = (float(np.interp(degrees, run.degrees, values)) for values in (run.tilt, run.lateral))
    subtitle = (
        f"{drawing.scene_name}  ·  largest force of {strongest.contact}: {style.quantity(strongest.force, 'N')} at"
        f" {shown_angle(degrees, 1)}°"
        f"  ·  {drive.body}: tilt {style.signed(tilt * 1e3, 2)} mrad, shift {style.signed(shift * 1e6, 0)} µm"
    )
    title = f"Deformation, lateral motion, tilt and gaps × {style.magnified(assembly.scale)}"
    figure = style.new_figure(title, subtitle)
    tops = {name: float(member.moved(frame, drive.along, 0.0)[1].max()) for name, member in assembly.parts.items()}
    figure.text(0.02, 0.018, style.CAPPED, fontsize=9.5, color=style.FAINT)
    image, forces = _render(drawing, assembly, frame, tops)
    axes = style.show_image(figure, image, (0.02, 0.02))
    for x, y, text in forces:
        axes.text(x, y - 38, text, ha="center", va="bottom", fontsize=10, color=style.RED, fontweight="bold")
    for k, (name, top) in enumerate(tops.items()):
        box = (0.785 + 0.11 * k, 0.18, 0.018, 0.55)
        style.magnitude_bar(figure, top, "", "m", box, colours=assembly.parts[name].colours)
        figure.text(box[0], 0.745, f"{name}\n[{style.prefixed(top, 'm')[1]}]", fontsize=9.5)
    figure.text(0.785, 0.15, "elastic displacement\nacross the motion", fontsize=9.5, va="top")
    return figure


def _render(
    drawing: Drawing, assembly: Assembly, frame: int, tops: dict[str, float]
) -> tuple[Image, list[tuple[float, float, str]]]:
    """Return the bodies and the forces on the driven one, and place [px] and text of each force."""
    plotter = view.new_plotter(IMAGE)
    assembly.turn_to(frame)
    for name, member in assembly.parts.items():
        view.add_skin(plotter, member.skin, member.colours, (0.0, tops[name] or 1.0), 3.0)
    forces = arrows(drawing, assembly, frame)
    for tail, tip, _ in forces:
        view.add_arrow(plotter, tail, tip)
    seen = [member.skin.points for member in assembly.parts.values()]
    view.aim(plotter, assembly.view, np.vstack([*seen, *(tail for tail, _, _ in forces)]))
    texts = [(*view.pixel(plotter, IMAGE, (tail + tip) / 2), text) for tail, tip, text in forces]
    return view.photograph(plotter, IMAGE, last=True), texts


def arrows(drawing: Drawing, assembly: Assembly, frame: int) -> list[tuple[np.ndarray, np.ndarray, str]]:
    """Return tail, tip and text of an arrow, outside of all bodies, for each contact force on the driven body."""
    drive, driven = assembly.drive, assembly.parts[assembly.drive.body].body
    largest = max(float(drawing.frame_force(drive.body).max()), 1e-300)
    outside = max(float(np.abs(member.still @ drive.right).max()) for member in assembly.parts.values())
    position = drawing.position(drive.body)
    forces, trajectory = [], drawing.trajectory
    for name, contact in drawing.contacts_of(drive.body).items():
        weights = contact.multipliers[frame]
        force = weights @ driven.modal.interfaces[contact.interface].normals
        size = float(np.linalg.norm(force))
        ratio = size / largest
        if ratio < LEAST_FORCE:
            continue
        point = weights @ contact.points / weights.sum() + position + driven.twist(frame)[:3]
        side = np.sign(force @ drive.right) * drive.right
        tip = 1.06 * outside * side + (point @ drive.along) * drive.along
        length = (LEAST_LENGTH + (1 - LEAST_LENGTH) * ratio) * ARROW * assembly.size
        strongest = hardest(drawing.trajectory, [name])
        windowed = np.linalg.norm(windowed_force(trajectory, name)[0], axis=1)
        within = float(np.interp(trajectory.frame_times[frame], middles(trajectory.times), windowed))
        shown = strongest.force if strongest is not None and strongest.frame == frame else within
        forces.append((tip + length * side, tip, f"{name}\n{style.quantity(shown, 'N')}"))
    return forces
