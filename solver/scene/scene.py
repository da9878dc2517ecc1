"""The solver's part of a scene: bodies, contacts, and how long to run. SI units."""

import math
from collections.abc import Iterator, Mapping

from pydantic import BaseModel, Field, model_validator

from gudgeon.solver.capabilities import INTEGRATORS, Feature, Integrator
from gudgeon.solver.forces import Force
from gudgeon.solver.forces.gas import GasPressure
from gudgeon.solver.forces.moving import MovingForce
from gudgeon.solver.forces.spring import Spring
from gudgeon.solver.joints import Joint
from gudgeon.solver.methods import METHODS
from gudgeon.solver.numbers import STRICT
from gudgeon.solver.scene.body import Body
from gudgeon.solver.scene.contact import Contact, MasterSurface, OtherBody
from gudgeon.solver.scene.run import Run


class Scene(BaseModel):
    """Everything the solver needs to know beside the records."""

    model_config = STRICT
    body: dict[str, Body] = Field(min_length=1)
    contact: dict[str, Contact] = {}
    joint: dict[str, Joint] = {}
    force: dict[str, Force] = {}
    run: Run

    @model_validator(mode="after")
    def _names(self) -> "Scene":
        named = [(f"contact.{name}.body", contact.body) for name, contact in self.contact.items()]
        named += [(f"contact.{name}.against.body", other.body) for name, other in self.others().items()]
        named += [(f"joint.{name}.body", joint.body) for name, joint in self.joint.items()]
        named += [(f"force.{name}.body", force.body) for name, force in self.force.items()]
        named += [(f"force.{n}.against", spring.against) for n, spring in self.springs().items() if spring.against]
        for where, body in named:
            if body not in self.body:
                raise ValueError(f"{where}: no body '{body}', the scene has {', '.join(self.body)}")
        for name, force in self.gas().items():
            if force.joint not in self.joint:
                have = ", ".join(self.joint) or "none"
                raise ValueError(f"force.{name}.joint: no joint '{force.joint}', the scene has {have}")
        for name, other in self.others().items():
            if other.body == self.contact[name].body:
                raise ValueError(f"contact.{name}.against.body: a contact needs two bodies")
        _ = self.integrator
        return self

    def masters(self) -> dict[str, MasterSurface]:
        """Return the master surface of each contact that has one."""
        return {n: c.against for n, c in self.contact.items() if isinstance(c.against, MasterSurface)}

    def others(self) -> dict[str, MasterSurface | OtherBody]:
        """Return the other body of each contact between two bodies."""
        return {n: c.against for n, c in self.contact.items() if isinstance(c.against, MasterSurface | OtherBody)}

    def given(self) -> dict[str, GasPressure | MovingForce]:
        """Return the forces that are given over time."""
        return {n: f for n, f in self.force.items() if isinstance(f, GasPressure | MovingForce)}

    def gas(self) -> dict[str, GasPressure]:
        """Return the gas pressures."""
        return {n: f for n, f in self.force.items() if isinstance(f, GasPressure)}

    def moving(self) -> dict[str, MovingForce]:
        """Return the forces that travel over a surface."""
        return {n: f for n, f in self.force.items() if isinstance(f, MovingForce)}

    def springs(self) -> dict[str, Spring]:
        """Return the springs."""
        return {n: f for n, f in self.force.items() if isinstance(f, Spring)}

    def carriers(self) -> list[str]:
        """Return the integrators that can carry the scene, in the order in which `auto` prefers them."""
        demands = dict(_demands(self))
        return [name for name in INTEGRATORS if not _lacking(demands, name)]

    @property
    def integrator(self) -> str:
        """The integrator that it names, or that `auto` takes for what the scene has.

        Raises:
            ValueError: the one that it names cannot carry what it has, or nothing can carry all that it has.
        """
        demands, able, named = dict(_demands(self)), self.carriers(), self.run.integrator
        if named == "auto":
            if able:
                return able[0]
            least = min((_lacking(demands, name) for name in INTEGRATORS), key=len)
            others = " and ".join(what for what in demands if what not in least)
            raise ValueError(f"run.integrator: none carries {least[0]} beside {others}; leave one of them out")
        if lacking := _lacking(demands, named):
            advice = f"take {' or '.join(map(repr, ('auto', *able)))}" if able else "none carries the whole scene"
            raise ValueError(f"run.integrator: '{named}' cannot carry {lacking[0]}; {advice}")
        if math.isinf(INTEGRATORS[named].order) and self.run.step is not None:
            raise ValueError(
                f"run.step: integrator '{named}' locates events on exact motion and has no step; leave it out"
            )
        return named

    @property
    def capabilities(self) -> type[Integrator]:
        """What this integrator can do."""
        return INTEGRATORS[self.integrator]

    def component_of(self, body: str) -> str:
        """Return the component that a body is made of."""
        return self.body[body].component or body


def _lacking(demands: Mapping[str, Feature], name: str) -> list[str]:
    """Return what asks for a feature that an integrator does not carry."""
    return [what for what, feature in demands.items() if feature not in INTEGRATORS[name].carries]


def _demands(scene: Scene) -> Iterator[tuple[str, Feature]]:
    """Yield what a scene has that not every integrator can carry, by the name of what asks for it."""
    for name, body in scene.body.items():
        if body.damping is not None:
            yield f"damping of body.{name}", Feature.DAMPING
        if body.gauges:
            yield f"body.{name}.gauges", Feature.GAUGES
    for name in scene.joint:
        yield f"joint.{name}", Feature.JOINT
    for name in scene.given():
        yield f"force.{name}", Feature.LOAD
    for name in scene.masters():
        yield f"the sliding pair contact.{name}", Feature.SLIDING_PAIR
    for name, contact in scene.contact.items():
        where = f"contact.{name}"
        if METHODS[contact.method].rigid:
            yield f"the rigid contact {where} (method '{contact.method}')", Feature.RIGID_CONTACT
        elif contact.smooth_law:
            yield f"the law of {where}", Feature.SMOOTH_LAW
        elif contact.law is not None:
            yield f"the linear law of {where}", Feature.LINEAR_LAW
        else:
            yield f"method '{contact.method}' of {where} without a law", Feature.COMPLIANT_CONTACT
        if contact.dashpot != "none":
            yield f"the dashpot of {where}", Feature.DASHPOT
    for name, spring in scene.springs().items():
        yield f"force.{name}", Feature.SPRING
        if spring.damping > 0:
            yield f"damping of force.{name}", Feature.SPRING_DAMPING
    if any(scene.run.gravity):
        yield "run.gravity", Feature.GRAVITY
