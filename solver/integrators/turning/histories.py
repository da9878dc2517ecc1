"""What a mechanism records at its samples: reactions and angles of its joints, and what probes read."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.trajectory import JointHistory, ProbeHistory
from gudgeon.modaldb.records.types import Json
from gudgeon.solver import core
from gudgeon.solver.integrators.outcome import LinkageHistories
from gudgeon.solver.integrators.turning.arrays import (
    DRAG_PUSH,
    NORMAL_PUSH,
    SURFACE,
    Model,
    Reading,
    Work,
    pushes_of,
)
from gudgeon.solver.integrators.turning.build import Linkage
from gudgeon.solver.integrators.turning.energy import Motion, momentum_error, motion_of
from gudgeon.solver.integrators.turning.flexible.lacking import inertia_truncations, joint_truncations
from gudgeon.solver.integrators.turning.flexible.statics import Statics
from gudgeon.solver.integrators.turning.probes import Reader, States, readers
from gudgeon.solver.integrators.turning.touching.columns import FORCE
from gudgeon.solver.integrators.turning.touching.log import Touching
from gudgeon.solver.integrators.turning.touching.track import Track
from gudgeon.solver.integrators.turning.touching.worn import (
    BEARING,
    Rubbed,
    offsets,
    worn_cells,
    worn_quantities,
)
from gudgeon.solver.joints.reactions import wrench_peaks

Given = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Drives (t, d, 3) and loads (t, l) at times [s], (t,)."""


class Sample(NamedTuple):
    """What is recorded of one state."""

    state: np.ndarray
    vectors: np.ndarray
    """Rotation vector of each body [rad], (n, 3)."""
    reading: Reading
    motion: Motion
    pressed: np.ndarray
    """Force of each section [N], (c,)."""
    offsets: np.ndarray
    """Of the journals of sections that wear, in their bearings' frames [m], (w, 2)."""


class Recorder:
    """Reads states of a run, one after the other."""

    def __init__(self, linkage: Linkage, model: Model, work: Work, touching: Touching) -> None:
        self._linkage, self._model, self._work, self._touching = linkage, model, work, touching
        self.samples: list[Sample] = []
        self._turning = core.Turning(model, work)
        self.readers: list[Reader] = readers(linkage)
        self._statics = Statics(linkage, model)
        self._hardest = 0.0
        self._harder: list[tuple[float, np.ndarray]] = []

    def take(self, state: np.ndarray, vectors: np.ndarray, drives: np.ndarray, amounts: np.ndarray) -> None:
        """Record a state with drives (d, 3) and loads (l,) at its time."""
        self.samples.append(self._sampled(state, vectors, drives, amounts))

    def heed(self, state: np.ndarray, time: float, drives_of: Given) -> None:
        """Keep the forces of joints at a state in which what touches presses harder than ever before.

        Between samples, an impact may be over.
        """
        load = float(np.abs(self._work.touch[:, FORCE] * self._work.touching).sum()) if self._touching else 0.0
        if load > self._hardest and self._linkage.pairs:
            self._hardest = load
            drives, amounts = drives_of(np.array([time]))
            sample = self._sampled(state, self.samples[-1].vectors, drives[0], amounts[0])
            self._harder.append((time, sample.reading.wrenches.copy()))

    def _sampled(self, state: np.ndarray, vectors: np.ndarray, drives: np.ndarray, amounts: np.ndarray) -> Sample:
        """Return what is recorded of a state."""
        pairs = len(self._model.owner)
        zeros = [np.zeros(shape) for shape in (len(self._model.row_terms), (pairs, 6), (pairs, 6), pairs, pairs)]
        reading = Reading(*zeros)
        if not self._touching:
            self._turning.read(state, drives, amounts, reading)
            motion = motion_of(self._model, self._work, state, self._turning)
            return Sample(state, vectors, reading, motion, np.zeros(0), np.zeros((0, 2)))
        pressing, slipping = self._work.touching.copy(), self._work.slipping.copy()
        # What was indented then may have parted since; of points before other bodies, those that pressed in the step.
        between = self._model.touch_shape == SURFACE
        self._work.touching[:] = np.where(between, self._touching.pressed, True)
        self._work.slipping[:] = self._touching.slipped
        self._turning.read(state, drives, amounts, reading)
        forces = self._work.touch[:, FORCE].copy()
        self._work.touching[:] = np.where(between, self._touching.pressed, pressing)
        bearing_offsets = [offsets(self._model, self._work, i)[BEARING] for i in self._touching.rubbed]
        motion = motion_of(self._model, self._work, state, self._turning)
        self._work.slipping[:], self._work.touching[:] = slipping, pressing
        return Sample(state, vectors, reading, motion, forces, np.array(bearing_offsets).reshape(-1, 2))

    def static_gauges(self, amounts: np.ndarray) -> np.ndarray:
        """Return what the modes lack of the gauges at the last samples, (s, G), with loads (s, l)."""
        samples = self.samples[len(self.samples) - len(amounts) :]
        every, forces = _readings(samples), np.array([s.pressed for s in samples])
        contacts = zip(self._linkage.system.contacts, self._touching.tracks, strict=True)
        contact_forces = {c.name: forces[:, track.sections] for c, track in contacts}
        return self._statics.values(_states_of(samples, every, 0.0), every.holds, amounts, contact_forces)

    def found(self, interval: float, notes: list[str], end: tuple[np.ndarray, float], count: int) -> LinkageHistories:
        """Return the histories of the first samples.

        Args:
            end: State and time of the last step [s].
        """
        samples = self.samples[: count + 1]
        scene, linkage = self._linkage.system.scene, self._linkage
        every = _readings(samples)
        wrenches, angles = every.wrenches, every.angles
        lengths = every.violations * self._model.size
        joint_settings = {**scene.hinges(), **scene.cranks()}
        joints = {
            name: JointHistory(
                joint_settings[name].body, "", angles[1:, pair], wrenches[1:, pair, :3].copy(), lengths[1:, pair]
            )
            for name, pair in linkage.pairs.items()
        }
        read_all = _states_of(samples, every, interval)
        by_joints, said = joint_truncations(linkage, self._model, read_all, every.holds)
        by_rotation, rotation_notes = inertia_truncations(linkage, self._model, read_all)
        lacks, notes = by_joints | by_rotation, [*notes, *said, *rotation_notes]
        probes = {r.name: r.history(self._model, read_all) for r in self.readers} | self._orbits(samples)
        times = interval * np.arange(1, len(samples))
        peaks = _quantities(linkage, times, wrenches[1:], angles[1:], self._harder)
        return LinkageHistories(
            joints, probes, peaks | self._pushes(end[0]) | lacks,
            momentum_error(self._model, read_all.samples, read_all.motions, wrenches, interval * (len(samples) - 1)),
            notes,
            impacts={name: self._touching.of_sections(self._sections(name), *end) for name in self._clearances()},
            wear={name: worn_cells(self._rubbed(name)) for name in self._wearing()},
        )  # fmt: skip

    def _orbits(self, samples: list[Sample]) -> dict[str, ProbeHistory]:
        """Return the offsets of journals that wear in their bearings, `JOINT.orbit`."""
        histories, every = {}, np.array([s.offsets for s in samples])
        numbers = list(self._touching.rubbed)
        for name in self._wearing():
            columns_of = [numbers.index(int(i)) for i in self._sections(name)]
            columns = [
                f"{axis}{'' if len(columns_of) == 1 else end}" for end in range(len(columns_of)) for axis in "xy"
            ]
            values = every[1:, columns_of].reshape(len(samples) - 1, 2 * len(columns_of))
            histories[f"{name}.orbit"] = ProbeHistory("displacement", values, "m", ", ".join(columns), 0.0)
        return histories

    def _wearing(self) -> list[str]:
        """Return the joints that wear."""
        return [name for name in self._clearances() if self._rubbed(name)]

    def _rubbed(self, name: str) -> list[Rubbed]:
        """Return what was added up of a joint's sections; none without wear."""
        return [self._touching.rubbed[int(i)] for i in self._sections(name) if int(i) in self._touching.rubbed]

    def _pushes(self, state: np.ndarray) -> Json:
        """Return the impulses of joints with clearance, with force times sliding distance, and of contacts."""
        json: Json = {}
        sums = pushes_of(state, len(self._linkage.sections))
        for name in self._clearances():
            impulse, slide = sums[self._sections(name), :2].sum(axis=0)
            json[f"{name}.impulse"] = {"value": float(impulse), "unit": "N s"}
            json[f"{name}.load_distance"] = {"value": float(slide), "unit": "N m"}
            if rubbed := self._rubbed(name):
                json |= worn_quantities(name, rubbed)
        for contact, track in zip(self._linkage.system.contacts, self._touching.tracks, strict=True):
            size = float(np.linalg.norm(sums[track.sections, NORMAL_PUSH:DRAG_PUSH].sum(axis=0)))
            json[f"{contact.name}.impulse"] = {"value": size, "unit": "N s"}
            if (friction := self._linkage.system.scene.contact[contact.name].friction) is not None:
                work = friction.static * float(sums[track.sections, 1].sum())
                json[f"{contact.name}.friction_work"] = {"value": work, "unit": "J"}
            if not track.touched and track.least[0] < self._farthest(track):  # Not of a run without a step.
                for key, value, unit in zip(("least_gap", "least_gap_time"), track.least, ("m", "s"), strict=True):
                    json[f"{contact.name}.{key}"] = {"value": value, "unit": unit}
        return json

    def _farthest(self, track: Track) -> float:
        """Return the gap from which on the points of a contact are not looked at [m]."""
        surfaces = self._model.surfaces
        start = len(self._model.touch_pair) - len(surfaces.arm)
        of_track = (surfaces.points[:, 0] + start == track.sections[0]) if len(track.sections) else np.zeros(0, bool)
        return float(surfaces.deep[of_track][0]) if of_track.any() else np.inf

    def _clearances(self) -> list[str]:
        """Return the joints with clearance."""
        return [name for name, pair in self._linkage.pairs.items() if pair in self._model.touch_pair]

    def _sections(self, name: str) -> np.ndarray:
        """Return the numbers of a joint's sections."""
        return np.flatnonzero(self._model.touch_pair == self._linkage.pairs[name])


def _readings(samples: list[Sample]) -> Reading:
    """Return what was read of samples, one after the other."""
    return Reading(*(np.array(s) for s in zip(*(s.reading for s in samples), strict=True)))


def _states_of(samples: list[Sample], every: Reading, interval: float) -> States:
    """Return samples with their readings as states, `interval` apart [s]."""
    states, vectors = (np.array([getattr(s, key) for s in samples]) for key in ("state", "vectors"))
    return States(states, [s.motion for s in samples], vectors, every.wrenches, every.multipliers, interval)


def _quantities(
    linkage: Linkage,
    times: np.ndarray,
    wrenches: np.ndarray,
    angles: np.ndarray,
    harder: list[tuple[float, np.ndarray]],
) -> Json:
    """Return the quantities of joints, `JOINT.name` → {"value", "unit"}.

    Args:
        harder: Times between samples and wrenches (pairs, 6) there.
    """
    json: Json = {}
    if len(times) and (between := [h for h in harder if h[0] <= times[-1]]):
        times = np.append(times, [time for time, _ in between])
        wrenches = np.concatenate([wrenches, [h for _, h in between]])
    for name, pair in linkage.pairs.items() if len(times) else ():
        json |= wrench_peaks(name, times, wrenches[:, pair])
        if getattr(linkage.system.scene.joint[name], "turns", False):
            json[f"{name}.angle_end"] = {"value": float(angles[-1, pair]), "unit": "rad"}
    return json
