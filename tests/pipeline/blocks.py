"""Rectangular blocks of a few tet10, made by hand, for tests of the full-FE run."""

import platform
from dataclasses import replace
from itertools import permutations

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.nodal.problem import NodalBody, NodalLoad
from gudgeon.pipeline.nodal.start import supported_body
from gudgeon.pipeline.scenes.material import Material

MKL_HAS_A_WHEEL = platform.machine() == "x86_64"
"""As pyproject.toml asks for it: where it has one and is not found, tests of PARDISO fail instead of being skipped."""
EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))


def block(size: tuple[float, float, float], cells: tuple[int, int, int], E: float = 70e9) -> FEModel:
    """Return a block centred in x and y, from z = 0 upwards, of cubes that are cut into six tet10 each."""
    shape = np.array(cells)
    corners = []
    for cube in np.ndindex(*cells):
        for order in permutations(range(3)):
            path = np.vstack([np.zeros(3, int), np.cumsum(np.eye(3, dtype=int)[list(order)], axis=0)]) + cube
            odd = np.linalg.det(np.eye(3)[list(order)]) < 0
            corners.append(path[[0, 2, 1, 3]] if odd else path)
    doubled = np.array([np.vstack([2 * tet, [tet[a] + tet[b] for a, b in EDGES]]) for tet in corners])
    nodes, numbers = np.unique(doubled.reshape(-1, 3), axis=0, return_inverse=True)
    places = (nodes / (2 * shape) - [0.5, 0.5, 0]) * size
    mesh = MeshRecord(places, numbers.reshape(-1, 10), "tetra10", {})
    return build_model(mesh, Material(E=E, nu=0.3, rho=2700.0))


def on_plane(model: FEModel, axis: int, place: float) -> np.ndarray:
    """Return the numbers of the nodes on a plane."""
    return np.flatnonzero(np.abs(model.nodes[:, axis] - place) < 1e-9)


def clamped(name: str, model: FEModel, held: np.ndarray, damping: float = 0.0) -> tuple[NodalBody, np.ndarray]:
    """Return a body with held nodes, and the dofs that are left."""
    kept = np.setdiff1d(np.arange(model.K.shape[0]), (3 * held[:, None] + np.arange(3)).ravel())
    K, M = (sparse.csr_matrix(matrix[kept][:, kept]) for matrix in (model.K, model.M))
    return NodalBody(name, K, M, damping=damping), kept


def free_body(
    name: str,
    model: FEModel,
    velocity: np.ndarray,
    *,
    twists: np.ndarray | None = None,
    damping: float = 0.0,
    loads: tuple[NodalLoad, ...] = (),
    field: tuple[float, ...] = (0.0, 0.0, 0.0),
) -> NodalBody:
    """Return a body on which nothing is held, with any velocity [m/s], (dofs,), and loads beside its weight."""
    chosen = model.rigid_twists if twists is None else twists
    body, _ = supported_body(name, model, chosen, np.zeros(6), damping=damping, field=np.array(field))
    return replace(body, velocity=velocity, loads=(*loads, *body.loads))


def plane_twists(model: FEModel) -> np.ndarray:
    """Return mass-normalised motions in the x-z plane: x, z, turn about y."""
    twists = np.zeros((3, 6))
    twists[[0, 1], [0, 2]] = 1 / np.sqrt(model.properties.mass)
    twists[2, 4] = 1 / np.sqrt(model.properties.inertia[1, 1])
    return twists
