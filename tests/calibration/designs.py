"""`python -m tests.calibration.designs [--count N] [--write]`: stated and true errors of modes from stored designs.

Draws random changes of a liner, a piston and a bracket from CAD, takes each way, and compares the errors that it states
with those against modes of the moved mesh; `--write` writes table and picture into docs/design-change.md.
"""

import argparse
import re
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.design_change import ways
from gudgeon.pipeline.design_change.compliance import largest_change
from gudgeon.pipeline.design_change.estimate import estimated, sensitivity_of
from gudgeon.pipeline.design_change.family import Family
from gudgeon.pipeline.design_change.projection import Target
from gudgeon.pipeline.design_change.ways.certificate import probes
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.geometry.surfaces import cylindrical
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.reduction.acting import assembled, stacked
from gudgeon.pipeline.reduction.methods import ContactRows
from gudgeon.pipeline.reduction.methods.carried import target_of
from gudgeon.pipeline.reduction.methods.macneal import macneal
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.mesh import build_mesh
from tests.pipeline.geometry.cad_files import bracket, write_cad

ROOT = Path(__file__).resolve().parents[2]
PAGE, PICTURE = ROOT / "docs/design-change.md", ROOT / "docs/design-errors.png"
BEGIN, END = "<!-- design errors -->\n", "<!-- end of design errors -->"
COUNT, SEED = 60, 1
SMALLEST, LARGEST = 1e-4, 0.1
"""Sizes of changes, as shares of the wall."""
LOW, HIGH = 0.8, 1.25
ROUND_OFF = 1e-10
"""True errors below it are not compared."""
METHODS = {
    "1": {"reuse": "`reuse`", "project": "`project`, 1 stored", "inverse": "`inverse`, 1 step", "factor": "`factor`"},
    "3": {"project": "`project`, 3 stored"},
}
"""Words for the ways by the number of stored designs, one after another."""
NOTED = 0.2
"""Share of the largest error of a frequency from which others are compared."""
Shape = Callable[[MeshRecord], np.ndarray]


@dataclass(frozen=True)
class Part:
    """A part and how unit parameters move its nodes: by one wall for a value of 1."""

    name: str
    component: Component
    mesh: MeshRecord
    shapes: Mapping[str, Shape]
    reach: float = LARGEST
    """Largest size of a change."""

    @cached_property
    def movements(self) -> dict[str, np.ndarray]:
        """Displacement of the nodes [m] by each parameter, (n, 3)."""
        return {name: shape(self.mesh) for name, shape in self.shapes.items()}

    def moved(self, parameters: Mapping[str, float]) -> tuple[MeshRecord, Component]:
        """Return mesh and component of a design; `E` is the relative change of the modulus."""
        shift = sum((value * self.movements[name] for name, value in parameters.items() if name != "E"), 0.0)
        material = self.component.material
        assert material is not None
        material = material.model_copy(update={"E": material.E * (1 + parameters.get("E", 0.0))})
        return replace(self.mesh, nodes=self.mesh.nodes + shift), self.component.model_copy(
            update={"material": material}
        )

    def assembled(self, parameters: Mapping[str, float]) -> tuple[Target, ContactRows]:
        """Return the body of a design and its rows."""
        mesh, component = self.moved(parameters)
        _, acting, (_, model, spread) = assembled(mesh, component, "part", ())
        rows = stacked(acting, spread)
        return target_of(model, rows, component.modes.normal_count), rows


@dataclass(frozen=True)
class Row:
    """A stated and a true relative error."""

    part: str
    method: str
    quantity: str
    size: float
    stated: float
    true: float


def grown(mesh: MeshRecord) -> np.ndarray:
    """Return the movement by uniform growth of the whole part."""
    return mesh.nodes


def liner() -> Part:
    """Return the liner of data/piston/coarse.toml, held at its flange, with contact points on the thrust side."""
    job = open_job(ROOT / "data/piston/coarse.toml")
    tables = job.tables["component"]["liner"] | {
        "interface": {"thrust": {"surface": "bore", "sector_deg": [-48, 48]}},
        "modes": {"normal_count": 20},
    }
    component = Component.model_validate(tables)
    mesh = build_mesh(component, job.folder, "liner")
    wall, length, bore = 0.006, 0.140, 0.043

    def across(radial: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]) -> Shape:
        def shape(mesh: MeshRecord) -> np.ndarray:
            radius, angle, height = cylindrical(mesh.nodes, mesh.surfaces["bore"].shape)
            depth = np.clip((radius - bore) / wall, 0, 1)
            directions = mesh.nodes * [1.0, 1.0, 0.0] / radius[:, None]
            return directions * (wall * radial(depth, angle, height / length))[:, None]

        return shape

    shapes = {
        "wall": across(lambda depth, _, __: depth),
        "bore": across(lambda depth, _, __: 1 - depth),
        "ovality": across(lambda depth, angle, _: (1 - depth) * np.cos(2 * angle)),
        "taper": across(lambda depth, _, z: (1 - depth) * (z - 0.5)),
        "barrel": across(lambda depth, angle, z: (1 - depth) * np.cos(2 * angle) * 4 * z * (1 - z)),
        "temperature": grown,
    }
    return Part("liner", component, mesh, shapes)


def piston() -> Part:
    """Return the piston of the same scene, free, with contact points on its thrust side, pin and crown."""
    job = open_job(ROOT / "data/piston/coarse.toml")
    tables = job.tables["component"]["piston"] | {"modes": {"normal_count": 20}, "change": {}}
    tables["interface"] = {name: tables["interface"][name] for name in ("thrust", "pin", "crown")}
    component = Component.model_validate(tables)
    mesh = build_mesh(component, job.folder, "piston")
    wall, height, outer = 0.013, 0.034, 0.04296

    def skirt(radial: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Shape:
        def shape(mesh: MeshRecord) -> np.ndarray:
            radius, angle, z = cylindrical(mesh.nodes, mesh.surfaces["skirt"].shape)
            depth = np.clip((radius - (outer - wall)) / wall, 0, 1) * np.clip((0.052 - z) / (0.052 - height), 0, 1)
            directions = mesh.nodes * [1.0, 1.0, 0.0] / np.maximum(radius, 1e-9)[:, None]
            return -directions * (wall * depth * radial(angle, z / height))[:, None]

        return shape

    def offset(mesh: MeshRecord) -> np.ndarray:
        radius = np.hypot(mesh.nodes[:, 0], mesh.nodes[:, 2] - 0.018)
        return wall * np.outer(np.clip((0.026 - radius) / 0.010, 0, 1), [1.0, 0.0, 0.0])

    shapes = {
        "barrel": skirt(lambda _, z: (z - 0.4) ** 2),
        "ovality": skirt(lambda angle, _: 0.5 * (1 - np.cos(2 * angle))),
        "pin offset": offset,
        "temperature": grown,
    }
    return Part("piston", component, mesh, shapes, 0.04)


def angle_bracket(folder: Path) -> Part:
    """Return a bracket of CAD, held at its foot, with contact points on its upright leg."""
    path = write_cad(folder / "bracket.step", bracket)
    geometry = {"kind": "cad", "path": str(path)}
    component = Component.model_validate(
        {"geometry": geometry, "material": {"E": 210e9, "nu": 0.3, "rho": 7800}, "mesh": {"size": 0.007}}
    )
    mesh = build_mesh(component, folder, "bracket")
    top = max(mesh.surfaces, key=lambda name: mesh.nodes[np.unique(mesh.surfaces[name].facets), 2].mean())
    foot = min(mesh.surfaces, key=lambda name: mesh.nodes[np.unique(mesh.surfaces[name].facets), 2].mean())
    component = Component.model_validate(
        component.model_dump(mode="json", exclude_unset=True)
        | {"supports": [foot], "interface": {"tip": {"surface": top}}, "modes": {"normal_count": 20}}
    )
    leg = 0.008
    shapes = {
        "foot": lambda mesh: np.clip(mesh.nodes[:, 2:] / leg, 0, 1) * [0.0, 0.0, leg],
        "leg": lambda mesh: np.clip(mesh.nodes[:, :1] / leg, 0, 1) * [leg, 0.0, 0.0],
        "width": lambda mesh: mesh.nodes * [0.0, 1.0, 0.0],
        "height": lambda mesh: np.clip((mesh.nodes[:, 2:] - 0.020) / 0.040, 0, 1) * [0.0, 0.0, leg],
    }
    return Part("bracket from CAD", component, mesh, shapes)


class Calibration:
    """A part with its stored designs."""

    def __init__(self, part: Part) -> None:
        self.part, axis = part, next(iter(part.shapes))
        self.axis = axis
        places = [{}, {axis: -part.reach}, {axis: part.reach}]
        records = [self._record(parameters) for parameters in places]
        targets = [part.assembled(parameters)[0] for parameters in places]
        self.base = records[0]
        material = part.component.material
        assert material is not None
        self.families = {"1": Family(targets[:1], records[:1], material), "3": Family(targets, records, material)}
        self.derivatives = sensitivity_of(part.mesh, material, records[0])
        self.columns = {} if self.base.static_responses is None else self.base.static_responses.columns

    def _record(self, parameters: Mapping[str, float]) -> ModalRecord:
        mesh, component = self.part.moved(parameters)
        modes = component.modes.model_copy(update={"normal_count": 25})
        return reduce_component(mesh, "", component.model_copy(update={"modes": modes}), "part")

    def rows(self, random: np.random.Generator) -> Iterator[tuple[Row, float]]:
        """Yield the errors of a random change in all parameters, and of one within the stored designs, with costs."""
        part, size = self.part, float(np.exp(random.uniform(np.log(SMALLEST), np.log(self.part.reach))))
        names = [*part.shapes, "E"]
        directions = random.standard_normal(len(names))
        directions *= size / np.abs(directions).max()
        yield from self._errors(dict(zip(names, directions.tolist(), strict=True)), size, ("1",))
        place = float(random.uniform(-part.reach, part.reach))
        yield from self._errors({self.axis: place}, abs(place), ("3",))

    def _errors(self, parameters: dict[str, float], size: float, stored: Sequence[str]) -> Iterator[tuple[Row, float]]:
        target, rows = self.part.assembled(parameters)
        if target.B.shape[0] != self.base.row_count:
            return  # Contact points moved across an edge of their sector, where the product recomputes.
        start = time.process_time()
        exact = macneal(target.model, rows, self.part.component.modes)
        cost = time.process_time() - start
        at_rows = (rows.B @ exact.Phi) / exact.angular_frequencies
        truth = exact.angular_frequencies[: target.count], exact.residual_flexibility + at_rows @ at_rows.T
        yield from self._first_order(parameters, size, truth[0])
        for count in stored:
            search = ways.Search(target, self.families[count], self.columns, np.inf)
            for name, method in METHODS[count].items():
                begin = time.process_time()
                if (answer := ways.WAYS[name].answer(search)) is None:
                    continue
                errors = ways.certified(search, answer)
                taken = (time.process_time() - begin) / cost
                for row in self._compared(method, size, target, (answer, errors), truth):
                    yield row, taken

    def _first_order(self, parameters: Mapping[str, float], size: float, exact: np.ndarray) -> Iterator[Any]:
        if parameters.get("E"):
            return
        mesh, _ = self.part.moved(parameters)
        changes = estimated(self.derivatives, mesh.nodes - self.part.mesh.nodes).frequencies[: len(exact)]
        before = self.base.angular_frequencies[: len(exact)]
        true = np.abs(np.sort(before) / exact - 1).max()
        yield (
            Row(self.part.name, "`reuse`, first order", "frequency", size, float(np.abs(changes).max()), float(true)),
            0.0,
        )

    def _compared(
        self, method: str, size: float, target: Target, given: tuple[ways.Answer, ways.Errors], truth: tuple[Any, Any]
    ) -> Iterator[Row]:
        (answer, errors), flexibility = given, given[0].flexibility

        def row(quantity: str, stated: float, true: float) -> Row:
            return Row(self.part.name, method, quantity, size, abs(stated), abs(true))

        true = np.sqrt(answer.reduced.values[: target.count]) / truth[0] - 1
        for stated, error in zip(errors.frequencies, true, strict=True):
            if abs(error) > NOTED * np.abs(true).max():
                yield row("frequency", stated, error)
        for name, ends in self.columns.items():
            loads = target.loads[:, slice(*ends)]
            compliance = loads.T @ flexibility @ loads
            exact = loads.T @ truth[1] @ loads
            yield row("compliance", errors.compliances[name], largest_change(exact - compliance, compliance))
        forces = probes(flexibility)
        ratios = [np.einsum("ck,cd,dk->k", forces, C, forces) for C in (truth[1], flexibility)]
        yield row("random forces", errors.rows, float(np.abs(ratios[0] / ratios[1] - 1).max()))


def table(rows: Sequence[Row]) -> str:
    """Return stated over true errors by way and quantity."""
    groups: dict[tuple[str, str], list[float]] = defaultdict(list)
    for row in rows:
        if row.true > ROUND_OFF:
            groups[row.method, row.quantity].append(row.stated / row.true)
    lines = [
        f"| way | error of | figures | least | 2.5 % | median | 97.5 % | largest | {LOW:g} to {HIGH:g} |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for (method, quantity), ratios in groups.items():
        low, middle, high = np.percentile(ratios, [2.5, 50, 97.5])
        share = np.mean([LOW <= ratio <= HIGH for ratio in ratios])
        lines.append(
            f"| {method} | {quantity} | {len(ratios)} | {min(ratios):.2f} | {low:.2f} | {middle:.2f} | {high:.2f} |"
            f" {max(ratios):.2f} | {share:.1%} |"
        )
    return "\n".join(lines) + "\n"


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw true errors over the size of the change, by way, and stated over true ones."""
    methods = list(dict.fromkeys(row.method for row in rows))
    with style.styled():
        figure = style.new_figure(
            "Errors of modes from stored designs", "each point a random change of liner, piston or bracket",
            width=2100, height=900,
        )  # fmt: skip
        axes = figure.subplots(
            1, 2, gridspec_kw={"left": 0.07, "right": 0.98, "bottom": 0.14, "top": 0.82, "wspace": 0.2}
        )
        colours = (style.GREY, style.RED, style.BLUE, style.ORANGE, style.GREEN, style.INK)
        for method, colour in zip(methods, colours, strict=False):
            chosen = [row for row in rows if row.method == method and row.quantity == "frequency"]
            size, stated, true = np.array([(r.size, r.stated, max(r.true, 1e-14)) for r in chosen]).T
            axes[0].loglog(100 * size, true, ".", color=colour, ms=4, label=method.replace("`", ""))
            axes[1].semilogx(true, np.clip(stated / true, 0, 3), ".", color=colour, ms=4)
        axes[0].set_xlabel("size of the change [% of the wall]")
        axes[0].set_ylabel("true relative error of a frequency")
        axes[0].legend()
        axes[1].axhspan(LOW, HIGH, color=style.GROUND)
        axes[1].set_xlabel("true relative error of a frequency")
        axes[1].set_ylabel("stated over true error")
        axes[1].set_ylim(0, 3)
        style.save(figure, path)


def main() -> None:
    """Draw changes, compare and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--count",
        type=int,
        default=COUNT,
        help="changes of each part in all of its parameters, and as many in the first",
    )
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    rows, costs = [], defaultdict(list)
    with TemporaryDirectory() as folder:
        for make in (partial(angle_bracket, Path(folder)), liner, piston):
            part = make()
            calibration, random = Calibration(part), np.random.default_rng(SEED)
            for _ in range(arguments.count):
                for row, cost in calibration.rows(random):
                    rows.append(row)
                    costs[row.method].append(cost)
            print(part.name, Counter(row.part for row in rows)[part.name], flush=True)
    text = table(rows)
    print(text, {method: float(np.median(values)) for method, values in costs.items()})
    if arguments.write:
        page = PAGE.read_text(encoding="utf-8")
        write_text(PAGE, re.sub(f"{BEGIN}.*{END}", lambda _: BEGIN + text + END, page, flags=re.DOTALL))
        draw(rows, PICTURE)


if __name__ == "__main__":
    main()
