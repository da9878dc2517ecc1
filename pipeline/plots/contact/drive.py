"""Crank angle and directions (along, across, out of plane) for pictures of a driven scene."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, MultipleLocator

from gudgeon.modaldb.records.trajectory import ContactHistory, Trajectory
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.force_axes import windowed_force
from gudgeon.solver.vectors import unit

TICK = 90.0
"""Step of labelled crank angles [deg], or a multiple of it."""
FINE = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0)
"""Steps where less than two of these are shown."""
MOST_TICKS = 8
TURN = 360.0


@dataclass(frozen=True)
class Drive:
    """The first joint of a scene: a body with prescribed motion along and impacts across."""

    joint: str
    body: str
    along: np.ndarray
    """Unit vector of the prescribed motion, (3,)."""
    right: np.ndarray
    """Unit vector against the first lateral motion of the crank pin: the thrust side after upper dead centre, (3,)."""
    cycle: float
    """Period of the crank angle [deg]."""

    @property
    def axis(self) -> np.ndarray:
        """Axis of a tilt that moves the upper end to the right, (3,)."""
        return np.cross(self.along, self.right)


@dataclass(frozen=True)
class Cycle:
    """One run over the crank angle."""

    label: str
    drive: Drive
    trajectory: Trajectory
    """With times, contact forces, quantities, joints and motion."""

    @property
    def degrees(self) -> np.ndarray:
        """Crank angle at the end of each sample interval [deg], (s,)."""
        return np.degrees(self.trajectory.joints[self.drive.joint].angle)

    @cached_property
    def sides(self) -> dict[str, np.ndarray]:
        """Force of the body to the right on each of its contacts, within the window of `force_peak` [N], (s,)."""
        return {
            name: windowed_force(self.trajectory, name)[0] @ -self.drive.right
            for name, contact in self.trajectory.contacts.items()
            if contact.body == self.drive.body
        }

    @property
    def window(self) -> str:
        """The windows of the forces, as text; empty without contacts."""
        widths = [windowed_force(self.trajectory, name)[1] for name in self.sides]
        texts = [style.quantity(width, "s") for width in (min(widths), max(widths))] if widths else []
        return f"forces: mean over {' to '.join(dict.fromkeys(texts))}, twice" if texts else ""

    @cached_property
    def side_force(self) -> np.ndarray:
        """Windowed force of the body to the right [N], (s,)."""
        return np.sum([*self.sides.values()], axis=0) if self.sides else np.zeros(len(self.trajectory.times))

    @property
    def tilt(self) -> np.ndarray:
        """Tilt of the body, positive if its upper end moves to the right [rad], (s,)."""
        return self.trajectory.motion[self.drive.body][:, 3:6] @ self.drive.axis

    @property
    def lateral(self) -> np.ndarray:
        """Shift of the centre of mass to the right [m], (s,)."""
        return self.trajectory.motion[self.drive.body][:, :3] @ self.drive.right

    @property
    def span(self) -> tuple[float, float]:
        """Crank angles at its start and end [deg], rounded to whole numbers within round-off."""
        degrees = self.degrees
        return float(np.round(2 * degrees[0] - degrees[1], 6)), float(np.round(degrees[-1], 6))

    @property
    def abscissa(self) -> style.Abscissa:
        """The crank angle at samples."""
        return style.Abscissa(self.degrees, "crank angle [deg]", lambda axes: crank_axis(axes, *self.span))


def drive_of(drawing: Drawing) -> Drive:
    """Return the first joint of a driven scene, as its scene describes it."""
    name, history = next(iter(drawing.cranks.items()))
    joint = drawing.scene.get("joint", {}).get(name, {})
    along = unit(joint.get("along", (0.0, 0.0, 1.0)))
    right = -unit(joint.get("lateral", (1.0, 0.0, 0.0)))
    spans = [np.ptp([row[0] for row in force["values"]]) for force in _gas(drawing, name)]
    return Drive(name, history.body, along, right, max([TURN, *(float(span) for span in spans)]))


def own_cycle(drawing: Drawing) -> Cycle:
    """Return the cycle of this run."""
    return Cycle(drawing.scene_name, drive_of(drawing), drawing.trajectory)


def cycles(drawing: Drawing) -> list[Cycle]:
    """Return this run, then those compared with it; a label for its own key replaces the scene's name."""
    runs, fields = [own_cycle(drawing)], ["times", "contacts", "joints", "motion", "quantities"]
    for label, key in drawing.compare.items():
        if key == drawing.key:
            runs[0] = replace(runs[0], label=label)
        else:
            runs.append(Cycle(label, runs[0].drive, drawing.store.get(key, "trajectory", only=fields)))
    return runs


def hardest_first(contacts: Mapping[str, ContactHistory]) -> list[str]:
    """Return the names of contacts, sorted by their largest force, descending."""
    return sorted(contacts, key=lambda name: -float(np.linalg.norm(contacts[name].force, axis=1).max()))


def gas_pressure(drawing: Drawing, drive: Drive, degrees: np.ndarray) -> np.ndarray | None:
    """Return the gas pressure of the scene's table at crank angles [deg], (s,), or None without a table."""
    for force in _gas(drawing, drive.joint):
        angle, pressure = np.array(force["values"], float).T
        return np.interp(np.mod(degrees - angle[0], np.ptp(angle)), angle - angle[0], pressure)
    return None


def frame_degrees(drawing: Drawing, drive: Drive) -> np.ndarray:
    """Return the crank angle at each frame [deg], (f,)."""
    trajectory = drawing.trajectory
    times, angle = trajectory.times, np.degrees(trajectory.joints[drive.joint].angle)
    # The crank turns at constant speed: a straight line also covers frames before the first sample.
    return np.polyval(np.polyfit(times, angle, 1), trajectory.frame_times)


def crank_axis(axes: Axes, low: float, high: float) -> None:
    """Set the limits of an axis over crank angles; texts name the same angles, see `shown_angle`."""
    axes.set_xlim(low, high)
    steps = FINE if high - low < 2 * TICK else TICK * 2.0 ** np.arange(20)
    step = next((tick for tick in steps if (high - low) / tick <= MOST_TICKS), steps[-1])
    decimals = 0 if step >= 1 else 1
    axes.xaxis.set_major_locator(MultipleLocator(step))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda angle, _: shown_angle(angle, decimals)))


def shown_angle(degrees: float, decimals: int) -> str:
    """Return a crank angle as the axes show it, counted on through cycles from the start of the run."""
    return style.signed(degrees, decimals)


def _gas(drawing: Drawing, joint: str) -> list[dict]:
    forces = drawing.scene.get("force", {}).values()
    return [force for force in forces if force.get("joint") == joint and len(force.get("values", ())) > 1]
