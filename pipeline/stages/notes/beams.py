"""Notes on beams and frames that are too short for their theory, and on their modes."""

from collections.abc import Iterator

import numpy as np

from gudgeon.pipeline.geometry.section import shear_coefficient_of
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.frame import Frame
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.stages.notes.facts import Facts

SHORT = 2.0
"""Half-wave of a bending mode over the height of the section below which a note is given."""
SLENDER = 10.0
"""Length over the height of the section below which a note is given on a beam without shear."""
STOCKY = 2.0
"""The same of any beam."""
KAPPA = 5 / 6
"""Shear coefficient where the section states none: of a rectangle."""


def short(facts: Facts) -> Iterator[str]:
    """Yield the notes on beams that are too short, and on modes without shear whose half-waves are.

    Modes of a theory that the scene names are meant. The half-wave of a frequency ω is π/k, k⁴ = ρ A ω² / (E I), but
    for modes at the ends of the beam. Timoshenko's frequency is lower by the factor (1 + k² r² (1 + E/(κ G)))^½ to
    first order, r² = I/A.
    """
    for name, record in facts.modes.items():
        geometry, material = facts.scene.component[name].geometry, facts.scene.component[name].material
        if not isinstance(geometry, Beam | Frame) or material is None:
            continue
        yield from _stocky(name, geometry, material)
        if geometry.sheared or "theory" in geometry.model_fields_set:
            continue
        section, omega = geometry.section, record.angular_frequencies[: record.normal_count]
        k = (material.rho * section.area / (material.E * section.second_moment) * omega**2) ** 0.25
        count = int((k * SHORT * section.height > np.pi).sum())
        if not count:
            continue
        slender = section.second_moment / section.area * (1 + 2 * (1 + material.nu) / KAPPA)
        high = float(np.sqrt(1 + k.max() ** 2 * slender))
        remedies = [f"set component.{name}.geometry.section.shear_coefficient"]
        if record.normal_count > count:
            remedies.append(f"component.{name}.modes.normal_count = {record.normal_count - count}")
        yield (
            f"component.{name}.geometry.section: {count} of {record.normal_count} modes have half-waves below"
            f" {SHORT:g} times the height of the section, the shortest {np.pi / k.max() / section.height:.2g} times it;"
            f" without shear_coefficient they have no shear, and their frequencies are too high, up to about {high:.2g}"
            f" times; {' or '.join(remedies)}"
        )


def _stocky(name: str, geometry: Beam | Frame, material: Material) -> Iterator[str]:
    """Yield a note where a beam is shorter than its theory takes."""
    section, length = geometry.section, _shortest(geometry)
    slenderness = length / section.height
    if slenderness >= (STOCKY if geometry.sheared else SLENDER):
        return
    key = f"component.{name}.geometry"
    stated = f"{key}: its length, {length:.3g} m, is {slenderness:.2g} times the height of its section"
    if geometry.sheared:
        yield f"{stated}; a beam is longer than twice that: make it a solid, with geometry.kind 'box' or 'cylinder'"
        return
    kappa = shear_coefficient_of(section)
    shear = 6 * (1 + material.nu) * section.second_moment / ((kappa or KAPPA) * section.area * length**2)
    remedy = "theory = 'timoshenko'" if kappa is not None else "section.shear_coefficient"
    yield (
        f"{stated}; without shear the deflection of a cantilever of that length is {shear / (1 + shear):.1%} too small:"
        f" set {key}.{remedy}"
    )


def _shortest(geometry: Beam | Frame) -> float:
    """Return the length of a beam, or of the shortest member of a frame [m]."""
    if isinstance(geometry, Beam):
        return geometry.length
    ends = [np.subtract(geometry.nodes[m.end], geometry.nodes[m.start]) for m in geometry.members.values()]
    return float(min(np.linalg.norm(along) for along in ends))
