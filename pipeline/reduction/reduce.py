"""The modes stage: mesh and component in, ModalRecord out."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import InertiaCouplings, InterfaceModes, LoadModes, ModalRecord, TractionModes
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import surface_nodes
from gudgeon.pipeline.interfaces.gauges import gauge_rows, refuse_large
from gudgeon.pipeline.interfaces.loads import LoadRows, load_rows
from gudgeon.pipeline.interfaces.patch import patch_point, patch_row
from gudgeon.pipeline.interfaces.points import ContactPoints, contact_points, surface_coordinates
from gudgeon.pipeline.interfaces.tie import Tie, made_rigid, tie_of, tie_rows
from gudgeon.pipeline.interfaces.traction_space import TractionSpace, refuse_too_many, refuse_unresolved, traction_space
from gudgeon.pipeline.modes.normal import largest_count
from gudgeon.pipeline.modes.static import pressure_fields
from gudgeon.pipeline.reduction.accuracy import frequency_errors, refuse_locking
from gudgeon.pipeline.reduction.gauges import gauge_modes
from gudgeon.pipeline.reduction.methods import REDUCTIONS, ContactRows, Reduction
from gudgeon.pipeline.reduction.methods.reduction import reference_reaction
from gudgeon.pipeline.scenes.component import Component


@dataclass(frozen=True)
class _Touched:
    """Interfaces of a component on its mesh."""

    points: dict[str, ContactPoints]
    tractions: dict[str, TractionSpace]
    loads: dict[str, LoadRows]
    rows: dict[str, sparse.csr_matrix]
    """Rows of B by interface, in the order of the names."""
    fields: dict[str, np.ndarray]
    """Forces of the pressure fields that get a static shape, by interface, (rows, k)."""
    ties: dict[str, Tie]

    def all_rows(self, dofs: int) -> ContactRows:
        """Return all rows as one matrix."""
        B = sparse.vstack([sparse.csr_matrix((0, dofs)), *self.rows.values()], format="csr")
        return ContactRows(B, linalg.block_diag(np.empty((0, 0)), *self.fields.values()), self.spans())

    def spans(self) -> dict[str, list[int]]:
        """Return first and last + 1 row of each interface."""
        ends = np.cumsum([0, *(rows.shape[0] for rows in self.rows.values())])
        return {name: [int(a), int(b)] for name, a, b in zip(self.rows, ends, ends[1:], strict=False)}


def reduce_component(mesh: MeshRecord, mesh_key: str, component: Component, name: str) -> ModalRecord:
    """Assemble a component and reduce it to a modal record.

    Args:
        name: The component's name in the scene, for messages.

    Raises:
        InputError: an interface or a support does not fit the mesh, or the mesh is inverted.
        StageError: the reduction failed its own checks.
    """
    where = f"component.{name}"
    touched = _contacts(mesh, component, where)
    model = build_model(mesh, component.material, component.supports, where, component.geometry)
    _gather(touched, mesh, component, model, where)
    rigid = {key: tie for key, tie in touched.ties.items() if component.interface[key].tie == "rbe2"}
    tied, spread = made_rigid(model, rigid, f"{where}.interface")
    contact = touched.all_rows(model.K.shape[0])
    contact = replace(contact, B=sparse.csr_matrix(contact.B @ spread))
    gauges = {key: sparse.csr_matrix(S @ spread) for key, S in gauge_rows(model, component, where).items()}
    refuse_large(gauges, contact.B.shape[0], where)
    own = _reduced(tied, contact, component, where)
    reduction = replace(own, Phi=spread @ own.Phi)
    at_rows = {key: rows @ reduction.Phi for key, rows in touched.rows.items()}
    errors = frequency_errors(tied, own, model, spread, component)
    refuse_locking(
        errors.discretisation, own.angular_frequencies, component, where,
        lambda other: reduce_component(mesh, mesh_key, other, name).discretisation_errors,
    )  # fmt: skip
    return ModalRecord(
        mesh_key=mesh_key,
        reduction=component.modes.reduction,
        normal_count=reduction.normal_count,
        static_count=len(reduction.angular_frequencies) - reduction.normal_count,
        angular_frequencies=reduction.angular_frequencies,
        mass=model.properties.mass,
        centre=model.properties.centre,
        inertia=model.properties.inertia,
        rigid_twists=model.rigid_twists,
        interfaces={
            key: InterfaceModes(p.nodes, p.points, p.normals, p.areas, p.edge, at_rows[key])
            for key, p in touched.points.items()
        },
        interface_rows=touched.spans(),
        residual_flexibility=reduction.residual_flexibility,
        shapes=model.nodal(reduction.Phi),
        inertia_couplings=_couplings(model, reduction),
        participation=_participation(model, reduction) if model.held.any() else None,
        quality=reduction.quality | {"rigid_motions": len(model.rigid_twists)},
        tractions={
            key: TractionModes(s.chart, s.start, s.spacing, s.counts, at_rows[key], s.resultant)
            for key, s in touched.tractions.items()
        },
        loads={
            key: LoadModes(at_rows[key], load.resultant, load.point, load.unit) for key, load in touched.loads.items()
        },
        gauges=gauge_modes(component, gauges, tied, contact.B, own),
        residuals=errors.residuals,
        algebraic_errors=errors.algebraic,
        discretisation_errors=errors.discretisation,
    )


def _reduced(model: FEModel, contact: ContactRows, component: Component, where: str) -> Reduction:
    """Run the reduction, and evaluate the reaction at the reference surface if one is given."""
    settings = component.modes
    if settings.reduction != "rigid" and settings.normal_count > (most := largest_count(model)):
        raise InputError(
            f"{where}.modes.normal_count: {settings.normal_count} given, its mesh has {most} at most;"
            " refine the mesh or request fewer modes"
        )
    reference = None
    if settings.reference is not None:
        reference = surface_nodes(model.mesh, settings.reference, f"{where}.modes.reference")
    try:
        reduction = REDUCTIONS[settings.reduction](model, contact, settings)
    except InputError as error:
        raise InputError(f"{where}.{error}") from None
    except StageError as error:
        raise StageError(f"{where}: {error}") from error
    if reference is None or not len(reduction.angular_frequencies):
        return reduction
    share = reference_reaction(model, reduction, reference)
    return replace(reduction, quality=reduction.quality | {"reference_reaction": share})


def _contacts(mesh: MeshRecord, component: Component, where: str) -> _Touched:
    """Find the interfaces on the mesh, so that incorrect ones are refused before matrices are assembled."""
    points, tractions, ties = {}, {}, {}
    for key, interface in sorted(component.interface.items()):
        here = f"{where}.interface.{key}"
        if interface.kind == "points":
            points[key] = contact_points(mesh, interface, here)
        elif interface.kind == "traction":
            tractions[key] = traction_space(mesh, interface, here)
        elif interface.kind == "patch":
            points[key] = patch_point(mesh, interface, here)
        elif interface.kind == "tie":
            ties[key] = tie_of(mesh, interface, here)
    refuse_too_many(tractions, f"{where}.interface")
    refuse_unresolved(tractions, f"{where}.interface")
    return _Touched(points, tractions, {}, {}, {}, ties)


def _gather(touched: _Touched, mesh: MeshRecord, component: Component, model: FEModel, where: str) -> None:
    """Add loads, rows of B and pressure fields."""
    points, tractions, count = touched.points, touched.tractions, component.modes.static_count
    for key, interface in sorted(component.interface.items()):
        if key in points:
            at = points[key]
            patch = interface.kind == "patch"
            rows = patch_row(mesh, model, interface, where) if patch else model.rows(at.nodes, at.normals)
            if model.rotations.any() and not np.abs(rows.data).max(initial=0.0) > 0:
                raise InputError(
                    f"{where}.interface.{key}.surface: '{interface.surface}' given, the beam does not move along its"
                    f" normal; use {interface.surface}-top or {interface.surface}-bottom"
                )
            touched.rows[key] = rows
            coordinates = surface_coordinates(at.points, mesh.surfaces[interface.surface].shape)
            touched.fields[key] = pressure_fields(coordinates, at.areas, count)
        elif key in tractions:
            touched.rows[key] = tractions[key].rows(model)
            touched.fields[key] = pressure_fields(tractions[key].centres, tractions[key].areas, count)
        else:
            tie = touched.ties.get(key)
            load = tie_rows(model, tie) if tie else load_rows(mesh, model, interface, f"{where}.interface.{key}")
            touched.loads[key] = load
            touched.rows[key] = load.B
            touched.fields[key] = np.empty((load.B.shape[0], 0))


def _participation(model: FEModel, reduction: Reduction) -> np.ndarray:
    """Return Tᵀ M Φ [kg^½], T the unit translations, (3, m); held dofs do not move."""
    momentum = (model.M @ reduction.Phi).reshape(len(model.nodes), len(model.directions), -1).sum(axis=0)
    return model.directions.T @ momentum


def _couplings(model: FEModel, reduction: Reduction) -> InertiaCouplings | None:
    """Return the constant tensors of the nodal floating frame, ũᵀ M Φ with u = x + Σ qₖ φₖ.

    None for a line mesh, and for a body that is held or cannot rotate: it has no floating frame.
    """
    if len(model.directions) != 3 or len(model.rigid_twists) < 6:
        return None
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
