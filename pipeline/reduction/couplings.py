"""Constant tensors of a body's floating frame: inertia couplings, and stiffness by the stress of its own loads.

With the modes φ_k and places x from the centre of mass, consistent mass (Zwölfer & Gerstmayr 2020):

  S_k = ∫ ρ x φ_kᵀ,  G_kl = ∫ ρ φ_k φ_lᵀ.

A static stress σ of a load adds ½ qᵀ K q to the energy, K_kl = ∫ σ_ij ∂_i φ_k · ∂_j φ_l (Cook et al., Concepts and
Applications of Finite Element Analysis, 18.3); by virtual work −½ qᵀ K q is the displacement of second order conjugate
to the load, as the shortening of a bent beam. The unit loads are ρ (x_i e_j + x_j e_i), of which those of a rotation
are sums, and the unit forces and moments of interfaces where joints may act, balanced by inertia forces. All other
inertia forces of the rigid motion, and gravity, are balanced by these alone and need no load of their own (Wallrapp &
Schwertassek 1991 count them otherwise).
"""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import InertiaCouplings
from gudgeon.pipeline.fem.elements.frame import Bending, Line, gauss, shear_parameters, turns
from gudgeon.pipeline.fem.elements.incompatible import mode_slopes
from gudgeon.pipeline.fem.elements.materials import material_cells
from gudgeon.pipeline.fem.elements.reference import batches, quadrature
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.material import Material

ORDER = 3
"""Degree to which the integral of stress and two gradients is exact on straight quadratic solids."""
BATCH = 512
"""Elements at a time."""
PAIRS = [(i, j) for i in range(3) for j in range(i, 3)]
"""Of the axes, i ≤ j: a load ρ (x_i e_j + x_j e_i) each."""
LEVI = np.zeros((3, 3, 3))
for _a, _b, _c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    LEVI[_a, _b, _c], LEVI[_a, _c, _b] = 1.0, -1.0


def has_floating_frame(model: FEModel) -> bool:
    """Whether a model can turn about all axes and its motion is known in space."""
    return len(model.rigid_twists) == 6 and cell_of(model.mesh).dofs >= 3


def inertia_couplings(
    model: FEModel,
    tied: FEModel,
    spread: sparse.csr_matrix,
    shapes: np.ndarray,
    component: Component,
    *,
    moments: bool,
    loads: sparse.csr_matrix,
) -> tuple[InertiaCouplings | None, np.ndarray]:
    """Return the constant tensors of a body's floating frame, and the stiffness by unit loads of its interfaces.

    Args:
        tied: The model with its rigid surfaces, whose dofs `spread` takes to those of the model.
        shapes: Of the tied model, (dofs, m).
        moments: Whether S, G and the stiffness are wanted.
        loads: Rows of the interfaces over the dofs, (k, dofs).

    Returns:
        None for a body without floating frame; and K of each load [1/(kg unit)], (k, m + 3, m + 3), or none.
    """
    m, Phi = shapes.shape[1], spread @ shapes
    if not has_floating_frame(model):
        return None, np.empty((0, m, m))
    if cell_of(model.mesh).spatial:
        translation, S, G = _of_frame(model, Phi, component)
    else:
        translation, S, G = _of_nodes(model, Phi)
    rotation, gradient = np.einsum("abc,bck->ak", LEVI, S), np.einsum("abc,bckl->akl", LEVI, G)
    if not moments or not m:
        return InertiaCouplings(translation, rotation, gradient), np.empty((0, m, m))
    centrifugal = centrifugal_loads(model, component)
    K, moved = stress_stiffness(
        model, tied, spread, shapes, component, np.column_stack([centrifugal, loads.T.toarray()])
    )
    compliance = centrifugal.T @ moved[:, : len(PAIRS)]
    centrifugal_stiffness = np.empty((3, 3, m + 3, m + 3))
    for k, (i, j) in enumerate(PAIRS):
        centrifugal_stiffness[i, j] = centrifugal_stiffness[j, i] = K[k]
    static = per_square(per_square(0.5 * (compliance + compliance.T)).transpose(1, 2, 0))
    couplings = InertiaCouplings(
        translation, rotation, gradient, S, G, centrifugal_stiffness, centrifugal_compliance=static
    )
    return couplings, K[len(PAIRS) :]


def bears_stress(model: FEModel, component: Component) -> bool:
    """Whether the stiffness by a stress of the elements of a component is known: of solids, and of beams in space."""
    return cell_of(model.mesh).dofs >= 3 and component.material is not None


def stress_stiffness(
    model: FEModel,
    tied: FEModel,
    spread: sparse.csr_matrix,
    shapes: np.ndarray,
    component: Component,
    forces: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return K by the static stress of nodal forces (dofs, k), (k, m + 3, m + 3), and their displacements, (dofs, k).

    Supports and, on what they leave free, inertia balance the forces. K is over shapes and the unit rotations about x,
    y, z through the centre; other arguments as in `inertia_couplings`.
    """
    flexibility = Flexibility(tied)
    moved = spread @ flexibility.solve(spread.T @ forces)
    flexibility.free()
    motions = np.hstack([spread @ shapes, _unit_rotations(model)])
    return _stress_stiffness(model, motions, component, moved), moved


def weights_along(model: FEModel, pulled: Sequence[tuple[float, ...]]) -> np.ndarray:
    """Return the weights under unit gravity along unit vectors [N s²/m], (dofs, k); none of a free model."""
    along = np.array(pulled, float).reshape(-1, 3) if model.held.any() else np.zeros((0, 3))
    return model.M @ model.of_nodes(np.tile(model.directions @ along.T, (len(model.nodes), 1, 1)))


def centrifugal_loads(model: FEModel, component: Component) -> np.ndarray:
    """Return the nodal forces of ρ (x_i e_j + x_j e_i), x from the centre of mass, of each of `PAIRS`, (dofs, 6)."""
    if cell_of(model.mesh).spatial:
        return np.column_stack([_centrifugal_frame(model, i, j, component) for i, j in PAIRS])
    return np.column_stack([_centrifugal(model, i, j) for i, j in PAIRS])


def centrifugal_fields(model: FEModel) -> np.ndarray:
    """Return the fields x_i e_j + x_j e_i, x from the centre of mass, of each of `PAIRS` over the dofs of beams [m],
    (dofs, 6): at the nodes, with the rotations by which they are linear along the elements there."""
    arm, ends = model.nodes - model.properties.centre, model.mesh.cells[:, :2]
    along = model.nodes[ends[:, 1]] - model.nodes[ends[:, 0]]
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    axes, count = np.zeros_like(arm), np.bincount(ends.ravel(), minlength=len(arm))
    for side in range(2):
        np.add.at(axes, ends[:, side], along)
    axes /= np.maximum(count, 1)[:, None]
    fields = []
    for i, j in PAIRS:
        A = np.zeros((3, 3))
        A[i, j] += 1.0
        A[j, i] += 1.0
        turned = np.cross(axes, axes @ A)
        fields.append(((arm @ A) @ model.directions.T + turned @ model.rotations.T).ravel())
    return np.column_stack(fields)


def per_square(answers: np.ndarray) -> np.ndarray:
    """Return answers to each of `PAIRS`, (…, 6), as those T to the load ρ C x, Σ C_ij T_ij of a symmetric C,
    (…, 3, 3)."""
    T = np.empty((*answers.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(PAIRS):
        T[..., i, j] = T[..., j, i] = 0.5 * answers[..., k]
    return T


def _unit_rotations(model: FEModel) -> np.ndarray:
    """Return the motions of the dofs by unit rotations about x, y, z through the centre, (dofs, 3)."""
    arm = model.nodes - model.properties.centre
    motions = [np.cross(axis, arm) @ model.directions.T + axis @ model.rotations.T for axis in np.eye(3)]
    return np.column_stack([u.ravel() for u in motions])


def _of_nodes(model: FEModel, Phi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ∫ ρ φ (3, m), S (3, 3, m) and G (3, 3, m, m) of a solid."""
    arm = model.nodes - model.properties.centre
    momentum = (model.M @ Phi).reshape(len(arm), 3, -1)
    shapes = Phi.reshape(len(arm), 3, -1)
    G = np.einsum("nik,njl->ijkl", shapes, momentum, optimize=True)
    return momentum.sum(axis=0), np.einsum("ni,njk->ijk", arm, momentum), G


def _of_frame(model: FEModel, Phi: np.ndarray, component: Component) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the same of beams in space; rotary inertia about their axes is part of the antisymmetric part of S."""
    beam, material = component.geometry, component.material
    assert isinstance(beam, Line)
    assert material is not None
    h, axes, local = _local(model, Phi, beam)
    x, weights = gauss(h)
    linear = np.array([1 - x, x])
    along = np.einsum("eam,aq->eqm", local[:, [0, 6]], linear)
    up, west = _bending(h, material, beam)
    z = np.einsum("eam,eaq->eqm", local[:, [2, 4, 8, 10]], up.deflections(x))
    y = np.einsum("eam,eaq->eqm", local[:, [1, 5, 7, 11]], west.deflections(x))
    shapes = np.einsum("eqkm,eki->eqim", np.stack([along, y, z], axis=2), axes)
    ends = model.nodes[model.mesh.cells]
    positions = np.einsum("eai,aq->eqi", ends, linear) - model.properties.centre
    mass = material.rho * beam.section.area * weights
    S = np.einsum("eqi,eqjk,eq->ijk", positions, shapes, mass, optimize=True)
    polar = material.rho * (beam.section.second_moment + beam.lateral_moment)
    spin = polar * np.einsum("eam,e->em", local[:, [3, 9]], h / 2)
    S += 0.5 * np.einsum("aij,ea,ek->ijk", LEVI, axes[:, 0], spin)
    if beam.sheared:
        moments = (beam.section.second_moment, beam.lateral_moment)
        for axis, moment, dofs, shapes_of in zip(
            (1, 2), moments, ([2, 4, 8, 10], [1, 5, 7, 11]), (up, west), strict=True
        ):
            turn = shapes_of.sign * np.einsum("eam,eaq,eq->em", local[:, dofs], shapes_of.rotations(x), weights)
            S += 0.5 * material.rho * moment * np.einsum("aij,ea,ek->ijk", LEVI, axes[:, axis], turn)
    G = np.einsum("eqik,eqjl,eq->ijkl", shapes, shapes, mass, optimize=True)
    return np.einsum("eqik,eq->ik", shapes, mass), S, G


def _bending(h: np.ndarray, material: Material, beam: Line) -> tuple[Bending, Bending]:
    """Return the bending of elements towards z, which turns about minus the lateral axis, and along this, about z."""
    phi = shear_parameters(h, material, beam)
    return Bending(h, -1.0, phi[0]), Bending(h, 1.0, phi[1])


def _local(model: FEModel, Phi: np.ndarray, beam: Line) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the lengths of a beam's elements, their axes, and the motion of their dofs along these, (e, 12, m)."""
    axes, ends = beam.element_axes(model.mesh), model.mesh.cells
    h = np.linalg.norm(model.nodes[ends[:, 1]] - model.nodes[ends[:, 0]], axis=1)
    return h, axes, turns(axes) @ Phi.reshape(len(model.nodes), 6, -1)[ends].reshape(len(h), 12, -1)


def _centrifugal(model: FEModel, i: int, j: int) -> np.ndarray:
    """Return the nodal forces of ρ (x_i e_j + x_j e_i), (dofs,)."""
    arm = model.nodes - model.properties.centre
    field = np.zeros((len(arm), 3))
    field[:, j] += arm[:, i]
    field[:, i] += arm[:, j]
    moved = field @ model.directions.T
    return model.M @ moved.ravel()


def _centrifugal_frame(model: FEModel, i: int, j: int, component: Component) -> np.ndarray:
    """Return the same of beams: the load is linear along each element, (dofs,)."""
    beam, material = component.geometry, component.material
    assert isinstance(beam, Line)
    assert material is not None
    axes, ends = beam.element_axes(model.mesh), model.nodes[model.mesh.cells] - model.properties.centre
    h = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    x, weights = gauss(h)
    positions = np.einsum("eai,aq->eqi", ends, np.array([1 - x, x]))
    field = np.zeros_like(positions)
    field[..., j] += positions[..., i]
    field[..., i] += positions[..., j]
    line_load = np.einsum("eki,eqi,eq->ekq", axes, field, material.rho * beam.section.area * weights)
    local = np.zeros((len(h), 12))
    local[:, [0, 6]] = np.einsum("aq,eq->ea", np.array([1 - x, x]), line_load[:, 0])
    up, west = _bending(h, material, beam)
    local[:, [2, 4, 8, 10]] = np.einsum("eaq,eq->ea", up.deflections(x), line_load[:, 2])
    local[:, [1, 5, 7, 11]] = np.einsum("eaq,eq->ea", west.deflections(x), line_load[:, 1])
    forces = np.zeros((len(model.nodes), 6))
    np.add.at(forces, model.mesh.cells, np.einsum("eai,ea->ei", turns(axes), local).reshape(-1, 2, 6))
    return forces.ravel()


def _stress_stiffness(model: FEModel, Phi: np.ndarray, component: Component, moved: np.ndarray) -> np.ndarray:
    """Return K of the stress in each static displacement (dofs, k), (k, m, m)."""
    if cell_of(model.mesh).spatial:
        return _frame_stiffness(model, Phi, component, moved)
    k, m, nodes = moved.shape[1], Phi.shape[1], len(model.nodes)
    u, shapes = moved.reshape(nodes, 3, k), Phi.reshape(nodes, 3, m)
    assert component.material is not None
    total, both = np.zeros((k, m, m)), np.concatenate([u, shapes], axis=2)
    for material, cells in material_cells(model.mesh, component.material):
        for block, batch, _ in batches(model.mesh, cells, BATCH):
            _, grad, dx = quadrature(block, ORDER, batch)
            fields = both[block.cells[batch]]
            slopes = np.einsum("eaiq,eajk->eqijk", grad, fields, optimize=True)
            if "incompatible" in block.formulations:
                slopes += mode_slopes(block.nodes[block.cells[batch]], grad, dx, material, fields)
            slope = slopes[..., :k]
            flat = slope.reshape(-1, 3, 3, k)
            stress = _stress(flat, material) * dx.reshape(-1, 1, 1, 1)
            tilt = slopes[..., k:].reshape(-1, 3, 3, m)
            for load in range(k):
                pulled = np.einsum("pij,pjcm->picm", stress[..., load], tilt)
                total[load] += tilt.reshape(-1, m).T @ pulled.reshape(-1, m)
    return 0.5 * (total + total.transpose(0, 2, 1))


def _stress(slope: np.ndarray, material) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Return stresses [Pa] of gradients ∂_i u_j, (p, 3, 3, k)."""
    if material.orthotropic is not None:
        return np.einsum("ijkl,pkln->pijn", material.orthotropic.tensor, slope, optimize=True)
    lam, mu = material.lame
    stress = mu * (slope + slope.transpose(0, 2, 1, 3))
    trace = lam * np.einsum("piin->pn", slope)
    for i in range(3):
        stress[:, i, i] += trace
    return stress


def _frame_stiffness(model: FEModel, Phi: np.ndarray, component: Component, moved: np.ndarray) -> np.ndarray:
    """Return K of the axial force of a beam in space: ∫ N (y′ y′ + z′ z′)."""
    beam, material = component.geometry, component.material
    assert isinstance(beam, Line)
    assert material is not None
    h, _, loaded = _local(model, moved, beam)
    _, _, local = _local(model, Phi, beam)
    N = material.E * beam.section.area * (loaded[:, 6] - loaded[:, 0]) / h[:, None]
    x, weights = gauss(h)
    up, west = _bending(h, material, beam)
    z = np.einsum("eam,eaq->eqm", local[:, [2, 4, 8, 10]], up.slopes(x))
    y = np.einsum("eam,eaq->eqm", local[:, [1, 5, 7, 11]], west.slopes(x))
    integrals = [np.einsum("eqm,eqn,eq,ek->kmn", w, w, weights, N, optimize=True) for w in (y, z)]
    return integrals[0] + integrals[1]
