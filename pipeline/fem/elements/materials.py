"""Materials of the volumes of a solid: which cells have which, densities, and elastic constants of any symmetry."""

from collections.abc import Iterator, Sequence

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.assembly import isotropic
from gudgeon.pipeline.geometry.cells import submesh
from gudgeon.pipeline.scenes.material import Material

Pairs = Sequence[tuple[int, int]]


def material_cells(mesh: MeshRecord, material: Material) -> list[tuple[Material, np.ndarray]]:
    """Return each material with its cells, (k,), ascending; materials without cells are left out.

    Raises:
        InputError: the mesh has no such volume, or two of them have a cell in common.
    """
    owner = np.full(len(mesh.cells), -1)
    names = list(material.volumes)
    for index, name in enumerate(names):
        if name not in mesh.volumes:
            have = ", ".join(sorted(mesh.volumes)) or "none"
            raise InputError(f"material.volumes: the mesh has no volume '{name}', it has {have}")
        taken = owner[mesh.volumes[name]]
        if (taken >= 0).any():
            raise InputError(f"material.volumes: '{name}' and '{names[taken.max()]}' have cells in common")
        owner[mesh.volumes[name]] = index
    every = [(material, np.flatnonzero(owner < 0))]
    every += [(material.volumes[name], np.flatnonzero(owner == index)) for index, name in enumerate(names)]
    return [(phase, cells) for phase, cells in every if len(cells)]


def densities(mesh: MeshRecord, material: Material) -> float | np.ndarray:
    """Return the density [kg/m^3]: one number, or that of each cell, (e,); errors as of `material_cells`."""
    if not material.volumes:
        return material.rho
    rho = np.empty(len(mesh.cells))
    for phase, cells in material_cells(mesh, material):
        rho[cells] = phase.rho
    return rho


def material_parts(mesh: MeshRecord, material: Material) -> Iterator[tuple[Material, MeshRecord, np.ndarray]]:
    """Yield each material with the mesh of its cells alone, and the nodes of these in the whole mesh, (k,)."""
    if not material.volumes:
        yield material, mesh, np.arange(len(mesh.nodes))
        return
    for phase, cells in material_cells(mesh, material):
        yield phase, *submesh(mesh, cells)


def stiffness_of(G: np.ndarray, material: Material) -> np.ndarray:
    """Return C_ikjl G_kl, the stiffness of products G_kl of gradients along k and l, (e, d, d, …)."""
    if material.orthotropic is None:
        return isotropic(G, *material.lame)
    return np.einsum("ikjl,ekl...->eij...", material.orthotropic.tensor, G, optimize=True)


def elasticity_matrix(material: Material, pairs: Pairs, shear: float) -> np.ndarray:
    """Return the matrix from strains to stresses [Pa] of an orthotropic material, (6, 6).

    Args:
        pairs: Directions of the six components, the shears last.
        shear: Factor on shear strains: 1 for engineering shears γ, 2 for components ε of the tensor.
    """
    assert material.orthotropic is not None
    C = material.orthotropic.tensor
    D = np.array([[C[i, j, k, l] for k, l in pairs] for i, j in pairs])
    return D * np.repeat([1.0, shear], 3)
