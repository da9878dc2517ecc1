"""From a mesh and a material to the FE model: K, M, rigid motions and held dofs."""

from collections.abc import Sequence

import numpy as np
from pydantic import BaseModel

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements import ELEMENTS
from gudgeon.pipeline.fem.elements.given import given_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import hold
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.geometry.soundness import refuse_pieces
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.supports import Support


def build_model(
    mesh: MeshRecord,
    material: Material | None,
    supports: Sequence[Support | str] = (),
    key: str = "component",
    geometry: BaseModel | None = None,
    *,
    tied: Sequence[str] = (),
) -> FEModel:
    """Assemble stiffness and consistent mass of a meshed component.

    Args:
        material: None for a rigid body; of one whose matrices were read it is not used.
        supports: Held surfaces; a plain name holds all dofs of the surface's nodes.
        key: The component's key in the scene, for messages.
        geometry: Origin of the mesh; a beam, a plane part and a rigid body need it for section, thickness or mass.
        tied: Surfaces of a frame that move as rigid bodies, which join its pieces.

    Raises:
        InputError: the mesh is not of one piece, has an element without volume or no such surface, or a support does
            not fit it.
    """
    if mesh.system is not None:
        model = given_model(mesh, key)
    else:
        cell = cell_of(mesh)
        if cell.dofs:
            if material is None:
                raise InputError(f"{key}.material: is missing; an elastic body needs E, nu and rho")
            rigid = [mesh.surfaces[name].facets for name in tied if name in mesh.surfaces and cell.spatial]
            refuse_pieces(mesh, key, [np.unique(facets) for facets in rigid])
            if not cell.solid and not material.simple:
                entry = "volumes" if material.volumes else "orthotropic"
                raise InputError(f"{key}.material.{entry}: given; allowed for solids")
        try:
            model = ELEMENTS[cell.name].assemble(mesh, material, geometry)
        except InputError as error:
            raise InputError(f"{key}: {error}") from None
    return hold(model, supports, f"{key}.supports") if supports else model
