"""Design changes: nodal positions moved by a profile and by growth, and the design record of each update.

A profile, a table or an offset, gives radial deviations δ over height and angle. Nodes of the named surface move by δ
along the radius; inner nodes follow the nearest surface nodes, faded out by d_fixed / (d_fixed + d_moved) towards the
surfaces that stay; no factorisation is needed. Mass, centre and inertia are integrated over the moved mesh.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import sparse
from scipy.spatial import KDTree

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.reference import nodal_jacobians
from gudgeon.pipeline.fem.elements.solid import mass_properties, solid_twists
from gudgeon.pipeline.geometry.cells import cell_centres, cell_of
from gudgeon.pipeline.geometry.profile import ProfileTable
from gudgeon.pipeline.geometry.surfaces import cylindrical, find_surface, grown, radial_directions, surface_name

NEIGHBOURS = 4
"""Surface nodes that an inner node follows, weighted by inverse square distance; more if some are equally near."""
AS_NEAR = 1e-9
"""Relative difference of distances by round-off, which must not choose among equally near nodes."""
KEPT = 4
"""Meshes whose weights are kept: the designs of a study move the same nodes."""


@dataclass(frozen=True)
class Movement:
    """A profile on a named surface of a mesh, and growth of the whole part after it."""

    surface: str | None
    """None: growth alone."""
    deviation: ProfileTable | float
    """Radial deviation [m] at heights [m] and angles [rad], or everywhere."""
    where: str
    """The profile's key in the scene, for messages."""
    growth: float = 0.0
    """Growth of all lengths about the origin, over them."""

    @property
    def source(self) -> str:
        """Key of the table, offset or growth in the scene."""
        if self.surface is None:
            return f"{self.where.rpartition('.')[0]}.growth"
        return f"{self.where}.{'table' if isinstance(self.deviation, ProfileTable) else 'offset'}"


def move_nodes(mesh: MeshRecord, movement: Movement) -> np.ndarray:
    """Return the nodal positions of the changed design [m], (n, 3).

    Raises:
        InputError: the surface is no cylinder, the table does not cover it, an element would be inverted, or a part
            grows that is no solid, or has attachments.
    """
    if movement.growth and (not cell_of(mesh).solid or mesh.attachments or mesh.relations):
        raise InputError(
            f"{movement.where.rpartition('.')[0]}.growth: given; allowed for solids without masses, couplings, springs"
            " and ties of a deck"
        )
    profiled = mesh.nodes if movement.surface is None else _profiled(mesh, movement, movement.surface)
    return profiled * (1 + movement.growth)


def _profiled(mesh: MeshRecord, movement: Movement, name: str) -> np.ndarray:
    """Return the nodal positions after the profile of a movement on a named surface [m], (n, 3)."""
    surface = find_surface(mesh, name, f"{movement.where}.surface")
    if surface.shape.get("kind") != "cylinder":
        raise InputError(
            f"{movement.where}.surface: '{name}' is no cylinder, a profile needs one; a cylinder of a mesh"
            " file must be declared in geometry.surfaces"
        )
    on_surface = np.unique(surface.facets)
    shift = np.zeros_like(mesh.nodes)
    shift[on_surface] = _radial_shift(mesh.nodes[on_surface], surface, movement)
    others = [np.unique(s.facets) for key, s in mesh.surfaces.items() if key != name]
    fixed = np.setdiff1d(np.concatenate(others) if others else np.empty(0, int), on_surface)
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate([on_surface, fixed]))
    if len(inner):
        followed, fade = _followed(*(mesh.nodes[group].tobytes() for group in (on_surface, fixed, inner)))
        shift[inner] = followed @ shift[on_surface] * fade[:, None]
    nodes = mesh.nodes + shift
    _refuse_inverted(mesh, nodes, movement)
    return nodes


@lru_cache(maxsize=KEPT)
def _followed(moved: bytes, fixed: bytes, inner: bytes) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return the weights of moved nodes in inner ones (inner, moved), and the share of it that these follow (inner,).

    Args:
        moved, fixed, inner: Positions [m] of nodes as the bytes of an array (k, 3).
    """
    surface, still, within = (np.frombuffer(positions).reshape(-1, 3) for positions in (moved, fixed, inner))
    tree = KDTree(surface)
    far, _ = tree.query(within, NEIGHBOURS)
    neighbours = tree.query_ball_point(within, far[:, -1] * (1 + AS_NEAR), return_sorted=True)
    rows = np.repeat(np.arange(len(within)), [len(positions) for positions in neighbours])
    columns = np.concatenate(neighbours).astype(np.intp)
    weights = 1 / ((within[rows] - surface[columns]) ** 2).sum(axis=1)
    weights /= np.bincount(rows, weights)[rows]
    fade = np.ones(len(within))
    if len(still):
        to_fixed, _ = KDTree(still).query(within)
        fade = to_fixed / (to_fixed + far[:, 0])
    return sparse.csr_matrix((weights, (rows, columns)), (len(within), len(surface))), fade


def own_modes(mesh_key: str, modes_key: str, modal: ModalRecord, update: str) -> MorphRecord:
    """Return the design record of a body with its own modes; `update` is that of its change, or `none`."""
    return MorphRecord(
        mesh_key=mesh_key, modes_key=modes_key, update=update,
        points={name: item.points for name, item in modal.interfaces.items()}, mass=modal.mass, centre=modal.centre,
        inertia=modal.inertia, rigid_twists=modal.rigid_twists, nodes=None, quality={},
    )  # fmt: skip


def reuse(
    mesh: MeshRecord,
    keys: tuple[str, str],
    modal: ModalRecord,
    surfaces: dict[str, str],
    movement: Movement,
    rho: float | np.ndarray,
) -> MorphRecord:
    """Return the design record with the modes of the original design, moved nodes and contact points, and new mass.

    Args:
        keys: Of the mesh and of the modes.
        surfaces: The surface of each interface with contact points.
        rho: Density, or that of each element (e,) [kg/m^3].

    Raises:
        InputError: the part is plane, supports leave some rigid motions but not all, or the profile does not fit.
    """
    if not cell_of(mesh).solid:
        raise InputError(f"{movement.source}: modes of a plane part are not reused, use update 'recompute'")
    if "incompatible" in mesh.formulations:
        raise InputError(
            f"{movement.source}: modes of hexahedra with incompatible modes are not reused, use update 'recompute'"
        )
    if mesh.attachments or mesh.relations:
        raise InputError(
            f"{movement.source}: modes with masses, couplings, springs and ties of a deck are not reused, use update"
            " 'recompute'"
        )
    if 0 < len(modal.rigid_twists) < 6:
        raise InputError(
            f"{movement.source}: the supports leave some of the rigid motions free, use update 'recompute'"
        )
    nodes = move_nodes(mesh, movement)
    points = {name: item.points for name, item in modal.interfaces.items()}
    for name in points:
        if movement.surface is not None and surfaces[name] == movement.surface:
            surface = find_surface(mesh, movement.surface, movement.source)
            points[name] = points[name] + _radial_shift(points[name], surface, movement)
        points[name] = points[name] * (1 + movement.growth)
    properties = mass_properties(replace(mesh, nodes=nodes), rho)
    quality = {"largest_shift": float(np.linalg.norm(nodes - mesh.nodes, axis=1).max())}
    twists = solid_twists(properties) if len(modal.rigid_twists) else modal.rigid_twists
    return MorphRecord(
        *keys, update="reuse", points=points, mass=properties.mass, centre=properties.centre,
        inertia=properties.inertia, rigid_twists=twists, nodes=nodes, quality=quality,
    )  # fmt: skip


def moved_mesh(mesh: MeshRecord, movement: Movement) -> MeshRecord:
    """Return the mesh of the changed design, from which its modes are computed."""
    surfaces = {name: grown(surface, movement.growth) for name, surface in mesh.surfaces.items()}
    if movement.surface is not None:
        moved = surfaces[name := surface_name(mesh, movement.surface, movement.source)]
        surfaces[name] = Surface(moved.facets, moved.shape | {"profiled": True})
    return replace(mesh, nodes=move_nodes(mesh, movement), surfaces=surfaces)


def _radial_shift(points: np.ndarray, surface: Surface, movement: Movement) -> np.ndarray:
    """Return how far points of a cylinder (k, 3) move [m], (k, 3)."""
    _, angle, height = cylindrical(points, surface.shape)
    deviation = movement.deviation
    shift = deviation(height, angle)[:, None] if isinstance(deviation, ProfileTable) else deviation
    return radial_directions(points, surface.shape) * shift


def _refuse_inverted(mesh: MeshRecord, nodes: np.ndarray, movement: Movement) -> None:
    # At the nodes the determinant is a sharper test of inversion than at quadrature points.
    moved = replace(mesh, nodes=nodes)
    lowest = nodal_jacobians(moved)[:, 0]
    if lowest.min() <= 0:
        worst = int(np.argmin(lowest))
        centre = cell_centres(moved)[worst]
        raise InputError(
            f"{movement.source}: the profile inverts {int((lowest <= 0).sum())} elements, the worst is element"
            f" {worst} near ({centre[0]:.4g}, {centre[1]:.4g}, {centre[2]:.4g}) m; allowed: up to"
            f" {math.floor(1e3 * _safe_share(mesh, nodes)) / 10:g} % of these deviations"
        )


def _safe_share(mesh: MeshRecord, nodes: np.ndarray) -> float:
    """Return the largest share of a movement of the nodes to (n, 3) that inverts no element, by bisection to 1/1024."""
    safe, inverted = 0.0, 1.0
    while inverted - safe > 1 / 1024:
        middle = 0.5 * (safe + inverted)
        moved = replace(mesh, nodes=mesh.nodes + middle * (nodes - mesh.nodes))
        safe, inverted = (middle, inverted) if nodal_jacobians(moved)[:, 0].min() > 0 else (safe, middle)
    return safe
