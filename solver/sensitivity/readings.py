"""Quantities with a derivative, as functions of the states of a run, with their derivatives by these."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.small.tape import Tape
from gudgeon.solver.ports.members import contact_ports, ports_of
from gudgeon.solver.scene.refusals import suggestion
from gudgeon.solver.system.system import System

POWER = 8
"""Of the norm of a force: the larger, the nearer it is to the largest force."""
SPAN = re.compile(r"(?P<name>[^\[\]]+)\[(?P<begin>[^\[\]:]*):(?P<end>[^\[\]:]*)\]")


@dataclass(frozen=True)
class Steps:
    """The states of a run and what they are of."""

    system: System
    tape: Tape
    dt: float
    """[s]"""


@dataclass(frozen=True)
class Reading:
    """A quantity of a run with its derivatives."""

    value: float
    means: np.ndarray
    """By the mean force of each port in each step, (S, p)."""
    ends: np.ndarray
    """By q and its rate at the end, (2, m)."""


Read = Callable[[Steps], Reading]


def reader(system: System, text: str) -> tuple[Read, str]:
    """Return the function of a quantity, `OWNER.name` or `CONTACT.impulse[BEGIN:END]` in seconds, and its unit.

    Raises:
        SceneError: the scene has no such quantity, or it has no derivative.
    """
    spanned = SPAN.fullmatch(text)
    owner, _, name = (spanned["name"] if spanned else text).partition(".")
    span = _span(text, spanned, system.scene.run.duration)
    if spanned and name != "impulse":
        raise SceneError(f"quantity '{text}': a time span is given, only the impulse of a contact takes one")
    contacts = {contact.name: index for index, contact in enumerate(system.contacts)}
    if owner in contacts and name in OF_CONTACTS:
        read, unit = OF_CONTACTS[name]
        return lambda steps: read(steps, contacts[owner], span), unit
    if owner in system.bodies and name in OF_BODIES:
        read_body, unit = OF_BODIES[name]
        if not system.bodies[owner].rigid_count and name != "energy":
            raise SceneError(f"quantity '{text}': the body does not move freely")
        return lambda steps: read_body(steps, owner), unit
    raise SceneError(f"quantity '{text}': {_unknown(text, owner, contacts, system.bodies)}")


def _unknown(text: str, owner: str, contacts: Iterable[str], bodies: Iterable[str]) -> str:
    """Return why a quantity is refused: its owner has no such one, or there is no such owner."""
    names = dict.fromkeys(contacts, tuple(OF_CONTACTS)) | dict.fromkeys(bodies, tuple(OF_BODIES))
    if owner in names:
        return f"it has no derivative here; {owner} has {', '.join(names[owner])}"
    able = [f"{member}.{name}" for member, keys in names.items() for name in keys]
    return f"is unknown, {suggestion(text, able)}the scene has {', '.join(able)}"


def _span(text: str, spanned: re.Match[str] | None, duration: float) -> tuple[float, float]:
    """Return begin and end of a span of time [s], the whole run by default."""
    if spanned is None:
        return 0.0, duration
    try:
        start, end = float(spanned["begin"] or 0.0), float(spanned["end"] or duration)
    except ValueError:
        raise SceneError(f"quantity '{text}': BEGIN and END are times [s], as in wall.impulse[0:1e-4]") from None
    if not 0 <= start < end <= duration:
        raise SceneError(f"quantity '{text}': {start:g} to {end:g} s; allowed: rising times from 0 to {duration:g} s")
    return start, end


def _resultants(steps: Steps, index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the mean force of a contact in each step [N], (S, 3), its ports (c,), and their directions (c, 3)."""
    contact = steps.system.contacts[index]
    normals = contact_ports(ports_of(steps.system), contact)
    return steps.tape.mean[:, normals] @ contact.directions, normals, contact.directions


def _of_resultants(steps: Steps, index: int, value: float, by_force: np.ndarray) -> Reading:
    """Return a reading from its derivatives by the resultant in each step, (S, 3)."""
    _, normals, directions = _resultants(steps, index)
    means = np.zeros(steps.tape.mean.shape)
    means[:, normals] = by_force @ directions.T
    return Reading(value, means, np.zeros((2, steps.tape.q.shape[1])))


def _shares(steps: Steps, span: tuple[float, float]) -> np.ndarray:
    """Return the part of each step that is in a span of time [s], (S,)."""
    edges = np.clip(steps.dt * np.arange(len(steps.tape.mean) + 1), *span)
    return np.diff(edges)


def _impulse(steps: Steps, index: int, span: tuple[float, float]) -> Reading:
    forces, _, _ = _resultants(steps, index)
    weights = _shares(steps, span)
    impulse = weights @ forces
    size = float(np.linalg.norm(impulse))
    return _of_resultants(steps, index, size, np.outer(weights, impulse / size if size > 0 else impulse))


def _power_means(steps: Steps, index: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the sizes of the resultant in each step [N], (S,), and their derivatives by it, (S, 3)."""
    forces, _, _ = _resultants(steps, index)
    sizes = np.linalg.norm(forces, axis=1)
    return sizes, np.divide(forces, sizes[:, None], out=np.zeros_like(forces), where=sizes[:, None] > 0)


def _force_norm(steps: Steps, index: int, span: tuple[float, float]) -> Reading:
    """(∫ F^(k+1) dt / ∫ F dt)^(1/k): the mean of F^k over the impulse, near to the largest force from below."""
    sizes, slopes = _power_means(steps, index)
    total, top = float(sizes.sum()), float(sizes.max(initial=0.0))
    if total == 0.0:
        return _of_resultants(steps, index, 0.0, slopes)
    scaled = sizes / top
    raised = float((scaled ** (POWER + 1)).sum()) * top
    value = top * (raised / total) ** (1 / POWER)
    by_size = value / POWER * ((POWER + 1) * scaled**POWER / raised - 1 / total)
    return _of_resultants(steps, index, value, by_size[:, None] * slopes)


def _force_duration(steps: Steps, index: int, span: tuple[float, float]) -> Reading:
    """(∫ F dt)² / ∫ F² dt: how long a constant force with the same impulse and the same mean square acts."""
    sizes, slopes = _power_means(steps, index)
    total, square = float(sizes.sum()), float((sizes**2).sum())
    if total == 0.0:
        return _of_resultants(steps, index, 0.0, slopes)
    value = steps.dt * total**2 / square
    by_size = value * (2 / total - 2 * sizes / square)
    return _of_resultants(steps, index, value, by_size[:, None] * slopes)


def _rebound_velocity(steps: Steps, index: int, span: tuple[float, float]) -> Reading:
    """The velocity of the contact's body along the impulse on it."""
    impulse = steps.dt * _resultants(steps, index)[0].sum(axis=0)
    size, body = float(np.linalg.norm(impulse)), steps.system.bodies[steps.system.contacts[index].body]
    velocity = body.centre_motion(steps.tape.v[-1, body.rigid])[:3]
    along = impulse / size if size > 0 else impulse
    value = float(velocity @ along)
    by_impulse = (velocity - value * along) / size if size > 0 else np.zeros(3)
    by_force = np.tile(steps.dt * by_impulse, (len(steps.tape.mean), 1))
    reading = _of_resultants(steps, index, value, by_force)
    reading.ends[1, body.rigid] = body.twists[:, :3] @ along
    return reading


def _motion_of(row: int, component: int) -> Callable[[Steps, str], Reading]:
    """Return the reading of a component of a body's displacement (row 0) or velocity (1) at the end."""

    def read(steps: Steps, name: str) -> Reading:
        body, tape = steps.system.bodies[name], steps.tape
        state = (tape.q[-1] - steps.system.position, tape.v[-1])[row]
        ends = np.zeros((2, len(state)))
        ends[row, body.rigid] = body.twists[:, component]
        return Reading(float(body.centre_motion(state[body.rigid])[component]), np.zeros(tape.mean.shape), ends)

    return read


def _energy(steps: Steps, name: str) -> Reading:
    """Kinetic and strain energy of a body's coordinates at the end of the run."""
    body, tape, stiffness = steps.system.bodies[name], steps.tape, steps.system.stiffness
    span_of_body = body.coordinates
    ends = np.zeros((2, len(stiffness)))
    ends[0, span_of_body], ends[1, span_of_body] = (stiffness * tape.q[-1])[span_of_body], tape.v[-1, span_of_body]
    value = 0.5 * float(ends[0] @ tape.q[-1] + ends[1] @ tape.v[-1])
    return Reading(value, np.zeros(tape.mean.shape), ends)


OF_CONTACTS: dict[str, tuple[Callable[[Steps, int, tuple[float, float]], Reading], str]] = {
    "impulse": (_impulse, "N s"),
    "force_norm": (_force_norm, "N"),
    "force_duration": (_force_duration, "s"),
    "rebound_velocity": (_rebound_velocity, "m/s"),
}
"""Quantities of contacts with their units."""
OF_BODIES: dict[str, tuple[Callable[[Steps, str], Reading], str]] = {
    **{f"displacement_{axis}": (_motion_of(0, i), "m") for i, axis in enumerate("xyz")},
    **{f"velocity_{axis}": (_motion_of(1, i), "m/s") for i, axis in enumerate("xyz")},
    **{f"rotation_{axis}": (_motion_of(0, 3 + i), "rad") for i, axis in enumerate("xyz")},
    **{f"angular_velocity_{axis}": (_motion_of(1, 3 + i), "rad/s") for i, axis in enumerate("xyz")},
    "energy": (_energy, "J"),
}
"""Quantities of bodies with their units."""
