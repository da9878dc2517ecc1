"""Notes on the estimated errors of a given step, modal basis and mesh in a run, each with the key that reduces it."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from gudgeon.modaldb.records.trajectory import NO_MODE, ONE_COORDINATE
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.solver.methods import METHODS

ASYMPTOTIC = 0.1
"""Estimated relative error of a step above which runs of two steps do not tell how far both are off."""
WORDS = {"impulse": "impulse", "force": "windowed force", "rebound": "rebound velocity"}
WIDER = 2.5
"""Factor of a window that is too short: from one period to the default of forces that jump."""
RESOLVING = ("bar", "beam", "frame")
"""Geometries that a contact law and residual flexibility can be combined on: they have no local compliance."""
COUNTED = {
    "macneal": "normal_count", "normal+static": "normal_count", "fixed-reference": "normal_count",
    "rubin": "normal_count", "rubin-macneal": "normal_count", "ritz": "normal_count", "craig-bampton": "fixed_count",
    "row-craig-bampton": "fixed_count", "interface": "fixed_count",
    "partial-interface": "fixed_count",
}  # fmt: skip
"""Key of `modes` that adds elastic coordinates, by reduction."""
STATIC = ("attachment",)
"""Reductions whose shapes are static: no key adds a mode."""
FIRST = 30
"""Number of modes where there is none."""


def estimate_notes(
    scene: SceneFile,
    estimates: Mapping[str, float],
    reason: str = "",
    window: float = 0.0,
    *,
    patches: Mapping[str, int] = MappingProxyType({}),
    coarse: Sequence[str] = (),
) -> list[str]:
    """Return a note where the estimated error of step, basis or mesh is above run.tolerance, with keys that reduce it.

    Args:
        estimates: Estimated relative errors of a run, see `Trajectory.estimates`.
        reason: Why the run that estimates those of the basis failed, or `ONE_COORDINATE`, `NO_MODE`.
        window: Of the windowed forces [s].
        patches: Contacts with few points, whose error of the force is that of `patch_notes`.
        coarse: Components whose meshes have most of the mesh's error; default: all that touch.
    """
    others = {name: error for name, error in estimates.items() if not (patches and name == "mesh.force")}
    return (
        _step_notes(scene, estimates)
        + basis_notes(scene, estimates, reason, window)
        + mesh_notes(scene, others, coarse)
    )


def _noticed(estimates: Mapping[str, float], source: str, tolerance: float) -> dict[str, float]:
    """Return the estimated errors of a source that are above `tolerance`, by their name in words."""
    return {
        word: error for name, word in WORDS.items() if (error := estimates.get(f"{source}.{name}", 0.0)) > tolerance
    }


def _step_notes(scene: SceneFile, estimates: Mapping[str, float]) -> list[str]:
    """Return a note where the estimated error of a given step is above run.tolerance."""
    if scene.run.step is None or not (errors := _noticed(estimates, "step", scene.run.tolerance)):
        return []
    told = ", ".join(f"{error:.1%} in {word}" for word, error in errors.items())
    if max(errors.values()) > ASYMPTOTIC:
        told += ", too large for the estimate, which holds where errors fall with the step: the true one may be several"
        told += " times as large"
    return [f"run.step: {scene.run.step:g} s given; its estimated error is {told}; leave it out, so that run.accuracy"
            " sets it, or give a shorter one"]  # fmt: skip


def mesh_notes(scene: SceneFile, estimates: Mapping[str, float], coarse: Sequence[str] = ()) -> list[str]:
    """Return a note where the estimated error of the mesh is above run.tolerance, with half the size of elements.

    Args:
        estimates: As in `estimate_notes`.
        coarse: As there.
    """
    if not (errors := _noticed(estimates, "mesh", scene.run.tolerance)):
        return []
    ways = []
    for name in coarse or dict.fromkeys(part for contact in scene.contact for part in _touching(scene, contact)):
        component = scene.component[name]
        if component.from_file:
            ways.append(f"refine the mesh of component.{name}.geometry.path")
        elif component.mesh.size is not None:
            ways.append(f"set component.{name}.mesh.size = {component.mesh.size / 2:.3g}")
    told = ", ".join(f"{error:.1%} in {word}" for word, error in errors.items())
    said = f"the estimated error of the mesh is {told}, by the frequencies of its modes"
    return [f"{said}; {', '.join(ways)}" if ways else said]


def patch_notes(scene: SceneFile, estimates: Mapping[str, float], patches: Mapping[str, int]) -> list[str]:
    """Return a note on each contact of a curved or tilted surface that few points carry, with keys that refine it.

    Args:
        estimates: Estimated relative errors of a run, with `mesh.force`.
        patches: Number of points that carry its largest force, by contact.
    """
    notes = []
    for name, count in patches.items():
        ways = [*_finer(scene, name), f"where curved, contact.{name}.law.kind = 'hertz' with method 'penalty'"]
        points = "a single point" if count == 1 else f"{count} points"
        notes.append(
            f"contact.{name}: its largest force acts on {points} of a curved or tilted surface, and runs with other"
            f" modes or frequencies do not show what they lack; by the rim of the patch about"
            f" {estimates['mesh.force']:.0%} of the force; set {' or '.join(ways)}"
        )
    return notes


def _finer(scene: SceneFile, contact: str) -> list[str]:
    """Return half the size of the elements of the surfaces of a contact, by the keys that have it."""
    other, own = scene.others().get(contact), scene.contact[contact]
    ways = []
    for body, interface in [(own.body, own.interface), *([(other.body, other.interface)] if other is not None else [])]:
        name = scene.component_of(body)
        component, surface = scene.component[name], scene.component[name].interface[interface].surface
        sizes = getattr(component.geometry, "sizes", None) or {}
        if component.from_file:
            ways.append(f"refine the mesh of component.{name}.geometry.path")
        elif surface in sizes:
            ways.append(f"component.{name}.geometry.sizes.{surface} = {sizes[surface] / 2:.3g}")
        elif component.mesh.size is not None:
            ways.append(f"component.{name}.mesh.size = {component.mesh.size / 2:.3g}")
    return list(dict.fromkeys(ways))


def basis_notes(scene: SceneFile, estimates: Mapping[str, float], reason: str = "", window: float = 0.0) -> list[str]:
    """Return a note where the estimated error of the basis is above run.tolerance, see `estimate_notes`."""
    if not (errors := _noticed(estimates, "basis", scene.run.tolerance)):
        return []
    if reason:
        why = reason
        if reason not in (ONE_COORDINATE, NO_MODE):
            why = f"the run with half of the elastic coordinates failed ({reason})"
        said = f"the error of the modal basis is unknown: {why}"
        return [f"{said}; set {', '.join(_counts(scene))}" if _counts(scene) else said]
    only_force = set(errors) == {"windowed force"}
    ways = _methods(scene) or (_for_force(scene, window) if only_force else _counts(scene) or _dashpots(scene))
    told = ", ".join(f"{error:.1%} in {word}" for word, error in errors.items())
    return [f"the estimated error of the modal basis is {told}; set {', '.join(ways)}" if ways else
            f"the estimated error of the modal basis is {told}"]  # fmt: skip


def _touching(scene: SceneFile, contact: str) -> list[str]:
    """Return the elastic components of a contact."""
    others = scene.others()
    bodies = [scene.contact[contact].body, *([others[contact].body] if contact in others else [])]
    names = dict.fromkeys(scene.component_of(body) for body in bodies)
    return [name for name in names if scene.component[name].modes.reduction != "rigid"]


def _methods(scene: SceneFile) -> list[str]:
    """Return method 'residual' for each penalty contact whose records store R, and where it does not count twice.

    Bodies that turn have it without a law.
    """
    ways, turns = [], scene.capabilities.turns
    for name, contact in scene.contact.items():
        method, parts = METHODS[contact.method], [scene.component[one] for one in _touching(scene, name)]
        stored = parts and all(part.modes.reduction != "normal+static" for part in parts)
        once = contact.law is None or (not turns and all(part.geometry.kind in RESOLVING for part in parts))
        if stored and once and not (method.flexible or method.rigid):
            ways.append(f"contact.{name}.method = 'residual'")
    return ways


def _dashpots(scene: SceneFile) -> list[str]:
    """Return the wave-guide dashpot for each contact of bars: the force of a wave front rings without it."""
    return [
        f"contact.{name}.dashpot = 'wave-guide'" + ("" if contact.method == "residual" else " with method 'residual'")
        for name, contact in scene.contact.items()
        if contact.dashpot == "none"
        and contact.law is None
        and (parts := _touching(scene, name))
        and all(scene.component[part].geometry.kind == "bar" for part in parts)
    ]


def _for_force(scene: SceneFile, window: float) -> list[str]:
    """Return ways to reduce the error of a force whose impulse is accurate: over one period of a mode it may ring.

    Args:
        window: [s]
    """
    wider = [f"run.window = {WIDER * window:.3g}"] if 0 < WIDER * window <= scene.run.duration else []
    if ways := _dashpots(scene):
        return ways
    # With a dashpot on each contact, the share that rings is equal at each number of modes.
    if wider and scene.contact and all(contact.dashpot != "none" for contact in scene.contact.values()):
        return wider
    counts = _counts(scene)
    return [*counts[:-1], f"{counts[-1]} or {wider[0]}"] if counts and wider else counts or wider


def _counts(scene: SceneFile) -> list[str]:
    """Return twice the number of modes for each elastic component of a contact."""
    ways = []
    for name in dict.fromkeys(part for contact in scene.contact for part in _touching(scene, contact)):
        modes = scene.component[name].modes
        if (key := COUNTED.get(modes.reduction)) is not None:
            ways.append(f"component.{name}.modes.{key} = {2 * getattr(modes, key) or FIRST}")
        elif modes.reduction in STATIC:
            ways.append(f"component.{name}.modes.reduction = 'macneal' with normal_count = {FIRST}")
    return ways
