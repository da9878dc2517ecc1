"""Rules for the result of a run, invariants and limits for any parameters. A new one is a function and a line.

A rule returns a finding, or None if it does not apply: a scene without free bodies has no momentum balance. Bounds
follow from the promised drift of the integrators or from round-off; none is fitted to a scene.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from gudgeon.pipeline.reduction.accuracy import ACCEPTED, LOCKING_RATIO
from gudgeon.pipeline.robustness.evidence import Evidence
from gudgeon.pipeline.robustness.units import Units
from gudgeon.solver.capabilities import INTEGRATORS

SAME = 1e-9
"""Allowed relative difference of results that differ by round-off only."""
BALANCED = 1e-9
"""Allowed error of the momentum balance over the impulse."""
PER_STEP = 1e-16
"""Relative round-off of the energy balance in each step."""
ROUND_OFFS = 16.0
"""Allowed number of round-offs of a position, a momentum or an energy in a result."""
ORTHONORMAL = 1e-9
AT_REST = 1e-9
"""Allowed kinetic over strain energy of bodies that start in equilibrium."""
SEEN = 1e-3
"""Share of the allowed overlap above which the overlaps of frames are compared."""
SETTLED = 0.01
"""Allowed relative decrease of a frequency by splitting a few elements."""
COVERS = 4.0
"""Allowed error of the basis over its estimate: the largest ratio that docs/basis.md has above `STEPPED` is 2.3."""
STEPPED = 0.01
"""Error of the step that an impulse may have besides."""
SCALED = ("s", "m", "N", "N s")
"""Units of the readings that are compared."""
NOTHING = 1e-9
"""Share of the largest reading of a unit below which another is round-off, as motions across and those of a cycle."""
FIRST_IMPACT = (".impact1.start", ".impact1.end", ".impact1.impulse")
"""Last parts of the names of readings of the first impact in a joint with clearance."""
RETURNED = 1e-3
"""Displacement over the size of a mechanism below which it is back where it began: differences are over this."""
ALONG = ("_x", "_y", "_z")
"""Last parts of the names of readings along axes of the scene."""
SAID = 1e-3
"""Energy drift above which a run says so in a line; a given step may have less."""


@dataclass(frozen=True, kw_only=True)
class Compared:
    """The run that a run is compared with, and how both must differ."""

    base: Evidence = field(default_factory=Evidence)
    units: Units | None = None
    """Units, if it is the same scene in other units: its contact must be the same but for these."""
    stretch: Mapping[str, float] | None = None
    """Factor on each component's frequencies, if it is known."""
    agreement: float | None = None
    """Allowed relative difference of the first contact's impulse, if both must agree."""
    same: float | None = None
    """Allowed relative difference of the first impact's impulse and windowed force, if both must be the same."""
    factor: float | None = None
    """Factor on the stiffness of contacts."""
    alike: float = SAME
    """Allowed relative difference of readings in other units, where it is not that of round-off alone."""
    given_step: bool = False
    """Whether the run has a step that its integrator would not choose."""
    equal_steps: bool = False
    """Whether both runs have the same given step, of integrators that choose theirs: both have its drift."""
    turned: bool = False
    """Whether it is the same scene turned, so that components along the axes of the scene are others."""
    length: float = 0.0
    """Largest distance of a body from the origin, if bodies turn: positions have its round-off [m]."""
    measured: bool = False
    """Whether the units were taken from the gaps of the solver, so that round-off of positions has no effect."""


@dataclass(frozen=True)
class Finding:
    """The value and the bound of one rule, which holds if the value is at most the bound."""

    rule: str
    value: float
    bound: float
    rests_on: str
    """The invariant, as text."""

    @property
    def holds(self) -> bool:
        """Whether the rule holds; False if the value is not a number."""
        return bool(self.value <= self.bound)


def similarity(evidence: Evidence, compared: Compared) -> Finding | None:
    """The first contact is the same but for the units, or, without contact, the readings are."""
    units, base = compared.units, compared.base
    if units is None:
        return None
    # Errors of components along the axes choose its steps.
    chosen = compared.turned and _turns(evidence)
    same = INTEGRATORS[evidence.integrator].promised_drift if chosen else compared.alike * evidence.contrast
    same = max(same, evidence.passing)
    # A gap that is round-off itself may be any: its start is known to its own size.
    blur = min(evidence.gap_round_off, 1.0) + min(base.gap_round_off, 1.0)
    blur = 0.0 if compared.measured else ROUND_OFFS * blur
    if base.contact is not None and evidence.contact is None:
        return Finding("similarity", np.inf, same, "first contact in other units (there is none)")
    noun, differences = "readings", _reading_differences
    if base.contact is not None:
        noun, differences = "first contact", _contact_differences
    pairs = [(difference, same + blurs) for difference, blurs in differences(evidence, compared, units, blur)]
    if not pairs:
        return None
    value, bound = max(pairs, key=lambda pair: pair[0] / pair[1] if np.isfinite(pair[0]) else np.inf)
    return Finding("similarity", value, bound, f"{noun} the same in other units")


def _turns(evidence: Evidence) -> bool:
    """Return whether the bodies of a run turn by any angle."""
    return evidence.integrator in INTEGRATORS and INTEGRATORS[evidence.integrator].turns


def _contact_differences(
    evidence: Evidence, compared: Compared, units: Units, blur: float
) -> Iterator[tuple[float, float]]:
    """Yield the relative differences of first contacts, and what positions and ringing add to their bounds."""
    contact, reference = evidence.contact, compared.base.contact
    assert contact is not None
    assert reference is not None
    # A start near zero is compared relative to the duration of the contact.
    span = max(reference.start, reference.duration) or 1.0
    blur *= reference.start / span
    yield abs(contact.start / units.of("s") - reference.start) / span, blur
    for name, unit in (("impulse", "N s"), ("duration", "s"), ("force", "N")):
        ringing = evidence.force_round_off + compared.base.force_round_off if name == "force" else 0.0
        yield _apart(getattr(contact, name) / units.of(unit), getattr(reference, name)), blur + ringing


def _reading_differences(
    evidence: Evidence, compared: Compared, units: Units, blur: float
) -> Iterator[tuple[float, float]]:
    """Yield the relative differences of readings, and what positions add to their bounds."""
    readings = compared.base.readings
    largest = {"m": compared.length}
    for value, unit in readings.values():
        largest[unit] = max(largest.get(unit, 0.0), abs(value))
    # Each contact in a clearance multiplies differences: what is compared of such a motion is its first impact.
    impacts = {name: reading for name, reading in readings.items() if name.endswith(FIRST_IMPACT)}
    for name, (value, unit) in (impacts or readings).items():
        scaled = unit in SCALED and name in evidence.readings and largest.get(unit, 0.0) > 0
        if not scaled or (compared.turned and name.endswith(ALONG)):
            continue
        size = abs(value) if abs(value) > NOTHING * largest[unit] else largest[unit]
        # A displacement is the difference of two places.
        round_off = ROUND_OFFS * np.finfo(float).eps * compared.length / size if unit == "m" else 0.0
        yield abs(evidence.readings[name][0] / units.of(unit) - value) / size, blur + round_off


def frequencies(evidence: Evidence, compared: Compared) -> Finding | None:
    """Every frequency changes by a known factor."""
    if compared.stretch is None or not compared.base.frequencies:
        return None
    worst = 0.0
    for name, before in compared.base.frequencies.items():
        stretch = compared.stretch[name.partition(",")[0]]  # Harmonics of a wheel follow their sector.
        after = evidence.frequencies.get(name, np.empty(0)) / stretch
        if len(after) != len(before):
            return Finding("frequencies", np.inf, SAME * evidence.contrast, "as many frequencies as before")
        worst = max(worst, float(np.abs(after / before - 1).max()))
    return Finding("frequencies", worst, SAME * evidence.contrast, "frequencies change by a known factor")


def collision(evidence: Evidence, compared: Compared) -> Finding | None:
    """The impulse of the first impact between rigid bodies is (1 + e) m v."""
    impacts = evidence.impacts
    if impacts is None or impacts.restitution is None or not impacts.alone or not impacts.approach > 0:
        return None
    if evidence.contact is None:
        return Finding("collision", np.inf, SAME, "impulse (1 + e) m v (there is none)")
    expected = (1 + impacts.restitution) * impacts.mass * impacts.approach
    integrator = INTEGRATORS[evidence.integrator]
    bound = SAME if math.isinf(integrator.order) else 10 * integrator.promised_drift
    return Finding("collision", _apart(evidence.contact.impulse, expected), bound, "impulse (1 + e) m v")


def loss(evidence: Evidence, compared: Compared) -> Finding | None:
    """The energy lost by impacts of known restitution is Σ ½ m v² (1 − e²)."""
    impacts = evidence.impacts
    if impacts is None or not impacts.impact or impacts.restitution is None or not len(impacts.closing):
        return None
    expected = float((0.5 * impacts.mass * impacts.closing**2).sum() * (1 - impacts.restitution**2))
    size = max(float((0.5 * impacts.mass * impacts.closing**2).max()), abs(evidence.loss))
    return Finding("loss", abs(evidence.loss - expected) / size, SAME, "loss Σ ½ m v² (1 − e²)") if size > 0 else None


def agreement(evidence: Evidence, compared: Compared) -> Finding | None:
    """The impulse of the first contact, or without contact the displacements, agree with those of another run; of
    joints with clearance, whose contacts multiply differences, the first impacts."""
    allowed, base, contact = compared.agreement, compared.base, evidence.contact
    if allowed is None:
        return None
    if base.contact is not None:
        if contact is None:
            return Finding("agreement", np.inf, allowed, "first contact (there is none)")
        value = abs(contact.impulse / base.contact.impulse - 1)
        return Finding("agreement", value, allowed, "impulse of the first contact")
    readings = evidence.readings
    impacts = [(n, v) for n, (v, _) in base.readings.items() if n.endswith(FIRST_IMPACT) and v]
    if impacts:
        value = max(abs(readings[n][0] / v - 1) if n in readings else np.inf for n, v in impacts)
        return Finding("agreement", value, allowed, "first impacts in joints")
    return _displacements(evidence, compared, allowed)


def _displacements(evidence: Evidence, compared: Compared, allowed: float) -> Finding | None:
    """Displacements, or capacitances, agree with those of another run, over the largest one."""
    readings = evidence.readings
    pairs = [(readings[n][0], v) for n, (v, unit) in compared.base.readings.items() if unit == "m" and n in readings]
    size = max((abs(b) for _, b in pairs), default=0.0)
    size = max(size, RETURNED * compared.length) if pairs else size  # A mechanism may end where it began.
    if size == 0:
        still = not any(value for value, unit in readings.values() if unit == "m")
        return Finding("agreement", 0.0, allowed, "nothing moves in either run") if still else None
    noun = "displacements" if evidence.integrator else "capacitances"
    return Finding("agreement", max(abs(a - b) for a, b in pairs) / size, allowed, noun)


def impact(evidence: Evidence, compared: Compared) -> Finding | None:
    """Impulse and windowed force of the first impact are those of another run, and both start within its duration."""
    contact, reference, allowed = evidence.contact, compared.base.contact, compared.same
    if allowed is None or contact is None or reference is None:
        return None
    late = abs(contact.start - reference.start) / (max(reference.start, reference.duration) or 1.0)
    value = max(late, _apart(contact.impulse, reference.impulse), _apart(contact.force, reference.force))
    return Finding("impact", value, allowed, "start, impulse and windowed force of the first impact")


def _covered(source: str, evidence: Evidence, compared: Compared) -> Finding | None:
    """The estimated error of a basis or mesh covers how far its first impulse is from that of a larger or finer one."""
    estimate = getattr(evidence, source)
    if estimate is None or evidence.contact is None or compared.base.contact is None:
        return None
    difference = _apart(evidence.contact.impulse, compared.base.contact.impulse)
    return Finding(
        source, difference, COVERS * estimate + STEPPED, f"impulse within the estimated error of the {source}"
    )


def nested(evidence: Evidence, compared: Compared) -> Finding | None:
    """A mesh whose space contains that of another has slightly lower frequencies (Rayleigh)."""
    pairs = _alike(evidence, compared)
    if not pairs:
        return None
    falls = max(float((1 - after / before).max()) for before, after in pairs.values())
    if falls > SETTLED:
        return Finding("nested", falls, SETTLED, "split elements change frequencies by little")
    rises = max(float((after / before - 1).max()) for before, after in pairs.values())
    return Finding("nested", rises, SAME * evidence.contrast, "split elements lower frequencies (Rayleigh)")


def shear(evidence: Evidence, compared: Compared) -> Finding | None:
    """ω²/G never decreases with rising Poisson's ratio (Rayleigh)."""
    falls = []
    for name, (before, after) in _alike(evidence, compared).items():
        if evidence.shear[name] <= compared.base.shear[name]:
            ratio = (after / before) ** 2 * compared.base.shear[name] / evidence.shear[name]
            falls.append(float((1 - ratio).max()))
    return Finding("shear", max(falls), SAME, "ω²/G rises with ν (Rayleigh)") if falls else None


def _alike(evidence: Evidence, compared: Compared) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the frequencies before and after of the components that have as many as before."""
    pairs = {n: (before, evidence.frequencies.get(n)) for n, before in compared.base.frequencies.items()}
    return {
        n: (before, after) for n, (before, after) in pairs.items() if after is not None and len(after) == len(before)
    }


def monotone(evidence: Evidence, compared: Compared) -> Finding | None:
    """Stiffer surfaces overlap less, softer ones more."""
    factor, before, after = compared.factor, compared.base.deepest, evidence.deepest
    if factor is None or before is None or after is None or compared.base.penetration_bound is None:
        return None
    if before < SEEN * compared.base.penetration_bound:
        return None
    value, bound = (after, before) if factor > 1 else (before, after)
    return Finding("monotone", value, bound * (1 + SAME), "stiffer surfaces overlap less [m]")


def record(evidence: Evidence) -> Finding:
    """What the record of a run says twice is alike, see `gudgeon.solver.results.written`; a rule of every case."""
    name, value = evidence.contradiction
    return Finding("record", value, 1.0, f"record alike in what it says twice ({name})" if name else "record")


def _estimated(evidence: Evidence, compared: Compared) -> float:
    """Return the allowed error of elements that do not lock: small, or as it was."""
    return max(ACCEPTED, LOCKING_RATIO * (compared.base.estimated or 0.0))


def _balanced(evidence: Evidence, compared: Compared) -> float:
    """Return the allowed difference of the change of momentum of free bodies and the impulses on them."""
    turns = _turns(evidence)
    balanced = INTEGRATORS[evidence.integrator].promised_drift if turns else BALANCED  # Reactions are integrated, too.
    if turns and compared.given_step:
        balanced = SAID
    # In every step the increment of a constant load is rounded alike, by up to half of the momentum's last digit.
    steps = 0.5 * evidence.steps if evidence.pulled else 0.0
    return balanced + (ROUND_OFFS + steps) * evidence.momentum_round_off


def _kept(evidence: Evidence, compared: Compared) -> float | None:
    """Return the allowed energy drift, relative to the energy exchanged; None if there is none.

    An integrator promises it at the step of the unchanged scene. With a larger step the drift may grow by the order of
    the integrator: faster growth means that it does not converge. An integrator that chooses its steps promises nothing
    for a step that is given: below `SAID` a run has nothing to say of it. Of the same scene in other units and in the
    same steps the drift is that of the run compared.
    """
    if not evidence.exchanged > 0:
        return None
    integrator, base = INTEGRATORS[evidence.integrator], compared.base
    promised, drifts = integrator.promised_drift, not integrator.own_steps
    stretched = compared.agreement is not None and base.integrator == evidence.integrator and drifts
    if stretched and base.energy_drift is not None and evidence.step > base.step > 0:
        promised = max(promised, min(promised, base.energy_drift) * (evidence.step / base.step) ** integrator.order)
    if compared.given_step and integrator.own_steps:
        promised = max(promised, SAID)
    if compared.equal_steps and base.energy_drift is not None:
        promised = max(promised, min(2 * base.energy_drift, SAID))
    return promised + PER_STEP * evidence.steps + ROUND_OFFS * evidence.energy_round_off


def _apart(a: float, b: float) -> float:
    """Return the relative difference of two numbers; 0 where both are 0."""
    return 0.0 if a == b else abs(a - b) / max(abs(a), abs(b))


def _pressed(evidence: Evidence, compared: Compared) -> float | None:
    """Return the overlap that the energy of the run allows [m]; None without contact, where less is no proof."""
    depth, bound = evidence.penetration, evidence.penetration_bound
    if evidence.contact is None and depth is not None and bound is not None and depth <= bound:
        return None
    return bound


BOUNDED: dict[str, tuple[str, Callable[[Evidence, Compared], float | None], str]] = {
    "resolved": ("estimated", _estimated, "estimated error of frequencies"),
    "momentum": ("momentum_residual", _balanced, "momentum balance"),
    "energy": ("energy_drift", _kept, "energy balance"),
    "creation": ("rise", _kept, "mechanical energy does not increase"),
    "penetration": ("penetration", _pressed, "overlap within what the energy allows [m]"),
    "reuse": ("changed", lambda evidence, compared: 1.0, "estimated change over change.tolerance"),
    "rotation": ("turned", lambda evidence, compared: 1.0, "no body turns beyond run.limits.angle"),
    "rest": ("unrest", lambda evidence, compared: AT_REST, "bodies in equilibrium stay at rest"),
    "orthogonality": ("orthogonality", lambda evidence, compared: ORTHONORMAL, "modes are orthonormal"),
}
"""Rules that a value of the evidence stays within a bound: the value, its bound and the invariant."""


def _bounded(rule: str, evidence: Evidence, compared: Compared) -> Finding | None:
    """Apply a rule of `BOUNDED`."""
    key, bound_of, rests_on = BOUNDED[rule]
    value = getattr(evidence, key)
    if value is None or (bound := bound_of(evidence, compared)) is None:
        return None
    return Finding(rule, value, bound, rests_on)


RULES: dict[str, Callable[[Evidence, Compared], Finding | None]] = {
    "similarity": similarity, "frequencies": frequencies, "collision": collision, "loss": loss,
    "agreement": agreement, "nested": nested, "shear": shear, "monotone": monotone,
    "impact": impact, "basis": partial(_covered, "basis"), "mesh": partial(_covered, "mesh"),
    **{rule: partial(_bounded, rule) for rule in BOUNDED},
}  # fmt: skip
