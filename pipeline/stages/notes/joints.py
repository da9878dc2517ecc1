"""Notes on joints of mechanisms whose forces ring, where bodies that deform start undeformed while they move."""

from collections.abc import Iterator

import numpy as np

from gudgeon.modaldb.records.trajectory import JointHistory
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.pipeline.stages.notes.facts import Facts

TURNS = 8
"""Least number of turning points of a force that rings."""
SLOWER = 10.0
"""Longest period of the ringing, over the slowest vibration of the bodies alone: what they hold slows it."""
HIGHER = 1.05
"""Peak over the largest mean over a period from which a note is given."""


def ringing(facts: Facts) -> Iterator[str]:
    """Yield a note for each joint of deforming bodies whose peak is that of a vibration, with its mean."""
    scene = facts.scene
    if not facts.finished or not scene.capabilities.turns or not scene.joint or scene.run.start == "rest":
        return
    slowest = {name: _slowest(facts, name) for name in scene.body}
    joined = {name: _bodies(scene, name) for name in scene.joint}
    deforming = [name for name, bodies in joined.items() if any(slowest.get(body, 0.0) for body in bodies)]
    if not deforming:
        return
    record = facts.store.get(facts.job.trajectory().key, "trajectory", only=["times", "joints"])
    for name in deforming:
        longest = SLOWER * max(slowest.get(body, 0.0) for body in joined[name])
        history = record.joints.get(name)
        ringing_force = None if history is None else mean_over_ringing(record.times, history, longest)
        if ringing_force is None:
            continue
        peak, mean, period = ringing_force
        yield (
            f"joint.{name}: force_peak, {peak:.4g} N, is that of a vibration, which rings from the start, at which"
            f" bodies are undeformed: the largest mean over its period of {period:.2g} s is {mean:.4g} N;"
            ' run.start = "rest" leaves it out, and component.NAME.damping lets it decay'
        )


def _slowest(facts: Facts, body: str) -> float:
    """Return the longest period of a body's vibrations [s]; 0 of a rigid one."""
    record = facts.modes.get(facts.scene.component_of(body))
    omega = np.zeros(0) if record is None else record.angular_frequencies[record.angular_frequencies > 0]
    return float(2 * np.pi / omega.min()) if len(omega) else 0.0


def _bodies(scene: SceneFile, name: str) -> list[str]:
    joint = scene.joint[name]
    return [body for key in ("body", "against") if isinstance(body := getattr(joint, key, None), str)]


def mean_over_ringing(times: np.ndarray, history: JointHistory, longest: float) -> tuple[float, float, float] | None:
    """Return the peak of a joint's force [N], its largest mean over a period of its ringing [N], and this period [s].

    None where it has no ringing of a period up to `longest` [s], or the mean is as large.
    """
    sizes = np.linalg.norm(history.force, axis=1)
    if not sizes.any():
        return None
    along = history.force @ (history.force[int(sizes.argmax())] / sizes.max())
    rises = np.diff(along) > 0
    turns = int((rises[1:] != rises[:-1]).sum())
    if turns < TURNS or (period := 2 * float(times[-1] - times[0]) / turns) > longest:
        return None
    count = max(2, round(period / float(times[1] - times[0])))
    if 2 * count > len(times):
        return None
    window = np.ones(count) / count
    means = np.array([np.convolve(component, window, mode="valid") for component in history.force.T])
    mean = float(np.linalg.norm(means, axis=0).max())
    return (float(sizes.max()), mean, period) if sizes.max() > HIGHER * mean else None
