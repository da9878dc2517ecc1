"""CPU time of the solve stage of every scene beside another clone's, in processes of their own that take turns.

`python -m tests.benchmarks.solves CLONE [SCENE…]` prints a table. Each process compiles its system once, runs it twice,
or for two seconds, and tells the shortest time; the clone has an environment of its own, and nothing is written there.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

from tests.scenes import scene_files

ROOT = Path(__file__).parents[2]
ROUNDS = 3
SHORT, LONG = 2.0, 20.0
"""Seconds of all runs of a process up to which it goes on, and of one run from which it is not repeated."""
WORK = """
import sys, time, json
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.solver.simulate import simulate
scene, folder, checks = sys.argv[1:]
places = {"db": folder + "/db", "out": folder + "/" + scene.replace("/", "-")}
sets = {} if checks == "True" else {"run.checks": False}
run(scene, **places, set=sets, until="morph")
system, found = system_of(open_job(scene, **places, set=sets)), []
while sum(found) < (SHORT if len(found) > 1 else LONG):
    begin = time.process_time()
    done = simulate(system)
    found.append(time.process_time() - begin)
print(json.dumps([min(found), done.counts["integrator"], done.counts["steps"]]))
"""


def solve(clone: Path, scene: str, *, checks: bool) -> tuple[float, str, int] | None:
    """Return CPU seconds, integrator and steps of a scene's run in a clone; None where it has none.

    Args:
        checks: Whether errors are estimated by further runs, as the scene says.
    """
    environment = os.environ | dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    work = WORK.replace("SHORT", str(SHORT)).replace("LONG", str(LONG))
    folder = str(ROOT / "out/solves" / ("here" if clone == ROOT else "other"))
    command = [str(clone / ".venv/bin/python"), "-c", work, scene, folder, str(checks)]
    done = subprocess.run(command, cwd=clone, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        return None
    seconds, integrator, steps = json.loads(done.stdout.splitlines()[-1])
    return seconds, integrator, steps


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.solves", description=__doc__)
    parser.add_argument("clone", type=Path, help="another clone, with an environment")
    parser.add_argument("scenes", nargs="*", help="scene files; all where none is named")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="turns of both, of which the median counts")
    parser.add_argument(
        "--no-checks", dest="checks", action="store_false", help="one run at the integrator's step, without estimates"
    )
    asked = parser.parse_args()
    scenes = asked.scenes or [str(path.relative_to(ROOT)) for path in scene_files().values()]
    print("| scene | integrator, steps | other [s] | here [s] | ratio |\n|---|---|---:|---:|---:|", flush=True)
    for scene in scenes:
        turns = [
            (solve(asked.clone, scene, checks=asked.checks), solve(ROOT, scene, checks=asked.checks))
            for _ in range(asked.rounds)
        ]
        rows = [(other, here) for other, here in turns if other and here]
        if not rows:
            print(f"{scene}: no run", file=sys.stderr)
            continue
        other, here = (statistics.median(row[side][0] for row in rows) for side in range(2))
        (_, before, old), (_, after, new) = rows[0]
        text = f"{after}, {new}" + ("" if (before, old) == (after, new) else f" (other: {before}, {old})")
        name = "/".join(Path(scene).parts[-2:])
        print(f"| {name} | {text} | {other:.3g} | {here:.3g} | {here / other:.2f} |", flush=True)


if __name__ == "__main__":
    main()
