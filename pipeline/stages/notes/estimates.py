"""Notes on the estimated errors of a given step, modal basis and mesh in a run, each with the key that reduces it."""

from collections.abc import Iterator, Mapping

from gudgeon.modaldb.records.trajectory import (
    BASIS_REASON,
    CHANGING,
    COARSE_MESHES,
    NO_MODE,
    ONE_COORDINATE,
    PATCH_POINTS,
)
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.pipeline.stages.notes.facts import Facts
from gudgeon.solver.methods import METHODS

ASYMPTOTIC = 0.1
"""Estimated relative error of a step above which runs of two steps do not tell how far both are off."""
WORDS = {"impulse": "impulse", "force": "windowed force", "rebound": "rebound velocity",
         "restitution": "restitution"}  # fmt: skip
READINGS = 3
"""Largest number of readings whose errors a note lists."""
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


def _noticed(estimates: Mapping[str, float], source: str, tolerance: float) -> dict[str, float]:
    """Return the estimated errors of a source that are above `tolerance`, by their name in words: those of contacts,
    and the largest of what probes, gauges and joints read."""
    errors = {
        word: error for name, word in WORDS.items() if (error := estimates.get(f"{source}.{name}", 0.0)) > tolerance
    }
    entries = {name.removeprefix(f"{source}."): e for name, e in estimates.items() if name.startswith(f"{source}.")}
    entries = {name: e for name, e in entries.items() if "." in name and e > tolerance}
    largest = sorted(entries, key=lambda name: -entries[name])[:READINGS]
    return errors | {name: entries[name] for name in largest}


def step(facts: Facts) -> Iterator[str]:
    """Yield a note where the estimated error of a given step is above run.tolerance."""
    run = facts.scene.run
    if run.step is None or not (errors := _noticed(facts.summary["estimates"], "step", run.tolerance)):
        return
    text = _listed(errors)
    if max(errors.values()) > ASYMPTOTIC:
        text += ", too large for the estimate, which holds where errors fall with the step: the true one may be several"
        text += " times as large"
    yield (f"run.step: {run.step:g} s given; its estimated error is {text}; leave it out, so that run.accuracy sets it,"
           " or give a shorter one")  # fmt: skip


def mesh(facts: Facts) -> Iterator[str]:
    """Yield a note where the estimated error of the mesh is above run.tolerance, with half the size of elements.

    The components are those that have most of the error, or else all that touch. With contacts of few points the error
    of the force is that of `patches`.
    """
    scene, counts = facts.scene, facts.summary["counts"]
    estimates = dict(facts.summary["estimates"])
    if counts.get(PATCH_POINTS):
        estimates.pop("mesh.force", None)
    if not (errors := _noticed(estimates, "mesh", scene.run.tolerance)):
        return
    remedies = []
    for name in counts.get(COARSE_MESHES, ()) or _deforming(scene):
        component = scene.component[name]
        if component.from_file:
            remedies.append(f"refine the mesh of component.{name}.geometry.path")
        elif component.mesh.size is not None:
            remedies.append(f"set component.{name}.mesh.size = {component.mesh.size / 2:.3g}")
        elif component.geometry.kind == "cad":
            remedies.append(f"set component.{name}.mesh.nodes = {4 * component.mesh.nodes}")
    text = (
        f"the estimated error of the mesh is {_listed(errors)}, by volume, modes' frequencies and loads' compliance of"
        " its bodies"
    )
    yield f"{text}; {', '.join(remedies)}" if remedies else text


def grid(facts: Facts) -> Iterator[str]:
    """Yield a note where the estimated error of a field's grid of poses is above run.tolerance."""
    if errors := _noticed(facts.summary["estimates"], "grid", facts.scene.run.tolerance):
        fields = [
            f"force.{name}.field" if getattr(force, "field", None) else f"force.{name}.record"
            for name, force in facts.scene.force.items()
            if force.kind == "electrostatic"
        ]
        yield (
            f"the estimated error of the grid of poses is {_listed(errors)}; increase poses.*.points of"
            f" {' and '.join(fields)}"
        )


def patches(facts: Facts) -> Iterator[str]:
    """Yield a note on each contact of a curved or tilted surface that few points carry, with keys that refine it."""
    for name, count in facts.summary["counts"].get(PATCH_POINTS, {}).items():
        remedies = [
            *_finer(facts.scene, name),
            f"where curved, contact.{name}.law.kind = 'hertz' with method 'penalty'",
        ]
        points = "a single point" if count == 1 else f"{count} points"
        yield (
            f"contact.{name}: its largest force acts on {points} of a curved or tilted surface, and runs with other"
            f" modes or frequencies do not show the error of that; by the rim of the patch it is about"
            f" {facts.summary['estimates']['mesh.force']:.0%} of the force; set {' or '.join(remedies)}"
        )


def _finer(scene: SceneFile, contact: str) -> list[str]:
    """Return half the size of the elements of the surfaces of a contact, by the keys that have it."""
    partner, settings = scene.others().get(contact), scene.contact[contact]
    ways = []
    for body, interface in [
        (settings.body, settings.interface),
        *([(partner.body, partner.interface)] if partner is not None else []),
    ]:
        name = scene.component_of(body)
        component, surface = scene.component[name], scene.component[name].interface[interface].surface
        sizes = getattr(component.geometry, "sizes", None) or {}
        if component.from_file:
            ways.append(f"refine the mesh of component.{name}.geometry.path")
        elif surface in sizes:
            ways.append(f"component.{name}.geometry.sizes.{surface} = {sizes[surface] / 2:.3g}")
        elif component.mesh.size is not None:
            ways.append(f"component.{name}.mesh.size = {component.mesh.size / 2:.3g}")
        elif component.geometry.kind == "cad":
            ways.append(f"component.{name}.mesh.nodes = {4 * component.mesh.nodes}")
    return list(dict.fromkeys(ways))


def basis(facts: Facts) -> Iterator[str]:
    """Yield a note where the estimated error of the modal basis is above run.tolerance, or unknown."""
    scene, quantities = facts.scene, facts.summary["quantities"]
    if not (errors := _noticed(facts.summary["estimates"], "basis", scene.run.tolerance)):
        return
    if reason := facts.summary["counts"].get(BASIS_REASON, ""):
        if reason not in (ONE_COORDINATE, NO_MODE, CHANGING):
            reason = f"the run with half of the elastic coordinates failed ({reason})"
        text, remedies = f"the error of the modal basis is unknown: {reason}", _counts(scene)
    else:
        windows = [entry["value"] for name, entry in quantities.items() if name.endswith(".force_window")]
        only_force, window = set(errors) == {"windowed force"}, max(windows, default=0.0)
        remedies = _methods(scene) or (_for_force(scene, window) if only_force else _counts(scene) or _dashpots(scene))
        text = f"the estimated error of the modal basis is {_listed(errors)}"
    yield f"{text}; set {', '.join(remedies)}" if remedies else text


def _listed(errors: Mapping[str, float]) -> str:
    return ", ".join(f"{error:.1%} in {word}" for word, error in errors.items())


def _touching(scene: SceneFile, contact: str) -> list[str]:
    """Return the elastic components of a contact."""
    others = scene.others()
    bodies = [scene.contact[contact].body, *([others[contact].body] if contact in others else [])]
    names = dict.fromkeys(scene.component_of(body) for body in bodies)
    return [name for name in names if scene.component[name].modes.reduction != "rigid"]


def _deforming(scene: SceneFile) -> list[str]:
    """Return the elastic components of all contacts; those of all bodies where there is no contact."""
    touching = [name for contact in scene.contact for name in _touching(scene, contact)]
    components = touching if scene.contact else [scene.component_of(body) for body in scene.body]
    return [name for name in dict.fromkeys(components) if scene.component[name].modes.reduction != "rigid"]


def _methods(scene: SceneFile) -> list[str]:
    """Return method 'residual' for each penalty contact whose records store R, and where it does not count twice.

    Bodies that turn have it without a law.
    """
    ways, turns = [], scene.capabilities.turns
    for name, contact in scene.contact.items():
        method, components = METHODS[contact.method], [scene.component[c] for c in _touching(scene, name)]
        stored = components and all(c.modes.reduction != "normal+static" for c in components)
        once = contact.law is None or (not turns and all(c.geometry.kind in RESOLVING for c in components))
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
        and (components := _touching(scene, name))
        and all(scene.component[c].geometry.kind == "bar" for c in components)
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
    """Return twice the number of modes for each elastic component of a contact, or else of a body."""
    ways = []
    for name in _deforming(scene):
        modes = scene.component[name].modes
        if (key := COUNTED.get(modes.reduction)) is not None:
            ways.append(f"component.{name}.modes.{key} = {2 * getattr(modes, key) or FIRST}")
        elif modes.reduction in STATIC:
            ways.append(f"component.{name}.modes.reduction = 'macneal' with normal_count = {FIRST}")
    return ways
