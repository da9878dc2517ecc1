"""Bodies whose stiffness and mass were read: from their records to the model, with the checks of what was read.

Nothing is assembled. Mass, centre, inertia and rigid motions follow from the mass matrix and the places of the nodes.
Degrees of freedom that a node lacks are held, so that only motions in which they rest are rigid motions of the body.
"""

from dataclasses import replace

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.csgraph import connected_components

from gudgeon.modaldb.records.mesh import GENERALISED, MeshRecord, Triangle
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.solid import solid_twists
from gudgeon.pipeline.fem.model import FEModel, MassProperties
from gudgeon.pipeline.linalg import EvenedFactor

IN_KERNEL = 1e-8
"""Largest |K r| of a rigid motion r at a degree of freedom i, over Σ √(K_ii K_jj) |r_j| of those that K couples with i,
which no Σ |K_ij r_j| exceeds: files keep 13 digits."""
SINGULAR = 1e-10
"""Eigenvalues of the mass matrix, scaled to a unit diagonal, that are zero but for round-off. There are such: the mass
of ten-node tetrahedra by four points of quadrature, as of CalculiX, may have a few, of motions without mass."""
FULL = 0.5
"""Share of entries of a matrix from which it counts as full."""
RESTING = 1e-9
"""Share of a motion at the degrees of freedom that are held, below which it leaves them at rest."""
UNFIT = "the order of the rows, the nodes, their directions or geometry.unit do not fit the matrices"
NAMES = ("x", "y", "z", "the rotation about x", "the rotation about y", "the rotation about z")


def given_model(mesh: MeshRecord, key: str) -> FEModel:
    """Return the model of matrices that were read; `key` is the component's key, for messages.

    Raises:
        InputError: the mass is not positive, a rigid motion needs force, a row is that of a multiplier, or the body
            falls into pieces.
    """
    system = mesh.system
    assert system is not None
    generalised = system.directions == GENERALISED
    each = 6 if (system.directions[~generalised] > 2).any() else 3
    nodal = each * len(mesh.nodes)
    size = nodal + int(generalised.sum())
    dofs = each * system.nodes + system.directions
    dofs[generalised] = np.arange(nodal, size)
    matrices = _matrix(system.stiffness, len(dofs)), _matrix(system.mass, len(dofs))
    _refuse_unsound(*matrices, mesh, key)
    K, M = (_spread(A, dofs, size) for A in matrices)
    constrained = np.ones(size, bool)
    constrained[dofs] = False
    motions = _unit_motions(mesh.nodes, each, size)
    properties = _properties(motions.T @ (M @ motions), bool(constrained.any()), key)
    if constrained.any():
        twists = _resting_twists(mesh, M, constrained, each, properties.centre)
    else:
        moments = np.linalg.eigvalsh(properties.inertia)
        if not moments[0] > np.finfo(float).eps * moments[-1]:
            raise InputError(
                f"{key}.geometry: the mass has the moment of inertia {moments[0]:.2g} kg m^2 about an axis; {UNFIT}"
            )
        twists = solid_twists(properties)
    # Dofs that are held have a stiffness, as those that a support holds, so that no row is empty.
    K = sparse.csr_matrix(K + sparse.diags(np.where(constrained, K.diagonal().mean(), 0.0)))
    axes = np.vstack([np.eye(3), np.zeros((3, 3))]) if each == 6 else np.eye(3)
    model = FEModel(
        K=K, M=M, mesh=mesh, directions=axes, rotations=np.roll(axes, 3, axis=0) if each == 6 else np.zeros((3, 3)),
        properties=properties, rigid_twists=twists, held=constrained,
    )  # fmt: skip
    _refuse_strained(model, dofs, key)
    return _without_strain(model)


def _matrix(half: Triangle, size: int) -> sparse.csr_matrix:
    """Return a symmetric matrix from its upper triangle."""
    upper = sparse.csr_matrix((half.values, (half.rows, half.columns)), shape=(size, size))
    return sparse.csr_matrix(upper + upper.T - sparse.diags(upper.diagonal()))


def _spread(A: sparse.csr_matrix, dofs: np.ndarray, size: int) -> sparse.csr_matrix:
    entries = A.tocoo()
    spread = sparse.csr_matrix((entries.data, (dofs[entries.row], dofs[entries.col])), shape=(size, size))
    spread.sort_indices()
    return spread


def _refuse_unsound(K: sparse.csr_matrix, M: sparse.csr_matrix, mesh: MeshRecord, key: str) -> None:
    """Refuse rows of multipliers, mass that is not positive, and several pieces."""
    system = mesh.system
    assert system is not None
    stiff, heavy = K.diagonal(), M.diagonal()
    if (stiff <= 0).any():
        row = int(np.argmax(stiff <= 0))
        cause = "the row of a multiplier of a constraint" if stiff[row] == 0 else "a negative stiffness"
        raise InputError(
            f"{key}.geometry.stiffness: {_dof(mesh, row)} has the diagonal {stiff[row]:g}, {cause}; allowed: matrices"
            " without multipliers, constraints eliminated"
        )
    if (heavy <= 0).any():
        row = int(np.argmax(heavy <= 0))
        raise InputError(
            f"{key}.geometry.mass: {_dof(mesh, row)} has the mass {heavy[row]:g}; allowed: a positive mass,"
            " or inertia, at every degree of freedom"
        )
    scale = sparse.diags(1 / np.sqrt(heavy))
    scaled = scale @ M @ scale + SINGULAR * sparse.eye(len(heavy))
    factor = EvenedFactor(sparse.csr_matrix(scaled))
    negative = factor.negative_pivots()
    factor.free()
    if negative:
        raise InputError(
            f"{key}.geometry.mass: {negative} eigenvalues of the mass are negative; allowed: a mass whose kinetic"
            " energy is positive or, by its quadrature, zero"
        )
    # A mode that moves no boundary node is a piece by itself.
    nodal = np.flatnonzero(system.directions != GENERALISED)
    piece_of = connected_components(abs(K) + abs(M), directed=False)[1][nodal]
    pieces, piece_of = len(np.unique(piece_of)), np.unique(piece_of, return_inverse=True)[1]
    if pieces > 1:
        sizes = np.bincount(piece_of)
        row = int(nodal[np.argmax(piece_of == sizes.argmin())])
        raise InputError(
            f"{key}.geometry.stiffness: falls into {pieces} parts that are not connected; the smallest has"
            f" {sizes.min()} of {len(piece_of)} degrees of freedom, {_dof(mesh, row)} among them; allowed: one body"
        )


def _unit_motions(nodes: np.ndarray, each: int, size: int) -> np.ndarray:
    """Return unit translations and rotations about the origin at every degree of freedom, (size, 6)."""
    every = np.zeros((size, 6))
    motions = every[: each * len(nodes)].reshape(len(nodes), each, 6)
    for axis, unit in enumerate(np.eye(3)):
        motions[:, axis, axis] = 1.0
        motions[:, :3, 3 + axis] = np.cross(unit, nodes)
        if each == 6:
            motions[:, 3 + axis, 3 + axis] = 1.0
    return every


def _properties(inertia: np.ndarray, constrained: bool, key: str) -> MassProperties:
    """Return mass, centre and inertia from the mass matrix of unit motions about the origin, (6, 6).

    Where degrees of freedom are held their mass is not in the matrices; the mass is then that of the freest direction.
    """
    mass = float(inertia.diagonal()[:3].max() if constrained else inertia.diagonal()[:3].mean())
    if not 0 < mass < np.inf:
        raise InputError(f"{key}.geometry.mass: a translation of the body moves {mass:.2g} kg; {UNFIT}")
    lever = inertia[3:, :3]
    centre = np.array([lever[1, 2] - lever[2, 1], lever[2, 0] - lever[0, 2], lever[0, 1] - lever[1, 0]]) / (-2 * mass)
    about = inertia[3:, 3:] - mass * ((centre @ centre) * np.eye(3) - np.outer(centre, centre))
    return MassProperties(mass, centre, 0.5 * (about + about.T))


def _resting_twists(
    mesh: MeshRecord, M: sparse.csr_matrix, constrained: np.ndarray, each: int, centre: np.ndarray
) -> np.ndarray:
    """Return the mass-normalised rigid motions in which the held degrees of freedom rest, (r, 6)."""
    size = float(np.linalg.norm(np.ptp(mesh.nodes, axis=0))) or 1.0
    scale = np.repeat([1.0, 1 / size], 3)
    motions = _unit_motions(mesh.nodes - centre, each, len(constrained)) * scale
    _, strength, axes = np.linalg.svd(motions[constrained], full_matrices=True)
    strength = np.concatenate([strength, np.zeros(6 - len(strength))])
    basis = axes[strength <= RESTING * strength[0]].T
    basis[np.abs(basis) < 16 * np.finfo(float).eps] = 0.0
    free = motions @ basis
    if not free.shape[1]:
        return np.empty((0, 6))
    gram = free.T @ (M @ free)
    return linalg.solve_triangular(np.linalg.cholesky(gram), (basis * scale[:, None]).T, lower=True)


def _refuse_strained(model: FEModel, dofs: np.ndarray, key: str) -> None:
    """Refuse rigid motions that need force; `dofs` are those of the rows that were read."""
    Phi = np.where(model.held[:, None], 0.0, model.rigid_modes)
    root = np.sqrt(model.K.diagonal())[:, None]
    pattern = model.K.astype(bool).astype(float)
    size = root * (pattern @ (root * np.abs(Phi)))
    strained = np.divide(np.abs(model.K @ Phi), size, out=np.zeros(size.shape), where=size > 0)
    if strained.size and (worst := float(strained.max())) > IN_KERNEL:
        dof = int(np.argmax(strained.max(axis=1)))
        row = int(np.argmax(dofs == dof))
        raise InputError(
            f"{key}.geometry: {_dof(model.mesh, row)} takes {worst:.2g} of its stiffness in a rigid motion, allowed:"
            f" {IN_KERNEL:g}; {UNFIT}, or the body is held by springs or by penalties"
        )


def _without_strain(model: FEModel) -> FEModel:
    """Return a model whose full stiffness needs no force in rigid motions Φ: PᵀKP with P = I − Φ (ΦᵀMΦ)⁻¹ ΦᵀM.

    Superelements have full matrices, of ten digits in a punch of DMIG. What `IN_KERNEL` lets through of them would be
    in the residuals of the lowest modes; Φ is orthonormal by the mass as it was read. Sparse matrices would fill: they
    are kept.
    """
    free, Phi = model.free, model.rigid_modes[model.free]
    K, M = model.free_matrices()
    if not Phi.shape[1] or K.nnz < FULL * K.shape[0] ** 2:
        return model
    load = M @ Phi
    gram = Phi.T @ load
    twists = linalg.solve_triangular(np.linalg.cholesky(gram), model.rigid_twists, lower=True)
    P = np.eye(len(free)) - Phi @ np.linalg.solve(gram, load.T)
    stiffness = P.T @ K.toarray() @ P
    fixed = sparse.diags(np.where(model.held, model.K.diagonal(), 0.0))
    spread = sparse.csr_matrix((np.ones(len(free)), (free, np.arange(len(free)))), shape=(len(model.held), len(free)))
    K = sparse.csr_matrix(spread @ sparse.csr_matrix(0.5 * (stiffness + stiffness.T)) @ spread.T + fixed)
    return replace(model, K=K, rigid_twists=twists)


def _dof(mesh: MeshRecord, row: int) -> str:
    """Return the name of a degree of freedom by the number of its node in the files."""
    system = mesh.system
    assert system is not None
    if system.directions[row] == GENERALISED:
        return f"generalised coordinate {row - int(np.argmax(system.directions == GENERALISED)) + 1}"
    return f"node {system.labels[system.nodes[row]]} in {NAMES[system.directions[row]]}"
