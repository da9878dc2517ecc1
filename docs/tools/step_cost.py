"""CPU time of steps taken one by one from Python beside the same steps inside the loop: the figure of docs/python.md.

python -m docs.tools.step_cost
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import gudgeon
from gudgeon.pipeline.kinds import run

SCENE, STEPS, TIMES = "data/rods-3d", 1000, 9
"""Scene, of two bodies with 60 modes each, steps of a trial, and trials of which the median counts."""
SETTINGS = {"component.rod.modes.reduction": "macneal", "run.integrator": "small"}


def main() -> None:
    """Print milliseconds of both ways, medians of interleaved trials."""
    with TemporaryDirectory() as folder:
        db = Path(folder) / "db"
        run(SCENE, set=SETTINGS, db=db, out=Path(folder) / "out", until="morph")
        taken: dict[str, list[float]] = {"one by one": [], "in the loop": []}
        for _ in range(TIMES):
            for way, found in taken.items():
                sim = gudgeon.simulation(SCENE, set=SETTINGS, db=db, out=Path(folder) / "out")
                sim.step(10)
                begin = time.process_time()
                if way == "in the loop":
                    sim.step(STEPS)
                else:
                    for _step in range(STEPS):
                        sim.step()
                found.append(1e3 * (time.process_time() - begin))
        for way, found in taken.items():
            print(f"{way:12} {sorted(found)[TIMES // 2]:8.1f} ms for {STEPS} steps")


if __name__ == "__main__":
    main()
