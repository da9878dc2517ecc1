"""The modes stage: mesh and component in, ModalRecord out."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import (
    INERTIA_ERROR,
    VOLUME_ERROR,
    InertiaCouplings,
    InterfaceModes,
    LoadModes,
    ModalRecord,
    SwapModes,
    TractionModes,
)
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import surface_nodes
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.interfaces.gauges import body_force_rows, gauge_rows, refuse_large
from gudgeon.pipeline.interfaces.loads import LoadRows
from gudgeon.pipeline.interfaces.points import ContactPoints, shape_errors
from gudgeon.pipeline.interfaces.tie import Tie
from gudgeon.pipeline.interfaces.traction_space import TractionSpace
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.normal import largest_count
from gudgeon.pipeline.reduction.accuracy import frequency_errors, refuse_locking
from gudgeon.pipeline.reduction.acting import Acting, assembled, stacked
from gudgeon.pipeline.reduction.couplings import (
    bears_stress,
    centrifugal_loads,
    has_floating_frame,
    inertia_couplings,
    stress_stiffness,
    weights_along,
)
from gudgeon.pipeline.reduction.gauges import GaugeRows, gauge_modes
from gudgeon.pipeline.reduction.methods import REDUCTIONS, ContactRows, Method, Reduction
from gudgeon.pipeline.reduction.methods.reduction import reference_reaction
from gudgeon.pipeline.reduction.methods.swapped import Crossed, swapped
from gudgeon.pipeline.reduction.responses import compliance_errors, static_responses
from gudgeon.pipeline.scenes.component import Component


def reduce_component(
    mesh: MeshRecord,
    mesh_key: str,
    component: Component,
    name: str,
    rubbed: Collection[str] = (),
    pulled: Sequence[tuple[float, ...]] = (),
    *,
    turns: bool = False,
    crossed: tuple[str, float] | None = None,
    held: Collection[str] = (),
    stressed: bool = False,
    method: Method | None = None,
) -> ModalRecord:
    """Assemble a component and reduce it to a modal record.

    Args:
        name: The component's name in the scene, for messages.
        rubbed: Interfaces on which friction acts: they get tangential rows.
        pulled: Unit vectors along which gravity acts on a held component: it gets the static shapes that modes lack.
        turns: Whether bodies of it turn by any angle: they need all tensors of the floating frame.
        crossed: Traction space that a moving force crosses, and where across [m]; it gets the bases of `modes.swap`.
        held: Interfaces that motions and other forces hold: their static shapes have mass, and do not move by R.
        stressed: Whether loads or weight stress bodies of it in small motion: its loads get their stiffness by stress.
        method: Takes the place of the reduction that the component names.

    Raises:
        InputError: an interface or a support does not fit the mesh, or the mesh is inverted.
        StageError: the reduction failed its own checks.
    """
    sites, acting, (model, tied, spread) = assembled(mesh, component, scene_key := f"component.{name}", rubbed)
    contact = replace(stacked(acting, spread, held), weights=spread.T @ weights_along(model, pulled))
    gauges = _gauges(model, spread, component, contact, scene_key)
    reduced = tied, contact, _reduced(tied, contact, component, method, scene_key)
    on_tied, swap = _swapped(reduced, component, sites, crossed, scene_key)
    reduction = replace(on_tied, Phi=spread @ on_tied.Phi)
    frequencies, supported = reduction.angular_frequencies, bool(model.held.any())
    responses = np.empty((len(model.held), 0)) if on_tied.responses is None else spread @ on_tied.responses
    static = static_responses(model, {key: a.forces for key, a in acting.items()}, responses)
    modes = {key: a.modes(reduction.Phi) for key, a in acting.items()}
    couplings = _coupled((model, tied, spread), on_tied.Phi, component, acting, modes, turns=turns)
    weight = _stressed((model, tied, spread), on_tied.Phi, component, acting, modes, requested=(stressed, bool(pulled)))
    turning = spread.T @ centrifugal_loads(model, component) if turns and has_floating_frame(model) else None
    errors = frequency_errors(tied, on_tied, model, spread, component)
    refuse_locking(errors.discretisation_errors, frequencies, component, scene_key,
                   lambda variant: reduce_component(mesh, mesh_key, variant, name).discretisation_errors)  # fmt: skip
    checked = compliance_errors(model, component, responses, static, _loads_of(acting)) | _patches(sites, mesh)
    return ModalRecord(
        mesh_key=mesh_key, reduction=component.modes.reduction, normal_count=reduction.normal_count,
        static_count=len(frequencies) - reduction.normal_count, angular_frequencies=frequencies,
        mass=model.properties.mass, centre=model.properties.centre, inertia=model.properties.inertia,
        rigid_twists=model.rigid_twists, shapes=model.nodal(reduction.Phi), inertia_couplings=couplings, swap=swap,
        interfaces=_of_kind(modes, InterfaceModes), tractions=_of_kind(modes, TractionModes),
        loads=_of_kind(modes, LoadModes), residual_flexibility=reduction.residual_flexibility,
        quality=reduction.quality | checked | {"rigid_motions": len(model.rigid_twists)},
        gauges=gauge_modes(component, gauges, tied, contact.B, on_tied, turning, weighs=bool(pulled) and supported),
        participation=_participation(model, reduction) if supported else None, weight_stiffness=weight,
        static_responses=static if static.columns and cell_of(model.mesh).solid else None,
        interface_rows=dict(contact.spans), tangential_spans=dict(contact.tangential_spans), **vars(errors),
    )  # fmt: skip


def truncated_displacement(
    mesh: MeshRecord, component: Component, name: str, modal: ModalRecord
) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function of the forces on the rows of R, (C,): what kept modes lack of the static nodal displacement
    [m], (n, 3), (G − Φ Λ⁻¹ Φᵀ) Bᵀ f, of which R f is what the rows read.

    Args:
        name: The component's name in the scene, for messages.
        modal: Its modes, with their shapes, interfaces and frequencies.
    """
    _, acting, (model, tied, spread) = assembled(mesh, component, f"component.{name}", list(modal.tangential_spans))
    B, flexibility = stacked(acting, spread).B, Flexibility(tied)
    shapes, Lambda = modal.shapes, modal.angular_frequencies**2
    assert shapes is not None
    rows = np.zeros((modal.row_count, len(Lambda)))
    for key, item in {**modal.interfaces, **modal.tractions, **modal.loads}.items():
        rows[slice(*modal.interface_rows[key])] = item.rows

    def displacement(forces: np.ndarray) -> np.ndarray:
        static = model.nodal(spread @ flexibility.solve((B.T @ forces)[:, None]))[:, :, 0]
        return static - shapes @ ((rows.T @ forces) / Lambda)

    return displacement


def _loads_of(acting: Mapping[str, Acting]) -> set[str]:
    """Return the names of the interfaces that are loads."""
    return {key for key, item in acting.items() if isinstance(item.at, LoadRows)}


def _of_kind(modes: Mapping[str, Any], kind: type) -> dict[str, Any]:
    """Return the records of one kind among those of the interfaces."""
    return {name: record for name, record in modes.items() if isinstance(record, kind)}


def _swapped(
    reduced: tuple[FEModel, ContactRows, Reduction],
    component: Component,
    sites: Mapping[str, ContactPoints | TractionSpace | Tie],
    crossed: tuple[str, float] | None,
    scene_key: str,
) -> tuple[Reduction, SwapModes | None]:
    """Return a reduction of a model and rows with the bases of the places of a force, if it is to have them."""
    if component.modes.swap is None or crossed is None:
        return reduced[2], None
    space = sites[crossed[0]]
    assert isinstance(space, TractionSpace)
    try:
        return swapped(*reduced, component.modes.swap, Crossed(crossed[0], space, crossed[1]))
    except InputError as error:
        raise InputError(f"{scene_key}.{error}") from None
    except StageError as error:
        raise StageError(f"{scene_key}: {error}") from error


def _gauges(
    model: FEModel, spread: sparse.csr_matrix, component: Component, contact: ContactRows, scene_key: str
) -> GaugeRows:
    """Return the rows of all gauges over the dofs that `spread` keeps."""
    kinds = gauge_rows(model, component, scene_key), body_force_rows(model, component, scene_key)
    gauges = GaugeRows(*({key: sparse.csr_matrix(S @ spread) for key, S in rows.items()} for rows in kinds))
    refuse_large(gauges.values, contact.B.shape[0], scene_key)
    return gauges


def _patches(sites: Mapping[str, ContactPoints | TractionSpace | Tie], mesh: MeshRecord) -> dict[str, Any]:
    """Return the errors of the mesh's volume and inertia, and of each patch how many functions it has, how many find no
    surface, and how far nodes are off it [m]."""
    spaces = {name: s for name, s in sites.items() if isinstance(s, TractionSpace)}
    patches = {
        name: {"functions": s.size, "dropped": s.dropped, "off": s.off, "spacing": s.spacing.tolist()}
        for name, s in spaces.items()
        if s.chart["kind"] == "patch"
    }
    errors = shape_errors(mesh)
    return {VOLUME_ERROR: errors.volume, INERTIA_ERROR: errors.inertia} | ({"patches": patches} if patches else {})


def _coupled(
    models: tuple[FEModel, FEModel, sparse.csr_matrix],
    shapes: np.ndarray,
    component: Component,
    acting: dict[str, Acting],
    modes: dict[str, InterfaceModes | TractionModes | LoadModes],
    *,
    turns: bool,
) -> InertiaCouplings | None:
    """Return the tensors of the floating frame, and give the loads among `modes` their stiffness by stress."""
    loads = _of_kind(modes, LoadModes)
    rows = [sparse.csr_matrix((0, models[2].shape[0])), *(acting[key].rows for key in loads)]
    pulls = sparse.csr_matrix(sparse.vstack(rows, format="csr"))
    couplings, stiffness = inertia_couplings(*models, shapes, component, moments=turns, loads=pulls)
    if len(stiffness):
        ends = np.cumsum([acting[key].rows.shape[0] for key in loads])[:-1]
        for (key, load), load_stiffness in zip(loads.items(), np.split(stiffness, ends), strict=True):
            modes[key] = replace(load, stress_stiffness=load_stiffness)
    return couplings


def _stressed(
    models: tuple[FEModel, FEModel, sparse.csr_matrix],
    shapes: np.ndarray,
    component: Component,
    acting: dict[str, Acting],
    modes: dict[str, InterfaceModes | TractionModes | LoadModes],
    *,
    requested: tuple[bool, bool],
) -> np.ndarray | None:
    """Give the means and ties among `modes` their stiffness by stress; return that of unit gravity along x, y, z on
    what supports hold, (3, m + 3, m + 3), None where it does not weigh.

    Args:
        requested: Whether any of it is requested, and whether the component weighs.
    """
    stressed, weighs = requested
    if not stressed or not bears_stress(models[0], component):
        return None
    pulled = {key: acting[key].rows for key, load in _of_kind(modes, LoadModes).items() if load.unit != "Pa"}
    if not pulled and not weighs:
        return None
    weights = (
        weights_along(models[0], [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
        if weighs
        else np.empty((len(models[0].held), 0))
    )
    forces = np.column_stack([weights, *(rows.T.toarray() for rows in pulled.values())])
    K, _ = stress_stiffness(*models, shapes, component, forces)
    start = weights.shape[1]
    for key, rows in pulled.items():
        modes[key] = replace(modes[key], stress_stiffness=K[start : start + rows.shape[0]])
        start += rows.shape[0]
    return K[: weights.shape[1]] if weighs else None


def _reduced(
    model: FEModel, contact: ContactRows, component: Component, method: Method | None, scene_key: str
) -> Reduction:
    """Run the reduction, and evaluate the reaction at the reference surface if one is given."""
    settings = component.modes
    if settings.reduction != "rigid" and settings.normal_count > (limit := largest_count(model)):
        raise InputError(
            f"{scene_key}.modes.normal_count: {settings.normal_count} given, its mesh has {max(limit, 0)} at most;"
            " refine the mesh or request fewer modes"
        )
    reference = None
    if settings.reference is not None:
        reference = surface_nodes(model.mesh, settings.reference, f"{scene_key}.modes.reference")
    try:
        reduction = (method or REDUCTIONS[settings.reduction])(model, contact, settings)
    except InputError as error:
        raise InputError(f"{scene_key}.{error}") from None
    except StageError as error:
        raise StageError(f"{scene_key}: {error}") from error
    if reference is None or not len(reduction.angular_frequencies):
        return reduction
    reaction = reference_reaction(model, reduction, reference)
    return replace(reduction, quality=reduction.quality | {"reference_reaction": reaction})


def _participation(model: FEModel, reduction: Reduction) -> np.ndarray:
    """Return Tᵀ M Φ [kg^½], T the unit translations, (3, m); held dofs do not move."""
    return model.directions.T @ model.by_node(model.M @ reduction.Phi).sum(axis=0)
