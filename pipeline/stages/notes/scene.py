"""Notes on what a scene gives: units, sizes, gravity, laws out of range, and modes kept over a design change."""

from collections.abc import Iterator

import numpy as np

from gudgeon.modaldb.records.modes import DESIGN
from gudgeon.pipeline.stages.change import certified_text, change_estimates, change_text
from gudgeon.pipeline.stages.notes.facts import Facts, Parts
from gudgeon.solver.joints.clearance import Clearance

USUAL_EXTENTS = (1e-6, 100.0)
"""Largest extents of parts [m] outside which a note is given: those of machines given in mm are mostly above."""
METRES = 10.0
"""The same upper limit for a file in metres [m]: a shaft of 70 mm would be one of 70 m."""


def units(facts: Parts) -> Iterator[str]:
    """Yield a line for each material whose wave speed makes a mistaken unit likely."""
    for name, component in facts.components.items():
        if component.material is not None and (text := component.material.unit_note()) is not None:
            yield f"component.{name}.material: {text}"


def left_out(facts: Parts) -> Iterator[str]:
    """Yield a line for what of a part's file its mesh does not have, or has otherwise."""
    for name, component in facts.components.items():
        if component.from_file:
            remarks = facts.store.get(facts.meshes[name], "mesh", only=["remarks"]).remarks
            yield from (f"component.{name}.geometry: {note}" for note in remarks.get("notes", []))


def extents(facts: Parts) -> Iterator[str]:
    """Yield a line for each elastic part whose size makes a mistaken unit of length likely."""
    for name, component in facts.components.items():
        if component.material is None:
            continue
        size = float(np.ptp(facts.store.get(facts.meshes[name], "mesh", only=["nodes"]).nodes, axis=0).max())
        metres = getattr(component.geometry, "unit", None) == 1.0
        low, high = USUAL_EXTENTS[0], METRES if metres else USUAL_EXTENTS[1]
        if not low <= size <= high:
            likely = "check the unit of its lengths"
            if size > high:
                likely = "probably lengths in mm were given"
            if component.from_file:
                likely += f"; component.{name}.geometry.unit states the metres per unit of the file, 1e-3 for mm"
            yield (
                f"component.{name}.geometry: its largest extent is {size:.3g} m, usual are {low:g} to {high:g} m;"
                f" {likely}"
            )


def gravity(facts: Facts) -> Iterator[str]:
    """Yield a line if gravity is that of the earth in mm/s^2."""
    size = float(np.linalg.norm(facts.scene.run.gravity))
    if 0.99 < size / 9806.65 < 1.01:
        yield f"run.gravity: {size:g} m/s^2 given, a thousand times that of the earth; probably mm/s^2 were given"


def laws(facts: Facts) -> Iterator[str]:
    """Yield a line for each contact law that is used outside its range of validity."""
    by_member = {f"contact.{name}": contact.law for name, contact in facts.scene.contact.items()}
    by_member |= {f"joint.{name}": j.law for name, j in facts.scene.joint.items() if isinstance(j, Clearance)}
    for member, law in by_member.items():
        if law is not None and (text := law.warning()) is not None:
            yield f"{member}.law: {text}"


def certified_modes(facts: Facts) -> Iterator[str]:
    """Yield a line for each component with modes from stored designs: the way that was taken and its errors."""
    for name, record in facts.modes.items():
        if (design := record.quality.get(DESIGN)) is not None:
            allowed = facts.job.scene.component[name].change.tolerance
            yield f"component.{name}.change: {certified_text(design)}; tolerance: {allowed:.2%}"


def reused_modes(facts: Facts) -> Iterator[str]:
    """Yield a line for each component that reuses modes after a design change, with the estimate of what it changes."""
    for name, entry in change_estimates(facts.job).items():
        text, allowed = change_text(entry), entry["tolerance"]
        yield f"component.{name}.change: modes are reused; estimated change of {text}; tolerance: {allowed:.2%}"
