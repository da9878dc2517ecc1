"""A scene file of bodies in contact."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, PrivateAttr, model_validator

from gudgeon.pipeline.files import scene_path
from gudgeon.pipeline.geometry.shapes.plane import PlanePart
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.gauge import Sensor
from gudgeon.pipeline.scenes.reading import check_scene, override_texts, read_tables
from gudgeon.pipeline.scenes.reference.toml import toml_document
from gudgeon.pipeline.scenes.report import Plot, Report
from gudgeon.pipeline.scenes.robustness import Robustness
from gudgeon.solver.numbers import Name
from gudgeon.solver.scene.oblique import oblique
from gudgeon.solver.scene.scene import Scene

CONTACT_KINDS = ("points", "patch")
"""Kinds of interface that have contact points."""
LOADED = ("mean", "tie", "pressure")
"""Kinds of interface on which loads act and by which motions hold a body."""
AXIS_DIGITS = 12
"""Digits of the direction of gravity by which modes are found again."""


class SceneFile(Scene):
    """A scene of bodies in contact, joints and forces: the tables of a scene file."""

    _folder: Path = PrivateAttr(default=Path())

    component: dict[Name, Component] = Field(description="Parts, by name; a part may be placed as several bodies")
    sensor: dict[Name, Sensor] = Field(
        default={},
        description="Bodies whose strain gauges measure a wrench, by name: bridges, noise and so on",
    )
    report: Report = Report.model_construct()
    plot: Plot = Plot.model_construct()
    robustness: Robustness = Robustness.model_construct()

    @classmethod
    def from_file(cls, scene: str | Path, *, set: Sequence[str] | Mapping[str, Any] = ()) -> "SceneFile":
        """Read a scene file and check its keys; files and records that it names are looked at when it is run.

        >>> import gudgeon
        >>> scene = gudgeon.Scene.from_file(gudgeon.example("rod-wall"), set={"run.duration": 1e-5})
        >>> scene.run.duration, scene.component["rod"].geometry.kind
        (1e-05, 'bar')

        Args:
            scene: The scene's folder or TOML file.
            set: Overrides, `path.to.key=value` texts or a mapping of such paths to values.

        Raises:
            InputError: the scene is missing or wrong, every mistake is listed.
        """
        path = scene_path(scene)
        read = check_scene(path, read_tables(path, override_texts(set)), cls)
        read._folder = path.parent
        return read

    def to_toml(self) -> str:
        """Return the text of a scene file of this scene, with the keys that were given.

        >>> import gudgeon
        >>> scene = gudgeon.Scene.from_file(gudgeon.example("rod-wall"))
        >>> print(scene.to_toml()[:37])
        [body.rod]
        velocity = [1.0, 0.0, 0.0]
        """
        return toml_document(self.model_dump(mode="json", exclude_unset=True))

    @property
    def folder(self) -> Path:
        """Folder at which relative names of files start: that of the file that was read, or else the current one."""
        return self._folder

    @model_validator(mode="before")
    @classmethod
    def _surfaces_of_points(cls, raw: Any) -> Any:
        """Return the tables with `against.shape = "surface"` read as `"body"` where it names no traction space."""
        contacts = raw.get("contact") if isinstance(raw, dict) else None
        if not isinstance(contacts, dict):
            return raw
        changed = {
            name: contact | {"against": contact["against"] | {"shape": "body"}}
            for name, contact in contacts.items()
            if isinstance(contact, dict) and _kind_against(raw, contact.get("against")) in CONTACT_KINDS
        }
        return raw | {"contact": contacts | changed} if changed else raw

    def bodies_of(self, component: str) -> list[str]:
        """Return the bodies of a component."""
        return [body for body in self.body if self.component_of(body) == component]

    def rubbed_of(self, component: str) -> list[str]:
        """Return the interfaces of an elastic component that need tangential rows, sorted.

        A contact of one of its bodies has friction there, or presses at a slant. Points of a rigid component need none:
        its rigid motion is known everywhere; its traction spaces need the resultants of their tractions.
        """
        definition, bodies = self.component[component], self.bodies_of(component)
        rubbed, kinds = self.rubbed(), {name: interface.kind for name, interface in definition.interface.items()}
        names = {name for body in bodies for name in rubbed[body]}
        if definition.modes.reduction == "rigid":
            return sorted(name for name in names if kinds.get(name) == "traction")
        if _is_soft_across(definition):
            slanting = oblique(self)
            names |= {name for body in bodies for name in slanting[body] if kinds.get(name) in CONTACT_KINDS}
        if self.turning(component):  # What turns is not pressed along its normals alone.
            names |= {contact.interface for contact in self.contact.values() if contact.body in bodies}
        return sorted(names)

    def deforms(self, body: str) -> bool:
        """Whether the component of a body deforms."""
        component = self.component.get(self.component_of(body))
        return component is None or component.modes.reduction != "rigid"

    def turning(self, component: str) -> bool:
        """Whether a component deforms and one of its bodies turns by any angle: it needs a floating frame."""
        deforms = self.component[component].modes.reduction != "rigid"
        return deforms and self.capabilities.turns and component in map(self.component_of, self.body)

    def reduced_with(self, component: str) -> dict[str, Any]:
        """Return what the scene asks of a component's modes: the arguments of `reduce_component` by their names."""
        return {
            "rubbed": self.rubbed_of(component), "pulled": self.pulls_on(component), "turns": self.turning(component),
            "crossed": self.crossed(component), "held": self.held_at(component),
            "stressed": self.stressed(component),
        }  # fmt: skip

    def held_at(self, component: str) -> list[str]:
        """Return the interfaces by which motions hold an elastic component in small motion, sorted.

        Where bodies start undeformed, those of cranks, loads and springs too: R, without mass, would deform them at
        once.
        """
        if self.component[component].modes.reduction == "rigid" or self.capabilities.turns:
            return []
        ends = [(motion.body, motion.interface) for motion in self.motion.values()]
        if self.run.start == "undeformed":
            for force in [*self.cranks().values(), *self.given().values(), *self.springs().values()]:
                names = "interface", "against_interface"
                ends += [
                    (body, getattr(force, name, None))
                    for body, name in zip((force.body, getattr(force, "against", None)), names, strict=True)
                ]
        kinds = {name: interface.kind for name, interface in self.component[component].interface.items()}
        bodies = self.bodies_of(component)
        return sorted({i for body, i in ends if body in bodies and i is not None and kinds.get(i) in LOADED})

    def stressed(self, component: str) -> bool:
        """Whether loads at interfaces, or weight on supports, stress an elastic component in small motion."""
        definition = self.component[component]
        bodies = [body for body in self.bodies_of(component) if self.body[body].geometric_stiffness]
        if definition.modes.reduction == "rigid" or self.capabilities.turns or self.cranks():
            return False
        acting = [*self.over_time().values(), *self.springs().values(), *self.motion.values()]
        ends = [(a.body, a.interface) for a in acting if hasattr(a, "interface")]
        ends += [(f.against, f.against_interface) for f in self.springs().values()]
        loaded = any(body in bodies and interface is not None for body, interface in ends)
        return bool(bodies) and (loaded or bool(self.pulls_on(component)))

    def weighs(self, component: str) -> bool:
        """Whether the modes of a component have stiffness by the stress of its weight."""
        definition = self.component[component]
        bears = _is_soft_across(definition) and not isinstance(definition.geometry, PlanePart)
        pulled = self.stressed(component) and bool(self.pulls_on(component))
        return pulled and bears and definition.material is not None

    def crossed(self, component: str) -> tuple[str, float] | None:
        """Return the traction space that a moving force crosses, and where across [m]; None without `modes.swap`."""
        if self.component[component].modes.swap is None:
            return None
        force = next(f for f in self.moving().values() if self.component_of(f.body) == component)
        return force.interface, force.at[0]

    def pulls_on(self, component: str) -> list[tuple[float, ...]]:
        """Return the unit vectors along which gravity deforms a component, in its axes: those of its bodies.

        None without supports: gravity does not deform a free body.
        """
        definition, size = self.component[component], float(np.linalg.norm(self.run.gravity))
        if not size or not definition.supports or definition.modes.reduction == "rigid" or self.capabilities.turns:
            return []
        directions = set[tuple[float, ...]]()
        for orientation in (self.body[body].orientation for body in self.bodies_of(component)):
            turned = np.eye(3) if orientation is None else orientation.matrix()
            along = np.round(turned.T @ np.asarray(self.run.gravity) / size, AXIS_DIGITS) + 0.0
            directions.add(tuple((along * np.sign(along[np.flatnonzero(along)[0]]) + 0.0).tolist()))
        return sorted(directions)


def _is_soft_across(component: Component) -> bool:
    """Whether a component deforms across the normals of its surfaces: a bar moves along its axis alone, a beam in a
    plane across it."""
    geometry = component.geometry
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
