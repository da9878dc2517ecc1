"""Rod on rod against Exudyn: error against the exact pulse, and CPU seconds per simulated millisecond.

Both run in a process of their own with one thread each (`python -m tests.benchmarks.test_exudyn FOLDER` is that
process; `--full-fe` after it runs full FE on the same mesh alone). The time loops are counted on either side; two rows
have what a run does beside, such as its quantities, one of them with the runs that choose its step and estimate its
errors. Errors are rms over the middle 90 % of d'Alembert's plateau, relative to it. Restitution is 2 J / (m v) − 1, so
that an impulse lost shows on both sides alike.
"""

import importlib.util
import json
import os
import subprocess
import sys
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.integrators.steps import Plan, plan_run
from gudgeon.solver.results.trajectory import Histories
from gudgeon.solver.simulate import simulate
from gudgeon.solver.simulate import start as begin
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System
from tests.benchmarks.exudyn_rods import Setup, reduced, rod_of, strike
from tests.benchmarks.exudyn_small import small, strike_small

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "data" / "rods-3d"
EDGE = 0.05
"""Share of the plateau that is left out at either end."""
COORDINATES = 46
RITZ_VECTORS = 160
"""Of which these are the lowest that the impact excites."""
STIFFNESSES = (2e8, 3.5e8, 6e8, 1e9)
"""Contact stiffnesses that Exudyn is given [N/m]; the best of each basis stands between the outer ones."""
STEPS = (2e-6, 5e-6, 1e-5)
"""Longer steps [s], which are told beside: Exudyn's errors hardly grow with them, its cost falls."""
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
REPEATS = 50
"""Of our time loop, which takes about a millisecond."""

LONG_STEPS = (6e-6, 5e-6, 4e-6, 3e-6)
"""Of full FE [s], beyond those of the scene: its errors are small there, too."""
LARGEST_ERROR = 0.08
LEAST_RATIO = 500
SAME_ERROR = 0.005
"""How far errors may lie apart where both programs have the same shapes and the same spring, of the plateau."""


@dataclass(frozen=True)
class Row:
    """One run."""

    program: str
    stiffness: float | None
    """Of the contact [N/m]; None where it is R."""
    step: float
    """[s]"""
    cpu_per_ms: float
    """CPU seconds per simulated millisecond."""
    force_error: float
    restitution: float


def rows(folder: Path) -> list[Row]:
    """Run both programs; needs Exudyn."""
    job = prepared(folder)
    found = [ours(job, "Gudgeon, R and dashpot")]
    found += [whole(folder, f"Gudgeon, {what}", what == "estimates too") for what in ("whole run", "estimates too")]
    found.append(ours(prepared(folder, **{"run.integrator": "event", "run.samples": 600}), "Gudgeon, event"))
    found += full_fe(folder)
    rod, duration = rod_of(job, "rod", back="back", front="front"), job.scene.run.duration
    for basis in ("eigenmodes", "hurty-craig-bampton", "ours"):
        setup = Setup(basis, COORDINATES, STIFFNESSES[0])
        body = reduced(rod, setup)

        def run(setup: Setup, body: Any = body) -> Row:
            impact = strike(rod, body, setup, speed=1.0, duration=duration)
            label, cpu = f"Exudyn, {setup.basis}", impact.cpu_seconds / (1e3 * duration)
            impulse = float(np.trapezoid(impact.force, impact.times))
            return Row(label, setup.stiffness, setup.step, cpu, *judged(impact.times, impact.force, impulse))

        swept = [run(replace(setup, stiffness=stiffness)) for stiffness in STIFFNESSES]
        best = min(swept, key=lambda row: row.force_error)
        longer = [run(replace(setup, stiffness=best.stiffness, step=step)) for step in STEPS]
        found += swept + longer
        if basis == "ours":
            bodies = small(rod, setup)
            for step in (Setup.step, *STEPS):
                small_setup = replace(setup, stiffness=best.stiffness or 0.0, step=step)
                impact = strike_small(bodies, small_setup, speed=1.0, duration=duration)
                cpu, impulse = impact.cpu_seconds / (1e3 * duration), float(np.trapezoid(impact.force, impact.times))
                errors = judged(impact.times, impact.force, impulse)
                found.append(Row("Exudyn, small motion", best.stiffness, step, cpu, *errors))
            found.append(ours(with_spring(folder, best.stiffness), "Gudgeon, the same spring", best.stiffness))
    return found


def prepared(folder: Path, **changes: Any) -> Job:
    """Bring the scene up to the solver. Frames are not wanted here, Exudyn stores none."""
    modes = {"component.rod.modes.normal_count": COORDINATES, "component.rod.modes.ritz_count": RITZ_VECTORS}
    run = {"run.frames": 2, "run.checks": False}
    job = open_job(SCENE, set=run | modes | changes, db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    return job


def full_fe(folder: Path) -> list[Row]:
    """Run full FE on the same mesh with each step of the scene; factors are counted, as in reports."""
    job, found = prepared(folder), []
    assert job.scene.report.full_fe is not None
    problem = nodal_problem(job)
    for step in (*LONG_STEPS, *job.scene.report.full_fe.steps):
        run = simulate_nodal(problem, step)
        force = np.abs(run.force[:, 2])
        errors = judged(run.times - step / 2, force, float(force.sum() * step))
        found.append(Row("full FE", None, step, run.cpu_seconds / (1e3 * job.scene.run.duration), *errors))
    return found


def with_spring(folder: Path, stiffness: float | None) -> Job:
    """Return the scene with a penalty spring [N/m] on the whole face."""
    assert stiffness is not None
    box = open_job(SCENE, db=folder / "db").scene.component["rod"].geometry.model_dump()
    spring = {"method": "penalty", "dashpot": "none", "surface_stiffness": stiffness / (box["lx"] * box["ly"])}
    return prepared(folder, **{f"contact.pair.{key}": value for key, value in spring.items()})


def ours(job: Job, label: str, stiffness: float | None = None) -> Row:
    """Run Gudgeon's solver; the time is that of the time loop alone, as of Exudyn after `Assemble`."""
    system, plan, trajectory = solved(job)
    seconds = [integration_seconds(system, plan) for _ in range(REPEATS if plan.name == "small" else 1)]
    force = np.abs(trajectory.contacts["pair"].force[:, 2])
    interval = trajectory.times[1] - trajectory.times[0]
    errors = judged(trajectory.times - interval / 2, force, float(force.sum() * interval))
    step = 0.0 if plan.name == "event" else trajectory.counts["step"]
    return Row(label, stiffness, step, min(seconds) / (1e3 * job.scene.run.duration), *errors)


def solved(job: Job) -> tuple[System, Plan, Trajectory]:
    """Return the system, its its plan and its run."""
    system = compile_system(job.store, job.scene, {name: s["morph"].key for name, s in job.components().items()})
    return system, plan_run(system), simulate(system)


def integration_seconds(system: System, plan: Plan) -> float:
    """Return the CPU seconds of the time loop alone."""
    schedule, integrator = plan.schedule, begin(system, plan)
    samples = Histories.empty(system, schedule).samples
    first = time.process_time()
    for frame in range(schedule.frames):
        here = slice(frame * schedule.samples_per_frame, (frame + 1) * schedule.samples_per_frame)
        assert integrator.advance(here.start * schedule.stride, schedule.stride, samples.part(here))
    return time.process_time() - first


def whole(folder: Path, label: str, checks: bool) -> Row:
    """Run all that follows compilation; with `checks` also the runs that choose the step and estimate errors."""
    job = prepared(folder, **{"run.checks": checks})
    one = ours(job, label)
    system, seconds = solved(job)[0], []
    for _ in range(REPEATS):
        first = time.process_time()
        simulate(system)
        seconds.append(time.process_time() - first)
    return replace(one, cpu_per_ms=min(seconds) / (1e3 * job.scene.run.duration))


def judged(times: np.ndarray, force: np.ndarray, impulse: float) -> tuple[float, float]:
    """Return rms force error over the middle of the plateau and restitution."""
    entries = json.loads((SCENE / "rods_3d.json").read_text())["expected"]
    plateau, duration, whole = (
        entries[n]["value"] for n in ("contact_force_plateau", "contact_duration", "impulse")
    )  # fmt: skip
    middle = (times > EDGE * duration) & (times < (1 - EDGE) * duration)
    return float(np.sqrt(np.mean((force[middle] / plateau - 1) ** 2))), 2 * impulse / whole - 1


def show(row: Row) -> str:
    """Return a line of the table."""
    stiffness = "R" if row.stiffness is None else f"{row.stiffness:.1e}"
    step = "-" if row.step == 0 else f"{1e6 * row.step:.2g} µs"
    return (
        f"{row.program:28} {COORDINATES} coordinates a rod, {stiffness:>8} N/m, step {step:>8}:"
        f" {row.cpu_per_ms:9.2e} CPU s/ms, force error {row.force_error:6.1%}, restitution {row.restitution:.3f}"
    )


@pytest.mark.skipif(
    importlib.util.find_spec("exudyn") is None,
    reason="Exudyn is not installed, which is the extra `peers`: .venv/bin/python -m pip install -e '.[peers]'",
)
def test_rods_against_exudyn(benchmark: Any, tmp_path: Path) -> None:
    """At most 8 % error, and a 500th of the CPU time of each of Exudyn's bases at its best stiffness."""
    command = [sys.executable, "-m", "tests.benchmarks.test_exudyn", str(tmp_path)]
    options = {"cwd": ROOT, "env": os.environ | ONE_THREAD, "capture_output": True, "text": True}
    done = benchmark.pedantic(subprocess.run, (command,), options, rounds=1)
    assert done.returncode == 0, done.stderr
    found = [Row(**row) for row in json.loads(done.stdout.splitlines()[-1])]
    print("", *map(show, found), sep="\n")
    gudgeon, spring = found[0], found[-1]
    assert gudgeon.force_error <= LARGEST_ERROR
    for program in dict.fromkeys(row.program for row in found if row.program.startswith("Exudyn")):
        swept = [row for row in found if row.program == program]
        best = min((row for row in swept if row.step == Setup.step), key=lambda row: row.force_error)
        cheapest = min((row for row in swept if row.stiffness == best.stiffness), key=lambda row: row.cpu_per_ms)
        ratio, least = best.cpu_per_ms / gudgeon.cpu_per_ms, cheapest.cpu_per_ms / gudgeon.cpu_per_ms
        print(f"{program}: {ratio:.0f} times the CPU time; {least:.0f} times at steps of {1e6 * cheapest.step:.0f} µs")
        assert ratio >= LEAST_RATIO
        if program == "Exudyn, ours":
            assert spring.force_error == pytest.approx(best.force_error, abs=SAME_ERROR)


if __name__ == "__main__":
    folder, few = Path(sys.argv[1]), sys.argv[2:] == ["--full-fe"]
    print(json.dumps([asdict(row) for row in (full_fe(folder) if few else rows(folder))]))
