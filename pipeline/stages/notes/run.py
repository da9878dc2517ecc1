"""Notes on a run: its steps, energy, gaps, edges of interfaces, probes, and what the solver says of it."""

import math
from collections.abc import Iterator

from gudgeon.modaldb.records.trajectory import NOTES
from gudgeon.pipeline.stages.notes.facts import Facts
from gudgeon.solver.capabilities import INTEGRATORS, UNTOUCHED

DRIFT = 1e-3
"""Energy drift above which a run gives a note."""
EDGE_SHARE = 1e-3
"""Share of a contact's impulse at the edge of its interface above which a run gives a note."""


def step_limit(facts: Facts) -> Iterator[str]:
    """Yield a note if a given step exceeded the limit of the integrator and was divided."""
    counts, run = facts.summary["counts"], facts.scene.run
    substeps = int(counts.get("substeps", 1))
    if substeps < 2:
        return
    name, critical = counts["integrator"], counts["critical_frequency"]
    integrator = INTEGRATORS[name]
    largest = integrator.largest if facts.scene.contact else min(integrator.largest, UNTOUCHED)
    limits = [factor for factor in (largest, integrator.sticking, integrator.resolving) if factor is not None]
    factor = next(f for f in limits if f is limits[-1] or math.ceil(run.step * critical / f * (1 - 1e-12)) >= substeps)
    limit = f"{factor:g}/ω_c" + (f" = {factor / critical:.3g} s" if critical > 0 else "")
    yield (
        f"run.step: {run.step:g} s exceeds the limit of integrator '{name}', {limit}; each step was divided into"
        f" {substeps} substeps"
    )


def edges(facts: Facts) -> Iterator[str]:
    """Yield a note for each contact that reached the edge of an interface that covers a part of its surface."""
    for name, contact in facts.scene.contact.items():
        fraction = facts.summary["quantities"].get(f"{name}.edge_share", {"value": 0.0})["value"]
        if fraction > EDGE_SHARE:
            interface = f"component.{facts.scene.component_of(contact.body)}.interface.{contact.interface}"
            yield (
                f"{fraction:.1%} of the impulse of contact {name} acts at the edge of {interface}; the contact area may"
                " extend beyond the interface: enlarge it"
            )


def energy(facts: Facts) -> Iterator[str]:
    """Yield a note where the energy balance of a finished run has a noticeable error."""
    drift, name, run = facts.summary["energy_drift"], facts.summary["counts"]["integrator"], facts.scene.run
    if drift <= DRIFT or not facts.finished:
        return
    remedy = "reduce run.step" if run.step is not None else "reduce run.accuracy"
    if run.step is None and not run.checks and not INTEGRATORS[name].own_steps:
        remedy = "set run.checks = true, so that the step is controlled, or a smaller run.step"
    yield f"the energy balance has an error of {drift:.2%} of the energy exchanged (integrator '{name}'); {remedy}"


def gaps(facts: Facts) -> Iterator[str]:
    """Yield a note where no contact of a finished run touched, with the smallest gap."""
    quantities = facts.summary["quantities"]
    smallest = {name: quantities.get(f"{name}.least_gap") for name in facts.scene.contact}
    untouched = {name: gap["value"] for name, gap in smallest.items() if gap is not None}
    if not facts.finished or not untouched:
        return
    if len(untouched) < len(smallest):
        yield from _between_frames(facts, untouched)
        return
    name = min(untouched, key=lambda contact: untouched[contact])
    time = quantities[f"{name}.least_gap_time"]["value"]
    yield (
        f"no contact touched; the smallest gap was {untouched[name]:.3g} m, of contact {name} at {time:.3g} s; if a"
        " contact is expected, increase run.duration, or change the positions or velocities of the bodies"
    )


def _between_frames(facts: Facts, untouched: dict[str, float]) -> Iterator[str]:
    """Yield a note for each contact of elastic bodies that did not touch while others did."""
    run, others = facts.scene.run, facts.scene.others()
    for name, gap in untouched.items():
        sides = [facts.scene.contact[name].body, *([others[name].body] if name in others else [])]
        if any(len(facts.modes[facts.scene.component_of(body)].angular_frequencies) for body in sides):
            yield (
                f"{name}.least_gap: {gap:.3g} m is of the {run.frames} frames, {run.duration / run.frames:.3g} s apart;"
                " impacts of other contacts may bring it closer between them: increase run.frames"
            )


def probes(facts: Facts) -> Iterator[str]:
    """Yield a note for each probe that reads a point next to the one of the scene."""
    if not facts.scene.probe:
        return
    record = facts.store.get(facts.job.trajectory().key, "trajectory", only=["times", "probes"])
    for name, probe in record.probes.items():
        if probe.snapped > 0:
            yield f"probe.{name}.at: the nearest point of its interface is read, {probe.snapped:.3g} m away"


def solver(facts: Facts) -> Iterator[str]:
    """Yield the notes that the solver itself gives."""
    for name in NOTES:
        yield from str(facts.summary["counts"].get(name, "")).splitlines()
