"""Data that the solver reads of each record, the terms that it omits, and the reason for each."""

import math
from collections.abc import Collection, Iterable, Mapping
from functools import partial
from typing import Any

from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.stages.job import Job
from gudgeon.solver.capabilities import FEW_POINTS
from gudgeon.solver.joints.markers import Fixed
from gudgeon.solver.scene.holding import turning_cause
from gudgeon.solver.scene.scene import Scene

PLACES = {
    "points": "interfaces", "patch": "interfaces", "traction": "tractions",
    "mean": "loads", "pressure": "loads", "tie": "loads",
}  # fmt: skip
"""Group of a modal record that holds an interface, by the kind of the interface."""

NUMBER = 8
"""Bytes of a number."""


def plan(job: Job) -> dict[str, Any]:
    """Return the terms that the solver reads and omits, with reason, fields and bytes, the ports of the scene, the
    bytes read in all, the integrator that the scene's features select, and those that the size of its contacts may."""
    from gudgeon.solver.ports.listing import port_rows
    from gudgeon.solver.system.terms.scene_terms import scene_terms
    from gudgeon.solver.system.terms.term import Stock

    rows, read, stocks, components = [], {}, {}, job.components()
    for body in job.scene.body:
        name = job.scene.component_of(body)
        component = job.scene.component[name]
        fields = [f"{PLACES[item.kind]}/{interface}" for interface, item in component.interface.items()]
        fields += [f"gauges/{gauge}" for gauge in component.gauge]
        elastic, swapped = component.modes.reduction != "rigid", component.modes.swap is not None
        weighs = job.scene.weighs(name)
        stocks[body] = Stock(elastic, bool(component.supports), swapped, weighs=weighs, places=tuple(fields))
    for term in scene_terms(job.scene, stocks):
        steps = components[job.scene.component_of(term.body)]
        keys = {"mesh": steps["mesh"].key, "modes": steps["modes"].key, "morph": steps["morph"].key}
        row, sizes = term_row(job.store, keys, term.body, (term.name, term.present, term.reason, term.fields))
        rows.append(row)
        if term.present:
            read |= {(term.body, path): size for path, size in sizes.items()}
    ports = [row._asdict() for row in port_rows(job.scene, partial(_port_count, job))]
    return {
        "scene": job.name,
        "terms": rows,
        "ports": ports,
        "bytes": total(read.values()),
        "integrator": job.scene.integrator,
        "by_size": by_size(job.scene),
        "stepping": _stepping(job.scene),
        "inertia": inertia_orders(job.scene, [name for name, stock in stocks.items() if stock.elastic]),
        "turning": turning_reason(job.scene),
    }


def inertia_orders(scene: Scene, elastic: Collection[str]) -> dict[str, str]:
    """Return of each body to which order its frame and its deformation are coupled by inertia, and in which frame.

    Args:
        elastic: Bodies that deform.
    """
    turns, orders = scene.capabilities.turns, {}
    for name, body in scene.body.items():
        if name not in elastic:
            orders[name] = "rigid, " + ("turns by any angle" if turns else "small motion")
        elif not turns:
            orders[name] = "elastic, small motion: frame and deformation are not coupled"
        else:
            frame = "of mean axes" if body.attachment == "mean-axis" else f"that turns with {body.attached_to}"
            order = "second order (geometric stiffness)" if body.geometric_stiffness else "first order"
            orders[name] = f"floating frame {frame}: couplings by displacements of {order}"
    return orders


def by_size(scene: Scene) -> dict[str, str]:
    """Return the other integrators that `auto` may take of the compiled scene, each with the size that decides."""
    name, carriers = scene.integrator, scene.carriers()
    if scene.run.integrator != "auto":
        return {}
    if name == "small" and "event" in carriers and scene.run.step is None and not scene.impulsive:
        return {"event": f"up to {FEW_POINTS} contact points"}
    if name == "event" and scene.contact and all(c.law is None for c in scene.contact.values()):
        return {"small": f"more than {FEW_POINTS} contact points, all over flexibility"}
    return {}


def turning_reason(scene: Scene) -> str:
    """Return which bound decided whether the bodies of a scene turn by any angle."""
    limit, duration = scene.run.limits.angle, scene.run.duration
    spins = {name: math.hypot(*body.angular_velocity) for name, body in scene.body.items()}
    fastest = max(spins, key=lambda name: spins[name])
    turned = (
        f"body '{fastest}' at {spins[fastest]:g} rad/s for {duration:g} s turns by {spins[fastest] * duration:.3g} rad"
    )
    bound = f"run.limits.angle, {limit:g} rad"
    if not scene.capabilities.turns:
        if holding := list(scene.held()):
            others = f" and {len(holding) - 1} more hold" if len(holding) > 1 else " holds"
            held_by = f"joint '{holding[0]}'{others} what deforms on the ground"
            return f"small motion: {held_by}, and nothing turns beyond {bound}"
        if spins[fastest] * duration > limit:
            return f"small motion: {scene.integrator} ends the run where a body turns beyond {bound}"
        return f"small motion: {turned if spins[fastest] else 'no body has an angular velocity'}, within {bound}"
    if joints := list(scene.hinges()):
        others = f" and {len(joints) - 1} more" if len(joints) > 1 else ""
        fixed = all(isinstance(h, Fixed) and h.against is None for h in scene.hinges().values())
        cause = turning_cause(scene.joint, scene.body, scene.probe, scene.run, scene.deforms) if fixed else None
        return f"any angle: joint '{joints[0]}'{others} of two markers" + (f", by {cause}" if cause else "")
    if scene.run.integrator == "turning":
        return "any angle: run.integrator is 'turning'"
    return f"any angle: {turned}, beyond {bound}"


def _stepping(scene: Scene) -> str | None:
    """Return which steps a mechanism takes; None of other integrators."""
    from gudgeon.solver.joints.clearance import Clearance

    if not scene.capabilities.turns:
        return None
    if scene.run.stepping != "auto":
        return scene.run.stepping
    if scene.contact or any(isinstance(h, Clearance) for h in scene.hinges().values()):
        return "explicit, since something touches"
    if any(body.attachment == "fixed" for body in scene.body.values()):
        return "explicit, by attachment 'fixed'"
    alternative = "implicit" if scene.joint else "exponential"
    return f"explicit, and {alternative} while frequencies of bodies bound those"


def _port_count(job: Job, body: str, interface: str) -> int | None:
    """Return the number of contact points or functions of an interface; None before their record exists."""
    steps = job.components()[job.scene.component_of(body)]
    for stage, path, each in (("morph", f"points/{interface}", 3), ("modes", f"tractions/{interface}/resultant", 6)):
        if job.store.has(steps[stage].key):
            size = job.store.sizes(steps[stage].key).get(path)
            if size is not None:
                return size // (each * NUMBER)
    return None


def term_row(
    store: Store, keys: Mapping[str, str], body: str, term: tuple[str, bool, str, tuple[str, ...]]
) -> tuple[dict[str, Any], dict[str, int | None]]:
    """Return one row of a plan, and the bytes of each field; None if its record does not exist yet.

    Args:
        keys: Keys of the records, by the name before the colon of a field.
        term: Name, presence, reason, and `record:path` of each field that is read.
    """
    name, present, reason, fields = term
    sizes = {field: _field_bytes(store, keys, field) for field in fields}
    row = {"body": body, "term": name, "present": present, "reason": reason, "fields": list(fields)}
    return row | {"bytes": total(sizes.values())}, sizes


def total(sizes: Iterable[int | None]) -> int | None:
    """Return the sum of bytes, or None if one of them is unknown."""
    counts = list(sizes)
    return None if None in counts else sum(size for size in counts if size is not None)


def _field_bytes(store: Store, keys: Mapping[str, str], field: str) -> int | None:
    record, _, path = field.partition(":")
    if not store.has(keys[record]):
        return None
    sizes = store.sizes(keys[record])
    return sum(size for name, size in sizes.items() if name == path or name.startswith(f"{path}/"))
