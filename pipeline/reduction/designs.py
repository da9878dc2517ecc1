"""Reduction of a design from stored ones of the same mesh: what a process keeps of these, and which parts it is for."""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.design_change.family import Family
from gudgeon.pipeline.design_change.projection import Target
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.reduction.acting import assembled, stacked
from gudgeon.pipeline.reduction.couplings import weights_along
from gudgeon.pipeline.reduction.methods import Method
from gudgeon.pipeline.reduction.methods.carried import carried_macneal, spans_of, target_of
from gudgeon.pipeline.scenes.component import Component

KEPT = 2
"""Families that a process keeps: all designs of a study have the same one for each component."""
_FAMILIES: OrderedDict[tuple[Any, ...], Family] = OrderedDict()


def method_of(
    store: Store, stored: Sequence[tuple[str, str]], component: Component, name: str, **requested: Any
) -> Method:
    """Return the reduction of a component from stored designs, which are in the database.

    Args:
        stored: Keys of the mesh and of the modes of each stored design.
        name: The component's name in the scene, for messages.
        requested: See `reduce_component`.

    Raises:
        InputError: the part is not one whose displacements can be carried over.
    """
    members, base = family_of(store, stored, component, name, **requested)
    return carried_macneal(members, base, [keys[1] for keys in stored], component.change.tolerance)


def family_of(
    store: Store, stored: Sequence[tuple[str, str]], component: Component, name: str, **requested: Any
) -> tuple[Family, ModalRecord]:
    """Return the stored designs of a component as a family, and the modes of the first; see `method_of`."""
    base = store.get(stored[0][1], "modes")

    def family() -> Family:
        records = [base, *(store.get(keys[1], "modes") for keys in stored[1:])]
        refuse_unlike(records, f"component.{name}.change.designs")
        assert component.material is not None
        pairs = zip(stored, component.stored_designs, strict=True)
        targets = [body_of(store.get(keys[0], "mesh"), design, name, **requested) for keys, design in pairs]
        return Family(targets, records, component.material)

    keys = (store.location, *stored)
    members = _FAMILIES.get(keys) or family()
    _FAMILIES[keys] = members
    _FAMILIES.move_to_end(keys)
    while len(_FAMILIES) > KEPT:
        _FAMILIES.popitem(last=False)
    return members, base


def refuse_unlike(records: Sequence[ModalRecord], scene_key: str) -> None:
    """Raise an InputError where stored designs have other contact points, or functions of them, than the first."""
    for k, record in enumerate(records):
        if spans_of(record) != spans_of(records[0]):
            raise InputError(
                f"{scene_key}: design {k + 1} has {record.row_count} rows of interfaces, the first one"
                f" {records[0].row_count}: it moves contact points across an edge of their sector; leave it out"
            )


def body_of(mesh: MeshRecord, design: Component, name: str, **requested: Any) -> Target:
    """Return the body of a design on its mesh; see `method_of`."""
    scene_key = f"component.{name}"
    if not cell_of(mesh).solid or "incompatible" in mesh.formulations or mesh.attachments or mesh.relations:
        raise InputError(
            f"{scene_key}.change.update: 'certified' given; allowed for solids without incompatible modes, and without"
            " masses, couplings, springs and ties of a deck; use 'recompute'"
        )
    _, acting, (model, tied, spread) = assembled(mesh, design, scene_key, requested["rubbed"])
    if tied is not model:
        raise InputError(f"{scene_key}.change.update: 'certified' given; allowed without rigid ties; use 'recompute'")
    rows = stacked(acting, spread, requested["held"])
    rows = replace(rows, weights=spread.T @ weights_along(model, requested["pulled"]))
    return target_of(tied, rows, design.modes.normal_count)
