"""What a report sweeps, and what its numbers say: settings, chains, and the cheapest setting."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.report.choice import choose, doubtful
from gudgeon.pipeline.report.convergence import chain, converges, order_of, settling
from gudgeon.pipeline.report.document import Chain, Choice, Quantity, Run
from gudgeon.pipeline.report.front import with_front
from gudgeon.pipeline.report.sweep import Setting, able_settings, basis_of, finer, scheme_of, settings_of
from gudgeon.pipeline.stages.job import Job, variant
from tests.scenes import scene_path


def job(scene: str, **report: Any) -> Job:
    """Return a scene with nothing but this in what its report sweeps."""
    bare = variant(open_job(scene_path(scene)), {"report": {"models": "unset", "sweep": "unset"}})
    return variant(bare, {"report": report})


def names(scene: str) -> list[str]:
    return [setting.name for setting in settings_of(job(scene))]


def test_models_are_crossed_with_the_sweep() -> None:
    models = {"plain": {}, "dashpot": {"contact": {"wall": {"dashpot": "wave-guide"}}}}
    sweep = {"component.rod.modes.normal_count": [10, 20], "run.step": [1e-6, 5e-7]}
    found = settings_of(job("rod-wall", models=models, sweep=sweep))
    assert [setting.name for setting in found] == [
        f"{model}, {modes} modes, {step} µs" for model in models for modes in (10, 20) for step in ("1", "0.5")
    ]
    assert found[-1].changes == {
        "contact": {"wall": {"dashpot": "wave-guide"}},
        "component": {"rod": {"modes": {"normal_count": 20}}},
        "run": {"step": 5e-7},
    }


def test_stars_mean_all_elastic_components() -> None:
    sweep = {"component.*.modes.normal_count": [7]}
    (beam,) = settings_of(job("beam-sphere", sweep=sweep))
    assert beam.changes == {"component": {"beam": {"modes": {"normal_count": 7}}}}  # The ball is rigid.
    (both,) = settings_of(job("bars-transverse", sweep=sweep))
    assert both.changes["component"].keys() == {"upper", "lower"}


def test_default_sweep() -> None:
    found = names("rod-wall")
    assert found[:5] == ["25 modes", "50 modes", "100 modes", "200 modes", "reduction ritz"]
    assert {"integrator event", "penalty"} <= set(found[5:])
    assert names("rigid") == ["as in the scene", "integrator small"]
    assert names("hertz") == ["as in the scene"]
    assert names("four-bar") == ["as in the scene", "accuracy 0.0001", "accuracy 1e-06"]


def test_what_contradicts_itself_is_left_out_with_its_reason() -> None:
    scene = job("hertz")
    bad = Setting("integrator turning", {"run": {"integrator": "turning"}}, named=False)
    fine = Setting("", {})
    able, left_out = able_settings(scene, [bad, fine])
    assert able == [fine]
    assert [one["name"] for one in left_out] == [bad.name]
    assert "'turning' does not support" in left_out[0]["why"]
    with pytest.raises(InputError, match="no setting is admissible"):
        able_settings(scene, [bad])
    with pytest.raises(InputError, match="'turning' does not support"):
        able_settings(scene, [Setting("turning", {"run": {"integrator": "turning"}})])


def test_schemes_hold_all_but_basis_and_step() -> None:
    scene = job("rod-wall")
    same = [{}, {"component": {"rod": {"modes": {"normal_count": 9, "reduction": "ritz"}}}}, {"run": {"step": 1e-7}}]
    assert len({scheme_of(variant(scene, changes)) for changes in same}) == 1
    assert len({basis_of(variant(scene, changes)) for changes in same}) == 2
    others = [{"contact": {"wall": {"dashpot": "wave-guide"}}}, {"run": {"duration": 1e-4}}]
    assert len({scheme_of(variant(scene, changes))[0] for changes in [*others, {}]}) == 3
    assert scheme_of(variant(scene, others[0]))[1] == "residual, dashpot, small"


def test_finer_runs_tell_the_time_error() -> None:
    stepped, turning, located = job("rod-wall"), job("four-bar"), job("two-mass")
    assert [one.changes["run"] for one in finer(stepped, Setting("a", {}), 4e-7)] == [{"step": 2e-7}, {"step": 1e-7}]
    assert [one.changes["run"]["accuracy"] for one in finer(turning, Setting("a", {}), 1e-8)] == pytest.approx([1e-10])
    assert finer(located, Setting("a", {}), 1.0) == []


# Convergence


@pytest.mark.parametrize(
    ("differences", "verdict"),
    [
        ([0.4, 0.1, 0.0], True),
        ([0.4, 0.39, 0.38, 0.0], False),  # The finest stands apart: nothing was approached.
        ([0.1, 0.4, 0.0], False),
        ([8e-4, 9e-4, 0.0], True),  # Settled, though without a trend.
        ([0.4, 0.0], None),
        ([math.inf, 0.1, 0.0], False),
    ],
)
def test_convergence(differences: list[float], verdict: bool | None) -> None:
    assert converges(differences) is verdict


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0])
def test_order_allows_for_the_finest_run_being_no_truth(order: float) -> None:
    steps = np.array([8.0, 4.0, 2.0, 1.0])
    assert order_of(steps, 0.3 * (steps**order - 1.0)) == pytest.approx(order, abs=0.03)


def test_order_is_not_fitted_to_round_off() -> None:
    assert order_of([4.0, 2.0, 1.0], [1e-13, 1e-15, 0.0]) is None
    assert order_of([4.0, 2.0, 1.0], [0.1, math.inf, 0.0]) is None


def test_words() -> None:
    runs = ["4 µs", "2 µs", "1 µs"]
    settled = chain("basis", ["10", "20", "40"], [10, 20, 40], [0.3, 0.1, 0.0], [0.3, 0.1, 0.0])
    wandering = chain("step", runs, [4.0, 2.0, 1.0], [0.38, 0.38, 0.0], [0.38, 0.38, 0.0])
    assert settling("force", [settled, wandering]) == (
        False,
        "force does not converge with step over this sweep; the run before '1 µs' differs from it by 38.0%: not fitted",
    )
    other = chain("step", runs, [4.0, 2.0, 1.0], [0.4, 0.1, 0.0], [0.4, 0.1, 0.0])
    assert settling("force", [settled, other]) == (True, "converges with basis and step")
    lost = chain("step", runs, [4.0, 2.0, 1.0], [0.4, math.inf, 0.0], [0.4, math.inf, 0.0])
    assert settling("force", [lost]) == (False, "force does not converge with step over this sweep: not fitted")
    assert settling("force", []) == (None, "not tested: fewer than three runs")


# The cheapest setting


def run(name: str, error: float | None, cpu: float, **given: Any) -> Run:
    plain: dict[str, Any] = {
        "name": name, "kind": "reduced", "scheme": "", "settings": {name: 1}, "coordinates": 1, "result": "FINISHED",
        "errors": {"impulse": error} if error is not None else {}, "largest_error": error, "largest_of": "impulse",
        "truncation": None, "truncation_against": "", "time": None, "time_against": "", "energy_drift": 0.0,
        "momentum_residual": 0.0, "step": None, "steps": 1, "factorisations": None, "iterations": None,
        "cpu_seconds": cpu, "wall_seconds": cpu, "stages": {}, "peak_mib": None, "front": False,
    }  # fmt: skip
    return Run(**(plain | given))


def chosen(
    runs: list[Run], tolerance: float, counting: list[str] | None = None, quantities: Sequence[Quantity] = ()
) -> Choice:
    return choose(with_front(runs, counting), tolerance, quantities)


def test_cheapest_setting_that_meets_the_tolerance() -> None:
    runs = [
        run("dear", 1e-4, 9.0),
        run("cheap", 9e-3, 2.0),
        run("wrong", 0.2, 0.1),
        run("nodal", 1e-3, 0.5, kind="nodal"),
        run("failed", None, 0.01, result="DIVERGED"),
    ]
    assert chosen(runs, 0.01).run == "cheap"
    assert chosen(runs, 1e-3).run == "dear"
    none = chosen(runs, 1e-5)
    assert none.run is None
    assert none.why == "none meets 1e-05; nearest is dear, 1.0e-04 in impulse"
    assert chosen(runs[3:], 0.5).run is None


def test_errors_that_cancel_make_no_setting() -> None:
    lucky = run("lucky", 1e-3, 1.0, truncation={"impulse": 0.03}, time={"impulse": -0.029, "other": 0.5})
    sound = run("sound", 8e-3, 2.0, truncation={"impulse": 5e-3}, time={"impulse": 3e-3, "other": 0.5})
    found = chosen([lucky, sound], 0.01, ["impulse"])
    assert (found.run, found.error) == ("sound", 8e-3)
    none = chosen([lucky], 0.01, ["impulse"])
    assert none.why == "none meets 1%; nearest is lucky with a conservative error of 3.00%"
    assert chosen([lucky, sound], 0.01, ["impulse", "other"]).run is None


def test_the_front_is_by_what_is_chosen_on() -> None:
    """A lucky run is neither on the front nor does it push a sound one off."""
    lucky = run("lucky", 1e-3, 1.0, truncation={"impulse": 0.03})
    sound = run("sound", 8e-3, 2.0, truncation={"impulse": 5e-3})
    found = with_front([lucky, sound, run("beaten", 0.01, 3.0)])
    assert [one.conservative_error for one in found] == [0.03, 8e-3, 0.01]
    assert [one.front for one in found] == [True, True, False]


def test_a_largest_basis_that_is_the_reference_lacks_what_the_next_smaller_one_does() -> None:
    few = run("few", 0.2, 1.0, coordinates=10, truncation={"impulse": 0.19}, truncation_against="most")
    more = run("more", 0.03, 2.0, coordinates=20, truncation={"impulse": -0.02}, truncation_against="most")
    most = run("most", 1e-3, 3.0, coordinates=40)
    alone = run("alone", 1e-3, 4.0, coordinates=10)
    assert [one.conservative_error for one in with_front([few, more, most, alone], internal=True)] == [
        0.2,
        0.03,
        0.02,
        1e-3,
    ]
    assert [one.conservative_error for one in with_front([few, more, most, alone])] == [0.2, 0.03, 1e-3, 1e-3]


def test_runs_that_do_not_converge_are_not_chosen() -> None:
    chains = [Chain("step", ["lucky", "lucky / 2"], [2.0, 1.0], [1e-3, 0.2], [0.2, 0.0], False, None)]
    flagged = Quantity("impulse", "N s", "relative", 1.0, True, False, "", chains)
    runs = [run("lucky", 1e-3, 1.0), run("sound", 5e-3, 2.0)]
    assert doubtful([flagged], 0.01) == {"lucky", "lucky / 2"}
    assert chosen(runs, 0.01, ["impulse"], [flagged]).run == "sound"
    assert doubtful([replace(flagged, counts=False)], 0.01) == set()
    assert doubtful([flagged], 0.3) == set()


def test_the_energy_drift_alone_makes_no_setting() -> None:
    """Also where other quantities are compared, but none of them counts."""
    drift = Quantity("energy drift", "", "absolute", None, True, True, "", [])
    peak = Quantity("pin.force_peak", "N", "relative", 1.0, False, False, "", [])
    runs = [run("loose", 1e-9, 1.0, errors={"pin.force_peak": 0.4, "energy drift": 1e-9}, largest_of="energy drift")]
    found = chosen(runs, 0.01, ["energy drift"], [peak, drift])
    assert found.run is None
    assert found.why == "nothing counts but the energy drift: not pin.force_peak"
    counted = [replace(peak, counts=True), drift]
    assert chosen(runs, 0.5, ["energy drift", "pin.force_peak"], counted).run == "loose"


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ([-1e-6, 1e-7], "greater than 0"),
        ([0.0, 1e-7], "greater than 0"),
        ([1e-6, 1e-6], "different from each other"),
        ([float("inf"), 1e-6], "finite"),
        ([float("nan"), 1e-6], "finite"),
    ],
)
def test_nodal_steps_that_are_none(steps: list[float], message: str) -> None:
    with pytest.raises(InputError, match=f"^[^\n]*{message}[^\n]*$"):
        job("rod-wall", full_fe={"steps": steps})
