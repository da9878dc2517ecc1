"""Wear of the piston's skirt and the liner over many cycles: `python -m docs.tools.skirt_wear`, some minutes.

Archard's law at every contact point of data/piston, h = k/H ∫ p |v| dt with the point's pressure and the piston's speed
along the liner, over the expansion stroke on the meshes of coarse.toml. The steps over cycles are those of `gudgeon
wear`. Worn depths of the skirt move its nodes, as a table of its profile; its modes are kept while the estimates of
what that neglects are within change.tolerance, else they are computed again, and counted. The liner's depths are added
up where the points pass it and reported; they do not act back.
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import griddata

from gudgeon.pipeline.errors import PipelineError
from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.geometry.profile import read_rows
from gudgeon.pipeline.kinds import kind_of, open_job
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.pipeline.wear.cycles import Asked, History, run_cycles
from gudgeon.pipeline.wear.shapes import Cycle, Ended, Shapes, Soft

FOLDER, SCENE = Path("data/piston"), "coarse.toml"
CHANGE = "component.piston.change"
STROKE = {"run.duration": 0.012, "run.samples": 3000, "run.frames": 1000}
SKIRT, LINER = 1e-7 / 1e9, 2e-8 / 2e9
"""k/H of both [1/Pa]."""
CLEARANCE, DEEPEST = 40e-6, 40e-6
"""By which differences of depths are measured, and depth at which the wear ends [m]."""
SIDES = ("thrust", "anti")
GRID = np.linspace(0.0, 0.034, 35), np.arange(-180.0, 181.0, 5.0)
"""Heights [m] and angles [deg] of the worn profile."""
BANDS = 60
"""Of the liner along its axis."""


class Skirt:
    """A piston whose skirt wears."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._number, self.recomputed = folder, 0, 0
        self.estimates: list[float] = []
        self.liner = np.zeros((2, BANDS))
        """Depth that the last run wears off the liner in a cycle, the largest over the angle in each band [m]."""
        head, *rows = read_rows(FOLDER / "skirt-profile.csv", "profile table")
        table = np.array([[float(cell) for cell in row] for row in rows])
        angles = np.array([float(cell) for cell in head[1:]])
        each = np.array([np.interp(GRID[1], angles, row) for row in table[:, 1:]])
        self._profile = np.array([np.interp(GRID[0], table[:, 0], column) for column in each.T]).T
        record = self._run({name: np.zeros((1, 1, 0)) for name in SIDES})
        self._contacts = {name: record.contacts[name] for name in SIDES}

    def start(self) -> Shapes:
        """Return the unworn skirt."""
        return {name: np.zeros((1, 1, len(one.points))) for name, one in self._contacts.items()}

    def scales(self) -> dict[str, float]:
        """Return the clearance of both sides [m]."""
        return dict.fromkeys(SIDES, CLEARANCE)

    def deepest(self, name: str) -> tuple[float, str]:
        """Return the depth at which wear ends, and why."""
        return DEEPEST, f"side {name} is worn by {DEEPEST:g} m"

    def cycle(self, shapes: Shapes, soft: Soft, tell: Progress) -> Cycle:
        """Return what a stroke wears off each point."""
        found = self._run(shapes)
        if found.result != "FINISHED":
            raise Ended(found.result)
        speed = np.abs(np.interp(found.frame_times, found.times, found.motion["piston"][:, 8]))
        place = np.interp(found.frame_times, found.times, found.motion["piston"][:, 2])
        step = np.diff(found.frame_times, prepend=0.0)
        rate = {}
        for row, (name, one) in enumerate(found.contacts.items()):
            assert one.areas is not None
            slid = one.multipliers * (speed * step)[:, None]
            rate[name] = (SKIRT / one.areas * slid.sum(axis=0))[None, None]
            self.liner[row] = self._on_liner(one.points[:, 2], one.areas, place, slid)
        numbers = {name: entry["value"] for name, entry in found.quantities.items()}
        return Cycle(rate, Soft(), numbers, "")

    def _on_liner(self, heights: np.ndarray, areas: np.ndarray, place: np.ndarray, slid: np.ndarray) -> np.ndarray:
        """Return the mean depth of bands of the liner beside a contact [m], (BANDS,)."""
        at = heights[None] + place[:, None]
        edges = np.linspace(at.min(), at.max(), BANDS + 1)
        work = np.histogram(at.ravel(), edges, weights=slid.ravel())[0]
        width = areas.sum() / np.ptp(heights)
        return LINER * work / (width * np.diff(edges))

    def _run(self, shapes: Shapes) -> Any:
        """Return the run of a worn skirt."""
        self._number += 1
        table = (self._folder / f"worn-{self._number}.csv").resolve()
        profile = self._profile + self._worn(shapes)
        head = ["height_m", *(f"{angle:g}" for angle in GRID[1])]
        rows = [[f"{z:.6f}", *(f"{x:.12f}" for x in row)] for z, row in zip(GRID[0], profile, strict=True)]
        write_text(table, csv_text([head, *rows]))
        for update in ("reuse", "recompute"):
            change = STROKE | {f"{CHANGE}.update": update, f"{CHANGE}.profile.table": str(table)}
            places = {"db": self._folder / "db", "out": self._folder / "out"}
            job = open_job(FOLDER / SCENE, set=change, **places)
            try:
                report = kind_of(job).solve(job, "solve", None)
            except PipelineError as error:
                if update != "reuse" or "tolerance" not in str(error):
                    raise
                self.recomputed += 1
                continue
            if own := report.changes.get("piston"):
                self.estimates.append(max(map(abs, own["compliance_changes"].values())))
            return job.store.get(job.trajectory().key, "trajectory")
        raise AssertionError

    def _worn(self, shapes: Shapes) -> np.ndarray | float:
        """Return the change of the profile by worn depths: less radius."""
        change: np.ndarray | float = 0.0
        for name, shape in shapes.items():
            if not shape.any():
                continue
            points = self._contacts[name].points
            turn = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
            for full in (-360.0, 0.0, 360.0):
                places = np.column_stack([points[:, 2] / 0.034, (turn + full) / 45.0])
                grid = np.stack(np.meshgrid(GRID[0] / 0.034, GRID[1] / 45.0, indexing="ij"), axis=-1)
                change = change - griddata(places, shape[0, 0], grid, fill_value=0.0)
        return change


def main() -> None:
    """Print the course and draw the depths."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=float, default=1e6)
    parser.add_argument("--folder", type=Path, help="keeps runs, to go on (default: a temporary one)")
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        skirt = Skirt(folder)
        marks = [options.cycles / 100, options.cycles / 10, options.cycles]
        history = run_cycles(skirt, Asked(marks, 0.02), lambda stage, share: None, told)
        print(f"{history.runs} runs, {history.rejected} repeated; {skirt.recomputed} computed modes again; largest"
              f" estimate of the compliance {max(skirt.estimates):.2%}")  # fmt: skip
        done = history.updates[-1].cycles
        print(f"liner: {skirt.liner.max() * done * 1e6:.2f} µm after {done:g} cycles at the rate of the last run"
              f"{'' if history.reason is None else '; ' + history.reason}")  # fmt: skip
        if options.picture:
            style.draw(_to(options.picture), _figure, skirt, history)


def told(history: History) -> None:
    """Print the last update."""
    one = history.updates[-1]
    depths = ", ".join(f"{name} {shape.max() * 1e6:.3f} µm" for name, shape in one.shapes.items())
    force, pressure = (one.mean.quantities[f"thrust.{key}"] for key in ("force_peak", "pressure_peak"))
    print(f"{one.cycles:12.6g} cycles, difference {one.difference:.2%}: {depths}; thrust side {force:.0f} N,"
          f" {pressure / 1e6:.2f} MPa", flush=True)  # fmt: skip


def _to(path: Path) -> Any:
    from contextlib import nullcontext

    return nullcontext(path)


def _figure(skirt: Skirt, history: History) -> Any:
    """Draw the skirt's depths after the last cycle."""
    cycles, shapes = max(history.marks.items())
    figure = style.new_figure("Wear of the skirt", f"{cycles:g} cycles of the expansion stroke", width=1700, height=900)
    axes = figure.subplots(1, 2, gridspec_kw={"left": 0.07, "right": 0.97, "bottom": 0.12, "top": 0.79, "wspace": 0.3})
    for axis, (name, shape) in zip(axes, shapes.items(), strict=True):
        points = skirt._contacts[name].points
        turn = np.degrees(np.arctan2(points[:, 1], np.abs(points[:, 0])))
        drawn = axis.tricontourf(turn, points[:, 2] * 1e3, shape[0, 0] * 1e6, levels=12, cmap=style.MAGNITUDE)
        axis.set_title(f"{name} side", fontsize=9.5)
        axis.set_xlabel("angle from the side's middle [deg]")
        axis.set_ylabel("height [mm]")
        figure.colorbar(drawn, ax=axis, label="worn depth [µm]")
    return figure


if __name__ == "__main__":
    main()
