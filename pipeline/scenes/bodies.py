"""A scene file of bodies in contact."""

from typing import Any

import numpy as np
from pydantic import Field, model_validator

from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.gauge import Sensor
from gudgeon.pipeline.scenes.report import Plot, Report
from gudgeon.pipeline.scenes.robustness import Robustness
from gudgeon.solver.numbers import Name
from gudgeon.solver.scene.oblique import oblique
from gudgeon.solver.scene.scene import Scene

CONTACT_KINDS = ("points", "patch")
"""Kinds of interface that have contact points."""
AXIS_DIGITS = 12
"""Digits of the direction of gravity by which modes are found again."""


class SceneFile(Scene):
    """A whole scene file."""

    component: dict[Name, Component] = Field(description="Parts, by name; a part may be placed as several bodies")
    sensor: dict[Name, Sensor] = Field(
        default={},
        description="Bodies whose strain gauges measure a wrench, by name: bridges, noise and so on",
    )
    report: Report = Report.model_construct()
    plot: Plot = Plot.model_construct()
    robustness: Robustness = Robustness.model_construct()

    @model_validator(mode="before")
    @classmethod
    def _surfaces_of_points(cls, raw: Any) -> Any:
        """Return the tables with `against.shape = "surface"` read as `"body"` where it names no traction space."""
        contacts = raw.get("contact") if isinstance(raw, dict) else None
        if not isinstance(contacts, dict):
            return raw
        found = {
            name: contact | {"against": contact["against"] | {"shape": "body"}}
            for name, contact in contacts.items()
            if isinstance(contact, dict) and _kind_against(raw, contact.get("against")) in CONTACT_KINDS
        }
        return raw | {"contact": contacts | found} if found else raw

    def rubbed_of(self, component: str) -> list[str]:
        """Return the interfaces of an elastic component that need tangential rows, sorted.

        A contact of one of its bodies has friction there, or presses at a slant. Points of a rigid component need none:
        its rigid motion is known everywhere; its traction spaces need the resultants of their tractions.
        """
        rigid, spaces = self.component[component].modes.reduction == "rigid", self.component[component].interface
        rubbed, own = self.rubbed(), [body for body in self.body if self.component_of(body) == component]
        found = {name for body in own for name in rubbed[body]}
        if rigid:
            return sorted(name for name in found if name in spaces and spaces[name].kind == "traction")
        spots = {n for n, one in self.component[component].interface.items() if one.kind in CONTACT_KINDS}
        if _is_soft_across(self.component[component]):
            slanting = oblique(self)
            found |= {name for body in own for name in slanting[body] if name in spots}
        if self.turning(component):  # What turns is not pressed along its normals alone.
            found |= {contact.interface for contact in self.contact.values() if contact.body in own}
        return sorted(found)

    def deforms(self, body: str) -> bool:
        """Whether the component of a body deforms."""
        part = self.component.get(self.component_of(body))
        return part is None or part.modes.reduction != "rigid"

    def turning(self, component: str) -> bool:
        """Whether a component deforms and one of its bodies turns by any angle: it needs a floating frame."""
        deforms = self.component[component].modes.reduction != "rigid"
        return deforms and self.capabilities.turns and component in map(self.component_of, self.body)

    def reduced_with(self, component: str) -> dict[str, Any]:
        """Return what the scene asks of a component's modes: the arguments of `reduce_component` by their names."""
        return {
            "rubbed": self.rubbed_of(component), "pulled": self.pulls_on(component), "turns": self.turning(component),
            "crossed": self.crossed(component),
        }  # fmt: skip

    def crossed(self, component: str) -> tuple[str, float] | None:
        """Return the traction space that a moving force crosses, and where across [m]; None without `modes.swap`."""
        if self.component[component].modes.swap is None:
            return None
        force = next(one for one in self.moving().values() if self.component_of(one.body) == component)
        return force.interface, force.at[0]

    def pulls_on(self, component: str) -> list[tuple[float, ...]]:
        """Return the unit vectors along which gravity deforms a component, in its axes: those of its bodies.

        None without supports: gravity does not deform a free body.
        """
        part, size = self.component[component], float(np.linalg.norm(self.run.gravity))
        if not size or not part.supports or part.modes.reduction == "rigid" or self.capabilities.turns:
            return []
        found = set[tuple[float, ...]]()
        for name, body in self.body.items():
            if self.component_of(name) == component:
                turned = np.eye(3) if body.orientation is None else body.orientation.matrix()
                along = np.round(turned.T @ np.asarray(self.run.gravity) / size, AXIS_DIGITS) + 0.0
                found.add(tuple((along * np.sign(along[np.flatnonzero(along)[0]]) + 0.0).tolist()))
        return sorted(found)


def _is_soft_across(part: Component) -> bool:
    """Whether a component deforms across the normals of its surfaces: a bar moves along its axis alone, a beam in a
    plane across it."""
    geometry = part.geometry
    return geometry.kind != "bar" and not (geometry.kind == "beam" and geometry.motion == "plane")


def _kind_against(raw: dict[str, Any], against: Any) -> str | None:
    """Return the kind of the interface that `against` of shape `surface` names; None where there is none."""
    if not isinstance(against, dict) or against.get("shape") != "surface":
        return None
    body = _below(raw, "body", against.get("body"))
    named = body.get("component", against["body"]) if isinstance(body, dict) else None
    interface = _below(raw, "component", named, "interface", against.get("interface"))
    kind = interface.get("kind", "points") if isinstance(interface, dict) else None
    return kind if isinstance(kind, str) else None


def _below(table: Any, *keys: Any) -> Any:
    """Return what stands below some keys, one in the other; None where nothing does."""
    for key in keys:
        table = table.get(key) if isinstance(table, dict) and isinstance(key, str) else None
    return table
