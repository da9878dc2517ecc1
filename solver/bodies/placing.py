"""Records of a body that the scene turns about its component's origin: everything in them that has a direction.

A vector x of the component is Q x in the scene. The three rows of a mean of a surface, along the component's axes,
become rows along the scene's axes, Q B, and so do theirs of R. Scalars stay: normal displacements of contact points and
traction spaces, pressures, frequencies, and gauges, which are in the body's own axes.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import InertiaCouplings, LoadModes, ModalRecord, MorphRecord
from gudgeon.modaldb.records.traction import turned_chart
from gudgeon.solver.scene.body import Body

VECTORS = {"N": 1, "N, N m": 2}
"""Vectors whose components the rows of a load are, by its unit: the force of a mean, force and moment of a tie."""
Turned = tuple[slice, np.ndarray]
"""Rows of a load, and the matrix that turns them."""


def rotation(settings: Body) -> np.ndarray | None:
    """Return Q of a body, (3, 3); None where the scene gives no orientation."""
    return None if settings.orientation is None else settings.orientation.matrix()


def turned_vectors(settings: Body, vectors: np.ndarray | tuple[float, ...]) -> np.ndarray:
    """Return vectors of a component in the axes of the scene, (..., 3), of those in its own axes, (..., 3)."""
    Q, v = rotation(settings), np.asarray(vectors, float)
    return v if Q is None else v @ Q.T


def own_vectors(settings: Body, vectors: np.ndarray) -> np.ndarray:
    """Return vectors of a body in the axes of its component, (..., 3), of those in the axes of the scene, (..., 3)."""
    Q = rotation(settings)
    return vectors if Q is None else vectors @ Q


def turned_design(design: MorphRecord, Q: np.ndarray | None) -> MorphRecord:
    """Return a design with its points, inertia and rigid motions turned; itself where Q is None."""
    if Q is None:
        return design
    return replace(
        design,
        points={name: _vectors(points, Q) for name, points in design.points.items()},
        centre=_vectors(design.centre, Q),
        inertia=_tensor(design.inertia, Q),
        rigid_twists=_pairs(design.rigid_twists, Q),
        nodes=_vectors(design.nodes, Q),
    )


def turned_modes(modal: ModalRecord, Q: np.ndarray | None) -> ModalRecord:
    """Return modes with everything turned that has a direction; themselves where Q is None.

    Fields that were not read, empty or None, stay so.
    """
    if Q is None:
        return modal
    loads = [
        (slice(*modal.interface_rows[name]), np.kron(np.eye(VECTORS[load.unit]), Q))
        for name, load in modal.loads.items()
        if load.unit in VECTORS
    ]
    R = modal.residual_flexibility
    if R is not None and loads:
        R = R.copy()
        for rows, turn in loads:
            R[rows] = turn @ R[rows]
        R = _turned_columns(R, loads)
    return replace(
        modal,
        centre=_vectors(modal.centre, Q),
        inertia=_tensor(modal.inertia, Q),
        rigid_twists=_pairs(modal.rigid_twists, Q),
        interfaces={
            name: replace(
                item,
                points=_vectors(item.points, Q),
                normals=_vectors(item.normals, Q),
                tangents=_vectors(item.tangents, Q),
                outline=_vectors(item.outline, Q),
            )
            for name, item in modal.interfaces.items()
        },
        tractions={
            name: replace(space, chart=turned_chart(space.chart, Q), resultant=_pairs(space.resultant, Q))
            for name, space in modal.tractions.items()
        },
        loads={name: _turned_load(load, Q) for name, load in modal.loads.items()},
        gauges={
            name: replace(
                gauge,
                residual=_turned_columns(gauge.residual, loads),
                weights=_vectors(gauge.weights, Q),
                centrifugal=None if gauge.centrifugal is None else np.einsum("ia,jb,kab->kij", Q, Q, gauge.centrifugal),
            )
            for name, gauge in modal.gauges.items()
        },
        residual_flexibility=R,
        participation=_columns(modal.participation, Q),
        weight_stiffness=_turned_weight(modal.weight_stiffness, Q),
        shapes=None if modal.shapes is None else _columns_last(modal.shapes, Q),
        inertia_couplings=_turned_couplings(modal.inertia_couplings, Q),
        static_responses=None
        if modal.static_responses is None
        else replace(
            modal.static_responses,
            shapes=_columns_last(modal.static_responses.shapes, Q),
            resultant=_pairs(modal.static_responses.resultant, Q),
        ),
    )


def turned_mesh(mesh: MeshRecord, Q: np.ndarray | None) -> MeshRecord:
    """Return a mesh with its nodes and the true shapes of its surfaces turned; itself where Q is None."""
    if Q is None:
        return mesh
    surfaces = {
        name: replace(surface, shape=turned_chart(surface.shape, Q), normals=_vectors(surface.normals, Q))
        for name, surface in mesh.surfaces.items()
    }
    return replace(mesh, nodes=_vectors(mesh.nodes, Q), surfaces=surfaces)


def turned_tensors(values: np.ndarray, Q: np.ndarray | None) -> np.ndarray:
    """Return symmetric tensors xx, yy, zz, xy, yz, zx in the axes of the scene, (n, 6), of those of the body."""
    if Q is None:
        return values
    positions = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
    tensors = np.einsum("ia,nab,jb->nij", Q, values[:, positions], Q)
    return tensors[:, [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]


def _turned_columns(values: np.ndarray, loads: list[Turned]) -> np.ndarray:
    """Return values per unit force, (k, C), with the forces of means and ties along the scene's axes."""
    if not values.size or not loads:
        return values
    turned = values.copy()
    for rows, turn in loads:
        turned[:, rows] = turned[:, rows] @ turn.T
    return turned


def _turned_load(load: LoadModes, Q: np.ndarray) -> LoadModes:
    rows, resultant, stiffness = load.rows, _pairs(load.resultant, Q), load.stress_stiffness
    if load.unit in VECTORS:
        turn = np.kron(np.eye(VECTORS[load.unit]), Q)
        rows, resultant = turn @ rows, turn @ resultant
        stiffness = None if stiffness is None else np.einsum("ij,jab->iab", turn, _turned_rotations(stiffness, Q))
    return replace(load, rows=rows, resultant=resultant, stress_stiffness=stiffness, point=_vectors(load.point, Q))


def _turned_couplings(couplings: InertiaCouplings | None, Q: np.ndarray) -> InertiaCouplings | None:
    if couplings is None:
        return None
    gradient = np.einsum("ij,jab->iab", Q, couplings.rotation_gradient)
    moments = [couplings.position_moments, couplings.shape_moments, couplings.centrifugal_stiffness]
    turned = [None if m is None else np.einsum("ia,jb,ab...->ij...", Q, Q, m) for m in moments]
    D = couplings.centrifugal_compliance
    if D is not None:
        D = np.einsum("ia,jb,kc,ld,abcd->ijkl", Q, Q, Q, Q, D, optimize=True)
    translation, rotation = _columns(couplings.translation, Q), _columns(couplings.rotation, Q)
    S, G, K = turned
    K = None if K is None else _turned_rotations(K, Q)
    return InertiaCouplings(translation, rotation, gradient, S, G, K, centrifugal_compliance=D)


def _turned_weight(stiffness: np.ndarray | None, Q: np.ndarray) -> np.ndarray | None:
    return None if stiffness is None else np.einsum("ij,jab->iab", Q, _turned_rotations(stiffness, Q))


def _turned_rotations(stiffness: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """Return stiffnesses over shapes and, the last three, rotations about x, y, z, (…, m + 3, m + 3), turned."""
    change = np.eye(stiffness.shape[-1])
    change[-3:, -3:] = Q
    return change @ stiffness @ change.T


def _vectors(values: Any, Q: np.ndarray) -> Any:
    """Return vectors turned, (..., 3)."""
    return values if values is None or not values.size else values @ Q.T


def _pairs(values: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """Return pairs of vectors turned, such as force and moment, (n, 6)."""
    return values if not values.size else np.column_stack([values[:, :3] @ Q.T, values[:, 3:] @ Q.T])


def _tensor(values: np.ndarray, Q: np.ndarray) -> np.ndarray:
    if not values.size:
        return values
    tensor = Q @ values @ Q.T
    return 0.5 * (tensor + tensor.T)


def _columns(values: Any, Q: np.ndarray) -> Any:
    """Return vectors turned that are columns, (3, m)."""
    return values if values is None or not values.size else Q @ values


def _columns_last(values: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """Return nodal vectors turned of several shapes, (n, 3, m)."""
    return values if not values.size else Q @ values


def unturned_forces(modal: ModalRecord, forces: np.ndarray, Q: np.ndarray | None) -> np.ndarray:
    """Return forces on the rows of R of a component, (f, C), of those on the rows of the turned body, (f, C)."""
    if Q is None:
        return forces
    forces = forces.copy()
    for name, load in modal.loads.items():
        if load.unit in VECTORS:
            rows = slice(*modal.interface_rows[name])
            forces[:, rows] = forces[:, rows] @ np.kron(np.eye(VECTORS[load.unit]), Q)
    return forces
