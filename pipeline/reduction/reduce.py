"""The modes stage: mesh and component in, ModalRecord out."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import linalg, sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import (
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
from gudgeon.pipeline.interfaces.loads import LoadRows, load_rows
from gudgeon.pipeline.interfaces.patch import POINT_FINDERS, normal_rows
from gudgeon.pipeline.interfaces.point_mass import component_model
from gudgeon.pipeline.interfaces.points import ContactPoints, surface_coordinates
from gudgeon.pipeline.interfaces.tangential import TangentialRows, rows_across
from gudgeon.pipeline.interfaces.tie import Tie, made_rigid, tie_of, tie_rows
from gudgeon.pipeline.interfaces.traction_space import TractionSpace, refuse_too_many, refuse_unresolved, traction_space
from gudgeon.pipeline.modes.normal import largest_count
from gudgeon.pipeline.modes.static import pressure_fields
from gudgeon.pipeline.reduction.accuracy import frequency_errors, refuse_locking
from gudgeon.pipeline.reduction.couplings import centrifugal_loads, has_floating_frame, inertia_couplings
from gudgeon.pipeline.reduction.gauges import GaugeRows, gauge_modes
from gudgeon.pipeline.reduction.methods import REDUCTIONS, ContactRows, Reduction
from gudgeon.pipeline.reduction.methods.reduction import reference_reaction
from gudgeon.pipeline.reduction.methods.swapped import Crossed, swapped
from gudgeon.pipeline.reduction.responses import SMOOTH, compliance_errors, static_responses
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface

PLACE_FINDERS = POINT_FINDERS | {"traction": traction_space, "tie": tie_of}
"""What is found on the mesh before matrices are assembled, by the kind of an interface; other kinds are loads."""


@dataclass(frozen=True)
class _Acting:
    """An interface of a component on its mesh."""

    at: ContactPoints | TractionSpace | LoadRows
    rows: sparse.csr_matrix
    """Its rows of B, (r, dofs)."""
    fields: np.ndarray
    """Forces of the pressure fields that get a static shape, (r, k)."""
    smooth: np.ndarray
    """Forces of smooth pressures, (r, SMOOTH) or fewer; (r, 0) of a load."""
    tangential: TangentialRows | None = None
    """Where friction acts."""

    @property
    def forces(self) -> np.ndarray:
        """Nodal forces of the smooth pressures, (dofs, k)."""
        return self.rows.T @ self.smooth

    def modes(self, Phi: np.ndarray) -> InterfaceModes | TractionModes | LoadModes:
        """Return its record with the displacements per coordinate of shapes (dofs, m)."""
        found = self.at.modes(self.rows @ Phi)
        if self.tangential is None or isinstance(found, LoadModes):
            return found
        return self.tangential.added(found, Phi)


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
) -> ModalRecord:
    """Assemble a component and reduce it to a modal record.

    Args:
        name: The component's name in the scene, for messages.
        rubbed: Interfaces on which friction acts: they get tangential rows.
        pulled: Unit vectors along which gravity acts on a held component: it gets the static shapes that modes lack.
        turns: Whether bodies of it turn by any angle: they need all tensors of the floating frame.
        crossed: Traction space that a moving force crosses, and where across [m]; it gets the bases of `modes.swap`.

    Raises:
        InputError: an interface or a support does not fit the mesh, or the mesh is inverted.
        StageError: the reduction failed its own checks.
    """
    where = f"component.{name}"
    places = _places(mesh, component, f"{where}.interface")
    model = component_model(mesh, component, where)
    acting = _acting(places, component, model, rubbed, f"{where}.interface")
    rigid = {key: tie for key, tie in places.items() if isinstance(tie, Tie) and component.interface[key].tie == "rbe2"}
    tied, spread = made_rigid(model, rigid, f"{where}.interface")
    contact = replace(_stacked(acting, spread), weights=spread.T @ _weights(model, pulled))
    gauges = _gauges(model, spread, component, contact, where)
    own, swap = _swapped((tied, contact, _reduced(tied, contact, component, where)), component, places, crossed, where)
    reduction = replace(own, Phi=spread @ own.Phi)
    responses = np.empty((len(model.held), 0)) if own.responses is None else spread @ own.responses
    static = static_responses(model, {key: one.forces for key, one in acting.items()}, responses)
    modes = {key: one.modes(reduction.Phi) for key, one in acting.items()}
    couplings = _coupled((model, tied, spread), own.Phi, component, acting, modes, turns=turns)
    turning = spread.T @ centrifugal_loads(model, component) if turns and has_floating_frame(model) else None
    errors = frequency_errors(tied, own, model, spread, component)
    refuse_locking(
        errors.discretisation_errors, own.angular_frequencies, component, where,
        lambda other: reduce_component(mesh, mesh_key, other, name).discretisation_errors,
    )  # fmt: skip
    checked = {"compliance_errors": compliance_errors(model, component, responses, static)} | _patches(places)
    return ModalRecord(
        mesh_key=mesh_key, reduction=component.modes.reduction, normal_count=reduction.normal_count,
        static_count=len(own.angular_frequencies) - own.normal_count, angular_frequencies=own.angular_frequencies,
        mass=model.properties.mass, centre=model.properties.centre, inertia=model.properties.inertia,
        rigid_twists=model.rigid_twists, shapes=model.nodal(reduction.Phi), inertia_couplings=couplings, swap=swap,
        interfaces={key: one for key, one in modes.items() if isinstance(one, InterfaceModes)},
        interface_rows=dict(contact.spans), residual_flexibility=reduction.residual_flexibility,
        participation=_participation(model, reduction) if model.held.any() else None,
        quality=reduction.quality | checked | {"rigid_motions": len(model.rigid_twists)},
        tractions={key: one for key, one in modes.items() if isinstance(one, TractionModes)},
        loads={key: one for key, one in modes.items() if isinstance(one, LoadModes)},
        gauges=gauge_modes(component, gauges, tied, contact.B, own, turning, weighs=bool(pulled and model.held.any())),
        static_responses=static if static.columns and cell_of(model.mesh).solid else None,
        tangential_spans=dict(contact.tangential_spans), **vars(errors),
    )  # fmt: skip


def _swapped(
    reduced: tuple[FEModel, ContactRows, Reduction],
    component: Component,
    places: Mapping[str, ContactPoints | TractionSpace | Tie],
    crossed: tuple[str, float] | None,
    where: str,
) -> tuple[Reduction, SwapModes | None]:
    """Return a reduction of a model and rows with the bases of the places of a force, if it is to have them."""
    if component.modes.swap is None or crossed is None:
        return reduced[2], None
    space = places[crossed[0]]
    assert isinstance(space, TractionSpace)
    try:
        return swapped(*reduced, component.modes.swap, Crossed(crossed[0], space, crossed[1]))
    except InputError as error:
        raise InputError(f"{where}.{error}") from None
    except StageError as error:
        raise StageError(f"{where}: {error}") from error


def _gauges(
    model: FEModel, spread: sparse.csr_matrix, component: Component, contact: ContactRows, where: str
) -> GaugeRows:
    """Return the rows of all gauges over the dofs that `spread` keeps."""
    kinds = gauge_rows(model, component, where), body_force_rows(model, component, where)
    found = GaugeRows(*({key: sparse.csr_matrix(S @ spread) for key, S in rows.items()} for rows in kinds))
    refuse_large(found.values, contact.B.shape[0], where)
    return found


def _patches(places: Mapping[str, ContactPoints | TractionSpace | Tie]) -> dict[str, Any]:
    """Return of each patch how many functions it has, how many find no surface, and how far nodes are off it [m]."""
    spaces = {name: one for name, one in places.items() if isinstance(one, TractionSpace)}
    found = {
        name: {"functions": one.size, "dropped": one.dropped, "off": one.off, "spacing": one.spacing.tolist()}
        for name, one in spaces.items()
        if one.chart["kind"] == "patch"
    }
    return {"patches": found} if found else {}


def _coupled(
    models: tuple[FEModel, FEModel, sparse.csr_matrix],
    shapes: np.ndarray,
    component: Component,
    acting: dict[str, _Acting],
    modes: dict[str, InterfaceModes | TractionModes | LoadModes],
    *,
    turns: bool,
) -> InertiaCouplings | None:
    """Return the tensors of the floating frame, and give the loads among `modes` their stiffness by stress."""
    loads = {key: one for key, one in modes.items() if isinstance(one, LoadModes)}
    rows = [sparse.csr_matrix((0, models[2].shape[0])), *(acting[key].rows for key in loads)]
    pulls = sparse.csr_matrix(sparse.vstack(rows, format="csr"))
    couplings, stiffness = inertia_couplings(*models, shapes, component, moments=turns, loads=pulls)
    if len(stiffness):
        ends = np.cumsum([acting[key].rows.shape[0] for key in loads])[:-1]
        for (key, load), part in zip(loads.items(), np.split(stiffness, ends), strict=True):
            modes[key] = replace(load, stress_stiffness=part)
    return couplings


def _reduced(model: FEModel, contact: ContactRows, component: Component, where: str) -> Reduction:
    """Run the reduction, and evaluate the reaction at the reference surface if one is given."""
    settings = component.modes
    if settings.reduction != "rigid" and settings.normal_count > (most := largest_count(model)):
        raise InputError(
            f"{where}.modes.normal_count: {settings.normal_count} given, its mesh has {max(most, 0)} at most;"
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


def _places(mesh: MeshRecord, component: Component, where: str) -> dict[str, ContactPoints | TractionSpace | Tie]:
    """Find the interfaces on the mesh, so that incorrect ones are refused before matrices are assembled."""
    found = {
        key: PLACE_FINDERS[interface.kind](mesh, interface, f"{where}.{key}")
        for key, interface in sorted(component.interface.items())
        if interface.kind in PLACE_FINDERS
    }
    tractions = {key: place for key, place in found.items() if isinstance(place, TractionSpace)}
    refuse_too_many(tractions, where)
    refuse_unresolved(tractions, where)
    return found


def _acting(
    places: Mapping[str, ContactPoints | TractionSpace | Tie],
    component: Component,
    model: FEModel,
    rubbed: Collection[str],
    where: str,
) -> dict[str, _Acting]:
    """Return the interfaces of a component on its model, by name in order; `where` is the key of all of them."""
    found = {}
    for name, interface in sorted(component.interface.items()):
        own = _on_model(places.get(name), interface, model, component.modes.static_count, f"{where}.{name}")
        if name in rubbed and isinstance(own.at, ContactPoints | TractionSpace):
            own = replace(own, tangential=rows_across(model, interface, own.at, f"{where}.{name}"))
        found[name] = own
    return found


def _on_model(
    place: ContactPoints | TractionSpace | Tie | None, interface: Interface, model: FEModel, count: int, where: str
) -> _Acting:
    """Return the rows of B of an interface; of a surface of contact `count` pressure fields and the smooth ones."""
    if isinstance(place, ContactPoints):
        rows = normal_rows(model, interface, place)
        if model.rotations.any() and not np.abs(rows.data).max(initial=0.0) > 0:
            raise InputError(
                f"{where}.surface: '{interface.surface}' given, the beam does not move along its normal; use"
                f" {interface.surface}-top or {interface.surface}-bottom"
            )
        coordinates = surface_coordinates(place.points, model.mesh.surfaces[interface.surface].shape)
    elif isinstance(place, TractionSpace):
        rows, coordinates = place.rows(model), place.centres
    else:
        load = tie_rows(model, place) if place else load_rows(model, interface, where)
        nothing = np.empty((load.B.shape[0], 0))
        return _Acting(load, load.B, nothing, nothing)
    fields, smooth = (pressure_fields(coordinates, place.areas, k) for k in (count, SMOOTH))
    return _Acting(place, rows, fields, smooth)


def _stacked(acting: dict[str, _Acting], spread: sparse.csr_matrix) -> ContactRows:
    """Return the rows of all interfaces as one matrix, then the tangential ones, over the dofs that `spread` keeps."""
    across = {name: one.tangential.B for name, one in acting.items() if one.tangential is not None}
    blocks = [*(one.rows for one in acting.values()), *across.values()]
    B = sparse.vstack([sparse.csr_matrix((0, spread.shape[0])), *blocks], format="csr")
    ends = [int(end) for end in np.cumsum([0, *(block.shape[0] for block in blocks)])]
    spans = [list(span) for span in pairwise(ends)]
    fields, smooth = (
        linalg.block_diag(
            np.empty((0, 0)),
            *(getattr(one, name) for one in acting.values()),
            np.empty((ends[-1] - ends[len(acting)], 0)),
        )
        for name in ("fields", "smooth")
    )
    return ContactRows(
        sparse.csr_matrix(B @ spread), fields, dict(zip(acting, spans, strict=False)), smooth,
        dict(zip(across, spans[len(acting) :], strict=True)),
    )  # fmt: skip


def _weights(model: FEModel, pulled: Sequence[tuple[float, ...]]) -> np.ndarray:
    """Return the weights under unit gravity along unit vectors [N s²/m], (dofs, k); none of a free model."""
    along = np.array(pulled, float).reshape(-1, 3) if model.held.any() else np.zeros((0, 3))
    return model.M @ np.tile(model.directions @ along.T, (len(model.nodes), 1))


def _participation(model: FEModel, reduction: Reduction) -> np.ndarray:
    """Return Tᵀ M Φ [kg^½], T the unit translations, (3, m); held dofs do not move."""
    momentum = (model.M @ reduction.Phi).reshape(len(model.nodes), len(model.directions), -1).sum(axis=0)
    return model.directions.T @ momentum
