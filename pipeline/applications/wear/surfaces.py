"""Contacts whose surfaces wear over cycles: worn depths move the nodes of a body, whose modes are kept.

Depth at a contact point is k/H ∫ F |v| dt over its area. Depths are taken off the profile of the component's cylinder
(`change.profile`), the modes are kept while the estimates of what that neglects are within `change.tolerance`, else
they are computed again. Depths of a traction space over which the points slide are added up; they do not act back.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gudgeon.modaldb.records.trajectory import WEAR
from gudgeon.pipeline.applications.wear.profile import WornProfile
from gudgeon.pipeline.applications.wear.shapes import Cycle, Ended, Shapes, Soft
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.geometry.surfaces import cylindrical
from gudgeon.pipeline.scenes.change import moved_surface
from gudgeon.pipeline.stages.change import change_estimates, largest_changes
from gudgeon.pipeline.stages.folder import held
from gudgeon.pipeline.stages.job import variant
from gudgeon.pipeline.stages.run import solve_records
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver.laws.archard import DEEPEST, ContactWear
from gudgeon.solver.obstacles import Bore
from gudgeon.solver.scene.contact import Contact, MasterSurface

AGAINST = " against"
"""After the name of a contact: the traction space over which its points slide."""
NO_CLEARANCE = 1e-3
"""Share of the radius that depths are measured by where a contact has no clearance."""


@dataclass(frozen=True)
class Rubbed:
    """One contact that wears."""

    contact: Contact
    wear: ContactWear
    component: str
    points: np.ndarray
    """Of the unworn body [m], (c, 3)."""
    areas: np.ndarray
    """[m²], (c,)."""
    places: np.ndarray
    """Angle [rad] and height [m] of each point on its cylinder, (c, 2)."""
    radius: float
    clearance: float
    """Radius of what it touches less its own [m]; by `NO_CLEARANCE` where it has none."""
    space: Any
    """Traction space over which the points slide, a record; None without."""

    @property
    def cell(self) -> float:
        """Area of a function of the traction space [m²]."""
        return float(np.prod(self.space.spacing))


@dataclass
class Surfaces:
    """A scene whose contacts wear."""

    job: Any
    rubbed: dict[str, Rubbed]
    period: float
    """Of a cycle [s]."""
    profiles: dict[str, WornProfile]
    """By component."""
    recomputed: int = 0
    """Runs whose modes were computed again."""
    estimates: dict[str, float] = field(default_factory=dict)
    """Largest estimated relative change of frequencies or compliance by component, of modes that were kept."""

    @property
    def after(self) -> float:
        """Time from which all wear counts [s]."""
        return max(s.wear.after for s in self.rubbed.values())

    def start(self) -> Shapes:
        """Return the unworn surfaces: depth of points (1, 1, c), and of functions of traction spaces (1, 1, F)."""
        shapes = {name: np.zeros((1, 1, len(s.points))) for name, s in self.rubbed.items()}
        spaces = {name: s for name, s in self.rubbed.items() if s.space is not None}
        return shapes | {name + AGAINST: np.zeros((1, 1, s.space.size)) for name, s in spaces.items()}

    def scales(self) -> dict[str, float]:
        """Return the clearances [m]."""
        return {name: self.rubbed[name.removesuffix(AGAINST)].clearance for name in self.start()}

    def deepest(self, name: str) -> tuple[float, str]:
        """Return the depth at which wear ends, and why."""
        surface = self.rubbed[name.removesuffix(AGAINST)]
        bound, contact = DEEPEST * surface.radius, name.replace(AGAINST, "', what it slides over, '").rstrip(" '")
        if surface.wear.thickness is not None and surface.wear.thickness <= bound:
            return (
                surface.wear.thickness,
                f"the wall of contact '{contact}' is worn through, thickness = {surface.wear.thickness:g} m",
            )
        return (
            bound,
            f"contact '{contact}' is worn by more than {DEEPEST:g} of its radius, beyond the model of its shape",
        )

    def cycle(self, shapes: Shapes, soft: Soft, tell: Progress) -> Cycle:
        """Run the scene with worn surfaces, unless the database has this run, and return what a cycle wears off.

        Raises:
            Ended: the run failed.
        """
        job = self.worn_job(shapes, tell)
        report = solve_records(job, "solve", tell)
        if report.reason is not None:
            raise Ended(report.reason)
        trajectory = self.job.store.get(key := job.trajectory().key, "trajectory", only=["counts", "quantities"])
        rates: Shapes = {}
        for name, surface in self.rubbed.items():
            sums, wear = trajectory.counts[WEAR][name], surface.wear
            cycles = (self.job.scene.run.duration - wear.after) / self.period
            slide = np.array(sums["load_distance"]) / cycles
            if len(slide) != len(surface.points):
                raise StageError(f"{self.job.path}: contact.{name}: {len(slide)} points of the worn body, it had"
                                 f" {len(surface.points)}")  # fmt: skip
            rates[name] = (wear.coefficient / wear.hardness * slide / surface.areas)[None, None]
            if surface.space is not None:
                against = np.array(sums["against_load_distance"]) / cycles
                rates[name + AGAINST] = (wear.against_coefficient / wear.hardness * against / surface.cell)[None, None]
        numbers = {n: q["value"] for n, q in trajectory.quantities.items() if n.partition(".")[0] in self.rubbed}
        return Cycle(rates, Soft(), numbers, key)

    def worn_job(self, shapes: Shapes, tell: Progress) -> Any:
        """Return the job of the scene with worn surfaces, with kept modes or with those computed again."""
        tables = {}
        for component, profile in self.profiles.items():
            depths_of = {name: shapes[name][0, 0] for name, s in self.rubbed.items() if s.component == component}
            if any(depths.any() for depths in depths_of.values()):
                with held(self.job.out):
                    tables[component] = str(profile.write(depths_of, self.job.out).resolve())
        if not tables:
            return self.job
        job = self._changed(tables, set())
        solve_records(job, "morph", tell)
        poor = set()
        for component, entry in change_estimates(job).items():
            largest = max(map(abs, largest_changes(entry).values()), default=0.0)
            if component in tables and largest > entry["tolerance"]:
                poor.add(component)
            elif component in tables:
                self.estimates[component] = max(self.estimates.get(component, 0.0), largest)
        if poor:
            self.recomputed += 1
        return self._changed(tables, poor) if poor else job

    def _changed(self, tables: dict[str, str], recomputed: set[str]) -> Any:
        changes = {
            name: {"change": {"update": "recompute" if name in recomputed else "reuse", "profile": {
                "surface": self.profiles[name].surface, "table": table, "scale": 1.0, "offset": 0.0}}}
            for name, table in tables.items()
        }  # fmt: skip
        return variant(self.job, {"component": changes})


def worn_contacts(job: Any) -> dict[str, Contact]:
    """Return the contacts of a scene that wear."""
    scene = getattr(job, "scene", None)
    contacts = getattr(scene, "contact", {}) if scene is not None else {}
    return {name: c for name, c in contacts.items() if getattr(c, "wear", None) is not None}


def surfaces(job: Any, period: float, tell: Progress) -> Surfaces:
    """Return the surfaces of a scene that wear; their bodies are meshed and reduced first.

    Raises:
        InputError: a surface that wears is no cylinder, or two of a component are not the same.
    """
    contacts = worn_contacts(job)
    if not any(c.wear.coefficient or c.wear.against_coefficient for c in contacts.values() if c.wear):
        raise InputError(f"{job.path}: wear: all coefficients of wear are zero; nothing wears")
    for name, contact in contacts.items():
        _check(job, name, contact)
    solve_records(job, "morph", tell)
    rubbed = {name: _rubbed(job, name, contact) for name, contact in contacts.items()}
    profiles = {}
    for name, member in rubbed.items():
        component = member.component
        if component in profiles:
            continue
        members = {key: m for key, m in rubbed.items() if m.component == component}
        areas = np.concatenate([m.areas for m in members.values()])
        shape, surface = _cylinder(job, name, member.contact)
        nodes = job.record(component, "mesh").nodes[np.unique(_facets(job, component, surface))]
        heights = cylindrical(nodes, shape)[2]
        profiles[component] = WornProfile(
            job, component, surface, {key: m.places for key, m in members.items()},
            spacing=float(np.sqrt(np.median(areas))), radius=member.radius,
            span=(float(heights.min()), float(heights.max())),
        )  # fmt: skip
    return Surfaces(job, rubbed, period, profiles)


def _check(job: Any, name: str, contact: Contact) -> None:
    """Raise an InputError where the worn depth of a contact cannot move nodes."""
    component = job.scene.component_of(contact.body)
    key, component_table = f"{job.path}: contact.{name}.wear", job.scene.component[component]
    if component_table.geometry.kind in ("rigid", "bar", "beam", "frame", "matrices"):
        raise InputError(
            f"{key}: '{contact.body}' is of geometry '{component_table.geometry.kind}', which has no mesh whose nodes"
            " wear could move; `gudgeon run` gives the worn volume of one run"
        )
    if users := [body for body in job.scene.bodies_of(component) if body != contact.body]:
        raise InputError(
            f"{key}: component '{component}' is also that of body '{users[0]}', which would wear with it; give each"
            " body a component of its own"
        )
    surface = component_table.interface[contact.interface].surface
    others = {
        component_table.interface[c.interface].surface
        for c in worn_contacts(job).values() if job.scene.component_of(c.body) == component
    }  # fmt: skip
    if component_table.change.growth:
        raise InputError(f"component.{component}.change.growth: given; a part that grows does not wear")
    moved = moved_surface(component_table, job.folder, component)
    if moved is not None:
        others.add(moved[0])
    if others != {surface}:
        raise InputError(
            f"{key}: wear of component '{component}' moves one surface, but its contacts that wear and its profile"
            f" name {', '.join(sorted(others))}; wear of one surface is supported"
        )


def _facets(job: Any, component: str, surface: str) -> np.ndarray:
    return job.record(component, "mesh").surfaces[surface].facets


def _cylinder(job: Any, name: str, contact: Contact) -> tuple[dict[str, Any], str]:
    """Return the true shape of a contact's own surface, and its name.

    Raises:
        InputError: it is no cylinder.
    """
    component = job.scene.component_of(contact.body)
    surface = job.scene.component[component].interface[contact.interface].surface
    shape = job.record(component, "mesh").surfaces[surface].shape
    if shape.get("kind") != "cylinder":
        raise InputError(
            f"{job.path}: contact.{name}.wear: surface '{surface}' is no cylinder; worn depths move nodes as a profile,"
            " which needs one; `gudgeon run` gives the worn volume of one run"
        )
    return dict(shape), surface


def _rubbed(job: Any, name: str, contact: Contact) -> Rubbed:
    component = job.scene.component_of(contact.body)
    shape, _ = _cylinder(job, name, contact)
    interface = job.record(component).interfaces[contact.interface]
    radius, angle, height = cylindrical(interface.points, shape)
    own_radius, space, outer = float(shape.get("radius", radius.mean())), None, None
    if isinstance(contact.against, Bore):
        outer = contact.against.radius
    elif isinstance(contact.against, MasterSurface):
        space = job.record(job.scene.component_of(contact.against.body)).tractions[contact.against.interface]
        outer = float(space.chart["radius"]) if space.chart["kind"] == "cylinder" else None
    clearance = 0.0 if outer is None else outer - own_radius
    assert contact.wear is not None
    positions = np.column_stack([angle, height])
    return Rubbed(
        contact, contact.wear, component, interface.points, interface.areas, positions, radius=own_radius, space=space,
        clearance=clearance if clearance > 0 else NO_CLEARANCE * own_radius,
    )  # fmt: skip
