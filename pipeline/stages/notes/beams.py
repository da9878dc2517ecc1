"""Notes on modes of Euler-Bernoulli beams that are too short for this theory."""

from collections.abc import Iterator

import numpy as np

from gudgeon.pipeline.geometry.section import General
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.stages.notes.facts import Facts

SHORT = 2.0
"""Half-wave of a bending mode over the height of the section below which a note is given."""
KAPPA = 5 / 6
"""Shear coefficient where the section states none: of a rectangle."""


def short(facts: Facts) -> Iterator[str]:
    """Yield a note for each Euler-Bernoulli beam whose kept modes have half-waves near the height of its section.

    None where the scene names this theory, which is then meant.

    The half-wave of a frequency ω is π/k, k⁴ = ρ A ω² / (E I), but for modes at the ends of the beam. Timoshenko's
    frequency is lower by the factor (1 + k² r² (1 + E/(κ G)))^½ to first order, r² = I/A.
    """
    for name, record in facts.modes.items():
        geometry, material = facts.scene.component[name].geometry, facts.scene.component[name].material
        if not isinstance(geometry, Beam) or geometry.theory != "euler-bernoulli" or material is None:
            continue
        if "theory" in geometry.model_fields_set:
            continue
        section, omega = geometry.section, record.angular_frequencies[: record.normal_count]
        k = (material.rho * section.area / (material.E * section.second_moment) * omega**2) ** 0.25
        count = int((k * SHORT * section.height > np.pi).sum())
        if not count:
            continue
        kappa = section.shear_coefficient or section.shear_form or KAPPA
        slender = section.second_moment / section.area * (1 + 2 * (1 + material.nu) / kappa)
        high = float(np.sqrt(1 + k.max() ** 2 * slender))
        remedy = _way(name, geometry, record.normal_count - count)
        yield (
            f"component.{name}.geometry.theory: {count} of {record.normal_count} modes have half-waves below"
            f" {SHORT:g} times the height of the section, the shortest {np.pi / k.max() / section.height:.2g} times it;"
            f" without shear their frequencies are too high, up to about {high:.2g} times; {remedy}"
        )


def _way(name: str, beam: Beam, long: int) -> str:
    """Return what a beam can do against short half-waves: beams in space have no shear, and no modes cannot be kept."""
    ways, section = list[str](), beam.section
    if beam.motion == "plane":
        known_shear = not isinstance(section, General) or section.shear_coefficient is not None
        ways.append(f"set 'timoshenko'{'' if known_shear else ' and geometry.section.shear_coefficient'}")
    if long > 0:
        ways.append(f"set component.{name}.modes.normal_count = {long}")
    if beam.motion == "space":
        ways.append("make it a solid, with geometry.kind 'box' or 'cylinder'")
    return ", or ".join(ways)
