"""A component beside the value of one of its keys: what is assembled there, and its records to first order."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, TypeVar, cast

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.modaldb.records.modes import InterfaceModes, LoadModes, ModalRecord, MorphRecord
from gudgeon.pipeline.design_change.morph import moved_mesh, own_modes
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.acting import Acting, assembled, stacked
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.sensitivity.modal import Assembled, ModalDerivative, modal_derivative, refuse_unlike
from gudgeon.pipeline.sensitivity.parameters import Parameter, item_of, moved_by
from gudgeon.pipeline.sensitivity.shape_velocity import moved_surfaces, shape_velocity
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.mesh import build_mesh, movement_of
from gudgeon.solver.sensitivity.adjoint import WEIGHTS, difference

VARIED = ("material", "geometry", "masses", "change.profile.offset", "change.profile.scale")
"""Beginnings of keys of a component with a derivative."""
REDUCTION = "macneal"
ASSEMBLY_STEP = 2e-3
"""Step of differences of assembled matrices over the value of a key: short ones lose digits."""
OFFSET_STEP = 1e-4
"""Step of an offset that is zero, over the extent of the part."""
T = TypeVar("T")


@dataclass(frozen=True)
class Designs:
    """Records of a component at its value and beside it, of a parameter."""

    base: tuple[ModalRecord, MorphRecord] | None
    """At its value, where not those of the database."""
    beside: dict[int, tuple[ModalRecord, MorphRecord]]
    """At multiples of the step, those of `WEIGHTS`."""
    frequencies: np.ndarray
    """Derivatives of the normal modes' frequencies [rad/s per unit], (m,)."""


def designs_beside(job: Job, parameter: Parameter) -> Designs:
    """Return the records of a component beside the value of one of its keys.

    Raises:
        InputError: no derivative is found by this key.
    """
    key, name = parameter.key, parameter.component
    assert name is not None
    component, component_key = job.scene.component[name], key.removeprefix(f"component.{name}.")
    if component.geometry.kind == "rigid":
        return _rigid(job, parameter)
    if not component_key.startswith(VARIED):
        raise InputError(f"{key}: no derivative is found by this key; allowed: {', '.join(VARIED)}")
    _refuse_kept_modes(job, name, component_key)
    mesh, modal = job.record(name, "mesh"), job.record(name)
    if component.modes.reduction != REDUCTION or modal.static_count or modal.tractions:
        raise InputError(
            f"component.{name}.modes.reduction: '{component.modes.reduction}' given; derivatives are found of"
            f" '{REDUCTION}' without static shapes and traction spaces"
        )
    step = _assembly_step(parameter, mesh)
    components = {k: component_at(job, name, key, parameter.value + k * step) for k in WEIGHTS}
    meshes = meshes_beside(job, name, key, mesh, components)
    rubbed = job.scene.reduced_with(name)["rubbed"]

    def made(of: MeshRecord, varied_component: Component) -> tuple[dict[str, Acting], FEModel, Assembled]:
        _, acting, (model, tied, spread) = assembled(of, varied_component, f"component.{name}", rubbed)
        refuse_unlike(model, spread, key)
        return acting, model, Assembled(tied, stacked(acting, spread).B)

    _, base_model, base = made(mesh, component)
    assert modal.shapes is not None
    Phi = np.einsum("nik,di->ndk", modal.shapes, base_model.directions).reshape(len(base_model.held), -1)
    beside = {k: made(meshes[k], varied_component) for k, varied_component in components.items()}
    only = {k: member for k, (_, _, member) in beside.items()}
    derivative = modal_derivative(base, only, step, modal.angular_frequencies, Phi)
    turned = not np.array_equal(derivative.turn, np.eye(len(derivative.turn)))
    at_value = _turned(modal, derivative.turn) if turned else modal
    stepped = {
        k: _record(at_value, derivative, Phi @ derivative.turn, (acting, model), k * step)
        for k, (acting, model, _) in beside.items()
    }
    keys = (job.components()[name]["mesh"].key, job.components()[name]["modes"].key)
    plain = replace(at_value, shapes=None, static_responses=None)
    records = {k: moved_along(plain, stepped, step, k * parameter.step) for k in WEIGHTS}
    return Designs(
        (at_value, own_modes(*keys, at_value, "none")) if turned else None,
        {k: (record, own_modes(*keys, record, "none")) for k, record in records.items()},
        derivative.frequencies,
    )


def moved_along(base: T, stepped: Mapping[int, T], step: float, moved: float) -> T:
    """Return a record, or a part of one, moved along its derivative with respect to a parameter.

    Args:
        base: At the value of the parameter.
        stepped: The same at multiples of a step, those of `WEIGHTS`.
        step, moved: Step and change of the parameter.
    """
    if isinstance(base, float) or (isinstance(base, np.ndarray) and base.dtype.kind == "f"):
        return base + moved * difference(stepped, step)  # type: ignore[return-value]
    if isinstance(base, dict):
        members = cast("Mapping[int, Mapping[str, Any]]", stepped)
        return {
            n: moved_along(member, {k: of[n] for k, of in members.items()}, step, moved) for n, member in base.items()
        }  # type: ignore[return-value]
    if not is_dataclass(base):
        return base
    changed = {
        entry.name: moved_along(
            getattr(base, entry.name), {k: getattr(of, entry.name) for k, of in stepped.items()}, step, moved
        )
        for entry in fields(base)
    }
    return replace(base, **changed)  # type: ignore[type-var,return-value]


def component_at(job: Job, name: str, key: str, value: float) -> Component:
    """Return a component with another value of a key."""
    component: Component = variant(job, moved_by(job.scene, key, value)).scene.component[name]
    return component


def _assembly_step(parameter: Parameter, mesh: MeshRecord) -> float:
    """Return the step of differences of assembled matrices, of which short ones leave no digits."""
    extent = float(np.ptp(mesh.nodes, axis=0).max())
    return abs(parameter.value) * ASSEMBLY_STEP or OFFSET_STEP * extent


def _refuse_kept_modes(job: Job, name: str, component_key: str) -> None:
    """Raise an InputError where the modes of a component are not those of its moved mesh."""
    change = job.scene.component[name].change
    moves = component_key.startswith("change") or movement_of(job.scene.component[name], job.folder, name) is not None
    if moves and change.update != "recompute":
        raise InputError(
            f"component.{name}.change.update: '{change.update}' given; derivatives are those of new modes, use"
            " 'recompute'"
        )
    if moves and component_key.startswith("geometry"):
        raise InputError(
            f"component.{name}.change: a shape and its profile are not varied together; remove the profile"
        )


def _rigid(job: Job, parameter: Parameter) -> Designs:
    """Return the records of a rigid body, which are made at once."""
    name = parameter.component
    assert name is not None
    keys = (job.components()[name]["mesh"].key, job.components()[name]["modes"].key)
    records = {}
    for k in WEIGHTS:
        varied_component = component_at(job, name, parameter.key, parameter.value + k * parameter.step)
        mesh = build_mesh(varied_component, job.folder, name)
        records[k] = reduce_component(mesh, keys[0], varied_component, name, **job.scene.reduced_with(name))
    return Designs(None, {k: (record, own_modes(*keys, record, "none")) for k, record in records.items()}, np.empty(0))


def meshes_beside(
    job: Job, name: str, key: str, mesh: MeshRecord, components: Mapping[int, Component]
) -> dict[int, MeshRecord]:
    """Return the mesh of a component beside the value of a key, with its elements."""
    component_key, component = key.removeprefix(f"component.{name}."), job.scene.component[name]
    if component_key.startswith("change"):
        unmoved = job.store.get(job.components()[name]["base-mesh"].key, "mesh")
        movements = {k: movement_of(varied_component, job.folder, name) for k, varied_component in components.items()}
        return {k: unmoved if member is None else moved_mesh(unmoved, member) for k, member in movements.items()}
    if not component_key.startswith("geometry"):
        return dict.fromkeys(components, mesh)
    if component.geometry.kind == "bar":
        return {k: _scaled_bar(component, varied_component, job, name) for k, varied_component in components.items()}
    if component.path is not None:
        raise InputError(f"{key}: shapes are varied of built-in geometries, not of files")
    value = float(item_of(component, component_key))
    low, high = (component_at(job, name, key, value * (1 + side * ASSEMBLY_STEP)) for side in (-1, 1))
    behind, ahead = (build_mesh(varied_component, job.folder, name) for varied_component in (low, high))
    value_difference = 2 * value * ASSEMBLY_STEP
    velocity = shape_velocity(mesh, ahead, behind, value_difference, key)
    meshes = {}
    for k, varied_component in components.items():
        moved = float(item_of(varied_component, component_key)) - value
        shapes = moved_surfaces(mesh, ahead, behind, 2 * moved / value_difference)
        surfaces = {n: Surface(s.facets, shapes[n]) for n, s in mesh.surfaces.items()}
        meshes[k] = replace(mesh, nodes=mesh.nodes + moved * velocity, surfaces=mesh.surfaces | surfaces)
    return meshes


def _scaled_bar(component: Component, varied_component: Component, job: Job, name: str) -> MeshRecord:
    """Return the mesh of a bar with as many elements as it has at its value."""
    size = component.mesh.size
    assert size is not None
    scaled = size * varied_component.geometry.length / component.geometry.length  # type: ignore[union-attr]
    return build_mesh(
        varied_component.model_copy(update={"mesh": varied_component.mesh.model_copy(update={"size": scaled})}),
        job.folder,
        name,
    )


def _turned(modal: ModalRecord, turn: np.ndarray) -> ModalRecord:
    """Return a record over other combinations of modes with equal frequencies."""

    def rows(of: T) -> T:
        return replace(of, rows=of.rows @ turn)  # type: ignore[type-var,attr-defined]

    assert modal.shapes is not None
    return replace(
        modal, shapes=modal.shapes @ turn, interfaces={n: rows(member) for n, member in modal.interfaces.items()},
        loads={n: rows(member) for n, member in modal.loads.items()},
        participation=None if modal.participation is None else modal.participation @ turn,
    )  # fmt: skip


def _aligned(model: FEModel, twists: np.ndarray) -> np.ndarray:
    """Return the rigid motions of a model in those combinations that are nearest to others, (r, 6)."""
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = model.properties.mass * np.eye(3), model.properties.inertia
    left_vectors, _, right_vectors = np.linalg.svd(twists @ mass @ model.rigid_twists.T)
    aligned: np.ndarray = left_vectors @ right_vectors @ model.rigid_twists
    return aligned


def _record(
    modal: ModalRecord,
    derivative: ModalDerivative,
    Phi: np.ndarray,
    beside: tuple[dict[str, Acting], FEModel],
    moved: float,
) -> ModalRecord:
    """Return a record to first order in a parameter.

    Args:
        Phi: Modes at its value, (dofs, m).
        beside: What acts on the component there, and its model.
        moved: Change of the parameter.
    """
    (acting, model), shapes = beside, Phi + moved * derivative.shapes
    modes = {name: member.modes(shapes) for name, member in acting.items()}
    R, participation = modal.residual_flexibility, modal.participation
    if participation is not None:
        participation = model.directions.T @ model.by_node(model.M @ shapes).sum(axis=0)
    return replace(
        modal, angular_frequencies=modal.angular_frequencies + moved * derivative.frequencies,
        mass=model.properties.mass, centre=model.properties.centre, inertia=model.properties.inertia,
        rigid_twists=_aligned(model, modal.rigid_twists), shapes=None, static_responses=None,
        interfaces={n: member for n, member in modes.items() if isinstance(member, InterfaceModes)},
        loads={n: member for n, member in modes.items() if isinstance(member, LoadModes)},
        residual_flexibility=None if R is None else R + moved * derivative.residual, participation=participation,
    )  # fmt: skip
