"""From a mesh and a material to the FE model: K, M, rigid motions, and what holds it."""

from collections.abc import Sequence

from pydantic import BaseModel

from modaldb.schema import MeshRecord
from pipeline.elements import ASSEMBLERS
from pipeline.elements.rigid import rigid_body
from pipeline.errors import InputError
from pipeline.femodel import FEModel
from pipeline.geometry.soundness import refuse_pieces
from pipeline.material import Material
from pipeline.settings import Support
from pipeline.supports import hold


def build_model(
    mesh: MeshRecord,
    material: Material | None,
    supports: Sequence[Support | str] = (),
    where: str = "component",
    geometry: BaseModel | None = None,
) -> FEModel:
    """Assemble stiffness and consistent mass of a meshed component.

    Args:
        material: None for a rigid body.
        supports: What is held; a plain name holds a surface's nodes in all their dofs.
        where: The component's key in the scene, for messages.
        geometry: What the mesh was made of; a beam and a rigid body need it, for the section or the mass.

    Raises:
        InputError: the mesh is not of one piece, has an element without volume or no such surface, or a support does
            not fit it.
    """
    if mesh.cell_type == "vertex":
        model = rigid_body(mesh, geometry)
    else:
        if material is None:
            raise InputError(f"{where}.material: is missing; a body that deforms needs E, nu and rho")
        refuse_pieces(mesh, where)
        try:
            model = ASSEMBLERS[mesh.cell_type](mesh, material, geometry)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
    return hold(model, supports, f"{where}.supports") if supports else model
