"""A design change moves nodal positions by interpolation; how far the modes follow is the update.

A profile, a table or an offset, gives radial deviations δ over height and angle. Nodes of the named surface move by δ
along the radius; inner nodes follow the nearest surface nodes, faded out by d_fixed / (d_fixed + d_moved) towards the
surfaces that stay, so that no factorisation is needed. Mass, centre and inertia are always integrated anew.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.spatial import KDTree

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.solid import mass_properties, nodal_jacobians, solid_twists
from gudgeon.pipeline.geometry.profile import ProfileTable, UniformProfile
from gudgeon.pipeline.geometry.surfaces import cylindrical, find_surface, radial_directions

NEIGHBOURS = 4
"""Surface nodes that an inner node follows, weighted by inverse square distance; more where some are as near."""
AS_NEAR = 1e-9
"""Relative difference of distances that round-off makes: it must not choose among equals."""


@dataclass(frozen=True)
class Movement:
    """A profile on a named surface of a mesh."""

    surface: str
    deviation: ProfileTable | UniformProfile
    """Radial deviation [m] at heights [m] and angles [rad]."""
    where: str
    """The profile's key in the scene, for messages."""

    @property
    def source(self) -> str:
        """Key of what gives the deviation."""
        return f"{self.where}.{'table' if isinstance(self.deviation, ProfileTable) else 'offset'}"


def move_nodes(mesh: MeshRecord, movement: Movement) -> np.ndarray:
    """Return the nodal positions of the changed design [m], (n, 3).

    Raises:
        InputError: the surface is no cylinder, the table does not cover it, or an element would be inverted.
    """
    surface = _cylinder(mesh, movement)
    on_surface = np.unique(surface.facets)
    deviation = _deviations(mesh.nodes[on_surface], surface, movement)
    shift = np.zeros_like(mesh.nodes)
    shift[on_surface] = radial_directions(mesh.nodes[on_surface], surface.shape) * deviation[:, None]
    others = [np.unique(s.facets) for name, s in mesh.surfaces.items() if name != movement.surface]
    fixed = np.setdiff1d(np.concatenate(others) if others else np.empty(0, int), on_surface)
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate([on_surface, fixed]))
    if len(inner):
        followed, nearest = _followed(mesh.nodes[on_surface], mesh.nodes[inner])
        fade = np.ones(len(inner))
        if len(fixed):
            to_fixed, _ = KDTree(mesh.nodes[fixed]).query(mesh.nodes[inner])
            fade = to_fixed / (to_fixed + nearest)
        shift[inner] = followed @ shift[on_surface] * fade[:, None]
    nodes = mesh.nodes + shift
    _refuse_inverted(replace(mesh, nodes=nodes), movement)
    return nodes


def _followed(surface: np.ndarray, inner: np.ndarray) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return the weights of surface nodes in inner ones (inner, surface), and how near the nearest is [m], (inner,)."""
    tree = KDTree(surface)
    far, _ = tree.query(inner, NEIGHBOURS)
    near = tree.query_ball_point(inner, far[:, -1] * (1 + AS_NEAR), return_sorted=True)
    rows = np.repeat(np.arange(len(inner)), [len(one) for one in near])
    columns = np.concatenate(near).astype(np.intp)
    weights = 1 / ((inner[rows] - surface[columns]) ** 2).sum(axis=1)
    weights /= np.bincount(rows, weights)[rows]
    return sparse.csr_matrix((weights, (rows, columns)), (len(inner), len(surface))), far[:, 0]


def own_modes(mesh_key: str, modes_key: str, modal: ModalRecord, update: str) -> MorphRecord:
    """Return the design that the modes were made of; `update` is `none` or `recompute`."""
    return MorphRecord(
        mesh_key, modes_key, update, {name: item.points for name, item in modal.interfaces.items()},
        modal.mass, modal.centre, modal.inertia, modal.rigid_twists, None, {},
    )  # fmt: skip


def reuse(
    mesh: MeshRecord,
    keys: tuple[str, str],
    modal: ModalRecord,
    surfaces: dict[str, str],
    movement: Movement,
    rho: float,
) -> MorphRecord:
    """Keep the modes; move nodes and contact points, and weigh the body again.

    Args:
        keys: Of the mesh and of the modes.
        surfaces: The surface of each interface; those of contact points matter.
        rho: Density [kg/m^3].
    """
    if 0 < len(modal.rigid_twists) < 6:
        raise InputError(f"{movement.source}: the supports leave a part of the rigid motions, take update 'recompute'")
    nodes = move_nodes(mesh, movement)
    shape = mesh.surfaces[movement.surface].shape
    points = {}
    for name, item in modal.interfaces.items():
        points[name] = item.points
        if surfaces[name] == movement.surface:
            deviation = _deviations(item.points, mesh.surfaces[movement.surface], movement)
            points[name] = item.points + radial_directions(item.points, shape) * deviation[:, None]
    properties = mass_properties(replace(mesh, nodes=nodes), rho)
    quality = {"largest_shift": float(np.linalg.norm(nodes - mesh.nodes, axis=1).max())}
    # A held body has no rigid motion, wherever its nodes go.
    twists = solid_twists(properties) if len(modal.rigid_twists) else modal.rigid_twists
    return MorphRecord(
        *keys, "reuse", points, properties.mass, properties.centre, properties.inertia, twists, nodes, quality
    )  # fmt: skip


def moved_mesh(mesh: MeshRecord, movement: Movement) -> MeshRecord:
    """Return the mesh of the changed design, for modes of its own."""
    nodes = move_nodes(mesh, movement)
    moved = mesh.surfaces[movement.surface]
    surface = Surface(moved.facets, moved.shape | {"profiled": True})
    return replace(mesh, nodes=nodes, surfaces=mesh.surfaces | {movement.surface: surface})


def _cylinder(mesh: MeshRecord, movement: Movement) -> Surface:
    surface = find_surface(mesh, movement.surface, f"{movement.where}.surface")
    if surface.shape.get("kind") != "cylinder":
        raise InputError(f"{movement.where}.surface: '{movement.surface}' is no cylinder, a profile needs one")
    return surface


def _deviations(points: np.ndarray, surface: Surface, movement: Movement) -> np.ndarray:
    _, angle, height = cylindrical(points, surface.shape)
    return movement.deviation(height, angle)


def _refuse_inverted(mesh: MeshRecord, movement: Movement) -> None:
    # The determinant at all ten nodes bounds what a quadratic element can do better than quadrature points do.
    lowest = nodal_jacobians(mesh).min(axis=1)
    if lowest.min() <= 0:
        worst = int(np.argmin(lowest))
        where = mesh.nodes[mesh.cells[worst, :4]].mean(axis=0)
        raise InputError(
            f"{movement.source}: the profile inverts {int((lowest <= 0).sum())} elements, the worst is element"
            f" {worst} near ({where[0]:.4g}, {where[1]:.4g}, {where[2]:.4g}) m; allowed are deviations well below the"
            " wall thickness"
        )
