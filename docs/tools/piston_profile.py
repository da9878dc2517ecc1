"""The piston's profile, optimised: `python -m docs.tools.piston_profile [--evaluations 80]`, some minutes.

Scipy's DIRECT varies barrel and ovality of data/piston, on the meshes of coarse.toml over the expansion stroke, so that
the impulse of all slaps is least and no mean pressure over a patch exceeds a limit. Every design moves the nodes of the
cylinder, whose modes are kept while the estimates of what that neglects are within change.tolerance; else they are
computed again, and counted. The first design and the best one are then checked by modes of their own, on these meshes
and on the converged ones of stroke.toml.
"""

import argparse
import os
import runpy
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import threadpoolctl
from scipy.optimize import direct

from gudgeon.pipeline.errors import PipelineError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import solve_records
from gudgeon.pipeline.studies.executors import ONE_THREAD

FOLDER = Path("data/piston")
CHANGE = "component.piston.change"
START = np.array([20e-6, 60e-6])
"""Mean depth of the barrel at both ends, and ovality [m]: those of skirt-profile.csv."""
LEAST, MOST = np.array([5e-6, 20e-6]), np.array([45e-6, 120e-6])
LEAN = 5e-6
"""The barrel is by so much deeper at the top, and less at the bottom [m]."""
STROKE = {"run.duration": 0.012, "run.samples": 3000, "run.frames": 60}
SIDES = ("thrust", "anti")
SHORT = 1e-3
"""Longest slap [s]."""
PENALTY = 10.0
"""Of a pressure above the limit, relative to it, over the impulse of the first design."""
Places = dict[str, Any]


def profile(path: Path, design: np.ndarray) -> None:
    """Write the table of a design."""
    tables = runpy.run_path(str(FOLDER / "make_tables.py"))
    heights, angles = np.linspace(0, tables["SKIRT_HEIGHT"], 18), np.arange(-180, 181, 15)
    rows = [["height_m", *map(str, angles)]]
    for height in heights:
        values = tables["deviation"](height, angles, design[0] - LEAN, design[0] + LEAN, design[1])
        rows.append([f"{height:.3f}", *(f"{value:.10f}" for value in values)])
    path.write_text("\n".join(",".join(row) for row in rows) + "\n", encoding="utf-8")


class Designs:
    """Runs designs and counts what they cost."""

    def __init__(self, folder: Path, scene: str, changes: dict[str, Any]) -> None:
        self._folder, self._scene, self._changes = folder, scene, changes
        self.found: list[dict[str, Any]] = []
        self.recomputed = 0

    def run(self, design: np.ndarray, update: str = "reuse") -> dict[str, Any]:
        """Return slap, pressure, estimates and CPU seconds of a design."""
        name = f"{design[0] * 1e6:.4f}-{design[1] * 1e6:.4f}"
        for one in self.found:
            if one["name"] == name and one["update"] == update:
                return one
        table = (self._folder / f"{name}.csv").resolve()
        profile(table, design)
        change = self._changes | {f"{CHANGE}.update": update, f"{CHANGE}.profile.table": str(table)}
        places = {"db": self._folder / "db", "out": self._folder / "out"}
        job = open_job(FOLDER / self._scene, set=change, **places)
        try:
            report = solve_records(job, "solve")
        except PipelineError as error:
            if update != "reuse" or "tolerance" not in str(error):
                raise
            self.recomputed += 1
            return self.run(design, "recompute")
        found = {
            "name": name, "design": design.tolist(), "update": update, **figures(report.quantities),
            "changes": report.changes, "cpu": {key: stage.cpu for key, stage in report.stages.items()},
        }  # fmt: skip
        self.found.append(found)
        print(f"{update:9} barrel {design[0] * 1e6:6.2f} µm, ovality {design[1] * 1e6:6.2f} µm: slap"
              f" {found['slap']:.5f} N s, pressure {found['pressure'] / 1e6:.3f} MPa, {sum(found['cpu'].values()):.1f}"
              " s CPU", flush=True)  # fmt: skip
        return found


def figures(quantities: dict[str, Any]) -> dict[str, float]:
    """Return the impulse of all slaps [N s], the largest force of one [N], and the largest pressure of both sides [Pa].

    A slap is an impact that parts within `SHORT`: what presses longer carries the side thrust of the gas.
    """
    values = {name: one["value"] for name, one in quantities.items()}
    impacts = [
        name.removesuffix(".impulse")
        for name in values
        if name.split(".")[0] in SIDES and ".impact" in name and name.endswith(".impulse")
    ]
    slaps = [one for one in impacts if values[f"{one}.end"] - values[f"{one}.start"] < SHORT]
    return {
        "slap": sum(values[f"{one}.impulse"] for one in slaps),
        "force": max(values[f"{one}.force_peak"] for one in slaps),
        "pressure": max(values[f"{side}.pressure_peak"] for side in SIDES),
    }


def main() -> None:
    """Optimise the profile and print all figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--evaluations", type=int, default=80)
    parser.add_argument("--limit", type=float, help="largest pressure [Pa] (default: that of the first design)")
    parser.add_argument("--folder", type=Path, help="keeps runs, to go on (default: a temporary one)")
    parser.add_argument("--no-converged", action="store_true", help="leave out the check on stroke.toml")
    options = parser.parse_args()
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    threadpoolctl.threadpool_limits(1)
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        optimise(folder, options)


def optimise(folder: Path, options: argparse.Namespace) -> None:
    """Print the course, the best design and its checks."""
    designs = Designs(folder, "coarse.toml", STROKE)
    first = designs.run(START)
    limit = options.limit or first["pressure"]

    def cost_of(design: np.ndarray) -> float:
        one = designs.run(np.asarray(design))
        return one["slap"] / first["slap"] + PENALTY * max(0.0, one["pressure"] / limit - 1)

    begin = time.monotonic()
    answer = direct(cost_of, list(zip(LEAST, MOST, strict=True)), maxfun=options.evaluations, eps=1e-3)
    seconds = time.monotonic() - begin
    admissible = [one for one in designs.found if one["pressure"] <= limit * (1 + 1e-3)]
    best = min(admissible, key=lambda one: one["slap"])
    kept = [one for one in designs.found if one["update"] == "reuse"]
    cost = float(np.median([one["cpu"]["morph"] + one["cpu"]["solve"] for one in kept[1:]]))
    print(f"\n{answer.message}; {len(designs.found)} designs in {seconds:.0f} s, {designs.recomputed} computed"
          " modes again")  # fmt: skip
    for name, one in (("first", first), ("best", best)):
        estimates = one["changes"].get("piston", {})
        frequency = np.abs(estimates.get("frequency_changes", [0.0])).max()
        compliance = max(map(abs, estimates.get("compliance_changes", {"": 0.0}).values()))
        texts = [f"{size * 1e6:.2f}" for size in one["design"]]
        print(f"{name}: barrel {texts[0]} µm, ovality {texts[1]} µm; slaps {one['slap']:.4f} N s, largest force"
              f" {one['force']:.0f} N, pressure {one['pressure'] / 1e6:.2f} MPa; estimates: frequencies"
              f" {frequency:.2%}, compliance {compliance:.2%}")  # fmt: skip
    again = [Designs(folder, "coarse.toml", STROKE).run(np.array(one["design"]), "recompute") for one in (first, best)]
    dear = max(sum(one["cpu"].values()) for one in again)
    print(f"CPU of a design: {cost:.2f} s with kept modes, {dear:.2f} s with computed ones: {dear / cost:.2f} times")
    for name, kept_one, own in zip(("first", "best"), (first, best), again, strict=True):
        parts = [f"{key} {kept_one[key] / own[key] - 1:+.2e}" for key in ("slap", "force", "pressure")]
        print(f"{name}: reuse against recompute: {', '.join(parts)}")
    print(f"slap {best['slap'] / first['slap'] - 1:+.1%}, pressure {best['pressure'] / limit - 1:+.1%} of the limit")
    if not options.no_converged:
        fine = Designs(folder, "stroke.toml", {})
        checks = [fine.run(np.array(one["design"]), "recompute") for one in (first, best)]
        print(f"converged mesh, modes of their own: slap {checks[1]['slap'] / checks[0]['slap'] - 1:+.1%}, pressure"
              f" {checks[1]['pressure'] / checks[0]['pressure'] - 1:+.1%}")  # fmt: skip


if __name__ == "__main__":
    main()
