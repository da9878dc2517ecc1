"""Contacts with `interface = "auto"`: surfaces of two bodies that face each other nearby become their interfaces.

Parts are meshed first, unless their meshes are in the database.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.drafts.facets import Boundary, Near, apart, near
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.base import Place
from gudgeon.pipeline.stages.keys.products import mesh_product
from gudgeon.pipeline.stages.make import keep
from gudgeon.pipeline.stages.mesh import build_mesh
from gudgeon.solver.scene.body import Body
from gudgeon.solver.scene.contact import AUTO

SHARE = 0.05
"""Of the smaller part's largest extent: the distance within which surfaces are taken, by default."""


def with_found(place: Place) -> tuple[Place, tuple[str, ...]]:
    """Return a scene whose contacts name the interfaces that are found, and a line for each of them.

    Raises:
        InputError: `auto` does not fit a contact, or nothing faces the other body nearby.
        StageError: gmsh failed.
    """
    contacts = place.tables.get("contact")
    names = [name for name, contact in contacts.items() if _is_auto(contact)] if isinstance(contacts, dict) else []
    try:
        components = TypeAdapter(dict[str, Component]).validate_python(place.tables.get("component", {}))
        bodies = TypeAdapter(dict[str, Body]).validate_python(place.tables.get("body", {}))
    except ValidationError:
        return place, ()  # The check of the whole scene lists all mistakes.
    tables, lines = dict(place.tables), list[str]()
    with named(place.path, InputError, StageError):
        for name in names:
            sides = _sides(name, tables["contact"][name], bodies, components)
            tables, notes = _resolved(place, tables, name, sides, (components, bodies))
            lines += notes
    return replace(place, tables=tables), tuple(lines)


def _is_auto(contact: Any) -> bool:
    against = contact.get("against") if isinstance(contact, dict) else None
    partner = against.get("interface") if isinstance(against, dict) else None
    return isinstance(contact, dict) and AUTO in (contact.get("interface"), partner)


def _sides(
    name: str, contact: Mapping[str, Any], bodies: Mapping[str, Body], components: Mapping[str, Component]
) -> tuple[tuple[str, str | None], tuple[str, str | None]]:
    """Return body and interface of both sides of a contact; None for an interface that is to be found."""
    against = contact.get("against")
    if not isinstance(against, dict) or against.get("shape") not in ("body", "surface"):
        raise InputError(
            f"contact.{name}.interface: 'auto' given; it finds surfaces of two bodies that face each other, so"
            " against.shape must be 'body'; name the interface that meets an obstacle"
        )
    sides = []
    for key, side in (("", contact), (".against", against)):
        body, interface = str(side.get("body")), str(side.get("interface"))
        if body not in bodies:
            raise InputError(f"contact.{name}{key}.body: no body '{body}', the scene has {', '.join(bodies)}")
        component = bodies[body].component or body
        if component not in components:
            raise InputError(
                f"body.{body}.component: no component '{component}'; the scene has {', '.join(components)}"
            )
        if interface != AUTO and interface not in components[component].interface:
            have = ", ".join(components[component].interface) or "none"
            raise InputError(f"contact.{name}{key}.interface: no interface '{interface}', the component has {have}")
        sides.append((body, None if interface == AUTO else interface))
    if sides[0][0] == sides[1][0]:
        raise InputError(
            f"contact.{name}.interface: 'auto' finds surfaces of two different bodies; name both interfaces"
            " of a body that meets itself"
        )
    return sides[0], sides[1]


def _resolved(
    place: Place,
    tables: dict[str, Any],
    name: str,
    sides: tuple[tuple[str, str | None], tuple[str, str | None]],
    models: tuple[Mapping[str, Component], Mapping[str, Body]],
) -> tuple[dict[str, Any], list[str]]:
    """Return the tables with the contacts that stand for one with `auto`, and what is found."""
    models_by_name, bodies = models
    meshes = [_mesh(place, bodies[body].component or body, models_by_name) for body, _ in sides]
    contact = dict(tables["contact"][name])
    within = contact.pop("within", None)
    if within is None:
        within = SHARE * min(float(np.ptp(mesh.nodes, axis=0).max()) for mesh in meshes)
    boundaries = [
        _boundary(mesh, bodies[body], models_by_name[bodies[body].component or body], interface)
        for mesh, (body, interface) in zip(meshes, sides, strict=True)
    ]
    pairs = near(boundaries[0], boundaries[1], within)
    if not pairs:
        distance = apart(boundaries[0], boundaries[1])
        facing = f"the nearest ones are {distance:.3g} m apart" if np.isfinite(distance) else "none do at any distance"
        raise InputError(
            f"contact.{name}.interface: no named surfaces of '{sides[0][0]}' and '{sides[1][0]}' face each other within"
            f" {within:.3g} m; {facing}; give within [m], move the bodies, or name the interfaces"
        )
    contacts, components, lines = dict(tables["contact"]), dict(tables["component"]), list[str]()
    del contacts[name]
    for i, pair in enumerate(pairs):
        contact_name = name if len(pairs) == 1 else f"{name}-{i + 1}"
        interfaces = []
        for (body, interface_name), surface in zip(sides, (pair.own, pair.other), strict=True):
            component = bodies[body].component or body
            components[component], interface = _with_interface(components[component], interface_name, surface)
            interfaces.append(interface)
        against = dict(contact["against"]) | {"shape": "body", "interface": interfaces[1]}
        contacts[contact_name] = contact | {"interface": interfaces[0], "against": against}
        lines.append(_line(contact_name, sides, pair, within))
    return tables | {"contact": contacts, "component": components}, lines


def _line(name: str, sides: tuple[tuple[str, Any], tuple[str, Any]], pair: Near, within: float) -> str:
    low, high = (f"{1e3 * gap:.3g}" for gap in pair.gaps)
    return (
        f"contact.{name}: '{pair.own}' of {sides[0][0]} ({pair.facets[0]} facets) and '{pair.other}' of {sides[1][0]}"
        f" ({pair.facets[1]} facets) were found, {low} to {high} mm apart; within {1e3 * within:.3g} mm"
    )


def _mesh(place: Place, component: str, components: Mapping[str, Component]) -> MeshRecord:
    """Return the mesh of a part, made where the database has none."""
    product = mesh_product(component, components[component], place.path.parent)
    if not place.store.has(product.key):
        keep(place.store, product, build_mesh(components[component], place.path.parent, component))
    mesh: MeshRecord = place.store.get(product.key, "mesh")
    return mesh


def _boundary(mesh: MeshRecord, body: Body, component: Component, interface: str | None) -> Boundary:
    """Return the boundary of a body, or only the surface of an interface."""
    if interface is not None:
        surface_name = component.interface[interface].surface
        mesh = replace(
            mesh, surfaces={name: surface for name, surface in mesh.surfaces.items() if name == surface_name}
        )
    turn = np.eye(3) if body.orientation is None else body.orientation.matrix()
    return Boundary.of(mesh, turn, np.asarray(body.position))


def _with_interface(component: dict[str, Any], interface: str | None, surface: str) -> tuple[dict[str, Any], str]:
    """Return a component with an interface of contact points on a surface, and its name."""
    interfaces = dict(component.get("interface", {}))
    if interface is not None:
        return component, interface
    for name, table in interfaces.items():
        if (
            table.get("surface") == surface
            and table.keys() <= {"surface", "kind"}
            and table.get("kind", "points") == "points"
        ):
            return component, name
    name = surface if surface not in interfaces else f"{surface}-{AUTO}"
    return component | {"interface": interfaces | {name: {"surface": surface}}}, name
