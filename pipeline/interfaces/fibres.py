"""Fibres of beams: stress, strain and section forces at a node as rows over the dofs.

The strain of the fibre at y, z of the section is ε = u′ − y v″ − z w″ with u along the axis, v along the lateral axis
and w along the height; of a beam that bends in a plane ε = z θ′, −z w″ without shear.
"""

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.beam import element_lengths, shear_force, turn_gradient
from gudgeon.pipeline.fem.elements.frame import Bending, Line, shear_parameters, turns
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.geometry.section import Circle
from gudgeon.pipeline.geometry.shapes.beam import SIDES, Beam
from gudgeon.pipeline.geometry.shapes.frame import Frame
from gudgeon.pipeline.scenes.gauge import Gauge
from gudgeon.pipeline.scenes.material import Material

LATERAL = {"left": 1.0, "right": -1.0}
"""Side of a fibre along the lateral axis."""
AXIAL, WEST, UP = [0, 6], [1, 5, 7, 11], [2, 4, 8, 10]
"""Dofs of an element along its axes: stretch, bending along the lateral axis, bending along the height."""


def gauge_row(mesh: MeshRecord, beam: Line, material: Material, gauge: Gauge, key: str = "gauge") -> np.ndarray:
    """Return stress [Pa], strain, bending moment [N m] or shear force [N] of a beam per unit of each dof, (1, dofs).

    Raises:
        InputError: the section has no such fibre.
    """
    return _mean(mesh, *_at_station(mesh, beam, material, gauge, key))


def load_row(model: FEModel, beam: Line, material: Material, gauge: Gauge, key: str = "gauge") -> np.ndarray:
    """Return what is to be added to a gauge of a beam whose weight acts, per unit of each dof's field b, (1, dofs).

    With body forces ρ A b in an element, its displacement between the nodes is not that of its shape functions. The
    forces on its ends are K u − M b, exact where those on its nodes are; a gauge z K u of them reads z (K u − M b).

    Raises:
        InputError: the section has no such fibre.
    """
    mesh, elements = model.mesh, model.parts
    assert elements is not None
    assert elements.masses is not None
    cells, rows = _at_station(mesh, beam, material, gauge, key)
    corrections, d = np.zeros_like(rows), len(model.directions)
    for e, cell in enumerate(cells):
        K, M = elements.blocks[cell], elements.masses[cell]
        inner = np.arange(len(K)) >= 2 * d
        station_dofs = np.flatnonzero(np.repeat(mesh.cells[cell] == _node(mesh, gauge), d) | inner)
        scale = 1 / np.sqrt(K.diagonal())
        weights = np.linalg.lstsq((scale[station_dofs, None] * K[station_dofs] * scale).T, scale * rows[e])[0]
        corrections[e] = -(scale[station_dofs] * weights) @ M[station_dofs]
    return _mean(mesh, cells, corrections)


def _mean(mesh: MeshRecord, cells: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the mean of rows over the dofs of elements (c, n) as a row over all dofs, (1, dofs)."""
    nodes = mesh.cells[cells]
    mean = np.zeros((len(mesh.nodes), rows.shape[1] // nodes.shape[1]))
    np.add.at(mean, nodes, rows.reshape(*nodes.shape, -1) / len(cells))
    return mean.reshape(1, -1)


def _node(mesh: MeshRecord, gauge: Gauge) -> int:
    """Return the node at a gauge's station."""
    assert gauge.station is not None
    return int(mesh.surfaces[gauge.station].facets[0, 0])


def _at_station(
    mesh: MeshRecord, beam: Line, material: Material, gauge: Gauge, key: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return the elements at a gauge's station, (c,), and what each has there per unit of its dofs, (c, n)."""
    node, E = _node(mesh, gauge), material.E
    if cell_of(mesh).spatial:
        return _in_space(mesh, beam, material, gauge, key)
    assert isinstance(beam, Beam)
    if gauge.quantity == "shear-force":
        return shear_force(mesh, node, material, beam)
    cells, rows = turn_gradient(mesh, node)
    if gauge.quantity == "bending-moment":
        return cells, -E * beam.section.second_moment * rows
    assert gauge.fibre is not None
    if gauge.fibre in LATERAL:
        raise InputError(f"{key}.fibre: '{gauge.fibre}' given, a beam of motion 'plane' does not bend sideways;"
                         " allowed: top, bottom, or motion 'space'")  # fmt: skip
    z = SIDES[gauge.fibre] * beam.section.height / 2
    return cells, (1.0 if gauge.quantity == "strain" else E) * z * rows


def _in_space(
    mesh: MeshRecord, beam: Line, material: Material, gauge: Gauge, key: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return the same of a beam in space, of the elements of its member at the node."""
    assert gauge.station is not None
    node = _node(mesh, gauge)
    cells = mesh.volumes[beam.places()[gauge.station]] if isinstance(beam, Frame) else np.arange(len(mesh.cells))
    cells = cells[(mesh.cells[cells] == node).any(axis=1)]
    h, turn, rows = element_lengths(mesh)[cells], turns(beam.element_axes(mesh)[cells]), np.zeros((len(cells), 12))
    position = (mesh.cells[cells] == node) @ np.array([0.0, 1.0])
    I = beam.section.second_moment
    phi = shear_parameters(h, material, beam)
    for e, length in enumerate(h):
        up, west = (Bending(h[e : e + 1], sign, f[e : e + 1]) for sign, f in zip((-1.0, 1.0), phi, strict=True))
        bends, ends = up.curvatures(position[e : e + 1])[0], up.curvatures(np.array([0.0, 1.0]))[0]
        if gauge.quantity == "bending-moment":
            rows[e, UP] = material.E * I * bends[:, 0]
        elif gauge.quantity == "shear-force":
            rows[e, UP] = -material.E * I * (ends[:, 1] - ends[:, 0]) / length
        else:
            y, z = _fibre(beam, gauge, key)
            rows[e, AXIAL] = -1 / length, 1 / length
            rows[e, UP] = -z * bends[:, 0]
            rows[e, WEST] = -y * west.curvatures(position[e : e + 1])[0][:, 0]
            rows[e] *= 1.0 if gauge.quantity == "strain" else material.E
    return cells, np.einsum("eai,ea->ei", turn, rows)


def _fibre(beam: Line, gauge: Gauge, key: str) -> tuple[float, float]:
    """Return the place of a fibre along the lateral axis and the height [m]."""
    assert gauge.fibre is not None
    if gauge.fibre in SIDES:
        return 0.0, SIDES[gauge.fibre] * beam.section.height / 2
    width = beam.section.height if isinstance(beam.section, Circle) else getattr(beam.section, "width", None)
    if width is None:
        raise InputError(f"{key}.fibre: '{gauge.fibre}' given, a section of kind '{beam.section.kind}' has no width;"
                         " allowed: top, bottom")  # fmt: skip
    return LATERAL[gauge.fibre] * width / 2, 0.0
