"""Step and window of a report's runs: the same for all, and a step that is not accurate is said."""

import pytest

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.report import steps
from gudgeon.pipeline.report.steps import with_steps, with_window
from gudgeon.pipeline.report.sweep import Setting
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.run import run_job
from tests.pipeline.small import write_scene

IMPLICIT = {"run": {"integrator": "small"}}


def silent(stage: str, share: float) -> None:
    """Tell nobody."""


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    folder = tmp_path_factory.mktemp("steps")
    return open_job(write_scene(folder / "scene"), db=folder / "db", out=folder / "out")


def test_step_is_found_once_for_each_integrator(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    """Given steps stay, and no setting makes estimates of its own."""
    called, original = [], steps.made
    monkeypatch.setattr(steps, "made", lambda *given: (called.append(given), original(*given))[1])
    settings = [
        Setting("a", {}), Setting("b", {"component": {"skirt": {"modes": {"normal_count": 4}}}}),
        Setting("c", IMPLICIT), Setting("d", {"run": {"step": 1e-6}}),
    ]  # fmt: skip
    (a, b, c, d), notes = with_steps(job, settings, silent)
    assert len(called) == 1, "the integrator that is chosen is the one that the third setting names"
    assert notes == []
    assert [one.changes["run"]["checks"] for one in (a, b, c, d)] == [False] * 4
    assert a.changes["run"]["step"] == b.changes["run"]["step"] == c.changes["run"]["step"]
    assert d.changes["run"]["step"] == 1e-6
    found = job.store.get(job.trajectory().key, "trajectory")
    assert a.changes["run"]["step"] == found.counts["step"]
    assert found.estimates["step.impulse"] <= 1e-3
    assert with_steps(job, settings, silent) == ([a, b, c, d], [])


def test_a_step_that_is_not_found_is_said(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    def too_long(*given: object) -> None:
        raise StageError("stopped at 3% of the duration")

    monkeypatch.setattr(steps, "made", too_long)
    (setting,), notes = with_steps(job, [Setting("a", {})], silent)
    assert setting.changes == {"run": {"checks": False}}
    assert notes == [
        "Step of small, from 'a': the first one of the integrator is used, its error is not estimated: stopped at 3%"
        " of the duration"
    ]


def test_all_runs_have_the_window_of_the_scene(job: Job) -> None:
    """A basis with fewer modes would average its peak force over a longer time."""
    fewer = {"component": {"skirt": {"modes": {"normal_count": 2}}}}
    run_job(job, "morph")
    (own, other), window = with_window(job, [Setting("a", {}), Setting("b", fewer)])
    assert 0 < window <= system_of(job).separation
    assert own.changes["run"]["window"] == other.changes["run"]["window"] == window
    assert other.changes["component"] == fewer["component"]
    alone = variant(job, fewer)
    run_job(alone, "morph")
    assert system_of(alone).separation > window


def test_a_window_of_a_setting_stays(job: Job) -> None:
    """Then no window is that of all runs."""
    run_job(job, "morph")
    (a, b), window = with_window(job, [Setting("a", {"run": {"window": 1e-6}}), Setting("b", {})])
    assert a.changes["run"]["window"] == 1e-6
    assert 0 < b.changes["run"]["window"] <= system_of(job).separation
    assert window == 0.0
    given = variant(job, {"run": {"window": 2e-6}})
    run_job(given, "morph")
    (c,), window = with_window(given, [Setting("c", {})])
    assert variant(given, c.changes).scene.run.window == window == 2e-6
