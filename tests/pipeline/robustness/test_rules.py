"""Verdicts: every rule calls what is wrong wrong, and says nothing where it has nothing to say."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.robustness.evidence import Evidence, FirstContact, Impacts, Refusal
from gudgeon.pipeline.robustness.rules import RULES, Compared, Finding
from gudgeon.pipeline.robustness.units import Units
from gudgeon.pipeline.robustness.verdict import judge
from gudgeon.pipeline.scenes.robustness import Case

CONTACT = FirstContact(start=1e-3, impulse=4.0, duration=2e-4, force=3e4)
IMPACTS = Impacts(restitution=0.5, mass=2.0, closing=np.array([1.0]), approach=1.0, alone=True, impact=True)
SOUND = Evidence(
    frequencies={"rod": np.array([100.0, 200.0])}, shear={"rod": 8e10}, estimated=1e-3,
    orthogonality=1e-15, contact=replace(CONTACT, impulse=3.0), impacts=IMPACTS, integrator="event", energy_drift=1e-12,
    momentum_residual=1e-12, rise=1e-14, loss=0.75, exchanged=1.0, deepest=1e-6, penetration=1e-6,
    penetration_bound=2e-6, turned=0.1, unrest=1e-12, basis=1e-3, mesh=1e-3, changed=0.5, steps=100,
)  # fmt: skip
"""(1 + e) m v = 3, ½ m v² (1 − e²) = 0.75."""
LIKE = Compared(
    base=SOUND, units=Units(), stretch={"rod": 1.0}, agreement=0.01, same=0.01, factor=1e3
)  # fmt: skip
WRONG: dict[str, dict[str, Any]] = {
    "similarity": {"contact": replace(CONTACT, impulse=3.0 * (1 + 2e-9))},
    "frequencies": {"frequencies": {"rod": np.array([100.0, 200.0 * (1 + 2e-9)])}},
    "collision": {"contact": replace(CONTACT, impulse=3.0 * (1 + 2e-9))},
    "loss": {"loss": 0.75 + 2e-9},
    "agreement": {"contact": replace(CONTACT, impulse=3.04)},
    "nested": {"frequencies": {"rod": np.array([100.0, 200.1])}},
    "shear": {"frequencies": {"rod": np.array([100.0, 199.9])}},
    "resolved": {"estimated": 0.05},
    "momentum": {"momentum_residual": 2e-9},
    "energy": {"energy_drift": 2e-9},
    "creation": {"rise": 2e-9},
    "penetration": {"penetration": 2.1e-6},
    "monotone": {"deepest": 1.1e-6},
    "orthogonality": {"orthogonality": 2e-9},
    "rotation": {"turned": 1.1},
    "impact": {"contact": replace(CONTACT, impulse=3.0, force=3e4 * 1.011)},
    "basis": {"contact": replace(CONTACT, impulse=3.0 * 1.015)},
    "mesh": {"contact": replace(CONTACT, impulse=3.0 * 1.015)},
    "reuse": {"changed": 1.01},
    "rest": {"unrest": 2e-9},
}
"""What each rule must find."""
NOTHING = Evidence(integrator="event")


def case(*rules: str, refusal: bool = False) -> Case:
    operation = {"kind": "mass", "factor": 2.0}
    return Case.model_validate({"operation": operation, "rules": rules, "refusal": refusal})


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_holds_of_a_sound_run_and_not_of_a_wrong_one(rule: str) -> None:
    assert judge(case(rule), SOUND, LIKE).verdict == "right"
    verdict = judge(case(rule), replace(SOUND, **WRONG[rule]), LIKE)
    assert verdict.verdict == "wrong"
    assert verdict.deciding is not None
    assert verdict.deciding.rule == rule
    assert "allowed" in verdict.reason


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_is_silent_where_it_has_nothing_to_say_and_silence_is_not_right(rule: str) -> None:
    assert RULES[rule](NOTHING, Compared(base=NOTHING)) is None
    verdict = judge(case(rule), NOTHING, Compared(base=NOTHING))
    assert verdict.verdict == "wrong"
    assert f"none of the rules {rule} applies" in verdict.reason


def test_one_broken_rule_is_enough_and_the_sharpest_that_holds_is_named() -> None:
    both = case("similarity", "momentum")
    assert judge(both, replace(SOUND, momentum_residual=1.0), LIKE).deciding == Finding(
        "momentum", 1.0, 1e-9, "momentum balance"
    )
    good = judge(both, SOUND, LIKE)
    assert good.deciding is not None
    assert (good.deciding.rule, len(good.findings)) == ("similarity", 3)


def test_a_number_that_is_none_never_holds() -> None:
    assert not Finding("energy", float("nan"), 1.0, "").holds
    assert judge(case("energy"), replace(SOUND, energy_drift=float("nan")), LIKE).verdict == "wrong"


def test_a_run_that_touches_nothing_is_wrong_where_the_scene_touches() -> None:
    missed = judge(case("momentum", "energy"), replace(SOUND, contact=None), LIKE)
    assert missed.verdict == "wrong"
    assert "no contact occurs" in missed.reason


def test_a_refusal_is_refused_only_where_it_may_be() -> None:
    no = Refusal("contact.pair: 1 of 1 points start inside the obstacle")
    assert judge(case("energy", refusal=True), no, LIKE).verdict == "refused"
    wrong = judge(case("energy"), no, LIKE)
    assert wrong.verdict == "wrong"
    assert no.reason in wrong.reason


def test_bounds_follow_the_last_digit_and_no_more() -> None:
    heavy = replace(SOUND, momentum_residual=1e-5, momentum_round_off=1e-6)
    assert judge(case("momentum"), heavy, LIKE).verdict == "right"
    assert judge(case("momentum"), replace(heavy, momentum_residual=2e-5), LIKE).verdict == "wrong"
    falling = replace(heavy, pulled=True, steps=100)
    assert judge(case("momentum"), replace(falling, momentum_residual=6e-5), LIKE).verdict == "right"
    assert judge(case("momentum"), replace(falling, momentum_residual=7e-5), LIKE).verdict == "wrong"
    far = replace(SOUND, contact=replace(CONTACT, impulse=3.0 * (1 + 1e-6)), gap_round_off=1e-7)
    assert judge(case("similarity"), far, LIKE).verdict == "right"
    assert judge(case("similarity"), replace(far, gap_round_off=1e-8), LIKE).verdict == "wrong"
    assert judge(case("similarity"), far, replace(LIKE, measured=True)).verdict == "wrong"
    rings = replace(SOUND, contact=replace(CONTACT, impulse=3.0, force=3e4 * (1 + 1e-7)), force_round_off=2e-7)
    assert judge(case("similarity"), rings, LIKE).verdict == "right"
    assert judge(case("similarity"), replace(rings, force_round_off=1e-8), LIKE).verdict == "wrong"
    assert judge(case("similarity"), replace(far, gap_round_off=0.0, force_round_off=1.0), LIKE).verdict == "wrong"


def test_a_start_at_once_is_known_to_a_share_of_the_contact() -> None:
    """Bodies that all but touch: their gap is round-off, what comes of the impact is not."""
    near = replace(SOUND, contact=replace(CONTACT, start=1e-15), gap_round_off=1e3)
    wrong = replace(near, contact=replace(CONTACT, start=1e-15, impulse=4.1), gap_round_off=1e20)
    assert judge(case("similarity"), wrong, replace(LIKE, base=near)).verdict == "wrong"
    like = replace(LIKE, base=replace(near, contact=replace(CONTACT, start=0.0)))
    assert judge(case("similarity"), near, like).verdict == "right"
    late = replace(near, contact=replace(CONTACT, start=2e-9 * CONTACT.duration))
    assert judge(case("similarity"), late, like).verdict == "wrong"
    off = replace(near, contact=replace(CONTACT, start=1e-15, force=CONTACT.force * (1 + 2e-9)))
    assert judge(case("similarity"), off, like).verdict == "wrong"


def test_a_displacement_has_the_round_off_of_two_places() -> None:
    """A body a metre from the origin that comes back to 2e-8 m from where it began."""
    readings = {"a.displacement_x": (2e-8, "m"), "a.displacement_y": (1.0, "m")}
    like = replace(LIKE, base=replace(SOUND, contact=None, readings=readings), length=1.0)
    near = replace(SOUND, contact=None, readings=readings | {"a.displacement_x": (2e-8 + 4e-17, "m")})
    assert judge(case("similarity"), near, like).verdict == "right"
    assert judge(case("similarity"), near, replace(like, length=1e-3)).verdict == "wrong"
    off = replace(near, readings=readings | {"a.displacement_x": (2e-8 + 4e-15, "m")})
    assert judge(case("similarity"), off, like).verdict == "wrong"


def test_where_nothing_touches_nothing_overlaps() -> None:
    """Silence is not right; an overlap that nothing presses back is a contact that was missed."""
    alone = replace(SOUND, contact=None)
    verdict = judge(case("penetration"), alone, replace(LIKE, base=alone))
    assert (verdict.verdict, verdict.findings) == ("wrong", [])
    missed = judge(case("penetration"), replace(alone, penetration=1e-5), replace(LIKE, base=alone))
    assert missed.deciding is not None
    assert missed.deciding.rule == "penetration"


def test_what_is_no_number_or_was_nothing_is_not_the_same() -> None:
    lost = replace(SOUND, contact=replace(CONTACT, impulse=float("nan")))
    assert judge(case("similarity"), lost, LIKE).verdict == "wrong"
    assert judge(case("collision"), lost, LIKE).verdict == "wrong"
    still = replace(SOUND, contact=None, readings={"tip": (1.0, "m"), "side": (0.0, "m")})
    like = replace(LIKE, base=still)
    assert judge(case("similarity"), still, like).verdict == "right"
    moved = replace(still, readings={"tip": (1.0, "m"), "side": (2e-9, "m")})
    assert judge(case("similarity"), moved, like).verdict == "wrong"


def test_motions_across_are_round_off() -> None:
    across = replace(SOUND, contact=None, readings={"tip": (1.0, "m"), "across": (1e-17, "m")})
    found = replace(across, readings={"tip": (1.0, "m"), "across": (-3e-17, "m")})
    assert judge(case("similarity"), found, replace(LIKE, base=across)).verdict == "right"
    cycle, other = (replace(across, readings={"crank": (size, "m")}) for size in (1e-17, 5e-17))  # All came back.
    assert judge(case("similarity"), other, replace(LIKE, base=cycle, length=0.3)).verdict == "right"
    far = replace(across, readings={"crank": (1e-9, "m")})
    assert judge(case("similarity"), far, replace(LIKE, base=cycle, length=0.3)).verdict == "wrong"


def test_of_contacts_in_a_clearance_the_first_is_compared() -> None:
    """Later ones multiply round-off: of reference H1 1e-14 of a mass becomes 1.4e-5 of an impulse."""
    readings = {"tip": (1.0, "m"), "pin.impact1.start": (2e-4, "s"), "pin.impact1.impulse": (1.3, "N s")}
    loose = replace(SOUND, contact=None, integrator="turning", readings=readings)
    like = replace(LIKE, base=loose)
    late = replace(loose, readings=readings | {"tip": (1.02, "m")})
    assert judge(case("similarity"), late, like).verdict == "right"
    wrong = replace(loose, readings=readings | {"pin.impact1.impulse": (1.3 * (1 + 2e-9), "N s")})
    assert judge(case("similarity"), wrong, like).verdict == "wrong"


def test_a_larger_step_may_drift_as_its_square_and_no_more() -> None:
    own = replace(SOUND, integrator="small", energy_drift=1e-3, step=1e-6)
    larger = replace(own, energy_drift=8.9e-3, step=3e-6)
    like = replace(LIKE, base=own)
    assert judge(case("energy"), larger, like).verdict == "right"
    assert judge(case("energy"), replace(larger, energy_drift=9.1e-3), like).verdict == "wrong"
    assert judge(case("energy"), larger, replace(like, agreement=None)).verdict == "wrong"
    worse = replace(like, base=replace(own, energy_drift=1e-2))  # Which was not kept in the first place.
    assert judge(case("energy"), replace(larger, energy_drift=1.9e-2), worse).verdict == "wrong"
    exact = replace(own, integrator="event")
    assert judge(case("energy"), replace(larger, integrator="event"), replace(like, base=exact)).verdict == "wrong"


def test_units_are_taken_off_before_results_are_compared() -> None:
    units = Units(mass=1e-3, length=1e3, time=2.0)
    moved = FirstContact(CONTACT.start * 2, 3.0 * 0.5, CONTACT.duration * 2, CONTACT.force * 0.25)
    other = replace(SOUND, contact=moved)
    assert judge(case("similarity"), other, replace(LIKE, units=units)).verdict == "right"
    assert judge(case("similarity"), other, LIKE).verdict == "wrong"
    readings = replace(NOTHING, readings={"load.deflection_peak": (2.0, "m")})
    scaled = replace(NOTHING, readings={"load.deflection_peak": (2.0e3, "m")})
    assert judge(case("similarity"), scaled, Compared(base=readings, units=units)).verdict == "right"


def test_the_first_impact_may_neither_be_late_nor_change_its_impulse() -> None:
    for wrong in ({"start": 1.011e-3}, {"impulse": 3.031}, {"force": 2.96e4}):
        moved = replace(SOUND, contact=replace(CONTACT, **({"impulse": 3.0} | wrong)))
        assert judge(case("impact"), moved, LIKE).verdict == "wrong", wrong
    assert judge(case("impact"), replace(SOUND, contact=None), replace(LIKE, base=NOTHING)).findings == []


def test_a_larger_estimate_of_the_basis_covers_a_larger_error() -> None:
    other = replace(SOUND, contact=replace(CONTACT, impulse=3.0 * 1.05))
    assert judge(case("basis"), other, LIKE).verdict == "wrong"
    assert judge(case("basis"), replace(other, basis=0.02), LIKE).verdict == "right"


def test_what_a_run_says_of_its_step_is_a_refusal() -> None:
    """An estimate that covers the error, or a drift that is told; where the run says nothing it is wrong."""
    off = replace(SOUND, contact=replace(CONTACT, impulse=3.0 * 1.2))
    assert judge(case("agreement", refusal=True), replace(off, stepped=0.1), LIKE).verdict == "refused"
    assert judge(case("agreement", refusal=True), replace(off, stepped=0.02), LIKE).verdict == "wrong"
    assert judge(case("agreement", refusal=True), off, LIKE).verdict == "wrong"
    assert judge(case("agreement"), replace(off, stepped=0.1), LIKE).verdict == "wrong"
    drifts = replace(SOUND, energy_drift=0.02)
    assert judge(case("energy", refusal=True), drifts, LIKE).verdict == "refused"
    assert judge(case("energy", refusal=True), replace(SOUND, energy_drift=5e-4), LIKE).verdict == "wrong"


def test_surfaces_that_friction_moves_apart_are_judged_without_a_contact() -> None:
    """By the other rules, and by an overlap, where no contact was seen; of any other operation that is wrong."""
    moved = Case.model_validate(
        {"operation": {"kind": "friction", "coefficient": 0.3}, "rules": ["energy"], "refusal": False}
    )
    assert LIKE.base.contact is not None
    apart = replace(SOUND, contact=None)
    assert judge(moved, apart, LIKE).verdict == "right"
    assert judge(moved, replace(apart, **WRONG["energy"]), LIKE).verdict == "wrong"
    assert judge(moved, replace(apart, **WRONG["penetration"]), LIKE).deciding is not None
    assert judge(moved, replace(apart, **WRONG["penetration"]), LIKE).verdict == "wrong"
    assert judge(case("energy"), apart, LIKE).verdict == "wrong"


@pytest.mark.parametrize(("drift", "verdict"), [(1.2e-5, "right"), (2.3e-5, "right"), (2.5e-5, "wrong")])
def test_the_drift_of_equal_steps_is_that_of_the_run_compared(drift: float, verdict: str) -> None:
    """A mechanism in other units and in equal steps, which its integrator would not choose."""
    base = replace(SOUND, integrator="turning", energy_drift=1.2e-5)
    found = replace(base, energy_drift=drift)
    assert judge(case("energy"), found, Compared(base=base, equal_steps=True)).verdict == verdict
    assert judge(case("energy"), found, Compared(base=base)).verdict == "wrong"
    said = replace(base, energy_drift=5e-3)
    assert judge(case("energy"), said, Compared(base=said, equal_steps=True)).verdict == "wrong"


def test_a_record_that_contradicts_itself_is_wrong_in_every_case() -> None:
    found = judge(case("energy"), replace(SOUND, contradiction=("impulse of contact.wall", 100.0)), LIKE)
    assert found.verdict == "wrong"
    assert "record alike in what it says twice (impulse of contact.wall)" in found.reason
