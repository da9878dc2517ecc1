"""The modes stage: mesh and component in, ModalRecord out."""

import numpy as np
from scipy import sparse

from modaldb.schema import InertiaCouplings, InterfaceModes, MeshRecord, ModalRecord
from pipeline.component import Component
from pipeline.errors import InputError
from pipeline.interface import ContactPoints, contact_points, surface_coordinates
from pipeline.model import FEModel, build_model
from pipeline.modes.normal import largest_count
from pipeline.modes.static import pressure_fields
from pipeline.recipes import RECIPES, ContactRows, Reduction


def reduce_component(mesh: MeshRecord, mesh_key: str, component: Component, name: str) -> ModalRecord:
    """Assemble a component and reduce it by its recipe.

    Args:
        name: The component's name in the scene, for messages.

    Raises:
        InputError: an interface does not fit the mesh, or the mesh is inverted.
        StageError: the reduction failed its own checks.
    """
    touched = {
        key: contact_points(mesh, interface, f"component.{name}.interface.{key}")
        for key, interface in sorted(component.interface.items())
    }
    model = build_model(mesh, component.material)
    if component.modes.normal_count > (most := largest_count(model)):
        raise InputError(
            f"component.{name}.modes.normal_count: {component.modes.normal_count} given, its mesh has {most} at most;"
            " refine it or ask for fewer"
        )
    reduction = RECIPES[component.modes.recipe](model, _rows(mesh, component, model, touched), component.modes)
    ends = np.cumsum([0, *(len(points.nodes) for points in touched.values())])
    return ModalRecord(
        mesh_key=mesh_key,
        recipe=component.modes.recipe,
        normal_count=reduction.normal_count,
        static_count=len(reduction.angular_frequencies) - reduction.normal_count,
        angular_frequencies=reduction.angular_frequencies,
        mass=model.properties.mass,
        centre=model.properties.centre,
        inertia=model.properties.inertia,
        rigid_twists=model.rigid_twists,
        interfaces={
            key: InterfaceModes(
                points.nodes, points.points, points.normals, points.areas, points.edge,
                model.rows(points.nodes, points.normals) @ reduction.Phi,
            )
            for key, points in touched.items()
        },
        interface_rows={
            key: [int(start), int(stop)] for key, start, stop in zip(touched, ends, ends[1:], strict=False)
        },
        residual_flexibility=reduction.residual_flexibility,
        shapes=model.nodal(reduction.Phi),
        inertia_couplings=_couplings(model, reduction) if len(model.directions) == 3 else None,
        quality=reduction.quality,
    )  # fmt: skip


def _rows(mesh: MeshRecord, component: Component, model: FEModel, touched: dict[str, ContactPoints]) -> ContactRows:
    blocks, fields = [sparse.csr_matrix((0, model.K.shape[0]))], []
    for key, points in touched.items():
        blocks.append(model.rows(points.nodes, points.normals))
        shape = mesh.surfaces[component.interface[key].surface].shape
        fields.append(
            pressure_fields(surface_coordinates(points.points, shape), points.areas, component.modes.static_count)
        )
    height, width = sum(len(f) for f in fields), sum(f.shape[1] for f in fields)
    pressures, row, column = np.zeros((height, width)), 0, 0
    for field in fields:
        pressures[row : row + len(field), column : column + field.shape[1]] = field
        row, column = row + len(field), column + field.shape[1]
    return ContactRows(sparse.csr_matrix(sparse.vstack(blocks)), pressures)


def _couplings(model: FEModel, reduction: Reduction) -> InertiaCouplings:
    """Constant tensors of the nodal floating frame: ũᵀ M Φ with u = x + Σ qₖ φₖ."""
    arm = model.nodes - model.properties.centre
    momentum = (model.M @ reduction.Phi).reshape(len(arm), 3, -1)
    shapes = reduction.Phi.reshape(len(arm), 3, -1)
    pairs = np.einsum("nik,njl->ijkl", shapes, momentum, optimize=True)
    gradient = np.stack([pairs[1, 2] - pairs[2, 1], pairs[2, 0] - pairs[0, 2], pairs[0, 1] - pairs[1, 0]])
    return InertiaCouplings(
        translation=momentum.sum(axis=0),
        rotation=np.cross(arm[:, :, None], momentum, axis=1).sum(axis=0),
        rotation_gradient=gradient,
    )
