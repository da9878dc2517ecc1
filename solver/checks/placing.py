"""What is said of the places of contacts: points that were moved, faces that lean, facets that overhang."""

import numpy as np

from gudgeon.solver.system.system import System

OVERHANG = 0.02
"""Relative difference of the area of points from what another face covers above which it is said."""
FLAT = 1e-3
"""Difference of the normals of a flat face."""
SLANT = 0.01
"""Angle between a face's normal and the direction to its obstacle from which on it is said [rad]."""


def adjusted_notes(system: System) -> list[str]:
    """Return a sentence for each contact whose points were moved onto what they touch."""
    moved = [(c, int((c.adjusted > 0).sum())) for c in system.contacts]
    return [
        f"contact.{contact.name}.adjust moved {count} of {len(contact.points)} points out of what they touch, by up to"
        f" {contact.adjusted.max():.3g} m"
        for contact, count in moved
        if count
    ]


def overhang_notes(system: System) -> list[str]:
    """Return a sentence for each contact of facets that another body covers in part, with the areas."""
    notes = []
    for contact in system.contacts:
        if contact.other is None:
            continue
        points_area, covered = contact.other.met
        if covered > 0 and abs(points_area / covered - 1) > OVERHANG:
            components = [system.scene.component_of(body) for body in (contact.body, contact.other.body)]
            notes.append(
                f"contact.{contact.name}: facets overhang: {covered:.4g} m^2 of them is covered by the other face, and"
                f" points that stand for {points_area:.4g} m^2 act, so that {abs(points_area - covered):.3g} m^2 acts"
                " that meets nothing, or does not act: layers and pressures have the area covered, the shape of it"
                f" has not; reduce component.{components[0]}.mesh.size, or mesh both faces with edges in one place"
            )
    return notes


def slanting_notes(system: System) -> list[str]:
    """Return a sentence for each contact of a flat face that is off the direction to its obstacle, and whose body has
    modes that lack rows across it. A bar, of one rigid motion, does not move across."""
    notes = []
    for contact in system.contacts if not system.scene.capabilities.turns else ():
        modal = system.bodies[contact.body].modal
        face = modal.interfaces[contact.interface]
        has_rows = (
            face.tangential_rows is not None or not len(modal.angular_frequencies) or len(modal.rigid_twists) == 1
        )
        if has_rows or np.ptp(face.normals, axis=0).max(initial=0.0) > FLAT:
            continue
        cosines = -np.einsum("ci,ci->c", contact.directions, face.normals)
        angle = float(np.arccos(np.clip(cosines, -1.0, 1.0)).max(initial=0.0))
        if angle > SLANT:
            notes.append(
                f"contact.{contact.name}: the face of '{contact.interface}' is {np.degrees(angle):.2g} degrees off the"
                " direction to its obstacle, and modes act along its own normal; set"
                f" contact.{contact.name}.friction.static = 1e-9, with which they have rows across it"
            )
    return notes
