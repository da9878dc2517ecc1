"""The design record of a change that keeps the modes, with the estimates of what that neglects."""

from collections.abc import Callable
from dataclasses import replace

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import MorphRecord, SensitivityRecord
from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.design_change import estimate, morph
from gudgeon.pipeline.fem.elements.materials import densities
from gudgeon.pipeline.scenes.component import Component

Kept = Callable[[Callable[[], SensitivityRecord]], SensitivityRecord]
"""Returns the derivatives of a body from where they are kept; if they are not, it finds and keeps them."""


def reused_design(
    store: Store, base: MeshRecord, keys: tuple[str, str], component: Component, movement: morph.Movement, kept: Kept
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

    def found() -> SensitivityRecord:
        full_record = store.get(keys[1], "modes", only=[*needed, "shapes", "static_responses"])
        return estimate.sensitivity_of(base, material, full_record, keys)

    sensitivity = estimate.kept_sensitivity((store.location, *keys), lambda: kept(found))
    return replace(
        design, quality=design.quality | estimate.estimated(sensitivity, design.nodes - base.nodes).quality()
    )
