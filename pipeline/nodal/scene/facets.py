"""What points of one mesh meet on the curved facets of another, by shape functions of all its nodes.

A force λᵢ of point i, a mid-side node, is the pressure λᵢ ψᵢ / ∫ψᵢ dA with ψᵢ linear on a facet, 1 at the point and 0
at its other mid-side nodes. The other body has its consistent nodal forces ∫ N_b p dA, by quadrature over the facets of
the first, at the places that face its points along their normals. Written apart from the solver's weights, which it
judges.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import Surface
from gudgeon.pipeline.fem.elements.reference import shape_functions
from gudgeon.pipeline.geometry.cells import TRIANGLE6
from gudgeon.pipeline.geometry.surfaces import find_surface
from gudgeon.pipeline.interfaces.points import ContactPoints, facet_points
from gudgeon.pipeline.nodal.scene.body import Part

PIECES = 3
"""Into how many parts the edges of facets are divided for quadrature."""
BEYOND = 0.02
"""How far outside of a facet, in its own coordinates, a place may lie."""
FACING = -0.3
"""Largest cosine between a direction and the outward normal of a facet that it can meet."""
DEEPEST = 0.25
"""Largest penetration, over the extent of the points."""
NEWTON = 6
"""Steps to the place on a curved facet."""
CHUNK = 1_000_000
"""Pairs of places and facets at once."""


@dataclass(frozen=True)
class Met:
    """What p places meet along their directions."""

    facet: np.ndarray
    """−1 where they miss, (p,)."""
    place: np.ndarray
    """Coordinates in the facet, (p, 2)."""
    distance: np.ndarray
    """[m], ∞ where they miss, (p,)."""


def faced_rows(
    near_side: tuple[Part, ContactPoints, Surface], far_side: tuple[Part, Surface]
) -> tuple[sparse.csr_matrix, np.ndarray, np.ndarray]:
    """Return ∂g/∂u over the dofs of the other body, (c, dofs), gaps [m], ∞ where points meet nothing, and areas, (c,).

    Areas are those of what the other body covers [m^2]: where points of a facet meet nothing, those that do carry it.
    """
    (mine, points, surface), (theirs, far) = near_side, far_side
    normals = points.normals @ mine.rotation.T
    nodes = theirs.placed(theirs.model.nodes)
    gaps = _meet(mine.placed(points.points), normals, nodes, far.facets).distance
    facets = surface.facets[np.isin(surface.facets[:, 3:], points.nodes).any(axis=1)]
    row_of_node = np.full(len(mine.model.nodes), -1)
    row_of_node[points.nodes] = np.arange(len(points.nodes))
    _, _, N, positions, areas = facet_points(mine.model.nodes, Surface(facets, surface.shape), PIECES)[0]
    size = np.linalg.norm(areas, axis=2)
    outward = (areas / size[:, :, None]) @ mine.rotation.T
    met = _meet(mine.placed(positions).reshape(-1, 3), outward.reshape(-1, 3), nodes, far.facets)
    hit = np.flatnonzero(met.facet >= 0)
    values = shape_functions(TRIANGLE6, met.place[hit].T)[0].T
    columns, hit_areas = far.facets[met.facet[hit]], size.ravel()[hit]
    of, sample = np.divmod(hit, N.shape[1])
    functions = _linear(N)
    shares_by_node = sparse.csr_matrix((len(row_of_node), len(nodes)))
    for side in range(3):
        rows = facets[of, 3 + side]
        amounts = (functions[side, sample] * hit_areas)[:, None] * values
        shares_by_node = shares_by_node + sparse.csr_matrix(
            (amounts.ravel(), (np.repeat(rows, 6), columns.ravel())), (len(row_of_node), len(nodes))
        )
    shares = sparse.csr_matrix(shares_by_node[points.nodes])
    sums = np.asarray(shares.sum(axis=1)).ravel()
    shares = sparse.csr_matrix(
        sparse.diags_array(np.where(sums > 0, 1.0 / np.where(sums > 0, sums, 1.0), 0.0)) @ shares
    )
    # The gap grows where the other body moves along the outward normal of the point.
    directions = normals @ theirs.rotation
    coo = sparse.coo_matrix(shares)
    rows = np.repeat(coo.row, 3)
    dofs = (3 * coo.col[:, None] + np.arange(3)).ravel()
    along = (coo.data[:, None] * directions[coo.row]).ravel()
    onto = sparse.csr_matrix((along, (rows, dofs)), (len(normals), 3 * len(nodes)))
    gaps = np.where(sums > 0, gaps, np.inf)
    covered = np.where(np.isfinite(gaps), sums, 0.0)
    covered *= sums.sum() / covered.sum() if covered.any() else 0.0
    return sparse.csr_matrix(theirs.model.on_dofs(onto) @ theirs.reduction), gaps, covered


def surface_of(body: Part, interface: str) -> Surface:
    """Return the surface on which an interface of a part is."""
    return find_surface(body.model.mesh, body.component.interface[interface].surface, interface)


def _linear(N: np.ndarray) -> np.ndarray:
    """Return ψ of the sides 0-1, 1-2, 2-0 from the shape functions of six nodes, (6, q), (3, q)."""
    a, b, c = N[0] + (N[3] + N[5]) / 2, N[1] + (N[3] + N[4]) / 2, N[2] + (N[4] + N[5]) / 2
    return np.array([1 - 2 * c, 1 - 2 * a, 1 - 2 * b])


def _meet(positions: np.ndarray, directions: np.ndarray, nodes: np.ndarray, facets: np.ndarray) -> Met:
    """Return what places [m] meet on facets of six nodes along unit directions, (p, 3) each."""
    corners = nodes[facets[:, :3]]
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(e1, e2)
    double = np.linalg.norm(normal, axis=1, keepdims=True)
    normal, t_min = normal / double, -DEEPEST * float(np.linalg.norm(np.ptp(positions, axis=0)))
    met = Met(np.full(len(positions), -1), np.zeros((len(positions), 2)), np.full(len(positions), np.inf))
    step = max(CHUNK // len(facets), 1)
    for chunk_start in range(0, len(positions), step):
        p, d = positions[chunk_start : chunk_start + step], directions[chunk_start : chunk_start + step]
        facing = d @ normal.T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (np.einsum("fi,fi->f", corners[:, 0], normal) - p @ normal.T) / facing
        row, facet = np.nonzero((facing < FACING) & (t > t_min))
        hit = p[row] + t[row, facet, None] * d[row] - corners[facet, 0]
        x = np.einsum("pi,pi->p", np.cross(hit, e2[facet]), normal[facet]) / double[facet, 0]
        y = np.einsum("pi,pi->p", np.cross(e1[facet], hit), normal[facet]) / double[facet, 0]
        interior = np.minimum(np.minimum(x, y), 1 - x - y) >= -BEYOND
        row, facet, start = row[interior], facet[interior], np.column_stack([x, y])[interior]
        barycentric, distance = _on_curved(nodes[facets[facet]], p[row], d[row], start)
        order = np.lexsort((np.abs(distance), row))
        nearest = order[np.unique(row[order], return_index=True)[1]]
        met.facet[chunk_start + row[nearest]], met.place[chunk_start + row[nearest]] = (
            facet[nearest],
            barycentric[nearest],
        )
        met.distance[chunk_start + row[nearest]] = distance[nearest]
    return met


def _on_curved(
    corners: np.ndarray, positions: np.ndarray, directions: np.ndarray, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return coordinates (p, 2) and distance [m] (p,) where lines meet facets of six nodes, (p, 6, 3), by Newton."""
    coordinates, distance = start.copy(), np.zeros(len(start))
    for step in range(NEWTON):
        N, dN = (np.asarray(values) for values in shape_functions(TRIANGLE6, coordinates.T))
        x = np.einsum("pai,ap->pi", corners, N)
        slopes = np.einsum("pai,akp->pik", corners, dN)
        if step == 0:
            distance = np.einsum("pi,pi->p", x - positions, directions)
        wrong = x - positions - distance[:, None] * directions
        change = np.linalg.solve(np.concatenate([slopes, -directions[:, :, None]], axis=2), wrong[:, :, None])[..., 0]
        coordinates, distance = coordinates - change[:, :2], distance - change[:, 2]
    return coordinates, distance
