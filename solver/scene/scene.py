"""The solver's part of a scene: bodies, contacts, and how long to run. SI units."""

from pydantic import BaseModel, Field, model_validator

from gudgeon.solver.forces import Force
from gudgeon.solver.forces.gas import GasPressure
from gudgeon.solver.forces.moving import MovingForce
from gudgeon.solver.forces.spring import Spring
from gudgeon.solver.joints import Joint
from gudgeon.solver.methods import METHODS
from gudgeon.solver.numbers import STRICT
from gudgeon.solver.scene.body import Body
from gudgeon.solver.scene.contact import Contact, MasterSurface, OtherBody
from gudgeon.solver.scene.run import Integrator, Run


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
        choose(self)
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

    @property
    def integrator(self) -> Integrator:
        """The integrator that runs this scene."""
        return choose(self)

    def component_of(self, body: str) -> str:
        """Return the component that a body is made of."""
        return self.body[body].component or body


IMPLICIT: tuple[str, ...] = ("trapezoid",)
SMOOTH: tuple[str, ...] = ("collocation", "discrete-gradient")
PREFERRED: tuple[Integrator, ...] = ("kick", "trapezoid", "event", "collocation", "discrete-gradient")


def choose(scene: Scene) -> Integrator:
    """Return the integrator of a scene.

    Raises:
        ValueError: the one that it names cannot carry what it has, or nothing can carry all that it has.
    """
    demands, named = _demands(scene), scene.run.integrator
    able: list[Integrator] = [name for name in PREFERRED if not _unable(demands, name)]
    if named == "auto":
        if able:
            return able[0]
        least = min((_unable(demands, name) for name in PREFERRED), key=len)
        others = " and ".join(what for what in demands if what not in least)
        raise ValueError(f"run.integrator: none carries {least[0]} beside {others}; leave one of them out")
    if lacking := _unable(demands, named):
        advice = f"take {' or '.join(map(repr, ('auto', *able)))}" if able else "none carries the whole scene"
        raise ValueError(f"run.integrator: '{named}' cannot carry {lacking[0]}; {advice}")
    if named == "event" and scene.run.step is not None:
        raise ValueError("run.step: integrator 'event' locates events on exact motion and has no step; leave it out")
    return named


def carriers(scene: Scene) -> list[Integrator]:
    """Return the integrators that can carry a scene."""
    demands = _demands(scene)
    return [name for name in PREFERRED if not _unable(demands, name)]


def _unable(demands: dict[str, tuple[str, ...]], name: str) -> list[str]:
    return [what for what, able in demands.items() if name not in able]


def _demands(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Return what a scene has that not every integrator can carry, with those that can."""
    found: dict[str, tuple[str, ...]] = {}
    for name, body in scene.body.items():
        if body.damping is not None:
            found[f"damping of body.{name}"] = IMPLICIT
        if body.gauges:
            found[f"body.{name}.gauges"] = ("event", *SMOOTH, "kick")
    for name in [*(f"joint.{n}" for n in scene.joint), *(f"force.{n}" for n in scene.given())]:
        found[name] = IMPLICIT
    for name in scene.masters():
        found[f"the sliding pair contact.{name}"] = IMPLICIT
    for name, contact in scene.contact.items():
        where = f"contact.{name}"
        method = METHODS[contact.method]
        if method.rigid:
            found[f"the rigid contact {where} (method '{contact.method}')"] = method.integrators
        elif contact.smooth_law:
            found[f"the law of {where}"] = SMOOTH
        elif contact.law is not None:
            found[f"the linear law of {where}"] = ("event", *SMOOTH)
        else:
            found[f"method '{contact.method}' of {where} without a law"] = method.integrators
        if contact.dashpot != "none":
            found[f"the dashpot of {where}"] = ("event", "kick")
    for name, spring in scene.springs().items():
        found[f"force.{name}"] = ("event", *SMOOTH)
        if spring.damping > 0:
            found[f"damping of force.{name}"] = ("event",)
    if any(scene.run.gravity):
        found["run.gravity"] = ("event", *SMOOTH, "trapezoid")
    return found
