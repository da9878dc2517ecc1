"""The solver's part of a scene: bodies, contacts, joints, forces and the run. SI units."""

import math
from collections.abc import Iterator

from pydantic import Field, model_validator

from gudgeon.solver.capabilities import INTEGRATORS, Feature, Integrator
from gudgeon.solver.forces import Force, OverTime
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.forces.external import ExternalForce
from gudgeon.solver.forces.fields.electrostatic import (
    Adhesion,
    Electrostatic,
    ElectrostaticPressure,
    FieldForce,
    ParallelPlates,
)
from gudgeon.solver.forces.gas import GasPressure
from gudgeon.solver.forces.given import GivenForce, GivenTorque, GivenWrench
from gudgeon.solver.forces.load_stiffness import Made
from gudgeon.solver.forces.moving import MovingForce
from gudgeon.solver.forces.spring import Spring
from gudgeon.solver.joints import Joint
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.coupled import Driven, Gear
from gudgeon.solver.joints.markers import Marked
from gudgeon.solver.joints.slider_crank import SliderCrank
from gudgeon.solver.numbers import Name, Strict
from gudgeon.solver.scene.body import Body
from gudgeon.solver.scene.contact import Contact, MasterSurface, OtherBody
from gudgeon.solver.scene.demands import Demand, conflict, contact_demands, impulsive, lacking, prefers
from gudgeon.solver.scene.holding import turning_cause
from gudgeon.solver.scene.motion import Motion
from gudgeon.solver.scene.probe import DistanceProbe, ForceProbe, Probe
from gudgeon.solver.scene.refusals import (
    listed,
    refuse_both_sides,
    refuse_step,
    refuse_turning_probe,
    suggestion,
    turning_refusal,
)
from gudgeon.solver.scene.run import Run


class Scene(Strict):
    """Everything that the solver needs besides the records."""

    body: dict[Name, Body] = Field(min_length=1, description="Parts placed in the scene, by name")
    contact: dict[Name, Contact] = Field(default={}, description="Pairs of surfaces that may touch, by name")
    joint: dict[Name, Joint] = Field(default={}, description="Joints and drives, by name")
    force: dict[Name, Force] = Field(default={}, description="Forces, springs and bushings, by name")
    motion: dict[Name, Motion] = Field(default={}, description="Motions of bodies that are given over time")
    probe: dict[Name, Probe] = Field(default={}, description="Motions and forces that are recorded, by name")
    run: Run = Field(description="Duration, steps and integrator")

    @model_validator(mode="after")
    def _names(self) -> "Scene":
        for name, probe in self.probe.items():
            if isinstance(probe, ForceProbe):
                self._check_force(f"probe.{name}.of", probe.of)
        for key, body in self._named_bodies():
            if body not in self.body:
                have = ", ".join(self.body)
                raise ValueError(f"{key}: no body '{body}', {suggestion(body, self.body)}the scene has {have}")
        self._check_joints()
        for name, surface in self.others().items():
            contact = self.contact[name]
            refuse_both_sides(name, contact, surface)
            if surface.body == contact.body and isinstance(surface, MasterSurface) and self.integrator != "turning":
                raise ValueError(
                    f"contact.{name}.against.body: points do not slide over a traction space of their own body where it"
                    " does not turn; it meets itself by interfaces of kind 'points' and shape 'body'"
                )
        if INTEGRATORS[self.integrator].turns:
            for name, probe in self.probe.items():
                refuse_turning_probe(name, probe)
        return self

    def _named_bodies(self) -> Iterator[tuple[str, str]]:
        """Yield the keys that name bodies, each with the name."""
        yield from ((f"contact.{name}.body", contact.body) for name, contact in self.contact.items())
        yield from ((f"contact.{name}.against.body", surface.body) for name, surface in self.others().items())
        joints, forces = self.hinges(), self.springs() | self.fields()
        yield from ((f"joint.{name}.body", joint.body) for name, joint in (self.cranks() | joints).items())
        yield from ((f"joint.{name}.against", joint.against) for name, joint in joints.items() if joint.against)
        yield from ((f"force.{name}.body", force.body) for name, force in self.force.items())
        yield from ((f"motion.{name}.body", motion.body) for name, motion in self.motion.items())
        yield from ((f"force.{name}.against", force.against) for name, force in forces.items() if force.against)
        for name, probe in self.probe.items():
            if not isinstance(probe, ForceProbe):
                yield f"probe.{name}.body", probe.body
            if isinstance(probe, DistanceProbe):
                yield f"probe.{name}.against", probe.against

    def _check_joints(self) -> None:
        """Raise a ValueError unless gas forces, gears and drives name joints of the kind that they need."""
        cranks, hinges = self.cranks(), self.hinges()
        for name, force in self.gas().items():
            if force.joint not in cranks:
                have = ", ".join(cranks) or "none"
                raise ValueError(f"force.{name}.joint: no joint '{force.joint}', the scene has {have}")
        for name, joint in self.joint.items():
            for key in {Gear: ("joint", "other"), Driven: ("joint",)}.get(type(joint), ()):
                if (target := getattr(joint, key)) not in hinges:
                    have = f"{suggestion(target, hinges)}the scene has {', '.join(hinges) or 'none'}"
                    raise ValueError(f"joint.{name}.{key}: no joint '{target}' of two markers, {have}")

    def _check_force(self, path: str, of: str) -> None:
        """Raise a ValueError unless a probe's `of` is a contact, joint, spring, motion or body of the scene."""
        able = [f"contact.{name}" for name in self.contact] + [f"joint.{name}" for name in self.joint]
        able += [f"force.{name}" for name in self.springs() | self.fields()] + [
            f"motion.{name}" for name in self.motion
        ]
        able += [f"body.{name}" for name in self.body]
        if of not in able:
            have = ", ".join(able) or "none"
            raise ValueError(f"{path}: nothing to be read at '{of}', {suggestion(of, able)}the scene has {have}")

    def cranks(self) -> dict[str, SliderCrank]:
        """Return the cranks that move a point of a body by a massless rod, by name."""
        return {n: j for n, j in self.joint.items() if isinstance(j, SliderCrank)}

    def hinges(self) -> dict[str, Marked]:
        """Return the joints of two markers by name."""
        return {n: j for n, j in self.joint.items() if isinstance(j, Marked)}

    def held(self) -> dict[str, Marked]:
        """Return the joints of two markers that hold bodies in small motion by name: all, where nothing turns and an
        integrator of small motion carries the rest of the scene, or none."""
        hinges, arguments = self.hinges(), (self.joint, self.body, self.probe, self.run, self.deforms)
        if not hinges or self.run.integrator == "turning" or turning_cause(*arguments) is not None or self._fast:
            return {}
        demands = list(_demands(self.model_copy(update={"joint": self.cranks()})))
        return (
            hinges
            if any(not integrator.turns and not lacking(demands, name) for name, integrator in INTEGRATORS.items())
            else {}
        )

    def bearings(self) -> dict[str, str]:
        """Return the components of elastic bearings by the joint that has one."""
        clearances = {n: j.bearing for n, j in self.joint.items() if isinstance(j, Clearance) and j.bearing is not None}
        return {n: c.component for n, c in clearances.items() if c.component is not None}

    def point_springs(self) -> dict[str, Spring]:
        """Return the springs between two points, whose line turns with them, by name: as named, or in mechanisms."""
        springs = {n: f for n, f in self.force.items() if isinstance(f, Spring)}
        lines = {n for n, f in springs.items() if self.turns_by_choice and f.direction is None and not f.tabled}
        return {n: f for n, f in springs.items() if f.against_at is not None or n in lines}

    def turning_bushings(self) -> dict[str, Bushing]:
        """Return the bushings of bodies that turn by any angle by name: beside joints of two markers, or as named."""
        return {n: f for n, f in self.force.items() if isinstance(f, Bushing) and self.turns_by_choice}

    @property
    def turns_by_choice(self) -> bool:
        """Whether its bodies turn by any angle: they have joints of two markers that do more than hold bodies on the
        ground, their integrator is named, or a free one turns far and that integrator carries the scene."""
        named = self.run.integrator == "turning"
        return named or (bool(self.hinges()) and not self.held()) or self._turns_freely

    def fields(self) -> dict[str, Electrostatic | ParallelPlates | Adhesion]:
        """Return the electrostatic fields and adhesions of the scene by name."""
        return {n: f for n, f in self.force.items() if isinstance(f, Electrostatic | ParallelPlates | Adhesion)}

    def electrodes(self) -> dict[str, ElectrostaticPressure]:
        """Return the electrostatic pressures on points of the scene by name."""
        return {n: f for n, f in self.force.items() if isinstance(f, ElectrostaticPressure)}

    def six_motions(self) -> dict[str, Bushing | FieldForce]:
        """Return bushings of bodies that turn by any angle, then fields: what acts on translation and rotation."""
        return {**self.turning_bushings(), **self.fields()}

    def point_loads(self) -> dict[str, GivenForce | GivenTorque]:
        """Return forces over time at points of rigid bodies, and torques on them, by name."""
        loads = {n: f for n, f in self.force.items() if isinstance(f, GivenForce | GivenTorque)}
        return {n: f for n, f in loads.items() if isinstance(f, GivenTorque) or f.at is not None}

    def turning_loads(self) -> dict[str, GivenForce | GivenTorque | GivenWrench]:
        """Return forces, torques and wrenches over time of a scene whose bodies turn by any angle, by name."""
        loads = {n: f for n, f in self.force.items() if isinstance(f, GivenForce | GivenTorque | GivenWrench)}
        return loads if self.turns_by_choice else {n: f for n, f in loads.items() if n in self.point_loads()}

    def masters(self) -> dict[str, MasterSurface]:
        """Return the master surface of each contact that has one."""
        return {n: c.against for n, c in self.contact.items() if isinstance(c.against, MasterSurface)}

    def others(self) -> dict[str, MasterSurface | OtherBody]:
        """Return the other body of each contact between two bodies."""
        return {n: c.against for n, c in self.contact.items() if isinstance(c.against, MasterSurface | OtherBody)}

    def rubbed(self) -> dict[str, tuple[str, ...]]:
        """Return the interfaces of contact points and traction spaces of each body on which friction acts."""
        rubbing: dict[str, list[str]] = {body: [] for body in self.body}
        for contact in self.contact.values():
            if contact.friction is not None:
                rubbing[contact.body].append(contact.interface)
                if isinstance(contact.against, OtherBody | MasterSurface):
                    rubbing[contact.against.body].append(contact.against.interface)
        return {body: tuple(dict.fromkeys(names)) for body, names in rubbing.items()}

    def given(self) -> dict[str, GasPressure | MovingForce | ExternalForce | OverTime]:
        """Return the forces prescribed over time by name: all but springs, bushings and fields."""
        return {
            n: f
            for n, f in self.force.items()
            if not isinstance(f, Spring | Bushing | Made | FieldForce | ElectrostaticPressure)
        }

    def over_time(self) -> dict[str, OverTime]:
        """Return the forces by name whose amount is a table or an expression of time."""
        return {n: f for n, f in self.force.items() if isinstance(f, OverTime)}

    def external(self) -> dict[str, ExternalForce]:
        """Return the forces that a caller sets by name."""
        return {n: f for n, f in self.force.items() if isinstance(f, ExternalForce)}

    def gas(self) -> dict[str, GasPressure]:
        """Return the gas pressures of the scene by name."""
        return {n: f for n, f in self.force.items() if isinstance(f, GasPressure)}

    def moving(self) -> dict[str, MovingForce]:
        """Return the moving forces of the scene by name."""
        return {n: f for n, f in self.force.items() if isinstance(f, MovingForce)}

    def springs(self) -> dict[str, Spring | Bushing]:
        """Return the springs and bushings of the scene by name, in a system with the dashpots of bodies."""
        return {n: f for n, f in self.force.items() if isinstance(f, Spring | Bushing | Made)}

    def carriers(self) -> list[str]:
        """Return the integrators that support all features of the scene, in the order in which `auto` prefers them."""
        demands = list(_demands(self))
        able = [name for name in INTEGRATORS if not lacking(demands, name)]
        # Fields, sliding pairs and cranks alone make no mechanism of a scene.
        small = any(not INTEGRATORS[name].turns for name in able)
        return sorted(able, key=lambda name: (small and INTEGRATORS[name].turns, not prefers(demands, name)))

    def alternatives(self) -> list[str]:
        """Return the integrators that support the scene and turn its bodies as its own one does."""
        turns = self.capabilities.turns
        return [name for name in self.carriers() if INTEGRATORS[name].turns == turns]

    @property
    def impulsive(self) -> bool:
        """Whether nothing but contact over a compliance acts, on undamped bodies."""
        return bool(self.contact) and impulsive(list(_demands(self)))

    @property
    def general(self) -> bool:
        """Whether integrator 'small' runs it over ports; sliding pairs have a faster loop."""
        return not self.masters() or not prefers(list(_demands(self)), "small")

    @property
    def loop(self) -> str:
        """Name of the time loop that runs it: that of its integrator, or `implicit`."""
        return "implicit" if self.integrator == "small" and not self.general else self.integrator

    @property
    def integrator(self) -> str:
        """Name of the integrator: the one given, or the one that `auto` selects from the features of the scene.

        Raises:
            ValueError: the integrator given, or every integrator, lacks a feature of the scene.
        """
        demands, named = list(_demands(self)), self.run.integrator
        if named == "auto":
            able = self.carriers()
            stepping = [name for name in able if self.run.step is None or math.isfinite(INTEGRATORS[name].order)]
            if able and not stepping:
                refuse_step(" and ".join(map(repr, able)))
            if self._turns_freely:
                return "turning"
            if able:
                return stepping[0]
            raise ValueError(self._turning_refusal() or conflict(demands))
        if lacks := lacking(demands, named):
            raise ValueError(self._named_refusal(named, lacks))
        if math.isinf(INTEGRATORS[named].order) and self.run.step is not None:
            refuse_step(repr(named))
        return named

    def _named_refusal(self, named: str, lacks: list[Demand]) -> str:
        """Return a line of what the integrator that is given does not support, and of what does."""
        able = self._left_to_choose().carriers()  # Naming an integrator may have made a mechanism of the scene.
        refusal = self._turning_refusal()
        if not able and refusal:
            return refusal
        advice = f"use {' or '.join(map(repr, ('auto', *able)))}" if able else "no integrator supports the whole scene"
        if refusal and named == "turning":
            advice += f"; or {refusal}"
        missing = listed([d.what for d in lacks])
        return f"run.integrator: '{named}' does not support {missing}; {advice}"

    def _turning_refusal(self) -> str | None:
        """Return a line of what its bodies, which turn by any angle, do not carry; None where they do not turn."""
        why = [f"joint.{name}.kind is '{self.joint[name].kind}'" for name in self.hinges() if not self.held()]
        why += [f"the line of force.{name} turns" for name in self.point_springs()]
        lacks = lacking(list(_demands(self)), "turning")
        tables = {"contact": self.contact, "force": self.force, "motion": self.motion}
        elements = [(d, *d.where.split(".", 1)) for d in lacks]
        refused = [(d.where, d.feature, tables[table][name]) for d, table, name in elements if table in tables]
        if not (why or self.run.integrator == "turning") or len(refused) < len(lacks):
            return None
        because = f" ({why[0]}, so bodies turn by any angle: integrator 'turning')" if why else ""
        return turning_refusal(refused) + because

    def _left_to_choose(self) -> "Scene":
        return self.model_copy(update={"run": self.run.model_copy(update={"integrator": "auto"})})

    @property
    def _turns_freely(self) -> bool:
        """Whether `auto` selects bodies that turn by any angle: none touches anything, and one that keeps its angular
        velocity would turn beyond run.limits.angle."""
        return self.run.integrator == "auto" and not self.contact and self._fast and self.may_turn

    @property
    def _fast(self) -> bool:
        """Whether a body that keeps its angular velocity would turn beyond run.limits.angle."""
        spins = [math.hypot(*body.angular_velocity) for body in self.body.values()]
        return max(spins) * self.run.duration > self.run.limits.angle

    @property
    def may_turn(self) -> bool:
        """Whether integrator 'turning' supports the whole scene."""
        named = self.model_copy(update={"run": self.run.model_copy(update={"integrator": "turning"})})
        return not lacking(list(_demands(named)), "turning")

    @property
    def capabilities(self) -> type[Integrator]:
        """Features, order and step limits of this integrator."""
        return INTEGRATORS[self.integrator]

    def deforms(self, body: str) -> bool:
        """Whether a body may deform; what knows its component says more."""
        return body in self.body

    def component_of(self, body: str) -> str:
        """Return the component that a body is made of."""
        return self.body[body].component or body


def _demands(scene: Scene) -> Iterator[Demand]:
    """Yield the features that a scene needs, each with the element that needs it."""
    for name, body in scene.body.items():
        path = f"body.{name}"
        if body.damping is not None:
            yield Demand(f"damping of {path}", Feature.DAMPING, path)
        if body.gauges:
            yield Demand(f"{path}.gauges", Feature.GAUGES, path)
    yield from (Demand(f"probe.{name}", Feature.PROBES, f"probe.{name}") for name in scene.probe)
    yield from _joint_demands(scene)
    yield from (Demand(f"motion.{name}", Feature.MOTION, f"motion.{name}") for name in scene.motion)
    for name in scene.given():
        path, turns = f"force.{name}", name in scene.turning_loads()
        yield Demand(path, Feature.POINT_LOAD if turns else Feature.LOAD, path)
    for path in (f"contact.{name}" for name in scene.masters()):
        yield Demand(f"the sliding pair {path}", Feature.SLIDING_PAIR, path)
    for name, contact in scene.contact.items():
        yield from contact_demands(f"contact.{name}", contact)
    for name, spring in scene.springs().items():
        yield from _spring_demands(scene, name, spring)
    for kind, names, feature in (
        ("the field", scene.fields(), Feature.FIELD),
        ("the electrostatic pressure", scene.electrodes(), Feature.ELECTRODE),
    ):
        yield from (Demand(f"{kind} force.{name}", feature, f"force.{name}") for name in names)
    if any(scene.run.gravity):
        yield Demand("run.gravity", Feature.GRAVITY, "run.gravity")


def _joint_demands(scene: Scene) -> Iterator[Demand]:
    """Yield the features that joints need."""
    holding = scene.held()
    for name, joint in scene.joint.items():
        path, crank = f"joint.{name}", isinstance(joint, SliderCrank)
        if crank or name not in holding:
            yield Demand(path, Feature.JOINT if crank else Feature.MECHANISM, path)
        elif holding[name].body in {master.body for master in scene.masters().values()}:
            yield Demand(f"{path}, which holds what points slide over,", Feature.GAUGES, path)


def _spring_demands(scene: Scene, name: str, spring: Spring | Bushing) -> Iterator[Demand]:
    """Yield the features that a spring or a bushing needs."""
    path = f"force.{name}"
    if name in scene.point_springs():
        yield Demand(f"the turning line of {path}", Feature.POINT_SPRING, path)
    elif name in scene.turning_bushings():
        yield Demand(f"the bushing {path}", Feature.MECHANISM, path)
    elif scene.turns_by_choice and isinstance(spring, Spring) and not spring.tabled:
        yield Demand(f"the fixed direction of {path}, which may be left out,", Feature.SPRING, path)
    else:
        yield Demand(path, Feature.SPRING, path)
        if spring.elastic:
            yield Demand(f"the interface of {path}", Feature.ELASTIC_SPRING, path)
        if not spring.linear:
            yield Demand(f"the force of {path}, which is not a stiffness alone,", Feature.SPRING_TABLE, path)
        if spring.damped:
            yield Demand(f"damping of {path}", Feature.SPRING_DAMPING, path)
