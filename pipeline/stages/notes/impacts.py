"""Notes on the impacts of a finished run: those that its end cuts, windows of forces, and speeds beyond the model."""

from collections.abc import Iterator, Mapping
from itertools import count
from typing import Any

import numpy as np

from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.pipeline.stages.notes.facts import Facts
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.contact.windows import SHARE

ROUNDING = 1e-9
"""Share of the duration by which an impact that the end of the run cuts may seem to end before."""
FAST = 0.1
"""Speed of an impact over the wave speed of an elastic body above which a run gives a note."""

DELIVERED = 0.01
"""Difference of the restitution of bodies from that of their points above which a run gives a note."""
WEIGHT = 2.0
"""Time over which `force_peak` is a mean, over the window."""
PRESSES = 1e-2
"""Force at the end of a run over the largest one from which a contact counts as closed."""
YOUNG = 0.25
"""Share of the run that an impact of driven or loaded bodies has lasted at most at its end, to be one that is cut."""

Quantities = Mapping[str, Mapping[str, Any]]


def impacts(facts: Facts) -> Iterator[str]:
    """Yield the notes on the impacts of a finished run."""
    if not facts.finished:
        return
    scene, quantities, counts = facts.scene, facts.summary["quantities"], facts.summary["counts"]
    for name in scene.contact:
        listed, window = list(_impacts(quantities, name)), _value(quantities, f"{name}.force_window")
        if _is_cut(scene, name, quantities, listed) and facts.last_force(name) > PRESSES:
            since = max(listed, key=lambda i: i["end"])["start"]
            yield (
                f"contact.{name} is closed at the end of the run: its impulse and rebound are not those of a whole"
                f" impact, which began at {since:.4g} s; set run.duration longer"
            )
        if scene.run.window is not None and window > 0 and scene.contact[name].method == "impact":
            yield (
                f"contact.{name}: its impacts are jumps of velocity, so that force_peak is their impulse over"
                f" run.window = {window:.3g} s"
            )
        yield from _delivered(scene, name, quantities)
        yield from _below_steps(name, window, counts) or _short(scene, name, window, quantities)
        yield from _fast(scene, name, max((impact.get("approach_speed", 0.0) for impact in listed), default=0.0))


def _value(quantities: Quantities, name: str) -> float:
    return float(quantities.get(name, {"value": 0.0})["value"])


def _impacts(quantities: Quantities, name: str) -> Iterator[dict[str, float]]:
    """Yield what is known of each listed impact of a contact: start, end [s], approach speed [m/s], force [N]."""
    for n in count(1):
        keys = {key: f"{name}.impact{n}.{key}" for key in ("start", "end", "approach_speed", "force_peak_raw")}
        if keys["end"] not in quantities:
            return
        yield {key: _value(quantities, full) for key, full in keys.items() if full in quantities}


def _is_cut(scene: SceneFile, name: str, quantities: Quantities, impacts: list[dict[str, float]]) -> bool:
    """Whether an impact lasts until the end of a run.

    A contact of free bodies rests only by gravity, and not before it has given a body the speed with which it closed.
    What forces and joints press on each other may stay closed: there it is an impact while it is `YOUNG`.
    """
    partner = scene.others().get(name)
    sides = [scene.contact[name].body, *([partner.body] if partner is not None else [])]
    free = any(f"{side}.velocity_{axis}" in quantities for side in sides for axis in "xyz")
    final = max(impacts, key=lambda i: i["end"], default={"start": 0.0, "end": 0.0})
    if final["end"] < scene.run.duration * (1 - ROUNDING):
        return False
    lasts, closing = final["end"] - final["start"], final.get("approach_speed", 0.0)
    if not free or scene.force or (scene.joint and not scene.held()):
        return closing > 0 and lasts < YOUNG * scene.run.duration
    return closing > float(np.linalg.norm(scene.run.gravity)) * lasts


def _delivered(scene: SceneFile, name: str, quantities: Quantities) -> Iterator[str]:
    """Yield a note where bodies rebound with another restitution than that of their points."""
    prescribed, delivered = scene.contact[name].restitution, quantities.get(f"{name}.restitution")
    if prescribed is not None and delivered is not None and abs(delivered["value"] - prescribed) > DELIVERED:
        yield (
            f"contact.{name}.restitution: {prescribed:g} is given for its points, and the bodies rebound with"
            f" {delivered['value']:.3g}: waves in elastic bodies, and other points, go on after each impact of a point"
        )


def _below_steps(name: str, window: float, counts: Mapping[str, Any]) -> list[str]:
    """Return a note where forces are averaged over less than a step."""
    step = float(counts["step"])
    if 0 < window < step * (1 - ROUNDING) and not INTEGRATORS[counts["integrator"]].own_steps:
        return [
            f"contact.{name}: the window of its force, {window:.3g} s, is below the step, {step:.3g} s, over which"
            " forces are known as means; set run.window longer, or run.step shorter"
        ]
    return []


def _short(scene: SceneFile, name: str, window: float, quantities: Quantities) -> list[str]:
    """Return a note where `force_peak` is a mean over less than the shortest kept period, or an impact."""
    if f"{name}.force_resolved" not in quantities:
        peaked = [i for i in _impacts(quantities, name) if "force_peak_raw" in i]
        hardest = max(peaked, key=lambda i: i["force_peak_raw"], default={"start": 0.0, "end": 0.0})
        lasts = hardest["end"] - hardest["start"]
        if scene.run.window is not None or not 0 < lasts < WEIGHT * window:
            return []
        return [
            f"contact.{name}: its hardest impact lasts {lasts:.3g} s, and force_peak is the mean over"
            f" {window:.3g} s, taken twice, less than the largest force: modes without residual flexibility have"
            f" no force over less than their periods. Set contact.{name}.method = 'residual', or keep more modes"
        ]
    peak, resolved = (_value(quantities, f"{name}.{key}") for key in ("force_peak", "force_resolved"))
    return [
        f"contact.{name}: force_peak, {peak:.4g} N, is the mean over {window:.3g} s, taken twice, as its hardest impact"
        f" lasts about {window / SHARE:.2g} s; this is below the shortest period of the modes, which resolve"
        f" {resolved:.4g} N, over {_value(quantities, f'{name}.resolved_window'):.3g} s. More modes resolve the impact;"
        " run.window sets the window"
    ]


def _fast(scene: SceneFile, name: str, closing: float) -> list[str]:
    """Return a note where an impact is so fast that strains of its elastic bodies are not small."""
    partner = scene.others().get(name)
    sides = [scene.contact[name].body, *([partner.body] if partner is not None else [])]
    materials = {softest: scene.component[softest].material for softest in map(scene.component_of, sides)}
    speeds = {softest: material.wave_speed for softest, material in materials.items() if material is not None}
    softest = min(speeds, key=lambda c: speeds[c], default=None)
    if softest is None or closing < FAST * speeds[softest]:
        return []
    return [
        f"contact.{name}: an impact at {closing:.3g} m/s is {closing / speeds[softest]:.2g} times the wave speed of"
        f" component.{softest}, {speeds[softest]:.3g} m/s: strains of this size are outside the linear model"
    ]
