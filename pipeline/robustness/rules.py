"""Rules for the result of a run, invariants and limits for any parameters. A new one is a function and a line.

A rule returns a finding, or None if it does not apply: a scene without free bodies has no momentum balance. Bounds
follow from the promised drift of the integrators or from round-off; none is fitted to a scene.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

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
SEEN = 1e-3
"""Share of the allowed overlap above which the overlaps of frames are compared."""
SETTLED = 0.01
"""Allowed relative decrease of a frequency by splitting a few elements."""
SCALED = ("s", "m", "N", "N s")
"""Units of the readings that are compared."""


@dataclass(frozen=True)
class Compared:
    """The run that a case is compared with, and how both must differ; see `trial.Trial`."""

    base: Evidence
    units: Units | None = None
    stretch: dict[str, float] | None = None
    agreement: float | None = None
    factor: float | None = None
    measured: bool = False


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


def similarity(found: Evidence, compared: Compared) -> Finding | None:
    """The first contact is the same but for the units, or, without contact, the readings are."""
    units, base = compared.units, compared.base
    if units is None:
        return None
    places = 0.0 if compared.measured else ROUND_OFFS * (found.gap_round_off + base.gap_round_off)
    pairs: list[tuple[float, float]] = []
    """Relative differences and their bounds."""
    if base.contact is not None:
        one, other = found.contact, base.contact
        if one is None:
            return Finding("similarity", np.inf, SAME, "first contact in other units (there is none)")
        # A start near zero is compared relative to the duration of the contact.
        span = max(other.start, other.duration) or 1.0
        places *= other.start / span
        pairs.append((abs(one.start / units.of("s") - other.start) / span, SAME + places))
        for name, unit in (("impulse", "N s"), ("duration", "s"), ("force", "N")):
            rings = found.force_round_off + base.force_round_off if name == "force" else 0.0
            apart = _apart(getattr(one, name) / units.of(unit), getattr(other, name))
            pairs.append((apart, SAME + places + rings))
    else:
        largest: dict[str, float] = {}
        for value, unit in base.readings.values():
            largest[unit] = max(largest.get(unit, 0.0), abs(value))
        for name, (value, unit) in base.readings.items():
            if unit in SCALED and name in found.readings and (size := largest.get(unit, 0.0)) > 0:
                apart = abs(found.readings[name][0] / units.of(unit) - value) / (abs(value) or size)
                pairs.append((apart, SAME + places))
    if not pairs:
        return None
    what = "first contact" if base.contact is not None else "readings"
    value, bound = max(pairs, key=lambda pair: pair[0] / pair[1] if np.isfinite(pair[0]) else np.inf)
    return Finding("similarity", value, bound, f"{what} the same in other units")


def frequencies(found: Evidence, compared: Compared) -> Finding | None:
    """Every frequency changes by a known factor."""
    if compared.stretch is None or not compared.base.frequencies:
        return None
    worst = 0.0
    for name, before in compared.base.frequencies.items():
        after = found.frequencies.get(name, np.empty(0)) / compared.stretch[name]
        if len(after) != len(before):
            return Finding("frequencies", np.inf, SAME, "as many frequencies as before")
        worst = max(worst, float(np.abs(after / before - 1).max()))
    return Finding("frequencies", worst, SAME, "frequencies change by a known factor")


def collision(found: Evidence, compared: Compared) -> Finding | None:
    """The impulse of the first impact between rigid bodies is (1 + e) m v."""
    impacts = found.impacts
    if impacts is None or impacts.restitution is None or not impacts.alone or not impacts.approach > 0:
        return None
    if found.contact is None:
        return Finding("collision", np.inf, SAME, "impulse (1 + e) m v (there is none)")
    expected = (1 + impacts.restitution) * impacts.mass * impacts.approach
    integrator = INTEGRATORS[found.integrator]
    bound = SAME if math.isinf(integrator.order) else 10 * integrator.promised_drift
    return Finding("collision", _apart(found.contact.impulse, expected), bound, "impulse (1 + e) m v")


def loss(found: Evidence, compared: Compared) -> Finding | None:
    """The energy lost by impacts of known restitution is Σ ½ m v² (1 − e²)."""
    impacts = found.impacts
    if impacts is None or not impacts.impact or impacts.restitution is None or not len(impacts.closing):
        return None
    expected = float((0.5 * impacts.mass * impacts.closing**2).sum() * (1 - impacts.restitution**2))
    whole = max(float((0.5 * impacts.mass * impacts.closing**2).max()), abs(found.loss))
    return Finding("loss", abs(found.loss - expected) / whole, SAME, "loss Σ ½ m v² (1 − e²)") if whole > 0 else None


def agreement(found: Evidence, compared: Compared) -> Finding | None:
    """The impulse of the first contact, or without contact the displacements, agree with those of another run."""
    if compared.agreement is None:
        return None
    base = compared.base
    if base.contact is not None:
        if found.contact is None:
            return Finding("agreement", np.inf, compared.agreement, "first contact (there is none)")
        value = abs(found.contact.impulse / base.contact.impulse - 1)
        return Finding("agreement", value, compared.agreement, "impulse of the first contact")
    pairs = [(found.readings[n][0], v) for n, (v, u) in base.readings.items() if u == "m" and n in found.readings]
    size = max((abs(b) for _, b in pairs), default=0.0)
    if size == 0:
        return None
    return Finding("agreement", max(abs(a - b) for a, b in pairs) / size, compared.agreement, "displacements")


def nested(found: Evidence, compared: Compared) -> Finding | None:
    """A mesh whose space contains that of another has slightly lower frequencies (Rayleigh)."""
    rises, falls = [], []
    for name, before in compared.base.frequencies.items():
        after = found.frequencies.get(name)
        if after is None or len(after) != len(before):
            continue
        rises.append(float((after / before - 1).max()))
        falls.append(float((1 - after / before).max()))
    if not rises:
        return None
    if max(falls) > SETTLED:
        return Finding("nested", max(falls), SETTLED, "split elements change frequencies by little")
    return Finding("nested", max(rises), SAME, "split elements lower frequencies (Rayleigh)")


def shear(found: Evidence, compared: Compared) -> Finding | None:
    """ω²/G never decreases with rising Poisson's ratio (Rayleigh)."""
    falls = []
    for name, before in compared.base.frequencies.items():
        after = found.frequencies.get(name)
        if after is not None and len(after) == len(before) and found.shear[name] <= compared.base.shear[name]:
            ratio = (after / before) ** 2 * compared.base.shear[name] / found.shear[name]
            falls.append(float((1 - ratio).max()))
    return Finding("shear", max(falls), SAME, "ω²/G rises with ν (Rayleigh)") if falls else None


def resolved(found: Evidence, compared: Compared) -> Finding | None:
    """The estimated error of the elements stays small, or as it was: they do not lock."""
    if found.estimated is None:
        return None
    bound = max(ACCEPTED, LOCKING_RATIO * (compared.base.estimated or 0.0))
    return Finding("resolved", found.estimated, bound, "estimated error of frequencies")


def momentum(found: Evidence, compared: Compared) -> Finding | None:
    """The change of momentum of free bodies equals the impulses on them."""
    if found.momentum_residual is None:
        return None
    bound = BALANCED + ROUND_OFFS * found.momentum_round_off
    return Finding("momentum", found.momentum_residual, bound, "momentum balance")


def energy(found: Evidence, compared: Compared) -> Finding | None:
    """The energy balance is constant, relative to the energy exchanged."""
    if found.energy_drift is None or not found.exchanged > 0:
        return None
    return Finding("energy", found.energy_drift, _kept(found, compared), "energy balance")


def creation(found: Evidence, compared: Compared) -> Finding | None:
    """The mechanical energy minus the work of the loads never increases; dissipated energy is not included."""
    if found.rise is None:
        return None
    return Finding("creation", found.rise, _kept(found, compared), "mechanical energy does not increase")


def penetration(found: Evidence, compared: Compared) -> Finding | None:
    """Surfaces overlap by no more than the energy of the run allows."""
    if found.penetration is None or found.penetration_bound is None:
        return None
    if found.contact is None and found.penetration <= found.penetration_bound:
        return None  # Without contact the overlap is no proof.
    return Finding(
        "penetration", found.penetration, found.penetration_bound, "overlap within what the energy allows [m]"
    )


def monotone(found: Evidence, compared: Compared) -> Finding | None:
    """Stiffer surfaces overlap less, softer ones more."""
    factor, before, after = compared.factor, compared.base.penetration, found.penetration
    if factor is None or before is None or after is None or compared.base.penetration_bound is None:
        return None
    if before < SEEN * compared.base.penetration_bound:
        return None
    value, bound = (after, before) if factor > 1 else (before, after)
    return Finding("monotone", value, bound * (1 + SAME), "stiffer surfaces overlap less [m]")


def orthogonality(found: Evidence, compared: Compared) -> Finding | None:
    """ΦᵀMΦ = I."""
    if found.orthogonality is None:
        return None
    return Finding("orthogonality", found.orthogonality, ORTHONORMAL, "modes are orthonormal")


RULES: dict[str, Callable[[Evidence, Compared], Finding | None]] = {
    "similarity": similarity, "frequencies": frequencies, "collision": collision, "loss": loss,
    "agreement": agreement, "nested": nested, "shear": shear, "resolved": resolved, "momentum": momentum,
    "energy": energy, "creation": creation, "penetration": penetration, "monotone": monotone,
    "orthogonality": orthogonality,
}  # fmt: skip


def _kept(found: Evidence, compared: Compared) -> float:
    """Return the allowed energy drift.

    An integrator promises it at the step of the unchanged scene. With a larger step the drift may grow by the order of
    the integrator, unless it conserves energy: faster growth means that it does not converge.
    """
    integrator, base = INTEGRATORS[found.integrator], compared.base
    promised, drifts = integrator.promised_drift, not (integrator.own_steps or integrator.conserves_energy)
    stretched = compared.agreement is not None and base.integrator == found.integrator and drifts
    if stretched and base.energy_drift is not None and found.step > base.step > 0:
        promised = max(promised, min(promised, base.energy_drift) * (found.step / base.step) ** integrator.order)
    return promised + PER_STEP * found.steps + ROUND_OFFS * found.energy_round_off


def _apart(one: float, other: float) -> float:
    """Return the relative difference of two numbers; 0 where both are 0."""
    return 0.0 if one == other else abs(one - other) / max(abs(one), abs(other))
