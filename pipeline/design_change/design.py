"""The design record of a change that keeps the modes, with the estimates of what that neglects."""

from dataclasses import replace

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import MorphRecord
from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.design_change import estimate, morph
from gudgeon.pipeline.fem.elements.materials import densities
from gudgeon.pipeline.scenes.component import Component


def reused_design(
    store: Store, base: MeshRecord, keys: tuple[str, str], component: Component, movement: morph.Movement
) -> MorphRecord:
    """Return a design with the modes of the base mesh, and the estimates of what that neglects in its quality."""
    material = component.material
    assert material is not None
    needed = ["mass", "centre", "inertia", "rigid_twists", "angular_frequencies"]
    modal = store.get(keys[1], "modes", only=[*needed, *(f"interfaces/{i}/points" for i in component.interface)])
    surfaces = {key: item.surface for key, item in component.interface.items()}
    design = morph.reuse(base, keys, modal, surfaces, movement, densities(base, material))
    if not len(modal.angular_frequencies) or design.nodes is None:
        return design

    def found() -> estimate.Sensitivity:
        whole = store.get(keys[1], "modes", only=[*needed, "shapes", "static_responses"])
        return estimate.sensitivity_of(base, material, whole)

    changes = estimate.kept_sensitivity(keys, found).estimate(design.nodes - base.nodes)
    return replace(design, quality=design.quality | changes.quality())
