"""`mechanism.mp4`: bodies in motion as they deform, paths of their joints, the planes that they meet, and forces of
joints and contacts as arrows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image, ImageDraw

from gudgeon.pipeline.plots.base import film, style
from gudgeon.pipeline.plots.base.pace import at_times, closed_spans, pace_of
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.deformation.obstacle import WALL, faces
from gudgeon.pipeline.plots.mechanism.motion import Moving, moving_bodies
from gudgeon.pipeline.plots.mechanism.picture import draw_reactions, plane_of
from gudgeon.pipeline.plots.mechanism.shapes import Shape, Shown, shown_bodies
from gudgeon.solver.obstacles.plane import Plane

SIZE = (960, 720)
"""Of the film [px]."""
BOX = (24, 84, 836, 492)
"""Left, upper, right, lower border of the bodies [px]."""
FRAMES = 120
LEAST = 3
"""Frames of a run below which there is no film."""
SLANT = np.array([[0.86, -0.5, 0.0], [0.29, 0.5, 0.82], [-0.41, -0.71, 0.58]])
"""Directions to the right, upwards and towards the eye of motions in space; of unit length to 1 %."""
LONGEST = 0.16
"""Longest arrow over the width of the bodies' part."""
LENGTH = LONGEST * (BOX[2] - BOX[0])
"""Arrow of the largest force [px]."""
MARGIN = 16.0
"""Between what is drawn and the border, for heads of arrows, lines and points with a width [px]."""
HALVINGS = 40
"""Of the interval of the scale."""
SHORTEST = 6.0
"""Arrow below which none is drawn [px]."""
FINER = 2
"""Factor by which frames are larger before they are averaged."""


@dataclass(frozen=True)
class View:
    """How places are projected onto the film."""

    axes: np.ndarray
    """Directions to the right, upwards and towards the eye, (3, 3)."""
    middle: np.ndarray
    """Place along the first two [m], (2,)."""
    scale: float
    """[px/m]"""
    corner: tuple[float, float]
    """Where it is seen [px]."""

    def seen(self, points: np.ndarray) -> np.ndarray:
        """Return the pixels of places [m], (..., 3), and their depth, (..., 3)."""
        projected = points @ self.axes.T
        x = self.corner[0] + (projected[..., 0] - self.middle[0]) * self.scale
        y = self.corner[1] - (projected[..., 1] - self.middle[1]) * self.scale
        return FINER * np.stack([x, y, projected[..., 2]], -1)


def draw_film(drawing: Drawing) -> None:
    """Make the film of a mechanism."""
    trajectory = drawing.trajectory
    if len(trajectory.frame_times) < LEAST or not len(trajectory.times):
        return
    touching = closed_spans(trajectory, trajectory.contacts)
    ends = float(trajectory.frame_times[0]), float(trajectory.frame_times[-1])
    pace = pace_of(ends, touching, min(FRAMES, 2 * len(trajectory.frame_times)))
    drawing = at_times(drawing, pace.times)
    times, frames = pace.times, np.arange(len(pace.times))
    bodies = shown_bodies(drawing, frames)
    largest = max((float(body.bent.max(initial=0.0)) for body in bodies), default=0.0)
    arrows, walls = _arrows(drawing, times[frames], bodies), _walls(drawing, bodies)
    view = _view(bodies, moving_bodies(drawing), arrows, walls)
    scale, unit = style.time_unit(float(drawing.trajectory.times[-1]))
    row = {int(frame): k for k, frame in enumerate(frames)}

    def turn_to(frame: int) -> film.Shot:
        time = float(times[frame])
        picture = _bodies_at((row[frame], time), bodies, arrows, view, largest=largest, walls=walls)
        return film.Shot(time * scale, f"{pace.text(frame)}{style.digits(time * scale)} {unit}", picture)

    with style.styled(), drawing.file("mechanism.mp4") as path:
        figure, axes = _ground(drawing, largest, bool(arrows), bool(walls))
        film.shoot(path, figure, BOX, frames, turn_to, curves=[axes])


@dataclass(frozen=True)
class Arrow:
    """Force of a joint or a contact on its body."""

    places: np.ndarray
    """Where it acts [m], (f, 3)."""
    forces: np.ndarray
    """Over the largest of all, (f, 3)."""


def _walls(drawing: Drawing, bodies: Sequence[Shown]) -> list[np.ndarray]:
    """Return the corners of the planes that bodies meet, around all places of these bodies [m], (k, 3) each."""
    contacts = drawing.scene["contact"].values()
    planes = [
        Plane.model_validate(against["against"]) for against in contacts if against["against"]["shape"] == "plane"
    ]
    cloud = np.concatenate([body.places.reshape(-1, 3) for body in bodies])
    return [np.asarray(wall.points, float) for wall in faces(planes, cloud)]


def _view(
    bodies: Sequence[Shown], moving: Sequence[Moving], arrows: Sequence[Arrow], walls: Sequence[np.ndarray] = ()
) -> View:
    """Return a projection that shows all bodies, arrows and planes at all frames: onto their plane, or aslant."""
    cloud = np.concatenate([*(body.places.reshape(-1, 3) for body in bodies), *walls])
    shown = plane_of([body.places(slice(None)) for body in moving])
    axes = SLANT
    if len(shown) == 2:
        axes = np.eye(3)[[*shown, 3 - int(shown.sum())]]
    room = np.array([BOX[2] - BOX[0], BOX[3] - BOX[1]], float)
    # What is seen lies at places [m], of which only the scale decides, and beside them by pixels.
    points = np.concatenate([cloud, *(body.places for body in arrows)]) @ axes[:2].T
    beside = np.concatenate([np.zeros_like(cloud), *(LENGTH * body.forces for body in arrows)]) @ axes[:2].T

    def reach(scale: float) -> tuple[np.ndarray, np.ndarray]:
        seen = scale * points + beside
        return np.minimum(seen, scale * points).min(axis=0), np.maximum(seen, scale * points).max(axis=0)

    widest = np.maximum(np.ptp(points, axis=0), 1e-9 * np.ptp(cloud))
    lower, upper = 0.0, float((room / widest).min())
    for _ in range(HALVINGS):
        scale = 0.5 * (lower + upper)
        low, high = reach(scale)
        lower, upper = (scale, upper) if (high - low <= room - 2 * MARGIN).all() else (lower, scale)
    low, high = reach(lower)
    return View(axes, 0.5 * (low + high) / lower, lower, (room[0] / 2, room[1] / 2))


def _arrows(drawing: Drawing, times: np.ndarray, bodies: Sequence[Shown]) -> list[Arrow]:
    """Return the forces of joints and contacts at frames."""
    trajectory, arrows = drawing.trajectory, []
    by_name = {body.name: body for body in bodies}
    every = {**trajectory.joints, **trajectory.contacts}
    largest = max((float(np.linalg.norm(history.force, axis=1).max()) for history in every.values()), default=0.0)
    for name, history in every.items() if largest > 0 else ():
        body = by_name[history.body]
        points = body.joints[name] if name in trajectory.joints else body.contacts[name]
        forces = np.column_stack([np.interp(times, trajectory.times, history.force[:, i]) for i in range(3)])
        arrows.append(Arrow(points, forces / largest))
    return arrows


def _bodies_at(
    frame: tuple[int, float], bodies: Sequence[Shown], arrows: Sequence[Arrow], view: View, *, largest: float,
    walls: Sequence[np.ndarray],
) -> Image.Image:  # fmt: skip
    """Return the picture of a frame, its number and time [s]."""
    k, time = frame
    size = (FINER * (BOX[2] - BOX[0]), FINER * (BOX[3] - BOX[1]))
    picture = Image.new("RGB", size, "white")
    pen = ImageDraw.Draw(picture)
    for corners in walls:
        rim = [(float(x), float(y)) for x, y in view.seen(corners)[:, :2]]
        pen.polygon(rim, fill=WALL)
        pen.line([*rim, rim[0]], fill=style.GREY, width=2 * FINER)
    for body in bodies:
        for name, (path_times, path) in body.paths.items():
            line = view.seen(np.vstack([path[path_times <= time], body.joints[name][k]]))[:, :2]
            pen.line([tuple(item) for item in line], fill=style.GREY, width=FINER)
    faces = [face for body in bodies for face in _faces(body, k, view, largest)]
    for _, corners, colour in sorted(faces, key=lambda item: item[0]):
        if len(corners) == 2:
            pen.line(corners, fill=colour, width=4 * FINER)
        else:
            pen.polygon(corners, fill=colour)
    for body in bodies:
        for path in body.joints.values():
            x, y, _ = view.seen(path[k])
            r = 4 * FINER
            pen.ellipse((x - r, y - r, x + r, y + r), fill=style.ORANGE)
    for arrow in arrows:
        _draw_arrow(pen, view, arrow.places[k], arrow.forces[k])
    return picture.resize((size[0] // FINER, size[1] // FINER), Image.Resampling.LANCZOS)


Face = tuple[float, list[tuple[float, float]], tuple[int, int, int]]


def _faces(body: Shown, k: int, view: View, largest: float) -> list[Face]:
    """Return depth, corners and colour of the lines and triangles of a body."""
    points = view.seen(body.places[k])
    cells = body.cells
    corners, depth = points[cells][..., :2], points[cells][..., 2].mean(axis=1)
    if body.shape is Shape.RIGID or largest == 0:
        colours = np.tile(to_rgb(style.BLUE), (len(cells), 1))
    else:
        colours = style.MAGNITUDE(body.bent[k][cells].mean(axis=1) / largest)[:, :3]
    if cells.shape[1] == 3:
        edges = body.places[k][cells]
        normals = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0]) @ view.axes.T
        sizes = np.linalg.norm(normals, axis=1)
        light = 0.45 + 0.55 * np.abs(normals[:, 2]) / np.where(sizes > 0, sizes, 1.0)
        colours = colours * light[:, None]
    tones = (255 * colours).astype(int)
    return [
        (float(d), [(float(x), float(y)) for x, y in c], (int(t[0]), int(t[1]), int(t[2])))
        for d, c, t in zip(depth, corners, tones, strict=True)
    ]


def _draw_arrow(pen: ImageDraw.ImageDraw, view: View, point: np.ndarray, force: np.ndarray) -> None:
    """Draw an arrow from a place along a force."""
    tail = view.seen(point)[:2]
    along = FINER * LENGTH * (view.axes[:2] @ force) * [1.0, -1.0]
    length = float(np.linalg.norm(along))
    if length < FINER * SHORTEST:
        return
    tip, ahead = tail + along, along / length
    across, head = np.array([-ahead[1], ahead[0]]), min(14.0 * FINER, 0.6 * length)
    foot = tip - head * ahead
    pen.line([tuple(tail), tuple(foot)], fill=style.RED, width=3 * FINER)
    corners = [tip, foot + 0.45 * head * across, foot - 0.45 * head * across]
    pen.polygon([(float(x), float(y)) for x, y in corners], fill=style.RED)


def _ground(drawing: Drawing, largest: float, arrows: bool, walls: bool) -> tuple[Figure, Axes]:
    """Return what does not move, and the axes of the forces."""
    trajectory = drawing.trajectory
    text = "bodies in motion, deformation as it is" if largest > 0 else "bodies in motion"
    acting = " and ".join(kind for kind in ("joints", "contacts") if getattr(trajectory, kind))
    text += f"; red: forces of {acting} on their bodies" * arrows + "; grey: paths of joints" + ", obstacles" * walls
    figure = style.new_figure(drawing.scene_name, text, width=SIZE[0], height=SIZE[1], dpi=film.DPI)
    axes = figure.add_axes((0.085, 0.085, 0.89, 0.14))
    if largest > 0:
        style.magnitude_bar(figure, largest, "elastic displacement", "m", (0.885, 0.38, 0.014, 0.4))
    scale, unit = style.time_unit(float(trajectory.times[-1]))
    draw_reactions(axes, trajectory.times * scale, drawing)
    axes.set(xlim=(0.0, float(trajectory.times[-1]) * scale), xlabel=f"time [{unit}]")
    return figure, axes
