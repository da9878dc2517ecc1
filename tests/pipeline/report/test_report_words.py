"""Numbers of a report as people read them, and the tables that its command prints."""

import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from gudgeon.pipeline.cli.parser import build_parser
from gudgeon.pipeline.report.document import Chain, Choice
from gudgeon.pipeline.report.effort import Effort, command_text
from gudgeon.pipeline.report.page.output import report_text
from gudgeon.pipeline.report.page.page import axes_of
from gudgeon.pipeline.report.page.words import (
    change_text,
    error_text,
    seconds_text,
    setting_texts,
    size_text,
    tick_text,
    use_text,
    verdict,
)
from tests.pipeline import documents


@pytest.mark.parametrize(
    ("value", "measure", "text"),
    [
        (0.0123, "relative", "+1.23%"),
        (-0.0123, "relative", "−1.23%"),
        (-1.2e-6, "relative", "−1.2e-06"),
        (2.04e-6, "absolute", "+2.0e-06 J"),
        (-2.04e-6, "absolute", "−2.0e-06 J"),
        (0.0123, "L2", "1.23%"),
        (1e-5, "L2", "1.0e-05"),
        (0.0, "relative", "0"),
        (None, "relative", "–"),
        (float("nan"), "relative", "–"),
        (float("inf"), "relative", "–"),
    ],
)
def test_errors(value: float | None, measure: str, text: str) -> None:
    assert error_text(value, measure, "J") == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0 µs"), (2.5e-6, "2.5 µs"), (0.000792, "0.792 ms"), (0.05, "50 ms"), (0.1, "0.1 s"), (12.345, "12.3 s"),
     (99.96, "100 s"), (12345.6, "12,346 s"), (None, "–")],
)  # fmt: skip
def test_seconds(value: float | None, text: str) -> None:
    assert seconds_text(value) == text


def test_sizes_and_ticks() -> None:
    assert (size_text(-0.02), size_text(None)) == ("2.00%", "–")
    assert [tick_text(value) for value in (1.0, 0.05, 1e-4, 1e-5)] == ["100%", "5%", "0.01%", "1e-05"]


def test_settings_are_paths_as_the_command_line_takes_them() -> None:
    settings = {"run": {"integrator": "event"}, "component": {"a": {"modes": {"kept": ["x"], "normal_count": 3}}}}
    run = documents.run("a", None, 1.0, settings=settings)
    assert setting_texts(run) == [
        'run.integrator="event"',
        'component.a.modes.kept=["x"]',
        "component.a.modes.normal_count=3",
    ]


def test_verdict_names_the_run_or_says_why_there_is_none() -> None:
    document = documents.small()
    assert "--tolerance 1%" in verdict(document)
    met = Choice(0.05, "30 modes", {}, 0.0082, "impulse", 0.05, "the cheapest of 2")
    text = verdict(replace(document, choice=met))
    assert text == "30 modes meets 5%: error 0.82% (impulse), 50 ms of CPU time; the cheapest of 2"
    unmet = Choice(1e-4, None, None, 0.0031, "impulse", None, "nearest is 60 modes")
    assert verdict(replace(document, choice=unmet)) == "Tolerance 0.01%: nearest is 60 modes"


def test_design_changes() -> None:
    assert change_text("cold_seconds", 13.94) == "13.9 s"
    assert change_text("impulse_error", -4.7e-4) == "−4.7e-04"
    assert change_text("stages", {"mesh": "fresh", "morph": "ran"}) == "mesh: fresh, morph: ran"
    assert (change_text("change", "barrel"), change_text("x", None), change_text("n", 1200)) == ("barrel", "–", "1,200")


def test_chains_of_steps_and_of_accuracies_are_told_apart() -> None:
    document = documents.small()
    chains = [
        Chain("step", ["30 modes", "finer"], [1e-6, 5e-7], [0.1, 0.0], [0.1, 0.0], None, None),
        Chain("step", ["60 modes", "tighter"], [1e-8, 1e-10], [0.1, 0.0], [0.1, 0.0], None, None),
        Chain("basis", ["30 modes", "60 modes"], [36, 66], [0.1, 0.0], [0.1, 0.0], None, None),
        Chain("mesh", ["30 modes", "60 modes"], [0.1, 0.05], [0.1, 0.0], [0.1, 0.0], None, None),
    ]
    found = axes_of(document, documents.quantity("impulse", chains=chains))
    assert {what: len(group) for what, group in found.items()} == {
        "step": 1,
        "accuracy": 1,
        "coordinates": 1,
        "edge length": 1,
    }


def test_table_that_is_printed() -> None:
    """Few quantities have a column each, of many the largest error stands; columns that nothing fills are left out."""
    text = report_text(documents.small())
    assert "| run | coordinates | impulse | energy drift | steps | CPU time |" in text
    assert "| 30 modes | 36 | −0.82% | 2e-11 | 4,000 | 50 ms |" in text
    names = [f"q{i}" for i in range(9)]
    runs = [documents.run("a|b", None, 1.0, errors=dict.fromkeys(names, 0.02), energy_drift=None)]
    text = report_text(documents.document(runs, [documents.quantity(name) for name in names]))
    assert "| run | coordinates | largest error | of | steps | CPU time |" in text
    assert "| a/b | 36 | 2.00% | q0 | 4,000 | 1 s |" in text
    failed = [documents.run("a", 0.1, 1.0), documents.run("b", None, 1.0, result="DIVERGED")]
    text = report_text(documents.document(failed, [documents.quantity("impulse")]))
    assert "| b | 36 | – | DIVERGED | 2e-11 | 4,000 | 1 s |" in text
    text = report_text(documents.large())
    assert "Does not converge over this sweep, not fitted: chatter" in text
    assert "- penalty, event: a law has no exact motion between events" in text
    assert "| 20 µm barrel | −8.90% |" in text


def test_the_command_to_use_is_a_command() -> None:
    """That of a report of one timed run per setting had `--repeat`, which `gudgeon run` does not take."""
    how = Effort(repeat=1, tolerance=0.05, same_mesh=True)
    command = command_text(Path("data/rod/scene.toml"), ["run.duration=2e-4"], how)
    met = Choice(0.05, "30 modes", {}, 0.0082, "impulse", 0.05, "")
    chosen = replace(documents.small(), command=command, choice=met)
    text = use_text(chosen)
    options = build_parser().parse_args(shlex.split(text)[1:])
    assert (options.scene, options.set, options.tolerance) == ("data/rod/scene.toml", ["run.duration=2e-4"], 0.05)
    assert options.same_mesh
