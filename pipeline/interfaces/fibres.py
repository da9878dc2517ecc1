"""Fibres of beams: stress, strain and section forces at a node as rows over the dofs.

The strain of the fibre at y, z of the section is ε = u′ − y v″ − z w″ with u along the axis, v along the lateral axis
and w along the height; of a beam that bends in a plane ε = z θ′, −z w″ without shear.
"""

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.beam import element_lengths, shear_force, turn_gradient
from gudgeon.pipeline.fem.elements.frame import Line, hermite, turns
from gudgeon.pipeline.geometry.section import Circle
from gudgeon.pipeline.geometry.shapes.beam import SIDES, Beam
from gudgeon.pipeline.geometry.shapes.frame import Frame
from gudgeon.pipeline.scenes.gauge import Gauge
from gudgeon.pipeline.scenes.material import Material

LATERAL = {"left": 1.0, "right": -1.0}
"""Side of a fibre along the lateral axis."""
AXIAL, WEST, UP = [0, 6], [1, 5, 7, 11], [2, 4, 8, 10]
"""Dofs of an element along its axes: stretch, bending along the lateral axis, bending along the height."""


def gauge_row(mesh: MeshRecord, beam: Line, material: Material, gauge: Gauge, where: str = "gauge") -> np.ndarray:
    """Return stress [Pa], strain, bending moment [N m] or shear force [N] of a beam per unit of each dof, (1, dofs).

    Raises:
        InputError: the section has no such fibre.
    """
    assert gauge.station is not None
    node, E = int(mesh.surfaces[gauge.station].facets[0, 0]), material.E
    if mesh.cell_type == "frame2":
        return _in_space(mesh, beam, material, gauge, where)
    assert isinstance(beam, Beam)
    if gauge.quantity == "shear-force":
        return shear_force(mesh, node, material, beam)[None]
    if gauge.quantity == "bending-moment":
        return -E * beam.section.second_moment * turn_gradient(mesh, node)[None]
    assert gauge.fibre is not None
    if gauge.fibre in LATERAL:
        raise InputError(f"{where}.fibre: '{gauge.fibre}' given, a beam of motion 'plane' does not bend sideways;"
                         " allowed: top, bottom, or motion 'space'")  # fmt: skip
    z = SIDES[gauge.fibre] * beam.section.height / 2
    return (1.0 if gauge.quantity == "strain" else E) * z * turn_gradient(mesh, node)[None]


def _in_space(mesh: MeshRecord, beam: Line, material: Material, gauge: Gauge, where: str) -> np.ndarray:
    """Return the same of a beam in space: the mean of the elements of its member at the node, (1, dofs)."""
    assert gauge.station is not None
    node = int(mesh.surfaces[gauge.station].facets[0, 0])
    own = mesh.volumes[beam.places()[gauge.station]] if isinstance(beam, Frame) else np.arange(len(mesh.cells))
    own = own[(mesh.cells[own] == node).any(axis=1)]
    h, turn, rows = element_lengths(mesh)[own], turns(beam.element_axes(mesh)[own]), np.zeros((len(own), 12))
    at = (mesh.cells[own] == node) @ np.array([0.0, 1.0])
    I = beam.section.second_moment
    for e, length in enumerate(h):
        bends, ends = (hermite(h[e : e + 1], x, -1.0)[1][0] for x in (at[e : e + 1], np.array([0.0, 1.0])))
        if gauge.quantity == "bending-moment":
            rows[e, UP] = material.E * I * bends[:, 0]
        elif gauge.quantity == "shear-force":
            rows[e, UP] = -material.E * I * (ends[:, 1] - ends[:, 0]) / length
        else:
            y, z = _fibre(beam, gauge, where)
            rows[e, AXIAL] = -1 / length, 1 / length
            rows[e, UP] = -z * bends[:, 0]
            rows[e, WEST] = -y * hermite(h[e : e + 1], at[e : e + 1], 1.0)[1][0][:, 0]
            rows[e] *= 1.0 if gauge.quantity == "strain" else material.E
    found = np.zeros((len(mesh.nodes), 6))
    np.add.at(found, mesh.cells[own], np.einsum("eai,ea->ei", turn, rows).reshape(-1, 2, 6) / len(own))
    return found.reshape(1, -1)


def _fibre(beam: Line, gauge: Gauge, where: str) -> tuple[float, float]:
    """Return the place of a fibre along the lateral axis and the height [m]."""
    assert gauge.fibre is not None
    if gauge.fibre in SIDES:
        return 0.0, SIDES[gauge.fibre] * beam.section.height / 2
    width = beam.section.height if isinstance(beam.section, Circle) else getattr(beam.section, "width", None)
    if width is None:
        raise InputError(f"{where}.fibre: '{gauge.fibre}' given, a section of kind '{beam.section.kind}' has no width;"
                         " allowed: top, bottom")  # fmt: skip
    return LATERAL[gauge.fibre] * width / 2, 0.0
