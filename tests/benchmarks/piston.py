"""The stroke of the piston by full FE, by a rival reduction and by Gudgeon: CPU seconds and errors of one command.

`python -m tests.benchmarks.piston FOLDER`, one thread, some ten minutes. FOLDER keeps the database. Errors are the
largest of impulse and windowed force (40 µs) of each impact and of both sides, the impact at the end of the run left
out, against full FE at 8 and 4 µs, extrapolated by order 2.
"""

import fnmatch
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.integrators.steps import plan_run
from gudgeon.solver.results.trajectory import Histories
from gudgeon.solver.simulate import simulate, start

SCENE = Path(__file__).parents[2] / "data" / "piston" / "stroke.toml"
MODES = {"normal": (150, 0), "rival": (30, 100_000)}
"""Normal modes and static vectors of each body; there are fewer of these."""
PENALTY = {"contact.thrust.method": "penalty", "contact.anti.method": "penalty"}
COMPARED = ("*.impulse", "*.force_peak")
FULL_FE = (8e-6, 4e-6)
"""Steps [s]."""
REPEATS = 5
Quantities = dict[str, float]


def job_of(folder: Path, basis: str, **changes: Any) -> Job:
    """Return the stroke with 150 normal modes, or with 30 and all static vectors, up to its bodies."""
    normal, static = MODES[basis]
    kept = {"normal_count": normal, "static_count": static}
    modes = {f"component.{name}.modes.{key}": count for name in ("piston", "liner") for key, count in kept.items()}
    fixed = {"run.checks": False, "run.window": 4e-5}
    job = open_job(SCENE, set=modes | fixed | changes, db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    return job


def reduced(job: Job) -> tuple[Quantities, float, float, float]:
    """Return quantities, the mean step [s], and the CPU seconds of the time loop and of the run, least of some."""
    system = system_of(job)
    plan, loops, runs = plan_run(system), [], []
    for _ in range(REPEATS):
        begun = time.process_time()
        trajectory = simulate(system)
        runs.append(time.process_time() - begun)
        schedule, integrator = plan.schedule, start(system, plan)
        samples = Histories.empty(system, schedule).samples
        begun = time.process_time()
        for frame in range(schedule.frames):
            rows = slice(frame * schedule.samples_per_frame, (frame + 1) * schedule.samples_per_frame)
            assert integrator.advance(rows.start * schedule.stride, schedule.stride, samples.part(rows))
        loops.append(time.process_time() - begun)
    quantities = {name: q["value"] for name, q in trajectory.quantities.items()}
    return quantities, job.scene.run.duration / trajectory.counts["steps"], min(loops), min(runs)


def full_fe(job: Job, step: float) -> tuple[Quantities, float, float]:
    """Return quantities and CPU seconds: of the run, and of assembly and factors before it."""
    begun = time.process_time()
    problem = nodal_problem(job)
    assembled = time.process_time() - begun
    run = simulate_nodal(problem, step)
    return {name: q["value"] for name, q in run.quantities.items()}, run.cpu_seconds, assembled


def largest_error(quantities: Quantities, truth: Quantities) -> tuple[float, str]:
    """Return the largest relative error, and of which quantity."""
    last = {max((n for n in truth if fnmatch.fnmatch(n, f"{side}.impact*.impulse")), default="") for side in SIDES}
    cut = tuple(name.removesuffix("impulse") for name in last)
    names = [n for n in truth if any(fnmatch.fnmatch(n, p) for p in COMPARED) and not n.startswith(cut)]
    return max((abs(quantities.get(n, 0.0) / truth[n] - 1), n) for n in names if truth[n])


SIDES = ("thrust", "anti")


def command(folder: Path, *changes: str) -> float:
    """Return the CPU seconds of `gudgeon solve` as a command, of a run that is not in the database, but its bodies."""
    new = f"run.window={4e-5 * (1 + 1e-12 * (time.time_ns() // 1000 % 10**9)):.17g}"
    sets = [f"component.{name}.modes={{normal_count=150,static_count=0}}" for name in ("piston", "liner")]
    arguments = [word for change in (*sets, new, *changes) for word in ("--set", change)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [str(Path(sys.executable).with_name("gudgeon")), "solve", str(SCENE), "--db", str(folder / "db"), "--out",
         str(folder / "out"), *arguments], check=True, capture_output=True,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(folder: Path) -> None:
    """Measure and print."""
    begun = time.process_time()
    normal = job_of(folder, "normal", **{"run.step": 8e-6})
    print(f"mesh and 150 modes of both bodies, 0 if they are in the database: {time.process_time() - begun:.1f} s")
    coarse, fine = (full_fe(normal, step) for step in FULL_FE)
    truth = {n: value + (value - coarse[0][n]) / 3 for n, value in fine[0].items() if n in coarse[0]}
    for step, (quantities, seconds, before) in zip(FULL_FE, (coarse, fine), strict=True):
        row(f"full FE, assembly {before:.1f} s", step, seconds, None, largest_error(quantities, truth))
    for step in (8e-6, 4e-6):
        job = job_of(folder, "normal", **{"run.step": step})
        quantities, mean, loop, whole = reduced(job)
        row("gudgeon, 150 normal modes, R", mean, loop, whole, largest_error(quantities, truth))
    for step in (3.2e-5, 1.6e-5):
        job = job_of(folder, "rival", **PENALTY, **{"run.step": step})
        quantities, mean, loop, whole = reduced(job)
        row("30 normal, all static vectors, penalty", mean, loop, whole, largest_error(quantities, truth))
    print(f"`gudgeon solve`, default: {command(folder):.2f} s")
    without = command(folder, "run.checks=false", "run.step=8e-6")
    print(f"`gudgeon solve`, run.checks = false, steps of 8 µs: {without:.2f} s")


def row(label: str, step: float, loop: float, whole: float | None, error: tuple[float, str]) -> None:
    """Print a line of the table."""
    run = "" if whole is None else f", whole run {whole:.3g} s"
    print(f"{label:40} step {1e6 * step:5.2f} µs: {loop:8.3g} s{run}, error {error[0]:.2%} of {error[1]}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
