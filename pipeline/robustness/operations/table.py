"""The operations of robustness cases: a new one is a model in `scenes.robustness`, a function and a line here."""

from collections.abc import Callable
from typing import Any

from gudgeon.pipeline.robustness.operations import bodies, contacts, scaling, settings
from gudgeon.pipeline.robustness.operations.friction import friction
from gudgeon.pipeline.robustness.operations.scaling import in_units
from gudgeon.pipeline.robustness.subject import Subject
from gudgeon.pipeline.robustness.trial import Trial
from gudgeon.pipeline.robustness.units import Units

OPERATIONS: dict[str, Callable[[Subject, Any], Trial]] = {
    "contact-stiffness": contacts.contact_stiffness, "restitution": contacts.restitution, "grazing": contacts.grazing,
    "penetration": contacts.penetration, "spin": contacts.spin, "friction": friction,
    "mass": bodies.mass, "step": bodies.step, "poisson": bodies.poisson, "slivers": bodies.slivers,
    "turned": bodies.whole_turn, "repeated-joint": bodies.repeated_joint,
    "collinear": settings.collinear, "samples": settings.samples, "duration": settings.duration,
    "gravity": settings.gravity, "modes": settings.modes, "mesh": settings.mesh, "change": settings.change,
    "static-deflection": settings.static_deflection, "damping": settings.damping, "voltage": settings.voltage,
    "material": scaling.material, "gap": scaling.gap,
    "units": lambda subject, to: in_units(subject, Units(to.mass, to.length, to.time)),
    "size": lambda subject, to: in_units(subject, Units(to.factor**3, to.factor, to.factor)),
    "set": lambda subject, to: Trial(subject.changed(to.values)),
}  # fmt: skip
